/* Bearings that stick on a ground under a smooth law whose loads follow the motion: which of those at rest stick, with
 * the loads of each set of contacts that may carry. The numbered rules are in runtime/omniroll/effects/loaded_axles.py;
 * those of axles hold for rollers, too (loaded_bearings.py). Massless rollers in contact are all decided anew at each
 * instant (loaded_massless_rollers.py). */
#if SET_LOADED_BEARINGS
#define ALL_AT_ONCE 20              /* turns in which all wrong bearings change                             */
#define LOOKS_BACK 32               /* turns from which on it is asked whether they go round                */
#define BEARING_TURNS 2000          /* all turns                                                            */
#define TOGETHER 256                /* roundings: so near to its bound a bearing is at it where another one is, too */

/* The bearings with a set of contacts. */
typedef struct {
    int *mode, *broken, *seen, turns, unsettled;
    double *asked, *rate;
} bearings_of_set_t;

/* The bearings of set `place` have their numbers here: each lane has a set, and the nearest one comes behind these. */
static void give_bearings(const omniroll_run_t *run, const work_t *work, int place, bearings_of_set_t *bearings)
{
    const long long count = most_own_bearings(run->wheels, run->rollers_per_wheel);
    bearings->mode = work->modes_of_sets + 4*count*place, bearings->broken = bearings->mode + count;
    bearings->seen = bearings->broken + count;
    bearings->asked = work->rates_of_sets + 2*count*place, bearings->rate = bearings->asked + count;
}

static void copy_bearings(const omniroll_run_t *run, const bearings_of_set_t *from, bearings_of_set_t *to)
{
    to->turns = from->turns, to->unsettled = from->unsettled;
    for (int k = 0; k < run->own_count; k++) {
        to->mode[k] = from->mode[k], to->broken[k] = from->broken[k];
        to->asked[k] = from->asked[k], to->rate[k] = from->rate[k];
    }
}

/* The wheel of a massless roller in contact, or -1. */
ALWAYS_INLINE int wheel_in_series(const omniroll_run_t *run, int k)
{
    return SET_IN_SERIES && k >= run->axle_count ? k - run->axle_count : -1;
}

/* Whether the mode of a bearing is found at this instant. */
ALWAYS_INLINE int is_open(const omniroll_run_t *run, int k)
{
    return own_bearings(run)[k].resting || wheel_in_series(run, k) >= 0;
}

/* Of a massless roller: one that turned up to this instant has broken away. It goes on, unless it has come to rest. */
static void begin_bearings_of_set(const omniroll_run_t *run, bearings_of_set_t *bearings)
{
    bearings->turns = bearings->unsettled = 0;
    for (int k = 0; k < run->own_count; k++) {
        const omniroll_bearing_t *const bearing = own_bearings(run) + k;
        bearings->mode[k] = bearing->resting ? 0 : bearing->mode, bearings->broken[k] = bearing->released != 0;
        if (wheel_in_series(run, k) >= 0)
            bearings->broken[k] |= bearing->mode != 0;
    }
}

/* What a bearing at rest takes at most. A massless roller that has come to rest takes what it came to rest with: where
 * its spin is zero that is its sliding torque, as near as the event is located. */
ALWAYS_INLINE double bound_in_set(const omniroll_run_t *run, const bearings_of_set_t *bearings, int k)
{
    const omniroll_bearing_t *const bearing = own_bearings(run) + k;
    if (wheel_in_series(run, k) >= 0 && bearings->mode[k] == 0) {
        const int comes_to_rest = bearing->resting && bearing->mode;
        return comes_to_rest ? bearing->sliding/NEAR_BOUND : bearings->broken[k] ? bearing->sliding : most_of(bearing);
    }
    return bearings->broken[k] || !bearing->resting ? bearing->sliding : bearing->holding;
}

