/* The crescent pump of circuits/crescent_pump.yaml as flat equations, written by hand for speed.

Same equations, states and held values as the assembled circuit, in SI; symbols as in the components' docstrings.
What makes it fast, none of it an approximation beyond rounding:

- only what lives is computed: the trapped volume, the chains' volumes and the spool have flags, closed gaps no code;
- kinematic viscosity is constant, so a gap's mass flow is K dp, whatever the density;
- the oil law is evaluated for all pressures at once, in loops the compiler turns into vector code;
- volumes and the waves arriving at the line's ends depend on time alone, so all stages of a step share one loop;
- the Jacobian is written out beside the flows, sharing their terms; constants fold at compile time;
- powers of the oil law come from a table with a series round each entry, to rounding, so that no call is left;
- the angle is phi = omega t and the duct has its two flows q_1, q_2 as states (the circuit: mean and difference).

One text gives f alone and f with its derivatives: `equations` is inlined twice, `J` null or not.

By hand and not generated from expressions, because that is much faster: C that CasADi generates from the circuit's own
expressions evaluates both sides of every choice, one number at a time through the library's exp and pow. It took
1680 ns for f and 2830 ns for df/dx. These equations took 890 ns for f one number at a time through the same calls;
as they stand here 170 ns for f, 270 ns for f with df/dx, and 140 ns per step for what time alone decides. */

#include "parameters.h"
#include "vector.h"

/* States; Q1, Q2 stand for the circuit's mean and difference of the duct's flows. */
enum { PHI, PD, PS, PT, PA, PR, PN, X, V, PC, Q1, Q2, PF, IA, IB, PB, NX };
enum { NODES = 11, CELLS = NODES - 1, PAD = 16 };
enum { SLOTS = 8, FEW = 4 };    /* times kept by the clock; Rodas needs but four */

/* ---------------------------------------------------------------------------------------------------------- oil */

/* v = rho_l/rho [-] and its derivatives: aerated oil, Henry's and the polytropic law, as the circuit rounds them. */
static __attribute__((noinline)) void oil_anywhere(const double *p, double *v, double *v1, double *v2)
{
    const double span = SATURATION_PRESSURE - ATMOSPHERE, w = DISSOLUTION_ROUNDING, m = MINIMUM_PRESSURE;
    const double kappa = 1 / POLYTROPIC_INDEX;
    for (int i = 0; i < WIDE; i++) {
        double bare = p[i] + ATMOSPHERE, root = sqrt(bare * bare + 4 * m * m), large = (fabs(bare) + root) / 2;
        double P = bare > 0 ? large : m * m / large, over = 1 / P;
        double z = (SATURATION_PRESSURE - P) / span;
        double x = z > w ? z : z > 0 ? z * z * (2 * w - z) / (w * w) : 0;
        double dx = -(z > w ? 1 : z > 0 ? z * (4 * w - 3 * z) / (w * w) : 0) / span;
        double ddx = (z > w ? 0 : z > 0 ? (4 * w - 6 * z) / (w * w) : 0) / (span * span);
        double liquid = exp(-p[i] / LIQUID_MODULUS);
        double gas = AIR_FRACTION / (1 - AIR_FRACTION) * pow(P / ATMOSPHERE, -kappa);
        double slope = dx - kappa * x * over, curve = ddx - kappa * over * (dx + slope - x * over), dP = P / root;
        v[i] = liquid + gas * x;
        v1[i] = gas * slope * dP - liquid / LIQUID_MODULUS;
        v2[i] = gas * (curve * dP * dP + slope * P * (root - bare) / (root * root * root))
                + liquid / SQR(LIQUID_MODULUS);
    }
}

/* The same to rounding between LOWEST and HIGHEST, without a call or a division: the power of P from the nearest of 32
values per octave and a binomial series, 1/P likewise, the rounding of P and the liquid's exponential from series. */
#define LOWEST (0.25 * ATMOSPHERE - ATMOSPHERE)
#define HIGHEST 3e7
enum { OCTAVE = 32, FIRST = 0x3ff + 14, TABLE = 12 * OCTAVE };
static double CENTRE[TABLE], POWER[TABLE];      /* 1/P and the gas's volume at the middle of each interval */

static __attribute__((constructor)) void fill_table(void)
{
    for (int i = 0; i < TABLE; i++) {
        double P = ldexp(1 + (i % OCTAVE + 0.5) / OCTAVE, 14 + i / OCTAVE);
        CENTRE[i] = 1 / P;
        POWER[i] = AIR_FRACTION / (1 - AIR_FRACTION) * pow(P / ATMOSPHERE, -1 / POLYTROPIC_INDEX);
    }
}

INLINE void oil_wide(int order, const double *pressure, double *v, double *v1, double *v2)
{
    const double span = SATURATION_PRESSURE - ATMOSPHERE, m = MINIMUM_PRESSURE, k = 1 / POLYTROPIC_INDEX;
    const Wide p = load(pressure), bare = p + ATMOSPHERE;
    const Whole bits = (Whole)bare, inside = (p >= LOWEST) & (p <= HIGHEST);
    if (__builtin_expect(!every(inside), 0)) {
        LANES(first[WIDE]); LANES(second[WIDE]);
        oil_anywhere(pressure, v, order > 0 ? v1 : first, order > 1 ? v2 : second);
        return;
    }
    const Whole place = (bits >> 47) - ((int64_t)FIRST * OCTAVE);
    Wide centre, power;
    for (int i = 0; i < WIDE; i++) centre[i] = CENTRE[place[i]], power[i] = POWER[place[i]];
    Wide t = bare * centre - 1.0, t2 = t * t, t4 = t2 * t2;
    const Wide over_bare = centre * (((1.0 - t) + t2 * (1.0 - t)) + t4 * ((1.0 - t) + t2 * (1.0 - t) + t4 * (1.0 - t)));
    const Wide e = SQR(2 * m * over_bare);
    /* P = bare (1 + sqrt(1 + e))/2 */
    const Wide P = bare * (1.0 + e * (0.25 - e * (1.0 / 16 - e / 32.0)));
    const Wide over = over_bare * (1.0 - e * (0.25 - e * (0.125 - e * (5.0 / 64))));
    t = P * centre - 1.0, t2 = t * t, t4 = t2 * t2;
#define B1 (-k)
#define B2 (B1 * (-k - 1) / 2)
#define B3 (B2 * (-k - 2) / 3)
#define B4 (B3 * (-k - 3) / 4)
#define B5 (B4 * (-k - 4) / 5)
#define B6 (B5 * (-k - 5) / 6)
#define B7 (B6 * (-k - 6) / 7)
#define B8 (B7 * (-k - 7) / 8)
#define B9 (B8 * (-k - 8) / 9)
    const Wide low = 1.0 + t * B1 + t2 * (B2 + t * B3), high = B4 + t * B5 + t2 * (B6 + t * B7);
    const Wide gas = power * (low + t4 * (high + t4 * (B8 + t * B9)));
    const Wide z = p * (-1 / LIQUID_MODULUS), z2 = z * z;
    const Wide sixth = (1.0 / 24 + z * (1.0 / 120)) + z2 * (1.0 / 720 + z * (1.0 / 5040));
    const Wide liquid = (1.0 + z) + z2 * ((1.0 / 2 + z * (1.0 / 6)) + z2 * sixth);
    const Wide x = (SATURATION_PRESSURE - P) * (1 / span);
    store(v, liquid + gas * x);
    if (order > 0) {
        const Wide slope = -1 / span - k * x * over, dP = 1.0 - e * (0.25 - e * (3.0 / 16 - e * (5.0 / 32)));
        store(v1, gas * slope * dP - liquid * (1 / LIQUID_MODULUS));
        if (order > 1) {
            const Wide curve = -k * over * (slope - 1 / span - x * over), ddP = 0.5 * e * over_bare * (1.0 - 1.5 * e);
            store(v2, gas * (curve * dP * dP + slope * ddP) + liquid * (1 / SQR(LIQUID_MODULUS)));
        }
    }
}

