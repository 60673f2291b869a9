/* Small systems of numbers, one for all columns. */
#define SAME 1e-9       /* of 1: pivots of a matrix whose diagonal is 1, below which rows depend on others */

/* Solve a system by rows; the right sides become the solution. Pivots that are no more than `least` are none: where
 * rows depend on others, and their right sides with them, such unknowns are 0. Returns how many are independent. */
static int solve_small(double *matrix, int count, lanes_t *right, int groups, double least)
{
    double scale[count + 1], scratch[count + 1], solution[count + 1];
    int row[count + 1], column[count + 1];
    friction_system_t system = {count, 0, matrix, scale, scratch, row, column};
    friction_factor(&system, least);
    for (int p = 0; p < groups*LANES; p++) {
        for (int k = 0; k < count; k++)
            solution[k] = right[k*groups + p/LANES][p%LANES];
        friction_solve(&system, solution);
        for (int k = 0; k < count; k++)
            right[k*groups + p/LANES][p%LANES] = solution[k];
    }
    return system.rank;
}
