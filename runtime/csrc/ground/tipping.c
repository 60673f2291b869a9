/* Over which edge a vehicle tips whose loads are not found where it stands. The reasons are in
 * runtime/omniroll/effects/tipping.py; the names and the numbers are the same. */
#if SET_CORNERS
#define NEXT_TO_EDGE 1e-9           /* of the way from an edge to the contact that is farthest from it         */
#define EDGE_POINTS 16              /* on an edge                                                              */
#define HALVINGS 40                 /* of the way between two of them                                          */

/* An edge between two contacts; the third one is farthest from it. The middle of all contacts. */
typedef struct {
    int start, end, third;
    double along[2], middle[2];
} edge_t;

/* Whether there is such an edge between two contacts. */
static int find_edge(const omniroll_run_t *run, int start, int end, edge_t *edge)
{
    const double *const places = run->ground.places, *const from = places + 2*start;
    double most = 0;
    edge->start = start, edge->end = end;
    for (int k = 0; k < 2; k++)
        edge->along[k] = places[2*end + k] - from[k];
    put_middle(run, edge->middle);
    for (int i = 0; i < run->wheels; i++) {
        const double beside = edge->along[0]*(places[2*i + 1] - from[1]) - edge->along[1]*(places[2*i] - from[0]);
        if (beside > most)
            most = beside, edge->third = i;
    }
    return start != end && is_edge(run, from, edge->along);
}

/* By how much further loads act than at this part of an edge, times the weight, that are asked for there. */
static void moved_at(omniroll_run_t *run, const work_t *work, const int *other, const edge_t *edge, double part,
                     double *moments, double *off)
{
    const double *const places = run->ground.places;
    for (int k = 0; k < 2; k++) {
        const double point = places[2*edge->start + k] + part*edge->along[k];
        moments[k] = run->ground.weight*(point + NEXT_TO_EDGE*(places[2*edge->third + k] - point));
    }
    for (int i = 0; i < run->wheels; i++)
        run->grips[i].carries = i == edge->start || i == edge->end || i == edge->third;
    put_carrying(run);
    moments_off(run, work, other, moments, off);
}

/* Whether that points away from all contacts at a corner of theirs. */
static int leaves(const omniroll_run_t *run, int corner, const double *off)
{
    const double *const places = run->ground.places;
    for (int i = 0; i < run->wheels; i++)
        if (!((places[2*i] - places[2*corner])*off[0] + (places[2*i + 1] - places[2*corner + 1])*off[1] <= 0))
            return 0;
    return 1;
}

/* Whether it tips over an edge, but at its end, which belongs to the next one: with the modes that it has there, under
 * loads with these moments. */
static int tips_over(omniroll_run_t *run, const work_t *work, const int *other, const edge_t *edge, double *moments,
                     double *off)
{
    const double *const along = edge->along;
    moved_at(run, work, other, edge, 0, moments, off);
    if (leaves(run, edge->start, off))
        return 1;
    for (int k = 0; k < EDGE_POINTS; k++) {
        double low = (double)k/EDGE_POINTS, high = (k + 1.0)/EDGE_POINTS;
        moved_at(run, work, other, edge, low, moments, off);
        const int goes_on = off[0]*along[0] + off[1]*along[1] > 0;
        moved_at(run, work, other, edge, high, moments, off);
        if (!(goes_on && off[0]*along[0] + off[1]*along[1] <= 0))
            continue;
        for (int halving = 0; halving < HALVINGS; halving++) {
            const double middle = (low + high)/2;
            moved_at(run, work, other, edge, middle, moments, off);
            if (off[0]*along[0] + off[1]*along[1] > 0)
                low = middle;
            else
                high = middle;
        }
        moved_at(run, work, other, edge, low, moments, off);
        if (off[0]*along[1] - off[1]*along[0] > 0)
            return 1;
    }
    return 0;
}

/* Whether the vehicle tips with the friction of a round; then the failure is that. */
static int finds_where_it_tips(omniroll_run_t *run, const work_t *work, const int *other)
{
    double moments[2], off[2];
    edge_t edge;
    for (int start = 0; start < run->wheels; start++)
        for (int end = 0; end < run->wheels; end++) {
            if (!find_edge(run, start, end, &edge) || !tips_over(run, work, other, &edge, moments, off))
                continue;
            carrying_t found = {.sums = {run->ground.weight, moments[0] + off[0], moments[1] + off[1]}};
            found.determinant = 1;
            for (int i = 0; i < run->wheels; i++)
                found.compression[i] = run->grips[i].load;
            fail(run, OMNIROLL_LOADS_NONE, &found);
            run->ground.failure_is_regular = 1;
            return 1;
        }
    return 0;
}
#endif
