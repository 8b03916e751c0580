"""What ``crescentlab spectrum`` says: tables in display units, JSON and CSV in SI, but phases of the CSV in deg."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from crescentlab.analysis.spectrum import Spectrum
from crescentlab.analysis.spectrum.plots import factor
from crescentlab.analysis.spectrum.waterfall import Waterfall
from crescentlab.commands.text import counted, table
from crescentlab.units import QUANTITIES, Quantity

time, frequency, speed = QUANTITIES["time"], QUANTITIES["frequency"], QUANTITIES["speed"]
angle = QUANTITIES["angle"]
APERIODIC = 0.01
"""Change from period to period, as part of the ripple, from which it is worth a word."""


@dataclass(frozen=True)
class Shown:
    """What is printed of the source: its title, the stem of its files, its display units, warnings."""

    title: str
    stem: Path
    units: dict[str, str]
    warnings: tuple[str, ...] = ()

    def unit(self, quantity: Quantity) -> str:
        """The unit that a quantity is shown in."""
        return self.units.get(quantity.name) or next(iter(quantity.units), "") or quantity.si


def report(found: Sequence[Spectrum], shaft: float | None, shown: Shown, lines: int) -> dict[str, Any]:
    """The object of ``--json``, SI."""
    first = found[0]
    return {
        "status": "done", "title": shown.title, "period": first.period, "periods": first.periods,
        "start": first.start, "stop": first.stop, "highest": float(first.frequency[-1]), "shaft_speed": shaft,
        "variables": {
            each.name: {
                "unit": each.quantity.si, "mean": each.mean, "rms": each.rms, "change": each.change,
                "error": each.error if math.isfinite(each.error) else None, "share": each.share,
                "lines": [vars(line) for line in each.strongest(lines, shaft)],
            }
            for each in found
        },
        "warnings": list(shown.warnings), "error": None,
    }  # fmt: skip


def summary(found: Sequence[Spectrum], shaft: float | None, shown: Shown, lines: int) -> str:
    """The strongest lines in a few rows, in display units."""
    first = found[0]
    clock = shown.unit(time)
    facts = [
        ("window", f"{time.show(first.start, clock)} to {time.show(first.stop, clock)}: "
         f"{counted(first.periods, 'period')} of {time.show(first.period, clock, 6)} ({1 / first.period:.6g} Hz)"),
        ("lines", f"every {first.frequency[0]:.6g} Hz, up to {first.frequency[-1]:.6g} Hz"),
    ]  # fmt: skip
    if shaft is not None:
        facts.append(("shaft", speed.show(shaft, shown.unit(speed))))
    parts = [shown.title, table(facts, indent="  ")]
    parts += [_table_of(each, shaft, shown, lines) for each in found]
    return "\n\n".join([*parts, *(f"  warning: {warning}" for warning in shown.warnings)])


def _table_of(each: Spectrum, shaft: float | None, shown: Shown, lines: int) -> str:
    unit, turn = shown.unit(each.quantity), shown.unit(angle)
    per = factor(each.quantity, unit)
    said = f"mean {each.quantity.show(each.mean, unit)}, ripple {each.rms / per:.4g} {unit} rms".replace(
        " 1 rms", " rms"
    )
    said += f", {100 * each.share:.4g} % of its square in these lines"
    if each.change is None:
        said += ""
    elif each.change > APERIODIC:
        said += f"\n  not periodic: it changes by {100 * each.change:.2g} % of its ripple from period to period"
    else:
        said += f"\n  changes by {100 * each.change:.2g} % of its ripple from period to period"
    if each.error > 1e-6 * each.rms:
        said += f"\n  lines are known to {each.error / per:.1g} {unit}"
    strongest = each.strongest(lines, shaft)
    if not strongest:
        return f"  {each.name}: {said}\n  no lines: it does not change"
    heading = ("frequency", *(["order"] if shaft is not None else []), "amplitude", "phase")
    rows = [
        (
            f"{line.frequency:.6g} Hz", *([f"{line.order:.5g}"] if line.order is not None else []),
            f"{line.amplitude / per:.5g} {unit}".removesuffix(" 1"), f"{line.phase / factor(angle, turn):.1f} {turn}",
        )
        for line in strongest
    ]  # fmt: skip
    return f"  {each.name}: {said}\n\n" + table([heading, *rows], right=range(len(heading)), indent="    ")


def spectrum_rows(found: Sequence[Spectrum], shaft: float | None) -> Iterable[Sequence[Any]]:
    """Rows of the CSV file: frequency, order, and of each variable amplitude (SI) and phase [deg]."""
    orders = ["order"] if shaft is not None else []
    pairs = [(f"{s.name} [{s.quantity.si}]", f"{s.name} phase [deg]") for s in found]
    yield ["frequency [Hz]", *orders, *(title for pair in pairs for title in pair)]
    yield [0.0, *[0.0 for _ in orders], *(v for s in found for v in (s.mean, 0.0))]
    for k in range(min(s.frequency.size for s in found)):
        lines = [s.line(k, shaft) for s in found]
        order = [lines[0].order] if shaft is not None else []
        yield [lines[0].frequency, *order, *(v for line in lines for v in (line.amplitude, math.degrees(line.phase)))]


# -- waterfalls ----------------------------------------------------------------------------------


def waterfall_report(found: Sequence[Waterfall], shown: Shown, lines: int | None) -> dict[str, Any]:
    """The object of ``--json``, SI: the strongest orders, or all."""
    first = found[0]
    return {
        "status": "done", "title": shown.title, "revolutions": first.revolutions, "time": first.time.tolist(),
        "shaft_speed": first.speed.tolist(),
        "variables": {
            each.name: {
                "unit": each.quantity.si, "mean": each.mean.tolist(),
                "orders": [
                    {"order": float(each.orders[k]), "amplitude": each.amplitude[:, k].tolist()}
                    for k in (range(each.orders.size) if lines is None else each.strongest(lines))
                ],
            }
            for each in found
        },
        "warnings": list(shown.warnings), "error": None,
    }  # fmt: skip


def waterfall_rows(found: Sequence[Waterfall]) -> Iterable[Sequence[Any]]:
    """Rows of the CSV file, SI: a row per window, a column per order of each variable."""
    yield [
        "time [s]", "speed [rad/s]",
        *(f"{w.name} order {n:g} [{w.quantity.si}]" for w in found for n in w.orders),
    ]  # fmt: skip
    for j in range(found[0].time.size):
        values = np.concatenate([w.amplitude[j] for w in found]).tolist()
        yield [float(found[0].time[j]), float(found[0].speed[j]), *values]


def waterfall_text(each: Waterfall, shown: Shown, lines: int) -> str:
    unit, turning = shown.unit(each.quantity), shown.unit(speed)
    per = factor(each.quantity, unit)
    low, high = (speed.show(float(v), turning) for v in (each.speed[0], each.speed[-1]))
    windows = counted(each.time.size, "window")
    said = f"  {each.name}: {windows} of {counted(each.revolutions, 'revolution')} from {low} to {high}"
    heading = ("order", "largest", "at speed", "at frequency", "at the start", "at the end")
    rows = []
    for k in each.strongest(lines):
        series = each.amplitude[:, k] / per
        j = int(np.argmax(series))
        shaft = speed.show(float(each.speed[j]), turning)
        hertz = f"{each.frequency[j, k]:.5g} Hz"
        amounts = [f"{value:.4g} {unit}".removesuffix(" 1") for value in (series[j], series[0], series[-1])]
        rows.append((f"{each.orders[k]:g}", amounts[0], shaft, hertz, amounts[1], amounts[2]))
    return said + "\n\n" + table([heading, *rows], right=range(len(heading)), indent="    ")
