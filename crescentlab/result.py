"""Named, unit-carrying series of a run; netCDF, CSV and Parquet files of them.

A result keeps times, states and held values; every other variable is evaluated from the circuit's own
equations when it is asked for. A file holds what was recorded, and says so.
"""

from __future__ import annotations

import csv
import dataclasses
import functools
import math
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from crescentlab import __version__
from crescentlab.errors import InputError, nearest
from crescentlab.files import check_writable, replacing
from crescentlab.units import DISPLAY, Quantity

if TYPE_CHECKING:
    import pandas
    import xarray

    from crescentlab.balance import Balance
    from crescentlab.elaborate import Design
    from crescentlab.solvers.trajectory import Trajectory
    from crescentlab.system import System, Values

SUFFIXES = (".nc", ".csv", ".parquet")
END = "end_of_run"
"""Attribute of a file that tells where its run stands, whole: what ``--start`` reads."""


class Result:
    """A run of a circuit. ``result["line.p"]`` is a numpy array in SI, one row per time."""

    def __init__(self, system: System, values: Values, design: Design, trajectory: Trajectory) -> None:
        self.system, self.values, self.design, self.trajectory = system, values, design, trajectory
        self.title = design.netlist.sections.title or design.netlist.name
        self._rows = trajectory.shown.arrays()
        self._series: dict[str, np.ndarray] = {}

    @property
    def time(self) -> np.ndarray:
        """Times [s], shape (m,); an event's time stands twice, before and after."""
        return self._rows[0]

    @property
    def names(self) -> list[str]:
        """Every variable that can be asked for."""
        return [name for name, v in self.system.variables.items() if v.listed]

    def quantity(self, name: str) -> Quantity:
        """The quantity of a variable or of one element of it."""
        return self.system.find(_split(name)[0]).quantity

    def __getitem__(self, name: str) -> np.ndarray:
        """Series of a variable: shape (m,), for a vector (m, n); ``name[2]`` is one element (from 1)."""
        base, element = _split(name)
        self.load([base])
        series = self._series[base]
        if element is None:
            return series if self.system.variables[base].vector else series[:, 0]
        if not 1 <= element <= series.shape[1]:
            raise InputError(f"{name}: {base} has {series.shape[1]} elements, counted from 1")
        return series[:, element - 1]

    def load(self, names: Iterable[str]) -> None:
        """Evaluate several variables at once (faster than one by one)."""
        missing = [n for n in dict.fromkeys(names) if n not in self._series]
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

    def mean(self, name: str, start: float = 0.0, stop: float = math.inf) -> float:
        """Mean over time between ``start`` and ``stop`` [s], trapezoidal between the accepted steps."""
        full = self.by_steps
        inside = (full.time >= start) & (full.time <= stop)
        t, y = full.time[inside], full[name][inside]
        if not t.size:
            raise InputError(f"{name}: the run has no rows between {start:g} s and {stop:g} s")
        return float(np.trapezoid(y, t) / (t[-1] - t[0])) if t[-1] > t[0] else float(y[-1])

    @functools.cached_property
    def balance(self) -> Balance | None:
        """The ledger of stored fluid; None with mean volumes or without storing parts."""
        from crescentlab.balance import balance

        if any(getattr(i.component, "volumes", "") == "mean" for i in self.design.instances.values()):
            return None
        return balance(self.system, self.values, self.trajectory)

    # -- out -------------------------------------------------------------------------------------

    def columns(self, record: Sequence[str] = ()) -> dict[str, np.ndarray]:
        """Series by column name, vectors element by element, chosen by globs (``*`` and ``?`` only)."""
        names = self.chosen(record)
        self.load(dict.fromkeys(_split(n)[0] for n in names))
        return {n: self[n] for n in names}

    def chosen(self, record: Sequence[str] = ()) -> list[str]:
        """Column names that match the globs, all of them without globs."""
        every = column_names(self.system)
        return matching(record, every, "--record") if record else every

    def elements(self, name: str) -> list[str]:
        """A variable's columns: itself, or for a vector each of its elements."""
        base, element = _split(name)
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
            **({} if t.end is None else {END: t.end.as_text(self.system)}),
        }  # fmt: skip

    def to_dataframe(self, record: Sequence[str] = ()) -> pandas.DataFrame:
        """A data frame indexed by time [s]."""
        import pandas as pd

        return pd.DataFrame(self.columns(record), index=pd.Index(self.time, name="time"))

    def to_xarray(self, record: Sequence[str] = ()) -> xarray.Dataset:
        """A data set over the dimension time, units in the attributes."""
        import xarray as xr

        data = {n: ("time", v, {"units": self.quantity(n).si}) for n, v in self.columns(record).items()}
        return xr.Dataset(data, coords={"time": ("time", self.time, {"units": "s"})}, attrs=self.attributes())

    def write(self, path: Path, record: Sequence[str] = ()) -> None:
        """Write a file whose suffix chooses the format: .nc, .csv or .parquet."""
        columns = self.columns(record)
        units = {n: self.quantity(n).si for n in columns}
        write_series(path, self.time, columns, units, self.attributes())

    def plot(self, *names: str, path: Path | str | None = None, title: str | None = None) -> Any:
        """A matplotlib figure of the variables over time, saved if ``path`` is given."""
        from crescentlab.plotting import plot_series

        return plot_series(self, list(names), path=Path(path) if path else None, title=title)

    def display_unit(self, quantity: Quantity) -> str:
        """The unit that the circuit's ``display:`` shows a quantity in; by default the one engineers use."""
        chosen = {**DISPLAY, **self.design.netlist.sections.display}
        return chosen.get(quantity.name) or next(iter(quantity.units)) or quantity.si


def _split(name: str) -> tuple[str, int | None]:
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


