/* Forces on contacts that slip under Coulomb's friction, at the nodes of a step: they go against the slip, whatever its
 * size. They move with the numbers, and with the directions of the slips; how these turn, turning.c solves for.
 * Massless rollers slip along one line alone. */

/* The number of the core that is a speed of a wheel, by which the slip of its contact goes. */
ALWAYS_INLINE int contact_speed(const variations_t *w, int i, int k) { return 3 + k*w->wheels + i; }

ALWAYS_INLINE int sticks_in(const variations_t *w, long long row, int i)
{
    return SET_GRIPS && w->run->motion.drive[(row*SET_INPUTS + SET_MODES_INPUT)*w->wheels + i] > 0.5;
}

/* Whether a contact slips under a load. */
ALWAYS_INLINE int slides_in(const variations_t *w, long long row, int i)
{
    return SET_GRIPS && !sticks_in(w, row, i) && w->run->contacts.grip[i] > 0;
}

/* The same in a direction that turns. */
ALWAYS_INLINE int turns_in(const variations_t *w, long long row, int i)
{
    const int may = SET_STRIPS ? bearing_mode(w, row, roller_bearing(w, i, 0)) == 0 : SET_HAS_CONTACT_SPEEDS;
    return may && slides_in(w, row, i);
}

/* Whether a contact may slip in both directions of the ground at a point, and not along one line alone. */
ALWAYS_INLINE int slips_in_plane(const point_t *at, int i)
{
    return SET_STRIPS ? at->contact_sticks[i][0] > 0.5 : SET_HAS_CONTACT_SPEEDS;
}

#if !SET_GRIPS
/* Stands for the function that the set does not have: slips that nothing asks for. */
static void slips_along(int wheels, const point_t *at, const point_t *along, lanes_t *slip, lanes_t *moved)
{
    (void)at, (void)along;
    memset(slip, 0, 2*wheels*sizeof *slip), memset(moved, 0, 2*wheels*sizeof *moved);
}
#endif

/* The slip velocities of contacts, and how they move; where massless rollers may stick, of wheels whose rollers do. */
ALWAYS_INLINE void slips_of(const variations_t *w, const point_t *at, const point_t *along, lanes_t *slip,
                            lanes_t *moved)
{
    const int wheels = FIXED_WHEELS(w->wheels);
    lanes_t rigid[MAX_WHEELS], none[MAX_WHEELS];
    point_t point = *at, tangent = *along;
    for (int i = 0; i < SET_STRIPS*wheels; i++)
        rigid[i] = lanes_of(1), none[i] = lanes_of(0);
    if (SET_STRIPS)
        point.contact_sticks = rigid, tangent.contact_sticks = point.ground_yield = tangent.ground_yield = none;
    slips_along(wheels, &point, &tangent, slip, moved);
}

/* The slips alone, at a state where nothing moves. */
static void slips_at(const variations_t *w, lanes_t *state, lanes_t *slip)
{
    lanes_t moved[2*MAX_WHEELS];
    const point_t at = point_of(w, w->vehicle, state), along = point_of(w, w->vehicle, w->along);
    slips_of(w, &at, &along, slip, moved);
}

/* The directions of contacts at a point of the phase of a row, by their slips where these are not rounding, else as the
 * point is given; and the parts of the slips along these. */
NEVER_INLINE void put_directions(const variations_t *w, long long row, const point_t *at, const point_t *along)
{
    const int wheels = FIXED_WHEELS(w->wheels);
    lanes_t slip[2*MAX_WHEELS], moved[2*MAX_WHEELS];
    slips_of(w, at, along, slip, moved);
    for (int i = 0; i < wheels; i++) {
        const int turns = slips_in_plane(at, i);
        const double heading = at->inputs[SET_HEADINGS_INPUT*wheels + i][0];
        const double rolling = SET_STRIPS && !turns ? copysign(1, heading) : sin(heading);
        const lanes_t *const velocity = slip + 2*i, size = lanes_sqrt(velocity[0]*velocity[0] + velocity[1]*velocity[1]);
        const lane_mask_t known = size > (turns ? w->run->contacts.slip_rounding[row*wheels + i] : INFINITY);
        const lanes_t inverse = 1/lanes_select(known, size, lanes_of(1));
        lanes_t *const towards = w->contacts.towards + 2*i;
        towards[0] = lanes_select(known, velocity[0]*inverse, lanes_of(turns ? cos(heading) : 0));
        towards[1] = lanes_select(known, velocity[1]*inverse, lanes_of(rolling));
        w->contacts.slipping[i] = velocity[0]*towards[0] + velocity[1]*towards[1];
    }
}

