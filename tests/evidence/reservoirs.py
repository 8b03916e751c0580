"""Reservoirs."""

from __future__ import annotations

import math

from building import circuit
from crescentlab.components.fluids import SimpleOil
from crescentlab.components.reservoirs import Reservoir

from evidence import Number, evidence

WATER = {"type": "simple_oil", "density": "1000 kg/m^3", "kinematic_viscosity": "1 cSt", "bulk_modulus": "1e9 GPa"}
G = 9.80665


@evidence(
    "reservoir",
    source="Torricelli (1644): t = A/(Cd a) sqrt(2/g) (sqrt h_0 - sqrt h_1)",
    tolerance=1e-6,
    because="relative tolerance of the run; the orifice is turbulent to 1e-12 (critical flow number 1)",
)
def emptying() -> list[Number]:
    """Level of 100 cm^2 of water, 0.4 m deep, emptied through 20 mm^2 with Cd 0.6, after 60 and 120 s."""
    parts = {
        "water": {"type": "reservoir", "area": "100 cm^2", "height": "0.5 m", "start_level": "0.4 m"},
        "hole": {"type": "orifice", "area": "20 mm^2", "cd_max": "0.6", "lambda_c": "1"},
        "out": {"type": "atmospheric_vent"},
    }
    nets = {"bottom": ["water.outlet", "hole.a"], "end": ["hole.b", "out.port"]}
    found = []
    for time in (60.0, 120.0):
        run = circuit(components=parts, nets=nets, fluid=WATER, simulation={"stop": f"{time} s"}).simulate(rtol=1e-8)
        level = (math.sqrt(0.4) - 0.6 * 20e-6 / 1e-2 * math.sqrt(G / 2) * time) ** 2
        found.append(Number(f"level after {time:g} s", level, float(run["water.h"][-1]), "mm"))
    return found


@evidence(
    "reservoir",
    source="hydrostatics, rho g h",
    tolerance=1e-12,
    because="rounding alone",
)
def head() -> list[Number]:
    """Pressure at an outlet 0.1 m above the floor, below 1.1 m of water."""
    fluid = SimpleOil(density=1000.0, kinematic_viscosity=1e-6, bulk_modulus=1e18)
    part = Reservoir(area=1.0, height=2.0, start_level=1.1, outlet_height=0.1)
    found = part.equations(h=1.1, q_outlet=0.0, q_inlet=[], fluid=fluid)["p_outlet"]
    return [Number("pressure", 1000 * G, found, "bar")]


@evidence(
    "reservoir",
    source="energy of height, rho g A (h_0^2 - h_1^2)/2, all of it lost in the hole (Torricelli 1644)",
    tolerance=1e-7,
    because="relative tolerance of the run, 1e-8",
)
def lost_in_the_hole() -> list[Number]:
    """100 cm^2 of water emptied from 0.4 m through 20 mm^2 for 120 s: lost, and what is left above the outlet."""
    parts = {
        "water": {"type": "reservoir", "area": "100 cm^2", "height": "0.5 m", "start_level": "0.4 m"},
        "hole": {"type": "orifice", "area": "20 mm^2"},
        "out": {"type": "atmospheric_vent"},
    }
    nets = {"bottom": ["water.outlet", "hole.a"], "end": ["hole.b", "out.port"]}
    run = circuit(components=parts, nets=nets, fluid=WATER, simulation={"stop": "120 s"}).simulate(rtol=1e-8)
    assert run.balance is not None
    assert run.balance.energy is not None
    left = float(run["water.h"][-1])
    return [
        Number("lost", 1000 * G * 0.01 / 2 * (0.16 - left * left), run.balance.energy.dissipated["hole"], "J"),
        Number("left", 1000 * G * 0.01 / 2 * left * left, float(run["water.stored_energy"][-1]), "J"),
    ]
