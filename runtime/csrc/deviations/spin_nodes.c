/* Free rollers that may stick (spins.c) at the nodes of a step, once the rates of nu are known there: their axial
 * speeds, which fade where there is viscous friction, and for those who look between rows the rates of their spins. */

/* What the axial speeds of the disks deviate by at the nodes: they go with nu, the angle of their wheel and numbers. */
static void put_disks_at_nodes(variations_t *w, double h)
{
    const int groups = w->groups, count = FREE(w), all = NODES*groups;
    lanes_t *const angle = w->step.known;       /* not needed any more */
    for (int k = 0; k < count; k++) {
        const int wheel = k/(w->rollers - 1);
        const nodes_t *const by = w->spins.disks_by + k;
        lanes_t *const to = w->spins.disks_nodes + k*all;
        if (k%(w->rollers - 1) == 0)
            come_to_nodes(w, h, w->moved + (3 + wheel)*groups, w->step.carried + wheel*all, angle);
        for (int j = 0; j < w->nodes; j++) {
            for (int p = j*groups, g = 0; g < groups; g++, p++) {
                to[p] = by[(w->core + wheel)*count].node[j]*angle[p];
                for (int c = 0; c < 3; c++)
                    to[p] += by[c*count].node[j]*w->step.core[c*all + p];
            }
            add_numbers(w, w->spins.disks_by + w->directions*count, count, k, j, to + j*groups);
        }
    }
}

/* The rates of the deviations of a roller's axial speed at a node, while its disk does not deviate: but for what they
 * do to themselves since the step's start. */
static void put_axial_rates(const variations_t *w, int k, int j, lanes_t *to)
{
    const spins_t *const s = &w->spins;
    for (int p = k*w->groups, g = 0; g < w->groups; g++, p++)
        to[g] = (1 - s->sticks[k])*(s->fading[k]*s->axial_moved[p] + s->response[k]*s->torque_moved[p]);
    add_numbers(w, s->axial_by, FREE(w), k, j, to);
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
static void put_axial_moved(variations_t *w, double h)
{
    const int groups = w->groups, nodes = w->nodes;
    nodes_t faded[NODES];
    for (int k = 0; k < FREE(w); k++) {
        lanes_t *const axial = w->spins.axial_nodes + k*NODES*groups, *const start = w->spins.axial_moved + k*groups;
        const lanes_t *const disk = w->spins.disks_nodes + k*NODES*groups;
        lanes_t *const changes = w->solving.memory;
        if (k%(w->rollers - 1) == 0)
            put_faded(w, k/(w->rollers - 1), h, faded);
        for (int j = 0; j < nodes; j++) {
            put_axial_rates(w, k, j, axial + j*groups);
            for (int g = j*groups; g < (j + 1)*groups; g++)
                axial[g] -= (1 - w->spins.sticks[k])*w->spins.fading[k]*disk[g];
        }
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
static void put_rates_of_spins(variations_t *w, double h, double *rates)
{
    const int groups = w->groups, first = 3 + w->wheels + first_momentum(w);
    for (int k = 0; k < FREE(w); k++) {
        lanes_t *const found = w->spins.axial_nodes + k*NODES*groups;
        const lanes_t *const disk = w->spins.disks_nodes + k*NODES*groups;
        for (int p = 0; p < w->nodes*groups; p++)
            found[p] = state_of_spin(w, k, found[p], disk[p]) - w->moved[(first + k)*groups + p%groups];
        put_rates_of_changes(w, h, found);
        for (int j = 0; j < w->nodes; j++)
            memcpy(rates + (j*w->size + first + k)*w->columns, found + j*groups, w->columns*sizeof *rates);
    }
}

/* The step is solved: its end for the axial speeds, and the rates of the spins (nodes x size x columns), or null. Where
 * nothing fades and nobody looks between rows only its end is needed, and rates are constant. */
static void finish_spins(variations_t *w, double h, double *rates)
{
    for (int k = 0; k < FREE(w) && !w->spins.fades && !rates; k++) {
        lanes_t rate[w->groups];
        put_axial_rates(w, k, 0, rate);
        for (int g = 0; g < w->groups; g++)
            w->spins.axial_moved[k*w->groups + g] += h*rate[g];
    }
    if (!w->spins.fades && !rates)
        return;
    put_disks_at_nodes(w, h);
    put_axial_moved(w, h);
    if (rates)
        put_rates_of_spins(w, h, rates);
}
