/* Which contacts at rest stick on the ground and which slip: the complementarity problem of set-valued friction in the
 * plane. runtime/omniroll/effects/cones.py says what is solved here; the names are the same. */
#define SWEEPS 400                  /* rounds over the contacts                                             */
#define BETWEEN 8                   /* of them, before each try of Newton's rule                            */
#define NEWTON 30                   /* rounds of Newton's rule                                              */
#define CONE_SETTLED 1e-14
#define ON_THE_EDGE 1e-7            /* of the radius: contacts nearer to it may slip                        */
#if SET_STRIPS
#define FURTHER 10                  /* rounds behind those, in which conditions are dropped that hold within rounding */
#define HOLDS 4                     /* roundings of what makes a condition: it holds                        */
#else
#define FURTHER 0
#endif
#if SET_STANDS_BOTH_WAYS            /* contacts, and all bearings beside them: their number is not known beforehand */
#define ARRAY_OF(type, name, size) type *name
#else
#define MOST_PARTS (SET_STANDS ? 2*MOST_WHEELS : MOST_WHEELS)   /* contacts, and axles beside them               */
#define MOST_FORCES (2*MOST_PARTS)
#define MOST_ROWS (3*MOST_PARTS)   /* of Newton's rule: forces and pulls                                   */
#define ARRAY_OF(type, name, size) type name[size]
#endif

#if SET_STANDS
/* Contacts and bearings at rest, as parts of one problem: contacts first. `which`: wheels, or places among the
 * bearings. */
typedef struct {
    int contacts, count;
    ARRAY_OF(int, which, MOST_PARTS);
    ARRAY_OF(int, broken, MOST_PARTS);              /* those that have broken away slide                     */
    ARRAY_OF(int, slips, MOST_PARTS);
#if SET_STRIPS
    int rolls;                                      /* contacts that rest along the rolling direction alone, behind
                                                     * those that rest both ways                             */
    int *turned, *turns;                            /* rollers of the latter: have broken away, and turn     */
#endif
} parts_at_rest_t;
#endif

/* A disc may be cut by a strip, which its first component does not leave (see cones.py). */
#if SET_STRIPS
#define OF_STRIP(d, i) ((d)->strip[i])
#else
#define OF_STRIP(d, i) INFINITY
#endif

/* What Newton's rule works with. */
typedef struct {
    ARRAY_OF(double, system, MOST_ROWS*MOST_ROWS);
    ARRAY_OF(double, step, MOST_ROWS);
    ARRAY_OF(double, start, MOST_FORCES);
    ARRAY_OF(int, slips, MOST_PARTS);
    ARRAY_OF(int, slipping, MOST_PARTS);
} newton_on_discs_t;

/* Discs of radius 1: forces with |place_i| <= 1 for which place^T matrix place/2 + wanted^T place is least. */
typedef struct {
    int count, wide, width, size;                   /* `width` components each, but 1 behind the first `wide`  */
    ARRAY_OF(double, matrix, MOST_FORCES*MOST_FORCES);
    ARRAY_OF(double, wanted, MOST_FORCES);
    ARRAY_OF(double, place, MOST_FORCES);
    ARRAY_OF(double, pull, MOST_PARTS);
    newton_on_discs_t newton;
#if SET_STRIPS
    double *strip;                                  /* the largest first component, INFINITY where none cuts  */
    int *edge;                                      /* the sign of one that is at its strip's edge, else 0    */
#endif
} discs_t;

