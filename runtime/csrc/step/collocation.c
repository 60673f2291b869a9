/* Collocation: a step covers [t, t + h] with the 16 nodes of Gauss.
 *
 * The rates of the core at the nodes are a polynomial, and the core its integral, of order 32 at the end of the step.
 * Picard's iteration finds them, all nodes at once in the lanes of the generated kernel. The followers are integrals of
 * the core's; the accounts are evaluated once, when the core has settled. Where wheels may slip, the nodes are those of
 * Radau, of order 31, and coupled.c finds the rates.
 *
 * The file knows no mechanics and no effect by name: engine_set.h says what there is, and calls the generated
 * kernel. What a set does not have is not compiled. */
#include "engine.h"

#include "step/step.h"

#define TURN 6.283185307179586
#define FORCE_NOISE 64              /* roundings that the polynomials of a held force may have               */

/* Whether a wheel turns, 1 or 0. Where its axle sticks, its rate is rounding alone, which would add up in its angle. */
ALWAYS_INLINE double turns(const step_t *s, int wheel)
{
    if (SET_HOLDS)
        return s->hold.turns[wheel];
    return 1;
}

NEVER_INLINE void wheels_stick(const step_t *s, const int wheels, const lanes_t *nu, const lanes_t *chi, lanes_t *core);
static void find_directions(step_t *s, const int wheels);
NEVER_INLINE void rollers_stick(const step_t *s, const int wheels, const lanes_t *nu, const lanes_t *chi,
                                lanes_t *core);

/* Whether a number of the core is a speed of a contact that sticks: it is not integrated. */
ALWAYS_INLINE int follows_nu(const step_t *s, const int wheels, int c)
{
    if (SET_GRIPS)
        return c < coupled_size(wheels) && s->contact.grips[c%wheels];
    return 0;
}

/* Rates at the nodes as those in the clock of a step up to a rest. */
ALWAYS_INLINE void stretch_nodes(const step_t *s, nodes_t *rate)
{
    for (int b = 0; b < BLOCKS; b++)
        rate->lanes[b] *= s->approach.stretch.lanes[b];
}

/* Whether a number of the core is one of heave and tilt: their rates, then they themselves, the places. */
ALWAYS_INLINE int is_of_tilt(const int wheels, int c)
{
    if (SET_LOADS_FOLLOW)
        return c >= tilt_rates_at(wheels) && c < tilt_at(wheels) + 3;
    (void)wheels, (void)c;
    return 0;
}

/* Whether it is a place: heave or tilt, and no rate. */
ALWAYS_INLINE int is_of_places(const int wheels, int c)
{
    return is_of_tilt(wheels, c) && c >= tilt_at(wheels);
}

/* Number c of the core at the nodes from its rate; rates of places are those that stand three numbers before them. */
ALWAYS_INLINE void integrate_core(step_t *s, int c)
{
    nodes_t at;
    if (is_of_places(s->wheels, c)) {
        for (int b = 0; b < BLOCKS; b++)
            s->rate_core[c].lanes[b] = core_at(s, b)[c - 3];
        if (SET_APPROACHES && s->approach.stretched)
            stretch_nodes(s, &s->rate_core[c]);
    }
    integrate_to_nodes(s->start_core[c], s->h, &s->rate_core[c], &at);
    for (int b = 0; b < BLOCKS; b++)
        core_at(s, b)[c] = at.lanes[b];
}

/* Whether contacts that stick have not been looked at. */
ALWAYS_INLINE int is_blind(const step_t *s)
{
    if (SET_ROLLS)
        return s->contact.blind;
    return 0;
}

/* The first number of the core whose rate the last sweep has found. */
ALWAYS_INLINE int first_found(const step_t *s)
{
    if (SET_GRIPS)
        return s->contact.blind ? coupled_size(s->wheels) : 0;
    return 0;
}

/* Whether nothing at the nodes depends on the speeds of contacts that stick: all do, and the core is these alone. */
ALWAYS_INLINE int only_rolls(const step_t *s, const int wheels)
{
    if (SET_ROLLS)
        return s->contact.blind && s->core == coupled_size(wheels);
    return 0;
}

