"""Play between shafts."""

from __future__ import annotations

import math

from evidence import Number, evidence

from .mechanics import run

NETS = {"a": ["one.shaft", "play.a"], "b": ["two.shaft", "play.b"]}


def rattle(restitution: float, stop: str) -> tuple[float, float, float]:
    """Two rotors, 0.02 and 0.03 kg m^2, the first at 2 rad/s within a play of 40 mrad: twist, slip and momentum."""
    parts = {
        "one": {"type": "inertia", "inertia": "0.02 kg m2", "start": {"omega": "2 rad/s"}},
        "two": {"type": "inertia", "inertia": "0.03 kg m2"},
        "play": {"type": "backlash", "play": "0.04 rad", "stiffness": "12000 N m/rad", "restitution": f"{restitution}",
                 "impact_speed": "2 rad/s"},
    }  # fmt: skip
    result = run(parts, NETS, stop)
    one, two = float(result["one.omega"][-1]), float(result["two.omega"][-1])
    return float(result["play.twist"][-1]), one - two, 0.02 * one + 0.03 * two


@evidence(
    "backlash",
    source="free flight at v over the play b, half a swing of sqrt(c (1/J1 + 1/J2)) at each flank: "
    "a period of 2 b/v + 2 pi sqrt(J/c), J = J1 J2/(J1 + J2)",
    tolerance=1e-6,
    because="relative tolerance of the run, 1e-9, over a few impacts",
)
def rattling() -> list[Number]:
    """Without loss: deepest twist; twist, slip and momentum two periods later, an eighth of a swing into the flank."""
    J = 0.02 * 0.03 / 0.05
    w = math.sqrt(12000 / J)
    swing = 2 * math.pi / w
    period = 2 * 0.04 / 2 + swing
    deepest = rattle(1.0, f"{0.01 + swing / 4:.15g} s")
    late = rattle(1.0, f"{2 * period + 0.01 + swing / 8:.15g} s")
    return [
        Number("deepest twist, b/2 + v/w", 0.02 + 2 / w, deepest[0], "mrad"),
        Number("twist two periods later", 0.02 + 2 / w * math.sqrt(0.5), late[0], "mrad"),
        Number("slip there", 2 * math.sqrt(0.5), late[1], "rad/s"),
        Number("momentum there", 0.02 * 2, late[2]),
    ]


@evidence(
    "backlash",
    source="K. H. Hunt, F. R. E. Crossley, J. Appl. Mech. 42 (1975) 440-445, exponent 1, integrated over the impact: "
    "v - ln(1 + a v)/a = -w - ln(1 - a w)/a with a such that w = e v at the impact speed",
    tolerance=1e-6,
    because="relative tolerance of the run, 1e-9",
)
def impact() -> list[Number]:
    """Slip after one impact at the impact speed of 2 rad/s, e = 0.6 and 0.4: -2 e rad/s."""
    return [Number(f"e = {e}", -2 * e, rattle(e, "20 ms")[1], "rad/s") for e in (0.6, 0.4)]
