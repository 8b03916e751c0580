"""Files of series: netCDF, CSV and Parquet, written and read; the suffix chooses the format."""

from __future__ import annotations

import csv
import re
from pathlib import Path
from typing import Any

import numpy as np

from crescentlab.errors import InputError
from crescentlab.files import check_writable, replacing

SUFFIXES = (".nc", ".csv", ".parquet")
END = "end_of_run"
"""Attribute of a file that tells where its run stands, whole: what ``--start`` reads."""
NETS = "net_pressures"
"""Attribute of a file that names the pressures of the circuit's own nets, which a plot without names shows."""


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
