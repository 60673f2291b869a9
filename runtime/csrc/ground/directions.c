/* Contacts that slip under Coulomb's friction: their forces at the nodes of a step.
 *
 * Such a force depends on the direction of the slip alone, which turns the faster the slower the slip is, and has no
 * derivative where the slip begins or ends. So the directions at the nodes are unknowns beside the rates: the slips
 * must follow them, 0 = slip across direction. Newton's rule takes into account that the forces turn the slips, with
 * what forces do to slips at the start of the step. So it is as regular where the slip is zero as elsewhere. One contact
 * is solved for after the other, but those that share their motion together. */
#define FAR_FROM_REST 0.2           /* of a slip: forces that turn it by less need no Newton's rule              */
#define ROLLS 0.1                   /* of pi/n: a roller whose wheel turns by less keeps its radius           */
#define SLIP_FOLLOWED (1.0/16)      /* of what is rounding of a slip: a direction that misses it by less is found */
#define ROUNDED_SLIP 4              /* roundings of what friction does in a step are nothing of a slip       */
#define MAX_TURN 1.0                /* in a sweep, as a tangent                                               */
#define GROWS 8                     /* times another row that is subtracted: without sorting, digits are lost       */

#include "ground/loads.c"

/* The force of a contact that slips in the directions at the nodes, and how it turns with them. */
static void force_in_direction(step_t *s, int i)
{
    vehicle_t one_contact;
    one_contact.wheels = 1;
    for (int b = 0; b < BLOCKS; b++) {
        const lanes_t toward[2] = {s->slip.toward[2*i].lanes[b], s->slip.toward[2*i + 1].lanes[b]};
        const lanes_t load = load_at(s, i, b);
        lanes_t force[2], slope[4];
        set_sliding_forces(1, &one_contact, toward, &load, s->contact.friction + 2*i, force, slope);
        for (int k = 0; k < 2; k++) {
            s->slip.push[2*i + k].lanes[b] = force[k];
            s->slip.turned[2*i + k].lanes[b] = slope[2*k + 1]*toward[0] - slope[2*k]*toward[1];
        }
    }
}

/* Contacts that slip and whose massless rollers turn, `corner` of all: what the bearing takes is the force along the axle,
 * which is no given force. Their forces along the rolling directions, in N, and how far they slip along their axles per
 * slip along the rolling direction and per force; 0 of others, whose forces stay. */
static void put_corner_forces(const int wheels, const vehicle_t *vehicle, const int *corner, const lanes_t *chi,
                              const lanes_t *toward, const lanes_t *load, const lanes_t *friction,
                              const lanes_t *torque, lanes_t *push, lanes_t *yield)
{
    lanes_t force[MAX_WHEELS];
    set_corner_forces(wheels, vehicle, chi, toward, load, friction, torque, force, yield);
    for (int i = 0; i < wheels; i++)
        if (corner[i])
            push[2*i] = lanes_of(0), push[2*i + 1] = force[i];
        else
            yield[i] = lanes_of(0);
}

/* Their forces in a step, in a vector of its nodes or at its end, where the wheels have these angles. */
ALWAYS_INLINE void put_corners(const step_t *s, const int wheels, const lanes_t *chi, const lanes_t *toward,
                               lanes_t *push, lanes_t *yield)
{
    put_corner_forces(wheels, s->vehicle, s->contact.corner, chi, toward, s->contact.load, s->contact.friction,
                      s->hold.states->torque + s->hold.states->rollers_at, push, yield);
}

/* The same at a vector of nodes. */
static void forces_in_corners(step_t *s, const int wheels, int b, const lanes_t *chi)
{
    lanes_t toward[2*MAX_WHEELS], push[2*MAX_WHEELS], yield[MAX_WHEELS];
    for (int k = 0; k < 2*wheels; k++)
        toward[k] = s->slip.toward[k].lanes[b], push[k] = s->slip.push[k].lanes[b];
    put_corners(s, wheels, chi, toward, push, yield);
    for (int i = 0; i < wheels; i++) {
        s->slip.yield[i].lanes[b] = yield[i];
        for (int k = 2*i; k < 2*i + 2 && s->contact.corner[i]; k++)
            s->slip.push[k].lanes[b] = push[k], s->slip.turned[k].lanes[b] = lanes_of(0);
    }
}

