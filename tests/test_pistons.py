"""A piston on a closed chamber: the hydraulic spring."""

import math

import numpy as np
import pytest
from building import circuit
from crescentlab.components.pistons import PistonChamber

from crescentlab.errors import SimulationError

PARTS = {
    "mass": {"type": "mass_with_stops", "mass": "2 kg", "low": "-90 mm", "high": "90 mm", "start": {"x": "0.1 mm"}},
    "piston": {"type": "piston_chamber", "diameter": "40 mm", "dead_volume": "100 cm^3"},
    "oil": {"type": "variable_capacity"},
}
NETS = {"rod": ["mass.port", "piston.rod"], "shape": ["piston.chamber", "oil.chamber"], "p": ["oil.port", "cap.port"]}
FLUID = {"type": "simple_oil", "density": "860 kg/m^3", "kinematic_viscosity": "35 cSt", "bulk_modulus": "1.4 GPa"}


def test_equations() -> None:
    """Geometry by hand: A = pi/4 (40^2 - 20^2) mm^2 = 942.48 mm^2; 1 mm changes the volume by 0.942 cm^3."""
    piston = PistonChamber(diameter=0.04, rod_diameter=0.02, dead_volume=1e-4, side="pushes_down")
    got = piston.equations(x_rod=1e-3, v_rod=0.1, p_chamber=2e5)
    area = 942.4778e-6
    assert got["V_chamber"] == pytest.approx(1e-4 - area * 1e-3, rel=1e-6)
    assert got["dV_chamber"] == pytest.approx(-area * 0.1, rel=1e-6)
    assert got["f_rod"] == pytest.approx(area * 2e5, rel=1e-6)  # on the piston; it pushes the rod down


def test_hydraulic_spring() -> None:
    """A mass on a closed chamber swings at sqrt(beta A^2 / (V m)) / 2 pi (Merritt, Hydraulic Control Systems, 1967).

    Pushed with 0.01 m/s it swings by 3 um, which changes V by 0.004 % and bends the spring by as much; asked for
    within 0.1 %.
    """
    made = circuit(components=PARTS | {"cap": {"type": "plug"}}, nets=NETS, fluid=FLUID)
    area, beta = math.pi / 4 * 0.04**2, 1.4e9
    expected = math.sqrt(beta * area**2 / (1e-4 * 2.0)) / (2 * math.pi)
    result = made.simulate(5 / expected, parameters={"mass.start.v": "0.01 m/s", "mass.start.x": "0 mm"}, rtol=1e-9)
    v, t = result["mass.v"], result.time
    rising = np.flatnonzero((v[:-1] < 0) & (v[1:] >= 0))
    crossings = t[rising] - v[rising] * (t[rising + 1] - t[rising]) / (v[rising + 1] - v[rising])
    assert 1 / np.diff(crossings).mean() == pytest.approx(expected, rel=1e-3)


def test_used_up_chamber_ends_the_run() -> None:
    """A mass that flies into its chamber against an open port uses it up; the run says so."""
    parts = PARTS | {"cap": {"type": "tank"}, "way": {"type": "orifice", "area": "100 mm^2"}}
    nets = NETS | {"p": ["oil.port", "way.a"], "t": ["way.b", "cap.port"]}
    made = circuit(components=parts, nets=nets, fluid=FLUID)
    with pytest.raises(SimulationError, match="piston: the stroke has used up the chamber"):
        made.simulate(
            "1 s", parameters={"mass.start.v": "-1 m/s", "piston.dead_volume": "20 cm^3", "mass.mass": "50 kg"}
        )
