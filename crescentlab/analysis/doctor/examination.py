"""Examination of a circuit by one run: what is fast, what is slow, what limits the step, what carries the energy.

The run is made with ``rodas``, whose loop counts for each tried step the state with the largest error. Modes come from
the exact Jacobian at instants of the run, the energy from the run's own polynomials, and lines are held against their
exact laws.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from crescentlab import arguments
from crescentlab.analysis.doctor.activity import activities, indices, passed_on
from crescentlab.analysis.doctor.line_errors import LineError, line_errors
from crescentlab.analysis.doctor.run_modes import RunModes, run_modes
from crescentlab.analysis.linear.modes import Mode
from crescentlab.arguments import Number, Settings
from crescentlab.circuit import Circuit, check_circuit
from crescentlab.errors import InputError
from crescentlab.result import Result
from crescentlab.units import QUANTITIES

Array = np.ndarray

SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Where in the run the modes are taken."""
FEW_STATES = 300
"""Circuits of more states are looked at at the end of the run only: eigenvalues take time with the cube of them."""
LINE_ERROR = 0.05
LIMITS = 0.02
"""Least share of the steps for a state to be named."""
MUCH = 0.3
"""Share of the steps from which a state is worth advice."""
STABLE = 2.2
"""Largest |s| h of an explicit method: RK45 is kept there, well inside its region of stability, which ends at 3.3."""
STIFF = 3.0
"""A circuit is called stiff if stability would make an explicit method take this many times as many steps."""
IMPLICIT = ("rodas", "radau", "lsoda")
"""Implicit methods, the first to try first."""
RINGS = 0.1
"""Damping ratio below which a mode rings on."""
ENOUGH = 0.99
"""Share of all activity that a proper model keeps (Louca et al. 1997 take 95 to 99 %)."""
OFTEN = 0.2
"""Restarts per step from which events rule the run."""

time = QUANTITIES["time"]


@dataclass(frozen=True)
class Limit:
    """A state that limited steps: its share, its mode at the end of the run (None: an integrator)."""

    state: str
    share: float
    mode: Mode | None


@dataclass(frozen=True)
class Examination:
    """What was found; see the module."""

    result: Result
    instants: tuple[RunModes, ...]
    limits: tuple[Limit, ...] | None
    """None where the loop does not count them: without a compiler."""
    happened: dict[str, dict[str, int]]
    """Events and ticks by component, and how often."""
    ticking: dict[str, int]
    """Held values of components that tick, which have no modes here."""
    activity: dict[str, float]
    """[J], largest first."""
    passed_on: dict[str, float]
    """[J], at the nets where a component gives the motion."""
    lines: tuple[LineError, ...]

    def __repr__(self) -> str:
        """Of which run."""
        s, title = self.result.trajectory.statistics, self.result.title
        return f"<Examination {title!r}: {self.span:g} s, {s.steps} steps, {len(self.lines)} lines>"

    @property
    def index(self) -> dict[str, float]:
        """Activity index, largest first."""
        return indices(self.activity)

    def without_part(self, name: str) -> bool:
        """Whether hardly any energy stays in a component, and hardly any passes where it gives the motion."""
        every = sum(self.activity.values())
        index = self.index.get(name)
        return index is not None and index < 1 - ENOUGH and self.passed_on.get(name, 0.0) < (1 - ENOUGH) * every

    @property
    def span(self) -> float:
        """Length of the run [s]."""
        t = self.result.trajectory.steps.t
        return float(t[-1] - t[0])

    @property
    def stiffest(self) -> RunModes:
        """The instant with the fastest mode; the start lasts too short to count where there are others."""
        return max(self.instants[1:] or self.instants, key=lambda m: m.fastest)

    @property
    def explicit_steps(self) -> float:
        """Steps that stability alone would ask of an explicit method: each instant stands for the time before it."""
        times = np.array([m.time for m in self.instants])
        speed = np.array([m.fastest for m in self.instants])
        over = np.diff(times) @ speed[1:] if times.size > 1 else speed[0] * self.span
        return float(over / STABLE)

    @property
    def stiff(self) -> bool:
        """Whether stability rather than accuracy would limit an explicit method."""
        return self.explicit_steps > STIFF * max(self.result.trajectory.statistics.steps, 1)

    @property
    def carrying(self) -> list[str]:
        """The fewest components that together have nearly all the activity."""
        found: list[str] = []
        total = 0.0
        for name, share in self.index.items():
            if total >= ENOUGH or share == 0:
                break
            found.append(name)
            total += share
        return found


