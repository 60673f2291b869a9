/* Rollers that stick on their disks where wheels may slip: which of those at rest stick, and their spins at the nodes. The
 * numbered rules are in runtime/omniroll/effects/slipping_rollers.py; own_bearings.c has what they have in common with
 * axles, rollers_in_series.c which massless ones stick. */
/* At a vector of nodes what holds the bearings that stick, from the last evaluation, and the spins of rollers that turn on
 * their disks. */
ALWAYS_INLINE void keep_own(step_t *s, const int wheels, int b, const arrays_t *at)
{
    const own_bearings_t *const own = s->own;
    own_rates_in_lanes(own, s->vehicle, wheels, at->nu, at->chi, core_at(s, b), own->rate);
    for (int k = 0; k < s->own_count; k++)
        own->held[k].lanes[b] = is_spin(s, k) ? own->rate[k] : own->holding[k];
}

/* Rollers that stick turn with their disks at the step's end, as in the row (keep_rollers_at_rest). */
static void rollers_at_rest_at_end(const step_t *s, const int wheels, const arrays_t *at)
{
    const own_bearings_t *const own = s->own;
    if (!SET_DISKS_STICK)
        return;
    own_rates_in_lanes(own, s->vehicle, wheels, at->nu, at->chi, s->core_here, own->rate);
    for (int k = own->rollers_at; k < s->own_count; k++)
        if (s->own_bearing[k].mode == 0)
            s->core_here[own_rates_at(wheels) + k] -= own->rate[k];
}

/* Those at rest on their disks. */
typedef struct {
    int count;
    double mass, inertia;           /* that nu_3' meets where none of them sticks; of a roller                */
    const double *per_yaw, *given, *bounds; /* what a disk gives a roller's axial speed per nu_3; accelerations of the
                                             * spins without these bearings; and what these take at most     */
} resting_t;

/* What holds one where nu_3' is changed by x, up to its bound; and whether it is below that. */
ALWAYS_INLINE double torque_at(const resting_t *rest, int k, double x, int *holds)
{
    const double wanted = rest->inertia*(rest->per_yaw[k]*x - rest->given[k]), most = rest->bounds[k];
    *holds = fabs(wanted) < most;
    return *holds ? wanted : copysign(most, wanted);
}

/* The change of nu_3' that they make together: each meets the others through it alone. */
static double common_acceleration(const resting_t *rest, elements_t *problem)
{
    double x = 0;
    problem->count = problem->wide = 0, problem->apart = rest->count, problem->yaw_yaw = 1/rest->mass;
    for (int k = 0; k < rest->count; k++) {
        problem->mobility[k] = 1/rest->inertia, problem->bound[k] = rest->bounds[k];
        problem->yaw[k] = -rest->per_yaw[k], problem->apart_given[k] = rest->given[k];
    }
    decide_elements(problem);
    for (int k = 0; k < rest->count; k++)
        x -= rest->per_yaw[k]*problem->force[k]/rest->mass;
    return x;
}

/* Those at rest, with what they would do if nothing held them. */
static resting_t rollers_at_rest(const omniroll_run_t *run, const work_t *work)
{
    const own_bearings_t *const own = &work->own;
    lanes_t nu[3] = {lanes_of(0), lanes_of(0), lanes_of(1)}, nu_dot[3], chi[MOST_WHEELS];
    resting_t rest = {.count = 0, .inertia = run->roller_inertia, .per_yaw = own->per_yaw, .given = own->given,
        .bounds = own->bounds};
    turn_own(run, work, 0);
    rates_at_this_instant(run, work, run->wheels, nu_dot);
    rest.mass = own->yaw_mass[0][0];
    for (int i = 0; i < run->wheels; i++)
        chi[i] = lanes_of(run->chi[i]);
    for (int c = 0; c < work->core; c++)
        work->core_here[c] = lanes_of(0);
    own_rates_in_lanes(own, &work->vehicle, run->wheels, nu, chi, work->core_here, own->rate);
    for (int k = own->rollers_at; k < run->own_count; k++)
        if (own_bearings(run)[k].resting) {
            own->per_yaw[rest.count] = -own->rate[k][0];
            own->given[rest.count++] = own->dot[k][0];
        }
    return rest;
}

