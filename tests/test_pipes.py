"""The lumped pipe's causal forms against laminar flow, lumped eigenfrequencies and the balances of mass and energy."""

import math

import numpy as np
import pytest
from building import circuit
from crescentlab.components.fluids import AeratedOil, SimpleOil
from crescentlab.components.pipes import (
    Pipe,
    PipeCapacitiveCapacitive,
    PipeCapacitiveInertial,
    PipeInertialCapacitive,
    PipeInertialInertial,
)
from scipy.integrate import solve_ivp

from crescentlab.domain import State

BAR, LPM = 1e5, 1e-3 / 60
FORMS = [PipeInertialInertial, PipeCapacitiveCapacitive, PipeCapacitiveInertial, PipeInertialCapacitive]
OIL = SimpleOil(density=860, kinematic_viscosity=35e-6, bulk_modulus=1.4e9)
THIN = SimpleOil(density=860, kinematic_viscosity=1e-12, bulk_modulus=1.4e9)
PUMP_OIL = AeratedOil(
    density=860, kinematic_viscosity=35e-6, bulk_modulus=1.4e9, air_fraction=0.005, saturation_pressure=1e8
)
SIZE = {"length": 0.72, "diameter": 12e-3}
AREA = math.pi / 4 * 12e-3**2


def states(form):
    return [s.name for s in form.declared(State)]


def derivative(pipe, x, ends, fluid):
    """dx/dt of a form for its states and its inputs at a and b, and all it returned."""
    names = states(type(pipe))
    inputs = {port.inputs()[0][0]: value for port, value in zip(pipe.ports(), ends, strict=True)}
    found = pipe.equations(**dict(zip(names, x, strict=True)), **inputs, fluid=fluid)
    return np.array([found[f"der_{n}"] for n in names]), found


def flows(pipe, found, ends):
    """Flow into the pipe at a and b."""
    pairs = zip(pipe.ports(), ends, strict=True)
    return [end if port.role == "gives" else found[f"q_{port.name}"] for port, end in pairs]


def test_forms_cover_every_choice_of_ends():
    """One form for each choice of what the two ends give."""
    roles = {tuple(p.role for p in form.ports()) for form in Pipe.forms()}
    assert roles == {(a, b) for a in ("gives", "takes") for b in ("gives", "takes")}
    for form in FORMS:
        assert states(form)[:2] == ["p", "q"]


@pytest.mark.parametrize("form", FORMS)
def test_steady_laminar_flow(form):
    """Hagen-Poiseuille: 10 L/min need 128 mu l q/(pi d^4) = 7097.1 Pa over 0.72 m (Re = 505); steady to 1e-5."""
    pipe, q = form(**SIZE), 10 * LPM
    drop = 128 * 860 * 35e-6 * 0.72 * q / (math.pi * 12e-3**4)
    assert drop == pytest.approx(7097.1, abs=0.1)
    high, low = 5 * BAR + drop / 2, 5 * BAR - drop / 2
    stiff = SimpleOil(density=860, kinematic_viscosity=35e-6, bulk_modulus=1e15)
    x, ends = {
        PipeInertialInertial: ([5 * BAR, q, 0.0], (high, low)),
        PipeCapacitiveCapacitive: ([5 * BAR, q, drop], (q, -q)),
        PipeCapacitiveInertial: ([high, q], (q, low)),
        PipeInertialCapacitive: ([low, q], (high, -q)),
    }[form]
    rate, found = derivative(pipe, x, ends, stiff)
    inertance = 860 * 0.72 / AREA
    assert rate * inertance / drop == pytest.approx(0.0, abs=1e-5)
    assert flows(pipe, found, ends) == pytest.approx([q, -q], rel=1e-12)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("level", [-0.5 * BAR, 0.0, 5 * BAR])
def test_content_takes_up_exactly_what_flows_in(form, level):
    """d(content)/dt = q_a + q_b, by central differences of the content; 1e-5 for the differences."""
    pipe = form(**SIZE, loss_coefficient=0.5, roughness="10 um")
    x = np.array([level, 2e-4, 3e-5 if form is PipeInertialInertial else 2e3][: len(states(form))])
    ends = tuple(
        value if port.role == "takes" else flow
        for port, value, flow in zip(pipe.ports(), (level + 1e4, level), (2.5e-4, -1.5e-4), strict=True)
    )
    rate, found = derivative(pipe, x, ends, PUMP_OIL)
    h = 1.0 / np.max(np.abs(rate))
    after, before = (derivative(pipe, x + sign * h * rate, ends, PUMP_OIL)[1]["content"] for sign in (1, -1))
    assert (after - before) / (2 * h) == pytest.approx(sum(flows(pipe, found, ends)), rel=1e-5)


