/* A step towards the rest of a slip whose direction turns on the way: up to the rest, or near it.
 *
 * With the time to rest T - t, what the direction has still to turn goes like a power (T - t)^a, so that polynomials in
 * time converge slowly, however short a step is. Where a < 0 the slip leaves its direction: a roller that comes into
 * contact slips along the axle, where it is light, and turns at the very end of its slip. In the clock x with
 * t = T (1 - (1 - c x)^m) the rates per x have the power m (1 + a) - 1 of 1 - c x, and are polynomials where rates are
 * constant: one step of the nodes in x goes as far as many steps in time, which shrink geometrically. It leaves a part
 * (1 - c)^m of the time. Where a > 0 the clock is time itself, m = c = 1: the step ends at the rest, and the instant
 * comes out with it.
 *
 * The rates that are integrated are those per x here. The caller gets such a step as several ones, with polynomials in
 * time that miss no more than those of any step. If a try fails, or if anything else happens on the way, steps in time
 * are made as everywhere. */
#define MAKES_A_POWER 0.02          /* of 1: a is known not to be zero                                        */
#define MAX_TO_TURN 1.0             /* farther a direction does not turn in a step up to the rest              */
#define FADES_FAST 10               /* 1 + a of what fades at the start of the way, not at its end:           */
#define TRANSIENT 13                /* this part of it is followed in a step in time, since                   */
#define FAST_MISSES 1e-5            /* of what turns the slip a step up to the rest would miss this           */
#define TURNS_OVER 0.4              /* 1 + a of a slip that is just leaving its direction                      */
#define FEW_MISSES 1e-4             /* the same of what fades more slowly                                    */
#define LEAVING_POWER 5             /* m of a step that ends before                                          */
#define LEAVES_AT 0.1               /* where the direction has turned so far                                  */
#define LEAVES_LEAST 3e-4           /* of the time to rest                                                   */
#define MAX_LEAVES 0.03             /* and at most; behind more steps in time do as well                      */
#define LITTLE_SWING 0.5            /* rad that springs swing while a step ends before: Picard's iteration follows it */
#define MAX_SWING 1.0               /* and while one goes up to the rest: with more of it such steps fail           */
#define MEETS_END 0.1               /* of what a step leaves: how well it meets that                          */
#define MAX_APPROACH_SWEEPS 14
#define SURE_SWEEPS 4               /* behind these an iteration contracts, or does not settle                 */
#define CLEAR_OF_REST 1e3           /* times what is nothing of a slip: another slip is not at rest            */
#define TAKES_LESS 0.999            /* of what a contact can take, squared: it sticks                         */
#define MAX_PIECES 10
#define HALLEY 6                    /* rounds of Halley's rule                                                */

enum { NO_APPROACH, MISSES_REST, APPROACHES };

/* What turns a slip on its way to rest, in m/s. */
ALWAYS_INLINE double turns_slip(const step_t *s)
{
    return s->approach.across*s->contact.rest_in;
}

/* The power with which that fades, 1 + a, from the rates at the start of the step. */
static void find_power_of_turn(const work_t *work, step_t *s, const double *towards)
{
    const int i = s->contact.rests;
    const double rate[2] = {work->slip_dot[2*i][0], work->slip_dot[2*i + 1][0]};
    const double falls = hypot(s->slip.start[2*i], s->slip.start[2*i + 1])/s->contact.rest_in;
    s->approach.across = fabs(rate[1]*towards[0] - rate[0]*towards[1]);
    s->approach.fades = power_of_turn(s, i, towards, falls);
}

/* The power m of the clock, 0 where a step in time is better; and what part of the time the step leaves. */
static int choose_clock(step_t *s)
{
    const int i = s->contact.rests;
    const double allowed = s->contact.residual_slip[i]/TURNS_AWAY, size = hypot(s->slip.start[2*i], s->slip.start[2*i + 1]);
    const double turn = turns_slip(s)/(size*fabs(s->approach.fades - 1));
    s->approach.leaves = 0;
    if (s->approach.fades > TURNS_OVER && s->approach.fades < FADES_FAST && FEW_MISSES*turns_slip(s) < allowed)
        return 1;
    if (s->approach.fades < 1 - MAKES_A_POWER) {
        s->approach.leaves = fmax(pow(turn/LEAVES_AT, 1/(1 - s->approach.fades)), LEAVES_LEAST);
        return s->approach.leaves < MAX_LEAVES && fastest_swing(s)*s->contact.rest_in < LITTLE_SWING ? LEAVING_POWER : 0;
    }
    if (!(s->approach.fades > 1 + MAKES_A_POWER) || !(turn < MAX_TO_TURN))
        return 0;
    if (s->approach.fades > FADES_FAST && FAST_MISSES*turns_slip(s) > allowed)
        return 0;
    return 1;
}

