/* Bearings that may stick: which of them do in a row, and their room at a point. Where wheels may slip, wheels and
 * rollers have speeds of their own, and a bearing that sticks takes no direction from nu. Where they roll, axles and
 * rollers in contact go with nu, and each that sticks takes a direction. */

/* The bearings are those of the axles, if these may stick, then those of the rollers, if these may: wheel by wheel, of
 * each first that in contact. Massless rollers in contact stand in their place: they have no speeds of their own. Where
 * contacts stick the speed of a wheel along its axle is theirs. */
#define AXLES_MAY_STICK (SET_AXLES_STICK || (SET_HOLDS && SET_BEARING_INPUT >= 0))
#define ROLLERS_MAY_STICK (SET_DISKS_STICK || SET_IN_SERIES || (SET_HOLDS && SET_CONTACT_BEARING_INPUT >= 0))
#define OF_A_WHEEL(w) (SET_GATHERS ? (w)->rollers : 1)      /* bearings of its rollers */
#define AXLES(w) (AXLES_MAY_STICK*(w)->wheels)
#define MOST_OWN(w) (AXLES(w) + ROLLERS_MAY_STICK*(w)->wheels*OF_A_WHEEL(w))
#define MOST_ROWS(w) (AXLES(w) + ROLLERS_MAY_STICK*(w)->wheels)     /* those below */
#define SET_SERIES_ALONE (SET_IN_SERIES && !SET_STRIPS)     /* whether no contact sticks beside massless rollers */
ALWAYS_INLINE int roller_bearing(const variations_t *w, int wheel, int place)
{
    return AXLES(w) + wheel*OF_A_WHEEL(w) + place;
}

/* Where the row stands that says the rate of a bearing for each of nu, or -1: of those whose rates follow from nu. */
ALWAYS_INLINE int row_of_bearing(const variations_t *w, int k)
{
    const int roller = k - AXLES(w);
    if (!SET_HOLDS || (roller >= 0 && roller%OF_A_WHEEL(w) != 0))
        return -1;
    return roller < 0 ? k : AXLES(w) + roller/OF_A_WHEEL(w);
}

/* In a row 0 where one sticks, else the sign of its rate. */
ALWAYS_INLINE long long own_mode(const variations_t *w, long long row, int k)
{
    return w->run->own_mode[row*MOST_OWN(w) + k];
}

/* How the largest torque of a bearing at rest moves with a column. */
ALWAYS_INLINE double moved_most(const variations_t *w, int column, int k)
{
    return w->run->own_most_moved[column*MOST_OWN(w) + k];
}

/* What the functions take and give of axles and of rollers in contact at a point, or as these move. */
ALWAYS_INLINE void put_own_bearings(const variations_t *w, lanes_t *own, point_t *point)
{
    const int moves = own == w->along, wheels = w->wheels;
    const lanes_t *const sticks = moves ? own + point_still(w) : w->bearings.sticks;
    lanes_t *const holding = w->bearings.holding + 2*wheels*moves;
    if (SET_AXLES_STICK)
        point->axle_sticks = sticks, point->axle_holding = holding;
    if (SET_DISKS_STICK || SET_IN_SERIES)
        point->contact_sticks = moves ? sticks : sticks + wheels;
    if (SET_DISKS_STICK || SET_STRIPS)
        point->contact_holding = holding + wheels;
    if (SET_STRIPS)
        point->contact_spin = w->bearings.spin_dot + wheels*moves;
    if (SET_DISKS_STICK) {
        point->contact_spin_dot = w->bearings.spin_dot + wheels*w->rollers*moves;
        point->spins_dot = point->contact_spin_dot + wheels;
        point->yaw_mass = w->bearings.yaw_mass + moves;
    }
}

/* Whether rollers in contact stick as in a row, with the torques of those that turn. */
static void put_modes_in_contact(const variations_t *w, long long row)
{
    const int torque = SET_CONTACT_BEARING_INPUT*w->wheels;
    const double *const drive = w->run->drive + row*SET_INPUTS*w->wheels + torque;
    for (int i = 0; i < w->wheels; i++) {
        w->bearings.sticks[w->wheels + i] = lanes_of(own_mode(w, row, roller_bearing(w, i, 0)) == 0);
        w->point[point_inputs(w) + torque + i] = lanes_of(drive[i]);
    }
}

