/* Massless rollers that stick beside contacts that stick, under loads that follow the motion: whether the roller of a
 * contact that slips sticks follows from the state and the load, so that it is decided under each of the loads that are
 * found in turn. The numbered rules are in runtime/omniroll/effects/loaded_ground_with_massless_rollers.py. */

#define LOCATED 1e-9                /* of its sliding torque: so near to it a roller is that has come to rest       */
#define NEAR_FOLD 0.1               /* the coupled matrix has less where steps end before a fold                    */

/* ---- what the state says -------------------------------------------------------------------------------------- */

/* Where contacts would go if their rollers turned, of which `pair` are the slips of rigid wheels: along the rolling
 * directions, or where bearings have viscous friction where state and load say. */
static void slips_beside_turning(const omniroll_run_t *run, const work_t *work, const double *pair, double *slip)
{
#if SET_DAMPED_STRIPS
    int mode[MOST_WHEELS];
    for (int i = 0; i < run->wheels; i++)
        mode[i] = pair[2*i] < 0 ? -1 : 1;
    slips_of_turning(run, work, mode, pair, slip);
    for (int i = 0; i < run->wheels; i++) {
        const double size = length_of(slip + 2*i, 2);
        for (int k = 2*i; k < 2*i + 2 && size > 0; k++)
            slip[k] /= size;
    }
#else
    for (int i = 0; i < run->wheels; i++)
        slip[2*i] = 0, slip[2*i + 1] = copysign(1, pair[2*i + 1]);
    (void)work;
#endif
}

/* The same of the present modes; of other contacts the slips of rigid wheels. */
static void slips_that_rest(const omniroll_run_t *run, const work_t *work, const double *pair, double *slip)
{
#if SET_DAMPED_STRIPS
    int mode[MOST_WHEELS];
    for (int i = 0; i < run->wheels; i++)
        mode[i] = roller_mode(run, i);
    slips_of_turning(run, work, mode, pair, slip);
#else
    for (int i = 0; i < run->wheels; i++)
        slip[2*i] = roller_mode(run, i) ? 0 : pair[2*i], slip[2*i + 1] = pair[2*i + 1];
    (void)work;
#endif
}

/* Which contacts rest, also such as are off, which may carry from now on; the others have directions of their slips. */
static void find_resting_pairs(omniroll_run_t *run, const work_t *work)
{
    double pair[2*MOST_WHEELS], own[2*MOST_WHEELS];
    slips_now(run, work, pair);
    slips_that_rest(run, work, pair, own);
    for (int i = 0; i < run->wheels; i++) {
        omniroll_grip_t *const grip = run->grips + i;
        const double size = length_of(pair + 2*i, 2);
        const int still = size <= slip_rounding(run, i);
        if (still)
            stop_on_disk(in_series(run, work) + i);
        const int rolls = roller_mode(run, i) && length_of(own + 2*i, 2) <= slip_rounding(run, i);
        grip->resting = still || ((grip->resting || rolls) && grip->carries);
        if (still || (turns_loads(run, i, size) && goes_along(run, i, pair + 2*i, grip->towards, 0)))
            continue;
        for (int k = 0; k < 2; k++)
            grip->towards[k] = pair[2*i + k]/size;
    }
    roll(run, work, 0);
}

/* ---- which rollers turn --------------------------------------------------------------------------------------- */

/* An instant begins: what the state says of contacts and rollers. */
static void begin_under_loads(const omniroll_run_t *run, const work_t *work, int *rests, under_loads_t *start)
{
    slips_now(run, work, start->pair);
    start->turns = 0, start->rests = rests;
    for (int i = 0; i < run->wheels; i++) {
        start->before[i] = in_series(run, work)[i];
        start->landed[i] = rests[i] && !start->before[i].resting;
        start->still[i] = length_of(start->pair + 2*i, 2) <= slip_rounding(run, i);
        memcpy(start->way + 2*i, run->grips[i].towards, sizeof run->grips[i].towards);
    }
}

/* What would hold the rollers of contacts that slip if they stuck, under the present loads. */
static void asked_of_rigid(const omniroll_run_t *run, const work_t *work, const under_loads_t *start, double *asked)
{
    lanes_t toward[2*MOST_WHEELS];
    for (int k = 0; k < 2*run->wheels; k++)
        toward[k] = lanes_of(start->still[k/2] ? run->grips[k/2].towards[k%2] : start->pair[k]);
    asked_of_rollers(run, work, toward, asked);
    for (int i = 0; i < run->wheels; i++)
        asked[i] *= run->grips[i].load;
}

/* What a roller takes up to which it sticks: one that turned goes on where it is asked for its sliding torque at least.
 * One that has come to rest takes what it came to rest with, as near as the event is located. */
static double bound_under_loads(const omniroll_bearing_t *before, int turned)
{
    if (turned)
        return before->sliding;
    return before->size == INFINITY ? fmax(before->holding, before->sliding*(1 + LOCATED)) : most_of(before);
}

/* Whether the roller of a contact that slips turns where it would be asked for this torque if it stuck: it does from
 * now on, or it sticks. `now`: the mode that it had under the loads of before. */
