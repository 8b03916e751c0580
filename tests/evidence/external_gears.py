"""Gears of an external gear pump."""

from __future__ import annotations

import math

from crescentlab.components.external_gears import ExternalGears

from evidence import Number, evidence

MM = 1e-3
SIZES = {
    "module": 3 * MM, "thickness": 20 * MM, "addendum": 3 * MM, "dedendum": 3.75 * MM,
    "delivery_volume": 30e-6, "suction_volume": 30e-6,
}  # fmt: skip


def meshing(nu: float, teeth: int = 12) -> float:
    """Area [m^2/rad] both gears sweep less what they take back, from the contact point's own coordinates.

    The contact runs along the line of action, tangent to both base circles, through the pitch point; each gear sweeps
    (r_a^2 - r_c^2)/2 with r_c its distance from the contact.
    """
    r_w, alpha = 1.5 * MM * teeth, math.radians(20)
    r_a, u = r_w + 3 * MM, r_w * math.cos(alpha) * (nu - math.pi / teeth)
    contact = complex(r_w, 0) + u * complex(math.sin(alpha), math.cos(alpha))
    radii = abs(contact), abs(contact - 2 * r_w)
    return sum((r_a * r_a - r * r) / 2 for r in radii)


@evidence(
    "external_gears",
    source="swept areas from the coordinates of the contact point on the line of action; "
    "Ivantysyn & Ivantysynova (2001): 2 pi b (r_a^2 - r_w^2 - p_b^2/12)",
    tolerance=1e-9,
    because="rounding; quadrature is Simpson's, exact for a parabola",
)
def displaced() -> list[Number]:
    """12 teeth of module 3 mm, 20 deg, 20 mm thick: rates over the angle, displacement, and torque at 150 bar."""
    part, pitch = ExternalGears(**SIZES), 2 * math.pi / 12
    given = {"omega_shaft": 1.0, "mesh_start": 0.0, "started": 1.0, "p_delivery": 150e5, "p_suction": 0.0}
    found = []
    for share in (0.0, 0.3, 0.5):
        now = part.equations(phi_shaft=share * pitch, **given)
        rate = 20 * MM * meshing(share * pitch)
        found += [
            Number(f"-dVd/dphi at {share:g} of the pitch", rate, -now["dVd"], "cc/rev"),
            Number(f"torque at {share:g} of the pitch", 150e5 * rate, now["torque"], "N m"),
        ]
    mean = 20 * MM * (meshing(0.0) + 4 * meshing(pitch / 2) + meshing(pitch)) / 6
    book = 20 * MM * (21**2 - 18**2 - (math.pi * 3 * math.cos(math.radians(20))) ** 2 / 12) * 1e-6
    return [
        *found,
        Number("displacement, by quadrature", mean, now["displacement"], "cc/rev"),
        Number("displacement, by the formula", book, now["displacement"], "cc/rev"),
    ]


@evidence(
    "external_gears",
    source="u runs over the base pitch p_b: delta = (p_b^2/4)/(r_a^2 - r_w^2 - p_b^2/12), with r_a = r_w + m "
    "pi^2 cos^2(alpha)/(4 (z + 1)) over 1 - pi^2 cos^2(alpha)/(12 (z + 1))",
    tolerance=1e-9,
    because="rounding",
)
def unevenness() -> list[Number]:
    """(q_max - q_min)/q_mean of gears with 10, 12 and 18 teeth."""
    given = {"omega_shaft": 1.0, "mesh_start": 0.0, "started": 1.0, "p_delivery": 0.0, "p_suction": 0.0}
    found = []
    for z in (10, 12, 18):
        part = ExternalGears(teeth=z, **SIZES)
        most, least = (part.equations(phi_shaft=share * part.pitch, **given) for share in (0.5, 0.0))
        rough = math.pi**2 * math.cos(math.radians(20)) ** 2 / (4 * (z + 1))
        uneven = (least["dVd"] - most["dVd"]) / most["displacement"]
        found.append(Number(f"{z} teeth", rough / (1 - rough / 3), float(uneven)))
    return found
