"""Circuit: the public door. Load a file, simulate it, look at its causality.

The arrows of the design in one place: text -> netlist -> design -> graph -> plan -> system ->
trajectory -> result. A change of parameter values reuses the assembled system.
"""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any, get_args

from crescentlab import arguments, cold_start
from crescentlab.arguments import Settings
from crescentlab.assembly import assemble
from crescentlab.causality import Plan, plan
from crescentlab.coarse_lines import ringing, too_coarse
from crescentlab.component import field_quantity
from crescentlab.elaborate import Design, elaborate
from crescentlab.errors import ExpressionError, InputError, SimulationError, nearest
from crescentlab.expressions import Value, evaluate, is_expression, number_of
from crescentlab.fluid import Fluid
from crescentlab.graph import build
from crescentlab.library import Library, installed
from crescentlab.netlist import SMALLEST_RTOL, Netlist, SimulationSection
from crescentlab.plotting import check_plots
from crescentlab.pressures import CAVITATES
from crescentlab.recorded import Recorded, read
from crescentlab.result import Result
from crescentlab.solvers.options import Options
from crescentlab.solvers.ranges import beyond_ranges
from crescentlab.solvers.snapshot import Snapshot
from crescentlab.system import System
from crescentlab.trace import structure_of
from crescentlab.units import QUANTITIES
from crescentlab.verification import TIGHTER, verification

Start = Result | Snapshot | str | Path
"""What a run can go on from: another run, where it stood, or its file."""
SOLVERS: tuple[str, ...] = get_args(SimulationSection.model_fields["solver"].annotation)
"""Names of ``--solver`` and ``solver:``."""
STEADY = "steady"
"""The start that is an operating point."""
OPERATING_POINT = "crescentlab.analysis.steady"
"""Home of the search for it. It works on circuits, so that it stands above this module and is called by its name."""
DESIGNS = 32
"""Designs kept: an analysis asks for the same one several times."""
MAX_ROWS = 10_000_000
"""Most rows of a uniform output grid."""


def shipped() -> dict[str, Path]:
    """Circuits that come with crescentlab, by name (parts left out)."""
    folder = Path(str(resources.files("crescentlab.circuits")))
    return {p.stem: p for p in sorted(folder.glob("*.yaml")) if not p.stem.endswith("_part")}


def find(name: str | Path) -> Path:
    """The file of a path or of a shipped circuit's name; raises :class:`InputError` offering the nearest."""
    path = arguments.path(name, "circuit")
    if path.is_file():
        return path
    known = shipped()
    if str(name) in known:
        return known[str(name)]
    if path.is_dir():
        raise InputError(f"{name}: this is a folder; name a circuit file in it, or one of: {', '.join(known)}")
    if path.suffix or len(path.parts) > 1:
        raise InputError(f"{name}: no such file; a circuit is a .yaml file, or one of: {', '.join(known)}")
    raise InputError(f"{name}: no circuit of this name: {nearest(str(name), known)}")


def load(name: str | Path, *, no_code: bool = False) -> Circuit:
    """Read a circuit file, or a shipped circuit by name."""
    return Circuit(Netlist.read(find(name)), no_code=no_code)


