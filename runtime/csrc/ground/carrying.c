/* Which contacts carry where the loads follow the motion, and where that changes: a load that vanishes, or comes back. The
 * numbered rules are in runtime/omniroll/effects/ground_loads.py; the names and the numbers are the same. */
#if SET_LOADS
#define MOST 7                      /* wheels of which all sets are tried                                    */
#define FITS 1e-11                  /* of the weight: a load, or a spring that pulls, is zero within this    */
#define AT_EVENT 1e-6               /* of the weight: the same of one that comes back at this instant */
#define SAME 1e-9                   /* of the weight: solutions that differ by less are one                  */
#define DETERMINED 1e-6             /* least determinant of the coupled matrix                               */
#define STANDING 1e-9               /* width of the contacts that carry, per their length                    */
#define ON_EDGE 1e-9                /* of the vehicle's size: loads act on the edge within this              */
#define LEAST_LOAD 1e-15            /* of the weight: a contact that carries does not have less              */
#define LOAD_ROUNDING (256*EPS)     /* of the weight, in a load; and of the determinant                      */
#define ELSEWHERE 4                  /* starts on the way from the middle to each contact, where none fit      */
#define LOAD_TURNS 16               /* roundings that a load has inside a step                               */
#define LOAD_RISES 1e5              /* of these its slope at the end of a step is known                      */

static void balance_in_lanes(const omniroll_run_t *run, work_t *work)
{
    const omniroll_ground_t *const ground = &run->ground;
    balance_t *const balance = &work->balance;
    lanes_t *const products = work->balance_numbers, *const inertia = products + 2;
    balance->normal_gravity = lanes_of(ground->normal_gravity), balance->height = lanes_of(ground->height);
    balance->wheel_mass = lanes_of(ground->wheel_mass), balance->arm = ground->arms[0];
    balance->platform_products = products, balance->spin_inertia = inertia;
    for (int k = 0; k < 2; k++)
        products[k] = lanes_of(ground->platform_products[k]);
    for (int i = 0; i < run->wheels; i++)
        inertia[i] = lanes_of(ground->spin_inertia[i]);
#if SET_CORNERS
    balance->friction = work->friction;
#endif
}

/* The contacts that carry, where the kernel and the rows have them. */
static void put_carrying(omniroll_run_t *run)
{
    for (int i = 0; i < run->wheels; i++)
        run->inputs[SET_CARRIES_INPUT*run->wheels + i] = run->grips[i].carries;
}

/* ---- which contacts carry ------------------------------------------------------------------------------------ */

/* A set of contacts that may carry, and the loads that it would have. */
typedef struct {
    int carries[MOST_WHEELS];
    double compression[MOST_WHEELS], sums[3], determinant;
#if SET_LOADED_BEARINGS
    bearings_of_set_t bearings;
#endif
#if SET_STANDS
    int mode[ON_GROUND*MOST_WHEELS];            /* of bearings that touch the ground                       */
#endif
#if SET_GRIPS
    double ground_force[2*MOST_WHEELS];
#endif
} carrying_t;

/* What has been tried. */
typedef struct {
    int tried, fits, several, regular, elsewhere;
    carrying_t first, fit, other, nearest;      /* tried first; fits first; fits and differs; fits with fewest changes */
    double least_determinant;                   /* of those that fit                                        */
} search_t;

#if SET_CORNERS
/* The mode of a massless roller in a set: where the contact is off it sticks (rule 3 of
 * loaded_ground_with_massless_rollers.py). */
ALWAYS_INLINE int roller_mode_in_set(const work_t *work, const carrying_t *set, int i)
{
    return set->carries[i] ? set->mode[work->own.rollers_at + i] : 0;
}

static void slips_now(const omniroll_run_t *run, const work_t *work, double *slip);
static void slips_beside_turning(const omniroll_run_t *run, const work_t *work, const double *pair, double *slip);
static double slip_rounding(const omniroll_run_t *run, int contact);

/* The forces per load of contacts that slip, in each lane where they go in the modes of its set: along the rolling
 * direction alone where rollers turn. */
