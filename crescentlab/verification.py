"""Whether a run's end is determined: two runs of one circuit, the second at a tenth of the tolerance, held together.

The difference between them estimates the error of the first. It says nothing of an error that both make: a line of too
few cells, a law outside its range.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from crescentlab.result import Result
from crescentlab.units import QUANTITIES, normalise

TIGHTER = 0.1
"""The second run's share of the tolerance."""
MULTIPLE = 1000.0
"""Runs agree that differ by less than this multiple of the tolerance."""
LEAST_RANGE = 0.1
"""... of the output's range, or of this share of its magnitude, where the range is smaller."""
MOST_TIMES = 20_000
"""Most instants at which runs are compared."""
NAMED = 3
"""Most outputs and events that a warning names."""


@dataclass(frozen=True)
class OutputError:
    """How far the two runs are apart in one output."""

    name: str
    difference: float
    """The largest [SI]."""
    share: float
    """The same as a share of the output's range over the run; 0 where they are equal."""
    time: float
    """When [s]."""
    agrees: bool

    def as_json(self) -> dict[str, Any]:
        """Plain data for ``--json``."""
        return {n: getattr(self, n) for n in ("name", "difference", "share", "time", "agrees")}


@dataclass(frozen=True)
class EventDifference:
    """An event that the two runs do not share."""

    name: str
    counts: tuple[int, int]
    """How often it happened in each."""
    time: float
    """Where the first difference is [s]."""

    def as_json(self) -> dict[str, Any]:
        """Plain data for ``--json``."""
        return {"name": self.name, "counts": list(self.counts), "time": self.time}

    def __str__(self) -> str:
        first, second = self.counts
        when = QUANTITIES["time"].show(self.time, "ms")
        if first == second:
            return f"{self.name} happens at another time than {when}"
        return f"{self.name} happens {first} and {second} times, from {when} on"


@dataclass(frozen=True)
class Verification:
    """A run against the same at a tenth of its tolerance."""

    rtol: float
    tighter: float
    outputs: list[OutputError]
    """By share, the largest first."""
    events: list[EventDifference]
    ended: str = ""
    """How the runs ended, if in two ways."""
    solver: str = ""
    units: dict[str, tuple[str, float]] = field(default_factory=dict, repr=False)
    """Display unit of each output and its size [SI]."""

    @property
    def agrees(self) -> bool:
        """Whether the two runs tell the same."""
        return not self.ended and not self.events and all(output.agrees for output in self.outputs)

    @property
    def warnings(self) -> list[str]:
        """Where they do not, loudly."""
        if self.agrees:
            return []
        told = [self.ended] if self.ended else []
        apart = [output for output in self.outputs if not output.agrees]
        told += [f"{o.name} differs by {self.shown(o)}" for o in apart[:NAMED]]
        told += [f"{len(apart) - NAMED} more outputs differ"] if len(apart) > NAMED else []
        told += [str(event) for event in self.events[:NAMED]]
        told += [f"{len(self.events) - NAMED} more events differ"] if len(self.events) > NAMED else []
        return [
            f"NOT VERIFIED: the runs at rtol {self.rtol:g} and {self.tighter:g} do not agree: {'; '.join(told)}; write "
            "a smaller --rtol and verify again; if it never agrees, what happens hangs on what no run resolves"
        ]

    def amount(self, output: OutputError) -> str:
        """An output's difference in its display unit."""
        unit, factor = self.units[output.name]
        return f"{output.difference / factor:.3g} {'' if unit == '1' else unit}".rstrip()

    def shown(self, output: OutputError) -> str:
        """An output's difference with its unit, its share and its time."""
        time = QUANTITIES["time"].show(output.time, "ms")
        return f"{self.amount(output)} ({100 * output.share:.2g} % of its range) at {time}"

    def as_json(self) -> dict[str, Any]:
        """Plain data for ``--json``; differences in SI."""
        return {
            "rtol": self.rtol, "tighter": self.tighter, "agrees": self.agrees, "ended": self.ended or None,
            "outputs": [output.as_json() for output in self.outputs], "events": [e.as_json() for e in self.events],
        }  # fmt: skip


def verification(first: Result, second: Result, rtol: float, tighter: float) -> Verification:
    """Compare a run with the same at a tighter tolerance.

    Over the time that both cover, at the first run's steps and halfway between. Instants between the times of an
    event, or of a relation's turn, in the one run and in the other are left out: the difference there is the whole
    jump. Times of events are compared instead.
    """
    one, other = first.trajectory, second.trajectory
    ended = ""
    if one.status != other.status:
        ended = f"one ended {one.status}, the other {other.status}{': ' if other.error else ''}{other.error}"
    start, end = float(one.steps.t[0]), float(min(one.steps.t[-1], other.steps.t[-1]))
    allowed = MULTIPLE * rtol * (end - start)
    late = abs(float(one.steps.t[-1] - other.steps.t[-1]))
    if not ended and late > MULTIPLE * rtol * max(end - start, late):
        ended = f"one ended at {one.steps.t[-1]:.6g} s, the other at {other.steps.t[-1]:.6g} s"
    pairs, events = _events(first, second, end, allowed)
    pairs += _turns(first, second, allowed)
    times = _times(one.steps.t, end, pairs, 1e-9 * (end - start))
    names = _compared(first)
    columns = [c for name in names for c in first.elements(name)]
    outputs: list[OutputError] = []
    if len(one.pieces.low) and len(other.pieces.low) and times.size and names:
        a, b = (_series(result, names, times) for result in (first, second))
        whole = _series_of_steps(first, names)
        for name, x, y, steps in zip(columns, a, b, whole, strict=True):
            outputs.append(_output(first, name, times, x, y, steps, rtol))
    outputs.sort(key=lambda o: -o.share)
    units = {}
    for name in columns:
        quantity = first.quantity(name)
        unit = first.display_unit(quantity)
        units[name] = unit, quantity.units.get(normalise(unit), 1.0)
    return Verification(rtol, tighter, outputs, events, ended, one.solver, units)


