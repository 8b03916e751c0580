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


CSE_LIMIT = 20_000
"""Expressions of more instructions are not searched for common parts: the search grows faster than they do."""


def shared(expression: ca.SX) -> ca.SX:
    """``expression`` with common subexpressions computed once, if it is small enough to search."""
    free = ca.symvar(expression)
    if not expression.numel() or ca.Function("count", [ca.vertcat(*free)], [expression]).n_instructions() > CSE_LIMIT:
        return expression
    return ca.cse(expression)


def prepare(name: str, arguments: list[ca.SX], p: ca.SX, outputs: list[ca.SX]) -> Prepared:
    """Share common subexpressions of the outputs and hoist what depends on ``p`` alone."""
    sizes = [o.numel() for o in outputs]
    common = shared(ca.densify(column(outputs)))
    rest, symbols, parametric = ca.extract_parametric(common, p, {"extract_trivial": True})
    q = column(symbols)
    pieces = ca.vertsplit(rest, [0, *np.cumsum(sizes).tolist()]) if rest.numel() else [ca.SX(0, 1) for _ in sizes]
    return Prepared(ca.Function(name, [*arguments, q], pieces), ca.Function("q", [p], [ca.densify(column(parametric))]))


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
