/* How far two runs of one motion are apart, from the rows and polynomials that they left. */

/* nu and the pose at x, in lengths of the step, behind the row `k`. */
static void state_in_step(const omniroll_course_t *course, long long k, double x, double *state)
{
    const double *row = course->rows + k*course->row_size, *step = course->steps + k*course->step_size;
    const double z = 2*x - 1, h = step[0];
    double area[NODES], before = 1, p = z;          /* P_(j-1), P_j */
    area[0] = x;
    for (int j = 1; j < NODES; j++) {
        const double after = ((2*j + 1)*z*p - j*before)/(j + 1);
        area[j] = (after - before)/(2*(2*j + 1));
        before = p;
        p = after;
    }
    for (int c = 0; c < 6; c++) {
        const int place = c < 3 ? c : c + course->wheels;
        const double *coefficients = step + 2 + NODES*place;
        double sum = 0;
        for (int j = 0; j < NODES; j++)
            sum += coefficients[j]*area[j];
        state[c] = row[1 + place] + h*sum;
    }
}

/* nu and the pose at the time `elapsed`, after what happens there; `row` goes on to the last row at or before it. */
static void state_of_course(const omniroll_course_t *course, double elapsed, long long *row, double *state)
{
    while (*row + 1 < course->count && course->rows[(*row + 1)*course->row_size] <= elapsed)
        ++*row;
    const double *here = course->rows + *row*course->row_size;
    const double h = course->steps[*row*course->step_size];
    if (here[0] < elapsed && *row + 1 < course->count && h > 0) {
        state_in_step(course, *row, (elapsed - here[0])/h, state);
        return;
    }
    for (int c = 0; c < 6; c++)
        state[c] = here[1 + (c < 3 ? c : c + course->wheels)];
}

/* Speeds jump at switches, whose times differ a little between two runs: they are compared where both have the same
 * rollers in contact. */
static int same_contacts(const omniroll_course_t *one, long long row, const omniroll_course_t *other, long long second)
{
    const double *a = one->rows + row*one->row_size + one->contact;
    const double *b = other->rows + second*other->row_size + other->contact;
    for (int i = 0; i < one->wheels; i++)
        if (a[i] != b[i])
            return 0;
    return 1;
}

/* The largest distance of ((x, y)/radius, theta, nu/speed) in the middle of each step of `fine` and at its end. */
double omniroll_distance(const omniroll_course_t *coarse, const omniroll_course_t *fine, double radius, double speed)
{
    const double sizes[6] = {speed, speed, speed, radius, radius, 1};
    const double coarse_end = coarse->rows[(coarse->count - 1)*coarse->row_size];
    const double fine_end = fine->rows[(fine->count - 1)*fine->row_size];
    long long row = 0, other = 0;
    double most = 0;
    for (long long k = 0; k < fine->count; k++) {
        const double *here = fine->rows + k*fine->row_size;
        const int last = k + 1 == fine->count;
        if (!last && !(fine->steps[k*fine->step_size] > 0))
            continue;
        const double elapsed = last ? fmin(fine_end, coarse_end) : here[0] + (here[fine->row_size] - here[0])/2;
        if (elapsed > coarse_end)
            continue;
        double a[6], b[6];
        if (last)
            row = 0;                                /* where the coarse run ended early */
        state_of_course(fine, elapsed, &row, a);
        state_of_course(coarse, elapsed, &other, b);
        const int alike = same_contacts(fine, row, coarse, other);
        for (int c = alike ? 0 : 3; c < 6; c++) {
            const double apart = fabs(a[c] - b[c])/sizes[c];
            most = apart <= most ? most : apart;    /* also one that is not a number */
        }
    }
    return most;
}
