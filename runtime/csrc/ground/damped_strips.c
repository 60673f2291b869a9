/* Massless rollers that stick beside contacts that stick, where bearings have viscous friction, too: what changes of
 * the rules of strips.c. The numbered rules are in runtime/omniroll/effects/ground_with_damped_rollers.py. */
#if SET_DAMPED_STRIPS
#define ALONG_THE_AXLE 1e-6         /* a way with less of the rolling direction is that of the axle                  */

/* The slips at this instant of contacts whose rollers turn in these modes; of others `pair`, those of rigid wheels. */
static void slips_of_turning(const omniroll_run_t *run, const work_t *work, const int *mode, const double *pair,
                             double *slip)
{
    instant_t now;
    lanes_t torque[MOST_WHEELS], found[2*MOST_WHEELS];
    memcpy(slip, pair, sizeof *slip*2*(size_t)run->wheels);
    at_this_instant(run, work, run->wheels, &now);
    feel_loads_now(run, work);
    for (int i = 0; i < run->wheels; i++)
        torque[i] = lanes_of(-mode[i]*run->bearings[run->axle_count + i].sliding);
    put_damped_slips(&work->own, &work->vehicle, run->wheels, now.point.nu, now.point.chi, now.point.core, torque,
                     mode, found);
    for (int i = 0; i < run->wheels; i++)
        if (mode[i])
            slip[2*i] = found[2*i][0];
}

/* The slips at this instant, of contacts `turns` whose rollers turn, too. */
static void true_slips(const omniroll_run_t *run, const work_t *work, const int *turns, double *slip)
{
    double pair[2*MOST_WHEELS];
    int mode[MOST_WHEELS];
    slips_now(run, work, pair);
    for (int i = 0; i < run->wheels; i++)
        mode[i] = turns[i] ? roller_mode(run, i) : 0;
    slips_of_turning(run, work, mode, pair, slip);
}

/* The same of the modes at this instant. */
static void slips_in_modes(const omniroll_run_t *run, const work_t *work, double *slip)
{
    int turns[MOST_WHEELS];
    for (int i = 0; i < run->wheels; i++)
        turns[i] = slides(run, i) && roller_mode(run, i);
    true_slips(run, work, turns, slip);
}

/* How much more a bearing takes of a force along the axle per m/s there, at these arms. */
ALWAYS_INLINE double damper_of(const work_t *work, int i, const double *arm)
{
    return work->vehicle.wheel[i].roller_damping[0]/(arm[i]*arm[i]);
}

#if SET_LOADS
static void find_taken(const omniroll_run_t *run, const work_t *work, const double *arm, double *taken);
static void take_normal(omniroll_grip_t *grip, int mode, double taken);

/* Contacts that slip, and whose rollers turn, go where the state and the loads say; whether there are such. The slip
 * says it, or near rest, where that is rounding, the ellipse beside what the bearing takes. */
static int take_ways(omniroll_run_t *run, const work_t *work, const double *arm, const double *taken)
{
    double slip[2*MOST_WHEELS];
    int some = 0;
    slips_in_modes(run, work, slip);
    for (int i = 0; i < run->wheels; i++) {
        omniroll_grip_t *const grip = run->grips + i;
        const double size = length_of(slip + 2*i, 2), left = taken[i] - damper_of(work, i, arm)*fabs(slip[2*i]);
        const double part = left/(grip->load*grip->sliding[0]), across = (1 - part)*(1 + part);
        if (!slides(run, i) || !roller_mode(run, i))
            continue;
        some = 1;
        if (size <= slip_rounding(run, i) || slip_rounding(run, i)*across > SLIP_AT_REST*EPS*size) {
            take_normal(grip, roller_mode(run, i), left);
            continue;
        }
        for (int k = 0; k < 2; k++)
            grip->towards[k] = slip[2*i + k]/size;
    }
    return some;
}

/* Contacts have the loads with these moments. */
static void take_loads(omniroll_run_t *run, const work_t *work, const double *moments)
{
    instant_t now;
    lanes_t compression[MOST_WHEELS];
    const lanes_t sums[3] = {lanes_of(run->ground.sums[0]), lanes_of(moments[0]), lanes_of(moments[1])};
    at_this_instant(run, work, run->wheels, &now);
    loads_of_sums(run->wheels, &now.point, sums, compression);
    for (int i = 0; i < run->wheels; i++)
        if (run->grips[i].carries)
            run->grips[i].load = fmax(compression[i][0], LEAST_LOAD*run->ground.weight);
}

