"""What the authors leave open: the ripple over air, volume, cover and crescent; other teeth from the same circuit."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

import crescentlab as cl
from crescentlab.plotting import COLOURS
from crescentlab.report.comparison import Comparison, true_that
from crescentlab.report.page import Page
from crescentlab.report.pictures import new_figure
from studies.paper.effort import Effort
from studies.paper.runs import BAR, CC, DEG, LPM
from studies.paper.tables import table

RPM = math.pi / 30
CRESCENT = 34.0
"""Extension of the crescent [deg], of which ``suction_share`` lies on the suction side."""


@dataclass(frozen=True)
class Axis:
    """A varied parameter: its column, what it is called, how its values are shown."""

    column: str
    title: str
    scale: float
    offset: float = 0.0

    def shown(self, values: pd.Series) -> np.ndarray:
        """Values as shown."""
        return values.to_numpy() / self.scale - self.offset


AXES = (
    Axis("fluid.air_fraction", "air at atmospheric pressure [%]", 0.01),
    Axis("gears.delivery_volume_mean", "delivery volume without duct [cm³]", CC),
    Axis("delivery.wall_area", "yielding area of the cover [mm²]", 1e-6),
    Axis("gears.suction_share", "crescent turned towards suction [deg]", 1 / CRESCENT, 0.5 * CRESCENT),
)


FEW = {
    "fluid.air_fraction": ("0.5 %", "0.1 %"),
    "gears.delivery_volume_mean": ("13.8 cm^3", "28 cm^3"),
    "delivery.wall_area": ("600 mm^2", "1200 mm^2"),
    "gears.suction_share": ("0.5", "0.4853", "0.5147"),
}
"""Settings of the short form."""


@dataclass(frozen=True)
class Data:
    """Rows of the two studies; the oil's density over that at 0 bar, by row of the second."""

    ripple: pd.DataFrame
    teeth: pd.DataFrame
    density: np.ndarray


def compute(effort: Effort) -> Data:
    """Run both studies."""
    teeth = table("teeth", effort, {"driver_teeth": ("12",), "crescent_extension": ("34 deg",)})
    (oil,) = cl.load("crescent_pump").design().fluids.values()
    density = np.array([float(oil.density(p) / oil.density(0.0)) for p in teeth["pressure"]])
    return Data(table("ripple_sensitivity", effort, FEW), teeth, density)


def rows_of(data: Data, axis: Axis, rpm: int) -> pd.DataFrame:
    """Rows in which only ``axis`` differs from the circuit's own values, the row of these included."""
    rows = data.ripple[(data.ripple["speed"] / RPM).round() == rpm]
    own, others = rows.iloc[0], [other.column for other in AXES if other is not axis]
    alike = np.all([np.isclose(rows[name], own[name]) for name in others], axis=0)
    return rows[alike].sort_values(axis.column)


def verdicts(data: Data) -> list[Comparison]:
    """6.1: teeth are parameters; 6.3: the bulk modulus rules the ripple."""
    return [_parameters(data), _modulus_matters(data)]


def _parameters(data: Data) -> Comparison:
    t = data.teeth
    kept = (t["flow"] + t["leakage"] + t["relief_flow"]) / (data.density * t["displaced"])
    worst = float((kept - 1).abs().max())
    pairs = sorted({(int(a), int(b)) for a, b in zip(t["driver_teeth"], t["driven_teeth"], strict=True)})
    return true_that(
        "other teeth and crescents",
        "6.1",
        "number of teeth supplied as a parameter, the circuit is not modified",
        f"{len(t)} pumps with {', '.join(f'{a}/{b}' for a, b in pairs)} teeth run; "
        f"what they displace is delivered or leaks within {100 * worst:.2g} %",
        worst < 1e-3,
        "0.1 %: the pressure moves within a pitch",
    )


