/* The event loop of the compiled methods: stepping, error control, roots, events, ticks. See docs/hybrid.md.
 *
 * Between stops bits and held values are constant. An accepted step is searched for relations that leave their side; if
 * one does, the step is tried again up to that root, until it ends on it: states at an event come from the method, never
 * from its polynomial. Roots of relations that move evenly (angles at constant speed) are foreseen, and cost nothing.
 */
#include <math.h>
#include <string.h>

#include "run.h"

static const double ROUNDOFF = 16 * 2.220446049250313e-16; /* of a relation, in shares of its sides */
static const double SAFETY = 0.9, SHRINK = 0.2, GROW = 5;
static const double SMALLEST = 1e-14; /* share of the run: a shorter rejected step is a collapse */
static const double EVEN = 1e-9; /* a relation whose rate changed by less, relatively, moves evenly */
enum { MAX_TRIES = 80, SECANTS = 8, SAMPLES = 16, COLLAPSE_COUNT = 500, FEW = 2 };

static const Method *method_of(const Run *r) { return r->method == RODAS ? &rodas : &dopri; }

/* -- functions ------------------------------------------------------------------------------------------------------ */

static void call(const Run *r, void *function) { ((void (*)(void *))r->trigger)(function); }

static void put(Run *r, double t, const double *x)
{
    *r->t_in = t;
    if (r->n) memcpy(r->x_in, x, r->n * sizeof *x);
}

const double *rhs(Run *r, double t, const double *x)
{
    put(r, t, x);
    call(r, r->rhs);
    r->evaluations++;
    return r->fx;
}

void linearise(Run *r, double t, const double *x)
{
    put(r, t, x);
    call(r, r->linear);
    r->jacobians++;
    r->linearised = 1;
}

/* to = from + factor sum_j weights_j row_j, rows of n one after another */
void combine(int64_t n, double *to, const double *from, double factor, const double *rows, const double *weights, int count)
{
    if (to != from) memcpy(to, from, n * sizeof *to);
    for (int j = 0; j < count; j++) {
        const double weight = factor * weights[j], *const restrict row = rows + j * n;
        double *const restrict sum = to;
        if (weight != 0)
            for (int64_t i = 0; i < n; i++) sum[i] += weight * row[i];
    }
}

double error_norm(const Run *r, const double *error)
{
    double sum = 0, most = 0;
    int64_t worst = -1;
    for (int64_t i = 0; i < r->n; i++) {
        const double old = fabs(r->x[i]), new = fabs(r->x_new[i]);
        const double share = error[i] / (r->atol[i] + r->rtol * (old > new ? old : new)), square = share * share;
        sum += square;
        if (square > most) most = square, worst = i;
    }
    if (worst >= 0) r->limited[worst]++;
    return sqrt(sum / r->n);
}

/* x on the candidate's polynomial, and dx/dt if rate is given; step of length h, at h theta */
static void on_path(const Run *r, double h, double theta, double *x, double *rate)
{
    const int degree = method_of(r)->degree;
    for (int64_t i = 0; i < r->n; i++) {
        double value = r->coef[degree * r->n + i], slope = 0;
        for (int j = degree - 1; j >= 0; j--) {
            slope = slope * theta + value;
            value = value * theta + r->coef[j * r->n + i];
        }
        x[i] = value;
        if (rate) rate[i] = slope / h;
    }
}

/* -- the discrete half ---------------------------------------------------------------------------------------------- */

/* Side a relation belongs to: its truth; within its tolerance the side it is heading for. */
static int side_of(const Run *r, double g, double rate, double fastest, double scale, int64_t strict)
{
    const double roundoff = ROUNDOFF * scale;
    if (fabs(g) <= 2 * r->tolerance * fastest + roundoff && fabs(rate) * (r->stop - r->start) > roundoff)
        return rate > 0;
    return g > 0 || (g == 0 && !strict);
}

/* f and the relations at (t, x); together with f its linearisation, if a step that needs it is likely to follow. */
static void read_relations(Run *r, int onward)
{
    if (onward && r->method == RODAS) {
        linearise(r, r->t, r->x);
        memcpy(r->fx, r->lin_f, r->n * sizeof *r->fx);
    } else {
        rhs(r, r->t, r->x);
        r->linearised = 0;
    }
    memcpy(r->v_in, r->fx, r->n * sizeof *r->v_in);
    if (r->n_bits) call(r, r->relation);
}

