/* What acts on the vehicle: the signals between two events, and how they change at one. Tables have knots,
 * controllers have samples, motors have modes. */
#if SET_IS_ACTED_ON

/* The value of a curve and its slope from `elapsed` up to its next time. */
static void curve_after(const omniroll_curve_t *curve, double elapsed, double *value, double *slope)
{
    const long long segment = curve->next - 1;
    const double *const held = curve->values + (segment > 0 ? segment : 0)*curve->width;
    const int flat = segment < 0 || segment == curve->count - 1 || curve->held;
    for (int k = 0; k < curve->width; k++) {
        slope[k] = flat ? 0 : (held[curve->width + k] - held[k])/(curve->times[segment + 1] - curve->times[segment]);
        value[k] = flat ? held[k] : held[k] + slope[k]*(elapsed - curve->times[segment]);
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
    double wanted[3], slope[3];
    lanes_t lacking[3], errors[MOST_WHEELS];
    pass_knots(&sampler->target, (double)sampler->samples*sampler->sample_time);
    curve_after(&sampler->target, (double)sampler->samples*sampler->sample_time, wanted, slope);
    for (int k = 0; k < 3; k++)
        lacking[k] = lanes_of(wanted[k] - run->nu[k]);
    set_wheel_speeds(run->wheels, &work->vehicle, lacking, errors);
    for (int i = 0; i < run->wheels; i++) {
        const double error = errors[i][0], sum = sampler->sum[i] + sampler->sample_time*error;
        const double output = sampler->proportional[i]*error + sampler->integral[i]*sum;
        sampler->output[i] = fmax(fmin(output, sampler->limit), -sampler->limit);
        if (sampler->output[i] == output)
            sampler->sum[i] = sum;
    }
    sampler->samples++;
}

/* The times known beforehand that have come. */
static void pass_times(omniroll_run_t *run, const work_t *work)
{
    for (int k = 0; k < run->table_count; k++)
        pass_knots(&run->tables[k].curve, run->elapsed);
    for (int k = 0; k < run->sampler_count; k++)
        if ((double)run->samplers[k].samples*run->samplers[k].sample_time <= run->elapsed)
            take_sample(run, work, &run->samplers[k]);
}

static double next_known_time(const omniroll_run_t *run)
{
    double time = INFINITY;
    for (int k = 0; k < run->table_count; k++) {
        const omniroll_curve_t *const curve = &run->tables[k].curve;
        if (curve->next < curve->count)
            time = fmin(time, curve->times[curve->next]);
    }
    for (int k = 0; k < run->sampler_count; k++)
        time = fmin(time, (double)run->samplers[k].samples*run->samplers[k].sample_time);
    return time;
}

#if SET_INPUTS > 1
/* A guard on a motor's current: sign * current + part * limit. */
static void put_guard(omniroll_run_t *run, const omniroll_motors_t *motors, int wheel, int sign, int part, int mode)
{
    const double *const row = motors->wheel_rows + 3*wheel;
    const double *const voltage = run->signals + SET_INPUTS*run->wheels + wheel;
    const double *const slope = voltage + (SET_INPUTS + 1)*run->wheels;
    double *const guard = run->guards + 6*run->guard_count;
    const double current = sign*(*voltage*motors->inverse_resistance);
    guard[0] = part*motors->limit + current;
    guard[5] = motors->limit + fabs(current);
    guard[1] = sign*(*slope*motors->inverse_resistance);
    for (int k = 0; k < 3; k++)
        guard[2 + k] = -sign*(motors->rate_voltage*motors->inverse_resistance)*row[k];
    run->leads_to[2*run->guard_count] = mode;
    run->leads_to[2*run->guard_count + 1] = wheel;
    run->guard_count++;
}

/* The torques of the motors, what falls with the wheels' speeds apart, and where a mode ends. */
static void motors_act(omniroll_run_t *run, const omniroll_motors_t *motors)
{
    const int wheels = run->wheels, slopes = (SET_INPUTS + 1)*wheels;
    double *const torque = run->signals, *const damping = torque + wheels, *const voltage = torque + SET_INPUTS*wheels;
    for (int i = 0; i < wheels; i++) {
        const int mode = (int)motors->modes[i];
        if (mode == 0) {
            torque[i] += motors->volt_torque*voltage[i];
            torque[slopes + i] += motors->volt_torque*voltage[slopes + i];
            damping[i] += motors->volt_torque*motors->rate_voltage;
        } else
            torque[i] += mode*motors->limit_torque;
        if (motors->limit < INFINITY && mode == 0) {
            put_guard(run, motors, i, +1, -1, +1);
            put_guard(run, motors, i, -1, -1, -1);
        } else if (motors->limit < INFINITY)
            put_guard(run, motors, i, -mode, +1, 0);
    }
}
#endif

/* The inputs from now on. */
static void renew_inputs(omniroll_run_t *run)
{
    const int wheels = run->wheels, size = (SET_INPUTS + 1)*wheels;
    for (int k = 0; k < 2*size; k++)
        run->signals[k] = 0;
    for (int t = 0; t < run->table_count; t++) {
        double value[MOST_WHEELS], slope[MOST_WHEELS], *const signal = run->signals + run->tables[t].signal*wheels;
        curve_after(&run->tables[t].curve, run->elapsed, value, slope);
        for (int i = 0; i < wheels; i++)
            signal[i] += value[i], signal[size + i] += slope[i];
    }
    for (int t = 0; t < run->sampler_count; t++)
        for (int i = 0; i < wheels; i++)
            run->signals[run->samplers[t].signal*wheels + i] += run->samplers[t].output[i];
    run->guard_count = 0;
#if SET_INPUTS > 1
    if (run->motors_count)
        motors_act(run, run->motors);
#endif
#if SET_INPUTS
    for (int k = 0; k < SET_INPUTS*wheels; k++) {
        run->signals[2*size + k] = run->inputs[SET_INPUTS*wheels + k];
        run->inputs[k] = run->signals[k];
        run->inputs[SET_INPUTS*wheels + k] = run->signals[size + k];
    }
#endif
    run->inputs_elapsed = run->elapsed;
    run->next_time = next_known_time(run);
}

/* The modes of the guards that are passed. */
static void pass_guards(omniroll_run_t *run)
{
    for (int k = 0; k < run->guard_count; k++)
        if (run->passed[k] && run->motors_count)
            run->motors->modes[run->leads_to[2*k + 1]] = run->leads_to[2*k];
}

/* What happens at this instant beside switches: times that have come, guards that are passed. Returns a status. */
static int pass_events(omniroll_run_t *run, const work_t *work)
{
    for (;;) {
        const int is_time = run->elapsed >= run->next_time;
        if (!is_time && !guards_passed(run, work)) {
            run->at_event = 0;
            return OMNIROLL_RUN_DONE;
        }
        run->phase_start = run->elapsed;
        run->at_event = 0;
        if (!has_progress(run, 1))
            return OMNIROLL_RUN_STUCK;
        if (run->asks)
            return OMNIROLL_RUN_ASK;
        if (is_time)
            pass_times(run, work);
        else
            pass_guards(run);
        renew_inputs(run);
    }
}
#endif
