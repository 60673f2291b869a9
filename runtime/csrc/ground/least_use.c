/* How much contacts and bearings must take that hold a vehicle together in more ways than one.
 * runtime/omniroll/effects/least_use.py says what is solved here; functions of one name do the same. */
#if SET_STANDS_BOTH_WAYS
#define MOST_STANDING MOST_BEARINGS         /* forces: two of a wheel                                           */
#define MOST_USES (3*MOST_WHEELS)           /* contacts, and two bearings of each                               */
#define FIRST_PART 1e-2                     /* of the barrier                                                   */
#define FINER_PART 0.1                      /* from round to round                                              */
#define LEAST_ROUNDS 13
#define LEAST_NEWTON 30
#define CENTRED 1e-9                        /* the square of what a step promises, below which a round has ended */
#define SHORT_STEP 0.25                     /* a step that promises more is made shorter                        */
#define LEAST_PART 1e-3                     /* of a step: where less of it stays inside, rounding is all that is left */
#define INSIDE 1e-9                         /* below 1: a use that leaves forces to choose                      */

/* Uses of `parts` by `count` forces x: |per_force x + given|, of two components. */
typedef struct {
    int parts, count;
    double per_force[MOST_USES][2][MOST_STANDING], given[MOST_USES][2];
} uses_t;

/* Forces that give what is asked for, and what may be added to them: orthonormal. */
typedef struct {
    int count;
    double start[MOST_STANDING], way[MOST_STANDING][MOST_STANDING];
} choice_t;

static double use_of(const uses_t *uses, int part, const double *forces, double *found)
{
    for (int c = 0; c < 2; c++) {
        found[c] = uses->given[part][c];
        for (int k = 0; k < uses->count; k++)
            found[c] += uses->per_force[part][c][k]*forces[k];
    }
    return sqrt(found[0]*found[0] + found[1]*found[1]);
}

static double largest_use(const uses_t *uses, const double *forces)
{
    double largest = 0, found[2];
    for (int part = 0; part < uses->parts; part++)
        largest = fmax(largest, use_of(uses, part, forces, found));
    return largest;
}

/* What is left of a vector across some that are orthonormal, made as long as 1; returns how long it was. */
static double unit_across(int count, int rank, double (*basis)[MOST_STANDING], double *a)
{
    double size = 0;
    for (int pass = 0; pass < 2; pass++)
        for (int b = 0; b < rank; b++) {
            double along = 0;
            for (int k = 0; k < count; k++)
                along += basis[b][k]*a[k];
            for (int k = 0; k < count; k++)
                a[k] -= along*basis[b][k];
        }
    for (int k = 0; k < count; k++)
        size += a[k]*a[k];
    for (int k = 0; k < count && size > 0; k++)
        a[k] /= sqrt(size);
    return sqrt(size);
}

/* The forces of least norm that give `force` together, each along its row, and the ways to add to them. */
static void find_ways(const bearings_t *rows, const double *force, choice_t *found)
{
    vector3_t basis[3];
    double all[MOST_STANDING + 3][MOST_STANDING];
    const int rank = span_of(rows, basis), count = rows->count;
    least_norm(rows, force, found->start, 0);
    for (int c = 0; c < rank; c++) {
        for (int k = 0; k < count; k++)
            all[c][k] = dot3(rows->rows[k], basis[c]);
        unit_across(count, c, all, all[c]);
    }
    found->count = count - rank;
    for (int c = rank; c < count; c++) {
        double most = 0;
        for (int axis = 0; axis < count; axis++) {      /* the axis that is farthest from what there is     */
            double unit[MOST_STANDING] = {0};
            unit[axis] = 1;
            const double length = unit_across(count, c, all, unit);
            if (length > most) {
                most = length;
                memcpy(all[c], unit, sizeof unit);
            }
        }
        memcpy(found->way[c - rank], all[c], sizeof all[c]);
    }
}