def _compared(result: Result) -> list[str]:
    """The circuit's outputs; without any its net pressures and states."""
    chosen = [o.name for o in result.design.outputs if o.scope == ""]
    if chosen:
        return chosen
    states = dict.fromkeys(name.partition("[")[0] for name in result.system.state_names)
    return [*result.net_pressures(), *(name for name in states if name in result.system.variables)]


def _output(
    result: Result, name: str, times: np.ndarray, x: np.ndarray, y: np.ndarray, steps: np.ndarray, rtol: float
) -> OutputError:
    difference = np.abs(x - y)
    difference[~np.isfinite(difference)] = np.inf if np.isfinite(x).any() else 0.0
    k = int(difference.argmax())
    largest = float(difference[k])
    span, magnitude = float(np.ptp(steps)), float(np.abs(steps).max()) + result.quantity(name).nominal
    agrees = largest <= MULTIPLE * rtol * max(span, LEAST_RANGE * magnitude)
    share = largest / max(span, 1e-300) if largest else 0.0
    return OutputError(name, largest, share, float(times[k]), agrees)


def _series(result: Result, names: list[str], times: np.ndarray) -> np.ndarray:
    """Elements of variables at times within a run, shape (elements, times)."""
    pieces = result.trajectory.pieces
    low = np.asarray(pieces.low)
    k = np.clip(np.searchsorted(low, times, side="right") - 1, 0, low.size - 1)
    x, h, b = pieces.at(k, times), np.asarray(pieces.h)[k], np.asarray(pieces.b)[k]
    return result.system.series(names, times, x, h, b, result.values.p)


def _series_of_steps(result: Result, names: list[str]) -> np.ndarray:
    """The same at the accepted steps."""
    rows = result.trajectory.steps
    return result.system.series(names, rows.t, rows.x, rows.h, rows.b, result.values.p)


def _times(steps: np.ndarray, end: float, pairs: list[tuple[float, float]], margin: float) -> np.ndarray:
    """Steps and the middle of each up to ``end``, without the windows that events open."""
    grid = np.unique(np.concatenate([steps, (steps[1:] + steps[:-1]) / 2]))
    grid = grid[grid <= end]
    if grid.size > MOST_TIMES:
        grid = grid[np.linspace(0, grid.size - 1, MOST_TIMES).astype(int)]
    if not pairs:
        return grid
    low, high = (np.sort(side) for side in np.transpose(pairs))
    inside = np.searchsorted(low - margin, grid, side="right") - np.searchsorted(high + margin, grid, side="left")
    return grid[inside <= 0]


def _events(
    first: Result, second: Result, end: float, allowed: float
) -> tuple[list[tuple[float, float]], list[EventDifference]]:
    """Times of each event in both runs, up to ``end``, and the events that are not the same in both."""
    here, there = (dict(_happened(result)) for result in (first, second))
    pairs: list[tuple[float, float]] = []
    apart: list[EventDifference] = []
    for name in dict.fromkeys([*here, *there]):
        a, b = here.get(name, []), there.get(name, [])
        both = list(zip(a, b, strict=False))
        pairs += [(min(pair), max(pair)) for pair in both if abs(pair[0] - pair[1]) <= allowed]
        late = next((x for x, y in both if abs(x - y) > allowed), None)
        longer = a if len(a) > len(b) else b
        if len(a) != len(b):
            beyond = longer[len(both)]
            if late is None and beyond >= end - allowed:
                continue  # it lies where one run has ended
            late = beyond if late is None else late
        if late is not None:
            apart.append(EventDifference(name, (len(a), len(b)), late))
    return pairs, sorted(apart, key=lambda event: event.time)


def _turns(first: Result, second: Result, allowed: float) -> list[tuple[float, float]]:
    """Times of each relation's turn in both runs, those that lie close to each other."""
    pairs: list[tuple[float, float]] = []
    for mine, others in zip(*(_flips(result) for result in (first, second)), strict=True):
        for a, b in ((mine, others), (others, mine)):
            if a.size and b.size:
                k = np.searchsorted(b, a)
                near = np.stack([b[np.maximum(k - 1, 0)], b[np.minimum(k, b.size - 1)]])
                nearest = near[np.abs(near - a).argmin(axis=0), np.arange(a.size)]
                pairs += [(min(p), max(p)) for p in zip(a.tolist(), nearest.tolist(), strict=True)]
    return [pair for pair in pairs if pair[1] - pair[0] <= allowed]


def _flips(result: Result) -> list[np.ndarray]:
    """Per relation the times of its turns."""
    rows = result.trajectory.steps
    turned = rows.b[1:] != rows.b[:-1]
    return [rows.t[1:][column] for column in turned.T]


def _happened(result: Result) -> Iterator[tuple[str, list[float]]]:
    """Each event and the times of its firing."""
    found: dict[str, list[float]] = {}
    for happening in result.trajectory.happenings:
        for name in happening.names:
            found.setdefault(name, []).append(happening.time)
    yield from found.items()
