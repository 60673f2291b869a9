/* Where a contact with the ground changes its mode: friction that is used up, a slip that comes to rest. As events.c
 * does for wheels and guards. */
#define GRIP_PASSED 16              /* roundings above zero is beyond what friction can hold                 */
#define GRIP_LANDS 2                /* roundings above zero is where a step ends                              */
#define SLIP_LANDS 0.1              /* of what is rounding of a slip: a step that ends with less ends at rest  */
/* So many of these: the direction of a slip is known well enough to locate an event by it. Where wheels may stand they
 * are what an iteration leaves, far more than rounding. */
#define FAR_FROM_NOISE 1e7
#define FAR_WHERE_STANDING 1e4
#define SLIP_AT_REST 1000           /* a slip is zero within this many roundings of the velocities that make it */
#define ALONG 100                   /* roundings of the speeds that make a slip: by less it is not turned */
#define GRIP_RISES 1e5              /* of these its slope at the end of a step is known                      */
#define TURNED_BY 4e-3              /* of what is rounding of a slip: so much turns it                       */
#define MAX_TURN_NOISE 1e-7
#define GRIP_TURNS 4096              /* roundings of what a contact takes inside a step                       */

/* Whether wheels may stand: one of these bearings can hold something. A set with bearings that stick also runs scenes
 * without such, in which slips are known as sharply as in sets that have none. */
ALWAYS_INLINE int may_stand(const omniroll_bearing_t *bearings, int count)
{
    int holds = 0;
    for (int k = 0; SET_STANDS && k < count && !holds; k++)
        holds = bearings[k].holding > 0;
    return holds;
}

/* The same of a step. */
ALWAYS_INLINE int may_stand_in(const step_t *s)
{
    return SET_STANDS && may_stand(s->hold.bearing, s->hold.count);
}

ALWAYS_INLINE double far_from_noise(const step_t *s)
{
    return may_stand_in(s) ? FAR_WHERE_STANDING : FAR_FROM_NOISE;
}

/* How much of its static friction a contact takes, squared, less 1: the square of its load. */
ALWAYS_INLINE double excess_of(const double *force, const double *per_reach, double load)
{
    double excess = -load;
    for (int k = SET_FIRST_DIRECTION; k < 2; k++)
        excess += force[k]*per_reach[k]*force[k]*per_reach[k];
    return excess;
}

/* The forces of contacts that slip at the step's end are those of their slips there, as in its row: what the iteration
 * leaves of the directions at the nodes would move what others take. */
ALWAYS_INLINE void push_at_end(const step_t *s, const int wheels, const point_t *point, lanes_t *push)
{
    lanes_t slip[2*MAX_WHEELS], force[2*MAX_WHEELS], slope[4*MAX_WHEELS], load[MAX_WHEELS];
    slips_of(wheels, s->vehicle, point->nu, point->chi, point->core, slip);
    loads_in_state(s, wheels, point->core, load);
    set_sliding_forces(wheels, s->vehicle, slip, load, s->contact.friction, force, slope);
    const double far = far_from_noise(s);
    for (int i = 0; i < wheels; i++) {
        const double size = sqrt(slip[2*i][0]*slip[2*i][0] + slip[2*i + 1][0]*slip[2*i + 1][0]);
        const int by_slip = may_turn(s, i) && size > far*s->slip.noise[i];
        for (int k = 2*i; k < 2*i + 2 && by_slip; k++)
            push[k] = force[k];
    }
    (void)slope;
}

/* The same of contacts that slip and whose rollers turn. */
static void push_corners_at_end(const step_t *s, const int wheels, arrays_t *at)
{
    lanes_t toward[2*MAX_WHEELS];
    for (int k = 0; k < 2*wheels; k++)
        toward[k] = lanes_of(s->slip.toward[k].node[NODES - 1]);
    put_corners(s, wheels, at->chi, toward, at->ground_push, at->ground_yield);
}