/* The same uses of forces start + size times the ways, over `size`. */
static void uses_along(const uses_t *uses, const choice_t *ways, double size, uses_t *along)
{
    along->parts = uses->parts, along->count = ways->count;
    for (int part = 0; part < uses->parts; part++) {
        use_of(uses, part, ways->start, along->given[part]);
        for (int c = 0; c < 2; c++) {
            along->given[part][c] /= size;
            for (int w = 0; w < ways->count; w++) {
                double sum = 0;
                for (int k = 0; k < uses->count; k++)
                    sum += uses->per_force[part][c][k]*ways->way[w][k];
                along->per_force[part][c][w] = sum;
            }
        }
    }
}

static void go_along(const choice_t *ways, const double *place, double size, int count, double *forces)
{
    for (int k = 0; k < count; k++) {
        forces[k] = ways->start[k];
        for (int w = 0; w < ways->count; w++)
            forces[k] += size*place[w]*ways->way[w][k];
    }
}

/* Slope and second derivative of the barrier by the place and the use, which stands behind it. */
static void barrier(const uses_t *uses, const double *at, double *slope, double *matrix)
{
    const int n = uses->count + 1;
    memset(slope, 0, sizeof *slope*(size_t)n);
    memset(matrix, 0, sizeof *matrix*(size_t)(n*n));
    for (int part = 0; part < uses->parts; part++) {
        double found[2], row[MOST_STANDING + 1];
        const double (*const per)[MOST_STANDING] = uses->per_force[part];
        const double use = use_of(uses, part, at, found), left = (at[n - 1] - use)*(at[n - 1] + use);
        for (int k = 0; k < n - 1; k++)
            row[k] = per[0][k]*found[0] + per[1][k]*found[1];
        row[n - 1] = -at[n - 1];
        for (int j = 0; j < n; j++) {
            slope[j] += 2/left*row[j];
            for (int k = 0; k < n; k++)
                matrix[j*n + k] += 4*(row[j]/left)*(row[k]/left);
            for (int k = 0; k < n - 1 && j < n - 1; k++)
                matrix[j*n + k] += 2/left*(per[0][j]*per[0][k] + per[1][j]*per[1][k]);
        }
        matrix[n*n - 1] -= 2/left;
    }
}

/* The x with m x = vector, in the vector's place, where m is symmetric, semidefinite and has ones on its diagonal: by
 * Cholesky's elimination with the largest pivots. Along what is left when these are rounding, x is 0. */
static void solve_semidefinite(double *m, int size, double *vector)
{
    int order[MOST_STANDING + 1], rank = 0;
    for (int k = 0; k < size; k++)
        order[k] = k;
    for (; rank < size; rank++) {
        int best = rank;
        for (int j = rank + 1; j < size; j++)
            if (m[order[j]*size + order[j]] > m[order[best]*size + order[best]])
                best = j;
        const int p = order[best];
        order[best] = order[rank], order[rank] = p;
        if (!(m[p*size + p] > size*EPS))
            break;
        for (int j = rank + 1; j < size; j++) {
            const int row = order[j];
            const double factor = m[row*size + p]/m[p*size + p];
            for (int l = rank + 1; l < size; l++)
                m[row*size + order[l]] -= factor*m[p*size + order[l]];
            vector[row] -= factor*vector[p];
        }
    }
    for (int k = rank; k < size; k++)
        vector[order[k]] = 0;
    for (int k = rank - 1; k >= 0; k--) {
        const int p = order[k];
        for (int l = k + 1; l < rank; l++)
            vector[p] -= m[p*size + order[l]]*vector[order[l]];
        vector[p] /= m[p*size + p];
    }
}

/* The same of any symmetric and semidefinite matrix: rows and columns are brought to one size, since what bodies can
 * take differs by many powers of ten. The first `count` of `width` rows. */
static void solve_scaled(const double *matrix, int width, int count, double *vector)
{
    double scaled[(MOST_STANDING + 1)*(MOST_STANDING + 1)], size[MOST_STANDING + 1];
    for (int j = 0; j < count; j++)
        size[j] = 1/sqrt(fabs(matrix[j*width + j]));
    for (int j = 0; j < count; j++) {
        vector[j] *= size[j];
        for (int k = 0; k < count; k++)
            scaled[j*count + k] = size[j]*matrix[j*width + k]*size[k];
    }
    solve_semidefinite(scaled, count, vector);
    for (int j = 0; j < count; j++)
        vector[j] *= size[j];
}

