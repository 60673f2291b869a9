/* Contacts that stick on the ground or slip on it under Coulomb's friction: a mode for each. */
#define REMAINDER 0.1               /* of the way to rest: behind the first step whose direction turns      */
#define MIN_REMAINDER 0.02          /* the same behind later ones, at least                                  */
#define MAX_REMAINDER 0.2           /* and at most                                                           */
#define AIM 0.3                     /* of the error allowed: what a step towards rest is to miss             */
#define EASIEST_TURN 6              /* the power of its length with which a step misses less, at least       */
#define TURNS_AWAY 0.01             /* of the tolerance: what may remain of a slip whose direction has turned  */
#define STRAYS 2                    /* times that: it should have turned further; a slip is not at rest      */
#define RESIDUAL_OF_SWEEPS 16       /* times what sweeps leave of nu: from its direction a slip differs by no more,     */
#define SAME 1e-3                   /* or by this in rad,                                                      */
#define NO_OTHER 100                /* and so many times what is rounding of it, where it is slow           */
#define MUCH_LATER 2                /* times the time to the first rest                                     */
#define ROUNDING_OF_SPEED (1.0/16)  /* of the rounding of the largest speeds: what smaller ones are rounded by at least */

/* Loads and coefficients of the contacts, as kernels take them. */
static void friction_in_lanes(const omniroll_run_t *run, const work_t *work)
{
    for (int i = 0; i < run->wheels; i++) {
        work->load[i] = lanes_of(run->ground.grips[i].load);
        for (int k = 0; k < 2; k++)
            work->friction[2*i + k] = lanes_of(run->ground.grips[i].sliding[k]);
    }
}

/* The loads at this instant, where they follow from the motion, and which contacts carry one. */
static void find_loads(const omniroll_run_t *run, const work_t *work)
{
    if (!SET_LOADS_FOLLOW)
        return;
    lanes_t tilt[3], tilt_rate[3], presses[MAX_WHEELS], load[MAX_WHEELS], margin[MAX_WHEELS], rise[MAX_WHEELS];
    for (int k = 0; k < 3; k++) {
        tilt[k] = lanes_of(run->state.core[tilt_at(run->wheels) + k]);
        tilt_rate[k] = lanes_of(run->state.core[tilt_rates_at(run->wheels) + k]);
    }
    for (int i = 0; i < run->wheels; i++)
        presses[i] = lanes_of(run->acts.inputs[SET_PRESSES_INPUT*run->wheels + i]);
    set_support_state(run->wheels, &work->vehicle, tilt, tilt_rate, presses, load, margin, rise);
    for (int i = 0; i < run->wheels; i++) {
        omniroll_grip_t *const grip = run->ground.grips + i;
        grip->carries = presses[i][0] > 0.5;
        grip->load = grip->carries ? fmax(load[i][0], LEAST_LOAD*grip->at_rest) : 0;
        work->load[i] = lanes_of(grip->load);
    }
    (void)margin, (void)rise;
}

/* The slopes of the rates by heave and tilt at this instant, by differences; forces of contacts that slip go
 * along with their loads. */
static void find_tilt_slopes(const omniroll_run_t *run, const work_t *work, step_t *s)
{
    const int wheels = run->wheels, first_number = tilt_rates_at(wheels);
    s->sprung.h = 0;
    for (int first = 0; first < 6; first += LANES - 1) {
        instant_t now;
        lanes_t load[MAX_WHEELS], push[2*MAX_WHEELS], rates[6 + 2*MAX_WHEELS], *const nu_dot = rates + 3;
        at_this_instant(run, work, wheels, &now);
        for (int lane = 1; lane < LANES && first + lane - 1 < 6; lane++)
            work->core_here[first_number + first + lane - 1][lane] += TILT_MOVES;
        loads_in_state(s, wheels, now.point.core, load);
        forces_along(run, work, load, push);
        for (int k = 0; k < 2*wheels; k++)
            if (slides(run, k/2))
                now.arrays.ground_push[k] = push[k];
        core_rates_at(wheels, &now.point, nu_dot);
        memcpy(rates, work->core_dot + first_number, 3*sizeof *rates);
        memcpy(rates + 6, work->core_dot, sizeof *rates*(size_t)coupled_size(wheels));
        for (int lane = 1; lane < LANES && first + lane - 1 < 6; lane++)
            for (int j = 0; j < 6 + coupled_size(wheels); j++)
                s->sprung.slope[j][first + lane - 1] = (rates[j][lane] - rates[j][0])/TILT_MOVES;
    }
    for (int c = 0; c < work->core; c++)        /* the rates of the state itself in all lanes, for the guess     */
        work->core_dot[c] = lanes_of(work->core_dot[c][0]);
    s->sweeps += (6 + LANES - 2)/(LANES - 1)/BLOCKS;
}

