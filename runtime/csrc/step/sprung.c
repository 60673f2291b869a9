/* Heave and tilt of a platform on springs, which make their rates stiff: Newton's rule for these six numbers.
 *
 * With rates u and places z the springs give u' = f(u, z), all but affine, and z' = u. What a sweep misses of both is
 * taken away with one 3 x 3 slope by each for all nodes, as that of speeds which are coupled (coupled.c). The other
 * speeds go along: the ground point swings under the centre of mass, and friction follows the loads. */
#define TILT_MOVES 1e-4             /* m and rad, and per second: differences for slopes of what is all but affine    */

/* Whether a number of the core is one of heave and tilt: their rates, then they themselves. */
ALWAYS_INLINE int is_of_tilt(const int wheels, int c)
{
    if (SET_LOADS_FOLLOW)
        return c >= tilt_rates_at(wheels) && c < tilt_at(wheels) + 3;
    (void)wheels, (void)c;
    return 0;
}

/* The matrix of a step of this length, eliminated. */
static void eliminate_tilt(step_t *s)
{
    const coupled_t *const c = s->coupled;
    s->sprung.h = s->h;
    for (int k = 0; k < 3; k++)
        for (int l = 0; l < 6; l++)
            c->slope[6*k + l] = s->sprung.slope[k][l], c->slope[6*(3 + k) + l] = l == k;
    eliminate_coupled(c, s->h);
}

/* The rates of the other speeds as those of heave and tilt change (6). */
static void follow_tilt(step_t *s, const int wheels, const nodes_t *changed)
{
    nodes_t moved[6];
    for (int l = 0; l < 6; l++)
        integrate_to_nodes(0, s->h, &changed[l], &moved[l]);
    for (int j = 0; j < 3 + coupled_size(wheels); j++) {
        if (j >= 3 && follows_nu(s, wheels, j - 3))
            continue;
        nodes_t *const rate = j < 3 ? &s->rate_nu[j] : &s->rate_core[j - 3];
        for (int l = 0; l < 6; l++)
            for (int b = 0; b < BLOCKS; b++)
                rate->lanes[b] += s->sprung.slope[3 + j][l]*moved[l].lanes[b];
    }
}

/* What Newton's rule adds to the rates of heave and tilt, of which the sweep has found `found` (6). Returns the largest
 * change so far, in the measure of nu. */
static lanes_t correct_tilt(step_t *s, const int wheels, const nodes_t *found, lanes_t change)
{
    nodes_t *const rate = s->rate_core + tilt_rates_at(wheels), *const missing = s->coupled->missing;
    if (s->h != s->sprung.h)
        eliminate_tilt(s);
    for (int k = 0; k < 6; k++)
        for (int b = 0; b < BLOCKS; b++)
            missing[k].lanes[b] = found[k].lanes[b] - rate[k].lanes[b];
    solve_coupled(s->coupled, s->h, 3);
    for (int k = 0; k < 6; k++)
        change = corrected(rate + k, missing + k, s->weight[tilt_rates_at(wheels) + k], change);
    follow_tilt(s, wheels, missing);
    return change;
}

/* A first guess of a step whose rates are those at its start: heave and tilt swing as their slopes tell. */
static void guess_tilt(step_t *s, const int wheels)
{
    const int first = tilt_rates_at(wheels);
    nodes_t found[6];
    for (int k = 0; k < 3; k++)
        for (int b = 0; b < BLOCKS; b++) {
            const lanes_t time = s->h*gauss_node.lanes[b];
            found[k].lanes[b] = s->rate_core[first + k].lanes[b];
            for (int l = 0; l < 6; l++)
                found[k].lanes[b] += s->sprung.slope[k][l]*s->rate_core[first + l].lanes[b]*time;
            found[3 + k].lanes[b] = s->start_core[first + k] + s->rate_core[first + k].lanes[b]*time;
        }
    for (int k = 0; k < 6; k++)
        s->weight[first + k] = 0;
    correct_tilt(s, wheels, found, lanes_of(0));
}
