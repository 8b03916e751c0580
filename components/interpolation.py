r"""Interpolation between tabulated points in one and two dimensions. No components here.

On the interval between the knots x_p and x_{p+1} of width H, with A = (x_{p+1} - x)/H and B = (x - x_p)/H,

.. math:: y = A y_p + B y_{p+1} + \tfrac{H^2}{6} \left[ (A^3 - A) y_p'' + (B^3 - B) y_{p+1}'' \right]

is the natural cubic spline, whose second derivatives y'' solve a linear system of the knots alone and vanish at both
ends; without the bracket it is the straight line. Both are continued with the end slopes, so the spline and its first
two derivatives are continuous everywhere. A table of two dimensions is the product of two of one.
Source: Press et al., Numerical Recipes (3rd ed. 2007), sections 3.3 and 3.6.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from crescentlab.maths import event_where, maximum, minimum, piecewise, stack, total, where
from crescentlab.schedule import Schedule


def curvatures(knots: Sequence[float] | np.ndarray, values: np.ndarray, *, closed: bool = False) -> np.ndarray:
    """Second derivatives of the cubic spline at n knots from the values there, (n,) or (n, m).

    Zero at both ends; a ``closed`` one, whose first and last values are equal, goes on smoothly from its end to its
    beginning. Time and memory grow with n.
    """
    x, y = np.asarray(knots, dtype=float), np.asarray(values, dtype=float)
    h = np.diff(x)
    if closed:
        return _closed_curvatures(h, y)
    slopes = (np.diff(y, axis=0).T / h).T
    found = np.zeros_like(y)
    if x.size > 2:
        found[1:-1] = _tridiagonal(h[:-1] / 6, (h[:-1] + h[1:]) / 3, h[1:] / 6, np.diff(slopes, axis=0))
    return found


def _closed_curvatures(h: np.ndarray, y: np.ndarray) -> np.ndarray:
    """The same where the end is followed by the beginning (Press et al., section 2.7.2)."""
    before = np.roll(h, 1)
    slopes = (np.diff(y, axis=0).T / h).T
    jumps = slopes - np.roll(slopes, 1, axis=0)
    if h.size == 1:
        return np.zeros_like(y)
    if h.size == 2:  # both neighbours of a knot are the other one
        side, middle = h.sum() / 6, h.sum() / 3
        first = (middle * jumps[0] - side * jumps[1]) / (middle**2 - side**2)
        second = (middle * jumps[1] - side * jumps[0]) / (middle**2 - side**2)
        return np.array([first, second, first])
    corner = h[-1] / 6
    diagonal = (before + h) / 3
    diagonal[0] += corner
    diagonal[-1] += corner  # the matrix less a corner times (1, 0, ..., 0, -1) (1, 0, ..., 0, -1)
    ends = np.zeros(h.size)
    ends[0], ends[-1] = 1.0, -1.0
    both = _tridiagonal(before / 6, diagonal, h / 6, np.column_stack([jumps.reshape(h.size, -1), ends]))
    plain, by_ends = both[:, :-1], both[:, -1]
    share = corner / (1 - corner * (by_ends[0] - by_ends[-1]))
    found = (plain + np.outer(by_ends, share * (plain[0] - plain[-1]))).reshape(y[:-1].shape)
    return np.concatenate([found, found[:1]])


def _tridiagonal(low: np.ndarray, middle: np.ndarray, high: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solve low[k] x[k-1] + middle[k] x[k] + high[k] x[k+1] = right[k] (Press et al., section 2.4)."""
    n = middle.size
    pivots, x = middle.astype(float).copy(), right.astype(float).copy()
    for k in range(1, n):
        share = low[k] / pivots[k - 1]
        pivots[k] -= share * high[k - 1]
        x[k] -= share * x[k - 1]
    x[-1] /= pivots[-1]
    for k in range(n - 2, -1, -1):
        x[k] = (x[k] - high[k] * x[k + 1]) / pivots[k]
    return x


def weights(x: Any, knots: Sequence[float], *, spline: bool) -> tuple[Any, Any]:
    """What the values and the second derivatives at the knots count for at `x`: two vectors (n,).

    Straight lines have an event at each inner knot, where the slope jumps; splines need none.
    """
    at = np.asarray(knots, dtype=float)
    low, high, width = at[:-1], at[1:], np.diff(at)
    choose = where if spline else event_where
    above = choose(x > at[1:-1], np.ones(at.size - 2), np.zeros(at.size - 2))
    here = stack(1.0, above) - stack(above, 0.0)  # 1 on the interval of x, 0 on all others
    fore, aft = (high - x) / width, (x - low) / width
    values = stack(here * fore, 0.0) + stack(0.0, here * aft)
    if not spline:
        return values, None
    inside = minimum(maximum(x, at[0]), at[-1])
    fore_3, aft_3 = ((high - inside) / width) ** 3 - fore, ((inside - low) / width) ** 3 - aft
    sixth = here * (width * width / 6)
    return values, stack(sixth * fore_3, 0.0) + stack(0.0, sixth * aft_3)


Interpolation = Literal["linear", "spline"]
"""Straight lines between the points, or a natural cubic spline through them."""
Course = Literal["linear", "spline", "hold"]
"""The same, or each value held until the next."""
Beyond = Literal["hold", "slope", "repeat"]
"""Beyond the first and last point: their values, the slopes there, or the points again and again."""


