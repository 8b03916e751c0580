"""Inertias, shafts, gears and loads."""

from __future__ import annotations

import math

from crescentlab.components.shafts import RotaryFriction

from evidence import Number, evidence

from .mechanics import run


@evidence(
    "inertia",
    "elastic_shaft",
    source="J. P. Den Hartog, Mechanical Vibrations (1956), torsion: two rotors swing at sqrt(c (1/J1 + 1/J2))",
    tolerance=1e-6,
    because="relative tolerance of the run, 1e-9",
)
def two_rotors() -> list[Number]:
    """Rotors of 0.02 and 0.03 kg m^2 on 1200 N m/rad, the first with 1 rad/s more: after 5 ms, and with 2 N m s/rad."""
    found = []
    for what, damping in (("without damping", 0.0), ("with damping", 2.0)):
        parts = {
            "one": {"type": "inertia", "inertia": "0.02 kg m2", "start": {"omega": "101 rad/s"}},
            "two": {"type": "inertia", "inertia": "0.03 kg m2", "start": {"omega": "100 rad/s"}},
            "shaft": {"type": "elastic_shaft", "stiffness": "1200 N m/rad", "damping": f"{damping} N m s/rad"},
        }
        result = run(parts, {"a": ["one.shaft", "shaft.a"], "b": ["two.shaft", "shaft.b"]}, "5 ms")
        inverse = 1 / 0.02 + 1 / 0.03
        d = damping * inverse / 2
        w = math.sqrt(1200 * inverse - d * d)
        twist = math.exp(-d * 5e-3) * math.sin(w * 5e-3) / w
        momentum = 0.02 * result["one.omega"][-1] + 0.03 * result["two.omega"][-1]
        found += [
            Number(f"twist, {what}", twist, float(result["shaft.twist"][-1]), "mrad"),
            Number(f"mean speed, {what}", 100.4, float(momentum / 0.05), "rad/s"),
        ]
    return found


@evidence(
    "gear_ratio",
    source="an inertia seen through a ratio is i^2 J; two rotors swing at sqrt(c (1/(i^2 J1) + 1/J2))",
    tolerance=1e-6,
    because="relative tolerance of the run, 1e-9",
)
def geared_rotors() -> list[Number]:
    """0.01 kg m^2 behind 4 : 1 on 1200 N m/rad and 0.04 kg m^2, turning against it: twist 5 ms after the start."""
    parts = {
        "fast": {"type": "inertia", "inertia": "0.01 kg m2", "start": {"omega": "404 rad/s"}},
        "gears": {"type": "gear_ratio", "ratio": "4", "sense": "opposite"},
        "shaft": {"type": "elastic_shaft", "stiffness": "1200 N m/rad"},
        "slow": {"type": "inertia", "inertia": "0.04 kg m2", "start": {"omega": "-100 rad/s"}},
    }
    nets = {"a": ["fast.shaft", "gears.a"], "b": ["gears.b", "shaft.a"], "c": ["slow.shaft", "shaft.b"]}
    result = run(parts, nets, "5 ms")
    w = math.sqrt(1200 * (1 / (16 * 0.01) + 1 / 0.04))
    return [Number("twist", -math.sin(w * 5e-3) / w, float(result["shaft.twist"][-1]), "mrad")]


@evidence(
    "swivelling_inertia",
    "torsion_spring",
    source="oscillator about its equilibrium: phi = -T_0/c (1 - cos(sqrt(c/J) t))",
    tolerance=1e-6,
    because="relative tolerance of the run, 1e-9",
)
def sprung_rotor() -> list[Number]:
    """0.5 kg m^2 let go at 0 on 200 N m/rad with 10 N m of preload: angle after 0.1 s."""
    parts = {
        "plate": {"type": "swivelling_inertia", "inertia": "0.5 kg m2"},
        "spring": {"type": "torsion_spring", "stiffness": "200 N m/rad", "preload": "10 N m"},
    }
    result = run(parts, {"a": ["plate.shaft", "spring.shaft"]}, "100 ms")
    return [Number("angle", -10 / 200 * (1 - math.cos(20 * 0.1)), float(result["plate.phi"][-1]), "deg")]


@evidence(
    "rotary_damper",
    "torque_source",
    "signal_torque_source",
    "fan_load",
    source="J dw/dt = T - d w: w = T/d (1 - e^(-d t/J)); J dw/dt = T - k w^2: w = sqrt(T/k) tanh(sqrt(T k) t/J)",
    tolerance=1e-6,
    because="relative tolerance of the run, 1e-9",
)
def run_up() -> list[Number]:
    """10 N m on 0.1 kg m^2 against 0.1 N m s/rad, and against a fan of 2.5 N m at 100 rad/s: speed after 1 s."""
    parts = {
        "one": {"type": "inertia", "inertia": "0.1 kg m2"},
        "pull": {"type": "torque_source", "torque": "10 N m"},
        "drag": {"type": "rotary_damper", "coefficient": "0.1 N m s/rad"},
        "two": {"type": "inertia", "inertia": "0.1 kg m2"},
        "asked": {"type": "constant", "value": "10 N m"},
        "driven": {"type": "signal_torque_source"},
        "fan": {"type": "fan_load", "rated_torque": "2.5 N m", "rated_speed": "100 rad/s"},
    }
    nets = {
        "a": ["one.shaft", "pull.shaft", "drag.shaft"],
        "s": ["asked.y", "driven.torque"],
        "b": ["two.shaft", "driven.shaft", "fan.shaft"],
    }
    result = run(parts, nets, "1 s")
    k = 2.5e-4
    return [
        Number("against the damper", 100 * (1 - math.exp(-1.0)), float(result["one.omega"][-1]), "rad/s"),
        Number("against the fan", 200 * math.tanh(math.sqrt(10 * k) / 0.1), float(result["two.omega"][-1]), "rad/s"),
    ]


@evidence(
    "rotary_friction",
    source="Stribeck curve of Armstrong-Helouvry, Dupont & Canudas de Wit (1994); J dw/dt = -T_c",
    tolerance=1e-6,
    because="relative tolerance of the run, 1e-9; far above the speeds of Stribeck and of creep",
)
def friction() -> list[Number]:
    """T_c 2 N m, T_s 3 N m, w_s 1 rad/s: torque at w_s and at -w_s; 0.1 kg m^2 from 100 rad/s after 4 s."""
    part = RotaryFriction(coulomb_friction=2.0, static_friction=3.0, creep_speed=0.01)
    parts = {
        "rotor": {"type": "inertia", "inertia": "0.1 kg m2", "start": {"omega": "100 rad/s"}},
        "friction": {"type": "rotary_friction", "coulomb_friction": "2 N m", "static_friction": "3 N m"},
    }
    result = run(parts, {"a": ["rotor.shaft", "friction.shaft"]}, "4 s")
    return [
        Number("at w_s", 2 + 1 / math.e, part.equations(omega_shaft=1.0)["torque_shaft"], "N m"),
        Number("at -w_s", -2 - 1 / math.e, part.equations(omega_shaft=-1.0)["torque_shaft"], "N m"),
        Number("speed after 4 s", 20.0, float(result["rotor.omega"][-1]), "rad/s"),
    ]
