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
 * Where a contact sticks its slip stays zero. So the speeds of its wheel and its roller follow from nu and from what is
 * felt: they move with these in every direction (slipping.c), and their own rates are known when all others are.
 *
 * The rest of the core of a wheel acts upon itself and nu, so that it is eliminated wheel by wheel (blockwise.c). */

/* How a wheel's angle goes with the core: by its own rate, or where this follows from nu, by nu. */
static void put_carries(variations_t *w, long long row, int i)
{
    const int felt = w->core + w->felt, numbers = w->run->models - 1;
    memset(w->carries[i], 0, sizeof w->carries[i]);
    for (int number = 0; number < numbers; number++)
        w->chi_by[number*w->wheels + i] = (nodes_t){{{0}}};
    if (!sticks_in(w, row, i)) {
        w->carries[i][contact_speed(w, i, 0)] = 1;
        return;
    }
    for (int c = 0; c < 3; c++)
        w->carries[i][c] = slope_of_speed(w, i, 0, c, 0)[0];
    for (int number = 0; number < numbers; number++)
        for (int b = 0; b < w->blocks; b++)
            w->chi_by[number*w->wheels + i].lanes[b] = slope_of_speed(w, i, 0, felt + number, b);
}

/* The row of the direction of a contact that slips. */
static void put_row_of_turn(variations_t *w, int i)
{
    const int a = w->core + i, felt = w->core + w->felt;
    const nodes_t *const towards = w->contacts.towards_at + 2*i;
    const nodes_t *const x = slope_of_slip(w, i, 0), *const y = slope_of_slip(w, i, 1);
    nodes_t *const slope = w->slope + a*w->directions;
    memset(slope, 0, w->directions*sizeof *slope);
    for (int place = 0; place < slip_directions(w); place++) {
        nodes_t *const to = place < felt ? slope + place : w->core_by + (place - felt)*w->equations + a;
        for (int b = 0; b < w->blocks; b++)
            to->lanes[b] = x[place].lanes[b]*towards[1].lanes[b] - y[place].lanes[b]*towards[0].lanes[b];
    }
    slope[first_turn(w) + i] = w->contacts.slipping_at[i];
}

/* What contacts add to the slopes in a step, when those of the core and of the slips are known. */
static void put_contacts(variations_t *w, long long row)
{
    const int wheels = OWN_WHEELS(w->wheels);
    for (int i = 0; i < wheels; i++) {
        put_carries(w, row, i);
        if (turns_in(w, row, i))
            put_row_of_turn(w, i);
    }
}

/* List what a step is solved for, nu last: further numbers of the core, then those of each contact that slips and the
 * turns of its direction. Returns how many, without those whose rates follow: these stand behind. */
static int list_unknowns(const variations_t *w, long long row, int *unknown)
{
    const int wheels = OWN_WHEELS(w->wheels);
    int count = 0;
    for (int a = 3 + CONTACT_SPEEDS*wheels; a < w->core; a++)
        unknown[count++] = a;
    for (int i = 0; i < wheels; i++) {
        for (int k = 0; k < CONTACT_SPEEDS && !sticks_in(w, row, i); k++)
            unknown[count++] = contact_speed(w, i, k);
        if (turns_in(w, row, i))
            unknown[count++] = w->core + i;
    }
    for (int a = 0; a < 3; a++)
        unknown[count++] = a;
    int all = count;
    for (int i = 0; i < wheels; i++)
        for (int k = 0; k < CONTACT_SPEEDS && sticks_in(w, row, i); k++)
            unknown[all++] = contact_speed(w, i, k);
    return count;
}

/* The rates that follow, when the others and the turns are known. */
static void put_rates_that_follow(variations_t *w, double h, const int *unknown, int count)
{
    const int groups = w->groups, nodes = w->nodes, all = NODES*groups;
    lanes_t *const rate = w->carried_at;
    if (unknown[count] < 0)
        return;
    memset(w->core_at, 0, w->core*all*sizeof *rate);
    memset(w->felt_at, 0, w->felt*all*sizeof *rate);
    for (int p = 0; p < count; p++)
        if (unknown[p] < w->core)
            integrate(w, h, w->solving.row[unknown[p]*nodes], w->core_at + unknown[p]*all);
    for (int f = 0; f < w->felt; f++) {
        for (int k = 0; k < nodes*groups; k++)
            rate[k] = carried_by(w, carries_felt(w, f), w->core_at + k, w->core_at + 3*all + k, all);
        integrate(w, h, rate, w->felt_at + f*all);
    }
    for (int p = count; unknown[p] >= 0; p++) {
        const int a = unknown[p];
        for (int d = 0; d < w->directions; d++) {
            const int turns = d - first_turn(w);
            if (w->is_still[a*w->directions + d] || (d >= w->core + w->felt && turns < 0))
                continue;
            const lanes_t *const by = d < w->core ? w->core_at + d*all : turns < 0 ? w->felt_at + (d - w->core)*all
                                                                       : w->solving.row[(w->core + turns)*nodes];
            const nodes_t *const slope = &w->slope[a*w->directions + d];
            for (int j = 0; j < nodes; j++)
                for (int g = 0; g < groups; g++)
                    w->solving.row[a*nodes + j][g] += slope->node[j]*by[j*groups + g];
        }
    }
}

/* The rates of the core at the nodes, by rows of right sides. */
static void put_rates_on_ground(variations_t *w, long long row, double h)
{
    int unknown[w->equations + 1];
    memset(unknown, -1, sizeof unknown);
    const int count = list_unknowns(w, row, unknown);
#if SET_GATHERS
    put_answers_of_momenta(w, h);
#endif
    const solving_t *const own = &w->solving;
    const blockwise_t e = {count, 3, w->nodes, w->blocks, w->groups,
                           own->kind, own->block, own->right, own->system, own->pivot_row};
    for (int p = 0; unknown[p] >= 0; p++) {
        for (int j = 0; j < w->nodes; j++)
            w->solving.row[unknown[p]*w->nodes + j] = right_of(&e, p) + j*w->groups;
        put_right(w, unknown[p], 0);
        for (int q = 0; q < count && p < count; q++)
            put_block(w, h, &e, unknown, p, q);
    }
    solve_blockwise(&e);
    put_rates_that_follow(w, h, unknown, count);
}
