"""Linear models against closed forms, finite differences and small simulations; what is refused, files and pictures."""

from __future__ import annotations

import csv
import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from building import circuit
from pydantic import Field
from scipy.linalg import expm

import crescentlab as cl
from crescentlab.analysis.derivatives import Derivatives, Point
from crescentlab.analysis.linear import LinearModel, linearize
from crescentlab.analysis.linear.frequency import band, frequency_response, grid
from crescentlab.analysis.linear.modes import modes
from crescentlab.analysis.steady import steady
from crescentlab.analysis.tick_map import block_exponential
from crescentlab.circuit import Circuit
from crescentlab.cli import main
from crescentlab.component import Component, Equations
from crescentlab.domain import gives_signal, held, observable, state, takes_signal
from crescentlab.errors import InputError, SimulationError
from crescentlab.maths import Expr, event_where, every, fabs
from crescentlab.units import Ratio

LPM = 1e-3 / 60
OIL = {"type": "simple_oil", "density": "870 kg/m^3", "kinematic_viscosity": "46 cSt", "bulk_modulus": "1.6 GPa"}
RHO, NU, BETA = 870.0, 46e-6, 1.6e9


def start(parts: Circuit) -> Any:
    """The circuit at its start values, which are where it rests."""
    return parts.simulate("1 us", rtol=1e-9).trajectory.end


def leaking_volume() -> Circuit:
    """A volume that leaks through a laminar gap, and a closed orifice: C dp/dt = Q - G p about 0 bar."""
    return circuit(
        components={
            "pump": {"type": "flow_source", "flow": "0 L/min"}, "volume": {"type": "capacity", "volume": "50 cm^3"},
            "gap": {"type": "laminar_gap", "width": "10 mm", "height": "50 um", "length": "20 mm"},
            "load": {"type": "orifice", "area": "0 mm^2"}, "tank": {"type": "tank"},
        },
        nets={"line": ["pump.port", "volume.port", "gap.a", "load.a"], "back": ["gap.b", "load.b", "tank.port"]},
        fluid=OIL,
    )  # fmt: skip


def oscillator(force: str = "5 N") -> Circuit:
    """0.2 kg on 8 kN/m with 10 N s/m, between stops at 0 and 10 mm."""
    return circuit(
        components={
            "mass": {"type": "mass_with_stops", "mass": "0.2 kg", "low": "0 mm", "high": "10 mm"},
            "spring": {"type": "spring", "stiffness": "8000 N/m", "preload": "0 N"},
            "damper": {"type": "damper", "coefficient": "10 N s/m"}, "push": {"type": "force_source", "force": force},
        },
        nets={"rod": ["mass.port", "spring.rod", "damper.rod", "push.rod"]},
    )  # fmt: skip


def wave_line(frequency: str = "700 Hz", amplitude: str = "0 L/min") -> Circuit:
    """Flow into a volume, a line with ticks, a second volume, an orifice: 5 L/min and a sine."""
    return circuit(
        components={
            "sine": {"type": "sine", "output_quantity": "flow", "mean": "5 L/min", "amplitude": amplitude,
                     "frequency": frequency},
            "pump": {"type": "signal_flow_source"},
            "volume": {"type": "capacity", "volume": "20 cm^3", "start": {"p": "40 bar"}},
            "line": {"type": "lax_wendroff_line", "length": "1 m", "diameter": "10 mm", "internal_nodes": "9",
                     "max_pressure": "60 bar", "start_pressure": "40 bar", "start_flow": "5 L/min"},
            "end": {"type": "capacity", "volume": "5 cm^3", "start": {"p": "40 bar"}},
            "load": {"type": "orifice", "area": "1 mm^2"}, "tank": {"type": "tank"},
        },
        nets={"signal": ["sine.y", "pump.flow"], "first": ["pump.port", "volume.port", "line.a"],
              "second": ["line.b", "end.port", "load.a"], "back": ["load.b", "tank.port"]},
        fluid=OIL, simulation={"stop": "300 ms"},
    )  # fmt: skip


# -- closed forms --------------------------------------------------------------------------------


