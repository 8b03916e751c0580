/* What Python calls: a run, a look at the equations, the cost of each part, fixed steps. */

#include "loop.c"

static void to_own(const double *x, double *own)
{
    memcpy(own, x, NX * sizeof *own);
    own[Q1] = x[Q1] + x[Q2] / 2, own[Q2] = x[Q1] - x[Q2] / 2;
}

/* Set the pump to the circuit's states x and nodes p, q at t, standing in the given segment and pitch. */
static void place(Pump *u, double omega, double area, double diameter, double cd, double lambda, const double *x,
                  const double *p, const double *q)
{
    memset(u, 0, sizeof *u);
    u->omega = omega;
    const double k = ORIFICE_K(diameter, lambda);
    u->throttle_c = ORIFICE_C(area, cd, k), u->throttle_k2 = SQR(k);
    to_own(x, u->x);
    for (int i = 0; i < PAD; i++) u->p_node[i] = i < NODES ? p[i] : p[0], u->q_node[i] = i < NODES ? q[i] : 0;
    u->at = x[X] <= LOW_STOP ? -1 : x[X] >= HIGH_STOP ? 1 : 0;
    while (u->piece + 1 < COVER_PIECES && x[PD] > COVER_KNOT[u->piece + 1]) u->piece++;
    segment_begins(u, 0);
    nodes_changed(u);
}

static Run run;                                 /* the last one, kept for the measurements below */

/* point: omega, throttle's area, diameter, C_d, lambda_c. Fills delivery and counts, returns seconds or -1, -2. */
double limit_run(const double *point, const double *x, const double *p, const double *q, const double *atol,
                 double rtol, int use_rodas, double stop, double grid, double *delivery, long rows, long *count)
{
    struct timespec begun, done;
    memset(&run, 0, sizeof run);
    clock_gettime(CLOCK_MONOTONIC, &begun);
    place(&run.u, point[0], point[1], point[2], point[3], point[4], x, p, q);
    run.task = (Task){.rtol = rtol, .stop = stop, .grid = grid, .delivery = delivery, .rows = rows};
    memcpy(run.task.atol, atol, sizeof run.task.atol);
    run.h = 1e-6, run.kind = NO_KIND, run.old_error = 1e-4;
    int failed = use_rodas ? integrate(&run, 1) : integrate(&run, 0);
    clock_gettime(CLOCK_MONOTONIC, &done);
    memcpy(count, run.count, sizeof run.count);
    if (failed) return -failed;
    return (done.tv_sec - begun.tv_sec) + 1e-9 * (done.tv_nsec - begun.tv_nsec);
}

static void spread(const Jacobian *J, double *m)
{
#define AT(i, j, value) m[(i) * NX + (j)] = (value)
    AT(PD, PD, J->dd), AT(PD, PS, J->ds), AT(PD, PA, J->da), AT(PD, PR, J->dr), AT(PD, PN, J->dn), AT(PD, X, J->dx);
    AT(PD, V, J->dv), AT(PD, Q1, J->dq), AT(PS, PD, J->sd), AT(PS, PS, J->ss), AT(PS, PA, J->sa), AT(PS, PR, J->sr);
    AT(PS, PN, J->sn), AT(PS, X, J->sx), AT(PS, V, J->sv), AT(PT, PT, J->tt), AT(PT, PA, J->ta), AT(PA, PD, J->ad);
    AT(PA, PS, J->as), AT(PA, PT, J->at), AT(PA, PA, J->aa), AT(PA, PR, J->ar), AT(PR, PD, J->rd), AT(PR, PS, J->rs);
    AT(PR, PA, J->ra), AT(PR, PR, J->rr), AT(PN, PD, J->nd), AT(PN, PS, J->ns), AT(PN, PN, J->nn), AT(X, V, 1);
    AT(V, PD, J->vd), AT(V, PS, J->vs), AT(V, X, J->vx), AT(V, V, J->vv), AT(Q1, PD, J->qd), AT(Q1, Q1, J->qq);
    AT(Q1, PC, J->qc), AT(PC, Q1, J->cq), AT(PC, PC, J->cc), AT(PC, Q2, J->cw), AT(Q2, PC, J->wc), AT(Q2, Q2, J->ww);
    AT(Q2, PF, J->wf), AT(PF, Q2, J->fw), AT(PF, PF, J->ff), AT(IA, PF, J->af), AT(PB, PB, J->bb), AT(IB, PB, J->ib);
}

