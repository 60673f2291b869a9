/* Which bearings at rest stick and which break away: the complementarity problem of the set-valued law of friction.
 *
 * runtime/omniroll/effects/complementarity.py says what is solved here.  Bearings turn at rates rows nu, and take
 * torques up to their bounds; what m of them can hold is a zonotope in three dimensions, whose facets are few. */
#if SET_STANDS_BOTH_WAYS
#define MOST_BEARINGS (2*MOST_WHEELS)
#else
#define MOST_BEARINGS (SET_BEARINGS*MOST_WHEELS)
#endif
#define PARALLEL 1e-12              /* sine of the angle below which rows are parallel                      */
#define LEAST_REACH 1e-14           /* of the largest: for bearings that take no torque                      */
#define TIE 1e-12                   /* of the largest rates: those that come to rest together               */

typedef double vector3_t[3];

/* Bearings at rest whose rates follow from nu, and the largest torques that they take. */
typedef struct {
    int count;
    vector3_t rows[MOST_BEARINGS];
    double bounds[MOST_BEARINGS];
#if SET_STANDS
    double middle[MOST_BEARINGS];               /* of what they take, where that is not 0 */
#endif
} bearings_t;

/* A motion in which as many bearings rest as can, and the power that the others can take in it. */
typedef struct {
    double normal[3], reach;
} facet_t;

ALWAYS_INLINE void add3(double *to, double times, const double *from)
{
    for (int k = 0; k < 3; k++)
        to[k] += times*from[k];
}

ALWAYS_INLINE void cross3(const double *a, const double *b, double *to)
{
    for (int k = 0; k < 3; k++)
        to[k] = a[(k + 1)%3]*b[(k + 2)%3] - a[(k + 2)%3]*b[(k + 1)%3];
}

/* The length of a vector, which becomes 1; one of zeros stays. */
ALWAYS_INLINE double normalise3(double *a)
{
    const double length = length3(a);
    for (int k = 0; k < 3; k++)
        a[k] /= length > 0 ? length : 1;
    return length;
}

/* What is left of a vector across some that are orthonormal; twice, so that rounding leaves nothing along them. */
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
        double most = PARALLEL;
        for (int i = 0; i < bearings->count; i++) {
            vector3_t unit = {bearings->rows[i][0], bearings->rows[i][1], bearings->rows[i][2]};
            normalise3(unit);
            take_across(rank, (const vector3_t *)basis, unit);
            const double length = normalise3(unit);
            if (length > most) {
                most = length;
                memcpy(basis[rank], unit, sizeof unit);
            }
        }
        if (most == PARALLEL)
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
        double most = 0;
        for (int axis = 0; axis < 3; axis++) {
            vector3_t unit = {axis == 0, axis == 1, axis == 2};
            take_across(rank + c, (const vector3_t *)basis, unit);
            const double length = normalise3(unit);
            if (length > most) {
                most = length;
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
        if (!(metric(mass, column, column) > 0))    /* rounding has left the matrix without its smallest part */
            memcpy(column, basis[rank + c], sizeof columns[c]);
        const double size = sqrt(metric(mass, column, column));
        for (int k = 0; k < 3; k++)
            directions[3*k + c] = column[k] /= size;
    }
    return 3 - rank;
}

/* The rate of a bearing in a motion; exactly 0 where that is all but across its row. */
ALWAYS_INLINE double moved_by(const double *row, const double *normal)
{
    const double moved = dot3(row, normal);
    return fabs(moved) < PARALLEL*length3(row) ? 0 : moved;
}

ALWAYS_INLINE long long most_facets(long long bearings)
{
    return bearings*(bearings + 1);
}

/* A facet and its opposite. */
ALWAYS_INLINE int put_facets(const bearings_t *bearings, const double *normal, facet_t *facets, int count)
{
    facet_t *const facet = facets + count;
    for (int k = 0; k < 3; k++)
        facet[0].normal[k] = normal[k], facet[1].normal[k] = -normal[k];
    double reach = 0;
    for (int i = 0; i < bearings->count; i++)
        reach += fabs(moved_by(bearings->rows[i], normal))*bearings->bounds[i];
    facet[0].reach = facet[1].reach = reach;
    return count + 2;
}

