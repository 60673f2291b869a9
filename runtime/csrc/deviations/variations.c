/* How deviations grow along a step of a run: the variational equations, solved by collocation at its nodes.
 *
 * Where y' = f(y, u, p) and y(t) is known, a deviation follows d' = f_y d + f_u du + f_p dp. The core c has to be
 * solved for. What it carries and what feeds back, g (the wheels' angles, the heading), has rates that are linear in
 * the core, with constants: g' = W c + G. That is by nu alone, and where wheels may slip by their rates as well. With
 * the rates r of the core at the nodes, T the integral up to each node and h the length,
 *
 *     c = c0 + h T r,  g = g0 + h x W c0 + h^2 W T^2 r + h T G,  r = f_c c + f_g g + f_u du + f_p dp:
 *
 * one linear system a step, whose right sides are the columns. The slopes are those of the generated functions, which
 * are called with directions: the nodes in the lanes. The columns stand in the lanes of everything else. Where free
 * rollers stick on their disks, the core of a step is less than that of the state (spins.c). */
#define HELD_MOMENTA(wheels) (SET_HOLDS_MOMENTA*2*(wheels))
#define CARRYING(wheels) (3 + SET_SLIPS*(wheels))    /* the numbers of the core that carry: its first ones */
#define WHEEL_SPEEDS (SET_SLIPS*(1 + SET_HAS_CONTACT_SPEEDS))   /* numbers of the core that are speeds of one wheel */
#define SET_TURNS (SET_GRIPS*SET_HAS_CONTACT_SPEEDS || SET_STRIPS)  /* whether slips have directions that turn, one for
                                                                     * each wheel */
#define SET_DIRECTIONS (SET_HOLDS || SET_STANDS)    /* whether what sticks takes directions from nu */
#define SET_GATHERS (SET_SPINS_STICK || SET_DISKS_STICK)        /* whether momenta stand for free rollers: spins.c */
#define SET_BEARINGS_STICK (SET_AXLES_STICK || SET_DISKS_STICK || SET_IN_SERIES || SET_HOLDS)     /* bearings may stick */

/* Contacts at a point of a step, in a row, and at its nodes. */
typedef struct {
    lanes_t *pushed;            /* 2 x 6*wheels: forces on contacts at a point, and how these move */
    lanes_t *yielding;          /* 2*wheels: what slips along axles go with where rollers turn, and how that moves */
    lanes_t *towards, *slipping, *turned;   /* 2*wheels, wheels, 2*wheels: directions of slips at a point, the slips
                                             * along these, the slopes of the forces by the directions' angles */
    long long aimed_row;        /* a row behind which slips come to rest, and the directions there: rests.c */
    double *aimed;
} contacts_t;

/* Axles, and rollers in contact, that may stick where wheels may slip. */
typedef struct {
    lanes_t *sticks, *holding;  /* 2*wheels: of axles, of rollers in contact; 4*wheels: the same at a point, and how
                                 * these move */
    lanes_t *spin_dot, *yaw_mass;       /* at a point, and how they move: 2*wheels*rollers, 2   */
} bearing_modes_t;

/* Free rollers that may stick on their disks. */
typedef struct {
    lanes_t *sticks, *bearing, *holding;       /* of free rollers, as a point needs them                */
    lanes_t *bearing_along;     /* how `bearing` moves                                       */
    lanes_t *response, *fading; /* models x rollers: axial accelerations by torques, by spins of 1; how these move */
    nodes_t *disks_by;          /* directions and numbers x rollers: slopes of the disks' axial speeds at the nodes */
    nodes_t *axial_by;          /* numbers x rollers: of axial accelerations there, while disks stay */
    int fades;                  /* whether spins do anything, here or where numbers deviate     */
    lanes_t *torque_moved;      /* rollers x groups: deviations of `bearing` in a step       */
    lanes_t *momenta_moved;     /* 2*wheels x groups: of the momenta at its start               */
    lanes_t *axial_moved;       /* rollers x groups: of axial speeds there                      */
    lanes_t *axial_nodes, *disks_nodes;     /* rollers x NODES x groups: of these and of the disks' at the nodes */
    lanes_t *disks, *disks_moved;       /* axial speeds of the disks at a point, and how these move */
    double (*basis)[2];         /* of each momentum of a wheel                                  */
} spins_t;

/* The linear equations of a step. */
typedef struct {
    int *kind;                  /* what blockwise.c works on                                    */
    nodes_t *block;
    lanes_t *right, **pivot_row, *memory;
    lanes_t **row;              /* equations: right sides at the nodes, NODES x groups, which become the core's rates */
} solving_t;

/* What a phase begins with. */
typedef struct {
    lanes_t *moved;             /* size x groups: deviations                                    */
    double *momenta;
    double *free_axial;         /* wheels*(rollers - 1): by place                               */
} phase_t;

