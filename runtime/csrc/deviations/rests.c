/* How deviations pass where slips of contacts and rates of bearings come to rest.
 *
 * What comes to rest does so by its own force or torque alone, and so does its deviation. With what these do to the
 * rates, R, and to the slips and the bearings' rates, W, all that is left of a deviation is
 *
 *     d* = d- - R W^-1 ds                              (ds: of the slips and rates that have come to rest)
 *
 * A slip comes to rest along a direction. On the way there the directions turn without end, so that nodes and roundings
 * would decide what is left across them. Forces that turn take it away, F' = dF/dheading. So the row of the rest is put
 * right first,
 *
 *     d- := d- - R F' l                                (l: 0 = slips of the new d- across their directions) */

/* What comes to rest in a change, as units (responses.c): components of slips, then bearings. */
typedef struct {
    int contacts, count;
    int *unit;
} resting_t;

#if SET_GRIPS
#define MOST_COMPONENTS (2*MOST_WHEELS)
#define MOST_AIMS 8                                     /* rounds of Newton's rule */
#define AIMED 1e-13                                     /* rad: directions are found that turn by no more */
#define IDLE 1e-12              /* of the largest: turns that are no more are rounding */
#define TURNS_NOT 1e-9          /* of its speed towards rest: a slip whose rate across its direction turns by less per
                                 * rad does not turn */

/* List the components of the slips that come to rest behind a row: contacts of massless rollers slip one way alone,
 * where these turn. Returns how many. */
static int list_rests(const variations_t *w, long long row, int *component)
{
    int count = 0;
    for (int i = 0; i < w->wheels; i++) {
        const int first = SET_STRIPS ? !turns_in(w, row, i) : !SET_HAS_CONTACT_SPEEDS;
        for (int c = first; rests_behind(w, row, i) && c < 2; c++)
            component[count++] = 2*i + c;
    }
    return count;
}

/* Whether a slip comes to rest only just in a row, whose rates have been computed last. */
static int grazes_rest(const variations_t *w, const int *component, int count)
{
    const lanes_t *const slip_dot = point_of(w, w->vehicle, w->point).slip_dot;
    for (int k = 0; k < count; k++) {
        const int i = component[k]/2;
        const lanes_t along = slip_dot[2*i]*w->contacts.towards[2*i] + slip_dot[2*i + 1]*w->contacts.towards[2*i + 1];
        if (-along[0] <= w->run->grazes)
            return 1;
    }
    return 0;
}

/* The deviations of the slips in a row, which w->point has: count x groups. */
static void put_slips_moved(const variations_t *w, const int *component, int count, lanes_t *to)
{
    lanes_t slip[MOST_COMPONENTS], moved[MOST_COMPONENTS], own[point_size(w)];
    memset(own, 0, sizeof own);
    for (int g = 0; g < w->groups; g++) {
        put_moved(w, w->moved, g, own);
        const point_t at = point_of(w, &w->column[g], w->point);
        point_t along = point_of(w, &w->column[g], w->along);
        along.nu = own + POINT_NU, along.core = own + POINT_CORE, along.chi = own + point_chi(w);
        slips_of(w, &at, &along, slip, moved);
        for (int k = 0; k < count; k++)
            to[k*w->groups + g] = moved[component[k]];
    }
}

/* Keep of a list of components those of slips whose directions turn. Returns how many. */
static int keep_turns(const variations_t *w, long long row, int *component, int count)
{
#if SET_STRIPS
    int kept = 0;
    for (int k = 0; k < count; k++)
        if (turns_in(w, row, component[k]/2))
            component[kept++] = component[k];
    return kept;
#else
    (void)w, (void)row, (void)component;
    return count;
#endif
}

/* What lies across the direction of contact i. */
ALWAYS_INLINE double across(const variations_t *w, int i, double x, double y)
{
    return y*w->contacts.towards[2*i][0] - x*w->contacts.towards[2*i + 1][0];
}

/* How fast the slips of contacts that come to rest turn with their directions, by rows: what forces do to slips, W
 * (by rows of `count` components), times how the forces turn. */
