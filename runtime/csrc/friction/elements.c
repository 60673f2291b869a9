/* The minimum of elements.h: balls of size 1 are made of its sets, and what is found is brought back to forces. */
#include <math.h>
#include <stddef.h>
#include <string.h>

#include "balls.h"
#include "elements.h"

#define STICKS 9e-16                /* the residual with which all that rests sticks                        */
#define OBEYED 2e-15               /* the residual that needs no further rounds                            */
#define MAX_ROUNDS 60               /* from inside                                                          */
#define CHANGES 12                  /* of an active set                                                     */
#define SINGULAR 1e-13              /* pivots of a matrix with ones on its diagonal                         */
#define NOT_GIVEN 1e-7              /* the residual of equalities that no forces fulfil                     */
#define DEPENDS 1e-13              /* of an equality's size: it follows from the others                    */
#define CELL 16                     /* bytes: parts of memory begin at multiples of these                   */

/* Memory that the caller gives, laid out part by part; where it is null the parts are only counted. */
typedef struct {
    char *memory;
    size_t used;
} room_t;

static void *room_for(room_t *room, size_t count, size_t size)
{
    void *const part = room->memory ? room->memory + room->used : NULL;
    room->used += (count*size + CELL - 1)/CELL*CELL;
    return part;
}

static double *numbers(room_t *room, int count)
{
    return room_for(room, (size_t)count, sizeof(double));
}

static int *flags(room_t *room, int count)
{
    return room_for(room, (size_t)count, sizeof(int));
}

static void lay_out_balls(friction_balls_t *b, room_t *room, int dense, int dense_balls, int apart, int equalities)
{
    const int size = dense + equalities, rows = dense + apart, balls = dense_balls + apart;
    b->dense = dense, b->dense_balls = dense_balls, b->apart = apart, b->equalities = equalities;
    b->rows = rows, b->balls = balls, b->directions = 0, b->yaw_yaw = b->yaw_held = 0;
    b->ball = room_for(room, (size_t)balls, sizeof *b->ball);
    b->direction = room_for(room, (size_t)dense, sizeof *b->direction);
    b->matrix = numbers(room, dense*dense), b->coupled = numbers(room, dense*dense + size);
    b->equality = numbers(room, equalities*dense), b->wanted = numbers(room, equalities);
    b->mobility = numbers(room, apart), b->yaw = numbers(room, apart), b->yaw_rows = numbers(room, dense);
    b->size = numbers(room, rows), b->given = numbers(room, rows);
    b->slope = numbers(room, rows), b->step = numbers(room, rows);
    b->right = numbers(room, rows + equalities), b->multiplier_step = numbers(room, equalities);
    const size_t before = room->used;
    b->force = numbers(room, rows), b->multiplier = numbers(room, equalities);
    b->kept.inside_size = room->used - before;
    b->active = flags(room, 2*balls);
    b->kept.best_size = room->used - before;
    b->kept.inside = room_for(room, b->kept.inside_size, 1), b->kept.best = room_for(room, b->kept.best_size, 1);
    b->scale = numbers(room, balls), b->block = numbers(room, 4*dense_balls + apart);
    b->slack = numbers(room, 2*balls), b->pull = numbers(room, 2*balls);
    b->product = numbers(room, 2*balls);
    b->slack_step = numbers(room, 2*balls), b->pull_step = numbers(room, 2*balls);
    b->moves = flags(room, apart);
    b->system.matrix = numbers(room, size*size);
    b->system.scale = numbers(room, size), b->system.scratch = numbers(room, size);
    b->system.row = flags(room, size), b->system.column = flags(room, size);
}

FRICTION_LINKAGE size_t friction_memory(int rows, int elements, int apart, int equalities)
{
    room_t room = {NULL, 0};
    friction_balls_t balls;
    lay_out_balls(&balls, &room, rows + 1, elements + 1, apart, equalities);      /* of friction_least_use()        */
    lay_out_balls(&balls, &room, rows, elements, 0, rows);                        /* of the forces of least norm    */
    return room.used + CELL;
}

