/* Free rollers that stick on their disks, in the equations of a step.
 *
 * The spins of all are numbers of the state, where wheels may slip the axial speeds, but none is solved for. The axial
 * speed a of a roller that turns has the rate
 *
 *     a' = (response) (torque of its bearing) + (fading) (spin),
 *
 * with a torque that is constant in a step; fading is there with viscous friction, alike for the rollers of a wheel. nu
 * depends on the axial speeds through two momenta of each wheel. So a step's system is for nu and these momenta,
 * which act upon themselves and nu alone, and where wheels may slip upon these. One that sticks goes with its disk, and
 * its spin does not deviate.
 *
 * What is known of the momenta here are sums that generated functions give of numbers of the rollers: momenta are those
 * of axial speeds, with the vehicle's own inertia, and moments those of accelerations by deviations of the torques. */

#define SUMS(w) (2*(w)->wheels)                 /* momenta; as many moments */

/* The axial speeds of the disks where rollers are, and how these move with a point: those of rollers without a spin. */
static void put_disks(const variations_t *w, const vehicle_t *vehicle, const lanes_t *at, const lanes_t *moved)
{
    const int chi = point_chi(w);
    lanes_t zero[FREE(w)];
    memset(zero, 0, sizeof zero);
    set_axial_speeds_along(FIXED_WHEELS(w->wheels), vehicle, at, at + chi, zero, moved, moved + chi, zero,
                           w->spins.disks, w->spins.disks_moved);
}

/* The spin of a free roller at the point whose disks stand there. */
ALWAYS_INLINE lanes_t spin_of(const variations_t *w, int k)
{
    return w->point[first_momentum(w) + k] - SET_DISKS_STICK*w->spins.disks[k];
}

/* What the state has of a free roller, spin or axial speed, as it deviates where the axial speeds of it and of its disk
 * deviate by so much. One that sticks goes with its disk. */
ALWAYS_INLINE lanes_t state_of_spin(const variations_t *w, int k, lanes_t axial_moved, lanes_t disk_moved)
{
    return (1 - w->spins.sticks[k])*(axial_moved - disk_moved) + SET_DISKS_STICK*disk_moved;
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
        rates_along(FIXED_WHEELS(w->wheels), &at, &along, nu_dot, nu_dot_along);
        memcpy(to + model*count, (model ? along.core_dot : at.core_dot) + first - 3, count*sizeof *to);
    }
    memset(w->point + first, 0, count*sizeof *to);
}

/* The momenta of axial speeds, with the vehicle's own inertia. */
static void put_momenta_of(const variations_t *w, const lanes_t *axial, lanes_t *momenta)
{
    lanes_t zero[FREE(w)], moved[2*MAX_WHEELS];
    memset(zero, 0, sizeof zero);
    set_momenta_along(FIXED_WHEELS(w->wheels), w->vehicle, axial, zero, momenta, moved);
}

/* Axial speeds of the first two free rollers of each wheel that make one of its momenta alone 1. */
static void put_basis(variations_t *w)
{
    const int places = w->rollers - 1;
    lanes_t axial[FREE(w)], momenta[2][2*MAX_WHEELS];
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
    w->spins.fades = !are_zero(w->spins.fading, w->run->models*FREE(w));
    put_basis(w);
}

/* The momenta of what the axial speeds deviate by. */
static void put_momenta_moved(variations_t *w)
{
    const int groups = w->groups;
    lanes_t axial_moved[FREE(w)], momenta[SUMS(w)];
    for (int g = 0; g < groups; g++) {
        for (int k = 0; k < FREE(w); k++)
            axial_moved[k] = w->spins.axial_moved[k*groups + g];
        put_momenta_of(w, axial_moved, momenta);
        for (int k = 0; k < SUMS(w); k++)
            w->spins.momenta_moved[k*groups + g] = momenta[k];
    }
}