INLINE void oil(int n, int order, const double *p, double *v, double *v1, double *v2)
{
    for (int i = 0; i < n; i += WIDE) oil_wide(order, p + i, v + i, v1 ? v1 + i : 0, v2 ? v2 + i : 0);
}

/* ------------------------------------------------------------------------------------------------------- friction */

/* Churchill's friction factor times Reynolds number for smooth walls, and its slope over ln Re if wanted. In laminar
flow the turbulent term t and its a are small: where t < 1e-4, a < 5e-5, and roots and quotients are their series. */
INLINE void churchill(int n, const double *reynolds, double *factor, double *slope)
{
    for (int i = 0; i < n; i += WIDE) {
        const Wide re = load(reynolds + i), r = larger(re, all(8)), l = log_wide(r / 7.0);
        const Wide y = r / 37530.0, y2 = y * y, y4 = y2 * y2, y8 = y4 * y4, r4 = SQR(SQR(r / 8.0));
        const Wide b = 2.457 * 0.9 * y, bl = b * l, b2 = bl * bl, b4 = b2 * b2, b8 = b4 * b4;
        const Wide a15 = b8 * b4 * b2 * bl, a = a15 * bl, bare = SQR(r4) * r4 * SQR(y8) * y8;
        const Wide series = bare * (1.0 - a * (1.5 - a * (15.0 / 8 - a * (35.0 / 16))));
        if (__builtin_expect(largest(bare) < 1e-4, 1)) {
            const Wide t = series, f = 64.0 + t * (64.0 / 12) * (1.0 - t * (11.0 / 24) * (1.0 - t * (23.0 / 36)));
            store(factor + i, f);
            const Wide rise = 3.0 - 2.0 * (a + b * a15) * (1.0 - a * (1.0 - a));
            if (slope) store(slope + i, f * t * (1.0 - t * (1.0 - t)) * rise);
        } else {
            const Wide over = 1.0 / (a + 1.0), t = bare * over * root(over);
            const Wide f = 64.0 * exp_wide(log_wide(1.0 + t) / 12.0);
            store(factor + i, f);
            if (slope) store(slope + i, f * t / (1.0 + t) * (3.0 - 2.0 * (a + b * a15) * over));
        }
    }
}

/* ---------------------------------------------------------------------------------------- what time alone decides */

/* At each time of a step (its stages): volumes [m^3], their rates and those of the rates; waves arriving at ends. */
typedef struct {
    LANES(Vd[SLOTS]); LANES(dVd[SLOTS]); LANES(ddVd[SLOTS]);
    LANES(Vs[SLOTS]); LANES(dVs[SLOTS]); LANES(ddVs[SLOTS]);
    LANES(Vt[SLOTS]); LANES(dVt[SLOTS]); LANES(ddVt[SLOTS]);
    LANES(pw[PAD]); LANES(qf[PAD]); LANES(zf[PAD]);       /* p_w, q and Z at the foot, by end and slot */
    LANES(dpw[PAD]); LANES(dqf[PAD]); LANES(dzf[PAD]);    /* their rates */
    int stride;                                           /* slots per end */
} Clock;

typedef struct {
    double t, x[NX];
    double omega, throttle_c, throttle_k2;      /* operating point */
    int segment; long pitches;                  /* where the gears stand */
    int at;                                     /* spool: -1 low stop, 0 free, 1 high stop */
    int piece;                                  /* of the cover's curve */
    int trapped, driver, driven;                /* which of the volumes exist */
    double Vd0, Vs0;                            /* constant part of the volumes in this segment */
    long tick; double t_node, had_a, had_b;     /* line */
    LANES(p_node[PAD]); LANES(q_node[PAD]);
    LANES(v_node[PAD]); LANES(v1_node[PAD]); LANES(v2_node[PAD]);
    double p_0[2], p_rise[2], q_0[2], q_rise[2], a_0[2], a_rise[2];     /* at the ends, and towards the neighbours */
    double courant;
    Clock clock;
} Pump;

static const double BORE = M_PI / 4 * SQR(LINE_DIAMETER), DX = LINE_LENGTH / CELLS;
#define SWELL (RHO_0 / LIQUID_DENSITY)      /* rho_0/rho = SWELL v */
#define ENTRY_LOSS (LINE_LOSS * RHO_0 * SWELL / (2 * BORE * BORE))   /* times v at the end: K rho v^2/2 over q^2 */
#define IMPEDANCE (RHO_0 / (BORE * sqrt(LIQUID_DENSITY)))           /* Z = IMPEDANCE v / sqrt(-v') */
#define LINE_RE (RHO_0 * LINE_DIAMETER / (BORE * LIQUID_DENSITY * VISCOSITY))
#define LINE_FRICTION (VISCOSITY * RHO_0 / (2 * SQR(LINE_DIAMETER) * BORE))

