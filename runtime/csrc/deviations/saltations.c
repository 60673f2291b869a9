/* How deviations pass where contacts and bearings change their modes: the saltation. With what has come to rest taken
 * away (rests.c), and the rates f* while it stays at rest,
 *
 *     d* = d- - R W^+ ds,    d+ = d* + (f* - f+) dt
 *
 * where dt is by how much the time deviates. Where drives jump it is that of the jump. Of what turns back at once, or on
 * behind a rest, it is that of the rest, dt = -ds/s', where slips are measured along their directions. Where nothing comes
 * to rest d* is d-, and f* is f-: the time is that of what lets go (letting_go.c), or of slips that turn back through
 * zero, along the rolling direction alone.
 *
 * Where a wheel that stands is at its bound or lets go whose forces are not determined, where something only just happens,
 * or several things do apart beside the run, there is no derivative. */

#if SET_GRIPS
/* List the components of such slips behind a row. Returns how many. */
static int list_turns_back(const variations_t *w, long long row, int *component)
{
    int count = 0;
    for (int i = 0; i < w->wheels; i++)
        if (turns_back(w, row, i))
            component[count++] = 2*i + 1;
    return count;
}

/* Pass that in a row, whose rates `before` have been computed last. Returns whether it happens together beside the run
 * as well, and no slip only just comes to zero; else nothing has been done. */
static int pass_turns_back(variations_t *w, const int *component, int count, const lanes_t *before,
                           const lanes_t *after)
{
    const lanes_t *const slip_dot = point_of(w, w->vehicle, w->point).slip_dot;
    lanes_t moved[count*w->groups];
    double rate[count], time[w->columns];
    if (grazes_rest(w, component, count))
        return 0;
    for (int k = 0; k < count; k++)
        rate[k] = slip_dot[component[k]][0];
    put_slips_moved(w, component, count, moved);
    if (!put_times_of_zeros(w, moved, rate, count, time))
        return 0;
    add_jump(w, before, after, time);
    return 1;
}
#endif

/* Whether a roller that stops on its disk while its contact slips only just does, and its bearing holds more than it
 * takes; or one turns back there. The rates before have been computed last. */
static int settles_only_just(const variations_t *w, const change_t *e, const lanes_t *before, const double *dot)
{
    int found = 0;
#if SET_STRIPS
    const omniroll_variations_t *const run = w->run;
    move_along(w, e->row, TIMES_ALONE, before);
    const lanes_t *const falls = point_of(w, w->vehicle, w->along).contact_spin;
    for (int i = 0; i < w->wheels; i++) {
        const int k = roller_bearing(w, i, 0);
        const double possible = fabs(dot[k]) + run->own_most[k]/run->own_inertia[k];
        const double mode = (double)own_mode(w, e->before, k);
        found |= mode != 0 && own_mode(w, e->after, k) == -own_mode(w, e->before, k) && !is_held(w, e, k);
        found |= settles(w, e, k) && !sticks_in(w, e->row, i) && jumps_as_it_goes(w, k)
            && -mode*falls[i][0] <= run->only_just*possible;
    }
    take_way_back(w);
#endif
    (void)w, (void)e, (void)before, (void)dot;
    return found;
}

/* Massless rollers break away, each at its time: under a smooth law the force of a wheel goes with the mode of its roller
 * alone, and what it does to the rates adds to what others do. */
static int pass_one_by_one(variations_t *w, release_t *release, const int *unit, int count, const double *rises)
{
    const change_t *const e = release->change;
    double time[count*w->columns], dot[MOST_OWN(w)], asked[MOST_OWN(w)];
    lanes_t after[w->size];
    for (int j = 0; j < count; j++)
        put_times_of_release(w, release, unit + j, 1, rises + j, time + j*w->columns);
    for (int j = 0; j < count; j++) {
        const change_t one = {e->row, e->before, e->after, 0, 1 + unit[j] - 2*w->wheels};
        rates_of_change(w, &one, AFTER, after, dot, asked);
        add_jump(w, release->before, after, time + j*w->columns);
    }
    return 1;
}

