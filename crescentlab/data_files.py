"""Data files: columns of text whose first line names them with units. One reader for curves, recordings and fits.

.. code-block:: text

    # whatever stands after a # at the beginning of a line, or behind the numbers of a row, is left out
    time [s]; flow [L/min]; remark
    0,0;      11,9;         pump on
    0,1;      12,0;

Columns are separated by commas, semicolons or tabs, whichever the first line has; with semicolons and tabs decimals may
follow a comma. Cells may stand in double quotes. An empty cell is a value that was not measured.
"""

from __future__ import annotations

import csv
import functools
import math
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from crescentlab.errors import InputError, Place, nearest
from crescentlab.units import COMMON, QUANTITIES, Quantity, nearest_unit, normalise, parse_any

COMMENT = "#"
BLOCK = 4_000_000
"""Bytes read at once."""


@dataclass(frozen=True)
class Title:
    """A column's name and unit, as written."""

    name: str
    unit: str


@dataclass(frozen=True)
class DataFile:
    """The first line of a data file: its columns and how they are separated. Rows are read when they are asked for."""

    path: Path
    shown: str
    """Its name in messages."""
    line: int
    """Number of the line of titles."""
    titles: tuple[Title, ...]
    separator: str
    width: int
    """Cells of the first line, one without a title at its end included."""
    begin: int
    """Bytes up to the first row."""

    @property
    def top(self) -> Place:
        """The line of the titles."""
        return Place(self.shown, self.line)

    @property
    def names(self) -> list[str]:
        """Of the columns, in order."""
        return [title.name for title in self.titles]

    def number_of(self, name: str, place: Place | None = None) -> int:
        """Position of the column of this name; raises :class:`InputError` at ``place`` offering the nearest."""
        if name not in self.names:
            raise InputError(f"{self.path.name} has no column {name!r}: {nearest(name, self.names)}", place)
        return self.names.index(name)

    def scale(self, column: int, quantity: Quantity, *, difference: bool = False) -> tuple[float, float]:
        """Factor and offset from the column's unit to SI; raises :class:`InputError` for one of another quantity.

        A ``difference`` of temperatures has no zero point: 2 degC are 2 K.
        """
        name, unit = self.titles[column].name, self.titles[column].unit
        try:
            factor = quantity.factor(unit, f"{name} [{unit}]" if unit else name)
        except InputError as error:
            raise InputError(f"column {name!r}: {error.message}", self.top) from None
        return factor, 0.0 if difference else quantity.offsets.get(normalise(unit), 0.0)

    def quantity(self, column: int) -> Quantity:
        """The quantity that owns the column's unit, the first listed if several do."""
        return parse_any(f"1 {self.titles[column].unit}".strip())[1]

    def blocks(self, begin: int = 0, line: int = 0) -> Iterator[tuple[int, int, list[str]]]:
        """From a byte and a line on: number of the first line, bytes up to the last, and the lines, block by block."""
        begin, line = begin or self.begin, line or self.line + 1
        try:
            with self.path.open("rb") as file:
                file.seek(begin)
                while block := file.readlines(BLOCK):
                    whole = b"".join(block)
                    begin += len(whole)
                    yield line, begin, _decoded(whole, self.shown, line).split("\n")[: len(block)]
                    line += len(block)
        except OSError as error:
            raise InputError(f"cannot read the data {self.path.name}: {error.strerror}") from None

    def rows(self) -> Iterator[tuple[Place, list[str]]]:
        """Place and cells of every row."""
        for first, _, lines in self.blocks():
            yield from self._cells(first, lines)

    def _cells(self, first: int, lines: Sequence[str]) -> Iterator[tuple[Place, list[str]]]:
        for n, line in enumerate(lines, start=first):
            text = line.partition(COMMENT)[0]
            if not text.strip():
                continue
            cells = _split(text, self.separator)
            while len(cells) > len(self.titles) and not cells[-1]:
                cells.pop()
            if not any(cells):
                continue
            if len(cells) != len(self.titles):
                said = f"{len(cells)} cells under {len(self.titles)} titles; write one of each"
                said += ", decimals after a point" if self.separator == "," and len(cells) > len(self.titles) else ""
                raise InputError(said, Place(self.shown, n))
            yield Place(self.shown, n), cells

    def number(self, cell: str, place: Place, column: int) -> float:
        """A cell's number, NaN if it is empty; raises :class:`InputError` naming row and column."""
        if not cell:
            return math.nan
        try:
            value = float(cell if self.separator == "," else cell.replace(",", "."))
        except ValueError:
            value = math.inf
        if not math.isfinite(value):
            said = f"{cell!r} is not a finite number, in the column {self.titles[column].name!r}"
            raise InputError(said + ("; decimals follow a point" if "," in cell else ""), place)
        return value

    def numbers(
        self, first: int, lines: list[str], columns: Sequence[int]
    ) -> tuple[np.ndarray, list[int], InputError | None]:
        """Numbers of some columns in a block of lines up to the first that has none: (rows, columns), line numbers.

        The third says what is wrong with that one, by line and column: an empty cell, or what is no finite number.
        """
        kept = [(n, line) for n, line in enumerate(lines, start=first) if _has_cells(line)]
        if not kept:
            return np.zeros((0, len(columns))), [], None
        places = [n for n, _ in kept]
        if all(line.count(self.separator) == self.width - 1 for _, line in kept):
            try:
                made = np.loadtxt(
                    [line if self.separator == "," else line.replace(",", ".") for _, line in kept],
                    delimiter=self.separator, usecols=columns, comments=COMMENT, ndmin=2, quotechar='"',
                )  # fmt: skip
                if np.isfinite(made).all():
                    return made, places, None
            except ValueError:
                pass  # told below, cell by cell
        found: list[list[float]] = []
        places = []
        fault: InputError | None = None
        try:
            for place, cells in self._cells(first, lines):
                row = [self.number(cells[k], place, k) for k in columns]
                for k, value in zip(columns, row, strict=True):
                    if math.isnan(value):
                        raise self.empty(k, place)
                found.append(row)
                places.append(place.line)
        except InputError as error:
            fault = error
        return np.array(found).reshape(-1, len(columns)), places, fault

    def empty(self, column: int, place: Place) -> InputError:
        """What is said of a cell that must not be empty."""
        return InputError(f"the cell in the column {self.titles[column].name!r} is empty", place)


