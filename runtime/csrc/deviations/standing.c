/* What takes directions from nu in a change of modes: bearings that stick of wheels that roll, and wheels that stand,
 * along their axles where contact and roller stick, and along their rolling direction where contact and axle do. */
#define MOST_STANDS (2*MOST_WHEELS)

#if SET_STANDS
/* Whether a wheel does, along the axle (0) or the rolling direction (1). */
ALWAYS_INLINE int stands_in(const variations_t *w, const change_t *e, int which, int i, int way)
{
    const int may = way ? SET_AXLES_STICK : SET_DISKS_STICK || SET_STRIPS, bearing = way ? i : roller_bearing(w, i, 0);
    const int rests = which == RESTING && e->after > e->row && rests_behind(w, e->row, i);
    return may && (rests || sticks_in(w, which == AFTER ? e->after : e->row, i)) && mode_of(w, e, which, bearing) == 0;
}

/* Whether any wheel does. */
static int some_stand(const variations_t *w, const change_t *e, int which)
{
    int found = 0;
    for (int i = 0; i < w->wheels; i++)
        found |= stands_in(w, e, which, i, 0) || stands_in(w, e, which, i, 1);
    return found;
}

/* A direction in which a wheel stands. */
typedef struct {
    int wheel, way, bearing;            /* along the axle, or the rolling direction: 0, 1               */
    const double *row;                  /* 3: what it takes from nu                                     */
    double per_ground, per_bearing;     /* of what the contact can hold, and of what the bearing can, for each unit of
                                         * force along the row                                          */
} stand_t;

/* One over what static friction can hold of a contact. */
ALWAYS_INLINE double per_hold(const variations_t *w, int i, int c)
{
    return sqrt(w->run->per_reach[2*i + c]);
}

/* How far the axes of rollers are from the ground at these angles, and how a number of the vehicle and the angles move
 * that. */
static void put_reaches(const variations_t *w, int model, const lanes_t *chi, const lanes_t *chi_moved, lanes_t *reach,
                        lanes_t *moved)
{
#if SET_DISKS_STICK || SET_STRIPS
    set_contact_reaches_along(OWN_WHEELS(w->wheels), &w->vehicle[model], chi, chi_moved, reach, moved);
#else
    (void)w, (void)model, (void)chi, (void)chi_moved, (void)reach, (void)moved;
#endif
}

/* List the directions in one of the instants of a change, at whose state the point is. Returns how many. */
static int list_stands(const variations_t *w, const change_t *e, int which, stand_t *to)
{
    const double *const numbers = w->run->standing, radius = numbers[0];
    lanes_t still[MOST_WHEELS] = {{0}}, reach[MOST_WHEELS] = {{0}}, moved[MOST_WHEELS];
    int count = 0;
    put_reaches(w, 0, w->point + point_chi(w), still, reach, moved);
    for (int i = 0; i < w->wheels; i++)
        for (int way = 0; way < 2; way++) {
            if (!stands_in(w, e, which, i, way))
                continue;
            const int bearing = way ? i : roller_bearing(w, i, 0);
            const double per_row = way ? -radius : numbers[1], own = way ? -radius : reach[i][0];
            to[count++] = (stand_t){i, way, bearing, numbers + 2 + 3*(2*i + way), per_hold(w, i, way)/per_row,
                                    own/(per_row*w->run->own_most[bearing])};
        }
    return count;
}
#endif

#if SET_DIRECTIONS
/* Take from a vector what orthonormal ones have in it. Returns its length. */
static double take_basis(double (*basis)[3], int count, double *vector)
{
    for (int twice = 0; twice < 2; twice++)
        for (int k = 0; k < count; k++) {
            const double *const own = basis[k], in = own[0]*vector[0] + own[1]*vector[1] + own[2]*vector[2];
            for (int c = 0; c < 3; c++)
                vector[c] -= in*own[c];
        }
    return sqrt(vector[0]*vector[0] + vector[1]*vector[1] + vector[2]*vector[2]);
}

/* Add a vector to an orthonormal basis where this has less of it than all, by a part. Returns its size. */
static int add_to_basis(double (*basis)[3], int count, const double *vector, double part)
{
    const double length = sqrt(vector[0]*vector[0] + vector[1]*vector[1] + vector[2]*vector[2]);
    double own[3], left;
    for (int c = 0; c < 3; c++)
        own[c] = vector[c]/length;
    left = count < 3 ? take_basis(basis, count, own) : 0;
    for (int c = 0; c < 3 && left > part; c++)
        basis[count][c] = own[c]/left;
    return count + (left > part);
}

/* List the rows of all that takes a direction from nu in one of the instants of a change. Returns how many. */
static int list_rows(const variations_t *w, const change_t *e, int which, const double **row)
{
    int count = 0;
#if SET_HOLDS
    for (int k = 0; k < MOST_OWN(w); k++)
        if (row_of_bearing(w, k) >= 0 && mode_of(w, e, which, k) == 0)
            row[count++] = w->run->hold_row + 3*row_of_bearing(w, k);
#else
    stand_t stand[MOST_STANDS];
    count = list_stands(w, e, which, stand);
    for (int j = 0; j < count; j++)
        row[j] = stand[j].row;
#endif
    return count;
}

/* What is left to nu then. */
static void put_held_in(const variations_t *w, const change_t *e, int which)
{
    const double *row[MOST_STANDS];
    double basis[3][3];
    const int rows = list_rows(w, e, which, row);
    int taken = 0, left;
    for (int j = 0; j < rows; j++)
        taken = add_to_basis(basis, taken, row[j], SAME);
    left = taken;
    for (int c = 0; c < 3; c++)     /* of three units one always has more than half outside of what there is */
        left = add_to_basis(basis, left, (const double[3]){c == 0, c == 1, c == 2}, 0.5);
    memset(w->held, 0, 2*HELD_SIZE*sizeof *w->held);
    for (int k = 0; k < 3; k++) {
        w->held[ABSENT + k] = lanes_of(k >= 3 - taken);
        for (int c = 0; c < 3 && k < 3 - taken; c++)
            w->held[DIRECTIONS + 3*c + k] = lanes_of(basis[taken + k][c]);
    }
}

/* Whether nothing is left to nu in a row. */
ALWAYS_INLINE int is_still_in(const variations_t *w, long long row)
{
    const double *const absent = w->run->allowed + w->run->hold[row]*(12 + 9*(w->run->models - 1)) + ABSENT;
    return absent[0] != 0 && absent[1] != 0 && absent[2] != 0;
}
#endif
