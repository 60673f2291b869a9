/* An extended Kalman filter over the generated derivatives, and a vehicle with noise that it watches.
 *
 * The files are those of `omniroll kernel SCENE --output DIR --constants --derivatives` for a scene with three wheels,
 * motors and locked rollers. The filter knows the voltages. At each sample it reads the wheels' rates and the gyro, at
 * every tenth one also the pose from a camera; encoders tell it the wheels' angles without noise. What it does not know
 * are torques at the axles, others at each step.
 *
 * Between two readings omniroll_step_derivatives moves the estimate and its covariance through all joints. Readings come
 * in one by one, each a number with a row of derivatives, so that no matrix is inverted.
 *
 * Prints: the mean of (reading - expected)^2 over its variance, which is 1 where a filter knows how well it knows; then
 * root mean square errors, of the filter, of what is read, and of odometry. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "omniroll_constants.h"

#define STEP ((omniroll_real)0.002)        /* s */
#define RATE_NOISE ((omniroll_real)0.5)    /* rad/s */
#define GYRO_NOISE ((omniroll_real)0.05)   /* rad/s */
#define CAMERA_NOISE ((omniroll_real)0.01) /* m, rad */
#define TORQUE_NOISE ((omniroll_real)0.01) /* N m, at each step */

enum { WHEELS = 3, ROLLERS = OMNIROLL_ROLLERS, SIZE = 6, STEPS = 5, SAMPLES = 1000, CAMERA = 10 };

static const omniroll_model *const model = &omniroll_constant_model;
static const omniroll_real none[WHEELS] = {0};
static omniroll_real per_volt[WHEELS], damping[WHEELS];

/* A vehicle with its storage. */
typedef struct {
    omniroll_state state; /* its arrays are the next ones */
    omniroll_real chi[WHEELS], work[OMNIROLL_WORK(WHEELS, ROLLERS)];
    int contact[WHEELS];
} vehicle;

/* What a filter knows: the covariance of errors in nu and pose, and sums over its readings. */
typedef struct {
    vehicle estimate;
    omniroll_real P[SIZE][SIZE], surprise;
    long readings;
} filter;

static int begin(vehicle *made)
{
    memset(made, 0, sizeof *made);
    made->state.chi = made->chi;
    made->state.contact = made->contact;
    made->state.work = made->work;
    return omniroll_start(model, &made->state);
}

static int move(vehicle *moved, const omniroll_real *torque)
{
    static omniroll_inputs inputs;
    inputs.torque = torque;
    inputs.damping = damping;
    return omniroll_step(model, OMNIROLL_IMPACT, &inputs, STEP, &moved->state);
}

/* The estimate and its covariance a step later: P = F P F^T + G G^T TORQUE_NOISE^2, with F and G the derivatives of a step by nu and
 * pose, and by the torques */
static int predict(filter *own, const omniroll_real *torque)
{
    static omniroll_real slopes[SIZE + 2*WHEELS][SIZE + WHEELS], space[OMNIROLL_DERIVATIVES_WORK(WHEELS, ROLLERS)];
    omniroll_real FP[SIZE][SIZE];
    static omniroll_inputs inputs;
    int status;
    inputs.torque = torque;
    inputs.damping = damping;
    status = omniroll_step_derivatives(model, OMNIROLL_IMPACT, &inputs, STEP, &own->estimate.state, slopes[0], space);
    if (status == OMNIROLL_NO_DERIVATIVE) /* wheels switched at once: along changes that keep them together */
        status = OMNIROLL_OK;
    for (int i = 0; i < SIZE; i++)
        for (int j = 0; j < SIZE; j++) {
            FP[i][j] = 0;
            for (int k = 0; k < SIZE; k++)
                FP[i][j] += slopes[k][i]*own->P[k][j]; /* [by what][of what] */
        }
    for (int i = 0; i < SIZE; i++)
        for (int j = 0; j < SIZE; j++) {
            own->P[i][j] = 0;
            for (int k = 0; k < SIZE; k++)
                own->P[i][j] += FP[i][k]*slopes[k][j];
            for (int k = SIZE + WHEELS; k < SIZE + 2*WHEELS; k++)
                own->P[i][j] += slopes[k][i]*slopes[k][j]*TORQUE_NOISE*TORQUE_NOISE;
        }
    return status;
}

/* One reading of what has the derivatives `row` by nu and pose, and was expected to be `expected` */
static void correct(filter *own, const omniroll_real *row, omniroll_real reading, omniroll_real expected,
                    omniroll_real noise)
{
    omniroll_real Pr[SIZE], variance = noise*noise;
    for (int i = 0; i < SIZE; i++) {
        Pr[i] = 0;
        for (int k = 0; k < SIZE; k++)
            Pr[i] += own->P[i][k]*row[k];
        variance += row[i]*Pr[i];
    }
    own->surprise += (reading - expected)*(reading - expected)/variance;
    own->readings++;
    for (int i = 0; i < SIZE; i++) {
        omniroll_real *const known = i < 3 ? &own->estimate.state.nu[i] : &own->estimate.state.pose[i - 3];
        *known += Pr[i]*(reading - expected)/variance;
        for (int j = 0; j < SIZE; j++)
            own->P[i][j] -= Pr[i]*Pr[j]/variance;
    }
}

