/* Deviations followed along a run, from row to row: through its steps and its switches. A library by itself, with the
 * set's functions and their slopes; a run without derivatives does not load it. */
#include "set_in_lanes.h"

#include "linear.c"
#include "parts.c"
#define FRICTION_LINKAGE static
#include "friction/elimination.c"
#include "along_set.h"
#include "gauss.h"
#include "deviations/variations_calls.h"

#include "deviations/variations.c"
#include "deviations/passages.c"
#include "deviations/small.c"
#include "deviations/tangents.c"
#include "deviations/responses.c"
#include "deviations/changes.c"
#include "deviations/rests.c"
#include "deviations/letting_go.c"
#include "deviations/saltations.c"

/* Arrays of lanes, and of numbers at nodes, with their sizes. */
static void lay_out_lanes(variations_t *w, parts_t *parts)
{
    const int groups = w->groups, wheels = w->wheels, ground = SET_GRIPS*wheels;
    const long long free = SET_GATHERS*FREE(w), in_columns = free*groups, at_nodes = NODES*groups;
    const struct { lanes_t **array; long long lanes; } part[] = {
        {&w->moved, w->size*groups}, {&w->phase.moved, w->size*groups}, {&w->axial, wheels*w->rollers*groups},
        {&w->given, (w->inputs + SET_MOVING*wheels)*groups}, {&w->held, 2*HELD_SIZE}, {&w->point, point_size(w)},
        {&w->along, point_size(w) + groups}, {&w->step.known, (w->feedback + w->inputs + 1)*at_nodes},
        {&w->step.core, w->core*at_nodes}, {&w->step.carried, (wheels + 3)*at_nodes},
        {&w->solving.right, w->equations*at_nodes},
        {&w->solving.memory, blockwise_memory(w->equations, 3, NODES/LANES, groups)}, {&w->contacts.pushed, 12*ground},
        {&w->contacts.yielding, 2*ground}, {&w->contacts.towards, 2*ground}, {&w->contacts.slipping, ground},
        {&w->contacts.turned, 2*ground}, {&w->bearings.sticks, 2*wheels}, {&w->bearings.holding, 4*wheels},
        {&w->bearings.spin_dot, 2*w->rollers*wheels}, {&w->bearings.yaw_mass, 2}, {&w->spins.sticks, free},
        {&w->spins.bearing, free}, {&w->spins.holding, 2*free}, {&w->spins.bearing_along, free},
        {&w->spins.response, free*w->run->models}, {&w->spins.fading, free*w->run->models},
        {&w->spins.torque_moved, in_columns}, {&w->spins.momenta_moved, SET_GATHERS*SUMS(w)*groups},
        {&w->spins.axial_moved, in_columns}, {&w->spins.axial_nodes, free*at_nodes},
        {&w->spins.disks_nodes, free*at_nodes}, {&w->spins.disks, free}, {&w->spins.disks_moved, free},
    };
    for (int k = 0; k < (int)(sizeof part/sizeof *part); k++)
        *part[k].array = lanes_part(parts, part[k].lanes);
}

static void lay_out_nodes(variations_t *w, parts_t *parts)
{
    const long long numbers = w->run->models - 1, equations = w->equations, free = SET_GATHERS*FREE(w);
    const struct { nodes_t **array; long long nodes; } part[] = {
        {&w->slopes.core, equations*w->directions}, {&w->slopes.core_by, numbers*equations},
        {&w->slopes.chi_by, numbers*w->wheels}, {&w->slopes.pose_by, numbers*3},
        {&w->solving.block, equations*equations*NODES}, {&w->spins.disks_by, (w->directions + numbers)*free},
        {&w->spins.axial_by, numbers*free},
    };
    for (int k = 0; k < (int)(sizeof part/sizeof *part); k++)
        *part[k].array = lanes_part(parts, part[k].nodes*(NODES/LANES));
}

