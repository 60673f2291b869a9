/* Contacts that slip and whose massless rollers turn in bearings with viscous friction: what the state says of them,
 * and where they go at the nodes of a step. The numbered rules are in
 * runtime/omniroll/effects/ground_with_damped_rollers.py.
 *
 * Ground and bearing take the same force along the axle. So such a contact is one whose roller sticks, and which goes
 * where the ellipse has just what the bearing takes: the ground's force is that of its direction, and what a direction
 * misses is the slip across it, by the state and by what that force leaves of the bearing's. It is as regular where the
 * slip is zero as elsewhere. */
#if SET_DAMPED_STRIPS
/* The loads that bearings feel from now on: at the nodes in vector b, and at a step's end. */
ALWAYS_INLINE void feel_loads(const own_bearings_t *own, const int wheels, const lanes_t *load)
{
    for (int i = 0; i < wheels && SET_LOADS; i++)
        own->load[i] = lanes_max(load[i], lanes_of(LEAST_ABOUT));
    (void)load;
}

ALWAYS_INLINE void feel_loads_at(const step_t *s, const int wheels, int b)
{
#if SET_LOADS
    feel_loads(s->own, wheels, s->loads_at[b].compression);
#endif
    (void)s, (void)wheels, (void)b;
}

ALWAYS_INLINE void feel_loads_at_end(const step_t *s, const int wheels)
{
#if SET_LOADS
    for (int i = 0; i < wheels; i++)
        s->own->load[i] = lanes_of(fmax(s->weight_carried*weighted(&s->compressed[i], &gauss_end), LEAST_ABOUT));
#endif
    (void)s, (void)wheels;
}

/* How far such contacts slip along their axles per force, in some states where bearings have these torques, and three
 * slopes of each of these slips; of others numbers without a meaning. */
static void damped_roots(const own_bearings_t *own, const vehicle_t *v, const int wheels, const lanes_t *nu,
                         const lanes_t *chi, const lanes_t *core, const lanes_t *torque, lanes_t *yield,
                         lanes_t *slopes)
{
    lanes_t toward[2*MOST_WHEELS], force[MOST_WHEELS];
    for (int k = 0; k < 2*wheels; k++)
        toward[k] = lanes_of(k%2);
    set_damped_corners(wheels, v, nu, chi, core + rates_at(wheels), toward, own->load, own->friction, torque, force,
                       yield, slopes);
    (void)force;
}

/* The slips of `corner` along their axles, in the place of the speeds of their wheels. */
NEVER_INLINE void put_damped_slips(const own_bearings_t *own, const vehicle_t *v, const int wheels, const lanes_t *nu,
                                   const lanes_t *chi, const lanes_t *core, const lanes_t *torque, const int *corner,
                                   lanes_t *slip)
{
    lanes_t yield[MOST_WHEELS], slopes[3*MOST_WHEELS], none[2*MOST_WHEELS], found[2*MOST_WHEELS], force[2*MOST_WHEELS];
    lanes_t whole[MOST_WHEELS];
    for (int k = 0; k < 2*wheels; k++)
        none[k] = lanes_of(0), whole[k/2] = lanes_of(1);
    damped_roots(own, v, wheels, nu, chi, core, torque, yield, slopes);
    set_slip_forces(wheels, v, nu, chi, core + rates_at(wheels), torque, none, PER_LOAD(whole) none, yield, none,
                    PASSED_ON(whole) found, force);
    for (int i = 0; i < wheels; i++)
        if (corner[i])
            slip[2*i] = found[2*i];
    (void)force, (void)slopes, (void)whole;
}

/* The spins of rollers in their modes, of which those of `corner` turn on contacts that slip. */
NEVER_INLINE void damped_spins(const own_bearings_t *own, const vehicle_t *v, const int wheels, const lanes_t *nu,
                               const lanes_t *chi, const lanes_t *core, const lanes_t *torque, const lanes_t *sticks,
                               const int *corner, lanes_t *spin)
{
    lanes_t yield[MOST_WHEELS], slopes[3*MOST_WHEELS], none[2*MOST_WHEELS], holding[MOST_WHEELS], whole[MOST_WHEELS];
    for (int k = 0; k < 2*wheels; k++)
        none[k] = lanes_of(0), whole[k/2] = lanes_of(1);
    damped_roots(own, v, wheels, nu, chi, core, torque, yield, slopes);
    for (int i = 0; i < wheels; i++)
        yield[i] = corner[i] ? yield[i] : lanes_of(0);
    set_slip_spins(wheels, v, nu, chi, core + rates_at(wheels), torque, none, PER_LOAD(whole) none, yield, sticks,
                   PASSED_ON(whole) spin, holding);
    (void)holding, (void)slopes, (void)whole;
}

/* To the dynamics such contacts are those of wheels whose rollers stick. */
ALWAYS_INLINE void put_rigid(const own_bearings_t *own, const int *corner, const int wheels, arrays_t *at,
                             point_t *point)
{
    for (int i = 0; i < wheels; i++) {
        at->rigid[i] = corner[i] ? lanes_of(1) : own->sticks[own->rollers_at + i];
        at->ground_yield[i] = at->damped_yield[i] = lanes_of(0);
        if (corner[i])
            at->input[SET_CONTACT_BEARING_INPUT*wheels + i] = lanes_of(0);
    }
#if SET_LOADS
    for (int i = 0; i < wheels; i++)
        at->passed_on[i] = lanes_of(1);
    point->passed_on = at->passed_on;
#endif
    point->contact_sticks = at->rigid, point->ground_yield = at->ground_yield, point->damped_yield = at->damped_yield;
}

