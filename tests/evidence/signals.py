"""Signals made from time."""

from __future__ import annotations

import math

import numpy as np
from crescentlab.components.signals import Chirp, Constant, Pulse, Ramp, Sine, Step

from evidence import Number, evidence

BAR = 1e5


@evidence(
    "constant",
    "step",
    "ramp",
    source="definitions, by hand",
    tolerance=1e-14,
    because="rounding of double precision",
)
def straight() -> list[Number]:
    """A constant of 3 bar, a step from 1 to 5 bar at 10 ms, a ramp from 2 to 4 bar between 1 and 3 s."""
    step = Step(before="1 bar", after="5 bar", at="10 ms")
    ramp = Ramp(before="2 bar", after="4 bar", at="1 s", duration="2 s")
    return [
        Number("constant", 3 * BAR, Constant(value="3 bar").equations()["y"], "bar"),
        Number("step, 9.9 ms", 1 * BAR, step.equations(t=9.9e-3)["y"], "bar"),
        Number("step, 10 ms", 5 * BAR, step.equations(t=10e-3)["y"], "bar"),
        Number("ramp, 1.5 s", 2.5 * BAR, ramp.equations(t=1.5)["y"], "bar"),
        Number("ramp, 9 s", 4 * BAR, ramp.equations(t=9.0)["y"], "bar"),
    ]


@evidence(
    "sine",
    "pulse",
    source="mean square of a sine, Abramowitz & Stegun (1964), section 4.3; duty w/T of a pulse, by hand",
    tolerance=1e-12,
    because="the trapezoidal rule is exact for a sine over whole periods; the grid of the pulse meets its edges",
)
def over_a_period() -> list[Number]:
    """Means over a period: a sine of 1 bar about 5 bar at 50 Hz, a pulse of 4 bar for 5 of 20 ms."""
    t = np.arange(2000) * 1e-5
    sine = Sine(mean="5 bar", amplitude="1 bar", frequency="50 Hz", phase="30 deg").equations(t=t)["y"]
    pulse = Pulse(high="4 bar", width="5 ms", period="20 ms").equations(t=t, begun=0.0)["y"]
    return [
        Number("mean of the sine", 5 * BAR, float(np.mean(sine)), "bar"),
        Number("its root mean square about the mean", BAR / math.sqrt(2), float(np.std(sine)), "bar"),
        Number("mean of the pulse", 4 * BAR * 5 / 20, float(np.mean(pulse)), "bar"),
    ]


@evidence(
    "chirp",
    source="zeros of sin(phase) where the integral of the frequency is n/2 turns, solved for time by hand",
    tolerance=1e-12,
    because="a phase of 300 rad is rounded by 1e-13, the amplitude is the size",
)
def sweep() -> list[Number]:
    """A sweep from 10 to 90 Hz in 1 s: zero at (sqrt(f0^2 + k n) - f0)/k with k = 80 Hz/s, at ln(1 + b n/(2 f0))/b
    with b = ln 9 if it is logarithmic; a crest 3.25/f1 after the sweep; and the frequencies half-way.
    """
    linear = Chirp(amplitude=1.0, start_frequency=10.0, end_frequency=90.0, duration=1.0)
    octaves = linear.model_copy(update={"sweep": "logarithmic"})
    b = math.log(9.0)
    found = []
    for n in (1, 37, 99):
        at = (math.sqrt(100.0 + 80.0 * n) - 10.0) / 80.0
        found.append(Number(f"linear, zero {n}", 0.0, linear.equations(t=at)["y"], size=1.0))
    for n in (1, 37, 71):
        at = math.log(1 + b * n / 20.0) / b
        found.append(Number(f"logarithmic, zero {n}", 0.0, octaves.equations(t=at)["y"], size=1.0))
    late = linear.equations(t=1.0 + 3.25 / 90.0)  # 50 turns swept, and 3.25 at 90 Hz
    return [
        *found,
        Number("linear, 3.25 turns after the sweep", 1.0, late["y"]),
        Number("frequency after it", 90.0, late["f"], "Hz"),
        Number("linear, frequency half-way", 50.0, linear.equations(t=0.5)["f"], "Hz"),
        Number("logarithmic, frequency half-way", 30.0, octaves.equations(t=0.5)["f"], "Hz"),
    ]
