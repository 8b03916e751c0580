"""The functions allowed in equations. Each works on floats, numpy arrays and symbols alike.

``where`` chooses between two values and makes no event, so its branches must meet or its
condition be held; ``event_where`` chooses by a condition that is frozen between events, so its
branches may differ. ``when`` and ``every`` describe remaps of states and held values. Both branches
of a choice are always evaluated *and differentiated*: keep square roots finite inside the branch.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextvars import ContextVar
from dataclasses import dataclass
from functools import cache
from typing import Any, Protocol, TypeAlias

import casadi as ca
import numpy as np

from crescentlab.symbols import Condition, Relation, Sym, as_condition, broadcast, concatenate

Expr: TypeAlias = Sym
"""What an equation works on: a symbol while tracing, a float or an array in a test."""

Number: TypeAlias = Sym | float

pi = float(np.pi)


class Tracer(Protocol):
    """Collects relations while a component is traced."""

    halvings: dict[tuple[int, bytes], tuple[ca.SX, list[ca.SX]]]
    """Answers that tables have asked for, by place in the graph and knots: a table asked twice has them once."""

    def bit(self, relation: Relation) -> ca.SX:
        """The frozen bit (0 or 1) that stands for ``relation``."""
        ...


TRACER: ContextVar[Tracer | None] = ContextVar("crescentlab_tracer", default=None)


@dataclass(frozen=True)
class Event:
    """Remap of states and held values, done when ``condition`` turns from false to true."""

    condition: Any
    then: dict[str, Any]
    initial: bool = False
    """Whether it waits at the start of a run until what it reads has been set."""


@dataclass(frozen=True)
class Tick:
    """Remap done at t0 + k dt, k = 1, 2, ..."""

    dt: Any
    then: dict[str, Any]


@dataclass(frozen=True)
class Failure:
    """The run ends in an error once ``condition`` turns true."""

    condition: Any
    message: str


def when(condition: Any, **then: Any) -> Event:
    """Set the named states and held values each time ``condition`` becomes true."""
    return Event(condition, then)


def initially(condition: Any, **then: Any) -> Event:
    """As :func:`when`, for what a part takes over from its inputs at the start: first samples, resting filters.

    It waits there until the events of the parts that it reads have set their own values.
    """
    return Event(condition, then, initial=True)


def every(dt: Any, **then: Any) -> Tick:
    """Set the named states and held values every ``dt`` [s]; dt depends on parameters only."""
    return Tick(dt, then)


def fail_when(condition: Any, message: str) -> Failure:
    """End the run when ``condition`` becomes true; ``{name}`` in the message shows that observable with its unit."""
    return Failure(condition, message)


def _elementwise(symbolic: Callable[[ca.SX], ca.SX], numeric: Callable[[Any], Any], doc: str) -> Callable[[Any], Any]:
    def function(x: Any) -> Any:
        return x.map(symbolic) if isinstance(x, Sym) else numeric(x)

    function.__doc__ = doc
    return function


sqrt = _elementwise(ca.sqrt, np.sqrt, "Square root; its slope at 0 is infinite, so regularise the argument.")
exp = _elementwise(ca.exp, np.exp, "Exponential.")
expm1 = _elementwise(ca.expm1, np.expm1, "exp(x) - 1, exact for small x too.")
log = _elementwise(ca.log, np.log, "Natural logarithm.")
log1p = _elementwise(ca.log1p, np.log1p, "log(1 + x), exact for small x too.")
sin = _elementwise(ca.sin, np.sin, "Sine of an angle [rad].")
cos = _elementwise(ca.cos, np.cos, "Cosine of an angle [rad].")
tan = _elementwise(ca.tan, np.tan, "Tangent of an angle [rad].")
asin = _elementwise(ca.asin, np.arcsin, "Arc sine [rad].")
acos = _elementwise(ca.acos, np.arccos, "Arc cosine [rad].")
atan = _elementwise(ca.atan, np.arctan, "Arc tangent [rad].")
tanh = _elementwise(ca.tanh, np.tanh, "Hyperbolic tangent.")
sinh = _elementwise(ca.sinh, np.sinh, "Hyperbolic sine.")
cosh = _elementwise(ca.cosh, np.cosh, "Hyperbolic cosine.")
asinh = _elementwise(ca.asinh, np.arcsinh, "Inverse hyperbolic sine.")
fabs = _elementwise(ca.fabs, np.abs, "Absolute value.")
sign = _elementwise(ca.sign, np.sign, "-1, 0 or 1; jumps without an event.")


def _pairwise(
    symbolic: Callable[[ca.SX, ca.SX], ca.SX], numeric: Callable[[Any, Any], Any], doc: str
) -> Callable[[Any, Any], Any]:
    def function(a: Any, b: Any) -> Any:
        if isinstance(a, Sym) or isinstance(b, Sym):
            return Sym.of(a)._zip(b, symbolic)
        return numeric(a, b)

    function.__doc__ = doc
    return function


minimum = _pairwise(ca.fmin, np.minimum, "The smaller of two values.")
maximum = _pairwise(ca.fmax, np.maximum, "The larger of two values.")
atan2 = _pairwise(ca.atan2, np.arctan2, "Angle of the point (b, a) [rad].")
hypot = _pairwise(lambda a, b: ca.sqrt(a * a + b * b), np.hypot, "Square root of the sum of squares.")
fmod = _pairwise(ca.fmod, np.fmod, "Remainder with the sign of the first; for constants, never for a running angle.")


def not_(condition: Any) -> Any:
    """The opposite truth value (``~True`` is -2 on a plain bool)."""
    return ~condition if isinstance(condition, Condition) else np.logical_not(condition)[()]


def _symbolic(*values: Any) -> bool:
    return any(isinstance(v, (Sym, Condition)) or (isinstance(v, (list, tuple)) and _symbolic(*v)) for v in values)


def where(condition: Any, a: Any, b: Any) -> Any:
    """``a`` where the condition holds, else ``b``, decided anew at every evaluation (no event)."""
    if not _symbolic(condition, a, b):
        return np.where(condition, a, b)[()]
    return _choose(as_condition(condition), None, a, b)


def event_where(condition: Any, a: Any, b: Any) -> Any:
    """``a`` where the condition holds, else ``b``; the choice is frozen between events."""
    if not _symbolic(condition):
        return where(condition, a, b)
    tracer = TRACER.get()
    if tracer is None:
        raise TypeError("event_where works on symbols only inside a component's equations")
    return _choose(as_condition(condition), tracer.bit, a, b)


def _choose(condition: Condition, bit: Callable[[Relation], ca.SX] | None, a: Any, b: Any) -> Sym:
    yes, no = Sym.of(a), Sym.of(b)
    shape = broadcast(broadcast(condition.shape, yes.shape), no.shape)
    if shape == (0,):
        return Sym(ca.SX(0, 1), shape)
    return Sym(ca.if_else(condition.lower(bit), yes.sx, no.sx), shape)


def stack(*values: Any) -> Any:
    """Scalars and vectors, one after another, as one vector."""
    if _symbolic(*values):
        return concatenate([Sym.of(v) for v in values])
    return np.concatenate([np.atleast_1d(np.asarray(v, dtype=float)) for v in values])


def total(vector: Any) -> Any:
    """Sum of a vector's elements; 0 for an empty one."""
    if isinstance(vector, Sym):
        return (
            Sym(ca.sum1(vector.sx))
            if vector.shape not in ((), (0,))
            else (vector if vector.shape == () else Sym.of(0.0))
        )
    return float(np.sum(vector))


