/* Bearings whose rates are numbers of the core: of free rollers, or where wheels may slip of axles;
 * and there those of massless rollers in contact, whose spins follow from the state. A mode for each. */
static double tau(const omniroll_run_t *run, double phase_length);

ALWAYS_INLINE omniroll_bearing_t *core_bearings(const omniroll_run_t *run)
{
    return run->bearings.each ? run->bearings.each + (run->bearings.count - run->bearings.core_count) : 0;
}

/* Whether wheels may stand in this run: beside contacts that stick bearings can hold something. A set that has such also
 * runs scenes without, which cost no more than in a set that has none. */
ALWAYS_INLINE int stands_somewhere(const omniroll_run_t *run)
{
    return SET_STANDS && (SET_STRIPS || may_stand(core_bearings(run), run->bearings.core_count));
}

static int some_bearing_sticks(const omniroll_run_t *run)
{
    int sticks = 0;
    for (int k = 0; k < run->bearings.core_count; k++)
        sticks |= core_bearings(run)[k].mode == 0;
    return sticks;
}

ALWAYS_INLINE double *bearing_rates(const omniroll_run_t *run)
{
    return run->state.core + bearing_rates_at(run->wheels);
}

/* How many bearings have rates that follow from nu. */
ALWAYS_INLINE int rows_count(const omniroll_run_t *run)
{
    return run->bearings.count - run->bearings.core_count;
}

/* The bearings of rollers in contact; null where there are none. */
ALWAYS_INLINE const omniroll_bearing_t *contact_bearings(const omniroll_run_t *run)
{
    const int some = SET_STANDS ? SET_ROLLERS_TURN : rows_count(run) > run->bearings.axle_count;
    return some && run->bearings.each ? run->bearings.each + run->bearings.axle_count : 0;
}

#define NEARLY_ALL 0.99             /* of the friction along an axle                                          */

/* The ground's forces on wheels that are rigid, and what would hold their rollers then. */
static void demand_on_rigid_wheels(const bearing_states_t *states, const vehicle_t *v, const int wheels, const lanes_t *nu,
                                  const lanes_t *chi, const lanes_t *core, lanes_t *force, lanes_t *demand)
{
    lanes_t pair[2*MAX_WHEELS], slope[4*MAX_WHEELS], none[MAX_WHEELS], rigid[MAX_WHEELS], spin[MAX_WHEELS];
    for (int i = 0; i < wheels; i++)
        none[i] = lanes_of(0), rigid[i] = lanes_of(1);
    slips_of(wheels, v, nu, chi, core, pair);
    set_sliding_forces(wheels, v, pair, states->load, states->friction, force, slope);
    set_slip_spins(wheels, v, nu, chi, core + rates_at(wheels), none, force, none, rigid, spin, demand);
    (void)slope, (void)spin;
}

/* A roller turns on a contact that slips while the ground's demand on its bearing would be more than that takes, if the
 * wheel were rigid. As the bearing comes to take all of the friction along the axle, the slip along the axle grows
 * beyond all bounds, over the rest across it, and the spin passes zero so fast that no instant is as near to that as
 * its rounding. There the demand, less what the bearing takes, stands in the place of the spin: it has the same sign,
 * vanishes with it, is smooth, and has all digits. */
static void spins_at_bound(const bearing_states_t *states, const vehicle_t *v, const int wheels, const lanes_t *nu,
                           const lanes_t *chi, const lanes_t *core, lanes_t *spin)
{
    lanes_t force[2*MAX_WHEELS], demand[MAX_WHEELS];
    int some = 0;
    for (int i = 0; i < wheels; i++)
        some |= fabs(states->takes[i]) > 0;
    if (!some)
        return;
    demand_on_rigid_wheels(states, v, wheels, nu, chi, core, force, demand);
    for (int i = 0; i < wheels; i++) {
        const double torque = fabs(states->takes[i]), mode = states->takes[i] < 0 ? 1 : -1;
        const lanes_t over = lanes_abs(demand[i])/torque;
        if (torque > 0)
            spin[i] = states->scale[i]*mode*(over - 1)*(over + 1);
    }
}

