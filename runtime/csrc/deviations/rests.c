/* How deviations pass where slips of contacts and rates of bearings come to rest.
 *
 * What comes to rest does so by its own force or torque alone, and so does its deviation. With what these do to the
 * rates, R, and to the slips and the bearings' rates, W, what remains of a deviation is
 *
 *     d* = d- - R W^+ ds                              (ds: of the slips and rates that have come to rest)
 *
 * A slip comes to rest along a direction. On the way there the directions turn without end, so that nodes and roundings
 * would decide what remains across them. Forces that turn take it away, F' = dF/dheading. So the row of the rest is put
 * right first,
 *
 *     d- := d- - R F' l                                (l: 0 = slips of the new d- across their directions) */
#define MAX_AIMS 8                                      /* rounds of Newton's rule */
#define AIMED 1e-13                                     /* rad: directions are found that turn by no more */
#define IDLE 1e-12              /* of the largest: turns that are no more are rounding */
#define TURNS_NOT 1e-9          /* of its speed towards rest: a slip whose rate across its direction turns by less per
                                 * rad does not turn */

/* What comes to rest in a change, as units (responses.c): components of slips, then bearings. */
typedef struct {
    int contacts, count;
    int *unit;
} resting_t;

/* List the components of the slips that come to rest behind a row: contacts of massless rollers slip along one line alone
 * where these turn. Of all, or of those whose directions turn. Returns how many. */
static int list_rests(const variations_t *w, long long row, int turning, int *unit)
{
    int count = 0;
    for (int i = 0; i < SET_GRIPS*w->wheels; i++) {
        const int turns = turns_in(w, row, i);
        for (int c = SET_STRIPS ? !turns : !SET_HAS_CONTACT_SPEEDS; c < 2; c++)
            if ((turns || !turning) && rests_behind(w, row, i))
                unit[count++] = 2*i + c;
    }
    return count;
}

