"""Pictures of linear models: Bode diagrams, impedances, and the map of the poles. Never a window."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from crescentlab.analysis.linear.files import UNITS, phase, ratio_unit
from crescentlab.analysis.linear.frequency import Responses, Transfer
from crescentlab.analysis.linear.modes import Mode
from crescentlab.elaborate import Design
from crescentlab.plotting import COLOURS, STYLE, save_figure
from crescentlab.units import DISPLAY, Quantity

Array = np.ndarray

NAMED = 6
"""Most poles that are named in a map."""
SPREAD = 300.0
"""Poles further apart than this in size are shown on axes linear near zero and logarithmic beyond."""


def display_unit(design: Design, quantity: Quantity) -> str:
    """The unit that the circuit's ``display:`` shows a quantity in; by default the one engineers use."""
    chosen = {**DISPLAY, **design.netlist.sections.display}
    return chosen.get(quantity.name) or next(iter(quantity.units)) or quantity.si


def shown_gain(design: Design, transfer: Transfer) -> tuple[float, str]:
    """Factor and unit in which a transfer is shown: ``bar/(L/min)``."""
    above, below = (display_unit(design, q) for q in (transfer.of, transfer.per))
    return transfer.per.factor(below) / transfer.of.factor(above), ratio_unit(above, below)


def write_frequency_plots(found: Responses, title: str, base: Path, unit: str) -> list[Path]:
    """Write ``<base>-bode.png``, ``<base>-impedance.png`` and ``<base>-poles.png``, those there is something for."""
    groups = (("bode", [t for t in found.transfers if not t.impedance]),
              ("impedance", [t for t in found.transfers if t.impedance]))  # fmt: skip
    written: list[Path] = []
    for name, transfers in groups:
        if transfers:
            heading = "Impedance" if name == "impedance" else "Frequency response"
            written.append(base.with_name(f"{base.name}-{name}.png"))
            save_figure(bode_figure(found, transfers, f"{title}: {heading.lower()}", unit), written[-1])
    if found.modes:
        written.append(base.with_name(f"{base.name}-poles.png"))
        save_figure(pole_figure(found.modes, f"{title}: poles", unit), written[-1])
    return written


def bode_figure(found: Responses, transfers: Sequence[Transfer], title: str, unit: str) -> Any:
    """Magnitudes, one axis per unit, above the phases; exact lines dashed."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    gains = {t.name: shown_gain(found.model.design, t) for t in transfers}
    units = list(dict.fromkeys(u for _, u in gains.values()))
    x = found.omega / UNITS[unit]
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.0, 2.4 + 2.6 * len(units) + 2.2), layout="constrained")
        stack = figure.subplots(
            len(units) + 1, 1, sharex=True, squeeze=False, gridspec_kw={"height_ratios": [3] * len(units) + [2]}
        )[:, 0]
        figure.suptitle(title, x=0.01, horizontalalignment="left")
        for k, t in enumerate(transfers):
            colour = COLOURS[k % len(COLOURS)]
            factor, gain = gains[t.name]
            axes = stack[units.index(gain)]
            for values, line, name in ((t.value, "-", t.name), (t.exact, "--", f"{t.name}, exact lines")):
                if values is not None:
                    axes.loglog(x, np.abs(values) * factor, color=colour, linestyle=line, label=name)
                    stack[-1].semilogx(x, phase(values), color=colour, linestyle=line)
        for axes, gain in zip(stack, units, strict=False):
            axes.set_ylabel("magnitude" if gain == "1" else f"magnitude [{gain}]")
            axes.grid(visible=True, which="minor", linewidth=0.3)
            rows = len(axes.get_legend_handles_labels()[1])
            axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=min(rows, 2), borderpad=0.1)
        _phase_axis(stack[-1])
        stack[-1].set_xlabel(f"frequency [{unit}]" if unit == "Hz" else f"angular frequency [{unit}]")
        stack[-1].set_xlim(x[0], x[-1])
        _plain_numbers(stack[-1].xaxis, x[-1] / x[0])
        figure.align_ylabels()
    return figure


def _plain_numbers(axis: Any, ratio: float) -> None:
    """20 instead of 2 x 10^1; over less than two decades numbers at 2 and 5 as well."""
    from matplotlib.ticker import FuncFormatter

    def between(value: float, _: int) -> str:
        return f"{value:g}" if ratio < 100 and f"{value:e}"[0] in "25" else ""

    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(FuncFormatter(between))


def _phase_axis(axes: Any) -> None:
    """Ticks at multiples of 45, 90, 180, ... degrees."""
    from matplotlib.ticker import MultipleLocator

    low, high = axes.get_ylim()
    step = next((s for s in (45, 90, 180, 360, 720) if (high - low) / s <= 6), 1440 * math.ceil((high - low) / 8640))
    axes.yaxis.set_major_locator(MultipleLocator(step))
    axes.set_ylabel("phase [deg]")
    axes.grid(visible=True, which="minor", linewidth=0.3)


def pole_figure(modes: Sequence[Mode], title: str, unit: str) -> Any:
    """Poles in the complex plane, the imaginary part as a frequency; the least damped told by their states."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    real = np.array([m.eigenvalue.real for m in modes])
    imaginary = np.array([m.eigenvalue.imag for m in modes]) / UNITS[unit]
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.0, 5.6), layout="constrained")
        axes = figure.subplots()
        figure.suptitle(title, x=0.01, horizontalalignment="left")
        stable = np.array([m.eigenvalue.real <= 0 for m in modes])
        for which, colour in ((stable, COLOURS[0]), (~stable, COLOURS[1])):
            for side in (1, -1):
                axes.plot(real[which], side * imaginary[which], "x", color=colour, markersize=8, markeredgewidth=1.8)
        for values, set_scale in ((real, axes.set_xscale), (imaginary, axes.set_yscale)):
            sizes = np.abs(values[values != 0])
            if sizes.size and sizes.max() > SPREAD * sizes.min():
                set_scale("symlog", linthresh=10.0 ** math.floor(math.log10(sizes.min())), linscale=0.5)
        _name_poles(axes, modes, unit)
        axes.axvline(0.0, color="#808080", linewidth=0.8)
        axes.axhline(0.0, color="#808080", linewidth=0.8)
        axes.margins(0.12)
        axes.set_xlabel("real part [1/s]")
        axes.set_ylabel(f"imaginary part, as frequency [{unit}]" if unit == "Hz" else f"imaginary part [{unit}]")
    return figure


def _name_poles(axes: Any, modes: Sequence[Mode], unit: str) -> None:
    """The least damped modes, numbered in the map and told beside it: frequency, damping, states that take part."""
    swinging = sorted((m for m in modes if m.eigenvalue.imag), key=lambda m: m.damping_ratio)[:NAMED]
    for number, mode in enumerate(sorted(swinging, key=lambda m: m.damped_frequency), start=1):
        frequency = mode.damped_frequency / UNITS[unit]
        axes.annotate(
            str(number), (mode.eigenvalue.real, frequency), xytext=(7, 3), textcoords="offset points", fontsize=9
        )
        parts = "\n     ".join(f"{name} {share:.0%}" for name, share in list(mode.parts.items())[:3] if share >= 0.05)
        axes.plot(
            [], [], " ", label=f"{number}   {frequency:.4g} {unit}, \u03b6 = {mode.damping_ratio:.3g}\n     {parts}"
        )
    if swinging:
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8, handlelength=0, handletextpad=0)
