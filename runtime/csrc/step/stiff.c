/* Where Picard's iteration contracts slowly: Newton's rule for the rates at the nodes, with slopes that friction tells or
 * that are differences. */
#define DIFFERENCE 1e-9             /* of the size of a state, for slopes                                   */
#define FINE_DIFFERENCE 1e-11       /* the same of nu, which turns wheels that a small named speed holds         */
/* A slope is stiff where h times its size is large: Picard's iteration contracts by about this factor. */
#define STIFF 0.05                              /* above this the slope gets a linear system                   */
#define NOT_STIFF 0.5                           /* where all are below this, Picard's iteration takes over again */
#define CHORDS 1                                /* first stiff sweeps, which take chords in the place of tangents */
#define PATIENCE 4                              /* stiff sweeps without slopes of nu', where the core's may do */
#define MAX_TABLES (SET_STANDS && MAX_WHEELS > 3 ? MAX_WHEELS : 3)     /* of nodes in a row of a system */

/* slope has count x count tables, by rows. */
ALWAYS_INLINE void newton_matrix(newton_t *newton, const nodes_t *slope, const int count, double h)
{
    for (int m = 0; m < NODES; m++) {
        nodes_t integral;                       /* to node m, from the values at the nodes               */
        for (int j = 0; j < NODES; j++)
            integral.node[j] = gauss_integral[j].node[m];
        for (int k = 0; k < count; k++) {
            nodes_t *const row = newton->row[k*NODES + m] = newton->rows + (k*NODES + m)*count;
            for (int l = 0; l < count; l++)
                for (int b = 0; b < BLOCKS; b++)
                    row[l].lanes[b] = (-h*slope[k*count + l].node[m])*integral.lanes[b];
            row[k].node[m] += 1;
        }
    }
}

/* Gauss's elimination with the largest pivots, of rows of `count` tables of nodes. */
ALWAYS_INLINE void eliminate(nodes_t **row, const int count)
{
    for (int k = 0; k < count*NODES; k++) {
        const int first = k/NODES, here = k%NODES;
        int pivot = k;
        for (int m = k + 1; m < count*NODES; m++)
            if (fabs(row[m][first].node[here]) > fabs(row[pivot][first].node[here]))
                pivot = m;
        nodes_t *const kept = row[k];
        row[k] = row[pivot], row[pivot] = kept;
        nodes_t beyond[MAX_TABLES];             /* the pivot's row right of it, 0 elsewhere               */
        for (int l = first; l < count; l++)
            beyond[l] = row[k][l];
        for (int j = 0; j <= here; j++)
            beyond[first].node[j] = 0;
        const double inverse = row[k][first].node[here] = 1/row[k][first].node[here];
        for (int m = k + 1; m < count*NODES; m++) {
            const double factor = row[m][first].node[here] *= inverse;
            for (int l = first; l < count; l++)
                for (int b = 0; b < BLOCKS; b++)
                    row[m][l].lanes[b] -= factor*beyond[l].lanes[b];
        }
    }
}

/* The change that the eliminated matrix gives, in the place of what is missing. rows: where they stood before. Sums go
 * over whole rows: what is still to be found counts as 0. */
ALWAYS_INLINE void solve_eliminated(nodes_t *const *row, const nodes_t *rows, const int count, nodes_t *missing)
{
    nodes_t lower[MAX_TABLES], found[MAX_TABLES];
    memset(lower, 0, sizeof *lower*(size_t)count);
    memset(found, 0, sizeof *found*(size_t)count);
    for (int k = 0; k < count*NODES; k++) {
        const int place = (int)(row[k] - rows)/count;
        double rest = missing[place/NODES].node[place%NODES];
        for (int l = 0; l < count; l++)
            rest -= weighted(&row[k][l], &lower[l]);
        lower[k/NODES].node[k%NODES] = rest;
    }
    for (int k = count*NODES - 1; k >= 0; k--) {
        double rest = lower[k/NODES].node[k%NODES];
        for (int l = 0; l < count; l++)
            rest -= weighted(&row[k][l], &found[l]);
        found[k/NODES].node[k%NODES] = rest*row[k][k/NODES].node[k%NODES];
    }
    for (int k = 0; k < count; k++)
        missing[k] = found[k];
}

