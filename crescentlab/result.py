"""Named, unit-carrying series of a run.

A result keeps times, states and held values; every other variable is evaluated from the circuit's own
equations when it is asked for. A file holds what was recorded, and says so.
"""

from __future__ import annotations

import dataclasses
import functools
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from crescentlab import __version__, arguments
from crescentlab.arguments import Number
from crescentlab.errors import InputError, nearest
from crescentlab.files import check_writable
from crescentlab.series_files import END, NETS, SUFFIXES, write_series
from crescentlab.units import DISPLAY, QUANTITIES, Quantity

if TYPE_CHECKING:
    import pandas
    import xarray

    from crescentlab.balance import Balance
    from crescentlab.elaborate import Design
    from crescentlab.solvers.trajectory import Trajectory
    from crescentlab.system import System, Values
    from crescentlab.verification import Verification


EVENTS = ("after", "both")
"""Which rows of an event's instant a table holds: the last one alone, or those before as well."""
SHOWN = 8
"""Most variables that a result's ``repr`` lists."""


class Result:
    """A run of a circuit. ``result["line.p"]`` is a numpy array in SI, one row per time.

    A variable that the run does not have raises :class:`InputError`; ``name in result`` asks, ``list(result)`` lists.
    """

    def __init__(self, system: System, values: Values, design: Design, trajectory: Trajectory) -> None:
        self.system, self.values, self.design, self.trajectory = system, values, design, trajectory
        self.title = design.netlist.sections.title or design.netlist.name
        self._rows = trajectory.shown.arrays()
        self._series: dict[str, np.ndarray] = {}
        self.verification: Verification | None = None
        """How far a run at a tenth of the tolerance is from this one, if that was asked for."""

    @property
    def time(self) -> np.ndarray:
        """Times [s], shape (m,); an event's time stands twice, before and after."""
        return self._rows[0]

    @property
    def names(self) -> list[str]:
        """Every variable that can be asked for."""
        return [name for name, v in self.system.variables.items() if v.listed]

    @property
    def status(self) -> str:
        """``done``, ``stopped`` (by stop_when), ``failed`` or ``interrupted``; of a .csv file ``unknown``."""
        return self.trajectory.status

    @property
    def warnings(self) -> list[str]:
        """What the circuit's text, the run and its ledgers warn of."""
        own = self.balance.warnings if self.balance else []
        apart = self.verification.warnings if self.verification else []
        return [*self.design.warnings, *self.trajectory.warnings, *own, *apart]

    @property
    def end(self) -> str | None:
        """Where the run stands, as text that another run can go on from; None if it failed."""
        end = self.trajectory.end
        return None if end is None else end.as_text(self.system)

    def __contains__(self, name: object) -> bool:
        """Whether there is a variable, or an element of one, of this name."""
        if not isinstance(name, str):
            return False
        base = split(name)[0]
        return base in self.names and (name == base or name in self.elements(base))

    def __iter__(self) -> Iterator[str]:
        """The names of all variables."""
        return iter(self.names)

    def __repr__(self) -> str:
        """Title, how it ended, span, and what can be asked for."""
        names, t = self.names, self.time
        span = f"{t[0]:g} s to {t[-1]:g} s" if t.size else "no time"
        more = f", ... {len(names) - SHOWN} more" if len(names) > SHOWN else ""
        first = [*self.net_pressures(), *names]
        shown = ", ".join(list(dict.fromkeys(n for n in first if n in names))[:SHOWN])
        title = self.title if len(self.title) <= 60 else f"{self.title[:57]}..."
        return (
            f"<Result {title!r}: {self.status}, {span}, {t.size} row{'' if t.size == 1 else 's'}, "
            f"{len(names)} variables: {shown}{more}>"
        )

    def summed_up(self) -> str:
        """The last values of the outputs and net pressures, the first few, in display units."""
        names = [o.name for o in self.design.outputs if o.scope == ""] + self.net_pressures()
        columns = [column for name in names for column in self.elements(name)] or self.column_names
        shown = [
            f"{n} {quantity.show(float(self[n][-1]) + 0.0, self.display_unit(quantity))}"
            for n, quantity in ((n, self.quantity(n)) for n in columns[:SHOWN])
        ]
        return ", ".join(shown) + (f", ... {len(columns) - SHOWN} more" if len(columns) > SHOWN else "")

    def quantity(self, name: str) -> Quantity:
        """The quantity of a variable or of one element of it."""
        return self.system.find(split(name)[0]).quantity

    def __getitem__(self, name: str) -> np.ndarray:
        """Series of a variable: shape (m,), for a vector (m, n); ``name[2]`` is one element (from 1)."""
        base, element = split(name)
        self.load([base])
        series = self._series[base]
        if element is None:
            return series if self.system.variables[base].vector else series[:, 0]
        if not 1 <= element <= series.shape[1]:
            raise InputError(f"{name}: {base} has {series.shape[1]} elements, counted from 1")
        return series[:, element - 1]

    def load(self, names: Iterable[str]) -> None:
        """Evaluate several variables at once (faster than one by one)."""
        missing = [n for n in dict.fromkeys(arguments.names(names, "variable")) if n not in self._series]
        if not missing:
            return
        sizes = [len(self.system.find(n).expression()) for n in missing]
        t, x, h, b = self._rows
        values = self.system.series(missing, t, x, h, b, self.values.p).T
        for name, part in zip(missing, np.split(values, np.cumsum(sizes)[:-1], axis=1), strict=True):
            self._series[name] = part

    @functools.cached_property
    def by_steps(self) -> Result:
        """The same run with a row for each accepted step and event, whatever its output grid."""
        if self.trajectory.grid is None:
            return self
        return Result(self.system, self.values, self.design, dataclasses.replace(self.trajectory, grid=None))

    def mean(self, name: str, start: Number = 0.0, stop: Number | None = None) -> float:
        """Mean over time between ``start`` and ``stop`` [s], trapezoidal between the accepted steps."""
        full = self.by_steps
        begin = arguments.quantity(start, "start", QUANTITIES["time"])
        end = math.inf if stop is None else arguments.quantity(stop, "stop", QUANTITIES["time"])
        inside = (full.time >= begin) & (full.time <= end)
        t, y = full.time[inside], full[name][inside]
        if not t.size:
            raise InputError(f"{name}: the run has no rows between {begin:g} s and {end:g} s")
        return float(np.trapezoid(y, t) / (t[-1] - t[0])) if t[-1] > t[0] else float(y[-1])

    @functools.cached_property
    def balance(self) -> Balance | None:
        """The ledgers of fluid and energy; None without parts that keep books, or where :attr:`unbalanced` says why."""
        from crescentlab.balance import balance

        if self.unbalanced:
            return None
        return balance(self.system, self.values, self.trajectory)

    @property
    def unbalanced(self) -> dict[str, str]:
        """Per component whose volumes do not follow its flows, why: no ledger of such a run can close."""
        why = {name: instance.component.unbalanced for name, instance in self.design.instances.items()}
        return {name: said for name, said in why.items() if said}

    # -- out -------------------------------------------------------------------------------------

    def columns(self, record: Sequence[str] = ()) -> dict[str, np.ndarray]:
        """Series by column name, vectors element by element, chosen by globs (``*`` and ``?`` only)."""
        names = self.chosen(record)
        self.load(dict.fromkeys(split(n)[0] for n in names))
        return {n: self[n] for n in names}

    @property
    def column_names(self) -> list[str]:
        """Names of the columns of files and tables, vectors element by element."""
        return column_names(self.system)

    def chosen(self, record: Sequence[str] = ()) -> list[str]:
        """Column names that match the globs, all of them without globs."""
        every, globs = self.column_names, arguments.names(record, "record")
        return matching(globs, every, "--record") if globs else every

    def elements(self, name: str) -> list[str]:
        """A variable's columns: itself, or for a vector each of its elements."""
        base, element = split(name)
        variable = self.system.find(base)
        if element is not None or not variable.vector:
            return [name]
        return [f"{name}[{k + 1}]" for k in range(len(variable.expression()))]

    def net_pressures(self) -> list[str]:
        """Pressures of the circuit's own hydraulic nets, those inside subcircuits left out."""
        nets = [
            net.name for net in self.design.nets if "." not in net.name and net.ports[0].port.domain.name == "hydraulic"
        ]
        return [f"{name}.p" for name in nets if f"{name}.p" in self.system.variables]

    def attributes(self) -> dict[str, Any]:
        """What a file says of its run."""
        t = self.trajectory
        return {
            "title": self.title, "source": f"crescentlab {__version__}", "circuit": self.design.netlist.name,
            "solver": t.solver, "status": t.status, "complete": int(t.complete), "error": t.error,
            NETS: ", ".join(self.net_pressures()),
            **({} if self.end is None else {END: self.end}),
        }  # fmt: skip

    def to_dataframe(self, record: str | Sequence[str] = (), *, events: str = "after") -> pandas.DataFrame:
        """A data frame indexed by time [s].

        An event's instant has one row, the values ``after`` it, so that the index is unique; with ``events="both"``
        it has a row for the values before as well, as ``result.time`` and files do.
        """
        import pandas as pd

        rows = self._table_rows(events)
        data = {name: series[rows] for name, series in self.columns(record).items()}
        return pd.DataFrame(data, index=pd.Index(self.time[rows], name="time"))

    def to_xarray(self, record: str | Sequence[str] = (), *, events: str = "after") -> xarray.Dataset:
        """A data set over the dimension time, units in the attributes; ``events`` as in :meth:`to_dataframe`."""
        import xarray as xr

        rows = self._table_rows(events)
        data = {n: ("time", v[rows], {"units": self.quantity(n).si}) for n, v in self.columns(record).items()}
        return xr.Dataset(data, coords={"time": ("time", self.time[rows], {"units": "s"})}, attrs=self.attributes())

    def _table_rows(self, events: str) -> np.ndarray:
        """The rows of a table, as a mask: all, or the last of each instant."""
        if arguments.choice(events, "events", EVENTS) == "both":
            return np.ones(self.time.size, dtype=bool)
        return np.append(np.diff(self.time) > 0, True)[: self.time.size]

    def write(self, path: Path | str, record: str | Sequence[str] = ()) -> None:
        """Write a file whose suffix chooses the format: .nc, .csv or .parquet; an event's instant has both its rows."""
        target = arguments.path(path, "path")
        check_writable(target, SUFFIXES, f"the suffix {target.suffix!r} is none of {', '.join(SUFFIXES)}")
        columns = self.columns(record)
        units = {n: self.quantity(n).si for n in columns}
        write_series(target, self.time, columns, units, self.attributes())

    def plot(self, *names: str, path: Path | str | None = None, title: str | None = None) -> Any:
        """A matplotlib figure of the variables over time, saved if ``path`` is given; without names the net pressures.

        Raises :class:`InputError` for what is no variable, and for a path that cannot be written.
        """
        from crescentlab.plotting import plot_series

        flat = [each for name in names for each in arguments.names(name, "plot")]
        if title is not None and not isinstance(title, str):
            raise InputError(f"plot: the title {title!r} is no text")
        return plot_series(self, flat, path=None if path is None else arguments.path(path, "path"), title=title)

    def display_unit(self, quantity: Quantity) -> str:
        """The unit that the circuit's ``display:`` shows a quantity in; by default the one engineers use."""
        chosen = {**DISPLAY, **self.design.netlist.sections.display}
        return chosen.get(quantity.name) or next(iter(quantity.units)) or quantity.si


