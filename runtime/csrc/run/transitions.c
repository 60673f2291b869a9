/* Transitions: what happens at an instant. The contact passes on (the rules of runtime/omniroll/engine/switching.py), a
 * guard is passed. */

#define CHATTER 1e-6                /* of pi/n: where no wheel turns by more, switches are no progress       */
#define AT_LEAVING (1 - 4*EPS)      /* of pi/n: where a wheel goes on from its joint, where what pushes it begins at nothing */
#define SLOW_WHEEL 1e-6             /* of the fastest wheel's speed: only slower ones may be at rest              */

/* What a wheel does at its joint beside passing on; one that creeps goes on without having stopped. */
enum { STAYS = 0, STOPS = 1, GOES = -1, CREEPS = 2 };

/* The switching law, rules 4 to 7. directions: +1, -1, or 0 for a wheel that does not switch. */

/* The free rollers of a wheel change places: the leaving roller gets its place, the entering one loses it. */
static double exchange_places(double *axial, int places, int direction, double leaving)
{
    const int entering_place = direction > 0 ? places - 1 : 0;
    const double entering = axial[entering_place];
    if (direction > 0)
        for (int j = places - 1; j > 0; j--) axial[j] = axial[j - 1];
    else
        for (int j = 0; j < places - 1; j++) axial[j] = axial[j + 1];
    axial[places - 1 - entering_place] = leaving;
    return entering;
}

/* Where wheels may slip, no speed changes: the entering roller comes with the axial speed that it has (rule 10). */
static void exchange_rollers(omniroll_run_t *run, const work_t *work, const int *directions, const int *changes)
{
    const int places = run->rollers_per_wheel - 1;
    double *const contact = run->state.core + contact_speeds_at(run->wheels);
    int rested[MAX_WHEELS];
    if (SET_HAS_CONTACT_SPEEDS)
        update_axial(run, work);
    for (int i = 0; i < run->wheels; i++)
        if (SET_HAS_CONTACT_SPEEDS && directions[i])
            contact[i] = exchange_places(run->state.axial + i*places, run->rollers[i] - 1, directions[i], contact[i]);
    begin_core(run, work);
    if (SET_HAS_MOMENTA && SET_GRIPS)   /* decisions at this instant ask for them                   */
        wheel_momenta(run, work);
    if (SET_STANDS && SET_DISKS_STICK)
        contacts_that_rest_with_rollers(run, rested);
    if (SET_DISKS_STICK)
        rollers_have_switched(run, directions);
    else if (SET_IN_SERIES)
        stop_those_that_switch(run, work, directions);
    if (SET_AXLES_STICK || SET_ROLLERS_TURN)
        axles_have_switched(run);
    if (SET_GRIPS)
        contacts_have_switched(run, changes);
    if (SET_STANDS && SET_DISKS_STICK)
        keep_contacts_at_rest(run, rested);
}

/* A change of what carries: nu, the wheels' angles before and after it, their rates beyond those demanded after it, and the
 * speeds of rollers in contact before it: axial speeds of free ones, spins of others. */
typedef struct {
    lanes_t nu[3], before[MAX_WHEELS], after[MAX_WHEELS], excess[MAX_WHEELS], speeds[MAX_WHEELS];
} change_t;

/* What rollers in contact have at nu and these angles. */
static void speeds_of_contacts(const omniroll_run_t *run, const work_t *work, const lanes_t *nu, const lanes_t *chi,
                               lanes_t *speeds)
{
    lanes_t chi_dot[MAX_WHEELS];
    if (SET_HAS_MOMENTA)
        set_contact_axial(run->wheels, &work->vehicle, nu, chi, speeds);
    else
        set_wheel_rates(run->wheels, &work->vehicle, nu, chi, chi_dot, speeds);
}

/* The impact of the rollers that enter on those that leave, and of wheels whose rate changes, where the law of the run is
 * that; else rollers go where they go alone. A wheel that passes on to another arc of its roller keeps this one, and so does
 * one that stops at its joint or goes on; an axial speed has the wheel's rate in it. leaves: whether its roller does. */
