r"""The vapour cavity that opens at the end of a line whose fluid would part from what holds it. No components here.

Without a cavity an end that gives its pressure answers flow at once, p_s = w + Z q. It gives no less than P_c, and what
the waves then take away more than the end brings becomes a cavity, till they have brought it back:

.. math:: p = P_c, \quad q_w = (P_c - w)/Z, \quad \frac{\rho}{\rho_0} \frac{dV}{dt} = q_w - q = (P_c - p_s)/Z
          \quad \text{while } V > 0 \text{ or } p_s < P_c, \qquad p = p_s, \; q_w = q \quad \text{else}

w [Pa] wave arriving; Z [Pa s/m^3]; q [m^3/s] flow into the end, q_w that into the line; V [m^3] volume of the cavity;
P_c [Pa] gauge: the vapour pressure. All in SI, on floats and symbols.
Source: discrete vapour cavity model (DVCM): Wylie & Streeter, Fluid Transients in Systems (1993), on column separation,
with the cavity at an end alone; A. Bergant, A. R. Simpson, A. S. Tijsseling, J. Fluids Struct. 22 (2006) 135-171.
"""

from dataclasses import dataclass
from typing import Any

from crescentlab.component import Equations
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr, fail_when, maximum, when, where

LEAST = 1e-9
"""Share of the bore's volume from which on a cavity is told to be open."""


@dataclass(frozen=True)
class CavityEnd:
    """An end that gives its pressure, with its cavity."""

    p: Any
    """pressure of the end [Pa]"""
    q: Any
    """flow into the line [m^3/s]"""
    growth: Any
    """q less the flow into the end [m^3/s]: what becomes the cavity"""


def least_pressure(fluid: Fluid) -> Any:
    """P_c [Pa] gauge: vapour pressure; absolute zero without vapour, where the run ends; None under tension."""
    if fluid.cavity_pressure is not None:
        return fluid.cavity_pressure
    return None if fluid.tension else -fluid.atmospheric_pressure


def cavity_end(wave: Any, Z: Any, q: Any, is_open: Expr, fluid: Fluid) -> CavityEnd:
    """Pressure and flows of an end that receives the flow q [m^3/s]; is_open [-] is 1 while its cavity is."""
    p, least = wave + Z * q, least_pressure(fluid)
    if least is None:
        return CavityEnd(p, q, 0.0)
    short = where(is_open == 1, least - p, maximum(least - p, 0.0))
    return CavityEnd(where(is_open == 1, least, maximum(p, least)), q + short / Z, short / Z)


def cavity_events(end: str, volume: Expr, is_open: Expr, bore: Any, fluid: Fluid) -> Equations:
    """How the cavity of end a or b opens and closes, or, in fluid without vapour, that the run ends there.

    A cavity counts as open from a share of the volume of the `bore` [m^3] on.
    """
    if fluid.cavity_pressure is None:
        return {
            f"parts_at_{end}": fail_when(
                volume > LEAST * bore,
                f"its end {end} is below absolute zero: the column of fluid would part, and this fluid has no vapour "
                "to fill the gap; write a fluid that evaporates (cavitating_oil, mineral_oil, water), of which this "
                "line then opens a cavity there, for aerated oil a distributed_line, or tension: true in the fluid to "
                "go on",
            )
        }
    return {
        f"opens_{end}": when((is_open == 0) & (volume > LEAST * bore), **{f"open_{end}": 1.0}),
        f"closes_{end}": when((is_open == 1) & (volume < 0.0), **{f"open_{end}": 0.0, f"cavity_{end}": 0.0}),
    }
