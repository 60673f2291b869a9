/* Loads that follow the motion, in the slopes of the rates: solved together with how these move.
 *
 * At a point the ground's forces are linear in the sums of the loads, the rates in the forces, and the sums that the
 * motion asks for in the rates (ground/loads.c):
 *
 *     r = r_0 + R s,   s = s_0 + C s.
 *
 * R and C are slopes of the generated functions by the sums. In a direction in which the point moves these functions
 * give r' and s' of sums that stay, and
 *
 *     ds = s' + C ds,   dr = r' + R ds.
 *
 * The first sum is the whole load, which no force moves: so two equations are left. Where no contact slips under
 * friction no rate goes with the loads. Beside bearings of massless rollers that turn the forces are linear about the
 * loads alone that are there (bearings/under_loads.h). */

#if SET_LOADS
#define BALANCE_SIZE(wheels) (5 + (wheels))     /* numbers of the loads' balance */
#define BALANCE_ARRAYS(wheels) (2 + (wheels) + SET_CORNERS*2*(wheels))  /* of these in arrays; and of friction */
#define RESPONDING_PARTS (2 + 2*SET_GRIPS + SET_AXLES_STICK + 3*SET_DISKS_STICK + SET_STRIPS)

/* What goes with the loads: how the rates move, the forces on contacts and the rates of the slips, what holds bearings
 * and the accelerations of spins. */
typedef struct {
    lanes_t *of[RESPONDING_PARTS];
    int count[RESPONDING_PARTS];
} responding_t;

ALWAYS_INLINE responding_t responding(const int wheels, const point_t *along, lanes_t *nu_dot_along)
{
    const int rollers = along->vehicle->rollers_per_wheel;
    responding_t found = {{nu_dot_along, along->core_dot}, {3, core_size(wheels, rollers)}};
#if SET_GRIPS
    found.of[2] = along->ground_force, found.of[3] = along->slip_dot, found.count[2] = found.count[3] = 2*wheels;
#endif
#if SET_AXLES_STICK
    found.of[2 + 2*SET_GRIPS] = along->axle_holding, found.count[2 + 2*SET_GRIPS] = wheels;
#endif
#if SET_DISKS_STICK
    const int at = 2 + 2*SET_GRIPS + SET_AXLES_STICK;
    found.of[at] = along->contact_holding, found.count[at] = wheels;
    found.of[at + 1] = along->free_holding, found.count[at + 1] = wheels*(rollers - 1);
    found.of[at + 2] = along->contact_spin_dot, found.count[at + 2] = wheels*rollers;    /* and spins_dot behind it */
#elif SET_STRIPS
    found.of[2 + 2*SET_GRIPS + SET_AXLES_STICK] = along->contact_holding;
    found.count[2 + 2*SET_GRIPS + SET_AXLES_STICK] = wheels;
#endif
    return found;
}

/* How many numbers that is; core: with nu. */
ALWAYS_INLINE int responding_size(const int wheels, int core)
{
    const int free = SET_DISKS_STICK*(core - 3 - 2*wheels);
    return core + (4*SET_GRIPS + SET_AXLES_STICK + 2*SET_DISKS_STICK + SET_STRIPS)*wheels + 2*free;
}

/* The numbers of the balance, or how one of the numbers moves them; without one they stay. */
static void put_balance(const variations_t *w, int model, int moves)
{
    const int wheels = w->wheels, size = BALANCE_SIZE(wheels);
    balance_t *const balance = w->balance + moves;
    lanes_t *const arrays = w->balance_numbers + moves*BALANCE_ARRAYS(wheels);
    const double *const own = w->run->balance + model*size;
    const double by = model > 0 || !moves;
    balance->normal_gravity = lanes_of(by*own[0]), balance->height = lanes_of(by*own[1]);
    balance->wheel_mass = lanes_of(by*own[2]);
    balance->platform_products = arrays, balance->spin_inertia = arrays + 2;
    for (int k = 0; k < 2 + wheels; k++)
        arrays[k] = lanes_of(by*own[3 + k]);
#if SET_CORNERS
    balance->friction = arrays + 2 + wheels;
    for (int k = 0; k < 2*wheels; k++)
        arrays[2 + wheels + k] = lanes_of(by*w->run->grip[3*wheels*model + wheels + k]);
#endif
}

