"""YAML text -> :class:`Study`: the sections of a study file, checked for shape, with their places."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from crescentlab.circuit import SOLVERS, find
from crescentlab.errors import InputError, Place, UnitError, nearest
from crescentlab.explain import validated
from crescentlab.expressions import is_expression
from crescentlab.netlist import SMALLEST_RTOL, Name
from crescentlab.units import QUANTITIES, Time
from crescentlab.yaml_text import Node, read

KINDS = ("grid", "list", "latin_hypercube", "sobol", "monte_carlo", "corners", "one_at_a_time")
"""Ways of varying, each a section of ``vary:``; together they make the product of their points."""
SAMPLES = ("latin_hypercube", "sobol", "monte_carlo")
BOOKKEEPING = (
    "point", "key", "role", "status", "reason", "warnings", "settings", "wall_s", "final_time", "steps",
)  # fmt: skip
"""Columns that every table of a study has; nothing else may be called so."""


def _time_text(text: str) -> str:
    """A time with its unit, or an expression of circuit parameters, which only the circuit can check."""
    if is_expression(text):
        return text
    try:
        seconds = QUANTITIES["time"].parse(text)
    except UnitError as error:
        raise ValueError(error.message) from None
    if not seconds > 0:
        raise ValueError(f"{text} must be above 0")
    return text


def _solver(name: str) -> str:
    if name not in SOLVERS:
        raise ValueError(nearest(name, SOLVERS))
    return name


def _one_or_many(value: Any) -> Any:
    return [value] if isinstance(value, str) else value


TimeText = Annotated[str, AfterValidator(_time_text)]
Names = Annotated[list[str], BeforeValidator(_one_or_many)]


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class SampleSection(_Section):
    """Points drawn from distributions."""

    count: int = Field(ge=1, description="how many points")
    seed: int = Field(default=1, ge=0, description="the same seed gives the same points")
    parameters: dict[str, Any] = Field(min_length=1, description="name: distribution")


class VarySection(_Section):
    """What varies; the sections together make the product of their points."""

    grid: dict[str, Any] = Field(default={}, description="the product of all values: {speed: [1000 rpm, 2000 rpm]}")
    rows: dict[str, Any] = Field(default={}, alias="list", description="lists of equal length, taken row by row")
    latin_hypercube: SampleSection | None = Field(default=None, description="{count, seed, parameters}")
    sobol: SampleSection | None = Field(default=None, description="{count, seed, parameters}")
    monte_carlo: SampleSection | None = Field(default=None, description="{count, seed, parameters}")
    corners: dict[str, Any] = Field(default={}, description="all ends of the tolerances: {gap: 150 um +- 20 um}")
    one_at_a_time: dict[str, Any] = Field(default={}, description="each tolerance's ends alone, for a tornado")


class UntilSection(_Section):
    """A stop rule: windows of equal length, until an outcome has settled."""

    settled: str = Field(description="a variable, whose mean is meant, or an outcome")
    within: str = Field(default="0.1 %", description="largest change from window to window: a share, or with a unit")
    every: TimeText = Field(description="length of a window")
    at_most: int = Field(default=100, ge=3, description="most windows")


class RunSection(_Section):
    """How each point is run."""

    analysis: Literal["simulate", "periodic", "steady"] = Field(default="simulate", description="what is run")
    stop: TimeText | None = Field(default=None, description="end time of a simulation; default the circuit's")
    window: TimeText | None = Field(default=None, description="last part, over which outcomes are measured")
    until: UntilSection | None = Field(default=None, description="simulate in windows until an outcome has settled")
    period: TimeText | None = Field(default=None, description="period of the periodic analysis")
    tolerance: float | None = Field(default=None, gt=0, lt=1, description="of the periodic or steady analysis")
    most: int | None = Field(default=None, ge=1, description="most periods of the periodic analysis")
    solver: Annotated[str, AfterValidator(_solver)] | None = Field(
        default=None, description="integration method; default the circuit's"
    )
    rtol: float | None = Field(default=None, ge=SMALLEST_RTOL, lt=1, description="relative tolerance of every state")
    max_step: Time | None = Field(default=None, gt=0, description="longest step")
    compile: bool | None = Field(default=None, description="compile the equations; default where it pays")
    time_limit: Time | None = Field(default=None, gt=0, description="longest computing time of a point")

    @model_validator(mode="after")
    def _fits(self) -> RunSection:
        simulating = self.analysis == "simulate"
        for name in ("stop", "window", "until", "max_step"):
            if getattr(self, name) is not None and not simulating:
                raise ValueError(f"{name} belongs to analysis: simulate, not {self.analysis}; remove one of them")
        for name in ("period", "most"):
            if getattr(self, name) is not None and self.analysis != "periodic":
                raise ValueError(f"{name} belongs to analysis: periodic, not {self.analysis}; remove one of them")
        if self.tolerance is not None and simulating:
            raise ValueError("tolerance belongs to analysis: periodic or steady; a simulation has rtol")
        for name in ("solver", "rtol", "compile"):
            if getattr(self, name) is not None and self.analysis == "steady":
                raise ValueError(f"{name} means nothing to analysis: steady; remove it")
        if self.until is not None and (self.stop is not None or self.window is not None):
            raise ValueError("until brings its own end and window; remove stop and window")
        return self


class CurvesSection(_Section):
    """One column over another, a curve for each value of ``by``."""

    x: str = Field(description="column of the horizontal axis")
    y: Names = Field(min_length=1, description="columns drawn over it")
    by: str | None = Field(default=None, description="a varied setting: one curve for each of its values")


class PlotSection(_Section):
    """One picture of the table."""

    curves: CurvesSection | None = Field(default=None, description="{x: pressure, y: flow, by: speed}")
    tornado: Names | None = Field(default=None, min_length=1, description="outcomes: what each setting does to them")
    scatter: list[str] | None = Field(default=None, min_length=2, description="columns, each over each other one")
    distribution: Names | None = Field(default=None, min_length=1, description="columns: histograms")
    title: str | None = Field(default=None, description="title")

    @model_validator(mode="after")
    def _one(self) -> PlotSection:
        kinds = ("curves", "tornado", "scatter", "distribution")
        if sum(getattr(self, kind) is not None for kind in kinds) != 1:
            raise ValueError(f"a picture is one of {', '.join(kinds)}; write for example {{distribution: pressure}}")
        return self

    @property
    def columns(self) -> list[tuple[str, tuple[str | int, ...]]]:
        """Every column it names, with where in the section."""
        if self.curves is not None:
            named: list[tuple[str, tuple[str | int, ...]]] = [(self.curves.x, ("curves", "x"))]
            named += [(name, ("curves", "y", k)) for k, name in enumerate(self.curves.y)]
            return named + ([(self.curves.by, ("curves", "by"))] if self.curves.by else [])
        kind = next(k for k in ("tornado", "scatter", "distribution") if getattr(self, k) is not None)
        return [(name, (kind, k)) for k, name in enumerate(getattr(self, kind))]


class StudyFile(_Section):
    """The sections of a study file."""

    crescentlab_study: Literal["1"] = Field(description="format version")
    title: str = Field(default="", description="one line")
    description: str = Field(default="", description="what the study shows")
    circuit: str = Field(description="a shipped circuit's name, or a path from this file")
    settings: dict[str, str] = Field(default={}, alias="set", description="fixed settings, as for --set")
    vary: VarySection = Field(description="what varies")
    run: RunSection = Field(default=RunSection(), description="how each point is run")
    measure: dict[Name, str] = Field(min_length=1, description="name: outcome")
    plots: list[PlotSection] = Field(default=[], description="pictures of the table")


@dataclass(frozen=True)
class Study:
    """A study file: its sections, the tree they came from, and where it lies."""

    sections: StudyFile
    node: Node
    path: Path

    @property
    def name(self) -> str:
        """The file's name without its suffix."""
        return self.path.stem

    @staticmethod
    def read(path: Path) -> Study:
        """Read and check a study file; raises :class:`InputError` at the offending line."""
        if not path.is_file():
            raise InputError(f"{path}: no such file; a study is a .yaml file that begins with `crescentlab_study: 1`")
        node = read(path, begins="a study begins with crescentlab_study: 1")
        if not isinstance(node.value, dict) or "crescentlab_study" not in node.value:
            place = node.place if not isinstance(node.value, dict) or not node.value else Place(str(path), 1)
            raise InputError("a study file is a mapping that begins with `crescentlab_study: 1`", place)
        _shapes(node)
        sections = validated(StudyFile, node)
        for name in sections.measure:
            if name in BOOKKEEPING:
                raise InputError(
                    f"measure: every table has a column {name!r} of its own; choose another name",
                    node.place_of("measure", name),
                )
        return Study(sections, node, path)

    def place(self, *path: Any) -> Place | None:
        """Where something stands: ``place("vary", "grid", "speed")``."""
        return self.node.place_of(*path)

    @property
    def circuit(self) -> Path:
        """The circuit's file: beside the study, or a shipped one."""
        beside = self.path.parent / self.sections.circuit
        if beside.is_file():
            return beside
        try:
            return find(self.sections.circuit)
        except InputError as error:
            raise error.at(self.place("circuit")) from None