/* Forces F with |F_i/reach_i| <= 1 for which F^T D F/2 + a^T F is least. */
typedef struct {
    int count, wide, width;                         /* as of discs                               */
    ARRAY_OF(double, matrix, MOST_FORCES*MOST_FORCES);      /* D                                 */
    ARRAY_OF(double, given, MOST_FORCES);           /* a, and the half-axes of the ellipses      */
    ARRAY_OF(double, reach, MOST_FORCES);
    ARRAY_OF(double, force, MOST_FORCES);           /* out: F and D F + a                        */
    ARRAY_OF(double, rate, MOST_FORCES);
    ARRAY_OF(double, pull, MOST_PARTS);             /* out: how strongly a contact slips, >= 0   */
#if SET_STANDS_BOTH_WAYS
    double *first, *before, *own, *drawn, *whole;   /* scratch: a; the last round's forces; D's diagonal, and what is
                                                     * added to it; half-axes                    */
    discs_t discs;
#endif
#if SET_STRIPS
    double *strip;                                  /* the largest first components of the forces            */
    double *yields;                                 /* out: how strongly what is behind a strip gives way    */
#endif
} cones_t;

/* Where the forces of a part begin, and how many components they have; all parts are alike unless some bear rollers. */
ALWAYS_INLINE int forces_at(int wide, int width, int part)
{
    return SET_STANDS_BOTH_WAYS && part > wide ? wide*width + (part - wide) : part*width;
}

ALWAYS_INLINE int width_of(int wide, int width, int part)
{
    return SET_STANDS_BOTH_WAYS && part >= wide ? 1 : width;
}

/* The part whose force stands at a place. */
ALWAYS_INLINE int part_of(int wide, int width, int place)
{
    return SET_STANDS_BOTH_WAYS && place >= wide*width ? wide + (place - wide*width) : place/width;
}

static double length_of(const double *vector, int width)
{
    return width == 1 ? fabs(vector[0]) : sqrt(vector[0]*vector[0] + vector[1]*vector[1]);
}

ALWAYS_INLINE int disc_at(const discs_t *d, int i)
{
    return forces_at(d->wide, d->width, i);
}

ALWAYS_INLINE int disc_width(const discs_t *d, int i)
{
    return width_of(d->wide, d->width, i);
}

/* matrix place + wanted, one component. */
static double slope_at(const discs_t *d, int row)
{
    double sum = d->wanted[row];
    for (int k = 0; k < d->size; k++)
        sum += d->matrix[row*d->size + k]*d->place[k];
    return sum;
}

/* The g with |g| <= 1 for which g^T matrix g/2 + wanted . g is least, of one disc: inside, or on the circle, by
 * Newton's rule on 1/|g| (Hebden). The matrix is [[a, b], [b, c]]. */
static void one_disc(double a, double b, double c, const double *wanted, double *place)
{
    const double middle = (a + c)/2, radius = hypot((a - c)/2, b), angle = atan2(b, (a - c)/2)/2;
    const double large = middle + radius, values[2] = {large, (a*c - b*b)/large};
    const double cosine = cos(angle), sine = sin(angle);
    const double along[2] = {cosine*wanted[0] + sine*wanted[1], cosine*wanted[1] - sine*wanted[0]};
    double pull = 0, g[2] = {-along[0]/values[0], -along[1]/values[1]};
    if (g[0]*g[0] + g[1]*g[1] > 1) {
        for (int k = 0; k < NEWTON; k++) {
            const double one = values[0] + pull, two = values[1] + pull;
            const double squares = along[0]*along[0]/(one*one) + along[1]*along[1]/(two*two), size = sqrt(squares);
            const double bend = along[0]*along[0]/(one*one*one) + along[1]*along[1]/(two*two*two);
            const double step = (size - 1)*squares/bend;
            pull += step;
            if (fabs(step) <= EPS*(pull + values[1]))
                break;
        }
        g[0] = -along[0]/(values[0] + pull), g[1] = -along[1]/(values[1] + pull);
        const double size = length_of(g, 2);
        g[0] /= size, g[1] /= size;
    }
    place[0] = cosine*g[0] - sine*g[1], place[1] = sine*g[0] + cosine*g[1];
}

/* The same where the first component is at the edge of a strip, since the minimum over the disc lies beyond that. */
ALWAYS_INLINE void on_edge(double b, double c, const double *wanted, double edge, double *place)
{
    const double most = sqrt((1 - edge)*(1 + edge));
    place[0] = edge;
    place[1] = fmax(-most, fmin(most, -(wanted[1] + b*edge)/c));
}