/* h times the largest slope. */
static double steepness(const nodes_t *slope, int count, double h)
{
    double steep = 0;
    for (int k = 0; k < count; k++)
        for (int m = 0; m < NODES; m++)
            steep = fmax(steep, h*fabs(slope[k].node[m]));
    return steep;
}

#define CORE_FOLLOWS (SET_CORE_PARTS && !SET_HAS_SLOPES)    /* whether it may follow nu at once              */
#define NEWTON_MOVES_CORE (CORE_FOLLOWS || SET_GRIPS)       /* whether slopes are found in a copy of it      */

/* How far a number of the core follows a change of nu_l by 1 that lasts: at once where its own slope is steep. */
ALWAYS_INLINE lanes_t followed(const step_t *s, int c, int l, int b)
{
    const double time = s->h/2;
    return time*s->stiff.core_in_nu[3*c + l].lanes[b]/(1 - time*s->stiff.slope_core[c].lanes[b]);
}

/* The rates of the core that Newton's rule asks for: of a vehicle that rolls where all contacts stick. */
NEVER_INLINE void rates_while_blind(const step_t *s, const int wheels, const point_t *point, lanes_t *nu_dot)
{
    if (s->contact.blind)
        rolling_rates(wheels, point, nu_dot);
    else
        core_rates(wheels, point, nu_dot);
}

ALWAYS_INLINE void newton_rates(const step_t *s, const int wheels, const point_t *point, lanes_t *nu_dot)
{
    if (SET_ROLLS)
        rates_while_blind(s, wheels, point, nu_dot);
    else
        core_rates(wheels, point, nu_dot);
}

/* nu has been moved at a point in vector b of the nodes, or moved back: so have the speeds of contacts that stick. */
ALWAYS_INLINE void core_sticks(const step_t *s, const int wheels, const arrays_t *at)
{
    if (SET_GRIPS) {
        if (!s->contact.gripping || only_rolls(s, wheels))
            return;
        wheels_stick(s, wheels, at->nu, at->chi, s->core_here);
        if (SET_HAS_CONTACT_SPEEDS)
            rollers_stick(s, wheels, at->nu, at->chi, s->core_here);
    }
}

/* The slopes of nu' in nu at a point in vector b of the nodes, by differences. */
ALWAYS_INLINE void slopes_of_nu(step_t *s, const int wheels, int b, const point_t *point, arrays_t *at)
{
    for (int l = 0; l < 3; l++) {
        const lanes_t here = at->nu[l];
        lanes_t nu_dot[3];
        at->nu[l] = here + FINE_DIFFERENCE*s->size;
        if (CORE_FOLLOWS)
            for (int c = 0; c < s->core; c++)
                if (!follows_nu(s, wheels, c) && !is_of_tilt(wheels, c))
                    s->core_here[c] += (at->nu[l] - here)*followed(s, c, l, b);
        core_sticks(s, wheels, at);
        newton_rates(s, wheels, point, nu_dot);
        for (int k = 0; k < 3; k++)
            s->stiff.slope_nu[3*k + l].lanes[b] = (nu_dot[k] - s->stiff.found_nu[k].lanes[b])/(at->nu[l] - here);
        at->nu[l] = here;
        if (NEWTON_MOVES_CORE)
            for (int c = 0; c < s->core; c++)
                s->core_here[c] = core_at(s, b)[c];
    }
}

#include "step/axle_slopes.c"

