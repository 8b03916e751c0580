"""Pictures of a study's table: curves, tornado, scatter matrix, distribution; as PNG and SVG beside the rows."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from crescentlab.plotting import save_figure
from crescentlab.studies.drawing import Column, bar_chart, curves, distributions, scatter_matrix
from crescentlab.studies.planning import Planned
from crescentlab.studies.points import DONE
from crescentlab.studies.store import Row
from crescentlab.studies.study_file import SAMPLES, CurvesSection, PlotSection
from crescentlab.studies.tables import effects, numbers, shown, units
from crescentlab.units import normalise

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMATS = (".png", ".svg")
MOST = 6
"""Most columns of a picture that nobody asked for."""


def write_pictures(planned: Planned, rows: Sequence[Row], folder: Path) -> list[Path]:
    """Write the study's pictures, or, if it asks for none, those that suit what varies."""
    written: list[Path] = []
    for old in folder.glob("picture-*"):
        if old.suffix in FORMATS:
            old.unlink()
    if not any(row["status"] == DONE for row in rows):
        return written
    for number, plot in enumerate(planned.study.sections.plots or suitable(planned), start=1):
        kind = next(k for k in ("curves", "tornado", "scatter", "distribution") if getattr(plot, k) is not None)
        figure = _DRAWN[kind](planned, rows, plot)
        for suffix in FORMATS:
            written.append(folder / f"picture-{number}-{kind}{suffix}")
            save_figure(figure, written[-1])
    return written


def suitable(planned: Planned) -> list[PlotSection]:
    """Pictures that suit what varies: effects of tolerances, spreads of samples, curves of a grid."""
    vary = planned.study.sections.vary
    measures = list(planned.measures)[:MOST]
    if vary.one_at_a_time:
        return [PlotSection(tornado=measures)]
    if any(getattr(vary, kind) for kind in SAMPLES):
        numeric = [name for name in planned.quantities if planned.quantity(name) is not None]
        columns = [*numeric, *planned.measures]
        return [PlotSection(distribution=measures), *([PlotSection(scatter=columns)] if len(columns) <= MOST else [])]
    values = {name: {point.settings[name] for point in planned.points} for name in vary.grid}
    axes = [name for name in values if planned.quantity(name) is not None and len(values[name]) > 1]
    if not axes:
        return []
    x = max(axes, key=lambda name: len(values[name]))
    by = next((name for name in values if name != x and len(values[name]) > 1), None)
    return [PlotSection(curves=CurvesSection(x=x, y=measures, by=by))]


def column(planned: Planned, rows: Sequence[Row], name: str) -> Column:
    """A column in its display unit."""
    quantity, unit = planned.quantity(name), units(planned)[name]
    assert quantity is not None  # as the plan has checked
    offset = quantity.offsets.get(normalise(unit), 0.0)
    return Column(name, unit, (numbers(rows, name) - offset) / quantity.factor(unit))


def _title(planned: Planned, plot: PlotSection) -> str:
    return plot.title or planned.study.sections.title or planned.study.name


def _curves(planned: Planned, rows: Sequence[Row], plot: PlotSection) -> Figure:
    asked = plot.curves
    assert asked is not None
    groups: dict[str, list[int]] = {}
    for k, row in enumerate(rows):
        groups.setdefault("" if asked.by is None else _value(planned, asked.by, row[asked.by]), []).append(k)
    x = column(planned, rows, asked.x)
    if asked.x in planned.quantities:  # an outcome may turn back, so its curve follows the points
        groups = {name: sorted(members, key=x.values.__getitem__) for name, members in groups.items()}
    sound = np.array([row["status"] == DONE for row in rows])
    y = [column(planned, rows, name) for name in asked.y]
    return curves(_title(planned, plot), x, y, groups, asked.by or "", sound)


def _value(planned: Planned, name: str, value: Any) -> str:
    """A varied setting's value as a legend shows it."""
    unit = units(planned)[name]
    return f"{shown(value, planned.quantity(name), unit, 4)} {unit if unit != '1' else ''}".strip() or "none"


def _tornado(planned: Planned, rows: Sequence[Row], plot: PlotSection) -> Figure:
    assert plot.tornado is not None
    bars = []
    for measure in plot.tornado:
        quantity, unit = planned.measures[measure], units(planned)[measure]
        found = [each for each in effects(planned, rows, measure) if not all(map(math.isnan, each[1:]))]
        factor = quantity.factor(unit)
        bars.append((measure, unit, [(name, low / factor, high / factor) for name, low, high in found]))
    return bar_chart(_title(planned, plot), bars)


def _scatter(planned: Planned, rows: Sequence[Row], plot: PlotSection) -> Figure:
    assert plot.scatter is not None
    good = [row for row in rows if row["status"] == DONE]
    return scatter_matrix(_title(planned, plot), [column(planned, good, name) for name in plot.scatter])


def _distribution(planned: Planned, rows: Sequence[Row], plot: PlotSection) -> Figure:
    assert plot.distribution is not None
    good = [row for row in rows if row["status"] == DONE]
    return distributions(_title(planned, plot), [column(planned, good, name) for name in plot.distribution])


_DRAWN: dict[str, Callable[[Planned, Sequence[Row], PlotSection], Any]] = {
    "curves": _curves, "tornado": _tornado, "scatter": _scatter, "distribution": _distribution,
}  # fmt: skip
