/* What a step works on: its state at the nodes, and what the parts of the engine keep of it while it is tried. What a set
 * does not have is not compiled. */
#ifndef OMNIROLL_STEP_H
#define OMNIROLL_STEP_H

#include "step/nodes.h"

#define MAX_UNKNOWNS (3*NODES)      /* nu' at the nodes                                                     */
#define GRIP_ROUNDINGS 64           /* of what a contact that sticks takes, which is a difference of other forces */
#define GRIP_NOISE(excess) (GRIP_ROUNDINGS*EPS*(2 + (SET_LOADS_FOLLOW ? fabs(excess) : (excess))))
/* In which contacts may slip: 0 along the axle, 1 along the rolling direction. */
#define SET_FIRST_DIRECTION (!(SET_HAS_CONTACT_SPEEDS || SET_STRIPS))
#define SET_APPROACHES (SET_GRIPS && SET_HAS_CONTACT_SPEEDS)    /* whether steps may end at rests: approach.c         */

/* Newton's rule for some rates at all nodes: change = missing + slope h (integral of the change). The matrix of this
 * system, eliminated (L below the diagonal, 1/U on it): rows in the order of their pivots, each `count` tables of nodes. */
typedef struct {
    nodes_t rows[MAX_UNKNOWNS*MAX_UNKNOWNS/NODES], *row[MAX_UNKNOWNS];
} newton_t;

/* How the speeds that are coupled are solved for: those of the core that stand first, then nu. Rows of matrices are those
 * of the rates. Where contacts may stick on springs they are heave and tilt: sprung.c. */
typedef struct {
    int size;                                   /* how many speeds                                */
    double *slope;                              /* size x size, of the rates in the speeds        */
    double *start;                              /* size: the rates at the start of the step       */
    double *diagonal;                                /* slopes of the other numbers of the core, each in itself */
    double *small;                              /* size x (size + 1), scratch                     */
    unsigned char *filled;                      /* size x size: what is not zero when eliminated  */
    eigen_t *real, *imaginary;                   /* size x size, eliminated                        */
    eigen_t *found_real, *found_imaginary;       /* size                                           */
    nodes_t *missing;                           /* of all rates: of the core, then of nu          */
    double *reach;                              /* of each wheel where the slopes are from, of its roller's axial speed */
} coupled_t;

/* Bearings whose rates are numbers of the core, where these stand together: of free rollers, or of axles. */
typedef struct {
    lanes_t *sticks, *torque;                   /* 1 or 0; the torque of one that turns, else 0  */
    lanes_t *holding;                           /* out: what holds                               */
    nodes_t *held;                              /* that at the nodes                             */
    double *late;                               /* what its polynomials lack at the step's end   */
    lanes_t *rate;                              /* scratch                                       */
    int rollers_at;                             /* where those of rollers begin, behind those of axles: in contact, free */
    int wheels;
    double *now;                                /* rates at this instant                         */
    lanes_t *spin;                              /* out: spins of the rollers in contact          */
    double *takes;                              /* torques of those in core_bearings.c's spins_at_bound(), else 0 */
    double *scale;                              /* of what stands in the place of their spins, in rad/s */
    lanes_t *load;                              /* of the contacts                               */
    const lanes_t *friction;
    lanes_t *dot;                               /* out: accelerations of the rollers' spins      */
    lanes_t *yaw_mass;                          /* out: one number                               */
} bearing_states_t;

ALWAYS_INLINE void put_bearing_states(const bearing_states_t *states, point_t *point)
{
    if (SET_SPINS_STICK)
        point->free_sticks = states->sticks, point->free_bearing = states->torque, point->free_holding = states->holding;
    if (SET_AXLES_STICK)
        point->axle_sticks = states->sticks, point->axle_holding = states->holding;   /* torques are among the inputs */
    if (SET_IN_SERIES)
        point->contact_sticks = states->sticks + states->rollers_at;  /* set_slip_spins() tells what holds them       */
    if (SET_STRIPS)  /* but the dynamics does where contacts stick               */
        point->contact_holding = states->holding + states->rollers_at, point->contact_spin = states->spin;
    if (SET_DISKS_STICK) {
        const int contact = states->rollers_at, free = contact + states->wheels;
        point->contact_sticks = states->sticks + contact, point->contact_holding = states->holding + contact;
        point->free_sticks = states->sticks + free, point->free_holding = states->holding + free;
        point->free_bearing = states->torque + free;
        point->contact_spin_dot = states->dot + contact, point->spins_dot = states->dot + free;
        point->yaw_mass = states->yaw_mass;
    }
}