/* Waves arriving at both ends, `elapsed` after the tick in each slot; all arrays by end and slot. */
INLINE void waves(const Pump *u, int slots, const double *elapsed, Clock *c)
{
    LANES(s[PAD]); LANES(ds[PAD]); LANES(p[PAD]); LANES(v[PAD]); LANES(v1[PAD]); LANES(v2[PAD]);
    LANES(re[PAD]); LANES(f[PAD]); LANES(df[PAD]);
    c->stride = slots;
    for (int e = 0; e < 2; e++)
        for (int k = 0, i = e * slots; k < slots; k++, i++) {
            double over = 1 / (DX - elapsed[k] * u->a_rise[e] / 2);
            s[i] = elapsed[k] * u->a_0[e] * over;
            ds[i] = u->a_0[e] * DX * over * over;
            p[i] = u->p_0[e] + s[i] * u->p_rise[e];
            c->qf[i] = u->q_0[e] + s[i] * u->q_rise[e];
        }
    oil(2 * slots, 2, p, v, v1, v2);
    for (int i = 0; i < 2 * slots; i++) re[i] = LINE_RE * fabs(c->qf[i]) * v[i];
    churchill(2 * slots, re, f, df);
    for (int e = 0; e < 2; e++)
        for (int k = 0, i = e * slots; k < slots; k++, i++) {
            double q = c->qf[i], dp = ds[i] * u->p_rise[e], dq = ds[i] * u->q_rise[e], g = LINE_FRICTION * f[i] * q;
            double dg = LINE_FRICTION * ((f[i] + df[i]) * dq + q * df[i] * v1[i] / v[i] * dp);
            c->pw[i] = p[i] + s[i] * DX * g;
            c->dpw[i] = dp + DX * (ds[i] * g + s[i] * dg);
            c->dqf[i] = dq;
            c->zf[i] = IMPEDANCE * v[i] * sqrt(-1 / v1[i]);
            c->dzf[i] = c->zf[i] * (v1[i] / v[i] - v2[i] / (2 * v1[i])) * dp;
        }
}

/* Rates of area per angle are quadratic in the contact's roll angle y: R_0 + R_1 y + R_2 y^2 (Eqs. 3-16). */
#define TAU ((double)DRIVER_TEETH / DRIVEN_TEETH)
#define DRIVEN_RAY (SQR(DRIVEN_BASE) * (1 + SQR(ROLL_OFFSET)))
#define R_0 ((SQR(DRIVER_BASE) - SQR(DRIVER_TIP) + TAU * (SQR(DRIVEN_TIP) - DRIVEN_RAY)) / 2)
#define R_1 (-TAU * TAU * SQR(DRIVEN_BASE) * ROLL_OFFSET)
#define R_2 ((SQR(DRIVER_BASE) - TAU * TAU * TAU * SQR(DRIVEN_BASE)) / 2)
#define C_0 (THICKNESS * (R_0 + R_1 * NU_01 + R_2 * NU_01 * NU_01))
#define C_1 (THICKNESS * (R_1 + 2 * R_2 * NU_01))
#define C_2 (THICKNESS * R_2)
#define T_0 (PITCH * (C_1 + C_2 * PITCH))      /* trapped: rate one pitch ahead less rate */
#define T_1 (2 * C_2 * PITCH)

/* Everything time decides, at `slots` times, FEW or SLOTS. */
INLINE void set_clock(const Pump *u, int slots, const double *t, Clock *c)
{
    LANES(elapsed[SLOTS]);
    const double start = u->pitches * PITCH, w = u->omega, alive = u->trapped;
    for (int k = 0; k < slots; k++) {
        double nu = w * t[k] - start;
        double rate = C_0 + nu * (C_1 + nu * C_2), swept = nu * (C_0 + nu * (C_1 / 2 + nu * C_2 / 3));
        double rate_t = T_0 + nu * T_1, swept_t = nu * (T_0 + nu * T_1 / 2);
        c->Vd[k] = u->Vd0 + swept;
        c->dVd[k] = rate * w;
        c->ddVd[k] = (C_1 + 2 * C_2 * nu) * w * w;
        c->Vs[k] = u->Vs0 - swept - alive * (TRAPPED_AT_START + swept_t);
        c->dVs[k] = -(rate + alive * rate_t) * w;
        c->ddVs[k] = -(C_1 + 2 * C_2 * nu + alive * T_1) * w * w;
        c->Vt[k] = TRAPPED_AT_START + swept_t;
        c->dVt[k] = rate_t * w;
        c->ddVt[k] = T_1 * w * w;
        elapsed[k] = t[k] - u->t_node;
    }
    waves(u, slots, elapsed, c);
}

/* ------------------------------------------------------------------------------------------------------- the laws */

typedef struct { double q, a, b; } Flow;    /* flow from a to b and its derivatives to the two pressures */

/* All flows are mass flow over rho_0. */
INLINE Flow slot(double K, double drop)
{
    return (Flow){K * drop, K, -K};
}

/* A slot with a wall that drags the volume `drag` from b to a, of the oil v between. */
INLINE Flow tip(double K, double drag, double v, double v1, double drop)
{
    const double dragged = drag / (SWELL * v), thin = dragged * v1 / (2 * v);
    return (Flow){K * drop - dragged, K + thin, thin - K};
}

/* K of a slot: n b h^3/(12 nu rho_0 l). */
#define SLOT(parallel, width, height, length) \
    ((parallel) * (width) * (height) * (height) * (height) / (12 * VISCOSITY * RHO_0 * (length)))

enum { O_2, O_2S, O_3, O_5, O_INLET, O_THROTTLE, O_HOLES, ORIFICES = WIDE };

/* Orifices: with u = 2 dp/rho, w = 2 dp/rho_0 and r^2 = k^2 |u|, k = 2 d_h/(nu lambda_c): q = c w tanh(r)/r, and what it
changes by per w at constant density, and per relative change of 1/rho. */
INLINE void orifices(Wide c, Wide k2, Wide u, Wide w, double *q, double *dw, double *dv, double *shape)
{
    const Wide s = k2 * magnitude(u), r = root(choose(s > 1e-3, s, all(1e-3)));
    const Wide e = exp_wide(-2.0 * choose(r < 40, r, all(40)));
    const Wide series = 1.0 - s * (1.0 / 3 - s * (2.0 / 15 - s * (17.0 / 315)));
    const Wide T = choose(s < 1e-3, series, (1.0 - e) / ((1.0 + e) * r));
    store(shape, T);
    const Wide D = (T + 1.0 - s * T * T) * 0.5;
    store(q, c * w * T);
    store(dw, c * D);
    store(dv, c * w * (D - T));
}
#define ORIFICE_K(d_h, lambda_c) (2 * (d_h) / (VISCOSITY * (lambda_c)))
#define ORIFICE_C(area, cd, k) ((area) * (cd) * (k))

