/* Rows and steps as the caller gets them, and where a run keeps what it works with. */

/* The parts of run->work. */
typedef struct {
    vehicle_t vehicle;
    int core;
    lanes_t *momenta;               /* the two numbers of each wheel's free rollers                          */
    lanes_t *axial, *later;
    nodes_t *rate_core, *found_core, *slope_core, *core_in_nu;
    coupled_t coupled_speeds;
    elements_t elements, *problem;  /* which of what is at rest sticks; the latter points to the former: a session
                                     * keeps run->work as bytes, which must hold no pointers                 */
    lanes_t *inputs;                /* at the nodes of a step                                                */
    lanes_t *load, *friction;       /* of the contacts                                                       */
    lanes_t *ground_force, *slip_dot;   /* at the last instant, 2 N                                          */
    lanes_t *nu_dot;                /* where run->ground.knows_rates                                         */
    lanes_t *next_share;            /* of wheels that stand on their joints, where they may slip: at the last instant */
    lanes_t *next_before;           /* axial speeds of their next rollers, as work->momenta have them          */
    double *response;               /* of the rates of slips to forces, of contacts that slip               */
    lanes_t *at_core, *core_here, *core_dot, *core_slope, *core_chord;
    double *end_core, *weight, *rise_core;
    lanes_t *held_force;            /* what holds bearings, or wheels that stand                             */
    standing_t *standing;
    at_rest_t list, *at_rest;       /* contacts and bearings, at an instant                                  */
    nodes_t *shared_rows, **shared_row, *shared_turn;   /* of the turns of slips that are found together       */
    bearing_states_t states;
} work_t;

/* Room for contacts and `bearings` at rest, and free rollers `apart`, as elements of friction. */
static void lay_out_at_rest(work_t *work, parts_t *parts, int contacts, int bearings, int apart)
{
    const int count = contacts + bearings, forces = 2*contacts + bearings, held = 3 + 2*contacts;
    const long long doubles = (long long)sizeof(double);
    elements_t problem = {
        .p.matrix = numbers_part(parts, (long long)forces*forces), .p.given = numbers_part(parts, forces),
        .p.mobility = numbers_part(parts, apart), .p.yaw = numbers_part(parts, apart),
        .p.apart_given = numbers_part(parts, apart), .p.bound = numbers_part(parts, apart),
        .p.yaw_rows = numbers_part(parts, forces), .p.equality = numbers_part(parts, held*forces),
        .p.wanted = numbers_part(parts, held),
        .p.element = numbers_part(parts, (count + apart)*((long long)sizeof(friction_element_t)/doubles + 1)),
        .found.force = numbers_part(parts, forces + apart), .found.acceleration = numbers_part(parts, forces + apart),
        .found.pull = numbers_part(parts, 2*count + apart), .found.state = numbers_part(parts, count + apart),
        .reach = numbers_part(parts, forces + apart),
        .memory = numbers_part(parts, (long long)friction_memory(forces, count, apart, held)/doubles + 1),
    };
    at_rest_t list = {
        .which = numbers_part(parts, count + apart), .broken = numbers_part(parts, count + apart),
        .slips = numbers_part(parts, count + apart),
    };
    if (SET_STRIPS) {
        list.turned = numbers_part(parts, count), list.turns = numbers_part(parts, count);
        list.arm = numbers_part(parts, contacts);
    }
    work->list = list, work->at_rest = &work->list;
    work->elements = problem, work->problem = &work->elements;
    if ((SET_HOLDS || SET_STANDS) && work->standing)
        work->standing->problem = work->problem;
}

/* The core, and what is known of it along a step. */
static void lay_out_core(work_t *work, parts_t *parts, long long axial, long long core)
{
    work->later = lanes_part(parts, axial);
    work->rate_core = lanes_part(parts, BLOCKS*core);
    work->at_core = lanes_part(parts, BLOCKS*core);
    work->found_core = lanes_part(parts, BLOCKS*core);
    work->slope_core = lanes_part(parts, BLOCKS*core);
    work->core_in_nu = lanes_part(parts, 3*BLOCKS*core);
    work->core_here = lanes_part(parts, core);
    work->core_dot = lanes_part(parts, core);
    work->core_slope = lanes_part(parts, core);
    work->core_chord = lanes_part(parts, core);
    work->end_core = numbers_part(parts, core);
    work->weight = numbers_part(parts, core);
    work->rise_core = numbers_part(parts, core);
}