/* Slopes of rates at the nodes of a step. */
typedef struct {
    nodes_t *core;              /* equations x directions                                       */
    int *is_zero;               /* equations x directions: whether a slope is zero              */
    nodes_t *core_by, *chi_by, *pose_by;    /* by each number: equations, wheels, 3             */
    nodes_t pose[3][4];         /* of the rates of the pose by nu and the heading               */
    double carries[MAX_WHEELS + 1][CARRYING(MAX_WHEELS)];       /* W                            */
} slopes_t;

/* A step, and what there is at its nodes. */
typedef struct {
    double length;              /* in s                                                         */
    nodes_t part;               /* where the nodes are in it, from 0 to 1                       */
    nodes_t twice[NODES], once[NODES], inverse[NODES];  /* T^2, T and T^-1 by rows                  */
    double *of_coefficients;    /* degree + 1 x nodes: weights of the polynomials' coefficients         */
    lanes_t *known, *core, *carried; /* deviations x NODES: what feeds back and inputs, core, wheels and pose */
} varied_step_t;

/* What all steps and switches of a call work on. `groups`: vectors of columns. */
typedef struct {
    const omniroll_variations_t *run;
    int wheels, rollers, columns, groups;
    int nodes, blocks;          /* of a step, at most NODES; vectors of them                    */
    int size, core, feedback, inputs;   /* numbers: all, of the core, that feed back to it, that are given */
    int known;                  /* nu and the whole core of the state                           */
    int equations, directions;  /* the core and turns of directions; all that these have slopes by          */
    vehicle_t *vehicle;         /* models: one number deviates, the nodes in the lanes          */
    vehicle_t *column;          /* groups: each lane has the number of its column               */
    int numbered, *numbered_column, *number_of; /* the columns of numbers of the vehicle, and which these are */
    lanes_t *moved;             /* size x groups: deviations now                                */
    lanes_t *given;             /* (inputs + SET_MOVING*wheels) x groups: inputs, and how fast drives change */
    int *is_given;              /* inputs: whether any column has one in a step                 */
    lanes_t *axial;             /* wheels*rollers x groups: by physical roller                  */
    phase_t phase;
    lanes_t *held;              /* what sticks leaves to nu, and what holds it: at a point, and how these move */
    lanes_t *point, *along;     /* state, inputs and rates at nodes, and a direction            */
    int inside;                 /* whether somebody looks at steps between their rows           */
    varied_step_t step;
    slopes_t slopes;
    contacts_t contacts;
    bearing_modes_t bearings;
    spins_t spins;
    solving_t solving;
} variations_t;

/* Where what a point needs stands among w->point and w->along. */
enum { POINT_NU = 0, POINT_CORE = 3 };
ALWAYS_INLINE int point_chi(const variations_t *w) { return w->known; }
ALWAYS_INLINE int point_heading(const variations_t *w) { return w->known + w->wheels; }
ALWAYS_INLINE int point_inputs(const variations_t *w) { return point_heading(w) + 1; }
ALWAYS_INLINE int point_momenta(const variations_t *w) { return point_inputs(w) + SET_INPUTS*w->wheels; }
ALWAYS_INLINE int point_zeros(const variations_t *w) { return point_momenta(w) + 2*w->wheels; }
ALWAYS_INLINE int point_rates(const variations_t *w) { return point_zeros(w) + w->wheels*w->rollers; }
ALWAYS_INLINE int point_size(const variations_t *w) { return point_rates(w) + w->known; }

/* Where what stands at a place among the deviations is in a point; -1 for x and y, on which nothing depends. */
ALWAYS_INLINE int point_of_place(const variations_t *w, int place)
{
    const int pose = place - 3 - w->wheels;
    if (place < 3)
        return place;
    if (pose < 0)
        return point_chi(w) + place - 3;
    return pose > 2 ? pose : pose == 2 ? point_heading(w) : -1;
}

/* What a step is given beside the inputs of drives and modes: momenta, or torques of free rollers. */
ALWAYS_INLINE int held_inputs(const variations_t *w)
{
    return SET_GATHERS ? w->wheels*(w->rollers - 1) : HELD_MOMENTA(w->wheels);
}

/* The first number of the core that is a momentum of free rollers, or one of theirs; behind nu, and behind the speeds
 * of wheels that may slip. */
ALWAYS_INLINE int first_momentum(const variations_t *w) { return 3 + SET_DISKS_STICK*2*w->wheels; }

/* Where a number of the core stands among the deviations. */
ALWAYS_INLINE int place_of_core(const variations_t *w, int a) { return a < 3 ? a : a + 3 + w->wheels; }

/* Its deviations at the start of a step. */
ALWAYS_INLINE const lanes_t *start_of_core(const variations_t *w, int a)
{
    if (SET_GATHERS && a >= first_momentum(w))
        return w->spins.momenta_moved + (a - first_momentum(w))*w->groups;
    return w->moved + place_of_core(w, a)*w->groups;
}