/* The forces of all contacts: of those that slip in their directions at the nodes. */
static void forces_in_directions(step_t *s, const int wheels)
{
    for (int i = 0; i < wheels; i++)
        if (s->contact.slides[i])
            force_in_direction(s, i);
        else
            memset(s->slip.push + 2*i, 0, 2*sizeof *s->slip.push);
    if (SET_STRIPS) {
        lanes_t chi[MAX_WHEELS];
        for (int i = 0; i < wheels; i++)
            chi[i] = lanes_of(s->chi[i]);
        for (int b = 0; b < BLOCKS; b++)
            forces_in_corners(s, wheels, b, chi);
    }
}

/* The slip velocities in some states, from the core beside nu. */
NEVER_INLINE void slips_of(const int wheels, const vehicle_t *vehicle, const lanes_t *nu, const lanes_t *chi,
                           const lanes_t *core, lanes_t *slip)
{
    slip_velocities(wheels, vehicle, nu, chi, core, slip);
}

/* The rates of the core where they are needed rarely: one place of the library has the kernel for all of them. */
NEVER_INLINE void core_rates_at(const int wheels, const point_t *at, lanes_t *nu_dot)
{
    core_rates(wheels, at, nu_dot);
}

/* Whether a wheel stands in a step: its contact and its axle stick. Its rate by nu is rounding alone. */
ALWAYS_INLINE int stands_in(const step_t *s, int wheel)
{
    return SET_STANDS && s->hold.standing->stands[2*wheel + 1];
}

/* Speeds of contacts that stick follow from nu: into the core that it is part of. */
NEVER_INLINE void wheels_stick(const step_t *s, const int wheels, const lanes_t *nu, const lanes_t *chi, lanes_t *core)
{
    lanes_t rates[MAX_WHEELS];
    rolling_wheels(wheels, s->vehicle, nu, chi, rates);
    for (int i = 0; i < wheels; i++)
        if (s->contact.grips[i])
            core[rates_at(wheels) + i] = stands_in(s, i) ? lanes_of(0) : rates[i];
}

NEVER_INLINE void rollers_stick(const step_t *s, const int wheels, const lanes_t *nu, const lanes_t *chi,
                                lanes_t *core)
{
    lanes_t axial[MAX_WHEELS];
    rolling_axial(wheels, s->vehicle, nu, chi, core, axial);
    for (int i = 0; i < wheels; i++)
        if (s->contact.grips[i])
            core[contact_speeds_at(wheels) + i] = axial[i];
}

/* The slips of a contact at the nodes, along its directions and across them. */
ALWAYS_INLINE void along_and_across(const step_t *s, int i, nodes_t *along, nodes_t *across)
{
    const nodes_t *const x = s->slip.toward + 2*i, *const y = x + 1, *const slip = s->slip.at + 2*i;
    for (int b = 0; b < BLOCKS; b++) {
        along->lanes[b] = slip[0].lanes[b]*x->lanes[b] + slip[1].lanes[b]*y->lanes[b];
        across->lanes[b] = slip[1].lanes[b]*x->lanes[b] - slip[0].lanes[b]*y->lanes[b];
    }
}

/* What forces on a contact do to its slip in a vector of nodes, whose rates without them have been found. */
static void self_response_at(step_t *s, const int wheels, int i, int b, const point_t *point, arrays_t *at,
                            const lanes_t *without)
{
    const double push = s->contact.friction_force;
    for (int k = 0; k < 2; k++) {
        lanes_t nu_dot[3];
        const lanes_t here = at->ground_push[2*i + k];
        at->ground_push[2*i + k] += push;
        core_rates_at(wheels, point, nu_dot);
        at->ground_push[2*i + k] = here;
        for (int j = 0; j < 2; j++)
            s->slip.self_response[4*i + 2*j + k].lanes[b] = (at->slip_dot[2*i + j] - without[2*i + j])/push;
    }
}

/* The response of slips to forces on their own contacts, at the nodes, of those that `ask`: a roller's radius changes
 * as its wheel turns. */
