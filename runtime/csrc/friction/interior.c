/* The minimum over balls from their inside: Mehrotra's predictor and corrector.
 *
 * Each ball has a slack s = (1 - |x|^2)/2 and a pull p, with slope = -p x where it is on its circle; a strip has the
 * same of its first row. Products p s fall together, all alike: an acceleration that is small beside those of light
 * rollers decides as well as theirs. Forces stay inside: slacks are what they leave. */
#include <math.h>

#include "balls.h"

#define STEADIES 1e-15              /* of the diagonal, more: what no slope depends on does not move        */
#define STAYS_INSIDE 0.95           /* of the step to the edge of p > 0 and s > 0                           */
#define LEAST_SLACK 1e-17           /* of a ball's size: with less rounding would tell                      */
#define SHORT 0.5                   /* of a step: less of it leads nowhere                                  */
#define RECENTRES 0.3               /* of the mean product: what such a step leaves                         */
#define SHORTEST 1e-6               /* of a step: rounding stops the rounds                                 */

/* The weight of a constraint, 0 of a ball and 1 of a strip, on a row's square; 0: no such constraint. */
static double weight_in(const friction_ball_t *ball, int strip, int row)
{
    if (!ball->bounded || row >= ball->rows)
        return 0;
    if (!strip)
        return 1;
    return ball->rows == 2 && ball->strip < 1 && row == 0 ? 1/(ball->strip*ball->strip) : 0;
}

static int has_constraint(const friction_ball_t *ball, int strip)
{
    return weight_in(ball, strip, 0) > 0;
}

/* The sizes of what acts on balls, the largest of which measures all products, and a start in the middle of all. */
FRICTION_LINKAGE void friction_begin(friction_balls_t *b)
{
    double largest = 0;
    for (int i = 0; i < b->balls; i++) {
        b->scale[i] = 0;
        for (int k = b->ball[i].first; k < b->ball[i].first + b->ball[i].rows; k++) {
            double size = fabs(b->given[k]);
            for (int l = 0; l < b->dense && k < b->dense; l++)
                size += fabs(b->matrix[k*b->dense + l]);
            if (k >= b->dense)
                size += b->mobility[k - b->dense];
            b->scale[i] = fmax(b->scale[i], size);
        }
        largest = fmax(largest, b->scale[i]);
    }
    b->unit = largest > 0 ? largest : 1;
    for (int i = 0; i < b->balls; i++) {
        b->scale[i] = b->scale[i] > 0 ? b->scale[i] : b->unit;
        for (int strip = 0; strip < 2; strip++) {
            b->slack[2*i + strip] = 0.5, b->pull[2*i + strip] = b->unit;
            b->active[2*i + strip] = 0;
        }
    }
    for (int k = 0; k < b->rows; k++)
        b->force[k] = 0;
    for (int e = 0; e < b->equalities; e++)
        b->multiplier[e] = 0;
    b->least = INFINITY;
}

/* The mean of all products, over the unit. */
static double mean_product(const friction_balls_t *b)
{
    int count = 0;
    double sum = 0;
    for (int i = 0; i < b->balls; i++)
        for (int strip = 0; strip < 2; strip++)
            if (has_constraint(b->ball + i, strip))
                count++, sum += b->pull[2*i + strip]*b->slack[2*i + strip]/b->unit;
    return count ? sum/count : 0;
}

/* x^T W y/2 of a constraint, rows of x and y from its ball on. */
static double half_product(const friction_ball_t *ball, int strip, const double *x, const double *y)
{
    double twice = 0;
    for (int k = 0; k < ball->rows; k++)
        twice += weight_in(ball, strip, k)*x[ball->first + k]*y[ball->first + k];
    return twice/2;
}

/* All rows are free to move; blocks are the second derivatives of the balls, weighed by p/s. */
static void put_blocks(friction_balls_t *b)
{
    b->directions = 0;
    for (int k = 0; k < 4*b->dense_balls + b->apart; k++)
        b->block[k] = 0;
    for (int k = 0; k < b->apart; k++)
        b->moves[k] = b->ball[b->dense_balls + k].rows;
    for (int i = 0; i < b->balls; i++) {
        const friction_ball_t *const ball = b->ball + i;
        double *const block = b->block + (i < b->dense_balls ? 4*i : 4*b->dense_balls + i - b->dense_balls);
        for (int k = 0; k < ball->rows; k++) {
            const int row = ball->first + k;
            if (i < b->dense_balls) {
                const friction_direction_t direction = {row, 1, {1, 0}};
                b->direction[b->directions++] = direction;
                block[3*k] += STEADIES*(b->matrix[row*b->dense + row] + b->scale[i]);
            }
            for (int strip = 0; strip < 2; strip++) {
                const double p = b->pull[2*i + strip], s = b->slack[2*i + strip];
                const double weight = weight_in(ball, strip, k);
                block[3*k] += p*weight;
                for (int l = 0; l < ball->rows; l++)
                    block[2*k + l] += p/s*weight*b->force[row]*weight_in(ball, strip, l)*b->force[ball->first + l];
            }
        }
    }
}

/* A step towards products of size `target`. The corrector knows the predictor's step, and by how much the products and
 * slopes behind it miss what is linear, of which it takes the part `corrects`. */
