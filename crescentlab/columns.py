"""Functions of the expression graph at many points at once: one instruction after another, in numpy, block by block.

CasADi evaluates a function point by point, some eight nanoseconds for an instruction. Over a thousand points an
operation of numpy takes one nanosecond for each, so that the series of a long run take a fifth of the time.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
import numpy as np

from crescentlab.prepared import Prepared

Array = np.ndarray

BLOCK = 1024
"""Points of a block: what an operation needs of them stays within the processor's cache."""
FEW = 500
"""Below so many points the time to take a function apart is not won back."""


def _if_else_zero(condition: Array, value: Array, out: Array) -> None:
    np.copyto(out, np.where(condition != 0, value, 0.0))


def _twice(value: Array, out: Array) -> None:
    np.add(value, value, out=out)


OPERATIONS: dict[int, Callable[..., Any]] = {
    ca.OP_ASSIGN: np.positive, ca.OP_ADD: np.add, ca.OP_SUB: np.subtract, ca.OP_MUL: np.multiply, ca.OP_DIV: np.divide,
    ca.OP_NEG: np.negative, ca.OP_EXP: np.exp, ca.OP_LOG: np.log, ca.OP_POW: np.power, ca.OP_CONSTPOW: np.power,
    ca.OP_SQRT: np.sqrt, ca.OP_SQ: np.square, ca.OP_TWICE: _twice, ca.OP_SIN: np.sin, ca.OP_COS: np.cos,
    ca.OP_TAN: np.tan, ca.OP_ASIN: np.arcsin, ca.OP_ACOS: np.arccos, ca.OP_ATAN: np.arctan, ca.OP_LT: np.less,
    ca.OP_LE: np.less_equal, ca.OP_EQ: np.equal, ca.OP_NE: np.not_equal, ca.OP_NOT: np.logical_not,
    ca.OP_AND: np.logical_and, ca.OP_OR: np.logical_or, ca.OP_FLOOR: np.floor, ca.OP_CEIL: np.ceil,
    ca.OP_FMOD: np.fmod, ca.OP_FABS: np.fabs, ca.OP_SIGN: np.sign, ca.OP_COPYSIGN: np.copysign,
    ca.OP_IF_ELSE_ZERO: _if_else_zero, ca.OP_FMIN: np.fmin, ca.OP_FMAX: np.fmax, ca.OP_INV: np.reciprocal,
    ca.OP_SINH: np.sinh, ca.OP_COSH: np.cosh, ca.OP_TANH: np.tanh, ca.OP_ASINH: np.arcsinh, ca.OP_ACOSH: np.arccosh,
    ca.OP_ATANH: np.arctanh, ca.OP_ATAN2: np.arctan2, ca.OP_EXPM1: np.expm1, ca.OP_LOG1P: np.log1p,
    ca.OP_HYPOT: np.hypot,
}  # fmt: skip
"""What is done by CasADi's number of an operation."""


Step = tuple[Any, ...]
"""``("in", w, argument, row)``, ``("out", w, output, row)``, ``("const", w, value)``; or a function, w, operands' w."""


class Columns:
    """A prepared function, taken apart when it is first evaluated at many points, and once only."""

    def __init__(self, prepared: Prepared) -> None:
        self.prepared = prepared

    @functools.cached_property
    def steps(self) -> list[Step] | None:
        """The function's instructions; None if there is one that numpy lacks."""
        return _steps(self.prepared.function)

    def __call__(self, arguments: Sequence[Array], p: Array) -> list[Array]:
        """Outputs, each of shape (rows, points), for arguments of shape (rows, points) and the parameters p.

        With an operation that numpy lacks, or for few points, CasADi evaluates.
        """
        function, q = self.prepared.function, np.array(self.prepared.parameters(p)).ravel()
        points = arguments[0].shape[1]
        if points < FEW or self.steps is None:
            found = function(*arguments, q)
            return [np.array(each) for each in (found if isinstance(found, tuple) else (found,))]
        outputs = [np.empty((function.numel_out(k), points)) for k in range(function.n_out())]
        work = np.empty((function.sz_w(), BLOCK))
        with np.errstate(all="ignore"):
            for low in range(0, points, BLOCK):
                block = slice(low, min(low + BLOCK, points))
                given, wanted = [a[:, block] for a in arguments], [o[:, block] for o in outputs]
                _run(self.steps, given, q, work[:, : block.stop - low], wanted)
        return outputs


def _steps(function: ca.Function) -> list[Step] | None:
    """The function's instructions; None if there is one that numpy lacks."""
    found: list[Step] = []
    for k in range(function.n_instructions()):
        kind = function.instruction_id(k)
        if kind == ca.OP_OUTPUT:
            found.append(("out", function.instruction_input(k)[0], *function.instruction_output(k)))
            continue
        (place,) = function.instruction_output(k)
        if kind == ca.OP_INPUT:
            found.append(("in", place, *function.instruction_input(k)))
        elif kind == ca.OP_CONST:
            found.append(("const", place, function.instruction_constant(k)))
        elif kind in OPERATIONS:
            found.append((OPERATIONS[kind], place, *function.instruction_input(k)))
        else:
            return None
    return found


def _run(steps: list[Step], arguments: list[Array], q: Array, work: Array, outputs: list[Array]) -> None:
    """All instructions for one block of points."""
    registers = list(work)
    for what, place, *operands in steps:
        if what == "in":
            argument, row = operands
            registers[place][:] = q[row] if argument == len(arguments) else arguments[argument][row]
        elif what == "const":
            registers[place][:] = operands[0]
        elif what == "out":
            output, row = operands
            outputs[output][row] = registers[place]
        else:
            what(*(registers[w] for w in operands), out=registers[place])
