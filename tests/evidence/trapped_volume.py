"""The volume trapped between two contacts."""

from __future__ import annotations

import math

from crescentlab.components.fluids import SimpleOil
from crescentlab.components.trapped_volume import TrappedVolume

from evidence import Number, evidence

BAR = 1e5


@evidence(
    "trapped_volume",
    source="Rundo & Corvaglia (2016), Eq. 2, by hand with rho_0/rho = exp(-p/beta)",
    tolerance=1e-12,
    because="rounding",
)
def rate() -> list[Number]:
    """40 mm^3 at 8 bar, shrinking by 2 cm^3/s with 1 cm^3/s coming in; and not existing, with 5 bar at delivery."""
    oil = SimpleOil(density=860.0, kinematic_viscosity=35e-6, bulk_modulus=5e8)
    given = {"p_own": 8 * BAR, "q_port": 1e-6, "p_delivery": 5 * BAR, "V_chamber": 40e-9, "dV_chamber": -2e-6}
    alive = TrappedVolume().equations(**given, exists=1.0, fluid=oil)
    gone = TrappedVolume().equations(**given, exists=0.0, fluid=oil)
    expected = 5e8 / 40e-9 * (math.exp(-8 * BAR / 5e8) * 1e-6 + 2e-6)
    return [
        Number("rate of pressure", expected, alive["der_p_own"], "bar/ms"),
        Number("pressure while it does not exist", 5 * BAR, gone["p"], "bar"),
        Number("flow passed on to delivery", 1e-6, -gone["q_delivery"], "cm3/s"),
    ]


@evidence(
    "trapped_volume",
    source="energy of oil with rho = rho_0 exp(p/beta), V (beta (exp(p/beta) - 1) - p), p^2 V/(2 beta) to first order",
    tolerance=1e-9,
    because="rounding of p^2/(2 beta), 1/1250 of p",
)
def energy() -> list[Number]:
    """40 mm^3 at 8 bar, beta 5000 bar; and none while it does not exist."""
    oil = SimpleOil(density=860.0, kinematic_viscosity=35e-6, bulk_modulus=5e8)
    given = {"p_own": 8 * BAR, "q_port": 0.0, "p_delivery": 5 * BAR, "V_chamber": 40e-9, "dV_chamber": 0.0}
    held = 40e-9 * (5e8 * math.expm1(8 * BAR / 5e8) - 8 * BAR)
    alive, gone = (TrappedVolume().equations(**given, exists=e, fluid=oil)["stored_energy"] for e in (1.0, 0.0))
    return [Number("energy", held, alive, "mJ"), Number("not existing", 0.0, gone, "mJ", size=held)]
