/* A step of a run: how it begins, its first guess, its tries, and what the run takes of it. */
#define FAR 1000                    /* times the last step's length: there its rise says nothing any more    */
#define CAUTIOUS 1.3                /* times a step that the iteration has made short: the longest after it       */
#define SPIN_UP 2                   /* times the first step after the last switch: the longest after the next   */
#define PART_TO_BEND 0.9            /* of the way to where rates bend, in a step                              */
#define NEAR_BEND 0.4               /* of the rate from which a step may pass zero: where the one before it ends   */
#define BEND_NEARER 0.3             /* of a wheel's rate from which a step could not pass zero: it may be from there */
#define ACROSS_BEND 2               /* times the way to a bend: a step that passes it                           */
#define SHRINKS 0.1                 /* of a step: to less an event shortens no try that has not found its slips         */
#define EASY 1e-3                   /* of the error allowed: a step as good as this might have been longer      */

/* The core at the step's start, and where what is known of it along the step stands. */
ALWAYS_INLINE void begin_core_of_step(const omniroll_run_t *run, const work_t *work, step_t *s)
{
    s->core = work->core, s->start_core = run->state.core, s->end_core = work->end_core, s->weight = work->weight;
    s->rate_core = work->rate_core, s->at_core = work->at_core;
    s->core_here = work->core_here, s->core_dot = work->core_dot;
    s->stiff.core_slope = work->core_slope, s->stiff.core_chord = work->core_chord;
    s->stiff.found_core = work->found_core, s->stiff.slope_core = work->slope_core;
    s->stiff.core_in_nu = work->core_in_nu;
}

/* Bearings that stick, and the forces that hold them. */
ALWAYS_INLINE void begin_held_forces(const omniroll_run_t *run, step_t *s, const int wheels)
{
    for (int i = 0; i < wheels; i++)
        s->hold.turns[i] = !sticks(run, i);
    for (int k = 0; k < 9; k++)
        s->hold.directions[k] = lanes_of(run->hold.directions[k]);
    for (int k = 0; k < 3; k++) {
        s->hold.absent[k] = lanes_of(run->hold.absent[k]);
        s->hold.force_size[k] = run->hold.size[k];
        s->hold.per_force[k] = run->hold.per_force[k];
    }
}

ALWAYS_INLINE void begin_guards(const omniroll_run_t *run, step_t *s, const int wheels)
{
    s->event.guards = all_guards(run);
    for (int k = 0; k < s->event.guards; k++) {
        const double *const guard = run->acts.guards + guard_size(wheels)*k;
        s->event.guard.start[k] = guard_value(run, guard, &s->event.guard.noise[k]);
        s->event.guard.slope[k] = guard[1];
        s->event.guard.share[k] = SET_SHARES ? bound_of_share(run, k) : 0;
        for (int m = 0; m < 3; m++)
            s->event.guard.weights[3*k + m] = guard[2 + m];
    }
    s->event.read_count = 0;
    for (int n = 0; SET_SLIPS && n < guarded_count(wheels); n++) {
        int is_read = 0;
        for (int k = 0; k < s->event.guards; k++)
            is_read |= guard_weight(run->acts.guards + guard_size(wheels)*k, n) != 0;
        if (is_read)
            s->event.reads[s->event.read_count++] = n;
    }
}

