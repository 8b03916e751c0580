"""Flow through orifices, gaps and pipes as pure functions of pressures and dimensions. No components here.

All work on floats, vectors and symbols, in SI; density and viscosity are taken at the mean of the two pressures;
every Jacobian is finite, also at zero pressure drop, zero area and zero flow.
"""

from typing import Any

from crescentlab.fluid import Fluid
from crescentlab.maths import fabs, log, maximum, minimum, pi, sqrt, tanh, where

DIAMETER_ROUNDING = 1e-6
"""Default rounding [m] of the hydraulic diameter of a closing hole."""

_SERIES_BELOW = 1e-3
"""tanh(r)/r is summed as a series for r^2 below this, where it is exact to 1e-14: numerics, not physics."""


def hydraulic_diameter_of(area: Any, rounding: Any = DIAMETER_ROUNDING) -> Any:
    r"""Diameter [m] of the circle of `area` [m^2], rounded to keep a finite slope at zero area.

    .. math:: d_h = \sqrt{4A/\pi + d_r^2}

    d_r = `rounding` [m]; a relative change of (d_r/d_h)^2/2. A negative area counts as zero.
    """
    return sqrt(4 * maximum(area, 0.0) / pi + rounding * rounding)


def tanh_over(r_squared: Any) -> Any:
    """tanh(r)/r as a smooth function of r^2 >= 0, with value 1 and slope -1/3 at 0."""
    s = minimum(r_squared, _SERIES_BELOW)
    series = 1 - s / 3 + 2 * s * s / 15 - 17 * s * s * s / 315
    r = sqrt(maximum(r_squared, _SERIES_BELOW))
    return where(r_squared < _SERIES_BELOW, series, tanh(r) / r)


def orifice_flow(
    p_a: Any, p_b: Any, area: Any, hydraulic_diameter: Any, cd_max: Any, lambda_c: Any, fluid: Fluid
) -> Any:  # fmt: skip
    r"""Flow [m^3/s] from a to b through a sharp-edged orifice, laminar at small flow numbers.

    .. math:: q = C_d A \sqrt{2|\Delta p|/\rho}\;\mathrm{sign}\,\Delta p, \quad
              C_d = C_{d,max} \tanh(2\lambda/\lambda_c), \quad \lambda = (d_h/\nu)\sqrt{2|\Delta p|/\rho}

    \Delta p = p_a - p_b [Pa]; A = `area` [m^2]; d_h = `hydraulic_diameter` [m], None for
    :func:`hydraulic_diameter_of` the area; C_d,max [-]; \lambda_c [-] critical flow number; \rho [kg/m^3],
    \nu [m^2/s] at the mean pressure. Evaluated as A C_d,max k (2\Delta p/\rho) tanh(r)/r with
    k = 2 d_h/(\nu \lambda_c), r = k sqrt(2|\Delta p|/\rho), the same function without a root at zero drop.
    Not for cavitating flow. Source: Rundo & Corvaglia (2016), Eqs. 27-29.
    """
    mean: Any = (p_a + p_b) / 2
    drop = p_a - p_b
    d_h = hydraulic_diameter_of(area) if hydraulic_diameter is None else hydraulic_diameter
    rho = fluid.density(mean)
    k = 2 * d_h / (fluid.kinematic_viscosity(mean) * lambda_c)
    return area * cd_max * k * (2 * drop / rho) * tanh_over(k * k * 2 * fabs(drop) / rho)


def slot_flow(p_a: Any, p_b: Any, width: Any, height: Any, length: Any, fluid: Fluid) -> Any:
    r"""Flow [m^3/s] from a to b through a flat slot, laminar.

    .. math:: q = \frac{b h^3}{12 \mu l} (p_a - p_b)

    b = `width`, h = `height`, l = `length` [m]; \mu [Pa s] at the mean pressure. A negative height counts as
    zero. Not for h close to b, nor for turbulent gaps. Source: plane Poiseuille flow; Rundo & Corvaglia (2016),
    Eqs. 17, 18, 20, 22, 24-26.
    """
    mean: Any = (p_a + p_b) / 2
    open_height = maximum(height, 0.0)
    return width * open_height**3 / (12 * fluid.dynamic_viscosity(mean) * length) * (p_a - p_b)