/* The speeds that make a slip, in m/s. */
static double speeds_of_slip(const omniroll_run_t *run, int contact)
{
    const double *const arms = run->ground.arms, *const core = run->state.core;
    double sizes = arms[0]*(fabs(run->state.nu[0]) + fabs(run->state.nu[1])) + arms[1]*fabs(run->state.nu[2])
        + arms[2]*fabs(core[rates_at(run->wheels) + contact]);
    if (SET_HAS_CONTACT_SPEEDS)
        sizes += arms[3]*fabs(core[contact_speeds_at(run->wheels) + contact]);
    return sizes;
}

/* What slips are rounded against that these speeds make, in m/s: those within it are zero. Where wheels may stand, the
 * speeds are differences of larger ones, and have the residual of the iteration at the nodes in them. */
static double rounding_of_speeds(const omniroll_run_t *run, double speeds)
{
    if (may_stand(core_bearings(run), run->bearings.core_count)) {
        const double residual = run->task.sweep_tolerance*fmax(run->task.speed, run->past.fastest)*run->ground.arms[0];
        return fmax(residual, SLIP_AT_REST*EPS*fmax(speeds, ROUNDING_OF_SPEED*run->hold.speed));
    }
    return SLIP_AT_REST*EPS*speeds;
}

/* The same now. */
static double slip_rounding(const omniroll_run_t *run, int contact)
{
    return rounding_of_speeds(run, speeds_of_slip(run, contact));
}

/* The slip velocities at this instant. */
static void slips_now(const omniroll_run_t *run, const work_t *work, double *slip)
{
    instant_t now;
    lanes_t found[2*MAX_WHEELS];
    at_this_instant(run, work, run->wheels, &now);
    slips_of(run->wheels, &work->vehicle, now.point.nu, now.point.chi, now.point.core, found);
    for (int k = 0; k < 2*run->wheels; k++)
        slip[k] = found[k][0];
}

/* The speeds of wheels that roll, put where contacts rest, or with `sticking` where they stick. */
static void roll(omniroll_run_t *run, const work_t *work, int sticking)
{
    lanes_t nu[3], chi[MAX_WHEELS], speeds[MAX_WHEELS];
    state_in_lanes(run, nu, chi);
    rolling_wheels(run->wheels, &work->vehicle, nu, chi, speeds);
    for (int i = 0; i < run->wheels; i++)
        if (sticking ? run->ground.grips[i].sticks : run->ground.grips[i].resting)
            run->state.core[rates_at(run->wheels) + i] = speeds[i][0];
    if (SET_HAS_CONTACT_SPEEDS) {
        rolling_axial(run->wheels, &work->vehicle, nu, chi, core_in_lanes(run, work), speeds);
        for (int i = 0; i < run->wheels; i++)
            if (sticking ? run->ground.grips[i].sticks : run->ground.grips[i].resting)
                run->state.core[contact_speeds_at(run->wheels) + i] = speeds[i][0];
    }
}

/* Whether a direction is that of a slip (2,) within its rounding. */
static int goes_along(const double *slip, const double *direction, double rounding)
{
    return fabs(slip[1]*direction[0] - slip[0]*direction[1]) <= rounding
        && slip[0]*direction[0] + slip[1]*direction[1] > 0;
}

/* Contacts whose slip is zero within rounding rest; the others have its direction. */
static void find_resting_contacts(omniroll_run_t *run, const work_t *work)
{
    double slip[2*MAX_WHEELS] = {0};
    int all = 1;
    for (int i = 0; i < run->wheels; i++)
        all &= run->ground.grips[i].resting;
    if (!all)
        slips_now(run, work, slip);
    for (int i = 0; i < run->wheels; i++) {
        omniroll_grip_t *const grip = run->ground.grips + i;
        const double size = sqrt(slip[2*i]*slip[2*i] + slip[2*i + 1]*slip[2*i + 1]);
        grip->resting = grip->carries && !pivots(run, i) && (grip->resting || size <= slip_rounding(run, i));
        for (int k = 0; k < 2 && !grip->resting && !grip->keeps && size > 0; k++)
            grip->towards[k] = slip[2*i + k]/size;
        if (SET_FIRST_DIRECTION == 1)
            grip->towards[0] = 0;
    }
    if (!all)                                   /* else they have been put there                        */
        roll(run, work, 0);
}