/* A step as it begins: the state, and what acts. */
ALWAYS_INLINE void begin_step(const omniroll_run_t *run, const work_t *work, step_t *s, const int wheels)
{
    for (int k = 0; k < 3; k++)
        s->nu[k] = run->state.nu[k];
    for (int i = 0; i < wheels; i++)
        s->chi[i] = run->state.chi[i];
    if (SET_HAS_HEADING)
        s->acts.heading = remainder(run->state.pose[2], TURN), s->acts.at_heading = (nodes_t){{{0}}};
    if (SET_INPUTS) {
        const double *slopes = run->acts.inputs + SET_INPUTS*wheels;
        s->acts.moves = 0, s->acts.length = 0, s->acts.at_nodes = work->inputs;
        for (int k = 0; k < SET_INPUTS*wheels; k++) {
            s->acts.input[k] = input_now(run, k), s->acts.held[k] = lanes_of(s->acts.input[k]);
            s->acts.input_slope[k] = slopes[k], s->acts.moves |= slopes[k] != 0;
        }
    }
    if (SET_CORE_PARTS)
        begin_core_of_step(run, work, s);
    if (SET_SLIPS || SET_CHI_FEEDS_BACK)
        s->event.guard_rows = run->acts.guards;
    s->all_turn = all_turn(wheels, &work->vehicle), s->bare = run->task.bare;
    if (SET_SHARES)
        s->contact.next_before = work->next_before;
    if (SET_IS_COUPLED || SET_LOADS_FOLLOW)
        s->coupled = &work->coupled_speeds;
    if (SET_GRIPS) {
        begin_contacts(run, work, s, wheels);
        s->contact.strays = 0;
    }
    if (SET_APPROACHES)
        s->approach.stretched = 0;
    if (SET_STICKS) {
        s->hold.held = run->hold.count, s->hold.of_contacts = 0;
        begin_holding(run, work, s);
    }
    if (SET_HOLDS)
        begin_held_forces(run, s, wheels);
    if (SET_CORE_BEARINGS)
        s->hold.residual = residual_of_rates(run);
    if (SET_IS_ACTED_ON)
        begin_guards(run, s, wheels);
    (void)work;
}

ALWAYS_INLINE double size_in_power(double size, int power)
{
    return power == 2 ? size*size : power ? size : 1;
}

/* The size of nu that errors are measured against; where something acts, the largest up to the end of the step.
 * Sets the weights of the rest of the core. */
ALWAYS_INLINE double size_of_state(const omniroll_run_t *run, const work_t *work, step_t *s, const lanes_t *nu_dot)
{
    double size = largest3(s->nu);
    if (SET_IS_ACTED_ON) {
        const double gained[3] = {s->h*nu_dot[0][0], s->h*nu_dot[1][0], s->h*nu_dot[2][0]};
        size = fmax(fmax(size, fmin(largest3(gained), 1e300)), fmax(run->past.fastest, run->task.speed));
    }
    if (SET_CORE_PARTS) {
        int c = 0;
        for (int part = 0; part < SET_CORE_PARTS; part++) {
            const int end = core_part_end(run->wheels, run->rollers_per_wheel, part);
            double of_part = run->task.part_sizes[part]*size_in_power(size, core_part_power(part));
            for (int k = c; k < end; k++)
                of_part = larger(of_part, fabs(run->state.core[k]));
            for (; c < end; c++)
                s->weight[c] = of_part > 0 ? size/of_part : 0;
        }
    }
    if (SET_IS_ACTED_ON || SET_CHI_FEEDS_BACK)
        s->size = size;
    (void)run, (void)work, (void)nu_dot;
    return size;
}

#define NEAR_REST 4                 /* times the small speed below which friction fades: the nodes resolve it there */

/* The time until the first number of the core that friction slows down comes near rest, where its rate bends. A number
 * that is near already does not count. How near it is follows from the slopes of friction: the tangent over the chord
 * from rest is w0^2/(w^2 + w0^2). */
static double time_to_rest(const step_t *s, const int wheels, const point_t *start)
{
    double time = INFINITY;
    core_slopes(wheels, start, s->stiff.core_slope, s->stiff.core_chord);
    for (int c = 0; c < s->core; c++) {
        const double stop = -s->start_core[c]/s->core_dot[c][0];
        const double far = 1 - NEAR_REST*sqrt(s->stiff.core_slope[c][0]/s->stiff.core_chord[c][0]);
        if (stop > 0 && far > 0.5)
            time = fmin(time, stop*far);
    }
    return time;
}

/* The length of a step from here after which no wheel has passed zero that turns too fast for that: friction with a small
 * named speed bends the rates there. Each step makes a part of the way. */
