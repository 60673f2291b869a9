/* Where a vehicle may stand, where Newton's rule finds no loads from a few starts. The reasons are in
 * runtime/omniroll/effects/where_it_stands.py; the names and the numbers are the same. */
#if SET_CORNERS
#define FAN_PARTS 8                 /* of each side of a triangle                                              */
#define CLOSER 30                   /* halvings of a cell                                                      */

/* Loads on a triangle from the middle to an edge: the parts of the way to its ends, and by how much the moments are off
 * that the motion asks for under these. */
typedef struct {
    double part[2], off[2];
} node_t;

/* The loads of a node. */
static void load_node(omniroll_run_t *run, const edge_t *edge, const double *part)
{
    for (int i = 0; i < run->wheels; i++)
        run->grips[i].load = run->ground.weight*((1 - part[0] - part[1])/run->wheels
            + part[0]*(i == edge->start) + part[1]*(i == edge->end));
}

static void evaluate_node(omniroll_run_t *run, const work_t *work, const int *other, const edge_t *edge, node_t *node)
{
    double moments[2];
    load_node(run, edge, node->part);
    moments_of_contacts(run, moments);
    work->under_loads->seeks_sets = 1;
    moments_off(run, work, other, moments, node->off);
}

/* Weights with the sum 1 by which what is off at a cell's corners cancels; the least one. */
static double cancel(const node_t *cell, double *weight)
{
    double whole = 0, least = INFINITY;
    for (int k = 0; k < 3; k++) {
        const double *const one = cell[(k + 1)%3].off, *const other = cell[(k + 2)%3].off;
        whole += weight[k] = one[0]*other[1] - one[1]*other[0];
    }
    for (int k = 0; k < 3; k++)
        least = fmin(least, weight[k] /= whole);
    return isfinite(whole) && whole != 0 ? least : -INFINITY;
}

/* Halves a cell, across its longest side, as long as a half holds zero (rule 2). */
static void close_in(omniroll_run_t *run, const work_t *work, const int *other, const edge_t *edge, node_t *cell)
{
    for (int halving = 0; halving < CLOSER; halving++) {
        double longest = 0, weight[3];
        node_t half[2][3], middle;
        int end = 0;
        for (int k = 0; k < 3; k++) {
            const double *const one = cell[k].part, *const two = cell[(k + 2)%3].part;
            double side[2];
            for (int j = 0; j < 2; j++)
                side[j] = (one[0] - two[0])*(run->ground.places[2*edge->start + j] - edge->middle[j])
                    + (one[1] - two[1])*(run->ground.places[2*edge->end + j] - edge->middle[j]);
            if (length_of(side, 2) > longest)
                longest = length_of(side, 2), end = k;
        }
        for (int j = 0; j < 2; j++)
            middle.part[j] = (cell[end].part[j] + cell[(end + 2)%3].part[j])/2;
        evaluate_node(run, work, other, edge, &middle);
        for (int k = 0; k < 2; k++) {
            memcpy(half[k], cell, sizeof half[k]);
            half[k][k ? (end + 2)%3 : end] = middle;
        }
        const double first = cancel(half[0], weight), second = cancel(half[1], weight);
        if (!(fmax(first, second) >= 0))
            return;
        memcpy(cell, half[second > first], sizeof half[0]);
    }
}

/* The corners of a cell of a triangle with these nodes; of two at one place the second one is turned. */
static void put_cell(const node_t nodes[FAN_PARTS + 1][FAN_PARTS + 1], int x, int y, int turned, node_t *cell)
{
    cell[0] = nodes[x + turned][y + turned];
    cell[1] = turned ? nodes[x][y + 1] : nodes[x + 1][y];
    cell[2] = turned ? nodes[x + 1][y] : nodes[x][y + 1];
}
#endif
