"""Measured data: a CSV file whose first line names its columns with units.

.. code-block:: text

    # whatever stands after a # at the beginning of a line is left out
    speed [rpm], throttle_area [mm^2], flow [L/min], pressure [bar]
    1000, 20, 11.9, 1.1

An empty cell is a value that was not measured.
"""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from crescentlab.errors import InputError, Place, nearest
from crescentlab.units import QUANTITIES, Quantity, normalise

COMMENT = "#"


@dataclass(frozen=True)
class Column:
    """One column: its unit as written, and its cells' texts, without blanks around them."""

    name: str
    unit: str
    cells: tuple[str, ...]

    def text(self, row: int) -> str:
        """The cell as a circuit file would write it: ``2000 rpm``."""
        return f"{self.cells[row]} {self.unit}".strip()


@dataclass(frozen=True)
class Table:
    """The columns of a data file by name, and the place of each row."""

    path: str
    columns: dict[str, Column]
    top: Place
    """The line of the titles."""
    places: tuple[Place, ...]

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(self.places)

    def column(self, name: str, place: Place | None) -> Column:
        """The column of this name; raises :class:`InputError` at ``place`` offering the nearest."""
        if name not in self.columns:
            said = f"{self.path} has no column {name!r}: {nearest(name, self.columns)}"
            raise InputError(said, place)
        return self.columns[name]

    def numbers(self, name: str, quantity: Quantity, *, difference: bool = False) -> np.ndarray:
        """A column as numbers of ``quantity`` [SI], shape (rows,); NaN where a cell is empty.

        A ``difference`` of temperatures has no zero point: 2 degC are 2 K.

        Raises :class:`InputError` at the titles for a unit of another quantity, at the row for what is no number.
        """
        column = self.columns[name]
        try:
            quantity.factor(column.unit, f"{name} [{column.unit}]" if column.unit else name)
        except InputError as error:
            raise InputError(f"column {name!r}: {error.message}", self.top) from None
        offset = 0.0 if difference else quantity.offsets.get(normalise(column.unit), 0.0)
        factor = quantity.factor(column.unit)
        return np.array([number(cell, place) * factor + offset for cell, place in self._cells(column)])

    def plain(self, name: str) -> np.ndarray | None:
        """A column's numbers in its own unit, shape (rows,); None if it holds words."""
        try:
            return np.array([number(cell, place) for cell, place in self._cells(self.columns[name])])
        except InputError:
            return None

    def _cells(self, column: Column) -> zip[tuple[str, Place]]:
        return zip(column.cells, self.places, strict=True)


def number(cell: str, place: Place) -> float:
    """A cell's number, NaN if it is empty; raises :class:`InputError` for anything that is no finite number."""
    if not cell:
        return math.nan
    try:
        value = float(cell)
    except ValueError:
        value = math.inf
    if not math.isfinite(value):
        raise InputError(f"{cell!r} is not a finite number; decimals follow a point", place)
    return value


def read_table(path: Path, shown: str, asked: Place | None = None) -> Table:
    """Read a data file; ``asked`` is where its name is written. Raises :class:`InputError` with file and line."""
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except OSError as error:
        said = f"cannot read the data {shown}: {error.strerror}; it is looked for beside the fit file"
        raise InputError(said, asked) from None
    except UnicodeDecodeError as error:
        raise InputError(f"the data {shown} is not text in UTF-8 ({error.reason})", asked) from None
    told = [(n, line) for n, line in enumerate(lines, start=1) if line.strip()]
    kept = [(n, line) for n, line in told if not line.lstrip().startswith(COMMENT)]
    rows = [
        (Place(shown, n), [cell.strip() for cell in cells])
        for (n, _), cells in zip(kept, csv.reader([line for _, line in kept], skipinitialspace=True), strict=True)
    ]
    if len(rows) < 2:
        said = "the first line names the columns with units, as in: speed [rpm], flow [L/min]; rows of numbers follow"
        raise InputError(said, Place(shown, 1))
    (top, titles), *body = rows
    for place, cells in body:
        if len(cells) != len(titles):
            raise InputError(f"{len(cells)} cells under {len(titles)} titles; write one of each", place)
    names = [_title(title, top) for title in titles]
    columns: dict[str, Column] = {}
    for k, (name, unit) in enumerate(names):
        if name in columns:
            raise InputError(f"the column {name!r} stands twice; rename one", top)
        columns[name] = Column(name, unit, tuple(cells[k] for _, cells in body))
    return Table(shown, columns, top, tuple(place for place, _ in body))


def _title(title: str, top: Place) -> tuple[str, str]:
    """Name and unit of ``flow [L/min]``."""
    name, bracket, rest = (part.strip() for part in title.partition("["))
    unit, closed, after = rest.partition("]")
    unit = unit.strip()
    if not name or (bracket and (not closed or after.strip())):
        raise InputError(f"the title {title!r} is not `name [unit]`, for example speed [rpm]", top)
    if unit and not any(normalise(unit) in q.units for q in QUANTITIES.values()):
        known = [u for q in QUANTITIES.values() for u in q.units if u]
        raise InputError(f"column {name!r}: unknown unit {unit!r}: {nearest(normalise(unit), known)}", top)
    return name, unit