/* Loads, and the contacts' forces. */
static void lay_out_ground(work_t *work, parts_t *parts, int wheels)
{
    work->load = lanes_part(parts, wheels);
    work->friction = lanes_part(parts, 2*wheels);
    work->ground_force = lanes_part(parts, 2*wheels);
    work->slip_dot = lanes_part(parts, 2*wheels);
    work->nu_dot = lanes_part(parts, 3);
    work->response = numbers_part(parts, 4*(long long)wheels*wheels);
}

/* What holds bearings, or contacts and bearings, at rest. */
static void lay_out_holding(work_t *work, parts_t *parts)
{
    work->held_force = lanes_part(parts, 3);
    work->standing = numbers_part(parts, (long long)(sizeof(standing_t)/sizeof(double)) + 1);
}

/* Bearings that stick one by one, each in a mode of its own. */
static void lay_out_bearings(work_t *work, parts_t *parts, int wheels, int rollers)
{
    const long long states = max_core_bearings(wheels, rollers);
    work->states.sticks = lanes_part(parts, states);
    work->states.torque = lanes_part(parts, states);
    work->states.holding = lanes_part(parts, states);
    work->states.held = lanes_part(parts, BLOCKS*states);
    work->states.late = numbers_part(parts, states);
    work->states.rate = lanes_part(parts, states);
    work->states.rollers_at = SET_AXLES_STICK ? wheels : 0;
    if (SET_ROLLERS_TURN) {
        work->states.wheels = wheels;
        if (SET_STRIPS) {
            work->states.spin = lanes_part(parts, wheels);
            work->states.takes = numbers_part(parts, wheels);
            work->states.scale = numbers_part(parts, wheels);
            work->states.load = work->load;
            work->states.friction = work->friction;
        }
        if (SET_DISKS_STICK) {
            work->states.dot = lanes_part(parts, states);
            work->states.yaw_mass = lanes_part(parts, 1);
        }
        work->states.now = numbers_part(parts, states);
    }
    if (SET_STANDS) {
        int *const has_part = numbers_part(parts, states);
        if (work->standing)
            work->standing->has_part = has_part;
    }
    if (SET_STANDS) {
        work->shared_rows = lanes_part(parts, (long long)NODES*wheels*wheels*BLOCKS);
        work->shared_row = numbers_part(parts, (long long)NODES*wheels);
        work->shared_turn = lanes_part(parts, (long long)wheels*BLOCKS);
    }
}

/* The parts in `memory`, lanes, after the arrays of the vehicle; returns how many lanes they are. No memory: they are
 * counted. */
static long long lay_out(work_t *work, lanes_t *memory, int wheels, int rollers)
{
    parts_t parts = {memory, LANES_MODEL_SIZE((long long)wheels, (long long)rollers)};
    const long long axial = (long long)wheels*(rollers - 1), core = core_size(wheels, rollers);
    work->core = (int)core;
    work->momenta = lanes_part(&parts, 2*wheels);
    work->axial = lanes_part(&parts, axial);
    if (SET_CORE_PARTS)
        lay_out_core(work, &parts, axial, core);
    work->inputs = lanes_part(&parts, BLOCKS*SET_INPUTS*(long long)wheels);
    if (SET_GRIPS)
        lay_out_ground(work, &parts, wheels);
    if (SET_SHARES)
        work->next_share = lanes_part(&parts, wheels), work->next_before = lanes_part(&parts, wheels);
    if (SET_IS_COUPLED || SET_LOADS_FOLLOW)
        lay_out_coupled(&work->coupled_speeds, &parts, SET_LOADS_FOLLOW ? 3 : coupled_size(wheels) + 3,
                        SET_LOADS_FOLLOW ? 0 : core);
    if (SET_HOLDS || SET_STANDS)
        lay_out_holding(work, &parts);
    if (SET_CORE_BEARINGS)
        lay_out_bearings(work, &parts, wheels, rollers);
    if (SET_STANDS) {
        const int apart = SET_DISKS_STICK ? (int)axial : 0;
        lay_out_at_rest(work, &parts, wheels, (int)max_core_bearings(wheels, rollers) - apart, apart);
    } else if (SET_HOLDS)
        lay_out_at_rest(work, &parts, 0, SET_BEARINGS*wheels, SET_SPINS_STICK ? (int)axial : 0);
    else if (SET_DECIDES)
        lay_out_at_rest(work, &parts, SET_GRIPS ? wheels : 0, 0, (int)max_core_bearings(wheels, rollers));
    return parts.used;
}

