r"""Energy of the fluid that moves in a line, and what the line turns into heat. No components here.

A line's momentum is that of mass flow, (\rho_0/A) dq/dt = -dp/dx - g, while what passes carries the power
\rho_0 q w(p), dw = dp/\rho. The energy whose flow that is, is per length

.. math:: A\,e(p) + \frac{\rho_0^2 q^2}{2 A \rho} = A\,e + \tfrac12 \rho A v^2

It is kept but for \tfrac12 v^2 A\,d\rho/dt [W/m], which the convective term, left out of the momentum, would balance:
v/a of the motion's power, of either sign. Over a closed line it sums up to nothing, to that order squared. It is booked
with the friction, so that the books close exactly.
Source: own derivation: what the equations conserve, E(r, q) with r = \rho/\rho_0, has
E_rr = (A^2/\rho_0) (dp/dr) E_qq, and begins with these two terms in powers of q if without flow it is A e; on e and w,
L. D. Landau, E. M. Lifshitz, Fluid Mechanics, 2nd ed., sections 2 and 6.
"""

from typing import Any

from crescentlab.fluid import Fluid


def kinetic_energy(inertance: Any, square: Any, p: Any, fluid: Fluid) -> Any:
    r"""\tfrac12 I q^2 \rho_0/\rho(p) [J], which is \tfrac12 \rho A l v^2.

    I = `inertance` [Pa s^2/m^3], \rho_0 l/A; q^2 = `square` [m^6/s^2]; p [Pa] where the density is taken.
    """
    return inertance * square / 2 * fluid.rho_0 / fluid.density(p)


def heat(friction: Any, q: Any, p_from: Any, p_to: Any, p: Any, rate: Any, kinetic: Any, fluid: Fluid) -> Any:
    r"""Power [W] that enters a column of fluid and does not accelerate it.

    .. math:: \frac{\rho_0}{\rho} F + q \rho_0 \left(w_1 - w_2 - \frac{p_1 - p_2}{\rho}\right)
              + \frac{T}{\beta} \frac{dp}{dt}

    F = `friction` [W], flow q [m^3/s] times what friction takes of the pressure; p_1 = `p_from`, p_2 = `p_to` [Pa] at
    the ends of the column; \rho, \beta at p [Pa], dp/dt = `rate` [Pa/s]; T = `kinetic` [J]. The first term is the power
    of friction. The second is what the fluid gains by expanding, as far as one density does not tell: of the order of
    ((p_1 - p_2)/\beta)^2 where p lies amid, of (p_1 - p_2)/\beta where it is the pressure of one end, and zero without
    flow. The last is what the convective term would balance.
    """
    rho = fluid.density(p)
    expansion = fluid.rho_0 * q * (fluid.enthalpy(p_from) - fluid.enthalpy(p_to) - (p_from - p_to) / rho)
    return fluid.rho_0 / rho * friction + expansion + kinetic * rate / fluid.bulk_modulus(p)
