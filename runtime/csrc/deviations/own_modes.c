/* Bearings that may stick where wheels may slip: which of them do in a row, and their room at a point. There wheels and
 * rollers have speeds of their own, so that a bearing that sticks takes no direction from nu. */

/* The bearings are those of the axles, if these may stick, then those of the rollers, if these may: wheel by wheel, of
 * each first that in contact. Massless rollers in contact stand in their place: they have no speeds of their own. Where
 * contacts stick the speed of a wheel along its axle is theirs. */
#define MOST_OWN(w) (SET_AXLES_STICK*(w)->wheels + SET_DISKS_STICK*(w)->wheels*(w)->rollers + SET_STRIPS*(w)->wheels)
#define WITH_SERIES(w) (MOST_OWN(w) + (SET_IN_SERIES && !SET_STRIPS)*(w)->wheels)
#define OF_A_WHEEL(w) (SET_IN_SERIES ? 1 : (w)->rollers)    /* bearings of its rollers */
ALWAYS_INLINE int roller_bearing(const variations_t *w, int wheel, int place)
{
    return SET_AXLES_STICK*w->wheels + wheel*OF_A_WHEEL(w) + place;
}

/* In a row 0 where one sticks, else the sign of its rate. */
ALWAYS_INLINE long long own_mode(const variations_t *w, long long row, int k)
{
    return w->run->own_mode[row*WITH_SERIES(w) + k];
}

/* How the largest torque of a bearing at rest moves with a column. */
ALWAYS_INLINE double moved_most(const variations_t *w, int column, int k)
{
    return w->run->own_most_moved[column*WITH_SERIES(w) + k];
}

/* What the functions take and give of axles and of rollers in contact at a point, or as these move. */
ALWAYS_INLINE void put_own_bearings(const variations_t *w, lanes_t *own, point_t *point)
{
    const int moves = own == w->along, wheels = w->wheels;
    const lanes_t *const sticks = moves ? own + point_still(w) : w->bearings.sticks;
    lanes_t *const holding = w->bearings.holding + 2*wheels*moves;
    (void)sticks, (void)holding, (void)point;
#if SET_AXLES_STICK
    point->axle_sticks = sticks, point->axle_holding = holding;
#endif
#if SET_DISKS_STICK || SET_IN_SERIES
    point->contact_sticks = moves ? sticks : sticks + wheels;
#endif
#if SET_DISKS_STICK || SET_STRIPS
    point->contact_holding = holding + wheels;
#endif
#if SET_STRIPS
    point->contact_spin = w->bearings.spin_dot + wheels*moves;
#endif
#if SET_DISKS_STICK
    point->contact_spin_dot = w->bearings.spin_dot + wheels*w->rollers*moves;
    point->spins_dot = point->contact_spin_dot + wheels;
    point->yaw_mass = w->bearings.yaw_mass + moves;
#endif
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
#if SET_AXLES_STICK
    const double *const drive = w->run->drive + row*SET_INPUTS*w->wheels;
    for (int i = 0; i < w->wheels; i++) {
        w->bearings.sticks[i] = lanes_of(own_mode(w, row, i) == 0);
        w->point[point_inputs(w) + SET_BEARING_INPUT*w->wheels + i] = lanes_of(drive[SET_BEARING_INPUT*w->wheels + i]);
    }
#endif
#if SET_DISKS_STICK || SET_IN_SERIES
    put_modes_in_contact(w, row);
#endif
    (void)w, (void)row;
}

/* Of a list with a place for each axle, each roller in contact and each free roller that of a bearing. */
ALWAYS_INLINE lanes_t *of_bearing(const variations_t *w, int k, lanes_t *axles, lanes_t *contact, lanes_t *free)
{
    const int roller = k - SET_AXLES_STICK*w->wheels, wheel = roller/OF_A_WHEEL(w), place = roller%OF_A_WHEEL(w);
    if (roller < 0)
        return axles + k;
    return place == 0 ? contact + wheel : free + wheel*(w->rollers - 1) + place - 1;
}

/* At a point, or as it moves: the acceleration of a bearing, and what holds it. Of a massless roller the former is that
 * of the speed along the axle, over the distance of its axis from the ground in its middle. */
ALWAYS_INLINE double own_dot(const variations_t *w, const point_t *at, int k, int lane)
{
    lanes_t *contact = 0, *free = 0;
#if SET_STRIPS
    if (k >= roller_bearing(w, 0, 0))
        return at->slip_dot[2*(k - roller_bearing(w, 0, 0))][lane]/w->run->standing[1];
#endif
#if SET_DISKS_STICK
    contact = at->contact_spin_dot, free = at->spins_dot;
#endif
    return (*of_bearing(w, k, at->core_dot, contact, free))[lane];
}

ALWAYS_INLINE double own_asked(const variations_t *w, const point_t *at, int k)
{
    lanes_t *axles = 0, *contact = 0, *free = 0;
    (void)at;
#if SET_AXLES_STICK
    axles = at->axle_holding;
#endif
#if SET_STRIPS
    contact = at->contact_holding;
#elif SET_DISKS_STICK
    contact = at->contact_holding, free = at->free_holding;
#endif
    return (*of_bearing(w, k, axles, contact, free))[0];
}

/* The torque of a bearing at a point, or as it moves. */
ALWAYS_INLINE lanes_t *own_torque(const variations_t *w, lanes_t *own, int k)
{
    lanes_t *const inputs = own + point_inputs(w), *free = 0;
#if SET_DISKS_STICK
    free = own == w->along ? w->spins.bearing_along : w->spins.bearing;
#endif
    return of_bearing(w, k, inputs + SET_BEARING_INPUT*w->wheels, inputs + SET_CONTACT_BEARING_INPUT*w->wheels, free);
}
