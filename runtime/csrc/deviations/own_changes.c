/* What happens to bearings that have rates of their own, axles and rollers where wheels may slip: which of them come to
 * rest, turn on and break away, and the rates before, in between and afterwards. How deviations pass that: own_rests.c,
 * side_by_side.c. */

#if SET_OWN_BEARINGS
/* A change of modes at the state of a row: from those of one row to those of another. */
typedef struct {
    long long row, before, after;
} own_change_t;

#if SET_STRIPS
/* Whether a contact lets go while its wheel moves along its axle: if its roller sticks, it slips as fast as this has
 * turned. */
static int slips_along_axle(const variations_t *w, const own_change_t *e, int i)
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
ALWAYS_INLINE int is_held(const variations_t *w, const own_change_t *e, int k)
{
#if SET_STRIPS
    const int i = k - roller_bearing(w, 0, 0);
    return i < 0 || rests_behind(w, e->row, i) || (sticks_in(w, e->row, i) && !slips_along_axle(w, e, i));
#else
    (void)w, (void)e, (void)k;
    return 1;
#endif
}

/* Whether a bearing takes less once it has broken away. */
ALWAYS_INLINE int jumps_as_it_goes(const variations_t *w, int k)
{
    return w->run->own_most[k] > (1 + w->run->jumps)*w->run->own_sliding[k];
}

ALWAYS_INLINE int stops(const variations_t *w, const own_change_t *e, int k)
{
    return own_mode(w, e->before, k) != 0 && own_mode(w, e->before, k) != own_mode(w, e->after, k) && is_held(w, e, k);
}

/* Whether a massless roller stops on its disk while its contact slips: no speed comes to rest, and no rate jumps. */
ALWAYS_INLINE int settles(const variations_t *w, const own_change_t *e, int k)
{
    return SET_STRIPS && own_mode(w, e->before, k) != 0 && own_mode(w, e->after, k) == 0 && !is_held(w, e, k);
}

/* The mode of a bearing while those that come to rest stay there. */
ALWAYS_INLINE long long mode_at_rest(const variations_t *w, const own_change_t *e, int k)
{
    return stops(w, e, k) ? 0 : own_mode(w, e->before, k);
}

ALWAYS_INLINE int turns_on(const variations_t *w, const own_change_t *e, int k)
{
    return mode_at_rest(w, e, k) != own_mode(w, e->after, k) && !settles(w, e, k);
}

ALWAYS_INLINE int breaks_away(const variations_t *w, const own_change_t *e, int k)
{
    return turns_on(w, e, k) && !stops(w, e, k);
}

enum { BEFORE, RESTING, AFTER, INSTANTS };   /* of a change: resting, while those that come to rest stay there */

/* The mode of a bearing in one of these. */
ALWAYS_INLINE long long mode_of(const variations_t *w, const own_change_t *e, int which, int k)
{
    return which == RESTING ? mode_at_rest(w, e, k) : own_mode(w, which == AFTER ? e->after : e->before, k);
}

/* Let the bearings of the point have the modes of one of these. */
static void put_modes_of(const variations_t *w, const own_change_t *e, int which)
{
    lanes_t *free = 0;
#if SET_GATHERS
    free = w->free_sticks;
#endif
    for (int k = 0; k < MOST_OWN(w); k++) {
        const long long mode = mode_of(w, e, which, k);
        *of_bearing(w, k, w->own_sticks, w->own_sticks + w->wheels, free) = lanes_of(mode == 0);
        *own_torque(w, w->point, k) = lanes_of(-(double)mode*w->run->own_sliding[k]);
    }
}

#if SET_STANDS
#include "deviations/standing.c"
#endif

/* The rates then, with the accelerations of the bearings and what holds those that stick. */
static void rates_of_change(const variations_t *w, const own_change_t *e, int which, lanes_t *rate, double *dot,
                            double *asked)
{
    const long long row = SET_STANDS && which == AFTER ? e->after : e->row;
    put_state(w, row, w->point);
#if SET_STANDS
    if (which == RESTING)
        put_held_at_rest(w, e);
    else
        put_held(w, which == AFTER ? e->after : e->before, -1);
#endif
    put_modes_of(w, e, which);
#if SET_IN_SERIES && !SET_STRIPS
    put_modes_in_contact(w, e->row);
#endif
    rates_at_point(w, row, rate);
    const point_t at = point_of(w, w->vehicle, w->point);
    for (int k = 0; k < MOST_OWN(w); k++)
        dot[k] = own_dot(w, &at, k, 0), asked[k] = own_asked(w, &at, k);
}

