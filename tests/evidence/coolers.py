"""Coolers."""

from __future__ import annotations

import math

from crescentlab.components.coolers import Cooler
from crescentlab.components.fluids import SimpleOil
from crescentlab.components.resistances import PipeResistance

from evidence import Number, evidence

BAR, LPM = 1e5, 1e-3 / 60


@evidence(
    "cooler",
    source="32 mu l v/d^2 (Hagen-Poiseuille) and 1.5 rho v^2/2 (entry 0.5, exit 1), by hand",
    tolerance=1e-6,
    because="the friction of the tubes is Churchill's, less than 1e-6 above laminar at their Re = 199",
)
def bundle() -> list[Number]:
    """50 tubes of 4 mm x 500 mm at 60 L/min, 32 cSt: the curve of the bundle, and the bundle itself."""
    rho, nu, n, d, length, q = 860.0, 32e-6, 50, 4e-3, 0.5, 60 * LPM
    area = n * math.pi / 4 * d * d
    laminar, turbulent = 32 * rho * nu * length / (d * d * area), 1.5 * rho / (2 * area * area)
    drop = laminar * q + turbulent * q * q
    oil = SimpleOil(density=rho, kinematic_viscosity=nu, bulk_modulus=1e15)
    curve = Cooler(laminar=laminar, turbulent=turbulent, reference_density=rho, reference_viscosity=nu)
    tubes = PipeResistance(length=length, diameter=d, loss_coefficient=1.5, parallel=n)
    return [
        Number("cooler", q, curve.equations(p_a=drop, p_b=0.0, fluid=oil)["q"], "L/min"),
        Number("pipe_resistance with 50 tubes", q, tubes.equations(p_a=drop, p_b=0.0, fluid=oil)["q"], "L/min"),
    ]
