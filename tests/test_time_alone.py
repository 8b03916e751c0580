"""Conditions on time alone in formulas: no pulse is stepped over, whatever its form; jumping rules are named."""

from __future__ import annotations

import math

import pytest
from building import OIL, circuit

from crescentlab.circuit import Circuit
from crescentlab.component import Component, Equations
from crescentlab.domain import takes_pressure
from crescentlab.maths import Expr, sign, where

SOLVERS = ["auto", "bdf", "rodas", "dopri"]


def filled(formula: str, stop: str) -> Circuit:
    """A volume of 50 L that a flow written as a formula of time fills from 0 bar."""
    parts = {
        "asked": {"type": "expression", "formula": formula, "inputs": [], "output_quantity": "flow"},
        "pump": {"type": "signal_flow_source"},
        "line": {"type": "capacity", "volume": "50 L"},
    }
    nets = {"s": ["asked.y", "pump.flow"], "p": ["pump.port", "line.port"]}
    return circuit(components=parts, nets=nets, fluid=OIL, simulation={"stop": stop})


def volume(circuit: Circuit, solver: str) -> float:
    """What has flowed in [m3 at 0 bar]: V (exp(p/beta) - 1), by conservation of mass in a fluid of constant modulus."""
    return 50e-3 * math.expm1(circuit.simulate(solver=solver)["line.p"][-1] / 14000e5)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("share", [1e-7, 1 / 2000, 1 / 200, 1 / 60])
def test_no_window_of_time_is_stepped_over(share: float, solver: str) -> None:
    """60 L/min during a share of 1000 s: what flowed in is 1 L/s times the window; the tolerance is the solvers'."""
    window = 1000 * share
    formula = f"where(t > 700 s, where(t < {700 + window!r} s, 60 L/min, 0 L/min), 0 L/min)"
    assert volume(filled(formula, "1000 s"), solver) == pytest.approx(1e-3 * window, rel=1e-5)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize(
    ("formula", "litres"),
    [
        ("where(sin(2 * pi * 5 * t / (1 s)) > 0, 60 L/min, 0 L/min)", 10.0),
        ("where(t / (1 s) * 5 - floor(t / (1 s) * 5) < 0.25, 60 L/min, 0 L/min)", 5.0),
        ("60 L/min * (t / (1 s) * 2.5 - floor(t / (1 s) * 2.5))", 10.0),
        ("60 L/min * ceil(sin(2 * pi * 0.1 * t / (1 s)))", 10.0),
        ("min(60 L/min, max(0 L/min, 60 L/min * (1 - abs(t - 7.77 s) / (1 ms))))", 0.001),
        ("max(0 L/min, 60 L/min * sin(2 * pi * 0.5 * t / (1 s)))", 20 / math.pi),
    ],
    ids=["square wave", "pulse train", "saw tooth", "whole numbers", "narrow triangle", "half waves"],
)
def test_waves_written_as_formulas(formula: str, litres: float, solver: str) -> None:
    """Means of the waves over whole periods of 20 s, by hand; a jump costs no accuracy, for no step passes it."""
    assert volume(filled(formula, "20 s"), solver) == pytest.approx(1e-3 * litres, rel=1e-4)


def test_a_fast_wave_is_scanned_as_finely_as_it_swings() -> None:
    """A thousand periods in a run, two stops each: as many restarts as jumps, none of them missed."""
    result = filled("where(sin(2 * pi * 50 * t / (1 s)) > 0, 60 L/min, 0 L/min)", "20 s").simulate(solver="rodas")
    assert result.trajectory.statistics.restarts == 1999


@pytest.mark.parametrize("solver", ["auto", "bdf", "radau", "rk45", "cvode", "rodas", "dopri"])
def test_a_rule_without_hysteresis_in_a_formula_is_named_at_its_boundary(solver: str) -> None:
    """A pump kept at 100 bar by an on-off rule: at dp/dt = beta (q - q_out)/V it is there after 3.134 ms, and stays."""
    parts = {
        "gauge": {"type": "pressure_sensor"},
        "rule": {"type": "expression", "formula": "where(u1 > 100 bar, 0 L/min, 20 L/min)", "inputs": ["pressure"],
                 "output_quantity": "flow"},
        "pump": {"type": "signal_flow_source"},
        "line": {"type": "capacity", "volume": "1 L", "start": {"p": "90 bar"}},
        "load": {"type": "orifice", "area": "1 mm2"},
        "tank": {"type": "tank"},
    }  # fmt: skip
    nets = {
        "m": ["gauge.y", "rule.u1"], "s": ["rule.y", "pump.flow"],
        "p": ["pump.port", "line.port", "load.a", "gauge.port"], "t": ["load.b", "tank.port"],
    }  # fmt: skip
    result = circuit(components=parts, nets=nets, fluid=OIL).simulate(1.0, solver=solver, check=False)
    assert "both sides push towards the boundary of rule: u1 > " in result.trajectory.error
    assert result.time[-1] == pytest.approx(3.134e-3, rel=2e-3)
    assert result.trajectory.statistics.steps < 100


class RuledPump(Component):
    """20 L/min below 100 bar, nothing above, written with a choice that makes no event."""

    port = takes_pressure("line")

    def equations(self, p_port: Expr) -> Equations:
        return {"q_port": where(p_port > 1e7, 0.0, -20 / 60000)}


class SignedPump(RuledPump):
    """The same written with a sign."""

    def equations(self, p_port: Expr) -> Equations:
        return {"q_port": -20 / 60000 * (1 - sign(p_port - 1e7)) / 2}


@pytest.mark.parametrize("solver", ["auto", "lsoda", "bdf", "radau", "rk45", "dop853", "cvode", "rodas", "dopri"])
@pytest.mark.parametrize("cls", [RuledPump, SignedPump])
def test_a_choice_of_a_class_that_jumps_is_named_after_some_steps(cls: type[Component], solver: str) -> None:
    """It used to creep through millions of steps, or to advise another solver."""
    parts = {
        "rule": {"type": cls.type_name()},
        "line": {"type": "capacity", "volume": "1 L", "start": {"p": "90 bar"}},
        "load": {"type": "orifice", "area": "1 mm2"},
        "tank": {"type": "tank"},
    }
    nets = {"p": ["rule.port", "line.port", "load.a"], "t": ["load.b", "tank.port"]}
    result = circuit(cls, components=parts, nets=nets, fluid=OIL).simulate(1.0, solver=solver, check=False)
    assert result.trajectory.status == "failed"
    assert "both sides push towards the boundary of rule" in result.trajectory.error
    assert "let them meet, or give it hysteresis" in result.trajectory.error
    assert result.trajectory.statistics.steps <= 16_000
