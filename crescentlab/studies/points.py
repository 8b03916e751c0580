"""One point of a study: run the circuit there and measure its outcomes. Whatever goes wrong becomes a reason."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from crescentlab.analysis.outcome import Outcome, Window
from crescentlab.circuit import Circuit
from crescentlab.elaborate import Design
from crescentlab.errors import CrescentlabError, ExpressionError, InputError
from crescentlab.expressions import Value, evaluate, is_expression, number_of
from crescentlab.result import Result
from crescentlab.solvers.snapshot import Snapshot
from crescentlab.studies.provenance import Source
from crescentlab.studies.standing import Still
from crescentlab.studies.study_file import RunSection, UntilSection
from crescentlab.studies.targets import value_of_setting
from crescentlab.units import QUANTITIES

DONE, UNSETTLED, FAILED, SLOW, LOST = "done", "unsettled", "failed", "slow", "lost"
"""What became of a point. ``unsettled``: it ran, but did not come to rest within what it was allowed; ``slow``: it took
longer than its time limit; ``lost``: its process died."""
WINDOW_SLACK = 1e-9
"""A window may be longer than its run by this share, which is roundoff of times."""


@dataclass(frozen=True)
class Job:
    """One point as it is sent to a process: plain data only."""

    key: str
    circuit: str
    no_code: bool
    source: Source
    """What the circuit is made of; a process that finds something else refuses."""
    settings: Mapping[str, str]
    varied: tuple[str, ...]
    run: RunSection
    measure: Mapping[str, str]
    write: str | None = None
    """File for the whole result over time."""


@dataclass
class Reply:
    """What a process says of a point. Outcomes and values in SI."""

    key: str
    status: str
    reason: str = ""
    warnings: list[str] = field(default_factory=list)
    values: dict[str, float | str] = field(default_factory=dict)
    """Of settings written as expressions."""
    outcomes: dict[str, float] = field(default_factory=dict)
    wall_s: float = math.nan
    final_time: float = math.nan
    steps: int = 0


@dataclass
class _Ran:
    """A run, and the window that outcomes are measured over."""

    result: Result
    window: Window | None
    status: str = DONE
    reason: str = ""
    steps: int = 0


def run_point(circuit: Circuit, job: Job) -> Reply:
    """Run the point; never raises for what the point itself does wrong."""
    begun = time.perf_counter()
    reply = Reply(job.key, FAILED)
    try:
        design = circuit.design(job.settings)
        names = [name for name in job.varied if is_expression(job.settings[name])]
        reply.values = {name: value_of_setting(design, name) for name in names}
        ran = _ANALYSES[job.run.analysis](circuit, job, design)
        _fill(reply, ran, job)
    except CrescentlabError as error:
        reply.reason = _sentence(error)
    except (ArithmeticError, ValueError, TypeError, LookupError, AttributeError, RuntimeError) as error:
        reply.reason = f"{type(error).__name__}: {error}".replace("\n", " ") + " (this is a bug of crescentlab)"
    reply.wall_s = time.perf_counter() - begun
    return reply


def _fill(reply: Reply, ran: _Ran, job: Job) -> None:
    """Measure the outcomes, and write the result if it is wanted."""
    trajectory = ran.result.trajectory
    reply.status, reply.reason, reply.steps = ran.status, ran.reason, ran.steps
    reply.warnings, reply.final_time = list(trajectory.warnings), float(ran.result.time[-1])
    if job.write is not None:
        ran.result.write(Path(job.write))
    if ran.window is None:
        return
    outcomes = {name: Outcome(name, text) for name, text in job.measure.items()}
    ran.window.load(n for outcome in outcomes.values() for n in outcome.variables(ran.window.system))
    for name, outcome in outcomes.items():
        try:
            value = float(outcome.value(ran.window).value)
            if math.isfinite(value):
                reply.outcomes[name] = value
                continue
            said = f"{name} is not a finite number"
        except InputError as error:
            said = error.message
        reply.status, reply.reason = FAILED, "; ".join(part for part in (reply.reason, said) if part)


def _sentence(error: CrescentlabError) -> str:
    place = error.place if isinstance(error, InputError) else None
    said = str(error) if place is None or not isinstance(error, InputError) else error.message
    where = f"{Path(place.file).name}:{place.line}: " if place is not None else ""
    return where + said.replace("\n", " ").removeprefix("--set ")


# -- analyses ------------------------------------------------------------------------------------


def seconds(text: str, design: Design) -> float:
    """A time: with its unit, or an expression of the circuit's parameters. Raises :class:`InputError`."""
    if not is_expression(text):
        return QUANTITIES["time"].parse(text)
    parameters = design.parameters[""]

    def find(name: str) -> Value:
        if name in parameters:
            return parameters[name]
        raise ExpressionError(f"{text}: no parameter {name!r}")

    found = number_of(evaluate(text, find), QUANTITIES["time"])
    if not found > 0:
        raise InputError(f"{text} gives {found:g} s, where a time above 0 is needed")
    return found


