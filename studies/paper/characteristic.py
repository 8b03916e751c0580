"""Flow over pressure at four speeds, throttle from open to closed: Fig. 19."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from crescentlab.plotting import COLOURS
from crescentlab.report.comparison import CHOSEN, GIVEN, Comparison, Unit, true_that, within
from crescentlab.report.page import Page
from crescentlab.report.pictures import new_figure
from studies.paper.effort import Effort
from studies.paper.runs import BAR, LPM, Run, settled
from studies.paper.tables import table

RPM = math.pi / 30
CRACKING, ABOUT = 6.5 * BAR, 0.5 * BAR
SHUT = 0.01 * LPM
"""Flow below which the valve counts as closed."""


FEW = {
    "speed": ("1000 rpm", "4000 rpm"),
    "throttle_area": ("400 mm^2", *(f"= {a} mm^2 * speed / (1000 rpm)" for a in ("9.5", "2")), "0 mm^2"),
}
"""Settings of the short form."""


@dataclass(frozen=True)
class Data:
    """Means [SI] by speed [rpm], one row per setting from open to closed; two points at 4000 rpm taken apart."""

    means: dict[int, pd.DataFrame]
    balance: dict[str, float]
    before_throttle: float


def compute(effort: Effort) -> Data:
    """Run the study, and take the points at 4000 rpm with the throttle closed and wide open apart."""
    rows = table("figure_19", effort, FEW)
    means = {round(speed / RPM): group for speed, group in rows.groupby("speed")}
    means = {rpm: group.sort_values("throttle_area", ascending=False) for rpm, group in means.items()}
    wide = settled(4000, float(rows["throttle_area"].max()))
    return Data(means, _balance(settled(4000, 0.0)), 1 - wide.mean("p_throttle.p") / wide.mean("delivery.p"))


def _balance(closed: Run) -> dict[str, float]:
    """What the delivery pressure consists of [Pa]: the forces on the spool over its face."""
    parts = closed.result.design.instances
    face = math.pi / 4 * parts["relief.nose"].component.diameter ** 2
    spring = parts["relief.spring"].component
    return {
        "spring, as set": spring.preload / face,
        "spring, by the lift": spring.stiffness * closed.mean("relief.x") / face,
        "flow force": closed.mean("relief.holes.jet_force") / face,
        "spring chamber": closed.mean("relief.p_chamber.value"),
        "delivery": closed.mean("delivery.p"),
    }


def verdicts(data: Data) -> list[Comparison]:
    """What section 6.2 says of Fig. 19 in words."""
    return [_regulated(data), _opening(data), *_closed(data), _rising(data), _not_reached(data), _losses(data)]


def _regulated(data: Data) -> Comparison:
    return within(
        "delivery pressure at 4000 rpm, throttle closed",
        "Fig. 19, 6.2",
        9 * BAR,
        float(data.means[4000]["pressure"].iloc[-1]),
        0.5 * BAR,
        Unit("pressure", "bar", 3),
        "printed in whole bar",
        about=True,
    ).resting_on(CHOSEN)


def _opening(data: Data) -> Comparison:
    opened = [m.loc[m["relief_flow"] > SHUT, "pressure"].min() for m in data.means.values()]
    shut = [m.loc[m["relief_flow"] <= SHUT, "pressure"].max() for m in data.means.values()]
    says = f"closed in all settings up to {max(shut) / BAR:.2f} bar, open in all from {min(opened) / BAR:.2f} bar"
    holds = max(shut) < CRACKING + ABOUT and min(opened) > CRACKING - ABOUT
    return true_that(
        "relief valve",
        "Fig. 19, 6.2",
        "closed below about 6.5 bar",
        says,
        holds,
        "± 0.5 bar for 'about', as for the 9 bar; mean pressures",
    ).resting_on(GIVEN)


def _closed(data: Data) -> list[Comparison]:
    """Below the valve's opening the flow lost is the leakage gained."""
    rows = []
    for rpm, m in data.means.items():
        shut = m[m["relief_flow"] <= SHUT]
        first, last = shut.iloc[0], shut.iloc[-1]
        lost, leaked = first["flow"] - last["flow"], last["leakage"] - first["leakage"]
        span = f"{first['pressure'] / BAR:.1f} to {last['pressure'] / BAR:.1f} bar"
        rows.append(
            true_that(
                f"reduction of the flow before the valve opens, {rpm} rpm",
                "Fig. 19, 6.2",
                "only due to the leakages",
                f"{lost / LPM:.2f} L/min lost, {leaked / LPM:.2f} leaked ({span})",
                abs(lost / leaked - 1) < 0.05,
                "5 %: the rest is the oil's density, which changes by 0.5 % of the whole flow at most",
            )
        )
    return rows


