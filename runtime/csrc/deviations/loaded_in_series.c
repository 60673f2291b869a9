/* How deviations pass where massless rollers and axles change their modes under loads that follow the motion, on ground
 * under a smooth law. A roller has no inertia, and where loads move what the ground asks of it others may let go, or
 * stop, at the same instant. All of that happens at the time of what has come about by itself: an axle that comes to
 * rest, what holds an axle or a roller and has come to its bound, a load that vanishes or comes back:
 *
 *     d+ = d- + (f- - f+) dt,   dt = -ds/s',   dt = -d excess/excess'
 *
 * with the rates before and after all of it (runtime/omniroll/engine/loaded_massless_deviations.py). Where several that
 * have come about by themselves are apart beside the run, or one only just does, the caller decides. */

#if SET_IN_SERIES && SET_LOADS && !SET_GRIPS
#define MOST_ENDS (3*MOST_WHEELS)

/* What may have come to its end by itself: axles that stop, bearings that break away, then loads, by their places;
 * where the first two end in the list. */
typedef struct {
    int stops, bearings, count, of[MOST_ENDS];
} ends_t;

/* List them. What makes no rate jump by itself has no part in that: under friction a load has none. */
static ends_t list_ends(const variations_t *w, long long row)
{
    ends_t found = {0};
    for (int k = 0; k < MOST_OWN(w); k++)
        if (own_mode(w, row, k) != 0 && own_mode(w, row, k) != own_mode(w, row + 1, k))
            found.of[found.count++] = k;
    found.stops = found.count;
    for (int k = 0; k < WITH_SERIES(w); k++)
        if (own_mode(w, row, k) == 0 && own_mode(w, row + 1, k) != 0 && jumps_as_it_goes(w, k))
            found.of[found.count++] = k;
    found.bearings = found.count;
    for (int i = 0; i < w->wheels; i++)
        if (!SET_FRICTION && carries_in(w, row, i) != carries_in(w, row + 1, i))
            found.of[found.count++] = i;
    return found;
}

/* How far what is asked of a bearing is beyond its bound, per this, and how that moves along a column or with time;
 * what would hold rollers, if they all stuck, is known. */
static double excess_along(const variations_t *w, int column, int k, const point_t *at, const point_t *along,
                           const lanes_t *of_rollers, const lanes_t *of_rollers_moved, double *moved)
{
    const int roller = k - MOST_OWN(w);
    const double bound = w->run->own_most[k], grown = column < 0 ? 0 : moved_most(w, column, k);
    const double asked = roller < 0 ? own_asked(w, at, k) : of_rollers[roller][0];
    const double asked_moved = roller < 0 ? own_asked(w, along, k) : of_rollers_moved[roller][0];
    *moved = ((asked < 0 ? -asked_moved : asked_moved) - grown)/bound;
    return fabs(asked)/bound - 1;
}

/* How far all are beyond their ends, and how that moves along a column or with time: what is asked of bearings per
 * their bounds, loads per the weight, of an axle that stops its rate. The rates in the row have been computed last. */
static void put_ends(const variations_t *w, long long row, int column, const lanes_t *rate, const ends_t *ends,
                     double *beyond, double *moved)
{
    const int model = column < 0 ? 0 : w->run->number[column];
    lanes_t asked[MOST_WHEELS], asked_moved[MOST_WHEELS];
    move_along(w, row, column, rate);
    const point_t at = point_of(w, &w->vehicle[model], w->point), along = point_of(w, at.vehicle, w->along);
    asked_in_series(w, row, at.vehicle, asked, asked_moved);
    for (int e = 0; e < ends->count; e++) {
        const int k = ends->of[e];
        if (e < ends->stops)
            beyond[e] = at.core[k][0], moved[e] = along.core[k][0];
        else if (e < ends->bearings)
            beyond[e] = excess_along(w, column, k, &at, &along, asked, asked_moved, moved + e);
        else
            beyond[e] = beyond_along(w, row, model, w->wheels + k, &at, &along, moved + e);
    }
    take_way_back(w);
}

/* Leave those among them that have come to their ends by themselves, with how fast they do. Returns 0 where one only
 * just does. */