NEVER_INLINE void find_self_responses(step_t *s, const int wheels, const int *ask)
{
    for (int b = 0; b < BLOCKS; b++) {
        arrays_t at;
        lanes_t nu_dot[3], without[2*MAX_WHEELS];
        const point_t point = point_at(s, wheels, b, &at);
        core_rates_at(wheels, &point, nu_dot);
        memcpy(without, at.slip_dot, sizeof *without*2*(size_t)wheels);
        for (int i = 0; i < wheels; i++)
            if (ask[i])
                self_response_at(s, wheels, i, b, &point, &at, without);
    }
    for (int i = 0; i < wheels; i++) {
        s->slip.knows_response[i] |= ask[i];
        s->sweeps += 2*ask[i];
    }
    s->sweeps++;
}

/* What a turn of a contact's directions does to the rates of its slip, per turn at the nodes. */
ALWAYS_INLINE void self_response_to_turn(const step_t *s, int i, nodes_t *rate)
{
    const nodes_t *const response = s->slip.self_response + 4*i, *const turned = s->slip.turned + 2*i;
    for (int j = 0; j < 2; j++)
        for (int b = 0; b < BLOCKS; b++)
            rate[j].lanes[b] = response[2*j].lanes[b]*turned[0].lanes[b]
                + response[2*j + 1].lanes[b]*turned[1].lanes[b];
}

/* What forces on contact j do to component k of the rate of contact i's slip at the start of the step. */
ALWAYS_INLINE const double *response_to_force(const step_t *s, int i, int k, int j)
{
    return s->contact.response + (2*s->contact.place[i] + k)*2*s->contact.responding + 2*s->contact.place[j];
}

/* What a turn of contact j's directions does to the rates of contact i's slip, per turn at the nodes, by what forces do
 * at the start of the step. */
ALWAYS_INLINE void response_to_turn(const step_t *s, int i, int j, nodes_t *rate)
{
    for (int k = 0; k < 2; k++) {
        const double *const response = response_to_force(s, i, k, j);
        for (int b = 0; b < BLOCKS; b++)
            rate[k].lanes[b] = response[0]*s->slip.turned[2*j].lanes[b] + response[1]*s->slip.turned[2*j + 1].lanes[b];
    }
}

/* The power of the time to rest with which a slip across a direction fades that turns as it falls, at the start of the
 * step: how strongly forces that turn take it away, over how fast the slip falls. Below 1 the angle grows. */
static double power_of_turn(const step_t *s, int i, const double *towards, double falls)
{
    nodes_t per_turn[2];
    response_to_turn(s, i, i, per_turn);
    return (per_turn[0].node[0]*towards[1] - per_turn[1].node[0]*towards[0])/falls;
}

/* The row that is largest in a column, from the diagonal on, in the place of the diagonal's. */
static void put_largest_first(nodes_t *column, int k)
{
    int largest = k;
    for (int m = k + 1; m < NODES; m++)
        if (fabs(column[k].node[m]) > fabs(column[k].node[largest]))
            largest = m;
    for (int j = 0; j <= NODES; j++) {
        const double kept = column[j].node[k];
        column[j].node[k] = column[j].node[largest], column[j].node[largest] = kept;
    }
}

/* Gauss's elimination of the columns in vector `first` of the nodes. pivot: one over the diagonal. Returns where some row
 * was subtracted more than GROWS times. */
ALWAYS_INLINE lane_mask_t eliminate_columns(nodes_t *column, const int first, const int sorting, double *pivot)
{
    lane_mask_t grown = {0};
    for (int k = first*LANES; k < (first + 1)*LANES; k++) {
        nodes_t factor;
        if (sorting)
            put_largest_first(column, k);
        pivot[k] = 1/column[k].node[k];
        IN_REGISTERS
        for (int b = first; b < BLOCKS; b++)
            factor.lanes[b] = pivot[k]*column[k].lanes[b];
        for (int m = first*LANES; m <= k; m++)  /* these rows are done                                   */
            factor.node[m] = 0;
        IN_REGISTERS
        for (int b = first; b < BLOCKS; b++)
            grown |= lanes_abs(factor.lanes[b]) > GROWS;
        for (int j = k + 1; j <= NODES; j++) {
            const double by = column[j].node[k];
            IN_REGISTERS
            for (int b = first; b < BLOCKS; b++)
                column[j].lanes[b] -= by*factor.lanes[b];
        }
    }
    return grown;
}

/* What a matrix makes the right side from, by their columns: the right side stands behind them. Returns whether no row
 * grew much, as none does where they are sorted by their pivots. */
