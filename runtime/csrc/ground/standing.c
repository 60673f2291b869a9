/* Contacts, axles and rollers that may all stick: wheels that stand, and what they ask for. decisions.c says which of
 * those at rest stick. */

/* The bearing that holds a wheel in a direction; null where it has none that may stick. */
ALWAYS_INLINE omniroll_bearing_t *bearing_in_direction(const omniroll_run_t *run, int direction)
{
    const int place = place_in_direction(run, direction);
    return place < 0 ? 0 : core_bearings(run) + place;
}

/* The directions in which wheels stand: those in which contact and bearing stick, or with `resting` rest. */
static void find_standing(const omniroll_run_t *run, const work_t *work, int resting, bearings_t *rows)
{
    vector3_t all[2*MAX_WHEELS];
    rows->count = 0;
    rows_in_directions(run, work, all);
    for (int k = 0; k < 2*run->wheels; k++) {
        const omniroll_grip_t *const grip = run->ground.grips + k/2;
        const omniroll_bearing_t *const bearing = bearing_in_direction(run, k);
        work->standing->stands[k] = bearing
            && (resting ? grip->resting && bearing->resting : grip->sticks && bearing->mode == 0);
        if (!work->standing->stands[k])
            continue;
        rows->bounds[rows->count] = 0;
        memcpy(rows->rows[rows->count++], all[k], sizeof all[k]);
    }
}

/* The wheels that stand in the present modes, and what they allow. */
static void stand(omniroll_run_t *run, const work_t *work)
{
    standing_t *const standing = work->standing;
    find_standing(run, work, 0, &standing->rows);
    standing->count = 0, standing->max_holding = standing->rounding = 0;
    standing->radius = run->ground.arms[2], standing->arm = run->ground.reach;
    standing->per_force = run->ground.friction/(run->ground.typical*run->ground.arms[0]);
    memset(standing->size, 0, sizeof standing->size);
    for (int k = 0; k < run->bearings.core_count; k++) {
        standing->has_part[k] = 0;
        standing->max_holding = fmax(standing->max_holding, core_bearings(run)[k].holding);
    }
    for (int k = 0; k < 2*run->wheels; k++) {
        standing->of_ground[k] = run->ground.grips[k/2].load*run->ground.grips[k/2].staying[k%2];
        if (!standing->stands[k])
            continue;
        const int d = standing->count++, place = (int)(bearing_in_direction(run, k) - core_bearings(run));
        standing->wheel[d] = k/2, standing->direction[d] = k%2, standing->bearing[d] = place;
        standing->holding[d] = core_bearings(run)[place].holding, standing->has_part[place] = 1;
        for (int c = 0; c < 3; c++)
            standing->size[c] += fabs(standing->rows.rows[d][c])*standing->of_ground[k];
    }
    memset(standing->used_by, 0, sizeof *standing->used_by*(size_t)standing->count);
    run->hold.count = 1;
    allow_what_stands(run, &standing->rows);
    enter_bearings(run, work, 1);
    put_modes(run);
}

/* ---- what the state says -------------------------------------------------------------------------------------- */

/* nu without what wheels forbid that rest on the ground and in their bearings. */
static int forbid(omniroll_run_t *run, const work_t *work)
{
    bearings_t both;
    find_standing(run, work, 1, &both);
    return forbid_rates(run, &both);
}

static double least_arm_now(const omniroll_run_t *run, const work_t *work)
{
    double arm[MAX_WHEELS], per_chi[MAX_WHEELS], least = INFINITY;
    if (!SET_ROLLERS_TURN)
        return least;
    find_arms(run->wheels, &work->vehicle, work->standing, run->joint, run->state.chi, arm, per_chi);
    for (int i = 0; i < run->wheels; i++)
        least = fmin(least, arm[i]);
    return least;
}

/* Contacts at rest, with their massless rollers where there are such. */
static void find_all_resting(omniroll_run_t *run, const work_t *work)
{
    if (SET_STRIPS)
        find_resting_pairs(run, work);
    else
        find_resting_contacts(run, work);
}

