/* Eight numbers at once, in GCC's portable vectors: log, exp and the like without branches, to rounding. */

#include <math.h>
#include <stdint.h>
#include <string.h>

#define INLINE static inline __attribute__((always_inline))
#define LANES(n) __attribute__((aligned(64))) double n
#define SQR(a) ((a) * (a))
#define MAX(a, b) ((a) > (b) ? (a) : (b))
#define MIN(a, b) ((a) < (b) ? (a) : (b))

enum { WIDE = 8 };
typedef double Wide __attribute__((vector_size(64), may_alias));
typedef int64_t Whole __attribute__((vector_size(64), may_alias));

INLINE Wide load(const double *a) { return *(const Wide *)a; }
INLINE void store(double *a, Wide x) { *(Wide *)a = x; }
INLINE Wide all(double x) { return x - (Wide){0}; }
INLINE Wide choose(Whole mask, Wide a, Wide b) { return (Wide)((mask & (Whole)a) | (~mask & (Whole)b)); }
INLINE Wide larger(Wide a, Wide b) { return choose(a > b, a, b); }
INLINE Wide magnitude(Wide a) { return (Wide)((Whole)a & INT64_MAX); }

INLINE Wide root(Wide x)
{
    LANES(a[WIDE]);
    store(a, x);
    for (int i = 0; i < WIDE; i++) a[i] = sqrt(a[i]);
    return load(a);
}

INLINE double largest(Wide x)
{
    x = larger(x, __builtin_shuffle(x, (Whole){4, 5, 6, 7, 0, 1, 2, 3}));
    x = larger(x, __builtin_shuffle(x, (Whole){2, 3, 0, 1, 6, 7, 4, 5}));
    return MAX(x[0], x[1]);
}

INLINE int every(Whole mask)
{
    int64_t a = -1;
    for (int i = 0; i < WIDE; i++) a &= mask[i];
    return a != 0;
}

/* e^x for |x| < 700: x = n ln 2 + r, series of r to the 13th power. */
INLINE Wide exp_wide(Wide x)
{
    const double shift = 6755399441055744.0;       /* 1.5 2^52: adding it rounds to whole numbers */
    Wide n = x * 1.4426950408889634 + shift, whole = n - shift;
    Wide r = (x - whole * 0.693147180369123816490) - whole * 1.90821492927058770002e-10, r2 = r * r, r4 = r2 * r2;
    Wide a = (1.0 + r) + r2 * (1.0 / 2 + r * (1.0 / 6));
    Wide b = (1.0 / 24 + r * (1.0 / 120)) + r2 * (1.0 / 720 + r / 5040.0);
    Wide c = (1.0 / 40320 + r * (1.0 / 362880)) + r2 * (1.0 / 3628800 + r * (1.0 / 39916800));
    Wide d = 1.0 / 479001600 + r * (1.0 / 6227020800.0);
    return (Wide)((Whole)(a + r4 * (b + r4 * (c + r4 * d))) + ((Whole)n << 52));
}

/* ln x for normal x > 0: x = 2^n m, m within sqrt(2) of 1, series of s = (m - 1)/(m + 1). */
INLINE Wide log_wide(Wide x)
{
    Whole n = ((Whole)x - 0x3fe6a09e667f3bcd) >> 52;
    Wide m = (Wide)((Whole)x - (n << 52)), s = (m - 1.0) / (m + 1.0), s2 = s * s, s4 = s2 * s2;
    Wide a = (2.0 / 3 + s2 * (2.0 / 5)) + s4 * (2.0 / 7 + s2 * (2.0 / 9));
    Wide b = (2.0 / 11 + s2 * (2.0 / 13)) + s4 * (2.0 / 15 + s2 * (2.0 / 17)) + s4 * s4 * (2.0 / 19 + s2 * (2.0 / 21));
    return __builtin_convertvector(n, Wide) * 0.6931471805599453 + (2.0 * s + s * s2 * (a + s4 * s4 * b));
}