/* Numbers, counts and pointers, of which none is longer than a number. */
static void lay_out_numbers(variations_t *w, parts_t *parts)
{
    const int columns = w->columns, equations = w->equations;
    w->phase.momenta = numbers_part(parts, 2*w->wheels);
    w->phase.free_axial = numbers_part(parts, w->wheels*w->rollers);
    w->step.of_coefficients = numbers_part(parts, (w->run->motion.degree + 1)*NODES);
    w->contacts.aimed = numbers_part(parts, w->wheels);
    w->spins.basis = numbers_part(parts, SET_GATHERS*2*SUMS(w));
    w->solving.row = numbers_part(parts, equations);
    w->solving.pivot_row = numbers_part(parts, 3*NODES);
    w->solving.kind = numbers_part(parts, equations*equations);
    w->slopes.is_zero = numbers_part(parts, equations*w->directions);
    w->is_given = numbers_part(parts, w->inputs);
    w->numbered_column = numbers_part(parts, columns);
    w->number_of = numbers_part(parts, columns);
}

/* Returns how many lanes it takes; without memory nothing is there. */
static long long lay_out(variations_t *w, const omniroll_variations_t *run, lanes_t *memory)
{
    const int models = run->models, wheels = run->wheels;
    parts_t parts = {memory, 0};
    w->run = run, w->wheels = wheels, w->rollers = run->rollers_per_wheel, w->columns = run->columns;
    w->groups = (run->columns + LANES - 1)/LANES, w->size = run->size;
    w->known = 3 + core_size(wheels, run->rollers_per_wheel);
    w->core = SET_GATHERS ? first_momentum(w) + 2*wheels : w->known;
    w->feedback = SET_CORE_NEEDS_CHI*wheels + SET_HAS_HEADING;
    w->inputs = SET_MOVING*wheels + HELD_MOMENTA(wheels) + SET_GATHERS*2*wheels;
    w->equations = w->core + SET_TURNS*wheels;
    w->directions = first_turn(w) + SET_TURNS*wheels;
    w->nodes = run->gauss.count, w->blocks = run->gauss.count/LANES;
    w->vehicle = numbers_part(&parts, (models + w->groups)*(long long)(sizeof *w->vehicle/sizeof(double) + 1));
    w->column = w->vehicle + models;
    for (int k = 0; k < models + w->groups; k++) {
        lanes_t *const arrays = lanes_part(&parts, LANES_MODEL_SIZE(wheels, run->rollers_per_wheel));
        if (memory)
            lanes_spread(run->model[k < models ? k : 0], arrays, &w->vehicle[k]);
    }
    lay_out_lanes(w, &parts);
    lay_out_nodes(w, &parts);
    lay_out_numbers(w, &parts);
    return parts.used;
}

long long omniroll_variations_work_size(const omniroll_variations_t *run)
{
    variations_t w;
    return lay_out(&w, run, 0)*LANES;
}

static void prepare(variations_t *w, const omniroll_variations_t *run)
{
    lay_out(w, run, (lanes_t *)run->work);
    w->numbered = 0, w->contacts.aimed_row = -1, w->inside = 0;
    for (int p = 0; p < run->columns; p++)
        if (run->number[p]) {
            lanes_put(run->model[run->number[p]], p%LANES, &w->column[p/LANES]);
            w->numbered_column[w->numbered] = p, w->number_of[w->numbered++] = run->number[p] - 1;
        }
    memset(w->point, 0, point_size(w)*sizeof *w->point);
    memset(w->along, 0, point_size(w)*sizeof *w->along);
    memset(w->held, 0, 2*HELD_SIZE*sizeof *w->held);
    memset(w->contacts.pushed, 0, SET_GRIPS*12*w->wheels*sizeof *w->contacts.pushed);
    memset(w->contacts.yielding, 0, 2*SET_STRIPS*w->wheels*sizeof *w->contacts.yielding);
    memset(w->given, 0, (w->inputs + SET_MOVING*w->wheels)*w->groups*sizeof *w->given);
    memset(w->slopes.carries, 0, sizeof w->slopes.carries);
    if (SET_GATHERS)
        prepare_spins(w);
    const int nodes = w->nodes;
    const double *const integral = run->gauss.integrals;
    take_step(w);
    for (int j = 0; j < nodes; j++)
        for (int k = 0; k < nodes; k++) {
            w->step.once[j].node[k] = integral[j*nodes + k];
            w->step.inverse[j].node[k] = j == k, w->step.twice[j].node[k] = 0;
            for (int i = 0; i < nodes; i++)
                w->step.twice[j].node[k] += integral[j*nodes + i]*integral[i*nodes + k];
        }
    divide_at_nodes(w, w->step.once, w->step.inverse);
}

/* The axial speeds' deviations at the start of a phase. */
static double *axial_of(const variations_t *w, long long phase)
{
    return w->run->axial + phase*w->wheels*w->rollers*w->columns;
}