/* One round over the discs, each solved exactly; returns the largest change. */
static double go_round(discs_t *d)
{
    double largest = 0;
    for (int i = 0; i < d->count; i++) {
        const int n = d->size, own = disc_at(d, i), width = disc_width(d, i);
        const double *const block = d->matrix + own*n + own;
        double before[2] = {0, 0}, rest[2] = {0, 0};
        for (int k = 0; k < width; k++) {
            before[k] = d->place[own + k];
            rest[k] = slope_at(d, own + k);
            for (int l = 0; l < width; l++)
                rest[k] -= block[k*n + l]*d->place[own + l];
        }
        if (width == 1)
            d->place[own] = fmax(-1, fmin(1, -rest[0]/block[0]));
        else
            one_disc(block[0], block[1], block[n + 1], rest, d->place + own);
        if (width == 2 && fabs(d->place[own]) > OF_STRIP(d, i))
            on_edge(block[1], block[n + 1], rest, copysign(OF_STRIP(d, i), d->place[own]), d->place + own);
        for (int k = 0; k < width; k++)
            largest = fmax(largest, fabs(d->place[own + k] - before[k]));
    }
    return largest;
}

/* How strongly a disc's force is pulled against its rate. */
static double pull_of(const discs_t *d, int i)
{
    double sum = 0;
    for (int k = disc_at(d, i); k < disc_at(d, i + 1); k++)
        sum -= d->place[k]*slope_at(d, k);
    return sum;
}

#if SET_STRIPS
/* Those at the edges of their strips keep their first components. */
static void keep_edges(const discs_t *d, int whole, double *system, double *missing)
{
    for (int i = 0; i < d->wide; i++) {
        const int row = disc_at(d, i);
        if (!d->edge[i])
            continue;
        memset(system + row*whole, 0, sizeof *system*(size_t)whole);
        system[row*whole + row] = 1, missing[row] = 0;
    }
}

/* Those at the edges of their strips are put there. */
static void put_at_edges(discs_t *d)
{
    for (int i = 0; i < d->wide; i++)
        if (d->edge[i])
            d->place[disc_at(d, i)] = d->edge[i]*d->strip[i];
}

/* Which discs are at the edges of their strips, at the present place. */
static void find_edges(discs_t *d)
{
    for (int i = 0; i < d->wide; i++) {
        const double first = d->place[disc_at(d, i)];
        d->edge[i] = fabs(first) >= d->strip[i]*(1 - ON_THE_EDGE) ? (first > 0) - (first < 0) : 0;
    }
}

/* Edges that forces have left, or have come to; returns how many. */
static int change_edges(discs_t *d)
{
    int count = 0;
    for (int i = 0; i < d->wide; i++) {
        const int own = disc_at(d, i), edge = d->edge[i];
        const double first = d->place[own];
        if (edge ? -edge*(slope_at(d, own) + d->pull[i]*first) < 0 : fabs(first) > d->strip[i]*(1 + 4*EPS))
            count++, d->edge[i] = edge ? 0 : (first > 0) - (first < 0);
    }
    return count;
}
#endif

/* The system of Newton's rule on the conditions where those of `slipping` are on their circles. */
static void conditions(const discs_t *d, const int *slipping, int slips, double *system, double *missing)
{
    const int size = d->size, whole = size + slips;
    memset(system, 0, sizeof *system*(size_t)(whole*whole));
    for (int k = 0; k < size; k++) {
        memcpy(system + k*whole, d->matrix + k*size, sizeof *system*(size_t)size);
        const double pull = d->pull[part_of(d->wide, d->width, k)];
        system[k*whole + k] += pull;
        missing[k] = slope_at(d, k) + pull*d->place[k];
    }
    for (int s = 0; s < slips; s++) {
        double square = 0;
        for (int k = disc_at(d, slipping[s]); k < disc_at(d, slipping[s] + 1); k++) {
            system[k*whole + size + s] = system[(size + s)*whole + k] = d->place[k];
            square += d->place[k]*d->place[k];
        }
        missing[size + s] = (square - 1)/2;
    }
#if SET_STRIPS
    keep_edges(d, whole, system, missing);
#endif
}

