/* Wheels that stand in different sets of contacts and axles: what each set leaves of nu. The numbered rules are in
 * runtime/omniroll/effects/ground_with_axles.py. */
#if SET_STANDS
#define FROM_REST 1e6               /* s: see ground_with_axles.py                                          */

static const double any_motion[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

/* The rates of the wheels for each of nu. */
static void rows_of_wheels(const omniroll_run_t *run, const work_t *work, vector3_t *rows)
{
    for (int k = 0; k < 3; k++) {
        const lanes_t nu[3] = {lanes_of(k == 0), lanes_of(k == 1), lanes_of(k == 2)};
        lanes_t speeds[MOST_WHEELS];
        set_wheel_speeds(run->wheels, &work->vehicle, nu, speeds);
        for (int i = 0; i < run->wheels; i++)
            rows[i][k] = speeds[i][0];
    }
}

#if SET_LOADS
/* One lane of an instant in which these contacts stick, and axles whose modes are 0. */
static void stand_in_lane(const omniroll_run_t *run, const work_t *work, const vector3_t *rows, const int *sticks,
                          const int *axle_mode, int lane, instant_t *now)
{
    static const vector3_t unit[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    bearings_t standing = {.count = 0};
    double directions[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, absent[3] = {0, 0, 0};
    for (int i = 0; i < run->wheels; i++) {
        work->own.sticks[i][lane] = axle_mode[i] == 0;
        if (sticks[i] && axle_mode[i] == 0)
            memcpy(standing.rows[standing.count++], rows[i], sizeof rows[i]);
    }
    if (standing.count)
        directions_allowed(&standing, unit, directions, absent);
    for (int k = 0; k < 9; k++)
        now->directions[k][lane] = directions[k];
    for (int k = 0; k < 3; k++)
        now->absent[k][lane] = absent[k];
}
#endif
#endif
