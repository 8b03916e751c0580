"""Expressions of circuit files: ``= pi / 4 * diameter**2``, ``line.p > 9 bar``.

Text is parsed by Python's ``ast`` and walked over a short list of nodes; nothing is ever evaluated
by Python itself. Every value carries its quantity, so bars and metres cannot be added.
"""

from __future__ import annotations

import ast
import math
import operator
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, lru_cache
from typing import Any

import casadi as ca
import numpy as np

from crescentlab import maths
from crescentlab.errors import ExpressionError, UnitError, nearest
from crescentlab.symbols import Condition, Sym
from crescentlab.units import NO_DIMS, QUANTITIES, Dims, Quantity, parse_any, quantity_with, ratio, si_unit

MAX_LENGTH = 2000
MAX_DEPTH = 150


@dataclass(frozen=True)
class Value:
    """A number (float, array or symbol), a word, or a condition, with its quantity."""

    value: Any
    quantity: Quantity = ratio
    written: bool = False
    """A number just as the user wrote it, so that its unit says what it is: 50 Hz is no speed."""

    @property
    def dims(self) -> Dims:
        return self.quantity.dims


Lookup = Callable[[str], Value]
Function = Callable[[list[Value]], Value]
"""Takes the arguments' values; raises :class:`ExpressionError` for the wrong ones."""


def is_expression(text: str) -> bool:
    """Whether a YAML text is an expression."""
    return text.startswith("=")


def evaluate(
    text: str, lookup: Lookup, functions: Mapping[str, Function] | None = None,
    where: Callable[[Any, Any, Any], Any] = maths.where,
) -> Value:  # fmt: skip
    """Value of ``text`` (a leading ``=`` is allowed); names are found by ``lookup(name)``.

    ``functions`` are known besides those of every expression, and before them; ``where`` makes the choices.

    Raises :class:`ExpressionError` for anything but arithmetic, for clashing dimensions, a division
    by zero, or a result that is not finite.
    """
    body = text.removeprefix("=").strip()
    tree, literals = _parse(body)
    shown = _shown(body)

    def find(name: str) -> Value:
        if name in literals:
            return literals[name]
        if name == "pi":
            return Value(math.pi)
        return lookup(name)

    try:
        result = _Walker(body, find, functions or {}, where).visit(tree)
    except ZeroDivisionError:
        raise ExpressionError(f"{shown} divides by zero") from None
    except (OverflowError, FloatingPointError):
        raise ExpressionError(f"{shown} is too large to compute") from None
    except ValueError as error:
        raise ExpressionError(f"{shown} cannot be computed: {error}") from None
    if isinstance(result.value, (float, int, np.ndarray)) and not np.all(np.isfinite(result.value)):
        raise ExpressionError(f"{shown} is not a finite number")
    return result


def names_in(text: str) -> set[str]:
    """Names that an expression asks for, those of functions left out; none for text that is no expression."""
    try:
        tree, literals = _parse(text.removeprefix("=").strip())
    except ExpressionError:
        return set()
    found: set[str] = set()
    todo: list[ast.AST] = [tree]
    while todo:
        node = todo.pop()
        name = _dotted(node)
        if name is not None:
            found.add(name)
        else:
            todo += node.args if isinstance(node, ast.Call) else ast.iter_child_nodes(node)
    return found - literals.keys() - {"pi"}


def number_of(value: Value, quantity: Quantity) -> float:
    """The SI number of an expression that must give ``quantity``."""
    if isinstance(value.value, (str, bool, np.bool_)):
        raise ExpressionError(f"the expression gives {_title(value)}, where {_title(Value(0.0, quantity))} belongs")
    if value.dims != quantity.dims or (value.written and value.quantity.si != quantity.si):
        raise ExpressionError(
            f"the expression gives {_title(value)}, where {_title(Value(0.0, quantity))} belongs; "
            f"a number of it is written like {quantity.example()}"
        )
    return float(value.value)


