/* Contacts and bearings that may all stick: which of those at rest give way. The numbered rules are in
 * runtime/omniroll/effects/ground_with_axles.py and ground_with_bearings.py; functions of one name do the same. */
/* The torques of bearings that turn, into work->own.torque, where those at rest take none. */
static void turn_free(const omniroll_run_t *run, const work_t *work)
{
    for (int k = 0; k < run->own_count; k++)
        work->own.torque[k] = lanes_of(-own_bearings(run)[k].mode*own_bearings(run)[k].sliding);
}

/* Whether a massless roller passes on the force that its contact is given: one that does not turn. */
ALWAYS_INLINE int gives_its_force(const omniroll_run_t *run, const work_t *work, int k)
{
#if SET_STRIPS
    return k >= work->own.rollers_at && own_bearings(run)[k].mode == 0;
#else
    (void)run, (void)work, (void)k;
    return 0;
#endif
}

/* Parts that are contacts; and which of the components of the slip is component c of one. */
ALWAYS_INLINE int contact_parts(const parts_at_rest_t *rest)
{
#if SET_STRIPS
    return rest->contacts + rest->rolls;
#else
    return rest->contacts;
#endif
}

ALWAYS_INLINE int direction_of(const parts_at_rest_t *rest, int part, int c)
{
    return SET_STRIPS && part >= rest->contacts ? 1 : SET_FIRST_DIRECTION + c;
}

/* The rates of what rests where nothing sticks, under these forces and the torques in work->own.torque. */
static void rates_of_free(const omniroll_run_t *run, const work_t *work, const lanes_t *push, lanes_t *nu_dot)
{
    instant_t now;
    lanes_t *const kept = work->own.rate;
    at_this_instant(run, work, run->wheels, &now);
    for (int k = 0; k < 9; k++)
        now.directions[k] = lanes_of(any_motion[k]);
    for (int k = 0; k < 3; k++)
        now.absent[k] = lanes_of(0);
    for (int i = 0; i < run->wheels; i++)
        now.arrays.input[SET_MODES_INPUT*run->wheels + i] = lanes_of(0);
    for (int k = 0; k < run->own_count; k++) {
        if (own_input(run, k) >= 0)
            now.arrays.input[own_input(run, k)] = work->own.torque[k];
        kept[k] = work->own.sticks[k], work->own.sticks[k] = lanes_of(gives_its_force(run, work, k));
    }
    memcpy(now.arrays.ground_push, push, sizeof *push*2*(size_t)run->wheels);
    core_rates_there(run->wheels, &now.point, nu_dot);
    for (int k = 0; k < run->own_count; k++)
        work->own.sticks[k] = kept[k];
}

/* What a part is moved by. */
static double typical_of(const omniroll_run_t *run, const parts_at_rest_t *rest, int part)
{
    double most = 0;
    if (part < contact_parts(rest))
        return run->ground.typical;
    for (int k = 0; k < run->own_count; k++)
        most = fmax(most, own_bearings(run)[k].holding);
    return most > 0 ? most : 1;
}

static lanes_t rate_of_part(const omniroll_run_t *run, const work_t *work, const parts_at_rest_t *rest, int part, int c)
{
    const int k = rest->which[part];
    if (part < contact_parts(rest))
        return work->slip_dot[2*k + direction_of(rest, part, c)];
#if SET_DISKS_STICK
    if (k >= work->own.rollers_at)
        return work->own.dot[k];
#endif
    return work->core_dot[rates_at(run->wheels) + k];
}

/* Whether a bearing is that of a roller that is not in contact. */
ALWAYS_INLINE int is_free_roller(const omniroll_run_t *run, const work_t *work, int k)
{
    return k >= work->own.rollers_at + run->wheels;
}

/* What rests, with forces and torques as parts of one problem. */
static void put_parts(omniroll_run_t *run, const work_t *work, parts_at_rest_t *rest, elements_t *problem)
{
    (void)work;
    rest->count = 0;
    for (int i = 0; i < run->wheels; i++)
        if ((run->grips[i].sticks = run->grips[i].resting)) {
            rest->broken[rest->count] = run->grips[i].released;
            rest->which[rest->count++] = i;
        }
    rest->contacts = rest->count;
    for (int k = 0; k < run->own_count; k++)
        if (own_bearings(run)[k].resting) {
            own_bearings(run)[k].mode = 0;
            rest->broken[rest->count] = own_bearings(run)[k].released != 0;
            rest->which[rest->count++] = k;
        }
    problem->count = rest->count, problem->width = 2 - SET_FIRST_DIRECTION, problem->wide = rest->contacts;
    problem->apart = 0;
#if SET_DISKS_STICK
    while (problem->count > rest->contacts && is_free_roller(run, work, rest->which[problem->count - 1]))
        problem->count--, problem->apart++;
#endif
}

