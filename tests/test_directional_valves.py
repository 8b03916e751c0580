"""Directional valves and their drive: limits, events, signs, conservation; their figures are in `evidence`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from building import OIL as OIL_TEXT
from building import circuit, fired
from crescentlab.components.directional_valves import (
    FourThreeValve,
    FourTwoValve,
    SpoolDrive,
    ThreeTwoValve,
    TwoTwoValve,
)
from crescentlab.components.fluids import SimpleOil
from scipy.optimize import brentq

from crescentlab.result import Result

BAR, MS = 1e5, 1e-3
OIL = SimpleOil(density=860.0, kinematic_viscosity=35e-6, bulk_modulus=1.4e9)
PARTS = Path(__file__).parent.parent / "circuits"
STIFF = SimpleOil(density=860.0, kinematic_viscosity=35e-6, bulk_modulus=1e15)


def through(area: float, drop: float) -> float:
    """Cd A sqrt(2 dp/rho) with Cd 0.7 and 860 kg/m^3."""
    return 0.7 * area * math.sqrt(2 * drop / 860)


# --- directional valves -----------------------------------------------------------------------------------------------


def four(x: float, valve: FourThreeValve, **pressures: float) -> dict[str, Any]:
    given = {"p_supply": 100 * BAR, "p_a": 60 * BAR, "p_b": 40 * BAR, "p_tank": 2 * BAR} | pressures
    return valve.equations(stroke=x, fluid=OIL, **given)


@pytest.mark.parametrize("x", [-1.5, -1.0, -0.3, 0.0, 0.2, 1.0, 1.5])
@pytest.mark.parametrize(("overlap", "tandem"), [(-0.1, 0.0), (0.0, 0.0), (0.1, 0.0), (0.1, 20e-6)])
def test_four_three_valve_keeps_nothing(x: float, overlap: float, tandem: float) -> None:
    """What enters leaves; turned round, the valve is its own mirror image with A and B exchanged."""
    valve = FourThreeValve(area=10e-6, overlap=overlap, tandem_area=tandem, tandem_stroke=0.4)
    got = four(x, valve)
    assert sum(got[f"q_{p}"] for p in ("supply", "a", "b", "tank")) == pytest.approx(0.0, abs=1e-18)
    mirror = four(-x, valve, p_a=40 * BAR, p_b=60 * BAR)
    assert got["q_supply_a"] == mirror["q_supply_b"]
    assert got["q_b_tank"] == mirror["q_a_tank"]
    assert got["q_supply_tank"] == mirror["q_supply_tank"]


def test_centres_of_a_four_three_valve() -> None:
    """In the middle: closed by overlap; open by underlap; float where only the tank edges underlap; tandem."""
    closed = four(0.0, FourThreeValve(area=10e-6, overlap=0.1))
    assert all(closed[f"q_{p}"] == 0 for p in ("supply", "a", "b", "tank"))
    opened = four(0.0, FourThreeValve(area=10e-6, overlap=-0.1))
    for edge, drop in (("q_supply_a", 40), ("q_supply_b", 60), ("q_a_tank", 58), ("q_b_tank", 38)):
        assert opened[edge] == pytest.approx(through(1e-6 / 1.1, drop * BAR), rel=5e-3)
    floating = four(0.0, FourThreeValve(area=10e-6, overlap=0.1, tank_overlap=-0.1))
    assert floating["q_supply"] == 0
    assert floating["q_a_tank"] == opened["q_a_tank"]
    tandem = four(0.0, FourThreeValve(area=10e-6, overlap=0.1, tandem_area=20e-6))
    assert tandem["q_a"] == tandem["q_b"] == 0
    assert tandem["q_supply"] == -tandem["q_tank"] == pytest.approx(through(20e-6, 98 * BAR), rel=5e-3)


def test_tandem_centre_unloads_the_pump() -> None:
    """A pump of 20 L/min and a relief valve at 100 bar: at rho/2 (q/(Cd A))^2 = 2.44 bar as long as the spool is in the
    middle, at the relief valve's 105 bar once it feeds a shut port; 0.5 % for the flow number."""
    parts = {
        "pump": {"type": "flow_source", "flow": "20 L/min"}, "tank": {"type": "tank"},
        "line": {"type": "capacity", "volume": "200 cm^3"},
        "relief": {"type": "relief_valve", "area": "20 mm^2", "cracking_pressure": "100 bar",
                   "opening_range": "20 bar"},
        "asked": {"type": "step", "after": "1", "at": "200 ms"},
        "valve": {"type": "./proportional_valve_part.yaml", "overlap": "10 %", "tandem_area": "20 mm^2"},
        "left": {"type": "capacity", "volume": "200 cm^3"}, "right": {"type": "capacity", "volume": "200 cm^3"},
    }  # fmt: skip
    nets = {
        "p": ["pump.port", "line.port", "relief.a", "valve.supply"], "t": ["relief.b", "tank.port", "valve.tank"],
        "u": ["asked.y", "valve.command"], "a": ["valve.a", "left.port"], "b": ["valve.b", "right.port"],
    }  # fmt: skip
    made = circuit(components=parts, nets=nets, fluid=OIL_TEXT, folder=PARTS, simulation={"stop": "400 ms"})
    run = made.simulate(rtol=1e-8)
    idle = 430 * (20e-3 / 60 / (0.7 * 20e-6)) ** 2
    assert idle == pytest.approx(2.44 * BAR, abs=0.005 * BAR)
    assert np.interp(0.19, run.time, run["line.p"]) == pytest.approx(idle, rel=5e-3)
    assert np.interp(0.19, run.time, run["left.p"]) == 0.0
    full = brentq(lambda p: through(20e-6 * (p / BAR - 100) / 20, p) - 20e-3 / 60, 100 * BAR, 120 * BAR)
    assert run["line.p"][-1] == pytest.approx(full, rel=5e-3)
    assert run["left.p"][-1] == pytest.approx(full, rel=5e-3)


