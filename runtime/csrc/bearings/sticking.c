/* Bearings that stick: a mode for each axle and each roller in contact, and what holds those that stick. */
ALWAYS_INLINE double *bearing_input(const omniroll_run_t *run, int bearing)
{
    const int of_axle = bearing < run->bearings.axle_count;
    const int kind = of_axle ? SET_BEARING_INPUT : SET_CONTACT_BEARING_INPUT;
    return run->acts.inputs + kind*run->wheels + (of_axle ? bearing : bearing - run->bearings.axle_count);
}

/* What the rate of a bearing is rounded against: nu is a difference of larger numbers, each of about its length. */
ALWAYS_INLINE double size_of_rate(const omniroll_bearing_t *bearing, const double *nu)
{
    return length3(bearing->row)*length3(nu);
}

/* How much larger than where chi is 0 the rates of the rollers in contact are now. */
static void find_nearer(omniroll_run_t *run, const work_t *work)
{
    double nearer[MAX_WHEELS], per_chi[MAX_WHEELS];
    if (!SET_ROLLERS_STICK || rows_count(run) == run->bearings.axle_count)
        return;
    omniroll_bearing_t *const contacts = run->bearings.each + run->bearings.axle_count;
    nearer_at(run->wheels, &work->vehicle, contacts, run->joint, run->state.chi, nearer, per_chi);
    for (int i = 0; i < run->wheels; i++)
        contacts[i].nearer = nearer[i];
}

/* Bearings whose rates are zero within rounding rest. A phase may end on a joint where all rates come to zero: what
 * remains is rounding of what nu has been. */
static void find_resting(omniroll_run_t *run, const work_t *work)
{
    const double speed = fmax(length3(run->state.nu), run->hold.speed);
    for (int i = 0; i < rows_count(run); i++) {
        omniroll_bearing_t *const bearing = run->bearings.each + i;
        bearing->resting |= fabs(dot3(bearing->row, run->state.nu)) <= AT_REST*EPS*length3(bearing->row)*speed;
    }
    if (SET_SPINS_STICK)
        find_resting_bearings(run, work, speed, INFINITY);
}

/* Those of the bearings whose mode or rest is this one, with their torques at rest; their places. `at_zero`: with the
 * rows that they have where chi is 0. */
static int bearings_of(const omniroll_run_t *run, int sticking, int at_zero, bearings_t *bearings, int *places)
{
    bearings->count = 0;
    for (int i = 0; i < rows_count(run); i++) {
        const omniroll_bearing_t *const bearing = run->bearings.each + i;
        if (!(sticking ? bearing->mode == 0 : bearing->resting))
            continue;
        places[bearings->count] = i;
        bearings->bounds[bearings->count] = bearing->holding;
        for (int k = 0; k < 3; k++)
            bearings->rows[bearings->count][k] = bearing->row[k]*(at_zero ? 1 : bearing->nearer);
        bearings->count++;
    }
    return bearings->count;
}

/* The rates of resting bearings become zero, and the others turn. */
static void put_to_rest(omniroll_run_t *run, const work_t *work)
{
    bearings_t bearings;
    vector3_t basis[3];
    int places[MAX_BEARINGS];
    find_resting(run, work);
    bearings_of(run, 0, 1, &bearings, places);
    const int rank = span_of(&bearings, basis);
    take_across(rank, (const vector3_t *)basis, run->state.nu);
    if (rank == 3)
        memset(run->state.nu, 0, sizeof(vector3_t));
    find_resting(run, work);
    if (length3(run->state.nu) == 0)
        run->hold.speed = 0;
    for (int i = 0; i < rows_count(run); i++) {
        omniroll_bearing_t *const bearing = run->bearings.each + i;
        const double rate = dot3(bearing->row, run->state.nu);
        bearing->mode = bearing->resting ? 0 : (rate > 0) - (rate < 0);
    }
    if (SET_SPINS_STICK)
        put_bearings_to_rest(run, work);
}

/* The torques of the bearings that turn; 0 of those that stick. */
static void turn_bearings(const omniroll_run_t *run, const work_t *work)
{
    for (int i = 0; i < rows_count(run); i++)
        *bearing_input(run, i) = -run->bearings.each[i].mode*run->bearings.each[i].sliding;
    if (SET_SPINS_STICK)
        enter_bearings(run, work, 1);
}

/* Bearings that stick, as what wheels that stand are held by: torques are forces at an arm of 1, and where chi is not 0 of
 * a roller in contact at a shorter one. */
static void put_standing(const omniroll_run_t *run, standing_t *standing)
{
    standing->count = standing->rows.count;
    standing->radius = -1, standing->arm = 1, standing->max_holding = 0;
    for (int d = 0; d < standing->count; d++) {
        const int of_axle = standing->bearing[d] < run->bearings.axle_count;
        standing->wheel[d] = standing->bearing[d] - (of_axle ? 0 : run->bearings.axle_count);
        standing->direction[d] = of_axle;
        standing->holding[d] = standing->rows.bounds[d];
        standing->max_holding = fmax(standing->max_holding, standing->holding[d]);
    }
    memset(standing->used_by, 0, sizeof *standing->used_by*(size_t)standing->count);
}

