"""The symbolic number that stands for a float while a component is traced.

:class:`Sym` wraps a CasADi ``SX`` column and remembers whether it is a scalar, shape ``()``, or a
vector, shape ``(n,)``, as a numpy array would. Raw ``SX`` would turn ``float(x)`` into a silent
NaN, kill the interpreter on an empty reversed slice, and confuse a vector of one with a scalar;
nobody outside this module, ``maths`` and the assembler sees one.

A comparison gives a :class:`Condition`, a small tree that ``where`` evaluates as it stands and
that ``event_where`` and ``when`` turn into relations with events of their own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

Shape = tuple[int, ...]


class Sym:
    """A symbolic scalar or vector with the arithmetic of a float or a numpy array."""

    __slots__ = ("shape", "sx")
    __array_ufunc__ = None  # numpy arrays leave mixed arithmetic to us
    __hash__ = None  # type: ignore[assignment]  # == builds a condition

    def __init__(self, sx: ca.SX, shape: Shape = ()) -> None:
        self.sx = sx
        self.shape = shape

    @staticmethod
    def of(value: Any) -> Sym:
        """``value`` (number, array, sequence of numbers and symbols, or symbol) as a symbol."""
        if isinstance(value, Sym):
            return value
        if isinstance(value, Condition):
            return Sym(value.lower(), value.shape)
        if isinstance(value, (list, tuple)):
            return concatenate([Sym.of(v) for v in value])
        array = np.asarray(value, dtype=float)
        if array.ndim == 0:
            return Sym(ca.SX(float(array)))
        if array.ndim == 1:
            return Sym(ca.SX(array.reshape(-1, 1)) if array.size else ca.SX(0, 1), (array.size,))
        raise TypeError(f"equations work on scalars and vectors, not on an array of shape {array.shape}")

    def _zip(self, other: Any, function: Callable[[ca.SX, ca.SX], ca.SX], swap: bool = False) -> Sym:
        right = Sym.of(other)
        shape = broadcast(self.shape, right.shape)
        if shape == (0,):
            return Sym(ca.SX(0, 1), shape)
        first, second = (right.sx, self.sx) if swap else (self.sx, right.sx)
        return Sym(function(first, second), shape)

    def map(self, function: Callable[[ca.SX], ca.SX]) -> Sym:
        """Apply an elementwise CasADi function."""
        return Sym(function(self.sx), self.shape) if self.shape != (0,) else self

    def __add__(self, other: Any) -> Sym:
        return self._zip(other, lambda a, b: a + b)

    def __radd__(self, other: Any) -> Sym:
        return self._zip(other, lambda a, b: a + b, swap=True)

    def __sub__(self, other: Any) -> Sym:
        return self._zip(other, lambda a, b: a - b)

    def __rsub__(self, other: Any) -> Sym:
        return self._zip(other, lambda a, b: a - b, swap=True)

    def __mul__(self, other: Any) -> Sym:
        return self._zip(other, lambda a, b: a * b)

    def __rmul__(self, other: Any) -> Sym:
        return self._zip(other, lambda a, b: a * b, swap=True)

    def __truediv__(self, other: Any) -> Sym:
        return self._zip(other, lambda a, b: a / b)

    def __rtruediv__(self, other: Any) -> Sym:
        return self._zip(other, lambda a, b: a / b, swap=True)

    def __pow__(self, other: Any) -> Sym:
        if isinstance(other, int) and not isinstance(other, bool) and 0 <= other <= 4:
            # repeated products keep d(x**2)/dx exact at x = 0, where the power rule divides
            result = Sym.of(np.ones(self.shape))
            for _ in range(other):
                result = result * self
            return result
        return self._zip(other, lambda a, b: a**b)

    def __rpow__(self, other: Any) -> Sym:
        return self._zip(other, lambda a, b: a**b, swap=True)

    def __neg__(self) -> Sym:
        return self.map(lambda a: -a)

    def __pos__(self) -> Sym:
        return self

    def __abs__(self) -> Sym:
        return self.map(ca.fabs)

    def __lt__(self, other: Any) -> Condition:
        return Relation(self, Sym.of(other), "<")

    def __le__(self, other: Any) -> Condition:
        return Relation(self, Sym.of(other), "<=")

    def __gt__(self, other: Any) -> Condition:
        return Relation(self, Sym.of(other), ">")

    def __ge__(self, other: Any) -> Condition:
        return Relation(self, Sym.of(other), ">=")

    def __eq__(self, other: Any) -> Condition:  # type: ignore[override]
        return Equality(self, Sym.of(other))

    def __ne__(self, other: Any) -> Condition:  # type: ignore[override]
        return Not(Equality(self, Sym.of(other)))

    def __getitem__(self, index: int | slice) -> Sym:
        if self.shape == ():
            raise TypeError("this symbol is a scalar and has no elements; give its port or state a size to index it")
        n = self.shape[0]
        if isinstance(index, slice):
            places = range(*index.indices(n))
            parts = [self.sx[i] for i in places]
            return Sym(ca.vertcat(*parts) if parts else ca.SX(0, 1), (len(parts),))
        if not -n <= index < n:
            raise IndexError(f"element {index} of a vector of {n}")
        return Sym(self.sx[index % n])

    def __len__(self) -> int:
        if self.shape == ():
            raise TypeError("this symbol is a scalar and has no length")
        return self.shape[0]

    def __iter__(self) -> Iterator[Sym]:
        return (self[i] for i in range(len(self)))

    def __float__(self) -> float:
        raise TypeError(
            "a symbol has no value while equations are traced; use crescentlab.maths instead of math or float()"
        )

    __int__ = __float__
    __index__ = __float__

    def __bool__(self) -> bool:
        raise TypeError("a symbol is neither true nor false while equations are traced; use where() instead of if")

    def __repr__(self) -> str:
        return f"Sym({self.sx}, shape={self.shape})"


def broadcast(a: Shape, b: Shape) -> Shape:
    """Shape of an elementwise result; scalars stretch, vectors must agree."""
    if a == () or a == b:
        return b
    if b == ():
        return a
    raise ValueError(f"vectors of {a[0]} and {b[0]} elements do not combine")


def column(items: list[ca.SX]) -> ca.SX:
    """CasADi columns one below the other; empty ones vanish."""
    if len(items) == 1:
        return items[0]
    filled = [i for i in items if i.numel()]
    return ca.vertcat(*filled) if filled else ca.SX(0, 1)


def concatenate(parts: list[Sym]) -> Sym:
    """Scalars and vectors one after another as one vector."""
    columns = [p.sx for p in parts if p.shape != (0,)]
    total = sum(p.shape[0] if p.shape else 1 for p in parts)
    return Sym(ca.vertcat(*columns) if columns else ca.SX(0, 1), (total,))


class Condition:
    """A truth value that is a symbol: combine with ``&``, ``|`` and ``not_()``."""

    shape: Shape = ()
    __hash__ = None  # type: ignore[assignment]

    def lower(self, bit: Callable[[Relation], ca.SX] | None = None) -> ca.SX:
        """The condition as 0 or 1, relations replaced by ``bit(relation)`` if it is given."""
        raise NotImplementedError

    def __and__(self, other: Any) -> Condition:
        return Both(self, as_condition(other), ca.logic_and)

    __rand__ = __and__

    def __or__(self, other: Any) -> Condition:
        return Both(self, as_condition(other), ca.logic_or)

    __ror__ = __or__

    def __invert__(self) -> Condition:
        return Not(self)

    def __bool__(self) -> bool:
        raise TypeError(
            "a condition is neither true nor false while equations are traced; use where(), &, | and not_()"
        )


class Relation(Condition):
    """``lhs < rhs`` and its kin: the one leaf that can become an event."""

    def __init__(self, lhs: Sym, rhs: Sym, operator: str) -> None:
        self.lhs, self.rhs, self.operator = lhs, rhs, operator
        self.shape = broadcast(lhs.shape, rhs.shape)

    def lower(self, bit: Callable[[Relation], ca.SX] | None = None) -> ca.SX:
        if bit is not None:
            return bit(self)
        compare = {"<": ca.lt, "<=": ca.le, ">": ca.gt, ">=": ca.ge}[self.operator]
        return compare(self.lhs.sx, self.rhs.sx)


EQUALITIES: ContextVar[list[Equality] | None] = ContextVar("crescentlab_equalities", default=None)
"""Every ``==`` met while a component is traced; the tracer refuses those between continuous values."""


class Equality(Condition):
    """``lhs == rhs`` between held values, which change only at events."""

    def __init__(self, lhs: Sym, rhs: Sym) -> None:
        self.lhs, self.rhs = lhs, rhs
        met = EQUALITIES.get()
        if met is not None:
            met.append(self)
        self.shape = broadcast(lhs.shape, rhs.shape)

    def lower(self, bit: Callable[[Relation], ca.SX] | None = None) -> ca.SX:
        return ca.eq(self.lhs.sx, self.rhs.sx)


@dataclass(eq=False)
class Both(Condition):
    """Two conditions joined by ``and`` or ``or``."""

    left: Condition
    right: Condition
    join: Callable[[ca.SX, ca.SX], ca.SX]

    def __post_init__(self) -> None:
        self.shape = broadcast(self.left.shape, self.right.shape)

    def lower(self, bit: Callable[[Relation], ca.SX] | None = None) -> ca.SX:
        return self.join(self.left.lower(bit), self.right.lower(bit))


@dataclass(eq=False)
class Not(Condition):
    """The opposite of a condition."""

    inner: Condition

    def __post_init__(self) -> None:
        self.shape = self.inner.shape

    def lower(self, bit: Callable[[Relation], ca.SX] | None = None) -> ca.SX:
        return ca.logic_not(self.inner.lower(bit))


@dataclass(eq=False)
class Constant(Condition):
    """A condition known while tracing."""

    value: bool

    def lower(self, bit: Callable[[Relation], ca.SX] | None = None) -> ca.SX:
        return ca.SX(float(self.value))


@dataclass(eq=False)
class Truth(Condition):
    """A symbol holding 0 or 1, taken as a condition."""

    value: Sym

    def __post_init__(self) -> None:
        self.shape = self.value.shape

    def lower(self, bit: Callable[[Relation], ca.SX] | None = None) -> ca.SX:
        return self.value.sx


def as_condition(value: Any) -> Condition:
    """A condition, a bool, or a 0/1 symbol as a condition."""
    if isinstance(value, Condition):
        return value
    if isinstance(value, Sym):
        return Truth(value)
    if isinstance(value, (bool, np.bool_)):
        return Constant(bool(value))
    raise TypeError(f"{value!r} is not a condition; compare something, for example x > 0")
