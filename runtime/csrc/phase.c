/* The compiled engine: smooth phases by Gauss collocation, ended by located switches, and the switching law.
 *
 * A step covers [t, t + h] with the 16 nodes of Gauss. The derivatives of nu at the nodes are a polynomial, and nu its
 * integral (collocation, order 32 at the end of the step). Picard's iteration finds them, all nodes at once in the lanes of
 * the generated kernel. A step ends where a wheel reaches its joint: the iteration corrects h by Newton's rule along with
 * the derivatives, so that landing on the joint costs no step of its own.
 *
 * The file knows no mechanics: the generated kernel, included with lanes as its numbers, is all that it evaluates. The rules that it
 * keeps are numbered in runtime/omniroll/switching.py. */
#include "kernel_in_lanes.h"

#include "gauss.h"
#include "engine.h"

#include <math.h>

#define BLOCKS (NODES/LANES)
#define MOST_SWEEPS 60
#define EPS 2.220446049250313e-16
#define TURN 6.283185307179586

/* What a step works on. */
typedef struct {
    int wheels, rollers;
    const lanes_t *model;
    const lanes_t *momenta;
    double joint;
    double nu[3], chi[MOST_WHEELS];             /* where the step starts                         */
    double h;
    nodes_t rate_nu[3], at_nu[3];               /* nu', the unknowns, and nu at the nodes        */
    nodes_t rate_chi[MOST_WHEELS], at_chi[MOST_WHEELS];
    nodes_t rate_pose[3];
    double end_nu[3], end_chi[MOST_WHEELS], end_rate[MOST_WHEELS], way[3];  /* way: of the pose, in the step */
    int landing;                                /* the wheel whose joint ends the step, or -1    */
    double late;                                /* the joint comes so long after h               */
    long long sweeps;
} step_t;

/* Collocation: sums over the nodes. */

/* The product of a square table, given by columns, with the values at the nodes. */
ALWAYS_INLINE nodes_t times(const nodes_t *table, const nodes_t *values)
{
    nodes_t sum;
    for (int b = 0; b < BLOCKS; b++)
        sum.lanes[b] = values->node[0]*table[0].lanes[b];
    for (int m = 1; m < NODES; m++)
        for (int b = 0; b < BLOCKS; b++)
            sum.lanes[b] += values->node[m]*table[m].lanes[b];
    return sum;
}

/* start + h times the integral of the rates from the start to each node. */
ALWAYS_INLINE void integrate_to_nodes(double start, double h, const nodes_t *rate, nodes_t *at)
{
    const nodes_t sum = times(gauss_integral, rate);
    for (int b = 0; b < BLOCKS; b++)
        at->lanes[b] = start + h*sum.lanes[b];
}

ALWAYS_INLINE double weighted(const nodes_t *rate, const nodes_t *weights)
{
    lanes_t sum = rate->lanes[0]*weights->lanes[0];
    for (int b = 1; b < BLOCKS; b++)
        sum += rate->lanes[b]*weights->lanes[b];
    return ((sum[0] + sum[4]) + (sum[2] + sum[6])) + ((sum[1] + sum[5]) + (sum[3] + sum[7]));
}

/* Size of the last two Legendre coefficients: what the polynomial may have missed. */
ALWAYS_INLINE double tail(const nodes_t *rate)
{
    return fabs(weighted(rate, &gauss_last[0])) + fabs(weighted(rate, &gauss_last[1]));
}

ALWAYS_INLINE double largest3(const double *v)
{
    return fmax(fabs(v[0]), fmax(fabs(v[1]), fabs(v[2])));
}