/* The memory from a multiple of a cell on. */
static room_t room_of(void *memory)
{
    const size_t beyond = (size_t)memory % CELL;
    const room_t room = {(char *)memory + (beyond ? CELL - beyond : 0), 0};
    return room;
}

/* The ball of an element, and the sizes of its rows; a row that takes no force is none of it. */
static void put_ball(friction_balls_t *b, int i, const friction_element_t *element)
{
    friction_ball_t ball = {element->first, element->rows, element->kind != FRICTION_FIXED, INFINITY};
    for (int k = 0; k < element->rows && ball.bounded; k++)
        b->size[element->first + k] = element->size[k] > 0 ? element->size[k] : 0;
    if (element->kind == FRICTION_ELLIPSE) {
        const int has_strip = b->size[ball.first] > 0 && element->strip > 0;
        b->size[ball.first] = has_strip ? b->size[ball.first] : 0;
        ball.strip = has_strip ? element->strip/b->size[ball.first] : INFINITY;
        ball.first += !has_strip;
        ball.rows = has_strip + (b->size[element->first + 1] > 0);
    }
    else if (ball.bounded)
        ball.rows = b->size[ball.first] > 0;
    b->ball[i] = ball;
}

/* Balls of all elements; rows that are fixed have the unit in which their diagonal is 1. */
static void put_balls(friction_balls_t *b, const friction_problem_t *p)
{
    for (int k = 0; k < p->rows; k++) {
        const double diagonal = p->matrix ? p->matrix[k*p->rows + k] : 1;
        b->size[k] = diagonal > 0 ? 1/sqrt(diagonal) : 1;
    }
    for (int i = 0; i < p->elements; i++)
        put_ball(b, i, p->element + i);
    for (int k = 0; k < b->apart; k++) {
        const friction_ball_t ball = {b->dense + k, p->bound[k] > 0, 1, INFINITY};
        b->ball[b->dense_balls + k] = ball;
        b->size[b->dense + k] = p->bound[k] > 0 ? p->bound[k] : 0;
    }
}

static void put_equalities(friction_balls_t *b, const friction_problem_t *p)
{
    for (int e = 0; e < b->equalities; e++) {
        b->wanted[e] = p->wanted[e];
        for (int k = 0; k < p->rows; k++)
            b->equality[e*b->dense + k] = p->equality[e*p->rows + k]*b->size[k];
    }
}

/* The numbers of a problem in units of its balls. */
static void put_numbers(friction_balls_t *b, const friction_problem_t *p)
{
    const int n = b->dense;
    for (int k = 0; k < n; k++) {
        b->given[k] = p->given[k]*b->size[k];
        for (int l = 0; l < n; l++)
            b->matrix[k*n + l] = b->size[k]*p->matrix[k*n + l]*b->size[l];
        if (b->apart)
            b->yaw_rows[k] = p->yaw_rows[k]*b->size[k];
    }
    for (int k = 0; k < b->apart; k++) {
        const double size = b->size[n + k];
        b->mobility[k] = size*p->mobility[k]*size, b->yaw[k] = p->yaw[k]*size;
        b->given[n + k] = p->apart_given[k]*size;
        if (!(size > 0))
            b->mobility[k] = 1;
    }
    b->yaw_yaw = b->apart ? p->yaw_yaw : 0;
    put_equalities(b, p);
}

/* The part of equality e across those before, with what it wants; returns its size. */
static double take_before(friction_balls_t *b, int e)
{
    const int n = b->dense;
    double *const row = b->equality + e*n, size = 0;
    for (int pass = 0; pass < 2; pass++)
        for (int f = 0; f < e; f++) {
            double along = 0;
            for (int k = 0; k < n; k++)
                along += b->equality[f*n + k]*row[k];
            for (int k = 0; k < n; k++)
                row[k] -= along*b->equality[f*n + k];
            b->wanted[e] -= along*b->wanted[f];
        }
    for (int k = 0; k < n; k++)
        size += row[k]*row[k];
    return sqrt(size);
}

