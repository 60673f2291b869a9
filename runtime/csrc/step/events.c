/* Events: where a step ends before its length is over. A wheel that reaches its joint, a guard that becomes
 * positive.
 *
 * The iteration at the nodes corrects h by Newton's rule along with the rates, so that landing on an event costs no
 * step of its own. A guard is affine in time and nu; it counts as passed only where it exceeds its own rounding, so
 * that one which has just been landed on, and guards the way back, stays quiet until the motion really goes back. */
#define MAX_SWEEPS 60
#define STIFF_SWEEPS 10             /* by Newton's rule                                                     */
#define MAX_MOVES 4                 /* of a step that has settled, on to where a contact lets go            */
#define CLOSE 1e-9                  /* of a step: rates are constant to rounding over this time               */
#define RENEW 0.1                   /* a ratio of two changes that asks for new slopes in the stiff sweeps   */
#define PATIENT_OF_NU 6             /* sweeps before that, of nu alone                                      */
#define PATIENT (SET_CORE_PARTS ? 2 : PATIENT_OF_NU)    /* and with the rest of the core,                   */
#define PATIENT_IN_TURNS 8          /* and where directions of slips turn                                    */
#define SLOW 0.3                    /* a ratio of two changes that asks for the stiff sweeps,              */
#define EARLY 2                     /* and where they are cheap after this sweep already                   */
#define NOT_FAST 0.25               /* this ratio                                                          */
#define MUCH_TOO_LONG 1000          /* times the error allowed, which the second sweep shows               */
#define HELD_RISES 1e5              /* of roundings of what holds its slope at the end of a step is known    */
#define HELD_NOISE 4096             /* roundings of what holds inside a step                                */
#define TELL_SLIPS 4                /* sweeps behind which it is known how slips go that begin with the step    */
#define LANDED 2                    /* roundings around zero is on it                                       */
#define LEBESGUE 7                  /* how much larger than at the nodes a polynomial in the step may be    */
#define ROUNDED (1 + 8*EPS)         /* times the joint's angle: no wheel is beyond its joint below this     */

/* Numbers of a guard: constant, slope, weights of nu, the size of the constant's terms; and weights of the wheels' rates
 * where these are speeds of their own or go by their angles, and of the rates of heave and tilt and of these where there
 * are any. */
ALWAYS_INLINE int guard_size(const int wheels)
{
    return 6 + (SET_SLIPS || SET_CHI_FEEDS_BACK ? wheels + 6*SET_TILTS : 0);
}

/* How many numbers of the state a guard weighs: nu, and numbers of the core; where number n of them stands there, and its
 * weight in the guard. */
ALWAYS_INLINE int guarded_count(const int wheels)
{
    return SET_SLIPS ? guard_size(wheels) - 3 : 3;
}

ALWAYS_INLINE int guarded_place(const int wheels, int n)
{
    if (SET_TILTS && n >= 3 + wheels)
        return tilt_rates_at(wheels) + n - 3 - wheels;
    return rates_at(wheels) + n - 3;
}

ALWAYS_INLINE double guard_weight(const double *guard, int n)
{
    return guard[n < 3 ? 2 + n : 3 + n];
}

/* What a guard's weights of rates that go by the wheels' angles add to its rate. */
static void guard_accelerations(const step_t *s, const double *weight, nodes_t *rate)
{
    int count = 0;
    for (int i = 0; i < s->wheels; i++)
        count += weight[i] != 0;
    for (int b = 0; b < BLOCKS && count; b++) {
        lanes_t nu[3], nu_dot[3], chi[MAX_WHEELS], chi_ddot[MAX_WHEELS];
        for (int k = 0; k < 3; k++)
            nu[k] = s->at_nu[k].lanes[b], nu_dot[k] = s->rate_nu[k].lanes[b];
        for (int i = 0; i < s->wheels; i++)
            chi[i] = lanes_clamp(s->at_chi[i].lanes[b], s->joint[i]);
        accelerations_of_wheels(s->wheels, s->vehicle, nu, chi, nu_dot, 0, chi_ddot);
        for (int i = 0; i < s->wheels; i++)
            rate->lanes[b] += weight[i]*chi_ddot[i];
    }
}