/* The first direction that is the turn of a slip's direction; those before it are numbers of a point. */
ALWAYS_INLINE int first_turn(const variations_t *w) { return w->core + w->feedback + w->inputs; }

/* Whether a direction is a number of a point: no turn, no sum over rollers, and no number of the vehicle. */
ALWAYS_INLINE int is_of_point(const variations_t *w, int d)
{
    if (SET_GATHERS)
        return d < first_momentum(w) || (d >= w->core && d < w->core + w->feedback + SET_MOVING*w->wheels);
    return d < first_turn(w);
}

/* The place of a direction among those. */
ALWAYS_INLINE int place_of_direction(const variations_t *w, int d)
{
    if (d < w->core)
        return d;
    d -= w->core;
    if (SET_CORE_NEEDS_CHI && d < w->wheels)
        return point_chi(w) + d;
    d -= SET_CORE_NEEDS_CHI*w->wheels;
    if (SET_HAS_HEADING && d == 0)
        return point_heading(w);
    d -= SET_HAS_HEADING;
    return d < SET_MOVING*w->wheels ? point_inputs(w) + d : point_momenta(w) + d - SET_MOVING*w->wheels;
}

/* What sticks leaves to nu (directions by rows, then which are absent), and room for what holds them. */
#define HELD_SIZE 15
enum { DIRECTIONS = 0, ABSENT = 9, HELD_FORCE = 12 };

/* Rollers that are not in contact. */
#define FREE(w) ((w)->wheels*((w)->rollers - 1))

#include "deviations/bearing_modes.c"

ALWAYS_INLINE point_t point_of(const variations_t *w, const vehicle_t *vehicle, lanes_t *numbers)
{
    point_t point = {.vehicle = vehicle, .nu = numbers + POINT_NU, .core = numbers + POINT_CORE,
                     .chi = numbers + point_chi(w), .heading = numbers[point_heading(w)],
                     .inputs = numbers + point_inputs(w), .momenta = numbers + point_momenta(w),
                     .zeros = numbers + point_zeros(w), .core_dot = numbers + point_rates(w) + POINT_CORE};
    const int moves = numbers == w->along;
    lanes_t *const held = w->held + HELD_SIZE*moves;
    point.directions = held + DIRECTIONS, point.absent = held + ABSENT, point.held_force = held + HELD_FORCE;
    put_bearings(w, numbers, &point);
    point.free_sticks = moves ? numbers + point_zeros(w) : w->spins.sticks;
    point.free_bearing = moves ? w->spins.bearing_along : w->spins.bearing;
    point.free_holding = w->spins.holding + FREE(w)*moves;
    point.ground_push = w->contacts.pushed + 6*w->wheels*moves;
    point.ground_force = point.ground_push + 2*w->wheels, point.slip_dot = point.ground_force + 2*w->wheels;
    point.ground_yield = w->contacts.yielding + w->wheels*moves;
    return point;
}

/* What sticks in a row: at a point, where one of the numbers of the vehicle grows or none. */
ALWAYS_INLINE void put_held(const variations_t *w, long long row, int number)
{
    const int numbers = w->run->models - 1;
    const omniroll_bearing_modes_t *const of = &w->run->bearings;
    const double *const allowed = SET_DIRECTIONS ? of->allowed + of->hold[row]*(12 + 9*numbers) : 0;
    for (int k = 0; k < 12*SET_DIRECTIONS; k++)
        w->held[k] = lanes_of(allowed[k]);
    for (int k = 0; k < 9*SET_DIRECTIONS; k++)
        w->held[HELD_SIZE + k] = lanes_of(number < 0 ? 0 : allowed[12 + 9*number + k]);
}

/* Where contacts slip whose slip is rounding, at a point of the phase of a row. */
ALWAYS_INLINE void put_headings(const variations_t *w, long long row, lanes_t *point)
{
    const double *const recorded = w->run->motion.drive + (row*SET_INPUTS + SET_HEADINGS_INPUT)*w->wheels;
    const double *const heading = row == w->contacts.aimed_row ? w->contacts.aimed : recorded;
    for (int i = 0; i < SET_GRIPS*w->wheels; i++)
        point[point_inputs(w) + SET_HEADINGS_INPUT*w->wheels + i] = lanes_of(heading[i]);
}

/* The state and the inputs in a row. */
static void put_state(const variations_t *w, long long row, lanes_t *point)
{
    const omniroll_variations_t *const run = w->run;
    for (int k = 0; k < w->size; k++) {
        const int place = point_of_place(w, k);
        if (place >= 0)
            point[place] = lanes_of(run->motion.y[row*run->motion.row_size + run->place[k]]);
    }
    for (int k = 0; k < SET_INPUTS*w->wheels; k++)
        point[point_inputs(w) + k] = lanes_of(run->motion.drive[row*SET_INPUTS*w->wheels + k]);
    put_headings(w, row, point);
    for (int k = 0; k < HELD_MOMENTA(w->wheels); k++)
        point[point_momenta(w) + k] = lanes_of(w->phase.momenta[k]);
}