static void forces_in_sets(const omniroll_run_t *run, const work_t *work, const carrying_t *sets, int count,
                           lanes_t *unit)
{
    double pair[2*MOST_WHEELS], turning[2*MOST_WHEELS];
    lanes_t toward[2*MOST_WHEELS], slope[4*MOST_WHEELS];
    slips_now(run, work, pair);
    slips_beside_turning(run, work, pair, turning);
    for (int i = 0; i < run->wheels; i++) {
        const omniroll_grip_t *const grip = run->grips + i;
        const double size = length_of(pair + 2*i, 2);
        const int moves = !grip->resting && size > slip_rounding(run, i), now = roller_mode(run, i) != 0;
        for (int lane = 0; lane < LANES; lane++) {
            const int turns = roller_mode_in_set(work, sets + (lane < count ? lane : 0), i) != 0;
            const int other = moves && turns != now;
            for (int k = 2*i; k < 2*i + 2; k++)
                toward[k][lane] = !other ? grip->towards[k - 2*i] : turns ? turning[k] : pair[k]/size;
        }
    }
    set_sliding_forces(run->wheels, &work->vehicle, toward, work->load, work->friction, unit, slope);
    (void)slope;
}

/* The rollers of a set in one lane of an instant. */
static void turn_in_lane(const omniroll_run_t *run, const work_t *work, const carrying_t *set, const int *sticks,
                         int lane, arrays_t *at)
{
    for (int i = 0; i < run->wheels; i++) {
        const int place = work->own.rollers_at + i, mode = roller_mode_in_set(work, set, i);
        work->own.sticks[place][lane] = mode == 0;
        at->input[own_input(run, place)][lane] = -mode*own_bearings(run)[place].sliding;
#if SET_DAMPED_STRIPS               /* to the dynamics a contact that slips is one of a rigid wheel              */
        at->rigid[i][lane] = mode == 0 || !sticks[i];
        if (!sticks[i])
            at->input[own_input(run, place)][lane] = 0;
#endif
    }
    (void)sticks;
}
#endif

/* Whether a vehicle stands on these contacts: on three or more that do not lie on one line. */
static int stands(const omniroll_run_t *run, const int *carries)
{
    const double *const places = run->ground.places;
    double middle[2] = {0, 0}, moments[3] = {0, 0, 0}, length = 0, width = 0;
    int count = 0;
    for (int i = 0; i < run->wheels; i++)
        for (int k = 0; k < 2 && carries[i]; k++)
            middle[k] += places[2*i + k], count += k;
    if (count < 3)
        return 0;
    for (int i = 0; i < run->wheels; i++) {
        const double x = places[2*i] - middle[0]/count, y = places[2*i + 1] - middle[1]/count;
        if (carries[i])
            moments[0] += x*x, moments[1] += x*y, moments[2] += y*y;
    }
    const double angle = atan2(2*moments[1], moments[0] - moments[2])/2, cosine = cos(angle), sine = sin(angle);
    for (int i = 0; i < run->wheels; i++) {
        const double x = places[2*i] - middle[0]/count, y = places[2*i + 1] - middle[1]/count;
        if (carries[i])
            length += (cosine*x + sine*y)*(cosine*x + sine*y), width += (cosine*y - sine*x)*(cosine*y - sine*x);
    }
    return sqrt(width) > STANDING*sqrt(length);
}

/* The loads of up to LANES sets at this instant, where those of them stick that `holds` says; of bearings those that
 * each set has. With one of `rounds` friction beside bearings is linear about the last loads, with none theirs. */
