r"""Lines of lumps that are too coarse for what a run does at their ends: told with the model to write instead.

What a line has to do to the waves in it is known without solving it: along the characteristics

.. math:: p_b(t) - Z q_b(t) = p_a(t - T) + Z q_a(t - T) - R

and mirrored, p [Pa] at the ends, q [m^3/s] into the line, T = l/a [s], Z = \rho_0 a/A [Pa s/m^3]; R [Pa], the drop by
friction from a to b, lies between those of the least and the greatest flow at either end now and a travel time before.
By how much a run misses this at least is the pressure by which its lumps are wrong, in a front or after it.
Source: Wylie & Streeter, Fluid Transients in Systems (1993), sections 3-1 and 3-2.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil
from typing import Any, Protocol, runtime_checkable

import numpy as np

from crescentlab.causality import Plan
from crescentlab.domain import HYDRAULIC, SIGNAL
from crescentlab.fluid import Fluid
from crescentlab.solvers.trajectory import Trajectory
from crescentlab.system import System
from crescentlab.units import pressure

Array = np.ndarray

SHARE, LEAST = 0.1, 1e5
"""Errors below this share of the pressures' range at the ends, and below this pressure [Pa], are not told."""
AVERAGED = 0.25
"""Of the travel time: an error counts by its mean over so long."""
SAME_SPEED = 0.05
"""Where the pressures at the ends change the travel time by more, the error is not known well enough to be told."""
PER_CHANGE = 10
"""Cells that a change should take to pass an end."""
MOST_CELLS = 100
"""Lines of more cells are not worth it."""
REFLECTIONS = 2
"""Of waves, that are followed back from a cell below absolute zero."""
BELOW_ZERO = re.compile(r"(?P<line>\S+)\.p_node\[(?P<node>\d+)\] is .* below absolute zero")
"""What a run says that ends in a cell below absolute zero."""
MOST_ROWS = 200_000
"""Of a run that are looked at."""


@runtime_checkable
class LumpedLine(Protocol):
    """What a line of lumps tells of itself."""

    @property
    def lumps(self) -> int:
        """Lumps that it is cut into."""

    def wave(self, p: Any, fluid: Fluid) -> tuple[Any, Any]:
        """Travel time [s] from end to end, and impedance [Pa s/m^3], at the pressure p [Pa]."""

    def friction_drop(self, q: Any, p: Any, fluid: Fluid) -> Any:
        """Pressure [Pa] that the steady flow q [m^3/s] loses from a to b."""


@dataclass(frozen=True)
class Miss:
    """The largest error of a line in a run."""

    error: float
    """[Pa]"""
    time: float
    change: float
    """Shortest time [s] that a change takes at an end."""
    travel: float
    """T [s]."""


def too_coarse(system: System, p: Array, trajectory: Trajectory) -> list[str]:
    """A warning for each line of lumps whose ends change faster than it can show."""
    found = []
    for name, line in _lines(system.plan).items():
        with np.errstate(all="ignore"):  # of a run that failed
            miss = _miss(system, p, trajectory, name, line)
        if miss is not None:
            commands = _commands(system.plan, name)
            change = min(commands)[0] if commands else miss.change
            found.append(
                f"{name}: near {miss.time:.4g} s its ends change faster than {_parts(line)} can show in a line that a "
                f"wave takes {_ms(miss.travel)} to travel, and its pressures are wrong by some "
                f"{pressure.show(miss.error, 'bar', 2)}; {_instead(line, miss.travel, change)}"
            )
    return found


def maybe_too_coarse(plan: Plan) -> list[str]:
    """A remark for each line of lumps beside a part whose command changes faster than the line can show."""
    found = []
    for name, line in _lines(plan).items():
        commands = _commands(plan, name)
        travel = _wave(line, 0.0, _fluid(plan, name))[0] if commands else 0.0
        there_and_back = 2 * travel / line.lumps
        if commands and (fastest := min(commands))[0] < there_and_back:
            change, giver, moved = fastest
            found.append(
                f"{name}: {giver} moves {moved} within {_ms(change)}, and a wave takes {_ms(there_and_back)} there and "
                f"back in {'the line' if line.lumps == 1 else 'one of its cells'}, so {_parts(line)} may be too "
                f"coarse: {_instead(line, travel, change)}"
            )
    return found


