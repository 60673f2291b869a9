/* How much wheels that stand use of what contacts and bearings can hold, and the forces that use least. friction/ finds
 * these where there are many; where they are determined each gauge by itself is its use. */
#define MAX_STANDING MAX_BEARINGS           /* forces: two of a wheel                                           */
#define INSIDE 1e-9                         /* below 1: a use that leaves forces to choose                      */
#define NEAR_USED 1e-6              /* a use that is farther below 1 than this is of no interest             */
#define NO_TORQUE 1e-300                    /* N m, where no bearing takes anything                             */

/* What a force in direction d of a standing wheel asks of its bearing, per N. */
ALWAYS_INLINE double arm_of(const standing_t *standing, int d, const demand_t *now)
{
    return standing->direction[d] ? -standing->radius : now->arm[standing->wheel[d]];
}

/* What its bearing can hold, in N m; and the demand on it where the ground takes nothing in this direction. */
ALWAYS_INLINE double bound_of_bearing(const standing_t *standing, int d)
{
    return fmax(standing->holding[d], LEAST_REACH*standing->max_holding + NO_TORQUE);
}

ALWAYS_INLINE double demand_on_bearing(const standing_t *standing, int d, const demand_t *now)
{
    return now->of_bearings[2*standing->wheel[d] + standing->direction[d]];
}

/* How much of its friction a contact uses where these forces hold the wheels that stand: of wheels that roll, nothing. */
static double contact_use(const standing_t *standing, const demand_t *now, const double *forces, int wheel)
{
    if (SET_HOLDS)
        return 0;
    double force[2] = {now->along[2*wheel], now->along[2*wheel + 1]}, part[2] = {0, 0};
    for (int d = 0; d < standing->count; d++)
        if (standing->wheel[d] == wheel)
            force[standing->direction[d]] = forces[d];
    for (int k = SET_FIRST_DIRECTION; k < 2; k++)
        part[k] = force[k]/standing->of_ground[2*wheel + k];
    return length_of(part, 2);
}

/* The same of the bearing in direction d, with the sign of its torque. */
ALWAYS_INLINE double bearing_use(const standing_t *standing, const demand_t *now, const double *forces, int d)
{
    return (demand_on_bearing(standing, d, now) + arm_of(standing, d, now)*forces[d])/bound_of_bearing(standing, d);
}

static double largest_use(const standing_t *standing, const demand_t *now, const double *forces)
{
    double largest = 0;
    for (int d = 0; d < standing->count; d++) {
        largest = fmax(largest, contact_use(standing, now, forces, standing->wheel[d]));
        largest = fmax(largest, fabs(bearing_use(standing, now, forces, d)));
    }
    return largest;
}

/* The rows of the contacts of wheels that stand: one for each direction in which they may slip. */
static void put_contact_rows(const standing_t *standing, int *place)
{
    friction_problem_t *const p = &standing->problem->p;
    const int width = 2 - SET_FIRST_DIRECTION;
    for (int d = 0; d < standing->count; d++) {
        const int i = standing->wheel[d];
        if (d == 0 || i != standing->wheel[d - 1]) {
            p->element[p->elements++] = (friction_element_t){
                .kind = width == 2 ? FRICTION_ELLIPSE : FRICTION_INTERVAL, .first = p->rows, .rows = width,
                .size = {standing->of_ground[2*i + SET_FIRST_DIRECTION], standing->of_ground[2*i + 1]},
                .strip = INFINITY,
            };
            p->rows += width;
        }
        place[d] = p->rows - 2 + standing->direction[d];
    }
}

/* One equality more, of which no row has a part so far. */
static double *new_equality(friction_problem_t *p, double wanted)
{
    p->wanted[p->equalities] = wanted;
    double *const row = p->equality + p->rows*p->equalities++;
    memset(row, 0, sizeof *row*(size_t)p->rows);
    return row;
}

/* What a unit force in direction d is in the problem: of wheels that roll the torque of its bearing. */
ALWAYS_INLINE double unit_of(const standing_t *standing, int d, const demand_t *now)
{
    return SET_HOLDS ? arm_of(standing, d, now) : 1;
}

/* What holds wheels that stand, for friction/: the forces of contacts, then the torques of bearings. They balance the
 * demand; what a contact takes across the direction in which its wheel stands is given. Of wheels that roll the torques
 * alone: contacts take the demand on them. `place`: of the force in each direction. */
