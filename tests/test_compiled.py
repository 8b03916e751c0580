"""The compiled loop and compiled functions: the methods' orders, the sparse LU, the cache, and what happens without a
compiler. What all solvers must do alike stands in test_solvers.py and test_hybrid.py."""

from __future__ import annotations

import ctypes
import os
import re
import stat
import time
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from building import alone, circuit
from pydantic import Field
from scipy import sparse

import crescentlab as cl
from crescentlab import compiler
from crescentlab.c_text import wide_sources
from crescentlab.component import Component
from crescentlab.domain import observable, state
from crescentlab.errors import CompilerError
from crescentlab.maths import cos, event_where, exp, sin
from crescentlab.solvers import integrate as integration
from crescentlab.solvers import loop, native, promotion
from crescentlab.solvers.elimination import elimination
from crescentlab.units import Ratio

ORDERS = {"rodas": 4, "dopri": 5}
PARTS = {
    "pump": {"type": "flow_source", "flow": "30 L/min"}, "line": {"type": "capacity", "volume": "70 cm^3"},
    "hole": {"type": "orifice", "area": "10 mm^2"}, "tank": {"type": "tank"},
}  # fmt: skip
NETS = {"p": ["pump.port", "line.port", "hole.a"], "t": ["hole.b", "tank.port"]}
OIL = {"type": "simple_oil", "density": "870 kg/m^3", "kinematic_viscosity": "40 cSt", "bulk_modulus": "1.6 GPa"}


@pytest.fixture
def own_cache(tmp_path, monkeypatch):
    """An empty cache."""
    monkeypatch.setenv("CRESCENTLAB_CACHE", str(tmp_path))
    return tmp_path


@pytest.fixture
def no_compiler(monkeypatch):
    """A machine without a C compiler."""
    monkeypatch.setattr(compiler, "command", lambda: ())
    native.library.cache_clear()
    yield
    native.library.cache_clear()


def plain(name, start=0.0):
    """A state without unit."""
    return state(Ratio, name, start=start, nominal=1.0)


# -- the methods ---------------------------------------------------------------------------------


class Turning(Component):
    """A nonlinear pair driven in time: radius exp(sin t), angle t + sin(2 t)/2, and a pull back to that solution."""

    x = plain("x", 1.0)
    y = plain("y", 0.0)

    def equations(self, t, x, y):
        grow, turn = cos(t), 1 + cos(2 * t)
        pull = (x * x + y * y) * exp(-2 * sin(t)) - 1  # zero on the solution
        return {"der_x": (grow - pull) * x - turn * y, "der_y": (grow - pull) * y + turn * x}


def exact(t):
    """Solution of :class:`Turning`."""
    return np.exp(np.sin(t)) * np.cos(t + np.sin(2 * t) / 2)


@pytest.mark.parametrize(("solver", "steps"), [("rodas", (0.01, 0.005, 0.0025)), ("dopri", (0.04, 0.02, 0.01))])
def test_order_of_convergence(solver, steps):
    """Halving fixed steps divides the error by 2^order: Hairer & Wanner IV.7 (RODAS), Dormand & Prince (1980).

    0.3 is what is left of the next order's term at these steps. The fourth-order term of RODAS is so small that with
    longer steps the fifth-order one hides it.
    """
    errors = []
    for step in steps:
        result = alone(Turning).simulate(2.0, solver=solver, rtol=0.5, max_step=step)
        assert result.trajectory.statistics.steps == pytest.approx(2.0 / step, abs=3)
        errors.append(np.max(np.abs(result["part.x"] - exact(result.time))))
    observed = np.log2(errors[:-1]) - np.log2(errors[1:])
    assert observed[-1] == pytest.approx(ORDERS[solver], abs=0.3)


