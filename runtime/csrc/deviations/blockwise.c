/* Linear equations in blocks, most of which are zero or diagonal: a block is what the values of one unknown at the
 * nodes do in the equations of another at the nodes.
 *
 * Unknowns are eliminated one after the other, but for the last few, which are solved for at once: rows change places
 * within a block alone. A diagonal block scales the rows or the columns of another one. */

enum { NO_BLOCK, DIAGONAL, FULL };

typedef struct {
    int count, last;                    /* unknowns; how many of these are solved for at once: the last */
    int nodes, blocks, groups;          /* of an unknown; vectors of them; vectors of right sides       */
    int *kind;                          /* count x count: of the block of a row and a column            */
    nodes_t *block;                     /* count x count x NODES: by rows; a diagonal in the first      */
    lanes_t *right;                     /* count x NODES x groups                                       */
    lanes_t *memory, **row;             /* of what is solved for at once                                */
} blockwise_t;

ALWAYS_INLINE int *kind_of(const blockwise_t *e, int row, int column) { return e->kind + row*e->count + column; }
ALWAYS_INLINE nodes_t *block_of(const blockwise_t *e, int row, int column)
{
    return e->block + (row*e->count + column)*NODES;
}
ALWAYS_INLINE lanes_t *right_of(const blockwise_t *e, int row) { return e->right + row*NODES*e->groups; }

/* The vectors that equations solved at once take: of one unknown by itself, or of the last ones together. */
ALWAYS_INLINE long long blockwise_memory(int count, int last, int blocks, int groups)
{
    const long long one = count*blocks + groups, together = last*(last*blocks + groups);
    return NODES*(one > together ? one : together);
}

/* A row of a block, whatever its kind. */
ALWAYS_INLINE void copy_row(const blockwise_t *e, int row, int column, int j, lanes_t *to)
{
    const int kind = *kind_of(e, row, column);
    const nodes_t *const own = block_of(e, row, column);
    for (int b = 0; b < e->blocks; b++)
        to[b] = kind == FULL ? own[j].lanes[b] : lanes_of(0);
    if (kind == DIAGONAL)
        to[j/LANES][j%LANES] = own->node[j];
}

static void make_full(const blockwise_t *e, int row, int column)
{
    nodes_t *const own = block_of(e, row, column), diagonal = *own;
    const int had = *kind_of(e, row, column);
    if (had == FULL)
        return;
    *kind_of(e, row, column) = FULL;
    memset(own, 0, e->nodes*sizeof *own);
    for (int j = 0; j < e->nodes && had == DIAGONAL; j++)
        own[j].node[j] = diagonal.node[j];
}

/* Take from a full block the product of two, the first of which is full or diagonal. */
static void subtract_full(const blockwise_t *e, const nodes_t *left, int left_kind, const nodes_t *right, nodes_t *to)
{
    if (left_kind == DIAGONAL) {
        for (int j = 0; j < e->nodes; j++)
            for (int b = 0; b < e->blocks; b++)
                to[j].lanes[b] -= left->node[j]*right[j].lanes[b];
        return;
    }
    add_product(e->nodes, e->blocks, NODES/LANES, left, -1, right->lanes, to->lanes);
}

/* Take from the block (row, column) that of (row, pivot) times that of (pivot, column). */
static void subtract_product(const blockwise_t *e, int row, int pivot, int column)
{
    const int left = *kind_of(e, row, pivot), right = *kind_of(e, pivot, column);
    const nodes_t *const one = block_of(e, row, pivot), *const other = block_of(e, pivot, column);
    int *const kind = kind_of(e, row, column);
    nodes_t *const to = block_of(e, row, column);
    if (left == NO_BLOCK || right == NO_BLOCK)
        return;
    if (left == FULL || right == FULL)
        make_full(e, row, column);
    if (right == FULL)
        subtract_full(e, one, left, other, to);
    else if (left == FULL)
        for (int j = 0; j < e->nodes; j++)
            for (int b = 0; b < e->blocks; b++)
                to[j].lanes[b] -= one[j].lanes[b]*other->lanes[b];
    else if (*kind == FULL)
        for (int j = 0; j < e->nodes; j++)
            to[j].node[j] -= one->node[j]*other->node[j];
    else {
        for (int b = 0; b < e->blocks; b++)
            to->lanes[b] = (*kind == DIAGONAL ? to->lanes[b] : lanes_of(0)) - one->lanes[b]*other->lanes[b];
        *kind = DIAGONAL;
    }
}

