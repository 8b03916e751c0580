"""Tooth form of involute gears without profile shift: angles, thicknesses and areas. Pure functions, no meshing here.

One flank serves both gears: the tooth of an external gear and the tooth *space* of an internal gear are
bounded by the same curves. Below the base circle a flank is radial; root fillets are left out. All functions
work on floats and symbols, in SI. Source: the definition of the involute; Litvin & Fuentes, Gear Geometry and
Applied Theory (2004), chapters 10 and 11.
"""

from typing import Any

from crescentlab.maths import acos, atan, cos, pi, sqrt, tan, where


def involute(angle: Any) -> Any:
    r"""Involute function :math:`\mathrm{inv}\,\alpha = \tan\alpha - \alpha` [rad] of an angle [rad]."""
    return tan(angle) - angle


def base_radius(teeth: int, module: Any, pressure_angle: Any) -> Any:
    r"""Base radius [m], :math:`\rho = \tfrac12 m z \cos\theta_0`; m [m], nominal `pressure_angle` theta_0 [rad]."""
    return module * teeth / 2 * cos(pressure_angle)


def operating_angle(driver_base: Any, driven_base: Any, eccentricity: Any) -> Any:
    r"""Operating pressure angle [rad] of an internal pair, :math:`\cos\theta = (\rho_2 - \rho_1)/e`; all [m]."""
    return acos((driven_base - driver_base) / eccentricity)


def roll_angle(radius: Any, base: Any) -> Any:
    r"""Roll angle [rad] of the involute at a radius, :math:`\tan\alpha = \sqrt{r^2/\rho^2 - 1}`; 0 below the base."""
    square = radius * radius / (base * base) - 1
    above = square > 0
    return where(above, sqrt(where(above, square, 1.0)), 0.0)


def half_angle(radius: Any, teeth: int, base: Any, pressure_angle: Any) -> Any:
    r"""Half the angle [rad] between the two flanks at a radius: of an external tooth, of an internal gear's space.

    .. math:: \psi(r) = \frac{\pi}{2z} + \mathrm{inv}\,\theta_0 - \mathrm{inv}\,\alpha(r), \quad \cos\alpha = \rho/r

    r, `base` \rho [m]; theta_0 = `pressure_angle` [rad]; on the reference circle tooth and space are equally wide.
    """
    roll = roll_angle(radius, base)
    return pi / (2 * teeth) + involute(pressure_angle) - (roll - atan(roll))


def external_thickness(radius: Any, teeth: int, base: Any, pressure_angle: Any) -> Any:
    """Arc thickness [m] of an external gear's tooth: at the tip l_ti, at the root b2 of the paper."""
    return 2 * radius * half_angle(radius, teeth, base, pressure_angle)


def external_space(radius: Any, teeth: int, base: Any, pressure_angle: Any) -> Any:
    """Arc width [m] of an external gear's tooth space: at the root b1 of the paper."""
    return 2 * radius * (pi / teeth - half_angle(radius, teeth, base, pressure_angle))


def internal_thickness(radius: Any, teeth: int, base: Any, pressure_angle: Any) -> Any:
    """Arc thickness [m] of an internal gear's tooth: at the tip l_to of the paper."""
    return external_space(radius, teeth, base, pressure_angle)


def area_between_flanks(inner: Any, outer: Any, teeth: int, base: Any, pressure_angle: Any) -> Any:
    r"""Area [m^2] between two flanks and two circles: an external tooth, or an internal gear's tooth space.

    .. math:: \int_{r_i}^{r_a} 2 \psi r \, dr = \left[ r^2 \psi + \tfrac13 \rho^2 \tan^3 \alpha \right]_{r_i}^{r_a}

    The second term is the area that the ray to a point of the involute sweeps, once per flank. All radii [m].
    """

    def swept(radius: Any) -> Any:
        flank = base * base * roll_angle(radius, base) ** 3 / 3
        return radius * radius * half_angle(radius, teeth, base, pressure_angle) + flank

    return swept(outer) - swept(inner)


def mean_thickness(root: Any, tip: Any, teeth: int, base: Any, pressure_angle: Any) -> Any:
    """Mean thickness [m] of an external tooth over its height, b4 of the paper: its area over its height."""
    return area_between_flanks(root, tip, teeth, base, pressure_angle) / (tip - root)


def external_space_area(root: Any, tip: Any, teeth: int, base: Any, pressure_angle: Any) -> Any:
    """Area [m^2] of an external gear's tooth space, root circle to tip circle: V_i of the paper over H."""
    ring = pi * (tip * tip - root * root) / teeth
    return ring - area_between_flanks(root, tip, teeth, base, pressure_angle)


def internal_space_area(tip: Any, root: Any, teeth: int, base: Any, pressure_angle: Any) -> Any:
    """Area [m^2] of an internal gear's tooth space, tip circle to root circle: V_o of the paper over H."""
    return area_between_flanks(tip, root, teeth, base, pressure_angle)