@pytest.mark.parametrize(("solver", "order"), [("rodas", 3), ("dopri", 4)])
def test_order_between_the_steps(solver, order):
    """The polynomials are of one order less (local error h^(order + 1)): sampled on a fine grid between the steps."""
    errors = []
    for step in (0.04, 0.02, 0.01):
        result = alone(Turning).simulate(2.0, solver=solver, rtol=0.5, max_step=step, output_step=1e-3)
        errors.append(np.max(np.abs(result["part.x"] - exact(result.time))))
    observed = np.log2(errors[:-1]) - np.log2(errors[1:])
    assert observed[-1] > order + 0.6


@pytest.mark.parametrize("solver", ORDERS)
@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-8])
def test_the_tolerance_is_kept(solver, rtol):
    """Errors of each step add up over two time units, and grow with the solution (by e): below a hundred tolerances."""
    result = alone(Turning).simulate(2.0, solver=solver, rtol=rtol)
    assert np.max(np.abs(result["part.x"] - exact(result.time))) < 100 * rtol


class Chemistry(Component):
    """Robertson's reaction: rates from 0.04 to 3e7, the classic stiff problem."""

    a = plain("a", 1.0)
    b = plain("b", 0.0)
    c = plain("c", 0.0)

    def equations(self, a, b, c):
        made = 0.04 * a - 1e4 * b * c
        return {"der_a": -made, "der_b": made - 3e7 * b * b, "der_c": 3e7 * b * b}


def test_robertson():
    """At t = 40: 0.7158, 9.185e-6, 0.2842; Hairer & Wanner (1996), section IV.10. Their sum stays 1.

    Two hundred steps suffice, of which a method that is not L-stable would need a hundred thousand.
    """
    result = alone(Chemistry).simulate(40.0, solver="rodas", rtol=1e-8)
    last = [result[f"part.{name}"][-1] for name in "abc"]
    np.testing.assert_allclose(last, [0.7158270688, 9.185534765e-6, 0.2841637457], rtol=1e-6)
    assert sum(last) == pytest.approx(1.0, abs=1e-12)
    assert result.trajectory.statistics.steps < 1000


# -- linear algebra ------------------------------------------------------------------------------


def random_pattern(n, density, seed):
    """A random sparse matrix with the nonzeros of a Jacobian, by columns."""
    made = sparse.random_array((n, n), density=density, rng=np.random.default_rng(seed), format="csc")
    made.sort_indices()
    return sparse.csc_matrix(made)


@pytest.mark.parametrize(("n", "density"), [(1, 1.0), (2, 0.0), (7, 0.3), (40, 0.05), (40, 1.0), (300, 0.01)])
def test_sparse_lu_solves(n, density):
    """(shift I - J) v = r as numpy's dense solver has it, to rounding (the matrix is well conditioned)."""
    jacobian = random_pattern(n, density, n)
    found = elimination(jacobian)
    run = native.Run()
    run.n, run.nonzeros = n, jacobian.nnz
    arrays = {name: np.asarray(getattr(found, name), np.int64) for name in ("row", "column", "diagonal", "order")}
    arrays["place"] = np.append(found.place, 0).astype(np.int64)
    run.give(
        **arrays, jacobian=np.append(jacobian.data, 0.0), lu=np.zeros(found.column.size), inverse=np.zeros(n),
        lu_work=np.zeros(n),
    )  # fmt: skip
    library = native.library()
    shift, right = 2.0 * n, np.random.default_rng(0).normal(size=n)
    assert library.factorise(ctypes.byref(run), ctypes.c_double(shift)) == 0
    v = right.copy()
    library.solve(ctypes.byref(run), ctypes.c_void_p(v.ctypes.data))
    np.testing.assert_allclose(v, np.linalg.solve(shift * np.eye(n) - jacobian.todense(), right), rtol=1e-10)


def test_a_chain_brings_no_fill():
    """A tridiagonal matrix of 500 rows keeps its 1498 entries, in whatever order its rows are numbered."""
    n = 500
    shuffled = np.random.default_rng(3).permutation(n)
    chain = sparse.diags_array([np.ones(n - 1), np.ones(n), np.ones(n - 1)], offsets=[-1, 0, 1]).tocsc()
    assert elimination(sparse.csc_matrix(chain[shuffled][:, shuffled])).column.size == 3 * n - 2


