"""Pictures of a fit: one for each measured column, with the residuals from all sides. Never a window."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.stats import probplot

from crescentlab.plotting import COLOURS, STYLE, save_figure
from crescentlab.studies.fit_problem import TIME, Measured
from crescentlab.studies.fit_report import Fit
from crescentlab.units import normalise

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BAND = 2.0
"""Standard deviations within which about 95 % of the residuals lie."""
DECADES = 100.0

Array = np.ndarray


def write_pictures(found: Fit, base: Path) -> list[Path]:
    """Write ``<base>-<column>.png`` for each measured column."""
    paths: list[Path] = []
    for number, each in enumerate(found.problem.measured):
        of = (found.problem.data.column == number) & found.fitted.active
        if not of.any():
            continue
        column = re.sub(r"[^\w-]+", "_", each.name)
        paths.append(base.with_name(f"{base.name}-{column}.png"))
        save_figure(picture(found, number), paths[-1])
    return paths


def picture(found: Fit, number: int) -> Figure:
    """Measured over computed, residuals against every setting (or time), and their normal probability."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    problem, each = found.problem, found.problem.measured[number]
    of = (problem.data.column == number) & found.fitted.active
    rows = problem.where[of, 0]
    residuals = found.residuals[of]
    across = [(label, values[rows]) for label, values in _across(found)]
    if len(across) % 2:
        across.append((_label(f"computed {each.name}", each.unit), _in_unit(each, found.fitted.computed[of])))
    panels = 2 + len(across)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.0, 0.6 + 3.3 * (panels // 2)), layout="constrained")
        axes = list(figure.subplots(panels // 2, 2, squeeze=False).ravel())
        figure.suptitle(f"{problem.title}: {each.name}", x=0.01, horizontalalignment="left")
        _measured_over_computed(axes[0], found, each, of)
        _normal_probability(axes[1], residuals)
        for axis, (label, values) in zip(axes[2:], across, strict=False):
            _against(axis, label, values, residuals)
    return figure


def _across(found: Fit) -> list[tuple[str, Array]]:
    """What residuals are drawn against: every setting that is a number, the time; else the computed value."""
    table, problem = found.problem.table, found.problem
    names = ([TIME] if problem.times is not None else []) + list(problem.file.settings)
    columns = [(name, table.columns[name].unit, table.plain(name)) for name in names]
    return [(_label(name, unit), values) for name, unit, values in columns if values is not None]


def _in_unit(each: Measured, values: Array) -> Array:
    unit = each.unit
    return np.asarray((values - each.quantity.offsets.get(normalise(unit), 0.0)) / each.quantity.factor(unit))


def _measured_over_computed(axes: Axes, found: Fit, each: Measured, of: Array) -> None:
    computed, measured = (_in_unit(each, v[of]) for v in (found.fitted.computed, found.problem.data.measured))
    sigma = found.fitted.sigma[of] / each.quantity.factor(each.unit)
    both = np.array([min(computed.min(), measured.min()), max(computed.max(), measured.max())])
    axes.plot(both, both, color="#000000", linewidth=0.8, label="measured = computed")
    axes.errorbar(computed, measured, yerr=BAND * sigma, **_dots(), elinewidth=0.8, label="measured ± 2 sd")
    axes.set_xlabel(_label(f"computed {each.name}", each.unit))
    _logarithmic(both, axes.set_xscale, axes.set_yscale)
    axes.set_ylabel(_label(f"measured {each.name}", each.unit))
    axes.legend(loc="upper left", fontsize=8)


def _normal_probability(axes: Axes, residuals: Array) -> None:
    if residuals.size < 3:
        axes.text(0.5, 0.5, "too few values", ha="center", transform=axes.transAxes)
        return
    expected, ordered = probplot(residuals, fit=False)
    ends = np.array([expected[0], expected[-1]])
    axes.plot(ends, ends, color="#000000", linewidth=0.8, label="normal, sd 1")
    axes.plot(expected, ordered, **_dots(), label="residuals")
    axes.set_xlabel("expected of a normal distribution [sd]")
    axes.set_ylabel("residual [sd]")
    axes.legend(loc="upper left", fontsize=8)


def _against(axes: Axes, label: str, values: Array, residuals: Array) -> None:
    axes.axhspan(-BAND, BAND, color="#eeeeee", zorder=0)
    axes.axhline(0.0, color="#000000", linewidth=0.8)
    axes.plot(values, residuals, **_dots())
    reach = 1.1 * max(float(np.abs(residuals).max()), 1.1 * BAND)
    axes.set_ylim(-reach, reach)
    _logarithmic(values, axes.set_xscale)
    axes.set_xlabel(label)
    axes.set_ylabel("residual [sd]")


def _logarithmic(values: Array, *scales: Callable[[str], None]) -> None:
    """A logarithmic axis where positive values span more than two decades."""
    if values.min() > 0 and values.max() > DECADES * values.min():
        for scale in scales:
            scale("log")


def _dots() -> dict[str, Any]:
    return {"color": COLOURS[0], "linestyle": "none", "marker": "o", "markersize": 4.0}


def _label(name: str, unit: str) -> str:
    """An axis label, the unit's powers raised."""
    raised = re.sub(r"\^?(?<=[A-Za-z)^])(\d)", lambda m: "⁰¹²³⁴⁵⁶⁷⁸⁹"[int(m[1])], unit)
    return f"{name} [{raised}]" if unit not in ("", "1", "-") else name
