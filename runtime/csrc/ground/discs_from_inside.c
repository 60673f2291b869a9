/* The minimum over discs from their inside: an interior-point method for a matrix that is semidefinite.
 *
 * Where contacts are only just pulled, D feels how their forces turn by next to nothing: on a slope that is steeper
 * than friction by 1e-9 of it all rates are 1e-9 of what the forces make of them. Forces that are drawn by more than
 * that turn for thousands of rounds. Here each disc has a slack s, s = (1 - |y|^2)/2, and a pull p, (A y + w)_i =
 * -p y_i, and the products p s fall together by a part in each round of Newton's rule, which knows no such rates: some
 * thirty rounds lead to rounding. Of forces that are not unique these are amid all that balance. A strip that cuts a disc
 * has a slack and a pull as well, s = (1 - (y_1/strip)^2)/2; they stand behind those of the discs. */
#if SET_STARTS_INSIDE
#define INSIDE_ROUNDS 80
#define PRODUCTS_LEFT 1e-18         /* of the problem's size: p s behind the last round                     */
#define LEAST_SLACK 1e-14           /* of a disc: the rounds end; with less rounding hides how it may turn   */
#define FALLS 0.1                   /* of p s: what a round leaves                                          */
#define FALLS_LESS 0.5              /* the same behind one that could not be made whole                     */
#define WHOLE 0.5                   /* of a round's step: more than that is nearly whole                    */
#define STAYS_INSIDE 0.9            /* of the way to the edge of p > 0 and s > 0                            */
#define STEADIES 1e-14              /* of the diagonal, more: keeps what no rate depends on where it is      */
#define LEAST_SCALE 1e-30           /* of the problem's size                                                */

/* The size of what acts on a disc, with which its product is measured: rollers may be light. */
static double scale_of_disc(const discs_t *d, int i)
{
    double scale = LEAST_SCALE;
    for (int k = disc_at(d, i); k < disc_at(d, i + 1); k++) {
        double sum = fabs(d->wanted[k]);
        for (int l = 0; l < d->size; l++)
            sum += fabs(d->matrix[k*d->size + l]);
        scale = fmax(scale, sum);
    }
    return scale;
}

/* (|y|^2 - 1)/2 + s of a disc, which is zero at the end. */
static double slack_off(const discs_t *d, int i)
{
    double twice = -1;
    for (int k = disc_at(d, i); k < disc_at(d, i + 1); k++)
        twice += d->place[k]*d->place[k];
    return d->slack[i] + twice/2;
}

#if SET_STRIPS
/* What cuts a disc: its slack and its pull, and how large the first component may be. */
typedef struct {
    double *slack, *pull, scale, strip, *place;
    int row;                                        /* of that component                                     */
} cut_t;

/* The cut of a disc; whether it has one. */
static int get_cut(const discs_t *d, int i, cut_t *cut)
{
    cut->row = disc_at(d, i), cut->strip = d->strip[i], cut->scale = d->scale[i];
    cut->slack = d->slack + d->count + i, cut->pull = d->pull + d->count + i, cut->place = d->place + cut->row;
    return cut->strip < INFINITY;
}

/* The same as slack_off(). */
static double off_cut(const cut_t *cut)
{
    const double part = *cut->place/cut->strip;
    return *cut->slack + (part*part - 1)/2;
}

/* What cuts add to the system of step_inside(). */
static void add_cuts(discs_t *d, double left)
{
    for (int i = 0; i < d->wide; i++) {
        cut_t cut;
        if (!get_cut(d, i, &cut))
            continue;
        const double pull = *cut.pull, slack = *cut.slack, normal = *cut.place/(cut.strip*cut.strip);
        const double along = (left*cut.scale + pull*off_cut(&cut))/slack - pull;
        d->newton.step[cut.row] -= (pull + along)*normal;
        d->newton.system[cut.row*d->size + cut.row] += pull/(cut.strip*cut.strip) + pull/slack*normal*normal;
    }
}

/* The same as follow_step(), of a disc that is cut; whether it is. */
static int follow_cut(const discs_t *d, int i, double left, cut_t *cut, double *slack, double *pull)
{
    if (!get_cut(d, i, cut))
        return 0;
    *slack = -off_cut(cut) - *cut->place/(cut->strip*cut->strip)*d->newton.step[cut->row];
    *pull = (left*cut->scale - *cut->pull*(*cut->slack + *slack))/ *cut->slack;
    return 1;
}

/* How much of a step leaves slack and pull of all cuts positive. */
static double part_inside_cuts(const discs_t *d, double left, double part)
{
    for (int i = 0; i < d->wide; i++) {
        cut_t cut;
        double slack, pull;
        if (!follow_cut(d, i, left, &cut, &slack, &pull))
            continue;
        if (slack < 0)
            part = fmin(part, -STAYS_INSIDE**cut.slack/slack);
        if (pull < 0)
            part = fmin(part, -STAYS_INSIDE**cut.pull/pull);
    }
    return part;
}

/* Before the places have moved. */
static void move_cuts(const discs_t *d, double left, double part)
{
    for (int i = 0; i < d->wide; i++) {
        cut_t cut;
        double slack, pull;
        if (!follow_cut(d, i, left, &cut, &slack, &pull))
            continue;
        *cut.slack += part*slack, *cut.pull += part*pull;
    }
}

