"""Operating points: closed forms, long transients, what is kept where they are not unique, and what is told."""

from __future__ import annotations

import itertools
import json
import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from building import OIL, circuit
from scipy.optimize import brentq
from scipy.signal import find_peaks

import crescentlab as cl
from crescentlab.analysis.steady import steady
from crescentlab.analysis.steady.newton import DENSE
from crescentlab.circuit import Circuit
from crescentlab.cli import main
from crescentlab.closed_sets import closed_sets
from crescentlab.commands.steady import summary
from crescentlab.component import Component
from crescentlab.domain import held, state
from crescentlab.errors import InputError, SimulationError
from crescentlab.maths import every, when
from crescentlab.solvers.snapshot import Snapshot
from crescentlab.units import Length, Ratio, Velocity

BAR, LPM = 1e5, 1e-3 / 60
RHO_0, BETA, NU = 860.0, 1.4e9, 35e-6
HOLE = {"type": "orifice", "area": "5 mm^2", "lambda_c": "0.001"}
"""So small a critical flow number that the discharge coefficient is its largest, 0.7, to rounding."""
TANK = {"type": "tank"}


def of(components: dict[str, Any], nets: dict[str, Any], **sections: Any) -> Circuit:
    """A circuit with oil."""
    return circuit(components=components, nets=nets, fluid=OIL, **sections)


def throttled(flow: dict[str, Any], start: str = "1 bar", **sections: Any) -> Circuit:
    """A flow into a volume and through a hole into the tank."""
    line = {"type": "capacity", "volume": "70 cm^3", "start": {"p": start}}
    nets = {"p_line": ["pump.port", "line.port", "hole.a"], "t_line": ["hole.b", "tank.port"]}
    return of({"pump": flow, "line": line, "hole": HOLE, "tank": TANK}, nets, **sections)


def hole_flow(p_a: float, p_b: float, area: float = 5e-6) -> float:
    """C_d A sqrt(2 rho dp)/rho_0, density at the mean pressure: the orifice equation at large flow numbers."""
    rho = RHO_0 * math.exp((p_a + p_b) / 2 / BETA)
    return 0.7 * area * math.copysign(math.sqrt(2 * abs(p_a - p_b) * rho), p_a - p_b) / RHO_0


def last(run: Circuit, stop: str, **options: Any) -> Snapshot:
    """Where a tight transient ends."""
    end = run.simulate(stop, solver="rodas", rtol=1e-9, **options).trajectory.end
    assert end is not None
    return end


# -- closed forms --------------------------------------------------------------------------------


@pytest.mark.parametrize("start", ["0 bar", "1 bar", "400 bar"])
def test_a_flow_through_a_hole(start):
    """30 L/min = C_d A sqrt(2 p rho(p/2))/rho_0 solved for p by bisection; time constant V rho/(rho_0 beta dq/dp).

    At 0 bar the hole is laminar, and so steep that Newton's method alone cannot leave it.
    """
    point = steady(throttled({"type": "flow_source", "flow": "30 L/min"}, start))
    p = brentq(lambda p: hole_flow(p, 0.0) - 30 * LPM, 1e5, 1e9, xtol=1e-6, rtol=1e-14)
    assert point.result["line.p"][0] == pytest.approx(p, rel=1e-9)
    assert (point.method, point.warnings) == ("continuation" if start == "0 bar" else "newton", ())
    assert point.result.time.tolist() == [0.0]
    assert point.residual <= 1e-9
    slope = (hole_flow(p * (1 + 1e-6), 0.0) - hole_flow(p * (1 - 1e-6), 0.0)) / (2e-6 * p)
    assert point.time_constant == pytest.approx(70e-6 * math.exp(p / BETA) / (BETA * slope), rel=1e-6)


def test_two_holes_in_series():
    """The pressure between them by bisection of equal flows; 5 and 10 mm^2: about 4/5 of the drop is at the first."""
    middle = {"type": "capacity", "volume": "10 cm^3"}
    parts = {"source": {"type": "pressure_source", "pressure": "100 bar"}, "first": HOLE, "middle": middle,
             "second": {**HOLE, "area": "10 mm^2"}, "tank": TANK}  # fmt: skip
    nets = {
        "a": ["source.port", "first.a"],
        "b": ["first.b", "middle.port", "second.a"],
        "c": ["second.b", "tank.port"],
    }
    p = brentq(lambda p: hole_flow(100 * BAR, p) - hole_flow(p, 0.0, 10e-6), 0.0, 100 * BAR, xtol=1e-6, rtol=1e-14)
    assert p == pytest.approx(20 * BAR, rel=1e-2)
    assert steady(of(parts, nets)).result["middle.p"][0] == pytest.approx(p, rel=1e-9)


