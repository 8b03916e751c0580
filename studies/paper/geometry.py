"""Gears and cover: Table 3 (displacement), Fig. 18 (volume derivatives), Table 1 (deflection), contacts of Table 4."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from crescentlab.plotting import COLOURS
from crescentlab.report.comparison import GIVEN, Comparison, Unit, all_within, true_that, within
from crescentlab.report.page import Page
from crescentlab.report.pictures import new_figure
from studies.paper.effort import Effort
from studies.paper.gear_picture import gears_in_mesh
from studies.paper.runs import CC, DEG, MM, RTOL, SOLVER, area_for, pump, revolution

DISPLACEMENT = 13.65 * CC / (2 * math.pi)
PITCH = 2 * math.pi / 13
CONTACTS = {34: (1.22, 1.85), 40: (1.44, 2.18), 46: (1.65, 2.51), 52: (1.87, 2.84)}
"""Table 4: mean contact points of driver and driven gear, by extension of the crescent in degrees."""
HALF_DEGREE = 0.5 * DEG
RATE = 1e-9 / DEG
"""A cubic millimetre per degree of the shaft [m^3/rad]."""


@dataclass(frozen=True)
class Data:
    """One revolution of the gears at 2000 rpm and 5 bar; deflections by pressure in bar; contacts by extension."""

    phi: np.ndarray
    rates: dict[str, np.ndarray]
    exists: np.ndarray
    jumps: dict[str, list[float]]
    periods: np.ndarray
    displacement: float
    deflection: dict[int, float]
    contacts: dict[int, tuple[float, float]]


def compute(effort: Effort) -> Data:
    """Everything from the running circuit."""
    run = revolution(2000, area_for(2000, 5.0, tolerance=5e-3))
    rates = {name: run.last(f"gears.{name}") for name in ("dVd", "dVs", "dVt")}
    events = [h.time for h in run.result.trajectory.happenings if "gears.meshes" in h.names]
    angles = np.interp(events, run.result.time, run.result["shaft.phi"])
    exists = run.last("gears.exists") > 0.5
    return Data(
        phi=run.last("shaft.phi") - run.last("shaft.phi")[0],
        rates=rates,
        exists=exists,
        jumps=_jumps(run.times, exists, rates),
        periods=np.diff(angles),
        displacement=run.mean("gears.displacement"),
        deflection={bar: _deflection(bar) for bar in (3, 6, 8)},
        contacts={extension: _contacts(extension) for extension in CONTACTS},
    )


def _jumps(times: np.ndarray, exists: np.ndarray, rates: dict[str, np.ndarray]) -> dict[str, list[float]]:
    """Relative jumps of dV_d and dV_s where the trapped volume starts and where it ends."""
    found: dict[str, list[float]] = {key: [] for key in ("dVd starts", "dVd ends", "dVs starts", "dVs ends")}
    for k in np.flatnonzero(np.diff(times) == 0):
        if exists[k + 1] != exists[k]:
            when = "starts" if exists[k + 1] else "ends"
            for name in ("dVd", "dVs"):
                found[f"{name} {when}"].append(float((rates[name][k + 1] - rates[name][k]) / rates[name].mean()))
    return found


def _deflection(bar: int) -> float:
    """Deflection of the cover [m] that the circuit uses at a delivery pressure."""
    given = {"start_pressure": f"{bar} bar"}
    result = pump().simulate("1 us", given, solver=SOLVER, rtol=RTOL, compile=True)
    return float(result["cover_deflection.value"][0])


def _contacts(extension: int) -> tuple[float, float]:
    """Mean numbers of contacts on the driver and on the driven gear, of the circuit's own chains."""
    parts = pump().design({"crescent_extension": f"{extension} deg"}).instances
    driver, driven = (parts[name].component for name in ("driver", "driven"))
    return driver.extension / driver.pitch, driven.extension / driven.pitch


def verdicts(data: Data) -> list[Comparison]:
    """Tables 1 and 3, Fig. 18, the columns of contacts of Table 4."""
    return [_displacement(data), *_figure_18(data), *_table_1(data), *_contact_columns(data)]


def _displacement(data: Data) -> Comparison:
    return within(
        "displacement of the gears",
        "Table 3",
        DISPLACEMENT,
        data.displacement,
        7e-3,
        Unit("displacement", "cc/rev", 5),
        "rounding of Table 3; 0.05 mm on R_t2 alone are 0.095 cc",
        relative=True,
    )


