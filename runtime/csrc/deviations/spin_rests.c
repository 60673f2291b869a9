/* How deviations pass where a step begins with other free rollers that stick than the one before it.
 *
 * Where free rollers come to rest on their disks, nu takes their momentum: the projection in the kinetic metric
 * (runtime/omniroll/engine/hold_deviations.py). Where one turns back, or breaks away from more torque than it takes as
 * it turns, rates jump at a time that deviates: d+ = d- + (f- - f+) dt. Anything else the caller decides. */

#if SET_SPINS_STICK
#define SPIN_GRAZES 1e-6            /* of the fastest: a spin that comes to zero more slowly grazes it      */
#define SPIN_JUMPS 1e-9             /* of a rate: it does not jump by less                                  */
#define SPIN_REACHED 1e-6           /* of what can hold a roller: it has been reached                       */

/* What changes in a row in which a step ends and the next one begins. */
typedef struct {
    int changed, rests;             /* how many rollers change; of these come to rest                       */
    int turned;                     /* one that turns on: back, or away from rest                           */
} spin_event_t;

static spin_event_t event_of_spins(const variations_t *w, long long row)
{
    const long long *const after = w->run->free_mode + row*FREE(w), *const before = after - FREE(w);
    spin_event_t found = {0};
    for (int k = 0; k < FREE(w); k++)
        if (before[k] != after[k]) {
            found.changed++, found.rests += after[k] == 0;
            found.turned = k;
        }
    return found;
}

/* Whether rates of nu or of spins jump. */
static int spins_jump(const variations_t *w, const lanes_t *before, const lanes_t *after)
{
    double jump[2] = {0}, size[2] = {0};
    for (int place = 0; place < w->size; place++) {
        const int part = place >= 6 + w->wheels;
        if (place >= 3 && !part)
            continue;
        jump[part] = fmax(jump[part], fabs(before[place][0] - after[place][0]));
        size[part] = fmax(size[part], fmax(fabs(before[place][0]), fabs(after[place][0])));
    }
    return jump[0] > SPIN_JUMPS*size[0] || jump[1] > SPIN_JUMPS*size[1];
}

/* Whether a spin that comes to zero in a row, before which the rates have been these, only just does. */
static int spin_grazes(const variations_t *w, long long row, const lanes_t *rate)
{
    const long long *const after = w->run->free_mode + row*FREE(w), *const before = after - FREE(w);
    const lanes_t *const own = rate + 6 + w->wheels;
    double fastest = 0;
    for (int k = 0; k < FREE(w); k++)
        fastest = fmax(fastest, fabs(own[k][0]));
    for (int k = 0; k < FREE(w); k++)
        if (before[k] && before[k] != after[k] && !(fabs(own[k][0]) > SPIN_GRAZES*fastest))
            return 1;
    return 0;
}

/* A roller turns back where its spin is zero: by how much the time deviates. */
static void put_times_of_turn(const variations_t *w, int roller, const lanes_t *before, lanes_t *time)
{
    const int spin = 6 + w->wheels + roller;
    for (int g = 0; g < w->groups; g++)
        time[g] = -w->moved[spin*w->groups + g]/before[spin];
}

/* A direction along the motion before a row in which a step ends. */
static void put_motion(const variations_t *w, long long row, const lanes_t *rate)
{
    const double length = w->run->elapsed[row] - w->run->elapsed[row - 1];
    const double *const then = w->run->drive + row*SET_INPUTS*w->wheels, *const first = then - SET_INPUTS*w->wheels;
    for (int k = 0; k < w->size; k++)
        if (point_of_place(w, k) >= 0)
            w->along[point_of_place(w, k)] = rate[k];
    for (int u = 0; u < SET_MOVING*w->wheels; u++)
        w->along[point_inputs(w) + u] = lanes_of((then[u] - first[u])/length);
}

/* A direction along the deviations there, in a vector of columns. */
static void put_deviations(const variations_t *w, long long row, int group)
{
    const int groups = w->groups;
    const double length = w->run->elapsed[row] - w->run->elapsed[row - 1];
    put_moved(w, w->moved, group, w->along);
    for (int u = 0; u < SET_MOVING*w->wheels; u++)
        w->along[point_inputs(w) + u] = w->given[u*groups + group] + length*w->given[(w->inputs + u)*groups + group];
    for (int k = 0; k < FREE(w); k++)
        w->spins.bearing_along[k] = (1 - w->spins.sticks[k])*w->spins.torque_moved[k*groups + group];
}

