"""Every solver and matrix layout against analytic answers; tolerances, nominal values, runs continued past a bound."""

from __future__ import annotations

import gc
import math
import sys
import threading
import types

import numpy as np
import pytest
from building import OIL, alone, circuit, fired
from pydantic import Field
from scipy import sparse
from scipy.optimize import brentq
from scipy.special import expi

from crescentlab.component import Component
from crescentlab.domain import held, state
from crescentlab.errors import InputError
from crescentlab.maths import cos, sin, stack, total, when, where
from crescentlab.solvers import scipy as steppers
from crescentlab.solvers import sundials
from crescentlab.solvers.functions import Functions
from crescentlab.solvers.integrate import integrate
from crescentlab.solvers.options import Options
from crescentlab.solvers.scipy import banded, choose
from crescentlab.solvers.steppers import stepper
from crescentlab.units import Flow, Pressure, Ratio

SOLVERS = ["auto", "lsoda", "bdf", "radau", "rk45", "dop853", "cvode", "rodas", "dopri"]
IMPLICIT = ["auto", "lsoda", "bdf", "radau", "cvode", "rodas"]
LAYOUTS = {
    "lsoda dense": ("lsoda", "dense"), "lsoda banded": ("lsoda", "banded"), "bdf dense": ("bdf", "dense"),
    "bdf sparse": ("bdf", "sparse"), "radau dense": ("radau", "dense"), "radau sparse": ("radau", "sparse"),
    "rk45": ("rk45", "dense"), "dop853": ("dop853", "dense"), "cvode dense": ("cvode", "dense"),
    "cvode banded": ("cvode", "banded"), "cvode sparse": ("cvode", "sparse"),
}  # fmt: skip
"""Every method with every layout it knows."""


def plain(name, start=0.0, **more):
    """A state without unit."""
    return state(Ratio, name, start=start, nominal=1.0, **more)


@pytest.fixture(params=list(LAYOUTS))
def layout(request, monkeypatch):
    """Forces a method and a layout whatever the size."""
    monkeypatch.setattr(steppers, "choose", lambda name, functions: LAYOUTS[request.param])
    return request.param


# -- analytic answers ----------------------------------------------------------------------------


@pytest.mark.parametrize("solver", SOLVERS)
def test_volume_emptied_through_a_laminar_gap(solver):
    r"""RC decay of oil from 100 bar into a tank.

    The mass flow is b h^3 p/(12 nu l); with rho = rho_0 exp(p/beta), dp/dt = -(p/tau) exp(-p/beta), so
    t = tau (Ei(p_0/beta) - Ei(p/beta)), tau = V nu rho_0 12 l/(beta b h^3): nearly exp(-t/tau), 1 % apart.
    rtol 1e-8 of 1 bar nominal, kept to 1e-6 by every solver.
    """
    width, height, length, volume, beta = 10e-3, 50e-6, 10e-3, 100e-6, 1.4e9
    parts = {
        "volume": {"type": "capacity", "volume": "100 cm^3", "start": {"p": "100 bar"}}, "tank": {"type": "tank"},
        "gap": {"type": "laminar_gap", "width": "10 mm", "height": "50 um", "length": "10 mm"},
    }  # fmt: skip
    nets = {"p": ["volume.port", "gap.a"], "t": ["gap.b", "tank.port"]}
    tau = volume * 35e-6 * 860 * 12 * length / (beta * width * height**3)
    result = circuit(components=parts, nets=nets, fluid=OIL).simulate(2 * tau, solver=solver, rtol=1e-8)
    k = 1 / beta
    for fraction in (0.25, 0.5, 1.0):
        j = int(fraction * (result.time.size - 1))
        t = result.time[j]
        exact = brentq(lambda p, t=t: tau * (expi(k * 1e7) - expi(k * p)) - t, 1e4, 1.01e7, xtol=1e-3, rtol=1e-14)
        assert result["volume.p"][j] == pytest.approx(exact, rel=1e-6)
    assert result["volume.p"][-1] == pytest.approx(1e7 * math.exp(-2), rel=0.02)


