/* RODAS: Rosenbrock method of order 4(3), six stages, L-stable and stiffly accurate, with the exact Jacobian.
 *
 *     M = I/(gamma h) - df/dx
 *     M u_i = f(t + c_i h, x + sum_j a_ij u_j) + sum_j (C_ij/h) u_j + h d_i df/dt,     x_new = x + sum_j m_j u_j
 *
 * The error estimate is u_6. Between, the polynomial of order 3 that comes with the method. Source of the coefficients:
 * Hairer & Wanner, Solving Ordinary Differential Equations II (1996), section IV.7 and the program RODAS.
 */
#include "run.h"

enum { STAGES = 6 };

static const double gamma_ = 0.25;
static const double c[STAGES] = {0, 0.386, 0.21, 0.63, 1, 1};
static const double d[STAGES] = {0.25, -0.1043, 0.1035, -0.0362, 0, 0};
static const double a[STAGES][STAGES] = {
    {0},
    {1.544},
    {0.9466785280815826, 0.2557011698983284},
    {3.314825187068521, 2.896124015972201, 0.9986419139977817},
    {1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950},
    {1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950, 1},
};
static const double C[STAGES][STAGES] = {
    {0},
    {-5.6688},
    {-2.430093356833875, -0.2063599157091915},
    {-0.1073529058151375, -9.594562251023355, -20.47028614809616},
    {7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160},
    {8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054},
};
static const double dense[2][STAGES - 1] = {
    {10.12623508344586, -7.487995877610167, -34.80091861555747, -7.992771707568823, 1.025137723295662},
    {-0.6762803392801253, 6.087714651680015, 16.43084320892478, 24.76722511418386, -6.594389125716872},
};

static double attempt(Run *r, double h)
{
    const int64_t n = r->n;
    if (!r->linearised) linearise(r, r->t, r->x);
    if (factorise(r, 1 / (gamma_ * h))) return 1 / 0.0;
    const double *f = r->lin_f;
    for (int s = 0; s < STAGES; s++) {
        double *const u = r->stages + s * n;
        if (s) {
            combine(n, r->work, r->x, 1, r->stages, a[s], s);
            f = rhs(r, r->t + c[s] * h, r->work);
        }
        for (int64_t i = 0; i < n; i++) u[i] = f[i] + h * d[s] * r->lin_t[i];
        combine(n, u, u, 1 / h, r->stages, C[s], s);
        solve(r, u);
    }
    const double *const error = r->stages + (STAGES - 1) * n;
    for (int64_t i = 0; i < n; i++) r->x_new[i] = r->work[i] + error[i];
    return error_norm(r, error);
}

static void finish(Run *r, double h)
{
    const int64_t n = r->n;
    double *const c0 = r->coef, *const c1 = c0 + n, *const c2 = c1 + n, *const c3 = c2 + n;
    for (int64_t i = 0; i < n; i++) c1[i] = c3[i] = 0;
    combine(n, c1, c1, 1, r->stages, dense[0], STAGES - 1);
    combine(n, c3, c3, 1, r->stages, dense[1], STAGES - 1);
    for (int64_t i = 0; i < n; i++) {
        const double bend0 = c1[i], bend1 = c3[i], rise = r->x_new[i] - r->x[i];
        c0[i] = r->x[i];
        c1[i] = rise + bend0;
        c2[i] = bend1 - bend0;
        c3[i] = -bend1;
        r->rate_new[i] = (rise - bend0 - bend1) / h;
    }
    r->rate_exact = 0;
}

const Method rodas = {attempt, finish, 4, 3};