/* A place and its use move by as much of a step as stays inside; whether by some of it. */
static int move_inside(const uses_t *uses, int count, double part, const double *step, double *at)
{
    double moved[MOST_STANDING + 1];
    memcpy(moved, at, sizeof *at*(size_t)(uses->count + 1));
    for (;;) {
        for (int k = 0; k < count; k++)
            moved[k] = at[k] + part*step[k];
        if (moved[uses->count] > largest_use(uses, moved) && moved[uses->count] < INFINITY)
            break;
        part /= 2;
        if (!(part >= LEAST_PART))
            return 0;
    }
    memcpy(at, moved, sizeof *at*(size_t)(uses->count + 1));
    return 1;
}

/* Where the barrier is in balance with aim times the use + curve (place . place)/2, from a place inside, by Newton's
 * rule. Without an aim the use stays as it is. */
static void centre(const uses_t *uses, double aim, double curve, double *at)
{
    const int n = uses->count + 1, count = aim > 0 ? n : n - 1;
    for (int round = 0; round < LEAST_NEWTON; round++) {
        double slope[MOST_STANDING + 1], step[MOST_STANDING + 1], matrix[(MOST_STANDING + 1)*(MOST_STANDING + 1)];
        double promised = 0;
        barrier(uses, at, slope, matrix);
        for (int k = 0; k < n - 1; k++)
            slope[k] += curve*at[k], matrix[k*n + k] += curve;
        slope[n - 1] += aim;
        for (int k = 0; k < count; k++)
            step[k] = -slope[k];
        solve_scaled(matrix, n, count, step);
        for (int k = 0; k < count; k++)
            promised -= slope[k]*step[k];
        const double size = sqrt(fmax(promised, 0));
        if (!move_inside(uses, count, size > SHORT_STEP ? 1/(1 + size) : 1, step, at) || promised <= CENTRED)
            return;
    }
}

/* The least use with which forces along the rows give `force`, and such forces. */
static double least_use(const bearings_t *rows, const double *force, const uses_t *uses, double *forces)
{
    choice_t ways;
    uses_t along;
    double at[MOST_STANDING + 1] = {0}, part = FIRST_PART;
    find_ways(rows, force, &ways);
    const double size = largest_use(uses, ways.start);
    memcpy(forces, ways.start, sizeof *forces*(size_t)rows->count);
    if (!ways.count || !(size > 0))
        return size;
    uses_along(uses, &ways, size, &along);
    at[ways.count] = 1.5;                               /* of forces that use 1 at the start                    */
    for (int round = 0; round < LEAST_ROUNDS; round++, part *= FINER_PART)
        centre(&along, 1/part, 0, at);
    go_along(&ways, at, size, rows->count, forces);
    return largest_use(uses, forces);
}

/* The forces of least norm that use nothing up; where nothing is left to choose, those of the least use. */
static void least_norm_within(const bearings_t *rows, const double *force, const uses_t *uses, double *forces)
{
    choice_t ways;
    uses_t along;
    double at[MOST_STANDING + 1] = {0}, part = FIRST_PART, size = 0;
    find_ways(rows, force, &ways);
    memcpy(forces, ways.start, sizeof *forces*(size_t)rows->count);
    if (largest_use(uses, forces) <= 1)
        return;
    const double use = least_use(rows, force, uses, forces);
    if (!ways.count || use > 1 - INSIDE)
        return;
    for (int w = 0; w < ways.count; w++)
        for (int k = 0; k < rows->count; k++)
            at[w] += ways.way[w][k]*(forces[k] - ways.start[k]);
    for (int k = 0; k < rows->count; k++)
        size += forces[k]*forces[k];
    at[ways.count] = 1;
    uses_along(uses, &ways, 1, &along);
    for (int round = 0; round < LEAST_ROUNDS; round++, part *= FINER_PART)
        centre(&along, 0, 1/(part*size), at);
    go_along(&ways, at, 1, rows->count, forces);
}
#endif