/* One of some vectors of each of the deviations of what a point has. */
ALWAYS_INLINE void put_moved(const variations_t *w, const lanes_t *moved, int vectors, int one, lanes_t *point)
{
    for (int k = 0; k < w->size; k++) {
        const int place = point_of_place(w, k);
        if (place >= 0)
            point[place] = moved[k*vectors + one];
    }
}

/* Nothing moves any more. */
static void clear_tangent(const variations_t *w)
{
    memset(w->along, 0, point_size(w)*sizeof *w->along);
    memset(w->spins.bearing_along, 0, SET_GATHERS*FREE(w)*sizeof *w->spins.bearing_along);
    memset(w->contacts.pushed + 6*w->wheels, 0, SET_GRIPS*2*w->wheels*sizeof *w->contacts.pushed);
    memset(w->contacts.yielding + w->wheels, 0, SET_STRIPS*w->wheels*sizeof *w->contacts.yielding);
}

/* Whether vectors are zero. */
ALWAYS_INLINE int are_zero(const lanes_t *x, int count)
{
    for (int k = 0; k < count*LANES; k++)
        if (x[k/LANES][k%LANES] != 0)
            return 0;
    return 1;
}

#include "deviations/slipping.c"
#include "deviations/spins.c"

/* Which inputs deviate in a step, in any column. */
static void find_given(variations_t *w)
{
    const int groups = w->groups, moving = SET_MOVING*w->wheels;
    for (int u = 0; u < w->inputs; u++)
        w->is_given[u] = !are_zero(w->given + u*groups, groups)
            || (u < moving && !are_zero(w->given + (w->inputs + u)*groups, groups));
}

/* Whether no slope by a direction is needed: it is an input that does not deviate, or nothing moves in it by itself. */
ALWAYS_INLINE int is_idle(const variations_t *w, long long row, int d)
{
    const int input = d < first_turn(w) ? d - w->core - w->feedback : -1;
    return (input >= 0 && !w->is_given[input]) || is_bound_to_ground(w, row, d);
}

/* The slopes of the core's rates by all that they depend on, and by the numbers, at one block of nodes. */
NEVER_INLINE void slopes_of_core(variations_t *w, long long row, int b)
{
    const int wheels = FIXED_WHEELS(w->wheels), directions = w->directions;
    put_held(w, row, -1);
    if (SET_GRIPS)
        put_forces_on_contacts(w, row);
    for (int d = 0; d < directions + w->run->models - 1; d++) {
        const int number = d - directions;
        lanes_t *const seed = is_of_point(w, d) ? &w->along[place_of_direction(w, d)] : 0;
        nodes_t *const to = number < 0 ? w->slopes.core + d : w->slopes.core_by + number*w->equations;
        const int stride = number < 0 ? directions : 1;
        if (is_idle(w, row, d)) {
            for (int a = 0; a < w->equations; a++)
                to[a*stride].lanes[b] = lanes_of(0);
            continue;
        }
        if (seed)
            *seed = lanes_of(1);
        if (number >= 0)
            put_held(w, row, number);
        const point_t at = point_of(w, &w->vehicle[number + 1 > 0 ? number + 1 : 0], w->point);
        const point_t along = point_of(w, at.vehicle, w->along);
        lanes_t nu_dot[3], nu_dot_along[3];
        if (SET_GRIPS)
            put_ground_along(w, row, d, &at, &along);
        if (SET_TURNS)
            put_slopes_of_turns(w, row, d, b, &at, &along, stride, to + w->core*stride);
        if (SET_GATHERS)
            put_spins_of_direction(w, d, at.vehicle);
        rates_along(wheels, &at, &along, nu_dot, nu_dot_along);
        if (SET_GATHERS)
            put_momenta_along(w, d, b, along.core_dot + first_momentum(w) - 3);
        for (int a = 0; a < w->core; a++)
            to[a*stride].lanes[b] = a < 3 ? nu_dot_along[a] : along.core_dot[a - 3];
        if (seed)
            *seed = lanes_of(0);
    }
    clear_tangent(w);
}

/* The slopes of the rates of the pose and of wheels: which are linear in nu, with constants, where contacts roll or
 * stick, and else numbers of the core. */
