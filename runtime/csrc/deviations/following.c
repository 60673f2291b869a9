/* Deviations followed along a run, from row to row: through its steps and its switches. A library by itself, with the
 * set's functions and their slopes; a run that is asked for no derivatives does not load it.
 */
#include "set_in_lanes.h"

#include "linear.c"
#include "along_set.h"
#include "gauss.h"
#include "deviations/variations_calls.h"

#include "deviations/variations.c"
#include "deviations/passages.c"
#include "deviations/small.c"
#include "deviations/ways.c"
#include "deviations/responses.c"
#include "deviations/changes.c"
#include "deviations/rests.c"
#include "deviations/letting_go.c"
#include "deviations/saltations.c"

/* Memory laid out part by part, each aligned; without a base its size. */
ALWAYS_INLINE void *part(char *base, long long *size, long long bytes)
{
    void *const found = base ? base + *size : 0;
    *size += (bytes + 127)/128*128;
    return found;
}

/* What contacts and bearings take up. */
static void lay_out_elements(variations_t *w, long long *size, char *base)
{
    const int wheels = w->wheels, groups = w->groups, gathers = SET_GATHERS;
    const long long lane = sizeof(lanes_t), nodes = sizeof(nodes_t), count = gathers*FREE(w)*lane;
    w->contacts.pushed = part(base, size, SET_GRIPS*12*wheels*lane);
    w->contacts.yielding = part(base, size, 2*SET_STRIPS*wheels*lane);
    w->contacts.towards = part(base, size, SET_GRIPS*2*wheels*lane);
    w->contacts.slipping = part(base, size, SET_GRIPS*wheels*lane);
    w->contacts.turned = part(base, size, SET_GRIPS*2*wheels*lane);
    w->contacts.towards_at = part(base, size, SET_GRIPS*2*wheels*nodes);
    w->contacts.slipping_at = part(base, size, SET_GRIPS*wheels*nodes);
    w->contacts.slip_slope = part(base, size, SET_GRIPS*2*wheels*slip_directions(w)*nodes);
    w->contacts.aimed = part(base, size, wheels*(long long)sizeof *w->contacts.aimed);
    w->bearings.sticks = part(base, size, 2*wheels*lane);
    w->bearings.holding = part(base, size, 4*wheels*lane);
    w->bearings.spin_dot = part(base, size, 2*w->rollers*wheels*lane);
    w->bearings.yaw_mass = part(base, size, 2*lane);
    w->spins.sticks = part(base, size, count);
    w->spins.bearing = part(base, size, count);
    w->spins.holding = part(base, size, 2*count);
    w->spins.bearing_along = part(base, size, count);
    w->spins.response = part(base, size, count*w->run->models);
    w->spins.fading = part(base, size, count*w->run->models);
    w->spins.response_moved = part(base, size, count*groups);
    w->spins.fading_moved = part(base, size, count*groups);
    w->spins.torque_moved = part(base, size, count*groups);
    w->spins.momenta_moved = part(base, size, gathers*SUMS(w)*groups*lane);
    w->spins.axial_moved = part(base, size, count*groups);
    w->spins.axial_nodes = part(base, size, NODES*count*groups);
    w->spins.disks = part(base, size, count);
    w->spins.disks_moved = part(base, size, count);
    w->spins.basis = part(base, size, gathers*SUMS(w)*(long long)sizeof *w->spins.basis);
}

