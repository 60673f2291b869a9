/* Where wheels that stand give way: the least use of contacts and bearings that hold them comes to 1. */
#define USE_ROUNDINGS 64            /* a use is rounded to so many units in the last place: forces that hold */
#define USE_LIFTS 4                 /* roundings above 1 at which a step ends; what is used up is let go there */
#define MUCH_USED 0.5               /* at some node, where more than all may be used between two             */
#define USE_SLOPE 1e-6              /* of a step: over this the use's rate is found                          */

/* How far the axis of each wheel's roller in contact is from the ground at these angles, and how that changes. */
static void find_arms(const int wheels, const vehicle_t *vehicle, const standing_t *standing, const double *joint,
                      const double *chi, double *arm, double *per_chi)
{
    double nearer[MAX_WHEELS], inside[MAX_WHEELS];
    if (!SET_ROLLERS_TURN && !SET_ROLLERS_STICK) {
        memset(arm, 0, sizeof *arm*(size_t)wheels), memset(per_chi, 0, sizeof *per_chi*(size_t)wheels);
        return;
    }
    for (int i = 0; i < wheels; i++)
        inside[i] = fmax(fmin(chi[i], joint[i]), -joint[i]), nearer[i] = 1, per_chi[i] = 0;
    if (standing->contact)              /* else no roller sticks, and there is no demand on one             */
        nearer_at(wheels, vehicle, standing->contact, joint, inside, nearer, per_chi);
    for (int i = 0; i < wheels; i++) {
        arm[i] = standing->arm/nearer[i];
        per_chi[i] *= -arm[i]/nearer[i];
    }
}

#define REMAINDER_BEFORE_STRIP 0.2  /* of the way to where a bearing takes all of the friction: behind a step        */

/* How much more the ground's friction along a contact's axle is than what its massless roller takes, in N. */
ALWAYS_INLINE double margin_in_corner(const step_t *s, int i, double arm)
{
    return s->contact.load[i][0]*s->contact.friction[2*i][0] - s->hold.bearing[s->hold.states->rollers_at + i].sliding/arm;
}

/* The length of a step from here in which no roller that turns on a contact that slips comes to take all of its
 * friction: a little before that its spin has come to zero. */
static double longest_in_corners(const step_t *s, const int wheels)
{
    double arm[MAX_WHEELS], per_chi[MAX_WHEELS], time = INFINITY;
    find_arms(wheels, s->vehicle, s->hold.standing, s->joint, s->chi, arm, per_chi);
    for (int i = 0; i < wheels; i++) {
        const double axial = s->hold.bearing[s->hold.states->rollers_at + i].sliding/arm[i];
        const double margin = margin_in_corner(s, i, arm[i]);
        const double rises = -axial/arm[i]*per_chi[i]*s->start_core[rates_at(wheels) + i];
        if (s->contact.corner[i] && margin > 0 && rises > 0)
            time = fmin(time, (1 - REMAINDER_BEFORE_STRIP)*margin/rises);
    }
    return time;
}

/* Whether one has come to take more than that in a step all the same: 0.5, or 1. */
static double turn_of_corners(const step_t *s, const int wheels)
{
    double arm[MAX_WHEELS], per_chi[MAX_WHEELS], turned = 1;
    find_arms(wheels, s->vehicle, s->hold.standing, s->joint, s->end.chi, arm, per_chi);
    for (int i = 0; i < wheels; i++)
        if (s->contact.corner[i] && margin_in_corner(s, i, arm[i]) < 0)
            turned = 0.5;
    return turned;
}

ALWAYS_INLINE double rounding_of_use(const standing_t *standing, double use)
{
    return USE_ROUNDINGS*(EPS*(1 + use) + standing->rounding);
}

/* What standing wheels ask for at the step's end, and its rate there. */
static void demand_at_end(const step_t *s, const int wheels, demand_t *now, demand_t *change)
{
    double per_chi[MAX_WHEELS];
    for (int k = 0; k < 3; k++) {
        now->force[k] = weighted(&s->hold.force[k], &gauss_end) + s->hold.demand_late.force[k];
        change->force[k] = weighted(&s->hold.force[k], &gauss_end_slope)/s->h;
    }
    find_arms(wheels, s->vehicle, s->hold.standing, s->joint, s->end.chi, now->arm, per_chi);
    for (int i = 0; i < wheels; i++)
        change->arm[i] = per_chi[i]*s->end.rate[i];
    for (int k = 0; SET_STANDS && k < 2*wheels; k++) {
        now->along[k] = weighted(&s->hold.along[k], &gauss_end) + s->hold.demand_late.along[k];
        change->along[k] = weighted(&s->hold.along[k], &gauss_end_slope)/s->h;
    }
    for (int d = 0; SET_STANDS && d < s->hold.standing->count; d++) {
        const int k = s->hold.standing->bearing[d], at = 2*s->hold.standing->wheel[d] + s->hold.standing->direction[d];
        now->of_bearings[at] = weighted(s->hold.states->held + k, &gauss_end) + s->hold.states->late[k];
        change->of_bearings[at] = weighted(s->hold.states->held + k, &gauss_end_slope)/s->h;
    }
}

/* The demand the time dt later, at constant rates. */
static void demand_later(const demand_t *now, const demand_t *change, const int wheels, double dt, demand_t *later)
{
    for (int k = 0; k < 3; k++)
        later->force[k] = now->force[k] + dt*change->force[k];
    for (int k = 0; k < 2*wheels; k++) {
        later->along[k] = now->along[k] + dt*change->along[k];
        later->of_bearings[k] = now->of_bearings[k] + dt*change->of_bearings[k];
    }
    for (int i = 0; i < wheels; i++)
        later->arm[i] = now->arm[i] + dt*change->arm[i];
}

