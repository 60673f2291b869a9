/* Free rollers that stick on their disks, in the equations of a step.
 *
 * The spins of all are numbers of the state, but none has to be solved for. The axial speed of one that turns goes as the
 * torque of its bearing alone, which is constant in a step: its deviation is known beforehand. One that sticks takes its
 * disk's motion, and its spin does not deviate. So the rates of nu are all that a step's system is left for. They feel
 * the axial speeds through two momenta of each wheel, which change evenly in a step, and the torques through two moments
 * of each wheel. Both are combinations of numbers of the rollers: the momenta are those that the generated function gives
 * of axial speeds, with the vehicle's own inertia, and the moments are those of the torques' axial accelerations. */

#if SET_SPINS_STICK
#define FREE(w) ((w)->wheels*((w)->rollers - 1))
#define SUMS(w) (2*(w)->wheels)                 /* momenta; as many moments */

/* The rates of everything at a point and how they move: once in the library, for what does not call it often. */
NEVER_INLINE void rates_at(const variations_t *w, const point_t *at, const point_t *along, lanes_t *nu_dot,
                           lanes_t *nu_dot_along)
{
    rates_along(OWN_WHEELS(w->wheels), at, along, nu_dot, nu_dot_along);
}

/* Which free rollers stick as in a row, and the torques of the others' bearings. */
static void put_spin_modes(const variations_t *w, long long row)
{
    for (int k = 0; k < FREE(w); k++) {
        w->free_sticks[k] = lanes_of(w->run->free_mode[row*FREE(w) + k] == 0);
        w->free_bearing[k] = lanes_of(w->run->free_torque[row*FREE(w) + k]);
    }
}

/* Make numbers of rollers that stick zero. */
static void leave_turning(const variations_t *w, lanes_t *of_rollers)
{
    for (int k = 0; k < FREE(w); k++)
        of_rollers[k] *= 1 - w->free_sticks[k];
}

/* The axial acceleration of each free roller by a torque of 1: where nu is held at zero it is that of its spin. */
static void put_responses(variations_t *w)
{
    lanes_t nu_dot[3], nu_dot_along[3];
    for (int c = 0; c < 3; c++)
        w->held[ABSENT + c] = lanes_of(1);
    for (int k = 0; k < FREE(w); k++)
        w->free_sticks[k] = lanes_of(0), w->free_bearing[k] = lanes_of(1);
    for (int g = 0; g < w->groups; g++) {
        const point_t at = point_of(w, &w->column[g], w->point), along = point_of(w, at.vehicle, w->along);
        rates_at(w, &at, &along, nu_dot, nu_dot_along);
        for (int k = 0; k < FREE(w); k++)
            w->response[k] = at.core_dot[k], w->response_moved[k*w->groups + g] = along.core_dot[k];
    }
    memset(w->held, 0, 2*HELD_SIZE*sizeof *w->held);
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
        double (*const basis)[2] = w->basis + 2*i;
        basis[0][0] = two[1][0]/determinant, basis[0][1] = -one[1][0]/determinant;
        basis[1][0] = -two[0][0]/determinant, basis[1][1] = one[0][0]/determinant;
    }
}

static void prepare_spins(variations_t *w)
{
    memset(w->bearing_along, 0, FREE(w)*sizeof *w->bearing_along);
    put_responses(w);
    put_basis(w);
}

/* Axial speeds at a point and how these deviate in a vector of columns; of those that turn. */
static void put_axial(const variations_t *w, int group, const lanes_t *at, const lanes_t *moved, lanes_t *axial,
                      lanes_t *axial_moved)
{
    const int chi = point_chi(w);
    set_axial_speeds_along(OWN_WHEELS(w->wheels), &w->column[group], at, at + chi, at + POINT_CORE, moved, moved + chi,
                           moved + POINT_CORE, axial, axial_moved);
    leave_turning(w, axial_moved);
}

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

/* How the axial accelerations deviate: by the torques' deviations, and by the inertia of the rollers. */
ALWAYS_INLINE lanes_t axial_rate_moved(const variations_t *w, int k, int group)
{
    const int own = k*w->groups + group;
    return w->response[k]*w->torque_moved[own] + w->response_moved[own]*w->free_bearing[k];
}

