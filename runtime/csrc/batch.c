/* Many vehicles at once: the reduced kernel over arrays, sixteen vehicles in the lanes. That is twice the widest
 * register: while one half waits for a result, the other has work.
 *
 * Arrays are structures of arrays: component k of vehicle v stands at [k*count + v]. Each chi is on its roller,
 * |chi| <= pi/n. The constants are one vehicle's (shared), or stand in blocks of sixteen vehicles, so that a block
 * reads one piece of memory: constant k of vehicle v at [((v/16)*model_size + k)*16 + v%16], aligned to 128 bytes, the
 * last block filled up with any vehicle. */
#if defined __GNUC__ && !defined __clang__
#pragma GCC optimize ("no-ivopts")          /* a pointer for each array takes the registers that addresses need */
#endif
#define LANES 16
#define UNROLLED _Pragma("GCC unroll 8")     /* so that all stays in registers */
#define OMNIROLL_EACH_WHEEL UNROLLED
#include "kernel_in_lanes.h"

#include "engine.h"

/* Lanes anywhere in an array, aligned as its doubles are. */
typedef lanes_t lanes_in_array_t __attribute__((aligned(8), may_alias));

/* What a block reads and writes, and the distance between two components. */
typedef struct {
    const double *nu, *chi, *momenta;
    double *nu_dot;
    long long stride;
} arrays_t;

ALWAYS_INLINE lanes_t load(const double *from)
{
    return *(const lanes_in_array_t *)from;
}

/* nu' of sixteen vehicles. */
ALWAYS_INLINE void block(const int wheels, int rollers, const lanes_t *constants, arrays_t at)
{
    lanes_t nu[3], chi[MOST_WHEELS], nu_dot[3];
    UNROLLED
    for (int k = 0; k < 3; k++)
        nu[k] = load(at.nu + k*at.stride);
    UNROLLED
    for (int i = 0; i < wheels; i++)
        chi[i] = load(at.chi + i*at.stride);
#ifdef OMNIROLL_FREE_ROLLERS
    lanes_t momenta[2*MOST_WHEELS];
    UNROLLED
    for (int k = 0; k < 2*wheels; k++)
        momenta[k] = load(at.momenta + k*at.stride);
#endif
    SOLVED(reduced)(wheels, rollers, constants, nu, chi MOMENTA(momenta), nu_dot);
    UNROLLED
    for (int k = 0; k < 3; k++)
        *(lanes_in_array_t *)(at.nu_dot + k*at.stride) = nu_dot[k];
}

ALWAYS_INLINE void blocks(const int wheels, int rollers, const lanes_t *constants, int model_size, arrays_t at)
{
    for (long long left = at.stride; left >= LANES; left -= LANES) {
        block(wheels, rollers, constants, at);
        at.nu += LANES, at.chi += LANES, at.nu_dot += LANES;
#ifdef OMNIROLL_FREE_ROLLERS
        at.momenta += LANES;
#endif
        constants += model_size;
    }
}

static void rest(int wheels, int rollers_per_wheel, const lanes_t *constants, int model_size, arrays_t at);

/* nu' of `count` vehicles. work, for shared constants: 16*model_size doubles, aligned to 128 bytes. Returns 1 where
 * there are too many wheels. */
EACH_LEVEL int ENGINE(reduced_batch)(long long count, int wheels, int rollers_per_wheel, const double *model,
                                     int model_size, int shared, const double *nu, const double *chi,
                                     const double *momenta, double *nu_dot, double *work)
{
    const arrays_t at = {nu, chi, momenta, nu_dot, count};
    const lanes_t *constants = (const lanes_t *)model;
    int next = model_size;
    if (wheels > MOST_WHEELS)
        return 1;
    if (shared) {
        for (int k = 0; k < model_size; k++)
            ((lanes_t *)work)[k] = lanes_of(model[k]);
        constants = (const lanes_t *)work;
        next = 0;
    }
    switch (wheels) {
    case 3: blocks(3, rollers_per_wheel, constants, next, at); break;
    case 4: blocks(4, rollers_per_wheel, constants, next, at); break;
    default: blocks(wheels, rollers_per_wheel, constants, next, at);
    }
    if (count%LANES)
        rest(wheels, rollers_per_wheel, constants + count/LANES*next, model_size, at);
    return 0;
}

static void fill(double *to, const double *from, long long stride, int components)
{
    const long long left = stride%LANES;
    for (int k = 0; k < components; k++)
        for (int lane = 0; lane < LANES; lane++)
            to[k*LANES + lane] = from[(k + 1)*stride - left + (lane < left ? lane : 0)];
}

/* The last vehicles, fewer than sixteen: a block that is filled up with the first of them. */
static void rest(int wheels, int rollers_per_wheel, const lanes_t *constants, int model_size, arrays_t at)
{
    double nu[3*LANES], chi[MOST_WHEELS*LANES], momenta[2*MOST_WHEELS*LANES], nu_dot[3*LANES];
    const long long left = at.stride%LANES;
    fill(nu, at.nu, at.stride, 3);
    fill(chi, at.chi, at.stride, wheels);
    if (at.momenta)
        fill(momenta, at.momenta, at.stride, 2*wheels);
    ENGINE(reduced_batch)(LANES, wheels, rollers_per_wheel, (const double *)constants, model_size, 0,
                          nu, chi, momenta, nu_dot, 0);
    for (int k = 0; k < 3; k++)
        for (int lane = 0; lane < left; lane++)
            at.nu_dot[(k + 1)*at.stride - left + lane] = nu_dot[k*LANES + lane];
}
