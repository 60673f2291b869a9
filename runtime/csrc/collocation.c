/* Collocation: a step covers [t, t + h] with the 16 nodes of Gauss.
 *
 * The rates of the core at the nodes are a polynomial, and the core its integral, of order 32 at the end of the step.
 * Picard's iteration finds them, all nodes at once in the lanes of the generated kernel. The followers are integrals of
 * the core's; the accounts are evaluated once, when the core has settled. Where wheels may slip, the nodes are those of
 * Radau, of order 31, and coupled.c finds the rates.
 *
 * The file knows no mechanics and no effect by name: engine_set.h says what there is, and calls the generated
 * kernel. What a set does not have is not compiled. */
#if SET_IS_COUPLED
#include "radau.h"                  /* slip decays far faster than the vehicle moves */
#else
#include "gauss.h"
#endif
#include "engine.h"

#include <math.h>

#define BLOCKS (NODES/LANES)
#define TURN 6.283185307179586
#define DIFFERENCE 1e-9             /* of the size of a state, for slopes                                   */
#define FORCE_NOISE 64              /* roundings that the polynomials of a held force may have               */
#define FINE_DIFFERENCE 1e-11       /* the same of nu, which turns wheels that a small named speed holds         */
#define MOST_UNKNOWNS (3*NODES)     /* nu' at the nodes                                                     */
#define GRIP_ROUNDINGS 64           /* of what a contact that sticks takes, which is what is left of other forces */
#define GRIP_NOISE(taken) (GRIP_ROUNDINGS*EPS*(2 + (taken)))
#ifdef SET_HAS_CONTACT_SPEEDS
#define SET_FIRST_DIRECTION 0       /* in which contacts may slip: along the axle, along the rolling direction */
#else
#define SET_FIRST_DIRECTION 1
#endif

/* Newton's rule for some rates at all nodes: change = missing + slope h (integral of the change). The matrix of this
 * system, eliminated (L below the diagonal, 1/U on it): rows in the order of their pivots, each `count` tables of nodes. */
typedef struct {
    nodes_t rows[MOST_UNKNOWNS*MOST_UNKNOWNS/NODES], *row[MOST_UNKNOWNS];
} newton_t;

#if SET_IS_COUPLED
/* How the speeds that are coupled are solved for: those of the core that stand first, then nu. Rows of matrices are those
 * of the rates. */
typedef struct {
    int size;                                   /* how many speeds                                */
    double *slope;                              /* size x size, of the rates in the speeds        */
    double *own;                                /* slopes of the other numbers of the core, each in itself */
    double *small;                              /* size x (size + 1), scratch                     */
    unsigned char *filled;                      /* size x size: what is not zero when eliminated  */
    ways_t *real, *imaginary;                   /* size x size, eliminated                        */
    ways_t *found_real, *found_imaginary;       /* size                                           */
    nodes_t *missing;                           /* of all rates: of the core, then of nu          */
    double *reach;                              /* of each wheel where the slopes are from, of its roller's axial speed */
} coupled_t;
#endif

#if SET_SPINS_STICK
/* Free rollers that stick or turn in their bearings, N (n-1) of each; in the core their spins stand together. */
typedef struct {
    lanes_t *sticks, *torque;                   /* 1 or 0; the torque of one that turns, else 0  */
    lanes_t *holding;                           /* out: what holds                               */
    nodes_t *held;                              /* that at the nodes                             */
    double *late;                               /* what its polynomials lack at the step's end   */
} spins_t;

ALWAYS_INLINE void put_spins(const spins_t *spins, point_t *point)
{
    point->free_sticks = spins->sticks, point->free_bearing = spins->torque, point->free_holding = spins->holding;
}
#endif

