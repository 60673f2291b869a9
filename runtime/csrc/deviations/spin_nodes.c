/* Free rollers that may stick (spins.c) at the nodes of a step, once the rates of nu are known there: their axial
 * speeds, which fade where there is viscous friction, and for those who look between rows the rates of their spins. */

/* The state at a node of the step that starts in a row into w->point; `block` keeps that of all nodes of a vector. */
static void put_node(variations_t *w, long long step, long long row, int j, lanes_t *block)
{
    if (j%LANES == 0) {
        put_point(w, step, row, j/LANES);
        memcpy(block, w->point, point_size(w)*sizeof *block);
    }
    for (int k = 0; k < point_rates(w); k++)
        w->point[k] = lanes_of(block[k][j%LANES]);
}

/* What the wheels' angles and the heading deviate by at the nodes: (wheels + 1) x NODES x groups. */
static const lanes_t *carried_to_nodes(variations_t *w, double h)
{
    const int groups = w->groups, wheels = w->wheels;
    for (int i = 0; i <= wheels; i++) {
        const lanes_t *const rate = w->step.carried + (i < wheels ? i : wheels + 2)*NODES*groups;
        const lanes_t *const start = w->moved + (i < wheels ? 3 + i : 5 + wheels)*groups;
        come_to_nodes(w, h, start, rate, w->step.feedback + i*NODES*groups);  /* which is not needed any more */
    }
    return w->step.feedback;
}

/* Into w->along what deviates at a node in a vector of columns, but for the spins. */
static void put_moved_at_node(variations_t *w, int j, int g, const lanes_t *carried)
{
    const int groups = w->groups, wheels = w->wheels;
    for (int c = 0; c < first_momentum(w); c++)
        w->along[c] = w->step.core[(c*NODES + j)*groups + g];
    for (int i = 0; i <= wheels; i++)
        w->along[i < wheels ? point_chi(w) + i : point_heading(w)] = carried[(i*NODES + j)*groups + g];
    for (int u = 0; u < SET_MOVING*wheels; u++)
        w->along[point_inputs(w) + u] = given_at(w, u, j, g);
    for (int k = 0; k < FREE(w); k++)
        w->spins.bearing_along[k] = (1 - w->spins.sticks[k])*w->spins.torque_moved[k*groups + g];
}

/* How the axial acceleration of a roller deviates by its torque, and by what the torque does where numbers move. */
ALWAYS_INLINE lanes_t rate_by_torque(const variations_t *w, int k, int g)
{
    const int place = k*w->groups + g;
    const spins_t *const s = &w->spins;
    const lanes_t rate = s->response[k]*s->torque_moved[place] + s->response_moved[place]*s->bearing[k];
    return (1 - s->sticks[k])*rate;
}

/* The rates of the axial speeds' deviations at a node, but for what these do to themselves since the step's start. */
static void put_axial_rates(variations_t *w, int j, int g)
{
    const int groups = w->groups;
    const spins_t *const s = &w->spins;
    put_disks(w, &w->column[g], w->point, w->along);
    for (int k = 0; k < FREE(w); k++) {
        const int place = k*groups + g;
        const lanes_t by_spin = s->fading[k]*(s->axial_moved[place] - s->disks_moved[k]);
        const lanes_t rate = (1 - s->sticks[k])*(by_spin + s->fading_moved[place]*spin_of(w, k));
        s->axial_nodes[(k*NODES + j)*groups + g] = rate + rate_by_torque(w, k, g);
    }
}

/* What the axial speeds of a wheel's rollers, which fade alike, have changed by at the nodes, by rows, where their
 * rates but for that are units there: P = (1 - h T f)^-1 h T. */