def spring_mass(force: str, **parts: Any) -> Circuit:
    """A mass of 1 kg between stops 0 and 10 mm on a spring of 10 kN/m, pushed; with more parts on the rod."""
    all_parts = {
        "mass": {"type": "mass_with_stops", "mass": "1 kg", "high": "10 mm"},
        "spring": {"type": "spring", "stiffness": "10000 N/m"},
        "push": {"type": "force_source", "force": force}, **parts,
    }  # fmt: skip
    rods = [f"{name}.{'port' if name == 'mass' else 'rod'}" for name in all_parts]
    return circuit(components=all_parts, nets={"rod": rods})


DAMPER = {"type": "damper", "coefficient": "10 N s/m"}


def test_a_mass_on_a_spring_and_its_stops():
    """x = F/k; beyond the stroke the event puts it on its stop, where it rests: 500 N want 50 mm, -50 N want -5 mm."""
    free = steady(spring_mass("50 N", damper=DAMPER))
    assert (free.result["mass.x"][0], free.result["mass.v"][0]) == (pytest.approx(5e-3, rel=1e-12), 0.0)
    assert free.resting == ()
    assert free.time_constant == pytest.approx(2 * 1.0 / 10.0), "2 m/B of an underdamped mass"
    for force, at, x in (("500 N", 1.0, 10e-3), ("-50 N", -1.0, 0.0)):
        stopped = steady(spring_mass(force, damper=DAMPER))
        assert (stopped.result["mass.x"][0], stopped.result["mass.at"][0]) == (x, at)
        assert stopped.resting == ("mass.x", "mass.v")
        assert stopped.warnings == ()


def test_without_damping_it_says_that_nothing_comes_to_rest():
    """sqrt(k/m)/(2 pi) = 15.9 Hz."""
    point = steady(spring_mass("50 N"))
    assert point.result["mass.x"][0] == pytest.approx(5e-3, rel=1e-12)
    assert point.time_constant is None
    (said,) = point.warnings
    assert "nothing damps mass." in said
    assert "15.9 Hz" in said


# -- the relief valve ----------------------------------------------------------------------------


def test_the_relief_valve_is_where_a_long_transient_ends():
    """Within 1e-6 of a transient at rtol 1e-9, forty time constants long; found by continuation through its opening."""
    valve = cl.load("relief_valve")
    point = steady(valve)
    assert point.method == "continuation"
    assert point.time_constant is not None
    assert point.time_constant < 50e-3 / 40
    end = last(valve, "50 ms")
    assert point.snapshot.x[:2] == pytest.approx(end.x[:2], rel=1e-6)
    assert abs(point.snapshot.x[2] - end.x[2]) < 1e-6 * 1e-2, "velocity, over its nominal size"


def test_the_relief_valve_balances_by_hand():
    """p A - F_0 - k x - F_jet - (a Q + b Q^2) A = 0 with Q = 30 L/min; A = pi/4 (14 mm)^2, F_0 = 6.5 bar A."""
    result = steady(cl.load("relief_valve")).result
    area, q = math.pi / 4 * 14e-3**2, 30 * LPM
    p, x, jet = (float(result[n][0]) for n in ("p_line.p", "valve.x", "valve.holes.jet_force"))
    assert result["valve.q"][0] == pytest.approx(q, rel=1e-9)
    oil = result.design.fluids["fluid"]
    velocity = math.sqrt(2 * p / oil.density(p / 2))
    assert jet == pytest.approx(0.82 * oil.density(0.0) * q * velocity * math.cos(math.radians(69)), rel=1e-6)
    chamber = 1.8e7 * q + 1.296e11 * q**2
    assert (p - 6.5e5 - chamber) * area - 9000 * x - jet == pytest.approx(0.0, abs=1e-7 * p * area)


def test_the_transient_finds_it_where_nothing_else_may(monkeypatch):
    """The same point to 1e-8, with Newton's method from the closed valve failing and no continuation allowed."""
    point = steady(cl.load("relief_valve"))
    monkeypatch.setattr("crescentlab.analysis.steady.pseudo_transient.MOST", 0)
    other = steady(cl.load("relief_valve"))
    assert other.method == "transient"
    assert other.steps > 0
    assert other.snapshot.x == pytest.approx(point.snapshot.x, rel=1e-8, abs=1e-12)


def test_a_changed_parameter_from_the_point_before(tmp_path):
    """Newton's method alone suffices from a neighbouring point, read from its file; the same as from afar to 1e-8."""
    valve = cl.load("relief_valve")
    steady(valve).result.write(tmp_path / "point.nc")
    near = steady(valve, {"supply": "33 L/min"}, start=tmp_path / "point.nc")
    assert near.method == "newton"
    far = steady(valve, {"supply": "33 L/min"})
    assert near.snapshot.x == pytest.approx(far.snapshot.x, rel=1e-8, abs=1e-12)
    assert near.result["valve.q"][0] == pytest.approx(33 * LPM, rel=1e-9)


