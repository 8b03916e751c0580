"""Gears of the crescent pump."""

from __future__ import annotations

import math

import numpy as np
from crescentlab.components.crescent_gears import CrescentGears

from evidence import Number, evidence

MM, MM3 = 1e-3, 1e-9


@evidence(
    "crescent_gears",
    source="Rundo & Corvaglia (2016), Table 3 and section 6: radii, contact and displacement as printed",
    tolerance=7e-3,
    because="the radii are printed to 0.05 mm; on the driven tip alone that is 0.7 % of the displacement",
)
def as_printed() -> list[Number]:
    """Gears 13/16 of the paper: base radii, tips, operating pressure angle, displacement."""
    part = CrescentGears()
    mesh, chambers = part.chambers.mesh, part.chambers
    return [
        Number("base radius of the driver", 22.049 * MM, mesh.driver_base, "mm"),
        Number("base radius of the driven gear", 27.138 * MM, mesh.driven_base, "mm"),
        Number("tip radius of the driver", 29.1 * MM, mesh.driver_tip, "mm"),
        Number("tip radius of the driven gear", 28.6 * MM, mesh.driven_tip, "mm"),
        Number("operating pressure angle", math.radians(32), mesh.angle, "deg"),
        Number("displacement", 13.65e-6 / (2 * math.pi), chambers.displaced / mesh.pitch, "cc/rev"),
    ]


@evidence(
    "crescent_gears",
    source="Eqs. 3-5 of Rundo & Corvaglia (2016) written out at nu_d = 3 deg, and integrated over the pitch",
    tolerance=1e-6,
    because="trapezoidal rule on 20000 points between the jumps",
)
def rates() -> list[Number]:
    """Rates of the volumes over the shaft's angle, and the volume displaced in a pitch."""
    part = CrescentGears()
    mesh, thickness, tau = part.chambers.mesh, 13e-3, 13 / 16
    rho_1, rho_2, pitch = mesh.driver_base, mesh.driven_base, 2 * math.pi / 13

    def delivery(y: float) -> float:
        roll = tau * y + (1 - tau) * math.tan(mesh.angle)
        inner, outer = rho_1**2 * (1 + y * y), rho_2**2 * (1 + roll * roll)
        return thickness / 2 * (inner - (29.1 * MM) ** 2 + tau * ((28.6 * MM) ** 2 - outer))

    nu = math.radians(3)
    now = part.equations(
        phi_shaft=nu, omega_shaft=1.0, mesh_start=0.0, started=1.0, p_delivery=5e5, p_suction=0.0, p_trapped=8e5
    )
    d, s = delivery(nu + mesh.nu_01), -delivery(nu + mesh.nu_01 + pitch)
    swept = -np.trapezoid([delivery(mesh.nu_01 + a) for a in np.linspace(0, pitch, 20001)], dx=pitch / 20000)
    return [
        Number("dVd/dphi", d, now["dVd"], "mm3/rad"),
        Number("dVs/dphi", s, now["dVs"], "mm3/rad"),
        Number("dVt/dphi", -d - s, now["dVt"], "mm3/rad"),
        Number("torque", -(5e5 * d + 8e5 * (-d - s)), now["torque"], "N m"),
        Number("displacement", float(swept) / pitch, now["displacement"], "cc/rev"),
    ]


@evidence(
    "crescent_gears",
    source="the space between two involutes drawn as polygons, by the shoelace formula, in tests/test_gears.py",
    tolerance=2e-5,
    because="the polygon's figures are rounded to five digits",
)
def spaces() -> list[Number]:
    """Tooth spaces that are carried over, and the trapped volume where it begins and ends."""
    chambers = CrescentGears().chambers
    return [
        Number("tooth space of the driver", 566.75 * MM3, chambers.driver_space, "mm3"),
        Number("tooth space of the driven gear", 528.76 * MM3, chambers.driven_space, "mm3"),
        Number("trapped volume where it begins", 42.527 * MM3, chambers.trapped_at_start, "mm3"),
        Number("trapped volume where it ends", 38.552 * MM3, chambers.trapped_at_end, "mm3"),
    ]