/* The wheels' angles of the last sweep in a vector of nodes. */
ALWAYS_INLINE void angles_before(const step_t *s, const int wheels, int b, lanes_t *chi)
{
    for (int i = 0; i < wheels; i++)
        chi[i] = lanes_clamp(s->at_chi[i].lanes[b], s->joint[i]);
}

/* The same where these depend on the wheels' angles: with those of the last sweep. */
ALWAYS_INLINE void wheels_by_angles(step_t *s, const int wheels, int b, const lanes_t *nu)
{
    lanes_t chi[MAX_WHEELS], chi_dot[MAX_WHEELS];
    angles_before(s, wheels, b, chi);
    rolling_wheels(wheels, s->vehicle, nu, chi, chi_dot);
    for (int i = 0; i < wheels; i++) {
        s->turning_moved = lanes_max(s->turning_moved, lanes_abs(chi_dot[i] - s->rate_chi[i].lanes[b]));
        s->rate_chi[i].lanes[b] = chi_dot[i];
    }
}

/* The wheels' rates in vector b of the nodes. */
ALWAYS_INLINE void wheels_at_nodes(step_t *s, const int wheels, int b, const lanes_t *nu)
{
    if (SET_GRIPS && !only_rolls(s, wheels)) {
        lanes_t chi[MAX_WHEELS];
        if (SET_CHI_FEEDS_BACK)
            angles_before(s, wheels, b, chi);
        wheels_stick(s, wheels, nu, chi, core_at(s, b));
    }
    for (int i = 0; SET_SLIPS && i < wheels && !only_rolls(s, wheels); i++) {
        const lanes_t rate = core_at(s, b)[rates_at(wheels) + i];
        if (SET_CHI_FEEDS_BACK)
            s->turning_moved = lanes_max(s->turning_moved, lanes_abs(rate - s->rate_chi[i].lanes[b]));
        s->rate_chi[i].lanes[b] = rate;
    }
    if (SET_SLIPS && !only_rolls(s, wheels))
        return;
    if (SET_CHI_FEEDS_BACK) {
        wheels_by_angles(s, wheels, b, nu);
        return;
    }
    lanes_t chi_dot[MAX_WHEELS];
    rolling_wheels(wheels, s->vehicle, nu, 0, chi_dot);
    for (int i = 0; i < wheels; i++)
        s->rate_chi[i].lanes[b] = chi_dot[i]*turns(s, i);
}

/* nu and chi, and what else the rates need, at the nodes from the rates. */
ALWAYS_INLINE void states_at_nodes(step_t *s, const int wheels)
{
    for (int k = 0; k < 3; k++)
        integrate_to_nodes(s->nu[k], s->h, &s->rate_nu[k], &s->at_nu[k]);
    if (SET_CORE_PARTS)
        for (int c = 0; c < s->core; c++)
            if (!follows_nu(s, wheels, c))
                integrate_core(s, c);
    if (SET_CHI_FEEDS_BACK)
        s->turning_moved = lanes_of(0);
    for (int b = 0; b < BLOCKS; b++) {
        const lanes_t nu[3] = {s->at_nu[0].lanes[b], s->at_nu[1].lanes[b], s->at_nu[2].lanes[b]};
        wheels_at_nodes(s, wheels, b, nu);
        if (SET_HAS_HEADING) {
            lanes_t pose_dot[3];
            set_pose_rates(wheels, s->vehicle, nu, lanes_of(0), pose_dot);
            s->rate_pose[2].lanes[b] = pose_dot[2];
        }
    }
    if (SET_APPROACHES) {
        for (int i = 0; i < wheels && s->approach.stretched; i++)
            stretch_nodes(s, s->rate_chi + i);
        if (SET_HAS_HEADING && s->approach.stretched)
            stretch_nodes(s, s->rate_pose + 2);
    }
    for (int i = 0; i < wheels; i++)
        integrate_to_nodes(s->chi[i], s->h, &s->rate_chi[i], &s->at_chi[i]);
    if (SET_GRIPS && SET_HAS_CONTACT_SPEEDS) {
        for (int b = 0; b < BLOCKS && s->contact.gripping && !only_rolls(s, wheels); b++) {
            lanes_t nu[3], chi[MAX_WHEELS];
            for (int k = 0; k < 3; k++)
                nu[k] = s->at_nu[k].lanes[b];
            for (int i = 0; i < wheels; i++)
                chi[i] = lanes_clamp(s->at_chi[i].lanes[b], s->joint[i]);
            rollers_stick(s, wheels, nu, chi, core_at(s, b));
        }
    }
    if (SET_HAS_HEADING && !s->bare)
        integrate_to_nodes(s->acts.heading, s->h, &s->rate_pose[2], &s->acts.at_heading);
}

