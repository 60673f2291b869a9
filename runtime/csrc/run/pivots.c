/* Wheels that stand on their joint: where the rollers on both sides of it push a wheel back (maxima/effects/joints.mac).
 *
 * A wheel begins to stand where it would pass on, and the next roller would send it back. It goes on where its roller, or the
 * next one, would take it from the joint: both are affine in nu, so that they are guards, behind all others. Each change is
 * met by the law of the run. */

/* The guards of the wheels that stand: two of each, by its roller and by the next one. */
static void guard_pivots(omniroll_run_t *run, const work_t *work)
{
    double rows[2][3*MOST_WHEELS];
    const int size = guard_size(run->wheels);
    int count = 0;
    for (int i = 0; i < run->wheels; i++)
        count += pivots(run, i);
    run->pivot_guards = 0;
    if (!count)
        return;
    rows_of_both(run, work, rows[0], rows[1]);
    for (int i = 0; i < run->wheels; i++)
        for (int next = 0; pivots(run, i) && next < 2; next++) {
            const double outward = run->chi[i] < 0 ? -1 : 1;
            const int place = all_guards(run);
            double *const guard = run->guards + size*place;
            memset(guard, 0, (size_t)size*sizeof *guard);
            for (int k = 0; k < 3; k++)
                guard[2 + k] = (next ? outward : -outward)*rows[next][3*i + k];
            run->leads_to[2*place] = next, run->leads_to[2*place + 1] = i;
            run->pivot_guards++;
        }
}

/* Wheels that stop at their joint, which then do not pass on, and wheels that go on from there. Returns how many do. */
static int pivots_change(omniroll_run_t *run, const work_t *work, int *directions, int *stance)
{
    double here[3*MOST_WHEELS], there[3*MOST_WHEELS], noise, most[MOST_WHEELS];
    int count = 0, some = 0;
    for (int i = 0; i < run->wheels; i++) {
        stance[i] = STAYS, most[i] = -INFINITY;
        some |= directions[i] || pivots(run, i);
    }
    if (!some)
        return 0;
    rows_of_both(run, work, here, there);
    for (int i = 0; i < run->wheels; i++) {
        if (directions[i] && directions[i]*rate_by(there + 3*i, run->nu) < 0)
            stance[i] = STOPS, directions[i] = 0;
    }
    guards_passed(run, work);
    for (int k = all_guards(run) - run->pivot_guards; k < all_guards(run); k++) {
        const int wheel = (int)run->leads_to[2*k + 1];
        const double value = guard_value(run, run->guards + guard_size(run->wheels)*k, &noise);
        if (!run->passed[k] || value <= most[wheel])
            continue;
        count += stance[wheel] == STAYS;
        stance[wheel] = GOES, most[wheel] = value;
        directions[wheel] = !run->leads_to[2*k] ? 0 : run->chi[wheel] < 0 ? -1 : 1;
    }
    return count;
}

/* Rows change: of wheels that pass on, whose contact has its number already, and of those that stop or go on. excess: the
 * wheels' rates beyond those that what carries now demands of them. */
static void change_rows(omniroll_run_t *run, const work_t *work, const int *directions, const int *stance, change_t *c)
{
    lanes_t demanded[MOST_WHEELS];
    rolling_wheels(run->wheels, &work->vehicle, c->nu, c->before, c->excess);
    for (int i = 0; i < run->wheels; i++)
        if (SET_PIVOTS && !directions[i])
            run->contact[i] += ((stance[i] == STOPS) - (stance[i] == GOES))*run->rollers_per_wheel;
    carry_rows(run, work);
    rolling_wheels(run->wheels, &work->vehicle, c->nu, c->after, demanded);
    for (int i = 0; i < run->wheels; i++)
        c->excess[i] -= demanded[i];
}

/* What happens at joints at this instant: wheels that pass on, and wheels that stop there or go on. Returns how many. */
static int changing_wheels(omniroll_run_t *run, const work_t *work, int *directions, int *stance)
{
    int count = switching_wheels(run, work, run->elapsed - run->phase_start, directions);
    if (SET_SHARES)
        count += swings_change(run, work, directions, stance);
    else if (SET_PIVOTS)
        count += pivots_change(run, work, directions, stance);
    return count;
}