static void now_switched(Run *r)
{
    r->switched = 1;
    if (r->curved_held) r->rescan = 1;
}

/* Count how closely the turns of an event or, behind the events, of a relation follow one another. */
static void turned(Run *r, int64_t k)
{
    const int close = r->steps - r->storm_last[k] < r->storm_steps;
    r->storm_last[k] = r->steps;
    if (r->storm_row[k] < r->storm_count) r->storm_row[k] = close ? r->storm_row[k] + 1 : 0;
}

/* Let held values that follow a schedule take the row that holds from now on. */
static void follow(Run *r)
{
    for (int64_t k = 0; k < r->n_schedules; k++) {
        int64_t at = r->schedule_at[k];
        while (at < r->schedule_last[k] && r->schedule_times[at + 1] <= r->t + r->tolerance) at++;
        if (at == r->schedule_at[k]) continue;
        r->schedule_at[k] = at;
        memcpy(r->h + r->schedule_place[k], r->schedule_rows + at * r->schedule_width, r->schedule_size[k] * sizeof *r->h);
        now_switched(r);
    }
}

/* Bring every bit to rest. A relation's tolerance is that of its fastest rate met on the way: a rate that depends on the
 * bit itself would else put it inside its tolerance with one value and outside with the other. */
static int settle(Run *r, int onward)
{
    for (int round = 0; round < MAX_SETTLING; round++) {
        int64_t other = -1;
        read_relations(r, onward);
        for (int64_t k = r->n_bits - 1; k >= 0; k--) {
            r->fastest[k] = fmax(round ? r->fastest[k] : 0, fabs(r->g_rate[k]));
            r->want[k] = side_of(r, r->g[k], r->g_rate[k], r->fastest[k], r->g_scale[k], r->strict[k]);
            if (r->want[k] != r->b[k]) other = k;
        }
        if (other < 0) return PAUSED;
        unsigned char *const mine = r->seen + round * r->n_bits;
        for (int64_t k = 0; k < r->n_bits; k++) mine[k] = r->want[k] > 0.5;
        for (int before = 0; before < round; before++)
            if (!memcmp(mine, r->seen + before * r->n_bits, r->n_bits)) {
                r->culprit = other;
                return UNSETTLED;
            }
        for (int64_t k = 0; k < r->n_bits; k++)
            if (r->want[k] != r->b[k]) turned(r, r->n_events + k);
        memcpy(r->b, r->want, r->n_bits * sizeof *r->b);
        now_switched(r);
    }
    return RESTLESS;
}

/* Count an event; ZENO if it has fired too often within too short a time. */
static int note(Run *r, int64_t event)
{
    double *const ring = r->recent + event * ZENO_COUNT;
    const int64_t count = r->fired[event]++;
    ring[count % ZENO_COUNT] = r->t;
    if (count + 1 >= ZENO_COUNT && r->t - ring[(count + 1) % ZENO_COUNT] < r->zeno_span) {
        r->culprit = event;
        return ZENO;
    }
    return PAUSED;
}

static void log_event(Run *r, int64_t event)
{
    r->log_t[r->logs] = r->t;
    r->log_event[r->logs++] = event;
    turned(r, event);
    if (r->kind[event] == EVERY)
        r->ticks++;
    else
        r->events++;
}

/* Which events fire now, into flags; how many. */
static int64_t fires(Run *r, int64_t *ticks)
{
    int64_t count = 0;
    *ticks = 0;
    memset(r->flags, 0, r->n_events * sizeof *r->flags);
    put(r, r->t, r->x);
    if (r->n_conditions) call(r, r->condition);
    for (int64_t k = 0; k < r->n_conditions; k++) {
        const int64_t now = r->conditions[k] > 0.5;
        if (now && !r->holds[k]) r->flags[r->rising[k]] = 1, count++;
        r->holds[k] = now;
    }
    for (int64_t k = 0; k < r->n_ticks; k++)
        if (r->due[k]) r->flags[r->ticking[k]] = 1, r->due[k] = 0, ++*ticks;
    return count;
}

