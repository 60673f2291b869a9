/* Directions of slips that are found together: of contacts whose rollers stick. What forces do to their slips along the
 * axle, and where the axle sticks, too, to the whole slip, they do through the vehicle alone, which all of them share.
 * Where each turned until its own slip followed, the first would turn for all others. */
#if SET_STANDS_BOTH_WAYS
/* Which contacts these are, and how many; none where forces turn no slip of theirs much. */
static int sharing_contacts(const step_t *s, const int wheels, int *contact)
{
    int count = 0, is_near = 0;
    for (int i = 0; i < wheels; i++) {
        nodes_t along, across, response[2];
        if (!s->slides[i] || s->keeps[i] || !(s->own->sticks[s->own->rollers_at + i][0] > 0.5))
            continue;
        along_and_across(s, i, &along, &across);
        response_to_turn(s, i, i, response);
        is_near |= is_near_rest(s, response, &along);
        contact[count++] = i;
    }
    return count > 1 && is_near ? count : 0;
}

/* What turns of contact j do to the rates of contact i's slip, per turn at the nodes. */
static void response_to_other(step_t *s, const int wheels, int i, int j, nodes_t *rate)
{
    response_to_turn(s, i, j, rate);
    if (i == j && !(SET_LOADS && SET_AXLES_STICK && s->own->sticks[i][0] > 0.5)) {
        response_near_rest(s, wheels, i, rate);
        return;
    }
#if SET_APPROACHES
    for (int k = 0; k < 2 && s->stretched; k++)
        stretch_nodes(s, rate + k);
#endif
}

/* The rows of contact i's slip across its directions, and the columns of turns of contact j. */
static void put_shared_block(const step_t *s, double *system, int size, int row, int column, int i,
                             const nodes_t *response)
{
    for (int l = 0; l < NODES; l++) {
        const double x = -s->h*response[1].node[l], y = s->h*response[0].node[l];
        for (int m = 0; m < NODES; m++)
            system[(row + m)*size + column + l] = gauss_integral[l].node[m]
                *(x*s->toward[2*i].node[m] + y*s->toward[2*i + 1].node[m]);
    }
}

/* The turns of their directions at the nodes that take away what is across all of them, into `turn`; none where that is
 * rounding. A slip that has not begun says nothing about the direction of a contact that all others keep from going
 * across: it counts as its rounding. */
static void turns_together(step_t *s, const int wheels, const int *contact, int count, double *system, double *turn)
{
    const int size = count*NODES;
    const double rounding = ROUNDED_SLIP*EPS*s->h*s->friction_makes;
    int turns = 0;
    for (int p = 0; p < count; p++) {
        const int i = contact[p], row = p*NODES;
        nodes_t along, across, response[2];
        along_and_across(s, i, &along, &across);
        for (int q = 0; q < count; q++) {
            response_to_other(s, wheels, i, contact[q], response);
            put_shared_block(s, system, size, row, q*NODES, i, response);
        }
        const double least = fmax(s->slip_noise[i], rounding);
        turns |= !(largest_of(&across) <= rounding);
        for (int m = 0; m < NODES; m++) {
            system[(row + m)*size + row + m] += fabs(along.node[m]) < least ? least : along.node[m];
            turn[row + m] = across.node[m];
        }
    }
    if (turns)
        solve_rows(system, size, turn);
    else
        memset(turn, 0, sizeof *turn*(size_t)size);
}

/* New directions of these contacts, and their forces. */
static void find_shared_directions(step_t *s, const int wheels)
{
    int contact[MOST_WHEELS];
    const int count = sharing_contacts(s, wheels, contact), size = count*NODES;
    double *const turns = s->shared_system + (long long)size*size;
    memset(s->turned_together, 0, sizeof s->turned_together);
    if (count)
        turns_together(s, wheels, contact, count, s->shared_system, turns);
    for (int p = 0; p < count; p++) {
        const int i = contact[p];
        const nodes_t before[2] = {s->push[2*i], s->push[2*i + 1]};
        nodes_t turn;
        memcpy(turn.node, turns + p*NODES, sizeof turn.node);
        s->turned_together[i] = 1;
        turn_directions(s, i, &turn);
        force_in_direction(s, i);
        move_others(s, wheels, i, before);
    }
}
#endif