/* How much of its static friction a contact takes at this instant, squared, less 1. */
static double excess_now(const omniroll_run_t *run, const work_t *work, int contact)
{
    const omniroll_grip_t *const grip = run->ground.grips + contact;
    const double force[2] = {work->ground_force[2*contact][0], work->ground_force[2*contact + 1][0]};
    const double per_reach[2] = {1/(grip->at_rest*grip->staying[0]), 1/(grip->at_rest*grip->staying[1])};
    return excess_of(force, per_reach, (grip->load/grip->at_rest)*(grip->load/grip->at_rest));
}

/* Where a contact goes, as rows have it: which tells those whose massless rollers turn. */
static double heading_of(const omniroll_run_t *run, int contact)
{
    const double *const towards = run->ground.grips[contact].towards;
    if (SET_STRIPS && roller_mode(run, contact))
        return copysign(TURN/4, towards[1]);
    return atan2(towards[1], towards[0]);
}

/* The modes, where the kernel and the rows have them. */
static void put_modes(omniroll_run_t *run)
{
    for (int i = 0; i < run->wheels; i++) {
        const omniroll_grip_t *const grip = run->ground.grips + i;
        run->acts.inputs[SET_MODES_INPUT*run->wheels + i] = grip->sticks;
        if (!pivots(run, i))                    /* else it is from where a creep is counted                 */
            run->acts.inputs[SET_HEADINGS_INPUT*run->wheels + i] = heading_of(run, i);
    }
}

/* Contacts let go whose friction is used up at the instant at which that of others is: while all stick, they are as near to
 * it as steps can tell. What the first ones lose by slipping would hold them, and twins would part. */
static void let_go_together(omniroll_run_t *run, const work_t *work)
{
    rates_at_this_instant(run, work, run->wheels, work->nu_dot);
    for (int i = 0; i < run->wheels; i++)
        if (run->ground.grips[i].sticks && excess_now(run, work, i) > -2*edge_at_end(run))
            run->ground.grips[i].released = HAS_ENDED;
}

/* Wheels have passed to their next rollers, which come with the spins that they have. */
static void contacts_have_switched(omniroll_run_t *run, const int *directions)
{
    for (int i = 0; i < run->wheels; i++) {
        if (SET_FIRST_DIRECTION == 0 || SET_HAS_ROWS || SET_CHI_FEEDS_BACK)
            run->ground.grips[i].resting &= directions[i] == 0;
        run->ground.grips[i].keeps &= directions[i] == 0;
        run->ground.grips[i].released = 0;
    }
    (void)directions;
    run->ground.undecided = 1;
}

/* Whether the mode of a contact ends at the end of a step that ends where a contact's does. A slip that has kept its
 * direction up to there rests with no more than may remain across it. */
static int ends_mode(const step_t *s, int i)
{
    double rate;
    if (!s->contact.slides[i] && !s->contact.grips[i])
        return 0;
    const double value = change_at_end(s, i, &rate);
    if (s->event.landing == s->wheels + s->event.guards + i)
        return 1;
    const double allowed = s->contact.keeps[i] ? s->contact.residual_slip[i] : s->slip.noise[i];
    return rate > 0 && value > -(s->contact.slides[i] ? allowed : grip_noise(s, value, GRIP_PASSED));
}

/* Whether a slip that has come to rest would have missed it, however narrowly: its direction turned away from the one in which
 * it would rest, by more than rounding. Static friction above sliding friction does not hold such a contact. */
static int passes_by_rest(const omniroll_grip_t *grip, const step_t *s, int i)
{
    if (!(grip->staying[0] > grip->sliding[0] || grip->staying[1] > grip->sliding[1]))
        return 0;
    const double towards[2] = {s->slip.toward[2*i].node[0], s->slip.toward[2*i + 1].node[0]};
    const double rate[2] = {s->slip.rate[2*i].node[0], s->slip.rate[2*i + 1].node[0]};
    const double along = towards[0]*s->slip.at[2*i].node[0] + towards[1]*s->slip.at[2*i + 1].node[0];
    const double falls = -(towards[0]*rate[0] + towards[1]*rate[1]), across = towards[0]*rate[1] - towards[1]*rate[0];
    return falls > 0 && fabs(across)*along > falls*s->slip.noise[i] && power_of_turn(s, i, towards, falls) < 1;
}