static void put_turns(const variations_t *w, const int *component, int count, const double *to_slip, double *turns)
{
    for (int k = 0; k < count; k += 2)
        for (int j = 0; j < count; j += 2) {
            double rate[2];
            for (int c = 0; c < 2; c++) {
                const double *const response = to_slip + (k + c)*count + j;
                const lanes_t *const turned = w->contacts.turned + component[j];
                rate[c] = response[0]*turned[0][0] + response[1]*turned[1][0];
            }
            turns[k/2*(count/2) + j/2] = across(w, component[k]/2, rate[0], rate[1]);
        }
}

#if SET_STRIPS
/* A slip that neither falls nor turns, since what stands holds the vehicle there, goes where it goes. */
static void keep_idle(double *turns, int count)
{
    double most = 0;
    for (int n = 0; n < count*count; n++)
        most = fmax(most, fabs(turns[n]));
    for (int k = 0; k < count; k++) {
        int idle = 1;
        for (int j = 0; j < count; j++)
            idle &= fabs(turns[k*count + j]) <= IDLE*most;
        turns[k*count + k] += idle;
    }
}
#endif

/* The turns that bring these slips against their rates, which have been computed last, by Newton's rule. Returns the
 * largest one; 0 where they are not determinate. */
static double find_turns(const variations_t *w, const int *component, int count, const double *to_slip, lanes_t *turn)
{
    const lanes_t *const slip_dot = point_of(w, w->vehicle, w->point).slip_dot;
    const int rests = count/2;
    double turns[rests*rests], most = 0;
    put_turns(w, component, count, to_slip, turns);
    for (int k = 0; k < rests; k++) {
        const lanes_t *const rate = slip_dot + component[2*k], *const towards = w->contacts.towards + component[2*k];
        turns[k*rests + k] -= (1 - TURNS_NOT)*(rate[0][0]*towards[0][0] + rate[1][0]*towards[1][0]);
        turn[k] = lanes_of(-across(w, component[2*k]/2, rate[0][0], rate[1][0]));
    }
#if SET_STRIPS
    keep_idle(turns, rests);
#endif
    if (!solve_small(turns, rests, turn, 1))
        return 0;
    for (int k = 0; k < rests; k++)
        most = fmax(most, fabs(turn[k][0]));
    return most;
}

/* Where contacts go late in the step that ends in a row; without one, where the row says. */
static void begin_aiming(const variations_t *w, long long row, double *heading)
{
    const int wheels = OWN_WHEELS(w->wheels);
    lanes_t slip[2*MOST_WHEELS], moved[2*MOST_WHEELS];
    memcpy(heading, w->run->drive + (row*SET_INPUTS + SET_HEADINGS_INPUT)*wheels, wheels*sizeof *heading);
    if (row == 0 || w->run->step_of[row - 1] < 0)
        return;
    put_point(w, w->run->step_of[row - 1], row - 1, w->blocks - 1);
    const point_t at = point_of(w, w->vehicle, w->point), along = point_of(w, w->vehicle, w->along);
    slips_of(w, &at, &along, slip, moved);
    for (int i = 0; i < wheels; i++)
        heading[i] = atan2(slip[2*i + 1][0], slip[2*i][0]);
}

/* Turn slips that come to rest behind a row to where they go last: against their rates, to which their forces add. */
static void aim_rests(variations_t *w, long long row)
{
    if (!SET_TURNS || row == w->contacts.aimed_row || row + 1 >= w->run->rows || w->run->step_of[row] >= 0)
        return;
    int component[MOST_COMPONENTS];
    const int count = keep_turns(w, row, component, list_rests(w, row, component));
    if (!count)
        return;
    double to_known[w->known*count], to_slip[count*count], most = INFINITY;
    lanes_t rate[w->size], turn[MOST_WHEELS];
    begin_aiming(w, row, w->contacts.aimed);
    w->contacts.aimed_row = row;
    for (int round = 0; round < MOST_AIMS && most > AIMED; round++) {
        rates_in_row(w, row, rate);
        if (round == 0)
            put_responses(w, component, count, to_known, to_slip);
        most = find_turns(w, component, count, to_slip, turn);
        for (int k = 0; most > 0 && k < count/2; k++)
            w->contacts.aimed[component[2*k]/2] += turn[k][0];
    }
}