#if FURTHER
/* What is missing in conditions on rates that hold within rounding: nothing. Where all that slips is pulled by next to
 * nothing, such a rounding would turn the forces by far more. */
static void drop_rounding(const discs_t *d, double *missing)
{
    for (int k = 0; k < d->size; k++) {
        double sum = fabs(d->wanted[k]);
        for (int l = 0; l < d->size; l++)
            sum += fabs(d->matrix[k*d->size + l]*d->place[l]);
        if (fabs(missing[k]) <= HOLDS*EPS*sum)
            missing[k] = 0;
    }
}
#endif

/* Newton's rule on these conditions: whether it has ended. */
static int with_slipping(discs_t *d, const int *slipping, int slips)
{
    double *const system = d->newton.system, *const step = d->newton.step, last = INFINITY, change = INFINITY;
    const int size = d->size;
    for (int i = 0; i < d->count; i++)
        d->pull[i] = 0;
    for (int s = 0; s < slips; s++)
        d->pull[slipping[s]] = pull_of(d, slipping[s]);
    for (int round = 0; round < NEWTON + FURTHER; round++) {
        conditions(d, slipping, slips, system, step);
#if FURTHER
        if (round >= NEWTON)
            drop_rounding(d, step);
#endif
        solve_rows(system, size + slips, step);
        change = 0;
        for (int k = 0; k < size + slips; k++)
            change = isnan(change) || fabs(step[k]) <= change ? change : fabs(step[k]);
        for (int k = 0; k < size; k++)
            d->place[k] -= step[k];
        for (int s = 0; s < slips; s++)
            d->pull[slipping[s]] -= step[size + s];
        if (!(change < INFINITY) || change <= CONE_SETTLED || (change >= last && change < ON_THE_EDGE))
            break;
        last = change;
    }
    return change < ON_THE_EDGE;
}

/* The minimum by Newton's rule, from those that slip at the present place on; false, and nothing changed, where that
 * does not lead to it. */
static int polish(discs_t *d)
{
    double *const start = d->newton.start;
    int *const slips = d->newton.slips, *const slipping = d->newton.slipping;
    memcpy(start, d->place, sizeof *start*(size_t)d->size);
    for (int i = 0; i < d->count; i++)
        slips[i] = length_of(d->place + disc_at(d, i), disc_width(d, i)) >= 1 - ON_THE_EDGE && pull_of(d, i) > 0;
#if SET_STRIPS
    find_edges(d);
#endif
    for (int round = 0; round < (2 + 2*SET_STRIPS)*d->count; round++) {
        int count = 0, wrong = 0;
#if SET_STRIPS
        put_at_edges(d);
#endif
        for (int i = 0; i < d->count; i++)
            if (slips[i])
                slipping[count++] = i;
        const int exact = with_slipping(d, slipping, count);
#if SET_STRIPS
        wrong = exact ? change_edges(d) : 0;
#endif
        for (int i = 0; i < d->count && exact; i++) {
            double *const own = d->place + disc_at(d, i), length = length_of(own, disc_width(d, i));
            if (slips[i] ? d->pull[i] < 0 : length > 1 + 4*EPS)
                wrong++, slips[i] = !slips[i];
            else
                for (int k = 0; k < disc_width(d, i); k++)
                    own[k] /= fmax(length, 1);
        }
        if (exact && !wrong)
            return 1;
        memcpy(d->place, start, sizeof *start*(size_t)d->size);
        if (!exact)
            break;
    }
    return 0;
}

