"""Figures of columns of numbers in the style of the other pictures; nothing here knows of studies."""

from __future__ import annotations

import functools
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ParamSpec

import numpy as np
from scipy import stats

from crescentlab.plotting import COLOURS, STYLE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

P = ParamSpec("P")
LOW, HIGH = COLOURS[0], COLOURS[1]
MARKERS = "osD^vP*"
INSIDE = 8
"""More curves than this have their legend beside the axes."""


@dataclass(frozen=True)
class Column:
    """A name, its unit, and numbers in it; NaN where there is none."""

    name: str
    unit: str
    values: np.ndarray

    @property
    def label(self) -> str:
        """An axis label."""
        return label(self.name, self.unit)


def label(name: str, unit: str) -> str:
    """``name [mm²]``; pure numbers have no unit."""
    raised = re.sub(r"\^?(?<=[A-Za-z)^])(\d)", lambda m: "⁰¹²³⁴⁵⁶⁷⁸⁹"[int(m[1])], unit)
    return name if unit in ("1", "") else f"{name} [{raised}]"


def _figure(title: str, width: float, height: float) -> Figure:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    figure.suptitle(title, x=0.01, horizontalalignment="left")
    return figure


def _styled(draw: Callable[P, Figure]) -> Callable[P, Figure]:
    """The function with the style of all pictures."""

    @functools.wraps(draw)
    def drawn(*arguments: P.args, **options: P.kwargs) -> Figure:
        import matplotlib as mpl

        with mpl.rc_context(STYLE):
            return draw(*arguments, **options)

    return drawn


@_styled
def curves(
    title: str, x: Column, y: Sequence[Column], groups: Mapping[str, Sequence[int]], by: str, sound: np.ndarray
) -> Figure:
    """Columns over x, a curve through each group of rows in its order; rows that are not sound have open markers."""
    figure = _figure(title, 8.0, 1.6 + 3.0 * len(y))
    stack = figure.subplots(len(y), 1, sharex=True, squeeze=False)[:, 0]
    for axes, column in zip(stack, y, strict=True):
        for k, (name, members) in enumerate(groups.items()):
            rows = np.array(members)
            rows = rows[np.isfinite(x.values[rows]) & np.isfinite(column.values[rows])]
            colour, marker = COLOURS[k % len(COLOURS)], MARKERS[k % len(MARKERS)]
            style: dict[str, Any] = {"color": colour, "marker": marker, "markersize": 4.5}
            good, rest = np.flatnonzero(sound[rows]).tolist(), rows[~sound[rows]]
            axes.plot(x.values[rows], column.values[rows], label=name, markevery=good, **style)
            axes.plot(x.values[rest], column.values[rest], linestyle="none", markerfacecolor="white", **style)
        axes.set_ylabel(column.label)
    stack[-1].set_xlabel(x.label)
    if by:
        many = len(groups) > INSIDE
        where: dict[str, Any] = {"loc": "outside right center"} if many else {"loc": "best", "frameon": True}
        owner: Any = figure if many else stack[0]
        owner.legend(*stack[0].get_legend_handles_labels(), title=by, fontsize=8, title_fontsize=9, **where)
    figure.align_ylabels()
    return figure


@_styled
def bar_chart(title: str, measures: Sequence[tuple[str, str, Sequence[tuple[str, float, float]]]]) -> Figure:
    """Tornado: per outcome (name, unit, bars) the change that each setting's low and high end makes, largest on top."""
    rows = [max(len(bars), 1) for _, _, bars in measures]
    figure = _figure(title, 8.0, 0.9 + sum(0.9 + 0.36 * n for n in rows))
    stack = figure.subplots(len(measures), 1, squeeze=False, height_ratios=[0.9 + 0.36 * n for n in rows])[:, 0]
    for axes, (name, unit, bars) in zip(stack, measures, strict=True):
        place = np.arange(len(bars))
        for part, colour, said in ((1, LOW, "setting at its low end"), (2, HIGH, "at its high end")):
            axes.barh(place, [bar[part] for bar in bars], height=0.62, color=colour, label=said)
        axes.set_yticks(place, [bar[0] for bar in bars])
        axes.invert_yaxis()
        axes.axvline(0.0, color="#444444", linewidth=0.9)
        axes.grid(False, axis="y")
        axes.tick_params(axis="y", length=0)
        axes.set_xlabel(f"change of {label(name, unit)}")
    handles, said = stack[0].get_legend_handles_labels()
    figure.legend(handles, said, loc="outside lower right", ncols=2, fontsize=9)
    return figure


