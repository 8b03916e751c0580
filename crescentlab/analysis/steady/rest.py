"""The equations of rest of a circuit at a frozen time, and their exact Jacobian.

.. math:: F_x = f + \\frac{x^+ - \\tilde x}{\\Delta t} = 0, \\qquad
          F_h = \\frac{T(t + \\Delta t, \\tilde x, h) - h}{\\Delta t} = 0

x [SI] states that do not count, h [SI] held values that ticks set and that do not count; T, x^+ what the tick of period
\\Delta t [s] makes of them; \\tilde x are the states with the counters (``counts=True``) moved on by \\Delta t times
the mean of their rates when the tick's interval begins and in its middle: at rest a rate is the same at both, and where
held values are interpolated in between, this is what says so. F are rates, in the unknowns' units per second; they
vanish where one tick after the other changes nothing.

A held value that a tick merely copies, T_i = h_j or x_j (a register that shifts, a sample), is at rest what it is
copied from, so only the first of a register is an unknown.
Events' held values and bits are given: :class:`Site` brings them to rest.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np

from crescentlab.closed_sets import Matrix, empty_matrix, nonzeros
from crescentlab.errors import SimulationError
from crescentlab.prepared import Evaluator, Prepared, jacobian, prepare
from crescentlab.solvers.hybrid import Hybrid
from crescentlab.solvers.limits import PressureLimits
from crescentlab.solvers.snapshot import Snapshot
from crescentlab.system import System, Values
from crescentlab.units import Quantity

Array = np.ndarray
RUNAWAY = 1e6
"""An unknown this many times its nominal size plus magnitude at the start has run away."""


@dataclass(frozen=True)
class Point:
    """States (n,), held values (k,), bits (r,), conditions that hold (c,)."""

    x: Array
    h: Array
    b: Array
    holds: Array


@dataclass(frozen=True)
class Equations:
    """The equations of rest of one structure."""

    function: Prepared
    """(t, x, h, b) -> F, and the nonzeros of dF/dy in column order."""
    pattern: ca.Sparsity
    drift: Prepared
    """(t, x, h, b) -> nonzeros of dF/dc, and dc/dt, c = (t, counting states, counting held values)."""
    drift_pattern: ca.Sparsity
    states: Array
    """Places of the unknowns among the states, shape (n_x,)."""
    held: Array
    """Places of the unknowns among the held values, shape (n_h,)."""
    copies: Array
    """Places of the held values that ticks copy from an unknown, shape (n_c,)."""
    own: Array
    """Which unknown each of states, held and copies is, shape (n_x + n_h + n_c,)."""
    n: int
    """Number of all states."""

    @property
    def places(self) -> Array:
        """Of states, held and copies among states and held values, one after the other."""
        return np.concatenate([self.states, self.n + self.held, self.n + self.copies])


def equations(system: System, groups: tuple[int, ...]) -> Equations:
    """Make them; ``groups`` says for each tick which of them it falls together with, numbered from 0."""
    made: Equations = system.once(f"rest {groups}", functools.partial(_equations, system, groups))
    return made


def _equations(system: System, groups: tuple[int, ...]) -> Equations:
    x_rate, h_rate, after = _rates(system, groups)
    states = np.flatnonzero(~system.counting_states)
    set_by_ticks = np.array([not h_rate[k].is_zero() for k in range(h_rate.numel())], dtype=bool)
    ticked = np.flatnonzero(set_by_ticks & ~system.counting_held)
    sources = _sources(system, states, ticked, after)
    copies = np.array(sorted(sources), dtype=int)
    held = np.setdiff1d(ticked, copies)
    n = system.x.numel()
    number = {int(place): k for k, place in enumerate([*states, *(n + held)])}
    own = np.array([*range(len(number)), *(number[sources[k]] for k in copies.tolist())], dtype=int)
    F = ca.vertcat(picked(x_rate, states), picked(h_rate, held))
    x_counts, h_counts = np.flatnonzero(system.counting_states), np.flatnonzero(system.counting_held)
    rates = ca.vertcat(ca.SX(1), picked(x_rate, x_counts), picked(h_rate, h_counts))
    if copies.size:
        h = ca.SX(system.h)
        h[copies.tolist()] = ca.vertcat(system.x, system.h)[[sources[k] for k in copies.tolist()]]
        inner = ca.Function("rest", system.arguments, [ca.densify(F), ca.densify(rates)])
        F, rates = inner(system.t, system.x, h, system.b, system.p)
    y = ca.vertcat(picked(system.x, states), picked(system.h, held))
    slope = jacobian(F, y)
    counters = ca.vertcat(system.t, picked(system.x, x_counts), picked(system.h, h_counts))
    drift = ca.jacobian(F, counters)
    arguments = system.arguments[:-1]
    return Equations(
        prepare("rest", arguments, system.p, [F, nonzeros(slope)]), slope.sparsity(),
        prepare("drift", arguments, system.p, [nonzeros(drift), rates], seldom=True), drift.sparsity(),
        states, held, copies, own, n,
    )  # fmt: skip


def _sources(system: System, states: Array, ticked: Array, after: list[ca.SX]) -> dict[int, int]:
    """Held values that ticks copy, and where from among states and held values: what they set is a mere symbol.

    Followed to the first of a register; of one that is closed to a ring its first place stays.
    """
    n = system.x.numel()
    symbols = ca.vertcat(system.x, system.h)
    places = [*states.tolist(), *(n + ticked).tolist()]
    known = {symbols[k].element_hash(): k for k in places}
    from_place: dict[int, int] = {}
    for k in ticked.tolist():
        new = after[k]
        source = known.get(new.element_hash()) if new.is_symbolic() else None
        if source is not None and source != n + k:
            from_place[n + k] = source
    first: dict[int, int] = {}
    for place in sorted(from_place):
        seen, at = {place}, place
        while at in from_place and from_place[at] not in seen:
            at = from_place[at]
            seen.add(at)
        first[place] = min(seen) if at in from_place else at
    return {place - n: source for place, source in first.items() if source != place}


def picked(vector: ca.SX, places: Array) -> ca.SX:
    """Elements of a column; a column of none where there are no places."""
    return vector[places.tolist()] if places.size else ca.SX(0, 1)


def _rates(system: System, groups: tuple[int, ...]) -> tuple[ca.SX, ca.SX, list[ca.SX]]:
    """Rates of all states and held values, what ticks do spread over their period, and what they set held values to.

    What several of them set is shown as none of them sets it.
    """
    x_rate, h_rate = system.f, ca.SX.zeros(system.h.numel())
    set_to = list(ca.vertsplit(system.h)) if system.h.numel() else []
    ticking = [k for k, event in enumerate(system.events) if event.kind == "every"]
    if not ticking:
        return x_rate, h_rate, set_to
    after = tick(system)
    fired = np.zeros(len(system.events))
    fired[ticking] = 1.0
    counted = after(*system.arguments, fired)[1]
    h = ca.SX(system.h)
    for k in np.flatnonzero(system.counting_held).tolist():
        h[k] = counted[k]
    f = ca.Function("f", system.arguments, [ca.densify(system.f)])
    begin = f(system.t, system.x, h, system.b, system.p)
    counts = ca.DM(system.counting_states.astype(float))
    x_rate = begin
    for group in range(max(groups) + 1):
        members = [k for k, of in enumerate(groups) if of == group]
        dt = system.periods[members[0]]
        middle = f(system.t + dt / 2, system.x + counts * begin * dt / 2, h, system.b, system.p)
        x_on = system.x + counts * (begin + middle) / 2 * dt
        fired = np.zeros(len(system.events))
        fired[[ticking[k] for k in members]] = 1.0
        new_x, new_h = after(system.t + dt, x_on, h, system.b, system.p, fired)
        x_rate = x_rate + (new_x - x_on) / dt
        change = (new_h - h) / dt
        for k in range(h.numel()):
            if not change[k].is_zero():
                set_to[k] = new_h[k] if h_rate[k].is_zero() else system.h[k]
        h_rate = h_rate + change
    return x_rate, h_rate, set_to


def tick(system: System) -> ca.Function:
    """(t, x, h, b, p, fired) -> states and held values after the ticks that fall due."""
    may_fire = [event.kind == "every" for event in system.events]
    fired, outputs = system.remapping(may_fire)
    return ca.Function("tick", [*system.arguments, fired], [ca.densify(o) for o in outputs])


class Site:
    """A circuit at a frozen time: its equations of rest as numbers, its bits and events."""

    def __init__(self, system: System, values: Values, t: float, span: float) -> None:
        """``span`` [s] is the length of the circuit's usual run, in which relations count as moving."""
        self.system, self.values, self.t = system, values, t
        self.hybrid = Hybrid(system, values, t, t + span)
        self.span = span
        rounded = [float(f"{period:.12g}") for period in self.hybrid.periods]
        self.periods = np.unique(rounded)
        """Periods of the ticks [s]; equal ones stand once."""
        self.equations = equations(system, tuple(int(k) for k in np.searchsorted(self.periods, rounded)))
        self._rest = Evaluator(self.equations.function, values.p)
        self._slope = empty_matrix(self.equations.pattern)
        self.limits = PressureLimits(system, values.p)
        states, held = self.equations.states, self.equations.held
        self.n_x = states.size
        self.names = [system.state_names[k] for k in states] + [system.held_names[k] for k in held]
        self.quantities: list[Quantity] = [system.state_quantities[k] for k in states]
        self.quantities += [system.held_quantities[k] for k in held]
        self.nominal = np.append(system.nominal[states], [system.held_quantities[k].nominal for k in held])
        floors = [self.limits.states.lowest[states], self.limits.held.lowest[held]]
        self.floors = np.concatenate(floors)
        """Lowest possible values: absolute zero of pressures, else -inf."""
        self.bound = np.full(self.nominal.size, np.inf)
        """Magnitudes beyond which unknowns have run away."""
        self.evaluations = 0

    # -- unknowns --------------------------------------------------------------------------------

    def unknowns(self, point: Point) -> Array:
        """y: states and held values that are looked for."""
        return np.concatenate([point.x[self.equations.states], point.h[self.equations.held]])

    def moved(self, point: Point, y: Array) -> Point:
        """The point with other unknowns, its bits not settled yet."""
        x, h = point.x.copy(), point.h.copy()
        x[self.equations.states], h[self.equations.held] = y[: self.n_x], y[self.n_x :]
        h[self.equations.copies] = y[self.equations.own[y.size :]]
        return replace(point, x=x, h=h)

    def levelled(self, point: Point) -> Point:
        """The point with all copies as what they are copied from."""
        return self.moved(point, self.unknowns(point)) if self.equations.copies.size else point

    def scale(self, y: Array) -> Array:
        """Size of each unknown, by which its changes are judged."""
        return np.asarray(self.nominal + np.abs(y))

    def rates(self, point: Point) -> tuple[Array, Matrix]:
        """F and dF/dy."""
        self.evaluations += 1
        F, nonzeros = self._rest(self.t, point.x, point.h, point.b)
        slope = self._slope.copy()
        slope.data[:] = nonzeros
        return F.copy(), slope

    @property
    def n_counting(self) -> int:
        """Number of states that count."""
        return int(self.system.counting_states.sum())

    def drift(self, point: Point, ahead: float = 0.0) -> tuple[Matrix, Array]:
        """dF/dc and dc/dt of the time and of what counts, ``ahead`` [s] after the frozen time."""
        nonzeros, rates = Evaluator(self.equations.drift, self.values.p)(self.t + ahead, point.x, point.h, point.b)
        slope = empty_matrix(self.equations.drift_pattern)
        slope.data[:] = nonzeros
        return slope, rates.copy()

    @property
    def counters(self) -> tuple[list[str], list[Quantity | None]]:
        """Names and quantities of what counts, the time first."""
        s = self.system
        states, held = np.flatnonzero(s.counting_states), np.flatnonzero(s.counting_held)
        names = ["time", *(s.state_names[k] for k in states), *(s.held_names[k] for k in held)]
        kinds: list[Quantity | None] = [None, *(s.state_quantities[k] for k in states)]
        return names, kinds + [s.held_quantities[k] for k in held]

    # -- bits and events -------------------------------------------------------------------------

    def begun(self, start: Snapshot | None) -> Point:
        """The start: where another run stands, or the circuit's own start values with what fires there."""
        hybrid = self.hybrid
        if start is not None:
            hybrid.resume(start)
        x = (self.values.x0 if start is None else start.x).copy()
        x, _ = hybrid.enter(self.t, x, guess=start is None)
        point = self.aligned(Point(x, hybrid.h, hybrid.b, hybrid.holds))
        self.bound = RUNAWAY * self.scale(self.unknowns(point))
        return point

    def aligned(self, point: Point) -> Point:
        """The point as if its ticks had just been: held counters as a tick sets them, all else kept."""
        if not self.hybrid.ticking:
            return point
        flags = np.zeros(len(self.system.events))
        flags[self.hybrid.ticking] = 1.0
        _, after = self.hybrid.remap(ticks=True, events=False)(self.t, point.x, point.h, point.b, flags)
        return replace(point, h=np.where(self.system.counting_held, after, point.h))

    def settled(self, point: Point) -> Point:
        """The point with its bits at rest; raises :class:`SimulationError` if they do not come to rest."""
        self.hybrid.h, self.hybrid.b = point.h, point.b
        self.hybrid.settle(self.t, point.x)
        return replace(point, b=self.hybrid.b)

    def fired(self, point: Point) -> tuple[Point, list[str]]:
        """The point after the events whose conditions have turned true there, and their names."""
        hybrid = self.hybrid
        hybrid.h, hybrid.b, hybrid.holds = point.h, point.b, point.holds.copy()
        x, names = hybrid.stop(self.t, point.x, [])
        return Point(x, hybrid.h, hybrid.b, hybrid.holds), names

    def check(self, point: Point) -> str | None:
        """A warning of tension; raises :class:`SimulationError` where a pressure is below absolute zero."""
        return self.limits.check(self.t, point.x, point.h)

    def ran_away(self, point: Point, share: float = 1.0) -> str | None:
        """The first unknown that is beyond a share of all bounds, or no number."""
        out = np.flatnonzero(~(np.abs(self.unknowns(point)) <= share * self.bound))
        return self.names[int(out[0])] if out.size else None

    def possible(self, point: Point) -> bool:
        """Whether no unknown has run away and no pressure lies below absolute zero."""
        if self.ran_away(point) is not None:
            return False
        try:
            self.check(point)
        except SimulationError:
            return False
        return True

    def snapshot(self, point: Point) -> Snapshot:
        """Where a run can go on; its ticks are counted from here."""
        clocks = len(self.hybrid.ticking)
        origin, ticked = np.full(clocks, self.t), np.zeros(clocks, dtype=np.int64)
        return Snapshot(self.t, point.x, point.h, point.b, point.holds, origin, ticked, self.hybrid.periods)

    def show_rate(self, k: int, rate: float, unit: Any) -> str:
        """A rate of unknown ``k`` as text; ``unit(quantity)`` gives the unit to show."""
        shown: str = unit(self.quantities[k])
        number = self.quantities[k].show(rate, shown, 3).partition(" ")[0]
        return f"{number}/s" if shown == "1" else f"{number} {shown}/s"