static void turn_under_loads(const under_loads_t *start, int i, double asked, int carries, int now,
                             omniroll_bearing_t *roller)
{
    const omniroll_bearing_t *const before = start->before + i;
    const int turned = !before->resting || roller->broken || (start->turns > PATIENT_TURNS && now);
    const double bound = bound_under_loads(before, turned);
    const double beyond = fabs(asked) - bound, rounding = PASSED*rounding_of_holding(asked, bound);
    const int turns = beyond > (turned ? -rounding : rounding) || (before->resting && roller->released);
    if (carries && turns && start->folds != i + 1) {
        roller->mode = asked > 0 ? -1 : 1, roller->resting = 0;
        return;
    }
    roller->mode = 0, roller->resting = 1;
    roller->size = before->size == INFINITY ? fabs(asked) : before->resting ? before->size : 0;
}

/* Which rollers turn under the present loads (rule 2), and which contacts rest then. */
static void put_under_loads(omniroll_run_t *run, const work_t *work, under_loads_t *start)
{
    double asked[MOST_WHEELS], own[2*MOST_WHEELS];
    int *const rests = start->rests, open[MOST_WHEELS];
    asked_of_rigid(run, work, start, asked);
    for (int i = 0; i < run->wheels; i++) {
        omniroll_bearing_t *const roller = in_series(run, work) + i;
        const omniroll_bearing_t *const before = start->before + i;
        const int now = roller->mode;
        roller->mode = before->mode, roller->resting = before->resting;
        roller->size = before->size == INFINITY ? 0 : before->size;
        open[i] = !start->still[i] && !(SET_DAMPED_STRIPS ? start->landed[i] : rests[i] && !before->resting);
        if (open[i])
            turn_under_loads(start, i, asked[i], run->grips[i].carries, now, roller);
    }
    slips_that_rest(run, work, start->pair, own);
    for (int i = 0; i < run->wheels; i++) {
        omniroll_grip_t *const grip = run->grips + i;
        const omniroll_bearing_t *const roller = in_series(run, work) + i;
        const double size = length_of(own + 2*i, 2);
        if (open[i])
            rests[i] = roller->mode && size <= slip_rounding(run, i);
        grip->resting = rests[i] && grip->carries;
        if (rests[i])
            continue;
        for (int k = 0; k < 2; k++)
            grip->towards[k] = roller->mode ? own[2*i + k]/size : start->way[2*i + k];
    }
    start->turns++;
}

/* Rule 3: rollers of contacts that are off stick, and their bearings take nothing. */
static void stop_where_off(const omniroll_run_t *run, const work_t *work)
{
    for (int i = 0; i < run->wheels; i++)
        if (!run->grips[i].carries)
            stop_on_disk(in_series(run, work) + i);
}

/* Places of the bearings that may stick and turn under these loads (rule 4), in `which`; returns how many they are. */
static int undecided_under_loads(const omniroll_run_t *run, const work_t *work, const under_loads_t *start, int *which)
{
    const int rollers = work->own.rollers_at;
    double asked[MOST_WHEELS];
    int count = 0;
    asked_of_rigid(run, work, start, asked);
    for (int k = 0; k < rollers; k++)
        if (own_bearings(run)[k].resting)
            which[count++] = k;
    for (int i = 0; i < run->wheels; i++) {
        const omniroll_bearing_t *const roller = in_series(run, work) + i;
        if (run->grips[i].sticks ? roller->resting : slides(run, i) && fabs(asked[i]) >= roller->sliding)
            which[count++] = rollers + i;
    }
    return count;
}

/* ---- folds ---------------------------------------------------------------------------------------------------- */

/* The contact in a corner of whose load the bearing takes the largest part; -1 where there is none. */
static int steepest_corner(const omniroll_run_t *run, const work_t *work)
{
    double arm[MOST_WHEELS], per_chi[MOST_WHEELS], most = 0;
    int contact = -1;
    find_arms(run->wheels, &work->vehicle, work->standing, run->joint, run->chi, arm, per_chi);
    for (int i = 0; i < run->wheels; i++) {
        const omniroll_grip_t *const grip = run->grips + i;
        const double part = in_series(run, work)[i].sliding/(arm[i]*grip->sliding[0]*grip->load);
        if (slides(run, i) && roller_mode(run, i) && part > most)
            contact = i, most = part;
    }
    return contact;
}

/* Where a bearing takes nearly all of a load, what it leaves feels changes of the load far more than its part. Where
 * the friction left brings that load, two solutions of loads and friction come to one, and behind that instant, a
 * fold, there is none of the two: steps that come there become too small. What else there may be is that the roller
 * stops. Whether the run is at such an instant, or just behind it, where no loads are found: it does then. */
static int stops_in_fold(omniroll_run_t *run, const work_t *work)
{
    const int contact = steepest_corner(run, work);
    instant_t now;
    lanes_t nu_dot[3];
    at_this_instant(run, work, run->wheels, &now);
    core_rates(run->wheels, &now.point, nu_dot);
    const loads_t *const loads = now.point.loads;
    if (contact < 0 || (loads->determinant[0] > NEAR_FOLD && !isnan(loads->sums[1][0])))
        return 0;
    stop_on_disk(in_series(run, work) + contact);
    work->under_loads->folds = contact + 1;
    run->hold.undecided = run->ground.undecided = 1;
    return 1;
}

/* Whether the roller that has stopped in a fold sticks under the loads that have been found, if there is one. */
static int sticks_behind_fold(omniroll_run_t *run, const work_t *work)
{
    under_loads_t *const start = work->under_loads;
    const int i = start->folds - 1;
    double asked[MOST_WHEELS];
    if (i < 0)
        return 1;
    start->folds = 0;
    asked_of_rigid(run, work, start, asked);
    const double bound = bound_under_loads(start->before + i, 0);
    return !run->grips[i].carries || fabs(asked[i]) - bound <= PASSED*rounding_of_holding(asked[i], bound);
}
