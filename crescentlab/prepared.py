"""Global functions made ready to run: common parts shared, what depends on parameters alone computed once.

An :class:`Evaluator` calls such a function through its buffers, which costs a few nanoseconds an instruction instead
of the tens of microseconds of an ordinary call.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import casadi as ca
import numpy as np

from crescentlab.symbols import column

Array = np.ndarray


@dataclass(frozen=True)
class Prepared:
    """A function whose parts that depend on parameters alone are computed once, before the run.

    ``function(*arguments, q)`` with ``q = parameters(p)``.
    """

    function: ca.Function
    parameters: ca.Function

    def from_library(self, library: Path) -> Prepared:
        """The same function out of a library built from its C."""
        return Prepared(ca.external(self.function.name(), str(library)), self.parameters)


SMALL = 20_000
"""Expressions of more instructions are not searched for common parts, which would take longer than all else."""
LARGE = 200_000
"""The same where an expression is evaluated at every step of a run: the search takes some microseconds each."""


def is_small(expression: ca.SX, most: int = SMALL) -> bool:
    """Whether an expression is small enough to be searched."""
    return expression.nnz() <= most and int(ca.n_nodes(expression)) <= most


def shared(expression: ca.SX, most: int = SMALL) -> ca.SX:
    """``expression`` with common subexpressions computed once, if it is small enough to search."""
    return ca.cse(expression) if expression.numel() and is_small(expression, most) else expression


def prepare(name: str, arguments: list[ca.SX], p: ca.SX, outputs: list[ca.SX], *, seldom: bool = False) -> Prepared:
    """Share common subexpressions of the outputs and hoist what depends on ``p`` alone.

    Hoisting saves a tenth of an evaluation: what is large and evaluated ``seldom`` does without.
    """
    sizes = [o.numel() for o in outputs]
    common = shared(ca.densify(column(outputs)))
    if seldom and not is_small(common):
        rest, q, values = common, p, p
    else:
        rest, symbols, parametric = ca.extract_parametric(common, p, {"extract_trivial": True})
        q, values = column(symbols), column(parametric)
    pieces = ca.vertsplit(rest, [0, *np.cumsum(sizes).tolist()]) if rest.numel() else [ca.SX(0, 1) for _ in sizes]
    return Prepared(ca.Function(name, [*arguments, q], pieces), ca.Function("q", [p], [ca.densify(values)]))


WIDE = 50
"""Rows of more nonzeros are differentiated one by one."""


def jacobian(f: ca.SX, x: ca.SX) -> ca.SX:
    """df/dx, sparse, in time proportional to the size of ``f``.

    CasADi sweeps over all of f as often as its widest row has nonzeros: n times for n volumes around one. Such rows
    are taken out and need one backward sweep over their own part of f.
    """
    if x.numel() <= WIDE:
        return ca.jacobian(f, x)
    pattern = ca.jacobian_sparsity(f, x)
    counts = np.bincount(np.array(pattern.row(), dtype=int), minlength=f.numel())
    if not (counts > WIDE).any():
        return ca.jacobian(f, x)
    narrow, wide = np.flatnonzero(counts <= WIDE).tolist(), np.flatnonzero(counts > WIDE).tolist()
    across = pattern.T
    start, places = across.colind(), across.row()
    parts = [ca.jacobian(f[narrow], x)]
    for row in wide:
        columns = places[start[row] : start[row + 1]]
        part = ca.jacobian(f[row], x[columns])
        parts.append(ca.SX(ca.Sparsity.triplet(1, x.numel(), [0] * len(columns), columns), ca.densify(part).nz[:]))
    return ca.vertcat(*parts)[np.argsort(narrow + wide).tolist(), :]


class Evaluator:
    """A prepared function called through its buffers, parameters fixed: a few nanoseconds an instruction."""

    def __init__(
        self, prepared: Prepared, p: Array, inputs: Sequence[Array] = (), outputs: Sequence[Array] | None = None
    ) -> None:
        """The first arguments are read from ``inputs``, the results written to ``outputs``, where these are given."""
        function = prepared.function
        self.sizes = [function.nnz_in(k) for k in range(function.n_in())]
        self.inputs = [*inputs, *(np.zeros(max(n, 1)) for n in self.sizes[len(inputs) :])]
        self.outputs = outputs or [np.zeros(max(function.nnz_out(k), 1)) for k in range(function.n_out())]
        self.results = [out[: function.nnz_out(k)] for k, out in enumerate(self.outputs)]
        self.x = self.inputs[1][: self.sizes[1]]
        self.last_h: Array | None = None
        self.last_b: Array | None = None
        self.inputs[-1][: self.sizes[-1]] = np.array(prepared.parameters(p)).ravel()
        self.use(function)

    def use(self, function: ca.Function) -> None:
        """Call this function from now on, another form of the same."""
        self.function = function
        self.buffer, self.trigger = function.buffer()
        for k, array in enumerate(self.inputs):
            self.buffer.set_arg(k, memoryview(array))  # type: ignore[call-arg, arg-type]  # CasADi's stub omits the view
        for k, array in enumerate(self.outputs):
            self.buffer.set_res(k, memoryview(array))  # type: ignore[call-arg, arg-type]

    def __call__(self, t: float, x: Array, h: Array, b: Array, extra: Array | None = None) -> list[Array]:
        """Evaluate; the returned arrays are overwritten by the next call.

        Held values and bits are copied only when they are other arrays than last time: they are replaced
        at stops, never changed in place.
        """
        inputs = self.inputs
        inputs[0][0] = t
        self.x[:] = x
        if h is not self.last_h:
            inputs[2][: self.sizes[2]] = h
            self.last_h = h
        if b is not self.last_b:
            inputs[3][: self.sizes[3]] = b
            self.last_b = b
        if extra is not None:
            inputs[4][: self.sizes[4]] = extra
        self.trigger()
        return self.results