static void meet_rollers(omniroll_run_t *run, const work_t *work, const int *directions, const int *stance,
                         const int *leaves, const change_t *c)
{
    const int wheels = run->wheels, others = run->rollers_per_wheel - 1;
    lanes_t entering[MAX_WHEELS], leaving[MAX_WHEELS], demanded[MAX_WHEELS], nu_after[3];
    speeds_of_contacts(run, work, c->nu, c->after, demanded);
    for (int i = 0; i < wheels; i++) {
        const double speed = c->speeds[i][0];
        const int keeps = SET_CHI_FEEDS_BACK && SET_HAS_MOMENTA && stance[i] && !directions[i];
        double came_with = speed, stopped = 0;
        if (leaves[i] && SET_HAS_MOMENTA)
            came_with = exchange_places(run->state.axial + i*others, run->rollers[i] - 1, directions[i], speed);
        else if (leaves[i])
            came_with = 0, stopped = speed;
        entering[i] = lanes_of(directions[i] || keeps ? came_with - demanded[i][0] : 0);
        leaving[i] = lanes_of(stopped);
    }
    if (run->task.impact) {
        set_impact(wheels, &work->vehicle, c->nu, c->after, entering, leaving, c->excess, nu_after);
        for (int k = 0; k < 3; k++)
            run->state.nu[k] = nu_after[k][0];
    }
    if (SET_CORE_PARTS)
        begin_core(run, work);
}

static void change_rows(omniroll_run_t *run, const work_t *work, const int *directions, const int *stance, change_t *c);
static void stop_or_go(omniroll_run_t *run, int wheel, int stance);
static void rest_where_they_creep(omniroll_run_t *run, const work_t *work, const int *stance);

/* stance: where wheels may stand on their joint, what they do there. leaves: out, whether a wheel's roller leaves it. */
static void apply_switch(omniroll_run_t *run, const work_t *work, const int *directions, const int *stance, int *leaves)
{
    const int wheels = run->wheels;
    int changes[MAX_WHEELS];        /* of what carries                                                         */
    change_t c;
    if (SET_CORE_PARTS && !SET_SLIPS)
        update_axial(run, work);
    state_in_lanes(run, c.nu, c.before);
    for (int i = 0; i < wheels; i++) {
        if (SET_SHARES)
            stop_or_go(run, i, stance[i]);
        leaves[i] = directions[i] && pass_on(run, i, directions[i]);
        changes[i] = directions[i] || (SET_PIVOTS && stance[i]);
        if (SET_PIVOTS && stance[i] && !directions[i])
            run->state.chi[i] = copysign(run->joint[i], run->state.chi[i]);
        if (SET_SHARES && (stance[i] == GOES || stance[i] == CREEPS))
            run->state.chi[i] *= AT_LEAVING;
        c.after[i] = lanes_of(run->state.chi[i]);
    }
    if (SET_HAS_IMPACT && !SET_SLIPS)
        speeds_of_contacts(run, work, c.nu, c.before, c.speeds);
    if (SET_CARRIES)
        change_rows(run, work, directions, stance, &c);
    if (SET_SLIPS)
        exchange_rollers(run, work, directions, changes);
    else if (SET_HAS_IMPACT)
        meet_rollers(run, work, directions, stance, leaves, &c);
    if (SET_SHARES && SET_GRIPS)
        rest_where_they_creep(run, work, stance);
    const double nu_before[3] = {c.nu[0][0], c.nu[1][0], c.nu[2][0]};
    if (SET_HOLDS)
        bearings_have_jumped(run, nu_before);
}

/* Located times closer than this are one switch (rule 5). */
static double tau(const omniroll_run_t *run, double phase_length)
{
    return 100*EPS*(fabs(run->task.start_time + run->state.elapsed) + fabs(phase_length));
}

/* The second derivatives of chi. */
static void wheel_accelerations(const omniroll_run_t *run, const work_t *work, lanes_t *chi_ddot)
{
    lanes_t nu_dot[3];
    if (SET_HAS_MOMENTA)
        wheel_momenta(run, work);
    rates_at_this_instant(run, work, run->wheels, nu_dot);
    accelerations_now(run, work, nu_dot, chi_ddot);
}

/* Whether the run is at its end. A pause is none: a later call goes on as if it had not been. */
static int is_over(const omniroll_run_t *run)
{
    return run->state.elapsed >= run->task.duration && !run->task.pauses;
}

