/* Which of the elements at rest stick: contacts, axles, rollers in contact, free rollers, one list for every set, decided
 * together by friction/. What moves has broken away and slides: where static friction is above sliding friction they are
 * decided in rounds. */
#define BEGINS 1e-10                /* an element moves that gets more than this part of the power that forces could give */
/* Of its bound: nearer to it an element gives way that has come there at this instant. On ground that is stiff its torque
 * at the end of a step is not its bound to rounding. */
#define AT_EDGE (SET_IS_COUPLED ? 1e-3 : SET_STANDS && SET_ROLLERS_TURN ? 1e-6 : 1e-9)
#define ALIKE 0.1                   /* of the tolerance, the same: so far apart wheels are that are alike       */
#define TOGETHER 1e-12              /* the same of one beside others that have come there at this instant */
/* What `released` of a contact says: its step has ended there, or the demand is more than it takes if all stick.   */
enum { HAS_ENDED = 1, IS_BEYOND = 2 };
#define USED 1e-6                   /* below the least use: what is used so much has come to its bound      */

/* ---- the list --------------------------------------------------------------------------------------------------- */

/* One more, with so many components of its force. */
ALWAYS_INLINE void list_element(at_rest_t *rest, friction_problem_t *problem, int which, int broken, int rows)
{
    problem->element[rest->count] = (friction_element_t){
        .kind = rows == 1 ? FRICTION_INTERVAL : FRICTION_ELLIPSE, .first = problem->rows, .rows = rows,
        .strip = INFINITY,
    };
    problem->rows += rows;
    rest->broken[rest->count] = broken;
    rest->which[rest->count++] = which;
}

/* Contacts at rest: those whose massless rollers turn rest along the rolling direction alone. */
static void list_contacts(const omniroll_run_t *run, const work_t *work, at_rest_t *rest, friction_problem_t *problem)
{
    for (int rolls = 0; rolls <= SET_STRIPS; rolls++) {
        for (int i = 0; SET_GRIPS && i < run->wheels; i++) {
            omniroll_grip_t *const grip = run->ground.grips + i;
            grip->sticks = grip->resting;
            if (!grip->resting || (SET_STRIPS && rolls == in_series(run, work)[i].resting))
                continue;
            if (SET_STRIPS)
                rest->turned[rest->count] = in_series(run, work)[i].released != 0;
            list_element(rest, problem, i, grip->released == HAS_ENDED, rolls ? 1 : 2 - SET_FIRST_DIRECTION);
        }
        if (!rolls)
            rest->contacts = rest->count;
    }
    rest->rolls = rest->count - rest->contacts;
}

/* Bearings that are elements by themselves: massless rollers are parts of their contacts. */
ALWAYS_INLINE int count_deciding(const omniroll_run_t *run, const work_t *work)
{
    return SET_IN_SERIES ? work->states.rollers_at : run->bearings.count;
}

/* All that rests, which sticks so far. */
static void list_at_rest(const omniroll_run_t *run, const work_t *work)
{
    at_rest_t *const rest = work->at_rest;
    friction_problem_t *const problem = &work->problem->p;
    rest->count = problem->rows = problem->apart = problem->equalities = 0;
    list_contacts(run, work, rest, problem);
    for (int k = 0; k < run->bearings.count; k++) {
        omniroll_bearing_t *const bearing = run->bearings.each + k;
        const int decides = k < count_deciding(run, work);
        if (bearing->resting && (decides || SET_STRIPS))
            bearing->mode = 0;
        if (!bearing->resting || !decides)
            continue;
        problem->apart += k >= first_apart(run, work);
        list_element(rest, problem, k, bearing->released != 0, 1);
    }
    problem->elements = rest->count - problem->apart, problem->rows -= problem->apart;
    if (SET_STRIPS) {
        double per_chi[MAX_WHEELS];
        find_arms(run->wheels, &work->vehicle, work->standing, run->joint, run->state.chi, rest->arm, per_chi);
    }
}