/* Free rollers at rest meet the other parts through nu_3' alone: what that gives their rates, and what torques do. */
static void put_apart(const omniroll_run_t *run, const work_t *work, const parts_at_rest_t *rest, elements_t *problem)
{
    lanes_t nu[3] = {lanes_of(0), lanes_of(0), lanes_of(1)}, chi[MOST_WHEELS];
    for (int i = 0; i < run->wheels; i++)
        chi[i] = lanes_of(run->chi[i]);
    for (int c = 0; c < work->core; c++)
        work->core_here[c] = lanes_of(0);
    own_rates_in_lanes(&work->own, &work->vehicle, run->wheels, nu, chi, work->core_here, work->own.rate);
    for (int k = 0; k < problem->apart; k++) {
        problem->yaw[k] = work->own.rate[rest->which[problem->count + k]][0];
        problem->mobility[k] = 1/run->roller_inertia;
    }
}

/* Their accelerations where nothing holds them, and what nu_3' is moved by per force that it meets. */
static void put_free_apart(const omniroll_run_t *run, const work_t *work, const parts_at_rest_t *rest, const lanes_t *push,
                           elements_t *problem)
{
    lanes_t nu_dot[3];
    int most = 0;
    for (int k = 0; k < problem->apart; k++)
        most = fabs(problem->yaw[k]) > fabs(problem->yaw[most]) ? k : most;
    turn_free(run, work);
    const double by = typical_of(run, rest, problem->count + most);
    work->own.torque[rest->which[problem->count + most]][1] += by;
    rates_of_free(run, work, push, nu_dot);
    const double moved = by*problem->yaw[most];
    problem->yaw_yaw = moved != 0 ? (nu_dot[2][1] - nu_dot[2][0])/moved : 0;
    for (int k = 0; k < problem->apart; k++)
        problem->apart_given[k] = work->own.dot[rest->which[problem->count + k]][0];
}

/* D and a of the problem (rule 4). */
static void put_problem(const omniroll_run_t *run, const work_t *work, const parts_at_rest_t *rest, elements_t *problem)
{
    const int wide = problem->wide, width = problem->width, size = forces_at(wide, width, problem->count);
    lanes_t given[2*MOST_WHEELS], nu_dot[3];
    forces_now(run, work, given);
    put_corners_now(run, work, given);
    for (int first = 0; first < size; first += LANES - 1) {
        lanes_t push[2*MOST_WHEELS];
        double by[LANES] = {0};
        memcpy(push, given, sizeof *push*2*(size_t)run->wheels);
        turn_free(run, work);
        for (int lane = 1; lane < LANES && first + lane - 1 < size; lane++) {
            const int j = first + lane - 1, part = part_of(wide, width, j), c = j - forces_at(wide, width, part);
            by[lane] = typical_of(run, rest, part);
            if (part < contact_parts(rest))
                push[2*rest->which[part] + direction_of(rest, part, c)][lane] += by[lane];
            else
                work->own.torque[rest->which[part]][lane] += by[lane];
        }
        rates_of_free(run, work, push, nu_dot);
        for (int j = 0; j < size; j++) {
            const int part = part_of(wide, width, j);
            const lanes_t rate = rate_of_part(run, work, rest, part, j - forces_at(wide, width, part));
            problem->given[j] = rate[0];
            for (int lane = 1; lane < LANES && first + lane - 1 < size; lane++)
                problem->matrix[j*size + first + lane - 1] = (rate[lane] - rate[0])/by[lane];
        }
        for (int lane = 1; lane < LANES && first + lane - 1 < size; lane++)
            problem->yaw_rows[first + lane - 1] = (nu_dot[2][lane] - nu_dot[2][0])/by[lane];
    }
#if SET_DISKS_STICK
    if (problem->apart) {
        put_apart(run, work, rest, problem);
        put_free_apart(run, work, rest, given, problem);
    }
#endif
    for (int j = 0; j < size; j++)
        for (int l = 0; l < j; l++)
            problem->matrix[j*size + l] = problem->matrix[l*size + j]
                = (problem->matrix[j*size + l] + problem->matrix[l*size + j])/2;
}