@pytest.mark.parametrize("solver", SOLVERS)
def test_undamped_oscillator(solver):
    """10 mm on 400 N/m and 1 kg: x = 10 mm cos 20 t; after five periods within 1e-4 of the amplitude at rtol 1e-8."""
    parts = {
        "mass": {"type": "mass_with_stops", "mass": "1 kg", "low": "-1 m", "high": "1 m", "start": {"x": "10 mm"}},
        "spring": {"type": "spring", "stiffness": "400 N/m"},
    }
    result = circuit(components=parts, nets={"rod": ["mass.port", "spring.rod"]}).simulate(
        10 * math.pi / 20, solver=solver, rtol=1e-8
    )
    np.testing.assert_allclose(result["mass.x"], 0.01 * np.cos(20 * result.time), atol=1e-6)
    np.testing.assert_allclose(result["mass.v"], -0.2 * np.sin(20 * result.time), atol=2e-5)


class StiffDecay(Component):
    """x' = -L (x - cos t) - sin t, whose solution is cos t + exp(-L t)."""

    rate: Ratio = Field(default=5000.0, description="L")
    x = plain("x", 2.0)

    def equations(self, t, x):
        return {"der_x": -self.rate * (x - cos(t)) - sin(t)}


@pytest.mark.parametrize("solver", SOLVERS)
def test_stiff_decay(solver):
    """Prothero and Robinson (1974), L = 5000 1/s; implicit solvers need few steps for it, explicit ones thousands."""
    result = alone(StiffDecay).simulate(1.0, solver=solver, rtol=1e-7)
    exact = np.cos(result.time) + np.exp(-5000 * result.time)
    np.testing.assert_allclose(result["part.x"], exact, atol=5e-6)
    steps = result.trajectory.statistics.steps
    assert steps < 500 if solver in IMPLICIT else steps > 500


class Row(Component):
    """n cells that exchange with their neighbours and with zero at both ends, numbered in strides of `stride`."""

    n: int = Field(default=10, ge=1, description="number of cells")
    stride: int = Field(default=7, ge=1, description="place of the next cell; prime to n")
    x = plain("content", size="n", start=lambda c: c.mode(1) + 0.5 * c.mode(3))

    def places(self):
        return [k * self.stride % self.n for k in range(self.n)]

    def mode(self, m):
        """The m-th eigenvector, sin(m pi (k + 1)/(n + 1)) for the k-th cell of the row."""
        x = np.zeros(self.n)
        x[self.places()] = np.sin(m * np.pi * np.arange(1, self.n + 1) / (self.n + 1))
        return x

    def rate(self, m):
        """Its decay, 4 sin^2(m pi/(2 (n + 1)))."""
        return 4 * math.sin(m * math.pi / (2 * (self.n + 1))) ** 2

    def exact(self, t):
        """Both modes, decayed."""
        return self.mode(1) * math.exp(-self.rate(1) * t) + 0.5 * self.mode(3) * math.exp(-self.rate(3) * t)

    def equations(self, x):
        row = [x[k] for k in self.places()]
        ends = [0.0, *row, 0.0]
        der = dict(zip(self.places(), (ends[k] - 2 * ends[k + 1] + ends[k + 2] for k in range(self.n)), strict=True))
        return {"der_x": stack(*[der[k] for k in range(self.n)])}


def test_every_layout_solves_the_same_row(layout):
    """30 cells in a stirred order, modes 1 and 3 of the discrete diffusion; 1e-6 at rtol 1e-8."""
    part = Row(n=30)
    result = alone(Row, n=30).simulate(20.0, rtol=1e-8)
    np.testing.assert_allclose(result["part.x"][-1], part.exact(20.0), atol=1e-6)
    middle = result.time.size // 2
    np.testing.assert_allclose(result["part.x"][middle], part.exact(result.time[middle]), atol=1e-6)
    statistics = result.trajectory.statistics
    assert (statistics.jacobians > 0) == (layout not in ("rk45", "dop853"))


