/* Elements of friction at an instant, decided together.
 *
 * An element has one or two rows of speeds, a force along them, and a set that its force does not leave. Forces y and
 * accelerations a = Q y + q of the rows obey the law of friction where
 *
 *     y^T Q y/2 + q^T y is least, y_e in K_e [and E y = h]
 *
 * Q is the Delassus matrix G M^-1 G^T, symmetric and positive semidefinite; q are the accelerations without these
 * forces. An element whose acceleration is zero is at rest; one that moves has its force on the boundary of its set,
 * against its motion.
 *
 * Rows that stand apart meet the others through one acceleration alone, yaw'' = yaw_rows^T y + yaw_yaw s^T y_apart
 * beside what acts without these forces. Theirs are a_k = mobility_k y_k + s_k yaw'' + given_k, those of the others
 * have yaw_rows s^T y_apart more; their sets are intervals. They are eliminated one by one.
 *
 * Nothing is allocated: the caller gives friction_memory() bytes. Who compiles these files says with FRICTION_LINKAGE who
 * sees their functions: `static inline` as a part of an engine, nothing as a library. */
#ifndef OMNIROLL_FRICTION_ELEMENTS_H
#define OMNIROLL_FRICTION_ELEMENTS_H

#include <stddef.h>

typedef enum {
    FRICTION_FIXED,             /* any force: the rows never move                                          */
    FRICTION_INTERVAL,          /* 1 row: |y| <= size[0]                                                    */
    FRICTION_ELLIPSE            /* 2 rows: (y_0/size[0])^2 + (y_1/size[1])^2 <= 1, and |y_0| <= strip       */
} friction_kind_t;

typedef struct {
    friction_kind_t kind;
    int first, rows;            /* of the dense rows                                                        */
    double size[2], strip;      /* N, N m; `strip` is INFINITY where nothing cuts the ellipse              */
} friction_element_t;

typedef struct {
    int rows, elements, apart, equalities;
    friction_element_t *element;
    double *matrix, *given;                         /* Q, rows x rows, and q                                */
    double *equality, *wanted;                      /* E, equalities x rows, and h                          */
    double *mobility, *yaw, *apart_given, *bound;   /* of rows apart: 1/inertia, s, and sizes               */
    double *yaw_rows;                               /* of the dense rows; null without rows apart           */
    double yaw_yaw;
} friction_problem_t;

typedef enum {
    FRICTION_RESTS = 0,
    FRICTION_SLIPS = 1,         /* the force is on the ellipse, or at an end of the interval                */
    FRICTION_YIELDS = 2         /* the force is at the edge of the strip                                    */
} friction_state_t;

/* What a problem's solution is; the caller gives the arrays. */
typedef struct {
    double *force, *acceleration;                   /* rows, then rows apart                                */
    int *state;                                     /* elements, then rows apart: a sum of friction_state_t */
    double *pull;                                   /* two of each element, then rows apart: the power that moves over
                                                     * the ellipse and over the edge of the strip, W        */
    double residual;                                /* of the law, over the size of its terms               */
    int iterations;
    int unique;                                     /* whether no other forces obey the law                 */
} friction_solution_t;

/* Bytes of memory that a problem of these sizes needs. */
FRICTION_LINKAGE size_t friction_memory(int rows, int elements, int apart, int equalities);

/* Decides all elements together; forces that are not unique are those of least norm. Returns 1; 0 where a number of the
 * problem is not finite, and then all forces are zero. */
FRICTION_LINKAGE int friction_decide(const friction_problem_t *problem, void *memory, friction_solution_t *found);

/* The least u with E y = h and y_e in u K_e, with such forces: matrix and given are not read. */
FRICTION_LINKAGE double friction_least_use(const friction_problem_t *problem, void *memory, friction_solution_t *found);

/* The rate of the least use that friction_least_use() has just found in this memory, where E and h of the same problem
 * change so that `change` is the rate of h - E y with y held. */
FRICTION_LINKAGE double friction_use_rate(const friction_problem_t *problem, void *memory, const double *change);

#endif
