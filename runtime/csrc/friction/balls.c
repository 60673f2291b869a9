/* Slopes, residuals and Newton's steps of the problem with sets of size 1. */
#include <math.h>

#include "balls.h"

/* s^T x: the moment about the yaw axis of the rows apart. */
static double yaw_moment(const friction_balls_t *b)
{
    double sum = 0;
    for (int k = 0; k < b->apart; k++)
        sum += b->yaw[k]*b->force[b->dense + k];
    return sum;
}

FRICTION_LINKAGE void friction_slopes(friction_balls_t *b)
{
    const double moment = yaw_moment(b);
    double yaw = b->yaw_yaw*moment;
    for (int k = 0; k < b->dense; k++) {
        long double sum = b->given[k];          /* forces all but balance: their sum needs all its digits      */
        for (int l = 0; l < b->dense; l++)
            sum += (long double)b->matrix[k*b->dense + l]*b->force[l];
        for (int e = 0; e < b->equalities; e++)
            sum += (long double)b->equality[e*b->dense + k]*b->multiplier[e];
        b->slope[k] = (double)sum;
        if (b->apart)
            b->slope[k] += b->yaw_rows[k]*moment, yaw += b->yaw_rows[k]*b->force[k];
    }
    for (int k = 0; k < b->apart; k++) {
        const int row = b->dense + k;
        b->slope[row] = b->mobility[k]*b->force[row] + b->yaw[k]*yaw + b->given[row];
    }
}

/* The sizes of the terms of the yaw moment of rows apart, and of the yaw's acceleration. */
static void sizes_of_yaw(const friction_balls_t *b, double *moment, double *yaw)
{
    *moment = *yaw = 0;
    for (int k = 0; k < b->apart; k++)
        *moment += fabs(b->yaw[k]*b->force[b->dense + k]);
    for (int l = 0; l < b->dense && b->apart; l++)
        *yaw += fabs(b->yaw_rows[l]*b->force[l]);
    *yaw += b->yaw_yaw**moment;
}

static double largest_number(int count, const double *numbers)
{
    double largest = 0;
    for (int k = 0; k < count; k++)
        largest = fmax(largest, fabs(numbers[k]));
    return largest;
}

/* The size of the terms of one row. Multipliers of equalities are each rounded as the largest of them. */
static double size_of_terms(const friction_balls_t *b, int row, double moment, double yaw)
{
    const double pulls = largest_number(b->equalities, b->multiplier);
    double size = fabs(b->given[row]);
    if (row >= b->dense) {
        const int k = row - b->dense;
        return size + fabs(b->mobility[k]*b->force[row]) + fabs(b->yaw[k])*yaw;
    }
    for (int l = 0; l < b->dense; l++)
        size += fabs(b->matrix[row*b->dense + l]*b->force[l]);
    for (int e = 0; e < b->equalities; e++)
        size += fabs(b->equality[e*b->dense + row])*pulls;
    return b->apart ? size + fabs(b->yaw_rows[row])*moment : size;
}

/* The point of a ball that is nearest to v, into its place. */
static void project(const friction_ball_t *ball, double *v)
{
    if (ball->rows == 1) {
        v[0] = fmax(-1, fmin(1, v[0]));
        return;
    }
    const double length = sqrt(v[0]*v[0] + v[1]*v[1]), shorter = length > 1 ? 1/length : 1;
    if (fabs(v[0]*shorter) <= ball->strip) {
        v[0] *= shorter, v[1] *= shorter;
        return;
    }
    const double largest = sqrt((1 - ball->strip)*(1 + ball->strip));
    v[0] = copysign(ball->strip, v[0]), v[1] = fmax(-largest, fmin(largest, v[1]));
}

FRICTION_LINKAGE double friction_residual(friction_balls_t *b)
{
    const double forces = largest_number(b->dense, b->force);
    double largest = 0, moment, yaw;
    sizes_of_yaw(b, &moment, &yaw);
    for (int i = 0; i < b->balls; i++) {
        const friction_ball_t *const ball = b->ball + i;
        double size = 0, place[2] = {0, 0};
        for (int k = 0; k < ball->rows; k++)
            size = fmax(size, size_of_terms(b, ball->first + k, moment, yaw));
        size = size > 0 ? size : 1;
        for (int k = 0; k < ball->rows; k++)
            place[k] = b->force[ball->first + k] - b->slope[ball->first + k]/size;
        if (ball->bounded && ball->rows)
            project(ball, place);
        for (int k = 0; k < ball->rows; k++) {
            const double off = fabs(b->force[ball->first + k] - place[k]);
            largest = off <= largest ? largest : off;           /* not a number: kept                     */
        }
    }
    for (int e = 0; e < b->equalities; e++) {
        double off = -b->wanted[e], size = fabs(b->wanted[e]);
        for (int k = 0; k < b->dense; k++) {
            off += b->equality[e*b->dense + k]*b->force[k];
            size += fabs(b->equality[e*b->dense + k])*forces;
        }
        off = size > 0 ? fabs(off)/size : 0;
        largest = off <= largest ? largest : off;
    }
    return largest;
}