/* nu and chi at the nodes from the derivatives of nu. */
ALWAYS_INLINE void states_at_nodes(step_t *s, const int wheels)
{
    for (int k = 0; k < 3; k++)
        integrate_to_nodes(s->nu[k], s->h, &s->rate_nu[k], &s->at_nu[k]);
    for (int b = 0; b < BLOCKS; b++) {
        const lanes_t nu[3] = {s->at_nu[0].lanes[b], s->at_nu[1].lanes[b], s->at_nu[2].lanes[b]};
        lanes_t chi_dot[MOST_WHEELS];
        KERNEL(wheel_speeds)(wheels, s->rollers, s->model, nu, chi_dot);
        for (int i = 0; i < wheels; i++)
            s->rate_chi[i].lanes[b] = chi_dot[i];
    }
    for (int i = 0; i < wheels; i++)
        integrate_to_nodes(s->chi[i], s->h, &s->rate_chi[i], &s->at_chi[i]);
}

/* One sweep of Picard's iteration; returns the largest change of h nu'. An iterate may stray beyond the joint, where the
 * kernel is not asked. */
ALWAYS_INLINE double sweep(step_t *s, const int wheels)
{
    lanes_t change = lanes_of(0);
    states_at_nodes(s, wheels);
    for (int b = 0; b < BLOCKS; b++) {
        const lanes_t nu[3] = {s->at_nu[0].lanes[b], s->at_nu[1].lanes[b], s->at_nu[2].lanes[b]};
        lanes_t chi[MOST_WHEELS], nu_dot[3];
        for (int i = 0; i < wheels; i++)
            chi[i] = lanes_clamp(s->at_chi[i].lanes[b], s->joint);
        SOLVED(reduced)(wheels, s->rollers, s->model, nu, chi MOMENTA(s->momenta), nu_dot);
        for (int k = 0; k < 3; k++) {
            const lanes_t moved = lanes_abs(nu_dot[k] - s->rate_nu[k].lanes[b]);
            change = lanes_select(moved <= change, change, moved);
            s->rate_nu[k].lanes[b] = nu_dot[k];
        }
    }
    s->sweeps++;
    return lanes_largest(change)*s->h;
}

/* Ends of the step: chi and the wheels' rates there. */
ALWAYS_INLINE void end_of_step(step_t *s, const int wheels)
{
    for (int i = 0; i < wheels; i++) {
        s->end_chi[i] = s->chi[i] + s->h*weighted(&s->rate_chi[i], &gauss_weight);
        s->end_rate[i] = weighted(&s->rate_chi[i], &gauss_end);
    }
}

/* The length at which the first wheel reaches its joint, by Newton's rule from the step's end, or at most `most`. */
ALWAYS_INLINE double length_to_joint(step_t *s, const int wheels, double most)
{
    double length = most;
    s->landing = -1;
    for (int i = 0; i < wheels; i++) {
        const double sign = s->end_chi[i] < 0 ? -1 : 1;
        const double beyond = sign*s->end_chi[i] - s->joint, rate = sign*s->end_rate[i];
        if (!(rate > 0 || beyond > 0))
            continue;
        const double reached = rate > 0 ? s->h - beyond/rate : s->h/2;
        if (reached < length) {
            length = reached;
            s->landing = i;
        }
    }
    return length > 0.01*s->h ? length : 0.01*s->h;
}

/* What the polynomials of nu' miss inside the step, over |nu|: the last coefficients, integrated. */
ALWAYS_INLINE double missed(const step_t *s)
{
    return s->h*(tail(&s->rate_nu[0]) + tail(&s->rate_nu[1]) + tail(&s->rate_nu[2]))/(2*NODES);
}

enum { SETTLED, UNSETTLED, TOO_LONG };

/* The end of a step whose derivatives have settled. A sweep leaves nu and chi one sweep behind the derivatives; here they catch
 * up. False: the joint is not within reach after all. */
ALWAYS_INLINE int end_settled(step_t *s, const int wheels, double most, double reach)
{
    states_at_nodes(s, wheels);
    end_of_step(s, wheels);
    s->late = length_to_joint(s, wheels, most) - s->h;
    for (int k = 0; k < 3; k++)
        s->end_nu[k] = s->nu[k] + s->h*weighted(&s->rate_nu[k], &gauss_weight);
    return fabs(s->late) <= reach*s->h;
}

