"""Pistons that shape a chamber."""

from __future__ import annotations

import math

from building import OIL, circuit
from crescentlab.components.pistons import PistonChamber

from crescentlab.analysis.linear import linearize
from crescentlab.analysis.linear.modes import modes
from evidence import Number, evidence

MM = 1e-3


@evidence(
    "piston_chamber",
    source="V_0 + A x, A v, p A with A = pi/4 (d^2 - d_r^2), by hand",
    tolerance=1e-9,
    because="rounding",
)
def geometry() -> list[Number]:
    """Piston of 40 mm with a rod of 20 mm, 100 cm^3, moved by 10 mm at 0.1 m/s under 20 bar."""
    part = PistonChamber(diameter=40 * MM, rod_diameter=20 * MM, dead_volume=1e-4)
    got = part.equations(x_rod=10 * MM, v_rod=0.1, p_chamber=20e5)
    area = 300 * math.pi * 1e-6
    return [
        Number("volume", 1e-4 + area * 10 * MM, got["V_chamber"], "cm3"),
        Number("its rate", area * 0.1, got["dV_chamber"], "cm3/s"),
        Number("force on the rod", area * 20e5, -got["f_rod"], "N"),
    ]


@evidence(
    "piston_chamber",
    source="Merritt (1967), chapter 6: omega_h = sqrt(4 beta A^2/(V_t m)) of a piston between equal closed chambers",
    tolerance=1e-6,
    because="exact matrices; the density at 0 bar is that of the reference",
)
def hydraulic_spring() -> list[Number]:
    """100 kg on a piston of 40 mm between two chambers of 100 cm^3, beta = 14 000 bar."""
    parts = {
        "mass": {"type": "mass_with_stops", "mass": "100 kg", "low": "-50 mm", "high": "50 mm",
                 "start": {"x": "0 mm"}},
        "up": {"type": "piston_chamber", "diameter": "40 mm", "dead_volume": "100 cm^3"},
        "down": {"type": "piston_chamber", "diameter": "40 mm", "dead_volume": "100 cm^3", "side": "pushes_down"},
        "below": {"type": "variable_capacity"}, "above": {"type": "variable_capacity"},
    }  # fmt: skip
    nets = {
        "rod": ["mass.port", "up.rod", "down.rod"],
        "low": ["up.chamber", "below.chamber"],
        "high": ["down.chamber", "above.chamber"],
        "p_low": ["below.port"],
        "p_high": ["above.port"],
    }
    made = circuit(components=parts, nets=nets, fluid=OIL)
    found = modes(linearize(made, at=made.simulate("1 ms"), outputs=["mass.x"]))
    expected = math.sqrt(4 * 1.4e9 * (math.pi / 4 * (40 * MM) ** 2) ** 2 / (2e-4 * 100))
    swing = max(mode.natural_frequency for mode in found)
    return [Number("frequency", expected / 2 / math.pi, swing / 2 / math.pi, "Hz")]


@evidence(
    "piston_chamber",
    source="work on a closed volume of oil with rho = rho_0 exp(p/beta): V (beta (exp(p/beta) - 1) - p), p = beta "
    "ln(V_0/V)",
    tolerance=1e-7,
    because="relative tolerance of the run, 1e-9",
)
def squeezed() -> list[Number]:
    """A rod squeezes 100 cm^3 behind a piston of 40 mm by 1 mm: its work, all of it in the oil."""
    parts = {
        "hand": {"type": "motion_source", "velocity": "-100 mm/s"},
        "piston": {"type": "piston_chamber", "diameter": "40 mm", "dead_volume": "100 cm^3"},
        "oil": {"type": "variable_capacity"}, "end": {"type": "plug"},
    }  # fmt: skip
    nets = {"r": ["hand.port", "piston.rod"], "c": ["piston.chamber", "oil.chamber"], "n": ["oil.port", "end.port"]}
    run = circuit(components=parts, nets=nets, fluid=OIL, simulation={"stop": "10 ms"}).simulate(rtol=1e-9)
    assert run.balance is not None
    assert run.balance.energy is not None
    left = 1e-4 - math.pi / 4 * (40 * MM) ** 2 * MM
    p = 1.4e9 * math.log(1e-4 / left)
    work = left * (1.4e9 * math.expm1(p / 1.4e9) - p)
    return [
        Number("work of the rod", work, sum(run.balance.energy.supplied.values()), "J"),
        Number("energy of the oil", work, float(run["oil.stored_energy"][-1]), "J"),
    ]
