/* Speeds that are coupled: where wheels may slip, nu, the wheels' rates and the axial speeds of the rollers in contact.
 * The ground's friction makes slip decay far faster than the vehicle moves, so that Picard's iteration has no chance.
 *
 * Newton's rule with slopes of one instant finds the rates of all nodes at once: change = missing + slope h (integral of
 * the change). In the eigenvectors of the integrals to the nodes these are eight systems by themselves, complex
 * and as small as the speeds are many, one in each lane (Hairer and Wanner, Solving Ordinary Differential Equations II,
 * IV.8). In each of these speeds the kinetic energy is a square, and friction takes energy: pivots stay away from zero
 * in their order. */
#define FOLLOWS 10                  /* h times a slope with which a speed follows the others at once          */
#define SLOPE_DIFFERENCE 1e-10      /* of the size of a speed, for slopes                                   */
#define SPEED_ROUNDING 16           /* roundings of the largest speed that further sweeps do not take away  */
#define MAX_RENEWALS 2              /* of the slopes in a try                                               */
#define MOVES_AT_ONCE 7             /* moved states that count as an evaluation at all nodes                */
#define EIGEN_BLOCKS (EIGENVALUES/LANES)
#define MIDDLE (NODES/2 - 1)        /* the node at which they are renewed                                   */

/* Its parts; `core` numbers beside nu. */
static void lay_out_coupled(coupled_t *c, parts_t *parts, int size, long long core)
{
    const long long square = (long long)size*size;
    c->size = size;
    c->missing = lanes_part(parts, BLOCKS*(core + 3));
    c->real = lanes_part(parts, square*EIGEN_BLOCKS);
    c->imaginary = lanes_part(parts, square*EIGEN_BLOCKS);
    c->found_real = lanes_part(parts, size*EIGEN_BLOCKS);
    c->found_imaginary = lanes_part(parts, size*EIGEN_BLOCKS);
    c->slope = numbers_part(parts, square);
    c->start = numbers_part(parts, size);
    c->small = numbers_part(parts, square + size);
    c->diagonal = numbers_part(parts, core);
    c->reach = numbers_part(parts, size);
    c->filled = lanes_part(parts, square/(long long)sizeof(lanes_t) + 1);
}

ALWAYS_INLINE double weight_of(const step_t *s, int speed)
{
    const int others = s->coupled->size - 3;
    return speed < others ? s->weight[speed] : 1;
}

/* What a number of the core is moved by, for slopes. */
ALWAYS_INLINE double difference(const step_t *s, double weight)
{
    const double size = weight > 0 ? s->size/weight : 0;
    return SLOPE_DIFFERENCE*(size > 0 ? size : 1);
}

/* The state at a node in all lanes, or with -1 that at the start. */
ALWAYS_INLINE point_t point_for_slopes(step_t *s, const int wheels, int node, arrays_t *at)
{
    const int early = node < 0, m = early ? 0 : node;
    double nu[3], chi[MAX_WHEELS];
    for (int k = 0; k < 3; k++)
        nu[k] = early ? s->nu[k] : s->at_nu[k].node[m];
    for (int i = 0; i < wheels; i++)
        chi[i] = early ? s->chi[i] : s->at_chi[i].node[m];
    for (int c = 0; c < s->core; c++)
        s->core_here[c] = lanes_of(early ? s->start_core[c] : core_at(s, m/LANES)[c][m%LANES]);
    return point_from(s, wheels, 0, nu, chi, early ? s->acts.heading : s->acts.at_heading.node[m],
                      early ? 0 : s->h*gauss_node.node[m], at);
}

/* The first lanes stay as they are; the next ones have one speed moved each, and behind these one part of the rest of the
 * core. A `sign` of -1 takes the moves back. */
