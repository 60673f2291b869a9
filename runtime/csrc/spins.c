/* Free rollers that stick on their disks or turn there: a mode for each, whose rate is a number of the core. The numbered
 * rules are in runtime/omniroll/effects/sticking_bearings.py; sticking.c has the bearings whose rates follow from nu. */
#if SET_SPINS_STICK
static double tau(const omniroll_run_t *run, double phase_length);
static void take_mode_at_rest(omniroll_bearing_t *bearing, int moves, double rate, double torque);

ALWAYS_INLINE omniroll_bearing_t *spin_bearings(const omniroll_run_t *run)
{
    return run->bearings ? run->bearings + (run->bearing_count - run->spin_count) : 0;
}

ALWAYS_INLINE double *spins_now(const omniroll_run_t *run)
{
    return run->core + spins_at(run->wheels);
}

/* Whether a free roller that sticks asks for more than its bearing takes. */
ALWAYS_INLINE int holds_no_more(const omniroll_bearing_t *spin)
{
    const double torque = fabs(spin->torque);
    return spin->mode == 0 && torque - spin->holding > PASSED*rounding_of_holding(torque, spin->holding);
}

/* Those rest whose spins are zero within rounding: a spin is what is left of larger speeds. */
static void find_resting_spins(omniroll_run_t *run, double speed)
{
    for (int k = 0; k < run->spin_count; k++) {
        const double spin = fabs(spins_now(run)[k]);
        spin_bearings(run)[k].resting |= spin <= AT_REST*EPS*(spin + speed*run->yaw_of_speed);
    }
}

static void put_spins_to_rest(omniroll_run_t *run)
{
    for (int k = 0; k < run->spin_count; k++) {
        omniroll_bearing_t *const bearing = spin_bearings(run) + k;
        double *const spin = spins_now(run) + k;
        *spin = bearing->resting ? 0 : *spin;
        bearing->mode = (*spin > 0) - (*spin < 0);
    }
}

/* The torques of those that turn; the others stick, or where `hold` is 0 take none. */
static void turn_spins(const omniroll_run_t *run, const work_t *work, int hold)
{
    for (int k = 0; k < run->spin_count; k++) {
        omniroll_bearing_t *const bearing = spin_bearings(run) + k;
        bearing->torque = -bearing->mode*bearing->sliding;
        work->spins.torque[k] = lanes_of(bearing->torque);
        work->spins.sticks[k] = lanes_of(hold && bearing->mode == 0);
    }
}

/* What holds those that stick, from the last evaluation at this instant. */
static void find_torques_of_spins(const omniroll_run_t *run, const work_t *work)
{
    for (int k = 0; k < run->spin_count; k++)
        if (spin_bearings(run)[k].mode == 0)
            spin_bearings(run)[k].torque = work->spins.holding[k][0];
}

/* What takes the free rollers along without nu' and without their bearings, from the last evaluation. */
static void keep_given_accelerations(const omniroll_run_t *run, const work_t *work)
{
    for (int k = 0; k < run->spin_count; k++)
        work->carried[k] = -work->core_dot[spins_at(run->wheels) + k][0];
}

/* Those at rest on their disks, with the bounds of this round. */
static spinning_t spins_at_rest(const omniroll_run_t *run, const work_t *work)
{
    lanes_t nu[3] = {lanes_of(0), lanes_of(0), lanes_of(1)}, chi[MOST_WHEELS];
    spinning_t found = {.count = 0, .inertia = run->roller_inertia, .per_yaw = work->per_yaw, .given = work->given,
        .bounds = work->bounds};
    for (int i = 0; i < run->wheels; i++)
        chi[i] = lanes_of(run->chi[i]);
    for (int k = 0; k < run->spin_count; k++)
        work->axial[k] = lanes_of(0);
    set_spins_from_axial(run->wheels, &work->vehicle, nu, chi, work->axial, work->later);
    for (int k = 0; k < run->spin_count; k++) {
        const omniroll_bearing_t *const bearing = spin_bearings(run) + k;
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
    for (int k = 0, place = 0; k < run->spin_count; k++) {
        omniroll_bearing_t *const bearing = spin_bearings(run) + k;
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
    for (int k = 0, place = 0; k < run->spin_count; k++) {
        double rate, torque;
        if (!spin_bearings(run)[k].resting)
            continue;
        const int moves = spin_moves(spins, place++, yaw, most, &rate, &torque);
        take_mode_at_rest(spin_bearings(run) + k, moves, rate, torque);
    }
}

/* What the spins are rounded against in the phase that starts now. */
static void size_spins(const omniroll_run_t *run)
{
    for (int k = 0; k < run->spin_count; k++)
        spin_bearings(run)[k].size = fabs(spins_now(run)[k]) + length3(run->nu)*run->yaw_of_speed;
}

ALWAYS_INLINE double noise_of_spin(const omniroll_bearing_t *bearing, double spin)
{
    return EPS*(bearing->size + fabs(spin));
}

/* Free rollers that turn and whose spins have passed zero, or are closer in time than tau to it, rest. Returns how many
 * there are. */
static int stop_spins(omniroll_run_t *run, const work_t *work)
{
    const double together = run->at_event ? tau(run, run->elapsed - run->phase_start) : 0;
    lanes_t nu_dot[3];
    int count = 0, near = run->at_event;
    for (int k = 0; k < run->spin_count; k++) {
        const omniroll_bearing_t *const bearing = spin_bearings(run) + k;
        const double spin = spins_now(run)[k];
        near |= bearing->mode && -bearing->mode*spin >= -LANDED*noise_of_spin(bearing, spin);
    }
    if (!near)
        return 0;
    rates_at_this_instant(run, work, run->wheels, nu_dot);
    for (int k = 0; k < run->spin_count; k++) {
        omniroll_bearing_t *const bearing = spin_bearings(run) + k;
        const double spin = spins_now(run)[k], value = -bearing->mode*spin, noise = noise_of_spin(bearing, spin);
        const double rate = -bearing->mode*work->core_dot[spins_at(run->wheels) + k][0];
        if (bearing->mode && !bearing->resting
            && (value > PASSED*noise || (rate > 0 && value >= -(LANDED*noise + together*rate)))) {
            bearing->resting = run->hold.undecided = 1;
            count++;
        }
    }
    return count;
}
#endif
