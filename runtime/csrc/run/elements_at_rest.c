/* Contacts and bearings at rest, decided together by friction/: which of them stick and which give way. */

/* The list of elements at rest: contacts that rest both ways, contacts that rest along the rolling direction alone, and
 * bearings. `which`: wheels, or places among the bearings. */
typedef struct {
    int contacts, rolls, count;     /* of the first kind, of the second, of all                              */
    int *which, *broken, *slips;    /* broken: those that have broken away slide                            */
    int *turned, *turns;            /* of the first kind: massless rollers that have broken away, and that turn */
    double *arm;                    /* of each wheel: of its massless roller, in m                          */
} at_rest_t;

/* The same as elements of friction: the first `wide` have `width` components, all others one. */
typedef struct {
    int count, wide, width;
    double *matrix, *given;         /* the Delassus matrix, and rates without these forces                  */
    double *reach;                  /* half-axes of what they can take                                      */
    double *force, *rate;           /* out                                                                  */
    double *pull;                   /* out: how strongly an element slips, >= 0                             */
    int unique;                     /* out: whether no other forces obey the law                            */
    double *strip;                  /* the largest first components of the forces                           */
    double *yields;                 /* out: how strongly what is behind a strip gives way                   */
    int apart;                      /* free rollers, which meet the others through nu_3' alone: friction/elements.h */
    double *mobility, *yaw, *apart_given, *bound, *yaw_rows, yaw_yaw;
    int equalities;
    double *equality, *wanted;
    friction_element_t *element;
    double *powers;
    int *state;
    void *memory;
} elements_t;

/* Where the forces of an element begin, and how many components they have. */
ALWAYS_INLINE int forces_at(int wide, int width, int element)
{
    return element > wide ? wide*width + (element - wide) : element*width;
}

ALWAYS_INLINE int width_of(int wide, int width, int element)
{
    return element >= wide ? 1 : width;
}

/* The element whose force stands at a place. */
ALWAYS_INLINE int element_at(int wide, int width, int place)
{
    return place >= wide*width ? wide + (place - wide*width) : place/width;
}

ALWAYS_INLINE double length_of(const double *vector, int width)
{
    return width == 1 ? fabs(vector[0]) : sqrt(vector[0]*vector[0] + vector[1]*vector[1]);
}

/* What an element can take. */
ALWAYS_INLINE friction_element_t element_of(const elements_t *c, int i)
{
    const int first = forces_at(c->wide, c->width, i), width = width_of(c->wide, c->width, i);
    friction_element_t element = {
        .kind = width == 1 ? FRICTION_INTERVAL : FRICTION_ELLIPSE, .first = first, .rows = width,
        .size = {c->reach[first], width == 1 ? 0 : c->reach[first + 1]}, .strip = INFINITY,
    };
    if (SET_STRIPS && i < c->wide)
        element.strip = c->strip[i];
    return element;
}

/* The same as the solver has it, with room for what it finds. */
static friction_problem_t problem_of(elements_t *c, friction_solution_t *found)
{
    for (int i = 0; i < c->count; i++)
        c->element[i] = element_of(c, i);
    *found = (friction_solution_t){
        .force = c->force, .acceleration = c->rate, .state = c->state, .pull = c->powers,
    };
    return (friction_problem_t){
        .rows = forces_at(c->wide, c->width, c->count), .elements = c->count, .element = c->element,
        .matrix = c->matrix, .given = c->given, .apart = c->apart, .mobility = c->mobility, .yaw = c->yaw,
        .apart_given = c->apart_given, .bound = c->bound, .yaw_rows = c->yaw_rows, .yaw_yaw = c->yaw_yaw,
        .equalities = c->equalities, .equality = c->equality, .wanted = c->wanted,
    };
}

/* Forces, rates, and what gives way. */
static void decide_elements(elements_t *c)
{
    friction_solution_t found;
    c->equalities = 0;
    const friction_problem_t problem = problem_of(c, &found);
    friction_decide(&problem, c->memory, &found);
    c->unique = found.unique;
    for (int i = 0; i < c->count; i++) {
        c->pull[i] = c->powers[2*i];
        if (SET_STRIPS)
            c->yields[i] = c->powers[2*i + 1];
    }
    for (int k = 0; k < c->apart; k++)
        c->pull[c->count + k] = c->powers[2*c->count + k];
}
