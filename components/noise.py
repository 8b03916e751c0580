"""Noise that is the same each time it is run."""

from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import AfterValidator, Field

from crescentlab.component import Component, Equations
from crescentlab.domain import gives_signal, held
from crescentlab.maths import Expr, cos, every, fmod, log, pi, sqrt, where
from crescentlab.units import Ratio, Time

from .signal_quantities import Inferring, OutputDifference, OutputValue, QuantityName

MODULI = (2147483563.0, 2147483399.0)
MULTIPLIERS = (40014.0, 40692.0)


def _whole(seed: float) -> float:
    if seed != int(seed):
        raise ValueError(f"must be a whole number, not {seed:g}")
    return seed


def advanced(numbers: Any) -> tuple[Any, Any]:
    """The next pair of the two congruential generators; exact in double precision, for all products are below 2^53."""
    first, second = (fmod(a * s, m) for a, s, m in zip(MULTIPLIERS, numbers, MODULI, strict=True))
    return first, second


def uniform(numbers: Any) -> Any:
    """The number between 0 and 1, both excluded, that a pair of the generators stands for."""
    difference = numbers[0] - numbers[1]
    return where(difference < 1, difference + (MODULI[0] - 1), difference) / MODULI[0]


def seeded(which: int) -> Any:
    """Start value of one of the generators: the seed, well mixed, so that neighbours have nothing in common."""

    def start(noise: "Noise") -> float:
        mixed = np.random.SeedSequence(int(noise.seed)).generate_state(2, np.uint64)[which]
        return 1.0 + float(int(mixed) % int(MODULI[which] - 1))

    return start


class Noise(Inferring, Component):
    r"""Random signal, held from sample to sample, the same series for the same seed.

    .. math:: y = \bar y + \sigma z_k \quad (t_k \le t < t_{k+1}), \quad t_k = t_0 + k h, \qquad
              S(f) = 2 \sigma^2 h \left( \frac{\sin \pi f h}{\pi f h} \right)^2

    \bar y = `mean`, \sigma = `standard_deviation`, in the SI unit of `output_quantity` [1 by default]; h =
    `sample_time` [s]; z_k [-] independent, of mean 0 and variance 1: normal, or uniform between -1.732 and 1.732; S
    [unit^2/Hz] the one-sided density of power, white far below 1/h. z_k comes from L'Ecuyer's two congruential
    generators, s <- 40014 s mod 2147483563 and s <- 40692 s mod 2147483399, with a period of 2.3e18, by Box and
    Muller's method where it is normal. Not for noise within a step of the integration: there is none between samples.
    Source: P. L'Ecuyer, Commun. ACM 31 (1988) 742-751, Fig. 3; G. E. P. Box, M. E. Muller, Ann. Math. Stat. 29 (1958)
    610-611.
    """

    inferred: ClassVar[dict[str, tuple[str, ...]]] = {"output_quantity": ("standard_deviation", "mean")}

    output_quantity: QuantityName = Field(default="ratio", description="quantity of the signal; default: the unit's")
    mean: OutputValue = Field(default=0.0, description="expected value")
    standard_deviation: OutputDifference = Field(ge=0, description="standard deviation")
    sample_time: Time = Field(gt=0, description="time from sample to sample")
    distribution: Literal["normal", "uniform"] = Field(default="normal", description="distribution of the samples")
    seed: Annotated[Ratio, AfterValidator(_whole)] = Field(
        default=1.0, ge=0, lt=1e15, description="whole number that chooses the series"
    )

    y = gives_signal("output_quantity", "the value")
    s1 = held(Ratio, "first generator", start=seeded(0))
    s2 = held(Ratio, "second generator", start=seeded(1))

    def equations(self, s1: Expr, s2: Expr) -> Equations:
        following = advanced((s1, s2))
        if self.distribution == "uniform":
            z = sqrt(3.0) * (2 * uniform((s1, s2)) - 1)
        else:
            z = sqrt(-2 * log(uniform((s1, s2)))) * cos(2 * pi * uniform(following))
            following = advanced(following)
        return {
            "y": self.mean + self.standard_deviation * z,
            "samples": every(self.sample_time, s1=following[0], s2=following[1]),
        }