/* The rate of a guard at the nodes. */
ALWAYS_INLINE nodes_t guard_rate(const step_t *s, int guard)
{
    const double *weights = s->event.guard.weights + 3*guard;
    nodes_t rate;
    if (SET_SHARES && s->event.guard.share[guard]) {
        const int bound = s->event.guard.share[guard];
        rate = times(gauss_slope, s->slip.next_share + wheel_of_share(bound));
        for (int b = 0; b < BLOCKS; b++)
            rate.lanes[b] *= (bound < 0 ? -1 : 1)/s->h;
        return rate;
    }
    for (int b = 0; b < BLOCKS; b++)
        rate.lanes[b] = s->event.guard.slope[guard] + (weights[0]*s->rate_nu[0].lanes[b] + weights[1]*s->rate_nu[1].lanes[b]
            + weights[2]*s->rate_nu[2].lanes[b]);
    if (SET_CHI_FEEDS_BACK && !SET_SLIPS)
        guard_accelerations(s, s->event.guard_rows + guard_size(s->wheels)*guard + 6, &rate);
    for (int r = 0; SET_SLIPS && r < s->event.read_count; r++) {
        const int n = s->event.reads[r];
        const double weight = guard_weight(s->event.guard_rows + guard_size(s->wheels)*guard, n);
        for (int b = 0; b < BLOCKS && n >= 3 && weight != 0; b++)
            rate.lanes[b] += weight*s->rate_core[guarded_place(s->wheels, n)].lanes[b];
    }
    return rate;
}

/* The length at which a function of the motion comes to its bound that is `value` beyond it at the step's end. Where it
 * has not risen, since the step is that short, it comes there at the end as well as anywhere else. */
ALWAYS_INLINE double reached_from(const step_t *s, double value, double rate)
{
    return rate > 0 ? s->h - value/rate : rate == 0 ? s->h : s->h/2;
}

/* An event that is reached at some length: whether it is the first one before `length`, which is that length then.
 * Where `ends_mode` the length of the step may be one. `unsure`: for how long rounding hides it. */
ALWAYS_INLINE void consider(step_t *s, double *length, int event, double reached, int ends_mode, double unsure)
{
    if (!(reached < *length || (ends_mode && reached == s->h && *length == s->h && s->event.landing < 0)))
        return;
    *length = reached;
    s->event.landing = event, s->event.unsure = unsure;
}

/* The same of a wheel that leaves its roller, or of a guard: `value` beyond its bound, which rounding has passed with
 * more than `least`. */
ALWAYS_INLINE void consider_passage(step_t *s, double *length, int event, double value, double rate, double least)
{
    if (rate > 0 || value > least)
        consider(s, length, event, rate > 0 ? s->h - value/rate : s->h/2, 0, 0);
}

static void find_bearings_late(step_t *s, const int wheels, const arrays_t *at);
static void rollers_at_rest_at_end(const step_t *s, const int wheels, const arrays_t *at);

/* The state at the end of the step, in all lanes; what sticks follows from nu. */
static point_t point_at_end(step_t *s, const int wheels, arrays_t *at)
{
    double nu[3], heading = 0;
    for (int k = 0; k < 3; k++)
        nu[k] = s->nu[k] + s->h*weighted(&s->rate_nu[k], &gauss_weight);
    for (int c = 0; c < s->core; c++)
        s->core_here[c] = lanes_of(s->start_core[c] + s->h*weighted(&s->rate_core[c], &gauss_weight));
    if (SET_HAS_HEADING)
        heading = s->acts.heading + s->h*weighted(&s->rate_pose[2], &gauss_weight);
    const point_t point = point_from(s, wheels, BLOCKS - 1, nu, s->end.chi, heading, s->h, at);
    if (SET_GRIPS) {
        for (int k = 0; s->contact.sliding && k < 2*wheels; k++)
            at->ground_push[k] = lanes_of(weighted(&s->slip.push[k], &gauss_end));
        if (SET_STANDS)
            rollers_at_rest_at_end(s, wheels, at);
        wheels_stick(s, wheels, at->nu, at->chi, s->core_here);
        if (SET_HAS_CONTACT_SPEEDS)
            rollers_stick(s, wheels, at->nu, at->chi, s->core_here);
    }
    return point;
}

