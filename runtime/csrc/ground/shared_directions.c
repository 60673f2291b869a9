/* Directions of slips that are found together: of contacts whose rollers stick. What forces do to their slips along the
 * axle, and where the axle sticks, too, to the whole slip, they do through the vehicle alone, which all of them share.
 * Where each turned until its own slip followed, the first would turn for all others. */
/* Which contacts these are, and how many; none where forces turn no slip of theirs much. */
static int sharing_contacts(const step_t *s, const int wheels, int *contact)
{
    int count = 0, is_near = 0;
    for (int i = 0; i < wheels; i++) {
        nodes_t along, across, response[2];
        if (!s->contact.slides[i] || s->contact.keeps[i] || !may_share(s, i))
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
    if (i == j) {
        response_near_rest(s, wheels, i, rate);
        return;
    }
    if (SET_APPROACHES)
        for (int k = 0; k < 2 && s->approach.stretched; k++)
            stretch_nodes(s, rate + k);
}

/* The rows of contact i's slip across its directions: what turns of all these contacts take away. */
static void put_shared_rows(step_t *s, const int wheels, int i, const int *contact, int count, nodes_t **row)
{
    nodes_t response[2*MAX_WHEELS];
    for (int q = 0; q < count; q++)
        response_to_other(s, wheels, i, contact[q], response + 2*q);
    for (int m = 0; m < NODES; m++) {
        const double x = s->h*s->slip.toward[2*i].node[m], y = s->h*s->slip.toward[2*i + 1].node[m];
        nodes_t integral;                           /* to node m, from the values at the nodes               */
        for (int l = 0; l < NODES; l++)
            integral.node[l] = gauss_integral[l].node[m];
        for (int q = 0; q < count; q++)
            for (int b = 0; b < BLOCKS; b++)
                row[m][q].lanes[b] = integral.lanes[b]
                    *(y*response[2*q].lanes[b] - x*response[2*q + 1].lanes[b]);
    }
}

/* The turns of their directions at the nodes that take away what is across all of them, into `turn`; none where that is
 * rounding. A slip that has not begun says nothing about the direction of a contact that all others keep from going
 * across: it counts as its rounding. */
static void turns_together(step_t *s, const int wheels, const int *contact, int count, nodes_t *turn)
{
    const double rounding = ROUNDED_SLIP*EPS*s->h*s->contact.friction_makes;
    nodes_t **const row = s->slip.shared_row;
    int turns = 0;
    for (int p = 0; p < count; p++) {
        const int i = contact[p], first = p*NODES;
        nodes_t along;
        along_and_across(s, i, &along, turn + p);
        for (int m = 0; m < NODES; m++)
            row[first + m] = s->slip.shared_rows + (first + m)*count;
        put_shared_rows(s, wheels, i, contact, count, row + first);
        const double least = fmax(s->slip.noise[i], rounding);
        turns |= !(largest_of(turn + p) <= rounding);
        for (int m = 0; m < NODES; m++)
            row[first + m][p].node[m] += fabs(along.node[m]) < least ? least : along.node[m];
    }
    if (turns) {
        eliminate(row, count);
        solve_eliminated(row, s->slip.shared_rows, count, turn);
    } else
        memset(turn, 0, sizeof *turn*(size_t)count);
}

/* New directions of these contacts, and their forces. */
static void find_shared_directions(step_t *s, const int wheels)
{
    int contact[MAX_WHEELS];
    const int count = sharing_contacts(s, wheels, contact);
    memset(s->slip.turned_together, 0, sizeof s->slip.turned_together);
    if (count)
        turns_together(s, wheels, contact, count, s->slip.shared_turn);
    for (int p = 0; p < count; p++) {
        const int i = contact[p];
        const nodes_t before[2] = {s->slip.push[2*i], s->slip.push[2*i + 1]};
        s->slip.turned_together[i] = 1;
        turn_directions(s, i, s->slip.shared_turn + p);
        force_in_direction(s, i);
        move_others(s, wheels, i, before);
    }
}