/* What the polynomials of what contacts take, and of what holds, lack at a step's end, from an evaluation there. */
NEVER_INLINE void measure_at_end(step_t *s, const int wheels)
{
    arrays_t at;
    lanes_t nu_dot[3], load[MAX_WHEELS];
    const point_t point = point_at_end(s, wheels, &at);
    if (SET_GRIPS)
        loads_in_state(s, wheels, point.core, load);
    if (SET_GRIPS && s->contact.turning)
        push_at_end(s, wheels, &point, at.ground_push);
    if (SET_STRIPS)
        push_corners_at_end(s, wheels, &at);
    core_rates_at(wheels, &point, nu_dot);
    for (int i = 0; SET_GRIPS && i < wheels; i++) {
        const double force[2] = {at.ground_force[2*i][0], at.ground_force[2*i + 1][0]};
        if (s->contact.grips[i])
            s->slip.excess_late[i] = excess_of(force, s->contact.per_reach + 2*i, load_squared(s, i, load[i])[0])
                - weighted(&s->slip.excess[i], &gauss_end);
    }
    for (int k = 0; (SET_HOLDS || SET_STANDS) && k < 3; k++)
        s->hold.demand_late.force[k] = at.held_force[k][0] - weighted(&s->hold.force[k], &gauss_end);
    for (int k = 0; SET_STANDS && k < 2*wheels; k++)
        s->hold.demand_late.along[k] = at.ground_force[k][0] - weighted(&s->hold.along[k], &gauss_end);
    if (SET_CORE_BEARINGS)
        find_bearings_late(s, wheels, &at);
}

/* Rates and forces of contacts that all stick, at the nodes of a step that has settled. */
NEVER_INLINE void look_at_contacts(step_t *s, const int wheels)
{
    for (int b = 0; b < BLOCKS; b++) {
        arrays_t at;
        lanes_t nu_dot[3];
        const point_t point = point_at(s, wheels, b, &at);
        core_rates_at(wheels, &point, nu_dot);
        keep_held_force(s, wheels, b, &at);
        for (int c = 0; c < coupled_size(wheels); c++)
            s->rate_core[c].lanes[b] = s->core_dot[c];
    }
    s->sweeps++;
}

/* How much rounding turns the slowest slip at the step's end: what sticks beside it takes so much more or less. */
ALWAYS_INLINE double noise_of_turns(const step_t *s, const int wheels)
{
    double noise = 0;
    for (int i = 0; i < wheels; i++) {
        const double size = may_turn(s, i) ? hypot(s->slip.end[2*i], s->slip.end[2*i + 1]) : 0;
        if (size > s->slip.noise[i])
            noise = fmax(noise, TURNED_BY*s->slip.noise[i]/size);
    }
    return fmin(noise, MAX_TURN_NOISE);
}

/* The slip velocities at the step's end. */
NEVER_INLINE void slips_at_end(step_t *s, const int wheels)
{
    arrays_t at;
    lanes_t slip[2*MAX_WHEELS];
    const point_t point = point_at_end(s, wheels, &at);
    slips_of(wheels, s->vehicle, point.nu, point.chi, point.core, slip);
    for (int k = 0; k < 2*wheels; k++)
        s->slip.end[k] = slip[k][0];
    s->slip.turn_noise = s->contact.turning && s->contact.gripping ? noise_of_turns(s, wheels) : 0;
}

/* How far a contact is from the end of its mode at the step's end, negative before it, and the rate of that. Of one
 * that slips it is its slip along its direction there. */
ALWAYS_INLINE double change_at_end(const step_t *s, int i, double *rate)
{
    if (!s->contact.grips[i]) {
        const double x = s->slip.toward[2*i].node[NODES - 1], y = s->slip.toward[2*i + 1].node[NODES - 1];
        *rate = -y*weighted(&s->slip.rate[2*i + 1], &gauss_end);
        double along = y*s->slip.end[2*i + 1];
        if (SET_FIRST_DIRECTION == 0) {
            *rate -= x*weighted(&s->slip.rate[2*i], &gauss_end);
            along += x*s->slip.end[2*i];
        }
        return -along;
    }
    const double value = weighted(&s->slip.excess[i], &gauss_end) + s->slip.excess_late[i];
    *rate = weighted(&s->slip.excess[i], &gauss_end_slope)/s->h;
    if (fabs(*rate)*s->h < grip_noise(s, value, GRIP_RISES))
        *rate = (value - s->slip.excess_start[i])/s->h;
    if (fabs(*rate)*s->h < grip_noise(s, value, 0.5*GRIP_PASSED))           /* it is as it was                            */
        *rate = 0;
    return value;
}

/* Whether a slip that is `beyond` rest at the step's end was before it at the start. It has come to rest inside the
 * step then, also where it turns back at the end, so that its rate there is zero. */
