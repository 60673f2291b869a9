/* How deviations pass where bearings change their modes that have rates of their own: axles and rollers, where wheels
 * may slip under a smooth law.
 *
 * What comes to rest does so by its own bearing alone. With what the torques of bearings do to the rates, R, and to the
 * rates of bearings, W,
 *
 *     d* = d- - R W^-1 ds                              (ds: of the rates that have come to rest)
 *
 * Where one turns back at once, or breaks away, rates jump at a time that deviates. With the rates f* while those that
 * have come to rest stay there,
 *
 *     d+ = d* + (f* - f+) dt,   dt = -ds/s',   dt = -d excess/excess'
 *
 * (runtime/omniroll/engine/roller_deviations.py). Where something only just happens, or several are apart beside the
 * run, the caller decides. */

#if SET_OWN_BEARINGS
/* A change of modes at the state of a row: from those of one row to those of another. */
typedef struct {
    long long row, before, after;
} own_change_t;

ALWAYS_INLINE int stops(const variations_t *w, const own_change_t *e, int k)
{
    return own_mode(w, e->before, k) != 0 && own_mode(w, e->before, k) != own_mode(w, e->after, k);
}

/* The mode of a bearing while those that come to rest stay there. */
ALWAYS_INLINE long long mode_at_rest(const variations_t *w, const own_change_t *e, int k)
{
    return stops(w, e, k) ? 0 : own_mode(w, e->before, k);
}

ALWAYS_INLINE int turns_on(const variations_t *w, const own_change_t *e, int k)
{
    return mode_at_rest(w, e, k) != own_mode(w, e->after, k);
}

ALWAYS_INLINE int breaks_away(const variations_t *w, const own_change_t *e, int k)
{
    return turns_on(w, e, k) && !stops(w, e, k);
}

/* Of a list with a place for each axle, each roller in contact and each free roller that of a bearing. */
ALWAYS_INLINE lanes_t *of_bearing(const variations_t *w, int k, lanes_t *axles, lanes_t *contact, lanes_t *free)
{
    const int roller = k - SET_AXLES_STICK*w->wheels, wheel = roller/w->rollers, place = roller%w->rollers;
    if (roller < 0)
        return axles + k;
    return place == 0 ? contact + wheel : free + wheel*(w->rollers - 1) + place - 1;
}

/* At a point, or as it moves: the acceleration of a bearing, and what holds it. */
ALWAYS_INLINE double own_dot(const variations_t *w, const point_t *at, int k, int lane)
{
    lanes_t *contact = 0, *free = 0;
#if SET_DISKS_STICK
    contact = at->contact_spin_dot, free = at->spins_dot;
#endif
    return (*of_bearing(w, k, at->core_dot, contact, free))[lane];
}

ALWAYS_INLINE double own_asked(const variations_t *w, const point_t *at, int k)
{
    lanes_t *axles = 0, *contact = 0, *free = 0;
#if SET_AXLES_STICK
    axles = at->axle_holding;
#endif
#if SET_DISKS_STICK
    contact = at->contact_holding, free = at->free_holding;
#endif
    return (*of_bearing(w, k, axles, contact, free))[0];
}

/* The torque of a bearing at a point, or as it moves. */
ALWAYS_INLINE lanes_t *own_torque(const variations_t *w, lanes_t *own, int k)
{
    lanes_t *const inputs = own + point_inputs(w), *free = 0;
#if SET_DISKS_STICK
    free = own == w->along ? w->bearing_along : w->free_bearing;
#endif
    return of_bearing(w, k, inputs + SET_BEARING_INPUT*w->wheels, inputs + SET_CONTACT_BEARING_INPUT*w->wheels, free);
}

enum { BEFORE, RESTING, AFTER, INSTANTS };   /* of a change: resting, while those that come to rest stay there */

