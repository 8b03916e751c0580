"""Building blocks of the fluids: liquid, free air and vapour as functions of the pressure. No fluids here.

Volumes and densities are relative to those of the liquid at 0 bar gauge; they come with their derivatives with respect
to the gauge pressure [1/Pa], so that a bulk modulus is rho dp/drho of its own density to the last digit. Beside each
relative volume stands its integral over the gauge pressure from 0 bar [Pa]: rho_l times an enthalpy.
"""

from collections.abc import Callable
from typing import Any

from crescentlab.maths import (
    asinh,
    atan2,
    cos,
    cosh,
    exp,
    expm1,
    gauss_legendre,
    log,
    log1p,
    maximum,
    minimum,
    pi,
    sin,
    sinh,
    sqrt,
    where,
)

Law = tuple[Any, Any]
"""A value and its derivative with respect to the gauge pressure."""


def absolute_pressure(p: Any, atmospheric_pressure: Any, minimum_pressure: Any) -> Law:
    r"""Absolute pressure [Pa], rounded so that it is positive whatever an integrator tries.

    .. math:: P = \tfrac12 \left(p + p_a + \sqrt{(p + p_a)^2 + 4 P_{min}^2}\right)

    p [Pa] gauge; p_a = `atmospheric_pressure`, P_min = `minimum_pressure` [Pa]; the change is (P_min/P)^2.
    No cancellation on either side of absolute zero.
    """
    bare = p + atmospheric_pressure
    size = where(bare > 0, bare, -bare)
    root = sqrt(bare * bare + 4 * minimum_pressure * minimum_pressure)
    large = (size + root) / 2
    absolute = where(bare > 0, large, minimum_pressure * minimum_pressure / large)
    return absolute, absolute / root


def gauge_pressure(absolute: Any, atmospheric_pressure: Any, minimum_pressure: Any) -> Law:
    r"""Gauge pressure [Pa] at a rounded absolute pressure, and its slope: :func:`absolute_pressure` turned round.

    .. math:: p = P - \frac{P_{min}^2}{P} - p_a, \quad \frac{dp}{dP} = 1 + \left(\frac{P_{min}}{P}\right)^2
    """
    rounding = minimum_pressure * minimum_pressure / absolute
    return absolute - rounding - atmospheric_pressure, 1 + rounding / absolute


def exponential_liquid(p: Any, modulus: Any) -> Law:
    r"""Relative volume of a liquid of constant bulk modulus, e^{-p/\beta}: rho dp/drho = beta, integrated."""
    volume = exp(-p / modulus)
    return volume, -volume / modulus


def integrated_exponential_liquid(p: Any, modulus: Any) -> Any:
    r"""Integral of :func:`exponential_liquid` [Pa], \beta (1 - e^{-p/\beta})."""
    return -modulus * expm1(-p / modulus)


def exponential_density(p: Any, modulus: Any) -> Law:
    r"""Relative density of a liquid of constant bulk modulus, e^{p/\beta}."""
    density = exp(p / modulus)
    return density, density / modulus


def secant_density(p: Any, modulus: Any, rise: Any) -> Law:
    r"""Relative density of a liquid whose secant bulk modulus rises in proportion to the pressure.

    .. math:: \frac{p}{1 - V/V_0} = K_0 + m p, \quad \rho \frac{dp}{d\rho} = \frac{(K_0 + m p)(K_0 + (m - 1) p)}{K_0}

    p [Pa] gauge; K_0 = `modulus` [Pa] at 0 bar gauge; m = `rise` [-]. For p > -K_0/m, which is far below any
    pressure a liquid has. Source: A. T. J. Hayward, Compressibility equations for liquids, Brit. J. Appl. Phys. 18
    (1967) 965-977.
    """
    stiff = modulus + rise * p
    return stiff / (stiff - p), modulus / ((stiff - p) * (stiff - p))


def integrated_secant_liquid(p: Any, modulus: Any, rise: Any) -> Any:
    r"""Integral of the relative volume [Pa], the inverse of :func:`secant_density`.

    .. math:: \int_0^p \frac{K_0 + (m - 1) p'}{K_0 + m p'} dp'
              = \frac{m - 1}{m} p + \frac{K_0}{m^2} \ln\left(1 + \frac{m p}{K_0}\right)
    """
    return (rise - 1) / rise * p + modulus / (rise * rise) * log1p(rise * p / modulus)


