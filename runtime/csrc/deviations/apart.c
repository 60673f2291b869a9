/* Numbers of the core that hang together through nu alone, as what rollers' friction adds to it: eliminated one by one,
 * so that the rates of nu are all that a system is left for.
 *
 * With the rates r of such a number a, and its slopes f_a by everything as diagonal matrices at the nodes,
 *
 *     r_a = f_aa h T r_a + y,  y = f_a,nu h T r_nu + f_ag h^2 W T^2 r_nu + (what else there is):
 *     h T r_a = P y,  P = (1 - h T f_aa)^-1 h T.
 *
 * nu feels h T r_a at each node by itself, f_nu,a P y, so that P's product with the rows of y is made once, and each
 * row of nu takes one multiple of one of its rows. Numbers with the same f_aa, as all have under viscous friction of
 * like rollers, have one P. */

/* P of a number, by rows. */
ALWAYS_INLINE nodes_t *answer_of(const variations_t *w, int a)
{
    return w->solving.answer + w->solving.answer_at[a - 3]*NODES;
}

/* Whether the core's numbers beyond nu act upon themselves and nu alone. */
static int stand_apart(const variations_t *w)
{
    for (int a = 3; a < w->core; a++)
        for (int c = 3; c < w->core; c++)
            if (a != c && !w->is_still[a*w->directions + c])
                return 0;
    return 1;
}

/* Compute it, or find whose it is. */
static void put_answer(variations_t *w, double h, int a)
{
    const nodes_t *const own = &w->slope[a*w->directions + a];
    for (int other = first_momentum(w); other < a; other++)
        if (!memcmp(own, &w->slope[other*w->directions + other], w->nodes*sizeof(double))) {
            w->solving.answer_at[a - 3] = w->solving.answer_at[other - 3];
            return;
        }
    w->solving.answer_at[a - 3] = a - 3;
    const int nodes = w->nodes, blocks = w->blocks;
    for (int j = 0; j < nodes; j++) {
        lanes_t *const row = w->solving.row[j] = w->solving.system + j*2*blocks;
        for (int b = 0; b < blocks; b++) {
            row[blocks + b] = h*w->once[j].lanes[b];
            row[b] = -row[blocks + b]*own->lanes[b];
        }
        row[j/LANES][j%LANES] += 1;
    }
    solve(&(equations_t){w->solving.row, nodes, blocks, blocks});
    for (int j = 0; j < nodes; j++)
        memcpy(answer_of(w, a)[j].lanes, w->solving.row[j] + blocks, blocks*sizeof(lanes_t));
}

#if SET_GATHERS
/* The same of all momenta of free rollers. */
static void put_answers_of_momenta(variations_t *w, double h)
{
    for (int a = first_momentum(w); a < w->core; a++)
        put_answer(w, h, a);
}
#endif

/* P times a slope times a table by rows: what the number's integral gets from values at the nodes. */
static void put_answered(const variations_t *w, const nodes_t *answer, const nodes_t *slope, const nodes_t *table,
                         nodes_t *to)
{
    nodes_t scaled[NODES];
    for (int k = 0; k < w->nodes; k++)
        for (int b = 0; b < w->blocks; b++)
            scaled[k].lanes[b] = slope->node[k]*table[k].lanes[b];
    memset(to, 0, w->nodes*sizeof *to);
    add_product(w->nodes, w->blocks, NODES/LANES, answer, 1, scaled->lanes, to->lanes);
}

/* Take what nu does through a number from a block of the matrix: the slopes by it in the rows of nu, times a table. */
static void take_from_block(variations_t *w, int a, int block, double factor, const nodes_t *table)
{
    for (int c = 0; c < 3; c++)
        for (int j = 0; j < w->nodes; j++) {
            const double by = factor*w->slope[c*w->directions + a].node[j];
            lanes_t *const to = w->solving.row[c*w->nodes + j] + block*w->blocks;
            for (int b = 0; b < w->blocks; b++)
                to[b] -= by*table[j].lanes[b];
        }
}