/* Let the bearings of the point have the modes of one of these. */
static void put_modes_of(const variations_t *w, const own_change_t *e, int which)
{
    lanes_t *free = 0;
#if SET_GATHERS
    free = w->free_sticks;
#endif
    for (int k = 0; k < MOST_OWN(w); k++) {
        const long long mode = which == RESTING ? mode_at_rest(w, e, k)
                                                : own_mode(w, which == AFTER ? e->after : e->before, k);
        *of_bearing(w, k, w->own_sticks, w->own_sticks + w->wheels, free) = lanes_of(mode == 0);
        *own_torque(w, w->point, k) = lanes_of(-(double)mode*w->run->own_sliding[k]);
    }
}

/* The rates then, with the accelerations of the bearings and what holds those that stick. */
static void rates_of_change(const variations_t *w, const own_change_t *e, int which, lanes_t *rate, double *dot,
                            double *asked)
{
    put_state(w, e->row, w->point);
    put_modes_of(w, e, which);
    rates_at_point(w, e->row, rate);
    const point_t at = point_of(w, w->vehicle, w->point);
    for (int k = 0; k < MOST_OWN(w); k++)
        dot[k] = own_dot(w, &at, k, 0), asked[k] = own_asked(w, &at, k);
}

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
#endif
        for (int j = 0; j < count; j++)
            to[j*w->groups + g] = *of_bearing(w, of[j], own + POINT_CORE, contact, free);
    }
}

/* What torques of 1 do where the rates have been computed last: to the rates of all that is known, R (known x count),
 * and to those of the bearings, W (count x count). */
static void put_torques_work(const variations_t *w, const int *of, int count, double *to_known, double *to_own)
{
    const int wheels = OWN_WHEELS(w->wheels);
    const point_t at = point_of(w, w->vehicle, w->point), along = point_of(w, w->vehicle, w->along);
    for (int first = 0; first < count; first += LANES) {
        lanes_t nu_dot[3], moved[3];
        for (int k = first; k < count && k < first + LANES; k++)
            (*own_torque(w, w->along, of[k]))[k - first] = 1;
        rates_along(wheels, &at, &along, nu_dot, moved);
        for (int k = first; k < count && k < first + LANES; k++) {
            for (int a = 0; a < w->known; a++)
                to_known[a*count + k] = (a < 3 ? moved[a] : along.core_dot[a - 3])[k - first];
            for (int j = 0; j < count; j++)
                to_own[j*count + k] = own_dot(w, &along, of[j], k - first);
        }
        take_way_back(w);
    }
}

/* What comes to rest takes the deviations of its rate away: into w->moved, with these deviations, and the modes before,
 * at the point. Returns whether that is determinate. */
static int take_own_rests(variations_t *w, const int *of, int count, lanes_t *torque)
{
    double to_known[w->known*count], to_own[count*count];
    put_torques_work(w, of, count, to_known, to_own);
    if (!solve_small(to_own, count, torque, w->groups))
        return 0;
    for (int a = 0; a < w->known; a++)
        for (int k = 0; k < count; k++)
            for (int g = 0; g < w->groups; g++)
                w->moved[place_of_core(w, a)*w->groups + g] -= to_known[a*count + k]*torque[k*w->groups + g];
    return 1;
}

/* For how long bearings have had the modes of a row; where they never had others, how long the run is. */
static double time_of_own_modes(const variations_t *w, long long row)
{
    const omniroll_variations_t *const run = w->run;
    const long long size = MOST_OWN(w)*(long long)sizeof *run->own_mode;
    long long first = row;
    while (first > 0 && !memcmp(run->own_mode + (first - 1)*MOST_OWN(w), run->own_mode + row*MOST_OWN(w), size))
        first--;
    return first > 0 ? run->elapsed[row] - run->elapsed[first] : run->elapsed[run->rows - 1];
}

/* By how much the times deviate (columns) at which what bearings are asked for comes to its bound: of all that break
 * away, where the rates before have been computed last. Returns 0 where one only just comes there or is not there,
 * where they come there apart, or where no step has said yet how inputs deviate. */