/* Picard's iteration, together with the length of the step. A step that is much too long shows it early. */
ALWAYS_INLINE int settle(step_t *s, const int wheels, double most, double tolerance, double sweep_tolerance, double reach)
{
    double last = INFINITY;
    for (int k = 0; k < MOST_SWEEPS; k++) {
        const double change = sweep(s, wheels);
        end_of_step(s, wheels);
        const double length = length_to_joint(s, wheels, most), moved = length - s->h;
        const double ratio = change/last;
        /* What the next sweeps would still change, as a geometric series. */
        const double rest = k > 0 && ratio < 0.5 ? change*ratio/(1 - ratio) : change;
        if (rest <= sweep_tolerance && fabs(moved) <= reach*s->h && end_settled(s, wheels, most, reach))
            return SETTLED;
        if (!(change < 1e300) || (k > 8 && change > 4*last && change > 16*sweep_tolerance))
            return UNSETTLED;
        last = change > 0 ? change : 1e-300;
        s->h = length;
        if (k == 2 && missed(s) > 4*tolerance)
            return TOO_LONG;
    }
    return UNSETTLED;
}

/* The joint is reached `late` after the end of the polynomials: so little that rates are constant there. */
ALWAYS_INLINE void end_late(step_t *s, const int wheels)
{
    for (int k = 0; k < 3; k++) {
        s->end_nu[k] += s->late*weighted(&s->rate_nu[k], &gauss_end);
        s->way[k] += s->late*weighted(&s->rate_pose[k], &gauss_end);
    }
    for (int i = 0; i < wheels; i++)
        s->end_chi[i] += s->late*s->end_rate[i];
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

/* A wheel that leaves its roller inside the step and is back at its end: the x in (0, 1) at which it is outermost, or 1. */
static EACH_LEVEL double turn_outside(const step_t *s, int wheel)
{
    const nodes_t *rate = &s->rate_chi[wheel];
    double left = 0, slope_left = weighted(rate, &gauss_start), area;
    for (int m = 0; m <= NODES; m++) {
        const double right = m < NODES ? gauss_node.node[m] : 1;
        const double slope_right = m < NODES ? rate->node[m] : s->end_rate[wheel];
        if ((slope_left > 0) != (slope_right > 0)) {
            double a = left, b = right, slope;
            for (int k = 0; k < 50; k++) {
                const double middle = (a + b)/2;
                legendre_value(rate, middle, &slope, &area);
                if ((slope > 0) == (slope_left > 0)) a = middle; else b = middle;
            }
            legendre_value(rate, b, &slope, &area);
            if (fabs(s->chi[wheel] + s->h*area) > s->joint*(1 + 8*EPS))
                return b;
        }
        left = right;
        slope_left = slope_right;
    }
    return 1;
}

/* x, y and theta at the end of the step: integrals that feed nothing back. The kernel's rates are those at the heading 0,
 * turned here: a heading may be any angle. */
static EACH_LEVEL void integrate_pose(step_t *s, const double *pose)
{
    nodes_t theta;
    for (int b = 0; b < BLOCKS; b++) {
        const lanes_t nu[3] = {s->at_nu[0].lanes[b], s->at_nu[1].lanes[b], s->at_nu[2].lanes[b]};
        lanes_t rate[3];
        KERNEL(pose_rates)(s->wheels, s->rollers, s->model, nu, lanes_of(0), rate);
        for (int k = 0; k < 3; k++)
            s->rate_pose[k].lanes[b] = rate[k];
    }
    integrate_to_nodes(remainder(pose[2], TURN), s->h, &s->rate_pose[2], &theta);
    for (int b = 0; b < BLOCKS; b++)
        lanes_turn(theta.lanes[b], &s->rate_pose[0].lanes[b], &s->rate_pose[1].lanes[b]);
    for (int k = 0; k < 3; k++)
        s->way[k] = s->h*weighted(&s->rate_pose[k], &gauss_weight);
}

/* The first guess of a step: the derivatives at its start, rising as in the last step; and the length to the first joint
 * at constant rates. */
ALWAYS_INLINE void guess(step_t *s, const int wheels, double most, const omniroll_run_t *run)
{
    lanes_t nu[3], chi[MOST_WHEELS], nu_dot[3], chi_dot[MOST_WHEELS];
    for (int k = 0; k < 3; k++)
        nu[k] = lanes_of(s->nu[k]);
    for (int i = 0; i < wheels; i++)
        chi[i] = lanes_of(s->chi[i]);
    SOLVED(reduced)(wheels, s->rollers, s->model, nu, chi MOMENTA(s->momenta), nu_dot);
    KERNEL(wheel_speeds)(wheels, s->rollers, s->model, nu, chi_dot);
    s->h = most;
    for (int i = 0; i < wheels; i++) {
        const double rate = chi_dot[i][0], sign = rate < 0 ? -1 : 1;
        if (rate != 0)
            s->h = fmin(s->h, (s->joint - sign*s->chi[i])/(sign*rate));
    }
    if (!(s->h > 1e-3*most))
        s->h = 1e-3*most;
    /* No slope, which is of the order of nu^3: it would leave the number range long before nu^2 does. */
    const double part = run->rise_over > 0 ? s->h/run->rise_over : 0;
    for (int k = 0; k < 3; k++)
        for (int b = 0; b < BLOCKS; b++)
            s->rate_nu[k].lanes[b] = nu_dot[k] + run->rise_nu[k]*(part*gauss_node.lanes[b]);
}

/* Rows, steps and switches as the caller gets them. */

static long long row_size(const omniroll_run_t *run) { return 7 + 2*run->wheels; }

static void put_row(omniroll_run_t *run)
{
    double *row = run->rows + row_size(run)*run->row_count++;
    *row++ = run->elapsed;
    for (int k = 0; k < 3; k++) *row++ = run->nu[k];
    for (int i = 0; i < run->wheels; i++) *row++ = run->chi[i];
    for (int k = 0; k < 3; k++) *row++ = run->pose[k];
    for (int i = 0; i < run->wheels; i++) *row++ = (double)run->contact[i];
}

static EACH_LEVEL void put_step(omniroll_run_t *run, const step_t *s)
{
    if (!run->steps)
        return;
    double *out = run->steps + (run->row_count - 1)*(2 + (6 + run->wheels)*NODES);
    *out++ = s->h;
    *out++ = s->late;
    for (int c = 0; c < 6 + run->wheels; c++) {
        const nodes_t *rate = c < 3 ? &s->rate_nu[c] : c < 3 + run->wheels ? &s->rate_chi[c - 3]
            : &s->rate_pose[c - 3 - run->wheels];
        const nodes_t coefficients = times(gauss_legendre, rate);
        for (int k = 0; k < NODES; k++)
            *out++ = coefficients.node[k];
    }
}

#ifdef OMNIROLL_FREE_ROLLERS
/* The two numbers of each wheel's free rollers. */
static void wheel_momenta(const omniroll_run_t *run, const lanes_t *model, lanes_t *momenta)
{
    lanes_t *axial = momenta + 2*run->wheels;
    const int size = run->wheels*(run->rollers_per_wheel - 1);
    for (int k = 0; k < size; k++)
        axial[k] = lanes_of(run->axial[k]);
    KERNEL(momenta)(run->wheels, run->rollers_per_wheel, model, axial, momenta);
}
#endif

/* The switching law, rules 4 to 7. directions: +1, -1, or 0 for a wheel that does not switch. */

#ifdef OMNIROLL_FREE_ROLLERS
/* The free rollers of a wheel change places: the leaving roller gets its place, the entering one loses it. */
static double exchange_places(double *axial, int places, int direction, double leaving)
{
    const int entering_place = direction > 0 ? places - 1 : 0;
    const double entering = axial[entering_place];
    if (direction > 0)
        for (int j = places - 1; j > 0; j--) axial[j] = axial[j - 1];
    else
        for (int j = 0; j < places - 1; j++) axial[j] = axial[j + 1];
    axial[places - 1 - entering_place] = leaving;
    return entering;
}
#endif

static EACH_LEVEL void apply_switch(omniroll_run_t *run, const lanes_t *model, const int *directions)
{
    const int wheels = run->wheels, rollers = run->rollers_per_wheel;
    lanes_t nu[3], before[MOST_WHEELS], after[MOST_WHEELS];
    for (int k = 0; k < 3; k++)
        nu[k] = lanes_of(run->nu[k]);
    for (int i = 0; i < wheels; i++) {
        before[i] = lanes_of(run->chi[i]);
        if (directions[i]) {
            run->chi[i] = -directions[i]*run->joint;
            run->contact[i] = (run->contact[i] - directions[i] + rollers) % rollers;
        }
        after[i] = lanes_of(run->chi[i]);
    }
#ifndef OMNIROLL_MASSLESS
    lanes_t entering[MOST_WHEELS], leaving[MOST_WHEELS], demanded[MOST_WHEELS], left[MOST_WHEELS], nu_after[3];
#ifdef OMNIROLL_FREE_ROLLERS
    KERNEL(contact_axial)(wheels, rollers, model, nu, before, left);
    KERNEL(contact_axial)(wheels, rollers, model, nu, after, demanded);
#else
    lanes_t chi_dot[MOST_WHEELS];
    KERNEL(wheel_rates)(wheels, rollers, model, nu, before, chi_dot, left);
    KERNEL(wheel_rates)(wheels, rollers, model, nu, after, chi_dot, demanded);
#endif
    for (int i = 0; i < wheels; i++) {
        double came_with = 0, stopped = 0;
        if (directions[i]) {
#ifdef OMNIROLL_FREE_ROLLERS
            came_with = exchange_places(run->axial + i*(rollers - 1), rollers - 1, directions[i], left[i][0]);
#else
            stopped = left[i][0];
#endif
        }
        entering[i] = lanes_of(directions[i] ? came_with - demanded[i][0] : 0);
        leaving[i] = lanes_of(stopped);
    }
    if (run->impact) {
        SOLVED(impact)(wheels, rollers, model, nu, after, entering, leaving, nu_after);
        for (int k = 0; k < 3; k++)
            run->nu[k] = nu_after[k][0];
    }
#else
    (void)model, (void)nu, (void)before, (void)after;
#endif
}

/* Located times closer than this are one switch (rule 5). */
static double tau(const omniroll_run_t *run, double phase_length)
{
    return 100*EPS*(fabs(run->start_time + run->elapsed) + fabs(phase_length));
}

/* The second derivatives of chi. */
static void wheel_accelerations(const omniroll_run_t *run, const lanes_t *model, lanes_t *momenta, const lanes_t *nu,
                                lanes_t *chi_ddot)
{
    lanes_t chi[MOST_WHEELS], nu_dot[3];
    for (int i = 0; i < run->wheels; i++)
        chi[i] = lanes_of(run->chi[i]);
#ifdef OMNIROLL_FREE_ROLLERS
    wheel_momenta(run, model, momenta);
#else
    (void)momenta;
#endif
    SOLVED(reduced)(run->wheels, run->rollers_per_wheel, model, nu, chi MOMENTA(momenta), nu_dot);
    KERNEL(wheel_speeds)(run->wheels, run->rollers_per_wheel, model, nu_dot, chi_ddot);
}

/* Rule 3: the wheels that stand at their joint and move outwards, or rest there and will; with those whose joint is closer in
 * time than tau (rule 5), be it to a switch or to the end of the run. Returns how many. */
static EACH_LEVEL int switching_wheels(const omniroll_run_t *run, const lanes_t *model, lanes_t *momenta, double phase_length,
                            int *directions)
{
    lanes_t nu[3], chi_dot[MOST_WHEELS], chi_ddot[MOST_WHEELS];
    const int at_end = run->elapsed >= run->duration && phase_length > 0;
    const double together = tau(run, phase_length);
    int at_joint = 0, resting = 0, count = 0;
    for (int k = 0; k < 3; k++)
        nu[k] = lanes_of(run->nu[k]);
    KERNEL(wheel_speeds)(run->wheels, run->rollers_per_wheel, model, nu, chi_dot);
    for (int i = 0; i < run->wheels; i++)
        resting += chi_dot[i][0] == 0 && fabs(run->chi[i]) >= run->joint;
    if (resting)
        wheel_accelerations(run, model, momenta, nu, chi_ddot);
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < run->wheels; i++) {
            const int sign = run->chi[i] < 0 ? -1 : 1;
            const double left = run->joint - sign*run->chi[i];
            const double rate = sign*(resting && chi_dot[i][0] == 0 ? chi_ddot[i][0] : chi_dot[i][0]);
            if (pass == 0)
                at_joint += rate > 0 && left <= (at_end ? together*rate : 0);
            else {
                directions[i] = at_joint > 0 && rate > 0 && left <= together*rate ? sign : 0;
                count += directions[i] != 0;
            }
        }
    return count;
}

