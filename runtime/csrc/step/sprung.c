/* Heave and tilt of a platform on springs, which make their rates stiff: Newton's rule for these.
 *
 * With rates u and places z the springs give u' = f(u, z), all but affine, and z' = u: the nodes take the rates of z
 * from u. What a sweep misses of u' is taken away with one 3 x 3 slope by u and one by z for all nodes, in the eigenvectors in which speeds that
 * are coupled are solved for (coupled.c). The other speeds go along: the ground point swings under the centre of mass, and
 * friction follows the loads. */
#define SWING_NODES 3.415e15        /* NODES (2 NODES - 5)!!                                                             */
#define TILT_MOVES 1e-4             /* m and rad, and per second: differences for slopes of what is all but affine    */

/* The fastest swing of heave and tilt, in rad/s. */
ALWAYS_INLINE double fastest_swing(const step_t *s)
{
    double stiffness = 0;
    for (int k = 0; SET_LOADS_FOLLOW && k < 3; k++)
        stiffness = fmax(stiffness, fabs(s->sprung.slope[k][3 + k]));
    return sqrt(stiffness);
}

/* The length of a step whose polynomials would miss as much of a swing with these accelerations as is allowed: over a step
 * of the length h Legendre's coefficient k of exp(i w t) has the size (2k + 1) j_k(w h/2), and the spherical Bessel
 * function j_k(x) is x^k/(2k + 1)!! at most. The tail of the polynomials begins with k = NODES - 2. */
static double longest_in_swing(const step_t *s, const int wheels, const lanes_t *core_dot, double allowed)
{
    const double swing = fastest_swing(s);
    double largest = 0;
    for (int k = 0; k < 3; k++) {
        const int n = tilt_rates_at(wheels) + k;
        largest = fmax(largest, s->weight[n]*fabs(core_dot[n][0]));
    }
    return 2/swing*pow(SWING_NODES*allowed*swing/largest, 1.0/(NODES - 1));
}

/* The matrix of a step of this length, eliminated: 1 - e (slopes by u) - e^2 (slopes by z), with e = h (eigenvalue). */
static void eliminate_tilt(step_t *s)
{
    const coupled_t *const c = s->coupled;
    const complex_t e = less_eigenvalue(0, -s->h, 1), e_squared = product(e, e);
    s->sprung.h = s->h;
    for (int k = 0; k < 3; k++)
        for (int l = 0; l < 3; l++) {
            const double by_u = s->sprung.slope[k][l], by_z = s->sprung.slope[k][3 + l];
            c->filled[3*k + l] = by_u != 0 || by_z != 0;
            complex_t value = less_eigenvalue(k == l, s->h, by_u);
            for (int v = 0; v < EIGEN_BLOCKS; v++) {
                value.real.lanes[v] -= by_z*e_squared.real.lanes[v];
                value.imaginary.lanes[v] -= by_z*e_squared.imaginary.lanes[v];
            }
            put_entry(c->real, c->imaginary, 3*k + l, value);
        }
    eliminate_filled(c);
}

/* Adds to the rates of the other speeds what a change of u' makes of them. */
static void follow_tilt(step_t *s, const int wheels, const nodes_t *u_dot_changed)
{
    nodes_t u[3], z[3];
    for (int l = 0; l < 3; l++) {
        integrate_to_nodes(0, s->h, &u_dot_changed[l], &u[l]);
        integrate_to_nodes(0, s->h, &u[l], &z[l]);
    }
    for (int j = 0; j < 3 + coupled_size(wheels); j++) {
        if (j >= 3 && follows_nu(s, wheels, j - 3))
            continue;
        nodes_t *const rate = j < 3 ? &s->rate_nu[j] : &s->rate_core[j - 3];
        const double *const slope = s->sprung.slope[3 + j];
        for (int l = 0; l < 3; l++)
            for (int b = 0; b < BLOCKS; b++)
                rate->lanes[b] += slope[l]*u[l].lanes[b] + slope[3 + l]*z[l].lanes[b];
    }
}

/* What Newton's rule adds to u', of which the sweep has found `found` (3); on the short way of a step whose clock is not
 * time, what Picard's iteration adds. Returns the largest change so far, in the measure of nu. */
static lanes_t correct_tilt(step_t *s, const int wheels, const nodes_t *found, lanes_t change)
{
    const int first = tilt_rates_at(wheels), in_time = !SET_APPROACHES || s->approach.stretched <= 1;
    nodes_t *const missing = s->coupled->missing;
    for (int k = 0; k < 3; k++)
        for (int b = 0; b < BLOCKS; b++)
            missing[k].lanes[b] = found[k].lanes[b] - s->rate_core[first + k].lanes[b];
    if (in_time && s->h != s->sprung.h)
        eliminate_tilt(s);
    if (in_time)
        solve_coupled(s->coupled, s->h, 0);
    for (int k = 0; k < 3; k++)
        change = corrected(s->rate_core + first + k, missing + k, s->weight[first + k], change);
    if (in_time)
        follow_tilt(s, wheels, missing);
    return change;
}

/* A first guess of a step whose rates are those at its start: heave and tilt swing as their slopes tell. */
static void guess_tilt(step_t *s, const int wheels)
{
    const nodes_t *const rate = s->rate_core + tilt_rates_at(wheels);
    const double *const start = s->start_core + tilt_rates_at(wheels);
    nodes_t found[3];
    for (int b = 0; b < BLOCKS; b++) {
        const lanes_t time = s->h*gauss_node.lanes[b];
        for (int k = 0; k < 3; k++) {
            const double *const slope = s->sprung.slope[k];
            found[k].lanes[b] = rate[k].lanes[b];
            for (int l = 0; l < 3; l++)
                found[k].lanes[b] += (slope[l]*rate[l].lanes[b] + slope[3 + l]*(start[l] + rate[l].lanes[b]*(time/2)))*time;
        }
    }
    correct_tilt(s, wheels, found, lanes_of(0));
}