def chain(n):
    """n volumes of 10 cm^3 between two tanks, joined by n + 1 laminar gaps; named so that neighbours lie apart."""
    names = [f"v{k * 7 % n}" for k in range(n)]
    gap = {"type": "laminar_gap", "width": "10 mm", "height": "50 um", "length": "10 mm"}
    parts = {"first": {"type": "tank"}, "last": {"type": "tank"}}
    for k in range(n):
        pressure = 1000 * math.sin(math.pi * (names.index(f"v{k}") + 1) / (n + 1))
        parts[f"v{k}"] = {"type": "capacity", "volume": "10 cm^3", "start": {"p": f"{pressure!r} Pa"}}
    parts.update({f"g{k}": gap for k in range(n + 1)})
    ports = ["first.port", *[f"{name}.port" for name in names], "last.port"]
    nets = {}
    for k, port in enumerate(ports):
        nets[f"n{k}"] = [port, *([f"g{k - 1}.b"] if k > 0 else []), *([f"g{k}.a"] if k <= n else [])]
    return circuit(components=parts, nets=nets, fluid=OIL), names


def test_a_chain_of_300_volumes_and_gaps(monkeypatch):
    r"""LSODA with the banded matrix found by reordering, against the discrete diffusion and against the full matrix.

    At 0.01 bar the oil is linear to 1e-6: dp/dt = (p_(k-1) - 2 p_k + p_(k+1))/tau, tau = 12 nu rho l V/(beta b h^3),
    and a sine over the chain decays as exp(-4 sin^2(pi/(2 (n + 1))) t/tau).
    """
    n, tau = 300, 10e-6 * 35e-6 * 860 * 12 * 10e-3 / (1.4e9 * 10e-3 * (50e-6) ** 3)
    run, names = chain(n)
    system = run.system()
    functions = Functions(system, system.values(run.design()))
    assert choose("auto", functions) == choose("lsoda", functions) == ("lsoda", "banded")
    assert banded(functions.pattern)[1:] == (1, 1)
    stop = 4000 * tau
    found = run.simulate(stop, rtol=1e-9)
    sine = 1000 * np.sin(np.pi * np.arange(1, n + 1) / (n + 1))
    exact = sine * math.exp(-4 * math.sin(math.pi / (2 * (n + 1))) ** 2 * stop / tau)
    np.testing.assert_allclose([found[f"{name}.p"][-1] for name in names], exact, rtol=2e-5)
    monkeypatch.setattr(steppers, "choose", lambda name, functions: ("lsoda", "dense"))
    full = run.simulate(stop, rtol=1e-9)
    np.testing.assert_allclose([full[f"{name}.p"][-1] for name in names], exact, rtol=2e-5)
    assert found.trajectory.statistics.evaluations < 2 * full.trajectory.statistics.evaluations


@pytest.mark.parametrize("solver", ["bdf", "auto", "cvode"])
def test_a_large_row(solver):
    """1500 cells in a stirred order: sparse BDF, banded CVODE and LSODA (auto), against the discrete diffusion."""
    run, part = alone(Row, n=1500, stride=7), Row(n=1500, stride=7)
    system = run.system()
    functions = Functions(system, system.values(run.design()))
    taken = {"bdf": ("bdf", "sparse"), "auto": ("lsoda", "banded"), "cvode": ("cvode", "banded")}
    assert choose(solver, functions) == taken[solver]
    stop = 0.5 / part.rate(1)
    result = run.simulate(stop, solver=solver, rtol=1e-6)
    np.testing.assert_allclose(result["part.x"][-1], part.exact(stop), atol=2e-4)
    assert result.trajectory.statistics.evaluations < 1500  # by differences one Jacobian alone would take more


class Star(Component):
    """n cells around a hub: no order of the states has a narrow band."""

    n: int = Field(default=400, ge=1, description="cells around the hub")
    x = plain("cells", size="n")
    hub = plain("hub", 1.0)

    def equations(self, x, hub):
        return {"der_x": hub - x, "der_hub": total(x) - self.n * hub}


def test_a_large_circuit_without_a_band_is_integrated_sparse():
    """A hub of 1 spreads over n + 1 cells: hub (1 + n E)/(n + 1), cells (1 - E)/(n + 1), E = exp(-(n + 1) t)."""
    n, run = 400, alone(Star)
    system = run.system()
    functions = Functions(system, system.values(run.design()))
    assert choose("auto", functions) == ("bdf", "sparse")
    result = run.simulate(0.05, rtol=1e-8)
    fast = np.exp(-(n + 1) * result.time)
    np.testing.assert_allclose(result["part.hub"], (1 + n * fast) / (n + 1), atol=1e-6)
    np.testing.assert_allclose(result["part.x"], np.repeat(((1 - fast) / (n + 1))[:, None], n, 1), atol=1e-6)