/* What a step works on. */
typedef struct {
    int wheels;
    const vehicle_t *vehicle;
    const lanes_t *momenta;
    double joint;
    double nu[3], chi[MOST_WHEELS];             /* where the step starts                         */
    double edge[MOST_WHEELS];                   /* the |chi| that ends the step: the joint, or little more for a
                                                 * wheel that rests there and turns back         */
    double h;
    nodes_t rate_nu[3], at_nu[3];               /* nu', the unknowns, and nu at the nodes        */
    nodes_t rate_chi[MOST_WHEELS], at_chi[MOST_WHEELS];
    nodes_t rate_pose[3];
    double end_nu[3], end_chi[MOST_WHEELS], end_rate[MOST_WHEELS], way[3];  /* way: of the pose, in the step */
    int landing;                                /* the wheel whose joint ends the step, or -1; wheels + k: guard k */
    double late;                                /* the event comes this much later than h        */
    long long sweeps;
#if SET_HAS_HEADING
    double heading;                             /* at the start                                  */
    nodes_t at_heading;
#endif
#if SET_INPUTS
    double input[SET_INPUTS*MOST_WHEELS], input_slope[SET_INPUTS*MOST_WHEELS];
#endif
#if SET_CORE_PARTS
    int core;                                   /* how many numbers it has beside nu             */
    const double *start_core;
    double *end_core, *weight;                  /* weight: size of nu over that of each number   */
    nodes_t *rate_core, *at_core;
    lanes_t *core_here, *core_dot, *core_slope, *core_chord;    /* scratch                       */
    nodes_t *found_core, *slope_core, *core_in_nu;          /* scratch of stiff sweeps           */
#endif
#if SET_SLIPS
    const double *guard_rows;                   /* of the run                                    */
#endif
#if SET_IS_COUPLED
    const coupled_t *coupled;
    int fresh, renewals;                        /* no sweep yet; of its slopes, in this try      */
#endif
#if SET_GRIPS
    int slides[MOST_WHEELS], grips[MOST_WHEELS];    /* contacts that slip, and that stick; neither is off   */
    int sliding, turning, gripping;             /* whether there are such, with directions, and such as stick */
    int blind;                                  /* all stick, and no sweep asks yet with how much friction */
    int keeps[MOST_WHEELS], strays;             /* slips that keep their direction up to rest; one has not      */
    double left_over[MOST_WHEELS];              /* of a slip across its direction, in m/s, that is nothing    */
    double rest_in;                             /* the time until the first other slip comes to rest         */
    const lanes_t *load, *friction;
    const double *response;                     /* of the rates of slips to forces, 2N x 2N      */
    nodes_t toward[2*MOST_WHEELS];              /* directions of the slips at the nodes           */
    nodes_t push[2*MOST_WHEELS], turned[2*MOST_WHEELS];     /* their forces, and the slopes of these in a turn */
    nodes_t own_response[4*MOST_WHEELS];        /* of a contact's slip to forces on it, 2 x 2, at the nodes */
    int knows_response[MOST_WHEELS];            /* whether it has been found in this try          */
    double turned_most;                         /* in the last sweep: the largest turn of a direction   */
    nodes_t at_slip[2*MOST_WHEELS], slip_rate[2*MOST_WHEELS], taken[MOST_WHEELS];
    double per_reach[2*MOST_WHEELS];            /* over what contacts that stick can take         */
#if SET_LOADS
    double per_load[MOST_WHEELS];               /* over the load of that                          */
#endif
    double slip_start[2*MOST_WHEELS], taken_start[MOST_WHEELS], taken_late[MOST_WHEELS];
    double slip_noise[MOST_WHEELS], settles, friction_makes, friction_force;
    double end_slip[2*MOST_WHEELS];
#endif
#if SET_LOADS
    const balance_t *balance;
    loads_t *loads_at, *loads_at_end, *loads_aside;     /* in each vector of nodes; at the end; scratch      */
    int carries[MOST_WHEELS];
    double weight_carried;                      /* the whole load                                */
    nodes_t compressed[MOST_WHEELS + 1];        /* of contacts, over the weight, and the determinant */
    double compressed_start[MOST_WHEELS + 1], compressed_late[MOST_WHEELS + 1];
#endif
#if SET_ACCOUNTS
    nodes_t rate_account[MOST_ACCOUNTS];
#endif
#if SET_HOLDS
    int held, facets;                           /* bearings that stick; the facets of what they can take */
    const facet_t *facet;
    const bearings_t *sticking;                 /* those whose rates follow from nu                */
    double turns[MOST_WHEELS];                  /* 0 of a wheel whose axle sticks, else 1        */
    lanes_t directions[9], absent[3];           /* of nu                                         */
    nodes_t force[3];                           /* that holds, at the nodes                      */
    double force_start[3], force_size[3], per_force[3];
    double force_late[3];                       /* what its polynomials lack at the step's end   */
#endif
#if SET_ROLLERS_STICK
    int first_contact;                          /* place among `sticking` where rollers in contact begin */
    int contact_wheel[MOST_WHEELS];             /* the wheels of these                           */
    const omniroll_bearing_t *contact;          /* the bearings of all rollers in contact        */
    double nearer_start[MOST_BEARINGS], nearer_end[MOST_BEARINGS], nearer_rate[MOST_BEARINGS];
#endif
#if SET_SPINS_STICK
    int spin_count;
    const omniroll_bearing_t *spin;             /* bearings of the free rollers                  */
    const spins_t *spins;
#endif
#if SET_IS_ACTED_ON
    double size;                                /* of nu                                         */
    int stiff;                                  /* whether the core is solved for implicitly     */
    int stiff_sweeps;                           /* how many such sweeps this try has had         */
    int nu_is_stiff;                            /* whether slopes of nu' in nu are needed for it */
    int by_newton;                              /* it has been in the last try                   */
    int by_axles;                               /* whether axles' friction alone makes its slopes */
    double steepest;                            /* the largest h times slope in the last stiff sweep */
    nodes_t found_nu[3], slope_nu[9];           /* scratch of stiff sweeps                       */
    newton_t newton;                            /* of nu', where it is stiff                     */
    double rest;                                /* what further sweeps would change              */
    double bend_in;                             /* the time until a wheel comes to where rates bend */
    int guards;
    double guard_start[MOST_GUARDS], guard_noise[MOST_GUARDS], guard_slope[MOST_GUARDS];
    double guard_weights[3*MOST_GUARDS];        /* of nu                                         */
#endif
} step_t;

/* Sums over the nodes. */

/* The product of a square table, given by columns, with the values at the nodes. */
ALWAYS_INLINE nodes_t times(const nodes_t *table, const nodes_t *values)
{
    nodes_t sum;
    IN_REGISTERS
    for (int b = 0; b < BLOCKS; b++) {
        lanes_t of_block = values->node[0]*table[0].lanes[b];
        IN_REGISTERS
        for (int m = 1; m < NODES; m++)
            of_block += values->node[m]*table[m].lanes[b];
        sum.lanes[b] = of_block;
    }
    return sum;
}

/* start + h times the integral of the rates from the start to each node. */
ALWAYS_INLINE void integrate_to_nodes(double start, double h, const nodes_t *rate, nodes_t *at)
{
    const nodes_t sum = times(gauss_integral, rate);
    for (int b = 0; b < BLOCKS; b++)
        at->lanes[b] = start + h*sum.lanes[b];
}

