/* Bearings that stick, as the rest of the engine asks for them: of wheels that roll, or that may slip. */

/* A run begins: nothing sticks so far. */
static void clear_bearings(const omniroll_run_t *run, const work_t *work)
{
    if (SET_HOLDS)
        clear_rolling_bearings(run, work);
    else
        clear_slipping_bearings(run, work);
}

/* Which bearings stick from now on, where that must be decided anew. */
ALWAYS_INLINE void settle_bearings(omniroll_run_t *run, const work_t *work)
{
    if (SET_HOLDS)
        settle_rolling_bearings(run, work);
    else if (SET_STICKS)
        settle_slipping_bearings(run, work);
}

/* Bearings that rest from now on, or are let go. Returns how many there are. */
ALWAYS_INLINE int pass_bearings(omniroll_run_t *run, const work_t *work)
{
    if (SET_HOLDS)
        return pass_rolling_bearings(run, work);
    return SET_STICKS ? pass_slipping_bearings(run, work) : 0;
}

/* A step begins: what sticks in it. */
static void begin_holding(const omniroll_run_t *run, const work_t *work, step_t *s)
{
    if (SET_HOLDS)
        begin_holding_rolling_wheels(run, work, s);
    else
        begin_holding_slipping_wheels(run, work, s);
}

/* What an input is rounded against beside itself, several times: a torque that holds is what is left of others. */
ALWAYS_INLINE double size_of_held(const omniroll_run_t *run, int input)
{
    if (SET_HOLDS)
        return size_held_by_rolling(run, input);
    return SET_STICKS ? size_held_by_slipping(run, input) : 0;
}

/* Some time has passed. */
static void bearings_have_moved(omniroll_run_t *run, const work_t *work, const step_t *s)
{
    if (SET_HOLDS)
        rolling_bearings_have_moved(run, work, s);
    else
        slipping_bearings_have_moved(run, work, s);
}

/* Which elements stick from now on. */
static void settle_modes(omniroll_run_t *run, const work_t *work)
{
    if (SET_STANDS) {
        settle_all(run, work);
        return;
    }
    if (SET_GRIPS)
        run->ground.knows_rates &= !run->hold.undecided;
    settle_bearings(run, work);
    if (SET_GRIPS && run->ground.undecided)
        decide_contacts(run, work);
}