/* The modes of the bearings in one lane of an evaluation at this instant. A roller whose contact is off sticks. */
ALWAYS_INLINE void put_bearings_of_set(const omniroll_run_t *run, const work_t *work, const int *carries,
                                       const bearings_of_set_t *bearings, int lane, lanes_t *input)
{
    for (int k = 0; k < run->own_count; k++) {
        const int wheel = wheel_in_series(run, k), is_off = wheel >= 0 && !carries[wheel];
        const double torque = is_off ? 0 : -bearings->mode[k]*bound_in_set(run, bearings, k);
        work->own.sticks[k][lane] = is_off || bearings->mode[k] == 0;
        if (own_input(run, k) >= 0)
            input[own_input(run, k)][lane] = torque;
#if SET_ROLLERS_TURN
        work->own.torque[k][lane] = torque;
#endif
    }
}

/* What they are asked for, and what their rates are or change by. */
ALWAYS_INLINE void get_bearings_of_set(const omniroll_run_t *run, const work_t *work, const int *carries,
                                       bearings_of_set_t *bearings, int lane)
{
    for (int k = 0; k < run->own_count; k++) {
        bearings->asked[k] = work->own.holding[k][lane];
#if SET_IN_SERIES
        const int wheel = wheel_in_series(run, k);
        if (wheel >= 0) {
            bearings->mode[k] = carries[wheel] ? bearings->mode[k] : 0;
            bearings->rate[k] = work->own.rate[k][lane];
            continue;
        }
#endif
        bearings->rate[k] = own_acceleration_in_lane(run, work, k, lane);
    }
    (void)carries;
}

/* Whether the mode of a bearing at rest is not its own. */
static int is_wrong_bearing(const omniroll_run_t *run, const bearings_of_set_t *bearings, int k)
{
    const double bound = bound_in_set(run, bearings, k), asked = fabs(bearings->asked[k]);
    const double inertia = SET_DISKS_STICK && k >= run->axle_count ? run->roller_inertia : run->ground.wheel_inertia;
    const double gains = bearings->mode[k]*bearings->rate[k]*inertia;
    if (!is_open(run, k))
        return 0;
#if SET_IN_SERIES
    if (wheel_in_series(run, k) >= 0 && bearings->mode[k])
        return bearings->mode[k]*bearings->rate[k]
            < -PASSED*EPS*(fabs(bearings->rate[k]) + length3(run->nu)*run->rate_of_speed);
#endif
    return bearings->mode[k] == 0 ? asked - bound > PASSED*rounding_of_holding(asked, bound)
        : gains < -MOVES*(fabs(gains) + bound);
}

/* Rule 4: with bearings that have come to their bounds all others break away that have, too. Whether there are such. */
static int break_together(const omniroll_run_t *run, bearings_of_set_t *bearings)
{
    int broken = 0;
    for (int k = 0; k < run->own_count; k++)
        broken |= bearings->broken[k];
    for (int k = 0; k < run->own_count && broken; k++) {
        const double asked = fabs(bearings->asked[k]), bound = bound_in_set(run, bearings, k);
        bearings->broken[k] |= is_open(run, k)
            && asked - bound > -TOGETHER*rounding_of_holding(asked, bound);
    }
    return broken;
}

/* The sign of the rate that a bearing has, or would have if it turned. */
ALWAYS_INLINE int way_of_bearing(const bearings_of_set_t *bearings, int k)
{
    return bearings->mode[k] ? bearings->mode[k] : bearings->asked[k] > 0 ? -1 : 1;
}

/* Rule 2: bearings whose mode is not their own change. Returns whether there are such. */
static int change_wrong_bearings(const omniroll_run_t *run, bearings_of_set_t *bearings)
{
    int changed = 0;
    for (int k = 0; k < run->own_count; k++) {
        if (!is_wrong_bearing(run, bearings, k) || (changed && bearings->turns >= ALL_AT_ONCE))
            continue;
        bearings->mode[k] = bearings->mode[k] ? 0 : way_of_bearing(bearings, k);
        changed = 1;
    }
    return changed;
}

