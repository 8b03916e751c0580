"""Beyond the paper: the pump inside the lubrication circuit of an engine."""

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
from studies.paper.runs import BAR, LPM
from studies.paper.tables import table

RPM = math.pi / 30
BRANCHES = {
    "mains": "main bearings",
    "rods": "rod bearings",
    "jets": "piston cooling jets",
    "valve_train": "valve train",
    "others": "turbocharger, tensioner, balancer",
}


@dataclass(frozen=True)
class Data:
    """Rows by speed; the flow of main bearing 3 by hand [m^3/s]; the oil's density over that at 0 bar."""

    rows: pd.DataFrame
    bearing: np.ndarray
    density: np.ndarray


def compute(effort: Effort) -> Data:
    """Run the study, and the bearing's law by hand."""
    rows = table("lubrication", effort, {"speed": ("800 rpm", "4000 rpm")}).sort_values("speed")
    design = cl.load("lubrication").design()
    lands, (oil,) = design.instances["main_3.lands"].component, design.fluids.values()
    law = lands.parallel * math.pi * lands.diameter * lands.clearance**3 * (1 + 1.5 * lands.eccentricity**2)
    p = rows["groove_3"].to_numpy()
    nu = np.array([float(oil.kinematic_viscosity(x / 2)) for x in p])
    density = np.array([float(oil.density(x) / oil.density(0.0)) for x in rows["pump"]])
    return Data(rows, law * p / (12 * nu * float(oil.rho_0) * lands.length), density)


def verdicts(data: Data) -> list[Comparison]:
    """Continuity, and the law of one bearing."""
    rows = data.rows
    engine = sum(rows[name] for name in BRANCHES)
    missing = (engine + rows["leakage"] + rows["relief_flow"]) / (data.density * rows["displaced"]) - 1
    bearing = rows["main_3"].to_numpy() / data.bearing - 1
    return [
        true_that(
            "what the pump displaces",
            "beyond the paper: continuity",
            "reaches the engine or leaks in the pump",
            f"within {100 * missing.abs().max():.2g} % at {len(rows)} speeds",
            bool(missing.abs().max() < 2e-3),
            "0.2 %: pressures and densities move within a pitch",
        ),
        true_that(
            "flow of main bearing 3",
            "beyond the paper: Eq. 23",
            "2 π d c³ (1 + 1.5 ε²)/(12 μ l) p of two lands",
            f"the same within {100 * float(np.abs(bearing).max()):.1g} %",
            float(np.abs(bearing).max()) < 1e-3,
            "0.1 %: mean of the pressure for the mean of the flow",
        ),
    ]


def pictures(data: Data) -> dict[str, Figure]:
    """Pressures and the branches' flows over the speed."""
    figure = new_figure(10.0, 3.8)
    left, right = figure.subplots(1, 2)
    rows, rpm = data.rows, data.rows["speed"] / RPM
    names = {
        "pump": "pump",
        "gallery": "gallery, at the filter",
        "far_gallery": "gallery, far end",
        "head": "cylinder head",
    }
    for (name, label), colour in zip(names.items(), COLOURS, strict=False):
        left.plot(rpm, rows[name] / BAR, "-o", markersize=3, color=colour, label=label)
    left.set(xlabel="speed [rpm]", ylabel="mean pressure [bar]", xlim=(rpm.min(), rpm.max()), ylim=(0, None))
    left.legend(loc="upper left")
    flows = [rows[name] / LPM for name in BRANCHES]
    right.stackplot(rpm, *flows, labels=list(BRANCHES.values()), colors=COLOURS, alpha=0.85, linewidth=0)
    right.set(xlabel="speed [rpm]", ylabel="mean flow [L/min]", xlim=(rpm.min(), rpm.max()))
    handles, labels = right.get_legend_handles_labels()
    right.legend(handles[::-1], labels[::-1], loc="upper left", fontsize=8)
    return {"lubrication": figure}


def tell(page: Page, data: Data) -> None:
    """The section of the page."""
    page.section("In a lubrication circuit", 3)
    page.picture(
        "paper/lubrication.svg",
        """The pump in the circuit lubrication: filter with bypass, gallery of five volumes, bearings as annular
        gaps, jets, head. Hot oil of 7.5 cSt. Left: pressures; right: where the oil goes.""",
    )
    last = data.rows.iloc[-1]
    page.say(f"""The jets open at 1.8 bar, which is where the gallery's pressure bends. At
        {last["speed"] / RPM:.0f} rpm the ripple is {last["swing"] / BAR:.2f} bar peak to peak at the pump, and
        {last["gallery_swing"] / BAR:.3f} bar at the far end of the gallery. All dimensions of the engine are
        assumed; the circuit's file names its sources.""")
    page.verdicts(verdicts(data), "expected")
