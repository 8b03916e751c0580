"""What the model cannot do, and how the paper was read."""

from __future__ import annotations

from dataclasses import dataclass

from crescentlab.report.page import Page
from studies.paper.effort import Effort
from studies.paper.runs import BAR, area_for, settled

READINGS = (
    """ρ₁, ρ₂ are the base radii (22.049 and 27.138 mm); with the pitch circle of the list of symbols Eq. 8 is
    imaginary.""",
    "ρₑ of Eqs. 14 and 16 is ρₒ of Eqs. 3 to 5; n_t of Eq. 17 is n_i of the list; b₃ is listed but never used.",
    """The trapped volume exists for ν_d < ν₀₂ - ν₀₁, 6.46 of 27.69 deg. Else P₂ = P₁, and Eq. 12 is without Δφ.""",
    """Eqs. 24 and 25 are positive towards suction, and their drag always acts towards delivery. A chain of N volumes
    has N + 1 tip gaps.""",
    """A volume that closes at the suction side, and one that joins delivery, is an event that moves pressures by one
    place, not a smooth blend.""",
    """Tip gaps, gap 9, the second half of gap 2 and the relief valve return to the suction volume; gaps 1, 4, 6, 7 go
    to the sump.""",
    "The crescent of 34 deg lies half on each side of the line of centres; the paper prints only the whole.",
    "Eq. 31 takes the velocity in the vena contracta, √(2 Δp/ρ), and an angle of 69 deg; the paper prints no angle.",
    "The mean delivery volume leaves out half of the duct, for the duct's model has its own capacity.",
)
"""How the paper was read where it is open, misprinted, or says two things."""


@dataclass(frozen=True)
class Data:
    """Highest trapped and mean delivery pressure [Pa] at 2000 rpm, 5 bar."""

    peak: float
    delivery: float


def compute(effort: Effort) -> Data:
    """How far the trapped volume is squeezed."""
    run = settled(2000, area_for(2000, 5.0, tolerance=5e-3))
    return Data(run.number("maximum(trapped.p)"), run.mean("delivery.p"))


def tell(page: Page, data: Data) -> None:
    """The last sections of the page."""
    page.section("What the model cannot do")
    page.items(
        [
            f"""The trapped volume reaches {data.peak / BAR:.0f} bar at {data.delivery / BAR:.0f} bar of delivery
            pressure, for gaps 3 and 4 alone let its oil out. The paper says of its own model that a pressure peak in
            the meshing zone cannot be reproduced; nor can it be believed here.""",
            "The paper's model cannot simulate incomplete filling at high speed, and this one cannot either.",
            "A shaft that turns backwards is not modelled.",
            "Temperature is constant. The paper suspects hotter oil behind its last measured points at 4000 rpm.",
        ]
    )
    page.section("How the paper was read")
    page.say("Where the paper is open or prints two things, this is what the circuit rests on:")
    page.items(READINGS)
