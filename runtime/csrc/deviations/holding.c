/* What takes directions from nu in a change of modes, and how much of what contacts and bearings can hold they use:
 * bearings that stick of wheels that roll, and of wheels that stand, along their axles where contact and roller stick,
 * and along their rolling direction where contact and axle do. The forces that hold nu are torques of these bearings.
 * Where there are many such torques wheels that stand are held if some of them do it. */
#define MAX_ROWS (2*MAX_WHEELS)
#define IS_AT_REST 1e-12        /* of the length of a row: its rate along a motion is rounding */

/* The rate of a bearing for each of nu, and how it moves. */
typedef struct {
    int bearing, wheel, is_axle;
    double row[3], moved[3];
} row_t;

/* What holds nu in one of the instants of a change: rows, the torques along them and how these move. */
typedef struct {
    const change_t *change;
    int which, count, is_only;          /* is_only: whether no other torques do it */
    row_t row[MAX_ROWS];
    lanes_t torque[MAX_ROWS], moved[MAX_ROWS];
} held_t;

/* Whether a bearing takes a direction from nu in one of these instants. */
static int takes_direction(const variations_t *w, const change_t *e, int which, int k)
{
    const int roller = k - AXLES(w), i = roller < 0 ? k : roller/OF_A_WHEEL(w);
    if (!SET_DIRECTIONS || (roller >= 0 && roller%OF_A_WHEEL(w) != 0) || mode_of(w, e, which, k) != 0)
        return 0;
    return SET_HOLDS || sticks_in(w, which == AFTER ? e->after : e->row, i)
        || (which == RESTING && e->after > e->row && rests_behind(w, e->row, i));
}

/* List the rows of those that do, at whose state the point is: how they move with the numbers of a vehicle and with the
 * point. Returns how many. */
static int list_rows(const variations_t *w, const change_t *e, int which, const vehicle_t *vehicle, row_t *to)
{
    const int wheels = FIXED_WHEELS(w->wheels), chi = point_chi(w);
    const lanes_t zero[3] = {{0}};
    lanes_t rate[3][2][MAX_WHEELS], moved[3][2][MAX_WHEELS];
    int count = 0;
    for (int c = 0; c < 3; c++) {
        lanes_t nu[3] = {{0}};
        nu[c] = lanes_of(1);
        set_wheel_rates_along(wheels, vehicle, nu, w->point + chi, zero, w->along + chi, rate[c][0], rate[c][1],
                              moved[c][0], moved[c][1]);
    }
    for (int k = 0; k < BEARINGS(w); k++) {
        const int is_axle = k < AXLES(w), i = is_axle ? k : (k - AXLES(w))/OF_A_WHEEL(w);
        if (!takes_direction(w, e, which, k))
            continue;
        row_t *const row = &to[count++];
        row->bearing = k, row->wheel = i, row->is_axle = is_axle;
        for (int c = 0; c < 3; c++)
            row->row[c] = rate[c][!is_axle][i][0], row->moved[c] = moved[c][!is_axle][i][0];
    }
    return count;
}

/* Add a vector to an orthonormal basis where this has less of it than all, by a part. Returns its size. */
static int add_to_basis(double (*basis)[3], int count, const double *vector, double part)
{
    const double length = length3(vector);
    double residual[3], norm = 0;
    for (int c = 0; c < 3; c++)
        residual[c] = vector[c]/length;
    for (int twice = 0; twice < 2 && count < 3; twice++) {
        for (int k = 0; k < count; k++) {
            const double in = dot3(basis[k], residual);
            for (int c = 0; c < 3; c++)
                residual[c] -= in*basis[k][c];
        }
        norm = length3(residual);
    }
    for (int c = 0; c < 3 && norm > part; c++)
        basis[count][c] = residual[c]/norm;
    return count + (norm > part);
}

/* Add units until there are three: of these one always has more than half outside of what there is. */
static void complete_basis(double (*basis)[3], int count)
{
    for (int c = 0; c < 3; c++)
        count = add_to_basis(basis, count, (const double[3]){c == 0, c == 1, c == 2}, 0.5);
}

/* The directions that nu has then. */
static void put_held_in(const variations_t *w, const change_t *e, int which)
{
    row_t row[MAX_ROWS];
    double basis[3][3];
    const int rows = SET_DIRECTIONS ? list_rows(w, e, which, w->vehicle, row) : 0;
    int rank = 0;
    for (int j = 0; j < rows; j++)
        rank = add_to_basis(basis, rank, row[j].row, SAME);
    complete_basis(basis, rank);
    memset(w->held, 0, 2*HELD_SIZE*sizeof *w->held);
    for (int k = 0; k < 3; k++) {
        w->held[ABSENT + k] = lanes_of(k >= 3 - rank);
        for (int c = 0; c < 3 && k < 3 - rank; c++)
            w->held[DIRECTIONS + 3*c + k] = lanes_of(basis[rank + k][c]);
    }
}

