/* Contacts that slip and stick under Coulomb's friction, at the nodes of a step.
 *
 * The force on a contact that slips goes against the slip, whatever its size. It moves with the numbers, and with the
 * direction of the slip, which turns the faster the slower the slip is. So the turn of each direction at the nodes is
 * an unknown beside the rates,
 *
 *     slip across the direction = turn times the slip along it,
 *
 * which is as regular where a slip comes to rest as elsewhere. These are rows behind those of the core: their slopes
 * are those of the slip across, with the opposite sign, and of a turn by itself the slip along. Massless rollers slip
 * along one line alone. */

/* The number of the core that is a speed of a wheel, by which the slip of its contact goes. */
ALWAYS_INLINE int contact_speed(const variations_t *w, int i, int k) { return 3 + k*w->wheels + i; }

ALWAYS_INLINE int sticks_in(const variations_t *w, long long row, int i)
{
    return SET_GRIPS && w->run->motion.drive[(row*SET_INPUTS + SET_MODES_INPUT)*w->wheels + i] > 0.5;
}

/* Whether the rate of a wheel goes with nu alone: its contact rolls or sticks. */
ALWAYS_INLINE int follows_nu(const variations_t *w, long long row, int i) { return !SET_SLIPS || sticks_in(w, row, i); }

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

/* Whether nothing moves in a direction by itself: a speed of a contact that sticks, or the turn of a slip that does not
 * turn. */
ALWAYS_INLINE int is_bound_to_ground(const variations_t *w, long long row, int d)
{
    const int turning = d - first_turn(w);
    if (turning >= 0)
        return d < w->directions && !turns_in(w, row, turning);
    return d >= 3 && d < 3 + WHEEL_SPEEDS*w->wheels && sticks_in(w, row, (d - 3)%w->wheels);
}

/* Where a contact sticks its slip stays zero: such speeds go with nu and the wheels' angles as where it rolls. */
static void let_speeds_follow(const variations_t *w, long long row, int d, const point_t *at, const point_t *along)
{
    const int wheels = FIXED_WHEELS(w->wheels), feeds_back = d >= w->core && d < w->core + w->feedback;
    lanes_t own[MAX_WHEELS], moved[2*MAX_WHEELS] = {{0}};
    int some = 0;
    for (int i = 0; i < wheels; i++)
        some |= sticks_in(w, row, i);
    if (some && (d < 3 || feeds_back || d >= w->directions)) {
        set_wheel_speeds_along(wheels, at->vehicle, at->nu, along->nu, own, moved);
        if (SET_HAS_CONTACT_SPEEDS)
            set_contact_axial_along(wheels, at->vehicle, at->nu, at->chi, along->nu, along->chi, own, moved + wheels);
    }
    for (int k = 0; k < WHEEL_SPEEDS*wheels; k++)
        if (sticks_in(w, row, k%wheels))
            w->along[3 + k] = moved[k];
}

/* The forces on contacts at the point of a phase; nothing moves. */
static void put_forces_on_contacts(const variations_t *w, long long row)
{
    const point_t at = point_of(w, w->vehicle, w->point), along = point_of(w, w->vehicle, w->along);
    put_directions(w, row, &at, &along);
    put_pushes(w, row, 0, &at, &along);
}

/* What moves of contacts in a direction: forces with the turn of a slip or with a number, and speeds that follow. */
static void put_ground_along(const variations_t *w, long long row, int d, const point_t *at, const point_t *along)
{
    const int wheels = FIXED_WHEELS(w->wheels), number = d - w->directions, turning = d - first_turn(w);
    if (number >= 0)
        put_pushes(w, row, number + 1, at, along);
    else if (turning >= 0) {
        memset(along->ground_push, 0, 2*wheels*sizeof *along->ground_push);
        memcpy(along->ground_push + 2*turning, w->contacts.turned + 2*turning, 2*sizeof *w->contacts.turned);
        memset(w->contacts.yielding + wheels, 0, SET_STRIPS*wheels*sizeof *w->contacts.yielding);
    } else if (SET_STRIPS && d >= w->core)
        put_pushes(w, row, 0, at, along);       /* with angles and torques of bearings                 */
    let_speeds_follow(w, row, d, at, along);
}

/* The slopes of the rows of turns in a direction, at a block of nodes. */
static void put_slopes_of_turns(const variations_t *w, long long row, int d, int b, const point_t *at,
                                const point_t *along, int stride, nodes_t *to)
{
    const int wheels = FIXED_WHEELS(w->wheels), turning = d - first_turn(w);
    lanes_t slip[2*MAX_WHEELS], moved[2*MAX_WHEELS] = {{0}};
    int some = 0;
    for (int i = 0; i < wheels; i++)
        some |= turns_in(w, row, i);
    if (some && (d < w->core + w->feedback || d >= w->directions))
        slips_of(w, at, along, slip, moved);
    for (int i = 0; i < wheels; i++) {
        const lanes_t *const towards = w->contacts.towards + 2*i;
        const lanes_t across = moved[2*i]*towards[1] - moved[2*i + 1]*towards[0];
        to[i*stride].lanes[b] = i == turning ? w->contacts.slipping[i] : across;
    }
}