/* Wheels that stand, along their axles (direction 0) where contact and roller stick, along their rolling directions (1)
 * where contact and axle do. Where rollers do not stick a wheel stands along its rolling direction alone. */
typedef struct {
    int count, wheel[MAX_BEARINGS], direction[MAX_BEARINGS], bearing[MAX_BEARINGS];       /* the bearing that holds it */
    int stands[2*MAX_WHEELS];                   /* of each wheel and direction                             */
    int *has_part;                              /* of each bearing: whether it holds one that stands       */
    bearings_t rows;                            /* what a unit force in each does to nu                    */
    double of_ground[2*MAX_WHEELS];             /* what the ground takes at most of any wheel, in N        */
    double holding[MAX_BEARINGS], max_holding;      /* what these bearings take at most; the largest of all, in N m */
    double radius, arm;                         /* of a wheel; of its roller in contact where chi is 0     */
    double size[3], per_force;                  /* what a force on nu is rounded against; nu' that it gives */
    double used_by[MAX_BEARINGS];               /* forces of least use, the last that were found           */
    const omniroll_bearing_t *contact;          /* bearings of rollers in contact, null where there are none */
    double rounding;                            /* EPS: what a use is rounded to by terms of the force on nu */
    elements_t *problem;                        /* of what holds them: scratch                             */
} standing_t;

/* What they ask for: the force that holds nu, the torques of bearings where the ground took nothing in the directions in
 * which they stand, the ground's forces, and the arms of the rollers in contact. */
typedef struct {
    double force[3], of_bearings[2*MAX_WHEELS], along[2*MAX_WHEELS], arm[MAX_WHEELS];
} demand_t;

/* A step up to a rest, in a clock that is not time: approach.c. */
typedef struct {
    int stretched;                              /* the power of its clock, else 0                           */
    nodes_t clock, stretch;                     /* the nodes' times over h, and the rates of these          */
    double leaves, part;                        /* of the time to rest; of the clock, in the step           */
    double across, fades;                       /* the slip's rate across its direction at the start; the power with
                                                 * which the time to rest takes away what it would make of the slip */
} approach_t;

/* A step whose rates are solved for implicitly: stiff.c. */
typedef struct {
    int on;                                     /* whether the core is                           */
    int sweeps;                                 /* how many such sweeps this try has had         */
    int of_nu;                                  /* whether slopes of nu' in nu are needed for it */
    int by_newton;                              /* it has been in the last try                   */
    int by_axles;                               /* whether axles' friction alone makes its slopes */
    double steepest;                            /* the largest h times slope in the last sweep   */
    nodes_t found_nu[3], slope_nu[9];           /* scratch                                       */
    newton_t newton;                            /* of nu', where it is stiff                     */
    lanes_t *core_slope, *core_chord;           /* scratch                                       */
    nodes_t *found_core, *slope_core, *core_in_nu;
} stiff_t;

/* Slopes by the rates of heave and tilt and by these themselves, of their accelerations, of nu' and of what of the core is
 * coupled with it; and the length of the step for which the matrix of Newton's rule has been eliminated: sprung.c. */
typedef struct {
    double slope[6 + 2*MAX_WHEELS][6], h;
    nodes_t found[3];                           /* accelerations that the last sweep has found               */
} sprung_t;

/* Guards at the start of a step. share: the wheel of whose load's part this is a bound, and on which side; or 0. */
typedef struct {
    int share[MAX_GUARDS];
    double start[MAX_GUARDS], noise[MAX_GUARDS], slope[MAX_GUARDS], weights[3*MAX_GUARDS];       /* weights: of nu */
} guards_t;

ALWAYS_INLINE int wheel_of_share(int bound)
{
    return (bound < 0 ? -bound : bound) - 1;
}

#define MAX_GUARDED (9 + MAX_WHEELS)    /* numbers of the state that guards may weigh                           */

