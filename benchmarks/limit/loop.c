/* The stepping loop of the flat pump: Rodas4 and Dormand-Prince 5(4), stops and roots for this pump alone.

Stops whose times are known (ticks of the line, the gears' phases) end a step exactly; the step size is carried over
them. Roots of the relief valve and of the cover's kink are foreseen by the step's interpolant and the step is redone
to end there, so that no state is ever taken from an interpolant. After a gear's phase the first step has the size that
suited it a pitch ago. */

#include <time.h>
#include "pump.c"

typedef struct {
    double rtol, atol[NX];
    double stop, grid;                          /* from 0 on; output every `grid` [s], 0: none */
    double *delivery; long rows;
} Task;

enum { STEPS, REJECTED, REDONE, RATES, JACOBIANS, FACTORS, SOLVES, CLOCKS, EVENTS, STOPS, TICKS, ROOTS, COUNTS };
enum { KINDS = SEGMENTS + 3, KIND_COVER = SEGMENTS, KIND_LEAVES, KIND_HITS, NO_KIND = -1 };

typedef struct {
    Pump u;
    Task task;
    double k[7][NX];                            /* stages */
    double f0[NX];                              /* dx/dt at t */
    Jacobian J;
    double h;                                   /* step wanted */
    double first[KINDS];                        /* what suited the first step after an event of each kind */
    int kind;                                   /* of the event just before, or NO_KIND */
    double old_error;
    double dense[4][NX];
    long count[COUNTS], row;
    int slot;                                   /* of the clock at t */
    double force;
} Run;

/* --------------------------------------------------------------------------------------------- linear algebra */

typedef struct {
    Jacobian m;                                 /* eliminated rows */
    double t, r, n, f, w, c, q, x, v, a, s, d, b;      /* inverse pivots */
    double at, dr, sr, ar, dn, sn, wf, cw, qc, dq, dx, sx, vx, dv, sv, sa, da, ds;     /* multipliers */
    int trapped, driver, driven, moves;
} Factors;

/* LU of I g - J in the order trapped, chains, line to delivery, spool, annular, suction, delivery: fill only there. */
INLINE void factor(const Pump *u, const Jacobian *J, double g, Factors *F)
{
    double dd = g - J->dd, ds = -J->ds, da = -J->da, sd = -J->sd, ss = g - J->ss, sa = -J->sa;
    double ad = -J->ad, as = -J->as, aa = g - J->aa;
    F->m = *J;
    F->trapped = u->trapped, F->driver = u->driver, F->driven = u->driven, F->moves = u->at == 0;
    F->b = 1 / (g - J->bb);
    if (F->trapped) {
        F->t = 1 / (g - J->tt);
        F->at = -J->at * F->t;
        aa -= F->at * -J->ta;
    }
    if (F->driver) {
        F->r = 1 / (g - J->rr);
        F->dr = -J->dr * F->r, F->sr = -J->sr * F->r, F->ar = -J->ar * F->r;
        dd += F->dr * J->rd, ds += F->dr * J->rs, da += F->dr * J->ra;
        sd += F->sr * J->rd, ss += F->sr * J->rs, sa += F->sr * J->ra;
        ad += F->ar * J->rd, as += F->ar * J->rs, aa += F->ar * J->ra;
    }
    if (F->driven) {
        F->n = 1 / (g - J->nn);
        F->dn = -J->dn * F->n, F->sn = -J->sn * F->n;
        dd += F->dn * J->nd, ds += F->dn * J->ns;
        sd += F->sn * J->nd, ss += F->sn * J->ns;
    }
    F->f = 1 / (g - J->ff);
    F->wf = -J->wf * F->f;
    F->w = 1 / (g - J->ww + F->wf * J->fw);
    F->cw = -J->cw * F->w;
    F->c = 1 / (g - J->cc + F->cw * J->wc);
    F->qc = -J->qc * F->c;
    F->q = 1 / (g - J->qq + F->qc * J->cq);
    F->dq = -J->dq * F->q;
    dd += F->dq * J->qd;
    if (F->moves) {
        F->x = 1 / g;
        F->vx = -J->vx * F->x, F->dx = -J->dx * F->x, F->sx = -J->sx * F->x;
        F->v = 1 / (g - J->vv + F->vx);
        F->dv = (-J->dv + F->dx) * F->v, F->sv = (-J->sv + F->sx) * F->v;
        dd += F->dv * J->vd, ds += F->dv * J->vs;
        sd += F->sv * J->vd, ss += F->sv * J->vs;
    }
    F->a = 1 / aa;
    F->sa = sa * F->a, F->da = da * F->a;
    sd -= F->sa * ad, ss -= F->sa * as;
    dd -= F->da * ad, ds -= F->da * as;
    F->s = 1 / ss;
    F->ds = ds * F->s;
    F->d = 1 / (dd - F->ds * sd);
    F->m.ad = ad, F->m.as = as, F->m.sd = sd;
}

