"""Signals made from time: constant, step, ramp, oscillations, pulse. Arithmetic and tables have files of their own."""

import math
from typing import Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from crescentlab.component import Component, Equations
from crescentlab.domain import gives_signal, held, observable
from crescentlab.maths import Expr, event_where, exp, fmod, log, maximum, pi, sin, when
from crescentlab.units import Angle, Frequency, Time

from .signal_quantities import Inferring, OutputDifference, OutputValue, QuantityName


class Constant(Inferring, Component):
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


class Step(Inferring, Component):
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

    @property
    def change_time(self) -> float:
        """Time [s] that its change takes: none."""
        return 0.0

    def equations(self, t: Expr) -> Equations:
        return {"y": event_where(t >= self.at, self.after, self.before)}


class Ramp(Inferring, Component):
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

    @property
    def change_time(self) -> float:
        """Time [s] that its change takes."""
        return self.duration

    def equations(self, t: Expr) -> Equations:
        rising = self.before + (self.after - self.before) * (t - self.at) / self.duration
        late = event_where(t >= self.at + self.duration, self.after, rising)
        return {"y": event_where(t >= self.at, late, self.before)}


class Sine(Inferring, Component):
    r"""Harmonic signal.

    .. math:: y = \bar y + \hat y \sin(2\pi f t + \varphi)

    \bar y = `mean`, \hat y = `amplitude`, in the SI unit of `output_quantity` [1 by default]; f = `frequency`
    [Hz]; \varphi = `phase` [rad]. Not for a start from rest: it swings from the first instant.
    Source: definition.
    """

    inferred: ClassVar[dict[str, tuple[str, ...]]] = {"output_quantity": ("amplitude", "mean")}

    output_quantity: QuantityName = Field(default="ratio", description="quantity of the signal; default: the unit's")
    mean: OutputValue = Field(default=0.0, description="mean value")
    amplitude: OutputDifference = Field(description="half of the swing from lowest to highest")
    frequency: Frequency = Field(gt=0, description="periods per time")
    phase: Angle = Field(default=0.0, description="phase at time zero")

    y = gives_signal("output_quantity", "the value")

    def equations(self, t: Expr) -> Equations:
        return {"y": self.mean + self.amplitude * sin(2 * pi * self.frequency * t + self.phase)}


class Chirp(Inferring, Component):
    r"""Harmonic signal whose frequency sweeps from one value to another, linearly or in equal octaves per time.

    .. math:: y = \bar y + \hat y \sin\varphi, \quad \frac{d\varphi}{dt} = 2\pi f, \quad
              f = f_0 + (f_1 - f_0)\,\tau/T \;\text{(linear)}, \quad f = f_0 (f_1/f_0)^{\tau/T} \;\text{(logarithmic)},
              \quad \tau = \min(t - t_s, T)

    \bar y = `mean`, \hat y = `amplitude`, in the SI unit of `output_quantity` [1 by default]; f [Hz] from f_0 =
    `start_frequency` to f_1 = `end_frequency`; \varphi [rad], 0 at t_s = `at` [s]; T = `duration` [s]. y = \bar y
    before t_s; from t_s + T on it goes on at f_1. Both instants are exact stops. Not for the response at one frequency,
    which a sweep passes: sweep slowly, or use `sine`. Source: definition of the instantaneous frequency.
    """

    inferred: ClassVar[dict[str, tuple[str, ...]]] = {"output_quantity": ("amplitude", "mean")}

    output_quantity: QuantityName = Field(default="ratio", description="quantity of the signal; default: the unit's")
    mean: OutputValue = Field(default=0.0, description="mean value")
    amplitude: OutputDifference = Field(description="half of the swing from lowest to highest")
    start_frequency: Frequency = Field(gt=0, description="frequency at the start of the sweep")
    end_frequency: Frequency = Field(gt=0, description="frequency at its end")
    duration: Time = Field(gt=0, description="time the sweep takes")
    at: Time = Field(default=0.0, description="time at which the sweep begins")
    sweep: Literal["linear", "logarithmic"] = Field(
        default="linear", description="equal hertz per time, or equal octaves per time"
    )

    y = gives_signal("output_quantity", "the value")
    f = observable(Frequency, "instantaneous frequency, 0 before the sweep begins")

    @model_validator(mode="after")
    def _octaves_need_two_frequencies(self) -> Self:
        if self.sweep == "logarithmic" and self.start_frequency == self.end_frequency:
            raise ValueError("a logarithmic sweep needs two frequencies that differ; use a linear one, or sine")
        return self

    def equations(self, t: Expr) -> Equations:
        f_0, f_1, T = self.start_frequency, self.end_frequency, self.duration
        since = event_where(t >= self.at, t - self.at, 0.0)
        after = event_where(t >= self.at + T, since - T, 0.0)
        tau = since - after
        if self.sweep == "linear":
            turns, f = (f_0 + (f_1 - f_0) * tau / (2 * T)) * tau, f_0 + (f_1 - f_0) * tau / T
        else:
            octaves = log(f_1 / f_0)
            f = f_0 * exp(octaves * tau / T)
            turns = (f - f_0) * T / octaves
        return {
            "y": self.mean + self.amplitude * sin(2 * pi * (turns + f_1 * after)),
            "f": event_where(t >= self.at, f, 0.0),
        }


def _last_before_the_start(pulse: Any) -> float:
    """Begin [s] of the first pulse, or of the last one before the time 0."""
    if pulse.period is None or pulse.at >= 0:
        return float(pulse.at)
    return float(pulse.at + pulse.period * math.floor(-pulse.at / pulse.period))


class Pulse(Inferring, Component):
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
    begun = held(Time, "begin of the present pulse", start=_last_before_the_start, counts=True)

    @property
    def change_time(self) -> float:
        """Time [s] that its changes take: none."""
        return 0.0

    def equations(self, t: Expr, begun: Expr) -> Equations:
        now = (t >= begun) & (t < begun + self.width)
        if self.period is None:
            return {"y": event_where(now, self.high, self.low)}
        following = t >= begun + self.period  # what samples at this instant sees the edge before `again` fires
        passed = (t - begun - fmod(t - begun, self.period)) / self.period
        return {
            "y": event_where(now | following, self.high, self.low),
            "again": when(following, begun=begun + self.period * maximum(passed, 1.0)),
        }