ALWAYS_INLINE void move_lanes(step_t *s, const int wheels, int first, double sign, arrays_t *at)
{
    const coupled_t *const c = s->coupled;
    const int others = c->size - 3, rollers = s->vehicle->rollers_per_wheel;
    for (int lane = 1; lane < LANES; lane++) {
        const int k = first + lane - 1;
        if (k < others)
            s->core_here[k][lane] += sign*difference(s, s->weight[k]);
        else if (k < c->size)
            at->nu[k - others][lane] += sign*difference(s, 1);
        for (int part = 0; part < SET_CORE_PARTS && k >= c->size; part++) {
            const int end = core_part_end(wheels, rollers, part);
            const int start = part ? core_part_end(wheels, rollers, part - 1) : 0;
            for (int n = start; n < end && start >= others && k - c->size == part; n++)
                s->core_here[n][lane] += sign*difference(s, s->weight[n]);
        }
    }
}

/* How much faster the roller in contact turns as its wheel moves along its axle, at these angles of the wheels. */
ALWAYS_INLINE void reaches(const step_t *s, const int wheels, const lanes_t *chi, lanes_t *reach)
{
    lanes_t along[MAX_WHEELS], across[MAX_WHEELS];
    const lanes_t one = lanes_of(1), none = lanes_of(0);
    const lanes_t x[3] = {one, none, none}, y[3] = {none, one, none};
    set_contact_axial(wheels, s->vehicle, x, chi, along);
    set_contact_axial(wheels, s->vehicle, y, chi, across);
    for (int i = 0; i < wheels; i++)
        for (int k = 0; k < LANES; k++)
            reach[i][k] = sqrt(along[i][k]*along[i][k] + across[i][k]*across[i][k]);
}

/* The slopes of the rates at an instant, by differences. */
static void find_slopes(step_t *s, const int wheels, int node)
{
    const coupled_t *const c = s->coupled;
    const int size = c->size, others = size - 3, moves = size + (s->core > others ? SET_CORE_PARTS : 0);
    arrays_t at;
    const point_t point = point_for_slopes(s, wheels, node, &at);
    if (SET_HAS_CONTACT_SPEEDS) {
        lanes_t reach[MAX_WHEELS];
        reaches(s, wheels, at.chi, reach);
        for (int i = 0; i < wheels; i++)
            c->reach[i] = reach[i][0];
    }
    for (int first = 0; first < moves; first += LANES - 1) {
        lanes_t nu_dot[3];
        move_lanes(s, wheels, first, 1, &at);
        core_rates(wheels, &point, nu_dot);
        move_lanes(s, wheels, first, -1, &at);
        for (int lane = 1; lane < LANES; lane++) {
            const int k = first + lane - 1;
            const double by = k < size ? difference(s, weight_of(s, k)) : 0;
            for (int j = 0; j < size && k < size; j++) {
                const lanes_t rate = j < others ? s->core_dot[j] : nu_dot[j - others];
                c->slope[j*size + k] = (rate[lane] - rate[0])/by;
            }
            for (int n = others; n < s->core && k >= size; n++) {
                const double slope = (s->core_dot[n][lane] - s->core_dot[n][0])/difference(s, s->weight[n]);
                if (k == size || slope != 0)
                    c->diagonal[n] = slope;
            }
        }
    }
    const int evaluations = (moves + MOVES_AT_ONCE - 1)/MOVES_AT_ONCE;
    s->sweeps += evaluations;
}

/* The change of small rates in a time: (1 - time slope)^-1 times them, in their place, of the coupled speeds. */
static void after(const coupled_t *c, double time, double *rates)
{
    const int size = c->size;
    double *const m = c->small;
    for (int j = 0; j < size; j++)
        for (int k = 0; k < size; k++)
            m[j*size + k] = (j == k) - time*c->slope[j*size + k];
    solve_rows(m, size, rates);
}

/* Complex numbers, one for each eigenvalue. */
typedef struct {
    eigen_t real, imaginary;
} complex_t;

ALWAYS_INLINE complex_t product(complex_t a, complex_t b)
{
    complex_t found;
    IN_REGISTERS
    for (int v = 0; v < EIGEN_BLOCKS; v++) {
        const lanes_t a_real = a.real.lanes[v], a_imaginary = a.imaginary.lanes[v];
        found.real.lanes[v] = a_real*b.real.lanes[v] - a_imaginary*b.imaginary.lanes[v];
        found.imaginary.lanes[v] = a_real*b.imaginary.lanes[v] + a_imaginary*b.real.lanes[v];
    }
    return found;
}

