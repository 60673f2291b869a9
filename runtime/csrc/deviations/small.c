/* Small systems of numbers, one for all columns. */

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

#define SAME 1e-9       /* of 1: pivots of a matrix whose diagonal is 1, below which rows depend on others */

/* Scale a symmetric matrix so that its diagonal is 1, and solve it. Where rows depend on others, and their right sides
 * with them, those unknowns are 0. Returns how many rows are independent. */
static int solve_dependent(double *matrix, int count, lanes_t *right, int groups)
{
    double scale[count + 1];
    int taken[count + 1], rank = 0;
    for (int k = 0; k < count; k++)
        scale[k] = matrix[k*count + k] != 0 ? 1/sqrt(fabs(matrix[k*count + k])) : 0, taken[k] = 0;
    for (int k = 0; k < count*count; k++)
        matrix[k] *= scale[k/count]*scale[k%count];
    for (int k = 0; k < count*groups; k++)
        right[k] *= scale[k/groups];
    for (;;) {
        int p = -1;
        double largest = SAME;
        for (int k = 0; k < count; k++)
            if (!taken[k] && fabs(matrix[k*count + k]) > largest)
                largest = fabs(matrix[k*count + k]), p = k;
        if (p < 0)
            break;
        taken[p] = 1, rank++;
        for (int i = 0; i < count; i++) {
            const double factor = i == p ? 0 : matrix[i*count + p]/matrix[p*count + p];
            for (int c = 0; c < count; c++)
                matrix[i*count + c] -= factor*matrix[p*count + c];
            for (int g = 0; g < groups; g++)
                right[i*groups + g] -= factor*right[p*groups + g];
        }
    }
    for (int k = 0; k < count*groups; k++) {
        const int i = k/groups;
        right[k] = taken[i] ? right[k]*(scale[i]/matrix[i*count + i]) : lanes_of(0);
    }
    return rank;
}
