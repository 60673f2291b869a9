/* How deviations pass where contacts and bearings change their modes: the saltation. With what has come to rest taken
 * away (rests.c), and the rates f* while it stays at rest,
 *
 *     d* = d- - R W^+ ds,    d+ = d* + (f* - f+) dt
 *
 * where dt is by how much the time deviates. Where drives jump it is that of the jump. Of what turns back at once, or
 * on behind a rest, it is that of the rest, dt = -ds/s', where slips are measured along their directions. Where
 * nothing comes to rest d* is d-, and f* is f-: the time is that of what lets go (letting_go.c).
 *
 * Where a wheel that stands is at its bound or lets go whose forces are not determined, where something only just
 * happens, or several things do apart beside the run, there is no derivative. */

/* Whether a roller that stops on its disk while its contact slips only just does, and its bearing holds more than it
 * takes; or one turns back there. The rates before have been computed last. */
static int settles_only_just(const variations_t *w, const change_t *e, const lanes_t *before, const double *dot)
{
    const omniroll_variations_t *const run = w->run;
    const lanes_t *const falls = point_of(w, w->vehicle, w->along).contact_spin;
    int found = 0;
    if (!SET_STRIPS)
        return 0;
    move_along(w, e->row, TIMES_ALONE, before);
    for (int i = 0; i < w->wheels; i++) {
        const int k = roller_bearing(w, i, 0);
        const double possible = fabs(dot[2*w->wheels + k]) + run->bearings.bound[k]/run->bearings.inertia[k];
        const double mode = (double)bearing_mode(w, e->before, k);
        const int holds_more = run->bearings.bound[k] > (1 + run->bounds.jumps)*run->bearings.sliding[k];
        found |= mode != 0 && bearing_mode(w, e->after, k) == -bearing_mode(w, e->before, k) && !is_held(w, e, k);
        found |= settles(w, e, k) && !sticks_in(w, e->row, i) && holds_more
            && -mode*falls[i][0] <= run->bounds.only_just*possible;
    }
    clear_tangent(w);
    return found;
}

/* Massless rollers break away, each at its time: under a smooth law the force of a wheel goes with the mode of its
 * roller alone, and what it does to the rates adds to what others do. */
static int pass_one_by_one(variations_t *w, const change_t *e, const int *unit, int count, const lanes_t *moved,
                           const double *rises, const lanes_t *before)
{
    double time[w->columns], dot[UNITS(w)], demand[BEARINGS(w)];
    lanes_t after[w->size];
    for (int j = 0; j < count; j++) {
        const change_t one = {e->row, e->before, e->after, 0, 1 + unit[j] - 2*w->wheels};
        rates_of_change(w, &one, AFTER, after, dot, demand);
        put_times_of_zeros(w, moved + j*w->groups, rises + j, 1, time);
        add_jump(w, before, after, time);
    }
    return 1;
}

/* Pass what lets go, from the rates `before`, which have been computed last, to those `after`. */
static int pass_let_go(variations_t *w, const change_t *e, const lanes_t *before, const lanes_t *after)
{
    int unit[UNITS(w)];
    double rises[UNITS(w)], time[w->columns];
    held_t held;
    if (are_same(w, before, after))
        return 1;
    if (e->knot) {
        add_jump(w, before, after, e->knot);
        return 1;
    }
    if (SET_BEARINGS_STICK && step_before(w, e->row) < 0)     /* no step has said yet how inputs deviate          */
        return 0;
    find_held(w, e, BEFORE, w->vehicle, &held);
    if (SET_STANDS && !held.is_only)
        return 0;
    const int count = keep_reached(w, e, before, unit, list_let_go(w, e, unit), rises);
    lanes_t moved[count*w->groups + 1];
    if (!count)
        return 0;
    put_uses_moved(w, e, before, unit, count, moved);
    if (SET_SERIES_ALONE && unit[0] >= 2*w->wheels + roller_bearing(w, 0, 0))
        return pass_one_by_one(w, e, unit, count, moved, rises, before);
    if (!put_times_of_zeros(w, moved, rises, count, time))
        return 0;
    add_jump(w, before, after, time);
    return 1;
}

/* Whether drives that jump where something comes to rest do so at that time beside the run as well. */
static int is_knot(const variations_t *w, const change_t *e, const double *time)
{
    for (int p = 0; p < w->columns && e->knot; p++)
        if (fabs(e->knot[p] - time[p]) > LETS_GO_TOGETHER*fmax(fabs(e->knot[p]), fabs(time[p])))
            return refuse(w, HAPPENS_APART, p);
    return 1;
}

/* Pass what comes to rest, from the rates before, which have been computed last, to those while it rests and `after`;
 * `on`: whether something turns on behind that. */
static int pass_rests(variations_t *w, const change_t *e, const resting_t *rests, int on, const double *dot,
                      const lanes_t *resting, const lanes_t *after)
{
    double time[w->columns];
    if (!put_directions_right(w, e))
        return 0;
    if (on && (!put_times_of_stops(w, rests, dot, time) || !is_knot(w, e, time)) && !are_same(w, resting, after))
        return 0;
    take_rests(w, e, rests);
    if (on)
        add_jump(w, resting, after, time);
    return 1;
}

/* Pass a change of modes. Returns whether it was one of those above; else nothing has been done. */
static int pass_change(variations_t *w, const change_t *e)
{
    double dot[UNITS(w)], demand[BEARINGS(w) + 1];
    int unit[UNITS(w)], go[UNITS(w)];
    lanes_t before[w->size], resting[w->size], after[w->size];
    const resting_t rests = list_resting(w, e, unit);
    const int gone = list_let_go(w, e, go), goes_on = rests.count ? what_goes_on(w, e) : 0;
    const int on = goes_on || (rests.count && e->knot);
    if ((rests.count && gone && go[0] < 2*w->wheels) || (rests.contacts && goes_on & TURNS_ON))
        return 0;
    if (rests.contacts)
        aim_rests(w, e->row);
    rates_of_change(w, e, AFTER, after, dot, demand);
    if (is_at_bound(w, e))
        return 0;
    if (on)
        rates_of_change(w, e, RESTING, resting, dot, demand);
    rates_of_change(w, e, BEFORE, before, dot, demand);
    if (settles_only_just(w, e, before, dot))
        return 0;
    if (!rests.count)
        return pass_let_go(w, e, before, after);
    return (e->knot || !rest_grazes(w, &rests, dot, demand)) && pass_rests(w, e, &rests, on, dot, resting, after);
}

/* Let all that sticks in a row take what it does from the deviations there, as if it came to rest then. */
static void take_what_sticks(variations_t *w, long long row)
{
    const change_t e = {row, NONE, row, 0, 0};
    int unit[UNITS(w)];
    double dot[UNITS(w)], demand[BEARINGS(w) + 1];
    resting_t rests = {.unit = unit};
    lanes_t rate[w->size];
    for (int k = 0; k < BEARINGS(w); k++)
        if (bearing_mode(w, row, k) == 0)
            unit[rests.count++] = 2*w->wheels + k;
    if (!rests.count)
        return;
    rates_of_change(w, &e, BEFORE, rate, dot, demand);
    take_rests(w, &e, &rests);
}
