r"""Waterfall of a run whose speed changes: lines per shaft revolution (orders) in windows of whole revolutions.

.. math:: A_n e^{j\varphi_n} = \frac{2}{\int w\, d\theta} \int_{\theta_j}^{\theta_j + 2\pi R} w\, y\,
          e^{-jn\theta}\, d\theta, \qquad \theta = \int \omega\, dt, \quad d\theta = \omega\, dt

n order [1/rev]; omega [rad/s] the shaft speed; theta [rad] its angle; R revolutions in a window; w the Hann window
1 - cos(theta/R) over it, or 1. The integrals are taken over the angle itself, on Gauss nodes of the run's smooth
pieces: nothing is resampled. Orders lie 1/R apart; with the Hann window a line spreads over +-2/R orders, so that whole
orders do not touch each other from R = 2 on. Source: Harris, Proc. IEEE 66 (1978) 51-83; order tracking by angle as in
Fyfe & Munck, Mech. Syst. Signal Process. 11 (1997) 187-205.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre

from crescentlab.analysis.spectrum.dense import ORDER, RUNNING, SERIES, SWING, Dense, Nodes, harmonics, running
from crescentlab.errors import InputError
from crescentlab.result import Result
from crescentlab.units import QUANTITIES, Quantity

Array = np.ndarray

HIGHEST_ORDER, MOST_ORDERS = 100.0, 10_000.0
REVOLUTIONS = 4
WINDOWS = ("hann", "whole")
"""Hann's window, or none: right for lines at whole orders whose amplitude does not change."""
FEW_REVOLUTIONS = 2
NEWTON = 60

speed = QUANTITIES["speed"]


@dataclass(frozen=True)
class Waterfall:
    """Lines over windows and orders."""

    name: str
    quantity: Quantity
    revolutions: int
    orders: Array
    """n, shape (k,)."""
    time: Array
    """Middle of each window [s], shape (m,)."""
    speed: Array
    """Mean shaft speed of each window [rad/s], shape (m,)."""
    lines: Array
    """A_n exp(j phi_n), SI, shape (m, k)."""
    mean: Array
    """Mean over the angle, shape (m,)."""

    @property
    def amplitude(self) -> Array:
        """Peak values A_n (SI), shape (m, k)."""
        return np.asarray(np.abs(self.lines))

    @property
    def frequency(self) -> Array:
        """n omega / 2 pi [Hz], shape (m, k)."""
        return np.asarray(np.outer(self.speed, self.orders) / (2 * np.pi))

    def strongest(self, count: int) -> list[int]:
        """Places of the orders that are strongest anywhere and are no flank of a stronger neighbour.

        What lies below one per revolution is the drift of the mean, and is left out.
        """
        most = np.where(self.orders < 1, 0.0, self.amplitude.max(axis=0))
        padded = np.concatenate([[0.0], most, [0.0]])
        peaks = np.flatnonzero((padded[1:-1] >= padded[:-2]) & (padded[1:-1] > padded[2:]))
        chosen = peaks[np.argsort(-most[peaks], kind="stable")][:count]
        return sorted(int(k) for k in chosen if most[k] > 0)


def waterfalls(
    result: Result, names: Sequence[str], shaft: str, *, revolutions: int = REVOLUTIONS, window: str = "hann",
    start: float | None = None, highest: float = HIGHEST_ORDER,
) -> list[Waterfall]:  # fmt: skip
    """Waterfalls of variables over the shaft whose speed is the variable ``shaft``, from ``start`` [s] to the end.

    A window begins at every revolution. Raises :class:`InputError` if ``shaft`` is no speed, turns back, or turns less
    than ``revolutions``.
    """
    if window not in WINDOWS:
        raise InputError(f"--window {window}: write one of {', '.join(WINDOWS)}")
    if revolutions < 1 or (window == "hann" and revolutions < FEW_REVOLUTIONS):
        raise InputError(
            f"--revolutions {revolutions}: a Hann window needs at least {FEW_REVOLUTIONS}, or whole orders run together"
        )
    if not 1 <= highest < MOST_ORDERS:
        raise InputError(f"--highest-order {highest:g}: write a number from 1 to {MOST_ORDERS:g}")
    if result.quantity(shaft) is not speed or len(result.elements(shaft)) != 1:
        raise InputError(f"--orders {shaft}: a waterfall needs the variable of a shaft's speed, as shaft.shaft.omega")
    turning = _turning(Dense(result, [shaft]), shaft, start)
    edges = _whole_revolutions(turning, revolutions)
    revs = 2 * np.pi / np.diff(edges)
    fastest = np.interp(edges, turning.t.ravel(), np.abs(turning.y).ravel())
    fastest = np.maximum(revs, np.maximum(fastest[1:], fastest[:-1]))
    dense = Dense(result, [shaft, *names])
    nodes = dense.nodes(edges, 2 * SWING / ((highest + 1) * fastest))
    rows = _per_revolution(nodes, edges, int(np.floor(highest * revolutions)) + 1, revolutions)
    mean, lines = _windows(rows, revolutions, window)
    middle = (edges[:-revolutions] + edges[revolutions:]) / 2
    mean_speed = 2 * np.pi * revolutions / (edges[revolutions:] - edges[:-revolutions])
    orders = np.arange(1, lines.shape[1] + 1) / revolutions
    asked = [k for k, name in enumerate(dense.names) if k or shaft in names]
    return [
        Waterfall(
            dense.names[k], result.quantity(dense.names[k]), revolutions, orders, middle, mean_speed, lines[:, :, k],
            mean[:, k],
        )
        for k in asked
    ]  # fmt: skip