/* Whether the axle of a wheel is at rest, and whether it sticks in this phase. */
ALWAYS_INLINE int rests(const omniroll_run_t *run, int wheel)
{
    return SET_STICKS && run->bearings.axle_count && run->bearings.each[wheel].resting;
}

ALWAYS_INLINE int sticks(const omniroll_run_t *run, int wheel)
{
    return SET_STICKS && run->bearings.axle_count && run->bearings.each[wheel].mode == 0;
}

/* Whether a contact slips on the ground in a direction that is an unknown: those of wheels that stand follow from nu. */
ALWAYS_INLINE int slides(const omniroll_run_t *run, int contact)
{
    return !run->ground.grips[contact].sticks && run->ground.grips[contact].carries && !pivots(run, contact);
}

ALWAYS_INLINE int some_slide(const omniroll_run_t *run)
{
    int found = 0;
    for (int i = 0; i < run->wheels; i++)
        found |= slides(run, i);
    return found;
}

/* Guards of the effects, then of turning bearings whose rates follow from nu, then of wheels that stand on their joint. */
ALWAYS_INLINE int all_guards(const omniroll_run_t *run)
{
    return run->acts.guard_count + (SET_HOLDS ? run->hold.guard_count : 0) + (SET_PIVOTS ? run->acts.pivot_guards : 0);
}

/* How many bearings of the set have a mode in each row. */
ALWAYS_INLINE long long max_bearings(int wheels, int rollers)
{
    return (SET_HOLDS ? SET_BEARINGS*wheels : 0) + max_core_bearings(wheels, rollers);
}

static long long row_size(const omniroll_run_t *run)
{
    const int wheels = run->wheels, rollers = run->rollers_per_wheel;
    return 7 + (2 + SET_INPUTS)*wheels + core_size(wheels, rollers) + account_size(wheels) + max_bearings(wheels, rollers);
}

static long long step_size(const omniroll_run_t *run)
{
    return 2 + NODES*(6 + run->wheels + core_size(run->wheels, run->rollers_per_wheel) + account_size(run->wheels));
}

/* The time since the inputs were given, finer than the clock shows. */
ALWAYS_INLINE double since_inputs(const omniroll_run_t *run)
{
    return (run->state.elapsed - run->acts.inputs_elapsed) + (run->state.carry - run->acts.inputs_carry);
}

/* An input as it is now; they are counted over all wheels. */
ALWAYS_INLINE double input_now(const omniroll_run_t *run, int input)
{
    const double slope = run->acts.inputs[SET_INPUTS*run->wheels + input];
    return run->acts.inputs[input] + slope*since_inputs(run);
}

/* The bearing whose torque an input is, or null. */
ALWAYS_INLINE const omniroll_bearing_t *bearing_of_input(const omniroll_run_t *run, int input)
{
    const int kind = input/run->wheels, wheel = input%run->wheels;
    if (run->bearings.axle_count && kind == SET_BEARING_INPUT)
        return run->bearings.each + wheel;
    const int contacts = SET_ROLLERS_TURN || run->bearings.count - run->bearings.core_count > run->bearings.axle_count;
    return contacts && kind == SET_CONTACT_BEARING_INPUT ? run->bearings.each + run->bearings.axle_count + wheel : 0;
}

