/* Bearings with rates of their own, which are numbers of the core: of free rollers, or where wheels may slip of axles;
 * and there those of massless rollers in contact, whose spins follow from the state. A mode for each. */
static double tau(const omniroll_run_t *run, double phase_length);

ALWAYS_INLINE omniroll_bearing_t *own_bearings(const omniroll_run_t *run)
{
    return run->bearings ? run->bearings + (run->bearing_count - run->own_count) : 0;
}

ALWAYS_INLINE double *own_rates(const omniroll_run_t *run)
{
    return run->core + own_rates_at(run->wheels);
}

/* How many bearings have rates that follow from nu. */
ALWAYS_INLINE int rows_count(const omniroll_run_t *run)
{
    return run->bearing_count - run->own_count;
}

/* The bearings of rollers in contact; null where there are none. */
ALWAYS_INLINE const omniroll_bearing_t *contact_bearings(const omniroll_run_t *run)
{
    const int some = SET_STANDS ? SET_ROLLERS_TURN : rows_count(run) > run->axle_count;
    return some && run->bearings ? run->bearings + run->axle_count : 0;
}

#define NEARLY_ALL 0.99             /* of the friction along an axle                                          */

/* The ground's forces on wheels that are rigid, and what would hold their rollers then. */
static void asked_of_rigid_wheels(const own_bearings_t *own, const vehicle_t *v, const int wheels, const lanes_t *nu,
                                  const lanes_t *chi, const lanes_t *core, lanes_t *force, lanes_t *asked)
{
    lanes_t pair[2*MOST_WHEELS], slope[4*MOST_WHEELS], none[MOST_WHEELS], rigid[MOST_WHEELS], spin[MOST_WHEELS];
    for (int i = 0; i < wheels; i++)
        none[i] = lanes_of(0), rigid[i] = lanes_of(1);
    slips_of(wheels, v, nu, chi, core, pair);
    set_sliding_forces(wheels, v, pair, own->load, own->friction, force, slope);
    set_slip_spins(wheels, v, nu, chi, core + rates_at(wheels), none, force, none, rigid, spin, asked);
    (void)slope, (void)spin;
}

/* A roller turns on a contact that slips while the ground would ask its bearing for more than it takes, if the wheel
 * were rigid. As the bearing comes to take all of the friction along the axle, the slip along the axle grows beyond all
 * bounds, over what is left across, and the spin passes zero so fast that no instant is as near to that as its rounding.
 * There what would be asked for, less what is taken, stands in the place of the spin: it has the same sign, vanishes with
 * it, is smooth, and has all digits. */
static void spins_at_the_most(const own_bearings_t *own, const vehicle_t *v, const int wheels, const lanes_t *nu,
                              const lanes_t *chi, const lanes_t *core, lanes_t *spin)
{
    lanes_t force[2*MOST_WHEELS], asked[MOST_WHEELS];
    int some = 0;
    for (int i = 0; i < wheels; i++)
        some |= fabs(own->takes[i]) > 0;
    if (!some)
        return;
    asked_of_rigid_wheels(own, v, wheels, nu, chi, core, force, asked);
    for (int i = 0; i < wheels; i++) {
        const double taken = fabs(own->takes[i]), mode = own->takes[i] < 0 ? 1 : -1;
        const lanes_t over = lanes_abs(asked[i])/taken;
        if (taken > 0)
            spin[i] = own->scale[i]*mode*(over - 1)*(over + 1);
    }
}

