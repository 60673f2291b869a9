/* Axles that stick on a ground under a smooth law whose loads follow the motion: which of those at rest stick, with the
 * loads of each set of contacts that may carry. The numbered rules are in runtime/omniroll/effects/loaded_axles.py. */
#if SET_LOADED_AXLES
#define ALL_AT_ONCE 20              /* turns in which all wrong axles change                                */
#define AXLE_TURNS 2000             /* all turns                                                            */
#define TOGETHER 256                /* roundings: so near to its bound an axle is at it where another one is, too */

/* The axles with a set of contacts. */
typedef struct {
    int mode[MOST_WHEELS], broken[MOST_WHEELS], turns, unsettled;
    double asked[MOST_WHEELS], rate[MOST_WHEELS];
} axles_of_set_t;

static void begin_axles_of_set(const omniroll_run_t *run, axles_of_set_t *axles)
{
    axles->turns = axles->unsettled = 0;
    for (int i = 0; i < run->wheels; i++) {
        const omniroll_bearing_t *const axle = own_bearings(run) + i;
        axles->mode[i] = axle->resting ? 0 : axle->mode, axles->broken[i] = axle->released != 0;
    }
}

/* What an axle at rest takes at most. */
ALWAYS_INLINE double bound_of_axle(const omniroll_run_t *run, const axles_of_set_t *axles, int i)
{
    const omniroll_bearing_t *const axle = own_bearings(run) + i;
    return axles->broken[i] || !axle->resting ? axle->sliding : axle->holding;
}

/* The modes of the axles in one lane of an evaluation at this instant. */
ALWAYS_INLINE void put_axles_of_set(const omniroll_run_t *run, const work_t *work, const axles_of_set_t *axles,
                                    int lane, lanes_t *input)
{
    for (int i = 0; i < run->wheels; i++) {
        work->own.sticks[i][lane] = axles->mode[i] == 0;
        input[SET_BEARING_INPUT*run->wheels + i][lane] = -axles->mode[i]*bound_of_axle(run, axles, i);
    }
}

ALWAYS_INLINE void get_axles_of_set(const omniroll_run_t *run, const work_t *work, axles_of_set_t *axles, int lane)
{
    for (int i = 0; i < run->wheels; i++) {
        axles->asked[i] = work->own.holding[i][lane];
        axles->rate[i] = work->core_dot[own_rates_at(run->wheels) + i][lane];
    }
}

/* Whether the mode of an axle at rest is not its own. */
static int is_wrong_axle(const omniroll_run_t *run, const axles_of_set_t *axles, int i)
{
    const double bound = bound_of_axle(run, axles, i), asked = fabs(axles->asked[i]);
    const double gains = axles->mode[i]*axles->rate[i]*run->ground.wheel_inertia;
    if (!own_bearings(run)[i].resting)
        return 0;
    return axles->mode[i] == 0 ? asked - bound > PASSED*rounding_of_holding(asked, bound)
        : gains < -MOVES*(fabs(gains) + bound);
}

/* Rule 4: with axles that have come to their bounds all others break away that have, too. Whether there are such. */
static int break_together(const omniroll_run_t *run, axles_of_set_t *axles)
{
    int broken = 0;
    for (int i = 0; i < run->wheels; i++)
        broken |= axles->broken[i];
    for (int i = 0; i < run->wheels && broken; i++) {
        const double asked = fabs(axles->asked[i]), bound = bound_of_axle(run, axles, i);
        axles->broken[i] |= own_bearings(run)[i].resting && asked - bound > -TOGETHER*rounding_of_holding(asked, bound);
    }
    return broken;
}

/* Rule 2: axles whose mode is not their own change. Returns whether there are such. */
static int change_wrong_axles(const omniroll_run_t *run, axles_of_set_t *axles)
{
    int changed = 0;
    for (int i = 0; i < run->wheels; i++) {
        if (!is_wrong_axle(run, axles, i) || (changed && axles->turns >= ALL_AT_ONCE))
            continue;
        axles->mode[i] = axles->mode[i] ? 0 : axles->asked[i] > 0 ? -1 : 1;
        changed = 1;
    }
    return changed;
}

/* Rule 4: axles at rest that turn have broken away. Returns whether some had not yet. */
static int break_turning(const omniroll_run_t *run, axles_of_set_t *axles)
{
    int changed = 0;
    for (int i = 0; i < run->wheels; i++) {
        const int breaks = own_bearings(run)[i].resting && axles->mode[i] && !axles->broken[i];
        axles->broken[i] |= breaks, changed |= breaks;
    }
    return changed;
}

/* Whether some axle of a set has changed, so that it must be evaluated again. */
static int turn_axles_of_set(const omniroll_run_t *run, axles_of_set_t *axles)
{
    const int changed = (axles->turns == 0 && break_together(run, axles)) || change_wrong_axles(run, axles)
        || break_turning(run, axles);
    axles->unsettled = changed && ++axles->turns >= AXLE_TURNS;
    return changed && !axles->unsettled;
}

/* The modes of the axles at rest are those of the set that carries; one that has come to its bound goes where it has
 * been let go. */
static void take_axles_of_set(const omniroll_run_t *run, const axles_of_set_t *axles)
{
    for (int i = 0; i < run->wheels; i++) {
        omniroll_bearing_t *const axle = own_bearings(run) + i;
        if (!axle->resting)
            continue;
        axle->mode = axles->mode[i];
        if (!axle->mode && -axle->released*axles->asked[i] >= NEAR_BOUND*axle->sliding)
            axle->mode = axle->released;
        else if (axles->broken[i] && !axle->released)
            axle->released = axle->mode;
    }
}

/* A run's axles as an instant begins: what is zero within rounding rests. */
static void rest_loaded_axles(omniroll_run_t *run, const work_t *work)
{
    find_resting_own(run, work, length3(run->nu));
    put_own_to_rest(run, work);
}

/* The phase begins: its torques, from an evaluation with its loads. */
static void begin_loaded_axles(omniroll_run_t *run, const work_t *work)
{
    turn_own(run, work, 1);
    hold_axles(run, work);
    run->hold.count = 0;
    for (int k = 0; k < run->own_count; k++)
        run->hold.count += own_bearings(run)[k].mode == 0;
    size_own(run, work);
    run->hold.undecided = 0;
}
#endif
