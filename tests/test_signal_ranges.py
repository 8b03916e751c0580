"""Signals beyond the range of what takes them: held within it, and told, whatever integrates."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from building import OIL as OIL_TEXT
from building import circuit
from crescentlab.components.directional_valves import (
    FourThreeValve,
    FourTwoValve,
    SpoolDrive,
    ThreeTwoValve,
    TwoTwoValve,
)
from crescentlab.components.displacement_machines import VariableDisplacementMotor, VariableDisplacementPump
from crescentlab.components.fluids import SimpleOil
from crescentlab.components.gaps import VariableWidthGap
from crescentlab.components.orifices import VariableOrifice
from crescentlab.components.proportional_valves import ProportionalReliefValve
from crescentlab.components.rotary_stick_slip import FrictionBrake
from crescentlab.components.valve_plates import VariableSwashPlateBarrel

from crescentlab.analysis.linear import linearize
from crescentlab.analysis.steady import steady
from crescentlab.circuit import SOLVERS, Circuit
from crescentlab.cli import main
from crescentlab.commands.components import port_row
from crescentlab.component import Component, Equations
from crescentlab.domain import gives_signal, takes_signal
from crescentlab.errors import InputError
from crescentlab.library import installed
from crescentlab.maths import Expr
from crescentlab.symbols import Sym
from crescentlab.units import Pressure, Ratio

BAR, LPM = 1e5, 1e-3 / 60
OIL = SimpleOil(density=860.0, kinematic_viscosity=35e-6, bulk_modulus=1.4e9)

RANGES: dict[type[Component], dict[str, tuple[float | None, float | None]]] = {
    VariableOrifice: {"opening": (0, 1)},
    VariableWidthGap: {"opening": (0, 1)},
    SpoolDrive: {"command": (-1, 1)},
    TwoTwoValve: {"stroke": (0, 1)},
    ThreeTwoValve: {"stroke": (0, 1)},
    FourTwoValve: {"stroke": (0, 1)},
    FourThreeValve: {"stroke": (-1, 1)},
    VariableDisplacementPump: {"setting": (-1, 1)},
    VariableDisplacementMotor: {"setting": (-1, 1)},
    VariableSwashPlateBarrel: {"setting": (-1, 1)},
    ProportionalReliefValve: {"setting": (0, None)},
    FrictionBrake: {"application": (0, None)},
}


def test_the_library_declares_these_ranges() -> None:
    """Openings and switching strokes 0 to 1, what goes both ways -1 to 1, what only has a sense from 0 on."""
    found = {
        cls: {p.name: (p.low, p.high) for p in cls.ports() if p.ranged}
        for cls in installed().components.values()
        if any(p.ranged for p in cls.ports())
    }
    assert found == RANGES


def test_every_share_that_is_taken_has_a_range() -> None:
    """A signal called opening, stroke, setting, command or application, and carrying a ratio, says its range."""
    names = {"opening", "stroke", "setting", "command", "application"}
    for cls in installed().components.values():
        for port in cls.ports():
            if port.domain.name == "signal" and port.role == "takes" and port.name in names:
                assert port.ranged, f"{cls.__name__}.{port.name}"


POINTS: dict[type[Component], tuple[Component, dict[str, Any]]] = {
    VariableOrifice: (VariableOrifice(area=10e-6), {"p_a": 100 * BAR, "p_b": 0.0}),
    VariableWidthGap: (VariableWidthGap(width=1e-2, height=1e-4, length=1e-2), {"p_a": 100 * BAR, "p_b": 0.0}),
    TwoTwoValve: (TwoTwoValve(area=10e-6), {"p_a": 100 * BAR, "p_b": 0.0}),
    ThreeTwoValve: (ThreeTwoValve(area=10e-6), {"p_supply": 100 * BAR, "p_work": 40 * BAR, "p_tank": 0.0}),
    FourTwoValve: (
        FourTwoValve(area=10e-6), {"p_supply": 100 * BAR, "p_a": 40 * BAR, "p_b": 20 * BAR, "p_tank": 0.0},
    ),
    FourThreeValve: (
        FourThreeValve(area=10e-6), {"p_supply": 100 * BAR, "p_a": 40 * BAR, "p_b": 20 * BAR, "p_tank": 0.0},
    ),
    VariableDisplacementPump: (
        VariableDisplacementPump(displacement=1e-5), {"p_inlet": 0.0, "p_outlet": 100 * BAR, "omega_shaft": 100.0},
    ),
    VariableDisplacementMotor: (
        VariableDisplacementMotor(displacement=1e-5), {"p_inlet": 100 * BAR, "p_outlet": 0.0, "omega_shaft": 100.0},
    ),
}  # fmt: skip


@pytest.mark.parametrize("cls", POINTS, ids=lambda cls: cls.__name__)
def test_beyond_its_range_a_part_is_at_the_end_of_it(cls: type[Component]) -> None:
    """On plain floats, number for number; within the range it is not there."""
    part, there = POINTS[cls]
    ((name, (low, high)),) = RANGES[cls].items()

    def at(value: float) -> Any:
        return part.equations(**there, **{name: value}, fluid=OIL)

    assert low is not None
    assert high is not None
    assert at(50.0) == at(1.001) == at(high)
    assert at(-50.0) == at(low - 0.001) == at(low)
    assert at(0.5) != at(high)


class Dimmed(Component):
    """Gives on what it takes, y = u; u [-], y [-]. Not for lamps. Source: definition."""

    u = takes_signal(Ratio, "input", size=2, low=-0.5, high=2)
    y = gives_signal(Ratio, "output", size=2)

    def equations(self, u: Expr) -> Equations:
        return {"y": 3 * u}


class Brighter(Dimmed):
    """The same, y = 4 u. Not for lamps. Source: definition."""

    def equations(self, u: Expr) -> Equations:
        return {"y": 4 * u}


class Free(Dimmed):
    """The same with a wider range, y = 3 u. Not for lamps. Source: definition."""

    u = takes_signal(Ratio, "input", size=2, low=-10)


def test_own_parts_vectors_and_subclasses() -> None:
    """Elements are held one by one; a subclass keeps the range, or has its own; places count as names do."""
    u = np.array([-3.0, 5.0])
    assert list(Dimmed().equations(u=u)["y"]) == [-1.5, 6.0]
    assert list(Dimmed().equations(u)["y"]) == [-1.5, 6.0]
    assert list(Brighter().equations(u=u)["y"]) == [-2.0, 8.0]
    assert list(Free().equations(u=u)["y"]) == [-9.0, 15.0]
    symbol = ca.SX.sym("u", 2)
    y = ca.Function("y", [symbol], [Dimmed().equations(u=Sym(symbol, (2,)))["y"].sx])
    assert np.array(y(u)).ravel().tolist() == [-1.5, 6.0]
    slope = ca.Function("slope", [symbol], [ca.jacobian(y(symbol), symbol)])
    for inside in (0.0, -0.5, 2.0):  # at its ends too
        assert np.array(slope([inside, inside])).diagonal().tolist() == [3.0, 3.0]
    assert np.array(slope(u)).diagonal().tolist() == [0.0, 0.0]


# --- runs -------------------------------------------------------------------------------------------------------------


def bench(signal: dict[str, Any], **simulation: str) -> Circuit:
    """100 bar over a variable orifice of 10 mm^2 into a volume and a hole, so that there is something to integrate."""
    parts = {
        "source": {"type": "pressure_source", "pressure": "100 bar"}, "tank": {"type": "tank"},
        "o": {"type": "variable_orifice", "area": "10 mm^2"}, "s": signal,
        "v": {"type": "capacity", "volume": "100 cm^3"}, "hole": {"type": "orifice", "area": "2 mm^2"},
    }  # fmt: skip
    nets = {
        "a": ["source.port", "o.a"], "b": ["o.b", "v.port", "hole.a"], "t": ["hole.b", "tank.port"],
        "u": ["s.y", "o.opening"],
    }  # fmt: skip
    return circuit(components=parts, nets=nets, fluid=OIL_TEXT, simulation={"stop": "20 ms", **simulation})


@pytest.mark.parametrize("solver", SOLVERS)
def test_per_cent_for_a_share(solver: str) -> None:
    """50 is the fully open orifice, and one warning says so."""
    run = bench({"type": "constant", "value": "50"}).simulate(solver=solver)
    full = bench({"type": "constant", "value": "1"}).simulate(solver=solver)
    assert run["v.p"][-1] == full["v.p"][-1]
    assert run["o.opening"][-1] == 50.0
    said = "o.opening went to 50 (at 0 s) and was clamped to 0..1; write 0.5 for 50 %"
    assert run.trajectory.warnings == [said]
    assert full.trajectory.warnings == []


def test_the_furthest_value_and_its_time() -> None:
    """0.5 + 0.7 sin(wt) over its upper half-wave, and over its lower one: 1.2 and -0.2, after a quarter of a period.

    Steps of 0.1 ms see the peak within 1 - cos(w 0.05 ms), 1e-4 of it, and within half a step.
    """
    for phase, furthest in (("0 deg", 1.2), ("180 deg", -0.2)):
        sine = {"type": "sine", "mean": "0.5", "amplitude": "0.7", "frequency": "50 Hz", "phase": phase}
        run = bench(sine).simulate(stop="10 ms", max_step="0.1 ms")
        (said,) = run.trajectory.warnings
        found = re.fullmatch(r"o.opening went to (\S+) \(at (\S+) s\) and was clamped to 0\.\.1", said)
        assert found
        assert float(found[1]) == pytest.approx(furthest, abs=2e-4)
        assert float(found[2]) == pytest.approx(5e-3, abs=0.06e-3)


def test_a_thousandth_is_not_told() -> None:
    """Overshoot of a filter or rounding: within 0.001 of the range nothing is said."""
    for value, told in (("1.0009", 0), ("-0.0009", 0), ("1.0011", 1), ("-0.0011", 1), ("0.3", 0)):
        run = bench({"type": "constant", "value": value}).simulate()
        assert len(run.trajectory.warnings) == told, value


def test_a_clamped_signal_changes_no_events() -> None:
    """A sine that leaves the range twice a period is clamped without an event; the pressure is that behind a `limiter`,
    whose limits are events. 1e-6: a hundred times the tolerance of the runs."""
    sine = {"type": "sine", "mean": "0.5", "amplitude": "0.7", "frequency": "200 Hz"}
    run = bench(sine).simulate(rtol=1e-8, solver="rodas")
    assert run.trajectory.happenings == []
    limited = circuit(
        components={
            "source": {"type": "pressure_source", "pressure": "100 bar"}, "tank": {"type": "tank"},
            "o": {"type": "variable_orifice", "area": "10 mm^2"}, "s": sine,
            "limit": {"type": "limiter", "low": "0", "high": "1"},
            "v": {"type": "capacity", "volume": "100 cm^3"}, "hole": {"type": "orifice", "area": "2 mm^2"},
        },
        nets={
            "a": ["source.port", "o.a"], "b": ["o.b", "v.port", "hole.a"], "t": ["hole.b", "tank.port"],
            "w": ["s.y", "limit.u"], "u": ["limit.y", "o.opening"],
        },
        fluid=OIL_TEXT, simulation={"stop": "20 ms"},
    ).simulate(rtol=1e-8, solver="rodas")  # fmt: skip
    assert run["v.p"][-1] == pytest.approx(limited["v.p"][-1], rel=1e-6)
    assert limited.trajectory.warnings == []


def test_pressures_and_one_sided_ranges() -> None:
    """A setting below 0 bar is counted as 0, and told in bar, if by more than 100 Pa."""
    for setting, told in (("-3 bar", True), ("-0.0005 bar", False), ("50 bar", False)):
        parts = {
            "source": {"type": "pressure_source", "pressure": "10 bar"}, "tank": {"type": "tank"},
            "s": {"type": "constant", "value": setting},
            "valve": {"type": "proportional_relief_valve", "area": "10 mm^2", "opening_range": "20 bar"},
        }  # fmt: skip
        nets = {"a": ["source.port", "valve.a"], "t": ["valve.b", "tank.port"], "u": ["s.y", "valve.setting"]}
        run = circuit(components=parts, nets=nets, fluid=OIL_TEXT, simulation={"stop": "100 ms"}).simulate()
        said = ["valve.setting went to -3 bar (at 0 s) and was clamped to at least 0 bar"] if told else []
        assert run.trajectory.warnings == said
        if setting != "50 bar":
            assert run["valve.lift"][-1] == pytest.approx(0.5, rel=1e-4)


def test_steady_and_linear() -> None:
    """An operating point of a clamped signal warns as well; beyond the range it acts on nothing, at its end it does."""
    point = steady(bench({"type": "constant", "value": "50"}))
    assert any("o.opening went to 50" in said for said in point.warnings)
    for value in ("1", "0.5"):
        model = linearize(bench({"type": "constant", "value": value}), inputs=["s.value"], outputs=["v.p"])
        assert np.all(model.B != 0)
    with pytest.raises(InputError, match=r"input s\.value does not act on v\.p"):
        linearize(bench({"type": "constant", "value": "50"}), inputs=["s.value"], outputs=["v.p"])


def test_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The bench of a newcomer: C_d A sqrt(2 dp/rho) of the whole area, 63.9 L/min, and the warning, in both outputs."""
    file = tmp_path / "opening.yaml"
    file.write_text(
        "crescentlab: 1\ntitle: Bench\n"
        "fluid: {type: simple_oil, density: 860 kg/m^3, kinematic_viscosity: 35 cSt, bulk_modulus: 14000 bar}\n"
        "components:\n  s: {type: pressure_source, pressure: 100 bar}\n  o: {type: variable_orifice, area: 10 mm^2}\n"
        "  c: {type: constant, value: 50}\n  t: {type: tank}\n"
        "nets: {a: [s.port, o.a], b: [o.b, t.port], u: [c.y, o.opening]}\n"
        "simulation: {stop: 10 ms}\noutputs: {q: = o.q}\n"
    )
    assert main(["simulate", str(file), "-o", "none", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["warnings"] == ["o.opening went to 50 (at 0 s) and was clamped to 0..1; write 0.5 for 50 %"]
    flow = 0.7 * 10e-6 * math.sqrt(2 * 100 * BAR / 860)
    assert flow / LPM == pytest.approx(64.05, abs=0.005)  # 63.9 or 64.2 with the oil's density at 50 bar in it
    assert main(["simulate", str(file), "-o", "none"]) == 0
    assert "warning: o.opening went to 50" in capsys.readouterr().out


def test_ranges_are_shown(capsys: pytest.CaptureFixture[str]) -> None:
    """In `crescentlab components`, on the pages (the same rows), and in the schema for editors."""
    assert main(["components", "variable_orifice"]) == 0
    assert "signal, ratio, 0 to 1" in capsys.readouterr().out
    assert port_row(FourThreeValve.port_named("stroke"))[2] == "signal, ratio, -1 to 1"
    assert port_row(FrictionBrake.port_named("application"))[2] == "signal, ratio, from 0 on"
    assert main(["schema"]) == 0
    schema = json.loads(capsys.readouterr().out)
    then = [
        rule["then"]["properties"]["type"]
        for rule in schema["$defs"]["ComponentSection"]["allOf"]
        if rule["if"]["properties"]["type"]["const"] == "variable_orifice"
    ]
    assert then == [{"const": "variable_orifice", "description": "signals are held within: opening 0 to 1"}]


class Sure(Component):
    """Takes a pressure within 2 to 5 bar, y = u; u [Pa], y [Pa]. Not for others. Source: definition."""

    u = takes_signal(Pressure, "input", low=2e5, high=5e5)
    y = gives_signal(Pressure, "output")

    def equations(self, u: Expr) -> Equations:
        return {"y": u}


def test_units_of_a_range_in_si() -> None:
    """Declared in SI, told in the unit in which the quantity is shown; no word of per cent."""
    made = circuit(
        Sure, components={"s": {"type": "constant", "value": "7 bar"}, "part": {"type": "sure"}},
        nets={"u": ["s.y", "part.u"]}, simulation={"stop": "1 ms"},
    )  # fmt: skip
    run = made.simulate()
    assert run["part.y"][-1] == 5e5
    assert run.trajectory.warnings == ["part.u went to 7 bar (at 0 s) and was clamped to 2 bar..5 bar"]