/* Begin in a row, in its phase, with the deviations there and at the phase's start. */
static void enter(variations_t *w, long long row, long long phase)
{
    if (SET_HAS_ROLLERS)
        into_lanes(w, axial_of(w, phase), w->wheels*w->rollers, w->axial);
    into_lanes(w, row_of(w, w->run->motion.phase_start[phase]), w->size, w->phase.moved);
    begin_phase(w, phase);
    into_lanes(w, row_of(w, row), w->size, w->moved);
}

/* Inputs of drives as the caller has put them down, and of rollers for the caller. */
static void exchange_given(variations_t *w, long long step)
{
    const int drives = SET_MOVING*w->wheels, inputs = SET_INPUTS*w->wheels;
    double *const given = w->run->given + step*w->run->given_size*w->columns;
    into_lanes(w, given, drives, w->given);
    const int held = held_inputs(w);
    if (SET_GATHERS)
        into_lanes(w, given + inputs*w->columns, held, w->spins.torque_moved);
    else
        out_of_lanes(w, w->given + drives*w->groups, held, given + inputs*w->columns);
    into_lanes(w, given + (inputs + held)*w->columns, drives, w->given + w->inputs*w->groups);
}

/* Whether a wheel that switches grazes its joint, at these rates of what deviates. */
static int grazes(const variations_t *w, const lanes_t *rate, const int *direction)
{
    double fastest = 0;
    int found = 0;
    for (int i = 0; i < w->wheels; i++)
        fastest = fmax(fastest, fabs(rate[3 + i][0]));
    for (int i = 0; i < w->wheels; i++)
        found |= direction[i] && !(fabs(rate[3 + i][0]) > GRAZING*fastest);
    return found;
}

/* Pass what happens between a row and the next where no wheel switches; `knot`: by how much the time deviates (columns)
 * at which drives jump there, or null. Returns whether it was known how; else nothing has been done. */
static int pass_others(variations_t *w, long long row, const double *knot)
{
    double zero[w->columns];
    memset(zero, 0, sizeof zero);
    if (changes_modes(w, row)) {
        const double *const jump = knot ? knot : drives_jump(w, row) ? zero : 0;
        return pass_change(w, &(change_t){row, row, row + 1, jump, 0});
    }
    if (knot) {
        lanes_t before[w->size], after[w->size];
        rates_in_row(w, row, before);
        rates_in_row(w, row + 1, after);
        add_jump(w, before, after, knot);
    }
    return 1;
}

/* Where a step begins in a row with other modes than the one before it had, pass what happens there. Returns whether
 * that was known how; else nothing has been done. */
static int enter_step(variations_t *w, long long row)
{
    if (!SET_BEARINGS_STICK || !w->run->bearings.enters[row])
        return 1;
    if (!pass_change(w, &(change_t){row, row - 1, row, 0, 0}))
        return 0;
    w->run->bearings.enters[row] = 0;
    out_of_lanes(w, w->moved, w->size, row_of(w, row));
    return 1;
}

/* Pass a switch behind a row, with which the next phase begins. Returns whether it is plain: one wheel passes its
 * joint, or some as one, and nothing comes to rest just then; else nothing has been done. */
static int switch_wheels(variations_t *w, long long phase, long long row, const int *direction, int as_one)
{
    lanes_t rate[w->size];
    rates_in_row(w, row, rate);
    if ((!as_one && grazes(w, rate, direction)) || rests_at_switch(w, row))
        return 0;
    pass_switch(w, phase, row, direction, rate);
    if (SET_HOLDS)
        take_what_sticks(w, row + 1);       /* also what goes on to stick through an impact */
    memcpy(w->phase.moved, w->moved, w->size*w->groups*sizeof *w->moved);
    if (SET_HAS_ROLLERS)
        out_of_lanes(w, w->axial, w->wheels*w->rollers, axial_of(w, phase + 1));
    return 1;
}

