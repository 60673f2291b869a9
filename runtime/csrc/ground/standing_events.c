/* Where wheels that stand give way: the force that holds nu leaves what the ground and the bearings can give
 * together. Facets of bearings alone are in events.c. The numbered rules are in
 * runtime/omniroll/effects/ground_with_axles.py. */
#if SET_STANDS_ALONE
#define STANDING_ROUNDINGS 64       /* times a force's: of forces that hold                                 */
#define LIFTS (2*PASSED)            /* of these above a facet is where a step ends                          */

/* The largest force on a standing wheel in a direction, +-1, along the rolling direction: of the ground, and what the
 * bearing allows. Rates become those of these. */
ALWAYS_INLINE void largest_forces(const standing_t *standing, int wheel, int sign, const asked_t *now, asked_t *change,
                                  double *force, double *rate)
{
    rate[1] = sign*change->asked[wheel]/standing->radius;
    force[0] = left_of_ground(standing, wheel, now, change, rate);
    force[1] = (standing->holding[wheel] + sign*now->asked[wheel])/standing->radius;
}

/* How much more power a facet's motion asks for than the standing wheels can take, its rate, and its rounding. */
static double beyond_facet(const standing_t *standing, const facet_t *facet, const asked_t *now, asked_t *change,
                           double *rate, double *rounding)
{
    double value = -dot3(facet->normal, now->force), sizes = 0;
    *rate = -dot3(facet->normal, change->force);
    for (int k = 0; k < standing->count; k++) {
        const double moved = moved_by(standing->rows.rows[k], facet->normal);
        double force[2], rates[2];
        if (moved == 0)
            continue;
        largest_forces(standing, standing->wheel[k], moved > 0 ? 1 : -1, now, change, force, rates);
        value -= standing->radius*fabs(moved)*fmin(force[0], force[1]);
        *rate -= standing->radius*fabs(moved)*(force[0] <= force[1] ? rates[0] : rates[1]);
    }
    for (int k = 0; k < 3; k++)
        sizes += fabs(facet->normal[k])*(fabs(now->force[k]) + standing->size[k]);
    *rounding = STANDING_ROUNDINGS*EPS*sizes;
    return value;
}

/* What the wheels ask for at the step's end, and its rate there. */
static void asked_at_end(const step_t *s, asked_t *now, asked_t *change)
{
    for (int k = 0; k < 3; k++) {
        now->force[k] = weighted(&s->force[k], &gauss_end) + s->asked_late.force[k];
        change->force[k] = weighted(&s->force[k], &gauss_end_slope)/s->h;
    }
    for (int k = 0; k < s->standing->count; k++) {
        const int i = s->standing->wheel[k];
        asked_of_ground_at_end(s, i, now, change);
        now->asked[i] = weighted(s->own->held + i, &gauss_end) + s->own->late[i];
        change->asked[i] = weighted(s->own->held + i, &gauss_end_slope)/s->h;
    }
}

/* The length at which the first facet is passed, if that is before `length`. */
static double length_to_facets(step_t *s, const int wheels, double length)
{
    asked_t now, change, none;
    if (!s->standing->facet_count)
        return length;
    memset(&none, 0, sizeof none);
    asked_at_end(s, &now, &change);
    for (int f = 0; f < s->standing->facet_count; f++) {
        const facet_t *const facet = s->standing->facets + f;
        double rate, rounding, still, of_start;
        const double end = beyond_facet(s->standing, facet, &now, &change, &rate, &rounding);
        const double start = beyond_facet(s->standing, facet, &s->asked_start, &none, &still, &of_start);
        if (fabs(rate)*s->h < FACET_RISES*rounding)
            rate = (end - start)/s->h;
        if (fabs(rate)*s->h < 0.5*LIFTS*rounding)       /* it is as it was                                      */
            rate = 0;
        const double value = end - LIFTS*rounding;
        if (!(rate > 0 || value > 0))
            continue;
        const double reached = reached_from(s, value, rate);
        if (comes_first(s, reached, length)) {
            length = reached;
            s->landing = wheels + s->guards + s->facets + wheels + f;
            s->unsure = rate > 0 ? rounding/rate : 0;
        }
    }
    return length;
}

/* A facet that is passed at a node and not at the step's end: where, or 1. */
static double turn_of_standing(const step_t *s)
{
    asked_t now, none;
    memset(&none, 0, sizeof none);
    for (int m = 0; m < NODES && s->standing->facet_count; m++) {
        for (int k = 0; k < 3; k++)
            now.force[k] = s->force[k].node[m];
        for (int k = 0; k < s->standing->count; k++) {
            const int i = s->standing->wheel[k];
            now.along[i] = s->along[i].node[m], now.asked[i] = s->own->held[i].node[m];
        }
        for (int f = 0; f < s->standing->facet_count; f++) {
            double rate, rounding;
            const facet_t *const facet = s->standing->facets + f;
            if (beyond_facet(s->standing, facet, &now, &none, &rate, &rounding) > FACET_NOISE*rounding)
                return gauss_node.node[m];
        }
    }
    return 1;
}
#endif
