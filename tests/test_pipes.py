"""The lumped pipe's causal forms against laminar pipe flow, lumped eigenfrequencies and the mass balance."""

import math

import numpy as np
import pytest
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