ALWAYS_INLINE int solve_columns(nodes_t *column, const int sorting, nodes_t *found)
{
    nodes_t *const right = column + NODES;
    double pivot[NODES];
    lane_mask_t grown = {0};
    IN_REGISTERS
    for (int first = 0; first < BLOCKS; first++)
        grown |= eliminate_columns(column, first, sorting, pivot);
    IN_REGISTERS
    for (int last = BLOCKS - 1; last >= 0; last--)
        for (int k = (last + 1)*LANES - 1; k >= last*LANES; k--) {
            const double value = found->node[k] = right->node[k]*pivot[k];
            IN_REGISTERS
            for (int b = 0; b <= last; b++)
                right->lanes[b] -= value*column[k].lanes[b];
        }
    long long any = 0;
    for (int k = 0; k < LANES; k++)
        any |= grown[k];
    return !any;
}

/* What turns of a contact's directions at the nodes take away across them, and what is across. Where an iterate slips
 * against its direction, forces alone turn the slip: the slip itself would turn it the wrong way round. */
ALWAYS_INLINE void columns_of_turns(const step_t *s, int i, const nodes_t *response, const nodes_t *along,
                                    const nodes_t *across, nodes_t *column)
{
    for (int j = 0; j < NODES; j++) {
        const double x = -s->h*response[1].node[j], y = s->h*response[0].node[j];
        IN_REGISTERS
        for (int b = 0; b < BLOCKS; b++)
            column[j].lanes[b] = gauss_integral[j].lanes[b]
                *(x*s->slip.toward[2*i].lanes[b] + y*s->slip.toward[2*i + 1].lanes[b]);
        column[j].node[j] += fmax(along->node[j], 0);
    }
    column[NODES] = *across;
}

/* The turn of a contact's directions that takes away the slip across them. Of slips that fall the rows need not be
 * sorted; iterates may stray. */
static void turn_by_newton(const step_t *s, int i, const nodes_t *response, const nodes_t *along, const nodes_t *across,
                           nodes_t *turn)
{
    nodes_t column[NODES + 1];
    columns_of_turns(s, i, response, along, across, column);
    if (solve_columns(column, 0, turn))
        return;
    columns_of_turns(s, i, response, along, across, column);
    solve_columns(column, 1, turn);
}

ALWAYS_INLINE double smallest_of(const nodes_t *values)
{
    lanes_t least = values->lanes[0];
    IN_REGISTERS
    for (int b = 1; b < BLOCKS; b++)
        least = lanes_select(values->lanes[b] < least, values->lanes[b], least);
    double smallest = least[0];
    for (int k = 1; k < LANES; k++)
        smallest = least[k] < smallest ? least[k] : smallest;
    return smallest;
}

/* How strongly forces can turn a slip within the step, in m/s. */
ALWAYS_INLINE double turned_within(const step_t *s, const nodes_t *response)
{
    lanes_t largest = lanes_of(0);
    IN_REGISTERS
    for (int b = 0; b < BLOCKS; b++) {
        const lanes_t rate = lanes_abs(response[0].lanes[b]) + lanes_abs(response[1].lanes[b]);
        largest = lanes_max(largest, rate);
    }
    return s->h*lanes_largest(largest);
}

ALWAYS_INLINE void turn_directions(step_t *s, int i, const nodes_t *turn)
{
    nodes_t *const x = s->slip.toward + 2*i, *const y = x + 1;
    const lanes_t bound = lanes_of(MAX_TURN);
    for (int b = 0; b < BLOCKS; b++) {
        lanes_t by = lanes_select(turn->lanes[b] < bound, turn->lanes[b], bound);
        by = lanes_select(by > -bound, by, -bound);
        const lanes_t new_x = x->lanes[b] - by*y->lanes[b], new_y = y->lanes[b] + by*x->lanes[b];
        const lanes_t over_size = 1/lanes_sqrt(new_x*new_x + new_y*new_y);
        x->lanes[b] = new_x*over_size, y->lanes[b] = new_y*over_size;
    }
}

/* Slips of other contacts as the force of this one is another than `before`; its own, too, if it has been found together
 * with others, which have moved it. */
