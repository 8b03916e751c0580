"""What cannot be known, as bands: plausible pumps drawn from ranges of clearances, volumes, air and spring."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from crescentlab.plotting import COLOURS
from crescentlab.report.comparison import CHOSEN, Comparison, true_that
from crescentlab.report.page import Page
from crescentlab.report.pictures import new_figure
from studies.paper.effort import Effort
from studies.paper.runs import BAR, LPM
from studies.paper.tables import table

RPM = math.pi / 30
BAND = (0.05, 0.5, 0.95)
HARMONICS = 6
SHOWN = 5
LEAST = 20
"""Fewer pumps than this make no band that anything could be said to lie in."""
WAVES = ((2000, 24.6, "Fig. 21: 2000 rpm, 3 bar"), (4000, 37.0, "Fig. 22: 4000 rpm, 6 bar"))
SPLIT, CLOSED = (2000, 17.4), (4000, 0.0)


@dataclass(frozen=True)
class Data:
    """Rows of the study."""

    rows: pd.DataFrame

    def at(self, rpm: int, area: float) -> pd.DataFrame:
        """Rows of one operating point; area in mm^2."""
        chosen = ((self.rows["speed"] / RPM).round() == rpm) & np.isclose(self.rows["throttle_area"], area * 1e-6)
        return self.rows[chosen]


def compute(effort: Effort) -> Data:
    """Run the study."""
    return Data(table("tolerances", effort, 16))


def waves(rows: pd.DataFrame) -> tuple[np.ndarray, np.ndarray]:
    """Angle over one pitch [0, 1], and each pump's p / mean p there from its Fourier coefficients; shape (rows, n)."""
    angle = np.linspace(0, 1, 61)
    made = np.repeat(rows["pressure"].to_numpy()[:, None], angle.size, axis=1)
    for k in range(1, HARMONICS + 1):
        made += 2 * np.outer(rows[f"c{k}"], np.cos(2 * np.pi * k * angle))
        made += 2 * np.outer(rows[f"s{k}"], np.sin(2 * np.pi * k * angle))
    return angle, made / rows["pressure"].to_numpy()[:, None]


def bands(data: Data) -> list[tuple[str, str, str, pd.Series, float, str]]:
    """What is told: words, operating point, what the paper says, the values, their unit in SI, and its name."""
    split, closed = data.at(*SPLIT), data.at(*CLOSED)
    told = [
        ("leakage", "2000 rpm, 5 bar", "not printed", split["leakage"], LPM, "L/min"),
        ("axial share of it", "2000 rpm, 5 bar", "roughly 1/3", split["axial_share"], 0.01, "%"),
        ("share of the tips", "2000 rpm, 5 bar", "about 50 %", split["tips_share"], 0.01, "%"),
        ("flow at the throttle", "2000 rpm, 5 bar", "not printed", split["flow"], LPM, "L/min"),
        ("regulated pressure", "4000 rpm, closed", "9 bar", closed["pressure"], BAR, "bar"),
    ]
    for rpm, area, words in WAVES:
        rows, where = data.at(rpm, area), words.split(": ")[1]
        told += [("ripple, peak to peak", where, "not printed", rows["swing"], BAR, "bar")]
        told += [
            (f"{name} harmonic", where, "not printed", rows[name], BAR * 1e-3, "mbar")
            for name in ("first", "second", "third")
        ]
    return told


def verdicts(data: Data) -> list[Comparison]:
    """Whether the paper's numbers are among those of plausible pumps, whose ranges lie about chosen numbers."""
    if len(data.at(*SPLIT)) < LEAST:
        return []
    rows = []
    for name, expected, says in (("axial_share", 1 / 3, "roughly 1/3"), ("tips_share", 0.5, "about 50 %")):
        rows.append(
            _inside(name.replace("_", " ") + " of the leakage", "6.2", says, expected, data.at(*SPLIT)[name], 0.01, "%")
        )
    rows.append(
        _inside("regulated pressure at 4000 rpm", "Fig. 19", "9 bar", 9 * BAR, data.at(*CLOSED)["pressure"], BAR, "bar")
    )
    return rows


