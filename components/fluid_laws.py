"""Building blocks of the fluids: liquid, free air and vapour as functions of the pressure. No fluids here.

Volumes and densities are relative to those of the liquid at 0 bar gauge; they come with their derivatives with respect
to the gauge pressure [1/Pa], so that a bulk modulus is rho dp/drho of its own density to the last digit.
"""

from typing import Any

from crescentlab.maths import cos, exp, maximum, minimum, pi, sin, sqrt, where

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


def exponential_liquid(p: Any, modulus: Any) -> Law:
    r"""Relative volume of a liquid of constant bulk modulus, e^{-p/\beta}: rho dp/drho = beta, integrated."""
    volume = exp(-p / modulus)
    return volume, -volume / modulus


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
