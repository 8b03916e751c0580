"""Functions evaluated at many points by numpy are those that CasADi evaluates."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

import crescentlab as cl
from crescentlab.columns import BLOCK, FEW, OPERATIONS, Columns
from crescentlab.prepared import prepare
from crescentlab.system import System

X, Y, P = ca.SX.sym("x"), ca.SX.sym("y"), ca.SX.sym("p")
UNARY = [
    ca.exp, ca.log, ca.sqrt, ca.sin, ca.cos, ca.tan, ca.asin, ca.acos, ca.atan, ca.sinh, ca.cosh, ca.tanh, ca.asinh,
    ca.acosh, ca.atanh, ca.fabs, ca.sign, ca.floor, ca.ceil, ca.expm1, ca.log1p, ca.logic_not, lambda x: -x,
    lambda x: x * x, lambda x: 2 * x, lambda x: 1 / x,
]  # fmt: skip
BINARY = [
    ca.fmin, ca.fmax, ca.atan2, ca.fmod, ca.hypot, ca.copysign, ca.power, ca.logic_and, ca.logic_or,
    lambda x, y: x + y, lambda x, y: x - y, lambda x, y: x * y, lambda x, y: x / y, lambda x, y: x < y,
    lambda x, y: x <= y, lambda x, y: x == y, lambda x, y: x != y, lambda x, y: x**2.5 + y**-1.5,
    lambda x, y: ca.if_else(x > y, x, ca.sqrt(y)),
]  # fmt: skip


def sets(points: int) -> list[np.ndarray]:
    """Two rows of numbers of both signs, some zero, some equal."""
    random = np.random.default_rng(1)
    x, y = random.normal(0, 2, (2, 1, points))
    x[0, ::7] = 0.0
    y[0, ::11] = 0.0
    y[0, ::13] = x[0, ::13]
    return [x, y]


def by_casadi(system: System, names: list[str]) -> ca.Function:
    """The named variables as a function that CasADi evaluates."""
    elements = [e for name in names for e in system.find(name).expression()]
    return ca.Function("v", system.arguments, [ca.densify(ca.vertcat(*elements))])


@pytest.mark.parametrize("points", [1, FEW, 3 * BLOCK + 5])
def test_every_operation(points: int) -> None:
    """Each of CasADi's operations on scalars, with infinities and what is no number, to the last digits of libm."""
    outputs = [f(X) for f in UNARY] + [f(X, Y) for f in BINARY] + [P * X + ca.exp(P)]
    prepared = prepare("all", [X, Y], P, [ca.densify(ca.vertcat(*outputs[:20])), ca.densify(ca.vertcat(*outputs[20:]))])
    arguments, p = sets(points), np.array([0.3])
    known = prepared.function(*arguments, prepared.parameters(p))
    for found, wanted in zip(Columns(prepared)(arguments, p), known, strict=True):
        np.testing.assert_allclose(found, np.array(wanted), rtol=1e-14, atol=0)


def test_all_operations_of_the_library_are_known() -> None:
    """No shipped circuit has an instruction for which CasADi must step in."""
    for name in ("crescent_pump", "axial_piston_pump", "position_servo", "water_hammer"):
        system = cl.load(name).system()
        function = by_casadi(system, list(system.variables))
        kinds = {function.instruction_id(k) for k in range(function.n_instructions())}
        assert kinds - set(OPERATIONS) <= {ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_CONST}


def test_a_long_run_shows_what_a_point_gives() -> None:
    """The series of a run of more than a block of rows are those of the function called row by row."""
    run = cl.load("valve_cylinder").simulate()
    names = [name for name in run.names if not run.system.variables[name].vector]
    assert run.time.size > BLOCK or run.time.size > FEW
    run.load(names)
    t, x, h, b = run.trajectory.steps.arrays()
    function = by_casadi(run.system, names)
    for row in (0, FEW, run.time.size - 1):
        known = np.array(function(t[row], x[row], h[row], b[row], run.values.p)).ravel()
        np.testing.assert_allclose([run[name][row] for name in names], known, rtol=1e-12, atol=1e-300)
