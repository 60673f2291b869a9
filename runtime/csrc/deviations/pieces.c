/* Pieces of a step, for deviations that are too fast for its nodes.
 *
 * Where a deviation decays by exp(-z) in a step, collocation at s nodes of Gauss gives that as exactly as it looks
 * while z is less than about s. Beyond that it is off by about exp(-2 s (s + 1)/z), and at last by all of it. Most
 * often that does no harm: what is so fast has decayed before steps are long. But a run that rests has steps that are
 * as long as it lasts, whatever slips beside it would do. So a step is looked at twice. The slopes at the nodes say
 * whether some rate is fast. Where one is, the last two of Legendre's polynomials say how much of it there is: of the
 * rates of a deviation of 1 they make about 4 s exp(-s (s + 1)/z). Inside a step collocation has half the order, and
 * is off by about 3e-4 of what they make where z is s. */
#define FAST 1.25               /* a node: how many times its inverse length a rate in a step may be */
#define FAST_INSIDE 0.4         /* the same where somebody looks between the rows */
#define MAX_INSIDE 300          /* times what they may be off by: what the last two polynomials may make there */
#define SHORTEST 0x1p-60        /* of a step: a piece that is not cut */

/* Work at the nodes of a whole step: where slips are near rest, roundings of other weights would be seen. */
static void take_step(variations_t *w)
{
    memcpy(w->step.part.node, w->run->gauss.nodes, w->nodes*sizeof(double));
    memcpy(w->step.of_coefficients, w->run->gauss.of_coefficients, (w->run->motion.degree + 1)*w->nodes*sizeof(double));
}

/* Or of a piece of it, from a part of it on and such a part of it long. */
static void take_piece(variations_t *w, double from, double part)
{
    const int degree = w->run->motion.degree, nodes = w->nodes;
    for (int j = 0; j < nodes; j++) {
        const double x = from + part*w->run->gauss.nodes[j], rest = 1 - x;
        double factor = 1, *const weight = w->step.of_coefficients + j;
        w->step.part.node[j] = x;
        for (int c = 0; c <= degree; c++, factor *= x*(degree + 1 - c)/c)
            weight[c*nodes] = factor;
        factor = 1;
        for (int c = degree; c >= 0; c--, factor *= rest)
            weight[c*nodes] *= factor;
    }
}

/* About the fastest rate in a step of length h, times that, from the slopes f of the core: with real rates the sum of
 * their squares is at most that of |f_ac f_ca|, which depends on no units. */
static double fastest(const variations_t *w, double h)
{
    double largest = 0;
    lanes_t sum[NODES/LANES] = {{0}};
    for (int a = 0; a < w->core; a++)
        for (int c = 0; c <= a; c++) {
            const int one = a*w->directions + c, other = c*w->directions + a;
            if (w->slopes.is_zero[one] || w->slopes.is_zero[other])
                continue;
            for (int b = 0; b < w->blocks; b++)
                sum[b] += (a == c ? 1 : 2)*lanes_abs(w->slopes.core[one].lanes[b]*w->slopes.core[other].lanes[b]);
        }
    for (int j = 0; j < w->nodes; j++)
        largest = fmax(largest, sum[j/LANES][j%LANES]);
    return h*sqrt(largest);
}

/* Whether deviations of speeds are too fast for the nodes of a step, whose rates are known. */
static int are_too_fast(const variations_t *w, long long row, double h)
{
    const int speeds = SET_SLIPS && !SET_DISKS_STICK ? w->core : first_momentum(w), nodes = w->nodes;
    double rate = fastest(w, h);
    for (int i = 0; i < w->wheels; i++)
        rate *= !turns_in(w, row, i);       /* a turn goes with the rates, and what it does is no slope of theirs */
    if (!(rate > (w->inside ? FAST_INSIDE : FAST)*nodes) || h < SHORTEST*w->step.length)
        return 0;
    const double behind = 4*nodes*exp(nodes*(nodes + 1)/rate);
    const double allowed = w->run->bounds.max_error*(w->inside ? fmin(behind, MAX_INSIDE) : behind);
    for (int g = 0; g < w->groups; g++) {
        lanes_t tail = {0}, size = {0};
        for (int a = 0; a < speeds; a++) {
            lanes_t last = {0}, before = {0}, end = start_of_core(w, a)[g];
            size += lanes_abs(end);
            for (int j = 0; j < nodes; j++) {
                const lanes_t change = h*w->solving.row[a][j*w->groups + g];
                last += w->run->gauss.last[j]*change, before += w->run->gauss.before_last[j]*change;
                end += w->run->gauss.weights[j]*change;
            }
            tail += lanes_abs(last) + lanes_abs(before), size += lanes_abs(end);
        }
        for (int k = 0; k < LANES && g*LANES + k < w->columns; k++)
            if (tail[k] > allowed*(size[k] + w->run->bounds.least[g*LANES + k]/w->step.length))
                return 1;
    }
    return 0;
}