def free_air(
    absolute: Law, air_fraction: Any, atmospheric_pressure: Any, saturation_pressure: Any, polytropic_index: Any,
    rounding: Any,
) -> Law:  # fmt: skip
    r"""Relative volume of the air that is not dissolved.

    .. math:: \frac{\alpha}{1-\alpha}\, x(P) \left(\frac{P_{atm}}{P}\right)^{1/n}, \quad
              x = \frac{P_{sat} - P}{P_{sat} - P_{atm}}

    P = `absolute` [Pa]; \alpha = `air_fraction` [-] of the volume at P_atm; x [-] by Henry's law: what is dissolved is
    in proportion to the pressure, and all of it from P_sat on; over the last `rounding` [-] of the way there x turns
    into a cubic that meets zero with zero slope. n = `polytropic_index` [-]. Source: Rundo & Corvaglia (2016),
    section 6.3 and Fig. 20.
    """
    P, dP = absolute
    span = saturation_pressure - atmospheric_pressure
    z, w = (saturation_pressure - P) / span, rounding
    x = where(z > w, z, where(z > 0, z * z * (2 * w - z) / (w * w), 0.0))
    dx = -where(z > w, 1.0, where(z > 0, z * (4 * w - 3 * z) / (w * w), 0.0)) / span
    gas = air_fraction / (1 - air_fraction) * (atmospheric_pressure / P) ** (1 / polytropic_index)
    return gas * x, gas * (dx - x / (polytropic_index * P)) * dP


def integrated_free_air(
    absolute: Any, air_fraction: Any, atmospheric_pressure: Any, saturation_pressure: Any, polytropic_index: Any,
    rounding: Any, minimum_pressure: Any,
) -> Any:  # fmt: skip
    r"""Integral of :func:`free_air` over the gauge pressure [Pa].

    .. math:: \frac{\alpha}{1-\alpha} \int_{P_0}^{P} x \left(\frac{P_{atm}}{P'}\right)^{1/n}
              \left(1 + \frac{P_{min}^2}{P'^2}\right) dP'

    P = `absolute` [Pa], P_0 the same at 0 bar gauge, P_min = `minimum_pressure` [Pa]. Where x is linear, a sum of
    powers of P; over the cubic, whose ends lie close together, by quadrature.
    """
    start, _ = absolute_pressure(0.0, atmospheric_pressure, minimum_pressure)
    span = saturation_pressure - atmospheric_pressure
    seam = saturation_pressure - rounding * span
    linear = absolute < seam
    x, a, tiny = where(linear, absolute, seam) / start, 1 / polytropic_index, (minimum_pressure / start) ** 2
    power, height = x ** (-a), log(x)
    first = height * grown((1 - a) * height)  # the integrals of x^-a, x^(1-a), x^(-a-1) and x^(-a-2) from 1 on
    second, before_first, last = (power * x * x - 1) / (2 - a), (1 - power) / a, (1 - power / x) / (1 + a)
    bulk = saturation_pressure * (first + tiny * last)
    less = start * (second + tiny * before_first)
    stop = where(linear, seam, where(absolute < saturation_pressure, absolute, saturation_pressure))

    def air(P: Any) -> Any:
        """Where x is a cubic: relative volume times dp/dP."""
        z = (saturation_pressure - P) / span
        _, slope = gauge_pressure(P, atmospheric_pressure, minimum_pressure)
        return z * z * (2 * rounding - z) * (atmospheric_pressure / P) ** a * slope

    share = air_fraction / (1 - air_fraction)
    before = (atmospheric_pressure / start) ** a * start / span * (bulk - less)
    return share * (before + gauss_legendre(air, seam, stop, nodes=5) / (rounding * rounding))


def grown(y: Any) -> Any:
    r"""(e^y - 1)/y, 1 at y = 0. The integral of t^a from 1 to x is log x times that of y = (a + 1) log x."""
    near = y * y < 1e-6
    away = where(near, 1.0, y)
    return where(near, 1 + y / 2 * (1 + y / 3 * (1 + y / 4)), expm1(away) / away)


