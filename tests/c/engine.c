/* The compiled engine from C alone: the paper's vehicle, free rollers, impact; buffers of a few rows. It
 * prints a line for each switch, time and directions, and one for the end. */
#include "engine.h"

#include <fenv.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { WHEELS = 3, ROLLERS = 5, PLACES = ROLLERS - 1, ROWS = 6 };
enum { INPUTS = 0, CORE = 0, ACCOUNTS = 0 };

int main(int count, char **arguments)
{
    double nu[3] = {1, 0.2, 1}, chi[WHEELS] = {0.1, -0.2, 0.3}, pose[3] = {0, 0, 0}, axial[WHEELS*PLACES] = {0};
    double angles[WHEELS];
    long long contact[WHEELS] = {0, 0, 0};
    const int modes[] = {FE_TONEAREST, FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO};
    if (count != 14 || fesetround(modes[atoi(arguments[13])]))
        return 2;
    for (int k = 0; k < WHEELS; k++)
        angles[k] = atof(arguments[k + 9]);
    const omniroll_vehicle vehicle = {
        .wheels = WHEELS, .rollers_per_wheel = ROLLERS,
        .mass = atof(arguments[1]), .yaw_inertia = atof(arguments[2]), .wheel_inertia = atof(arguments[3]),
        .yaw_scale = atof(arguments[5]), .platform_radius = atof(arguments[6]),
        .wheel_radius = atof(arguments[7]), .roller_axis_radius = atof(arguments[8]), .wheel_angles = angles,
        .roller_inertia = atof(arguments[4]),
    };
    omniroll_wheel wheel[WHEELS];
    omniroll_model model;
    const double spins[WHEELS*PLACES] = {0};
    omniroll_roller roller[PLACES];
    if (omniroll_prepare(&vehicle, wheel, roller, &model) != OMNIROLL_OK)
        return 3;
    omniroll_axial_speeds(&model, nu, chi, spins, axial);

    const size_t needed = sizeof(double)*(size_t)omniroll_run_work_size(WHEELS, ROLLERS);
    double *const work = aligned_alloc(64, (needed + 63)/64*64);
    const size_t row = 7 + (2 + INPUTS)*WHEELS + CORE + ACCOUNTS + (size_t)omniroll_run_modes(WHEELS, ROLLERS);
    double *const rows = calloc(ROWS*row, sizeof *rows);
    static double steps[ROWS*(2 + 16*(6 + WHEELS + CORE + ACCOUNTS))];
    static double switches[ROWS*(2 + WHEELS)], switch_axial[ROWS*WHEELS*PLACES];
    double joint[WHEELS];
    long long rollers[WHEELS];
    for (int i = 0; i < WHEELS; i++)
        joint[i] = 3.141592653589793/ROLLERS, rollers[i] = ROLLERS;
    omniroll_run_t run = {
        .wheels = WHEELS, .rollers_per_wheel = ROLLERS, .joint = joint, .rollers = rollers, .work = work,
        .task = {.impact = 1, .duration = atof(arguments[12]), .tolerance = 1e-11, .sweep_tolerance = 1e-14,
                 .patience = 600},
        .state = {.nu = nu, .chi = chi, .pose = pose, .axial = axial, .contact = contact},
        .acts = {.next_time = INFINITY},
        .record = {.rows = rows, .steps = steps, .row_capacity = ROWS,
                   .switches = switches, .switch_axial = switch_axial, .switch_capacity = ROWS}};
    int status = OMNIROLL_RUN_FULL;
    long long switched = 0;
    while (status == OMNIROLL_RUN_FULL) {
        run.record.row_count = run.record.switch_count = 0;
        status = omniroll_run(&run, &model);
        switched += run.record.switch_count;
        for (const double *at = switches; at < switches + (2 + WHEELS)*run.record.switch_count; at += 2 + WHEELS)
            printf("%.17g %.0f %.0f %.0f\n", at[0], at[2], at[3], at[4]);
    }
    printf("%d %lld", status, switched);
    for (int k = 0; k < 3; k++)
        printf(" %.17g %.17g %.17g", nu[k], chi[k], pose[k]);
    printf("\n");
    free(rows);
    free(work);
    return 0;
}
