/* Axles that stick where wheels may slip: which of those at rest stick. */

/* The bearings of the free rollers of a wheel. */
ALWAYS_INLINE const omniroll_bearing_t *free_bearings(const omniroll_run_t *run, int wheel)
{
    return core_bearings(run) + (SET_AXLES_STICK ? 2 : 1)*run->wheels + wheel*(run->rollers_per_wheel - 1);
}

/* What these do to the wheels' momenta, where rows have it. */
static void put_moments(const omniroll_run_t *run)
{
    for (int i = 0; i < run->wheels; i++) {
        double moments[2] = {0, 0};
        for (int j = 1; j < run->rollers_per_wheel; j++) {
            const double torque = free_bearings(run, i)[j - 1].torque, place = j*TURN/run->rollers_per_wheel;
            moments[0] += torque*cos(place), moments[1] += torque*sin(place);
        }
        for (int k = 0; k < 2; k++)
            run->acts.inputs[(SET_MOMENTS_INPUT + k)*run->wheels + i] = moments[k];
    }
}

/* What the moments of these are rounded against, several times. */
static double size_of_moments(const omniroll_run_t *run, int wheel)
{
    double size = 0;
    for (int j = 0; j < run->rollers_per_wheel - 1; j++)
        size += HELD_ROUNDINGS*(fabs(free_bearings(run, wheel)[j].torque) + free_bearings(run, wheel)[j].holding);
    return size;
}

/* The torques that hold the axles which stick, at this instant. */
static void hold_axles(const omniroll_run_t *run, const work_t *work)
{
    lanes_t nu_dot[3];
    rates_at_this_instant(run, work, run->wheels, nu_dot);
    if (SET_IN_SERIES)
        find_bearing_rates(run, work);
    find_bearing_torques(run, work);
    if (SET_MOMENTS_INPUT >= 0)
        put_moments(run);
}

/* As an instant begins: bearings whose rates are zero within rounding rest. */
static void rest_slipping_bearings(omniroll_run_t *run, const work_t *work)
{
    find_bearing_rates(run, work);
    find_resting_bearings(run, work, length3(run->state.nu));
    put_bearings_to_rest(run, work);
}

/* The phase begins with the torques that have been found. */
static void begin_torques(omniroll_run_t *run, const work_t *work)
{
    run->hold.count = 0;
    for (int k = 0; k < run->bearings.core_count; k++)
        run->hold.count += SET_ROLLERS_TURN || core_bearings(run)[k].mode == 0;
    size_bearings(run, work);
    run->hold.undecided = 0;
}

static void keep_rollers_at_rest(const omniroll_run_t *run, const work_t *work);

/* Some time has passed where wheels may slip. Where the ground is stiff, the torque at the end of a step that has ended at an
 * axle is not its bound to rounding: slips are rounded, and the iteration at the nodes leaves something. The mode ends there
 * even so. */
static void slipping_bearings_have_moved(omniroll_run_t *run, const work_t *work, const step_t *s)
{
    const int landed = s->event.landing - s->wheels - s->event.guards;
    if (SET_DISKS_STICK)
        keep_rollers_at_rest(run, work);
    if (run->hold.count)
        hold_axles(run, work);
    if (landed < 0 || landed >= run->bearings.core_count)
        return;
    omniroll_bearing_t *const axle = core_bearings(run) + landed;
    if (axle->mode == 0)
        axle->released = axle->torque > 0 ? -1 : 1;
    axle->resting = run->hold.ended = 1;
}

/* Wheels have passed to their next rollers, which changes no rate of theirs. */
static void axles_have_switched(omniroll_run_t *run)
{
    for (int k = 0; k < run->bearings.core_count; k++)
        core_bearings(run)[k].released = 0;
    run->hold.undecided = 1;
}
