"""Signals with memory in continuous time: integrator, lags of first and second order, transfer function."""

from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from pydantic import Field, model_validator

from crescentlab.component import Component, Equations
from crescentlab.domain import gives_signal, state, takes_signal
from crescentlab.maths import Expr, pi, stack, total
from crescentlab.units import Frequency, Ratio, Time

from .signal_quantities import Inferring, InputDifference, OutputDifference, QuantityName


class Integrator(Inferring, Component):
    r"""Integral of a signal over time, possibly of another quantity: `rate: 10 mm, per: 1 bar, within: 1 s`.

    .. math:: \frac{dy}{dt} = \frac{r}{T}\, \frac{u}{u_1}

    r = `rate` and y in the SI unit of `output_quantity`, u_1 = `per` and u in that of `input_quantity` [both 1 by
    default]; T = `within` [s]. It starts at 0 unless `start: {value: ...}` says otherwise, and has no limits. Not for
    meters, whose total only counts: use `energy_counter`, `volume_counter`. Source: definition.
    """

    inferred: ClassVar[dict[str, tuple[str, ...]]] = {"output_quantity": ("rate",), "input_quantity": ("per",)}

    output_quantity: QuantityName = Field(default="ratio", description="quantity of the output; default: the unit's")
    input_quantity: QuantityName = Field(default="ratio", description="quantity of the input; default: the unit's")
    rate: OutputDifference = Field(default=1.0, description="change of the output within `within` at the input `per`")
    per: InputDifference = Field(default=1.0, gt=0, description="input that gives `rate`")
    within: Time = Field(default=1.0, gt=0, description="time in which `rate` is gained")

    u = takes_signal("input_quantity", "input")
    y = gives_signal("output_quantity", "the integral")
    value = state("output_quantity", "the integral", start=0.0)

    def equations(self, value: Expr, u: Expr) -> Equations:
        return {"y": value, "der_value": self.rate * u / (self.per * self.within)}


class FirstOrderLag(Inferring, Component):
    r"""First-order lag: low-pass filter whose step response is an exponential.

    .. math:: T \frac{dy}{dt} = g \frac{u}{u_1} - y, \qquad y = g (1 - e^{-t/T}) \text{ after a step of } u_1

    g = `gain` and y in the SI unit of `output_quantity`, u_1 = `per` and u in that of `input_quantity` [both 1 by
    default]; T = `time_constant` [s]. It starts at 0 unless `start: {value: ...}` says otherwise. Not for a pure
    delay: use `delay`. Source: definition; e.g. K. Ogata, Modern Control Engineering (5th ed. 2010), section 5-2.
    """

    inferred: ClassVar[dict[str, tuple[str, ...]]] = {"output_quantity": ("gain",), "input_quantity": ("per",)}

    output_quantity: QuantityName = Field(default="ratio", description="quantity of the output; default: the unit's")
    input_quantity: QuantityName = Field(default="ratio", description="quantity of the input; default: the unit's")
    gain: OutputDifference = Field(default=1.0, description="output at rest when the input is `per`")
    per: InputDifference = Field(default=1.0, gt=0, description="input that gives `gain`")
    time_constant: Time = Field(gt=0, description="time to 63 % of a step")

    u = takes_signal("input_quantity", "input")
    y = gives_signal("output_quantity", "the filtered signal")
    value = state("output_quantity", "the filtered signal", start=0.0)

    def equations(self, value: Expr, u: Expr) -> Equations:
        return {"y": value, "der_value": (self.gain * u / self.per - value) / self.time_constant}


class SecondOrderLag(Inferring, Component):
    r"""Second-order lag: low-pass filter that overshoots when it is lightly damped.

    .. math:: \frac{d^2 y}{dt^2} + 2 \zeta \omega \frac{dy}{dt} + \omega^2 y = \omega^2 g \frac{u}{u_1}, \quad
              \omega = 2 \pi f, \qquad \text{overshoot } e^{-\pi\zeta/\sqrt{1 - \zeta^2}}

    g = `gain` and y in the SI unit of `output_quantity`, u_1 = `per` and u in that of `input_quantity` [both 1 by
    default]; f = `natural_frequency` [Hz]; \zeta = `damping_ratio` [-]. It starts at 0 at rest unless
    `start: {value: ...}` says otherwise. Not for a spool that meets its stops: use `spool_drive`.
    Source: K. Ogata, Modern Control Engineering (5th ed. 2010), section 5-3.
    """

    inferred: ClassVar[dict[str, tuple[str, ...]]] = {"output_quantity": ("gain",), "input_quantity": ("per",)}

    output_quantity: QuantityName = Field(default="ratio", description="quantity of the output; default: the unit's")
    input_quantity: QuantityName = Field(default="ratio", description="quantity of the input; default: the unit's")
    gain: OutputDifference = Field(default=1.0, description="output at rest when the input is `per`")
    per: InputDifference = Field(default=1.0, gt=0, description="input that gives `gain`")
    natural_frequency: Frequency = Field(gt=0, description="undamped natural frequency")
    damping_ratio: Ratio = Field(default=0.7, ge=0, description="damping over critical damping")

    u = takes_signal("input_quantity", "input")
    y = gives_signal("output_quantity", "the filtered signal")
    value = state("output_quantity", "the filtered signal", start=0.0)
    rate = state("output_quantity", "its rate of change over omega", start=0.0)

    def equations(self, value: Expr, rate: Expr, u: Expr) -> Equations:
        omega = 2 * pi * self.natural_frequency
        pull = self.gain * u / self.per - value - 2 * self.damping_ratio * rate
        return {"y": value, "der_value": omega * rate, "der_rate": omega * pull}


