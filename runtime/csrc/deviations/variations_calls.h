/* What sensitivities of a run are computed from, in C and for cffi (variations.c, passages.c, following.c).
 *
 * N wheels, n rollers a wheel, P columns (deviations that are followed together), m numbers that deviate: nu, chi, the
 * pose, then the rest of the core. T rows, S steps, K phases between switches. */

/* The run: its rows, its steps, and the phases between switches. */
typedef struct {
    long long rows;                         /* T                                                        */
    int row_size, degree;                   /* numbers of a row of y; of the steps' polynomials         */
    const double *elapsed;                  /* T                                                        */
    const double *y;                        /* T x row_size                                             */
    const double *spins;                    /* T x N x (n-1), or null                                   */
    const long long *contact;               /* T x N                                                    */
    const double *drive;                    /* T x inputs of the set x N                                */
    const double *dense;                    /* S x degree + 1 x row_size                                */
    const long long *step_of, *step_rows;   /* T: the step that starts in this row, or -1; S: and back  */
    const long long *phase_start;           /* K: the rows at which phases start                        */
} omniroll_motion_t;

/* Gauss's quadrature in a step. */
typedef struct {
    int count;                              /* nodes: NODES or fewer, a multiple of LANES               */
    const double *nodes, *weights;          /* nodes: from 0 to 1, and of the integral over a step      */
    const double *integrals;                /* nodes x nodes: from 0 to each node, by rows              */
    const double *last, *before_last;       /* nodes: of Legendre's polynomials' last coefficient; of that before */
    const double *of_coefficients;          /* degree + 1 x nodes: of the steps' polynomials            */
} omniroll_gauss_t;

/* What is nothing, what is too much, and what only just happens. */
typedef struct {
    double max_last;                        /* of the deviations of nu: how much the last of Legendre's polynomials
                                             * of their rates may make of them in a step; 0: any part  */
    const double *least;                    /* P: deviations of the wheels' angles that are nothing     */
    double max_error;                       /* of the deviations of speeds: what these may be off by behind a step in
                                             * which rates are fast                             */
    double jumps, reached, grazes;          /* of rates that jump, of friction that is used up: parts of these; in m/s^2,
                                             * how fast a slip comes to rest that only just does        */
    double only_just;                       /* of what is used up, how much more in the time of the modes: with less a
                                             * contact lets go only just                                */
} omniroll_bounds_t;

/* Bearings that may stick, B of them: of axles, then of rollers by wheel and place, of others than free ones those in
 * contact. Each array is null where there is none. */
typedef struct {
    const long long *hold;                  /* T: which of `allowed` is that of a row                   */
    const double *allowed;                  /* what bearings that stick leave to nu: directions, 3 x 3 by rows, which
                                             * of its columns are absent, 3; how the directions move with each number */
    const long long *mode;                  /* T x B: 0 where one sticks, else its rate's sign          */
    const double *sliding;                  /* B: torques of those that turn                            */
    const double *bound, *bound_moved;      /* B: the largest at rest; P x B: how these move            */
    const double *inertia;                  /* B                                                        */
    int *enters;                            /* T: not 0 where something happens as a step begins, until it is passed */
} omniroll_bearing_modes_t;

/* Contacts that may stick, or wheels that may stand. Each array is null where there is none. */
typedef struct {
    const double *grip;                     /* models x N x 3: loads of the contacts, their friction along
                                             * the axle and along the rolling direction; behind the first how they
                                             * move                                                     */
    const double *per_reach;                /* models x N x 2: one over the squares of what static friction can hold;
                                             * behind the first how they move                           */
    const double *slip_rounding;            /* T x N: slips within these do not say where they go       */
    const double *standing;                 /* radius, distance of the rollers' axes from the ground in their middles */
    const double *standing_moved;           /* P: how the radius moves                                  */
} omniroll_contact_modes_t;

typedef struct {
    int wheels, rollers_per_wheel;
    int impact;                             /* the law of the switches: impact, or smooth               */
    int columns, size;                      /* P, m                                                     */
    int models;                             /* 1 + the numbers of the vehicle that deviate              */
    const omniroll_model *const *model;     /* with their slopes: the first in which nothing deviates   */
    const int *number;                      /* P: the model of each column                              */
    const int *place;                       /* m: places in a row of y                                  */
    omniroll_motion_t motion;
    omniroll_gauss_t gauss;
    omniroll_bounds_t bounds;
    omniroll_bearing_modes_t bearings;
    omniroll_contact_modes_t contacts;
    const double *knot;                     /* P: by how much the time deviates at which drives jump at `first`; or null */
    int *why;                               /* 2: why a row has not been passed, and by which column: why_t in passages.c */
    double *moved;                          /* T x m x P: deviations in the rows                        */
    double *given;                          /* S x given_size x P: of what drives the steps             */
    double *axial;                          /* K x N x n x P: of the rollers' axial speeds at the phases' starts */
    int given_size;                         /* inputs, how fast those of drives change, numbers         */
    double *work;                           /* omniroll_variations_work_size() doubles, aligned to 128 bytes */
} omniroll_variations_t;

long long omniroll_variations_work_size(const omniroll_variations_t *run);

/* Follow the deviations from row `first`, in a phase, up to row `last`. as_one: the wheels that switch at the first
 * row do so together. Returns the row where it has come: before `last` one at which several wheels switch, or one
 * grazes, or contacts or bearings change their modes as saltations.c does not know. -1 - row: the step from this row
 * asks for more nodes, all that there are. */
long long omniroll_follow(const omniroll_variations_t *run, long long first, long long last, long long phase,
                          int as_one);

/* The most nodes, of so many or fewer, that a step may have here. */
int omniroll_variations_nodes(int nodes);

/* The rates of the deviations, nodes x m x P, at the nodes of each of some steps, each in its phase. in_pieces: not 0
 * where these are too fast for the nodes, and there are no rates. */
void omniroll_rates_in_steps(const omniroll_variations_t *run, long long count, const long long *steps,
                             const long long *phases, double *rates, int *in_pieces);

/* The deviations, m x P, at a part x of each of some steps, each in its phase, followed in pieces. */
void omniroll_moved_in_steps(const omniroll_variations_t *run, long long count, const long long *steps,
                             const long long *phases, const double *x, double *moved);

/* Let all that sticks in a row in which a phase begins, of wheels that roll, take what it does from the deviations; at
 * the start of a run with free rollers first make of those of nu, chi and their spins, N x (n-1) x P, the rest. */
void omniroll_begin(const omniroll_variations_t *run, long long row, long long phase, const double *spins);

/* The names of the numbers of the core beside nu, or of the inputs, in their order. */
const char *omniroll_variations_names(int inputs);
