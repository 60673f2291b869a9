/* The compiled engine's complementarity problem alone. For each case of the input, a line of numbers: how many bearings,
 * their rows, their bounds, the mass matrix, the force, a force that they can hold.
 * It prints a line each: nu', the torques that make it, the largest part of its reach that the second force asks a facet
 * for, and the least torques that hold that force, and this force made larger by some roundings. */
#include "lanes.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define MOST_WHEELS 64
#define SET_BEARINGS 1
#define SET_HOLDS 1
#define EPS 2.220446049250313e-16
#define PASSED 16

#define SET_DECIDES 1
#define FRICTION_LINKAGE static inline

#include "linear.c"
#include "friction/elimination.c"
#include "friction/balls.c"
#include "friction/interior.c"
#include "friction/active_set.c"
#include "friction/elements.c"
#include "run/elements_at_rest.c"
#include "bearings/complementarity.c"

static void read(double *numbers, int count)
{
    for (int k = 0; k < count; k++)
        if (scanf("%lf", numbers + k) != 1)
            numbers[k] = NAN;
}

static void show(const double *numbers, int count)
{
    for (int k = 0; k < count; k++)
        printf("%.17g ", numbers[k]);
}

/* Room for the problem of so many bearings. */
static elements_t room_for_bearings(void)
{
    enum { MOST = MOST_WHEELS };
    static double matrix[MOST*MOST], vectors[6][MOST], equality[3*MOST], wanted[3], powers[2*MOST];
    static friction_element_t element[MOST];
    static int state[MOST];
    static char memory[4000000];
    return (elements_t){
        .width = 1, .matrix = matrix, .given = vectors[0], .reach = vectors[1], .force = vectors[2], .rate = vectors[3],
        .pull = vectors[4], .yaw_rows = vectors[5], .equality = equality, .wanted = wanted, .element = element,
        .powers = powers, .state = state, .memory = friction_memory(MOST, MOST, 0, 3) < sizeof memory ? memory : 0,
    };
}

int main(void)
{
    elements_t problem = room_for_bearings();
    (void)directions_allowed;           /* of a run */
    static bearings_t bearings;
    static facet_t facets[MOST_WHEELS*(MOST_WHEELS + 1)];
    while (scanf("%d", &bearings.count) == 1) {
        vector3_t mass[3], force, held, nu_dot;
        double torques[MOST_WHEELS], most = 0;
        read(bearings.rows[0], 3*bearings.count);
        read(bearings.bounds, bearings.count);
        read(mass[0], 9);
        read(force, 3);
        read(held, 3);
        nearest_force((const vector3_t *)mass, force, &bearings, &problem, nu_dot, torques);
        show(nu_dot, 3);
        show(torques, bearings.count);
        const int count = facets_of(&bearings, facets);
        for (int k = 0; k < count; k++)
            most = fmax(most, dot3(facets[k].normal, held)/facets[k].reach);
        show(&most, 1);
        for (int larger = 0; larger < 2; larger++) {
            least_torques(&bearings, held, &problem, torques);
            show(torques, bearings.count);
            for (int k = 0; k < 3; k++)
                held[k] *= 1 + 256*EPS;
        }
        printf("\n");
    }
    return 0;
}