def test_a_leaking_volume_is_a_first_order_lag() -> None:
    """Pole -G beta/V, p/Q = 1/(G (1 + j omega V/(beta G))), G = b h^3/(12 mu l) (plane Poiseuille flow).

    The flow of a source and a flow brought into the net are one input; the leakage follows as G p.
    """
    parts = leaking_volume()
    model = linearize(parts, at=start(parts), inputs=["pump.flow", "line"], outputs=["line.p", "gap.q"])
    G = 10e-3 * 50e-6**3 / (12 * RHO * NU * 20e-3)
    T = 50e-6 / (BETA * G)
    assert model.states == ("volume.p",)
    assert model.A[0, 0] == pytest.approx(-1 / T, rel=1e-12)
    (mode,) = modes(model)
    assert (mode.time_constant, mode.damping_ratio, mode.participation) == (pytest.approx(T), 1.0, {"volume.p": 1.0})
    omega = np.array([0.1, 1.0, 10.0]) / T
    lag = 1 / (1 + 1j * omega * T)
    H = model.response(omega)
    np.testing.assert_allclose(H[:, 0], (lag / G)[:, None] * [1, 1], rtol=1e-12)
    np.testing.assert_allclose(H[:, 1], lag[:, None] * [1, 1], rtol=1e-12)
    assert model.residual == 0
    assert model.warnings == ()


def test_mass_spring_damper() -> None:
    """omega_0 = sqrt(k/m), zeta = c/(2 sqrt(k m)); x/F = 1/(k - m omega^2 + j c omega) for the source and the net."""
    parts = oscillator()
    point = steady(parts)
    assert point.snapshot.x[0] == pytest.approx(5 / 8000, rel=1e-9)
    model = linearize(parts, at=point, inputs=["push.force", "rod"], outputs=["mass.x", "rod.v", "mass.port.f"])
    (mode,) = modes(model)
    assert mode.natural_frequency == pytest.approx(math.sqrt(8000 / 0.2), rel=1e-12)
    assert mode.damping_ratio == pytest.approx(10 / (2 * math.sqrt(8000 * 0.2)), rel=1e-12)
    assert mode.eigenvalue.imag == pytest.approx(math.sqrt(8000 / 0.2 - (10 / 0.4) ** 2), rel=1e-12)
    assert mode.participation == {"mass.x": pytest.approx(0.5), "mass.v": pytest.approx(0.5)}
    omega = np.array([20.0, 200.0, 2000.0])
    expected = 1 / (8000 - 0.2 * omega**2 + 10j * omega)
    H = model.response(omega)
    for k, factor in enumerate((np.ones(3), 1j * omega, -0.2 * omega**2)):
        np.testing.assert_allclose(H[:, k, 0], expected * factor, rtol=1e-9)
        np.testing.assert_allclose(H[:, k, 1], expected * factor, rtol=1e-9)
    assert model.D[2, 0] == pytest.approx(1.0)  # the force on the mass follows at once


def test_participation_of_two_uncoupled_parts() -> None:
    """Two masses on springs of their own: each mode has the two states of its mass (Kundur 1994, section 12.2.4)."""
    parts = circuit(
        components={
            "one": {"type": "mass_with_stops", "mass": "1 kg", "low": "-1 mm", "high": "1 mm", "start": {"x": "0 mm"}},
            "two": {"type": "mass_with_stops", "mass": "2 kg", "low": "-1 mm", "high": "1 mm", "start": {"x": "0 mm"}},
            "soft": {"type": "spring", "stiffness": "100 N/m"}, "hard": {"type": "spring", "stiffness": "20000 N/m"},
        },
        nets={"rod_one": ["one.port", "soft.rod"], "rod_two": ["two.port", "hard.rod"]},
    )  # fmt: skip
    first, second = modes(linearize(parts, at=start(parts)))
    assert (first.damped_frequency, second.damped_frequency) == (pytest.approx(10.0), pytest.approx(100.0))
    assert sum(first.participation[f"one.{v}"] for v in "xv") == pytest.approx(1)
    assert sum(second.participation[f"two.{v}"] for v in "xv") == pytest.approx(1)


def test_helmholtz_resonator() -> None:
    """The lumped pipe, open at a volume of constant pressure and closed at the other end, rings at a/l.

    L = rho l/A, C = A l/beta: omega_0 = 1/sqrt(L C) = a/l; 2 zeta omega_0 = R/L = 32 nu/d^2 (Hagen-Poiseuille).
    """
    parts = circuit(
        components={
            "tank": {"type": "tank"}, "pipe": {"type": "pipe", "length": "0.5 m", "diameter": "8 mm"},
            "plug": {"type": "plug"},
        },
        nets={"open": ["tank.port", "pipe.a"], "shut": ["pipe.b", "plug.port"]}, fluid=OIL,
    )  # fmt: skip
    (mode,) = modes(linearize(parts, at=start(parts)))
    assert mode.natural_frequency == pytest.approx(math.sqrt(BETA / RHO) / 0.5, rel=1e-9)
    assert 2 * mode.damping_ratio * mode.natural_frequency == pytest.approx(32 * NU / 8e-3**2, rel=1e-6)


