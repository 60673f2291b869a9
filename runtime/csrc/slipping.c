/* Forces on contacts that slip under Coulomb's friction: they go against the slip, whatever its size.
 *
 * With the slip s, its size |s| and its direction e = s/|s|, e' = (s' - e (e . s'))/|s|. That is regular at the nodes of a
 * step, which are inside it, while slips begin and come to rest at its ends. Massless rollers slip one way alone. */

#if SET_GRIPS
/* Where a contact slips, and how that moves: from its slip, where this is not rounding, else as the row says. */
ALWAYS_INLINE void put_direction(const variations_t *w, long long row, int i, const lanes_t *slip, const lanes_t *moved,
                                 lanes_t *towards, lanes_t *turned)
{
    const int wheels = w->wheels, turns = SET_HAS_CONTACT_SPEEDS;
    const double heading = w->run->drive[(row*SET_INPUTS + SET_HEADINGS_INPUT)*wheels + i];
    const lanes_t given[2] = {lanes_of(turns ? cos(heading) : 0), lanes_of(sin(heading))};
    const lanes_t size = lanes_sqrt(slip[0]*slip[0] + slip[1]*slip[1]);
    const lane_mask_t known = size > (turns ? w->run->slip_rounding[row*wheels + i] : INFINITY);
    const lanes_t inverse = 1/lanes_select(known, size, lanes_of(1));
    const lanes_t along = (slip[0]*moved[0] + slip[1]*moved[1])*inverse;
    for (int c = 0; c < 2; c++) {
        towards[c] = lanes_select(known, slip[c]*inverse, given[c]);
        turned[c] = lanes_select(known, (moved[c] - towards[c]*along)*inverse, lanes_of(0));
    }
}
#endif

/* The forces at a point of the phase of a row, into it, and how they move: with one of the numbers, or with none. */
ALWAYS_INLINE void put_pushes(const variations_t *w, long long row, int model, const point_t *at, const point_t *along)
{
#if SET_GRIPS
    const int wheels = OWN_WHEELS(w->wheels), pair = 2*MOST_WHEELS;
    const double *const grip = w->run->grip, *const grown = grip + 3*wheels*model;
    lanes_t slip[pair], moved[pair], towards[pair], turned[pair], load[MOST_WHEELS], load_moved[MOST_WHEELS];
    lanes_t friction[pair], friction_moved[pair], slope[2*pair], slope_moved[2*pair];
    memset(at->ground_push, 0, 2*wheels*sizeof *slip);
    memset(along->ground_push, 0, 2*wheels*sizeof *slip);
    slips_along(wheels, at, along, slip, moved);
    for (int i = 0; i < wheels; i++) {
        const lanes_t slides = 1 - at->inputs[SET_MODES_INPUT*wheels + i];
        put_direction(w, row, i, slip + 2*i, moved + 2*i, towards + 2*i, turned + 2*i);
        load[i] = slides*grip[i], load_moved[i] = slides*(model ? grown[i] : 0);
        for (int c = 2*i; c < 2*i + 2; c++)
            friction[c] = lanes_of(grip[wheels + c]), friction_moved[c] = lanes_of(model ? grown[wheels + c] : 0);
    }
    set_sliding_forces_along(wheels, at->vehicle, towards, load, friction, turned, load_moved, friction_moved,
                             at->ground_push, slope, along->ground_push, slope_moved);
#else
    (void)w, (void)row, (void)model, (void)at, (void)along;
#endif
}