# -- compiled functions --------------------------------------------------------------------------


@pytest.mark.parametrize("solver", ["rodas", "dopri", "lsoda", "radau"])
def test_what_the_cache_has_changes_no_bit(solver, own_cache, monkeypatch):
    """The same operations in the same order: equal to the last bit, or the cache's state would be seen in results."""
    monkeypatch.setattr(promotion, "PATIENCE", 0.0)
    monkeypatch.setattr("crescentlab.solvers.compiled.LOOK", 0.0)
    monkeypatch.setattr("crescentlab.solvers.loop.LOOK", 0.0)
    system = cl.load("relief_valve").system()
    for name in ("rhs", "jacobian", "linear", "relation", "relation_on_state", "condition", "remap", "remap_events"):
        compiler.build(promotion.Promotion(system, [name], None, 0.5).source(name))
    results = [
        cl.load("relief_valve").simulate(stop="5 ms", solver=solver, compile=compile) for compile in (False, None)
    ]
    for interpreted, compiled in zip(*(r.trajectory.steps.arrays() for r in results), strict=True):
        np.testing.assert_array_equal(interpreted, compiled)


@pytest.mark.parametrize("solver", ["rodas", "dopri", "lsoda", "radau"])
def test_functions_compiled_on_request(solver):
    """Last digits move, and the steps with them: the difference stays below a hundredth of the tolerance."""
    results = [
        cl.load("relief_valve").simulate(
            stop="5 ms", solver=solver, compile=compile, rtol=1e-7, output_step="10 us"
        )["p_line.p"] for compile in (False, True)
    ]  # fmt: skip
    np.testing.assert_allclose(results[0], results[1], rtol=1e-9)


def numbers(low, high, count=4000):
    """Numbers of all magnitudes between two, and what lies at the edges of the ordinary."""
    spread = np.geomspace(low, high, count) if low > 0 else np.linspace(low, high, count)
    return np.concatenate([spread, np.random.default_rng(2).uniform(low, high, count)])


SLOW = {
    "exp": (lambda x: ca.exp(x[0]), [numbers(-700.0, 700.0)], 2),
    "log": (lambda x: ca.log(x[0]), [numbers(1e-300, 1e300)], 2),
    "pow": (lambda x: x[0] ** x[1], [numbers(1e-3, 1e3), numbers(-3.0, 3.0)], 24),
}  # fmt: skip
STRANGE = np.array([0.0, -0.0, 1.0, -1.0, -2.5, np.inf, -np.inf, np.nan, 5e-324, 1e-310, 1e308, 800.0, -800.0])


def in_vectors(law, columns):
    """Values of the law over the columns, 11 rows a call: a full vector, and one with empty lanes."""
    x = ca.SX.sym("x", 11, len(columns))
    rows = [law([x[k, j] for j in range(len(columns))]) for k in range(11)]
    function = ca.Function("slow", [x], [ca.vertcat(*rows)])
    built = ca.external("slow", str(compiler.build(compiler.Source(wide_sources(function), compiler.NATIVE))))
    padded = [np.append(c, np.full(-c.size % 11, 1.0)).reshape(-1, 11) for c in columns]
    made = [np.array(built(np.stack(part, axis=1))).ravel() for part in zip(*padded, strict=True)]
    return np.concatenate(made)[: columns[0].size]


@pytest.mark.parametrize("name", SLOW)
def test_vectors_are_as_exact_as_they_say(name):
    """exp, log within 2 units in the last place of numpy's, pow(x, p) within 2 + |p log x|, here 3 ln 1000 = 21."""
    law, columns, units = SLOW[name]
    exact = getattr(np, "power" if name == "pow" else name)(*columns)
    assert np.max(np.abs(in_vectors(law, columns) - exact) / np.spacing(np.abs(exact))) <= units