/* Whether it is this roller alone that what holds it, in w->spins.holding, has brought to its bound. */
static int comes_alone(const variations_t *w, int roller)
{
    for (int k = 0; k < FREE(w); k++) {
        const int reached = w->spins.sticks[k][0] != 0
            && fabs(w->spins.holding[k][0]) >= (1 - SPIN_REACHED)*w->run->free_most[k];
        if (reached != (k == roller))
            return 0;
    }
    return 1;
}

/* A roller breaks away where what holds it comes to its bound: by how much the time deviates. Returns 0 where others
 * are at theirs, or where it only just comes there. */
static int put_times_of_release(variations_t *w, long long row, int roller, const lanes_t *before, lanes_t *time)
{
    const double most = w->run->free_most[roller];
    lanes_t nu_dot[3], nu_dot_along[3];
    put_state(w, row, w->point);
    put_spin_modes(w, row - 1);
    put_held(w, row - 1, -1);
    put_motion(w, row, before);
    const point_t by_time = point_of(w, w->vehicle, w->point), in_time = point_of(w, w->vehicle, w->along);
    rates_at(w, &by_time, &in_time, nu_dot, nu_dot_along);
    const double side = w->spins.holding[roller][0] < 0 ? -1 : 1, slope = side*in_time.free_holding[roller][0];
    const int is_known = comes_alone(w, roller) && slope*w->run->held_for[row] > SPIN_GRAZES*most;
    for (int g = 0; g < w->groups && is_known; g++) {
        put_deviations(w, row, g);
        const point_t at = point_of(w, &w->column[g], w->point), along = point_of(w, at.vehicle, w->along);
        rates_at(w, &at, &along, nu_dot, nu_dot_along);
        time[g] = -side*along.free_holding[roller]/slope;
        for (int p = g*LANES; p < w->columns && p < (g + 1)*LANES; p++)
            time[g][p%LANES] += w->run->free_most_moved[p*FREE(w) + roller]/slope;
    }
    memset(w->along, 0, point_size(w)*sizeof *w->along);
    memset(w->spins.bearing_along, 0, FREE(w)*sizeof *w->spins.bearing_along);
    return is_known;
}

/* Whether all directions are left to nu in a row. */
static int nothing_else_sticks(const variations_t *w, long long row)
{
    const double *const absent = w->run->allowed + w->run->hold[row]*(12 + 9*(w->run->models - 1)) + 9;
    return absent[0] == 0 && absent[1] == 0 && absent[2] == 0;
}

/* A roller turns on, where that makes rates jump. Returns 0 where that is left to the caller. */
static int turn_on(variations_t *w, long long row, spin_event_t event, const lanes_t *before)
{
    const int starts = w->run->free_mode[(row - 1)*FREE(w) + event.turned] == 0;
    lanes_t after[w->size], time[w->groups];
    rates_in_row(w, row, after);
    if (!spins_jump(w, before, after))
        return 1;
    if (event.changed > 1 || (starts && !nothing_else_sticks(w, row)))
        return 0;
    if (starts && !put_times_of_release(w, row, event.turned, before, time))
        return 0;
    if (!starts)
        put_times_of_turn(w, event.turned, before, time);
    for (int place = 0; place < w->size; place++)
        for (int g = 0; g < w->groups; g++)
            w->moved[place*w->groups + g] += (before[place] - after[place])*time[g];
    return 1;
}

/* What forces do to nu, 3 x 3, where what sticks in a row leaves it the directions A: A (A^T M A)^-1 A^T. */
static void put_yields(const variations_t *w, long long row, const lanes_t *matrix, double *yields)
{
    const double *const A = w->run->allowed + w->run->hold[row]*(12 + 9*(w->run->models - 1)), *const absent = A + 9;
    double half[9] = {0}, left[9] = {0}, inverse[9];
    for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++)
            for (int c = 0; c < 3; c++)
                half[3*a + b] += matrix[3*a + c][0]*A[3*c + b];
    for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++) {
            left[3*a + b] = a == b ? absent[a] : 0;
            for (int c = 0; c < 3; c++)
                left[3*a + b] += A[3*c + a]*half[3*c + b];
        }
    for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++) {
            const int c = (a + 1)%3, d = (a + 2)%3, e = (b + 1)%3, f = (b + 2)%3;
            inverse[3*a + b] = left[3*c + e]*left[3*d + f] - left[3*c + f]*left[3*d + e];
        }
    const double determinant = left[0]*inverse[0] + left[1]*inverse[1] + left[2]*inverse[2];
    for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++) {
            yields[3*a + b] = 0;
            for (int c = 0; c < 3; c++)
                for (int d = 0; d < 3; d++)
                    yields[3*a + b] += A[3*a + c]*inverse[3*c + d]/determinant*A[3*b + d];
        }
}