/* Broyden's rule: the inverse slopes, negative, as a step has changed what is off. */
static void correct_inverse(double inverse[2][2], const double *step, const double *before, const double *off)
{
    const double changed[2] = {before[0] - off[0], before[1] - off[1]};
    double made[2], back[2];
    for (int k = 0; k < 2; k++) {
        made[k] = inverse[k][0]*changed[0] + inverse[k][1]*changed[1];
        back[k] = step[0]*inverse[0][k] + step[1]*inverse[1][k];
    }
    const double over = step[0]*made[0] + step[1]*made[1];
    for (int k = 0; k < 2 && over != 0; k++)
        for (int j = 0; j < 2; j++)
            inverse[k][j] += (step[k] - made[k])*back[j]/over;
}

/* At an instant loads and the ways of such contacts belong together: each follows from the other. Moments of the loads
 * are found by Broyden's rule, which in two unknowns needs no slopes and does not ask how much ways feel of loads. */
static void settle_ways(omniroll_run_t *run, const work_t *work)
{
    const loads_t *const loads = work->loads + LOADS_NOW;
    const double size = run->ground.weight*run->ground.arms[0];
    double moments[2], off[2] = {0, 0}, step[2] = {0, 0}, inverse[2][2] = {{1, 0}, {0, 1}}, last = INFINITY;
    double arm[MOST_WHEELS], per_chi[MOST_WHEELS], taken[MOST_WHEELS];
    lanes_t nu_dot[3];
    find_arms(run->wheels, &work->vehicle, work->standing, run->joint, run->chi, arm, per_chi);
    find_taken(run, work, arm, taken);
    memcpy(moments, run->ground.sums + 1, sizeof moments);
    for (int round = 0; round < MOST_ROUNDS && take_ways(run, work, arm, taken); round++) {
        const double before[2] = {off[0], off[1]};
        rates_at_this_instant(run, work, run->wheels, nu_dot);
        run->ground.sums[0] = loads->sums[0][0];
        for (int k = 0; k < 2; k++)
            off[k] = loads->sums[1 + k][0] - moments[k];
        const double left = length_of(off, 2);
        if (round > 0)
            correct_inverse(inverse, step, before, off);
        if (left <= LOADS_SETTLED*size || (last <= left && left <= LOADS_ROUNDED*size))
            break;
        last = left;
        for (int k = 0; k < 2; k++)
            step[k] = inverse[k][0]*off[0] + inverse[k][1]*off[1];
        moments[0] += step[0], moments[1] += step[1];
        take_loads(run, work, moments);
    }
}
#endif

/* How the slips change at the start of a step, into `rate` (2 N). Where one begins whose roller turns, it goes with the
 * rate along the rolling direction, whose rounding its part along the axle would enlarge. */
static void slip_rates_at_start(const omniroll_run_t *run, const work_t *work, const step_t *s, double *rate)
{
    instant_t now;
    lanes_t yield[MOST_WHEELS], slopes[3*MOST_WHEELS];
    at_this_instant(run, work, run->wheels, &now);
    feel_loads_now(run, work);
    damped_roots(&work->own, &work->vehicle, run->wheels, now.point.nu, now.point.chi, now.point.core,
                 work->own.torque + work->own.rollers_at, yield, slopes);
    for (int i = 0; i < run->wheels; i++) {
        const double along = work->slip_dot[2*i][0], across = work->slip_dot[2*i + 1][0];
        rate[2*i] = along, rate[2*i + 1] = across;
        if (!s->corner[i])
            continue;
        if (hypot(s->slip_start[2*i], s->slip_start[2*i + 1]) > s->slip_noise[i])
            rate[2*i] = slopes[3*i][0]*along + slopes[3*i + 1][0]*across
                + slopes[3*i + 2][0]*run->core[rates_at(run->wheels) + i];
        else if (fabs(run->grips[i].towards[1]) > ALONG_THE_AXLE)
            rate[2*i] = 0;
    }
    (void)yield;
}

/* One over the speeds at which dampers take all of the friction. */
static void put_paces(const omniroll_run_t *run, const work_t *work, step_t *s)
{
    double arm[MOST_WHEELS], per_chi[MOST_WHEELS];
    find_arms(run->wheels, &work->vehicle, work->standing, run->joint, run->chi, arm, per_chi);
    for (int i = 0; i < run->wheels; i++)
        s->way_pace[i] = damper_of(work, i, arm)/(fmax(load_scale(run, i), LEAST_ABOUT)*s->friction[2*i][0]);
}
#endif
