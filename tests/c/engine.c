/* The compiled engine from C alone: the paper's vehicle, free rollers, impact; buffers of a few rows. With STICKING its
 * axles and all its rollers stick, with SLIPPING its wheels slip on a viscous ground, with SERIES beside that its rollers
 * are massless, and stick as axles do; with STANDING wheels slip under Coulomb's friction, and axles and rollers may stick
 * beside contacts. It prints a line for each switch, time and directions, and one for the end. */
#include "engine.h"

#include <fenv.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { WHEELS = 3, ROLLERS = 5, PLACES = ROLLERS - 1, ROWS = 6 };
#ifdef STICKING
enum { INPUTS = 2, CORE = WHEELS*PLACES, ACCOUNTS = 2, GUARDS = 4*WHEELS, BEARINGS = WHEELS*(2 + PLACES) };
#elif defined SERIES
enum { INPUTS = 2, CORE = WHEELS, ACCOUNTS = WHEELS + 2, BEARINGS = 2*WHEELS };
#elif defined SLIPPING
enum { INPUTS = 0, CORE = 2*WHEELS, ACCOUNTS = WHEELS };
#elif defined STANDING
enum { INPUTS = 6 };
enum { CORE = WHEELS*(2 + PLACES), ACCOUNTS = WHEELS + 2, BEARINGS = WHEELS*(2 + PLACES) };
#else
enum { INPUTS = 0, CORE = 0, ACCOUNTS = 0 };
#endif

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
#if defined SLIPPING || defined STANDING
    double core[CORE] = {5, -3, 2}, core_before[CORE], accounts[ACCOUNTS] = {0};    /* the wheels' rates; and below */
    const double part_sizes[] = {30, 30, 30};
#endif
#ifdef SLIPPING
    const double damping[2*WHEELS] = {30, 20, 30, 20, 30, 20};
#endif
    const omniroll_vehicle vehicle = {
        .wheels = WHEELS, .rollers_per_wheel = ROLLERS,
        .mass = atof(arguments[1]), .yaw_inertia = atof(arguments[2]), .wheel_inertia = atof(arguments[3]),
        .yaw_scale = atof(arguments[5]), .platform_radius = atof(arguments[6]),
        .wheel_radius = atof(arguments[7]), .roller_axis_radius = atof(arguments[8]), .wheel_angles = angles,
#ifndef SERIES
        .roller_inertia = atof(arguments[4]),
#endif
#ifdef SLIPPING
        .ground_damping = damping,
#endif
    };
    omniroll_wheel wheel[WHEELS];
    omniroll_model model;
#ifdef SERIES
    if (omniroll_prepare(&vehicle, wheel, &model) != OMNIROLL_OK)
        return 3;
#else
    const double spins[WHEELS*PLACES] = {0};
    omniroll_roller roller[PLACES];
    if (omniroll_prepare(&vehicle, wheel, roller, &model) != OMNIROLL_OK)
        return 3;
    omniroll_axial_speeds(&model, nu, chi, spins, axial);
#endif

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
        .wheels = WHEELS, .rollers_per_wheel = ROLLERS, .impact = 1, .duration = atof(arguments[12]), .next_time = INFINITY,
        .tolerance = 1e-11, .sweep_tolerance = 1e-14, .joint = joint, .rollers = rollers, .patience = 600,
        .nu = nu, .chi = chi, .pose = pose, .axial = axial, .contact = contact, .work = work,
        .rows = rows, .steps = steps, .row_capacity = ROWS,
        .switches = switches, .switch_axial = switch_axial, .switch_capacity = ROWS};
#ifdef STICKING
    double accounts[ACCOUNTS] = {0}, inputs[2*INPUTS*WHEELS] = {0}, signals[3*(INPUTS + 1)*WHEELS] = {0}, guards[6*GUARDS];
    double wheel_rates[WHEELS];
    long long passed[GUARDS], leads_to[2*GUARDS];
    omniroll_bearing_t bearings[BEARINGS];
    for (int k = 0; k < BEARINGS; k++)
        bearings[k] = (omniroll_bearing_t){
            .sliding = (k < WHEELS ? 1e-3 : 1e-7)*(3 + k%WHEELS), .holding = (k < WHEELS ? 1.2e-3 : 2e-7)*(3 + k%WHEELS),
            .nearer = 1};
    for (int k = 0; k < 3; k++) {
        const double along[3] = {k == 0, k == 1, k == 2};
        omniroll_wheel_speeds(&model, along, wheel_rates);
        for (int i = 0; i < WHEELS; i++)
            bearings[i].row[k] = wheel_rates[i];
        const double level[WHEELS] = {0};
        double contact_spins[WHEELS];
        omniroll_wheel_rates(&model, along, level, wheel_rates, contact_spins);
        for (int i = 0; i < WHEELS; i++)
            bearings[WHEELS + i].row[k] = contact_spins[i];
    }
    run.bearing_count = BEARINGS, run.axle_count = WHEELS, run.bearings = bearings;
    double core[CORE], core_before[CORE];
    const double part_sizes[] = {1, 1, 1};
    for (int k = 2*WHEELS; k < BEARINGS; k++)           /* counted by wheel, then by place                       */
        bearings[k].sliding = 1e-7*(3 + (k - 2*WHEELS)/PLACES), bearings[k].holding = 2*bearings[k].sliding;
    run.own_count = WHEELS*PLACES, run.roller_inertia = vehicle.roller_inertia, run.rate_of_speed = 1/vehicle.yaw_scale;
    run.core = core, run.core_before = core_before, run.part_sizes = part_sizes;
    run.speed = 1, run.accounts = accounts, run.inputs = inputs, run.signals = signals, run.guards = guards;
    run.passed = passed, run.leads_to = leads_to, run.hold.undecided = 1;
