/* How deviations pass where bearings with rates of their own and contacts change their modes side by side, under
 * Coulomb's friction on the ground.
 *
 * What comes to rest does so by its own force or torque alone. With what these do to the rates, R, and to slips and
 * bearings' rates, W,
 *
 *     d* = d- - R W^-1 ds                              (ds: of the slips and rates that have come to rest)
 *
 * Where bearings turn on then, or turn back at once, d+ = d* + (f* - f+) dt, dt = -ds/s', with the rates f* while those
 * that have come to rest stay there. What lets go does so at
 *
 *     d+ = d- + (f- - f+) dt,   dt = -d beyond/beyond'
 *
 * (runtime/omniroll/engine/standing_deviations.py). Contacts turn back as turning_back.c says, where nothing comes to
 * rest then. Where W says too little, where a wheel that stands is at its bound or lets go whose forces are not
 * determined, where something only just happens, or several things do apart beside the run, the caller decides. */

#if SET_STANDS
/* What comes to rest in a change: components of slips, then bearings. */
typedef struct {
    int contacts, count;
    int *unit;
} beside_t;

static beside_t list_rests_beside(const variations_t *w, const own_change_t *e, int *unit)
{
    beside_t found = {.unit = unit};
    if (e->after > e->row)
        found.contacts = list_rests(w, e->row, unit);
    found.count = found.contacts;
    for (int k = 0; k < MOST_OWN(w); k++)
        if (stops(w, e, k))
            unit[found.count++] = 2*w->wheels + k;
    return found;
}

/* List the contacts that let go, then the bearings that break away: bearings by 2*wheels + their place. */
static int list_let_go(const variations_t *w, const own_change_t *e, int *of)
{
    int count = 0;
    for (int i = 0; i < w->wheels; i++)
        if (sticks_in(w, e->row, i) && !sticks_in(w, e->after, i))
            of[count++] = i;
    for (int k = 0; k < MOST_OWN(w); k++)
        if (breaks_away(w, e, k))
            of[count++] = 2*w->wheels + k;
    return count;
}

/* Whether what sticks after a change, whose rates have been computed last, holds all that it can, or may do so. */
static int is_at_bound_beside(const variations_t *w, const own_change_t *e, const double *asked)
{
    const point_t at = point_of(w, w->vehicle, w->point);
    const double reached = w->run->reached;
    int stands[MOST_OWN(w)];
    memset(stands, 0, sizeof stands);
    for (int i = 0; i < w->wheels; i++) {
        const int along = stands_in(w, e, AFTER, i, 0), rolling = stands_in(w, e, AFTER, i, 1);
        if (along)
            stands[roller_bearing(w, i, 0)] = 1;
        if (rolling)
            stands[i] = 1;
        if (!along && !rolling && sticks_in(w, e->after, i) && taken_at(w, &at, i) >= 1 - reached)
            return 1;
    }
    for (int k = 0; k < MOST_OWN(w); k++)
        if (!stands[k] && !settles(w, e, k) && own_mode(w, e->after, k) == 0
            && fabs(asked[k]) >= (1 - reached)*w->run->own_most[k])
            return 1;
    return some_stand(w, e, AFTER) && !are_held_clearly(w, e, asked);
}

/* By how much what has let go is beyond its bound, as a part of that, and how this moves along a column or with time;
 * `of` as list_let_go() has it. */
static double beyond_beside(const variations_t *w, int column, const held_t *held, int of, double *moved)
{
    const int model = column < 0 ? 0 : w->run->number[column], k = of - 2*w->wheels;
    const point_t at = point_of(w, &w->vehicle[model], w->point), along = point_of(w, at.vehicle, w->along);
    for (int j = 0; j < held->count; j++) {
        if (held->stand[j].wheel == of)
            return contact_use_along(w, column, held, of, &at, &along, moved) - 1;
        if (held->stand[j].bearing == k)
            return bearing_use_along(w, column, held, j, &at, &along, moved) - 1;
    }
    if (k < 0)
        return beyond_along(w, model, of, &at, &along, moved);
    const double most = w->run->own_most[k], asked = own_asked(w, &at, k), side = asked < 0 ? -1 : 1;
    const double grown = column < 0 ? 0 : moved_most(w, column, k);
    *moved = (side*own_asked(w, &along, k) - fabs(asked)/most*grown)/most;
    return fabs(asked)/most - 1;
}

