"""The operating point of a circuit: where nothing changes any more.

Newton's method on the exact Jacobian of the equations of rest (:mod:`crescentlab.analysis.steady.rest`), from the start
values; where it stalls, pseudo-transient continuation; where that stalls too, a transient, and Newton's method from its
end.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from crescentlab import arguments
from crescentlab.analysis.steady.closed import Ledger
from crescentlab.analysis.steady.newton import Found, Newton, NoRestError
from crescentlab.analysis.steady.pseudo_transient import PseudoTransient
from crescentlab.analysis.steady.rest import Point, Site
from crescentlab.analysis.steady.stability import stability
from crescentlab.analysis.steady.timing import changing
from crescentlab.analysis.steady.unrest import check_drift, resisting
from crescentlab.arguments import Settings
from crescentlab.circuit import Circuit, Start, check_circuit, snapshot_of
from crescentlab.closed_sets import some
from crescentlab.elaborate import Design
from crescentlab.errors import InputError, SimulationError
from crescentlab.result import Result
from crescentlab.solvers.integrate import integrate
from crescentlab.solvers.options import Options
from crescentlab.solvers.ranges import beyond_ranges
from crescentlab.solvers.snapshot import Snapshot
from crescentlab.solvers.trajectory import Recording, Rows, Statistics, Trajectory
from crescentlab.system import System, Values
from crescentlab.units import QUANTITIES

Method = Literal["newton", "continuation", "transient"]

SPANS = (1, 3, 9, 27)
"""Lengths of the parts of a transient, in lengths of the circuit's usual run; after each Newton's method is tried."""
SMALLEST_TOLERANCE = 1e-13


@dataclass(frozen=True)
class OperatingPoint:
    """Where a circuit comes to rest."""

    system: System
    values: Values
    """Parameters, and as start values the operating point's."""
    design: Design
    snapshot: Snapshot
    """Where a run can go on."""
    method: Method
    iterations: int
    """Newton's, all attempts together."""
    steps: int
    """Of the continuation or the transient."""
    residual: float
    """Largest correction that Newton's method would still make, over nominal size plus magnitude of the unknown."""
    unknowns: int
    """Their number: states and held values that do not count."""
    resting: tuple[str, ...]
    """Unknowns held fast by the mode they are in: a mass on its stop."""
    time_constant: float | None
    """Slowest way back to the point [s]; None if not known, or if there is none."""
    wall_s: float
    warnings: tuple[str, ...] = ()
    result: Result = field(init=False, repr=False)
    """The point as a run of one row."""

    def __post_init__(self) -> None:
        one = _one_row(self.system, self.values, self.design, self.snapshot, f"steady: {self.method}")
        one.trajectory.warnings += self.warnings
        one.trajectory.statistics.wall_s = self.wall_s
        object.__setattr__(self, "result", one)

    def __repr__(self) -> str:
        """How it was found, and its figures."""
        found = f"by {self.method}, residual {self.residual:.1e}, {self.unknowns} unknowns"
        return f"<OperatingPoint {self.result.title!r}: {found}; {self.result.summed_up()}>"


def steady(
    circuit: Circuit, parameters: Settings | None = None, *, start: Start | None = None,
    at: str | float | None = None, tolerance: float = 1e-9, progress: Callable[[float], None] | None = None,
) -> OperatingPoint:  # fmt: skip
    """Find the operating point of a circuit near its start values, or near where another run ended (``start``).

    Time stands still at ``at`` [s], by default at the start's. ``tolerance`` is the largest relative error of an
    unknown, over its nominal size plus magnitude. Raises :class:`InputError` where there is no steady state, and
    :class:`SimulationError` naming the equations that resist where none is found.
    """
    check_circuit(circuit, "steady")
    tolerance = arguments.number(tolerance, "tolerance", "1e-9")
    if not SMALLEST_TOLERANCE <= tolerance < 1:
        raise InputError(f"tolerance {tolerance:g}: write a number from 1e-13 to below 1, for example 1e-9")
    design = circuit.design(parameters)
    system = circuit.assembled(design)
    values = system.values(design)
    begin = None if start is None else snapshot_of(start, system)
    frozen = _instant(at)
    search = _Search(system, values, design, begin, frozen, tolerance, progress)
    with np.errstate(all="ignore"):  # what is not finite is looked for where it matters
        return search.run()


def _instant(at: str | float | None) -> float | None:
    return None if at is None else arguments.quantity(at, "at", QUANTITIES["time"])