/* Whether a number of the core from `first` to `end` does not follow nu. */
ALWAYS_INLINE int moves_by_itself(const step_t *s, const int wheels, int first, int end)
{
    if (SET_GRIPS) {
        for (int c = first; c < end; c++)
            if (!follows_nu(s, wheels, c) && !is_of_tilt(wheels, c))
                return 1;
        return 0;
    }
    return 1;
}

/* The slopes of the rest of the core's rates at a point in vector b of the nodes, each number's in itself. Friction with
 * a small named speed is steep only next to rest: from elsewhere a tangent leads far to the other side, and a chord from
 * rest does not. */
ALWAYS_INLINE void slopes_by_friction(step_t *s, const int wheels, int b, const point_t *point)
{
    core_slopes(wheels, point, s->stiff.core_slope, s->stiff.core_chord);
    for (int c = 0; c < s->core; c++)
        s->stiff.slope_core[c].lanes[b] = s->stiff.sweeps < CHORDS ? s->stiff.core_chord[c] : s->stiff.core_slope[c];
}

/* The slopes of the rest of the core's rates, by differences, at a point in vector b of the nodes: each number's in itself,
 * its parts one after the other, and, if needed, in nu. Returns how many parts have such slopes. */
ALWAYS_INLINE int slopes_of_core(step_t *s, const int wheels, int b, const point_t *point, arrays_t *at, int in_nu)
{
    lanes_t nu_dot[3];
    int first = 0, count = 0;
    for (int part = 0; part < SET_CORE_PARTS; part++) {
        const int end = core_part_end(wheels, s->vehicle->rollers_per_wheel, part);
        if (!moves_by_itself(s, wheels, first, end)) {
            first = end;
            continue;
        }
        for (int c = first; c < end; c++) {
            if (follows_nu(s, wheels, c))
                continue;
            const lanes_t here = s->core_here[c];
            s->core_here[c] = here + (s->weight[c] > 0 ? DIFFERENCE*s->size/s->weight[c] : DIFFERENCE);
            s->stiff.core_slope[c] = s->core_here[c] - here;
        }
        newton_rates(s, wheels, point, nu_dot);
        for (int c = first; c < end; c++) {
            if (follows_nu(s, wheels, c))
                continue;
            s->core_here[c] -= s->stiff.core_slope[c];
            s->stiff.slope_core[c].lanes[b] = (s->core_dot[c] - s->stiff.found_core[c].lanes[b])/s->stiff.core_slope[c];
        }
        first = end;
        count++;
    }
    for (int l = 0; l < 3 && in_nu; l++) {
        const lanes_t here = at->nu[l];
        at->nu[l] = here + FINE_DIFFERENCE*s->size;
        core_sticks(s, wheels, at);
        newton_rates(s, wheels, point, nu_dot);
        for (int c = 0; c < s->core; c++)
            s->stiff.core_in_nu[3*c + l].lanes[b]
                = (s->core_dot[c] - s->stiff.found_core[c].lanes[b])/(at->nu[l] - here);
        at->nu[l] = here;
        core_sticks(s, wheels, at);
    }
    return count;
}

/* The rates of the core at a point in vector b of the nodes. */
ALWAYS_INLINE void find_rates(step_t *s, const int wheels, int b, const point_t *point, const arrays_t *at)
{
    lanes_t nu_dot[3];
    newton_rates(s, wheels, point, nu_dot);
    for (int k = 0; k < 3; k++)
        s->stiff.found_nu[k].lanes[b] = nu_dot[k];
    if (SET_CORE_PARTS)
        for (int c = first_found(s); c < s->core; c++)
            s->stiff.found_core[c].lanes[b] = s->core_dot[c];
    if (!is_blind(s))
        keep_held_force(s, wheels, b, at);
}

/* Add what is missing of a rate; returns the largest change so far, in the measure of nu. */
ALWAYS_INLINE lanes_t corrected(nodes_t *rate, const nodes_t *missing, double weight, lanes_t change)
{
    for (int b = 0; b < BLOCKS; b++) {
        const lanes_t moved = weight*lanes_abs(missing->lanes[b]);
        change = lanes_max(change, moved);
        rate->lanes[b] += missing->lanes[b];
    }
    return change;
}