static int put_times_of_break(variations_t *w, const own_change_t *e, const lanes_t *before, double *time)
{
    const int wheels = OWN_WHEELS(w->wheels), count = MOST_OWN(w);
    const double lasted = time_of_own_modes(w, e->before) + w->run->elapsed[e->row] - w->run->elapsed[e->before];
    double side[count], rises[count];
    if (step_before(w, e->row) < 0)
        return 0;
    for (int p = TIMES_ALONE; p < w->columns; p++) {
        const int model = p < 0 ? 0 : w->run->number[p];
        const point_t at = point_of(w, &w->vehicle[model], w->point);
        lanes_t nu_dot[3], nu_dot_along[3];
        put_way(w, e->row, p, before);
        const point_t along = point_of(w, at.vehicle, w->along);
#if SET_LOADS
        put_balance(w, model, 1);
#endif
        rates_along(wheels, &at, &along, nu_dot, nu_dot_along);
#if SET_LOADS
        put_balance(w, 0, 1);
#endif
        double least = INFINITY, most = -INFINITY;
        for (int k = 0; k < count; k++) {
            if (!breaks_away(w, e, k))
                continue;
            const double bound = w->run->own_most[k], asked = own_asked(w, &at, k);
            if (p < 0) {
                side[k] = asked < 0 ? -1 : 1, rises[k] = side[k]*own_asked(w, &along, k);
                if (!(fabs(asked) >= (1 - w->run->reached)*bound && rises[k]*lasted > w->run->only_just*bound))
                    return take_way_back(w), 0;
                continue;
            }
            const double own = -(side[k]*own_asked(w, &along, k) - w->run->own_most_moved[p*count + k])/rises[k];
            least = fmin(least, own), most = fmax(most, own);
        }
        take_way_back(w);
        if (p >= 0 && most - least > LETS_GO_TOGETHER*fmax(fabs(least), fabs(most)))
            return 0;
        if (p >= 0)
            time[p] = least;
    }
    return 1;
}

/* By how much the times deviate at which rates come to zero, and others break away. Returns 0 where they do so apart.
 */
