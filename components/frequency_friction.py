"""Laminar friction that depends on frequency: Zielke's weighting function, fitted by first-order lags. No components.

The wall shear of unsteady laminar flow in a round bore of radius R [m] adds to the steady pressure gradient

.. math:: g_u = \\frac{4 \\nu \\rho_0}{R^2 A} \\int_0^t W(\\tau) \\frac{dq}{dt'} dt',
          \\quad \\tau = \\frac{\\nu (t - t')}{R^2},
          \\qquad W(\\tau) = \\sum_{j=1}^\\infty e^{-\\zeta_j^2 \\tau} \\approx \\sum_{k=1}^{10} m_k e^{-n_k \\tau}

g_u [Pa/m]; q [m^3/s] mass flow over the density rho_0; A [m^2]; nu [m^2/s]; zeta_j [-] zeros of the Bessel function
J_2. Each term of the fit is a flow u_k [m^3/s] that lags behind q: du_k/dt = (n_k nu/R^2) (q - u_k), and the integral
is the sum of m_k (q - u_k). The whole integral of W is 1/12 (the sum of zeta_j^-2); what the terms in use lack of it
belongs to times shorter than theirs and acts as inertia, :func:`added_inertia`: with all terms 0.0014 of the fluid's,
which brings the impedance from 1.6e-3 to 5e-4 of Zielke's up to omega R^2/nu = 1e6, and makes any number of terms
right for slow changes. Not for turbulent mean flow, whose weighting function decays faster.
Source: W. Zielke, J. Basic Eng. 90 (1968) 109-115; the fit: T. Kagawa, I. Lee, A. Kitagawa, T. Takenaka, High speed and
accurate computing method of frequency-dependent friction in laminar pipe flow, Trans. JSME B 49 (1983) 2638-2644.
"""

from typing import Any

from crescentlab.fluid import Fluid
from crescentlab.maths import Expr, exp, pi, stack

RATES = (
    2.63744e1, 7.28033e1, 1.87424e2, 5.36626e2, 1.57060e3, 4.61813e3, 1.36011e4, 4.00825e4, 1.18153e5, 3.48316e5,
)  # fmt: skip
"""n_k [-] of Kagawa's fit, slowest first."""

WEIGHTS = (1.0, 1.16725, 2.20064, 3.92861, 6.78788, 11.6761, 20.0612, 34.4541, 59.1642, 101.590)
"""m_k [-] of Kagawa's fit."""

MOST_TERMS = len(RATES)
"""Terms of the fit: within 0.3 % of W from tau = 1e-5 to 0.1; each term left out makes the shortest time 3 times as
long."""


def lacking(terms: int) -> float:
    """1/12 less the integral of the terms in use [-]."""
    return 1 / 12 - sum(m / n for m, n in zip(WEIGHTS[:terms], RATES, strict=False))


def added_inertia(terms: int) -> float:
    """Inertia that stands for the times shorter than those of the terms in use, over the fluid's [-]; 0 for none."""
    return 4 * lacking(terms) if terms else 0.0


def lag_rate(term: int, p: Expr, diameter: Any, fluid: Fluid) -> Any:
    r"""n_k \nu/R^2 [1/s] of a term counted from 0, at pressure p [Pa]."""
    return 4 * RATES[term] / (diameter * diameter) * fluid.kinematic_viscosity(p)


def shear(p: Expr, diameter: Any, fluid: Fluid) -> Any:
    r"""4 \nu \rho_0/(R^2 A) [Pa s/m^4]: gradient per unit of the weighted flow."""
    area = pi / 4 * diameter * diameter
    return 16 * fluid.kinematic_viscosity(p) * fluid.rho_0 / (diameter * diameter * area)


def terms_of(lagging: Any, terms: int, places: int) -> list[Any]:
    """The vector of lagging flows cut into one vector per term, each of one flow per place."""
    return [lagging[k * places : (k + 1) * places] for k in range(terms)]


def added_gradient(q: Any, lags: list[Any], p: Any, diameter: Any, fluid: Fluid) -> Any:
    """g_u [Pa/m] from the flows q [m^3/s] and those that lag behind them."""
    weighted: Any = 0.0
    for weight, lag in zip(WEIGHTS, lags, strict=False):
        weighted = weighted + weight * (q - lag)
    return shear(p, diameter, fluid) * weighted


def moving(q: Any, lags: list[Any], terms: int) -> Any:
    r"""Square of the flow [m^6/s^2] that with the inertia of the line makes the energy of the motion.

    .. math:: (1 + \epsilon)\,q^2 + \sum_k \frac{4 m_k}{n_k} u_k^2

    \epsilon [-] = :func:`added_inertia`. The lagging flows keep the energy that a profile has more than a flat one: in
    steady laminar flow it is 4/3 q^2, the parabola's, in oscillation that of Womersley's profile. With
    :func:`lag_loss` it takes up what g_u takes: u_k' = (n_k \nu/R^2)(q - u_k), so q (q - u_k) is (q - u_k)^2, lost, and
    u_k u_k' R^2/(n_k \nu), stored. Source: own derivation; checked against the profile.
    """
    found: Any = (1 + added_inertia(terms)) * q * q
    for weight, rate, lag in zip(WEIGHTS, RATES, lags, strict=False):
        found = found + 4 * weight / rate * lag * lag
    return found


def lag_loss(q: Any, lags: list[Any], p: Any, diameter: Any, fluid: Fluid) -> Any:
    r"""What frequency-dependent friction turns into heat, (4 \nu \rho_0/(R^2 A)) \sum_k m_k (q - u_k)^2 [W/m]."""
    lost: Any = 0.0
    for weight, lag in zip(WEIGHTS, lags, strict=False):
        lost = lost + weight * (q - lag) * (q - lag)
    return shear(p, diameter, fluid) * lost


def lagging_rates(q: Any, lags: list[Any], p: Any, diameter: Any, fluid: Fluid) -> Any:
    """du_k/dt [m^3/s^2] as one vector, term by term."""
    return stack(*[lag_rate(k, p, diameter, fluid) * (q - lag) for k, lag in enumerate(lags)])


def lag_step(term: int, dt: Any, p: Any, diameter: Any, fluid: Fluid) -> tuple[Any, Any]:
    r"""E = e^{-z} and (1 - E)/z [-], z = n_k \nu dt/R^2: how q - u_k goes on over a tick of dt [s] while q is a ramp.

    .. math:: (q - u_k)' = E\,(q - u_k) + \frac{1 - E}{z} (q' - q)

    Source: G. A. Schohl, J. Fluids Eng. 115 (1993) 420-424.
    """
    z = lag_rate(term, p, diameter, fluid) * dt
    kept = exp(-z)
    return kept, (1 - kept) / z


def unit_lag(terms: int, dt: Any, p: Any, diameter: Any, fluid: Fluid) -> Any:
    r"""What :func:`lacking` weighs in a tick of dt [s] [-]: its R^2/(\nu dt), the limit of (1 - E)/z for fast terms."""
    return lacking(terms) * RATES[0] / (lag_rate(0, p, diameter, fluid) * dt) if terms else 0.0