def test_natural_frequency_of_a_cylinder() -> None:
    """omega_h = sqrt(beta/m (A_1^2/V_1 + A_2^2/V_2)): Merritt, Hydraulic Control Systems (1967), chapter 6."""
    parts = circuit(
        components={
            "load": {"type": "mass_with_stops", "mass": "50 kg", "low": "-100 mm", "high": "100 mm",
                     "start": {"x": "0 mm"}},
            "head": {"type": "piston_chamber", "diameter": "40 mm", "dead_volume": "150 cm^3"},
            "rod_side": {"type": "piston_chamber", "diameter": "40 mm", "rod_diameter": "28 mm",
                         "dead_volume": "80 cm^3", "side": "pushes_down"},
            "oil_1": {"type": "variable_capacity"}, "oil_2": {"type": "variable_capacity"},
            "plug_1": {"type": "plug"}, "plug_2": {"type": "plug"},
        },
        nets={"rod": ["load.port", "head.rod", "rod_side.rod"], "c1": ["head.chamber", "oil_1.chamber"],
              "c2": ["rod_side.chamber", "oil_2.chamber"], "p1": ["oil_1.port", "plug_1.port"],
              "p2": ["oil_2.port", "plug_2.port"]},
        fluid=OIL,
    )  # fmt: skip
    a_1, a_2 = math.pi / 4 * 0.04**2, math.pi / 4 * (0.04**2 - 0.028**2)
    expected = math.sqrt(BETA / 50 * (a_1**2 / 150e-6 + a_2**2 / 80e-6))
    model = linearize(parts, at=start(parts))
    assert max(m.damped_frequency for m in modes(model)) == pytest.approx(expected, rel=1e-9)


# -- against differences -------------------------------------------------------------------------


def test_the_jacobian_of_the_crescent_pump_is_that_of_its_equations() -> None:
    """df/dx of every part of the pump against central differences of f: rounding and curvature allow 1e-6."""
    pump = cl.load("crescent_pump")
    result = pump.simulate("2 ms", solver="rodas", rtol=1e-4)
    end = result.trajectory.end
    assert end is not None
    system, p = result.system, result.values.p
    local = Derivatives(system, [], []).at(Point(end.t, end.x, end.h, end.b, p))
    q, f = system.rhs.parameters(p), system.rhs.function
    sizes = np.maximum(np.abs(end.x), system.nominal)
    for k, name in enumerate(system.state_names):
        step = np.zeros(end.x.size)
        step[k] = 1e-6 * sizes[k]
        sides = [np.array(f(end.t, end.x + s * step, end.h, end.b, q)).ravel() for s in (1, -1)]
        difference = (sides[0] - sides[1]) / (2 * step[k])
        rounding = 1e-14 * np.abs(sides[0]) / step[k]
        assert np.all(np.abs(local.f_x[:, k] - difference) <= 1e-6 * np.abs(difference) + rounding + 1e-300), name


@pytest.mark.parametrize(
    ("name", "value", "unit"),
    [("supply", 30.0, "L/min"), ("valve.cracking_pressure", 6.5, "bar"), ("valve.holes.diameter", 5.5, "mm"),
     ("fluid.density", 860.0, "kg/m^3"), ("tank.pressure", 0.0, "bar")],
)  # fmt: skip
def test_b_and_d_give_the_change_of_the_point_of_rest(name: str, value: float, unit: str) -> None:
    """dy/du of the relief valve's point of rest is D - C A^-1 B; central differences of its own point say the same.

    Parameters of the circuit, of a part inside it, of a component, of the fluid. 1e-5: curvature over 2e-4.
    """
    parts, outputs = cl.load("relief_valve"), ["line.p", "valve.x", "loss"]
    model = linearize(parts, inputs=[name], outputs=outputs)
    static = (model.D - model.C @ np.linalg.solve(model.A, model.B))[:, 0]
    step = 1e-4 * (value or 1.0)
    sides = [steady(parts, {name: f"{value + s * step!r} {unit}"}, tolerance=1e-12).result for s in (1, -1)]
    si = model.inputs[0].quantity.factor(unit)
    moved = np.array([(sides[0][o] - sides[1][o])[0] / (2 * step * si) for o in outputs])
    np.testing.assert_allclose(static, moved, rtol=1e-5)


