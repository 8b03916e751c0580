"""Noise."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from crescentlab.components.noise import Noise

from evidence import Number, evidence

COUNT = 10000


def series(**settings: Any) -> np.ndarray:
    """Samples, one after another."""
    noise = Noise(standard_deviation=1.0, sample_time=1.0, **settings)
    values = {held.name: float(noise.start_of(held)[0]) for held in (Noise.s1, Noise.s2)}
    found = []
    for _ in range(COUNT):
        result = noise.equations(**values)
        found.append(result["y"])
        values = result["samples"].then
    return np.array(found)


def in_whole_numbers(s1: int, s2: int, count: int) -> float:
    """L'Ecuyer's Fig. 3 as printed: 32-bit integers, products split so that none overflows."""
    z = 0
    for _ in range(count):
        k = s1 // 53668
        s1 = 40014 * (s1 - k * 53668) - k * 12211
        s1 += 2147483563 if s1 < 0 else 0
        k = s2 // 52774
        s2 = 40692 * (s2 - k * 52774) - k * 3791
        s2 += 2147483399 if s2 < 0 else 0
        z = s1 - s2
        z += 2147483562 if z < 1 else 0
    return z * 4.656613e-10


@evidence(
    "noise",
    source="L'Ecuyer (1988), Fig. 3, in whole numbers; Box & Muller (1958), sqrt(-2 ln u) cos(2 pi v)",
    tolerance=1e-6,
    because="the paper prints 1/2147483563 to seven digits, 5e-8, of which 2 pi is taken",
)
def generator() -> list[Number]:
    """From 12345 and 67890: the 1000th number, uniform between -sqrt 3 and sqrt 3, and the 500th pair, made normal."""
    found = []
    for distribution, count in (("uniform", 1000), ("normal", 500)):
        noise = Noise(standard_deviation=1.0, sample_time=1.0, distribution=distribution)
        values = {"s1": 12345.0, "s2": 67890.0}
        for _ in range(count):
            values = noise.equations(**values)["samples"].then
        found.append(noise.equations(**values)["y"])
    first, second = (in_whole_numbers(12345, 67890, count) for count in (1000, 1001))
    return [
        Number("uniform", math.sqrt(3) * (2 * first - 1), found[0], size=1.0),
        Number("normal", math.sqrt(-2 * math.log(first)) * math.cos(2 * math.pi * second), found[1], size=1.0),
    ]


def moments(name: str, z: np.ndarray, fourth: float) -> list[Number]:
    """Figures of a series in units of their standard errors, so that 0 is expected of each."""
    n = z.size
    found = [
        Number(f"{name}: mean", 0.0, math.sqrt(n) * float(np.mean(z)), size=1.0),
        Number(f"{name}: variance less 1", 0.0, math.sqrt(n / (fourth - 1)) * (float(np.mean(z**2)) - 1), size=1.0),
    ]
    for lag in (1, 2, 10):
        error = math.sqrt(n - lag) * float(np.mean(z[lag:] * z[:-lag]))
        found.append(Number(f"{name}: autocorrelation at lag {lag}", 0.0, error, size=1.0))
    return found


@evidence(
    "noise",
    source="moments of the normal and the uniform distribution: kurtosis 3 and 1.8; standard errors of their estimates",
    tolerance=3.5,
    because="in standard errors: one of ten figures lies beyond in 0.5 % of all seeds",
)
def statistics() -> list[Number]:
    """10000 normal, 10000 uniform samples: mean, variance, whiteness, all in units of their standard errors."""
    return [
        *moments("normal", series(seed=1), 3.0),
        *moments("uniform", series(seed=2, distribution="uniform"), 1.8),
    ]