def test_a_run_that_starts_there_stays_there():
    """Every state within the tolerance of the run for ten time constants, whether given as snapshot or as result."""
    valve = cl.load("relief_valve")
    point = steady(valve)
    for start in (point.snapshot, point.result):
        run = valve.simulate("5 ms", solver="rodas", rtol=1e-6, start=start)
        moved = np.abs(run.trajectory.steps.x - point.snapshot.x)
        assert (moved <= 1e-6 * (point.system.nominal + np.abs(point.snapshot.x))).all()
        assert run.trajectory.happenings == []


# -- lines ---------------------------------------------------------------------------------------

LINE = {"type": "lax_wendroff_line", "diameter": "20 mm", "length": "3 m", "max_pressure": "40 bar"}


def fed_line(flow: str, **values: Any) -> Circuit:
    """A line from a reservoir of 20 bar, from which a flow is drawn."""
    parts = {"source": {"type": "pressure_source", "pressure": "20 bar"}, "line": {**LINE, **values},
             "load": {"type": "flow_source", "flow": f"-{flow}"}}  # fmt: skip
    return of(parts, {"a": ["source.port", "line.a"], "b": ["line.b", "load.port"]}, simulation={"stop": "50 ms"})


def test_a_line_at_rest_has_the_drop_of_steady_laminar_friction():
    """Hagen-Poiseuille: 128 mu L q/(pi d^4) with q the volume flow; Re = 4 q/(pi d nu) = 303, density at 20 bar.

    1e-4: Churchill's formula joins laminar and turbulent smoothly; q/rho changes by 2e-5 along the line.
    """
    q = 10 * LPM
    point = steady(fed_line("10 L/min"))
    drop = 128 * NU * RHO_0 * 3.0 * q / (math.pi * 0.02**4)
    assert 20 * BAR - point.result["b.p"][0] == pytest.approx(drop, rel=1e-4)
    assert point.result["line.q_node"][0] == pytest.approx(q, rel=1e-9)


def test_the_slowest_mode_of_a_line_with_laminar_friction():
    """A line closed at one end: exp(-t 16 nu/d^2), half the decay 32 nu/d^2 of a flow alone; and the scheme's own.

    The scheme keeps 1 - 4 c^2 (1 - c^2) sin^4(theta/2) of a wave's energy per tick, c = 0.9, and a quarter wave over
    25 cells turns theta = pi/50 a cell: 0.25 % of the decay. To the square of a cell over the length, 1.6e-3.
    """
    point = steady(fed_line("0 L/min"))
    c, theta, cell = 0.9, math.pi / 50, 3.0 / 25
    tick = c * cell / math.sqrt(BETA / (RHO_0 * math.exp(40 * BAR / BETA)))
    own = -math.log(1 - 4 * c**2 * (1 - c**2) * math.sin(theta / 2) ** 4) / 2 / tick
    assert own == pytest.approx(0.0025 * 16 * NU / 0.02**2, rel=0.05)
    assert 1 / point.time_constant == pytest.approx(16 * NU / 0.02**2 + own, rel=1.6e-3)


def churchill(reynolds: float) -> float:
    """Darcy factor of a smooth pipe: Churchill, Chemical Engineering 84 (1977) 91-92."""
    a = (2.457 * math.log(1 / (7 / reynolds) ** 0.9)) ** 16
    b = (37530 / reynolds) ** 16
    return 8 * ((8 / reynolds) ** 12 + (a + b) ** -1.5) ** (1 / 12)


def test_a_line_at_rest_has_the_drop_of_steady_turbulent_friction():
    """f L/d rho v^2/2 with Churchill's f at Re = 6063, 200 L/min, and half the dynamic head at the entry; to 1e-3."""
    q, area = 200 * LPM, math.pi / 4 * 0.02**2
    v, rho = q / area, RHO_0 * math.exp(20 * BAR / BETA)
    v *= RHO_0 / rho
    point = steady(fed_line("200 L/min", loss_coefficient="0.5"))
    friction = churchill(v * 0.02 / NU) * 3.0 / 0.02 * rho * v * v / 2
    assert 20 * BAR - point.result["b.p"][0] == pytest.approx(friction + 0.5 * rho * v * v / 2, rel=1e-3)


def test_a_line_with_a_load_is_where_a_long_transient_ends():
    """Reservoir, line, volume, hole: a transient of twelve time constants, to e^-12 of what was missing, 1e-5."""
    parts = {"source": {"type": "pressure_source", "pressure": "20 bar"}, "line": {**LINE, "length": "1 m"},
             "end": {"type": "capacity", "volume": "20 cm^3"}, "hole": {**HOLE, "area": "20 mm^2"},
             "tank": TANK}  # fmt: skip
    nets = {"a": ["source.port", "line.a"], "b": ["line.b", "end.port", "hole.a"], "t": ["hole.b", "tank.port"]}
    run = of(parts, nets, simulation={"stop": "0.1 s"})
    point = steady(run)
    assert point.time_constant is not None
    end = last(run, f"{12e3 * point.time_constant} ms")
    assert point.snapshot.x[2] == pytest.approx(end.x[2], rel=1e-5)
    nodes = [k for k, name in enumerate(point.system.held_names) if "_node[" in name]
    assert point.snapshot.h[nodes] == pytest.approx(end.h[nodes], rel=1e-4)
    assert (point.system.state_names[2], len(nodes)) == ("end.p", 2 * len(point.result["line.p_node"][0]))


