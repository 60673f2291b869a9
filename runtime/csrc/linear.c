/* Vectors of three numbers, and systems of linear equations. */

ALWAYS_INLINE double dot3(const double *a, const double *b)
{
    return (a[0]*b[0] + a[1]*b[1]) + a[2]*b[2];
}

ALWAYS_INLINE double length3(const double *a)
{
    return sqrt(dot3(a, a));
}

/* Gauss's elimination with the largest pivots; the solution stands in `right` then. */
static void solve_rows(double *m, int size, double *right)
{
    for (int k = 0; k < size; k++) {
        int pivot = k;
        for (int j = k + 1; j < size; j++)
            if (fabs(m[j*size + k]) > fabs(m[pivot*size + k]))
                pivot = j;
        for (int l = 0; l < size && pivot != k; l++) {
            const double kept = m[k*size + l];
            m[k*size + l] = m[pivot*size + l], m[pivot*size + l] = kept;
        }
        const double kept = right[k];
        right[k] = right[pivot], right[pivot] = kept;
        for (int j = k + 1; j < size; j++) {
            const double factor = m[j*size + k]/m[k*size + k];
            for (int l = k + 1; l < size && factor != 0; l++)
                m[j*size + l] -= factor*m[k*size + l];
            right[j] -= factor*right[k];
        }
    }
    for (int k = size - 1; k >= 0; k--) {
        for (int l = k + 1; l < size; l++)
            right[k] -= m[k*size + l]*right[l];
        right[k] /= m[k*size + k];
    }
}
