/* Where a bearing whose rate is a number of the core changes its mode: one that turns comes to rest, or the demand on
 * one that sticks becomes more than it takes. As events.c does for wheels and guards. */

/* What holds is rounded so. */
ALWAYS_INLINE double rounding_of_holding(double torque, double holding)
{
    return HELD_ROUNDINGS*EPS*(fabs(torque) + holding);
}

/* Whether a bearing can hold anything. One that cannot, of an effect that a scene has not, never rests. */
ALWAYS_INLINE int may_hold(const omniroll_bearing_t *bearing)
{
    return bearing->holding > 0;
}

/* What one that sticks takes at most: a massless roller also what it came to rest with. */
ALWAYS_INLINE double bound_of(const omniroll_bearing_t *bearing)
{
    return SET_IN_SERIES ? fmax(bearing->holding, bearing->size) : bearing->holding;
}

/* Whether a bearing turns as its roller does on its disk: then its rate at the nodes stands in the place of what holds. */
ALWAYS_INLINE int is_spin(const step_t *s, int k)
{
    return SET_ROLLERS_TURN && k >= s->hold.states->rollers_at && s->hold.bearing[k].mode;
}

/* The rate of a bearing at the step's start. */
ALWAYS_INLINE double bearing_start(const step_t *s, int k)
{
    return SET_ROLLERS_TURN ? s->hold.states->now[k] : s->start_core[bearing_rates_at(s->wheels) + k];
}

#define RISES_ALIKE 4                     /* times another rise: one of the same step that rounding has not made        */

/* Of a spin against its mode, at the step's end: the spin, and its rate. */
ALWAYS_INLINE double spin_at_end(const step_t *s, int k)
{
    return -s->hold.bearing[k].mode*(weighted(s->hold.states->held + k, &gauss_end) + s->hold.states->late[k]);
}

static double spin_rate_at_end(const step_t *s, int k)
{
    const double slope = -s->hold.bearing[k].mode*weighted(s->hold.states->held + k, &gauss_end_slope);
    const double start = -s->hold.bearing[k].mode*bearing_start(s, k);
    const double rounding = EPS*(s->hold.bearing[k].size + fabs(start));
    const double rises = spin_at_end(s, k) - start;     /* what the iteration leaves moves all nodes alike          */
    if (SET_IN_SERIES && slope*rises > 0 && fabs(slope) < RISES_ALIKE*fabs(rises) && fabs(rises) < RISES_ALIKE*fabs(slope))
        return slope/s->h;
    return (fabs(slope) < HELD_RISES*rounding ? rises : slope)/s->h;
}

/* Where in the step a spin is against its mode, and not at the end: where it is farthest, or 1. */
static double turn_of_spin(const step_t *s, int k)
{
    const omniroll_bearing_t *const bearing = s->hold.bearing + k;
    const double start = -bearing->mode*bearing_start(s, k);
    const double limit = HELD_NOISE*EPS*(bearing->size + fabs(start)) + s->hold.residual;
    nodes_t spin;
    for (int b = 0; b < BLOCKS; b++)
        spin.lanes[b] = -bearing->mode*s->hold.states->held[k].lanes[b];
    return turn_of_values(&spin, start, -INFINITY, limit);
}

/* How the rate of a bearing that turns changes at the nodes, against its mode. */
ALWAYS_INLINE nodes_t turning_rate(const step_t *s, int k)
{
    nodes_t rate;
    for (int b = 0; b < BLOCKS; b++)
        rate.lanes[b] = -s->hold.bearing[k].mode*s->rate_core[bearing_rates_at(s->wheels) + k].lanes[b];
    return rate;
}

/* How far a bearing is beyond the end of its mode at the step's end. */
ALWAYS_INLINE double bearing_at_end(const step_t *s, int k)
{
    const omniroll_bearing_t *const bearing = s->hold.bearing + k;
    if (is_spin(s, k))
        return spin_at_end(s, k);
    if (bearing->mode)
        return -bearing->mode*(bearing_start(s, k)
                               + s->h*weighted(s->rate_core + bearing_rates_at(s->wheels) + k, &gauss_weight));
    const double torque = weighted(s->hold.states->held + k, &gauss_end) + s->hold.states->late[k], bound = bound_of(bearing);
    return fabs(torque) - bound - BEARING_LANDS*rounding_of_holding(torque, bound);
}

/* What counts as rounding of the rate of one that turns. */
ALWAYS_INLINE double rounding_of_turning(const step_t *s, int k)
{
    return PASSED*EPS*(s->hold.bearing[k].size + fabs(bearing_start(s, k))) + s->hold.residual;
}

