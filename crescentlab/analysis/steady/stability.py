"""Whether a circuit left alone near its operating point comes back: eigenvalues of the linearised equations.

Without ticks those of J = dF/dy. With ticks of one period dt [s] they follow from the multipliers mu of the map over
one tick, lambda = ln(mu)/dt: between ticks the states move by

.. math:: \\dot{\\Delta x} = A\\, \\Delta x + \\bigl(B_0 + (B_1 - B_0) \\tau / \\Delta t\\bigr) \\Delta h

A = df/dx, B_0 and B_1 = df/dh just after a tick and just before the next (held values interpolated in between, as the
end of a line does); at the tick the held values become T(x, h).
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
from scipy.linalg import eig, expm

from crescentlab.analysis.steady.rest import Point, Site, nonzeros, tick
from crescentlab.prepared import Evaluator, Prepared, jacobian, prepare
from crescentlab.system import System
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
    """Largest time constant [s] of the modes that die away."""

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
    """Of the unknowns ``active``; in words, why they were not looked at."""
    if active.size > MOST:
        return f"not looked at, more than {MOST} unknowns"
    if site.periods.size > 1:
        return "not looked at, ticks of several periods"
    if not active.size:
        return Stability(None, None, None)
    scale = site.scale(site.unknowns(point))[active]
    matrix = (_matrix(site, point)[np.ix_(active, active)] * scale) / scale[:, None]
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
        return Mode(complex(exponents[k]), site.names[active[_partaking(matrix, values[k])]])

    swings, dying = np.abs(exponents.imag) > rounding, exponents.real < -rounding
    slowest = float(np.max(-1 / exponents.real[dying])) if dying.any() else None
    return Stability(mode(exponents.real > rounding), mode((np.abs(exponents.real) <= rounding) & swings), slowest)


def _partaking(matrix: Array, value: complex) -> int:
    """The unknown that takes part most in a mode: the largest product of its left and right eigenvectors."""
    values, left, right = eig(matrix, left=True)
    k = int(np.argmin(np.abs(values - value)))
    return int(np.argmax(np.abs(left[:, k] * right[:, k])))


def _matrix(site: Site, point: Point) -> Array:
    """dF/dy, or with ticks the map of the unknowns over one of them; shape (N, N)."""
    if not site.periods.size:
        return np.asarray(site.rates(point)[1].toarray())
    system, dt = site.system, float(site.periods[0])
    n, k = system.x.numel(), system.h.numel()
    prepared, patterns = system.once("map over a tick", lambda: _map(system))
    A, B_0, B_1, X_x, X_h, T_x, T_h = _filled(patterns, Evaluator(prepared, site.values.p), site.t, point)
    whole = np.zeros((3 * n, 3 * n))  # exp(A dt), and the integrals of exp(A (dt - s)) and of exp(A (dt - s)) s over it
    whole[:n, :n], whole[:n, n : 2 * n], whole[n : 2 * n, 2 * n :] = A, np.eye(n), np.eye(n)
    grown, constant, linear = np.split(expm(whole * dt)[:n], 3, axis=1)
    moved = np.block([[grown, constant @ B_0 + linear @ (B_1 - B_0) / dt], [np.zeros((k, n)), np.eye(k)]])
    over = np.block([[X_x, X_h], [T_x, T_h]]) @ moved
    places = np.append(site.equations.states, n + site.equations.held)
    return np.asarray(over[np.ix_(places, places)])


def _filled(patterns: list[ca.Sparsity], pieces: Evaluator, t: float, point: Point) -> list[Array]:
    """The matrices of these patterns, in full."""
    found = []
    for pattern, values in zip(patterns, pieces(t, point.x, point.h, point.b), strict=True):
        matrix = Site.slopes(pattern)
        matrix.data[:] = values
        found.append(matrix.toarray())
    return found


def _map(system: System) -> tuple[Prepared, list[ca.Sparsity]]:
    """Derivatives of f after and before a tick, and of what the tick makes of states and held values."""
    arguments, dt = system.arguments, system.periods[0]
    flags = ca.SX.sym("fired", len(system.events))
    fired = [float(event.kind == "every") for event in system.events]
    slope = ca.Function("slope", arguments, [jacobian(system.f, system.h)])
    new = tick(system)(*arguments, flags)
    change = [jacobian(after, before) for after in new for before in (system.x, system.h)]
    x_on = system.x + ca.DM(system.counting_states.astype(float)) * system.f * dt
    later = [system.t + dt, x_on, system.h, system.b, system.p]
    outputs = [system.jacobian_expression, jacobian(system.f, system.h), slope(*later)]
    outputs += ca.Function("change", [*arguments, flags], change)(*later, fired)
    patterns = [matrix.sparsity() for matrix in outputs]
    return prepare("map", arguments[:-1], system.p, [nonzeros(o) for o in outputs], seldom=True), patterns
