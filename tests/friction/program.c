/* Reads problems of friction from the standard input and writes their forces, each with memory of its very size. */
#include <stdio.h>
#include <stdlib.h>

#include "elements.h"

static void *read_numbers(size_t count, size_t size)
{
    void *const numbers = malloc(count*size + 1);
    if (!numbers || fread(numbers, size, count, stdin) != count)
        exit(1);
    return numbers;
}

static void solve_one(const int *sizes)
{
    const size_t rows = (size_t)sizes[0], elements = (size_t)sizes[1], apart = (size_t)sizes[2];
    friction_problem_t problem = {.rows = sizes[0], .elements = sizes[1], .apart = sizes[2]};
    friction_solution_t found = {
        .force = malloc((rows + apart)*sizeof(double) + 1), .acceleration = malloc((rows + apart)*sizeof(double) + 1),
        .state = malloc((elements + apart)*sizeof(int) + 1), .pull = malloc((2*elements + apart)*sizeof(double) + 1),
    };
    double *const yaw_yaw = read_numbers(1, sizeof(double));
    const size_t counts[] = {rows*rows, rows, apart, apart, apart, apart, apart ? rows : 0};
    const double **const places[] = {
        &problem.matrix, &problem.given, &problem.mobility, &problem.yaw, &problem.apart_given, &problem.bound,
        &problem.yaw_rows,
    };
    for (size_t k = 0; k < sizeof places/sizeof *places; k++)
        *places[k] = read_numbers(counts[k], sizeof(double));
    friction_element_t *const element = read_numbers(elements, sizeof *element);
    void *const memory = malloc(friction_memory(sizes[0], sizes[1], sizes[2], 0));
    problem.element = element, problem.yaw_yaw = *yaw_yaw;
    if (!memory || friction_decide(&problem, memory, &found) != 1)
        exit(1);
    fwrite(found.force, sizeof(double), rows + apart, stdout);
    for (size_t k = 0; k < sizeof places/sizeof *places; k++)
        free((void *)*places[k]);
    free(element), free(yaw_yaw), free(memory);
    free(found.force), free(found.acceleration), free(found.state), free(found.pull);
}

int main(void)
{
    int sizes[4];
    while (fread(sizes, sizeof *sizes, 4, stdin) == 4)
        solve_one(sizes);
    return 0;
}