def _inside(
    statement: str, source: str, says: str, expected: float, values: pd.Series, scale: float, unit: str
) -> Comparison:
    low, _, high = values.quantile(BAND)
    return true_that(
        f"{statement}, over plausible pumps",
        source,
        says,
        f"{low / scale:.3g} to {high / scale:.3g} {unit}",
        bool(low <= expected <= high),
        "inside the band of 90 %",
    ).resting_on(CHOSEN)


def pictures(data: Data) -> dict[str, Figure]:
    """Figs. 21 and 22 as bands over one pitch, and the distributions of what the paper does not print."""
    figure = new_figure(10.0, 6.2)
    top, bottom = figure.subplots(2, 2)
    for axes, (rpm, area, words) in zip(top, WAVES, strict=True):
        angle, made = waves(data.at(rpm, area))
        low, _, high = np.quantile(made, BAND, axis=0)
        axes.fill_between(
            angle * 360 / 13, low, high, color=COLOURS[0], alpha=0.25, linewidth=0, label="90 % of the pumps"
        )
        for k, wave in enumerate(made[:SHOWN]):
            axes.plot(
                angle * 360 / 13, wave, color=COLOURS[0], linewidth=0.8, label=f"{SHOWN} of them" if k == 0 else None
            )
        axes.set(title=words, xlabel="shaft angle over one pitch [deg]", ylabel="p / mean p [-]", xlim=(0, 360 / 13))
    top[0].legend(loc="lower right", fontsize=8)
    _histogram(bottom[0], data.at(*WAVES[0][:2])["first"] / BAR * 1e3, data.at(*WAVES[1][:2])["first"] / BAR * 1e3)
    split = data.at(*SPLIT)
    bottom[1].plot(split["leakage"] / LPM, 100 * split["tips_share"], "o", markersize=4, color=COLOURS[0])
    bottom[1].axhline(50, color=COLOURS[1], linewidth=1.2)
    bottom[1].set(xlabel="leakage at 2000 rpm, 5 bar [L/min]", ylabel="share of the tips [%]")
    bottom[1].annotate(
        "paper: about 50 %",
        (1, 50),
        xycoords=("axes fraction", "data"),
        xytext=(-2, 4),
        textcoords="offset points",
        horizontalalignment="right",
        color=COLOURS[1],
    )
    return {"tolerances": figure}


def _histogram(axes: Axes, slow: pd.Series, fast: pd.Series) -> None:
    edges = np.linspace(0, 1.05 * max(slow.max(), fast.max()), 25)
    for values, colour, label in ((slow, COLOURS[0], "2000 rpm, 3 bar"), (fast, COLOURS[1], "4000 rpm, 6 bar")):
        axes.hist(values, bins=edges, color=colour, alpha=0.6, label=label)
    axes.set(xlabel="first harmonic [mbar]", ylabel="pumps")
    axes.legend(loc="upper right", fontsize=8)


def tell(page: Page, data: Data) -> None:
    """The section of the page."""
    count = len(data.at(*SPLIT))
    page.section("What cannot be known")
    page.say(f"""The clearances, the volumes and the air of the pump that was measured are not printed, nor are
        the measured amplitudes; they were not read off the figures. What can be said instead is a band: {count}
        pumps drawn from plausible ranges by a Latin hypercube (studies/paper/tolerances.yaml lists the ranges;
        the throttle is the same for all). None of them is the truth, and the ranges are a judgement.""")
    page.picture(
        "paper/tolerances.svg",
        """Plausible pumps. Above: Figs. 21 and 22 of the paper over one pitch, as bands, with five of the
        pumps. Below: first harmonic, and leakage with the share of the tips.""",
    )
    page.table(
        ["", "at", "paper", "5 %", "median", "95 %"],
        [
            [
                words,
                where,
                says,
                *(f"{q / scale:.3g}" for q in values.quantile(BAND)[:-1]),
                f"{values.quantile(BAND[-1]) / scale:.3g} {unit}",
            ]
            for words, where, says, values, scale, unit in bands(data)
        ],
    )
    page.verdicts(verdicts(data))