static void find_step(friction_balls_t *b, double target, double corrects)
{
    for (int k = 0; k < b->rows; k++)
        b->right[k] = -b->slope[k];
    for (int e = 0; e < b->equalities; e++) {
        b->right[b->rows + e] = b->wanted[e];
        for (int k = 0; k < b->dense; k++)
            b->right[b->rows + e] -= b->equality[e*b->dense + k]*b->force[k];
    }
    for (int i = 0; i < b->balls; i++)
        for (int strip = 0; strip < 2; strip++) {
            const int c = 2*i + strip;
            double product = target*b->unit;
            if (corrects > 0)
                product += corrects*(b->pull[c]*half_product(b->ball + i, strip, b->step, b->step)
                    - b->slack_step[c]*b->pull_step[c]);
            for (int k = 0; k < b->ball[i].rows; k++) {     /* p + dp without what dx adds is product/slack     */
                const int row = b->ball[i].first + k;
                const double bends = corrects > 0 ? corrects*b->pull_step[c]*b->step[row] : 0;
                b->right[row] -= weight_in(b->ball + i, strip, k)*(product/b->slack[c]*b->force[row] + bends);
            }
            b->product[c] = product;
        }
    friction_find_step(b);
    for (int i = 0; i < b->balls; i++)
        for (int strip = 0; strip < 2; strip++) {
            const int c = 2*i + strip;
            b->slack_step[c] = -2*half_product(b->ball + i, strip, b->force, b->step);
            b->pull_step[c] = (b->product[c] - b->pull[c]*(b->slack[c] + b->slack_step[c]))/b->slack[c];
        }
}

/* How much of the step leaves all slacks and pulls positive. */
static double part_inside(const friction_balls_t *b)
{
    double part = 1;
    for (int i = 0; i < b->balls; i++)
        for (int strip = 0; strip < 2; strip++) {
            const int c = 2*i + strip;
            if (!has_constraint(b->ball + i, strip))
                continue;
            const double slope = b->slack_step[c], bend = half_product(b->ball + i, strip, b->step, b->step);
            const double falls = sqrt(slope*slope + 4*bend*STAYS_INSIDE*b->slack[c]) - slope;
            if (falls*part > 2*STAYS_INSIDE*b->slack[c])
                part = 2*STAYS_INSIDE*b->slack[c]/falls;
            if (b->pull[c] + part*b->pull_step[c] < (1 - STAYS_INSIDE)*b->pull[c])
                part = -STAYS_INSIDE*b->pull[c]/b->pull_step[c];
        }
    return part;
}

static void move(friction_balls_t *b, double part)
{
    for (int k = 0; k < b->rows; k++)
        b->force[k] += part*b->step[k];
    for (int e = 0; e < b->equalities; e++)
        b->multiplier[e] += part*b->multiplier_step[e];
    for (int i = 0; i < b->balls; i++)
        for (int strip = 0; strip < 2; strip++)
            if (has_constraint(b->ball + i, strip)) {
                const double outside = half_product(b->ball + i, strip, b->force, b->force) - 0.5;
                b->slack[2*i + strip] = fmax(-outside, LEAST_SLACK);
                b->pull[2*i + strip] += part*b->pull_step[2*i + strip];
            }
}

/* The mean product behind the part of a predictor's step that stays inside, over that before it. */
static double predicted(const friction_balls_t *b, double part)
{
    double before = 0, behind = 0;
    for (int i = 0; i < b->balls; i++)
        for (int strip = 0; strip < 2; strip++) {
            const int c = 2*i + strip;
            if (!has_constraint(b->ball + i, strip))
                continue;
            before += b->pull[c]*b->slack[c]/b->unit;
            behind += (b->pull[c] + part*b->pull_step[c])*(b->slack[c] + part*b->slack_step[c])/b->unit;
        }
    return fmin(1, fmax(behind, 0)/before);
}

/* Which constraints hold their forces, by the predictor's step: slacks go to zero there, and pulls elsewhere. */
static void tell_active(friction_balls_t *b)
{
    for (int i = 0; i < b->balls; i++)
        for (int strip = 0; strip < 2; strip++) {
            const int c = 2*i + strip;
            b->active[c] = has_constraint(b->ball + i, strip)
                && b->slack_step[c]*b->pull[c] < b->pull_step[c]*b->slack[c];
        }
}

FRICTION_LINKAGE int friction_go_inside(friction_balls_t *b, double target, int rounds)
{
    int round = 0;
    for (; round < rounds; round++) {
        const double mean = mean_product(b);
        if (!(mean > target))
            break;
        friction_slopes(b);
        put_blocks(b);
        friction_factor_step(b, 0);
        find_step(b, 0, 0);
        tell_active(b);
        double part = part_inside(b);
        const double ratio = predicted(b, part);
        /* equalities next to what can be fulfilled need all of it */
        find_step(b, ratio*ratio*ratio*mean, b->equalities ? 1 : part*part);
        part = part_inside(b);
        if (!(part >= SHORT)) {                 /* products have come apart: once more towards their mean     */
            find_step(b, RECENTRES*mean, 0);
            part = part_inside(b);
        }
        if (!(part >= SHORTEST))
            break;
        move(b, part);
    }
    return round;
}
