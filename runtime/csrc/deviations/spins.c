/* Free rollers that stick on their disks, in the equations of a step.
 *
 * The spins of all are numbers of the state, where wheels may slip the axial speeds, but none is solved for. The axial
 * speed a of a roller that turns has the rate
 *
 *     a' = (response) (torque of its bearing) + (fading) (spin),
 *
 * with a torque that is constant in a step; fading is there with viscous friction, alike for the rollers of a wheel. nu
 * feels the axial speeds through two momenta of each wheel. So beside nu these momenta are what a step's system is for:
 * they act upon themselves and nu alone, and where wheels may slip upon these. One that sticks goes with its
 * disk, and its spin does not deviate.
 *
 * What is known of the momenta here are sums that generated functions give of numbers of the rollers: momenta are those
 * of axial speeds, with the vehicle's own inertia, and moments those of accelerations by deviations of the torques. */

#if SET_GATHERS
#define FREE(w) ((w)->wheels*((w)->rollers - 1))
#define SUMS(w) (2*(w)->wheels)                 /* momenta; as many moments */

/* The rates of everything at a point and how they move: once in the library, for what does not call it often. */
NEVER_INLINE void rates_at(const variations_t *w, const point_t *at, const point_t *along, lanes_t *nu_dot,
                           lanes_t *nu_dot_along)
{
    rates_along(OWN_WHEELS(w->wheels), at, along, nu_dot, nu_dot_along);
}

/* The mode of a free roller in a row. */
ALWAYS_INLINE long long free_mode_in(const variations_t *w, long long row, int k)
{
    const int places = w->rollers - 1;
    return own_mode(w, row, roller_bearing(w, k/places, 1 + k%places));
}

/* Which free rollers stick as in a row, and the torques of the others' bearings. */
static void put_spin_modes(const variations_t *w, long long row)
{
    for (int k = 0; k < FREE(w); k++) {
        w->spins.sticks[k] = lanes_of(free_mode_in(w, row, k) == 0);
        w->spins.bearing[k] = lanes_of(w->run->free_torque[row*FREE(w) + k]);
    }
}

/* Make numbers of rollers that stick zero. */
static void leave_turning(const variations_t *w, lanes_t *of_rollers)
{
    for (int k = 0; k < FREE(w); k++)
        of_rollers[k] *= 1 - w->spins.sticks[k];
}

/* The axial acceleration of each free roller by torques of 1, or by spins of 1: where nu is held at zero it is that of
 * the spin. How it moves with each number of the vehicle stands behind it. */
static void put_response(variations_t *w, double torque, double spin, lanes_t *to)
{
    const int count = FREE(w), first = first_momentum(w);
    lanes_t nu_dot[3], nu_dot_along[3];
    for (int k = 0; k < count; k++) {
        w->spins.sticks[k] = lanes_of(0), w->spins.bearing[k] = lanes_of(torque);
        w->point[first + k] = lanes_of(spin);
    }
    for (int model = 0; model < w->run->models; model++) {
        const point_t at = point_of(w, &w->vehicle[model], w->point), along = point_of(w, at.vehicle, w->along);
        rates_at(w, &at, &along, nu_dot, nu_dot_along);
        memcpy(to + model*count, (model ? along.core_dot : at.core_dot) + first - 3, count*sizeof *to);
    }
    memset(w->point + first, 0, count*sizeof *to);
}

/* How a response moves in the columns, from how it moves with the numbers. */
static void spread_response(const variations_t *w, const lanes_t *by, lanes_t *to)
{
    const int count = FREE(w);
    memset(to, 0, count*w->groups*sizeof *to);
    for (int c = 0; c < w->numbered; c++)
        for (int k = 0; k < count; k++) {
            const int p = w->numbered_column[c];
            to[k*w->groups + p/LANES][p%LANES] = by[(1 + w->number_of[c])*count + k][0];
        }
}

