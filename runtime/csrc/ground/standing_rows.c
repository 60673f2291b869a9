/* Wheels that stand: the rows of their rates, and what these leave of nu. */
#define FROM_REST 1e6               /* s: in which a rate that settles makes the least speed that others are rounded against */

/* The rates of the wheels for each of nu. */
static void rows_of_wheels(const omniroll_run_t *run, const work_t *work, vector3_t *rows)
{
    for (int k = 0; k < 3; k++) {
        const lanes_t nu[3] = {lanes_of(k == 0), lanes_of(k == 1), lanes_of(k == 2)};
        lanes_t speeds[MAX_WHEELS];
        rolling_wheels(run->wheels, &work->vehicle, nu, 0, speeds);
        for (int i = 0; i < run->wheels; i++)
            rows[i][k] = speeds[i][0];
    }
}

/* The place among the bearings of the one that holds a wheel in a direction; -1 where it has none that may stick.
 * Directions are counted over all wheels, of each first that along its axle. */
ALWAYS_INLINE int place_in_direction(const omniroll_run_t *run, int direction)
{
    if (direction%2)
        return SET_AXLES_STICK ? direction/2 : -1;
    return SET_ROLLERS_TURN ? (SET_AXLES_STICK ? run->wheels : 0) + direction/2 : -1;
}

/* What a unit force on each wheel in each direction does to nu, in some unit. */
static void rows_in_directions(const omniroll_run_t *run, const work_t *work, vector3_t *rows)
{
    vector3_t of_wheels[MAX_WHEELS];
    rows_of_wheels(run, work, of_wheels);
    for (int i = 0; i < run->wheels; i++) {
        const int roller = place_in_direction(run, 2*i);
        for (int k = 0; k < 3; k++) {
            rows[2*i][k] = roller < 0 ? 0 : run->ground.reach*core_bearings(run)[roller].row[k];
            rows[2*i + 1][k] = -run->ground.arms[2]*of_wheels[i][k];
        }
    }
}

/* What the rates of wheels that stand, which are zero, leave of nu. */
static void allow_what_stands(omniroll_run_t *run, const bearings_t *rows)
{
    static const vector3_t unit[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    memcpy(run->hold.directions, any_motion, sizeof any_motion);
    memset(run->hold.absent, 0, sizeof run->hold.absent);
    if (rows->count)
        directions_allowed(rows, unit, run->hold.directions, run->hold.absent);
}

/* Take from nu what makes these rates; whether there are any. */
static int forbid_rates(omniroll_run_t *run, const bearings_t *rows)
{
    vector3_t basis[3];
    if (!rows->count)
        return 0;
    const int rank = span_of(rows, basis);
    take_across(rank, (const vector3_t *)basis, run->state.nu);
    if (rank == 3)
        memset(run->state.nu, 0, sizeof(vector3_t));
    return 1;
}