/* The length at which the first guard is reached, if that is before `length`, where many guards read few numbers, as those
 * of a platform on springs do: from what these numbers move. */
ALWAYS_INLINE double length_to_many_guards(step_t *s, const int wheels, double length)
{
    double moved[MAX_GUARDED], rate[MAX_GUARDED];
    for (int r = 0; r < s->event.read_count; r++) {
        const int n = s->event.reads[r];
        const nodes_t *const rates = n < 3 ? s->rate_nu + n : s->rate_core + guarded_place(wheels, n);
        moved[r] = s->h*weighted(rates, &gauss_weight), rate[r] = weighted(rates, &gauss_end);
    }
    for (int k = 0; k < s->event.guards; k++) {
        const double *const guard = s->event.guard_rows + guard_size(wheels)*k;
        double value = s->event.guard.start[k] + s->h*guard[1], slope = guard[1];
        for (int r = 0; r < s->event.read_count; r++) {
            const double weight = guard_weight(guard, s->event.reads[r]);
            value += weight*moved[r], slope += weight*rate[r];
        }
        consider_passage(s, &length, wheels + k, value, slope, PASSED*s->event.guard.noise[k]);
    }
    return length;
}

/* The same on any ground. */
ALWAYS_INLINE double length_to_guard(step_t *s, const int wheels, double length)
{
    if (SET_TILTS)
        return length_to_many_guards(s, wheels, length);
    for (int k = 0; k < s->event.guards; k++) {
        const nodes_t rates = guard_rate(s, k);
        const double value = s->event.guard.start[k] + s->h*weighted(&rates, &gauss_weight);
        consider_passage(s, &length, wheels + k, value, weighted(&rates, &gauss_end), PASSED*s->event.guard.noise[k]);
    }
    return length;
}

#define BEARING_LANDS (2*PASSED)       /* roundings above what a bearing takes is where a step ends             */
static double length_to_bearing(step_t *s, const int wheels, double length);

static double length_to_change(step_t *s, const int wheels, double length);
NEVER_INLINE void measure_at_end(step_t *s, const int wheels);
static double length_to_use(step_t *s, const int wheels, double length);
NEVER_INLINE void look_at_contacts(step_t *s, const int wheels);

/* The length at which the first event comes, by Newton's rule from the step's end, or at most `longest`. */
ALWAYS_INLINE double length_to_event(step_t *s, const int wheels, double longest)
{
    double length = longest;
    s->event.landing = -1, s->event.unsure = 0;
    for (int i = 0; i < wheels; i++) {
        const double sign = s->end.chi[i] < 0 ? -1 : 1;
        consider_passage(s, &length, i, sign*s->end.chi[i] - s->event.edge[i], sign*s->end.rate[i], 0);
    }
    if (SET_IS_ACTED_ON)
        length = length_to_guard(s, wheels, length);
    if (SET_CORE_BEARINGS)
        length = length_to_bearing(s, wheels, length);
    if (SET_GRIPS)
        length = length_to_change(s, wheels, length);
    if (SET_HOLDS || SET_STANDS)
        length = length_to_use(s, wheels, length);
    if (SET_DECIDES)
        s->event.unsure = fmax(s->event.unsure, s->event.tick);
    return length > 0.01*s->h ? length : 0.01*s->h;
}

/* Whether the event is as near as it can be located. In a step that is short enough rounding alone moves it farther than
 * a part of the step, and the run's time knows no part of a tick. */
ALWAYS_INLINE int is_near(const step_t *s, double moved)
{
    return fabs(moved) <= fmax(s->event.reach*s->h, s->event.unsure);
}

enum { SETTLED, UNSETTLED, TOO_LONG };