@cache
def _literal_pattern() -> re.Pattern[str]:
    units = {u for q in QUANTITIES.values() for u in q.units if u and u[0].isalpha()} | {"°", "°/s"}
    ordered = sorted(units, key=len, reverse=True)
    spelled = [
        re.sub(
            r"(?<=[a-z)])2",
            r"(?:\\^2|²|2)",
            re.sub(r"(?<=[a-z)])3", r"(?:\\^3|³|3)", re.escape(u).replace(r"\ ", r"[ ·]")),
        )
        for u in ordered
    ]
    return re.compile(rf"(?<![\w.])(\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+)\s*({'|'.join(spelled)})(?![\w²³^])")


@lru_cache(maxsize=4096)
def _parse(body: str) -> tuple[ast.expr, dict[str, Value]]:
    if len(body) > MAX_LENGTH:
        raise ExpressionError(f"an expression of {len(body)} characters; at most {MAX_LENGTH} are read")
    literals: dict[str, Value] = {}

    def keep(match: re.Match[str]) -> str:
        value, quantity = parse_any(match[0])
        literals[name := f"_literal{len(literals)}_"] = Value(value, quantity, written=True)
        return f" {name} "

    try:
        text = _literal_pattern().sub(keep, body)
        return ast.parse(text.strip(), mode="eval").body, literals
    except UnitError as error:
        raise ExpressionError(error.message) from None
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        if body.count("(") > body.count(")"):
            raise ExpressionError(f"a bracket is left open in {_shown(body)}; close it with )") from None
        hint = " (powers are written with **)" if "^" in body else ""
        raise ExpressionError(
            f"{_shown(body)} is not an expression{hint}; write arithmetic with parameters, for example = pi / 4 * d**2"
        ) from None


def _dotted(node: ast.AST) -> str | None:
    parts: list[str] = []
    while isinstance(node, ast.Attribute):
        parts.append(node.attr)
        node = node.value
    return ".".join([node.id, *reversed(parts)]) if isinstance(node, ast.Name) else None


def _power(base: Any, exponent: float) -> Any:
    if isinstance(base, (Sym, np.ndarray)):
        return base ** (int(exponent) if float(exponent).is_integer() else exponent)
    if base < 0 and not float(exponent).is_integer():
        raise ExpressionError(f"a negative number, {base:g}, to the power {exponent:g} is not a real number")
    return float(base) ** float(exponent)


def _divide(a: Any, b: Any) -> Any:
    if isinstance(b, (float, int)) and b == 0:
        raise ZeroDivisionError
    return a / b


_PLAIN = {"sin": maths.sin, "cos": maths.cos, "tan": maths.tan, "asin": maths.asin, "acos": maths.acos,
          "atan": maths.atan,
          "exp": maths.exp, "log": maths.log, "tanh": maths.tanh, "sinh": maths.sinh, "cosh": maths.cosh}  # fmt: skip
_WHOLE: dict[str, Callable[[float], float]] = {"floor": math.floor, "ceil": math.ceil, "round": lambda x: round(x)}
_SAME = {"min": maths.minimum, "max": maths.maximum}
_REDUCE: dict[str, Callable[[Any], Any]] = {
    "sum": maths.total,
    "mean": lambda v: maths.total(v) / len(v) if getattr(v, "shape", ()) else v,
}
FUNCTIONS = sorted([*_PLAIN, *_WHOLE, *_SAME, *_REDUCE, "abs", "sqrt", "where", "involute", "atan2"])
_COMPARE: dict[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}