def test_a_run_from_a_line_at_rest_stays_there():
    """Its ticks go on from the point: pressures within 1e-6 of their size plus 1 bar, over hundreds of ticks."""
    run = fed_line("100 L/min")
    point = steady(run)
    after = run.simulate("50 ms", solver="rodas", rtol=1e-6, start=point.snapshot)
    assert after.trajectory.statistics.ticks > 200
    p = point.result["b.p"][0]
    assert np.abs(after["b.p"] - p).max() <= 1e-6 * (p + BAR)


def test_what_counts_on_does_not_blur_the_point():
    """After 10^4 s and 10 m^3 a tick's 10^-8 m^3 would be lost in rounding; only differences enter, so nothing is."""
    run = fed_line("100 L/min")
    point = steady(run)
    late = {"line.into_a": 10.0, "line.into_b": -10.0, "line.had_a": 10.0, "line.had_b": -10.0, "line.t_node": 1e4}
    x, h = point.snapshot.x.copy(), point.snapshot.h.copy()
    for names, values in ((point.system.state_names, x), (point.system.held_names, h)):
        for k, name in enumerate(names):
            values[k] = late.get(name, values[k])
    again = steady(run, start=replace(point.snapshot, t=1e4, x=x, h=h))
    assert (again.method, again.snapshot.t, again.warnings) == ("newton", 1e4, ())
    assert again.snapshot.x.tolist() == x.tolist()
    assert again.result["b.p"][0] == pytest.approx(point.result["b.p"][0], rel=1e-12)


def test_two_lines_of_different_ticks():
    """Drops add up: two lines in series have that of one of their joint length (laminar), to 1e-4."""
    parts = {"source": {"type": "pressure_source", "pressure": "20 bar"}, "one": {**LINE, "length": "1 m"},
             "node": {"type": "capacity", "volume": "5 cm^3"}, "two": {**LINE, "length": "2.1 m"},
             "load": {"type": "flow_source", "flow": "-10 L/min"}}  # fmt: skip
    nets = {"a": ["source.port", "one.a"], "b": ["one.b", "node.port", "two.a"], "c": ["two.b", "load.port"]}
    point = steady(of(parts, nets))
    drop = 128 * NU * RHO_0 * 3.1 * 10 * LPM / (math.pi * 0.02**4)
    assert 20 * BAR - point.result["c.p"][0] == pytest.approx(drop, rel=1e-4)
    assert any("stability" in said for said in point.warnings), "told that it was not looked at"


# -- points that are not unique ------------------------------------------------------------------


def stored(volume: float, p: float) -> float:
    """V rho/rho_0 [m^3]."""
    return volume * math.exp(p / BETA)


def test_fluid_closed_in_is_kept():
    """Two volumes joined by a hole: V_a e^(p_a/beta) + V_b e^(p_b/beta) stays, to rounding, at one pressure."""
    parts = {"a": {"type": "capacity", "volume": "70 cm^3", "start": {"p": "300 bar"}},
             "b": {"type": "capacity", "volume": "30 cm^3"}, "hole": HOLE}  # fmt: skip
    point = steady(of(parts, {"one": ["a.port", "hole.a"], "two": ["b.port", "hole.b"]}))
    p = BETA * math.log((stored(70e-6, 300 * BAR) + stored(30e-6, 0.0)) / 100e-6)
    a, b = point.snapshot.x
    assert stored(70e-6, a) + stored(30e-6, b) == pytest.approx(stored(100e-6, p), rel=1e-14)
    assert [a, b] == pytest.approx([p, p], rel=1e-9)
    (said,) = point.warnings
    assert said.startswith("a, b: nothing flows in or out")


def test_fluid_closed_in_a_line_is_kept():
    """A volume, a line and a volume: V e^(p/beta) summed over volumes, cells and half cells, to rounding."""
    parts = {"a": {"type": "capacity", "volume": "100 cm^3", "start": {"p": "30 bar"}},
             "line": {**LINE, "length": "0.5 m", "start_pressure": "10 bar"},
             "b": {"type": "capacity", "volume": "50 cm^3"}}  # fmt: skip
    point = steady(of(parts, {"one": ["a.port", "line.a"], "two": ["line.b", "b.port"]}))
    bore = math.pi / 4 * 0.02**2 * 0.5
    before = stored(100e-6, 30 * BAR) + stored(bore, 10 * BAR) + stored(50e-6, 0.0)
    p = BETA * math.log(before / (150e-6 + bore))
    found = np.concatenate([point.snapshot.x[[0, 3]], np.ravel(point.result["line.p_node"])])
    assert found == pytest.approx(np.full(found.size, p), rel=1e-9)


