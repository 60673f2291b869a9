/* How deviations pass a switch: the rule of the switch with its slopes, and the deviation of its time. With the map g
 * of the switch and the rates f before and after it,
 *
 *     d+ = g' (d- + f- dt) - f+ dt,   dt = -dchi_i/chi_i'
 *
 * (the saltation matrix). The columns stand in the lanes. */

#define GRAZING 1e-6                /* of the fastest wheel's rate: a slower wheel grazes its joint     */

/* Rows of numbers (rows x columns) into vectors, and back. */
static void into_lanes(const variations_t *w, const double *from, int rows, lanes_t *to)
{
    memset(to, 0, rows*w->groups*sizeof *to);
    for (int k = 0; k < rows; k++)
        memcpy(to + k*w->groups, from + (long long)k*w->columns, w->columns*sizeof *from);
}

static void out_of_lanes(const variations_t *w, const lanes_t *from, int rows, double *to)
{
    for (int k = 0; k < rows; k++)
        memcpy(to + (long long)k*w->columns, from + k*w->groups, w->columns*sizeof *to);
}

static double *row_of(const variations_t *w, long long row)
{
    return w->run->moved + row*w->size*w->columns;
}

/* The rates of all that deviates at the point, which is the state in a row; of the row itself what contacts do. */
NEVER_INLINE void rates_at_point(const variations_t *w, long long row, lanes_t *rate)
{
    const int wheels = FIXED_WHEELS(w->wheels);
    const point_t at = point_of(w, w->vehicle, w->point), along = point_of(w, w->vehicle, w->along);
    lanes_t moved[MAX_WHEELS + 3];
    const lanes_t zero[3] = {{0}};
    if (SET_GRIPS)
        put_forces_on_contacts(w, row);
    rates_along(wheels, &at, &along, rate, moved);
    if (SET_SLIPS)
        memcpy(rate + 3, at.core, wheels*sizeof *rate);
    else
        set_wheel_speeds_along(wheels, w->vehicle, w->point, zero, rate + 3, moved);
    set_pose_rates_along(wheels, w->vehicle, w->point, at.heading, zero, zero[0], rate + 3 + wheels, moved);
    for (int k = 0; k < w->known - 3; k++)
        rate[6 + wheels + k] = at.core_dot[k];
}

/* The rates in a row of all that deviates: one number in all lanes. The row's state stands in w->point then. */
static void rates_in_row(const variations_t *w, long long row, lanes_t *rate)
{
    put_state(w, row, w->point);
    put_held(w, row, -1);
    put_bearing_modes(w, row);
    rates_at_point(w, row, rate);
}

/* Why a row is not passed. */
typedef enum { UNKNOWN, RESTS_ONLY_JUST, LETS_GO_ONLY_JUST, HAPPENS_APART } why_t;

/* Returns 0. */
static int refuse(const variations_t *w, why_t why, int column)
{
    w->run->why[0] = (int)why, w->run->why[1] = column;
    return 0;
}

/* Rates jump at times that deviate (columns). */
static void add_jump(variations_t *w, const lanes_t *before, const lanes_t *after, const double *time)
{
    for (int p = 0; p < w->columns; p++)
        for (int k = 0; k < w->size; k++)
            w->moved[k*w->groups + p/LANES][p%LANES] += (before[k][0] - after[k][0])*time[p];
}

/* The physical roller at a free place of a wheel. */
ALWAYS_INLINE int roller_at(const variations_t *w, const long long *contact, int wheel, int slot)
{
    return (int)((contact[wheel] + slot + 1)%w->rollers);
}

/* Axial speeds' deviations of the free rollers by place, from those by physical roller. */
ALWAYS_INLINE void put_free(const variations_t *w, const long long *contact, int group, lanes_t *free)
{
    for (int i = 0; i < w->wheels; i++)
        for (int s = 0; s < w->rollers - 1; s++)
            free[i*(w->rollers - 1) + s] = w->axial[(i*w->rollers + roller_at(w, contact, i, s))*w->groups + group];
}

