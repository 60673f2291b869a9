/* What happens to contacts and bearings: which of them come to rest, turn on, let go and break away, and the rates before,
 * in between and afterwards. */

#define SAME_DIRECTION 0.999        /* the cosine of the angle between directions of which none is another one     */

/* A change of modes at the state of a row: from those of one row to those of another; NONE: nothing sticks. */
enum { NONE = -1 };
typedef struct {
    long long row, before, after;
    const double *knot;         /* columns: by how much the time deviates at which drives jump there; or null */
    int only;                   /* 0, or 1 + the place of the bearing that alone has its mode of afterwards then */
} change_t;

#if SET_GRIPS
/* Whether a contact that slips one way alone does so the other way from the next row on. */
ALWAYS_INLINE int turns_back(const variations_t *w, long long row, int i)
{
    const double *const heading = w->run->drive + (row*SET_INPUTS + SET_HEADINGS_INPUT)*w->wheels + i;
    for (long long k = row; k < row + 2; k++)
        if (!slides_in(w, k, i) || turns_in(w, k, i))
            return 0;
    return heading[0]*heading[SET_INPUTS*w->wheels] < 0;
}

/* Whether a contact comes to rest as a step ends in a row, and at once slips on in another direction. */
static int goes_on(const variations_t *w, long long row, int i)
{
    const int wheels = OWN_WHEELS(w->wheels);
    const double *const heading = w->run->drive + (row*SET_INPUTS + SET_HEADINGS_INPUT)*wheels + i;
    if (row == 0 || w->run->step_of[row - 1] < 0 || w->run->step_of[row] >= 0 || !turns_in(w, row, i)
        || !turns_in(w, row + 1, i) || cos(heading[SET_INPUTS*wheels] - heading[0]) > SAME_DIRECTION)
        return 0;
    lanes_t own[point_size(w)], still[point_size(w)], slip[2*MOST_WHEELS], moved[2*MOST_WHEELS];
    memset(still, 0, sizeof still);
    put_state(w, row, own);
    const point_t at = point_of(w, w->vehicle, own), along = point_of(w, w->vehicle, still);
    slips_of(w, &at, &along, slip, moved);
    return hypot(slip[2*i][0], slip[2*i + 1][0]) <= w->run->slip_rounding[row*wheels + i];
}

/* Whether a contact comes to rest between a row and the next. */
static int rests_behind(const variations_t *w, long long row, int i)
{
    return slides_in(w, row, i) && (sticks_in(w, row + 1, i) || goes_on(w, row, i));
}

/* Whether a contact changes its mode, or the way that it slips, between a row and the next. */
static int changes_mode(const variations_t *w, long long row, int i)
{
    return sticks_in(w, row, i) != sticks_in(w, row + 1, i) || turns_back(w, row, i) || goes_on(w, row, i);
}
#endif

#if SET_STRIPS
/* Whether a contact lets go while its wheel moves along its axle: if its roller sticks, it slips as fast as this has
 * turned. */
static int slips_along_axle(const variations_t *w, const change_t *e, int i)
{
    const int wheels = OWN_WHEELS(w->wheels);
    if (!sticks_in(w, e->row, i) || sticks_in(w, e->after, i))
        return 0;
    lanes_t own[point_size(w)], still[point_size(w)], slip[2*MOST_WHEELS], moved[2*MOST_WHEELS];
    memset(still, 0, sizeof still);
    put_state(w, e->row, own);
    const point_t at = point_of(w, w->vehicle, own), along = point_of(w, w->vehicle, still);
    slips_of(w, &at, &along, slip, moved);
    double fastest = 0;
    for (int j = 0; j < wheels; j++)
        fastest = fmax(fastest, fabs(slip[2*j][0]));
    return fabs(slip[2*i][0]) > fmax(SAME*fastest, w->run->slip_rounding[e->row*wheels + i]);
}
#endif

/* Whether the speed of a bearing is one that what holds it may bring to rest: along the axle of a massless roller where
 * its contact sticks, or comes to rest as well. */
ALWAYS_INLINE int is_held(const variations_t *w, const change_t *e, int k)
{
#if SET_STRIPS
    const int i = k - roller_bearing(w, 0, 0);
    return i < 0 || rests_behind(w, e->row, i) || (sticks_in(w, e->row, i) && !slips_along_axle(w, e, i));
#else
    (void)w, (void)e, (void)k;
    return !SET_SERIES_ALONE || k < roller_bearing(w, 0, 0);
#endif
}

