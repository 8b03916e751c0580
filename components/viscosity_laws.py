"""Viscosity of oils over temperature and pressure, on floats and symbols. No fluids here."""

from typing import Any

from crescentlab.maths import exp, log

CST = 1e-6
CENTIPOISE = 1e-3


def walther_viscosity(
    temperature: Any, temperature_1: Any, viscosity_1: Any, temperature_2: Any, viscosity_2: Any
) -> Any:
    r"""Kinematic viscosity [m^2/s] at `temperature` on the straight line of the viscosity chart through two points.

    .. math:: \log_{10} \log_{10} (\nu + 0.7) = A - B \log_{10} T

    \nu in cSt and T in K inside the logarithms; the points are (`temperature_1` [K], `viscosity_1` [m^2/s]) and
    (`temperature_2`, `viscosity_2`). For \nu from 2 cSt on; thinner oils need the further terms of the standard. Not
    beyond the cloud point. Source: C. Walther (1931); ASTM D341, for viscosities above 2 cSt.
    """
    high, low = _chart(viscosity_1), _chart(viscosity_2)
    along = log(temperature / temperature_1) / log(temperature_2 / temperature_1)
    return CST * (exp(exp(high + (low - high) * along)) - 0.7)


def _chart(viscosity: Any) -> Any:
    """Ordinate of the viscosity chart, in natural logarithms, which draw the same line."""
    return log(log(viscosity / CST + 0.7))


def barus_factor(p: Any, coefficient: Any) -> Any:
    r"""Dynamic viscosity at `p` [Pa, gauge] over that at 0 bar gauge.

    .. math:: \frac{\mu(p)}{\mu_0} = e^{\alpha p}

    \alpha = `coefficient` [1/Pa]. Up to some 1000 bar; above, it overstates. Source: C. Barus, Am. J. Sci. 45 (1893)
    87-96.
    """
    return exp(coefficient * p)


def wooster_coefficient(dynamic_viscosity: Any) -> Any:
    r"""Pressure-viscosity coefficient [1/Pa] of a mineral oil from its `dynamic_viscosity` [Pa s] at 0 bar gauge.

    .. math:: \alpha = (0.6 + 0.965 \log_{10} \mu_0) \cdot 10^{-8}

    \mu_0 in mPa s inside the logarithm, at the temperature for which \alpha is wanted; from 1 mPa s on. From 17 %
    above to 30 % below what was measured of mineral oils (Table 2.3 of the source). Source: Wooster, in G. W.
    Stachowiak, A. W. Batchelor, Engineering Tribology, chapter 2.
    """
    return (0.6 + 0.965 * log(dynamic_viscosity / CENTIPOISE) / log(10.0)) * 1e-8
