"""Poppets and flappers."""

from __future__ import annotations

import math

from crescentlab.components.fluids import SimpleOil
from crescentlab.components.poppets import BallPoppet, ConicalPoppet, FlapperNozzle

from evidence import Number, evidence

BAR, MM = 1e5, 1e-3
RHO = 860.0
OIL = SimpleOil(density=RHO, kinematic_viscosity=30e-6, bulk_modulus=1e15)


@evidence(
    "conical_poppet",
    "ball_poppet",
    source="frustum of a cone between the seat's edge and the poppet: pi x sin a (d - x sin a cos a); for a ball "
    "pi (r + r') l' with the slant l' from the edge to the circle r' on the ball, by Pythagoras",
    tolerance=1e-9,
    because="rounding",
)
def areas() -> list[Number]:
    """Open area of a seat of 6 mm at lifts of 0.1 and 0.5 mm, cone of 30 deg, ball of 8 mm; the bore at 10 mm."""
    cone = ConicalPoppet(seat_diameter=6 * MM, half_angle=math.radians(30))
    ball = BallPoppet(seat_diameter=6 * MM, ball_diameter=8 * MM)
    found = []
    for x in (0.1 * MM, 0.5 * MM):
        by_hand = math.pi * x * 0.5 * (6 * MM - x * 0.5 * math.sqrt(0.75))
        centre = math.sqrt(4**2 - 3**2) * MM + x  # of the ball, above the seat's edge
        far = math.hypot(3 * MM, centre)
        near_r, near_z = 4 * MM * 3 * MM / far, centre - 4 * MM * centre / far
        frustum = math.pi * (3 * MM + near_r) * math.hypot(3 * MM - near_r, near_z)
        for part, area in ((cone, by_hand), (ball, frustum)):
            got = part.equations(p_a=0.0, p_b=0.0, x_rod=x, v_rod=0.0, fluid=OIL)["area"]
            found.append(Number(f"{part.type_name()} at {x / MM:g} mm", area, got, "mm2"))
    for part in (cone, ball):
        got = part.equations(p_a=0.0, p_b=0.0, x_rod=10 * MM, v_rod=0.0, fluid=OIL)["area"]
        found.append(Number(f"{part.type_name()} at 10 mm", 9 * math.pi * 1e-6, got, "mm2"))
    return found


@evidence(
    "conical_poppet",
    "ball_poppet",
    source="balance of momentum: p_a pi d^2/4 - rho q v cos a, the jet along the cone or the ball",
    tolerance=1e-6,
    because="tanh(2 lambda/lambda_c) is 1 to 1e-8 here",
)
def forces() -> list[Number]:
    """Force that lifts at 0.5 mm and 100 bar: pressure on the seat of 6 mm, less the momentum of the jet."""
    v, bore = math.sqrt(2 * 100 * BAR / RHO), 9 * math.pi * 1e-6
    far = math.hypot(3 * MM, math.sqrt(7) * MM + 0.5 * MM)
    found = []
    for part, cosine in (
        (ConicalPoppet(seat_diameter=6 * MM, half_angle=math.radians(30)), math.sqrt(0.75)),
        (BallPoppet(seat_diameter=6 * MM, ball_diameter=8 * MM), 3 * MM / far),
    ):
        got = part.equations(p_a=100 * BAR, p_b=0.0, x_rod=0.5 * MM, v_rod=0.0, fluid=OIL)
        momentum = RHO * 0.7 * got["area"] * v * v * cosine
        found.append(Number(part.type_name(), 100 * BAR * bore - momentum, got["force"], "N"))
    return found


@evidence(
    "flapper_nozzle",
    source="Merritt (1967), chapter 5: curtain pi d x; F = p A_N (1 + 16 Cd^2 x^2/d^2)",
    tolerance=1e-6,
    because="tanh(2 lambda/lambda_c) is 1 to 1e-7 here",
)
def flapper() -> list[Number]:
    """Nozzle of 1 mm, flapper at 0.1 mm, 50 bar; and the whole nozzle open at 0.5 mm."""
    part = FlapperNozzle(diameter=1 * MM, gap=0.1 * MM)
    got = part.equations(p_a=50 * BAR, p_b=0.0, x_rod=0.0, fluid=OIL)
    far = part.equations(p_a=50 * BAR, p_b=0.0, x_rod=0.4 * MM, fluid=OIL)
    nozzle, v = math.pi / 4 * 1e-6, math.sqrt(2 * 50 * BAR / RHO)
    return [
        Number("flow", 0.64 * 0.1 * math.pi * 1e-6 * v, got["q"], "L/min"),
        Number("force", 50 * BAR * nozzle * (1 + 16 * 0.64**2 * 0.01), got["force"], "N"),
        Number("flow, wide open", 0.64 * nozzle * v, far["q"], "L/min"),
    ]