ALWAYS_INLINE complex_t inverse(complex_t a)
{
    IN_REGISTERS
    for (int v = 0; v < EIGEN_BLOCKS; v++) {
        const lanes_t real = a.real.lanes[v], imaginary = a.imaginary.lanes[v], size = 1/(real*real + imaginary*imaginary);
        a.real.lanes[v] = real*size, a.imaginary.lanes[v] = -imaginary*size;
    }
    return a;
}

/* Take the product of two numbers, which may stand in tables, from one that stands in a table. */
ALWAYS_INLINE void take_product(eigen_t *real, eigen_t *imaginary, const eigen_t *a_real, const eigen_t *a_imaginary,
                                const eigen_t *b_real, const eigen_t *b_imaginary)
{
    IN_REGISTERS
    for (int v = 0; v < EIGEN_BLOCKS; v++) {
        real->lanes[v] -= a_real->lanes[v]*b_real->lanes[v] - a_imaginary->lanes[v]*b_imaginary->lanes[v];
        imaginary->lanes[v] -= a_real->lanes[v]*b_imaginary->lanes[v] + a_imaginary->lanes[v]*b_real->lanes[v];
    }
}

ALWAYS_INLINE complex_t entry(const eigen_t *real, const eigen_t *imaginary, int place)
{
    return (complex_t){real[place], imaginary[place]};
}

ALWAYS_INLINE void put_entry(eigen_t *real, eigen_t *imaginary, int place, complex_t value)
{
    real[place] = value.real, imaginary[place] = value.imaginary;
}

/* real_part - h (eigenvalue) slope. */
ALWAYS_INLINE complex_t less_eigenvalue(double real_part, double h, double slope)
{
    complex_t found;
    IN_REGISTERS
    for (int v = 0; v < EIGEN_BLOCKS; v++) {
        found.real.lanes[v] = real_part - h*eigenvalue_real.lanes[v]*slope;
        found.imaginary.lanes[v] = -(h*eigenvalue_imaginary.lanes[v])*slope;
    }
    return found;
}

/* Gauss's elimination of a matrix for each eigenvalue: L below the diagonal, 1/U on it. Most speeds know nothing of each
 * other: what is zero stays out. */
static void eliminate_filled(const coupled_t *c)
{
    const int size = c->size;
    for (int k = 0; k < size; k++) {
        const complex_t pivot = inverse(entry(c->real, c->imaginary, k*size + k));
        put_entry(c->real, c->imaginary, k*size + k, pivot);
        for (int j = k + 1; j < size; j++) {
            if (!c->filled[j*size + k])
                continue;
            const complex_t factor = product(entry(c->real, c->imaginary, j*size + k), pivot);
            put_entry(c->real, c->imaginary, j*size + k, factor);
            for (int l = k + 1; l < size; l++) {
                if (!c->filled[k*size + l])
                    continue;
                take_product(&c->real[j*size + l], &c->imaginary[j*size + l], &factor.real, &factor.imaginary,
                             &c->real[k*size + l], &c->imaginary[k*size + l]);
                c->filled[j*size + l] = 1;
            }
        }
    }
}

/* That of 1 - h (eigenvalue) slope. */
static void eliminate_coupled(const coupled_t *c, double h)
{
    const int size = c->size;
    for (int j = 0; j < size; j++)
        for (int k = 0; k < size; k++) {
            const double slope = c->slope[j*size + k];
            put_entry(c->real, c->imaginary, j*size + k, less_eigenvalue(j == k, h, slope));
            c->filled[j*size + k] = slope != 0;
        }
    eliminate_filled(c);
}

