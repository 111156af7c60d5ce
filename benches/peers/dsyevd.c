/* Times LAPACK's dsyevd: all eigenvalues and eigenvectors of a symmetric matrix, by divide and
 * conquer.
 *
 * arguments: n, repetitions
 * stdin:     n × n f64, symmetric
 * stdout:    seconds of all repetitions together
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

void dsyevd_(const char *job, const char *triangle, const int *n, double *a, const int *stride, double *values,
             double *work, const int *work_size, int *index_work, const int *index_work_size, int *info);

static double now(void) {
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return time.tv_sec + 1e-9 * time.tv_nsec;
}

int main(int count, char **arguments) {
    int n = count == 3 ? atoi(arguments[1]) : 0;
    long repetitions = n > 0 ? atol(arguments[2]) : 0;
    size_t size = (size_t)n * n * sizeof(double);
    int work_size = 1 + 6 * n + 2 * n * n, index_work_size = 3 + 5 * n, info = 0;
    double *matrix = malloc(size), *copy = malloc(size), *values = malloc(n * sizeof(double));
    double *work = malloc(work_size * sizeof(double));
    int *index_work = malloc(index_work_size * sizeof(int));
    if (n < 1 || !matrix || !copy || !values || !work || !index_work || fread(matrix, 1, size, stdin) != size) {
        fprintf(stderr, "usage: dsyevd N REPETITIONS < MATRIX\n");
        return 1;
    }
    double since = now();
    for (long i = 0; i < repetitions && info == 0; i++) {
        memcpy(copy, matrix, size);
        dsyevd_("V", "L", &n, copy, &n, values, work, &work_size, index_work, &index_work_size, &info);
    }
    printf("%.9f\n", now() - since);
    return info == 0 ? 0 : 1;
}