/* The same as rows show it: of bearings the torque that they take now, also where they hold. */
ALWAYS_INLINE double input_shown(const omniroll_run_t *run, int input)
{
    const omniroll_bearing_t *const bearing = bearing_of_input(run, input);
    return bearing ? bearing->torque : input_now(run, input);
}

/* The bearings' modes in the last row: 0 where one sticks, else the sign of its rate; of those that a scene lacks 0. */
static void put_bearing_modes(const omniroll_run_t *run)
{
    const long long count = max_bearings(run->wheels, run->rollers_per_wheel);
    double *const mode = run->record.rows + row_size(run)*run->record.row_count - SET_INPUTS*run->wheels - count;
    for (int k = 0; k < count; k++)
        mode[k] = k < run->bearings.count ? run->bearings.each[k].mode : 0;
}

static void put_row(omniroll_run_t *run)
{
    double *row = run->record.rows + row_size(run)*run->record.row_count++;
    *row++ = run->state.elapsed;
    for (int k = 0; k < 3; k++) *row++ = run->state.nu[k];
    for (int i = 0; i < run->wheels; i++) *row++ = angle_on_roller(run, i);
    for (int k = 0; k < 3; k++) *row++ = run->state.pose[k];
    if (SET_CORE_PARTS)
        for (int c = 0; c < core_size(run->wheels, run->rollers_per_wheel); c++) *row++ = run->state.core[c];
    for (int k = 0; k < account_size(run->wheels); k++) *row++ = run->state.accounts[k];
    for (int i = 0; i < run->wheels; i++) *row++ = (double)run->state.contact[i];
    put_bearing_modes(run);
    row += max_bearings(run->wheels, run->rollers_per_wheel);
    if (SET_INPUTS)
        for (int k = 0; k < SET_INPUTS*run->wheels; k++)
            *row++ = input_shown(run, k);
}

/* A row after a transition: no step starts at the one before it. */
static void put_row_after(omniroll_run_t *run)
{
    if (run->record.steps && run->record.row_count > 0)
        run->record.steps[(run->record.row_count - 1)*step_size(run)] = 0;
    put_row(run);
}

/* How many numbers of a row are integrated: those behind its time, in the order of the row. */
ALWAYS_INLINE int integrated_size(const omniroll_run_t *run)
{
    return 6 + run->wheels + core_size(run->wheels, run->rollers_per_wheel) + account_size(run->wheels);
}

/* The rates of one of these at the nodes of a step. */
ALWAYS_INLINE const nodes_t *rate_in_step(const omniroll_run_t *run, const step_t *s, int c)
{
    const int wheels = run->wheels, added = core_size(run->wheels, run->rollers_per_wheel);
    const nodes_t *rate = c < 3 ? &s->rate_nu[c] : c < 3 + wheels ? &s->rate_chi[c - 3] : 0;
    if (c >= 3 + wheels && c < 6 + wheels)
        rate = &s->rate_pose[c - 3 - wheels];
    if (SET_CORE_PARTS && c >= 6 + wheels)
        rate = &s->rate_core[c - 6 - wheels];
    if (SET_ACCOUNTS && c >= 6 + wheels + added)
        rate = &s->rate_account[c - 6 - wheels - added];
    (void)added;
    return rate;
}

static void put_step(omniroll_run_t *run, const step_t *s)
{
    if (!run->record.steps)
        return;
    double *out = run->record.steps + (run->record.row_count - 1)*step_size(run);
    *out++ = s->h;
    *out++ = s->event.late;
    for (int c = 0; c < integrated_size(run); c++) {
        const nodes_t *const rate = rate_in_step(run, s, c);
        if (vanishes(rate)) {           /* as of accounts of what does not happen                          */
            memset(out, 0, NODES*sizeof *out);
            out += NODES;
            continue;
        }
        const nodes_t coefficients = times(gauss_legendre, rate);
        for (int k = 0; k < NODES; k++)
            *out++ = coefficients.node[k];
    }
}
