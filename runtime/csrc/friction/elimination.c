/* Gauss's elimination with complete pivoting, of symmetric matrices that may be indefinite or singular. */
#include <math.h>

#include "elimination.h"

/* Rows and columns by one factor each, so that the diagonal is 1, or the largest number of a row without diagonal. */
static void equilibrate(friction_system_t *system)
{
    const int n = system->size;
    double *const m = system->matrix, *const scale = system->scale;
    for (int k = 0; k < n; k++)
        scale[k] = m[k*n + k] > 0 ? 1/sqrt(m[k*n + k]) : 0;
    for (int k = 0; k < n; k++) {
        double largest = 0;
        for (int l = 0; l < n && !(m[k*n + k] > 0); l++)
            largest = fmax(largest, fabs(m[k*n + l])*scale[l]);
        if (!(m[k*n + k] > 0))
            system->scratch[k] = largest > 0 ? 1/largest : 1;
    }
    for (int k = 0; k < n; k++)
        if (!(m[k*n + k] > 0))
            scale[k] = system->scratch[k];
    for (int k = 0; k < n; k++)
        for (int l = 0; l < n; l++)
            m[k*n + l] *= scale[k]*scale[l];
}

static void swap(int *numbers, int one, int two)
{
    const int kept = numbers[one];
    numbers[one] = numbers[two], numbers[two] = kept;
}

/* Rows and columns change places, so that the pivot stands on the diagonal. */
static void bring_pivot(friction_system_t *system, int done, int row, int column)
{
    const int n = system->size;
    double *const m = system->matrix;
    for (int l = 0; l < n && row != done; l++) {
        const double kept = m[done*n + l];
        m[done*n + l] = m[row*n + l], m[row*n + l] = kept;
    }
    for (int k = 0; k < n && column != done; k++) {
        const double kept = m[k*n + done];
        m[k*n + done] = m[k*n + column], m[k*n + column] = kept;
    }
    swap(system->row, done, row), swap(system->column, done, column);
}

/* The pivot that is largest so far: of rows and columns that are still to be done. */
typedef struct {
    int row, column;
    double largest;
} pivot_t;

/* Look for it in a row, from a column on. */
static void look_in_row(const double *row, int k, int from, int size, pivot_t *pivot)
{
    for (int l = from; l < size; l++)
        if (fabs(row[l]) > pivot->largest)
            pivot->largest = fabs(row[l]), pivot->row = k, pivot->column = l;
}

FRICTION_LINKAGE void friction_factor(friction_system_t *system, double least)
{
    const int n = system->size;
    double *const m = system->matrix;
    pivot_t next = {0, 0, 0};
    equilibrate(system);
    for (int k = 0; k < n; k++) {
        system->row[k] = system->column[k] = k;
        look_in_row(m + k*n, k, 0, n, &next);
    }
    for (int done = system->rank = 0; done < n; system->rank = ++done) {
        if (!(next.largest > least))
            return;
        bring_pivot(system, done, next.row, next.column);
        const double *const pivot = m + done*n;
        next = (pivot_t){done + 1, done + 1, 0};
        for (int k = done + 1; k < n; k++) {
            double *const to = m + k*n;
            const double factor = to[done] /= pivot[done];
            for (int l = done + 1; l < n && factor != 0; l++)
                to[l] -= factor*pivot[l];
            look_in_row(to, k, done + 1, n, &next);
        }
    }
}

FRICTION_LINKAGE void friction_solve(const friction_system_t *system, double *right)
{
    const int n = system->size, rank = system->rank;
    const double *const m = system->matrix;
    double *const x = system->scratch;
    for (int k = 0; k < rank; k++) {
        x[k] = right[system->row[k]]*system->scale[system->row[k]];
        for (int l = 0; l < k; l++)
            x[k] -= m[k*n + l]*x[l];
    }
    for (int k = rank - 1; k >= 0; k--) {
        for (int l = k + 1; l < rank; l++)
            x[k] -= m[k*n + l]*x[l];
        x[k] /= m[k*n + k];
    }
    for (int k = 0; k < n; k++)
        right[k] = 0;
    for (int k = 0; k < rank; k++)
        right[system->column[k]] = x[k]*system->scale[system->column[k]];
}