/* The end of a step whose rates have settled. False: the event is not within reach after all, and comes `late`. Where all
 * contacts stick they are looked at only now: if one gives way in this step, the next sweeps look at them, too. */
ALWAYS_INLINE int end_settled(step_t *s, const int wheels, double longest)
{
    const int first_look = is_blind(s);
    if (first_look)
        s->contact.blind = 0;
    states_at_nodes(s, wheels);
    end_of_step(s, wheels);
    end_of_core(s);
    if ((SET_GRIPS || (SET_STICKS && s->hold.held)) && s->event.landing >= wheels + s->event.guards)
        measure_at_end(s, wheels);
    if (first_look) {
        look_at_contacts(s, wheels);
        s->event.late = length_to_event(s, wheels, longest) - s->h;
        return is_near(s, s->event.late) && s->event.landing < wheels + s->event.guards;
    }
    s->event.late = length_to_event(s, wheels, longest) - s->h;
    return is_near(s, s->event.late);
}

/* Whether what sticks lets go so much later than the step ends that its force there would not be the largest one to
 * rounding, since rates are not constant over that time. */
ALWAYS_INLINE int lets_go_later(const step_t *s, const int wheels)
{
    if (SET_GRIPS) {
        const int contact = s->event.landing - wheels - s->event.guards;
        return contact >= 0 && !(contact < wheels && s->contact.slides[contact])
            && fabs(s->event.late) > fmax(CLOSE*s->h, s->event.unsure);
    }
    if (SET_IN_SERIES) {  /* the spin is no number that can be set to zero there                    */
        const int bearing = s->event.landing - wheels - s->event.guards;
        return bearing >= s->hold.states->rollers_at && bearing < s->hold.count
            && fabs(s->event.late) > fmax(CLOSE*s->h, s->event.unsure);
    }
    return 0;
}

/* Whether Picard's iteration contracts so slowly that Newton's rule takes over after sweep k: early where this has cheap
 * slopes. One slow sweep alone is the step's length that has moved to an event. */
ALWAYS_INLINE int is_slow(const step_t *s, int k, double ratio, double ratio_before, double tolerance)
{
    int patience = PATIENT;
    if (SET_GRIPS) {
        if (s->contact.turning)
            patience = PATIENT_IN_TURNS;
        if (is_blind(s))
            patience = PATIENT_OF_NU;
    }
    if (k < patience)
        return s->stiff.by_axles && k >= EARLY && ratio > NOT_FAST && missed(s) <= 4*tolerance;
    return !(ratio < SLOW) && !(ratio_before < SLOW);
}

/* What a step whose contacts have not been looked at misses, with their friction; 0 where they have been. The next sweeps do
 * not look at them, unless the step is too long. */
ALWAYS_INLINE double glance_misses(step_t *s, const int wheels, double allowed)
{
    double misses = 0;
    if (SET_ROLLS && s->contact.blind) {
        s->contact.blind = 0;
        states_at_nodes(s, wheels);
        look_at_contacts(s, wheels);
        misses = missed(s);
        s->contact.blind = !(misses > allowed);
    }
    (void)s, (void)wheels, (void)allowed;
    return misses;
}

/* Whether the second sweep shows already that a step is too long: where friction bends the rates of axles. */
ALWAYS_INLINE int is_much_too_long(const step_t *s, double tolerance)
{
    if (SET_IS_ACTED_ON)
        return s->stiff.by_axles && missed(s) > MUCH_TOO_LONG*tolerance;
    return 0;
}

/* Whether a sweep shows that a step is too long: the one `long_at`, or where speeds are coupled each one from then on. */
ALWAYS_INLINE int shows_too_long(const step_t *s, int k, int long_at, double change, double tolerance)
{
    if (SET_IS_COUPLED)
        return k >= 2 && missed(s) > fmax(4*tolerance, 10*change);
    if (k == long_at)
        return missed(s) > fmax(4*tolerance, SET_LOADS_FOLLOW ? change : 0);
    return k == 1 && is_much_too_long(s, tolerance);
}