/* Settle and fire at t in rounds; nothing needs settling first where nothing but ticks is due. */
static int fire(Run *r, int only_ticks)
{
    int code = only_ticks ? PAUSED : settle(r, 0);
    for (int round = 0; !code && round < MAX_ROUNDS; round++) {
        int64_t ticks, events = fires(r, &ticks);
        if (!events && !ticks) return PAUSED;
        for (int64_t e = 0; e < r->n_events; e++)
            if (r->flags[e] && r->kind[e] == FAIL) {
                r->culprit = e;
                return FAILED;
            }
        for (int64_t k = 0; k < r->n_conditions; k++)
            if (r->flags[r->rising[k]]) log_event(r, r->rising[k]);
        for (int64_t k = 0; k < r->n_ticks; k++)
            if (r->flags[r->ticking[k]]) log_event(r, r->ticking[k]);
        call(r, !events ? r->remap_ticks : !ticks ? r->remap_events : r->remap);
        for (int64_t i = 0; i < r->n; i++) {
            r->jumped |= r->new_x[i] != r->x[i];
            if (!isfinite(r->new_x[i])) code = NOT_FINITE;
        }
        if (memcmp(r->h, r->new_h, r->n_held * sizeof *r->h)) now_switched(r);
        for (int64_t i = 0; i < r->n_held; i++)
            if (!isfinite(r->new_h[i])) code = NOT_FINITE;
        memcpy(r->x, r->new_x, r->n * sizeof *r->x);
        memcpy(r->h, r->new_h, r->n_held * sizeof *r->h);
        for (int64_t e = 0; e < r->n_events; e++)
            if (r->flags[e]) {
                if (r->kind[e] == STOP) r->finished = 1;
                if (r->kind[e] != EVERY) {
                    r->last_event = e;
                    const int worry = note(r, e);
                    if (!code) code = worry;
                }
            }
        if (!code) code = settle(r, !events);
        if (!code && round == MAX_ROUNDS - 1) code = ENDLESS;
    }
    return code;
}

/* -- books ---------------------------------------------------------------------------------------------------------- */

static int64_t world(Run *r)
{
    if (r->switched || !r->worlds) {
        memcpy(r->world_h + r->worlds * r->n_held, r->h, r->n_held * sizeof *r->h);
        memcpy(r->world_b + r->worlds * r->n_bits, r->b, r->n_bits * sizeof *r->b);
        r->worlds++;
        r->switched = 0;
    }
    return r->worlds - 1;
}

static void record(Run *r, int jump)
{
    const int64_t k = r->rows++;
    r->row_world[k] = world(r);
    r->row_t[k] = r->t;
    memcpy(r->row_x + k * r->n, r->x, r->n * sizeof *r->x);
    r->row_jump[k] = jump;
}

static void keep_piece(Run *r, double low, double high)
{
    const int64_t k = r->pieces++, size = (method_of(r)->degree + 1) * r->n;
    r->piece_world[k] = world(r);
    r->piece_low[k] = low;
    r->piece_high[k] = high;
    memcpy(r->piece_coef + k * size, r->coef, size * sizeof *r->coef);
}

/* -- stops ---------------------------------------------------------------------------------------------------------- */

void find_goal(Run *r)
{
    double goal = r->stop;
    for (int64_t k = 0; k < r->n_ticks; k++) goal = fmin(goal, r->origin[k] + (r->ticked[k] + 1) * r->period[k]);
    for (int64_t k = 0; k < r->n_schedules; k++)
        if (r->schedule_at[k] < r->schedule_last[k]) goal = fmin(goal, r->schedule_times[r->schedule_at[k] + 1]);
    for (int64_t j = 0; j < r->n_linear; j++) {
        const int64_t k = r->time_linear[j];
        const double ahead = -r->g[k] / r->g_rate[k];
        if ((r->b[k] > 0.5 ? r->g_rate[k] < 0 : r->g_rate[k] > 0) && ahead > 0) goal = fmin(goal, r->t + ahead);
    }
    r->goal = r->curved ? fmin(goal, r->curved_next) : goal;
}

/* Look at the relations on states as they are at t, after settling. */
static void watch_from_here(Run *r)
{
    for (int64_t j = 0; j < r->n_watched; j++) {
        const int64_t k = r->watched[j];
        r->side[j] = r->b[k] > 0.5 ? 1 : -1;
        r->before[j] = r->side[j] * r->g[k];
        r->slope[j] = r->slope_last[j] = r->side[j] * r->g_rate[k];
    }
}