/* The speed of each wheel, or where it rests at its joint its acceleration. It rests where its speed would carry it over
 * less than the rounding of its angle: without this an impact that sends a wheel back again and again, in less and less
 * time, would have no last one. */
static void speeds_or_accelerations(const omniroll_run_t *run, const work_t *work, double *rates)
{
    lanes_t chi_dot[MAX_WHEELS], chi_ddot[MAX_WHEELS];
    double fastest = 0;
    int slow[MAX_WHEELS], count = 0;
    wheel_rates_now(run, work, chi_dot);
    for (int i = 0; i < run->wheels; i++) {
        rates[i] = rests(run, i) || pivots(run, i) ? 0 : chi_dot[i][0];
        fastest = fmax(fastest, fabs(rates[i]));
    }
    for (int i = 0; i < run->wheels; i++)
        count += slow[i] = fabs(rates[i]) <= SLOW_WHEEL*fastest && fabs(run->state.chi[i]) >= run->joint[i];
    if (!count)
        return;
    wheel_accelerations(run, work, chi_ddot);
    for (int i = 0; i < run->wheels; i++)
        if (slow[i] && !sticks(run, i) && rates[i]*rates[i] < 2*EPS*run->joint[i]*fabs(chi_ddot[i][0]))
            rates[i] = chi_ddot[i][0];
}

/* Rule 3: the wheels that stand at their joint and move outwards, or rest there and will; with those whose joint is
 * closer in time than tau (rule 5), be it to a switch or to another event. Returns how many. */
static int switching_wheels(omniroll_run_t *run, const work_t *work, double phase_length, int *directions)
{
    double rates[MAX_WHEELS];
    const int at_end = (is_over(run) || run->past.at_event) && phase_length > 0;
    const double together = tau(run, phase_length);
    int at_joint = 0, count = 0;
    settle_modes(run, work);
    speeds_or_accelerations(run, work, rates);
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < run->wheels; i++) {
            const int sign = run->state.chi[i] < 0 ? -1 : 1;
            const double gap = run->joint[i] - sign*run->state.chi[i], rate = sign*rates[i];
            if (pass == 0)
                at_joint += rate > 0 && gap <= (at_end ? together*rate : 0);
            else {
                directions[i] = at_joint > 0 && rate > 0 && gap <= together*rate ? sign : 0;
                count += directions[i] != 0;
            }
        }
    return count;
}

/* The watchdog: false where patience with transitions without progress is at its end. Progress takes time, and at a
 * switch also that some wheel has turned: one that a force holds at its joint goes to and fro there, in less and
 * less time. */
static int has_progress(omniroll_run_t *run, int at_guard)
{
    const int moved = !SET_IS_ACTED_ON || at_guard || run->past.turned > CHATTER*run->joint[0];
    if (moved && run->state.elapsed - run->past.anchor > tau(run, run->state.elapsed - run->past.anchor)) {
        run->past.anchor = run->state.elapsed;
        run->past.idle_switches = 0;
        run->past.turned = 0;
    }
    run->record.phase_count++;
    return ++run->past.idle_switches <= run->task.patience;
}

/* A guard's value at this instant, and what counts as its rounding. */
static double guard_value(const omniroll_run_t *run, const double *guard, double *noise)
{
    const double moved = guard[1]*since_inputs(run);
    double value = guard[0] + moved, sizes = guard[5] + fabs(moved);
    for (int k = 0; k < 3; k++) {
        value += guard[2 + k]*run->state.nu[k];
        sizes += fabs(guard[2 + k]*run->state.nu[k]);
    }
    for (int n = 3; n < guarded_count(run->wheels); n++) {
        const double of_core = guard_weight(guard, n)*run->state.core[guarded_place(run->wheels, n)];
        value += of_core;
        sizes += fabs(of_core);
    }
    for (int i = 0; SET_CHI_FEEDS_BACK && !SET_SLIPS && i < run->wheels; i++) {
        const double of_wheel = guard[6 + i] ? guard[6 + i]*rate_by(run->wheel_rows + 3*i, run->state.nu) : 0;
        value += of_wheel;
        sizes += fabs(of_wheel);
    }
    *noise = EPS*sizes;
    return value;
}

