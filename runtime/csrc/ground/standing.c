/* Contacts and axles that may all stick: wheels that stand, and what they ask for. The numbered rules are in
 * runtime/omniroll/effects/ground_with_axles.py; functions of one name do the same. standing_decisions.c says which of
 * those at rest stick. */
#if SET_STANDS_ALONE
#define SAME_BOUND 1e-9             /* of a force: bounds nearer to each other are reached together         */
#define NEAR_FACET 256              /* roundings below a facet is on it, where a step has ended             */

/* The wheels that stand in the present modes, and what they allow. */
static void stand(omniroll_run_t *run, const work_t *work)
{
    standing_t *const standing = work->standing;
    vector3_t rows[MOST_WHEELS];
    rows_of_wheels(run, work, rows);
    standing->count = run->hold.count = 0;
    standing->radius = run->ground.arms[2];
    standing->per_force = run->ground.friction/(run->ground.typical*run->ground.arms[0]);
    memset(standing->size, 0, sizeof standing->size);
    for (int i = 0; i < run->wheels; i++) {
        const omniroll_grip_t *const grip = run->grips + i;
        const omniroll_bearing_t *const axle = own_bearings(run) + i;
        for (int k = 0; k < 2; k++)
            standing->of_ground[2*i + k] = grip->load*grip->staying[k];
        for (int k = 0; k < 3; k++)
            standing->size[k] += standing->radius*fabs(rows[i][k])*(grip->load*grip->staying[1]);
        standing->holding[i] = axle->holding;
        standing->stands[i] = grip->sticks && axle->mode == 0;
        run->hold.count += axle->mode == 0;
        if (!standing->stands[i])
            continue;
        standing->rows.bounds[standing->count] = 0;
        memcpy(standing->rows.rows[standing->count], rows[i], sizeof rows[i]);
        standing->wheel[standing->count++] = i;
    }
    standing->rows.count = standing->count;
    standing->facet_count = standing->count ? facets_of(&standing->rows, standing->facets) : 0;
    allow_what_stands(run, &standing->rows);
    turn_own(run, work, 1);
    put_modes(run);
}

/* ---- what the state says -------------------------------------------------------------------------------------- */

/* nu without what wheels forbid that rest on the ground and on their axles. */
static int forbid(omniroll_run_t *run, const work_t *work)
{
    bearings_t both = {.count = 0};
    vector3_t rows[MOST_WHEELS];
    rows_of_wheels(run, work, rows);
    for (int i = 0; i < run->wheels; i++)
        if (run->grips[i].resting && own_bearings(run)[i].resting)
            memcpy(both.rows[both.count++], rows[i], sizeof rows[i]);
    return forbid_rates(run, &both);
}

/* What is zero within rounding rests; the vehicle may rest altogether where some wheels do. */
static void put_all_to_rest(omniroll_run_t *run, const work_t *work)
{
    double moves;
    run->hold.speed = fmax(run->hold.speed, FROM_REST*run->ground.settles);
    for (int i = 0; i < run->wheels; i++)
        run->hold.speed = fmax(run->hold.speed, speeds_of_slip(run, i));
    const double least = run->hold.speed/(run->ground.arms[2]*run->rate_of_speed);     /* of |nu|                  */
    for (int turn = 0; turn < 2; turn++) {
        find_resting_own(run, work, fmax(length3(run->nu), least));
        put_own_to_rest(run, work);
        find_resting_contacts(run, work);
        find_resting_own(run, work, fmax(length3(run->nu), least));
        put_own_to_rest(run, work);
        if (forbid(run, work)) {
            roll(run, work, 0);
            put_own_to_rest(run, work);
        }
    }
    moves = length3(run->nu);
    for (int i = 0; i < run->wheels; i++)
        moves += fabs(own_rates(run)[i]);
    run->hold.speed = moves > 0 ? run->hold.speed : FROM_REST*run->ground.settles;
}

/* ---- what is asked for ---------------------------------------------------------------------------------------- */

/* What the last evaluation at an instant says. */
static void asked_now(const omniroll_run_t *run, const work_t *work, asked_t *now)
{
    for (int k = 0; k < 3; k++)
        now->force[k] = work->held_force[k][0];
    for (int i = 0; i < run->wheels; i++)
        now->asked[i] = work->own.holding[i][0], now->along[i] = work->ground_force[2*i][0];
}

/* The torques of all bearings; of standing wheels beside the forces of least norm (rule 5). */
static void find_all_torques(const omniroll_run_t *run, const work_t *work, const asked_t *now)
{
    const standing_t *const standing = work->standing;
    asked_t none;
    for (int i = 0; i < run->wheels; i++) {
        omniroll_bearing_t *const axle = own_bearings(run) + i;
        axle->torque = axle->mode ? -axle->mode*axle->sliding : now->asked[i];
    }
    if (!standing->count)
        return;
    bearings_t wheels = standing->rows;
    vector3_t force;
    double found[MOST_BEARINGS];
    memset(&none, 0, sizeof none);
    for (int k = 0; k < 3; k++)
        force[k] = -now->force[k]/standing->radius;
    for (int k = 0; k < standing->count; k++) {
        double high[2], low[2], rates[2];
        largest_forces(standing, standing->wheel[k], 1, now, &none, high, rates);
        largest_forces(standing, standing->wheel[k], -1, now, &none, low, rates);
        const double most = fmin(high[0], high[1]), least = -fmin(low[0], low[1]);
        wheels.middle[k] = (most + least)/2;
        wheels.bounds[k] = fmax((most - least)/2, 0);
    }
    least_torques(&wheels, force, work->problem, found);
    for (int k = 0; k < standing->count; k++)
        own_bearings(run)[standing->wheel[k]].torque -= standing->radius*found[k];
}