/* The minimum, from a place that may be near it; false where rounds have come to their end without it. */
static int least_of_discs(discs_t *d, int is_near)
{
    if (is_near && polish(d))
        return 1;
    memset(d->place, 0, sizeof *d->place*(size_t)d->size);
    for (int round = 1; round <= SWEEPS; round++) {
        const int settled = go_round(d) <= CONE_SETTLED;
        if ((settled || round%BETWEEN == 0) && polish(d))
            return 1;
        if (settled)
            return 1;
    }
    return 0;
}

/* The discs of a problem, in its own units; returns these. */
static double discs_of(const cones_t *c, discs_t *d)
{
    double unit = 0;
    d->count = c->count, d->wide = c->wide, d->width = c->width;
    d->size = forces_at(c->wide, c->width, c->count);
    for (int j = 0; j < d->size; j++) {
        d->wanted[j] = c->given[j]*c->reach[j];
        unit = fmax(unit, fabs(d->wanted[j]));
        for (int k = 0; k < d->size; k++) {
            d->matrix[j*d->size + k] = c->matrix[j*d->size + k]*c->reach[j]*c->reach[k];
            unit = fmax(unit, fabs(d->matrix[j*d->size + k]));
        }
    }
#if SET_STRIPS
    for (int i = 0; i < d->wide; i++) {
        const double reach = c->reach[disc_at(d, i)];
        d->strip[i] = c->strip[i] < reach ? c->strip[i]/reach : INFINITY;
    }
#endif
    for (int j = 0; j < d->size; j++) {
        d->wanted[j] /= unit;
        for (int k = 0; k < d->size; k++)
            d->matrix[j*d->size + k] /= unit;
    }
    return unit;
}

/* The minimum. `is_near`: c->force is thought to be near it. */
static void decide_cones(cones_t *c, int is_near)
{
#if SET_STANDS_BOTH_WAYS
    discs_t *const d = &c->discs;
#else
    discs_t discs, *const d = &discs;
#endif
    const double unit = discs_of(c, d);
    for (int j = 0; j < d->size && is_near; j++)
        d->place[j] = c->force[j]/c->reach[j];
    least_of_discs(d, is_near);
    for (int i = 0; i < c->count; i++)
        c->pull[i] = 0;
    for (int j = 0; j < d->size; j++) {
        c->rate[j] = slope_at(d, j)*unit/c->reach[j];
        c->force[j] = d->place[j]*c->reach[j];
        c->pull[part_of(c->wide, c->width, j)] -= d->place[j]*c->rate[j]*c->reach[j];
    }
}

#if SET_STANDS
#define DRAWN 1e-6                  /* of a size: how strongly forces that need not be unique are drawn         */
#define DRAWN_ROUNDS 60

/* Room for the forces of a problem, which is not known beforehand where rollers are in it. */
#if SET_STANDS_BOTH_WAYS
#define ROOM_FOR_FORCES(c) double *const given = (c)->first, *const before = (c)->before, *const own = (c)->own, \
    *const drawn = (c)->drawn
#else
#define ROOM_FOR_FORCES(c) double given[MOST_FORCES], before[MOST_FORCES], own[MOST_FORCES], drawn[MOST_FORCES]
#endif

/* How strongly each force of a problem is drawn: by a part of the largest size, or where rollers are among them, which
 * may be light, by a part of its own. */
static void put_drawn(const cones_t *c, int size, double *drawn)
{
    double largest = 0;
    for (int j = 0; j < size; j++) {
        largest = fmax(largest, fabs(c->given[j]*c->reach[j]));
        for (int k = 0; k < size; k++)
            largest = fmax(largest, fabs(c->matrix[j*size + k])*c->reach[j]*c->reach[k]);
    }
    for (int j = 0; j < size; j++)
        drawn[j] = SET_STANDS_BOTH_WAYS ? DRAWN*c->matrix[j*size + j] : DRAWN*largest/(c->reach[j]*c->reach[j]);
}