/* How nu turns with the directions that it has left, in a vector of columns. */
static void put_beside(const variations_t *w, long long row, int group, lanes_t *beside)
{
    const double *const A = w->run->allowed + w->run->hold[row]*(12 + 9*(w->run->models - 1));
    memset(beside, 0, 3*sizeof *beside);
    for (int p = group*LANES; p < w->columns && p < (group + 1)*LANES; p++) {
        const double *const turning = A + 12 + 9*(w->run->number[p] - 1);
        for (int k = 0; w->run->number[p] && k < 3; k++) {
            double along = 0;
            for (int c = 0; c < 3; c++)
                along += A[3*c + k]*w->point[POINT_NU + c][0];
            for (int c = 0; c < 3; c++)
                beside[c][p%LANES] += turning[3*c + k]*along;
        }
    }
}

/* The deviations of nu that are left of those in a vector of columns, with a momentum of nu_3 that it gets. */
static void project_nu(const variations_t *w, long long row, int group, const lanes_t *matrix, lanes_t momentum,
                       lanes_t *nu)
{
    lanes_t beside[3], pull[3] = {{0}};
    double yields[9];
    put_yields(w, row, matrix, yields);
    put_beside(w, row, group, beside);
    pull[2] = momentum;
    for (int c = 0; c < 3; c++)
        for (int d = 0; d < 3; d++)
            pull[c] += matrix[3*c + d]*(nu[d] - beside[d]);
    for (int c = 0; c < 3; c++)
        nu[c] = beside[c] + yields[3*c]*pull[0] + yields[3*c + 1]*pull[1] + yields[3*c + 2]*pull[2];
}

/* The projection on what all that sticks in a row leaves. */
static void project_spins(variations_t *w, long long row)
{
    const int wheels = OWN_WHEELS(w->wheels), count = FREE(w), chi = point_chi(w), groups = w->groups;
    const lanes_t *const point = w->point;
    lanes_t zero[count + MOST_WHEELS], spins[count], jump[count], unused[count], matrix[9], unused_matrix[9];
    lanes_t momentum, unused_momentum;
    memset(zero, 0, sizeof zero);
    put_state(w, row, w->point);
    put_spin_modes(w, row);
    for (int g = 0; g < groups; g++) {
        lanes_t *const own = w->moved + g;
        lanes_t nu[3], by[3];
        for (int k = 0; k < count; k++)
            spins[k] = own[(6 + wheels + k)*groups];
        for (int c = 0; c < 3; c++)
            nu[c] = own[c*groups];
        set_stuck_momenta_along(wheels, w->vehicle, point + chi, spins, w->spins.sticks, zero, zero, zero, matrix,
                                &momentum, unused_matrix, &unused_momentum);
        project_nu(w, row, g, matrix, momentum, nu);
        for (int c = 0; c < 3; c++)
            by[c] = nu[c] - own[c*groups], own[c*groups] = nu[c];
        set_spins_from_axial_along(wheels, w->vehicle, by, point + chi, zero, zero, zero, zero, jump, unused);
        for (int k = 0; k < count; k++)
            own[(6 + wheels + k)*groups] = (spins[k] + jump[k])*(1 - w->spins.sticks[k]);
    }
}

/* Pass what happens where a step begins in a row. Returns 0 where that is left to the caller, and nothing is done. */
static int enter_step(variations_t *w, long long row)
{
    if (row > 0 && w->run->step_of[row - 1] >= 0) {
        const spin_event_t event = event_of_spins(w, row);
        lanes_t before[w->size];
        if (event.changed) {
            rates_in_modes(w, row, row - 1, before);
            if (spin_grazes(w, row, before))
                return 0;
        }
        if (event.changed > event.rests && !turn_on(w, row, event, before))
            return 0;
    }
    project_spins(w, row);
    return 1;
}
#endif
