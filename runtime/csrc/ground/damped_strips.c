/* Massless rollers that stick beside contacts that stick, where bearings have viscous friction, too: what changes of
 * the rules of strips.c. The numbered rules are in runtime/omniroll/effects/ground_with_damped_rollers.py. */
#if SET_DAMPED_STRIPS
#define ALONG_THE_AXLE 1e-6         /* a way with less of the rolling direction is that of the axle                  */

/* The slips at this instant, of contacts `turns` whose rollers turn, too; of others those of rigid wheels. */
static void true_slips(const omniroll_run_t *run, const work_t *work, const int *turns, double *slip)
{
    instant_t now;
    lanes_t torque[MOST_WHEELS], found[2*MOST_WHEELS];
    slips_now(run, work, slip);
    at_this_instant(run, work, run->wheels, &now);
    for (int i = 0; i < run->wheels; i++)
        torque[i] = lanes_of(-roller_mode(run, i)*run->bearings[run->axle_count + i].sliding);
    put_damped_slips(&work->own, &work->vehicle, run->wheels, now.point.nu, now.point.chi, now.point.core, torque,
                     turns, found);
    for (int i = 0; i < run->wheels; i++)
        if (turns[i])
            slip[2*i] = found[2*i][0];
}

/* The same of the modes at this instant. */
static void slips_in_modes(const omniroll_run_t *run, const work_t *work, double *slip)
{
    int turns[MOST_WHEELS];
    for (int i = 0; i < run->wheels; i++)
        turns[i] = slides(run, i) && roller_mode(run, i);
    true_slips(run, work, turns, slip);
}

/* How the slips change at the start of a step, into `rate` (2 N). Where one begins whose roller turns, it goes with the
 * rate along the rolling direction, whose rounding its part along the axle would enlarge. */
static void slip_rates_at_start(const omniroll_run_t *run, const work_t *work, const step_t *s, double *rate)
{
    instant_t now;
    lanes_t yield[MOST_WHEELS], slopes[3*MOST_WHEELS];
    at_this_instant(run, work, run->wheels, &now);
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

/* How much more a bearing takes of a force along the axle per m/s there, at these arms. */
ALWAYS_INLINE double damper_of(const work_t *work, int i, const double *arm)
{
    return work->vehicle.wheel[i].roller_damping[0]/(arm[i]*arm[i]);
}

/* One over the speeds at which dampers take all of the friction. */
static void put_paces(const omniroll_run_t *run, const work_t *work, step_t *s)
{
    double arm[MOST_WHEELS], per_chi[MOST_WHEELS];
    find_arms(run->wheels, &work->vehicle, work->standing, run->joint, run->chi, arm, per_chi);
    for (int i = 0; i < run->wheels; i++)
        s->way_pace[i] = damper_of(work, i, arm)/(s->load[i][0]*s->friction[2*i][0]);
}
#endif