static int put_times_of_change(variations_t *w, const own_change_t *e, const int *of, int count, const lanes_t *turning,
                               const double *dot, double *time)
{
    int breaks = 0;
    for (int k = 0; k < MOST_OWN(w); k++)
        breaks += breaks_away(w, e, k);
    if (breaks) {
        double unused[2*MOST_OWN(w)];
        lanes_t before[w->size];
        rates_of_change(w, e, BEFORE, before, unused, unused + MOST_OWN(w));
        if (!put_times_of_break(w, e, before, time))
            return 0;
    }
    for (int p = 0; p < w->columns; p++) {
        double least = breaks ? time[p] : INFINITY, most = breaks ? time[p] : -INFINITY;
        for (int j = 0; j < count; j++) {
            const double own = -turning[j*w->groups + p/LANES][p%LANES]/dot[of[j]];
            least = fmin(least, own), most = fmax(most, own);
        }
        if (most - least > LETS_GO_TOGETHER*fmax(fabs(least), fabs(most)))
            return 0;
        time[p] = least;
    }
    return 1;
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

/* List those that come to rest. Returns how many, or -1 where one only just does, or where one sticks afterwards by all
 * that it takes. */
static int list_stops(const variations_t *w, const own_change_t *e, const own_rates_t *rates, int *of)
{
    int count = 0;
    for (int k = 0; k < MOST_OWN(w); k++) {
        const double held = fabs(rates->asked[AFTER][k]);
        if (own_mode(w, e->after, k) == 0 && held >= (1 - w->run->reached)*w->run->own_most[k])
            return -1;
        if (!stops(w, e, k))
            continue;
        if (fabs(rates->dot[BEFORE][k]) <= w->run->only_just*possible(w, rates, k))
            return -1;
        of[count++] = k;
    }
    return count;
}

/* Whether rates jump as bearings turn on. */
static int own_rates_jump(const variations_t *w, const own_change_t *e, const own_rates_t *rates)
{
    for (int k = 0; k < MOST_OWN(w); k++) {
        const double jump = rates->dot[RESTING][k] - rates->dot[AFTER][k];
        if (turns_on(w, e, k) && fabs(jump) > w->run->jumps*possible(w, rates, k))
            return 1;
    }
    return 0;
}

static int some_turn_on(const variations_t *w, const own_change_t *e)
{
    int found = 0;
    for (int k = 0; k < MOST_OWN(w); k++)
        found |= turns_on(w, e, k);
    return found;
}

/* Pass a change of modes. Returns whether it was one of those above; else nothing has been done. */
static int pass_own_change(variations_t *w, const own_change_t *e)
{
    const int bearings = MOST_OWN(w), groups = w->groups;
    double memory[2*INSTANTS*bearings], time[w->columns];
    lanes_t rate[INSTANTS][w->size];
    own_rates_t rates;
    int of[bearings];
    for (int m = 0; m < INSTANTS; m++)
        rates.dot[m] = memory + 2*m*bearings, rates.asked[m] = rates.dot[m] + bearings;
    rates_of_change(w, e, AFTER, rate[AFTER], rates.dot[AFTER], rates.asked[AFTER]);
    rates_of_change(w, e, BEFORE, rate[BEFORE], rates.dot[BEFORE], rates.asked[BEFORE]);
    const int count = list_stops(w, e, &rates, of);
    if (count < 0)
        return 0;
    lanes_t turning[count*groups + 1], torque[count*groups + 1];
    put_turning(w, of, count, turning);
    memcpy(torque, turning, count*groups*sizeof *torque);
    int jump = some_turn_on(w, e);
    if (jump) {
        rates_of_change(w, e, RESTING, rate[RESTING], rates.dot[RESTING], rates.asked[RESTING]);
        jump = own_rates_jump(w, e, &rates);
    }
    if (jump && !put_times_of_change(w, e, of, count, turning, rates.dot[BEFORE], time))
        return 0;
    rates_of_change(w, e, BEFORE, rate[BEFORE], rates.dot[BEFORE], rates.asked[BEFORE]);
    if (count && !take_own_rests(w, of, count, torque))
        return 0;
    for (int p = 0; p < w->columns && jump; p++)
        for (int k = 0; k < w->size; k++)
            w->moved[k*groups + p/LANES][p%LANES] += (rate[RESTING][k][0] - rate[AFTER][k][0])*time[p];
    return 1;
}

/* Whether bearings change their modes between two rows. */
static int own_modes_differ(const variations_t *w, long long row, long long other)
{
    const long long *const one = w->run->own_mode + row*MOST_OWN(w);
    return memcmp(one, w->run->own_mode + other*MOST_OWN(w), MOST_OWN(w)*sizeof *one) != 0;
}

static int changes_bearings(const variations_t *w, long long row) { return own_modes_differ(w, row, row + 1); }

/* Whether something else happens between a row and the next: a drive jumps, or a load vanishes or comes back. */
static int others_jump(const variations_t *w, long long row)
{
    const double *const before = w->run->drive + row*SET_INPUTS*w->wheels, *const after = before + SET_INPUTS*w->wheels;
    for (int k = 0; k < SET_MOVING*w->wheels; k++) {
        const int input = k/w->wheels;
        if (input != SET_BEARING_INPUT && input != SET_CONTACT_BEARING_INPUT
            && fabs(after[k] - before[k]) > w->run->jumps*fmax(fabs(after[k]), fabs(before[k])))
            return 1;
    }
    for (int i = 0; i < w->wheels; i++)
        if (carries_in(w, row, i) != carries_in(w, row + 1, i))
            return 1;
    return 0;
}

/* Pass it. Returns whether it was one of those above; else nothing has been done. */
static int pass_bearings(variations_t *w, long long row)
{
    return !others_jump(w, row) && pass_own_change(w, &(own_change_t){row, row, row + 1});
}

/* The same where a step begins in a row with other modes than the one before it had. */
static int enter_step(variations_t *w, long long row)
{
    return pass_own_change(w, &(own_change_t){row, row - 1, row});
}

/* Whether a bearing comes to rest, or turns back, just as a wheel switches behind a row. */
static int rests_at_switch(const variations_t *w, long long row)
{
    const long long *const contact = w->run->contact + row*w->wheels;
    for (int i = 0; i < SET_AXLES_STICK*w->wheels; i++)
        if (own_mode(w, row, i) != 0 && own_mode(w, row, i) != own_mode(w, row + 1, i))
            return 1;
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