NEVER_INLINE void slopes_of_followers(variations_t *w, long long row, int b)
{
    const int wheels = FIXED_WHEELS(w->wheels);
    lanes_t rate[3], rate_along[3], chi_dot[MAX_WHEELS], chi_dot_along[MAX_WHEELS];
    for (int d = 0; d < 4 + w->run->models - 1; d++) {
        const int number = d - 4;
        const vehicle_t *const v = &w->vehicle[number < 0 ? 0 : number + 1];
        lanes_t nu[4] = {{0}};                      /* and the heading */
        if (number < 0)
            nu[d] = lanes_of(1);
        set_pose_rates_along(wheels, v, w->point, w->point[point_heading(w)], nu, nu[3], rate, rate_along);
        for (int c = 0; c < 3; c++)
            *(number < 0 ? &w->slopes.pose[c][d].lanes[b] : &w->slopes.pose_by[3*number + c].lanes[b]) = rate_along[c];
        if (d < 3)
            w->slopes.carries[wheels][d] = rate_along[2][0];
        set_wheel_speeds_along(wheels, v, w->point, nu, chi_dot, chi_dot_along);
        for (int i = 0; i < wheels && d != 3; i++) {
            const lanes_t slope = follows_nu(w, row, i) ? chi_dot_along[i] : lanes_of(0);
            if (number < 0)
                w->slopes.carries[i][d] = slope[0];
            else
                w->slopes.chi_by[number*wheels + i].lanes[b] = slope;
        }
    }
    for (int i = 0; i < SET_SLIPS*wheels; i++)
        w->slopes.carries[i][3 + i] = !follows_nu(w, row, i);
}

/* State and inputs at a block of the nodes of the step that starts in a row. */
static void put_point(const variations_t *w, long long step, long long row, int b)
{
    const omniroll_variations_t *const run = w->run;
    const double *const dense = run->motion.dense + step*(run->motion.degree + 1)*run->motion.row_size;
    for (int k = 0; k < w->size; k++) {
        const int place = point_of_place(w, k);
        if (place < 0)
            continue;
        lanes_t sum = {0};
        for (int c = 0; c <= run->motion.degree; c++) {
            lanes_t weight;
            memcpy(&weight, w->step.of_coefficients + c*w->nodes + b*LANES, sizeof weight);
            sum += weight*dense[c*run->motion.row_size + run->place[k]];
        }
        w->point[place] = sum;
    }
    const int inputs = SET_INPUTS*w->wheels;
    const double *const first = run->motion.drive + row*inputs, *const then = first + inputs;
    for (int k = 0; k < inputs; k++)
        w->point[point_inputs(w) + k] = k < SET_MOVING*w->wheels ? first[k] + w->step.part.lanes[b]*(then[k] - first[k])
                                                                 : lanes_of(first[k]);
    put_bearing_modes(w, row);      /* of the step: in its last row may be those of the next one */
    put_headings(w, SET_TURNS ? row + 1 : row, w->point);   /* a slip's rest knows where it went */
    for (int k = 0; k < HELD_MOMENTA(w->wheels); k++)
        w->point[point_momenta(w) + k] = lanes_of(w->phase.momenta[k]);
}

/* Add what the numbers of the vehicle do by themselves, each in the lane of its column: to the vectors of columns at a
 * node, what `by` has at a place. */
ALWAYS_INLINE void add_numbers(const variations_t *w, const nodes_t *by, int stride, int place, int node, lanes_t *to)
{
    double *const column = (double *)to;
    const nodes_t *const slope = by + place;
    for (int k = 0; k < w->numbered; k++)
        column[w->numbered_column[k]] += slope[w->number_of[k]*stride].node[node];
}

/* Which of the wheels' angles, or behind these the heading, a number is that feeds back to the core. */
ALWAYS_INLINE int carried_of_feedback(const variations_t *w, int f)
{
    return SET_CORE_NEEDS_CHI && f < w->wheels ? f : w->wheels;
}

/* Where these stand among the deviations. */
ALWAYS_INLINE int place_of_carried(const variations_t *w, int i) { return i < w->wheels ? 3 + i : 5 + w->wheels; }

#define AT_ONCE 4               /* sums that are made beside each other, */
#define VECTORS_AT_ONCE 3       /* each in so many vectors, where there are as many */

/* Add to some vectors at the nodes a factor times a table by rows times others; nodes are `stride` vectors apart. */
ALWAYS_INLINE void add_product_in(int nodes, int some, int stride, const nodes_t *table, double factor,
                                  const lanes_t *of, lanes_t *value)
{
    for (int j = 0; j < nodes; j += AT_ONCE) {
        lanes_t sum[AT_ONCE][VECTORS_AT_ONCE] = {{{0}}};
        for (int k = 0; k < nodes; k++)
            for (int i = 0; i < AT_ONCE; i++)
                for (int v = 0; v < some; v++)
                    sum[i][v] += table[j + i].node[k]*of[k*stride + v];
        for (int i = 0; i < AT_ONCE; i++)
            for (int v = 0; v < some; v++)
                value[(j + i)*stride + v] += factor*sum[i][v];
    }
}

/* The same in any number of vectors. */
NEVER_INLINE void add_product(int nodes, int vectors, int stride, const nodes_t *table, double factor,
                              const lanes_t *of, lanes_t *value)
{
    int v = 0;
    for (; v + VECTORS_AT_ONCE <= vectors; v += VECTORS_AT_ONCE)
        add_product_in(nodes, VECTORS_AT_ONCE, stride, table, factor, of + v, value + v);
    for (; v < vectors; v++)
        add_product_in(nodes, 1, stride, table, factor, of + v, value + v);
}