_leggauss = cache(np.polynomial.legendre.leggauss)


def gauss_legendre(function: Callable[[Any], Any], a: Any, b: Any, nodes: int = 24) -> Any:
    """Integral of a smooth ``function`` from ``a`` to ``b``, exact for polynomials of degree 2 ``nodes`` - 1.

    ``function`` works element by element: between two scalars it is called once, with a vector of all nodes. It makes
    no events, for a node is no place where the circuit is; so a table in it has plain knots.
    """
    places, weights = _leggauss(nodes)
    middle, half = (a + b) / 2, (b - a) / 2
    token = TRACER.set(None)
    try:
        if np.shape(half) == ():
            return half * total(weights * function(middle + half * places))
        return half * sum(float(w) * function(middle + half * float(x)) for x, w in zip(places, weights, strict=True))
    finally:
        TRACER.reset(token)


def ones(n: int) -> np.ndarray:
    """A vector of n ones."""
    return np.ones(n)


def table(x: Any, knots: Sequence[float], values: Sequence[float], *, flag_knots: bool = True) -> Any:
    """Piecewise linear y(x) through the points, continued with the end slopes.

    ``knots`` strictly increasing, at least two. While tracing, each inner knot is an event, for a
    kink inside a step would limit every solver's accuracy; ``flag_knots=False`` leaves them out.
    """
    xs, ys = np.asarray(knots, dtype=float), np.asarray(values, dtype=float)
    lines = np.column_stack([ys[:-1], np.diff(ys) / np.diff(xs)])
    return piecewise(x, xs[1:-1], xs[:-1], lines, flag_knots=flag_knots)


