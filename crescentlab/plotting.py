"""Series as pictures: over time or over another variable, in the circuit's display units. Never a window."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from crescentlab.errors import InputError, nearest
from crescentlab.netlist import Netlist, PlotSection
from crescentlab.units import QUANTITIES, Quantity, normalise

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from crescentlab.result import Result
    from crescentlab.system import System

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
"""Okabe and Ito's palette: told apart with any colour vision."""
LINES = ("-", "--", "-.", ":")
LINES_PER_PLOT = 7
"""Most net pressures in one picture of a circuit without ``plots:``."""
STYLE: dict[Any, Any] = {
    "font.size": 10.0, "figure.titlesize": 12.0, "figure.titleweight": "bold", "lines.linewidth": 1.4,
    "axes.grid": True, "grid.color": "#d9d9d9", "grid.linewidth": 0.6, "axes.axisbelow": True,
    "axes.spines.top": False, "axes.spines.right": False, "legend.frameon": False,
    "savefig.dpi": 150.0, "agg.path.chunksize": 20000, "svg.fonttype": "none",
}  # fmt: skip


def plot_series(result: Result, names: Sequence[str], path: Path | None = None, title: str | None = None) -> Figure:
    """Draw variables over time, one axis per quantity; save the figure if ``path`` is given."""
    shown = list(names) or result.net_pressures()
    if not shown:
        raise InputError(f"nothing to plot; name variables: {nearest('', result.names)}")
    figure = _figure(result, PlotSection(y=shown, title=title))
    if path is not None:
        save_figure(figure, path)
    return figure


def write_plots(result: Result, base: Path) -> list[Path]:
    """Write the circuit's plots as ``<base>-1.png``, ``<base>-2.png``, ...; without any, its net pressures."""
    paths: list[Path] = []
    for number, section in enumerate(_sections(result), start=1):
        paths.append(base.with_name(f"{base.name}-{number}.png"))
        save_figure(_figure(result, section), paths[-1])
    return paths


def check_plots(netlist: Netlist, system: System) -> None:
    """Refuse plots of variables that do not exist, at their line, before the run."""
    for k, plot in enumerate(netlist.sections.plots):
        wanted = [(name, ("y", j)) for j, name in enumerate(plot.y)] + ([(plot.x, ("x",))] if plot.x else [])
        for name, where in wanted:
            try:
                _refuse(system, name, where == ("x",))
            except InputError as error:
                place = (
                    netlist.place("plots", k, *where) or netlist.place("plots", k, where[0]) or netlist.place("plots")
                )
                raise InputError(f"plots: {error.message}", place) from None


def _refuse(system: System, name: str, horizontal: bool) -> None:
    """Raise unless the system has the variable, or the element of it, that a plot names."""
    base, bracket, index = name.partition("[")
    variable = system.find(base)
    n = len(variable.expression()) if variable.vector else None
    if bracket and n is None:
        raise InputError(f"{name}: {base} is a single value; write {base}")
    if bracket and index not in [f"{k + 1}]" for k in range(n or 0)]:
        raise InputError(f"{name}: {base} has {n} elements, counted from 1; write for example {base}[1]")
    if horizontal and n is not None and not bracket:
        raise InputError(f"x: {name} is a vector; write one element, for example {name}[1]")


def _sections(result: Result) -> Iterable[PlotSection]:
    written = result.design.netlist.sections.plots
    if written:
        return written
    names = result.net_pressures() or [n for n in result.system.state_names if "[" not in n][:LINES_PER_PLOT]
    return [
        PlotSection(y=names[k : k + LINES_PER_PLOT], title=result.title) for k in range(0, len(names), LINES_PER_PLOT)
    ]


def save_figure(figure: Figure, path: Path) -> None:
    """Write a picture in the house's style, the same bytes each time; raises :class:`InputError` where it cannot be."""
    import matplotlib as mpl

    try:
        with mpl.rc_context({**STYLE, "svg.hashsalt": "crescentlab"}):
            figure.savefig(path, metadata={"Date": None} if path.suffix == ".svg" else None)
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be written ({getattr(error, 'strerror', None) or error})") from None


