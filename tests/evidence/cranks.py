"""Cranks, eccentrics, swash plates and racks."""

from __future__ import annotations

import cmath
import math

from crescentlab.components.cranks import Crank, Eccentric, RackAndPinion, SwashPlate

from evidence import Number, evidence


@evidence(
    "crank",
    source="coordinates of crank pin and piston pin in the complex plane, the rod's length between them",
    tolerance=1e-9,
    because="rounding; the velocity by central differences, 1e-10",
)
def crank() -> list[Number]:
    """Radius 40 mm, rod 150 mm at 100 rad/s: position, velocity, and torque for 1 kN at 60 and 200 deg."""
    part, r, length = Crank(radius=0.04, rod_length=0.15), 0.04, 0.15

    def pin(angle: float) -> float:
        crank_pin = cmath.rect(r, angle)
        return r + length - (crank_pin.real + math.sqrt(length**2 - crank_pin.imag**2))

    found = []
    for degrees in (60, 200):
        angle = math.radians(degrees)
        slope = (pin(angle + 1e-5) - pin(angle - 1e-5)) / 2e-5
        now = part.equations(phi_shaft=angle, omega_shaft=100.0, f_rod=-1000.0)
        found += [
            Number(f"position at {degrees} deg", pin(angle), now["x_rod"], "mm"),
            Number(f"velocity at {degrees} deg", 100 * slope, now["v_rod"], "m/s"),
            Number(f"torque at {degrees} deg", 1000 * slope, now["torque_shaft"], "N m"),
        ]
    return found


@evidence(
    "crank",
    source="where the crank stands square to the rod the crank pin moves along the rod: v = r omega sqrt(1 + (r/l)^2)",
    tolerance=1e-12,
    because="rounding",
)
def square_to_the_rod() -> list[Number]:
    """Radius 40 mm, rod 160 mm, at atan(l/r) = 75.96 deg and 100 rad/s."""
    now = Crank(radius=0.04, rod_length=0.16).equations(phi_shaft=math.atan(4.0), omega_shaft=100.0, f_rod=0.0)
    return [Number("velocity", 4.0 * math.sqrt(1 + 1 / 16), now["v_rod"], "m/s")]


@evidence(
    "eccentric",
    "swash_plate",
    "rack_and_pinion",
    source="geometry: e (1 - cos 60 deg), R tan(beta) (1 - cos 60 deg), R phi; virtual work for the torque",
    tolerance=1e-12,
    because="rounding",
)
def strokes() -> list[Number]:
    """At 60 deg and 100 rad/s under 1 kN: eccentric 10 mm; plate at 17 deg, radius 36.5 mm; pinion of 20 mm."""
    given = {"phi_shaft": math.pi / 3, "omega_shaft": 100.0, "f_rod": -1000.0}
    half = 36.5e-3 * math.tan(math.radians(17))
    parts = {
        "eccentric": (Eccentric(eccentricity=0.01), 5e-3, 0.01 * math.sin(math.pi / 3)),
        "swash plate": (
            SwashPlate(pitch_radius=36.5e-3, swash_angle=math.radians(17)), half / 2, half * math.sin(math.pi / 3),
        ),
        "rack": (RackAndPinion(radius=0.02), 0.02 * math.pi / 3, 0.02),
    }  # fmt: skip
    found = []
    for what, (part, x, slope) in parts.items():
        now = part.equations(**given)
        found += [
            Number(f"{what}, travel", x, now["x_rod"], "mm"),
            Number(f"{what}, velocity", 100 * slope, now["v_rod"], "m/s"),
            Number(f"{what}, torque", 1000 * slope, now["torque_shaft"], "N m"),
        ]
    return found