/* Values at the nodes in the eigenvectors. */
ALWAYS_INLINE complex_t to_eigen(const nodes_t *values)
{
    complex_t sum;
    IN_REGISTERS
    for (int v = 0; v < EIGEN_BLOCKS; v++) {
        lanes_t real = lanes_of(0), imaginary = lanes_of(0);
        for (int m = 0; m < NODES; m++) {
            real += values->node[m]*to_eigen_real[m].lanes[v];
            imaginary += values->node[m]*to_eigen_imaginary[m].lanes[v];
        }
        sum.real.lanes[v] = real, sum.imaginary.lanes[v] = imaginary;
    }
    return sum;
}

/* And back. */
ALWAYS_INLINE void from_eigen(const complex_t *modes, nodes_t *values)
{
    IN_REGISTERS
    for (int b = 0; b < BLOCKS; b++) {
        lanes_t sum = lanes_of(0);
        for (int k = 0; k < EIGENVALUES; k++)
            sum += modes->real.value[k]*from_eigen_real[k].lanes[b] + modes->imaginary.value[k]*from_eigen_imaginary[k].lanes[b];
        values->lanes[b] = sum;
    }
}

/* The change of the rates that the eliminated matrix gives, in the place of what is missing; `core` as above. */
static void solve_coupled(const coupled_t *c, double h, int core)
{
    const int size = c->size, others = size - 3;
    eigen_t *const real = c->found_real, *const imaginary = c->found_imaginary;
    for (int j = 0; j < size; j++) {
        complex_t rest = to_eigen(&c->missing[j < others ? j : core + j - others]);
        for (int k = 0; k < j; k++)
            if (c->filled[j*size + k])
                take_product(&rest.real, &rest.imaginary, c->real + j*size + k, c->imaginary + j*size + k,
                             real + k, imaginary + k);
        put_entry(real, imaginary, j, rest);
    }
    for (int j = size - 1; j >= 0; j--) {
        complex_t rest = entry(real, imaginary, j);
        for (int k = j + 1; k < size; k++)
            if (c->filled[j*size + k])
                take_product(&rest.real, &rest.imaginary, c->real + j*size + k, c->imaginary + j*size + k,
                             real + k, imaginary + k);
        rest = product(rest, entry(c->real, c->imaginary, j*size + j));
        put_entry(real, imaginary, j, rest);
        from_eigen(&rest, &c->missing[j < others ? j : core + j - others]);
    }
    for (int n = others; n < core; n++) {
        const complex_t change = product(to_eigen(&c->missing[n]), inverse(less_eigenvalue(1, h, c->diagonal[n])));
        from_eigen(&change, &c->missing[n]);
    }
}

/* The speeds of wheels that roll, in the order of the core, at the nodes in vector b; with b = -1 at the start. */
ALWAYS_INLINE void rolling_speeds(const step_t *s, const int wheels, int b, lanes_t *speeds)
{
    lanes_t nu[3], chi[MAX_WHEELS];
    for (int k = 0; k < 3; k++)
        nu[k] = b < 0 ? lanes_of(s->nu[k]) : s->at_nu[k].lanes[b];
    for (int i = 0; i < wheels; i++)
        chi[i] = b < 0 ? lanes_of(s->chi[i]) : lanes_clamp(s->at_chi[i].lanes[b], s->joint[i]);
    rolling_wheels(wheels, s->vehicle, nu, chi, speeds + rates_at(wheels));
    if (SET_HAS_CONTACT_SPEEDS)
        set_contact_axial(wheels, s->vehicle, nu, chi, speeds + contact_speeds_at(wheels));
}

/* Rates with which a speed has the values `at` at the nodes. */
ALWAYS_INLINE void rates_between(double start, double h, const nodes_t *at, nodes_t *rate)
{
    nodes_t moved;
    for (int b = 0; b < BLOCKS; b++)
        moved.lanes[b] = at->lanes[b] - start;
    const complex_t found = product(to_eigen(&moved), inverse(less_eigenvalue(0, -h, 1)));
    from_eigen(&found, rate);
}

/* A better guess where friction is steep: the slip stays, and not the rate. Friction with a small named speed is steep only
 * next to where it vanishes: a guess beside that tells Newton's rule nothing. */
