"""Orifices and throttles."""

from __future__ import annotations

import math

from crescentlab.components.fluids import SimpleOil
from crescentlab.components.orifices import LaminarTurbulentOrifice, Orifice, RatedOrifice, Throttle, VariableOrifice

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


@evidence(
    "laminar_turbulent_orifice",
    source="creeping flow through a thin plate: hole d^3 dp/(24 mu) (Sampson, 1891), slit pi b^2 w dp/(32 mu) "
    "(Hasimoto, J. Phys. Soc. Japan 13 (1958) 633-639); hole of Wuest (1954), in Merritt (1967): pi d^3 dp/(50.4 mu)",
    tolerance=1e-2,
    because="the coefficients 0.1629, 0.1567 and 0.1992 are rounded to three or two digits, and they enter squared",
)
def creeping_flow() -> list[Number]:
    """Laminar limit, 1 Pa: a round hole of 1 mm and a slit of 0.1 mm by 10 mm."""
    area, mu = math.pi / 4 * 1e-6, 850.0 * 30e-6
    parts = {
        "hole, 0.163": (LaminarTurbulentOrifice(area=area, laminar_coefficient=0.163), 1e-9 / (24 * mu)),
        "hole, Wuest's 0.2": (LaminarTurbulentOrifice(area=area), math.pi * 1e-9 / (50.4 * mu)),
        "slit, 0.157": (
            LaminarTurbulentOrifice(area=1e-6, hydraulic_diameter=0.2e-3, laminar_coefficient=0.157),
            math.pi * 1e-8 * 1e-2 / (32 * mu),
        ),
    }
    return [
        Number(what, expected, part.equations(p_a=1.0, p_b=0.0, fluid=OIL)["q"], "mm3/s")
        for what, (part, expected) in parts.items()
    ]


@evidence(
    "laminar_turbulent_orifice",
    source="Merritt (1967), chapter 3: Re_t = (0.611/0.2)^2 = 9.3; C_d = pi/(pi + 2) of von Mises for high Re",
    tolerance=3e-3,
    because="9.3 has two digits, 9.333 in full",
)
def transition() -> list[Number]:
    """At Re_t the drop is half laminar, half turbulent, so Cd is its end value over root 2."""
    part, d = LaminarTurbulentOrifice(area=math.pi / 4 * 1e-6), 1e-3
    turbulent = math.pi / (math.pi + 2)
    found = []
    for what, re, expected in (("Cd at Re 9.3", 9.3, turbulent / math.sqrt(2)), ("Cd at Re 1e6", 1e6, turbulent)):
        v = re * 30e-6 / d
        drop = 850.0 / 2 * (v / expected) ** 2
        q = part.equations(p_a=drop, p_b=0.0, fluid=OIL)["q"]
        found.append(Number(what, expected, q / (part.area * math.sqrt(2 * drop / 850.0))))
    return found


@evidence(
    "rated_orifice",
    source="orifice equation: the flow goes with the root of drop over density; by hand",
    tolerance=1e-4,
    because="rounded by (0.01 bar/dp)^2/4, 6e-5 at 0.64 bar",
)
def rated() -> list[Number]:
    """60 L/min at 10 bar with 850 kg/m^3: 60, 120 and 15.1789 L/min at 10, 40 and 0.64 bar; more with a lighter oil."""
    part = RatedOrifice(rated_flow=1e-3, rated_drop=10 * BAR, reference_density=850.0)
    lighter = SimpleOil(density=680.0, kinematic_viscosity=30e-6, bulk_modulus=1e15)
    found = [
        Number(f"{drop:g} bar", litres * 1e-3 / 60, part.equations(p_a=drop * BAR, p_b=0.0, fluid=OIL)["q"], "L/min")
        for drop, litres in ((10.0, 60.0), (40.0, 120.0), (0.64, 15.178933))
    ]
    q = part.equations(p_a=10 * BAR, p_b=0.0, fluid=lighter)["q"]
    return [*found, Number("10 bar, 680 kg/m^3", 67.08204e-3 / 60, q, "L/min")]
