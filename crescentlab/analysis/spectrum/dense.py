r"""Integrals over a run to rounding: its dense output on Gauss nodes, split until they see all of it.

Between events every variable is smooth. Each smooth piece is split until the last two coefficients of its Legendre
series are rounding, so that the Gauss-Legendre rule, exact to twice that degree, is exact to rounding too. Nothing is
sampled on a grid: jumps lie between pieces, and there is no aliasing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.polynomial import legendre

from crescentlab.errors import InputError
from crescentlab.result import Result

Array = np.ndarray

ORDER = 8
"""Nodes per piece: states are polynomials of degree 3 or 4, so that products of two of them are still exact."""
NODES, WEIGHTS = legendre.leggauss(ORDER)
SERIES = (legendre.legvander(NODES, ORDER - 1) * WEIGHTS[:, None]).T * (np.arange(ORDER)[:, None] + 0.5)
"""Coefficients of the Legendre series from the values at the nodes."""
RUNNING = legendre.legint(np.eye(ORDER), lbnd=-1)
"""Legendre series of the integral from the left end, from the coefficients of what is integrated."""
TOLERANCE = 1e-12
"""What a piece may contribute to a mean, over the largest value of the variable."""
MOST_HALVINGS, MOST_PIECES = 40, 300_000
"""Where splitting ends; the error that is then left is told."""
MOST_TIMES = 50_000
"""Times evaluated at once."""
AFRESH = 32
"""Harmonics after which powers of exp(-j angle) are taken afresh, before their rounding adds up."""
SWING = 2.0
"""Half of the angle [rad] that the fastest line turns in a piece: eight nodes integrate exp(2j s) to 1e-13."""


@dataclass(frozen=True)
class Nodes:
    """Variables on the Gauss nodes of smooth pieces: t, weights (s, 8), values y (s, 8, v)."""

    low: Array
    """Begin of each piece [s], shape (s,)."""
    high: Array
    t: Array
    weights: Array
    """Times [s]: the sum over nodes of weights times y is the integral of y."""
    y: Array
    error: Array
    """Bound of the error of a mean, per variable (v,): what lies beyond the nodes' degree."""

    def mean(self, y: Array) -> Array:
        """Mean over time of values at the nodes, shape (s, 8) or (s, 8, v)."""
        return np.asarray(np.einsum("sg,sg...->...", self.weights, y) / self.weights.sum())

    def after(self, start: float) -> Nodes:
        """Those of the pieces that begin at ``start`` or later."""
        kept = self.low >= start
        return Nodes(self.low[kept], self.high[kept], self.t[kept], self.weights[kept], self.y[kept], self.error)