/* Rule 9: switches at the same instant follow each other until no wheel moves outwards at its joint. Returns a status. */
static int switch_all(omniroll_run_t *run, const lanes_t *model, lanes_t *momenta)
{
    int directions[MOST_WHEELS];
    while (switching_wheels(run, model, momenta, run->elapsed - run->phase_start, directions)) {
        if (run->switch_count == run->switch_capacity || run->row_count == run->row_capacity)
            return OMNIROLL_FULL;
        if (run->elapsed - run->anchor > tau(run, run->elapsed - run->anchor)) {
            run->anchor = run->elapsed;
            run->idle_switches = 0;
        }
        if (++run->idle_switches > run->patience)
            return OMNIROLL_STUCK;
        apply_switch(run, model, directions);
        run->phase_start = run->elapsed;
        double *out = run->switches + (2 + run->wheels)*run->switch_count;
        *out++ = run->elapsed;
        *out++ = (double)run->row_count;
        for (int i = 0; i < run->wheels; i++)
            *out++ = directions[i];
#ifdef OMNIROLL_FREE_ROLLERS
        const long long size = (long long)run->wheels*(run->rollers_per_wheel - 1);
        for (long long k = 0; k < size; k++)
            run->switch_axial[run->switch_count*size + k] = run->axial[k];
#endif
        run->switch_count++;
        put_row(run);
    }
    return OMNIROLL_DONE;
}