class Circuit:
    """A circuit ready to be checked and simulated. Its files are read once: load it again to see them changed."""

    def __init__(self, netlist: Netlist, *, library: Library | None = None, no_code: bool = False) -> None:
        arguments.instance(netlist, Netlist, "Circuit", "write crescentlab.load('relief_valve'), with your file's name")
        self.netlist = netlist
        self._library = library
        self.no_code = no_code
        self._systems: dict[Any, System] = {}
        self._designs: dict[tuple[tuple[str, type, Any], ...], Design] = {}
        self.assembly_s = 0.0

    def __repr__(self) -> str:
        """Title, size, and how long it runs."""
        sections = self.netlist.sections
        title = sections.title if len(sections.title) <= 60 else f"{sections.title[:57]}..."
        parts, more = list(sections.components), ", ..." if len(sections.components) > 8 else ""
        return (
            f"<Circuit {self.netlist.name!r} ({title}): {len(parts)} components: {', '.join(parts[:8])}{more}; "
            f"{len(sections.nets)} nets, {len(sections.parameters)} parameters, stop {sections.simulation.stop:g} s>"
        )

    @property
    def library(self) -> Library:
        """Installed components, found when first needed."""
        if self._library is None:
            self._library = installed()
        return self._library

    def design(self, parameters: Settings | None = None) -> Design:
        """The flat circuit with numbers; ``parameters`` by the names of ``--set``. The latest few are kept."""
        given = arguments.settings(parameters)
        key = tuple((name, type(value), value) for name, value in given.items())
        found = self._designs.get(key)
        if found is None:
            found = elaborate(self.netlist, self.library, given, no_code=self.no_code)
            for old in list(self._designs)[: 1 - DESIGNS]:
                self._designs.pop(old, None)  # threads may share a circuit
            self._designs[key] = found
        return found

    def plan(self, parameters: Settings | None = None, *, allow_open: bool = False) -> Plan:
        """Its causality; raises an explained conflict. With ``allow_open`` a part's ports may be left open."""
        design = self.design(parameters)
        if allow_open and not design.fluids:
            design = replace(design, fluids=stand_in_fluids(design, self.library))
        return plan(build(design), self.library, allow_open=allow_open)

    def system(self, parameters: Settings | None = None) -> System:
        """The assembled ODE, its start values tried."""
        design = self.design(parameters)
        system = self.assembled(design)
        system.values(design)
        return system

    def assembled(self, design: Design) -> System:
        """The system of a design, made once for each structure."""
        key = tuple((n, structure_of(i.component)) for n, i in design.instances.items())
        key += tuple(structure_of(f) for f in design.fluids.values())
        if key not in self._systems:
            begun = time.perf_counter()
            self._systems[key] = assemble(plan(build(design), self.library))
            check_plots(self.netlist, self._systems[key])
            self.assembly_s = time.perf_counter() - begun
        return self._systems[key]

    def period(self, design: Design, given: str | float | None = None) -> float:
        """Time [s] after which the circuit repeats itself: ``given``, or ``simulation: {period: ...}``.

        Raises :class:`InputError` if neither says it.
        """
        if given is not None:
            return arguments.seconds(given, "period")
        text, place = self.netlist.sections.simulation.period, self.netlist.place("simulation", "period")
        if text is None:
            raise InputError(
                f"{self.netlist.name}: after what time it repeats itself is not known; write --period '30 ms', "
                "or in the circuit simulation: {period: 30 ms}"
            )
        if not is_expression(text):
            try:
                return arguments.seconds(text, "period")
            except InputError as error:
                raise error.at(place) from None
        known = design.parameters[""]

        def find(name: str) -> Value:
            if name not in known:
                raise ExpressionError(f"no parameter {name!r}: {nearest(name, known)}")
            return known[name]

        try:
            seconds = number_of(evaluate(text, find), QUANTITIES["time"])
            return arguments.seconds(seconds, "period")
        except InputError as error:
            raise InputError(f"period: {error.message.removeprefix('period: ')}", place) from None

    def simulate(
        self, stop: str | float | None = None, parameters: Settings | None = None, *,
        solver: str | None = None, rtol: float | None = None, output_step: str | float | None = None,
        max_step: str | float | None = None, compile: bool | None = None, start: Start | None = None,
        progress: Callable[[float], None] | None = None, check: bool = True, verify: bool = False,
    ) -> Result:  # fmt: skip
        """Integrate the circuit; text needs units, floats are SI. ``compile`` as for ``--compile``.

        With ``start``, a result or its file, the run goes on from its end, to the time ``stop``; with
        ``start="steady"`` it begins at the operating point, as with ``simulation: {start: steady}``. With ``verify`` it
        is run again at a tenth of its tolerance, with steps at most half as long as the first run's longest may be, and
        ``result.verification`` tells how far the two are apart; where they do not agree, a warning says so.

        Raises :class:`InputError` for wrong input, and, with ``check``, :class:`SimulationError` if the run
        fails, its ``result`` attribute holding what was computed.
        """
        design = self.design(parameters)
        system = self.assembled(design)
        section = self.netlist.sections.simulation
        options = Options(
            stop=_time(stop, "stop", section.stop),
            rtol=section.rtol if rtol is None else arguments.number(rtol, "rtol", "1e-6"),
            solver=solver or section.solver, max_step=_time(max_step, "max_step", section.max_step),
            output_step=_time(output_step, "output_step", section.output_step),
            compile=section.compile if compile is None else compile,
        )  # fmt: skip
        check_options(options)
        values = system.values(design)
        start = section.start if start is None else start
        warnings: list[str] = []
        begin: Snapshot | None
        if isinstance(start, str) and start == STEADY:
            begin, warnings = self._at_rest(parameters)
        else:
            begin = None if start is None else snapshot_of(start, system)
        if begin is not None and not options.stop > begin.t:
            raise InputError(f"stop: the start is at {begin.t:g} s already; write an end time beyond it")
        from crescentlab.solvers.integrate import integrate  # a third of a second of SciPy that `check` does without

        trajectory = integrate(system, values, options, progress, begin)
        trajectory.warnings[:0] = warnings
        trajectory.warnings += beyond_ranges(system, values.p, trajectory.steps)
        trajectory.warnings += too_coarse(system, values.p, trajectory)
        if trajectory.status == "failed" and (instead := ringing(system, values.p, trajectory)):
            trajectory.error = trajectory.error.replace(CAVITATES, instead)
        result = Result(system, values if begin is None else begin.values(values), design, trajectory)
        if trajectory.status == "failed" and begin is None:
            trajectory.error += cold_start.advice(result, options.span)
        if verify:
            tighter = max(TIGHTER * options.rtol, SMALLEST_RTOL)
            half = replace(options, rtol=tighter, max_step=options.step_cap / 2)  # else capped steps would be the same
            again = integrate(system, values, half, progress, begin)
            other = Result(system, result.values, design, again)
            result.verification = verification(result, other, options.rtol, tighter)
        if check and trajectory.status == "failed":
            failure = SimulationError(trajectory.error)
            failure.result = result  # type: ignore[attr-defined]
            raise failure
        if check and trajectory.status == "interrupted":
            raise KeyboardInterrupt(trajectory.error)
        return result

    def _at_rest(self, parameters: Settings | None) -> tuple[Snapshot, list[str]]:
        """The operating point at the time 0, and what is to be said of it."""
        steady = importlib.import_module(OPERATING_POINT).steady
        place = self.netlist.place("simulation", "start")
        try:
            point = steady(self, parameters, at=0.0)
        except InputError as error:
            raise error.at(place) from None
        except SimulationError as error:
            raise SimulationError(f"start: steady: {error}") from None
        return point.snapshot, [f"start: {said}" for said in point.warnings]


