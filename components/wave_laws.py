"""Waves in a line: one two-step Lax-Wendroff step, and the wave arriving at an end. No components here.

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
from crescentlab.maths import fabs, log, maximum, sqrt, stack

NEWTON_STEPS = 6
"""Newton steps from density to pressure: rounding remains above 0 bar, 1 Pa after a fall from 1 to -0.9 bar."""

Friction = Callable[[Any, Any], Any]
"""Pressure gradient g(q, p) [Pa/m] of steady friction."""


def wave_speed(p: Any, fluid: Fluid) -> Any:
    r"""a = \sqrt{\beta/\rho} [m/s] in a rigid line at p [Pa, gauge]."""
    return sqrt(fluid.bulk_modulus(p) / fluid.density(p))


def impedance(p: Any, area: Any, fluid: Fluid) -> Any:
    r"""Z = \rho_0 a / A [Pa s/m^3]: pressure over flow (mass flow over \rho_0) of a travelling wave."""
    return fluid.rho_0 * wave_speed(p, fluid) / area


def pressure_of_density(density: Any, guess: Any, fluid: Fluid) -> Any:
    r"""Pressure [Pa, gauge] at which the fluid has `density`, by Newton's method on \ln\rho(p).

    Exact in one step for constant bulk modulus. Aerated oil is so soft near absolute zero that no step but the last
    may take away more than half of the absolute pressure.
    """
    p = guess
    for _ in range(NEWTON_STEPS - 1):
        step = fluid.bulk_modulus(p) * log(density / fluid.density(p))
        p = p + maximum(step, -fabs(p + fluid.atmospheric_pressure) / 2)
    return p + fluid.bulk_modulus(p) * log(density / fluid.density(p))


@dataclass(frozen=True)
class Step:
    """Inner nodes after a step, before the ends are known: relative density, flow; and flows between nodes."""

    r: Any
    """rho/rho_0 of the inner nodes [-]."""
    q: Any
    """flow of the inner nodes [m^3/s]."""
    q_between: Any
    """flow between neighbouring nodes at half the step [m^3/s]."""


def lax_wendroff_step(p: Any, q: Any, dt: Any, dx: Any, area: Any, friction: Friction, fluid: Fluid) -> Step:
    r"""One step of Richtmyer's two-step Lax-Wendroff scheme on nodes dx [m] apart.

    .. math:: U_{i+1/2} = \tfrac12 (U_i + U_{i+1}) - \tfrac{\Delta t}{2\Delta x}(F_{i+1} - F_i) + \tfrac{\Delta t}{2}S,
              \quad U_i' = U_i - \tfrac{\Delta t}{\Delta x} (F_{i+1/2} - F_{i-1/2}) + \Delta t\, S

    U = (A r, q); F = (q, A p/\rho_0); S = (0, -A g/\rho_0). Of second order; a wave of phase angle \theta per node
    keeps 1 - 4\nu^2(1 - \nu^2)\sin^4(\theta/2) of its energy per step, \nu = a \Delta t/\Delta x <= 1.
    Source: R. D. Richtmyer, NCAR Technical Note 63-2 (1962); Hirsch, Numerical Computation of Internal and
    External Flows, vol. 2 (1990), section 17.2.
    """
    rho_0, r = fluid.rho_0, fluid.density(p) / fluid.rho_0
    p_a, p_b, q_a, q_b, r_a, r_b = p[:-1], p[1:], q[:-1], q[1:], r[:-1], r[1:]
    r_half = (r_a + r_b) / 2 - dt / (2 * dx * area) * (q_b - q_a)
    p_mean, q_mean = (p_a + p_b) / 2, (q_a + q_b) / 2
    q_half = q_mean - dt * area / (2 * rho_0) * ((p_b - p_a) / dx + friction(q_mean, p_mean))
    p_half = pressure_of_density(r_half * rho_0, p_mean, fluid)
    g = friction(q_half, p_half)
    r_new = r[1:-1] - dt / (dx * area) * (q_half[1:] - q_half[:-1])
    q_new = q[1:-1] - dt * area / rho_0 * ((p_half[1:] - p_half[:-1]) / dx + (g[:-1] + g[1:]) / 2)
    return Step(r_new, q_new, q_half)


def share_out(amount_a: Any, amount_b: Any, n: int) -> Any:
    """Vector of n inner nodes: `amount_a` in halves on the two nodes next to a, `amount_b` likewise at b."""
    near = min(2, n)
    rest = [0.0] * (n - near)
    return stack(*[amount_a / near] * near, *rest) + stack(*rest, *[amount_b / near] * near)


@dataclass(frozen=True)
class Wave:
    """Wave arriving at an end: what its characteristic carries there, friction along it included."""

    p: Any
    """pressure at its foot, plus the friction on the way [Pa]."""
    p_foot: Any
    """pressure at its foot [Pa]."""
    q: Any
    """flow at its foot, positive away from the end [m^3/s]."""


def arriving_wave(p: Any, q: Any, elapsed: Any, dx: Any, friction: Friction, fluid: Fluid) -> Wave:
    r"""Wave arriving `elapsed` [s] after the nodes' p [Pa] and q [m^3/s], positive away from the end, were taken.

    .. math:: x = \tfrac12 (a(0) + a(x))\, \Delta t, \qquad p - Z q = p(x) - Z q(x) + x\, g(q(x), p(x))

    p, q: the values at the end and its next two nodes, dx [m] apart; between them a parabola for p and q and a
    straight line for a(x), with the foot x found in closed form.
    """
    a_0, a_1 = wave_speed(p[0], fluid), wave_speed(p[1], fluid)
    foot = elapsed * a_0 / (dx - elapsed * (a_1 - a_0) / 2)
    p_foot, q_foot = _parabola(p, foot), _parabola(q, foot)
    return Wave(p_foot + foot * dx * friction(q_foot, p_foot), p_foot, q_foot)


def _parabola(y: Any, x: Any) -> Any:
    return y[0] * (1 - x) * (2 - x) / 2 + y[1] * x * (2 - x) + y[2] * x * (x - 1) / 2


def end_flow(p: Any, wave: Wave, loss: Any, area: Any, fluid: Fluid) -> Any:
    r"""Flow [m^3/s] into the line at an end held at pressure p [Pa].

    .. math:: p - k q|q| = p_w + Z (q - q_w), \qquad Z = \tfrac12 (Z(p_w) + Z(p))

    k = `loss` [Pa s^2/m^6], of a local loss at the end; p_w, q_w of the arriving wave.
    """
    Z = (impedance(wave.p_foot, area, fluid) + impedance(p, area, fluid)) / 2
    drive = p - wave.p + Z * wave.q
    return 2 * drive / (Z + sqrt(Z * Z + 4 * loss * fabs(drive)))


def end_pressure(q: Any, wave: Wave, loss: Any, area: Any, fluid: Fluid) -> Any:
    """Pressure [Pa] at an end that takes flow q [m^3/s] into the line: :func:`end_flow` solved for p."""
    Z_foot = impedance(wave.p_foot, area, fluid)
    Z = (Z_foot + impedance(wave.p + Z_foot * (q - wave.q), area, fluid)) / 2
    return wave.p + Z * (q - wave.q) + loss * q * fabs(q)