static void begin_cuts(const discs_t *d)
{
    for (int i = 0; i < d->wide; i++)
        d->pull[d->count + i] = d->scale[i], d->slack[d->count + i] = 0.5;
}

/* The mean of all products, over the scales, from that of the discs; and the least slack. */
static void look_at_cuts(const discs_t *d, double *left, double *least)
{
    int count = d->count;
    double sum = *left*d->count;
    for (int i = 0; i < d->wide; i++) {
        cut_t cut;
        if (!get_cut(d, i, &cut))
            continue;
        count++, sum += *cut.pull**cut.slack/cut.scale, *least = fmin(*least, *cut.slack);
    }
    *left = sum/count;
}

/* Forces that are at the edges of their strips are put there. */
static void end_at_cuts(const discs_t *d)
{
    for (int i = 0; i < d->wide; i++) {
        cut_t cut;
        if (get_cut(d, i, &cut) && *cut.pull > *cut.slack*cut.scale)
            *cut.place = copysign(cut.strip, *cut.place);
    }
}
#endif

/* The change of all places in a round of Newton's rule, into d->newton.step. `left`: the products, over the scales. */
static void step_inside(discs_t *d, double left)
{
    const int n = d->size;
    double *const system = d->newton.system, *const step = d->newton.step, *const unit = d->newton.start;
    memcpy(system, d->matrix, sizeof *system*(size_t)(n*n));
    for (int i = 0; i < d->count; i++) {
        const double pull = d->pull[i], slack = d->slack[i];
        const double along = (left*d->scale[i] + pull*slack_off(d, i))/slack - pull;
        for (int k = disc_at(d, i); k < disc_at(d, i + 1); k++) {
            step[k] = -slope_at(d, k) - (pull + along)*d->place[k];
            system[k*n + k] += pull + STEADIES*fmax(d->matrix[k*n + k], LEAST_SCALE);
            for (int l = disc_at(d, i); l < disc_at(d, i + 1); l++)
                system[k*n + l] += pull/slack*d->place[k]*d->place[l];
        }
    }
#if SET_STRIPS
    add_cuts(d, left);
#endif
    for (int k = 0; k < n; k++)
        unit[k] = 1/sqrt(system[k*n + k]);
    for (int k = 0; k < n; k++) {
        step[k] *= unit[k];
        for (int l = 0; l < n; l++)
            system[k*n + l] *= unit[k]*unit[l];
    }
    solve_rows(system, n, step);
    for (int k = 0; k < n; k++)
        step[k] *= unit[k];
}

/* What a step of the places changes slack and pull of a disc by. */
static void follow_step(const discs_t *d, int i, double left, double *slack, double *pull)
{
    *slack = -slack_off(d, i);
    for (int k = disc_at(d, i); k < disc_at(d, i + 1); k++)
        *slack -= d->place[k]*d->newton.step[k];
    *pull = (left*d->scale[i] - d->pull[i]*(d->slack[i] + *slack))/d->slack[i];
}

/* Makes as much of a step as stays inside; returns how much. */
static double go_inside(discs_t *d, double left)
{
    double part = 1, slack, pull;
    for (int i = 0; i < d->count; i++) {
        follow_step(d, i, left, &slack, &pull);
        if (slack < 0)
            part = fmin(part, -STAYS_INSIDE*d->slack[i]/slack);
        if (pull < 0)
            part = fmin(part, -STAYS_INSIDE*d->pull[i]/pull);
    }
#if SET_STRIPS
    part = part_inside_cuts(d, left, part);
    move_cuts(d, left, part);
#endif
    for (int i = 0; i < d->count; i++) {
        follow_step(d, i, left, &slack, &pull);
        d->slack[i] += part*slack, d->pull[i] += part*pull;
        for (int k = disc_at(d, i); k < disc_at(d, i + 1); k++)
            d->place[k] += part*d->newton.step[k];
    }
    return part;
}

/* The minimum, into d->place. */
static void least_from_inside(discs_t *d)
{
    double falls = FALLS;
    memset(d->place, 0, sizeof *d->place*(size_t)d->size);
    for (int i = 0; i < d->count; i++)
        d->scale[i] = d->pull[i] = scale_of_disc(d, i), d->slack[i] = 0.5;
#if SET_STRIPS
    begin_cuts(d);
#endif
    for (int round = 0; round < INSIDE_ROUNDS; round++) {
        double left = 0, least = 1;
        for (int i = 0; i < d->count; i++) {
            left += d->pull[i]*d->slack[i]/d->scale[i]/d->count;
            least = fmin(least, d->slack[i]);
        }
#if SET_STRIPS
        look_at_cuts(d, &left, &least);
#endif
        if (!(left > PRODUCTS_LEFT && least > LEAST_SLACK))
            break;
        step_inside(d, falls*left);
        falls = go_inside(d, falls*left) > WHOLE ? FALLS : FALLS_LESS;
    }
    for (int i = 0; i < d->count; i++) {
        double *const own = d->place + disc_at(d, i);
        const double length = length_of(own, disc_width(d, i));
        for (int k = 0; k < disc_width(d, i) && d->pull[i] > d->slack[i]*d->scale[i]; k++)
            own[k] /= length;
    }
#if SET_STRIPS
    end_at_cuts(d);
#endif
}
#endif
