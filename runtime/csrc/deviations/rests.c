/* How deviations pass where slips come to rest, and where contacts let go whose rates do not jump there.
 *
 * The motions beside the run come to rest a little earlier or later, by forces of the contacts that do. With what these
 * forces do to the rates, R, and to the slips, W, all that is left of a deviation is
 *
 *     d* = d- - R W^-1 ds                              (ds: of the slips that have come to rest)
 *
 * (runtime/omniroll/engine/contact_deviations.py). Where anything else happens, or a contact is near its bounds, the
 * caller decides. */

#if SET_GRIPS
#define FIRST_COMPONENT (!SET_HAS_CONTACT_SPEEDS)       /* of a slip: massless rollers slip one way alone */
#define MOST_COMPONENTS (2*MOST_WHEELS)

ALWAYS_INLINE int slides_in(const variations_t *w, long long row, int i)
{
    return !sticks_in(w, row, i) && w->run->grip[i] > 0;
}

/* Whether a contact that slips one way alone does so the other way from the next row on. */
ALWAYS_INLINE int turns_back(const variations_t *w, long long row, int i)
{
    const double *const heading = w->run->drive + (row*SET_INPUTS + SET_HEADINGS_INPUT)*w->wheels + i;
    return !SET_HAS_CONTACT_SPEEDS && slides_in(w, row, i) && heading[0] != heading[SET_INPUTS*w->wheels];
}

/* Whether contacts change their modes, or the way that they slip, between a row and the next. */
static int changes_modes(const variations_t *w, long long row)
{
    for (int i = 0; i < w->wheels; i++)
        if (sticks_in(w, row, i) != sticks_in(w, row + 1, i) || turns_back(w, row, i))
            return 1;
    return 0;
}

static int inputs_jump(const variations_t *w, long long row)
{
    const double *const before = w->run->drive + row*SET_INPUTS*w->wheels, *const after = before + SET_INPUTS*w->wheels;
    for (int k = 0; k < SET_MOVING*w->wheels; k++)
        if (fabs(after[k] - before[k]) > w->run->jumps*fmax(fabs(after[k]), fabs(before[k])))
            return 1;
    return 0;
}

/* List the components of the slips that come to rest behind a row. Returns how many; -1 where other contacts change as
 * well. */
static int list_rests(const variations_t *w, long long row, int *component)
{
    int count = 0, others = 0;
    for (int i = 0; i < w->wheels; i++) {
        const int rests = slides_in(w, row, i) && sticks_in(w, row + 1, i);
        for (int c = FIRST_COMPONENT; rests && c < 2; c++)
            component[count++] = 2*i + c;
        others |= !rests && (sticks_in(w, row, i) != sticks_in(w, row + 1, i) || turns_back(w, row, i));
    }
    return count && others ? -1 : count;
}

/* Whether a contact that sticks needs all its friction in a row, whose rates have been computed last. */
static int is_at_its_bound(const variations_t *w, long long row)
{
    const lanes_t *const force = point_of(w, w->vehicle, w->point).ground_force;
    for (int i = 0; i < w->wheels; i++) {
        double taken = -1;
        for (int c = 2*i; c < 2*i + 2; c++)
            taken += force[c][0]*force[c][0]*w->run->per_reach[c];
        if (sticks_in(w, row, i) && fabs(taken) <= w->run->reached)
            return 1;
    }
    return 0;
}

/* Whether a slip comes to rest only just in a row, whose rates have been computed last. */
static int grazes_rest(const variations_t *w, const int *component, int count)
{
    const lanes_t *const slip_dot = point_of(w, w->vehicle, w->point).slip_dot;
    for (int k = 0; k < count; k++) {
        const int i = component[k]/2;
        const lanes_t along = slip_dot[2*i]*w->towards[2*i] + slip_dot[2*i + 1]*w->towards[2*i + 1];
        if (-along[0] <= w->run->grazes)
            return 1;
    }
    return 0;
}

/* What unit forces do in a row, whose rates have been computed last: to the rates of the core, R (core x count), and to
 * the slips, W (count x count). */
static void put_responses(const variations_t *w, const int *component, int count, double *to_core, double *to_slip)
{
    const int wheels = OWN_WHEELS(w->wheels);
    const point_t at = point_of(w, w->vehicle, w->point), along = point_of(w, w->vehicle, w->along);
    for (int first = 0; first < count; first += LANES) {
        lanes_t nu_dot[3], moved[3];
        memset(along.ground_push, 0, 2*wheels*sizeof *along.ground_push);
        for (int k = first; k < count && k < first + LANES; k++)
            along.ground_push[component[k]][k - first] = 1;
        rates_along(wheels, &at, &along, nu_dot, moved);
        for (int k = first; k < count && k < first + LANES; k++) {
            for (int a = 0; a < w->core; a++)
                to_core[a*count + k] = (a < 3 ? moved[a] : along.core_dot[a - 3])[k - first];
            for (int i = 0; i < count; i++)
                to_slip[i*count + k] = along.slip_dot[component[i]][k - first];
        }
    }
    memset(along.ground_push, 0, 2*wheels*sizeof *along.ground_push);
}

