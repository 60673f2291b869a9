/* What callers of the compiled engine need to know; no preprocessor here, since cffi reads this file too. See
 * engine.h.
 *
 * What acts on a vehicle is made of signals: numbers for every wheel, affine in time between two events. The first
 * signals are the inputs of the kernel; the last one is what a drive with modes reads. */

/* Numbers over time, linear or held between two times, constant before the first and after the last. */
typedef struct {
    int width, held;
    long long count, next;      /* next: the first time that is still to come                           */
    const double *times, *values;   /* times from the start of the run; values: count x width            */
} omniroll_curve_t;

/* A curve that a signal follows. */
typedef struct {
    int signal;
    omniroll_curve_t curve;
} omniroll_table_t;

/* A sampled controller of the wheels' speeds, whose output a signal holds up to the next sample. Where `proportional` is
 * not given, the caller takes the samples: it writes the output and counts the sample. */
typedef struct {
    int signal;
    double sample_time, limit;
    long long samples;          /* how many there were                                                  */
    omniroll_curve_t target;    /* of nu                                                                */
    const double *proportional, *integral;  /* N                                                        */
    double *sum, *output;       /* N                                                                    */
} omniroll_sampler_t;

/* A number that is affine in a signal and in a wheel's rate. */
typedef struct {
    double at_zero, per_signal, per_rate;
} omniroll_affine_t;

/* A drive on each wheel with modes: in each its torque is affine in a signal and in the wheel's rate, and so are the
 * event functions, which end the mode where they become positive. Modes are counted from 0. */
typedef struct {
    int signal, event_count, transition_count;
    const omniroll_affine_t *laws;      /* modes x N x (1 + events): the torque, then the event functions */
    const long long *transitions;       /* count x 3: mode, event, mode that follows                    */
    const double *wheel_rows;           /* N x 3: the wheels' speeds for each of nu                      */
    long long *modes;                   /* N                                                            */
} omniroll_modal_t;

/* A bearing whose friction is the set-valued law: of an axle, of a roller in contact, or of a free roller. The rate of a
 * free roller is a number of the core, and so is that of an axle where wheels may slip. That of a massless roller
 * follows from the state and its mode there. */
typedef struct {
    double row[3];              /* its rate for each of nu, if it follows from nu; of a roller in contact where chi is 0,
                                 * and where wheels may stand on it also of free ones, as if they were in contact */
    double sliding, holding;    /* its torque while it turns, and the largest at rest                   */
    double nearer;              /* times its row: its rate for each of nu at this instant               */
    double size;                /* if it is a number of the core: what it is rounded against. The same of a massless
                                 * roller that turns where wheels may slip; of one that sticks the torque that it came
                                 * to rest with, beyond its bound by as much as the event is located to */
    int resting;                /* whether its rate is zero                                             */
    int mode;                   /* 0 where it sticks, else the sign of its rate                         */
    int released;               /* the sign with which it has been let go at this instant, else 0       */
    double torque;              /* at this instant; out                                                 */
} omniroll_bearing_t;

/* What sticks in a phase. */
typedef struct {
    int undecided;              /* whether it must be decided anew                                      */
    int count, free;            /* bearings that stick, and directions of nu that they allow            */
    int ended;                  /* axles where wheels may slip whose mode has ended at this instant     */
    int guard_count;
    double directions[9], absent[3];    /* these directions, by columns; 0 and 1 where there is none    */
    double force[3], size[3];   /* what holds, and the sizes of the terms that it is made of            */
    double per_force[3];        /* of nu'; 0 where nothing moves                                        */
    double speed;               /* the largest |nu| at the start of a phase since the vehicle rested     */
} omniroll_hold_t;

/* A contact on ground whose friction is the set-valued law. Coefficients and directions: along the wheel's axle, and
 * along its rolling direction. */
typedef struct {
    int carries;                /* whether it has load; else it is off                                  */
    double load, at_rest;       /* in N; where loads follow from the motion, that of the vehicle at rest */
    double sliding[2], staying[2];          /* coefficients while it slips, and while it sticks         */
    double towards[2];          /* where it slips, or begins to: a unit vector                          */
    int keeps;                  /* whether that stands at an instant, since a step has found it         */
    int sticks;                 /* its mode in this phase                                               */
    int resting;                /* whether its slip is zero                                             */
    int released;               /* whether it has used its friction up at this instant                  */
} omniroll_grip_t;

/* The ground: contacts with it that may stick, and what is the same for all of them. */
typedef struct {
    int grip_count;             /* N or none                                                            */
    omniroll_grip_t *grips;
    int undecided;              /* whether the modes must be decided anew                               */
    int passed;                 /* contacts whose mode has ended at this instant                        */
    int knows_rates;            /* whether the rates at this instant have been found, where all stick   */
    double typical, friction;   /* the largest force of friction, and what it makes of nu'              */
    double settles;             /* in m/s^2: a slip comes to rest that falls faster                     */
    double reach;               /* in m, from the axis of a roller in contact to the ground where chi is 0  */
    double arms[4];             /* in m: what slip is rounded against, of v, theta', the wheels' rates, omega */
} omniroll_ground_t;