/* Of all nodes, halves upon halves: in the same order whatever the number of lanes. */
ALWAYS_INLINE double total(lanes_t *blocks)
{
    IN_REGISTERS
    for (int half = BLOCKS/2; half > 0; half /= 2) {
        IN_REGISTERS
        for (int b = 0; b < half; b++)
            blocks[b] += blocks[b + half];
    }
    lanes_t sum = blocks[0];
    IN_REGISTERS
    for (int half = LANES/2; half > 0; half /= 2) {
        IN_REGISTERS
        for (int k = 0; k < half; k++)
            sum[k] += sum[k + half];
    }
    return sum[0];
}

ALWAYS_INLINE double weighted(const nodes_t *rate, const nodes_t *weights)
{
    lanes_t sum[BLOCKS];
    IN_REGISTERS
    for (int b = 0; b < BLOCKS; b++)
        sum[b] = rate->lanes[b]*weights->lanes[b];
    return total(sum);
}

/* Size of the last two Legendre coefficients: what the polynomial may have missed. */
ALWAYS_INLINE double tail(const nodes_t *rate)
{
    return fabs(weighted(rate, &gauss_last[0])) + fabs(weighted(rate, &gauss_last[1]));
}

/* The largest size at the nodes; not a number if one of them is not. */
ALWAYS_INLINE double largest_of(const nodes_t *values)
{
    lanes_t largest = lanes_abs(values->lanes[0]);
    IN_REGISTERS
    for (int b = 1; b < BLOCKS; b++) {
        const lanes_t size = lanes_abs(values->lanes[b]);
        largest = lanes_select(size <= largest, largest, size);
    }
    return lanes_largest(largest);
}

/* The distance between the smallest and the largest of the values at the nodes and of two numbers beside them. */
ALWAYS_INLINE double extent_of(const nodes_t *values, double start, double end)
{
    lanes_t low = lanes_of(fmin(start, end)), high = lanes_of(fmax(start, end));
    for (int b = 0; b < BLOCKS; b++) {
        low = lanes_select(values->lanes[b] < low, values->lanes[b], low);
        high = lanes_select(values->lanes[b] > high, values->lanes[b], high);
    }
    double least = low[0], most = high[0];
    for (int k = 1; k < LANES; k++) {
        least = low[k] < least ? low[k] : least;
        most = high[k] > most ? high[k] : most;
    }
    return most - least;
}

/* Whether the values at the nodes and two numbers beside them have one sign; zero may have either. */
ALWAYS_INLINE int has_one_sign(const nodes_t *values, double start, double end)
{
    lane_mask_t every = (lane_mask_t)values->lanes[0], any = every;
    IN_REGISTERS
    for (int b = 1; b < BLOCKS; b++) {
        every &= (lane_mask_t)values->lanes[b];
        any |= (lane_mask_t)values->lanes[b];
    }
    long long all = every[0], some = any[0];
    for (int k = 1; k < LANES; k++)
        all &= every[k], some |= any[k];
    return start > 0 || end > 0 ? start >= 0 && end >= 0 && some >= 0 : all < 0;
}

ALWAYS_INLINE double largest3(const double *v)
{
    return fmax(fabs(v[0]), fmax(fabs(v[1]), fabs(v[2])));
}

/* Whether a wheel turns, 1 or 0. Where its axle sticks, its rate is rounding alone, which would add up in its angle. */
ALWAYS_INLINE double turns(const step_t *s, int wheel)
{
#if SET_HOLDS
    return s->turns[wheel];
#else
    (void)s, (void)wheel;
    return 1;
#endif
}

#if SET_GRIPS
NEVER_INLINE void stick_at_nodes(step_t *s, const int wheels, int b);
static void find_directions(step_t *s, const int wheels);
#endif
#if SET_GRIPS && defined SET_HAS_CONTACT_SPEEDS
NEVER_INLINE void rollers_stick_at_nodes(step_t *s, const int wheels, int b);
#endif

#if SET_CORE_PARTS
/* Whether a number of the core is a speed of a contact that sticks: it is not integrated. */
ALWAYS_INLINE int follows_nu(const step_t *s, const int wheels, int c)
{
#if SET_GRIPS
    return c < coupled_size(wheels) && s->grips[c%wheels];
#else
    (void)s, (void)wheels, (void)c;
    return 0;
#endif
}
#endif

/* nu and chi, and what else the rates need, at the nodes from the rates. */
ALWAYS_INLINE void states_at_nodes(step_t *s, const int wheels)
{
    for (int k = 0; k < 3; k++)
        integrate_to_nodes(s->nu[k], s->h, &s->rate_nu[k], &s->at_nu[k]);
#if SET_CORE_PARTS
    for (int c = 0; c < s->core; c++)
        if (!follows_nu(s, wheels, c))
            integrate_to_nodes(s->start_core[c], s->h, &s->rate_core[c], &s->at_core[c]);
#endif
    for (int b = 0; b < BLOCKS; b++) {
        const lanes_t nu[3] = {s->at_nu[0].lanes[b], s->at_nu[1].lanes[b], s->at_nu[2].lanes[b]};
#if SET_GRIPS
        stick_at_nodes(s, wheels, b);
#endif
#if SET_SLIPS
        for (int i = 0; i < wheels; i++)
            s->rate_chi[i].lanes[b] = s->at_core[rates_at(wheels) + i].lanes[b];
#else
        lanes_t chi_dot[MOST_WHEELS];
        set_wheel_speeds(wheels, s->vehicle, nu, chi_dot);
        for (int i = 0; i < wheels; i++)
            s->rate_chi[i].lanes[b] = chi_dot[i]*turns(s, i);
#endif
        (void)nu;
#if SET_HAS_HEADING
        lanes_t pose_dot[3];
        set_pose_rates(wheels, s->vehicle, nu, lanes_of(0), pose_dot);
        s->rate_pose[2].lanes[b] = pose_dot[2];
#endif
    }
    for (int i = 0; i < wheels; i++)
        integrate_to_nodes(s->chi[i], s->h, &s->rate_chi[i], &s->at_chi[i]);
#if SET_GRIPS && defined SET_HAS_CONTACT_SPEEDS
    for (int b = 0; b < BLOCKS && s->gripping && !(s->blind && s->core == coupled_size(wheels)); b++)
        rollers_stick_at_nodes(s, wheels, b);
#endif
#if SET_HAS_HEADING
    integrate_to_nodes(s->heading, s->h, &s->rate_pose[2], &s->at_heading);
#endif
}