/* Points, slopes and columns along a piece of the run. */
static void lay_out_points(variations_t *w, long long *size, char *base)
{
    const int wheels = w->wheels, numbers = w->run->models - 1;
    const long long lane = sizeof(lanes_t), nodes = sizeof(nodes_t), groups = w->groups, equations = w->equations;
    w->axial = part(base, size, wheels*w->rollers*groups*lane);
    w->held = part(base, size, 2*HELD_SIZE*lane);
    w->momenta = part(base, size, 2*wheels*(long long)sizeof(double));
    w->free_axial = part(base, size, wheels*w->rollers*(long long)sizeof(double));
    w->point = part(base, size, point_size(w)*lane);
    w->along = part(base, size, (point_size(w) + groups)*lane);
    w->slope = part(base, size, equations*w->directions*nodes);
    w->core_by = part(base, size, numbers*equations*nodes);
    w->chi_by = part(base, size, numbers*wheels*nodes);
    w->pose_by = part(base, size, numbers*3*nodes);
    w->felt_at = part(base, size, (w->felt + 1)*NODES*groups*lane);
    w->core_at = part(base, size, w->core*NODES*groups*lane);
    w->carried_at = part(base, size, (wheels + 3)*NODES*groups*lane);
    w->weight_in_piece = part(base, size, (w->run->degree + 1)*NODES*(long long)sizeof(double));
    w->solving.row = part(base, size, NODES*equations*(long long)sizeof *w->solving.row);
    w->is_still = part(base, size, equations*w->directions*(long long)sizeof(int));
    w->is_given = part(base, size, w->inputs*(long long)sizeof *w->is_given);
    w->numbered_column = part(base, size, w->run->columns*(long long)sizeof(int));
    w->number_of = part(base, size, w->run->columns*(long long)sizeof(int));
}

static long long lay_out(variations_t *w, const omniroll_variations_t *run, char *base)
{
    const int models = run->models, wheels = run->wheels;
    const long long lane = sizeof(lanes_t);
    long long size = 0;
    w->run = run, w->wheels = wheels, w->rollers = run->rollers_per_wheel, w->columns = run->columns;
    w->groups = (run->columns + LANES - 1)/LANES, w->size = run->size;
    w->known = 3 + core_size(wheels, run->rollers_per_wheel);
    w->core = SET_GATHERS ? first_momentum(w) + 2*wheels : w->known;
    w->felt = SET_FEELS_CHI*wheels + SET_HAS_HEADING;
    w->inputs = SET_MOVING*wheels + HELD_MOMENTA(wheels) + SET_GATHERS*2*wheels;
    w->equations = w->core + SET_TURNS*wheels;
    w->directions = first_turn(w) + SET_TURNS*wheels;
    w->nodes = run->nodes, w->blocks = run->nodes/LANES;
    const long long groups = w->groups, equations = w->equations, unknowns = NODES*equations;
    const long long model = LANES_MODEL_SIZE(wheels, run->rollers_per_wheel)*lane;
    w->vehicle = part(base, &size, models*(long long)sizeof *w->vehicle);
    w->column = part(base, &size, groups*(long long)sizeof *w->column);
    for (int k = 0; k < models + groups; k++) {
        lanes_t *const arrays = part(base, &size, model);
        if (base)
            lanes_spread(run->model[k < models ? k : 0], arrays, k < models ? &w->vehicle[k] : &w->column[k - models]);
    }
    w->moved = part(base, &size, w->size*groups*lane);
    w->began = part(base, &size, w->size*groups*lane);
    w->given = part(base, &size, (w->inputs + SET_MOVING*wheels)*groups*lane);
    w->solving.kind = part(base, &size, equations*equations*(long long)sizeof *w->solving.kind);
    w->solving.block = part(base, &size, equations*equations*NODES*(long long)sizeof(nodes_t));
    w->solving.right = part(base, &size, unknowns*groups*lane);
    w->solving.pivot_row = part(base, &size, 3*NODES*(long long)sizeof *w->solving.pivot_row);
    w->solving.memory = part(base, &size, blockwise_memory(w->equations, 3, NODES/LANES, w->groups)*lane);
    lay_out_points(w, &size, base);
    lay_out_elements(w, &size, base);
    return size;
}

long long omniroll_variations_work_size(const omniroll_variations_t *run)
{
    variations_t w;
    return lay_out(&w, run, 0)/(long long)sizeof(double);
}

/* The inverse of T. */
static void put_inverse(variations_t *w)
{
    const int blocks = w->blocks;
    for (int j = 0; j < w->nodes; j++) {
        lanes_t *const row = w->solving.pivot_row[j] = w->solving.memory + j*2*blocks;
        memcpy(row, w->once[j].lanes, blocks*sizeof *row);
        memset(row + blocks, 0, blocks*sizeof *row);
        row[blocks + j/LANES][j%LANES] = 1;
    }
    solve(&(equations_t){w->solving.pivot_row, w->nodes, blocks, blocks});
    for (int j = 0; j < w->nodes; j++)
        memcpy(w->inverse[j].lanes, w->solving.pivot_row[j] + blocks, blocks*sizeof(lanes_t));
}

