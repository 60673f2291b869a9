/* Axles that stick: a mode for each, and what holds those that stick. The numbered rules are in
 * runtime/omniroll/effects/sticking.py. */
#if SET_HOLDS
#define AT_REST 16                  /* a rate is zero within this many of its roundings                     */
#define MOVES 1e-10                 /* a bearing moves whose acceleration is above this part of the possible */
#define AT_BOUND 1e-9               /* a torque is at its bound that is nearer to it than this part of it   */
#define HELD_ROUNDINGS 64           /* times an input's: of torques that hold                               */

ALWAYS_INLINE double *bearing_inputs(const omniroll_run_t *run)
{
    return run->inputs + SET_BEARING_INPUT*run->wheels;
}

/* What the rate of an axle is rounded against: nu is what is left of larger numbers, each of about its length. */
ALWAYS_INLINE double size_of_rate(const omniroll_axle_t *axle, const double *nu)
{
    return length3(axle->row)*length3(nu);
}

/* Axles whose rates are zero within rounding rest. A phase may end on a joint where all rates come to zero: what is left
 * is rounding of what nu has been. */
static void find_resting(omniroll_run_t *run)
{
    const double speed = fmax(length3(run->nu), run->hold.speed);
    for (int i = 0; i < run->axle_count; i++) {
        omniroll_axle_t *const axle = run->axles + i;
        axle->resting |= fabs(dot3(axle->row, run->nu)) <= AT_REST*EPS*length3(axle->row)*speed;
    }
}

/* Those of the axles whose mode or rest is this one, with their torques at rest; their places. */
static int bearings_of(const omniroll_run_t *run, int sticking, bearings_t *bearings, int *places)
{
    bearings->count = 0;
    for (int i = 0; i < run->axle_count; i++)
        if (sticking ? run->axles[i].mode == 0 : run->axles[i].resting) {
            places[bearings->count] = i;
            bearings->bounds[bearings->count] = run->axles[i].holding;
            memcpy(bearings->rows[bearings->count++], run->axles[i].row, sizeof(vector3_t));
        }
    return bearings->count;
}

/* The rates of resting axles become zero, and the others turn. */
static void put_to_rest(omniroll_run_t *run)
{
    bearings_t bearings;
    vector3_t basis[3];
    int places[MOST_WHEELS];
    find_resting(run);
    bearings_of(run, 0, &bearings, places);
    const int rank = span_of(&bearings, basis);
    take_across(rank, (const vector3_t *)basis, run->nu);
    if (rank == 3)
        memset(run->nu, 0, sizeof(vector3_t));
    find_resting(run);
    if (length3(run->nu) == 0)
        run->hold.speed = 0;
    for (int i = 0; i < run->axle_count; i++) {
        omniroll_axle_t *const axle = run->axles + i;
        const double rate = dot3(axle->row, run->nu);
        axle->mode = axle->resting ? 0 : (rate > 0) - (rate < 0);
    }
}

/* The torques of the bearings that turn; 0 of those that stick. */
static void turn_bearings(omniroll_run_t *run)
{
    for (int i = 0; i < run->axle_count; i++)
        bearing_inputs(run)[i] = -run->axles[i].mode*run->axles[i].sliding;
}

/* What sticks with the present modes. */
static void hold(omniroll_run_t *run, const work_t *work, const vector3_t *mass)
{
    omniroll_hold_t *const held = &run->hold;
    bearings_t sticking;
    int places[MOST_WHEELS];
    held->count = bearings_of(run, 1, &sticking, places);
    held->free = directions_allowed(&sticking, mass, held->directions, held->absent);
    held->facet_count = held->count ? facets_of(&sticking, work->facets) : 0;
    turn_bearings(run);
}

/* The force that holds what sticks, at this instant. */
static void find_held_force(omniroll_run_t *run, const work_t *work)
{
    lanes_t nu_dot[3];
    if (!run->hold.count)
        return;
    rates_at_this_instant(run, work, run->wheels, nu_dot);
    for (int k = 0; k < 3; k++)
        run->hold.force[k] = work->held_force[k][0];
}

/* The torques of the bearings with this held force: of least norm where they hold. */
static void find_torques(omniroll_run_t *run)
{
    bearings_t sticking;
    int places[MOST_WHEELS];
    double torques[MOST_WHEELS];
    for (int i = 0; i < run->axle_count; i++)
        run->axles[i].torque = bearing_inputs(run)[i];
    if (!bearings_of(run, 1, &sticking, places))
        return;
    least_torques(&sticking, run->hold.force, torques);
    for (int k = 0; k < sticking.count; k++)
        run->axles[places[k]].torque = torques[k];
}