static int held_possible(Run *r)
{
    for (int64_t i = 0; i < r->n_held; i++)
        if (r->h[i] < r->held_floor[i]) {
            r->culprit = i;
            return 0;
        }
    return 1;
}

/* Whether f after a stop differs from f before it by more than may pass unseen. */
static int f_changed(const Run *r, const double *old)
{
    for (int64_t i = 0; i < r->n; i++)
        if (fabs(r->fx[i] - old[i]) * r->step > r->restart_share * (r->atol[i] + r->rtol * fabs(r->x[i]))) return 1;
    return 0;
}

/* Everything that happens at t: settle, fire, look ahead. */
static int stop_here(Run *r, int start, int landed)
{
    const int64_t ticks = r->ticks;
    const int only_ticks = !start && !landed && !r->n_linear && !r->n_schedules && !r->curved;
    for (int64_t k = 0; k < r->n_ticks; k++)
        if (r->origin[k] + (r->ticked[k] + 1) * r->period[k] <= r->t + r->tolerance) r->due[k] = 1, r->ticked[k]++;
    if (r->curved && r->curved_next <= r->t + r->tolerance) r->rescan = 1;
    r->jumped = 0;
    r->last_event = -1;
    if (start) r->switched = 1; /* the first world is that after the start */
    follow(r);
    int code = fire(r, only_ticks);
    if (!code && only_ticks && r->ticks == ticks) rhs(r, r->t, r->x); /* the end of the run */
    const int changed = r->jumped || r->switched;
    if (start || changed) record(r, !start);
    if (code) return code;
    for (int64_t i = 0; i < r->n; i++)
        if (!isfinite(r->fx[i])) return NOT_FINITE;
    if (!held_possible(r)) return IMPOSSIBLE_HELD;
    if (!start && changed && !r->finished && r->t < r->stop && (r->jumped || f_changed(r, r->rate))) {
        r->restarts++;
        if (r->last_event >= 0 && r->first_step[r->last_event] > 0)
            r->step = r->first_step[r->last_event];
    } else {
        r->last_event = -1;
    }
    memcpy(r->rate, r->fx, r->n * sizeof *r->rate);
    r->rate_exact = 1;
    watch_from_here(r);
    find_goal(r);
    return r->rescan ? NEEDS_ROOT : PAUSED;
}

/* A first step that moves no state by more than a hundredth of its size or, from nothing, of its tolerance. */
static double first_step(const Run *r)
{
    double size = 0, speed = 0;
    for (int64_t i = 0; i < r->n; i++) {
        const double scale = r->atol[i] + r->rtol * fabs(r->x[i]);
        size += pow(r->x[i] / scale, 2);
        speed += pow(r->rate[i] / scale, 2);
    }
    size = sqrt(size / r->n);
    speed = sqrt(speed / r->n);
    return speed > 0 ? 0.01 * fmax(size, 1) / speed : r->stop - r->start;
}

/* -- roots inside a step --------------------------------------------------------------------------------------------- */

/* Distance of a watched relation from turning, less roundoff, on the candidate's polynomial; its rate if asked for. */
static double distance(Run *r, int64_t j, double h, double theta, double *rate)
{
    on_path(r, h, theta, r->x_in, r->v_in);
    *r->t_in = r->t + theta * h;
    call(r, r->watch);
    if (rate) *rate = r->side[j] * r->w_rate[j];
    return r->side[j] * r->w[j] + ROUNDOFF * r->w_scale[j];
}

/* Zero of the distance between low (positive) and high (negative): regula falsi with halving (Illinois). */
static double close_in(Run *r, int64_t j, double h, double low, double high)
{
    double at_low = distance(r, j, h, low, 0), at_high = distance(r, j, h, high, 0);
    for (int64_t tries = 0; tries < MAX_TRIES && at_low <= 0 && (high - low) * h > r->tolerance; tries++) {
        const double middle = (low + high) / 2, value = distance(r, j, h, middle, 0);
        if (value < 0) high = middle, at_high = value;
        else low = middle, at_low = value;
    }
    int last = 0;
    for (int tries = 0; tries < MAX_TRIES && (high - low) * h > r->tolerance && at_high != 0; tries++) {
        double theta = high - at_high * (high - low) / (at_high - at_low);
        if (!(theta > low && theta < high) || tries % 8 == 7) theta = (low + high) / 2;
        if (theta == low || theta == high) break;
        const double value = distance(r, j, h, theta, 0);
        if (value <= 0) {
            if (last == 1) at_low /= 2;
            high = theta, at_high = value, last = 1;
        } else {
            if (last == -1) at_high /= 2;
            low = theta, at_low = value, last = -1;
        }
    }
    return high;
}

