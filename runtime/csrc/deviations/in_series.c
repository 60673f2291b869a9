/* How deviations pass where massless rollers stick on their disks and break away, where wheels may slip under a smooth
 * law. The force along a wheel's axle follows from the state and from the mode of its own roller, so that each has its
 * own instant, and what it alone does to the rates:
 *
 *     d+ = d- + sum (f- - f+) dt,   dt = -d excess/excess'
 *
 * (runtime/omniroll/engine/massless_deviations.py). Where a roller comes to rest no rate jumps, and neither does one
 * where break-away and sliding torques are the same. Where something else happens at that instant, or what is asked of
 * a roller only just comes to its bound, the caller decides. */

#if SET_IN_SERIES && !SET_GRIPS
/* The bearing of a roller among all. */
ALWAYS_INLINE int bearing_in_series(const variations_t *w, int i) { return roller_bearing(w, i, 0); }

static int changes_in_series(const variations_t *w, long long row)
{
    return modes_differ(w, row, row + 1, MOST_OWN(w), w->wheels);
}

/* Whether a roller breaks away behind a row from more than it takes then. */
static int jumps_in_series(const variations_t *w, long long row, int i)
{
    const int k = bearing_in_series(w, i);
    return own_mode(w, row, k) == 0 && own_mode(w, row + 1, k) != 0 && jumps_as_it_goes(w, k);
}

/* The rates in a row, where one roller is as in the next row already, or none: -1. */
static void rates_with_one_gone(const variations_t *w, long long row, int gone, lanes_t *rate)
{
    put_state(w, row, w->point);
    put_own_modes(w, row);
    if (gone >= 0) {
        const long long mode = own_mode(w, row + 1, bearing_in_series(w, gone));
        w->bearings.sticks[w->wheels + gone] = lanes_of(mode == 0);
        *own_torque(w, w->point, bearing_in_series(w, gone)) =
            lanes_of(-(double)mode*w->run->own_sliding[bearing_in_series(w, gone)]);
    }
    rates_at_point(w, row, rate);
}

/* What the ground would ask of all rollers if they stuck, at the state of the point, and how that moves along its way.
 */
static void asked_in_series(const variations_t *w, long long row, const vehicle_t *v, lanes_t *asked, lanes_t *moved)
{
    const int wheels = OWN_WHEELS(w->wheels), chi = point_chi(w);
    lanes_t spin[MOST_WHEELS], spin_moved[MOST_WHEELS], none[MOST_WHEELS] = {{0}}, sticks[MOST_WHEELS];
    for (int i = 0; i < wheels; i++)
        sticks[i] = lanes_of(1);
    (void)row;
    set_slip_spins_along(wheels, v, w->point, w->point + chi, w->point + POINT_CORE, none, sticks,
                         w->along, w->along + chi, w->along + POINT_CORE, none,
                         none, spin, asked, spin_moved, moved);
}

/* The same along a column or with time. */
static void put_asked_in_series(const variations_t *w, long long row, int column, const lanes_t *rate, lanes_t *asked,
                                lanes_t *moved)
{
    put_way(w, row, column, rate);
    asked_in_series(w, row, &w->vehicle[column < 0 ? 0 : w->run->number[column]], asked, moved);
    take_way_back(w);
}

/* By how much the times deviate (wheels x columns) at which rollers come to their bounds, where the rates before have
 * been computed last. Returns 0 where one only just comes there or is not there, or where no step has said yet how
 * inputs deviate. */
static int put_times_in_series(const variations_t *w, long long row, const lanes_t *before, double *time)
{
    const double lasted = time_of_own_modes(w, row, MOST_OWN(w), w->wheels);
    lanes_t asked[MOST_WHEELS], moved[MOST_WHEELS];
    double side[MOST_WHEELS], rises[MOST_WHEELS];
    if (step_before(w, row) < 0)
        return 0;
    put_asked_in_series(w, row, TIMES_ALONE, before, asked, moved);
    for (int i = 0; i < w->wheels; i++) {
        const double bound = w->run->own_most[bearing_in_series(w, i)];
        side[i] = asked[i][0] < 0 ? -1 : 1, rises[i] = side[i]*moved[i][0];
        if (jumps_in_series(w, row, i) && !(fabs(side[i]*asked[i][0] - bound) <= w->run->reached*bound
                                            && rises[i]*lasted > w->run->only_just*bound))
            return 0;
    }
    for (int p = 0; p < w->columns; p++) {
        put_asked_in_series(w, row, p, before, asked, moved);
        for (int i = 0; i < w->wheels; i++)
            time[i*w->columns + p] =
                -(side[i]*moved[i][0] - moved_most(w, p, bearing_in_series(w, i)))/rises[i];
    }
    return 1;
}

/* Pass a change of modes between a row and the next. Returns whether it was one of those above; else nothing has been
 * done. */
static int pass_in_series(variations_t *w, long long row)
{
    double time[w->wheels*w->columns];
    lanes_t before[w->size], after[w->size];
    int jump = 0;
    for (int i = 0; i < w->wheels; i++)
        jump |= jumps_in_series(w, row, i);
    if (!jump)
        return 1;
    rates_with_one_gone(w, row, -1, before);
    if (!put_times_in_series(w, row, before, time))
        return 0;
    for (int i = 0; i < w->wheels; i++)
        if (jumps_in_series(w, row, i)) {
            rates_with_one_gone(w, row, i, after);
            add_jump(w, before, after, time + i*w->columns);
        }
    return 1;
}
#endif