@pytest.mark.parametrize("name", SLOW)
def test_vectors_of_strange_numbers(name):
    """Zeros, infinities, what is no number, subnormals, overflow: as the C library answers them."""
    law, columns, _ = SLOW[name]
    grid = np.meshgrid(*[STRANGE] * len(columns))
    strange = [g.ravel() for g in grid]
    with np.errstate(all="ignore"):
        exact = getattr(np, "power" if name == "pow" else name)(*strange)
    np.testing.assert_allclose(in_vectors(law, strange), exact, rtol=1e-12)


def test_another_value_needs_no_compiler(own_cache, monkeypatch):
    """Parameters enter as numbers: what was compiled for one value serves every other."""
    cl.load("relief_valve").simulate(stop="1 ms", solver="rodas", compile=True)
    assert len(list(own_cache.glob("*.so"))) > 5
    monkeypatch.setattr(compiler.subprocess, "Popen", None)
    result = cl.load("relief_valve").simulate(
        stop="1 ms", solver="rodas", compile=True, parameters={"supply": "48 L/min", "line.volume": "71 cm^3"}
    )
    assert result.trajectory.solver == "rodas (compiled loop, compiled functions)"
    assert not result.trajectory.warnings


def test_what_the_cache_has_is_used_unasked(own_cache, monkeypatch):
    """The second process pays nothing for what the first compiled beside a long run; a short one does not even look."""
    run = circuit(components=PARTS, nets=NETS, fluid=OIL)
    compiler.build(promotion.Promotion(run.system(), ["rhs"], None, 0.5).source("rhs"))
    monkeypatch.setattr("crescentlab.solvers.compiled.LOOK", 0.0)

    def ran(compile):
        made = circuit(components=PARTS, nets=NETS, fluid=OIL)
        return made.simulate(1.0, solver="rodas", compile=compile, max_step=1e-4).trajectory.solver

    monkeypatch.setattr(promotion, "PATIENCE", np.inf)
    assert "interpreted" in ran(None)
    monkeypatch.setattr(promotion, "PATIENCE", 0.0)
    assert "compiled functions" in ran(None)
    assert "interpreted" in ran(False)


def test_a_long_run_is_compiled_beside_itself(own_cache, monkeypatch):
    """Once compiling pays, functions change over in the middle of a run, and nobody can tell from its numbers."""
    monkeypatch.setattr(promotion, "SECONDS", 1e-9)
    monkeypatch.setattr(promotion, "PATIENCE", 0.0)
    monkeypatch.setattr("crescentlab.solvers.compiled.LOOK", 1e-4)

    def long_run(compile):
        made = circuit(components=PARTS, nets=NETS, fluid=OIL)
        return made.simulate(100.0, solver="rodas", max_step=2e-4, compile=compile).trajectory

    promoted, interpreted = long_run(None), long_run(False)
    assert promoted.solver.endswith("compiled functions)")
    np.testing.assert_array_equal(promoted.steps.x, interpreted.steps.x)


def test_a_run_that_ends_first_stops_its_compiler(own_cache, monkeypatch):
    """Nobody waits for a compiler whose work is no longer needed, and it leaves nothing behind."""
    monkeypatch.setattr(promotion, "SECONDS", 1e-9)
    monkeypatch.setattr(promotion, "PATIENCE", 0.0)
    monkeypatch.setattr("crescentlab.solvers.compiled.LOOK", 1e-4)
    begun = time.perf_counter()
    cl.load("crescent_pump").simulate(stop="40 ms", solver="rodas")
    assert time.perf_counter() - begun < 5  # left alone, the compiler takes twice as long
    assert [path for path in own_cache.iterdir() if path.is_dir()] == []


# -- without a compiler, or with a poor one ------------------------------------------------------


def test_without_a_compiler_functions_are_interpreted(no_compiler):
    """One line says so; unasked, none does."""
    run = circuit(components=PARTS, nets=NETS, fluid=OIL)
    (said,) = run.simulate(1e-3, solver="lsoda", compile=True).trajectory.warnings
    assert said == "functions are interpreted: no C compiler found (cc, gcc, clang, or what the variable CC names)"
    assert run.simulate(1e-3, solver="lsoda").trajectory.warnings == []