/* What the rows apart add to the dense matrix, with all blocks, into `coupled`. */
static void couple(friction_balls_t *b)
{
    const int n = b->dense;
    double held = 0;
    for (int k = 0; k < b->apart; k++)
        if (b->moves[k])
            held += b->yaw[k]*b->yaw[k]/(b->mobility[k] + b->block[4*b->dense_balls + k]);
    b->yaw_held = held;
    const double factor = held/(1 + b->yaw_yaw*held);
    for (int k = 0; k < n; k++)
        for (int l = 0; l < n; l++)
            b->coupled[k*n + l] = b->matrix[k*n + l] - (b->apart ? factor*b->yaw_rows[k]*b->yaw_rows[l] : 0);
    for (int i = 0; i < b->dense_balls; i++)
        for (int k = 0; k < b->ball[i].rows; k++)
            for (int l = 0; l < b->ball[i].rows; l++)
                b->coupled[(b->ball[i].first + k)*n + b->ball[i].first + l] += b->block[4*i + 2*k + l];
}

FRICTION_LINKAGE void friction_factor_step(friction_balls_t *b, double least)
{
    const int n = b->dense, count = b->directions, size = count + b->equalities;
    double *const m = b->system.matrix;
    couple(b);
    b->system.size = size;
    for (int i = 0; i < count; i++) {
        const friction_direction_t *const one = b->direction + i;
        for (int j = 0; j < count; j++) {
            const friction_direction_t *const two = b->direction + j;
            double sum = 0;
            for (int k = 0; k < one->rows; k++)
                for (int l = 0; l < two->rows; l++)
                    sum += one->along[k]*two->along[l]*b->coupled[(one->first + k)*n + two->first + l];
            m[i*size + j] = sum;
        }
        for (int e = 0; e < b->equalities; e++) {
            double sum = 0;
            for (int k = 0; k < one->rows; k++)
                sum += one->along[k]*b->equality[e*n + one->first + k];
            m[i*size + count + e] = m[(count + e)*size + i] = sum;
        }
    }
    for (int e = 0; e < b->equalities; e++)
        for (int f = 0; f < b->equalities; f++)
            m[(count + e)*size + count + f] = 0;
    friction_factor(&b->system, least);
}

FRICTION_LINKAGE void friction_find_step(friction_balls_t *b)
{
    const int n = b->dense;
    const double inertia = 1 + b->yaw_yaw*b->yaw_held;
    double *const reduced = b->coupled, pushed = 0, yaw;         /* the matrix is factored: its room is free  */
    for (int k = 0; k < b->apart; k++)
        if (b->moves[k])
            pushed += b->yaw[k]*b->right[n + k]/(b->mobility[k] + b->block[4*b->dense_balls + k]);
    for (int i = 0; i < b->directions; i++) {
        const friction_direction_t *const one = b->direction + i;
        reduced[i] = 0;
        for (int k = 0; k < one->rows; k++) {
            const int row = one->first + k;
            reduced[i] += one->along[k]*(b->right[row] - (b->apart ? b->yaw_rows[row]*pushed/inertia : 0));
        }
    }
    for (int e = 0; e < b->equalities; e++)
        reduced[b->directions + e] = b->right[b->rows + e];
    friction_solve(&b->system, reduced);
    for (int k = 0; k < b->rows; k++)
        b->step[k] = 0;
    for (int i = 0; i < b->directions; i++)
        for (int k = 0; k < b->direction[i].rows; k++)
            b->step[b->direction[i].first + k] += b->direction[i].along[k]*reduced[i];
    for (int e = 0; e < b->equalities; e++)
        b->multiplier_step[e] = reduced[b->directions + e];
    yaw = b->yaw_yaw*pushed;
    for (int k = 0; k < n && b->apart; k++)
        yaw += b->yaw_rows[k]*b->step[k];
    yaw /= inertia;
    for (int k = 0; k < b->apart; k++)
        if (b->moves[k])
            b->step[n + k] = (b->right[n + k] - b->yaw[k]*yaw)/(b->mobility[k] + b->block[4*b->dense_balls + k]);
}