def check_circuit(circuit: Any, name: str) -> None:
    """Refuse what is no circuit; raises :class:`InputError`."""
    arguments.instance(circuit, Circuit, name, "write crescentlab.load('relief_valve') first, with your file's name")


def snapshot_of(start: Start, system: System) -> Snapshot:
    """Where a result, or the run that a file holds, ended; raises :class:`InputError` if it cannot be gone on from."""
    if isinstance(start, Snapshot):
        return start
    result = start if isinstance(start, Result) else read(arguments.path(start, "start"))
    source = str(result.path) if isinstance(result, Recorded) else "start"
    if result.end is not None:
        return Snapshot.of_text(result.end, system, source)
    if not isinstance(result, Recorded):
        raise InputError("start: this run failed, so there is no end to go on from")
    kind = "a .csv file does not say" if result.path.suffix == ".csv" else "it does not say"
    raise InputError(
        f"{source}: {kind} where its run ended; start from a .nc or .parquet file of a run that ended well"
    )


def stand_in_fluids(design: Design, library: Library) -> dict[str, Fluid]:
    """A fluid for a part alone: its causality does not depend on the fluid's numbers, only on there being one.

    The first fluid of the library whose required fields accept their quantity's usual size.
    """
    names = {net.fluid for net in design.nets if net.fluid} or {"fluid"}
    for cls in library.fluids.values():
        needed = {f.alias or n: field_quantity(f) for n, f in cls.model_fields.items() if f.is_required()}
        try:
            made = cls.model_validate({n: q.nominal for n, q in needed.items() if q is not None})
        except ValueError:
            continue
        return dict.fromkeys(sorted(names), made)
    return {}


def check_options(options: Options) -> None:
    """Refuse what argparse or a caller cannot know to be wrong."""
    if not SMALLEST_RTOL <= options.rtol < 1:
        raise InputError(
            f"rtol {options.rtol:g}: the relative tolerance lies between 0 and 1, from 1e-13 on; write for example 1e-6"
        )
    arguments.choice(options.solver, "solver", SOLVERS)
    if options.output_step is not None and options.stop / options.output_step > MAX_ROWS:
        raise InputError(f"output_step {options.output_step:g} s makes more than {MAX_ROWS} rows; write a longer one")
    if options.output_step is not None and options.output_step > options.span:
        raise InputError(f"output_step {options.output_step:g} s is longer than the run, {options.span:g} s")


def _time(value: Any, name: str, default: Any) -> Any:
    return default if value is None else arguments.seconds(value, name)