/* The length at which the least use comes to 1, if that is before `length`. */
static double length_to_use(step_t *s, const int wheels, double length)
{
    demand_t now, change, before;
    double forces[MAX_STANDING];
    if (!s->hold.standing->count)
        return length;
    memset(&now, 0, sizeof now), memset(&change, 0, sizeof change);
    demand_at_end(s, wheels, &now, &change);
    if (!s->hold.nearly_used && uses_little(s->hold.standing, &now, s->hold.used_by))
        return length;
    const double use = least_use(s->hold.standing, &now, s->hold.used_by);
    const double rounding = rounding_of_use(s->hold.standing, use);
    const double value = use - 1 - USE_LIFTS*rounding, span = USE_SLOPE*s->h;
    s->hold.nearly_used |= value > -NEAR_USED;
    if (value <= 0 && length <= s->h)
        return length;
    demand_later(&now, &change, wheels, -span, &before);
    double rate = use_less_before(s->hold.standing, &now, &before, use)/span;
    if (fabs(rate)*s->h < HELD_RISES*rounding)
        rate = (use - least_use(s->hold.standing, &s->hold.demand_start, forces))/s->h;
    if (fabs(rate)*s->h < 0.5*USE_LIFTS*rounding)       /* it is as it was                                      */
        rate = 0;
    if (rate > 0 || value > 0)
        consider(s, &length, wheels + s->event.guards + s->hold.of_contacts + s->hold.count,
                 reached_from(s, value, rate), 1, rate > 0 ? rounding/rate : 0);
    return length;
}

/* The demand at a node. */
static void demand_at_node(const step_t *s, const int wheels, int m, demand_t *now)
{
    double chi[MAX_WHEELS], per_chi[MAX_WHEELS];
    for (int k = 0; k < 3; k++)
        now->force[k] = s->hold.force[k].node[m];
    for (int k = 0; SET_STANDS && k < 2*wheels; k++)
        now->along[k] = s->hold.along[k].node[m];
    for (int i = 0; i < wheels; i++)
        chi[i] = s->at_chi[i].node[m];
    find_arms(wheels, s->vehicle, s->hold.standing, s->joint, chi, now->arm, per_chi);
    for (int d = 0; SET_STANDS && d < s->hold.standing->count; d++)
        now->of_bearings[2*s->hold.standing->wheel[d] + s->hold.standing->direction[d]]
            = s->hold.states->held[s->hold.standing->bearing[d]].node[m];
}

/* The power that bearings can take in a motion; exactly none of those whose rows are all but across it. */
static double power_of_bearings(const standing_t *standing, const demand_t *now, const double *motion)
{
    double power = 0;
    for (int d = 0; d < standing->count; d++) {
        const double moved = fabs(dot3(standing->rows.rows[d], motion));
        if (moved > PARALLEL*length3(standing->rows.rows[d])*length3(motion))
            power += moved*bound_of_bearing(standing, d)/fabs(arm_of(standing, d, now));
    }
    return power;
}

/* Where between the nodes the demand on bearings of wheels that roll is more than they take: in the motion in which it is
 * largest at node `m`, or 1. What they take there is as much as they can, whatever the demand. */
static double turn_of_motion(const step_t *s, const int wheels, int m)
{
    demand_t now;
    double forces[MAX_STANDING], motion[3];
    nodes_t value;
    memset(&now, 0, sizeof now);
    demand_at_node(s, wheels, m, &now);
    const double use = least_use(s->hold.standing, &now, forces);
    if (!(use > MUCH_USED && use < INFINITY))
        return 1;
    motion_of_use(s->hold.standing, &now, motion);
    for (int k = 0; k < NODES; k++) {
        demand_at_node(s, wheels, k, &now);
        value.node[k] = dot3(motion, now.force) - power_of_bearings(s->hold.standing, &now, motion);
    }
    const double start = dot3(motion, s->hold.demand_start.force)
        - power_of_bearings(s->hold.standing, &s->hold.demand_start, motion);
    return turn_of_values(&value, start, -INFINITY, HELD_NOISE*rounding_of_use(s->hold.standing, use)/USE_ROUNDINGS);
}

/* Where in the step more is used than there is, though not at its end, or 1. */
static double turn_of_use(const step_t *s, const int wheels)
{
    demand_t now;
    double forces[MAX_STANDING], largest = MUCH_USED;
    int at = -1;
    if (!s->hold.standing->count)
        return 1;
    memcpy(forces, s->hold.used_by, sizeof forces);
    memset(&now, 0, sizeof now);
    for (int m = 0; m < NODES; m++) {
        demand_at_node(s, wheels, m, &now);
        if (SET_HOLDS) {
            least_norm(&s->hold.standing->rows, now.force, forces);
            const double use = largest_use(s->hold.standing, &now, forces);
            at = use > largest ? m : at, largest = fmax(largest, use);
            continue;
        }
        if (uses_little(s->hold.standing, &now, forces))
            continue;
        const double use = least_use(s->hold.standing, &now, forces);
        if (use - 1 > HELD_NOISE*rounding_of_use(s->hold.standing, use))
            return gauss_node.node[m];
    }
    return at < 0 ? 1 : turn_of_motion(s, wheels, at);
}
