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
#define BEARINGS(w) (AXLES(w) + ROLLERS_MAY_STICK*(w)->wheels*OF_A_WHEEL(w))
#define SET_SERIES_ALONE (SET_IN_SERIES && !SET_STRIPS)     /* whether no contact sticks beside massless rollers */
ALWAYS_INLINE int roller_bearing(const variations_t *w, int wheel, int place)
{
    return AXLES(w) + wheel*OF_A_WHEEL(w) + place;
}

/* In a row 0 where one sticks, else the sign of its rate. */
ALWAYS_INLINE long long bearing_mode(const variations_t *w, long long row, int k)
{
    return w->run->bearings.mode[row*BEARINGS(w) + k];
}

/* What the functions take and give of axles and of rollers in contact at a point, or as these move. */
ALWAYS_INLINE void put_bearings(const variations_t *w, lanes_t *numbers, point_t *point)
{
    const int moves = numbers == w->along, wheels = w->wheels;
    const lanes_t *const sticks = moves ? numbers + point_zeros(w) : w->bearings.sticks;
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

/* Of a list with a place for each axle, each roller in contact and each free roller that of a bearing. */
ALWAYS_INLINE lanes_t *of_bearing(const variations_t *w, int k, lanes_t *axles, lanes_t *contact, lanes_t *free)
{
    const int roller = k - AXLES(w), wheel = roller/OF_A_WHEEL(w), place = roller%OF_A_WHEEL(w);
    if (roller < 0)
        return axles + k;
    return place == 0 ? contact + wheel : free + wheel*(w->rollers - 1) + place - 1;
}

/* Whether the rate of a bearing follows from nu, so that what holds nu says what holds it. */
ALWAYS_INLINE int goes_with_nu(const variations_t *w, int k)
{
    return SET_HOLDS && (k < AXLES(w) || (k - AXLES(w))%OF_A_WHEEL(w) == 0);
}

/* At a point, or as it moves, what holds a bearing by itself. */
ALWAYS_INLINE double demand_on_bearing(const variations_t *w, const point_t *at, int k)
{
    lanes_t *const axles = w->bearings.holding + 2*w->wheels*(at->nu == w->along + POINT_NU);
    return goes_with_nu(w, k) ? 0 : (*of_bearing(w, k, axles, axles + w->wheels, at->free_holding))[0];
}

/* The torque of a bearing at a point, or as it moves. */
ALWAYS_INLINE lanes_t *torque_of_bearing(const variations_t *w, lanes_t *numbers, int k)
{
    lanes_t *const inputs = numbers + point_inputs(w);
    lanes_t *const free = numbers == w->along ? w->spins.bearing_along : w->spins.bearing;
    return of_bearing(w, k, inputs + SET_BEARING_INPUT*w->wheels, inputs + SET_CONTACT_BEARING_INPUT*w->wheels, free);
}

/* Let a bearing of the point stick, or turn to a side. */
ALWAYS_INLINE void put_bearing_mode(const variations_t *w, int k, long long mode)
{
    *of_bearing(w, k, w->bearings.sticks, w->bearings.sticks + w->wheels, w->spins.sticks) = lanes_of(mode == 0);
    *torque_of_bearing(w, w->point, k) = lanes_of(-(double)mode*w->run->bearings.sliding[k]);
}

/* The modes of bearings as in a row. */
static void put_bearing_modes(const variations_t *w, long long row)
{
    for (int k = 0; k < BEARINGS(w); k++)
        put_bearing_mode(w, k, bearing_mode(w, row, k));
}