def test_a_mass_without_a_spring_goes_as_far_as_its_damper_lets_it():
    """m v + B x is kept by m dv/dt = -B dx/dt: from 10 mm/s it comes m v/B = 1 mm; other places are at rest too."""
    mass = {"type": "mass_with_stops", "mass": "1 kg", "high": "10 mm", "start": {"x": "5 mm", "v": "10 mm/s"}}
    point = steady(circuit(components={"mass": mass, "damper": DAMPER}, nets={"rod": ["mass.port", "damper.rod"]}))
    assert point.result["mass.x"][0] == pytest.approx(6e-3, rel=1e-12)
    assert point.warnings[0].startswith("mass.x: other values are at rest too")
    assert point.time_constant == pytest.approx(0.1), "m/B"


def test_stuck_by_dry_friction_it_stays_where_it_is():
    """0.3 mm on 10 kN/m pull with 3 N, less than the 8 N of static friction."""
    mass = {"type": "stick_slip_mass", "mass": "1 kg", "coulomb_friction": "5 N", "static_friction": "8 N",
            "start": {"x": "0.3 mm"}}  # fmt: skip
    spring = {"type": "spring", "stiffness": "10000 N/m"}
    point = steady(circuit(components={"mass": mass, "spring": spring}, nets={"rod": ["mass.port", "spring.rod"]}))
    assert (point.result["mass.x"][0], point.resting) == (0.3e-3, ("mass.x", "mass.v"))


# -- stability -----------------------------------------------------------------------------------


class Bead(Component):
    """Bead on a rotating hoop, x'' = x (1 - x^2) - x' [1/s]: rests at 0 unstably, at 1 and -1 stably."""

    x = state(Length, "position", start=0.0, nominal=1.0)
    v = state(Velocity, "velocity", start=0.0, nominal=1.0)

    def equations(self, x, v):
        return {"der_x": v, "der_v": x * (1 - x * x) - v}


def test_an_unstable_point_is_told():
    """At 0: lambda^2 + lambda - 1 = 0, so e-fold in 2/(sqrt(5) - 1) = 1.618 s; at 1: real part -1/2."""
    parts = {"bead": {"type": "bead"}}
    unstable = steady(circuit(Bead, components=parts))
    assert unstable.time_constant is None, "what dies away in the other mode is no way back"
    assert "dies away" not in summary(unstable, None)
    (said,) = unstable.warnings
    assert said.startswith("the point is unstable: a disturbance of bead.")
    assert "1.62e+03 ms" in said
    stable = steady(circuit(Bead, components={"bead": {"type": "bead", "start": {"x": "1.2 m"}}}))
    assert stable.result["bead.x"][0] == pytest.approx(1.0, rel=1e-12)
    assert stable.warnings == ()
    assert stable.time_constant == pytest.approx(2.0)


def test_a_transient_leaves_an_unstable_point_as_it_was_told():
    """The relief valve without damping: from 1 nm off the point, swings grow e-fold in the time told, at its frequency.

    Extrema of e^(s t) cos(w t + c) follow each other every pi/w, each e^(s pi/w) times as large: a straight line in
    the logarithm; both to 1 %, what is told has three digits.
    """
    undamped = {"valve.damping": "0 N s/m"}
    point = steady(cl.load("relief_valve"), undamped)
    (said,) = point.warnings
    found = re.search(r"valve.spool.v grows e-fold in ([\d.]+) ms and swings at (\d+) Hz", said)
    assert found is not None
    x = point.snapshot.x + np.array([0.0, 1e-9, 0.0])
    run = cl.load("relief_valve").simulate(
        "20 ms", undamped, start=replace(point.snapshot, x=x), solver="rodas", rtol=1e-11, output_step="5 us"
    )
    away = run["valve.x"] - point.snapshot.x[1]
    peaks, _ = find_peaks(np.abs(away))
    growth = np.polyfit(run.time[peaks], np.log(np.abs(away[peaks])), 1)[0]
    assert 1e3 / growth == pytest.approx(float(found[1]), rel=0.01)
    assert 1 / (2 * np.diff(run.time[peaks]).mean()) == pytest.approx(float(found[2]), rel=0.01)


class Sampled(Component):
    """x' = u - x [1/s], u = gain (1 - x) set every 0.1 s: rests at gain/(1 + gain)."""

    gain: Ratio

    x = state(Ratio, "controlled")
    u = held(Ratio, "control")

    def equations(self, x, u):
        return {"der_x": u - x, "tick": every(0.1, u=self.gain * (1 - x))}


