r"""Whether a fit's standard errors can be believed: the growth of chi2 two of them away, others fitted anew.

.. math:: g = \frac{\min_{u_j, j \ne k} \chi^2(u_k = \hat u_k \pm 2 s_k) - \hat\chi^2}{4}

1 of a linear model. Source: the profile t of Bates & Watts, *Nonlinear Regression Analysis* (1988), section 6.1.2,
at two points of one parameter.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

MOST_STEPS = 8
"""Steps of the other parameters while one is held."""
HALVINGS = 3
LEAST_PART = 0.5
SMALL_GAIN = 0.05
"""Of chi2: the end of the steps."""

Array = np.ndarray
Residuals = Callable[[Array], Array]


@dataclass(frozen=True)
class Linearity:
    """The parameter of the largest standard error, and g with it held below and above, at most at a bound.

    NaN where a bound leaves less than half of the two standard errors, and where runs fail.
    """

    worst: int
    growth: tuple[float, float]
    rise: tuple[float, float]
    """Of chi2 itself, at the two ends."""
    ends: tuple[Array, Array]
    """u there, the others fitted anew, shapes (p,)."""

    @property
    def flattest(self) -> int:
        """The side of the smaller growth: 0 below, 1 above."""
        return int(np.argmin([np.inf if np.isnan(g) else g for g in self.growth]))


def linearity(residuals: Residuals, u: Array, jacobian: Array, covariance: Array) -> Linearity:
    """Judge a solution u, with bounds 0 and 1.

    ``residuals`` are weighted, shape (m,), NaN where a run fails; Jacobian (m, p) and covariance (p, p) are by u.
    """
    errors = np.sqrt(np.diag(covariance))
    worst = int(np.argmax(np.where(np.isfinite(errors), errors, -1.0)))
    if not np.isfinite(errors[worst]):
        return Linearity(worst, (float("nan"), float("nan")), (float("nan"), float("nan")), (u, u))
    best = residuals(u)
    along = 2 * covariance[:, worst] / errors[worst]
    along = np.where(np.isfinite(along), along, 0.0)  # parameters that are not determined stay where they are
    room = (u[worst] / along[worst], (1 - u[worst]) / along[worst])
    parts = [min(1.0, float(r)) for r in room]
    found = [
        _least(residuals, u + side * part * along, worst, jacobian) for side, part in zip((-1, 1), parts, strict=True)
    ]
    below, above = (chi2 - float(best @ best) for chi2, _ in found)
    growth = [r / (2 * p) ** 2 if p > LEAST_PART else float("nan") for r, p in zip((below, above), parts, strict=True)]
    return Linearity(worst, (growth[0], growth[1]), (below, above), (found[0][1], found[1][1]))


def _step(residuals: Residuals, u: Array, free: Array, step: Array) -> tuple[Array, Array | None]:
    """The step within the bounds, halved until every run succeeds, and the residuals there; None if that fails."""
    for _ in range(HALVINGS):
        after = u.copy()
        after[free] = np.clip(u[free] + step, 0, 1)
        new = residuals(after)
        if np.isfinite(new).all():
            return (after - u)[free], new
        step = step / 2
    return step, None


def _least(residuals: Residuals, u: Array, held: int, jacobian: Array) -> tuple[float, Array]:
    """Least chi2 with one parameter held where it is in u, and where; NaN where runs fail.

    The others follow by Gauss-Newton steps, the Jacobian being brought up to date by Broyden's formula.
    """
    free = np.arange(u.size) != held
    slopes = jacobian[:, free].copy()
    u = np.clip(u, 0, 1)
    residual = residuals(u)
    least = float(residual @ residual)
    for _ in range(MOST_STEPS if free.any() and np.isfinite(least) else 0):
        step, new = _step(residuals, u, free, -np.linalg.lstsq(slopes, residual, rcond=None)[0])
        if new is None:
            return float("nan"), u
        if not step.any():
            break
        gain = least - float(new @ new)
        slopes += np.outer(new - residual - slopes @ step, step) / (step @ step)
        if gain > 0:
            u[free] += step
            residual, least = new, float(new @ new)
        if abs(gain) < SMALL_GAIN:
            break
    return least, u
