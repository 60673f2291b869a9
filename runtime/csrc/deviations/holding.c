/* What holds wheels that stand: forces along the directions that they take from nu, how much of what contacts and
 * bearings can hold these use, and how that moves. Where there are many such forces the wheels are held if some of them
 * do it. */

#if SET_STANDS
/* The forces along rows, up to three, that hold what they are asked for. Returns whether these are the only ones. */
static int find_only_forces(const stand_t *stand, int count, const lanes_t *asked, lanes_t *force)
{
    double matrix[9];
    for (int a = 0; a < count; a++) {
        force[a] = lanes_of(0);
        for (int c = 0; c < 3; c++)
            force[a] += stand[a].row[c]*asked[c];
        for (int b = 0; b < count; b++) {
            const double *const one = stand[a].row, *const other = stand[b].row;
            matrix[a*count + b] = one[0]*other[0] + one[1]*other[1] + one[2]*other[2];
        }
    }
    return solve_dependent(matrix, count, force, 1) == count;
}

/* Of many forces that do those that use little. Returns whether they were found. */
static int find_small_forces(const stand_t *stand, int count, const lanes_t *asked, lanes_t *force)
{
    double matrix[9] = {0}, by[MOST_STANDS];
    lanes_t right[3];
    memcpy(right, asked, sizeof right);
    for (int j = 0; j < count; j++) {
        const double ground = stand[j].per_ground, bearing = stand[j].per_bearing;
        by[j] = 1/(ground*ground + bearing*bearing);
        for (int c = 0; c < 9; c++)
            matrix[c] += by[j]*stand[j].row[c/3]*stand[j].row[c%3];
    }
    if (solve_dependent(matrix, 3, right, 1) < 3 && !SET_STRIPS)    /* which may leave the vehicle to turn on the spot */
        return 0;
    for (int j = 0; j < count; j++)
        force[j] = by[j]*(stand[j].row[0]*right[0] + stand[j].row[1]*right[1] + stand[j].row[2]*right[2]);
    return 1;
}

/* How much of what a contact can hold it uses then. */
static double used_by_contact(const variations_t *w, const point_t *at, int i, const stand_t *stand, int count,
                              const lanes_t *force)
{
    double used[2];
    for (int c = 0; c < 2; c++)
        used[c] = at->ground_force[2*i + c][0]*per_hold(w, i, c);
    for (int j = 0; j < count; j++)
        if (stand[j].wheel == i)
            used[stand[j].way] = stand[j].per_ground*force[j][0];
    return sqrt(used[0]*used[0] + used[1]*used[1]);
}

/* Whether wheels that stand after a change, whose rates have been computed last, are held by less than all friction:
 * some forces are found that do so. */
static int are_held_clearly(const variations_t *w, const change_t *e, const double *asked)
{
    const point_t at = point_of(w, w->vehicle, w->point);
    stand_t stand[MOST_STANDS];
    lanes_t force[MOST_STANDS];
    const int count = list_stands(w, e, AFTER, stand);
    const double most = 1 - w->run->reached;
    const int only = count <= 3 && find_only_forces(stand, count, at.held_force, force);
    if (!only && ((count <= 3 && !SET_STRIPS) || !find_small_forces(stand, count, at.held_force, force)))
        return 0;
    for (int j = 0; j < count; j++) {
        const double own = asked[stand[j].bearing]/w->run->own_most[stand[j].bearing];
        if (!(fabs(own + stand[j].per_bearing*force[j][0]) < most)
            || !(used_by_contact(w, &at, stand[j].wheel, stand, count, force) < most))
            return 0;
    }
    return 1;
}

/* What holds wheels that stand before a change, where this is determined, and how it moves. */
typedef struct {
    int count;
    stand_t stand[MOST_STANDS];
    lanes_t force[MOST_STANDS], moved[MOST_STANDS];
} held_t;

/* Find it, where the rates before have been computed last. Returns whether it is determined. */
static int find_held(const variations_t *w, const change_t *e, held_t *held)
{
    const point_t at = point_of(w, w->vehicle, w->point);
    held->count = list_stands(w, e, BEFORE, held->stand);
    return held->count <= 3 && find_only_forces(held->stand, held->count, at.held_force, held->force);
}

/* How a column moves a number of the wheels that may stand: radius, the rollers' distance from the ground, rows. */
ALWAYS_INLINE double standing_moved(const variations_t *w, int column, int k)
{
    return column < 0 ? 0 : w->run->standing_moved[column*(2 + 6*w->wheels) + k];
}

