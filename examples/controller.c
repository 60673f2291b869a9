/* A velocity controller with a vehicle to drive.
 *
 * The files are those of `omniroll kernel SCENE --output DIR --constants` for a scene with free rollers and motors, of any
 * number of wheels, for instance scenes/driven.toml. Every millisecond the controller measures nu from the wheels' rates
 * (odometry), requests an acceleration towards a target that changes every second, and turns it into torques (inverse dynamics,
 * torques of least norm), which motors make that control their currents. The vehicle then takes a step of a millisecond under
 * these torques, through whatever joints of its rollers come. It drives until JOINTS joints have passed.
 *
 * Prints: joints, steps, nu, pose, the angles by which the wheels have turned, and the largest |nu| and torque on the way. */
#include <stdio.h>

#include "omniroll_constants.h"

#ifndef JOINTS
#define JOINTS 1000
#endif

enum { WHEELS = OMNIROLL_WHEELS, ROLLERS = OMNIROLL_ROLLERS };

static const omniroll_model *const model = &omniroll_constant_model;
static const omniroll_real none[WHEELS] = {0};
static omniroll_real chi[WHEELS], axial[WHEELS*(ROLLERS - 1)], momenta[2*WHEELS], work[OMNIROLL_WORK(WHEELS, ROLLERS)];
static int contact[WHEELS];

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
    omniroll_real chi_dot[WHEELS], nu[3], nu_dot[3], force[3];
    omniroll_wheel_speeds(model, state->nu, chi_dot); /* what encoders would say */
    omniroll_nu_from_wheels(model, chi_dot, nu);
    for (int k = 0; k < 3; k++)
        nu_dot[k] = 20*(target[k] - nu[k]);
    omniroll_inverse_dynamics(model, nu, state->chi, state->momenta, none, none, nu_dot, force);
    omniroll_wheel_torques(model, force, torque);
}

int main(void)
{
    const omniroll_real h = number(0.001);
    static const omniroll_real targets[4][3] = {{1, 0, 4}, {0, 1, 4}, {-1, 0, 4}, {0, -1, 4}};
    omniroll_real torque[WHEELS], turned[WHEELS] = {0}, most_nu = 0, most_torque = 0;
    static omniroll_state state;
    static omniroll_inputs inputs;
    long joints = 0, steps = 0;
    int status;

    state.chi = chi;
    state.contact = contact;
    state.axial = axial;
    state.momenta = momenta;
    state.work = work;
    inputs.torque = torque;
    inputs.damping = none;
    status = omniroll_start(model, &state);
    while (joints < JOINTS && status == OMNIROLL_OK) {
        const omniroll_real *const target = targets[steps/1000%4];
        int before[WHEELS];
        control(&state, target, torque);
        for (int i = 0; i < WHEELS; i++)
            before[i] = contact[i];
        status = omniroll_step(model, OMNIROLL_IMPACT, &inputs, h, &state);
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
        printf(" %.17g", 2*(double)omniroll_joint(model)*(double)turned[i] + (double)chi[i]);
    printf(" %.17g %.17g\n", (double)most_nu, (double)most_torque);
    return status;
}