/* ---- bounds ------------------------------------------------------------------------------------------------------- */

/* The bound of a contact's force along the rolling direction, whose roller turns with the force `axial` along the axle. */
static double rolling_bound(const omniroll_grip_t *grip, const double *friction, double axial)
{
    const double bound = grip->load*friction[0];
    return sqrt(fmax((bound - axial)*(bound + axial), 0))*friction[1]/friction[0];
}

/* What a contact takes at most, with its roller. */
static void put_bound_of_contact(const omniroll_run_t *run, const work_t *work, const at_rest_t *rest, int element,
                                 elements_t *problem)
{
    const int i = rest->which[element];
    const omniroll_grip_t *const grip = run->ground.grips + i;
    const double *const friction = rest->broken[element] ? grip->sliding : grip->staying;
    friction_element_t *const of = problem->p.element + element;
    double *const reach = problem->reach + of->first;
    if (element >= rest->contacts) {
        reach[0] = rolling_bound(grip, friction, in_series(run, work)[i].sliding/rest->arm[i]);
        return;
    }
    for (int c = 0; c < of->rows; c++)
        reach[c] = grip->load*friction[SET_FIRST_DIRECTION + c];
    if (SET_STRIPS) {
        const omniroll_bearing_t *const roller = in_series(run, work) + i;
        of->strip = (rest->turned[element] ? roller->sliding : roller->holding)/rest->arm[i];
    }
}

/* What the elements take at most: those that have broken away slide. */
static void put_bounds(const omniroll_run_t *run, const work_t *work, const at_rest_t *rest, elements_t *problem)
{
    friction_element_t *const element = problem->p.element;
    const int size = problem->p.rows + problem->p.apart;
    double largest = 0;
    for (int e = 0; e < rest->count; e++) {
        const omniroll_bearing_t *const bearing = run->bearings.each + rest->which[e];
        if (e < contacts_among(rest))
            put_bound_of_contact(run, work, rest, e, problem);
        else
            problem->reach[element[e].first] = rest->broken[e] ? bearing->sliding : bearing->holding;
    }
    for (int j = 0; j < size; j++)
        largest = fmax(largest, problem->reach[j]);
    for (int j = 0; j < size; j++)
        problem->reach[j] = fmax(problem->reach[j], LEAST_REACH*largest);
    for (int e = 0; SET_STRIPS && e < rest->contacts; e++)
        element[e].strip = fmax(element[e].strip, LEAST_REACH*problem->reach[2*e]);
    for (int e = 0; e < rest->count; e++)
        memcpy(element[e].size, problem->reach + element[e].first, sizeof(double)*(size_t)element[e].rows);
    for (int k = 0; k < problem->p.apart; k++)
        problem->p.bound[k] = problem->reach[problem->p.rows + k];
}

/* ---- rounds ----------------------------------------------------------------------------------------------------- */

/* The largest moment about the yaw axis of elements apart, together. */
static double largest_yaw_moment(const friction_problem_t *problem)
{
    double moment = 0;
    for (int k = 0; k < problem->apart; k++)
        moment += fabs(problem->yaw[k])*problem->bound[k];
    return moment;
}

/* The power that all forces could give one of them. */
static double power_apart(const friction_problem_t *problem, const double *reach, int k, double moment)
{
    double yaw = problem->yaw_yaw*moment;
    for (int j = 0; j < problem->rows; j++)
        yaw += fabs(problem->yaw_rows[j])*reach[j];
    return problem->bound[k]
        *(fabs(problem->apart_given[k]) + problem->mobility[k]*problem->bound[k] + fabs(problem->yaw[k])*yaw);
}

