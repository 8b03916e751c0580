/* One run of a hybrid system: everything the compiled loop reads and writes.
 *
 *     dx/dt = f(t, x, h, b),   relations g(t, x, h, b) <> 0 frozen in the bits b,   events that set x and h
 *
 * x states, h held values, b bits; functions.py makes f and its companions. Python allocates every array and mirrors this
 * structure by reading this file (solvers/native.py): each field is one line, 8 bytes wide, its comment says the shape.
 * All functions read the same inputs (t_in, x_in, h, b, v_in, flags) and write the outputs named beside them.
 */
#ifndef CRESCENTLAB_RUN_H
#define CRESCENTLAB_RUN_H

#include <stdint.h>

typedef struct Run {
    /* sizes */
    int64_t n; /* states */
    int64_t n_held; /* held values */
    int64_t n_bits; /* relations */
    int64_t n_events; /* events */
    int64_t n_conditions; /* events that have a condition */
    int64_t n_ticks; /* events that tick */
    int64_t n_watched; /* relations on states */
    int64_t n_linear; /* relations linear in time */
    int64_t n_angles; /* states that are angles */
    int64_t n_pace; /* points of the pace, 0 without one */
    int64_t n_schedules; /* held vectors that follow a schedule */

    /* functions of the system, and how to call one: trigger(function) */
    void *trigger; /* void (*)(void *) */
    void *rhs; /* -> fx */
    void *linear; /* -> lin_f, jacobian, lin_t */
    void *relation; /* -> g, g_rate, g_scale */
    void *watch; /* -> w, w_rate, w_scale: the relations on states alone */
    void *condition; /* -> conditions */
    void *remap; /* -> new_x, new_h; all events */
    void *remap_ticks; /* the same, ticks alone */
    void *remap_events; /* the same, without ticks */

    /* their inputs */
    double *t_in; /* (1) */
    double *x_in; /* (n) */
    double *h; /* (n_held) held values as they are */
    double *b; /* (n_bits) bits as they are, 0 or 1 */
    double *v_in; /* (n) dx/dt, for rates of relations */
    double *flags; /* (n_events) 1 where an event fires */

    /* their outputs */
    double *fx; /* (n) */
    double *lin_f; /* (n) */
    double *jacobian; /* (nonzeros) df/dx by columns */
    double *lin_t; /* (n) df/dt */
    double *g; /* (n_bits) */
    double *g_rate; /* (n_bits) */
    double *g_scale; /* (n_bits) magnitude of both sides */
    double *w; /* (n_watched) */
    double *w_rate; /* (n_watched) */
    double *w_scale; /* (n_watched) */
    double *conditions; /* (n_conditions) */
    double *new_x; /* (n) */
    double *new_h; /* (n_held) */

    /* what is known of relations and events */
    int64_t *strict; /* (n_bits) */
    int64_t *watched; /* (n_watched) places among the relations */
    int64_t *switches; /* (n_watched) 1: chooses a value, 0: serves conditions of events alone */
    int64_t *wave; /* (n_watched) 1: may swing several times within a step */
    int64_t *time_linear; /* (n_linear) places among the relations */
    int64_t *rising; /* (n_conditions) events */
    int64_t *ticking; /* (n_ticks) events */
    int64_t *kind; /* (n_events) WHEN, EVERY, FAIL, STOP */
    int64_t *holds; /* (n_conditions) whether the condition held before */
    double *period; /* (n_ticks) */
    double *origin; /* (n_ticks) time from which they are counted */
    int64_t *ticked; /* (n_ticks) */
    int64_t *due; /* (n_ticks) */
    int64_t *angles; /* (n_angles) states */
    double *schedule_times; /* (rows of all schedules) from when on each row holds */
    double *schedule_rows; /* (rows of all schedules, schedule_width) */
    int64_t schedule_width; /* of the widest */
    int64_t *schedule_at; /* (n_schedules) present row */
    int64_t *schedule_last; /* (n_schedules) last row */
    int64_t *schedule_place; /* (n_schedules) first place among the held values */
    int64_t *schedule_size; /* (n_schedules) number of places */
    int64_t curved; /* relations that curve in time: Python finds their roots */
    int64_t curved_held; /* whether those depend on held values or bits */
    double curved_next; /* the next of their roots */

    /* the task */
    int64_t method; /* RODAS or DOPRI */
    double start;
    double stop;
    double rtol;
    double *atol; /* (n) */
    double step_cap; /* longest step */
    double angle_step; /* furthest a step turns an angle [rad] */
    double *pace_t; /* (n_pace) times ... */
    double *pace_s; /* (n_pace) ... and how far values on time alone have swung until then */
    double clock_swing; /* furthest they swing in a step */
    double tolerance; /* how closely roots are located [s] */
    double *floor; /* (n) lowest possible states */
    double *held_floor; /* (n_held) lowest possible held values */
    double restart_share; /* of the tolerance: a smaller change of f over a step is none */

    /* where it stands */
    int64_t begun;
    int64_t finished; /* by an event of kind STOP */
    int64_t rescan; /* roots of curved relations may have changed */
    int64_t culprit; /* relation, event, state that a failure names */
    double t;
    double *x; /* (n) */
    double *rate; /* (n) dx/dt */
    double goal; /* no step beyond */
    double step; /* proposed */
    double *side; /* (n_watched) +1 where the bit is true, -1 where false */
    double *before; /* (n_watched) distance from turning at t */
    double *slope; /* (n_watched) its rate */
    double *slope_last; /* (n_watched) its rate one step earlier */
    double *first_step; /* (n_events) accepted first after each event, 0 unknown */
    int64_t tiny; /* tiny steps in a row */
    int64_t last_event; /* whose first step is due, -1 none */
    int64_t jumped; /* whether the last stop changed states */
    int64_t switched; /* whether it changed held values or bits */
    double *recent; /* (n_events, ZENO_COUNT) last times of each event */
    int64_t *fired; /* (n_events) how often it fired */
    int64_t *storm_last; /* (n_events + n_bits) steps when each last turned */
    int64_t *storm_row; /* (n_events + n_bits) turns in a row with fewer than storm_steps between */
    int64_t storm_steps;
    int64_t storm_count; /* so many are a storm, and stay one */
    double zeno_span; /* this many firings within this time are endless */

    /* scratch of the loop */
    double *want; /* (n_bits) */
    double *fastest; /* (n_bits) largest rate of each relation while settling */
    double *after; /* (n_watched) */
    double *slope_new; /* (n_watched) */
    double *band; /* (n_watched) roundoff of the distances */
    unsigned char *seen; /* (MAX_SETTLING, n_bits) */

    /* the method's candidate step from (t, x), and its polynomial: x(theta) = sum coef_j theta^j */
    double *x_new; /* (n) */
    double *rate_new; /* (n) dx/dt at its end */
    int64_t rate_exact; /* whether that is f itself */
    int64_t linearised; /* whether jacobian and lin_t are those of (t, x) */
    double *coef; /* (degree + 1, n) */
    double *stages; /* (stages, n) */
    double *work; /* (n) */
    double rate_of_fastest; /* explicit methods: |lambda| of what is fastest in the candidate ... */
    double rate_of_fastest_last; /* ... and in the step before */

    /* static sparse LU of I/(gamma h) - df/dx, rows in elimination order (lu.c) */
    int64_t *row; /* (n + 1) first entry of each row */
    int64_t *column; /* (entries) ascending within a row */
    int64_t *diagonal; /* (n) entry of the diagonal */
    int64_t *place; /* (nonzeros) entry of each nonzero of the Jacobian */
    int64_t nonzeros;
    int64_t *order; /* (n) state eliminated k-th */
    double *lu; /* (entries) */
    double *inverse; /* (n) of the pivots */
    double *lu_work; /* (n) */

    /* what was recorded since Python last looked */
    int64_t rows_max;
    int64_t rows;
    double *row_t; /* (rows_max) */
    double *row_x; /* (rows_max, n) */
    int64_t *row_jump; /* (rows_max) 1: the values after an event */
    int64_t *row_world; /* (rows_max) held values and bits then */
    int64_t pieces; /* (rows_max at most) accepted steps */
    double *piece_low; /* (rows_max) */
    double *piece_high; /* (rows_max) */
    double *piece_coef; /* (rows_max, degree + 1, n) */
    int64_t *piece_world; /* (rows_max) */
    int64_t worlds;
    double *world_h; /* (rows_max, n_held) */
    double *world_b; /* (rows_max, n_bits) */
    int64_t logs;
    int64_t logs_max;
    double *log_t; /* (logs_max) */
    int64_t *log_event; /* (logs_max) */

    /* counts */
    int64_t steps;
    int64_t rejected;
    int64_t evaluations;
    int64_t jacobians;
    int64_t factorisations;
    int64_t events;
    int64_t ticks;
    int64_t restarts;
    int64_t *limited; /* (n) attempts in which the state's scaled error was the largest */
} Run;

