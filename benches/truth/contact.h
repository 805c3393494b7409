/* The contact law of the integrator: springs with a slider, open, sticking or slipping, and the instants at
   which that changes.

   normal      lambda_N = -N,  N = kn max(0, -(x_N + gap))
   tangential  lambda_T = kt (x_T - w), |lambda_T| <= mu N, the slider w moves along lambda_T
   While a pair slips lambda_T = mu N (cos a, sin a), and |lambda_T| a' = kt times the velocity across. */

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_DOFS = 48, MOST_PAIRS = 8, MOST_OBSERVED = 8, MOST_STATE = 2 * MOST_DOFS + MOST_PAIRS };
enum { MOST_SUMS = MOST_OBSERVED + 2 * MOST_PAIRS + 1 };
enum { OPEN, STICK, SLIP };

typedef struct {
    int dofs, pairs, observed, harmonics;
    const double *stiffness, *inverse_mass, *mass; /* dofs x dofs */
    double alpha, beta, omega;
    const double *gap, *mu, *kn, *kt;              /* pairs */
    const double *rows;                            /* pairs x 3 x dofs */
    const double *steady, *cosine, *sine;          /* dofs, harmonics x dofs: f0 + c cos - s sin */
    const int *orders;                             /* harmonics */
    const double *weights;                         /* observed x dofs */
    double u_scale;                                /* size of the motion, m */
    double tolerance;
    int least_steps;                               /* of a period */
    int is_diagonal;                               /* the mass */
} Model;

typedef struct {
    double amplitude[MOST_OBSERVED], mean[MOST_OBSERVED];
    double friction_w[MOST_PAIRS], slid_m[MOST_PAIRS], way_open_m[MOST_PAIRS];
    double most_n[MOST_PAIRS], least_n[MOST_PAIRS], damping_w;
    int slips[MOST_PAIRS], opens[MOST_PAIRS], touches[MOST_PAIRS], steps, events;
} Figures;

typedef struct {
    const Model *m;
    int size, sums, mode[MOST_PAIRS], along[MOST_PAIRS]; /* along: the friction follows the velocity */
    double w[MOST_PAIRS][2];
    double period;
} Run;

typedef struct { double x[3], v[3], n, dn; } Pair;

static void kinematics(const Run *r, const double *y, Pair *out) {
    const Model *m = r->m;
    for (int p = 0; p < m->pairs; p++) {
        for (int c = 0; c < 3; c++) {
            const double *row = m->rows + (3 * p + c) * m->dofs;
            double x = 0, v = 0;
            for (int i = 0; i < m->dofs; i++) { x += row[i] * y[i]; v += row[i] * y[m->dofs + i]; }
            out[p].x[c] = x; out[p].v[c] = v;
        }
        out[p].n = -m->kn[p] * (out[p].x[0] + m->gap[p]);
        out[p].dn = -m->kn[p] * out[p].v[0];
    }
}

/* Direction of the friction force of a pair that slips. */
static void direction(const Run *r, const double *y, const Pair *k, int p, double e[2]) {
    double speed = hypot(k->v[1], k->v[2]);
    if (r->along[p] && speed > 0) { e[0] = k->v[1] / speed; e[1] = k->v[2] / speed; return; }
    double a = y[2 * r->m->dofs + p];
    e[0] = cos(a); e[1] = sin(a);
}

/* Speed of the slider of a pair on its cone, if it slips. */
static double slider_speed(const Model *m, const Pair *k, const double e[2], int p) {
    return k->v[1] * e[0] + k->v[2] * e[1] - m->mu[p] * k->dn / m->kt[p];
}

/* How far a pair is beyond its mode, each relative to its scale: above 0 the mode ends. */
static void beyond(const Run *r, const double *y, double *g) {
    const Model *m = r->m;
    Pair kin[MOST_PAIRS];
    kinematics(r, y, kin);
    for (int p = 0; p < m->pairs; p++) {
        Pair *k = kin + p;
        double depth = k->n / m->kn[p] / m->u_scale, *of = g + 2 * p;
        of[0] = r->mode[p] == OPEN ? depth : -depth;
        of[1] = -1;
        if (r->mode[p] == OPEN || m->mu[p] == 0) continue;
        if (r->mode[p] == STICK) {
            double t1 = m->kt[p] * (k->x[1] - r->w[p][0]), t2 = m->kt[p] * (k->x[2] - r->w[p][1]);
            of[1] = (hypot(t1, t2) - m->mu[p] * k->n) / m->kt[p] / m->u_scale;
        } else {
            double e[2];
            direction(r, y, k, p, e);
            of[1] = -slider_speed(m, k, e, p) / m->omega / m->u_scale;
        }
    }
}

