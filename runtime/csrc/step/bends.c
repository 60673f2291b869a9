/* Where in a step the rates bend, since friction with a small named speed changes its sign there. */
#define BEND 0.35                               /* part of a rate's change that is a jump between two nodes  */

/* The node before which a rate jumps, at most `before`. */
ALWAYS_INLINE int jump_of(const nodes_t *rate, int before)
{
    double sum = 0;
    for (int m = 1; m < NODES; m++)
        sum += fabs(rate->node[m] - rate->node[m - 1]);
    for (int m = 1; m < before; m++)
        if (fabs(rate->node[m] - rate->node[m - 1]) > BEND*sum)
            return m;
    return before;
}

/* Where in the step, between two nodes, rates bend: friction with a small named speed changes its sign. from: a place
 * before it, to: one beyond; both 1 where nothing bends. */
typedef struct {
    double from, to;
    int wheel;                                  /* whose rate passes zero there, or -1                     */
} bend_t;

/* A wheel whose rate passes zero there tells the place better than the nodes do: by a line and by a parabola through
 * the nodes before it, which differ by the error of the line. */
ALWAYS_INLINE bend_t zero_between(const step_t *s, int wheel, int place, bend_t found)
{
    const double *const x = gauss_node.node + place, *const y = s->rate_chi[wheel].node + place;
    if ((y[-1] < 0) == (y[0] < 0))
        return found;
    found.wheel = wheel;
    if (place < 3)
        return found;
    const double slope = (y[-1] - y[-2])/(x[-1] - x[-2]), before = (y[-2] - y[-3])/(x[-2] - x[-3]);
    const double curve = (slope - before)/(x[-1] - x[-3]), line = -y[-1]/slope;
    const double error = fabs(curve/slope*line*(line + x[-1] - x[-2]));
    if (line > 0 && 4*error < line && x[-1] + line < x[0]) {
        found.from = x[-1] + line - 2*error;
        found.to = fmin(x[0], x[-1] + line + 2*error);
    }
    return found;
}

/* The bend of a step that misses more than `allowed`. */
ALWAYS_INLINE bend_t bend(const step_t *s, const int wheels, double allowed)
{
    const double least = allowed*2*NODES/s->h;
    int place = NODES;
    for (int k = 0; k < 3; k++)
        if (tail(&s->rate_nu[k]) > least)
            place = jump_of(&s->rate_nu[k], place);
    if (SET_CORE_PARTS)
        for (int c = 0; c < s->core; c++)
            if (s->weight[c]*tail(&s->rate_core[c]) > least)
                place = jump_of(&s->rate_core[c], place);
    if (place == NODES)
        return (bend_t){1, 1, -1};
    bend_t found = {gauss_node.node[place - 1], gauss_node.node[place], -1};
    for (int i = 0; i < wheels; i++)
        found = zero_between(s, i, place, found);
    return found;
}
