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

/* What holds that which sticks, in these modes. */
static void find_holding(omniroll_run_t *run, const work_t *work)
{
    lanes_t nu_dot[3];
    rates_at_this_instant(run, work, run->wheels, SET_GRIPS ? work->nu_dot : nu_dot);
    for (int k = 0; SET_HOLDS && k < 3; k++)
        run->hold.force[k] = work->held_force[k][0];
    if (SET_IN_SERIES && !SET_GRIPS)
        find_bearing_rates(run, work);
    find_bearing_torques(run, work);
    if (SET_MOMENTS_INPUT >= 0 && !SET_GRIPS)
        put_moments(run);
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

/* A step has ended where the mode of a bearing does, or behind all of these what holds wheels that stand. Where the
 * ground is stiff, the torque there is not its bound to rounding: slips are rounded, and the iteration at the nodes
 * leaves something. The mode ends even so. */
static void end_of_bearing(omniroll_run_t *run, int landed)
{
    if (landed < 0)
        return;
    run->hold.ended = 1;
    if (landed >= run->bearings.core_count)
        return;
    omniroll_bearing_t *const bearing = core_bearings(run) + landed;
    if (bearing->mode == 0)
        bearing->released = bearing->torque > 0 ? -1 : 1;
    bearing->resting = 1;
}

/* Wheels have passed to their next rollers, which changes no rate of theirs. */
static void axles_have_switched(omniroll_run_t *run)
{
    for (int k = 0; k < run->bearings.core_count; k++)
        core_bearings(run)[k].released = 0;
    run->hold.undecided = 1;
}