/* Open area and hydraulic diameter of one round hole at lift x, and their slopes; MAX_LIFT is below its end. */
INLINE void hole(double x, double *area, double *d_h, double *area_1, double *d_h_1)
{
    const double r = HOLE_DIAMETER / 2, w = EDGE_ROUNDING;
    double h = MAX(x - HOLE_OVERLAP, w), cosine = 1 - h / r, sine = sqrt(1 - cosine * cosine), alpha = acos(cosine);
    double inner = r * r * (alpha - sine * cosine), perimeter = 2 * r * (alpha + sine);
    *area = inner, *area_1 = 2 * r * sine;
    double perimeter_1 = 2 * (1 + cosine) / sine;
    if (x - HOLE_OVERLAP < w) {
        double s = (x - HOLE_OVERLAP) / w;
        *area = inner * s * s * (1.5 - 0.5 * s), *area_1 = inner * (3 * s - 1.5 * s * s) / w, perimeter_1 = 0;
    }
    *d_h = 4 * *area / perimeter;
    *d_h_1 = (4 * *area_1 - *d_h * perimeter_1) / perimeter;
}

/* Cover's deflection [m] on the piece between two knots. */
INLINE double deflection(const Pump *u, double p, double *slope)
{
    *slope = COVER_SLOPE[u->piece];
    return COVER_HEIGHT[u->piece] + *slope * (p - COVER_KNOT[u->piece]);
}

/* Flow into the line at an end at pressure p, oil v, v', v'' there; derivatives to p and to time. `entry` is the loss
over q^2 and v. */
typedef struct { double q, p, t; } End;
INLINE End line_end(const Clock *c, int lane, double entry, double p, double v, double v1, double v2, int order)
{
    double Zp = IMPEDANCE * v * sqrt(-1 / v1), Z = (c->zf[lane] + Zp) / 2, qf = c->qf[lane];
    double drive = p - c->pw[lane] + Z * qf, loss = entry * v;
    double S = loss ? sqrt(Z * Z + 4 * loss * fabs(drive)) : Z, over = 1 / (Z + S);
    End e = {2 * drive * over, 0, 0};
    if (order) {
        double dZ = Zp * (v1 / v - v2 / (2 * v1)) / 2, dD = 1 + dZ * qf;
        double tZ = c->dzf[lane] / 2, tD = tZ * qf + Z * c->dqf[lane] - c->dpw[lane];
        double kind = 2 * loss * (drive > 0 ? 1 : -1);
        e.p = over * (2 * dD - e.q * (dZ + (Z * dZ + kind * dD + 2 * entry * v1 * fabs(drive)) / S));
        e.t = over * (2 * tD - e.q * (tZ + (Z * tZ + kind * tD) / S));
    }
    return e;
}

/* -------------------------------------------------------------------------------------------------- the equations */

/* df/dx by row and column, what is not named is zero, and df/dt. */
typedef struct {
    double dd, ds, da, dr, dn, dx, dv, dq;
    double sd, ss, sa, sr, sn, sx, sv;
    double tt, ta;
    double ad, as, at, aa, ar;
    double rd, rs, ra, rr;
    double nd, ns, nn;
    double vd, vs, vx, vv;
    double qd, qq, qc;      /* q_1 */
    double cq, cc, cw;
    double wc, ww, wf;      /* q_2 */
    double fw, ff, af, bb, ib;
    double t[NX];
} Jacobian;

enum {  /* pressures at which the oil is wanted: volumes, then means of two */
    L_D, L_S, L_T, L_A, L_R, L_N, L_C, L_F, L_B, M_DA, M_AS, M_TA, M_RA, M_DS, M_S0, M_B0,
    M_RS, M_DR, M_NS, M_DN, M_DC, M_CF, PRESSURES = 3 * WIDE
};
#define VOLUMES PAD     /* the first lanes, of which slopes are wanted */

static const double K_1R = SLOT(GAP_1_PARALLEL, GAP_1_ROOTS_WIDTH, 1, GAP_1_ROOTS_LENGTH),
    K_1F = SLOT(GAP_1_PARALLEL, GAP_1_FACES_WIDTH, 1, GAP_1_FACES_LENGTH),
    K_2 = SLOT(GAP_2_PARALLEL, GAP_2_FACES_WIDTH, GAP_2_FACES_HEIGHT, GAP_2_FACES_LENGTH),
    K_2S = SLOT(GAP_2S_PARALLEL, GAP_2_FACES_WIDTH, GAP_2_FACES_HEIGHT, GAP_2_FACES_LENGTH),
    K_7 = SLOT(1, M_PI * GAP_7_DIAMETER * (1 + 1.5 * SQR(GAP_7_ECCENTRICITY)), GAP_7_CLEARANCE, GAP_7_LENGTH),
    K_9 = SLOT(1, GAP_9_WIDTH, GAP_9_HEIGHT, GAP_9_LENGTH),
    K_R = SLOT(1, THICKNESS, TIP_CLEARANCE, DRIVER_TIP_LAND), K_N = SLOT(1, THICKNESS, TIP_CLEARANCE, DRIVEN_TIP_LAND),
    DRAG_R = DRIVER_TIP * THICKNESS * TIP_CLEARANCE / 2, DRAG_N = DRIVEN_TIP * TAU * THICKNESS * TIP_CLEARANCE / 2,
    ORIFICE_2 = ORIFICE_K(GAP_2_ROOTS_DIAMETER, GAP_LAMBDA), DUCT_BORE = M_PI / 4 * SQR(DUCT_DIAMETER),
    SPOOL = M_PI / 4 * SQR(SPOOL_DIAMETER);
#define C_2ROOTS ORIFICE_C(GAP_2_ROOTS_AREA, GAP_CD, ORIFICE_2)
#define INLET_K ORIFICE_K(INLET_DIAMETER, INLET_LAMBDA)
#define DUCT_RE (RHO_0 * DUCT_DIAMETER / (DUCT_BORE * LIQUID_DENSITY * VISCOSITY))
#define DUCT_FRICTION (VISCOSITY * RHO_0 * DUCT_LENGTH / 2 / (2 * SQR(DUCT_DIAMETER) * DUCT_BORE))
#define DUCT_HEAD (DUCT_LOSS / 2 * RHO_0 * RHO_0 / (2 * SQR(DUCT_BORE) * LIQUID_DENSITY))
#define DUCT_INERTANCE (RHO_0 * DUCT_LENGTH / 2 / DUCT_BORE)