static double longest_before_bend(const omniroll_run_t *run, const work_t *work, step_t *s, const lanes_t *nu_dot,
                                  const lanes_t *chi_dot)
{
    double time = INFINITY;
    lanes_t chi_ddot[MAX_WHEELS];
    s->bend_in = INFINITY;
    accelerations_now(run, work, nu_dot, chi_ddot);
    for (int i = 0; i < run->wheels; i++) {
        const double rate = fabs(chi_dot[i][0]), rest_in = -chi_dot[i][0]/chi_ddot[i][0];
        const double part = fmin(1 - NEAR_BEND*run->past.bend_rate/rate, PART_TO_BEND);
        if (rate > run->past.bend_rate && rest_in > 0 && part*rest_in < time) {
            time = part*rest_in;
            s->bend_in = rest_in;
        }
    }
    return time;
}

/* The rates where a step starts; those of contacts that all stick have been found with their modes. */
ALWAYS_INLINE void rates_at_start(const omniroll_run_t *run, const work_t *work, const int wheels, lanes_t *nu_dot)
{
    if (SET_GRIPS && run->ground.knows_rates) {
        for (int k = 0; k < 3; k++)
            nu_dot[k] = work->nu_dot[k];
        return;
    }
    rates_at_this_instant(run, work, wheels, nu_dot);
}

/* The longest that a step may be whose rates are smooth, at most `longest`: up to rests, and to where rates bend. */
ALWAYS_INLINE double longest_smooth(step_t *s, const int wheels, double longest, const omniroll_run_t *run,
                                    const work_t *work, const lanes_t *nu_dot, const lanes_t *chi_dot)
{
    if (SET_HAS_SLOPES) {
        instant_t start;
        at_this_instant(run, work, wheels, &start);
        if (s->stiff.on)
            longest = fmin(longest, time_to_rest(s, wheels, &start.point));
    }
    if (SET_IS_ACTED_ON && !SET_SLIPS) {
        s->bend_in = INFINITY;
        if (run->past.bend_rate > 0)
            longest = fmin(longest, longest_before_bend(run, work, s, nu_dot, chi_dot));
    }
    if (SET_GRIPS)
        longest = fmin(longest, longest_before_rest(run, work, s, wheels));
    if (SET_STRIPS)
        longest = fmin(longest, longest_in_corners(s, wheels));
    (void)s, (void)wheels, (void)run, (void)work, (void)nu_dot, (void)chi_dot;
    return longest;
}

/* What the polynomials of what holds lack at the end of a step: nothing is known of it yet. */
ALWAYS_INLINE void nothing_is_late(step_t *s)
{
    if ((SET_HOLDS || SET_STANDS) && s->hold.standing->count) {
        memset(&s->hold.demand_late, 0, sizeof s->hold.demand_late);
        s->hold.nearly_used = 0;
    }
    if (SET_CORE_BEARINGS)
        for (int k = 0; k < s->hold.count; k++)
            s->hold.states->late[k] = 0;
    (void)s;
}

/* The length to the first joint at constant rates, at most `longest`. */
ALWAYS_INLINE double length_to_joint(step_t *s, const int wheels, double longest, const lanes_t *chi_dot)
{
    double length = longest;
    for (int i = 0; i < wheels; i++) {
        const double rate = chi_dot[i][0]*turns(s, i), sign = rate < 0 ? -1 : 1;
        /* The contact has passed on wherever a wheel at its joint moves outwards, unless it rests there. */
        s->event.edge[i] = fabs(s->chi[i]) >= s->joint[i] && s->chi[i]*rate > 0 ? s->joint[i]*ROUNDED : s->joint[i];
        if (rate != 0)
            length = fmin(length, (s->event.edge[i] - sign*s->chi[i])/(sign*rate));
    }
    return length > 1e-3*longest ? length : 1e-3*longest;
}

/* The first guess of a step: the rates at its start, rising as in the last step; and the length to the first joint
 * at constant rates, at most `longest`, which may become less. Returns the size of nu. */
