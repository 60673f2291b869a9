/* Free rollers that stick on their disks or turn there: which of those at rest stick. The numbered rules are in
 * runtime/omniroll/effects/sticking_bearings.py; sticking.c has the bearings whose rates follow from nu, and
 * own_bearings.c what free rollers have in common with other bearings whose rates do not. */
static void take_mode_at_rest(omniroll_bearing_t *bearing, int moves, double rate, double torque);

/* What takes the free rollers along without nu' and without their bearings, from the last evaluation. */
static void keep_given_accelerations(const omniroll_run_t *run, const work_t *work)
{
    for (int k = 0; k < run->own_count; k++)
        work->carried[k] = -work->core_dot[own_rates_at(run->wheels) + k][0];
}

/* Those at rest on their disks, with the bounds of this round. */
static spinning_t spins_at_rest(const omniroll_run_t *run, const work_t *work)
{
    lanes_t nu[3] = {lanes_of(0), lanes_of(0), lanes_of(1)}, chi[MOST_WHEELS];
    spinning_t found = {.count = 0, .inertia = run->roller_inertia, .per_yaw = work->per_yaw, .given = work->given,
        .bounds = work->bounds};
    for (int i = 0; i < run->wheels; i++)
        chi[i] = lanes_of(run->chi[i]);
    for (int k = 0; k < run->own_count; k++)
        work->axial[k] = lanes_of(0);
    set_spins_from_axial(run->wheels, &work->vehicle, nu, chi, work->axial, work->later);
    for (int k = 0; k < run->own_count; k++) {
        const omniroll_bearing_t *const bearing = own_bearings(run) + k;
        if (!bearing->resting)
            continue;
        work->per_yaw[found.count] = -work->later[k][0];
        work->given[found.count] = work->carried[k];
        work->bounds[found.count++] = bearing->broken ? bearing->sliding : bearing->holding;
    }
    return found;
}

/* The force of f_3 that their bearings can give together. */
static double reach_of_spins(const spinning_t *spins)
{
    double reach = 0;
    for (int k = 0; k < spins->count; k++)
        reach += fabs(spins->per_yaw[k])*spins->bounds[k];
    return reach;
}

/* The acceleration of a free roller where nu_3' is `yaw`, the torque of its bearing, and whether it moves: `most` is what
 * nu_3' could be. */
static int spin_moves(const spinning_t *spins, int k, double yaw, double most, double *rate, double *torque)
{
    int turns;
    *torque = torque_of_spin(spins, k, yaw, &turns);
    *rate = turns ? *torque/spins->inertia - (spins->per_yaw[k]*yaw + spins->given[k]) : 0;
    return fabs(*rate) > MOVES*(fabs(spins->per_yaw[k])*most + fabs(spins->given[k]) + spins->bounds[k]/spins->inertia);
}

/* Those that move have broken away. Returns whether some have not before. */
static int break_spins_away(const omniroll_run_t *run, const spinning_t *spins, double yaw, double most)
{
    int further = 0;
    for (int k = 0, place = 0; k < run->own_count; k++) {
        omniroll_bearing_t *const bearing = own_bearings(run) + k;
        double rate, torque;
        if (!bearing->resting)
            continue;
        const int moves = spin_moves(spins, place++, yaw, most, &rate, &torque);
        further |= moves && !bearing->broken;
        bearing->broken |= moves;
    }
    return further;
}

static void take_modes_of_spins(const omniroll_run_t *run, const spinning_t *spins, double yaw, double most)
{
    for (int k = 0, place = 0; k < run->own_count; k++) {
        double rate, torque;
        if (!own_bearings(run)[k].resting)
            continue;
        const int moves = spin_moves(spins, place++, yaw, most, &rate, &torque);
        take_mode_at_rest(own_bearings(run) + k, moves, rate, torque);
    }
}