ALWAYS_INLINE void take_free(variations_t *w, const long long *contact, int group, const lanes_t *free)
{
    for (int i = 0; i < w->wheels; i++)
        for (int s = 0; s < w->rollers - 1; s++)
            w->axial[(i*w->rollers + roller_at(w, contact, i, s))*w->groups + group] = free[i*(w->rollers - 1) + s];
}

/* The free rollers' axial speeds in a row, by place. */
static void axial_in_row(const variations_t *w, long long row, lanes_t *axial)
{
    const int wheels = FIXED_WHEELS(w->wheels), count = FREE(w);
    lanes_t spins[count], spins_moved[count];
    for (int k = 0; k < count; k++)
        spins[k] = lanes_of(w->run->motion.spins[row*count + k]), spins_moved[k] = lanes_of(0);
    lanes_t zero[MAX_WHEELS + 3] = {{0}}, moved[count];
    put_state(w, row, w->point);
    set_axial_speeds_along(wheels, w->vehicle, w->point, w->point + point_chi(w), spins, zero, zero, spins_moved, axial,
                           moved);
}

/* A phase begins in a row: what it holds constant, and how that deviates. */
static void begin_phase(variations_t *w, long long phase)
{
    if (!SET_HAS_ROLLERS)
        return;
    const int wheels = FIXED_WHEELS(w->wheels), count = FREE(w);
    const long long row = w->run->motion.phase_start[phase];
    lanes_t axial[count], moved[count], momenta[2*MAX_WHEELS], momenta_moved[2*MAX_WHEELS];
    axial_in_row(w, row, axial);
    for (int k = 0; k < count; k++)
        w->phase.free_axial[k] = axial[k][0];
    for (int g = 0; g < w->groups && SET_HOLDS_MOMENTA; g++) {
        put_free(w, w->run->motion.contact + row*wheels, g, moved);
        set_momenta_along(wheels, &w->column[g], axial, moved, momenta, momenta_moved);
        for (int k = 0; k < 2*wheels; k++) {
            w->phase.momenta[k] = momenta[k][0];
            w->given[(SET_MOVING*wheels + k)*w->groups + g] = momenta_moved[k];
        }
    }
}

/* +1 or -1 where a wheel's contact has passed on between two rows, else 0; how many have. */
static int directions_of(const variations_t *w, long long row, int *direction)
{
    const long long *const contact = w->run->motion.contact + row*w->wheels;
    int count = 0;
    for (int i = 0; i < w->wheels; i++) {
        const long long passed = (contact[w->wheels + i] - contact[i] + w->rollers)%w->rollers;
        direction[i] = passed == 1 ? -1 : passed == w->rollers - 1 ? 1 : 0;
        count += direction[i] != 0;
    }
    return count;
}

/* Deviations of the free rollers' axial speeds, where they follow from the core: later in the phase than `before`. */
static void follow_axial(variations_t *w, int group, const long long *contact, const lanes_t *before,
                         const lanes_t *before_moved, const lanes_t *after, const lanes_t *after_moved,
                         double elapsed, lanes_t elapsed_moved)
{
    const int wheels = FIXED_WHEELS(w->wheels), count = FREE(w);
    lanes_t axial[count], moved[count], later[count], later_moved[count];
    for (int k = 0; k < count; k++)
        axial[k] = lanes_of(w->phase.free_axial[k]);
    put_free(w, contact, group, moved);
    axial_later_along(wheels, &w->column[group], after, after + point_chi(w), axial, before + POINT_CORE,
                      after + POINT_CORE, lanes_of(elapsed), after_moved, after_moved + point_chi(w), moved,
                      before_moved + POINT_CORE, after_moved + POINT_CORE, elapsed_moved, later, later_moved);
    take_free(w, contact, group, later_moved);
}

/* nu after the switch, from `at` and its deviations `moved`; chi in them is that after the switch, chi_before and
 * chi_moved were before it. entering: deviations of the spins of the rollers that come. */