/* What is rounding of it, where the bearing sticks. */
ALWAYS_INLINE double rounding_at_end(const step_t *s, int k)
{
    return s->hold.bearing[k].mode ? 0
        : rounding_of_holding(weighted(s->hold.states->held + k, &gauss_end) + s->hold.states->late[k],
                              bound_of(s->hold.bearing + k));
}

/* The rate of that at the step's end. */
static double bearing_rate_at_end(const step_t *s, int k)
{
    const omniroll_bearing_t *const bearing = s->hold.bearing + k;
    if (is_spin(s, k))
        return spin_rate_at_end(s, k);
    if (bearing->mode)
        return -bearing->mode*weighted(s->rate_core + bearing_rates_at(s->wheels) + k, &gauss_end);
    const nodes_t *const held = s->hold.states->held + k;
    const double torque = weighted(held, &gauss_end) + s->hold.states->late[k], sign = torque < 0 ? -1 : 1;
    const double rounding = rounding_of_holding(torque, bound_of(s->hold.bearing + k));
    double rate = sign*weighted(held, &gauss_end_slope)/s->h, rises = fabs(torque) - sign*s->hold.bearing[k].torque;
    if (fabs(rate)*s->h < HELD_RISES*rounding)
        rate = rises/s->h;
    return fabs(rate)*s->h < 0.5*BEARING_LANDS*rounding ? 0 : rate;    /* 0: it is as it was                     */
}

/* Whether an axle starts to turn: where the ground is stiff, the residual of the iteration in the slip may turn it back for
 * an instant. It stops only where it is beyond what counts as rest. */
ALWAYS_INLINE int starts_from_rest(const step_t *s, int k, double beyond)
{
    /* but a spin is what the state says: one as slow as that may be about to stop                                  */
    if (SET_IN_SERIES && is_spin(s, k)
        && -s->hold.bearing[k].mode*(s->hold.states->held[k].node[0] - bearing_start(s, k)) > 0)
        return 0;
    return (SET_AXLES_STICK || SET_ROLLERS_TURN) && s->hold.bearing[k].mode && fabs(bearing_start(s, k)) <= beyond;
}

/* Whether a bearing ends no step by itself: one that holds a wheel which stands with others is looked at with these, and
 * one that cannot hold anything turns on. */
ALWAYS_INLINE int ends_no_step(const step_t *s, int k)
{
    return (SET_STANDS && s->hold.standing->has_part[k]) || (s->hold.bearing[k].mode && !may_hold(s->hold.bearing + k));
}

/* The length at which the first bearing changes its mode, if that is before `length`. One that is not beyond at the
 * step's end changes it later: not before a length that is shorter. */
static double length_to_bearing(step_t *s, const int wheels, double length)
{
    for (int k = 0; k < s->hold.count; k++) {
        if (ends_no_step(s, k))
            continue;
        const double value = bearing_at_end(s, k);
        if (value <= 0 && length <= s->h)
            continue;
        const double beyond = s->hold.bearing[k].mode ? rounding_of_turning(s, k) : 0;
        const double rate = bearing_rate_at_end(s, k);
        if (!((rate > 0 && !starts_from_rest(s, k, beyond)) || value > beyond))
            continue;
        consider(s, &length, wheels + s->event.guards + s->hold.of_contacts + k, reached_from(s, value, rate), 1,
                 rate > 0 ? rounding_at_end(s, k)/rate : 0);
    }
    return length;
}

/* A bearing whose mode ends inside the step and not at its end: where, or 1. */
static double turn_of_bearing(const step_t *s, int k)
{
    const omniroll_bearing_t *const bearing = s->hold.bearing + k;
    const double start = bearing_start(s, k);
    if (ends_no_step(s, k))
        return 1;
    if (is_spin(s, k))
        return turn_of_spin(s, k);
    if (bearing->mode) {
        if (s->h*LEBESGUE*largest_of(s->rate_core + bearing_rates_at(s->wheels) + k) <= bearing->mode*start)
            return 1;                           /* it is too fast to come to rest in the step                      */
        const nodes_t rate = turning_rate(s, k);
        return turn_beyond(&rate, weighted(&rate, &gauss_end), s->h, -bearing->mode*start, -INFINITY,
                           rounding_of_turning(s, k));
    }
    const double bound = bound_of(s->hold.bearing + k);
    const double limit = bound + HELD_NOISE*rounding_of_holding(s->hold.bearing[k].torque, bound);
    return turn_of_values(s->hold.states->held + k, s->hold.bearing[k].torque, -limit, limit);
}
