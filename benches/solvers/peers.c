/* CHOLMOD and MUMPS on a matrix written by own.rs: analysis, factor, 256 right-hand sides.
 *   peers cholmod|mumps FILE THREADS
 * FILE: n, entries, n + 1 column offsets, row indices (64-bit integers), values; both triangles. The mass that follows
 * is not read.
 * Threads are those of the BLAS (OPENBLAS_NUM_THREADS) and, in MUMPS, of OpenMP: compare.sh sets them. */
#include <cholmod.h>
#include <dmumps_c.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <time.h>

enum { COLUMNS = 256 };
static int64_t n, entries, *offsets, *rows;
static double *values;

static double wall(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
}

static double processor(void) {
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
}

static double started, used;
static void start(void) { started = wall(), used = processor(); }
static void stop(const char *what) {
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    printf("%-28s %8.3f s wall %8.3f s processor %7ld MiB peak\n", what, wall() - started, processor() - used,
           usage.ru_maxrss / 1024);
    fflush(stdout);
}

static void fail(const char *what) {
    fprintf(stderr, "peers: %s\n", what);
    exit(1);
}

static void *room(size_t bytes) {
    void *p = malloc(bytes);
    if (!p) fail("out of memory");
    return p;
}

static void get(FILE *f, void *to, size_t count) {
    if (fread(to, 8, count, f) != count) fail("the file is too short");
}

static double rhs(int64_t i, int64_t j) { return sin((double)(i + 7 * j)); }

/* |K x - b| / |b| of the last column. */
static void check(const double *x) {
    double *r = room(n * sizeof *r), error = 0, size = 0;
    for (int64_t i = 0; i < n; i++) r[i] = -rhs(i, COLUMNS - 1), size += r[i] * r[i];
    for (int64_t j = 0; j < n; j++)
        for (int64_t k = offsets[j]; k < offsets[j + 1]; k++) r[rows[k]] += values[k] * x[j];
    for (int64_t i = 0; i < n; i++) error += r[i] * r[i];
    if (!(sqrt(error / size) < 1e-6)) fail("wrong solution");
    free(r);
}

static void run_cholmod(void) {
    cholmod_common c;
    cholmod_l_start(&c);
    c.nmethods = 1;
    c.method[0].ordering = CHOLMOD_METIS;
    c.postorder = 1;
    c.supernodal = CHOLMOD_SUPERNODAL;
    int64_t lower = 0;
    for (int64_t j = 0; j < n; j++)
        for (int64_t k = offsets[j]; k < offsets[j + 1]; k++) lower += rows[k] >= j;
    cholmod_sparse *a = cholmod_l_allocate_sparse(n, n, lower, 1, 1, -1, CHOLMOD_REAL, &c);
    int64_t *ap = a->p, *ai = a->i, at = 0;
    double *ax = a->x;
    for (int64_t j = 0; j < n; j++) {
        ap[j] = at;
        for (int64_t k = offsets[j]; k < offsets[j + 1]; k++)
            if (rows[k] >= j) ai[at] = rows[k], ax[at++] = values[k];
    }
    ap[n] = at;
    start();
    cholmod_factor *factor = cholmod_l_analyze(a, &c);
    stop("analysis");
    start();
    cholmod_l_factorize(a, factor, &c);
    if (c.status != CHOLMOD_OK) fail("CHOLMOD stopped");
    stop("factor");
    cholmod_dense *b = cholmod_l_allocate_dense(n, COLUMNS, n, CHOLMOD_REAL, &c);
    for (int64_t j = 0; j < COLUMNS; j++)
        for (int64_t i = 0; i < n; i++) ((double *)b->x)[i + j * n] = rhs(i, j);
    start();
    cholmod_dense *x = cholmod_l_solve(CHOLMOD_A, factor, b, &c);
    stop("solve 256");
    check((double *)x->x + (COLUMNS - 1) * n);
}

static void run_mumps(void) {
    DMUMPS_STRUC_C m;
    memset(&m, 0, sizeof m);
    m.job = -1, m.par = 1, m.sym = 1;
    dmumps_c(&m);
    m.n = (MUMPS_INT)n;
    m.irn = room(entries * sizeof *m.irn), m.jcn = room(entries * sizeof *m.jcn), m.a = room(entries * 8);
    m.nnz = 0;
    for (int64_t j = 0; j < n; j++)
        for (int64_t k = offsets[j]; k < offsets[j + 1]; k++)
            if (rows[k] >= j) {
                m.irn[m.nnz] = (MUMPS_INT)rows[k] + 1, m.jcn[m.nnz] = (MUMPS_INT)j + 1;
                m.a[m.nnz++] = values[k];
            }
    m.icntl[0] = m.icntl[1] = m.icntl[2] = -1, m.icntl[3] = 1;
    const char *order = getenv("MUMPS_ORDER");
    m.icntl[6] = order ? atoi(order) : 3; /* 3 SCOTCH, 4 PORD, 5 METIS, 7 its own choice */
    m.icntl[26] = COLUMNS;                /* right-hand sides at a time */
    start();
    m.job = 1, dmumps_c(&m);
    if (m.infog[0] < 0) fail("MUMPS analysis stopped");
    stop("analysis");
    start();
    m.job = 2, dmumps_c(&m);
    if (m.infog[0] < 0) fail("MUMPS factorisation stopped");
    stop("factor");
    m.rhs = room(n * COLUMNS * 8), m.nrhs = COLUMNS, m.lrhs = m.n;
    for (int64_t j = 0; j < COLUMNS; j++)
        for (int64_t i = 0; i < n; i++) m.rhs[i + j * n] = rhs(i, j);
    start();
    m.job = 3, dmumps_c(&m);
    if (m.infog[0] < 0) fail("MUMPS solution stopped");
    stop("solve 256");
    check(m.rhs + (COLUMNS - 1) * n);
    printf("ordering %d\n", m.infog[6]);
}

int main(int count, char **words) {
    if (count != 4) fail("peers cholmod|mumps FILE THREADS");
    FILE *f = fopen(words[2], "rb");
    if (!f) fail("no such file");
    get(f, &n, 1), get(f, &entries, 1);
    offsets = room((n + 1) * 8), rows = room(entries * 8), values = room(entries * 8);
    get(f, offsets, n + 1), get(f, rows, entries), get(f, values, entries);
    fclose(f);
    printf("%s, %ld unknowns, %s threads\n", words[1], (long)n, words[3]);
    if (!strcmp(words[1], "cholmod")) run_cholmod();
    else if (!strcmp(words[1], "mumps")) run_mumps();
    else fail("cholmod or mumps");
    return 0;
}
