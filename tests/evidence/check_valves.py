"""Check valves."""

from __future__ import annotations

import math

from crescentlab.components.check_valves import CheckValve
from crescentlab.components.fluids import SimpleOil

from evidence import Number, evidence

BAR = 1e5
OIL = SimpleOil(density=860.0, kinematic_viscosity=30e-6, bulk_modulus=1e15)


@evidence(
    "check_valve",
    source="poppet without mass on a linear spring, and Torricelli's law with Cd 0.7; by hand",
    tolerance=1e-6,
    because="tanh(2 lambda/lambda_c) is 1 to 1e-9 here, and the fluid's density varies by 1e-8",
)
def opening() -> list[Number]:
    """80 mm^2, cracking at 1 bar, fully open 0.5 bar above: flow at 0.9, 1.25, 2 bar, and 10 bar backwards."""
    valve = CheckValve(area=80e-6, cracking_pressure=1 * BAR, opening_range=0.5 * BAR)
    found = []
    for drop, lift in ((0.9, 0.0), (1.25, 0.5), (2.0, 1.0), (-10.0, 0.0)):
        expected = 0.7 * lift * 80e-6 * math.sqrt(2 * abs(drop) * BAR / 860.0)
        q = valve.equations(p_a=(20 + drop) * BAR, p_b=20 * BAR, fluid=OIL)["q"]
        found.append(Number(f"flow at {drop:g} bar", expected, q, "L/min"))
    return found
