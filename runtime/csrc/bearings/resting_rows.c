/* What holds together that stands: rows of rates in nu, motions that they leave, torques of least norm. */
#define MAX_BEARINGS (2*MAX_WHEELS)
#define PARALLEL 1e-12              /* sine of the angle below which rows are parallel                      */
#define SAME_TORQUE 1e-7            /* of its bound: by so much a torque may differ that is found in another form */
#define LEAST_REACH 1e-14           /* of the largest: for bearings that take no torque                      */

typedef double vector3_t[3];

/* Bearings at rest whose rates follow from nu, and the largest torques that they take. */
typedef struct {
    int count;
    vector3_t rows[MAX_BEARINGS];
    double bounds[MAX_BEARINGS];
} bearings_t;

ALWAYS_INLINE void add3(double *to, double times, const double *from)
{
    for (int k = 0; k < 3; k++)
        to[k] += times*from[k];
}


/* The length of a vector, which becomes 1; one of zeros stays. */
ALWAYS_INLINE double normalise3(double *a)
{
    const double length = length3(a);
    for (int k = 0; k < 3; k++)
        a[k] /= length > 0 ? length : 1;
    return length;
}

/* The part of a vector across some that are orthonormal; twice, so that rounding leaves nothing along them. */
ALWAYS_INLINE void take_across(int rank, const vector3_t *basis, double *a)
{
    for (int pass = 0; pass < 2; pass++)
        for (int b = 0; b < rank; b++)
            add3(a, -dot3(a, basis[b]), basis[b]);
}

/* An orthonormal basis of what the rows span; returns how many vectors it has. The row that is farthest from the ones
 * before comes next. */
static int span_of(const bearings_t *bearings, vector3_t *basis)
{
    int rank = 0;
    for (; rank < 3; rank++) {
        double largest = PARALLEL;
        for (int i = 0; i < bearings->count; i++) {
            vector3_t unit = {bearings->rows[i][0], bearings->rows[i][1], bearings->rows[i][2]};
            normalise3(unit);
            take_across(rank, (const vector3_t *)basis, unit);
            const double length = normalise3(unit);
            if (length > largest) {
                largest = length;
                memcpy(basis[rank], unit, sizeof unit);
            }
        }
        if (largest == PARALLEL)
            break;
    }
    return rank;
}

/* a . mass b. */
ALWAYS_INLINE double metric(const vector3_t *mass, const double *a, const double *b)
{
    const vector3_t heavy = {dot3(mass[0], b), dot3(mass[1], b), dot3(mass[2], b)};
    return dot3(a, heavy);
}

/* Vectors orthonormal in the metric of the mass matrix that span the nu which leave the bearings at rest, as columns;
 * a column that is not there is 0, and absent is 1. Returns how many there are. */
static int directions_allowed(const bearings_t *bearings, const vector3_t *mass, double *directions, double *absent)
{
    vector3_t basis[3], columns[3];
    const int rank = span_of(bearings, basis);
    for (int c = 0; c < 3; c++) {
        for (int k = 0; k < 3; k++)
            directions[3*k + c] = 0;
        absent[c] = c >= 3 - rank;
    }
    for (int c = 0; c < 3 - rank; c++) {
        /* the axis that is farthest from what there is */
        double largest = 0;
        for (int axis = 0; axis < 3; axis++) {
            vector3_t unit = {axis == 0, axis == 1, axis == 2};
            take_across(rank + c, (const vector3_t *)basis, unit);
            const double length = normalise3(unit);
            if (length > largest) {
                largest = length;
                memcpy(basis[rank + c], unit, sizeof unit);
            }
        }
    }
    for (int c = 0; c < 3 - rank; c++) {
        double *const column = columns[c];
        memcpy(column, basis[rank + c], sizeof columns[c]);
        for (int pass = 0; pass < 2; pass++)
            for (int b = 0; b < c; b++)
                add3(column, -metric(mass, columns[b], column), columns[b]);
        if (!(metric(mass, column, column) > 0))    /* the smallest part of the matrix is lost in rounding */
            memcpy(column, basis[rank + c], sizeof columns[c]);
        const double size = sqrt(metric(mass, column, column));
        for (int k = 0; k < 3; k++)
            directions[3*k + c] = column[k] /= size;
    }
    return 3 - rank;
}