/* First turning of a relation along the whole candidate, sampled with its slopes; 2 if there is none. */
static double first_turn(Run *r, int64_t j, double h)
{
    double old_slope, low = 0;
    distance(r, j, h, 0, &old_slope);
    for (int k = 1; k <= SAMPLES; k++) {
        const double high = (double)k / SAMPLES;
        double slope;
        if (distance(r, j, h, high, &slope) < 0) return close_in(r, j, h, low, high);
        if (old_slope < 0 && slope > 0) {
            double a = low, b = high;
            while ((b - a) * h > r->tolerance) {
                const double middle = (a + b) / 2;
                double rate;
                if (middle == a || middle == b) break;
                if (distance(r, j, h, middle, &rate) < 0) return close_in(r, j, h, low, middle);
                if (rate < 0) a = middle;
                else b = middle;
            }
        }
        low = high, old_slope = slope;
    }
    return 2;
}

/* Whether the cubic through values and slopes at both ends comes near zero. */
static int may_dip(const Run *r, int64_t j, double h)
{
    const double near = 0.02 * (r->before[j] + fabs(r->after[j]));
    if (!(r->slope[j] < 0 && r->slope_new[j] > 0 && r->before[j] > r->band[j])) return 0;
    for (int k = 1; k < SAMPLES; k++) {
        const double s = (double)k / SAMPLES, s2 = s * s, s3 = s2 * s;
        const double cubic = r->before[j] * (2 * s3 - 3 * s2 + 1) + r->slope[j] * h * (s3 - 2 * s2 + s) +
                             r->after[j] * (3 * s2 - 2 * s3) + r->slope_new[j] * h * (s3 - s2);
        if (cubic <= near) return 1;
    }
    return 0;
}

typedef struct Search {
    double low; /* longest step known to end before the event */
    double high; /* shortest step known to end on or behind it, 0 while there is none */
    double nudge;
    int tries;
} Search;

/* Whether relations that serve conditions alone may turn at the candidate's end instead of within: neither one of them
 * nor both fire anything. A valve at rest, whose force is rounding, turns at every step. */
static int harmless(Run *r, double h, const int64_t *turned, int64_t count)
{
    int harm = 0;
    for (int64_t mask = 1; !harm && mask < 1 << count; mask++) {
        for (int64_t k = 0; k < count; k++) r->b[turned[k]] = mask >> k & 1 ? !r->b[turned[k]] : r->b[turned[k]];
        put(r, r->t + h, r->x_new);
        if (r->n_conditions) call(r, r->condition);
        for (int64_t k = 0; k < r->n_conditions; k++) harm |= r->conditions[k] > 0.5 && !r->holds[k];
        for (int64_t k = 0; k < count; k++) r->b[turned[k]] = mask >> k & 1 ? !r->b[turned[k]] : r->b[turned[k]];
    }
    return !harm;
}

/* Where the accepted candidate of length h leaves the run: 0 it stands without an event, h it ends on an event,
 * else the length to try instead. */