/* dx/dt at slot k of the clock; with J its derivatives. Returns the force on the spool [N], for its stops. */
INLINE double equations(const Pump *u, const Clock *c, int k, const double *restrict x, double *restrict dx,
                        Jacobian *J)
{
    const double pd = x[PD], ps = x[PS], pt = x[PT], pa = x[PA], pr = x[PR], pn = x[PN];
    const double pc = x[PC], pf = x[PF], pb = x[PB];
    LANES(p[PRESSURES]);
    store(p, (Wide){pd, ps, pt, pa, pr, pn, pc, pf});
    store(p + WIDE, 0.5 * ((Wide){pb, pd, pa, pt, pr, pd, ps, pb} + (Wide){pb, pa, ps, pa, pa, ps, 0, 0}));
    store(p + 2 * WIDE, 0.5 * ((Wide){pr, pd, pn, pd, pd, pc, 0, 0} + (Wide){ps, pr, ps, pn, pc, pf, 0, 0}));
    LANES(v[PRESSURES]); LANES(v1[PRESSURES]); LANES(v2[PRESSURES]);
    oil(VOLUMES, J ? 2 : 1, p, v, v1, v2);
    oil(PRESSURES - VOLUMES, J ? 1 : 0, p + VOLUMES, v + VOLUMES, v1 + VOLUMES, v2);

    /* valve: lift, open area */
    const int open = x[X] > HOLE_OVERLAP;
    double area = 0, d_h = 0, area_1 = 0, d_h_1 = 0;
    if (open) hole(x[X], &area, &d_h, &area_1, &d_h_1);
    const double hole_k = ORIFICE_K(d_h, HOLE_LAMBDA);

    /* orifices, all at once */
    const Wide oc = {
        GAP_2_PARALLEL * C_2ROOTS, GAP_2S_PARALLEL * C_2ROOTS, u->trapped * C_2ROOTS, u->driver * C_2ROOTS,
        ORIFICE_C(INLET_AREA, INLET_CD, INLET_K), u->throttle_c, ORIFICE_C(HOLE_NUMBER * area, HOLE_CD, hole_k), 0,
    };
    const Wide ok = {
        SQR(ORIFICE_2), SQR(ORIFICE_2), SQR(ORIFICE_2), SQR(ORIFICE_2), SQR(INLET_K), u->throttle_k2, SQR(hole_k), 0,
    };
    static const int mean[ORIFICES] = {M_DA, M_AS, M_TA, M_RA, M_S0, M_B0, M_DS, M_DS};
    const double two = 2 / LIQUID_DENSITY, mass = 2 / RHO_0;
    const Wide fall = {pd - pa, pa - ps, pt - pa, pr - pa, -ps, pb, pd - ps, 0};
    const Wide vm = {v[M_DA], v[M_AS], v[M_TA], v[M_RA], v[M_S0], v[M_B0], v[M_DS], 0}, ou = two * fall * vm;
    const Wide ow = mass * fall;
    LANES(q[ORIFICES]); LANES(dw[ORIFICES]); LANES(dv[ORIFICES]); LANES(shape[ORIFICES]);
    orifices(oc, ok, ou, ow, q, dw, dv, shape);
#define TO_A(i) (dv[i] * v1[mean[i]] / (2 * v[mean[i]]) + dw[i] * mass)
#define TO_B(i) (dv[i] * v1[mean[i]] / (2 * v[mean[i]]) - dw[i] * mass)

    /* gaps */
    double slope, lift = deflection(u, pd, &slope), bend = MAX(lift, 0);
    const double h_r = COVER_CLEARANCE + bend, h_f = COVER_CLEARANCE + COVER_FACES * bend;
    const double k_1 = K_1R * h_r * h_r * h_r + K_1F * h_f * h_f * h_f, q_1 = k_1 * pd;
    const Flow g2 = slot(K_2, pd - pa), g2s = slot(K_2S, pa - ps), g7 = slot(K_7, pa), g9 = slot(K_9, pd - ps);

    /* chains: tip gaps towards suction (0) and delivery (1); without a volume one gap between delivery and suction */
    const double drag_r = DRAG_R * u->omega, drag_n = DRAG_N * u->omega;
#define TIP(K, drag, mean, drop) tip(K, drag, v[mean], v1[mean], drop)
    const Flow r0 = u->driver ? TIP(K_R, drag_r, M_RS, pr - ps) : TIP(K_R, drag_r, M_DS, pd - ps);
    const Flow r1 = u->driver ? TIP(K_R, drag_r, M_DR, pd - pr) : r0;
    const Flow n0 = u->driven ? TIP(K_N, drag_n, M_NS, pn - ps) : TIP(K_N, drag_n, M_DS, pd - ps);
    const Flow n1 = u->driven ? TIP(K_N, drag_n, M_DN, pd - pn) : n0;

    /* spool */
    const double swell = SWELL, over_swell = SPOOL / SWELL;
    const double nose = over_swell / v[L_D] * x[V], back = over_swell / v[L_S] * x[V];
    double jet = 0, chamber = 0, jet_s = 0, over_r2 = 0;
    const double drop = pd - ps, q_h = q[O_HOLES], ahead = MAX(q_h, 0);
    if (open) {
        const double r2 = drop * drop + SQR(DROP_ROUNDING);
        over_r2 = 1 / r2;
        jet_s = JET_COEFFICIENT * cos(JET_ANGLE) * RHO_0 * sqrt(two * v[M_DS] / sqrt(r2));
        jet = jet_s * q_h * drop;
        chamber = ahead * (CHAMBER_LINEAR + CHAMBER_QUADRATIC * ahead);
    }
    const double force = SPOOL * (pd - chamber) - jet - SPRING_PRELOAD - SPRING_RATE * x[X] - DAMPING * x[V];
    const int free = u->at == 0;

    /* duct: two halves of inertia */
    const double s_1 = fabs(x[Q1]), s_2 = fabs(x[Q2]);
    LANES(re[WIDE]); LANES(f_re[WIDE]); LANES(df_re[WIDE]);
    store(re, (Wide){DUCT_RE * s_1 * v[M_DC], DUCT_RE * s_2 * v[M_CF]});
    churchill(WIDE, re, f_re, J ? df_re : 0);
    const double loss_1 = (DUCT_FRICTION * f_re[0] + DUCT_HEAD * v[M_DC] * s_1) * x[Q1];
    const double loss_2 = (DUCT_FRICTION * f_re[1] + DUCT_HEAD * v[M_CF] * s_2) * x[Q2];

    /* line */
    const End a = line_end(c, k, ENTRY_LOSS, pf, v[L_F], v1[L_F], v2[L_F], J != 0);
    const End b = line_end(c, c->stride + k, 0, pb, v[L_B], v1[L_B], v2[L_B], J != 0);

    /* rates */
    LANES(beta[PAD]); LANES(stiff[PAD]);
    for (int i = 0; i < PAD; i++) beta[i] = -v[i] / v1[i], stiff[i] = swell * v[i] * beta[i];
    const double in_d = -r1.q - n1.q - q_1 - q[O_2] - g2.q - g9.q - nose - q_h - x[Q1];
    const double in_s = r0.q + n0.q + q[O_2S] + g2s.q + g9.q + back + q_h + q[O_INLET];
    const double in_a = q[O_2] + g2.q - q[O_2S] - g2s.q + q[O_3] + q[O_5] - g7.q;
    const double out_b = b.q + q[O_THROTTLE];
    const double over_d = 1 / ((c->Vd[k] + WALL_AREA * lift) / beta[L_D] + WALL_AREA * slope);
    const double over_s = 1 / c->Vs[k], over_t = 1 / c->Vt[k];
    dx[PHI] = u->omega;
    dx[PD] = (swell * v[L_D] * in_d - c->dVd[k]) * over_d;
    dx[PS] = (swell * v[L_S] * in_s - c->dVs[k]) * beta[L_S] * over_s;
    dx[PT] = u->trapped ? -(swell * v[L_T] * q[O_3] + c->dVt[k]) * beta[L_T] * over_t : 0;
    dx[PA] = stiff[L_A] * in_a / ANNULAR_VOLUME;
    dx[PR] = u->driver ? stiff[L_R] * (r1.q - r0.q - q[O_5]) / DRIVER_SPACE : 0;
    dx[PN] = u->driven ? stiff[L_N] * (n1.q - n0.q) / DRIVEN_SPACE : 0;
    dx[X] = x[V];
    dx[V] = free ? force / SPOOL_MASS : 0;
    dx[PC] = stiff[L_C] * (x[Q1] - x[Q2]) / (DUCT_BORE * DUCT_LENGTH);
    dx[Q1] = (pd - pc - loss_1) / DUCT_INERTANCE;
    dx[Q2] = (pc - pf - loss_2) / DUCT_INERTANCE;
    dx[PF] = stiff[L_F] * (x[Q2] - a.q) / FILTER_VOLUME;
    dx[IA] = a.q;
    dx[IB] = b.q;
    dx[PB] = -stiff[L_B] * out_b / BODY_VOLUME;
    if (!J) return force;

    /* d ln(beta rho_0/rho)/dp, d ln beta/dp of the volumes */
    LANES(ls[PAD]); LANES(lb[PAD]);
    for (int i = 0; i < PAD; i++) {
        double first = v1[i] / v[i], second = v2[i] / v1[i];
        ls[i] = 2 * first - second, lb[i] = first - second;
    }
    /* delivery */
    const double to_ps_chain = (u->driver ? 0 : r0.b) + (u->driven ? 0 : n0.b);
    double h_x = 0;
    if (open) {
        const double T = shape[O_HOLES], r2 = ok[O_HOLES] * fabs(ou[O_HOLES]);
        h_x = area_1 * hole_k * T + area * ORIFICE_K(d_h_1, HOLE_LAMBDA) * (1 - r2 * T * T);
        h_x *= HOLE_NUMBER * HOLE_CD * ow[O_HOLES];
    }
    const double h_d = TO_A(O_HOLES), h_s = TO_B(O_HOLES);
    const double e_d = swell * v[L_D] * over_d, n_d = v1[L_D] / v[L_D];
    const double k_1d = lift > 0 ? 3 * slope * (K_1R * h_r * h_r + K_1F * COVER_FACES * h_f * h_f) : 0;
    const double d_1 = k_1d * pd + k_1;
    J->dd = e_d * (n_d * in_d - r1.a - n1.a - d_1 - TO_A(O_2) - g2.a - g9.a + nose * n_d - h_d)
            - dx[PD] * over_d * (WALL_AREA * slope - (c->Vd[k] + WALL_AREA * lift) * lb[L_D]) / beta[L_D];
    J->ds = -e_d * (to_ps_chain + g9.b + h_s);
    J->da = -e_d * (TO_B(O_2) + g2.b);
    J->dr = u->driver ? -e_d * r1.b : 0;
    J->dn = u->driven ? -e_d * n1.b : 0;
    J->dx = -e_d * h_x;
    J->dv = -e_d * over_swell / v[L_D];
    J->dq = -e_d;
    J->t[PD] = -(c->ddVd[k] + dx[PD] * c->dVd[k] / beta[L_D]) * over_d;
    /* suction */
    const double e_s = stiff[L_S] * over_s, n_s = v1[L_S] / v[L_S];
    J->ss = dx[PS] * lb[L_S]
            + e_s * (n_s * in_s + r0.b + n0.b + TO_B(O_2S) + g2s.b + g9.b - back * n_s + h_s + TO_B(O_INLET));
    J->sd = e_s * ((u->driver ? 0 : r0.a) + (u->driven ? 0 : n0.a) + g9.a + h_d);
    J->sa = e_s * (TO_A(O_2S) + g2s.a);
    J->sr = u->driver ? e_s * r0.a : 0;
    J->sn = u->driven ? e_s * n0.a : 0;
    J->sx = e_s * h_x;
    J->sv = e_s * over_swell / v[L_S];
    J->t[PS] = -(dx[PS] * c->dVs[k] + beta[L_S] * c->ddVs[k]) * over_s;
    /* trapped */
    const double e_t = u->trapped ? stiff[L_T] * over_t : 0;
    J->tt = dx[PT] * lb[L_T] - e_t * (v1[L_T] / v[L_T] * q[O_3] + TO_A(O_3));
    J->ta = -e_t * TO_B(O_3);
    J->t[PT] = u->trapped ? -(dx[PT] * c->dVt[k] + beta[L_T] * c->ddVt[k]) * over_t : 0;
    /* annular */
    const double e_a = stiff[L_A] / ANNULAR_VOLUME;
    J->aa = dx[PA] * ls[L_A] + e_a * (TO_B(O_2) + g2.b - TO_A(O_2S) - g2s.a + TO_B(O_3) + TO_B(O_5) - g7.a);
    J->ad = e_a * (TO_A(O_2) + g2.a);
    J->as = -e_a * (TO_B(O_2S) + g2s.b);
    J->at = e_a * TO_A(O_3);
    J->ar = e_a * TO_A(O_5);
    /* chains */
    const double e_r = u->driver ? stiff[L_R] / DRIVER_SPACE : 0, e_n = u->driven ? stiff[L_N] / DRIVEN_SPACE : 0;
    J->rr = dx[PR] * ls[L_R] + e_r * (r1.b - r0.a - TO_A(O_5));
    J->rd = e_r * r1.a;
    J->rs = -e_r * r0.b;
    J->ra = -e_r * TO_B(O_5);
    J->nn = dx[PN] * ls[L_N] + e_n * (n1.b - n0.a);
    J->nd = e_n * n1.a;
    J->ns = -e_n * n0.b;
    /* spool */
    J->vd = J->vs = J->vx = J->vv = 0;
    if (free) {
        const double p_c = SPOOL * (CHAMBER_LINEAR + 2 * CHAMBER_QUADRATIC * ahead) * (q_h > 0) + jet_s * drop;
        const double bow = q_h * jet_s * (1 - drop * drop * over_r2 / 2), thin = jet * v1[M_DS] / v[M_DS] / 4;
        J->vd = (SPOOL - p_c * h_d - bow - thin) / SPOOL_MASS;
        J->vs = (-p_c * h_s + bow - thin) / SPOOL_MASS;
        J->vx = (-p_c * h_x - SPRING_RATE) / SPOOL_MASS;
        J->vv = -DAMPING / SPOOL_MASS;
    }
    /* duct */
    const double m_1 = DUCT_FRICTION * df_re[0] * x[Q1] / v[M_DC] + DUCT_HEAD * s_1 * x[Q1];   /* d loss/dv */
    const double m_2 = DUCT_FRICTION * df_re[1] * x[Q2] / v[M_CF] + DUCT_HEAD * s_2 * x[Q2];
    J->qd = (1 - m_1 * v1[M_DC] / 2) / DUCT_INERTANCE;
    J->qc = (-1 - m_1 * v1[M_DC] / 2) / DUCT_INERTANCE;
    J->qq = -(DUCT_FRICTION * (f_re[0] + df_re[0]) + 2 * DUCT_HEAD * v[M_DC] * s_1) / DUCT_INERTANCE;
    J->wc = (1 - m_2 * v1[M_CF] / 2) / DUCT_INERTANCE;
    J->wf = (-1 - m_2 * v1[M_CF] / 2) / DUCT_INERTANCE;
    J->ww = -(DUCT_FRICTION * (f_re[1] + df_re[1]) + 2 * DUCT_HEAD * v[M_CF] * s_2) / DUCT_INERTANCE;
    J->cq = stiff[L_C] / (DUCT_BORE * DUCT_LENGTH);
    J->cw = -J->cq;
    J->cc = dx[PC] * ls[L_C];
    /* filter, line, body */
    const double e_f = stiff[L_F] / FILTER_VOLUME, e_b = stiff[L_B] / BODY_VOLUME;
    J->fw = e_f;
    J->ff = dx[PF] * ls[L_F] - e_f * a.p;
    J->af = a.p;
    J->bb = dx[PB] * ls[L_B] - e_b * (b.p + TO_A(O_THROTTLE));
    J->ib = b.p;
    J->t[PF] = -e_f * a.t;
    J->t[PB] = -e_b * b.t;
    J->t[IA] = a.t;
    J->t[IB] = b.t;
    return force;
}

