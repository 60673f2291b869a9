/* How a point moves with time, or as the deviations of a column do, in a row in which something happens. */
#define LETS_GO_TOGETHER 1e-9       /* of the larger one: times that differ by less are the same */
#define TIMES_ALONE (-1)            /* in the place of a column: the tangent of time */

/* The step that ends last in a row or before it, or -1. */
static long long step_before(const variations_t *w, long long row)
{
    while (row > 0 && w->run->motion.step_of[row - 1] < 0)
        row--;
    return row > 0 ? w->run->motion.step_of[row - 1] : -1;
}

/* How inputs move along a column at the end of the last step, or with time. */
static void put_inputs_along(const variations_t *w, long long row, int column)
{
    const omniroll_variations_t *const run = w->run;
    const long long step = step_before(w, row), columns = run->columns;
    const int moving = SET_MOVING*w->wheels, all = SET_INPUTS*w->wheels;
    lanes_t *const to = w->along + point_inputs(w);
    if (step >= 0) {
        const long long first = run->motion.step_rows[step];
        const double h = run->motion.elapsed[first + 1] - run->motion.elapsed[first];
        const double *const given = run->given + step*run->given_size*columns + column;
        const double *const rises = given + (all + held_inputs(w))*columns;
        const double *const drive = run->motion.drive + first*all;
        for (int k = 0; k < moving; k++)
            to[k] = lanes_of(column < 0 ? (drive[all + k] - drive[k])/h : given[k*columns] + h*rises[k*columns]);
        for (int k = 0; k < BEARINGS(w) && column < 0; k++)     /* are constant in a step */
            *torque_of_bearing(w, w->along, k) = lanes_of(0);
        for (int k = 0; k < SET_GATHERS*FREE(w) && column >= 0; k++)
            w->spins.bearing_along[k] = lanes_of(given[(all + k)*columns]);
    }
    for (int k = 0; k < HELD_MOMENTA(w->wheels) && column >= 0; k++)
        w->along[point_momenta(w) + k] = lanes_of(w->given[(moving + k)*w->groups + column/LANES][column%LANES]);
}

/* Let a point move as a column's deviations do, or with time at these rates. */
static void put_tangent(const variations_t *w, long long row, int column, const lanes_t *rate)
{
    put_moved(w, column < 0 ? rate : w->moved, column < 0 ? 1 : w->groups, column < 0 ? 0 : column/LANES, w->along);
    for (int k = 0; k < point_inputs(w) && column >= 0; k++)
        w->along[k] = lanes_of(w->along[k][column%LANES]);
    put_inputs_along(w, row, column);
}

/* By how much the times deviate (columns) at which what moves like this, count x groups, comes to zero at these rates.
 * Returns 0 where that happens apart. */
static int put_times_of_zeros(const variations_t *w, const lanes_t *moved, const double *rate, int count, double *time)
{
    for (int p = 0; p < w->columns; p++) {
        double earliest = INFINITY, latest = -INFINITY;
        for (int j = count - 1; j >= 0; j--) {
            time[p] = -moved[j*w->groups + p/LANES][p%LANES]/rate[j];
            earliest = fmin(earliest, time[p]), latest = fmax(latest, time[p]);
        }
        if (!(latest - earliest <= LETS_GO_TOGETHER*fmax(fabs(earliest), fabs(latest))))
            return refuse(w, HAPPENS_APART, p);
    }
    return 1;
}