@pytest.mark.parametrize(("asked", "instead"), [("rodas", "auto (lsoda)"), ("dopri", "rk45 (rk45)")])
def test_without_a_compiler_another_solver_runs(no_compiler, asked, instead):
    """The notice names both, and the summary the one that ran."""
    trajectory = circuit(components=PARTS, nets=NETS, fluid=OIL).simulate(1e-3, solver=asked).trajectory
    assert trajectory.solver == instead
    assert trajectory.warnings[0].startswith(f"{asked} needs a C compiler, {instead} ran instead: no C compiler found")


def test_a_compiler_that_fails_is_quoted(own_cache):
    """Its first error, not its whole output."""
    with pytest.raises(CompilerError, match=r"failed: broken\.c:1.*error"):
        compiler.build(compiler.Source({"broken.c": "double f(void) { return }"}))
    assert list(own_cache.iterdir()) == []


@pytest.mark.skipif(os.geteuid() == 0, reason="nothing is closed to root")
def test_a_cache_that_cannot_be_written(tmp_path, monkeypatch):
    """Said by name."""
    tmp_path.chmod(stat.S_IRUSR | stat.S_IXUSR)
    monkeypatch.setenv("CRESCENTLAB_CACHE", str(tmp_path / "inner"))
    with pytest.raises(CompilerError, match="cannot be used"):
        compiler.build(compiler.Source({"fine.c": "int f(void) { return 1; }"}))


def test_a_cache_that_is_a_file(tmp_path, monkeypatch):
    """Said by name."""
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("CRESCENTLAB_CACHE", str(tmp_path / "file"))
    with pytest.raises(CompilerError, match="file cannot be used"):
        compiler.build(compiler.Source({"fine.c": "int f(void) { return 1; }"}))


def test_the_key_is_the_content(own_cache):
    """Other text, other flags: another library; the same: the same."""
    one = compiler.Source({"one.c": "int f(void) { return 1; }"})
    other = compiler.Source({"one.c": "int f(void) { return 2; }"})
    assert len({compiler.place(one), compiler.place(other), compiler.place(compiler.Source(one.texts, ("-O0",)))}) == 3
    assert compiler.build(one) == compiler.place(one) == compiler.build(one)


def test_cc_names_the_compiler(monkeypatch):
    """As make has it; a name that is no program means none."""
    compiler.command.cache_clear()
    monkeypatch.setenv("CC", "gcc -m64")
    assert compiler.command() == ("gcc", "-m64")
    compiler.command.cache_clear()
    monkeypatch.setenv("CC", "no-such-compiler")
    assert compiler.command() == ()
    compiler.command.cache_clear()


# -- who runs what -------------------------------------------------------------------------------


class Buzz(Component):
    """A fast oscillator: steps without end."""

    omega: Ratio = Field(default=1e3, description="angular frequency")
    x = plain("x", 1.0)
    v = plain("v", 0.0)

    def equations(self, x, v):
        return {"der_x": self.omega * v, "der_v": -self.omega * x}


def test_auto_hands_a_long_run_to_the_compiled_loop(monkeypatch):
    """By a count of steps: the same run goes the same way every time; a tight tolerance stays with SciPy."""
    monkeypatch.setattr(loop, "MANY_STEPS", 3000)
    long = alone(Buzz).simulate(2.0, rtol=1e-5)
    assert long.trajectory.solver.startswith("auto: rodas (compiled loop")
    assert long["part.x"][-1] == pytest.approx(np.cos(2e3), abs=0.1)
    assert alone(Buzz).simulate(0.2, rtol=1e-5).trajectory.solver == "auto (lsoda)"
    assert alone(Buzz).simulate(2.0, rtol=1e-8).trajectory.solver == "auto (lsoda)"