/* The mode of a roller at rest from a round: whether it moves, and where to. */
static int moves_by(const resting_t *rest, int k, double x, double most, omniroll_bearing_t *roller)
{
    int holds;
    const double torque = torque_at(rest, k, x, &holds), bound = rest->bounds[k];
    const double rate = holds ? 0 : rest->given[k] + torque/rest->inertia - rest->per_yaw[k]*x;
    const double possible = fabs(rest->given[k]) + bound/rest->inertia + fabs(rest->per_yaw[k])*most;
    const int moves = fabs(rate) > MOVES*possible, at_bound = -roller->released*torque >= NEAR_BOUND*bound;
    roller->mode = moves ? (rate > 0 ? 1 : -1) : at_bound ? roller->released : 0;
    return moves;
}

/* Modes of the rollers at rest by rounds; those that have been released have broken away before the first. */
static void decide_rollers_in_rounds(const omniroll_run_t *run, const work_t *work)
{
    omniroll_bearing_t *const rollers = own_bearings(run);
    const int first = work->own.rollers_at;
    const resting_t rest = rollers_at_rest(run, work);
    int further;
    for (int k = first; k < run->own_count; k++)
        rollers[k].broken = rollers[k].resting && rollers[k].released;
    do {
        double most = 0;
        for (int k = first, place = 0; k < run->own_count; k++)
            if (rollers[k].resting) {
                work->own.bounds[place] = rollers[k].broken ? rollers[k].sliding : rollers[k].holding;
                most += fabs(rest.per_yaw[place])*work->own.bounds[place]/rest.mass;
                place++;
            }
        const double x = common_acceleration(&rest, work->problem);
        further = 0;
        for (int k = first, place = 0; k < run->own_count; k++)
            if (rollers[k].resting) {
                const int moves = moves_by(&rest, place++, x, most, rollers + k);
                further |= moves && !rollers[k].broken;
                rollers[k].broken |= moves;
            }
    } while (further);
}

/* Rule 3: which of the rollers at rest stick. What would hold them if all did has been found. */
static void decide_rollers(const omniroll_run_t *run, const work_t *work)
{
    omniroll_bearing_t *const rollers = own_bearings(run);
    const int first = work->own.rollers_at;
    int overdone = 0;
    for (int k = first; k < run->own_count; k++)
        overdone |= rollers[k].resting && (rollers[k].released || holds_no_more(rollers + k));
    for (int round = 0; overdone && round <= run->own_count; round++) {
        decide_rollers_in_rounds(run, work);
        turn_own(run, work, 1);
        hold_axles(run, work);
        overdone = release_own(run, first);
    }
}

/* Wheels have passed to their next rollers: each bearing goes with its roller to the next place. */
static void rollers_have_switched(const omniroll_run_t *run, const int *directions)
{
    omniroll_bearing_t *const contact = own_bearings(run) + (SET_AXLES_STICK ? run->wheels : 0);
    const int places = run->rollers_per_wheel - 1;
    for (int i = 0; i < run->wheels; i++) {
        omniroll_bearing_t *const free = contact + run->wheels + i*places, before = contact[i];
        if (directions[i] > 0) {
            contact[i] = free[places - 1];
            memmove(free + 1, free, (size_t)(places - 1)*sizeof *free);
            free[0] = before;
        } else if (directions[i] < 0) {
            contact[i] = free[0];
            memmove(free, free + 1, (size_t)(places - 1)*sizeof *free);
            free[places - 1] = before;
        }
    }
}

/* Rollers that stick turn with their disks: what rounding and the iteration have left of their spins is taken away. */
static void keep_rollers_at_rest(const omniroll_run_t *run, const work_t *work)
{
    find_own_rates(run, work);
    for (int k = work->own.rollers_at; k < run->own_count; k++)
        if (own_bearings(run)[k].resting)
            put_own_rate(run, work, k, 0);
}
