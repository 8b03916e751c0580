/* DOPRI: explicit Runge-Kutta method of order 5(4), seven stages of which the last is the first of the next step.
 *
 *     k_i = f(t + c_i h, x + h sum_j a_ij k_j),     x_new = x + h sum_j a_7j k_j
 *
 * Between, the polynomial of order 4. Source: Dormand & Prince, J. Comp. Appl. Math. 6 (1980) 19-26; Shampine, Some
 * practical Runge-Kutta formulas, Math. Comp. 46 (1986) 135-150.
 */
#include <math.h>
#include <string.h>

#include "run.h"

enum { STAGES = 7 };

/* Largest h |lambda|. Up to 3.3 the method is stable, but there what is fast is damped no more: its error stays, at some
 * ten tolerances, and what is slow adds it up. At 2.2 it shrinks to a fifth in each step, and between steps it is seen
 * at less than a tenth. */
static const double MOST_STIFF = 2.2;
static const double UNMOVED = 1e-6; /* of the tolerance: states that differ by less say nothing about f */

static const double c[STAGES] = {0, 1.0 / 5, 3.0 / 10, 4.0 / 5, 8.0 / 9, 1, 1};
static const double a[STAGES][STAGES - 1] = {
    {0},
    {1.0 / 5},
    {3.0 / 40, 9.0 / 40},
    {44.0 / 45, -56.0 / 15, 32.0 / 9},
    {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
    {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656},
    {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84},
};
static const double e[STAGES] = {
    -71.0 / 57600, 0, 71.0 / 16695, -71.0 / 1920, 17253.0 / 339200, -22.0 / 525, 1.0 / 40,
};
static const double dense[4][STAGES] = {
    {1},
    {-8048581381.0 / 2820520608, 0, 131558114200.0 / 32700410799, -1754552775.0 / 470086768,
     127303824393.0 / 49829197408, -282668133.0 / 205662961, 40617522.0 / 29380423},
    {8663915743.0 / 2820520608, 0, -68118460800.0 / 10900136933, 14199869525.0 / 1410260304,
     -318862633887.0 / 49829197408, 2019193451.0 / 616988883, -110615467.0 / 29380423},
    {-12715105075.0 / 11282082432, 0, 87487479700.0 / 32700410799, -10690763975.0 / 1880347072,
     701980252875.0 / 199316789632, -1453857185.0 / 822651844, 69997945.0 / 29380423},
};

/* |f(x_7) - f(x_6)|/|x_7 - x_6| at the end of the step [1/s], in shares of the tolerance: |lambda| of what is fastest
 * among what the step disturbs; 0 where it disturbs nothing. x_6 in r->work. */
static double fastest_rate(const Run *r)
{
    const double *const k6 = r->stages + 5 * r->n, *const k7 = k6 + r->n;
    double moved = 0, changed = 0;
    for (int64_t i = 0; i < r->n; i++) {
        const double scale = r->atol[i] + r->rtol * fabs(r->x_new[i]);
        const double dx = (r->x_new[i] - r->work[i]) / scale, df = (k7[i] - k6[i]) / scale;
        moved += dx * dx;
        changed += df * df;
    }
    return moved > UNMOVED * UNMOVED * r->n ? sqrt(changed / moved) : 0;
}

static double attempt(Run *r, double h)
{
    const int64_t n = r->n;
    double *const k = r->stages;
    memcpy(k, r->rate, n * sizeof *k);
    for (int s = 1; s < STAGES; s++) {
        double *const x = s < STAGES - 1 ? r->work : r->x_new;
        combine(n, x, r->x, h, k, a[s], s);
        memcpy(k + s * n, rhs(r, r->t + c[s] * h, x), n * sizeof *k);
    }
    r->rate_of_fastest = fastest_rate(r);
    memset(r->work, 0, n * sizeof *k);
    combine(n, r->work, r->work, h, k, e, STAGES);
    /* the smaller of two steps: the phase of an oscillation can make one much larger than its frequency */
    const double stiff = pow(h * fmin(r->rate_of_fastest, r->rate_of_fastest_last) / MOST_STIFF, dopri.order);
    const double error = error_norm(r, r->work);
    return stiff > error ? stiff : error; /* what is no number stays one */
}

static void finish(Run *r, double h)
{
    const int64_t n = r->n;
    memcpy(r->coef, r->x, n * sizeof *r->coef);
    memcpy(r->rate_new, r->stages + (STAGES - 1) * n, n * sizeof *r->rate_new);
    for (int p = 0; p < 4; p++) {
        double *const row = r->coef + (p + 1) * n;
        memset(row, 0, n * sizeof *row);
        combine(n, row, row, h, r->stages, dense[p], STAGES);
    }
    r->rate_exact = 1;
    r->rate_of_fastest_last = r->rate_of_fastest;
}

const Method dopri = {attempt, finish, 5, 4};
