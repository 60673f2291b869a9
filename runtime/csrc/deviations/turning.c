/* Contacts that slip and stick under Coulomb's friction, in the equations of a step.
 *
 * The direction of a slip turns the faster the slower it is. So the turn of each direction at the nodes is an unknown
 * beside the rates,
 *
 *     slip across the direction = turn times the slip along it,
 *
 * which is as regular where a slip comes to rest as elsewhere. These are rows behind those of the core: their slopes
 * are those of the slip across, with the opposite sign, and of a turn by itself the slip along.
 *
 * Where a contact sticks its slip stays zero. So the speeds of its wheel and its roller follow from nu and from what
 * feeds back: they move with these in every direction (slipping.c), and their own rates are known when all others are.
 *
 * The rest of the core of a wheel acts upon itself and nu, so that it is eliminated wheel by wheel (blockwise.c). */

/* How a wheel's angle goes with the core: by its own rate, or where this follows from nu, by nu. */
static void put_carries(variations_t *w, long long row, int i)
{
    const int states = w->core + w->feedback, numbers = w->run->models - 1;
    memset(w->slopes.carries[i], 0, sizeof w->slopes.carries[i]);
    for (int number = 0; number < numbers; number++)
        w->slopes.chi_by[number*w->wheels + i] = (nodes_t){{{0}}};
    if (!sticks_in(w, row, i)) {
        w->slopes.carries[i][contact_speed(w, i, 0)] = 1;
        return;
    }
    for (int c = 0; c < 3; c++)
        w->slopes.carries[i][c] = slope_of_speed(w, i, 0, c, 0)[0];
    for (int number = 0; number < numbers; number++)
        for (int b = 0; b < w->blocks; b++)
            w->slopes.chi_by[number*w->wheels + i].lanes[b] = slope_of_speed(w, i, 0, states + number, b);
}

/* The row of the direction of a contact that slips. */
static void put_row_of_turn(variations_t *w, int i)
{
    const int a = w->core + i, states = w->core + w->feedback;
    const nodes_t *const towards = w->contacts.towards_at + 2*i;
    const nodes_t *const x = slope_of_slip(w, i, 0), *const y = slope_of_slip(w, i, 1);
    nodes_t *const slope = w->slopes.core + a*w->directions;
    memset(slope, 0, w->directions*sizeof *slope);
    for (int place = 0; place < slip_directions(w); place++) {
        nodes_t *const to = place < states ? slope + place : w->slopes.core_by + (place - states)*w->equations + a;
        for (int b = 0; b < w->blocks; b++)
            to->lanes[b] = x[place].lanes[b]*towards[1].lanes[b] - y[place].lanes[b]*towards[0].lanes[b];
    }
    slope[first_turn(w) + i] = w->contacts.slipping_at[i];
}