ALWAYS_INLINE int has_passed_rest(const step_t *s, int i, double beyond)
{
    double along = s->slip.toward[2*i + 1].node[0]*s->slip.start[2*i + 1];
    if (SET_FIRST_DIRECTION == 0)
        along += s->slip.toward[2*i].node[0]*s->slip.start[2*i];
    return beyond > s->slip.noise[i] && along > s->slip.noise[i];
}

/* Whether a slip goes in its direction by more than rounding at some node. */
ALWAYS_INLINE int has_gone(const step_t *s, int i)
{
    double largest = 0;
    for (int m = 0; m < NODES; m++)
        largest = fmax(largest, s->slip.toward[2*i].node[m]*s->slip.at[2*i].node[m]
                       + s->slip.toward[2*i + 1].node[m]*s->slip.at[2*i + 1].node[m]);
    return largest > s->slip.noise[i];
}

/* Whether a slip begins with the step under loads that swing, and is not known so far, or no slip: it does not end there. */
ALWAYS_INLINE int is_beginning(const step_t *s, int i)
{
    if (!SET_LOADS_FOLLOW || !s->contact.slides[i] || s->contact.falls[i] || fabs(s->slip.start[2*i]) > s->slip.noise[i]
        || fabs(s->slip.start[2*i + 1]) > s->slip.noise[i])
        return 0;
    return s->contact.early || (SET_FIRST_DIRECTION == 0 && !has_gone(s, i));
}

/* The length at which the first contact changes its mode, if that is before `length`. */
static double length_to_change(step_t *s, const int wheels, double length)
{
    if (s->contact.sliding)
        slips_at_end(s, wheels);
    for (int i = 0; i < wheels && !s->contact.blind; i++) {
        double rate;
        if ((!s->contact.slides[i] && !s->contact.grips[i]) || is_beginning(s, i))
            continue;
        const double change = change_at_end(s, i, &rate);
        const double noise = s->contact.slides[i] ? s->slip.noise[i] : grip_noise(s, change, GRIP_PASSED);
        const double value = s->contact.slides[i] ? change : change - GRIP_LANDS*GRIP_NOISE(change);
        const double least_rate = s->contact.slides[i] ? s->contact.settles : 0;
        if (!(rate > least_rate) && !(s->contact.slides[i] ? has_passed_rest(s, i, value) : value > noise))
            continue;
        double reached = s->contact.grips[i] ? reached_from(s, value, rate)
            : rate > least_rate ? s->h - value/rate : s->h/2;
        /* No other length comes nearer to rest. Where wheels may stand the noise is more than rounding, and one may. */
        if (s->contact.slides[i] && fabs(value) <= SLIP_LANDS*noise
            && !(may_stand_in(s) && fabs(reached - s->h) <= s->event.reach*s->h))
            reached = fmin(s->h, length);
        consider(s, &length, wheels + s->event.guards + i, reached, 1,
                 s->contact.grips[i] && rate > 0 ? grip_noise(s, change, 1)/rate : 0);
    }
    return length;
}

/* A contact whose mode ends inside the step and not at its end: where, or 1. */
static double turn_of_contacts(const step_t *s, const int wheels)
{
    double turned = 1;
    for (int i = 0; i < wheels; i++) {
        nodes_t rate;
        if (s->contact.grips[i]) {
            turned = fmin(turned, turn_of_values(&s->slip.excess[i], s->slip.excess_start[i], -INFINITY,
                                                 grip_noise(s, s->slip.excess_start[i], GRIP_TURNS)));
        } else if (may_turn(s, i) && SET_FIRST_DIRECTION == 0) {
            for (int m = 0; m < NODES; m++)
                if (s->slip.toward[2*i].node[m]*s->slip.at[2*i].node[m]
                    + s->slip.toward[2*i + 1].node[m]*s->slip.at[2*i + 1].node[m] < -s->slip.noise[i])
                    turned = fmin(turned, 0.5);
        } else if (s->contact.slides[i]) {
            const double sign = s->slip.toward[2*i + 1].node[0];
            for (int b = 0; b < BLOCKS; b++)
                rate.lanes[b] = -sign*s->slip.rate[2*i + 1].lanes[b];
            turned = fmin(turned, turn_beyond(&rate, weighted(&rate, &gauss_end), s->h, -sign*s->slip.start[2*i + 1],
                                              -INFINITY, 2*s->slip.noise[i]));
        }
    }
    return turned;
}
