"""Metering edges of spools."""

from __future__ import annotations

import math

from crescentlab.components.fluids import SimpleOil
from crescentlab.components.spools import AnnularPort, RectangularSlots, TriangularNotches

from evidence import Number, evidence

BAR, MM = 1e5, 1e-3
RHO = 860.0
OIL = SimpleOil(density=RHO, kinematic_viscosity=30e-6, bulk_modulus=1e15)
AT = {"p_a": 70 * BAR, "p_b": 0.0, "v_rod": 0.0, "fluid": OIL}


@evidence(
    "annular_port",
    "rectangular_slots",
    "triangular_notches",
    source="geometry: pi d x, n b x, n x^2 tan(phi/2)",
    tolerance=1e-9,
    because="rounding",
)
def areas() -> list[Number]:
    """Areas at 0.3 mm: annular port of 10 mm; 4 slots of 3 mm; 4 notches of 60 deg; and at 3 mm the ends of 2 mm."""
    port = AnnularPort(diameter=10 * MM)
    slots = RectangularSlots(number=4, width=3 * MM, length=2 * MM)
    notches = TriangularNotches(number=4, angle=math.pi / 3, length=2 * MM)

    def area(part: AnnularPort | RectangularSlots | TriangularNotches, x: float) -> float:
        return float(part.equations(x_rod=x, **AT)["area"])

    return [
        Number("annular_port", 3 * math.pi * 1e-6, area(port, 0.3 * MM), "mm2"),
        Number("rectangular_slots", 3.6e-6, area(slots, 0.3 * MM), "mm2"),
        Number("rectangular_slots, fully open", 24e-6, area(slots, 3 * MM), "mm2"),
        Number("triangular_notches", 0.36e-6 / math.sqrt(3), area(notches, 0.3 * MM), "mm2"),
        Number("triangular_notches, fully open", 16e-6 / math.sqrt(3), area(notches, 3 * MM), "mm2"),
    ]


@evidence(
    "annular_port",
    "rectangular_slots",
    "triangular_notches",
    source="Merritt (1967), chapter 5: F = 2 Cd Cv A dp cos 69 deg, which is 0.43 A dp for Cd = 0.61 and Cv = 0.98",
    tolerance=4e-3,
    because="0.43 has two digits, 0.4285 in full",
)
def steady_flow_force() -> list[Number]:
    """Steady flow force at 0.3 mm and 70 bar over A dp."""
    jet = {"cd_max": 0.61, "jet_coefficient": 0.98}
    parts = (
        AnnularPort(diameter=10 * MM, **jet),
        RectangularSlots(number=4, width=3 * MM, length=2 * MM, **jet),
        TriangularNotches(number=4, length=2 * MM, **jet),
    )
    found = []
    for part in parts:
        got = part.equations(x_rod=0.3 * MM, **AT)
        found.append(Number(part.type_name(), 0.43, got["jet_force"] / (got["area"] * 70 * BAR)))
    return found


@evidence(
    "annular_port",
    "rectangular_slots",
    "triangular_notches",
    source="Merritt (1967), chapter 5: F = L Cd w sqrt(2 rho dp) dx/dt with the area gradient w",
    tolerance=1e-3,
    because="the flow number of the least hydraulic diameter leaves tanh(2 lambda/lambda_c) 4e-4 below 1",
)
def transient_flow_force() -> list[Number]:
    """Transient flow force at 0.3 mm, 70 bar and 0.5 m/s, damping length 20 mm."""
    jet = {"damping_length": 20 * MM}
    gradients = {
        AnnularPort(diameter=10 * MM, **jet): math.pi * 10 * MM,
        RectangularSlots(number=4, width=3 * MM, length=2 * MM, **jet): 12 * MM,
        TriangularNotches(number=4, angle=math.pi / 3, length=2 * MM, **jet): 2 * 4 * 0.3 * MM / math.sqrt(3),
    }
    found = []
    for part, gradient in gradients.items():
        got = part.equations(x_rod=0.3 * MM, **{**AT, "v_rod": 0.5})["transient_force"]
        expected = 20 * MM * 0.7 * gradient * math.sqrt(2 * RHO * 70 * BAR) * 0.5
        found.append(Number(part.type_name(), expected, got, "N"))
    return found