static void guess_that_slip_stays(step_t *s, const int wheels)
{
    const int size = s->coupled->size, of_wheels = size - 3 - 3*SET_TILTS;
    lanes_t at_start[2*MAX_WHEELS];
    states_at_nodes(s, wheels);
    rolling_speeds(s, wheels, -1, at_start);
    for (int b = 0; b < BLOCKS; b++) {
        lanes_t speeds[2*MAX_WHEELS];
        rolling_speeds(s, wheels, b, speeds);
        for (int n = 0; n < of_wheels; n++)
            s->coupled->missing[n].lanes[b] = speeds[n] + (s->start_core[n] - at_start[n]);
    }
    for (int n = 0; n < of_wheels; n++)
        if (-s->h*s->coupled->slope[n*size + n] > FOLLOWS)
            rates_between(s->start_core[n], s->h, &s->coupled->missing[n], &s->rate_core[n]);
}

/* The first guess: rates at the start, where what decays within the step has decayed. */
static void first_guess(step_t *s, const int wheels, lanes_t *nu_dot)
{
    const coupled_t *const c = s->coupled;
    const int size = c->size, others = size - 3;
    double *const rates = c->small + size*size;
    for (int n = 0; n < s->core; n++)
        s->end_core[n] = s->core_dot[n][0];
    find_slopes(s, wheels, -1);
    for (int j = 0; j < size; j++)
        rates[j] = c->start[j] = j < others ? s->end_core[j] : nu_dot[j - others][0];
    after(c, s->h/2, rates);
    for (int k = 0; k < 3; k++)
        nu_dot[k] = lanes_of(rates[others + k]);
    for (int n = 0; n < s->core; n++)
        s->core_dot[n] = lanes_of(n < others ? rates[n] : s->end_core[n]/(1 - s->h/2*c->diagonal[n]));
    for (int b = 0; b < BLOCKS; b++) {
        for (int k = 0; k < 3; k++)
            s->rate_nu[k].lanes[b] = nu_dot[k];
        for (int n = 0; n < s->core; n++)
            s->rate_core[n].lanes[b] = s->core_dot[n];
    }
    guess_that_slip_stays(s, wheels);
    s->fresh = 1, s->renewals = 0;
}

/* The slopes turn with the wheels, since a roller's radius changes: numbers in units of it hardly do. */
static void stretch(step_t *s, const int wheels, const nodes_t *factor)
{
    const int first = contact_speeds_at(wheels), size = s->coupled->size;
    for (int i = 0; i < wheels; i++) {
        const int n = first + i;
        if (-s->h*s->coupled->slope[n*size + n] > FOLLOWS)
            for (int b = 0; b < BLOCKS; b++)
                s->coupled->missing[n].lanes[b] *= factor[i].lanes[b];
    }
}

/* What is missing of the rates at the nodes. slow: whether the sweeps before have not contracted fast. */
ALWAYS_INLINE void find_missing(step_t *s, const int wheels, int slow)
{
    nodes_t *const missing = s->coupled->missing;
    for (int b = 0; b < BLOCKS; b++) {
        arrays_t at;
        lanes_t nu_dot[3];
        const point_t point = point_at(s, wheels, b, &at);
        core_rates(wheels, &point, nu_dot);
        keep_held_force(s, wheels, b, &at);
        for (int n = 0; n < s->core; n++)
            missing[n].lanes[b] = s->core_dot[n] - s->rate_core[n].lanes[b];
        for (int k = 0; k < 3; k++)
            missing[s->core + k].lanes[b] = nu_dot[k] - s->rate_nu[k].lanes[b];
    }
    s->sweeps++;
    (void)slow;
}