/* What a use is rounded to by the terms of the force: each as much as forces of least norm use for it. */
static void round_use(const omniroll_run_t *run, const work_t *work)
{
    standing_t *const standing = work->standing;
    demand_t now;
    double forces[MAX_STANDING];
    demand_now(run, work, &now);
    standing->rounding = 0;
    for (int k = 0; k < 3 && standing->count; k++) {
        for (int m = 0; m < 3; m++)
            now.force[m] = m == k ? run->hold.size[k] : 0;
        least_norm(&standing->rows, now.force, forces);
        standing->rounding += EPS*largest_use(standing, &now, forces);
    }
}

/* What sticks with the present modes. */
static void hold(omniroll_run_t *run, const work_t *work)
{
    omniroll_hold_t *const held = &run->hold;
    vector3_t mass[3];
    mass_at_this_instant(run, work, mass);
    held->count = bearings_of(run, 1, 1, &work->standing->rows, work->standing->bearing);
    held->free = directions_allowed(&work->standing->rows, (const vector3_t *)mass, held->directions, held->absent);
    for (int k = 0; k < 3; k++)
        held->per_force[k] = held->free < 3 && held->free ? 1/mass[k][k] : 0;
    put_standing(run, work->standing);
    round_use(run, work);
    for (int i = rows_count(run); i < run->bearings.count; i++)
        held->count += run->bearings.each[i].mode == 0;
    turn_bearings(run, work);
}

/* The torques of the bearings with this held force: of least norm where they hold. */
static void find_torques(omniroll_run_t *run, const work_t *work)
{
    bearings_t sticking;
    int places[MAX_BEARINGS];
    double torques[MAX_BEARINGS];
    for (int i = 0; i < rows_count(run); i++)
        run->bearings.each[i].torque = *bearing_input(run, i);
    if (!bearings_of(run, 1, 0, &sticking, places))
        return;
    least_torques(&sticking, run->hold.force, work->problem, torques);
    for (int k = 0; k < sticking.count; k++)
        run->bearings.each[places[k]].torque = torques[k];
}

/* All generalised forces but those of the bearings at rest, and the sums of the sizes of their terms. */
static void find_forces(omniroll_run_t *run, const work_t *work, double *force)
{
    omniroll_hold_t *const held = &run->hold;
    held->count = 1, held->free = 0;                    /* nothing may move */
    memset(held->directions, 0, sizeof held->directions);
    for (int k = 0; k < 3; k++)
        held->absent[k] = 1;
    for (int i = 0; i < rows_count(run); i++)
        *bearing_input(run, i) = 0;
    if (SET_SPINS_STICK)
        enter_bearings(run, work, 0);
    find_holding(run, work);
    for (int k = 0; k < 3; k++)
        held->size[k] = fabs(held->force[k]), force[k] = -held->force[k];
    for (int i = 0; i < rows_count(run); i++) {
        const omniroll_bearing_t *const bearing = run->bearings.each + i;
        double drives = 0;
        for (int input = 0; input < SET_INPUTS && i < run->bearings.axle_count; input++)
            drives += fabs(input_now(run, input*run->wheels + i));
        for (int k = 0; k < 3; k++)
            held->size[k] += fabs(bearing->row[k])*drives;
        add3(force, -bearing->mode*bearing->sliding*bearing->nearer, bearing->row);     /* 0 of those that rest */
    }
}

/* What rests is about to be decided: its problem, in which all of it sticks. */
static void begin_deciding_rolling(omniroll_run_t *run, const work_t *work)
{
    vector3_t force, mass[3];
    mass_at_this_instant(run, work, mass);
    find_forces(run, work, force);
    list_at_rest(run, work);
    put_problem_of_rolling(run, work, (const vector3_t *)mass, force);
}

/* The guards of turning bearings: where their rates pass zero. They stand after those of the effects. */
static void guard_rates(omniroll_run_t *run, const work_t *work)
{
    run->hold.guard_count = 0;
    for (int i = 0; i < rows_count(run); i++) {
        const omniroll_bearing_t *const bearing = run->bearings.each + i;
        const int place = run->acts.guard_count + run->hold.guard_count;
        double *const guard = run->acts.guards + 6*place;
        if (bearing->mode == 0)
            continue;
        guard[0] = guard[1] = 0;
        for (int k = 0; k < 3; k++)
            guard[2 + k] = -bearing->mode*bearing->row[k];
        guard[5] = size_of_rate(bearing, run->state.nu);
        run->acts.leads_to[2*place + 1] = i;
        run->hold.guard_count++;
    }
    if (SET_SPINS_STICK)
        size_bearings(run, work);
}

/* An impact has changed nu. Where rollers stick it has numbered them anew: what rests is seen from the rates. */
static void bearings_have_jumped(omniroll_run_t *run, const double *before)
{
    vector3_t change;
    for (int k = 0; k < 3; k++)
        change[k] = run->state.nu[k] - before[k];
    for (int i = 0; i < run->bearings.count; i++) {
        omniroll_bearing_t *const bearing = run->bearings.each + i;
        const double rounding = EPS*(size_of_rate(bearing, before) + size_of_rate(bearing, run->state.nu));
        bearing->resting &= !SET_ROLLERS_STICK && fabs(dot3(bearing->row, change)) <= AT_REST*rounding;
        bearing->released = 0;
    }
    run->hold.undecided = 1;
}
