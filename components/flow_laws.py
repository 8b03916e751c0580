"""Flow through orifices, gaps and pipes as pure functions of pressures and dimensions. No components here.

A flow q is mass flow over the density rho_0 at 0 bar gauge. A resistance's law gives its volume flow Q at the mean of
its two pressures, where density and viscosity are taken, and :func:`referred_flow` makes q of it there: a turbulent
edge passes the mass flow C_d A sqrt(2 rho dp), a gap b h^3 dp/(12 nu l).

All work on floats, vectors and symbols, in SI; every Jacobian is finite, also at zero pressure drop, zero area and zero
flow.
"""

from typing import Any

from crescentlab.fluid import Fluid
from crescentlab.maths import exp, fabs, log, maximum, minimum, pi, sqrt, tanh, where

DIAMETER_ROUNDING = 1e-6
"""Default rounding [m] of the hydraulic diameter of a closing hole."""

_SERIES_BELOW = 1e-3
"""tanh(r)/r is summed as a series for r^2 below this, where it is exact to 1e-14: numerics, not physics."""

_NEWTON_STEPS = 4
"""Steps from the guesses below to the last digits, found in tests over all regimes: numerics, not physics."""

_CRITICAL = 2300.0
"""Reynolds number up to which the guess is laminar flow: numerics only, the law itself has no such edge."""

_SLOWEST = 1e-6
"""Below this dimensionless drop a short tube's resistance is that of developed laminar flow to 1e-9: numerics."""