/* One sweep of Newton's rule; returns the largest change of the state at a node in the measure of nu, beyond rounding. */
NEVER_INLINE double coupled_sweep(step_t *s, const int wheels, int renew)
{
    const coupled_t *const c = s->coupled;
    lanes_t change = lanes_of(0);
    states_at_nodes(s, wheels);
    find_missing(s, wheels, renew);
    if (renew && s->renewals <= MAX_RENEWALS) {
        if (!s->fresh)
            find_slopes(s, wheels, MIDDLE);
        eliminate_coupled(c, s->h);
        s->fresh = 0;
        s->renewals++;
    }
    if (SET_HAS_CONTACT_SPEEDS) {
        nodes_t factor[MAX_WHEELS];
        for (int b = 0; b < BLOCKS; b++) {
            lanes_t chi[MAX_WHEELS], reach[MAX_WHEELS];
            for (int i = 0; i < wheels; i++)
                chi[i] = lanes_clamp(s->at_chi[i].lanes[b], s->joint[i]);
            reaches(s, wheels, chi, reach);
            for (int i = 0; i < wheels; i++)
                factor[i].lanes[b] = reach[i]/c->reach[i];
        }
        stretch(s, wheels, factor);
        solve_coupled(c, s->h, s->core);
        stretch(s, wheels, factor);
    } else
        solve_coupled(c, s->h, s->core);
    for (int n = 0; n < s->core + 3; n++) {
        nodes_t moved, *const rate = n < s->core ? &s->rate_core[n] : &s->rate_nu[n - s->core];
        const double weight = n < s->core ? s->weight[n] : 1;
        integrate_to_nodes(0, s->h, &c->missing[n], &moved);
        for (int b = 0; b < BLOCKS; b++) {
            const lanes_t size = weight*lanes_abs(moved.lanes[b]);
            change = lanes_max(change, size);
            rate->lanes[b] += c->missing[n].lanes[b];
        }
    }
    const double largest = lanes_largest(change);
    return largest <= SPEED_ROUNDING*EPS*s->size ? 0 : largest;
}

/* What the polynomials miss inside the step: the last coefficients over the time between two nodes, in which what decays
 * fast decays. */
static double coupled_missed(const step_t *s)
{
    const coupled_t *const c = s->coupled;
    const int size = c->size, others = size - 3;
    const double time = s->h/(2*NODES);
    double *const rates = c->small + size*size, of_nu = 0, of_core = 0;
    for (int last = 0; last < 2; last++) {
        for (int j = 0; j < size; j++)
            rates[j] = weighted(j < others ? &s->rate_core[j] : &s->rate_nu[j - others], &gauss_last[last]);
        after(c, time, rates);
        for (int k = 0; k < 3; k++)
            of_nu += fabs(rates[others + k]);
        for (int j = 0; j < others; j++)
            of_core = fmax(of_core, 2*s->weight[j]*fabs(rates[j]));
    }
    for (int n = others; n < s->core; n++)
        of_core = fmax(of_core, s->weight[n]*tail(&s->rate_core[n])/(1 + time*fabs(c->diagonal[n])));
    return time*(of_nu + of_core);
}

/* A sum of how much rates would move the speeds, in the measure of nu. */
static double moved_by_rates(const step_t *s, const double *rates)
{
    const int size = s->coupled->size, others = size - 3;
    double of_nu = 0, of_core = 0;
    for (int k = 0; k < 3; k++)
        of_nu += fabs(rates[others + k]);
    for (int j = 0; j < others; j++)
        of_core = fmax(of_core, s->weight[j]*fabs(rates[j]));
    return of_nu + of_core;
}

/* What the polynomials miss before the first node, where a slip that begins leaves the small speed below which friction
 * fades: they come there with other rates than the step has at its start. What decays at once is none of it: slopes of
 * the nodes tell. */
static double missed_at_start(step_t *s, const int wheels, double allowed)
{
    const coupled_t *const c = s->coupled;
    const int size = c->size, others = size - 3;
    const double time = s->h*gauss_node.node[0];
    double *const rates = c->small + size*size;
    for (int j = 0; j < size; j++)
        rates[j] = weighted(j < others ? &s->rate_core[j] : &s->rate_nu[j - others], &gauss_start) - c->start[j];
    if (!(time*moved_by_rates(s, rates) > allowed))
        return 0;
    find_slopes(s, wheels, MIDDLE);
    for (int j = 0; j < size; j++)
        rates[j] = weighted(j < others ? &s->rate_core[j] : &s->rate_nu[j - others], &gauss_start) - c->start[j];
    after(c, time, rates);
    return time*moved_by_rates(s, rates);
}