def _figure_18(data: Data) -> list[Comparison]:
    dVd, dVs, dVt = (data.rates[n] for n in ("dVd", "dVs", "dVt"))
    trapped, jumps = dVt[data.exists], data.jumps
    largest = {key: max(map(abs, values), default=0.0) for key, values in jumps.items()}
    least = {key: min(map(abs, values), default=0.0) for key, values in jumps.items()}
    pitch, extremes = float(np.mean(data.periods)), (dVd.max() / RATE, dVs.min() / RATE, trapped.max() / RATE)
    return [
        true_that(
            "sign of dV_d",
            "Fig. 18, 6.1",
            "always negative",
            f"at most {extremes[0]:.3g} mm³/deg",
            dVd.max() < 0,
            "sign, over a revolution",
        ),
        true_that(
            "sign of dV_s",
            "Fig. 18, 6.1",
            "always positive",
            f"at least {extremes[1]:.3g} mm³/deg",
            dVs.min() > 0,
            "sign, over a revolution",
        ),
        true_that(
            "sign of dV_t",
            "Eq. 5",
            "no number printed; negative, since a trapped volume is squeezed",
            f"at most {extremes[2]:.3g} mm³/deg while it exists, else 0",
            bool(trapped.max() < 0 and np.all(dVt[~data.exists] == 0)),
            "sign, while it exists",
        ),
        true_that(
            "sum of the three",
            "Eqs. 3 to 5",
            "0",
            f"at most {np.abs(dVd + dVs + dVt).max() / dVs.max():.1g} of dV_s",
            bool(np.abs(dVd + dVs + dVt).max() < 1e-12 * dVs.max()),
            "rounding of floats, 1e-12",
        ),
        true_that(
            "where dV_d jumps",
            "Fig. 18, 6.1",
            "where the trapped volume starts to exist",
            f"by {100 * least['dVd starts']:.3g} % there, by {100 * largest['dVd ends']:.1g} % where it ends",
            least["dVd starts"] > 1e-2 > 1e-6 > largest["dVd ends"],
            "above 1 % there, below 1e-6 elsewhere",
        ),
        true_that(
            "where dV_s jumps",
            "Fig. 18, 6.1",
            "where the trapped volume ends existing",
            f"by {100 * least['dVs ends']:.3g} % there, by {100 * largest['dVs starts']:.1g} % where it starts",
            least["dVs ends"] > 1e-3 > 1e-6 > largest["dVs starts"],
            "above 0.1 % there, below 1e-6 elsewhere",
        ),
        within(
            "period of the functions",
            "Fig. 18, 6.1",
            27.69 * DEG,
            pitch,
            0.005 * DEG,
            Unit("angle", "deg", 6),
            "digits printed",
        ),
    ]


def _table_1(data: Data) -> list[Comparison]:
    printed = {6: 0.016 * MM, 8: 0.028 * MM}
    return [
        within(
            f"deflection of the cover from 3 to {bar} bar, largest",
            "Table 1",
            expected,
            data.deflection[bar] - data.deflection[3],
            0.0005 * MM,
            Unit("length", "mm", 3),
            "digits printed",
        ).resting_on(GIVEN)
        for bar, expected in printed.items()
    ]


def _contact_columns(data: Data) -> list[Comparison]:
    unit = Unit("ratio", "", 3)
    rows = []
    for k, (gear, ratio) in enumerate((("driver", 1.0), ("driven", (16 / 13) ** 2))):
        rows.append(
            all_within(
                f"contact points of the {gear} gear at 34, 40, 46, 52 deg of crescent",
                "Table 4",
                [row[k] for row in CONTACTS.values()],
                [row[k] for row in data.contacts.values()],
                HALF_DEGREE / PITCH * ratio,
                unit,
                "half a degree of the extension, printed in whole degrees",
            )
        )
    return rows


def pictures(data: Data) -> dict[str, Figure]:
    """Fig. 18 over three pitches, and its two large curves drawn out."""
    figure = new_figure(10.0, 3.8)
    whole, delivery, suction = figure.subplots(1, 3, width_ratios=[2, 1, 1])
    shown = data.phi <= 3 * PITCH
    labels = {"dVd": "delivery", "dVs": "suction", "dVt": "trapped"}
    drawn_out = {"dVd": delivery, "dVs": suction}
    for (name, label), colour in zip(labels.items(), COLOURS, strict=False):
        for axes in [whole, *([drawn_out[name]] if name in drawn_out else [])]:
            axes.plot(data.phi[shown] / DEG, data.rates[name][shown] / RATE, color=colour, label=label)
    whole.axhline(0, color="black", linewidth=0.6)
    whole.set(xlabel="shaft angle [deg]", ylabel="dV/dφ [mm³/deg]", xlim=(0, 3 * PITCH / DEG))
    whole.set_xticks([0, 27.69, 55.38, 83.08])
    whole.legend(loc="center left", bbox_to_anchor=(0.0, 0.72))
    for axes, name in ((delivery, "delivery"), (suction, "suction")):
        axes.set(title=f"{name}, drawn out", xlabel="shaft angle [deg]", xlim=(0, 2 * PITCH / DEG))
        axes.set_xticks([0, 27.69, 55.38])
    return {"gears": gears_in_mesh(), "figure_18": figure}


def tell(page: Page, data: Data) -> None:
    """The section of the page."""
    page.section("Gears and cover")
    page.picture(
        "paper/gears.svg",
        """Figs. 2 and 3 of the paper, drawn from the circuit's own geometry. Left: delivery, suction, and the tooth
        space that the crescent has closed (green); the shaft turns counterclockwise. Right: the mesh 3 deg after a
        volume was trapped: line of contact, contacts, and T, where it touches the base circle; no fillets.""",
    )
    page.picture(
        "paper/figure_18.svg",
        """Fig. 18 of the paper: derivatives of delivery, suction and trapped volume over the shaft's angle, as
        the running circuit has them. Ticks at whole pitches of 27.69 deg.""",
    )
    starts, ends = (np.mean(np.abs(data.jumps[key])) for key in ("dVd starts", "dVs ends"))
    page.say(f"""The delivery's curve jumps by {100 * starts:.2g} % where a new contact traps a volume; the
        suction's jump, where that volume joins it, is only {100 * ends:.2g} %. Angle 0 is the beginning of the
        revolution shown, where a trapped volume starts.""")
    page.say("""Table 1 is an input: the deflection of the cover is given to the circuit as a table that continues
        the paper's largest increments down to zero pressure.""")
    page.verdicts(verdicts(data))
