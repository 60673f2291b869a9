/* What happens to contacts and bearings: which of them come to rest, turn on, let go and break away, and the rates
 * before, in between and afterwards. */

#define SAME_DIRECTION 0.999        /* the cosine of the angle between directions of which none is another one     */

/* A change of modes at the state of a row: from those of one row to those of another; NONE: nothing sticks. */
enum { NONE = -1 };
typedef struct {
    long long row, before, after;
    const double *knot;         /* columns: by how much the time deviates at which drives jump there; or null */
    int only;                   /* 0, or 1 + the place of the bearing that alone has its mode of afterwards then */
} change_t;

/* The slips of contacts in a row: 2*wheels. */
static void slips_in_row(const variations_t *w, long long row, lanes_t *slip)
{
    lanes_t state[point_size(w)];
    put_state(w, row, state);
    slips_at(w, state, slip);
}

/* Whether a contact comes to rest as a step ends in a row, and at once slips on in another direction: where it slips
 * along one line alone, the other way. */
static int goes_on(const variations_t *w, long long row, int i)
{
    const int wheels = FIXED_WHEELS(w->wheels), turns = turns_in(w, row, i);
    const double *const heading = w->run->motion.drive + (row*SET_INPUTS + SET_HEADINGS_INPUT)*wheels + i;
    lanes_t slip[2*MAX_WHEELS];
    if (!slides_in(w, row, i) || !slides_in(w, row + 1, i) || turns != turns_in(w, row + 1, i))
        return 0;
    if (!turns)
        return heading[0]*heading[SET_INPUTS*wheels] < 0;
    if (row == 0 || w->run->motion.step_of[row - 1] < 0 || w->run->motion.step_of[row] >= 0
        || cos(heading[SET_INPUTS*wheels] - heading[0]) > SAME_DIRECTION)
        return 0;
    slips_in_row(w, row, slip);
    return hypot(slip[2*i][0], slip[2*i + 1][0]) <= w->run->contacts.slip_rounding[row*wheels + i];
}

/* Whether a contact comes to rest between a row and the next. */
static int rests_behind(const variations_t *w, long long row, int i)
{
    return slides_in(w, row, i) && (sticks_in(w, row + 1, i) || goes_on(w, row, i));
}

/* Whether a contact lets go while its wheel moves along its axle: if its roller sticks, it slips as fast as this has
 * turned. */
static int slips_along_axle(const variations_t *w, const change_t *e, int i)
{
    const int wheels = FIXED_WHEELS(w->wheels);
    lanes_t slip[2*MAX_WHEELS];
    double fastest = 0;
    if (!sticks_in(w, e->row, i) || sticks_in(w, e->after, i))
        return 0;
    slips_in_row(w, e->row, slip);
    for (int j = 0; j < wheels; j++)
        fastest = fmax(fastest, fabs(slip[2*j][0]));
    return fabs(slip[2*i][0]) > fmax(SAME*fastest, w->run->contacts.slip_rounding[e->row*wheels + i]);
}

/* Whether the speed of a bearing is one that what holds it may bring to rest: along the axle of a massless roller where
 * its contact sticks, or comes to rest as well. */
ALWAYS_INLINE int is_held(const variations_t *w, const change_t *e, int k)
{
    const int i = k - roller_bearing(w, 0, 0);
    if (!SET_IN_SERIES || i < 0)
        return 1;
    return SET_STRIPS && (rests_behind(w, e->row, i) || (sticks_in(w, e->row, i) && !slips_along_axle(w, e, i)));
}

/* Whether a bearing comes to rest. */
ALWAYS_INLINE int stops(const variations_t *w, const change_t *e, int k)
{
    const long long before = bearing_mode(w, e->before, k);
    return before != 0 && before != bearing_mode(w, e->after, k) && is_held(w, e, k);
}

/* Whether a massless roller stops on its disk while its contact slips: no speed comes to rest, and no rate jumps. */
ALWAYS_INLINE int settles(const variations_t *w, const change_t *e, int k)
{
    return SET_IN_SERIES && bearing_mode(w, e->before, k) != 0 && bearing_mode(w, e->after, k) == 0 && !is_held(w, e, k);
}

enum { BEFORE, RESTING, AFTER };     /* of a change: resting, while those that come to rest stay there */

/* The mode of a bearing in one of these. */
ALWAYS_INLINE long long mode_of(const variations_t *w, const change_t *e, int which, int k)
{
    if (which == BEFORE && e->before == NONE)
        return 1;
    if (which == RESTING)
        return stops(w, e, k) ? 0 : bearing_mode(w, e->before, k);
    return bearing_mode(w, which == AFTER && (!e->only || e->only == 1 + k) ? e->after : e->before, k);
}

/* Whether a bearing turns afterwards that would rest, or turn the other way, if nothing had happened but rests. */
ALWAYS_INLINE int turns_on(const variations_t *w, const change_t *e, int k)
{
    return mode_of(w, e, RESTING, k) != bearing_mode(w, e->after, k) && !settles(w, e, k);
}

#include "deviations/holding.c"

/* The demand of the ground on massless rollers if they stuck, at the point, and how that moves: where no contact may
 * stick. */
