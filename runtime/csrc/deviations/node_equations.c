/* The equations of a step at its nodes, in blocks of slopes (blockwise.c). Unknowns are the rates of nu, the turns of
 * the directions of slips, and of further numbers of the core, as momenta of free rollers or the speeds of one wheel,
 * by how much they have changed at the nodes, z = h T r: by these the slopes are diagonal. Such numbers act upon
 * themselves, a few others and nu. So they are eliminated one by one, and nu is last, as in an arrow. The speeds of a
 * wheel whose contact sticks follow from all others. */
#include "deviations/blockwise.c"

/* Divide a table at the nodes, by rows, by another one. */
static void divide_at_nodes(const variations_t *w, const nodes_t *by, nodes_t *table)
{
    const int blocks = w->blocks;
    for (int j = 0; j < w->nodes; j++) {
        lanes_t *const row = w->solving.pivot_row[j] = w->solving.memory + j*2*blocks;
        memcpy(row, by[j].lanes, blocks*sizeof *row);
        memcpy(row + blocks, table[j].lanes, blocks*sizeof *row);
    }
    solve(&(equations_t){w->solving.pivot_row, w->nodes, blocks, blocks});
    for (int j = 0; j < w->nodes; j++)
        memcpy(table[j].lanes, w->solving.pivot_row[j] + blocks, blocks*sizeof(lanes_t));
}

/* A row's slopes by what feeds back, through a number of the core that carries it. Returns whether they are not zero. */
static int put_carried_slope(const variations_t *w, const nodes_t *slope, const int *zero, int c, nodes_t *to)
{
    memset(to, 0, sizeof *to);
    for (int f = 0; c < CARRYING(w->wheels) && f < w->feedback; f++)
        if (!zero[w->core + f])
            for (int b = 0; b < w->blocks; b++)
                to->lanes[b] += slope[w->core + f].lanes[b]*w->slopes.carries[carried_of_feedback(w, f)][c];
    return !are_zero(to->lanes, w->blocks);
}

/* A block of the equations: of a row by an unknown. */
static void put_block(const variations_t *w, double h, const blockwise_t *e, const int *unknown, int p, int q)
{
    const int a = unknown[p], c = unknown[q], turns = c >= w->core, at = turns ? first_turn(w) + c - w->core : c;
    const nodes_t *const slope = w->slopes.core + a*w->directions;
    const int *const zero = w->slopes.is_zero + a*w->directions;
    const int linear = !zero[at], is_change = c >= 3 && !turns;
    nodes_t carried, *const to = block_of(e, p, q);
    if (!linear && a != c && c >= CARRYING(w->wheels)) {
        *kind_of(e, p, q) = NO_BLOCK;
        return;
    }
    const int carries = put_carried_slope(w, slope, zero, c, &carried);
    const int is_full = carries || (is_change ? a == c : linear && !turns);
    const int kind = is_full ? FULL : linear || a == c ? DIAGONAL : NO_BLOCK;
    *kind_of(e, p, q) = kind;
    for (int b = 0; kind == DIAGONAL && b < w->blocks; b++)
        to->lanes[b] = turns || is_change ? -slope[at].lanes[b] : lanes_of(a == c);
    for (int j = 0; is_full && j < w->nodes; j++) {
        const double direct = slope[c].node[j];
        for (int b = 0; b < w->blocks; b++)
            to[j].lanes[b] = is_change
                ? (a == c)*(1/h)*w->step.inverse[j].lanes[b] - h*carried.node[j]*w->step.once[j].lanes[b]
                : -h*direct*w->step.once[j].lanes[b] - h*h*carried.node[j]*w->step.twice[j].lanes[b];
        to[j].node[j] += is_change ? -direct : a == c;
    }
}

/* The rates of a number from its changes at the nodes. */
static void put_rates_of_changes(variations_t *w, double h, lanes_t *value)
{
    const long long size = w->nodes*w->groups*(long long)sizeof *value;
    lanes_t *const rate = w->step.known;  /* not needed any more */
    memset(rate, 0, size);
    add_product_of(w, w->step.inverse, 1/h, value, rate);
    memcpy(value, rate, size);
}