/* Whether a bearing takes less once it has broken away. */
ALWAYS_INLINE int jumps_as_it_goes(const variations_t *w, int k)
{
    return w->run->own_most[k] > (1 + w->run->jumps)*w->run->own_sliding[k];
}

/* Whether a bearing comes to rest. */
ALWAYS_INLINE int stops(const variations_t *w, const change_t *e, int k)
{
    return own_mode(w, e->before, k) != 0 && own_mode(w, e->before, k) != own_mode(w, e->after, k) && is_held(w, e, k);
}

/* Whether a massless roller stops on its disk while its contact slips: no speed comes to rest, and no rate jumps. */
ALWAYS_INLINE int settles(const variations_t *w, const change_t *e, int k)
{
    return SET_IN_SERIES && own_mode(w, e->before, k) != 0 && own_mode(w, e->after, k) == 0 && !is_held(w, e, k);
}

/* The mode of a bearing while those that come to rest stay there. */
ALWAYS_INLINE long long mode_at_rest(const variations_t *w, const change_t *e, int k)
{
    return stops(w, e, k) ? 0 : own_mode(w, e->before, k);
}

/* Whether a bearing turns afterwards that would rest, or turn the other way, if nothing had happened but rests. */
ALWAYS_INLINE int turns_on(const variations_t *w, const change_t *e, int k)
{
    return mode_at_rest(w, e, k) != own_mode(w, e->after, k) && !settles(w, e, k);
}

/* Whether one does so that has not come to rest. */
ALWAYS_INLINE int breaks_away(const variations_t *w, const change_t *e, int k)
{
    return turns_on(w, e, k) && !stops(w, e, k);
}

enum { BEFORE, RESTING, AFTER };     /* of a change: resting, while those that come to rest stay there */

/* The mode of a bearing in one of these. */
ALWAYS_INLINE long long mode_of(const variations_t *w, const change_t *e, int which, int k)
{
    if (which == BEFORE && e->before == NONE)
        return 1;
    const int is_after = which == AFTER && (!e->only || e->only == 1 + k);
    return which == RESTING ? mode_at_rest(w, e, k) : own_mode(w, is_after ? e->after : e->before, k);
}

/* Let the bearings of the point have the modes of one of these. */
static void put_modes_of(const variations_t *w, const change_t *e, int which)
{
    lanes_t *free = 0;
#if SET_GATHERS
    free = w->spins.sticks;
#endif
    for (int k = 0; k < MOST_OWN(w); k++) {
        const long long mode = mode_of(w, e, which, k);
        *of_bearing(w, k, w->bearings.sticks, w->bearings.sticks + w->wheels, free) = lanes_of(mode == 0);
        *own_torque(w, w->point, k) = lanes_of(-(double)mode*w->run->own_sliding[k]);
    }
}

#include "deviations/standing.c"

/* What the ground would ask of massless rollers if they stuck, at the point, and how that moves. Beside contacts that may
 * stick, and of free rollers, spins have other arguments. */
static void put_asked_in_series(const variations_t *w, const vehicle_t *v)
{
#if !SET_STRIPS && !SET_DISKS_STICK
    const int wheels = OWN_WHEELS(w->wheels), chi = point_chi(w);
    lanes_t spin[MOST_WHEELS], spin_moved[MOST_WHEELS], none[MOST_WHEELS] = {{0}}, sticks[MOST_WHEELS];
    for (int i = 0; i < wheels; i++)
        sticks[i] = lanes_of(1);
    set_slip_spins_along(wheels, v, w->point, w->point + chi, w->point + POINT_CORE, none, sticks, w->along,
                         w->along + chi, w->along + POINT_CORE, none, none, spin, w->bearings.holding + wheels,
                         spin_moved, w->bearings.holding + 3*wheels);
#endif
    (void)w, (void)v;
}

/* The rates then, with the accelerations of the bearings and what holds those that stick. */
static void rates_of_change(const variations_t *w, const change_t *e, int which, lanes_t *rate, double *dot,
                            double *asked)
{
    const long long row = which == AFTER ? e->after : e->row, modes = which == AFTER ? e->after : e->before;
    put_state(w, row, w->point);
#if SET_DIRECTIONS
    if (which == RESTING || modes == NONE)
        put_held_in(w, e, which);
    else
        put_held(w, modes, -1);
#endif
    put_modes_of(w, e, which);
#if SET_GRIPS
    for (int i = 0; i < w->wheels && which == RESTING && e->after > e->row; i++)
        if (rests_behind(w, e->row, i))
            w->point[point_inputs(w) + SET_MODES_INPUT*w->wheels + i] = lanes_of(1);
#endif
    (void)modes;
    rates_at_point(w, row, rate);
    if (SET_SERIES_ALONE)
        put_asked_in_series(w, w->vehicle);
    const point_t at = point_of(w, w->vehicle, w->point);
    for (int k = 0; k < MOST_OWN(w); k++)
        dot[k] = own_dot(w, &at, k, 0), asked[k] = own_asked(w, &at, k);
}