static void evaluate_sets(const omniroll_run_t *run, const work_t *work, const int *holds, carrying_t *sets, int count,
                          int rounds)
{
    const int wheels = run->wheels;
    instant_t now;
#if SET_GRIPS
    lanes_t *const nu_dot = work->nu_dot;
#else
    lanes_t nu_dot[3];
#endif
    at_this_instant(run, work, wheels, &now);
#if SET_GRIPS
    lanes_t unit[2*MOST_WHEELS];
    int responds = 0;
    for (int i = 0; i < wheels; i++)
        responds |= !holds[i];
#if SET_CORNERS
    if (responds)
        forces_in_sets(run, work, sets, count, unit);
#else
    if (responds)
        forces_along(run, work, unit);
#endif
    responds = 0;
#endif
#if SET_LOADED_BEARINGS
    for (int lane = 0; lane < LANES; lane++)
        put_bearings_of_set(run, work, sets[lane < count ? lane : 0].carries, &sets[lane < count ? lane : 0].bearings,
                            lane, now.arrays.input);
#endif
    for (int lane = 0; lane < LANES; lane++)
        for (int i = 0; i < wheels; i++) {
            const int carries = sets[lane < count ? lane : 0].carries[i];
            now.arrays.input[SET_CARRIES_INPUT*wheels + i][lane] = carries;
#if SET_GRIPS
            now.arrays.input[SET_MODES_INPUT*wheels + i][lane] = carries && holds[i];
            responds |= carries && !holds[i];
            for (int k = 0; k < 2; k++)
                now.arrays.ground_push[2*i + k][lane] = carries && !holds[i] ? unit[2*i + k][lane] : 0;
#endif
        }
#if SET_GRIPS
    now.point.loads->responds = responds;
#endif
#if SET_STANDS
    vector3_t rows[WAYS*MOST_WHEELS];
    rows_in_ways(run, work, rows);
    for (int lane = 0; lane < LANES; lane++) {
        const carrying_t *const set = sets + (lane < count ? lane : 0);
        int sticks[MOST_WHEELS];
        for (int i = 0; i < wheels; i++)
            sticks[i] = set->carries[i] && holds[i];
        stand_in_lane(run, work, (const vector3_t *)rows, sticks, set->mode, lane, &now);
#if SET_CORNERS
        turn_in_lane(run, work, set, sticks, lane, &now.arrays);
#endif
    }
#endif
#if SET_NEARLY_LINEAR
    now.point.loads->rounds = rounds;
#endif
    core_rates(wheels, &now.point, nu_dot);
#if SET_LOADED_IN_SERIES
    own_rates_there(run, work, &now);
#endif
    for (int lane = 0; lane < count; lane++) {
        for (int i = 0; i < wheels; i++)
            sets[lane].compression[i] = now.point.loads->compression[i][lane];
        for (int k = 0; k < 3; k++)
            sets[lane].sums[k] = now.point.loads->sums[k][lane];
        sets[lane].determinant = now.point.loads->determinant[lane];
#if SET_LOADED_BEARINGS
        get_bearings_of_set(run, work, sets[lane].carries, &sets[lane].bearings, lane);
#endif
#if SET_GRIPS
        for (int k = 0; k < 2*wheels; k++)
            sets[lane].ground_force[k] = work->ground_force[k][lane];
#endif
    }
    (void)holds, (void)rounds;
}

/* The same, with the bearings at rest of each set in their modes. `elsewhere`: from those that they have under the last
 * loads on. */
static void try_sets(const omniroll_run_t *run, const work_t *work, const int *holds, carrying_t *sets, int count,
                     int elsewhere)
{
    int turned = 0, rounds = MOST_ROUNDS;
#if SET_CORNERS
    if (work->under_loads->knows_loads)
        rounds = ROUNDS_FROM_HERE;
#endif
#if SET_LOADED_BEARINGS
    for (int k = 0; k < count; k++) {
        give_bearings(run, work, k, &sets[k].bearings);
        begin_bearings_of_set(run, &sets[k].bearings);
    }
#endif
#if SET_STANDS
    for (int k = 0; k < count; k++)
        for (int i = 0; i < ON_GROUND*run->wheels; i++)
            sets[k].mode[i] = own_bearings(run)[i].mode;
#endif
#if SET_NEARLY_LINEAR && !SET_GRIPS
    if (elsewhere)
        evaluate_sets(run, work, holds, sets, count, GIVEN_LOADS);
    for (int k = 0; k < count && elsewhere; k++)
        turn_bearings_of_set(run, &sets[k].bearings);
#endif
    do {
        evaluate_sets(run, work, holds, sets, count, rounds);
#if SET_LOADED_BEARINGS
        turned = 0;
        for (int k = 0; k < count; k++)
            turned |= turn_bearings_of_set(run, &sets[k].bearings);
#endif
    } while (turned);
    (void)elsewhere;
}