/* The forces as a column moves them, or time: where what they are asked for does. */
static void move_held(const variations_t *w, int column, held_t *held)
{
    const point_t along = point_of(w, w->vehicle, w->along);
    lanes_t asked[3];
    memcpy(asked, along.held_force, sizeof asked);
    for (int j = 0; j < held->count; j++)
        for (int c = 0; c < 3; c++) {
            const int place = 3*(2*held->stand[j].wheel + held->stand[j].way) + c;
            asked[c] -= standing_moved(w, column, 2 + place)*held->force[j];
        }
    find_only_forces(held->stand, held->count, asked, held->moved);
}

/* With which arm a force along a row acts, and how that moves. */
ALWAYS_INLINE double per_row_along(const variations_t *w, int column, int way, double *moved)
{
    const double *const numbers = w->run->standing;
    *moved = way ? -standing_moved(w, column, 0) : standing_moved(w, column, 1);
    return way ? -numbers[0] : numbers[1];
}

/* How per_hold moves with a number of the vehicle, or without one. */
ALWAYS_INLINE double per_hold_moved(const variations_t *w, int model, int i, int c)
{
    const double own = per_hold(w, i, c), squared = w->run->per_reach[2*i + c];
    return model && own > 0 ? own*w->run->per_reach[2*w->wheels*model + 2*i + c]/(2*squared) : 0;
}

/* How much a contact that holds a wheel uses of what it can, and how that moves. */
static double contact_use_along(const variations_t *w, int column, const held_t *held, int i, const point_t *at,
                                const point_t *along, double *moved)
{
    const int model = column < 0 ? 0 : w->run->number[column];
    double used[2], turned[2];
    for (int c = 0; c < 2; c++) {
        const double own = at->ground_force[2*i + c][0], way = along->ground_force[2*i + c][0];
        used[c] = own*per_hold(w, i, c), turned[c] = way*per_hold(w, i, c) + own*per_hold_moved(w, model, i, c);
    }
    for (int j = 0; j < held->count; j++) {
        const stand_t *const own = &held->stand[j];
        double per_row_moved;
        const double per_row = per_row_along(w, column, own->way, &per_row_moved);
        if (own->wheel != i)
            continue;
        const double grown = (per_hold_moved(w, model, i, own->way) - own->per_ground*per_row_moved)/per_row;
        used[own->way] = own->per_ground*held->force[j][0];
        turned[own->way] = own->per_ground*held->moved[j][0] + grown*held->force[j][0];
    }
    const double size = sqrt(used[0]*used[0] + used[1]*used[1]);
    *moved = (used[0]*turned[0] + used[1]*turned[1])/size;
    return size;
}

/* The same of the bearing that holds it in a direction. */
static double bearing_use_along(const variations_t *w, int column, const held_t *held, int j, const point_t *at,
                                const point_t *along, double *moved)
{
    const stand_t *const own = &held->stand[j];
    const double most = w->run->own_most[own->bearing];
    const double most_moved = column < 0 ? 0 : moved_most(w, column, own->bearing);
    lanes_t reach[MOST_WHEELS], moved_reach[MOST_WHEELS] = {{0}};
    double per_row_moved;
    put_reaches(w, column < 0 ? 0 : w->run->number[column], at->chi, along->chi, reach, moved_reach);
    const double per_row = per_row_along(w, column, own->way, &per_row_moved);
    const double arm_moved = own->way ? -standing_moved(w, column, 0) : moved_reach[own->wheel][0];
    const double asked = own_asked(w, at, own->bearing)/most;
    const double asked_moved = own_asked(w, along, own->bearing)/most - asked*most_moved/most;
    const double grown = (arm_moved/most - own->per_bearing*per_row_moved)/per_row - own->per_bearing*most_moved/most;
    const double use = asked + own->per_bearing*held->force[j][0];
    *moved = (use < 0 ? -1 : 1)*(asked_moved + own->per_bearing*held->moved[j][0] + grown*held->force[j][0]);
    return fabs(use);
}
#endif

#if SET_HOLDS
/* Bearings of wheels that roll hold nu together. Where one breaks away, the vehicle begins to move along n, in which all
 * others that stick rest, or those that do afterwards: a facet of what they can hold. With the force h that holds nu, the
 * rows g and the largest torques S of those that stick they use
 *
 *     n . h / sum S |g . n|
 *
 * of it, and n turns with the rows of those at rest. */
#define IS_AT_REST 1e-12        /* of the length of a row: its rate along n is rounding */

/* The rows of all bearings whose rates follow from nu, at a point, and how they move. */
static void put_rows_along(const variations_t *w, const point_t *at, const point_t *along, double (*row)[3],
                           double (*moved)[3])
{
    const int wheels = OWN_WHEELS(w->wheels);
    const lanes_t still[3] = {{0}};
    for (int d = 0; d < 3; d++) {
        lanes_t nu[3] = {{0}}, rate[2][MOST_WHEELS], rate_moved[2][MOST_WHEELS];
        nu[d] = lanes_of(1);
        set_wheel_rates_along(wheels, at->vehicle, nu, at->chi, still, along->chi, rate[0], rate[1], rate_moved[0],
                              rate_moved[1]);
        for (int k = 0; k < MOST_ROWS(w); k++) {
            const int of = k >= AXLES(w);
            row[k][d] = rate[of][k%wheels][0], moved[k][d] = rate_moved[of][k%wheels][0];
        }
    }
}