static void prepare(variations_t *w, const omniroll_variations_t *run)
{
    lay_out(w, run, (char *)run->work);
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
    if (SET_SLIPS)
        put_own_rates(w);
    if (SET_GATHERS)
        prepare_spins(w);
    const int nodes = w->nodes;
    const double *const integral = run->gauss_integral;
    take_step(w);
    for (int j = 0; j < nodes; j++)
        for (int k = 0; k < nodes; k++) {
            w->once[j].node[k] = integral[j*nodes + k];
            w->twice[j].node[k] = 0;
            for (int i = 0; i < nodes; i++)
                w->twice[j].node[k] += integral[j*nodes + i]*integral[i*nodes + k];
        }
    put_inverse(w);
}

/* Axial speeds' deviations of a phase (columns x wheels x rollers), from the vectors or into them. */
static void exchange_axial(const variations_t *w, long long phase, int out)
{
    const int count = w->wheels*w->rollers;
    double *const own = w->run->axial + phase*w->columns*count;
    for (int p = 0; p < w->columns; p++)
        for (int k = 0; k < count; k++) {
            lanes_t *const lanes = &w->axial[k*w->groups + p/LANES];
            if (out)
                own[p*count + k] = (*lanes)[p%LANES];
            else
                (*lanes)[p%LANES] = own[p*count + k];
        }
}

/* The phase that a row belongs to, with the deviations at its start. */
static void enter_phase(variations_t *w, long long phase)
{
    if (SET_HAS_ROLLERS)
        exchange_axial(w, phase, 0);
    into_lanes(w, row_of(w, w->run->phase_start[phase]), w->size, w->began);
    begin_phase(w, phase);
}

/* Inputs of drives as the caller has put them down, and of rollers for the caller. */
static void exchange_given(variations_t *w, long long step)
{
    const int drives = SET_MOVING*w->wheels, inputs = SET_INPUTS*w->wheels;
    double *const own = w->run->given + step*w->run->given_size*w->columns;
    into_lanes(w, own, drives, w->given);
    const int held = held_inputs(w);
    if (SET_GATHERS)
        into_lanes(w, own + inputs*w->columns, held, w->spins.torque_moved);
    else
        out_of_lanes(w, w->given + drives*w->groups, held, own + inputs*w->columns);
    into_lanes(w, own + (inputs + held)*w->columns, drives, w->given + w->inputs*w->groups);
}

/* Whether a wheel that switches after a row grazes its joint. */
static int grazes(const variations_t *w, long long row, const int *direction)
{
    const int wheels = OWN_WHEELS(w->wheels);
    lanes_t rate[MOST_WHEELS];
    double fastest = 0;
    put_state(w, row, w->point);
    wheel_rates_at(w, w->point, rate);
    for (int i = 0; i < wheels; i++)
        fastest = lanes_abs(rate[i])[0] > fastest ? lanes_abs(rate[i])[0] : fastest;
    for (int i = 0; i < wheels; i++)
        if (direction[i] && !(lanes_abs(rate[i])[0] > GRAZING*fastest))
            return 1;
    return 0;
}

/* A step begins in a row with other modes than the one before it had: pass what happens there. Returns whether it was
 * known how; else nothing has been done. */
static int enter_step(variations_t *w, long long row)
{
    return pass_change(w, &(change_t){row, row - 1, row, 0, 0});
}

/* Whether more happens at a switch behind a row than that one wheel passes its joint. */
static int is_not_plain(const variations_t *w, long long row, const int *direction, int switching)
{
    return switching > 1 || grazes(w, row, direction);
}

/* Pass what happens between a row and the next where no wheel switches; `knot`: by how much the time deviates (columns)
 * at which drives jump there, or null. Returns whether it was known how; else nothing has been done. */
