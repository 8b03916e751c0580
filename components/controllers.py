"""Controllers: PID in continuous time and sampled, both with limits and anti-windup."""

from typing import Any, ClassVar, Self

from pydantic import BaseModel, Field, model_validator

from crescentlab.component import Component, Equations
from crescentlab.domain import gives_signal, held, observable, state, takes_signal
from crescentlab.maths import Expr, every, initially, sqrt
from crescentlab.units import Ratio, Time

from .signal_arithmetic import limited, limited_at_once, limits_in_order
from .signal_quantities import Inferring, InputDifference, OutputDifference, OutputValue, QuantityName


class Tuning(Inferring, BaseModel):
    """What both controllers are set by."""

    inferred: ClassVar[dict[str, tuple[str, ...]]] = {
        "output_quantity": ("gain", "high", "low"),
        "input_quantity": ("per",),
    }

    output_quantity: QuantityName = Field(default="ratio", description="quantity of the output; default: the unit's")
    input_quantity: QuantityName = Field(default="ratio", description="quantity of the inputs; default: the unit's")
    gain: OutputDifference = Field(description="proportional part of the output at the error `per`; below 0 reverses")
    per: InputDifference = Field(default=1.0, gt=0, description="error that gives `gain`")
    integral_time: Time | None = Field(default=None, gt=0, description="integral time; none: no integral part")
    derivative_time: Time | None = Field(default=None, gt=0, description="derivative time; none: no derivative part")
    derivative_filter: Ratio = Field(default=10.0, gt=0, description="N: derivative_time over its filter's time")
    setpoint_weight: Ratio = Field(default=1.0, ge=0, description="share of the setpoint in the proportional part")
    low: OutputValue | None = Field(default=None, description="lowest output; none: no limit")
    high: OutputValue | None = Field(default=None, description="highest output; none: no limit")
    tracking_time: Time | None = Field(
        default=None,
        gt=0,
        description="of the anti-windup; default sqrt(integral_time derivative_time), or integral_time",
    )

    @model_validator(mode="after")
    def _limits_in_order(self) -> Self:
        limits_in_order(self.output_quantity, self.low, self.high)
        return self

    @property
    def proportional(self) -> Any:
        """K: output per error, both in SI."""
        return self.gain / self.per

    @property
    def tracking(self) -> Any:
        """Tracking time [s] of the anti-windup."""
        if self.tracking_time is not None:
            return self.tracking_time
        if self.derivative_time is None or self.integral_time is None:
            return self.integral_time
        return sqrt(self.integral_time * self.derivative_time)

    @property
    def integrates(self) -> int | None:
        """Size of the integral part: a scalar, or nothing."""
        return None if self.integral_time is not None else 0

    @property
    def differentiates(self) -> int | None:
        """Size of the derivative part: a scalar, or nothing."""
        return None if self.derivative_time is not None else 0


class PID(Tuning, Component):
    r"""PID controller in continuous time, with limits and anti-windup by back-calculation.

    .. math:: v = K (b r - y) + I - K N (y - y_f), \quad u = \min(\max(v, u_{low}), u_{high}), \quad
              \frac{dI}{dt} = \frac{K}{T_i} (r - y) + \frac{u - v}{T_t}, \quad
              \frac{dy_f}{dt} = \frac{N}{T_d} (y - y_f)

    r = `setpoint`, y = `measured`, in the SI unit of `input_quantity`, u = `output`, in that of `output_quantity` [both
    1 by default]; K = `gain` over `per`; T_i = `integral_time`, T_d = `derivative_time`, T_t = `tracking_time` [s]; N =
    `derivative_filter`, b = `setpoint_weight` [-]. The derivative acts on the measured value alone, filtered with
    T_d/N, and starts at rest: y_f = y. Each limit is an event. Not for a digital controller: use `sampled_pid`.
    Source: K. J. Astrom, T. Hagglund, PID Controllers (2nd ed. 1995), sections 3.4 (filter, weight) and 3.5
    (anti-windup).
    """

    setpoint = takes_signal("input_quantity", "what is asked for")
    measured = takes_signal("input_quantity", "what is")
    output = gives_signal("output_quantity", "the controller's output, within its limits")
    integral = state("output_quantity", "integral part of the output", start=0.0, size="integrates")
    filtered = state("input_quantity", "measured value, filtered", start=0.0, size="differentiates")
    begun = held(Ratio, "1 once the filter is at rest", start=0.0)
    unlimited = observable("output_quantity", "output before the limits")

    def equations(self, setpoint: Expr, measured: Expr, integral: Expr, filtered: Expr, begun: Expr) -> Equations:
        K = self.proportional
        v: Any = K * (self.setpoint_weight * setpoint - measured)
        der_integral: Any = integral  # empty, as long as there is no such part
        der_filtered: Any = filtered
        events = {}
        if self.derivative_time is not None:
            v = v - K * self.derivative_filter * (measured - filtered)
            der_filtered = self.derivative_filter / self.derivative_time * (measured - filtered)
            events["begins"] = initially(begun == 0, filtered=measured, begun=1.0)
        if self.integral_time is not None:
            v = v + integral
        u = limited(v, self.low, self.high)
        if self.integral_time is not None:
            der_integral = K / self.integral_time * (setpoint - measured) + (u - v) / self.tracking
        return {"output": u, "unlimited": v, "der_integral": der_integral, "der_filtered": der_filtered, **events}