def annular_flow(
    p_a: Any, p_b: Any, diameter: Any, clearance: Any, eccentricity: Any, length: Any, fluid: Fluid
) -> Any:  # fmt: skip
    r"""Flow [m^3/s] from a to b through a narrow annulus round an eccentric shaft, laminar.

    .. math:: q = \frac{\pi d c^3 (1 + 1.5 \varepsilon^2)}{12 \mu l} (p_a - p_b)

    d = `diameter` [m]; c = `clearance` [m], radial (half the difference of the diameters); \varepsilon [-]
    eccentricity over c; l = `length` [m]; \mu [Pa s] at the mean pressure. With d = 2 R it is
    \pi R c^3 (1 + 1.5\varepsilon^2)/(6 \mu l) of the paper. Source: Rundo & Corvaglia (2016), Eq. 23.
    """
    wider = 1 + 1.5 * eccentricity * eccentricity
    return slot_flow(p_a, p_b, pi * diameter * wider, clearance, length, fluid)


def drag_flow(velocity: Any, width: Any, height: Any) -> Any:
    r"""Flow [m^3/s] dragged along a slot by its moving wall (Couette), towards the wall's `velocity` [m/s].

    .. math:: q = \tfrac12 b h v

    b = `width`, h = `height` [m]. Source: Rundo & Corvaglia (2016), second term of Eqs. 24 and 25.
    """
    return width * height * velocity / 2


def friction_times_reynolds(reynolds: Any, relative_roughness: Any) -> Any:
    r"""Darcy friction factor times Reynolds number [-]: 64 in laminar flow, finite at zero flow.

    .. math:: f = 8\left[\left(\frac{8}{Re}\right)^{12} + \frac{1}{(A+B)^{3/2}}\right]^{1/12}, \quad
              A = \left[-2.457 \ln\left(\left(\tfrac{7}{Re}\right)^{0.9} + 0.27\tfrac{\epsilon}{d}\right)\right]^{16},
              \quad B = \left(\frac{37530}{Re}\right)^{16}

    Re [-]; \epsilon/d [-]. Evaluated as f Re = 8 [8^{12} + Re^{12} (y^{16}/(A y^{16} + 1))^{3/2}]^{1/12} with
    y = Re/37530; below Re = 1 the second term, under 1e-100 of the first, is left at its value for Re = 1.
    Covers laminar, transitional and turbulent flow. Source: Churchill, Chem. Eng. 84 (1977) 24, 91-92.
    """
    re = maximum(reynolds, 1.0)
    a = _power16(2.457 * log((7 / re) ** 0.9 + 0.27 * relative_roughness))
    y = _power16(re / 37530)
    r = re / 8
    r4 = r * r * r * r
    ratio = y / (a * y + 1)
    turbulent = r4 * r4 * r4 * ratio * sqrt(ratio)
    return 64 * (1 + turbulent) ** (1 / 12)


def _power16(x: Any) -> Any:
    x2 = x * x
    x4 = x2 * x2
    x8 = x4 * x4
    return x8 * x8


def pipe_friction_drop(
    q: Any, length: Any, diameter: Any, roughness: Any, fluid: Fluid, p: Any, loss_coefficient: Any = 0.0
) -> Any:  # fmt: skip
    r"""Pressure drop [Pa] along a round pipe, of the sign of `q`; all regimes of flow.

    .. math:: \Delta p = \left(f \frac{l}{d} + K\right) \frac{\rho v |v|}{2}, \quad
              v = \frac{4 \rho_0 q}{\pi d^2 \rho}

    q [m^3/s] is mass flow over \rho_0; l = `length`, d = `diameter`, `roughness` [m]; f [-] of
    :func:`friction_times_reynolds`; K = `loss_coefficient` [-] on the dynamic head; \rho [kg/m^3] and
    \nu [m^2/s] at p [Pa, gauge]. The friction part is f Re \rho \nu l v/(2 d^2), 32 \mu l v/d^2 when laminar.
    Not for the extra friction of fast transients. Source: Darcy-Weisbach with Churchill (1977).
    """
    rho, nu = fluid.density(p), fluid.kinematic_viscosity(p)
    v = 4 * fluid.rho_0 * q / (pi * diameter * diameter * rho)
    f_re = friction_times_reynolds(fabs(v) * diameter / nu, roughness / diameter)
    return f_re * rho * nu * length * v / (2 * diameter * diameter) + loss_coefficient * rho * v * fabs(v) / 2
