/* What lets go in a change of modes: a contact that has used its static friction up, a bearing that breaks away. How
 * much of what can hold it each uses, less 1, comes to zero at a time that deviates:
 *
 *     dt = -d use/use'
 *
 * Where one is at its bound only just, or several are apart beside the run, the caller decides. */

/* The forces on contacts that slip turn with their slips. */
static void turn_pushes(const variations_t *w, long long row, int model, const point_t *at, const point_t *along)
{
    const int wheels = FIXED_WHEELS(w->wheels);
    lanes_t slip[2*MAX_WHEELS], moved[2*MAX_WHEELS];
    put_pushes(w, row, model, at, along);
    slips_of(w, at, along, slip, moved);
    for (int i = 0; i < wheels && SET_TURNS; i++) {
        const lanes_t *const velocity = slip + 2*i, *const velocity_moved = moved + 2*i;
        const double squared = velocity[0][0]*velocity[0][0] + velocity[1][0]*velocity[1][0];
        const double noise = w->run->contacts.slip_rounding[row*wheels + i];
        if (!slides_in(w, row, i) || !slips_in_plane(at, i) || squared <= noise*noise)
            continue;
        const lanes_t turn = (velocity[0]*velocity_moved[1] - velocity[1]*velocity_moved[0])*(1/squared);
        for (int c = 2*i; c < 2*i + 2; c++)
            along->ground_push[c] += w->contacts.turned[c]*turn;
    }
}

/* How forces move along a column, or with time: in a row, whose rates have been computed last. */
static void move_along(const variations_t *w, long long row, int column, const lanes_t *rate)
{
    const int wheels = FIXED_WHEELS(w->wheels), model = column < 0 ? 0 : w->run->number[column];
    put_tangent(w, row, column, rate);          /* first: a point copies its heading */
    const point_t at = point_of(w, &w->vehicle[model], w->point), along = point_of(w, at.vehicle, w->along);
    lanes_t nu_dot[3], nu_dot_along[3];
    if (SET_GRIPS)
        turn_pushes(w, row, model, &at, &along);
    rates_along(wheels, &at, &along, nu_dot, nu_dot_along);
    if (SET_SERIES_ALONE)
        put_demand_on_rollers(w, at.vehicle);
}

/* List the contacts that let go, then the bearings that break away, as units: of a contact one for both components.
 * Returns how many. */
static int list_let_go(const variations_t *w, const change_t *e, int *unit)
{
    int count = 0;
    for (int i = 0; i < w->wheels; i++)
        if (sticks_in(w, e->row, i) && !sticks_in(w, e->after, i))
            unit[count++] = 2*i;
    for (int k = 0; k < BEARINGS(w); k++)
        if (turns_on(w, e, k) && !stops(w, e, k))
            unit[count++] = 2*w->wheels + k;
    return count;
}

/* How much of what it can hold each of some units uses, and how that moves along a column or with time. */
static void put_uses(const variations_t *w, const change_t *e, int column, const lanes_t *before, const int *unit,
                     int count, double *use, double *moved)
{
    const int model = column < 0 ? 0 : w->run->number[column];
    held_t held;
    put_held(w, e->before, model - 1);
    move_along(w, e->row, column, before);
    find_held(w, e, BEFORE, &w->vehicle[model], &held);
    for (int j = 0; j < count; j++) {
        const int k = unit[j] - 2*w->wheels;
        use[j] = k < 0 ? use_of_contact(w, column, &held, unit[j]/2, &moved[j])
                       : use_of_bearing(w, column, &held, k, &moved[j]);
    }
    clear_tangent(w);
}

/* Keep of a list those that have come to their bounds by themselves: the others they have set off. `rises` becomes how
 * fast. Returns how many; 0 where one only just comes there. */
static int keep_reached(const variations_t *w, const change_t *e, const lanes_t *before, int *unit, int all,
                        double *rises)
{
    const double *const elapsed = w->run->motion.elapsed;
    const double lasted = time_of_modes(w, e->before) + elapsed[e->row] - elapsed[e->before];
    double use[all + 1], moved[all + 1];
    int count = 0;
    put_uses(w, e, TIMES_ALONE, before, unit, all, use, moved);
    for (int j = 0; j < all; j++)
        if (!(use[j] - 1 < -w->run->bounds.reached))
            rises[count] = moved[j], unit[count++] = unit[j];
    for (int j = 0; j < count; j++)
        if (!(rises[j]*lasted > w->run->bounds.only_just))
            return refuse(w, LETS_GO_ONLY_JUST, 0);
    return count;
}

/* How much of what holds them these use in the columns: count x groups. */
static void put_uses_moved(const variations_t *w, const change_t *e, const lanes_t *before, const int *unit, int count,
                           lanes_t *to)
{
    double use[count], moved[count];
    for (int p = 0; p < w->columns; p++) {
        put_uses(w, e, p, before, unit, count, use, moved);
        for (int j = 0; j < count; j++)
            to[j*w->groups + p/LANES][p%LANES] = moved[j];
    }
}