enum { WHEN, EVERY, FAIL, STOP }; /* kinds of events */
enum { RODAS, DOPRI }; /* methods */

/* why advance() came back */
enum {
    PAUSED, /* Python empties the records and calls again */
    DONE,
    STOPPED, /* by an event of kind STOP */
    NEEDS_ROOT, /* Python finds curved_next and calls again */
    FAILED, /* event culprit of kind FAIL */
    UNSETTLED, /* both sides push towards the boundary of relation culprit */
    RESTLESS, /* the relations do not settle */
    ENDLESS, /* events keep causing each other at one instant */
    ZENO, /* event culprit happens faster and faster */
    COLLAPSED, /* no step is small enough */
    NOT_FINITE, /* f, or x or h after an event */
    IMPOSSIBLE, /* state culprit is below its floor within the last step */
    IMPOSSIBLE_HELD /* held value culprit is below its floor */
};

enum { MAX_ROUNDS = 40, MAX_SETTLING = 200, ZENO_COUNT = 60, MAX_DEGREE = 4 };

/* methods: a candidate step of length h into x_new; its error, 1 being just acceptable, or what is not finite */
typedef double Attempt(Run *r, double h);
/* methods: its polynomial into coef, and dx/dt at its end into rate_new */
typedef void Finish(Run *r, double h);

typedef struct Method {
    Attempt *attempt;
    Finish *finish;
    int order; /* of the error estimate, plus one: step ~ error^(-1/order) */
    int degree; /* of the polynomial */
} Method;

extern const Method rodas, dopri;

const double *rhs(Run *r, double t, const double *x);
void linearise(Run *r, double t, const double *x);
double error_norm(const Run *r, const double *error);
void combine(int64_t n, double *to, const double *from, double factor, const double *rows, const double *weights, int count);
int factorise(Run *r, double shift);
void solve(const Run *r, double *v);

#endif