static void strike(const variations_t *w, int group, const int *direction, lanes_t *at, lanes_t *moved,
                   const lanes_t *chi_before, const lanes_t *chi_moved, const lanes_t *spin, const lanes_t *spin_moved)
{
    const int wheels = FIXED_WHEELS(w->wheels), chi = point_chi(w);
    const vehicle_t *const v = &w->column[group];
    lanes_t rate[MAX_WHEELS], rate_moved[MAX_WHEELS], demanded[MAX_WHEELS], demanded_moved[MAX_WHEELS];
    lanes_t leaving[MAX_WHEELS], leaving_moved[MAX_WHEELS], nu[3], nu_moved[3];
    set_wheel_rates_along(wheels, v, at, at + chi, moved, moved + chi, rate, demanded, rate_moved, demanded_moved);
    set_wheel_rates_along(wheels, v, at, chi_before, moved, chi_moved, rate, leaving, rate_moved, leaving_moved);
    for (int i = 0; i < wheels; i++) {
        const double switches = direction[i] != 0;
        demanded[i] = switches*(spin[i] - demanded[i]);
        demanded_moved[i] = switches*(spin_moved[i] - demanded_moved[i]);
        leaving[i] *= SET_HAS_ROLLERS ? 0 : switches;
        leaving_moved[i] *= SET_HAS_ROLLERS ? 0 : switches;
    }
    set_impact_along(wheels, v, at, at + chi, demanded, leaving, moved, moved + chi, demanded_moved, leaving_moved, nu,
                     nu_moved);
    memcpy(at, nu, sizeof nu);
    memcpy(moved, nu_moved, sizeof nu_moved);
}

/* The spins with which the rollers enter that the wheels pass to; those that leave keep their axial speeds. */
static void exchange_rollers(variations_t *w, int group, long long row, const int *direction, const lanes_t *at,
                             const lanes_t *moved, lanes_t *spin, lanes_t *spin_moved)
{
    const int wheels = FIXED_WHEELS(w->wheels), chi = point_chi(w), count = FREE(w), places = w->rollers - 1;
    const long long *const contact = w->run->motion.contact + row*wheels;
    const vehicle_t *const v = &w->column[group];
    lanes_t axial[count], axial_moved[count], spins[count], spins_moved[count];
    lanes_t speed[MAX_WHEELS], speed_moved[MAX_WHEELS];
    axial_in_row(w, row, axial);
    put_free(w, contact, group, axial_moved);
    set_spins_from_axial_along(wheels, v, at, at + chi, axial, moved, moved + chi, axial_moved, spins, spins_moved);
    set_contact_axial_along(wheels, v, at, at + chi, moved, moved + chi, speed, speed_moved);
    for (int i = 0; i < wheels; i++)
        if (direction[i]) {
            const int comes = i*places + (direction[i] > 0 ? places - 1 : 0);
            spin[i] = spins[comes], spin_moved[i] = spins_moved[comes];
            w->axial[(i*w->rollers + (int)contact[i])*w->groups + group] = speed_moved[i];
        }
}

/* Where wheels may slip no speed changes: the entering roller comes with the axial speed that it has. */
static void exchange_contacts(variations_t *w, int group, long long row, const int *direction, lanes_t *moved)
{
    const int wheels = FIXED_WHEELS(w->wheels), first = POINT_CORE + wheels;
    const long long *const leaves = w->run->motion.contact + row*wheels, *const enters = leaves + wheels;
    for (int i = 0; i < wheels; i++)
        if (direction[i]) {
            w->axial[(i*w->rollers + (int)leaves[i])*w->groups + group] = moved[first + i];
            moved[first + i] = w->axial[(i*w->rollers + (int)enters[i])*w->groups + group];
        }
}