/* Whether a contact goes on in the direction that the step has found, into `found`, and not in that of its slip (2,),
 * from which it differs by rounding. The forces of contacts that share their motion balance in the former, and a slip
 * that has just begun is little but rounding and the residual of sweeps. One that has kept its direction may have as
 * much across it as along it, where others come to rest with it. */
static int keeps_direction(const omniroll_run_t *run, const step_t *s, int i, const double *slip, double *found)
{
    if (SET_STANDS && SET_ROLLERS_TURN && s->contact.keeps[i])
        return 1;
    const double size = length_of(slip, 2);
    const double same = fmin(SAME*size, NO_OTHER*s->slip.noise[i]);
    const double residual = turned_together(s, i) ? 0 : fmax(RESIDUAL_OF_SWEEPS*s->rest*run->ground.arms[0], same);
    if (!turned_together(s, i) && !(size < far_from_noise(s)*s->slip.noise[i]))
        return 0;
    for (int k = 0; k < 2; k++)
        found[k] = weighted(&s->slip.toward[2*i + k], &gauss_end);
    const double length = sqrt(found[0]*found[0] + found[1]*found[1]);
    found[0] /= length, found[1] /= length;
    return goes_along(slip, found, ALONG*EPS*(speeds_of_slip(run, i) + s->h*s->contact.friction_makes) + residual);
}

static int forbid(omniroll_run_t *run, const work_t *work);

/* A wheel that comes to rest on the ground and rests in its bearing has no slip in the row, as one that turns has none:
 * nu loses what makes it. The residual of the iteration there would be a slip that goes back. */
static void stand_at_end(omniroll_run_t *run, const work_t *work)
{
    int comes_to_rest = 0;
    for (int i = 0; i < run->wheels; i++)
        comes_to_rest |= run->ground.grips[i].resting && !run->ground.grips[i].sticks;
    if (comes_to_rest && forbid(run, work))
        roll(run, work, 0);
}

/* A step has been accepted. */
static void contacts_have_moved(omniroll_run_t *run, const work_t *work, const step_t *s)
{
    double slip[2*MAX_WHEELS];
    int ended = 0;
    find_loads(run, work);
    roll(run, work, 1);
    if (s->contact.turning)
        slips_now(run, work, slip);
    for (int i = 0; i < run->wheels; i++) {
        omniroll_grip_t *const grip = run->ground.grips + i;
        const double size = s->contact.turning ? sqrt(slip[2*i]*slip[2*i] + slip[2*i + 1]*slip[2*i + 1]) : 0;
        const int ends = s->event.landing >= s->wheels + s->event.guards && ends_mode(s, i);
        const int turns = s->contact.turning && may_turn(s, i);
        double found[2] = {s->slip.toward[2*i].node[NODES - 1], s->slip.toward[2*i + 1].node[NODES - 1]};
        const int known = !ends && size > s->slip.noise[i] && !keeps_direction(run, s, i, slip + 2*i, found);
        for (int k = 0; k < 2 && turns; k++)
            grip->towards[k] = known ? slip[2*i + k]/size : found[k];
        /* the row says where it goes: its slip does not */
        if (turns && !(known && size > far_from_noise(s)*s->slip.noise[i]))
            run->acts.inputs[SET_HEADINGS_INPUT*run->wheels + i] = heading_of(run, i);
        grip->keeps = turns && !known;
        grip->resting = grip->sticks || ends;
        grip->released = ends && (grip->sticks || (turns && passes_by_rest(grip, s, i)));
        run->ground.passed += ends;
        ended |= ends;
    }
    run->ground.undecided |= ended;
    if (ended)
        roll(run, work, 0);                     /* what has come to rest has no slip                        */
}

