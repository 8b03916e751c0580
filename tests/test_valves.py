"""Pressure, shuttle and check valves: limits, events, signs, conservation; their figures are in `evidence`."""

from __future__ import annotations

import math

import numpy as np
import pytest
from building import OIL as OIL_TEXT
from building import circuit, fired
from crescentlab.components.check_valves import IdealCheckValve, PilotOperatedCheckValve
from crescentlab.components.fluids import SimpleOil
from crescentlab.components.pressure_valves import (
    BypassCompensator,
    CounterbalanceValve,
    PressureCompensator,
    ReducingRelievingValve,
    ReducingValve,
    ReliefValve,
    SecondOrderReliefValve,
    SequenceValve,
)
from crescentlab.components.shuttle_valves import ShuttleValve

from crescentlab.result import Result

BAR, MS = 1e5, 1e-3
OIL = SimpleOil(density=860.0, kinematic_viscosity=35e-6, bulk_modulus=1.4e9)
STIFF = SimpleOil(density=860.0, kinematic_viscosity=35e-6, bulk_modulus=1e15)


def through(area: float, drop: float) -> float:
    """Cd A sqrt(2 dp/rho) with Cd 0.7 and 860 kg/m^3."""
    return 0.7 * area * math.sqrt(2 * drop / 860)


# --- pressure valves --------------------------------------------------------------------------------------------------


def test_static_characteristics() -> None:
    """Openings that the pressures ask for: shut on one side of the range, open on the other, half in its middle, and
    as much beyond as the force on the stop is."""
    common = {"area": 10e-6, "time_constant": 1.0}
    relief = ReliefValve(cracking_pressure=100 * BAR, opening_range=20 * BAR, **common)
    reducing = ReducingValve(set_pressure=50 * BAR, closing_range=10 * BAR, **common)
    compensator = PressureCompensator(control_pressure=8 * BAR, closing_range=2 * BAR, **common)
    free = {"lift": 0.0, "at": 0.0, "fluid": OIL}
    for share in (-5, 0, 0.5, 1, 5):
        got = relief.equations(p_a=(100 + 20 * share) * BAR, p_b=0.0, **free)["der_lift"]
        assert got == pytest.approx(share, abs=1e-12)
        got = reducing.equations(p_a=200 * BAR, p_b=(53 - 10 * share) * BAR, p_drain=3 * BAR, **free)["der_lift"]
        assert got == pytest.approx(share, abs=1e-12)
        got = compensator.equations(p_a=200 * BAR, p_b=(70 - 2 * share) * BAR, p_load=60 * BAR, **free)["der_lift"]
        assert got == pytest.approx(share, abs=1e-12)


def test_sequence_valve_does_not_see_its_outlet() -> None:
    """Moved by pilot less drain alone: shut up to 100 bar, half open at 110 bar, whatever the outlet's pressure."""
    valve = SequenceValve(area=10e-6, set_pressure=100 * BAR, opening_range=20 * BAR, time_constant=1.0)
    for p_b in (0, 60, 300):
        for pilot, drain, share in ((99, 0, -0.05), (100, 0, 0.0), (110, 0, 0.5), (113, 3, 0.5), (120, 0, 1.0)):
            got = valve.equations(
                p_a=150 * BAR, p_b=p_b * BAR, p_pilot=pilot * BAR, p_drain=drain * BAR, lift=0.0, at=0.0, fluid=OIL
            )
            assert got["der_lift"] == pytest.approx(share, abs=1e-12)
            assert got["q"] == 0.0


@pytest.mark.parametrize("external", [False, True])
def test_second_user_waits_for_the_first(external: bool) -> None:
    """10 L/min fill 1 L to 50 bar in V p/(beta q) = 21.4 ms (to 2 % for the density); then, and not before, the second
    user is fed, whose own pressure does not hold the valve back. An external pilot line of 0 bar keeps it shut."""
    parts = {
        "pump": {"type": "flow_source", "flow": "10 L/min"}, "tank": {"type": "tank"},
        "first": {"type": "capacity", "volume": "1 L"},
        "valve": {"type": "sequence_valve", "area": "20 mm^2", "set_pressure": "50 bar", "opening_range": "5 bar",
                  "time_constant": "1 ms"},
        "second": {"type": "capacity", "volume": "1 L"},
    }  # fmt: skip
    pilot = {"p": ["pump.port", "first.port", "valve.a"], "t": ["tank.port", "valve.drain"]}
    pilot["t" if external else "p"].append("valve.pilot")
    nets = {**pilot, "s": ["valve.b", "second.port"]}
    run = circuit(components=parts, nets=nets, fluid=OIL_TEXT, simulation={"stop": "60 ms"}).simulate(rtol=1e-8)
    assert run.balance is not None
    assert run.balance.circuit < 1e-6
    fed = run["second.p"] > 0
    if external:
        assert not fed.any()
        return
    begins = 50e5 * 1e-3 / (1.4e9 * 10e-3 / 60)
    assert begins == pytest.approx(21.4 * MS, abs=0.05 * MS)
    assert run.time[fed][0] == pytest.approx(begins, rel=2e-2)
    assert run["second.p"][-1] == pytest.approx(run["first.p"][-1], abs=0.5 * BAR)
    assert run["second.p"][-1] > 50 * BAR


