/* The problem of elements.h with sets of size 1, and Newton's steps on it. */
#ifndef OMNIROLL_FRICTION_BALLS_H
#define OMNIROLL_FRICTION_BALLS_H

#include <stddef.h>

#include "elimination.h"

/* A set of forces: |x| <= 1 in one or two rows, and |x_0| <= strip. Rows apart are counted behind the dense ones. */
typedef struct {
    int first, rows;            /* no rows: nothing to decide                                               */
    int bounded;
    double strip;               /* 1 or more: none                                                          */
} friction_ball_t;

/* A direction in which forces may change: along up to two neighbouring rows. */
typedef struct {
    int first, rows;
    double along[2];
} friction_direction_t;

/* Copies of x, of multipliers and, of the best, of the active set, which stand together; their sizes in bytes. */
typedef struct {
    double *best, *inside;
    size_t best_size, inside_size;
} friction_kept_t;

/* x^T matrix x/2 + given^T x is least; `size` is what a force's unit is in x. */
typedef struct {
    int dense, apart, rows, balls, dense_balls, equalities;     /* rows: dense + apart                      */
    friction_ball_t *ball;
    double *size, *matrix, *given, *equality, *wanted, *mobility, *yaw, *yaw_rows, yaw_yaw;
    double *force, *multiplier, *slope, *scale;     /* x, those of equalities, slopes, sizes of balls' terms */
    double *slack, *pull;                           /* two of each ball: its circle and its strip           */
    double *slack_step, *pull_step, *product, *step, *multiplier_step;
    friction_kept_t kept;
    double *block, *coupled, *right;                /* block: 4 of each dense ball, 1 of each row apart     */
    int *active, *moves;                            /* two of each ball; rows apart that may change         */
    friction_direction_t *direction;
    int directions;
    double unit;                                    /* what products are measured by                        */
    double least;                                   /* residual of what has met the law best                */
    double yaw_held;                                /* what rows apart that may change take of yaw          */
    friction_system_t system;
} friction_balls_t;

/* slope = matrix x + given + E^T multiplier, with rows apart. */
FRICTION_LINKAGE void friction_slopes(friction_balls_t *balls);

/* Factors the matrix along the directions, with the blocks added. */
FRICTION_LINKAGE void friction_factor_step(friction_balls_t *balls, double least);

/* The change of x and of the multipliers for the right side `right`, rows and then equalities. */
FRICTION_LINKAGE void friction_find_step(friction_balls_t *balls);

/* The residual of the law at x, over the size of its terms: x - P(x - slope/scale), P onto the sets. */
FRICTION_LINKAGE double friction_residual(friction_balls_t *balls);

/* A start in the middle of all balls, with an empty active set. */
FRICTION_LINKAGE void friction_begin(friction_balls_t *balls);

/* Rounds from inside until products of slack and pull are `target` of the problem's size, and the active set that they
 * tell. Returns how many. */
FRICTION_LINKAGE int friction_go_inside(friction_balls_t *balls, double target, int rounds);

/* Newton's rule on the conditions of the active set, which changes up to so many times where a condition fails. What
 * has met the law best of all is kept, with its residual, and the inside for further rounds. */
FRICTION_LINKAGE void friction_polish(friction_balls_t *balls, int changes);

/* What has met the law best, into x. */
FRICTION_LINKAGE void friction_take_best(friction_balls_t *balls);

/* How strongly a force on its circle, or at the edge of its strip, is pulled against its slope. */
FRICTION_LINKAGE double friction_pull(const friction_balls_t *balls, int ball);
FRICTION_LINKAGE double friction_pull_of_strip(const friction_balls_t *balls, int ball);

#endif
