/* Massless rollers that turn on contacts that slip: both move, and their contacts are in the corners of the ground's
 * ellipse and the bearing's strip. Of the friction across the axle the bearing leaves what is in no proportion to the
 * load. The rules are in runtime/omniroll/effects/loaded_ground_with_massless_rollers.py. */

/* By how many rounds at most. */
ALWAYS_INLINE int rounds_of(const int wheels, const point_t *at)
{
    return is_nearly_linear(wheels, at) ? at->loads->rounds : 1;
}

/* The loads about which friction in corners is linear, and what is left of it there, near these loads. */
ALWAYS_INLINE void put_corners_about(const int wheels, const point_t *at, const lanes_t *load)
{
    loads_t *const loads = at->loads;
    const lanes_t *const bearing = at->inputs + SET_CONTACT_BEARING_INPUT*wheels;
    lanes_t taken[MOST_WHEELS], about[MOST_WHEELS];
    set_corner_loads(wheels, at->vehicle, at->chi, bearing, at->balance->friction, load, taken, loads->gain,
                     loads->left);
    find_about_in_corners(wheels, load, taken, about);
    set_corner_loads(wheels, at->vehicle, at->chi, bearing, at->balance->friction, about, taken, loads->gain,
                     loads->left);
    be_linear_in_corners(wheels, at, load, about);
}

/* The same near the loads with these sums; friction elsewhere is in proportion to the loads. In the first of many rounds
 * it is so everywhere: from there Newton's rule comes to loads from above. Below those of which a bearing takes all it
 * would stay. */
ALWAYS_INLINE void put_about(const int wheels, const point_t *at)
{
    loads_t *const loads = at->loads;
    loads_of_sums(wheels, at, loads->sums, loads->compression);
    if (!loads->whole && is_nearly_linear(wheels, at)) {
        put_corners_about(wheels, at, loads->compression);
        return;
    }
    be_whole(wheels, loads);
}

/* How far contacts in corners slip along their axles under these loads, and the spins of all rollers: no rate follows
 * from them, and they are no linear functions of the loads. */
ALWAYS_INLINE void put_yields(const int wheels, const point_t *at, const lanes_t *load)
{
    const lanes_t *const bearing = at->inputs + SET_CONTACT_BEARING_INPUT*wheels;
    lanes_t toward[2*MOST_WHEELS], force[MOST_WHEELS], holding[MOST_WHEELS], *const yield = at->loads->yield;
    if (is_nearly_linear(wheels, at)) {
        for (int i = 0; i < wheels; i++)            /* against the force                                          */
            toward[2*i] = lanes_of(0), toward[2*i + 1] = -at->ground_push[2*i + 1];
        set_corner_forces(wheels, at->vehicle, at->chi, toward, load, at->balance->friction, bearing, force, yield);
        for (int i = 0; i < wheels; i++)
            yield[i] = lanes_select(in_corner(wheels, at, i), yield[i], lanes_of(0));
    } else
        for (int i = 0; i < wheels; i++)
            yield[i] = lanes_of(0);
    set_slip_spins(wheels, at->vehicle, at->nu, at->chi, at->core + rates_at(wheels), bearing, at->ground_push,
                   at->loads->factor, yield, at->contact_sticks, at->contact_spin, holding);
    (void)force, (void)holding;
}