def _has_cells(line: str) -> bool:
    return bool(line.strip()) and not line.lstrip().startswith(COMMENT)


def open_data(path: Path, shown: str, asked: Place | None = None, *, beside: str = "circuit") -> DataFile:
    """Read the titles of a data file; ``asked`` is where its name is written. Raises :class:`InputError`.

    ``beside`` says in messages which file it is looked for beside.
    """
    try:
        with path.open("rb") as file:
            begin = 0
            for line, raw in enumerate(file, start=1):
                begin += len(raw)
                text = _decoded(raw, shown, line, asked).removeprefix("\ufeff").strip("\r\n")
                if text.strip() and not text.lstrip().startswith(COMMENT):
                    return _titles(path, shown, line, text, begin)
    except OSError as error:
        said = f"cannot read the data {path.name}: {error.strerror}; it is looked for beside the {beside} file"
        raise InputError(said, asked) from None
    raise _no_titles(Place(shown, 1))


def _no_titles(place: Place) -> InputError:
    said = "the first line names the columns with units, as in: speed [rpm], flow [L/min]; rows of numbers follow"
    return InputError(said, place)


def _decoded(raw: bytes, shown: str, line: int, asked: Place | None = None) -> str:
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError as error:
        at = line + raw[: error.start].count(b"\n")
        said = f"the data {Path(shown).name} is not text in UTF-8 ({error.reason}, line {at}); save it as UTF-8"
        raise InputError(said, asked or Place(shown, at)) from None


def _titles(path: Path, shown: str, line: int, text: str, begin: int) -> DataFile:
    top = Place(shown, line)
    separator = "\t" if "\t" in text else ";" if ";" in text else ","
    cells = _split(text, separator)
    width = len(cells)
    if not cells[-1]:
        cells.pop()
    titles: list[Title] = []
    for cell in cells:
        title = _title(cell, top)
        if title.name in [other.name for other in titles]:
            raise InputError(f"the column {title.name!r} stands twice; rename one", top)
        titles.append(title)
    return DataFile(path, shown, line, tuple(titles), separator, width, begin)


def _split(text: str, separator: str) -> list[str]:
    if '"' not in text:
        return [cell.strip() for cell in text.strip("\r\n").split(separator)]
    return [cell.strip() for row in csv.reader([text], delimiter=separator, skipinitialspace=True) for cell in row]


def _title(title: str, top: Place) -> Title:
    """Name and unit of ``flow [L/min]``."""
    name, bracket, rest = (part.strip() for part in title.partition("["))
    unit, closed, after = rest.partition("]")
    unit = unit.strip()
    if not name or (bracket and (not closed or after.strip())):
        raise InputError(f"the title {title!r} is not `name [unit]`, for example speed [rpm]", top)
    if unit and not any(normalise(unit) in q.units for q in QUANTITIES.values()):
        near = nearest_unit(normalise(unit), {u: 0 for q in QUANTITIES.values() for u in q.units})
        raise InputError(f"column {name!r}: unknown unit {unit!r}: {near or f'units are {COMMON} and the like'}", top)
    return Title(name, unit)


