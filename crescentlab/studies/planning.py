"""Study -> :class:`Planned`: the circuit tried, and every name and unit checked before any point runs."""

from __future__ import annotations

import hashlib
import json
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from crescentlab.analysis.outcome import Outcome
from crescentlab.analysis.reach import structure
from crescentlab.circuit import Circuit, load
from crescentlab.elaborate import Design
from crescentlab.errors import InputError, UnitError, nearest
from crescentlab.expressions import Value, is_expression
from crescentlab.studies import provenance
from crescentlab.studies.points import Job, check_window, seconds, settling, within
from crescentlab.studies.sampling import Point, points, varied
from crescentlab.studies.study_file import BOOKKEEPING, Study
from crescentlab.studies.targets import quantity_of_setting
from crescentlab.units import DISPLAY, Quantity

SAME = 12
"""Digits to which two points are compared."""


@dataclass(frozen=True)
class Planned:
    """A study ready to run."""

    study: Study
    circuit: Path
    no_code: bool
    points: list[Point]
    quantities: dict[str, Quantity | None]
    """Of what varies, by name; None for words."""
    measures: dict[str, Quantity]
    """Of the outcomes, by name."""
    source: provenance.Source
    display: dict[str, str]
    """Units of tables and pictures by quantity."""

    @cached_property
    def keys(self) -> list[str]:
        """A hash of each point's settings, in the points' order."""
        return [self.key(point) for point in self.points]

    def key(self, point: Point) -> str:
        """Hash of a point's settings: numbers count to 12 digits, whatever their unit."""
        same = {name: _canonical(text, self.quantities[name]) for name, text in sorted(point.settings.items())}
        return hashlib.sha256(json.dumps(same).encode()).hexdigest()[:16]

    def job(self, point: Point) -> Job:
        """The point as it is sent to a process."""
        sections = self.study.sections
        return Job(
            key=self.key(point), circuit=str(self.circuit.resolve()), no_code=self.no_code,
            source=self.source,
            settings={**sections.settings, **point.settings}, varied=tuple(point.settings),
            run=sections.run, measure=sections.measure,
        )  # fmt: skip

    @cached_property
    def conditions(self) -> dict[str, Any]:
        """What every row rests on besides what varies: rows of other conditions are rows of another study."""
        sections = self.study.sections
        texts = dict.fromkeys([*sections.settings.values(), *(t for p in self.points for t in p.settings.values())])
        run = sections.run.model_dump(mode="json", exclude={"time_limit"}, exclude_none=True)
        return {
            "circuit": self.source.circuit, "library": self.source.library, "versions": self.source.versions,
            "tables": provenance.tables(self.circuit, texts), "set": sections.settings, "run": run,
            "measure": sections.measure,
        }  # fmt: skip

    def number(self, name: str, text: str) -> float | str:
        """A varied setting's text as an SI number, or a word; NaN for an expression."""
        return number_of(text, self.quantities[name])

    def quantity(self, column: str) -> Quantity | None:
        """Quantity of a column; None for words."""
        return self.measures[column] if column in self.measures else self.quantities[column]

    def unit(self, quantity: Quantity) -> str:
        """The unit that tables and pictures show a quantity in."""
        return self.display.get(quantity.name) or next(iter(quantity.units)) or quantity.si


def number_of(text: str, quantity: Quantity | None) -> float | str:
    """A setting's text as an SI number, or a word; NaN for an expression, whose value only the circuit knows."""
    if quantity is None:
        return text
    return math.nan if is_expression(text) else quantity.parse(text)


def _canonical(text: str, quantity: Quantity | None) -> str:
    if quantity is None or is_expression(text):
        return text
    return f"{quantity.parse(text) + 0.0:.{SAME}g}"


def plan_study(study: Study, *, no_code: bool = False) -> Planned:
    """Try the circuit, make the points, check names and units; raises :class:`InputError` at the study's line."""
    path = study.circuit
    circuit = load(path, no_code=no_code)
    named = varied(study)
    base = _tried(study, circuit, study.sections.settings)
    quantities = {name: _quantity(study, base, name, named[name]) for name in named}
    made = points(study, quantities.__getitem__)
    measures = _measures_anywhere(study, circuit, base, made)
    _check_times(study, circuit, base, made)
    _check_plots(study, {**quantities, **measures})
    display = {**DISPLAY, **circuit.netlist.sections.display}
    return Planned(study, path, no_code, made, quantities, measures, provenance.Source.of(path, base), display)


def _tried(study: Study, circuit: Circuit, settings: Mapping[str, str]) -> Design:
    """The circuit with these settings; what is wrong with one of them is told at its line."""
    try:
        design = circuit.design(settings)
        circuit.system(settings)
    except InputError as error:
        raise _placed(study, error) from None
    return design