/* For checks: at the circuit's state x and held values (place: t, segment, pitches, at, t_node, had_a, had_b), own
coordinates: f, df/dx, df/dt, the solution of (I g - df/dx) y = f, and the nodes after a tick. */
void limit_look(const double *point, const double *x, const double *p, const double *q, const double *where, double g,
                double *f, double *J, double *ft, double *y, double *p_new, double *q_new)
{
    Pump *u = &run.u;
    memset(&run, 0, sizeof run);
    place(u, point[0], point[1], point[2], point[3], point[4], x, p, q);
    u->t = where[0], u->pitches = (long)where[2], u->at = (int)where[3];
    u->t_node = where[4], u->had_a = where[5], u->had_b = where[6];
    segment_begins(u, (int)where[1]);
    clock_here(&run);
    rates_and_jacobian(u, &u->clock, 0, u->x, f, &run.J);
    spread(&run.J, J);
    memcpy(ft, run.J.t, sizeof run.J.t);
    Factors F;
    factor(u, &run.J, g, &F);
    memcpy(y, f, NX * sizeof *y);
    solve(&F, 1 / g, y);
    tick(u, 0);
    memcpy(p_new, u->p_node, NODES * sizeof *p_new);
    memcpy(q_new, u->q_node, NODES * sizeof *q_new);
}

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
}

/* Nanoseconds of each part where the last run ended, best of many: f, f with J, clock of Rodas, of Dormand-Prince,
LU, solve, a tick. */
void limit_costs(double *costs)
{
    static Pump kept;
    static Clock clock;
    Pump *u = &run.u;
    Jacobian J = {0};
    Factors F;
    double dx[NX], y[NX], t[SLOTS];
    u->had_a = u->x[IA] - u->q_node[0] * TICK, u->had_b = u->x[IB] + u->q_node[NODES - 1] * TICK;
    for (int k = 0; k < SLOTS; k++) t[k] = u->t;
    clock_here(&run);
    rates_and_jacobian(u, &u->clock, 0, u->x, dx, &J);
    kept = *u;
#define KEEP(p) __asm__ volatile("" ::"r"(p) : "memory")
#define COST(k, many, code) \
    costs[k] = INFINITY; \
    for (int r = 0; r < 25; r++) { \
        const double begun = now(); \
        for (int i = 0; i < (many); i++) { code; KEEP(dx); KEEP(y); KEEP(&F); KEEP(&clock); } \
        costs[k] = MIN(costs[k], 1e9 * (now() - begun) / (many)); \
    }
    COST(0, 2000, rates(u, &u->clock, 0, u->x, dx))
    COST(1, 2000, rates_and_jacobian(u, &u->clock, 0, u->x, dx, &J))
    COST(2, 2000, set_clock(u, FEW, t, &clock))
    COST(3, 2000, set_clock(u, SLOTS, t, &clock))
    COST(4, 2000, factor(u, &J, 1e5, &F))
    COST(5, 2000, (memcpy(y, dx, sizeof y), solve(&F, 1e-5, y)))
    COST(6, 1000, (*u = kept, tick(u, 0)))
    COST(7, 1000, (*u = kept))
    costs[6] -= costs[7];
}

/* The state after `steps` equal steps over `span` from where the last run ended, without stops: to see the order. */
void limit_fixed(int use_rodas, int steps, double span, double *x)
{
    static Run copy;
    double x1[NX];
    copy = run;
    const double begun = copy.u.t;
    for (int i = 0; i < steps; i++) {
        clock_here(&copy);
        reached(&copy, use_rodas);
        if (use_rodas) rodas(&copy, span / steps, x1); else dopri(&copy, span / steps, x1);
        memcpy(copy.u.x, x1, sizeof x1);
        copy.u.t = begun + span * (i + 1) / steps;
    }
    memcpy(x, copy.u.x, sizeof copy.u.x);
}
