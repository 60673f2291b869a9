/* Which elements stick from now on: one decision for every set; and bearings that stick, as the rest of the engine asks for
 * them, of wheels that roll, or that may slip. */

/* A run begins: nothing sticks so far, in a set that has such bearings and for a run that has none. */
static void clear_bearings(const omniroll_run_t *run, const work_t *work)
{
    if (SET_HOLDS)
        work->standing->count = 0;
    for (int k = 0; k < max_core_bearings(run->wheels, run->rollers_per_wheel); k++)
        work->states.sticks[k] = work->states.torque[k] = lanes_of(0);
    if (SET_IN_SERIES)
        stop_all_in_series(run, work);
}

/* ---- the decision ----------------------------------------------------------------------------------------------- */

/* What is zero within rounding by the state rests, and sticks so far. Returns whether anything does. */
static int put_at_rest(omniroll_run_t *run, const work_t *work)
{
    int resting = 0;
    if (SET_HOLDS)
        put_to_rest(run, work);
    else if (stands_somewhere(run))
        put_all_to_rest(run, work);
    else {
        if (SET_STICKS)
            rest_bearings(run, work, INFINITY);
        if (SET_GRIPS)
            find_loads(run, work), find_resting_contacts(run, work);
    }
    for (int i = 0; SET_GRIPS && i < run->wheels; i++)
        resting |= run->ground.grips[i].sticks = run->ground.grips[i].resting;
    if (SET_IN_SERIES && !SET_GRIPS)        /* before the axles: the ground's force across rollers depends on their modes */
        enter_bearings(run, work, 1), decide_in_series(run, work);
    for (int k = 0; k < run->bearings.count; k++)
        resting |= run->bearings.each[k].resting;
    return resting;
}

/* Whether the mode of something that rests has just ended. */
static int some_mode_has_ended(const omniroll_run_t *run, const work_t *work)
{
    int ended = 0;
    for (int i = 0; SET_GRIPS && i < run->wheels; i++)
        ended |= run->ground.grips[i].resting && run->ground.grips[i].released;
    for (int k = 0; k < (SET_STANDS ? run->bearings.count : count_deciding(run, work)); k++)
        ended |= (SET_STANDS || run->bearings.each[k].resting) && run->bearings.each[k].released;
    return ended;
}

/* The modes into what the kernel reads, and what of nu they allow. */
static void enter_modes(omniroll_run_t *run, const work_t *work)
{
    if (SET_HOLDS)
        hold(run, work);
    else if (SET_STANDS)
        stand(run, work);
    else if (SET_GRIPS)
        put_modes(run);
    else
        enter_bearings(run, work, 1);
}

/* Contacts that stick under more than they can take. `mark`: what becomes of these. Returns how many there are. */
static int overloaded_contacts(const omniroll_run_t *run, const work_t *work, int mark)
{
    int count = 0;
    for (int i = 0; SET_GRIPS && i < run->wheels; i++) {
        const double excess = run->ground.grips[i].sticks ? excess_now(run, work, i) : -1;
        if (!(excess > GRIP_PASSED*GRIP_NOISE(excess)))
            continue;
        run->ground.grips[i].released |= mark;
        count++;
    }
    return count;
}

/* The same of bearings by themselves; those that are let go have broken away. */
static int overloaded_bearings(const omniroll_run_t *run, const work_t *work, int let_go)
{
    int count = 0;
    for (int k = rows_count(run); k < run->bearings.count; k++) {
        omniroll_bearing_t *const bearing = run->bearings.each + k;
        if ((SET_STANDS && work->standing->has_part[k]) || !is_beyond_bound(bearing))
            continue;
        if (let_go)
            bearing->released = bearing->torque > 0 ? -1 : 1;
        count++;
    }
    return count;
}

/* Whether the demand on what sticks is more than it takes, as find_holding() found it. `let_go`: that has broken away. */
static int is_overloaded(omniroll_run_t *run, const work_t *work, int let_go)
{
    demand_t now;
    int count = overloaded_contacts(run, work, let_go ? HAS_ENDED : IS_BEYOND);
    if (SET_CORE_BEARINGS)
        count += overloaded_bearings(run, work, let_go);
    if ((SET_HOLDS || SET_STANDS) && work->standing->count) {
        demand_now(run, work, &now);
        count += release_where_used(run, work, &now, SET_STANDS ? PASSED : 1.0*PASSED/USE_ROUNDINGS, let_go);
    }
    return count || (stands_somewhere(run) && hold_what_falls_back(run, work));
}

/* Which of what rests sticks. So far all does, which is decided anew where a mode has just ended, or where the demand on
 * something is more than it takes, be it by that decision: what has broken away takes less. */
static void decide_modes(omniroll_run_t *run, const work_t *work)
{
    int again = some_mode_has_ended(run, work);
    if (SET_HAS_MOMENTA && !SET_GRIPS)
        wheel_momenta(run, work);
    if (SET_HOLDS)
        begin_deciding_rolling(run, work);
    enter_modes(run, work);
    if (SET_GRIPS && again)
        let_go_together(run, work);
    else if (!again) {
        find_holding(run, work);
        again = is_overloaded(run, work, stands_somewhere(run));
    }
    for (int round = 0; again && round <= run->bearings.count + run->ground.grip_count; round++) {
        decide_at_rest(run, work);
        enter_modes(run, work);
        find_holding(run, work);
        again = is_overloaded(run, work, 1);
    }
}