def test_a_run_ends_before_it_fills_the_memory(monkeypatch):
    """What was computed is kept, and the message says how large it is, what took the steps and what takes less."""
    monkeypatch.setattr("crescentlab.solvers.compiled.MOST_BYTES", 1_000_000)
    for solver, advice in (("dopri", r"an implicit solver \(--solver rodas\)"), ("rodas", "a larger rtol")):
        trajectory = alone(Buzz).simulate(20.0, solver=solver, check=False).trajectory
        assert trajectory.status == "failed"
        said = rf"steps, most of them limited by part\.\w, fill 0\.0 GB; take {advice}, or simulate a shorter time$"
        assert re.search(said, trajectory.error), trajectory.error
        assert 0 < trajectory.steps.t[-1] < 20


def test_auto_stays_with_scipy_without_a_compiler(monkeypatch, no_compiler):
    """And says nothing: nobody asked for another."""
    monkeypatch.setattr(loop, "MANY_STEPS", 3000)
    trajectory = alone(Buzz).simulate(2.0, rtol=1e-5).trajectory
    assert (trajectory.solver, trajectory.warnings) == ("auto (lsoda)", [])


def test_every_compiled_method_has_one_to_run_instead():
    """The names of the loop's C are those of the command line."""
    assert set(native.METHODS) == set(integration.INSTEAD) == set(native.SHAPES)


def test_the_loop_is_read_from_its_header():
    """Each field once, none left out: the size is checked against the compiler's when the library is loaded."""
    names = [name for name, _ in native.Run._fields_]
    assert len(names) == len(set(names))
    header = Path(loop.__file__).parent / "c" / "run.h"
    assert header.read_text(encoding="utf-8").count(";") > len(names) > 100
    assert ctypes.sizeof(native.Run) == 8 * len(names)


@pytest.mark.parametrize("solver", ORDERS)
@pytest.mark.parametrize("rtol", [1e-3, 1e-4, 1e-5, 1e-6, 1e-7])
def test_a_valve_at_rest_costs_nothing(solver, rtol):
    """The force on the resting spool is rounding and changes sign at every step: no such turning is searched for.

    Seven evaluations a step, twice as many for what events and rejected steps cost; the pressure is that of LSODA at
    1e-9, to ten tolerances.
    """
    result = cl.load("relief_valve").simulate(solver=solver, rtol=rtol)
    statistics = result.trajectory.statistics
    assert result.time[-1] == 0.05
    assert np.all(np.diff(result.time) >= 0)
    assert statistics.evaluations < 14 * (statistics.steps + statistics.rejected)
    exact = cl.load("relief_valve").simulate(solver="lsoda", rtol=1e-9)["p_line.p"][-1]
    assert result["p_line.p"][-1] == pytest.approx(exact, rel=10 * rtol)


@pytest.mark.parametrize("solver", ORDERS)
@pytest.mark.parametrize("name", ["water_hammer", "relief_valve"])
def test_shipped_circuits_as_radau_has_them(name, solver):
    """All pressures on a grid of 10 us within a hundred tolerances of Radau's at 1e-9, and the same events."""
    run = cl.load(name)
    exact = run.simulate(solver="radau", rtol=1e-9, output_step="10 us")
    found = run.simulate(solver=solver, rtol=1e-6, output_step="10 us")
    assert [h.names for h in found.trajectory.happenings] == [h.names for h in exact.trajectory.happenings]
    for pressure in [n for n in exact.names if n.endswith(".p")]:
        scale = max(float(np.max(np.abs(exact[pressure]))), 1e5)
        np.testing.assert_allclose(found[pressure], exact[pressure], rtol=0, atol=1e-4 * scale)


class Indicator(Component):
    """Says when x has passed a level, and nothing listens."""

    x = plain("x", 0.0)
    passed = observable(Ratio, "1 once x is above 0.3")

    def equations(self, t, x):
        return {"der_x": cos(t), "passed": event_where(x > 0.3, 1.0, 0.0)}


@pytest.mark.parametrize("solver", ORDERS)
def test_a_switch_that_only_shows_is_located(solver):
    """x = sin t passes 0.3 at asin 0.3: located like any other root, although neither f nor an event needs it."""
    result = alone(Indicator).simulate(1.0, solver=solver, rtol=1e-9)
    first = int(np.argmax(result["part.passed"] > 0.5))
    assert result.time[first] == pytest.approx(np.arcsin(0.3), abs=1e-8)