#endif
#ifdef SLIPPING
    double signals[3*(INPUTS + 1)*WHEELS] = {0};
#endif
#ifdef SERIES
    double inputs[2*INPUTS*WHEELS] = {0};
    omniroll_bearing_t bearings[BEARINGS];
    for (int k = 0; k < BEARINGS; k++) {
        const double torque = 2e-4*(3 + k%WHEELS);
        bearings[k] = (omniroll_bearing_t){.sliding = torque, .holding = 1.2*torque, .nearer = 1};
    }
    run.bearing_count = run.own_count = BEARINGS, run.axle_count = WHEELS, run.bearings = bearings, run.inputs = inputs;
    run.rate_of_speed = 20, run.hold.undecided = 1;
#endif
#if defined STANDING
    double signals[3*(INPUTS + 1)*WHEELS] = {0}, inputs[2*INPUTS*WHEELS] = {0};
    omniroll_grip_t grips[WHEELS];
    const double load = vehicle.mass*9.80665/WHEELS, radius = vehicle.platform_radius;
    for (int i = 0; i < WHEELS; i++)
        grips[i] = (omniroll_grip_t){.carries = 1, .load = load, .sliding = {0.3, 0.2}, .staying = {0.3, 0.2},
                                     .towards = {0, 1}};
    run.ground = (omniroll_ground_t){
        .undecided = 1, .typical = 0.3*load, .friction = 0.3*load/(vehicle.mass*radius), .settles = 0.3e-9*load/vehicle.mass,
        .reach = vehicle.wheel_radius - vehicle.roller_axis_radius,
        .arms = {radius, 2*radius/vehicle.yaw_scale, vehicle.wheel_radius,
                 vehicle.wheel_radius - vehicle.roller_axis_radius}};
    run.inputs = inputs, run.grips = grips, run.grip_count = WHEELS;
    omniroll_bearing_t bearings[BEARINGS];
    const double level[WHEELS] = {0};
    for (int k = 0; k < BEARINGS; k++) {                /* free rollers are counted by wheel, then by place     */
        const int wheel_of = k < 2*WHEELS ? k%WHEELS : (k - 2*WHEELS)/PLACES;
        const double torque = (k < WHEELS ? 1e-2 : 1e-4)*(3 + wheel_of);
        bearings[k] = (omniroll_bearing_t){.sliding = torque, .holding = 1.2*torque, .nearer = 1};
    }
    for (int k = 0; k < 3; k++) {
        const double along[3] = {k == 0, k == 1, k == 2};
        double wheel_rates[WHEELS], contact_spins[WHEELS];
        omniroll_wheel_rates(&model, along, level, wheel_rates, contact_spins);
        for (int i = WHEELS; i < BEARINGS; i++)
            bearings[i].row[k] = contact_spins[i < 2*WHEELS ? i - WHEELS : (i - 2*WHEELS)/PLACES];
    }
    run.bearing_count = run.own_count = BEARINGS, run.axle_count = WHEELS, run.bearings = bearings;
    run.rate_of_speed = 20, run.hold.undecided = 1, run.roller_inertia = vehicle.roller_inertia;
#endif
#if defined SLIPPING || defined STANDING
#ifndef SERIES
    omniroll_contact_axial(&model, nu, chi, core + WHEELS);     /* the axial speeds of the rollers in contact     */
#endif
    run.speed = 1, run.core = core, run.core_before = core_before, run.accounts = accounts, run.part_sizes = part_sizes;
    run.signals = signals;
#endif
    int status = OMNIROLL_RUN_FULL;
    long long switched = 0;
    while (status == OMNIROLL_RUN_FULL) {
        run.row_count = run.switch_count = 0;
        status = omniroll_run(&run, &model);
        switched += run.switch_count;
        for (const double *at = switches; at < switches + (2 + WHEELS)*run.switch_count; at += 2 + WHEELS)
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