/* Rule 4: bearings at rest that turn have broken away. Returns whether some had not yet. */
static int break_turning(const omniroll_run_t *run, bearings_of_set_t *bearings)
{
    int changed = 0;
    for (int k = 0; k < run->own_count; k++) {
        const int breaks = is_open(run, k) && bearings->mode[k] && !bearings->broken[k];
        bearings->broken[k] |= breaks, changed |= breaks;
    }
    return changed;
}

/* Whether bearings have come back to what they were: from one state the first of the wrong ones changes always alike, so
 * that they will go round for ever. What they are is kept where as many turns have been taken as a power of two. */
static int go_round(const omniroll_run_t *run, const bearings_of_set_t *bearings)
{
    const int turns = bearings->turns;
    int same = turns > LOOKS_BACK;
    for (int k = 0; k < run->own_count && same; k++) {
        int *const seen = bearings->seen + 2*k;
        same &= seen[0] == bearings->mode[k] && seen[1] == bearings->broken[k];
    }
    for (int k = 0; k < run->own_count && !same && turns >= LOOKS_BACK && !(turns & (turns - 1)); k++)
        bearings->seen[2*k] = bearings->mode[k], bearings->seen[2*k + 1] = bearings->broken[k];
    return same;
}

/* Whether some bearing of a set has changed, so that it must be evaluated again. */
static int turn_bearings_of_set(const omniroll_run_t *run, bearings_of_set_t *bearings)
{
    const int changed = (bearings->turns == 0 && break_together(run, bearings)) || change_wrong_bearings(run, bearings)
        || break_turning(run, bearings);
    bearings->unsettled = changed && (++bearings->turns >= BEARING_TURNS || go_round(run, bearings));
    return changed && !bearings->unsettled;
}

/* A massless roller has its mode: where it has come to rest it takes what it came to rest with. */
ALWAYS_INLINE void take_roller_of_set(omniroll_bearing_t *roller, int before, int rested, double asked)
{
    if (roller->mode == 0 && before)
        roller->size = rested ? fabs(asked) : 0;
    roller->resting = roller->mode == 0;
}

/* The modes of the bearings at rest are those of the set that carries; one that has come to its bound goes where it has
 * been let go. */
static void take_bearings_of_set(const omniroll_run_t *run, const bearings_of_set_t *bearings)
{
    for (int k = 0; k < run->own_count; k++) {
        omniroll_bearing_t *const bearing = own_bearings(run) + k;
        if (!is_open(run, k))
            continue;
        const int before = bearing->mode, rested = bearing->resting;
        bearing->mode = bearings->mode[k];
        if (!bearing->mode && -bearing->released*bearings->asked[k] >= NEAR_BOUND*bearing->sliding)
            bearing->mode = bearing->released;
        else if (bearings->broken[k] && !bearing->released && rested)
            bearing->released = bearing->mode;
        if (wheel_in_series(run, k) >= 0)
            take_roller_of_set(bearing, before, rested, bearings->asked[k]);
    }
}

/* Those that may turn or stick and touch the ground, in `which`: axles and rollers in contact at rest, and massless
 * rollers that turn or are asked for as much as would turn them. Returns how many there are. */
static int may_turn_on_ground(const omniroll_run_t *run, const bearings_of_set_t *bearings, const int *carries,
                              int *which)
{
    const int touching = SET_DISKS_STICK ? run->axle_count + run->wheels : run->own_count;
    int count = 0;
    for (int k = 0; k < touching; k++) {
        const int wheel = wheel_in_series(run, k), asked = fabs(bearings->asked[k]) >= own_bearings(run)[k].sliding;
        if (wheel >= 0 ? carries[wheel] && (bearings->mode[k] || asked) : own_bearings(run)[k].resting)
            which[count++] = k;
    }
    return count;
}

/* The phase begins: its torques, from an evaluation with its loads. */
static void begin_loaded_bearings(omniroll_run_t *run, const work_t *work)
{
    turn_own(run, work, 1);
    hold_axles(run, work);
    begin_torques(run, work);
}
#endif