INLINE void solve(const Factors *F, double over_g, double *y)
{
    const Jacobian *m = &F->m;
    double d = y[PD], s = y[PS], a = y[PA], t = 0, r = 0, n = 0, x = 0, v = 0;
    if (F->trapped) t = y[PT], a -= F->at * t;
    if (F->driver) r = y[PR], d -= F->dr * r, s -= F->sr * r, a -= F->ar * r;
    if (F->driven) n = y[PN], d -= F->dn * n, s -= F->sn * n;
    double f = y[PF], w = y[Q2] - F->wf * f, c = y[PC] - F->cw * w, q = y[Q1] - F->qc * c;
    d -= F->dq * q;
    if (F->moves) {
        x = y[X], v = y[V] - F->vx * x;
        d -= F->dx * x + F->dv * v, s -= F->sx * x + F->sv * v;
    }
    s -= F->sa * a, d -= F->da * a;
    d -= F->ds * s;
    y[PD] = d = d * F->d;
    y[PS] = s = (s - m->sd * d) * F->s;
    y[PA] = a = (a - m->ad * d - m->as * s) * F->a;
    if (F->moves) y[V] = v = (v + m->vd * d + m->vs * s) * F->v, y[X] = (x + v) * F->x;
    else y[V] = y[X] = 0;
    y[Q1] = q = (q + m->qd * d) * F->q;
    y[PC] = c = (c + m->cq * q) * F->c;
    y[Q2] = w = (w + m->wc * c) * F->w;
    y[PF] = f = (f + m->fw * w) * F->f;
    y[PN] = F->driven ? (n + m->nd * d + m->ns * s) * F->n : 0;
    y[PR] = F->driver ? (r + m->rd * d + m->rs * s + m->ra * a) * F->r : 0;
    y[PT] = F->trapped ? (t + m->ta * a) * F->t : 0;
    y[PB] *= F->b;
    y[IA] = (y[IA] + m->af * f) * over_g;
    y[IB] = (y[IB] + m->ib * y[PB]) * over_g;
    y[PHI] *= over_g;
}

/* ------------------------------------------------------------------------------------------------------- error */

/* Root mean square of error over atol + rtol max(|x0|, |x1|); the duct's flows as the circuit's mean and difference. */
INLINE double error_norm(const Task *task, const double *x0, const double *x1, const double *error)
{
    double sum = 0, e[NX], a[NX], b[NX];
    memcpy(e, error, sizeof e), memcpy(a, x0, sizeof a), memcpy(b, x1, sizeof b);
    e[Q1] = (error[Q1] + error[Q2]) / 2, e[Q2] = error[Q1] - error[Q2];
    a[Q1] = (x0[Q1] + x0[Q2]) / 2, a[Q2] = x0[Q1] - x0[Q2];
    b[Q1] = (x1[Q1] + x1[Q2]) / 2, b[Q2] = x1[Q1] - x1[Q2];
    for (int i = 0; i < NX; i++) sum += SQR(e[i] / (task->atol[i] + task->rtol * MAX(fabs(a[i]), fabs(b[i]))));
    return sqrt(sum / NX);
}

