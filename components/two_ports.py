"""Exact linear laws of lines in the frequency domain: propagation, characteristic impedance, two-ports. No components.

A line of l [m] between its ends a and b obeys, for small oscillations e^{j omega t},

.. math:: -\\frac{dp}{dx} = z\\,q, \\quad -\\frac{dq}{dx} = y\\,p, \\; \\Gamma = \\sqrt{z y}, \\; Z_c = \\sqrt{z/y},
          \\qquad \\begin{pmatrix} q_a \\\\ q_b \\end{pmatrix} = \\frac{1}{Z_c}
          \\begin{pmatrix} \\coth\\Gamma l & -1/\\sinh\\Gamma l \\\\ -1/\\sinh\\Gamma l & \\coth\\Gamma l \\end{pmatrix}
          \\begin{pmatrix} p_a \\\\ p_b \\end{pmatrix}

p [Pa]; q [m^3/s] mass flow over the density rho_0 at 0 bar gauge, positive into the line at both ends; z [Pa s/m^4],
y [m^2/(s Pa)] per length. Source: A. F. D'Souza & R. Oldenburger, J. Basic Eng. 86 (1964) 589-598;
J. S. Stecki & D. C. Davis, Proc. IMechE A 200 (1986) 215-228.
"""

from typing import Any

import numpy as np

from crescentlab.fluid import Fluid

from .flow_laws import pipe_friction_drop

LARGEST_LAMINAR = 2300.0
"""Reynolds number [-] up to which the friction is that of oscillating laminar flow."""

ASYMPTOTIC_FROM, TERMS = 40.0, 12
"""|y| from which Hankel's series in 1/y is used, and its terms: the last is below 1e-16 of the first."""

Array = Any
"""Array of complex numbers, one for each frequency."""


def inertia_factor(w: Array) -> Array:
    r"""Inertia with friction over inertia without [-] of oscillating laminar flow in a round bore.

    .. math:: N = \left[1 - \frac{2 J_1(\zeta)}{\zeta J_0(\zeta)}\right]^{-1} = \frac{I_0(\sqrt{w})}{I_2(\sqrt{w})},
              \qquad \zeta^2 = -w, \quad w = j \omega R^2 / \nu

    w [-], shape (m,), of positive imaginary part; 8/w + 4/3 for small, 1 + 2/sqrt(w) for large ones. By the continued
    fraction of I_2/I_1 (Gauss), for large w by Hankel's series (Abramowitz & Stegun 1964, 9.1.73 and 9.7.1).
    Source: W. Zielke, J. Basic Eng. 90 (1968) 109-115; D'Souza & Oldenburger (1964).
    """
    w = np.asarray(w, dtype=complex)
    y = np.sqrt(w)
    large = np.abs(y) > ASYMPTOTIC_FROM
    y_large = np.where(large, y, ASYMPTOTIC_FROM)
    series = y_large * _hankel(2, y_large) / _hankel(1, y_large)
    w_small = np.where(large, 1.0, w)
    part = np.zeros_like(w)
    for k in range(int(2 * ASYMPTOTIC_FROM) + 20, 1, -1):
        part = w_small / (2 * k + part)
    return 1 + 2 / np.where(large, series, part)


def _hankel(order: int, y: Array) -> Array:
    """sqrt(2 pi y) exp(-y) I_order(y), the series in 1/y."""
    term = total = np.ones_like(y, dtype=complex)
    for k in range(1, TERMS + 1):
        term = -term * (4 * order * order - (2 * k - 1) ** 2) / (8 * k * y)
        total = total + term
    return total


def line_series(
    omega: Array, diameter: float, roughness: float, fluid: Fluid, p: float, q: float, loss_per_length: float = 0.0
) -> Array:
    r"""Series impedance z [Pa s/m^4] per length of a round line about the mean pressure p [Pa] and mean flow q [m^3/s].

    .. math:: z = \frac{j\omega\rho_0}{A} N \;(Re \le 2300), \qquad
              z = \frac{j\omega\rho_0}{A} + \frac{\partial g}{\partial q} \;(Re > 2300), \qquad
              \text{plus } k \rho_0 |v| / A

    g [Pa/m] steady friction (Churchill); k = `loss_per_length` [1/m] on the dynamic head; v [m/s]; omega [rad/s], shape
    (m,). Above Re = 2300 the friction is that of steady flow, linearised: turbulent friction that depends on frequency
    is left out, which is good well below the frequency at which the boundary layer of the oscillation is thinner than
    the viscous sublayer, and errs towards too little damping above. Convection, v/a, is left out.
    """
    area = np.pi / 4 * diameter * diameter
    rho, nu, rho_0 = float(fluid.density(_plain(p))), float(fluid.kinematic_viscosity(_plain(p))), float(fluid.rho_0)
    v = rho_0 * q / (rho * area)
    inertia = 1j * omega * rho_0 / area
    extra = loss_per_length * rho_0 * abs(v) / area
    if abs(v) * diameter / nu <= LARGEST_LAMINAR:
        return inertia * inertia_factor(1j * omega * diameter * diameter / (4 * nu)) + extra
    step = 1e-5 * abs(q)
    high, low = (pipe_friction_drop(q + s, 1.0, diameter, roughness, fluid, _plain(p)) for s in (step, -step))
    return inertia + float(high - low) / (2 * step) + extra


def line_shunt(omega: Array, diameter: float, fluid: Fluid, p: float) -> Array:
    r"""Shunt admittance y = j omega A rho/(rho_0 beta) [m^2/(s Pa)] per length of a rigid round line."""
    rho, beta = float(fluid.density(_plain(p))), float(fluid.bulk_modulus(_plain(p)))
    return 1j * omega * np.pi / 4 * diameter * diameter * rho / (float(fluid.rho_0) * beta)


def two_port_of(series: Array, shunt: Array, length: float, resistance_a: float = 0.0) -> Array:
    """Flows into a uniform line per pressures at its ends [m^3/(s Pa)], shape (m, 2, 2); see the module.

    `series`, `shunt`: z and y, shape (m,); `resistance_a` [Pa s/m^3] of a local loss at end a, linearised.
    """
    gamma, impedance = np.sqrt(series * shunt) * length, np.sqrt(series / shunt)
    gamma, impedance = (np.where(gamma.real < 0, -v, v) for v in (gamma, impedance))
    once, twice = np.exp(-gamma), np.exp(-2 * gamma)
    own, across = (1 + twice) / (1 - twice) / impedance, -2 * once / (1 - twice) / impedance
    y = np.stack([np.stack([own, across], axis=-1), np.stack([across, own], axis=-1)], axis=-2)
    share = 1 / (1 + resistance_a * own)  # the pressure behind the loss is p_a - R q_a
    q_a = y[:, :1, :] * share[:, None, None]
    behind = np.array([1.0, 0.0]) - resistance_a * q_a[:, 0, :]
    q_b = across[:, None] * behind + own[:, None] * np.array([0.0, 1.0])
    return np.concatenate([q_a, q_b[:, None, :]], axis=1)


def _plain(p: float) -> Any:
    """A float where a law asks for an expression: laws work on both."""
    return p