/* The momenta of axial speeds, with the vehicle's own inertia. */
static void put_momenta_of(const variations_t *w, const lanes_t *axial, lanes_t *momenta)
{
    lanes_t still[FREE(w)], moved[2*MOST_WHEELS];
    memset(still, 0, sizeof still);
    set_momenta_along(OWN_WHEELS(w->wheels), w->vehicle, axial, still, momenta, moved);
}

/* Axial speeds of the first two free rollers of each wheel that make one of its momenta alone 1. */
static void put_basis(variations_t *w)
{
    const int places = w->rollers - 1;
    lanes_t axial[FREE(w)], momenta[2][2*MOST_WHEELS];
    for (int s = 0; s < 2; s++) {
        memset(axial, 0, sizeof axial);
        for (int i = 0; i < w->wheels; i++)
            axial[i*places + s] = lanes_of(1);
        put_momenta_of(w, axial, momenta[s]);
    }
    for (int i = 0; i < w->wheels; i++) {
        const lanes_t *const one = momenta[0] + 2*i, *const two = momenta[1] + 2*i;
        const double determinant = one[0][0]*two[1][0] - one[1][0]*two[0][0];
        double (*const basis)[2] = w->spins.basis + 2*i;
        basis[0][0] = two[1][0]/determinant, basis[0][1] = -one[1][0]/determinant;
        basis[1][0] = -two[0][0]/determinant, basis[1][1] = one[0][0]/determinant;
    }
}

static void prepare_spins(variations_t *w)
{
    memset(w->spins.bearing_along, 0, FREE(w)*sizeof *w->spins.bearing_along);
    for (int c = 0; c < 3; c++)
        w->held[ABSENT + c] = lanes_of(1);
    memset(w->bearings.sticks, 0, 2*w->wheels*sizeof *w->bearings.sticks);
    put_response(w, 1, 0, w->spins.response);
    put_response(w, 0, 1, w->spins.fading);
    memset(w->held, 0, 2*HELD_SIZE*sizeof *w->held);
    spread_response(w, w->spins.response, w->spins.response_moved);
    spread_response(w, w->spins.fading, w->spins.fading_moved);
    w->spins.fades = !are_zero(w->spins.fading, FREE(w));
    put_basis(w);
}

/* Axial speeds at a point and how these deviate in a vector of columns; of those that turn. */
static void put_axial(const variations_t *w, int group, const lanes_t *at, const lanes_t *moved, lanes_t *axial,
                      lanes_t *axial_moved)
{
#if SET_DISKS_STICK
    (void)group;
    memcpy(axial, at + first_momentum(w), FREE(w)*sizeof *axial);
    memcpy(axial_moved, moved + first_momentum(w), FREE(w)*sizeof *axial);
#else
    const int chi = point_chi(w);
    set_axial_speeds_along(OWN_WHEELS(w->wheels), &w->column[group], at, at + chi, at + POINT_CORE, moved, moved + chi,
                           moved + POINT_CORE, axial, axial_moved);
#endif
    leave_turning(w, axial_moved);
}

#if SET_DISKS_STICK
/* Let those that stick go with their disks: into the deviations of axial speeds, where a point moves. */
static void put_stuck_axial(const variations_t *w, const vehicle_t *vehicle, const lanes_t *at, const lanes_t *moved,
                            lanes_t *axial_moved)
{
    const int chi = point_chi(w);
    lanes_t still[FREE(w)], axial[FREE(w)], stuck[FREE(w)];
    memset(still, 0, sizeof still);
    set_axial_speeds_along(OWN_WHEELS(w->wheels), vehicle, at, at + chi, still, moved, moved + chi, still, axial,
                           stuck);
    for (int k = 0; k < FREE(w); k++)
        axial_moved[k] = lanes_select(w->spins.sticks[k] != 0, stuck[k], axial_moved[k]);
}
#endif