/* ------------------------------------------------------------------------------------------------------- Rodas4 */

/* Hairer & Wanner, Solving Ordinary Differential Equations II, section IV.7: RODAS, order 4(3), stiffly accurate. */
static const double RA[6][5] = {
    {0}, {1.544}, {0.9466785280815826, 0.2557011698983284},
    {3.314825187068521, 2.896124015972201, 0.9986419139977817},
    {1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950},
    {1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950, 1},
};
static const double RC[6][5] = {
    {0}, {-5.6688}, {-2.430093356833875, -0.2063599157091915},
    {-0.1073529058151375, -9.594562251023355, -20.47028614809616},
    {7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160},
    {8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054},
};
static const double RD[4] = {0.25, -0.1043, 0.1035, -0.0362}, RTIME[FEW] = {0.386, 0.21, 0.63, 1}, RGAMMA = 0.25;
static const double RDENSE[2][5] = {
    {10.12623508344586, -7.487995877610167, -34.80091861555747, -7.992771707568823, 1.025137723295662},
    {-0.6762803392801253, 6.087714651680015, 16.43084320892478, 24.76722511418386, -6.594389125716872},
};

/* One step of size h from u->t to x1; f0, J and slot 0 of the clock are those at u->t. Returns the error's norm. */
INLINE double rodas(Run *run, double h, double *x1)
{
    Pump *u = &run->u;
    double (*K)[NX] = run->k, x[NX], f[NX], t[FEW];
    const double g = 1 / (h * RGAMMA), over_h = 1 / h;
    Factors F;
    for (int k = 0; k < FEW; k++) t[k] = u->t + RTIME[k] * h;
    set_clock(u, FEW, t, &u->clock);
    factor(u, &run->J, g, &F);
    for (int i = 0; i < NX; i++) K[0][i] = run->f0[i] + h * RD[0] * run->J.t[i];
    solve(&F, 1 / g, K[0]);
#pragma GCC unroll 6
    for (int s = 1; s < 6; s++) {
        double rhs[NX];
        for (int i = 0; i < NX; i++) {
            x[i] = u->x[i], rhs[i] = s < 4 ? h * RD[s] * run->J.t[i] : 0;
            for (int j = 0; j < s; j++) x[i] += RA[s][j] * K[j][i], rhs[i] += RC[s][j] * over_h * K[j][i];
        }
        rates(u, &u->clock, s < 4 ? s - 1 : 3, x, f);
        for (int i = 0; i < NX; i++) K[s][i] = f[i] + rhs[i];
        solve(&F, 1 / g, K[s]);
    }
    for (int i = 0; i < NX; i++) x1[i] = x[i] + K[5][i];
    x1[PHI] = u->omega * t[3];
    run->count[RATES] += 5, run->count[FACTORS]++, run->count[SOLVES] += 6, run->count[CLOCKS]++;
    return error_norm(&run->task, u->x, x1, K[5]);
}

/* Third-order interpolant: x(t + s h) = (1-s) x0 + s (x1 + (1-s)(c + s d)). */
static void rodas_dense(Run *run, const double *x1)
{
    for (int i = 0; i < NX; i++) {
        double c = 0, d = 0;
        for (int j = 0; j < 5; j++) c += RDENSE[0][j] * run->k[j][i], d += RDENSE[1][j] * run->k[j][i];
        run->dense[0][i] = x1[i] - run->u.x[i], run->dense[1][i] = c, run->dense[2][i] = d, run->dense[3][i] = 0;
    }
}

/* ----------------------------------------------------------------------------------------------- Dormand-Prince */

