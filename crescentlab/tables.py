"""Curves: tabulated data as a parameter, written in the circuit or kept in a CSV file beside it.

In a circuit file ``{x: [0 bar, 3 bar], y: [0 mm, 0.016 mm]}``, or ``cover_deflection.csv``, whose
first line names two columns with units, ``pressure [bar], deflection [mm]``.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler, ValidationInfo
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from crescentlab import maths
from crescentlab.errors import InputError, Place, UnitError
from crescentlab.symbols import Sym
from crescentlab.units import QUANTITIES, Quantity, normalise, parse_any

MAX_POINTS = 2000
"""A piecewise-linear curve lives in the expression graph, so its length is bounded."""


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
        slopes = np.diff(self.y) / np.diff(self.x)
        if not isinstance(x, Sym):
            piece = np.clip(np.searchsorted(self.x, x, side="right") - 1, 0, len(slopes) - 1)
            return slopes[piece][()]
        result: Any = float(slopes[0])
        for k in range(1, len(slopes)):
            result = maths.event_where(x > self.x[k], float(slopes[k]), result)
        return result

    def work(self, x: Any) -> Any:
        """Integral of x dy from the first point on: what moving something by y against x takes."""
        knots, slopes = np.array(self.x), np.diff(self.y) / np.diff(self.x)
        before = np.concatenate([[0.0], np.cumsum(slopes * np.diff(knots**2) / 2)])
        if not isinstance(x, Sym):
            piece = np.clip(np.searchsorted(knots, x, side="right") - 1, 0, len(slopes) - 1)
            return (before[piece] + slopes[piece] * (np.asarray(x) ** 2 - knots[piece] ** 2) / 2)[()]
        result: Any = float(slopes[0]) * (x * x - knots[0] ** 2) / 2
        for k in range(1, len(slopes)):
            here = float(before[k]) + float(slopes[k]) * (x * x - knots[k] ** 2) / 2
            result = maths.event_where(x > self.x[k], here, result)
        return result


@dataclass(frozen=True)
class CurveOf:
    """Field annotation: a curve whose columns are of these quantities (None: any).

    ``deflection: Annotated[Curve, CurveOf(units.pressure, units.length)]``
    """

    x: Quantity | None = None
    y: Quantity | None = None

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Read inline data or a CSV file, relative to the folder in the validation context."""
        return core_schema.with_info_before_validator_function(self._read, handler(source))

    def _read(self, value: Any, info: ValidationInfo) -> Any:
        try:
            if isinstance(value, str) and value:
                folder = Path((info.context or {}).get("folder", "."))
                return read_csv(folder / value, self.x, self.y)
            if isinstance(value, dict) and {"x", "y"} <= set(value) <= set(Curve.model_fields):
                xs, x_quantity = _column(value["x"], self.x, "x")
                ys, y_quantity = _column(value["y"], self.y, "y")
                return _curve(xs, ys, x_quantity, y_quantity)
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


def _curve(xs: list[float], ys: list[float], x: Quantity, y: Quantity, places: list[Place] | None = None) -> Curve:
    """The checked curve; ``places`` are the lines of its points."""
    if len(xs) != len(ys):
        raise InputError(f"{len(xs)} values of x and {len(ys)} of y; write as many of each")
    if len(xs) < 2:
        raise InputError("a curve needs at least two points")
    if len(xs) > MAX_POINTS:
        raise InputError(f"{len(xs)} points; a curve may have {MAX_POINTS}, so thin it out")
    unit = next(iter(x.units))
    for k, (first, second) in enumerate(pairwise(xs)):
        if not second > first:
            said = f"x must rise from point to point, but {x.show(second, unit)} follows {x.show(first, unit)}"
            raise InputError(f"{said}; sort the points", places[k + 1] if places else None)
    return Curve(x=tuple(xs), y=tuple(ys), x_quantity=x.name, y_quantity=y.name)


def read_csv(path: Path, x: Quantity | None = None, y: Quantity | None = None) -> Curve:
    """Read a two-column CSV file with units in its header; raises :class:`InputError` with the line."""
    try:
        reader = csv.reader(path.read_text(encoding="utf-8-sig").splitlines())
        rows = [(Place(str(path), reader.line_num), row) for row in reader if any(cell.strip() for cell in row)]
    except OSError as error:
        raise InputError(
            f"cannot read the table {path.name}: {error.strerror}; it is looked for beside the circuit file"
        ) from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"the table {path.name} is not text in UTF-8 ({error})") from None
    top = Place(str(path), 1)
    if not rows or len(rows[0][1]) != 2:
        said = "the first line must name two columns with units, separated by a comma"
        raise InputError(f"{said}, for example: pressure [bar], deflection [mm]", top)
    columns = [_header(title, quantity, path) for title, quantity in zip(rows[0][1], (x, y), strict=True)]
    values: tuple[list[float], list[float]] = ([], [])
    for place, row in rows[1:]:
        if len(row) != 2 or not row[0].strip() or not row[1].strip():
            said = "write two numbers separated by a comma, their decimals after a point"
            raise InputError(f"{said}, not {','.join(row)!r}", place)
        for cell, (quantity, unit), column in zip(row, columns, values, strict=True):
            try:
                column.append(quantity.parse(f"{float(cell)!r} {unit}"))
            except (ValueError, UnitError):
                raise InputError(f"{cell.strip()!r} is not a finite number", place) from None
    try:
        return _curve(*values, columns[0][0], columns[1][0], [place for place, _ in rows[1:]])
    except InputError as error:
        raise error.at(top) from None


def _header(title: str, quantity: Quantity | None, path: Path) -> tuple[Quantity, str]:
    name, bracket, rest = title.partition("[")
    unit = rest.partition("]")[0].strip() if bracket else ""
    key = normalise(unit)
    if quantity is not None:
        try:
            quantity.factor(unit, title.strip())
        except UnitError as error:
            raise error.at(Place(str(path), 1)) from None
        return quantity, unit
    for candidate in QUANTITIES.values():
        if key in candidate.units:
            return candidate, unit
    raise InputError(
        f"column {name.strip()!r}: unknown unit {unit!r}; write it in brackets, for example {name.strip()} [bar]",
        Place(str(path), 1),
    )