/* A step begins in a row: how its rollers deviate, those that turn, and the moments that it is given. */
static void begin_spins(variations_t *w, long long row)
{
    const int count = FREE(w), moving = SET_MOVING*w->wheels, groups = w->groups;
    lanes_t moved[point_size(w)], by_torque[count], moments[SUMS(w)];
    put_state(w, row, w->point);
    put_bearing_modes(w, row);
    memset(moved, 0, sizeof moved);
    for (int g = 0; g < groups; g++) {
        put_moved(w, w->moved, w->groups, g, moved);
        put_disks(w, &w->column[g], w->point, moved);
        for (int k = 0; k < count; k++) {
            const lanes_t axial = moved[first_momentum(w) + k] + SET_SPINS_STICK*w->spins.disks_moved[k];
            w->spins.axial_moved[k*groups + g] = (1 - w->spins.sticks[k])*axial;
            by_torque[k] = (1 - w->spins.sticks[k])*w->spins.response[k]*w->spins.torque_moved[k*groups + g];
        }
        put_momenta_of(w, by_torque, moments);
        for (int k = 0; k < SUMS(w); k++)
            w->given[(moving + k)*groups + g] = moments[k];
    }
    put_momenta_moved(w);
}

/* Which of the momenta a direction is (0), or which of the moments (1), or -1. */
ALWAYS_INLINE int sum_of(const variations_t *w, int d, int moments)
{
    const int first = moments ? w->core + w->feedback + SET_MOVING*w->wheels : first_momentum(w);
    return d >= first && d < (moments ? first_turn(w) : w->core) ? d - first : -1;
}

/* What a direction moves of the rollers: one of the momenta, or of the moments; or where the disks move, the spins so
 * that the axial speeds stay, and where wheels may slip the axial speeds of those that stick. */
static void put_spins_of_direction(variations_t *w, int d, const vehicle_t *vehicle)
{
    const int momentum = sum_of(w, d, 0), moment = sum_of(w, d, 1), places = w->rollers - 1;
    lanes_t *const axial = w->along + first_momentum(w);
    memset(axial, 0, FREE(w)*sizeof *axial);
    memset(w->spins.bearing_along, 0, FREE(w)*sizeof *axial);
    for (int s = 0; s < 2; s++) {
        const int one = momentum/2*places + s, other = moment/2*places + s;
        if (momentum >= 0)
            axial[one] = lanes_of(w->spins.basis[momentum][s]);
        if (moment >= 0)
            w->spins.bearing_along[other] = w->spins.basis[moment][s]/w->spins.response[other];
    }
    if (momentum >= 0 || moment >= 0)
        return;
    put_disks(w, vehicle, w->point, w->along);
    for (int k = 0; k < FREE(w); k++)
        axial[k] = (w->spins.sticks[k] - SET_SPINS_STICK)*w->spins.disks_moved[k];
}

/* How the rates of the momenta move along this direction, at a block of nodes; and how the disks do, and the axial
 * accelerations by numbers alone, of which these are sums. */
static void put_momenta_along(const variations_t *w, int d, int b, lanes_t *to)
{
    const int momentum = sum_of(w, d, 0), moment = sum_of(w, d, 1), count = FREE(w), number = d - w->directions;
    const spins_t *const s = &w->spins;
    lanes_t rate[count];
    if (momentum >= 0 || moment >= 0) {
        memset(to, 0, SUMS(w)*sizeof *to);
        to[momentum >= 0 ? momentum : moment] = momentum >= 0 ? s->fading[momentum/2*(w->rollers - 1)] : lanes_of(1);
        return;
    }
    for (int k = 0; k < count; k++) {
        const lanes_t turns = 1 - s->sticks[k];
        const int grown = (1 + number)*count + k;
        rate[k] = -turns*s->fading[k]*s->disks_moved[k];
        s->disks_by[d*count + k].lanes[b] = s->disks_moved[k];
        if (number >= 0) {
            const lanes_t by_number = turns*(s->fading[grown]*spin_of(w, k) + s->response[grown]*s->bearing[k]);
            s->axial_by[number*count + k].lanes[b] = by_number;
            rate[k] += by_number;
        }
    }
    put_momenta_of(w, rate, to);
}

/* The deviations of what the state has of free rollers where a step ends, in the state of w->point. */
static void put_spins_at_end(variations_t *w)
{
    const int first = 3 + w->wheels + first_momentum(w), groups = w->groups;
    lanes_t moved[point_size(w)];
    memset(moved, 0, sizeof moved);
    for (int g = 0; g < groups; g++) {
        put_moved(w, w->moved, w->groups, g, moved);
        put_disks(w, &w->column[g], w->point, moved);
        for (int k = 0; k < FREE(w); k++)
            w->moved[(first + k)*groups + g] = state_of_spin(w, k, w->spins.axial_moved[k*groups + g],
                                                             w->spins.disks_moved[k]);
    }
}
