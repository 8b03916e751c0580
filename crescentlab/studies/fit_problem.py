"""Fit file, data and circuit -> :class:`Problem`: every name, unit and bound checked before any run."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from crescentlab.analysis.outcome import Outcome
from crescentlab.circuit import Circuit, load
from crescentlab.data_files import Table, read_table
from crescentlab.errors import InputError, Place, UnitError, nearest
from crescentlab.studies.fit_file import FitFile, ParameterSection, read_fit_file
from crescentlab.studies.fit_scales import Data, Scale
from crescentlab.studies.fitting import too_few
from crescentlab.studies.points import check_window, seconds
from crescentlab.studies.targets import quantity_of_setting
from crescentlab.system import System
from crescentlab.units import QUANTITIES, Quantity, normalise
from crescentlab.yaml_text import Node

TIME = "time"
"""The column whose presence makes the data series over time."""
_LEADING_NUMBER = re.compile(r"\s*[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?\s*")


@dataclass(frozen=True)
class Parameter:
    """A parameter to be found: bounds and start [SI], and the unit it was written in."""

    name: str
    quantity: Quantity
    unit: str
    start: float
    low: float
    high: float

    def text(self, value: float) -> str:
        """A value as ``--set`` takes it, exact to the last digit."""
        scaled = (value - self.quantity.offsets.get(normalise(self.unit), 0.0)) / self.quantity.factor(self.unit)
        return f"{scaled!r} {self.unit}".strip()


@dataclass(frozen=True)
class Measured:
    """A measured column: what it is compared with, its quantity, and the unit of its column."""

    name: str
    outcome: Outcome
    quantity: Quantity
    unit: str


@dataclass(frozen=True)
class Point:
    """One run: its settings as for ``--set``, and the rows of the data it answers."""

    settings: dict[str, str]
    rows: tuple[int, ...]


@dataclass(frozen=True)
class Problem:
    """A fit ready to run."""

    file: FitFile
    name: str
    circuit: Circuit
    table: Table
    parameters: tuple[Parameter, ...]
    measured: tuple[Measured, ...]
    points: tuple[Point, ...]
    times: np.ndarray | None
    """Times of the rows [s] if the data are series over time, shape (rows,)."""
    data: Data
    where: np.ndarray
    """Row and number of the measured column of each value, shape (m, 2)."""
    starts: int

    @property
    def scale(self) -> Scale:
        """The bounds."""
        return Scale(np.array([p.low for p in self.parameters]), np.array([p.high for p in self.parameters]))

    @property
    def start(self) -> np.ndarray:
        """Where the first search begins."""
        return np.array([p.start for p in self.parameters])

    @property
    def title(self) -> str:
        """The fit's title."""
        return self.file.title or self.name


def read_problem(
    path: Path, settings: Mapping[str, str] | None = None, *, starts: int | None = None, no_code: bool = False
) -> Problem:
    """Read a fit file, its data and its circuit; ``settings`` replace those of ``set:``, ``starts`` the file's.

    Raises :class:`InputError` with file and line for whatever cannot be used.
    """
    file, node = read_fit_file(path)
    return _Reading(file, node, path, dict(settings or {}), no_code).problem(starts or file.starts)