def evaporating(liquid: Law, absolute: Law, density_ratio: Any, vapour_pressure: Any, share: Any) -> Law:
    r"""Relative volume of a liquid that turns into vapour around its vapour pressure.

    .. math:: \frac{\rho}{\rho_l} = (1 - \theta) r + \theta\, \frac{\rho_v}{\rho_l} \frac{P}{P_v}, \quad
              \theta = \tfrac12 \left(1 - \sin \tfrac{\pi}{2} z\right), \quad
              z = \frac{P - P_v}{s P_v} \text{ within } \pm 1

    \theta [-] share of the volume that vapour takes; r [-] = `liquid`, its relative density; P = `absolute`,
    P_v = `vapour_pressure` [Pa]; \rho_v/\rho_l = `density_ratio` [-] of saturated vapour and liquid. The change takes
    place within P_v (1 +- s), s = `share` [-], where in equilibrium it would happen at P_v itself and the bulk modulus
    would be zero. Below, the vapour is a perfect gas. \rho rises with P everywhere. Source: Y. Delannoy, J. L. Kueny,
    Two phase flow approach in unsteady cavitation modelling, ASME FED 98 (1990) 153-158.
    """
    (r, dr), (P, dP) = liquid, absolute
    z = maximum(minimum((P - vapour_pressure) / (share * vapour_pressure), 1.0), -1.0)
    inside = where(z * z < 1, 1.0, 0.0)
    theta = (1 - sin(pi / 2 * z)) / 2
    d_theta = -inside * pi / 4 * cos(pi / 2 * z) * dP / (share * vapour_pressure)
    vapour = density_ratio * P / vapour_pressure
    rho = (1 - theta) * r + theta * vapour
    d_rho = (1 - theta) * dr + theta * density_ratio * dP / vapour_pressure + d_theta * (vapour - r)
    return 1 / rho, -d_rho / (rho * rho)


def integrated_evaporating(
    p: Any, absolute: Any, liquid: Callable[[Any], Any], integrated_liquid: Callable[[Any], Any], density_ratio: Any,
    vapour_pressure: Any, share: Any, atmospheric_pressure: Any, minimum_pressure: Any,
) -> Any:  # fmt: skip
    r"""Integral of :func:`evaporating` over the gauge pressure [Pa].

    Closed forms above the change, `integrated_liquid`(p), and below, where the vapour is a perfect gas. Within it the
    volume grows ten thousandfold at the very end, P_b = P_v (1 - s). With r = `liquid`(p), relative density, and
    k^2 = (1 - s) \rho_v/\rho_l, that of the vapour at P_b,

    .. math:: \frac{dP}{(1 - \theta) r + \theta v}
              = -\frac{4}{\pi} \frac{s P_v}{k} \frac{d\psi}{r \cos^2\psi + P/P_b \sin^2\psi}, \quad
              \tan\psi = k \tan \frac{\pi}{4} (1 - z)

    hardly varies with \psi, and the quadrature runs over u, \psi = k \sinh u, because P falls mostly while \psi < k.
    """
    top, bottom = vapour_pressure * (1 + share), vapour_pressure * (1 - share)
    above, below = absolute > top, absolute < bottom
    k = sqrt(density_ratio * (1 - share))

    def within(u: Any) -> Any:
        """Relative volume times dp/du, over 4/pi s P_v."""
        along, across = cos(k * sinh(u)), sin(k * sinh(u))
        P = vapour_pressure * (1 + share * (1 - 4 / pi * atan2(across, k * along)))
        gauge, slope = gauge_pressure(P, atmospheric_pressure, minimum_pressure)
        return slope * cosh(u) / (liquid(gauge) * along * along + P / bottom * across * across)

    # one of the three parts moves with the pressure, the others keep still: no derivative counts twice at a seam
    z = where(above, 1.0, where(below, -1.0, (absolute - vapour_pressure) / (share * vapour_pressure)))
    angle = pi / 4 * (1 - z)
    end = asinh(atan2(k * sin(angle), cos(angle)) / k)
    gas, square = where(below, absolute, bottom), minimum_pressure * minimum_pressure
    vapour = log(gas / bottom) - square / 2 * (1 / (gas * gas) - 1 / (bottom * bottom))
    edge, _ = gauge_pressure(top, atmospheric_pressure, minimum_pressure)
    return (
        integrated_liquid(where(above, p, edge))
        - 4 / pi * share * vapour_pressure * gauss_legendre(within, 0.0, end, nodes=20)
        + vapour_pressure / density_ratio * vapour
    )
