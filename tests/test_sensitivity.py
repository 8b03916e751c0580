"""Sensitivities: closed forms through smooth pieces, impacts, steps and ticks; differences; what falls back and why."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from building import OIL, alone, circuit
from pydantic import Field
from scipy.linalg import expm

import crescentlab as cl
from crescentlab.analysis.outcome import Outcome
from crescentlab.analysis.reach import STENCILS, slope
from crescentlab.analysis.sensitivity import Sensitivities, collocation, sensitivities
from crescentlab.analysis.sensitivity.differences import Runs
from crescentlab.analysis.sensitivity.variational import monodromy
from crescentlab.circuit import Circuit
from crescentlab.cli import main
from crescentlab.component import Component
from crescentlab.domain import held, observable, state
from crescentlab.errors import InputError
from crescentlab.maths import event_where, every, sin, when, where
from crescentlab.units import Ratio, Time


def plain(name: str, start: Any = 0.0) -> Any:
    """A state without unit."""
    return state(Ratio, name, start=start, nominal=1.0)


def number(text: str, **more: Any) -> Any:
    """A parameter without unit."""
    return Field(description=text, **more)


def of(run: Circuit, outcomes: list[str], parameters: list[str], **more: Any) -> Sensitivities:
    return sensitivities(run, [Outcome(text, text) for text in outcomes], parameters, **more)


def gradient(function: Callable[..., Any], *arguments: float) -> np.ndarray:
    """Derivatives of an analytic function by its arguments, by complex steps: exact to rounding."""
    steps = 1e-30j * np.eye(len(arguments))
    return np.array([np.imag(function(*(np.array(arguments) + step))) / 1e-30 for step in steps]).T


def assert_exact(found: Sensitivities, expected: object, rtol: float, atol: float = 0.0) -> None:
    assert set(found.method) == {"exact"}, found.reason
    np.testing.assert_allclose(found.derivative, expected, rtol=rtol, atol=atol)


def assert_like_differences(
    run: Circuit,
    outcomes: list[str],
    parameters: list[str],
    allowed: float,
    *,
    tight: float = 1e-10,
    **more: Any,
) -> None:
    """Exact derivatives against differences of tight runs: logarithmic sensitivities differ by ``allowed``."""
    exact = of(run, outcomes, parameters, method="exact", **more)
    other = of(run, outcomes, parameters, method="differences", **{**more, "rtol": tight})
    assert set(exact.method) == {"exact"}
    assert not np.any(exact.derivative == other.derivative)
    sizes = np.abs(exact.values[:, None] / [parameter.size for parameter in exact.parameters])
    np.testing.assert_array_less(np.abs(exact.derivative - other.derivative), allowed * sizes)


# -- smooth runs ---------------------------------------------------------------------------------


class Tank(Component):
    """A volume V emptying through a linear conductance A: p' = -A p/V, the hydraulic RC element."""

    volume: Ratio = number("V", gt=0)
    conductance: Ratio = number("A", gt=0)

    p = plain("pressure", 1.0)

    def equations(self, p):
        return {"der_p": -self.conductance * p / self.volume}


def test_discharge_of_a_tank():
    """p(T) = p0 exp(-A T/V) and its mean p0 V/(A T)(1 - exp(-A T/V)); derivatives by V, A, p0 by complex steps."""
    volume, conductance, start, end = 2.0, 3.0, 5.0, 1.5

    def closed(v, a, p0):
        e = np.exp(-a * end / v)
        return np.array([p0 * e, p0 * v / (a * end) * (1 - e), p0 * (1 - e)])

    run = alone(Tank, volume=str(volume), conductance=str(conductance), start={"p": str(start)})
    found = of(
        run, ["final(part.p)", "mean(part.p)", "peak_to_peak(part.p)"],
        ["part.volume", "part.conductance", "part.start.p"], stop=end, rtol=1e-9,
    )  # fmt: skip
    assert_exact(found, gradient(closed, volume, conductance, start), rtol=1e-7)
    sizes = [volume, conductance, start]
    np.testing.assert_allclose(found.values, closed(*sizes), rtol=1e-8)
    np.testing.assert_allclose(found.relative, found.derivative * sizes / found.values[:, None], rtol=1e-12)


