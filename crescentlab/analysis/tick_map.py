"""The map over one tick: variations of states and held values just after the next tick from those just after this one.

Between ticks the variation obeys, along the operating point,

.. math:: \\dot{\\delta x} = J_x(\\tau)\\,\\delta x + J_h(\\tau)\\,\\delta h + B(\\tau)\\,u(\\tau), \\; 0 \\le \\tau < T

with the held values h constant, and the tick maps (x, h) by its own derivative. Input u = e^{j omega tau} is carried
through the interval exactly, as its power series, so the response at the ticks is that to a continuous sine; and so is
a J_h that grows evenly (held values interpolated in between, as the end of a line does), however fast the states are.
Magnus integrators of fourth order (Iserles & Norsett, Phil. Trans. R. Soc. A 357 (1999) 983-1019) on steps that are
halved until the map stands still.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from crescentlab.analysis.derivatives import Derivatives, Point

Array = np.ndarray

POWERS = 22
"""Terms of the series of e^{j omega T}: at the Nyquist frequency, omega T = pi, the rest is pi^22/22! = 8e-11."""
FIRST_STEPS, MOST_STEPS = 2, 64
"""Steps of a tick's interval, first try and last."""
CHANGE, POOR = 1e-8, 1e-6
"""Change of the scaled map from halved steps below which it is taken, and above which it is poorly known."""
SERIES_SIZE, SERIES_TERMS = 0.5, 14
"""Norm up to which an exponential is summed, and its terms: the rest is 0.5^15/15! = 2e-17."""


@dataclass(frozen=True)
class TickMap:
    """delta z after a tick from that after the last: matrix, response to (tau/T)^k/k!, and to u at the tick itself.

    z = (x, h) in units of ``scale``. ``rest``: z after the tick less z before, and the largest f on the way.
    """

    matrix: Array
    powers: Array
    """Shape (z, POWERS, inputs)."""
    direct: Array
    by_remap: Array
    """Derivative of the tick's remap alone, in SI, shape (z, z)."""
    period: float
    rate: Array
    step: Array
    change: float
    """What the last halving of the steps changed."""
    scale: Array

    @property
    def doubt(self) -> str | None:
        """Says that the map is poorly known, if it is."""
        if self.change <= POOR:
            return None
        return f"the map over a tick is known to {self.change:.1g} only: a part is too fast for it"


def tick_map(derivatives: Derivatives, point: Point, period: float, directions: Array, units: Array) -> TickMap:
    """Map over one tick of ``period`` [s] from ``point``, just after a tick; ``directions`` (places, inputs) is dp/du.

    ``units`` (n + k + inputs,): sizes by which states, held values and inputs are scaled. Raises
    :class:`SimulationError` for derivatives that are not finite.
    """
    system = derivatives.system
    n, k, m = system.x.numel(), system.h.numel(), directions.shape[1]
    scale = units[: n + k]
    rate = np.where(system.counting_states, derivatives.at(point).f, 0.0)
    interval = _Interval(derivatives, point, directions, units, period, rate)
    before, change = interval.converged()
    end = point.moved(t=point.t + period, x=point.x + rate * period)
    value, by_z, by_p = derivatives.remap(end)
    whole = (by_z * scale / scale[:, None]) @ before
    powers = whole[:, n + k :].reshape(n + k, m, POWERS).transpose(0, 2, 1)
    direct = by_p @ directions * units[n + k :] / scale[:, None]
    moved = value - np.concatenate([end.x, end.h])
    return TickMap(whole[:, : n + k], powers, direct, by_z, period, interval.fastest, moved / scale, change, scale)


