"""The discrete half of a run: bits settle, events fire in rounds, ticks and time roots are foreseen.

Between stops every bit and held value is constant. At a stop the bits *settle*: outside its
tolerance band a bit takes its truth, inside it the side its relation is heading for, heading nowhere
its truth; repeated until still. Then events whose conditions turned true fire, all reading the world
just before the round, and the bits settle again.
"""

from __future__ import annotations

import functools
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from crescentlab.errors import SimulationError
from crescentlab.prepared import Evaluator, Prepared
from crescentlab.solvers.snapshot import Snapshot
from crescentlab.system import System, Values
from crescentlab.units import DISPLAY

EPS = float(np.finfo(float).eps)
MAX_ROUNDS = 40
MAX_SETTLING = 200
ZENO_COUNT = 60
"""This many firings of one event within ``ZENO_SPAN`` of the run are taken as endless."""
ZENO_SPAN = 1e-6
SCAN_CHUNKS, SCAN_POINTS = 40, 501
TICK_POINTS = 25
"""Points of a chunk that a tick cuts short: what depends on held values begins anew there."""
"""A run is scanned for curved time roots in chunks of this many points."""
SCAN_SWING = 0.25
"""Between two points a relation moves by no more than this share of its range in the chunk; else it is made shorter."""
SHORTEST_SCAN = 4.0**-6
"""Down to this share of a chunk."""


@dataclass(frozen=True)
class Round:
    """One round of events: the world before it, what fires (1 in ``flags``), and whether ticks or events do."""

    x: np.ndarray
    h: np.ndarray
    b: np.ndarray
    flags: np.ndarray
    ticks: bool
    events: bool