/* Which rollers turn on contacts that slip, and take nearly all of their friction along the axle, from now on. */
static void begin_at_the_most(const omniroll_run_t *run, const work_t *work, const instant_t *now)
{
    const own_bearings_t *const own = &work->own;
    const double pace = length3(run->nu)*run->rate_of_speed;
    lanes_t force[2*MOST_WHEELS], asked[MOST_WHEELS];
    int some = 0;
    for (int i = 0; i < run->wheels; i++) {
        own->takes[i] = slides(run, i) ? -roller_mode(run, i)*own_bearings(run)[own->rollers_at + i].sliding : 0;
        some |= fabs(own->takes[i]) > 0;
    }
    if (!some)
        return;
    asked_of_rigid_wheels(own, &work->vehicle, run->wheels, now->arrays.nu, now->arrays.chi, now->point.core, force,
                          asked);
    for (int i = 0; i < run->wheels; i++) {
        const double most = fabs(asked[i][0]/force[2*i][0])*(own->load[i]*own->friction[2*i])[0];
        const double part = fabs(own->takes[i])/most;
        if (!(part > NEARLY_ALL))
            own->takes[i] = 0;
        own->scale[i] = pace/fmax((1 - part)*(1 + part), EPS);
    }
}

/* The rates of bearings in these states, with which rollers turn on their disks, and axles; of massless rollers, in
 * their modes, with what holds those that stick. Beside contacts that stick the last evaluation has found these. */
ALWAYS_INLINE void own_rates_in_lanes(const own_bearings_t *own, const vehicle_t *v, const int wheels,
                                      const lanes_t *nu, const lanes_t *chi, const lanes_t *core, lanes_t *rates)
{
    const int at = own->rollers_at;
    const lanes_t *const first = core + own_rates_at(wheels), *const contact = first + at;
    for (int k = 0; k < at; k++)
        rates[k] = first[k];
    if (SET_STRIPS) {
        memcpy(rates + at, own->spin, sizeof *rates*(size_t)wheels);
        spins_at_the_most(own, v, wheels, nu, chi, core, rates + at);
    } else if (SET_IN_SERIES)
        set_slip_spins(wheels, v, nu, chi, core + rates_at(wheels), own->torque + at, 0, 0, own->sticks + at, rates + at,
                       own->holding + at);
    else if (SET_DISKS_STICK) {
        set_contact_spins(wheels, v, nu, chi, contact, rates + at);
        set_spins_from_axial(wheels, v, nu, chi, contact + wheels, rates + at + wheels);
    }
}

/* The modes of massless rollers in contact. */
ALWAYS_INLINE omniroll_bearing_t *in_series(const omniroll_run_t *run, const work_t *work)
{
    return own_bearings(run) + work->own.rollers_at;
}

/* The same beside contacts that stick, in the present modes, into work->own.rate. */
static void own_rates_in_modes(const omniroll_run_t *run, const work_t *work, instant_t *now)
{
    lanes_t torque[MOST_WHEELS], sticks[MOST_WHEELS], aside[MOST_WHEELS];
    const int at = work->own.rollers_at;
    for (int i = 0; i < run->wheels; i++)
        torque[i] = lanes_of(-roller_mode(run, i)*in_series(run, work)[i].sliding);
    for (int i = 0; i < run->wheels; i++)
        sticks[i] = lanes_of(roller_mode(run, i) == 0);
    for (int k = 0; k < at; k++)
        work->own.rate[k] = now->point.core[own_rates_at(run->wheels) + k];
    corners_at(run, work, now->arrays.chi, now->arrays.ground_push, now->arrays.ground_yield);
    set_slip_spins(run->wheels, &work->vehicle, now->arrays.nu, now->arrays.chi,
                   now->point.core + rates_at(run->wheels), torque, now->arrays.ground_push, now->arrays.ground_yield,
                   sticks, work->own.rate + at, aside);
    spins_at_the_most(&work->own, &work->vehicle, run->wheels, now->arrays.nu, now->arrays.chi, now->point.core,
                      work->own.rate + at);
}

static void own_rates_there(const omniroll_run_t *run, const work_t *work, instant_t *now)
{
    if (SET_STRIPS)
        own_rates_in_modes(run, work, now);
    else
        own_rates_in_lanes(&work->own, &work->vehicle, run->wheels, now->arrays.nu, now->arrays.chi, now->point.core,
                           work->own.rate);
}