/* Brings a pair that is closed to its cone: sticks, or slips from the force that it has. */
static void settle(Run *r, double *y, const Pair *k, int p) {
    const Model *m = r->m;
    double t[2], e[2], limit = m->mu[p] * k->n;
    if (m->mu[p] == 0) { r->mode[p] = SLIP; return; }
    for (int c = 0; c < 2; c++) t[c] = m->kt[p] * (k->x[c + 1] - r->w[p][c]);
    double size = hypot(t[0], t[1]);
    r->mode[p] = STICK;
    if (size < limit || size == 0) return;
    for (int c = 0; c < 2; c++) {
        e[c] = t[c] / size;
        r->w[p][c] = k->x[c + 1] - limit * e[c] / m->kt[p];
    }
    if (slider_speed(m, k, e, p) < 0) return;
    r->mode[p] = SLIP;
    y[2 * m->dofs + p] = atan2(e[1], e[0]);
}

/* Changes the modes of the pairs that are beyond theirs. Returns their number. */
static int change(Run *r, double *y) {
    const Model *m = r->m;
    Pair kin[MOST_PAIRS];
    double g[2 * MOST_PAIRS];
    int changes = 0;
    kinematics(r, y, kin);
    beyond(r, y, g);
    for (int p = 0; p < m->pairs; p++) {
        Pair *k = kin + p;
        if (g[2 * p] > 0 || (g[2 * p] == 0 && (r->mode[p] == OPEN) == (k->dn > 0))) {
            changes++;
            r->along[p] = 0;
            if (r->mode[p] != OPEN) { r->mode[p] = OPEN; continue; }
            double speed = hypot(k->v[1], k->v[2]);
            for (int c = 0; c < 2; c++) r->w[p][c] = k->x[c + 1];
            r->mode[p] = STICK;
            if (m->mu[p] == 0) r->mode[p] = SLIP;
            else if (m->kt[p] * speed > m->mu[p] * k->dn) {
                r->mode[p] = SLIP;
                r->along[p] = 1;
                y[2 * m->dofs + p] = atan2(k->v[2], k->v[1]);
            }
        } else if (g[2 * p + 1] >= 0 && m->mu[p] > 0) {
            double e[2];
            if (r->mode[p] == SLIP) {
                if (g[2 * p + 1] == 0) continue;
                direction(r, y, k, p, e);
                for (int c = 0; c < 2; c++) r->w[p][c] = k->x[c + 1] - m->mu[p] * k->n * e[c] / m->kt[p];
                r->mode[p] = STICK;
                r->along[p] = 0;
                changes++;
            } else {
                settle(r, y, k, p);
                changes += r->mode[p] == SLIP;
            }
        }
    }
    return changes;
}

/* Where the friction of a pair follows its velocity within this share of a period, it is along it. */
static const double FOLLOWS = 3e-5;

static void follow(Run *r, double *y) {
    const Model *m = r->m;
    Pair kin[MOST_PAIRS];
    kinematics(r, y, kin);
    for (int p = 0; p < m->pairs; p++) {
        if (r->mode[p] != SLIP || m->mu[p] == 0) continue;
        Pair *k = kin + p;
        double speed = hypot(k->v[1], k->v[2]);
        int was = r->along[p];
        r->along[p] = m->mu[p] * k->n < (was ? 1.5 : 1.0) * FOLLOWS * r->period * m->kt[p] * speed;
        if (r->along[p] || was) y[2 * m->dofs + p] = atan2(k->v[2], k->v[1]);
    }
}

/* Moves the sliders w (pairs x 2) along one period of relative displacements again and again until they
   are where they were a period before, and says of each pair whether it slides in the last of these
   periods. Returns the number of periods, or 0 if they do not come to rest. */
int follow_path(const Model *m, const double *path, int count, double *w, int *slides) {
    for (int lap = 1; lap <= 200; lap++) {
        double moved = 0;
        for (int p = 0; p < m->pairs; p++) {
            double before[2] = {w[2 * p], w[2 * p + 1]};
            slides[p] = 0;
            for (int i = 0; i <= count; i++) {
                const double *x = path + ((i % count) * m->pairs + p) * 3;
                double n = -m->kn[p] * (x[0] + m->gap[p]), t[2];
                if (n <= 0 || m->mu[p] == 0) {
                    w[2 * p] = x[1]; w[2 * p + 1] = x[2];
                    slides[p] |= i > 0;
                    continue;
                }
                for (int c = 0; c < 2; c++) t[c] = m->kt[p] * (x[c + 1] - w[2 * p + c]);
                double size = hypot(t[0], t[1]), limit = m->mu[p] * n;
                if (size <= limit) continue;
                slides[p] |= i > 0 && size - limit > 1e-9 * m->kt[p] * m->u_scale;
                for (int c = 0; c < 2; c++) w[2 * p + c] = x[c + 1] - limit * t[c] / size / m->kt[p];
            }
            moved = fmax(moved, hypot(w[2 * p] - before[0], w[2 * p + 1] - before[1]));
        }
        if (moved < 1e-10 * m->u_scale) return lap;
    }
    return 0;
}