# -- the Jacobian is ours ------------------------------------------------------------------------


@pytest.mark.parametrize("solver", IMPLICIT)
def test_the_exact_jacobian_is_used(solver):
    """With 61 states in one band differences would cost 61 evaluations a matrix; ours costs none."""
    result = alone(Star, n=60).simulate(1.0, solver=solver)
    statistics = result.trajectory.statistics
    assert statistics.jacobians > 0
    per_step = {"radau": 9, "rodas": 6}.get(solver, 4)
    tried = statistics.steps + statistics.rejected
    assert statistics.evaluations < per_step * tried + 60


@pytest.mark.parametrize("name", ["dense", "banded", "sparse"])
def test_layouts_hold_the_same_matrix(name):
    """Each layout unpacked is the dense matrix of second differences, in the order of its states."""
    run = alone(Row, n=11, stride=4)
    system = run.system()
    values = system.values(run.design())
    functions = Functions(system, values)
    made = steppers.Stepper("bdf" if name == "sparse" else "lsoda", functions, 1e-6, np.ones(11), name)
    places = Row(n=11, stride=4).places()
    expected = np.zeros((11, 11))
    for k, place in enumerate(places):
        expected[place, place] = -2
        if k:
            expected[place, places[k - 1]] = expected[places[k - 1], place] = 1
    x = values.x0
    matrix = made.options["jac"](0.0, made.inner(x))
    if name == "banded":
        assert matrix.shape == (3, 11)
        packed, matrix = matrix, np.zeros((11, 11))
        for i in range(11):
            for j in range(max(0, i - 1), min(11, i + 2)):
                matrix[made.order[i], made.order[j]] = packed[i - j + made.upper, j]
    np.testing.assert_array_equal(np.asarray(matrix.todense()) if name == "sparse" else matrix, expected)


def test_states_return_from_a_reordered_band_in_their_own_order():
    """inner and outer are inverses; path and interpolant give states in the circuit's order."""
    run = alone(Row, n=11, stride=4)
    system = run.system()
    values = system.values(run.design())
    made = steppers.Lsoda("lsoda", Functions(system, values), 1e-8, np.full(11, 1e-8), "banded")
    np.testing.assert_array_equal(made.outer(made.inner(values.x0)), values.x0)
    made.restart(0.0, values.x0, 1.0)
    made.step(0.01)
    np.testing.assert_allclose(made.interpolant()(made.t), made.x, rtol=1e-12)
    np.testing.assert_allclose(made.path()(np.array([made.t]))[0], made.x, rtol=1e-12)
    np.testing.assert_allclose(made.rate(), made.functions.rhs(made.t, made.x), atol=1e-5)


# -- continued past a bound ----------------------------------------------------------------------


class Swing(Component):
    """x'' = -x, from (1, 0): cos t."""

    x = plain("x", 1.0)
    v = plain("v")

    def equations(self, x, v):
        return {"der_x": v, "der_v": -x}


def stepped(solver, bounds, rtol=1e-8):
    """The stepper sent from bound to bound without a restart."""
    run = alone(Swing)
    system = run.system()
    values = system.values(run.design())
    made = stepper(solver, Functions(system, values), rtol, rtol * system.nominal)
    made.restart(0.0, values.x0, bounds[0])
    for bound in bounds:
        while made.t < bound:
            made.step(bound)
            assert made.t <= bound
        assert made.t == bound
    return made


@pytest.mark.parametrize("solver", SOLVERS)
def test_continuing_past_a_bound_is_as_good_as_one_go(solver):
    """A bound is met to the last bit and moved on without a restart: cos 20 as in one go.

    LSODA keeps a critical time of its own; were it not moved along, the run would overshoot or stand still.
    """
    through, halting = stepped(solver, [20.0]), stepped(solver, [0.1, 1.0, 1.5, 7.3, 7.3000001, 20.0])
    np.testing.assert_allclose(through.x, [math.cos(20), -math.sin(20)], atol=5e-6)
    np.testing.assert_allclose(halting.x, [math.cos(20), -math.sin(20)], atol=5e-6)
    assert halting.functions.evaluations < 1.6 * through.functions.evaluations + 60