/* Let forces move along a column, or with time, and what holds wheels that stand. */
static void move_beside(const variations_t *w, const own_change_t *e, int column, const lanes_t *before, held_t *held)
{
    put_held(w, e->before, column < 0 ? -1 : w->run->number[column] - 1);
    move_along(w, e->row, column, before);
    move_held(w, column, held);
}

/* Pass what lets go, from the rates `before`, which have been computed last, to those `after`. */
static int pass_let_go(variations_t *w, const own_change_t *e, const lanes_t *before, const lanes_t *after)
{
    const long long row = e->row;
    int of[w->wheels + MOST_OWN(w)];
    double rises[w->wheels + MOST_OWN(w)], time[w->columns];
    int all = list_let_go(w, e, of), count = 0;
    held_t held;
    if (are_same(w, before, after))
        return 1;
    if (step_before(w, row) < 0 || !find_held(w, e, &held))
        return 0;
    const double lasted = fmin(time_of_modes(w, e->before), time_of_own_modes(w, e->before, 0, MOST_OWN(w)))
        + w->run->elapsed[row] - w->run->elapsed[e->before];
    move_beside(w, e, TIMES_ALONE, before, &held);
    for (int j = 0; j < all; j++)
        if (beyond_beside(w, TIMES_ALONE, &held, of[j], &rises[count]) >= -w->run->reached)
            of[count++] = of[j];
    take_way_back(w);
    for (int j = 0; j < count; j++)
        if (!(rises[j]*lasted > w->run->only_just))
            return 0;
    for (int p = 0; p < w->columns; p++) {
        double least = INFINITY, most = -INFINITY;
        move_beside(w, e, p, before, &held);
        for (int j = 0; j < count; j++) {
            double moved;
            beyond_beside(w, p, &held, of[j], &moved);
            const double own = -moved/rises[j];
            least = fmin(least, own), most = fmax(most, own);
            time[p] = j == 0 ? own : time[p];
        }
        take_way_back(w);
        if (!(most - least <= LETS_GO_TOGETHER*fmax(fabs(least), fabs(most))))
            return 0;
    }
    add_jump(w, before, after, time);
    return count > 0;
}

/* Whether something comes to rest only just, where the rates before have been computed last. */
static int grazes_rest_beside(const variations_t *w, const beside_t *rests, const double *dot, const double *asked)
{
    if (grazes_rest(w, rests->unit, rests->contacts))
        return 1;
    for (int j = rests->contacts; j < rests->count; j++) {
        const int k = rests->unit[j] - 2*w->wheels;
        const double possible = fabs(dot[k]) + (fabs(asked[k]) + w->run->own_most[k])/w->run->own_inertia[k];
        if (fabs(dot[k]) <= w->run->only_just*possible)
            return 1;
    }
    return 0;
}

/* The deviations of what comes to rest, in a row that w->point has: count x groups. */
static void put_rests_moved(const variations_t *w, const beside_t *rests, lanes_t *to)
{
    int of[MOST_OWN(w)];
    for (int j = rests->contacts; j < rests->count; j++)
        of[j - rests->contacts] = rests->unit[j] - 2*w->wheels;
    put_slips_moved(w, rests->unit, rests->contacts, to);
    put_turning(w, of, rests->count - rests->contacts, to + rests->contacts*w->groups);
}

/* Whether a roller that stops on its disk while its contact slips only just does, and its bearing holds more than it
 * takes; or one turns back there. The rates before have been computed last. */
static int settles_only_just(const variations_t *w, const own_change_t *e, const lanes_t *before, const double *dot)
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

/* Take from rates that have come to rest what rounding has left; and from nu, where the vehicle stands. */
static void take_roundings(variations_t *w, const own_change_t *e, const beside_t *rests, lanes_t *left)
{
    const int groups = w->groups, wheels = w->wheels;
    put_rests_moved(w, rests, left);
    for (int j = rests->contacts; j < rests->count; j++) {
        const int roller = rests->unit[j] - 2*wheels - SET_AXLES_STICK*wheels, places = w->rollers;
        if (SET_STRIPS && roller >= 0)              /* which has no rate of its own */
            continue;
        const int a = roller < 0 ? 3 + rests->unit[j] - 2*wheels
            : roller%places == 0 ? 3 + wheels + roller/places
                                 : first_momentum(w) + roller/places*(places - 1) + roller%places - 1;
        for (int g = 0; g < groups; g++)
            w->moved[place_of_core(w, a)*groups + g] -= left[j*groups + g];
    }
    if (is_still_in(w, e->after))
        memset(w->moved, 0, 3*groups*sizeof *w->moved);
}