static void put_faded(const variations_t *w, int wheel, double h, nodes_t *to)
{
    const int momentum = first_momentum(w) + 2*wheel;
    const nodes_t *const slope = &w->slopes.core[momentum*w->directions + momentum];
    nodes_t matrix[NODES];
    for (int j = 0; j < w->nodes; j++) {
        for (int b = 0; b < w->blocks; b++) {
            to[j].lanes[b] = h*w->step.once[j].lanes[b];
            matrix[j].lanes[b] = -to[j].lanes[b]*slope->lanes[b];
        }
        matrix[j].node[j] += 1;
    }
    divide_at_nodes(w, matrix, to);
}

/* The deviations of the axial speeds: at the nodes, and at the end of the step in the place of those at its start. With
 * the rates y from above they have changed by P y at the nodes. */
static void put_axial_moved(variations_t *w, long long step, long long row, double h)
{
    const int groups = w->groups, nodes = w->nodes;
    const lanes_t *const carried = carried_to_nodes(w, h);
    lanes_t block[point_size(w)];
    for (int j = 0; j < nodes; j++) {
        put_node(w, step, row, j, block);
        for (int g = 0; g < groups; g++) {
            put_moved_at_node(w, j, g, carried);
            put_axial_rates(w, j, g);
        }
    }
    nodes_t faded[NODES];
    for (int k = 0; k < FREE(w); k++) {
        lanes_t *const axial = w->spins.axial_nodes + k*NODES*groups, *const start = w->spins.axial_moved + k*groups;
        lanes_t *const changes = w->solving.memory;
        if (k%(w->rollers - 1) == 0)
            put_faded(w, k/(w->rollers - 1), h, faded);
        memset(changes, 0, nodes*groups*sizeof *changes);
        add_product_of(w, faded, 1, axial, changes);
        for (int g = 0; g < groups; g++) {
            lanes_t end = start[g];
            for (int j = 0; j < nodes; j++) {
                const lanes_t change = changes[j*groups + g];
                end += h*w->run->gauss.weights[j]*(axial[j*groups + g] + w->spins.fading[k]*change);
                axial[j*groups + g] = start[g] + change;
            }
            start[g] = end;
        }
    }
}

/* The rates of the spins' deviations at the nodes: those of the polynomials that go through what they have come to
 * there. */
static void put_rates_of_spins(variations_t *w, long long step, long long row, double h, double *rates)
{
    const int count = FREE(w), groups = w->groups, first = 3 + w->wheels + first_momentum(w);
    const lanes_t *const carried = carried_to_nodes(w, h);
    lanes_t block[point_size(w)], axial_moved[count], spins[count], *const found = w->spins.axial_nodes;
    for (int j = 0; j < w->nodes; j++) {
        put_node(w, step, row, j, block);
        for (int g = 0; g < groups; g++) {
            put_moved_at_node(w, j, g, carried);
            for (int k = 0; k < count; k++)
                axial_moved[k] = found[(k*NODES + j)*groups + g];
            put_state_of_spins(w, g, w->along, axial_moved, spins);
            for (int k = 0; k < count; k++)
                found[(k*NODES + j)*groups + g] = spins[k] - w->moved[(first + k)*groups + g];
        }
    }
    for (int k = 0; k < count; k++) {
        put_rates_of_changes(w, h, found + k*NODES*groups);
        for (int j = 0; j < w->nodes; j++)
            memcpy(rates + (j*w->size + first + k)*w->columns, found + (k*NODES + j)*groups, w->columns*sizeof *rates);
    }
}

/* The step is solved: its end for the axial speeds, and the rates of the spins (nodes x size x columns), or null. Where
 * nothing fades and nobody looks between rows only its end is needed. */
static void finish_spins(variations_t *w, long long step, long long row, double h, double *rates)
{
    for (int k = 0; k < FREE(w) && !w->spins.fades && !rates; k++)
        for (int g = 0; g < w->groups; g++)
            w->spins.axial_moved[k*w->groups + g] += h*rate_by_torque(w, k, g);
    if (!w->spins.fades && !rates)
        return;
    put_axial_moved(w, step, row, h);
    if (rates)
        put_rates_of_spins(w, step, row, h, rates);
    clear_tangent(w);
}