_EXAMPLES: dict[tuple[str, ...], str] = {
    ("set",): "{volumes: mean}", ("vary",): "{grid: {speed: [1000 rpm, 2000 rpm]}}",
    ("vary", "grid"): "{speed: [1000 rpm, 2000 rpm]}", ("vary", "list"): "{speed: [1000 rpm, 2000 rpm]}",
    ("vary", "corners"): "{gap: 150 um +- 20 um}", ("vary", "one_at_a_time"): "{gap: 150 um +- 20 um}",
    **{("vary", kind): "{count: 64, parameters: {gap: [130 um, 170 um]}}" for kind in SAMPLES},
    **{("vary", kind, "parameters"): "{gap: [130 um, 170 um]}" for kind in SAMPLES},
    ("run",): "{stop: 50 ms}", ("run", "until"): "{settled: line.p, within: 0.1 %, every: 10 ms}",
    ("measure",): "{pressure: mean(line.p)}",
}  # fmt: skip
"""Sections that need keys, and how one is written."""


def _shapes(node: Node) -> None:
    """Refuse text or a list where a section needs keys."""
    for path, example in _EXAMPLES.items():
        parent = node.find(path[:-1]).value
        if isinstance(parent, dict) and path[-1] in parent and not isinstance(parent[path[-1]].value, dict):
            raise InputError(f"{'.'.join(path)} needs keys, for example {path[-1]}: {example}", node.place_of(*path))