class SampledPID(Tuning, Component):
    r"""PID controller of a computer: samples, computes, and holds its output until the next sample.

    .. math:: v_k = K (b r_k - y_k) + I_k + D_k, \quad u_k = \min(\max(v_k, u_{low}), u_{high}), \quad
              D_k = \frac{T_d}{T_d + N h} \left( D_{k-1} - K N (y_k - y_{k-1}) \right), \quad
              I_{k+1} = I_k + \frac{K h}{T_i} (r_k - y_k) + \frac{h}{T_t} (u_k - v_k)

    r = `setpoint`, y = `measured`, in the SI unit of `input_quantity`, u = `output`, in that of `output_quantity` [both
    1 by default]; K = `gain` over `per`; h = `sample_time`, T_i = `integral_time`, T_d = `derivative_time`, T_t =
    `tracking_time` [s]; N = `derivative_filter`, b = `setpoint_weight` [-]. Forward differences for the integral part,
    backward for the derivative. The first sample is taken at the start of the run, with y_{-1} = y_0; the output
    follows each sample at once. Parts that sample in one instant read each other's values of before it. Not for the
    steps of a converter's level. Source: K. J. Astrom, T. Hagglund, PID Controllers (2nd ed. 1995), section 3.6.
    """

    sample_time: Time = Field(gt=0, description="time from sample to sample")

    setpoint = takes_signal("input_quantity", "what is asked for")
    measured = takes_signal("input_quantity", "what is")
    output = gives_signal("output_quantity", "the controller's output, within its limits")
    held_output = held("output_quantity", "output since the last sample", start=0.0)
    integral = held("output_quantity", "integral part for the next sample", start=0.0)
    derivative = held("output_quantity", "derivative part of the last sample", start=0.0)
    previous = held("input_quantity", "measured value of the last sample", start=0.0)
    begun = held(Ratio, "1 once the first sample is taken", start=0.0)

    def sampled(self, r: Any, y: Any, integral: Any, derivative: Any, previous: Any) -> dict[str, Any]:
        """What one sample sets, from the values of the last one."""
        K, h = self.proportional, self.sample_time
        if self.derivative_time is not None:
            share = self.derivative_time / (self.derivative_time + self.derivative_filter * h)
            derivative = share * (derivative - K * self.derivative_filter * (y - previous))
        v = K * (self.setpoint_weight * r - y) + integral + derivative
        u = limited_at_once(v, self.low, self.high)
        if self.integral_time is not None:
            integral = integral + K * h / self.integral_time * (r - y) + h / self.tracking * (u - v)
        return {"held_output": u, "integral": integral, "derivative": derivative, "previous": y}

    def equations(
        self, setpoint: Expr, measured: Expr, held_output: Expr, integral: Expr, derivative: Expr, previous: Expr,
        begun: Expr,
    ) -> Equations:  # fmt: skip
        first = self.sampled(setpoint, measured, integral, derivative, measured)
        return {
            "output": held_output,
            "begins": initially(begun == 0, begun=1.0, **first),
            "samples": every(self.sample_time, **self.sampled(setpoint, measured, integral, derivative, previous)),
        }