/* What ends a step. */
typedef struct {
    int landing;                                /* the wheel whose joint ends the step, or -1; wheels + k: guard k */
    double late;                                /* the event comes this much later than h,       */
    double reach;                               /* at most this part of h                        */
    double unsure;                              /* rounding hides the event's instant for so long */
    double tick;                                /* what the run's time is rounded to             */
    double edge[MAX_WHEELS];                    /* the |chi| that ends the step: the joint, or little more for a
                                                 * wheel that rests there and turns back         */
    const double *guard_rows;                   /* of the run                                    */
    int guards, read_count, reads[MAX_GUARDED];     /* and the numbers that one of them weighs              */
    guards_t guard;
} event_t;

/* Contacts as they are at the start of a step. */
typedef struct {
    int slides[MAX_WHEELS], grips[MAX_WHEELS];      /* contacts that slip, and that stick; neither is off   */
    int sliding, turning, gripping;             /* whether there are such, with directions, and such as stick */
    int rolls;                                  /* all stick: what is coupled with nu follows from it */
    int blind;                                  /* and no sweep asks yet with how much friction */
    int corner[MAX_WHEELS];                     /* contacts that slip and whose rollers turn                */
    int falls[MAX_WHEELS];                      /* slips that come nearer to rest as the step begins        */
    int early;                                  /* whether the first sweeps have not told yet how slips begin   */
    int keeps[MAX_WHEELS], strays;              /* slips that keep their direction up to rest; one has not      */
    double residual_slip[MAX_WHEELS];           /* of a slip across its direction, in m/s, that is nothing    */
    double rest_in;                             /* the time until the first other slip comes to rest         */
    int rests;                                  /* which slip that is                                        */
    const lanes_t *load, *friction;
    double per_reach[2*MAX_WHEELS];             /* over what contacts that stick can take under their loads at rest */
    double per_load[MAX_WHEELS], presses[MAX_WHEELS];       /* over these loads; 1 for contacts that carry one, else 0 */
    const double *response;                     /* of the rates of slips to forces, of contacts that slip */
    int place[MAX_WHEELS], responding;          /* their places there, and how many there are    */
    double settles, friction_makes, friction_force;
    const lanes_t *next_before;
} contacts_t;

/* Their slips and forces at the nodes of a step. */
typedef struct {
    nodes_t toward[2*MAX_WHEELS];               /* directions of the slips                        */
    double begun[2*MAX_WHEELS];                 /* the same at the start of the step              */
    nodes_t push[2*MAX_WHEELS], turned[2*MAX_WHEELS];       /* their forces, and the slopes of these in a turn */
    nodes_t self_response[4*MAX_WHEELS];        /* of a contact's slip to forces on it, 2 x 2             */
    int knows_response[MAX_WHEELS];             /* whether it has been found in this try          */
    nodes_t at[2*MAX_WHEELS], rate[2*MAX_WHEELS], excess[MAX_WHEELS];
    nodes_t at_load[MAX_WHEELS];                /* loads, where they follow from the motion: loads.c       */
    double start[2*MAX_WHEELS], end[2*MAX_WHEELS], noise[MAX_WHEELS];
    double excess_start[MAX_WHEELS], excess_late[MAX_WHEELS];
    double turn_noise;                          /* of what contacts that stick take, by directions of slow slips  */
    nodes_t yield[MAX_WHEELS];                  /* how far they slip along their axles: strips.c            */
    nodes_t next_share[MAX_WHEELS];             /* of wheels that stand on their joints and may slip */
    nodes_t *shared_rows, **shared_row, *shared_turn;   /* scratch of shared_directions.c                    */
    int turned_together[MAX_WHEELS];            /* whose directions the last sweep has found together        */
} slips_t;

/* What sticks in a step, and what holds it. */
typedef struct {
    int held;                                   /* bearings that stick                             */
    int of_contacts;                            /* events of contacts, which stand before those of bearings */
    double turns[MAX_WHEELS];                   /* 0 of a wheel whose axle sticks, else 1        */
    lanes_t directions[9], absent[3];           /* of nu                                         */
    nodes_t force[3];                           /* that holds, at the nodes                      */
    double force_size[3], per_force[3];
    int count;                                  /* of bearings whose rates are numbers of the core */
    const omniroll_bearing_t *bearing;          /* these                                           */
    double residual;                            /* of their rates, by the iteration at the nodes   */
    const bearing_states_t *states;
    const standing_t *standing;
    nodes_t along[2*MAX_WHEELS];                /* what wheels that stand ask for, at nodes */
    demand_t demand_start, demand_late;         /* at the start; what the polynomials lack at the end */
    int nearly_used;                            /* whether in this try all has been used, or nearly so       */
    double used_by[MAX_BEARINGS];               /* forces of least use, the last that were found             */
} holding_t;