def test_a_parameter_of_the_outcome_alone():
    """A circuit parameter that no equation uses: d(y/a)/da = -y/a^2."""
    run = circuit(
        Tank, components={"part": {"type": Tank.type_name(), "volume": "2", "conductance": "3"}},
        parameters={"a": "4"}, simulation={"stop": "1 s"},
    )  # fmt: skip
    found = of(run, ["mean(part.p) / a", "mean(part.p)"], ["a"])
    assert_exact(found, [[-found.values[0] / 4], [0.0]], rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("method", ["auto", "exact", "differences"])
def test_a_frequency_that_the_parameter_moves_is_refused(method):
    """A window of fixed length holds whole periods of one frequency only: beside it the line mixes with the mean.

    Of another parameter the same outcome has its derivative: the line of p0 e^(-A t/V) is proportional to p0.
    """
    run = circuit(
        Tank,
        components={"part": {"type": Tank.type_name(), "volume": "2", "conductance": "3", "start": {"p": "= full"}}},
        parameters={"beat": "4 Hz", "twice": "= 2 * beat", "full": "5"}, simulation={"stop": "1 s"},
    )  # fmt: skip
    for frequency in ("beat", "twice"):
        with pytest.raises(InputError, match=r"beat moves the frequency .* the frequency must not depend on the param"):
            of(run, ["mean(part.p)", f"amplitude(part.p, {frequency})"], ["full", "beat"], method=method)
    found = of(run, ["amplitude(part.p, twice)", "amplitude(part.p, 4 Hz)"], ["full"], method=method)
    np.testing.assert_allclose(found.derivative[:, 0], found.values / 5, rtol=1e-6)


def test_a_frequency_that_the_run_moves_is_refused():
    """f = 4 Hz initial(p)/5 follows the start value, and not the volume."""
    parts = {"type": Tank.type_name(), "volume": "2", "conductance": "3", "start": {"p": "= full"}}
    run = circuit(Tank, components={"part": parts}, parameters={"full": "5"}, simulation={"stop": "1 s"})
    with pytest.raises(InputError, match="full moves the frequency of this amplitude"):
        of(run, ["amplitude(part.p, 4 Hz * initial(part.p) / 5)"], ["full"])
    found = of(run, ["amplitude(part.p, 4 Hz * initial(part.p) / 5)"], ["part.volume"], method="exact")
    fixed = of(run, ["amplitude(part.p, 4 Hz)"], ["part.volume"], method="exact")
    np.testing.assert_allclose(found.derivative, fixed.derivative, rtol=1e-6)


def test_a_part_of_the_run():
    """The window's ends stay where they are: the mean over [t1, t2] of p0 exp(-A t/V) by V."""
    run = alone(Tank, volume="2", conductance="3", start={"p": "5"})

    def closed(v):
        return np.array([5 * v / 3 / 0.9 * (np.exp(-0.4 * 3 / v) - np.exp(-1.3 * 3 / v))])

    found = of(run, ["mean(part.p)"], ["part.volume"], stop=2.0, window=(0.4, 1.3), rtol=1e-9)
    assert_exact(found, gradient(closed, 2.0), rtol=1e-7)


class Swing(Component):
    """Damped oscillation x'' = -k x - 2 d x'."""

    stiffness: Ratio = number("k", gt=0)
    damping: Ratio = number("d", ge=0)

    x = plain("deflection", 1.0)
    v = plain("velocity", 0.0)

    def equations(self, x, v):
        return {"der_x": v, "der_v": -self.stiffness * x - 2 * self.damping * v}


def test_an_extreme_is_met_between_the_nodes():
    """The first minimum of a damped oscillation, -exp(-pi d/w) with w = sqrt(k - d^2), at pi/w."""
    run = alone(Swing, stiffness="9", damping="0.4")
    found = of(run, ["minimum(part.x)"], ["part.stiffness", "part.damping"], stop=2.0, rtol=1e-9)

    def closed(k, d):
        return np.array([-np.exp(-np.pi * d / np.sqrt(k - d * d))])

    assert_exact(found, gradient(closed, 9.0, 0.4), rtol=1e-6)


def test_monodromy_of_a_linear_system_is_its_matrix_exponential():
    """d x(T)/d x(0) = exp(A T)."""
    run = alone(Swing, stiffness="9", damping="0.4")
    result = run.simulate(1.7, solver="rodas", rtol=1e-8)
    names, found = monodromy(result.system, result.values, result.trajectory, rtol=1e-8)
    assert names == ["part.x", "part.v"]
    np.testing.assert_allclose(found, expm(np.array([[0.0, 1.0], [-9.0, -0.8]]) * 1.7), atol=1e-7)


# -- events --------------------------------------------------------------------------------------


class Ball(Component):
    """A ball that bounces with restitution e: Leine & Nijmeijer (2004), the standard example of a saltation."""

    gravity: Ratio = number("g", gt=0)
    restitution: Ratio = number("e", ge=0)
    height: Ratio = number("start height", gt=0)

    x = plain("height", "height")
    v = plain("velocity", 0.0)
    bounces = held(Ratio, "bounces", start=0.0)

    def equations(self, x, v, bounces):
        return {
            "der_x": v, "der_v": -self.gravity,
            "bounce": when((x < 0) & (v < 0), x=0.0, v=-self.restitution * v, bounces=bounces + 1),
        }  # fmt: skip


def flight(g, e, height, end, bounces):
    """Height, velocity and integral of the height at ``end`` of a ball dropped at rest, after so many bounces."""
    fall = np.sqrt(2 * height / g)
    t, v, area = fall, e * g * fall, height * fall - g * fall**3 / 6
    for _ in range(bounces - 1):
        s = 2 * v / g
        t, area, v = t + s, area + v * s * s / 2 - g * s**3 / 6, e * v
    s = end - t
    return np.array([v * s - g * s * s / 2, v - g * s, area + v * s * s / 2 - g * s**3 / 6])


@pytest.mark.parametrize(("end", "bounces"), [(0.6, 1), (1.2, 2), (1.7, 3)])
def test_bouncing_ball(end, bounces):
    """Landing times sqrt(2H/g)(1 + 2e + 2e^2 ...), velocities e^k sqrt(2gH): derivatives by g, e, H."""
    run = alone(Ball, gravity="9.81", restitution="0.7", height="1.0")
    found = of(
        run, ["final(part.x)", "final(part.v)", "integral(part.x) / (1 s)"],
        ["part.gravity", "part.restitution", "part.height"], stop=end, rtol=1e-9,
    )  # fmt: skip
    assert found.result["part.bounces"][-1] == bounces
    expected = gradient(lambda g, e, height: flight(g, e, height, end, bounces), 9.81, 0.7, 1.0)
    assert_exact(found, expected, rtol=1e-7)


def test_monodromy_of_a_bounce():
    """From one height down and up again, perfectly elastic: with the flight time s = v/g to and from the floor the

    saltation matrix is [[-1, 0], [2g/v, -1]] and M = F(s) S F(s), F(s) = [[1, s], [0, 1]].
    """
    run = alone(Ball, gravity="10", restitution="1", height="1.25")
    result = run.simulate(1.0, solver="rodas", rtol=1e-8)
    found = monodromy(result.system, result.values, result.trajectory)[1][:2, :2]
    fly, jump = np.array([[1.0, 0.5], [0.0, 1.0]]), np.array([[-1.0, 0.0], [4.0, -1.0]])
    np.testing.assert_allclose(found, fly @ jump @ fly, atol=1e-6)


@pytest.mark.parametrize("solver", ["auto", "lsoda", "bdf", "radau", "rk45", "dopri", "cvode"])
def test_every_solver(solver):
    """The interpolants of all solvers serve; LSODA's and BDF's own errors are some 1e-5 at this tolerance."""
    run = alone(Ball, gravity="9.81", restitution="0.7", height="1.0")
    parameters = ["part.gravity", "part.restitution", "part.height"]
    found = of(run, ["final(part.x)"], parameters, stop=1.2, rtol=1e-8, solver=solver)
    assert_exact(found, gradient(lambda *a: flight(*a, 1.2, 2)[:1], 9.81, 0.7, 1.0), rtol=1e-4)


def on_a_stop(restitution: str) -> Circuit:
    """A mass of 0.1 kg on a spring of 40 N/m, released at 5 mm; a stop at -2 mm."""
    return circuit(
        components={
            "mass": {"type": "mass_with_stops", "mass": "0.1 kg", "low": "-2 mm", "high": "50 mm",
                     "restitution": restitution, "rest_speed": "0.1 mm/s", "start": {"x": "5 mm"}},
            "spring": {"type": "spring", "stiffness": "40 N/m"},
        },
        nets={"rod": ["mass.port", "spring.rod"]},
        simulation={"stop": "0.2 s"},
    )  # fmt: skip


def test_spring_and_mass_hit_a_stop():
    """Free swing x0 cos wt to the stop at cos wt = low/x0, rebound with -e v, free swing from there."""

    def closed(m, k, low, e, x0):
        w = np.sqrt(k / m)
        hit = np.arccos(low / x0) / w
        v, s = e * x0 * w * np.sin(w * hit), 0.2 - hit
        return np.array([low * np.cos(w * s) + v / w * np.sin(w * s), v * np.cos(w * s) - low * w * np.sin(w * s)])

    found = of(
        on_a_stop("0.6"), ["final(mass.x)", "final(mass.v)"],
        ["mass.mass", "spring.stiffness", "mass.low", "mass.restitution", "mass.start.x"], rtol=1e-9,
    )  # fmt: skip
    assert_exact(found, gradient(closed, 0.1, 40.0, -2e-3, 0.6, 5e-3), rtol=1e-6)


def test_a_mass_that_comes_to_rest_forgets():
    """With e = 0 it rests on the stop until the force turns, which it never does: only the stop's place matters."""
    run = circuit(
        components={
            "mass": {"type": "mass_with_stops", "mass": "0.1 kg", "low": "-2 mm", "high": "50 mm",
                     "start": {"x": "5 mm"}},
            "spring": {"type": "spring", "stiffness": "40 N/m", "preload": "1 N"},
        },
        nets={"rod": ["mass.port", "spring.rod"]},
        simulation={"stop": "0.2 s"},
    )  # fmt: skip
    found = of(run, ["final(mass.x)"], ["mass.low", "mass.mass", "spring.preload", "mass.start.x"])
    assert found.result["mass.at"][-1] == -1
    assert_exact(found, [[1.0, 0.0, 0.0, 0.0]], rtol=1e-9, atol=1e-12)


class Switched(Component):
    """x' = y - x, y = 1 from the time `at` on, 0 before."""

    at: Time = number("switching time")
    height: Ratio = number("height")

    x = plain("follower", 0.0)
    y = observable(Ratio, "the step")

    def equations(self, t, x):
        y = event_where(t >= self.at, self.height, 0.0)
        return {"der_x": y - x, "y": y}


def test_a_step_whose_time_is_the_parameter():
    """x(T) = h (1 - exp(-(T - ts))); the mean of the step itself is h (T - ts)/T: its nodes move with the step."""

    def closed(at, h):
        e = np.exp(-(2 - at))
        return np.array([h * (1 - e), h * (2 - at) / 2, h * (2 - at - 1 + e) / 2, h**2 * (2 - at) / 2])

    run = alone(Switched, at="0.7 s", height="3")
    outcomes = ["final(part.x)", "mean(part.y)", "mean(part.x)", "mean(part.y * part.y)"]
    found = of(run, outcomes, ["part.at", "part.height"], stop=2.0, rtol=1e-9)
    assert_exact(found, gradient(closed, 0.7, 3.0), rtol=1e-7)


class Until(Component):
    """A clock s' = 1 and a distance x' = v."""

    speed: Ratio = number("v")

    x = plain("distance", 0.0)
    s = plain("clock", 0.0)

    def equations(self):
        return {"der_x": self.speed, "der_s": 1.0}


def test_a_run_that_ends_by_a_condition():
    """x = v t reaches 3 at 3/v: the clock then reads 3/v, its mean half of that; the end moves with v."""
    run = alone(Until, speed="2", simulation={"stop": "5 s", "stop_when": "part.x > 3"})
    found = of(run, ["final(part.s)", "mean(part.s)", "final(part.x)"], ["part.speed"])
    assert_exact(found, [[-0.75], [-0.375], [0.0]], rtol=1e-9, atol=1e-9)


class Sampled(Component):
    """x' = -k s, where s samples x every dt."""

    gain: Ratio = number("k")
    dt: Time = number("sampling time", gt=0)

    x = plain("state", 1.0)
    s = held(Ratio, "sample", start=1.0)

    def equations(self, x, s):
        return {"der_x": -self.gain * s, "sample": every(self.dt, s=x)}


def test_a_sampled_part_and_its_sampling_time():
    """x(T) = (1 - k dt)^n (1 - k (T - n dt)), n whole samples: derivatives by k and by dt, which moves every tick."""

    def closed(k, dt):
        return np.array([(1 - k * dt) ** 9 * (1 - k * (0.97 - 9 * dt)), (1 - k * dt) ** 9])

    run = alone(Sampled, gain="1.7", dt="100 ms")
    found = of(run, ["final(part.x)", "final(part.s)"], ["part.gain", "part.dt"], stop=0.97, rtol=1e-9)
    assert_exact(found, gradient(closed, 1.7, 0.1), rtol=1e-8)


class Latch(Component):
    """x' = h; the tick finds nothing to change, for both its values are the same number."""

    feed: Ratio = number("value that is sampled")

    x = plain("integral", 0.0)
    h = held(Ratio, "sample", start=2.0)

    def equations(self, h):
        return {"der_x": h, "tick": every(0.25, h=self.feed)}


def test_a_tick_that_changes_no_value_changes_derivatives():
    """h = 2 at first, = feed = 2 from 0.25 on: x(1) = 0.5 + 0.75 feed although nothing is seen to happen."""
    assert_exact(of(alone(Latch, feed="2"), ["final(part.x)"], ["part.feed"], stop=1.0), [[0.75]], rtol=1e-9)


def test_parameters_that_depend_on_each_other():
    """V = a and A = b/a with b = 2 a: p = exp(-2 T/a) by a alone, exp(-b T/4) by b alone.

    Moved together b no longer follows a, so each is compared with a difference of its own.
    """
    run = circuit(
        Tank, components={"part": {"type": Tank.type_name(), "volume": "= a", "conductance": "= b / a"}},
        parameters={"a": "2", "b": "= 2 * a"}, simulation={"stop": "1.5 s"},
    )  # fmt: skip
    found = of(run, ["final(part.p)"], ["a", "b"], rtol=1e-9)
    e = np.exp(-1.5)  # conductance 2 over volume 2
    assert_exact(found, [[1.5 * e / 2, -1.5 * e / 4]], rtol=1e-7)
    assert all("along it agrees" in reason for reason in found.reason)


# -- where the exact way does not hold -----------------------------------------------------------


class TwoGates(Component):
    """Two switches on one ramp, at the same place by chance, whose order matters."""

    first: Ratio = number("first level")
    second: Ratio = number("second level")

    x = plain("ramp", 0.0)
    y = plain("outcome", 0.0)

    def equations(self, x):
        return {"der_x": 1.0, "der_y": event_where(x > self.first, 1.0, 0.0) + event_where(x > self.second, 2.0, 0.0)}


def test_two_switches_at_one_instant_fall_back():
    """y(1) = (1 - a) + 2 (1 - b) at a = b = 0.4: which came first cannot be told, so differences take over: -1, -2."""
    found = of(alone(TwoGates, first="0.4", second="0.4"), ["final(part.y)"], ["part.first", "part.second"], stop=1.0)
    assert all(method.startswith("central differences") for method in found.method)
    assert all("two things happen at once that move apart" in reason for reason in found.reason)
    np.testing.assert_allclose(found.derivative, [[-1.0, -2.0]], rtol=1e-6)


class Graze(Component):
    """A throw that just touches a ceiling; above it another slope would begin."""

    top: Ratio = number("ceiling")

    x = plain("height", 0.0)
    v = plain("velocity", 2.0)
    y = plain("count", 0.0)

    def equations(self, x, v):
        return {"der_x": v, "der_v": -2.0, "der_y": event_where(x > self.top, 1.0, 0.0)}


def test_a_grazing_relation_falls_back():
    """The vertex is at 1; a ceiling 1e-12 below it is passed with a rate lost in the tolerance."""
    found = of(alone(Graze, top="0.999999999999"), ["final(part.x)"], ["part.top"], stop=1.8, check=False)
    assert found.method[0] != "exact"
    assert "only grazes its boundary" in found.reason[0]


class Creeping(Component):
    """A jump that the author hid from the events: plain `where` whose branches do not meet."""

    level: Ratio = number("level")

    x = plain("ramp", 0.0)
    y = plain("outcome", 0.0)

    def equations(self, x):
        return {"der_x": 1.0, "der_y": where(x > self.level, 1.0, 0.0)}


@pytest.mark.parametrize("side", STENCILS)
def test_how_an_expression_changes_and_where_it_bends(side):
    """Five places, 1e-4 apart: exact for 1 + x^4 and x^2; a kink is seen at all places but the end of a side.

    A square at its vertex bends and has no slope, which is smooth; an infinite number that stays is none of ours.
    """
    first, weights = STENCILS[side]
    x = 1e-4 * np.arange(first, first + 5)
    found = slope(np.array([1 + (2 + x) ** 4, x**2, 0 * x + 3, np.full(5, np.inf)]).T, weights, 1e-4)
    assert found is not None
    np.testing.assert_allclose(found, [32, 0, 0, 0], rtol=1e-9, atol=1e-12)
    for at in np.linspace(x[0], x[-1], 33)[1:-1]:
        assert slope(np.maximum(x - at, 0)[:, None] + x[:, None], weights, 1e-4) is None


def test_a_parameter_at_a_kink_of_its_expression_has_no_exact_derivative():
    """flow = min(supply, 30 L/min) at 30 L/min: slope 1 on one side and 0 on the other, and not their mean."""
    run = circuit(
        components={
            "pump": {"type": "flow_source", "flow": "= min(supply, 30 L/min)"},
            "line": {"type": "capacity", "volume": "70 cm^3", "start": {"p": "5 bar"}},
            "hole": {"type": "orifice", "area": "10 mm^2"}, "tank": {"type": "tank"},
        },
        nets={"p": ["pump.port", "line.port", "hole.a"], "t": ["hole.b", "tank.port"]},
        fluid=OIL, parameters={"supply": "30 L/min"}, simulation={"stop": "1 ms"},
    )  # fmt: skip
    found = of(run, ["final(line.p)"], ["supply"])
    assert found.method[0] != "exact"
    assert "an expression of supply has a kink or jump" in found.reason[0]


def test_a_jump_that_is_no_event_is_noticed():
    """y(1) = 1 - level; the equations' derivatives know nothing of it, the comparison with a difference does."""
    run = alone(Creeping, level="0.4")
    found = of(run, ["final(part.y)"], ["part.level"], stop=1.0, rtol=1e-6)
    assert "a difference of final(part.y)" in found.reason[0]
    np.testing.assert_allclose(found.derivative, [[-1.0]], rtol=1e-2)
    with pytest.raises(InputError, match="no exact derivative"):
        of(alone(TwoGates, first="0.4", second="0.4"), ["final(part.y)"], ["part.first"], stop=1.0, method="exact")


def test_what_shapes_the_equations_is_differenced():
    """A line's length cuts it into cells; whole numbers and words have no derivative."""
    run = circuit(
        components={
            "source": {"type": "pressure_source", "pressure": "20 bar"},
            "line": {"type": "lax_wendroff_line", "diameter": "20 mm", "length": "10 m", "internal_nodes": "4",
                     "max_pressure": "60 bar", "start_pressure": "10 bar"},
            "end": {"type": "capacity", "volume": "0.2 L", "start": {"p": "10 bar"}},
        },
        nets={"p_a": ["source.port", "line.a"], "p_b": ["line.b", "end.port"]},
        fluid=OIL, parameters={"word": "hot"}, simulation={"stop": "12 ms"},
    )  # fmt: skip
    found = of(run, ["mean(end.p)"], ["line.length", "end.volume"])
    assert found.method[0].startswith("central differences")
    assert "shapes the equations" in found.reason[0]
    assert found.method[1] == "exact"
    assert found.derivative[0, 0] < 0
    for name, said in [
        ("line.internal_nodes", "is the whole number 4"), ("word", "is the word 'hot'"),
        ("end.volum", "did you mean volume"), ("end.start.q", "has no state 'q'"), ("nothing.here", "nothing has this"),
    ]:  # fmt: skip
        with pytest.raises(InputError, match=said):
            of(run, ["mean(end.p)"], [name])


def test_a_lax_wendroff_line_with_its_ticks():
    """Some fifteen ticks of a short line, whose period moves with density and bulk modulus, against differences."""
    run = circuit(
        components={
            "source": {"type": "pressure_source", "pressure": "20 bar"},
            "line": {"type": "lax_wendroff_line", "diameter": "20 mm", "length": "3 m", "internal_nodes": "4",
                     "max_pressure": "60 bar", "start_pressure": "10 bar"},
            "end": {"type": "capacity", "volume": "0.2 L", "start": {"p": "10 bar"}},
        },
        nets={"p_a": ["source.port", "line.a"], "p_b": ["line.b", "end.port"]},
        fluid=OIL, simulation={"stop": "6 ms"},
    )  # fmt: skip
    outcomes = ["mean(end.p)", "final(end.p)", "maximum(line.q)"]
    parameters = ["source.pressure", "end.volume", "fluid.density", "fluid.bulk_modulus", "line.max_pressure"]
    assert_like_differences(run, outcomes, parameters, 2e-5, rtol=1e-9)


class Seat(Component):
    """A ramp that begins on a switch."""

    level: Ratio = number("level of the switch")

    x = plain("ramp", 1.0)
    y = plain("outcome", 0.0)

    def equations(self, x):
        return {"der_x": 1.0, "der_y": event_where(x > self.level, 1.0, 0.0)}


def test_a_relation_that_begins_on_its_boundary_falls_back():
    """y(1) = 1 for level <= 1, 2 - level above: the derivative has two values at the start x = level = 1."""
    found = of(alone(Seat, level="1"), ["final(part.y)"], ["part.level"], stop=1.0)
    assert "begins on its boundary" in found.reason[0]


def test_an_event_at_the_end_of_the_window_falls_back():
    """The tenth tick falls on the end: a little longer sampling time, and it is gone."""
    found = of(
        alone(Sampled, gain="1.7", dt="100 ms"), ["final(part.x)", "final(part.s)"], ["part.dt", "part.gain"], stop=1.0
    )
    assert "falls on the window's end" in found.reason[0]
    assert found.method[1] == "exact", found.reason


def test_an_event_at_the_end_of_the_window_may_not_matter():
    """x = (1 - k dt)^n (1 - k (t - n dt)) is continuous at the tick on the window's end: its mean has a derivative."""

    def closed(k, dt):  # ten whole samples in the limit: the sum of the means of straight lines
        q, total = 1 - k * dt, 0.0
        for n in range(10):
            total = total + q**n * (1 - k * dt / 2) * dt
        return np.array([total + q**10 * (1 - 10 * dt)])

    run = alone(Sampled, gain="1.7", dt="100 ms")
    found = of(run, ["mean(part.x)"], ["part.gain", "part.dt"], stop=1.0, rtol=1e-9)
    assert_exact(found, gradient(closed, 1.7, 0.1), rtol=1e-7)
    jumps = alone(Switched, at="0.7 s", height="3")
    for window in ((0.7, None), (None, 0.7)):
        found = of(jumps, ["mean(part.x)", "final(part.x)"], ["part.at"], stop=1.0, window=window)
        assert found.method == ("exact",) if window[0] else found.method != ("exact",)


def test_one_sided_differences():
    """A parameter that is 0 and may not be negative is varied upwards: p = p0 exp(-A T/V) by A at A = 0 is -p0 T/V."""

    class Leaking(Tank):
        conductance: Ratio = number("A", ge=0)

    run = alone(Leaking, volume="2", conductance="0", start={"p": "5"})
    for method in ("exact", "auto", "differences"):
        found = of(run, ["final(part.p)"], ["part.conductance"], stop=1.5, method=method)
        assert ("agrees to" in found.reason[0]) == (method == "auto")
        np.testing.assert_allclose(found.derivative, [[-3.75]], rtol=1e-5)
    assert found.method[0].startswith("forward differences")


def test_differences_side_by_side_equal_those_one_by_one():
    """Threads share one system and give the same numbers to the last bit."""
    run = cl.load("relief_valve")
    outcomes = [Outcome("p", "mean(line.p)")]
    runs = Runs(run, outcomes, {}, {"stop": "2 ms", "solver": "rodas", "rtol": 1e-7}, (None, None))
    jobs = [{"supply": f"{supply} L/min"} for supply in (20, 25, 30, 35, 40)]
    np.testing.assert_array_equal(runs.all(jobs, True), runs.all(jobs, False))


def test_a_chain_of_many_volumes():
    """More states than are solved for with a full matrix: the two ways of elimination agree."""
    n = collocation.DENSE + 3
    names = [f"v{k}" for k in range(n)]
    run = circuit(
        components={
            "source": {"type": "flow_source", "flow": "10 L/min"}, "tank": {"type": "tank"},
            **{name: {"type": "capacity", "volume": "10 cm^3"} for name in names},
            **{f"r{k}": {"type": "orifice", "area": "20 mm^2"} for k in range(n)},
        },
        nets={
            "first": ["source.port", "v0.port", "r0.a"], "last": [f"r{n - 1}.b", "tank.port"],
            **{f"n{k}": [f"r{k - 1}.b", f"v{k}.port", f"r{k}.a"] for k in range(1, n)},
        },
        fluid=OIL, simulation={"stop": "2 ms"},
    )  # fmt: skip
    assert_like_differences(run, ["mean(v0.p)"], ["source.flow", "r5.area"], 1e-5, rtol=1e-6, tight=1e-9)


# -- whole circuits ------------------------------------------------------------------------------


def test_relief_valve_against_differences():
    """The valve opens, overshoots and leaves its seat by an event: to 1e-5 of each parameter's effect."""
    assert_like_differences(
        cl.load("relief_valve"), ["mean(line.p)", "maximum(line.p)", "rms(valve.x)", "mean(line.p) / supply"],
        ["supply", "line.volume", "valve.cracking_pressure", "valve.damping", "fluid.density"], 1e-5, stop="2 ms",
    )  # fmt: skip


def test_crescent_pump_over_a_pitch_against_differences():
    """Nearly a pitch at 2000 rpm: teeth mesh, chains shift, the line ticks; the crescent's ends move the events."""
    assert_like_differences(
        cl.load("crescent_pump"), ["mean(delivery.p)", "mean(leakage.q) / mean(throttle.q)"],
        ["throttle_area", "speed", "crescent_extension"], 1e-5, tight=1e-8, stop="2.28 ms", rtol=1e-6,
    )  # fmt: skip


def test_going_on_from_a_result():
    """The states at the start are then given: of p = p0 exp(-A t/V) only the time since then counts."""
    run = alone(Tank, volume="2", conductance="3", start={"p": "5"})
    first = run.simulate(1.0, solver="rodas", rtol=1e-9)
    found = of(run, ["final(part.p)"], ["part.conductance", "part.start.p"], stop=1.5, start=first, rtol=1e-9)
    last = 5 * np.exp(-3 * 1.5 / 2)
    assert_exact(found, [[-0.25 * last, 0.0]], rtol=1e-7, atol=1e-12)


def test_going_on_with_another_sampling_time():
    """The last tick stays where it was, at 0.5; from there on the new period counts."""
    run = alone(Sampled, gain="1.7", dt="100 ms")
    first = run.simulate(0.52, solver="rodas", rtol=1e-9)
    x, s = first["part.x"][-1], first["part.s"][-1]

    def closed(k, dt):
        return np.array([(x - k * s * (dt - 0.02)) * (1 - k * dt) ** 3 * (1 - k * (0.47 - 4 * dt))])

    found = of(run, ["final(part.x)"], ["part.gain", "part.dt"], stop=0.97, start=first, rtol=1e-9)
    assert_exact(found, gradient(closed, 1.7, 0.1), rtol=1e-7)


class Driven(Component):
    """x' = -x + sin(w t)."""

    w: Ratio = number("angular frequency")

    x = plain("response", 0.0)

    def equations(self, t, x):
        return {"der_x": sin(self.w * t) - x}


def test_all_ways_agree():
    """Exact derivatives, those of another solver, and differences with their estimated errors."""
    run = alone(Driven, w="3")
    exact = of(run, ["rms(part.x)"], ["part.w"], stop=2.0, method="exact", rtol=1e-9)
    other = of(run, ["rms(part.x)"], ["part.w"], stop=2.0, method="exact", rtol=1e-9, solver="dop853")
    differences = of(run, ["rms(part.x)"], ["part.w"], stop=2.0, method="differences")
    assert np.isnan(exact.error).all()
    assert differences.reason == ("asked for",)
    np.testing.assert_allclose(other.derivative, exact.derivative, rtol=1e-6)
    np.testing.assert_array_less(np.abs(differences.derivative - exact.derivative), differences.error + 1e-6)


# -- the command ---------------------------------------------------------------------------------


def test_command(tmp_path, capsys, monkeypatch):
    """Text, --json, and a CSV file say the same: derivative, unit, relative sensitivity, method and reason."""
    monkeypatch.chdir(tmp_path)
    line = [
        "sensitivity", "relief_valve", "--outcome", "mean(line.p)", "--parameter", "supply",
        "--parameter", "line.volume", "--stop", "2 ms",
    ]  # fmt: skip
    assert main([*line, "-o", "found.csv"]) == 0
    said = capsys.readouterr().out
    for part in ("bar per L/min", "bar per cm3", "exact", "agrees to"):
        assert part in said
    assert main([*line, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["status"] == "done"
    assert len(found["sensitivities"]) == 2
    with (tmp_path / "found.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    for row, each in zip(rows, found["sensitivities"], strict=True):
        assert float(row["derivative"]) == pytest.approx(each["derivative"], rel=1e-12)
        assert (row["unit"], row["parameter"], row["method"]) == (each["unit"], each["parameter"], "exact")
        assert each["reason"] == row["reason"] != ""


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--parameter", "suply"], "did you mean supply"),
        (["--parameter", "supply", "--method", "exakt"], "did you mean exact"),
        (["--parameter", "supply", "-o", "found.xlsx"], "suffix"),
        (["--parameter", "supply", "--from", "70 ms"], "not inside the run"),
        (["--parameter", "supply", "--parameter", "supply"], "given twice"),
        ([], "no parameter"),
    ],
)
def test_wrong_arguments(more, said, capsys):
    """One sentence and exit code 2."""
    assert main(["sensitivity", "relief_valve", "--outcome", "mean(line.p)", "--stop", "2 ms", *more]) == 2
    assert said in capsys.readouterr().err
