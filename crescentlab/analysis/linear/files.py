"""Linear models and frequency responses as JSON and CSV, all numbers in SI, but phases in deg."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from crescentlab.analysis.linear.frequency import Responses, Transfer
from crescentlab.analysis.linear.modes import Mode
from crescentlab.files import check_writable, write_rows, write_text

Array = np.ndarray

UNITS = {"Hz": 2 * math.pi, "rad/s": 1.0}
"""Units of frequency axes, and their size in rad/s."""
SUFFIXES = (".csv", ".json")


def check_linear_target(path: Path) -> None:
    """Refuse an output file that cannot be written, before the work."""
    said = f"the suffix {path.suffix!r} is none of .csv, .json; write {path.stem or 'x'}.csv"
    check_writable(path, SUFFIXES, said)


def gain_unit(transfer: Transfer) -> str:
    """The SI unit of a transfer: ``Pa/(m^3/s)``, or 1 for two of a kind."""
    return ratio_unit(transfer.of.si, transfer.per.si)


def ratio_unit(above: str, below: str) -> str:
    """``above`` over ``below`` as text."""
    if above == below:
        return "1"
    if below == "1":
        return above
    return f"{above}/({below})" if any(c in below for c in "/ ") else f"{above}/{below}"


def document(found: Responses, title: str, unit: str) -> dict[str, Any]:
    """Everything as one object; complex numbers as their real and imaginary parts."""
    m = found.model
    return {
        "title": title,
        "operating_point": {"time": m.at.t, "residual": m.residual},
        "tick_period": m.period,
        "states": [{"name": n, "unit": q.si} for n, q in zip(m.states, m.quantities, strict=True)],
        "still": list(m.still),
        "inputs": [{"name": u.name, "unit": u.quantity.si} for u in m.inputs],
        "outputs": [{"name": y.name, "unit": y.quantity.si} for y in m.outputs],
        "A": m.A.tolist(), "B": m.B.tolist(), "C": m.C.tolist(), "D": m.D.tolist(),
        "modes": [mode_object(mode) for mode in found.modes],
        "frequency_unit": unit,
        "frequencies": (found.omega / UNITS[unit]).tolist() if found.transfers else [],
        "transfers": [_transfer(t) for t in found.transfers],
        "exact_lines": [
            {"name": line.name, "mean_pressure": line.p_mean, "mean_flow": line.q_mean} for line in found.lines
        ],
    }  # fmt: skip


def mode_object(mode: Mode) -> dict[str, Any]:
    """One mode; frequencies in Hz, times in s."""
    return {
        "real": mode.eigenvalue.real, "imaginary": mode.eigenvalue.imag,
        "frequency_hz": mode.damped_frequency / (2 * math.pi),
        "natural_frequency_hz": mode.natural_frequency / (2 * math.pi),
        "damping_ratio": _finite(mode.damping_ratio), "time_constant": _finite(mode.time_constant),
        "stable": mode.stable,
        "participation": mode.participation,
    }  # fmt: skip


def _transfer(t: Transfer) -> dict[str, Any]:
    made: dict[str, Any] = {
        "name": t.name, "output": t.output, "input": t.input, "unit": gain_unit(t), "impedance": t.impedance,
        "real": t.value.real.tolist(), "imaginary": t.value.imag.tolist(),
    }  # fmt: skip
    if t.exact is not None:
        made |= {"exact_real": t.exact.real.tolist(), "exact_imaginary": t.exact.imag.tolist()}
    return made


def write(found: Responses, made: dict[str, Any], path: Path, unit: str) -> list[Path]:
    """Write one JSON file, or CSV files: the response, the modes, and each matrix. Returns the files.

    ``FILE.csv`` holds the response, or the modes where no response was asked for; beside it ``FILE-modes.csv`` and
    ``FILE-A.csv`` to ``FILE-D.csv``.
    """
    if path.suffix == ".json":
        write_text(path, json.dumps(made, indent=1, allow_nan=False) + "\n")
        return [path]
    m = found.model
    states, inputs = list(m.states), [u.name for u in m.inputs]
    tables = [("modes", _modes(found.modes)), ("A", _matrix(m.A, states, states))]
    if inputs:
        tables.append(("B", _matrix(m.B, states, inputs)))
    if m.outputs:
        tables.append(("C", _matrix(m.C, [y.name for y in m.outputs], states)))
    if inputs and m.outputs:
        tables.append(("D", _matrix(m.D, [y.name for y in m.outputs], inputs)))
    if found.transfers:
        tables.insert(0, ("", response_rows(found, unit)))
    else:
        tables[0] = ("", tables[0][1])
    written: list[Path] = []
    for name, rows in tables:
        written.append(path.with_name(f"{path.stem}-{name}.csv") if name else path)
        write_rows(written[-1], rows)
    return written


def response_rows(found: Responses, unit: str) -> list[list[Any]]:
    """Header and rows of the response: frequency, then magnitude and phase [deg] of each transfer, model and exact."""
    titles = [f"frequency [{unit}]" if unit == "Hz" else f"angular frequency [{unit}]"]
    columns: list[Array] = [found.omega / UNITS[unit]]
    for t in found.transfers:
        for what, values in (("", t.value), (" exact", t.exact)):
            if values is not None:
                titles += [f"{t.name}{what} magnitude [{gain_unit(t)}]", f"{t.name}{what} phase [deg]"]
                columns += [np.abs(values), phase(values)]
    return [titles, *[list(row) for row in zip(*[c.tolist() for c in columns], strict=True)]]


def phase(values: Array) -> Array:
    """Phase [deg] without jumps over frequency, beginning within half a turn of zero."""
    return np.asarray(np.degrees(np.unwrap(np.angle(values))))


def _modes(found: Sequence[Mode]) -> list[list[Any]]:
    titles = ["real [1/s]", "imaginary [rad/s]", "frequency [Hz]", "damping ratio [1]", "time constant [s]", "states"]
    return [titles] + [
        [m.eigenvalue.real, m.eigenvalue.imag, m.damped_frequency / (2 * math.pi), _finite(m.damping_ratio),
         _finite(m.time_constant), "; ".join(f"{n} {v:.3f}" for n, v in m.participation.items() if v >= 5e-4)]
        for m in found
    ]  # fmt: skip


def _finite(value: float) -> float | None:
    """Nothing where there is no number: null in JSON, an empty cell in CSV."""
    return value if math.isfinite(value) else None


def _matrix(values: Array, rows: Sequence[str], columns: Sequence[str]) -> list[list[Any]]:
    return [["", *columns], *[[name, *row] for name, row in zip(rows, values.tolist(), strict=True)]]
