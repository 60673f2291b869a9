/* Loads that follow the motion: solved together with the accelerations. The numbered rules are in
 * runtime/omniroll/effects/ground_loads.py.
 *
 * The ground's friction is linear in the two moments of the loads, and the moments that the motion then asks for are
 * linear in the accelerations: two equations in each lane. What the moments do to the rates is the response; once it is
 * known about, an evaluation with moments that are nearly right needs no other to correct them.
 *
 * Bearings of massless rollers that turn leave of loads what is in no proportion to them. There the friction is linear
 * about some loads, and these are found by Newton's rule: bearings/under_loads.h. */
#if SET_LOADS
#define LOADS_RESPOND 3             /* evaluations with which the response is found                           */

/* What the ground's forces are in proportion to, under the loads that have been found. */
ALWAYS_INLINE void put_factors(const int wheels, const point_t *at)
{
    loads_t *const loads = at->loads;
    const lanes_t *const carries = at->inputs + SET_CARRIES_INPUT*wheels;
    for (int i = 0; i < wheels; i++)
        loads->factor[i] = SET_FRICTION ? carries[i]*loads->compression[i] : carries[i];
#if SET_NEARLY_LINEAR
    for (int i = 0; i < wheels; i++)        /* about 0 without a bearing: it is the load                     */
        loads->factor[i] = loads->about[i] + loads->gain[i]*(loads->factor[i] - loads->about[i]);
#endif
#if SET_CORNER_LOADS
    for (int i = 0; i < wheels; i++)
        loads->factor[i] *= loads->left[i];
#endif
}

#if SET_CORNER_LOADS
#define IS_WHOLE(loads) (loads)->whole
#include "ground/corner_loads.c"
#elif SET_NEARLY_LINEAR
/* Friction beside bearings of rollers that turn is linear about the loads with these sums. */
ALWAYS_INLINE void put_about(const int wheels, const point_t *at)
{
    loads_t *const loads = at->loads;
    lanes_t taken[MOST_WHEELS], gain[MOST_WHEELS];
    const lanes_t *const bearing = at->inputs + SET_CONTACT_BEARING_INPUT*wheels;
    loads_of_sums(wheels, at, loads->sums, loads->compression);
#if SET_DAMPS_LOADS
    find_about_beside_dampers(wheels, loads->compression, loads, taken);
    set_damped_loads(wheels, at->vehicle, at->nu, at->chi, at->core + rates_at(wheels), bearing, at->contact_sticks,
                     loads->bearing_factor, gain);
#else
    set_left_loads(wheels, at->vehicle, at->chi, bearing, loads->compression, taken, gain);
#endif
    be_linear_about(wheels, loads->compression, taken, gain, at->contact_sticks, loads);
}

#define IS_WHOLE(loads) 0

/* How many rounds loads are found by at most. */
ALWAYS_INLINE int rounds_of(const int wheels, const point_t *at)
{
    (void)wheels;
    return at->loads->rounds;
}
#endif

/* Loads and that, from the sums. */
ALWAYS_INLINE void put_loads(const int wheels, const point_t *at)
{
    loads_of_sums(wheels, at, at->loads->sums, at->loads->compression);
    put_factors(wheels, at);
}

/* The rates under the ground's forces, and the sums of the loads that they ask for. */
NEVER_INLINE void rates_and_sums(const int wheels, const point_t *at, lanes_t *nu_dot, lanes_t *sums)
{
    rates_under_loads(wheels, at, nu_dot);
    load_sums_of(wheels, at, nu_dot, sums);
}

#if SET_FRICTION
/* The rates under loads with these sums, and by how much the moments are off that they ask for. */
ALWAYS_INLINE void rates_of_sums(const int wheels, const point_t *at, lanes_t *nu_dot, lanes_t *off)
{
    lanes_t sums[3];
    put_loads(wheels, at);
    rates_and_sums(wheels, at, nu_dot, sums);
    at->loads->sums[0] = sums[0];
    off[0] = sums[1] - at->loads->sums[1], off[1] = sums[2] - at->loads->sums[2];
}

/* How many numbers of the core have rates that depend on the loads; they stand first. */
ALWAYS_INLINE int responding_core(const int wheels, const point_t *at)
{
#if SET_DISKS_STICK                 /* rollers that do not touch the ground may turn with their disks               */
    return own_rates_at(wheels) + most_own_bearings(wheels, at->vehicle->rollers_per_wheel);
#else
    (void)at;
    return coupled_size(wheels);
#endif
}

