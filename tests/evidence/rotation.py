"""Sources of rotation."""

from __future__ import annotations

import math

from building import circuit

from evidence import Number, evidence


@evidence(
    "speed_source",
    "signal_speed_source",
    source="definition of angular velocity and of power, P = T omega",
    tolerance=1e-9,
    because="rounding; the angle is a polynomial in time, which the solver follows exactly",
)
def angle_and_power() -> list[Number]:
    """1500 rpm for 2 s from 90 deg are 50 turns; against 0.1 N m s/rad it gives 15.71 N m and 2467 W."""
    parts = {
        "source": {"type": "speed_source", "speed": "1500 rpm", "start_angle": "90 deg"},
        "load": {"type": "rotary_damper", "coefficient": "0.1 N m s/rad"},
        "asked": {"type": "constant", "value": "3000 rpm"},
        "driven": {"type": "signal_speed_source"},
        "other": {"type": "rotary_damper", "coefficient": "0.1 N m s/rad"},
    }
    nets = {
        "a": ["source.shaft", "load.shaft"],
        "s": ["asked.y", "driven.speed"],
        "b": ["driven.shaft", "other.shaft"],
    }
    result = circuit(components=parts, nets=nets, simulation={"stop": "2 s"}).simulate()
    w = 1500 * math.pi / 30
    return [
        Number("angle", 100.5 * math.pi, float(result["source.phi"][-1]), "rad"),
        Number("torque", 0.1 * w, float(result["source.torque"][-1]), "N m"),
        Number("power", 0.1 * w * w, float(result["source.power"][-1]), "W"),
        Number("angle at the signal's speed", 200 * math.pi, float(result["driven.phi"][-1]), "rad"),
        Number("power at the signal's speed", 0.4 * w * w, float(result["driven.power"][-1]), "W"),
    ]