/* Put deviations right in a row behind which slips come to rest, whose rates have been computed last: take away what
 * they have across their directions, by forces that turn. Returns whether that is determinate. */
static int put_rests_right(const variations_t *w, long long row, const int *component, int count,
                           const double *to_known, const double *to_slip)
{
    const int groups = w->groups, rests = count/2;
    double turns[rests*rests];
    lanes_t slip[count*groups], turn[rests*groups];
    put_turns(w, component, count, to_slip, turns);
    put_slips_moved(w, component, count, slip);
    for (int k = 0; k < rests; k++) {
        const lanes_t *const towards = w->contacts.towards + component[2*k];
        for (int g = 0; g < groups; g++)
            turn[k*groups + g] = slip[(2*k + 1)*groups + g]*towards[0] - slip[2*k*groups + g]*towards[1];
    }
    if (!solve_small(turns, rests, turn, groups))
        return 0;
#if SET_STRIPS                      /* where other wheels hold the vehicle along an axle no slip there turns */
    for (int k = 0; k < rests; k++)
        if (fabs(turns[k*rests + k]) <= SAME/w->run->only_just*w->run->grazes)
            return 0;
#endif
    for (int a = 0; a < w->known; a++)
        for (int k = 0; k < rests; k++) {
            const double *const response = to_known + a*count + 2*k;
            const lanes_t *const turned = w->contacts.turned + component[2*k];
            const lanes_t rate = response[0]*turned[0] + response[1]*turned[1];
            for (int g = 0; g < groups; g++)
                w->moved[place_of_core(w, a)*groups + g] -= rate*turn[k*groups + g];
        }
    out_of_lanes(w, w->moved, w->size, row_of(w, row));
    return 1;
}
#else
#define MOST_COMPONENTS 0
#endif

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

/* How the rate of a row for nu moves, as a vector of columns does. */
static lanes_t rate_moved(const variations_t *w, int row, const lanes_t *own, int group)
{
    lanes_t sum = lanes_of(0);
    for (int c = 0; c < 3 && SET_HOLDS; c++) {
        sum += w->run->hold_row[3*row + c]*own[POINT_NU + c];
        for (int p = group*LANES; p < w->columns && p < (group + 1)*LANES; p++)
            sum[p%LANES] += w->run->hold_row_moved[p*3*MOST_ROWS(w) + 3*row + c]*w->point[POINT_NU + c][0];
    }
    return sum;
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
#elif SET_STRIPS
        lanes_t axle[MOST_WHEELS];
        put_axle_speeds_moved(w, g, own, axle);
        contact = axle;
#endif
        if (SET_SPINS_STICK)
            free = own + POINT_CORE;
        for (int j = 0; j < count; j++)
            to[j*w->groups + g] = row_of_bearing(w, of[j]) >= 0 ? rate_moved(w, row_of_bearing(w, of[j]), own, g)
                                                                : *of_bearing(w, of[j], own + POINT_CORE, contact, free);
    }
}

/* List what comes to rest. */
static resting_t list_resting(const variations_t *w, const change_t *e, int *unit)
{
    resting_t found = {.unit = unit};
#if SET_GRIPS
    if (e->after > e->row)
        found.contacts = list_rests(w, e->row, unit);
#endif
    found.count = found.contacts;
    for (int k = 0; k < MOST_OWN(w); k++)
        if (stops(w, e, k))
            unit[found.count++] = 2*w->wheels + k;
    return found;
}

/* Whether something comes to rest only just, where the rates before have been computed last. */
static int rest_grazes(const variations_t *w, const resting_t *rests, const double *dot, const double *asked)
{
#if SET_GRIPS
    if (grazes_rest(w, rests->unit, rests->contacts))
        return !refuse(w, RESTS_ONLY_JUST, 0);
#endif
    for (int j = rests->contacts; j < rests->count; j++) {
        const int k = rests->unit[j] - 2*w->wheels;
        const double possible = fabs(dot[k]) + (fabs(asked[k]) + w->run->own_most[k])/w->run->own_inertia[k];
        if (fabs(dot[k]) <= w->run->only_just*possible)
            return !refuse(w, RESTS_ONLY_JUST, 0);
    }
    return 0;
}