/* What depends on the loads, as one vector: out of the point, or back. Returns how many numbers these are. */
ALWAYS_INLINE int gather_rates(const int wheels, const point_t *at, const lanes_t *nu_dot, lanes_t *all)
{
    int count = 0;
    for (int k = 0; k < 3; k++)
        all[count++] = nu_dot[k];
    for (int c = 0; c < responding_core(wheels, at); c++)
        all[count++] = at->core_dot[c];
#if SET_DISKS_STICK
    for (int k = 0; k < wheels; k++)
        all[count++] = at->contact_holding[k], all[count++] = at->contact_spin_dot[k];
    for (int k = 0; k < wheels*(at->vehicle->rollers_per_wheel - 1); k++)
        all[count++] = at->free_holding[k], all[count++] = at->spins_dot[k];
#endif
#if SET_AXLES_STICK
    for (int i = 0; i < wheels; i++)
        all[count++] = at->axle_holding[i];
#endif
#if SET_STANDS
    for (int k = 0; k < 3; k++)
        all[count++] = at->held_force[k];
#endif
#if SET_GRIPS
    for (int k = 0; k < 2*wheels; k++)
        all[count++] = at->ground_force[k];
    for (int k = 0; k < 2*wheels; k++)
        all[count++] = at->slip_dot[k];
#endif
#if SET_CORNERS
    for (int i = 0; i < wheels; i++)
        all[count++] = at->contact_holding[i];
#endif
    return count;
}

ALWAYS_INLINE void spread_rates(const int wheels, const point_t *at, const lanes_t *all, lanes_t *nu_dot)
{
    int count = 0;
    for (int k = 0; k < 3; k++)
        nu_dot[k] = all[count++];
    for (int c = 0; c < responding_core(wheels, at); c++)
        at->core_dot[c] = all[count++];
#if SET_DISKS_STICK
    for (int k = 0; k < wheels; k++)
        at->contact_holding[k] = all[count++], at->contact_spin_dot[k] = all[count++];
    for (int k = 0; k < wheels*(at->vehicle->rollers_per_wheel - 1); k++)
        at->free_holding[k] = all[count++], at->spins_dot[k] = all[count++];
#endif
#if SET_AXLES_STICK
    for (int i = 0; i < wheels; i++)
        at->axle_holding[i] = all[count++];
#endif
#if SET_STANDS
    for (int k = 0; k < 3; k++)
        at->held_force[k] = all[count++];
#endif
#if SET_GRIPS
    for (int k = 0; k < 2*wheels; k++)
        at->ground_force[k] = all[count++];
    for (int k = 0; k < 2*wheels; k++)
        at->slip_dot[k] = all[count++];
#endif
#if SET_CORNERS
    for (int i = 0; i < wheels; i++)
        at->contact_holding[i] = all[count++];
#endif
}

/* The response and the coupled matrix, by an evaluation for each moment. */
NEVER_INLINE void find_load_response(const int wheels, const point_t *at, const lanes_t *all, int count,
                                     const lanes_t *off)
{
    loads_t *const loads = at->loads;
    lanes_t nu_dot[3], moved_off[2];
    for (int k = 0; k < 2; k++) {
        const lanes_t here = loads->sums[1 + k], step = loads->sums[0]*at->balance->arm;
        loads->sums[1 + k] = here + step;
        rates_of_sums(wheels, at, nu_dot, moved_off);
        loads->sums[1 + k] = here;
        gather_rates(wheels, at, nu_dot, loads->response[k]);
        for (int n = 0; n < count; n++)
            loads->response[k][n] = (loads->response[k][n] - all[n])/step;
        for (int j = 0; j < 2; j++)
            loads->matrix[2*j + k] = (off[j] - moved_off[j])/step;
    }
    loads->knows_response = 1;
}

/* Rates that respond to the loads, and the loads with them: by one correction. */
static void correct_loads(const int wheels, const point_t *at, lanes_t *nu_dot)
{
    loads_t *const loads = at->loads;
#if SET_NEARLY_LINEAR
    put_about(wheels, at);
#endif
#if SET_DISKS_STICK
    lanes_t *const all = loads->rates, off[2];
#else
    lanes_t all[RESPONDING], off[2];
#endif
    rates_of_sums(wheels, at, nu_dot, off);
    const int count = gather_rates(wheels, at, nu_dot, all);
    if (!loads->knows_response)
        find_load_response(wheels, at, all, count, off);
    const lanes_t *const m = loads->matrix;
    const lanes_t determinant = m[0]*m[3] - m[1]*m[2], over = 1/determinant;
    const lanes_t first = (m[3]*off[0] - m[1]*off[1])*over, second = (m[0]*off[1] - m[2]*off[0])*over;
    for (int n = 0; n < count; n++)
        all[n] += loads->response[0][n]*first + loads->response[1][n]*second;
    spread_rates(wheels, at, all, nu_dot);
    loads->determinant = determinant;
    loads->sums[1] += first, loads->sums[2] += second;
}

