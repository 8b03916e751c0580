"""Rotors that stick and slip, and a brake."""

from __future__ import annotations

import math

from building import fired

from evidence import Number, evidence

from .mechanics import run


@evidence(
    "stick_slip_inertia",
    source="J phi'' = c (W t - phi) - T_c from breaking away: J. J. Thomsen, Vibrations and Stability (2003)",
    tolerance=1e-6,
    because="relative tolerance of the run, 1e-9; events are found to 1e-9 of the span",
)
def stick_slip() -> list[Number]:
    """0.5 kg m^2 drawn by 200 N m/rad at 0.1 rad/s, friction 10 N m at rest and 6 N m in motion: slipping, sticking."""
    parts = {
        "rotor": {"type": "stick_slip_inertia", "inertia": "0.5 kg m2", "coulomb_friction": "6 N m",
                  "static_friction": "10 N m"},
        "shaft": {"type": "elastic_shaft", "stiffness": "200 N m/rad"},
        "drive": {"type": "speed_source", "speed": "0.1 rad/s"},
    }  # fmt: skip
    result = run(parts, {"a": ["drive.shaft", "shaft.a"], "b": ["rotor.shaft", "shaft.b"]}, "2 s")
    breaks, stops = fired(result, "rotor.breaks_away_up"), fired(result, "rotor.stops")
    w, a = 20.0, 4.0 / 200.0
    return [
        Number("first break-away, T_s/(c W)", 0.5, breaks[0], "ms"),
        Number("slip, 2 (pi - atan(a w/W))/w", 2 * (math.pi - math.atan(a * w / 0.1)) / w, stops[0] - breaks[0], "ms"),
        Number("stick, 2 a/W", 2 * a / 0.1, breaks[1] - stops[0], "ms"),
    ]


@evidence(
    "friction_brake",
    source="J dw/dt = T - a(t) T_c, with a = t/t_r up to 1; held while |T| <= a T_s",
    tolerance=1e-7,
    because="relative tolerance of the run, 1e-9; events are found to 1e-9 of the span",
)
def brake() -> list[Number]:
    """2 kg m^2 at 50 rad/s under 20 N m; 120 N m applied within 1 s, released from 3 s on within 2 s.

    w = 50 + 10 t - 30 t^2 until 1 s, 30 rad/s; then -50 rad/s^2 to rest at 1.6 s. The 150 N m at rest have
    fallen to 20 N m when a = 2/15, at 3 s + 2 s 13/15; from there on dw/dt = 10 - 30 (5 - t).
    """
    parts = {
        "rotor": {"type": "friction_brake", "inertia": "2 kg m2", "coulomb_friction": "120 N m",
                  "static_friction": "150 N m", "start": {"omega": "50 rad/s"}},
        "load": {"type": "torque_source", "torque": "20 N m"},
        "pedal": {"type": "time_table", "curve": {"x": ["0 s", "1 s", "3 s", "5 s"], "y": ["0", "1", "1", "0"]}},
    }  # fmt: skip
    result = run(parts, {"a": ["rotor.shaft", "load.shaft"], "p": ["pedal.y", "rotor.application"]}, "5 s")
    leaves = 3 + 2 * 13 / 15
    rest = 5 - leaves  # dw/dt = 10 - 30 (5 - t)
    turned = (50 + 5 - 10) + 30 * 0.3
    return [
        Number("comes to rest", 1.6, fired(result, "rotor.stops")[0], "s"),
        Number("breaks away", leaves, fired(result, "rotor.breaks_away_up")[0], "s"),
        Number("speed at 5 s", 10 * rest - 15 * rest**2, float(result["rotor.omega"][-1]), "rad/s"),
        Number("turned until it rests", turned, float(result["rotor.phi"][result.time <= 2.0][-1]), "rad"),
    ]