/* Which rollers turn on contacts that slip, and take nearly all of their friction along the axle, from now on. */
static void begin_at_bound(const omniroll_run_t *run, const work_t *work, const instant_t *now)
{
    const bearing_states_t *const states = &work->states;
    const double pace = length3(run->state.nu)*run->bearings.rate_of_speed;
    lanes_t force[2*MAX_WHEELS], demand[MAX_WHEELS];
    int some = 0;
    for (int i = 0; i < run->wheels; i++) {
        states->takes[i] = slides(run, i) ? -roller_mode(run, i)*core_bearings(run)[states->rollers_at + i].sliding : 0;
        some |= fabs(states->takes[i]) > 0;
    }
    if (!some)
        return;
    demand_on_rigid_wheels(states, &work->vehicle, run->wheels, now->arrays.nu, now->arrays.chi, now->point.core, force,
                          demand);
    for (int i = 0; i < run->wheels; i++) {
        const double largest = fabs(demand[i][0]/force[2*i][0])*(states->load[i]*states->friction[2*i])[0];
        const double part = fabs(states->takes[i])/largest;
        if (!(part > NEARLY_ALL))
            states->takes[i] = 0;
        states->scale[i] = pace/fmax((1 - part)*(1 + part), EPS);
    }
}

/* The rates of bearings in these states, with which rollers turn on their disks, and axles; of massless rollers, in
 * their modes, with what holds those that stick. Beside contacts that stick the last evaluation has found these. */
ALWAYS_INLINE void bearing_rates_in_lanes(const bearing_states_t *states, const vehicle_t *v, const int wheels,
                                      const lanes_t *nu, const lanes_t *chi, const lanes_t *core, lanes_t *rates)
{
    const int at = states->rollers_at;
    const lanes_t *const first = core + bearing_rates_at(wheels), *const contact = first + at;
    for (int k = 0; k < at; k++)
        rates[k] = first[k];
    if (SET_STRIPS) {
        memcpy(rates + at, states->spin, sizeof *rates*(size_t)wheels);
        spins_at_bound(states, v, wheels, nu, chi, core, rates + at);
    } else if (SET_IN_SERIES)
        set_slip_spins(wheels, v, nu, chi, core + rates_at(wheels), states->torque + at, 0, 0, states->sticks + at, rates + at,
                       states->holding + at);
    else if (SET_DISKS_STICK) {
        set_contact_spins(wheels, v, nu, chi, contact, rates + at);
        set_spins_from_axial(wheels, v, nu, chi, contact + wheels, rates + at + wheels);
    }
}

/* The modes of massless rollers in contact. */
ALWAYS_INLINE omniroll_bearing_t *in_series(const omniroll_run_t *run, const work_t *work)
{
    return core_bearings(run) + work->states.rollers_at;
}

/* The same beside contacts that stick, in the present modes, into work->states.rate. */
static void bearing_rates_in_modes(const omniroll_run_t *run, const work_t *work, instant_t *now)
{
    lanes_t torque[MAX_WHEELS], sticks[MAX_WHEELS], aside[MAX_WHEELS];
    const int at = work->states.rollers_at;
    for (int i = 0; i < run->wheels; i++)
        torque[i] = lanes_of(-roller_mode(run, i)*in_series(run, work)[i].sliding);
    for (int i = 0; i < run->wheels; i++)
        sticks[i] = lanes_of(roller_mode(run, i) == 0);
    for (int k = 0; k < at; k++)
        work->states.rate[k] = now->point.core[bearing_rates_at(run->wheels) + k];
    corners_at(run, work, now->arrays.chi, now->arrays.ground_push, now->arrays.ground_yield);
    set_slip_spins(run->wheels, &work->vehicle, now->arrays.nu, now->arrays.chi,
                   now->point.core + rates_at(run->wheels), torque, now->arrays.ground_push, now->arrays.ground_yield,
                   sticks, work->states.rate + at, aside);
    spins_at_bound(&work->states, &work->vehicle, run->wheels, now->arrays.nu, now->arrays.chi, now->point.core,
                   work->states.rate + at);
}

static void bearing_rates_now(const omniroll_run_t *run, const work_t *work, instant_t *now)
{
    if (SET_STRIPS)
        bearing_rates_in_modes(run, work, now);
    else
        bearing_rates_in_lanes(&work->states, &work->vehicle, run->wheels, now->arrays.nu, now->arrays.chi, now->point.core,
                           work->states.rate);
}

/* The same at this instant. Where no rollers turn they are numbers of the core. */
static void find_bearing_rates(const omniroll_run_t *run, const work_t *work)
{
    instant_t now;
    if (!SET_ROLLERS_TURN)
        return;
    at_this_instant(run, work, run->wheels, &now);
    if (SET_STRIPS)
        begin_at_bound(run, work, &now);
    bearing_rates_now(run, work, &now);
    for (int k = 0; k < run->bearings.core_count; k++)
        work->states.now[k] = work->states.rate[k][0];
}

