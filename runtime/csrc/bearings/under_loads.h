/* Massless rollers that stick under loads that follow the motion: what a run and its deviations have in common.
 *
 * What the ground asks of such a roller goes with its load, and functions that say it take more arguments then. Of a
 * load the bearing of a roller that turns leaves what is in no proportion to it: there the ground's friction is linear
 * about some loads, and these are found by Newton's rule (runtime/omniroll/effects/loads_beside_bearings.py). */

#define SET_CORNERS (SET_STRIPS && SET_LOADS)   /* massless rollers that turn on contacts that slip */
#define SET_CORNER_LOADS (SET_CORNERS && !SET_DAMPED_STRIPS)    /* and leave parts of loads: corner_loads.c */

/* What is taken beside other arguments where the rates of massless rollers follow from loads that follow the motion. */
#if SET_LOADS && SET_IN_SERIES && !SET_GRIPS
#define UNDER(loads) , loads
#define FACTOR(loads) (loads)->factor,
#else
#define UNDER(loads)
#define FACTOR(loads)
#endif
#if SET_LOADS && SET_IN_SERIES && !SET_GRIPS && SET_LEAVES_LOADS
#define SET_NEARLY_LINEAR 1
#define BEARING_FACTOR(loads) (loads)->bearing_factor,
#else
#define SET_NEARLY_LINEAR (SET_CORNER_LOADS && SET_LEAVES_LOADS)
#define BEARING_FACTOR(loads)
#endif

/* What functions of rollers whose bearings have viscous friction take beside other arguments: factors that are 1. */
#if SET_DAMPED_STRIPS && SET_LOADS
#define PER_LOAD(factor) factor,
#define PASSED_ON(ones) ones,
#else
#define PER_LOAD(factor)
#define PASSED_ON(ones)
#endif

#define TIP 1e-12                   /* of the load that a bearing takes: nearer to it hardly anything is left   */
#define LEAST_ABOUT 1e-9            /* N, about which friction is linear at least; where a bearing takes nothing */
#define MOST_ROUNDS 50
#define GIVEN_LOADS 0               /* rounds: an evaluation under the last loads                                */
#define ROUNDS_FROM_HERE (MOST_ROUNDS - 1)      /* from the last loads, also where others come from above   */
#define LOADS_SETTLED 1e-14         /* of the weight                                                           */
#define LOADS_ROUNDED 1e-11         /* of the weight: steps below this that do not fall any more are rounding    */
#define SURE 0.1                    /* of LOADS_SETTLED: where the next step would be that falls as its square   */

#if SET_NEARLY_LINEAR && !SET_CORNER_LOADS
/* Friction of contacts is linear about some loads, of which bearings of rollers that turn take `taken`. */
ALWAYS_INLINE void be_linear_about(const int wheels, const lanes_t *load, const lanes_t *taken, const lanes_t *gain,
                                   const lanes_t *sticks, loads_t *loads)
{
    for (int i = 0; i < wheels; i++) {
        const lanes_t least = lanes_max(lanes_abs(taken[i])*(1 + TIP), lanes_of(LEAST_ABOUT));
        const lane_mask_t turns = sticks[i] == 0, leaves = load[i] >= least;
        loads->about[i] = lanes_select(turns, lanes_select(leaves, load[i], least), lanes_of(0));
        loads->gain[i] = lanes_select(turns, lanes_select(leaves, gain[i], lanes_of(0)), lanes_of(1));
        loads->bearing_factor[i] = lanes_select(turns, 1/loads->about[i], lanes_of(1));
    }
}
#endif

#if SET_NEARLY_LINEAR && SET_DAMPS_LOADS
/* Beside viscous friction in bearings: friction is linear about the loads themselves, where these are not next to
 * nothing. What such a bearing takes goes with the load, so that there is no load all of which it takes. */
ALWAYS_INLINE void find_about_beside_dampers(const int wheels, const lanes_t *load, loads_t *loads, lanes_t *taken)
{
    for (int i = 0; i < wheels; i++) {
        loads->bearing_factor[i] = 1/lanes_max(load[i], lanes_of(LEAST_ABOUT));
        taken[i] = lanes_of(0);
    }
}
#endif

#if SET_CORNER_LOADS
/* Which contacts are in corners, lane by lane. */
ALWAYS_INLINE lane_mask_t in_corner(const int wheels, const point_t *at, int i)
{
    return (at->contact_sticks[i] == 0) & (at->inputs[SET_MODES_INPUT*wheels + i] == 0)
        & (at->inputs[SET_CARRIES_INPUT*wheels + i] != 0);
}

/* Whether loads have to be found by Newton's rule: some contact is in a corner. */
ALWAYS_INLINE int is_nearly_linear(const int wheels, const point_t *at)
{
    long long some = 0;
    for (int i = 0; i < wheels; i++) {
        const lane_mask_t corner = in_corner(wheels, at, i);
        for (int k = 0; k < LANES; k++)
            some |= corner[k];
    }
    return some != 0;
}

/* Near these loads those about which friction in corners is linear, of which bearings take `taken`. */
ALWAYS_INLINE void find_about_in_corners(const int wheels, const lanes_t *load, const lanes_t *taken, lanes_t *about)
{
    for (int i = 0; i < wheels; i++) {
        const lanes_t least = lanes_max(lanes_abs(taken[i])*(1 + TIP), lanes_of(LEAST_ABOUT));
        about[i] = lanes_select(load[i] >= least, load[i], least);
    }
}

/* Friction in corners is linear about these, where gain and what is left are known; elsewhere it is in proportion to
 * the loads. */
ALWAYS_INLINE void be_linear_in_corners(const int wheels, const point_t *at, const lanes_t *load, const lanes_t *about)
{
    loads_t *const loads = at->loads;
    for (int i = 0; i < wheels; i++) {
        const lane_mask_t corner = in_corner(wheels, at, i), leaves = load[i] >= about[i];
        loads->about[i] = lanes_select(corner, about[i], lanes_of(0));
        loads->gain[i] = lanes_select(corner, lanes_select(leaves, loads->gain[i], lanes_of(0)), lanes_of(1));
        loads->left[i] = lanes_select(corner, loads->left[i], lanes_of(1));
    }
}

/* Friction is in proportion to the loads everywhere. */
ALWAYS_INLINE void be_whole(const int wheels, loads_t *loads)
{
    for (int i = 0; i < wheels; i++)
        loads->about[i] = lanes_of(0), loads->gain[i] = loads->left[i] = lanes_of(1);
}
#endif

#if SET_NEARLY_LINEAR
/* Which lanes have their loads, after a step of Newton's rule behind the last one. Returns how many have not. */
ALWAYS_INLINE int settle_lanes(lanes_t step, lanes_t last, lanes_t weight, int *found)
{
    int left = 0;
    for (int k = 0; k < LANES; k++) {
        const double fallen = step[k]/last[k];
        found[k] |= !(step[k] > LOADS_SETTLED*weight[k])
            || (last[k] < INFINITY && step[k]*fallen*fallen <= SURE*LOADS_SETTLED*weight[k])
            || (last[k] <= step[k] && step[k] <= LOADS_ROUNDED*weight[k]);
        left += !found[k];
    }
    return left;
}
#endif