/* Of contacts that slip and whose rollers turn: the forces along the rolling direction, which are what their bearings
 * leave, and what their slips along the axles go with; and how these move. */
static void put_corners(const variations_t *w, const point_t *at, const point_t *along, const lanes_t *load,
                        const lanes_t *load_moved, const lanes_t *friction, const lanes_t *friction_moved)
{
    const int wheels = FIXED_WHEELS(w->wheels), torque = SET_CONTACT_BEARING_INPUT*wheels;
    lanes_t given[MAX_WHEELS], force[MAX_WHEELS], force_moved[MAX_WHEELS], zero[2*MAX_WHEELS] = {{0}};
    lanes_t *const yield = w->contacts.yielding, *const yield_moved = yield + w->wheels;
    int both[MAX_WHEELS], some = 0;
    for (int i = 0; i < wheels; i++) {
        both[i] = load[i][0] > 0 && !slips_in_plane(at, i), some |= both[i];
        given[i] = lanes_select(load[i] > 0, load[i], lanes_of(1));
    }
    memset(yield, 0, 2*w->wheels*sizeof *yield);
    if (!some)
        return;
    set_corner_forces_along(wheels, at->vehicle, at->chi, w->contacts.towards, given, friction, at->inputs + torque,
                            along->chi, zero, load_moved, friction_moved, along->inputs + torque, force, yield,
                            force_moved, yield_moved);
    for (int i = 0; i < wheels; i++)
        if (both[i])
            at->ground_push[2*i + 1] = force[i], along->ground_push[2*i + 1] = force_moved[i];
        else
            yield[i] = yield_moved[i] = lanes_of(0);
}

/* The forces in these directions, into a point, and how they move with one of the numbers, or with none. */
NEVER_INLINE void put_pushes(const variations_t *w, long long row, int model, const point_t *at, const point_t *along)
{
    const int wheels = FIXED_WHEELS(w->wheels), pair = 2*MAX_WHEELS;
    const double *const grip = w->run->contacts.grip, *const grown = grip + 3*wheels*model;
    lanes_t load[MAX_WHEELS], load_moved[MAX_WHEELS], friction[pair], friction_moved[pair], zero[pair];
    lanes_t slope[2*pair], slope_moved[2*pair];
    for (int i = 0; i < wheels; i++) {
        const double slides = at->inputs[SET_MODES_INPUT*wheels + i][0] < 0.5;
        load[i] = lanes_of(slides*grip[i]), load_moved[i] = lanes_of(model ? slides*grown[i] : 0);
        for (int c = 2*i; c < 2*i + 2; c++) {
            friction[c] = lanes_of(grip[wheels + c]), friction_moved[c] = lanes_of(model ? grown[wheels + c] : 0);
            zero[c] = lanes_of(0);
        }
    }
    set_sliding_forces_along(wheels, at->vehicle, w->contacts.towards, load, friction, zero, load_moved,
                             friction_moved, at->ground_push, slope, along->ground_push, slope_moved);
    for (int k = 0; k < 2*wheels; k++)      /* by the angle of the direction */
        w->contacts.turned[k] = slope[2*k + 1]*w->contacts.towards[k/2*2] - slope[2*k]*w->contacts.towards[k/2*2 + 1];
    if (SET_STRIPS)
        put_corners(w, at, along, load, load_moved, friction, friction_moved);
}

/* The numbers whose slopes the slips have: those of the core and what feeds back to it, then those of the vehicle. */
ALWAYS_INLINE int slip_directions(const variations_t *w) { return w->core + w->feedback + w->run->models - 1; }
ALWAYS_INLINE nodes_t *slope_of_slip(const variations_t *w, int i, int component)
{
    return w->contacts.slip_slope + (2*i + component)*slip_directions(w);
}