class _Reading:
    """Makes a problem of the sections, one after another."""

    def __init__(self, file: FitFile, node: Node, path: Path, settings: dict[str, str], no_code: bool) -> None:
        self.file, self.node, self.path = file, node, path
        self.set = {**file.set, **settings}
        self.circuit = self.load(no_code)
        self.table = read_table(
            path.parent / file.data, str(path.parent / file.data), node.place_of("data"), beside="fit"
        )

    def load(self, no_code: bool) -> Circuit:
        beside = self.path.parent / self.file.circuit
        try:
            return load(beside if beside.is_file() else self.file.circuit, no_code=no_code)
        except InputError as error:
            raise error.at(self.node.place_of("circuit")) from None

    def problem(self, starts: int) -> Problem:
        self.check_names()
        parameters = tuple(self.parameter(name, section) for name, section in self.file.parameters.items())
        points = self.points()
        start = {**points[0].settings, **{p.name: p.text(p.start) for p in parameters}}
        self.check_settings(parameters, points)
        measured = tuple(self.measured(column, text, start) for column, text in self.file.measured.items())
        self.check_run(start)
        data, where = self.data(measured)
        if data.measured.size < len(parameters):
            raise InputError(f"{self.table.path}: {too_few(data.measured.size, len(parameters))}")
        times = self.times()
        return Problem(
            self.file, self.path.stem, self.circuit, self.table, parameters, measured, points, times, data, where,
            starts,
        )  # fmt: skip

    def check_names(self) -> None:
        """Every column named exists and serves one purpose; every parameter is found or set, not both."""
        columns = [*self.file.settings, *self.file.measured]
        for section in ("settings", "measured"):
            for column in getattr(self.file, section):
                self.table.column(column, self.node.place_of(section, column))
        for column in self.file.settings:
            if column in self.file.measured:
                place = self.node.place_of("measured", column)
                raise InputError(f"the column {column!r} sets something and is measured; choose one", place)
        for column in self.file.uncertainty:
            if column not in self.file.measured:
                said = f"uncertainty: {column!r} is no measured column: {nearest(column, self.file.measured)}"
                raise InputError(said, self.node.place_of("uncertainty", column))
        taken = {name: "set:" if name in self.file.set else "--set" for name in self.set}
        taken.update(dict.fromkeys(self.file.settings.values(), "settings:"))
        for name in self.file.parameters:
            if name in taken:
                said = f"{name} is set by {taken[name]} and cannot be found as well; remove one of them"
                raise InputError(said, self.node.place_of("parameters", name))
        if TIME in columns:
            said = f"the column {TIME!r} tells when the others were measured; take it out of settings: and measured:"
            section = "settings" if TIME in self.file.settings else "measured"
            raise InputError(said, self.node.place_of(section, TIME))

    def parameter(self, name: str, section: ParameterSection) -> Parameter:
        """The parameter's numbers; they must be in order and of the quantity that the circuit says."""
        place = self.node.place_of("parameters", name)
        try:
            quantity = quantity_of_setting(self.circuit.design(self.set), name)
        except InputError as error:
            raise InputError(f"parameters: {error.message}", error.place or place) from None
        if quantity is None:
            raise InputError(f"parameters.{name} is a word or a choice; only numbers can be found", place)
        try:
            start, low, high = (quantity.parse(text) for text in (section.start, section.low, section.high))
        except UnitError as error:
            raise InputError(f"parameters.{name}: {error.message}", place) from None
        if not low < high:
            raise InputError(f"parameters.{name}: low ({section.low}) must lie below high ({section.high})", place)
        if not low <= start <= high:
            said = f"parameters.{name}: start ({section.start}) lies outside {section.low} to {section.high}"
            raise InputError(said, place)
        return Parameter(name, quantity, _LEADING_NUMBER.sub("", section.start, count=1).strip(), start, low, high)

    def points(self) -> tuple[Point, ...]:
        """Rows of equal settings are one run."""
        found: dict[tuple[str, ...], list[int]] = {}
        columns = [self.table.columns[column] for column in self.file.settings]
        for row in range(self.table.rows):
            for column in columns:
                if not column.cells[row]:
                    raise InputError(f"the cell of {column.name!r} is empty; it sets something", self.table.places[row])
            found.setdefault(tuple(column.text(row) for column in columns), []).append(row)
        names = list(self.file.settings.values())
        return tuple(
            Point({**self.set, **dict(zip(names, texts, strict=True))}, tuple(rows)) for texts, rows in found.items()
        )

    def check_settings(self, parameters: tuple[Parameter, ...], points: tuple[Point, ...]) -> None:
        """Every row's settings, and both bounds of every parameter, are accepted by the circuit."""
        starts = {p.name: p.text(p.start) for p in parameters}
        for point in points:
            self.accepted({**point.settings, **starts}, parameters, point)
        first = {**points[0].settings, **starts}
        system = self.circuit.system(first)
        for p in parameters:
            for value in (p.low, p.high):
                moved = {**first, p.name: p.text(value)}
                self.accepted(moved, parameters, points[0])
                if self.circuit.system(moved) is not system:
                    said = f"{p.name} changes the structure of the circuit (a size or a choice) between its bounds"
                    raise InputError(
                        f"{said}; only continuous values can be found", self.node.place_of("parameters", p.name)
                    )

    def accepted(self, settings: dict[str, str], parameters: tuple[Parameter, ...], point: Point) -> None:
        try:
            self.circuit.design(settings)
        except InputError as error:
            self.check_titles(point)
            place = self.blamed(error, parameters, point)
            raise InputError(error.message.removeprefix("--set ") if place else error.message, place) from None

    def check_titles(self, point: Point) -> None:
        """Refuse titles of setting columns without a unit, or with one of another quantity: every row has it."""
        design = self.circuit.design(self.set)
        for column, name in self.file.settings.items():
            title, cell = self.table.columns[column], self.table.columns[column].cells[point.rows[0]]
            try:
                quantity = quantity_of_setting(design, name)
            except InputError:
                continue  # told as a name that there is not
            if quantity is None or not _LEADING_NUMBER.fullmatch(cell) or normalise(title.unit) in quantity.units:
                continue
            if not title.unit:
                raise self.no_unit(column, name, quantity)
            try:
                quantity.factor(title.unit)
            except UnitError as error:
                said = f"column {column!r}, which sets {name}: {error.message}"
                raise InputError(said, self.table.top) from None

    def no_unit(self, column: str, of: str, quantity: Quantity) -> InputError:
        """What is said of a title that lacks its unit."""
        unit = quantity.example().partition(" ")[2]
        said = f"column {column!r} needs its unit in the title, because {of} is {quantity.titled}"
        return InputError(f"{said}; write for example {column} [{unit}]", self.table.top)

    def blamed(self, error: InputError, parameters: tuple[Parameter, ...], point: Point) -> Place | None:
        """Where the name stands that a message about ``--set NAME`` speaks of."""

        def speaks_of(name: str) -> bool:
            return error.message.startswith((f"--set {name}:", f"--set {name} ")) or error.message.startswith(
                f"--set {name}."
            )

        for p in parameters:
            if speaks_of(p.name):
                return self.node.place_of("parameters", p.name)
        for column, name in self.file.settings.items():
            if speaks_of(name):
                unknown = "nothing has this name" in error.message
                return self.node.place_of("settings", column) if unknown else self.table.places[point.rows[0]]
        for name in self.file.set:
            if speaks_of(name):
                return self.node.place_of("set", name)
        return error.place

    def measured(self, column: str, text: str, settings: dict[str, str]) -> Measured:
        """What the column is compared with; raises if it is of another quantity."""
        place = self.node.place_of("measured", column)
        design = self.circuit.design(settings)
        system = self.circuit.system(settings)
        outcome = Outcome(column, text, place)
        if TIME in self.table.columns:
            quantity = self.variable(column, text, system, place)
        else:
            quantity = outcome.quantity(system, system.values(design), design)
        unit = self.table.columns[column].unit
        if normalise(unit) not in quantity.units:
            owners = [q for q in QUANTITIES.values() if normalise(unit) in q.units and q.dims == quantity.dims]
            if not unit:
                raise self.no_unit(column, text, quantity)
            if not owners:
                said = f"the column {column!r} is in {unit}, but {text} is {quantity.titled}"
                raise InputError(f"{said} [{quantity.si}]", place)
            quantity = owners[0]
        return Measured(column, outcome, quantity, unit)

    def variable(self, column: str, text: str, system: System, place: Place | None) -> Quantity:
        """The quantity of a variable, or of an element of one, that a series is compared with."""
        base, bracket, index = text.partition("[")
        try:
            variable = system.find(base)
        except InputError as error:
            said = f"{column}: {error.message}; with a column {TIME!r}, variables are compared, not outcomes"
            raise InputError(said, place) from None
        size = len(variable.expression()) if variable.vector else 0
        if bool(bracket) != bool(size) or (bracket and index not in [f"{k + 1}]" for k in range(size)]):
            elements = f"a vector of {size}; write one element, for example {base}[1]" if size else "a single value"
            raise InputError(f"{column}: {text}: {base} is {elements}", place)
        return variable.quantity

    def check_run(self, settings: dict[str, str]) -> None:
        """The times of the run are times; series come from a simulation that ends with the data."""
        run = self.file.run
        design = self.circuit.design(settings)
        for name in ("stop", "window", "period"):
            text = getattr(run, name)
            if text is not None:
                try:
                    seconds(text, design)
                except InputError as error:
                    raise InputError(f"run.{name}: {error.message}", self.node.place_of("run", name)) from None
        if TIME not in self.table.columns:
            try:
                check_window(run, design, self.circuit.netlist.sections.simulation.stop)
            except InputError as error:
                raise InputError(f"run.window: {error.message}", self.node.place_of("run", "window")) from None
        if run.time_limit is not None:
            said = "run.time_limit belongs to studies, whose points run in processes of their own; remove it"
            raise InputError(said, self.node.place_of("run", "time_limit"))
        if TIME not in self.table.columns:
            return
        if run.analysis != "simulate":
            said = f"data with a column {TIME!r} are compared with a simulation, not with analysis: {run.analysis}"
            raise InputError(said, self.node.place_of("run", "analysis"))
        for name in ("stop", "window", "until"):
            if getattr(run, name) is not None:
                said = f"run.{name}: with a column {TIME!r} the run ends with the last time of the data; remove it"
                raise InputError(said, self.node.place_of("run", name))

    def times(self) -> np.ndarray | None:
        """Times of the rows [s]; None without a column of times."""
        if TIME not in self.table.columns:
            return None
        times = self.table.numbers(TIME, QUANTITIES["time"])
        for t, place in zip(times, self.table.places, strict=True):
            if not t >= 0:
                raise InputError("the time must be a number from 0 on", place)
        return times

    def data(self, measured: tuple[Measured, ...]) -> tuple[Data, np.ndarray]:
        """The measured values, column by column, empty cells left out."""
        values, share, absolute, where = [], [], [], []
        for k, each in enumerate(measured):
            column = self.table.numbers(each.name, each.quantity)
            of_share, of_absolute = self.uncertainty(each)
            for row in np.flatnonzero(np.isfinite(column)):
                values.append(column[row])
                share.append(of_share)
                absolute.append(of_absolute[row])
                where.append((int(row), k))
                if np.isnan(of_share) and of_absolute[row] <= 0:
                    raise InputError(f"{each.name} sd must be above 0", self.table.places[row])
        places = np.array(where, dtype=int).reshape(-1, 2)
        names = tuple(each.name for each in measured)
        return Data(np.array(values), places[:, 1], names, np.array(share), np.array(absolute)), places

    def uncertainty(self, each: Measured) -> tuple[float, np.ndarray]:
        """A column's standard deviation as a share (else NaN), and row by row in SI (else NaN)."""
        rows = self.table.rows
        deviation = f"{each.name} sd"
        text = self.file.uncertainty.get(each.name)
        place = self.node.place_of("uncertainty", each.name)
        if deviation in self.table.columns:
            if text is not None:
                said = f"the data have a column {deviation!r} and uncertainty: gives {each.name} too; keep one"
                raise InputError(said, place)
            found = self.table.numbers(deviation, each.quantity, difference=True)
            values = self.table.numbers(each.name, each.quantity)
            for sd, value, at in zip(found, values, self.table.places, strict=True):
                if np.isnan(sd) and not np.isnan(value):
                    raise InputError(f"the cell of {deviation!r} is empty", at)
            return np.nan, found
        if text is None:
            return np.nan, np.full(rows, np.nan)
        try:
            if text.strip().endswith("%"):
                value, share = QUANTITIES["ratio"].parse(text), True
            else:
                zero = each.quantity.offsets.get(normalise(_LEADING_NUMBER.sub("", text, count=1)), 0.0)
                value, share = each.quantity.parse(text) - zero, False
        except UnitError as error:
            raise InputError(f"uncertainty.{each.name}: {error.message}; or a share such as 5 %", place) from None
        if not value > 0:
            raise InputError(f"uncertainty.{each.name}: {text} must be above 0", place)
        return (value, np.full(rows, np.nan)) if share else (np.nan, np.full(rows, value))