/* The arrays of a point. */
typedef struct {
    lanes_t nu[3], chi[MOST_WHEELS];
#if SET_INPUTS
    lanes_t input[SET_INPUTS*MOST_WHEELS];
#endif
#if SET_HOLDS
    lanes_t held_force[3];
#endif
#if SET_GRIPS
    lanes_t ground_push[2*MOST_WHEELS], ground_force[2*MOST_WHEELS], slip_dot[2*MOST_WHEELS];
#endif
} arrays_t;

#if SET_GRIPS
ALWAYS_INLINE void keep_contacts(step_t *s, const int wheels, int b, const arrays_t *at);

ALWAYS_INLINE void put_contacts(arrays_t *at, point_t *point)
{
    point->ground_push = at->ground_push, point->ground_force = at->ground_force, point->slip_dot = at->slip_dot;
}
#endif
#if SET_LOADS
ALWAYS_INLINE void keep_loads(step_t *s, const int wheels, int b);
#endif

/* The state and the inputs in one vector of nodes. An iterate may stray beyond the joint, where the kernel is not
 * asked. */
ALWAYS_INLINE point_t point_at(const step_t *s, const int wheels, int b, arrays_t *at)
{
    point_t point = {.vehicle = s->vehicle, .nu = at->nu, .chi = at->chi, .momenta = s->momenta};
    for (int k = 0; k < 3; k++)
        at->nu[k] = s->at_nu[k].lanes[b];
    for (int i = 0; i < wheels; i++)
        at->chi[i] = lanes_clamp(s->at_chi[i].lanes[b], s->joint);
#if SET_HAS_HEADING
    point.heading = s->at_heading.lanes[b];
#endif
#if SET_INPUTS
    for (int k = 0; k < SET_INPUTS*wheels; k++)
        at->input[k] = s->input[k] + (s->h*s->input_slope[k])*gauss_node.lanes[b];
    point.inputs = at->input;
#endif
#if SET_CORE_PARTS
    for (int c = 0; c < s->core; c++)
        s->core_here[c] = s->at_core[c].lanes[b];
    point.core = s->core_here;
    point.core_dot = s->core_dot;
#endif
#if SET_HOLDS
    point.directions = s->held ? s->directions : 0;
    point.absent = s->absent;
    point.held_force = at->held_force;
#endif
#if SET_SPINS_STICK
    put_spins(s->spins, &point);
#endif
#if SET_GRIPS
    for (int k = 0; k < 2*wheels; k++)
        at->ground_push[k] = s->push[k].lanes[b];
    put_contacts(at, &point);
#endif
#if SET_LOADS
    point.balance = s->balance, point.loads = s->loads_at + b;
#endif
    return point;
}

#if SET_LOADS
/* Whether the response of the rates to the loads is found anew in the next evaluations at the nodes, as where the
 * iteration is slow; returns how many evaluations more that takes at each node. */
ALWAYS_INLINE int respond_anew(step_t *s, int slow)
{
    for (int b = 0; b < BLOCKS && slow; b++)
        s->loads_at[b].knows_response = 0;
    return s->loads_at[0].responds && !s->loads_at[0].knows_response ? LOADS_RESPOND - 1 : 0;
}
#endif

/* The force that holds what sticks, from the last evaluation at a vector of nodes. */
ALWAYS_INLINE void keep_held_force(step_t *s, const int wheels, int b, const arrays_t *at)
{
#if SET_LOADS
    keep_loads(s, wheels, b);
#endif
#if SET_GRIPS
    keep_contacts(s, wheels, b, at);
#endif
#if SET_HOLDS
    for (int k = 0; s->held && k < 3; k++)
        s->force[k].lanes[b] = at->held_force[k];
#endif
#if SET_SPINS_STICK
    for (int k = 0; s->held && k < s->spin_count; k++)
        s->spins->held[k].lanes[b] = s->spins->holding[k];
#endif
    (void)s, (void)wheels, (void)b, (void)at;
}

#if SET_IS_ACTED_ON
/* A slope is stiff where h times its size is large: Picard's iteration contracts by about this factor. */
#define STIFF 0.05                              /* above this the slope gets a linear system                   */
#define NOT_STIFF 0.5                           /* where all are below this, Picard's iteration takes over again */
#define CHORDS 1                                /* first stiff sweeps, which take chords in the place of tangents */
#define PATIENCE 4                              /* stiff sweeps without slopes of nu', where the core's may do */

/* slope has count x count tables, by rows. */
ALWAYS_INLINE void newton_matrix(newton_t *newton, const nodes_t *slope, const int count, double h)
{
    for (int m = 0; m < NODES; m++) {
        nodes_t integral;                       /* to node m, from the values at the nodes               */
        for (int j = 0; j < NODES; j++)
            integral.node[j] = gauss_integral[j].node[m];
        for (int k = 0; k < count; k++) {
            nodes_t *const row = newton->row[k*NODES + m] = newton->rows + (k*NODES + m)*count;
            for (int l = 0; l < count; l++)
                for (int b = 0; b < BLOCKS; b++)
                    row[l].lanes[b] = (-h*slope[k*count + l].node[m])*integral.lanes[b];
            row[k].node[m] += 1;
        }
    }
}

