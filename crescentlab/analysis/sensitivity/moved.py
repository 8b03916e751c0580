r"""Derivatives of outcomes from the sensitivities of a run.

Each node of the window moves with the stops around it, t_a = d t/da between two stops by interpolation, so that no
series jumps at a node: along (t_a, S + f t_a, S_h, p_a) every series is smooth, and so is every weight. An outcome is
an expression of these; it is differenced along that direction, a millionth up and a millionth down.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from crescentlab.analysis.outcome import Outcome, Window
from crescentlab.analysis.reach import NotDifferentiableError, Reach
from crescentlab.analysis.sensitivity.parameters import shifted
from crescentlab.analysis.sensitivity.tones import tones
from crescentlab.analysis.sensitivity.variational import Sensitivity
from crescentlab.result import Result

Array = np.ndarray

ALIKE = 1e-6
"""Relative difference within which two ways of looking at one thing agree."""
ROUNDING = 1e-8
"""Relative change of an outcome, as its parameter changes by its size, that counts as none."""
TINY = 1e-6
"""Relative step along the direction: truncation and rounding both stay below 1e-9."""


@dataclass(frozen=True)
class Edge:
    """What lies beyond an end of a window (``place`` 0 or -1) that an event falls on, which moves by ``shift``."""

    place: int
    shift: float
    x: Array
    h: Array
    b: Array
    dx: Array
    dh: Array

    def added(
        self, w: Window, dt: Array, weights: Array, dx: Array, dh: Array
    ) -> tuple[Window, Array, Array, Array, Array]:
        """The window with one more node, beyond the event; the length between event and end is zero, but changes."""
        end = self.place == -1

        def join(old: Array, new: Array) -> Array:
            return np.concatenate([old, new] if end else [new, old])

        new = copy.copy(w)
        new.t, new.weights = join(w.t, w.t[[self.place]]), join(w.weights, np.zeros(1))
        new.x, new.h, new.b = join(w.x, self.x), join(w.h, self.h), join(w.b, self.b)
        more = np.array([-self.shift if end else self.shift])
        return new, join(dt, np.zeros(1)), join(weights, more), join(dx, self.dx), join(dh, self.dh)


class Moving:
    """A window whose nodes move with the events."""

    def __init__(self, result: Result, window: Window, sensitivity: Sensitivity) -> None:
        assert sensitivity.steps is not None, "the sensitivities along the run are needed"
        self.window, self.of, self.steps = window, sensitivity, sensitivity.steps
        self.pieces, rows = result.trajectory.pieces, result.trajectory.steps
        self.low, self.high = np.asarray(self.pieces.low), np.asarray(self.pieces.high)
        self.last = rows.x, rows.h, rows.b
        low, high = self.low[window.pieces], self.high[window.pieces]
        self.middle = (np.maximum(low, window.start) + np.minimum(high, window.stop)) / 2
        """Of each node's piece, which lies between two stops."""
        self.slack = 1e-9 * window.length
        self.ends = sensitivity.end_moves and abs(window.stop - float(sensitivity.knots[-1])) <= self.slack
        """Whether the window ends with the run, and that with an event."""
        system = window.system
        arguments = (window.t.reshape(1, -1), window.x.T, window.h.T, window.b.T)
        self.rate = (
            system.rhs.function(*arguments, system.rhs.parameters(window.p)).full().T
            if system.x.numel() else np.zeros((window.t.size, 0))
        )  # fmt: skip
        self.size = system.nominal + np.max(np.abs(window.x), axis=0, initial=0.0)

    def knots(self, j: int) -> tuple[Array, Array]:
        """Times of the stops within the window and of its ends, and how far each moves by parameter j."""
        w, of = self.window, self.of
        inside = (of.knots > w.start + self.slack) & (of.knots < w.stop - self.slack)
        times, places = np.unique(of.knots[inside], return_index=True)
        moves = of.shifts[inside, j]
        for time, first in zip(times, moves[places], strict=True):
            if np.any(np.abs(moves[of.knots[inside] == time] - first) > ALIKE * np.abs(first)):
                raise NotDifferentiableError(f"at {time:.6g} s two things happen at once that move apart")
        last = float(of.shifts[-1, j]) if self.ends else 0.0
        return np.concatenate([[w.start], times, [w.stop]]), np.concatenate([[0.0], moves[places], [last]])

    def derivatives(self, outcomes: Sequence[Outcome], reach: Reach, j: int, size: float) -> list[float]:
        """Derivatives of the outcomes by parameter j, of magnitude ``size``, whose direct reach is ``reach``.

        An event that moves and falls on an end of the window is looked at twice, as outside and as inside of it.
        """
        times, moves = self.knots(j)
        values = [
            abs(outcome.value(self.window).value) for outcome in outcomes
        ]  # now it knows what variables they need
        found = self.along(outcomes, reach, j, size, times, moves, None)
        for edge in self.edges(j):
            other = self.along(outcomes, reach, j, size, times, moves, edge)
            for outcome, value, one, two in zip(outcomes, values, found, other, strict=True):
                if abs(one - two) > ALIKE * (abs(one) + abs(two)) + ROUNDING * value / size:
                    at = self.window.t[edge.place]
                    raise NotDifferentiableError(f"an event that it moves falls on the window's end at {at:.6g} s"
                                                 f" and makes {outcome.name} jump")  # fmt: skip
        return found

    def edges(self, j: int) -> Iterator[Edge]:
        """What lies beyond the ends of the window, where an event that moves falls on them."""
        w, low, high = self.window, self.low, self.high
        for place, time in ((0, w.start), (-1, w.stop)):
            on = (np.abs(self.of.knots - time) <= self.slack) & (self.of.shifts[:, j] != 0)
            if not on.any() or (place == -1 and self.ends):
                continue
            shift = float(self.of.shifts[np.flatnonzero(on)[0], j])
            beyond = np.flatnonzero(low >= time - self.slack if place else high <= time + self.slack)
            if beyond.size:
                piece = beyond[:1] if place else beyond[-1:]
                at = low[piece] if place else high[piece]
                s, sh = self.steps.at(piece, at, j)
                pieces = self.pieces
                yield Edge(
                    place, shift, pieces.at(piece, at), np.asarray(pieces.h)[piece], np.asarray(pieces.b)[piece], s, sh
                )
            else:
                x, h, b = (row[-1:] for row in self.last)
                yield Edge(place, shift, x, h, b, self.of.x[None, :, j], self.of.h[None, :, j])

    def along(
        self, outcomes: Sequence[Outcome], reach: Reach, j: int, size: float, times: Array, moves: Array,
        edge: Edge | None,
    ) -> list[float]:  # fmt: skip
        """The derivatives; with ``edge`` its event has come into the window, and what is beyond it with it."""
        new, step = self.line(reach, j, size, times, moves, edge)

        def at(amount: float) -> Array:
            return np.array([float(outcome.value(new(amount)).value) for outcome in outcomes])

        found = (at(step) - at(-step)) / (2 * step)
        if not np.isfinite(found).all():
            name = outcomes[int(np.flatnonzero(~np.isfinite(found))[0])].name
            raise NotDifferentiableError(f"the derivative of {name} is not finite")
        return [float(v) for v in found]

    def periods(self, outcome: Outcome, reach: Reach, j: int, size: float) -> float:
        """Largest relative change of the periods of an outcome's amplitudes in the window, per change of size."""
        new, step = self.line(reach, j, size, *self.knots(j), None)
        up, down = (np.array(tones(w, outcome, w.design)) * w.length for w in (new(step), new(-step)))
        return float(np.max(np.abs(up - down) / np.abs(up + down), initial=0.0)) / step * size

    def line(
        self, reach: Reach, j: int, size: float, times: Array, moves: Array, edge: Edge | None
    ) -> tuple[Callable[[float], Window], float]:
        """The window as parameter j moves by an amount, and the step for differences."""
        w = self.window
        if edge is not None:
            moves = moves.copy()
            moves[edge.place] = edge.shift
        dt = np.interp(w.t, times, moves)
        stretch = np.diff(moves) / np.diff(times)
        segment = np.clip(np.searchsorted(times, self.middle, side="right") - 1, 0, stretch.size - 1)
        weights = w.weights * stretch[segment]
        s, dh = self.steps.at(w.pieces, w.t, j)
        dx = s + self.rate * dt[:, None]
        if edge is not None:
            w, dt, weights, dx, dh = edge.added(w, dt, weights, dx, dh)
        ends = (0.0, float(self.of.shifts[-1, j]) if self.ends else 0.0)
        step = TINY / max(self.extent(dx, dh, dt, reach), 1 / size)

        def moved(amount: float) -> Window:
            new = copy.copy(w)
            new.t, new.weights = w.t + amount * dt, w.weights + amount * weights
            new.x, new.h, new.p = w.x + amount * dx, w.h + amount * dh, w.p + amount * reach.p
            new.start, new.stop = w.start + amount * ends[0], w.stop + amount * ends[1]
            new.design = shifted(w.design, reach.circuit, amount)
            new.series = together(new, list(self.window.series))
            return new

        return moved, step

    def extent(self, dx: Array, dh: Array, dt: Array, reach: Reach) -> float:
        """Largest relative change of anything along the direction."""
        w = self.window
        shares = [np.abs(dx) / self.size, np.abs(dt) / w.length]
        for change, value in ((dh, np.max(np.abs(w.h), axis=0, initial=0.0)), (reach.p, np.abs(w.p))):
            known = np.broadcast_to(value > 0, change.shape)
            shares.append(np.abs(change)[known] / np.broadcast_to(value, change.shape)[known])
        return max(float(np.max(share, initial=0.0)) for share in shares)


def together(window: Window, names: list[str]) -> dict[str, Array]:
    """Series of several variables over a window, evaluated at once: they share most of their equations."""
    system = window.system
    columns = system.series(names, window.t, window.x, window.h, window.b, window.p).T
    sizes = [len(system.find(name).expression()) for name in names]
    parts = np.split(columns, np.cumsum(sizes)[:-1], axis=1) if names else []
    return {
        name: part if system.find(name).vector else part[:, 0] for name, part in zip(names, parts, strict=True)
    }  # fmt: skip