long long omniroll_follow(const omniroll_variations_t *run, long long first, long long last, long long phase,
                          int as_one)
{
    variations_t work, *const w = &work;
    int direction[MAX_WHEELS];
    prepare(w, run);
    enter(w, first, phase);
    refuse(w, UNKNOWN, 0);
    if (SET_BEARINGS_STICK && run->bearings.enters[first])
        return first;
    for (long long row = first; row < last; row++) {
        if (run->motion.step_of[row] >= 0) {
            exchange_given(w, run->motion.step_of[row]);
            aim_rests(w, row + 1);
            if (!vary_along(w, run->motion.step_of[row], row))
                return -1 - row;
        } else {
            const int switching = directions_of(w, row, direction);
            const int together = as_one && row == first;
            if (switching > 1 && !together)
                return row;
            if (switching ? !switch_wheels(w, phase++, row, direction, together)
                          : !pass_others(w, row, row == first ? run->knot : 0))
                return row;
        }
        out_of_lanes(w, w->moved, w->size, row_of(w, row + 1));
        if (!enter_step(w, row + 1))
            return row + 1;
    }
    return last;
}

/* The step whose number is given begins, in its phase. Returns its row. */
static long long enter_step_of(variations_t *w, long long step, long long phase)
{
    const long long row = w->run->motion.step_rows[step];
    enter(w, row, phase);
    exchange_given(w, step);
    aim_rests(w, row + 1);
    return row;
}

void omniroll_rates_in_steps(const omniroll_variations_t *run, long long count, const long long *steps,
                             const long long *phases, double *rates, int *in_pieces)
{
    variations_t work, *const w = &work;
    prepare(w, run);
    w->inside = 1;
    for (long long k = 0; k < count; k++) {
        const long long row = enter_step_of(w, steps[k], phases[k]);
        begin_step(w, row);
        in_pieces[k] = !vary_piece(w, steps[k], row, w->step.length, rates + k*w->nodes*w->size*w->columns);
    }
}

void omniroll_moved_in_steps(const omniroll_variations_t *run, long long count, const long long *steps,
                             const long long *phases, const double *x, double *moved)
{
    variations_t work, *const w = &work;
    prepare(w, run);
    for (long long k = 0; k < count; k++) {
        const long long row = enter_step_of(w, steps[k], phases[k]);
        begin_step(w, row);
        vary_in_pieces(w, steps[k], row, x[k]);
        if (SET_GATHERS) {
            take_piece(w, x[k], 0);
            put_point(w, steps[k], row, 0);
            put_spins_at_end(w);
            take_step(w);
        }
        out_of_lanes(w, w->moved, w->size, moved + k*w->size*w->columns);
    }
}

/* Make of the deviations of nu and chi in the first row, and of the free rollers' spins (N x (n-1) x P), those of the
 * rest of the core and of the axial speeds. */
static void put_start(variations_t *w, const double *spins)
{
    const int wheels = FIXED_WHEELS(w->wheels), count = FREE(w), chi = point_chi(w);
    lanes_t at[point_size(w)], moved[point_size(w)], spin[count], spin_moved[count], axial[count], axial_moved[count];
    memset(w->axial, 0, wheels*w->rollers*w->groups*sizeof *w->axial);
    memset(moved, 0, sizeof moved);
    memset(spin_moved, 0, sizeof spin_moved);
    for (int g = 0; g < w->groups; g++) {
        put_state(w, 0, at);
        put_moved(w, w->moved, w->groups, g, moved);
        for (int k = 0; k < count; k++) {
            spin[k] = lanes_of(w->run->motion.spins[k]);
            for (int p = g*LANES; p < w->columns && p < (g + 1)*LANES; p++)
                spin_moved[k][p%LANES] = spins[k*w->columns + p];
        }
        set_axial_speeds_along(wheels, &w->column[g], at, at + chi, spin, moved, moved + chi, spin_moved, axial,
                               axial_moved);
        take_free(w, w->run->motion.contact, g, axial_moved);
        take_switched(w, g, -1, at, moved);
    }
    out_of_lanes(w, w->axial, wheels*w->rollers, axial_of(w, 0));
}

void omniroll_begin(const omniroll_variations_t *run, long long row, long long phase, const double *spins)
{
    variations_t work, *const w = &work;
    if (!SET_HOLDS && !spins)
        return;
    prepare(w, run);
    enter(w, row, phase);
    if (spins)
        put_start(w, spins);
    if (SET_HOLDS)
        take_what_sticks(w, row);
    out_of_lanes(w, w->moved, w->size, row_of(w, row));
}

int omniroll_variations_nodes(int nodes)
{
    return nodes < NODES && nodes%LANES == 0 ? nodes : NODES;
}

const char *omniroll_variations_names(int inputs)
{
    return inputs ? SET_INPUT_NAMES : SET_STATE_NAMES;
}