class Watched(Component):
    """The same swing, with events that change nothing."""

    x = plain("x", 1.0)
    v = plain("v")
    n = held(Ratio, "count")

    def equations(self, x, v, n):
        return {"der_x": v, "der_v": -x, "up": when(x > 0.3, n=n + 1), "down": when(v < -0.3, n=n + 1)}


@pytest.mark.parametrize("solver", SOLVERS)
def test_events_that_change_nothing_do_not_disturb(solver):
    """Found and counted, but the integrator runs on: no restart, the accuracy of an undisturbed run."""
    result = alone(Watched).simulate(20.0, solver=solver, rtol=1e-8)
    statistics = result.trajectory.statistics
    assert statistics.restarts == 0
    assert len(fired(result, "part.up")) == 4
    assert len(fired(result, "part.down")) == 4
    expected = [2 * math.pi * k - math.acos(0.3) for k in (1, 2, 3)]
    assert fired(result, "part.up")[1:] == pytest.approx(expected, abs=1e-5)
    np.testing.assert_allclose(result["part.x"], np.cos(result.time), atol=1e-5)


# -- tolerances ----------------------------------------------------------------------------------


@pytest.mark.parametrize("solver", SOLVERS)
def test_the_error_follows_rtol(solver):
    """From 1e-4 over 1e-6 to 1e-8 the error of cos t over twelve periods falls tenfold or more, below 3000 rtol."""
    errors = []
    for rtol in (1e-4, 1e-6, 1e-8):
        result = alone(Swing).simulate(24 * math.pi, solver=solver, rtol=rtol)
        errors.append(np.abs(result["part.x"] - np.cos(result.time)).max())
    assert errors[0] > 10 * errors[1] > 100 * errors[2]
    assert errors[1] < 3e-3
    assert errors[2] < 3e-5


class TwoScales(Component):
    """The same swing twice: a flow of 1 L/min and a pressure of 1 bar, in SI ten orders of magnitude apart."""

    q = state(Flow, "flow", start=1e-3 / 60)
    dq = state(Flow, "its partner")
    p = state(Pressure, "pressure", start=1e5)
    dp = state(Pressure, "its partner")

    def equations(self, q, dq, p, dp):
        return {"der_q": dq, "der_dq": -q, "der_p": dp, "der_dp": -p}


@pytest.mark.parametrize("solver", SOLVERS)
def test_nominal_values_make_the_absolute_tolerance(solver):
    """Both come out with the same relative error: each is measured against its own nominal value."""
    run = alone(TwoScales)
    np.testing.assert_allclose(run.system().nominal, [1e-3 / 60, 1e-3 / 60, 1e5, 1e5])
    result = run.simulate(6 * math.pi, solver=solver, rtol=1e-6)
    flow = np.abs(result["part.q"] / (1e-3 / 60) - np.cos(result.time)).max()
    pressure = np.abs(result["part.p"] / 1e5 - np.cos(result.time)).max()
    assert flow == pytest.approx(pressure, rel=0.02)
    assert flow < 3e-4


def test_a_flow_alone_is_not_below_the_tolerance():
    """A state of 1e-9 m^3/s, with a nominal of its own, is integrated as well as one of 1."""

    class Drop(Component):
        """x' = -x at 1e-9."""

        x = state(Flow, "drop", start=1e-9, nominal=1e-9)

        def equations(self, x):
            return {"der_x": -x}

    result = alone(Drop).simulate(1.0)
    assert result["part.x"][-1] == pytest.approx(1e-9 * math.exp(-1), rel=1e-5)


# -- a hybrid problem ----------------------------------------------------------------------------


class Ball(Component):
    """A ball that rebounds with 0.7 of its speed and rests once that is below 0.1."""

    x = plain("height", 1.0)
    v = plain("speed")
    resting = held(Ratio, "1 on the floor")

    def equations(self, x, v, resting):
        rebound = -0.7 * v
        slow = rebound < 0.1
        return {
            "der_x": where(resting == 0, v, 0.0), "der_v": where(resting == 0, -9.81, 0.0),
            "bounce": when((resting == 0) & (x < 0), x=0.0, v=where(slow, 0.0, rebound), resting=where(slow, 1.0, 0.0)),
        }  # fmt: skip