/* Gauss's elimination with the largest pivots. */
ALWAYS_INLINE void eliminate(newton_t *newton, const int count)
{
    nodes_t **const row = newton->row;
    for (int k = 0; k < count*NODES; k++) {
        const int first = k/NODES, here = k%NODES;
        int pivot = k;
        for (int m = k + 1; m < count*NODES; m++)
            if (fabs(row[m][first].node[here]) > fabs(row[pivot][first].node[here]))
                pivot = m;
        nodes_t *const kept = row[k];
        row[k] = row[pivot], row[pivot] = kept;
        nodes_t beyond[3];                      /* the pivot's row right of it, 0 elsewhere               */
        for (int l = first; l < count; l++)
            beyond[l] = row[k][l];
        for (int j = 0; j <= here; j++)
            beyond[first].node[j] = 0;
        const double inverse = row[k][first].node[here] = 1/row[k][first].node[here];
        for (int m = k + 1; m < count*NODES; m++) {
            const double factor = row[m][first].node[here] *= inverse;
            for (int l = first; l < count; l++)
                for (int b = 0; b < BLOCKS; b++)
                    row[m][l].lanes[b] -= factor*beyond[l].lanes[b];
        }
    }
}

/* The change that the eliminated matrix gives, in the place of what is missing. Sums go over whole rows: what is still to
 * be found counts as 0. */
ALWAYS_INLINE void solve_newton(const newton_t *newton, const int count, nodes_t *missing)
{
    nodes_t lower[3] = {{{lanes_of(0)}}}, found[3] = {{{lanes_of(0)}}};
    for (int k = 0; k < count*NODES; k++) {
        const int place = (int)(newton->row[k] - newton->rows)/count;
        double rest = missing[place/NODES].node[place%NODES];
        for (int l = 0; l < count; l++)
            rest -= weighted(&newton->row[k][l], &lower[l]);
        lower[k/NODES].node[k%NODES] = rest;
    }
    for (int k = count*NODES - 1; k >= 0; k--) {
        double rest = lower[k/NODES].node[k%NODES];
        for (int l = 0; l < count; l++)
            rest -= weighted(&newton->row[k][l], &found[l]);
        found[k/NODES].node[k%NODES] = rest*newton->row[k][k/NODES].node[k%NODES];
    }
    for (int k = 0; k < count; k++)
        missing[k] = found[k];
}

/* h times the largest slope. */
static double steepness(const nodes_t *slope, int count, double h)
{
    double steep = 0;
    for (int k = 0; k < count; k++)
        for (int m = 0; m < NODES; m++)
            steep = fmax(steep, h*fabs(slope[k].node[m]));
    return steep;
}

#define CORE_FOLLOWS (SET_CORE_PARTS && !SET_HAS_SLOPES)    /* whether it may follow nu at once              */

#if CORE_FOLLOWS
/* How far a number of the core follows a change of nu_l by 1 that lasts: at once where its own slope is steep. */
ALWAYS_INLINE lanes_t followed(const step_t *s, int c, int l, int b)
{
    const double time = s->h/2;
    return time*s->core_in_nu[3*c + l].lanes[b]/(1 - time*s->slope_core[c].lanes[b]);
}
#endif

/* The slopes of nu' in nu at a point in vector b of the nodes, by differences. */
ALWAYS_INLINE void slopes_of_nu(step_t *s, const int wheels, int b, const point_t *point, arrays_t *at)
{
    for (int l = 0; l < 3; l++) {
        const lanes_t here = at->nu[l];
        lanes_t nu_dot[3];
        at->nu[l] = here + FINE_DIFFERENCE*s->size;
#if CORE_FOLLOWS
        for (int c = 0; c < s->core; c++)
            s->core_here[c] += (at->nu[l] - here)*followed(s, c, l, b);
#endif
        core_rates(wheels, point, nu_dot);
        for (int k = 0; k < 3; k++)
            s->slope_nu[3*k + l].lanes[b] = (nu_dot[k] - s->found_nu[k].lanes[b])/(at->nu[l] - here);
        at->nu[l] = here;
#if CORE_FOLLOWS
        for (int c = 0; c < s->core; c++)
            s->core_here[c] = s->at_core[c].lanes[b];
#endif
    }
}

#include "axle_slopes.c"

#if SET_HAS_SLOPES
/* The slopes of the rest of the core's rates at a point in vector b of the nodes, each number's in itself. Friction with
 * a small named speed is steep only next to rest: from elsewhere a tangent leads far to the other side, and a chord from
 * rest does not. */
ALWAYS_INLINE void slopes_of_core(step_t *s, const int wheels, int b, const point_t *point)
{
    core_slopes(wheels, point, s->core_slope, s->core_chord);
    for (int c = 0; c < s->core; c++)
        s->slope_core[c].lanes[b] = s->stiff_sweeps < CHORDS ? s->core_chord[c] : s->core_slope[c];
}
#elif SET_CORE_PARTS
/* The slopes of the rest of the core's rates, by differences, at a point in vector b of the nodes: each number's in itself,
 * its parts one after the other, and, if asked for, in nu. */
