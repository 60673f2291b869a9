/* Loads of contacts that may stick: given, or where the platform stands on springs functions of the state. What a contact
 * takes is measured against its load at rest, so that it is smooth where a load vanishes. */
#define LEAST_LOAD 1e-9             /* of that at rest: of a contact that has just come back to the ground         */

/* Loads in some states, from the core beside nu. */
ALWAYS_INLINE void loads_in_state(const step_t *s, const int wheels, const lanes_t *core, lanes_t *load)
{
    lanes_t presses[MAX_WHEELS], margin[MAX_WHEELS], rise[MAX_WHEELS];
    for (int i = 0; i < wheels; i++)
        load[i] = s->contact.load[i], presses[i] = lanes_of(s->contact.presses[i]);
    if (SET_LOADS_FOLLOW)
        set_support_state(wheels, s->vehicle, core + tilt_at(wheels), core + tilt_rates_at(wheels), presses, load, margin,
                          rise);
    (void)core, (void)presses, (void)margin, (void)rise;
}

/* The loads at the nodes, from the states there. */
ALWAYS_INLINE void loads_at_nodes(step_t *s, const int wheels)
{
    lanes_t load[MAX_WHEELS];
    for (int b = 0; b < BLOCKS; b++) {
        loads_in_state(s, wheels, core_at(s, b), load);
        for (int i = 0; i < wheels; i++)
            s->slip.at_load[i].lanes[b] = load[i];
    }
}

/* The load of a contact in vector b of the nodes. */
ALWAYS_INLINE lanes_t load_at(const step_t *s, int i, int b)
{
    if (SET_LOADS_FOLLOW)
        return s->slip.at_load[i].lanes[b];
    return s->contact.load[i];
}

/* A load as part of that at rest, squared. */
ALWAYS_INLINE lanes_t load_squared(const step_t *s, int i, lanes_t load)
{
    if (SET_LOADS_FOLLOW)
        return (load*s->contact.per_load[i])*(load*s->contact.per_load[i]);
    return lanes_of(1);
}
