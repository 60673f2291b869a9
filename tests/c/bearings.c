/* The compiled engine's complementarity problem alone. For each case of the input, a line of numbers: how many bearings,
 * their rows, their bounds, the mass matrix, the force, a force that they can hold.
 * It prints a line each: nu', the torques that make it, the largest part of its reach that the second force asks a facet
 * for, and the least torques that hold that force, and this force made larger by some roundings. */
#include "lanes.h"

#include <math.h>
#include <stdio.h>

#define MOST_WHEELS 64
#define SET_BEARINGS 1
#define SET_HOLDS 1
#define EPS 2.220446049250313e-16
#define PASSED 16

#include "linear.c"
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

int main(void)
{
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
        nearest_force((const vector3_t *)mass, force, &bearings, facets, nu_dot, torques);
        show(nu_dot, 3);
        show(torques, bearings.count);
        const int count = facets_of(&bearings, facets);
        for (int k = 0; k < count; k++)
            most = fmax(most, dot3(facets[k].normal, held)/facets[k].reach);
        show(&most, 1);
        for (int larger = 0; larger < 2; larger++) {
            least_torques(&bearings, held, torques);
            show(torques, bearings.count);
            for (int k = 0; k < 3; k++)
                held[k] *= 1 + 256*EPS;
        }
        printf("\n");
    }
    return 0;
}