def _turning(dense: Dense, shaft: str, start: float | None) -> Nodes:
    """The speed on nodes of the whole span; raises :class:`InputError` unless the shaft turns one way throughout."""
    begin = dense.start if start is None else max(start, dense.start)
    if not begin < dense.stop:
        raise InputError(f"--from {begin:g} s: the run ends at {dense.stop:g} s")
    nodes = dense.nodes([begin, dense.stop], (dense.stop - begin) / 50)
    low, high = float(nodes.y.min()), float(nodes.y.max())
    if low <= 0 <= high:
        raise InputError(
            f"--orders {shaft}: the shaft stands still or turns back ({speed.show(low, 'rpm')} to "
            f"{speed.show(high, 'rpm')}); begin where it turns (--from)"
        )
    return nodes


def _whole_revolutions(nodes: Nodes, least: int) -> Array:
    """Times [s] at which the shaft has made 0, 1, 2, ... revolutions; the last ones, if the run ends within one."""
    rate = np.abs(nodes.y[:, :, 0])
    series = rate @ SERIES.T
    half = (nodes.high - nodes.low) / 2
    angle = np.concatenate([[0.0], np.cumsum(2 * half * series[:, 0])])
    turns = angle[-1] / (2 * np.pi)
    count = int(np.floor(turns * (1 + 1e-12)))
    if count < least:
        raise InputError(
            f"the shaft makes {turns:.3g} revolutions in this run, fewer than the {least} of a window; simulate longer"
        )
    wanted = 2 * np.pi * np.arange(count + 1)
    piece = np.clip(np.searchsorted(angle, wanted, side="right") - 1, 0, half.size - 1)
    inner = series[piece] @ RUNNING.T * half[piece, None]
    low, high = np.full(wanted.size, -1.0), np.full(wanted.size, 1.0)
    for _ in range(NEWTON):  # bisection: the angle only grows
        middle = (low + high) / 2
        ahead = np.einsum("wk,wk->w", legendre.legvander(middle, ORDER), inner) < wanted - angle[piece]
        low, high = np.where(ahead, middle, low), np.where(ahead, high, middle)
    times = nodes.low[piece] + half[piece] * (1 + (low + high) / 2)
    times[0] = nodes.low[0]
    return np.asarray(np.minimum(times, nodes.high[-1]))


def _per_revolution(nodes: Nodes, edges: Array, count: int, revolutions: int) -> Array:
    """Integral of y exp(-j k theta/R) over each revolution, theta from its begin, shape (m, count + 1, v)."""
    rate = np.abs(nodes.y[:, :, 0])
    angle = running(nodes, rate)
    first = np.searchsorted(nodes.low, edges[:-1])
    last = np.append(first[1:], nodes.low.size)
    rows = np.empty((first.size, count + 1, nodes.y.shape[2]), complex)
    for j, (a, b) in enumerate(zip(first, last, strict=True)):
        theta = (angle[a:b] - 2 * np.pi * j).ravel()
        weighted = (nodes.weights[a:b] * rate[a:b])[:, :, None] * nodes.y[a:b]
        rows[j] = harmonics(theta / revolutions, weighted.reshape(theta.size, -1), count)
    return rows


def _windows(rows: Array, revolutions: int, window: str) -> tuple[Array, Array]:
    """Means (m, v) and lines (m, k, v) of each window, from the integrals of its revolutions.

    Hann's window is the difference of a line and half of both its neighbours.
    """
    turned = np.exp(-2j * np.pi * np.outer(np.arange(revolutions), np.arange(rows.shape[1])) / revolutions)
    count = rows.shape[0] - revolutions + 1
    whole = sum((rows[r : r + count] * turned[r][:, None] for r in range(revolutions)), np.zeros(()))
    lines = np.asarray(whole) / (2 * np.pi * revolutions)
    mean = lines[:, 0].real.copy()
    lines[:, 0] = 0  # the mean is no line, and leaks into none
    if window == "hann":
        lines[:, 1:-1] -= (lines[:, :-2] + lines[:, 2:]) / 2
    return mean, 2 * lines[:, 1:-1]