@pytest.mark.parametrize("frequency", [100.0, 700.0, 2500.0])
def test_a_line_with_ticks_answers_as_in_a_simulation(frequency: float) -> None:
    """The response of a circuit with a Lax-Wendroff line against a simulation with a sine of 0.001 L/min.

    Samples just after the ticks from 100 ms on, by when starting waves have died, fitted by a sine. 1e-5: what the
    fit leaves is 0.003 Pa of 5 to 40 Pa.
    """
    point = steady(wave_line())
    outputs = ["first.p", "second.p", "line.a.q", "line.b.q"]
    model = linearize(wave_line(), at=point, inputs=["first"], outputs=outputs)
    omega = 2 * np.pi * frequency
    run = wave_line(f"{frequency} Hz", "0.001 L/min").simulate(
        "150 ms", start=point.snapshot, solver="dopri", rtol=1e-10
    )  # fmt: skip
    after = np.zeros(run.time.size, bool)
    after[run.trajectory.steps.jumps] = True
    after &= run.time > 0.1
    t = run.time[after]
    waves = np.stack([np.ones(t.size), np.cos(omega * t), np.sin(omega * t)], axis=1)
    H = model.response(np.array([omega]))[0, :, 0]
    for k, name in enumerate(outputs):
        _, cosine, sine = np.linalg.lstsq(waves, run[name][after], rcond=None)[0]
        assert complex(sine, cosine) / (1e-3 * LPM) == pytest.approx(H[k], rel=1e-5), name


def test_ticks_leave_no_counter_and_no_copy_of_a_state_in_the_model() -> None:
    """Of line and volumes remain the volumes, the inner nodes and the flows at the ends; all die out."""
    model = linearize(wave_line())
    assert len(model.states) == 2 + 2 * 9 + 2
    assert not any(name in s for s in model.states for name in ("into", "had", "t_node"))
    assert all(m.stable for m in modes(model))
    assert np.abs(np.linalg.eigvals(model.A)).max() < 1


class Sampler(Component):
    """First-order lag whose input is held over each tick: x' = (h - x)/T, h <- u - k x every dt."""

    gain: Ratio = Field(default=0.5, description="feedback")
    u: Ratio = Field(default=0.0, description="input")

    y = gives_signal(Ratio, "the state")
    x = state(Ratio, "state")
    h = state(Ratio, "held input")

    def equations(self, x: Expr, h: Expr) -> Equations:
        return {"y": x, "der_x": h - x, "der_h": 0.0 * h, "tick": every(0.5, h=self.u - self.gain * x)}


def test_sampled_feedback() -> None:
    """x' = h - x, h set to u - k x every T: z = e^-T - k (1 - e^-T) (zero-order hold; Franklin & Powell).

    The state that holds is set anew at each tick, so the map has this eigenvalue and 0.
    """
    parts = circuit(Sampler, components={"part": {"type": "sampler"}}, simulation={"stop": "1 s"})
    model = linearize(parts, at=start(parts), inputs=["part.u"], outputs=["part.x"])
    values = np.sort(np.linalg.eigvals(model.A).real)
    decay = math.exp(-0.5)
    np.testing.assert_allclose(values[np.abs(values).argmax()], decay - 0.5 * (1 - decay), rtol=1e-9)
    assert model.period == 0.5
    # at low frequency u is as good as constant: x = u/(1 + k)
    assert abs(model.response(np.array([1e-6]))[0, 0, 0]) == pytest.approx(1 / 1.5, rel=1e-6)


class Follower(Component):
    """A fast lag that follows the straight line between two samples: x' = k (h0 + (h1 - h0) (t - t_k)/T - x)."""

    x = state(Ratio, "state")
    before = held(Ratio, "last sample")
    ahead = held(Ratio, "next sample")
    count = held(Ratio, "count of ticks", counts=True)

    def equations(self, t: Expr, x: Expr, before: Expr, ahead: Expr, count: Expr) -> Equations:
        line = before + (ahead - before) * (t / 0.5 - count)
        return {"der_x": 1e5 * (line - x), "tick": every(0.5, before=ahead, ahead=-0.5 * x, count=count + 1)}


