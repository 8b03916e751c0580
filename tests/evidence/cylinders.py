"""Cylinders and cushions."""

from __future__ import annotations

import math

from building import circuit
from crescentlab.components.cylinders import Cushion, DoubleActingCylinder, SingleActingCylinder
from crescentlab.components.fluids import SimpleOil

from evidence import Number, evidence

BAR, MM = 1e5, 1e-3
STIFF = SimpleOil(density=850.0, kinematic_viscosity=30e-6, bulk_modulus=1e15)
FLUID = {"type": "simple_oil", "density": "850 kg/m^3", "kinematic_viscosity": "30 cSt", "bulk_modulus": "1.4 GPa"}
CAP, RING = math.pi / 4 * 0.05**2, math.pi / 4 * (0.05**2 - 0.03**2)


@evidence(
    "double_acting_cylinder",
    source="H. E. Merritt, Hydraulic Control Systems (1967), chapter 6: k = beta (A1^2/V1 + A2^2/V2), w = sqrt(k/m)",
    tolerance=1e-4,
    because="a swing of 4 um changes the volumes by 0.004 %; relative tolerance of the run, 1e-9",
)
def hydraulic_spring() -> list[Number]:
    """100 kg on a closed 50/30 mm cylinder of 400 mm, 50 cm^3 dead on each side, at mid-stroke: 1.75 swings on."""
    parts = {
        "cylinder": {"type": "double_acting_cylinder", "piston_diameter": "50 mm", "rod_diameter": "30 mm",
                     "stroke": "400 mm", "cap_dead_volume": "50 cm^3", "rod_dead_volume": "50 cm^3"},
        "load": {"type": "mass", "mass": "100 kg", "start": {"x": "200 mm", "v": "1 mm/s"}},
        "one": {"type": "plug"},
        "two": {"type": "plug"},
    }  # fmt: skip
    nets = {
        "r": ["load.port", "cylinder.rod"],
        "a": ["cylinder.cap", "one.port"],
        "b": ["cylinder.annulus", "two.port"],
    }
    stiffness = 1.4e9 * (CAP**2 / (50e-6 + CAP * 0.2) + RING**2 / (50e-6 + RING * 0.2))
    w = math.sqrt(stiffness / 100)
    stop = 1.75 * 2 * math.pi / w
    result = circuit(components=parts, nets=nets, fluid=FLUID, simulation={"stop": f"{stop} s"}).simulate(rtol=1e-9)
    x, v = float(result["load.x"][-1]) - 0.2, float(result["load.v"][-1])
    return [
        Number("displacement, -v_0/w", -1e-3 / w, x, "um"),
        Number("velocity", 0.0, v, "mm/s", size=10e-3),
        Number("rise of pressure on the rod's side", 1.4e9 * RING * x / (50e-6 + RING * 0.2),
               float(result["cylinder.annulus_pressure"][-1]), "bar"),
    ]  # fmt: skip


@evidence(
    "double_acting_cylinder",
    "single_acting_cylinder",
    source="definition of pressure, displacement of a piston, Hooke's law, Hagen-Poiseuille's proportionality",
    tolerance=1e-9,
    because="rounding; the stiff oil yields by 1e-8 at 100 bar, which no figure here feels",
)
def forces() -> list[Number]:
    """50/30 mm at 100 and 20 bar, 300 N s/m, 0.1 m/s, 0.2 (L/min)/bar past the piston; plunger of 40 mm with spring."""
    part = DoubleActingCylinder(
        piston_diameter=0.05, rod_diameter=0.03, stroke=0.4, cap_dead_volume=50e-6, rod_dead_volume=50e-6,
        leakage_conductance=0.2e-3 / 60 / BAR, viscous_friction=300.0,
    )  # fmt: skip
    now = part.equations(
        cap_pressure=100 * BAR, annulus_pressure=20 * BAR, q_cap=0.0, q_annulus=0.0, x_rod=0.1, v_rod=0.1, fluid=STIFF
    )
    plunger = SingleActingCylinder(
        piston_diameter=0.04, stroke=0.3, dead_volume=20e-6, preload=500.0, spring_stiffness=2000.0
    ).equations(pressure=50 * BAR, q_cap=0.0, x_rod=0.1, v_rod=0.0, fluid=STIFF)
    return [
        Number("force, p1 A1 - p2 A2 - B v", 1e7 * CAP - 2e6 * RING - 30, now["force"], "N"),
        Number("flow past the piston", 16e-3 / 60, now["leakage"], "L/min"),
        Number(
            "volume filled, x A1 + (s - x) A2 + dead", 0.1 * CAP + 0.3 * RING + 1e-4, now["content"], "cm3", size=10
        ),
        Number("force of the plunger, p A - F_0 - k x", 5e6 * math.pi / 4 * 0.04**2 - 700, plunger["force"], "N"),
    ]


