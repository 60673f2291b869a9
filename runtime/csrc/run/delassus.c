/* What forces do to the rates of elements: the Delassus matrix, and the rates without these forces. Where wheels may slip
 * on the ground of Coulomb's law, by evaluations with a force more in each lane; where they roll, from the mass matrix;
 * on other ground the state gives the ground's forces, and bearings meet through nu_3' alone. */

static const double any_motion[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

/* Bearings from this place on stand apart: they meet the other elements through nu_3' alone. Those of free rollers, and
 * all where the state gives the ground's forces. */
ALWAYS_INLINE int first_apart(const omniroll_run_t *run, const work_t *work)
{
    if (SET_IS_COUPLED)
        return 0;
    if (SET_DISKS_STICK)
        return work->states.rollers_at + run->wheels;
    return run->bearings.count - (SET_SPINS_STICK ? run->bearings.core_count : 0);
}

/* Elements that are contacts; and which of the components of the slip is component c of one. */
ALWAYS_INLINE int contacts_among(const at_rest_t *rest)
{
    return rest->contacts + rest->rolls;
}

ALWAYS_INLINE int direction_of(const at_rest_t *rest, int element, int c)
{
    return element >= rest->contacts ? 1 : SET_FIRST_DIRECTION + c;
}

/* Whether a massless roller passes on the force that its contact is given: one that does not turn. */
ALWAYS_INLINE int gives_its_force(const omniroll_run_t *run, const work_t *work, int k)
{
    return SET_STRIPS && k >= work->states.rollers_at && run->bearings.each[k].mode == 0;
}

/* The rates of the core under these forces of the ground; `free`: where nothing sticks, and under the torques in
 * work->states.torque. */
static void rates_pushed(const omniroll_run_t *run, const work_t *work, int free, const lanes_t *push, lanes_t *nu_dot)
{
    instant_t now;
    at_this_instant(run, work, run->wheels, &now);
    for (int k = 0; free && k < 9; k++)
        now.directions[k] = lanes_of(any_motion[k]);
    for (int k = 0; free && k < 3; k++)
        now.absent[k] = lanes_of(0);
    for (int i = 0; free && i < run->wheels; i++)
        now.arrays.input[SET_MODES_INPUT*run->wheels + i] = lanes_of(0);
    for (int k = 0; free && k < run->bearings.core_count; k++) {
        if (input_of_bearing(run, k) >= 0)
            now.arrays.input[input_of_bearing(run, k)] = work->states.torque[k];
        work->states.rate[k] = work->states.sticks[k], work->states.sticks[k] = lanes_of(gives_its_force(run, work, k));
    }
    memcpy(now.arrays.ground_push, push, sizeof *push*2*(size_t)run->wheels);
    core_rates_at(run->wheels, &now.point, nu_dot);
    for (int k = 0; free && k < run->bearings.core_count; k++)
        work->states.sticks[k] = work->states.rate[k];
}

/* The torques of bearings that turn, into work->states.torque, where those at rest take none. */
static void turn_free(const omniroll_run_t *run, const work_t *work)
{
    for (int k = 0; k < run->bearings.core_count; k++)
        work->states.torque[k] = lanes_of(-run->bearings.each[k].mode*run->bearings.each[k].sliding);
}

/* What an element is moved by. */
static double typical_of(const omniroll_run_t *run, const at_rest_t *rest, int element)
{
    double largest = 0;
    if (element < contacts_among(rest))
        return run->ground.typical;
    for (int k = 0; k < run->bearings.core_count; k++)
        largest = fmax(largest, run->bearings.each[k].holding);
    return largest > 0 ? largest : 1;
}

static lanes_t rate_of_element(const omniroll_run_t *run, const work_t *work, const at_rest_t *rest, int element, int c)
{
    const int k = rest->which[element];
    if (element < contacts_among(rest))
        return work->slip_dot[2*k + direction_of(rest, element, c)];
    return bearing_acceleration_lanes(run, work, k);
}

/* The element whose force stands at a place. */
ALWAYS_INLINE int element_at(const friction_problem_t *problem, int place)
{
    int e = 0;
    while (place >= problem->element[e].first + problem->element[e].rows)
        e++;
    return e;
}

/* What forces on some elements do to their rates, beside the forces `given`; `free` as above. */
static void find_response(const omniroll_run_t *run, const work_t *work, const at_rest_t *rest, int free,
                          const lanes_t *given, friction_problem_t *problem)
{
    const int size = problem->rows;
    for (int first = 0; first < size; first += LANES - 1) {
        lanes_t push[2*MAX_WHEELS], nu_dot[3];
        double by[LANES] = {0};
        memcpy(push, given, sizeof *push*2*(size_t)run->wheels);
        if (free)
            turn_free(run, work);
        for (int lane = 1; lane < LANES && first + lane - 1 < size; lane++) {
            const int j = first + lane - 1, e = element_at(problem, j), c = j - problem->element[e].first;
            by[lane] = typical_of(run, rest, e);
            if (e < contacts_among(rest))
                push[2*rest->which[e] + direction_of(rest, e, c)][lane] += by[lane];
            else
                work->states.torque[rest->which[e]][lane] += by[lane];
        }
        rates_pushed(run, work, free, push, nu_dot);
        for (int j = 0; j < size; j++) {
            const int e = element_at(problem, j);
            const lanes_t rate = rate_of_element(run, work, rest, e, j - problem->element[e].first);
            problem->given[j] = rate[0];
            for (int lane = 1; lane < LANES && first + lane - 1 < size; lane++)
                problem->matrix[j*size + first + lane - 1] = (rate[lane] - rate[0])/by[lane];
        }
        for (int lane = 1; lane < LANES && first + lane - 1 < size; lane++)
            problem->yaw_rows[first + lane - 1] = (nu_dot[2][lane] - nu_dot[2][0])/by[lane];
    }
}

/* What nu_3 gives the rates of bearings that stand apart. */
static void put_yaw(const omniroll_run_t *run, const work_t *work, const at_rest_t *rest, friction_problem_t *problem)
{
    lanes_t nu[3] = {lanes_of(0), lanes_of(0), lanes_of(1)}, chi[MAX_WHEELS];
    lanes_t *const rates = work->states.rate;
    for (int i = 0; i < run->wheels; i++)
        chi[i] = lanes_of(run->state.chi[i]);
    for (int c = 0; c < work->core; c++)
        work->core_here[c] = lanes_of(0);
    if (SET_SPINS_STICK)
        set_spins_from_axial(run->wheels, &work->vehicle, nu, chi, work->core_here, rates);
    else
        bearing_rates_in_lanes(&work->states, &work->vehicle, run->wheels, nu, chi, work->core_here, rates);
    for (int k = 0; k < problem->apart; k++) {
        const int bearing = rest->which[problem->elements + k] - (run->bearings.count - run->bearings.core_count);
        problem->yaw[k] = rates[bearing][0];
        problem->mobility[k] = 1/run->bearings.roller_inertia;
    }
}

/* Their accelerations where nothing holds them, and what nu_3' is moved by per force that it meets. */
static void put_free_apart(const omniroll_run_t *run, const work_t *work, const at_rest_t *rest, const lanes_t *push,
                           friction_problem_t *problem)
{
    lanes_t nu_dot[3];
    int largest = 0;
    for (int k = 0; k < problem->apart; k++)
        largest = fabs(problem->yaw[k]) > fabs(problem->yaw[largest]) ? k : largest;
    turn_free(run, work);
    const double by = typical_of(run, rest, problem->elements + largest);
    work->states.torque[rest->which[problem->elements + largest]][1] += by;
    rates_pushed(run, work, 1, push, nu_dot);
    const double moved = by*problem->yaw[largest];
    problem->yaw_yaw = moved != 0 ? (nu_dot[2][1] - nu_dot[2][0])/moved : 0;
    for (int k = 0; k < problem->apart; k++)
        problem->apart_given[k] = work->states.dot[rest->which[problem->elements + k]][0];
}

/* Contacts with the ground of Coulomb's law, and bearings beside them. */
static void put_problem_on_ground(const omniroll_run_t *run, const work_t *work)
{
    const at_rest_t *const rest = work->at_rest;
    friction_problem_t *const problem = &work->problem->p;
    const int size = problem->rows;
    lanes_t given[2*MAX_WHEELS], yield[MAX_WHEELS];
    forces_now(run, work, given, yield);
    find_response(run, work, rest, 1, given, problem);
    if (problem->apart) {
        put_yaw(run, work, rest, problem);
        put_free_apart(run, work, rest, given, problem);
    }
    for (int j = 0; j < size; j++)
        for (int l = 0; l < j; l++)
            problem->matrix[j*size + l] = problem->matrix[l*size + j]
                = (problem->matrix[j*size + l] + problem->matrix[l*size + j])/2;
}

/* Bearings where the state gives the ground's forces: an axle meets nothing else, and stands here in units of its
 * inertia: what would hold it is its acceleration. */
static void put_problem_of_bearings(const omniroll_run_t *run, const work_t *work)
{
    const at_rest_t *const rest = work->at_rest;
    friction_problem_t *const problem = &work->problem->p;
    lanes_t nu_dot[3];
    enter_bearings(run, work, 1);
    rates_at_this_instant(run, work, run->wheels, nu_dot);
    for (int k = 0; k < problem->apart; k++)
        problem->apart_given[k] = -work->states.holding[rest->which[k]][0];
    enter_bearings(run, work, 0);
    rates_at_this_instant(run, work, run->wheels, nu_dot);
    if (SET_DISKS_STICK) {
        put_yaw(run, work, rest, problem);
        problem->yaw_yaw = 1/work->states.yaw_mass[0][0];
    }
    for (int k = 0; k < problem->apart; k++) {
        if (rest->which[k] < work->states.rollers_at)
            problem->yaw[k] = 0, problem->mobility[k] = 1;
        else
            problem->apart_given[k] = work->states.dot[rest->which[k]][0];
    }
}

/* L with L L^T = mass, lower; a pivot within rounding of zero is that rounding. */
static void root_of(const vector3_t *mass, vector3_t *root)
{
    memset(root, 0, 3*sizeof *root);
    for (int k = 0; k < 3; k++)
        for (int l = 0; l <= k; l++) {
            double remainder = mass[k][l];
            for (int m = 0; m < l; m++)
                remainder -= root[k][m]*root[l][m];
            root[k][l] = l < k ? remainder/root[l][l] : sqrt(fmax(remainder, EPS*mass[k][k]));
        }
}

/* L^-1 a. */
ALWAYS_INLINE void under_root(const vector3_t *root, const double *a, double *to)
{
    for (int k = 0; k < 3; k++) {
        to[k] = a[k];
        for (int l = 0; l < k; l++)
            to[k] -= root[k][l]*to[l];
        to[k] /= root[k][k];
    }
}

/* Bearings of wheels that roll, under a force on nu. Free rollers have the accelerations of the last evaluation, in which
 * nu' was zero. */
static void put_problem_of_rolling(const omniroll_run_t *run, const work_t *work, const vector3_t *mass,
                                   const double *force)
{
    const at_rest_t *const rest = work->at_rest;
    friction_problem_t *const problem = &work->problem->p;
    const int count = problem->elements;
    const vector3_t third = {0, 0, 1};
    vector3_t root[3], rows[MAX_BEARINGS], pushed, yaw;
    root_of(mass, root);
    under_root((const vector3_t *)root, force, pushed);
    under_root((const vector3_t *)root, third, yaw);
    problem->yaw_yaw = dot3(yaw, yaw);
    for (int e = 0; e < count; e++) {
        const omniroll_bearing_t *const bearing = run->bearings.each + rest->which[e];
        for (int k = 0; k < 3; k++)
            rows[e][k] = bearing->row[k]*bearing->nearer;
        under_root((const vector3_t *)root, rows[e], rows[e]);
        problem->given[e] = dot3(rows[e], pushed), problem->yaw_rows[e] = dot3(rows[e], yaw);
    }
    for (int e = 0; e < count; e++)
        for (int f = 0; f < count; f++)
            problem->matrix[e*count + f] = dot3(rows[e], rows[f]);
    if (!problem->apart)
        return;
    for (int k = 0; k < problem->apart; k++)
        problem->apart_given[k] = bearing_acceleration(run, work, rest->which[count + k] - rows_count(run));
    put_yaw(run, work, rest, problem);
    for (int k = 0; k < problem->apart; k++)
        problem->apart_given[k] += problem->yaw[k]*dot3(yaw, pushed);
}
