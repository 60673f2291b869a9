/* The parts of a sweep over the nodes of a step, each repeated with nothing between: what the engine's own functions take
 * where one waits for the other. For limit.py; bare sets. */
#include "run.c"

#define LITTLE 1e-30                /* of a rate, so that a state stays where it is and yet waits for it        */

/* New rates from the states at the nodes. */
ALWAYS_INLINE void evaluate(step_t *s, const int wheels)
{
    for (int b = 0; b < BLOCKS; b++) {
        arrays_t at;
        lanes_t nu_dot[3];
        const point_t point = point_at(s, wheels, b, &at);
        core_rates(wheels, &point, nu_dot);
        for (int k = 0; k < 3; k++)
            s->rate_nu[k].lanes[b] = nu_dot[k];
    }
}

/* States at the nodes that wait for the rates, without a sum. */
ALWAYS_INLINE void wait_for_rates(step_t *s, const int wheels)
{
    for (int b = 0; b < BLOCKS; b++) {
        for (int k = 0; k < 3; k++)
            s->at_nu[k].lanes[b] += LITTLE*s->rate_nu[k].lanes[b];
        for (int i = 0; i < wheels; i++)
            s->at_chi[i].lanes[b] += LITTLE*s->rate_nu[0].lanes[b];
    }
}

enum { EVALUATIONS, SUMS_TOO, SWEEPS };

/* One part of a sweep `count` times, at the start of a run that has been prepared; returns a number that depends on all
 * of them. */
double repeat_part(omniroll_run_t *run, const omniroll_model *constants, int part, long long count)
{
    enum { wheels = OMNIROLL_WHEELS };
    work_t work;
    step_t s;
    lanes_t *const memory = (lanes_t *)run->work;
    double longest = run->duration;
    lay_out(&work, memory, wheels, run->rollers_per_wheel);
    lanes_spread(constants, memory, &work.vehicle);
    s.wheels = wheels, s.vehicle = &work.vehicle, s.momenta = work.momenta, s.joint = run->joint;
#ifdef LANES_HAS_MOMENTA
    wheel_momenta(run, &work);
#endif
    begin_step(run, &work, &s, wheels);
    guess(&s, wheels, &longest, run, &work);
    states_at_nodes(&s, wheels);
    for (long long k = 0; k < count; k++)
        if (part == SWEEPS)
            sweep(&s, wheels, 0);
        else {
            if (part == SUMS_TOO)
                states_at_nodes(&s, wheels);
            else
                wait_for_rates(&s, wheels);
            evaluate(&s, wheels);
        }
    return s.rate_nu[0].node[0];
}