def _modulus_matters(data: Data) -> Comparison:
    rows = rows_of(data, AXES[0], 2000)
    change = float(rows["first"].max() / rows["first"].min())
    share = f"{100 * rows['fluid.air_fraction'].min():.2g} to {100 * rows['fluid.air_fraction'].max():.2g} %"
    return true_that(
        "influence of the bulk modulus on the ripple",
        "6.3",
        "the shape is highly influenced by the bulk modulus",
        f"air of {share} changes the first harmonic at 2000 rpm by a factor of {change:.1f}",
        change > 2,
        "a factor of 2",
    )


def pictures(data: Data) -> dict[str, Figure]:
    """One panel per parameter: first harmonic and swing over it."""
    figure = new_figure(10.0, 5.6)
    for axes, axis in zip(figure.subplots(2, 2).ravel(), AXES, strict=True):
        for rpm, line in ((2000, "-"), (4000, "--")):
            rows = rows_of(data, axis, rpm)
            x = axis.shown(rows[axis.column])
            axes.plot(
                x,
                rows["swing"] / BAR,
                line,
                color=COLOURS[0],
                marker="o",
                markersize=3,
                label=f"peak to peak, {rpm} rpm",
            )
            axes.plot(
                x,
                rows["first"] / BAR,
                line,
                color=COLOURS[1],
                marker="o",
                markersize=3,
                label=f"first harmonic, {rpm} rpm",
            )
        axes.axvline(axis.shown(data.ripple[axis.column])[0], color="black", linewidth=0.8, linestyle=":")
        axes.set(xlabel=axis.title, ylabel="ripple [bar]", ylim=(0, None))
    figure.axes[0].legend(loc="upper right", fontsize=8)
    return {"sensitivity": figure}


def tell(page: Page, data: Data) -> None:
    """The section of the page."""
    page.section("What the authors leave open")
    page.picture(
        "paper/sensitivity.svg",
        """Ripple of the delivery pressure at 2000 rpm, 3 bar and 4000 rpm, 6 bar, one unknown at a time;
        dotted: the circuit's own value. The crescent's extension stays 34 deg, only its position changes.""",
    )
    page.say(_what_is_seen(data))
    page.say("""The same circuit file with other teeth (tip and root radii follow from module and numbers of
        teeth) and two crescents, at 2000 rpm with one throttle:""")
    page.table(
        ["teeth", "crescent", "displacement", "pressure", "flow", "leakage", "peak to peak", "first harmonic"],
        [_teeth_row(row) for _, row in data.teeth.iterrows()],
    )
    page.verdicts(verdicts(data))


def _what_is_seen(data: Data) -> str:
    turned = rows_of(data, AXES[3], 2000)
    degrees = AXES[3].shown(turned[AXES[3].column])
    half = np.interp([-0.5, 0.0, 0.5], degrees, turned["first"])
    change = 100 * float(np.abs(half[[0, 2]] / half[1] - 1).max())
    air = rows_of(data, AXES[0], 4000)
    span = f"{100 * air['fluid.air_fraction'].min():.2g} to {100 * air['fluid.air_fraction'].max():.2g} %"
    worst = float(100 * air.loc[air["first"].idxmax(), "fluid.air_fraction"])
    return f"""Half a degree of the crescent's position, which the paper does not print, moves the first harmonic
        at 2000 rpm by up to {change:.0f} %. Air decides most of all: it moves the line's resonances, and within
        {span} the first harmonic at 4000 rpm is largest with {worst:.2g} %. The paper chose the air so that its
        measured curves were met best. The panels show that the other unknowns could have served as well, so such a
        fit does not show that they are right."""


def _teeth_row(row: pd.Series) -> list[str]:
    return [
        f"{row['driver_teeth']:.0f}/{row['driven_teeth']:.0f}",
        f"{row['crescent_extension'] / DEG:.0f} deg",
        f"{row['displacement'] * 2 * math.pi / CC:.2f} cc/rev",
        f"{row['pressure'] / BAR:.2f} bar",
        f"{row['flow'] / LPM:.2f} L/min",
        f"{row['leakage'] / LPM:.2f} L/min",
        f"{row['swing'] / BAR:.2f} bar",
        f"{row['first'] / BAR * 1e3:.0f} mbar",
    ]
