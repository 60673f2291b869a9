/* How deviations pass where bearings change their modes that have rates of their own: axles and rollers, where wheels
 * may slip under a smooth law.
 *
 * What comes to rest does so by its own bearing alone. With what the torques of bearings do to the rates, R, and to the
 * rates of bearings, W,
 *
 *     d* = d- - R W^-1 ds                              (ds: of the rates that have come to rest)
 *
 * Where one turns back at once, or breaks away, rates jump at a time that deviates. With the rates f* while those that
 * have come to rest stay there,
 *
 *     d+ = d* + (f* - f+) dt,   dt = -ds/s',   dt = -d excess/excess'
 *
 * (runtime/omniroll/engine/roller_deviations.py). Where something only just happens, or several are apart beside the
 * run, the caller decides. */

#if SET_OWN_BEARINGS && !SET_STANDS
/* What comes to rest takes the deviations of its rate away: into w->moved, with these deviations, and the modes before,
 * at the point. Returns whether that is determinate. */
static int take_own_rests(variations_t *w, const int *of, int count, lanes_t *torque)
{
    double to_known[w->known*count], to_own[count*count];
    int unit[count];
    for (int k = 0; k < count; k++)
        unit[k] = 2*w->wheels + of[k];
    put_responses(w, unit, count, to_known, to_own);
    if (!solve_small(to_own, count, torque, w->groups))
        return 0;
    take_responses(w, to_known, count, torque);
    return 1;
}

/* By how much the times deviate (columns) at which what bearings are asked for comes to its bound: of all that break
 * away, where the rates before have been computed last. Returns 0 where one only just comes there or is not there,
 * where they come there apart, or where no step has said yet how inputs deviate. */
static int put_times_of_break(variations_t *w, const own_change_t *e, const lanes_t *before, double *time)
{
    const int wheels = OWN_WHEELS(w->wheels), count = MOST_OWN(w);
    const double lasted = time_of_own_modes(w, e->before, 0, count) + w->run->elapsed[e->row]
        - w->run->elapsed[e->before];
    double side[count], rises[count];
    if (step_before(w, e->row) < 0)
        return 0;
    for (int p = TIMES_ALONE; p < w->columns; p++) {
        const int model = p < 0 ? 0 : w->run->number[p];
        const point_t at = point_of(w, &w->vehicle[model], w->point);
        lanes_t nu_dot[3], nu_dot_along[3];
        put_way(w, e->row, p, before);
        const point_t along = point_of(w, at.vehicle, w->along);
        rates_along(wheels, &at, &along, nu_dot, nu_dot_along);
        double least = INFINITY, most = -INFINITY;
        for (int k = 0; k < count; k++) {
            if (!breaks_away(w, e, k))
                continue;
            const double bound = w->run->own_most[k], asked = own_asked(w, &at, k);
            if (p < 0) {
                side[k] = asked < 0 ? -1 : 1, rises[k] = side[k]*own_asked(w, &along, k);
                if (!(fabs(asked) >= (1 - w->run->reached)*bound && rises[k]*lasted > w->run->only_just*bound))
                    return take_way_back(w), 0;
                continue;
            }
            const double own = -(side[k]*own_asked(w, &along, k) - moved_most(w, p, k))/rises[k];
            least = fmin(least, own), most = fmax(most, own);
        }
        take_way_back(w);
        if (p >= 0 && most - least > LETS_GO_TOGETHER*fmax(fabs(least), fabs(most)))
            return 0;
        if (p >= 0)
            time[p] = least;
    }
    return 1;
}

/* By how much the times deviate at which rates come to zero, and others break away. Returns 0 where they do so apart.
 */
static int put_times_of_change(variations_t *w, const own_change_t *e, const int *of, int count, const lanes_t *turning,
                               const double *dot, double *time)
{
    int breaks = 0;
    for (int k = 0; k < MOST_OWN(w); k++)
        breaks += breaks_away(w, e, k);
    if (breaks) {
        double unused[2*MOST_OWN(w)];
        lanes_t before[w->size];
        rates_of_change(w, e, BEFORE, before, unused, unused + MOST_OWN(w));
        if (!put_times_of_break(w, e, before, time))
            return 0;
    }
    for (int p = 0; p < w->columns; p++) {
        double least = breaks ? time[p] : INFINITY, most = breaks ? time[p] : -INFINITY;
        for (int j = 0; j < count; j++) {
            const double own = -turning[j*w->groups + p/LANES][p%LANES]/dot[of[j]];
            least = fmin(least, own), most = fmax(most, own);
        }
        if (most - least > LETS_GO_TOGETHER*fmax(fabs(least), fabs(most)))
            return 0;
        time[p] = least;
    }
    return 1;
}

/* List those that come to rest. Returns how many, or -1 where one only just does, or where one sticks afterwards by all
 * that it takes. */
static int list_stops(const variations_t *w, const own_change_t *e, const own_rates_t *rates, int *of)
{
    int count = 0;
    for (int k = 0; k < MOST_OWN(w); k++) {
        const double held = fabs(rates->asked[AFTER][k]);
        if (own_mode(w, e->after, k) == 0 && held >= (1 - w->run->reached)*w->run->own_most[k])
            return -1;
        if (!stops(w, e, k))
            continue;
        if (fabs(rates->dot[BEFORE][k]) <= w->run->only_just*possible(w, rates, k))
            return -1;
        of[count++] = k;
    }
    return count;
}

/* Whether rates jump as bearings turn on. */
static int own_rates_jump(const variations_t *w, const own_change_t *e, const own_rates_t *rates)
{
    for (int k = 0; k < MOST_OWN(w); k++) {
        const double jump = rates->dot[RESTING][k] - rates->dot[AFTER][k];
        if (turns_on(w, e, k) && fabs(jump) > w->run->jumps*possible(w, rates, k))
            return 1;
    }
    return 0;
}

/* Pass a change of modes. Returns whether it was one of those above; else nothing has been done. */
static int pass_own_change(variations_t *w, const own_change_t *e)
{
    const int bearings = MOST_OWN(w), groups = w->groups;
    double memory[2*INSTANTS*bearings], time[w->columns];
    lanes_t rate[INSTANTS][w->size];
    own_rates_t rates;
    int of[bearings];
    for (int m = 0; m < INSTANTS; m++)
        rates.dot[m] = memory + 2*m*bearings, rates.asked[m] = rates.dot[m] + bearings;
    rates_of_change(w, e, AFTER, rate[AFTER], rates.dot[AFTER], rates.asked[AFTER]);
    rates_of_change(w, e, BEFORE, rate[BEFORE], rates.dot[BEFORE], rates.asked[BEFORE]);
    const int count = list_stops(w, e, &rates, of);
    if (count < 0)
        return 0;
    lanes_t turning[count*groups + 1], torque[count*groups + 1];
    put_turning(w, of, count, turning);
    memcpy(torque, turning, count*groups*sizeof *torque);
    int jump = some_turn_on(w, e);
    if (jump) {
        rates_of_change(w, e, RESTING, rate[RESTING], rates.dot[RESTING], rates.asked[RESTING]);
        jump = own_rates_jump(w, e, &rates);
    }
    if (jump && !put_times_of_change(w, e, of, count, turning, rates.dot[BEFORE], time))
        return 0;
    rates_of_change(w, e, BEFORE, rate[BEFORE], rates.dot[BEFORE], rates.asked[BEFORE]);
    if (count && !take_own_rests(w, of, count, torque))
        return 0;
    if (jump)
        add_jump(w, rate[RESTING], rate[AFTER], time);
    return 1;
}
#endif