ALWAYS_INLINE double guess(step_t *s, const int wheels, double *longest, const omniroll_run_t *run, const work_t *work)
{
    lanes_t nu_dot[3], chi_dot[MAX_WHEELS];
    rates_at_start(run, work, wheels, nu_dot);
    wheel_rates_now(run, work, chi_dot);
    if (SET_GRIPS)
        contacts_at_start(run, work, s, wheels);
    if (SET_LOADS_FOLLOW)
        find_tilt_slopes(run, work, s);
    *longest = longest_smooth(s, wheels, *longest, run, work, nu_dot, chi_dot);
    if (SET_LOADS_FOLLOW && run->state.elapsed == run->past.phase_start) {  /* a swing begins: no step before tells its length */
        s->h = *longest;
        const double allowed = run->task.tolerance*size_of_state(run, work, s, nu_dot);
        *longest = fmin(*longest, longest_in_swing(s, wheels, work->core_dot, allowed));
    }
    nothing_is_late(s);
    s->h = length_to_joint(s, wheels, *longest, chi_dot);
    /* No slope, which is of the order of nu^3: it would leave the number range long before nu^2 does. The rise over a
     * step that was far shorter is little but rounding. */
    if (SET_IS_COUPLED) {
        const lanes_t none[3] = {lanes_of(0), lanes_of(0), lanes_of(0)};
        size_of_state(run, work, s, none);
        first_guess(s, wheels, nu_dot);
        return size_of_state(run, work, s, nu_dot);
    }
    const double part = s->h < FAR*run->past.rise_over && !SET_LOADS_FOLLOW ? s->h/run->past.rise_over : 0;
    if (SET_IS_ACTED_ON) {
        s->stiff.sweeps = 0;
        memset(s->stiff.slope_nu, 0, sizeof s->stiff.slope_nu);
    }
    for (int k = 0; k < 3; k++)
        for (int b = 0; b < BLOCKS; b++)
            s->rate_nu[k].lanes[b] = nu_dot[k] + run->past.rise_nu[k]*(part*gauss_node.lanes[b]);
    if (SET_CORE_PARTS)
        for (int c = 0; c < work->core; c++)
            for (int b = 0; b < BLOCKS; b++)
                s->rate_core[c].lanes[b] = work->core_dot[c] + work->rise_core[c]*(part*gauss_node.lanes[b]);
    if (SET_CHI_FEEDS_BACK)
        for (int i = 0; i < wheels; i++)
            for (int b = 0; b < BLOCKS; b++) {
                s->rate_chi[i].lanes[b] = chi_dot[i];
                s->at_chi[i].lanes[b] = s->chi[i] + (s->h*chi_dot[i])*gauss_node.lanes[b];
            }
    if (SET_LOADS_FOLLOW)
        guess_tilt(s, wheels);
    return size_of_state(run, work, s, nu_dot);
}

/* The event is reached `late` after the end of the polynomials: so little that rates are constant there. */
ALWAYS_INLINE void end_late(step_t *s, const int wheels)
{
    for (int k = 0; k < 3; k++) {
        s->end.nu[k] += s->event.late*weighted(&s->rate_nu[k], &gauss_end);
        s->end.travel[k] += s->event.late*weighted(&s->rate_pose[k], &gauss_end);
    }
    for (int i = 0; i < wheels; i++)
        s->end.chi[i] += s->event.late*s->end.rate[i];
    if (SET_CORE_PARTS)
        for (int c = first_integrated(s, wheels); c < s->core; c++)
            s->end_core[c] += s->event.late*weighted(&s->rate_core[c], &gauss_end);
}

/* Where in the step, x in (0, 1), a wheel or a guard is beyond its bound and back at the end; 1 if none is. */
ALWAYS_INLINE double first_turn_beyond(const step_t *s, const int wheels)
{
    double turned = 1;
    for (int i = 0; i < wheels; i++)
        turned = fmin(turned, turn_outside(s, i));
    if (SET_IS_ACTED_ON)
        for (int k = 0; k < s->event.guards; k++)
            turned = fmin(turned, turn_of_guard(s, k));
    if (SET_GRIPS)
        turned = fmin(turned, turn_of_contacts(s, wheels));
    if (SET_STRIPS)
        turned = fmin(turned, turn_of_corners(s, wheels));
    if (SET_HOLDS || SET_STANDS)
        turned = fmin(turned, turn_of_use(s, wheels));
    if (SET_CORE_BEARINGS)
        for (int k = 0; k < s->hold.count; k++)
            turned = fmin(turned, turn_of_bearing(s, k));
    return turned;
}

/* What the polynomials of the last try miss most: which part of the core, -1 for nu, and of which wheel; of a part that is
 * not the wheels', and of nu, of the wheel whose rate they miss most. */