/* Equalities are made orthonormal; those that follow from the others go. */
static void make_orthonormal(friction_balls_t *b)
{
    const int n = b->dense;
    int count = 0;
    for (int e = 0; e < b->equalities; e++) {
        double before = 0;
        for (int k = 0; k < n; k++) {
            b->equality[count*n + k] = b->equality[e*n + k];
            before += b->equality[e*n + k]*b->equality[e*n + k];
        }
        b->wanted[count] = b->wanted[e];
        const double size = take_before(b, count);
        if (!(size > DEPENDS*sqrt(before)))
            continue;
        for (int k = 0; k < n; k++)
            b->equality[count*n + k] /= size;
        b->wanted[count++] /= size;
    }
    b->equalities = count;
}

/* The minimum, in b->force: where nothing reaches its bound, which may be so if `at_once`, it is found at once; else the
 * inside tells the active set, more finely where that has not been enough. Returns the residual. */
static double minimise(friction_balls_t *b, int at_once, int *rounds)
{
    static const double targets[] = {1e-5, 1e-8, 1e-11, 1e-14, 1e-17};
    const int count = sizeof targets/sizeof *targets;
    *rounds = 0;
    friction_begin(b);
    if (at_once)
        friction_polish(b, 0);
    else {
        memcpy(b->kept.inside, b->force, b->kept.inside_size);
        friction_slopes(b);
    }
    for (int t = 0; t < count && !(b->least <= (t ? OBEYED : STICKS)); t++) {
        memcpy(b->force, b->kept.inside, b->kept.inside_size);
        *rounds += friction_go_inside(b, targets[t], MAX_ROUNDS - *rounds);
        friction_polish(b, CHANGES);
    }
    friction_take_best(b);
    return b->least;
}

/* Of the forces of elements at rest all that give the same accelerations: equalities of `norm`, for x of least norm. */
static void put_same_accelerations(friction_balls_t *b, friction_balls_t *norm)
{
    const int n = b->dense;
    const friction_system_t *const system = &b->system;
    for (int k = 0; k < 4*b->dense_balls + b->apart; k++)
        b->block[k] = 0;
    for (int k = 0; k < b->apart; k++)
        b->moves[k] = 0;
    b->directions = 0;
    for (int i = 0; i < b->dense_balls; i++) {
        norm->ball[i] = b->ball[i];
        norm->ball[i].rows = b->active[2*i] || b->active[2*i + 1] ? 0 : b->ball[i].rows;
        for (int k = 0; k < norm->ball[i].rows; k++) {
            const friction_direction_t direction = {b->ball[i].first + k, 1, {1, 0}};
            b->direction[b->directions++] = direction;
        }
    }
    const int equalities = b->equalities;
    b->equalities = 0;
    friction_factor_step(b, SINGULAR);
    b->equalities = equalities;
    norm->equalities = system->rank;
    for (int e = 0; e < system->rank; e++) {
        norm->wanted[e] = 0;
        for (int k = 0; k < n; k++)
            norm->equality[e*n + k] = 0;
        for (int l = e; l < system->size; l++) {
            const int column = system->column[l], row = b->direction[column].first;
            norm->equality[e*n + row] = system->matrix[e*system->size + l]/system->scale[column];
            norm->wanted[e] += norm->equality[e*n + row]*b->force[row];
        }
    }
    make_orthonormal(norm);
}

/* The norm of forces as what is least. */
static void put_norm(friction_balls_t *norm, const double *size)
{
    const int n = norm->dense;
    double largest = 0;
    for (int k = 0; k < n; k++)
        largest = fmax(largest, size[k]);
    norm->unit = largest > 0 ? largest : 1;
    for (int k = 0; k < n; k++) {
        norm->size[k] = size[k], norm->given[k] = 0;
        for (int l = 0; l < n; l++)
            norm->matrix[k*n + l] = k == l ? size[k]/norm->unit*(size[k]/norm->unit) : 0;
    }
}