/* The torques of least norm that give a force: R^T y = force and torques = Q y, where Q R are the bearings' rows along
 * a basis of their span. */
static void least_norm(const bearings_t *bearings, const double *force, double *torques)
{
    vector3_t basis[3];
    const int rank = span_of(bearings, basis), count = bearings->count;
    double q[3][MAX_BEARINGS], r[3][3] = {{0}}, y[3];
    for (int c = 0; c < rank; c++) {
        for (int i = 0; i < count; i++)
            q[c][i] = dot3(bearings->rows[i], basis[c]);
        double size = 0;
        for (int pass = 0; pass < 2; pass++)
            for (int b = 0; b < c; b++) {
                double along = 0;
                for (int i = 0; i < count; i++)
                    along += q[b][i]*q[c][i];
                for (int i = 0; i < count; i++)
                    q[c][i] -= along*q[b][i];
                r[b][c] += along;
            }
        for (int i = 0; i < count; i++)
            size += q[c][i]*q[c][i];
        r[c][c] = sqrt(size);
        for (int i = 0; i < count; i++)
            q[c][i] /= r[c][c];
        y[c] = dot3(basis[c], force);
        for (int b = 0; b < c; b++)
            y[c] -= r[b][c]*y[b];
        y[c] /= r[c][c];
    }
    for (int i = 0; i < count; i++) {
        torques[i] = 0;
        for (int c = 0; c < rank; c++)
            torques[i] += q[c][i]*y[c];
    }
}

ALWAYS_INLINE double clipped(double x, double bound)
{
    return fmax(fmin(x, bound), -bound);
}

/* Torques at their bounds as the solver has found them; the others once more from what these leave of the force. */
static void take_least(const bearings_t *bearings, const double *force, const elements_t *problem, double *torques)
{
    bearings_t free = {.count = 0};
    vector3_t rest = {force[0], force[1], force[2]};
    double found[MAX_BEARINGS];
    int places[MAX_BEARINGS], same = 1;
    for (int i = 0; i < bearings->count; i++) {
        torques[i] = clipped(problem->found.force[i], bearings->bounds[i]);
        if (problem->found.state[i] != FRICTION_RESTS) {
            add3(rest, -torques[i], bearings->rows[i]);
            continue;
        }
        places[free.count] = i;
        memcpy(free.rows[free.count++], bearings->rows[i], sizeof(vector3_t));
    }
    least_norm(&free, rest, found);
    for (int k = 0; k < free.count; k++)
        same &= fabs(found[k] - torques[places[k]]) <= SAME_TORQUE*bearings->bounds[places[k]];
    for (int k = 0; k < free.count && same; k++)
        torques[places[k]] = clipped(found[k], bearings->bounds[places[k]]);
}

/* The torques of least norm within the bounds that give the force, which some do. */
static void least_torques(const bearings_t *bearings, const double *force, elements_t *problem, double *torques)
{
    const int count = bearings->count;
    friction_problem_t *const norm = &problem->p;
    double largest = 0;
    int inside = 1;
    least_norm(bearings, force, torques);
    for (int i = 0; i < count; i++)
        inside &= fabs(torques[i]) <= bearings->bounds[i];
    if (inside)
        return;
    norm->rows = norm->elements = count, norm->apart = 0, norm->equalities = 3;
    for (int k = 0; k < 3; k++) {
        norm->wanted[k] = force[k];
        for (int i = 0; i < count; i++)
            norm->equality[k*count + i] = bearings->rows[i][k];
    }
    for (int i = 0; i < count; i++)
        largest = fmax(largest, bearings->bounds[i]);
    memset(norm->matrix, 0, sizeof *norm->matrix*(size_t)(count*count));
    for (int i = 0; i < count; i++) {
        norm->element[i] = (friction_element_t){FRICTION_INTERVAL, i, 1, {bearings->bounds[i], 0}, INFINITY};
        norm->given[i] = 0, norm->matrix[i*count + i] = 1/(largest*largest);
    }
    friction_decide(norm, problem->memory, &problem->found);
    take_least(bearings, force, problem, torques);
}