@pytest.mark.parametrize("solver", SOLVERS)
def test_all_solvers_bounce_alike(solver):
    """Eleven bounces at t_1 (1 + 2 (e + e^2 + ...)), the last at rest: one root finder serves all solvers."""
    result = alone(Ball).simulate(3.0, solver=solver, rtol=1e-8)
    t1, speed = math.sqrt(2 / 9.81), math.sqrt(2 * 9.81)
    count = math.ceil(math.log(0.1 / speed) / math.log(0.7))
    expected = [t1 * (1 + 2 * sum(0.7**k for k in range(1, n + 1))) for n in range(count)]
    assert fired(result, "part.bounce") == pytest.approx(expected, rel=1e-6)
    assert count == 11
    assert (result["part.x"][-1], result["part.v"][-1]) == (0.0, 0.0)
    assert result.trajectory.statistics.restarts == count


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_run_from_another_start_time(solver):
    """Times count from the start that is given; an autonomous system does not notice."""
    run = alone(Swing)
    system = run.system()
    trajectory = integrate(system, system.values(run.design()), Options(start=5.0, stop=8.0, rtol=1e-8, solver=solver))
    t, x, _, _ = trajectory.steps.arrays()
    assert (t[0], t[-1]) == (5.0, 8.0)
    np.testing.assert_allclose(x[:, 0], np.cos(t - 5), atol=1e-5)


# -- CVODE ---------------------------------------------------------------------------------------


def cvode(component, layout="dense", rtol=1e-8, **parameters):
    """A CVODE stepper at the beginning of a run of 20 s, and the values of the run."""
    run = alone(component, **parameters)
    system = run.system()
    values = system.values(run.design())
    made = sundials.Cvode(Functions(system, values), rtol, rtol * system.nominal, layout)
    made.restart(0.0, values.x0, 20.0)
    return made


@pytest.mark.parametrize("layout", ["dense", "banded", "sparse"])
def test_cvode_is_given_the_exact_matrix(layout):
    """Second differences in the order of its states: full, also for the banded solver, or the nonzeros by columns."""
    made, places = cvode(Row, layout, n=11, stride=4), Row(n=11, stride=4).places()
    expected = np.zeros((11, 11))
    for k, place in enumerate(places):
        expected[place, place] = -2
        if k:
            expected[place, places[k - 1]] = expected[places[k - 1], place] = 1
    if layout == "banded":
        assert (made.lower, made.upper) == (1, 1)
        expected = expected[np.ix_(made.order, made.order)]
    if layout == "sparse":
        expected = expected.T[expected.T != 0]
    matrix = np.zeros_like(expected)
    made.fill(0.0, made.y, made.y, matrix)
    np.testing.assert_array_equal(matrix, expected)


def test_a_sparse_cvode_that_never_stepped_is_freed():
    """Its sparse solver would take the interpreter down, had it never factorised a matrix."""
    for _ in range(20):
        cvode(Star, "sparse", n=50)
        gc.collect()


def test_cvode_takes_the_matrix_that_suits():
    """Full while small, banded where narrow, else sparse."""
    found = {}
    for name, part, n in (("small", Star, 40), ("narrow", Row, 100), ("wide", Star, 100)):
        run = alone(part, n=n)
        system = run.system()
        found[name] = choose("cvode", Functions(system, system.values(run.design())))
    assert found == {"small": ("cvode", "dense"), "narrow": ("cvode", "banded"), "wide": ("cvode", "sparse")}


@pytest.mark.parametrize("layout", ["dense", "banded"])
def test_the_interpolant_of_cvode_is_its_own(layout):
    """Kept and read after more steps, it gives what CVODE itself gave within the step, to rounding; so the rate."""
    made = cvode(Row, layout, n=11, stride=4)
    kept = []
    for _ in range(60):
        low, start = made.t, made.x
        made.step(20.0)
        times = np.linspace(low, made.t, 9)
        own = np.array([made.outer(made.cvode.step(t, "normal").y) for t in times[:-1].tolist()] + [made.x])
        made.cvode.step(made.t, "normal", made.t)
        np.testing.assert_allclose(made.interpolant()(float(times[3])), own[3], atol=1e-14)
        np.testing.assert_allclose(own[0], start, atol=1e-14)
        np.testing.assert_allclose(made.rate(), made.functions.rhs(made.t, made.x), atol=1e-7)
        kept.append((made.path(), times, own))
    assert made.t > 1.0
    for path, times, own in kept:
        np.testing.assert_allclose(path(times), own, atol=1e-14)


