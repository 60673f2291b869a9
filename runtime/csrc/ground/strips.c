/* Massless rollers that stick beside contacts that stick: what the bearing takes cuts a strip out of the ground's
 * ellipse. Which of what rests gives way. The numbered rules are in
 * runtime/omniroll/effects/ground_with_massless_rollers.py; functions of one name do the same. */

/* ---- what the state says -------------------------------------------------------------------------------------- */

/* Rollers that rest stick so far. One that has come to rest at this instant takes what it is asked for there, which is
 * its sliding torque as near as the event is located: until that is known its size is infinite. */
static void stop_in_modes(const omniroll_run_t *run, const work_t *work)
{
    for (int i = 0; i < run->wheels; i++) {
        omniroll_bearing_t *const roller = in_series(run, work) + i;
        if (!roller->resting)
            continue;
        if (roller->mode)
            roller->size = roller->released ? 0 : INFINITY;
        roller->mode = 0;
    }
}

/* The torques of rollers that stick and whose contacts slip along these directions. */
static void asked_of_rollers(const omniroll_run_t *run, const work_t *work, const lanes_t *toward, double *asked)
{
    double arm[MOST_WHEELS], per_chi[MOST_WHEELS];
    lanes_t force[2*MOST_WHEELS], slope[4*MOST_WHEELS];
    find_arms(run->wheels, &work->vehicle, work->standing, run->joint, run->chi, arm, per_chi);
    set_sliding_forces(run->wheels, &work->vehicle, toward, work->load, work->friction, force, slope);
    (void)slope;
    for (int i = 0; i < run->wheels; i++)
        asked[i] = arm[i]*force[2*i][0];
}

/* A roller whose contact slips turns if it cannot stick (rule 2). */
static void turn_in_series(omniroll_bearing_t *roller, double asked)
{
    if (roller->size == INFINITY)
        roller->size = fabs(asked);
    const double most = most_of(roller), beyond = fabs(asked) - most;
    if (!(beyond > PASSED*rounding_of_holding(asked, most)) && !roller->released)
        return;
    roller->mode = asked > 0 ? -1 : 1;
    roller->resting = 0;
}

/* Which contacts rest, and which rollers turn where these do not rest both ways (rule 2); the others have directions of
 * their slips. */
static void find_resting_pairs(omniroll_run_t *run, const work_t *work)
{
    double pair[2*MOST_WHEELS], asked[MOST_WHEELS];
    lanes_t toward[2*MOST_WHEELS];
    int still[MOST_WHEELS];
    slips_now(run, work, pair);
    for (int i = 0; i < run->wheels; i++) {
        omniroll_grip_t *const grip = run->grips + i;
        const double size = length_of(pair + 2*i, 2);
        still[i] = size <= slip_rounding(run, i);
        if (still[i])
            stop_on_disk(in_series(run, work) + i);
        for (int k = 0; k < 2; k++) {
            grip->towards[k] = still[i] ? grip->towards[k] : pair[2*i + k]/size;
            toward[2*i + k] = lanes_of(grip->towards[k]);
        }
    }
    asked_of_rollers(run, work, toward, asked);
    for (int i = 0; i < run->wheels; i++) {
        omniroll_grip_t *const grip = run->grips + i;
        omniroll_bearing_t *const roller = in_series(run, work) + i;
        if (roller->resting && grip->carries && !grip->resting && !still[i])
            turn_in_series(roller, asked[i]);
        if (roller->size == INFINITY)
            roller->size = 0;
    }
    for (int i = 0; i < run->wheels; i++) {     /* contacts whose rollers turn slip along rolling directions alone */
        omniroll_grip_t *const grip = run->grips + i;
        const int turns = !in_series(run, work)[i].resting;
        pair[2*i] = turns ? 0 : pair[2*i];
        const double size = length_of(pair + 2*i, 2);
        const int rolls = turns && size <= slip_rounding(run, i);
        grip->resting = (grip->resting || still[i] || rolls) && grip->carries;
        for (int k = 0; k < 2 && !grip->resting && in_series(run, work)[i].mode; k++)
            grip->towards[k] = pair[2*i + k]/size;
    }
    roll(run, work, 0);
}