/* Deviations of the spins, of those that turn from those of the axial speeds. */
static void put_spins_along(const variations_t *w, const vehicle_t *vehicle, const lanes_t *at, const lanes_t *moved,
                            const lanes_t *axial, const lanes_t *axial_moved, lanes_t *spins_moved)
{
    const int chi = point_chi(w);
    lanes_t spins[FREE(w)];
    set_spins_from_axial_along(OWN_WHEELS(w->wheels), vehicle, at, at + chi, axial, moved, moved + chi, axial_moved,
                               spins, spins_moved);
    leave_turning(w, spins_moved);
}

/* The momenta of what the axial speeds deviate by. */
static void put_momenta_moved(variations_t *w)
{
    const int count = FREE(w), groups = w->groups;
    lanes_t axial_moved[count], momenta[SUMS(w)];
    for (int g = 0; g < groups; g++) {
        for (int k = 0; k < count; k++)
            axial_moved[k] = w->spins.axial_moved[k*groups + g];
        put_momenta_of(w, axial_moved, momenta);
        for (int k = 0; k < SUMS(w); k++)
            w->spins.momenta_moved[k*groups + g] = momenta[k];
    }
}

/* A step begins in a row: how its rollers deviate, and the moments that it is given. */
static void begin_spins(variations_t *w, long long row)
{
    const int count = FREE(w), moving = SET_MOVING*w->wheels, groups = w->groups;
    lanes_t moved[point_size(w)], axial[count], axial_moved[count], by_torque[count], moments[SUMS(w)];
    put_spin_modes(w, row);
    put_state(w, row, w->point);
    memset(moved, 0, sizeof moved);
    for (int g = 0; g < groups; g++) {
        put_moved(w, w->moved, g, moved);
        put_axial(w, g, w->point, moved, axial, axial_moved);
        for (int k = 0; k < count; k++) {
            w->spins.axial_moved[k*groups + g] = axial_moved[k];
            by_torque[k] = w->spins.response[k]*w->spins.torque_moved[k*groups + g];
        }
        leave_turning(w, by_torque);
        put_momenta_of(w, by_torque, moments);
        for (int k = 0; k < SUMS(w); k++)
            w->given[(moving + k)*groups + g] = moments[k];
    }
    put_momenta_moved(w);
}

/* The axial speeds at a block of nodes, whose state stands in w->point. */
static void put_axial_at_nodes(variations_t *w)
{
    const int chi = point_chi(w);
    lanes_t moved[FREE(w)];
    set_axial_speeds_along(OWN_WHEELS(w->wheels), w->vehicle, w->point, w->point + chi, w->point + POINT_CORE, w->along,
                           w->along + chi, w->along + POINT_CORE, w->spins.axial_at, moved);
}

/* Which of the momenta a direction is, or which of the moments, or -1. */
ALWAYS_INLINE int momentum_of(const variations_t *w, int d)
{
    return d >= first_momentum(w) && d < w->core ? d - first_momentum(w) : -1;
}
ALWAYS_INLINE int moment_of(const variations_t *w, int d)
{
    const int input = d - w->core - w->felt;
    return d < first_turn(w) && input >= SET_MOVING*w->wheels ? input - SET_MOVING*w->wheels : -1;
}

/* What a direction moves of the rollers: one of the momenta, or of the moments; or where nu, the angles or a number of
 * the vehicle move, the spins so that the axial speeds stay, and where wheels may slip the axial speeds of those that
 * stick. */