static void set_clock(step_t *s, int power)
{
    s->approach.stretched = power, s->acts.length = 0;
    s->approach.part = 1 - pow(s->approach.leaves, 1.0/power);
    for (int m = 0; m < NODES; m++) {
        const double remainder = 1 - s->approach.part*gauss_node.node[m];
        double before = 1;
        for (int k = 1; k < power; k++)
            before *= remainder;
        s->approach.clock.node[m] = (1 - before*remainder)/(1 - s->approach.leaves);
        s->approach.stretch.node[m] = power*s->approach.part*before/(1 - s->approach.leaves);
    }
    for (int k = 0; k < 3; k++)
        stretch_nodes(s, s->rate_nu + k);
    for (int c = 0; c < s->core; c++)
        stretch_nodes(s, s->rate_core + c);
}

/* The time from the end of the step to the rest; not a number where the slip does not come to it. */
static double remaining_time(const step_t *s)
{
    double along = 0, rate = 0;
    for (int k = 2*s->contact.rests; k < 2*s->contact.rests + 2; k++) {
        const double toward = s->slip.toward[k].node[NODES - 1];
        along += toward*s->slip.end[k], rate += toward*s->slip.rate[k].node[NODES - 1];
    }
    return rate < -s->contact.settles ? -along/rate : NAN;
}

/* The rates at the nodes, and the length of the step with them. Returns whether they have been found. */
static int settle_approach(step_t *s, const int wheels, double tolerance, double sweep_tolerance)
{
    double last = INFINITY;
    for (int k = 0; k < MAX_APPROACH_SWEEPS; k++) {
        const double change = sweep(s, wheels, 0), ratio = change/last;
        end_of_step(s, wheels);
        slips_at_end(s, wheels);
        const double late = remaining_time(s) - s->approach.leaves*s->h;
        const double slip = hypot(s->slip.end[2*s->contact.rests], s->slip.end[2*s->contact.rests + 1]);
        const int meets = s->approach.leaves > 0 ? fabs(late) <= MEETS_END*s->approach.leaves*s->h
                                                 : slip <= s->contact.residual_slip[s->contact.rests];
        s->rest = k > 0 && ratio < 0.5 ? change*ratio/(1 - ratio) : change;    /* one sweep says nothing of the next */
        if (s->rest <= sweep_tolerance && (meets || fabs(late) <= EPS*s->h))
            return meets && missed(s) <= tolerance;
        if (!(late > -0.5*s->h && late < s->h) || (k > SURE_SWEEPS && !(ratio < 1)))
            return 0;
        if (k%3 == 2 && missed(s) > fmax(4*tolerance, 10*change))       /* it takes long: at each third sweep   */
            return 0;
        last = fmax(change, 1e-300);
        s->h += meets && s->approach.leaves > 0 ? 0 : late;
    }
    return 0;
}

/* Whether nothing else happens: no wheel comes to its joint, no guard is passed, what sticks sticks, what slips slips,
 * what turns turns. */
static int nothing_else_happens(const step_t *s, const int wheels)
{
    for (int k = 0; k < s->event.guards; k++) {
        const nodes_t rate = guard_rate(s, k);
        if (s->event.guard.start[k] + s->h*weighted(&rate, &gauss_weight) > 0 || turn_of_guard(s, k) < 1)
            return 0;
    }
    for (int k = 0; SET_CORE_BEARINGS && k < s->hold.count; k++)
        if (!ends_no_step(s, k) && (bearing_at_end(s, k) > 0 || turn_of_bearing(s, k) < 1))
            return 0;
    for (int i = 0; i < wheels; i++) {
        const double rate = s->rate_chi[i].node[NODES - 1], joint = s->joint[i];
        if (!(fabs(s->end.chi[i]) < joint) || turn_beyond(&s->rate_chi[i], rate, s->h, s->chi[i], -joint, joint) < 1)
            return 0;
        if (s->contact.grips[i] && !(weighted(&s->slip.excess[i], &gauss_end) < TAKES_LESS - 1))
            return 0;
        const double *const slip = s->slip.end + 2*i;
        const double along = s->slip.toward[2*i].node[NODES - 1]*slip[0] + s->slip.toward[2*i + 1].node[NODES - 1]*slip[1];
        if (s->contact.slides[i] && (i != s->contact.rests || s->approach.leaves > 0)
            && !(along > CLEAR_OF_REST*s->contact.residual_slip[i]))
            return 0;
    }
    return !(turn_of_contacts(s, wheels) < 1);
}