#if SET_NEARLY_LINEAR
/* How far carried loads have moved that were these, which become what they are. */
ALWAYS_INLINE lanes_t moved_loads(const int wheels, const point_t *at, lanes_t *before)
{
    lanes_t most = lanes_of(0), now[MOST_WHEELS];
    loads_of_sums(wheels, at, at->loads->sums, now);
    for (int i = 0; i < wheels; i++) {
        const lanes_t load = at->inputs[SET_CARRIES_INPUT*wheels + i]*now[i];
        most = lanes_max(most, lanes_abs(load - before[i]));
        before[i] = load;
    }
    return most;
}

/* The loads about which the friction is linear are those that are found; not a number where that does not end. */
NEVER_INLINE void settle_loads(const int wheels, const point_t *at, lanes_t *nu_dot)
{
    loads_t *const loads = at->loads;
    lanes_t before[MOST_WHEELS], last = lanes_of(INFINITY);
    int found[LANES] = {0}, left = LANES;
#if !SET_CORNER_LOADS
    if (loads->rounds == GIVEN_LOADS) {
        lanes_t off[2];
        put_about(wheels, at);
        rates_of_sums(wheels, at, nu_dot, off);
        return;
    }
#endif
    for (int i = 0; i < wheels; i++)
        before[i] = lanes_of(0);
    moved_loads(wheels, at, before);
    for (int round = 0; round < rounds_of(wheels, at) && left; round++) {
#if SET_CORNER_LOADS
        loads->whole = round == 0 && loads->rounds == MOST_ROUNDS;
#endif
        loads->knows_response = 0;
        correct_loads(wheels, at, nu_dot);
        const lanes_t step = moved_loads(wheels, at, before);
        if (IS_WHOLE(loads))
            continue;
        left = settle_lanes(step, last, loads->sums[0], found);
        last = step;
    }
#if SET_CORNER_LOADS
    loads->whole = 0;
#endif
    for (int k = 0; k < LANES && rounds_of(wheels, at) > 1; k++)
        if (!found[k])
            loads->sums[1][k] = loads->sums[2][k] = NAN;
}
#endif

/* Rates that respond to the loads, and the loads with them. Where the response is known, loads near these are, too. */
ALWAYS_INLINE void rates_that_respond(const int wheels, const point_t *at, lanes_t *nu_dot)
{
#if SET_NEARLY_LINEAR
    if (!at->loads->knows_response) {
        settle_loads(wheels, at, nu_dot);
        return;
    }
#endif
    correct_loads(wheels, at, nu_dot);
}
#endif

/* Rates of nu and of the core with the loads that they ask for; at->loads has these. */
NEVER_INLINE void core_rates(const int wheels, const point_t *at, lanes_t *nu_dot)
{
    loads_t *const loads = at->loads;
    loads->determinant = lanes_of(1);
#if SET_FRICTION
    if (loads->responds)
        rates_that_respond(wheels, at, nu_dot);
#endif
    if (!loads->responds) {
        for (int i = 0; i < wheels; i++)
            loads->factor[i] = at->inputs[SET_CARRIES_INPUT*wheels + i];
        rates_and_sums(wheels, at, nu_dot, loads->sums);
    }
#if SET_NEARLY_LINEAR
    put_about(wheels, at);
    put_factors(wheels, at);
#if SET_CORNER_LOADS
    put_yields(wheels, at, loads->compression);
#endif
#else
    put_loads(wheels, at);
#endif
}

/* The same where nothing of the loads is known but sums near them, in `loads`. */
ALWAYS_INLINE void seek_loads(loads_t *loads, const double *sums)
{
    for (int k = 0; k < 3; k++)
        loads->sums[k] = lanes_of(sums[k]);
    loads->responds = SET_FRICTION, loads->knows_response = 0;
#if SET_NEARLY_LINEAR
    loads->rounds = MOST_ROUNDS;
#endif
#if SET_CORNER_LOADS
    loads->whole = 0;
#endif
}
#endif
