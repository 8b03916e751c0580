"""Beyond the paper: a run-up from 500 to 4000 rpm, and its waterfall."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import crescentlab as cl
from crescentlab.analysis.spectrum.waterfall import Waterfall, waterfalls
from crescentlab.plotting import COLOURS
from crescentlab.report.comparison import Comparison, true_that
from crescentlab.report.page import Page
from crescentlab.report.pictures import new_figure
from studies.paper.effort import Effort
from studies.paper.runs import BAR, settled

RPM = math.pi / 30
TEETH = 13
HIGHEST = 3000.0
"""Frequency [Hz] up to which the waterfall is shown."""
CHECKED = (1000, 2000, 3000)
"""Speeds [rpm] at which the run-up is held against settled runs."""


@dataclass(frozen=True)
class Data:
    """Orders of the delivery pressure over the speed; first harmonic [Pa] by speed, in the run-up and settled."""

    found: Waterfall
    passing: dict[int, float]
    settled: dict[int, float]


@functools.cache
def circuit() -> cl.Circuit:
    """The pump at the test rig with a shaft that is run up."""
    return cl.load("crescent_pump_run_up")


def compute(effort: Effort) -> Data:
    """Run up, analyse by orders, and compare with settled speeds."""
    result = circuit().simulate()
    (found,) = waterfalls(result, ["p_delivery.p"], "shaft.shaft.omega", revolutions=4, highest=60)
    line = found.amplitude[:, _place(found, TEETH)]
    rising = np.flatnonzero(found.speed < 0.999 * found.speed.max())
    speeds = effort.of(CHECKED, CHECKED[:1])
    passing = {rpm: float(np.interp(rpm * RPM, found.speed[rising], line[rising])) for rpm in speeds}
    area = float(circuit().design().parameters[""]["throttle_area"].value)
    still = {rpm: settled(rpm, area).number(f"amplitude(delivery.p, {TEETH} * speed)") for rpm in speeds}
    return Data(found, passing, still)


def _place(found: Waterfall, order: int) -> int:
    return int(np.argmin(np.abs(found.orders - order)))


def verdicts(data: Data) -> list[Comparison]:
    """Orders of the ripple; the run-up against settled runs."""
    orders = sorted(float(data.found.orders[k]) for k in data.found.strongest(3))
    multiples = all(abs(order / TEETH - round(order / TEETH)) * TEETH <= 0.25 for order in orders)
    misses = [data.passing[rpm] / data.settled[rpm] - 1 for rpm in data.settled]
    return [
        true_that(
            "strongest orders of a run-up, 500 to 4000 rpm",
            "beyond the paper, Eq. 32",
            "13 per revolution and multiples",
            ", ".join(f"{order:g}" for order in orders),
            multiples and TEETH in orders,
            "one bin, a quarter of an order",
        ),
        true_that(
            "first harmonic in the run-up against settled runs",
            "beyond the paper",
            "equal, for the ramp is slow",
            f"within {100 * max(map(abs, misses)):.1f} % at {', '.join(map(str, data.settled))} rpm",
            max(map(abs, misses)) < 0.1,
            "10 %: a window of four revolutions smears what changes with the speed",
        ),
    ]


def pictures(data: Data) -> dict[str, Figure]:
    """Waterfall over frequency, and the harmonics over the speed."""
    figure = new_figure(10.0, 5.0)
    left, right = figure.subplots(1, 2, width_ratios=[3, 2])
    _draw_waterfall(left, data.found)
    found = data.found
    rpm = found.speed / RPM
    for k, colour in zip((1, 2, 3), COLOURS, strict=False):
        right.plot(rpm, found.amplitude[:, _place(found, TEETH * k)] / BAR, color=colour, label=f"order {TEETH * k}")
    right.plot(
        list(data.settled), [a / BAR for a in data.settled.values()], "o", color="black", label="order 13, settled"
    )
    right.set(xlabel="speed [rpm]", ylabel="amplitude [bar]", xlim=(500, 4000), ylim=(0, None))
    right.legend(loc="upper left")
    return {"waterfall": figure}


def _draw_waterfall(axes: Axes, found: Waterfall) -> None:
    """Ridges over frequency, the slow ones in front; orders below 2 are the ramp itself."""
    rpm = found.speed / RPM
    rows = np.unique([int(np.argmin(np.abs(rpm - n))) for n in np.arange(500, 4001, 125)])
    lift = 900 / (found.amplitude.max() / BAR)  # rpm on the axis per bar
    for row in rows[::-1]:
        size = np.where(found.orders < 2, 0.0, found.amplitude[row])
        seen = size > 4e-3 * found.amplitude.max()
        near = (seen | np.roll(seen, 1) | np.roll(seen, -1)) & (found.frequency[row] < HIGHEST)
        f = np.concatenate([[0], found.frequency[row][near], [HIGHEST]])
        ridge = np.concatenate([[0], np.where(seen, size, 0)[near], [0]]) / BAR * lift + rpm[row]
        axes.fill(f, ridge, facecolor="white", edgecolor=COLOURS[0], linewidth=0.7, zorder=5000 - rpm[row])
    axes.set(xlabel="frequency [Hz]", ylabel="speed [rpm], amplitude on top", xlim=(0, HIGHEST), ylim=(400, 5000))
    axes.grid(False)


def tell(page: Page, data: Data) -> None:
    """The section of the page."""
    first = data.found.amplitude[:, _place(data.found, TEETH)] / BAR
    page.section("Run-up", 3)
    page.picture(
        "paper/waterfall.svg",
        """Run-up from 500 to 4000 rpm in 2 s with one throttle (circuit crescent_pump_run_up). Left: spectra of
        the delivery pressure, one for each 125 rpm. Right: its orders; dots are settled runs.""",
    )
    page.say(f"""The rays are the orders 13, 26, 39 of the shaft. The first grows from {first[0]:.3f} bar at
        {data.found.speed[0] / RPM:.0f} rpm to {first.max():.2f} bar, steepest between 1000 and 1700 rpm, where it
        passes the first resonances of the delivery line.""")
    page.verdicts(verdicts(data), "expected")
