/* Many runs that go on in one call: part of run.c. */

/* Runs of any vehicles of a set, one after the other. */
void omniroll_run_each(long long count, omniroll_run_t *const *runs, const omniroll_model *const *models,
                       int *statuses)
{
    for (long long k = 0; k < count; k++)
        statuses[k] = omniroll_run(runs[k], models[k]);
}

/* Below, runs of one vehicle that pause, as a session's does. What a member is given acts from this instant on, which
 * is an event. */
static void give(const omniroll_member_t *member, const double *volts)
{
    omniroll_run_t *const run = member->run;
    for (int i = 0; i < run->wheels; i++)
        member->volts[i] = volts[i];
    run->acts.next_time = run->state.elapsed;
    run->past.at_event = 1;
}

/* Those `which` go on to `until`, one after the other. */
void omniroll_run_members(long long count, const long long *which, const omniroll_member_t *members,
                          const omniroll_model *model, const double *until, const double *volts, int *statuses)
{
    for (long long k = 0; k < count; k++) {
        const long long states = which[k];
        omniroll_run_t *const run = members[states].run;
        give(&members[states], volts + states*run->wheels);
        run->task.duration = until[states];
        run->record.row_count = run->record.switch_count = 0;
        statuses[k] = omniroll_run(run, model);
    }
}

/* nu and chi of all. */
void omniroll_read_members(long long count, const omniroll_member_t *members, double *nu, double *chi)
{
    for (long long k = 0; k < count; k++) {
        const omniroll_run_t *const run = members[k].run;
        memcpy(nu + 3*k, run->state.nu, 3*sizeof *nu);
        memcpy(chi + run->wheels*k, run->state.chi, (size_t)run->wheels*sizeof *chi);
    }
}