/* A step begins: the modes, and what forces do to slips. */
static void begin_contacts(const omniroll_run_t *run, const work_t *work, step_t *s, const int wheels)
{
    double without[2*MAX_WHEELS];
    at_rest_t slipping = *work->at_rest;        /* in the same room: each decision lists what rests anew    */
    friction_problem_t response = work->problem->p;
    slipping.count = response.rows = 0;
    s->contact.responding = 0;
    s->contact.load = work->load, s->contact.friction = work->friction, s->contact.response = work->response;
    s->contact.friction_makes = run->ground.friction, s->contact.friction_force = run->ground.typical;
    s->contact.sliding = s->contact.turning = s->contact.gripping = 0;
    s->slip.turn_noise = 0;
    s->contact.settles = SET_FIRST_DIRECTION == 0 ? run->ground.settles : 0;
    for (int i = 0; i < wheels; i++) {
        const omniroll_grip_t *const grip = run->ground.grips + i;
        if (slides(run, i)) {
            s->contact.place[i] = s->contact.responding++;
            list_element(&slipping, &response, i, 0, 2 - SET_FIRST_DIRECTION);
        }
        s->contact.slides[i] = slides(run, i), s->contact.grips[i] = grip->sticks, s->slip.noise[i] = slip_rounding(run, i);
        for (int k = 0; k < 2; k++)
            s->contact.per_reach[2*i + k] = grip->carries ? 1/(grip->at_rest*grip->staying[k]) : 0;
        s->contact.per_load[i] = grip->carries ? 1/grip->at_rest : 0, s->contact.presses[i] = grip->carries;
        s->contact.sliding |= s->contact.slides[i];
        s->contact.gripping |= s->contact.grips[i];
    }
    s->contact.turning = s->contact.sliding && SET_FIRST_DIRECTION == 0;
    if (SET_STRIPS) {
        s->contact.turning = 0;
        for (int i = 0; i < wheels; i++) {
            s->contact.corner[i] = s->contact.slides[i] && roller_mode(run, i);
            s->contact.turning |= may_turn(s, i);
        }
    }
    if (SET_STANDS)
        s->slip.shared_rows = work->shared_rows, s->slip.shared_row = work->shared_row,
            s->slip.shared_turn = work->shared_turn;
    if (s->contact.sliding)
        slips_now(run, work, s->slip.start);
    if (s->contact.turning) {
        lanes_t given[2*MAX_WHEELS], yield[MAX_WHEELS];
        response.matrix = work->response, response.given = without, slipping.contacts = slipping.count;
        forces_now(run, work, given, yield);
        find_response(run, work, &slipping, 0, given, &response);
    }
}

/* The first guess of a step: directions as they are at its start, where the rates have just been found. */
static void contacts_at_start(const omniroll_run_t *run, const work_t *work, step_t *s, const int wheels)
{
    s->contact.rolls = SET_ROLLS && !stands_somewhere(run);
    for (int i = 0; i < wheels; i++) {
        s->contact.rolls &= s->contact.grips[i];
        s->slip.excess_start[i] = s->contact.grips[i] ? excess_now(run, work, i) : -1;
        s->slip.excess_late[i] = 0, s->slip.knows_response[i] = 0;
        if (SET_STANDS)
            s->slip.turned_together[i] = 0;
        s->slip.begun[2*i] = run->ground.grips[i].towards[0], s->slip.begun[2*i + 1] = run->ground.grips[i].towards[1];
        begin_direction(s, i);
        for (int b = 0; b < BLOCKS && SET_LOADS_FOLLOW; b++)
            s->slip.at_load[i].lanes[b] = work->load[i];
    }
    s->contact.blind = s->contact.rolls;
    forces_in_directions(s, wheels);
}

/* How many times less the polynomials of a step miss that stops this part of the way before rest than of one that comes
 * there. They converge like those of what has a singularity at the rest: by 1/ellipse with each node (Bernstein). */
ALWAYS_INLINE double gained_before_rest(double remainder)
{
    const double root = sqrt(fmin(remainder, MAX_REMAINDER));
    return pow((1 + root)/(1 - root), NODES);
}

/* The part of the way to rest before which a step is to stop. `error`: over what is allowed, of a step that came there. */
ALWAYS_INLINE double remainder_before_rest(double error)
{
    const double ellipse = pow(fmax(error/AIM, 1), 1.0/NODES), root = (ellipse - 1)/(ellipse + 1);
    return fmax(MIN_REMAINDER, fmin(root*root, MAX_REMAINDER));
}

/* The error of a step towards rest, over that allowed, as if it had come there. */
ALWAYS_INLINE double error_at_rest(const step_t *s, double error)
{
    return error*gained_before_rest(fmax(1 - s->h/s->contact.rest_in, 0));
}

/* The length of a step from here in which no slip comes to rest whose direction turns on the way: there it turns
 * without end. Each step makes a part of the way, so that the slip falls geometrically. Where the direction has next to
 * nothing more to turn, the slip keeps it up to rest. */