class Dense:
    """The dense output of a run: any variables at any times."""

    def __init__(self, result: Result, names: Sequence[str]) -> None:
        """Raises :class:`InputError` for names that do not exist and for a run without steps."""
        trajectory = result.trajectory
        self.pieces = trajectory.pieces
        self.low, self.high = np.asarray(self.pieces.low, float), np.asarray(self.pieces.high, float)
        if not self.low.size:
            raise InputError(f"{result.design.netlist.name}: its run has no steps; simulate it over some time")
        self.h, self.b = np.asarray(self.pieces.h), np.asarray(self.pieces.b)
        self.names = list(dict.fromkeys(e for name in names for e in result.elements(name)))
        bases = list(dict.fromkeys(name.partition("[")[0] for name in self.names))
        every = [element for base in bases for element in result.elements(base)]
        unknown = [name for name in self.names if name not in every]
        if unknown:
            base = unknown[0].partition("[")[0]
            raise InputError(f"{unknown[0]}: {base} has {len(result.elements(base))} elements, counted from 1")
        system = result.system
        wanted = [e for base in bases for e in system.find(base).expression()]
        column = ca.densify(ca.vertcat(*(wanted[every.index(name)] for name in self.names)))
        self.x, self.held, self.bits = (_needed(column, symbols) for symbols in (system.x, system.h, system.b))
        given = [system.t, system.x[self.x], system.h[self.held], system.b[self.bits], system.p]
        self.function = ca.Function("v", given, [column])
        self.p = result.values.p

    @property
    def start(self) -> float:
        """Begin of the run [s]."""
        return float(self.low[0])

    @property
    def stop(self) -> float:
        """End of the run [s]."""
        return float(self.high[-1])

    def at(self, times: Array, near: Array | None = None) -> Array:
        """Values at ``times``, shape (m, v); ``near`` says which piece is meant where a time is a piece's end."""
        behind = np.searchsorted(self.low, times if near is None else near, side="right") - 1
        piece = np.clip(behind, 0, self.low.size - 1)
        found = np.empty((times.size, len(self.names)))
        for k in range(0, times.size, MOST_TIMES):
            t, some = times[k : k + MOST_TIMES], piece[k : k + MOST_TIMES]
            x, h, b = self.pieces.at(some, t)[:, self.x], self.h[some][:, self.held], self.b[some][:, self.bits]
            found[k : k + MOST_TIMES] = np.asarray(self.function(t.reshape(1, -1), x.T, h.T, b.T, self.p)).T
        return found

    def nodes(self, cuts: Sequence[float] | Array, longest: float | Array) -> Nodes:
        """Nodes from the first of ``cuts`` to the last, no piece across a cut nor longer than ``longest`` [s].

        ``longest`` is one length, or one for each span between two cuts.
        """
        cuts = np.asarray(cuts, float)
        start, stop = cuts[0], cuts[-1]
        inner = self.low[(self.low > start) & (self.low < stop)]
        edges = np.unique(np.concatenate([cuts, inner]))
        between = np.searchsorted(cuts, edges[:-1], side="right") - 1
        low, high = _split(edges, np.broadcast_to(longest, cuts.size - 1)[between])
        done: list[tuple[Array, Array, Array]] = []
        size: Array | None = None
        error = np.zeros(len(self.names))
        pieces = 0
        for halvings in range(MOST_HALVINGS + 1):
            y = self.values(low, high)
            self.check(low, y)
            if size is None:
                size = np.abs(y).max(axis=(0, 1))
            tail = (
                np.abs(np.einsum("kg,sgv->skv", SERIES[-2:], y)).max(axis=1) * ((high - low) / (stop - start))[:, None]
            )
            bad = (tail > TOLERANCE * size).any(axis=1) & (halvings < MOST_HALVINGS)
            pieces += low.size
            if halvings and pieces + 2 * bad.sum() > MOST_PIECES:  # it is noise that is being split
                bad[:] = False
            error += tail[~bad].sum(axis=0)
            done.append((low[~bad], high[~bad], y[~bad]))
            if not bad.any():
                break
            middle = (low[bad] + high[bad]) / 2
            low, high = np.concatenate([low[bad], middle]), np.concatenate([middle, high[bad]])
        low, high, y = (np.concatenate(parts) for parts in zip(*done, strict=True))
        order = np.argsort(low, kind="stable")
        low, high, y = low[order], high[order], y[order]
        half = (high - low)[:, None] / 2
        return Nodes(low, high, (low + high)[:, None] / 2 + half * NODES, half * WEIGHTS, y, error)

    def check(self, low: Array, y: Array) -> None:
        """Raise :class:`InputError` naming a variable that is not finite."""
        wrong = np.argwhere(~np.isfinite(y))
        if wrong.size:
            piece, _, v = wrong[0]
            raise InputError(f"{self.names[v]} is not a finite number at {low[piece]:g} s; choose another variable")

    def values(self, low: Array, high: Array) -> Array:
        """Values at the nodes of these pieces, shape (s, 8, v)."""
        middle, half = (low + high)[:, None] / 2, (high - low)[:, None] / 2
        times = middle + half * NODES
        return self.at(times.ravel(), np.repeat(middle, ORDER, axis=1).ravel()).reshape(low.size, ORDER, -1)


def _needed(column: ca.SX, symbols: ca.SX) -> list[int]:
    """Which of the symbols the expressions depend on; a run's other values need not be handed over."""
    if not symbols.numel():
        return []
    return np.flatnonzero(ca.which_depends(column, symbols, 1, False)).tolist()


def _split(edges: Array, longest: Array) -> tuple[Array, Array]:
    """Begins and ends of equal parts of the spans between ``edges``, none longer than ``longest`` (one per span)."""
    low, high = edges[:-1], edges[1:]
    parts = np.maximum(1, np.ceil((high - low) / longest * (1 - 1e-12))).astype(int)
    number = np.arange(parts.sum()) - np.repeat(np.cumsum(parts) - parts, parts)
    step = np.repeat((high - low) / parts, parts)
    begin = np.repeat(low, parts) + number * step
    end = np.append(begin[1:], edges[-1])
    return begin, end


def harmonics(angle: Array, weighted: Array, count: int) -> Array:
    """Sums over nodes of weighted (m, v) times exp(-j k angle), k = 0 ... count, shape (count + 1, v)."""
    found = np.empty((count + 1, weighted.shape[1]), complex)
    columns = np.ascontiguousarray(weighted.T, dtype=complex)
    once = np.exp(-1j * angle)
    turned = once
    for k in range(count + 1):
        turned = np.exp(-1j * k * angle) if k % AFRESH == 0 else turned * once
        for v, column in enumerate(columns):
            found[k, v] = np.vdot(column, turned)
    return found


def running(nodes: Nodes, y: Array) -> Array:
    """Integral of ``y`` (s, 8) from the first node piece's begin to each node, shape (s, 8)."""
    series = y @ SERIES.T
    half = (nodes.high - nodes.low)[:, None] / 2
    inner = half * legendre.legval(NODES, RUNNING @ series.T)
    whole = 2 * half[:, 0] * series[:, 0]
    return np.asarray((np.cumsum(whole) - whole)[:, None] + inner)
