/* Sparse LU of M = shift I - df/dx on a pattern known beforehand, without pivoting: row by row, a row at a time spread
 * over a dense vector. The order of elimination and the fill come from solvers/native.py.
 *
 * Pivots: with shift = 1/(gamma h) the diagonal outgrows the rest as h falls, so a step whose pivot vanishes is
 * rejected and tried shorter.
 */
#include <math.h>

#include "run.h"

/* Returns 0, or 1 if a pivot vanishes. */
int factorise(Run *r, double shift)
{
    double *const w = r->lu_work;
    const int64_t *const row = r->row, *const column = r->column;
    r->factorisations++;
    for (int64_t e = 0; e < row[r->n]; e++) r->lu[e] = 0;
    for (int64_t k = 0; k < r->nonzeros; k++) r->lu[r->place[k]] = -r->jacobian[k];
    for (int64_t i = 0; i < r->n; i++) r->lu[r->diagonal[i]] += shift;
    for (int64_t i = 0; i < r->n; i++) {
        for (int64_t e = row[i]; e < row[i + 1]; e++) w[column[e]] = r->lu[e];
        for (int64_t e = row[i]; e < r->diagonal[i]; e++) {
            const int64_t k = column[e];
            const double factor = w[k] *= r->inverse[k];
            for (int64_t u = r->diagonal[k] + 1; u < row[k + 1]; u++) w[column[u]] -= factor * r->lu[u];
        }
        for (int64_t e = row[i]; e < row[i + 1]; e++) r->lu[e] = w[column[e]];
        if (!(fabs(w[i]) > 1e-12 * shift)) return 1;
        r->inverse[i] = 1 / w[i];
    }
    return 0;
}

/* v <- M^-1 v */
void solve(const Run *r, double *v)
{
    double *const y = r->lu_work;
    const int64_t *const row = r->row, *const column = r->column;
    for (int64_t i = 0; i < r->n; i++) {
        double sum = v[r->order[i]];
        for (int64_t e = row[i]; e < r->diagonal[i]; e++) sum -= r->lu[e] * y[column[e]];
        y[i] = sum;
    }
    for (int64_t i = r->n - 1; i >= 0; i--) {
        double sum = y[i];
        for (int64_t e = r->diagonal[i] + 1; e < row[i + 1]; e++) sum -= r->lu[e] * y[column[e]];
        v[r->order[i]] = y[i] = sum * r->inverse[i];
    }
}