/* The facets of the forces that the bearings can take; returns how many. */
static int facets_of(const bearings_t *bearings, facet_t *facets)
{
    vector3_t basis[3], normal;
    const int rank = span_of(bearings, basis);
    int count = 0;
    if (rank == 1)
        return put_facets(bearings, basis[0], facets, count);
    if (rank == 2)
        cross3(basis[0], basis[1], basis[2]);
    for (int i = 0; rank > 1 && i < bearings->count; i++) {
        vector3_t unit = {bearings->rows[i][0], bearings->rows[i][1], bearings->rows[i][2]};
        normalise3(unit);
        for (int j = rank == 2 ? bearings->count - 1 : i + 1; j < bearings->count; j++) {
            vector3_t other = {bearings->rows[j][0], bearings->rows[j][1], bearings->rows[j][2]};
            normalise3(other);
            cross3(unit, rank == 2 ? basis[2] : other, normal);
            if (normalise3(normal) > PARALLEL)
                count = put_facets(bearings, normal, facets, count);
        }
    }
    return count;
}

/* How much more power than the bearings can give, `reach`, a holding force asks for; and the rounding of that, where the
 * sizes of the force's terms add up to `size`. */
ALWAYS_INLINE double excess(const facet_t *facet, double reach, const double *force, const double *size,
                            double *rounding)
{
    double sizes = reach;
    for (int k = 0; k < 3; k++)
        sizes += fabs(facet->normal[k])*(fabs(force[k]) + size[k]);
    *rounding = EPS*sizes;
    return dot3(facet->normal, force) - reach;
}

/* The same reach where the rows are `nearer` times those that the facet has been made of. */
ALWAYS_INLINE double reach_with(const facet_t *facet, const bearings_t *bearings, const double *nearer)
{
    double reach = 0;
    for (int i = 0; i < bearings->count; i++)
        reach += fabs(moved_by(bearings->rows[i], facet->normal))*bearings->bounds[i]*nearer[i];
    return reach;
}

/* The sign of the rate with which a bearing breaks away where a facet is passed. */
ALWAYS_INLINE int breaks_away(const double *row, const facet_t *facet)
{
    const double moved = moved_by(row, facet->normal);
    return (moved < 0) - (moved > 0);
}

/* Solve R^T R z = force, or R^T y = force and torques = Q y, where Q R are the bearings' rows along a basis of their
 * span. z or torques may be null. */
static void least_norm(const bearings_t *bearings, const double *force, double *torques, double *z)
{
    vector3_t basis[3];
    const int rank = span_of(bearings, basis), count = bearings->count;
    double q[3][MOST_BEARINGS], r[3][3] = {{0}}, y[3], x[3];
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
    for (int i = 0; torques && i < count; i++) {
        torques[i] = 0;
        for (int c = 0; c < rank; c++)
            torques[i] += q[c][i]*y[c];
    }
    if (!z)
        return;
    memset(z, 0, sizeof(vector3_t));
    for (int c = rank - 1; c >= 0; c--) {
        x[c] = y[c];
        for (int b = c + 1; b < rank; b++)
            x[c] -= r[c][b]*x[b];
        x[c] /= r[c][c];
        add3(z, x[c], basis[c]);
    }
}

ALWAYS_INLINE double clipped(double x, double bound)
{
    return fmax(fmin(x, bound), -bound);
}

ALWAYS_INLINE double middle_of(const bearings_t *bearings, int i)
{
#if SET_STANDS
    return bearings->middle[i];
#else
    (void)bearings, (void)i;
    return 0;
#endif
}

/* A torque cut off at the bounds of its bearing. */
ALWAYS_INLINE double cut(const bearings_t *bearings, int i, double torque)
{
    return middle_of(bearings, i) + clipped(torque - middle_of(bearings, i), bearings->bounds[i]);
}