/* All generalised forces but those of the bearings of resting axles, and the sums of the sizes of their terms. */
static void find_forces(omniroll_run_t *run, const work_t *work, double *force)
{
    omniroll_hold_t *const held = &run->hold;
    double *const bearings = bearing_inputs(run);
    held->count = 1, held->free = 0;                    /* nothing may move */
    memset(held->directions, 0, sizeof held->directions);
    for (int k = 0; k < 3; k++)
        held->absent[k] = 1;
    memset(bearings, 0, sizeof *bearings*(size_t)run->wheels);
    find_held_force(run, work);
    for (int k = 0; k < 3; k++)
        held->size[k] = fabs(held->force[k]), force[k] = -held->force[k];
    for (int i = 0; i < run->axle_count; i++) {
        const omniroll_axle_t *const axle = run->axles + i;
        double drives = 0;
        for (int input = 0; input < SET_INPUTS; input++)
            drives += fabs(input_now(run, input*run->wheels + i));
        for (int k = 0; k < 3; k++)
            held->size[k] += fabs(axle->row[k])*drives;
        add3(force, -axle->mode*axle->sliding, axle->row);      /* 0 of those that rest */
    }
}

/* How many facets the force at this instant has passed by more than its rounding; and of each axle that sticks the
 * signs with which they let it go, added up. */
static int facets_passed(const omniroll_run_t *run, const work_t *work, int *signs)
{
    const omniroll_hold_t *const held = &run->hold;
    int count = 0;
    for (int i = 0; i < run->axle_count; i++)
        signs[i] = 0;
    for (int f = 0; held->count && f < held->facet_count; f++) {
        double rounding;
        const double value = excess(work->facets + f, held->force, held->size, &rounding);
        if (!(value > PASSED*rounding))
            continue;
        count++;
        for (int i = 0; i < run->axle_count; i++)
            if (run->axles[i].mode == 0)
                signs[i] += breaks_away(run->axles[i].row, work->facets + f);
    }
    return count;
}

/* Facets have let these axles go. */
static void release(omniroll_run_t *run, const int *signs)
{
    for (int i = 0; i < run->axle_count; i++)
        if (signs[i])
            run->axles[i].released = signs[i] > 0 ? 1 : -1;
    run->hold.undecided = 1;
}

/* Modes of the resting axles by rounds; those that a facet has released have broken away before the first. */
static void decide_in_rounds(omniroll_run_t *run, const work_t *work, const vector3_t *mass, const double *force)
{
    bearings_t resting;
    int places[MOST_WHEELS], broken[MOST_WHEELS], moves[MOST_WHEELS], further;
    double torques[MOST_WHEELS], rates[MOST_WHEELS];
    const int count = bearings_of(run, 0, &resting, places);
    vector3_t inverse[3], nu_dot;
    for (int k = 0; k < 3; k++)
        cross3(mass[(k + 1)%3], mass[(k + 2)%3], inverse[k]);
    const double determinant = dot3(mass[0], inverse[0]);
    for (int k = 0; k < count; k++)
        broken[k] = run->axles[places[k]].released != 0;
    do {
        vector3_t most = {fabs(force[0]), fabs(force[1]), fabs(force[2])}, reached;
        for (int k = 0; k < count; k++) {
            const omniroll_axle_t *const axle = run->axles + places[k];
            resting.bounds[k] = broken[k] ? axle->sliding : axle->holding;
            for (int m = 0; m < 3; m++)
                most[m] += fabs(axle->row[m])*resting.bounds[k];
        }
        nearest_force(mass, force, &resting, work->facets, nu_dot, torques);
        for (int m = 0; m < 3; m++)
            reached[m] = (fabs(inverse[m][0])*most[0] + fabs(inverse[m][1])*most[1] + fabs(inverse[m][2])*most[2])
                / fabs(determinant);
        further = 0;
        for (int k = 0; k < count; k++) {
            const vector3_t row = {fabs(resting.rows[k][0]), fabs(resting.rows[k][1]), fabs(resting.rows[k][2])};
            rates[k] = dot3(resting.rows[k], nu_dot);
            moves[k] = fabs(rates[k]) > MOVES*dot3(row, reached);
            further |= moves[k] && !broken[k];
            broken[k] |= moves[k];
        }
    } while (further);
    for (int k = 0; k < count; k++) {
        omniroll_axle_t *const axle = run->axles + places[k];
        const int at_bound = -axle->released*torques[k] >= resting.bounds[k]*(1 - AT_BOUND);
        axle->mode = moves[k] ? (rates[k] > 0) - (rates[k] < 0) : at_bound ? axle->released : 0;
    }
}

