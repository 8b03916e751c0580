"""Curves: tabulated data as a parameter, written in the circuit or kept in a CSV file beside it.

In a circuit file ``{x: [0 bar, 3 bar], y: [0 mm, 0.016 mm]}``, or ``cover_deflection.csv``, whose
first line names two columns with units, ``pressure [bar], deflection [mm]``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler, ValidationInfo
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from crescentlab import maths
from crescentlab.data_files import open_data, whole
from crescentlab.errors import InputError, Place
from crescentlab.units import QUANTITIES, Quantity, parse_any


class Curve(BaseModel):
    """y(x), piecewise linear through at least two points, continued with the end slopes. SI floats.

    Calling a curve evaluates it on floats and symbols; while tracing, each inner knot is an event.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    x: tuple[float, ...]
    y: tuple[float, ...]
    x_quantity: str = "ratio"
    y_quantity: str = "ratio"

    def __call__(self, x: Any) -> Any:
        return maths.table(x, self.x, self.y)

    def slope(self, x: Any) -> Any:
        """dy/dx, constant between knots (the right-hand slope at a knot)."""
        xs = np.array(self.x)
        slopes = np.diff(self.y) / np.diff(xs)
        return maths.piecewise(x, xs[1:-1], xs[:-1], slopes[:, None])

    def work(self, x: Any) -> Any:
        """Integral of x dy from the first point on: what moving something by y against x takes."""
        xs = np.array(self.x)
        slopes = np.diff(self.y) / np.diff(xs)
        before = np.concatenate([[0.0], np.cumsum(slopes * np.diff(xs**2) / 2)[:-1]])
        return maths.piecewise(x, xs[1:-1], xs[:-1], np.column_stack([before, slopes * xs[:-1], slopes / 2]))


@dataclass(frozen=True)
class CurveOf:
    """Field annotation: a curve whose columns are of these quantities (None: any).

    ``deflection: Annotated[Curve, CurveOf(units.pressure, units.length)]``
    """

    x: Quantity | None = None
    y: Quantity | None = None
    jumps: bool = False
    """Whether two points may have one x."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Read inline data or a CSV file, relative to the folder in the validation context."""
        return core_schema.with_info_before_validator_function(self._read, handler(source))

    def _read(self, value: Any, info: ValidationInfo) -> Any:
        try:
            if isinstance(value, str) and value:
                folder = Path((info.context or {}).get("folder", "."))
                return read_csv(folder / value, self.x, self.y, jumps=self.jumps)
            if isinstance(value, dict) and {"x", "y"} <= set(value) <= set(Curve.model_fields):
                xs, x_quantity = _column(value["x"], self.x, "x")
                ys, y_quantity = _column(value["y"], self.y, "y")
                return _curve(xs, ys, x_quantity, y_quantity, self.jumps)
        except InputError as error:
            at = {"file": error.place.file, "line": error.place.line} if error.place else {}
            raise PydanticCustomError("curve", "{reason}", {"reason": error.message, **at}) from None
        if isinstance(value, Curve):
            return value
        said = "write a CSV file's name, or {x: [0 bar, 1 bar], y: [0 mm, 2 mm]}"
        raise PydanticCustomError("curve", "{reason}", {"reason": said})


def _column(items: Any, quantity: Quantity | None, name: str) -> tuple[list[float], Quantity]:
    if not isinstance(items, (list, tuple)):
        raise InputError(f"{name} must be a list in brackets, for example [0 bar, 1 bar]")
    values: list[float] = []
    for item in items:
        if isinstance(item, (int, float)):
            values.append(float(item))
        elif quantity is None:
            value, quantity = parse_any(str(item))
            values.append(value)
        else:
            values.append(quantity.parse(str(item)))
    return values, quantity or QUANTITIES["ratio"]


def _curve(
    xs: list[float], ys: list[float], x: Quantity, y: Quantity, jumps: bool, places: Sequence[Place] = ()
) -> Curve:
    """The checked curve; ``places`` are the lines of its points."""
    if len(xs) != len(ys):
        raise InputError(f"{len(xs)} values of x and {len(ys)} of y; write as many of each")
    if len(xs) < 2:
        raise InputError("a curve needs at least two points")
    steps = np.diff(xs)
    wrong = np.flatnonzero(~(steps >= 0 if jumps else steps > 0))
    if wrong.size or not np.any(steps > 0):
        k = int(wrong[0]) if wrong.size else 0
        unit = next(iter(x.units))
        first, second = x.show(xs[k], unit), x.show(xs[k + 1], unit)
        said = f"x must rise from point to point, but {second} follows {first}"
        advice = "sort the points" if xs[k + 1] < xs[k] else "leave one of them out"
        raise InputError(f"{said}; {advice}", places[k + 1] if places else None)
    return Curve(x=tuple(xs), y=tuple(ys), x_quantity=x.name, y_quantity=y.name)


def read_csv(path: Path, x: Quantity | None = None, y: Quantity | None = None, *, jumps: bool = False) -> Curve:
    """Read a two-column CSV file with units in its header; raises :class:`InputError` with the line."""
    file = open_data(path, str(path))
    if len(file.titles) != 2:
        said = "the first line must name two columns with units, for example: pressure [bar], deflection [mm]"
        raise InputError(f"{said}; a recorded_signal takes one of many columns by its name", file.top)
    table = whole(file)
    quantities, values = [], []
    for k, (name, quantity) in enumerate(zip(table.columns, (x, y), strict=True)):
        quantities.append(quantity or table.file.quantity(k))
        values.append(table.numbers(name, quantities[k]))
        for cell, place in zip(table.columns[name].cells, table.places, strict=True):
            if not cell:
                raise file.empty(k, place)
    try:
        return _curve(values[0].tolist(), values[1].tolist(), quantities[0], quantities[1], jumps, table.places)
    except InputError as error:
        raise error.at(table.top) from None