ALWAYS_INLINE void slopes_of_core(step_t *s, const int wheels, int b, const point_t *point, arrays_t *at, int in_nu)
{
    lanes_t nu_dot[3];
    int first = 0;
    for (int part = 0; part < SET_CORE_PARTS; part++) {
        const int end = core_part_end(wheels, s->vehicle->rollers_per_wheel, part);
        for (int c = first; c < end; c++) {
            const lanes_t here = s->core_here[c];
            s->core_here[c] = here + (s->weight[c] > 0 ? DIFFERENCE*s->size/s->weight[c] : DIFFERENCE);
            s->core_slope[c] = s->core_here[c] - here;
        }
        core_rates(wheels, point, nu_dot);
        for (int c = first; c < end; c++) {
            s->core_here[c] -= s->core_slope[c];
            s->slope_core[c].lanes[b] = (s->core_dot[c] - s->found_core[c].lanes[b])/s->core_slope[c];
        }
        first = end;
    }
    for (int l = 0; l < 3 && in_nu; l++) {
        const lanes_t here = at->nu[l];
        at->nu[l] = here + FINE_DIFFERENCE*s->size;
        core_rates(wheels, point, nu_dot);
        for (int c = 0; c < s->core; c++)
            s->core_in_nu[3*c + l].lanes[b] = (s->core_dot[c] - s->found_core[c].lanes[b])/(at->nu[l] - here);
        at->nu[l] = here;
    }
}
#endif

/* The rates of the core at a point in vector b of the nodes. */
ALWAYS_INLINE void find_rates(step_t *s, const int wheels, int b, const point_t *point, const arrays_t *at)
{
    lanes_t nu_dot[3];
    core_rates(wheels, point, nu_dot);
    for (int k = 0; k < 3; k++)
        s->found_nu[k].lanes[b] = nu_dot[k];
#if SET_CORE_PARTS
    for (int c = 0; c < s->core; c++)
        s->found_core[c].lanes[b] = s->core_dot[c];
#endif
    keep_held_force(s, wheels, b, at);
}

/* Add what is missing of a rate; returns the largest change so far, in the measure of nu. */
ALWAYS_INLINE lanes_t corrected(nodes_t *rate, const nodes_t *missing, double weight, lanes_t change)
{
    for (int b = 0; b < BLOCKS; b++) {
        const lanes_t moved = weight*lanes_abs(missing->lanes[b]);
        change = lanes_select(moved <= change, change, moved);
        rate->lanes[b] += missing->lanes[b];
    }
    return change;
}

#if SET_CORE_PARTS
/* Newton's rule for one number of the rest of the core, with its own slopes, for what is missing of its rate. */
ALWAYS_INLINE lanes_t correct_number(step_t *s, int c, nodes_t *missing, lanes_t change)
{
    newton_t newton;
    const double steep = steepness(&s->slope_core[c], 1, s->h);
    if (steep > STIFF) {
        newton_matrix(&newton, &s->slope_core[c], 1, s->h);
        eliminate(&newton, 1);
        solve_newton(&newton, 1, missing);
    }
    s->steepest = fmax(s->steepest, steep);
    return corrected(&s->rate_core[c], missing, s->weight[c], change);
}

/* The same for all numbers, whose rates have been found. */
ALWAYS_INLINE lanes_t correct_core(step_t *s, lanes_t change)
{
    for (int c = 0; c < s->core; c++) {
        nodes_t missing;
        for (int b = 0; b < BLOCKS; b++)
            missing.lanes[b] = s->found_core[c].lanes[b] - s->rate_core[c].lanes[b];
        change = correct_number(s, c, &missing, change);
    }
    return change;
}
#endif

#if CORE_FOLLOWS
/* The rest of the core goes along with the change of nu' that a sweep has made. */
ALWAYS_INLINE lanes_t follow_nu(step_t *s, const nodes_t *change_of_nu, lanes_t change)
{
    nodes_t moved[3];
    for (int l = 0; l < 3; l++)
        integrate_to_nodes(0, s->h, &change_of_nu[l], &moved[l]);
    for (int c = 0; c < s->core; c++) {
        nodes_t missing;
        for (int b = 0; b < BLOCKS; b++)
            missing.lanes[b] = s->core_in_nu[3*c].lanes[b]*moved[0].lanes[b]
                + s->core_in_nu[3*c + 1].lanes[b]*moved[1].lanes[b] + s->core_in_nu[3*c + 2].lanes[b]*moved[2].lanes[b];
        change = correct_number(s, c, &missing, change);
    }
    return change;
}
#endif

/* Newton's rule for nu'. renew: the slopes are new. missing: out, the change. */
ALWAYS_INLINE lanes_t correct_nu(step_t *s, int renew, nodes_t *missing, lanes_t change)
{
    for (int k = 0; k < 3; k++)
        for (int b = 0; b < BLOCKS; b++)
            missing[k].lanes[b] = s->found_nu[k].lanes[b] - s->rate_nu[k].lanes[b];
    const double steep = steepness(s->slope_nu, 9, s->h);
    s->steepest = fmax(s->steepest, steep);
    if (renew) {
        s->nu_is_stiff = steep > STIFF;
        newton_matrix(&s->newton, s->slope_nu, 3, s->h);
        eliminate(&s->newton, 3);
    }
    if (s->nu_is_stiff)
        solve_newton(&s->newton, 3, missing);
    for (int k = 0; k < 3; k++)
        change = corrected(&s->rate_nu[k], &missing[k], 1, change);
    return change;
}

/* A sweep by Newton's rule, since Picard's iteration contracts slowly, or not at all, where a slope times h is not
 * small. nu' has all of its slopes in nu, which are found anew where the iteration is slow; each number of the rest of
 * the core has its own slope. Spins of rollers do next to nothing to one another, and are left to the iteration. Momenta
 * of wheels, which strong friction lets follow nu at once, are corrected first, and once more as nu changes. */
