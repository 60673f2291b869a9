/* Some doubles that are computed with as one number: the number type of the generated kernels in the compiled
 * engine.
 *
 * The lanes are nodes of a step (collocation.c), as many as a register of the machine holds, or sixteen vehicles (batch.c).
 * GNU C vector extensions, gcc and clang. Longer vectors give the same results, but gcc moves them through memory word by
 * word where they stand in an array: the engine would be nine times slower. No result depends on the number of lanes. */
#ifndef OMNIROLL_LANES_H
#define OMNIROLL_LANES_H

#include <string.h>

#ifdef LANES                        /* batch.c has its own */
#elif defined __AVX512F__
#define LANES 8
#elif defined __AVX__
#define LANES 4
#else
#define LANES 2
#endif
#define IN_REGISTERS _Pragma("GCC unroll 16")   /* before a loop over few numbers, so that they stay in registers */
typedef double lanes_t __attribute__((vector_size(8*LANES)));
typedef long long lane_mask_t __attribute__((vector_size(8*LANES)));
typedef long long pair_mask_t __attribute__((vector_size(16)));

#define ALWAYS_INLINE static inline __attribute__((always_inline, unused))
/* The compiler takes more than its share of time for one function that has everything in it. */
#define NEVER_INLINE static __attribute__((noinline, unused))

ALWAYS_INLINE lanes_t lanes_of(double x)
{
    return x - (lanes_t){0};
}

/* a where the mask is set, b elsewhere. */
ALWAYS_INLINE lanes_t lanes_select(lane_mask_t mask, lanes_t a, lanes_t b)
{
    return (lanes_t)((mask & (lane_mask_t)a) | (~mask & (lane_mask_t)b));
}

ALWAYS_INLINE lanes_t lanes_abs(lanes_t x)
{
    return (lanes_t)((lane_mask_t)x & 0x7fffffffffffffffLL);
}

ALWAYS_INLINE lanes_t lanes_clamp(lanes_t x, double bound)
{
    x = lanes_select(x > bound, lanes_of(bound), x);
    return lanes_select(x < -bound, lanes_of(-bound), x);
}

/* The larger of two numbers that are not negative; not a number if one of them is not. Their order is that of their bits,
 * and what is not a number comes last. */
ALWAYS_INLINE lanes_t lanes_max(lanes_t a, lanes_t b)
{
    return lanes_select((lane_mask_t)a > (lane_mask_t)b, a, b);
}

/* Largest magnitude of the lanes; not a number if one of them is not. */
ALWAYS_INLINE double lanes_largest(lanes_t x)
{
    union {
        lanes_t all;
        pair_mask_t pairs[LANES/2];
    } bits = {.all = lanes_abs(x)};
    pair_mask_t pair = bits.pairs[0];
    IN_REGISTERS
    for (int k = 1; k < LANES/2; k++) {
        const pair_mask_t larger = bits.pairs[k] > pair;
        pair = (larger & bits.pairs[k]) | (~larger & pair);
    }
    const long long largest = pair[0] > pair[1] ? pair[0] : pair[1];
    double size;
    memcpy(&size, &largest, sizeof size);
    return size;
}

/* Sine and cosine for |x| <= pi/4: the polynomials of Sun's fdlibm (k_sin.c, k_cos.c, 1993). Other angles go through
 * lanes_reduce() first; half a wheel angle has a shorter polynomial in the generated kernel. */
ALWAYS_INLINE lanes_t lanes_sin(lanes_t x)
{
    const lanes_t z = x*x;
    const lanes_t high = 8.33333333332248946124e-03 + z*(-1.98412698298579493134e-04
        + z*(2.75573137070700676789e-06 + z*(-2.50507602534068634195e-08 + z*1.58969099521155010221e-10)));
    return x + x*z*(-1.66666666666666324348e-01 + z*high);
}

ALWAYS_INLINE lanes_t lanes_cos(lanes_t x)
{
    const lanes_t z = x*x;
    const lanes_t high = z*z*(4.16666666666666019037e-02 + z*(-1.38888888888741095749e-03 + z*(2.48015872894767294178e-05
        + z*(-2.75573143513906633035e-07 + z*(2.08757232129817482790e-09 - z*1.13596475577881948265e-11)))));
    const lanes_t half = 0.5*z;
    const lanes_t head = 1 - half;
    return head + (((1 - head) - half) + high);
}

/* x = rest + quarter*pi/2 with |rest| <= pi/4, for |x| <= 1e5: pi/2 in three parts, products with the first two
 * exact. */
typedef struct {
    lanes_t rest;
    lane_mask_t quarter;
} reduced_angle_t;

ALWAYS_INLINE reduced_angle_t lanes_reduce(lanes_t x)
{
    const double magic = 0x1.8p52;      /* adding it rounds to an integer, which then stands in the low bits */
    const lanes_t shifted = x*0x1.45f306dc9c883p-1 + magic;
    const lanes_t multiple = shifted - magic;
    return (reduced_angle_t){
        .rest = ((x - multiple*0x1.921fb544p0) - multiple*0x1.0b4611a6p-34) - multiple*0x1.3198a2e037073p-69,
        .quarter = (lane_mask_t)shifted};
}

/* Sine and cosine of any angle up to 1e5. */
ALWAYS_INLINE lanes_t lanes_long_sin(lanes_t x)
{
    const reduced_angle_t reduced = lanes_reduce(x);
    const lane_mask_t odd = (reduced.quarter & 1) != 0, flip = (reduced.quarter & 2) << 62;
    return (lanes_t)((lane_mask_t)lanes_select(odd, lanes_cos(reduced.rest), lanes_sin(reduced.rest)) ^ flip);
}

ALWAYS_INLINE lanes_t lanes_long_cos(lanes_t x)
{
    const reduced_angle_t reduced = lanes_reduce(x);
    const lane_mask_t odd = (reduced.quarter & 1) != 0, flip = ((reduced.quarter + 1) & 2) << 62;
    return (lanes_t)((lane_mask_t)lanes_select(odd, lanes_sin(reduced.rest), lanes_cos(reduced.rest)) ^ flip);
}

/* The vector (x, y) turned by an angle. */
ALWAYS_INLINE void lanes_turn(lanes_t angle, lanes_t *x, lanes_t *y)
{
    const reduced_angle_t reduced = lanes_reduce(angle);
    const lanes_t cosine = lanes_cos(reduced.rest), sine = lanes_sin(reduced.rest);
    const lanes_t turned_x = *x*cosine - *y*sine, turned_y = *x*sine + *y*cosine;
    const lane_mask_t quarter = reduced.quarter;
    const lane_mask_t odd = (quarter & 1) != 0, flip_x = ((quarter + 1) & 2) << 62, flip_y = (quarter & 2) << 62;
    const lanes_t u = lanes_select(odd, turned_y, turned_x), v = lanes_select(odd, turned_x, turned_y);
    *x = (lanes_t)((lane_mask_t)u ^ flip_x);
    *y = (lanes_t)((lane_mask_t)v ^ flip_y);
}

#endif