ALWAYS_INLINE void keep_contacts(step_t *s, const int wheels, int b, const arrays_t *at);

/* What is rounding of what a contact that sticks takes: so many roundings, and what directions of slow slips add. */
ALWAYS_INLINE double grip_noise(const step_t *s, double excess, double roundings)
{
    return roundings*GRIP_NOISE(excess) + s->slip.turn_noise;
}

static const lanes_t no_push[2*MAX_WHEELS];     /* forces of the ground where no contact slips                   */

/* The times of the nodes, over h. */
ALWAYS_INLINE const nodes_t *clock_of(const step_t *s)
{
    if (SET_APPROACHES && s->approach.stretched)
        return &s->approach.clock;
    (void)s;
    return &gauss_node;
}

/* Inputs that change within the step, at its nodes, for its present length. */
NEVER_INLINE void move_inputs(step_t *s, const int wheels)
{
    const int count = SET_INPUTS*wheels;
    s->acts.length = s->h;
    for (int b = 0; b < BLOCKS; b++)
        for (int k = 0; k < count; k++)
            s->acts.at_nodes[b*count + k] = s->acts.input[k] + (s->h*s->acts.input_slope[k])*clock_of(s)->lanes[b];
}

/* The inputs in a vector of nodes. */
ALWAYS_INLINE const lanes_t *inputs_at(step_t *s, const int wheels, int b)
{
    if (!s->acts.moves)
        return s->acts.held;
    if (s->acts.length != s->h)
        move_inputs(s, wheels);
    return s->acts.at_nodes + b*SET_INPUTS*wheels;
}

/* The state and the inputs in one vector of nodes. An iterate may stray beyond the joint, where the kernel has no
 * value. */
ALWAYS_INLINE point_t point_at(step_t *s, const int wheels, int b, arrays_t *at)
{
    point_t point = {
        .vehicle = s->vehicle, .nu = at->nu, .chi = at->chi, .momenta = s->momenta, .all_turn = s->all_turn,
        .bare = s->bare};
    for (int k = 0; k < 3; k++)
        at->nu[k] = s->at_nu[k].lanes[b];
    for (int i = 0; i < wheels; i++)
        at->chi[i] = lanes_clamp(s->at_chi[i].lanes[b], s->joint[i]);
    if (SET_HAS_HEADING)
        point.heading = s->acts.at_heading.lanes[b];
    if (SET_INPUTS)
        point.inputs = inputs_at(s, wheels, b);
    if (SET_CORE_PARTS) {
        point.core = core_at(s, b);
        point.core_dot = s->core_dot;
    }
    if (SET_HOLDS) {
        point.directions = s->hold.held ? s->hold.directions : 0;
        point.absent = s->hold.absent;
        point.held_force = at->held_force;
    }
    if (SET_STANDS)
        point.directions = s->hold.directions, point.absent = s->hold.absent, point.held_force = at->held_force;
    if (SET_CORE_BEARINGS)
        put_bearing_states(s->hold.states, &point);
    if (SET_GRIPS) {
        for (int k = 0; s->contact.sliding && k < 2*wheels; k++)
            at->ground_push[k] = s->slip.push[k].lanes[b];
        point.ground_push = s->contact.sliding ? at->ground_push : no_push;
        point.ground_force = at->ground_force, point.slip_dot = at->slip_dot;
    }
    if (SET_STRIPS) {
        for (int i = 0; i < wheels; i++)
            at->ground_yield[i] = s->slip.yield[i].lanes[b];
        point.ground_yield = at->ground_yield;
    }
    if (SET_SHARES) {
        for (int i = 0; i < wheels; i++)
            at->next_share[i] = s->slip.next_share[i].lanes[b];
        point.load = s->contact.load, point.friction = s->contact.friction, point.next_share = at->next_share;
        point.next_before = s->contact.next_before;
    }
    return point;
}