@dataclass(frozen=True)
class CanonicalForm:
    r"""Controllable canonical form of a proper transfer function, in a time that makes its states the input's size.

    .. math:: \frac{dx_i}{dt} = \omega_0 x_{i+1}, \quad \frac{dx_n}{dt} = \omega_0 (u - \textstyle\sum_i a_i x_i), \quad
              y = \textstyle\sum_i c_i x_i + d u

    \omega_0 [1/unit of time of s] is chosen so that the lowest coefficient of the denominator that is not 0 becomes 1.
    """

    scale: float
    a: np.ndarray
    c: np.ndarray
    d: float

    @classmethod
    def of(cls, numerator: list[float], denominator: list[float]) -> "CanonicalForm":
        """From coefficients of falling powers, the first of the denominator not 0, the numerator no longer than it."""
        n = len(denominator) - 1
        a = np.array(denominator[:0:-1]) / denominator[0]  # of rising powers
        b = np.zeros(n + 1)
        b[: len(numerator)] = np.array(numerator[::-1]) / denominator[0]
        lowest = np.flatnonzero(a)
        scale = float(abs(a[lowest[0]]) ** (1 / (n - lowest[0]))) if lowest.size else 1.0
        powers = scale ** (np.arange(n) - n)
        return cls(scale, a * powers, (b[:n] - b[n] * a) * powers, float(b[n]))

    def rates(self, x: Any, u: Any, time_unit: Any) -> Any:
        """Derivatives of the states [1/s of the input]."""
        if self.a.size == 0:
            return x
        return self.scale / time_unit * stack(x[1:], u - total(x * self.a))

    def output(self, x: Any, u: Any) -> Any:
        """The output."""
        return total(x * self.c) + self.d * u if self.a.size else self.d * u


class TransferFunction(Inferring, Component):
    r"""Linear filter given by its transfer function, which must be proper.

    .. math:: \frac{y}{u} = \frac{g}{u_1}\,
              \frac{b_0 (sT)^m + \dots + b_m}{a_0 (sT)^n + \dots + a_n}, \qquad m \le n, \quad a_0 \ne 0

    b = `numerator`, a = `denominator` [-], coefficients of falling powers of sT; T = `time_unit` [s], the time in whose
    units s counts; g = `gain` and y in the SI unit of `output_quantity`, u_1 = `per` and u in that of `input_quantity`
    [both 1 by default]. States x in controllable canonical form, scaled in time to the size of u; they start at 0. Not
    for high orders with poles far apart: chain filters of low order.
    Source: K. Ogata, Modern Control Engineering (5th ed. 2010), section 9-2.
    """

    inferred: ClassVar[dict[str, tuple[str, ...]]] = {"output_quantity": ("gain",), "input_quantity": ("per",)}

    output_quantity: QuantityName = Field(default="ratio", description="quantity of the output; default: the unit's")
    input_quantity: QuantityName = Field(default="ratio", description="quantity of the input; default: the unit's")
    gain: OutputDifference = Field(default=1.0, description="output that the polynomials' ratio 1 stands for at `per`")
    per: InputDifference = Field(default=1.0, gt=0, description="input that gives `gain`")
    numerator: list[Ratio] = Field(default=[1.0], min_length=1, description="coefficients, highest power first")
    denominator: list[Ratio] = Field(default=[1.0, 1.0], min_length=1, description="coefficients, highest power first")
    time_unit: Time = Field(default=1.0, gt=0, description="time in whose units s counts")

    u = takes_signal("input_quantity", "input")
    y = gives_signal("output_quantity", "the filtered signal")
    x = state("input_quantity", "states of the canonical form", start=0.0, size="order")

    @property
    def order(self) -> int:
        """Number of states."""
        return len(self.denominator) - 1

    @model_validator(mode="after")
    def _proper(self) -> Self:
        if self.denominator[0] == 0:
            raise ValueError("the first coefficient of the denominator is 0; leave it out")
        if self.numerator[0] == 0 and len(self.numerator) > 1:
            raise ValueError("the first coefficient of the numerator is 0; leave it out")
        if len(self.numerator) > len(self.denominator):
            raise ValueError(
                f"the numerator has order {len(self.numerator) - 1}, the denominator {self.order}; a filter cannot "
                "differentiate, so raise the denominator's order"
            )
        return self

    def equations(self, x: Expr, u: Expr) -> Equations:
        form = CanonicalForm.of(self.numerator, self.denominator)
        return {"y": self.gain / self.per * form.output(x, u), "der_x": form.rates(x, u, self.time_unit)}