@dataclass(frozen=True)
class Pieces:
    """Polynomials one after another: y = sum_j c_j (x - origin)^j, each from its ``begins`` on, the first from -inf.

    ``begins`` and ``origins`` (m,), ``coefficients`` c (m, columns, degree + 1).
    """

    begins: np.ndarray
    origins: np.ndarray
    coefficients: np.ndarray

    def __call__(self, x: Any, column: int = 0, *, flag_knots: bool = True) -> Any:
        """One column's value, on floats and symbols; unless told otherwise, each begin is an event."""
        found = self.coefficients[:, column]
        return piecewise(x, self.begins[1:], self.origins, found, flag_knots=flag_knots)

    def schedule(self) -> Schedule:
        """Rows of origin and coefficients, for a held vector that :func:`on_piece` reads; equal neighbours are one."""
        rows = np.column_stack([self.origins, self.coefficients.reshape(self.origins.size, -1)])
        constant = np.all(self.coefficients[:, :, 1:] == 0, axis=(1, 2))
        same = constant[1:] & constant[:-1] & np.all(self.coefficients[1:] == self.coefficients[:-1], axis=(1, 2))
        keep = np.concatenate([[True], np.logical_not(same)])
        return Schedule(self.begins[keep], rows[keep])


def on_piece(x: Any, piece: Any, column: int, degree: int) -> Any:
    """The value of a column on the piece whose origin and coefficients a schedule gave."""
    first = 1 + column * (degree + 1)
    y = piece[first + degree]
    for j in reversed(range(degree)):
        y = y * (x - piece[0]) + piece[first + j]
    return y


def pieces(
    x: Sequence[float] | np.ndarray,
    y: np.ndarray,
    course: Course,
    beyond: Beyond,
    reach: tuple[float, float] = (0.0, 0.0),
) -> Pieces:
    """Pieces through points whose ``x`` (n,) do not fall; ``y`` (n,) or (n, columns).

    Two points of one x are a jump, from the first of them to the last. What repeats covers ``reach``, from one x to
    another, every begin a knot plus a whole number of periods x_n - x_1.
    """
    xs, ys = np.asarray(x, dtype=float), np.asarray(y, dtype=float).reshape(len(x), -1)
    inner = _inner(xs, ys, course, closed=beyond == "repeat" and bool((ys[0] == ys[-1]).all()))
    degree = inner.shape[2] - 1
    low, high = np.zeros((2, 1, ys.shape[1], degree + 1))
    low[0, :, 0], high[0, :, 0] = ys[0], ys[-1]
    if beyond == "slope" and degree:
        rising = np.flatnonzero(np.diff(xs) > 0)
        h = xs[rising[-1] + 1] - xs[rising[-1]]
        low[0, :, 1] = inner[rising[0], :, 1]
        high[0, :, 1] = sum(j * inner[rising[-1], :, j] * h ** (j - 1) for j in range(1, degree + 1))
    some = np.diff(xs) > 0
    begins, inner = xs[:-1][some], inner[some]
    if beyond == "repeat":
        period = xs[-1] - xs[0]
        first, last = (math.floor((at - xs[0]) / period) for at in reach)
        shifts = np.repeat(period * np.arange(first - 1, last + 2), begins.size)
        begins = np.tile(begins, last - first + 3) + shifts
        return Pieces(_from_ever(begins), begins, np.tile(inner, (last - first + 3, 1, 1)))
    origins = np.concatenate([xs[:1], begins, xs[-1:]])
    return Pieces(_from_ever(np.concatenate([[0.0], origins[1:]])), origins, np.concatenate([low, inner, high]))


def _from_ever(begins: np.ndarray) -> np.ndarray:
    return np.concatenate([[-np.inf], begins[1:]])


def _inner(x: np.ndarray, y: np.ndarray, course: Course, *, closed: bool) -> np.ndarray:
    """Coefficients between the points (n - 1, columns, degree + 1); of what has no width, anything."""
    if course == "hold":
        return y[:-1, :, None]
    h = np.diff(x)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        slopes = np.diff(y, axis=0) / h
    if course == "linear":
        return np.stack([y[:-1], slopes], axis=2)
    bends = curvatures(x, y, closed=closed)
    left, right = bends[:-1], bends[1:]
    return np.stack([y[:-1], slopes - h * (2 * left + right) / 6, left / 2, (right - left) / (6 * h)], axis=2)


def surface(x: Any, y: Any, x_knots: Sequence[float], y_knots: Sequence[float], values: Any, *, spline: bool) -> Any:
    """The table of two dimensions at (x, y): bilinear, or the product of natural cubic splines; `values` (n, m)."""
    z = np.asarray(values, dtype=float)
    by_x, by_y = weights(x, x_knots, spline=spline), weights(y, y_knots, spline=spline)
    result = _between(by_x[0], z, by_y[0])
    if spline:
        along_x, along_y = curvatures(x_knots, z), curvatures(y_knots, z.T).T
        result = result + _between(by_x[1], along_x, by_y[0]) + _between(by_x[0], along_y, by_y[1])
        result = result + _between(by_x[1], curvatures(y_knots, along_x.T).T, by_y[1])
    return result


def _between(left: Any, matrix: np.ndarray, right: Any) -> Any:
    return total(left * stack(*[total(row * right) for row in matrix]))
