/* The rates at the nodes of a step of the deviations of free rollers' spins, where these may stick (spins.c): for those who
 * look between rows. Nothing in the step needs them. */

#if SET_SPINS_STICK
/* What sticks in a row, and how that moves in a vector of columns. */
static void put_held_of_columns(const variations_t *w, long long row, int group)
{
    const double *const own = w->run->allowed + w->run->hold[row]*(12 + 9*(w->run->models - 1));
    put_held(w, row, -1);
    for (int p = group*LANES; p < w->columns && p < (group + 1)*LANES; p++)
        for (int k = 0; w->run->number[p] && k < 9; k++)
            w->held[HELD_SIZE + k][p%LANES] = own[12 + 9*(w->run->number[p] - 1) + k];
}

/* Deviations at a node of the step that starts in a row, in a vector of columns, into w->along; w->point has the state
 * there. chi_moved, heading: at the nodes. */
static void put_moved_at_node(variations_t *w, double h, int j, int g, const lanes_t *carried)
{
    const int count = FREE(w), groups = w->groups, wheels = w->wheels;
    const double elapsed = h*w->node.node[j];
    lanes_t axial[count], axial_moved[count];
    for (int c = 0; c < 3; c++)
        w->along[c] = w->core_at[(c*NODES + j)*groups + g];
    for (int i = 0; i <= wheels; i++)
        w->along[i < wheels ? point_chi(w) + i : point_heading(w)] = carried[(i*NODES + j)*groups + g];
    for (int u = 0; u < SET_MOVING*wheels; u++)
        w->along[point_inputs(w) + u] = w->given[u*groups + g] + elapsed*w->given[(w->inputs + u)*groups + g];
    put_axial(w, g, w->point, w->along, axial, axial_moved);
    for (int k = 0; k < count; k++) {
        axial_moved[k] = w->axial_moved[k*groups + g] + elapsed*w->axial_rate[k*groups + g];
        w->bearing_along[k] = (1 - w->free_sticks[k])*w->torque_moved[k*groups + g];
    }
    put_spins_along(w, &w->column[g], w->point, w->along, axial, axial_moved, w->along + POINT_CORE);
}

/* What the wheels' angles and the heading deviate by at the nodes, from w->carried_at: (wheels + 1) x NODES x groups. */
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

/* The rates of the spins' deviations at the nodes, as the rates of everything there ask for: for those who look between
 * rows. */
static void put_rates_of_spins(variations_t *w, long long step, long long row, double h, double *rates)
{
    const lanes_t *const carried = carried_to_nodes(w, h);
    lanes_t block[point_size(w)], nu_dot[3], nu_dot_along[3];
    for (int j = 0; j < w->nodes; j++) {
        if (j%LANES == 0) {
            put_point(w, step, row, j/LANES);
            memcpy(block, w->point, sizeof block);
        }
        for (int k = 0; k < point_rates(w); k++)
            w->point[k] = lanes_of(block[k][j%LANES]);
        for (int g = 0; g < w->groups; g++) {
            put_held_of_columns(w, row, g);
            put_moved_at_node(w, h, j, g, carried);
            const point_t at = point_of(w, &w->column[g], w->point), along = point_of(w, at.vehicle, w->along);
            rates_at(w, &at, &along, nu_dot, nu_dot_along);
            const int last = w->columns - g*LANES, width = last < LANES ? last : LANES;
            for (int k = 0; k < FREE(w); k++)
                memcpy(rates + (j*w->size + 6 + w->wheels + k)*w->columns + g*LANES, &along.core_dot[k],
                       width*sizeof *rates);
        }
    }
    memset(w->along, 0, point_size(w)*sizeof *w->along);
    memset(w->bearing_along, 0, FREE(w)*sizeof *w->bearing_along);
    memset(w->held, 0, 2*HELD_SIZE*sizeof *w->held);
}
#endif