static int pass_others(variations_t *w, long long row, const double *knot)
{
    double still[w->columns];
    memset(still, 0, sizeof still);
    if (changes_modes(w, row)) {
        const double *const jump = knot ? knot : drives_jump(w, row) ? still : 0;
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

/* A step begins in a row: pass what happens there, where that is known. */
static void enter_at(variations_t *w, long long row)
{
    if (!enter_step(w, row))
        return;
    w->run->enters[row] = 0;
    out_of_lanes(w, w->moved, w->size, row_of(w, row));
}

long long omniroll_follow(const omniroll_variations_t *run, long long first, long long last, long long phase,
                                   int as_one)
{
    variations_t own, *const w = &own;
    int direction[MOST_WHEELS];
    prepare(w, run);
    enter_phase(w, phase);
    into_lanes(w, row_of(w, first), w->size, w->moved);
    refuse(w, UNKNOWN, 0);
    if (SET_OWN_BEARINGS && run->enters[first])
        return first;
    for (long long row = first; row < last; row++) {
        if (run->step_of[row] >= 0) {
            exchange_given(w, run->step_of[row]);
            aim_rests(w, row + 1);
            if (!vary_along(w, run->step_of[row], row))
                return -1 - row;
        } else {
            const int switching = directions_of(w, row, direction);
            if (switching && !(as_one && row == first) && is_not_plain(w, row, direction, switching))
                return row;
            if (switching && rests_at_switch(w, row))
                return row;
            if (!switching && !pass_others(w, row, row == first ? run->knot : 0))
                return row;
            if (switching) {
                pass_switch(w, phase++, row, direction);
                if (SET_HOLDS)
                    take_what_sticks(w, row + 1);       /* also what goes on to stick through an impact */
                memcpy(w->began, w->moved, w->size*w->groups*sizeof *w->moved);
                if (SET_HAS_ROLLERS)
                    exchange_axial(w, phase, 1);
            }
        }
        out_of_lanes(w, w->moved, w->size, row_of(w, row + 1));
        if (SET_OWN_BEARINGS && run->enters[row + 1])
            enter_at(w, row + 1);
        if (SET_OWN_BEARINGS && run->enters[row + 1])
            return row + 1;
    }
    return last;
}

/* The step whose number is given begins, in its phase. Returns its row. */
static long long enter_step_of(variations_t *w, long long step, long long own, long long *phase)
{
    const long long row = w->run->step_rows[step];
    if (own != *phase)
        enter_phase(w, *phase = own);
    into_lanes(w, row_of(w, row), w->size, w->moved);
    exchange_given(w, step);
    aim_rests(w, row + 1);
    return row;
}

void omniroll_rates_in_steps(const omniroll_variations_t *run, long long count, const long long *steps,
                             const long long *phases, double *rates, int *in_pieces)
{
    variations_t own, *const w = &own;
    prepare(w, run);
    w->inside = 1;
    long long phase = -1;
    for (long long k = 0; k < count; k++) {
        const long long row = enter_step_of(w, steps[k], phases[k], &phase);
        begin_step(w, row);
        in_pieces[k] = !vary_piece(w, steps[k], row, w->length, rates + k*w->nodes*w->size*w->columns);
    }
}

void omniroll_moved_in_steps(const omniroll_variations_t *run, long long count, const long long *steps,
                             const long long *phases, const double *x, double *moved)
{
    variations_t own, *const w = &own;
    prepare(w, run);
    long long phase = -1;
    for (long long k = 0; k < count; k++) {
        const long long row = enter_step_of(w, steps[k], phases[k], &phase);
        vary_up_to(w, steps[k], row, x[k]);
        out_of_lanes(w, w->moved, w->size, moved + k*w->size*w->columns);
    }
}

void omniroll_begin(const omniroll_variations_t *run, long long row, long long phase)
{
    variations_t own, *const w = &own;
    if (!SET_HOLDS)
        return;
    prepare(w, run);
    enter_phase(w, phase);
    into_lanes(w, row_of(w, row), w->size, w->moved);
    take_what_sticks(w, row);
    out_of_lanes(w, w->moved, w->size, row_of(w, row));
}

int omniroll_variations_nodes(int nodes)
{
    return nodes < NODES && nodes%LANES == 0 ? nodes : NODES;
}

const char *omniroll_variations_states(void)
{
    return SET_STATE_NAMES;
}

const char *omniroll_variations_inputs(void)
{
    return SET_INPUT_NAMES;
}
