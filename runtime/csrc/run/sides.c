/* Wheels with two rows of rollers: which row carries (maxima/effects/rows.mac).
 *
 * Rollers with even numbers stand in the outer row. A wheel that stands on its joint has the number of its roller plus n as
 * that of its contact, so that all of this is in the numbers that a run keeps anyway; n is even. */

/* Whether a wheel stands on its joint. */
ALWAYS_INLINE int pivots(const omniroll_run_t *run, int wheel)
{
    return SET_HAS_ROWS && run->contact[wheel] >= run->rollers_per_wheel;
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

/* The wheels' rates for each of nu: N x 3. */
static void rows_of_rates(const omniroll_run_t *run, const work_t *work, double *rows)
{
    for (int k = 0; k < 3; k++) {
        const lanes_t nu[3] = {lanes_of(k == 0), lanes_of(k == 1), lanes_of(k == 2)};
        lanes_t rates[MOST_WHEELS];
        rolling_wheels(run->wheels, &work->vehicle, nu, 0, rates);
        for (int i = 0; i < run->wheels; i++)
            rows[3*i + k] = rates[i][0];
    }
}

/* From now on the rows carry that the contacts' numbers say. */
static void carry_rows(omniroll_run_t *run, const work_t *work)
{
    put_rows(run, work, 1, 0);
    rows_of_rates(run, work, run->wheel_rows);
}

/* The wheels' rates as somebody knows them who knows of no rows. */
static void rates_in_the_middle(const omniroll_run_t *run, const work_t *work, const lanes_t *nu, lanes_t *rates)
{
    put_rows(run, work, 0, 1);
    rolling_wheels(run->wheels, &work->vehicle, nu, 0, rates);
    put_rows(run, work, 1, 0);
}

/* The rows of rates with the roller of each wheel, and with its neighbour. */
static void rows_of_both(const omniroll_run_t *run, const work_t *work, double *here, double *there)
{
    put_rows(run, work, 1, 1);
    rows_of_rates(run, work, here);
    put_rows(run, work, -1, 1);
    rows_of_rates(run, work, there);
    put_rows(run, work, 1, 0);
}