static double stiff_sweep(step_t *s, const int wheels, int slow)
{
    const int renew = slow && (!SET_HAS_SLOPES || s->nu_is_stiff || s->stiff_sweeps > PATIENCE);
    lanes_t change = lanes_of(0);
    nodes_t missing[3];
    s->steepest = 0;
    states_at_nodes(s, wheels);
#if AXLES
    axles_t axles = {.known = 0};
    const int by_axles = renew && s->by_axles;
    if (renew)
        find_axles(s, wheels, &axles);
#else
    const int by_axles = 0;
#endif
#if SET_GRIPS
    find_directions(s, wheels);
#endif
#if SET_LOADS
    s->sweeps += respond_anew(s, slow);
#endif
#if CORE_FOLLOWS
    for (int b = 0; b < BLOCKS; b++) {
        arrays_t at;
        const point_t point = point_at(s, wheels, b, &at);
        find_rates(s, wheels, b, &point, &at);
        slopes_of_core(s, wheels, b, &point, &at, renew);
    }
    change = correct_core(s, change);
    for (int c = 0; c < s->core; c++)
        integrate_to_nodes(s->start_core[c], s->h, &s->rate_core[c], &s->at_core[c]);
    s->sweeps += 1 + SET_CORE_PARTS + (renew ? 3 : 0);
#endif
    for (int b = 0; b < BLOCKS; b++) {
        arrays_t at;
        const point_t point = point_at(s, wheels, b, &at);
        find_rates(s, wheels, b, &point, &at);
#if AXLES
        if (by_axles)
            slopes_by_axles(s, wheels, b, &point, &at, &axles);
#endif
        if (renew && !by_axles)
            slopes_of_nu(s, wheels, b, &point, &at);
#if SET_HAS_SLOPES
        slopes_of_core(s, wheels, b, &point);
#endif
    }
#if AXLES
    if (renew && !by_axles)
        s->by_axles = axles_make_slopes(s, wheels, &axles);
#endif
    change = correct_nu(s, renew, missing, change);
#if CORE_FOLLOWS
    change = follow_nu(s, missing, change);
#elif SET_CORE_PARTS
    change = correct_core(s, change);
#endif
    s->sweeps += by_axles ? 2 : renew ? 4 : 1;
    s->stiff_sweeps++;
    return lanes_largest(change)*s->h;
}
#endif

#if SET_IS_COUPLED
NEVER_INLINE double coupled_sweep(step_t *s, const int wheels, int renew);
static double coupled_missed(const step_t *s);
#endif

/* New rates of the core at vector b of the nodes; returns the largest change so far, in the measure of nu. `first`: the
 * first number of the rest of the core that has been found. */
ALWAYS_INLINE lanes_t renew_rates(step_t *s, int b, const lanes_t *nu_dot, int first, lanes_t change)
{
    for (int k = 0; k < 3; k++) {
        const lanes_t moved = lanes_abs(nu_dot[k] - s->rate_nu[k].lanes[b]);
        change = lanes_select(moved <= change, change, moved);
        s->rate_nu[k].lanes[b] = nu_dot[k];
    }
#if SET_CORE_PARTS
    for (int c = first; c < s->core; c++) {
        const lanes_t moved = s->weight[c]*lanes_abs(s->core_dot[c] - s->rate_core[c].lanes[b]);
        change = lanes_select(moved <= change, change, moved);
        s->rate_core[c].lanes[b] = s->core_dot[c];
    }
#endif
    (void)first;
    return change;
}

#if SET_ROLLS
/* A sweep where all contacts stick: the vehicle rolls. */
NEVER_INLINE double rolling_sweep(step_t *s, const int wheels)
{
    lanes_t change = lanes_of(0);
    states_at_nodes(s, wheels);
    for (int b = 0; b < BLOCKS; b++) {
        arrays_t at;
        lanes_t nu_dot[3];
        const point_t point = point_at(s, wheels, b, &at);
        rolling_rates(wheels, &point, nu_dot);
        change = renew_rates(s, b, nu_dot, coupled_size(wheels), change);
    }
    s->sweeps++;
    return lanes_largest(change)*s->h;
}
#endif

/* One sweep of Picard's iteration; returns the largest change of h nu', or of the rest of the core in its measure.
 * slow: whether the sweeps before have not contracted fast. */
NEVER_INLINE double sweep(step_t *s, const int wheels, int slow)
{
    (void)slow;
#if SET_IS_COUPLED
    return coupled_sweep(s, wheels, slow);
#endif
#if SET_IS_ACTED_ON
    if (s->stiff)
        return stiff_sweep(s, wheels, slow);
#endif
#if SET_ROLLS
    if (s->blind)
        return rolling_sweep(s, wheels);
#endif
    lanes_t change = lanes_of(0);
    states_at_nodes(s, wheels);
#if SET_GRIPS
    find_directions(s, wheels);
#endif
#if SET_LOADS
    s->sweeps += respond_anew(s, slow);
#endif
    for (int b = 0; b < BLOCKS; b++) {
        arrays_t at;
        lanes_t nu_dot[3];
        const point_t point = point_at(s, wheels, b, &at);
        core_rates(wheels, &point, nu_dot);
        keep_held_force(s, wheels, b, &at);
        change = renew_rates(s, b, nu_dot, 0, change);
    }
    s->sweeps++;
    return lanes_largest(change)*s->h;
}

/* Ends of the step: chi and the wheels' rates there. */
ALWAYS_INLINE void end_of_step(step_t *s, const int wheels)
{
    for (int i = 0; i < wheels; i++) {
        s->end_chi[i] = s->chi[i] + s->h*weighted(&s->rate_chi[i], &gauss_weight);
        s->end_rate[i] = weighted(&s->rate_chi[i], &gauss_end);
    }
}