static __attribute__((noinline)) double rates(const Pump *u, const Clock *c, int k, const double *x, double *dx)
{
    return equations(u, c, k, x, dx, 0);
}

static __attribute__((noinline)) double rates_and_jacobian(const Pump *u, const Clock *c, int k, const double *x,
                                                           double *dx, Jacobian *J)
{
    return equations(u, c, k, x, dx, J);
}

/* --------------------------------------------------------------------------------------------- the line's own step */

/* Pressures at which v is `wanted`, as the circuit finds them: Newton's method on ln v, no step taking more than half
of the absolute pressure. */
static __attribute__((noinline)) void careful(const double *wanted, double *p)
{
    LANES(v[PAD]); LANES(v1[PAD]);
    for (int round = 0; round < 50; round++) {
        double most = 0;
        oil(PAD, 1, p, v, v1, 0);
        for (int i = 0; i < PAD; i++) {
            double half = fabs(p[i] + ATMOSPHERE) / 2, step = MAX(v[i] / v1[i] * log(wanted[i] / v[i]), -half);
            p[i] += step;
            most = MAX(most, fabs(step) / half);
        }
        if (most < 1e-7) return;
    }
}

/* The same from p, where the oil is v, v1, v2, by Halley's method: of third order, so after a step under SMALL only
rounding is left, and after one above LARGE it may not be trusted. */
#define SMALL 1e-5
#define LARGE 0.05
INLINE void pressure_of(const double *wanted, double *v, double *v1, double *v2, double *p)
{
    LANES(start[PAD]);
    memcpy(start, p, sizeof start);
    for (int round = 0;; round++) {
        Wide most = all(0);
        for (int i = 0; i < PAD; i += WIDE) {
            const Wide now = load(p + i), gap = load(wanted + i) - load(v + i), slope = load(v1 + i);
            const Wide step = gap * slope / (slope * slope + 0.5 * gap * load(v2 + i));
            store(p + i, now + step);
            most = larger(most, magnitude(step / (now + ATMOSPHERE)));
        }
        const double reached = largest(most);
        if (reached < SMALL) return;
        if (!(reached < LARGE) || round > 5) break;
        oil(PAD, 2, p, v, v1, v2);
    }
    memcpy(p, start, sizeof start);
    careful(wanted, p);
}