/* How the numbers of a vector of columns move the balance. */
ALWAYS_INLINE void put_balance_of_columns(const variations_t *w, int group)
{
    const int size = BALANCE_SIZE(w->wheels);
    lanes_t own[BALANCE_SIZE(MOST_WHEELS)] = {{0}};
    for (int p = group*LANES; p < w->columns && p < (group + 1)*LANES; p++)
        for (int k = 0; w->run->number[p] && k < size; k++)
            own[k][p%LANES] = w->run->balance[w->run->number[p]*size + k];
    balance_t *const balance = w->balance + 1;
    balance->normal_gravity = own[0], balance->height = own[1], balance->wheel_mass = own[2];
    memcpy(w->balance_numbers + BALANCE_ARRAYS(w->wheels), own + 3, (2 + w->wheels)*sizeof *own);
}

/* The rates, and the sums of the loads that they ask for, under loads with the sums of the point. */
NEVER_INLINE void rates_and_sums_along(const int wheels, const point_t *at, const point_t *along, lanes_t *nu_dot,
                                       lanes_t *nu_dot_along, lanes_t *sums, lanes_t *sums_along)
{
    const lanes_t *const carries = at->inputs + SET_CARRIES_INPUT*wheels;
    loads_t *const own = at->loads, *const moved = along->loads;
    loads_of_sums_along(wheels, at, along, own->sums, moved->sums, own->compression, moved->compression);
    for (int i = 0; i < wheels; i++) {
        own->factor[i] = SET_FRICTION ? carries[i]*own->compression[i] : carries[i];
        moved->factor[i] = SET_FRICTION ? carries[i]*moved->compression[i] : lanes_of(0);
#if SET_NEARLY_LINEAR
        own->factor[i] = own->about[i] + own->gain[i]*(own->factor[i] - own->about[i]);
        moved->factor[i] *= own->gain[i];
#endif
#if SET_CORNERS
        moved->factor[i] = own->left[i]*moved->factor[i] + moved->left[i]*own->factor[i];
        own->factor[i] *= own->left[i];
#endif
    }
    rates_under_loads_along(wheels, at, along, nu_dot, nu_dot_along);
    load_sums_along(wheels, at, along, nu_dot, nu_dot_along, sums, sums_along);
}

/* How the sums move: from what they would move by if they stayed. */
ALWAYS_INLINE void solve_for_sums(const loads_t *loads, const lanes_t *own, lanes_t *sums)
{
    const lanes_t *const m = loads->matrix;
    const lanes_t one = own[1] + loads->by_whole[0]*own[0], other = own[2] + loads->by_whole[1]*own[0];
    const lanes_t over = 1/(m[0]*m[3] - m[1]*m[2]);
    sums[0] = own[0];
    sums[1] = (m[3]*one - m[1]*other)*over, sums[2] = (m[0]*other - m[2]*one)*over;
}

/* What the sums do at a point, and the sums themselves. */
static void find_response(const int wheels, const point_t *at, const point_t *along)
{
    loads_t *const loads = at->loads;
    const int size = responding_size(wheels, 3 + core_size(wheels, at->vehicle->rollers_per_wheel));
    lanes_t nu_dot[3], nu_dot_along[3], sums[3], sums_along[3];
    for (int k = 0; k < 3; k++) {
        along->loads->sums[k] = lanes_of(1);
        rates_and_sums_along(wheels, at, along, nu_dot, nu_dot_along, sums, sums_along);
        along->loads->sums[k] = lanes_of(0);
        for (int j = 0; j < 2; j++)
            if (k == 0)
                loads->by_whole[j] = sums_along[1 + j];
            else
                loads->matrix[2*j + k - 1] = (j == k - 1) - sums_along[1 + j];
        const responding_t all = responding(wheels, along, nu_dot_along);
        lanes_t *to = loads->response + k*size;
        for (int p = 0; p < RESPONDING_PARTS; p++)
            for (int n = 0; n < all.count[p]; n++)
                *to++ = all.of[p][n];
    }
    solve_for_sums(loads, sums, loads->sums);
}

