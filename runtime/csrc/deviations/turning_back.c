/* How deviations pass where contacts that slip along their rolling direction alone turn back at once. Their slips go
 * through zero, and so do those beside the run, a little earlier or later. There the rates jump:
 *
 *     d+ = d- + (f- - f+) dt,   dt = -ds/s'
 *
 * What lets go with them does so since they turn back, and at their time.
 * (runtime/omniroll/engine/contact_deviations.py, where the contact rests in between, with the rates f*: of one slip
 * d* + f* dt = d- + f- dt.) */

#if SET_GRIPS
/* List the components of such slips behind a row. Returns how many. */
static int list_turns_back(const variations_t *w, long long row, int *component)
{
    int count = 0;
    for (int i = 0; i < w->wheels; i++)
        if (turns_back(w, row, i))
            component[count++] = 2*i + 1;
    return count;
}

/* Pass that in a row, whose rates `before` have been computed last. Returns whether it happens together beside the run
 * as well, and no slip only just comes to zero; else nothing has been done. */
static int pass_turns_back(variations_t *w, const int *component, int count, const lanes_t *before,
                           const lanes_t *after)
{
    const lanes_t *const slip_dot = point_of(w, w->vehicle, w->point).slip_dot;
    lanes_t moved[count*w->groups];
    double rate[count], time[w->columns];
    if (grazes_rest(w, component, count))
        return 0;
    for (int k = 0; k < count; k++)
        rate[k] = slip_dot[component[k]][0];
    put_slips_moved(w, component, count, moved);
    if (!put_times_of_zeros(w, moved, rate, count, time))
        return 0;
    add_jump(w, before, after, time);
    return 1;
}
#endif
