/* The compiled engine: a run is phases, events and transitions, until its duration is over.
 *
 * run/         what happens at instants, what acts, what the caller gets
 * step/        a step: the state at its nodes, and where it ends
 * bearings/    bearings that stick, of axles and of rollers
 * ground/      contacts with the ground: Coulomb's friction
 * deviations/  deviations of a run, a library by itself
 *
 * docs/architecture.md says what each file does. */
#include "set_in_lanes.h"

#include "engine_set.h"

#define EPS 2.220446049250313e-16
#define PASSED 16                   /* roundings above zero is beyond                                       */
#define MAX_GUARDS 256
#define AT_REST 16                  /* a rate is zero within this many of its roundings                     */
/* Times an input's rounding: of torques that hold. On wheels that stand the ground's part may be far less than the bearing's,
 * which it is rounded with. */
#define HELD_ROUNDINGS (SET_STANDS ? 16 : 64)

#include "parts.c"
#include "linear.c"
#define SET_DECIDES (SET_GRIPS || SET_STICKS)   /* what rests may stick */
#define FRICTION_LINKAGE static inline
#include "friction/elimination.c"
#include "friction/balls.c"
#include "friction/interior.c"
#include "friction/active_set.c"
#include "friction/elements.c"
#include "run/elements_at_rest.c"
#include "bearings/resting_rows.c"
#include "step/collocation.c"
#include "step/bends.c"
#include "step/coupled.c"
#include "step/sprung.c"
#include "ground/directions.c"
#include "bearings/contact_rows.c"
#include "step/events.c"
#include "ground/contact_events.c"
#include "bearings/bearing_events.c"
#include "ground/least_use.c"
#include "ground/use_events.c"
#include "run/pieces.c"
#include "run/rows.c"
#include "run/instant.c"
#include "bearings/core_bearings.c"
#include "bearings/rollers_in_series.c"
#include "run/delassus.c"
#include "run/decisions.c"
#include "bearings/slipping_axles.c"
#include "bearings/slipping_rollers.c"
#include "ground/standing_rows.c"
#include "ground/grip.c"
#include "ground/strips.c"
#include "ground/standing.c"
#include "bearings/sticking.c"
#include "run/modes.c"
#include "run/sides.c"
#include "run/transitions.c"
#include "run/pivots.c"
#include "run/swings.c"
#include "run/inputs.c"
#include "run/distance.c"
#include "ground/approach.c"
#include "step/steps.c"
#include "run/laws.c"

/* A row with the inputs of the phase that starts now, if they are not those of the last row. */
static void complete_rows(omniroll_run_t *run)
{
    (void)run;
    if (SET_INPUTS) {
        const int size = SET_INPUTS*run->wheels;
        const double *const last = run->record.rows + row_size(run)*run->record.row_count - size;
        const double *const slopes_before = run->acts.signals + 2*(SET_INPUTS + 1)*run->wheels;
        int same = 1;
        for (int k = 0; k < size; k++) {
            const double now = input_shown(run, k);
            const double sizes = fabs(last[k]) + fabs(now) + fabs(slopes_before[k]*run->state.elapsed)
                               + size_of_held(run, k);
            same &= fabs(now - last[k]) <= PASSED*EPS*sizes;
        }
        if (!same)
            put_row_after(run);
    }
}

/* The first row of all has the inputs that the first phase begins with; the first of a call repeats the last of the one
 * before. Returns a status. */
static int first_row(omniroll_run_t *run, const work_t *work)
{
    if (SET_IS_ACTED_ON && !run->past.started) {
        if (!run->acts.asks && caller_samples(run))  /* first: modes are decided once, under the torques that act */
            return OMNIROLL_RUN_ASK;
        if (!run->acts.asks)
            renew_inputs(run);
        const int status = pass_events(run, work);
        if (status != OMNIROLL_RUN_DONE)
            return status;
    }
    (void)work;
    run->past.started = 1;
    if (run->record.row_count == 0)
        put_row(run);
    return OMNIROLL_RUN_DONE;
}

/* All that happens at this instant. Returns a status; OMNIROLL_RUN_DONE: a phase follows, or the duration is over. */
static int pass_instant(omniroll_run_t *run, const work_t *work)
{
    int status = switch_all(run, work);
    if (SET_IS_ACTED_ON) {
        if (status == OMNIROLL_RUN_DONE && run->record.row_count == run->record.row_capacity)
            status = OMNIROLL_RUN_FULL;         /* the row that the next call repeats has the inputs of before */
        if (status == OMNIROLL_RUN_DONE && run->state.elapsed < run->task.duration)
            status = pass_events(run, work);
        if (status == OMNIROLL_RUN_DONE && run->state.elapsed < run->task.duration)
            complete_rows(run);
    }
    return status;
}