/* Newton's rule for one number of the rest of the core, with its own slopes, for what is missing of its rate. */
ALWAYS_INLINE lanes_t correct_number(step_t *s, int c, nodes_t *missing, lanes_t change)
{
    newton_t newton;
    const double steep = steepness(&s->stiff.slope_core[c], 1, s->h);
    if (steep > STIFF) {
        newton_matrix(&newton, &s->stiff.slope_core[c], 1, s->h);
        eliminate(newton.row, 1);
        solve_eliminated(newton.row, newton.rows, 1, missing);
    }
    s->stiff.steepest = fmax(s->stiff.steepest, steep);
    return corrected(&s->rate_core[c], missing, s->weight[c], change);
}

/* The same for all numbers that do not follow nu, and whose rates have been found. */
ALWAYS_INLINE lanes_t correct_core(step_t *s, const int wheels, lanes_t change)
{
    for (int c = first_found(s); c < s->core; c++) {
        nodes_t missing;
        if (follows_nu(s, wheels, c) || is_of_tilt(wheels, c))
            continue;
        for (int b = 0; b < BLOCKS; b++)
            missing.lanes[b] = s->stiff.found_core[c].lanes[b] - s->rate_core[c].lanes[b];
        change = correct_number(s, c, &missing, change);
    }
    return change;
}

/* What follows nu has no rates to solve for: they are as they have been found. */
ALWAYS_INLINE void take_rates_of_sticking(step_t *s, const int wheels)
{
    for (int c = first_found(s); c < coupled_size(wheels); c++)
        if (follows_nu(s, wheels, c))
            s->rate_core[c] = s->stiff.found_core[c];
}

/* The rest of the core goes along with the change of nu' that a sweep has made. */
ALWAYS_INLINE lanes_t follow_nu(step_t *s, const int wheels, const nodes_t *change_of_nu, lanes_t change)
{
    nodes_t moved[3];
    for (int l = 0; l < 3; l++)
        integrate_to_nodes(0, s->h, &change_of_nu[l], &moved[l]);
    for (int c = 0; c < s->core; c++) {
        nodes_t missing;
        if (follows_nu(s, wheels, c) || is_of_tilt(wheels, c))
            continue;
        for (int b = 0; b < BLOCKS; b++)
            missing.lanes[b] = s->stiff.core_in_nu[3*c].lanes[b]*moved[0].lanes[b]
                + s->stiff.core_in_nu[3*c + 1].lanes[b]*moved[1].lanes[b]
                + s->stiff.core_in_nu[3*c + 2].lanes[b]*moved[2].lanes[b];
        change = correct_number(s, c, &missing, change);
    }
    return change;
}

/* The first half of a sweep: new rates of the rest of the core, and what it is with them at the nodes. renew: its slopes
 * in nu are new. */
ALWAYS_INLINE lanes_t correct_core_first(step_t *s, const int wheels, int renew)
{
    int parts = 0;
    for (int b = 0; b < BLOCKS; b++) {
        arrays_t at;
        point_t point = point_at(s, wheels, b, &at);
        point.core = core_to_move(s, b);
        find_rates(s, wheels, b, &point, &at);
        parts = slopes_of_core(s, wheels, b, &point, &at, renew);
    }
    const lanes_t change = correct_core(s, wheels, lanes_of(0));
    for (int c = 0; c < s->core; c++)
        if (!follows_nu(s, wheels, c) && !is_of_tilt(wheels, c))
            integrate_core(s, c);
    s->sweeps += 1 + parts + (renew ? 3 : 0);
    return change;
}