@pytest.mark.parametrize(
    ("form", "factor"),
    [
        (PipeInertialInertial, 2.0),
        (PipeCapacitiveCapacitive, 2.0),
        (PipeCapacitiveInertial, 1.0),
        (PipeInertialCapacitive, 1.0),
    ],
)
def test_eigenfrequency(form, factor):
    """Without friction omega = a/l for one capacity and one inertia, 2 a/l for T and pi; a = sqrt(beta/rho)."""
    pipe = form(**SIZE)
    n = len(states(form))
    scale = np.array([1.0, 1e-9, 1e-9 if form is PipeInertialInertial else 1.0])[:n]
    columns = [derivative(pipe, scale * np.eye(n)[k], (0.0, 0.0), THIN)[0] / scale[k] for k in range(n)]
    omega = np.max(np.abs(np.linalg.eigvals(np.array(columns).T).imag))
    assert omega == pytest.approx(factor * math.sqrt(1.4e9 / 860) / 0.72, rel=1e-4)


def test_wave_speed_of_aerated_oil():
    """With flow as mass flow over rho_0 the lumps keep a = sqrt(beta/rho) at 6 bar exactly: omega = a/l."""
    pipe = PipeInertialCapacitive(**SIZE)
    stiffness = derivative(pipe, [6 * BAR, 1e-9], (6 * BAR, 0.0), PUMP_OIL)[0][0] / 1e-9
    inertia = derivative(pipe, [6 * BAR, 0.0], (6 * BAR + 1.0, 0.0), PUMP_OIL)[0][1]
    a = math.sqrt(PUMP_OIL.bulk_modulus(6 * BAR) / PUMP_OIL.density(6 * BAR))
    assert math.sqrt(stiffness * inertia) == pytest.approx(a / 0.72, rel=1e-9)


def test_closed_end_swings_to_twice_the_step():
    """p = P (1 - cos(omega t)) behind a frictionless inertia: 2 P after half a period, to 1e-3."""
    pipe, step = PipeInertialCapacitive(**SIZE), 1e3
    omega = math.sqrt(1.4e9 / 860) / 0.72
    run = solve_ivp(
        lambda t, x: derivative(pipe, x, (step, 0.0), THIN)[0], (0, math.pi / omega), [0.0, 0.0], rtol=1e-9, atol=1e-12
    )
    assert run.y[0, -1] == pytest.approx(2 * step, rel=1e-3)


def test_losses_use_the_dynamic_head():
    """K = 1.5 in 11 mm at 54 L/min: v = 9.47 m/s, 1.5 rho v^2/2 = 57.8 kPa on top of the friction."""
    q, area = 54 * LPM, math.pi / 4 * 11e-3**2
    bare, lossy = (
        derivative(PipeInertialCapacitive(length=0.13, diameter=11e-3, loss_coefficient=k), [0.0, q], (0.0, -q), OIL)[0]
        for k in (0.0, 1.5)
    )
    assert (bare[1] - lossy[1]) * 860 * 0.13 / area == pytest.approx(1.5 * 860 * (q / area) ** 2 / 2, rel=1e-9)


# -- energy ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("level", [-0.5 * BAR, 0.0, 5 * BAR])
def test_what_enters_is_stored_or_lost(form, level):
    """dE/dt = sum rho_0 q w(p) - loss far from rest too, by central differences of the energy; 1e-5 for those.

    Steps of 1 bar at ends of aerated oil at half the atmosphere's pressure, where its density changes by a percent.
    """
    pipe = form(**SIZE, loss_coefficient=0.5, roughness="10 um")
    x = np.array([level, 2e-4, 3e-5 if form is PipeInertialInertial else 2e3][: len(states(form))])
    ends = tuple(
        value if port.role == "takes" else flow
        for port, value, flow in zip(pipe.ports(), (level + 1e5, level), (2.5e-4, -1.5e-4), strict=True)
    )
    rate, found = derivative(pipe, x, ends, PUMP_OIL)
    h = 1.0 / np.max(np.abs(rate))
    after, before = (derivative(pipe, x + sign * h * rate, ends, PUMP_OIL)[1]["stored_energy"] for sign in (1, -1))
    pressures = [
        found[f"p_{port.name}"] if port.role == "gives" else end for port, end in zip(pipe.ports(), ends, strict=True)
    ]
    entering = [
        PUMP_OIL.rho_0 * q * PUMP_OIL.enthalpy(p) for p, q in zip(pressures, flows(pipe, found, ends), strict=True)
    ]
    size = sum(map(abs, entering)) + abs(found["loss"])
    assert (after - before) / (2 * h) == pytest.approx(sum(entering) - found["loss"], abs=1e-5 * size)