def result_target(output: str | None, name: str) -> Path | None:
    """The file that ``-o`` names, by default ``name``.nc, checked before the run; None for ``-o none``."""
    if output == "none":
        return None
    path = Path(output or f"{name}.nc")
    check_writable(
        path, SUFFIXES,
        f"the suffix {path.suffix!r} is none of {', '.join(SUFFIXES)}; write for example -o {path.stem or 'result'}.nc",
    )  # fmt: skip
    return path


def write_series(
    path: Path, time: np.ndarray, columns: dict[str, np.ndarray], units: dict[str, str], attributes: dict[str, Any]
) -> None:
    """Write series to a file; the suffix chooses the format. An old file is replaced when the new one is complete."""
    with replacing(path) as part:
        _WRITERS[path.suffix](part, time, columns, units, attributes)


def _write_csv(
    path: Path, time: np.ndarray, columns: dict[str, np.ndarray], units: dict[str, str], attributes: dict[str, Any]
) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["time [s]", *[f"{n} [{units[n]}]" for n in columns]])
        for row in zip(time.tolist(), *[v.tolist() for v in columns.values()], strict=True):
            writer.writerow([repr(v) for v in row])


def _write_parquet(
    path: Path, time: np.ndarray, columns: dict[str, np.ndarray], units: dict[str, str], attributes: dict[str, Any]
) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    fields = [pa.field("time", pa.float64(), metadata={"units": "s"})]
    fields += [pa.field(n, pa.float64(), metadata={"units": units[n]}) for n in columns]
    schema = pa.schema(fields, metadata={k: str(v) for k, v in attributes.items()})
    pq.write_table(pa.table([time, *columns.values()], schema=schema), path)


def _write_netcdf(
    path: Path, time: np.ndarray, columns: dict[str, np.ndarray], units: dict[str, str], attributes: dict[str, Any]
) -> None:
    """netCDF4 as h5netcdf lays it out, but with the list of all variables of the time axis written once.

    Attached one by one, n variables rewrite that list n times: 128 MB of waste in a file of 4000 variables.
    """
    import h5py

    with h5py.File(path, "w", track_order=True) as file:
        if END in attributes:  # too long for an attribute of netCDF
            file.create_dataset(END, data=attributes.pop(END), dtype=h5py.string_dtype())
        file.attrs.update(attributes)
        axis = file.create_dataset("time", data=time)
        axis.make_scale("time")
        axis.attrs.update({"units": "s", "_Netcdf4Dimid": np.int32(0)})
        of_axis = np.empty(1, dtype=object)
        of_axis[0] = np.array([axis.ref], dtype=h5py.ref_dtype)
        users = []
        for name, series in columns.items():
            variable = file.create_dataset(name, data=series)
            variable.attrs["units"] = units[name]
            variable.attrs.create("DIMENSION_LIST", of_axis, dtype=h5py.vlen_dtype(h5py.ref_dtype))
            users.append((variable.ref, 0))
        if users:
            pair = np.dtype([("dataset", h5py.ref_dtype), ("dimension", np.int32)])
            axis.attrs.create("REFERENCE_LIST", np.array(users, dtype=pair))


_WRITERS = {".csv": _write_csv, ".parquet": _write_parquet, ".nc": _write_netcdf}


def read_series(path: Path) -> tuple[np.ndarray, dict[str, np.ndarray], dict[str, str], dict[str, Any]]:
    """Read a result file back: times, series, units, attributes. Raises :class:`InputError`."""
    if path.suffix not in SUFFIXES:
        raise InputError(f"{path}: not a result file; its suffix must be one of {', '.join(SUFFIXES)}")
    if not path.is_file():
        raise InputError(f"{path}: no such file; `crescentlab simulate` writes one")
    try:
        return {".csv": _read_csv, ".parquet": _read_parquet, ".nc": _read_netcdf}[path.suffix](path)
    except (OSError, ValueError, KeyError) as error:
        raise InputError(f"{path}: not a result file of crescentlab ({error})") from None


def _read_csv(path: Path) -> tuple[np.ndarray, dict[str, np.ndarray], dict[str, str], dict[str, Any]]:
    with path.open(newline="", encoding="utf-8") as file:
        titles, *rows = list(csv.reader(file)) or [[]]
    split = [re.fullmatch(r"(.*) \[(.*)\]", t) for t in titles]
    if not rows or not all(split) or titles[0] != "time [s]":
        raise ValueError("its first line is not `time [s]` and names with units")
    units = {m[1]: m[2] for m in split if m}
    time, *series = np.array(rows, dtype=float).T
    return time, dict(zip(list(units)[1:], series, strict=True)), units, {}


def _read_parquet(path: Path) -> tuple[np.ndarray, dict[str, np.ndarray], dict[str, str], dict[str, Any]]:
    import pyarrow.parquet as pq

    table = pq.read_table(path)
    units = {f.name: (f.metadata or {}).get(b"units", b"").decode() for f in table.schema}
    series = {n: table[n].to_numpy() for n in table.column_names}
    attributes = {k.decode(): v.decode() for k, v in (table.schema.metadata or {}).items()}
    return series.pop("time"), series, units, attributes


def _read_netcdf(path: Path) -> tuple[np.ndarray, dict[str, np.ndarray], dict[str, str], dict[str, Any]]:
    import h5py

    with h5py.File(path, "r") as file:
        attributes = {k: v.item() if hasattr(v, "item") else v for k, v in file.attrs.items() if k[0] != "_"}
        if END in file:
            attributes[END] = file[END][()].decode()
        series = {n: np.array(v) for n, v in file.items() if n != END}
        units = {n: str(file[n].attrs.get("units", "")) for n in series}
    return series.pop("time"), series, units, attributes