@evidence(
    "single_acting_cylinder",
    source="H. E. Merritt, Hydraulic Control Systems (1967), chapter 6: k = beta A^2/V, with the spring beside it",
    tolerance=1e-4,
    because="a swing of 10 um changes the volume by 0.004 %; relative tolerance of the run, 1e-9",
)
def single_spring() -> list[Number]:
    """50 kg at mid-stroke on a closed plunger of 40 mm with a spring of 1 MN/m: 1.75 swings on."""
    area = math.pi / 4 * 0.04**2
    start = 1e6 * 0.15 / area
    parts = {
        "cylinder": {"type": "single_acting_cylinder", "piston_diameter": "40 mm", "stroke": "300 mm",
                     "dead_volume": "20 cm^3", "spring_stiffness": "1 kN/mm",
                     "start": {"pressure": f"{start} Pa"}},
        "load": {"type": "mass", "mass": "50 kg", "start": {"x": "150 mm", "v": "1 mm/s"}},
        "cap": {"type": "plug"},
    }  # fmt: skip
    nets = {"r": ["load.port", "cylinder.rod"], "a": ["cylinder.cap", "cap.port"]}
    w = math.sqrt((1.4e9 * area**2 / (20e-6 + area * 0.15) + 1e6) / 50)
    stop = 1.75 * 2 * math.pi / w
    result = circuit(components=parts, nets=nets, fluid=FLUID, simulation={"stop": f"{stop} s"}).simulate(rtol=1e-9)
    return [Number("displacement, -v_0/w", -1e-3 / w, float(result["load.x"][-1]) - 0.15, "um")]


@evidence(
    "cushion",
    source="orifice equation with Cd 0.7: dp = rho/2 (A_p v_0/(Cd A_0))^2 at all positions while v = v_0 sqrt(z)",
    tolerance=5e-4,
    because="the remaining area, 1 % of the whole, adds (A_r/A_0)^2/(2 z), 4e-4 of the flow at 1/8",
)
def constant_deceleration() -> list[Number]:
    """A piston of 50 mm that slows from 0.5 m/s over 20 mm, 40 mm^2: at 1, 1/2 and 1/8 of the way."""
    part = Cushion(area=40e-6, remaining_area=0.4e-6, length=20 * MM, profile="constant_deceleration")
    expected = 850.0 / 2 * (CAP * 0.5 / (0.7 * 40e-6)) ** 2
    found = []
    for z in (1.0, 0.5, 0.125):
        q = part.equations(p_chamber=expected, p_port=0.0, x_rod=z * 20 * MM, fluid=STIFF)["q"]
        found.append(Number(f"velocity at {z:g} of the length", 0.5 * math.sqrt(z), q / CAP, "m/s"))
    linear = Cushion(area=40e-6, remaining_area=2e-6, length=20 * MM, end=0.4, towards="high")
    area = linear.equations(p_chamber=expected, p_port=0.0, x_rod=0.385, fluid=STIFF)["open_area"]
    return [*found, Number("linear profile, 15 mm before the end", 30.5e-6, area, "mm2")]