def test_bypass_compensator_follows_the_load() -> None:
    """Shut while the drop over the metering edge is below 8 bar, half open at 9, open at 10, at any load and tank."""
    valve = BypassCompensator(area=10e-6, control_pressure=8 * BAR, opening_range=2 * BAR, time_constant=1.0)
    for load in (0, 50, 300):
        for drop, share in ((-5, -6.5), (8, 0.0), (9, 0.5), (10, 1.0), (50, 21.0)):
            got = valve.equations(p_a=(load + drop) * BAR, p_b=4 * BAR, p_load=load * BAR, lift=0.0, at=0.0, fluid=OIL)
            assert got["der_lift"] == pytest.approx(share, abs=1e-12)


def test_reducing_relieving_valve_in_its_dead_band() -> None:
    """Feeds below 50 bar, nothing from there to 53 bar, an overlap of 0.3 travels, relieves above; what enters leaves.

    Half open to the tank at 58 bar, fully at 63 bar. Pressures over 1 bar of the tank.
    """
    valve = ReducingRelievingValve(
        area=10e-6, set_pressure=50 * BAR, closing_range=10 * BAR, dead_band=3 * BAR, time_constant=1.0
    )
    common = {"p_supply": 200 * BAR, "p_tank": 1 * BAR, "fluid": OIL}
    for p, asked, stroke, share in (
        (30, 2.1, 1.0, 1.0), (46, 0.5, 0.5, 0.5), (51, 0.0, 0.0, 0.0), (53, -0.2, -0.2, 0.0), (59, -0.8, -0.8, -0.5),
        (64, -1.3, -1.3, -1.0), (80, -2.9, -1.3, -1.0),
    ):  # fmt: skip
        got = valve.equations(p_outlet=p * BAR, stroke=0.0, at=0.0, **common)
        assert got["der_stroke"] == pytest.approx(asked, abs=1e-12)
        there = valve.equations(p_outlet=p * BAR, stroke=stroke, at=0.0, **common)
        full = valve.equations(p_outlet=p * BAR, stroke=1.0 if share > 0 else -1.3, at=0.0, **common)
        assert there["q_supply"] + there["q_outlet"] + there["q_tank"] == pytest.approx(0.0, abs=1e-18)
        assert there["q_in"] == pytest.approx(max(share, 0.0) * full["q_in"], rel=1e-9)
        assert there["q_out"] == pytest.approx(max(-share, 0.0) * full["q_out"], rel=1e-9)


def test_counterbalance_valve_without_pilot_is_a_relief_valve() -> None:
    """Its load pressure alone opens it from the set pressure on; the back pressure adds 1 + R times itself."""
    valve = CounterbalanceValve(area=10e-6, set_pressure=70 * BAR, opening_range=30 * BAR, time_constant=1.0)
    for p_a, p_b, share in ((67, 0, -0.1), (85, 0, 0.5), (130, 0, 2.0), (85, 3, 0.1)):
        got = valve.equations(p_a=p_a * BAR, p_b=p_b * BAR, p_pilot=0.0, lift=0.0, at=0.0, fluid=OIL)["der_lift"]
        assert got == pytest.approx(share, abs=1e-12)


def relieved(valve: dict[str, str], stop: str) -> Result:
    """A pump on a line of 1 L at 90 bar, and a relief valve."""
    parts = {
        "pump": {"type": "flow_source", "flow": "20 L/min"}, "tank": {"type": "tank"},
        "line": {"type": "capacity", "volume": "1 L", "start": {"p": "90 bar"}},
        "valve": {"area": "20 mm^2", "cracking_pressure": "100 bar", "opening_range": "20 bar", **valve},
    }  # fmt: skip
    nets = {"p": ["pump.port", "line.port", "valve.a"], "t": ["valve.b", "tank.port"]}
    return circuit(components=parts, nets=nets, fluid=OIL_TEXT, simulation={"stop": stop}).simulate(rtol=1e-8)


def test_relief_valves_agree_at_rest() -> None:
    """First and second order end at the same pressure, and lose nothing."""
    first = relieved({"type": "relief_valve"}, "500 ms")
    second = relieved({"type": "second_order_relief_valve", "natural_frequency": "200 Hz"}, "500 ms")
    assert first["line.p"][-1] == pytest.approx(second["line.p"][-1], rel=1e-5)
    for run in (first, second):
        assert run.balance is not None
        assert run.balance.circuit < 1e-6


