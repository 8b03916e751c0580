"""Signals computed by a formula that the circuit writes."""

from collections.abc import Callable
from typing import Any, Self

from pydantic import Field, model_validator

from crescentlab import units
from crescentlab.component import Component, Equations
from crescentlab.domain import gives_signal, takes_signal
from crescentlab.errors import ExpressionError, nearest
from crescentlab.expressions import Value, evaluate
from crescentlab.maths import Expr, event_where, where

from .signal_quantities import QuantityName

LETTERS = ("u1", "u2", "u3", "u4", "u5", "u6")
"""Names of the inputs."""


def _size(k: int) -> Any:
    """Size of input k: a scalar while it is used, nothing otherwise."""
    return lambda part: None if k < len(part.inputs) else 0


class Expression(Component):
    r"""Signal computed from others, and from time, by a formula whose dimensions are checked.

    .. math:: y = f(u_1, u_2, \dots, t)

    u_k in the SI units of the quantities that `inputs` names, in this order; t [s]; y in that of `output_quantity` [1
    by default]. The `formula` is written as in `outputs`: numbers with units, + - * / **, sin, cos, tan, asin, acos,
    atan, atan2, sinh, cosh, tanh, exp, log, sqrt, abs, min, max, where, as in `formula: 'u1 * u2 / (1 kW)'`.
    Parameters of the circuit reach it as inputs, from a `constant`. A `where` changes over at an event, so its branches
    need not meet; conditions on time alone are exact stops. Not for a `where` whose branches drive its condition back
    and forth, which has no solution: use a `relay`. Source: definition.
    """

    formula: str = Field(min_length=1, description="formula of u1, u2, ... and t, with units")
    inputs: list[QuantityName] = Field(default=["ratio"], max_length=6, description="quantities of u1, u2, ...")
    output_quantity: QuantityName = Field(default="ratio", description="quantity of the result")

    u1 = takes_signal("first_quantity", "first input", size=_size(0))
    u2 = takes_signal("second_quantity", "second input", size=_size(1))
    u3 = takes_signal("third_quantity", "third input", size=_size(2))
    u4 = takes_signal("fourth_quantity", "fourth input", size=_size(3))
    u5 = takes_signal("fifth_quantity", "fifth input", size=_size(4))
    u6 = takes_signal("sixth_quantity", "sixth input", size=_size(5))
    y = gives_signal("output_quantity", "the result")

    def quantity_of_input(self, k: int) -> str:
        """Name of the quantity of input k; a pure number for one that is not used."""
        return self.inputs[k] if k < len(self.inputs) else "ratio"

    first_quantity = property(lambda self: self.quantity_of_input(0))
    second_quantity = property(lambda self: self.quantity_of_input(1))
    third_quantity = property(lambda self: self.quantity_of_input(2))
    fourth_quantity = property(lambda self: self.quantity_of_input(3))
    fifth_quantity = property(lambda self: self.quantity_of_input(4))
    sixth_quantity = property(lambda self: self.quantity_of_input(5))

    @model_validator(mode="after")
    def _formula_gives_the_quantity(self) -> Self:
        symbol = Expr.of(1.0)  # a number could lie where the formula is not defined
        try:
            result = self._evaluated(dict.fromkeys((*LETTERS, "t"), symbol), where)
        except ExpressionError as error:
            raise ValueError(error.message) from None
        wanted = units.quantity_named(self.output_quantity)
        if not isinstance(result.value, (float, Expr)):
            raise ValueError(f"{self.formula!r} gives no number")
        if result.dims != wanted.dims:
            raise ValueError(
                f"{self.formula!r} gives a value in {result.quantity.si}, output_quantity {wanted.name} is in "
                f"{wanted.si}; write the quantity of the result"
            )
        return self

    def _evaluated(self, values: dict[str, Any], choose: Callable[[Any, Any, Any], Any]) -> Value:
        known = {
            name: Value(values[name], units.quantity_named(quantity))
            for name, quantity in zip(LETTERS, self.inputs, strict=False)
        }
        known["t"] = Value(values["t"], units.time)

        def lookup(name: str) -> Value:
            if name not in known:
                raise ExpressionError(f"{name!r} is no input: {nearest(name, known)}")
            return known[name]

        return evaluate(self.formula, lookup, where=choose)

    def equations(self, u1: Expr, u2: Expr, u3: Expr, u4: Expr, u5: Expr, u6: Expr, t: Expr) -> Equations:
        values = {**dict(zip(LETTERS, (u1, u2, u3, u4, u5, u6), strict=True)), "t": t}
        return {"y": self._evaluated(values, event_where).value}
