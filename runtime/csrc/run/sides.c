/* Wheels with two rows of rollers, with rollers at an angle, or on arcs of them: what carries (maxima/effects/rows.mac,
 * joints.mac, profile.mac). Rollers with even numbers stand in the outer row; of two rows n is even. */

/* The rate that a row gives. */
static double rate_by(const double *row, const double *nu)
{
    return row[0]*nu[0] + row[1]*nu[1] + row[2]*nu[2];
}

/* What carries a wheel: what does now, what is next to it at its joint, or nobody knows: the middle of the wheel. */
enum { HERE = 1, NEXT = -1, IN_MIDDLE = 0 };

/* The vehicle on what carries, and the wheels' angles there. all_turn: wheels that stand turn. */
static void put_on(const omniroll_run_t *run, const work_t *work, int what, int all_turn, lanes_t *chi)
{
    lanes_t sides[MAX_WHEELS], turns[MAX_WHEELS];
    vehicle_t *const vehicle = (vehicle_t *)&work->vehicle;     /* the phase's, in work that a call has for itself */
    for (int i = 0; i < run->wheels; i++) {
        const int outward = run->state.chi[i] < 0 ? -1 : 1;
        const int piece = what == HERE ? piece_of(run, i)
                        : what == NEXT ? next_piece(run, i, outward) : run->pieces.count/2;
        sides[i] = lanes_of(what*(run->state.contact[i]%2 ? -1 : 1));
        turns[i] = lanes_of(all_turn || !pivots(run, i));
        if (has_pieces(run))
            set_arc(vehicle, i, run->pieces.models[piece], middle_of(run, piece));
        chi[i] = lanes_of(what == HERE ? run->state.chi[i]
                        : what == NEXT ? -outward*half_of(run, i, piece) : -middle_of(run, piece));
    }
    set_rows(run->wheels, vehicle, sides, turns);
}

/* The wheels' rates for each of nu at these angles: N x 3. */
static void rows_of_rates(const omniroll_run_t *run, const work_t *work, const lanes_t *chi, double *rows)
{
    for (int first = 0; first < 3; first += LANES) {    /* each in a lane                                    */
        lanes_t nu[3] = {lanes_of(0), lanes_of(0), lanes_of(0)}, rates[MAX_WHEELS];
        for (int k = first; k < 3 && k < first + LANES; k++)
            nu[k][k - first] = 1;
        rolling_wheels(run->wheels, &work->vehicle, nu, chi, rates);
        for (int k = first; k < 3 && k < first + LANES; k++)
            for (int i = 0; i < run->wheels; i++)
                rows[3*i + k] = rates[i][k - first];
    }
}

/* From now on what the contacts' numbers say carries, and those wheels stand. */
static void carry_rows(omniroll_run_t *run, const work_t *work)
{
    lanes_t chi[MAX_WHEELS];
    put_on(run, work, HERE, 0, chi);
    rows_of_rates(run, work, chi, run->wheel_rows);
}

/* The wheels' rates as somebody knows them who knows of no rows, nor where on their rollers wheels stand. */
static void rates_in_the_middle(const omniroll_run_t *run, const work_t *work, const lanes_t *nu, lanes_t *rates)
{
    lanes_t chi[MAX_WHEELS];
    put_on(run, work, IN_MIDDLE, 1, chi);
    rolling_wheels(run->wheels, &work->vehicle, nu, chi, rates);
    put_on(run, work, HERE, 0, chi);
}

/* The rows of rates with what carries each wheel, and with what is next to it. */
static void rows_of_both(const omniroll_run_t *run, const work_t *work, double *rows_here, double *rows_next)
{
    lanes_t chi[MAX_WHEELS];
    put_on(run, work, HERE, 1, chi);
    rows_of_rates(run, work, chi, rows_here);
    put_on(run, work, NEXT, 1, chi);
    rows_of_rates(run, work, chi, rows_next);
    put_on(run, work, HERE, 0, chi);
}