@pytest.mark.parametrize("ratio", [0.5, 2.0])
@pytest.mark.parametrize("x", [-1.0, 0.7, 1.0])
def test_area_ratio_of_a_four_three_valve(x: float, ratio: float) -> None:
    """Edges at B of half or twice the area pass half or twice the flow at the same drop, also fully open.

    1e-3: the discharge coefficient, by the flow number of another diameter.
    """
    even, other = FourThreeValve(area=10e-6), FourThreeValve(area=10e-6, area_ratio=ratio)
    at_b = "q_b_tank" if x > 0 else "q_supply_b"
    assert four(x, even)[at_b] > 0
    assert four(x, other)[at_b] == pytest.approx(ratio * four(x, even)[at_b], rel=1e-3)
    assert four(x, other)["q_supply_a"] == four(x, even)["q_supply_a"]


@pytest.mark.parametrize(("x", "into", "out"), [(0.0, 0.0, 1.0), (0.5, 0.0, 0.0), (1.0, 1.0, 0.0)])
def test_three_two_valve_at_its_ends(x: float, into: float, out: float) -> None:
    """Stroke 0 joins work port and tank, 1 supply and work port; in the middle both are shut by the overlap."""
    valve = ThreeTwoValve(area=10e-6, overlap=0.1)
    got = valve.equations(p_supply=100 * BAR, p_work=50 * BAR, p_tank=0.0, stroke=x, fluid=OIL)
    full = through(10e-6, 50 * BAR)
    assert got["q_in"] == pytest.approx(into * full, rel=5e-3)
    assert got["q_out"] == pytest.approx(out * full, rel=5e-3)
    assert got["q_supply"] + got["q_work"] + got["q_tank"] == pytest.approx(0.0, abs=1e-18)


def test_two_two_valve_shut_and_beyond() -> None:
    """Nothing passes below its overlap or at a negative stroke; a stroke beyond 1 opens no further."""
    valve = TwoTwoValve(area=10e-6, overlap=0.05)
    q = [valve.equations(p_a=50 * BAR, p_b=0.0, stroke=x, fluid=OIL)["q"] for x in (-0.5, 0.04, 1.0, 3.0)]
    assert q[:2] == [0.0, 0.0]
    assert q[2] == q[3] == pytest.approx(through(10e-6, 50 * BAR), rel=5e-3)


@pytest.mark.parametrize("rounding", [1e-3, 0.02])
def test_two_two_valve_at_stroke_zero(rounding: float) -> None:
    """By default it is shut at stroke 0, whatever the rounding, opens softly from there on, and leaks with a lap of 0
    by a quarter of the rounding."""
    settings = {"area": 10e-6, "edge_rounding": rounding, "lambda_c": 1.0}

    def q(x: float, **lap: float) -> float:
        return float(TwoTwoValve(**settings, **lap).equations(p_a=300 * BAR, p_b=0.0, stroke=x, fluid=STIFF)["q"])

    assert q(0.0) == q(-0.1) == 0.0
    assert 0 < q(rounding / 100) < through(10e-6, 300 * BAR) * rounding / 1e4
    assert q(0.0, overlap=0.0) == pytest.approx(rounding / 4 * through(10e-6, 300 * BAR), rel=1e-6)
    assert q(1.0) == pytest.approx(through(10e-6, 300 * BAR), rel=1e-6)


