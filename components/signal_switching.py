"""Signals that switch, step or are slowed down: relay, switch, rate limiter, quantizer."""

from typing import Any, ClassVar, Self

from pydantic import Field, model_validator

from crescentlab import units
from crescentlab.component import Component, Equations
from crescentlab.domain import gives_signal, held, state, takes_signal
from crescentlab.maths import Expr, event_where, fmod, initially, maximum, when, where
from crescentlab.units import Ratio, Time

from .signal_arithmetic import limited
from .signal_quantities import Inferring, InputValue, OutputDifference, OutputValue, QuantityName


class Relay(Inferring, Component):
    r"""Two-position switch with hysteresis: a pressure switch, a thermostat, a Schmitt trigger.

    .. math:: y = y_{on} \text{ once } u > u_{upper}, \qquad y = y_{off} \text{ once } u < u_{lower}

    Between the two thresholds y stays as it is. u, u_upper = `upper`, u_lower = `lower`, in the SI unit of
    `input_quantity`; y_on = `on_value`, y_off = `off_value`, in that of `output_quantity` [both 1 by default]. Each
    switching is an event. A start between the thresholds is off unless `start: {closed: 1}` says otherwise. Not for a
    comparison without hysteresis: use `switch` between two constants. Source: definition; describing function of a
    relay with hysteresis, K. Ogata, Modern Control Engineering (2nd ed. 1990), chapter 8.
    """

    inferred: ClassVar[dict[str, tuple[str, ...]]] = {
        "output_quantity": ("on_value", "off_value"),
        "input_quantity": ("upper", "lower"),
    }

    output_quantity: QuantityName = Field(default="ratio", description="quantity of the output; default: the unit's")
    input_quantity: QuantityName = Field(default="ratio", description="quantity of the input; default: the unit's")
    upper: InputValue = Field(description="input above which it switches on")
    lower: InputValue = Field(description="input below which it switches off")
    on_value: OutputValue = Field(default=1.0, description="output while it is on")
    off_value: OutputValue = Field(default=0.0, description="output while it is off")

    u = takes_signal("input_quantity", "input")
    y = gives_signal("output_quantity", "one of the two values")
    closed = held(Ratio, "1 while it is on, 0 while it is off", start=0.0)
    begun = held(Ratio, "1 once its input has been looked at", start=0.0)

    @model_validator(mode="after")
    def _thresholds_in_order(self) -> Self:
        if not self.lower < self.upper:
            of = units.quantity_named(self.input_quantity)
            unit = next(iter(of.units))
            raise ValueError(f"upper ({of.show(self.upper, unit)}) must lie above lower ({of.show(self.lower, unit)})")
        return self

    def equations(self, closed: Expr, begun: Expr, u: Expr) -> Equations:
        first = where(u > self.upper, 1.0, where(u < self.lower, 0.0, closed))
        return {
            "y": where(closed == 1, self.on_value, self.off_value),
            "begins": initially(begun == 0, closed=first, begun=1.0),
            "switches_on": when((begun == 1) & (closed == 0) & (u > self.upper), closed=1.0),
            "switches_off": when((begun == 1) & (closed == 1) & (u < self.lower), closed=0.0),
        }


class Switch(Inferring, Component):
    r"""Passes one of two signals, as a third one says.

    .. math:: y = u_1 \ (c > c_0), \quad y = u_2 \ (c \le c_0)

    u_1, u_2 and y in the SI unit of `output_quantity`; c = `control`, c_0 = `threshold`, in that of `input_quantity`
    [both 1 by default]. Each switching is an event. Not for a control signal that depends at once on what is passed
    here, which would chatter: put a `relay` before the control. Source: definition.
    """

    inferred: ClassVar[dict[str, tuple[str, ...]]] = {"input_quantity": ("threshold",)}

    output_quantity: QuantityName = Field(default="ratio", description="quantity of the signals that are passed")
    input_quantity: QuantityName = Field(default="ratio", description="quantity of the control; default: the unit's")
    threshold: InputValue = Field(description="control above which the first signal is passed")

    u1 = takes_signal("output_quantity", "passed while the control is above the threshold")
    u2 = takes_signal("output_quantity", "passed otherwise")
    control = takes_signal("input_quantity", "what decides")
    y = gives_signal("output_quantity", "the signal that is passed")

    def equations(self, u1: Expr, u2: Expr, control: Expr) -> Equations:
        return {"y": event_where(control > self.threshold, u1, u2)}