#if SET_STRIPS
/* A slip that its own force does not move is no speed of its own: other wheels hold the vehicle there. */
static void forget_what_is_held(const variations_t *w, const beside_t *rests, double *to_own)
{
    const int count = rests->count;
    const double *const inertia = w->run->own_inertia, arm = w->run->standing[1];
    for (int j = 0; j < count; j++) {
        const double size = j < rests->contacts ? inertia[roller_bearing(w, 0, 0)]/(arm*arm)
                                                : inertia[rests->unit[j] - 2*w->wheels];
        if (fabs(to_own[j*count + j])*size > SAME)
            continue;
        for (int k = 0; k < count; k++)
            to_own[j*count + k] = to_own[k*count + j] = 0;
    }
}
#endif

/* Put slips right that come to rest in directions that turn. Returns whether that is determinate. */
static int put_directions_right(variations_t *w, const own_change_t *e, const beside_t *rests)
{
#if SET_TURNS
    int turning[MOST_COMPONENTS];
    memcpy(turning, rests->unit, rests->contacts*sizeof *turning);
    const int turns = keep_turns(w, e->row, turning, rests->contacts);
    double to_known[w->known*(turns + 1)], to_own[(turns + 1)*(turns + 1)];
    if (turns) {
        put_responses(w, turning, turns, to_known, to_own);
        return put_rests_right(w, e->row, turning, turns, to_known, to_own);
    }
#endif
    (void)w, (void)e, (void)rests;
    return 1;
}

/* Let slips and rates come to rest, where the rates before have been computed last. */
static int take_rests_beside(variations_t *w, const own_change_t *e, const beside_t *rests)
{
    const int count = rests->count, groups = w->groups;
    double to_known[w->known*count], to_own[count*count];
    lanes_t force[count*groups];
    if (!put_directions_right(w, e, rests))
        return 0;
    put_responses(w, rests->unit, count, to_known, to_own);
    put_rests_moved(w, rests, force);
#if SET_STRIPS
    forget_what_is_held(w, rests, to_own);
    solve_dependent(to_own, count, force, groups);
#else
    if (!solve_scaled(to_own, count, force, groups))
        return 0;
#endif
    take_responses(w, to_known, count, force);
    take_roundings(w, e, rests, force);
    return 1;
}

/* By how much the times deviate (columns) at which rates of bearings come to zero. Returns 0 where they do so apart. */
static int put_times_of_stops(const variations_t *w, const beside_t *rests, const double *dot, double *time)
{
    lanes_t turning[rests->count*w->groups];
    double rate[rests->count];
    put_rests_moved(w, rests, turning);
    for (int j = 0; j < rests->count; j++)
        rate[j] = dot[rests->unit[j] - 2*w->wheels];
    return put_times_of_zeros(w, turning, rate, rests->count, time);
}

/* Pass a change of modes. Returns whether it was one of those above; else nothing has been done. */
static int pass_own_change(variations_t *w, const own_change_t *e)
{
    const int bearings = MOST_OWN(w);
    double dot[bearings], asked[bearings], time[w->columns];
    int unit[MOST_COMPONENTS + bearings], of[w->wheels + bearings], turned[MOST_WHEELS];
    lanes_t before[w->size], resting[w->size], after[w->size];
    const beside_t rests = list_rests_beside(w, e, unit);
    const int go = list_let_go(w, e, of), on = some_turn_on(w, e) && rests.count;
    const int back = e->after > e->row ? list_turns_back(w, e->row, turned) : 0;
    if ((back && rests.count) || (rests.count && go && of[0] < 2*w->wheels) || (rests.contacts && on))
        return 0;
    if (rests.contacts)
        aim_rests(w, e->row);
    rates_of_change(w, e, AFTER, after, dot, asked);
    if (is_at_bound_beside(w, e, asked))
        return 0;
    if (on)
        rates_of_change(w, e, RESTING, resting, dot, asked);
    rates_of_change(w, e, BEFORE, before, dot, asked);
    if (settles_only_just(w, e, before, dot))
        return 0;
    if (back)
        return pass_turns_back(w, turned, back, before, after);
    if (!rests.count)
        return pass_let_go(w, e, before, after);
    if (grazes_rest_beside(w, &rests, dot, asked))
        return 0;
    if (on && !put_times_of_stops(w, &rests, dot, time) && !are_same(w, resting, after))
        return 0;
    if (!take_rests_beside(w, e, &rests))
        return 0;
    if (on)
        add_jump(w, resting, after, time);
    return 1;
}
#endif
