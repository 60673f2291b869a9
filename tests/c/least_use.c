/* The compiled engine's least use alone. For each case of the input, a line of numbers: how many forces and parts, the
 * forces' rows, the force that they are to give, what each part takes of them (2 x forces) and of itself (2),
 * and a number by which the parts become larger for the forces of least norm.
 * It prints a line each: the least use, forces that make it, and the forces of least norm. */
#include "lanes.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define MOST_WHEELS 16
#define SET_STANDS 1
#define SET_STANDS_BOTH_WAYS 1
#define SET_GRIPS 1
#define EPS 2.220446049250313e-16
#define PASSED 16

#include "linear.c"
#include "bearings/complementarity.c"
#include "ground/least_use.c"

static double next(void)
{
    double number;
    return scanf("%lf", &number) == 1 ? number : NAN;
}

static void show(const double *numbers, int count)
{
    for (int k = 0; k < count; k++)
        printf("%.17g ", numbers[k]);
}

int main(void)
{
    static bearings_t rows;
    static uses_t uses;
    while (scanf("%d %d", &rows.count, &uses.parts) == 2) {
        vector3_t force;
        double forces[MOST_STANDING], wider;
        uses.count = rows.count;
        for (int d = 0; d < rows.count; d++)
            for (int k = 0; k < 3; k++)
                rows.rows[d][k] = next();
        for (int k = 0; k < 3; k++)
            force[k] = next();
        for (int part = 0; part < uses.parts; part++)
            for (int c = 0; c < 2; c++)
                for (int d = 0; d < rows.count; d++)
                    uses.per_force[part][c][d] = next();
        for (int part = 0; part < uses.parts; part++)
            for (int c = 0; c < 2; c++)
                uses.given[part][c] = next();
        wider = next();
        const double use = least_use(&rows, force, &uses, forces);
        show(&use, 1);
        show(forces, rows.count);
        for (int part = 0; part < uses.parts; part++) {
            for (int c = 0; c < 2; c++) {
                uses.given[part][c] /= wider*use;
                for (int d = 0; d < rows.count; d++)
                    uses.per_force[part][c][d] /= wider*use;
            }
        }
        least_norm_within(&rows, force, &uses, forces);
        show(forces, rows.count);
        printf("\n");
    }
    return 0;
}
