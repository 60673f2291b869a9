/* Wheels that stand on their joint on a ground where they may slip (maxima/effects/contact_joints.mac).
 *
 * A wheel that both rollers push back swings over its joint, faster and faster with ever smaller swings. It stands from the
 * turn of a swing on that is small: there its rate is zero, so that no momentum is lost, and a swing has no force on the
 * vehicle that standing has not, but for what goes with the square of its speed. It goes on where one of the rollers has all
 * of the load. */

#define SWING 1e-3                  /* of pi/n: a swing that is small                                          */
#define SLOW_SWING 0.02             /* of the rates apart at which the rollers would turn the wheel            */
#define CREEP 1e-3                  /* of what two rollers slip apart: friction fades there (contact_joints.mac) */
#define SLOW_CREEP 1e-4             /* of the rates apart: as slow as what a roller that sticks leaves         */
#define PRELOADS 12                 /* creeps of each sign that are tried, each twice the one before, around CREEP */
#define AT_TURN 1e-12               /* of the fastest wheel's rate: the rounding of another's where its swing turns */
#define SHARE_NOISE 64              /* roundings of a part of a load                                           */
#define SHARE_ENDS 1e-10            /* of a load: parts that end together                                      */

/* The bound of a load's part that a guard is, for step.h. */
static int bound_of_share(const omniroll_run_t *run, int guard)
{
    const int by = guard < all_guards(run) - run->acts.pivot_guards ? NOTHING : (int)run->acts.leads_to[2*guard];
    const int wheel = (int)run->acts.leads_to[2*guard + 1];
    return by == TO_HERE ? -(wheel + 1) : by == TO_NEXT ? wheel + 1 : 0;
}

/* A step has been accepted: whether it has landed on a guard of a wheel at its joint. */
static void joints_have_moved(omniroll_run_t *run, const step_t *s)
{
    const int guard = s->event.landing - s->wheels, first = s->event.guards - run->acts.pivot_guards;
    run->past.landed_by = guard >= first && guard < s->event.guards ? (int)run->acts.leads_to[2*guard] : NOTHING;
    run->past.landed_wheel = run->past.landed_by != NOTHING ? (int)run->acts.leads_to[2*guard + 1] : 0;
    for (int i = 0; i < run->wheels; i++)
        if (pivots(run, i))
            run->state.core[rates_at(run->wheels) + i] = 0;  /* sweeps leave roundings of it               */
}

/* Whether a part of a load has just come to its bound: that on which the last step has landed, and what ends with it. */
static int share_has_ended(const omniroll_run_t *run, int guard)
{
    const int bound = bound_of_share(run, guard);
    if (!bound || (run->past.landed_by != TO_HERE && run->past.landed_by != TO_NEXT))
        return 0;
    const long long *const leads_to = run->acts.leads_to + 2*guard;
    return (leads_to[0] == run->past.landed_by && leads_to[1] == run->past.landed_wheel)
        || run->acts.guards[guard_size(run->wheels)*guard] > -SHARE_ENDS;
}

static int is_near_joint(const omniroll_run_t *run, int i)
{
    return fabs(run->state.chi[i]) >= (1 - SWING)*run->joint[i];
}

/* Whether a wheel has just passed its joint, and may be about to come back. */
static int swings(const omniroll_run_t *run, int i)
{
    const double *const rates = run->state.core + rates_at(run->wheels);
    double fastest = 0;
    for (int k = 0; k < run->wheels; k++)
        fastest = fmax(fastest, fabs(rates[k]));
    return !pivots(run, i) && is_near_joint(run, i)
        && copysign(rates[i], run->state.chi[i]*rates[i]) < -AT_TURN*fastest;
}

/* The guards of wheels that swing, and of those that stand. */
static void guard_swings(omniroll_run_t *run, const work_t *work)
{
    lanes_t nu_dot[3];
    int count = 0;
    run->acts.pivot_guards = 0;
    for (int i = 0; i < run->wheels; i++)
        count += pivots(run, i);
    if (count)
        rates_at_this_instant(run, work, run->wheels, nu_dot);
    for (int i = 0; i < run->wheels; i++) {
        const double outward = run->state.chi[i] < 0 ? -1 : 1;
        if (swings(run, i))
            add_pivot_guard(run, BY_TURN, i)[6 + i] = outward;
        for (int next = 0; pivots(run, i) && next < 2; next++) {
            const double share = work->next_share[i][0];
            double *const guard = add_pivot_guard(run, TO_HERE + next, i);
            guard[0] = next ? share - 1 : -share, guard[5] = SHARE_NOISE;
        }
    }
}