/* Take from the right side of a row a block of it times values at the nodes. */
static void subtract_values(const blockwise_t *e, int row, int column, const lanes_t *value)
{
    const int kind = *kind_of(e, row, column), groups = e->groups;
    const nodes_t *const own = block_of(e, row, column);
    lanes_t *const to = right_of(e, row);
    if (kind == DIAGONAL)
        for (int j = 0; j < e->nodes; j++)
            for (int g = 0; g < groups; g++)
                to[j*groups + g] -= own->node[j]*value[j*groups + g];
    else if (kind == FULL)
        add_product(e->nodes, groups, groups, own, -1, value, to);
}

/* Divide the equations of an unknown by its own block, which is full. */
static void divide_by_full(const blockwise_t *e, int p)
{
    const int blocks = e->blocks;
    int width = blocks;
    for (int c = p + 1; c < e->count; c++)
        width += *kind_of(e, p, c) == NO_BLOCK ? 0 : blocks;
    for (int j = 0; j < e->nodes; j++) {
        lanes_t *to = e->row[j] = e->memory + j*(width + e->groups);
        copy_row(e, p, p, j, to);
        for (int c = p + 1; c < e->count; c++)
            if (*kind_of(e, p, c) != NO_BLOCK)
                copy_row(e, p, c, j, to += blocks);
        memcpy(to + blocks, right_of(e, p) + j*e->groups, e->groups*sizeof *to);
    }
    solve(&(equations_t){e->row, e->nodes, blocks, width - blocks + e->groups});
    for (int j = 0; j < e->nodes; j++) {
        const lanes_t *from = e->row[j];
        for (int c = p + 1; c < e->count; c++)
            if (*kind_of(e, p, c) != NO_BLOCK)
                memcpy(block_of(e, p, c)[j].lanes, from += blocks, blocks*sizeof *from);
        memcpy(right_of(e, p) + j*e->groups, from + blocks, e->groups*sizeof *from);
    }
    for (int c = p + 1; c < e->count; c++)
        if (*kind_of(e, p, c) != NO_BLOCK)
            *kind_of(e, p, c) = FULL;
}

/* The same where it is diagonal; often it is one. */
static void divide_by_diagonal(const blockwise_t *e, int p)
{
    const nodes_t *const own = block_of(e, p, p);
    int is_one = 1;
    for (int j = 0; j < e->nodes; j++)
        is_one &= own->node[j] == 1;
    for (int j = 0; j < e->nodes && !is_one; j++) {
        const double by = 1/own->node[j];
        for (int c = p + 1; c < e->count; c++) {
            nodes_t *const to = block_of(e, p, c);
            if (*kind_of(e, p, c) == DIAGONAL)
                to->node[j] *= by;
            for (int b = 0; *kind_of(e, p, c) == FULL && b < e->blocks; b++)
                to[j].lanes[b] *= by;
        }
        for (int g = 0; g < e->groups; g++)
            right_of(e, p)[j*e->groups + g] *= by;
    }
}

static void eliminate_unknown(const blockwise_t *e, int p)
{
    if (*kind_of(e, p, p) == FULL)
        divide_by_full(e, p);
    else
        divide_by_diagonal(e, p);
    for (int row = p + 1; row < e->count; row++) {
        if (*kind_of(e, row, p) == NO_BLOCK)
            continue;
        for (int c = p + 1; c < e->count; c++)
            subtract_product(e, row, p, c);
        subtract_values(e, row, p, right_of(e, p));
    }
}

/* The last unknowns, at once. */
static void solve_last(const blockwise_t *e)
{
    const int first = e->count - e->last, width = e->last*e->blocks;
    for (int k = 0; k < e->last*e->nodes; k++) {
        lanes_t *const to = e->row[k] = e->memory + k*(width + e->groups);
        const int row = first + k/e->nodes, j = k%e->nodes;
        for (int c = 0; c < e->last; c++)
            copy_row(e, row, first + c, j, to + c*e->blocks);
        memcpy(to + width, right_of(e, row) + j*e->groups, e->groups*sizeof *to);
    }
    solve(&(equations_t){e->row, e->last*e->nodes, width, e->groups});
    for (int k = 0; k < e->last*e->nodes; k++)
        memcpy(right_of(e, first + k/e->nodes) + k%e->nodes*e->groups, e->row[k] + width, e->groups*sizeof(lanes_t));
}

/* The right sides become the solution. */
NEVER_INLINE void solve_blockwise(const blockwise_t *e)
{
    const int first = e->count - e->last;
    for (int p = 0; p < first; p++)
        eliminate_unknown(e, p);
    solve_last(e);
    for (int p = first - 1; p >= 0; p--)
        for (int c = p + 1; c < e->count; c++)
            subtract_values(e, p, c, right_of(e, c));
}
