"""Whether a circuit left alone near its operating point comes back: eigenvalues of the linearised equations.

Without ticks those of J = dF/dy. With ticks of one period dt [s] they follow from the multipliers mu of the map over
one tick (:mod:`crescentlab.analysis.tick_map`), lambda = ln(mu)/dt.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eig

from crescentlab.analysis import derivatives
from crescentlab.analysis.steady.rest import Point, Site
from crescentlab.analysis.tick_map import tick_map
from crescentlab.errors import SimulationError
from crescentlab.units import QUANTITIES

Array = np.ndarray

MOST = 1200
"""Most unknowns whose eigenvalues are looked for."""
ROUNDING = 1e4 * np.finfo(float).eps
"""Real parts below this share of the largest eigenvalue are 0 to rounding."""


@dataclass(frozen=True)
class Mode:
    """An eigenvalue [1/s] and the unknown that takes part most in its mode."""

    eigenvalue: complex
    name: str

    @property
    def swing(self) -> str:
        """Its frequency as text."""
        return QUANTITIES["frequency"].show(abs(self.eigenvalue.imag) / (2 * np.pi), "Hz", 3)


@dataclass(frozen=True)
class Stability:
    """What the eigenvalues say."""

    growing: Mode | None
    """The mode that grows most quickly, None if none does."""
    undamped: Mode | None
    """A mode that swings for ever, None if none does."""
    slowest: float | None
    """Largest time constant [s], where all modes die away: else a disturbance does not, and there is none."""

    def warnings(self) -> list[str]:
        """What a transient would do to the point."""
        if self.growing is not None:
            after = QUANTITIES["time"].show(1 / self.growing.eigenvalue.real, "ms", 3)
            how = f" and swings at {self.growing.swing}" if self.growing.eigenvalue.imag else ""
            return [f"the point is unstable: a disturbance of {self.growing.name} grows e-fold in {after}{how}"]
        if self.undamped is not None:
            return [f"nothing damps {self.undamped.name}: once disturbed, it swings at {self.undamped.swing} for ever"]
        return []


def stability(site: Site, point: Point, active: Array) -> Stability | str:
    """Of the unknowns ``active``, copies with them; in words, why they were not looked at."""
    places = site.equations.places[np.isin(site.equations.own, active)]
    if places.size > MOST:
        return f"not looked at, more than {MOST} unknowns"
    if site.periods.size > 1:
        return "not looked at, ticks of several periods"
    if not places.size:
        return Stability(None, None, None)
    try:
        matrix = _matrix(site, point)[np.ix_(places, places)]
    except SimulationError as error:
        return f"not looked at, {error}"
    values = np.linalg.eigvals(matrix)
    exponents, rounding = values.astype(complex), ROUNDING * np.abs(values).max()
    if site.periods.size:
        dt = float(site.periods[0])
        values = values[np.abs(values) > ROUNDING]
        exponents, rounding = np.log(values.astype(complex)) / dt, ROUNDING / dt

    def mode(which: Array) -> Mode | None:
        if not which.any():
            return None
        k = int(np.argmax(np.where(which, exponents.real, -np.inf)))
        return Mode(complex(exponents[k]), names[places[_partaking(matrix, values[k])]])

    names = [*site.system.state_names, *site.system.held_names]
    swings, dying = np.abs(exponents.imag) > rounding, exponents.real < -rounding
    growing, undamped = mode(exponents.real > rounding), mode((np.abs(exponents.real) <= rounding) & swings)
    lasting = growing is not None or undamped is not None or not dying.any()
    return Stability(growing, undamped, None if lasting else float(np.max(-1 / exponents.real[dying])))


def _partaking(matrix: Array, value: complex) -> int:
    """The unknown that takes part most in a mode: the largest product of its left and right eigenvectors."""
    values, left, right = eig(matrix, left=True)
    k = int(np.argmin(np.abs(values - value)))
    return int(np.argmax(np.abs(left[:, k] * right[:, k])))


def _matrix(site: Site, point: Point) -> Array:
    """Of all states and held values, scaled: df/dx of the states, or with ticks the map over one of them; (n + k)^2."""
    system = site.system
    sizes = np.append(system.nominal, [quantity.nominal for quantity in system.held_quantities])
    sizes += np.abs(np.append(point.x, point.h))
    at = derivatives.Point(site.t, point.x, point.h, point.b, site.values.p)
    if not site.periods.size:
        matrix = np.zeros((sizes.size,) * 2)
        places = site.equations.states
        matrix[np.ix_(places, places)] = site.rates(point)[1].toarray()
        return np.asarray(matrix * sizes / sizes[:, None])
    local = derivatives.Derivatives(system, [], [])
    found = tick_map(local, at, float(site.periods[0]), np.zeros((0, 0)), sizes)
    if found.doubt:
        raise SimulationError(found.doubt)
    return found.matrix