/* How far a line of length 1 may be followed from z so that the torques, rows z cut off at their bounds, give the force
 * along it: the zero of a function that grows and is linear between the places where a torque meets its bound. The last
 * of these where there is no zero. */
static double length_along(const bearings_t *bearings, const double *force, const double *z, const double *line)
{
    const double wanted = dot3(force, line);
    double before = 0, value_before = 0, place = 0;
    for (int round = 0; round <= 2*bearings->count + 1; round++) {
        double value = -wanted, next = INFINITY;
        for (int i = 0; i < bearings->count; i++) {
            const double start = dot3(bearings->rows[i], z), rate = moved_by(bearings->rows[i], line);
            value += cut(bearings, i, start + place*rate)*rate;
            for (int side = -1; side <= 1 && rate != 0; side += 2) {
                const double meets = (middle_of(bearings, i) + side*bearings->bounds[i] - start)/rate;
                if (meets > place && meets < next)
                    next = meets;
            }
        }
        if (value >= 0)
            return round == 0 ? 0 : before + (place - before)*(value_before/(value_before - value));
        if (next == INFINITY)
            return place;
        before = place, value_before = value, place = next;
    }
    return place;
}

/* The torques rows z, cut off at their bounds; the bearings that are not cut off and their places, and what is left of
 * the force when those at their bounds, or all, have given theirs. Returns the sum of the sizes of what this is made
 * of. */
static double cut_off(const bearings_t *bearings, const double *force, const double *z, int all, double *torques,
                      bearings_t *free, int *places, double *rest)
{
    double sizes = length3(force);
    free->count = 0;
    memcpy(rest, force, sizeof(vector3_t));
    for (int i = 0; i < bearings->count; i++) {
        const double asked = dot3(bearings->rows[i], z);
        const int inside = fabs(asked - middle_of(bearings, i)) < bearings->bounds[i];
        torques[i] = cut(bearings, i, asked);
        if (all || !inside) {
            add3(rest, -torques[i], bearings->rows[i]);
            sizes += fabs(torques[i])*length3(bearings->rows[i]);
        }
        if (inside) {
            places[free->count] = i;
            memcpy(free->rows[free->count++], bearings->rows[i], sizeof(vector3_t));
        }
    }
    return sizes;
}

/* The z for which rows z, cut off at the bounds, give the force: a convex function of z is least, piecewise quadratic.
 * Newton's rule with a search along the line. */
static void find_z(const bearings_t *bearings, const double *force, double *z)
{
    bearings_t free;
    vector3_t basis[3], rest, line;
    double torques[MOST_BEARINGS];
    int places[MOST_BEARINGS];
    memset(z, 0, sizeof(vector3_t));
    for (int trial = 0; trial < 20*(1 + bearings->count); trial++) {
        const double rounding = 8*EPS*cut_off(bearings, force, z, 1, torques, &free, places, rest);
        if (!(length3(rest) > rounding))
            return;
        const int rank = span_of(&free, basis);
        memcpy(line, rest, sizeof line);
        take_across(rank, (const vector3_t *)basis, line);
        /* What no free torque gives, some at their bounds do. */
        if (rank == 3 || length3(line) <= rounding)
            least_norm(&free, rest, 0, line);
        normalise3(line);
        const double length = length_along(bearings, force, z, line);
        if (!(length > 0))
            return;
        add3(z, length, line);
    }
}

/* The torques of least norm within the bounds that give the force, which some do. */
static void least_torques(const bearings_t *bearings, const double *force, double *torques)
{
    int inside = 1;
    least_norm(bearings, force, torques, 0);
    for (int i = 0; i < bearings->count; i++)
        inside &= fabs(torques[i] - middle_of(bearings, i)) <= bearings->bounds[i];
    if (inside)
        return;
    bearings_t free;
    vector3_t z, rest;
    int places[MOST_BEARINGS];
    double found[MOST_BEARINGS];
    find_z(bearings, force, z);
    cut_off(bearings, force, z, 0, torques, &free, places, rest);
    least_norm(&free, rest, found, 0);          /* the free ones once more, without z in their digits         */
    for (int k = 0; k < free.count; k++)
        torques[places[k]] = cut(bearings, places[k], found[k]);
}