static void name_hardest(omniroll_run_t *run, const step_t *s)
{
    double largest = 0, hardest = tail(&s->rate_nu[0]) + tail(&s->rate_nu[1]) + tail(&s->rate_nu[2]);
    run->record.hardest_part = run->record.stopped_wheel = -1;
    for (int i = 0; i < run->wheels; i++)
        if (tail(&s->rate_chi[i]) > largest)
            largest = tail(&s->rate_chi[i]), run->record.stopped_wheel = i;
    if (SET_CORE_PARTS)
        for (int part = 0, c = 0; part < SET_CORE_PARTS; part++)
            for (int first = c, end = core_part_end(run->wheels, run->rollers_per_wheel, part); c < end; c++) {
                const double missing = s->weight[c]*tail(&s->rate_core[c]);
                if (!(missing > hardest))
                    continue;
                hardest = missing, run->record.hardest_part = part;
                if ((end - first)%run->wheels == 0)
                    run->record.stopped_wheel = (c - first)/((end - first)/run->wheels);
            }
}

/* The next try after one that was too long: up to where rates bend, if they do. ahead: the length of the step after it
 * in whose middle they bend. */
ALWAYS_INLINE double shorter(omniroll_run_t *run, step_t *s, const int wheels, double factor, double error,
                             const tried_t *before, double allowed, double *ahead)
{
    if (SET_GRIPS && s->contact.turning && s->contact.rest_in < INFINITY)
        return farther_from_rest(s, error, before);
    if (SET_IS_ACTED_ON && !SET_IS_COUPLED) {
        const bend_t found = bend(s, wheels, allowed);
        if (found.from < 1 && found.wheel >= 0) {
            const double rate = BEND_NEARER*fabs(weighted(&s->rate_chi[found.wheel], &gauss_start));
            run->past.bend_rate = run->past.bend_rate > 0 ? fmin(run->past.bend_rate, rate) : rate;
            return s->h*found.from*PART_TO_BEND;
        }
        if (found.from < 1) {
            *ahead = 2*s->h*(found.to - found.from);
            return s->h*found.from;
        }
    }
    (void)run, (void)wheels, (void)error, (void)before, (void)allowed, (void)ahead;
    return s->h*fmin(fmax(factor, 0.2), 0.9);
}

/* The next step after an accepted one. Where steps have grown and still miss next to nothing, as behind a bend, they
 * grow by more (Gustafsson's predictive control). */
ALWAYS_INLINE double longer(const omniroll_run_t *run, step_t *s, double factor, double error)
{
    double step = s->h*fmin(fmax(factor, 1.0), 5.0);
    if (SET_IS_ACTED_ON) {
        if (error < EASY && s->h > run->past.rise_over)  /* the length of the step before                         */
            step = fmin(step*(s->h/run->past.rise_over), 5*s->h);
    }
    (void)run, (void)error;
    return step;
}

/* What the lengths of a step's tries follow from. */
typedef struct {
    double rest;            /* to the limit of the step                                                      */
    double meant;           /* by the step before; 0 at a start                                              */
    double longest;         /* of this try                                                                   */
    double uncut;           /* the same, before events have cut it                                           */
    double calm;            /* before slips that come to rest make it shorter                                */
    double ahead;           /* of a next step in whose middle rates bend                                     */
    int after_switch;
    int slow;               /* whether the iteration and not the error has made the step short               */
    tried_t last_try;
} lengths_t;

ALWAYS_INLINE lengths_t first_lengths(const omniroll_run_t *run)
{
    lengths_t of = {.meant = run->past.step, .ahead = INFINITY, .last_try = {0, INFINITY}};
    of.rest = limit_of_step(run) - run->state.elapsed - run->state.carry;
    of.longest = of.meant > 0 && of.meant < of.rest ? of.meant : of.rest;
    of.after_switch = SET_IS_COUPLED && run->state.elapsed == run->past.phase_start;
    if (of.after_switch && run->past.first_step > 0)  /* the ground spins the entering roller up in a short time */
        of.longest = fmin(of.longest, SPIN_UP*run->past.first_step);
    of.calm = of.uncut = of.longest;
    return of;
}