class _Search:
    """One search for an operating point, by one method after the other."""

    def __init__(
        self, system: System, values: Values, design: Design, begin: Snapshot | None, at: float | None,
        tolerance: float, progress: Callable[[float], None] | None,
    ) -> None:  # fmt: skip
        self.system, self.values, self.design, self.begin = system, values, design, begin
        self.frozen, self.progress = at is not None, progress
        t = at if at is not None else begin.t if begin is not None else values.start_time
        self.span: float = design.netlist.sections.simulation.stop
        self.site = Site(system, values, t, self.span)
        self.ledger = Ledger(self.site)
        self.newton = Newton(self.site, self.ledger, tolerance)
        self.steps = 0
        self.method: Method = "newton"
        self.tried: list[str] = []
        """What each method said as it gave up."""
        self.last: Point

    def run(self) -> OperatingPoint:
        begun = time.perf_counter()
        start = self.last = self.site.begun(self.begin)
        check_drift(self.site, start, frozen=self.frozen)
        self.ledger.begin(start)
        found = self.found(start)
        return self.point(found, begun)

    def found(self, start: Point) -> Found:
        """By the first method that comes to rest; raises :class:`SimulationError` if none does."""
        ways: dict[Method, Callable[[Point], Found]] = {
            "newton": self.newton.solve, "continuation": self.continuation, "transient": self.transient,
        }  # fmt: skip
        for self.method, way in ways.items():
            self.ledger.begin(start)
            try:
                found = way(start)
                self.site.check(found.point)
                return found
            except (NoRestError, SimulationError) as problem:
                self.tried.append(f"{self.method}: {problem}")
        where = resisting(self.site, self.last, self.ledger, self.unit)
        raise SimulationError(
            f"no operating point was found; {where}; look there for a flow without a way out or a load without a "
            f"balance, or start nearer (--start FILE, start: in the circuit) [{'; '.join(self.tried)}]"
        )

    def continuation(self, start: Point) -> Found:
        way = PseudoTransient(self.site, self.ledger, self.newton)
        try:
            return way.solve(start)
        finally:
            self.steps = way.steps
            self.last = way.last or start

    def transient(self, start: Point) -> Found:
        """Let time pass until Newton's method finds rest, at most until the time switches something."""
        at, self.steps = self.site.snapshot(start), 0
        self.site.settled(start)
        until = self.site.hybrid.next_time_root(self.site.t, start.x)
        for span in SPANS:
            stop = min(at.t + span * self.span, until - 1e-6 * self.span)
            if not stop > at.t:
                break
            options = Options(stop=stop, start=at.t, rtol=1e-6, solver="rodas")
            run = integrate(self.system, self.values, options, self.progress, at)
            self.steps += run.statistics.steps
            if run.end is None or run.status != "done":
                raise NoRestError(run.error or "stop_when ended it")
            at = run.end
            point = self.site.aligned(Point(at.x, at.h, at.b, at.holds.astype(bool)))
            self.last = point
            self.ledger.begin(point)
            try:
                return self.newton.solve(self.site.settled(point))
            except NoRestError as problem:
                said = str(problem)
        raise NoRestError(said if at.t > self.site.t else "the time switches something at once")

    # -- what was found --------------------------------------------------------------------------

    def point(self, found: Found, begun: float) -> OperatingPoint:
        point, linear = found.point, found.linear
        warnings = [
            said
            for said in (
                self.site.check(point),
                check_drift(self.site, point, frozen=self.frozen) or changing(self.site, point),
            )
            if said is not None
        ]
        warnings += self.undecided(found)
        warnings += beyond_ranges(self.system, self.values.p, _row(self.site.snapshot(point)))
        slowest = None
        seen = stability(self.site, point, linear.active)
        if isinstance(seen, str):
            warnings.append(f"stability: {seen}")
        else:
            slowest = seen.slowest
            warnings += seen.warnings()
        names = self.site.names
        still = tuple(names[k] for k in np.setdiff1d(np.arange(len(names)), linear.active))
        snapshot = self.site.snapshot(point)
        return OperatingPoint(
            self.system, snapshot.values(self.values), self.design, snapshot, self.method, self.newton.iterations,
            self.steps, found.residual, len(names), still, slowest, time.perf_counter() - begun, tuple(warnings),
        )  # fmt: skip

    def undecided(self, found: Found) -> list[str]:
        """What the equations of rest leave open, and how it was decided."""
        linear = found.linear
        said = []
        for each in linear.closed:
            inside = [self.ledger.names[k] for k in each.members]
            said.append(f"{some(inside)}: nothing flows in or out, so the fluid inside is that of the start")
        directions = linear.open_directions()
        if directions.size:
            share = np.abs(directions).max(axis=1)
            loose = [self.site.names[linear.active[k]] for k in np.flatnonzero(share > 0.1 * share.max())]
            said.append(f"{some(loose)}: other values are at rest too; these are the ones nearest to the start")
        elif linear.singular:
            said.append("the equations leave some states open; too many unknowns to say which")
        return said

    def unit(self, quantity: object) -> str:
        """The unit that the circuit shows a quantity in."""
        one = _one_row(self.system, self.values, self.design, self.site.snapshot(self.last), "")
        return one.display_unit(quantity)  # type: ignore[arg-type]


def _row(at: Snapshot) -> Rows:
    rows = Recording()
    rows.add(at.t, at.x, at.h, at.b)
    return rows.done()


def _one_row(system: System, values: Values, design: Design, at: Snapshot, solver: str) -> Result:
    trajectory = Trajectory(_row(at), None, [], Statistics(), solver, end=at)
    return Result(system, values, design, trajectory)