def test_a_fast_state_follows_what_is_interpolated_between_ticks() -> None:
    """x at a tick is h1 - (h1 - h0)/(k T), its lag behind a ramp (e^-kT is nothing): the rows of x and of h1."""
    parts = circuit(Follower, components={"part": {"type": "follower"}}, simulation={"stop": "1 s"})
    model = linearize(parts, at=start(parts))
    assert model.states == ("part.x", "part.before", "part.ahead")
    lag = 1 / (1e5 * 0.5)
    row = np.array([0, lag, 1 - lag])
    np.testing.assert_allclose(model.A, [row, [0, 0, 1], -0.5 * row], rtol=1e-9, atol=1e-12)
    assert not any("too fast" in said for said in model.warnings)


def test_block_exponential() -> None:
    """Against SciPy's exponential of the whole matrix; 1e-12 of the largest, for the squarings double rounding."""
    rng = np.random.default_rng(1)
    A, B, N = 20 * rng.normal(size=(5, 5)), rng.normal(size=(5, 7)), np.triu(rng.normal(size=(7, 7)), 1)
    whole = expm(np.block([[A, B], [np.zeros((7, 5)), N]]))
    for part, there in zip(block_exponential(A, B, N), (whole[:5, :5], whole[:5, 5:], whole[5:, 5:]), strict=True):
        np.testing.assert_allclose(part, there, atol=1e-12 * np.abs(there).max())


# -- impedance -----------------------------------------------------------------------------------


def test_impedance_of_a_net_and_into_a_port() -> None:
    """A net's impedance is that of all on it, 1/(G + j omega C); into the gap's port it is 1/G."""
    parts = leaking_volume()
    omega = np.array([10.0, 1000.0])
    found = frequency_response(
        parts, at=start(parts), impedances=["line", "gap.a", "volume.port"], omega=omega
    ).transfers  # fmt: skip
    G, C = 10e-3 * 50e-6**3 / (12 * RHO * NU * 20e-3), 50e-6 / BETA
    np.testing.assert_allclose(found[0].value, 1 / (G + 1j * omega * C), rtol=1e-12)
    np.testing.assert_allclose(found[1].value, np.full(2, 1 / G), rtol=1e-12)
    np.testing.assert_allclose(found[2].value, 1 / (1j * omega * C), rtol=1e-12)


def test_one_element_of_a_vector_net() -> None:
    """A flow brought into one of a pump's carried-over volumes moves that volume's pressure."""
    pump = cl.load("crescent_pump")
    end = pump.simulate("4 ms", solver="rodas", rtol=1e-3).trajectory.end
    model = linearize(pump, at=end, inputs=["p_driven[1]"], outputs=["driven.p[1]"])
    assert model.B[model.states.index("driven.p[1]"), 0] > 0
    with pytest.raises(InputError, match=r"p_driven has \d+ elements; name one, for example p_driven\[1\]"):
        linearize(pump, at=end, inputs=["p_driven"], outputs=["driven.p[1]"])
    assert any("no point of rest" in w for w in model.warnings)


# -- never silently zero -------------------------------------------------------------------------


def test_a_mass_on_its_stop_follows_nothing_and_is_named() -> None:
    parts = oscillator("-5 N")
    with pytest.raises(InputError, match=r"push.force does not act on mass.x .*mass.x, mass.v cannot move"):
        linearize(parts, inputs=["push.force"], outputs=["mass.x"])
    model = linearize(parts)
    assert model.still == ("mass.x", "mass.v")
    assert modes(model) == []
    assert any("nothing moves mass.x, mass.v" in w for w in model.warnings)


def test_a_pair_without_a_path_is_named() -> None:
    parts = circuit(
        components={
            "one": {"type": "mass_with_stops", "mass": "1 kg", "low": "-1 mm", "high": "1 mm", "start": {"x": "0 mm"}},
            "two": {"type": "mass_with_stops", "mass": "2 kg", "low": "-1 mm", "high": "1 mm", "start": {"x": "0 mm"}},
            "soft": {"type": "spring", "stiffness": "100 N/m"}, "hard": {"type": "spring", "stiffness": "20000 N/m"},
        },
        nets={"rod_one": ["one.port", "soft.rod"], "rod_two": ["two.port", "hard.rod"]},
    )  # fmt: skip
    model = linearize(parts, at=start(parts), inputs=["rod_one", "rod_two"], outputs=["one.x", "two.x"])
    assert [w for w in model.warnings if "transfer is zero" in w] == [
        "rod_two does not act on one.x here: this transfer is zero",
        "rod_one does not act on two.x here: this transfer is zero",
    ]


