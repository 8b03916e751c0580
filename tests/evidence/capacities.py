"""Volumes of compressible fluid."""

from __future__ import annotations

import math

from building import OIL, circuit
from crescentlab.components.capacities import CompliantCapacity, ElasticCapacity
from crescentlab.components.fluids import SimpleOil

from crescentlab.tables import Curve
from evidence import Number, evidence

BAR = 1e5
BETA = 1.4e9
STIFF = SimpleOil(density=860.0, kinematic_viscosity=35e-6, bulk_modulus=BETA)
COVER = Curve(x=(0.0, 3e5, 8e5), y=(0.0, 16e-6, 44e-6), x_quantity="pressure", y_quantity="length")


@evidence(
    "capacity",
    source="bulk modulus beta = rho dp/drho, integrated: p = beta ln(1 + q t/V)",
    tolerance=1e-6,
    because="relative tolerance of the run",
)
def filling() -> list[Number]:
    """Pressure of 1 L of oil, 14 000 bar, after 6 L/min for 0.1, 1 s: beta ln(1 + q t/V)."""
    parts = {"pump": {"type": "flow_source", "flow": "6 L/min"}, "line": {"type": "capacity", "volume": "1 L"}}
    found = []
    for stop in (0.1, 1.0):
        one = circuit(
            components=parts, nets={"n": ["pump.port", "line.port"]}, fluid=OIL, simulation={"stop": f"{stop} s"}
        ).simulate(rtol=1e-9)
        found.append(
            Number(f"after {stop:g} s", BETA * math.log1p(1e-4 * stop / 1e-3), float(one["line.p"][-1]), "bar")
        )
    return found


@evidence(
    "variable_capacity",
    source="bulk modulus integrated for a closed volume: p = beta ln(V_0/V)",
    tolerance=1e-6,
    because="relative tolerance of the run",
)
def squeezing() -> list[Number]:
    """Closed cylinder, 20 mm bore, squeezed from 10 to 9.9 cm^3 by a rod at 10 mm/s: beta ln(10/9.9)."""
    stroke = 0.1e-6 / (math.pi / 4 * 0.02**2)
    parts = {
        "rod": {"type": "motion_source", "velocity": "-10 mm/s"},
        "piston": {"type": "piston_chamber", "diameter": "20 mm", "dead_volume": "10 cm^3"},
        "oil": {"type": "variable_capacity"}, "end": {"type": "plug"},
    }  # fmt: skip
    nets = {"r": ["rod.port", "piston.rod"], "c": ["piston.chamber", "oil.chamber"], "n": ["oil.port", "end.port"]}
    stop = {"stop": f"{stroke / 10e-3!r} s"}
    result = circuit(components=parts, nets=nets, fluid=OIL, simulation=stop).simulate(rtol=1e-9)
    return [Number("pressure", BETA * math.log(10 / 9.9), float(result["oil.p"][-1]), "bar")]


@evidence(
    "compliant_capacity",
    source="Rundo & Corvaglia (2016), Eq. 2 with the compliance of the cover, by hand",
    tolerance=1e-5,
    because="the fluid's own expansion, 1 bar in 14 000, times the share of its compliance",
)
def with_a_cover() -> list[Number]:
    """Rate of pressure at 1 bar, 20 cm^3 with 6 cm^2 of cover giving 16 um in 3 bar, for 6 L/min: q/(V/beta + A h')."""
    part = CompliantCapacity(wall_area=6e-4, deflection=COVER)
    rate = part.equations(p=BAR, q_port=1e-4, V_chamber=20e-6, dV_chamber=0.0, fluid=STIFF)["der_p"]
    swell = math.exp(-BAR / BETA)
    wall = 6e-4 * 16e-6 / 3
    expected = swell * 1e-4 / ((20e-6 + wall) / BETA + 6e-4 * 16e-6 / 3e5)
    return [Number("dp/dt", expected, rate, "bar/ms")]


@evidence(
    "elastic_capacity",
    source="Wylie & Streeter, Fluid Transients in Systems (1993), thin-walled pipes: c1 = 5/4 - nu, 1, 1 - nu^2",
    tolerance=3e-3,
    because="thin walls: the first neglected term is 2 (1 + nu) e/d, here 2.6e-3",
)
def thin_wall() -> list[Number]:
    """Growth of a volume over pressure, in shares of d/(e E), wall 1/1000 of the diameter, nu 0.3."""
    found = []
    for ends, share in (("closed", 0.95), ("expansion_joints", 1.0), ("anchored", 0.91)):
        part = ElasticCapacity(diameter=1.0, length=4 / math.pi, wall_thickness=1e-3, ends=ends)
        low, high = (part.equations(p=p, q_port=0.0, fluid=RIGID)["content"] for p in (0.0, 1e6))
        found.append(Number(ends, share, (high - low) / 1e6 / (1.0 / (1e-3 * 210e9))))
    return found


RIGID = SimpleOil(density=860.0, kinematic_viscosity=35e-6, bulk_modulus=1e25)


@evidence(
    "elastic_capacity",
    source="Lame's stresses at the bore of a tube twice as wide (Timoshenko, Strength of Materials II): 5/3 p hoop, "
    "p/3 axial, -p radial; strains by Hooke's law, nu 0.3",
    tolerance=1e-9,
    because="rounding of the difference of two contents",
)
def thick_wall() -> list[Number]:
    """Growth of the volume of a closed cylinder, wall half of the bore, times E/p: 2 eps_t + eps_z."""
    part = ElasticCapacity(diameter=0.02, length=1.0, wall_thickness=0.01, ends="closed")
    low, high = (part.equations(p=p, q_port=0.0, fluid=RIGID)["content"] for p in (0.0, 1e9))
    hoop, axial, radial, nu = 5 / 3, 1 / 3, -1.0, 0.3
    expected = 2 * (hoop - nu * (axial + radial)) + axial - nu * (hoop + radial)
    return [Number("dV/V E/p", expected, (high / low - 1) * 210e9 / 1e9)]