/* Bearings that may stick: first those of axles, N or none, then of the rollers in contact, N or none, last of free
 * rollers, N (n-1) or none. Of these the last core_count have rates that are numbers of the core: of free rollers, or
 * where wheels may slip of axles, and there of all rollers, of massless ones too. */
typedef struct {
    int count, axle_count, core_count;
    omniroll_bearing_t *each;
    double roller_inertia, rate_of_speed;   /* of these rollers; what such a rate is rounded against, per nu */
} omniroll_bearings_t;

/* What the caller asks. */
typedef struct {
    int impact;                 /* the law: 0 smooth, 1 impact                                          */
    double start_time;          /* added to elapsed in tau alone                                        */
    double duration;
    int bare;                   /* whether the scene has none of OFTEN_ABSENT (codegen/specialise.py)       */
    int pauses;                 /* whether the duration is no end but a pause, which changes nothing    */
    double tolerance;           /* of a step: error inside it over |nu|                                 */
    double sweep_tolerance;     /* of the iteration at the nodes: of each step; of all where there are effects  */
    double speed;               /* the |nu| that errors are measured against at least                   */
    const double *part_sizes;   /* the size at |nu| = 1 of each part of the core beside nu               */
    long long patience;         /* switches without progress in time before the run is stopped           */
} omniroll_task_t;

/* The state, in and out. */
typedef struct {
    double elapsed, carry;      /* time since the start, and its rounding, which is carried on           */
    double *nu, *chi, *pose;    /* 3, N, 3                                                              */
    double pose_carry[3];       /* the rounding of the pose, which is carried on                        */
    long long *contact;         /* N, as run/pieces.c counts                                            */
    double *core, *accounts;    /* the rest of the core, and the accounts; out                          */
    double *axial;              /* N (n-1) by place j = 2..n; free rollers only                         */
    double axial_elapsed, *core_before;     /* elapsed where that is from, and the rest of the core there   */
} omniroll_state_t;

/* What the next step knows of those before, in and out. */
typedef struct {
    int started, at_event;      /* whether there is a first row; whether a step has ended at an event    */
    double step;                /* the length to try first, 0 if unknown                                */
    double rise_nu[3], rise_over;   /* of nu' in the last step, and its length, for the next guess       */
    double phase_start;         /* elapsed at the last switch                                           */
    double first_step;          /* where wheels may slip: the last step that began at a switch, 0 if none */
    double bend_rate;           /* of a wheel, from larger ones no step passes zero: rates bend there; 0: unknown */
    double calm_step;           /* the length of a step before slips came near rest, 0 if none has        */
    double rest_error;          /* of the last step towards a rest, as if it had come there, over that allowed; 0: none */
    double fastest;             /* the largest |nu| so far                                              */
    int landed_by, landed_wheel;    /* the guard of a joint on which the last step has landed, or 0         */
    double anchor, turned;      /* elapsed at the last switch with progress; how far wheels have turned since then, */
    long long idle_switches;    /* and switches                                                         */
} omniroll_past_t;

/* What acts, where the set has effects. */
typedef struct {
    double *inputs;             /* of the kernel: values at inputs_elapsed and slopes (2 x inputs x N)   */
    double inputs_elapsed, inputs_carry;    /* the time that they are from                              */
    double *signals;            /* values and slopes of all signals, slopes before (3 x (inputs + 1) x N) */
    double next_time;           /* elapsed at the next time known beforehand                            */
    int guard_count;            /* guards: constant and slope, from inputs_elapsed on, weights of nu, and */
    double *guards;             /* the sum of the sizes of the constant's terms (count x 6)             */
    int pivot_guards;           /* of wheels that stand on their joint, behind all others               */
    long long *leads_to;        /* the mode that follows each guard, and its wheel (count x 2)          */
    long long *passed;          /* out: which guards are passed, as the caller is to say                 */
    int asks;                   /* whether the caller gives new inputs at each event; else these act:    */
    int table_count, sampler_count, modal_count;
    omniroll_table_t *tables;
    omniroll_sampler_t *samplers;
    omniroll_modal_t *modal;    /* one or none                                                          */
} omniroll_acting_t;

/* The pieces of each roller: 1 and more of them where it has several arcs. */
typedef struct {
    int count;
    const double *ends;         /* the wheel's angles between which each carries (count x 2)               */
    const omniroll_model *const *models;    /* for each the vehicle with all wheels on it                   */
} omniroll_pieces_t;

/* What the caller gets: rows, switches, counts, errors. Rows: elapsed, nu, chi, pose, the rest of the core, accounts,
 * contact, modes of bearings, inputs (7 + 2 N numbers and what the set adds); a row for each end of a step, and one
 * after each transition that changes a number before the modes or an input. Modes are those of the step that starts at
 * a row, else of the phase that ends. Steps: for the step that starts at a row, the length of its polynomials, 0 if
 * none starts there, how much later it ends, and the Legendre coefficients of the rates of nu, chi, pose and so on
 * (2 + 16 (6 + N) numbers and more). */
