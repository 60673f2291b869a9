/* Rests of slow slips, located while the rates of a step settle.
 *
 * The length of a step is found together with its rates, one sweep after the other. Where it changes by d, rates that
 * stay at their nodes belong to other instants than before: a sweep from them misses h d |rates'| of all speeds. That
 * moves the rest of a slip that falls by f per second by about h d |rates'|/f. Where f is small beside h |rates'|, the
 * rest moves by as much as the length has, one sweep later, and length and rates go around each other. So rates and
 * directions go along with their nodes: they are the polynomials' values at the new instants, and a change of the
 * length misses d^2 alone. */
#define MAX_MOVED 0.1               /* of the length: along a longer way tangents say little                */

/* How much values at the nodes change as the length of the step grows by this part of it. */
static nodes_t moved_along(const nodes_t *values, double grows)
{
    nodes_t change = times(gauss_slope, values);
    for (int b = 0; b < BLOCKS; b++)
        change.lanes[b] *= grows*gauss_node.lanes[b];
    return change;
}

static void move_rate(nodes_t *rate, double grows)
{
    const nodes_t change = moved_along(rate, grows);
    for (int b = 0; b < BLOCKS; b++)
        rate->lanes[b] += change.lanes[b];
}

static void move_directions(step_t *s, int i, double grows)
{
    const nodes_t *const x = s->slip.toward + 2*i, *const y = x + 1;
    const nodes_t by_x = moved_along(x, grows), by_y = moved_along(y, grows);
    nodes_t turn;
    for (int b = 0; b < BLOCKS; b++)
        turn.lanes[b] = x->lanes[b]*by_y.lanes[b] - y->lanes[b]*by_x.lanes[b];
    turn_directions(s, i, &turn);
    force_in_direction(s, i);
}

/* The step is to get this length. */
static void move_nodes(step_t *s, const int wheels, double length)
{
    const double grows = length/s->h - 1;
    if (!s->contact.turning || !(fabs(grows) > EPS && fabs(grows) < MAX_MOVED))
        return;
    for (int k = 0; k < 3; k++)
        move_rate(s->rate_nu + k, grows);
    for (int c = 0; c < s->core; c++)
        move_rate(s->rate_core + c, grows);
    for (int i = 0; i < wheels; i++)
        if (may_turn(s, i) && !s->contact.keeps[i])
            move_directions(s, i, grows);
}