#if SET_HOLDS
/* The facet that a holding force passes by the most roundings; null where none is passed. */
static const facet_t *passed_facet(const facet_t *facets, int count, const double *force, const double *size)
{
    const facet_t *found = 0;
    double most = PASSED;
    for (int k = 0; k < count; k++) {
        double rounding;
        const double value = excess(facets + k, facets[k].reach, force, size, &rounding);
        if (rounding > 0 && value/rounding > most) {
            most = value/rounding;
            found = facets + k;
        }
    }
    return found;
}

/* The motion in which bearings with signs take their bounds against them and the others rest, the forces that act in it
 * and the sizes of their terms. resting: those that rest, and their places. */
static void motion_with(const vector3_t *mass, const double *force, const bearings_t *bearings, const int *signs,
                        bearings_t *resting, int *places, double *nu_dot, double *given, double *size)
{
    double directions[9], absent[3];
    resting->count = 0;
    for (int k = 0; k < 3; k++)
        nu_dot[k] = 0, given[k] = force[k], size[k] = fabs(force[k]);
    for (int i = 0; i < bearings->count; i++) {
        add3(given, -signs[i]*bearings->bounds[i], bearings->rows[i]);
        for (int k = 0; k < 3; k++)
            size[k] += fabs(bearings->bounds[i]*bearings->rows[i][k]);
        if (signs[i] == 0 && bearings->bounds[i] > 0) {
            places[resting->count] = i;
            resting->bounds[resting->count] = bearings->bounds[i];
            memcpy(resting->rows[resting->count++], bearings->rows[i], sizeof(vector3_t));
        }
    }
    const int moving = directions_allowed(resting, mass, directions, absent);
    for (int c = 0; c < moving; c++) {
        const vector3_t column = {directions[c], directions[3 + c], directions[6 + c]};
        add3(nu_dot, dot3(column, given), column);
    }
}

/* The part of the way from one motion to another until a bearing with a sign comes to rest; 1: none does. */
static double way_to_rest(const bearings_t *bearings, const int *signs, const double *from, const double *to)
{
    double part = 1;
    for (int i = 0; i < bearings->count; i++) {
        const double here = fmax(signs[i]*dot3(bearings->rows[i], from), 0);
        const double then = signs[i]*dot3(bearings->rows[i], to);
        if (then < 0)
            part = fmin(part, here/(here - then));
    }
    return part;
}

/* nu' where M nu' = force + rows^T torques obeys the law with one bound for rest and motion, and such torques: the
 * least of a convex function. From rest, whenever the bearings at rest cannot be held the motion along a facet's normal
 * is added; whenever one comes to rest on the way to the least, it stays at rest. The function falls with each step.
 *
 * facets: scratch, most_facets() of them. */
static void nearest_force(const vector3_t *mass, const double *force, const bearings_t *bearings, facet_t *facets,
                          double *nu_dot, double *torques)
{
    const int count = bearings->count;
    int signs[MOST_BEARINGS] = {0}, places[MOST_BEARINGS];
    double held[MOST_BEARINGS];
    bearings_t resting = {.count = 0};
    vector3_t there, given, size, asked = {0, 0, 0};
    memset(nu_dot, 0, sizeof(vector3_t));
    for (int trial = 0; trial < 20*(1 + count); trial++) {
        motion_with(mass, force, bearings, signs, &resting, places, there, given, size);
        const double part = way_to_rest(bearings, signs, nu_dot, there);
        const double longest = fmax(length3(nu_dot), length3(there));
        for (int k = 0; k < 3; k++) {
            nu_dot[k] = part < 1 ? nu_dot[k] + part*(there[k] - nu_dot[k]) : there[k];
            asked[k] = dot3(mass[k], there) - given[k];
        }
        if (part < 1) {
            for (int i = 0; i < count; i++)
                if (signs[i]*dot3(bearings->rows[i], nu_dot) <= TIE*length3(bearings->rows[i])*longest)
                    signs[i] = 0;
            continue;
        }
        const facet_t *const facet = passed_facet(facets, facets_of(&resting, facets), asked, size);
        if (!facet)
            break;
        for (int k = 0; k < resting.count; k++)
            signs[places[k]] = breaks_away(resting.rows[k], facet);
    }
    least_torques(&resting, asked, held);
    for (int i = 0; i < count; i++)
        torques[i] = -signs[i]*bearings->bounds[i];
    for (int k = 0; k < resting.count; k++)
        torques[places[k]] = held[k];
}