/* Newton's rule for nu'. renew: the slopes are new. missing: out, the change. */
ALWAYS_INLINE lanes_t correct_nu(step_t *s, int renew, nodes_t *missing, lanes_t change)
{
    for (int k = 0; k < 3; k++)
        for (int b = 0; b < BLOCKS; b++)
            missing[k].lanes[b] = s->stiff.found_nu[k].lanes[b] - s->rate_nu[k].lanes[b];
    const double steep = steepness(s->stiff.slope_nu, 9, s->h);
    s->stiff.steepest = fmax(s->stiff.steepest, steep);
    if (renew) {
        s->stiff.of_nu = steep > STIFF;
        newton_matrix(&s->stiff.newton, s->stiff.slope_nu, 3, s->h);
        eliminate(s->stiff.newton.row, 3);
    }
    if (s->stiff.of_nu)
        solve_eliminated(s->stiff.newton.row, s->stiff.newton.rows, 3, missing);
    for (int k = 0; k < 3; k++)
        change = corrected(&s->rate_nu[k], &missing[k], 1, change);
    return change;
}

/* Rates in all vectors of the nodes, and their slopes where Newton's rule needs new ones: by axles, or else each of nu. */
ALWAYS_INLINE void find_rates_and_slopes(step_t *s, const int wheels, int of_nu, const axles_t *axles)
{
    for (int b = 0; b < BLOCKS; b++) {
        arrays_t at;
        point_t point = point_at(s, wheels, b, &at);
        if (NEWTON_MOVES_CORE)
            point.core = core_to_move(s, b);
        find_rates(s, wheels, b, &point, &at);
        if (AXLES) {
            if (axles)
                slopes_by_axles(s, wheels, b, &point, &at, axles);
        }
        if (of_nu)
            slopes_of_nu(s, wheels, b, &point, &at);
        if (SET_HAS_SLOPES)
            slopes_by_friction(s, wheels, b, &point);
    }
}

/* A sweep by Newton's rule, since Picard's iteration contracts slowly, or not at all, where a slope times h is not
 * small. nu' has all of its slopes in nu, which are found anew where the iteration is slow; each number of the rest of
 * the core has its own slope. Spins of rollers do next to nothing to one another, and the iteration finds them. Momenta
 * of wheels, which strong friction lets follow nu at once, are corrected first, and once more as nu changes. */
static double stiff_sweep(step_t *s, const int wheels, int slow)
{
    const int renew = slow && (!SET_HAS_SLOPES || s->stiff.of_nu || s->stiff.sweeps > PATIENCE);
    lanes_t change = lanes_of(0);
    nodes_t missing[3];
    s->stiff.steepest = 0;
    states_at_nodes(s, wheels);
    axles_t axles = {.known = 0};
    const int by_axles = AXLES && renew && s->stiff.by_axles;
    if (AXLES && renew)
        find_axles(s, wheels, &axles);
    if (SET_GRIPS)
        find_directions(s, wheels);
    const int moves = CORE_FOLLOWS && moves_by_itself(s, wheels, 0, s->core);
    if (moves)
        change = correct_core_first(s, wheels, renew);
    find_rates_and_slopes(s, wheels, renew && !by_axles, by_axles ? &axles : NULL);
    if (AXLES && renew && !by_axles)
        s->stiff.by_axles = axles_make_slopes(s, wheels, &axles);
    change = correct_nu(s, renew, missing, change);
    if (moves)
        change = follow_nu(s, wheels, missing, change);
    else if (SET_CORE_PARTS && !CORE_FOLLOWS)
        change = correct_core(s, wheels, change);
    if (SET_GRIPS)
        take_rates_of_sticking(s, wheels);
    if (SET_LOADS_FOLLOW)
        change = correct_tilt(s, wheels, s->stiff.found_core + tilt_rates_at(wheels), change);
    s->sweeps += by_axles ? 2 : renew ? 4 : 1;
    s->stiff.sweeps++;
    return lanes_largest(change)*s->h;
}