@pytest.mark.parametrize(("gain", "stable"), [(0.5, True), (19.0, True), (21.0, False)])
def test_a_sampled_loop_is_as_stable_as_its_map(gain, stable):
    """Over a tick (x, u) is multiplied by [[a, 1 - a], [-g a, -g (1 - a)]], a = e^-0.1.

    The multipliers are 0 and a - g (1 - a), so the loop swings up from g = (1 + a)/(1 - a) = 20.02 on; before, its
    slowest time constant is -0.1/ln|a - g (1 - a)|.
    """
    point = steady(circuit(Sampled, components={"loop": {"type": "sampled", "gain": str(gain)}}))
    assert point.result["loop.x"][0] == pytest.approx(gain / (1 + gain), rel=1e-12)
    assert any("unstable" in said for said in point.warnings) != stable
    if stable:
        a = math.exp(-0.1)
        assert point.time_constant == pytest.approx(-0.1 / math.log(abs(a - gain * (1 - a))), rel=1e-9)


# -- no operating point --------------------------------------------------------------------------


def test_a_turning_shaft_is_told():
    """The crescent pump has a periodic state only; at rest it has an operating point, all pressures 0."""
    pump = cl.load("crescent_pump")
    with pytest.raises(InputError, match=r"shaft\.phi turns at 2000 rpm.*delivery\.p.*crescentlab periodic"):
        steady(pump)
    still = steady(pump, {"speed": "0 rpm"})
    pressures = [float(np.abs(still.result[name]).max()) for name in still.result.net_pressures()]
    assert max(pressures) < 1e-4, "Pa"


def signal(kind: str, **values: str) -> Circuit:
    """A flow that a signal asks for, through a hole."""
    parts = {"signal": {"type": kind, **values}, "pump": {"type": "signal_flow_source"},
             "line": {"type": "capacity", "volume": "70 cm^3"}, "hole": HOLE, "tank": TANK}  # fmt: skip
    nets = {
        "wanted": ["signal.y", "pump.flow"],
        "p": ["pump.port", "line.port", "hole.a"],
        "t": ["hole.b", "tank.port"],
    }
    return of(parts, nets)


SINE = {"mean": "20 L/min", "amplitude": "5 L/min", "frequency": "50 Hz", "phase": "90 deg"}
RAMP = {"before": "20 L/min", "after": "5 L/min", "at": "10 ms", "duration": "10 ms"}


def test_a_source_in_time_is_told_even_at_its_crest():
    """At 90 deg the sine's own rate is 0; let stand still there, the flow is 25 L/min and a warning says so."""
    with pytest.raises(
        InputError, match=r"the time itself \(through signal\) changes the rate of line\.p; let the time"
    ):
        steady(signal("sine", **SINE))
    point = steady(signal("sine", **SINE), at="0 s")
    assert point.result["hole.q"][0] == pytest.approx(25 * LPM, rel=1e-9)
    assert "if the time stood still at 0 s" in point.warnings[0]


@pytest.mark.parametrize(("at", "flow", "warns"), [(None, 20, 0), ("5 ms", 20, 0), ("16 ms", 11, 1), ("20 ms", 5, 0)])
def test_a_ramp_is_at_rest_before_and_after(at, flow, warns):
    """20 L/min until 10 ms, 5 L/min from 20 ms; between, 1.5 L/min less each millisecond, with a warning."""
    point = steady(signal("ramp", **RAMP), at=at)
    assert point.result["hole.q"][0] == pytest.approx(flow * LPM, rel=1e-9)
    assert len(point.warnings) == warns


def bench(**values: str) -> Circuit:
    """Nothing stores fluid: a pressure that a signal asks for, through a hole."""
    parts = {"signal": {"output_quantity": "pressure", **values}, "source": {"type": "signal_pressure_source"},
             "hole": HOLE, "tank": TANK}  # fmt: skip
    nets = {"asked": ["signal.y", "source.pressure"], "p": ["source.port", "hole.a"], "t": ["hole.b", "tank.port"]}
    return of(parts, nets, outputs={"through": "= hole.q"})


RISE = {"type": "ramp", "before": "0 bar", "after": "10 bar", "at": "0 s", "duration": "1 s"}
SWING = {"type": "sine", "mean": "5 bar", "amplitude": "1 bar", "frequency": "50 Hz"}


@pytest.mark.parametrize(
    ("source", "at", "p", "warns"),
    [
        (RISE, None, 0, True), (RISE, "0.5 s", 5, True), (RISE, "1.5 s", 10, False),
        (SWING, None, 5, True), (SWING, "5 ms", 6, True),
        ({"type": "constant", "value": "3 bar"}, None, 3, False),
    ],
)  # fmt: skip
def test_without_states_a_signal_under_way_is_told(source, at, p, warns):
    """10 bar/s: 5 bar after half a second; 5 bar + 1 bar sin(100 pi t), whose own rate is 0 at its crest, 5 ms."""
    point = steady(bench(**source), at=at)
    assert point.result["p.p"][0] == pytest.approx(p * 1e5, abs=1e-6)
    assert len(point.warnings) == warns
    assert all("(through signal) changes signal.y" in warning for warning in point.warnings)