/* The torques along rows that balance a force on nu. Returns whether these are the only ones. */
static int find_torques(const held_t *held, const lanes_t *force, lanes_t *torque)
{
    const int count = held->count;
    double matrix[count*count + 1];
    for (int a = 0; a < count; a++) {
        const double *const row = held->row[a].row;
        torque[a] = row[0]*force[0] + row[1]*force[1] + row[2]*force[2];
        for (int b = 0; b < count; b++)
            matrix[a*count + b] = dot3(row, held->row[b].row);
    }
    return solve_small(matrix, count, torque, 1, SAME) == count;
}

/* The torques at the point, and how they move as this does: where the force that they balance moves, and the rows. */
static void solve_held(const variations_t *w, held_t *held)
{
    const lanes_t *const force = w->held + HELD_FORCE, *const force_moved = force + HELD_SIZE;
    lanes_t right[3];
    held->is_only = find_torques(held, force, held->torque);
    memcpy(right, force_moved, sizeof right);
    for (int j = 0; j < held->count; j++)
        for (int c = 0; c < 3; c++)
            right[c] -= held->row[j].moved[c]*held->torque[j];
    find_torques(held, right, held->moved);
}

/* Find what holds nu in an instant at the point, where the rates there have been computed last, and how that moves as
 * the point does, with the numbers of a vehicle or with none. */
static void find_held(const variations_t *w, const change_t *e, int which, const vehicle_t *vehicle, held_t *held)
{
    held->change = e, held->which = which;
    held->count = SET_DIRECTIONS ? list_rows(w, e, which, vehicle, held->row) : 0;
    solve_held(w, held);
}

/* With which arm the contact of a row holds its bearing, and how that moves. */
static double arm_along(const variations_t *w, int column, const row_t *row, double *moved)
{
    const int wheels = FIXED_WHEELS(w->wheels), chi = point_chi(w), model = column < 0 ? 0 : w->run->number[column];
    lanes_t reach[MAX_WHEELS], reach_moved[MAX_WHEELS];
    *moved = column < 0 ? 0 : -w->run->contacts.standing_moved[column];
    if (row->is_axle)
        return -w->run->contacts.standing[0];
    set_contact_reaches_along(wheels, &w->vehicle[model], w->point + chi, w->along + chi, reach, reach_moved);
    *moved = reach_moved[row->wheel][0];
    return reach[row->wheel][0];
}

/* How much of what static friction can hold a contact that sticks uses, and how that moves along a column or with
 * time. */
static double use_of_contact(const variations_t *w, int column, const held_t *held, int i, double *moved)
{
    const point_t at = point_of(w, w->vehicle, w->point), along = point_of(w, w->vehicle, w->along);
    const double *const per_reach = w->run->contacts.per_reach + 2*i;
    const double *const grown = per_reach + 2*w->wheels*(column < 0 ? 0 : w->run->number[column]);
    double squared = 0, rises = 0;
    for (int c = 0; c < 2; c++) {
        double force = at.ground_force[2*i + c][0], force_moved = along.ground_force[2*i + c][0];
        for (int j = 0; j < held->count; j++)
            if (held->row[j].wheel == i && held->row[j].is_axle == c) {
                double arm_moved;
                const double arm = arm_along(w, column, &held->row[j], &arm_moved);
                force = held->torque[j][0]/arm;
                force_moved = (held->moved[j][0] - force*arm_moved)/arm;
            }
        squared += force*force*per_reach[c];
        rises += force*force_moved*per_reach[c] + (grown == per_reach ? 0 : force*force*grown[c]/2);
    }
    *moved = rises/sqrt(squared);
    return sqrt(squared);
}

/* Bearings of wheels that roll hold nu together. Where one breaks away whose torque others can take over, the vehicle
 * begins to move along n, in which all others that stick rest, or those that do afterwards. Returns whether there is an
 * n. */
static int find_motion(const variations_t *w, const held_t *held, int broken, double *n)
{
    double basis[4][3];
    for (int others = 1; others >= 0; others--) {
        int rank = 0, first;
        for (int j = 0; j < held->count; j++) {
            const int k = held->row[j].bearing;
            if (others ? k != broken : bearing_mode(w, held->change->after, k) == 0)
                rank = add_to_basis(basis, rank, held->row[j].row, SAME);
        }
        first = rank;
        for (int j = 0; j < held->count; j++)
            rank = add_to_basis(basis, rank, held->row[j].row, SAME);
        if (rank == first + 1) {
            memcpy(n, basis[first], sizeof basis[first]);
            return 1;
        }
    }
    return 0;
}