/* The guards of turning axles: where their rates pass zero. They stand after those of the effects. */
static void guard_rates(omniroll_run_t *run)
{
    run->hold.guard_count = 0;
    for (int i = 0; i < run->axle_count; i++) {
        const omniroll_axle_t *const axle = run->axles + i;
        const int place = run->guard_count + run->hold.guard_count;
        double *const guard = run->guards + 6*place;
        if (axle->mode == 0)
            continue;
        guard[0] = guard[1] = 0;
        for (int k = 0; k < 3; k++)
            guard[2 + k] = -axle->mode*axle->row[k];
        guard[5] = size_of_rate(axle, run->nu);
        run->leads_to[2*place + 1] = i;
        run->hold.guard_count++;
    }
}

/* Rule 3: which of the resting axles stick. */
static void decide_resting(omniroll_run_t *run, const work_t *work)
{
    vector3_t force, mass[3];
    int released = 0, signs[MOST_WHEELS];
#ifdef LANES_HAS_MOMENTA
    wheel_momenta(run, work);
#endif
    mass_at_this_instant(run, work, mass);
    find_forces(run, work, force);
    for (int i = 0; i < run->axle_count; i++)
        released |= run->axles[i].released;
    hold(run, work, (const vector3_t *)mass);
    find_held_force(run, work);
    int overdone = released || facets_passed(run, work, signs);
    for (int round = 0; overdone && round <= run->axle_count; round++) {
        decide_in_rounds(run, work, (const vector3_t *)mass, force);
        hold(run, work, (const vector3_t *)mass);
        find_held_force(run, work);
        overdone = facets_passed(run, work, signs);
        if (overdone)
            release(run, signs);
    }
    for (int k = 0; k < 3; k++)
        run->hold.per_force[k] = run->hold.free ? 1/mass[k][k] : 0;
}

/* Which axles stick in the phase that starts now. */
static void decide(omniroll_run_t *run, const work_t *work)
{
    int resting = 0;
    put_to_rest(run);
    for (int i = 0; i < run->axle_count; i++)
        resting |= run->axles[i].resting;
    if (resting)
        decide_resting(run, work);
    else {
        run->hold = (omniroll_hold_t){.speed = run->hold.speed};
        turn_bearings(run);
    }
    guard_rates(run);
    find_torques(run);
    run->hold.undecided = 0;
}

/* Which axles stick from now on, where that must be decided anew. */
ALWAYS_INLINE void settle_axles(omniroll_run_t *run, const work_t *work)
{
    if (run->axle_count && run->hold.undecided)
        decide(run, work);
    run->hold.speed = fmax(run->hold.speed, length3(run->nu));
}

/* Turning axles whose rates have passed zero rest, and facets that are passed let go. Returns how many there are. */
static int pass_axles(omniroll_run_t *run, const work_t *work)
{
    int signs[MOST_WHEELS], count = facets_passed(run, work, signs);
    if (count)
        release(run, signs);
    for (int k = run->guard_count; k < all_guards(run); k++) {
        omniroll_axle_t *const axle = run->axles + run->leads_to[2*k + 1];
        if (run->passed[k] && !axle->resting) {         /* one that rests starts from rest in this phase     */
            axle->resting = run->hold.undecided = 1;
            count++;
        }
    }
    return count;
}

/* What an input is rounded against beside itself, several times: a torque that holds is what is left of others, and a
 * facet is passed by some roundings. */
ALWAYS_INLINE double size_of_held(const omniroll_run_t *run, int input)
{
    if (!run->axle_count || input/run->wheels != SET_BEARING_INPUT)
        return 0;
    return HELD_ROUNDINGS*length3(run->hold.size)/length3(run->axles[input%run->wheels].row);
}

/* Some time has passed. */
static void axles_have_moved(omniroll_run_t *run, const work_t *work)
{
    for (int i = 0; i < run->axle_count; i++) {
        run->axles[i].resting = run->axles[i].mode == 0;
        run->axles[i].released = 0;
    }
    find_held_force(run, work);
    find_torques(run);
}

/* An impact has changed nu. */
static void axles_have_jumped(omniroll_run_t *run, const double *before)
{
    vector3_t change;
    for (int k = 0; k < 3; k++)
        change[k] = run->nu[k] - before[k];
    for (int i = 0; i < run->axle_count; i++) {
        omniroll_axle_t *const axle = run->axles + i;
        const double rounding = EPS*(size_of_rate(axle, before) + size_of_rate(axle, run->nu));
        axle->resting &= fabs(dot3(axle->row, change)) <= AT_REST*rounding;
        axle->released = 0;
    }
    run->hold.undecided = 1;
}
#else
ALWAYS_INLINE void settle_axles(omniroll_run_t *run, const work_t *work)
{
    (void)run, (void)work;
}

ALWAYS_INLINE int pass_axles(omniroll_run_t *run, const work_t *work)
{
    (void)run, (void)work;
    return 0;
}

ALWAYS_INLINE double size_of_held(const omniroll_run_t *run, int input)
{
    (void)run, (void)input;
    return 0;
}
#endif
