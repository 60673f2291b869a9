/* Small systems of numbers, one for all columns. */
#define SAME 1e-9       /* of 1: pivots of a matrix whose diagonal is 1, below which rows depend on others */

/* Solve a system by rows, which is scaled so that its diagonal is 1, with pivots from all of its rows and columns; the
 * right sides become the solution. Pivots that are no more than `least` are none: where rows depend on others, and
 * their right sides with them, such unknowns are 0. Returns how many rows are independent. */
static int solve_small(double *matrix, int count, lanes_t *right, int groups, double least)
{
    double scale[count + 1];
    int row_of[count + 1], is_taken[count + 1], rank = 0;
    lanes_t found[count*groups + 1];
    memset(is_taken, 0, sizeof is_taken), memset(found, 0, sizeof found);
    for (int k = 0; k < count; k++) {
        const double own = fabs(matrix[k*count + k]);
        scale[k] = own > 0 ? 1/sqrt(own) : 1, row_of[k] = -1;
    }
    for (int k = 0; k < count*count; k++)
        matrix[k] *= scale[k/count]*scale[k%count];
    for (;; rank++) {
        int p = -1;
        double largest = least;
        for (int k = 0; k < count*count; k++)
            if (!is_taken[k/count] && row_of[k%count] < 0 && fabs(matrix[k]) > largest)
                largest = fabs(matrix[k]), p = k;
        if (p < 0)
            break;
        const int row = p/count, column = p%count;
        row_of[column] = row, is_taken[row] = 1;
        for (int i = 0; i < count; i++) {
            const double factor = i == row ? 0 : matrix[i*count + column]/matrix[p];
            for (int c = 0; c < count && factor != 0; c++)
                matrix[i*count + c] -= factor*matrix[row*count + c];
            for (int g = 0; g < groups && factor != 0; g++)
                right[i*groups + g] -= factor*(scale[row]/scale[i])*right[row*groups + g];
        }
    }
    for (int k = 0; k < count*groups; k++) {
        const int c = k/groups, row = row_of[c];
        if (row >= 0)
            found[k] = right[row*groups + k%groups]*(scale[row]*scale[c]/matrix[row*count + c]);
    }
    memcpy(right, found, count*groups*sizeof *right);
    return rank;
}