/* The rate of a bearing at this instant, and what it changes by. */
ALWAYS_INLINE double bearing_rate(const omniroll_run_t *run, const work_t *work, int k)
{
    return SET_ROLLERS_TURN ? work->states.now[k] : bearing_rates(run)[k];
}

ALWAYS_INLINE lanes_t bearing_acceleration_lanes(const omniroll_run_t *run, const work_t *work, int k)
{
    if (SET_DISKS_STICK && k >= work->states.rollers_at)
        return work->states.dot[k];
    return work->core_dot[bearing_rates_at(run->wheels) + k];
}

ALWAYS_INLINE double bearing_acceleration(const omniroll_run_t *run, const work_t *work, int k)
{
    return bearing_acceleration_lanes(run, work, k)[0];
}

/* Changes the rate of a bearing; of a roller that turns on its disk, its axial speed. */
ALWAYS_INLINE void put_bearing_rate(const omniroll_run_t *run, const work_t *work, int k, double rate)
{
    if (SET_ROLLERS_TURN) {
        bearing_rates(run)[k] += rate - work->states.now[k];
        work->states.now[k] = rate;
    } else
        bearing_rates(run)[k] = rate;
}

/* Whether the demand on one that sticks is more than it takes. */
ALWAYS_INLINE int is_beyond_bound(const omniroll_bearing_t *states)
{
    const double torque = fabs(states->torque), bound = bound_of(states);
    return states->mode == 0 && torque - bound > PASSED*rounding_of_holding(torque, bound);
}

/* How many of them have rates that are numbers of the core; they stand first. */
ALWAYS_INLINE int count_in_core(const omniroll_run_t *run, const work_t *work)
{
    return SET_IN_SERIES ? work->states.rollers_at : run->bearings.core_count;
}

/* What the rate of a bearing is rounded against at least, in rad/s, where wheels may stand: a rounding of the largest
 * speeds. */
ALWAYS_INLINE double least_rate(const omniroll_run_t *run, const work_t *work, int k, double least_arm)
{
    if (SET_STANDS)
        return run->hold.speed/(k < work->states.rollers_at ? run->ground.arms[2] : least_arm);
    return 0;
}

/* Those rest whose rates are zero within rounding: a rate is a difference of larger speeds. */
static void find_resting_bearings(omniroll_run_t *run, const work_t *work, double speed, double least_arm)
{
    for (int k = 0; k < count_in_core(run, work); k++) {
        const double rate = fabs(bearing_rate(run, work, k)), size = rate + speed*run->bearings.rate_of_speed;
        core_bearings(run)[k].resting |= may_hold(core_bearings(run) + k)
            && rate <= AT_REST*EPS*fmax(size, least_rate(run, work, k, least_arm));
    }
}

static void put_bearings_to_rest(omniroll_run_t *run, const work_t *work)
{
    for (int k = 0; k < count_in_core(run, work); k++) {
        omniroll_bearing_t *const bearing = core_bearings(run) + k;
        const double rate = bearing->resting ? 0 : bearing_rate(run, work, k);
        if (SET_GRIPS && bearing->resting && bearing->mode && k < work->states.rollers_at + run->wheels)
            run->ground.grips[k%run->wheels].keeps = 0;  /* the direction of a slip that changes now                 */
        put_bearing_rate(run, work, k, rate);
        bearing->mode = may_hold(bearing) ? (rate > 0) - (rate < 0) : 1;
        if (SET_IN_SERIES && !bearing->mode)
            bearing->size = 0;
    }
}

/* As an instant begins: what is zero within rounding rests. */
static void rest_bearings(omniroll_run_t *run, const work_t *work, double least_arm)
{
    find_bearing_rates(run, work);
    find_resting_bearings(run, work, length3(run->state.nu), least_arm);
    put_bearings_to_rest(run, work);
}

/* The place among the inputs of the torque of an axle, or of a roller in contact; -1 of others. */
ALWAYS_INLINE int input_of_bearing(const omniroll_run_t *run, int k)
{
    if (SET_AXLES_STICK && k < run->wheels)
        return SET_BEARING_INPUT*run->wheels + k;
    return SET_ROLLERS_TURN && k < (SET_AXLES_STICK ? 2 : 1)*run->wheels
        ? SET_CONTACT_BEARING_INPUT*run->wheels + k%run->wheels : -1;
}

