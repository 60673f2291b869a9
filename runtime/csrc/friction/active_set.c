/* Newton's rule on the conditions of an active set, in residual form.
 *
 * A force on its circle turns along it, one at the end of an interval or of a strip stays; all others move freely. The
 * system is the second derivative along these directions, symmetric, and singular where forces are not unique: then
 * what no condition tells does not move. */
#include <math.h>
#include <string.h>

#include "balls.h"

#define ROUNDS 12                   /* of Newton's rule on one                                              */
#define SINGULAR 1e-13              /* pivots of a matrix with ones on its diagonal                         */
#define LARGEST_TURN 0.3              /* a force turns by at most so much in a round                          */
#define ROUNDING 4.5e-16
#define BEYOND 1e-14                /* of a ball's size, and of a pull's                                    */

static int is_edge(const friction_balls_t *b, int i)
{
    return b->active[2*i + 1];
}

/* How strongly a force on its circle is pulled against its slope; of one in a corner of its strip by the circle. */
FRICTION_LINKAGE double friction_pull(const friction_balls_t *b, int i)
{
    const double *const x = b->force + b->ball[i].first, *const slope = b->slope + b->ball[i].first;
    if (b->ball[i].rows == 1)
        return -x[0]*slope[0];
    if (is_edge(b, i))
        return x[1] != 0 ? -slope[1]/x[1] : 0;
    return -(x[0]*slope[0] + x[1]*slope[1]);
}

/* The same by the strip. */
FRICTION_LINKAGE double friction_pull_of_strip(const friction_balls_t *b, int i)
{
    const double *const x = b->force + b->ball[i].first, *const slope = b->slope + b->ball[i].first;
    const double circle = b->active[2*i] ? friction_pull(b, i) : 0;
    return -x[0]*(slope[0] + circle*x[0]);
}

/* Forces that their constraints hold are put there. */
static void put_on_edges(friction_balls_t *b)
{
    for (int i = 0; i < b->balls; i++) {
        double *const x = b->force + b->ball[i].first;
        const double strip = b->ball[i].strip;
        if (b->ball[i].rows == 1 && b->active[2*i])
            x[0] = x[0] < 0 ? -1 : 1;
        if (b->ball[i].rows != 2)
            continue;
        if (is_edge(b, i)) {
            x[0] = copysign(strip, x[0]);
            if (b->active[2*i])
                x[1] = copysign(sqrt((1 - strip)*(1 + strip)), x[1]);
        }
        else if (b->active[2*i]) {
            const double length = sqrt(x[0]*x[0] + x[1]*x[1]);
            if (length > 0)
                x[0] /= length, x[1] /= length;
            else
                x[0] = 1;
        }
    }
}

static void put_direction(friction_balls_t *b, int i, int row, int rows, double one, double two)
{
    const friction_direction_t direction = {b->ball[i].first + row, rows, {one, two}};
    b->direction[b->directions++] = direction;
}

/* The directions in which forces may move, and the curvature of the circles. */
static void put_directions(friction_balls_t *b)
{
    b->directions = 0;
    for (int k = 0; k < 4*b->dense_balls + b->apart; k++)
        b->block[k] = 0;
    for (int k = 0; k < b->apart; k++)
        b->moves[k] = b->ball[b->dense_balls + k].rows && !b->active[2*(b->dense_balls + k)];
    for (int i = 0; i < b->dense_balls; i++) {
        const double *const x = b->force + b->ball[i].first;
        const int circle = b->active[2*i], edge = is_edge(b, i);
        if (b->ball[i].rows == 2 && circle && !edge) {
            b->block[4*i] = b->block[4*i + 3] = fmax(friction_pull(b, i), 0);
            put_direction(b, i, 0, 2, -x[1], x[0]);
            continue;
        }
        for (int k = 0; k < b->ball[i].rows && !circle; k++)
            if (!(edge && k == 0))
                put_direction(b, i, k, 1, 1, 0);
    }
}

/* One round of Newton's rule; returns the largest change of a bounded force. */
static double improve(friction_balls_t *b)
{
    double largest = 0;
    put_directions(b);
    friction_factor_step(b, SINGULAR);
    for (int k = 0; k < b->rows; k++)
        b->right[k] = -b->slope[k];
    for (int e = 0; e < b->equalities; e++) {
        b->right[b->rows + e] = b->wanted[e];
        for (int k = 0; k < b->dense; k++)
            b->right[b->rows + e] -= b->equality[e*b->dense + k]*b->force[k];
    }
    friction_find_step(b);
    for (int i = 0; i < b->balls; i++)
        for (int k = 0; k < b->ball[i].rows && b->ball[i].bounded; k++)
            largest = fmax(largest, fabs(b->step[b->ball[i].first + k]));
    const double part = largest > LARGEST_TURN ? LARGEST_TURN/largest : 1;
    for (int k = 0; k < b->rows; k++)
        b->force[k] += part*b->step[k];
    for (int e = 0; e < b->equalities; e++)
        b->multiplier[e] += part*b->multiplier_step[e];
    put_on_edges(b);
    friction_slopes(b);
    return largest;
}

/* Keeps forces and their active set if their residual is the least so far. */
static void keep_best(friction_balls_t *b)
{
    const double residual = friction_residual(b);
    if (!(residual < b->least))
        return;
    b->least = residual;
    memcpy(b->kept.best, b->force, b->kept.best_size);
}

/* Constraints that forces have passed, and those that hold nothing; returns how many. */
static int change_active(friction_balls_t *b)
{
    int changes = 0;
    for (int i = 0; i < b->balls; i++) {
        const friction_ball_t *const ball = b->ball + i;
        const double *const x = b->force + ball->first;
        const double least = BEYOND*b->scale[i];
        if (!ball->bounded || !ball->rows)
            continue;
        const double length = ball->rows == 1 ? fabs(x[0]) : sqrt(x[0]*x[0] + x[1]*x[1]);
        const int circle = b->active[2*i] ? friction_pull(b, i) >= -least : length > 1 + BEYOND;
        const int cut = ball->rows == 2 && ball->strip < 1;
        const int edge = cut && (is_edge(b, i) ? friction_pull_of_strip(b, i) >= -least
                                               : fabs(x[0]) > ball->strip*(1 + BEYOND));
        changes += (circle != b->active[2*i]) + (edge != b->active[2*i + 1]);
        b->active[2*i] = circle, b->active[2*i + 1] = edge;
    }
    return changes;
}

FRICTION_LINKAGE void friction_polish(friction_balls_t *b, int changes)
{
    memcpy(b->kept.inside, b->force, b->kept.inside_size);
    for (int change = 0; change <= changes; change++) {
        double before = INFINITY;
        put_on_edges(b);
        friction_slopes(b);
        keep_best(b);
        for (int round = 0; round < ROUNDS; round++) {
            const double step = improve(b);
            keep_best(b);
            if (b->least <= ROUNDING || !(step > ROUNDING) || (round > 2 && !(step < before/2)))
                break;
            before = step;
        }
        if (b->least <= ROUNDING || !change_active(b))
            break;
    }
}

FRICTION_LINKAGE void friction_take_best(friction_balls_t *b)
{
    if (b->least < INFINITY)
        memcpy(b->force, b->kept.best, b->kept.best_size);
    friction_slopes(b);
}
