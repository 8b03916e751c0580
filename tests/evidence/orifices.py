"""Orifices and throttles."""

from __future__ import annotations

import math

from crescentlab.components.fluids import SimpleOil
from crescentlab.components.orifices import Orifice, Throttle, VariableOrifice

from evidence import Number, evidence

BAR = 1e5
OIL = SimpleOil(density=850.0, kinematic_viscosity=30e-6, bulk_modulus=1e15)


@evidence(
    "orifice",
    source="Rundo & Corvaglia (2016), Eqs. 27-29, by hand",
    tolerance=2e-5,
    because="the expected values are rounded to five digits",
)
def discharge_coefficient() -> list[Number]:
    """Discharge coefficient of an orifice, D 1 mm, rho 850 kg/m^3, 30 cSt, Cd_max 0.7, lambda_c 1000."""
    part = Orifice(area=math.pi / 4 * 1e-6, hydraulic_diameter=1e-3, cd_max=0.7, lambda_c=1000.0)
    expected = {0.1: 0.21879, 1.0: 0.53965, 10.0: 0.69783}
    found = []
    for drop, cd in expected.items():
        q = part.equations(p_a=drop * BAR, p_b=0.0, fluid=OIL)["q"]
        found.append(Number(f"Cd at {drop:g} bar", cd, q / (part.area * math.sqrt(2 * drop * BAR / 850.0))))
    return found


@evidence(
    "throttle",
    "variable_orifice",
    source="Torricelli's law with Cd 0.7",
    tolerance=1e-6,
    because="tanh(2 lambda/lambda_c) is 1 to 1e-9 here, and the fluid's density varies by 1e-8",
)
def full_flow() -> list[Number]:
    """Flow through 10 mm^2 at 100 bar, turbulent: Cd A sqrt(2 dp/rho)."""
    expected = 0.7 * 10e-6 * math.sqrt(2 * 100 * BAR / 850.0)
    throttle = Throttle(area=10e-6).equations(p_a=100 * BAR, p_b=0.0, fluid=OIL)["q"]
    variable = VariableOrifice(area=20e-6).equations(p_a=100 * BAR, p_b=0.0, opening=0.5, fluid=OIL)["q"]
    return [
        Number("throttle", expected, throttle, "L/min"),
        Number("variable_orifice, 20 mm^2 half open", expected, variable, "L/min"),
    ]