/* Whether a try is not accurate enough, or too long for its event; the length of the next one then. */
ALWAYS_INLINE int misses(omniroll_run_t *run, step_t *s, const int wheels, int found, double allowed, lengths_t *of,
                         double *error, double *factor)
{
    *error = allowed > 0 ? missed(s)/allowed : 0;
    if (SET_IS_COUPLED && *error <= 1 && allowed > 0)
        *error = fmax(*error, missed_at_start(s, wheels, allowed)/allowed);
    *factor = *error > 0 ? 0.9*pow(*error, -1.0/NODES) : 5;
    const tried_t before = of->last_try;
    of->last_try = (tried_t){s->h, *error};
    if (SET_IS_ACTED_ON) {
        /* A shorter step is no better: what decays is far shorter yet. */
        if ((SET_IS_COUPLED || s->stiff.by_axles) && *error > 0.5*before.error)
            *factor = fmin(*factor, SET_IS_COUPLED ? 0.25 : 0.6);
    }
    if (!(*error > 1 || found == TOO_LONG))
        return 0;
    of->longest = of->uncut = shorter(run, s, wheels, *factor, *error, &before, allowed, &of->ahead);
    run->record.rejected_count++;
    return 1;
}

/* Whether an accurate try passes what its step must not: a direction that turns too far, or a rest. */
ALWAYS_INLINE int passes_too_much(step_t *s, const int wheels, lengths_t *of)
{
    const double turned = first_turn_beyond(s, wheels);
    if (turned < 1) {
        of->longest = s->h*turned;
        return 1;
    }
    if (SET_GRIPS) {
        if (has_strayed(s, wheels)) {
            s->contact.strays = 1;
            return 1;
        }
        if (rests_early(s, wheels)) {
            of->longest = (1 - REMAINDER)*s->h;
            return 1;
        }
    }
    return 0;
}

/* The length of the step after an accepted one. An event cuts a step short: the length that was meant stands for the
 * next phase then. At fine tolerances a try that is too long costs more than a step that is too short. */
ALWAYS_INLINE void put_next_length(omniroll_run_t *run, step_t *s, const lengths_t *of, double factor, double error)
{
    run->past.step = fmin(longer(run, s, factor, error), of->ahead);
    if (SET_IS_ACTED_ON && !SET_SLIPS && s->bend_in < INFINITY && s->h < s->bend_in)
        run->past.step = fmin(run->past.step, ACROSS_BEND*(s->bend_in - s->h));
    if (SET_IS_COUPLED) {
        run->past.first_step = of->after_switch ? s->h : run->past.first_step;
        run->past.step = fmin(run->past.step, of->slow ? CAUTIOUS*s->h : INFINITY);
    }
    if (SET_GRIPS)
        keep_calm_step(run, s, of->calm, error);
    if (s->event.landing >= 0)
        run->past.step = fmax(run->past.step,
                              (run->task.tolerance > 1e-7 ? 1.0 : 0.6)*(SET_GRIPS ? of->uncut : of->longest));
    else if (run->task.pauses && s->h >= of->rest)
        run->past.step = fmax(run->past.step, of->meant);
}