/* List what comes to rest. */
static resting_t list_resting(const variations_t *w, const change_t *e, int *unit)
{
    resting_t found = {.unit = unit};
    if (e->after > e->row)
        found.contacts = list_rests(w, e->row, 0, unit);
    found.count = found.contacts;
    for (int k = 0; k < BEARINGS(w); k++)
        if (stops(w, e, k))
            unit[found.count++] = 2*w->wheels + k;
    return found;
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

/* A slip that neither falls nor turns, since what stands holds the vehicle there, goes where it goes. */
static void keep_idle(double *turns, int count)
{
    double largest = 0;
    for (int n = 0; n < count*count; n++)
        largest = fmax(largest, fabs(turns[n]));
    for (int k = 0; k < count; k++) {
        int idle = 1;
        for (int j = 0; j < count; j++)
            idle &= fabs(turns[k*count + j]) <= IDLE*largest;
        turns[k*count + k] += idle;
    }
}

/* The turns that bring these slips against their rates, which have been computed last, by Newton's rule. Returns the
 * largest one; 0 where they are not determinate. */
static double find_turns(const variations_t *w, const int *component, int count, const double *to_slip, lanes_t *turn)
{
    const lanes_t *const slip_dot = point_of(w, w->vehicle, w->point).slip_dot;
    const int rests = count/2;
    double turns[rests*rests], largest = 0;
    put_turns(w, component, count, to_slip, turns);
    for (int k = 0; k < rests; k++) {
        const lanes_t *const rate = slip_dot + component[2*k], *const towards = w->contacts.towards + component[2*k];
        turns[k*rests + k] -= (1 - TURNS_NOT)*(rate[0][0]*towards[0][0] + rate[1][0]*towards[1][0]);
        turn[k] = lanes_of(-across(w, component[2*k]/2, rate[0][0], rate[1][0]));
    }
    if (SET_STRIPS)
        keep_idle(turns, rests);
    if (solve_small(turns, rests, turn, 1, 0) < rests)
        return 0;
    for (int k = 0; k < rests; k++)
        largest = fmax(largest, fabs(turn[k][0]));
    return largest;
}

/* Where contacts go late in the step that ends in a row; without one, where the row says. */
static void begin_aiming(const variations_t *w, long long row, double *heading)
{
    const int wheels = FIXED_WHEELS(w->wheels);
    lanes_t slip[2*MAX_WHEELS];
    memcpy(heading, w->run->motion.drive + (row*SET_INPUTS + SET_HEADINGS_INPUT)*wheels, wheels*sizeof *heading);
    if (row == 0 || w->run->motion.step_of[row - 1] < 0)
        return;
    put_point(w, w->run->motion.step_of[row - 1], row - 1, w->blocks - 1);
    slips_at(w, w->point, slip);
    for (int i = 0; i < wheels; i++)
        heading[i] = atan2(slip[2*i + 1][0], slip[2*i][0]);
}

/* Turn slips that come to rest behind a row to where they go last: against their rates, to which their forces add. */
static void aim_rests(variations_t *w, long long row)
{
    const omniroll_motion_t *const motion = &w->run->motion;
    if (!SET_TURNS || row == w->contacts.aimed_row || row + 1 >= motion->rows || motion->step_of[row] >= 0)
        return;
    int component[2*MAX_WHEELS];
    const int count = list_rests(w, row, 1, component);
    if (!count)
        return;
    double to_known[w->known*count], to_slip[count*count], largest = INFINITY;
    lanes_t rate[w->size], turn[MAX_WHEELS];
    begin_aiming(w, row, w->contacts.aimed);
    w->contacts.aimed_row = row;
    for (int round = 0; round < MAX_AIMS && largest > AIMED; round++) {
        rates_in_row(w, row, rate);
        if (round == 0)
            put_responses(w, component, count, to_known, to_slip);
        largest = find_turns(w, component, count, to_slip, turn);
        for (int k = 0; largest > 0 && k < count/2; k++)
            w->contacts.aimed[component[2*k]/2] += turn[k][0];
    }
}

/* Put deviations right in a row behind which slips come to rest, whose rates have been computed last: take away what
 * they have across their directions, by forces that turn. Returns whether that is determinate. */
static int put_directions_right(variations_t *w, const change_t *e)
{
    int component[2*MAX_WHEELS];
    const int groups = w->groups, count = SET_TURNS && e->after > e->row ? list_rests(w, e->row, 1, component) : 0;
    const int rests = count/2;
    double turns[rests*rests + 1], to_known[w->known*count + 1], to_slip[count*count + 1];
    lanes_t speed[UNITS(w)*groups], force[count*groups + 1];
    if (!count)
        return 1;
    put_responses(w, component, count, to_known, to_slip);
    put_turns(w, component, count, to_slip, turns);
    put_speeds_of_columns(w, speed);
    for (int k = 0; k < rests; k++) {
        const int c = component[2*k];
        const lanes_t *const towards = w->contacts.towards + c;
        for (int g = 0; g < groups; g++)
            force[k*groups + g] = speed[(c + 1)*groups + g]*towards[0] - speed[c*groups + g]*towards[1];
    }
    for (int k = 0; k < rests && SET_STRIPS; k++)   /* where others hold the vehicle along an axle no slip turns */
        if (fabs(turns[k*rests + k]) <= SAME/w->run->bounds.only_just*w->run->bounds.grazes)
            return 0;
    if (solve_small(turns, rests, force, groups, SET_STRIPS ? SAME : 0) < rests)
        return 0;
    for (int k = count - 1; k >= 0; k--)            /* turns become forces, the last one first */
        for (int g = 0; g < groups; g++)
            force[k*groups + g] = w->contacts.turned[component[k]]*force[k/2*groups + g];
    take_responses(w, to_known, count, force);
    out_of_lanes(w, w->moved, w->size, row_of(w, e->row));
    return 1;
}

/* Whether something comes to rest only just, where the rates before have been computed last. */
static int rest_grazes(const variations_t *w, const resting_t *rests, const double *dot, const double *demand)
{
    int found = 0;
    for (int j = 0; j < rests->count; j++) {
        const int unit = rests->unit[j], k = unit - 2*w->wheels;
        const lanes_t *const towards = w->contacts.towards + unit/2*2;
        if (k < 0)
            found |= -(dot[unit/2*2]*towards[0][0] + dot[unit/2*2 + 1]*towards[1][0]) <= w->run->bounds.grazes;
        else {
            const omniroll_bearing_modes_t *const of = &w->run->bearings;
            const double possible = fabs(dot[unit]) + (fabs(demand[k]) + of->bound[k])/of->inertia[k];
            found |= fabs(dot[unit]) <= w->run->bounds.only_just*possible;
        }
    }
    return found && !refuse(w, RESTS_ONLY_JUST, 0);
}

/* By how much the times deviate (columns) at which slips, along their directions, and rates of bearings come to zero.
 * Returns 0 where they do so apart. */
static int put_times_of_stops(const variations_t *w, const resting_t *rests, const double *dot, double *time)
{
    const int groups = w->groups;
    lanes_t speed[UNITS(w)*groups], moved[rests->count*groups];
    double rate[rests->count];
    int count = 0;
    put_speeds_of_columns(w, speed);
    for (int j = 0; j < rests->count; j++) {
        const int unit = rests->unit[j], slips = j < rests->contacts;
        const lanes_t by = slips ? w->contacts.towards[unit] : lanes_of(1);
        if (!slips || j == 0 || unit/2 != rests->unit[j - 1]/2) {       /* a contact has one time for both components */
            memset(moved + count*groups, 0, groups*sizeof *moved);
            rate[count++] = 0;
        }
        rate[count - 1] += by[0]*dot[unit];
        for (int g = 0; g < groups; g++)
            moved[(count - 1)*groups + g] += by*speed[unit*groups + g];
    }
    return put_times_of_zeros(w, moved, rate, count, time);
}

/* A slip that its own force does not move depends on other speeds: other wheels hold the vehicle there. */
static void forget_what_is_held(const variations_t *w, const resting_t *rests, double *to_speed)
{
    const int count = rests->count;
    const double *const inertia = w->run->bearings.inertia, arm = w->run->contacts.standing[1];
    for (int j = 0; j < count; j++) {
        const double size = j < rests->contacts ? inertia[roller_bearing(w, 0, 0)]/(arm*arm)
                                                : inertia[rests->unit[j] - 2*w->wheels];
        for (int k = 0; k < count && fabs(to_speed[j*count + j])*size <= SAME; k++)
            to_speed[j*count + k] = to_speed[k*count + j] = 0;
    }
}

/* Let slips and rates come to rest, behind rates that have been computed last. nu is zero where the vehicle stands. */
static void take_rests(variations_t *w, const change_t *e, const resting_t *rests)
{
    const int count = rests->count, groups = w->groups;
    double to_known[w->known*count], to_speed[count*count];
    lanes_t force[count*groups], speed[UNITS(w)*groups];
    put_responses(w, rests->unit, count, to_known, to_speed);
    put_speeds_of_columns(w, speed);
    for (int j = 0; j < count; j++)
        memcpy(force + j*groups, speed + rests->unit[j]*groups, groups*sizeof *force);
    if (SET_STRIPS)
        forget_what_is_held(w, rests, to_speed);
    solve_small(to_speed, count, force, groups, SAME);
    take_responses(w, to_known, count, force);
    put_held(w, e->after, -1);
    if (w->held[ABSENT][0]*w->held[ABSENT + 1][0]*w->held[ABSENT + 2][0] != 0)
        memset(w->moved, 0, 3*groups*sizeof *w->moved);
}