/* Another state in all lanes, of which core_here is the rest of the core, so long after the step's start; what else the
 * rates need is that in vector b of the nodes. */
ALWAYS_INLINE point_t point_from(step_t *s, const int wheels, int b, const double *nu, const double *chi,
                                 double heading, double time, arrays_t *at)
{
    point_t point = point_at(s, wheels, b, at);
    for (int k = 0; k < 3; k++)
        at->nu[k] = lanes_of(nu[k]);
    for (int i = 0; i < wheels; i++)
        at->chi[i] = lanes_clamp(lanes_of(chi[i]), s->joint[i]);
    if (SET_HAS_HEADING)
        point.heading = lanes_of(heading);
    if (SET_INPUTS && s->acts.moves) {
        for (int k = 0; k < SET_INPUTS*wheels; k++)
            at->input[k] = lanes_of(s->acts.input[k] + time*s->acts.input_slope[k]);
        point.inputs = at->input;
    }
    if (SET_CORE_PARTS)
        point.core = s->core_here;
    (void)heading, (void)time;
    return point;
}

/* What holds wheels that stand, from the last evaluation at a vector of nodes: the force on nu, and the
 * ground's forces. */
ALWAYS_INLINE void keep_standing(step_t *s, const int wheels, int b, const arrays_t *at)
{
    for (int k = 0; k < 3; k++)
        s->hold.force[k].lanes[b] = at->held_force[k];
    for (int k = 0; k < 2*wheels; k++)
        s->hold.along[k].lanes[b] = at->ground_force[k];
}

ALWAYS_INLINE void keep_bearings(step_t *s, const int wheels, int b, const arrays_t *at);

/* The force that holds what sticks, from the last evaluation at a vector of nodes. */
ALWAYS_INLINE void keep_held_force(step_t *s, const int wheels, int b, const arrays_t *at)
{
    if (SET_GRIPS)
        keep_contacts(s, wheels, b, at);
    for (int i = 0; SET_SHARES && i < wheels; i++)
        s->slip.next_share[i].lanes[b] = at->next_share[i];
    if (SET_HOLDS)
        for (int k = 0; s->hold.held && k < 3; k++)
            s->hold.force[k].lanes[b] = at->held_force[k];
    if (SET_STANDS && s->hold.standing->count)
        keep_standing(s, wheels, b, at);
    if (SET_ROLLERS_TURN)
        keep_bearings(s, wheels, b, at);
    else if (SET_CORE_BEARINGS)
        for (int k = 0; s->hold.held && k < s->hold.count; k++)
            s->hold.states->held[k].lanes[b] = s->hold.states->holding[k];
    (void)s, (void)wheels, (void)b, (void)at;
}

static lanes_t correct_tilt(step_t *s, const int wheels, const nodes_t *found, lanes_t change);

#include "step/stiff.c"

NEVER_INLINE double coupled_sweep(step_t *s, const int wheels, int renew);
static double coupled_missed(const step_t *s);

/* New rates of the core at vector b of the nodes; returns the largest change so far, in the measure of nu. `first`: the
 * first number of the rest of the core that has been found. */
ALWAYS_INLINE lanes_t renew_rates(step_t *s, int b, const lanes_t *nu_dot, int first, lanes_t change)
{
    for (int k = 0; k < 3; k++) {
        const lanes_t moved = lanes_abs(nu_dot[k] - s->rate_nu[k].lanes[b]);
        change = lanes_max(change, moved);
        s->rate_nu[k].lanes[b] = nu_dot[k];
    }
    if (SET_CORE_PARTS) {
        for (int c = first; c < s->core; c++) {
            if (is_of_tilt(s->wheels, c)) {
                if (!is_of_places(s->wheels, c))
                    s->sprung.found[c - tilt_rates_at(s->wheels)].lanes[b] = s->core_dot[c];
                continue;
            }
            const lanes_t moved = s->weight[c]*lanes_abs(s->core_dot[c] - s->rate_core[c].lanes[b]);
            change = lanes_max(change, moved);
            s->rate_core[c].lanes[b] = s->core_dot[c];
        }
    }
    (void)first;
    return change;
}

