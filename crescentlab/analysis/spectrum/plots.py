"""Pictures of spectra and waterfalls, in display units. Never a window."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from crescentlab.analysis.spectrum.lines import Spectrum
from crescentlab.analysis.spectrum.waterfall import Waterfall
from crescentlab.plotting import COLOURS, LINES, STYLE, save_figure
from crescentlab.units import Quantity, normalise

if TYPE_CHECKING:
    pass

NAMED = 5
"""Lines of a spectrum that are named, and orders of a waterfall that are drawn by themselves."""
DECADES = 3.0
"""Amplitudes further below the largest are not told apart."""
SHOWN_SHARE = 1e-2
"""A spectrum's axis ends at the last line that is at least this part of the strongest."""


def plot_spectra(
    found: Sequence[Spectrum], units: Sequence[str], path: Path, title: str, shaft: float | None = None
) -> None:
    """Amplitudes over frequency, one axis per variable, orders along the top; ``shaft`` in rad/s."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.0, 1.6 + 2.6 * len(found)), layout="constrained")
        figure.suptitle(title, x=0.01, horizontalalignment="left")
        stack = figure.subplots(len(found), 1, sharex=True, squeeze=False)[:, 0]
        top = max(_last_shown(each) for each in found)
        scale, unit = (1e3, "kHz") if top > 5e3 else (1.0, "Hz")
        for axes, each, shown in zip(stack, found, units, strict=True):
            height = each.amplitude / factor(each.quantity, shown)
            axes.vlines(each.frequency / scale, 0, height, color=COLOURS[0], linewidth=1.6)
            axes.plot(each.frequency / scale, height, ".", color=COLOURS[0], markersize=4)
            axes.set_ylabel(_label(f"{each.name}, amplitude", shown))
            axes.set_ylim(0, 1.18 * max(float(height.max()), 1e-300))
            _name_lines(axes, each, height, scale, shaft)
        stack[-1].set_xlim(0, top / scale * 1.04)
        stack[-1].set_xlabel(f"frequency [{unit}]")
        if shaft is not None:
            turns = shaft / (2 * np.pi) / scale
            above = stack[0].secondary_xaxis("top", functions=(lambda f: f / turns, lambda n: n * turns))
            above.set_xlabel("order of the shaft")
        figure.align_ylabels()
    save_figure(figure, path)


def _last_shown(spectrum: Spectrum) -> float:
    seen = np.flatnonzero(spectrum.amplitude >= SHOWN_SHARE * spectrum.amplitude.max(initial=0.0))
    return float(spectrum.frequency[seen[-1] if seen.size else -1])


def _name_lines(axes: Any, spectrum: Spectrum, height: np.ndarray, scale: float, shaft: float | None) -> None:
    for line in spectrum.strongest(NAMED, shaft):
        k = int(np.argmin(np.abs(spectrum.frequency - line.frequency)))
        said = f"{line.frequency:.4g} Hz" if line.order is None else f"{line.order:.4g}"
        if height[k] < 0.04 * height.max():
            continue
        axes.annotate(
            said, (line.frequency / scale, height[k]), xytext=(0, 4), textcoords="offset points",
            horizontalalignment="center", fontsize=8,
        )  # fmt: skip


def plot_waterfall(waterfall: Waterfall, unit: str, speed: tuple[Quantity, str], path: Path, title: str) -> None:
    """Amplitude as colour over order and shaft speed, and the strongest orders over the speed below."""
    import matplotlib as mpl
    from matplotlib.colors import LogNorm
    from matplotlib.figure import Figure

    amplitude = waterfall.amplitude / factor(waterfall.quantity, unit)
    over, label = _running(waterfall, speed)
    largest = max(float(amplitude.max()), 1e-300)
    norm = LogNorm(largest * 10**-DECADES, largest)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.0, 8.0), layout="constrained")
        figure.suptitle(title, x=0.01, horizontalalignment="left")
        above, below = figure.subplots(2, 1, height_ratios=(1.7, 1.0))
        above.grid(visible=False)
        colours = above.pcolormesh(
            waterfall.orders, over, np.maximum(amplitude, largest * 10**-DECADES), norm=norm, cmap="viridis",
            shading="nearest", rasterized=True,
        )  # fmt: skip
        above.set_xlabel("order of the shaft")
        above.set_ylabel(label)
        figure.colorbar(colours, ax=above, label=_label(f"{waterfall.name}, amplitude", unit), pad=0.01)
        styles = [(c, line) for line in LINES for c in COLOURS]
        for (colour, style), k in zip(styles, waterfall.strongest(NAMED), strict=False):
            below.plot(over, amplitude[:, k], color=colour, linestyle=style, label=f"order {waterfall.orders[k]:g}")
        below.set_xlabel(label)
        below.set_ylabel(_label(f"{waterfall.name}, amplitude", unit))
        below.set_yscale("log")
        below.set_ylim(largest * 10**-DECADES, 1.5 * largest)
        below.margins(x=0)
        below.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=NAMED, borderpad=0.1, handlelength=1.5)
    save_figure(figure, path)


def _running(waterfall: Waterfall, speed: tuple[Quantity, str]) -> tuple[np.ndarray, str]:
    """What the windows stand over: the speed while it changes one way, else the time."""
    quantity, unit = speed
    change = np.diff(waterfall.speed)
    if change.size and (np.all(change > 0) or np.all(change < 0)):
        return waterfall.speed / factor(quantity, unit), f"shaft speed [{unit}]"
    return waterfall.time, "time [s]"


def factor(quantity: Quantity, unit: str) -> float:
    """SI value of one ``unit``; 1 for a quantity without units of its own."""
    return quantity.units.get(normalise(unit), 1.0)


def _label(text: str, unit: str) -> str:
    return text if unit in ("1", "") else f"{text} [{unit}]"