/* Whether a power of an element is no rounding: more than a part of what the forces could give it. */
static int is_no_rounding(const elements_t *c, int k, double given)
{
    const friction_problem_t *const problem = &c->p;
    const friction_element_t *const element = problem->element + k;
    const double moment = largest_yaw_moment(problem), *const reach = c->reach;
    double power = 0;
    if (k >= problem->elements)
        return given > BEGINS*power_apart(problem, reach, k - problem->elements, moment);
    for (int j = element->first; j < element->first + element->rows; j++) {
        power += fabs(problem->given[j])*reach[j];
        for (int l = 0; l < problem->rows; l++)
            power += reach[j]*fabs(problem->matrix[j*problem->rows + l])*reach[l];
        if (problem->apart)
            power += reach[j]*fabs(problem->yaw_rows[j])*moment;
    }
    return given > BEGINS*power;
}

/* Find the elements that break away in a round. Returns whether one does that has not before. */
static int find_broken(const elements_t *problem, at_rest_t *rest)
{
    int further = 0;
    for (int e = 0; e < rest->count; e++) {
        rest->slips[e] = is_no_rounding(problem, e, pull_of(problem, e));
        further |= rest->slips[e] && !rest->broken[e];
        rest->broken[e] |= rest->slips[e];
    }
    for (int e = 0; SET_STRIPS && e < rest->contacts; e++) {
        rest->turns[e] = is_no_rounding(problem, e, problem->found.pull[2*e + 1]);
        further |= rest->turns[e] && !rest->turned[e];
        rest->turned[e] |= rest->turns[e];
    }
    return further;
}

/* Massless rollers stop whose contacts give way beside them where sliding friction is no more than their bearings take;
 * whether there are such. */
static int stop_rollers(const omniroll_run_t *run, const work_t *work, const at_rest_t *rest)
{
    int count = 0;
    for (int e = rest->contacts; e < contacts_among(rest); e++) {
        const int i = rest->which[e];
        omniroll_grip_t *const grip = run->ground.grips + i;
        omniroll_bearing_t *const roller = in_series(run, work) + i;
        if (!rest->broken[e] || rolling_bound(grip, grip->sliding, roller->sliding/rest->arm[i]) > 0)
            continue;
        grip->towards[0] = roller->mode, grip->towards[1] = 0;
        grip->resting = grip->sticks = 0;
        roller->resting = 1, roller->mode = 0, roller->size = 0;
        count++;
    }
    return count;
}

/* ---- modes ------------------------------------------------------------------------------------------------------ */

/* How near to its bound an element gives way that nothing pulls: one that has come to it, and one that is there together
 * with such an element, if no other forces would do. */
ALWAYS_INLINE double edge_of(const elements_t *problem, int released)
{
    return released ? AT_EDGE : problem->found.unique ? TOGETHER : 0;
}

/* The same of a contact whose step has ended there. */
ALWAYS_INLINE double edge_at_end(const omniroll_run_t *run)
{
    return fmax(AT_EDGE, ALIKE*run->task.tolerance);
}

/* A contact goes in this direction if it slips. */
static void take_direction(omniroll_grip_t *grip, int sticks, double axle, double rolling)
{
    const double size = hypot(axle, rolling);
    grip->sticks = sticks;
    if (!sticks)
        grip->towards[0] = axle/size, grip->towards[1] = rolling/size;
}

/* A contact without a massless roller that sticks. */
static void take_contact(const omniroll_run_t *run, omniroll_grip_t *grip, const elements_t *problem, int k, int slips)
{
    const friction_element_t *const element = problem->p.element + k;
    const double *const force = problem->found.force + element->first, *const reach = problem->reach + element->first;
    const double *const rate = problem->found.acceleration + element->first;
    const double edge = grip->released ? edge_at_end(run) : edge_of(problem, 0);
    double squared = 0, begun[2] = {0, 0}, size = 0;
    for (int j = 0; j < element->rows; j++) {
        const double friction = reach[j]/grip->load;
        squared += force[j]/reach[j]*(force[j]/reach[j]);
        begun[j] = slips ? rate[j] : -force[j]/(friction*friction);
        size += begun[j]*begun[j];
    }
    grip->sticks = !slips && !(edge > 0 && sqrt(squared) >= 1 - edge);
    if (grip->sticks)
        return;
    grip->towards[0] = 0;
    for (int j = 0; j < element->rows; j++)
        grip->towards[SET_FIRST_DIRECTION + j] = begun[j]/sqrt(size);
}

