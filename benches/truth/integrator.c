/* Motion of bodies in unilateral contact with Coulomb friction through springs, from event to event:
   the fifth-order method of Dormand and Prince between the instants at which a pair touches, opens,
   begins to slip or sticks. Shares nothing with dovetail.

   M u'' + C u' + K u + G^T lambda = f(t),  C = alpha K + beta M,  x = G u for each pair (n, t1, t2)  (the law is in contact.h) */

#include "contact.h"

/* Acceleration from the forces besides those of the contacts, with friction in the directions `e`. */
static void accelerate(const Run *r, const double *y, const double *others, const Pair *kin, double e[][2], double *dv) {
    const Model *m = r->m;
    int n = m->dofs;
    double force[MOST_DOFS];
    memcpy(force, others, sizeof(double) * n);
    for (int p = 0; p < m->pairs; p++) {
        if (r->mode[p] == OPEN) continue;
        const Pair *k = kin + p;
        double lambda[3] = {-k->n, 0, 0};
        for (int c = 0; c < 2; c++)
            lambda[c + 1] = r->mode[p] == STICK ? m->kt[p] * (k->x[c + 1] - r->w[p][c]) : m->mu[p] * k->n * e[p][c];
        for (int c = 0; c < 3; c++) {
            const double *row = m->rows + (3 * p + c) * n;
            for (int i = 0; i < n; i++) force[i] -= lambda[c] * row[i];
        }
    }
    for (int i = 0; i < n; i++) {
        const double *row = m->inverse_mass + i * n;
        double sum = 0;
        if (m->is_diagonal) sum = row[i] * force[i];
        else for (int j = 0; j < n; j++) sum += row[j] * force[j];
        dv[i] = sum - m->beta * y[n + i];
    }
}

/* Friction that follows the velocity is behind it by the time mu N / (kt |v|), to first order. Returns
   whether there is any. */
static int lag(const Run *r, const Pair *kin, const double *dv, double e[][2]) {
    const Model *m = r->m;
    int any = 0;
    for (int p = 0; p < m->pairs; p++) {
        if (r->mode[p] != SLIP || !r->along[p] || m->mu[p] == 0) continue;
        const Pair *k = kin + p;
        double speed = hypot(k->v[1], k->v[2]), a[2] = {0, 0};
        if (speed == 0) continue;
        for (int c = 0; c < 2; c++)
            for (int i = 0; i < m->dofs; i++) a[c] += m->rows[(3 * p + c + 1) * m->dofs + i] * dv[i];
        double turn = (e[p][0] * a[1] - e[p][1] * a[0]) * m->mu[p] * k->n / (m->kt[p] * speed * speed);
        turn = atan(turn);
        double c = cos(turn), s = sin(turn), e0 = e[p][0], e1 = e[p][1];
        e[p][0] = e0 * c + e1 * s;
        e[p][1] = e1 * c - e0 * s;
        any = 1;
    }
    return any;
}