/* The same at this instant. Where no rollers turn they are numbers of the core. */
static void find_own_rates(const omniroll_run_t *run, const work_t *work)
{
    instant_t now;
    if (!SET_ROLLERS_TURN)
        return;
    at_this_instant(run, work, run->wheels, &now);
    if (SET_STRIPS)
        begin_at_the_most(run, work, &now);
    own_rates_there(run, work, &now);
    for (int k = 0; k < run->own_count; k++)
        work->own.now[k] = work->own.rate[k][0];
}

/* The rate of a bearing at this instant, and what it changes by. */
ALWAYS_INLINE double own_rate(const omniroll_run_t *run, const work_t *work, int k)
{
    return SET_ROLLERS_TURN ? work->own.now[k] : own_rates(run)[k];
}

ALWAYS_INLINE lanes_t own_acceleration_lanes(const omniroll_run_t *run, const work_t *work, int k)
{
    if (SET_DISKS_STICK && k >= work->own.rollers_at)
        return work->own.dot[k];
    return work->core_dot[own_rates_at(run->wheels) + k];
}

ALWAYS_INLINE double own_acceleration(const omniroll_run_t *run, const work_t *work, int k)
{
    return own_acceleration_lanes(run, work, k)[0];
}

/* Changes the rate of a bearing; of a roller that turns on its disk, its axial speed. */
ALWAYS_INLINE void put_own_rate(const omniroll_run_t *run, const work_t *work, int k, double rate)
{
    if (SET_ROLLERS_TURN) {
        own_rates(run)[k] += rate - work->own.now[k];
        work->own.now[k] = rate;
    } else
        own_rates(run)[k] = rate;
}

/* Whether one that sticks is asked for more than it takes. */
ALWAYS_INLINE int holds_no_more(const omniroll_bearing_t *own)
{
    const double torque = fabs(own->torque), most = most_of(own);
    return own->mode == 0 && torque - most > PASSED*rounding_of_holding(torque, most);
}

/* How many of them have rates that are numbers of the core; they stand first. */
ALWAYS_INLINE int count_in_core(const omniroll_run_t *run, const work_t *work)
{
    return SET_IN_SERIES ? work->own.rollers_at : run->own_count;
}

/* Those rest whose rates are zero within rounding: a rate is what is left of larger speeds. */
static void find_resting_own(omniroll_run_t *run, const work_t *work, double speed)
{
    for (int k = 0; k < count_in_core(run, work); k++) {
        const double rate = fabs(own_rate(run, work, k));
        own_bearings(run)[k].resting |= may_hold(own_bearings(run) + k)
            && rate <= AT_REST*EPS*(rate + speed*run->rate_of_speed);
    }
}

static void put_own_to_rest(omniroll_run_t *run, const work_t *work)
{
    for (int k = 0; k < count_in_core(run, work); k++) {
        omniroll_bearing_t *const bearing = own_bearings(run) + k;
        const double rate = bearing->resting ? 0 : own_rate(run, work, k);
        if (SET_GRIPS && bearing->resting && bearing->mode && k < work->own.rollers_at + run->wheels)
            run->grips[k%run->wheels].keeps = 0;        /* the direction of a slip that changes now                  */
        put_own_rate(run, work, k, rate);
        bearing->mode = may_hold(bearing) ? (rate > 0) - (rate < 0) : 1;
        if (SET_IN_SERIES && !bearing->mode)
            bearing->size = 0;
    }
}

/* The place among the inputs of the torque of an axle, or of a roller in contact; -1 of others. */
ALWAYS_INLINE int own_input(const omniroll_run_t *run, int k)
{
    if (SET_AXLES_STICK && k < run->wheels)
        return SET_BEARING_INPUT*run->wheels + k;
    return SET_ROLLERS_TURN && k < (SET_AXLES_STICK ? 2 : 1)*run->wheels
        ? SET_CONTACT_BEARING_INPUT*run->wheels + k%run->wheels : -1;
}