/* A facet lets standing wheels go, contacts or axles (rule 3). */
static void release_facet(omniroll_run_t *run, const standing_t *standing, const facet_t *facet, const asked_t *now)
{
    asked_t none;
    memset(&none, 0, sizeof none);
    for (int k = 0; k < standing->count; k++) {
        const int i = standing->wheel[k];
        const double moved = moved_by(standing->rows.rows[k], facet->normal);
        double force[2], rates[2];
        if (moved == 0)
            continue;
        largest_forces(standing, i, moved > 0 ? 1 : -1, now, &none, force, rates);
        const double near = SAME_BOUND*(fabs(force[0]) + fabs(force[1]));
        run->grips[i].released |= force[0] <= force[1] + near;
        if (force[1] <= force[0] + near)
            own_bearings(run)[i].released = moved > 0 ? 1 : -1;
    }
}

/* Facets that are passed by more than `roundings` of theirs let go; returns how many. */
static int release_facets(omniroll_run_t *run, const work_t *work, const asked_t *now, double roundings)
{
    const standing_t *const standing = work->standing;
    int count = 0;
    asked_t none;
    memset(&none, 0, sizeof none);
    for (int f = 0; f < standing->facet_count; f++) {
        double rate, rounding;
        if (!(beyond_facet(standing, standing->facets + f, now, &none, &rate, &rounding) > roundings*rounding))
            continue;
        release_facet(run, standing, standing->facets + f, now);
        count++;
    }
    return count;
}

/* An axle that sticks and is asked for more than it takes, or all that, is let go; that of a standing wheel with its
 * contact. */
static void let_go(omniroll_run_t *run, const standing_t *standing, int i, const asked_t *now)
{
    own_bearings(run)[i].released = now->asked[i] > 0 ? -1 : 1;
    run->grips[i].released |= standing->stands[i];
}

/* Whether something that sticks is asked for more than it takes. It is let go. */
static int overdone(omniroll_run_t *run, const work_t *work, const asked_t *now)
{
    const standing_t *const standing = work->standing;
    int count = release_facets(run, work, now, PASSED);
    asked_t none;
    memset(&none, 0, sizeof none);
    for (int i = 0; i < run->wheels; i++) {
        double rate;
        if (run->grips[i].sticks) {
            const double taken = taken_now(run, work, i);
            const int passed = taken > GRIP_PASSED*GRIP_NOISE(taken);
            run->grips[i].released |= passed;
            count += passed;
        }
        if (own_bearings(run)[i].mode)
            continue;
        double most = standing->holding[i];
        if (standing->stands[i])
            most += standing->radius*left_of_ground(standing, i, now, &none, &rate);
        if (fabs(now->asked[i]) - most > PASSED*rounding_of_holding(now->asked[i], most)) {
            let_go(run, standing, i, now);
            count++;
        }
    }
    return count;
}

/* ---- steps ---------------------------------------------------------------------------------------------------- */

/* A step begins: who stands in it. */
static void begin_standing(const omniroll_run_t *run, const work_t *work, step_t *s)
{
    lanes_t nu_dot[3];
    s->standing = work->standing;
    /* contacts come before the axles among the events */
    s->facets = run->wheels;
    for (int k = 0; k < 9; k++)
        s->directions[k] = lanes_of(run->hold.directions[k]);
    for (int k = 0; k < 3; k++)
        s->absent[k] = lanes_of(run->hold.absent[k]);
    if (!run->hold.count)
        return;
    rates_at_this_instant(run, work, run->wheels, nu_dot);
    asked_now(run, work, &s->asked_start);
}

/* Some time has passed: what has come to its end at the end of the step is let go, or rests. */
static void wheels_have_moved(omniroll_run_t *run, const work_t *work, const step_t *s)
{
    const int first = s->wheels + s->guards + s->facets, landed = s->landing - first;
    omniroll_bearing_t *const axles = own_bearings(run);
    lanes_t nu_dot[3];
    asked_t now;
    for (int i = 0; i < run->wheels; i++) {
        axles[i].resting = axles[i].mode == 0;
        axles[i].released = 0;
    }
    stand_at_end(run, work);
    for (int i = 0; i < run->wheels; i++)
        if (axles[i].resting)
            run->core[rates_at(run->wheels) + i] = 0;
    if (!run->hold.count && landed < 0)
        return;
    rates_at_this_instant(run, work, run->wheels, nu_dot);
    asked_now(run, work, &now);
    find_all_torques(run, work, &now);
    if (landed < 0)
        return;
    run->hold.ended = 1;
    if (landed >= run->wheels) {
        release_facet(run, work->standing, work->standing->facets + (landed - run->wheels), &now);
        release_facets(run, work, &now, -NEAR_FACET);
    } else if (axles[landed].mode == 0)
        let_go(run, work->standing, landed, &now);
    axles[landed%run->wheels].resting |= landed < run->wheels;
}
#endif
