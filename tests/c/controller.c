/* A velocity controller with a vehicle to drive: both from the pair of files for free rollers with drives.
 *
 * Every millisecond the controller measures nu from the wheels' rates (odometry), asks for an acceleration towards a target that
 * changes every second, and turns it into torques (inverse dynamics, torques of least norm). The vehicle then takes a step of a
 * millisecond under these torques, through whatever joints of its rollers come. It drives until JOINTS joints have passed.
 *
 * Prints: joints, steps, nu, pose, the angles by which the wheels have turned, and the largest |nu| and torque on the way. */
#include <stdio.h>

#include "omniroll.h"

#ifndef JOINTS
#define JOINTS 1000
#endif

enum { WHEELS = 3, ROLLERS = 5 };

static omniroll_real chi[WHEELS], axial[WHEELS*(ROLLERS - 1)], momenta[2*WHEELS], work[OMNIROLL_WORK(WHEELS, ROLLERS)];
static int contact[WHEELS];
static omniroll_wheel wheel[WHEELS];
static omniroll_roller roller[ROLLERS - 1];
static omniroll_model model;

static omniroll_real number(double x)
{
    return (omniroll_real)x;
}

static omniroll_real larger(omniroll_real most, omniroll_real x)
{
    x = x < 0 ? -x : x;
    return x > most ? x : most;
}

/* The torques that make the vehicle follow the target: acceleration = (target - nu)*gain. */
static void control(const omniroll_state *state, const omniroll_real *target, omniroll_real *torque)
{
    omniroll_real chi_dot[WHEELS], nu[3], nu_dot[3], force[3], none[WHEELS] = {0};
    omniroll_wheel_speeds(&model, state->nu, chi_dot); /* what encoders would say */
    omniroll_nu_from_wheels(&model, chi_dot, nu);
    for (int k = 0; k < 3; k++)
        nu_dot[k] = 20*(target[k] - nu[k]);
    omniroll_inverse_dynamics(&model, nu, state->chi, state->momenta, none, nu_dot, force);
    omniroll_wheel_torques(&model, force, torque);
}

int main(void)
{
    static const omniroll_real wheel_angles[WHEELS] = {0, 2, 4};
    const omniroll_real h = number(0.001);
    static const omniroll_real targets[4][3] = {{1, 0, 4}, {0, 1, 4}, {-1, 0, 4}, {0, -1, 4}};
    omniroll_real torque[WHEELS], turned[WHEELS] = {0}, most_nu = 0, most_torque = 0;
    omniroll_vehicle vehicle = {0};
    omniroll_state state = {0};
    omniroll_inputs inputs = {0};
    long joints = 0, steps = 0;
    int status;

    vehicle.wheels = WHEELS;
    vehicle.rollers_per_wheel = ROLLERS;
    vehicle.mass = number(2.25);
    vehicle.yaw_inertia = number(0.0625);
    vehicle.wheel_inertia = number(0.0009765625);
    vehicle.roller_inertia = number(0.00001);
    vehicle.yaw_scale = number(0.5);
    vehicle.platform_radius = number(0.15625);
    vehicle.wheel_radius = number(0.0703125);
    vehicle.roller_axis_radius = number(0.05);
    vehicle.wheel_angles = wheel_angles;
    status = omniroll_prepare(&vehicle, wheel, roller, &model);
    if (status != OMNIROLL_OK)
        return status;
    state.chi = chi;
    state.contact = contact;
    state.axial = axial;
    state.momenta = momenta;
    state.work = work;
    inputs.torque = torque;
    status = omniroll_start(&model, &state);
    while (joints < JOINTS && status == OMNIROLL_OK) {
        const omniroll_real *const target = targets[steps/1000%4];
        int before[WHEELS];
        control(&state, target, torque);
        for (int i = 0; i < WHEELS; i++)
            before[i] = contact[i];
        status = omniroll_step(&model, OMNIROLL_IMPACT, &inputs, h, &state);
        steps++;
        for (int i = 0; i < WHEELS; i++) {
            const int passed = (before[i] - contact[i] + ROLLERS)%ROLLERS; /* +1 at +pi/n, ROLLERS - 1 for -1 at -pi/n */
            const int way = passed > ROLLERS/2 ? passed - ROLLERS : passed;
            turned[i] += number(way); /* rollers; a small integer is exact */
            joints += way < 0 ? -way : way;
            most_torque = larger(most_torque, torque[i]);
        }
        for (int k = 0; k < 3; k++)
            most_nu = larger(most_nu, state.nu[k]);
    }
    printf("%ld %ld", joints, steps);
    for (int k = 0; k < 3; k++)
        printf(" %.17g", (double)state.nu[k]);
    for (int k = 0; k < 3; k++)
        printf(" %.17g", (double)state.pose[k]);
    for (int i = 0; i < WHEELS; i++)
        printf(" %.17g", 2*(double)omniroll_joint(&model)*(double)turned[i] + (double)chi[i]);
    printf(" %.17g %.17g\n", (double)most_nu, (double)most_torque);
    return status;
}