/* The torques of those that turn; the others stick, or where `hold` is 0 take none. */
static void turn_own(const omniroll_run_t *run, const work_t *work, int hold)
{
    for (int k = 0; k < run->own_count; k++) {
        omniroll_bearing_t *const bearing = own_bearings(run) + k;
        bearing->torque = -bearing->mode*bearing->sliding;
        work->own.torque[k] = lanes_of(bearing->torque);
        if (own_input(run, k) >= 0)
            run->inputs[own_input(run, k)] = bearing->torque;
        work->own.sticks[k] = lanes_of(hold && bearing->mode == 0);
    }
}

/* What holds those that stick, from the last evaluation at this instant. */
static void find_own_torques(const omniroll_run_t *run, const work_t *work)
{
    for (int k = 0; k < run->own_count; k++)
        if (own_bearings(run)[k].mode == 0)
            own_bearings(run)[k].torque = work->own.holding[k][0];
}

/* What the iteration at the nodes of the next step may leave in a rate. */
ALWAYS_INLINE double left_in_rates(const omniroll_run_t *run)
{
    if (!SET_AXLES_STICK && !SET_ROLLERS_TURN)
        return 0;
    const double rest = limit_of_step(run) - run->elapsed, h = run->step > 0 ? fmin(run->step, rest) : rest;
    return sweep_tolerance(run, h)*fmax(run->speed, run->fastest)*run->rate_of_speed;
}

/* What the rates are rounded against in the phase that starts now. */
static void size_own(const omniroll_run_t *run, const work_t *work)
{
    for (int k = 0; k < run->own_count; k++)
        if (!SET_IN_SERIES || own_bearings(run)[k].mode)    /* see engine_calls.h                              */
            own_bearings(run)[k].size = fabs(own_rate(run, work, k)) + length3(run->nu)*run->rate_of_speed;
}

ALWAYS_INLINE double noise_of_own(const omniroll_bearing_t *bearing, double rate)
{
    return EPS*(bearing->size + fabs(rate));
}

/* Those that turn and whose rates have passed zero, or are closer in time than tau to it, rest. Returns how many
 * there are. */
static int stop_own(omniroll_run_t *run, const work_t *work)
{
    const double together = run->at_event ? tau(run, run->elapsed - run->phase_start) : 0, left = left_in_rates(run);
    lanes_t nu_dot[3];
    int count = 0, near = run->at_event;
    for (int k = 0; k < count_in_core(run, work); k++) {
        const omniroll_bearing_t *const bearing = own_bearings(run) + k;
        const double rate = own_rate(run, work, k);
        near |= bearing->mode && may_hold(bearing) && -bearing->mode*rate >= -LANDED*noise_of_own(bearing, rate) - left;
    }
    if (!near)
        return 0;
    rates_at_this_instant(run, work, run->wheels, nu_dot);
    for (int k = 0; k < count_in_core(run, work); k++) {
        omniroll_bearing_t *const bearing = own_bearings(run) + k;
        const double own = own_rate(run, work, k), value = -bearing->mode*own, noise = noise_of_own(bearing, own);
        const double rate = -bearing->mode*own_acceleration(run, work, k);
        if (bearing->mode && !bearing->resting && may_hold(bearing)
            && (value > PASSED*noise + left || (rate > 0 && value >= -(LANDED*noise + left + together*rate)))) {
            bearing->resting = run->hold.undecided = 1;
            count++;
        }
    }
    return count;
}

/* What the polynomials of what holds, and of spins, lack at a step's end, from an evaluation there. */
static void find_own_late(step_t *s, const int wheels, const arrays_t *at)
{
    const own_bearings_t *const own = s->own;
    if (SET_ROLLERS_TURN)
        own_rates_in_lanes(own, s->vehicle, wheels, at->nu, at->chi, s->core_here, own->rate);
    for (int k = 0; k < s->own_count; k++)
        own->late[k] = (is_spin(s, k) ? own->rate[k][0] : own->holding[k][0]) - weighted(own->held + k, &gauss_end);
}
