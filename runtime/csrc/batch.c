/* Many vehicles at once: forward dynamics over arrays, sixteen vehicles in the lanes. That is twice the widest
 * register: while one half waits for a result, the other has work.
 *
 * Arrays are structures of arrays: component k of vehicle v stands at [k*count + v]. Each chi is on its roller,
 * |chi| <= pi/n. The constants are one vehicle's (shared), or stand in blocks of sixteen vehicles, so that a block
 * reads one piece of memory: a model in lanes and its arrays after each other, aligned to 128 bytes, the last block
 * filled up with the last vehicle.
 *
 * For sets without effects alone: others need inputs that this has no place for. */
#if defined __GNUC__ && !defined __clang__
#pragma GCC optimize ("no-ivopts")          /* a pointer for each array takes the registers that addresses need */
#endif
#define LANES 16
#define UNROLLED _Pragma("GCC unroll 8")     /* so that all stays in registers */
#define LANES_EACH_WHEEL UNROLLED
#include "set_in_lanes.h"

#include "engine.h"
#include "engine_set.h"

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
ALWAYS_INLINE void block(const int wheels, const lanes_model *constants, arrays_t at)
{
    lanes_t nu[3], chi[MAX_WHEELS], momenta[2*MAX_WHEELS], nu_dot[3];
    WITH_WHEELS(constants, wheels);
    UNROLLED
    for (int k = 0; k < 3; k++)
        nu[k] = load(at.nu + k*at.stride);
    UNROLLED
    for (int i = 0; i < wheels; i++)
        chi[i] = load(at.chi + i*at.stride);
    UNROLLED
    for (int k = 0; k < SET_HAS_MOMENTA*2*wheels; k++)
        momenta[k] = load(at.momenta + k*at.stride);
    SOLVED(forward_dynamics)(constants, nu, chi MOMENTA(momenta), nu_dot);
    UNROLLED
    for (int k = 0; k < 3; k++)
        *(lanes_in_array_t *)(at.nu_dot + k*at.stride) = nu_dot[k];
}

/* The model of a block and the next block's. */
static long long block_size(int wheels, int rollers_per_wheel)
{
    return (long long)(sizeof(lanes_model) + LANES*sizeof(double) - 1)/(long long)(LANES*sizeof(double))
        + LANES_MODEL_SIZE((long long)wheels, (long long)rollers_per_wheel);
}

ALWAYS_INLINE void blocks(const int wheels, const lanes_t *constants, long long next, arrays_t at)
{
    for (long long remaining = at.stride; remaining >= LANES; remaining -= LANES) {
        block(wheels, (const lanes_model *)constants, at);
        at.nu += LANES, at.chi += LANES, at.nu_dot += LANES;
        if (SET_HAS_MOMENTA)
            at.momenta += LANES;
        constants += next;
    }
}

long long omniroll_blocks_size(long long count, int wheels, int rollers_per_wheel)
{
    return (count + LANES - 1)/LANES*LANES*block_size(wheels, rollers_per_wheel);
}

void omniroll_fill_blocks(long long count, const omniroll_model *const *models, double *to)
{
    const long long size = block_size(models[0]->wheels, models[0]->rollers_per_wheel);
    for (long long first = 0; first < count; first += LANES) {
        lanes_model *const model = (lanes_model *)((lanes_t *)to + first/LANES*size);
        lanes_spread(models[first], (lanes_t *)to + (first/LANES + 1)*size
            - LANES_MODEL_SIZE(models[first]->wheels, models[first]->rollers_per_wheel), model);
        for (int lane = 1; lane < LANES; lane++)
            lanes_put(models[first + lane < count ? first + lane : count - 1], lane, model);
    }
}

static void rest(const int wheels, const lanes_t *constants, arrays_t at);

ALWAYS_INLINE void all_blocks(const int wheels, const lanes_t *constants, long long next, arrays_t at)
{
    blocks(wheels, constants, next, at);
    if (at.stride%LANES)
        rest(wheels, constants + at.stride/LANES*next, at);
}

int omniroll_forward_dynamics_batch(long long count, int wheels, int rollers_per_wheel, const double *constants, int shared,
                           const double *nu, const double *chi, const double *momenta, double *nu_dot)
{
    const arrays_t at = {nu, chi, momenta, nu_dot, count};
    const long long next = shared ? 0 : block_size(wheels, rollers_per_wheel);
    if (!TAKES_WHEELS(wheels))
        return 1;
    all_blocks(FIXED_WHEELS(wheels), (const lanes_t *)constants, next, at);
    return 0;
}

static void fill(double *to, const double *from, long long stride, int components)
{
    const long long remaining = stride%LANES;
    for (int k = 0; k < components; k++)
        for (int lane = 0; lane < LANES; lane++)
            to[k*LANES + lane] = from[(k + 1)*stride - remaining + (lane < remaining ? lane : 0)];
}

/* The last vehicles, fewer than sixteen: a block that is filled up with the first of them. */
static void rest(const int wheels, const lanes_t *constants, arrays_t at)
{
    double nu[3*LANES], chi[MAX_WHEELS*LANES], momenta[2*MAX_WHEELS*LANES], nu_dot[3*LANES];
    const long long remaining = at.stride%LANES;
    fill(nu, at.nu, at.stride, 3);
    fill(chi, at.chi, at.stride, wheels);
    if (at.momenta)
        fill(momenta, at.momenta, at.stride, 2*wheels);
    blocks(wheels, constants, 0, (arrays_t){nu, chi, momenta, nu_dot, LANES});
    for (int k = 0; k < 3; k++)
        for (int lane = 0; lane < remaining; lane++)
            at.nu_dot[(k + 1)*at.stride - remaining + lane] = nu_dot[k*LANES + lane];
}