/* A sweep where all contacts stick: the vehicle rolls. */
NEVER_INLINE double rolling_sweep(step_t *s, const int wheels)
{
    lanes_t change = lanes_of(0);
    states_at_nodes(s, wheels);
    for (int b = 0; b < BLOCKS; b++) {
        arrays_t at;
        lanes_t nu_dot[3];
        const point_t point = point_at(s, wheels, b, &at);
        rolling_rates(wheels, &point, nu_dot);
        change = renew_rates(s, b, nu_dot, coupled_size(wheels), change);
    }
    s->sweeps++;
    return lanes_largest(change)*s->h;
}

/* The rates of the core in vector b of the nodes as those in the clock of a step up to a rest. */
NEVER_INLINE void stretch_rates(const step_t *s, int b, lanes_t *nu_dot)
{
    for (int k = 0; k < 3; k++)
        nu_dot[k] *= s->approach.stretch.lanes[b];
    for (int c = 0; c < s->core; c++)
        s->core_dot[c] *= s->approach.stretch.lanes[b];
}

/* One sweep of Picard's iteration; returns the largest change of h nu', or of the rest of the core in its measure.
 * slow: whether the sweeps before have not contracted fast. */
NEVER_INLINE double sweep(step_t *s, const int wheels, int slow)
{
    (void)slow;
    if (SET_IS_COUPLED)
        return coupled_sweep(s, wheels, slow);
    if (SET_IS_ACTED_ON && s->stiff.on)
        return stiff_sweep(s, wheels, slow);
    if (SET_ROLLS && s->contact.blind)
        return rolling_sweep(s, wheels);
    lanes_t change = lanes_of(0);
    states_at_nodes(s, wheels);
    if (SET_GRIPS)
        find_directions(s, wheels);
    for (int b = 0; b < BLOCKS; b++) {
        arrays_t at;
        lanes_t nu_dot[3];
        const point_t point = point_at(s, wheels, b, &at);
        core_rates(wheels, &point, nu_dot);
        keep_held_force(s, wheels, b, &at);
        if (SET_APPROACHES && s->approach.stretched)
            stretch_rates(s, b, nu_dot);
        change = renew_rates(s, b, nu_dot, 0, change);
    }
    if (SET_LOADS_FOLLOW)
        change = correct_tilt(s, wheels, s->sprung.found, change);
    s->sweeps++;
    return lanes_largest(change)*s->h;
}

ALWAYS_INLINE int stands_on_joint(const step_t *s, int wheel)
{
    return !s->all_turn && !wheel_turns(s->vehicle, wheel);
}

/* Ends of the step: chi and the wheels' rates there. */
ALWAYS_INLINE void end_of_step(step_t *s, const int wheels)
{
    for (int i = 0; i < wheels; i++) {
        s->end.chi[i] = s->chi[i] + s->h*weighted(&s->rate_chi[i], &gauss_weight);
        s->end.rate[i] = weighted(&s->rate_chi[i], &gauss_end);
        if (SET_SHARES && stands_on_joint(s, i))         /* sweeps leave roundings of its rate                      */
            s->end.chi[i] = s->chi[i], s->end.rate[i] = 0;
    }
}

/* What the polynomials of the core's rates miss inside the step, in the measure of nu: the last coefficients,
 * integrated. */
