"""Gaps."""

from __future__ import annotations

import math

from crescentlab.components.fluids import SimpleOil
from crescentlab.components.gaps import (
    AnnularGap,
    AxialFaceGap,
    LaminarGap,
    MovingAnnularGap,
    RotatingAnnularGap,
    VariableHeightGap,
    VariableWidthGap,
)
from scipy.integrate import quad

from evidence import Number, evidence

BAR, MM, UM = 1e5, 1e-3, 1e-6
MU = 26e-3
OIL = SimpleOil(density=850.0, kinematic_viscosity=MU / 850.0, bulk_modulus=1e15)


@evidence(
    "annular_gap",
    source="pi d c^3 (1 + 1.5 eps^2) dp/(12 mu l), by hand; Rundo & Corvaglia (2016), Eq. 23",
    tolerance=1e-5,
    because="the expected values are rounded to five digits",
)
def eccentric() -> list[Number]:
    """Eccentric gap, d 10 mm, c 10 um, l 10 mm, 26 mPa s, 100 bar."""
    found = []
    for eccentricity, litres in ((0.0, 0.0060415), (0.5, 0.0083071), (1.0, 0.0151038)):
        gap = AnnularGap(diameter=10 * MM, clearance=10 * UM, length=10 * MM, eccentricity=eccentricity)
        q = gap.equations(p_a=100 * BAR, p_b=0.0, fluid=OIL)["q"]
        found.append(Number(f"eccentricity {eccentricity:g}", litres * 1e-3 / 60, q, "L/min"))
    return found


@evidence(
    "laminar_gap",
    "variable_height_gap",
    "variable_width_gap",
    source="plane Poiseuille flow: the parabola v = dp/(2 mu l) z (h - z) integrated over the gap",
    tolerance=1e-7,
    because="quadrature to 1e-10; the fluid's density varies by 1e-8",
)
def parabola() -> list[Number]:
    """Flat gap 10 mm x 50 um, 20 mm long, at 10 bar; also reached by 20 + 0.5 x 60 um, and as a quarter of 40 mm."""
    h, per_width = 50 * UM, 10 * BAR / (2 * MU * 20 * MM)
    expected = 10 * MM * quad(lambda z: per_width * z * (h - z), 0, h, epsabs=0)[0]
    drop = {"p_a": 10 * BAR, "p_b": 0.0, "fluid": OIL}
    fixed = LaminarGap(width=10 * MM, height=h, length=20 * MM)
    lifted = VariableHeightGap(width=10 * MM, height=20 * UM, length=20 * MM, change_factor=0.5)
    quarter = VariableWidthGap(width=40 * MM, height=h, length=20 * MM)
    return [
        Number("laminar_gap", expected, fixed.equations(**drop)["q"], "L/min"),
        Number("variable_height_gap", expected, lifted.equations(change=60 * UM, **drop)["q"], "L/min"),
        Number("variable_width_gap", expected, quarter.equations(opening=0.25, **drop)["q"], "L/min"),
    ]


@evidence(
    "axial_face_gap",
    source="Reynolds' equation between parallel discs: q = pi h^3 dp/(6 mu ln(r2/r1)), p over r by quadrature",
    tolerance=1e-6,
    because="the flow by hand has seven digits; quadrature to 1e-10",
)
def radial() -> list[Number]:
    """Discs of 10 and 20 mm, 20 um apart, from 100 bar to 20 bar: leakage, and the force that lifts them."""
    gap = AxialFaceGap(inner_diameter=10 * MM, outer_diameter=20 * MM, height=20 * UM)
    found = gap.equations(p_a=100 * BAR, p_b=20 * BAR, fluid=OIL)

    def pressure(r: float) -> float:
        fallen = quad(lambda s: 1 / s, 5 * MM, r)[0] / quad(lambda s: 1 / s, 5 * MM, 10 * MM)[0]
        return (100 - 80 * fallen) * BAR

    lift = quad(lambda r: 2 * math.pi * r * pressure(r), 5 * MM, 10 * MM)[0]
    return [
        Number("leakage", 0.1115658e-3 / 60, found["q"], "L/min"),
        Number("lifting force", lift, found["lift"], "N"),
    ]


def _around(local: object) -> float:
    """A local density around the gap, integrated over the angle [rad]."""
    return quad(local, 0, 2 * math.pi, epsabs=0, epsrel=1e-11)[0]  # type: ignore[call-overload,no-any-return]


@evidence(
    "moving_annular_gap",
    source="plane Couette-Poiseuille flow at each angle, h = c (1 + eps cos theta), integrated round the piston",
    tolerance=1e-7,
    because="quadrature to 1e-10; the fluid's density varies by 1e-8",
)
def sliding() -> list[Number]:
    """Piston of 20 mm, 15 um radial, 30 mm long, eccentric by 0.6, at 0.5 m/s against 50 bar."""
    d, c, length, eps, v, drop = 20 * MM, 15 * UM, 30 * MM, 0.6, 0.5, -50 * BAR
    found = MovingAnnularGap(diameter=d, clearance=c, length=length, eccentricity=eps).equations(
        p_a=0.0, p_b=-drop, v_rod=v, fluid=OIL
    )

    def height(angle: float) -> float:
        return c * (1 + eps * math.cos(angle))

    flow = d / 2 * _around(lambda a: height(a) ** 3 * drop / (12 * MU * length) + height(a) * v / 2)
    drag = d / 2 * length * _around(lambda a: MU * v / height(a) - height(a) * drop / (2 * length))
    return [
        Number("flow", flow, found["q"], "L/min"),
        Number("drag", drag, found["drag"], "N"),
        Number("loss", flow * drop + drag * v, found["loss"], "W"),
    ]


@evidence(
    "rotating_annular_gap",
    source="Petroff (1883): T = 4 pi^2 mu n r^3 l/c, by hand; Sommerfeld's integral for the eccentric shaft",
    tolerance=1e-6,
    because="by hand to seven digits; the fluid's density varies by 1e-8",
)
def petroff() -> list[Number]:
    """Shaft of 30 mm, 20 um radial, 20 mm long, 3000 rpm, 26 mPa s: concentric, and eccentric by 0.8 (times 5/3)."""
    concentric = 4 * math.pi**2 * MU * 50.0 * (15 * MM) ** 3 * 20 * MM / (20 * UM)
    found = []
    for eccentricity, more in ((0.0, 1.0), (0.8, 5 / 3)):
        gap = RotatingAnnularGap(diameter=30 * MM, clearance=20 * UM, length=20 * MM, eccentricity=eccentricity)
        torque = gap.equations(p_a=0.0, p_b=0.0, omega_shaft=100 * math.pi, fluid=OIL)["torque"]
        found.append(Number(f"torque, eccentricity {eccentricity:g}", more * concentric, torque, "Nm"))
    return found
