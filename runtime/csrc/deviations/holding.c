/* What holds wheels that stand: forces along the directions that they take from nu, how much of what contacts and
 * bearings can hold these use, and how that moves. Where there are many such forces the wheels are held if some of them
 * do it; which of them is the least use of all is Python's (runtime/omniroll/engine/least_use_slopes.py). */

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
    return solve_scaled(matrix, count, force, 1);
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
#if SET_STRIPS                      /* wheels may stand that leave the vehicle to turn on the spot */
    solve_dependent(matrix, 3, right, 1);
#else
    if (!solve_scaled(matrix, 3, right, 1))
        return 0;
#endif
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
