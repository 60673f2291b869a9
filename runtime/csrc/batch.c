/* Many vehicles at once: the reduced kernel over arrays, sixteen vehicles in the lanes. That is twice the widest register:
 * while one half waits for a result, the other has work.
 *
 * Arrays are structures of arrays: component k of vehicle v stands at [k*count + v]. The constants of the model either
 * are one vehicle's (shared) or stand in such an array too. Each chi is on its roller, |chi| <= pi/n. */
#define LANES 16
#define UNROLLED _Pragma("GCC unroll 8")     /* so that all stays in registers */
#define OMNIROLL_EACH_WHEEL UNROLLED
#include "kernel_in_lanes.h"

#include "engine.h"

ALWAYS_INLINE lanes_t load(const double *from, long long left)
{
    lanes_t x;
    if (left >= LANES)
        memcpy(&x, from, sizeof x);
    else {
        x = lanes_of(from[0]);
        for (int k = 1; k < left; k++)
            x[k] = from[k];
    }
    return x;
}

ALWAYS_INLINE void store(double *to, lanes_t x, long long left)
{
    if (left >= LANES)
        memcpy(to, &x, sizeof x);
    else
        for (int k = 0; k < left; k++)
            to[k] = x[k];
}

ALWAYS_INLINE void batch(long long count, const int wheels, int rollers, const double *model, int model_size, int shared,
                         const double *nu_, const double *chi_, const double *momenta_, double *nu_dot_, lanes_t *constants)
{
    if (shared)
        for (int k = 0; k < model_size; k++)
            constants[k] = lanes_of(model[k]);
    for (long long v = 0; v < count; v += LANES) {
        const long long left = count - v;
        lanes_t nu[3], chi[MOST_WHEELS], nu_dot[3];
        if (!shared)
            for (int k = 0; k < model_size; k++)
                constants[k] = load(model + k*count + v, left);
        UNROLLED
        for (int k = 0; k < 3; k++)
            nu[k] = load(nu_ + k*count + v, left);
        UNROLLED
        for (int i = 0; i < wheels; i++)
            chi[i] = load(chi_ + i*count + v, left);
#ifdef OMNIROLL_FREE_ROLLERS
        lanes_t momenta[2*MOST_WHEELS];
        UNROLLED
        for (int k = 0; k < 2*wheels; k++)
            momenta[k] = load(momenta_ + k*count + v, left);
#else
        (void)momenta_;
#endif
        KERNEL(reduced)(wheels, rollers, constants, nu, chi MOMENTA(momenta), nu_dot);
        UNROLLED
        for (int k = 0; k < 3; k++)
            store(nu_dot_ + k*count + v, nu_dot[k], left);
    }
}

/* nu' of `count` vehicles. work: 16*model_size doubles, aligned to 128 bytes. Returns 1 where there are too many wheels. */
EACH_LEVEL int KERNEL(reduced_batch)(long long count, int wheels, int rollers_per_wheel, const double *model, int model_size, int shared,
                            const double *nu, const double *chi, const double *momenta, double *nu_dot, double *work)
{
    lanes_t *const constants = (lanes_t *)work;
    if (wheels > MOST_WHEELS)
        return 1;
    switch (wheels) {
    case 3: batch(count, 3, rollers_per_wheel, model, model_size, shared, nu, chi, momenta, nu_dot, constants); break;
    case 4: batch(count, 4, rollers_per_wheel, model, model_size, shared, nu, chi, momenta, nu_dot, constants); break;
    default: batch(count, wheels, rollers_per_wheel, model, model_size, shared, nu, chi, momenta, nu_dot, constants);
    }
    return 0;
}
