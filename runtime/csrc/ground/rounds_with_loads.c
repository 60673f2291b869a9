/* Static friction above the sliding one under loads that follow the motion: rounds in which modes and loads are found
 * together. The reasons are in runtime/omniroll/effects/rounds_with_loads.py; the names are the same. */
#if SET_LOADS && SET_GRIPS
/* The modes of what rests, under the loads that contacts have. `other`: of contacts alone those that are asked for too
 * much, beside bearings what is let go. */
static void find_modes(omniroll_run_t *run, const work_t *work, const int *other);

/* Modes for the loads, and loads for the modes, until nothing changes; of contacts that rest `rests`. Returns 1 where
 * that comes to an end, 0 where there are no loads, -1 where it goes on. */
static int take_turns(omniroll_run_t *run, const work_t *work, const int *rests, const int *other)
{
    for (int turn = 0; turn < TURNS; turn++) {
        double before[MOST_WHEELS];
        for (int i = 0; i < run->wheels; i++)
            before[i] = run->grips[i].load;
        find_modes(run, work, other);
        const int settled = loads_settle(run, work, rests, before);
        if (settled && !(settled > 0 && turns_to_steady(run, work, rests)))
            return settled > 0 && !run->ground.failure;
        if (!settled && turn % PATIENT_TURNS == PATIENT_TURNS - 1)
            turn_on(run, work, rests);
    }
    return -1;
}

#include "ground/moments_of_loads.c"

/* Friction as it is, and which contacts rest. */
typedef struct {
    omniroll_grip_t grips[MOST_WHEELS];
    omniroll_ground_t ground;
    int rests[MOST_WHEELS];
    double *bounds;                 /* of bearings: while they turn, and the largest at rest                */
} friction_t;

static friction_t keep_friction(const omniroll_run_t *run, const work_t *work, const int *rests)
{
    friction_t own = {.ground = run->ground};
    memcpy(own.grips, run->grips, sizeof *run->grips*(size_t)run->wheels);
    memcpy(own.rests, rests, sizeof *rests*(size_t)run->wheels);
#if SET_STANDS
    own.bounds = work->bounds;
    for (int k = 0; k < run->own_count; k++)
        own.bounds[2*k] = own_bearings(run)[k].sliding, own.bounds[2*k + 1] = own_bearings(run)[k].holding;
#endif
    (void)work;
    return own;
}

static void put_friction(omniroll_run_t *run, const work_t *work, const friction_t *own)
{
    for (int i = 0; i < run->wheels; i++) {
        memcpy(run->grips[i].sliding, own->grips[i].sliding, sizeof own->grips[i].sliding);
        memcpy(run->grips[i].staying, own->grips[i].staying, sizeof own->grips[i].staying);
    }
#if SET_STANDS
    for (int k = 0; k < run->own_count; k++)
        own_bearings(run)[k].sliding = own->bounds[2*k], own_bearings(run)[k].holding = own->bounds[2*k + 1];
#endif
    friction_in_lanes(run, work);
}

#if SET_STANDS
/* Whether a bearing is one of those that rest. Of a contact that slips the state says whether its massless roller
 * turns. */
static int rests_in_rounds(const work_t *work, const int *rests, int k, const omniroll_bearing_t *bearing)
{
#if SET_CORNERS
    if (k >= work->own.rollers_at && !rests[k - work->own.rollers_at])
        return 0;
#endif
    (void)work, (void)rests, (void)k;
    return bearing->resting;
}
#endif

/* What rests has one friction in a round: the sliding one if it has broken away. */
static void put_one_friction(omniroll_run_t *run, const work_t *work, const int *rests)
{
    for (int i = 0; i < run->wheels; i++) {
        omniroll_grip_t *const grip = run->grips + i;
        for (int k = 0; k < 2 && rests[i]; k++)
            if (work->broken[i])
                grip->staying[k] = grip->sliding[k];
            else
                grip->sliding[k] = grip->staying[k];
    }
#if SET_STANDS
    for (int k = 0; k < run->own_count; k++) {
        omniroll_bearing_t *const bearing = own_bearings(run) + k;
        if (!rests_in_rounds(work, rests, k, bearing))
            continue;
        if (bearing->broken)
            bearing->holding = bearing->sliding;
        else
            bearing->sliding = bearing->holding;
    }
#endif
    friction_in_lanes(run, work);
}

/* What gives way in a round has broken away. Whether some of it had not before. */
static int break_away(omniroll_run_t *run, const work_t *work, const int *rests)
{
    int further = 0;
    for (int i = 0; i < run->wheels; i++) {
        const int breaks = rests[i] && slides(run, i) && !work->broken[i];
        work->broken[i] |= breaks, further |= breaks;
    }
#if SET_STANDS
    for (int k = 0; k < run->own_count; k++) {
        omniroll_bearing_t *const bearing = own_bearings(run) + k;
        const int breaks = rests_in_rounds(work, rests, k, bearing) && bearing->mode && !bearing->broken;
        bearing->broken |= breaks, further |= breaks;
    }
#endif
    return further;
}

/* What was kept stands again. */
static void begin_again(omniroll_run_t *run, const work_t *work, const friction_t *own)
{
    memcpy(run->grips, own->grips, sizeof *run->grips*(size_t)run->wheels);
    run->ground = own->ground;
#if SET_CORNERS
    memcpy(work->under_loads->rests, own->rests, sizeof *own->rests*(size_t)run->wheels);
#endif
    put_friction(run, work, own);
    put_carrying(run);
}

/* Modes and loads by such rounds; returns what take_turns() does. */
static int take_rounds(omniroll_run_t *run, const work_t *work, const int *rests, const int *other,
                       const friction_t *own)
{
    int found;
    for (int i = 0; i < run->wheels; i++)
        work->broken[i] = own->grips[i].released;
#if SET_STANDS
    for (int k = 0; k < run->own_count; k++)
        own_bearings(run)[k].broken = other[run->wheels + k] != 0;
#endif
    do {
        begin_again(run, work, own);
        put_one_friction(run, work, rests);
        found = take_moments(run, work, rests, other);
    } while (found > 0 && break_away(run, work, rests));
    put_friction(run, work, own);
    return found;
}

/* Modes and loads that belong together; whether they have been found. */
static int find_modes_and_loads(omniroll_run_t *run, const work_t *work, const int *rests, const int *other)
{
    const friction_t own = keep_friction(run, work, rests);
    carrying_t last;
    int found = take_turns(run, work, rests, other);
    if (found >= 0)
        return found;
    try_present_set(run, work, &last);
    found = take_rounds(run, work, rests, other, &own);
    if (found < 0)
        fail(run, OMNIROLL_LOADS_UNSETTLED, &last);
    return found > 0;
}
#endif
