/* Massless rollers that stick beside contacts that stick: what the bearing takes cuts a strip out of the ground's
 * ellipse (maxima/effects/contact_strip.mac). What the state says of both. */

/* Rollers that rest stick so far. One that has come to rest at this instant takes the demand on it there, which is
 * its sliding torque as near as the event is located: until that is known its size is infinite. */
static void stop_in_modes(const omniroll_run_t *run, const work_t *work)
{
    for (int i = 0; i < run->wheels; i++) {
        omniroll_bearing_t *const roller = in_series(run, work) + i;
        if (!roller->resting)
            continue;
        if (roller->mode)
            roller->size = roller->released ? 0 : INFINITY;
        roller->mode = 0;
    }
}

/* The torques of rollers that stick and whose contacts slip along these directions. */
static void demand_on_rollers(const omniroll_run_t *run, const work_t *work, const lanes_t *toward, double *demand)
{
    double arm[MAX_WHEELS], per_chi[MAX_WHEELS];
    lanes_t force[2*MAX_WHEELS], slope[4*MAX_WHEELS];
    find_arms(run->wheels, &work->vehicle, work->standing, run->joint, run->state.chi, arm, per_chi);
    set_sliding_forces(run->wheels, &work->vehicle, toward, work->load, work->friction, force, slope);
    (void)slope;
    for (int i = 0; i < run->wheels; i++)
        demand[i] = arm[i]*force[2*i][0];
}

/* A roller whose contact slips turns if it cannot stick. */
static void turn_in_series(omniroll_bearing_t *roller, double demand)
{
    if (roller->size == INFINITY)
        roller->size = fabs(demand);
    const double bound = bound_of(roller), beyond = fabs(demand) - bound;
    if (!(beyond > PASSED*rounding_of_holding(demand, bound)) && !roller->released)
        return;
    roller->mode = demand > 0 ? -1 : 1;
    roller->resting = 0;
}

/* Which contacts rest, and which rollers turn where these do not rest both ways; the others have directions of
 * their slips. */
static void find_resting_pairs(omniroll_run_t *run, const work_t *work)
{
    double pair[2*MAX_WHEELS], demand[MAX_WHEELS];
    lanes_t toward[2*MAX_WHEELS];
    int at_rest[MAX_WHEELS];
    slips_now(run, work, pair);
    for (int i = 0; i < run->wheels; i++) {
        omniroll_grip_t *const grip = run->ground.grips + i;
        const double size = length_of(pair + 2*i, 2);
        at_rest[i] = size <= slip_rounding(run, i);
        if (at_rest[i])
            stop_on_disk(in_series(run, work) + i);
        for (int k = 0; k < 2; k++) {
            grip->towards[k] = at_rest[i] ? grip->towards[k] : pair[2*i + k]/size;
            toward[2*i + k] = lanes_of(grip->towards[k]);
        }
    }
    demand_on_rollers(run, work, toward, demand);
    for (int i = 0; i < run->wheels; i++) {
        omniroll_grip_t *const grip = run->ground.grips + i;
        omniroll_bearing_t *const roller = in_series(run, work) + i;
        if (roller->resting && grip->carries && !grip->resting && !at_rest[i])
            turn_in_series(roller, demand[i]);
        if (roller->size == INFINITY)
            roller->size = 0;
    }
    for (int i = 0; i < run->wheels; i++) {     /* contacts whose rollers turn slip along rolling directions alone */
        omniroll_grip_t *const grip = run->ground.grips + i;
        const int turns = !in_series(run, work)[i].resting;
        pair[2*i] = turns ? 0 : pair[2*i];
        const double size = length_of(pair + 2*i, 2);
        const int rolls = turns && size <= slip_rounding(run, i);
        grip->resting = (grip->resting || at_rest[i] || rolls) && grip->carries;
        for (int k = 0; k < 2 && !grip->resting && in_series(run, work)[i].mode; k++)
            grip->towards[k] = pair[2*i + k]/size;
    }
    roll(run, work, 0);
}