/* The deviations of the slips in a row, which w->point has: count x groups. */
static void put_slips_moved(const variations_t *w, const int *component, int count, lanes_t *to)
{
    const int wheels = OWN_WHEELS(w->wheels);
    lanes_t slip[MOST_COMPONENTS], moved[MOST_COMPONENTS], own[point_size(w)];
    memset(own, 0, sizeof own);
    for (int g = 0; g < w->groups; g++) {
        put_moved(w, w->moved, g, own);
        const point_t at = point_of(w, &w->column[g], w->point);
        point_t along = point_of(w, &w->column[g], w->along);
        along.nu = own + POINT_NU, along.core = own + POINT_CORE, along.chi = own + point_chi(w);
        slips_along(wheels, &at, &along, slip, moved);
        for (int k = 0; k < count; k++)
            to[k*w->groups + g] = moved[component[k]];
    }
}

/* Solve a small system by rows, whose right sides become the solution. Returns whether it is regular. */
static int solve_small(double *matrix, int count, lanes_t *right, int groups)
{
    for (int p = 0; p < count; p++) {
        int best = p;
        for (int i = p + 1; i < count; i++)
            best = fabs(matrix[i*count + p]) > fabs(matrix[best*count + p]) ? i : best;
        if (!(fabs(matrix[best*count + p]) > 0))
            return 0;
        for (int c = 0; c < count && best != p; c++) {
            const double kept = matrix[p*count + c];
            matrix[p*count + c] = matrix[best*count + c], matrix[best*count + c] = kept;
        }
        for (int g = 0; g < groups && best != p; g++) {
            const lanes_t kept = right[p*groups + g];
            right[p*groups + g] = right[best*groups + g], right[best*groups + g] = kept;
        }
        for (int i = 0; i < count; i++) {
            const double factor = i == p ? 0 : matrix[i*count + p]/matrix[p*count + p];
            for (int c = p; c < count; c++)
                matrix[i*count + c] -= factor*matrix[p*count + c];
            for (int g = 0; g < groups; g++)
                right[i*groups + g] -= factor*right[p*groups + g];
        }
    }
    for (int p = 0; p < count; p++)
        for (int g = 0; g < groups; g++)
            right[p*groups + g] /= matrix[p*count + p];
    return 1;
}

/* Take from the deviations what the forces of contacts that come to rest do; the rates in the row have been computed
 * last. Returns whether that is determinate. */
static int take_rests(variations_t *w, const int *component, int count)
{
    const int groups = w->groups;
    double to_core[w->core*count], to_slip[count*count];
    lanes_t force[count*groups];
    put_responses(w, component, count, to_core, to_slip);
    put_slips_moved(w, component, count, force);
    if (!solve_small(to_slip, count, force, groups))
        return 0;
    for (int a = 0; a < w->core; a++)
        for (int k = 0; k < count; k++)
            for (int g = 0; g < groups; g++)
                w->moved[place_of_core(w, a)*groups + g] -= to_core[a*count + k]*force[k*groups + g];
    return 1;
}

/* Whether the rates of the core, all of them, are the same but for roundings. */
static int are_same(const variations_t *w, const lanes_t *one, const lanes_t *other)
{
    double apart = 0, largest = 0;
    for (int a = 0; a < w->core; a++) {
        const double x = one[place_of_core(w, a)][0], y = other[place_of_core(w, a)][0];
        apart = fmax(apart, fabs(x - y)), largest = fmax(largest, fmax(fabs(x), fabs(y)));
    }
    return apart <= w->run->jumps*largest;
}

/* Pass a change of modes between a row and the next. Returns whether it was one of those above; else nothing has been
 * done. */
static int pass_modes(variations_t *w, long long row)
{
    int component[MOST_COMPONENTS];
    const int count = list_rests(w, row, component);
    lanes_t before[w->size], after[w->size];
    if (count < 0 || inputs_jump(w, row))
        return 0;
    rates_in_row(w, row + 1, after);
    if (is_at_its_bound(w, row + 1))
        return 0;
    rates_in_row(w, row, before);
    if (count == 0)
        return are_same(w, before, after);
    return !grazes_rest(w, component, count) && take_rests(w, component, count);
}
#endif
