/* An instant: the state in all lanes, and the rates there. */

/* The state at this instant, in all lanes. */
typedef struct {
    arrays_t arrays;
    point_t point;
    lanes_t directions[9], absent[3];
} instant_t;

/* nu and the wheels' angles; the rest of the core. */
ALWAYS_INLINE void state_in_lanes(const omniroll_run_t *run, lanes_t *nu, lanes_t *chi)
{
    for (int k = 0; k < 3; k++)
        nu[k] = lanes_of(run->state.nu[k]);
    for (int i = 0; i < run->wheels; i++)
        chi[i] = lanes_of(run->state.chi[i]);
}

ALWAYS_INLINE const lanes_t *core_in_lanes(const omniroll_run_t *run, const work_t *work)
{
    for (int c = 0; c < work->core; c++)
        work->core_here[c] = lanes_of(run->state.core[c]);
    return work->core_here;
}

/* The mode of a roller in contact. */
ALWAYS_INLINE int roller_mode(const omniroll_run_t *run, int wheel)
{
    return run->bearings.each[run->bearings.axle_count + wheel].mode;
}

/* Where contacts slip and their massless rollers turn, at these angles: their forces in N, and how far they slip along
 * their axles; 0 of others. */
static void corners_at(const omniroll_run_t *run, const work_t *work, const lanes_t *chi, lanes_t *push, lanes_t *yield)
{
    lanes_t toward[2*MAX_WHEELS], torque[MAX_WHEELS];
    int corner[MAX_WHEELS];
    for (int i = 0; i < run->wheels; i++) {
        corner[i] = slides(run, i) && roller_mode(run, i);
        toward[2*i] = lanes_of(0), toward[2*i + 1] = lanes_of(copysign(1, run->ground.grips[i].towards[1]));
        torque[i] = lanes_of(-roller_mode(run, i)*run->bearings.each[run->bearings.axle_count + i].sliding);
    }
    put_corner_forces(run->wheels, &work->vehicle, corner, chi, toward, work->load, work->friction, torque, push, yield);
}

/* The forces with which contacts slip where they go. */
static void forces_along(const omniroll_run_t *run, const work_t *work, const lanes_t *load, lanes_t *push)
{
    lanes_t toward[2*MAX_WHEELS], slope[4*MAX_WHEELS];
    for (int k = 0; k < 2*run->wheels; k++)
        toward[k] = lanes_of(run->ground.grips[k/2].towards[k%2]);
    set_sliding_forces(run->wheels, &work->vehicle, toward, load, work->friction, push, slope);
    (void)slope;
}

/* The forces of the ground that are given: of contacts that slip. yield: how far these slip whose massless rollers turn. */
static void forces_now(const omniroll_run_t *run, const work_t *work, lanes_t *push, lanes_t *yield)
{
    lanes_t nu[3], chi[MAX_WHEELS];
    const int some = some_slide(run);
    if (some)
        forces_along(run, work, work->load, push);
    for (int k = 0; k < 2*run->wheels; k++)
        if (!some || !slides(run, k/2))
            push[k] = lanes_of(0);
    if (!SET_STRIPS)
        return;
    state_in_lanes(run, nu, chi);
    corners_at(run, work, chi, push, yield);
}

/* The axial speed of the roller that is next to a wheel's on its side. */
static double *next_roller(const omniroll_run_t *run, int wheel)
{
    const int others = run->rollers_per_wheel - 1;
    return run->state.axial + wheel*others + (run->state.chi[wheel] < 0 ? 0 : (int)run->rollers[wheel] - 2);
}

ALWAYS_INLINE void at_this_instant(const omniroll_run_t *run, const work_t *work, const int wheels, instant_t *now)
{
    now->point = (point_t){
        .vehicle = &work->vehicle, .nu = now->arrays.nu, .chi = now->arrays.chi, .momenta = work->momenta,
        .all_turn = all_turn(wheels, &work->vehicle), .bare = run->task.bare};
    state_in_lanes(run, now->arrays.nu, now->arrays.chi);
    if (SET_HAS_HEADING)
        now->point.heading = lanes_of(remainder(run->state.pose[2], TURN));
    if (SET_INPUTS) {
        for (int k = 0; k < SET_INPUTS*wheels; k++)
            now->arrays.input[k] = lanes_of(input_now(run, k));
        now->point.inputs = now->arrays.input;
    }
    if (SET_CORE_PARTS) {
        now->point.core = core_in_lanes(run, work);
        now->point.core_dot = work->core_dot;
    }
    if (SET_HOLDS || SET_STANDS) {
        for (int k = 0; k < 9; k++)
            now->directions[k] = lanes_of(run->hold.directions[k]);
        for (int k = 0; k < 3; k++)
            now->absent[k] = lanes_of(run->hold.absent[k]);
        now->point.directions = SET_STANDS || run->hold.count ? now->directions : 0;
        now->point.absent = now->absent;
        now->point.held_force = work->held_force;
    }
    if (SET_CORE_BEARINGS)
        put_bearing_states(&work->states, &now->point);
    if (SET_GRIPS) {
        forces_now(run, work, now->arrays.ground_push, now->arrays.ground_yield);
        now->point.ground_push = now->arrays.ground_push, now->point.ground_yield = now->arrays.ground_yield;
        now->point.ground_force = work->ground_force, now->point.slip_dot = work->slip_dot;
    }
    if (SET_SHARES) {
        now->point.load = work->load, now->point.friction = work->friction, now->point.next_share = work->next_share;
        for (int i = 0; i < wheels; i++)
            work->next_before[i] = lanes_of(SET_NEXT_SPEEDS ? *next_roller(run, i) : 0);
        now->point.next_before = work->next_before;
    }
}

