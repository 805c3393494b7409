/* MUMPS over MPI on a matrix written by blade_matrix.py: analysis, factor, one right-hand side.
 *   mpirun -n RANKS mumps FILE [iK=VALUE] [cK=VALUE] [schur=COUNT]
 * iK and cK set ICNTL(K) and CNTL(K); the last COUNT unknowns stay, and the host gets their Schur complement.
 * Prints one line of the table that mumps.sh heads. Processor seconds are the sum of those of the ranks, which also count while
 * they wait for each other; those of the busiest thread alone would hide the work of the others. */
#include <dmumps_c.h>
#include <math.h>
#include <mpi.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static int64_t n, entries, *offsets, *rows;
static double *values;
static int rank, ranks;

static void fail(const char *what, int code) {
    fprintf(stderr, "mumps: %s (%d)\n", what, code);
    MPI_Abort(MPI_COMM_WORLD, 1);
}

static void *room(size_t bytes) {
    void *p = malloc(bytes);
    if (!p) fail("out of memory", 0);
    return p;
}

static void get(FILE *f, void *to, size_t count) {
    if (fread(to, 8, count, f) != count) fail("the file is too short", 0);
}

static double processor(void) {
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
}

/* Runs a job of MUMPS; processor seconds of all ranks, and seconds by the clock. */
static double seconds[2];
static void job(DMUMPS_STRUC_C *m, int number) {
    MPI_Barrier(MPI_COMM_WORLD);
    double used = processor(), begun = MPI_Wtime();
    m->job = number, dmumps_c(m);
    if (m->infog[0] < 0) fail("INFOG(1), then INFOG(2)", m->infog[0]), fail("", m->infog[1]);
    seconds[1] = MPI_Wtime() - begun;
    used = processor() - used;
    MPI_Reduce(&used, &seconds[0], 1, MPI_DOUBLE, MPI_SUM, 0, MPI_COMM_WORLD);
}

/* y = A x on all unknowns, both triangles stored. */
static void times(const double *x, double *y) {
    memset(y, 0, n * sizeof *y);
    for (int64_t j = 0; j < n; j++)
        for (int64_t k = offsets[j]; k < offsets[j + 1]; k++) y[rows[k]] += values[k] * x[j];
}

static double length(const double *x, int64_t from, int64_t to) {
    double sum = 0;
    for (int64_t i = from; i < to; i++) sum += x[i] * x[i];
    return sqrt(sum);
}

/* A number of INFOG: below zero it counts millions. */
static double count(int number) { return number < 0 ? -1e6 * number : number; }

int main(int words, char **word) {
    MPI_Init(&words, &word);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank), MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    if (words < 2) fail("mumps FILE [iK=VALUE] [cK=VALUE] [schur=COUNT]", 0);
    DMUMPS_STRUC_C m;
    memset(&m, 0, sizeof m);
    m.job = -1, m.par = 1, m.sym = 1, m.comm_fortran = (MUMPS_INT)MPI_Comm_c2f(MPI_COMM_WORLD);
    dmumps_c(&m);
    m.icntl[0] = m.icntl[1] = m.icntl[2] = -1, m.icntl[3] = 1;
    m.icntl[6] = 3; /* SCOTCH */
    int64_t schur = 0;
    for (int i = 2, k; i < words; i++) {
        const char *value = strchr(word[i], '=');
        if (!value) fail("iK=VALUE, cK=VALUE or schur=COUNT", i);
        if (sscanf(word[i], "i%d=", &k) == 1 && k >= 1 && k <= 60) m.icntl[k - 1] = atoi(value + 1);
        else if (sscanf(word[i], "c%d=", &k) == 1 && k >= 1 && k <= 15) m.cntl[k - 1] = atof(value + 1);
        else if (!strncmp(word[i], "schur=", 6)) schur = atol(value + 1);
        else fail("iK=VALUE, cK=VALUE or schur=COUNT", i);
    }
    if (rank == 0) {
        FILE *f = fopen(word[1], "rb");
        if (!f) fail("no such file", 0);
        get(f, &n, 1), get(f, &entries, 1);
        offsets = room((n + 1) * 8), rows = room(entries * 8), values = room(entries * 8);
        get(f, offsets, n + 1), get(f, rows, entries), get(f, values, entries);
        fclose(f);
        m.n = (MUMPS_INT)n;
        m.irn = room(entries * sizeof *m.irn), m.jcn = room(entries * sizeof *m.jcn), m.a = room(entries * 8);
        for (int64_t j = 0; j < n; j++)
            for (int64_t k = offsets[j]; k < offsets[j + 1]; k++)
                if (rows[k] >= j) {
                    m.irn[m.nnz] = (MUMPS_INT)rows[k] + 1, m.jcn[m.nnz] = (MUMPS_INT)j + 1;
                    m.a[m.nnz++] = values[k];
                }
    }
    if (schur) {
        m.icntl[18] = 1, m.size_schur = (MUMPS_INT)schur;
        m.listvar_schur = room(schur * sizeof *m.listvar_schur);
        for (int64_t i = 0; i < schur && rank == 0; i++) m.listvar_schur[i] = (MUMPS_INT)(n - schur + i) + 1;
        if (rank == 0) m.schur = room(schur * schur * 8);
    }
    job(&m, 1);
    job(&m, 2);
    double factor[2] = {seconds[0], seconds[1]};
    /* With x_b = 0 the answer to b is K_ii^-1 b; a Schur complement S is checked by S x_b = K_bi x_i + K_bb x_b, K_ii x_i = -K_ib x_b. */
    double *b = NULL, *x = NULL, *y = NULL;
    int64_t inner = n - schur;
    if (rank == 0) {
        b = room(n * 8), x = room(n * 8), y = room(n * 8);
        for (int64_t i = 0; i < n; i++) b[i] = i < inner && schur ? 0 : sin((double)i), x[i] = b[i];
        if (schur) {
            times(b, y);
            for (int64_t i = 0; i < n; i++) x[i] = i < inner ? -y[i] : 0;
        }
        m.rhs = x, m.nrhs = 1, m.lrhs = m.n;
    }
    job(&m, 3);
    if (rank == 0 && schur) memcpy(x + inner, b + inner, schur * 8);
    if (rank == 0) times(x, y);
    double error = 0;
    if (rank == 0 && schur) { /* by rows, the lower triangle */
        double size = length(y, inner, n);
        for (int64_t i = 0; i < schur; i++)
            for (int64_t j = 0; j < schur; j++) y[inner + i] -= m.schur[i >= j ? i * schur + j : j * schur + i] * b[inner + j];
        error = length(y, inner, n) / size;
    } else if (rank == 0) {
        for (int64_t i = 0; i < n; i++) y[i] -= b[i];
        error = length(y, 0, n) / length(b, 0, n);
    }
    if (rank == 0) {
        printf("| %ld | %d |", (long)n, ranks);
        for (int i = 2; i < words; i++) printf("%s%s", i > 2 ? ", " : " ", word[i]);
        printf(" | %.1f | %.1f | %.1f | %.1f | %d | %d | %.1e |\n", factor[0], factor[1], 1e-6 * count(m.infog[28]),
               1e-6 * count(m.infog[34]), m.infog[20], m.infog[21], error);
    }
    m.job = -2, dmumps_c(&m);
    MPI_Finalize();
    return 0;
}