#if SET_STANDS_BOTH_WAYS
#define NEARBY 0.01                 /* of what parts take: so far from where rounds have ended the minimum may be */

/* Where what is drawn is more than what contacts that only just slip are pulled by, the rounds end slowly: the
 * conditions themselves give their directions, if that leads to forces nearby. `own`: D's diagonal. */
static void decide_from_here(cones_t *c, int size, const double *own)
{
    double farthest = 0;
    for (int j = 0; j < size; j++) {
        c->matrix[j*size + j] = own[j];
        c->before[j] = c->force[j];
    }
    discs_of(c, &c->discs);
    for (int j = 0; j < size; j++)
        c->discs.place[j] = c->force[j]/c->reach[j];
    if (!polish(&c->discs))
        return;
    for (int j = 0; j < size; j++)
        farthest = fmax(farthest, fabs(c->discs.place[j] - c->before[j]/c->reach[j]));
    for (int j = 0; j < size && farthest < NEARBY; j++)
        c->force[j] = c->discs.place[j]*c->reach[j];
}
#endif

#if SET_STRIPS
/* The two parts of what a contact does that is cut by a strip: along its disc, and across the strip where its force is
 * at the edge. */
static void put_parts_of_rate(cones_t *c)
{
    for (int i = 0; i < c->wide; i++) {
        const int own = forces_at(c->wide, c->width, i);
        const double *const reach = c->reach + own;
        const double place[2] = {c->force[own]/reach[0], c->force[own + 1]/reach[1]};
        const double rate[2] = {c->rate[own]*reach[0], c->rate[own + 1]*reach[1]};
        c->yields[i] = 0;
        if (!(fabs(c->force[own]) >= c->strip[i]*(1 - ON_THE_EDGE)))
            continue;
        const double along = length_of(place, 2) >= 1 - ON_THE_EDGE ? -rate[1]/place[1] : 0;    /* in a corner      */
        c->yields[i] = fmax(-place[0]*rate[0] - along*place[0]*place[0], 0);
        c->pull[i] = fmax(along, 0);
    }
}
#endif

/* The same where D is semidefinite, by rounds of the proximal point: see cones.py. */
static void decide_semidefinite(cones_t *c)
{
    const int size = forces_at(c->wide, c->width, c->count);
    ROOM_FOR_FORCES(c);
    memset(c->force, 0, sizeof *c->force*(size_t)size);
    memcpy(given, c->given, sizeof *given*(size_t)size);
    put_drawn(c, size, drawn);
    for (int j = 0; j < size; j++) {
        own[j] = c->matrix[j*size + j];
        c->matrix[j*size + j] += drawn[j];
    }
    for (int round = 0; round < DRAWN_ROUNDS; round++) {
        double changed = 0;
        for (int j = 0; j < size; j++) {
            before[j] = c->force[j];
            c->given[j] = given[j] - drawn[j]*before[j];
        }
        decide_cones(c, SET_STANDS_BOTH_WAYS && round > 0);
        for (int j = 0; j < size; j++)
            changed = fmax(changed, fabs(c->force[j] - before[j])/c->reach[j]);
        if (changed <= CONE_SETTLED)
            break;
    }
    memcpy(c->given, given, sizeof *given*(size_t)size);
#if SET_STANDS_BOTH_WAYS
    decide_from_here(c, size, own);
#endif
    for (int i = 0; i < c->count; i++)
        c->pull[i] = 0;
    for (int j = 0; j < size; j++) {
        c->matrix[j*size + j] = own[j];
        c->rate[j] = given[j];
        for (int k = 0; k < size; k++)
            c->rate[j] += c->matrix[j*size + k]*c->force[k];
        c->pull[part_of(c->wide, c->width, j)] -= c->rate[j]*c->force[j];
    }
    for (int i = 0; i < c->count; i++)
        c->pull[i] = fmax(c->pull[i], 0);
#if SET_STRIPS
    put_parts_of_rate(c);
#endif
}
#endif