/* Whether a step from here may be one towards a rest, of at most the length `longest`. No bearing may stick: rows inside
 * the step would have to say what holds it. */
static int may_approach(const omniroll_run_t *run, const step_t *s, double longest)
{
    int prevented = 0;
    for (int i = 0; i < run->wheels; i++)
        prevented |= s->contact.keeps[i];
    for (int k = 0; k < s->event.guards; k++)       /* which goes with time, and the clock is another                */
        prevented |= s->event.guard.slope[k] != 0;
    return s->contact.turning && s->contact.rest_in <= longest && !prevented && !s->stiff.on
        && !some_bearing_sticks(run) && run->record.row_count + MAX_PIECES <= run->record.row_capacity;
}

/* A step towards the first rest, if there is one from here: of at most the length `longest`. in_time: that of a step in
 * time, which may become less. */
static int approach_rest(omniroll_run_t *run, const work_t *work, step_t *s, const int wheels, double longest,
                         double *in_time, double size, double sweep_tolerance)
{
    if (!may_approach(run, s, longest))
        return NO_APPROACH;
    find_power_of_turn(work, s, run->ground.grips[s->contact.rests].towards);
    const int power = choose_clock(s);
    if (power == 0) {
        const double transient = s->approach.fades > FADES_FAST ? TRANSIENT*s->contact.rest_in/s->approach.fades : INFINITY;
        const int shortens = transient < *in_time;
        *in_time = fmin(*in_time, transient);
        return shortens ? MISSES_REST : NO_APPROACH;
    }
    if (fastest_swing(s)*s->contact.rest_in > MAX_SWING)
        return NO_APPROACH;
    set_clock(s, power);
    s->h = s->contact.rest_in*(1 - s->approach.leaves);
    s->event.landing = s->approach.leaves > 0 ? -1 : wheels + s->event.guards + s->contact.rests, s->event.late = 0;
    if (settle_approach(s, wheels, size*run->task.tolerance, sweep_tolerance) && s->h <= longest) {
        states_at_nodes(s, wheels);
        end_of_step(s, wheels);
        end_of_core(s);
        integrate_pose(s, run->state.pose);
        if (nothing_else_happens(s, wheels)) {
            if (SET_ACCOUNTS)
                accounts_at_nodes(s, wheels);
            run->record.step_error = fmax(run->record.step_error, missed(s)/size);
            run->record.sweep_error += s->rest/size;
            return APPROACHES;
        }
    }
    run->record.rejected_count++;
    s->approach.stretched = 0, s->acts.length = 0;
    return MISSES_REST;
}

/* The length of steps from before the way to rest stands again behind it. */
static void keep_step_behind(omniroll_run_t *run, const step_t *s, double calm)
{
    run->past.step = fmax(calm, run->past.calm_step), run->past.rest_error = 0;
    run->past.calm_step = s->approach.leaves > 0 ? run->past.step : 0;
}

/* A piece of such a step. Columns of `values` make the rates in time at the nodes of the piece from the Legendre
 * coefficients of those in the clock; `area` makes their integral up to its end. */
typedef struct {
    double from, to;                /* times over h                                                          */
    nodes_t values[NODES];
    double area[NODES];
} piece_t;

/* The roots of numbers from 1e-10 to 1 in LEAVING_POWER: Halley's rule from fourth roots. */
static lanes_t roots_in_clock(lanes_t number)
{
    lanes_t root = lanes_sqrt(lanes_sqrt(number));
    for (int k = 0; k < HALLEY; k++) {
        const lanes_t reached = root*root*root*root*root;
        root *= (2*reached + 3*number)/(3*reached + 2*number);
    }
    return root;
}