/* All that is read at a sample: rates of the wheels, yaw rate and, where there is one, the camera's pose */
static void read_all(filter *own, const omniroll_real *rates, omniroll_real gyro, const omniroll_real *camera)
{
    omniroll_state *const state = &own->estimate.state;
    omniroll_real chi_by_nu[3][WHEELS], pose_by_nu[3][3], by_heading[3], expected[WHEELS], row[SIZE] = {0};
    omniroll_rate_derivatives(model, state->nu, state->pose[2], chi_by_nu[0], pose_by_nu[0], by_heading);
    for (int i = 0; i < WHEELS; i++) {
        omniroll_wheel_speeds(model, state->nu, expected);
        for (int k = 0; k < 3; k++)
            row[k] = chi_by_nu[k][i];
        correct(own, row, rates[i], expected[i], RATE_NOISE);
    }
    for (int k = 0; k < 3; k++)
        row[k] = pose_by_nu[k][2]; /* the heading's rate */
    correct(own, row, gyro, row[2]*state->nu[2], GYRO_NOISE);
    for (int i = 0; i < 3 && camera != NULL; i++) {
        memset(row, 0, sizeof row);
        row[3 + i] = 1;
        correct(own, row, camera[i], state->pose[i], CAMERA_NOISE);
    }
}

/* A number by chance, with the mean 0 and the standard deviation 1: the sum of twelve even ones */
static omniroll_real chance(void)
{
    static uint32_t seed = 1;
    omniroll_real sum = -6;
    for (int k = 0; k < 12; k++) {
        seed = seed*1664525u + 1013904223u;
        sum += (omniroll_real)(seed >> 8)/(omniroll_real)(1 << 24);
    }
    return sum;
}

/* The vehicle and the filter over one sample: the same voltages, torques by chance on the vehicle alone */
static int drive(vehicle *truth, filter *own, int sample)
{
    int status = OMNIROLL_OK;
    for (int k = 0; k < STEPS && status == OMNIROLL_OK; k++) {
        omniroll_real torque[WHEELS], disturbed[WHEELS];
        for (int i = 0; i < WHEELS; i++) {
            torque[i] = per_volt[i]*(omniroll_real)(sample/100%4 == i ? 2 : -1); /* V; another drive each second */
            disturbed[i] = torque[i] + TORQUE_NOISE*chance();
        }
        status = predict(own, torque);
        status = status == OMNIROLL_OK ? move(truth, disturbed) : status;
    }
    memcpy(own->estimate.chi, truth->chi, sizeof truth->chi); /* what encoders say */
    memcpy(own->estimate.contact, truth->contact, sizeof truth->contact);
    return status;
}

static void add_errors(omniroll_real *sums, const omniroll_real *nu, const omniroll_real *pose, const vehicle *truth)
{
    for (int i = 0; i < 3; i++)
        sums[0] += (nu[i] - truth->state.nu[i])*(nu[i] - truth->state.nu[i]);
    for (int i = 0; i < 2; i++)
        sums[1] += (pose[i] - truth->state.pose[i])*(pose[i] - truth->state.pose[i]);
}

static double rms(omniroll_real sum)
{
    return sqrt((double)sum/SAMPLES);
}

int main(void)
{
    static vehicle truth;
    static filter own;
    omniroll_real at_zero[WHEELS], margins[3][2*WHEELS], errors[2] = {0}, of_readings[2] = {0}, of_odometry[2] = {0};
    omniroll_real odometry[3] = {0};
    int status, second = begin(&own.estimate);
    omniroll_motor_laws(model, none, at_zero, per_volt, damping, margins[0], margins[1], margins[2]);
    status = begin(&truth);
    status = status == OMNIROLL_OK ? second : status;
    for (int k = 0; k < SAMPLES && status == OMNIROLL_OK; k++) {
        omniroll_real rates[WHEELS], nu[3], camera[3], pose_dot[3], gyro;
        status = drive(&truth, &own, k);
        omniroll_wheel_speeds(model, truth.state.nu, rates);
        omniroll_pose_rates(model, truth.state.nu, truth.state.pose[2], pose_dot);
        gyro = pose_dot[2] + GYRO_NOISE*chance();
        for (int i = 0; i < 3; i++) {
            rates[i] += RATE_NOISE*chance();
            camera[i] = truth.state.pose[i] + CAMERA_NOISE*chance();
        }
        omniroll_nu_from_wheels(model, rates, nu);
        omniroll_pose_rates(model, nu, odometry[2], pose_dot);
        for (int i = 0; i < 3; i++)
            odometry[i] += STEP*STEPS*pose_dot[i];
        read_all(&own, rates, gyro, k%CAMERA == 0 ? camera : NULL);
        add_errors(errors, own.estimate.state.nu, own.estimate.state.pose, &truth);
        add_errors(of_readings, nu, camera, &truth);
        add_errors(of_odometry, nu, odometry, &truth);
    }
    printf("surprise: %.3f\n", (double)own.surprise/(double)own.readings);
    printf("nu, 1/s: filter %.4f, wheels %.4f\n", rms(errors[0]), rms(of_readings[0]));
    printf("place, m: filter %.4f, camera %.4f, ", rms(errors[1]), rms(of_readings[1]));
    printf("odometry %.4f\n", rms(of_odometry[1]));
    return status;
}
