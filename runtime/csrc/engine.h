/* A run of the compiled engine: what the caller gives, what it gets back. See phase.c and batch.c. */
#ifndef OMNIROLL_ENGINE_H
#define OMNIROLL_ENGINE_H

typedef struct {
    int wheels, rollers_per_wheel;
    int impact;                 /* the law: 0 smooth, 1 impact                                          */
    double start_time;          /* added to elapsed in tau alone                                        */
    double duration;
    double tolerance;           /* of a step: error inside it over |nu|                                 */
    double sweep_tolerance;     /* of the iteration at the nodes                                        */
    double joint;               /* pi/n                                                                 */
    long long patience;         /* switches without progress in time before the run is stopped           */

    /* The state, in and out. */
    double elapsed, carry;      /* time since the start, and what its rounding has left over            */
    double step;                /* the length to try first, 0 if unknown                                */
    double phase_start;         /* elapsed at the last switch                                           */
    double *nu, *chi, *pose;    /* 3, N, 3                                                              */
    double *axial;              /* N (n-1) by place j = 2..n; free rollers only                         */
    long long *contact;         /* N                                                                    */

    double *work;               /* omniroll_<set>_run_work_size() doubles, aligned to 64 bytes           */

    /* Rows: elapsed, nu, chi, pose, contact (7 + 2 N numbers); a row for each end of a step and one after each switch.
     * Steps: for the step that starts at a row, the length of its polynomials, how much later it ends, and the Legendre
     * coefficients of nu', chi' and pose' (2 + 16 (6 + N) numbers). */
    double *rows, *steps;       /* steps may be null                                                    */
    long long row_capacity, row_count;
    double *switches;           /* elapsed, row after, directions (2 + N numbers)                        */
    double *switch_axial;       /* axial after the switch, N (n-1); free rollers only                    */
    long long switch_capacity, switch_count;

    long long step_count, rejected_count, sweep_count, idle_switches;
    double anchor;              /* elapsed at the last switch with progress                             */
} omniroll_run_t;

enum {
    OMNIROLL_DONE = 0,          /* the duration is over                                                 */
    OMNIROLL_FULL = 1,          /* no room for more rows or switches: empty them and call again         */
    OMNIROLL_STUCK = 2,         /* patience is at its end: switches without progress in time            */
    OMNIROLL_NO_STEP = 3        /* no step is short enough                                              */
};

#endif