def test_second_order_relief_valve_rests_on_its_seat() -> None:
    """Released half open at its cracking pressure, undamped: on the seat after pi/(2 omega), once, and for good."""
    parts = {
        "supply": {"type": "pressure_source", "pressure": "100 bar"}, "tank": {"type": "tank"},
        "valve": {
            "type": "second_order_relief_valve", "area": "20 mm^2", "cracking_pressure": "100 bar",
            "opening_range": "20 bar", "natural_frequency": "50 Hz", "damping_ratio": "0", "start": {"position": "0.5"},
        },
    }  # fmt: skip
    nets = {"p": ["supply.port", "valve.a"], "t": ["valve.b", "tank.port"]}
    run = circuit(components=parts, nets=nets, fluid=OIL_TEXT, simulation={"stop": "50 ms"}).simulate(rtol=1e-8)
    assert fired(run, "valve.hits_low") == [pytest.approx(5 * MS, rel=1e-6)]
    late = run.time > 5.01 * MS
    assert np.all(run["valve.position"][late] == 0)
    assert np.all(run["valve.q"][late] == 0)


def test_overdriven_relief_valve_stops_at_full_opening() -> None:
    """At twice the range it goes to 1 and rests there: full flow Cd A sqrt(2 dp/rho)."""
    valve = SecondOrderReliefValve(
        area=20e-6, cracking_pressure=100 * BAR, opening_range=20 * BAR, natural_frequency=50.0
    )
    there = {"p_a": 140 * BAR, "p_b": 0.0, "fluid": STIFF}
    stopped = valve.equations(position=1.0, rate=0.0, at=1.0, **there)
    assert stopped["der_rate"] == 0.0
    assert not stopped["leaves"].condition
    assert stopped["q"] == pytest.approx(through(20e-6, 140 * BAR), rel=1e-6)
    assert valve.equations(position=1.0, rate=0.0, at=1.0, **{**there, "p_a": 119 * BAR})["leaves"].condition


# --- shuttle and check valves -----------------------------------------------------------------------------------------


def test_shuttle_stays_within_its_switching_pressure() -> None:
    """Inlets of 50 bar, one swinging by 1 bar: with 2 bar of switching pressure the ball never moves, with 0.5 bar it
    moves twice a period, where the difference passes -0.5 and 0.5 bar."""
    parts = {
        "one": {"type": "pressure_source", "pressure": "50 bar"},
        "swing": {"type": "sine", "mean": "50 bar", "amplitude": "1 bar", "frequency": "10 Hz",
                  "output_quantity": "pressure"},
        "two": {"type": "signal_pressure_source"},
        "valve": {"type": "shuttle_valve", "area": "10 mm^2", "switching_pressure": "0.5 bar"},
        "user": {"type": "capacity", "volume": "1 L", "start": {"p": "50 bar"}},
    }  # fmt: skip
    nets = {
        "u": ["swing.y", "two.pressure"], "a": ["one.port", "valve.a"], "b": ["two.port", "valve.b"],
        "o": ["valve.outlet", "user.port"],
    }  # fmt: skip
    made = circuit(components=parts, nets=nets, fluid=OIL_TEXT, simulation={"stop": "200 ms"})
    run = made.simulate()
    first = math.asin(0.5) / (20 * math.pi)
    assert fired(run, "valve.to_b") == pytest.approx([first, 0.1 + first], rel=1e-6)
    assert fired(run, "valve.to_a") == pytest.approx([0.05 + first, 0.15 + first], rel=1e-6)
    still = made.simulate(parameters={"valve.switching_pressure": "2 bar"})
    assert fired(still, "valve.to_b") == []


def test_shuttle_starts_on_the_right_side() -> None:
    """With b the higher from the start the ball is there at once, and a passes nothing."""
    valve = ShuttleValve(area=10e-6)
    got = valve.equations(p_a=0.0, p_b=50 * BAR, p_outlet=20 * BAR, at=1.0, fluid=OIL)
    assert got["to_b"].condition
    assert got["to_b"].then == {"at": -1.0}
    moved = valve.equations(p_a=0.0, p_b=50 * BAR, p_outlet=20 * BAR, at=-1.0, fluid=OIL)
    assert moved["q_a"] == 0.0
    assert moved["q_outlet"] == -moved["q_b"]


def test_pilot_operated_check_valve_holds_without_pilot() -> None:
    """No pilot: nothing back at any load. With the pilot of the inlet itself it is a plain check valve."""
    valve = PilotOperatedCheckValve(area=10e-6, opening_range=1 * BAR)
    for load in (10, 100, 300):
        assert valve.equations(p_a=0.0, p_b=load * BAR, p_pilot=0.0, fluid=OIL)["q"] == 0.0
    forwards = valve.equations(p_a=20 * BAR, p_b=0.0, p_pilot=20 * BAR, fluid=OIL)
    assert forwards["lift"] == 1.0
    assert forwards["q"] == pytest.approx(through(10e-6, 20 * BAR), rel=5e-3)


def test_rectifier_of_ideal_check_valves() -> None:
    """Four in a bridge turn a flow that swings round into one that does not: |q| at every instant."""
    valve = IdealCheckValve()
    for drop in (-3 * BAR, -1.0, 0.0, 1.0, 3 * BAR):
        there = valve.equations(p_a=drop, p_b=0.0, fluid=STIFF)["q"]
        back = valve.equations(p_a=0.0, p_b=drop, fluid=STIFF)["q"]
        assert there + back == pytest.approx(1e-7 * abs(drop), rel=1e-9)
        assert min(there, back) == 0.0