/* One accepted step from the state of the run, to the next event at the most. Returns a status. */
ALWAYS_INLINE int advance(omniroll_run_t *run, const work_t *work, step_t *s, const int wheels)
{
    lengths_t of = first_lengths(run);
    begin_step(run, work, s, wheels);
    /* end_late() has an error of the order of (late/h)^2, so that the event need not be hit better than this. */
    s->event.reach = fmax(fmin(0.03*sqrt(run->task.tolerance), 1e-5), 1e-8);
    s->event.tick = EPS*limit_of_step(run);
    for (int trial = 0; trial < 200; trial++) {
        const double size = guess(s, wheels, &of.longest, run, work);
        if (SET_GRIPS)
            run->ground.knows_rates = 0;
        if (SET_APPROACHES) {
            const double longest = fmin(fmax(of.calm, run->past.calm_step), of.rest);
            const int approach = trial == 0 ? approach_rest(run, work, s, wheels, longest, &of.longest, size,
                                                            size*sweep_tolerance(run, s->contact.rest_in)) : NO_APPROACH;
            if (approach == MISSES_REST)
                continue;
            if (approach == APPROACHES) {
                keep_step_behind(run, s, of.calm);
                return OMNIROLL_RUN_DONE;
            }
        }
        const int found = settle(s, wheels, of.longest, size*run->task.tolerance, size*sweep_tolerance(run, s->h));
        if (SET_IS_ACTED_ON) {
            s->stiff.by_newton = s->stiff.on;
            s->stiff.on = s->stiff.on && !(found != UNSETTLED && s->stiff.steepest < NOT_STIFF);
            of.slow = of.slow || found == UNSETTLED;
        }
        if (found == UNSETTLED) {
            of.longest = of.uncut = fmin(fmax(s->h, SET_GRIPS ? SHRINKS*of.longest : 0), of.longest)/(SET_IS_COUPLED ? 2 : 3);
            run->record.rejected_count++;
            continue;
        }
        integrate_pose(s, run->state.pose);
        double error, factor;
        if (misses(run, s, wheels, found, size*run->task.tolerance, &of, &error, &factor)
            || passes_too_much(s, wheels, &of))
            continue;
        if (SET_ACCOUNTS)
            accounts_at_nodes(s, wheels);
        end_late(s, wheels);
        run->record.step_error = fmax(run->record.step_error, error*run->task.tolerance);
        if (SET_IS_ACTED_ON) {
            run->record.sweep_error += size > 0 ? s->rest/size : 0;
            s->stiff.on = s->stiff.on || (!SET_IS_COUPLED && of.slow && error < EASY);
        }
        put_next_length(run, s, &of, factor, error);
        return OMNIROLL_RUN_DONE;
    }
    name_hardest(run, s);
    return OMNIROLL_RUN_NO_STEP;
}

/* a + b rounded, and what the rounding leaves over (Knuth). */
ALWAYS_INLINE double sum_and_rest(double a, double b, double *rest)
{
    const double sum = a + b, part = sum - a;
    *rest = (a - (sum - part)) + (b - part);
    return sum;
}

/* What acts has been at work for a step. */
ALWAYS_INLINE void take_what_acts(omniroll_run_t *run, const step_t *s, const work_t *work, const int wheels)
{
    double turned = 0;
    run->past.fastest = fmax(run->past.fastest, largest3(run->state.nu));
    for (int i = 0; i < wheels; i++)
        turned = larger(turned, extent_of(&s->at_chi[i], s->chi[i], run->state.chi[i]));
    run->past.turned += turned;
    if (SET_CORE_PARTS) {
        for (int c = 0; c < first_integrated(s, wheels); c++)
            work->rise_core[c] = 0;
        for (int c = first_integrated(s, wheels); c < s->core; c++) {
            run->state.core[c] = s->end_core[c];
            work->rise_core[c] = weighted(&s->rate_core[c], &gauss_end) - weighted(&s->rate_core[c], &gauss_start);
        }
    }
    if (SET_ACCOUNTS)
        for (int k = 0; k < account_size(wheels); k++)
            run->state.accounts[k] += s->h*weighted(&s->rate_account[k], &gauss_weight)
                + s->event.late*weighted(&s->rate_account[k], &gauss_end);
    (void)work;
}

#define DAMPED 0.01                 /* of a step: over this time deviations of the end of a stiff step decay */

/* The slope of a number of the core's rate, at the step's end: that at the last node, or where friction tells it the
 * chord from rest. Next to rest the friction of a small named speed is steep at the end and not at the last node, whose
 * slope alone would throw a number that has come to rest far off. */
ALWAYS_INLINE double slope_at_end(const step_t *s, const work_t *work, int c)
{
    const double at_node = s->stiff.slope_core[c].node[NODES - 1];
    if (SET_HAS_SLOPES)
        return fmin(at_node, work->core_chord[c][0]);
    return at_node;
}

/* The polynomials of a stiff step do not damp what decays fast: its deviation, in which rates and polynomials differ,
 * would go on from step to step with changing sign. A step of Euler's implicit method takes it away. */