static double locate(Run *r, double h, Search *s)
{
    if (!r->n_watched) return 0;
    put(r, r->t + h, r->x_new);
    memcpy(r->v_in, r->rate_new, r->n * sizeof *r->v_in);
    call(r, r->watch);
    int64_t behind = 0, turned = 0, switches = 0, who[FEW];
    for (int64_t j = 0; j < r->n_watched; j++) {
        const double roundoff = ROUNDOFF * r->w_scale[j];
        r->after[j] = r->side[j] * r->w[j];
        r->slope_new[j] = r->side[j] * r->w_rate[j];
        r->band[j] = roundoff;
        const int truth = side_of(r, r->w[j], r->w_rate[j], fabs(r->w_rate[j]), r->w_scale[j], r->strict[r->watched[j]]);
        if (truth == (r->side[j] > 0)) continue;
        if (h <= 4 * r->tolerance && r->slope_new[j] > 0) continue; /* rounding at the start: it is heading back */
        if (turned < FEW) who[turned] = r->watched[j];
        turned++;
        switches += r->switches[j];
        if (r->after[j] < -2 * r->tolerance * fabs(r->slope_new[j]) - roundoff) behind++;
    }
    s->tries++;
    if (turned && (!behind || h - s->low <= r->tolerance || s->tries > MAX_TRIES)) return h;
    if (behind && s->tries == 1 && !switches && turned <= FEW && harmless(r, h, who, turned)) return h;
    if (!turned && s->tries > MAX_TRIES) return 0;
    if (!turned && s->high && s->high - h <= r->tolerance) return s->high; /* known to end on it */
    double next = 2; /* first turning, in shares of the candidate */
    for (int64_t j = 0; j < r->n_watched; j++) {
        double theta = 2;
        if (r->after[j] < -r->band[j] && !r->wave[j] && r->before[j] > r->band[j] && r->slope[j] < 0 && r->slope_new[j] < 0)
            theta = close_in(r, j, h, 0, 1);
        else if (r->after[j] < -r->band[j] ||
                 ((r->wave[j] || may_dip(r, j, h)) && (r->switches[j] || !harmless(r, h, r->watched + j, 1))))
            theta = first_turn(r, j, h);
        else if (!turned && s->high && r->slope_new[j] < 0)
            theta = 1 - r->after[j] / r->slope_new[j] / h; /* short of the event: as far as its rate says */
        if (theta < next) next = theta;
    }
    next *= h;
    if (turned) {
        s->high = h;
        if (!(next < h)) next = h - (h - s->low) / 2;
        if (next <= s->low) next = fmin(s->low + (s->nudge = fmax(2 * s->nudge, r->tolerance)), s->low + (h - s->low) / 2);
    } else if (next < h) { /* a dip or a wave, or an earlier relation */
        if (next <= r->tolerance || next <= s->low) next = s->low + (s->nudge = fmax(2 * s->nudge, r->tolerance));
        if (next >= h) return 0;
        s->high = h; /* it is on its side again there; the search ends at the latest there */
    } else if (!s->high) {
        return 0;
    } else {
        s->low = h;
        s->nudge = fmax(2 * s->nudge, r->tolerance);
        if (next < h + s->nudge) next = h + s->nudge;
        if (next > s->high) next = s->high;
    }
    if (s->high && s->tries > SECANTS && s->tries % 2) next = (s->low + s->high) / 2;
    return next;
}

/* -- steps ---------------------------------------------------------------------------------------------------------- */

static double interpolate(const double *xs, const double *ys, int64_t n, double x)
{
    int64_t low = 0, high = n - 1;
    if (x <= xs[0]) return ys[0];
    if (x >= xs[high]) return ys[high];
    while (high - low > 1) {
        const int64_t middle = (low + high) / 2;
        if (xs[middle] <= x) low = middle;
        else high = middle;
    }
    const double width = xs[high] - xs[low];
    return width > 0 ? ys[low] + (ys[high] - ys[low]) * (x - xs[low]) / width : ys[high];
}

static double longest(const Run *r)
{
    double cap = r->step_cap, fastest = 0;
    for (int64_t k = 0; k < r->n_angles; k++) fastest = fmax(fastest, fabs(r->rate[r->angles[k]]));
    if (fastest > 0) cap = fmin(cap, r->angle_step / fastest);
    if (r->n_pace) {
        const double swung = interpolate(r->pace_t, r->pace_s, r->n_pace, r->t) + r->clock_swing;
        const double ahead = interpolate(r->pace_s, r->pace_t, r->n_pace, swung) - r->t;
        if (ahead > 0) cap = fmin(cap, ahead);
    }
    return cap;
}

/* Length of the next step: not past the goal, nor leaving a crumb before it, nor past a root that is foreseen. */
static double length(const Run *r)
{
    const double left = r->goal - r->t, cap = longest(r);
    double h = fmin(r->step, cap);
    if (h >= left * (1 - 1e-9)) h = left;
    else if (h > left / 2) h = left / 2 > cap ? cap : left / 2;
    for (int64_t j = 0; j < r->n_watched; j++) {
        const double slope = r->slope[j];
        if (r->wave[j] || !(slope < 0) || !(r->before[j] > 0) || fabs(slope - r->slope_last[j]) > -EVEN * slope) continue;
        const double root = r->before[j] / -slope;
        if (root < h && root > r->tolerance) h = root;
    }
    return h;
}

