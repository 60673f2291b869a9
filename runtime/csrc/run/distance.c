/* How far two runs of one motion are apart, from the rows and polynomials of their rows. */
#define ROWS_OF_INSTANT 8           /* so many rows back a step may stand that ended just before            */
#define FURTHEST 1.01               /* so many lengths of a step its polynomials are evaluated at           */

/* nu and the pose at x, in lengths of the step, behind the row `k`. */
static void state_in_step(const omniroll_course_t *course, long long k, double x, double *state)
{
    const double *row = course->rows + k*course->row_size, *step = course->steps + k*course->step_size;
    const double h = step[0];
    double area[NODES];
    legendre_areas(x, area);
    for (int c = 0; c < 6; c++) {
        const int place = c < 3 ? c : c + course->wheels;
        const double *coefficients = step + 2 + NODES*place;
        double sum = 0;
        for (int j = 0; j < NODES; j++)
            sum += coefficients[j]*area[j];
        state[c] = row[1 + place] + h*sum;
    }
}

static const double *row_of(const omniroll_course_t *course, long long k)
{
    return course->rows + k*course->row_size;
}

static int starts_step(const omniroll_course_t *course, long long k)
{
    return k + 1 < course->count && course->steps[k*course->step_size] > 0;
}

static int same_contacts(const omniroll_course_t *course, const double *row, const double *other)
{
    for (int i = course->contact; i < course->contact + course->wheels; i++)
        if (row[i] != other[i])
            return 0;
    return 1;
}

/* nu and the pose at the time `elapsed`, with the rollers in contact that they have in the row `wanted`: where the run
 * has passed to others just before, its last step is continued by that little. `row` goes on to the last row at or
 * before that time. Returns whether there are such rollers; else the state is that with others. */
static int state_of_course(const omniroll_course_t *course, double elapsed, const double *wanted, long long *row,
                           double *state)
{
    while (*row + 1 < course->count && row_of(course, *row + 1)[0] <= elapsed)
        ++*row;
    const double *here = row_of(course, *row);
    const int alike = same_contacts(course, here, wanted);
    long long from = *row;
    for (int back = 0; !alike && back < ROWS_OF_INSTANT && from > 0; back++) {
        from--;
        const double *before = row_of(course, from);
        const double h = course->steps[from*course->step_size];
        if (starts_step(course, from) && same_contacts(course, before, wanted)) {
            if (elapsed - before[0] > FURTHEST*h)
                break;
            state_in_step(course, from, (elapsed - before[0])/h, state);
            return 1;
        }
    }
    if (here[0] < elapsed && starts_step(course, *row))
        state_in_step(course, *row, (elapsed - here[0])/course->steps[*row*course->step_size], state);
    else
        for (int c = 0; c < 6; c++)
            state[c] = here[1 + (c < 3 ? c : c + course->wheels)];
    return alike;
}

/* The largest distance of ((x, y)/radius, theta, nu/speed) at the ends of the coarse run's steps. There collocation is
 * far better than inside the steps, where each run knows its error. Speeds jump at switches, whose times differ a
 * little: they are compared with the same rollers in contact. */
double omniroll_distance(const omniroll_course_t *coarse, const omniroll_course_t *fine, double radius, double speed)
{
    const double sizes[6] = {speed, speed, speed, radius, radius, 1};
    const double end = row_of(fine, fine->count - 1)[0];
    long long row = 0;
    double largest = 0;
    for (long long k = 0; k + 1 < coarse->count; k++) {
        const double *reached = row_of(coarse, k + 1);
        if (!starts_step(coarse, k) || reached[0] > end)
            continue;
        double state[6];
        const int alike = state_of_course(fine, reached[0], reached, &row, state);
        for (int c = alike ? 0 : 3; c < 6; c++) {
            const double apart = fabs(state[c] - reached[1 + (c < 3 ? c : c + coarse->wheels)])/sizes[c];
            largest = apart <= largest ? largest : apart;  /* also one that is not a number */
        }
    }
    return largest;
}
