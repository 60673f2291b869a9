/* Which roller carries a wheel, and on which piece of it: an arc of its meridian (maxima/effects/profile.mac).
 *
 * The number of a contact is that of the roller; n more, that of the wheel with most rollers, where the wheel stands on its
 * joint; and 2 n more for each piece of the roller before the one that carries, in the order in which a wheel that turns forward
 * comes over them. So all of this is in the numbers that a run keeps anyway. During a call chi is counted from the middle of
 * the piece, and `joint` is half of it: at both ends something else carries, be it the next piece or the next roller. */

#define CLEAR 8                     /* roundings by which a wheel's angle is inside its piece                 */

ALWAYS_INLINE int has_pieces(const omniroll_run_t *run)
{
    return SET_HAS_ARCS && run->pieces.count > 1;
}

ALWAYS_INLINE long long roller_of(const omniroll_run_t *run, int wheel)
{
    return run->state.contact[wheel] % run->rollers_per_wheel;
}

ALWAYS_INLINE int piece_of(const omniroll_run_t *run, int wheel)
{
    return has_pieces(run) ? (int)(run->state.contact[wheel]/(2*run->rollers_per_wheel)) : 0;
}

/* Whether a wheel stands on its joint. */
ALWAYS_INLINE int pivots(const omniroll_run_t *run, int wheel)
{
    return SET_PIVOTS && run->state.contact[wheel]/run->rollers_per_wheel % 2;
}

/* The piece that is next to a wheel's on this side, be it of the next roller. */
static int next_piece(const omniroll_run_t *run, int wheel, int direction)
{
    return has_pieces(run) ? (piece_of(run, wheel) + direction + run->pieces.count) % run->pieces.count : 0;
}

static double middle_of(const omniroll_run_t *run, int piece)
{
    return has_pieces(run) ? (run->pieces.ends[2*piece] + run->pieces.ends[2*piece + 1])/2 : 0;
}

static double half_of(const omniroll_run_t *run, int wheel, int piece)
{
    return has_pieces(run) ? (run->pieces.ends[2*piece + 1] - run->pieces.ends[2*piece])/2 : run->joint[wheel];
}

/* How far from a border inside a roller an angle is that says which piece carries. */
ALWAYS_INLINE double clearance(const omniroll_run_t *run)
{
    return CLEAR*EPS*run->pieces.ends[2*run->pieces.count - 1];
}

/* A wheel's angle from the middle of its roller, and back. */
static double angle_on_roller(const omniroll_run_t *run, int wheel)
{
    if (!has_pieces(run))
        return run->state.chi[wheel];
    const int piece = piece_of(run, wheel), last = piece == run->pieces.count - 1;
    const double *const ends = run->pieces.ends + 2*piece, gap = clearance(run);
    const double angle = middle_of(run, piece) + run->state.chi[wheel];
    return fmax(fmin(angle, ends[1] - (last ? 0 : gap)), ends[0] + (piece ? gap : 0));
}

static double angle_on_piece(const omniroll_run_t *run, int wheel)
{
    const double angle = run->state.chi[wheel] - middle_of(run, piece_of(run, wheel)), half = run->joint[wheel];
    return fabs(angle) >= half - 2*clearance(run) ? copysign(half, angle) : angle;
}

/* A call begins: angles are counted from the middles of the pieces; it ends: from those of the rollers. */
static void count_from_pieces(omniroll_run_t *run)
{
    for (int i = 0; has_pieces(run) && i < run->wheels; i++) {
        run->joint[i] = half_of(run, i, piece_of(run, i));
        run->state.chi[i] = angle_on_piece(run, i);
    }
}

static void count_from_rollers(omniroll_run_t *run)
{
    for (int i = 0; has_pieces(run) && i < run->wheels; i++)
        run->state.chi[i] = angle_on_roller(run, i);
}

/* A wheel passes on, to the next piece of its roller or to the next roller. Returns whether to a roller. */
static int pass_on(omniroll_run_t *run, int wheel, int direction)
{
    const long long n = run->rollers_per_wheel, rollers = run->rollers[wheel];
    const int piece = next_piece(run, wheel, direction);
    const int leaves = !has_pieces(run) || (direction > 0 ? piece == 0 : piece == run->pieces.count - 1);
    const long long roller = (roller_of(run, wheel) - (leaves ? direction : 0) + rollers) % rollers;
    run->state.contact[wheel] = roller + 2*n*piece;
    run->joint[wheel] = half_of(run, wheel, piece);
    run->state.chi[wheel] = -direction*run->joint[wheel];
    return leaves;
}