class Hybrid:
    """Bits, held values and conditions of one run."""

    def __init__(
        self, system: System, values: Values, start: float, stop: float, take: Callable[[str], Prepared] | None = None
    ) -> None:
        """``take`` gives the functions their form; without it they are interpreted."""
        self.take = take or functools.partial(getattr, system)
        self.system = system
        self.start, self.end = start, stop
        self.span = stop - start
        self.bits_info = system.bits
        self.f = Evaluator(self.take("rhs"), values.p)
        self._relation = Evaluator(self.take("relation"), values.p)
        self._watched = Evaluator(self.take("relation_on_state"), values.p)
        self.condition = Evaluator(self.take("condition"), values.p)
        self.n = len(system.bits.names)
        self.b = np.zeros(self.n)
        self.h = values.h0.copy()
        self.holds = np.zeros(system.conditions.numel(), bool)
        self.p = values.p
        self.finished = self.resumed = self.guess = False
        self.rising = [k for k, e in enumerate(system.events) if e.kind != "every"]
        self.ticking = [k for k, e in enumerate(system.events) if e.kind == "every"]
        self.periods = np.array(system.period(values.p)).ravel() if self.ticking else np.zeros(0)
        self.origin = np.full(len(self.ticking), start)
        """Time from which the ticks of each clock are counted."""
        self.ticked = np.zeros(len(self.ticking), dtype=int)
        self.remaps: dict[str, Evaluator] = {}
        self.recent: dict[str, deque[float]] = {}
        self.time_tolerance = max(1e-13 * self.span, 8 * EPS * max(abs(start), abs(stop)))
        """How closely roots are located [s]."""
        self.watched = np.flatnonzero(system.bits.on_state)
        self.curved = np.flatnonzero(system.bits.on_time & ~system.bits.linear)
        self.linear = np.flatnonzero(system.bits.linear)
        self.anew = bool(self.curved.size) and bool(system.bits.held_dependent[self.curved].any())
        """Whether relations that curve in time change with held values and bits."""
        self.curved_roots: list[float] = []
        self.following = [(f.places, f.schedule(start, stop)) for f in values.following]
        self.chunk = self.span / SCAN_CHUNKS
        """Length of time that is scanned at once."""
        self.scanned: float | None = None
        """Until when curved relations on time have been scanned; None: not yet."""

    def remap(self, ticks: bool, events: bool) -> Evaluator:
        """What sets states and held values when ticks, events, or both fire."""
        name = "remap" if ticks and events else "remap_ticks" if ticks else "remap_events"
        if name not in self.remaps:
            self.remaps[name] = Evaluator(self.take(name), self.p)
        return self.remaps[name]

    def evaluators(self) -> dict[str, Evaluator]:
        """What calls the system's functions, f aside, by their names."""
        return {
            "relation": self._relation, "relation_on_state": self._watched, "condition": self.condition, **self.remaps,
        }  # fmt: skip

    def relation(self, t: float, x: np.ndarray, rate: np.ndarray | None = None) -> list[np.ndarray]:
        """Relations, their rates and magnitudes; ``rate`` is dx/dt where the caller knows it."""
        known = self.f(t, x, self.h, self.b)[0] if rate is None else rate
        return self._relation(t, x, self.h, self.b, known)

    def watch(self, t: float, x: np.ndarray, rate: np.ndarray) -> list[np.ndarray]:
        """The same of the relations on states alone."""
        return self._watched(t, x, self.h, self.b, rate)

    # -- settling --------------------------------------------------------------------------------

    def resume(self, snapshot: Snapshot) -> None:
        """Begin where another run ended; bits, conditions and clocks as they were there."""
        self.h, self.b, self.holds = snapshot.h.copy(), snapshot.b.copy(), snapshot.holds.astype(bool)
        self.origin, self.ticked = snapshot.clocks(self.periods, self.time_tolerance)
        self.resumed = True

    @property
    def standing(self) -> dict[str, Any]:
        """What a :class:`Snapshot` keeps of it."""
        clocks = {"origin": self.origin, "ticked": self.ticked, "period": self.periods}
        return {"h": self.h, "b": self.b, "holds": self.holds, **clocks}

    def enter(self, t: float, x: np.ndarray, *, guess: bool = False) -> tuple[np.ndarray, list[str]]:
        """The start of a run, the same for every solver: the bits begin, then what is true fires.

        Returns the state after it and the names of what fired. Of a ``guess`` nothing that states bring about is a
        failure yet.
        """
        self.begin(t, x)
        self.guess = guess
        try:
            return self.stop(t, x, [], starts=not self.resumed)
        finally:
            self.guess = False

    def begin(self, t: float, x: np.ndarray) -> None:
        """Bits at the start: truth first, then settling. A resumed run has its bits and conditions already."""
        if self.n and not self.resumed:
            for _ in range(2):
                g = self.relation(t, x)[0]
                self.b = np.where(self.truth(g), 1.0, 0.0)
        self.settle(t, x)

    def truth(self, g: np.ndarray) -> np.ndarray:
        """Truth of each relation: above its boundary, or on it unless strict."""
        return np.asarray((g > 0) | ((g == 0) & ~self.bits_info.strict))

    def sides(self, t: float, x: np.ndarray, fastest: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Where each relation belongs (its truth; within its band, the side it is heading for), and its rate.

        ``fastest`` collects the largest rates met while settling, which set the band: a rate that depends on the bit
        itself would else put it inside its band with one value and outside with the other.
        """
        g, rate, scale = self.relation(t, x)
        roundoff = 16 * EPS * scale
        met = np.abs(rate) if fastest is None else np.maximum(fastest, np.abs(rate), out=fastest)
        inside = np.abs(g) <= 2 * self.time_tolerance * met + roundoff
        moving = np.abs(rate) * self.span > roundoff
        return np.where(inside & moving, rate > 0, self.truth(g)), rate

    def settle(self, t: float, x: np.ndarray) -> None:
        """Bring every bit to rest; raises :class:`SimulationError` naming relations that cannot.

        Before, what follows a schedule takes the row of this instant.
        """
        self.follow(t)
        if not self.n:
            return
        seen: dict[bytes, int] = {}
        fastest = np.zeros(self.n)
        for _ in range(MAX_SETTLING):
            new = self.sides(t, x, fastest)[0].astype(float)
            if np.array_equal(new, self.b):
                return
            key = new.tobytes()
            if key in seen:
                self.raise_unsettled(self.bits_info.names[int(np.flatnonzero(new != self.b)[0])])
            seen[key] = 1
            self.b = new
            self.rescan()
        raise SimulationError("the relations do not settle")

    def follow(self, t: float) -> None:
        """Let held values that follow a schedule take the row that holds from now on."""
        for places, schedule in self.following:
            row = schedule.rows[schedule.at(t, self.time_tolerance)]
            if not np.array_equal(self.h[places], row):
                self.h = self.h.copy()
                self.h[places] = row
                self.rescan()

    # -- stops -----------------------------------------------------------------------------------

    def stop(
        self, t: float, x: np.ndarray, due: list[int], *, starts: bool = False, rounds: list[Round] | None = None
    ) -> tuple[np.ndarray, list[str]]:
        """Settle and fire at time ``t``; ``due`` are positions of ticks. Returns the state after, names fired.

        Where the run ``starts``, an ``initially`` waits until what it reads has been set. ``rounds`` collects them.
        """
        self.settle(t, x)
        names: list[str] = []
        for _ in range(MAX_ROUNDS):
            ticks = [self.ticking[k] for k in due]
            fired = self.edges(t, x) + ticks
            if starts:
                fired = self.foremost(fired)
            if not fired:
                return x, names
            due = []
            self.raise_failures(t, x, fired)
            names += [self.system.events[k].name for k in fired]
            flags = np.zeros(len(self.system.events))
            flags[fired] = 1.0
            this = Round(x, self.h, self.b, flags, bool(ticks), len(fired) > len(ticks))
            if rounds is not None:
                rounds.append(this)
            new_x, new_h = self.remap(this.ticks, this.events)(t, x, self.h, self.b, flags)
            x, held = new_x.copy(), new_h.copy()
            if not np.array_equal(held, self.h):
                self.h = held
                self.rescan()
            self.settle(t, x)
            self.finished = self.finished or any(self.system.events[k].kind == "stop" for k in fired)
        self.raise_endless(list(dict.fromkeys(names[-6:])))

    def edges(self, t: float, x: np.ndarray) -> list[int]:
        """Events whose conditions have just turned true."""
        if not self.rising:
            return []
        now = self.condition(t, x, self.h, self.b)[0] > 0.5
        risen = now & ~self.holds
        self.holds = now
        return [self.rising[k] for k in np.flatnonzero(risen)]

    def foremost(self, fired: list[int]) -> list[int]:
        """All but initial events that read what another is about to set; these may rise again in the next round.

        Those that read each other in a ring go together.
        """
        if len(fired) < 2 or not any(self.system.events[k].initial for k in fired):
            return fired
        reading = self.system.reading(fired)
        ring = connected_components(csr_array(reading), connection="strong")[1]
        waits = (reading & (ring[:, None] != ring[None, :])).any(axis=1)
        free = ~np.isin(ring, ring[waits])
        waiting = {k for k, now in zip(fired, free, strict=True) if not now}
        self.holds[[place for place, k in enumerate(self.rising) if k in waiting]] = False
        return [k for k in fired if k not in waiting]

    def raise_failures(self, t: float, x: np.ndarray, fired: list[int]) -> None:
        """Raise the message of a failure among the events that fire; in a guess, of one that no state can mend."""
        for k in fired:
            if self.guess and self.system.events_on_states[k]:
                continue
            event = self.system.events[k]
            if event.kind == "fail":
                world = np.array([t]), x[None], self.h[None], self.b[None], self.p
                shown: dict[str, str | list[str]] = {}
                for name in event.message_names:
                    variable, values = self.system.find(name), self.system.series([name], *world).ravel()
                    unit = DISPLAY.get(variable.quantity.name, "" if variable.quantity.si == "1" else None)
                    each = [variable.quantity.show(float(value), unit) for value in values]
                    shown[name.rpartition(".")[2]] = each if variable.vector else each[0]
                raise SimulationError(event.message.format(**shown))

    def raise_unsettled(self, relation: str) -> NoReturn:
        """Both values of a relation's bit contradict it."""
        raise SimulationError(
            f"both sides push towards the boundary of {relation}; the component needs a mode that rests on it"
        )

    def raise_endless(self, names: list[str]) -> NoReturn:
        """The rounds of one instant do not end."""
        raise SimulationError(f"events keep causing each other at one instant: {', '.join(names)}")

    def raise_zeno(self, name: str, within: float) -> NoReturn:
        """An event fires ever sooner."""
        raise SimulationError(
            f"{name} happens faster and faster ({ZENO_COUNT} times within {within:.2g} s); "
            "the part needs a mode in which it rests (for a mass with stops, a larger rest_speed)"
        )

    def note(self, t: float, names: list[str]) -> None:
        """Watch for events that pile up towards an instant (Zeno)."""
        for name in names:
            times = self.recent.setdefault(name, deque(maxlen=ZENO_COUNT))
            times.append(t)
            if len(times) == ZENO_COUNT and t - times[0] < ZENO_SPAN * self.span:
                self.raise_zeno(name, t - times[0])

    # -- what lies ahead -------------------------------------------------------------------------

    def next_tick(self) -> float:
        """Time of the next tick, or infinity."""
        return float(np.min(self.origin + (self.ticked + 1) * self.periods)) if self.ticking else np.inf

    def due(self, t: float) -> list[int]:
        """Positions of the ticks that fall on ``t``, counted as done."""
        times = self.origin + (self.ticked + 1) * self.periods
        hit = np.flatnonzero(times <= t + self.time_tolerance)
        self.ticked[hit] += 1
        return [int(k) for k in hit]

    def next_time_root(self, t: float, x: np.ndarray) -> float:
        """Earliest instant after ``t`` at which a relation on time alone turns or a schedule goes on, or infinity."""
        soonest = min((schedule.after(t, self.time_tolerance) for _, schedule in self.following), default=np.inf)
        if self.linear.size:
            g, rate, _ = self.relation(t, x)
            for k in self.linear:
                side = 1.0 if self.b[k] else -1.0
                if side * rate[k] < 0 and (ahead := -g[k] / rate[k]) > 0:
                    soonest = min(soonest, t + ahead)
        return min(float(soonest), self.next_curved_root(t, x))

    def rescan(self) -> None:
        """Forget the roots of relations on time where they may have changed with held values and bits."""
        if self.anew:
            self.scanned = None

    def next_curved_root(self, t: float, x: np.ndarray) -> float:
        """Earliest root after ``t`` of the relations that curve in time, or infinity; scans as far as needed.

        Relations that depend on held values are scanned up to the next tick, which may change them.
        """
        if not self.curved.size:
            return np.inf
        if self.scanned is None:
            self.curved_roots, self.scanned = [], t
        while True:
            while self.curved_roots and self.curved_roots[0] <= t + self.time_tolerance:
                self.curved_roots.pop(0)
            until = min(self.end, self.next_tick()) if self.anew else self.end
            if self.curved_roots or self.scanned >= until - self.time_tolerance:
                return self.curved_roots[0] if self.curved_roots else until if until < self.end else np.inf
            self.curved_roots, self.scanned = self.scan(self.scanned, x)

    def scan(self, start: float, x: np.ndarray) -> tuple[list[float], float]:
        """The next roots of relations that curve in time, found on a grid and closed in on; until when it looked."""
        prepared = self.system.relation
        while True:
            end, points = min(self.end, start + self.chunk), SCAN_POINTS
            if self.anew and (tick := self.next_tick()) < end:
                end, points = tick, TICK_POINTS
            times = np.linspace(start, end, points)
            columns = prepared.function(
                times.reshape(1, -1), x, self.h, self.b, np.zeros(x.size), prepared.parameters(self.p)
            )
            g, rate = np.array(columns[0])[self.curved], np.array(columns[1])[self.curved]
            swing = np.abs(rate).max(axis=1) * (times[1] - times[0])
            if np.all(swing <= SCAN_SWING * np.ptp(g, axis=1) + EPS * np.abs(g).max(axis=1)):
                self.chunk = min(2 * self.chunk, self.span / SCAN_CHUNKS)
                break
            if end - start <= self.span / SCAN_CHUNKS * SHORTEST_SCAN:
                break
            self.chunk = min(self.chunk, end - start) / 4
        found: list[float] = []
        for row, k in enumerate(self.curved):
            for j in np.flatnonzero(np.sign(g[row, 1:]) != np.sign(g[row, :-1])):
                found.append(self.close_in(int(k), float(times[j]), float(times[j + 1]), x))
            dips = (
                (g[row, 1:] * g[row, :-1] > 0) & (rate[row, :-1] * g[row, :-1] < 0) & (rate[row, 1:] * g[row, 1:] > 0)
            )
            for j in np.flatnonzero(dips):
                found += self.dip(int(k), float(times[j]), float(times[j + 1]), x)
        return sorted(found), end

    def at(self, k: int, t: float, x: np.ndarray) -> tuple[float, float]:
        g, rate, _ = self.relation(t, x)
        return float(g[k]), float(rate[k])

    def close_in(self, k: int, low: float, high: float, x: np.ndarray) -> float:
        """The sign change of relation k in [low, high] by bisection; after a zero at ``low``, where it comes back."""
        left = np.sign(self.at(k, low, x)[0]) or -np.sign(self.at(k, high, x)[0])
        while high - low > self.time_tolerance:
            middle = (low + high) / 2
            if middle in (low, high):
                break
            if np.sign(self.at(k, middle, x)[0]) in (left, 0.0):
                low = middle
            else:
                high = middle
        return high

    def dip(self, k: int, low: float, high: float, x: np.ndarray) -> list[float]:
        """Two roots hidden between samples of one sign, if the extremum between them crosses."""
        side = np.sign(self.at(k, low, x)[0])
        a, b = low, high
        while b - a > self.time_tolerance:
            middle = (a + b) / 2
            if middle in (a, b):
                break
            g, rate = self.at(k, middle, x)
            if np.sign(g) != side and g != 0:
                return [self.close_in(k, low, middle, x), self.close_in(k, middle, high, x)]
            if rate * side < 0:
                a = middle
            else:
                b = middle
        return []
