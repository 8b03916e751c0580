"""The periodic steady state: the run that is the same after one period as before it.

.. math:: P(z^*) = z^*, \\qquad z = (x, h)

P integrates one period through its events, remaps and ticks; z are the states and the held values of ticked parts, less
those that count up (a turning angle). A plain transient iterates P until it rests, which a slow volume or accumulator
delays; here Anderson acceleration proposes where it is heading. What is found is a run of the circuit itself: the last
period, integrated as every other.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from crescentlab import arguments
from crescentlab.analysis.periodic.anderson import Anderson
from crescentlab.arguments import Settings
from crescentlab.circuit import Circuit, Start, check_circuit, check_options, snapshot_of
from crescentlab.elaborate import Design
from crescentlab.errors import InputError, SimulationError
from crescentlab.netlist import SMALLEST_RTOL
from crescentlab.result import Result
from crescentlab.solvers.integrate import integrate
from crescentlab.solvers.limits import PressureLimits
from crescentlab.solvers.options import Options
from crescentlab.solvers.snapshot import Snapshot
from crescentlab.solvers.trajectory import Trajectory
from crescentlab.system import System, Values

Array = np.ndarray

MEMORY = 8
"""Earlier periods that the acceleration looks at."""
PLAIN = 2
"""Periods at the beginning that only forget the fast part of the start."""
FEWEST = 5
"""Least number of periods that the search may be limited to."""
TRIAL = 8
"""Plain periods after which it is looked whether two of them repeat themselves."""
WORSE = 3.0
"""A proposal whose period closes worse than the best by this factor is taken back."""
NOISE = 3.0
"""Repeatability of a period, in units of the relative tolerance of its integration."""
SEEN = 100.0
"""Residuals from which the slowest mode can be told, in units of the relative tolerance."""
WHOLE = 1e-9
"""A tick divides the period if it misses it by less than this part."""


@dataclass
class Periodic:
    """A periodic steady state, or how far it came."""

    result: Result
    """The last period."""
    period: float
    periods: int
    """Periods integrated."""
    converged: bool
    residual: float
    """Largest change over the last period, in units of the variables' sizes."""
    distance: float
    """Estimated distance from the fixed point, in the same units."""
    tolerance: float
    multiplier: float
    """Slowest mode: what a period leaves of a disturbance (magnitude of the Floquet multiplier seen)."""
    slowest: list[str]
    """Variables that changed most over the last period."""
    plain: int | None = None
    """Periods that a plain transient needs to come as near, if it was counted."""
    message: str = ""

    def __repr__(self) -> str:
        """How far it came, and the figures at the period's end."""
        state = "converged" if self.converged else "not converged"
        found = f"{state} in {self.periods} periods of {self.period:g} s, residual {self.residual:.1e}"
        return f"<Periodic {self.result.title!r}: {found}; {self.result.summed_up()}>"

    @property
    def end(self) -> Snapshot:
        """Where the last period ended."""
        end = self.result.trajectory.end
        assert end is not None
        return end

    @property
    def plain_estimate(self) -> float:
        """Periods that a plain transient would need, from its slowest mode."""
        if not 0 < self.multiplier < 1:
            return math.nan
        return PLAIN + max(0.0, math.log(self.tolerance) / math.log(self.multiplier))