/* Whether the mode of a contact is not its own in this set. What comes back begins with no load: if its friction takes
 * the load away again, neither mode is its own. Where the others' loads act on a line a contact that is off has none
 * either way, and stays off. */
static int is_wrong(const omniroll_run_t *run, const carrying_t *set, int i)
{
    const omniroll_grip_t *const grip = run->grips + i;
    const double pull = set->carries[i] ? -set->compression[i] : set->compression[i];
    const int comes_back = set->carries[i] && !grip->carries;
    return !(pull <= (grip->regained ? AT_EVENT : comes_back ? -FITS : FITS)*run->ground.weight) && !grip->dropped;
}

/* How many contacts change their mode with this set. */
static int changes_of(const omniroll_run_t *run, const carrying_t *set)
{
    int count = 0;
    for (int i = 0; i < run->wheels; i++)
        count += set->carries[i] != run->grips[i].carries;
    return count;
}

static int differ(const omniroll_run_t *run, const carrying_t *one, const carrying_t *other)
{
    double most = 0;
    for (int i = 0; i < run->wheels; i++)
        most = fmax(most, fabs(one->carries[i]*one->compression[i] - other->carries[i]*other->compression[i]));
    return most > SAME*run->ground.weight;
}

/* Copies a set; each has its own bearings. */
static void copy_set(const omniroll_run_t *run, const carrying_t *from, carrying_t *to)
{
#if SET_LOADED_BEARINGS
    bearings_of_set_t own = to->bearings;
    copy_bearings(run, &from->bearings, &own);
#endif
    *to = *from;
#if SET_LOADED_BEARINGS
    to->bearings = own;
#endif
    (void)run;
}

static void consider(const omniroll_run_t *run, search_t *search, const carrying_t *set)
{
    if (!search->tried++)
        search->first = *set, search->regular = 1;
    search->regular &= set->determinant > DETERMINED;
#if SET_LOADED_BEARINGS
    search->regular &= !set->bearings.unsettled;
    if (set->bearings.unsettled)
        return;
#endif
    for (int i = 0; i < run->wheels; i++)
        if (is_wrong(run, set, i))
            return;
    if (!search->fits++) {
        search->fit = *set;
        copy_set(run, set, &search->nearest);
        search->least_determinant = set->determinant;
        return;
    }
    search->least_determinant = fmin(search->least_determinant, set->determinant);
    if (!search->several && differ(run, set, &search->fit))
        search->several = 1, search->other = *set;
    if (changes_of(run, set) < changes_of(run, &search->nearest))
        copy_set(run, set, &search->nearest);
}

/* All sets that have what comes back and do not have what is dropped. */
static void try_all(const omniroll_run_t *run, const work_t *work, const int *holds, search_t *search)
{
    carrying_t sets[LANES];
    const int wheels = run->wheels, last = wheels > 3 ? (1 << wheels) - 1 : 0;      /* three carry, or it tips */
    int count = 0;
    for (int choice = 0; choice <= last; choice++) {
        int allowed = 1;
        for (int i = 0; i < wheels; i++) {
            const int carries = sets[count].carries[i] = !(choice >> (wheels - 1 - i) & 1);
            allowed &= carries ? !run->grips[i].dropped : !run->grips[i].regained;
        }
        count += allowed && (!last || stands(run, sets[count].carries));    /* on three, if all carry */
        if (count == LANES || (choice == last && count)) {
            try_sets(run, work, holds, sets, count, search->elsewhere);
            for (int k = 0; k < count; k++)
                consider(run, search, &sets[k]);
            count = 0;
        }
    }
}

/* From the present set on, whoever is wrong changes. */
static void try_leading_on(const omniroll_run_t *run, const work_t *work, const int *holds, search_t *search)
{
    carrying_t set;
    int wrong = 1;
    for (int i = 0; i < run->wheels; i++)
        set.carries[i] = (run->grips[i].carries || run->grips[i].regained) && !run->grips[i].dropped;
    for (int round = 0; round < 4*run->wheels && wrong && stands(run, set.carries); round++) {
        try_sets(run, work, holds, &set, 1, search->elsewhere);
        consider(run, search, &set);
        wrong = 0;
        for (int i = 0; i < run->wheels; i++)
            if (is_wrong(run, &set, i))
                wrong = 1, set.carries[i] = !set.carries[i];
    }
}

