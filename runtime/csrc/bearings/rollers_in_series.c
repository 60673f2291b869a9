/* Massless rollers that stick on their disks or turn there where wheels may slip: bearing and ground in series
 * (maxima/effects/contact_massless.mac). A roller's spin follows from the state and from its mode, and so does what holds
 * one that sticks: no roller has a part in another one's. */
#define SOON 1e-7                   /* of the vehicle's speed: by this change of speeds a spin is seen to fall    */

/* A roller stands on its disk from now on, if it can. */
ALWAYS_INLINE void stop_on_disk(omniroll_bearing_t *roller)
{
    roller->resting = 1;
    roller->mode = 0, roller->size = 0;
}

/* A run begins. */
static void stop_all_in_series(const omniroll_run_t *run, const work_t *work)
{
    for (int i = 0; i < run->wheels; i++)
        stop_on_disk(in_series(run, work) + i);
}

/* Wheels have passed to their next rollers, which stand on their disks. One that stuck goes on as its neighbour did. */
static void stop_those_that_switch(const omniroll_run_t *run, const work_t *work, const int *directions)
{
    for (int i = 0; i < run->wheels; i++)
        if (directions[i] && in_series(run, work)[i].mode)
            stop_on_disk(in_series(run, work) + i);
}

/* In work->states.rate the spins at this instant, and in the second lane those so little later that speeds have changed by
 * SOON of the vehicle's. */
static void find_spins_soon(const omniroll_run_t *run, const work_t *work)
{
    lanes_t nu_dot[3];
    instant_t now;
    double fastest = 0;
    rates_at_this_instant(run, work, run->wheels, nu_dot);
    at_this_instant(run, work, run->wheels, &now);
    for (int k = 0; k < 3; k++)
        fastest = fmax(fastest, fabs(nu_dot[k][0]));
    for (int c = 0; c < work->core; c++)
        fastest = fmax(fastest, fabs(work->core_dot[c][0])/run->bearings.rate_of_speed);
    const double time = fastest > 0 ? SOON*length3(run->state.nu)/fastest : 0;
    for (int k = 0; k < 3; k++)
        now.arrays.nu[k][1] += time*nu_dot[k][0];
    for (int i = 0; i < run->wheels; i++) {
        now.arrays.chi[i][1] += time*run->state.core[rates_at(run->wheels) + i];
        now.arrays.chi[i] = lanes_clamp(now.arrays.chi[i], run->joint[i]);
    }
    for (int c = 0; c < work->core; c++)
        work->core_here[c][1] += time*work->core_dot[c][0];
    bearing_rates_now(run, work, &now);
}

/* Rounding of a spin, or of what stands in its place, beside that of rates of its size. */
ALWAYS_INLINE double noise_at_bound(const work_t *work, int i)
{
    return SET_STRIPS && fabs(work->states.takes[i]) > 0 ? EPS*work->states.scale[i] : 0;
}

/* Those whose spins have passed zero rest, and those that rounding does not tell from zero and that fall. Returns how
 * many there are. */
static int stop_in_series(omniroll_run_t *run, const work_t *work)
{
    const double speed = length3(run->state.nu)*run->bearings.rate_of_speed;
    const double residual = residual_of_rates(run);
    int count = 0, near[MAX_WHEELS], some = 0;
    for (int i = 0; i < run->wheels; i++) {
        const omniroll_bearing_t *const roller = in_series(run, work) + i;
        const double spin = bearing_rate(run, work, work->states.rollers_at + i);
        const double noise = EPS*(fabs(spin) + speed) + noise_at_bound(work, i);
        near[i] = roller->mode && !roller->resting && -roller->mode*spin >= -PASSED*noise;
        some |= near[i];
    }
    if (some)
        find_spins_soon(run, work);
    for (int i = 0; i < run->wheels; i++) {
        omniroll_bearing_t *const roller = in_series(run, work) + i;
        const lanes_t spin = -roller->mode*work->states.rate[work->states.rollers_at + i];
        const double noise = noise_of_bearing(roller, spin[0]) + noise_at_bound(work, i);
        if (!near[i] || !(spin[0] > PASSED*noise + residual || (spin[0] >= -PASSED*noise && spin[1] > spin[0])))
            continue;
        roller->resting = 1;
        count++;
    }
    return count;
}

/* Modes of those at rest. One that has come to rest at this instant takes the demand on it there:
 * where its spin is zero that is its sliding torque, as near as the event is located. */
static void decide_in_series(const omniroll_run_t *run, const work_t *work)
{
    omniroll_bearing_t *const rollers = in_series(run, work);
    int comes_to_rest[MAX_WHEELS];
    for (int i = 0; i < run->wheels; i++) {
        comes_to_rest[i] = rollers[i].resting && rollers[i].mode && !rollers[i].released;
        if (rollers[i].resting)
            rollers[i].mode = 0;
    }
    enter_bearings(run, work, 1);
    find_bearing_rates(run, work);
    find_bearing_torques(run, work);
    for (int i = 0; i < run->wheels; i++) {
        omniroll_bearing_t *const roller = rollers + i;
        if (comes_to_rest[i])
            roller->size = fabs(roller->torque);
        if (roller->mode == 0 && (roller->released || is_beyond_bound(roller)))
            roller->mode = roller->released = roller->torque > 0 ? -1 : 1;
    }
    enter_bearings(run, work, 1);
}