static void guard_pivots(omniroll_run_t *run, const work_t *work);
static int share_has_ended(const omniroll_run_t *run, int guard);

/* Which guards are passed now: those beyond their rounding, and those that are on it, or closer in time than tau to it,
 * and rise. Returns how many there are of the effects. */
static int guards_passed(omniroll_run_t *run, const work_t *work)
{
    if (SET_PIVOTS && !SET_SHARES)
        guard_pivots(run, work);
    const double together = run->past.at_event ? tau(run, run->state.elapsed - run->past.phase_start) : 0;
    int count = 0, near = run->past.at_event;
    double noise;
    for (int k = 0; k < all_guards(run); k++) {
        near |= SET_SHARES && share_has_ended(run, k);
        near |= guard_value(run, run->acts.guards + guard_size(run->wheels)*k, &noise) >= -LANDED*noise;
        run->acts.passed[k] = 0;
    }
    if (!near)
        return 0;
    lanes_t nu_dot[3], chi_ddot[MAX_WHEELS];
    rates_at_this_instant(run, work, run->wheels, nu_dot);
    if (SET_CHI_FEEDS_BACK && !SET_SLIPS)
        accelerations_now(run, work, nu_dot, chi_ddot);
    for (int k = 0; k < all_guards(run); k++) {
        const double *const guard = run->acts.guards + guard_size(run->wheels)*k;
        const double value = guard_value(run, guard, &noise);
        double rate = guard[1] + guard[2]*nu_dot[0][0] + guard[3]*nu_dot[1][0] + guard[4]*nu_dot[2][0];
        for (int n = 3; n < guarded_count(run->wheels); n++)
            rate += guard_weight(guard, n)*work->core_dot[guarded_place(run->wheels, n)][0];
        for (int i = 0; SET_CHI_FEEDS_BACK && !SET_SLIPS && i < run->wheels; i++)
            rate += guard[6 + i]*chi_ddot[i][0];
        run->acts.passed[k] = value > PASSED*noise || (rate > 0 && value >= -(LANDED*noise + together*rate))
            || (SET_SHARES && share_has_ended(run, k));
        count += k < run->acts.guard_count && run->acts.passed[k];
    }
    return count;
}

static int changing_wheels(omniroll_run_t *run, const work_t *work, int *directions, int *stance);
static void renew_inputs(omniroll_run_t *run);

/* What rows of switches show of a wheel that passes on to nothing: 2 where it stops at its joint, -2 where it goes on. */
ALWAYS_INLINE int shown_stance(int stance)
{
    return stance == STAYS ? 0 : stance == STOPS ? 2 : -2;
}

/* Rule 9: switches at the same instant follow each other until no wheel moves outwards at its joint. Returns a
 * status. */
static int switch_all(omniroll_run_t *run, const work_t *work)
{
    omniroll_record_t *const record = &run->record;
    int directions[MAX_WHEELS], stance[MAX_WHEELS], leaves[MAX_WHEELS];
    while (changing_wheels(run, work, directions, stance)) {
        if (record->switch_count == record->switch_capacity || record->row_count == record->row_capacity)
            return OMNIROLL_RUN_FULL;
        if (!has_progress(run, 0))
            return OMNIROLL_RUN_STUCK;
        apply_switch(run, work, directions, stance, leaves);
        if (SET_PIVOTS && run->acts.modal_count)
            renew_inputs(run);                  /* guards of drives read the wheels' rates                  */
        settle_modes(run, work);
        run->past.phase_start = run->state.elapsed;
        double *out = record->switches + (2 + run->wheels)*record->switch_count;
        *out++ = run->state.elapsed;
        *out++ = (double)record->row_count;
        for (int i = 0; i < run->wheels; i++)
            *out++ = leaves[i] ? directions[i] : directions[i] ? 3*directions[i] : SET_PIVOTS ? shown_stance(stance[i]) : 0;
        const long long size = (long long)run->wheels*(run->rollers_per_wheel - 1);
        for (long long k = 0; SET_HAS_MOMENTA && k < size; k++)
            record->switch_axial[record->switch_count*size + k] = run->state.axial[k];
        record->switch_count++;
        put_row_after(run);
    }
    return OMNIROLL_RUN_DONE;
}