def _rising(data: Data) -> Comparison:
    slopes, rise = [], 0.0
    for m in data.means.values():
        regulating = m.loc[m["relief_flow"] > SHUT, "pressure"].to_numpy()
        slopes += list(np.diff(regulating))
        rise = max(rise, float(regulating[-1] - regulating[0]))
    share = data.balance
    sources = sum(share[k] for k in ("spring, as set", "spring, by the lift", "flow force", "spring chamber"))
    return true_that(
        "while the valve regulates",
        "Fig. 19, 6.2",
        "the pressure continues to increase: spring force, flow forces, pressure in the spring chamber",
        f"it rises at every setting, by up to {rise / BAR:.1f} bar; the three explain "
        f"{100 * sources / share['delivery']:.1f} % of the {share['delivery'] / BAR:.2f} bar",
        min(slopes) > 0 and abs(sources / share["delivery"] - 1) < 0.01,
        "monotone; forces balance within 1 %",
    )


def _not_reached(data: Data) -> Comparison:
    lowest = {rpm: float(m["pressure"].min()) for rpm, m in data.means.items()}
    found = ", ".join(f"{p / BAR:.2f} bar at {rpm} rpm" for rpm, p in lowest.items())
    rising = list(lowest.values()) == sorted(lowest.values())
    return true_that(
        "lowest pressure with the throttle wide open",
        "Fig. 19, 6.2",
        "at high speed a low pressure cannot be imposed (drops in the delivery pipe)",
        found,
        rising and lowest[4000] > 1 * BAR > 4 * lowest[1000],
        "above 1 bar at 4000 rpm, less than a quarter of a bar at 1000",
    )


def _losses(data: Data) -> Comparison:
    share = data.before_throttle
    return true_that(
        "where that pressure is lost",
        "6.2",
        "in the delivery pipe",
        f"{100 * share:.0f} % of it before the throttle",
        share > 0.9,
        "nine tenths",
    )


def pictures(data: Data) -> dict[str, Figure]:
    """Fig. 19, and what the regulated pressure consists of."""
    figure = new_figure(8.5, 5.0)
    axes = figure.subplots()
    for (rpm, m), colour in zip(data.means.items(), COLOURS, strict=False):
        axes.plot(m["pressure"] / BAR, m["flow"] / LPM, "-o", markersize=3.5, color=colour, label=f"{rpm} rpm")
        axes.annotate(
            f"{rpm} rpm",
            (m["pressure"].iloc[0] / BAR, m["flow"].iloc[0] / LPM),
            xytext=(4, 5),
            textcoords="offset points",
            color=colour,
        )
    axes.axvline(6.5, color="black", linewidth=0.8, linestyle=":")
    axes.annotate("6.5 bar", (6.5, 0), xytext=(-4, 6), textcoords="offset points", horizontalalignment="right")
    axes.set(
        xlabel="mean delivery pressure [bar]", ylabel="mean flow at the throttle [L/min]", xlim=(0, 10), ylim=(0, 60)
    )
    return {"figure_19": figure}


def tell(page: Page, data: Data) -> None:
    """The section of the page."""
    page.section("Flow and pressure")
    settings = min(len(m) for m in data.means.values())
    page.picture(
        "paper/figure_19.svg",
        f"""Fig. 19 of the paper: steady characteristics at 65 °C. One dot per setting of the throttle,
        {settings} at each speed, from 400 mm² to closed.""",
    )
    page.say("""The measured dots of Fig. 19 are not printed as numbers, so what is compared is what the text says
        of the figure. Each setting is brought to its periodic steady state (`analysis: periodic`) and averaged over
        a pitch. The paper itself doubts its last measured points, at 4000 rpm
        with the throttle nearly closed, for the oil was hotter there.""")
    page.table(
        ["at 4000 rpm, throttle closed", "bar", "share"],
        [[name, f"{p / BAR:.2f}", f"{100 * p / data.balance['delivery']:.0f} %"] for name, p in data.balance.items()],
    )
    page.verdicts(verdicts(data))
