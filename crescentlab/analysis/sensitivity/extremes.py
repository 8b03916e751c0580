"""More nodes of a window where its outcomes have their extremes: a derivative is wanted there, not near there.

The largest of some samples is right to second order in their distance, its derivative by a parameter only to first.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence

import numpy as np

from crescentlab.analysis.outcome import Outcome, Window, functions, lookup
from crescentlab.expressions import Function, Value, evaluate
from crescentlab.result import Result
from crescentlab.solvers.trajectory import Pieces

Array = np.ndarray

FINEST = 1e-7
"""Share of a window at which nodes are close enough."""
POINTS = 12
"""New nodes between two old ones, in one round."""
ROUNDS = 12
REDUCING = ("minimum", "maximum", "peak_to_peak")


def refined(result: Result, window: Window, outcomes: Sequence[Outcome]) -> Window:
    """The window with nodes of no weight added around the extremes that the outcomes ask for."""
    for _ in range(ROUNDS):
        gaps = [gap for node in extremes(window, outcomes) for gap in around(window, node)]
        wide = [(low, high) for low, high in dict.fromkeys(gaps) if high - low > FINEST * window.length]
        if not wide:
            break
        window = with_nodes(result, window, wide)
    return window


def extremes(window: Window, outcomes: Sequence[Outcome]) -> list[int]:
    """Nodes at which series have the extremes that the outcomes ask for."""
    found: list[int] = []
    known = functions(window)

    def noted(name: str) -> Function:
        def apply(arguments: list[Value]) -> Value:
            series = np.asarray(arguments[0].value, dtype=float)
            if series.ndim and len(series) == window.t.size:
                most = [series.argmax(axis=0)] if name != "minimum" else []
                least = [series.argmin(axis=0)] if name != "maximum" else []
                found.extend(int(k) for k in np.concatenate([np.atleast_1d(k) for k in most + least]))
            return known[name](arguments)

        return apply

    for outcome in outcomes:
        if any(name in outcome.text for name in REDUCING):
            evaluate(outcome.text, lookup(window), {**known, **{name: noted(name) for name in REDUCING}})
    return list(dict.fromkeys(found))


def around(window: Window, node: int) -> list[tuple[float, float]]:
    """The gaps between a node and the nearest nodes of other times."""
    t = window.t
    before, after = np.flatnonzero(t < t[node]), np.flatnonzero(t > t[node])
    gaps = [(float(t[before[-1]]), float(t[node]))] if before.size else []
    return gaps + ([(float(t[node]), float(t[after[0]]))] if after.size else [])


def with_nodes(result: Result, window: Window, gaps: list[tuple[float, float]]) -> Window:
    """The window with nodes added inside gaps between its nodes, each of which lies in one piece."""
    pieces = result.trajectory.pieces
    places: list[int] = []
    times: list[float] = []
    for low, high in gaps:
        inside = np.flatnonzero((window.t >= low) & (window.t <= high))
        shared = [p for p in np.unique(window.pieces[inside]) if _holds(pieces, int(p), (low + high) / 2)]
        places += shared[:1] * POINTS
        times += np.linspace(low, high, POINTS + 2)[1:-1].tolist() if shared else []
    more = copy.copy(window)
    more.t, more.pieces, more.weights = np.array(times), np.array(places, dtype=int), np.zeros(len(times))
    more.x = pieces.at(more.pieces, more.t)
    more.h, more.b = np.asarray(pieces.h)[more.pieces], np.asarray(pieces.b)[more.pieces]
    more.series = {}
    order = np.lexsort((np.append(window.t, more.t), np.append(window.pieces, more.pieces)))
    return joined(window, more, order)


def joined(window: Window, more: Window, order: Array) -> Window:
    """Two windows' nodes as one, in the given order; what is known of the first is not evaluated again."""
    new = copy.copy(window)
    for name in ("t", "pieces", "weights", "x", "h", "b"):
        setattr(new, name, np.concatenate([getattr(window, name), getattr(more, name)])[order])
    new.series = {name: np.concatenate([known, more[name]])[order] for name, known in window.series.items()}
    return new


def _holds(pieces: Pieces, piece: int, time: float) -> bool:
    return bool(pieces.low[piece] <= time <= pieces.high[piece])