/* The loads of the present set. */
static void try_present_set(const omniroll_run_t *run, const work_t *work, carrying_t *set)
{
    int holds[MOST_WHEELS];
    for (int i = 0; i < run->wheels; i++)
        set->carries[i] = run->grips[i].carries, holds[i] = run->grips[i].sticks;
    try_sets(run, work, holds, set, 1, 0);
}

#if SET_LOADED_BEARINGS && SET_FRICTION
/* In the set that fits with the fewest changes the coupled matrix must have a positive determinant whichever of the
 * bearings at rest turn that touch the ground (rule 3 of loaded_axles.py; rule 4 of loaded_massless_rollers.py). */
static void look_at_bearings(omniroll_run_t *run, const work_t *work, const int *holds, search_t *search)
{
    int resting[2*MOST_WHEELS], tried = 0;
    const int count = may_turn_on_ground(run, &search->nearest.bearings, search->nearest.carries, resting);
    carrying_t sets[LANES];
#if SET_NEARLY_LINEAR
    memcpy(run->ground.sums, search->nearest.sums, sizeof run->ground.sums);     /* about these loads           */
#endif
    for (int choice = 0; count <= MOST && choice < 1 << count; choice++) {
        carrying_t *const set = sets + tried;
        give_bearings(run, work, tried++, &set->bearings);
        copy_set(run, &search->nearest, set);
        for (int k = 0; k < count; k++)
            set->bearings.mode[resting[k]] = (choice >> k & 1)*way_of_bearing(&search->nearest.bearings, resting[k]);
        if (tried < LANES && choice + 1 < 1 << count)
            continue;
        evaluate_sets(run, work, holds, sets, tried, 1);
        for (; tried > 0; tried--)
            if (sets[tried - 1].determinant < search->least_determinant)
                search->fit = sets[tried - 1], search->least_determinant = search->fit.determinant;
    }
}
#endif

#if SET_GRIPS || SET_NEARLY_LINEAR
/* Where loads are looked for elsewhere: on the way from the middle of the contacts to which of them a start is, with so
 * many on each; returns the part of the way. */
ALWAYS_INLINE double way_of_start(const omniroll_run_t *run, int start, int starts, int *contact)
{
    *contact = start%run->wheels;
    return (start/run->wheels + 1.0)/(starts + 1);
}

ALWAYS_INLINE void put_middle(const omniroll_run_t *run, double *middle)
{
    middle[0] = middle[1] = 0;
    for (int k = 0; k < 2*run->wheels; k++)
        middle[k%2] += run->ground.places[k]/run->wheels;
}

/* Whether a line from one contact `along` to another is an edge of their polygon: all are to its left. */
static int is_edge(const omniroll_run_t *run, const double *from, const double *along)
{
    const double *const places = run->ground.places;
    double least = 0, most = 0;
    for (int i = 0; i < run->wheels; i++) {
        const double beside = along[0]*(places[2*i + 1] - from[1]) - along[1]*(places[2*i] - from[0]);
        least = fmin(least, beside), most = fmax(most, fabs(beside));
    }
    return most > 0 && least >= -ON_EDGE*most;
}

/* Whether the loads that have failed act inside the polygon of all contacts: further from its edges than rounding. */
static int acts_inside(const omniroll_run_t *run)
{
    const omniroll_ground_t *const ground = &run->ground;
    const double at[2] = {ground->failed_sums[1]/ground->weight, ground->failed_sums[2]/ground->weight};
    double size = 0;
    for (int k = 0; k < 2*run->wheels; k++)
        size = fmax(size, fabs(ground->places[k]));
    for (int i = 0; i < run->wheels; i++)
        for (int j = 0; j < run->wheels; j++) {
            const double *const from = ground->places + 2*i, *const to = ground->places + 2*j;
            const double along[2] = {to[0] - from[0], to[1] - from[1]}, length = hypot(along[0], along[1]);
            if (is_edge(run, from, along)
                && !(along[0]*(at[1] - from[1]) - along[1]*(at[0] - from[0]) > ON_EDGE*size*length))
                return 0;
        }
    return 1;
}
#endif