ALWAYS_INLINE double dot3(const double *a, const double *b) { return a[0]*b[0] + a[1]*b[1] + a[2]*b[2]; }

/* The direction in which nu begins to move where a bearing breaks away. Returns whether there is one. */
static int find_motion(const variations_t *w, const change_t *e, int broken, double (*row)[3], double *n)
{
    double basis[4][3];
    for (int others = 1; others >= 0; others--) {      /* all others rest, or those that do afterwards */
        int taken = 0, first;
        for (int k = 0; k < MOST_OWN(w); k++)
            if (row_of_bearing(w, k) >= 0 && own_mode(w, e->before, k) == 0
                && (others ? k != broken : own_mode(w, e->after, k) == 0))
                taken = add_to_basis(basis, taken, row[row_of_bearing(w, k)], SAME);
        first = taken;
        for (int k = 0; k < MOST_OWN(w); k++)
            if (row_of_bearing(w, k) >= 0 && own_mode(w, e->before, k) == 0)
                taken = add_to_basis(basis, taken, row[row_of_bearing(w, k)], SAME);
        if (taken == first + 1) {
            memcpy(n, basis[first], sizeof basis[first]);
            return 1;
        }
    }
    return 0;
}

/* How that turns with the rows of those at rest in it, as these move: within what they and it span. */
static void turn_motion(const variations_t *w, const change_t *e, double (*row)[3], double (*moved)[3], const double *n,
                        double *turn)
{
    double matrix[9] = {0}, basis[3][3];
    lanes_t right[3] = {{0}};
    int taken = 0, all;
    for (int k = 0; k < MOST_OWN(w); k++) {
        const int r = row_of_bearing(w, k);
        if (r < 0 || own_mode(w, e->before, k) != 0 || fabs(dot3(row[r], n)) > IS_AT_REST*sqrt(dot3(row[r], row[r])))
            continue;
        const double squared = dot3(row[r], row[r]);
        taken = add_to_basis(basis, taken, row[r], SAME);
        for (int c = 0; c < 3; c++) {
            right[c] -= row[r][c]*dot3(moved[r], n)/squared;
            for (int d = 0; d < 3; d++)
                matrix[3*c + d] += row[r][c]*row[r][d]/squared;
        }
    }
    all = taken;
    for (int c = 0; c < 3; c++)
        all = add_to_basis(basis, all, (const double[3]){c == 0, c == 1, c == 2}, 0.5);
    for (int k = taken; k < 3; k++)
        for (int c = 0; c < 9; c++)
            matrix[c] += basis[k][c/3]*basis[k][c%3];
    solve_small(matrix, 3, right, 1);
    for (int c = 0; c < 3; c++)
        turn[c] = right[c][0];
}

/* How much of what bearings can hold is used where one breaks away, and how that moves along a column or with time;
 * not a number where that is not determined. */
static double hold_use_along(const variations_t *w, int column, const change_t *e, int broken, const point_t *at,
                             const point_t *along, double *moved)
{
    double row[MOST_STANDS][3], row_moved[MOST_STANDS][3], n[3], turn[3], use = 0, grown = 0, reach = 0;
    put_rows_along(w, at, along, row, row_moved);
    if (!find_motion(w, e, broken, row, n)) {
        *moved = NAN;
        return NAN;
    }
    turn_motion(w, e, row, row_moved, n, turn);
    for (int c = 0; c < 3; c++) {
        use += at->held_force[c][0]*n[c];
        grown += along->held_force[c][0]*n[c] + at->held_force[c][0]*turn[c];
    }
    const double side = use < 0 ? -1 : 1;
    grown *= side;
    for (int k = 0; k < MOST_OWN(w); k++) {
        const int r = row_of_bearing(w, k);
        if (r < 0 || own_mode(w, e->before, k) != 0)
            continue;
        const double rate = dot3(row[r], n), most = w->run->own_most[k];
        if (fabs(rate) <= IS_AT_REST*sqrt(dot3(row[r], row[r])))
            continue;
        reach += most*fabs(rate);
        grown -= (column < 0 ? 0 : moved_most(w, column, k))*fabs(rate)
            + most*(rate < 0 ? -1 : 1)*(dot3(row_moved[r], n) + dot3(row[r], turn));
    }
    *moved = grown/reach;
    return side*use/reach;
}
#endif
