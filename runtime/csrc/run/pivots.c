/* Wheels that stand on their joint: where the rollers on both sides of it push a wheel back (maxima/effects/joints.mac).
 *
 * A wheel begins to stand where it would pass on, and the next roller would send it back. It goes on where its roller, or the
 * next one, would take it from the joint: both are affine in nu, so that they are guards, behind all others. Each change is
 * met by the law of the run. */

/* What a guard is passed by: the roller in contact takes a wheel from its joint, or the next one; a swing turns (swings.c). */
enum { NOTHING, TO_HERE, TO_NEXT, BY_TURN };

/* One more guard behind all others; zeros. */
static double *add_pivot_guard(omniroll_run_t *run, int by, int wheel)
{
    const int place = all_guards(run), size = guard_size(run->wheels);
    double *const guard = run->acts.guards + size*place;
    memset(guard, 0, (size_t)size*sizeof *guard);
    run->acts.leads_to[2*place] = by, run->acts.leads_to[2*place + 1] = wheel;
    run->acts.pivot_guards++;
    return guard;
}

/* Wheels whose guards are passed go on from their joints, on the roller that takes them most. Returns how many. */
static int go_on_from_joints(const omniroll_run_t *run, int *directions, int *stance)
{
    double noise, largest[MAX_WHEELS];
    int count = 0;
    for (int i = 0; i < run->wheels; i++)
        largest[i] = -INFINITY;
    for (int k = all_guards(run) - run->acts.pivot_guards; k < all_guards(run); k++) {
        const int by = (int)run->acts.leads_to[2*k], wheel = (int)run->acts.leads_to[2*k + 1];
        const double value = guard_value(run, run->acts.guards + guard_size(run->wheels)*k, &noise);
        if (by == BY_TURN || !run->acts.passed[k] || value <= largest[wheel])
            continue;
        count += stance[wheel] == STAYS;
        stance[wheel] = GOES, largest[wheel] = value;
        directions[wheel] = by == TO_HERE ? 0 : run->state.chi[wheel] < 0 ? -1 : 1;
    }
    return count;
}

/* The guards of the wheels that stand: two of each, by its roller and by the next one. */
static void guard_pivots(omniroll_run_t *run, const work_t *work)
{
    double rows[2][3*MAX_WHEELS];
    int count = 0;
    for (int i = 0; i < run->wheels; i++)
        count += pivots(run, i);
    run->acts.pivot_guards = 0;
    if (!count)
        return;
    rows_of_both(run, work, rows[0], rows[1]);
    for (int i = 0; i < run->wheels; i++)
        for (int next = 0; pivots(run, i) && next < 2; next++) {
            const double outward = run->state.chi[i] < 0 ? -1 : 1;
            double *const guard = add_pivot_guard(run, TO_HERE + next, i);
            for (int k = 0; k < 3; k++)
                guard[2 + k] = (next ? outward : -outward)*rows[next][3*i + k];
        }
}

/* Wheels that stop at their joint, which then do not pass on, and wheels that go on from there. Returns how many do. */
static int pivots_change(omniroll_run_t *run, const work_t *work, int *directions, int *stance)
{
    double rows_here[3*MAX_WHEELS], rows_next[3*MAX_WHEELS];
    int count = 0, some = 0;
    for (int i = 0; i < run->wheels; i++) {
        stance[i] = STAYS;
        some |= directions[i] || pivots(run, i);
    }
    if (!some)
        return 0;
    rows_of_both(run, work, rows_here, rows_next);
    for (int i = 0; i < run->wheels; i++) {
        if (directions[i] && directions[i]*rate_by(rows_next + 3*i, run->state.nu) < 0)
            stance[i] = STOPS, directions[i] = 0;
    }
    guards_passed(run, work);
    return count + go_on_from_joints(run, directions, stance);
}

/* Rows change: of wheels that pass on, whose contact has its number already, and of those that stop or go on. excess: the
 * wheels' rates beyond those that what carries now demands of them. */
static void change_rows(omniroll_run_t *run, const work_t *work, const int *directions, const int *stance, change_t *c)
{
    lanes_t demanded[MAX_WHEELS];
    rolling_wheels(run->wheels, &work->vehicle, c->nu, c->before, c->excess);
    for (int i = 0; i < run->wheels; i++)
        if (SET_PIVOTS && !directions[i])
            run->state.contact[i] += ((stance[i] == STOPS) - (stance[i] == GOES))*run->rollers_per_wheel;
    carry_rows(run, work);
    rolling_wheels(run->wheels, &work->vehicle, c->nu, c->after, demanded);
    for (int i = 0; i < run->wheels; i++)
        c->excess[i] -= demanded[i];
}