/* ---- what rests is decided together --------------------------------------------------------------------------- */

/* What rests: contacts both ways, contacts along the rolling direction alone, whose rollers turn, and axles. */
static void put_parts_and_rolls(omniroll_run_t *run, const work_t *work, parts_at_rest_t *rest, elements_t *problem)
{
    const omniroll_bearing_t *const rollers = in_series(run, work);
    rest->count = 0;
    for (int rolls = 0; rolls < 2; rolls++) {
        for (int i = 0; i < run->wheels; i++) {
            omniroll_grip_t *const grip = run->grips + i;
            grip->sticks = grip->resting;
            if (!grip->resting || rolls == rollers[i].resting)
                continue;
            rest->turned[rest->count] = rollers[i].released != 0;
            rest->broken[rest->count] = grip->released;
            rest->which[rest->count++] = i;
        }
        if (!rolls)
            rest->contacts = rest->count;
    }
    rest->rolls = rest->count - rest->contacts;
    for (int k = 0; k < work->own.rollers_at; k++)
        if (own_bearings(run)[k].resting) {
            rest->broken[rest->count] = own_bearings(run)[k].released != 0;
            rest->which[rest->count++] = k;
        }
    for (int k = 0; k < run->own_count; k++)
        own_bearings(run)[k].mode = own_bearings(run)[k].resting ? 0 : own_bearings(run)[k].mode;
    problem->count = rest->count, problem->wide = rest->contacts, problem->width = 2;
}

/* What bearings take along the axles of wheels that roll there, in N. */
static void find_taken(const omniroll_run_t *run, const work_t *work, const double *arm, double *taken)
{
    for (int i = 0; i < run->wheels; i++)
        taken[i] = in_series(run, work)[i].sliding/arm[i];
}

/* What the ground takes of a contact at most along the rolling direction, whose roller turns. */
static double left_beside_bearing(const omniroll_run_t *run, int i, const double *friction, double taken)
{
    const double most = run->grips[i].load*friction[0];
    return sqrt(fmax((most - taken)*(most + taken), 0))*friction[1]/friction[0];
}

/* Half-axes of the ellipses, and what the strips leave of them. */
static void put_reaches_and_strips(const omniroll_run_t *run, const work_t *work, const parts_at_rest_t *rest, const double *arm,
                        const double *taken, elements_t *problem)
{
    const int size = forces_at(problem->wide, problem->width, problem->count);
    double most = 0;
    for (int part = 0; part < rest->count; part++) {
        const int k = rest->which[part];
        double *const reach = problem->reach + forces_at(problem->wide, problem->width, part);
        if (part >= contact_parts(rest)) {
            reach[0] = rest->broken[part] ? own_bearings(run)[k].sliding : own_bearings(run)[k].holding;
            continue;
        }
        const omniroll_grip_t *const grip = run->grips + k;
        const double *const friction = rest->broken[part] ? grip->sliding : grip->staying;
        if (part >= rest->contacts) {
            reach[0] = left_beside_bearing(run, k, friction, taken[k]);
            continue;
        }
        const omniroll_bearing_t *const roller = in_series(run, work) + k;
        reach[0] = grip->load*friction[0], reach[1] = grip->load*friction[1];
        problem->strip[part] = (rest->turned[part] ? roller->sliding : roller->holding)/arm[k];
    }
    for (int j = 0; j < size; j++)
        most = fmax(most, problem->reach[j]);
    for (int j = 0; j < size; j++)
        problem->reach[j] = fmax(problem->reach[j], LEAST_REACH*most);
    for (int part = 0; part < rest->contacts; part++)
        problem->strip[part] = fmax(problem->strip[part], LEAST_REACH*problem->reach[2*part]);
}

/* Where a contact goes that slips, from the last round. */
static void take_way(omniroll_grip_t *grip, int sticks, double axle, double rolling)
{
    const double size = hypot(axle, rolling);
    grip->sticks = sticks;
    if (!sticks)
        grip->towards[0] = axle/size, grip->towards[1] = rolling/size;
}

