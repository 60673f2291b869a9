/* Rollers that stick on their disks where wheels may slip: their spins at the nodes, and behind a switch. core_bearings.c
 * has what they have in common with axles, rollers_in_series.c which massless ones stick. */
/* At a vector of nodes what holds the bearings that stick, from the last evaluation, and the spins of rollers that turn on
 * their disks. */
ALWAYS_INLINE void keep_bearings(step_t *s, const int wheels, int b, const arrays_t *at)
{
    const bearing_states_t *const states = s->hold.states;
    bearing_rates_in_lanes(states, s->vehicle, wheels, at->nu, at->chi, core_at(s, b), states->rate);
    for (int k = 0; k < s->hold.count; k++)
        states->held[k].lanes[b] = is_spin(s, k) ? states->rate[k] : states->holding[k];
}

/* Rollers that stick turn with their disks at the step's end, as in the row (keep_rollers_at_rest). */
static void rollers_at_rest_at_end(const step_t *s, const int wheels, const arrays_t *at)
{
    const bearing_states_t *const states = s->hold.states;
    if (!SET_DISKS_STICK)
        return;
    bearing_rates_in_lanes(states, s->vehicle, wheels, at->nu, at->chi, s->core_here, states->rate);
    for (int k = states->rollers_at; k < s->hold.count; k++)
        if (s->hold.bearing[k].mode == 0)
            s->core_here[bearing_rates_at(wheels) + k] -= states->rate[k];
}

/* Wheels have passed to their next rollers: each bearing goes with its roller to the next place. */
static void rollers_have_switched(const omniroll_run_t *run, const int *directions)
{
    omniroll_bearing_t *const contact = core_bearings(run) + (SET_AXLES_STICK ? run->wheels : 0);
    const int places = run->rollers_per_wheel - 1;
    for (int i = 0; i < run->wheels; i++) {
        omniroll_bearing_t *const free = contact + run->wheels + i*places, before = contact[i];
        if (directions[i] > 0) {
            contact[i] = free[places - 1];
            memmove(free + 1, free, (size_t)(places - 1)*sizeof *free);
            free[0] = before;
        } else if (directions[i] < 0) {
            contact[i] = free[0];
            memmove(free, free + 1, (size_t)(places - 1)*sizeof *free);
            free[places - 1] = before;
        }
    }
}

/* Rollers that stick turn with their disks: the residual of rounding and of the iteration in their spins is removed. */
static void keep_rollers_at_rest(const omniroll_run_t *run, const work_t *work)
{
    find_bearing_rates(run, work);
    for (int k = work->states.rollers_at; k < run->bearings.core_count; k++)
        if (core_bearings(run)[k].resting)
            put_bearing_rate(run, work, k, 0);
}

/* Some time has passed: bearings that stick are at rest. What an iteration leaves of the rates of axles would turn
 * slips where wheels may stand. */
static void bearings_have_stuck(omniroll_run_t *run, const work_t *work)
{
    for (int k = 0; k < run->bearings.count; k++) {
        omniroll_bearing_t *const bearing = run->bearings.each + k;
        bearing->resting = bearing->mode == 0;
        bearing->released = 0;
        if (SET_STANDS && k < work->states.rollers_at && bearing->resting)
            run->state.core[rates_at(run->wheels) + k] = 0;
    }
    if (SET_DISKS_STICK)
        keep_rollers_at_rest(run, work);
    else if (SET_STANDS)
        find_bearing_rates(run, work);
}