typedef struct {
    double *rows, *steps;       /* steps may be null                                                    */
    long long row_capacity, row_count;
    double *switches;           /* elapsed, row after, directions (2 + N numbers)                        */
    double *switch_axial;       /* axial after the switch, N (n-1); free rollers only                    */
    long long switch_capacity, switch_count;
    long long step_count, rejected_count, sweep_count, phase_count;
    double step_error;          /* the largest error inside a step, over |nu|, as its polynomial tells  */
    double sweep_error;         /* what the iterations of all steps leave, over |nu|                    */
    int hardest_part;           /* where no step is short enough: the part of the core that it misses, -1: nu */
    int stopped_wheel;          /* of the wheel that kept the run from going on, or -1                   */
} omniroll_record_t;

typedef struct {
    int wheels, rollers_per_wheel;              /* of the wheel that has most                           */
    const long long *rollers;   /* N: rollers of each wheel                                             */
    double *joint;              /* N: pi/n of each wheel; in a call half of the piece that carries it    */
    double *wheel_rows;         /* of wheels with two rows: their rates for each of nu, N x 3           */
    omniroll_pieces_t pieces;
    omniroll_task_t task;
    omniroll_state_t state;
    omniroll_past_t past;
    omniroll_acting_t acts;
    omniroll_bearings_t bearings;
    omniroll_hold_t hold;
    omniroll_ground_t ground;
    omniroll_record_t record;
    double *work;               /* omniroll_run_work_size() doubles, aligned to 64 bytes; kept between calls */
} omniroll_run_t;

enum {
    OMNIROLL_RUN_DONE = 0,          /* the duration is over                                                 */
    OMNIROLL_RUN_FULL = 1,          /* no room for more rows or switches: empty them and call again         */
    OMNIROLL_RUN_STUCK = 2,         /* patience is at its end: switches without progress in time            */
    OMNIROLL_RUN_NO_STEP = 3,       /* no step is short enough                                              */
    OMNIROLL_RUN_ASK = 4,           /* the caller takes the samples that have come; or, where it gives the inputs: a
                                     * guard is passed or next_time has come. Then call again                  */
    OMNIROLL_RUN_WHEELS = 5,        /* the library is compiled for another number of wheels                 */
    OMNIROLL_RUN_UNLAWFUL = 6,      /* what sticks takes more than it can: a fault of the engine              */
};

/* Phases, events and transitions until the duration is over or there is no more room; returns one of the above. */
int omniroll_run(omniroll_run_t *run, const omniroll_model *model);

/* The same of `count` runs, one after the other. statuses (count): what omniroll_run returns for each of them. */
void omniroll_run_each(long long count, omniroll_run_t *const *runs, const omniroll_model *const *models,
                       int *statuses);

/* One of many runs of a vehicle that pause, and go on together with new voltages (members.c). */
typedef struct {
    omniroll_run_t *run;
    double *volts;              /* N: where the run reads its motors' voltages                           */
} omniroll_member_t;

/* The members `which` (count) go on, each to its time `until` since its start with its `volts` (N each). statuses
 * (count): what omniroll_run returns for each of them. until and volts are those of all members. */
void omniroll_run_members(long long count, const long long *which, const omniroll_member_t *members,
                          const omniroll_model *model, const double *until, const double *volts, int *statuses);

/* nu (count x 3) and chi (count x N) of all members. */
void omniroll_read_members(long long count, const omniroll_member_t *members, double *nu, double *chi);

/* The rows and steps of finished runs. contact: its first column in a row. */
typedef struct {
    int wheels, contact;
    long long count, row_size, step_size;
    const double *rows, *steps;
} omniroll_course_t;

/* How far two runs are apart: the largest distance of ((x, y)/radius, theta, nu/speed) at the ends of the coarse one's
 * steps, as long as both last. */
double omniroll_distance(const omniroll_course_t *coarse, const omniroll_course_t *fine, double radius, double speed);

/* Doubles that run->work needs. */
long long omniroll_run_work_size(int wheels, int rollers_per_wheel);

/* How many bearings have a mode in each row: those of run->bearings.each, in their order. */
long long omniroll_run_modes(int wheels, int rollers_per_wheel);

/* The names of the numbers that the set adds to a row, in their order, with spaces between. */
const char *omniroll_run_states(void);
const char *omniroll_run_inputs(void);

/* nu' of many vehicles, arrays by component (batch.c). constants: the blocks of one vehicle (shared), or of all.
 * Returns 1 where the library is compiled for another number of wheels. */
int omniroll_forward_dynamics_batch(long long count, int wheels, int rollers_per_wheel, const double *constants, int shared,
                           const double *nu, const double *chi, const double *momenta, double *nu_dot);

/* The constants of `count` vehicles in blocks: how many doubles, aligned to 128 bytes, and what stands there. */
long long omniroll_blocks_size(long long count, int wheels, int rollers_per_wheel);
void omniroll_fill_blocks(long long count, const omniroll_model *const *models, double *blocks);
