/* Rollers that stick on their disks where wheels may slip: their spins at the nodes, and behind a switch. own_bearings.c
 * has what they have in common with axles, rollers_in_series.c which massless ones stick. */
/* At a vector of nodes what holds the bearings that stick, from the last evaluation, and the spins of rollers that turn on
 * their disks. */
ALWAYS_INLINE void keep_own(step_t *s, const int wheels, int b, const arrays_t *at)
{
    const own_bearings_t *const own = s->own;
    own_rates_in_lanes(own, s->vehicle, wheels, at->nu, at->chi, core_at(s, b), own->rate);
    for (int k = 0; k < s->own_count; k++)
        own->held[k].lanes[b] = is_spin(s, k) ? own->rate[k] : own->holding[k];
}

/* Rollers that stick turn with their disks at the step's end, as in the row (keep_rollers_at_rest). */
static void rollers_at_rest_at_end(const step_t *s, const int wheels, const arrays_t *at)
{
    const own_bearings_t *const own = s->own;
    if (!SET_DISKS_STICK)
        return;
    own_rates_in_lanes(own, s->vehicle, wheels, at->nu, at->chi, s->core_here, own->rate);
    for (int k = own->rollers_at; k < s->own_count; k++)
        if (s->own_bearing[k].mode == 0)
            s->core_here[own_rates_at(wheels) + k] -= own->rate[k];
}

/* Wheels have passed to their next rollers: each bearing goes with its roller to the next place. */
static void rollers_have_switched(const omniroll_run_t *run, const int *directions)
{
    omniroll_bearing_t *const contact = own_bearings(run) + (SET_AXLES_STICK ? run->wheels : 0);
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

/* Rollers that stick turn with their disks: what rounding and the iteration have left of their spins is taken away. */
static void keep_rollers_at_rest(const omniroll_run_t *run, const work_t *work)
{
    find_own_rates(run, work);
    for (int k = work->own.rollers_at; k < run->own_count; k++)
        if (own_bearings(run)[k].resting)
            put_own_rate(run, work, k, 0);
}