/* What the parts can take: those that have broken away slide. */
static void put_reaches(const omniroll_run_t *run, const parts_at_rest_t *rest, elements_t *problem)
{
    const int wide = problem->wide, width = problem->width, size = forces_at(wide, width, rest->count);
    double most = 0;
    for (int j = 0; j < size; j++) {
        const int part = part_of(wide, width, j), k = rest->which[part], c = j - forces_at(wide, width, part);
        if (part < rest->contacts) {
            const omniroll_grip_t *const grip = run->grips + k;
            problem->reach[j] = grip->load
                *(rest->broken[part] ? grip->sliding : grip->staying)[SET_FIRST_DIRECTION + c];
        } else {
            const omniroll_bearing_t *const bearing = own_bearings(run) + k;
            problem->reach[j] = rest->broken[part] ? bearing->sliding : bearing->holding;
        }
        most = fmax(most, problem->reach[j]);
    }
    for (int j = 0; j < size; j++)
        problem->reach[j] = fmax(problem->reach[j], LEAST_REACH*most);
    for (int k = 0; k < problem->apart; k++)
        problem->bound[k] = problem->reach[size - problem->apart + k];
}

/* How near to its bound a part gives way that nothing pulls: one that has been let go, and one that has come there
 * together with such a part, if no other forces would do. */
ALWAYS_INLINE double edge_of(const elements_t *problem, int released)
{
    return released ? AT_EDGE : problem->unique ? TOGETHER : 0;
}

/* The mode of a bearing from the last round. */
static void take_bearing_mode(omniroll_bearing_t *bearing, const elements_t *problem, int part, int slips)
{
    const int j = forces_at(problem->wide, problem->width, part);
    const double force = problem->force[j], edge = edge_of(problem, bearing->released);
    const int way = bearing->released ? bearing->released : force < 0 ? 1 : -1;
    const int at_bound = edge > 0 && -way*force >= problem->reach[j]*(1 - edge);
    bearing->mode = slips ? (problem->rate[j] > 0) - (problem->rate[j] < 0) : at_bound ? way : 0;
}

#include "ground/strips.c"

/* Which of the contacts and bearings at rest give way, by rounds (rule 4). */
static void decide_parts(omniroll_run_t *run, const work_t *work)
{
    elements_t *const problem = work->problem;
    parts_at_rest_t *const rest = work->at_rest;
    int further;
    put_parts(run, work, rest, problem);
    put_problem(run, work, rest, problem);
    do {
        put_reaches(run, rest, problem);
        decide_elements(problem);
        further = 0;
        for (int k = 0; k < rest->count; k++) {
            rest->slips[k] = begins_to_slip(problem, k);
            further |= rest->slips[k] && !rest->broken[k];
            rest->broken[k] |= rest->slips[k];
        }
    } while (further);
    for (int k = 0; k < rest->count; k++)
        if (k < rest->contacts)
            take_mode(run->grips + rest->which[k], problem, k, rest->slips[k],
                      edge_of(problem, run->grips[rest->which[k]].released));
        else
            take_bearing_mode(own_bearings(run) + rest->which[k], problem, k, rest->slips[k]);
}

static void decide_together(omniroll_run_t *run, const work_t *work)
{
    if (SET_STRIPS)
        decide_strips(run, work);
    else
        decide_parts(run, work);
}

/* The modes of contacts and axles, and what they are asked for then. */
static void decide_modes(omniroll_run_t *run, const work_t *work, asked_t *now)
{
    int released = 0;
    for (int i = 0; i < run->wheels; i++) {
        run->grips[i].sticks = run->grips[i].resting;
        released |= run->grips[i].released;
    }
    for (int k = 0; k < run->own_count; k++)
        released |= own_bearings(run)[k].released != 0;
    if (released)
        decide_together(run, work);
    for (int turn = 0; turn <= 2*run->wheels; turn++) {
        lanes_t nu_dot[3];
        stand(run, work);
        rates_at_this_instant(run, work, run->wheels, nu_dot);
        asked_now(run, work, now);
        if (!overdone(run, work, now))
            break;
        decide_together(run, work);
    }
}

/* The modes of all contacts and axles in the phase that begins now. */
static void decide_all(omniroll_run_t *run, const work_t *work)
{
    asked_t now;
    put_all_to_rest(run, work);
    decide_modes(run, work, &now);
    find_all_torques(run, work, &now);
    size_all(run, work);
    run->hold.undecided = run->ground.undecided = 0;
}

/* Which bearings and contacts stick from now on, where that must be decided anew. */
static void settle_all(omniroll_run_t *run, const work_t *work)
{
    if (run->hold.undecided || run->ground.undecided)
        decide_all(run, work);
}

/* The same where wheels roll or slip, or either rests alone. */
static void settle_modes(omniroll_run_t *run, const work_t *work)
{
    if (SET_STANDS) {
        settle_all(run, work);
        return;
    }
    if (SET_GRIPS)
        run->ground.knows_rates &= !run->hold.undecided;
    settle_bearings(run, work);
    if (SET_GRIPS && run->ground.undecided)
        decide_contacts(run, work);
}
