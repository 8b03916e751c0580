"""Scenarios of the rules of events: small circuits, and what must happen in them when, worked out by hand.

States move along straight lines, which every method integrates without error, so that instants and values are exact.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from building import alone, circuit
from pydantic import Field

from crescentlab.circuit import Circuit
from crescentlab.component import Component
from crescentlab.domain import gives_signal, held, state, takes_signal
from crescentlab.maths import event_where, every, fail_when, initially, maximum, sign, stack, when, where
from crescentlab.units import Ratio, Time


def plain(name: str, start: float = 0.0, **more: Any) -> Any:
    """A state without unit."""
    return state(Ratio, name, start=start, nominal=1.0, **more)


def memory(name: str, start: float = 0.0, **more: Any) -> Any:
    """A held value without unit."""
    return held(Ratio, name, start=start, **more)


@dataclass(frozen=True)
class Instant:
    """What happens at one time: names in the order in which they fire, and values (before, after)."""

    time: float
    names: tuple[str, ...] = ()
    values: Mapping[str, tuple[float, float]] = field(default_factory=dict)


@dataclass(frozen=True)
class Scenario:
    """A sentence of the manual, a circuit, and what must be recorded."""

    sentence: str
    circuit: Callable[[], Circuit]
    instants: tuple[Instant, ...] = ()
    """All events of the run, in order; those without names are stops at which values change."""
    end: Mapping[str, float] = field(default_factory=dict)
    stop: float = 1.0
    error: str = ""
    """Pattern of the message of a run that must fail."""
    restarts: int | None = None
    tolerance: float = 1e-9
    time_tolerance: float = 1e-9
    """Of instants that depend on a curved way, as shares of the run; straight ones are exact."""


class Mover(Component):
    """x' = 1 from x = 0: x is the time, as a state."""

    x = plain("place")
    n = memory("a count")

    def equations(self, x):
        return {"der_x": 1.0}


# -- relations -----------------------------------------------------------------------------------


class Chooses(Mover):
    """y' = 1 beyond x = 0.3."""

    y = plain("integral")

    def equations(self, x):
        return {"der_x": 1.0, "der_y": event_where(x > 0.3, 1.0, 0.0)}


class Heads(Mover):
    """Begins on the boundary of its relation and moves off it: x > 0 at x = 0 is true since x rises."""

    y = plain("integral")

    def equations(self, x):
        return {"der_x": 1.0, "der_y": event_where(x > 0.0, 1.0, -1.0)}


class Meets(Mover):
    """y' = max(x - 0.3, 0), written with a plain where: y = (x - 0.3)^2/2."""

    y = plain("integral")

    def equations(self, x):
        return {"der_x": 1.0, "der_y": where(x > 0.3, x - 0.3, 0.0)}


class Window(Component):
    """y' = 1 within a window of time that is written with plain choices."""

    y = plain("integral")

    def equations(self, y, t):
        return {"der_y": where(t > 0.7, where(t < 0.7002, 1.0, 0.0), 0.0)}


class Clock(Component):
    """Gives the time."""

    y = gives_signal(Ratio, "time")

    def equations(self, t):
        return {"y": t}


class Gate(Component):
    """1 while its input is within a window."""

    u = takes_signal(Ratio, "input")
    y = gives_signal(Ratio, "1 within the window")

    def equations(self, u):
        return {"y": where(u > 0.7, where(u < 0.7002, 1.0, 0.0), 0.0)}


class Integrator(Component):
    """y' = u."""

    u = takes_signal(Ratio, "input")
    y = plain("integral")

    def equations(self, u):
        return {"der_y": u}


class SinceTheLast(Mover):
    """A held time that an event sets, and a choice a quarter of a second later."""

    y = plain("integral")
    since = memory("time of the event", 9.0)

    def equations(self, x, since, t):
        return {"der_x": 1.0, "der_y": where(t > since + 0.25, 1.0, 0.0), "sets": when(x > 0.5, since=t)}