#if SET_NEARLY_LINEAR && !SET_GRIPS
/* Where friction goes with loads in no proportion Newton's rule may miss those that fit: it begins elsewhere, on the
 * ways from the middle to the contacts. What is told if none fit is what was tried first. */
static void try_elsewhere(omniroll_run_t *run, const work_t *work, const int *holds, search_t *search)
{
    double *const sums = run->ground.sums, kept[3] = {sums[0], sums[1], sums[2]}, middle[2];
    const int regular = search->regular;
    int contact;
    search->elsewhere = 1;
    put_middle(run, middle);
    for (int start = 0; start < ELSEWHERE*run->wheels && !search->fits; start++) {
        const double part = way_of_start(run, start, ELSEWHERE, &contact);
        sums[0] = run->ground.weight;
        for (int k = 0; k < 2; k++)
            sums[1 + k] = sums[0]*((1 - part)*middle[k] + part*run->ground.places[2*contact + k]);
        if (run->wheels <= MOST)
            try_all(run, work, holds, search);
        else
            try_leading_on(run, work, holds, search);
    }
    memcpy(sums, kept, sizeof kept);
    search->regular = regular;
}

/* Whether the vehicle tips by what was tried first, where nothing fits. */
static int tips_by_first(omniroll_run_t *run, const search_t *search)
{
    memcpy(run->ground.failed_sums, search->first.sums, sizeof search->first.sums);
    return search->regular && !acts_inside(run);
}
#endif

/* Loads and motion do not go on together. */
static void fail(omniroll_run_t *run, int failure, const carrying_t *found)
{
    omniroll_ground_t *const ground = &run->ground;
    ground->failure = failure;
    ground->failed_determinant = found->determinant;
    for (int k = 0; k < 3; k++)
        ground->failed_sums[k] = found->sums[k];
    for (int i = 0; i < run->wheels; i++)
        run->grips[i].load = found->compression[i];
}

/* Forces and loads of a set, where an evaluation at this instant leaves them. */
static void leave_forces(const omniroll_run_t *run, const work_t *work, const carrying_t *set)
{
#if SET_GRIPS
    for (int i = 0; i < run->wheels; i++) {
        work->loads[LOADS_NOW].compression[i] = lanes_of(set->compression[i]);
        for (int k = 2*i; k < 2*i + 2; k++)
            work->ground_force[k] = lanes_of(set->ground_force[k]);
    }
#endif
    (void)run, (void)work, (void)set;
}

/* Whether a contact has gone off at this instant whose spring is compressed then, and not just at its bound: it cannot
 * carry, and it cannot stay off. */
static int comes_back_at_once(const omniroll_run_t *run, const carrying_t *set)
{
    int found = 0;
    for (int i = 0; i < run->wheels; i++)
        found |= run->grips[i].dropped && !set->carries[i] && set->compression[i] > AT_EVENT*run->ground.weight;
    return found;
}

/* The contacts that carry from now on, and their loads, where those of them stick that `holds` says. */
static void decide_loads(omniroll_run_t *run, const work_t *work, const int *holds)
{
    search_t search;
    search.tried = search.fits = search.several = search.elsewhere = 0;
    search.regular = 1, search.least_determinant = 1;
    run->ground.failure = 0;
#if SET_LOADED_BEARINGS
    give_bearings(run, work, LANES, &search.nearest.bearings);
#endif
    if (run->wheels <= MOST)
        try_all(run, work, holds, &search);
    else
        try_leading_on(run, work, holds, &search);
    run->ground.failure_is_regular = search.regular;
#if SET_NEARLY_LINEAR && !SET_GRIPS
    if (!search.fits && search.tried && !tips_by_first(run, &search))
        try_elsewhere(run, work, holds, &search);
#endif
#if SET_LOADED_BEARINGS && SET_FRICTION
    if (search.fits)
        look_at_bearings(run, work, holds, &search);
#endif
    if (!search.tried)                          /* the vehicle does not stand on those that are left       */
        try_present_set(run, work, &search.first);
    if (!search.fits || (SET_LOADED_IN_SERIES && comes_back_at_once(run, &search.nearest)))
        fail(run, OMNIROLL_LOADS_NONE, &search.first);
    else if (search.several)
        fail(run, OMNIROLL_LOADS_SEVERAL, &search.other);
    else if (SET_FRICTION && !(search.least_determinant > DETERMINED))
        fail(run, OMNIROLL_LOADS_UNDETERMINED, &search.fit);
    for (int i = 0; i < run->wheels && !run->ground.failure; i++) {
        omniroll_grip_t *const grip = run->grips + i;
        grip->carries = search.nearest.carries[i];
        grip->load = grip->carries ? fmax(search.nearest.compression[i], LEAST_LOAD*run->ground.weight) : 0;
    }
    if (!run->ground.failure) {
        memcpy(run->ground.sums, search.nearest.sums, sizeof run->ground.sums);
#if SET_LOADED_BEARINGS
        take_bearings_of_set(run, &search.nearest.bearings);
#endif
        leave_forces(run, work, &search.nearest);
#if SET_GRIPS
        run->ground.knows_rates = search.tried == 1;
#endif
    }
    put_carrying(run);
}