/* List what a step is solved for, nu last: further numbers of the core, then those of each wheel, unless its contact
 * sticks, and the turns of the direction of its slip. Returns how many, without those whose rates follow: these stand
 * behind. */
static int list_unknowns(const variations_t *w, long long row, int *unknown)
{
    const int wheels = FIXED_WHEELS(w->wheels);
    int count = 0;
    for (int a = 3 + WHEEL_SPEEDS*wheels; a < w->core; a++)
        unknown[count++] = a;
    for (int i = 0; i < wheels; i++) {
        for (int k = 0; k < WHEEL_SPEEDS && !sticks_in(w, row, i); k++)
            unknown[count++] = contact_speed(w, i, k);
        if (turns_in(w, row, i))
            unknown[count++] = w->core + i;
    }
    for (int a = 0; a < 3; a++)
        unknown[count++] = a;
    int all = count;
    for (int i = 0; i < wheels; i++)
        for (int k = 0; k < WHEEL_SPEEDS && sticks_in(w, row, i); k++)
            unknown[all++] = contact_speed(w, i, k);
    return count;
}

/* The rates that follow, when the others and the turns are known. */
static void put_rates_that_follow(variations_t *w, double h, const int *unknown, int count)
{
    const int groups = w->groups, nodes = w->nodes, all = NODES*groups;
    lanes_t *const rate = w->step.carried;
    memset(w->step.core, 0, w->core*all*sizeof *rate);
    memset(w->step.known, 0, w->feedback*all*sizeof *rate);
    for (int p = 0; p < count; p++)
        if (unknown[p] < w->core)
            add_product_of(w, w->step.once, h, w->solving.row[unknown[p]], w->step.core + unknown[p]*all);
    for (int f = 0; f < w->feedback; f++) {
        const double *const carries = w->slopes.carries[carried_of_feedback(w, f)];
        for (int k = 0; k < nodes*groups; k++)
            rate[k] = carried_by(w, carries, w->step.core + k, w->step.core + 3*all + k, all);
        add_product_of(w, w->step.once, h, rate, w->step.known + f*all);
    }
    for (int p = count; unknown[p] >= 0; p++) {
        const int a = unknown[p];
        for (int d = 0; d < w->directions; d++) {
            const int turns = d - first_turn(w);
            if (w->slopes.is_zero[a*w->directions + d] || (d >= w->core + w->feedback && turns < 0))
                continue;
            const lanes_t *const by = d < w->core ? w->step.core + d*all : turns < 0 ? w->step.known + (d - w->core)*all
                                                                       : w->solving.row[w->core + turns];
            const nodes_t *const slope = &w->slopes.core[a*w->directions + d];
            for (int j = 0; j < nodes; j++)
                for (int g = 0; g < groups; g++)
                    w->solving.row[a][j*groups + g] += slope->node[j]*by[j*groups + g];
        }
    }
}

/* The rates of the core at the nodes, by rows of right sides. */
static void put_core_rates(variations_t *w, long long row, double h)
{
    int unknown[w->equations + 1];
    memset(unknown, -1, sizeof unknown);
    const int count = list_unknowns(w, row, unknown);
    const solving_t *const solving = &w->solving;
    const blockwise_t e = {count, 3, w->nodes, w->blocks, w->groups,
                           solving->kind, solving->block, solving->right, solving->memory, solving->pivot_row};
    for (int p = 0; unknown[p] >= 0; p++) {
        w->solving.row[unknown[p]] = right_of(&e, p);
        put_right(w, unknown[p]);
        for (int q = 0; q < count && p < count; q++)
            put_block(w, h, &e, unknown, p, q);
    }
    solve_blockwise(&e);
    for (int p = 0; p < count; p++)
        if (unknown[p] >= 3 && unknown[p] < w->core)
            put_rates_of_changes(w, h, right_of(&e, p));
    if (unknown[count] >= 0)
        put_rates_that_follow(w, h, unknown, count);
}