def examine(
    circuit: Circuit, parameters: Settings | None = None, *, stop: str | float | None = None,
    rtol: float | None = None, period: str | float | None = None, line_error: Number = LINE_ERROR,
    compile: bool | None = None, progress: Callable[[float], None] | None = None,
) -> Examination:  # fmt: skip
    """Run a circuit once and examine it; ``line_error`` is the largest error of a line that is let pass.

    Raises :class:`InputError` for wrong input, :class:`SimulationError` if the run fails.
    """
    check_circuit(circuit, "doctor")
    bound = bound_of(line_error)
    seconds = _period(circuit, parameters, period)
    result = circuit.simulate(stop, parameters, solver="rodas", rtol=rtol, compile=compile, progress=progress)
    system, statistics = result.system, result.trajectory.statistics
    instants = tuple(_instants(result))
    owners = Counter(name.rpartition(".")[0] for name in system.held_names)
    ticking = {
        owner: owners[owner]
        for event in system.events
        if event.kind == "every" and owners[owner := event.name.rpartition(".")[0]]
    }
    return Examination(
        result, instants, _limits(system.state_names, statistics.limited, instants[-1]), _happened(result), ticking,
        activities(result), passed_on(result), tuple(line_errors(result, circuit.library, seconds, bound)),
    )  # fmt: skip


def _period(circuit: Circuit, parameters: Settings | None, given: str | float | None) -> float | None:
    """The circuit's period, if it has one."""
    if given is None and circuit.netlist.sections.simulation.period is None:
        return None
    return circuit.period(circuit.design(parameters), given)


def _instants(result: Result) -> list[RunModes]:
    t, x, h, b = result.trajectory.steps.arrays()
    shares = SHARES if x.shape[1] <= FEW_STATES else SHARES[-1:]
    wanted = t[0] + np.array(shares) * (t[-1] - t[0])
    # the values after an event, where an instant has both
    rows = np.unique(np.clip(np.searchsorted(t, wanted, side="right") - 1, 0, t.size - 1))
    return [run_modes(result.system, result.values, float(t[k]), x[k], h[k], b[k]) for k in rows]


def _limits(names: list[str], limited: Array | None, at_end: RunModes) -> tuple[Limit, ...] | None:
    if limited is None:
        return None
    total = max(int(limited.sum()), 1)
    chosen = [int(k) for k in np.argsort(-limited, kind="stable") if limited[k] >= LIMITS * total and limited[k]]
    return tuple(Limit(names[k], float(limited[k]) / total, at_end.of_state(k)) for k in chosen)


def _happened(result: Result) -> dict[str, dict[str, int]]:
    counts: dict[str, Counter[str]] = {}
    for happening in result.trajectory.happenings:
        for full in happening.names:
            owner, _, name = full.rpartition(".")
            counts.setdefault(owner or full, Counter())[name] += 1
    ordered = sorted(counts.items(), key=lambda item: -item[1].total())
    return {owner: dict(events.most_common()) for owner, events in ordered}


# -- in words ------------------------------------------------------------------------------------


def mode_text(mode: Mode) -> str:
    """``mode at 2.1 kHz, damping 0.03`` or ``mode of time constant 3 us``."""
    if mode.eigenvalue.imag == 0:
        grows = "a growth" if mode.eigenvalue.real > 0 else "a decay"
        return f"{grows} of time constant {time_text(1 / abs(mode.eigenvalue.real))}"
    return f"a mode at {hertz_text(mode.natural_frequency / (2 * np.pi))}, damping {mode.damping_ratio:.2g}"


def hertz_text(hertz: float) -> str:
    """A frequency in the unit that fits its size."""
    return f"{hertz / 1e3:.3g} kHz" if hertz >= 1e3 else f"{hertz:.3g} Hz"


def time_text(seconds: float) -> str:
    """A time in the unit that fits its size."""
    unit = next((u for u in ("s", "ms", "us") if abs(seconds) >= time.units[u]), "ns" if seconds else "s")
    return time.show(seconds, unit, 3)


def advice(found: Examination) -> list[str]:
    """What the findings suggest, one sentence each."""
    return [*_on_limits(found), *_on_stiffness(found), *_on_events(found), *_on_energy(found), *_on_lines(found)]


def _on_limits(found: Examination) -> list[str]:
    said: list[str] = []
    for limit in found.limits or ():
        owner = limit.state.rpartition(".")[0]
        text = f"{limit.state} limited {100 * limit.share:.0f} % of the steps"
        text += f"; its part in the circuit is {mode_text(limit.mode)}" if limit.mode else "; it only adds up"
        if limit.share < MUCH and not (limit.mode and 0 < limit.mode.damping_ratio < RINGS):
            continue
        if limit.mode and 0 < limit.mode.damping_ratio < RINGS:
            text += ", which rings on: friction or leakage that the model leaves out would let the steps grow"
        if found.without_part(owner):
            share = 100 * found.index[owner]
            text += f"; {owner} has {share:.2g} % of the activity: does the run need it in this detail?"
        said.append(text)
    return said