#if !SET_GRIPS
/* Which contacts carry under a law with which nothing sticks. */
static void decide_carrying(omniroll_run_t *run, const work_t *work)
{
#ifdef LANES_HAS_MOMENTA
    wheel_momenta(run, work);
#endif
#if SET_LOADED_BEARINGS
    rest_bearings(run, work);
#endif
    decide_loads(run, work, 0);
#if SET_LOADED_BEARINGS
    begin_loaded_bearings(run, work);
#endif
    run->ground.undecided = run->ground.failure != 0;
}
#endif

/* ---- during a step -------------------------------------------------------------------------------------------- */

static void begin_loads(const omniroll_run_t *run, const work_t *work, step_t *s, const int wheels)
{
    s->balance = &work->balance, s->weight_carried = run->ground.weight;
    s->loads_at = work->loads + LOADS_AT_NODES, s->loads_at_end = work->loads + LOADS_AT_END;
    s->loads_aside = work->loads + LOADS_ASIDE;
    for (int i = 0; i < wheels; i++)
        s->carries[i] = run->grips[i].carries;
}

/* How far a load is from the end of its mode, negative before it; the last one is how far the coupled matrix is from one
 * that determines nothing. */
ALWAYS_INLINE double load_beyond(const step_t *s, int k, double compressed)
{
    if (k == s->wheels)
        return DETERMINED - compressed;
    return s->carries[k] ? -compressed : compressed;
}

ALWAYS_INLINE double load_way(const step_t *s, int k)
{
    return k == s->wheels || s->carries[k] ? -1 : 1;
}

/* The first guess of a step, at whose start the rates have just been found. */
static void loads_at_start(const work_t *work, step_t *s, const int wheels)
{
    const loads_t *const now = work->loads + LOADS_NOW;
    const double sums[3] = {now->sums[0][0], now->sums[1][0], now->sums[2][0]};
    for (int b = 0; b < BLOCKS; b++) {
        seek_loads(s->loads_at + b, sums);
#if SET_NEARLY_LINEAR
        s->loads_at[b].rounds = 1;              /* sweeps go on with it                                          */
#endif
#if SET_GRIPS
        s->loads_at[b].responds = s->sliding;
#if SET_DAMPED_STRIPS               /* rollers that turn feel them in the first sweep                          */
        memcpy(s->loads_at[b].compression, now->compression, sizeof now->compression);
#endif
#endif
    }
    for (int k = 0; k <= wheels; k++) {
        s->compressed_start[k] = k < wheels ? now->compression[k][0]/s->weight_carried : now->determinant[0];
        s->compressed_late[k] = 0;
    }
}

/* The loads at the nodes in vector b, from the last evaluation there. */
ALWAYS_INLINE void keep_loads(step_t *s, const int wheels, int b)
{
    const loads_t *const loads = s->loads_at + b;
    for (int i = 0; i < wheels; i++)
        s->compressed[i].lanes[b] = loads->compression[i]/s->weight_carried;
    s->compressed[wheels].lanes[b] = loads->determinant;
}