/* A contact that rests both ways, with its massless roller. */
static void take_pair(const omniroll_run_t *run, const work_t *work, const at_rest_t *rest, const elements_t *problem,
                      int e)
{
    const double *const force = problem->found.force + 2*e, *const reach = problem->reach + 2*e;
    omniroll_grip_t *const grip = run->ground.grips + rest->which[e];
    omniroll_bearing_t *const roller = in_series(run, work) + rest->which[e];
    const double place[2] = {force[0]/reach[0], force[1]/reach[1]};
    const int used = grip->released && length_of(place, 2) >= 1 - USED;
    const int at_edge = fabs(force[0]) >= problem->p.element[e].strip*(1 - USED);
    const int turns = rest->turns[e] || (roller->released && at_edge);
    double begun[2];
    for (int k = 0; k < 2; k++)
        begun[k] = rest->slips[e] ? problem->found.acceleration[2*e + k] : -place[k]/reach[k];
    roller->mode = turns ? (force[0] < 0) - (force[0] > 0) : 0;
    take_direction(grip, !rest->slips[e] && !used, turns ? 0 : begun[0], begun[1]);
}

/* A contact whose roller turns. */
static void take_rolling(omniroll_grip_t *grip, const elements_t *problem, int e, int slips)
{
    const int j = problem->p.element[e].first;
    const double force = problem->found.force[j];
    const int used = grip->released && fabs(force) >= problem->reach[j]*(1 - USED);
    take_direction(grip, !slips && !used, 0, slips ? problem->found.acceleration[j] : -force);
}

static void take_bearing(omniroll_bearing_t *bearing, const elements_t *problem, int e, int slips)
{
    const int j = problem->p.element[e].first;
    const double force = problem->found.force[j], rate = problem->found.acceleration[j];
    const double edge = edge_of(problem, bearing->released);
    const int sign = bearing->released ? bearing->released : force < 0 ? 1 : -1;
    const int at_bound = edge > 0 && -sign*force >= problem->reach[j]*(1 - edge);
    bearing->mode = slips ? (rate > 0) - (rate < 0) : at_bound ? sign : 0;
}

/* The modes of all elements, from the last round. */
static void take_modes(const omniroll_run_t *run, const work_t *work, const at_rest_t *rest, const elements_t *problem)
{
    for (int e = 0; e < rest->count; e++)
        if (e >= contacts_among(rest))
            take_bearing(run->bearings.each + rest->which[e], problem, e, rest->slips[e]);
        else if (e >= rest->contacts)
            take_rolling(run->ground.grips + rest->which[e], problem, e, rest->slips[e]);
        else if (SET_STRIPS)
            take_pair(run, work, rest, problem, e);
        else
            take_contact(run, run->ground.grips + rest->which[e], problem, e, rest->slips[e]);
}

/* Decides the elements of the list, whose problem is known. Returns 0 where rollers that stop have changed it. */
static int decide_list(const omniroll_run_t *run, const work_t *work)
{
    at_rest_t *const rest = work->at_rest;
    elements_t *const problem = work->problem;
    do {
        if (SET_STRIPS && stop_rollers(run, work, rest))
            return 0;
        put_bounds(run, work, rest, problem);
        friction_decide(&problem->p, problem->memory, &problem->found);
    } while (find_broken(problem, rest));
    take_modes(run, work, rest, problem);
    return 1;
}

/* The modes of all that rests. */
static void decide_at_rest(omniroll_run_t *run, const work_t *work)
{
    do {
        list_at_rest(run, work);
        if (work->at_rest->count == 0)
            return;
        if (SET_GRIPS)
            put_problem_on_ground(run, work);
        else if (!SET_HOLDS)                    /* that of wheels that roll does not change with the modes     */
            put_problem_of_bearings(run, work);
    } while (!decide_list(run, work));
}