# -- whole files -------------------------------------------------------------------------------------


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
    """All columns of a data file by name, and the place of each row."""

    file: DataFile
    columns: dict[str, Column]
    places: tuple[Place, ...]

    @property
    def path(self) -> str:
        """The file's name in messages."""
        return self.file.shown

    @property
    def top(self) -> Place:
        """The line of the titles."""
        return self.file.top

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(self.places)

    def column(self, name: str, place: Place | None) -> Column:
        """The column of this name; raises :class:`InputError` at ``place`` offering the nearest."""
        self.file.number_of(name, place)
        return self.columns[name]

    def numbers(self, name: str, quantity: Quantity, *, difference: bool = False) -> np.ndarray:
        """A column as numbers of ``quantity`` [SI], shape (rows,); NaN where a cell is empty.

        Raises :class:`InputError` at the titles for a unit of another quantity, at the row for what is no number.
        """
        factor, offset = self.file.scale(self.file.number_of(name), quantity, difference=difference)
        return self._numbers(name) * factor + offset

    def plain(self, name: str) -> np.ndarray | None:
        """A column's numbers in its own unit, shape (rows,); None if it holds words."""
        try:
            return self._numbers(name)
        except InputError:
            return None

    def _numbers(self, name: str) -> np.ndarray:
        k = self.file.number_of(name)
        pairs = zip(self.columns[name].cells, self.places, strict=True)
        return np.array([self.file.number(cell, place, k) for cell, place in pairs])


def read_table(path: Path, shown: str, asked: Place | None = None, *, beside: str = "circuit") -> Table:
    """Read a whole data file; ``asked`` is where its name is written. Raises :class:`InputError` with file and line."""
    return whole(open_data(path, shown, asked, beside=beside))


def whole(file: DataFile) -> Table:
    """All rows of a data file; raises :class:`InputError` with file and line."""
    rows = list(file.rows())
    if not rows:
        raise _no_titles(Place(file.shown, 1))
    cells = list(zip(*(cells for _, cells in rows), strict=True))
    columns = {t.name: Column(t.name, t.unit, each) for t, each in zip(file.titles, cells, strict=True)}
    return Table(file, columns, tuple(place for place, _ in rows))


# -- recordings --------------------------------------------------------------------------------------


class Recording:
    """Some columns of a data file over the time, of which no more is read than has been asked for."""

    def __init__(self, file: DataFile, time: int, columns: Sequence[int]) -> None:
        self.file, self.columns = file, [time, *columns]
        self.factor, self.offset = file.scale(time, QUANTITIES["time"])
        self.begin, self.line = file.begin, file.line + 1
        self.rows = np.zeros((0, len(self.columns)))
        self.last = -math.inf
        self.fault: InputError | None = None
        """What is wrong with the row after the last one that could be read."""
        self.ended = False
        self.reading = threading.Lock()

    def until(self, t: float) -> tuple[np.ndarray, np.ndarray]:
        """Times [s] (m,) and values in the columns' units (m, columns) up to the first row beyond ``t``.

        Raises :class:`InputError` naming row and column for a time that falls, and for what is no number, unless it
        stands behind that row.
        """
        with self.reading:  # runs may share it
            if not self.last > t and not self.ended:
                self._read(t)
            rows = self.rows
        if self.fault is not None and not self.last > t:
            raise self.fault
        if not rows.size:
            raise _no_titles(self.file.top)
        stop = int(np.searchsorted(rows[:, 0], t, side="right")) + 1
        return rows[:stop, 0], rows[:stop, 1:]

    def _read(self, t: float) -> None:
        read = [self.rows]
        for first, begin, lines in self.file.blocks(self.begin, self.line):
            made, places, self.fault = self.file.numbers(first, lines, self.columns)
            self.begin, self.line = begin, first + len(lines)
            made[:, 0] = made[:, 0] * self.factor + self.offset
            falls = np.flatnonzero(np.diff(made[:, 0], prepend=self.last) < 0)
            if falls.size:
                self.fault = self._falls(made[: falls[0] + 1, 0], places[falls[0]])
                made = made[: falls[0]]
            read.append(made)
            self.last = float(made[-1, 0]) if made.size else self.last
            if self.fault is not None or self.last > t:
                break
        else:
            self.ended = True
        self.ended = self.ended or self.fault is not None
        self.rows = np.concatenate(read)

    def _falls(self, times: np.ndarray, line: int) -> InputError:
        before = float(times[-2]) if times.size > 1 else self.last
        shown = [QUANTITIES["time"].show(t, "s", 12) for t in (float(times[-1]), before)]
        said = f"the time falls back in the column {self.file.titles[self.columns[0]].name!r}"
        return InputError(f"{said}: {shown[0]} follows {shown[1]}; sort the rows", Place(self.file.shown, line))


@functools.lru_cache(maxsize=16)
def _recording(file: DataFile, time: int, columns: tuple[int, ...], written: tuple[int, int]) -> Recording:
    return Recording(file, time, columns)


def recording(file: DataFile, time: int, columns: Sequence[int]) -> Recording:
    """The recording of a file as it is now: runs one after another share what has been read."""
    try:
        facts = file.path.stat()
    except OSError as error:
        raise InputError(f"cannot read the data {file.path.name}: {error.strerror}") from None
    return _recording(file, time, tuple(columns), (facts.st_mtime_ns, facts.st_size))
