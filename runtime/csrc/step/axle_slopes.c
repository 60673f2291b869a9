/* Slopes of nu' where friction in the wheels' axles makes the rates stiff, for Newton's rule in stiff.c.
 *
 * Such friction depends on the rate of its own wheel alone: each wheel adds row' row times the slope of its torque, over
 * the mass matrix. So with three wheels the change of nu' where all wheels become faster by 1 tells all slopes, by one
 * evaluation in the place of three. Whether axles alone make the slopes is looked at wherever three differences have
 * told them. */
/* For how many wheels axles' friction tells the slopes of nu'; what else follows nu makes it stiff as well. */
#define AXLES (SET_SLIPS || SET_CORE_PARTS || SET_CHI_FEEDS_BACK ? 0 : 3)
#define OF_AXLES 0.2                            /* h times what it leaves of a slope, at most                 */

/* The rows of the wheels' rates in nu. */
typedef struct {
    double row[9], inverse[9];
    double all[3];                              /* nu where all rates are 1                               */
    int known;                                  /* whether there are three, not all alike                */
} axles_t;

/* The inverse of a 3 x 3 matrix by rows, times its determinant; of numbers or of lanes. */
#define ADJUGATE(m, out) do { \
        for (int k_ = 0; k_ < 3; k_++) \
            for (int l_ = 0; l_ < 3; l_++) { \
                const int a_ = (l_ + 1)%3, b_ = (l_ + 2)%3, c_ = (k_ + 1)%3, d_ = (k_ + 2)%3; \
                (out)[3*k_ + l_] = (m)[3*a_ + c_]*(m)[3*b_ + d_] - (m)[3*a_ + d_]*(m)[3*b_ + c_]; \
            } \
    } while (0)

ALWAYS_INLINE void find_axles(const step_t *s, const int wheels, axles_t *axles)
{
    double size = 0;
    axles->known = 0;
    if (wheels != AXLES)
        return;
    for (int l = 0; l < 3; l++) {
        lanes_t nu[3] = {lanes_of(l == 0), lanes_of(l == 1), lanes_of(l == 2)}, rate[MAX_WHEELS];
        rolling_wheels(wheels, s->vehicle, nu, 0, rate);
        for (int i = 0; i < AXLES; i++)
            axles->row[3*i + l] = rate[i][0];
    }
    ADJUGATE(axles->row, axles->inverse);
    const double determinant = axles->row[0]*axles->inverse[0] + axles->row[1]*axles->inverse[3]
        + axles->row[2]*axles->inverse[6];
    for (int k = 0; k < 9; k++)
        size = fmax(size, fabs(axles->row[k]));
    axles->known = fabs(determinant) > 1e-3*size*size*size;
    for (int k = 0; k < 9; k++)
        axles->inverse[k] /= determinant;
    for (int l = 0; l < 3; l++)
        axles->all[l] = axles->inverse[3*l] + axles->inverse[3*l + 1] + axles->inverse[3*l + 2];
}

/* The slopes of nu' at vector b of the nodes from the change of nu' where all wheels become faster by 1. */
ALWAYS_INLINE void slopes_of_axles(const step_t *s, const int wheels, int b, const axles_t *axles, const lanes_t *change,
                                   lanes_t *slope)
{
    lanes_t chi[MAX_WHEELS], mass[9], inverse[9], force[3], torque[AXLES];
    for (int i = 0; i < wheels; i++)
        chi[i] = lanes_clamp(s->at_chi[i].lanes[b], s->joint[i]);
    set_mass_matrix(wheels, s->vehicle, chi, mass);
    ADJUGATE(mass, inverse);
    const lanes_t determinant = mass[0]*inverse[0] + mass[1]*inverse[3] + mass[2]*inverse[6];
    for (int k = 0; k < 3; k++)
        force[k] = mass[3*k]*change[0] + mass[3*k + 1]*change[1] + mass[3*k + 2]*change[2];
    for (int i = 0; i < AXLES; i++)
        torque[i] = (axles->inverse[i]*force[0] + axles->inverse[3 + i]*force[1] + axles->inverse[6 + i]*force[2])
            /determinant;
    for (int k = 0; k < 3; k++)
        for (int l = 0; l < 3; l++) {
            slope[3*k + l] = lanes_of(0);
            for (int i = 0; i < AXLES; i++)
                slope[3*k + l] += (inverse[3*k]*axles->row[3*i] + inverse[3*k + 1]*axles->row[3*i + 1]
                                   + inverse[3*k + 2]*axles->row[3*i + 2])*torque[i]*axles->row[3*i + l];
        }
}

/* The same by one difference at a point in vector b of the nodes. */
ALWAYS_INLINE void slopes_by_axles(step_t *s, const int wheels, int b, const point_t *point, arrays_t *at,
                                   const axles_t *axles)
{
    const double by = FINE_DIFFERENCE*s->size/fmax(largest3(axles->all), 1e-300);
    lanes_t here[3], nu_dot[3], change[3], slope[9];
    for (int l = 0; l < 3; l++) {
        here[l] = at->nu[l];
        at->nu[l] = here[l] + by*axles->all[l];
        if (CORE_FOLLOWS)
            for (int c = 0; c < s->core; c++)
                s->core_here[c] += (at->nu[l] - here[l])*followed(s, c, l, b);
    }
    core_rates(wheels, point, nu_dot);
    for (int k = 0; k < 3; k++) {
        change[k] = (nu_dot[k] - s->stiff.found_nu[k].lanes[b])/by;
        at->nu[k] = here[k];
    }
    for (int c = 0; c < s->core; c++)
        s->core_here[c] = core_at(s, b)[c];
    slopes_of_axles(s, wheels, b, axles, change, slope);
    for (int k = 0; k < 9; k++)
        s->stiff.slope_nu[k].lanes[b] = slope[k];
}

/* Whether axles' friction alone makes the slopes that differences have told. */
static int axles_make_slopes(const step_t *s, const int wheels, const axles_t *axles)
{
    double residual = 0;
    for (int b = 0; b < BLOCKS && axles->known; b++) {
        lanes_t change[3], slope[9];
        for (int k = 0; k < 3; k++)
            change[k] = s->stiff.slope_nu[3*k].lanes[b]*axles->all[0]
                + s->stiff.slope_nu[3*k + 1].lanes[b]*axles->all[1]
                + s->stiff.slope_nu[3*k + 2].lanes[b]*axles->all[2];
        slopes_of_axles(s, wheels, b, axles, change, slope);
        for (int k = 0; k < 9; k++)
            residual = fmax(residual, s->h*lanes_largest(slope[k] - s->stiff.slope_nu[k].lanes[b]));
    }
    return axles->known && residual < OF_AXLES;
}
