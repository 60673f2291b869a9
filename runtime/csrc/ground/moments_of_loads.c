/* Modes and loads that turns do not find, one for the other: by Newton's rule. Loads are two moments, and what friction
 * under such loads makes of the motion asks for two again. The reasons are in
 * runtime/omniroll/effects/rounds_with_loads.py; the names and the numbers are the same. */
#if SET_LOADS && SET_GRIPS
#define MOMENT_ROUNDS 40
#define MOVED_MOMENT 1e-7           /* of the weight times the vehicle's size: by which slopes are found       */
#define LEAST_PART 1e-3             /* of a step                                                              */
#define BETTER 0.25                 /* of what a step promises it must keep                                    */
#define SAME_LOADS 1e-11            /* of the weight, and of it times the vehicle's size: loads that modes have, and for
                                       which they were found, are the same */
#define FLAT 1e-12                  /* of its terms: a determinant that is no more is rounding                 */

/* Where moments say which contacts carry, those do whose springs would be compressed: of all loads with these moments
 * that pull on no contact they have the least norm. Whether that changes something. */
static int carry_by_moments(omniroll_run_t *run, const work_t *work, const lanes_t *compression)
{
    int changes = 0;
#if SET_CORNERS
    int carries[MOST_WHEELS];
    for (int i = 0; i < run->wheels; i++)
        carries[i] = compression[i][0] > 0 && !run->grips[i].dropped;
    if (!work->under_loads->seeks_sets || !stands(run, carries))
        return 0;
    for (int i = 0; i < run->wheels; i++) {
        changes |= carries[i] != run->grips[i].carries;
        run->grips[i].carries = carries[i];
    }
    put_carrying(run);
#endif
    (void)run, (void)work, (void)compression;
    return changes;
}

/* By how much the moments are off that the motion asks for under loads of these, with the modes found for them. */
static void moments_off(omniroll_run_t *run, const work_t *work, const int *other, const double *moments, double *off)
{
    instant_t now;
    lanes_t nu_dot[3], compression[MOST_WHEELS], off_by[2];
    const lanes_t sums[3] = {lanes_of(run->ground.sums[0]), lanes_of(moments[0]), lanes_of(moments[1])};
    for (int k = 0, changes = 1; k < 2*run->wheels && changes; k++) {
        at_this_instant(run, work, run->wheels, &now);
        loads_of_sums(run->wheels, &now.point, sums, compression);
        changes = carry_by_moments(run, work, compression);
    }
    for (int i = 0; i < run->wheels; i++) {
        omniroll_grip_t *const grip = run->grips + i;
        grip->load = grip->carries ? fmax(compression[i][0], LEAST_LOAD*run->ground.weight) : 0;
    }
#if SET_CORNERS                     /* a map knows nothing of the modes of before                              */
    work->under_loads->turns = 0;
#endif
    find_modes(run, work, other);
    put_modes(run);
    at_this_instant(run, work, run->wheels, &now);
    memcpy(now.point.loads->sums, sums, sizeof sums);
#if SET_NEARLY_LINEAR
    put_about(run->wheels, &now.point);
#endif
    rates_of_sums(run->wheels, &now.point, nu_dot, off_by);
    off[0] = off_by[0][0], off[1] = off_by[1][0];
}

/* A step of Newton's rule from moments that are off. Returns whether there is one. */
static int step_of_moments(omniroll_run_t *run, const work_t *work, const int *other, const double *moments,
                            const double *off, double *step)
{
    const double moved = MOVED_MOMENT*run->ground.weight*run->ground.arms[0];
    double slope[2][2];
    for (int k = 0; k < 2; k++) {
        double there[2] = {moments[0], moments[1]}, off_there[2];
        there[k] += moved;
        moments_off(run, work, other, there, off_there);
        for (int j = 0; j < 2; j++)
            slope[j][k] = (off_there[j] - off[j])/moved;
    }
    const double terms[2] = {slope[0][0]*slope[1][1], slope[0][1]*slope[1][0]}, determinant = terms[0] - terms[1];
    if (!(fabs(determinant) > FLAT*(fabs(terms[0]) + fabs(terms[1]))))
        return 0;
    step[0] = -(slope[1][1]*off[0] - slope[0][1]*off[1])/determinant;
    step[1] = -(slope[0][0]*off[1] - slope[1][0]*off[0])/determinant;
    return 1;
}

/* Moments that the motion asks for under loads of these, from `moments` on; whether they have been found. */
static int find_moments(omniroll_run_t *run, const work_t *work, const int *other, double *moments)
{
    const double size = run->ground.weight*run->ground.arms[0];
    double off[2];
    moments_off(run, work, other, moments, off);
    for (int round = 0; round < MOMENT_ROUNDS && length_of(off, 2) > LOADS_SETTLED*size; round++) {
        double step[2], there[2], off_there[2], part = 2;
        if (!step_of_moments(run, work, other, moments, off, step))
            break;
        do {
            part /= 2;
            there[0] = moments[0] + part*step[0], there[1] = moments[1] + part*step[1];
            moments_off(run, work, other, there, off_there);
        } while (!(length_of(off_there, 2) < (1 - BETTER*part)*length_of(off, 2)) && part > LEAST_PART);
        if (!(length_of(off_there, 2) < length_of(off, 2)))
            break;
        memcpy(moments, there, sizeof there), memcpy(off, off_there, sizeof off);
    }
    return length_of(off, 2) <= SAME_LOADS*size;
}

/* The loads in the modes that have been found for `moments`: whether they are these, and no contact turns aside.
 * Returns what take_turns() does. */
static int have_moments(omniroll_run_t *run, const work_t *work, const int *rests, const int *other,
                        const double *moments)
{
    double before[MOST_WHEELS], off[2], most = 0;
    moments_off(run, work, other, moments, off);
    for (int i = 0; i < run->wheels; i++)
        before[i] = run->grips[i].load;
    if (loads_settle(run, work, rests, before) < 0)
        return 0;
    for (int i = 0; i < run->wheels; i++)
        most = fmax(most, fabs(run->grips[i].load - before[i]));
    return most <= SAME_LOADS*run->ground.weight && !turns_to_steady(run, work, rests) ? 1 : -1;
}

/* The moments of the loads that contacts have. */
static void moments_of_contacts(const omniroll_run_t *run, double *moments)
{
    moments[0] = moments[1] = 0;
    for (int i = 0; i < run->wheels; i++)
        for (int k = 0; k < 2; k++)
            moments[k] += run->grips[i].load*run->ground.places[2*i + k];
}

/* Modes and loads by them: returns what take_turns() does. */
static int take_moments(omniroll_run_t *run, const work_t *work, const int *rests, const int *other)
{
    double moments[2];
    moments_of_contacts(run, moments);
    if (!find_moments(run, work, other, moments))
        return -1;
    int found = have_moments(run, work, rests, other, moments);
#if SET_CORNER_LOADS                /* from above Newton's rule may come to other loads of the same modes          */
    if (found <= 0) {
        memcpy(run->ground.sums + 1, moments, sizeof moments);
        work->under_loads->knows_loads = 1;
        found = have_moments(run, work, rests, other, moments);
        work->under_loads->knows_loads = 0;
    }
#endif
    return found;
}
#endif