#if SET_CORNERS
/* What bearings leave of the friction in corners under loads that stay, and how it goes with them; and how what they
 * leave moves. */
static void put_left_along(const int wheels, const point_t *at, const point_t *along, const lanes_t *load,
                           lanes_t *taken, lanes_t *moved)
{
    const int torque = SET_CONTACT_BEARING_INPUT*wheels;
    lanes_t still[MOST_WHEELS] = {{0}}, other[2*MOST_WHEELS];
    set_corner_loads_along(wheels, at->vehicle, at->chi, at->inputs + torque, at->balance->friction, load, along->chi,
                           along->inputs + torque, along->balance->friction, still, taken, at->loads->gain,
                           at->loads->left, other, other + MOST_WHEELS, moved);
}

/* Friction in corners is linear about these loads, or near them. */
static void put_about(const int wheels, const point_t *at, const point_t *along, const lanes_t *load)
{
    lanes_t taken[MOST_WHEELS], about[MOST_WHEELS], moved[MOST_WHEELS];
    if (!is_nearly_linear(wheels, at)) {
        be_whole(wheels, at->loads);
        return;
    }
    put_left_along(wheels, at, along, load, taken, moved);
    find_about_in_corners(wheels, load, taken, about);
    put_left_along(wheels, at, along, about, taken, moved);
    be_linear_in_corners(wheels, at, load, about);
}

/* How what bearings leave moves with a point. */
static void move_left(const int wheels, const point_t *at, const point_t *along)
{
    loads_t own = *at->loads;
    point_t there = *at;
    lanes_t taken[MOST_WHEELS], moved[MOST_WHEELS];
    there.loads = &own;
    memset(along->loads->left, 0, wheels*sizeof *moved);
    if (!is_nearly_linear(wheels, at))
        return;
    put_left_along(wheels, &there, along, own.about, taken, moved);
    for (int i = 0; i < wheels; i++)
        along->loads->left[i] = lanes_select(in_corner(wheels, at, i), moved[i], lanes_of(0));
}
#elif SET_NEARLY_LINEAR
/* Friction beside bearings is linear about these loads. */
static void put_about(const int wheels, const point_t *at, const point_t *along, const lanes_t *load)
{
    lanes_t taken[MOST_WHEELS], gain[MOST_WHEELS], still[MOST_WHEELS] = {{0}}, moved[2*MOST_WHEELS];
    const lanes_t *const bearing = at->inputs + SET_CONTACT_BEARING_INPUT*wheels;
#if SET_DAMPS_LOADS
    find_about_beside_dampers(wheels, load, at->loads, taken);
    set_damped_loads_along(wheels, at->vehicle, at->nu, at->chi, at->core, bearing,
                           at->contact_sticks, at->loads->bearing_factor, along->nu, along->chi,
                           along->core, still, still, still, gain, moved);
#else
    set_left_loads_along(wheels, at->vehicle, at->chi, bearing, load, along->chi, still, still, taken, gain, moved,
                         moved + MOST_WHEELS);
#endif
    be_linear_about(wheels, load, taken, gain, at->contact_sticks, at->loads);
}
#endif

#if SET_NEARLY_LINEAR
/* Whether some roller leaves a part of a load. */
ALWAYS_INLINE int some_leave(const int wheels, const point_t *at)
{
#if SET_CORNERS
    return is_nearly_linear(wheels, at);
#else
    int found = 0;
    for (int i = 0; i < wheels; i++)
        found |= at->contact_sticks[i][0] == 0;         /* the same in all lanes */
    return found;
#endif
}

/* The loads at a point about which friction beside bearings is linear, by Newton's rule from those of the vehicle at
 * rest; not a number where that does not end. In corners it comes to them from above, from whole friction. */
