/* Contacts and bearings at rest, decided together by friction/: which of them stick and which give way. */

/* The list of elements at rest: contacts that rest both ways, contacts that rest along the rolling direction alone, and
 * bearings. `which`: wheels, or places among the bearings. */
typedef struct {
    int contacts, rolls, count;     /* of the first kind, of the second, of all                              */
    int *which, *broken, *slips;    /* broken: those that have broken away slide                            */
    int *turned, *turns;            /* of the first kind: massless rollers that have broken away, and that turn */
    double *arm;                    /* of each wheel: of its massless roller, in m                          */
} at_rest_t;

/* The same as elements of friction. p.element lists free rollers that stand apart, too, behind all others: friction/
 * does not count them there, but their forces have places behind those of the others. */
typedef struct {
    friction_problem_t p;
    friction_solution_t found;
    double *reach;                  /* half-axes of what they can take                                      */
    void *memory;
} elements_t;

ALWAYS_INLINE double length_of(const double *vector, int width)
{
    return width == 1 ? fabs(vector[0]) : sqrt(vector[0]*vector[0] + vector[1]*vector[1]);
}

/* How strongly an element is pulled over the edge of what it can take. */
ALWAYS_INLINE double pull_of(const elements_t *c, int element)
{
    return c->found.pull[element < c->p.elements ? 2*element : c->p.elements + element];
}