LIQUID = {"type": "simple_oil", "density": "860 kg/m^3", "kinematic_viscosity": "35 cSt", "bulk_modulus": "1.4 GPa"}
WIDE = {"type": "pipe", "length": "2 m", "diameter": "100 m"}
"""So wide that its walls take nothing: friction is 1e-8 of the motion's energy in 20 ms."""
FULL = 0.5 * 860 * 2 * math.pi / 4 * 100**2
"""Its energy of motion at 1 m/s [J]."""


def ringing(vessels, level, line=None, viscosity="1e-3 cSt", stop="20 ms"):
    """A pipe, of 1 m/s if none is given, from `level` between two like vessels, or plugs, left to itself."""
    end = {"type": "capacity", "start": {"p": level}} | vessels if vessels else {"type": "plug"}
    start = {"start": {"p": level, "q": f"{math.pi / 4 * 100**2} m^3/s"}}
    parts = circuit(
        components={"left": end, "right": end, "line": line or WIDE | start},
        nets={"a": ["left.port", "line.a"], "b": ["line.b", "right.port"]},
        fluid=LIQUID | {"kinematic_viscosity": viscosity},
    )
    return parts.simulate(solver="rodas", stop=stop, rtol=1e-10)


@pytest.mark.parametrize("level", ["100 bar", "300 bar"])
@pytest.mark.parametrize("vessels", [{}, {"volume": "2000 m^3"}], ids=["capacitive", "inertial"])
def test_what_rings_without_friction_keeps_its_energy(level, vessels):
    """At any mean pressure, but for the convective term: (v/a)^2 = 6e-7 of 1/2 m v^2 over a swing, within 5 of that.

    With the inertia of mass flow alone, 1/2 rho_0 l q^2/A, it would be p/beta, 2e-2 at 300 bar.
    """
    result = ringing(vessels, level)
    names = ["line", "left", "right"] if vessels else ["line"]
    energy = sum(result[f"{name}.stored_energy"] for name in names) / FULL
    drop = result["line.drop"] if not vessels else result["a.p"] - result["b.p"]
    assert np.ptp(drop) > 10 * BAR
    assert np.ptp(energy) < 5 * 860 / 1.4e9


def test_friction_takes_all_the_motion():
    """From 50 mm/s in 10 mm bore between plugs to rest: 1/2 rho A l v^2 = 169 uJ turned into heat.

    To 1e-4: half of (v/a)^2 stays as pressure, e^-14 as motion, and the solver's tolerance is 1e-10.
    """
    area, v = math.pi / 4 * 0.01**2, 0.05
    result = ringing(
        {}, "0 bar", {"type": "pipe", "length": "2 m", "diameter": "10 mm", "start": {"q": f"{area * v} m^3/s"}},
        "46 cSt", stop="1 s",
    )  # fmt: skip
    energy = result.balance.energy
    assert energy.dissipated["line"] == pytest.approx(0.5 * 860 * area * 2 * v**2, rel=1e-4)
    assert energy.dissipated["line"] == pytest.approx(-energy.stored, rel=1e-6)


def test_ledger_closes_where_a_valve_shuts():
    """Reservoir, pipe and a valve that shuts within 1 ms: to 1e-6 of what passes, of fluid and of energy."""
    parts = circuit(
        components={
            "reservoir": {"type": "pressure_source", "pressure": "100 bar"},
            "line": {"type": "pipe", "length": "0.72 m", "diameter": "12 mm", "start": {"p": "100 bar"}},
            "shutting": {"type": "ramp", "before": "1", "after": "0", "at": "20 ms", "duration": "1 ms"},
            "valve": {"type": "variable_orifice", "area": "10 mm^2"},
            "tank": {"type": "tank"},
        },
        nets={"inlet": ["reservoir.port", "line.a"], "outlet": ["line.b", "valve.a"], "back": ["valve.b", "tank.port"],
              "share": ["shutting.y", "valve.opening"]},
        fluid=LIQUID,
    )  # fmt: skip
    result = parts.simulate(stop="50 ms", solver="rodas", rtol=1e-9)
    assert result["outlet.p"].max() > 130 * BAR
    assert max(result.balance.components.values()) < 1e-6
    assert max(result.balance.energy.components.values()) < 1e-6
