/* Speeds of what may stick, and what unit forces on contacts and unit torques of bearings do to them, where something
 * comes to rest.
 *
 * A unit is a component of a contact's slip, 2*wheel + component, or 2*wheels + the place of a bearing. The speed of a
 * massless roller beside contacts that stick is that of its wheel along the axle, over the distance of its axis from
 * the ground in its middle. */
#define UNITS(w) (2*(w)->wheels + BEARINGS(w))

/* How the speeds of all units move (UNITS) where the state in w->point moves along `tangent`, with the numbers of a
 * vehicle or with none. */
static void put_speeds_moved(const variations_t *w, const vehicle_t *vehicle, lanes_t *tangent, lanes_t *to)
{
    const int wheels = FIXED_WHEELS(w->wheels);
    const point_t at = point_of(w, vehicle, w->point);
    point_t along = point_of(w, vehicle, w->along);
    lanes_t rate[2][MAX_WHEELS], rate_moved[2][MAX_WHEELS], *axles = tangent + POINT_CORE, *free = tangent + POINT_CORE;
    lanes_t slip[2*MAX_WHEELS];
    along.nu = tangent + POINT_NU, along.core = tangent + POINT_CORE, along.chi = tangent + point_chi(w);
    slips_of(w, &at, &along, slip, to);
    if (SET_HOLDS) {
        set_wheel_rates_along(wheels, vehicle, at.nu, at.chi, along.nu, along.chi, rate[0], rate[1], rate_moved[0],
                              rate_moved[1]);
        axles = rate_moved[0];
    }
#if SET_DISKS_STICK                     /* where spins have these arguments */
    const int axial = first_momentum(w);
    lanes_t spins[FREE(w)], spins_moved[FREE(w)];
    set_slip_spins_along(wheels, vehicle, at.nu, at.chi, at.core + wheels, along.nu, along.chi, along.core + wheels,
                         rate[1], rate_moved[1]);
    set_spins_from_axial_along(wheels, vehicle, at.nu, at.chi, w->point + axial, along.nu, along.chi, tangent + axial,
                               spins, spins_moved);
    free = spins_moved;
#endif
    for (int i = 0; i < wheels && SET_IN_SERIES; i++)   /* where no contact sticks no speed comes to rest: changes.c */
        rate_moved[1][i] = SET_STRIPS ? to[2*i]/w->run->contacts.standing[1] : lanes_of(0);
    for (int k = 0; k < BEARINGS(w); k++)
        to[2*wheels + k] = *of_bearing(w, k, axles, rate_moved[1], free);
}

/* The same for the deviations in a row, which w->point has: UNITS x groups. */
static void put_speeds_of_columns(const variations_t *w, lanes_t *to)
{
    lanes_t tangent[point_size(w)], moved[UNITS(w)];
    memset(tangent, 0, sizeof tangent);
    for (int g = 0; g < w->groups; g++) {
        put_moved(w, w->moved, w->groups, g, tangent);
        put_speeds_moved(w, &w->column[g], tangent, moved);
        for (int k = 0; k < UNITS(w); k++)
            to[k*w->groups + g] = moved[k];
    }
}

/* What units do where the rates have been computed last: to the rates of all that is known, R (known x count), and to
 * the speeds of the units, W (count x count). */
static void put_responses(const variations_t *w, const int *unit, int count, double *to_known, double *to_speed)
{
    const point_t at = point_of(w, w->vehicle, w->point), along = point_of(w, w->vehicle, w->along);
    lanes_t nu_dot[3], tangent[point_size(w)], moved[UNITS(w)];
    memset(tangent, 0, sizeof tangent);
    for (int first = 0; first < count; first += LANES) {
        for (int k = first; k < count && k < first + LANES; k++) {
            const int bearing = unit[k] - 2*w->wheels;
            (bearing < 0 ? along.ground_push + unit[k] : torque_of_bearing(w, w->along, bearing))[0][k - first] = 1;
        }
        rates_along(FIXED_WHEELS(w->wheels), &at, &along, nu_dot, tangent);
        memcpy(tangent + POINT_CORE, along.core_dot, (w->known - 3)*sizeof *tangent);
        clear_tangent(w);
        put_speeds_moved(w, w->vehicle, tangent, moved);
        for (int k = first; k < count && k < first + LANES; k++) {
            for (int a = 0; a < w->known; a++)
                to_known[a*count + k] = tangent[a][k - first];
            for (int i = 0; i < count; i++)
                to_speed[i*count + k] = moved[unit[i]][k - first];
        }
    }
}

/* Take from the deviations what forces and torques (count x groups) do to the rates of all that is known. */
static void take_responses(variations_t *w, const double *to_known, int count, const lanes_t *force)
{
    const int groups = w->groups;
    for (int a = 0; a < w->known; a++)
        for (int k = 0; k < count; k++)
            for (int g = 0; g < groups; g++)
                w->moved[place_of_core(w, a)*groups + g] -= to_known[a*count + k]*force[k*groups + g];
}
