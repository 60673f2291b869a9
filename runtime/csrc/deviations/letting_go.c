/* How deviations pass where rates jump at a time that deviates: a contact lets go under more static friction. With what
 * is beyond its bound then,
 *
 *     d+ = d- + (f- - f+) dt,   dt = -d beyond/beyond'
 *
 * (runtime/omniroll/engine/contact_deviations.py): of the force of a contact that sticks how much of its static
 * friction it takes, squared, less 1. Where one is at its bound only just, or several are apart beside the run, the
 * caller decides. */

#if SET_GRIPS

/* Contacts whose force is beyond its bound, and by how much. */
typedef struct {
    int count, of[MOST_WHEELS];
    double beyond[MOST_WHEELS];
} bounds_t;

/* The contacts that let go between a row and the next. */
static bounds_t list_bounds(const variations_t *w, long long row)
{
    bounds_t found = {0};
    for (int i = 0; i < w->wheels; i++)
        if (sticks_in(w, row, i) && !sticks_in(w, row + 1, i))
            found.of[found.count++] = i;
    return found;
}

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
            along->ground_push[c] += w->turned[c]*turn;
    }
}

/* How forces move along a column, or with time: in a row, whose rates have been computed last. */
static void move_along(const variations_t *w, long long row, int column, const lanes_t *rate)
{
    const int wheels = OWN_WHEELS(w->wheels), model = column < 0 ? 0 : w->run->number[column];
    put_way(w, row, column, rate);              /* first: a point copies its heading */
    const point_t at = point_of(w, &w->vehicle[model], w->point), along = point_of(w, at.vehicle, w->along);
    lanes_t nu_dot[3], nu_dot_along[3];
    turn_pushes(w, row, model, &at, &along);
    rates_along(wheels, &at, &along, nu_dot, nu_dot_along);
}

/* What is beyond, and how that moves. */
static void put_beyond(const variations_t *w, long long row, int column, const lanes_t *rate, bounds_t *bounds,
                       double *moved)
{
    const int model = column < 0 ? 0 : w->run->number[column];
    move_along(w, row, column, rate);
    const point_t at = point_of(w, &w->vehicle[model], w->point), along = point_of(w, at.vehicle, w->along);
    for (int k = 0; k < bounds->count; k++)
        bounds->beyond[k] = beyond_along(w, model, bounds->of[k], &at, &along, &moved[k]);
    take_way_back(w);
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

/* Pass such a jump from the rates `before` to those `after`, which have been computed first. Returns whether that was
 * determinate; else nothing has been done. */
static int pass_jump(variations_t *w, long long row, const lanes_t *before, const lanes_t *after)
{
    bounds_t bounds = list_bounds(w, row);
    const int count = bounds.count, columns = w->columns;
    double rises[MOST_WHEELS], moved[MOST_WHEELS], time[columns];
    int first = -1;
    put_beyond(w, row, TIMES_ALONE, before, &bounds, rises);
    for (int k = 0; k < count; k++) {
        if (bounds.beyond[k] < -w->run->reached)
            continue;
        if (!(rises[k]*time_of_modes(w, row) > w->run->only_just))
            return 0;
        first = first < 0 ? k : first;
    }
    if (first < 0)
        return 0;
    for (int p = 0; p < columns; p++) {
        put_beyond(w, row, p, before, &bounds, moved);
        double least = INFINITY, most = -INFINITY;
        for (int k = first; k < count; k++)
            if (bounds.beyond[k] >= -w->run->reached) {
                const double own = -moved[k]/rises[k];
                least = fmin(least, own), most = fmax(most, own);
            }
        if (most - least > LETS_GO_TOGETHER*fmax(fabs(least), fabs(most)))
            return 0;
        time[p] = -moved[first]/rises[first];
    }
    add_jump(w, before, after, time);
    return 1;
}
#endif
