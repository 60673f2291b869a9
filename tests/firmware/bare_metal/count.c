/* Counts the instructions of omniroll_step, and measures the stack that it takes. For one number type, on a bare machine whose
 * clock advances with the instructions that it executes (qemu -icount).
 *
 * Prints: instructions of a step and the joints that came; the same with more joints on the way, on average over the steps;
 * instructions of a call that comes to its bound; bytes of stack; nu, pose and chi after a thousand steps. */
#include <stdint.h>
#include <stdio.h>

#include "omniroll.h"

enum { WHEELS = 3, ROLLERS = 5, PAINTED = 8192, PAINT = 0x5A, BELOW = 256 /* this function's own */ };

#define SYSTICK_CONTROL (*(volatile uint32_t *)0xE000E010u)
#define SYSTICK_RELOAD (*(volatile uint32_t *)0xE000E014u)
#define SYSTICK_VALUE (*(volatile uint32_t *)0xE000E018u)
#ifndef INSTRUCTIONS_PER_TICK
#define INSTRUCTIONS_PER_TICK 1.25 /* 40 ns a tick, 32 ns an instruction: -icount shift=5 */
#endif

static omniroll_real chi[WHEELS], axial[WHEELS*(ROLLERS - 1)], momenta[2*WHEELS], work[OMNIROLL_WORK(WHEELS, ROLLERS)];
static int contact[WHEELS];
static omniroll_wheel wheel[WHEELS];
static omniroll_roller roller[ROLLERS - 1];
static omniroll_model model;
static omniroll_state state;
static int joints;

static int start(void)
{
    static const omniroll_real angles[WHEELS] = {0, 2, 4};
    const omniroll_vehicle vehicle = {
        .wheels = WHEELS, .rollers_per_wheel = ROLLERS, .wheel_angles = angles, .yaw_scale = (omniroll_real)0.5,
        .mass = (omniroll_real)2.25, .yaw_inertia = (omniroll_real)0.0625, .wheel_inertia = (omniroll_real)0.0009765625,
        .roller_inertia = (omniroll_real)0.00001, .platform_radius = (omniroll_real)0.15625,
        .wheel_radius = (omniroll_real)0.0703125, .roller_axis_radius = (omniroll_real)0.05};
    const int status = omniroll_prepare(&vehicle, wheel, roller, &model);
    if (status != OMNIROLL_OK)
        return status;
    for (int i = 0; i < WHEELS; i++) {
        chi[i] = (omniroll_real)0.05*(omniroll_real)i;
        contact[i] = 0;
    }
    for (int k = 0; k < 3; k++)
        state.pose[k] = 0;
    for (int k = 0; k < WHEELS*(ROLLERS - 1); k++)
        axial[k] = 0;
    state.nu[0] = 1;
    state.nu[1] = (omniroll_real)0.25;
    state.nu[2] = 1;
    state.chi = chi;
    state.contact = contact;
    state.axial = axial;
    state.momenta = momenta;
    state.work = work;
    joints = 0;
    return omniroll_start(&model, &state);
}

static int __attribute__((noinline)) drive(int steps)
{
    int status = OMNIROLL_OK;
    for (int k = 0; k < steps && status == OMNIROLL_OK; k++) {
        const int before = contact[0] + contact[1] + contact[2];
        status = omniroll_step(&model, OMNIROLL_IMPACT, (omniroll_real)0.001, &state);
        joints += contact[0] + contact[1] + contact[2] != before;
    }
    return status;
}

/* The counter counts down and has 24 bits, so that steps are few. */
static uint32_t clock_from(void)
{
    SYSTICK_RELOAD = 0xFFFFFFu;
    SYSTICK_VALUE = 0;
    SYSTICK_CONTROL = 5;
    return SYSTICK_VALUE;
}

static double ticks_since(uint32_t from)
{
    return (double)((from - SYSTICK_VALUE) & 0xFFFFFFu);
}

/* Ticks of the clock for a number of steps from the start. */
static double ticks(int steps)
{
    uint32_t from;
    if (start() != OMNIROLL_OK)
        return -1;
    from = clock_from();
    return drive(steps) == OMNIROLL_OK ? ticks_since(from) : -1;
}

/* Ticks for a step of a second, in which more joints come than a call passes. */
static double ticks_to_the_bound(void)
{
    uint32_t from;
    int status = start();
    if (status != OMNIROLL_OK)
        return -1;
    state.nu[2] = 50;
    from = clock_from();
    status = omniroll_step(&model, OMNIROLL_IMPACT, 1, &state);
    return status == OMNIROLL_UNFINISHED ? ticks_since(from) : -1;
}

/* The bytes below the stack pointer that a thousand steps have written to. */
static int __attribute__((noinline)) stack_of_steps(void)
{
    volatile unsigned char *const top = (volatile unsigned char *)__builtin_frame_address(0) - BELOW;
    int status, used;
    for (int k = 1; k <= PAINTED; k++)
        top[-k] = PAINT;
    status = start() == OMNIROLL_OK ? drive(1000) : 1;
    for (used = PAINTED; used > 0 && top[-used] == PAINT; used--)
        ;
    return status == OMNIROLL_OK ? used + BELOW : -1;
}

int main(void)
{
    const double few = ticks(10), more = ticks(60); /* no joint comes in these steps */
    const int early = joints;
    const double most = ticks(400); /* joints come */
    printf("%.2f %d ", (more - few)/50*INSTRUCTIONS_PER_TICK, early);
    printf("%.2f %d ", (most - few)/390*INSTRUCTIONS_PER_TICK, joints);
    printf("%.0f ", ticks_to_the_bound()*INSTRUCTIONS_PER_TICK);
    printf("%d", stack_of_steps());
    for (int k = 0; k < 3; k++)
        printf(" %.9g", (double)state.nu[k]);
    for (int k = 0; k < 3; k++)
        printf(" %.9g", (double)state.pose[k]);
    for (int i = 0; i < WHEELS; i++)
        printf(" %.9g", (double)chi[i]);
    printf("\n");
    return 0;
}