/* The piece between two remainders of the time to rest. */
static void set_piece(const step_t *s, double before, double after, piece_t *piece)
{
    const double clocked = LEAVING_POWER*s->approach.part/(1 - s->approach.leaves);
    nodes_t z;
    piece->from = (1 - before)/(1 - s->approach.leaves), piece->to = (1 - after)/(1 - s->approach.leaves);
    for (int b = 0; b < BLOCKS; b++) {
        const lanes_t remainder = before - (before - after)*gauss_node.lanes[b];
        const lanes_t base = roots_in_clock(remainder);
        z.lanes[b] = 2*(1 - base)/s->approach.part - 1;
        piece->values[0].lanes[b] = base/(clocked*remainder);
        piece->values[1].lanes[b] = z.lanes[b]*piece->values[0].lanes[b];
    }
    for (int k = 1; k < NODES - 1; k++)
        for (int b = 0; b < BLOCKS; b++)
            piece->values[k + 1].lanes[b] = ((2*k + 1)*z.lanes[b]*piece->values[k].lanes[b]
                - k*piece->values[k - 1].lanes[b])/(k + 1);
    legendre_areas((1 - roots_in_clock(lanes_of(after))[0])/s->approach.part, piece->area);
}

/* Pieces of which polynomials in time miss no more than those of steps may; returns how many. */
static int divide_approach(const step_t *s, piece_t *pieces)
{
    const double allowed = s->contact.residual_slip[s->contact.rests]/TURNS_AWAY;
    double remainder = 1;
    int count = 0;
    while (count < MAX_PIECES - 1) {
        const double turns = turns_slip(s)*pow(remainder, s->approach.fades);
        double after = remainder*remainder_before_rest(turns/(2*NODES*allowed));
        if (turns <= allowed || after <= s->approach.leaves)
            break;
        if (after < 2*s->approach.leaves)   /* two of one ratio, not a long one and a short one                  */
            after = sqrt(remainder*s->approach.leaves);
        set_piece(s, remainder, after, pieces + count++);
        remainder = after;
    }
    set_piece(s, remainder, s->approach.leaves, pieces + count++);
    return count;
}

/* A row inside a step that starts at the last row, but for what is integrated. part: of its length. */
static void begin_row(const omniroll_run_t *run, const step_t *s, double part, double *row)
{
    const int inputs = SET_INPUTS*run->wheels;
    const long long size = row_size(run);
    memcpy(row, run->record.rows + size*(run->record.row_count - 1), size*sizeof *row);
    row[0] = run->state.elapsed + (run->state.carry + s->h*part);
    for (int k = 0; k < inputs; k++)
        row[size - inputs + k] += run->acts.inputs[inputs + k]*s->h*part;
}

/* The step as several ones, and the rows between them. */
static void put_pieces(omniroll_run_t *run, const step_t *s)
{
    piece_t pieces[MAX_PIECES];
    const int count = divide_approach(s, pieces);
    const long long width = row_size(run), step_width = step_size(run);
    double *const rows = run->record.rows + width*(run->record.row_count - 1);
    double *const steps = run->record.steps ? run->record.steps + step_width*(run->record.row_count - 1) : 0;
    for (int k = 0; k < count; k++) {
        if (k < count - 1)
            begin_row(run, s, pieces[k].to, rows + (k + 1)*width);
        if (steps)
            steps[k*step_width] = s->h*(pieces[k].to - pieces[k].from), steps[k*step_width + 1] = 0;
    }
    for (int c = 0; c < integrated_size(run); c++) {
        const nodes_t coefficients = times(gauss_legendre, rate_in_step(run, s, c));
        for (int k = 0; k < count - 1; k++) {
            double area = 0;
            for (int m = 0; m < NODES; m++)
                area += pieces[k].area[m]*coefficients.node[m];
            rows[(k + 1)*width + 1 + c] = rows[1 + c] + s->h*area;
        }
        for (int k = 0; k < count && steps; k++) {
            const nodes_t rate = times(pieces[k].values, &coefficients), in_time = times(gauss_legendre, &rate);
            memcpy(steps + k*step_width + 2 + NODES*c, in_time.node, sizeof in_time);
        }
    }
    run->record.row_count += count - 1;
}

/* Whether there is room for the rows of the next step. A call that begins at the row `first` with little more than that
 * makes steps in time. */
static int has_room(const omniroll_run_t *run, long long first)
{
    long long rows = 1;
    if (SET_APPROACHES && run->record.row_capacity - first > MAX_PIECES + 1)
        rows = MAX_PIECES;
    (void)first;
    return run->record.row_count + rows <= run->record.row_capacity;
}
