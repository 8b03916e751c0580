"""Weight."""

from __future__ import annotations

import math

from building import fired

from evidence import Number, evidence

from .mechanics import run

G = 9.80665


@evidence(
    "gravity_force",
    source="uniform acceleration g sin(alpha) and friction on an inclined plane: v^2 = 2 s (g sin(alpha) +- F_c/m)",
    tolerance=1e-7,
    because="relative tolerance of the run, 1e-9; events are found to 1e-9 of the span",
)
def inclined_plane() -> list[Number]:
    """2 kg thrown up 30 deg at 3 m/s, friction 4 N: time and way up, speed when it is back; its potential energy."""
    parts = {
        "block": {"type": "stick_slip_mass", "mass": "2 kg", "coulomb_friction": "4 N", "static_friction": "5 N",
                  "start": {"v": "3 m/s"}},
        "weight": {"type": "gravity_force", "mass": "2 kg", "angle": "30 deg"},
    }  # fmt: skip
    up, down = G / 2 + 2, G / 2 - 2
    time, way = 3 / up, 4.5 / up
    back = math.sqrt(2 * way / down)
    result = run(parts, {"b": ["block.port", "weight.rod"]}, f"{time + back:.15g} s")
    top = float(result["weight.stored_energy"].max())
    return [
        Number("time up", time, fired(result, "block.stops")[0], "ms"),
        Number("way up", way, float(result["block.x"].max()), "mm"),
        Number("potential energy there, m g h", 2 * G * way / 2, top, "J"),
        Number("speed when it is back", -math.sqrt(2 * way * down), float(result["block.v"][-1]), "m/s"),
    ]


@evidence(
    "gravity_force",
    source="Hooke's law: a weight stretches its spring by m g/k, and swings at sqrt(k/m) about it",
    tolerance=1e-7,
    because="relative tolerance of the run, 1e-9",
)
def hanging_weight() -> list[Number]:
    """3 kg let go on 1200 N/m, straight down: deepest position 2 m g/k, half a swing later."""
    parts = {
        "mass": {"type": "mass", "mass": "3 kg"},
        "spring": {"type": "spring", "stiffness": "1200 N/m"},
        "weight": {"type": "gravity_force", "mass": "3 kg", "angle": "-90 deg"},
    }
    stop = f"{math.pi / 20:.15g} s"
    result = run(parts, {"b": ["mass.port", "spring.rod", "weight.rod"]}, stop)
    return [Number("deepest position", 2 * 3 * G / 1200, float(result["mass.x"][-1]), "mm")]