/* The torques of those that turn; the others stick, or where `hold` is 0 take none. */
static void enter_bearings(const omniroll_run_t *run, const work_t *work, int hold)
{
    for (int k = 0; k < run->bearings.core_count; k++) {
        omniroll_bearing_t *const bearing = core_bearings(run) + k;
        bearing->torque = -bearing->mode*bearing->sliding;
        work->states.torque[k] = lanes_of(bearing->torque);
        if (input_of_bearing(run, k) >= 0)
            run->acts.inputs[input_of_bearing(run, k)] = bearing->torque;
        work->states.sticks[k] = lanes_of(hold && bearing->mode == 0);
    }
}

/* What holds those that stick, from the last evaluation at this instant. */
static void find_bearing_torques(const omniroll_run_t *run, const work_t *work)
{
    for (int k = 0; k < run->bearings.core_count; k++)
        if (core_bearings(run)[k].mode == 0)
            core_bearings(run)[k].torque = work->states.holding[k][0];
}

/* What the iteration at the nodes of the next step may leave in a rate. */
ALWAYS_INLINE double residual_of_rates(const omniroll_run_t *run)
{
    if (!SET_AXLES_STICK && !SET_ROLLERS_TURN)
        return 0;
    const double rest = limit_of_step(run) - run->state.elapsed;
    const double h = run->past.step > 0 ? fmin(run->past.step, rest) : rest;
    return sweep_tolerance(run, h)*fmax(run->task.speed, run->past.fastest)*run->bearings.rate_of_speed;
}

/* What the rates are rounded against in the phase that starts now. */
static void size_bearings(const omniroll_run_t *run, const work_t *work)
{
    for (int k = 0; k < run->bearings.core_count; k++)
        if (!SET_IN_SERIES || core_bearings(run)[k].mode)    /* see engine_calls.h                              */
            core_bearings(run)[k].size = fabs(bearing_rate(run, work, k))
                + length3(run->state.nu)*run->bearings.rate_of_speed;
}

ALWAYS_INLINE double noise_of_bearing(const omniroll_bearing_t *bearing, double rate)
{
    return EPS*(bearing->size + fabs(rate));
}

/* Those that turn and whose rates have passed zero, or are closer in time than tau to it, rest. Returns how many
 * there are. */
static int stop_bearings(omniroll_run_t *run, const work_t *work)
{
    const double together = run->past.at_event ? tau(run, run->state.elapsed - run->past.phase_start) : 0;
    const double rest = residual_of_rates(run);
    lanes_t nu_dot[3];
    int count = 0, near = run->past.at_event;
    for (int k = 0; k < count_in_core(run, work); k++) {
        const omniroll_bearing_t *const bearing = core_bearings(run) + k;
        const double rate = bearing_rate(run, work, k);
        near |= bearing->mode && may_hold(bearing) && -bearing->mode*rate >= -LANDED*noise_of_bearing(bearing, rate) - rest;
    }
    if (!near)
        return 0;
    rates_at_this_instant(run, work, run->wheels, nu_dot);
    for (int k = 0; k < count_in_core(run, work); k++) {
        omniroll_bearing_t *const bearing = core_bearings(run) + k;
        const double now = bearing_rate(run, work, k), value = -bearing->mode*now, noise = noise_of_bearing(bearing, now);
        const double rate = -bearing->mode*bearing_acceleration(run, work, k);
        if (bearing->mode && !bearing->resting && may_hold(bearing)
            && (value > PASSED*noise + rest || (rate > 0 && value >= -(LANDED*noise + rest + together*rate)))) {
            bearing->resting = run->hold.undecided = 1;
            count++;
        }
    }
    return count;
}

/* What the polynomials of what holds, and of spins, lack at a step's end, from an evaluation there. */
static void find_bearings_late(step_t *s, const int wheels, const arrays_t *at)
{
    const bearing_states_t *const states = s->hold.states;
    if (SET_ROLLERS_TURN)
        bearing_rates_in_lanes(states, s->vehicle, wheels, at->nu, at->chi, s->core_here, states->rate);
    for (int k = 0; k < s->hold.count; k++)
        states->late[k] = (is_spin(s, k) ? states->rate[k][0] : states->holding[k][0])
            - weighted(states->held + k, &gauss_end);
}