/* How much faster one of the rollers at a wheel's joint would turn it than the other. */
static double rates_apart(const omniroll_run_t *run, const work_t *work, int i)
{
    double rows[2][3*MAX_WHEELS];
    rows_of_both(run, work, rows[0], rows[1]);
    return fabs(rate_by(rows[1] + 3*i, run->state.nu) - rate_by(rows[0] + 3*i, run->state.nu));
}

/* The part of its load that the next roller has of a wheel if it stands on its joint: between 0 and 1 it stays there. */
static double share_on_joint(omniroll_run_t *run, const work_t *work, int i)
{
    double *const rate = run->state.core + rates_at(run->wheels) + i, rate_before = *rate;
    double *const next = run->state.core + next_speeds_at(run->wheels) + i, next_before = *next;
    double *const mode = SET_GRIPS ? run->acts.inputs + SET_MODES_INPUT*run->wheels + i : 0;
    const double mode_before = SET_GRIPS ? *mode : 0, chi_before = run->state.chi[i];
    lanes_t nu_dot[3];
    run->state.contact[i] += run->rollers_per_wheel;
    run->state.chi[i] = copysign(run->joint[i], run->state.chi[i]), *rate = 0;
    if (SET_NEXT_SPEEDS)
        *next = *next_roller(run, i);
    if (SET_GRIPS)
        *mode = 0;
    carry_rows(run, work);
    run->ground.knows_rates = 0;
    rates_at_this_instant(run, work, run->wheels, nu_dot);
    const double share = work->next_share[i][0];
    run->state.contact[i] -= run->rollers_per_wheel;
    run->state.chi[i] = chi_before, *rate = rate_before;
    if (SET_NEXT_SPEEDS)
        *next = next_before;
    if (SET_GRIPS)
        *mode = mode_before;
    carry_rows(run, work);
    return share;
}

/* Whether a wheel stays on its joint with this part. */
ALWAYS_INLINE int stays_with(double share)
{
    return share > 0 && share < 1;
}

/* Under Coulomb's law a roller that has rolled takes any force up to its friction: the least creep that would hold the wheel on
 * its joint, from which its creep is counted then. Returns whether there is one. */
static int find_preload(omniroll_run_t *run, const work_t *work, int i)
{
    double *const preload = SET_GRIPS ? run->acts.inputs + SET_HEADINGS_INPUT*run->wheels + i : 0;
    const double heading = *preload, creep = CREEP*run->ground.arms[2]*rates_apart(run, work, i);
    for (int tried = 0; tried < 2*PRELOADS; tried++) {
        *preload = tried ? (tried % 2 ? 1 : -1)*creep*exp2(tried/2 - PRELOADS/2) : 0;
        if (stays_with(share_on_joint(run, work, i)))
            return 1;
    }
    *preload = heading;
    return 0;
}

/* Whether a swing is small that turns here. Friction that grows with the slip also varies in it, unless its speed is small
 * beside those at which the rollers would turn the wheel; Coulomb's does not. */
static int swing_is_small(const omniroll_run_t *run, const work_t *work, int i)
{
    lanes_t chi_ddot[MAX_WHEELS];
    const double slow = SLOW_SWING*rates_apart(run, work, i);
    if (!is_near_joint(run, i) || SET_GRIPS)
        return is_near_joint(run, i);
    wheel_accelerations(run, work, chi_ddot);
    return 2*fabs(chi_ddot[i][0])*(run->joint[i] - fabs(run->state.chi[i])) <= slow*slow;
}

/* Whether a wheel stays on its joint whose swing turns. */
static int stays_on_joint(omniroll_run_t *run, const work_t *work, int i)
{
    if (!swing_is_small(run, work, i))
        return 0;
    return SET_GRIPS ? find_preload(run, work, i) : stays_with(share_on_joint(run, work, i));
}