class RateLimiter(Inferring, Component):
    r"""Signal that follows another no faster than a given rate: a first-order lag whose rate is limited.

    .. math:: \frac{dy}{dt} = \min\left(\max\left(\frac{u - y}{T}, -\frac{f}{w}\right), \frac{r}{w}\right)

    u, y, r = `rising`, f = `falling` in the SI unit of `output_quantity` [1 by default]; w = `within`, T =
    `time_constant` [s]. A limiter without any lag needs the input's derivative, which no signal has; this one follows
    a slow input T late, and ends a ramp in an exponential, from r T/w before the end on. Either limit is an event. It
    starts at its input. Not for a limited value: use `limiter`. Source: Modelica Standard Library 4.0.0,
    Modelica.Blocks.Nonlinear.SlewRateLimiter, with the limits as events.
    """

    inferred: ClassVar[dict[str, tuple[str, ...]]] = {"output_quantity": ("rising", "falling")}

    output_quantity: QuantityName = Field(default="ratio", description="quantity of the signals; default: the unit's")
    rising: OutputDifference = Field(gt=0, description="largest rise within `within`")
    falling: OutputDifference | None = Field(default=None, gt=0, description="largest fall; default: as `rising`")
    within: Time = Field(default=1.0, gt=0, description="time in which `rising` is gained and `falling` lost at most")
    time_constant: Time = Field(default=1e-3, gt=0, description="delay behind a slow input")

    u = takes_signal("output_quantity", "input")
    y = gives_signal("output_quantity", "what follows the input")
    value = state("output_quantity", "what follows the input", start=0.0)
    begun = held(Ratio, "1 once it has begun at its input", start=0.0)

    def equations(self, value: Expr, begun: Expr, u: Expr) -> Equations:
        falling = self.rising if self.falling is None else self.falling
        return {
            "y": value,
            "der_value": limited((u - value) / self.time_constant, -falling / self.within, self.rising / self.within),
            "begins": initially(begun == 0, value=u, begun=1.0),
        }


class Quantizer(Inferring, Component):
    r"""Steps of a converter: the multiple of a step that is nearest to the input.

    .. math:: y = s \left\lfloor \frac{u}{s} + \frac{1}{2} \right\rfloor

    u, y, s = `step`, in the SI unit of `output_quantity` [1 by default]; 0 is the middle of a step. Each edge is an
    event; on an edge y stays as it was. A converter of n bits has s = range/2^n; its range is a `limiter` before it,
    its clock a `sample_and_hold`. Not for a noisy input without a clock: each crossing of an edge is a stop. Source:
    B. Widrow, I. Kollar, Quantization Noise (2008), chapter 1: error within s/2, s^2/12 in the mean square.
    """

    inferred: ClassVar[dict[str, tuple[str, ...]]] = {"output_quantity": ("step",)}

    output_quantity: QuantityName = Field(default="ratio", description="quantity of the signals; default: the unit's")
    step: OutputDifference = Field(gt=0, description="height of a step")

    u = takes_signal("output_quantity", "input")
    y = gives_signal("output_quantity", "the nearest multiple of the step")
    level = held(Ratio, "number of the step", start=0.0)
    begun = held(Ratio, "1 once its input has been looked at", start=0.0)

    def equations(self, level: Expr, begun: Expr, u: Expr) -> Equations:
        above = u / self.step - level
        up, down = level + self._steps(above), level - self._steps(-above)
        first = where(above > 0.5, up, where(above < -0.5, down, level))
        return {
            "y": self.step * level,
            "begins": initially(begun == 0, level=first, begun=1.0),
            "steps_up": when((begun == 1) & (above > 0.5), level=up),
            "steps_down": when((begun == 1) & (above < -0.5), level=down),
        }

    def _steps(self, distance: Any) -> Any:
        """Whole steps to the nearest: at least one, for at the edge itself rounding would decide."""
        return maximum(distance + 0.5 - fmod(distance + 0.5, 1.0), 1.0)
