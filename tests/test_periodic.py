"""Periodic steady states against closed forms and against long transients; what the acceleration saves."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from building import alone
from pydantic import Field

import crescentlab as cl
from crescentlab.analysis.outcome import Outcome, Window
from crescentlab.analysis.periodic import periodic, whole_ticks
from crescentlab.analysis.periodic.anderson import Anderson
from crescentlab.cli import main
from crescentlab.component import Component, Equations
from crescentlab.domain import held, state
from crescentlab.errors import InputError
from crescentlab.maths import Expr, event_where, every, pi, sin, when
from crescentlab.units import Angle, Frequency, Pressure, Ratio, Time


class Lag(Component):
    """First-order lag behind a sine."""

    lag: Time = Field(description="time constant")
    frequency: Frequency = Field(description="of the sine")
    size: Pressure = Field(description="of the sine")
    y = state(Pressure, "its answer", nominal=1e5)

    def equations(self, y: Expr, t: Expr) -> Equations:
        return {"der_y": (self.size * (1 + sin(2 * pi * self.frequency * t)) - y) / self.lag}


class Sampled(Component):
    """A sampled lag behind a turning angle: y+ = y + share (sin(phi) - y) at every tick."""

    sample: Time = Field(description="period of the ticks")
    share: Ratio = Field(description="part of the way at each tick")
    frequency: Frequency = Field(description="of the turning")
    phi = state(Angle, "angle", counts=True)
    y = held(Ratio, "the answer")

    def equations(self, phi: Expr, y: Expr) -> Equations:
        return {
            "der_phi": 2 * pi * self.frequency,
            "tick": every(self.sample, y=y + self.share * (sin(phi) - y)),
        }


class Hopper(Component):
    """A volume filled at a constant rate and emptied by a fixed share each time the shaft has turned once."""

    frequency: Frequency = Field(description="turns per time")
    keep: Ratio = Field(description="part that an emptying leaves")
    phi = state(Angle, "angle", counts=True)
    turn = held(Angle, "angle at which the turn began", counts=True)
    level = state(Ratio, "filling", nominal=1.0)

    def equations(self, phi: Expr, turn: Expr, level: Expr) -> Equations:
        half = event_where(phi - turn < pi, 1.0, 0.0)
        return {
            "der_phi": 2 * pi * self.frequency,
            "der_level": self.frequency * 2 * half,
            "empties": when(phi - turn >= 2 * pi, level=self.keep * level, turn=turn + 2 * pi),
        }


@pytest.mark.parametrize("turns", [2.0, 100.0])
def test_a_lag_behind_a_sine_is_found_whatever_its_time_constant(turns: float) -> None:
    """Closed form: mean a, amplitude a/sqrt(1 + (w T)^2). A plain transient to 1e-6 takes ln(1e6) T/period periods."""
    lag = alone(Lag, lag=f"{turns * 0.02} s", frequency="50 Hz", size="2 bar")
    found = periodic(lag, period="20 ms", tolerance=1e-6, rtol=1e-8, most=60)
    assert found.converged
    window = Window(found.result)
    mean, wave = (Outcome("it", text).value(window).value for text in ("mean(part.y)", "amplitude(part.y, 50 Hz)"))
    assert mean == pytest.approx(2e5, rel=2e-6)
    assert wave == pytest.approx(2e5 / np.hypot(1, 2 * np.pi * turns), rel=2e-5)
    assert found.multiplier == pytest.approx(np.exp(-1 / turns), rel=1e-3)
    assert found.plain_estimate > 13.8 * turns
    assert found.periods <= 8


def test_the_periods_saved_are_counted_against_a_plain_transient() -> None:
    """A lag of 10 periods forgets its start, off by a, to 1e-4 of 2 a in ln(5000) 10 = 85 periods."""
    lag = alone(Lag, lag="200 ms", frequency="50 Hz", size="2 bar")
    found = periodic(lag, period="20 ms", tolerance=1e-4, rtol=1e-8, compare=True)
    assert found.plain == pytest.approx(85, abs=8)
    assert found.periods <= 8


def test_held_values_of_ticks_are_found_too() -> None:
    """z-transform: |Y| = s/|1 - (1 - s) e^{-iw dt}| at the ticks, s the share."""
    part = alone(Sampled, sample="1 ms", share="0.01", frequency="50 Hz")
    found = periodic(part, period="20 ms", tolerance=1e-6, rtol=1e-8)
    assert found.converged
    y = found.result["part.y"]
    turning = np.exp(-2j * np.pi / 20)
    assert np.max(np.abs(y)) <= 0.01 / abs(1 - 0.99 * turning) * (1 + 1e-5)
    expected = np.imag(0.01 / (1 - 0.99 * turning) * np.exp(2j * np.pi * np.arange(1, 21) / 20))
    after = np.array([y[k] for k in found.result.trajectory.steps.jumps])
    shift = round(found.result.trajectory.steps.t[0] / 1e-3)
    assert np.sort(after) == pytest.approx(np.sort(expected), abs=1e-5), shift
    assert found.periods < 12  # a plain transient takes ln(1e6)/0.2 = 69


def test_remaps_and_switches_are_gone_through() -> None:
    """Level after emptying c = keep (c + 1): c = keep/(1 - keep). Each period begins with an emptying."""
    found = periodic(alone(Hopper, frequency="10 Hz", keep="0.95"), period="100 ms", tolerance=1e-7, rtol=1e-8)
    assert found.converged
    assert np.min(found.result["part.level"]) == pytest.approx(0.95 / 0.05, rel=1e-6)
    assert found.periods < 10  # a plain transient takes ln(1e7)/0.05 = 314


def test_the_pump_closes_to_what_a_long_transient_gives() -> None:
    """Means over a pitch against means over the tenth revolution of a transient, within ten tolerances."""
    circuit = cl.load("crescent_pump")
    found = periodic(circuit, rtol=1e-6, tolerance=1e-5)
    assert found.converged
    assert found.periods < 20
    design = circuit.design()
    settings = whole_ticks(circuit.assembled(design), design, circuit.period(design))
    long = circuit.simulate(stop="120 ms", solver="rodas", rtol=1e-6, parameters=settings)
    for name in ("delivery.p", "throttle.q", "tips.q", "axial.q"):
        mean = Outcome("mean", f"mean({name})")
        assert mean.value(Window(found.result)).value == pytest.approx(
            mean.value(Window(long, 90e-3, 120e-3)).value, rel=1e-4
        ), name
    ripple = Outcome("ripple", "amplitude(delivery.p, driver_teeth * speed)")
    assert ripple.value(Window(found.result)).value == pytest.approx(
        ripple.value(Window(long, 90e-3, 120e-3)).value, rel=2e-3
    )


def test_a_wrong_period_is_found_out() -> None:
    """Half of the true one: said so, for two of them repeat themselves."""
    lag = alone(Lag, lag="5 ms", frequency="50 Hz", size="2 bar")
    found = periodic(lag, period="10 ms", most=40)
    assert not found.converged
    assert "write twice the period" in found.message


def test_a_sampled_part_must_fit_the_period() -> None:
    """A clock that may not be moved is named, with a period that fits it."""
    part = alone(Sampled, sample="3 ms", share="0.1", frequency="50 Hz")
    with pytest.raises(InputError, match=r"part ticks every 3 ms, 6\.66667 times .* write a period of 21 ms"):
        periodic(part, period="20 ms")


def test_a_circuit_without_a_period_asks_for_it() -> None:
    """Neither on the command line nor in the file."""
    with pytest.raises(InputError, match="write --period"):
        periodic(cl.load("relief_valve"))


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"tolerance": 0.0}, "tolerance 0: write a number"),
        ({"tolerance": float("nan")}, "tolerance nan: write a number"),
        ({"tolerance": 2.0}, "tolerance 2: write a number"),
        ({"rtol": 5.0}, "rtol 5"),
        ({"most": 0}, "most 0: write a whole number from 5 on, for example 300"),
        ({"solver": "rodos"}, "did you mean rodas"),
        ({"period": "0 ms"}, "period: 0 ms must be above 0"),
    ],
)
def test_what_cannot_be_searched_for_is_refused(wrong: dict[str, Any], said: str) -> None:
    """Before any period is integrated."""
    lag = alone(Lag, lag="5 ms", frequency="50 Hz", size="2 bar")
    with pytest.raises(InputError, match=said):
        periodic(lag, **{"period": "20 ms", **wrong})


def test_no_more_periods_than_allowed_are_integrated() -> None:
    """Those that look for a doubled period included."""
    lag = alone(Lag, lag="5 ms", frequency="50 Hz", size="2 bar")
    assert periodic(lag, period="10 ms", most=40).periods == 40


def test_anderson_solves_a_linear_map_in_as_many_steps_as_it_has_modes() -> None:
    """As GMRES does: Walker & Ni (2011), theorem 2.2. Four modes: done at the sixth evaluation."""
    rng = np.random.default_rng(3)
    basis = np.linalg.qr(rng.normal(size=(4, 4)))[0]
    matrix = basis @ np.diag([0.99, 0.9, 0.5, -0.7]) @ basis.T
    fixed, z = rng.normal(size=4), np.zeros(4)
    anderson = Anderson(8, 1e-14)
    for _ in range(6):
        z = anderson.next(z, fixed + matrix @ (z - fixed))
    assert z == pytest.approx(fixed, abs=1e-9)
    assert anderson.multiplier() == pytest.approx(0.99, abs=1e-6)


def test_the_command_prints_and_writes_the_last_period(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its file is one period long, and a start."""
    monkeypatch.chdir(tmp_path)
    assert main(["periodic", "crescent_pump", "--rtol", "1e-4", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["status"] == "done"
    assert said["distance"] <= said["tolerance"] == 1e-3
    arguments = ["--start", "crescent_pump_periodic.nc", "--stop", "60 ms", "--quiet", "--rtol", "1e-4"]
    assert main(["simulate", "crescent_pump", *arguments]) == 0
    assert main(["periodic", "crescent_pump", "--rtol", "1e-4", "--most", "5", "-o", "none"]) == 3
    assert "not periodic after 5 periods" in capsys.readouterr().err
