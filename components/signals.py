"""Signals: sources in time and the arithmetic between signals. Sensors of nets are in their own file.

A signal carries a quantity. A source reads it off the value's unit (`after: 5 bar` is a pressure) or is told by
`output_quantity`, which is needed where the unit has several owners or the value is computed.
"""

from typing import Annotated, Any, ClassVar, Self

from pydantic import AfterValidator, BaseModel, BeforeValidator, Field, ValidationInfo, model_validator
from pydantic_core import PydanticCustomError

from crescentlab import units
from crescentlab.component import Component, Equations
from crescentlab.domain import gives_signal, held, takes_signal
from crescentlab.errors import UnitError
from crescentlab.maths import Expr, event_where, pi, sin, stack, total, when
from crescentlab.tables import Curve, CurveOf
from crescentlab.units import Angle, Frequency, Ratio, Time


def _known(name: str) -> str:
    try:
        return units.quantity_named(name).name
    except UnitError as error:
        raise PydanticCustomError("quantity", "{reason}", {"reason": error.message}) from None


def _reader(quantity_field: str) -> BeforeValidator:
    """Reads text in a unit of the quantity that `quantity_field`, declared earlier, names."""

    def read(value: Any, info: ValidationInfo) -> Any:
        if not isinstance(value, str):
            return value
        try:
            name = info.data.get(quantity_field)
            return units.quantity_named(name).parse(value) if name else units.parse_any(value)[0]
        except UnitError as error:
            raise PydanticCustomError("unit", "{reason}", {"reason": error.message}) from None

    return BeforeValidator(read)


QuantityName = Annotated[str, AfterValidator(_known)]
"""The name of a quantity of :mod:`crescentlab.units`."""

OutputValue = Annotated[float, _reader("output_quantity")]
"""A number of the quantity that `output_quantity` names; text with a unit, or SI."""

InputValue = Annotated[float, _reader("input_quantity")]
"""A number of the quantity that `input_quantity` names; text with a unit, or SI."""


class _Inferring(BaseModel):
    """Fills in the name of a quantity that is not written from the unit of a value that is."""

    inferred: ClassVar[dict[str, tuple[str, ...]]] = {"output_quantity": ()}

    @model_validator(mode="before")
    @classmethod
    def _infer(cls, data: Any) -> Any:
        if not isinstance(data, dict):
            return data
        found = dict(data)
        for name, values in cls.inferred.items():
            written = [data[v] for v in values if isinstance(data.get(v), str)]
            if name not in found and written:
                try:
                    found[name] = units.parse_any(written[0])[1].name
                except UnitError:
                    continue  # the field's own reader says what is wrong
        return found


class Constant(_Inferring, Component):
    r"""Signal that never changes.

    .. math:: y = c

    c = `value`, in the SI unit of `output_quantity` [1 by default]. Not for settings that a parameter can hold.
    Source: definition.
    """

    inferred: ClassVar[dict[str, tuple[str, ...]]] = {"output_quantity": ("value",)}

    output_quantity: QuantityName = Field(default="ratio", description="quantity of the signal; default: the unit's")
    value: OutputValue = Field(description="value of the signal")

    y = gives_signal("output_quantity", "the value")

    def equations(self) -> Equations:
        return {"y": self.value}


class Step(_Inferring, Component):
    r"""Signal that jumps once.

    .. math:: y = y_0 \ (t < t_s), \quad y = y_1 \ (t \ge t_s)

    y_0 = `before`, y_1 = `after`, in the SI unit of `output_quantity` [1 by default]; t_s = `at` [s], an exact
    stop of the integration. Not for smooth changes: use `ramp`. Source: definition.
    """

    inferred: ClassVar[dict[str, tuple[str, ...]]] = {"output_quantity": ("after", "before")}

    output_quantity: QuantityName = Field(default="ratio", description="quantity of the signal; default: the unit's")
    before: OutputValue = Field(default=0.0, description="value before the jump")
    after: OutputValue = Field(description="value from the jump on")
    at: Time = Field(default=0.0, description="time of the jump")

    y = gives_signal("output_quantity", "the value")

    def equations(self, t: Expr) -> Equations:
        return {"y": event_where(t >= self.at, self.after, self.before)}


class Ramp(_Inferring, Component):
    r"""Signal that changes from one value to another at a constant rate.

    .. math:: y = y_0 + (y_1 - y_0)\,\min(\max((t - t_s)/\Delta t, 0), 1)

    y_0 = `before`, y_1 = `after`, in the SI unit of `output_quantity` [1 by default]; t_s = `at` [s],
    \Delta t = `duration` [s]; both corners are exact stops. Not for jumps: use `step`. Source: definition.
    """

    inferred: ClassVar[dict[str, tuple[str, ...]]] = {"output_quantity": ("after", "before")}

    output_quantity: QuantityName = Field(default="ratio", description="quantity of the signal; default: the unit's")
    before: OutputValue = Field(default=0.0, description="value before the ramp")
    after: OutputValue = Field(description="value after the ramp")
    at: Time = Field(default=0.0, description="time at which the ramp begins")
    duration: Time = Field(gt=0, description="time the ramp takes")

    y = gives_signal("output_quantity", "the value")

    def equations(self, t: Expr) -> Equations:
        rising = self.before + (self.after - self.before) * (t - self.at) / self.duration
        late = event_where(t >= self.at + self.duration, self.after, rising)
        return {"y": event_where(t >= self.at, late, self.before)}


