"""Linear model of a circuit with ticks: the exact map from just after one tick to just after the next.

Between ticks the variation obeys, along the operating point,

.. math:: \\dot{\\delta x} = J_x(\\tau)\\,\\delta x + J_h(\\tau)\\,\\delta h + B(\\tau)\\,u(\\tau), \\; 0 \\le \\tau < T

with the held values h constant, and the tick maps (x, h) by its own derivative. Input u = e^{j omega tau} is carried
through the interval exactly, as its power series, so the response at the ticks is that to a continuous sine.
Magnus integrators of fourth order (Iserles & Norsett, Phil. Trans. R. Soc. A 357 (1999) 983-1019) on steps that are
halved until the map stands still.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from crescentlab.analysis.linear.derivatives import Derivatives, Point
from crescentlab.errors import InputError
from crescentlab.system import System

Array = np.ndarray

POWERS = 22
"""Terms of the series of e^{j omega T}: at the Nyquist frequency, omega T = pi, the rest is pi^22/22! = 8e-11."""
FIRST_STEPS, MOST_STEPS = 2, 64
"""Steps of a tick's interval, first try and last."""
CHANGE = 1e-8
"""Change of the scaled map from halved steps below which it is taken."""
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
    scale: Array


def tick_period(system: System, p: Array, place: dict[str, str] | None = None) -> float | None:
    """The one period of all ticks [s]; None without ticks; raises :class:`InputError` for several."""
    names = [event.name for event in system.events if event.kind == "every"]
    if not names:
        return None
    periods = np.array(system.period(p)).ravel()
    if np.ptp(periods) > 1e-12 * periods[0]:
        shown = ", ".join(f"{n} every {t * 1e6:.4g} us" for n, t in zip(names, periods, strict=True))
        raise InputError(
            f"the ticks have several periods ({shown}); a linear model needs one: give these parts equal periods "
            "(for lines: internal_nodes and courant_number), or make them part of the differential equations"
        )
    return float(periods[0])


def tick_map(derivatives: Derivatives, point: Point, directions: Array, units: Array) -> TickMap:
    """Map over one tick from ``point``, just after a tick; ``directions`` (places, inputs) is dp/du.

    ``units`` (n + k + inputs,): sizes by which states, held values and inputs are scaled.
    """
    system = derivatives.system
    period = tick_period(system, point.p)
    assert period is not None
    rate = np.where(system.counting_states, derivatives.at(point).f, 0.0)
    interval = _Interval(derivatives, point, directions, units, period, rate)
    steps = FIRST_STEPS
    flow = interval.flow(steps)
    while True:
        steps *= 2
        finer = interval.flow(steps)
        change = float(np.abs(finer - flow).max() / max(1.0, np.abs(finer).max()))
        flow = finer
        if change < CHANGE or steps >= MOST_STEPS:
            break
    n, k, m = system.x.numel(), system.h.numel(), directions.shape[1]
    end = point.moved(t=point.t + period, x=point.x + rate * period)
    value, by_z, by_p = derivatives.remap(end)
    scaled = by_z * units[: n + k] / units[: n + k, None]
    before = np.zeros((n + k, n + k + m * POWERS))
    before[:n, :n] = flow[:, :n]
    before[:n, n + interval.used] = flow[:, n : n + interval.used.size]
    before[:n, n + k :] = flow[:, n + interval.used.size :]
    before[n:, n : n + k] = np.eye(k)
    whole = scaled @ before
    powers = whole[:, n + k :].reshape(n + k, m, POWERS).transpose(0, 2, 1)
    direct = by_p @ directions * units[n + k :] / units[: n + k, None]
    moved = value - np.concatenate([end.x, end.h])
    speeds = interval.fastest
    return TickMap(
        whole[:, : n + k], powers, direct, by_z, period, speeds, moved / units[: n + k], change, units[: n + k]
    )


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
        pattern = self._matrices(0.0)[1], self._matrices(period / 2)[1], self._matrices(period)[1]
        self.used = np.flatnonzero(sum(np.abs(p) for p in pattern).any(axis=0)) if k else self.used

    def _matrices(self, tau: float) -> tuple[Array, Array, Array]:
        local = self.derivatives.at(self.point.moved(t=self.point.t + tau, x=self.point.x + self.rate * tau))
        self.fastest = np.maximum(self.fastest, np.abs(local.f))
        f_x = local.f_x * self.x_units / self.x_units[:, None]
        f_h = (local.f_h * self.h_units / self.x_units[:, None])[:, self.used]
        f_u = local.f_p @ self.directions * self.u_units / self.x_units[:, None]
        return f_x, f_h, f_u

    def parts(self, tau: float) -> tuple[Array, Array]:
        """Scaled J_x and what drives it: by the held values that f reads, then by the powers of each input."""
        f_x, f_h, f_u = self._matrices(tau)
        drive = np.zeros((f_x.shape[0], f_h.shape[1] + f_u.shape[1] * POWERS))
        drive[:, : f_h.shape[1]] = f_h
        drive[:, f_h.shape[1] :: POWERS] = f_u
        return f_x, drive

    def shift(self) -> Array:
        """How held values (not at all) and powers go on by themselves: (tau/T)^k/k! grows by the power below it."""
        k, m = self.used.size, self.directions.shape[1]
        rate = np.zeros((k + m * POWERS,) * 2)
        for j in range(POWERS - 1):
            rows = k + POWERS * np.arange(m) + j
            rate[rows, rows + 1] = 1 / self.period
        return rate

    def flow(self, steps: int) -> Array:
        """x at the end per (x, held values, powers) at the begin, shape (n, n + k + m POWERS)."""
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