/* The same of all bearings. */
static void put_own_modes(const variations_t *w, long long row)
{
    const double *const drive = w->run->drive + row*SET_INPUTS*w->wheels;
    for (int i = 0; i < w->wheels && SET_AXLES_STICK; i++) {
        w->bearings.sticks[i] = lanes_of(own_mode(w, row, i) == 0);
        w->point[point_inputs(w) + SET_BEARING_INPUT*w->wheels + i] = lanes_of(drive[SET_BEARING_INPUT*w->wheels + i]);
    }
    if (SET_DISKS_STICK || SET_IN_SERIES)
        put_modes_in_contact(w, row);
}

/* Of a list with a place for each axle, each roller in contact and each free roller that of a bearing. */
ALWAYS_INLINE lanes_t *of_bearing(const variations_t *w, int k, lanes_t *axles, lanes_t *contact, lanes_t *free)
{
    const int roller = k - AXLES(w), wheel = roller/OF_A_WHEEL(w), place = roller%OF_A_WHEEL(w);
    if (roller < 0)
        return axles + k;
    return place == 0 ? contact + wheel : free + wheel*(w->rollers - 1) + place - 1;
}

/* At a point, or as it moves: the acceleration of a bearing, and what holds it. Of a massless roller the former is that
 * of the speed along the axle, over the distance of its axis from the ground in its middle. */
ALWAYS_INLINE double own_dot(const variations_t *w, const point_t *at, int k, int lane)
{
    lanes_t *contact = 0, *free = 0;
    if (SET_SERIES_ALONE && k >= roller_bearing(w, 0, 0))       /* no speed comes to rest: changes.c */
        return 0;
    const int row = row_of_bearing(w, k);
    if (row >= 0) {
        const double *const own = w->run->hold_row + 3*row;
        const lanes_t *const nu_dot = w->bearings.nu_dot + (at->nu == w->along + POINT_NU ? 3 : 0);
        return own[0]*nu_dot[0][lane] + own[1]*nu_dot[1][lane] + own[2]*nu_dot[2][lane];
    }
    if (SET_STRIPS && k >= roller_bearing(w, 0, 0))
        return at->slip_dot[2*(k - roller_bearing(w, 0, 0))][lane]/w->run->standing[1];
    if (SET_HOLDS)
        free = at->core_dot;
    if (SET_DISKS_STICK)
        contact = at->contact_spin_dot, free = at->spins_dot;
    return (*of_bearing(w, k, at->core_dot, contact, free))[lane];
}

ALWAYS_INLINE double own_asked(const variations_t *w, const point_t *at, int k)
{
    lanes_t *axles = 0, *contact = 0, *free = 0;
    if (row_of_bearing(w, k) >= 0)          /* what holds nu says it: holding.c */
        return 0;
    if (SET_SPINS_STICK || SET_DISKS_STICK)
        free = at->free_holding;
    if (SET_AXLES_STICK)
        axles = at->axle_holding;
    if (SET_STRIPS || SET_DISKS_STICK)
        contact = at->contact_holding;
    if (SET_SERIES_ALONE)
        contact = w->bearings.holding + (at->nu == w->along + POINT_NU ? 3 : 1)*w->wheels;
    return (*of_bearing(w, k, axles, contact, free))[0];
}

/* The torque of a bearing at a point, or as it moves. */
ALWAYS_INLINE lanes_t *own_torque(const variations_t *w, lanes_t *own, int k)
{
    lanes_t *const inputs = own + point_inputs(w), *free = 0;
#if SET_GATHERS
    free = own == w->along ? w->spins.bearing_along : w->spins.bearing;
#endif
    return of_bearing(w, k, inputs + SET_BEARING_INPUT*w->wheels, inputs + SET_CONTACT_BEARING_INPUT*w->wheels, free);
}