static void put_spins_of_direction(variations_t *w, int d, const vehicle_t *vehicle)
{
    const int momentum = momentum_of(w, d), moment = moment_of(w, d), places = w->rollers - 1;
    lanes_t *const spins = w->along + first_momentum(w);
    memset(spins, 0, FREE(w)*sizeof *spins);
    memset(w->spins.bearing_along, 0, FREE(w)*sizeof *spins);
    for (int s = 0; s < 2; s++) {
        const int one = momentum/2*places + s, other = moment/2*places + s;
        if (momentum >= 0)
            spins[one] = lanes_of(w->spins.basis[momentum][s]);
        if (moment >= 0)
            w->spins.bearing_along[other] = w->spins.basis[moment][s]/w->spins.response[other];
    }
#if SET_DISKS_STICK
    const int moves_disks = d < 3 || (d >= w->core && d < w->core + w->felt) || d >= w->directions;
    if (moves_disks)
        put_stuck_axial(w, vehicle, w->point, w->along, spins);
#else
    if (momentum < 0 && moment < 0) {
        lanes_t still[FREE(w)];
        memset(still, 0, sizeof still);
        put_spins_along(w, vehicle, w->point, w->along, w->spins.axial_at, still, spins);
    }
#endif
}

/* Spins at the nodes and how they move in a direction. */
static void put_spins(const variations_t *w, const vehicle_t *vehicle, lanes_t *spins, lanes_t *moved)
{
#if SET_DISKS_STICK
    const int chi = point_chi(w), axial = first_momentum(w);
    set_spins_from_axial_along(OWN_WHEELS(w->wheels), vehicle, w->point, w->point + chi, w->point + axial, w->along,
                               w->along + chi, w->along + axial, spins, moved);
#else
    (void)vehicle;
    memcpy(spins, w->point + POINT_CORE, FREE(w)*sizeof *spins);
    memcpy(moved, w->along + POINT_CORE, FREE(w)*sizeof *spins);
#endif
}

/* How the rates of the momenta move along a direction, at a block of nodes. */
static void put_momenta_along(const variations_t *w, int d, const vehicle_t *vehicle, lanes_t *to)
{
    const int momentum = momentum_of(w, d), moment = moment_of(w, d), count = FREE(w), number = d - w->directions;
    if (momentum >= 0 || moment >= 0) {
        memset(to, 0, SUMS(w)*sizeof *to);
        to[momentum >= 0 ? momentum : moment]
            = momentum >= 0 ? w->spins.fading[momentum/2*(w->rollers - 1)] : lanes_of(1);
        return;
    }
    lanes_t rate[count], spins[count], spins_moved[count];
    put_spins(w, vehicle, spins, spins_moved);
    for (int k = 0; k < count; k++) {
        rate[k] = w->spins.fading[k]*spins_moved[k];
        if (number >= 0)
            rate[k] += w->spins.fading[(1 + number)*count + k]*spins[k]
                + w->spins.response[(1 + number)*count + k]*w->spins.bearing[k];
    }
    leave_turning(w, rate);
    put_momenta_of(w, rate, to);
}

/* No direction any more. */
static void take_spins_back(variations_t *w)
{
    memset(w->along + first_momentum(w), 0, FREE(w)*sizeof *w->along);
    memset(w->spins.bearing_along, 0, FREE(w)*sizeof *w->spins.bearing_along);
}

/* The spins' deviations where a step ends, in the state of w->point: from those of the axial speeds. */
static void put_spins_at_end(variations_t *w)
{
    const int count = FREE(w), first = 3 + w->wheels + first_momentum(w), groups = w->groups;
    lanes_t moved[point_size(w)], axial[count], axial_moved[count], spins_moved[count];
    memset(moved, 0, sizeof moved);
    for (int g = 0; g < groups; g++) {
        put_moved(w, w->moved, g, moved);
        put_axial(w, g, w->point, moved, axial, axial_moved);
        for (int k = 0; k < count; k++)
            axial_moved[k] = w->spins.axial_moved[k*groups + g];
#if SET_DISKS_STICK
        put_stuck_axial(w, &w->column[g], w->point, moved, axial_moved);
        memcpy(spins_moved, axial_moved, sizeof spins_moved);
#else
        put_spins_along(w, &w->column[g], w->point, moved, axial, axial_moved, spins_moved);
#endif
        for (int k = 0; k < count; k++)
            w->moved[(first + k)*groups + g] = spins_moved[k];
    }
}
#endif
