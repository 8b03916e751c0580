"""The stops of a finished run once more: what met its boundary, what ticked, what was set in which round.

A trajectory keeps the states before and after each stop, not the way between them. The rules of settling and firing
are deterministic, so that the same half step by step gives the same end; it is compared with what the run recorded.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from crescentlab.analysis.reach import NotDifferentiableError
from crescentlab.errors import SimulationError
from crescentlab.solvers.hybrid import EPS, Hybrid, Round
from crescentlab.solvers.snapshot import Snapshot
from crescentlab.solvers.trajectory import Trajectory
from crescentlab.system import System, Values

Array = np.ndarray

NEAR = 1e3
"""A relation has just met its boundary if it is within so many of its tolerance bands of it."""
SAME = 1e-9
"""Relative difference of replayed and recorded values: compiled functions differ in their last digits."""


@dataclass(frozen=True)
class World:
    """States (n,), held values (k,) and bits (r,) of one instant."""

    x: Array
    h: Array
    b: Array


@dataclass(frozen=True)
class Stop:
    """What happened at one instant.

    ``triggers`` are the relations that met their boundary, ``ticks`` pairs of a clock's position and its count since
    the start (a run that goes on keeps its last tick where it was, whatever the period is). Both are empty at the start
    of the run, whose time is fixed.
    """

    time: float
    before: World
    after: World
    triggers: tuple[int, ...]
    ticks: tuple[tuple[int, int], ...]
    rounds: tuple[Round, ...]
    names: tuple[str, ...]


def replay(system: System, values: Values, trajectory: Trajectory, start: Snapshot | None = None) -> list[Stop]:
    """All stops of the run in order of time, that of its start first.

    ``values`` and ``start`` are those the run began with. Raises :class:`NotDifferentiableError` where the replay does
    not come to what the run recorded.
    """
    return list(_Replay(system, values, trajectory, start).stops())


class _Replay:
    def __init__(self, system: System, values: Values, trajectory: Trajectory, start: Snapshot | None) -> None:
        self.system, self.values = system, values
        self.rows = trajectory.steps
        self.fired_at = np.array([happening.time for happening in trajectory.happenings])
        self.hybrid = Hybrid(system, values, float(self.rows.t[0]), max(float(self.rows.t[-1]), float(self.rows.t[0])))
        if start is not None:
            self.hybrid.resume(start)
        span = max(self.hybrid.span, EPS)
        self.slack = max(1e-12 * span, 4 * self.hybrid.time_tolerance)
        """Two times closer than this are one [s]."""

    def stops(self) -> Iterator[Stop]:
        try:
            yield self.at_start()
            for before, after in self.places():
                stop = self.at_rows(before, after)
                if stop is not None:
                    yield stop
        except SimulationError as error:
            raise NotDifferentiableError(f"its events cannot be followed once more: {error}") from None

    def places(self) -> Iterator[tuple[int, int]]:
        """Rows before and after each stop; the same row where something fired and changed nothing."""
        t, jumps = self.rows.t, self.rows.jumps[self.rows.jumps > 0]
        found = [(int(j) - 1, int(j)) for j in jumps]
        for time in self.fired_at[self.fired_at > t[0] + self.slack]:
            if not np.any(np.abs(t[jumps] - time) <= self.slack):
                row = int(np.searchsorted(t, time + self.slack, side="right")) - 1
                found.append((row, row))
        yield from sorted(found, key=lambda pair: pair[1])

    def at_start(self) -> Stop:
        hybrid, t, x = self.hybrid, float(self.rows.t[0]), self.values.x0
        hybrid.begin(t, x)
        before = World(x, hybrid.h, hybrid.b)
        rounds, after, names = self.rounds(t, before, [], starts=not hybrid.resumed)
        self.compare(t, after, 0)
        return Stop(t, before, after, (), (), rounds, names)

    def at_rows(self, before: int, after: int) -> Stop | None:
        """The stop between two rows; None if nothing that matters happened."""
        rows, hybrid, t = self.rows, self.hybrid, float(self.rows.t[after])
        world = World(rows.x[before], rows.h[before], rows.b[before])
        hybrid.h, hybrid.b = world.h, world.b
        turned = self.turned(t, world)
        hybrid.settle(t, world.x)
        due, counts = self.due(t)
        rounds, end, names = self.rounds(t, world, due)
        self.compare(t, end, after)
        ticks = tuple(zip(due, counts, strict=True))
        triggers = self.causes(t, world, turned, bool(rounds))
        switched = any(self.system.bits.switches[k] for k in np.flatnonzero(world.b != end.b))
        if not rounds and not switched:
            return None
        if not triggers and not ticks:
            raise NotDifferentiableError(f"what brought about the stop at {t:.6g} s is not known")
        return Stop(t, world, end, triggers, ticks, rounds, names)

    def due(self, t: float) -> tuple[list[int], list[int]]:
        """Clocks that tick at ``t``, and how many of their periods lie between it and the start of this run."""
        hybrid = self.hybrid
        if not hybrid.ticking:
            return [], []
        counts = np.round((t - hybrid.origin) / hybrid.periods)
        on = np.abs(hybrid.origin + counts * hybrid.periods - t) <= self.slack
        found = np.flatnonzero(on & (counts > hybrid.ticked))  # which stays as it was at the start
        return found.tolist(), (counts - hybrid.ticked)[found].astype(int).tolist()

    def turned(self, t: float, world: World) -> list[int]:
        """Relations that left their side at ``t``, and are near their boundary."""
        hybrid = self.hybrid
        if not hybrid.n:
            return []
        g, rate, scale = (a.copy() for a in hybrid.relation(t, world.x))
        band = 2 * hybrid.time_tolerance * np.abs(rate) + 16 * EPS * scale
        sides = hybrid.sides(t, world.x)[0].astype(float)
        return np.flatnonzero((sides != world.b) & (np.abs(g) <= NEAR * band)).tolist()

    def causes(self, t: float, world: World, turned: list[int], fired: bool) -> tuple[int, ...]:
        """Of the relations that turned, those that choose a value, or without which no condition would differ."""
        hybrid, switches = self.hybrid, self.system.bits.switches
        if not fired or not hybrid.rising:
            return tuple(k for k in turned if switches[k])
        new = world.b.copy()
        new[turned] = 1 - new[turned]
        conditions = hybrid.condition(t, world.x, world.h, new)[0].copy()

        def matters(k: int) -> bool:
            without = new.copy()
            without[k] = world.b[k]
            return bool(np.any(hybrid.condition(t, world.x, world.h, without)[0] != conditions))

        found = tuple(k for k in turned if switches[k] or matters(k))
        return found or tuple(turned)

    def rounds(
        self, t: float, before: World, due: list[int], *, starts: bool = False
    ) -> tuple[tuple[Round, ...], World, tuple[str, ...]]:
        """Fire in rounds, bits having settled; the rounds, the world after them, the events' names."""
        hybrid, rounds = self.hybrid, list[Round]()
        x, names = hybrid.stop(t, before.x, due, starts=starts, rounds=rounds)
        return tuple(rounds), World(x, hybrid.h, hybrid.b), tuple(names)

    def compare(self, t: float, world: World, row: int) -> None:
        """Raise unless the world is that of the row."""
        rows = self.rows
        sizes = self.system.nominal, float(np.max(np.abs(rows.h[row]), initial=0.0))
        for mine, recorded, size in zip((world.x, world.h), (rows.x[row], rows.h[row]), sizes, strict=True):
            if np.any(np.abs(mine - recorded) > SAME * (np.abs(recorded) + size)):
                raise NotDifferentiableError(f"the stop at {t:.6g} s sets other values when it is followed once more")
        if not np.array_equal(world.b, rows.b[row]):
            k = int(np.flatnonzero(world.b != rows.b[row])[0])
            said = self.system.bits.names[k]
            raise NotDifferentiableError(f"at {t:.6g} s {said} is within rounding of its boundary")