def _placed(study: Study, error: InputError) -> InputError:
    match = re.match(r"--set ([\w.]+)\b", error.message)
    if error.place is not None or match is None:
        return error
    name = match[1]
    paths = {**{n: ("set", n) for n in study.sections.settings}, **varied(study)}
    known = next((n for n in (name, *sorted(paths, key=len, reverse=True)) if n in paths and name.startswith(n)), None)
    said = error.message.removeprefix("--set ")
    return type(error)(said, study.place(*paths[known]) if known else None)


def _quantity(study: Study, design: Design, name: str, path: tuple[str, ...]) -> Quantity | None:
    try:
        if name in BOOKKEEPING:
            raise InputError(f"every table has a column {name!r} of its own, so this setting cannot vary")
        return quantity_of_setting(design, name)
    except InputError as error:
        raise error.at(study.place(*path)) from None


def _measures_anywhere(study: Study, circuit: Circuit, base: Design, made: list[Point]) -> dict[str, Quantity]:
    """Quantities of the outcomes, in the circuit as it is, or at the first point where they are known.

    A structure that varies brings variables of its own. Whether a point works is no matter of the study: it is a row.
    """
    try:
        return _measures(study, circuit, base, study.sections.settings)
    except InputError as error:
        refused = error
    structures = {structure(base)}
    for point in made:
        settings = {**study.sections.settings, **point.settings}
        try:
            design = circuit.design(settings)
            if structure(design) not in structures:
                structures.add(structure(design))
                return _measures(study, circuit, design, settings)
        except InputError:
            continue
    raise refused


def _measures(study: Study, circuit: Circuit, design: Design, settings: Mapping[str, str]) -> dict[str, Quantity]:
    """Quantities of the outcomes; refuses wrong names, units and functions."""
    system = circuit.system(settings)
    values = system.values(design)
    found: dict[str, Quantity] = {}
    for name, text in study.sections.measure.items():
        place = study.place("measure", name)
        if name in varied(study):
            raise InputError(f"measure: {name!r} is what varies; choose another name", place)
        found[name] = Outcome(name, text, place).quantity(system, values, design)
    until = study.sections.run.until
    if until is not None:
        watched = replace(settling(until), place=study.place("run", "until", "settled"))
        quantity = watched.quantity(system, values, design)
        try:
            within(until, Value(0.0, quantity))
        except UnitError as error:
            raise InputError(f"run.until.within: {error.message}", study.place("run", "until", "within")) from None
    return found


def _check_times(study: Study, circuit: Circuit, design: Design, made: list[Point]) -> None:
    run = study.sections.run
    texts = {("run", name): getattr(run, name) for name in ("stop", "window", "period")}
    texts["run", "until", "every"] = run.until.every if run.until is not None else None  # type: ignore[index]
    for path, text in texts.items():
        if text is None:
            continue
        try:
            seconds(text, design)
        except InputError as error:
            if not _may_be_time(text, design):
                raise type(error)(f"{'.'.join(path)}: {error.message}", study.place(*path)) from None
    _check_window(study, circuit, design, made)


def _check_window(study: Study, circuit: Circuit, design: Design, made: list[Point]) -> None:
    """Refuse a window that is longer than the run, in the circuit as it is and at every point that it accepts."""
    run, own = study.sections.run, circuit.netlist.sections.simulation.stop
    try:
        check_window(run, design, own)
        return
    except InputError as error:
        refused = InputError(f"run.window: {error.message}", study.place("run", "window"))
    for point in made if any(text is not None and is_expression(text) for text in (run.window, run.stop)) else ():
        try:
            check_window(run, circuit.design({**study.sections.settings, **point.settings}), own)
            return
        except InputError:
            continue
    raise refused


def _may_be_time(text: str, design: Design) -> bool:
    """Whether an expression gives a time for other values of the parameters: a point that it fails at is then a row."""
    own = design.parameters[""]
    other = {n: v if isinstance(v.value, str) else replace(v, value=1.0 + k) for k, (n, v) in enumerate(own.items())}
    try:
        return is_expression(text) and seconds(text, replace(design, parameters={"": other})) > 0
    except InputError:
        return False


def _check_plots(study: Study, columns: Mapping[str, Quantity | None]) -> None:
    """Refuse pictures of columns that there are not."""
    for k, plot in enumerate(study.sections.plots):
        for name, where in plot.columns:
            place = study.place("plots", k, *where) or study.place("plots", k)
            if name not in columns:
                raise InputError(f"plots: no column {name!r}: {nearest(name, columns)}", place)
            if columns[name] is None and where != ("curves", "by"):
                raise InputError(f"plots: {name} holds words, which have no axis", place)
        if plot.tornado is not None and not study.sections.vary.one_at_a_time:
            raise InputError("plots: a tornado needs vary: {one_at_a_time: {...}}", study.place("plots", k))
