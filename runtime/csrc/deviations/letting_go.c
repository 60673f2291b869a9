/* What lets go in a change of modes: a contact that has used its static friction up, a bearing that breaks away. How
 * much of what can hold it each uses, less 1, comes to zero at a time that deviates:
 *
 *     dt = -d beyond/beyond'
 *
 * Where one is at its bound only just, or several are apart beside the run, the caller decides. */

#if SET_GRIPS
/* How much of what static friction can hold a contact that sticks takes at the point, squared. */
ALWAYS_INLINE double taken_at(const variations_t *w, const point_t *at, int i)
{
    double taken = 0;
    for (int c = 2*i; c < 2*i + 2; c++)
        taken += at->ground_force[c][0]*at->ground_force[c][0]*w->run->per_reach[c];
    return taken;
}

/* What is beyond at the point, and how it moves; with a number of the vehicle, or none. */
static double beyond_along(const variations_t *w, int model, int i, const point_t *at, const point_t *along,
                           double *moved)
{
    const double *const per_reach = w->run->per_reach, *const grown = per_reach + 2*w->wheels*model;
    *moved = 0;
    for (int c = 2*i; c < 2*i + 2; c++) {
        const double force = at->ground_force[c][0];
        *moved += 2*force*along->ground_force[c][0]*per_reach[c] + (model ? force*force*grown[c] : 0);
    }
    return taken_at(w, at, i) - 1;
}

/* The forces on contacts that slip turn with their slips. */
static void turn_pushes(const variations_t *w, long long row, int model, const point_t *at, const point_t *along)
{
    const int wheels = OWN_WHEELS(w->wheels);
    lanes_t slip[2*MOST_WHEELS], moved[2*MOST_WHEELS];
    put_pushes(w, row, model, at, along);
    slips_of(w, at, along, slip, moved);
    for (int i = 0; i < wheels && SET_TURNS; i++) {
        const lanes_t *const own = slip + 2*i, *const way = moved + 2*i;
        const double squared = own[0][0]*own[0][0] + own[1][0]*own[1][0], noise = w->run->slip_rounding[row*wheels + i];
        if (!slides_in(w, row, i) || !slips_both_ways(at, i) || squared <= noise*noise)
            continue;
        const lanes_t turn = (own[0]*way[1] - own[1]*way[0])*(1/squared);
        for (int c = 2*i; c < 2*i + 2; c++)
            along->ground_push[c] += w->contacts.turned[c]*turn;
    }
}

/* For how long contacts have had the modes of a row; where they never had others, how long the run is. */
static double time_of_modes(const variations_t *w, long long row)
{
    const omniroll_variations_t *const run = w->run;
    long long first = row;
    int same = 1;
    while (same && first > 0) {
        for (int i = 0; i < w->wheels; i++)
            same &= sticks_in(w, first - 1, i) == sticks_in(w, row, i);
        first -= same;
    }
    return first > 0 ? run->elapsed[row] - run->elapsed[first] : run->elapsed[run->rows - 1];
}
#endif

/* How forces move along a column, or with time: in a row, whose rates have been computed last. */
static void move_along(const variations_t *w, long long row, int column, const lanes_t *rate)
{
    const int wheels = OWN_WHEELS(w->wheels), model = column < 0 ? 0 : w->run->number[column];
    put_way(w, row, column, rate);              /* first: a point copies its heading */
    const point_t at = point_of(w, &w->vehicle[model], w->point), along = point_of(w, at.vehicle, w->along);
    lanes_t nu_dot[3], nu_dot_along[3];
#if SET_GRIPS
    turn_pushes(w, row, model, &at, &along);
#endif
    rates_along(wheels, &at, &along, nu_dot, nu_dot_along);
    if (SET_SERIES_ALONE)
        put_asked_in_series(w, at.vehicle);
}

/* List the contacts that let go, then the bearings that break away, as units: of a contact one for both components.
 * Returns how many. */
static int list_let_go(const variations_t *w, const change_t *e, int *unit)
{
    int count = 0;
#if SET_GRIPS
    for (int i = 0; i < w->wheels; i++)
        if (sticks_in(w, e->row, i) && !sticks_in(w, e->after, i))
            unit[count++] = 2*i;
#endif
    for (int k = 0; k < MOST_OWN(w); k++)
        if (breaks_away(w, e, k))
            unit[count++] = 2*w->wheels + k;
    return count;
}