/* What the next sweeps would change after one that has changed so much, as a geometric series; the first one has no ratio. By
 * Newton's rule with slopes that turn within the step large and small ratios take turns, and the first is the guess's. */
ALWAYS_INLINE double residual_of_sweeps(int k, double change, double last, double ratio, double ratio_before)
{
    const double next = SET_IS_COUPLED ? fmax(ratio, k > 1 ? ratio_before : 1) : ratio;
    return last < INFINITY && next < 0.5 ? change*next/(1 - next) : change;
}

/* The next length of a step. Where rates have settled, and an event that has cut it is not in the rest, rounding
 * hides it there: it lies between the two. */
ALWAYS_INLINE double length_between(const step_t *s, double length, int is_settled, double *cut)
{
    if (SET_GRIPS) {
        if (is_settled && s->event.landing >= 0 && length < s->h)
            *cut = fmin(*cut, s->h);
        else if (s->event.landing < 0 && *cut < INFINITY)
            return fmax(s->h, (s->h + *cut)/2);
    }
    (void)s, (void)is_settled, (void)cut;
    return length;
}

/* Whether an iteration that contracts no more changes only what the rounding of slips that have just begun moves. */
ALWAYS_INLINE int changes_rounding(step_t *s, const int wheels, double change, double ratio, double tolerance)
{
    if (SET_GRIPS)
        return s->contact.turning && !(ratio < 0.5) && change <= tolerance && directions_are_found(s, wheels);
    return 0;
}

static void move_nodes(step_t *s, const int wheels, double length);

/* Another length of the step. What is known at the nodes goes with them once sweeps contract. */
ALWAYS_INLINE void change_length(step_t *s, const int wheels, double length, double ratio)
{
    if (SET_STANDS && SET_ROLLERS_TURN && ratio < 1)
        move_nodes(s, wheels, length);
    s->h = length;
    (void)wheels, (void)ratio;
}

/* Picard's iteration, together with the length of the step. A step that is much too long shows it early. */
ALWAYS_INLINE int settle(step_t *s, const int wheels, double longest, double tolerance, double sweep_tolerance)
{
    double last = INFINITY, ratio = INFINITY, ratio_before = INFINITY;
    double cut = INFINITY;              /* the shortest length that an event has cut, at settled rates     */
    int shifted = 0;                    /* whether the length has changed since the last sweep, as a load asks for */
    int moves = 0;                      /* how often it has been moved on to where a contact lets go      */
    int long_at = 2;                    /* the sweep after which a step that is too long shows it         */
    int stiff_since = 0;
    for (int k = 0; k < MAX_SWEEPS; k++) {
        double change = sweep(s, wheels, !(ratio < RENEW));
        if (SET_CHI_FEEDS_BACK && change < s->h*s->size*lanes_largest(s->turning_moved))
            change = s->h*s->size*lanes_largest(s->turning_moved);
        s->contact.early = k < TELL_SLIPS;
        end_of_step(s, wheels);
        const double found = length_to_event(s, wheels, longest);
        const double length = length_between(s, found, change <= sweep_tolerance, &cut), moved = length - s->h;
        ratio_before = ratio, ratio = change/last;
        if (SET_IS_ACTED_ON && !SET_IS_COUPLED && !s->stiff.on && is_slow(s, k, ratio, ratio_before, tolerance)
            && change > 100*sweep_tolerance) {                  /* it contracts slowly                          */
            s->stiff.on = 1;
            stiff_since = k, long_at = k + 2, last = INFINITY;
            continue;
        }
        double rest = residual_of_sweeps(k, change, last, ratio, ratio_before);
        if (rest > sweep_tolerance && changes_rounding(s, wheels, change, ratio, tolerance))
            rest = 0;
        if (SET_IS_ACTED_ON)
            s->rest = rest;
        if (rest <= sweep_tolerance && is_near(s, moved)) {
            const int unseen = is_blind(s), near = end_settled(s, wheels, longest);
            const int moves_on = near && moves < MAX_MOVES && lets_go_later(s, wheels);
            if (near && !moves_on)
                return SETTLED;
            moves += moves_on;
            if (unseen || moves_on) {
                s->h += s->event.late;
                last = INFINITY;
                continue;
            }
        }
        if (!(change < 1e300) || (k > 8 && change > 4*last && change > 16*sweep_tolerance))
            return UNSETTLED;
        if (SET_IS_COUPLED && k > 1 && ratio > (k > 2 ? 0.8 : 1.5) && !shifted)
            return UNSETTLED;
        if (SET_IN_SERIES)
            shifted = s->event.landing >= wheels + s->event.guards && fabs(moved) > s->event.reach*s->h;
        last = change > 0 ? change : 1e-300;
        change_length(s, wheels, length, ratio);
        if (k == long_at && glance_misses(s, wheels, 4*tolerance) > 4*tolerance)
            return TOO_LONG;
        if (shows_too_long(s, k, long_at, change, tolerance))
            return TOO_LONG;
        if (SET_IS_ACTED_ON) {
            if (s->stiff.on && k >= stiff_since + STIFF_SWEEPS)  /* Newton's rule that does not settle: the rates bend */
                return missed(s) > 4*tolerance ? TOO_LONG : UNSETTLED;
        }
    }
    return UNSETTLED;
}