/* A wheel that hardly moves is about to pass on: it stops, or one of the rollers has all of its load and takes it along. */
static void settle_at_joint(omniroll_run_t *run, const work_t *work, int i, int *directions, int *stance)
{
    if (SET_GRIPS && find_preload(run, work, i)) {
        stance[i] = STOPS, directions[i] = 0;
        return;
    }
    const double share = share_on_joint(run, work, i);
    if (!isfinite(share))
        return;
    stance[i] = stays_with(share) ? STOPS : CREEPS;
    if (share < 1)
        directions[i] = 0;
}

/* Contacts of wheels that have gone on rest where they creep: what is slip there is rest of rollers that would stick. */
static void rest_where_they_creep(omniroll_run_t *run, const work_t *work, const int *stance)
{
    double slip[2*MAX_WHEELS];
    for (int i = 0; i < run->wheels; i++) {
        if (stance[i] != GOES && stance[i] != CREEPS)
            continue;
        slips_now(run, work, slip);
        if (length_of(slip + 2*i, 2) <= CREEP*run->ground.arms[2]*rates_apart(run, work, i))
            run->ground.grips[i].resting = 1;
    }
}

/* Whether a wheel at its joint hardly moves: by less than the rounding of its angle before it would turn, or so slowly as one
 * that rolls on a roller which creeps beside another one. */
static int hardly_moves(const omniroll_run_t *run, const work_t *work, int i)
{
    lanes_t chi_ddot[MAX_WHEELS];
    const double rate = run->state.core[rates_at(run->wheels) + i];
    if (SET_GRIPS && run->ground.grips[i].sticks && fabs(rate) <= SLOW_CREEP*rates_apart(run, work, i))
        return 1;
    wheel_accelerations(run, work, chi_ddot);
    return rate*rate < 2*EPS*run->joint[i]*fabs(chi_ddot[i][0]);
}

/* Wheels that stop at their joint, which then do not pass on, and wheels that go on from there. Returns how many do. */
static int swings_change(omniroll_run_t *run, const work_t *work, int *directions, int *stance)
{
    int count = 0, some = run->past.landed_by != NOTHING;
    for (int i = 0; i < run->wheels; i++) {
        stance[i] = STAYS;
        some |= directions[i] || pivots(run, i) || swings(run, i);
    }
    run->acts.pivot_guards = 0;
    if (!some)
        return 0;
    for (int i = 0; i < run->wheels; i++)
        if (directions[i] && hardly_moves(run, work, i))
            settle_at_joint(run, work, i, directions, stance);
    guard_swings(run, work);
    guards_passed(run, work);
    count += go_on_from_joints(run, directions, stance);
    const int landed = run->past.landed_wheel;
    if (run->past.landed_by == BY_TURN && !directions[landed] && stays_on_joint(run, work, landed))
        stance[landed] = STOPS, count++;
    run->past.landed_by = NOTHING;
    return count;
}

/* A switch: a wheel may stop on its joint, or go on from it. The next roller is one of those in contact meanwhile; the list of
 * free ones has it as of the last switch. */
static void stop_or_go(omniroll_run_t *run, int wheel, int stance)
{
    double *const next = run->state.core + next_speeds_at(run->wheels) + wheel;
    if (SET_NEXT_SPEEDS && pivots(run, wheel))
        *next_roller(run, wheel) = *next;
    if (stance == STOPS)
        run->state.core[rates_at(run->wheels) + wheel] = 0;
    if (SET_NEXT_SPEEDS && stance == STOPS)
        *next = *next_roller(run, wheel);
}

/* What happens at joints at this instant: wheels that pass on, and wheels that stop there or go on. Returns how many. */
static int changing_wheels(omniroll_run_t *run, const work_t *work, int *directions, int *stance)
{
    int count = switching_wheels(run, work, run->state.elapsed - run->past.phase_start, directions);
    if (SET_SHARES)
        count += swings_change(run, work, directions, stance);
    else if (SET_PIVOTS)
        count += pivots_change(run, work, directions, stance);
    return count;
}
