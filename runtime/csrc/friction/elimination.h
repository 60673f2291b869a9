/* Systems of linear equations whose rank is not known beforehand. */
#ifndef OMNIROLL_FRICTION_ELIMINATION_H
#define OMNIROLL_FRICTION_ELIMINATION_H

/* A square matrix, factored in its place by Gauss's elimination with the largest pivots of all. */
typedef struct {
    int size, rank;
    double *matrix, *scale, *scratch;               /* size x size, size, size                              */
    int *row, *column;
} friction_system_t;

/* Factors a symmetric matrix after its rows and columns are brought to one size; pivots below `least` are zero. */
FRICTION_LINKAGE void friction_factor(friction_system_t *system, double least);

/* The solution, in the place of `right`: zero for columns without a pivot. */
FRICTION_LINKAGE void friction_solve(const friction_system_t *system, double *right);

#endif