/* The first turn, x in (0, 1), at which what starts at `start` with these rates is outside [low, high]; 1 if there
 * is none. */
ALWAYS_INLINE double turn_beyond(const nodes_t *rate, double end_rate, double h, double start, double low, double high)
{
    const double farthest = h*LEBESGUE*largest_of(rate);
    if (start + farthest <= high && start - farthest >= low)
        return 1;
    double from = 0, slope_from = weighted(rate, &gauss_start), area;
    if (has_one_sign(rate, slope_from, end_rate))
        return 1;
    for (int m = 0; m <= NODES; m++) {
        const double to = m < NODES ? gauss_node.node[m] : 1;
        const double slope_to = m < NODES ? rate->node[m] : end_rate;
        if ((slope_from > 0) != (slope_to > 0)) {
            double a = from, b = to, slope;
            for (int k = 0; k < 50; k++) {
                const double middle = (a + b)/2;
                legendre_value(rate, middle, &slope, &area);
                if ((slope > 0) == (slope_from > 0)) a = middle; else b = middle;
            }
            legendre_value(rate, b, &slope, &area);
            const double reached = start + h*area;
            if (reached > high || reached < low)
                return b;
        }
        from = to;
        slope_from = slope_to;
    }
    return 1;
}

/* The same of what has these values at the nodes. As a polynomial it is nowhere farther from one of them than LEBESGUE
 * times as far as the others are. */
static double turn_of_values(const nodes_t *values, double start, double low, double high)
{
    const double middle = values->node[NODES/2];
    nodes_t apart;
    IN_REGISTERS
    for (int b = 0; b < BLOCKS; b++)
        apart.lanes[b] = values->lanes[b] - middle;
    const double away = LEBESGUE*largest_of(&apart);
    if (middle + away <= high && middle - away >= low)
        return 1;
    const nodes_t rate = times(gauss_slope, values);
    return turn_beyond(&rate, weighted(&rate, &gauss_end), 1, start, low, high);
}

/* A wheel that leaves its roller inside the step and is back at its end: the x in (0, 1) at which it is outermost,
 * or 1. */
static double turn_outside(const step_t *s, int wheel)
{
    const double edge = s->joint[wheel]*ROUNDED;
    return turn_beyond(&s->rate_chi[wheel], s->end.rate[wheel], s->h, s->chi[wheel], -edge, edge);
}

/* A guard that is positive inside the step and not at its end: where it is largest, or 1. */
static double turn_of_guard(const step_t *s, int guard)
{
    const nodes_t rate = guard_rate(s, guard);
    return turn_beyond(&rate, weighted(&rate, &gauss_end), s->h, s->event.guard.start[guard],
                       -INFINITY, PASSED*s->event.guard.noise[guard]);
}
