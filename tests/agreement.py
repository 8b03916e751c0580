"""Runs of one circuit by several solvers, held against a reference: states and held values over time, and events.

The reference is `rodas` at an rtol of 1e-8 and at 1e-9, which must agree. A difference is measured in multiples of the
tolerance that was asked for, rtol (nominal + largest magnitude over the run) of each state: what an error control that
knew the whole run would allow in one step. Instants next to an event are left out, where a difference of the event's
time counts as the whole jump; times of events are compared by themselves.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np

from crescentlab.circuit import Circuit
from crescentlab.result import Result
from crescentlab.solvers.trajectory import Trajectory

POINTS = 200
"""Instants at which runs are compared."""
WINDOW = 1e-4
"""Share of the run on either side of an event that is left out."""
SAME_TIME = 1e-4
"""Share of the run by which the times of an event may differ."""
DETERMINED = 100 * 1e-8
"""The reference counts if its two runs differ by less than this share of the scale."""


def run(circuit: Circuit, solver: str, rtol: float, most: int | None = None) -> Result:
    """A run, failed or not."""
    return circuit.simulate(solver=solver, rtol=rtol, check=False, compile=False)


def at(trajectory: Trajectory, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """States and held values at times, after what happens there."""
    pieces = trajectory.pieces
    low = np.asarray(pieces.low)
    places = np.clip(np.searchsorted(low, times, side="right") - 1, 0, low.size - 1)
    return pieces.at(places, times), np.asarray(pieces.h)[places]


def happened(trajectory: Trajectory) -> dict[str, list[float]]:
    """Times of each event and tick, by name."""
    found: dict[str, list[float]] = {}
    for happening in trajectory.happenings:
        for name in happening.names:
            found.setdefault(name, []).append(happening.time)
    return found


def failure(trajectory: Trajectory) -> str:
    """How a run ended, without its numbers."""
    if trajectory.status != "failed":
        return trajectory.status
    said = trajectory.error.partition(": ")[2]
    return re.sub(r"[-+]?\d[\d.e+-]*", "#", said)[:40]


@dataclass
class Comparison:
    """How far a run is from the reference."""

    multiple: float = 0.0
    """Largest difference, in multiples of the tolerance."""
    where: str = ""
    events: str = ""
    """What happened otherwise, if anything."""
    ended: str = ""
    """How it ended otherwise."""

    def __str__(self) -> str:
        return "; ".join(p for p in (f"{self.multiple:.3g} tolerances at {self.where}", self.events, self.ended) if p)


@dataclass
class Reference:
    """The run that others are held against."""

    circuit: Circuit
    tight: Trajectory = field(init=False)
    doubt: str = ""
    """Why it does not count, if it does not."""

    def __post_init__(self) -> None:
        self.tight, loose = (run(self.circuit, "rodas", rtol).trajectory for rtol in (1e-9, 1e-8))
        if self.tight.status == "failed" or not len(self.tight.pieces.low):
            self.times = np.zeros(0)
            self.doubt = "" if failure(self.tight) == failure(loose) else "the reference fails in two ways"
            return
        system = self.circuit.system()
        t = self.tight.steps.t
        self.start, self.span = float(t[0]), float(t[-1] - t[0])
        grid = self.start + self.span * (np.arange(POINTS) + 0.5) / POINTS
        self.instants = happened(self.tight)
        stops = np.sort(np.array([s for times in self.instants.values() for s in times] + [self.start]))
        k = np.searchsorted(stops, grid)
        near = np.minimum(
            np.abs(grid - stops[np.maximum(k - 1, 0)]), np.abs(stops[np.minimum(k, stops.size - 1)] - grid)
        )
        self.times = grid[near > WINDOW * self.span]
        self.x, self.h = at(self.tight, self.times)
        self.names = [*system.state_names, *system.held_names]
        held = [system.find(name.partition("[")[0]).quantity.nominal for name in system.held_names]
        nominal = np.concatenate([system.nominal, held])
        values = np.hstack([self.x, self.h])
        self.scale = nominal + np.abs(values).max(axis=0, initial=0.0)
        difference = self.compare(loose, 1.0)
        if difference.multiple > DETERMINED or difference.events or difference.ended:
            self.doubt = f"rtol 1e-8 and 1e-9 differ: {difference}"

    def compare(self, other: Trajectory, rtol: float) -> Comparison:
        """Another run of the same circuit."""
        if failure(self.tight) != failure(other):
            return Comparison(ended=f"ended {failure(other)!r} instead of {failure(self.tight)!r}: {other.error[:200]}")
        if not self.times.size or not len(other.pieces.low):
            return Comparison()
        x, h = at(other, self.times)
        share = np.abs(np.hstack([x, h]) - np.hstack([self.x, self.h])) / self.scale
        where = np.unravel_index(int(share.argmax()), share.shape) if share.size else (0, 0)
        found = Comparison(events=self.events(other))
        if share.size:
            found.multiple = float(share[where]) / rtol
            found.where = f"{self.names[int(where[1])]}, {self.times[int(where[0])] * 1e3:.5g} ms"
        return found

    def events(self, other: Trajectory) -> str:
        """The first event that differs in number or time."""
        mine, others = self.instants, happened(other)
        for name in dict.fromkeys([*mine, *others]):
            a, b = np.array(mine.get(name, [])), np.array(others.get(name, []))
            if a.size != b.size:
                return f"{name} happened {b.size} times instead of {a.size}"
            late = np.abs(a - b)
            if a.size and late.max() > SAME_TIME * self.span:
                k = int(late.argmax())
                return f"{name} happened at {b[k]:.8g} s instead of {a[k]:.8g} s"
        return ""