static int take_reached(const variations_t *w, long long row, const lanes_t *before, ends_t *ends, double *rises)
{
    const double lasted = fmin(time_of_modes(w, row), time_of_own_modes(w, row, 0, WITH_SERIES(w)));
    double beyond[MOST_ENDS], own[MOST_ENDS];
    const ends_t all = *ends;
    put_ends(w, row, TIMES_ALONE, before, &all, beyond, own);
    *ends = (ends_t){0};
    for (int e = 0; e < all.count; e++) {
        const int stops = e < all.stops;
        if (!stops && !(fabs(beyond[e]) <= w->run->reached))
            continue;
        if (!stops && !(own[e]*lasted > w->run->only_just))
            return 0;
        ends->stops += stops, ends->bearings += e < all.bearings;
        rises[ends->count] = own[e], ends->of[ends->count++] = all.of[e];
    }
    return ends->count > 0;
}

/* By how much the time deviates (columns) at which all that comes about by itself does. Returns 0 where that is apart.
 */
static int put_times_of_ends(const variations_t *w, long long row, const lanes_t *before, const ends_t *ends,
                             const double *rises, double *time)
{
    double beyond[MOST_ENDS], moved[MOST_ENDS];
    for (int p = 0; p < w->columns; p++) {
        double least = INFINITY, most = -INFINITY;
        put_ends(w, row, p, before, ends, beyond, moved);
        for (int e = 0; e < ends->count; e++) {
            const double own = -moved[e]/rises[e];
            least = fmin(least, own), most = fmax(most, own);
        }
        if (most - least > LETS_GO_TOGETHER*fmax(fabs(least), fabs(most)))
            return 0;
        time[p] = -moved[0]/rises[0];
    }
    return 1;
}

/* Whether an axle that comes to rest only just does: by what acts on it before and after, and by what it takes. */
static int stop_grazes(const variations_t *w, const ends_t *ends, const lanes_t *before, const lanes_t *after)
{
    for (int e = 0; e < ends->stops; e++) {
        const int k = ends->of[e], place = place_of_core(w, 3 + k);
        const double possible = fmax(fabs(before[place][0]), fabs(after[place][0]))
            + w->run->own_most[k]/w->run->own_inertia[k];
        if (!(fabs(before[place][0]) > w->run->only_just*possible))
            return 1;
    }
    return 0;
}

/* Whether a bearing sticks in a row by all that it takes: the rates there have been computed last. */
static int sticks_by_all(const variations_t *w, long long row, const lanes_t *rate)
{
    lanes_t asked[MOST_WHEELS], moved[MOST_WHEELS];
    put_asked_in_series(w, row, TIMES_ALONE, rate, asked, moved);
    for (int i = 0; i < w->wheels; i++) {
        const int k = bearing_in_series(w, i);
        const double bound = w->run->own_most[k];
        if (own_mode(w, row, k) == 0 && jumps_as_it_goes(w, k) && carries_in(w, row, i)
            && fabs(fabs(asked[i][0]) - bound) <= w->run->reached*bound)
            return 1;
    }
    const point_t at = point_of(w, w->vehicle, w->point);
    for (int k = 0; k < MOST_OWN(w); k++)
        if (own_mode(w, row, k) == 0 && fabs(own_asked(w, &at, k)) >= (1 - w->run->reached)*w->run->own_most[k])
            return 1;
    return 0;
}

/* Pass what happens to bearings, and to loads with them, between a row and the next. Returns whether that was one of
 * the above; else nothing has been done. */
static int pass_loaded_in_series(variations_t *w, long long row)
{
    lanes_t before[w->size], after[w->size];
    double rises[MOST_ENDS], time[w->columns];
    ends_t ends = list_ends(w, row);
    if (step_before(w, row) < 0)
        return 0;
    rates_in_row(w, row + 1, after);
    const int at_edge = sticks_by_all(w, row + 1, after);
    rates_in_row(w, row, before);
    if (!ends.stops && are_same(w, before, after))
        return 1;
    if (at_edge || stop_grazes(w, &ends, before, after) || !take_reached(w, row, before, &ends, rises)
        || !put_times_of_ends(w, row, before, &ends, rises, time))
        return 0;
    add_jump(w, before, after, time);
    return 1;
}

/* Whether a roller breaks away by itself just as another wheel switches behind a row. */
static int lets_go_at_switch(const variations_t *w, long long row, const int *direction)
{
    for (int i = 0; i < w->wheels; i++)
        if (!direction[i] && jumps_in_series(w, row, i))
            return 1;
    return 0;
}
#endif