static void settle_loads(const int wheels, const point_t *at, const point_t *along, const double *at_rest)
{
    const lanes_t *const carries = at->inputs + SET_CARRIES_INPUT*wheels;
    loads_t *const loads = at->loads;
    lanes_t load[MOST_WHEELS], last = lanes_of(INFINITY);
    int found[LANES] = {0}, left = some_leave(wheels, at);
    for (int i = 0; i < wheels; i++)
        load[i] = lanes_of(at_rest[i]);
    if (!left) {
        put_about(wheels, at, along, load);
        return;
    }
    for (int round = 0; round < MOST_ROUNDS && left; round++) {
        const int whole = SET_CORNERS && round == 0;
        lanes_t step = {0};
#if SET_CORNERS
        if (whole)
            be_whole(wheels, loads);
        else
#endif
            put_about(wheels, at, along, load);
        memset(loads->sums, 0, sizeof loads->sums);
        find_response(wheels, at, along);
        loads_of_sums_along(wheels, at, along, loads->sums, along->loads->sums, loads->compression,
                            along->loads->compression);
        for (int i = 0; i < wheels; i++) {
            step = lanes_max(step, lanes_abs(carries[i]*loads->compression[i] - load[i]));
            load[i] = carries[i]*loads->compression[i];
        }
        if (whole)
            continue;
        left = settle_lanes(step, last, loads->sums[0], found);
        last = step;
    }
    for (int k = 0; k < LANES; k++)
        for (int i = 0; i < wheels && !found[k]; i++)
            load[i][k] = NAN;
    put_about(wheels, at, along, load);
}
#endif

/* The loads at a point, which all directions share. seeks: also where no rate goes with them. Nothing moves in `along`.
 */
static void find_loads(const int wheels, const point_t *at, const point_t *along, int seeks, const double *at_rest)
{
    loads_t *const loads = at->loads;
    (void)at_rest;
    memset(along->loads->sums, 0, sizeof loads->sums);
#if SET_CORNERS
    memset(along->loads->left, 0, sizeof loads->left);
#endif
#if SET_NEARLY_LINEAR
    settle_loads(wheels, at, along, at_rest);
#endif
    memset(loads->sums, 0, sizeof loads->sums);
    loads->responds = SET_FRICTION;
#if SET_GRIPS
    loads->responds = !are_zero(at->ground_push, 2*wheels);
#endif
    loads->seeks = seeks;
    lanes_t nu_dot[3], nu_dot_along[3], sums[3];
    if (loads->responds)
        find_response(wheels, at, along);
    else if (seeks)
        rates_and_sums_along(wheels, at, along, nu_dot, nu_dot_along, loads->sums, sums);
}

/* The same where the point of a step or a row is. */
static void put_loads(const variations_t *w, int seeks)
{
    const point_t at = point_of(w, w->vehicle, w->point), along = point_of(w, w->vehicle, w->along);
    put_balance(w, 0, 1);
    find_loads(OWN_WHEELS(w->wheels), &at, &along, seeks, w->run->at_rest);
}

/* Rates of nu, and into core_dot those of the rest of the core, with the loads that they ask for; and how they move.
 * The loads at the point are known (find_loads); how they move is left in along->loads, as sums. */
NEVER_INLINE void rates_along(const int wheels, const point_t *at, const point_t *along, lanes_t *nu_dot,
                              lanes_t *nu_dot_along)
{
    loads_t *const loads = at->loads, *const moved = along->loads;
    lanes_t sums[3], own[3];
    memset(moved->sums, 0, sizeof moved->sums);
#if SET_CORNERS
    move_left(wheels, at, along);
#endif
    if (!loads->responds && !loads->seeks) {
        memcpy(loads->factor, at->inputs + SET_CARRIES_INPUT*wheels, wheels*sizeof *loads->factor);
        memset(moved->factor, 0, wheels*sizeof *moved->factor);
        rates_under_loads_along(wheels, at, along, nu_dot, nu_dot_along);
        return;
    }
    rates_and_sums_along(wheels, at, along, nu_dot, nu_dot_along, sums, own);
    if (!loads->responds) {
        memcpy(moved->sums, own, sizeof own);
        return;
    }
    solve_for_sums(loads, own, moved->sums);
    const responding_t all = responding(wheels, along, nu_dot_along);
    const int size = responding_size(wheels, 3 + core_size(wheels, at->vehicle->rollers_per_wheel));
    const lanes_t *by = loads->response;
    for (int p = 0; p < RESPONDING_PARTS; p++)
        for (int n = 0; n < all.count[p]; n++, by++)
            all.of[p][n] += by[0]*moved->sums[0] + by[size]*moved->sums[1] + by[2*size]*moved->sums[2];
}
#endif