@pytest.mark.parametrize("growth", [sundials.GROWTH, 0.0])
def test_cvode_moves_on_past_a_bound_without_a_start(growth, monkeypatch):
    """Seven bounds, one start; were steps to grow faster than is known, it would begin anew at a bound, as accurate."""
    starts = []
    begin = sundials.Cvode.begin
    monkeypatch.setattr(sundials, "GROWTH", growth)
    monkeypatch.setattr(sundials.Cvode, "begin", lambda self, t, y: (starts.append(t), begin(self, t, y)))
    made = stepped("cvode", [0.1, 1.0, 1.5, 7.3, 7.3000001, 19.0, 20.0])
    np.testing.assert_allclose(made.x, [math.cos(20), -math.sin(20)], atol=5e-6)
    assert starts == [0.0] if growth else len(starts) > 4


def test_a_moving_bound_does_not_cut_the_steps_of_cvode():
    """Kept to 0.1 at a time a slow decay takes steps of 0.1, but for those of its start."""
    made = cvode(StiffDecay, rtol=1e-4, rate=0.01)
    sizes = []
    while made.t < 10:
        low = made.t
        made.step(low + 0.1)
        sizes.append(made.t - low)
    np.testing.assert_allclose(sizes[20:], 0.1, rtol=1e-9)


def test_bounds_as_close_as_the_clock_allows():
    """Bounds of one and of some hundred units in the last place apart are met, and the run goes on."""
    made = cvode(Swing)
    bounds = [1.0, 1.0 + 2**-52, 1.0 + 2**-44, 1.0 + 2**-35, 1.0 + 2**-30, 2.0]
    for bound in bounds:
        while made.t < bound:
            made.step(bound)
        assert made.t == bound
        np.testing.assert_allclose(made.x, [math.cos(bound), -math.sin(bound)], atol=1e-6)
        np.testing.assert_allclose(made.rate(), [-math.sin(bound), -math.cos(bound)], atol=1e-5)


class Pole(Component):
    """x' = x^2 from 1: 1/(1 - t)."""

    x = plain("x", 1.0)

    def equations(self, x):
        return {"der_x": x**2}


def test_a_failure_of_cvode_is_an_error_and_not_a_print(capfd):
    """No step leads past the pole: the run ends there with the state's name, and nothing reaches the terminal."""
    result = alone(Pole).simulate(2.0, solver="cvode", check=False)
    assert result.trajectory.status == "failed"
    assert "part.x" in result.trajectory.error
    assert result.time[-1] == pytest.approx(1.0, abs=1e-3)
    assert capfd.readouterr() == ("", "")


def test_an_interruption_passes_through_cvode(capfd):
    """What the user interrupts is interrupted, and standard output is what it was."""
    made, output = cvode(Swing), sys.stdout

    def interrupted(t, y):
        raise KeyboardInterrupt

    made.rhs = interrupted
    with pytest.raises(KeyboardInterrupt):
        made.step(1.0)
    assert sys.stdout is output
    assert made.t == 0.0
    assert capfd.readouterr() == ("", "")


def test_what_other_threads_print_during_a_step_is_seen(capsys):
    """CVODE's own messages are kept back, those of others are not."""
    made = cvode(Swing)
    f = made.rhs

    def talking(t, y):
        thread = threading.Thread(target=print, args=("seen",))
        thread.start()
        thread.join()
        print("unseen")
        return f(t, y)

    made.rhs = talking
    made.step(1e-6)
    out = capsys.readouterr().out
    assert "seen\n" in out
    assert "unseen" not in out


def test_a_full_matrix_of_many_rows_is_refused():
    """Three thousand parts that all meet one: LSODA would ask for 9 million numbers; the message says what to write."""
    functions = types.SimpleNamespace(
        n=3001, pattern=sparse.csc_matrix(sparse.random_array((3001, 3001), density=0.01))
    )
    with pytest.raises(InputError, match=r"lsoda needs a full matrix of 3001 x 3001 .* write bdf or cvode"):
        choose("lsoda", functions)
    assert choose("auto", functions) == ("bdf", "sparse")
