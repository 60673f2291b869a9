/* Numbers at the nodes of a step: their sums, their integrals, the polynomial through them. */
#ifndef OMNIROLL_NODES_H
#define OMNIROLL_NODES_H

#include SET_QUADRATURE

#include <math.h>

#define BLOCKS (NODES/LANES)

/* The product of a square table, given by columns, with the values at the nodes. */
ALWAYS_INLINE nodes_t times(const nodes_t *table, const nodes_t *values)
{
    nodes_t sum;
    IN_REGISTERS
    for (int b = 0; b < BLOCKS; b++) {
        lanes_t of_block = values->node[0]*table[0].lanes[b];
        IN_REGISTERS
        for (int m = 1; m < NODES; m++)
            of_block += values->node[m]*table[m].lanes[b];
        sum.lanes[b] = of_block;
    }
    return sum;
}

/* start + h times the integral of the rates from the start to each node. */
ALWAYS_INLINE void integrate_to_nodes(double start, double h, const nodes_t *rate, nodes_t *at)
{
    const nodes_t sum = times(gauss_integral, rate);
    for (int b = 0; b < BLOCKS; b++)
        at->lanes[b] = start + h*sum.lanes[b];
}

/* Of all nodes, halves upon halves: in the same order whatever the number of lanes. */
ALWAYS_INLINE double total(lanes_t *blocks)
{
    IN_REGISTERS
    for (int half = BLOCKS/2; half > 0; half /= 2) {
        IN_REGISTERS
        for (int b = 0; b < half; b++)
            blocks[b] += blocks[b + half];
    }
    lanes_t sum = blocks[0];
    IN_REGISTERS
    for (int half = LANES/2; half > 0; half /= 2) {
        IN_REGISTERS
        for (int k = 0; k < half; k++)
            sum[k] += sum[k + half];
    }
    return sum[0];
}

ALWAYS_INLINE double weighted(const nodes_t *rate, const nodes_t *weights)
{
    lanes_t sum[BLOCKS];
    IN_REGISTERS
    for (int b = 0; b < BLOCKS; b++)
        sum[b] = rate->lanes[b]*weights->lanes[b];
    return total(sum);
}

/* Size of the last two Legendre coefficients: what the polynomial may have missed. */
ALWAYS_INLINE double tail(const nodes_t *rate)
{
    return fabs(weighted(rate, &gauss_last[0])) + fabs(weighted(rate, &gauss_last[1]));
}

/* The largest size at the nodes; not a number if one of them is not. */
ALWAYS_INLINE double largest_of(const nodes_t *values)
{
    lanes_t largest = lanes_abs(values->lanes[0]);
    IN_REGISTERS
    for (int b = 1; b < BLOCKS; b++)
        largest = lanes_max(largest, lanes_abs(values->lanes[b]));
    return lanes_largest(largest);
}

/* Whether all values at the nodes are zeros. */
ALWAYS_INLINE int vanishes(const nodes_t *values)
{
    lane_mask_t bits = (lane_mask_t)values->lanes[0];
    IN_REGISTERS
    for (int b = 1; b < BLOCKS; b++)
        bits |= (lane_mask_t)values->lanes[b];
    long long any = 0;
    for (int k = 0; k < LANES; k++)
        any |= bits[k];
    return !(any & 0x7fffffffffffffffLL);
}

/* The distance between the smallest and the largest of the values at the nodes and of two numbers beside them. */
ALWAYS_INLINE double extent_of(const nodes_t *values, double start, double end)
{
    lanes_t low = lanes_of(fmin(start, end)), high = lanes_of(fmax(start, end));
    for (int b = 0; b < BLOCKS; b++) {
        low = lanes_select(values->lanes[b] < low, values->lanes[b], low);
        high = lanes_select(values->lanes[b] > high, values->lanes[b], high);
    }
    double least = low[0], largest = high[0];
    for (int k = 1; k < LANES; k++) {
        least = low[k] < least ? low[k] : least;
        largest = high[k] > largest ? high[k] : largest;
    }
    return largest - least;
}

/* Whether the values at the nodes and two numbers beside them have one sign; zero may have either. */
ALWAYS_INLINE int has_one_sign(const nodes_t *values, double start, double end)
{
    lane_mask_t every = (lane_mask_t)values->lanes[0], any = every;
    IN_REGISTERS
    for (int b = 1; b < BLOCKS; b++) {
        every &= (lane_mask_t)values->lanes[b];
        any |= (lane_mask_t)values->lanes[b];
    }
    long long all = every[0], some = any[0];
    for (int k = 1; k < LANES; k++)
        all &= every[k], some |= any[k];
    return start > 0 || end > 0 ? start >= 0 && end >= 0 && some >= 0 : all < 0;
}

/* The value at x in [0, 1] of a polynomial given at the nodes, and its integral from 0. */
ALWAYS_INLINE void legendre_value(const nodes_t *rate, double x, double *value, double *integral)
{
    const double z = 2*x - 1;
    const nodes_t coefficients = times(gauss_legendre, rate);
    double before = 1, p = z;       /* P_(k-1), P_k */
    double sum = 0, area = 0;
    for (int k = 0; k < NODES; k++) {
        const double c = coefficients.node[k];
        if (k == 0) {
            sum += c;
            area += c*x;
            continue;
        }
        const double after = ((2*k + 1)*z*p - k*before)/(k + 1);
        sum += c*p;
        area += c*(after - before)/(2*(2*k + 1));
        before = p;
        p = after;
    }
    *value = sum;
    *integral = area;
}

/* The integrals of Legendre's polynomials from 0 to x. */
ALWAYS_INLINE void legendre_areas(double x, double *area)
{
    const double z = 2*x - 1;
    double before = 1, p = z;       /* P_(k-1), P_k */
    area[0] = x;
    for (int k = 1; k < NODES; k++) {
        const double after = ((2*k + 1)*z*p - k*before)/(k + 1);
        area[k] = (after - before)/(2*(2*k + 1));
        before = p, p = after;
    }
}

/* fmax of a number and a value, which counts for nothing where it is no number: without the call of a library. */
ALWAYS_INLINE double larger(double number, double value)
{
    return value > number ? value : number;
}

ALWAYS_INLINE double largest3(const double *v)
{
    return fmax(fabs(v[0]), fmax(fabs(v[1]), fabs(v[2])));
}

#endif
