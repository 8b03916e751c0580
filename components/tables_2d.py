"""Tables of two variables, for characteristics such as an efficiency over speed and pressure."""

import math
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationInfo
from pydantic_core import PydanticCustomError

from crescentlab.component import Component, Equations
from crescentlab.data_files import open_data, whole
from crescentlab.domain import gives_signal, takes_signal
from crescentlab.errors import InputError
from crescentlab.maths import Expr
from crescentlab.units import Quantity, parse_any, ratio

from .interpolation import Interpolation, surface

MAX_POINTS = 2500
"""A table lives in the expressions of its circuit, so its size is bounded."""

AXES = ("x", "y", "z")


class Surface(BaseModel):
    """z over a grid of x (n) and y (m), each rising: z[i][k] belongs to x[i] and y[k]. SI floats."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    x: tuple[float, ...]
    y: tuple[float, ...]
    z: tuple[tuple[float, ...], ...]
    x_quantity: str = "ratio"
    y_quantity: str = "ratio"
    z_quantity: str = "ratio"


def _read(value: Any, info: ValidationInfo) -> Any:
    try:
        if isinstance(value, str) and value:
            return read_csv(Path((info.context or {}).get("folder", ".")) / value)
        if isinstance(value, dict) and set(value) == set(AXES):
            return _inline(value)
    except InputError as error:
        at = {"file": error.place.file, "line": error.place.line} if error.place else {}
        raise PydanticCustomError("surface", "{reason}", {"reason": error.message, **at}) from None
    if isinstance(value, Surface) or (isinstance(value, dict) and set(value) == set(Surface.model_fields)):
        return value
    said = "write a CSV file's name, or {x: [0 rpm, 1000 rpm], y: [0 bar, 100 bar], z: [[1, 0.9], [1, 0.95]]}"
    raise PydanticCustomError("surface", "{reason}", {"reason": said})


GridOfValues = Annotated[Surface, BeforeValidator(_read)]
"""A surface written in the circuit, or kept in a CSV file beside it."""


def _inline(value: dict[str, Any]) -> Surface:
    rows = value["z"]
    if not isinstance(rows, (list, tuple)) or not all(isinstance(row, (list, tuple)) for row in rows):
        raise InputError(
            "z must be a list of lists, one for each x, for example [[0 L/min, 1 L/min], [2 L/min, 3 L/min]]"
        )
    x, x_quantity = _numbers(value["x"], "x")
    y, y_quantity = _numbers(value["y"], "y")
    flat, z_quantity = _numbers([item for row in rows for item in row], "z")
    if len(rows) != len(x) or any(len(row) != len(y) for row in rows):
        raise InputError(f"z needs {len(x)} lists of {len(y)} values, one list for each x, one value for each y")
    z = tuple(tuple(flat[i * len(y) : (i + 1) * len(y)]) for i in range(len(x)))
    return _checked(x, y, z, (x_quantity, y_quantity, z_quantity))


def _numbers(items: Any, name: str) -> tuple[list[float], Quantity]:
    if not isinstance(items, (list, tuple)):
        raise InputError(f"{name} must be a list in brackets, for example [0 bar, 1 bar]")
    values: list[float] = []
    quantity: Quantity | None = None
    for item in items:
        if isinstance(item, (int, float)):
            values.append(float(item))
        elif quantity is None:
            value, quantity = parse_any(str(item))
            values.append(value)
        else:
            values.append(quantity.parse(str(item)))
    return values, quantity or ratio


def _checked(
    x: list[float], y: list[float], z: tuple[tuple[float, ...], ...], quantities: tuple[Quantity, Quantity, Quantity]
) -> Surface:
    for name, values, quantity in (("x", x, quantities[0]), ("y", y, quantities[1])):
        if len(values) < 2:
            raise InputError(f"{name} needs at least two values")
        unit = next(iter(quantity.units))
        for first, second in pairwise(values):
            if not second > first:
                said = f"{name} must rise, but {quantity.show(second, unit)} follows {quantity.show(first, unit)}"
                raise InputError(f"{said}; sort it")
    if len(x) * len(y) > MAX_POINTS:
        raise InputError(f"{len(x)} times {len(y)} points; a table may have {MAX_POINTS}, so thin it out")
    names = {f"{axis}_quantity": quantity.name for axis, quantity in zip(AXES, quantities, strict=True)}
    return Surface(x=tuple(x), y=tuple(y), z=z, **names)


def read_csv(path: Path) -> Surface:
    """Read three columns x, y, z with units in the header, one line for each point of the grid, in any order.

    Raises :class:`InputError` with the line.
    """
    file = open_data(path, str(path))
    if len(file.titles) != 3:
        said = "the first line must name three columns with units"
        raise InputError(f"{said}, for example: speed [rpm], pressure [bar], efficiency [%]", file.top)
    table = whole(file)
    names, quantities = list(table.columns), [table.file.quantity(k) for k in range(3)]
    columns = [table.numbers(name, quantity) for name, quantity in zip(names, quantities, strict=True)]
    points: dict[tuple[float, float], float] = {}
    for place, (x, y, z) in zip(table.places, np.transpose(columns).tolist(), strict=True):
        for k, value in enumerate((x, y, z)):
            if math.isnan(value):
                raise file.empty(k, place)
        if (x, y) in points:
            raise InputError("this pair of x and y stands in an earlier line already; leave one of them out", place)
        points[x, y] = z
    xs, ys = sorted({x for x, _ in points}), sorted({y for _, y in points})
    missing = next(((x, y) for x in xs for y in ys if (x, y) not in points), None)
    if missing is not None:
        first, second = (
            quantity.show(value, title.unit)
            for value, quantity, title in zip(missing, quantities, table.file.titles, strict=False)
        )
        raise InputError(f"no line for {first} and {second}; the table needs every pair of its x and y", table.top)
    grid = tuple(tuple(points[x, y] for y in ys) for x in xs)
    try:
        return _checked(xs, ys, grid, (quantities[0], quantities[1], quantities[2]))
    except InputError as error:
        raise error.at(table.top) from None


class Table2d(Component):
    r"""Tabulated function of two signals, bilinear or a bicubic spline, continued with the slopes at its edges.

    .. math:: z = (1 - a)(1 - b) z_{ik} + a (1 - b) z_{i+1,k} + (1 - a) b\, z_{i,k+1} + a b\, z_{i+1,k+1}, \quad
              a = \frac{x - x_i}{x_{i+1} - x_i}, \quad b = \frac{y - y_k}{y_{k+1} - y_k}

    x = signal `u1` [any], y = signal `u2` [any], z = signal `y` [any], in the SI units of the table's first, second and
    third column; the table is `{x: [...], y: [...], z: [[...], ...]}` with one list of z for each x, or a CSV file
    of three columns with one line for each pair. Each line of the grid is an event when bilinear; a `spline` is the
    product of natural cubic ones, smooth, and may overshoot. Not for scattered points: they must fill a grid.
    Source: Press et al., Numerical Recipes (3rd ed. 2007), section 3.6.
    """

    table: GridOfValues = Field(description="output over both inputs")
    interpolation: Interpolation = Field(default="linear", description="bilinear, or product of natural cubic splines")

    u1 = takes_signal("first_quantity", "first input")
    u2 = takes_signal("second_quantity", "second input")
    y = gives_signal("output_quantity", "the tabulated value")

    @property
    def first_quantity(self) -> str:
        """The quantity of the first column."""
        return self.table.x_quantity

    @property
    def second_quantity(self) -> str:
        """The quantity of the second column."""
        return self.table.y_quantity

    @property
    def output_quantity(self) -> str:
        """The quantity of the third column."""
        return self.table.z_quantity

    def equations(self, u1: Expr, u2: Expr) -> Equations:
        table = self.table
        return {"y": surface(u1, u2, table.x, table.y, table.z, spline=self.interpolation == "spline")}