/* Elements at rest get the forces of least norm among those that give the same accelerations; whether others do. */
static int choose_least_norm(friction_balls_t *b, room_t *room, double residual)
{
    friction_balls_t norm;
    int rounds;
    lay_out_balls(&norm, room, b->dense, b->dense_balls, 0, b->dense);
    put_same_accelerations(b, &norm);
    if (b->system.rank == b->system.size)
        return 0;
    put_norm(&norm, b->size);
    minimise(&norm, 1, &rounds);
    memcpy(b->kept.best, b->force, b->kept.best_size);
    for (int i = 0; i < b->dense_balls; i++)
        for (int k = norm.ball[i].first; k < norm.ball[i].first + norm.ball[i].rows; k++)
            b->force[k] = norm.force[k];
    friction_slopes(b);
    if (!(friction_residual(b) <= fmax(OBEYED, 2*residual))) {
        memcpy(b->force, b->kept.best, b->kept.best_size);
        friction_slopes(b);
    }
    return 1;
}

static int all_finite(int count, const double *numbers_given)
{
    for (int k = 0; k < count; k++)
        if (!(fabs(numbers_given[k]) < INFINITY))
            return 0;
    return 1;
}

/* Forces in their units, with how strongly each element is pulled over the edges of its set. */
static void put_found(friction_balls_t *b, friction_solution_t *found)
{
    for (int k = 0; k < b->rows; k++)
        found->force[k] = b->force[k]*b->size[k];
    for (int i = 0; i < b->balls; i++)
        if (b->ball[i].rows == 1 && b->ball[i].bounded)
            found->force[b->ball[i].first] = fmax(fmin(found->force[b->ball[i].first], b->size[b->ball[i].first]),
                                                  -b->size[b->ball[i].first]);
    for (int i = 0; i < b->balls; i++) {
        const int c = i < b->dense_balls ? 2*i : b->dense_balls + i;
        const int rests = b->ball[i].rows || !b->ball[i].bounded;
        found->state[i] = !rests || b->active[2*i] ? FRICTION_SLIPS : FRICTION_RESTS;
        found->pull[c] = b->ball[i].rows && b->active[2*i] ? fmax(friction_pull(b, i), 0) : 0;
        if (i >= b->dense_balls)
            continue;
        found->state[i] += b->ball[i].rows && b->active[2*i + 1] ? FRICTION_YIELDS : 0;
        found->pull[c + 1] = b->ball[i].rows && b->active[2*i + 1] ? fmax(friction_pull_of_strip(b, i), 0) : 0;
    }
}

/* Q y + q and the same of rows apart, of the problem's own numbers: rows without force have theirs too. */
static void put_accelerations(const friction_problem_t *p, friction_solution_t *found)
{
    double moment = 0, yaw;
    for (int k = 0; k < p->apart; k++)
        moment += p->yaw[k]*found->force[p->rows + k];
    yaw = p->apart ? p->yaw_yaw*moment : 0;
    for (int k = 0; k < p->rows; k++) {
        double sum = p->given[k];
        for (int l = 0; l < p->rows; l++)
            sum += p->matrix[k*p->rows + l]*found->force[l];
        found->acceleration[k] = p->apart ? sum + p->yaw_rows[k]*moment : sum;
        yaw += p->apart ? p->yaw_rows[k]*found->force[k] : 0;
    }
    for (int k = 0; k < p->apart; k++)
        found->acceleration[p->rows + k] =
            p->mobility[k]*found->force[p->rows + k] + p->yaw[k]*yaw + p->apart_given[k];
}

/* No forces at all, of a problem that is none. */
static int refuse(const friction_problem_t *p, friction_solution_t *found)
{
    for (int k = 0; k < p->rows + p->apart; k++)
        found->force[k] = found->acceleration[k] = 0;
    for (int i = 0; i < p->elements + p->apart; i++)
        found->state[i] = FRICTION_RESTS;
    for (int c = 0; c < 2*p->elements + p->apart; c++)
        found->pull[c] = 0;
    found->residual = INFINITY, found->iterations = found->unique = 0;
    return 0;
}

