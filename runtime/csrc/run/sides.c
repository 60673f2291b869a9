/* Wheels with two rows of rollers, or with rollers at an angle: which of them carries (maxima/effects/rows.mac, joints.mac).
 *
 * Rollers with even numbers stand in the outer row. A wheel that stands on its joint has the number of its roller plus n,
 * that of the wheel with most rollers, as that of its contact, so that all of this is in the numbers that a run keeps anyway;
 * of two rows n is even. */

/* Whether a wheel stands on its joint. */
ALWAYS_INLINE int pivots(const omniroll_run_t *run, int wheel)
{
    return SET_PIVOTS && run->contact[wheel] >= run->rollers_per_wheel;
}

/* The rate that a row gives. */
static double rate_by(const double *row, const double *nu)
{
    return row[0]*nu[0] + row[1]*nu[1] + row[2]*nu[2];
}

/* The vehicle with the rows that carry times `factor`: -1 gives their neighbours, 0 the wheels' middle. all_turn: wheels that
 * stand turn. */
static void put_rows(const omniroll_run_t *run, const work_t *work, double factor, int all_turn)
{
    lanes_t sides[MOST_WHEELS], turns[MOST_WHEELS];
    for (int i = 0; i < run->wheels; i++) {
        sides[i] = lanes_of(factor*(run->contact[i]%2 ? -1 : 1));
        turns[i] = lanes_of(all_turn || !pivots(run, i));
    }
    set_rows(run->wheels, (vehicle_t *)&work->vehicle, sides, turns);   /* the phase's, in work that a call has for itself */
}

/* The wheels' rates for each of nu at these angles: N x 3. */
static void rows_of_rates(const omniroll_run_t *run, const work_t *work, const lanes_t *chi, double *rows)
{
    for (int k = 0; k < 3; k++) {
        const lanes_t nu[3] = {lanes_of(k == 0), lanes_of(k == 1), lanes_of(k == 2)};
        lanes_t rates[MOST_WHEELS];
        rolling_wheels(run->wheels, &work->vehicle, nu, chi, rates);
        for (int i = 0; i < run->wheels; i++)
            rows[3*i + k] = rates[i][0];
    }
}

/* The wheels' angles times `factor`: where they are at their joints, -1 gives the angles on the neighbours. */
static void angles_times(const omniroll_run_t *run, double factor, lanes_t *chi)
{
    for (int i = 0; i < run->wheels; i++)
        chi[i] = lanes_of(factor*run->chi[i]);
}

/* From now on the rows carry that the contacts' numbers say, and those wheels stand. */
static void carry_rows(omniroll_run_t *run, const work_t *work)
{
    lanes_t chi[MOST_WHEELS];
    put_rows(run, work, 1, 0);
    angles_times(run, 1, chi);
    rows_of_rates(run, work, chi, run->wheel_rows);
}

/* The wheels' rates as somebody knows them who knows of no rows, nor where on their rollers wheels stand. */
static void rates_in_the_middle(const omniroll_run_t *run, const work_t *work, const lanes_t *nu, lanes_t *rates)
{
    lanes_t middle[MOST_WHEELS];
    put_rows(run, work, 0, 1);
    angles_times(run, 0, middle);
    rolling_wheels(run->wheels, &work->vehicle, nu, middle, rates);
    put_rows(run, work, 1, 0);
}

/* The rows of rates with the roller of each wheel, and with its neighbour. */
static void rows_of_both(const omniroll_run_t *run, const work_t *work, double *here, double *there)
{
    lanes_t chi[MOST_WHEELS];
    angles_times(run, 1, chi);
    put_rows(run, work, 1, 1);
    rows_of_rates(run, work, chi, here);
    angles_times(run, -1, chi);
    put_rows(run, work, -1, 1);
    rows_of_rates(run, work, chi, there);
    put_rows(run, work, 1, 0);
}