def _commands(plan: Plan, name: str) -> list[tuple[float, str, str]]:
    """How fast [s] signals change that move parts at a line's ends, whose they are, and which part they move."""
    beside = {
        member.instance
        for net in plan.graph.nets
        if net.domain is HYDRAULIC and any(member.instance == name for member in net.members)
        for member in net.members
    }
    found = []
    for net in plan.graph.nets:
        giver = plan.givers[net.name]
        change = getattr(plan.components[giver.instance], "change_time", None) if giver else None
        if net.domain is SIGNAL and giver is not None and change is not None:
            found += [(float(change), giver.instance, m.instance) for m in net.members if m.instance in beside]
    return found


def _lines(plan: Plan) -> dict[str, LumpedLine]:
    return {n: c for n, c in plan.components.items() if isinstance(c, LumpedLine) and "fluid" in plan.fluids[n]}


def _fluid(plan: Plan, name: str) -> Fluid:
    return plan.design.fluids[plan.fluids[name]["fluid"]]


def _miss(system: System, p: Array, trajectory: Trajectory, name: str, line: LumpedLine) -> Miss | None:
    """The error of a line, if it is large enough to be told."""
    rows, pieces = trajectory.steps, trajectory.pieces
    low = np.asarray(pieces.low, dtype=float)
    if not low.size or not 2 < rows.t.size <= MOST_ROWS:
        return None
    names = _ends(system, name)
    now = system.series(names, *rows.arrays(), p)
    if not np.isfinite(now).all():
        return None
    fluid, mean = _fluid(system.plan, name), float(now[:2].mean())
    travel, impedance = _wave(line, mean, fluid)
    if not travel > 0:
        return None
    begin = int(np.searchsorted(rows.t, rows.t[0] + travel))
    t, now = rows.t[begin:], now[:, begin:]
    if t.size < 3:
        return None
    before = _at(system, p, trajectory, low, names, t - travel)
    known = _same_speed(line, fluid, travel, np.concatenate([now[:2], before[:2]]))
    errors = _characteristics(line, fluid, mean, impedance, now, before)
    span = AVERAGED * travel
    means = [_moving_mean(t, np.where(known & np.isfinite(error), np.abs(error), 0.0), span) for error in errors]
    end = int(np.argmax([each.max() for each in means]))
    k = int(np.argmax(means[end]))
    error = float(means[end][k])
    if not error >= max(LEAST, SHARE * float(np.ptp(now[:2]))):
        return None
    window = slice(int(np.searchsorted(t, t[k] - travel)), k + 1)
    change = min(_change_time(t[window], now[j][window] + impedance * now[j + 2][window]) for j in (0, 1))
    return Miss(error, float(t[k]), change, travel)


def _at(system: System, p: Array, trajectory: Trajectory, low: Array, names: Sequence[str], times: Array) -> Array:
    """Variables between the steps, shape (names, times)."""
    pieces = trajectory.pieces
    place = np.clip(np.searchsorted(low, times, side="right") - 1, 0, low.size - 1)
    h, b = np.asarray(pieces.h)[place], np.asarray(pieces.b)[place]
    return system.series(names, times, pieces.at(place, times), h, b, p)


def _same_speed(line: LumpedLine, fluid: Fluid, travel: float, pressures: Array) -> Array:
    """Whether waves travel about as long at all of these pressures (pressures, times), shape (times,)."""
    found = np.broadcast_to(line.wave(pressures, fluid)[0], pressures.shape)
    return np.asarray((np.abs(found / travel - 1) < SAME_SPEED).all(axis=0))


def _characteristics(
    line: LumpedLine, fluid: Fluid, mean: float, impedance: float, now: Array, before: Array
) -> tuple[Array, Array]:
    """By how much the waves that arrive at a and at b are missed [Pa], from the ends now and a travel time before."""
    through = np.array([now[2], -now[3], before[2], -before[3]])
    lost = np.asarray(line.friction_drop(through, mean, fluid))
    low, high = lost.min(axis=0), lost.max(axis=0)
    at_a = now[0] - impedance * now[2] - (before[1] + impedance * before[3])
    at_b = now[1] - impedance * now[3] - (before[0] + impedance * before[2])
    return at_a - np.clip(at_a, low, high), at_b - np.clip(at_b, -high, -low)


def _moving_mean(t: Array, y: Array, span: float) -> Array:
    """Mean of y over the ``span`` before each time; before the first time it is zero."""
    steps = np.diff(t)
    integral = np.concatenate([[0.0], np.cumsum(steps * (y[1:] + y[:-1]) / 2)])
    return np.asarray((integral - np.interp(t - span, t, integral)) / span)