class _Walker:
    """Evaluates the allowed nodes and refuses all others."""

    def __init__(
        self, body: str, find: Lookup, functions: Mapping[str, Function], where: Callable[[Any, Any, Any], Any]
    ) -> None:
        self.body, self.find, self.functions, self.where = body, find, functions, where
        self.depth = 0

    def fail(self, message: str) -> ExpressionError:
        return ExpressionError(f"{_shown(self.body)}: {message}")

    def visit(self, node: ast.expr) -> Value:
        self.depth += 1
        if self.depth > MAX_DEPTH:
            raise self.fail(f"more than {MAX_DEPTH} operations inside one another; name parts of it as parameters")
        value = self.value(node)
        self.depth -= 1
        return value

    def value(self, node: ast.expr) -> Value:
        name = _dotted(node)
        if name is not None:
            return self.find(name)
        if isinstance(node, ast.Constant) and isinstance(node.value, (int, float)) and not isinstance(node.value, bool):
            return Value(float(node.value))
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.USub, ast.UAdd)):
            inner = self.number(node.operand)
            return Value(-inner.value, inner.quantity) if isinstance(node.op, ast.USub) else inner
        if isinstance(node, ast.BinOp):
            return self.binary(node)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
            return self.call(node.func.id, node.args)
        if isinstance(node, ast.Subscript):
            return self.element(node)
        if isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in _COMPARE:
            left, right = self.alike(self.number(node.left), self.number(node.comparators[0]), "compare")
            return Value(_COMPARE[type(node.ops[0])](left.value, right.value))
        if isinstance(node, ast.BoolOp):
            return self.boolean(node)
        raise self.fail("only arithmetic, comparisons, parameters and " + ", ".join(FUNCTIONS) + " are allowed")

    def number(self, node: ast.expr) -> Value:
        value = self.visit(node)
        if isinstance(value.value, (str, bool, np.bool_, Condition)):
            raise self.fail(f"{_title(value)} stands where a number belongs")
        return value

    def binary(self, node: ast.BinOp) -> Value:
        left, right = self.number(node.left), self.number(node.right)
        if isinstance(node.op, (ast.Add, ast.Sub)):
            a, b = self.alike(left, right, "add")
            return Value(a.value + b.value if isinstance(node.op, ast.Add) else a.value - b.value, a.quantity)
        if isinstance(node.op, ast.Mult):
            if right.quantity is ratio or left.quantity is ratio:
                return Value(left.value * right.value, left.quantity if right.quantity is ratio else right.quantity)
            return Value(left.value * right.value, _combine(left.dims, right.dims, 1))
        if isinstance(node.op, ast.Div):
            quotient = _divide(left.value, right.value)
            return Value(quotient, left.quantity if right.quantity is ratio else _combine(left.dims, right.dims, -1))
        if isinstance(node.op, ast.Pow):
            if not isinstance(right.value, (int, float)) or right.dims != NO_DIMS:
                raise self.fail("an exponent must be a plain number")
            dims = tuple(d * Fraction(right.value).limit_denominator(12) for d in left.dims)
            return Value(_power(left.value, float(right.value)), _quantity(dims))
        raise self.fail("write + - * / ** only" + (", ** for a power" if isinstance(node.op, ast.BitXor) else ""))

    def alike(self, left: Value, right: Value, verb: str) -> tuple[Value, Value]:
        if left.dims == right.dims:
            return (Value(left.value, right.quantity), right) if left.quantity is ratio else (left, right)
        for zero, other in ((left, right), (right, left)):
            if zero.dims == NO_DIMS and isinstance(zero.value, float) and zero.value == 0.0:
                return (Value(0.0, other.quantity), other) if zero is left else (other, Value(0.0, other.quantity))
        raise self.fail(f"cannot {verb} {_title(left)} and {_title(right)}")

    def boolean(self, node: ast.BoolOp) -> Value:
        values = [self.condition(v) for v in node.values]
        result = values[0]
        for value in values[1:]:
            result = result & value if isinstance(node.op, ast.And) else result | value
        return Value(result)

    def condition(self, node: ast.expr) -> Any:
        value = self.visit(node)
        if not isinstance(value.value, (bool, np.bool_, Condition)):
            raise self.fail(f"{_title(value)} stands where a condition such as a > b belongs")
        return value.value

    def call(self, name: str, arguments: list[ast.expr]) -> Value:
        if name in self.functions:
            return self.functions[name]([self.number(a) for a in arguments])
        if name not in FUNCTIONS:
            known = [*self.functions, *FUNCTIONS]
            raise self.fail(f"unknown function {name!r}: {nearest(name, known)}")
        if name == "where" and len(arguments) == 3:
            a, b = self.alike(self.number(arguments[1]), self.number(arguments[2]), "choose between")
            return Value(_float(self.where(self.condition(arguments[0]), a.value, b.value)), a.quantity)
        values = [self.number(a) for a in arguments]
        if name in _SAME and len(values) >= 2:
            result = values[0]
            for value in values[1:]:
                a, b = self.alike(result, value, "compare")
                result = Value(_float(_SAME[name](a.value, b.value)), a.quantity)
            return result
        if name == "atan2" and len(values) == 2:
            a, b = self.alike(values[0], values[1], "compare")
            return Value(_float(maths.atan2(a.value, b.value)), QUANTITIES["angle"])
        if len(values) != 1 or name in (*_SAME, "where", "atan2"):
            wanted = {"where": "three arguments", "atan2": "two arguments"}.get(name, "one argument")
            raise self.fail(f"{name} takes {'two or more arguments' if name in _SAME else wanted}")
        return self.single(name, values[0])

    def single(self, name: str, value: Value) -> Value:
        if name == "abs":
            return Value(_float(maths.fabs(value.value)), value.quantity)
        if name == "sqrt":
            if isinstance(value.value, float) and value.value < 0:
                raise self.fail(f"the square root of {value.value:g}")
            return Value(_float(maths.sqrt(value.value)), _quantity(tuple(Fraction(d) / 2 for d in value.dims)))
        if name in _REDUCE:
            return Value(_REDUCE[name](value.value), value.quantity)
        if value.dims != NO_DIMS:
            raise self.fail(f"{name} of {_title(value)}; its argument must be a pure number or an angle")
        if name == "involute":
            return Value(_float(maths.tan(value.value) - value.value), QUANTITIES["angle"])
        if name in _WHOLE:
            if isinstance(value.value, Sym):
                return Value(value.value.map({"floor": ca.floor, "ceil": ca.ceil, "round": _round}[name]))
            return Value(float(_WHOLE[name](value.value)))
        if name == "log" and isinstance(value.value, float) and value.value <= 0:
            raise self.fail(f"the logarithm of {value.value:g}")
        with np.errstate(all="ignore"):
            return Value(_float(_PLAIN[name](value.value)))

    def element(self, node: ast.Subscript) -> Value:
        whole = self.number(node.value)
        index = node.slice
        if not (isinstance(index, ast.Constant) and isinstance(index.value, int)):
            raise self.fail("an index must be a whole number from 1")
        try:
            n = len(whole.value)
        except TypeError:
            raise self.fail("a scalar has no elements") from None
        if not 1 <= index.value <= n:
            raise self.fail(f"element {index.value} of a vector of {n}")
        return Value(
            whole.value[..., index.value - 1] if isinstance(whole.value, np.ndarray) else whole.value[index.value - 1],
            whole.quantity,
        )