def test_a_kink_crossed_within_its_tolerance():
    """Delivery passes the cover's knot at 6 bar, where its rate falls by a hundredth: a step that ends between the
    tolerances of both rates must settle all the same (it did not, 45.9 ms after the start)."""
    settings = {"speed": "4000 rpm", "throttle_area": "37.17 mm^2"}
    result = cl.load("crescent_pump").simulate(stop="150 ms", solver="dopri", rtol=1e-4, parameters=settings)
    assert result.time[-1] == 0.15


def test_a_compiler_that_mixes_lanes_up_is_kept_from_it():
    """GCC 12 with AVX-512 took a neighbour's factor in a long line's tick (8e-8 of a density, 20 Pa): no more than the
    rounding of both forms may lie between them, 1e-9 of the pressure."""
    line = {
        "type": "lax_wendroff_line", "diameter": "20 mm", "length": "10 m", "max_pressure": "35 bar",
        "start_pressure": "20 bar", "start_flow": "18.8496 L/min",
    }  # fmt: skip
    wave = {"type": "sine", "mean": "-18.8496 L/min", "amplitude": "1 L/min", "frequency": "150 Hz"}
    water_hammer = circuit(
        components={
            "reservoir": {"type": "pressure_source", "pressure": "20 bar"}, "line": line, "wave": wave,
            "valve": {"type": "signal_flow_source"},
        },
        nets={"p_r": ["reservoir.port", "line.a"], "p_v": ["line.b", "valve.port"], "q": ["wave.y", "valve.flow"]},
        fluid={**OIL, "kinematic_viscosity": "10 cSt"},
    )  # fmt: skip
    runs = [water_hammer.simulate("10 ms", solver="rodas", compile=compiled) for compiled in (False, True)]
    assert "compiled functions" in runs[1].trajectory.solver
    assert len(runs[0].time) == len(runs[1].time)
    assert np.abs(runs[0]["p_v.p"] - runs[1]["p_v.p"]).max() < 1e-9 * 20e5


def pushed_by_noise(solver: str) -> tuple[str, float]:
    """Solver, and relative error of the energy of 1 kg on 1000 N/m after 2 s of noise that changes every millisecond.

    Between two changes the motion is known: a matrix exponential over each millisecond.
    """
    run = circuit(
        components={
            "mass": {"type": "mass", "mass": "1 kg", "start": {"x": "10 mm"}},
            "spring": {"type": "spring", "stiffness": "1000 N/m"},
            "noise": {"type": "noise", "standard_deviation": "0.1 N", "sample_time": "1 ms"},
            "force": {"type": "signal_force_source"},
        },
        nets={"rod": ["mass.port", "spring.rod", "force.rod"], "f": ["noise.y", "force.force"]},
        simulation={"stop": "2 s"},
    ).simulate(solver=solver)
    h, w = 1e-3, np.sqrt(1000.0)
    pushed = run["noise.y"][np.searchsorted(run.time, (np.arange(2000) + 0.5) * h) - 1]
    turn = np.array([[np.cos(w * h), np.sin(w * h) / w], [-w * np.sin(w * h), np.cos(w * h)]])
    push = np.array([(1 - np.cos(w * h)) / w**2, np.sin(w * h) / w])
    x = np.array([0.01, 0.0])
    for force in pushed:
        x = turn @ x + push * force
    exact = 500 * x[0] ** 2 + x[1] ** 2 / 2
    return run.trajectory.solver, (500 * run["mass.x"][-1] ** 2 + run["mass.v"][-1] ** 2 / 2) / exact - 1


def test_auto_hands_a_run_of_many_restarts_to_the_compiled_loop():
    """A method with memory loses 1e-4 of the energy and more in 2000 restarts at an rtol of 1e-6, rodas nothing."""
    solver, error = pushed_by_noise("auto")
    assert solver.startswith("auto: rodas")
    assert abs(error) < 1e-6
    assert abs(pushed_by_noise("lsoda")[1]) > 1e-5