/* What is zero within rounding rests; the vehicle may rest altogether where some wheels do. */
static void put_all_to_rest(omniroll_run_t *run, const work_t *work)
{
    int moves = 0;
    if (SET_STRIPS)
        stop_in_modes(run, work);
    work->standing->arm = run->ground.reach;
    const double least_arm = least_arm_now(run, work);
    run->hold.speed = fmax(run->hold.speed, FROM_REST*run->ground.settles);
    for (int i = 0; i < run->wheels; i++)
        run->hold.speed = fmax(run->hold.speed, speeds_of_slip(run, i));
    for (int turn = 0; turn < 2; turn++) {
        rest_bearings(run, work, least_arm);
        find_all_resting(run, work);
        rest_bearings(run, work, least_arm);
        if (forbid(run, work)) {
            roll(run, work, 0);
            rest_bearings(run, work, least_arm);
        }
    }
    if (SET_STRIPS)  /* what rests has been seen before nu lost what it forbids              */
        find_all_resting(run, work);
    for (int k = 0; k < count_in_core(run, work); k++)
        moves |= core_bearings(run)[k].mode;
    for (int k = 0; k < 3; k++)
        moves |= run->state.nu[k] != 0;
    for (int i = 0; i < run->wheels; i++)
        moves |= run->state.core[rates_at(run->wheels) + i] != 0;
    run->hold.speed = moves ? run->hold.speed : FROM_REST*run->ground.settles;
}

/* Before a switch: contacts that rest and whose rollers rest on their disks. */
static void contacts_that_rest_with_rollers(const omniroll_run_t *run, int *rested)
{
    for (int i = 0; i < run->wheels; i++)
        rested[i] = run->ground.grips[i].resting && core_bearings(run)[(SET_AXLES_STICK ? run->wheels : 0) + i].resting;
}

/* And behind it: such a contact rests as before where its new roller rests, too. */
static void keep_contacts_at_rest(omniroll_run_t *run, const int *rested)
{
    const omniroll_bearing_t *const rollers = core_bearings(run) + (SET_AXLES_STICK ? run->wheels : 0);
    for (int i = 0; i < run->wheels; i++)
        run->ground.grips[i].resting |= rested[i] && rollers[i].resting;
}

/* ---- the demand ------------------------------------------------------------------------------------------------ */

/* What the last evaluation at an instant says. */
static void demand_now(const omniroll_run_t *run, const work_t *work, demand_t *now)
{
    double per_chi[MAX_WHEELS];
    const standing_t *const standing = work->standing;
    memset(now, 0, sizeof *now);
    for (int k = 0; k < 3; k++)
        now->force[k] = SET_STANDS ? work->held_force[k][0] : run->hold.force[k];
    for (int k = 0; SET_STANDS && k < 2*run->wheels; k++)
        now->along[k] = work->ground_force[k][0];
    for (int d = 0; SET_STANDS && d < standing->count; d++)
        now->of_bearings[2*standing->wheel[d] + standing->direction[d]] = work->states.holding[standing->bearing[d]][0];
    find_arms(run->wheels, &work->vehicle, standing, run->joint, run->state.chi, now->arm, per_chi);
}

/* The torques of all bearings; of standing wheels beside the forces of least norm, or where all is `used_up`
 * those of the least use, which are known. */
static void find_all_torques(const omniroll_run_t *run, const work_t *work, const demand_t *now, int used_up)
{
    const standing_t *const standing = work->standing;
    for (int k = 0; k < run->bearings.core_count; k++) {
        omniroll_bearing_t *const bearing = core_bearings(run) + k;
        bearing->torque = bearing->mode ? -bearing->mode*bearing->sliding : work->states.holding[k][0];
    }
    if (standing->count) {
        double forces[MAX_STANDING];
        memcpy(forces, standing->used_by, sizeof forces);
        if (!used_up)
            least_norm_within(standing, now, forces);
        for (int d = 0; d < standing->count; d++) {
            omniroll_bearing_t *const bearing = core_bearings(run) + standing->bearing[d];
            bearing->torque = clipped(bearing->torque + arm_of(standing, d, now)*forces[d], bearing->holding);
        }
    }
    if (SET_MOMENTS_INPUT >= 0)
        put_moments(run);
}

/* Of rollers that stick and whose contacts slip, in a row: by its slips, and its headings by these, too. */
static void find_torques_in_row(omniroll_run_t *run, const work_t *work)
{
    double pair[2*MAX_WHEELS], demand[MAX_WHEELS];
    lanes_t toward[2*MAX_WHEELS];
    slips_now(run, work, pair);
    for (int i = 0; i < run->wheels; i++) {
        const double speeds = fmax(speeds_of_slip(run, i), ROUNDING_OF_SPEED*run->hold.speed);
        const int says = length_of(pair + 2*i, 2) > SLIP_AT_REST*EPS*speeds;
        for (int k = 2*i; k < 2*i + 2; k++)
            toward[k] = lanes_of(says ? pair[k] : run->ground.grips[i].towards[k - 2*i]);
    }
    demand_on_rollers(run, work, toward, demand);
    for (int i = 0; i < run->wheels; i++)
        if (slides(run, i) && !roller_mode(run, i)) {
            in_series(run, work)[i].torque = demand[i];
            run->acts.inputs[SET_HEADINGS_INPUT*run->wheels + i] = atan2(toward[2*i + 1][0], toward[2*i][0]);
        }
}