/* One accepted step from the state of the run, of the length `most` or to the next joint. Returns a status. */
ALWAYS_INLINE int advance(omniroll_run_t *run, step_t *s, const int wheels)
{
    const double rest = run->duration - run->elapsed - run->carry;
    double most = run->step > 0 && run->step < rest ? run->step : rest;
    for (int k = 0; k < 3; k++)
        s->nu[k] = run->nu[k];
    for (int i = 0; i < wheels; i++)
        s->chi[i] = run->chi[i];
    const double size = largest3(s->nu);
    /* end_late() has an error of the order of (late/h)^2, so that the joint need not be hit better than this. */
    const double reach = fmax(fmin(0.03*sqrt(run->tolerance), 1e-5), 1e-8);
    for (int trial = 0; trial < 200; trial++) {
        guess(s, wheels, most, run);
        const int found = settle(s, wheels, most, size*run->tolerance, size*run->sweep_tolerance, reach);
        if (found == UNSETTLED) {
            most = fmin(s->h, most)/3;
            run->rejected_count++;
            continue;
        }
        integrate_pose(s, run->pose);
        const double error = size > 0 ? missed(s)/(size*run->tolerance) : 0;
        const double factor = error > 0 ? 0.9*pow(error, -1.0/NODES) : 5;
        if (error > 1 || found == TOO_LONG) {
            most = s->h*fmin(fmax(factor, 0.2), 0.9);
            run->rejected_count++;
            continue;
        }
        double turned = 1;
        for (int i = 0; i < wheels; i++)
            turned = fmin(turned, turn_outside(s, i));
        if (turned < 1) {
            most = s->h*turned;
            continue;
        }
        end_late(s, wheels);
        run->step_error = fmax(run->step_error, error*run->tolerance);
        run->step = s->h*fmin(fmax(factor, 1.0), 5.0);
        /* A joint cut the step short: the length that was meant stands for the next phase. At fine tolerances a try that is
         * too long costs more than a step that is too short. */
        if (s->landing >= 0)
            run->step = fmax(run->step, (run->tolerance > 1e-7 ? 1.0 : 0.6)*most);
        return OMNIROLL_DONE;
    }
    return OMNIROLL_NO_STEP;
}