/* How the largest torque of a bearing at rest moves with a column. */
ALWAYS_INLINE double bound_moved(const variations_t *w, int column, int k)
{
    return column < 0 ? 0 : w->run->bearings.bound_moved[column*BEARINGS(w) + k];
}

/* How much of what bearings can hold is used where one breaks away, and how that moves; not a number where that is not
 * determined. Those that move along n use the same part of their largest torques, each against its rate: one row in
 * the place of all of theirs. */
static double use_of_all(const variations_t *w, int column, const held_t *held, int broken, double *moved)
{
    double n[3];
    held_t facet = {.change = held->change, .which = held->which};
    row_t all = {.bearing = broken};
    if (!find_motion(w, held, broken, n))
        return *moved = NAN;
    for (int j = 0; j < held->count; j++) {
        const row_t *const row = &held->row[j];
        const double rate = dot3(row->row, n), bound = w->run->bearings.bound[row->bearing];
        if (fabs(rate) <= IS_AT_REST*length3(row->row)) {
            facet.row[facet.count++] = *row;
            continue;
        }
        for (int c = 0; c < 3; c++) {
            all.row[c] += copysign(bound, rate)*row->row[c];
            all.moved[c] += copysign(1, rate)*(bound*row->moved[c] + bound_moved(w, column, row->bearing)*row->row[c]);
        }
    }
    facet.row[facet.count++] = all;
    solve_held(w, &facet);
    const double use = facet.torque[facet.count - 1][0], use_moved = facet.moved[facet.count - 1][0];
    *moved = use < 0 ? -use_moved : use_moved;
    return fabs(use);
}

/* How much of what it can hold a bearing that sticks uses, and how that moves along a column or with time. */
static double use_of_bearing(const variations_t *w, int column, const held_t *held, int k, double *moved)
{
    const point_t at = point_of(w, w->vehicle, w->point), along = point_of(w, w->vehicle, w->along);
    const double bound = w->run->bearings.bound[k];
    double torque = demand_on_bearing(w, &at, k), torque_moved = demand_on_bearing(w, &along, k);
    if (goes_with_nu(w, k) && !held->is_only)
        return use_of_all(w, column, held, k, moved);
    for (int j = 0; j < held->count; j++)
        if (held->row[j].bearing == k)
            torque += held->torque[j][0], torque_moved += held->moved[j][0];
    *moved = ((torque < 0 ? -torque_moved : torque_moved) - fabs(torque)/bound*bound_moved(w, column, k))/bound;
    return fabs(torque)/bound;
}

/* Of many torques that hold wheels those that use little. Returns whether they were found. */
static int find_small_torques(const variations_t *w, held_t *held, const lanes_t *force)
{
    double matrix[9] = {0}, by[MAX_ROWS], moved;
    lanes_t right[3];
    memcpy(right, force, sizeof right);
    for (int j = 0; j < held->count; j++) {
        const row_t *const row = &held->row[j];
        const double arm = arm_along(w, TIMES_ALONE, row, &moved), bound = w->run->bearings.bound[row->bearing];
        by[j] = 1/(w->run->contacts.per_reach[2*row->wheel + row->is_axle]/(arm*arm) + 1/(bound*bound));
        for (int c = 0; c < 9; c++)
            matrix[c] += by[j]*row->row[c/3]*row->row[c%3];
    }
    if (solve_small(matrix, 3, right, 1, SAME) < 3 && !SET_STRIPS)  /* which may leave the vehicle to turn in place */
        return 0;
    for (int j = 0; j < held->count; j++) {
        const double *const row = held->row[j].row;
        held->torque[j] = by[j]*(row[0]*right[0] + row[1]*right[1] + row[2]*right[2]);
    }
    return 1;
}

/* Whether what sticks after a change, whose rates have been computed last, takes all that can hold it, or may do so: of
 * wheels that stand, if no torques are found that hold them with less. */
static int is_at_bound(const variations_t *w, const change_t *e)
{
    const point_t at = point_of(w, w->vehicle, w->point);
    const double limit = 1 - w->run->bounds.reached;
    double moved;
    held_t held;
    find_held(w, e, AFTER, w->vehicle, &held);
    if (SET_STANDS && !held.is_only
        && ((held.count <= 3 && !SET_STRIPS) || !find_small_torques(w, &held, at.held_force)))
        return 1;
    for (int i = 0; i < w->wheels; i++)
        if (sticks_in(w, e->after, i) && !(use_of_contact(w, TIMES_ALONE, &held, i, &moved) < limit))
            return 1;
    for (int k = 0; k < BEARINGS(w); k++)
        if (bearing_mode(w, e->after, k) == 0 && !settles(w, e, k) && !goes_with_nu(w, k)
            && !(use_of_bearing(w, TIMES_ALONE, &held, k, &moved) < limit))
            return 1;
    return 0;
}
