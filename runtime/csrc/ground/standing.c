/* Contacts and axles that may all stick: which of those at rest do. The numbered rules are in
 * runtime/omniroll/effects/ground_with_axles.py; functions of one name do the same. */
#if SET_STANDS
#define SAME_BOUND 1e-9             /* of a force: bounds nearer to each other are reached together         */
#define FROM_REST 1e6               /* s: see ground_with_axles.py                                          */
#define LEAST_REACH 1e-14           /* of the largest: for bearings that take no torque                     */
#define NEAR_FACET 256              /* roundings below a facet is on it, where a step has ended             */

static const double any_motion[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

/* The wheels that stand in the present modes, and what they allow. */
static void stand(omniroll_run_t *run, const work_t *work)
{
    static const vector3_t unit[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
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
            standing->of_ground[2*i + k] = (SET_LOADS ? 1 : grip->load)*grip->staying[k];
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
    memcpy(run->hold.directions, any_motion, sizeof any_motion);
    memset(run->hold.absent, 0, sizeof run->hold.absent);
    if (standing->count)
        directions_allowed(&standing->rows, unit, run->hold.directions, run->hold.absent);
    turn_own(run, work, 1);
    put_modes(run);
}

/* ---- what the state says -------------------------------------------------------------------------------------- */

/* nu without what wheels forbid that rest on the ground and on their axles. */
static int forbid(omniroll_run_t *run, const work_t *work)
{
    bearings_t both = {.count = 0};
    vector3_t rows[MOST_WHEELS], basis[3];
    rows_of_wheels(run, work, rows);
    for (int i = 0; i < run->wheels; i++)
        if (run->grips[i].resting && own_bearings(run)[i].resting)
            memcpy(both.rows[both.count++], rows[i], sizeof rows[i]);
    if (!both.count)
        return 0;
    const int rank = span_of(&both, basis);
    take_across(rank, (const vector3_t *)basis, run->nu);
    if (rank == 3)
        memset(run->nu, 0, sizeof(vector3_t));
    return 1;
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
#if SET_LOADS
    for (int i = 0; i < run->wheels; i++)
        now->load[i] = work->loads[LOADS_NOW].compression[i][0];
#endif
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
    least_torques(&wheels, force, found);
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

/* ---- which give way ------------------------------------------------------------------------------------------- */

/* The rates at an instant under its pushes, in N: loads that follow the motion are those of the contacts. */
static void rates_of_given_loads(const omniroll_run_t *run, const work_t *work, const instant_t *now, lanes_t *nu_dot)
{
#if SET_LOADS
    for (int i = 0; i < run->wheels; i++)
        now->point.loads->factor[i] = lanes_of(1);
    rates_under_loads_there(run->wheels, &now->point, nu_dot);
    for (int i = 0; i < run->wheels; i++)
        now->point.loads->compression[i] = lanes_of(run->grips[i].load);
#else
    core_rates_there(run->wheels, &now->point, nu_dot);
#endif
    (void)work;
}

/* The forces of the contacts that slip. */
static void forces_in_newtons(const omniroll_run_t *run, const work_t *work, lanes_t *push)
{
    forces_now(run, work, push);
    for (int k = 0; k < 2*run->wheels && SET_LOADS; k++)
        push[k] *= run->grips[k/2].load;
}

/* Contacts and axles at rest, as parts of one problem: contacts first. */
typedef struct {
    int contacts, count, wheel[MOST_PARTS];
} parts_at_rest_t;

/* The rates of what rests where nothing sticks, under these forces and torques. */
static void rates_of_free(const omniroll_run_t *run, const work_t *work, const lanes_t *push, const lanes_t *torque)
{
    instant_t now;
    lanes_t nu_dot[3], kept[MOST_WHEELS];
    at_this_instant(run, work, run->wheels, &now);
    for (int k = 0; k < 9; k++)
        now.directions[k] = lanes_of(any_motion[k]);
    for (int k = 0; k < 3; k++)
        now.absent[k] = lanes_of(0);
    for (int i = 0; i < run->wheels; i++) {
        now.arrays.input[SET_MODES_INPUT*run->wheels + i] = lanes_of(0);
        now.arrays.input[SET_BEARING_INPUT*run->wheels + i] = torque[i];
        kept[i] = work->own.sticks[i], work->own.sticks[i] = lanes_of(0);
    }
    memcpy(now.arrays.ground_push, push, sizeof *push*2*(size_t)run->wheels);
    rates_of_given_loads(run, work, &now, nu_dot);
    for (int i = 0; i < run->wheels; i++)
        work->own.sticks[i] = kept[i];
}

/* What component c of a part is moved by; 0 of one that it has not. */
static double typical_of(const omniroll_run_t *run, const parts_at_rest_t *rest, int part, int c)
{
    double most = 0;
    if (part < rest->contacts)
        return run->ground.typical;
    for (int i = 0; i < run->wheels; i++)
        most = fmax(most, own_bearings(run)[i].holding);
    return c ? 0 : most > 0 ? most : 1;
}

static lanes_t rate_of_part(const omniroll_run_t *run, const work_t *work, const parts_at_rest_t *rest, int part, int c)
{
    const int i = rest->wheel[part];
    if (part < rest->contacts)
        return work->slip_dot[2*i + SET_FIRST_DIRECTION + c];
    return c ? lanes_of(0) : work->core_dot[rates_at(run->wheels) + i];
}

/* D and a of the problem (rule 4); an axle has one component, beside one that nothing acts on. */
static void put_problem(const omniroll_run_t *run, const work_t *work, const parts_at_rest_t *rest, cones_t *problem)
{
    const int width = 2 - SET_FIRST_DIRECTION, size = rest->count*width;
    lanes_t given[2*MOST_WHEELS], turning[MOST_WHEELS];
    problem->count = rest->count, problem->width = width;
    forces_in_newtons(run, work, given);
    for (int i = 0; i < run->wheels; i++)
        turning[i] = lanes_of(-own_bearings(run)[i].mode*own_bearings(run)[i].sliding);
    for (int first = 0; first < size; first += LANES - 1) {
        lanes_t push[2*MOST_WHEELS], torque[MOST_WHEELS];
        double by[LANES] = {0};
        memcpy(push, given, sizeof *push*2*(size_t)run->wheels);
        memcpy(torque, turning, sizeof *torque*(size_t)run->wheels);
        for (int lane = 1; lane < LANES && first + lane - 1 < size; lane++) {
            const int k = first + lane - 1, part = k/width, c = k%width, i = rest->wheel[part];
            by[lane] = typical_of(run, rest, part, c);
            if (part < rest->contacts)
                push[2*i + SET_FIRST_DIRECTION + c][lane] += by[lane];
            else
                torque[i][lane] += by[lane];
        }
        rates_of_free(run, work, push, torque);
        for (int j = 0; j < size; j++) {
            const lanes_t rate = rate_of_part(run, work, rest, j/width, j%width);
            problem->given[j] = rate[0];
            for (int lane = 1; lane < LANES && first + lane - 1 < size; lane++)
                problem->matrix[j*size + first + lane - 1] = by[lane] > 0 ? (rate[lane] - rate[0])/by[lane] : 0;
        }
    }
    for (int j = 0; j < size; j++)
        for (int l = 0; l < j; l++)
            problem->matrix[j*size + l] = problem->matrix[l*size + j]
                = (problem->matrix[j*size + l] + problem->matrix[l*size + j])/2;
    for (int j = rest->contacts*width + 1; j < size && width == 2; j += 2)
        problem->matrix[j*size + j] = problem->matrix[(j - 1)*size + j - 1];
}

/* What the parts can take: those that have broken away slide. */
static void put_reaches(const omniroll_run_t *run, const parts_at_rest_t *rest, const int *broken, cones_t *problem)
{
    const int width = problem->width, size = rest->count*width;
    double most = 0;
    for (int j = 0; j < size; j++) {
        const int part = j/width, i = rest->wheel[part];
        const omniroll_grip_t *const grip = run->grips + i;
        const omniroll_bearing_t *const axle = own_bearings(run) + i;
        if (part < rest->contacts)
            problem->reach[j] = grip->load
                *(broken[part] ? grip->sliding : grip->staying)[SET_FIRST_DIRECTION + j%width];
        else
            problem->reach[j] = j%width ? 1 : broken[part] ? axle->sliding : axle->holding;
        most = fmax(most, problem->reach[j]);
    }
    for (int j = 0; j < size; j++)
        problem->reach[j] = fmax(problem->reach[j], LEAST_REACH*most);
}

/* The mode of an axle from the last round. */
static void take_axle_mode(omniroll_bearing_t *axle, const cones_t *problem, int part, int slips)
{
    const int j = part*problem->width;
    const int at_bound = -axle->released*problem->force[j] >= problem->reach[j]*(1 - AT_EDGE);
    axle->mode = slips ? (problem->rate[j] > 0) - (problem->rate[j] < 0) : at_bound ? axle->released : 0;
}

/* Which of the contacts and axles at rest give way, by rounds (rule 4). */
static void decide_together(omniroll_run_t *run, const work_t *work)
{
    cones_t problem;
    parts_at_rest_t rest = {0};
    int broken[MOST_PARTS], slips[MOST_PARTS], further;
    for (int i = 0; i < run->wheels; i++)
        if ((run->grips[i].sticks = run->grips[i].resting))
            rest.wheel[rest.count++] = i;
    rest.contacts = rest.count;
    for (int i = 0; i < run->wheels; i++)
        if (own_bearings(run)[i].resting) {
            own_bearings(run)[i].mode = 0;
            rest.wheel[rest.count++] = i;
        }
    put_problem(run, work, &rest, &problem);
    for (int k = 0; k < rest.count; k++)
        broken[k] = k < rest.contacts ? run->grips[rest.wheel[k]].released
            : own_bearings(run)[rest.wheel[k]].released != 0;
    do {
        put_reaches(run, &rest, broken, &problem);
        decide_semidefinite(&problem);
        further = 0;
        for (int k = 0; k < rest.count; k++) {
            slips[k] = begins_to_slip(&problem, k);
            further |= slips[k] && !broken[k];
            broken[k] |= slips[k];
        }
    } while (further);
    for (int k = 0; k < rest.count; k++)
        if (k < rest.contacts)
            take_mode(run->grips + rest.wheel[k], &problem, k, slips[k], run->grips[rest.wheel[k]].released);
        else
            take_axle_mode(own_bearings(run) + rest.wheel[k], &problem, k, slips[k]);
}

/* The modes of contacts and axles under the loads that the contacts have, and what they are asked for then. */
static void decide_modes(omniroll_run_t *run, const work_t *work, asked_t *now)
{
    int released = 0;
    for (int i = 0; i < run->wheels; i++) {
        run->grips[i].sticks = run->grips[i].resting;
        released |= run->grips[i].released || own_bearings(run)[i].released;
    }
    if (released)
        decide_together(run, work);
    for (int turn = 0; turn <= 2*run->wheels; turn++) {
        lanes_t nu_dot[3];
        stand(run, work);
#if SET_LOADS
        instant_t instant;
        at_this_instant(run, work, run->wheels, &instant);
        forces_in_newtons(run, work, instant.arrays.ground_push);
        rates_of_given_loads(run, work, &instant, nu_dot);
#else
        rates_at_this_instant(run, work, run->wheels, nu_dot);
#endif
        asked_now(run, work, now);
        if (!overdone(run, work, now))
            break;
        decide_together(run, work);
    }
}

#if SET_LOADS
/* What is let go at this instant. */
typedef struct {
    int contacts[MOST_WHEELS], axles[MOST_WHEELS];
} let_go_t;

static void keep_released(const omniroll_run_t *run, let_go_t *kept)
{
    for (int i = 0; i < run->wheels; i++)
        kept->contacts[i] = run->grips[i].released, kept->axles[i] = own_bearings(run)[i].released;
}

static void put_released(omniroll_run_t *run, const let_go_t *kept)
{
    for (int i = 0; i < run->wheels; i++)
        run->grips[i].released = kept->contacts[i], own_bearings(run)[i].released = kept->axles[i];
}

/* Axles at rest stick so far. */
static void stop_resting_axles(omniroll_run_t *run)
{
    for (int i = 0; i < run->wheels; i++)
        own_bearings(run)[i].mode = own_bearings(run)[i].resting ? 0 : own_bearings(run)[i].mode;
}

/* Modes for the loads, and loads for the modes, until nothing changes; of contacts that rest `rests`. What is let go
 * under loads that are not the last is decided anew. Returns whether that has come to an end. */
static int settle_standing(omniroll_run_t *run, const work_t *work, const int *rests)
{
    let_go_t let_go;
    asked_t now;
    keep_released(run, &let_go);
    for (int turn = 0; turn < TURNS; turn++) {
        double before[MOST_WHEELS], changed = 0;
        int holds[MOST_WHEELS];
        for (int i = 0; i < run->wheels; i++)
            before[i] = run->grips[i].load;
        put_released(run, &let_go);
        stop_resting_axles(run);
        decide_modes(run, work, &now);
        stand(run, work);
        for (int i = 0; i < run->wheels; i++)
            holds[i] = run->grips[i].sticks || (rests[i] && !run->grips[i].carries);
        if (!decide_carrying_beside(run, work, holds, rests))
            return 0;
        for (int i = 0; i < run->wheels; i++)
            changed = fmax(changed, fabs(run->grips[i].load - before[i]));
        if (changed <= LOADS_SETTLED*run->ground.weight)
            return 1;
    }
    carrying_t last;
    try_present_set(run, work, &last);
    fail(run, OMNIROLL_LOADS_UNSETTLED, &last);
    return 0;
}

/* Whether in the modes of the contacts loads and axles determine each other: whether the coupled matrix has a positive
 * determinant whichever of the axles at rest stick (rule 3 of loaded_ground_with_axles.py). */
static int is_determined(omniroll_run_t *run, const work_t *work)
{
    int resting[MOST_WHEELS], holds[MOST_WHEELS], count = 0, tried = 0;
    carrying_t sets[LANES];
    for (int i = 0; i < run->wheels; i++) {
        holds[i] = run->grips[i].sticks;
        if (own_bearings(run)[i].resting)
            resting[count++] = i;
    }
    for (int choice = 0; count <= MOST && choice < 1 << count; choice++) {
        carrying_t *const set = sets + tried++;
        for (int i = 0; i < run->wheels; i++)
            set->carries[i] = run->grips[i].carries, set->axle_mode[i] = own_bearings(run)[i].mode;
        for (int k = 0; k < count; k++)
            set->axle_mode[resting[k]] = choice >> k & 1;
        if (tried < LANES && choice + 1 < 1 << count)
            continue;
        evaluate_sets(run, work, holds, sets, tried);
        for (; tried > 0; tried--)
            if (!(sets[tried - 1].determinant > DETERMINED)) {
                fail(run, OMNIROLL_LOADS_UNDETERMINED, sets + tried - 1);
                return 0;
            }
    }
    return 1;
}

/* Modes and loads for each other, and what is asked for then. Returns whether there are such. */
static int decide_with_loads(omniroll_run_t *run, const work_t *work, asked_t *now)
{
    lanes_t nu_dot[3];
    int rests[MOST_WHEELS], resting = 0;
    refusal_t at_rest;
    for (int i = 0; i < run->wheels; i++) {
        omniroll_grip_t *const grip = run->grips + i;
        const int gone = grip->released && grip->load <= FITS*run->ground.weight;       /* rule 5                  */
        grip->dropped |= gone, grip->released &= !gone;
        rests[i] = grip->resting;
    }
    stop_resting_axles(run);
    turn_own(run, work, 1);
    const int may_stick = carries_at_rest(run, work, rests, &at_rest);
    for (int i = 0; i < run->wheels; i++)
        resting |= run->grips[i].resting;
    if (!may_stick && !(resting && run->ground.failure == OMNIROLL_LOADS_NONE))
        return 0;
    if (!settle_standing(run, work, rests)) {
        tell_what_tips(run, &at_rest);
        return 0;
    }
    if (!is_determined(run, work))
        return 0;
    stand(run, work);
    rates_at_this_instant(run, work, run->wheels, nu_dot);
    asked_now(run, work, now);
    run->ground.knows_rates = 0;
    return 1;
}
#endif

/* The modes of all contacts and axles in the phase that begins now. */
static void decide_all(omniroll_run_t *run, const work_t *work)
{
    asked_t now;
    put_all_to_rest(run, work);
#if SET_LOADS
    run->ground.knows_rates = 0;
    if (!decide_with_loads(run, work, &now))
        return;
#else
    decide_modes(run, work, &now);
#endif
    find_all_torques(run, work, &now);
    size_own(run, work);
    run->hold.undecided = run->ground.undecided = 0;
}

/* Which axles and contacts stick from now on, where that must be decided anew. */
static void settle_modes(omniroll_run_t *run, const work_t *work)
{
    if (run->hold.undecided || run->ground.undecided)
        decide_all(run, work);
}

/* ---- steps ---------------------------------------------------------------------------------------------------- */

/* A step begins: who stands in it. */
static void begin_standing(const omniroll_run_t *run, const work_t *work, step_t *s)
{
    lanes_t nu_dot[3];
    s->standing = work->standing;
    /* contacts, and their loads, come before the axles among the events */
    s->facets = run->wheels + (SET_LOADS ? run->wheels + 1 : 0);
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
        if (axles[i].resting)
            run->core[rates_at(run->wheels) + i] = 0;
    }
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