#if SET_STRIPS
/* How speeds of wheels along their axles move, over the distance of the rollers' axes from the ground in their middles,
 * as a vector of columns does. */
static void put_axle_speeds_moved(const variations_t *w, int group, lanes_t *own, lanes_t *moved)
{
    lanes_t slip[2*MOST_WHEELS], slip_moved[2*MOST_WHEELS];
    const point_t at = point_of(w, &w->column[group], w->point);
    point_t along = point_of(w, &w->column[group], w->along);
    along.nu = own + POINT_NU, along.core = own + POINT_CORE, along.chi = own + point_chi(w);
    slips_of(w, &at, &along, slip, slip_moved);
    for (int i = 0; i < w->wheels; i++)
        moved[i] = slip_moved[2*i]/w->run->standing[1];
}
#endif

/* The deviations of the rates of some bearings in a row, which w->point has: count x groups. */
static void put_turning(const variations_t *w, const int *of, int count, lanes_t *to)
{
    lanes_t own[point_size(w)];
    memset(own, 0, sizeof own);
    for (int g = 0; g < w->groups; g++) {
        put_moved(w, w->moved, g, own);
        lanes_t *contact = 0, *free = 0;
#if SET_DISKS_STICK
        const int wheels = OWN_WHEELS(w->wheels), chi = point_chi(w), axial = first_momentum(w);
        lanes_t spin[MOST_WHEELS], moved[MOST_WHEELS], spins[FREE(w)], spins_moved[FREE(w)];
        const lanes_t *const at = w->point;
        set_slip_spins_along(wheels, &w->column[g], at, at + chi, at + POINT_CORE + wheels, own, own + chi,
                             own + POINT_CORE + wheels, spin, moved);
        set_spins_from_axial_along(wheels, &w->column[g], at, at + chi, at + axial, own, own + chi, own + axial, spins,
                                   spins_moved);
        contact = moved, free = spins_moved;
#elif SET_STRIPS
        lanes_t axle[MOST_WHEELS];
        put_axle_speeds_moved(w, g, own, axle);
        contact = axle;
#endif
        for (int j = 0; j < count; j++)
            to[j*w->groups + g] = *of_bearing(w, of[j], own + POINT_CORE, contact, free);
    }
}

/* Whether some bearings, so many from one on, have other modes in another row. */
static int modes_differ(const variations_t *w, long long row, long long other, int from, int count)
{
    const long long *const one = w->run->own_mode + row*WITH_SERIES(w) + from;
    return memcmp(one, w->run->own_mode + other*WITH_SERIES(w) + from, count*sizeof *one) != 0;
}

/* For how long they have had the modes of a row; where they never had others, how long the run is. */
static double time_of_own_modes(const variations_t *w, long long row, int from, int count)
{
    const omniroll_variations_t *const run = w->run;
    long long first = row;
    while (first > 0 && !modes_differ(w, first - 1, row, from, count))
        first--;
    return first > 0 ? run->elapsed[row] - run->elapsed[first] : run->elapsed[run->rows - 1];
}

/* The accelerations of bearings before a change and after it, and what holds those that stick. */
typedef struct {
    double *dot[INSTANTS], *asked[INSTANTS];
} own_rates_t;

/* The acceleration that a bearing could have: by what acts on it before and after, and by what it takes. */
static double possible(const variations_t *w, const own_rates_t *rates, int k)
{
    const double inertia = w->run->own_inertia[k];
    const double acting = fabs(rates->dot[BEFORE][k]) + fabs(rates->asked[BEFORE][k])/inertia;
    const double then = fabs(rates->dot[AFTER][k]) + fabs(rates->asked[AFTER][k])/inertia;
    return fmax(acting, then) + w->run->own_most[k]/inertia;
}

static int some_turn_on(const variations_t *w, const own_change_t *e)
{
    int found = 0;
    for (int k = 0; k < MOST_OWN(w); k++)
        found |= turns_on(w, e, k);
    return found;
}

/* Whether bearings change their modes between a row and the next. */
static int changes_bearings(const variations_t *w, long long row)
{
    return modes_differ(w, row, row + 1, 0, WITH_SERIES(w));
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
#endif