/* The deviations of what comes to rest, in a row that w->point has: count x groups. */
static void put_rests_moved(const variations_t *w, const resting_t *rests, lanes_t *to)
{
    int of[MOST_OWN(w) + 1];
    for (int j = rests->contacts; j < rests->count; j++)
        of[j - rests->contacts] = rests->unit[j] - 2*w->wheels;
#if SET_GRIPS
    put_slips_moved(w, rests->unit, rests->contacts, to);
#endif
    put_turning(w, of, rests->count - rests->contacts, to + rests->contacts*w->groups);
}

/* By how much the times deviate (columns) at which slips, along their directions, and rates of bearings come to zero.
 * Returns 0 where they do so apart. */
static int put_times_of_stops(const variations_t *w, const resting_t *rests, const double *dot, double *time)
{
    const int groups = w->groups;
    lanes_t moved[rests->count*groups];
    double rate[rests->count];
    int count = 0;
    put_rests_moved(w, rests, moved);
    for (int j = 0; j < rests->count; j++, count++) {
        const int goes = j < rests->contacts, both = goes && j + 1 < rests->contacts
            && rests->unit[j + 1] == rests->unit[j] + 1 && rests->unit[j]%2 == 0;
        rate[count] = goes ? 0 : dot[rests->unit[j] - 2*w->wheels];
        lanes_t sum[groups];
        memset(sum, 0, sizeof sum);
#if SET_GRIPS
        const lanes_t *const slip_dot = point_of(w, w->vehicle, w->point).slip_dot;
        for (int c = j; goes && c <= j + both; c++) {
            const lanes_t towards = w->contacts.towards[rests->unit[c]];
            rate[count] += towards[0]*slip_dot[rests->unit[c]][0];
            for (int g = 0; g < groups; g++)
                sum[g] += towards*moved[c*groups + g];
        }
#endif
        memcpy(moved + count*groups, goes ? sum : moved + j*groups, sizeof sum);
        j += both;
    }
    return put_times_of_zeros(w, moved, rate, count, time);
}

/* Take from rates that have come to rest what rounding has left; and from nu, where the vehicle stands. */
static void take_roundings(variations_t *w, const change_t *e, const resting_t *rests, lanes_t *left)
{
    const int groups = w->groups, wheels = w->wheels;
    if (rests->count > rests->contacts)
        put_rests_moved(w, rests, left);
    for (int j = rests->contacts; j < rests->count; j++) {
        const int roller = rests->unit[j] - 2*wheels - AXLES(w), places = OF_A_WHEEL(w);
        if ((SET_STRIPS && roller >= 0) || row_of_bearing(w, rests->unit[j] - 2*wheels) >= 0)
            continue;                               /* which have no rates of their own */
        const int a = roller < 0 ? 3 + rests->unit[j] - 2*wheels
            : roller%places == 0 ? 3 + wheels + roller/places
                                 : first_momentum(w) + roller/places*(places - 1) + roller%places - 1;
        for (int g = 0; g < groups; g++)
            w->moved[place_of_core(w, a)*groups + g] -= left[j*groups + g];
    }
#if SET_DIRECTIONS
    if (is_still_in(w, e->after))
        memset(w->moved, 0, 3*groups*sizeof *w->moved);
#endif
    (void)e;
}

#if SET_STRIPS
/* A slip that its own force does not move is no speed of its own: other wheels hold the vehicle there. */
static void forget_what_is_held(const variations_t *w, const resting_t *rests, double *to_own)
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
static int put_directions_right(variations_t *w, const change_t *e, const resting_t *rests)
{
#if SET_GRIPS
    int turning[MOST_COMPONENTS];
    memcpy(turning, rests->unit, rests->contacts*sizeof *turning);
    const int turns = SET_TURNS ? keep_turns(w, e->row, turning, rests->contacts) : 0;
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
static int take_rests(variations_t *w, const change_t *e, const resting_t *rests)
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
#endif
    solve_dependent(to_own, count, force, groups);
    take_responses(w, to_known, count, force);
    take_roundings(w, e, rests, force);
    return 1;
}
