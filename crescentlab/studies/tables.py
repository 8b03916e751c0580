"""The table of a study: as text in display units, as CSV and Parquet in SI, and what its samples come to."""

from __future__ import annotations

import csv
import os
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from crescentlab.studies.planning import Planned
from crescentlab.studies.store import Row, columns, write_parquet
from crescentlab.units import Quantity

SHOWN = 40
"""Most rows of a table on the terminal."""
SHARES = (0.05, 0.5, 0.95)
"""Quantiles told of samples."""
LEAST = 8
"""Fewer rows than this have no statistics worth telling."""

Cells = tuple[str, ...]


def shown(value: object, quantity: Quantity | None, unit: str, digits: int = 5) -> str:
    """A cell: a word, or a number in its display unit without it; nothing where there is none."""
    if value is None:
        return ""
    if quantity is None or not isinstance(value, (int, float)):
        return str(value)
    text = quantity.show(float(value), unit, digits)
    return text.removesuffix(unit).rstrip() if unit else text


def units(planned: Planned) -> dict[str, str]:
    """Display unit of each varied setting and outcome; words have none."""
    quantities = {**planned.quantities, **planned.measures}
    return {name: planned.unit(q) if q is not None else "" for name, q in quantities.items()}


def heading(name: str, unit: str) -> str:
    """``speed [rpm]``; pure numbers have no unit."""
    return name if unit in ("", "1") else f"{name} [{unit}]"


def text_rows(planned: Planned, rows: Sequence[Row]) -> list[Cells]:
    """The table as cells, its heading first; a column says what became of a point if any did not go well."""
    named = units(planned)
    roles = any(row.get("role") for row in rows)
    troubled = any(row["status"] != "done" for row in rows)
    made: list[Cells] = [
        ("point", *(("role",) if roles else ()), *(heading(n, u) for n, u in named.items()),
         *(("status", "reason") if troubled else ()))
    ]  # fmt: skip
    for row in rows[:SHOWN]:
        cells = [shown(row[name], planned.quantity(name), unit) for name, unit in named.items()]
        role = (str(row.get("role", "")),) if roles else ()
        made.append((str(row["point"]), *role, *cells, *((row["status"], row["reason"]) if troubled else ())))
    return made


def right_columns(planned: Planned, names: Iterable[str], roles: bool) -> list[int]:
    """Places of the columns that end flush, numbers, after the point's number and perhaps its role."""
    return [0] + [1 + roles + k for k, name in enumerate(names) if planned.quantity(name) is not None]


def numbers(rows: Sequence[Row], name: str) -> np.ndarray:
    """A column's numbers, shape (rows,), NaN where there is none."""
    return np.array([np.nan if row[name] is None else row[name] for row in rows], dtype=float)


def statistics(planned: Planned, rows: Sequence[Row]) -> list[Cells]:
    """Mean, standard deviation and quantiles of every outcome over the samples; nothing without samples."""
    vary = planned.study.sections.vary
    good = [row for row in rows if row["status"] == "done"]
    if not (vary.latin_hypercube or vary.sobol or vary.monte_carlo) or len(good) < LEAST:
        return []
    named = units(planned)
    made: list[Cells] = [("", "mean", "sd", *(f"{share:.0%}".replace("%", " %") for share in SHARES), "min", "max")]
    for name, quantity in planned.measures.items():
        y, unit = numbers(good, name), named[name]
        spread = float(y.std(ddof=1)) / quantity.factor(unit)
        cells = [shown(float(v), quantity, unit) for v in (*np.quantile(y, SHARES), y.min(), y.max())]
        made.append((heading(name, unit), shown(float(y.mean()), quantity, unit), f"{spread:.5g}", *cells))
    return made


def effects(planned: Planned, rows: Sequence[Row], measure: str) -> list[tuple[str, float, float]]:
    """What each setting's low and high end alone does to an outcome [SI], the largest span first.

    Means over whatever else varies: each end is compared with the nominal point of the same other settings.
    """
    names = list(planned.study.sections.vary.one_at_a_time)
    others = [name for name in planned.quantities if name not in names]
    nominal: dict[tuple[object, ...], float] = {}
    changes: dict[tuple[str, str], list[float]] = {}
    parts = {row["point"]: str(row.get("role", "")).split(", ") for row in rows}
    usable = [row for row in rows if row[measure] is not None]
    for row in usable:
        if "nominal" in parts[row["point"]]:
            nominal[tuple(row[name] for name in others)] = row[measure]
    for row in usable:
        base = nominal.get(tuple(row[name] for name in others))
        for name in names:
            for sign in ("low", "high"):
                if base is not None and f"{name} {sign}" in parts[row["point"]]:
                    changes.setdefault((name, sign), []).append(row[measure] - base)
    found = [
        (
            name,
            float(np.mean(changes.get((name, "low"), [np.nan]))),
            float(np.mean(changes.get((name, "high"), [np.nan]))),
        )
        for name in names
    ]
    return sorted(found, key=lambda each: -np.nanmax(np.abs([*each[1:], 0.0])))


def effect_rows(planned: Planned, rows: Sequence[Row]) -> list[Cells]:
    """Effects of one-at-a-time tolerances as cells: outcome, setting, change at its low and at its high end."""
    if not planned.study.sections.vary.one_at_a_time:
        return []
    named = units(planned)
    made: list[Cells] = [("effect on", "of", "low", "high")]
    for measure, quantity in planned.measures.items():
        factor = quantity.factor(named[measure])
        for name, low, high in effects(planned, rows, measure):
            made.append((heading(measure, named[measure]), name, _change(low / factor), _change(high / factor)))
    return made


def _change(value: float) -> str:
    """A signed cell; a dash where a point that it needs did not go well."""
    return "-" if np.isnan(value) else f"{value:+.4g}"


def write_table(folder: Path, planned: Planned, rows: Sequence[Row]) -> list[Path]:
    """Write ``table.csv`` (columns ``name [SI unit]``) and ``table.parquet``; return both."""
    si = {**columns(planned), "wall_s": "s", "final_time": "s"}
    names = [name for name in rows[0] if name != "settings"] if rows else []
    path = folder / "table.csv"
    part = folder / ".table.csv"
    with part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([f"{name} [{si[name]}]" if si.get(name) else name for name in names])
        for row in rows:
            cells = [row[name] for name in names]
            writer.writerow(["" if v is None else repr(v) if isinstance(v, float) else v for v in cells])
    os.replace(part, path)
    write_parquet(folder / "table.parquet", rows, planned, {"study": planned.study.name})
    return [path, folder / "table.parquet"]