class _Interval:
    """The variational equation between two ticks, scaled."""

    def __init__(
        self, derivatives: Derivatives, point: Point, directions: Array, units: Array, period: float, rate: Array
    ) -> None:
        self.derivatives, self.point, self.directions = derivatives, point, directions
        self.period, self.rate = period, rate
        n, k = point.x.size, point.h.size
        self.x_units, self.h_units, self.u_units = units[:n], units[n : n + k], units[n + k :]
        self.fastest = np.zeros(n)
        """Largest magnitude of f met on the way."""
        self.used = np.arange(k)
        """Held values that f reads."""
        first, middle, last = (self._matrices(tau)[1] for tau in (0.0, period / 2, period))
        self.used = np.flatnonzero((np.abs(first) + np.abs(middle) + np.abs(last)).any(axis=0))
        rise = (last - first)[:, self.used]
        self.rising = np.flatnonzero(rise.any(axis=0))
        """Which of those it reads more or less as time goes on, and by how much over the tick, were it evenly."""
        self.rise = rise[:, self.rising]

    def _matrices(self, tau: float) -> tuple[Array, Array, Array]:
        local = self.derivatives.at(self.point.moved(t=self.point.t + tau, x=self.point.x + self.rate * tau))
        self.fastest = np.maximum(self.fastest, np.abs(local.f))
        f_x = local.f_x * self.x_units / self.x_units[:, None]
        f_h = (local.f_h * self.h_units / self.x_units[:, None])[:, self.used]
        f_u = local.f_p @ self.directions * self.u_units / self.x_units[:, None]
        return f_x, f_h, f_u

    def parts(self, tau: float) -> tuple[Array, Array]:
        """Scaled J_x and what drives it: the held values that f reads, the powers of each input, the even rises."""
        f_x, f_h, f_u = self._matrices(tau)
        f_h[:, self.rising] -= self.rise * tau / self.period
        powers = np.zeros((f_x.shape[0], f_u.shape[1] * POWERS))
        powers[:, ::POWERS] = f_u
        return f_x, np.hstack([f_h, powers, self.rise])

    def shift(self) -> Array:
        """How all that drives goes on by itself: (tau/T)^k/k! grows by the power below it, (tau/T) h by h, h not."""
        k, m, r = self.used.size, self.directions.shape[1], self.rising.size
        rate = np.zeros((k + m * POWERS + r,) * 2)
        for j in range(POWERS - 1):
            rows = k + POWERS * np.arange(m) + j
            rate[rows, rows + 1] = 1 / self.period
        rate[k + m * POWERS + np.arange(r), self.rising] = 1 / self.period
        return rate

    def converged(self) -> tuple[Array, float]:
        """(x, h) at the end per (x, h, powers) at the begin, by steps halved until it stands still; the last change."""
        steps, change = FIRST_STEPS, np.inf
        flow = self.flow(steps)
        while not change < CHANGE and steps < MOST_STEPS:
            steps *= 2
            finer = self.flow(steps)
            change = float(np.abs(finer - flow).max(initial=0.0) / max(1.0, np.abs(finer).max(initial=0.0)))
            flow = finer
        n, k, used = self.point.x.size, self.point.h.size, self.used.size
        whole = np.zeros((n + k, n + k + self.directions.shape[1] * POWERS))
        whole[:n, :n] = flow[:, :n]
        whole[:n, n + self.used] = flow[:, n : n + used]
        whole[:n, n + k :] = flow[:, n + used : flow.shape[1] - self.rising.size]
        whole[n:, n : n + k] = np.eye(k)
        return whole, change

    def flow(self, steps: int) -> Array:
        """x at the end per x and all that drives it at the begin, shape (n, n + used + m POWERS + rising)."""
        h = self.period / steps
        offset = np.sqrt(3) / 6
        n, N = self.point.x.size, self.shift()
        own, forced, carried = np.eye(n), np.zeros((n, len(N))), np.eye(len(N))
        for step in range(steps):
            (a, p), (b, q) = (self.parts((step + 0.5 + side * offset) * h) for side in (-1, 1))
            corner = np.sqrt(3) / 12 * h * h
            # the commutator of two block triangular matrices [[a, p], [0, N]] and [[b, q], [0, N]]
            A = h / 2 * (a + b) + corner * (b @ a - a @ b)
            B = h / 2 * (p + q) + corner * (b @ p + q @ N - a @ q - p @ N)
            E, F, S = block_exponential(A, B, h * N)
            own, forced, carried = E @ own, E @ forced + F @ carried, S @ carried
        return np.hstack([own, forced])


def block_exponential(A: Array, B: Array, N: Array) -> tuple[Array, Array, Array]:
    """E, F and S of exp [[A, B], [0, N]] = [[E, F], [0, S]], by scaling, Taylor series and squaring.

    As often as A is halved, E <- E E, F <- E F + F S, S <- S S: the cost is that of products of A's few rows, where a
    general exponential pays for all of N. Source: N. J. Higham, Functions of Matrices (2008), chapter 10.
    """
    size = max(float(np.abs(A).sum(axis=0).max(initial=0.0)), float(np.abs(N).sum(axis=0).max(initial=0.0)))
    halvings = max(0, math.ceil(math.log2(size / SERIES_SIZE))) if size > 0 else 0
    scale = 2.0**-halvings
    A, B, N = A * scale, B * scale, N * scale
    E, F, S = np.eye(len(A)) + A, B.copy(), np.eye(len(N)) + N
    a, f, s = A, B, N
    for k in range(2, SERIES_TERMS + 1):
        a, f, s = A @ a / k, (A @ f + B @ s) / k, N @ s / k
        E, F, S = E + a, F + f, S + s
    for _ in range(halvings):
        E, F, S = E @ E, E @ F + F @ S, S @ S
    return E, F, S
