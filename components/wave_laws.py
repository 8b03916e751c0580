"""Waves in a line: the two steps of Lax-Wendroff, and the wave arriving at an end. No components here.

All work on floats (vectors are numpy arrays) and symbols, in SI. Flows q are mass flow over the density rho_0 at
0 bar gauge, so that with r = rho/rho_0 mass and momentum read

.. math:: A \\frac{\\partial r}{\\partial t} + \\frac{\\partial q}{\\partial x} = 0, \\qquad
          \\frac{\\rho_0}{A} \\frac{\\partial q}{\\partial t} + \\frac{\\partial p}{\\partial x} = -g(q, p)

A [m^2]; p [Pa, gauge]; g [Pa/m] friction. The convective term, of the order of v/a, is left out.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from crescentlab.fluid import Fluid
from crescentlab.maths import fabs, log, maximum, sqrt

NEWTON_STEPS = 6
"""Newton steps from density to pressure: rounding remains above 0 bar, 1 Pa after a fall from 1 to -0.9 bar."""

HALF_STEPS, FULL_STEPS = 3, 4
"""Newton steps within a tick. Waves of 0.5 bar per node are exact to 1e-3 Pa in the half step, which moves momentum
alone; the full step, which must keep mass, begins so close that rounding remains."""

Friction = Callable[[Any, Any], Any]
"""Pressure gradient g(q, p) [Pa/m] of steady friction."""


def wave_speed(p: Any, fluid: Fluid) -> Any:
    r"""a = \sqrt{\beta/\rho} [m/s] in a rigid line at p [Pa, gauge]."""
    return sqrt(fluid.bulk_modulus(p) / fluid.density(p))


def impedance(p: Any, area: Any, fluid: Fluid) -> Any:
    r"""Z = \rho_0 a / A [Pa s/m^3]: pressure over flow (mass flow over \rho_0) of a travelling wave."""
    return fluid.rho_0 * wave_speed(p, fluid) / area


def pressure_of_density(density: Any, guess: Any, fluid: Fluid, steps: int = NEWTON_STEPS) -> Any:
    r"""Pressure [Pa, gauge] at which the fluid has `density`, by Newton's method on \ln\rho(p).

    Exact in one step for constant bulk modulus. Aerated oil is so soft near absolute zero that no step but the last
    may take away more than half of the absolute pressure.
    """
    p = guess
    for _ in range(steps - 1):
        step = fluid.bulk_modulus(p) * log(density / fluid.density(p))
        p = p + maximum(step, -fabs(p + fluid.atmospheric_pressure) / 2)
    return p + fluid.bulk_modulus(p) * log(density / fluid.density(p))


@dataclass(frozen=True)
class Between:
    """Half a step later and half a cell further: what passes between neighbouring nodes."""

    q: Any
    """flow [m^3/s]"""
    p: Any
    """pressure [Pa]"""
    g: Any
    """friction [Pa/m]"""


def half_step(p: Any, q: Any, dt: Any, dx: Any, area: Any, friction: Friction, fluid: Fluid) -> Between:
    r"""First of the two steps of Richtmyer's Lax-Wendroff scheme, from nodes dx [m] apart to the middle of the cells.

    .. math:: U_{i+1/2} = \tfrac12 (U_i + U_{i+1}) - \frac{\Delta t}{2\Delta x}(F_{i+1} - F_i)
              + \tfrac12 \Delta t\, S_{i+1/2}

    U = (A r, q); F = (q, A p/\rho_0); S = (0, -A g/\rho_0); \Delta t = dt [s], the whole step. With
    :func:`full_step` of second order: a wave of phase angle \theta per node keeps
    1 - 4\nu^2(1 - \nu^2)\sin^4(\theta/2) of its energy per step, \nu = a \Delta t/\Delta x <= 1.
    Source: R. D. Richtmyer, NCAR Technical Note 63-2 (1962); C. Hirsch, Numerical Computation of Internal and
    External Flows, vol. 2 (1990), section 17.2.
    """
    rho = fluid.density(p)
    p_mean, q_mean = (p[:-1] + p[1:]) / 2, (q[:-1] + q[1:]) / 2
    rho_half = (rho[:-1] + rho[1:]) / 2 - fluid.rho_0 * dt / (2 * dx * area) * (q[1:] - q[:-1])
    q_half = q_mean - area * dt / (2 * fluid.rho_0) * ((p[1:] - p[:-1]) / dx + friction(q_mean, p_mean))
    p_half = pressure_of_density(rho_half, p_mean, fluid, HALF_STEPS)
    return Between(q_half, p_half, friction(q_half, p_half))


def full_step(p: Any, q: Any, between: Between, dt: Any, dx: Any, area: Any, fluid: Fluid) -> tuple[Any, Any]:
    r"""Second of the two steps: pressure [Pa] and flow [m^3/s] of the inner nodes a tick later.

    .. math:: U_i' = U_i - \frac{\Delta t}{\Delta x} (F_{i+1/2} - F_{i-1/2})
              + \tfrac12 \Delta t\, (S_{i-1/2} + S_{i+1/2})

    Symbols and Source: :func:`half_step`.
    """
    rho = fluid.density(p[1:-1]) - fluid.rho_0 * dt / (dx * area) * (between.q[1:] - between.q[:-1])
    gradient = (between.p[1:] - between.p[:-1]) / dx + (between.g[1:] + between.g[:-1]) / 2
    # the pressures half a step ahead tell where a node goes; no guess below half of its absolute pressure
    ahead = between.p[1:] + between.p[:-1] - p[1:-1]
    guess = maximum(ahead, (p[1:-1] - fluid.atmospheric_pressure) / 2)
    return pressure_of_density(rho, guess, fluid, FULL_STEPS), q[1:-1] - area * dt / fluid.rho_0 * gradient


@dataclass(frozen=True)
class Wave:
    """Wave arriving at an end: what its characteristic carries there, friction along it included."""

    p: Any
    """pressure at its foot, plus the friction on the way [Pa]"""
    p_foot: Any
    """pressure at its foot [Pa]"""
    q: Any
    """flow at its foot, positive away from the end [m^3/s]"""


def arriving_wave(p: Any, q: Any, elapsed: Any, dx: Any, friction: Friction, fluid: Fluid) -> Wave:
    r"""Wave arriving `elapsed` [s] after p [Pa] and q [m^3/s], positive away from the end, were taken.

    .. math:: p - Z q = p(x) - Z q(x) + x\, g(q(x), p(x)), \qquad x = \tfrac12 (a(0) + a(x))\, \Delta t

    p, q: values at the end and at its neighbour, dx [m] away, straight lines for p, q and a between them; x [m] the
    foot of the characteristic, in closed form; \Delta t = `elapsed`; Z [Pa s/m^3] of :func:`impedance`.
    Source: Wylie & Streeter, Fluid Transients in Systems (1993), chapter 3.
    """
    a_0, a_1 = wave_speed(p[0], fluid), wave_speed(p[1], fluid)
    share = elapsed * a_0 / (dx - elapsed * (a_1 - a_0) / 2)
    p_foot, q_foot = p[0] + share * (p[1] - p[0]), q[0] + share * (q[1] - q[0])
    return Wave(p_foot + share * dx * friction(q_foot, p_foot), p_foot, q_foot)


def end_flow(p: Any, wave: Wave, loss: Any, area: Any, fluid: Fluid) -> Any:
    r"""Flow [m^3/s] into the line at an end held at pressure p [Pa].

    .. math:: p - k q|q| = p_w + Z (q - q_w), \qquad Z = \tfrac12 (Z(p_f) + Z(p))

    k = `loss` [Pa s^2/m^6], of a local loss at the end; p_w, p_f, q_w: p, p_foot, q of the arriving wave.
    """
    Z = (impedance(wave.p_foot, area, fluid) + impedance(p, area, fluid)) / 2
    drive = p - wave.p + Z * wave.q
    return 2 * drive / (Z + sqrt(Z * Z + 4 * loss * fabs(drive)))


def end_pressure(q: Any, wave: Wave, loss: Any, area: Any, fluid: Fluid) -> Any:
    """Pressure [Pa] at an end that takes flow q [m^3/s] into the line: :func:`end_flow` solved for p, Z predicted."""
    Z_foot = impedance(wave.p_foot, area, fluid)
    Z = (Z_foot + impedance(wave.p + Z_foot * (q - wave.q), area, fluid)) / 2
    return wave.p + Z * (q - wave.q) + loss * q * fabs(q)


def closing_flux(
    p: Any, q: Any, p_new: Any, q_new: Any, taken: Any, wave: Wave, g: Any, dt: Any, dx: Any, area: Any, fluid: Fluid
) -> tuple[Any, Any]:  # fmt: skip
    r"""Flow [m^3/s] and pressure [Pa] between an end and its neighbour that close the books of the half cell there.

    .. math:: \tilde q = \frac{V}{\Delta t} - \frac{A \Delta x}{2 \Delta t}(r' - r), \qquad
              \tilde p = \bar p - \frac{\rho_0 \Delta x}{2 A \Delta t}(q' - q) - \tfrac12 \Delta x\, g

    r, q before and r', q' after the step at the end node; V = `taken` [m^3] through the end during it, exactly;
    \bar p [Pa] mean pressure at the end, that of the mean flow with the `wave` arriving halfway; g [Pa/m];
    flows positive away from the end. Mass is thus kept to rounding. Closing both books, of mass and of momentum,
    leaves a jump at the end sharp and the scheme stable for \nu <= 1 between ends of given pressure or flow.
    """
    r, r_new = fluid.density(p) / fluid.rho_0, fluid.density(p_new) / fluid.rho_0
    p_mean = end_pressure(taken / dt, wave, 0.0, area, fluid)
    q_close = taken / dt - area * dx / (2 * dt) * (r_new - r)
    p_close = p_mean - fluid.rho_0 * dx / (2 * area * dt) * (q_new - q) - dx / 2 * g
    return q_close, p_close
