"""Cylinders and cushions."""

from __future__ import annotations

import math

from building import circuit
from crescentlab.components.cylinders import Cushion, DoubleActingCylinder, SingleActingCylinder
from crescentlab.components.fluids import SimpleOil
from scipy.optimize import brentq

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
    because="rounding; the stiff oil yields by 1e-8 at 100 bar, which only the leakage feels",
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
        Number("flow past the piston, at 60 bar", 16e-3 / 60 * math.exp(60 * BAR / 1e15), now["leakage"], "L/min"),
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


def compressed(p: float) -> float:
    """Energy [J/m^3] of oil with rho = rho_0 exp(p/beta): e = rho w - p = beta (exp(p/beta) - 1) - p."""
    return 1.4e9 * math.expm1(p / 1.4e9) - p


@evidence(
    "double_acting_cylinder",
    "single_acting_cylinder",
    source="energy of compressed oil, beta (exp(p/beta) - 1) - p per volume; of a spring, F_0 x + k x^2/2; of a stop, "
    "k d^2/2; power of friction B v^2, of Hunt and Crossley's damping k d a v^2, w = a v_i of "
    "w - ln(1 + w) = -e w - ln(1 - e w)",
    tolerance=1e-9,
    because="rounding",
)
def energies() -> list[Number]:
    """50/30 mm at 100 and 20 bar, 0.2 (L/min)/bar; plunger of 40 mm that enters its stop by 0.1 mm at 0.05 m/s."""
    oil = SimpleOil(density=850.0, kinematic_viscosity=30e-6, bulk_modulus=1.4e9)
    part = DoubleActingCylinder(
        piston_diameter=0.05, rod_diameter=0.03, stroke=0.4, cap_dead_volume=50e-6, rod_dead_volume=50e-6,
        leakage_conductance=0.2e-3 / 60 / BAR, viscous_friction=300.0,
    )  # fmt: skip
    both = part.equations(
        cap_pressure=100 * BAR, annulus_pressure=20 * BAR, q_cap=0.0, q_annulus=0.0, x_rod=0.1, v_rod=0.1, fluid=oil
    )
    plunger = SingleActingCylinder(
        piston_diameter=0.04, stroke=0.3, dead_volume=20e-6, preload=500.0, spring_stiffness=2000.0,
        viscous_friction=300.0,
    ).equations(pressure=50 * BAR, q_cap=0.0, x_rod=0.3001, v_rod=0.05, fluid=oil)  # fmt: skip
    leak = 16e-3 / 60 * 1.4e9 * 2 * math.sinh(40 * BAR / 1.4e9)  # rho(60 bar) G dp (w_1 - w_2), w = int dp/rho
    held = (50e-6 + 0.1 * CAP) * compressed(100 * BAR) + (50e-6 + 0.3 * RING) * compressed(20 * BAR)
    volume = 20e-6 + math.pi / 4 * 0.04**2 * 0.3001
    bent = 500 * 0.3001 + 2000 * 0.3001**2 / 2 + 1e8 * 1e-4**2 / 2
    a = brentq(lambda w: (1 + w) * math.exp(-1.5 * w) - 1 + w / 2, 1.0, 2.0, xtol=1e-14) / 0.1
    return [
        Number("energy of both chambers", held, both["stored_energy"], "J"),
        Number("lost to friction and leakage", 3.0 + leak, both["loss"], "W"),
        Number(
            "energy of plunger, spring and stop", volume * compressed(50 * BAR) + bent, plunger["stored_energy"], "J"
        ),
        Number("lost in the stop and to friction", 300 * 0.05**2 + 1e4 * a * 0.05**2, plunger["loss"], "W"),
    ]


@evidence(
    "double_acting_cylinder",
    source="first law and conservation of mass: two closed volumes that equalise keep V_1 rho_1 + V_2 rho_2; what "
    "their energy falls by is lost",
    tolerance=1e-6,
    because="relative tolerance of the run, 1e-8; the pressures differ by exp(-39) of the first at the end",
)
def equalised() -> list[Number]:
    """A piston held at mid-stroke, 200 bar on the cap's side, leaks until both sides are equal."""
    parts = {
        "cylinder": {"type": "double_acting_cylinder", "piston_diameter": "50 mm", "rod_diameter": "30 mm",
                     "stroke": "400 mm", "cap_dead_volume": "50 cm^3", "rod_dead_volume": "50 cm^3",
                     "leakage_conductance": "1 (L/min)/bar", "start": {"cap_pressure": "200 bar"}},
        "hand": {"type": "motion_source", "position": "200 mm"},
        "one": {"type": "plug"},
        "two": {"type": "plug"},
    }  # fmt: skip
    nets = {
        "r": ["hand.port", "cylinder.rod"],
        "a": ["cylinder.cap", "one.port"],
        "b": ["cylinder.annulus", "two.port"],
    }
    run = circuit(components=parts, nets=nets, fluid=FLUID, simulation={"stop": "30 ms"}).simulate(rtol=1e-8)
    assert run.balance is not None
    assert run.balance.energy is not None
    V_1, V_2 = 50e-6 + 0.2 * CAP, 50e-6 + 0.2 * RING
    p = 1.4e9 * math.log1p(V_1 / (V_1 + V_2) * math.expm1(200 * BAR / 1.4e9))
    lost = V_1 * compressed(200 * BAR) - (V_1 + V_2) * compressed(p)
    return [
        Number("pressure", p, float(run["cylinder.annulus_pressure"][-1]), "bar"),
        Number("lost by leakage", lost, run.balance.energy.dissipated["cylinder"], "J"),
    ]
