r"""Interpolation between tabulated points in one and two dimensions. No components here.

On the interval between the knots x_p and x_{p+1} of width H, with A = (x_{p+1} - x)/H and B = (x - x_p)/H,

.. math:: y = A y_p + B y_{p+1} + \tfrac{H^2}{6} \left[ (A^3 - A) y_p'' + (B^3 - B) y_{p+1}'' \right]

is the natural cubic spline, whose second derivatives y'' solve a linear system of the knots alone and vanish at both
ends; without the bracket it is the straight line. Both are continued with the end slopes, so the spline and its first
two derivatives are continuous everywhere. A table of two dimensions is the product of two of one.
Source: Press et al., Numerical Recipes (3rd ed. 2007), sections 3.3 and 3.6.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from crescentlab.maths import event_where, maximum, minimum, stack, total, where


def curvatures(knots: Sequence[float]) -> np.ndarray:
    """The matrix (n, n) that makes the second derivatives at n knots of the values there, zero at both ends."""
    x = np.asarray(knots, dtype=float)
    n, h = x.size, np.diff(x)
    left, right = np.eye(n), np.zeros((n, n))
    for k in range(1, n - 1):
        left[k, k - 1 : k + 2] = h[k - 1] / 6, (h[k - 1] + h[k]) / 3, h[k] / 6
        right[k, k - 1 : k + 2] = 1 / h[k - 1], -1 / h[k - 1] - 1 / h[k], 1 / h[k]
    return np.asarray(np.linalg.solve(left, right))


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


def spline(x: Any, knots: Sequence[float], values: Sequence[float]) -> Any:
    """The natural cubic spline through the points, at `x`."""
    y = np.asarray(values, dtype=float)
    of_values, of_curvatures = weights(x, knots, spline=True)
    return total(of_values * y) + total(of_curvatures * (curvatures(knots) @ y))


def surface(x: Any, y: Any, x_knots: Sequence[float], y_knots: Sequence[float], values: Any, *, spline: bool) -> Any:
    """The table of two dimensions at (x, y): bilinear, or the product of natural cubic splines; `values` (n, m)."""
    z = np.asarray(values, dtype=float)
    by_x, by_y = weights(x, x_knots, spline=spline), weights(y, y_knots, spline=spline)
    result = _between(by_x[0], z, by_y[0])
    if spline:
        d_x, d_y = curvatures(x_knots), curvatures(y_knots)
        result = result + _between(by_x[1], d_x @ z, by_y[0]) + _between(by_x[0], z @ d_y.T, by_y[1])
        result = result + _between(by_x[1], d_x @ z @ d_y.T, by_y[1])
    return result


def _between(left: Any, matrix: np.ndarray, right: Any) -> Any:
    return total(left * stack(*[total(row * right) for row in matrix]))