static double longest_before_rest(const omniroll_run_t *run, const work_t *work, step_t *s, const int wheels)
{
    const double speed = fmax(fmax(largest3(s->nu), run->task.speed), run->past.fastest);
    double time[MAX_WHEELS], first = INFINITY;
    s->contact.rest_in = INFINITY;
    for (int i = 0; i < wheels; i++) {
        s->contact.keeps[i] = s->contact.falls[i] = 0, time[i] = INFINITY;
        if (!s->contact.slides[i])
            continue;
        const double *const slip = s->slip.start + 2*i, *const towards = run->ground.grips[i].towards;
        const double rate[2] = {work->slip_dot[2*i][0], work->slip_dot[2*i + 1][0]};
        const double along = slip[0]*towards[0] + slip[1]*towards[1];
        const double falls = -(rate[0]*towards[0] + rate[1]*towards[1]), across = rate[1]*towards[0] - rate[0]*towards[1];
        s->contact.falls[i] = falls > s->contact.settles;
        if (!s->contact.turning || !may_turn(s, i))
            continue;
        s->contact.residual_slip[i] = fmax(TURNS_AWAY*run->task.tolerance*speed*run->ground.arms[0], s->slip.noise[i]);
        if (!(s->contact.falls[i] && along > 0))
            continue;
        s->contact.keeps[i] = !s->contact.strays && fabs(across)*along <= falls*s->contact.residual_slip[i];
        if (s->contact.keeps[i] || along > s->slip.noise[i])
            time[i] = along/falls;
        first = fmin(first, time[i]);
    }
    for (int i = 0; i < wheels; i++) {
        s->contact.keeps[i] = s->contact.keeps[i] && time[i] <= MUCH_LATER*first;   /* till then others may turn it  */
        if (!s->contact.keeps[i] && time[i] < s->contact.rest_in)
            s->contact.rest_in = time[i], s->contact.rests = i;
    }
    return (1 - (run->past.rest_error > 0 ? remainder_before_rest(run->past.rest_error) : REMAINDER))*s->contact.rest_in;
}

/* The length of the next try after a step towards a rest that missed too much: by what this tells about the rest, and
 * where that has not been enough, by how much less the last try missed than the one before. */
static double farther_from_rest(const step_t *s, double error, const tried_t *before)
{
    double part = (1 - remainder_before_rest(error_at_rest(s, error)))*s->contact.rest_in/s->h;
    if (before->error < INFINITY && s->h < before->h) {
        const double power = log(before->error/error)/log(before->h/s->h);
        part = pow(AIM/error, 1/fmax(power, EASIEST_TURN));
    }
    return s->h*fmin(fmax(part, 0.2), 0.9);
}

/* The length of steps is kept while slips come near rest, and stands again behind it. */
static void keep_calm_step(omniroll_run_t *run, const step_t *s, double calm, double error)
{
    if (s->event.landing >= s->wheels + s->event.guards) {
        run->past.step = fmax(run->past.step, run->past.calm_step);
        run->past.calm_step = run->past.rest_error = 0;
    } else if (s->contact.rest_in < INFINITY) {
        if (s->contact.rest_in < calm)
            run->past.calm_step = fmax(run->past.calm_step, calm);
        run->past.rest_error = fmax(error_at_rest(s, error), EPS);
    }
}

/* Whether a slip that has kept its direction should have turned. */
static int has_strayed(const step_t *s, const int wheels)
{
    for (int i = 0; i < wheels; i++)
        for (int m = 0; m < NODES && s->contact.keeps[i]; m++)
            if (fabs(s->slip.toward[2*i].node[m]*s->slip.at[2*i + 1].node[m]
                     - s->slip.toward[2*i + 1].node[m]*s->slip.at[2*i].node[m]) > STRAYS*s->contact.residual_slip[i])
                return 1;
    return 0;
}

/* Whether a step ends at a rest on whose way a direction turns, sooner than was expected: the last turn is then behind its
 * last node, and something of the slip remains across the direction there. */
static int rests_early(const step_t *s, const int wheels)
{
    const int i = s->event.landing - wheels - s->event.guards;
    if (i < 0 || i >= wheels || !s->contact.turning || !may_turn(s, i) || s->contact.keeps[i]
        || !(s->contact.rest_in < INFINITY))
        return 0;
    return length_of(s->slip.end + 2*i, 2) > STRAYS*s->contact.residual_slip[i];
}

/* Contacts whose mode has ended at this instant, each told once. */
ALWAYS_INLINE int pass_contacts(omniroll_run_t *run)
{
    const int count = run->ground.passed;
    run->ground.passed = 0;
    return count;
}
