/* Free rollers that may stick (spins.c) at the nodes of a step, once the rates of nu are known there: their axial
 * speeds, which fade where there is viscous friction, and for those who look between rows the rates of their spins. */

#if SET_GATHERS
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
        lanes_t *const to = w->felt_at + i*NODES*groups;        /* not needed any more */
        for (int j = 0; j < w->nodes; j++)
            for (int g = 0; g < groups; g++)
                to[j*groups + g] = w->moved[(i < wheels ? 3 + i : 5 + wheels)*groups + g];
        integrate(w, h, w->carried_at + (i < wheels ? i : wheels + 2)*NODES*groups, to);
    }
    return w->felt_at;
}

/* Into w->along what deviates at a node in a vector of columns, but for the spins. */
static void put_moved_at_node(variations_t *w, int j, int g, const lanes_t *carried)
{
    const int groups = w->groups, wheels = w->wheels;
    for (int c = 0; c < first_momentum(w); c++)
        w->along[c] = w->core_at[(c*NODES + j)*groups + g];
    for (int i = 0; i <= wheels; i++)
        w->along[i < wheels ? point_chi(w) + i : point_heading(w)] = carried[(i*NODES + j)*groups + g];
    for (int u = 0; u < SET_MOVING*wheels; u++)
        w->along[point_inputs(w) + u] = w->given[u*groups + g]
            + w->length*w->node.node[j]*w->given[(w->inputs + u)*groups + g];
    for (int k = 0; k < FREE(w); k++)
        w->spins.bearing_along[k] = (1 - w->spins.sticks[k])*w->spins.torque_moved[k*groups + g];
}

/* How the axial acceleration of a roller deviates by its torque, and by what the torque does where numbers move. */
ALWAYS_INLINE lanes_t rate_by_torque(const variations_t *w, int k, int g)
{
    const int own = k*w->groups + g;
    const spins_t *const s = &w->spins;
    const lanes_t rate = s->response[k]*s->torque_moved[own] + s->response_moved[own]*s->bearing[k];
    return (1 - s->sticks[k])*rate;
}

/* The rates of the axial speeds' deviations at a node, but for what these do to themselves since the step's start. */
static void put_axial_rates(variations_t *w, int j, int g)
{
    const int count = FREE(w), groups = w->groups;
    lanes_t axial[count], unused[count], still[count], spins[count], own[count];
    memset(still, 0, sizeof still);
    put_axial(w, g, w->point, w->along, axial, unused);
    put_spins(w, &w->column[g], own, unused);
    put_spins_along(w, &w->column[g], w->point, w->along, axial, still, spins);
    for (int k = 0; k < count; k++) {
        const lanes_t by_spin = w->spins.fading[k]*(w->spins.axial_moved[k*groups + g] + spins[k]);
        const lanes_t fading = (1 - w->spins.sticks[k])*w->spins.fading_moved[k*groups + g]*own[k];
        w->spins.axial_nodes[(k*NODES + j)*groups + g] = by_spin + fading + rate_by_torque(w, k, g);
    }
}

/* What the axial speeds of a wheel's rollers, which fade alike, have changed by at the nodes, by rows, where their rates
 * but for that are units there: P = (1 - h T f)^-1 h T. */
static void put_faded(const variations_t *w, int wheel, double h, nodes_t *to)
{
    const int momentum = first_momentum(w) + 2*wheel, blocks = w->blocks;
    const nodes_t *const own = &w->slope[momentum*w->directions + momentum];
    for (int j = 0; j < w->nodes; j++) {
        lanes_t *const row = w->solving.pivot_row[j] = w->solving.memory + j*2*blocks;
        for (int b = 0; b < blocks; b++) {
            row[blocks + b] = h*w->once[j].lanes[b];
            row[b] = -row[blocks + b]*own->lanes[b];
        }
        row[j/LANES][j%LANES] += 1;
    }
    solve(&(equations_t){w->solving.pivot_row, w->nodes, blocks, blocks});
    for (int j = 0; j < w->nodes; j++)
        memcpy(to[j].lanes, w->solving.pivot_row[j] + blocks, blocks*sizeof(lanes_t));
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
        lanes_t *const own = w->spins.axial_nodes + k*NODES*groups, *const start = w->spins.axial_moved + k*groups;
        lanes_t *const changes = w->solving.memory + 2*NODES*w->blocks;      /* behind what P was made in */
        if (k%(w->rollers - 1) == 0)
            put_faded(w, k/(w->rollers - 1), h, faded);
        memset(changes, 0, nodes*groups*sizeof *changes);
        add_product_of(w, faded, 1, own, changes);
        for (int g = 0; g < groups; g++) {
            lanes_t end = start[g];
            for (int j = 0; j < nodes; j++) {
                const lanes_t change = changes[j*groups + g];
                end += h*w->run->gauss_weight[j]*(own[j*groups + g] + w->spins.fading[k]*change);
                own[j*groups + g] = start[g] + change;
            }
            start[g] = end;
        }
    }
}