/* The same of values of one number, NODES x groups. */
static void add_product_of(const variations_t *w, const nodes_t *table, double factor, const lanes_t *of,
                           lanes_t *value)
{
    add_product(w->nodes, w->groups, w->groups, table, factor, of, value);
}

/* What starts at some values (groups) is at the nodes, by its rates there. */
static void come_to_nodes(const variations_t *w, double h, const lanes_t *start, const lanes_t *rate, lanes_t *to)
{
    for (int j = 0; j < w->nodes; j++)
        memcpy(to + j*w->groups, start, w->groups*sizeof *to);
    add_product_of(w, w->step.once, h, rate, to);
}

/* The rate of something carried by the numbers of the core that carry it, each `stride` vectors behind the other. */
ALWAYS_INLINE lanes_t carried_by(const variations_t *w, const double *carries, const lanes_t *nu, const lanes_t *rates,
                                 int stride)
{
    lanes_t sum = carries[0]*nu[0] + carries[1]*nu[stride] + carries[2]*nu[2*stride];
    for (int i = 0; i < SET_SLIPS*w->wheels; i++)
        sum += carries[3 + i]*rates[i*stride];
    return sum;
}

/* The rates at the nodes (NODES x groups) of the deviations of a wheel's angle, or behind these of the heading: from
 * those of nu and of other numbers that carry, with so many vectors from number to number and from node to node. */
static void put_carried_rate(const variations_t *w, int i, const lanes_t *nu, const lanes_t *others, int stride,
                             int node_stride, lanes_t *to)
{
    const int groups = w->groups, is_angle = i < w->wheels;
    const nodes_t *const by = is_angle ? w->slopes.chi_by : w->slopes.pose_by;
    for (int j = 0; j < w->nodes; j++, to += groups) {
        for (int k = j*node_stride, g = 0; g < groups; k++, g++)
            to[g] = carried_by(w, w->slopes.carries[i], nu + k, others + k, stride);
        add_numbers(w, by, is_angle ? w->wheels : 3, is_angle ? i : 2, j, to);
    }
}

/* What is known at the nodes: the numbers that feed back to the core, but for what its own rates do to them, and what
 * a step is given. */
static void put_known(variations_t *w, double h)
{
    const int groups = w->groups;
    lanes_t *known = w->step.known;
    for (int f = 0; f < w->feedback; f++, known += NODES*groups) {
        const int i = carried_of_feedback(w, f);
        put_carried_rate(w, i, w->moved, w->moved + place_of_core(w, 3)*groups, groups, 0, w->step.carried);
        come_to_nodes(w, h, w->moved + place_of_carried(w, i)*groups, w->step.carried, known);
    }
    for (int u = 0; u < w->inputs; u++, known += NODES*groups)
        for (int k = 0; k < w->nodes*groups && w->is_given[u]; k++) {
            const lanes_t *const given = w->given + u*groups + k%groups;
            const double since = w->step.length*w->step.part.node[k/groups];
            known[k] = u < SET_MOVING*w->wheels ? given[0] + since*given[w->inputs*groups] : given[0];
        }
}

/* Their right sides: what the deviations at the start, the inputs and the numbers do. */
static void put_right(variations_t *w, int a)
{
    const int groups = w->groups;
    const nodes_t *const slope = w->slopes.core + a*w->directions;
    const int *const zero = w->slopes.is_zero + a*w->directions;
    lanes_t *const row = w->solving.row[a];
    for (int g = 0; g < groups; g++)
        for (int j = 0; j < w->nodes; j += AT_ONCE) {
            lanes_t sum[AT_ONCE] = {{0}};
            for (int c = 0; c < w->core; c++)
                for (int i = 0; i < AT_ONCE && !zero[c]; i++)
                    sum[i] += slope[c].node[j + i]*start_of_core(w, c)[g];
            for (int k = 0; k < w->feedback + w->inputs; k++)
                for (int i = 0; i < AT_ONCE && !zero[w->core + k]; i++)
                    sum[i] += slope[w->core + k].node[j + i]*w->step.known[(k*NODES + j + i)*groups + g];
            for (int i = 0; i < AT_ONCE; i++)
                row[(j + i)*groups + g] = sum[i];
        }
    for (int j = 0; j < w->nodes; j++)
        add_numbers(w, w->slopes.core_by, w->equations, a, j, row + j*groups);
}

/* Linear equations in rows: `width` vectors of the matrix, then `groups` of right sides. */
typedef struct {
    lanes_t **row;
    int unknowns, width, groups;
} equations_t;

