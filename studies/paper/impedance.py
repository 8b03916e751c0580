"""Beyond the paper: the relief valve and the delivery side linearised, as the gears see them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from crescentlab.analysis.linear.frequency import frequency_response
from crescentlab.analysis.steady import OperatingPoint, steady
from crescentlab.plotting import COLOURS
from crescentlab.report.comparison import Comparison, true_that
from crescentlab.report.page import Page
from crescentlab.report.pictures import new_figure
from studies.paper.effort import Effort
from studies.paper.runs import BAR, LPM, pump, settings, settled
from studies.paper.valve import bench

FLOWS = (10.0, 30.0, 49.0)
"""Flows [L/min] through the relief valve alone."""
POINTS = (
    (2000, 24.6, "2000 rpm, 3 bar, valve closed"),
    (4000, 37.0, "4000 rpm, 6 bar, valve closed"),
    (4000, 0.0, "4000 rpm, throttle closed, valve regulates"),
)
"""Speed [rpm], area of the throttle [mm^2] and words of the points of the whole pump."""
UNIT = BAR / LPM


@dataclass(frozen=True)
class Data:
    """Frequencies [Hz]; impedances [Pa s/m^3] of valve and 70 cm^3 by flow, the same by hand; of the pump by words."""

    frequency: np.ndarray
    valve: dict[float, np.ndarray]
    by_hand: dict[float, np.ndarray]
    pump: dict[str, np.ndarray]


def compute(effort: Effort) -> Data:
    """Linearise the bench at rest, and the pump at the angle at which a settled revolution ends."""
    frequency = np.geomspace(1, 3000, effort.of(140, 40))
    omega = 2 * math.pi * frequency
    valve, by_hand, whole = {}, {}, {}
    for flow in effort.of(FLOWS, FLOWS[1:2]):
        given = {"supply": f"{flow} L/min"}
        point = steady(bench(), given)
        valve[flow] = (
            frequency_response(bench(), given, at=point, impedances=["p_line"], omega=omega).transfers[0].value
        )
        by_hand[flow] = valve_by_hand(point, omega)
    for rpm, area, words in effort.of(POINTS, POINTS[::2]):
        run, given = settled(rpm, area * 1e-6), settings(rpm, area * 1e-6)
        found = frequency_response(pump(), given, at=run.result, impedances=["p_delivery"], omega=omega)
        whole[words] = found.transfers[0].value
    return Data(frequency, valve, by_hand, whole)


def valve_by_hand(point: OperatingPoint, omega: np.ndarray) -> np.ndarray:
    r"""Impedance of the valve and its 70 cm^3 [Pa s/m^3] from the small motions of the spool.

    With q = n C_d A(x) \sqrt{2\rho p}/\rho_0, F = k \rho_0 q v \cos\theta and p_c = a q + b q^2:
    (m s^2 + B s + k_s + F A'/A) x = (A_s - F/p) p - A_s p_c' q, q = q A'/A x + q/(2p) p, and the displaced
    A_s s x and the compressed V s/\beta p add to the flow that comes in. \rho is constant, C_d at its largest.
    """
    result, s = point.result, 1j * omega
    parts, (oil,) = result.design.instances, result.design.fluids.values()
    spool, spring = parts["valve.spool"].component, parts["valve.spring"].component
    chamber, holes = parts["valve.chamber"].component, parts["valve.holes"].component
    p, q, x = (float(result[name][-1]) for name in ("p_line.p", "valve.q", "valve.x"))
    jet, area = float(result["valve.holes.jet_force"][-1]), float(result["valve.holes.area"][-1])
    r = holes.diameter / 2
    widening = holes.number * 2 * math.sqrt(r * r - (r - x) ** 2) / area  # A'/A: the chord of the circle at the edge
    face = math.pi / 4 * parts["valve.nose"].component.diameter ** 2
    back = face * (chamber.linear + 2 * chamber.quadratic * q)
    damping = parts["valve.damper"].component.coefficient
    motion = spool.mass * s**2 + damping * s + spring.stiffness + jet * widening + back * q * widening
    lift = (face - jet / p - back * q / (2 * p)) / motion  # x/p
    passed = q * widening * lift + q / (2 * p)
    stored = s * parts["line"].component.volume / float(oil.bulk_modulus(p))
    return np.asarray(1 / (stored + face * s * lift + passed))


def verdicts(data: Data) -> list[Comparison]:
    """The linear model against the small motions by hand."""
    worst = max(float(np.abs(data.valve[flow] / data.by_hand[flow] - 1).max()) for flow in data.valve)
    low, high = (abs(data.valve[f][0]) / UNIT for f in (min(data.valve), max(data.valve)))
    return [
        true_that(
            "impedance of the relief valve with 70 cm³, 1 Hz to 3 kHz",
            "beyond the paper: linear theory",
            "small motions of the spool by hand",
            f"the same within {100 * worst:.2g} %; {low:.3f} to {high:.3f} bar/(L/min) at 1 Hz",
            worst < 0.02,
            "2 %: by hand the density is constant, over which it changes by 0.5 %",
        )
    ]


def pictures(data: Data) -> dict[str, Figure]:
    """Magnitude and phase: the valve alone, and what the gears see."""
    figure = new_figure(10.0, 5.4)
    stack = figure.subplots(2, 2, sharex="col", height_ratios=[3, 2])
    for (flow, value), colour in zip(data.valve.items(), COLOURS, strict=False):
        _draw(stack[:, 0], data.frequency, value, colour, f"{flow:g} L/min")
        stack[0, 0].plot(
            data.frequency[::9],
            np.abs(data.by_hand[flow][::9]) / UNIT,
            "o",
            markersize=3,
            color="black",
            label="by hand" if flow == max(data.valve) else None,
        )
    for (words, value), colour in zip(data.pump.items(), COLOURS, strict=False):
        shown = data.frequency <= 1000
        _draw(stack[:, 1], data.frequency[shown], value[shown], colour, words)
    for axes, title in zip(stack[0], ("Relief valve and 70 cm³", "Delivery of the pump, all in place"), strict=True):
        axes.set(title=title, xscale="log", yscale="log", ylabel="|Z| [bar/(L/min)]")
        axes.legend(loc="upper left", fontsize=8)
        axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        for which in (axes.yaxis, axes.xaxis):
            which.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            which.set_minor_locator(NullLocator())
        axes.set_ylim(*((0.03, 1.2) if title.startswith("Relief") else (0.005, 5)))
    for axes in stack[1]:
        axes.set(xlabel="frequency [Hz]", ylabel="phase [deg]", ylim=(-95, 95), yticks=[-90, -45, 0, 45, 90])
    stack[1, 0].set_xlim(1, 3000)
    stack[1, 1].set_xlim(1, 1000)
    return {"impedance": figure}


def _draw(stack: np.ndarray, frequency: np.ndarray, value: np.ndarray, colour: str, label: str) -> None:
    stack[0].plot(frequency, np.abs(value) / UNIT, color=colour, label=label)
    stack[1].plot(frequency, np.degrees(np.angle(value)), color=colour)


def _at_the_teeth(data: Data) -> str:
    """What the gears see at the tooth frequency of 4000 rpm."""
    size = [float(np.interp(13 * 4000 / 60, data.frequency, np.abs(data.pump[w]))) / UNIT for _, _, w in POINTS[1:]]
    at = "At 866.7 Hz, the tooth frequency of 4000 rpm"
    return f"{at}, it is {size[0]:.2f} with the valve closed and {size[1]:.2f} regulating."


def tell(page: Page, data: Data) -> None:
    """The section of the page."""
    page.section("Impedance seen by the gears", 3)
    page.picture(
        "paper/impedance.svg",
        """Pressure per flow, linearised. Left: the relief valve with the bench's 70 cm³ at three flows. Right:
        the delivery volume of the whole pump, with its delivery line, at three points.""",
    )
    teeth = "" if len(data.pump) < len(POINTS) else _at_the_teeth(data)
    still, regulating = (abs(value[0]) / UNIT for value in list(data.pump.values())[:: len(data.pump) - 1])
    page.say(f"""The pump turns, so there is no point of rest: its delivery side is linearised at the angle at
        which a settled revolution ends. Slowly, the gears see {still:.2f} bar per L/min with the valve closed at
        3 bar, and {regulating:.2f} where it regulates. {teeth} Beyond 1 kHz the frozen angle is no fair picture
        any more, so nothing is shown there.""")
    page.verdicts(verdicts(data), "expected")