/* Pass what lets go, from the rates `before`, which have been computed last, to those `after`. */
static int pass_let_go(variations_t *w, const change_t *e, const lanes_t *before, const lanes_t *after)
{
    int unit[w->wheels + MOST_OWN(w)];
    double rises[w->wheels + MOST_OWN(w)], time[w->columns];
    release_t release = {.change = e, .before = before};
    if (are_same(w, before, after))
        return 1;
    if (e->knot) {
        add_jump(w, before, after, e->knot);
        return 1;
    }
    if (SET_OWN_BEARINGS && step_before(w, e->row) < 0)     /* no step has said yet how inputs deviate          */
        return 0;
#if SET_STANDS
    if (!find_held(w, e, &release.held))
        return 0;
#endif
    const int count = keep_reached(w, &release, unit, list_let_go(w, e, unit), rises);
    if (SET_SERIES_ALONE && count && unit[0] >= 2*w->wheels + roller_bearing(w, 0, 0))
        return pass_one_by_one(w, &release, unit, count, rises);
    if (!count || !put_times_of_release(w, &release, unit, count, rises, time))
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
    if (on && rests->contacts && !put_directions_right(w, e, rests))
        return 0;
    if (on && (!put_times_of_stops(w, rests, dot, time) || !is_knot(w, e, time)) && !are_same(w, resting, after))
        return 0;
    if (!take_rests(w, e, rests))
        return 0;
    if (on)
        add_jump(w, resting, after, time);
    return 1;
}

/* Pass a change of modes. Returns whether it was one of those above; else nothing has been done. */
static int pass_change(variations_t *w, const change_t *e)
{
    const int bearings = MOST_OWN(w);
    double dot[bearings + 1], asked[bearings + 1];
    int unit[MOST_COMPONENTS + bearings], go[w->wheels + bearings], back = 0;
    lanes_t before[w->size], resting[w->size], after[w->size];
    const resting_t rests = list_resting(w, e, unit);
    const int gone = list_let_go(w, e, go), turn = rests.count && some_turn_on(w, e), slip = some_go_on(w, e);
    const int on = turn || slip || (rests.count && e->knot);
#if SET_GRIPS
    int turned[MOST_WHEELS];
    back = e->after > e->row ? list_turns_back(w, e->row, turned) : 0;
#endif
    if ((back && rests.count) || (rests.count && gone && go[0] < 2*w->wheels) || (rests.contacts && turn))
        return 0;
#if SET_GRIPS
    if (rests.contacts)
        aim_rests(w, e->row);
#endif
    rates_of_change(w, e, AFTER, after, dot, asked);
    if (is_at_bound(w, e, asked))
        return 0;
    if (on)
        rates_of_change(w, e, RESTING, resting, dot, asked);
    rates_of_change(w, e, BEFORE, before, dot, asked);
    if (settles_only_just(w, e, before, dot))
        return 0;
#if SET_GRIPS
    if (back)
        return pass_turns_back(w, turned, back, before, after);
#endif
    if (!rests.count)
        return pass_let_go(w, e, before, after);
    return (e->knot || !rest_grazes(w, &rests, dot, asked)) && pass_rests(w, e, &rests, on, dot, resting, after);
}

#if SET_HOLDS
/* Let all that sticks in a row take what it does from the deviations there, as if it came to rest then. */
static void take_what_sticks(variations_t *w, long long row)
{
    const change_t e = {row, NONE, row, 0, 0};
    const int bearings = MOST_OWN(w);
    int unit[bearings + 1];
    double dot[bearings + 1], asked[bearings + 1];
    resting_t rests = {.unit = unit};
    lanes_t rate[w->size];
    for (int k = 0; k < bearings; k++)
        if (own_mode(w, row, k) == 0)
            unit[rests.count++] = 2*w->wheels + k;
    if (!rests.count)
        return;
    rates_of_change(w, &e, BEFORE, rate, dot, asked);
    take_rests(w, &e, &rests);
}
#endif