/* What acts in a step, and the heading. */
typedef struct {
    double heading;                             /* at the start                                  */
    nodes_t at_heading;
    double input[MAX_INPUTS*MAX_WHEELS], input_slope[MAX_INPUTS*MAX_WHEELS];
    lanes_t held[MAX_INPUTS*MAX_WHEELS];    /* the same inputs, where none moves                          */
    int moves;                              /* whether one changes within the step                        */
    lanes_t *at_nodes;                      /* the same then at the nodes, vector by vector               */
    double length;                          /* of the step, when these were found; 0 before               */
} acting_t;

/* The state at a step's end. travel: of the pose, in the step. */
typedef struct {
    double nu[3], chi[MAX_WHEELS], rate[MAX_WHEELS], travel[3];
} end_t;

typedef struct {
    int wheels;
    const vehicle_t *vehicle;
    const lanes_t *momenta;
    const double *joint;                        /* N: pi/n of each wheel                       */
    double nu[3], chi[MAX_WHEELS];              /* where the step starts                         */
    double h;
    nodes_t rate_nu[3], at_nu[3];               /* nu', the unknowns, and nu at the nodes        */
    nodes_t rate_chi[MAX_WHEELS], at_chi[MAX_WHEELS];
    nodes_t rate_pose[3];
    end_t end;
    event_t event;
    acting_t acts;
    int core;                                   /* how many numbers it has beside nu             */
    const double *start_core;
    double *end_core, *weight;                  /* weight: size of nu over that of each number   */
    nodes_t *rate_core;
    lanes_t *at_core;                           /* at the nodes, vector by vector: core_at()     */
    lanes_t *core_here, *core_dot;              /* scratch                                       */
    nodes_t rate_account[MAX_ACCOUNTS];
    contacts_t contact;
    slips_t slip;
    approach_t approach;
    holding_t hold;
    int all_turn;                               /* whether no wheel stands on its joint         */
    int bare;                                   /* whether the scene has none of OFTEN_ABSENT: nu' has a form then */
    lanes_t turning_moved;                      /* how far the last sweep has moved the wheels' rates, where these */
                                                /* depend on the angles                          */
    long long sweeps;
    const coupled_t *coupled;
    int fresh, renewals;                        /* no sweep yet; of its slopes, in this try      */
    stiff_t stiff;
    sprung_t sprung;
    double size;                                /* of nu                                         */
    double rest;                                /* what further sweeps would change              */
    double bend_in;                             /* the time until a wheel comes to where rates bend */
} step_t;

/* Whether a contact slips in a direction that turns. */
ALWAYS_INLINE int may_turn(const step_t *s, int i)
{
    if (SET_STRIPS)
        return s->contact.slides[i] && !s->contact.corner[i];
    return s->contact.slides[i];
}

/* Whether the directions of a contact have been found together with others in the last sweep. */
ALWAYS_INLINE int turned_together(const step_t *s, int i)
{
    if (SET_STANDS)
        return s->slip.turned_together[i];
    return 0;
}

/* The rest of the core in vector b of the nodes, as the kernel reads it. */
ALWAYS_INLINE lanes_t *core_at(const step_t *s, int b)
{
    return s->at_core + b*s->core;
}

/* The same as a copy that may be moved. */
ALWAYS_INLINE const lanes_t *core_to_move(const step_t *s, int b)
{
    for (int c = 0; c < s->core; c++)
        s->core_here[c] = core_at(s, b)[c];
    return s->core_here;
}

/* A try: its length, and its error over that allowed. */
typedef struct {
    double h, error;
} tried_t;

/* The arrays of a point. */
typedef struct {
    lanes_t nu[3], chi[MAX_WHEELS];
    lanes_t input[MAX_INPUTS*MAX_WHEELS];
    lanes_t held_force[3];
    lanes_t ground_push[2*MAX_WHEELS], ground_force[2*MAX_WHEELS], slip_dot[2*MAX_WHEELS];
    lanes_t ground_yield[MAX_WHEELS], next_share[MAX_WHEELS];
} arrays_t;

#endif
