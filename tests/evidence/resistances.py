"""Resistances with a length, and by a measured curve."""

from __future__ import annotations

import math

from crescentlab.components.fluids import SimpleOil
from crescentlab.components.resistances import MeasuredResistance, PipeResistance, ShortTube
from scipy.optimize import brentq

from evidence import Number, evidence

BAR, LPM, MM = 1e5, 1e-3 / 60, 1e-3
RHO, NU = 850.0, 30e-6
OIL = SimpleOil(density=RHO, kinematic_viscosity=NU, bulk_modulus=1e15)
THIN = 1e-6
"""Viscosity [m^2/s] for high Reynolds numbers at moderate drops."""


def _friction_factor(reynolds: float, relative_roughness: float) -> float:
    """Darcy factor [-] of a pipe of 12 mm x 1 m that passes what makes `reynolds`."""
    d, length = 12 * MM, 1.0
    oil = SimpleOil(density=RHO, kinematic_viscosity=THIN, bulk_modulus=1e15)
    pipe = PipeResistance(diameter=d, length=length, roughness=relative_roughness * d)
    v = reynolds * THIN / d

    def missing(drop: float) -> float:
        return float(pipe.equations(p_a=drop, p_b=0.0, fluid=oil)["q"] / (math.pi / 4 * d * d) - v)

    head = RHO * v * v / 2 * length / d
    return float(brentq(missing, 1e-3 * head, 64 * head * (1 + 1 / reynolds), xtol=1e-300, rtol=1e-14) / head)


@evidence(
    "pipe_resistance",
    source="Hagen-Poiseuille: q = pi d^4 dp/(128 mu l)",
    tolerance=1e-6,
    because="Churchill's blending adds less than 1e-6 below Re = 1000",
)
def laminar() -> list[Number]:
    """Capillary of 1 mm x 100 mm, 25.5 mPa s, at 1e-3, 1 and 20 bar (Re = 816)."""
    pipe = PipeResistance(diameter=1 * MM, length=100 * MM)
    return [
        Number(
            f"flow at {drop:g} bar",
            math.pi * 1e-12 * drop * BAR / (128 * RHO * NU * 0.1),
            pipe.equations(p_a=drop * BAR, p_b=0.0, fluid=OIL)["q"],
            "L/min",
        )
        for drop in (1e-3, 1.0, 20.0)
    ]


@evidence(
    "pipe_resistance",
    source="Churchill_1977 of C. Bell, fluids: Fluid dynamics component of ChEDL, documentation",
    tolerance=1e-8,
    because="the inversion is exact to rounding, and the fluid's density varies by 1e-10",
)
def churchill() -> list[Number]:
    """Churchill's Darcy factor, published to all digits."""
    return [Number("f at Re 1e5, roughness/d 1e-4", 0.018462624566280075, _friction_factor(1e5, 1e-4))]


@evidence(
    "pipe_resistance",
    source="Colebrook-White, solved; Blasius: 0.3164 Re^(-1/4)",
    tolerance=0.04,
    because="Churchill's explicit formula stays within some per cent of them, and they of the measurements",
)
def turbulent() -> list[Number]:
    """Darcy factors in turbulent flow, smooth and rough."""

    def colebrook(reynolds: float, rough: float) -> float:
        return float(brentq(lambda x: x + 2 * math.log10(rough / 3.7 + 2.51 * x / reynolds), 1, 30)) ** -2

    found = [Number(f"Blasius, Re {re:g}", 0.3164 * re**-0.25, _friction_factor(re, 0.0)) for re in (1e4, 3e4, 1e5)]
    for re, rough in ((1e4, 1e-3), (1e5, 1e-4), (1e6, 1e-3), (1e7, 1e-2)):
        what = f"Colebrook, Re {re:g}, roughness/d {rough:g}"
        found.append(Number(what, colebrook(re, rough), _friction_factor(re, rough)))
    return found


@evidence(
    "short_tube",
    source="Merritt (1967), chapter 3, in Rabie (2009), Eqs. 2.40 and 2.41: Cd = (1.5 + 13.74 x^0.5)^-0.5 and "
    "(2.28 + 64 x)^-0.5, x = l/(d Re)",
    tolerance=0.02,
    because="the two formulas, 1.7 % apart at x = 0.02 and more beyond, are joined smoothly by Shah's weight",
)
def short() -> list[Number]:
    """Discharge coefficients of a tube of 1 mm x 5 mm."""
    d, length = 1 * MM, 5 * MM
    tube = ShortTube(diameter=d, length=length)
    found = []
    for x in (1e-4, 2e-3, 1e-2, 4e-2, 0.2, 5.0):
        cd = (1.5 + 13.74 * math.sqrt(x) if x < 0.02 else 2.28 + 64 * x) ** -0.5
        v = length * NU / (d * d * x)
        drop = RHO / 2 * (v / cd) ** 2
        q = tube.equations(p_a=drop, p_b=0.0, fluid=OIL)["q"]
        found.append(Number(f"Cd at x = {x:g}", cd, q / (math.pi / 4 * d * d * math.sqrt(2 * drop / RHO))))
    return found


@evidence(
    "measured_resistance",
    source="Poiseuille and Bernoulli in series, by hand",
    tolerance=1e-7,
    because="the sums by hand are exact; the fluid's density varies by 1e-9",
)
def measured() -> list[Number]:
    """0.005 q + 2e-4 q^2 bar at q L/min with 860 kg/m^3 and 30 cSt; three times as thick; a tenth lighter."""
    part = MeasuredResistance(laminar=0.005 * BAR / LPM, turbulent=2e-4 * BAR / LPM**2)
    thick = SimpleOil(density=860.0, kinematic_viscosity=90e-6, bulk_modulus=1e15)
    same = SimpleOil(density=860.0, kinematic_viscosity=30e-6, bulk_modulus=1e15)
    light = SimpleOil(density=774.0, kinematic_viscosity=30e-6, bulk_modulus=1e15)
    return [
        Number("0.18 bar", 20 * LPM, part.equations(p_a=0.18 * BAR, p_b=0.0, fluid=same)["q"], "L/min"),
        Number("0.75 bar", 50 * LPM, part.equations(p_a=0.75 * BAR, p_b=0.0, fluid=same)["q"], "L/min"),
        Number("0.38 bar, 90 cSt", 20 * LPM, part.equations(p_a=0.38 * BAR, p_b=0.0, fluid=thick)["q"], "L/min"),
        Number("0.162 bar, 774 kg/m^3", 20 * LPM, part.equations(p_a=0.162 * BAR, p_b=0.0, fluid=light)["q"], "L/min"),
    ]