/* What has to take all that it can is let go, at the least use. */
static void release_used(omniroll_run_t *run, const standing_t *standing, const demand_t *now, double use,
                         const double *forces)
{
    for (int d = 0; d < standing->count; d++) {
        const int i = standing->wheel[d];
        const double of_bearing = bearing_use(standing, now, forces, d);
        if (SET_STANDS)
            run->ground.grips[i].released |= contact_use(standing, now, forces, i) >= use*(1 - USED);
        if (fabs(of_bearing) >= use*(1 - USED))
            run->bearings.each[standing->bearing[d]].released = of_bearing > 0 ? -1 : 1;
    }
}

/* Whether the least use is beyond 1 by more than `roundings`. `let_go`: what it uses up is. */
static int release_where_used(omniroll_run_t *run, const work_t *work, const demand_t *now, double roundings,
                              int let_go)
{
    standing_t *const standing = work->standing;
    double found[MAX_STANDING], *const forces = SET_STANDS ? standing->used_by : found;
    if (!standing->count || (roundings > 0 && uses_little(standing, now, standing->used_by)))
        return 0;
    const double use = least_use(standing, now, forces);
    const int is_beyond = use > 0 && use - 1 > roundings*rounding_of_use(standing, use);
    if (is_beyond && let_go)
        release_used(run, standing, now, use, forces);
    return is_beyond;
}

/* Contacts that have been let go and would come to rest at once hold. Returns how many there are. */
static int hold_what_falls_back(omniroll_run_t *run, const work_t *work)
{
    int count = 0;
    for (int i = 0; i < run->wheels; i++) {
        omniroll_grip_t *const grip = run->ground.grips + i;
        double falls = -(grip->towards[0]*work->slip_dot[2*i][0] + grip->towards[1]*work->slip_dot[2*i + 1][0]);
        const int holds = grip->released && grip->resting && !grip->sticks && falls > run->ground.settles;
        grip->released &= !holds;
        count += holds;
    }
    return count;
}

/* ---- steps ---------------------------------------------------------------------------------------------------- */

/* A step begins: who stands in it. */
static void begin_standing(const omniroll_run_t *run, const work_t *work, step_t *s)
{
    lanes_t nu_dot[3];
    /* contacts come before the bearings among the events */
    s->hold.of_contacts = run->wheels;
    for (int k = 0; k < 9; k++)
        s->hold.directions[k] = lanes_of(run->hold.directions[k]);
    for (int k = 0; k < 3; k++)
        s->hold.absent[k] = lanes_of(run->hold.absent[k]);
    if (work->standing->count)
        rates_at_this_instant(run, work, run->wheels, nu_dot);
}

/* What bearings are rounded against in the phase that starts now. */
static void size_all(const omniroll_run_t *run, const work_t *work)
{
    const double least_arm = least_arm_now(run, work);
    if (SET_STRIPS)
        find_bearing_rates(run, work);
    size_bearings(run, work);
    for (int k = 0; k < run->bearings.core_count; k++)
        if (!SET_IN_SERIES || core_bearings(run)[k].mode)
            core_bearings(run)[k].size = fmax(core_bearings(run)[k].size, least_rate(run, work, k, least_arm));
}

/* What has come to its end at the end of the step is let go, or rests. */
static void wheels_have_moved(omniroll_run_t *run, const work_t *work, const step_t *s)
{
    const int landed = s->event.landing - (s->wheels + s->event.guards + s->hold.of_contacts);
    lanes_t nu_dot[3];
    demand_t now;
    stand_at_end(run, work);
    bearings_have_stuck(run, work);         /* once more: nu has just lost what standing wheels take from it    */
    if (work->standing->count)
        memcpy(work->standing->used_by, s->hold.used_by, sizeof s->hold.used_by);
    rates_at_this_instant(run, work, run->wheels, nu_dot);
    demand_now(run, work, &now);
    const int used_up = landed >= run->bearings.core_count && release_where_used(run, work, &now, -INFINITY, 1);
    find_all_torques(run, work, &now, used_up);
    if (SET_STRIPS)
        find_torques_in_row(run, work);
    end_of_bearing(run, landed);
}