/* a + b rounded, and what the rounding leaves over (Knuth). */
ALWAYS_INLINE double sum_and_rest(double a, double b, double *rest)
{
    const double sum = a + b, part = sum - a;
    *rest = (a - (sum - part)) + (b - part);
    return sum;
}

ALWAYS_INLINE void take(omniroll_run_t *run, const step_t *s)
{
    put_step(run, s);
    for (int k = 0; k < 3; k++) {
        run->nu[k] = s->end_nu[k];
        run->pose[k] = sum_and_rest(run->pose[k], s->way[k] + run->pose_carry[k], &run->pose_carry[k]);
    }
    for (int i = 0; i < run->wheels; i++) {
        const double sign = s->end_chi[i] < 0 ? -1 : 1;
        run->chi[i] = i == s->landing ? sign*run->joint : fmax(fmin(s->end_chi[i], run->joint), -run->joint);
    }
    const int last = s->landing < 0 && s->h >= run->duration - run->elapsed - run->carry;
    const double h = s->h + s->late + run->carry, sum = run->elapsed + h;
    run->carry = last ? 0 : h - (sum - run->elapsed);
    run->elapsed = last ? run->duration : fmin(sum, run->duration);
    for (int k = 0; k < 3; k++)
        run->rise_nu[k] = weighted(&s->rate_nu[k], &gauss_end) - weighted(&s->rate_nu[k], &gauss_start);
    run->rise_over = s->h;
    run->step_count++;
    put_row(run);
}