def _figure(result: Result, plot: PlotSection) -> Figure:
    """One picture: a stack of axes, one per quantity, over time or over ``plot.x``."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    groups = _by_quantity(result, plot.y)
    inside = _window(result.time, plot)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.0, 2.0 + 2.6 * len(groups)), layout="constrained")
        stack = figure.subplots(len(groups), 1, sharex=True, squeeze=False)[:, 0]
        figure.suptitle(plot.title or result.title, x=0.01, horizontalalignment="left")
        x, label = _horizontal(result, plot.x)
        for axes, (quantity, columns) in zip(stack, groups.items(), strict=True):
            unit = result.display_unit(quantity)
            for (colour, line), (name, series) in zip(_styles(), columns.items(), strict=False):
                axes.plot(x[inside], _in_unit(series[inside], quantity, unit), color=colour, linestyle=line, label=name)
            axes.set_ylabel(_label(quantity, unit, list(columns)))
            axes.margins(x=0.0 if plot.x is None else 0.02)
            if len(columns) > 1:
                _legend(axes, len(columns))
        stack[-1].set_xlabel(label)
        figure.align_ylabels()
    return figure


def _by_quantity(result: Result, names: Sequence[str]) -> dict[Quantity, dict[str, np.ndarray]]:
    """Series by quantity in the order first named, vectors element by element."""
    columns = list(dict.fromkeys(n for name in names for n in result.elements(name)))
    if not columns:
        raise InputError(f"nothing to plot: {', '.join(names) or 'the circuit has no net pressures'} has no elements")
    result.load(dict.fromkeys(n.partition("[")[0] for n in columns))
    groups: dict[Quantity, dict[str, np.ndarray]] = {}
    for name in columns:
        groups.setdefault(result.quantity(name), {})[name] = result[name]
    return groups


def _window(time: np.ndarray, plot: PlotSection) -> np.ndarray:
    """Rows between the plot's start and stop; all of them if a run that ended early has none there."""
    inside = (time >= (plot.start or 0.0)) & (time <= (np.inf if plot.stop is None else plot.stop))
    return inside if inside.any() else np.ones_like(inside)


def _horizontal(result: Result, name: str | None) -> tuple[np.ndarray, str]:
    quantity = QUANTITIES["time"] if name is None else result.quantity(name)
    unit = result.display_unit(quantity)
    if name is not None and len(result.elements(name)) != 1:
        raise InputError(f"plots: x: {name} is a vector; write one element, for example {name}[1]")
    series = result.time if name is None else result[result.elements(name)[0]]
    return _in_unit(series, quantity, unit), _label(quantity, unit, [name or ""])


def _in_unit(series: np.ndarray, quantity: Quantity, unit: str) -> Any:
    return (series - quantity.offsets.get(normalise(unit), 0.0)) / quantity.factor(unit)


def _label(quantity: Quantity, unit: str, names: Sequence[str]) -> str:
    """An axis label: the one variable shown, its quantity, and the unit with its powers raised."""
    known = quantity.title if quantity.name in QUANTITIES and quantity.name != "ratio" else ""
    name = ", ".join(text for text in (names[0] if len(names) == 1 else "", known) if text)
    raised = re.sub(r"\^?(?<=[A-Za-z)^])(\d)", lambda m: "⁰¹²³⁴⁵⁶⁷⁸⁹"[int(m[1])], unit)
    return name if unit in ("1", "") else f"{name} [{raised}]"


def _styles() -> Iterator[tuple[str, str]]:
    return ((colour, line) for line in LINES for colour in COLOURS)


def _legend(axes: Any, count: int) -> None:
    """Beside no curve: in a line above the axes, or, if there are many, in a column on the right."""
    if count <= 5:
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=count, borderpad=0.1, handlelength=1.5)
    else:
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8)
