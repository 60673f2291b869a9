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
    const nodes_t *const block = block_of(e, row, column);
    for (int b = 0; b < e->blocks; b++)
        to[b] = kind == FULL ? block[j].lanes[b] : lanes_of(0);
    if (kind == DIAGONAL)
        to[j/LANES][j%LANES] = block->node[j];
}

static void make_full(const blockwise_t *e, int row, int column)
{
    nodes_t *const block = block_of(e, row, column), diagonal = *block;
    const int had = *kind_of(e, row, column);
    if (had == FULL)
        return;
    *kind_of(e, row, column) = FULL;
    memset(block, 0, e->nodes*sizeof *block);
    for (int j = 0; j < e->nodes && had == DIAGONAL; j++)
        block[j].node[j] = diagonal.node[j];
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
    if (left == DIAGONAL && right == DIAGONAL) {
        if (*kind == NO_BLOCK)
            memset(to, 0, sizeof *to), *kind = DIAGONAL;
        for (int j = 0; j < e->nodes; j++)
            (*kind == FULL ? to + j : to)->node[j] -= one->node[j]*other->node[j];
        return;
    }
    make_full(e, row, column);
    if (left == FULL && right == FULL)
        add_product(e->nodes, e->blocks, NODES/LANES, one, -1, other->lanes, to->lanes);
    for (int j = 0; j < e->nodes && left != right; j++)
        for (int b = 0; b < e->blocks; b++)
            to[j].lanes[b] -= left == FULL ? one[j].lanes[b]*other->lanes[b] : one->node[j]*other[j].lanes[b];
}

/* Take from the right side of a row a block of it times values at the nodes. */
static void subtract_values(const blockwise_t *e, int row, int column, const lanes_t *value)
{
    const int kind = *kind_of(e, row, column), groups = e->groups;
    const nodes_t *const block = block_of(e, row, column);
    lanes_t *const to = right_of(e, row);
    if (kind == DIAGONAL)
        for (int j = 0; j < e->nodes; j++)
            for (int g = 0; g < groups; g++)
                to[j*groups + g] -= block->node[j]*value[j*groups + g];
    else if (kind == FULL)
        add_product(e->nodes, groups, groups, block, -1, value, to);
}

/* Divide the equations of some unknowns, from p on, by their own blocks; of one the blocks behind it go along. */
static void divide(const blockwise_t *e, int p, int some)
{
    const int blocks = e->blocks, rows = some*e->nodes, behind = p + some;
    int width = 0;
    for (int c = behind; c < e->count; c++)
        width += *kind_of(e, p, c) == NO_BLOCK ? 0 : blocks;
    for (int k = 0; k < rows; k++) {
        const int row = p + k/e->nodes, j = k%e->nodes;
        lanes_t *to = e->row[k] = e->memory + k*(some*blocks + width + e->groups);
        for (int c = p; c < e->count; c++)
            if (c < behind || *kind_of(e, p, c) != NO_BLOCK)
                copy_row(e, row, c, j, to), to += blocks;
        memcpy(to, right_of(e, row) + j*e->groups, e->groups*sizeof *to);
    }
    solve(&(equations_t){e->row, rows, some*blocks, width + e->groups});
    for (int k = 0; k < rows; k++) {
        const int row = p + k/e->nodes, j = k%e->nodes;
        const lanes_t *from = e->row[k] + some*blocks;
        for (int c = behind; c < e->count; c++)
            if (*kind_of(e, p, c) != NO_BLOCK)
                memcpy(block_of(e, p, c)[j].lanes, from, blocks*sizeof *from), from += blocks;
        memcpy(right_of(e, row) + j*e->groups, from, e->groups*sizeof *from);
    }
    for (int c = behind; c < e->count; c++)
        if (*kind_of(e, p, c) != NO_BLOCK)
            *kind_of(e, p, c) = FULL;
}

/* The same of one whose own block is diagonal. */
static void divide_by_diagonal(const blockwise_t *e, int p)
{
    const nodes_t *const pivot = block_of(e, p, p);
    for (int j = 0; j < e->nodes; j++) {
        const double by = 1/pivot->node[j];
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
        divide(e, p, 1);
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

/* The right sides become the solution. */
NEVER_INLINE void solve_blockwise(const blockwise_t *e)
{
    const int first = e->count - e->last;
    for (int p = 0; p < first; p++)
        eliminate_unknown(e, p);
    divide(e, first, e->last);
    for (int p = first - 1; p >= 0; p--)
        for (int c = p + 1; c < e->count; c++)
            subtract_values(e, p, c, right_of(e, c));
}