def _on_stiffness(found: Examination) -> list[str]:
    steps = found.result.trajectory.statistics.steps
    if not found.stiffest.fastest:
        return []
    fastest = found.stiffest.mode(int(found.stiffest.limiting[0]))
    who = next(iter(fastest.parts))
    used = found.result.trajectory.solver.split()[0].rstrip(":")
    own = {used, found.result.design.netlist.sections.simulation.solver}
    asked = f"{who} ({mode_text(fastest)})"
    if found.stiff:
        others = " or ".join([name for name in IMPLICIT if name not in own][:2])
        return [
            f"the circuit is stiff: {asked} would make an explicit method take about {found.explicit_steps:.0f} steps "
            f"where {used} took {steps}; implicit methods suit it, --solver {others} as well"
        ]
    return [
        f"the circuit is not stiff: its fastest mode, {asked}, asks for about {found.explicit_steps:.0f} steps of an "
        f"explicit method, {used} took {steps}" + ("; --solver dopri may be faster" if "dopri" not in own else "")
    ]


def _on_events(found: Examination) -> list[str]:
    statistics = found.result.trajectory.statistics
    if statistics.restarts < OFTEN * max(statistics.steps, 1) or not found.happened:
        return []
    owner, events = next(iter(found.happened.items()))
    name, count = next(iter(events.items()))
    return [
        f"events rule the run: {statistics.restarts} restarts in {statistics.steps} steps; "
        f"{owner}.{name} happens most, {count} times"
    ]


def _on_energy(found: Examination) -> list[str]:
    carrying, every = found.carrying, found.activity
    if not carrying or len(carrying) == len(every):
        return []
    return [
        f"{len(carrying)} of {len(every)} components have {100 * ENOUGH:.0f} % of the activity; "
        "the others are the first to simplify or leave out, where they do not switch or measure"
    ]


def _on_lines(found: Examination) -> list[str]:
    return [
        f"{line.name} ({line.type}) is {100 * line.worst[0]:.3g} % wrong at {hertz_text(line.worst[1])}, where "
        f"{100 * line.bound:.3g} % is allowed: {line.note}"
        for line in found.lines
        if not line.within
    ]


def report(found: Examination) -> dict[str, Any]:
    """Plain data for ``--json``, SI."""
    statistics = found.result.trajectory.statistics
    return {
        "status": "done", "title": found.result.title, "solver": found.result.trajectory.solver,
        "steps": statistics.steps, "rejected": statistics.rejected, "restarts": statistics.restarts,
        "events": statistics.events, "ticks": statistics.ticks, "span": found.span,
        "stiff": found.stiff, "explicit_steps": found.explicit_steps,
        "instants": [
            {"time": m.time, "stiffness": m.stiffness, "modes": [_mode(m.mode(int(k))) for k in m.by_speed]}
            for m in found.instants
        ],
        "limits": None if found.limits is None else [
            {"state": each.state, "share": each.share, "mode": _mode(each.mode) if each.mode else None}
            for each in found.limits
        ],
        "happened": found.happened, "ticking": found.ticking,
        "activity": found.activity, "activity_index": found.index, "carrying": found.carrying,
        "lines": [
            {"name": line.name, "type": line.type, "frequencies": line.frequencies.tolist(),
             "errors": line.errors.tolist(), "bound": line.bound, "within": line.within, "note": line.note or None,
             "parts": line.parts, "left_out": list(line.left_out)}
            for line in found.lines
        ],
        "advice": advice(found), "warnings": list(found.result.trajectory.warnings), "error": None,
    }  # fmt: skip


def _mode(mode: Mode) -> dict[str, Any]:
    shares = {name: share for name, share in mode.parts.items() if share >= LIMITS}
    return {
        "real": mode.eigenvalue.real, "imaginary": mode.eigenvalue.imag,
        "frequency": abs(mode.eigenvalue) / (2 * np.pi), "damping": mode.damping_ratio, "states": shares,
    }  # fmt: skip


def bound_of(text: Number) -> float:
    """The bound of ``--line-error``: a ratio between 0 and 2."""
    bound = arguments.quantity(text, "--line-error", QUANTITIES["ratio"])
    if not 0 < bound <= 2:
        raise InputError(f"--line-error {text}: an error lies between 0 and 200 %; write for example '5 %'")
    return bound
