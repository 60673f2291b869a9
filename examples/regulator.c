/* A regulator (LQR) that computes its own gain from the generated derivatives, and a vehicle that it brings to a speed.
 *
 * The files are those of `omniroll kernel SCENE --output DIR --constants --derivatives` for a scene with three wheels,
 * motors and locked rollers. Near the wanted nu, d = nu - wanted, and the voltages that hold it, v = u - held,
 * d' = A d + B v: forward_dynamics_derivatives and motor_laws give A and B. They are made exact for voltages that are
 * held during SAMPLE, and Riccati's equation is iterated until it rests. The vehicle then starts at rest, and
 * v = -gain d drives it through all joints.
 *
 * Prints: the gain, a row for each wheel, the voltages that hold the speed, and nu at the end. */
#include <stdio.h>
#include <string.h>

#include "omniroll_constants.h"

#define SAMPLE ((omniroll_real)0.02) /* s */
#define PRICE ((omniroll_real)0.01)  /* of a square volt, where that of a square of nu is 1 */

enum { WHEELS = 3, ROLLERS = OMNIROLL_ROLLERS, TERMS = 12, ROUNDS = 500, STEPS = 20, SAMPLES = 200 };
typedef omniroll_real matrix[3][3];

static const omniroll_model *const model = &omniroll_constant_model;
static const omniroll_real wanted[3] = {1, 0, (omniroll_real)0.5}, none[WHEELS] = {0};
static omniroll_real chi[WHEELS], work[OMNIROLL_WORK(WHEELS, ROLLERS)];
static int contact[WHEELS];

/* to = factor a b + one I; or with a transposed */
static void product(matrix to, omniroll_real factor, matrix a, int transposed, matrix b, omniroll_real one)
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            omniroll_real sum = 0;
            for (int k = 0; k < 3; k++)
                sum += (transposed ? a[k][i] : a[i][k])*b[k][j];
            to[i][j] = factor*sum + (i == j ? one : 0);
        }
}

/* b becomes the x of a x = b, for a symmetric positive a, which is used up */
static void solve(matrix a, matrix b)
{
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++) {
            const omniroll_real factor = i == k ? 1 - 1/a[k][k] : a[i][k]/a[k][k];
            for (int j = 0; j < 3; j++) {
                const omniroll_real of_a = factor*a[k][j], of_b = factor*b[k][j];
                a[i][j] -= of_a;
                b[i][j] -= of_b;
            }
        }
}

/* A and B at the wanted nu, in the middle of the rollers; what motors do: torque per volt, and per rate of the wheel */
static void linearise(matrix A, matrix B, omniroll_real *per_volt, omniroll_real *damping)
{
    omniroll_real at_zero[WHEELS], margins[3][2*WHEELS], nu_dot[3], by_chi[3*WHEELS], by_nu[3][3], by_torque[WHEELS][3];
    omniroll_motor_laws(model, none, at_zero, per_volt, damping, margins[0], margins[1], margins[2]);
    omniroll_forward_dynamics_derivatives(model, wanted, none, none, damping, nu_dot, by_nu[0], by_chi, by_torque[0]);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            A[k][i] = by_nu[i][k]; /* [by what][of what] */
    for (int i = 0; i < WHEELS; i++)
        for (int k = 0; k < 3; k++)
            B[k][i] = by_torque[i][k]*per_volt[i];
}

/* A and B from sample to sample: with S, the integral of exp(A t) over a sample, they are I + A S and S B */
static void sampled(matrix A, matrix B)
{
    matrix S = {{SAMPLE, 0, 0}, {0, SAMPLE, 0}, {0, 0, SAMPLE}}, next;
    for (int k = TERMS; k > 1; k--) {
        product(next, SAMPLE/(omniroll_real)k, A, 0, S, SAMPLE);
        memcpy(S, next, sizeof next);
    }
    product(next, 1, S, 0, B, 0);
    memcpy(B, next, sizeof next);
    product(next, 1, A, 0, S, 1);
    memcpy(A, next, sizeof next);
}

/* The gain K = (PRICE + B^T P B)^-1 B^T P A, where P = I + A^T P (A - B K) */
static void regulate(matrix A, matrix B, matrix K)
{
    matrix P = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, by_B, by_A, left;
    for (int round = 0; round < ROUNDS; round++) {
        product(by_B, 1, P, 0, B, 0);
        product(left, 1, B, 1, by_B, PRICE);
        product(by_A, 1, P, 0, A, 0);
        product(K, 1, B, 1, by_A, 0);
        solve(left, K);
        product(left, -1, B, 0, K, 0);
        for (int i = 0; i < 9; i++)
            left[i/3][i%3] += A[i/3][i%3];
        product(by_A, 1, P, 0, left, 0);
        product(P, 1, A, 1, by_A, 1);
    }
}

/* The voltages that hold the wanted nu in the middle of the rollers */
static void hold(const omniroll_real *per_volt, const omniroll_real *damping, omniroll_real *held)
{
    omniroll_real force[3], torque[WHEELS];
    omniroll_inverse_dynamics(model, wanted, none, none, damping, none, force);
    omniroll_wheel_torques(model, force, torque);
    for (int i = 0; i < WHEELS; i++)
        held[i] = torque[i]/per_volt[i];
}

int main(void)
{
    omniroll_real per_volt[WHEELS], damping[WHEELS], held[WHEELS], torque[WHEELS];
    static omniroll_inputs inputs;
    static omniroll_state state;
    matrix A, B, K;
    int status;

    linearise(A, B, per_volt, damping);
    sampled(A, B);
    regulate(A, B, K);
    hold(per_volt, damping, held);
    state.chi = chi;
    state.contact = contact;
    state.work = work;
    inputs.torque = torque;
    inputs.damping = damping;
    status = omniroll_start(model, &state);
    for (int k = 0; k < SAMPLES && status == OMNIROLL_OK; k++) {
        for (int i = 0; i < WHEELS; i++) {
            omniroll_real voltage = held[i];
            for (int j = 0; j < 3; j++)
                voltage -= K[i][j]*(state.nu[j] - wanted[j]);
            torque[i] = per_volt[i]*voltage;
        }
        for (int step = 0; step < STEPS && status == OMNIROLL_OK; step++)
            status = omniroll_step(model, OMNIROLL_IMPACT, &inputs, SAMPLE/STEPS, &state);
    }
    for (int i = 0; i < 3; i++)
        printf("gain %d, V s: %9.5f %9.5f %9.5f\n", i + 1, (double)K[i][0], (double)K[i][1], (double)K[i][2]);
    printf("held, V:     %9.5f %9.5f %9.5f\n", (double)held[0], (double)held[1], (double)held[2]);
    printf("nu, 1/s:     %9.4f %9.4f %9.4f\n", (double)state.nu[0], (double)state.nu[1], (double)state.nu[2]);
    return status;
}
