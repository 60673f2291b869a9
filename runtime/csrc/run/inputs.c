/* What acts on the vehicle: the signals between two events, and how they change at one. Tables have knots,
 * controllers have samples, what is affine in a signal and in a wheel's rate has modes. */
#include "controller.h"

/* The value of a curve at elapsed + carry, and its slope from there up to its next time. */
static void curve_after(const omniroll_curve_t *curve, double elapsed, double carry, double *value, double *slope)
{
    const long long segment = curve->next - 1;
    const double *const held = curve->values + (segment > 0 ? segment : 0)*curve->width;
    const int flat = segment < 0 || segment == curve->count - 1 || curve->held;
    for (int k = 0; k < curve->width; k++) {
        slope[k] = flat ? 0 : (held[curve->width + k] - held[k])/(curve->times[segment + 1] - curve->times[segment]);
        value[k] = flat ? held[k] : held[k] + slope[k]*((elapsed - curve->times[segment]) + carry);
    }
}

static void pass_knots(omniroll_curve_t *curve, double elapsed)
{
    while (curve->next < curve->count && curve->times[curve->next] <= elapsed)
        curve->next++;
}

/* One sample: what the wheels' speeds lack, and its sum over time. Where the output is cut off, the sum waits. */
static void take_sample(const omniroll_run_t *run, const work_t *work, omniroll_sampler_t *sampler)
{
    const double time = (double)sampler->samples*sampler->sample_time;
    double wanted[3], slope[3], errors[MAX_WHEELS], sums[MAX_WHEELS], outputs[MAX_WHEELS];
    lanes_t lacking[3], in_lanes[MAX_WHEELS];
    pass_knots(&sampler->target, time);
    curve_after(&sampler->target, time, 0, wanted, slope);
    for (int k = 0; k < 3; k++)
        lacking[k] = lanes_of(SET_SLIPS || SET_PIVOTS ? wanted[k] : wanted[k] - run->state.nu[k]);
    if (SET_CARRIES)
        rates_in_the_middle(run, work, lacking, in_lanes);
    else
        rolling_wheels(run->wheels, &work->vehicle, lacking, 0, in_lanes);
    for (int i = 0; i < run->wheels; i++)
        errors[i] = in_lanes[i][0] - (SET_HAS_ROWS && !SET_SLIPS ? rate_by(run->wheel_rows + 3*i, run->state.nu) : 0);
    for (int i = 0; SET_SLIPS && i < run->wheels; i++)
        errors[i] -= run->state.core[rates_at(run->wheels) + i];
    if (SET_CHI_FEEDS_BACK && !SET_SLIPS) {
        wheel_rates_now(run, work, in_lanes);
        for (int i = 0; i < run->wheels; i++)
            errors[i] -= in_lanes[i][0];
    }
    omniroll_controller_sample(run->wheels, errors, sampler->sum, sampler->proportional, sampler->integral,
                               sampler->sample_time, sums, outputs);
    for (int i = 0; i < run->wheels; i++) {
        sampler->output[i] = fmax(fmin(outputs[i], sampler->limit), -sampler->limit);
        if (sampler->output[i] == outputs[i])
            sampler->sum[i] = sums[i];
    }
    sampler->samples++;
}

/* The times known beforehand that have come. */
static void pass_times(omniroll_run_t *run, const work_t *work)
{
    for (int k = 0; k < run->acts.table_count; k++)
        pass_knots(&run->acts.tables[k].curve, run->state.elapsed);
    for (int k = 0; k < run->acts.sampler_count; k++)
        if ((double)run->acts.samplers[k].samples*run->acts.samplers[k].sample_time <= run->state.elapsed)
            take_sample(run, work, &run->acts.samplers[k]);
}

/* Whether a sample has come that the caller must take. */
static int caller_samples(const omniroll_run_t *run)
{
    for (int k = 0; k < run->acts.sampler_count; k++) {
        const omniroll_sampler_t *const sampler = &run->acts.samplers[k];
        if (!sampler->proportional && (double)sampler->samples*sampler->sample_time <= run->state.elapsed)
            return 1;
    }
    return 0;
}

static double next_known_time(const omniroll_run_t *run)
{
    double time = INFINITY;
    for (int k = 0; k < run->acts.table_count; k++) {
        const omniroll_curve_t *const curve = &run->acts.tables[k].curve;
        if (curve->next < curve->count)
            time = fmin(time, curve->times[curve->next]);
    }
    for (int k = 0; k < run->acts.sampler_count; k++)
        time = fmin(time, (double)run->acts.samplers[k].samples*run->acts.samplers[k].sample_time);
    return time;
}

