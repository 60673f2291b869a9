/* How deviations pass where contacts change their modes: they come to rest (rests.c), turn back (turning_back.c), or
 * let go. Where the rates do not jump then no deviation does (letting_go.c: where they
 * do). Where anything else happens, or a contact is near its bounds, the caller decides. */

#if SET_GRIPS
/* Whether a contact changes its mode, or the way that it slips, between a row and the next. */
static int changes_mode(const variations_t *w, long long row, int i)
{
    return sticks_in(w, row, i) != sticks_in(w, row + 1, i) || turns_back(w, row, i);
}

/* Whether any does. */
static int changes_modes(const variations_t *w, long long row)
{
    for (int i = 0; i < w->wheels; i++)
        if (changes_mode(w, row, i))
            return 1;
    return 0;
}

static int inputs_jump(const variations_t *w, long long row)
{
    const double *const before = w->run->drive + row*SET_INPUTS*w->wheels, *const after = before + SET_INPUTS*w->wheels;
    for (int k = 0; k < SET_MOVING*w->wheels; k++)
        if (fabs(after[k] - before[k]) > w->run->jumps*fmax(fabs(after[k]), fabs(before[k])))
            return 1;
    return 0;
}

/* Whether the rates of all that is solved for are the same but for roundings. */
static int are_same(const variations_t *w, const lanes_t *one, const lanes_t *other)
{
    double apart = 0, largest = 0;
    for (int a = 0; a < w->known; a++) {
        const double x = one[place_of_core(w, a)][0], y = other[place_of_core(w, a)][0];
        apart = fmax(apart, fabs(x - y)), largest = fmax(largest, fmax(fabs(x), fabs(y)));
    }
    return apart <= w->run->jumps*largest;
}

/* Whether contacts change behind a row that do not come to rest. */
static int others_change(const variations_t *w, long long row)
{
    for (int i = 0; i < w->wheels; i++)
        if (!rests_behind(w, row, i) && changes_mode(w, row, i))
            return 1;
    return 0;
}

/* Whether a contact that sticks needs all its friction in a row, whose rates have been computed last. */
static int is_at_its_bound(const variations_t *w, long long row)
{
    const point_t at = point_of(w, w->vehicle, w->point);
    for (int i = 0; i < w->wheels; i++)
        if (sticks_in(w, row, i) && fabs(taken_at(w, &at, i) - 1) <= w->run->reached)
            return 1;
    return 0;
}

/* Pass a change of modes between a row and the next. Returns whether it was one of those above; else nothing has been
 * done. */
static int pass_modes(variations_t *w, long long row)
{
    lanes_t before[w->size], after[w->size];
    if (inputs_jump(w, row))
        return 0;
    int component[MOST_COMPONENTS], turned[MOST_WHEELS];
    const int count = list_rests(w, row, component), back = list_turns_back(w, row, turned);
    if (count && others_change(w, row))
        return 0;
    aim_rests(w, row);
    rates_in_row(w, row + 1, after);
    if (is_at_its_bound(w, row + 1))
        return 0;
    rates_in_row(w, row, before);
    if (back)
        return pass_turns_back(w, turned, back, before, after);
    if (count == 0)
        return are_same(w, before, after) || pass_jump(w, row, before, after);
    return !grazes_rest(w, component, count) && take_rests(w, row, component, count);
}
#endif