ALWAYS_INLINE double missed(const step_t *s)
{
    if (SET_IS_COUPLED)
        return coupled_missed(s);
    double tails = tail(&s->rate_nu[0]) + tail(&s->rate_nu[1]) + tail(&s->rate_nu[2]);
    if (SET_CORE_PARTS) {
        double largest = 0;
        for (int c = first_found(s); c < s->core; c++)
            largest = larger(largest, s->weight[c]*tail(&s->rate_core[c]));
        tails += largest;
    }
    if (SET_CHI_FEEDS_BACK)
        for (int i = 0; i < s->wheels; i++)
            tails += s->size*tail(&s->rate_chi[i]);
    if (SET_HOLDS) {
        for (int k = 0; s->hold.held && k < 3; k++) {    /* beyond its rounding, as the nu' that the force would give */
            const double size = fabs(s->hold.force[k].node[0]) + s->hold.force_size[k];
            const double missing = tail(&s->hold.force[k]) - FORCE_NOISE*EPS*size;
            tails += s->hold.per_force[k]*fmax(missing, 0);
        }
    }
    if (SET_STANDS) {
        for (int k = 0; s->hold.standing->count && k < 3; k++) {     /* the same of wheels that stand                  */
            const double size = fabs(s->hold.force[k].node[0]) + s->hold.standing->size[k];
            const double missing = tail(&s->hold.force[k]) - FORCE_NOISE*EPS*size;
            tails += s->hold.standing->per_force*fmax(missing, 0);
        }
    }
    if (SET_GRIPS)
        for (int i = 0; i < s->wheels && !s->contact.blind; i++)    /* the same of contacts that stick      */
            if (s->contact.grips[i])
                tails += s->contact.friction_makes
                    *fmax(tail(&s->slip.excess[i]) - grip_noise(s, s->slip.excess[i].node[0], FORCE_NOISE), 0);
    return s->h*tails/(2*NODES);
}

/* The first number of the core that is integrated: what is coupled with nu follows from it where all contacts stick. */
ALWAYS_INLINE int first_integrated(const step_t *s, const int wheels)
{
    if (SET_GRIPS)
        return s->contact.rolls ? coupled_size(wheels) : 0;
    return 0;
}

/* The end of a step whose core has settled. A sweep leaves the state one sweep behind the rates; here it catches up. */
ALWAYS_INLINE void end_of_core(step_t *s)
{
    for (int k = 0; k < 3; k++)
        s->end.nu[k] = s->nu[k] + s->h*weighted(&s->rate_nu[k], &gauss_weight);
    if (SET_CORE_PARTS)
        for (int c = first_integrated(s, s->wheels); c < s->core; c++)
            s->end_core[c] = s->start_core[c] + s->h*weighted(&s->rate_core[c], &gauss_weight);
}

/* The rates of the accounts, once the core has settled. */
ALWAYS_INLINE void accounts_at_nodes(step_t *s, const int wheels)
{
    for (int b = 0; b < BLOCKS; b++) {
        arrays_t at;
        lanes_t account_dot[MAX_ACCOUNTS];
        const point_t point = point_at(s, wheels, b, &at);
        account_rates(wheels, &point, account_dot);
        for (int k = 0; k < account_size(wheels); k++)
            s->rate_account[k].lanes[b] = account_dot[k];
    }
    if (SET_APPROACHES)
        for (int k = 0; k < account_size(wheels) && s->approach.stretched; k++)
            stretch_nodes(s, s->rate_account + k);
}

/* x, y and theta at the end of the step: integrals that feed nothing back. The kernel's rates are those at the
 * heading 0, turned here: a heading may be any angle. */
static void integrate_pose(step_t *s, const double *pose)
{
    nodes_t theta;
    for (int b = 0; b < BLOCKS; b++) {
        const lanes_t nu[3] = {s->at_nu[0].lanes[b], s->at_nu[1].lanes[b], s->at_nu[2].lanes[b]};
        lanes_t rate[3];
        set_pose_rates(s->wheels, s->vehicle, nu, lanes_of(0), rate);
        for (int k = 0; k < 3; k++)
            s->rate_pose[k].lanes[b] = rate[k];
    }
    if (SET_APPROACHES)
        for (int k = 0; k < 3 && s->approach.stretched; k++)
            stretch_nodes(s, s->rate_pose + k);
    integrate_to_nodes(remainder(pose[2], TURN), s->h, &s->rate_pose[2], &theta);
    for (int b = 0; b < BLOCKS; b++)
        lanes_turn(theta.lanes[b], &s->rate_pose[0].lanes[b], &s->rate_pose[1].lanes[b]);
    for (int k = 0; k < 3; k++)
        s->end.travel[k] = s->h*weighted(&s->rate_pose[k], &gauss_weight);
}
