"""Valves without mass: their moving parts between the stops, held against closed forms and an own integration.

Balance of forces: T ds/dt = s_0 - s with s_0 as far beyond the stops as the pressures put it, s held between them.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from building import OIL as OIL_TEXT
from building import circuit, fired
from crescentlab.components.fluids import SimpleOil
from crescentlab.components.pressure_valves import (
    BypassCompensator,
    CounterbalanceValve,
    PressureCompensator,
    ReducingRelievingValve,
    ReducingValve,
    ReliefValve,
    SequenceValve,
)
from crescentlab.components.proportional_valves import FlowDivider, PriorityValve, ProportionalReliefValve
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from crescentlab.analysis.linear import linearize
from crescentlab.analysis.outcome import Outcome
from crescentlab.analysis.periodic import periodic
from crescentlab.analysis.sensitivity import sensitivities
from crescentlab.analysis.steady import steady
from crescentlab.circuit import SOLVERS, Circuit
from crescentlab.component import Component

BAR, MS, LPM = 1e5, 1e-3, 1e-3 / 60
OIL = SimpleOil(density=860.0, kinematic_viscosity=35e-6, bulk_modulus=1.4e9)
SET = {"area": 20e-6, "time_constant": 4e-3}

LAGGING: dict[str, tuple[Component, str, dict[str, float], str, float, float]] = {
    "relief": (
        ReliefValve(cracking_pressure=100 * BAR, opening_range=20 * BAR, **SET),
        "lift", {"p_b": 2 * BAR}, "p_a", 102 * BAR, 20 * BAR,
    ),
    "reducing": (
        ReducingValve(set_pressure=50 * BAR, closing_range=10 * BAR, **SET),
        "lift", {"p_a": 200 * BAR, "p_drain": 1 * BAR}, "p_b", 51 * BAR, -10 * BAR,
    ),
    "reducing_relieving": (
        ReducingRelievingValve(set_pressure=50 * BAR, closing_range=10 * BAR, dead_band=3 * BAR, **SET),
        "stroke", {"p_supply": 200 * BAR, "p_tank": 1 * BAR}, "p_outlet", 51 * BAR, -10 * BAR,
    ),
    "sequence": (
        SequenceValve(set_pressure=100 * BAR, opening_range=20 * BAR, **SET),
        "lift", {"p_a": 150 * BAR, "p_b": 30 * BAR, "p_drain": 1 * BAR}, "p_pilot", 101 * BAR, 20 * BAR,
    ),
    "counterbalance": (
        CounterbalanceValve(set_pressure=100 * BAR, opening_range=20 * BAR, pilot_ratio=4.0, **SET),
        "lift", {"p_a": 80 * BAR, "p_b": 1 * BAR}, "p_pilot", 25 / 4 * BAR, 5 * BAR,
    ),
    "compensator": (
        PressureCompensator(control_pressure=8 * BAR, closing_range=2 * BAR, **SET),
        "lift", {"p_a": 200 * BAR, "p_load": 60 * BAR}, "p_b", 70 * BAR, -2 * BAR,
    ),
    "bypass": (
        BypassCompensator(control_pressure=8 * BAR, opening_range=2 * BAR, **SET),
        "lift", {"p_b": 1 * BAR, "p_load": 60 * BAR}, "p_a", 68 * BAR, 2 * BAR,
    ),
    "proportional_relief": (
        ProportionalReliefValve(opening_range=20 * BAR, **SET),
        "lift", {"p_b": 2 * BAR, "setting": 100 * BAR}, "p_a", 102 * BAR, 20 * BAR,
    ),
    "priority": (
        PriorityValve(control_pressure=7 * BAR, control_range=2 * BAR, **SET),
        "lift", {"p_inlet": 150 * BAR, "p_surplus": 1 * BAR, "p_load": 60 * BAR}, "p_priority", 67 * BAR, 2 * BAR,
    ),
}  # fmt: skip
"""Valve, its position, pressures that stay, the one that drives it, where that puts it at 0, and its change per 1."""


def put(kind: str, target: float, position: float, at: float) -> dict[str, Any]:
    """What the valve returns where its pressures ask for the `target`."""
    valve, name, rest, driver, zero, one = LAGGING[kind]
    asked = {**rest, driver: zero + target * one, name: position, "at": at}
    found: dict[str, Any] = valve.equations(**asked, fluid=OIL)
    return {key.replace(name, "s"): value for key, value in found.items()}


@pytest.mark.parametrize("kind", LAGGING)
def test_the_force_beyond_a_stop_counts(kind: str) -> None:
    """T ds/dt = s_0 - s on the way, whatever s_0; nothing moves on a stop, which is left when s_0 leads away from it.

    1e-9: the pressures are of 100 bar, their differences of 1 bar, both rounded to 1e-16.
    """
    low = -1.3 if kind == "reducing_relieving" else 0.0
    for target in (-5.0, 0.3, 4.0):
        for position in (0.1, 0.5, 0.9):
            rate = put(kind, target, position, 0.0)["der_s"]
            assert rate == pytest.approx((target - position) / 4e-3, rel=1e-9)
        for at, position in ((-1.0, low), (1.0, 1.0)):
            rests = put(kind, target, position, at)
            assert rests["der_s"] == 0
            assert rests["leaves"].condition == (target > low if at < 0 else target < 1)
            assert not rests["hits_low"].condition
            assert not rests["hits_high"].condition
    beyond = put(kind, -5.0, low - 1e-3, 0.0)["hits_low"]
    assert beyond.condition
    assert list(beyond.then.values()) == [pytest.approx(low), -1.0]
    assert put(kind, 5.0, 1.001, 0.0)["hits_high"].condition
    assert not put(kind, 0.5, -1e-18, 0.0)["hits_low"].condition


def test_divider_has_two_stops() -> None:
    """(d_a - d_b)/p_r beyond 1: full drops of 80 and 100 bar on edges with n = 2 (1 -+ x), springs of 1 bar."""
    valve = FlowDivider(area=20e-6, centring_range=1 * BAR, time_constant=4e-3)
    for x in (-0.5, 0.0, 0.5):
        n_a, n_b = 2 * (1 - x), 2 * (1 + x)
        uneven = 80 * n_a**2 / (1 + n_a**2) - 100 * n_b**2 / (1 + n_b**2)
        got = valve.equations(p_inlet=100 * BAR, p_a=20 * BAR, p_b=0.0, stroke=x, at=0.0, fluid=OIL)
        assert got["der_stroke"] == pytest.approx((uneven - x) / 4e-3, rel=1e-12)
    rests = valve.equations(p_inlet=100 * BAR, p_a=20 * BAR, p_b=200 * BAR, stroke=-1.0, at=-1.0, fluid=OIL)
    assert rests["der_stroke"] == 0
    assert rests["leaves"].condition


# --- times ------------------------------------------------------------------------------------------------------------


def driven(valve: dict[str, Any], source: dict[str, Any], **simulation: str) -> Circuit:
    """A relief valve, 100 bar and 20 bar further, T = 5 ms, between a pressure over time and a tank."""
    parts = {
        "asked": {"output_quantity": "pressure", **source}, "inlet": {"type": "signal_pressure_source"},
        "valve": {"type": "relief_valve", "area": "10 mm^2", "cracking_pressure": "100 bar",
                  "opening_range": "20 bar", **valve},
        "tank": {"type": "tank"},
    }  # fmt: skip
    nets = {"u": ["asked.y", "inlet.pressure"], "a": ["inlet.port", "valve.a"], "t": ["valve.b", "tank.port"]}
    return circuit(components=parts, nets=nets, fluid=OIL_TEXT, simulation={"stop": "20 ms", **simulation})


CONSTANT = {"type": "constant", "value": "0 bar"}


@pytest.mark.parametrize("solver", sorted(set(SOLVERS) - {"auto"}))
def test_seated_by_the_spring(solver: str) -> None:
    """Half open, no pressure: 0.5 - 5.5 (1 - e^(-t/T)) is 0 after T ln(5.5/5) = 0.477 ms, and stays so.

    1e-5: ten times the run's tolerance of 1e-6 on a lift of 0.5 that changes by 1100/s, over 0.477 ms.
    """
    run = driven({"start": {"lift": "0.5"}}, CONSTANT).simulate(solver=solver, rtol=1e-6)
    assert fired(run, "valve.hits_low") == [pytest.approx(5 * MS * math.log(5.5 / 5), rel=1e-5)]
    assert fired(run, "valve.leaves") == []
    assert np.all(run["valve.lift"][run.time > 0.48 * MS] == 0.0)


def test_overdamped_limit() -> None:
    """With 2 zeta/omega = T at 5 kHz and zeta 78.54 the second-order valve is the first-order one, but for the start of
    a fall, 1/(2 zeta omega) = 0.2 us: it arrives that much later, T ln(5.5/5) + 0.2026 us ln(...) < 1 us apart."""
    second = {
        "type": "second_order_relief_valve", "natural_frequency": "5 kHz", "damping_ratio": "78.5398",
        "start": {"position": "0.5"},
    }  # fmt: skip
    late = fired(driven(second, CONSTANT).simulate(rtol=1e-8), "valve.hits_low")[0]
    assert late == pytest.approx(5 * MS * math.log(5.5 / 5), abs=1e-6)


@pytest.mark.parametrize("start", ["0.4", "1", "1.7", "-0.5", "0"])
@pytest.mark.parametrize("pressure", [70, 100, 110, 120, 150])
def test_any_start(start: str, pressure: int) -> None:
    """A start beyond a stop begins on it; from there s_0 + (s - s_0) e^(-t/T), as far as the stops let it."""
    source = {"type": "constant", "value": f"{pressure} bar"}
    run = driven({"start": {"lift": start}}, source, output_step="0.1 ms").simulate(rtol=1e-9)
    target, begin = (pressure - 100) / 20, min(max(float(start), 0.0), 1.0)
    after = run.time > 0  # the row before the events of the start shows it as it is given
    expected = np.clip(target + (begin - target) * np.exp(-run.time / (5 * MS)), 0.0, 1.0)
    np.testing.assert_allclose(run["valve.lift"][after], expected[after], atol=1e-8)
    assert len(fired(run, "valve.hits_low")) + len(fired(run, "valve.hits_high")) <= 1
    assert fired(run, "valve.leaves") == []


@pytest.mark.parametrize("solver", ["lsoda", "rodas", "dopri"])
def test_nothing_happens_at_rest(solver: str) -> None:
    """Shut for ten seconds below, and just at, its cracking pressure: no event after the start, no restart."""
    for pressure in ("70 bar", "100 bar"):
        made = driven({}, {"type": "constant", "value": pressure}, stop="10 s")
        run = made.simulate(solver=solver)
        assert {h.time for h in run.trajectory.happenings} == {0.0}
        assert run.trajectory.statistics.restarts <= 1  # the beginning itself


@pytest.mark.parametrize("solver", ["lsoda", "bdf", "rodas", "dopri", "radau"])
def test_swinging_about_the_cracking_pressure(solver: str) -> None:
    """100 bar + 10 bar sin(wt): leaves as the pressure passes 100 bar upwards, once a period, and is back on the seat
    once where s = e (sin(wt - d) + sin d e^(-t/T)), d = atan(wT), e = 0.5 cos d, is 0 again; never anything else."""
    w, T = 2 * math.pi * 50, 5 * MS
    source = {"type": "sine", "mean": "100 bar", "amplitude": "10 bar", "frequency": "50 Hz"}
    run = driven({}, source, stop="98 ms").simulate(solver=solver, rtol=1e-8)
    d = math.atan(w * T)
    first = solve_ivp(lambda t, s: [(0.5 * math.sin(w * t) - s[0]) / T], (0, 20 * MS), [0.0], rtol=1e-10, atol=1e-12,
                      dense_output=True).sol  # fmt: skip
    rises = np.linspace(0.1 * MS, 19 * MS, 2000)
    np.testing.assert_allclose(
        first(rises)[0], 0.5 * math.cos(d) * (np.sin(w * rises - d) + math.sin(d) * np.exp(-rises / T)), atol=1e-8
    )
    back = rises[np.flatnonzero(first(rises)[0] < 0)[0]]
    hits, leaves = fired(run, "valve.hits_low"), fired(run, "valve.leaves")
    assert [t for t in hits if t > 0] == pytest.approx([back + k / 50 for k in range(5)], abs=0.01 * MS)
    assert [t for t in leaves if t > 0] == pytest.approx([k / 50 for k in range(1, 5)], abs=1e-6)


# --- on a volume ------------------------------------------------------------------------------------------------------

HARD = {**OIL_TEXT, "bulk_modulus": "1e9 bar"}
"""So that no density matters."""
WALL = {"type": "elastic_capacity", "diameter": "80 mm", "length": "200 mm", "wall_thickness": "0.4 mm"}


def on_a_volume(**simulation: str) -> Circuit:
    """A pump that swings between 0 and 20 L/min at 20 Hz on a relief valve with an elastic vessel before it."""
    parts = {
        "asked": {"type": "sine", "output_quantity": "flow", "mean": "10 L/min", "amplitude": "10 L/min",
                  "frequency": "20 Hz"},
        "pump": {"type": "signal_flow_source"}, "tank": {"type": "tank"}, "vessel": {**WALL, "start": {"p": "60 bar"}},
        "leak": {"type": "orifice", "area": "1 mm^2"},
        "valve": {"type": "relief_valve", "area": "6 mm^2", "cracking_pressure": "100 bar", "opening_range": "20 bar",
                  "time_constant": "3 ms"},
    }  # fmt: skip
    nets = {
        "u": ["asked.y", "pump.flow"], "p": ["pump.port", "vessel.port", "valve.a", "leak.a"],
        "t": ["valve.b", "tank.port", "leak.b"],
    }  # fmt: skip
    return circuit(components=parts, nets=nets, fluid=HARD, simulation={"stop": "200 ms", **simulation})


def own(until: float) -> tuple[list[float], list[float], list[float], list[float]]:
    """The same by SciPy, stop by stop: pressures and lifts every ms, times at which it leaves and hits its seat."""
    d, e = 80e-3, 0.4e-3
    compliance = (2 * 1.3 + 3.8 * d**2 / ((d + 2 * e) ** 2 - d**2)) / 210e9 * math.pi / 4 * d**2 * 0.2
    T, free, t, y = 3 * MS, False, 0.0, [60 * BAR, 0.0]
    p_all: list[float] = []
    s_all: list[float] = []
    times: tuple[list[float], list[float], list[float]] = ([], [], [])

    def rate(t: float, y: np.ndarray) -> list[float]:
        q_in = 10 * LPM * (1 + math.sin(40 * math.pi * t))
        q_out = 0.7 * (6e-6 * y[1] + 1e-6) * math.sqrt(2 * y[0] / 860)
        return [(q_in - q_out) / compliance, ((y[0] / BAR - 100) / 20 - y[1]) / T if free else 0.0]

    def opens(t: float, y: np.ndarray) -> float:
        return y[0] / BAR - 100

    def seated(t: float, y: np.ndarray) -> float:
        return y[1]

    def stopped(t: float, y: np.ndarray) -> float:
        return y[1] - 1

    seated.terminal = opens.terminal = stopped.terminal = True  # type: ignore[attr-defined]
    seated.direction, opens.direction, stopped.direction = -1, 1, 1  # type: ignore[attr-defined]
    grid = np.arange(0.0, until + 1e-9, MS)
    while t < until:
        watch = [seated, stopped] if free else [opens]
        part = solve_ivp(rate, (t, until), y, method="LSODA", rtol=1e-11, atol=[1e-3, 1e-12], events=watch,
                         dense_output=True)  # fmt: skip
        own_grid = grid[(grid >= t) & (grid < part.t[-1])]
        if own_grid.size:
            p_all += list(part.sol(own_grid)[0])
            s_all += list(part.sol(own_grid)[1])
        t, y = float(part.t[-1]), [float(part.y[0, -1]), float(part.y[1, -1])]
        if part.status == 0:
            break
        assert not (free and part.t_events[1].size), "it does not open fully here"
        (times[1] if free else times[0]).append(t)
        free, y[1] = not free, max(y[1], 0.0) if not free else 0.0
    return p_all, s_all, times[0], times[1]


@pytest.mark.parametrize("solver", ["lsoda", "bdf", "rodas"])
def test_relief_valve_on_a_volume_by_an_own_integration(solver: str) -> None:
    """Opens and shuts in every period; pressures, lifts and all times of the seat.

    1e-5 of 100 bar: tanh(2 lambda/lambda_c), which the own equations leave out, is 1 to 1e-6 at these flows.
    """
    pressures, lifts, leaves, hits = own(0.2)
    assert len(leaves) == len(hits) == 4
    run = on_a_volume(output_step="1 ms").simulate(solver=solver, rtol=1e-9)
    rows = np.flatnonzero(np.append(np.diff(run.time) > 0, True))[: len(pressures)]
    np.testing.assert_allclose(run["vessel.p"][rows], pressures, atol=1e-5 * 100 * BAR)
    np.testing.assert_allclose(run["valve.lift"][rows], lifts, atol=1e-4)
    assert fired(run, "valve.leaves") == pytest.approx(leaves, abs=1e-6)
    assert [t for t in fired(run, "valve.hits_low") if t > 0] == pytest.approx(hits, abs=1e-6)


# --- analyses ---------------------------------------------------------------------------------------------------------


CONDUCTANCE = 10e-3 * (0.2e-3) ** 3 / (12 * 35e-6 * 860 * 20e-3)
"""Of the gap below: b h^3/(12 mu l)."""


def fed(flow: str) -> Circuit:
    """A pump on a relief valve, 100 bar and 20 bar further, with a laminar leak that takes 6.6 L/min at 100 bar."""
    parts = {
        "pump": {"type": "flow_source", "flow": flow}, "tank": {"type": "tank"},
        "vessel": {**WALL, "start": {"p": "90 bar"}},
        "leak": {"type": "laminar_gap", "width": "10 mm", "height": "0.2 mm", "length": "20 mm"},
        "valve": {"type": "relief_valve", "area": "6 mm^2", "cracking_pressure": "100 bar", "opening_range": "20 bar"},
    }  # fmt: skip
    nets = {"p": ["pump.port", "vessel.port", "valve.a", "leak.a"], "t": ["valve.b", "tank.port", "leak.b"]}
    return circuit(components=parts, nets=nets, fluid=HARD, simulation={"stop": "200 ms"})


@pytest.mark.parametrize(("flow", "at"), [(3, -1), (20, 0), (60, 1)])
def test_operating_point_and_linear_model(flow: int, at: int) -> None:
    """Shut, in between and fully open: flows add up, by hand; on a stop the vessel alone moves, and the gain of the
    pressure is that of what flows out, 1/(G + dq/dp), in between 1/(G + q/(2 p) + dq/ds/p_r) at T ds/dt = 0.

    1e-5: tanh(2 lambda/lambda_c) is 1 to 1e-6.
    """
    made = fed(f"{flow} L/min")
    point = steady(made)

    def lift(p: float) -> float:
        return min(max((p / BAR - 100) / 20, 0.0), 1.0)

    def through(p: float) -> float:
        return 0.7 * 6e-6 * lift(p) * math.sqrt(2 * p / 860)

    p = brentq(lambda p: CONDUCTANCE * p + through(p) - flow * LPM, 1.0, 400 * BAR, xtol=1e-3)
    assert point.result["vessel.p"][0] == pytest.approx(p, rel=1e-5)
    assert point.result["valve.lift"][0] == pytest.approx(lift(p), abs=1e-5)
    assert point.result["valve.at"][0] == at
    assert point.resting == (() if at == 0 else ("valve.lift",))
    run = made.simulate("20 ms", start=point.snapshot)
    assert run.trajectory.happenings == []
    assert run["vessel.p"][-1] == pytest.approx(p, rel=1e-5)

    model = linearize(made, inputs=["pump.flow"], outputs=["vessel.p"])
    moving = [0] if at else [0, 1]
    A = model.A[np.ix_(moving, moving)]
    gain = -(model.C[:, moving] @ np.linalg.solve(A, model.B[moving]))[0, 0]
    slope = CONDUCTANCE + through(p) / (2 * p) + (0.7 * 6e-6 * math.sqrt(2 * p / 860) / (20 * BAR) if at == 0 else 0)
    assert gain == pytest.approx(1 / slope, rel=1e-4)
    assert np.all(model.A[1] == 0) == bool(at)


def test_periodic_steady_state() -> None:
    """The pump that swings about: found by shooting, it is where the own integration is after 20 periods."""
    pressures, lifts, _, _ = own(1.0)
    state = periodic(on_a_volume(), period="50 ms", tolerance=1e-6, rtol=1e-8).result
    for t in (0.0, 5 * MS, 20 * MS, 35 * MS):
        row = 950 + round(t / MS)
        assert np.interp(state.time[0] + t, state.time, state["vessel.p"]) == pytest.approx(pressures[row], rel=1e-4)
        assert np.interp(state.time[0] + t, state.time, state["valve.lift"]) == pytest.approx(lifts[row], abs=1e-3)


def test_sensitivity_through_the_seat() -> None:
    """Exact derivatives through opening and seating against those by differences of tight runs."""
    outcomes = [Outcome(text, text) for text in ("mean(vessel.p)", "maximum(vessel.p)", "mean(valve.lift)")]
    wanted = ["valve.cracking_pressure", "valve.time_constant", "valve.opening_range", "vessel.length"]
    exact, other = (
        sensitivities(on_a_volume(), outcomes, wanted, method=method, rtol=rtol)
        for method, rtol in (("exact", 1e-8), ("differences", 1e-10))
    )
    assert set(exact.method) == {"exact"}
    sizes = np.abs(exact.values[:, None] / [parameter.size for parameter in exact.parameters])
    np.testing.assert_array_less(np.abs(exact.derivative - other.derivative), 1e-5 * sizes)


def test_sensitivity_of_a_fall_to_the_seat() -> None:
    """Mean lift over a run in which it falls from s = 1/2 with s_0 = -5: [T (s - s_0 - (-s_0)) + s_0 t_s]/t_end with
    t_s = T ln((s - s_0)/(-s_0)), by T: all of it is in proportion to T."""
    made = driven({"start": {"lift": "0.5"}}, CONSTANT)
    found = sensitivities(made, [Outcome("mean", "mean(valve.lift)")], ["valve.time_constant"], rtol=1e-9)
    T, end = 5 * MS, 20 * MS
    mean = (T * 0.5 - 5 * T * math.log(1.1)) / end
    assert found.method[0] == "exact"
    assert found.values[0] == pytest.approx(mean, rel=1e-6)
    assert found.derivative[0, 0] == pytest.approx(mean / T, rel=1e-6)