/* Bring the row with the largest pivot to its place. */
ALWAYS_INLINE void take_pivot(const equations_t *e, int p)
{
    const int v = p/LANES, k = p%LANES;
    int best = p;
    for (int i = p + 1; i < e->unknowns; i++)
        if (fabs(e->row[i][v][k]) > fabs(e->row[best][v][k]))
            best = i;
    lanes_t *const pivot = e->row[best];
    e->row[best] = e->row[p], e->row[p] = pivot;
}

/* Take multiples of two rows, behind the vector in which they have their pivots. */
ALWAYS_INLINE void subtract_two(const equations_t *e, int p, lanes_t *row, double first, const lanes_t *one,
                                double second, const lanes_t *two)
{
    for (int c = p/LANES + 1; c < e->width + e->groups; c++)
        row[c] -= first*one[c] + second*two[c];
}

/* Eliminate below two pivots at once, p and the one behind it, which stand in one vector of every row. */
ALWAYS_INLINE void eliminate_two(const equations_t *e, int p)
{
    const int v = p/LANES, k = p%LANES;
    take_pivot(e, p);
    const lanes_t *const one = e->row[p];
    const double inverse = 1/one[v][k];
    for (int i = p + 1; i < e->unknowns; i++) {
        const double factor = e->row[i][v][k]*inverse;
        e->row[i][v] -= factor*one[v];
        e->row[i][v][k] = factor;           /* goes along where rows change places */
    }
    take_pivot(e, p + 1);
    lanes_t *const two = e->row[p + 1];
    subtract_two(e, p, two, two[v][k], one, 0, one);
    const double inverse_two = 1/two[v][k + 1];
    for (int i = p + 2; i < e->unknowns; i++) {
        lanes_t *const row = e->row[i];
        const double first = row[v][k], second = row[v][k + 1]*inverse_two;
        if (first == 0 && second == 0)
            continue;
        row[v] -= second*two[v];
        subtract_two(e, p, row, first, one, second, two);
    }
}

/* An unknown from those behind it, in some vectors of right sides. */
ALWAYS_INLINE void substitute_in(const equations_t *e, int p, int first, int some)
{
    const double *const pivot_row = (const double *)e->row[p];
    lanes_t sum[VECTORS_AT_ONCE], *const to = e->row[p] + e->width + first;
    for (int g = 0; g < some; g++)
        sum[g] = to[g];
    for (int i = p + 1; i < e->unknowns; i++)
        for (int g = 0; g < some; g++)
            sum[g] -= pivot_row[i]*e->row[i][e->width + first + g];
    for (int g = 0; g < some; g++)
        to[g] = sum[g]*(1/pivot_row[p]);
}

/* Eliminate below the pivots; then the right sides become the solution. */
NEVER_INLINE void solve(const equations_t *e)
{
    for (int p = 0; p < e->unknowns; p += 2)
        eliminate_two(e, p);
    for (int p = e->unknowns - 1; p >= 0; p--) {
        int g = 0;
        for (; g + VECTORS_AT_ONCE <= e->groups; g += VECTORS_AT_ONCE)
            substitute_in(e, p, g, VECTORS_AT_ONCE);
        for (; g < e->groups; g++)
            substitute_in(e, p, g, 1);
    }
}

#include "deviations/node_equations.c"
#include "deviations/spin_nodes.c"

static void put_slopes(variations_t *w, long long step, long long row)
{
    for (int b = 0; b < w->blocks; b++) {
        put_point(w, step, row, b);
        slopes_of_core(w, row, b);
        slopes_of_followers(w, row, b);
    }
    for (int k = 0; k < w->equations*w->directions; k++)
        w->slopes.is_zero[k] = are_zero(w->slopes.core[k].lanes, w->blocks);
}

/* The deviations of the core at the nodes, from its rates: of those of its numbers that carry something, or that spins
 * at the nodes go with. */
static void put_core(variations_t *w, double h)
{
    const int groups = w->groups, count = SET_GATHERS ? first_momentum(w) : CARRYING(w->wheels);
    for (int a = 0; a < count; a++)
        come_to_nodes(w, h, start_of_core(w, a), w->solving.row[a], w->step.core + a*NODES*groups);
}

/* The rates at the nodes of the deviations of wheels and pose. */
static void put_carried_rates(variations_t *w, double h)
{
    const int groups = w->groups, wheels = w->wheels, all = NODES*groups;
    const lanes_t *const core = w->step.core;
    lanes_t *const heading = w->step.known;     /* not needed any more */
    for (int i = 0; i <= wheels; i++)
        put_carried_rate(w, i, core, core + 3*all, all, groups, w->step.carried + (place_of_carried(w, i) - 3)*all);
    come_to_nodes(w, h, w->moved + (5 + wheels)*groups, w->step.carried + (wheels + 2)*NODES*groups, heading);
    for (int c = 0; c < 2; c++)
        for (int j = 0; j < w->nodes; j++) {
            lanes_t *const to = w->step.carried + ((wheels + c)*NODES + j)*groups;
            for (int g = 0; g < groups; g++) {
                to[g] = w->slopes.pose[c][3].node[j]*heading[j*groups + g];
                for (int d = 0; d < 3; d++)
                    to[g] += w->slopes.pose[c][d].node[j]*core[(d*NODES + j)*groups + g];
            }
            add_numbers(w, w->slopes.pose_by, 3, c, j, to);
        }
}