/* A step begins in a row: what its rollers are given, and how it deviates. */
static void begin_spins(variations_t *w, long long row)
{
    const int count = FREE(w), sums = SUMS(w), moving = SET_MOVING*w->wheels, groups = w->groups;
    lanes_t moved[point_size(w)], axial[count], axial_moved[count], rate_moved[count], by_torque[count], sum[3][sums];
    put_spin_modes(w, row);
    put_state(w, row, w->point);
    memset(moved, 0, sizeof moved);
    for (int g = 0; g < groups; g++) {
        put_moved(w, w->moved, g, moved);
        put_axial(w, g, w->point, moved, axial, axial_moved);
        for (int k = 0; k < count; k++) {
            const lanes_t turns = 1 - w->free_sticks[k];
            w->axial_moved[k*groups + g] = axial_moved[k];
            rate_moved[k] = w->axial_rate[k*groups + g] = turns*axial_rate_moved(w, k, g);
            by_torque[k] = turns*w->response[k]*w->torque_moved[k*groups + g];
        }
        put_momenta_of(w, axial_moved, sum[0]);
        put_momenta_of(w, rate_moved, sum[1]);
        put_momenta_of(w, by_torque, sum[2]);
        for (int k = 0; k < sums; k++) {
            w->given[(moving + k)*groups + g] = sum[0][k];
            w->given[(w->inputs + moving + k)*groups + g] = sum[1][k];
            w->given[(moving + sums + k)*groups + g] = sum[2][k];
        }
    }
    for (int u = 0; u < w->inputs; u++)
        w->is_given[u] = !are_zero(w->given + u*groups, groups)
            || (u < w->changing && !are_zero(w->given + (w->inputs + u)*groups, groups));
}

/* The axial speeds at a block of nodes, whose state stands in w->point. */
static void put_axial_at_nodes(variations_t *w)
{
    const int chi = point_chi(w);
    lanes_t moved[FREE(w)];
    set_axial_speeds_along(OWN_WHEELS(w->wheels), w->vehicle, w->point, w->point + chi, w->point + POINT_CORE, w->along,
                           w->along + chi, w->along + POINT_CORE, w->axial_at, moved);
}

/* The place of a direction among the inputs, or less than zero. */
ALWAYS_INLINE int input_of(const variations_t *w, int d) { return d < w->directions ? d - w->core - w->felt : -1; }

/* Whether nothing deviates along a direction, so that no slope by it is needed. */
ALWAYS_INLINE int is_idle(const variations_t *w, long long row, int d)
{
    (void)row;
    return input_of(w, d) >= 0 && !w->is_given[input_of(w, d)];
}

/* What a direction moves of the rollers: where nu, the angles or a number of the vehicle move, the spins so that the axial
 * speeds stay; or one of the momenta, or of the moments. */
static void put_spins_of_direction(variations_t *w, int d, const vehicle_t *vehicle)
{
    const int input = input_of(w, d), sum = input - SET_MOVING*w->wheels, places = w->rollers - 1;
    lanes_t *const spins = w->along + POINT_CORE;
    memset(spins, 0, FREE(w)*sizeof *spins);
    memset(w->bearing_along, 0, FREE(w)*sizeof *spins);
    if (input < 0) {
        lanes_t still[FREE(w)];
        memset(still, 0, sizeof still);
        put_spins_along(w, vehicle, w->point, w->along, w->axial_at, still, spins);
    } else if (sum >= 0) {
        const int own = sum%SUMS(w), first = own/2*places;
        for (int s = 0; s < 2; s++)
            if (sum < SUMS(w))
                spins[first + s] = lanes_of(w->basis[own][s]);
            else
                w->bearing_along[first + s] = w->basis[own][s]/w->response[first + s];
    }
}

/* No direction any more. */
static void take_spins_back(variations_t *w)
{
    memset(w->along + POINT_CORE, 0, FREE(w)*sizeof *w->along);
    memset(w->bearing_along, 0, FREE(w)*sizeof *w->bearing_along);
}

/* The spins' deviations where a step ends, before a row: from those of the axial speeds. */
static void put_spins_at_end(variations_t *w, long long row, double h)
{
    const int count = FREE(w), first = 6 + w->wheels, groups = w->groups;
    lanes_t moved[point_size(w)], axial[count], axial_moved[count], spins_moved[count];
    memset(moved, 0, sizeof moved);
    put_state(w, row, w->point);
    for (int g = 0; g < groups; g++) {
        put_moved(w, w->moved, g, moved);
        put_axial(w, g, w->point, moved, axial, axial_moved);
        for (int k = 0; k < count; k++)
            axial_moved[k] = w->axial_moved[k*groups + g] + h*w->axial_rate[k*groups + g];
        put_spins_along(w, &w->column[g], w->point, moved, axial, axial_moved, spins_moved);
        for (int k = 0; k < count; k++)
            w->moved[(first + k)*groups + g] = spins_moved[k];
    }
}
#endif
