/* The equations of a step in blocks (blockwise.c): what the rates of a number of the core do in those of another. */
#include "deviations/blockwise.c"

/* A block of the equations: of a row by the rates of a number of the core, or by a turn. */
static void put_block(const variations_t *w, double h, const blockwise_t *e, const int *unknown, int p, int q)
{
    const int a = unknown[p], c = unknown[q], turns = c >= w->core, at = turns ? first_turn(w) + c - w->core : c;
    const nodes_t *const slope = w->slope + a*w->directions;
    const int linear = !w->is_still[a*w->directions + at];
    nodes_t twice = {{{0}}}, *const to = block_of(e, p, q);
    for (int f = 0; c < CARRYING(w->wheels) && f < w->felt; f++)
        if (!w->is_still[a*w->directions + w->core + f])
            for (int b = 0; b < w->blocks; b++)
                twice.lanes[b] += slope[w->core + f].lanes[b]*carries_felt(w, f)[c];
    const int squared = !is_zero(w, &twice), is_full = !turns && (linear || squared);
    *kind_of(e, p, q) = is_full ? FULL : linear || a == c ? DIAGONAL : NO_BLOCK;
    for (int j = 0; is_full && j < w->nodes; j++) {
        for (int b = 0; b < w->blocks; b++)
            to[j].lanes[b] = -h*slope[c].node[j]*w->once[j].lanes[b] - h*h*twice.node[j]*w->twice[j].lanes[b];
        to[j].node[j] += a == c;
    }
    for (int b = 0; !is_full && b < w->blocks; b++)
        to->lanes[b] = turns ? -slope[at].lanes[b] : lanes_of(a == c);
}

#if !SET_GRIPS
/* The rates of the core at the nodes, by rows of right sides, where bearings stick on wheels that may slip. The momenta
 * of free rollers act upon themselves, nu and their wheel; the speeds of a wheel upon each other and nu: nu is last. */
static void put_rates_in_blocks(variations_t *w, double h)
{
    const int wheels = w->wheels, speeds = 1 + SET_HAS_CONTACT_SPEEDS;
    int unknown[w->core], count = 0;
    for (int a = 3 + speeds*wheels; a < w->core; a++)
        unknown[count++] = a;
    for (int k = 0; k < speeds*wheels; k++)
        unknown[count++] = 3 + k%speeds*wheels + k/speeds;
    for (int a = 0; a < 3; a++)
        unknown[count++] = a;
#if SET_GATHERS
    put_answers_of_momenta(w, h);
#endif
    const solving_t *const own = &w->solving;
    const blockwise_t e = {count, 3, w->nodes, w->blocks, w->groups,
                           own->kind, own->block, own->right, own->system, own->pivot_row};
    for (int p = 0; p < count; p++) {
        for (int j = 0; j < w->nodes; j++)
            w->solving.row[unknown[p]*w->nodes + j] = right_of(&e, p) + j*w->groups;
        put_right(w, unknown[p], 0);
        for (int q = 0; q < count; q++)
            put_block(w, h, &e, unknown, p, q);
    }
    solve_blockwise(&e);
}
#endif