/* The same where nothing fades and nobody looks between rows: at the end alone. */
static void end_axial_moved(variations_t *w, double h)
{
    for (int k = 0; k < FREE(w); k++)
        for (int g = 0; g < w->groups; g++)
            w->spins.axial_moved[k*w->groups + g] += h*rate_by_torque(w, k, g);
}

#if SET_DIRECTIONS
/* What sticks in a row, and how that moves in a vector of columns. */
static void put_held_of_columns(const variations_t *w, long long row, int group)
{
    const double *const own = w->run->allowed + w->run->hold[row]*(12 + 9*(w->run->models - 1));
    put_held(w, row, -1);
    for (int p = group*LANES; p < w->columns && p < (group + 1)*LANES; p++)
        for (int k = 0; w->run->number[p] && k < 9; k++)
            w->held[HELD_SIZE + k][p%LANES] = own[12 + 9*(w->run->number[p] - 1) + k];
}
#endif

/* The rates of the spins' deviations at the nodes, as the rates of everything there ask for. */
static void put_rates_of_spins(variations_t *w, long long step, long long row, double h, double *rates)
{
    const int count = FREE(w), first = first_momentum(w);
    const lanes_t *const carried = carried_to_nodes(w, h);
    lanes_t block[point_size(w)], nu_dot[3], nu_dot_along[3], axial[count], axial_moved[count];
    for (int j = 0; j < w->nodes; j++) {
        put_node(w, step, row, j, block);
#if SET_GRIPS
        memset(w->along, 0, point_size(w)*sizeof *w->along);
        memset(w->spins.bearing_along, 0, FREE(w)*sizeof *w->spins.bearing_along);
        put_held(w, row, -1);
        put_forces_on_contacts(w, row);
#endif
        for (int g = 0; g < w->groups; g++) {
#if SET_DIRECTIONS
            put_held_of_columns(w, row, g);
#endif
            put_moved_at_node(w, j, g, carried);
            put_axial(w, g, w->point, w->along, axial, axial_moved);
            for (int k = 0; k < count; k++)
                axial_moved[k] = w->spins.axial_nodes[(k*NODES + j)*w->groups + g];
#if SET_DISKS_STICK
            put_stuck_axial(w, &w->column[g], w->point, w->along, axial_moved);
            memcpy(w->along + first_momentum(w), axial_moved, sizeof axial_moved);
#else
            put_spins_along(w, &w->column[g], w->point, w->along, axial, axial_moved, w->along + POINT_CORE);
#endif
            const point_t at = point_of(w, &w->column[g], w->point), along = point_of(w, at.vehicle, w->along);
#if SET_GRIPS
            put_pushes_of_columns(w, row, j, g);
#endif
            rates_at(w, &at, &along, nu_dot, nu_dot_along);
            const int last = w->columns - g*LANES, width = last < LANES ? last : LANES;
            for (int k = 0; k < count; k++)
                memcpy(rates + (j*w->size + 3 + w->wheels + first + k)*w->columns + g*LANES,
                       &along.core_dot[first - 3 + k], width*sizeof *rates);
        }
    }
}

/* The step is solved: its end for the axial speeds, and the rates of the spins (nodes x size x columns), or null. */
static void finish_spins(variations_t *w, long long step, long long row, double h, double *rates)
{
    if (!w->spins.fades && !rates) {
        end_axial_moved(w, h);
        return;
    }
    put_axial_moved(w, step, row, h);
    if (rates)
        put_rates_of_spins(w, step, row, h, rates);
    memset(w->along, 0, point_size(w)*sizeof *w->along);
    memset(w->spins.bearing_along, 0, FREE(w)*sizeof *w->spins.bearing_along);
    memset(w->held, 0, 2*HELD_SIZE*sizeof *w->held);
#if SET_GRIPS
    memset(w->contacts.pushed + 6*w->wheels, 0, 2*w->wheels*sizeof *w->contacts.pushed);
#endif
}
#endif