/* Whether some bearings have other modes in another row. */
static int modes_differ(const variations_t *w, long long row, long long other)
{
    const long long *const one = w->run->own_mode + row*MOST_OWN(w);
    return memcmp(one, w->run->own_mode + other*MOST_OWN(w), MOST_OWN(w)*sizeof *one) != 0;
}

/* For how long they have had the modes of a row; where they never had others and wheels may slip, how long the run is. */
static double time_of_own_modes(const variations_t *w, long long row)
{
    const omniroll_variations_t *const run = w->run;
    long long first = row;
    if (MOST_OWN(w) == 0)
        return run->elapsed[run->rows - 1];
    while (first > 0 && !modes_differ(w, first - 1, row))
        first--;
    return first > 0 || SET_HOLDS ? run->elapsed[row] - run->elapsed[first] : run->elapsed[run->rows - 1];
}

static int some_turn_on(const variations_t *w, const change_t *e)
{
    int found = 0;
    for (int k = 0; k < MOST_OWN(w); k++)
        found |= turns_on(w, e, k);
    return found;
}

/* Whether contacts slip on behind a rest. */
static int some_go_on(const variations_t *w, const change_t *e)
{
    int found = 0;
#if SET_GRIPS
    for (int i = 0; i < w->wheels && e->after > e->row; i++)
        found |= goes_on(w, e->row, i);
#endif
    (void)w, (void)e;
    return found;
}

/* Whether contacts or bearings change their modes between a row and the next. */
static int changes_modes(const variations_t *w, long long row)
{
#if SET_GRIPS
    for (int i = 0; i < w->wheels; i++)
        if (changes_mode(w, row, i))
            return 1;
#endif
    return SET_OWN_BEARINGS && modes_differ(w, row, row + 1);
}

/* Whether a drive jumps between a row and the next. */
static int drives_jump(const variations_t *w, long long row)
{
    const double *const before = w->run->drive + row*SET_INPUTS*w->wheels, *const after = before + SET_INPUTS*w->wheels;
    for (int k = 0; k < SET_MOVING*w->wheels; k++) {
        const int input = k/w->wheels;
        if (input != SET_BEARING_INPUT && input != SET_CONTACT_BEARING_INPUT
            && fabs(after[k] - before[k]) > w->run->jumps*fmax(fabs(after[k]), fabs(before[k])))
            return 1;
    }
    return 0;
}

/* Whether a bearing comes to rest, or turns back, just as a wheel switches behind a row. */
static int rests_at_switch(const variations_t *w, long long row)
{
    const long long *const contact = w->run->contact + row*w->wheels;
    for (int i = 0; i < SET_AXLES_STICK*w->wheels; i++)
        if (own_mode(w, row, i) != 0 && own_mode(w, row, i) != own_mode(w, row + 1, i))
            return 1;
    for (int i = 0; i < SET_STRIPS*w->wheels; i++) {    /* but for the roller that comes into contact */
        const int k = roller_bearing(w, i, 0);
        if (contact[i] == contact[w->wheels + i] && own_mode(w, row, k) != 0
            && own_mode(w, row, k) != own_mode(w, row + 1, k))
            return 1;
    }
    for (int i = 0; i < SET_DISKS_STICK*w->wheels; i++) {
        const int passed = (int)(contact[w->wheels + i] - contact[i]) + w->rollers;
        for (int place = 0; place < w->rollers; place++) {
            const long long before = own_mode(w, row, roller_bearing(w, i, (place + passed)%w->rollers));
            if (before != 0 && before != own_mode(w, row + 1, roller_bearing(w, i, place)))
                return 1;
        }
    }
    return 0;
}

/* Whether the rates of all that is solved for are the same but for roundings. */
static int are_same(const variations_t *w, const lanes_t *one, const lanes_t *other)
{
    double apart = 0, largest = 0;
    for (int a = 0; a < w->known; a++) {
        const double x = one[place_of_core(w, a)][0], y = other[place_of_core(w, a)][0];
        apart = fmax(apart, fabs(x - y)), largest = fmax(largest, fmax(fabs(x), fabs(y)));
    }
    return apart <= w->run->jumps*largest;
}