def split(name: str) -> tuple[str, int | None]:
    """A column's variable, and which of its elements it is."""
    if not isinstance(name, str):
        raise InputError(f"{name!r} is no name of a variable; write for example result['line.p']")
    match = re.fullmatch(r"(.*)\[(\d+)\]", name)
    return (match[1], int(match[2])) if match else (name, None)


def column_names(system: System) -> list[str]:
    """Names of a result's columns, vectors element by element."""
    names: list[str] = []
    for name, variable in system.variables.items():
        if variable.listed:
            names += [f"{name}[{k + 1}]" for k in range(len(variable.expression()))] if variable.vector else [name]
    return names


def check_record(system: System, record: Sequence[str]) -> None:
    """Refuse globs that match nothing, before the run."""
    if record:
        matching(record, column_names(system), "--record")


def matching(globs: Sequence[str], names: Sequence[str], subject: str) -> list[str]:
    """The names that match the globs, in the globs' order.

    Only ``*`` and ``?`` are wild, ``[2]`` is literal; a vector's name means all its elements.
    """
    chosen: dict[str, None] = {}
    for glob in globs:
        wild = "".join(".*" if c == "*" else "." if c == "?" else re.escape(c) for c in glob)
        exact, whole = re.compile(rf"{wild}\Z"), re.compile(rf"{wild}(\[\d+\])?\Z")
        hits = [n for n in names if exact.match(n)] or [n for n in names if whole.match(n)]
        if not hits:
            raise InputError(f"{subject} {glob}: no variable matches: {nearest(glob, names)}")
        chosen.update(dict.fromkeys(hits))
    return list(chosen)