/* How far a load is from the end of its mode at the step's end, and the rate of that. */
ALWAYS_INLINE double load_at_end(const step_t *s, int k, double *rate)
{
    const double value = load_beyond(s, k, weighted(&s->compressed[k], &gauss_end) + s->compressed_late[k]);
    *rate = load_way(s, k)*weighted(&s->compressed[k], &gauss_end_slope)/s->h;
    if (fabs(*rate)*s->h < LOAD_RISES*LOAD_ROUNDING)
        *rate = (value - load_beyond(s, k, s->compressed_start[k]))/s->h;
    if (fabs(*rate)*s->h < 0.5*LOAD_ROUNDING)               /* it is as it was                            */
        *rate = 0;
    return value;
}

/* The number by which a landing says that a load has ended the step: that of the first one. */
ALWAYS_INLINE int first_load(const step_t *s)
{
#if SET_LOADED_BEARINGS
    return s->wheels + s->guards + s->own_count;
#else
    return s->wheels + s->guards + (SET_GRIPS ? s->wheels : 0);
#endif
}

/* The length at which the first load changes its mode, if that is before `length`. */
static double length_to_load(step_t *s, const int wheels, double length)
{
    for (int k = 0; k <= wheels && !is_blind(s); k++) {
        double rate;
        const double value = load_at_end(s, k, &rate);
        if (!(rate > 0 || value > LOAD_ROUNDING))
            continue;
        const double reached = rate > 0 ? s->h - value/rate : s->h/2;
        if (reached < length) {
            length = reached;
            s->landing = first_load(s) + k;
        }
    }
    return length;
}

/* A load that changes its mode inside the step and not at its end: where, or 1. */
static double turn_of_loads(const step_t *s, const int wheels)
{
    double turned = 1;
    for (int k = 0; k <= wheels; k++) {
        double least, most;
        bounds_of(&s->compressed[k], &least, &most);
        if (load_beyond(s, k, least) <= 0 && load_beyond(s, k, most) <= 0)
            continue;
        const double way = load_way(s, k), start = load_beyond(s, k, s->compressed_start[k]);
        nodes_t rate = times(gauss_slope, &s->compressed[k]);
        for (int b = 0; b < BLOCKS; b++)
            rate.lanes[b] *= way;
        turned = fmin(turned, turn_beyond(&rate, way*weighted(&s->compressed[k], &gauss_end_slope), 1, start, -INFINITY,
                                          fmax(LOAD_TURNS*LOAD_ROUNDING, start + LOAD_TURNS*LOAD_ROUNDING)));
    }
    return turned;
}

/* Whether the mode of a load ends at the end of a step that ends where a load's does. */
static int ends_load(const step_t *s, int k)
{
    double rate;
    const double value = load_at_end(s, k, &rate);
    return s->landing == first_load(s) + k || (rate > 0 && value > -LOAD_ROUNDING);
}

/* Over the weight, of a contact that carries. */
ALWAYS_INLINE double load_at_end_of_step(const step_t *s, int k)
{
    return larger(LEAST_LOAD, weighted(&s->compressed[k], &gauss_end));
}

/* A step has been taken. */
static void loads_have_moved(omniroll_run_t *run, const step_t *s)
{
    const int wheels = run->wheels;
    for (int k = 0; k < 3; k++) {
        nodes_t sums;
        for (int b = 0; b < BLOCKS; b++)
            sums.lanes[b] = s->loads_at[b].sums[k];
        run->ground.sums[k] = weighted(&sums, &gauss_end);
    }
    for (int k = 0; k <= wheels; k++) {
        const int ends = s->landing >= first_load(s) && ends_load(s, k);
        run->ground.passed += ends;
        run->ground.undecided |= ends;
        if (k == wheels)
            break;
        omniroll_grip_t *const grip = run->grips + k;
        grip->dropped = ends && grip->carries, grip->regained = ends && !grip->carries;
        if (grip->carries)
            grip->load = load_at_end_of_step(s, k)*run->ground.weight;
    }
}
#endif

/* Whether loads and motion do not go on together. */
ALWAYS_INLINE int ground_fails(const omniroll_run_t *run)
{
    return SET_LOADS && run->ground.failure;
}