class Sine(_Inferring, Component):
    r"""Harmonic signal.

    .. math:: y = \bar y + \hat y \sin(2\pi f t + \varphi)

    \bar y = `mean`, \hat y = `amplitude`, in the SI unit of `output_quantity` [1 by default]; f = `frequency`
    [Hz]; \varphi = `phase` [rad]. Not for a start from rest: it swings from the first instant.
    Source: definition.
    """

    inferred: ClassVar[dict[str, tuple[str, ...]]] = {"output_quantity": ("amplitude", "mean")}

    output_quantity: QuantityName = Field(default="ratio", description="quantity of the signal; default: the unit's")
    mean: OutputValue = Field(default=0.0, description="mean value")
    amplitude: OutputValue = Field(description="half of the swing from lowest to highest")
    frequency: Frequency = Field(gt=0, description="periods per time")
    phase: Angle = Field(default=0.0, description="phase at time zero")

    y = gives_signal("output_quantity", "the value")

    def equations(self, t: Expr) -> Equations:
        return {"y": self.mean + self.amplitude * sin(2 * pi * self.frequency * t + self.phase)}


class Pulse(_Inferring, Component):
    r"""Rectangular pulse, once or again and again.

    .. math:: y = y_1 \ (t_k \le t < t_k + w), \quad y = y_0 \ \mathrm{otherwise}, \quad t_k = t_s + k T

    y_0 = `low`, y_1 = `high`, in the SI unit of `output_quantity` [1 by default]; t_s = `at`, w = `width`,
    T = `period` [s], none for a single pulse; k = 0, 1, ... Every edge is an exact stop. With w >= T the signal
    stays high. Not for smooth pulses. Source: definition.
    """

    inferred: ClassVar[dict[str, tuple[str, ...]]] = {"output_quantity": ("high", "low")}

    output_quantity: QuantityName = Field(default="ratio", description="quantity of the signal; default: the unit's")
    low: OutputValue = Field(default=0.0, description="value outside the pulse")
    high: OutputValue = Field(description="value of the pulse")
    at: Time = Field(default=0.0, description="time at which the first pulse begins")
    width: Time = Field(gt=0, description="time a pulse lasts")
    period: Time | None = Field(default=None, gt=0, description="time from pulse to pulse; none: one pulse")

    y = gives_signal("output_quantity", "the value")
    begun = held(Time, "begin of the present pulse", start="at", counts=True)

    def equations(self, t: Expr, begun: Expr) -> Equations:
        value = event_where((t >= begun) & (t < begun + self.width), self.high, self.low)
        if self.period is None:
            return {"y": value}
        return {"y": value, "again": when(t >= begun + self.period, begun=begun + self.period)}


class TimeTable(Component):
    r"""Signal tabulated over time, piecewise linear, continued with the end slopes.

    .. math:: y = y_k + (y_{k+1} - y_k) \frac{t - t_k}{t_{k+1} - t_k}

    t [s]; y in the SI unit of the table's second column. Each knot is an exact stop. Not for jumps: use `step`.
    Source: linear interpolation.
    """

    curve: Annotated[Curve, CurveOf(units.time, None)] = Field(description="value over time")

    y = gives_signal("output_quantity", "the value")

    @property
    def output_quantity(self) -> str:
        """The quantity of the second column."""
        return self.curve.y_quantity

    def equations(self, t: Expr) -> Equations:
        return {"y": self.curve(t)}


class Table(Component):
    r"""Tabulated function of a signal, piecewise linear, continued with the end slopes.

    .. math:: y = y_k + (y_{k+1} - y_k) \frac{u - u_k}{u_{k+1} - u_k}

    u [any], y [any], in the SI units of the table's first and second column. Each knot is an event. Not for
    functions of time: use `time_table`. Source: linear interpolation.
    """

    curve: Annotated[Curve, CurveOf()] = Field(description="output over input")

    u = takes_signal("input_quantity", "input")
    y = gives_signal("output_quantity", "the tabulated value")

    @property
    def input_quantity(self) -> str:
        """The quantity of the first column."""
        return self.curve.x_quantity

    @property
    def output_quantity(self) -> str:
        """The quantity of the second column."""
        return self.curve.y_quantity

    def equations(self, u: Expr) -> Equations:
        return {"y": self.curve(u)}


class Gain(_Inferring, Component):
    r"""Signal in proportion to another, possibly of another quantity: `gain: 5 bar, per: 1 mm`.

    .. math:: y = g\, u/u_1

    g = `gain` in the SI unit of `output_quantity`, u_1 = `per` in that of `input_quantity` [both 1 by default].
    Not for an offset: use `sum`. Source: definition.
    """

    inferred: ClassVar[dict[str, tuple[str, ...]]] = {"output_quantity": ("gain",), "input_quantity": ("per",)}

    output_quantity: QuantityName = Field(default="ratio", description="quantity of the output; default: the unit's")
    input_quantity: QuantityName = Field(default="ratio", description="quantity of the input; default: the unit's")
    gain: OutputValue = Field(description="output when the input is `per`")
    per: InputValue = Field(default=1.0, gt=0, description="input that gives `gain`")

    u = takes_signal("input_quantity", "input")
    y = gives_signal("output_quantity", "the output")

    def equations(self, u: Expr) -> Equations:
        return {"y": self.gain * u / self.per}


class Sum(_Inferring, Component):
    r"""Weighted sum of signals of one quantity, and an offset.

    .. math:: y = y_0 + \sum_k w_k u_k

    y_0 = `offset`, u_k and y in the SI unit of `output_quantity` [1 by default]; w = `weights` [-], one per
    input: [1, -1] is a difference. Not for signals of different quantities: turn them with `gain` first.
    Source: definition.
    """

    inferred: ClassVar[dict[str, tuple[str, ...]]] = {"output_quantity": ("offset",)}

    output_quantity: QuantityName = Field(default="ratio", description="quantity of all signals; default: the offset's")
    offset: OutputValue = Field(default=0.0, description="added to the sum")
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
