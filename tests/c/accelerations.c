/* A controller's use of the functions by themselves: one header and one source file. */
#include <stdio.h>

#include "omniroll.h"

enum { WHEELS = 3, ROLLERS = 5 };

static void show(const char *name, int length, const omniroll_real *values)
{
    printf("%s", name);
    for (int k = 0; k < length; k++)
        printf(" %.21Lg", (long double)values[k]);
    printf("\n");
}

int main(void)
{
    static const omniroll_real wheel_angles[WHEELS] = {0, 2, 4};
    const omniroll_real nu[3] = {(omniroll_real)0.75, (omniroll_real)-0.25, 1};
    const omniroll_real chi[WHEELS] = {(omniroll_real)0.5, (omniroll_real)-0.125, (omniroll_real)0.25};
    const omniroll_real spins[WHEELS*(ROLLERS - 1)] = {
        1, 2, -3, 4, (omniroll_real)0.5, (omniroll_real)-0.25, 0, 8, -1, 5, 7, -6
    };
    omniroll_real nu_dot[3], spins_dot[WHEELS*(ROLLERS - 1)];
    omniroll_vehicle vehicle = {0};
    omniroll_wheel wheel[WHEELS];
    omniroll_roller roller[ROLLERS - 1];
    omniroll_model model;
    int status;

    vehicle.wheels = WHEELS;
    vehicle.rollers_per_wheel = ROLLERS;
    vehicle.mass = (omniroll_real)2.25;
    vehicle.yaw_inertia = (omniroll_real)0.0625;
    vehicle.wheel_inertia = (omniroll_real)0.0009765625;
    vehicle.roller_inertia = (omniroll_real)0.00001;
    vehicle.yaw_scale = (omniroll_real)3.5;
    vehicle.platform_radius = (omniroll_real)0.15625;
    vehicle.wheel_radius = (omniroll_real)0.0703125;
    vehicle.roller_axis_radius = (omniroll_real)0.05;
    vehicle.wheel_angles = wheel_angles;
    status = omniroll_check_layout(sizeof vehicle, sizeof wheel[0], sizeof roller[0], sizeof model);
    if (status == OMNIROLL_OK)
        status = omniroll_prepare(&vehicle, wheel, roller, &model);
    if (status != OMNIROLL_OK)
        return status;
    omniroll_accelerations(&model, nu, chi, spins, nu_dot, spins_dot);

    show("mass", 1, &vehicle.mass);
    show("yaw_inertia", 1, &vehicle.yaw_inertia);
    show("wheel_inertia", 1, &vehicle.wheel_inertia);
    show("roller_inertia", 1, &vehicle.roller_inertia);
    show("yaw_scale", 1, &vehicle.yaw_scale);
    show("platform_radius", 1, &vehicle.platform_radius);
    show("wheel_radius", 1, &vehicle.wheel_radius);
    show("roller_axis_radius", 1, &vehicle.roller_axis_radius);
    show("wheel_angles", WHEELS, wheel_angles);
    show("nu", 3, nu);
    show("chi", WHEELS, chi);
    show("spins", WHEELS*(ROLLERS - 1), spins);
    show("nu_dot", 3, nu_dot);
    show("spins_dot", WHEELS*(ROLLERS - 1), spins_dot);
    return 0;
}