/* The modes of a contact that rests both ways and of its roller, from the last round. */
static void take_pair(omniroll_run_t *run, const work_t *work, const parts_at_rest_t *rest, const elements_t *problem,
                      int part)
{
    const double *const force = problem->force + 2*part, *const reach = problem->reach + 2*part;
    omniroll_grip_t *const grip = run->grips + rest->which[part];
    omniroll_bearing_t *const roller = in_series(run, work) + rest->which[part];
    const double place[2] = {force[0]/reach[0], force[1]/reach[1]};
    const int used = grip->released && length_of(place, 2) >= 1 - USED;
    const int at_edge = fabs(force[0]) >= problem->strip[part]*(1 - USED);
    const int turns = rest->turns[part] || (roller->released && at_edge);
    double begun[2];
    for (int k = 0; k < 2; k++)
        begun[k] = rest->slips[part] ? problem->rate[2*part + k] : -place[k]/reach[k];
    roller->mode = turns ? (force[0] < 0) - (force[0] > 0) : 0;
    take_way(grip, !rest->slips[part] && !used, turns ? 0 : begun[0], begun[1]);
}

/* The mode of a contact whose roller turns, from the last round. */
static void take_rolling(omniroll_grip_t *grip, const elements_t *problem, int part, int slips)
{
    const int j = forces_at(problem->wide, problem->width, part);
    const int used = grip->released && fabs(problem->force[j]) >= problem->reach[j]*(1 - USED);
    take_way(grip, !slips && !used, 0, slips ? problem->rate[j] : -problem->force[j]);
}

/* What gives way in a round; whether something does that has not before. */
static int give_way(const elements_t *problem, parts_at_rest_t *rest)
{
    int further = 0;
    for (int k = 0; k < rest->count; k++) {
        rest->slips[k] = begins_to_slip(problem, k);
        further |= rest->slips[k] && !rest->broken[k];
        rest->broken[k] |= rest->slips[k];
    }
    for (int k = 0; k < rest->contacts; k++) {
        rest->turns[k] = is_more_than(problem, k, problem->yields[k], BEGINS);
        further |= rest->turns[k] && !rest->turned[k];
        rest->turned[k] |= rest->turns[k];
    }
    return further;
}

/* Rollers stop whose contacts give way beside them where sliding friction is no more than their bearings take (rule 4);
 * whether there are such. */
static int stop_rollers(omniroll_run_t *run, const work_t *work, const parts_at_rest_t *rest, const double *arm)
{
    int count = 0;
    for (int part = rest->contacts; part < contact_parts(rest); part++) {
        const int i = rest->which[part];
        omniroll_grip_t *const grip = run->grips + i;
        omniroll_bearing_t *const roller = in_series(run, work) + i;
        const double alone = roller->sliding/arm[i];
        if (!rest->broken[part] || left_beside_bearing(run, i, grip->sliding, alone) > 0)
            continue;
        grip->towards[0] = roller->mode, grip->towards[1] = 0;
        grip->resting = grip->sticks = 0;
        roller->resting = 1, roller->mode = 0, roller->size = 0;
        count++;
    }
    return count;
}

/* Which of what rests gives way, by rounds (rule 3). */
static void decide_strips(omniroll_run_t *run, const work_t *work)
{
    elements_t *const problem = work->problem;
    parts_at_rest_t *const rest = work->at_rest;
    double arm[MOST_WHEELS], per_chi[MOST_WHEELS], taken[MOST_WHEELS];
    put_parts_and_rolls(run, work, rest, problem);
    if (rest->count == 0)
        return;
    put_problem(run, work, rest, problem);
    find_arms(run->wheels, &work->vehicle, work->standing, run->joint, run->chi, arm, per_chi);
    find_taken(run, work, arm, taken);
    do {
        if (stop_rollers(run, work, rest, arm)) {
            decide_strips(run, work);
            return;
        }
        put_reaches_and_strips(run, work, rest, arm, taken, problem);
        decide_elements(problem);
    } while (give_way(problem, rest));
    for (int k = 0; k < rest->count; k++)
        if (k < rest->contacts)
            take_pair(run, work, rest, problem, k);
        else if (k < contact_parts(rest))
            take_rolling(run->grips + rest->which[k], problem, k, rest->slips[k]);
        else
            take_bearing_mode(own_bearings(run) + rest->which[k], problem, k, rest->slips[k]);
}