static const friction_problem_t *problem_of_use(const standing_t *standing, const demand_t *now, int *place)
{
    friction_problem_t *const p = &standing->problem->p;
    vector3_t basis[3];
    const int rank = span_of(&standing->rows, basis);       /* across it there is rounding alone            */
    p->rows = p->elements = p->apart = p->equalities = 0;
    for (int d = 0; SET_HOLDS && d < standing->count; d++)
        place[d] = d;
    if (!SET_HOLDS)
        put_contact_rows(standing, place);
    const int of_contacts = p->rows;
    p->rows += standing->count;
    for (int k = 0; k < rank; k++) {
        double *const row = new_equality(p, dot3(now->force, basis[k]));
        for (int d = 0; d < standing->count; d++)
            row[place[d]] = dot3(standing->rows.rows[d], basis[k])/unit_of(standing, d, now);
    }
    for (int d = 0; d < standing->count; d++) {
        const int across = 2*standing->wheel[d] + 1 - standing->direction[d];
        p->element[p->elements++] = (friction_element_t){
            .kind = FRICTION_INTERVAL, .first = of_contacts + d, .rows = 1,
            .size = {bound_of_bearing(standing, d), 0}, .strip = INFINITY,
        };
        if (SET_HOLDS)
            continue;
        double *const row = new_equality(p, demand_on_bearing(standing, d, now));
        row[of_contacts + d] = 1, row[place[d]] = -arm_of(standing, d, now);
        if (!standing->stands[across] && SET_FIRST_DIRECTION == 0)
            new_equality(p, now->along[across])[place[d] + (standing->direction[d] ? -1 : 1)] = 1;
    }
    return p;
}

/* Whether no other forces balance the demand than those of least norm. */
static int is_determinate(const standing_t *standing)
{
    vector3_t basis[3];
    return span_of(&standing->rows, basis) == standing->count;
}

/* The least use for a demand, and the forces that have it. */
static double least_use(const standing_t *standing, const demand_t *now, double *forces)
{
    elements_t *const c = standing->problem;
    int place[MAX_STANDING];
    least_norm(&standing->rows, now->force, forces);
    if (is_determinate(standing))
        return largest_use(standing, now, forces);
    const double use = friction_least_use(problem_of_use(standing, now, place), c->memory, &c->found);
    for (int d = 0; d < standing->count && use < INFINITY; d++)
        forces[d] = c->found.force[place[d]]/unit_of(standing, d, now);
    return largest_use(standing, now, forces);
}

/* By how much the least use, which has just been found with its forces, is less where the demand is `before`, a little
 * before `now`. */
static double use_less_before(const standing_t *standing, const demand_t *now, const demand_t *before, double use)
{
    const elements_t *const c = standing->problem;
    double forces[MAX_STANDING], change[3 + 2*MAX_STANDING];
    int place[MAX_STANDING];
    if (is_determinate(standing) || !(use > 0 && use < INFINITY))
        return use - least_use(standing, before, forces);
    const friction_problem_t *const p = problem_of_use(standing, before, place);
    for (int e = 0; e < p->equalities; e++) {
        change[e] = -p->wanted[e];
        for (int k = 0; k < p->rows; k++)
            change[e] += p->equality[e*p->rows + k]*c->found.force[k];
    }
    return friction_use_rate(problem_of_use(standing, now, place), c->memory, change);
}

/* The motion in which bearings of wheels that roll can take least of the demand: the slopes of the least use by
 * the force on nu. */
static void motion_of_use(const standing_t *standing, const demand_t *now, double *motion)
{
    elements_t *const c = standing->problem;
    vector3_t basis[3];
    int place[MAX_STANDING];
    const friction_problem_t *const p = problem_of_use(standing, now, place);
    const int rank = span_of(&standing->rows, basis);
    friction_least_use(p, c->memory, &c->found);
    memset(motion, 0, sizeof(vector3_t));
    for (int k = 0; k < rank; k++) {
        const double change[3] = {k == 0, k == 1, k == 2};
        add3(motion, friction_use_rate(p, c->memory, change), basis[k]);
    }
}

/* Whether forces are known that use far less than all; `forces`: the last ones of least use, which are brought up to
 * date. */
static int uses_little(const standing_t *standing, const demand_t *now, const double *forces)
{
    double missing[MAX_STANDING], updated[MAX_STANDING];
    vector3_t force;
    memcpy(force, now->force, sizeof force);
    for (int pass = 0; pass < 2; pass++) {              /* of least norm, then near the last ones               */
        for (int d = 0; d < standing->count && pass; d++)
            add3(force, -forces[d], standing->rows.rows[d]);
        least_norm(&standing->rows, force, missing);
        for (int d = 0; d < standing->count; d++)
            updated[d] = missing[d] + (pass ? forces[d] : 0);
        if (largest_use(standing, now, updated) < 1 - NEAR_USED)
            return 1;
    }
    return 0;
}

/* The forces of least norm that use nothing up; where there is no choice, those of the least use. What bearings
 * take of them has no part in the norm. */
static void least_norm_within(const standing_t *standing, const demand_t *now, double *forces)
{
    elements_t *const c = standing->problem;
    int place[MAX_STANDING];
    least_norm(&standing->rows, now->force, forces);
    if (largest_use(standing, now, forces) <= 1)
        return;
    if (!uses_little(standing, now, standing->used_by) && least_use(standing, now, forces) > 1 - INSIDE)
        return;
    const friction_problem_t *const p = problem_of_use(standing, now, place);
    memset(p->matrix, 0, sizeof *p->matrix*(size_t)(p->rows*p->rows));
    memset(p->given, 0, sizeof *p->given*(size_t)p->rows);
    for (int k = 0; k < p->rows - standing->count; k++)
        p->matrix[k*p->rows + k] = 1;
    if (friction_decide(p, c->memory, &c->found))
        for (int d = 0; d < standing->count; d++)
            forces[d] = c->found.force[place[d]];
}