FRICTION_LINKAGE int friction_decide(const friction_problem_t *p, void *memory, friction_solution_t *found)
{
    room_t room = room_of(memory);
    friction_balls_t balls;
    lay_out_balls(&balls, &room, p->rows, p->elements, p->apart, p->equalities);
    put_balls(&balls, p);
    put_numbers(&balls, p);
    if (!all_finite(p->rows*p->rows, balls.matrix) || !all_finite(balls.rows, balls.given)
        || !all_finite(p->apart, balls.mobility) || !all_finite(p->apart, balls.yaw) || !all_finite(1, &balls.yaw_yaw)
        || (p->apart && !all_finite(p->rows, balls.yaw_rows))
        || !all_finite(p->equalities*p->rows, balls.equality) || !all_finite(p->equalities, balls.wanted))
        return refuse(p, found);
    make_orthonormal(&balls);
    found->residual = minimise(&balls, 1, &found->iterations);
    if (!(found->residual < INFINITY))
        return refuse(p, found);
    found->unique = balls.equalities ? 1 : !choose_least_norm(&balls, &room, found->residual);
    put_found(&balls, found);
    put_accelerations(p, found);
    return 1;
}

/* E x = h/u with x within the sets, for the largest 1/u: a row more, which no set holds. */
static void put_use(friction_balls_t *b, const friction_problem_t *p)
{
    const int n = p->rows, wide = n + 1;
    const friction_ball_t ball = {n, 1, 0, INFINITY};
    b->ball[p->elements] = ball;
    b->size[n] = 1;
    for (int k = 0; k < wide; k++)
        b->given[k] = k == n ? -1 : 0;
    for (int k = 0; k < wide*wide; k++)
        b->matrix[k] = 0;
    for (int e = 0; e < p->equalities; e++) {
        for (int k = 0; k < n; k++)
            b->equality[e*wide + k] = p->equality[e*n + k]*b->size[k];
        b->equality[e*wide + n] = -p->wanted[e];
        b->wanted[e] = 0;
    }
}

/* The problem of least use, in this memory. */
static friction_balls_t balls_of_use(const friction_problem_t *p, void *memory)
{
    room_t room = room_of(memory);
    friction_balls_t balls;
    friction_problem_t sets = *p;
    sets.matrix = NULL, sets.apart = 0;
    lay_out_balls(&balls, &room, p->rows + 1, p->elements + 1, 0, p->equalities);
    put_balls(&balls, &sets);
    put_use(&balls, p);
    return balls;
}

FRICTION_LINKAGE double friction_least_use(const friction_problem_t *p, void *memory, friction_solution_t *found)
{
    friction_balls_t balls = balls_of_use(p, memory);
    friction_problem_t sets = *p;
    sets.apart = 0;
    double largest = 0;
    for (int e = 0; e < p->equalities; e++)
        largest = fmax(largest, fabs(p->wanted[e]));
    refuse(&sets, found);
    if (!all_finite(p->equalities*(p->rows + 1), balls.equality))
        return INFINITY;
    if (!(largest > 0))
        return 0;
    make_orthonormal(&balls);
    found->residual = minimise(&balls, 0, &found->iterations);
    const double times = balls.force[p->rows];
    if (!(found->residual < NOT_GIVEN) || !(times > 0))
        return INFINITY;
    for (int k = 0; k < p->rows; k++)
        found->force[k] = balls.force[k]*balls.size[k]/times;
    return 1/times;
}

/* By the multipliers: they are the slopes of the least by what equalities want, which goes with these as they become
 * orthonormal. */
FRICTION_LINKAGE double friction_use_rate(const friction_problem_t *p, void *memory, const double *change)
{
    friction_balls_t balls = balls_of_use(p, memory);
    double rate = 0;
    memcpy(balls.wanted, change, (size_t)p->equalities*sizeof *change);
    make_orthonormal(&balls);
    for (int e = 0; e < balls.equalities; e++)
        rate -= balls.multiplier[e]*balls.wanted[e];
    return rate/balls.force[p->rows];
}
