/* One long step through many joints, in as many calls as the bound on the joints of a call takes: free rollers.
 *
 * Prints the number of calls; then, bit by bit, nu, pose, chi, the rollers in contact and the axial speeds. */
#include <stdio.h>

#include "omniroll.h"

enum { WHEELS = 3, ROLLERS = 5, SLOTS = WHEELS*(ROLLERS - 1) };

static void show(const omniroll_real *numbers, int count)
{
    for (int k = 0; k < count; k++)
        printf("%a\n", (double)numbers[k]);
}

int main(void)
{
    static const omniroll_real wheel_angles[WHEELS] = {0, 2, 4};
    static omniroll_real chi[WHEELS], axial[SLOTS], momenta[2*WHEELS], work[OMNIROLL_WORK(WHEELS, ROLLERS)];
    static int contact[WHEELS];
    static omniroll_wheel wheel[WHEELS];
    static omniroll_roller roller[ROLLERS - 1];
    omniroll_vehicle vehicle = {0};
    omniroll_model model;
    omniroll_state state = {0};
    int status, calls = 1;

    vehicle.wheels = WHEELS;
    vehicle.rollers_per_wheel = ROLLERS;
    vehicle.mass = (omniroll_real)2.25;
    vehicle.yaw_inertia = (omniroll_real)0.0625;
    vehicle.wheel_inertia = (omniroll_real)0.0009765625;
    vehicle.roller_inertia = (omniroll_real)0.00001;
    vehicle.yaw_scale = (omniroll_real)0.5;
    vehicle.platform_radius = (omniroll_real)0.15625;
    vehicle.wheel_radius = (omniroll_real)0.0703125;
    vehicle.roller_axis_radius = (omniroll_real)0.05;
    vehicle.wheel_angles = wheel_angles;
    status = omniroll_prepare(&vehicle, wheel, roller, &model);
    if (status != OMNIROLL_OK)
        return status;
    state.chi = chi;
    state.contact = contact;
    state.axial = axial;
    state.momenta = momenta;
    state.work = work;
    state.nu[0] = 1;
    state.nu[1] = (omniroll_real)0.25;
    state.nu[2] = 8;
    status = omniroll_start(&model, &state);
    if (status != OMNIROLL_OK)
        return status;
    status = omniroll_step(&model, OMNIROLL_IMPACT, 1, &state);
    for (; status == OMNIROLL_UNFINISHED; calls++)
        status = omniroll_step(&model, OMNIROLL_IMPACT, state.left, &state);
    printf("%d\n", calls);
    show(state.nu, 3);
    show(state.pose, 3);
    show(chi, WHEELS);
    for (int i = 0; i < WHEELS; i++)
        printf("%d\n", contact[i]);
    show(axial, SLOTS);
    return status;
}
