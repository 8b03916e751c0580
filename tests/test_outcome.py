"""Outcomes: numbers a run is summed up in, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from building import circuit
from pydantic import Field

import crescentlab as cl
from crescentlab.analysis.outcome import Outcome, Window
from crescentlab.component import Component, Equations
from crescentlab.domain import state
from crescentlab.errors import InputError, Place
from crescentlab.result import Result
from crescentlab.units import QUANTITIES, Angle, Speed

WAVE = {"type": "sine", "mean": "3 bar", "amplitude": "0.5 bar", "frequency": "50 Hz"}


class Turner(Component):
    """A shaft."""

    speed: Speed = Field(description="speed of the shaft")
    phi = state(Angle, "angle", counts=True)

    def equations(self) -> Equations:
        return {"der_phi": self.speed}


@pytest.fixture(scope="module")
def run() -> Result:
    """Two signals known in closed form: 3 bar + 0.5 bar sin(2 pi 50 Hz t), and a square pulse of 2 bar, 4 of 10 ms."""
    pulse = {"type": "pulse", "high": "2 bar", "width": "4 ms", "period": "10 ms"}
    parts = {"wave": WAVE, "square": pulse, "shaft": {"type": "turner", "speed": "= turning"}}
    return circuit(Turner, components=parts, parameters={"turning": "3000 rpm"}).simulate(stop="60 ms")


def value(run: Result, text: str, start: float | None = 0.02, stop: float | None = 0.06) -> float:
    return Outcome("it", text).value(Window(run, start, stop)).value


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("mean(wave.y)", 3e5),
        ("rms(wave.y - 3 bar)", 0.5e5 / np.sqrt(2)),
        ("integral(wave.y)", 3e5 * 0.04),
        ("amplitude(wave.y, 50 Hz)", 0.5e5),
        ("amplitude(wave.y, turning)", 0.5e5),
        ("amplitude(wave.y, 1 / 20 ms)", 0.5e5),
        ("amplitude(wave.y, 2 * turning)", 0.0),
        ("mean(wave.y * wave.y) / mean(wave.y)", 3e5 + 0.5e5**2 / 2 / 3e5),
        ("mean(square.y)", 0.8e5),
        ("amplitude(square.y, 100 Hz)", 2 * 2e5 / np.pi * np.sin(0.4 * np.pi)),
        ("amplitude(square.y, 300 Hz)", 2 * 2e5 / (3 * np.pi) * abs(np.sin(1.2 * np.pi))),
        ("peak_to_peak(square.y)", 2e5),
        ("final(shaft.phi) - initial(shaft.phi)", 2 * np.pi * 2),
        ("mean(max(wave.y, 3 bar)) - 3 bar", 0.5e5 / np.pi),
        ("13 * turning", 13 * 100 * np.pi),
    ],
)
def test_functions_of_series_give_their_closed_forms(run: Result, text: str, expected: float) -> None:
    """Fourier coefficients of a sine and of a rectangle of duty d, 2 h sin(pi n d)/(pi n); means of both.

    Gauss nodes integrate the sine and the rectangle, whose edges are stops, to rounding; only the half wave has a kink
    inside a piece of 1/512 of the window, where the rule is of second order.
    """
    kinked = "max(" in text
    assert value(run, text) == pytest.approx(expected, rel=512**-1.5 if kinked else 1e-9, abs=1e-4)


def test_the_extremes_are_those_of_the_samples(run: Result) -> None:
    """Of a sine sampled at least 100 times a period the extremes are within 1 - cos(pi/100) of its amplitude."""
    error = 0.5e5 * (1 - np.cos(np.pi / 100))
    assert value(run, "maximum(wave.y)") == pytest.approx(3.5e5, abs=error)
    assert value(run, "minimum(wave.y)") == pytest.approx(2.5e5, abs=error)


def test_outcomes_carry_their_quantity(run: Result) -> None:
    """Of pressures a pressure, of their ratio a pure number, of a flow over time a volume."""
    system = run.system
    expected = {"mean(wave.y)": "pressure", "mean(wave.y) / maximum(wave.y)": "ratio", "mean(shaft.phi)": "angle"}
    for text, name in expected.items():
        assert Outcome("it", text).quantity(system, run.values, run.design) is QUANTITIES[name]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("mean(wawe.y)", "no variable or parameter 'wawe.y'"),
        ("wave.y", "is a series over time; make a number of it, for example mean(wave.y)"),
        ("mean(wave.y) + 3 L/min", "cannot add"),
        ("mean(wave.y, 2)", "mean takes one argument"),
        ("average(wave.y)", "unknown function 'average'"),
        ("amplitude(wave.y, turning / (2 * pi))", "holds 0.1592 periods"),
        ("amplitude(wave.y, 3 bar)", "a frequency is needed"),
        ("amplitude(wave.y)", "amplitude takes two arguments"),
    ],
)
def test_a_wrong_outcome_is_told_at_its_place(run: Result, text: str, said: str) -> None:
    """One sentence, at the file and line it stands in, naming the outcome."""
    with pytest.raises(InputError) as error:
        Outcome("ripple", text, Place("study.yaml", 7)).value(Window(run, 0.02, 0.04))
    assert said in str(error.value)
    assert str(error.value).startswith("study.yaml:7: ripple: ")


def test_a_window_outside_the_run_is_refused(run: Result) -> None:
    """Also an empty one."""
    for start, stop in ((0.02, 0.07), (-0.01, 0.02), (0.02, 0.02)):
        with pytest.raises(InputError, match="is not inside the run"):
            Window(run, start, stop)


@pytest.mark.parametrize("solver", ["rodas", "lsoda"])
def test_weights_add_up_across_events_whatever_the_solver(solver: str) -> None:
    """Weights sum to the window's length, and the mean of a rate is the difference of what it moves."""
    run = cl.load("crescent_pump").simulate(stop="4 ms", solver=solver, rtol=1e-5)
    window = Window(run, 1.1e-3, 3.9e-3)
    assert window.weights.sum() == pytest.approx(2.8e-3, rel=1e-12)
    turned = Outcome("turned", "final(shaft.phi) - initial(shaft.phi)").value(window).value
    assert turned == pytest.approx(2.8e-3 * 2000 * 2 * np.pi / 60, rel=1e-9)