def _change_time(t: Array, y: Array) -> float:
    """Time [s] in which the fastest change would go through the whole range of y; 0 for a jump."""
    steps, swing = np.diff(t), float(np.ptp(y))
    if not steps.size or swing == 0:
        return float("inf")
    jumps = np.abs(np.diff(y))
    if np.any(jumps[steps <= 0] > 0.1 * swing):
        return 0.0
    steepest = float((jumps[steps > 0] / steps[steps > 0]).max(initial=0.0))
    return swing / steepest if steepest else float("inf")


def _wave(line: LumpedLine, p: float, fluid: Fluid) -> tuple[float, float]:
    travel, impedance = line.wave(p, fluid)
    return float(travel), float(impedance)


def _instead(line: LumpedLine, travel: float, change: float) -> str:
    """What to write."""
    cells = max(ceil(PER_CHANGE * travel / change), 2 * line.lumps) if change > 0 else MOST_CELLS + 1
    other = "write type: transmission_line"
    return other if cells > MOST_CELLS else f"write type: distributed_line with cells: {cells}, or transmission_line"


def _parts(line: LumpedLine) -> str:
    return "one lump" if line.lumps == 1 else f"{line.lumps} cells"


def _ms(seconds: float) -> str:
    return f"{1e3 * seconds:.3g} ms"


def ringing(system: System, p: Array, trajectory: Trajectory) -> str:
    r"""What is to be said of a cell below absolute zero while the waves from the line's ends are above; else ''.

    .. math:: p(x, t) = \tfrac12 [(p_a + Z q_a)(t - x/a) + (p_b + Z q_b)(t - (l - x)/a)] \pm \tfrac12 R

    An end sends p + Z q = (p - Z q) + 2 Z q where it is given q, and 2 p - (p - Z q) where it is given p; p - Z q came
    from the other end, so that what rings in the line is not counted. Friction is taken as if it all lowered p.
    """
    match = BELOW_ZERO.search(trajectory.error)
    line = _lines(system.plan).get(match["line"]) if match else None
    places = getattr(line, "places", None)
    if match is None or line is None or places is None or not len(np.asarray(trajectory.pieces.low)):
        return ""
    name, rows, fluid = match["line"], trajectory.steps, _fluid(system.plan, match["line"])
    names = _ends(system, name)
    now = system.series(names, *rows.arrays(), p)
    if not np.isfinite(now).all():
        return ""
    travel, impedance = _wave(line, float(now[:2].mean()), fluid)
    share, t = float(places[int(match["node"]) - 1]), float(rows.t[-1])
    gives = [port.role == "gives" for port in type(system.plan.components[name]).ports() if port.domain is HYDRAULIC][
        :2
    ]
    low = np.asarray(trajectory.pieces.low, dtype=float)

    def leaving(end: int, at: float, reflections: int) -> float:
        """The wave that leaves an end, from what the end was given there and the wave that came from the other end."""
        ends = _at(system, p, trajectory, low, names, np.array([max(at, float(rows.t[0]))]))[:, 0]
        if not reflections or at < rows.t[0]:
            return float(ends[end] + impedance * ends[end + 2])
        arriving = leaving(1 - end, at - travel, reflections - 1)
        return float(arriving + 2 * impedance * ends[end + 2] if gives[end] else 2 * ends[end] - arriving)

    waves = leaving(0, t - share * travel, REFLECTIONS) + leaving(1, t - (1 - share) * travel, REFLECTIONS)
    lost = float(np.abs(line.friction_drop(now[2:], float(now[:2].mean()), fluid)).max())
    lowest = waves / 2 - lost
    if not lowest > -float(fluid.atmospheric_pressure):
        return ""
    return (
        f"the waves from its ends make it at least {pressure.show(lowest, 'bar', 2)} there: {line.lumps} cells "
        "ring behind a front, so this need be no cavitation; write more cells and a slower change, or type: "
        "lax_wendroff_line or transmission_line, which carry fronts"
    )


def _ends(system: System, name: str) -> list[str]:
    """Pressures and flows of a line's ends."""
    ends = [port.name for port in type(system.plan.components[name]).ports() if port.domain is HYDRAULIC][:2]
    return [f"{name}.{end}.{v}" for v in ("p", "q") for end in ends]