/* The slopes of the slips at a block of nodes, by each number of theirs. */
NEVER_INLINE void put_slopes_of_slips(const variations_t *w, int b)
{
    const int states = w->core + w->feedback, wheels = FIXED_WHEELS(w->wheels);
    lanes_t slip[2*MAX_WHEELS], moved[2*MAX_WHEELS], unused;
    for (int place = 0; place < slip_directions(w); place++) {
        const int is_sum = place < states && !is_of_point(w, place);
        const point_t at = point_of(w, &w->vehicle[place < states ? 0 : place - states + 1], w->point);
        const point_t along = point_of(w, at.vehicle, w->along);
        lanes_t *const seed = place < states && !is_sum ? &w->along[place_of_direction(w, place)] : &unused;
        *seed = lanes_of(1);
        slips_of(w, &at, &along, slip, moved);
        *seed = lanes_of(0);
        for (int k = 0; k < 2*wheels; k++)
            slope_of_slip(w, k/2, k%2)[place].lanes[b] = is_sum ? lanes_of(0) : moved[k];
    }
}

/* The slope of such a speed of a contact that sticks by another number of the slips, in a block: what keeps the slip
 * zero. */
ALWAYS_INLINE lanes_t slope_of_speed(const variations_t *w, int i, int k, int place, int b)
{
    const nodes_t *const y = slope_of_slip(w, i, 1);
    const int first = contact_speed(w, i, 0);
    if (!SET_HAS_CONTACT_SPEEDS)
        return -y[place].lanes[b]/y[first].lanes[b];
    const nodes_t *const x = slope_of_slip(w, i, 0);
    const int second = contact_speed(w, i, 1);
    const lanes_t both = x[first].lanes[b]*y[second].lanes[b] - x[second].lanes[b]*y[first].lanes[b];
    return k == 0 ? (x[second].lanes[b]*y[place].lanes[b] - x[place].lanes[b]*y[second].lanes[b])/both
                  : (x[place].lanes[b]*y[first].lanes[b] - x[first].lanes[b]*y[place].lanes[b])/both;
}

/* Whether nothing moves in a direction by itself: a speed of a contact that sticks, or the turn of a slip that does not
 * turn. */
ALWAYS_INLINE int is_bound_to_ground(const variations_t *w, long long row, int d)
{
    const int turning = d - first_turn(w);
    if (turning >= 0)
        return d < w->directions && !turns_in(w, row, turning);
    return d >= 3 && d < 3 + WHEEL_SPEEDS*w->wheels && sticks_in(w, row, (d - 3)%w->wheels);
}

/* Such speeds as a direction moves them, or not at all. */
static void let_speeds_follow(const variations_t *w, long long row, int place, int b)
{
    for (int i = 0; i < w->wheels; i++)
        for (int k = 0; k < WHEEL_SPEEDS && sticks_in(w, row, i); k++)
            w->along[contact_speed(w, i, k)] = place < 0 ? lanes_of(0) : slope_of_speed(w, i, k, place, b);
}

/* The forces on contacts at the point of a phase; nothing moves. */
static void put_forces_on_contacts(const variations_t *w, long long row)
{
    const point_t at = point_of(w, w->vehicle, w->point), along = point_of(w, w->vehicle, w->along);
    put_directions(w, row, &at, &along);
    put_pushes(w, row, 0, &at, &along);
}

/* The forces on contacts at a block of nodes, and the slopes of the slips there. */
static void put_ground(const variations_t *w, long long row, int b)
{
    const int wheels = FIXED_WHEELS(w->wheels);
    put_forces_on_contacts(w, row);
    for (int k = 0; k < 2*wheels; k++)
        w->contacts.towards_at[k].lanes[b] = w->contacts.towards[k];
    for (int i = 0; i < wheels; i++)
        w->contacts.slipping_at[i].lanes[b] = w->contacts.slipping[i];
    put_slopes_of_slips(w, b);
}

/* What moves of contacts in a direction: forces with the turn of a slip or with a number, and speeds that follow. */
static void put_ground_along(const variations_t *w, long long row, int d, int b, const point_t *at,
                             const point_t *along)
{
    const int wheels = FIXED_WHEELS(w->wheels), states = w->core + w->feedback, number = d - w->directions;
    const int turning = d - first_turn(w);
    if (number >= 0)
        put_pushes(w, row, number + 1, at, along);
    else if (turning >= 0) {
        memset(along->ground_push, 0, 2*wheels*sizeof *along->ground_push);
        memcpy(along->ground_push + 2*turning, w->contacts.turned + 2*turning, 2*sizeof *w->contacts.turned);
        memset(w->contacts.yielding + wheels, 0, SET_STRIPS*wheels*sizeof *w->contacts.yielding);
    } else if (SET_STRIPS && d >= w->core)
        put_pushes(w, row, 0, at, along);       /* with angles and torques of bearings                 */
    let_speeds_follow(w, row, number >= 0 ? states + number : d < states ? d : -1, b);
}