/* The state and its deviations after the wheels have switched together, in one vector of columns. */
static void apply_switch(variations_t *w, int group, long long row, const int *direction, lanes_t *at, lanes_t *moved)
{
    const int wheels = FIXED_WHEELS(w->wheels), chi = point_chi(w);
    lanes_t chi_before[MAX_WHEELS], chi_moved[MAX_WHEELS], spin[MAX_WHEELS] = {{0}}, spin_moved[MAX_WHEELS] = {{0}};
    memcpy(chi_before, at + chi, wheels*sizeof *at);
    memcpy(chi_moved, moved + chi, wheels*sizeof *at);
    if (SET_HAS_IMPACT && SET_HAS_ROLLERS)
        exchange_rollers(w, group, row, direction, at, moved, spin, spin_moved);
    for (int i = 0; i < wheels; i++)
        if (direction[i]) {
            at[chi + i] = lanes_of(w->run->motion.y[(row + 1)*w->run->motion.row_size + w->run->place[3 + i]]);
            moved[chi + i] = lanes_of(0);
        }
    if (SET_HAS_IMPACT && w->run->impact)
        strike(w, group, direction, at, moved, chi_before, chi_moved, spin, spin_moved);
    if (SET_HAS_CONTACT_SPEEDS)
        exchange_contacts(w, group, row, direction, moved);
}

#define AXIAL_FOLLOWS (SET_HAS_ROLLERS && !SET_HOLDS_MOMENTA)   /* the rollers' axial speeds follow from the core */

/* Let the time of a row deviate, in one vector of columns: by so much the motions beside the run go on in a phase that
 * began in a row `from`, with such deviations (size x groups) there. */
static void move_time(variations_t *w, int group, long long from, const lanes_t *began, long long row,
                      const lanes_t *rate, lanes_t time)
{
    lanes_t start[point_size(w)], start_moved[point_size(w)], at[point_size(w)], moved[point_size(w)];
    memset(start_moved, 0, sizeof start_moved);
    memset(moved, 0, sizeof moved);
    put_moved(w, began, w->groups, group, start_moved);
    for (int k = 0; k < w->size; k++)
        w->moved[k*w->groups + group] += rate[k]*time;
    if (!AXIAL_FOLLOWS)
        return;
    put_state(w, from, start);
    put_state(w, row, at);
    put_moved(w, w->moved, w->groups, group, moved);
    follow_axial(w, group, w->run->motion.contact + row*w->wheels, start, start_moved, at, moved,
                 w->run->motion.elapsed[row] - w->run->motion.elapsed[from], time);
}

/* Take what the switch has made of a state, whose core begins anew. */
ALWAYS_INLINE void take_switched(variations_t *w, int group, long long row, lanes_t *at, lanes_t *moved)
{
    const int wheels = FIXED_WHEELS(w->wheels), groups = w->groups;
    if (SET_HAS_ROLLERS && SET_CORE_PARTS) {
        const int count = FREE(w);
        lanes_t axial[count], axial_moved[count];
        axial_in_row(w, row + 1, axial);
        put_free(w, w->run->motion.contact + (row + 1)*wheels, group, axial_moved);
        start_core_along(wheels, &w->column[group], at, at + point_chi(w), axial, moved, moved + point_chi(w),
                         axial_moved, at + POINT_CORE, moved + POINT_CORE);
    }
    for (int k = 0; k < w->known; k++)
        w->moved[(k < 3 ? k : 3 + wheels + k)*groups + group] = moved[k];
    for (int i = 0; i < wheels; i++)
        w->moved[(3 + i)*groups + group] = moved[point_chi(w) + i];
}

/* The deviations after the switch between a row and the next, from those before it. The first of the wheels that
 * switch says how the time deviates. rate: of what deviates, before the switch; afterwards those behind it. */
static void pass_switch(variations_t *w, long long phase, long long row, const int *direction, lanes_t *rate)
{
    lanes_t at[point_size(w)], moved[point_size(w)], time[w->groups];
    int first = 0;
    while (!direction[first])
        first++;
    for (int g = 0; g < w->groups; g++) {
        time[g] = -w->moved[(3 + first)*w->groups + g]/rate[3 + first];
        move_time(w, g, w->run->motion.phase_start[phase], w->phase.moved, row, rate, time[g]);
        put_state(w, row, at);
        memset(moved, 0, sizeof moved);
        put_moved(w, w->moved, w->groups, g, moved);
        apply_switch(w, g, row, direction, at, moved);
        take_switched(w, g, row, at, moved);
    }
    begin_phase(w, phase + 1);
    rates_in_row(w, row + 1, rate);
    for (int g = 0; g < w->groups; g++)
        move_time(w, g, row + 1, w->moved, row + 1, rate, -time[g]);
}