class Triangle(Component):
    """y' is a triangle of time, 0.001 s wide: its kinks are stops, so that y = 0.0005 to rounding."""

    y = plain("integral")

    def equations(self, y, t):
        return {"der_y": maximum(0.0, 1.0 - abs(t - 0.7) / 5e-4)}


class Signs(Component):
    """b' = sign(t - 0.3)."""

    b = plain("integral of the sign")

    def equations(self, t):
        return {"der_b": sign(t - 0.3)}


# -- edges ---------------------------------------------------------------------------------------


class Once(Mover):
    """Counts each time x passes 0.25; it stays beyond."""

    def equations(self, x, n):
        return {"der_x": 1.0, "passes": when(x > 0.25, n=n + 1)}


class TrueAtTheStart(Mover):
    """A condition that holds from the start on."""

    def equations(self, x, n):
        return {"der_x": 1.0, "begins": when(x >= 0.0, n=n + 1)}


class Saw(Mover):
    """Falls back by 0.4 each time it reaches 0.5: at 0.5, 0.9; true, false, true again."""

    def equations(self, x, n):
        return {"der_x": 1.0, "resets": when(x >= 0.5, x=x - 0.4, n=n + 1)}


# -- rounds --------------------------------------------------------------------------------------


class Writer(Component):
    """Counts when time passes 0.5, and gives its count."""

    y = gives_signal(Ratio, "its count")
    n = memory("count")

    def equations(self, n, t):
        return {"y": n, "writes": when(t > 0.5, n=n + 1)}


class Reader(Component):
    """Takes over its input at the same instant, and once more when the input has risen."""

    u = takes_signal(Ratio, "input")
    seen = memory("what it saw first", -1.0)
    later = memory("what it saw next", -1.0)

    def equations(self, u, t):
        return {"reads": when(t > 0.5, seen=u), "sees": when(u > 0.5, later=u)}


class InOrder(Mover):
    """Two events of one instant in one part: first doubled, then one more."""

    def equations(self, x, n):
        return {"der_x": 1.0, "doubles": when(x > 0.5, n=2 * n), "adds": when(x > 0.5, n=n + 1)}


class Endless(Mover):
    """Each firing makes its condition false and true again."""

    m = memory("the other")

    def equations(self, x, n, m):
        return {"der_x": 1.0, "tick": when((x > 0.5) & (n <= m), n=n + 1), "tock": when(n > m, m=m + 1)}


class Taker(Component):
    """Takes its input over at the start and gives it."""

    u = takes_signal(Ratio, "input")
    y = gives_signal(Ratio, "what it took over")
    taken = memory("what it took over")
    ready = memory("1 once it has")

    def equations(self, u, taken, ready):
        return {"y": taken, "takes": initially(ready == 0, taken=u, ready=1.0)}


class Five(Component):
    """Gives 5."""

    y = gives_signal(Ratio, "5")

    def equations(self):
        return {"y": 5.0}


def takers() -> Circuit:
    """Three in a row, in an order that is not theirs."""
    parts = {"c": {"type": "taker"}, "a": {"type": "taker"}, "b": {"type": "taker"}, "five": {"type": "five"}}
    nets = {"s0": "[five.y, a.u]", "s1": "[a.y, b.u]", "s2": "[b.y, c.u]"}
    return circuit(Taker, Five, components=parts, nets=_lists(nets))


class Comparing(Component):
    """Takes 1 over if its input is above 3, from the start on."""

    u = takes_signal(Ratio, "input")
    high = memory("1 if the input was above 3")
    ready = memory("1 once it has looked")

    def equations(self, u, high, ready):
        return {"looks": initially(ready == 0, high=where(u > 3, 1.0, 0.0), ready=1.0)}


def relay_behind_a_sampler() -> Circuit:
    """A comparison behind a part that takes its value over at the start."""
    parts = {"r": {"type": "comparing"}, "a": {"type": "taker"}, "five": {"type": "five"}}
    return circuit(Taker, Five, Comparing, components=parts, nets=_lists({"s0": "[five.y, a.u]", "s1": "[a.y, r.u]"}))


# -- ticks ---------------------------------------------------------------------------------------