static void accept(Run *r, double h, double t_new)
{
    keep_piece(r, r->t, t_new);
    r->t = t_new;
    r->steps++;
    r->linearised = 0;
    memcpy(r->x, r->x_new, r->n * sizeof *r->x);
    memcpy(r->rate, r->rate_new, r->n * sizeof *r->rate);
    if (r->last_event >= 0 && h >= r->first_step[r->last_event]) r->first_step[r->last_event] = h;
    r->last_event = -1;
    record(r, 0);
}

static int possible(Run *r)
{
    for (int64_t i = 0; i < r->n; i++)
        if (r->x[i] < r->floor[i]) {
            r->culprit = i;
            return 0;
        }
    return 1;
}

static int step(Run *r)
{
    const Method *const method = method_of(r);
    const double wished = r->step;
    double h = length(r), full = 0, proposed = 0, event = 0;
    int rejected = 0, free = 0;
    Search search = {0, 0, 0, 0};
    for (;;) {
        const double error = r->n ? method->attempt(r, h) : 0;
        /* a longer step has been good enough where the search goes on below one */
        if (!(error <= 1) && !(search.high > h && isfinite(error))) {
            r->rejected++;
            rejected = 1;
            full = 0;
            search = (Search){0, 0, 0, 0};
            h *= isfinite(error) ? fmax(SHRINK, SAFETY * pow(error, -1.0 / method->order)) : 0.1;
            if (h < SMALLEST * (r->stop - r->start) || r->t + h == r->t) return COLLAPSED;
            if (r->last_event >= 0) r->first_step[r->last_event] = 0;
            continue;
        }
        if (h > full) { /* the longest accepted candidate says what the error allows */
            const double grow = error > 0 ? SAFETY * pow(error, -1.0 / method->order) : GROW;
            full = h;
            free = grow > GROW;
            proposed = h * fmax(SHRINK, fmin(grow, rejected ? 1 : GROW));
        }
        method->finish(r, h);
        event = locate(r, h, &search);
        if (event == 0 || event == h) break;
        h = event;
    }
    double t_new = r->t + h;
    if (fabs(r->goal - t_new) <= r->tolerance || h == r->goal - r->t) t_new = r->goal;
    /* of a step cut so short that its error vanishes nothing is learnt */
    r->step = free && !rejected ? fmax(wished, proposed) : proposed;
    if (event == 0) {
        memcpy(r->slope_last, r->slope, r->n_watched * sizeof *r->slope);
        memcpy(r->before, r->after, r->n_watched * sizeof *r->before);
        memcpy(r->slope, r->slope_new, r->n_watched * sizeof *r->slope);
    }
    accept(r, h, t_new);
    if (!possible(r)) return IMPOSSIBLE;
    r->tiny = h < SMALLEST * (r->stop - r->start) ? r->tiny + 1 : 0;
    if (r->tiny > COLLAPSE_COUNT) return COLLAPSED;
    if (event == 0 && r->t < r->goal - r->tolerance) return PAUSED;
    if (!r->rate_exact) memcpy(r->rate, rhs(r, r->t, r->x), r->n * sizeof *r->rate); /* what f is before the stop */
    return stop_here(r, 0, event != 0);
}

/* The start has been computed: states, held values, bits and conditions are those after it. */
static int begin(Run *r)
{
    r->begun = 1;
    const int code = stop_here(r, 1, 0);
    r->step = first_step(r);
    return code;
}

/* Go on until the run ends or the records are full, at most so many steps. */
int advance(Run *r, int64_t steps)
{
    int code = r->begun ? PAUSED : begin(r);
    while (!code) {
        if (r->finished) return STOPPED;
        if (r->t >= r->stop) return DONE;
        if (steps-- <= 0 || r->rows + 4 > r->rows_max || r->logs + MAX_ROUNDS * r->n_events > r->logs_max) return PAUSED;
        code = step(r);
    }
    return code;
}

int64_t size_of_run(void) { return sizeof(Run); }
