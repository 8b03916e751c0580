"""YAML text -> :class:`FitFile`: the sections of a fit file, checked for shape.

A fit file names a circuit, a table of measured data, which of its columns set what, which are compared with what, and
the parameters to be found between bounds.
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from crescentlab.errors import InputError
from crescentlab.explain import validated
from crescentlab.studies.study_file import RunSection
from crescentlab.yaml_text import Node, read


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class ParameterSection(_Section):
    """A parameter to be found."""

    start: str = Field(description="where the first search begins")
    low: str = Field(description="lower bound; above 0 for a logarithmic scale")
    high: str = Field(description="upper bound")


class FitFile(_Section):
    """The sections of a fit file."""

    crescentlab_fit: Literal["1"] = Field(description="format version")
    title: str = Field(default="", description="one line")
    description: str = Field(default="", description="what the fit is for")
    circuit: str = Field(description="a circuit file, or the name of a shipped circuit")
    data: str = Field(description="a CSV file whose titles are `name [unit]`")
    set: dict[str, str] = Field(default={}, description="values that all rows share, as for --set: {speed: 2000 rpm}")
    settings: dict[str, str] = Field(default={}, description="columns that set something: {column: name as for --set}")
    measured: dict[str, str] = Field(min_length=1, description="columns compared: {flow: mean(throttle.q)}")
    uncertainty: dict[str, str] = Field(
        default={}, description="standard deviations: {flow: 5 %}, {flow: 0.1 L/min}; without: from the residuals"
    )
    parameters: dict[str, ParameterSection] = Field(
        min_length=1, description="what is found: {gap: {start: 100 um, low: 20 um, high: 300 um}}"
    )
    run: RunSection = Field(default=RunSection(), description="how each row is run, as in study files")
    starts: int = Field(default=5, ge=1, description="searches: one from start, the others spread between the bounds")
    seed: int = Field(default=1, ge=0, description="the same seed spreads the same starts")


def read_fit_file(path: Path) -> tuple[FitFile, Node]:
    """The sections of a fit file, and its text with places; raises :class:`InputError` with file and line."""
    node = read(path, begins="a fit begins with crescentlab_fit: 1")
    if not isinstance(node.value, dict) or "crescentlab_fit" not in node.value:
        raise InputError("a fit file is a mapping that begins with `crescentlab_fit: 1`", node.place)
    return validated(FitFile, node), node