def test_shut_two_two_valve_holds_a_pressure() -> None:
    """Between 300 bar and a tank, at stroke 0 for 10 s: not a pascal less; opened, it is empty."""
    parts = {
        "held": {"type": "capacity", "volume": "1 L", "start": {"p": "300 bar"}}, "tank": {"type": "tank"},
        "asked": {"type": "step", "after": "1", "at": "10 s"}, "valve": {"type": "two_two_valve", "area": "10 mm^2"},
    }  # fmt: skip
    nets = {"p": ["held.port", "valve.a"], "t": ["valve.b", "tank.port"], "u": ["asked.y", "valve.stroke"]}
    run = circuit(components=parts, nets=nets, fluid=OIL_TEXT, simulation={"stop": "12 s"}).simulate()
    assert np.all(run["held.p"][run.time < 10] == 300 * BAR)
    assert run["held.p"][-1] < 1 * BAR


@pytest.mark.parametrize("x", [-0.5, 0.0, 0.3, 0.5, 0.7, 1.0, 2.0])
@pytest.mark.parametrize("overlap", [-0.1, 0.0, 0.1])
def test_four_two_valve_is_a_four_three_valve_without_middle(x: float, overlap: float) -> None:
    """At 2 x - 1 of the 4/3 valve's stroke, edge by edge; what enters leaves."""
    given = {"p_supply": 100 * BAR, "p_a": 60 * BAR, "p_b": 40 * BAR, "p_tank": 2 * BAR, "fluid": OIL}
    got = FourTwoValve(area=10e-6, overlap=overlap).equations(stroke=x, **given)
    other = four(2 * x - 1, FourThreeValve(area=10e-6, overlap=overlap))
    assert got.items() <= other.items()
    assert sum(got[f"q_{p}"] for p in ("supply", "a", "b", "tank")) == pytest.approx(0.0, abs=1e-18)


# --- the drive --------------------------------------------------------------------------------------------------------


def driven(command: dict[str, str], stop: str, **settings: str) -> Result:
    parts = {"asked": command, "drive": {"type": "spool_drive", "natural_frequency": "50 Hz", **settings}}
    made = circuit(components=parts, nets={"u": ["asked.y", "drive.command"]}, simulation={"stop": stop})
    return made.simulate(rtol=1e-8)


def test_drive_stops_at_the_end_of_its_stroke() -> None:
    """A full step with damping ratio 0.2 would overshoot by exp(-pi zeta/sqrt(1 - zeta^2)) = 53 %: it rests at 1."""
    run = driven({"type": "step", "after": "1"}, "100 ms", damping_ratio="0.2")
    omega, zeta = 100 * math.pi, 0.2
    wd = omega * math.sqrt(1 - zeta**2)

    def short(t: float) -> float:
        return math.cos(wd * t) + zeta * omega / wd * math.sin(wd * t)

    (hit,) = fired(run, "drive.hits_high")
    assert hit == pytest.approx(brentq(short, 0.1 / wd, math.pi / wd), rel=1e-6)
    assert run["drive.position"].max() == pytest.approx(1.0, rel=1e-9)
    assert run["drive.position"][-1] == 1.0
    assert run["drive.rate"][-1] == 0.0


def test_drive_leaves_its_stop() -> None:
    """Back from the stop as from rest: after a pulse beyond the stroke it follows 1 - y(t) of the step response."""
    command = {"type": "pulse", "high": "1.5", "low": "0.5", "width": "100 ms"}
    run = driven(command, "120 ms", damping_ratio="0.2")
    (left,) = fired(run, "drive.leaves")
    assert left == pytest.approx(0.1, rel=1e-9)
    omega, zeta, t = 100 * math.pi, 0.2, 10 * MS
    wd = omega * math.sqrt(1 - zeta**2)
    y = math.exp(-zeta * omega * t) * (math.cos(wd * t) + zeta * omega / wd * math.sin(wd * t))
    after = run.time >= 0.1
    got = np.interp(0.11, run.time[after], run["drive.position"][after])
    assert got == pytest.approx(0.5 + 0.5 * y, abs=1e-3)


def test_command_is_counted_within_the_stroke() -> None:
    """A command of 5 pulls no harder than one of 1."""
    drive = SpoolDrive(natural_frequency=50.0)
    there = {"position": 0.2, "rate": 0.0, "at": 0.0}
    assert drive.equations(command=5.0, **there)["der_rate"] == drive.equations(command=1.0, **there)["der_rate"]
