"""A result read back from its file: what a run gives, as far as the file holds it."""

from __future__ import annotations

import functools
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from crescentlab import arguments
from crescentlab.errors import InputError, nearest
from crescentlab.result import Result, split
from crescentlab.series_files import END, NETS, read_series
from crescentlab.units import DISPLAY, Quantity, quantity_of_si

NOT_HELD = ("system", "values", "design", "trajectory")
"""What a run has besides: the circuit it was of, and the solver's own record."""


def read(path: str | Path) -> Recorded:
    """The result in a .nc, .parquet or .csv file that a run has written.

    It is a :class:`Result` of the rows and variables that were recorded, in SI: series, means, tables, plots, spectra,
    and ``start=`` of another run, where the file says how its own ended (.nc and .parquet do). What only a run knows
    (ledgers, outcomes on the solver's own interpolant) raises :class:`InputError`, and so does what is no such file.
    """
    return Recorded(arguments.path(path, "path"))


class Recorded(Result):
    """A result that was read from ``path``; see :func:`read`."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._time, self._columns, self.units, self._attributes = read_series(path)
        self.title = str(self._attributes.get("title") or path.stem)
        self._elements = _vectors(self._columns)

    def _refuse(self, what: str) -> NoReturn:
        raise InputError(
            f"{self.path}: a file holds rows of variables, not the {what} of its run; simulate the circuit again"
        )

    def __getattr__(self, name: str) -> Any:
        if name in NOT_HELD:
            self._refuse({"system": "equations", "trajectory": "own steps", "design": "circuit"}.get(name, name))
        raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")

    @property
    def time(self) -> np.ndarray:
        """Times [s], shape (m,), as they were written."""
        return self._time

    @property
    def names(self) -> list[str]:
        """Every variable that the file holds whole, and the elements of those that it does not."""
        inside = {column for columns in self._elements.values() for column in columns}
        firsts = {columns[0]: name for name, columns in self._elements.items()}
        return [firsts.get(column, column) for column in self._columns if column in firsts or column not in inside]

    @property
    def column_names(self) -> list[str]:
        """Names of the file's columns."""
        return list(self._columns)

    @property
    def status(self) -> str:
        """How the run ended; ``unknown`` of a .csv file."""
        return str(self._attributes.get("status", "unknown"))

    @property
    def warnings(self) -> list[str]:
        """A file keeps the reason why its run failed, and no warnings."""
        return [str(self._attributes["error"])] if self._attributes.get("error") else []

    @property
    def end(self) -> str | None:
        """Where the run stood, if the file tells."""
        return self._attributes.get(END)

    @property
    def by_steps(self) -> Result:
        """The rows that there are."""
        return self

    @functools.cached_property
    def balance(self) -> NoReturn:
        """Not in a file."""
        self._refuse("ledgers")

    @property
    def unbalanced(self) -> dict[str, str]:
        """Not in a file."""
        self._refuse("ledgers")

    def load(self, names: Iterable[str]) -> None:
        """Everything is there already; refuses names that the file does not hold."""
        for name in arguments.names(names, "variable"):
            self.elements(name)

    def elements(self, name: str) -> list[str]:
        """A variable's columns: itself, or for a vector each of its elements."""
        if name in self._columns:
            return [name]
        if name in self._elements:
            return self._elements[name]
        base, element = split(name)
        if element is not None and base in self._elements:
            raise InputError(f"{name}: {base} has {len(self._elements[base])} elements, counted from 1")
        near = nearest(name, [*self._columns, *self._elements])
        raise InputError(f"{self.path}: no variable {name!r} was recorded: {near}")

    def quantity(self, name: str) -> Quantity:
        """The quantity of a variable, by the unit in the file."""
        return quantity_of_si(self.units.get(self.elements(name)[0], ""))

    def __getitem__(self, name: str) -> np.ndarray:
        """Series of a variable: shape (m,), for a vector (m, n); ``name[2]`` is one element (from 1)."""
        columns = self.elements(name) if isinstance(name, str) else self.elements(split(name)[0])
        if columns == [name]:
            return self._columns[name]
        return np.stack([self._columns[column] for column in columns], axis=1)

    def net_pressures(self) -> list[str]:
        """Pressures of the circuit's own nets, if the file names them."""
        named = str(self._attributes.get(NETS, "")).split(", ")
        return [name for name in named if name in self._columns or name in self._elements]

    def attributes(self) -> dict[str, Any]:
        """What the file says of its run."""
        return dict(self._attributes)

    def display_unit(self, quantity: Quantity) -> str:
        """The unit engineers use for a quantity; a file does not hold the circuit's ``display:``."""
        return DISPLAY.get(quantity.name) or next(iter(quantity.units), "") or quantity.si


def _vectors(columns: dict[str, np.ndarray]) -> dict[str, list[str]]:
    """Vectors of which every element from 1 on is there, by name."""
    found: dict[str, dict[int, str]] = {}
    for column in columns:
        base, element = split(column)
        if element is not None:
            found.setdefault(base, {})[element] = column
    return {
        base: [elements[k] for k in sorted(elements)]
        for base, elements in found.items()
        if sorted(elements) == list(range(1, len(elements) + 1))
    }