class Ticks(Component):
    """Counts ticks of 0.1 s and remembers the last."""

    dt: Time = Field(default=0.1, gt=0, description="period")
    n = memory("count", counts=True)
    last = memory("time of the last tick")

    def equations(self, n, t):
        return {"tick": every(self.dt, n=n + 1, last=t)}


# -- rest, chatter, vectors, failures ---------------------------------------------------------------


class Ball(Component):
    """Falls from 1 m with 8 m/s2 and loses half of its speed at each bounce, without a mode that rests."""

    x = plain("height", 1.0)
    v = plain("velocity")

    def equations(self, x, v):
        return {"der_x": v, "der_v": -8.0, "bounce": when(x < 0.0, x=0.0, v=-0.5 * v)}


class Resting(Ball):
    """The same, resting once it is slower than 0.6 m/s."""

    resting = memory("1 while it rests")

    def equations(self, x, v, resting):
        free, slow = resting == 0, v > -1.2
        hit = {"x": 0.0, "v": where(slow, 0.0, -0.5 * v), "resting": where(slow, 1.0, 0.0)}
        return {"der_x": v, "der_v": where(free, -8.0, 0.0), "bounce": when(free & (x < 0.0), **hit)}


class Coulomb(Component):
    """Dry friction against a force smaller than it: both sides push towards v = 0."""

    v = plain("velocity", 1.0)

    def equations(self, v):
        return {"der_v": event_where(v > 0.0, -2.0, 2.0) + 0.5}


class PlainCoulomb(Coulomb):
    """The same written with a plain where."""

    def equations(self, v):
        return {"der_v": where(v > 0.0, -2.0, 2.0) + 0.5}


class Shifts(Mover):
    """A chain of three that moves up one place each time x has gone on by 0.3."""

    chain = held(Ratio, "chain", size=3, start=0.0)
    passed = memory("place of the last shift")

    def equations(self, x, chain, passed):
        return {"der_x": 1.0, "shifts": when(x - passed >= 0.3, chain=stack(x, chain)[:-1], passed=passed + 0.3)}


class Chattering(Mover):
    """Falls back to 0 each time it has reached a thousandth: 1999 times in two seconds."""

    def equations(self, x):
        return {"der_x": 1.0, "resets": when(x >= 1e-3, x=0.0)}


class Limited(Mover):
    """A law left behind for good at x = 0.6."""

    def equations(self, x):
        return {"der_x": 1.0, "leaves": fail_when(x > 0.6, "too far: use another part")}


class Sampled(Mover):
    """Ten ticks and two events that change neither a state nor f, and one that changes f."""

    rate = memory("slope of y", 1.0)
    y = plain("integral")

    def equations(self, x, n, rate):
        return {
            "der_x": 1.0, "der_y": rate, "tick": every(0.1, n=n + 1),
            "notes": when(x > 0.25, n=n + 1), "notes_again": when(x > 0.35, n=n + 1), "turns": when(x > 0.55, rate=2.0),
        }  # fmt: skip


def _lists(nets: Mapping[str, str]) -> dict[str, Any]:
    return {name: [port.strip() for port in text.strip("[]").split(",")] for name, text in nets.items()}


def gated() -> Circuit:
    """A clock, a window behind it, an integral behind that."""
    parts = {"part": {"type": "integrator"}, "gate": {"type": "gate"}, "clock": {"type": "clock"}}
    nets = _lists({"s0": "[clock.y, gate.u]", "s1": "[gate.y, part.u]"})
    return circuit(Clock, Gate, Integrator, components=parts, nets=nets)


def formula() -> Circuit:
    """The same window as a formula of time."""
    text = "where(t > 0.7 s, where(t < 0.7002 s, 1, 0), 0)"
    parts = {"part": {"type": "integrator"}, "gate": {"type": "expression", "formula": text, "inputs": []}}
    return circuit(Integrator, components=parts, nets=_lists({"s1": "[gate.y, part.u]"}))