@_styled
def scatter_matrix(title: str, columns: Sequence[Column]) -> Figure:
    """Each column over each other one, its histogram on the diagonal, rank correlations above it."""
    n = len(columns)
    side = max(2.0, min(2.6, 12.0 / n))
    figure = _figure(title, 0.8 + side * n, 0.9 + side * n)
    grid = figure.subplots(n, n, squeeze=False)
    for row in range(n):
        for k in range(n):
            axes = grid[row, k]
            if row == k:
                _histogram(axes, columns[k].values)
                axes.set_yticks([])
            elif k < row:
                axes.plot(columns[k].values, columns[row].values, ".", color=COLOURS[0], markersize=3, alpha=0.7)
            else:
                _correlation(axes, columns[k].values, columns[row].values)
            _ticks(axes, columns, row, k)
    figure.align_labels()
    return figure


def _ticks(axes: Any, columns: Sequence[Column], row: int, k: int) -> None:
    """Labels on the left and at the bottom only."""
    n = len(columns)
    axes.tick_params(labelsize=8, labelleft=k == 0 and row > 0, labelbottom=row == n - 1)
    axes.locator_params(axis="x", nbins=4)
    if k == 0:
        axes.set_ylabel(columns[row].label, fontsize=9)
    if row == n - 1:
        axes.set_xlabel(columns[k].label, fontsize=9)


def _correlation(axes: Any, x: np.ndarray, y: np.ndarray) -> None:
    """Spearman's rank correlation as a number, the larger the bolder."""
    both = np.isfinite(x) & np.isfinite(y)
    varies = both.sum() > 2 and np.ptp(x[both]) > 0 and np.ptp(y[both]) > 0
    rho = float(stats.spearmanr(x[both], y[both]).statistic) if varies else np.nan
    axes.set_axis_off()
    if np.isfinite(rho):
        style = {"fontsize": 10 + 8 * abs(rho), "color": HIGH if rho > 0 else LOW, "alpha": 0.35 + 0.65 * abs(rho)}
        axes.text(0.5, 0.5, f"{rho:+.2f}", ha="center", va="center", transform=axes.transAxes, **style)


def _histogram(axes: Any, values: np.ndarray) -> None:
    finite = values[np.isfinite(values)]
    bins = int(np.clip(np.sqrt(finite.size) * 1.2, 5, 40))
    axes.hist(finite, bins=bins, color=COLOURS[5], edgecolor="white", linewidth=0.5)


@_styled
def distributions(title: str, columns: Sequence[Column]) -> Figure:
    """Histograms side by side, with mean, median and the 5 % and 95 % quantiles."""
    wide = min(len(columns), 3)
    tall = -(-len(columns) // wide)
    figure = _figure(title, 1.0 + 3.6 * wide, 0.9 + 2.8 * tall)
    grid = figure.subplots(tall, wide, squeeze=False).ravel()
    for axes, column in zip(grid, columns, strict=False):
        finite = column.values[np.isfinite(column.values)]
        _histogram(axes, finite)
        axes.set_xlabel(column.label)
        if not finite.size:
            continue
        low, middle, high = np.quantile(finite, [0.05, 0.5, 0.95])
        axes.axvspan(low, high, color=COLOURS[4], alpha=0.15, zorder=0)
        axes.axvline(middle, color=HIGH, linewidth=1.6)
        axes.set_title(
            f"median {middle:.4g}, 90 % within {low:.4g} to {high:.4g}", fontsize=8.5, loc="left", color="#444444"
        )
    grid[0].set_ylabel("points")
    for axes in grid[len(columns) :]:
        axes.set_axis_off()
    return figure