/* What a call works with, and what no step changes. */
ALWAYS_INLINE void begin_call(omniroll_run_t *run, const omniroll_model *constants, const int wheels, work_t *work,
                              step_t *s)
{
    lanes_t *const memory = (lanes_t *)run->work;
    lay_out(work, memory, wheels, run->rollers_per_wheel);
    lanes_spread(constants, memory, &work->vehicle);
    count_from_pieces(run);
    if (SET_CARRIES)
        carry_rows(run, work);
    s->wheels = wheels, s->vehicle = &work->vehicle, s->momenta = work->momenta, s->joint = run->joint;
    s->sweeps = 0;
    s->core = work->core;                       /* 0 of sets that integrate nothing beside nu                 */
    s->event.guards = s->hold.held = s->hold.of_contacts = 0;
    s->contact.sliding = s->contact.turning = s->contact.gripping = 0;
    if (SET_IS_ACTED_ON)
        s->stiff.on = s->stiff.of_nu = s->stiff.by_axles = 0;
    if (SET_CORE_PARTS && !run->past.started) {
        begin_core(run, work);
        for (int c = 0; c < work->core; c++)
            work->rise_core[c] = 0;
    }
    if (SET_STICKS && !run->past.started)
        clear_bearings(run, work);
    if (SET_STANDS || SET_HOLDS)                /* anew in each call: a copy of a session has other bearings      */
        work->standing->contact = contact_bearings(run);
    if (SET_GRIPS) {
        run->ground.knows_rates = 0;
        friction_in_lanes(run, work);
    }
    if (SET_HAS_MOMENTA)
        wheel_momenta(run, work);
}

/* A call ends: what a session keeps of run->work has no pointers, which would be those of this call. */
ALWAYS_INLINE void end_call(const work_t *work)
{
    if (SET_STANDS || SET_HOLDS)
        work->standing->contact = 0, work->standing->problem = 0, work->standing->has_part = 0;
}

ALWAYS_INLINE int run_phases(omniroll_run_t *run, const omniroll_model *constants, const int wheels)
{
    work_t work;
    step_t s;
    begin_call(run, constants, wheels, &work, &s);
    const long long first = run->record.row_count;
    int status = first_row(run, &work);
    while (status == OMNIROLL_RUN_DONE) {
        status = pass_instant(run, &work);
        if (status != OMNIROLL_RUN_DONE || run->state.elapsed >= run->task.duration)
            break;
        if (!has_room(run, first)) {
            status = OMNIROLL_RUN_FULL;
            break;
        }
        if (SET_HAS_MOMENTA && !SET_GRIPS)
            wheel_momenta(run, &work);
        status = advance(run, &work, &s, wheels);
        const int unlawful = SET_DECIDES ? unlawful_wheel(run, &s) : -1;
        if (unlawful >= 0) {
            run->record.stopped_wheel = unlawful;
            status = OMNIROLL_RUN_UNLAWFUL;
        }
        if (status == OMNIROLL_RUN_DONE)
            take(run, &work, &s, wheels);
    }
    run->record.sweep_count += s.sweeps;
    count_from_rollers(run);
    end_call(&work);
    return status;
}

/* Doubles that run->work needs, aligned to 64 bytes. */
long long omniroll_run_work_size(int wheels, int rollers_per_wheel)
{
    work_t work;
    return LANES*lay_out(&work, (lanes_t *)0, wheels, rollers_per_wheel);
}

long long omniroll_run_modes(int wheels, int rollers_per_wheel)
{
    return max_bearings(wheels, rollers_per_wheel);
}

const char *omniroll_run_states(void)
{
    return SET_STATE_NAMES;
}

const char *omniroll_run_inputs(void)
{
    return SET_INPUT_NAMES;
}

/* Phases, events and transitions until the duration is over or there is no more room. */
int omniroll_run(omniroll_run_t *run, const omniroll_model *model)
{
    if (!TAKES_WHEELS(run->wheels))
        return OMNIROLL_RUN_WHEELS;
    return run_phases(run, model, FIXED_WHEELS(run->wheels));
}

#include "run/members.c"
