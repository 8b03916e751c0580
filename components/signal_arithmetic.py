"""Arithmetic between signals: gain, sum, product, formulas, limits. What remembers is in `signal_filters`."""

from typing import Any, ClassVar, Self

from pydantic import Field, model_validator

from crescentlab import units
from crescentlab.component import Component, Equations
from crescentlab.domain import gives_signal, takes_signal
from crescentlab.maths import Expr, event_where, maximum, minimum, stack, total
from crescentlab.units import Ratio

from .signal_quantities import Inferring, InputDifference, OutputDifference, OutputValue, QuantityName


class Gain(Inferring, Component):
    r"""Signal in proportion to another, possibly of another quantity: `gain: 5 bar, per: 1 mm`.

    .. math:: y = g\, u/u_1

    g = `gain` in the SI unit of `output_quantity`, u_1 = `per` in that of `input_quantity` [both 1 by default].
    Not for an offset: use `sum`. Source: definition.
    """

    inferred: ClassVar[dict[str, tuple[str, ...]]] = {"output_quantity": ("gain",), "input_quantity": ("per",)}

    output_quantity: QuantityName = Field(default="ratio", description="quantity of the output; default: the unit's")
    input_quantity: QuantityName = Field(default="ratio", description="quantity of the input; default: the unit's")
    gain: OutputDifference = Field(description="output when the input is `per`")
    per: InputDifference = Field(default=1.0, gt=0, description="input that gives `gain`")

    u = takes_signal("input_quantity", "input")
    y = gives_signal("output_quantity", "the output")

    def equations(self, u: Expr) -> Equations:
        return {"y": self.gain * u / self.per}


class Sum(Inferring, Component):
    r"""Weighted sum of signals of one quantity, and an offset.

    .. math:: y = y_0 + \sum_k w_k u_k

    y_0 = `offset`, u_k and y in the SI unit of `output_quantity` [1 by default]; w = `weights` [-], one per
    input: [1, -1] is a difference. Not for signals of different quantities: turn them with `gain` first.
    Source: definition.
    """

    inferred: ClassVar[dict[str, tuple[str, ...]]] = {"output_quantity": ("offset",)}

    output_quantity: QuantityName = Field(default="ratio", description="quantity of all signals; default: the offset's")
    offset: OutputDifference = Field(default=0.0, description="added to the sum")
    weights: list[Ratio] = Field(default=[1.0, 1.0], description="weight of each input")

    u = takes_signal("output_quantity", "inputs", size="count")
    y = gives_signal("output_quantity", "the sum")

    @property
    def count(self) -> int:
        """Number of inputs."""
        return len(self.weights)

    def equations(self, u: Expr) -> Equations:
        return {"y": self.offset + total(u * stack(*self.weights))} if self.weights else {"y": self.offset}


class Product(Component):
    r"""Product of two signals, whose quantity must be that of the product: pressure times flow is power.

    .. math:: y = u_1 u_2

    u_1, u_2 and y in the SI units of `first_quantity`, `second_quantity` and `output_quantity` [1 by default].
    Not for more than two at once. Source: definition.
    """

    first_quantity: QuantityName = Field(default="ratio", description="quantity of the first input")
    second_quantity: QuantityName = Field(default="ratio", description="quantity of the second input")
    output_quantity: QuantityName = Field(default="ratio", description="quantity of the output")

    u1 = takes_signal("first_quantity", "first input")
    u2 = takes_signal("second_quantity", "second input")
    y = gives_signal("output_quantity", "the product")

    @model_validator(mode="after")
    def _dimensions_agree(self) -> Self:
        names = (self.first_quantity, self.second_quantity, self.output_quantity)
        first, second, output = (units.quantity_named(n) for n in names)
        dims = tuple(a + b for a, b in zip(first.dims, second.dims, strict=True))
        if dims != output.dims:
            raise ValueError(
                f"{first.title} times {second.title} is in {units.si_unit((dims[0], dims[1], dims[2], dims[3]))}, "
                f"output_quantity {output.name} in {output.si}; write the quantity of the product"
            )
        return self

    def equations(self, u1: Expr, u2: Expr) -> Equations:
        return {"y": u1 * u2}


class Limiter(Inferring, Component):
    r"""Signal kept between two limits.

    .. math:: y = \min(\max(u, y_{low}), y_{high})

    u, y, y_low = `low`, y_high = `high`, in the SI unit of `output_quantity` [1 by default]. Each limit is an event.
    Not for a limited rate of change (`rate_limiter`). Source: definition of saturation.
    """

    inferred: ClassVar[dict[str, tuple[str, ...]]] = {"output_quantity": ("high", "low")}

    output_quantity: QuantityName = Field(default="ratio", description="quantity of the signals; default: the unit's")
    low: OutputValue = Field(default=0.0, description="lowest output")
    high: OutputValue = Field(description="highest output")

    u = takes_signal("output_quantity", "input")
    y = gives_signal("output_quantity", "input within the limits")

    @model_validator(mode="after")
    def _limits_in_order(self) -> Self:
        limits_in_order(self.output_quantity, self.low, self.high)
        return self

    def equations(self, u: Expr) -> Equations:
        return {"y": limited(u, self.low, self.high)}


class DeadBand(Inferring, Component):
    r"""Signal without its small values: nothing within the band, and what exceeds it outside.

    .. math:: y = u - w \ (u > w), \quad y = 0 \ (|u| \le w), \quad y = u + w \ (u < -w)

    u, y, w = `half_width`, in the SI unit of `output_quantity` [1 by default]. Each edge is an event. Not for backlash,
    which remembers where it came from. Source: definition of a dead zone.
    """

    inferred: ClassVar[dict[str, tuple[str, ...]]] = {"output_quantity": ("half_width",)}

    output_quantity: QuantityName = Field(default="ratio", description="quantity of the signals; default: the unit's")
    half_width: OutputDifference = Field(ge=0, description="largest input without an output")

    u = takes_signal("output_quantity", "input")
    y = gives_signal("output_quantity", "what exceeds the band")

    def equations(self, u: Expr) -> Equations:
        below = event_where(u < -self.half_width, u + self.half_width, 0.0)
        return {"y": event_where(u > self.half_width, u - self.half_width, below)}


def limited(value: Any, low: Any, high: Any) -> Any:
    """`value` between `low` and `high`, None for no limit; each limit is an event."""
    given = value  # both look at what is given, so that neither depends on the other's bit
    if low is not None:
        value = event_where(given < low, low, value)
    return value if high is None else event_where(given > high, high, value)


def limits_in_order(quantity: str, low: float | None, high: float | None) -> None:
    """Raise a ValueError unless the limits leave room between them."""
    if low is not None and high is not None and not low < high:
        of = units.quantity_named(quantity)
        unit = next(iter(of.units))
        raise ValueError(f"high ({of.show(high, unit)}) must lie above low ({of.show(low, unit)})")


def limited_at_once(value: Any, low: Any, high: Any) -> Any:
    """`value` between `low` and `high`, None for no limit, without events: for what changes at events alone."""
    if low is not None:
        value = maximum(value, low)
    return value if high is None else minimum(value, high)
