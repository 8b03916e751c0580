"""A run held against the same at a tenth of its tolerance: what the estimate says where the true error is known."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from building import alone, circuit

import crescentlab as cl
from crescentlab.cli import main
from crescentlab.component import Component
from crescentlab.domain import held, observable, state
from crescentlab.maths import cos, event_where, sin, when
from crescentlab.units import Ratio

SOLVERS = ["auto", "lsoda", "bdf", "radau", "rk45", "dop853", "cvode", "rodas", "dopri"]


@pytest.mark.parametrize("solver", SOLVERS)
def test_the_estimate_is_the_error(solver: str) -> None:
    """10 mm on 400 N/m and 1 kg, x = 10 mm cos 20 t.

    Local errors go with the tolerance, so a tenth of it leaves about a tenth of the error, and the difference is nine
    tenths of it or, where errors of two signs meet, a little more. CVODE changes its order with the tolerance, so
    that its error falls by less: a fifth to twice the true error says its size.
    """
    parts = {
        "mass": {"type": "mass_with_stops", "mass": "1 kg", "low": "-1 m", "high": "1 m", "start": {"x": "10 mm"}},
        "spring": {"type": "spring", "stiffness": "400 N/m"},
    }
    run = circuit(components=parts, nets={"rod": ["mass.port", "spring.rod"]})
    result = run.simulate(10 * math.pi / 20, solver=solver, rtol=1e-5, verify=True)
    found = result.verification
    assert found is not None
    assert found.agrees
    assert not result.warnings
    error = np.abs(result["mass.x"] - 0.01 * np.cos(20 * result.time)).max()
    (position,) = [output for output in found.outputs if output.name == "mass.x"]
    assert 0.2 * error < position.difference < 2 * error
    assert position.share == pytest.approx(position.difference / 0.02, rel=0.01)  # no step ends on a peak


class Ridge(Component):
    """x' = 30 (x - sin t) + cos t, whose solution from 0 is sin t, and from which errors grow as exp(30 t)."""

    x = state(Ratio, "position", start=0.0, nominal=1.0)

    def equations(self, t, x):
        return {"der_x": 30 * (x - sin(t)) + cos(t)}


@pytest.mark.parametrize("solver", SOLVERS)
def test_what_no_run_resolves_is_told(solver: str) -> None:
    """After 1 s an error of 1e-7 has grown by exp(30) = 1e13: no tolerance of floats holds it."""
    result = alone(Ridge).simulate(1.0, solver=solver, verify=True)
    (warning,) = result.warnings
    assert warning.startswith("NOT VERIFIED: the runs at rtol 1e-06 and 1e-07 do not agree: part.x differs by ")
    calm = alone(Ridge).simulate(0.01, solver=solver, verify=True)
    assert not calm.warnings


class Threshold(Component):
    """Height x' = 1 - 2 t, which just reaches 1/4; an event counts where it exceeds ``level``; y jumps there."""

    level: Ratio = 0.2
    x = state(Ratio, "height", start=0.0, nominal=1.0)
    crossed = held(Ratio, "crossings", start=0.0)
    y = observable(Ratio, "1 above the level")

    def equations(self, t, x, crossed):
        above = x > self.level
        return {"der_x": 1 - 2 * t, "y": event_where(above, 1.0, 0.0), "crosses": when(above, crossed=crossed + 1)}


def test_a_jump_at_another_instant_is_no_difference() -> None:
    """The level is met at t = (1 - sqrt(1 - 4/5))/2 and left later, in both runs within their tolerance."""
    result = alone(Threshold).simulate(1.0, solver="bdf", rtol=1e-5, verify=True)
    found = result.verification
    assert found is not None
    assert found.agrees
    assert result["part.crossed"][-1] == 1


def test_an_event_that_one_run_has_is_told() -> None:
    """The end differs in what happened: a count of 5 against 4, and when."""
    from crescentlab.solvers.trajectory import Happening
    from crescentlab.verification import verification

    first, second = (alone(Threshold).simulate(1.0) for _ in range(2))
    second.trajectory.happenings.append(Happening(0.5, ("part.crosses",)))
    found = verification(first, second, 1e-6, 1e-7)
    assert not found.agrees
    assert "part.crosses happens 1 and 2 times, from 500 ms on" in found.warnings[0]


UNDETERMINED = """
crescentlab: 1
fluid:
  {type: aerated_oil, density: 860 kg/m^3, kinematic_viscosity: 35 cSt, bulk_modulus: 14000 bar, air_fraction: 0.5 %,
   saturation_pressure: 1000 bar}
components:
  v0: {type: capacity, volume: 165.6 cm^3, start: {p: 39.47 bar}}
  v1: {type: single_acting_cylinder, piston_diameter: 30.69 mm, stroke: 238.2 mm, dead_volume: 39.34 cm^3,
       preload: 1459 N, spring_stiffness: 28.72 N/mm, viscous_friction: 1050 N s/m}
  m1: {type: mass, mass: 6.397 kg, start: {x: 2 mm}}
  tank: {type: pressure_source, pressure: 40 bar}
  e0: {type: check_valve, area: 16.81 mm^2, cracking_pressure: 1.87 bar, opening_range: 1.4 bar}
  e1: {type: distributed_line, length: 0.226 m, diameter: 9.41 mm, cells: 4}
  s0g: {type: sine, output_quantity: flow, mean: 33.4 L/min, amplitude: 13.2 L/min, frequency: 37.4 Hz}
  s0: {type: signal_flow_source}
nets:
  p0: [v0.port, e0.a, e1.b, s0.port]
  x1: [v1.rod, m1.port]
  p1: [v1.cap, e1.a]
  tk: [tank.port, e0.b]
  g0: [s0g.y, s0.flow]
simulation: {stop: 20 ms, solver: rodas}
"""
"""A line that starts without pressure between a filled volume and a cylinder, of aerated oil: its cells cavitate and
close again and again, and each closing makes small differences large."""


def test_a_circuit_that_converges_in_no_method(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The exit code is that of the run: it went through; the warning and `verify` say that its end is open."""
    path = tmp_path / "undetermined.yaml"
    path.write_text(UNDETERMINED, encoding="utf-8")
    assert main(["simulate", str(path), "--verify", "--json", "-o", "none"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["verify"]["agrees"] is False
    assert found["verify"]["outputs"][0]["share"] > 0.1
    assert found["warnings"][-1].startswith("NOT VERIFIED")


def test_the_summary_has_units(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", "relief_valve", "--verify", "-o", "none"]) == 0
    told = capsys.readouterr().out
    assert "verified at rtol 1e-07 against 1e-06: they agree" in told
    (row,) = [line for line in told.splitlines() if line.strip().startswith("loss") and "e-" in line]
    assert row.split()[2] == "W"
    assert row.split()[-1] == "ms"


def test_the_shipped_pump_is_determined() -> None:
    """Its leakages jump as relations turn without an event; that the turns lie apart by 1e-9 s is no difference."""
    result = cl.load("crescent_pump").simulate("20 ms", solver="rodas", verify=True)
    assert result.verification is not None
    assert result.verification.agrees