/* Whether what sticks after a change, whose rates have been computed last, takes all that can hold it, or may do so. */
static int is_at_bound(const variations_t *w, const change_t *e, const double *asked)
{
    const double reached = w->run->reached;
    int stands[MOST_OWN(w) + 1];
    memset(stands, 0, sizeof stands);
#if SET_GRIPS
    const point_t at = point_of(w, w->vehicle, w->point);
    for (int i = 0; i < w->wheels; i++) {
        int either = 0;
#if SET_STANDS
        for (int way = 0; way < 2; way++)
            if (stands_in(w, e, AFTER, i, way))
                either = stands[way ? i : roller_bearing(w, i, 0)] = 1;
#endif
        if (!either && sticks_in(w, e->after, i) && taken_at(w, &at, i) >= 1 - reached)
            return 1;
    }
#endif
    for (int k = 0; k < MOST_OWN(w); k++)
        if (!stands[k] && !settles(w, e, k) && own_mode(w, e->after, k) == 0
            && fabs(asked[k]) >= (1 - reached)*w->run->own_most[k])
            return 1;
#if SET_STANDS
    return some_stand(w, e, AFTER) && !are_held_clearly(w, e, asked);
#else
    return 0;
#endif
}

/* What a change of modes makes of one time: the change, the rates before it, and what holds wheels that stand. */
typedef struct {
    const change_t *change;
    const lanes_t *before;
#if SET_STANDS
    held_t held;
#endif
} release_t;

/* By how much a contact or a bearing is beyond its bound, as a part of that, and how this moves along a column or with
 * time. */
static double beyond(const variations_t *w, int column, const release_t *release, int unit, double *moved)
{
    const int model = column < 0 ? 0 : w->run->number[column], k = unit - 2*w->wheels;
    const point_t at = point_of(w, &w->vehicle[model], w->point), along = point_of(w, at.vehicle, w->along);
#if SET_STANDS
    const held_t *const held = &release->held;
    for (int j = 0; j < held->count; j++) {
        if (2*held->stand[j].wheel == unit)
            return contact_use_along(w, column, held, unit/2, &at, &along, moved) - 1;
        if (held->stand[j].bearing == k)
            return bearing_use_along(w, column, held, j, &at, &along, moved) - 1;
    }
#endif
#if SET_HOLDS
    if (row_of_bearing(w, k) >= 0)
        return hold_use_along(w, column, release->change, k, &at, &along, moved) - 1;
#endif
    (void)release;
#if SET_GRIPS
    if (k < 0)
        return beyond_along(w, model, unit/2, &at, &along, moved);
#endif
    const double most = w->run->own_most[k], asked = own_asked(w, &at, k), side = asked < 0 ? -1 : 1;
    const double grown = column < 0 ? 0 : moved_most(w, column, k);
    *moved = (side*own_asked(w, &along, k) - fabs(asked)/most*grown)/most;
    return fabs(asked)/most - 1;
}

/* Let forces move along a column, or with time, and what holds wheels that stand. */
static void move_release(const variations_t *w, int column, release_t *release)
{
    const change_t *const e = release->change;
    put_held(w, e->before, column < 0 ? -1 : w->run->number[column] - 1);
    move_along(w, e->row, column, release->before);
#if SET_STANDS
    move_held(w, column, &release->held);
#endif
}

/* For how long all have had the modes from which they go. */
static double time_before(const variations_t *w, const change_t *e)
{
    double lasted = time_of_own_modes(w, e->before);
#if SET_GRIPS
    lasted = fmin(lasted, time_of_modes(w, e->before));
#endif
    return lasted + w->run->elapsed[e->row] - w->run->elapsed[e->before];
}

/* Keep of a list those that have come to their bounds by themselves: the others they have set off. `rises` becomes how
 * fast. Returns how many; 0 where one only just comes there. */
static int keep_reached(const variations_t *w, release_t *release, int *unit, int all, double *rises)
{
    const double lasted = time_before(w, release->change);
    int count = 0;
    move_release(w, TIMES_ALONE, release);
    for (int j = 0; j < all; j++)
        if (!(beyond(w, TIMES_ALONE, release, unit[j], &rises[count]) < -w->run->reached))
            unit[count++] = unit[j];
    take_way_back(w);
    for (int j = 0; j < count; j++)
        if (!(rises[j]*lasted > w->run->only_just))
            return refuse(w, LETS_GO_ONLY_JUST, 0);
    return count;
}

/* By how much the times deviate (columns) at which these come to their bounds. Returns 0 where they do so apart. */
static int put_times_of_release(const variations_t *w, release_t *release, const int *unit, int count,
                                const double *rises, double *time)
{
    for (int p = 0; p < w->columns; p++) {
        double least = INFINITY, most = -INFINITY;
        move_release(w, p, release);
        for (int j = count - 1; j >= 0; j--) {
            double moved;
            beyond(w, p, release, unit[j], &moved);
            time[p] = -moved/rises[j];
            least = fmin(least, time[p]), most = fmax(most, time[p]);
        }
        take_way_back(w);
        if (!(most - least <= LETS_GO_TOGETHER*fmax(fabs(least), fabs(most))))
            return refuse(w, HAPPENS_APART, p);
    }
    return 1;
}