def _round(x: ca.SX) -> ca.SX:
    return ca.floor(x + 0.5)


def _float(value: Any) -> Any:
    return value if isinstance(value, (Sym, Condition, np.ndarray)) else float(value)


def _shown(body: str) -> str:
    """The expression as messages show it, cut if it is long."""
    return repr(body if len(body) <= 120 else f"{body[:100]} ...")


def _title(value: Value) -> str:
    if isinstance(value.value, str):
        return f"the word {value.value!r}"
    if isinstance(value.value, (bool, np.bool_, Condition)):
        return "a condition"
    if value.quantity is ratio:
        return "a pure number"
    return (
        f"{value.quantity.titled} [{value.quantity.si}]"
        if value.quantity.name in QUANTITIES
        else f"a value in {value.quantity.si}"
    )


def _combine(a: Dims, b: Dims, sign: int) -> Quantity:
    return _quantity(tuple(Fraction(x) + sign * Fraction(y) for x, y in zip(a, b, strict=True)))


def _quantity(dims: tuple[Any, ...]) -> Quantity:
    whole: Any = tuple(int(d) if Fraction(d).denominator == 1 else d for d in dims)
    if all(isinstance(d, int) for d in whole):
        return quantity_with(whole)
    return Quantity(si_unit(whole), si_unit(whole), whole, {})
