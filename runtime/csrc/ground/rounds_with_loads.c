/* Static friction above the sliding one under loads that follow the motion: rounds in which modes and loads are found
 * together. The reasons are in runtime/omniroll/effects/rounds_with_loads.py; the names are the same. */
#if SET_LOADS && SET_GRIPS
#define STARTS 2                    /* on the way to each contact, where loads are looked for elsewhere          */
#define TIPS (-2)                   /* what take_turns() does not return: the vehicle tips                       */

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
#include "ground/tipping.c"
#include "ground/where_it_stands.c"

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

/* Contacts whose friction is one in a round, of those that rest `rests`: also those that do as soon as their rollers
 * turn. */
static void find_in_rounds(const omniroll_run_t *run, const work_t *work, const int *rests, int *in_rounds)
{
    for (int i = 0; i < run->wheels; i++) {
        in_rounds[i] = rests[i];
#if SET_CORNERS
        in_rounds[i] |= fabs(work->under_loads->pair[2*i + 1]) <= slip_rounding(run, i);
#endif
    }
    (void)work;
}

/* Whether there are such that carry. */
static int decides_contacts(const omniroll_run_t *run, const work_t *work, const int *rests)
{
    int in_rounds[MOST_WHEELS], found = 0;
    find_in_rounds(run, work, rests, in_rounds);
    for (int i = 0; i < run->wheels; i++)
        found |= in_rounds[i] && run->grips[i].carries;
    return found;
}

#if SET_STANDS
/* Whether a bearing is one of those that rest. A massless roller is one that has stuck so far, whatever its contact
 * does: which it does follows from the loads. */
static int rests_in_rounds(const work_t *work, int k, const omniroll_bearing_t *bearing)
{
#if SET_CORNERS
    if (k >= work->own.rollers_at)
        return work->under_loads->before[k - work->own.rollers_at].resting;
#endif
    (void)work, (void)k;
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
        if (!rests_in_rounds(work, k, bearing))
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
        const int breaks = rests_in_rounds(work, k, bearing) && bearing->mode && !bearing->broken;
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
    work->under_loads->seeks_sets = 0;
#endif
    put_friction(run, work, own);
    put_carrying(run);
}

/* A round: friction as it is, contacts whose slip is zero, what find_modes() takes, and contacts that are decided. */
typedef struct {
    const friction_t *own;
    const int *rests, *other, *in_rounds;
} round_t;

static void begin_round(omniroll_run_t *run, const work_t *work, const round_t *round)
{
    begin_again(run, work, round->own);
    put_one_friction(run, work, round->in_rounds);
}

/* Loads to begin with: they act on one of the lines from the middle to the contacts. */
static void start_at(omniroll_run_t *run, const work_t *work, int start)
{
    int contact;
    const double part = way_of_start(run, start, STARTS, &contact);
    for (int i = 0; i < run->wheels; i++)
        run->grips[i].load = run->ground.weight*((1 - part)/run->wheels + part*(i == contact));
#if SET_CORNERS
    work->under_loads->seeks_sets = 1;
#endif
    (void)work;
}

#if SET_CORNERS
/* Modes and loads in a round, from where cells of the triangle between the middle and an edge say there are some. */
static int take_triangle(omniroll_run_t *run, const work_t *work, const round_t *round, const edge_t *edge)
{
    node_t nodes[FAN_PARTS + 1][FAN_PARTS + 1], cell[3];
    int found = -1;
    begin_round(run, work, round);
    for (int x = 0; x <= FAN_PARTS; x++)
        for (int y = 0; y <= FAN_PARTS - x; y++) {
            nodes[x][y].part[0] = (1 - NEXT_TO_EDGE)*x/FAN_PARTS, nodes[x][y].part[1] = (1 - NEXT_TO_EDGE)*y/FAN_PARTS;
            evaluate_node(run, work, round->other, edge, &nodes[x][y]);
        }
    for (int k = 0; k < 2*FAN_PARTS*FAN_PARTS && found <= 0; k++) {
        const int x = k/(2*FAN_PARTS), y = k/2%FAN_PARTS, turned = k%2;
        double weight[3], part[2] = {0, 0};
        if (x + y + turned >= FAN_PARTS)
            continue;
        put_cell(nodes, x, y, turned, cell);
        if (!(cancel(cell, weight) >= 0))
            continue;
        close_in(run, work, round->other, edge, cell);
        cancel(cell, weight);
        for (int j = 0; j < 6; j++)
            part[j%2] += weight[j/2]*cell[j/2].part[j%2];
        begin_round(run, work, round);
        load_node(run, edge, part);
        work->under_loads->seeks_sets = 1;
        found = take_moments(run, work, round->rests, round->other);
    }
    return found;
}
#endif