def test_the_time_is_that_of_the_start():
    """From the end of a run over the ramp, at 30 ms, the later flow counts."""
    run = signal("ramp", **RAMP)
    point = steady(run, start=run.simulate("30 ms"))
    assert point.snapshot.t == 0.03
    assert point.result["hole.q"][0] == pytest.approx(5 * LPM, rel=1e-9)


def test_what_resists_is_named():
    """30 L/min into a closed 70 cm^3: the state with its rate in bar/s, and the flow without a way out."""
    parts = {"pump": {"type": "flow_source", "flow": "30 L/min"}, "line": {"type": "capacity", "volume": "70 cm^3"}}
    closed = of(parts, {"p": ["pump.port", "line.port"]}, simulation={"stop": "10 ms"})
    with pytest.raises(SimulationError) as told:
        steady(closed)
    said = str(told.value)
    assert "what resists most: line.p (" in said
    assert "bar/s)" in said
    assert "the flow of 30 L/min into line has no way out" in said


def test_two_flows_that_contradict_each_other_are_named():
    """3 L/min in, 1 L/min out: 2 L/min too many for two volumes that a hole joins."""
    parts = {"feed": {"type": "flow_source", "flow": "3 L/min"}, "a": {"type": "capacity", "volume": "70 cm^3"},
             "hole": HOLE, "b": {"type": "capacity", "volume": "30 cm^3"},
             "drain": {"type": "flow_source", "flow": "-1 L/min"}}  # fmt: skip
    nets = {"one": ["feed.port", "a.port", "hole.a"], "two": ["drain.port", "b.port", "hole.b"]}
    with pytest.raises(SimulationError, match=r"the flow of 2 L/min into a, b has no way out"):
        steady(of(parts, nets, simulation={"stop": "10 ms"}))


def test_a_run_can_be_asked_for_flows_without_a_way_out():
    """The same words at any point of a run: nothing while the hole is open, both volumes once nothing leaves them."""
    parts = {"feed": {"type": "flow_source", "flow": "3 L/min"}, "a": {"type": "capacity", "volume": "70 cm^3"},
             "hole": HOLE, "b": {"type": "capacity", "volume": "30 cm^3"}}  # fmt: skip
    shut = {"one": ["feed.port", "a.port", "hole.a"], "two": ["b.port", "hole.b"]}

    def clauses(run: Circuit) -> list[str]:
        result = run.simulate("10 ms")
        at, system = result.trajectory.end, run.assembled(run.design())
        assert at is not None
        return closed_sets(system, result.values.p).without_way_out(at.t, at.x, at.h, at.b)

    assert clauses(of(parts, shut)) == ["the flow of 3 L/min into a, b has no way out"]
    assert clauses(throttled({"type": "flow_source", "flow": "3 L/min"})) == []


def test_absolute_zero_is_no_operating_point():
    """10 L/min sucked through 5 mm^2 want a drop of 9.8 bar below the tank's pressure: the transient says why not."""
    with pytest.raises(SimulationError, match=r"line\.p.*below absolute zero.*cavitate"):
        steady(throttled({"type": "flow_source", "flow": "-10 L/min"}, simulation={"stop": "10 ms"}))


class Relay(Component):
    """Heats until x > 1, cools until x < 0: never at rest."""

    x = state(Ratio, "temperature")
    on = held(Ratio, "1 heats", start=1.0)

    def equations(self, x, on):
        return {"der_x": 2 * on - 1, "off": when(x > 1, on=0.0), "again": when(x < 0, on=1.0)}


def test_a_relay_never_rests():
    """dx/dt is 1 or -1 [1/s]: told by name instead of searching for ever."""
    with pytest.raises(SimulationError, match=r"relay\.x \(-?1/s\)"):
        steady(circuit(Relay, components={"relay": {"type": "relay"}}, simulation={"stop": "1 s"}))


@pytest.mark.parametrize("tolerance", [0.0, 1.0, math.nan])
def test_a_tolerance_that_means_nothing_is_refused(tolerance):
    """It lies between 1e-13 and 1."""
    with pytest.raises(InputError, match="tolerance"):
        steady(throttled({"type": "flow_source", "flow": "30 L/min"}), tolerance=tolerance)


