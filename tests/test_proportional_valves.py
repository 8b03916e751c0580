"""Valves that a signal sets or that share a flow out: limits, signs, conservation; their figures are in `evidence`."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from building import OIL as OIL_TEXT
from building import circuit
from crescentlab.components.fluids import SimpleOil
from crescentlab.components.pressure_valves import ReliefValve
from crescentlab.components.proportional_valves import FlowDivider, PriorityValve, ProportionalReliefValve

from crescentlab.result import Result

BAR, LPM, MS = 1e5, 1e-3 / 60, 1e-3
OIL = SimpleOil(density=860.0, kinematic_viscosity=35e-6, bulk_modulus=1.4e9)
STIFF = SimpleOil(density=860.0, kinematic_viscosity=35e-6, bulk_modulus=1e15)


def through(area: float, drop: float) -> float:
    """Cd A sqrt(2 dp/rho) with Cd 0.7 and 860 kg/m^3."""
    return 0.7 * area * math.sqrt(2 * drop / 860)


def closed(run: Result) -> None:
    """Neither fluid nor energy is lost: the tolerance of the runs, 1e-8 on the states, summed up over them."""
    assert run.balance is not None
    assert run.balance.circuit < 1e-6
    assert run.balance.energy is not None
    assert run.balance.energy.circuit < 1e-6


# --- proportional relief valve ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("p", [0.0, 80 * BAR, 104 * BAR, 300 * BAR])
def test_at_a_steady_signal_it_is_a_relief_valve(p: float) -> None:
    """Equation by equation."""
    common: dict[str, Any] = {"area": 20e-6, "opening_range": 20 * BAR}
    at = {"p_a": p, "p_b": 2 * BAR, "lift": 0.3, "at": 0.0, "fluid": OIL}
    set_by_signal = ProportionalReliefValve(**common).equations(setting=100 * BAR, **at)
    assert set_by_signal == ReliefValve(cracking_pressure=100 * BAR, **common).equations(**at)


def test_pressure_follows_the_signal() -> None:
    """A ramp from 40 to 160 bar within 1 s: at both ends p_c + s p_r, on the way at the same s, 5 ms behind at most."""
    parts = {
        "pump": {"type": "flow_source", "flow": "20 L/min"}, "tank": {"type": "tank"},
        "line": {"type": "capacity", "volume": "100 cm^3", "start": {"p": "40 bar"}},
        "asked": {"type": "ramp", "output_quantity": "pressure", "before": "40 bar", "after": "160 bar", "at": "0.5 s",
                  "duration": "1 s"},
        "valve": {"type": "proportional_relief_valve", "area": "20 mm^2", "opening_range": "20 bar"},
    }  # fmt: skip
    nets = {
        "p": ["pump.port", "line.port", "valve.a"],
        "t": ["valve.b", "tank.port"],
        "u": ["asked.y", "valve.setting"],
    }
    run = circuit(components=parts, nets=nets, fluid=OIL_TEXT, simulation={"stop": "2.5 s"}).simulate(rtol=1e-8)
    for t, setting in ((0.49, 40), (2.5, 160)):
        p, lift = (np.interp(t, run.time, run[name]) for name in ("line.p", "valve.lift"))
        assert p == pytest.approx((setting + 20 * lift) * BAR, rel=1e-5)
    p, lift = (np.interp(1.0, run.time, run[name]) for name in ("line.p", "valve.lift"))
    assert abs(p - (100 + 20 * lift) * BAR) < 120 * BAR * 5 * MS
    closed(run)


# --- flow divider -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("x", [-1.5, -1.0, -0.2, 0.0, 0.7, 1.0])
@pytest.mark.parametrize("share", [0.2, 0.5])
def test_divider_keeps_nothing(x: float, share: float) -> None:
    """What enters leaves to the last digit; mirrored, it is the divider of the other share."""
    common: dict[str, Any] = {"area": 15e-6, "centring_range": 0.5 * BAR}
    one, other = FlowDivider(share=share, **common), FlowDivider(share=1 - share, **common)
    got = one.equations(p_inlet=150 * BAR, p_a=100 * BAR, p_b=20 * BAR, stroke=x, at=0.0, fluid=OIL)
    assert got["q_inlet"] + (got["q_a"] + got["q_b"]) == 0.0
    mirror = other.equations(p_inlet=150 * BAR, p_a=20 * BAR, p_b=100 * BAR, stroke=-x, at=0.0, fluid=OIL)
    assert got["q_a"] == pytest.approx(mirror["q_b"], rel=1e-12)
    assert got["der_stroke"] == pytest.approx(-mirror["der_stroke"], rel=1e-12)


def driven(valve: dict[str, str], loads: dict[str, Any], nets: dict[str, list[str]], stop: str = "500 ms") -> Result:
    """A pump of 40 L/min with a relief valve at 250 bar before a divider."""
    parts = {
        "pump": {"type": "flow_source", "flow": "40 L/min"}, "tank": {"type": "tank"},
        "line": {"type": "capacity", "volume": "500 cm^3", "start": {"p": "100 bar"}},
        "relief": {"type": "relief_valve", "area": "50 mm^2", "cracking_pressure": "250 bar",
                   "opening_range": "10 bar"},
        "valve": {"type": "flow_divider", "area": "15 mm^2", "centring_range": "0.5 bar", **valve}, **loads,
    }  # fmt: skip
    every = {"p": ["pump.port", "line.port", "relief.a", "valve.inlet"], "t": ["relief.b", "tank.port"], **nets}
    return circuit(components=parts, nets=every, fluid=OIL_TEXT, simulation={"stop": stop}).simulate(rtol=1e-8)


def test_divider_keeps_its_ratio_while_a_load_changes() -> None:
    """Load a rises from 10 to 180 bar, b stays at 60: the share of a is off by x p_r/(8 d), 0.3 %, as the spool goes
    either way; the whole passes.

    6e-4: the oil of the two sides differs by 0.43 % in density, a quarter of half of that.
    """
    loads = {
        "asked": {"type": "ramp", "output_quantity": "pressure", "before": "10 bar", "after": "180 bar",
                  "at": "300 ms", "duration": "100 ms"},
        "first": {"type": "signal_pressure_source"}, "second": {"type": "pressure_source", "pressure": "60 bar"},
    }  # fmt: skip
    nets = {"a": ["valve.a", "first.port"], "b": ["valve.b", "second.port"], "u": ["asked.y", "first.pressure"]}
    run = driven({}, loads, nets, "900 ms")
    drop = 860 / 2 * (20 * LPM / (0.7 * 7.5e-6)) ** 2
    for t, sign in ((0.29, 1), (0.9, -1)):
        to_a, to_b = (-np.interp(t, run.time, run[f"valve.{port}.q"]) for port in ("a", "b"))
        x = np.interp(t, run.time, run["valve.stroke"])
        assert 0.6 < sign * x < 0.9
        assert to_a / (to_a + to_b) - 0.5 == pytest.approx(x * 0.5 * BAR / (8 * drop), abs=6e-4)
        assert to_a + to_b == pytest.approx(40 * LPM, rel=1e-3)
    closed(run)


def test_blocked_outlet_stops_the_other() -> None:
    """A full cylinder at a: no more than Cd A_b sqrt(2 p_r/rho) goes on to b, the rest over the relief valve."""
    loads = {
        "full": {"type": "capacity", "volume": "10 cm^3", "start": {"p": "100 bar"}},
        "second": {"type": "pressure_source", "pressure": "20 bar"},
    }
    run = driven({}, loads, {"a": ["valve.a", "full.port"], "b": ["valve.b", "second.port"]}, "2 s")
    assert abs(run["valve.a.q"][-1]) < 1e-6 * LPM
    to_b = -run["valve.b.q"][-1]
    assert 0.8 * through(7.5e-6, 0.5 * BAR) < to_b < through(7.5e-6, 0.5 * BAR)
    assert run["line.p"][-1] > 250 * BAR
    closed(run)


def backwards(combines: bool) -> tuple[float, float]:
    """Flows [m^3/s] that 100 and 140 bar at a and b push back into a tank at the inlet."""
    parts = {
        "first": {"type": "pressure_source", "pressure": "100 bar"}, "tank": {"type": "tank"},
        "second": {"type": "pressure_source", "pressure": "140 bar"},
        "valve": {"type": "flow_divider", "area": "15 mm^2", "centring_range": "0.5 bar",
                  "combines": str(combines).lower()},
    }  # fmt: skip
    nets = {"i": ["valve.inlet", "tank.port"], "a": ["valve.a", "first.port"], "b": ["valve.b", "second.port"]}
    run = circuit(components=parts, nets=nets, fluid=OIL_TEXT, simulation={"stop": "300 ms"}).simulate(rtol=1e-8)
    closed(run)
    return float(run["valve.a.q"][-1]), float(run["valve.b.q"][-1])


def test_reversed_flow() -> None:
    """A plain divider lets the larger reversed flow shut the other; one that combines keeps the ratio, to x p_r/(4 d)
    and the densities, 1 %."""
    shut, open_ = backwards(combines=False)
    assert shut == 0.0
    assert open_ > through(7.5e-6, 100 * BAR)
    one, two = backwards(combines=True)
    assert one == pytest.approx(two, rel=0.01)


def test_combining_mirrors_dividing() -> None:
    """With all drops turned round, all flows are; the spool goes the same way."""
    valve = FlowDivider(area=15e-6, share=0.3, centring_range=50 * BAR, combines=True)
    there = valve.equations(p_inlet=60 * BAR, p_a=10 * BAR, p_b=30 * BAR, stroke=0.2, at=0.0, fluid=STIFF)
    back = valve.equations(p_inlet=-60 * BAR, p_a=-10 * BAR, p_b=-30 * BAR, stroke=0.2, at=0.0, fluid=STIFF)
    for port in ("inlet", "a", "b"):
        assert back[f"q_{port}"] == pytest.approx(-there[f"q_{port}"], rel=1e-6)
    assert there["der_stroke"] == pytest.approx(back["der_stroke"], rel=1e-12)
    assert there["der_stroke"] != 0


# --- priority valve ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("lift", [-0.1, 0.0, 0.4, 1.0, 1.1])
def test_priority_valve_keeps_nothing(lift: float) -> None:
    """What enters leaves; shut is shut."""
    valve = PriorityValve(area=50e-6, control_pressure=7 * BAR, control_range=2 * BAR)
    got = valve.equations(
        p_inlet=150 * BAR, p_priority=40 * BAR, p_surplus=3 * BAR, p_load=33 * BAR, lift=lift, at=0.0, fluid=OIL
    )
    assert got["q_inlet"] + (got["q_priority"] + got["q_surplus"]) == 0.0
    assert (got["q_surplus"] == 0) == (lift <= 0)
    assert (got["q_priority"] == 0) == (lift >= 1)


@pytest.mark.parametrize(("pump", "first"), [(10, 10.0), (40, None)])
def test_priority_comes_first(pump: float, first: float | None) -> None:
    """10 mm^2 at 7 to 9 bar ask for 16.9 to 19.2 L/min: a pump of 10 L/min gives all it has, one of 40 L/min that, the
    rest goes to the surplus, whose load is the higher one."""
    parts = {
        "pump": {"type": "flow_source", "flow": f"{pump} L/min"}, "tank": {"type": "tank"},
        "line": {"type": "capacity", "volume": "500 cm^3"}, "outlet": {"type": "capacity", "volume": "100 cm^3"},
        "valve": {"type": "priority_valve", "area": "50 mm^2", "control_pressure": "7 bar", "control_range": "2 bar"},
        "edge": {"type": "orifice", "area": "10 mm^2"},
        "steering": {"type": "pressure_source", "pressure": "30 bar"},
        "others": {"type": "relief_valve", "area": "50 mm^2", "cracking_pressure": "80 bar", "opening_range": "10 bar"},
        "behind": {"type": "capacity", "volume": "500 cm^3"},
    }  # fmt: skip
    nets = {
        "p": ["pump.port", "line.port", "valve.inlet"], "c": ["valve.priority", "outlet.port", "edge.a"],
        "l": ["edge.b", "steering.port", "valve.load"], "e": ["valve.surplus", "behind.port", "others.a"],
        "t": ["others.b", "tank.port"],
    }  # fmt: skip
    run = circuit(components=parts, nets=nets, fluid=OIL_TEXT, simulation={"stop": "3 s"}).simulate(rtol=1e-8)
    q = run["edge.q"][-1]
    if first is not None:
        assert q == pytest.approx(first * LPM, rel=1e-3)
        assert run["others.q"][-1] == 0.0
    else:
        assert through(10e-6, 7 * BAR) < q < through(10e-6, 9 * BAR) * 1.003
        assert run["others.q"][-1] == pytest.approx(pump * LPM - q, rel=1e-3)
    closed(run)