class Kink(Component):
    """x' = u - k x with k = 1 above zero and 2 below: frozen between events."""

    u: Ratio = Field(default=0.0, description="input")
    x = state(Ratio, "state")

    def equations(self, x: Expr) -> Equations:
        return {"der_x": self.u - event_where(x > 0, x, 2 * x)}


class Root(Component):
    """x' = -sqrt|x|, whose slope at 0 is infinite."""

    x = state(Ratio, "state")
    size = observable(Ratio, "|x|")

    def equations(self, x: Expr) -> Equations:
        return {"der_x": -(fabs(x) ** 0.5), "size": fabs(x)}


class Reader(Component):
    """Reads a signal."""

    u = takes_signal(Ratio, "what is read")
    x = state(Ratio, "state")

    def equations(self, u: Expr, x: Expr) -> Equations:
        return {"der_x": u - x}


def test_a_point_on_a_boundary_is_one_sided() -> None:
    parts = circuit(Kink, components={"part": {"type": "kink"}})
    model = linearize(parts, at=start(parts), inputs=["part.u"], outputs=["part.x"])
    assert any("one-sided" in w and "part: " in w and "false" in w for w in model.warnings)
    assert model.A[0, 0] == -2
    beside = circuit(Kink, components={"part": {"type": "kink", "u": "1", "start": {"x": "1"}}})
    assert linearize(beside, at=start(beside)).warnings == ()


def test_what_is_not_finite_is_refused() -> None:
    parts = circuit(Root, components={"part": {"type": "root"}})
    beside = circuit(Root, components={"part": {"type": "root", "start": {"x": "1"}}})
    with pytest.raises(SimulationError, match=r"derivative of dpart.x/dt by part.x is not a finite number"):
        linearize(parts, at=replace(start(beside), x=np.zeros(1)))


def test_equations_that_change_with_time_are_named() -> None:
    parts = circuit(
        Reader,
        components={"part": {"type": "reader"}, "sine": {"type": "sine", "amplitude": "1", "frequency": "1 Hz"}},
        nets={"s": ["sine.y", "part.u"]},
    )
    warnings = linearize(parts, at=start(parts)).warnings
    assert any("equations of part.x change with time" in w for w in warnings)


@pytest.mark.parametrize(
    ("inputs", "outputs", "said"),
    [
        (["gap.widht"], ["line.p"], "did you mean gap.width"),
        (["load.hydraulic_diameter"], ["line.p"], "is not given"),
        (["line"], ["line.pp"], "did you mean line.p"),
        (["line.f"], ["line.p"], "no parameter or net"),
        (["line[2]"], ["line.p"], "is a single one"),
        (["line"], ["gap.q[1]"], "single value"),
        (["fluid.kinematic_viscosity"], ["line.p"], "does not act on line.p"),
    ],
)
def test_names_that_are_none(inputs: list[str], outputs: list[str], said: str) -> None:
    parts = leaking_volume()
    with pytest.raises(InputError, match=said):
        linearize(parts, at=start(parts), inputs=inputs, outputs=outputs)


def test_parameters_that_no_equation_contains_and_words() -> None:
    with pytest.raises(InputError, match=r"line.start_pressure: no equation contains it"):
        linearize(wave_line(), at=start(wave_line()), inputs=["line.start_pressure"], outputs=["first.p"])
    with pytest.raises(InputError, match="moves the times of the ticks"):
        linearize(wave_line(), at=start(wave_line()), inputs=["line.max_pressure"], outputs=["first.p"])
    with pytest.raises(InputError, match=r"line.length: this parameter shapes the equations"):
        linearize(wave_line(), at=start(wave_line()), inputs=["line.length"], outputs=["first.p"])
    pump = cl.load("crescent_pump")
    end = pump.simulate("1 ms", solver="rodas", rtol=1e-3).trajectory.end
    with pytest.raises(InputError, match="it is the word 'instantaneous'"):
        linearize(pump, at=end, inputs=["volumes"], outputs=["delivery.p"])


def test_ticks_of_several_periods_are_refused() -> None:
    class Other(Sampler):
        """A sampler of another period."""

        def equations(self, x: Expr, h: Expr) -> Equations:
            return {"y": x, "der_x": h - x, "der_h": 0.0 * h, "tick": every(0.2, h=-x)}

    parts = circuit(Sampler, Other, components={"one": {"type": "sampler"}, "two": {"type": "other"}})
    with pytest.raises(InputError, match=r"several periods \(one.tick every 5e\+05 us, two.tick every 2e\+05 us\)"):
        linearize(parts, at=start(parts))


