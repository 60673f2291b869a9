/* What friction that sticks must obey, checked where each step starts: modes that break it have been decided wrongly, and
 * nothing of the motion from there on may be used. */

#define BROKEN_LAW 1e-3             /* of what sticks at most: far above errors of runs, far below wrong modes     */

/* The wheel on which something that sticks takes more than it can, or -1. Bearings of free rollers come last, those of
 * each wheel together. */
static int unlawful_wheel(const omniroll_run_t *run, const step_t *s)
{
    const int wheels = run->wheels, rollers = run->bearings.count - run->bearings.axle_count;
    const int in_contact = rollers % (wheels*(run->rollers_per_wheel - 1)) ? wheels : 0;
    for (int i = 0; SET_GRIPS && i < wheels; i++)
        if (s->contact.grips[i] && s->slip.excess_start[i] > 2*BROKEN_LAW)  /* squared, less 1                */
            return i;
    for (int k = 0; k < run->bearings.count; k++) {
        const omniroll_bearing_t *const bearing = run->bearings.each + k;
        const int roller = k - run->bearings.axle_count, free = roller - in_contact;
        if (bearing->mode == 0 && bearing->resting && !(fabs(bearing->torque) <= (1 + BROKEN_LAW)*bearing->holding))
            return roller < 0 ? k : free < 0 ? roller : free/(run->rollers_per_wheel - 1);
    }
    return -1;
}