/* Derivative of the state, and of the sums over time if there are any to be made. */
static void slope(const Run *r, double t, const double *y, double *dy, double *sums) {
    const Model *m = r->m;
    int n = m->dofs;
    const double *u = y, *v = y + n;
    double force[MOST_DOFS], elastic[MOST_DOFS], e[MOST_PAIRS][2];
    Pair kin[MOST_PAIRS];
    for (int i = 0; i < n; i++) { elastic[i] = u[i] + m->alpha * v[i]; force[i] = m->steady[i]; }
    for (int h = 0; h < m->harmonics; h++) {
        double phase = m->orders[h] * m->omega * t, c = cos(phase), s = sin(phase);
        const double *fc = m->cosine + h * n, *fs = m->sine + h * n;
        for (int i = 0; i < n; i++) force[i] += c * fc[i] - s * fs[i];
    }
    for (int i = 0; i < n; i++) {
        const double *row = m->stiffness + i * n;
        double sum = 0;
        for (int j = 0; j < n; j++) sum += row[j] * elastic[j];
        force[i] -= sum;
        dy[i] = v[i];
    }
    kinematics(r, y, kin);
    for (int p = 0; p < m->pairs; p++) if (r->mode[p] == SLIP) direction(r, y, kin + p, p, e[p]);
    accelerate(r, y, force, kin, e, dy + n);
    if (lag(r, kin, dy + n, e)) accelerate(r, y, force, kin, e, dy + n);
    for (int p = 0; p < m->pairs; p++) {
        Pair *k = kin + p;
        int rubs = r->mode[p] == SLIP && m->mu[p] > 0;
        double limit = m->mu[p] * k->n;
        dy[2 * n + p] = rubs && !r->along[p] && limit > 0 ? m->kt[p] * (k->v[2] * e[p][0] - k->v[1] * e[p][1]) / limit : 0;
        if (!sums) continue;
        double speed = rubs ? slider_speed(m, k, e[p], p) : r->mode[p] == SLIP ? hypot(k->v[1], k->v[2]) : 0;
        sums[m->observed + 2 * p] = rubs ? limit * speed : 0;
        sums[m->observed + 2 * p + 1] = speed;
    }
    if (!sums) return;
    for (int o = 0; o < m->observed; o++) {
        sums[o] = 0;
        for (int i = 0; i < n; i++) sums[o] += m->weights[o * n + i] * u[i];
    }
    double power = 0;
    for (int i = 0; i < n; i++) {
        double kv = 0, mv = 0;
        for (int j = 0; j < n; j++) { kv += m->stiffness[i * n + j] * v[j]; mv += m->mass[i * n + j] * v[j]; }
        power += v[i] * (m->alpha * kv + m->beta * mv);
    }
    sums[m->observed + 2 * m->pairs] = power;
}