def piecewise(
    x: Any, knots: np.ndarray, origins: np.ndarray, coefficients: np.ndarray, *, flag_knots: bool = True
) -> Any:
    """The polynomial sum_j c_kj (x - o_k)^j of the piece k that x lies in; piece k ends at ``knots[k]``.

    ``knots`` (m - 1,) increasing, ``origins`` o (m,), ``coefficients`` c (m, degree + 1); at a knot the piece after it.
    While tracing, a knot is an event unless ``flag_knots`` is False. The piece is found by halving, so that a table of
    m pieces has ceil(log2 m) relations, each between x and the knot that the answers before it leave, and costs about
    10 m instructions.
    """
    if not isinstance(x, Sym):
        k = np.searchsorted(knots, x, side="right")
        d, result = np.asarray(x) - origins[k], 0.0
        for j in reversed(range(coefficients.shape[1])):
            result = result * d + coefficients[k, j]
        return np.asarray(result)[()]
    if x.shape:
        return stack(*[piecewise(each, knots, origins, coefficients, flag_knots=flag_knots) for each in x])
    answers = _halving(x, knots, TRACER.get() if flag_knots else None)
    o, *c = (Sym(_chosen(column, answers)) for column in (origins, *coefficients.T))
    y = c[-1]
    for each in reversed(c[:-1]):
        y = y * (x - o) + each
    return y


def _halving(x: Sym, knots: np.ndarray, tracer: Tracer | None) -> list[ca.SX]:
    """Answers to "beyond the middle knot?", first of all pieces, then of the half that is left: the piece in binary."""
    key = (x.sx.element_hash(), knots.tobytes())
    if tracer is not None and key in tracer.halvings:
        return tracer.halvings[key][1]
    answers: list[ca.SX] = []
    depth = int(knots.size).bit_length()
    for level in range(depth):
        half = 2 ** (depth - level - 1)
        middles = np.minimum(np.arange(half, knots.size + 1 + half, 2 * half), knots.size) - 1
        beyond = x >= Sym(_chosen(knots[middles], answers))
        answers.append(beyond.lower(tracer.bit if tracer is not None else None))
    if tracer is not None:
        tracer.halvings[key] = (x.sx, answers)
    return answers


def _chosen(values: np.ndarray, answers: list[ca.SX]) -> ca.SX:
    """The value whose number the answers spell in binary, the last being its lowest digit."""
    left = ca.SX(np.asarray(values, dtype=float))
    for answer in reversed(answers):
        pairs = left.numel() // 2
        low, high = left[0 : 2 * pairs : 2], left[1 : 2 * pairs : 2]
        left = ca.vertcat(ca.if_else(answer, high, low), left[2 * pairs :]) if pairs else left
    return left