#if SET_SPINS_STICK
#define MOST_TRIALS 200             /* for a number that is found exactly, as a rule after a few             */

/* Free rollers at rest on their disks: their accelerations are torque/inertia - (per_yaw nu_3' + given). */
typedef struct {
    int count;
    double inertia;
    const double *per_yaw, *given, *bounds;
} spinning_t;

/* The torque of a roller's bearing where nu_3' is this: what takes it along, up to its bound; whether that is more. */
ALWAYS_INLINE double torque_of_spin(const spinning_t *spins, int k, double yaw, int *turns)
{
    const double asked = spins->inertia*(spins->per_yaw[k]*yaw + spins->given[k]);
    *turns = fabs(asked) > spins->bounds[k];
    return clipped(asked, spins->bounds[k]);
}

/* What these torques take of f_3: affine in nu_3', offset + inertia nu_3', as long as the same rollers stick. Returns its
 * value there; size: of its terms. */
static double drag_of_spins(const spinning_t *spins, double yaw, double *offset, double *inertia, double *size)
{
    double value = 0;
    *offset = *inertia = *size = 0;
    for (int k = 0; k < spins->count; k++) {
        int turns;
        const double per_yaw = spins->per_yaw[k], torque = torque_of_spin(spins, k, yaw, &turns);
        value += per_yaw*torque;
        *size += fabs(per_yaw*torque) + fabs(per_yaw*spins->inertia*spins->given[k]);
        *inertia += turns ? 0 : spins->inertia*per_yaw*per_yaw;
        *offset += turns ? per_yaw*torque : spins->inertia*per_yaw*spins->given[k];
    }
    return value;
}

/* The same nu' beside free rollers at rest. These take a force of f_3 that grows with nu_3', piecewise linearly, and
 * nu_3' falls as that force grows: there is one nu_3' at which both agree. Newton's rule finds it, within bounds that
 * each trial narrows; of as many pieces as there are the right one is met. */
static void nearest_beside_spins(const vector3_t *mass, const double *force, const bearings_t *bearings,
                                 const spinning_t *spins, facet_t *facets, double *nu_dot, double *torques)
{
    double low = -INFINITY, high = INFINITY, yaw = 0;
    for (int trial = 0; trial < MOST_TRIALS; trial++) {
        vector3_t heavier[3], rest = {force[0], force[1], force[2]};
        double offset, inertia, size, none;
        drag_of_spins(spins, yaw, &offset, &inertia, &size);
        memcpy(heavier, mass, sizeof heavier);
        heavier[2][2] += inertia;
        rest[2] -= offset;
        nearest_force((const vector3_t *)heavier, rest, bearings, facets, nu_dot, torques);
        const double meant = offset + inertia*nu_dot[2], there = drag_of_spins(spins, nu_dot[2], &none, &none, &size);
        if (fabs(there - meant) <= 4*EPS*size || nu_dot[2] == yaw)
            return;
        if (nu_dot[2] > yaw)
            low = yaw;
        else
            high = yaw;
        yaw = nu_dot[2] > low && nu_dot[2] < high ? nu_dot[2] : low + (high - low)/2;
    }
}
#endif
#endif
