/* What unit forces on contacts and unit torques of bearings do, where something comes to rest.
 *
 * A unit is a component of a contact's slip, 2*wheel + component, or 2*wheels + the place of a bearing. */

/* Let the force or the torque of a unit be 1 in a lane. */
ALWAYS_INLINE void push_unit(const variations_t *w, const point_t *along, int unit, int lane)
{
#if SET_GRIPS
    if (unit < 2*w->wheels)
        along->ground_push[unit][lane] = 1;
#endif
    if (unit >= 2*w->wheels)
        (*own_torque(w, w->along, unit - 2*w->wheels))[lane] = 1;
    (void)along;
}

/* How the rate of a unit's slip, or of its bearing's own rate, moves. */
ALWAYS_INLINE double dot_of_unit(const variations_t *w, const point_t *along, int unit, int lane)
{
#if SET_GRIPS
    if (unit < 2*w->wheels)
        return along->slip_dot[unit][lane];
#endif
    return own_dot(w, along, unit - 2*w->wheels, lane);
}

/* What units do where the rates have been computed last: to the rates of all that is known, R (known x count), and to
 * the slips and the bearings' rates, W (count x count). */
static void put_responses(const variations_t *w, const int *unit, int count, double *to_known, double *to_own)
{
    const int wheels = OWN_WHEELS(w->wheels);
    const point_t at = point_of(w, w->vehicle, w->point), along = point_of(w, w->vehicle, w->along);
    for (int first = 0; first < count; first += LANES) {
        lanes_t nu_dot[3], moved[3];
        for (int k = first; k < count && k < first + LANES; k++)
            push_unit(w, &along, unit[k], k - first);
        rates_along(wheels, &at, &along, nu_dot, moved);
#if SET_HOLDS
        memcpy(w->bearings.nu_dot + 3, moved, sizeof moved);
#endif
        for (int k = first; k < count && k < first + LANES; k++) {
            for (int a = 0; a < w->known; a++)
                to_known[a*count + k] = (a < 3 ? moved[a] : along.core_dot[a - 3])[k - first];
            for (int i = 0; i < count; i++)
                to_own[i*count + k] = dot_of_unit(w, &along, unit[i], k - first);
        }
        take_way_back(w);
    }
}

/* Take from the deviations what forces and torques (count x groups) do to the rates. */
static void take_responses(variations_t *w, const double *to_known, int count, const lanes_t *force)
{
    const int groups = w->groups;
    for (int a = 0; a < w->known; a++)
        for (int k = 0; k < count; k++)
            for (int g = 0; g < groups; g++)
                w->moved[place_of_core(w, a)*groups + g] -= to_known[a*count + k]*force[k*groups + g];
}