/* A guard: an event function of the wheel's mode, with the signal's value and slope. */
static void put_guard(omniroll_run_t *run, const double *row, int wheel, omniroll_affine_t margin, double value,
                      double slope, long long follows)
{
    double *const guard = run->acts.guards + guard_size(run->wheels)*run->acts.guard_count;
    guard[0] = margin.at_zero + margin.per_signal*value;
    guard[1] = margin.per_signal*slope;
    for (int k = 0; k < 3; k++)
        guard[2 + k] = SET_SLIPS || SET_CHI_FEEDS_BACK ? 0 : margin.per_rate*row[k];
    for (int i = 0; (SET_SLIPS || SET_CHI_FEEDS_BACK) && i < run->wheels; i++)
        guard[6 + i] = i == wheel ? margin.per_rate : 0;
    for (int k = 6 + run->wheels; k < guard_size(run->wheels); k++)
        guard[k] = 0;
    guard[5] = fabs(margin.at_zero) + fabs(margin.per_signal*value);
    run->acts.leads_to[2*run->acts.guard_count] = follows;
    run->acts.leads_to[2*run->acts.guard_count + 1] = wheel;
    run->acts.guard_count++;
}

/* The torques of a drive with modes, what falls with the wheels' speeds apart, and where a mode ends. */
static void modes_act(omniroll_run_t *run, const omniroll_modal_t *drive)
{
    const int wheels = run->wheels, slopes = (SET_INPUTS + 1)*wheels, laws = 1 + drive->event_count;
    double *const torque = run->acts.signals, *const damping = torque + wheels;
    const double *const signal = torque + drive->signal*wheels;
    for (int i = 0; i < wheels; i++) {
        const long long mode = drive->modes[i];
        const omniroll_affine_t *const law = drive->laws + laws*(mode*wheels + i);
        torque[i] += law->at_zero + law->per_signal*signal[i];
        torque[slopes + i] += law->per_signal*signal[slopes + i];
        damping[i] -= law->per_rate;
        for (int t = 0; t < drive->transition_count; t++) {
            const long long *const transition = drive->transitions + 3*t;    /* mode, event, mode that follows */
            if (transition[0] == mode)
                put_guard(run, (SET_HAS_ROWS ? run->wheel_rows : drive->wheel_rows) + 3*i, i, law[1 + transition[1]],
                          signal[i], signal[slopes + i], transition[2]);
        }
    }
}

/* The inputs from now on. */
static void renew_inputs(omniroll_run_t *run)
{
    const int wheels = run->wheels, size = (SET_INPUTS + 1)*wheels;
    for (int k = 0; k < 2*size; k++)
        run->acts.signals[k] = 0;
    for (int t = 0; t < run->acts.table_count; t++) {
        const omniroll_table_t *const table = run->acts.tables + t;
        double value[MAX_WHEELS], slope[MAX_WHEELS], *const signal = run->acts.signals + table->signal*wheels;
        curve_after(&table->curve, run->state.elapsed, run->state.carry, value, slope);
        for (int i = 0; i < wheels; i++)
            signal[i] += value[i], signal[size + i] += slope[i];
    }
    for (int t = 0; t < run->acts.sampler_count; t++)
        for (int i = 0; i < wheels; i++)
            run->acts.signals[run->acts.samplers[t].signal*wheels + i] += run->acts.samplers[t].output[i];
    run->acts.guard_count = 0;
    if (SET_INPUTS > 1 && run->acts.modal_count)
        modes_act(run, run->acts.modal);
    for (int k = 0; k < SET_INPUTS*wheels; k++) {
        run->acts.signals[2*size + k] = run->acts.inputs[SET_INPUTS*wheels + k];
        run->acts.inputs[k] = run->acts.signals[k];
        run->acts.inputs[SET_INPUTS*wheels + k] = run->acts.signals[size + k];
    }
    run->acts.inputs_elapsed = run->state.elapsed;
    run->acts.inputs_carry = run->state.carry;
    run->acts.next_time = next_known_time(run);
}

/* The modes of the guards that are passed. */
static void pass_guards(omniroll_run_t *run)
{
    for (int k = 0; k < run->acts.guard_count; k++)
        if (run->acts.passed[k] && run->acts.modal_count)
            run->acts.modal->modes[run->acts.leads_to[2*k + 1]] = run->acts.leads_to[2*k];
}

/* What happens at this instant beside switches: times that have come, guards that are passed, bearings that stop or
 * break away. Returns a status. */
static int pass_events(omniroll_run_t *run, const work_t *work)
{
    for (;;) {
        settle_modes(run, work);
        const int is_time = run->state.elapsed >= run->acts.next_time;
        const int guards = is_time ? 0 : guards_passed(run, work);
        const int bearings = is_time ? 0 : pass_bearings(run, work);
        const int contacts = is_time ? 0 : pass_contacts(run);
        if (!is_time && !guards && !bearings && !contacts) {
            run->past.at_event = 0;
            return OMNIROLL_RUN_DONE;
        }
        if (is_time && caller_samples(run))
            return OMNIROLL_RUN_ASK;
        run->past.phase_start = run->state.elapsed;
        run->past.at_event = 0;
        if (!has_progress(run, 1))
            return OMNIROLL_RUN_STUCK;
        if (!is_time && !guards)
            continue;
        run->hold.undecided = run->ground.undecided = 1;    /* since the inputs change                   */
        if (run->acts.asks)
            return OMNIROLL_RUN_ASK;
        if (is_time)
            pass_times(run, work);
        else
            pass_guards(run);
        renew_inputs(run);
    }
}
