"""Masses that stick and slip."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from building import circuit, fired

from crescentlab.result import Result
from evidence import Number, evidence


def run(parts: Mapping[str, Any], nets: Mapping[str, Any], stop: str) -> Result:
    """A purely mechanical circuit."""
    return circuit(components=parts, nets=nets, simulation={"stop": stop}).simulate(rtol=1e-9)


@evidence(
    "stick_slip_mass",
    source="m x'' = k (V t - x) - F_c from breaking away: J. J. Thomsen, Vibrations and Stability (2003)",
    tolerance=1e-6,
    because="relative tolerance of the run, 1e-9; events are found to 1e-9 of the span",
)
def stick_slip() -> list[Number]:
    """1 kg drawn by 400 N/m at 50 mm/s, friction 10 N at rest and 6 N in motion: times of slipping and of sticking."""
    parts = {
        "block": {"type": "stick_slip_mass", "mass": "1 kg", "coulomb_friction": "6 N", "static_friction": "10 N"},
        "spring": {"type": "spring_between", "stiffness": "400 N/m"},
        "drive": {"type": "motion_source", "velocity": "50 mm/s"},
    }
    result = run(parts, {"b": ["block.port", "spring.a"], "d": ["drive.port", "spring.b"]}, "2 s")
    breaks, stops = fired(result, "block.breaks_away_up"), fired(result, "block.stops")
    w, a = 20.0, 4.0 / 400.0
    return [
        Number("first break-away, F_s/(k V)", 0.5, breaks[0], "ms"),
        Number("slip, 2 (pi - atan(a w/V))/w", 2 * (math.pi - math.atan(a * w / 0.05)) / w, stops[0] - breaks[0], "ms"),
        Number("stick, 2 a/V", 2 * a / 0.05, breaks[1] - stops[0], "ms"),
    ]


@evidence(
    "stick_slip_mass_with_stops",
    source="constant deceleration by friction, m v dv/dx = -F_c, and Newton's law of impact",
    tolerance=1e-7,
    because="relative tolerance of the run, 1e-9; events are found to 1e-9 of the span",
)
def thrown_to_and_fro() -> list[Number]:
    """2 kg thrown at 2 m/s between stops 100 mm apart, F_c = 8 N, e = 0.7: speeds at the stops, and where it sticks.

    v^2 falls by 2 F_c s/m, 8 m/s^2 times s; an impact leaves 0.49 of it: 4, 3.2, 1.568, 0.768, 0.376, and 47 mm more.
    """
    parts = {
        "spool": {"type": "stick_slip_mass_with_stops", "mass": "2 kg", "high": "100 mm", "restitution": "0.7",
                  "coulomb_friction": "8 N", "static_friction": "12 N", "start": {"v": "2 m/s"}},
    }  # fmt: skip
    result = run(parts, {"b": ["spool.port"]}, "1 s")
    high, low = fired(result, "spool.hits_high"), fired(result, "spool.hits_low")
    squares = [4 - 0.8, 0.49 * 3.2 - 0.8]
    leaving = 0.49 * squares[1]
    times = [(2 - math.sqrt(squares[0])) / 4]
    times.append(times[0] + (math.sqrt(0.49 * squares[0]) - math.sqrt(squares[1])) / 4)
    return [
        Number("time of the first impact", times[0], high[0], "ms"),
        Number("time of the second", times[1], low[0], "ms"),
        Number("where it sticks, v^2/8", leaving / 8, float(result["spool.x"][-1]), "mm"),
        Number("number of impacts", 2, len(high) + len(low)),
    ]