static const double DA[7][6] = {
    {0}, {1.0 / 5}, {3.0 / 40, 9.0 / 40}, {44.0 / 45, -56.0 / 15, 32.0 / 9},
    {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
    {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656},
    {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84},
};
static const double DE[7] = {71.0 / 57600, 0, -71.0 / 16695, 71.0 / 1920, -17253.0 / 339200, 22.0 / 525, -1.0 / 40};
static const double DD[7] = {
    -12715105075.0 / 11282082432.0, 0, 87487479700.0 / 32700410799.0, -10690763975.0 / 1880347072.0,
    701980252875.0 / 199316789632.0, -1453857185.0 / 822651844.0, 69997945.0 / 29380423.0,
};
static const double DTIME[5] = {1.0 / 5, 3.0 / 10, 4.0 / 5, 8.0 / 9, 1};

INLINE double dopri(Run *run, double h, double *x1)
{
    Pump *u = &run->u;
    double (*K)[NX] = run->k, t[SLOTS], error[NX];
    for (int k = 0; k < SLOTS; k++) t[k] = u->t + (k < 5 ? DTIME[k] : 1) * h;
    set_clock(u, SLOTS, t, &u->clock);
    memcpy(K[0], run->f0, sizeof run->f0);
#pragma GCC unroll 7
    for (int s = 1; s < 7; s++) {
        for (int i = 0; i < NX; i++) {
            double sum = 0;
            for (int j = 0; j < s; j++) sum += DA[s][j] * K[j][i];
            x1[i] = u->x[i] + h * sum;
        }
        run->force = rates(u, &u->clock, s < 5 ? s - 1 : 4, x1, K[s]);
    }
    for (int i = 0; i < NX; i++) {
        double sum = 0;
        for (int j = 0; j < 7; j++) sum += DE[j] * K[j][i];
        error[i] = h * sum;
    }
    x1[PHI] = u->omega * t[4];
    run->count[RATES] += 6, run->count[CLOCKS]++;
    return error_norm(&run->task, u->x, x1, error);
}

/* Fourth-order interpolant in the same form. */
static void dopri_dense(Run *run, double h, const double *x1)
{
    for (int i = 0; i < NX; i++) {
        double sum = 0, rise = x1[i] - run->u.x[i], bspl = h * run->k[0][i] - rise;
        for (int j = 0; j < 7; j++) sum += DD[j] * run->k[j][i];
        run->dense[0][i] = rise, run->dense[1][i] = bspl, run->dense[2][i] = rise - h * run->k[6][i] - bspl;
        run->dense[3][i] = h * sum;
    }
}

INLINE double along(const Run *run, double s, int i)
{
    const double *x0 = run->u.x;
    const double s1 = 1 - s;
    return x0[i] + s * (run->dense[0][i] + s1 * (run->dense[1][i] + s * (run->dense[2][i] + s1 * run->dense[3][i])));
}

/* ------------------------------------------------------------------------------------------------------- roots */

/* What must stay positive until the next root: distance to the kink of the cover, to the spool's next event. */
enum { G_COVER, G_SPOOL, GS };

INLINE void distances(const Run *run, double pd, double ps, double x, double v, double *g)
{
    const Pump *u = &run->u;
    const double above = u->piece + 1 < COVER_PIECES ? COVER_KNOT[u->piece + 1] - pd : INFINITY;
    const double below = u->piece > 0 ? pd - COVER_KNOT[u->piece] : INFINITY;
    g[G_COVER] = MIN(above, below);
    if (u->at == 0) g[G_SPOOL] = MIN(x - LOW_STOP, HIGH_STOP - x);
    else if (u->at < 0) g[G_SPOOL] = SPRING_PRELOAD + SPRING_RATE * LOW_STOP - SPOOL * pd;    /* no flow, no jet */
    else {
        double xs[NX], dx[NX];
        memcpy(xs, u->x, sizeof xs);
        xs[PD] = pd, xs[PS] = ps, xs[X] = x, xs[V] = v;
        g[G_SPOOL] = rates(u, &u->clock, 0, xs, dx);
    }
}

/* Share of the step at which the first distance turns negative, by Illinois on the interpolant; x1 is beyond. */
static double root_share(const Run *run, int which, double g0, double g1)
{
    double low = 0, high = 1, g[GS];
    int side = 0;
    for (int round = 0; round < 60 && high - low > 1e-14; round++) {
        double s = (low * g1 - high * g0) / (g1 - g0);
        if (!(s > low && s < high)) s = (low + high) / 2;
        distances(run, along(run, s, PD), along(run, s, PS), along(run, s, X), along(run, s, V), g);
        if (fabs(g[which]) < 1e-13 * (fabs(g0) + fabs(g1)) || g[which] == 0) return s;
        if (g[which] < 0) { high = s, g1 = g[which]; if (side == -1) g0 /= 2; side = -1; }
        else { low = s, g0 = g[which]; if (side == 1) g1 /= 2; side = 1; }
    }
    return high;
}

/* -------------------------------------------------------------------------------------------------------- loop */

static void reached(Run *run, int rodas)
{
    Pump *u = &run->u;
    const int k = run->slot;
    if (rodas) run->force = rates_and_jacobian(u, &u->clock, k, u->x, run->f0, &run->J), run->count[JACOBIANS]++;
    else run->force = rates(u, &u->clock, k, u->x, run->f0), run->count[RATES]++;
}

static void clock_here(Run *run)
{
    const double t = run->u.t, times[FEW] = {t, t, t, t};
    set_clock(&run->u, FEW, times, &run->u.clock);
    run->slot = 0;
    run->count[CLOCKS]++;
}

/* The spool settles: rests where it stands on a stop and is not pulled off. */
static void spool_event(Run *run)
{
    Pump *u = &run->u;
    if (u->at == 0) {
        u->at = u->x[X] < (LOW_STOP + HIGH_STOP) / 2 ? -1 : 1;
        u->x[X] = u->at < 0 ? LOW_STOP : HIGH_STOP, u->x[V] = 0;
        run->kind = KIND_HITS, run->count[EVENTS]++;
        double dx[NX], force = rates(u, &u->clock, 0, u->x, dx);
        if (u->at * force >= 0 && force != 0) return;
        if (force == 0) return;
    }
    u->at = 0;
    run->kind = KIND_LEAVES, run->count[EVENTS]++;
}

static double share_of(double error) { return error > 0 ? 0.9 / sqrt(sqrt(error)) : 10; }

/* Integrate to task.stop. Returns 0, or 1: the step collapsed, 2: the Courant number exceeds 1. */
static int integrate(Run *run, const int use_rodas)
{
    Pump *u = &run->u;
    const Task *task = &run->task;
    double x1[NX], g0[GS], g1[GS];
    long *count = run->count;
    int fresh = 0;                              /* after a rejection the next step does not grow */
    clock_here(run);
    reached(run, use_rodas);
    if (u->at < 0 && run->force > 0) u->at = 0, reached(run, use_rodas);
    distances(run, u->x[PD], u->x[PS], u->x[X], u->x[V], g0);
    while (u->t < task->stop) {
        const double t_tick = (u->tick + 1) * TICK;
        const int next = u->segment + 1;
        const double t_gear = (u->pitches * PITCH + (next < SEGMENTS ? SEGMENT[next].begins : PITCH)) / u->omega;
        const double goal = MIN(task->stop, MIN(t_tick, t_gear)), left = goal - u->t;
        double h = run->h, error;
        int whole = 0, event = NO_KIND;
        if (left > 1e-15) {
            if (run->kind != NO_KIND && run->first[run->kind] > 0) h = run->first[run->kind];
            if (h >= left) h = left, whole = 1;
            else if (h > left / 2) h = left / 2;
            for (int sought = -1;;) {
                error = use_rodas ? rodas(run, h, x1) : dopri(run, h, x1);
                if (!(error <= 1)) {
                    count[REJECTED]++;
                    const double cut = error == error ? use_rodas ? share_of(error) : 0.9 * pow(error, -0.2) : 0;
                    h *= MIN(MAX(cut, 0.1), 0.9), whole = 0, fresh = 1, sought = -1;
                    if (h < 1e-15) return 1;
                    continue;
                }
                distances(run, x1[PD], x1[PS], x1[X], x1[V], g1);
                const double near_p = 0.1 * (task->atol[PD] + task->rtol * fabs(x1[PD]));
                const double near[GS] = {near_p, u->at == 0 ? 0.01 * task->atol[X] : near_p * SPOOL};
                int which = -1;
                double share = 2;
                event = NO_KIND;
                for (int i = 0; i < GS; i++) {
                    const int crossed = g1[i] < 0 && (g0[i] >= 0 || g1[i] < g0[i] - near[i]);
                    if ((crossed || i == sought) && fabs(g1[i]) < near[i]) { event = i; continue; }
                    if (!crossed) continue;
                    if (use_rodas) rodas_dense(run, x1); else dopri_dense(run, h, x1);
                    const double s = g0[i] > 0 ? root_share(run, i, g0[i], g1[i]) : 0.1;
                    if (s < share) share = s, which = i;
                }
                if (which < 0) break;
                h *= share, whole = 0, sought = which, count[REDONE]++;
            }
            /* accepted */
            count[STEPS]++;
            if (task->grid > 0) {
                int made = 0;
                for (double t; run->row < task->rows && (t = run->row * task->grid) < u->t + h; run->row++) {
                    if (!made) { if (use_rodas) rodas_dense(run, x1); else dopri_dense(run, h, x1); made = 1; }
                    task->delivery[run->row] = along(run, MAX(t - u->t, 0) / h, PD);
                }
            }
            double grown;
            if (use_rodas) grown = h * share_of(error);
            else {
                grown = h * (error > 0 ? MIN(0.9 * pow(error, -0.17) * pow(run->old_error, 0.04), 10) : 10);
                run->old_error = MAX(error, 1e-4);
            }
            if (run->kind != NO_KIND) run->first[run->kind] = MIN(grown, 6 * h);
            run->h = MIN(grown, MAX(6 * h, run->kind == NO_KIND ? run->h : 0));
            if (fresh) run->h = MIN(run->h, h), fresh = 0;
            run->kind = NO_KIND;
            u->t = whole ? goal : u->t + h;
            memcpy(u->x, x1, sizeof x1);
            run->slot = use_rodas ? 3 : 4;
        } else whole = 1, u->t = goal;

        /* what waits here */
        int stale = 0;
        if (event == G_COVER) {
            const double middle = COVER_KNOT[u->piece] / 2 + COVER_KNOT[MIN(u->piece + 1, COVER_PIECES - 1)] / 2;
            u->piece += u->piece + 1 < COVER_PIECES && (u->piece == 0 || u->x[PD] > middle) ? 1 : -1;
            run->kind = KIND_COVER, count[ROOTS]++, stale = 1;
        } else if (event == G_SPOOL) count[ROOTS]++, stale = 2;
        if (whole && goal == t_tick) {
            tick(u, run->slot);
            u->tick++, count[TICKS]++;
            if (u->courant > 1) return 2;
            stale |= 1;
        }
        if (whole && goal == t_gear) {
            if (next == SEGMENTS) u->pitches++;
            segment_begins(u, next % SEGMENTS);
            const Segment *s = SEGMENT + u->segment;
            if (u->segment == 0) u->x[PT] = u->x[PD], count[EVENTS] += 2;     /* meshes, appears */
            if (s->driver_closes) u->x[PR] = u->x[PS];
            if (s->driven_closes) u->x[PN] = u->x[PS];
            count[EVENTS] += s->driver_closes + s->driven_closes;
            run->kind = u->segment, count[STOPS]++, stale |= 1;
        }
        if (use_rodas || stale) {
            clock_here(run);
            if (stale & 2) spool_event(run);
            reached(run, use_rodas);
        } else memcpy(run->f0, run->k[6], sizeof run->f0);
        distances(run, u->x[PD], u->x[PS], u->x[X], u->x[V], g0);
    }
    if (task->grid > 0 && run->row < task->rows) task->delivery[run->row++] = u->x[PD];
    return 0;
}