ALWAYS_INLINE int run_phases(omniroll_run_t *run, const double *model_, int model_size, const int wheels)
{
    lanes_t *const model = (lanes_t *)run->work, *const momenta = model + model_size;
    step_t s;
    for (int k = 0; k < model_size; k++)
        model[k] = lanes_of(model_[k]);
    s.wheels = wheels, s.rollers = run->rollers_per_wheel, s.model = model, s.momenta = momenta, s.joint = run->joint;
    s.sweeps = 0;
    int status = OMNIROLL_DONE;
    if (run->row_count == 0)
        put_row(run);
    for (;;) {
        status = switch_all(run, model, momenta);
        if (status != OMNIROLL_DONE || run->elapsed >= run->duration)
            break;
        if (run->row_count == run->row_capacity) {
            status = OMNIROLL_FULL;
            break;
        }
#ifdef OMNIROLL_FREE_ROLLERS
        wheel_momenta(run, model, momenta);
#endif
        status = advance(run, &s, wheels);
        if (status != OMNIROLL_DONE)
            break;
        take(run, &s);
    }
    run->sweep_count += s.sweeps;
    return status;
}

/* Doubles that run->work needs, aligned to 64 bytes: the model and the rollers' momenta in lanes. */
long long ENGINE(run_work_size)(int wheels, int rollers_per_wheel, int model_size)
{
    return (long long)LANES*(model_size + 2*wheels + (long long)wheels*(rollers_per_wheel - 1));
}

/* Phases and switches until the duration is over or there is no more room. The usual numbers of wheels are compiled with
 * their loops unrolled. */
EACH_LEVEL int ENGINE(run)(omniroll_run_t *run, const double *model, int model_size)
{
    if (run->wheels > MOST_WHEELS)
        return OMNIROLL_NO_STEP;
    switch (run->wheels) {
    case 3: return run_phases(run, model, model_size, 3);
    case 4: return run_phases(run, model, model_size, 4);
    default: return run_phases(run, model, model_size, run->wheels);
    }
}