def test_a_circuit_without_states_is_at_rest():
    """A pressure, a hole and a tank: nothing to solve; the flow is that of the orifice equation."""
    parts = {"source": {"type": "pressure_source", "pressure": "30 bar"}, "hole": HOLE, "tank": TANK}
    point = steady(of(parts, {"a": ["source.port", "hole.a"], "b": ["hole.b", "tank.port"]}))
    assert point.result["hole.q"][0] == pytest.approx(hole_flow(30 * BAR, 0.0), rel=1e-12)
    assert (point.unknowns, point.residual) == (0, 0.0)


# -- many unknowns -------------------------------------------------------------------------------


def test_many_unknowns_take_the_sparse_path():
    """More equal holes in a row than full matrices are made for: the flow through each, by hand, is the pump's."""
    n = DENSE + 10
    parts: dict[str, Any] = {"pump": {"type": "flow_source", "flow": "30 L/min"}, "tank": TANK}
    nets: dict[str, list[str]] = {"p_0": ["pump.port"], f"p_{n}": ["tank.port"]}
    for k in range(n):
        parts |= {f"v_{k}": {"type": "capacity", "volume": "70 cm^3"}, f"o_{k}": {**HOLE, "area": "50 mm^2"}}
        nets[f"p_{k}"] = [*nets.get(f"p_{k}", []), f"v_{k}.port", f"o_{k}.a"]
        nets[f"p_{k + 1}"] = [*nets.get(f"p_{k + 1}", []), f"o_{k}.b"]
    point = steady(of(parts, nets))
    p = np.append(point.snapshot.x, 0.0)
    flows = [hole_flow(a, b, 50e-6) for a, b in itertools.pairwise(p)]
    assert flows == pytest.approx(np.full(n, 30 * LPM), rel=1e-6)


# -- the command ---------------------------------------------------------------------------------


def run(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    """Exit code, stdout, stderr."""
    code = main(["steady", *arguments])
    return code, *capsys.readouterr()


def test_the_summary_and_the_file(tmp_path, capsys, monkeypatch):
    """Outputs and net pressures in display units; the file holds one row and starts a run and another search."""
    monkeypatch.chdir(tmp_path)
    code, out, err = run(capsys, "relief_valve")
    assert (code, err) == (0, "")
    rows = {line.split()[0]: line.split()[1:] for line in out.splitlines() if line.split()}
    point = steady(cl.load("relief_valve"))
    assert rows["p_line.p"] == ["bar", f"{point.result['p_line.p'][0] / 1e5:.5g}"]
    assert rows["method"][0] == "continuation:"
    assert Path("relief_valve_steady.nc").is_file()
    assert main(["simulate", "relief_valve", "--start", "relief_valve_steady.nc", "--stop", "1 ms", "-o", "none"]) == 0
    capsys.readouterr()
    code, out, _ = run(capsys, "relief_valve", "--start", "relief_valve_steady.nc", "-o", "none", "--json")
    assert (code, json.loads(out)["method"]) == (0, "newton")


def test_the_summary_shows_outputs():
    """As `simulate` does, flows too, by the name that the circuit gives them: Cd A sqrt(2 dp/rho) at 3 bar."""
    lines = summary(steady(bench(type="constant", value="3 bar")), None).splitlines()
    rows = {line.split()[0]: line.split()[1:] for line in lines if line.split()}
    assert rows["through"][0] == "L/min"
    assert float(rows["through"][1]) == pytest.approx(hole_flow(3e5, 0) / LPM, rel=1e-4)


def test_json_holds_values_in_si(tmp_path, capsys, monkeypatch):
    """On success and on failure, without NaN."""
    monkeypatch.chdir(tmp_path)
    code, out, _ = run(capsys, "relief_valve", "--json", "-o", "none", "--set", "supply=48 L/min")
    found = json.loads(out)
    assert (code, found["status"], found["file"], found["error"]) == (0, "done", None, None)
    p = found["values"]["p_line.p"]
    assert p["unit"] == "Pa"
    assert p["value"] == pytest.approx(9.03e5, rel=1e-2)
    assert found["residual"] < 1e-9
    code, out, err = run(capsys, "relief_valve", "--json", "-o", "none", "--set", "valve.max_lift=0.001 mm")
    found = json.loads(out)
    assert (code, found["status"]) == (3, "failed")
    assert found["error"] == err.strip()


def test_wrong_input_is_one_sentence(tmp_path, capsys, monkeypatch):
    """Exit code 2, nothing on stdout, no file."""
    monkeypatch.chdir(tmp_path)
    for arguments in (
        ("crescent_pump",), ("relief_valve", "--tolerance", "2"), ("relief_valve", "--at", "5 bar"),
        ("relief_valve", "--at=-1"), ("relief_valve", "--start", "missing.nc"), ("relief_valve", "-o", "point.txt"),
        ("relief_valv",),
    ):  # fmt: skip
        code, out, err = run(capsys, *arguments)
        assert (code, out) == (2, ""), arguments
        assert err.count("\n") == 1, err
        assert "-1 ms" not in err
    assert list(tmp_path.iterdir()) == []
