/* Bearings that stick, as the rest of the engine asks for them: of wheels that roll, or that may slip. */

/* A run begins: nothing sticks so far, in a set that has such bearings and for a run that has none. */
static void clear_bearings(const omniroll_run_t *run, const work_t *work)
{
    if (SET_HOLDS)
        work->standing->count = 0;
    for (int k = 0; k < most_own_bearings(run->wheels, run->rollers_per_wheel); k++)
        work->own.sticks[k] = work->own.torque[k] = lanes_of(0);
    if (SET_IN_SERIES)
        stop_all_in_series(run, work);
}

/* Which elements stick from now on, where that must be decided anew. */
static void settle_modes(omniroll_run_t *run, const work_t *work)
{
    if (SET_STANDS) {
        settle_all(run, work);
        return;
    }
    if (SET_GRIPS)
        run->ground.knows_rates &= !run->hold.undecided;
    if (SET_HOLDS && run->bearing_count && run->hold.undecided)
        decide_rolling_bearings(run, work);
    else if (SET_STICKS && run->bearing_count && run->hold.undecided)
        decide_slipping_bearings(run, work);
    if (SET_HOLDS)
        run->hold.speed = fmax(run->hold.speed, length3(run->nu));
    if (SET_GRIPS && run->ground.undecided)
        decide_contacts(run, work);
}

/* Bearings of wheels that roll rest whose rates have passed zero. Returns how many there are. */
static int stop_guarded(omniroll_run_t *run)
{
    int count = 0;
    for (int k = run->guard_count; k < all_guards(run); k++) {
        omniroll_bearing_t *const bearing = run->bearings + run->leads_to[2*k + 1];
        if (run->passed[k] && !bearing->resting) {      /* one that rests starts from rest in this phase     */
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
    count += SET_HOLDS ? ask_too_much(run, work, 1) + stop_guarded(run) : release_own(run);
    if (SET_OWN_BEARINGS)
        count += stop_own(run, work);
    if (SET_IN_SERIES)
        count += stop_in_series(run, work);
    run->hold.ended = 0;
    run->hold.undecided |= count > 0;
    return count;
}

/* A step begins: what sticks in it, and what that is asked for. */
static void begin_holding(const omniroll_run_t *run, const work_t *work, step_t *s)
{
    s->own_count = run->own_count, s->own_bearing = own_bearings(run), s->own = &work->own;
    if (!SET_HOLDS && !SET_STANDS)
        return;
    s->standing = work->standing;
    memcpy(s->used_by, work->standing->used_by, sizeof s->used_by);
    if (SET_STANDS)
        begin_standing(run, work, s);
    if (SET_STANDS || work->standing->count)
        asked_now(run, work, &s->asked_start);
}

/* What an input is rounded against beside itself, several times: a torque that holds is what is left of others, and of
 * wheels that roll more is asked for than it takes by some roundings. */
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
    for (int k = 0; k < run->bearing_count; k++) {
        run->bearings[k].resting = run->bearings[k].mode == 0;
        run->bearings[k].released = 0;
    }
    if (!SET_HOLDS) {
        slipping_bearings_have_moved(run, work, s);
        return;
    }
    memcpy(work->standing->used_by, s->used_by, sizeof s->used_by);
    find_nearer(run, work);
    find_held_force(run, work);
    find_torques(run, work);
}