def check_window(run: RunSection, design: Design, stop: float) -> None:
    """Refuse a window longer than the run; ``stop`` [s] is the circuit's, for a run section that names none."""
    if run.window is None:
        return
    end = stop if run.stop is None else seconds(run.stop, design)
    window = seconds(run.window, design)
    if window > end * (1 + WINDOW_SLACK):
        said = f"{run.window}, {window:g} s" if is_expression(run.window) else run.window
        until = f"of {end:g} s, the circuit's own stop" if run.stop is None else f"with stop: {run.stop}"
        raise InputError(f"{said} is longer than the run {until}; write a shorter window or a later stop")


def _options(run: RunSection) -> dict[str, Any]:
    given = {"solver": run.solver, "rtol": run.rtol, "compile": run.compile}
    return {name: value for name, value in given.items() if value is not None}


def _simulate(circuit: Circuit, job: Job, design: Design) -> _Ran:
    """One simulation; outcomes over its last part, or the whole of it."""
    run = job.run
    if run.until is not None:
        return _until(circuit, job, design, run.until)
    check_window(run, design, circuit.netlist.sections.simulation.stop)
    stop = None if run.stop is None else seconds(run.stop, design)
    result = circuit.simulate(stop, job.settings, max_step=run.max_step, check=False, **_options(run))
    steps = result.trajectory.statistics.steps
    if not result.trajectory.complete:
        return _Ran(result, None, FAILED, result.trajectory.error, steps)
    end = float(result.trajectory.steps.t[-1])
    begin = None if run.window is None else end - seconds(run.window, design)
    if begin is not None and begin < -WINDOW_SLACK * end:
        said = f"the run ended at {end:g} s, before a window of {end - begin:g} s was full"
        return _Ran(result, None, FAILED, said, steps)
    return _Ran(result, Window(result, None if begin is None else max(begin, 0.0)), steps=steps)


def _until(circuit: Circuit, job: Job, design: Design, until: UntilSection) -> _Ran:
    """Windows of equal length, one after another, until an outcome changes no more; the last one is measured."""
    every, watched = seconds(until.every, design), settling(until)
    start: Snapshot | None = None
    last = before_last = math.inf
    steps, said = 0, ""
    for number in range(1, until.at_most + 1):
        result = circuit.simulate(
            number * every, job.settings, start=start, max_step=job.run.max_step, check=False, **_options(job.run)
        )
        steps += result.trajectory.statistics.steps
        if result.trajectory.status != "done":
            reason = result.trajectory.error or f"the run was stopped at {result.time[-1]:g} s, before it settled"
            return _Ran(result, None, FAILED, reason, steps)
        window = Window(result)
        value = watched.value(window)
        now, limit = float(value.value), within(until, value)
        if max(abs(now - last), abs(now - before_last)) <= limit:  # two alike may stand on both sides of an extremum
            return _Ran(result, window, steps=steps)
        shown = value.quantity.show(abs(now - last), next(iter(value.quantity.units)))
        said = f"{until.settled} still changed by {shown}, more than {until.within}"
        start, last, before_last = result.trajectory.end, now, last
    return _Ran(result, window, UNSETTLED, f"after {until.at_most} windows {said}", steps)


def settling(until: UntilSection) -> Outcome:
    """The outcome that must settle; of a variable its mean."""
    text = until.settled.strip()
    return Outcome("until.settled", text if "(" in text else f"mean({text})")


def within(until: UntilSection, value: Value) -> float:
    """Largest change of ``value`` from window to window [SI]; raises :class:`InputError` for a wrong unit."""
    text = until.within.strip()
    if text.endswith("%"):
        return QUANTITIES["ratio"].parse(text) * abs(float(value.value))
    return value.quantity.parse(text)


def _periodic(circuit: Circuit, job: Job, design: Design) -> _Ran:
    """The periodic steady state; outcomes over one period of it."""
    from crescentlab.analysis.periodic import periodic

    run = job.run
    given = {"tolerance": run.tolerance, "most": run.most, **_options(run)}
    options = {name: value for name, value in given.items() if value is not None}
    if run.period is not None:
        options["period"] = seconds(run.period, design)
    found = periodic(circuit, dict(job.settings), **options)
    steps = found.result.trajectory.statistics.steps
    if found.converged:
        return _Ran(found.result, Window(found.result), steps=steps)
    said = found.message or f"not periodic yet after {found.periods} periods: they differ by {found.residual:.2g}"
    return _Ran(found.result, Window(found.result), UNSETTLED, said, steps)


def _steady(circuit: Circuit, job: Job, design: Design) -> _Ran:
    """The operating point; every mean is its value."""
    from crescentlab.analysis.steady import steady

    given = job.run.tolerance
    found = steady(circuit, job.settings) if given is None else steady(circuit, job.settings, tolerance=given)
    return _Ran(found.result, Still(found.result, found.snapshot), steps=found.iterations)


_ANALYSES: dict[str, Callable[[Circuit, Job, Design], _Ran]] = {
    "simulate": _simulate, "periodic": _periodic, "steady": _steady,
}  # fmt: skip


def without_limit(job: Job) -> Job:
    """The same point without a time limit."""
    return replace(job, run=job.run.model_copy(update={"time_limit": None}))
