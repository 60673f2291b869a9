/* A controller's use of the generated C, and all that it needs: one header and one source file. */
#include <stdio.h>

#include "omniroll_free.h"

enum { WHEELS = 3, ROLLERS = 5 };

static void show(const char *name, int length, const real_t *values)
{
    printf("%s", name);
    for (int k = 0; k < length; k++)
        printf(" %.21Lg", (long double)values[k]);
    printf("\n");
}

int main(void)
{
    const real_t mass = 2.25, yaw_inertia = 0.0625, wheel_inertia = 0.0009765625, roller_inertia = 0.00001;
    const real_t yaw_scale = 3.5, platform_radius = 0.15625, wheel_radius = 0.0703125;
    const real_t roller_axis_radius = 0.05, wheel_angles[WHEELS] = {0, 2, 4};
    const real_t nu[3] = {0.75, -0.25, 1}, chi[WHEELS] = {0.5, -0.125, 0.25};
    const real_t spins[WHEELS * (ROLLERS - 1)] = {1, 2, -3, 4, 0.5, -0.25, 0, 8, -1, 5, 7, -6};
    real_t model[64], nu_dot[3], spins_dot[WHEELS * (ROLLERS - 1)];

    if (omniroll_free_model_size(WHEELS, ROLLERS) > sizeof model / sizeof model[0])
        return 1;
    omniroll_free_prepare(WHEELS, ROLLERS, mass, yaw_inertia, wheel_inertia, roller_inertia, yaw_scale,
                          platform_radius, wheel_radius, roller_axis_radius, wheel_angles, model);
    omniroll_free_accelerations(WHEELS, ROLLERS, model, nu, chi, spins, nu_dot, spins_dot);

    show("mass", 1, &mass);
    show("yaw_inertia", 1, &yaw_inertia);
    show("wheel_inertia", 1, &wheel_inertia);
    show("roller_inertia", 1, &roller_inertia);
    show("yaw_scale", 1, &yaw_scale);
    show("platform_radius", 1, &platform_radius);
    show("wheel_radius", 1, &wheel_radius);
    show("roller_axis_radius", 1, &roller_axis_radius);
    show("wheel_angles", WHEELS, wheel_angles);
    show("nu", 3, nu);
    show("chi", WHEELS, chi);
    show("spins", WHEELS * (ROLLERS - 1), spins);
    show("nu_dot", 3, nu_dot);
    show("spins_dot", WHEELS * (ROLLERS - 1), spins_dot);
    return 0;
}
