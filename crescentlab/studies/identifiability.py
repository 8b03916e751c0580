r"""What a fit's Jacobian says of its parameters: standard errors, correlations, and what cannot be told apart.

With weighted residuals r(z) and J = dr/dz at the solution, z the logarithm of each positive parameter,

.. math:: C = (J^T J)^{-1}, \quad J N = U S V^T, \quad C = N V S^{-2} V^T N, \quad N = \mathrm{diag}(1/\lVert J_k\rVert)

J shape (m, p); S the singular values of J with its columns scaled to length 1. S_max/S_min is the condition of the
problem, 1/S_min the collinearity index. Directions of V whose singular value is 0 to rounding are not determined by
the data: parameters with a share in them have an infinite standard error.
Sources: Bates & Watts, *Nonlinear Regression Analysis* (1988), section 2; Brun, Reichert & Kuensch, *Water Resources
Research* 37 (2001) 1015, Eq. 7 (collinearity index).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

CORRELATED = 0.95
"""Two parameters of a larger correlation are named."""
SMALLEST = 1e-8
"""A singular value below this part of the largest is zero, at least: so much do exact derivatives err."""
SHARE = 0.3
"""Components of a weak direction below this part of its largest do not belong to it."""
CONDITION = 100.0
"""A condition above this is a weak direction even where no two parameters alone are correlated."""


@dataclass(frozen=True)
class Identifiability:
    """Covariance (p, p) and correlation (p, p) of the parameters, singular values (p,), the matrix V (p, p)."""

    covariance: np.ndarray
    correlation: np.ndarray
    singular_values: np.ndarray
    directions: np.ndarray
    """Columns are the directions of the singular values, in parameters scaled to an equal effect."""
    effects: np.ndarray
    """Length of each parameter's column of J, shape (p,)."""

    @property
    def condition(self) -> float:
        """Largest over smallest singular value, infinite if that is 0."""
        smallest = self.singular_values[-1]
        return float(self.singular_values[0] / smallest) if smallest > 0 else float("inf")

    @property
    def collinearity(self) -> float:
        """Collinearity index: how much of an effect others can undo."""
        smallest = self.singular_values[-1]
        return float(1 / smallest) if smallest > 0 else float("inf")


def analyse(jacobian: np.ndarray, smallest: float = SMALLEST) -> Identifiability:
    """Covariance and weak directions of weighted residuals' Jacobian, shape (m, p), for unit variance.

    ``smallest`` is the part of the largest singular value below which one is zero: the Jacobian's own error.
    """
    p = jacobian.shape[1]
    effects = np.linalg.norm(jacobian, axis=0)
    seen = effects > smallest * max(float(effects.max(initial=0.0)), np.finfo(float).tiny)
    lengths = np.where(seen, effects, 1.0)
    padded = np.vstack([np.where(seen, jacobian / lengths, 0.0), np.zeros((p, p))])  # p singular values, if m < p too
    _, s, vt = np.linalg.svd(padded, full_matrices=False)
    s = np.where(s > smallest * s[0], s, 0.0)
    inverse = 1 / np.where(s > 0, s, smallest)
    roots = vt.T * inverse  # (p, p), its square is the covariance of scaled parameters
    covariance = roots @ roots.T
    sd = np.sqrt(np.diag(covariance))
    correlation = np.clip(covariance / np.outer(sd, sd), -1, 1)
    correlation[~seen, :] = correlation[:, ~seen] = 0.0
    np.fill_diagonal(correlation, 1.0)
    undetermined = (np.abs(vt[s == 0]) > np.sqrt(smallest)).any(axis=0) | ~seen
    covariance = covariance / np.outer(lengths, lengths)
    covariance[undetermined, :] = covariance[:, undetermined] = np.nan
    covariance[undetermined, undetermined] = np.inf
    return Identifiability(covariance, correlation, s, vt.T, np.where(seen, effects, 0.0))


@dataclass(frozen=True)
class Weakness:
    """Parameters, by number, that the data cannot tell apart, and why this is said."""

    members: tuple[int, ...]
    reason: str
    exact: bool = False
    """The direction is undetermined, not merely weak."""
    powers: tuple[float, ...] = ()
    """Of an exact direction: the changes of z of the members that leave the data as they are, the first being 1."""


def weaknesses(found: Identifiability) -> list[Weakness]:
    """Every group of parameters that cannot be told apart: exact directions, pairs, larger groups."""
    told: list[Weakness] = [
        Weakness((int(k),), "has no effect on the measured values", True) for k in np.flatnonzero(found.effects == 0)
    ]
    dead = {w.members[0] for w in told}
    s, v = found.singular_values, found.directions
    for k in np.flatnonzero(s == 0):
        members = _members(v[:, k], dead)
        if len(members) > 1:
            change = v[list(members), k] / found.effects[list(members)]
            told.append(Weakness(members, "only together", True, tuple((change / change[0]).tolist())))
    for a, b in combinations(range(len(s)), 2):
        strength = float(found.correlation[a, b])
        if abs(strength) > CORRELATED and not _known((a, b), told):
            told.append(Weakness((a, b), f"correlation {_rounded(strength)}"))
    weakest = _members(v[:, -1], dead)
    if found.condition > CONDITION and len(weakest) > 1 and not any(set(w.members) <= set(weakest) for w in told):
        told.append(Weakness(weakest, f"condition {found.condition:.3g}"))
    return told


def _rounded(strength: float) -> str:
    """A correlation with as many digits as tell it from 1, at most six."""
    digits = next((d for d in (3, 4, 5, 6) if abs(round(strength, d)) < 1), None)
    return f"{strength:.{digits}f}" if digits else f"{np.sign(strength):.0f}"


def _members(direction: np.ndarray, dead: set[int]) -> tuple[int, ...]:
    size = np.abs(direction)
    return tuple(int(k) for k in np.flatnonzero(size > SHARE * size.max()) if int(k) not in dead)


def _known(pair: tuple[int, int], told: Sequence[Weakness]) -> bool:
    return any(set(pair) <= set(w.members) for w in told)


def sentence(weakness: Weakness, names: Sequence[str], relative: Callable[[int], bool]) -> str:
    """The weakness in words; ``relative(k)`` says whether z is the logarithm of parameter k."""
    called = [names[k] for k in weakness.members]
    if len(called) == 1:
        return f"{called[0]} {weakness.reason}; take it out of parameters:"
    listed = f"{', '.join(called[:-1])} and {called[-1]}"
    if not weakness.exact:
        return f"{listed} can hardly be told apart ({weakness.reason})"
    if all(relative(k) for k in weakness.members):
        if len(called) == 2 and abs(weakness.powers[1] + 1) < 0.02:
            return f"{listed} cannot be told apart: the data fix only their product"
        if len(called) == 2 and abs(weakness.powers[1] - 1) < 0.02:
            return f"{listed} cannot be told apart: the data fix only their ratio"
    return f"{listed} cannot be told apart: a change of one is undone by the other{'s' if len(called) > 2 else ''}"