static void move_others(step_t *s, const int wheels, int i, const nodes_t *before)
{
    nodes_t pushed[2];
    for (int k = 0; k < 2; k++)
        for (int b = 0; b < BLOCKS; b++)
            pushed[k].lanes[b] = s->slip.push[2*i + k].lanes[b] - before[k].lanes[b];
    for (int other = 0; other < wheels; other++)
        for (int k = 0; k < 2 && s->contact.slides[other] && (other != i || turned_together(s, i)); k++) {
            const double *const response = response_to_force(s, other, k, i);
            nodes_t rate, moved;
            for (int b = 0; b < BLOCKS; b++)
                rate.lanes[b] = response[0]*pushed[0].lanes[b] + response[1]*pushed[1].lanes[b];
            if (SET_APPROACHES && s->approach.stretched)
                stretch_nodes(s, &rate);
            integrate_to_nodes(0, s->h, &rate, &moved);
            for (int b = 0; b < BLOCKS; b++)
                s->slip.at[2*other + k].lanes[b] += moved.lanes[b];
        }
}

/* Whether what forces do to a slip at the nodes is another than at the start, and not known: rollers that have an inertia
 * change their radius. */
ALWAYS_INLINE int asks_response(const step_t *s, int i)
{
    if (SET_HAS_CONTACT_SPEEDS)
        return !s->slip.knows_response[i] && fabs(s->at_chi[i].node[NODES - 1] - s->at_chi[i].node[0]) > ROLLS*s->joint[i];
    return 0;
}

/* The same by what forces do at the nodes, where that is another; and in the clock of the step. */
static void response_near_rest(step_t *s, const int wheels, int i, nodes_t *response)
{
    int ask[MAX_WHEELS] = {0};
    if ((ask[i] = asks_response(s, i)))
        find_self_responses(s, wheels, ask);
    if (s->slip.knows_response[i])
        self_response_to_turn(s, i, response);
    if (SET_APPROACHES)
        for (int k = 0; k < 2 && s->approach.stretched; k++)
            stretch_nodes(s, response + k);
}

/* Whether forces can turn a slip much within the step. */
ALWAYS_INLINE int is_near_rest(const step_t *s, const nodes_t *response, const nodes_t *along)
{
    return turned_within(s, response) > FAR_FROM_REST*smallest_of(along);
}

/* Whether the roller of a contact that slips sticks on its disk. */
ALWAYS_INLINE int may_share(const step_t *s, int i)
{
    return SET_ROLLERS_TURN && s->hold.states->sticks[s->hold.states->rollers_at + i][0] > 0.5;
}

/* Whether a contact cannot slip along its axle: its roller sticks, and no force on it moves it there by more than
 * rounding, since other wheels keep the vehicle from moving along it. */
ALWAYS_INLINE int cannot_go_aside(const step_t *s, int i)
{
    const double *const aside = response_to_force(s, i, 0, i), *const forward = response_to_force(s, i, 1, i);
    return may_share(s, i) && fabs(aside[0]) + fabs(aside[1]) < ROUNDED_SLIP*EPS*forward[1];
}

/* The turn to its rolling direction. A slip that has not begun, and the first guesses of it, say nothing about that. */
ALWAYS_INLINE void turn_forward(const step_t *s, int i, nodes_t *turn)
{
    for (int b = 0; b < BLOCKS; b++)
        turn->lanes[b] = s->slip.toward[2*i].lanes[b]/s->slip.toward[2*i + 1].lanes[b];
}

/* The direction with which a slip begins the step, at all nodes. */
static void begin_direction(step_t *s, int i)
{
    for (int k = 2*i; k < 2*i + 2; k++)
        for (int b = 0; b < BLOCKS; b++)
            s->slip.toward[k].lanes[b] = lanes_of(s->slip.begun[k]);
}

/* New directions of one contact, from the slips at the nodes, and its forces. A slip that has not begun by the end of the
 * step says nothing about them. */