static void damp(omniroll_run_t *run, const work_t *work, const step_t *s, const int wheels)
{
    const double time = DAMPED*s->h;
    lanes_t nu_dot[3];
    double m[9], change[3];
    if (SET_GRIPS)
        roll(run, work, 1);
    rates_at_this_instant(run, work, wheels, nu_dot);
    if (SET_HAS_SLOPES) {
        instant_t end;
        at_this_instant(run, work, wheels, &end);
        core_slopes(wheels, &end.point, work->core_slope, work->core_chord);
    }
    for (int k = 0; k < 3; k++) {
        for (int l = 0; l < 3; l++)
            m[3*k + l] = (k == l) - time*s->stiff.slope_nu[3*k + l].node[NODES - 1];
        change[k] = time*(nu_dot[k][0] - weighted(&s->rate_nu[k], &gauss_end));
    }
    solve_rows(m, 3, change);
    for (int k = 0; k < 3; k++)
        run->state.nu[k] += change[k];
    if (SET_CORE_PARTS)
        for (int c = 0; c < s->core; c++)
            if (!follows_nu(s, wheels, c) && !is_of_tilt(wheels, c))
                run->state.core[c] += time*(work->core_dot[c][0] - weighted(&s->rate_core[c], &gauss_end))
                    /(1 - time*slope_at_end(s, work, c));
}

ALWAYS_INLINE int asks_damping(const step_t *s, const int wheels)
{
    return s->stiff.by_newton && DAMPED*s->stiff.steepest > 1 && s->event.landing < wheels;
}

ALWAYS_INLINE void take(omniroll_run_t *run, const work_t *work, const step_t *s, const int wheels)
{
    omniroll_state_t *const state = &run->state;
    put_bearing_modes(run);                     /* of this step, where they were decided after its first row   */
    if (SET_APPROACHES && s->approach.stretched > 1)
        put_pieces(run, s);
    else
        put_step(run, s);
    for (int k = 0; k < 3; k++) {
        state->nu[k] = s->end.nu[k];
        state->pose[k] = sum_and_rest(state->pose[k], s->end.travel[k] + state->pose_carry[k], &state->pose_carry[k]);
    }
    for (int i = 0; i < wheels; i++) {
        const double sign = s->end.chi[i] < 0 ? -1 : 1, joint = run->joint[i];
        state->chi[i] = i == s->event.landing ? sign*joint : fmax(fmin(s->end.chi[i], joint), -joint);
    }
    if (SET_CHI_FEEDS_BACK && !SET_SLIPS && run->acts.modal_count)
        carry_rows(run, work);                  /* which guards read                                        */
    const double limit = limit_of_step(run);
    const int last = s->event.landing < 0 && s->h >= limit - state->elapsed - state->carry;
    const double h = s->h + s->event.late + state->carry, sum = state->elapsed + h;
    state->carry = last ? 0 : h - (sum - state->elapsed);
    state->elapsed = last ? limit : fmin(sum, limit);
    for (int k = 0; k < 3; k++)
        run->past.rise_nu[k] = weighted(&s->rate_nu[k], &gauss_end) - weighted(&s->rate_nu[k], &gauss_start);
    run->past.rise_over = s->h;
    if (SET_APPROACHES) {
        if (s->approach.stretched > 1)           /* the rates of its last nodes are not those in time                    */
            run->past.rise_over = 0;
    }
    run->record.step_count++;
    if (SET_IS_ACTED_ON) {
        run->past.at_event = is_over(run) || state->elapsed >= run->acts.next_time || s->event.landing >= wheels;
        take_what_acts(run, s, work, wheels);
        if (!SET_GRIPS && asks_damping(s, wheels))
            damp(run, work, s, wheels);
    }
    if (SET_SHARES)
        joints_have_moved(run, s);
    if (SET_STICKS && !SET_STANDS)
        bearings_have_moved(run, work, s);
    if (stands_somewhere(run))
        bearings_have_stuck(run, work);
    if (SET_GRIPS)
        contacts_have_moved(run, work, s);
    if (SET_IS_ACTED_ON && SET_GRIPS && asks_damping(s, wheels))    /* with the directions of slips at the end      */
        damp(run, work, s, wheels);
    if (stands_somewhere(run))
        wheels_have_moved(run, work, s);
    (void)work;
    put_row(run);
}