/* The rates at a node of what stands at a place among the deviations. */
ALWAYS_INLINE const lanes_t *rate_at_node(const variations_t *w, int place, int node)
{
    const int core = place < 3 ? place : place - 3 - w->wheels;
    if (place < 3 || core >= 3)
        return w->solving.row[core] + node*w->groups;
    return w->step.carried + ((place - 3)*NODES + node)*w->groups;
}

/* Whether the nodes see what the deviations of nu do in a step: of its rates, as Legendre's polynomials, the last one
 * makes next to nothing of the turn of the wheels. The steps are as long as the run lets them be, which may hardly move
 * where what is beside it does. */
static int are_seen(const variations_t *w, double h)
{
    for (int g = 0; g < w->groups; g++) {
        lanes_t last = {0}, size = {0};
        for (int a = 0; a < 3; a++) {
            lanes_t sum = {0};
            for (int j = 0; j < w->nodes; j++) {
                const lanes_t rate = w->solving.row[a][j*w->groups + g];
                sum += w->run->gauss.last[j]*rate;
                size += h*h*w->run->gauss.weights[j]*lanes_abs(rate);
            }
            last += lanes_abs(sum), size += h*lanes_abs(w->moved[a*w->groups + g]);
        }
        for (int i = 0; i < w->wheels; i++)
            size += lanes_abs(w->moved[(3 + i)*w->groups + g]);
        for (int k = 0; k < LANES && g*LANES + k < w->columns; k++)
            if (h*h*last[k] > w->run->bounds.max_last*(size[k] + w->run->bounds.least[g*LANES + k]))
                return 0;
    }
    return 1;
}

#include "deviations/pieces.c"

/* The deviations at the end of a step, or of a piece of it of length h, from those at its start; rates (nodes x size x
 * columns), or null. Returns whether the nodes are enough; nothing has been done otherwise. */
static int vary_piece(variations_t *w, long long step, long long row, double h, double *rates)
{
    const int groups = w->groups, places = SET_GATHERS ? 3 + w->wheels + first_momentum(w) : w->size;
    put_slopes(w, step, row);
    put_known(w, h);
    put_core_rates(w, row, h);
    if ((w->run->bounds.max_last > 0 && !are_seen(w, h)) || are_too_fast(w, row, h))
        return 0;
    put_core(w, h);
    put_carried_rates(w, h);
    if (SET_GATHERS)
        finish_spins(w, h, rates);
    for (int place = 0; place < places; place++)
        for (int j = 0; j < w->nodes; j++) {
            const lanes_t *const rate = rate_at_node(w, place, j);
            for (int g = 0; g < groups; g++)
                w->moved[place*groups + g] += h*w->run->gauss.weights[j]*rate[g];
            if (rates)
                memcpy(rates + (j*w->size + place)*w->columns, rate, w->columns*sizeof *rates);
        }
    return 1;
}

/* A step begins in a row. */
static void begin_step(variations_t *w, long long row)
{
    w->step.length = w->run->motion.elapsed[row + 1] - w->run->motion.elapsed[row];
    if (SET_GATHERS)
        begin_spins(w, row);
    find_given(w);
}

/* From a step's start up to a part of it, in pieces. Where one is too fast it is cut in half. Behind the first ones
 * what is fast has decayed, and they grow again: there are hardly more than twice the halvings. */
static void vary_in_pieces(variations_t *w, long long step, long long row, double up_to)
{
    long long piece = 0;
    for (int halved = 1; halved > 0;) {
        const double part = ldexp(up_to, -halved);
        take_piece(w, part*(double)piece, part);
        if (SET_GATHERS && piece > 0)
            put_momenta_moved(w);
        if (!vary_piece(w, step, row, part*w->step.length, 0)) {
            halved++, piece *= 2;
            continue;
        }
        for (piece++; halved > 0 && piece%2 == 0; halved--)
            piece /= 2;
    }
    take_step(w);
}

/* The deviations at the end of a step, from those at its start. Returns whether the nodes are enough, where the run
 * asks that; nothing has been done otherwise. */
static int vary_along(variations_t *w, long long step, long long row)
{
    begin_step(w, row);
    if (!vary_piece(w, step, row, w->step.length, 0)) {
        if (w->nodes < NODES)
            return 0;
        vary_in_pieces(w, step, row, 1);
    }
    if (SET_GATHERS) {
        put_state(w, row + 1, w->point);
        put_spins_at_end(w);
    }
    return 1;
}