def steps() -> Circuit:
    """floor(4 t) in a formula, its integral, and a sign."""
    parts = {"part": {"type": "integrator"}, "sign": {"type": "signs"}}
    parts["gate"] = {"type": "expression", "formula": "floor(4 * t / (1 s))", "inputs": []}
    return circuit(Integrator, Signs, components=parts, nets=_lists({"s1": "[gate.y, part.u]"}))


def writer_and_reader() -> Circuit:
    """Two parts at one instant."""
    parts = {"reader": {"type": "reader"}, "writer": {"type": "writer"}}
    return circuit(Writer, Reader, components=parts, nets=_lists({"s": "[writer.y, reader.u]"}))


def one(cls: type[Component], **parameters: Any) -> Callable[[], Circuit]:
    """A circuit of one part called ``part``."""
    return lambda: alone(cls, **parameters)


SCENARIOS = {
    "where makes no event": Scenario(
        "`where` makes no event.", one(Meets), end={"part.y": 0.7**2 / 2}, restarts=0, tolerance=1e-5
    ),
    "a plain choice that chatters is named": Scenario(
        "If both branches push back to the boundary, the run ends and names the part.",
        one(PlainCoulomb), error=r"both sides push towards the boundary of part", stop=2.0,
    ),
    "frozen bit": Scenario(
        "It is a bit, frozen between events, that flips where its two sides meet.",
        one(Chooses), (Instant(0.3),), {"part.y": 0.7}, restarts=1,
    ),
    "heading": Scenario(
        "On the boundary itself a bit takes the side that its relation is heading for.",
        one(Heads), end={"part.y": 1.0}, restarts=0,
    ),
    "time in where": Scenario(
        "A condition on time alone is an exact stop, wherever it is written: in `where`, in a formula, behind other "
        "signals.",
        one(Window), (Instant(0.7), Instant(0.7002)), {"part.y": 2e-4}, restarts=2,
    ),
    "time behind signals": Scenario(
        "A condition on time alone is an exact stop, wherever it is written: in `where`, in a formula, behind other "
        "signals.",
        gated, (Instant(0.7), Instant(0.7002)), {"part.y": 2e-4}, restarts=2,
    ),
    "time in a formula": Scenario(
        "A condition on time alone is an exact stop, wherever it is written: in `where`, in a formula, behind other "
        "signals.",
        formula, (Instant(0.7), Instant(0.7002)), {"part.y": 2e-4}, restarts=2,
    ),
    "time and held values": Scenario(
        "It may read held values too where it is a straight line in time.",
        one(SinceTheLast),
        (Instant(0.5, ("part.sets",), {"part.since": (9.0, 0.5)}), Instant(0.75)),
        {"part.y": 0.25},
    ),
    "kinks": Scenario(
        "`min`, `max` and `abs` of such values stop at their kinks; `sign`, `floor` and `ceil` at their jumps.",
        one(Triangle), end={"part.y": 5e-4}, restarts=0, tolerance=1e-7,
    ),
    "jumps": Scenario(
        "`min`, `max` and `abs` of such values stop at their kinks; `sign`, `floor` and `ceil` at their jumps.",
        steps, (Instant(0.25), Instant(0.3), Instant(0.5), Instant(0.75)),
        {"part.y": 1.5, "sign.b": 0.4}, restarts=4,
    ),
    "edge": Scenario(
        "**`when` fires on the edge** from false to true.",
        one(Saw),
        (Instant(0.5, ("part.resets",), {"part.x": (0.5, 0.1), "part.n": (0.0, 1.0)}),
         Instant(0.9, ("part.resets",), {"part.x": (0.5, 0.1), "part.n": (1.0, 2.0)})),
        {"part.x": 0.2}, restarts=2,
    ),
    "true at the start": Scenario(
        "Before the start everything counts as false, so what is true at the start fires at the start.",
        one(TrueAtTheStart), (Instant(0.0, ("part.begins",)),), {"part.n": 1.0}, restarts=0,
    ),
    "stays true": Scenario(
        "What stays true does not fire again.",
        one(Once), (Instant(0.25, ("part.passes",), {"part.n": (0.0, 1.0)}),), {"part.n": 1.0}, restarts=0,
    ),
    "world before the round": Scenario(
        "All events that fire together read the world just before the round.",
        writer_and_reader,
        (Instant(0.5, ("reader.reads", "writer.writes", "reader.sees"),
                 {"reader.seen": (-1.0, 0.0), "writer.n": (0.0, 1.0), "reader.later": (-1.0, 1.0)}),),
    ),
    "order written": Scenario(
        "Within one component they compose in the order written.",
        one(InOrder, start={"n": "3"}),
        (Instant(0.5, ("part.doubles", "part.adds"), {"part.n": (3.0, 7.0)}),),
    ),
    "next round": Scenario(
        "Edges that this makes fire in the next round.",
        writer_and_reader, (Instant(0.5, ("reader.reads", "writer.writes", "reader.sees")),), {"reader.later": 1.0},
    ),
    "endless": Scenario(
        "After 40 rounds the run ends with an error that names them.",
        one(Endless), error=r"events keep causing each other at one instant: part\.t(ick|ock), part\.t(ick|ock)",
    ),
    "samplers in a row": Scenario(
        "`initially(condition, ...)` is a `when` that waits at the start until the parts that it reads have set their "
        "own values: what a sampler, a delay or a filter takes over from its input.",
        takers, (Instant(0.0, ("a.takes", "b.takes", "c.takes")),), {"a.taken": 5.0, "b.taken": 5.0, "c.taken": 5.0},
    ),
    "relay behind a sampler": Scenario(
        "It waits for what it assigns, not for its condition.",
        relay_behind_a_sampler, (Instant(0.0, ("a.takes", "r.looks")),), {"r.high": 1.0},
    ),
    "ticks": Scenario(
        "**`every(dt)`** ticks at t0 + k dt, k = 1, 2, ..., without accumulated error.",
        one(Ticks),
        tuple(Instant(0.1 * k, ("part.tick",), {"part.n": (k - 1.0, float(k))}) for k in range(1, 11)),
        {"part.n": 10.0, "part.last": 1.0}, restarts=0, tolerance=1e-15,
    ),
    "zeno": Scenario(
        "such a run ends with exit code 3 and the event's name.",
        one(Ball), error=r"part\.bounce happens faster and faster", stop=2.0,
    ),
    "rest mode": Scenario(
        "Give the part a held value, `resting`, that is set when it is slow and cleared when a force pulls it off.",
        one(Resting),  # 4 m/s at 0.5 s; then flights of 0.5, 0.25 s at 2, 1 m/s
        (Instant(0.5, ("part.bounce",), {"part.v": (-4.0, 2.0)}),
         Instant(1.0, ("part.bounce",), {"part.v": (-2.0, 1.0)}),
         Instant(1.25, ("part.bounce",), {"part.v": (-1.0, 0.0), "part.resting": (0.0, 1.0)})),
        {"part.x": 0.0}, stop=2.0, restarts=3, tolerance=1e-5, time_tolerance=1e-7,
    ),
    "chatter": Scenario(
        "If both sides of a relation push towards its boundary, no value of its bit is right: an error says so.",
        one(Coulomb), error=r"both sides push towards the boundary of part: v > 0", stop=2.0,
    ),
    "shift": Scenario(
        "moves every element up one place.",
        one(Shifts),
        tuple(Instant(0.3 * k, ("part.shifts",), {"part.chain[1]": (0.3 * k - 0.3, 0.3 * k)}) for k in (1, 2, 3)),
        {"part.chain[1]": 0.9, "part.chain[2]": 0.6, "part.chain[3]": 0.3}, restarts=0,
    ),
    "failure": Scenario(
        "**`fail_when`** ends the run at the instant its condition becomes true; what was computed is kept.",
        one(Limited), error=r"0\.6 s of 1 s: part: too far: use another part", end={"part.x": 0.6},
    ),
    "restarts": Scenario(
        "`restarts` counts these stops, alike for every solver.",
        one(Sampled), end={"part.y": 1.45, "part.n": 12.0}, restarts=1,
    ),
}  # fmt: skip