static const double A[7][6] = {
    {0}, {1.0 / 5}, {3.0 / 40, 9.0 / 40}, {44.0 / 45, -56.0 / 15, 32.0 / 9},
    {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
    {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656},
    {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84}};
static const double AT[7] = {0, 0.2, 0.3, 0.8, 8.0 / 9, 1, 1};
static const double ERROR[7] = {71.0 / 57600, 0, -71.0 / 16695, 71.0 / 1920, -17253.0 / 339200, 22.0 / 525, -1.0 / 40};

/* One step; the first slope is in k[0], and that of the end is left in k[6]. Returns the error over the
   tolerance. With `add` the sums of the step are added there. */
static double step(const Run *r, double t, double h, const double *y, double k[7][MOST_STATE], double *out, double *add) {
    const Model *m = r->m;
    double sums[MOST_SUMS], error = 0;
    if (add) {
        slope(r, t, y, k[0], sums);
        for (int i = 0; i < r->sums; i++) add[i] += h * A[6][0] * sums[i];
    }
    for (int s = 1; s < 7; s++) {
        double stage[MOST_STATE];
        for (int i = 0; i < r->size; i++) {
            double sum = 0;
            for (int q = 0; q < s; q++) sum += A[s][q] * k[q][i];
            stage[i] = y[i] + h * sum;
        }
        slope(r, t + AT[s] * h, stage, k[s], add ? sums : NULL);
        if (add && s < 6) for (int i = 0; i < r->sums; i++) add[i] += h * A[6][s] * sums[i];
        if (s == 6) memcpy(out, stage, sizeof(double) * r->size);
    }
    for (int i = 0; i < r->size; i++) {
        double sum = 0, scale = i < m->dofs ? m->u_scale : i < 2 * m->dofs ? m->u_scale * m->omega : 1;
        for (int s = 0; s < 7; s++) sum += ERROR[s] * k[s][i];
        error = fmax(error, fabs(h * sum) / scale);
    }
    return error / m->tolerance;
}

/* Largest value of a cubic with these ends over a step, with that of its ends. */
static double most_of(double h, double a, double da, double b, double db) {
    double best = fmax(a, b), c2 = 3 * (b - a) - h * (2 * da + db), c3 = 2 * (a - b) + h * (da + db);
    double d = 4 * c2 * c2 - 12 * c3 * h * da;
    if (d < 0) return best;
    for (int sign = -1; sign <= 1; sign += 2) {
        double q = -(2 * c2 + (c2 >= 0 ? 1 : -1) * sqrt(d)) / 2;
        double s = sign < 0 ? q / (3 * c3) : h * da / q;
        if (s > 0 && s < 1) best = fmax(best, a + s * (h * da + s * (c2 + s * c3)));
    }
    return best;
}

typedef struct { double most[MOST_OBSERVED], least[MOST_OBSERVED]; } Extremes;

static void record(const Run *r, double h, const double *y0, const double *y1, Extremes *ext, Figures *f) {
    const Model *m = r->m;
    int n = m->dofs;
    for (int o = 0; o < m->observed; o++) {
        double a[4] = {0, 0, 0, 0};
        for (int i = 0; i < n; i++) {
            double w = m->weights[o * n + i];
            a[0] += w * y0[i]; a[1] += w * y0[n + i]; a[2] += w * y1[i]; a[3] += w * y1[n + i];
        }
        ext->most[o] = fmax(ext->most[o], most_of(h, a[0], a[1], a[2], a[3]));
        ext->least[o] = fmin(ext->least[o], -most_of(h, -a[0], -a[1], -a[2], -a[3]));
    }
    Pair k0[MOST_PAIRS], k1[MOST_PAIRS];
    kinematics(r, y0, k0);
    kinematics(r, y1, k1);
    for (int p = 0; p < m->pairs; p++) {
        if (r->mode[p] == OPEN) {
            f->least_n[p] = 0; f->opens[p] = 1;
            f->way_open_m[p] += hypot(k1[p].x[1] - k0[p].x[1], k1[p].x[2] - k0[p].x[2]);
            continue;
        }
        f->touches[p] = 1;
        f->slips[p] |= r->mode[p] == SLIP;
        double most = most_of(h, k0[p].n, k0[p].dn, k1[p].n, k1[p].dn);
        double least = -most_of(h, -k0[p].n, -k0[p].dn, -k1[p].n, -k1[p].dn);
        f->most_n[p] = fmax(f->most_n[p], most);
        f->least_n[p] = fmin(f->least_n[p], fmax(least, 0));
    }
}

/* Finds the earliest part of a step at which a mode ends, if one does. */
static double earliest(const Run *r, double t, double h, const double *y, double k[7][MOST_STATE], const double *end) {
    double g0[2 * MOST_PAIRS], g1[2 * MOST_PAIRS], out[MOST_STATE], at = h;
    int found = 0;
    beyond(r, y, g0);
    beyond(r, end, g1);
    for (int i = 0; i < 2 * r->m->pairs; i++) {
        if (g1[i] <= 1e-13) continue;
        double lo = 0, hi = h, glo = g0[i], ghi = g1[i], g[2 * MOST_PAIRS];
        if (found) { /* Is this one earlier than those before? */
            step(r, t, at, y, k, out, NULL);
            beyond(r, out, g);
            if (g[i] <= 1e-13) continue;
            hi = at; ghi = g[i];
        }
        for (int n = 0, side = 0; n < 80 && hi - lo > 1e-13 * r->period && ghi > 1e-14; n++) {
            double mid = glo < -1e-14 && n % 4 < 3 ? hi - ghi * (hi - lo) / (ghi - glo) : 0.5 * (lo + hi);
            if (!(mid > lo && mid < hi)) mid = 0.5 * (lo + hi);
            step(r, t, mid, y, k, out, NULL);
            beyond(r, out, g);
            if (g[i] > 1e-15) { hi = mid; ghi = g[i]; if (side == 1) glo *= 0.5; side = 1; }
            else { lo = mid; glo = g[i]; if (side == -1) ghi *= 0.5; side = -1; }
        }
        found = 1;
        at = hi;
    }
    return found ? at : -h;
}

/* Writes the relative displacements of the pairs at the instants of a step that are multiples of the
   period over `count`. */
static void sample(const Run *r, double t, double h, const double *y0, const double *y1, int count, double *path) {
    Pair k0[MOST_PAIRS], k1[MOST_PAIRS];
    kinematics(r, y0, k0);
    kinematics(r, y1, k1);
    double apart = r->period / count;
    for (int i = (int)ceil(t / apart - 1e-9); i < count && i * apart < t + h; i++) {
        double s = fmax(0, (i * apart - t) / h);
        for (int p = 0; p < r->m->pairs; p++) for (int c = 0; c < 3; c++) {
            double a = k0[p].x[c], b = k1[p].x[c], da = h * k0[p].v[c], db = h * k1[p].v[c];
            double c2 = 3 * (b - a) - 2 * da - db, c3 = 2 * (a - b) + da + db;
            path[(i * r->m->pairs + p) * 3 + c] = a + s * (da + s * (c2 + s * c3));
        }
    }
}

/* Integrates `periods` periods from the state (u, v, w of each pair) at t = 0, which it leaves at their
   end, with the figures of the last of them and, where there is a path, the relative displacements then
   at `count` instants (count x pairs x 3). Returns 0, or 1 if a number is not finite, 2 after too many
   steps. */
int integrate(const Model *m, double *state, int periods, Figures *figures, int count, double *path) {
    Run r = {.m = m, .size = 2 * m->dofs + m->pairs, .sums = m->observed + 2 * m->pairs + 1, .period = 2 * M_PI / m->omega};
    double y[MOST_STATE] = {0}, out[MOST_STATE], k[7][MOST_STATE], sums[MOST_SUMS];
    int n = m->dofs;
    Pair kin[MOST_PAIRS];
    Extremes ext;
    double h = r.period / m->least_steps / 4;
    for (int lap = 0; lap < periods; lap++) {
        double t = 0;
        int is_last = figures && lap == periods - 1, steps = 0;
        memcpy(y, state, sizeof(double) * 2 * n);
        kinematics(&r, y, kin);
        for (int p = 0; p < m->pairs; p++) {
            r.along[p] = 0;
            memcpy(r.w[p], state + 2 * n + 2 * p, sizeof r.w[p]);
            if (kin[p].n > 0) settle(&r, y, kin + p, p); else r.mode[p] = OPEN;
        }
        if (is_last) {
            memset(figures, 0, sizeof *figures);
            memset(sums, 0, sizeof sums);
            for (int p = 0; p < m->pairs; p++) figures->least_n[p] = INFINITY;
            for (int o = 0; o < m->observed; o++) { ext.most[o] = -INFINITY; ext.least[o] = INFINITY; }
        }
        while (t < r.period * (1 - 1e-13)) {
            for (int i = 0; i < 4 && change(&r, y); i++) if (is_last) figures->events++;
            follow(&r, y);
            slope(&r, t, y, k[0], NULL);
            if (h > r.period / m->least_steps) h = r.period / m->least_steps;
            double trial = fmin(h, r.period - t), error;
            for (;;) {
                if (++steps > 2000000) return 2;
                error = step(&r, t, trial, y, k, out, NULL);
                if (!isfinite(error)) { if (trial < 1e-14 * r.period) return 1; trial *= 0.1; continue; }
                if (error <= 1 || trial < 1e-10 * r.period) break;
                trial *= fmax(0.2, 0.9 * pow(error, -0.2));
            }
            double at = earliest(&r, t, trial, y, k, out), used = trial;
            if (at > 0) { used = at; step(&r, t, used, y, k, out, NULL); }
            if (is_last) {
                step(&r, t, used, y, k, out, sums);
                record(&r, used, y, out, &ext, figures);
                if (path) sample(&r, t, used, y, out, count, path);
            }
            memcpy(y, out, sizeof(double) * r.size);
            t += used;
            double next = trial * fmin(4, 0.9 * pow(fmax(error, 1e-8), -0.2));
            h = at > 0 ? fmin(next, r.period / m->least_steps / 8) : next;
        }
        change(&r, y);
        kinematics(&r, y, kin);
        memcpy(state, y, sizeof(double) * 2 * n);
        for (int p = 0; p < m->pairs; p++) for (int c = 0; c < 2; c++) {
            double *w = state + 2 * n + 2 * p + c, e[2];
            direction(&r, y, kin + p, p, e);
            *w = kin[p].x[c + 1];
            if (r.mode[p] == STICK) *w = r.w[p][c];
            if (r.mode[p] == SLIP && m->mu[p] > 0) *w -= m->mu[p] * kin[p].n * e[c] / m->kt[p];
        }
        if (!is_last) continue;
        figures->steps = steps;
        for (int o = 0; o < m->observed; o++) {
            figures->mean[o] = sums[o] / r.period;
            figures->amplitude[o] = fmax(ext.most[o] - figures->mean[o], figures->mean[o] - ext.least[o]);
        }
        for (int p = 0; p < m->pairs; p++) {
            figures->friction_w[p] = sums[m->observed + 2 * p] / r.period;
            figures->slid_m[p] = sums[m->observed + 2 * p + 1];
        }
        figures->damping_w = sums[m->observed + 2 * m->pairs] / r.period;
    }
    return 0;
}