def referred_flow(volume_flow: Any, p: Any, fluid: Fluid) -> Any:
    r"""Flow q [m^3/s], mass flow over the density at 0 bar gauge, of a volume flow at a pressure.

    .. math:: q = \frac{\rho(p)}{\rho_0} Q

    Q = `volume_flow` [m^3/s] at p [Pa, gauge]; \rho_0 [kg/m^3] at 0 bar gauge. Source: conservation of mass.
    """
    return fluid.density(p) / fluid.rho_0 * volume_flow


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

    .. math:: q = \frac{\rho}{\rho_0} C_d A \sqrt{2|\Delta p|/\rho}\;\mathrm{sign}\,\Delta p, \quad
              C_d = C_{d,max} \tanh(2\lambda/\lambda_c), \quad \lambda = (d_h/\nu)\sqrt{2|\Delta p|/\rho}

    \Delta p = p_a - p_b [Pa]; A = `area` [m^2]; d_h = `hydraulic_diameter` [m], None for
    :func:`hydraulic_diameter_of` the area; C_d,max [-]; \lambda_c [-] critical flow number; \rho [kg/m^3],
    \nu [m^2/s] at the mean pressure, \rho_0 at 0 bar gauge. Evaluated as A C_d,max k (2\Delta p/\rho_0) tanh(r)/r with
    k = 2 d_h/(\nu \lambda_c), r = k sqrt(2|\Delta p|/\rho), the same function without a root at zero drop.
    Not for cavitating flow. Source: Rundo & Corvaglia (2016), Eqs. 27-29, as a mass flow.
    """
    mean: Any = (p_a + p_b) / 2
    drop = p_a - p_b
    d_h = hydraulic_diameter_of(area) if hydraulic_diameter is None else hydraulic_diameter
    k = 2 * d_h / (fluid.kinematic_viscosity(mean) * lambda_c)
    r_squared = k * k * 2 * fabs(drop) / fluid.density(mean)
    return area * cd_max * k * (2 * drop / fluid.rho_0) * tanh_over(r_squared)


def slot_flow(p_a: Any, p_b: Any, width: Any, height: Any, length: Any, fluid: Fluid) -> Any:
    r"""Flow [m^3/s] from a to b through a flat slot, laminar.

    .. math:: q = \frac{\rho}{\rho_0} \frac{b h^3}{12 \mu l} (p_a - p_b)

    b = `width`, h = `height`, l = `length` [m]; \mu [Pa s], \rho [kg/m^3] at the mean pressure, \rho_0 at 0 bar gauge;
    \rho/\mu is 1/\nu. A negative height counts as zero. Not for h close to b, nor for turbulent gaps.
    Source: plane Poiseuille flow; Rundo & Corvaglia (2016), Eqs. 17, 18, 20, 22, 24-26, as a mass flow.
    """
    mean: Any = (p_a + p_b) / 2
    open_height = maximum(height, 0.0)
    return width * open_height**3 / (12 * fluid.kinematic_viscosity(mean) * fluid.rho_0 * length) * (p_a - p_b)


def annular_flow(
    p_a: Any, p_b: Any, diameter: Any, clearance: Any, eccentricity: Any, length: Any, fluid: Fluid
) -> Any:  # fmt: skip
    r"""Flow [m^3/s] from a to b through a narrow annulus round an eccentric shaft, laminar.

    .. math:: q = \frac{\rho}{\rho_0} \frac{\pi d c^3 (1 + 1.5 \varepsilon^2)}{12 \mu l} (p_a - p_b)

    d = `diameter` [m]; c = `clearance` [m], radial (half the difference of the diameters); \varepsilon [-]
    eccentricity over c; l = `length` [m]; \mu [Pa s], \rho [kg/m^3] at the mean pressure, \rho_0 at 0 bar gauge. With
    d = 2 R the volume flow is \pi R c^3 (1 + 1.5\varepsilon^2)/(6 \mu l) of the paper.
    Source: Rundo & Corvaglia (2016), Eq. 23.
    """
    wider = 1 + 1.5 * eccentricity * eccentricity
    return slot_flow(p_a, p_b, pi * diameter * wider, clearance, length, fluid)


def drag_flow(p_a: Any, p_b: Any, velocity: Any, width: Any, height: Any, fluid: Fluid) -> Any:
    r"""Flow [m^3/s] dragged along a slot by its moving wall (Couette), towards the wall's `velocity` [m/s].

    .. math:: q = \frac{\rho}{\rho_0} \tfrac12 b h v

    b = `width`, h = `height` [m]; \rho [kg/m^3] at the mean of the pressures at its two ends, as that of the flow which
    they drive through the same slot; \rho_0 at 0 bar gauge.
    Source: plane Couette flow; Rundo & Corvaglia (2016), second term of Eqs. 24 and 25, as a mass flow.
    """
    return referred_flow(width * height * velocity / 2, (p_a + p_b) / 2, fluid)


def friction_times_reynolds(reynolds: Any, relative_roughness: Any) -> Any:
    r"""Darcy friction factor times Reynolds number [-]: 64 in laminar flow, finite at zero flow.

    .. math:: f = 8\left[\left(\frac{8}{Re}\right)^{12} + \frac{1}{(A+B)^{3/2}}\right]^{1/12}, \quad
              A = \left[-2.457 \ln\left(\left(\tfrac{7}{Re}\right)^{0.9} + 0.27\tfrac{\epsilon}{d}\right)\right]^{16},
              \quad B = \left(\frac{37530}{Re}\right)^{16}

    Re [-]; \epsilon/d [-]. Evaluated as f Re = 8 [8^{12} + Re^{12} (y^{16}/(A y^{16} + 1))^{3/2}]^{1/12} with
    y = Re/37530; below Re = 1 the second term, under 1e-100 of the first, is left at its value for Re = 1.
    Covers laminar, transitional and turbulent flow. Source: Churchill, Chem. Eng. 84 (1977) 24, 91-92.
    """
    f_re, _ = _friction_and_slope(reynolds, relative_roughness)
    return f_re


def _friction_and_slope(reynolds: Any, relative_roughness: Any) -> tuple[Any, Any]:
    """:func:`friction_times_reynolds`, and d ln(f Re)/d ln(Re) [-]."""
    re = maximum(reynolds, 1.0)
    smooth_part = (7 / re) ** 0.9
    inside = smooth_part + 0.27 * relative_roughness
    c = 2.457 * log(inside)
    a = _power16(c)
    y = _power16(re / 37530)
    r = re / 8
    r4 = r * r * r * r
    ratio = y / (a * y + 1)
    turbulent = r4 * r4 * r4 * ratio * sqrt(ratio)
    a_slope = -16 * 0.9 * 2.457 * smooth_part / inside * _power15(c)
    ratio_slope = (16 - y * a_slope) / (a * y + 1)
    slope = turbulent / (1 + turbulent) * (12 + 1.5 * ratio_slope) / 12
    return 64 * (1 + turbulent) ** (1 / 12), slope


def _power16(x: Any) -> Any:
    x2 = x * x
    x4 = x2 * x2
    x8 = x4 * x4
    return x8 * x8


def _power15(x: Any) -> Any:
    x2 = x * x
    x4 = x2 * x2
    return x4 * x4 * x4 * x2 * x


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


def rising_root(drop: Any, linear: Any, quadratic: Any) -> Any:
    r"""What flows at a drop that has a linear and a quadratic part; odd, without a root's infinite slope at 0.

    .. math:: r x + k x |x| = \Delta p \quad\Rightarrow\quad x = \frac{2 \Delta p}{r + \sqrt{r^2 + 4 k |\Delta p|}}

    \Delta p = `drop` [Pa]; r = `linear` > 0, k = `quadratic` >= 0 in units that fit x, a flow or a velocity.
    """
    return 2 * drop / (linear + sqrt(linear * linear + 4 * quadratic * fabs(drop)))


def local_loss_flow(p_a: Any, p_b: Any, diameter: Any, loss: Any, laminar: Any, fluid: Fluid) -> Any:
    r"""Flow [m^3/s] from a to b through a local loss in a round bore.

    .. math:: p_a - p_b = \left(\zeta + \frac{K_1}{Re}\right) \frac{\rho v |v|}{2}, \quad Re = \frac{|v| d}{\nu}, \quad
              q = \frac{\rho}{\rho_0} \frac{\pi}{4} d^2 v

    \zeta = `loss` [-] at high Reynolds numbers; K_1 = `laminar` [-] > 0; d = `diameter` [m] where v [m/s] is; \rho
    [kg/m^3], \nu [m^2/s] at the mean pressure, \rho_0 at 0 bar gauge.
    Source: W. B. Hooper, Chem. Eng. 88 (1981) 17, 96-100; Altshul's form in I. E. Idelchik, Handbook of Hydraulic
    Resistance.
    """
    mean: Any = (p_a + p_b) / 2
    rho = fluid.density(mean)
    linear = laminar * rho * fluid.kinematic_viscosity(mean) / (2 * diameter)
    v = rising_root(p_a - p_b, linear, loss * rho / 2)
    return referred_flow(pi / 4 * diameter * diameter * v, mean, fluid)


def pipe_friction_flow(
    p_a: Any, p_b: Any, length: Any, diameter: Any, roughness: Any, fluid: Fluid, loss_coefficient: Any = 0.0,
    laminar_coefficient: Any = 0.0,
) -> Any:  # fmt: skip
    r"""Flow [m^3/s] from a to b through a round pipe at a given drop: :func:`pipe_friction_drop` solved for q.

    .. math:: \Delta p = \left(f \frac{l}{d} + K + \frac{K_1}{Re}\right) \frac{\rho v |v|}{2}
              \quad\Leftrightarrow\quad f Re^2 + \frac{d}{l} (K Re^2 + K_1 Re) = \frac{2 |\Delta p| d^3}{\rho \nu^2 l}

    Symbols as there, K_1 = `laminar_coefficient` [-], density and viscosity at the mean pressure. Newton's method on
    the logarithms, in which the law rises with a slope between 1 and 4, from the laminar or from Colebrook's explicit
    answer; exact to rounding.
    Source: Darcy-Weisbach with Churchill (1977).
    """
    mean: Any = (p_a + p_b) / 2
    drop = p_a - p_b
    rho, nu = fluid.density(mean), fluid.kinematic_viscosity(mean)
    known = 2 * fabs(drop) * diameter**3 / (rho * nu * nu * length)
    per_length = diameter / length
    per_reynolds = _resistance_at(
        known, roughness / diameter, loss_coefficient * per_length, laminar_coefficient * per_length
    )
    v = drop * 2 * diameter * diameter / (rho * nu * length * per_reynolds)
    return referred_flow(pi / 4 * diameter * diameter * v, mean, fluid)


def _resistance_at(known: Any, relative_roughness: Any, local: Any, laminar: Any) -> Any:
    """f Re + local Re + laminar [-] where times Re it is `known`."""
    creeping = 64 + laminar
    target = maximum(known, creeping + local)  # Re = 1, below which f Re is 64 to 1e-100
    root = sqrt(target)
    slow = target / _laminar_resistance_at(target, local, creeping)
    colebrook = -2 / log(10.0) * root * log(relative_roughness / 3.7 + 2.51 / root)
    fast = 2 * target / (laminar + sqrt(laminar * laminar + 4 * target * (target / (colebrook * colebrook) + local)))
    re = where(slow < _CRITICAL, slow, maximum(fast, _CRITICAL))
    for _ in range(_NEWTON_STEPS):
        friction, slope = _friction_and_slope(re, relative_roughness)
        resistance = friction + local * re + laminar
        exponent = 1 + (friction * slope + local * re) / resistance
        re = maximum(re * exp(log(target / (resistance * re)) / exponent), 1.0)
    friction, _ = _friction_and_slope(re, relative_roughness)
    creeps = known < creeping + local
    return where(creeps, _laminar_resistance_at(known, local, creeping), friction + local * re + laminar)


def _laminar_resistance_at(known: Any, local: Any, creeping: Any) -> Any:
    """creeping + local Re [-] where times Re it is `known`."""
    return (creeping + sqrt(creeping * creeping + 4 * local * known)) / 2


def short_tube_flow(p_a: Any, p_b: Any, diameter: Any, length: Any, fluid: Fluid) -> Any:
    r"""Flow [m^3/s] from a to b through a short tube with sharp entry and developing laminar flow.

    .. math:: \Delta p = \xi \frac{\rho v |v|}{2}, \quad q = \frac{\rho}{\rho_0} \frac{\pi}{4} d^2 v, \quad
              \xi = w \left(1.5 + 13.74 \sqrt{x}\right) + (1 - w) \left(2.28 + 64 x\right), \quad
              w = \frac{C}{C + x^2}, \quad x = \frac{l \nu}{d^2 |v|}

    d = `diameter`, l = `length` [m]; v [m/s]; x = l/(d Re) [-]; C = 0.000212; \rho [kg/m^3], \nu [m^2/s] at the mean
    pressure, \rho_0 at 0 bar gauge. Merritt's two formulas, C_d = \xi^{-1/2} for x below and above 1/50, differ by
    1.7 % there; Shah's weight w joins them and stays within 1.5 % of the flow of the one that holds. Solved by Newton's
    method on the logarithms.
    Source: H. E. Merritt, Hydraulic Control Systems (1967), chapter 3, after Shapiro, Siegel & Kline (1954); R. K.
    Shah, J. Fluids Eng. 100 (1978) 177-179.
    """
    mean: Any = (p_a + p_b) / 2
    drop = p_a - p_b
    rho, nu = fluid.density(mean), fluid.kinematic_viscosity(mean)
    unit = nu * length / (diameter * diameter)
    resistance = _entrance_resistance_at(2 * fabs(drop) / (rho * unit * unit))
    v = 2 * drop / (rho * unit * resistance)
    return referred_flow(pi / 4 * diameter * diameter * v, mean, fluid)


def _entrance_resistance_at(known: Any) -> Any:
    """xi/x [-] of a short tube where xi/x^2 is `known`."""
    target = maximum(known, _SLOWEST)
    y = 2 * target / (64 + sqrt(64 * 64 + 4 * 2.28 * target))
    for _ in range(_NEWTON_STEPS):
        resistance, slope = _entrance_and_slope(y)
        y = y * exp(log(target / (resistance * y)) / (1 + slope))
    resistance, _ = _entrance_and_slope(where(known > _SLOWEST, y, known / 64))
    return resistance


def _entrance_and_slope(y: Any) -> tuple[Any, Any]:
    """xi/x at y = 1/x [-], and its logarithmic slope."""
    root = sqrt(maximum(y, _SLOWEST / 64))  # below, its weight is under 1e-16
    short, long = 1.5 * y + 13.74 * root, 2.28 * y + 64
    w = 0.000212 * y * y / (1 + 0.000212 * y * y)
    resistance = w * short + (1 - w) * long
    rise = w * (1.5 * y + 6.87 * root) + (1 - w) * 2.28 * y + 2 * w * (1 - w) * (short - long)
    return resistance, rise / resistance


def radial_flow(p_a: Any, p_b: Any, inner: Any, outer: Any, height: Any, angle: Any, fluid: Fluid) -> Any:
    r"""Flow [m^3/s] between parallel discs from the inner edge a to the outer edge b, laminar.

    .. math:: q = \frac{\rho}{\rho_0} \frac{\alpha h^3}{12 \mu \ln(d_2/d_1)} (p_a - p_b)

    d_1 = `inner`, d_2 = `outer` diameter, h = `height` [m]; \alpha = `angle` [rad] of the sector, 2 \pi for a whole
    disc, whose volume flow is \pi h^3 \Delta p/(6 \mu \ln(r_2/r_1)); all else as in :func:`slot_flow`.
    Source: Poiseuille flow between parallel discs; H. E. Merritt, Hydraulic Control Systems (1967), chapter 3.
    """
    return slot_flow(p_a, p_b, angle, height, log(outer / inner), fluid)
