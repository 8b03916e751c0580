/* exp, log and pow of many numbers at once, in GCC's and Clang's portable vectors: within two units in the last place of
 * the C library's, which takes over where an argument is out of the ordinary (not finite, subnormal, too large a result).
 */
#include <float.h>
#include <math.h>
#include <stdint.h>

#ifndef CRESCENTLAB_WIDE_H
#define CRESCENTLAB_WIDE_H

enum { WIDE = 8 };
typedef double Wide __attribute__((vector_size(64)));
typedef int64_t Whole __attribute__((vector_size(64)));

static inline int every(Whole mask)
{
    return (mask[0] & mask[1] & mask[2] & mask[3] & mask[4] & mask[5] & mask[6] & mask[7]) != 0;
}

/* x = n ln 2 + r, |r| <= ln 2 / 2; e^r by its series to r^13 */
static inline Wide exp_ordinary(Wide x)
{
    const double shift = 6755399441055744.0; /* 1.5 2^52: adding it rounds to a whole number */
    const Wide shifted = x * 1.4426950408889634 + shift, n = shifted - shift;
    const Wide r = (x - n * 0.693147180369123816490) - n * 1.90821492927058770002e-10;
    Wide sum = r * (1.0 / 6227020800) + 1.0 / 479001600;
    sum = sum * r + 1.0 / 39916800;
    sum = sum * r + 1.0 / 3628800;
    sum = sum * r + 1.0 / 362880;
    sum = sum * r + 1.0 / 40320;
    sum = sum * r + 1.0 / 5040;
    sum = sum * r + 1.0 / 720;
    sum = sum * r + 1.0 / 120;
    sum = sum * r + 1.0 / 24;
    sum = sum * r + 1.0 / 6;
    sum = sum * r + 0.5;
    return (Wide)((Whole)(1.0 + (r + r * r * sum)) + ((Whole)shifted << 52));
}

/* x = 2^n (1 + f), 1 + f within sqrt(2) of 1; log(1 + f) = f - f^2/2 + s (f^2/2 + R), s = f/(2 + f) */
static inline Wide log_ordinary(Wide x)
{
    const Whole n = ((Whole)x - 0x3fe6a09e667f3bcd) >> 52;
    const Wide whole = __builtin_convertvector(n, Wide);
    const Wide f = (Wide)((Whole)x - (n << 52)) - 1.0, s = f / (2.0 + f), z = s * s, half = 0.5 * f * f;
    Wide sum = z * (2.0 / 21) + 2.0 / 19;
    sum = sum * z + 2.0 / 17;
    sum = sum * z + 2.0 / 15;
    sum = sum * z + 2.0 / 13;
    sum = sum * z + 2.0 / 11;
    sum = sum * z + 2.0 / 9;
    sum = sum * z + 2.0 / 7;
    sum = sum * z + 2.0 / 5;
    sum = sum * z + 2.0 / 3;
    return whole * 0.693147180369123816490 - ((half - (s * (half + z * sum) + whole * 1.90821492927058770002e-10)) - f);
}

static inline Whole ordinary_exponent(Wide x) { return (x > -700.0) & (x < 700.0); }
static inline Whole ordinary(Wide x) { return (x >= DBL_MIN) & (x <= DBL_MAX); }

static inline Wide exp_wide(Wide x)
{
    Wide y = exp_ordinary(x);
    if (__builtin_expect(!every(ordinary_exponent(x)), 0))
        for (int i = 0; i < WIDE; i++) y[i] = exp(x[i]);
    return y;
}

static inline Wide log_wide(Wide x)
{
    Wide y = log_ordinary(x);
    if (__builtin_expect(!every(ordinary(x)), 0))
        for (int i = 0; i < WIDE; i++) y[i] = log(x[i]);
    return y;
}

static inline Wide pow_wide(Wide x, Wide p)
{
    const Wide e = p * log_ordinary(x);
    Wide y = exp_ordinary(e);
    if (__builtin_expect(!every(ordinary(x) & ordinary_exponent(e)), 0))
        for (int i = 0; i < WIDE; i++) y[i] = pow(x[i], p[i]);
    return y;
}

#endif