static void find_direction(step_t *s, const int wheels, int i)
{
    nodes_t along, across, response[2], turn;
    along_and_across(s, i, &along, &across);
    if (largest_of(&across) < s->slip.noise[i] && largest_of(&along) < s->slip.noise[i]) {
        begin_direction(s, i);
        force_in_direction(s, i);
        return;
    }
    response_to_turn(s, i, i, response);
    const int is_near = is_near_rest(s, response, &along);
    if (SET_STANDS && cannot_go_aside(s, i))
        turn_forward(s, i, &turn);
    else if (is_near) {
        response_near_rest(s, wheels, i, response);
        turn_by_newton(s, i, response, &along, &across, &turn);
    } else
        for (int b = 0; b < BLOCKS; b++)
            turn.lanes[b] = across.lanes[b]/along.lanes[b];
    const nodes_t before[2] = {s->slip.push[2*i], s->slip.push[2*i + 1]};
    turn_directions(s, i, &turn);
    force_in_direction(s, i);
    if (is_near)
        move_others(s, wheels, i, before);
}

/* The slips of all contacts, from the states at the nodes. */
ALWAYS_INLINE void slips_at_nodes(step_t *s, const int wheels)
{
    for (int b = 0; b < BLOCKS; b++) {
        lanes_t nu[3], chi[MAX_WHEELS], slip[2*MAX_WHEELS];
        for (int k = 0; k < 3; k++)
            nu[k] = s->at_nu[k].lanes[b];
        for (int i = 0; i < wheels; i++)
            chi[i] = lanes_clamp(s->at_chi[i].lanes[b], s->joint[i]);
        slips_of(wheels, s->vehicle, nu, chi, core_at(s, b), slip);
        for (int k = 0; k < 2*wheels; k++)
            s->slip.at[k].lanes[b] = slip[k];
    }
}

/* Forces of contacts that slip under the loads at the nodes. */
static void follow_loads(step_t *s, const int wheels)
{
    loads_at_nodes(s, wheels);
    for (int i = 0; i < wheels; i++)
        if (s->contact.slides[i])
            force_in_direction(s, i);
}

#include "ground/shared_directions.c"
#include "ground/slow_rests.c"

/* Whether the directions follow the slips that the last sweep has found as well as these are known. Where a slip has
 * just begun it is the small difference of large speeds, and what further sweeps change is its rounding. */
NEVER_INLINE int directions_are_found(step_t *s, const int wheels)
{
    states_at_nodes(s, wheels);
    slips_at_nodes(s, wheels);
    for (int i = 0; i < wheels; i++) {
        nodes_t along, across;
        if (!may_turn(s, i) || s->contact.keeps[i])
            continue;
        along_and_across(s, i, &along, &across);
        if (largest_of(&across) > SLIP_FOLLOWED*s->slip.noise[i])
            return 0;
    }
    return 1;
}

/* New directions of all contacts that slip, and their forces, from the states at the nodes. */
static void find_directions(step_t *s, const int wheels)
{
    if (SET_STRIPS) {
        for (int b = 0; b < BLOCKS && s->contact.sliding; b++) {
            lanes_t chi[MAX_WHEELS];
            for (int i = 0; i < wheels; i++)
                chi[i] = lanes_clamp(s->at_chi[i].lanes[b], s->joint[i]);
            forces_in_corners(s, wheels, b, chi);
        }
    }
    if (SET_LOADS_FOLLOW)
        follow_loads(s, wheels);
    if (SET_FIRST_DIRECTION || !s->contact.turning)     /* of massless rollers only the sign, which a phase keeps        */
        return;
    slips_at_nodes(s, wheels);
    if (SET_STANDS)
        find_shared_directions(s, wheels);
    for (int i = 0; i < wheels; i++)
        if (may_turn(s, i) && !s->contact.keeps[i] && !turned_together(s, i))
            find_direction(s, wheels, i);
}

/* What contacts do at the nodes in vector b, from the last evaluation there: of those that stick how much of their
 * friction they use, squared, less 1; of those that slip the rates of the slip. */
ALWAYS_INLINE void keep_contacts(step_t *s, const int wheels, int b, const arrays_t *at)
{
    for (int i = 0; i < wheels; i++) {
        const lanes_t *const force = at->ground_force + 2*i;
        lanes_t excess = -load_squared(s, i, load_at(s, i, b));
        for (int k = SET_FIRST_DIRECTION; k < 2; k++) {
            const lanes_t part = force[k]*s->contact.per_reach[2*i + k];
            excess += part*part;
            s->slip.rate[2*i + k].lanes[b] = at->slip_dot[2*i + k];
        }
        s->slip.excess[i].lanes[b] = excess;
    }
}
