"""Arithmetic between signals."""

from __future__ import annotations

import math

import numpy as np
from crescentlab.components.signal_arithmetic import DeadBand, Gain, Limiter, Product, Sum

from evidence import Number, evidence

BAR, LPM = 1e5, 1e-3 / 60


@evidence(
    "gain", "sum", "product", source="definitions, by hand", tolerance=1e-14, because="rounding of double precision"
)
def by_hand() -> list[Number]:
    """5 bar per 1 mm at 2 mm; 5 bar - 2 bar + 1 bar; 100 bar times 6 L/min."""
    power = Product(first_quantity="pressure", second_quantity="flow", output_quantity="power")
    difference = Sum(weights=[1, -1], offset="1 bar")
    return [
        Number("gain", 10 * BAR, Gain(gain="5 bar", per="1 mm").equations(u=2e-3)["y"], "bar"),
        Number("sum", 4 * BAR, difference.equations(u=np.array([5 * BAR, 2 * BAR]))["y"], "bar"),
        Number("product", 1000.0, power.equations(u1=100 * BAR, u2=6 * LPM)["y"], "kW"),
    ]


@evidence(
    "limiter",
    "dead_band",
    source="describing functions of saturation and dead zone, K. Ogata, Modern Control Engineering (2nd ed. 1990), "
    "chapter 8: N = 2/pi (asin s + s sqrt(1 - s^2)), s = limit over amplitude, and 1 - N",
    tolerance=1e-6,
    because="trapezoidal rule with 4000 points across corners, (2 pi/4000)^2/8",
)
def describing_functions() -> list[Number]:
    """Fundamental of a sine of amplitude 1 behind limits, or a dead band, of 0.5."""
    theta = np.arange(4000) * (2 * math.pi / 4000)
    limited = Limiter(low=-0.5, high=0.5).equations(u=np.sin(theta))["y"]
    beyond = DeadBand(half_width=0.5).equations(u=np.sin(theta))["y"]
    expected = 2 / math.pi * (math.asin(0.5) + 0.5 * math.sqrt(0.75))
    return [
        Number("limiter", expected, float(2 * np.mean(limited * np.sin(theta)))),
        Number("dead band", 1 - expected, float(2 * np.mean(beyond * np.sin(theta)))),
    ]