#if SET_CORE_PARTS
/* The first number of the core whose rate the last sweep has found. */
ALWAYS_INLINE int first_found(const step_t *s)
{
#if SET_GRIPS
    return s->blind ? coupled_size(s->wheels) : 0;
#else
    (void)s;
    return 0;
#endif
}
#endif

/* What the polynomials of the core's rates miss inside the step, in the measure of nu: the last coefficients,
 * integrated. */
ALWAYS_INLINE double missed(const step_t *s)
{
#if SET_IS_COUPLED
    return coupled_missed(s);
#endif
    double tails = tail(&s->rate_nu[0]) + tail(&s->rate_nu[1]) + tail(&s->rate_nu[2]);
#if SET_CORE_PARTS
    double largest = 0;
    for (int c = first_found(s); c < s->core; c++)
        largest = fmax(largest, s->weight[c]*tail(&s->rate_core[c]));
    tails += largest;
#endif
#if SET_HOLDS
    for (int k = 0; s->held && k < 3; k++) {    /* beyond its rounding, as the nu' that the force would give */
        const double missing = tail(&s->force[k]) - FORCE_NOISE*EPS*(fabs(s->force[k].node[0]) + s->force_size[k]);
        tails += s->per_force[k]*fmax(missing, 0);
    }
#endif
#if SET_GRIPS
    for (int i = 0; i < s->wheels && !s->blind; i++)    /* the same of contacts that stick                     */
        if (s->grips[i])
            tails += s->friction_makes*fmax(tail(&s->taken[i]) - FORCE_NOISE*GRIP_NOISE(s->taken[i].node[0]), 0);
#endif
    return s->h*tails/(2*NODES);
}

#if SET_IS_ACTED_ON
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

/* Where in the step, between two nodes, rates bend: friction with a small named speed changes its sign. left: a place
 * before it, right: one beyond; both 1 where nothing bends. */
typedef struct {
    double left, right;
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
        found.left = x[-1] + line - 2*error;
        found.right = fmin(x[0], x[-1] + line + 2*error);
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
#if SET_CORE_PARTS
    for (int c = 0; c < s->core; c++)
        if (s->weight[c]*tail(&s->rate_core[c]) > least)
            place = jump_of(&s->rate_core[c], place);
#endif
    if (place == NODES)
        return (bend_t){1, 1, -1};
    bend_t found = {gauss_node.node[place - 1], gauss_node.node[place], -1};
    for (int i = 0; i < wheels; i++)
        found = zero_between(s, i, place, found);
    return found;
}
#endif

/* The end of a step whose core has settled. A sweep leaves the state one sweep behind the rates; here it catches up. */
ALWAYS_INLINE void end_of_core(step_t *s)
{
    for (int k = 0; k < 3; k++)
        s->end_nu[k] = s->nu[k] + s->h*weighted(&s->rate_nu[k], &gauss_weight);
#if SET_CORE_PARTS
    for (int c = 0; c < s->core; c++)
        s->end_core[c] = s->start_core[c] + s->h*weighted(&s->rate_core[c], &gauss_weight);
#endif
}

#if SET_ACCOUNTS
/* The rates of the accounts, once the core has settled. */
ALWAYS_INLINE void accounts_at_nodes(step_t *s, const int wheels)
{
    for (int b = 0; b < BLOCKS; b++) {
        arrays_t at;
        lanes_t account_dot[MOST_ACCOUNTS];
        const point_t point = point_at(s, wheels, b, &at);
        account_rates(wheels, &point, account_dot);
        for (int k = 0; k < account_size(wheels); k++)
            s->rate_account[k].lanes[b] = account_dot[k];
    }
}
#endif

/* The value at x in [0, 1] of a polynomial given at the nodes, and its integral from 0. */
ALWAYS_INLINE void legendre_value(const nodes_t *rate, double x, double *value, double *integral)
{
    const double z = 2*x - 1;
    const nodes_t coefficients = times(gauss_legendre, rate);
    double before = 1, p = z;       /* P_(k-1), P_k */
    double sum = 0, area = 0;
    for (int k = 0; k < NODES; k++) {
        const double c = coefficients.node[k];
        if (k == 0) {
            sum += c;
            area += c*x;
            continue;
        }
        const double after = ((2*k + 1)*z*p - k*before)/(k + 1);
        sum += c*p;
        area += c*(after - before)/(2*(2*k + 1));
        before = p;
        p = after;
    }
    *value = sum;
    *integral = area;
}

/* x, y and theta at the end of the step: integrals that feed nothing back. The kernel's rates are those at the
 * heading 0, turned here: a heading may be any angle. */
static void integrate_pose(step_t *s, const double *pose)
{
    nodes_t theta;
    for (int b = 0; b < BLOCKS; b++) {
        const lanes_t nu[3] = {s->at_nu[0].lanes[b], s->at_nu[1].lanes[b], s->at_nu[2].lanes[b]};
        lanes_t rate[3];
        set_pose_rates(s->wheels, s->vehicle, nu, lanes_of(0), rate);
        for (int k = 0; k < 3; k++)
            s->rate_pose[k].lanes[b] = rate[k];
    }
    integrate_to_nodes(remainder(pose[2], TURN), s->h, &s->rate_pose[2], &theta);
    for (int b = 0; b < BLOCKS; b++)
        lanes_turn(theta.lanes[b], &s->rate_pose[0].lanes[b], &s->rate_pose[1].lanes[b]);
    for (int k = 0; k < 3; k++)
        s->way[k] = s->h*weighted(&s->rate_pose[k], &gauss_weight);
}
