/* What plain C with OpenMP does with a TM-25 file of seven 32-bit columns, mapped into memory: the peer of `run_all.py`.

   cc -O3 -march=native -ffast-math -fopenmp plain.c -lm -o plain
   plain FILE START sum THREADS REPEATS
   plain FILE START counts WIDTH SPACE_BITS DIRECTION_BITS THREADS REPEATS
   plain FILE START cone THETA_DEG ACCEPTANCE_DEG WIDTH PIXELS THREADS REPEATS

   START is where the first ray begins [bytes]. Each repeat maps the file anew. Printed: least time [s], and a sum to compare.
   sum: all columns. counts: étendue cells, 32^4 on the plane z = 0 of this width, and two finer grids, of place and of direction.
   cone: rays within an angle of the direction (THETA, 0), by the pixel that their start is projected to along it. */

#define _GNU_SOURCE
#include <fcntl.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <time.h>

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static inline int cell(float x, int n) {
    int i = (int)(x * n);
    return i < 0 ? 0 : i >= n ? n - 1 : i;
}

/* The concentric map from the unit disk to the unit square. */
static inline void to_square(float p, float q, float *a, float *b) {
    int wide = fabsf(p) > fabsf(q);
    float along = wide ? p : q, across = wide ? q : p;
    float r = copysignf(sqrtf(p * p + q * q), along);
    float other = r * atanf(across / (along == 0 ? 1 : along)) * (float)(4 / M_PI);
    *a = (wide ? r : other) * .5f + .5f;
    *b = (wide ? other : r) * .5f + .5f;
}

static double sum(const float *rays, long n, int threads) {
    double s = 0;
#pragma omp parallel for num_threads(threads) reduction(+ : s) schedule(static)
    for (long i = 0; i < n; i++) {
        const float *q = rays + 7 * i;
        s += (double)(q[0] + q[1] + q[2] + q[3] + q[4] + q[5]) + q[6];
    }
    return s;
}

static double counts(const float *rays, long n, float width, int space, int direction, uint32_t *grid, long size, int threads) {
    memset(grid, 0, (size_t)size * (size_t)threads * sizeof *grid);
    long chunk = (n + threads - 1) / threads;
#pragma omp parallel for num_threads(threads) schedule(static, 1)
    for (int t = 0; t < threads; t++) {
        uint32_t *cells = grid + size * t, *fine = cells + (1 << 20), *finer = fine + (long)space * space;
        for (long i = t * chunk; i < (t + 1) * chunk && i < n; i++) {
            const float *q = rays + 7 * i;
            float m = -q[2] / q[5], x = (q[0] + m * q[3]) / width + .5f, y = (q[1] + m * q[4]) / width + .5f, a, b;
            if (!(x >= 0 && x <= 1 && y >= 0 && y <= 1)) continue;
            to_square(q[3], q[4], &a, &b);
            cells[(cell(x, 32) << 15) | (cell(y, 32) << 10) | (cell(a, 32) << 5) | cell(b, 32)]++;
            fine[(long)cell(x, space) * space + cell(y, space)]++;
            finer[(long)cell(a, direction) * direction + cell(b, direction)]++;
        }
    }
    for (int t = 1; t < threads; t++)
        for (long i = 0; i < size; i++) grid[i] += grid[size * t + i];
    double met = 0;
    for (long i = 0; i < 1 << 20; i++) met += grid[i];
    return met;
}

static double cone(const float *rays, long n, double theta, double acceptance, float width, int pixels, double *map, int threads) {
    float vx = (float)sin(theta), vz = (float)cos(theta), least = (float)cos(acceptance), pitch = width / (float)pixels;
    long size = (long)pixels * pixels, chunk = (n + threads - 1) / threads;
    memset(map, 0, (size_t)size * (size_t)threads * sizeof *map);
#pragma omp parallel for num_threads(threads) schedule(static, 1)
    for (int t = 0; t < threads; t++)
        for (long i = t * chunk; i < (t + 1) * chunk && i < n; i++) {
            const float *q = rays + 7 * i;
            if (q[3] * vx + q[5] * vz < least) continue;
            int x = (int)floorf((q[0] * vz - q[2] * vx + width / 2) / pitch), y = (int)floorf((q[1] + width / 2) / pitch);
            if (x >= 0 && y >= 0 && x < pixels && y < pixels) map[size * t + (long)y * pixels + x] += q[6];
        }
    double seen = 0;
    for (long i = 0; i < size * threads; i++) seen += map[i];
    return seen;
}

int main(int count, char **arg) {
    if (count < 6) return fprintf(stderr, "see the head of plain.c\n"), 2;
    int file = open(arg[1], O_RDONLY);
    struct stat info;
    if (file < 0 || fstat(file, &info)) return perror(arg[1]), 1;
    long start = atol(arg[2]), n = (info.st_size - start) / 28;
    int threads = atoi(arg[count - 2]), repeats = atoi(arg[count - 1]);
    int counting = !strcmp(arg[3], "counts"), looking = !strcmp(arg[3], "cone");
    int space = counting ? 1 << atoi(arg[5]) : 1, direction = counting ? 1 << atoi(arg[6]) : 1, pixels = looking ? atoi(arg[7]) : 1;
    long size = (1 << 20) + (long)space * space + (long)direction * direction;
    uint32_t *grid = malloc((size_t)size * (size_t)threads * sizeof *grid);
    double *map = malloc((size_t)pixels * (size_t)pixels * (size_t)threads * sizeof *map), least = 1e300, found = 0;
    for (int k = 0; k < repeats; k++) {
        double begun = now();
        void *mapped = mmap(0, (size_t)info.st_size, PROT_READ, MAP_SHARED, file, 0);
        if (mapped == MAP_FAILED) return perror("mmap"), 1;
        const float *rays = (const float *)((const char *)mapped + start);
        found = counting  ? counts(rays, n, (float)atof(arg[4]), space, direction, grid, size, threads)
                : looking ? cone(rays, n, atof(arg[4]) * M_PI / 180, atof(arg[5]) * M_PI / 180, (float)atof(arg[6]), pixels, map, threads)
                          : sum(rays, n, threads);
        munmap(mapped, (size_t)info.st_size);
        double took = now() - begun;
        least = took < least ? took : least;
    }
    printf("%.6f %.9g\n", least, found);
    return 0;
}