def periodic(
    circuit: Circuit, parameters: Settings | None = None, *, period: str | float | None = None,
    tolerance: float | None = None, most: int = 300, solver: str = "rodas", rtol: float | None = None,
    compile: bool | None = None, start: Start | None = None, accelerate: bool = True, compare: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Periodic:  # fmt: skip
    """Find the periodic steady state; one that does not close within ``most`` periods comes back unconverged.

    ``tolerance`` is the largest allowed distance from the fixed point, relative to each variable's size; by default ten
    times the integration's. ``compare`` counts the periods of a plain transient as well. Raises :class:`InputError` if
    the period is not known or not a whole number of a sampled part's ticks, :class:`SimulationError` if a run fails.
    """
    check_circuit(circuit, "periodic")
    parameters = arguments.settings(parameters)
    design = circuit.design(parameters)
    seconds = circuit.period(design, period)
    section = circuit.netlist.sections.simulation
    rtol = section.rtol if rtol is None else arguments.number(rtol, "rtol", "1e-6")
    system = circuit.assembled(design)
    if changed := whole_ticks(system, design, seconds):
        design = circuit.design({**parameters, **changed})
    values = system.values(design)
    options = Options(
        stop=seconds, rtol=rtol, solver=solver, compile=section.compile if compile is None else compile,
        max_step=section.max_step,
    )  # fmt: skip
    check_options(options)
    tolerance = 10 * rtol if tolerance is None else arguments.number(tolerance, "tolerance", "1e-4")
    if not SMALLEST_RTOL <= tolerance < 1:
        raise InputError(f"tolerance {tolerance:g}: write a number from 1e-13 to below 1, for example 1e-4")
    most = arguments.whole(most, "most", FEWEST, 300)
    begin = None if start is None else snapshot_of(start, system)
    search = _Search(system, values, options, seconds, tolerance, begin)
    found = search.run(most, accelerate, progress)
    result = Result(system, found.start.values(values), design, found.trajectory)
    done = Periodic(
        result, seconds, search.periods, found.converged, found.residual, found.distance, search.tolerance,
        search.multiplier, search.worst(found), message=found.message,
    )  # fmt: skip
    if compare and found.converged:
        done.plain = search.plain_count(begin, search.z(done.end), 10 * most)
    return done


def whole_ticks(system: System, design: Design, period: float) -> dict[str, str]:
    """Settings that make every tick a whole part of the period, by the parameter its component names for that.

    A period of 33.6 ticks does not repeat itself; 34 slightly shorter ones do.
    """
    names = [event.name for event in system.events if event.kind == "every"]
    if not names:
        return {}
    ticks = np.array(system.period(system.values(design).p)).ravel()
    changed: dict[str, str] = {}
    for name, tick in zip(names, ticks, strict=True):
        count = period / tick
        if abs(count - round(count)) <= WHOLE * count and round(count):
            continue
        owner = name.rpartition(".")[0]
        component = design.instances[owner].component
        if not component.sampling:
            raise InputError(
                f"{owner} ticks every {tick * 1e3:.6g} ms, {count:.6g} times in a period of {period * 1e3:.6g} ms, so "
                f"the circuit does not repeat itself; write a period of {math.ceil(count) * tick * 1e3:.6g} ms"
            )
        value = float(getattr(component, component.sampling)) * count / math.ceil(count)
        changed[f"{owner}.{component.sampling}"] = repr(float(value))
    return changed


@dataclass
class _Found:
    start: Snapshot
    trajectory: Trajectory
    residual: float
    distance: float
    converged: bool
    message: str = ""


class _Search:
    """The iteration over periods."""

    def __init__(
        self, system: System, values: Values, options: Options, period: float, tolerance: float, begin: Snapshot | None
    ) -> None:
        self.system, self.values, self.options, self.period = system, values, options, period
        self.tolerance = tolerance
        self.begin = begin
        self.states = np.flatnonzero(~system.counting_states)
        self.held = np.flatnonzero(~system.counting_held & ticked(system))
        held_nominal = np.array([q.nominal for q in system.held_quantities])
        self.nominal = np.concatenate([system.nominal[self.states], held_nominal[self.held]])
        self.scale = self.nominal.copy()
        self.anderson = Anderson(MEMORY, NOISE * options.rtol)
        self.limits = PressureLimits(system, values.p)
        self.periods = 0
        self.multiplier = math.nan

    def z(self, at: Snapshot) -> Array:
        """What must repeat itself."""
        return np.concatenate([at.x[self.states], at.h[self.held]])

    def placed(self, z: Array, at: Snapshot) -> Snapshot:
        """``at`` with z in place."""
        x, h = at.x.copy(), at.h.copy()
        x[self.states], h[self.held] = np.split(z, [self.states.size])
        return replace(at, x=x, h=h)

    def one_period(self, start: Snapshot | None) -> Trajectory:
        """Integrate a period; raises :class:`SimulationError` with what it failed on."""
        self.periods += 1
        begin = self.options.start if start is None else start.t
        run = integrate(self.system, self.values, replace(self.options, stop=begin + self.period), None, start)
        if run.status == "interrupted":
            raise KeyboardInterrupt(run.error)
        if run.status == "stopped":
            raise SimulationError("stop_when ended the run, so it has no periodic state")
        if run.end is None:
            raise SimulationError(run.error)
        return run

    def run(self, most: int, accelerate: bool, progress: Callable[[float], None] | None) -> _Found:
        run = self.one_period(self.begin)
        assert run.end is not None
        here, best, first = run.end, math.inf, math.nan
        safe = here
        fixed: Array | None = None  # differences must be comparable from period to period
        trial = TRIAL if most >= 3 * TRIAL else 0
        while True:
            try:
                run = self.one_period(here)
            except SimulationError:
                if here is safe:
                    raise
                here, best = safe, math.inf  # the proposal was impossible; the plain image is not
                self.anderson.forget()
                continue
            assert run.end is not None
            z, image = self.z(here), self.z(run.end)
            self.scale = self.nominal + np.abs(image)
            residual = float(np.max(np.abs(image - z) / self.scale, initial=0.0))
            if fixed is None:
                first, fixed = residual, self.scale
            if residual > WORSE * best:
                self.anderson.forget()
            best = min(best, residual)
            safe = run.end
            proposal = self.anderson.next(z / fixed, image / fixed) * fixed
            if residual > SEEN * self.options.rtol:  # below, differences are noise
                self.multiplier = self.anderson.multiplier()
            distance = max(residual, float(np.max(np.abs(proposal - z) / self.scale, initial=0.0)))
            found = _Found(here, run, residual, distance, distance <= self.tolerance and self.periods > PLAIN + 1)
            if found.converged:
                return found
            if self.periods >= most - trial:
                found.message = self.explained(found, trial)
                return found
            if progress is not None and first > 0:
                progress(min(1.0, math.log(max(residual, self.tolerance) / first) / math.log(self.tolerance / first)))
            plain = not accelerate or self.periods <= PLAIN + 1
            here = run.end if plain else self.possible(proposal, run.end)

    def possible(self, z: Array, plain: Snapshot) -> Snapshot:
        """The proposal, or the plain image where the proposal breaks the limits of pressures."""
        proposed = self.placed(z, plain)
        try:
            self.limits.check(proposed.t, proposed.x, proposed.h)
        except SimulationError:
            return plain
        return proposed

    def names(self) -> list[str]:
        """Of the variables in z."""
        s = self.system
        return [s.state_names[k] for k in self.states] + [s.held_names[k] for k in self.held]

    def worst(self, found: _Found) -> list[str]:
        """Variables that moved most over the period."""
        assert found.trajectory.end is not None
        moved = np.abs(self.z(found.trajectory.end) - self.z(found.start)) / self.scale
        names = self.names()
        return [names[k] for k in np.argsort(-moved)[:3]]

    def explained(self, found: _Found, trial: int) -> str:
        """Why it did not close, and what to try; ``trial`` more periods show whether two of them repeat themselves."""
        last = [found.start, found.trajectory.end]
        for _ in range(trial):
            last.append(self.one_period(last[-1]).end)
        z = [self.z(at) for at in last[-3:] if at is not None]
        after_one, after_two = (float(np.max(np.abs(z[-1] - z[k]) / self.scale)) for k in (-2, -len(z)))
        most = ", ".join(self.worst(found))
        said = f"not periodic after {self.periods} periods of {self.period:.6g} s: {most} change most"
        said += f", by {found.residual:.2g} of their size a period where {self.tolerance:.2g} is allowed"
        if trial and after_two < after_one / 10:
            return f"{said}; two periods repeat themselves to {after_two:.2g}: write twice the period"
        return f"{said}; allow more periods, a larger tolerance, or check the period"

    def plain_count(self, begin: Snapshot | None, goal: Array, most: int) -> int | None:
        """Periods after which a plain transient is, and stays for three, within the tolerance of the fixed point."""
        counted, at, near = self.periods, begin, 0
        scale = self.nominal + np.abs(goal)
        for k in range(1, most + 1):
            at = self.one_period(at).end
            assert at is not None
            near = near + 1 if float(np.max(np.abs(self.z(at) - goal) / scale)) <= self.tolerance else 0
            if near == 3:
                self.periods = counted
                return k - 2
        self.periods = counted
        return None


def ticked(system: System) -> Array:
    """Held values (k,) of components that tick: continuous ones, which may be proposed. Others are modes."""
    owners = {event.name.rpartition(".")[0] for event in system.events if event.kind == "every"}
    return np.array([name.rpartition(".")[0] in owners for name in system.held_names], dtype=bool)