static void put_demand_on_rollers(const variations_t *w, const vehicle_t *v)
{
#if !SET_STRIPS && !SET_DISKS_STICK     /* where these spins have other arguments */
    const int wheels = FIXED_WHEELS(w->wheels), chi = point_chi(w);
    lanes_t spin[MAX_WHEELS], spin_moved[MAX_WHEELS], none[MAX_WHEELS] = {{0}}, sticks[MAX_WHEELS];
    for (int i = 0; i < wheels; i++)
        sticks[i] = lanes_of(1);
    set_slip_spins_along(wheels, v, w->point, w->point + chi, w->point + POINT_CORE, none, sticks, w->along,
                         w->along + chi, w->along + POINT_CORE, none, none, spin, w->bearings.holding + wheels,
                         spin_moved, w->bearings.holding + 3*wheels);
#endif
}

/* The rates then, with the accelerations of the speeds of units and what holds the bearings that stick. */
static void rates_of_change(const variations_t *w, const change_t *e, int which, lanes_t *rate, double *dot,
                            double *demand)
{
    const long long row = which == AFTER ? e->after : e->row, modes = which == AFTER ? e->after : e->before;
    lanes_t tangent[point_size(w)], moved[UNITS(w)];
    put_state(w, row, w->point);
    if (which == RESTING || modes == NONE)
        put_held_in(w, e, which);
    else
        put_held(w, modes, -1);
    for (int k = 0; k < BEARINGS(w); k++)
        put_bearing_mode(w, k, mode_of(w, e, which, k));
    for (int i = 0; i < SET_GRIPS*w->wheels && which == RESTING && e->after > e->row; i++)
        if (rests_behind(w, e->row, i))
            w->point[point_inputs(w) + SET_MODES_INPUT*w->wheels + i] = lanes_of(1);
    rates_at_point(w, row, rate);
    if (SET_SERIES_ALONE)
        put_demand_on_rollers(w, w->vehicle);
    memset(tangent, 0, sizeof tangent);
    put_moved(w, rate, 1, 0, tangent);
    put_speeds_moved(w, w->vehicle, tangent, moved);
    const point_t at = point_of(w, w->vehicle, w->point);
    for (int k = 0; k < UNITS(w); k++)
        dot[k] = moved[k][0];
    for (int k = 0; k < BEARINGS(w); k++)
        demand[k] = demand_on_bearing(w, &at, k);
}

/* Whether contacts or bearings have other modes in another row. */
static int modes_differ(const variations_t *w, long long row, long long other)
{
    int found = 0;
    for (int i = 0; i < w->wheels; i++)
        found |= sticks_in(w, row, i) != sticks_in(w, other, i);
    for (int k = 0; k < BEARINGS(w); k++)
        found |= bearing_mode(w, row, k) != bearing_mode(w, other, k);
    return found;
}

/* For how long contacts and bearings have had the modes of a row; where they never had others, and wheels may slip, how
 * long the run is. */
static double time_of_modes(const variations_t *w, long long row)
{
    const double *const elapsed = w->run->motion.elapsed, duration = elapsed[w->run->motion.rows - 1];
    long long first = row;
    while (first > 0 && !modes_differ(w, first - 1, row))
        first--;
    return first > 0 || SET_HOLDS ? elapsed[row] - elapsed[first] : duration;
}

/* Whether contacts slip on (1) behind a rest, or bearings turn on (2). */
enum { SLIPS_ON = 1, TURNS_ON = 2 };
static int what_goes_on(const variations_t *w, const change_t *e)
{
    int found = 0;
    for (int i = 0; i < w->wheels && e->after > e->row; i++)
        found |= goes_on(w, e->row, i)*SLIPS_ON;
    for (int k = 0; k < BEARINGS(w); k++)
        found |= turns_on(w, e, k)*TURNS_ON;
    return found;
}

/* Whether contacts or bearings change their modes, or the directions in which they move, between a row and the next. */
static int changes_modes(const variations_t *w, long long row)
{
    const change_t e = {row, row, row + 1, 0, 0};
    return modes_differ(w, row, row + 1) || what_goes_on(w, &e);
}

/* Whether a drive jumps between a row and the next. */
static int drives_jump(const variations_t *w, long long row)
{
    const int inputs = SET_INPUTS*w->wheels;
    const double *const before = w->run->motion.drive + row*inputs, *const after = before + inputs;
    for (int k = 0; k < SET_MOVING*w->wheels; k++) {
        const int input = k/w->wheels;
        if (input != SET_BEARING_INPUT && input != SET_CONTACT_BEARING_INPUT
            && fabs(after[k] - before[k]) > w->run->bounds.jumps*fmax(fabs(after[k]), fabs(before[k])))
            return 1;
    }
    return 0;
}

/* Whether a bearing comes to rest, or turns back, just as a wheel switches behind a row; but for a massless roller that
 * comes into contact, and where wheels roll. */
static int rests_at_switch(const variations_t *w, long long row)
{
    const long long *const contact = w->run->motion.contact + row*w->wheels;
    for (int k = 0; k < BEARINGS(w) && !SET_HOLDS; k++) {
        const int roller = k - AXLES(w), places = OF_A_WHEEL(w), i = roller/places;
        const int passed = roller < 0 ? 0 : (int)(contact[w->wheels + i] - contact[i]) + w->rollers;
        const int was = roller < 0 ? k : roller_bearing(w, i, (roller%places + passed)%places);
        const long long before = bearing_mode(w, row, was);
        const int comes = SET_IN_SERIES && roller >= 0 && (SET_SERIES_ALONE || passed != w->rollers);
        if (before != 0 && before != bearing_mode(w, row + 1, k) && !comes)
            return 1;
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
    return apart <= w->run->bounds.jumps*largest;
}
