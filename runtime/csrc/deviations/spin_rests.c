/* How deviations pass where a step begins with other free rollers that stick than the one before it.
 *
 * Where free rollers come to rest on their disks, nu takes their momentum: the projection in the kinetic metric
 * (runtime/omniroll/engine/hold_deviations.py). Where one turns back, rates jump at a time that deviates. Where one
 * breaks away, and takes no more torque then than before, nothing jumps. Anything else the caller decides. */

#if SET_SPINS_STICK
#define SPIN_GRAZES 1e-6            /* of the fastest: a spin that comes to zero more slowly grazes it      */
#define SPIN_JUMPS 1e-9             /* of a rate: it does not jump by less                                  */

/* What changes in a row in which a step ends and the next one begins. */
typedef struct {
    int changed, rests, turned;     /* how many rollers change; of these come to rest; one that turns back, or -1 */
} spin_event_t;

static spin_event_t event_of_spins(const variations_t *w, long long row)
{
    const long long *const after = w->run->free_mode + row*FREE(w), *const before = after - FREE(w);
    spin_event_t found = {.turned = -1};
    for (int k = 0; k < FREE(w); k++)
        if (before[k] != after[k]) {
            found.changed++, found.rests += after[k] == 0;
            if (before[k] && after[k])
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

/* A roller has turned back: the rates jump at the time at which its spin is zero. */
static void turn_back(variations_t *w, int roller, const lanes_t *before, const lanes_t *after)
{
    const int spin = 6 + w->wheels + roller, groups = w->groups;
    for (int g = 0; g < groups; g++) {
        const lanes_t time = -w->moved[spin*groups + g]/before[spin];
        for (int place = 0; place < w->size; place++)
            w->moved[place*groups + g] += (before[place] - after[place])*time;
    }
}

/* What a momentum of 1 about nu_3 gives nu, by a mass matrix (symmetric, by rows). */
static void put_given_momentum(const lanes_t *matrix, double *nu)
{
    double m[9];
    for (int k = 0; k < 9; k++)
        m[k] = matrix[k][0];
    const double u12 = m[1]/m[0], u13 = m[2]/m[0], d22 = m[4] - m[1]*u12, d23 = m[5] - m[1]*u13, u23 = d23/d22;
    nu[2] = 1/(m[8] - m[2]*u13 - d23*u23);
    nu[1] = -u23*nu[2];
    nu[0] = -u12*nu[1] - u13*nu[2];
}

/* The projection on what the free rollers that stick in a row leave. */
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
        double nu[3];
        lanes_t by[3];
        for (int k = 0; k < count; k++)
            spins[k] = own[(6 + wheels + k)*groups];
        set_stuck_momenta_along(wheels, w->vehicle, point + chi, spins, w->free_sticks, zero, zero, zero, matrix,
                                &momentum, unused_matrix, &unused_momentum);
        put_given_momentum(matrix, nu);
        for (int c = 0; c < 3; c++)
            by[c] = nu[c]*momentum, own[c*groups] += by[c];
        set_spins_from_axial_along(wheels, w->vehicle, by, point + chi, zero, zero, zero, zero, jump, unused);
        for (int k = 0; k < count; k++)
            own[(6 + wheels + k)*groups] = (spins[k] + jump[k])*(1 - w->free_sticks[k]);
    }
}

/* Pass what happens where a step begins in a row. Returns 0 where that is left to the caller, and nothing is done. */
static int enter_step(variations_t *w, long long row)
{
    if (w->run->step_of[row - 1] >= 0) {
        const spin_event_t event = event_of_spins(w, row);
        lanes_t before[w->size], after[w->size];
        if (event.changed) {
            rates_in_modes(w, row, row - 1, before);
            if (spin_grazes(w, row, before))
                return 0;
        }
        if (event.changed > event.rests) {
            rates_in_row(w, row, after);
            if (spins_jump(w, before, after)) {
                if (event.changed > 1 || event.turned < 0)
                    return 0;
                turn_back(w, event.turned, before, after);
            }
        }
    }
    project_spins(w, row);
    return 1;
}
#endif