/* What stands at the nodes behind the matrix in a number's rows, in one piece. */
ALWAYS_INLINE lanes_t *gathered(const variations_t *w, int a, int width)
{
    for (int j = 0; j < w->nodes; j++)
        for (int g = 0; g < w->groups; g++)
            w->carried_at[j*w->groups + g] = w->solving.row[a*w->nodes + j][width + g];
    return w->carried_at;
}

/* Eliminate a number from the rows of nu. */
static void eliminate(variations_t *w, double h, int a, int width)
{
    const int *const still = w->is_still + a*w->directions;
    const nodes_t *const slope = w->slope + a*w->directions, *const answer = answer_of(w, a);
    const int groups = w->groups;
    nodes_t table[NODES];
    for (int c = 0; c < 3; c++)
        if (!still[c]) {
            put_answered(w, answer, &slope[c], w->once, table);
            take_from_block(w, a, c, h, table);
        }
    for (int f = 0; f < w->felt; f++)
        if (!still[w->core + f]) {
            put_answered(w, answer, &slope[w->core + f], w->twice, table);
            for (int c = 0; c < 3; c++)
                take_from_block(w, a, c, h*h*carries_felt(w, f)[c], table);
        }
    const lanes_t *const own = gathered(w, a, width);
    lanes_t *const sum = w->solving.answered;
    memset(sum, 0, w->nodes*groups*sizeof *sum);
    add_product_of(w, answer, 1, own, sum);
    for (int c = 0; c < 3; c++)
        for (int j = 0; j < w->nodes; j++)
            for (int g = 0; g < groups; g++)
                w->solving.row[c*w->nodes + j][width + g] += w->slope[c*w->directions + a].node[j]*sum[j*groups + g];
}

/* Its rates, once those of nu are known: w->core_at and w->felt_at have what these add to nu and to what is felt. */
static void put_rates_apart(variations_t *w, int a, int width)
{
    const int *const still = w->is_still + a*w->directions;
    const nodes_t *const slope = w->slope + a*w->directions;
    const int groups = w->groups, nodes = w->nodes;
    lanes_t **const row = w->solving.row + a*nodes;
    lanes_t *const own = gathered(w, a, width), *const moved = w->solving.answered;
    for (int d = 0; d < w->core + w->felt; d++) {
        if (still[d] || (d >= 3 && d < w->core))
            continue;
        const lanes_t *const by = d < 3 ? w->core_at + d*NODES*groups : w->felt_at + (d - w->core)*NODES*groups;
        for (int j = 0; j < nodes; j++)
            for (int g = 0; g < groups; g++)
                own[j*groups + g] += slope[d].node[j]*by[j*groups + g];
    }
    memset(moved, 0, nodes*groups*sizeof *moved);
    add_product_of(w, answer_of(w, a), 1, own, moved);
    for (int j = 0; j < nodes; j++)
        for (int g = 0; g < groups; g++)
            row[j][width + g] = own[j*groups + g] + slope[a].node[j]*moved[j*groups + g];
}

/* What the rates of nu do to nu and to what is felt. */
static void put_answers_of_nu(variations_t *w, double h, int width)
{
    const int groups = w->groups, nodes = w->nodes;
    lanes_t *const rate = w->carried_at;
    memset(w->core_at, 0, 3*NODES*groups*sizeof *rate);
    memset(w->felt_at, 0, w->felt*NODES*groups*sizeof *rate);
    for (int c = 0; c < 3; c++)
        integrate(w, h, gathered(w, c, width), w->core_at + c*NODES*groups);
    for (int f = 0; f < w->felt; f++) {
        const double *const carries = carries_felt(w, f);
        for (int k = 0; k < nodes*groups; k++)
            rate[k] = carries[0]*w->core_at[k] + carries[1]*w->core_at[NODES*groups + k]
                + carries[2]*w->core_at[2*NODES*groups + k];
        integrate(w, h, rate, w->felt_at + f*NODES*groups);
    }
}