def test_frequencies_at_which_ticks_cannot_answer() -> None:
    model: LinearModel = linearize(wave_line(), inputs=["first"], outputs=["first.p"])
    with pytest.raises(InputError, match="below half of a sample per tick, 7520 Hz"):
        model.response(np.array([2 * np.pi * 8000]))


def test_bands_and_grids() -> None:
    assert band("1 Hz:2 kHz") == (pytest.approx(2 * np.pi), pytest.approx(4000 * np.pi))
    assert band("10 rad/s : 1e4 rad/s") == (10.0, 1e4)
    for text in ("1 Hz", "2 Hz:1 Hz", "0 Hz:1 Hz", "1 bar:2 bar"):
        with pytest.raises(InputError, match="--frequencies"):
            band(text)
    assert len(grid(1.0, 100.0, 11)) == 11
    with pytest.raises(InputError, match="--points 1"):
        grid(1.0, 2.0, 1)


# -- the command ---------------------------------------------------------------------------------


def test_the_command_prints_and_writes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Text, pictures, and CSV files that say the same as the model in memory."""
    monkeypatch.chdir(tmp_path)
    assert main(["linearize", "relief_valve", "--input", "supply", "--output", "line.p", "--impedance", "p_line",
                 "--frequencies", "10 Hz:1 kHz", "--points", "50", "-o", "valve.csv", "--plot"]) == 0  # fmt: skip
    text = capsys.readouterr().out
    assert "valve.spool.x" in text
    assert "steady, by" in text
    model = linearize(cl.load("relief_valve"), inputs=["supply"], outputs=["line.p"])
    with open("valve.csv", newline="", encoding="utf-8") as file:
        titles, *rows = list(csv.reader(file))
    assert titles[:3] == ["frequency [Hz]", "line.p / supply magnitude [Pa/(m^3/s)]", "line.p / supply phase [deg]"]
    table = np.array(rows, dtype=float)
    H = model.response(2 * np.pi * table[:, 0])[:, 0, 0]
    np.testing.assert_allclose(table[:, 1], np.abs(H), rtol=1e-9)
    np.testing.assert_allclose(np.exp(1j * np.radians(table[:, 2])), H / np.abs(H), atol=1e-9)
    with open("valve-A.csv", newline="", encoding="utf-8") as file:
        matrix = np.array([row[1:] for row in list(csv.reader(file))[1:]], dtype=float)
    np.testing.assert_allclose(matrix, model.A)
    assert sorted(p.name for p in tmp_path.glob("*.png")) == [
        "valve-bode.png", "valve-impedance.png", "valve-poles.png"
    ]  # fmt: skip


def test_the_command_speaks_json(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    options = ["--json", "-o", "valve.json", "--unit", "rad/s", "--points", "20"]
    assert main(["linearize", "relief_valve", "--input", "p_line", "--output", "valve.x", *options]) == 0
    said = json.loads(capsys.readouterr().out)
    model = linearize(cl.load("relief_valve"), inputs=["p_line"], outputs=["valve.x"])
    np.testing.assert_allclose(said["A"], model.A)
    np.testing.assert_allclose(said["B"], model.B)
    assert said["status"] == "done"
    assert said["frequencies"][0] == pytest.approx(2 * np.pi)
    written = json.loads((tmp_path / "valve.json").read_text(encoding="utf-8"))
    assert written["modes"] == said["modes"]
    assert main(["linearize", "relief_valve", "--json", "--at", "20 ms"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["operating_point"]["found_by"] == "simulated to 20 ms"
    assert said["transfers"] == []


def test_the_end_of_a_result_is_an_operating_point(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """`--start` linearises where a run ended, and `--at` goes on from there: by 60 ms the valve rests."""
    monkeypatch.chdir(tmp_path)
    assert main(["simulate", "relief_valve", "--stop", "0.2 ms", "-o", "run.nc", "--quiet"]) == 0
    assert main(["linearize", "relief_valve", "--start", "run.nc"]) == 0
    assert "this is no point of rest" in capsys.readouterr().out
    assert main(["linearize", "relief_valve", "--start", "run.nc", "--at", "60 ms", "--json"]) == 0
    there = json.loads(capsys.readouterr().out)
    np.testing.assert_allclose(there["A"], linearize(cl.load("relief_valve")).A, rtol=1e-3)


def test_the_start_values_and_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """`--at '0 s'` linearises the start values as they are, with a warning; `-o none` writes nothing."""
    monkeypatch.chdir(tmp_path)
    assert main(["linearize", "relief_valve", "--at", "0 s", "-o", "none", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["operating_point"]["time"] == 0
    assert found["operating_point"]["found_by"] == "the start values, at 0 s"
    assert any("this is no point of rest" in warning for warning in found["warnings"])
    assert list(tmp_path.iterdir()) == []
    valve = cl.load("relief_valve")
    begun = valve.simulate("1 ns").trajectory.end  # so soon that nothing has moved yet
    np.testing.assert_allclose(found["A"], linearize(valve, at=begun).A, rtol=1e-3, atol=1e-3)


def test_a_circuit_that_a_sine_drives_is_told_what_to_write(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The advice works: a steady point with the time standing still, then `--start` with its file."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "driven.yaml").write_text(
        "crescentlab: 1\ntitle: Driven\n"
        "fluid: {type: simple_oil, density: 870 kg/m^3, kinematic_viscosity: 46 cSt, bulk_modulus: 1.6 GPa}\n"
        "components:\n"
        "  wave: {type: sine, mean: 20 L/min, amplitude: 5 L/min, frequency: 100 Hz}\n"
        "  pump: {type: signal_flow_source}\n"
        "  line: {type: capacity, volume: 70 cm^3}\n"
        "  hole: {type: orifice, area: 5 mm^2}\n"
        "  tank: {type: tank}\n"
        "nets: {asked: [wave.y, pump.flow], p: [pump.port, line.port, hole.a], t: [hole.b, tank.port]}\n",
        encoding="utf-8",
    )
    assert main(["linearize", "driven.yaml"]) == 2
    said = capsys.readouterr().err
    assert "let the time stand still with crescentlab steady --at T and linearise the file" in said
    assert main(["steady", "driven.yaml", "--at", "2.5 ms", "-o", "point.nc", "--quiet"]) == 0
    assert main(["linearize", "driven.yaml", "--start", "point.nc", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["operating_point"]["time"] == 2.5e-3


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--at", "-1 ms"], "--at -1 ms is before the start, 0 s"),
        (["--at", "5"], "--at 5: a time is a number with its unit; write for example 20 ms"),
        (["--input", "supply"], "--input without --output"),
        (["--output", "line.p"], "--output without --input"),
        (["--exact-lines"], "--exact-lines without a response"),
        (["--exact-lines", "--impedance", "p_line"], "no part of this circuit has an exact law"),
        (["--impedance", "t_line"], "a source holds the pressure of t_line"),
        (["--impedance", "valve.rod"], "this net is not hydraulic"),
        (["--impedance", "p_lime"], "did you mean p_line"),
        (["-o", "valve.nc"], "the suffix '.nc' is none of .csv, .json"),
        (["--frequencies", "1:2"], "--frequencies 1:2"),
        (["--points", "1", "--impedance", "p_line"], "--points 1"),
    ],
)
def test_wrong_options_are_one_sentence(options: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["linearize", "relief_valve", *options]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert "Traceback" not in error


@pytest.mark.parametrize(("supply", "smooth"), [("20 L/min", True), ("30 L/min", False), ("30.003 L/min", False)])
def test_a_parameter_at_a_kink_of_its_expression_is_no_input(supply: str, smooth: bool) -> None:
    """flow = min(supply, 30 L/min): slope 1 below, 0 above, neither at it nor within the step of the differences."""
    bench = circuit(
        parameters={"supply": supply},
        components={
            "pump": {"type": "flow_source", "flow": "= min(supply, 30 L/min)"},
            "line": {"type": "capacity", "volume": "70 cm^3", "start": {"p": "5 bar"}},
            "hole": {"type": "orifice", "area": "10 mm^2"}, "tank": {"type": "tank"},
        },
        nets={"p": ["pump.port", "line.port", "hole.a"], "t": ["hole.b", "tank.port"]}, fluid=OIL,
    )  # fmt: skip
    if smooth:
        assert linearize(bench, inputs=["supply"], outputs=["line.p"]).B.any()
    else:
        with pytest.raises(InputError, match="input supply: at this value an expression of it has a kink or jumps"):
            linearize(bench, inputs=["supply"], outputs=["line.p"])