/* Nothing rests. */
static void move_all(omniroll_run_t *run, const work_t *work)
{
    if (SET_HOLDS) {
        work->standing->count = 0;
        turn_bearings(run, work);
    } else
        enter_modes(run, work);
}

/* The phase begins in these modes: torques, what they are rounded against, guards. */
static void begin_modes(omniroll_run_t *run, const work_t *work)
{
    demand_t now;
    if (SET_HOLDS) {
        guard_rates(run, work);
        find_torques(run, work);
    } else if (SET_STANDS) {
        if (work->standing->count)
            demand_now(run, work, &now);
        find_all_torques(run, work, &now, 0);
        size_all(run, work);
    } else if (SET_STICKS) {
        if (SET_IN_SERIES)
            find_bearing_rates(run, work);
        begin_torques(run, work);
    }
    for (int i = 0; SET_GRIPS && i < run->wheels; i++)
        run->ground.grips[i].released = run->ground.grips[i].released == HAS_ENDED;
    run->hold.undecided = run->ground.undecided = 0;
}

/* Which elements stick from now on, where that must be decided anew. */
static void settle_modes(omniroll_run_t *run, const work_t *work)
{
    if ((SET_STICKS && run->bearings.count && run->hold.undecided) || (SET_GRIPS && run->ground.undecided)) {
        const int resting = put_at_rest(run, work);
        if (SET_HOLDS) {
            find_nearer(run, work);
            run->hold = (omniroll_hold_t){.speed = run->hold.speed};
        }
        if (resting)
            decide_modes(run, work);
        else
            move_all(run, work);
        begin_modes(run, work);
        run->ground.knows_rates = SET_GRIPS && resting && !some_slide(run);
    }
    if (SET_HOLDS)
        run->hold.speed = fmax(run->hold.speed, length3(run->state.nu));
}

/* ---- what the rest of the engine asks for ----------------------------------------------------------------------- */

/* Bearings of wheels that roll rest whose rates have passed zero. Returns how many there are. */
static int stop_guarded(omniroll_run_t *run)
{
    int count = 0;
    for (int k = run->acts.guard_count; k < all_guards(run); k++) {
        omniroll_bearing_t *const bearing = run->bearings.each + run->acts.leads_to[2*k + 1];
        if (run->acts.passed[k] && !bearing->resting) {  /* one that rests starts from rest in this phase    */
            bearing->resting = 1;
            count++;
        }
    }
    return count;
}

/* Bearings that rest from now on, or are let go. Returns how many there are, with the one whose mode a step has ended,
 * which is told once. */
static int pass_bearings(omniroll_run_t *run, const work_t *work)
{
    int count = run->hold.ended;
    if (!SET_STICKS)
        return 0;
    count += SET_HOLDS ? is_overloaded(run, work, 1) + stop_guarded(run) : overloaded_bearings(run, work, 1);
    if (SET_CORE_BEARINGS)
        count += stop_bearings(run, work);
    if (SET_IN_SERIES)
        count += stop_in_series(run, work);
    run->hold.ended = 0;
    run->hold.undecided |= count > 0;
    return count;
}

/* A step begins: what sticks in it, and the demand on that. */
static void begin_holding(const omniroll_run_t *run, const work_t *work, step_t *s)
{
    s->hold.count = run->bearings.core_count, s->hold.bearing = core_bearings(run), s->hold.states = &work->states;
    if (!SET_HOLDS && !SET_STANDS)
        return;
    if (SET_STANDS && !stands_somewhere(run))   /* nothing that a step would have to keep, and no events            */
        s->hold.held = s->hold.count = 0;
    s->hold.standing = work->standing;
    if (SET_STANDS)
        begin_standing(run, work, s);
    if (work->standing->count) {
        memcpy(s->hold.used_by, work->standing->used_by, sizeof s->hold.used_by);
        demand_now(run, work, &s->hold.demand_start);
    }
}

/* What an input is rounded against beside itself, several times: a torque that holds is a difference of others, and the
 * demand on wheels that roll exceeds what it takes by some roundings. */
static double size_of_held(const omniroll_run_t *run, int input)
{
    if (!SET_STICKS)
        return 0;
    if (SET_MOMENTS_INPUT >= 0 && input >= SET_MOMENTS_INPUT*run->wheels)
        return size_of_moments(run, input%run->wheels);
    const omniroll_bearing_t *const bearing = bearing_of_input(run, input);
    if (!bearing)
        return 0;
    return HELD_ROUNDINGS*(SET_HOLDS ? length3(run->hold.size)/length3(bearing->row)
                                     : fabs(bearing->torque) + bearing->holding);
}

/* Some time has passed. */
static void bearings_have_moved(omniroll_run_t *run, const work_t *work, const step_t *s)
{
    bearings_have_stuck(run, work);
    if (SET_HOLDS && work->standing->count)
        memcpy(work->standing->used_by, s->hold.used_by, sizeof s->hold.used_by);
    if (SET_HOLDS && run->hold.count)           /* else nobody asks before the next decision, which finds it anew  */
        find_nearer(run, work);
    if (run->hold.count)
        find_holding(run, work);
    if (SET_HOLDS)
        find_torques(run, work);
    else
        end_of_bearing(run, s->event.landing - s->wheels - s->event.guards);
}
