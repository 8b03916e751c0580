"""Faces, holes and lands of spools."""

from __future__ import annotations

import math

from crescentlab.components.fluids import SimpleOil
from crescentlab.components.valve_parts import (
    LeakageLand,
    RoundHoles,
    SpoolEnd,
    SpringChamberEnd,
    SpringChamberPressure,
)

from evidence import Number, evidence

BAR, MM, LPM = 1e5, 1e-3, 1e-3 / 60
OIL = SimpleOil(density=860.0, kinematic_viscosity=30e-6, bulk_modulus=1e15)


@evidence(
    "spool_end",
    "spring_chamber_end",
    source="p A and A v with A = pi/4 (D^2 - d^2), by hand",
    tolerance=2e-5,
    because="the expected values are rounded to five digits",
)
def faces() -> list[Number]:
    """10 bar on faces of 14 mm and of 20 mm with a rod of 12 mm, moving at 0.1 m/s."""
    full, ring = SpoolEnd(diameter=14 * MM), SpoolEnd(diameter=20 * MM, rod_diameter=12 * MM)
    end = SpringChamberEnd(diameter=14 * MM)
    of_full, of_ring = (part.equations(p_port=10 * BAR, v_rod=0.1, fluid=OIL) for part in (full, ring))
    of_end = end.equations(pressure=10 * BAR, p_port=0.0, v_rod=0.1, fluid=OIL)
    return [
        Number("spool_end, force", 153.94, of_full["force"], "N"),
        Number("spool_end, flow", 15.394e-6, of_full["q_port"], "cm3/s"),
        Number("spool_end, ring, force", 201.06, of_ring["force"], "N"),
        Number("spring_chamber_end, force", -153.94, of_end["force"], "N"),
        Number("spring_chamber_end, flow", -15.394e-6, of_end["q_port"], "cm3/s"),
    ]


@evidence(
    "round_holes",
    source="segment of a circle, r^2 acos(1 - h/r) - (r - h) sqrt(2 r h - h^2)",
    tolerance=4e-5,
    because="the expected values are rounded to five decimals",
)
def uncovered() -> list[Number]:
    """Round holes of radius 1 mm, uncovered by 0.2, 0.5, 1 and 1.5 mm."""
    holes = RoundHoles(diameter=2 * MM)
    found = []
    for height, area in ((0.2, 0.16350), (0.5, 0.61418), (1.0, 1.57080), (1.5, 2.52741)):
        got = holes.equations(p_a=0.0, p_b=0.0, x_rod=height * MM, v_rod=0.0, fluid=OIL)["area"]
        found.append(Number(f"area at {height:g} mm", area * 1e-6, got, "mm2"))
    return found


@evidence(
    "round_holes",
    source="Rundo & Corvaglia (2016), Eq. 31: F = 0.82 rho Q v cos 69 deg with v = sqrt(2 dp/rho)",
    tolerance=1e-6,
    because="tanh(2 lambda/lambda_c) is 1 to 1e-8 here",
)
def flow_force() -> list[Number]:
    """Flow and flow force of four holes of 5.5 mm, half open at 8 bar."""
    holes = RoundHoles(number=4, diameter=5.5 * MM, jet_coefficient=0.82, cd_max=0.74, lambda_c=50.0)
    got = holes.equations(p_a=8 * BAR, p_b=0.0, x_rod=2.75 * MM, v_rod=0.0, fluid=OIL)
    v = math.sqrt(2 * 8 * BAR / 860.0)
    q = 4 * 0.74 * math.pi / 8 * (5.5 * MM) ** 2 * v
    return [
        Number("flow", q, got["q"], "L/min"),
        Number("force", 0.82 * 860.0 * q * v * math.cos(math.radians(69)), got["jet_force"], "N"),
    ]


@evidence(
    "round_holes",
    source="Merritt (1967), chapter 5: F = L Cd w sqrt(2 rho dp) dx/dt, the area gradient w = n 2 sqrt(h (d - h))",
    tolerance=1e-6,
    because="tanh(2 lambda/lambda_c) is 1 to 1e-7 here",
)
def transient_flow_force() -> list[Number]:
    """Transient flow force of four holes of 5.5 mm at 70 bar and 0.5 m/s, damping length 20 mm, both ways."""
    found = []
    for height in (1.0, 2.75, 4.5):
        gradient = 4 * 2 * math.sqrt(height * (5.5 - height)) * MM
        expected = 20 * MM * 0.74 * gradient * math.sqrt(2 * 860.0 * 70 * BAR) * 0.5
        for length, sign in ((20 * MM, 1), (-20 * MM, -1)):
            holes = RoundHoles(number=4, diameter=5.5 * MM, cd_max=0.74, lambda_c=50.0, damping_length=length)
            got = holes.equations(p_a=70 * BAR, p_b=0.0, x_rod=height * MM, v_rod=0.5, fluid=OIL)
            name = f"{height:g} mm uncovered, {'out of' if sign > 0 else 'into'} the chamber"
            found.append(Number(name, sign * expected, got["transient_force"], "N"))
    return found


@evidence(
    "leakage_land",
    source="pi d c^3 (1 + 1.5 eps^2) dp/(12 mu l) of Rundo & Corvaglia (2016), Eq. 23, given to five digits; "
    "pi d mu l v/c of Newton's law of friction",
    tolerance=1e-5,
    because="the expected values are rounded to five digits",
)
def land() -> list[Number]:
    """A land of 10 mm, clearance 10 um, 10 mm long at 26 mPa s: leakage at 100 bar, drag at 1 m/s."""
    oil = SimpleOil(density=850.0, kinematic_viscosity=26e-3 / 850.0, bulk_modulus=1e15)
    found = []
    for eccentricity, litres in ((0.0, 0.0060415), (0.5, 0.0083071), (1.0, 0.0151038)):
        part = LeakageLand(diameter=10 * MM, clearance=1e-5, overlap=10 * MM, eccentricity=eccentricity)
        q = part.equations(p_a=100 * BAR, p_b=0.0, x_rod=0.0, v_rod=0.0, fluid=oil)["q"]
        found.append(Number(f"leakage, eccentricity {eccentricity:g}", litres * LPM, q, "L/min"))
    moving = LeakageLand(diameter=10 * MM, clearance=1e-5, overlap=10 * MM)
    drag = moving.equations(p_a=0.0, p_b=0.0, x_rod=0.0, v_rod=1.0, fluid=oil)["f_rod"]
    return [*found, Number("drag", 0.81681, drag, "N")]


@evidence(
    "spring_chamber_pressure",
    source="Rundo & Corvaglia (2016), section 4.2: a Q + b Q^2, by hand",
    tolerance=1e-9,
    because="rounding",
)
def back_pressure() -> list[Number]:
    """a = 0.003 bar/(L/min), b = 3.6e-4 bar/(L/min)^2: 0.414 bar at 30 L/min, none backwards."""
    part = SpringChamberPressure(linear=0.003 * BAR / LPM, quadratic=3.6e-4 * BAR / LPM**2)
    return [
        Number("at 30 L/min", 0.414 * BAR, part.equations(flow=30 * LPM)["pressure"], "bar"),
        Number("at -30 L/min", 0.0, part.equations(flow=-30 * LPM)["pressure"], "bar"),
    ]