/* The wheels' rates in all lanes. */
ALWAYS_INLINE void wheel_rates_now(const omniroll_run_t *run, const work_t *work, lanes_t *chi_dot)
{
    lanes_t nu[3], chi[MAX_WHEELS];
    state_in_lanes(run, nu, chi);
    rates_of_wheels(run->wheels, &work->vehicle, nu, chi, SET_SLIPS ? core_in_lanes(run, work) : 0, chi_dot);
}

/* Their accelerations, from the rates of nu and of the rest of the core. */
ALWAYS_INLINE void accelerations_now(const omniroll_run_t *run, const work_t *work, const lanes_t *nu_dot,
                                     lanes_t *chi_ddot)
{
    lanes_t nu[3], chi[MAX_WHEELS];
    state_in_lanes(run, nu, chi);
    accelerations_of_wheels(run->wheels, &work->vehicle, nu, chi, nu_dot, work->core_dot, chi_ddot);
}

/* The rates of the core at this instant, in all lanes. */
NEVER_INLINE void rates_at_this_instant(const omniroll_run_t *run, const work_t *work, const int wheels,
                                        lanes_t *nu_dot)
{
    instant_t now;
    at_this_instant(run, work, wheels, &now);
    core_rates(wheels, &now.point, nu_dot);
}

static void axial_in_lanes(const omniroll_run_t *run, lanes_t *axial)
{
    const int size = run->wheels*(run->rollers_per_wheel - 1);
    for (int k = 0; k < size; k++)
        axial[k] = lanes_of(run->state.axial[k]);
}

/* The two numbers of each wheel's free rollers, which are constant up to the next switch unless the core has them. */
static void wheel_momenta(const omniroll_run_t *run, const work_t *work)
{
    axial_in_lanes(run, work->axial);
    set_momenta(run->wheels, &work->vehicle, work->axial, work->momenta);
}

/* The rest of the core begins anew with the rollers that are free now. */
static void begin_core(omniroll_run_t *run, const work_t *work)
{
    instant_t now;
    at_this_instant(run, work, run->wheels, &now);      /* speeds of their own stay                  */
    if (SET_HAS_MOMENTA)
        axial_in_lanes(run, work->axial);
    start_core(run->wheels, &work->vehicle, now.arrays.nu, now.arrays.chi, work->axial, work->core_here);
    for (int c = 0; c < work->core; c++)
        run->state.core[c] = run->state.core_before[c] = work->core_here[c][0];
    run->state.axial_elapsed = run->state.elapsed;
}

/* The axial speeds of the free rollers as they are now. */
static void update_axial(omniroll_run_t *run, const work_t *work)
{
    const int size = run->wheels*(run->rollers_per_wheel - 1);
    instant_t now;
    at_this_instant(run, work, run->wheels, &now);
    axial_in_lanes(run, work->axial);
    for (int c = 0; c < work->core; c++)
        work->core_dot[c] = lanes_of(run->state.core_before[c]);
    axial_later(run->wheels, &work->vehicle, now.arrays.nu, now.arrays.chi, work->axial, work->core_dot,
                work->core_here, lanes_of(run->state.elapsed - run->state.axial_elapsed), work->later);
    for (int k = 0; k < size; k++)
        run->state.axial[k] = work->later[k][0];
}

/* The mass matrix at this instant. */
static void mass_at_this_instant(const omniroll_run_t *run, const work_t *work, vector3_t *mass)
{
    instant_t now;
    lanes_t matrix[9];
    at_this_instant(run, work, run->wheels, &now);
    set_mass_matrix(run->wheels, &work->vehicle, now.arrays.chi, matrix);
    for (int k = 0; k < 9; k++)
        mass[k/3][k%3] = matrix[k][0];
}

#define FINEST_SWEEP 1e-16          /* of |nu|: rounding is as large                                         */
#define SHORT_STEPS 100             /* so many may leave a hundredth each of what iterations may leave; further ones less */

/* Elapsed at which a step ends at the latest. */
ALWAYS_INLINE double limit_of_step(const omniroll_run_t *run)
{
    if (SET_IS_ACTED_ON)
        return fmin(run->task.duration, run->acts.next_time);
    return run->task.duration;
}

/* What the iteration may leave of a step of this length, over |nu|. Where something acts a vehicle may become much
 * faster than it is at the start, so that nobody knows beforehand how many steps there will be: each gets the part of
 * what the run may leave that it is of the duration. Short steps get more than that, later ones less and less: all
 * together log(steps/SHORT_STEPS)/2 times as much. A run that pauses has no duration that is known. */
ALWAYS_INLINE double sweep_tolerance(const omniroll_run_t *run, double h)
{
    if (SET_IS_ACTED_ON) {
        const double part = fmax(h/run->task.duration, 1.0/(SHORT_STEPS + 2*(double)run->record.step_count));
        return run->task.pauses ? run->task.sweep_tolerance : fmax(run->task.sweep_tolerance*part, FINEST_SWEEP);
    }
    return run->task.sweep_tolerance;
}