/* Values kept with the nodes: v, the waves' ends, the Courant number. */
INLINE void nodes_changed(Pump *u)
{
    LANES(a[PAD]);
    Wide most = all(0);
    oil(PAD, 2, u->p_node, u->v_node, u->v1_node, u->v2_node);
    for (int i = 0; i < PAD; i += WIDE) {
        const Wide v = load(u->v_node + i);
        const Wide speed = v * root(-1 / LIQUID_DENSITY / load(u->v1_node + i));     /* a^2 = beta/rho */
        store(a + i, speed);
        most = larger(most, speed + magnitude(load(u->q_node + i)) * v * (SWELL / BORE));
    }
    u->courant = largest(most) * TICK / DX;
    for (int e = 0; e < 2; e++) {
        const int end = e ? NODES - 1 : 0, next = e ? NODES - 2 : 1;
        const double sign = e ? -1 : 1;     /* flows into the line */
        u->p_0[e] = u->p_node[end], u->p_rise[e] = u->p_node[next] - u->p_node[end];
        u->q_0[e] = sign * u->q_node[end], u->q_rise[e] = sign * (u->q_node[next] - u->q_node[end]);
        u->a_0[e] = a[end], u->a_rise[e] = a[next] - a[end];
    }
}

/* A tick: two-step Lax-Wendroff, closed at the ends by what the ODE took in and has there (slot k of the clock). */
static __attribute__((noinline)) void tick(Pump *u, int k)
{
    const double *p = u->p_node, *q = u->q_node;
    LANES(qh[PAD]); LANES(ph[PAD]); LANES(want[PAD]); LANES(v[PAD]); LANES(v1[PAD]); LANES(v2[PAD]); LANES(re[PAD]);
    LANES(f[PAD]); LANES(g[PAD]); LANES(dq[PAD]); LANES(over_v[PAD]);

    /* the ends now: pressures, flows, density; and the waves halfway through the step */
    LANES(pe[SLOTS]) = {u->x[PF], u->x[PB]}; LANES(ve[SLOTS]); LANES(v1e[SLOTS]);
    LANES(half[FEW]) = {TICK / 2, TICK / 2, TICK / 2, TICK / 2};
    oil(SLOTS, 1, pe, ve, v1e, 0);
    const double q_a = line_end(&u->clock, k, ENTRY_LOSS, pe[0], ve[0], v1e[0], 0, 0).q;
    const double q_b = line_end(&u->clock, u->clock.stride + k, 0, pe[1], ve[1], v1e[1], 0, 0).q;
    const double end_p[2] = {pe[0] - ENTRY_LOSS * ve[0] * q_a * fabs(q_a), pe[1]}, end_q[2] = {q_a, q_b};
    const double taken[2] = {u->x[IA] - u->had_a, u->x[IB] - u->had_b}, old_q[2] = {q[0], -q[NODES - 1]};
    Clock c;
    waves(u, FEW, half, &c);
    LANES(pg[SLOTS]) = {0}; LANES(vg[SLOTS]); LANES(v1g[SLOTS]);
    for (int e = 0; e < 2; e++) {
        const int lane = e * FEW;
        pg[e] = c.pw[lane] + c.zf[lane] * (taken[e] / TICK - c.qf[lane]);   /* predicts the mean pressure */
        pg[e + 2] = end_p[e];
    }
    oil(SLOTS, 1, pg, vg, v1g, 0);

    /* half step */
    for (int i = 0; i < PAD; i++) over_v[i] = 1 / u->v_node[i];
    for (int i = 0; i < CELLS; i++) {
        ph[i] = (p[i] + p[i + 1]) / 2, qh[i] = (q[i] + q[i + 1]) / 2, dq[i] = p[i + 1] - p[i];
        want[i] = (over_v[i] + over_v[i + 1]) / 2 - RHO_0 * TICK / (2 * DX * BORE * LIQUID_DENSITY) * (q[i + 1] - q[i]);
    }
    for (int i = CELLS; i < PAD; i++) want[i] = want[0], ph[i] = ph[0], qh[i] = dq[i] = 0;
    for (int i = 0; i < PAD; i++) want[i] = 1 / want[i];
    oil(PAD, 2, ph, v, v1, v2);
    for (int i = 0; i < PAD; i++) re[i] = LINE_RE * fabs(qh[i]) * v[i];
    churchill(PAD, re, f, 0);
    for (int i = 0; i < PAD; i++)
        qh[i] -= BORE * TICK / (2 * RHO_0) * (dq[i] / DX + LINE_FRICTION * f[i] * qh[i]);
    pressure_of(want, v, v1, v2, ph);
    for (int i = 0; i < PAD; i++) re[i] = LINE_RE * fabs(qh[i]) * want[i];
    churchill(PAD, re, f, 0);
    for (int i = 0; i < PAD; i++) g[i] = LINE_FRICTION * f[i] * qh[i];

    /* ends: what closes the books of the half cells there */
    for (int e = 0; e < 2; e++) {
        const int lane = e * FEW, node = e ? NODES - 1 : 0, cell = e ? CELLS - 1 : 0;
        const double flow = taken[e] / TICK, sign = e ? -1 : 1;
        double Z = (c.zf[lane] + IMPEDANCE * vg[e] * sqrt(-1 / v1g[e])) / 2;
        double mean = c.pw[lane] + Z * (flow - c.qf[lane]);
        double r = over_v[node] / SWELL, r_new = 1 / (vg[e + 2] * SWELL);
        qh[cell] = sign * (flow - BORE * DX / (2 * TICK) * (r_new - r));
        ph[cell] = mean - RHO_0 * DX / (2 * BORE * TICK) * (end_q[e] - old_q[e]) - DX / 2 * sign * g[cell];
    }

    /* full step */
    LANES(pn[PAD]); LANES(qn[PAD]);
    memcpy(pn, p, sizeof pn), memcpy(qn, q, sizeof qn), memcpy(want, over_v, sizeof want);
    for (int i = 1; i < CELLS; i++) {
        want[i] -= RHO_0 * TICK / (DX * BORE * LIQUID_DENSITY) * (qh[i] - qh[i - 1]);
        qn[i] -= BORE * TICK / RHO_0 * ((ph[i] - ph[i - 1]) / DX + (g[i] + g[i - 1]) / 2);
    }
    for (int i = 0; i < PAD; i++) want[i] = 1 / want[i];
    pressure_of(want, u->v_node, u->v1_node, u->v2_node, pn);
    pn[0] = end_p[0], qn[0] = q_a, pn[NODES - 1] = end_p[1], qn[NODES - 1] = -q_b;
    for (int i = NODES; i < PAD; i++) pn[i] = pn[0], qn[i] = 0;
    memcpy(u->p_node, pn, sizeof pn);
    memcpy(u->q_node, qn, sizeof qn);
    u->t_node = u->t, u->had_a = u->x[IA], u->had_b = u->x[IB];
    nodes_changed(u);
}

/* ---------------------------------------------------------------------------------------- where the gears stand */

/* Begin a segment of the pitch: which volumes exist, what has opened and closed. */
static void segment_begins(Pump *u, int segment)
{
    const Segment *s = SEGMENT + segment;
    u->segment = segment;
    u->trapped = s->trapped, u->driver = s->driver, u->driven = s->driven;
    u->Vd0 = s->delivery, u->Vs0 = s->suction;
}