/* Modes and loads in a round; returns what take_turns() does, or that the vehicle tips. */
static int take_round(omniroll_run_t *run, const work_t *work, const round_t *round, int tells_tipping)
{
    begin_round(run, work, round);
    int found = take_moments(run, work, round->rests, round->other);
    for (int start = 0; found <= 0 && start < STARTS*run->wheels; start++) {
        begin_round(run, work, round);
        start_at(run, work, start);
        found = take_moments(run, work, round->rests, round->other);
    }
#if SET_CORNERS
    edge_t edge;
    for (int k = 0; k < run->wheels*run->wheels && found <= 0; k++)
        if (find_edge(run, k/run->wheels, k%run->wheels, &edge))
            found = take_triangle(run, work, round, &edge);
    if (found <= 0 && tells_tipping) {
        refusal_t last;
        keep_refusal(run, &last);
        begin_round(run, work, round);
        if (finds_where_it_tips(run, work, round->other))
            return TIPS;
        put_refusal(run, &last);
    }
#endif
    (void)tells_tipping;
    return found;
}

/* Modes and loads by such rounds; returns what take_turns() does, or that the vehicle tips, where that is told. */
static int take_rounds(omniroll_run_t *run, const work_t *work, const int *rests, const int *other,
                       const friction_t *own, int tells_tipping)
{
    int found, in_rounds[MOST_WHEELS];
    const round_t round = {own, rests, other, in_rounds};
    find_in_rounds(run, work, rests, in_rounds);
    for (int i = 0; i < run->wheels; i++)
        work->broken[i] = own->grips[i].released;
#if SET_STANDS
    for (int k = 0; k < run->own_count; k++)
        own_bearings(run)[k].broken = other[run->wheels + k] != 0;
#endif
    do
        found = take_round(run, work, &round, tells_tipping);
    while ((found > 0 || found == TIPS) && break_away(run, work, in_rounds));
    put_friction(run, work, own);
#if SET_STANDS
    for (int k = 0; k < run->own_count; k++)
        own_bearings(run)[k].broken = 0;
#endif
    return found;
}

/* Whether no loads are found in some modes since Newton's rule does not come to an end. */
static int lacks_loads(const omniroll_run_t *run)
{
    return run->ground.failure == OMNIROLL_LOADS_NONE && !isfinite(run->ground.failed_sums[1]);
}

/* Whether what turns have not found is looked for elsewhere: loads for some modes of massless rollers, which go with
 * the loads. A vehicle that tips does so. */
static int may_be_elsewhere(const omniroll_run_t *run)
{
    return lacks_loads(run) || (SET_CORNERS && run->ground.failure == OMNIROLL_LOADS_NONE && !tips(run));
}

/* Modes and loads that belong together; whether they have been found. */
static int find_modes_and_loads(omniroll_run_t *run, const work_t *work, const int *rests, const int *other)
{
    const friction_t own = keep_friction(run, work, rests);
    carrying_t last;
    refusal_t none;
    int found = take_turns(run, work, rests, other);
    if (found > 0 || (found == 0 && !may_be_elsewhere(run)))
        return found;
    const int has_none = found == 0 && !lacks_loads(run);
    keep_refusal(run, &none);
    try_present_set(run, work, &last);
    if (!isfinite(last.sums[1])) {              /* then those of before are told                        */
        memcpy(last.sums, own.ground.sums, sizeof last.sums);
        for (int i = 0; i < run->wheels; i++)
            last.compression[i] = own.grips[i].load;
    }
    found = take_rounds(run, work, rests, other, &own, has_none);
    if (found == TIPS || (found == 0 && run->ground.failure > OMNIROLL_LOADS_NONE))
        return 0;
    if (found <= 0 && has_none)
        put_refusal(run, &none);
    else if (found < 0 || (found == 0 && lacks_loads(run)))
        fail(run, decides_contacts(run, work, own.rests) ? OMNIROLL_LOADS_UNSETTLED : OMNIROLL_LOADS_UNSETTLED_BEARINGS,
             &last);
    return found > 0;
}
#endif