/* ---- at the nodes --------------------------------------------------------------------------------------------- */

/* How fast they slip along directions (2 N) in some states, and how the slip across these falls as they turn, and that,
 * over the speed at which the damper takes all of the friction. */
static void ways_along(const step_t *s, const int wheels, const lanes_t *nu, const lanes_t *chi, const lanes_t *core,
                       const lanes_t *toward, lanes_t *yield, lanes_t *size, lanes_t *along, lanes_t *across)
{
    set_damped_ways(wheels, s->vehicle, nu, chi, core + rates_at(wheels), toward, s->own->load, s->friction,
                    s->own->torque + s->own->rollers_at, yield, size, along, across);
}

/* The same in the directions at the nodes of vector b, where wheels have these angles; returns the yields. */
static void ways_at(step_t *s, const int wheels, int b, const lanes_t *nu, const lanes_t *chi, lanes_t *yield)
{
    lanes_t toward[2*MOST_WHEELS], size[MOST_WHEELS], along[MOST_WHEELS], across[MOST_WHEELS];
    for (int k = 0; k < 2*wheels; k++)
        toward[k] = s->toward[k].lanes[b];
    feel_loads_at(s, wheels, b);
    ways_along(s, wheels, nu, chi, core_at(s, b), toward, yield, size, along, across);
    for (int i = 0; i < wheels; i++)
        if (s->corner[i]) {
            s->way_size[i].lanes[b] = size[i];
            s->way_along[i].lanes[b] = along[i], s->way_across[i].lanes[b] = across[i];
        }
#if SET_WAYS_FEEL_LOADS
    lanes_t by_load[MOST_WHEELS];
    set_damped_way_slopes(wheels, s->vehicle, toward, s->own->load, s->friction, across, by_load);
    for (int i = 0; i < wheels; i++)
        s->way_by_load[i].lanes[b] = by_load[i]/s->own->load[i];
#endif
}

#if SET_WAYS_FEEL_LOADS
/* What a turn of contact j's directions does to the slip across those of such a contact i through the load of i, per
 * turn at the nodes. Where i goes almost along its axle a little less of its load turns it by much. */
ALWAYS_INLINE nodes_t across_by_turn(const step_t *s, int i, int j)
{
    const double *const response = s->load_response + 2*(s->wheels*i + j);
    nodes_t slope;
    for (int b = 0; b < BLOCKS; b++)
        slope.lanes[b] = s->way_by_load[i].lanes[b]
            *(response[0]*s->turned[2*j].lanes[b] + response[1]*s->turned[2*j + 1].lanes[b]);
    return slope;
}
#endif

/* The slip across the directions of such a contact, where that of its wheel moves by this at the nodes, along the axle
 * (k = 0) or along the rolling direction. */
ALWAYS_INLINE void move_across(step_t *s, int i, int k, const nodes_t *moved)
{
    for (int b = 0; b < BLOCKS; b++)
        s->way_across[i].lanes[b] += s->way_pace[i]*moved->lanes[b]
            *(k ? s->toward[2*i].lanes[b] : -s->toward[2*i + 1].lanes[b]);
}

/* Rates of a contact's slip, of such a contact over the speed of its damper. */
ALWAYS_INLINE void over_pace(const step_t *s, int i, nodes_t *rate)
{
    for (int k = 0; k < 2 && s->corner[i]; k++)
        for (int b = 0; b < BLOCKS; b++)
            rate[k].lanes[b] *= s->way_pace[i];
}

/* The slips of these contacts at the step's end, along the directions that they have there. */
static void ways_at_end(step_t *s, const int wheels, const point_t *point)
{
    lanes_t toward[2*MOST_WHEELS], size[MOST_WHEELS], along[MOST_WHEELS], across[MOST_WHEELS], yield[MOST_WHEELS];
    for (int i = 0; i < wheels; i++) {
        const double x = weighted(&s->toward[2*i], &gauss_end), y = weighted(&s->toward[2*i + 1], &gauss_end);
        toward[2*i] = lanes_of(x/hypot(x, y)), toward[2*i + 1] = lanes_of(y/hypot(x, y));
    }
    feel_loads_at_end(s, wheels);
    ways_along(s, wheels, point->nu, point->chi, point->core, toward, yield, size, along, across);
    for (int i = 0; i < wheels; i++)
        for (int k = 2*i; k < 2*i + 2 && s->corner[i]; k++)
            s->end_toward[k] = toward[k][0], s->end_slip[k] = size[i][0]*toward[k][0];
    (void)yield, (void)along, (void)across;
}

/* To the accounts bearings give what they take, at the slips of the nodes in vector b. */
static void put_accounts_beside_dampers(step_t *s, const int wheels, int b, arrays_t *at)
{
    lanes_t yield[MOST_WHEELS];
    ways_at(s, wheels, b, at->nu, at->chi, yield);
    for (int i = 0; i < wheels; i++)
        if (s->corner[i]) {
            at->rigid[i] = lanes_of(0), at->damped_yield[i] = yield[i];
            at->input[SET_CONTACT_BEARING_INPUT*wheels + i] = s->own->torque[s->own->rollers_at + i];
        }
}
#endif
