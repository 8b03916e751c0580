"""Masses, springs, dampers, friction and contacts."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from building import circuit, fired
from crescentlab.components.mechanics import ElasticEndStops, FrictionBetween
from scipy.optimize import brentq

from crescentlab.result import Result
from evidence import Number, evidence


def run(parts: Mapping[str, Any], nets: Mapping[str, Any], stop: str, rtol: float = 1e-9) -> Result:
    """A purely mechanical circuit."""
    return circuit(components=parts, nets=nets, simulation={"stop": stop}).simulate(rtol=rtol)


def rebound(v: float, restitution: float, impact_velocity: float) -> float:
    """Speed after an impact at v with F = k d (1 + a d'), a such that it is e v_i after one at v_i.

    m v dv/dd = -k d (1 + a v), separated and integrated in and out: v - ln(1 + a v)/a = -w - ln(1 - a w)/a.
    """

    def missing(a: float, before: float, after: float) -> float:
        return before - math.log1p(a * before) / a + after + math.log1p(-a * after) / a

    least, most = 0.5 * (1 - restitution), (1 - 1e-12) / restitution
    a = brentq(
        missing, least / impact_velocity, most / impact_velocity, (impact_velocity, restitution * impact_velocity)
    )
    return float(brentq(lambda w: missing(a, v, w), 1e-9 * v, min(v, (1 - 1e-12) / a)))


@evidence(
    "mass",
    "force_source",
    "signal_force_source",
    "motion_source",
    source="Newton's second law: x = F t^2/(2 m), v = F t/m; with F = R t, x = R t^3/(6 m)",
    tolerance=1e-7,
    because="relative tolerance of the run, 1e-9, over a few hundred steps",
)
def constant_force() -> list[Number]:
    """3 N on 0.5 kg for 0.2 s; a force that rises by 10 N/s on the same; a belt at 0.1 m/s from 5 mm."""
    parts = {
        "block": {"type": "mass", "mass": "0.5 kg"},
        "push": {"type": "force_source", "force": "3 N"},
        "other": {"type": "mass", "mass": "0.5 kg"},
        "rises": {"type": "ramp", "after": "10 N", "duration": "1 s"},
        "pull": {"type": "signal_force_source"},
        "belt": {"type": "motion_source", "velocity": "0.1 m/s", "position": "5 mm"},
        "drag": {"type": "damper", "coefficient": "2 N s/m"},
    }
    nets = {
        "b": ["block.port", "push.rod"], "o": ["other.port", "pull.rod"], "s": ["rises.y", "pull.force"],
        "w": ["belt.port", "drag.rod"],
    }  # fmt: skip
    result = run(parts, nets, "200 ms")
    return [
        Number("position, constant force", 0.12, float(result["block.x"][-1]), "mm"),
        Number("velocity, constant force", 1.2, float(result["block.v"][-1]), "m/s"),
        Number("position, rising force", 10 * 0.2**3 / 6 / 0.5, float(result["other.x"][-1]), "mm"),
        Number("position of the belt", 0.025, float(result["w.x"][-1]), "mm"),
    ]


@evidence(
    "mass_with_stops",
    source="flights of constant acceleration and Newton's law of impact: after n flights t = v_0/g (1 + 2 sum e^k)",
    tolerance=1e-7,
    because="relative tolerance of the run, 1e-9; events are found to 1e-9 of the span",
)
def bouncing() -> list[Number]:
    """Dropped from 1 m with e = 0.6 at 9.81 m/s^2: it rests once e^n v_0 < 0.01 m/s, after the 11th flight up."""
    parts = {
        "ball": {"type": "mass_with_stops", "mass": "0.1 kg", "high": "10 m", "restitution": "0.6",
                 "rest_speed": "10 mm/s", "start": {"x": "1 m"}},
        "weight": {"type": "force_source", "force": "-0.981 N"},
    }  # fmt: skip
    result = run(parts, {"b": ["ball.port", "weight.rod"]}, "3 s")
    hits = fired(result, "ball.hits_low")
    v_0 = math.sqrt(2 * 9.81)
    flights = [v_0 / 9.81 * (1 + 2 * sum(0.6**k for k in range(1, n + 1))) for n in (0, 1, 11)]
    found = [Number(f"time of hit {n + 1}", flights[k], hits[n], "ms") for k, n in enumerate((0, 1, 11))]
    return [*found, Number("number of hits", 12, len(hits))]


@evidence(
    "spring",
    "spring_between",
    "damper",
    "damper_between",
    source="damped oscillator: x = e^(-d t) (cos w t + d/w sin w t) x_0, d = B/(2 m), w^2 = k/m - d^2",
    tolerance=1e-6,
    because="relative tolerance of the run, 1e-9",
)
def oscillators() -> list[Number]:
    """1 kg on 400 N/m and 4 N s/m against the ground, and two of 2 kg with the same between them, after 0.5 s."""
    parts = {
        "block": {"type": "mass", "mass": "1 kg", "start": {"x": "10 mm"}},
        "spring": {"type": "spring", "stiffness": "400 N/m"},
        "damper": {"type": "damper", "coefficient": "4 N s/m"},
        "left": {"type": "mass", "mass": "2 kg", "start": {"x": "-5 mm"}},
        "right": {"type": "mass", "mass": "2 kg", "start": {"x": "5 mm"}},
        "between": {"type": "spring_between", "stiffness": "400 N/m"},
        "damps": {"type": "damper_between", "coefficient": "4 N s/m"},
    }
    nets = {
        "b": ["block.port", "spring.rod", "damper.rod"],
        "l": ["left.port", "between.a", "damps.a"],
        "r": ["right.port", "between.b", "damps.b"],
    }
    result = run(parts, nets, "500 ms")
    w = math.sqrt(400 - 4.0)
    x = math.exp(-1.0) * (math.cos(w / 2) + 2 / w * math.sin(w / 2)) * 10e-3
    return [
        Number("block on the ground", x, float(result["block.x"][-1]), "mm"),
        Number("distance of the pair", x, float((result["right.x"] - result["left.x"])[-1]), "mm"),
    ]


@evidence(
    "friction_between",
    source="Stribeck curve of Armstrong-Helouvry, Dupont & Canudas de Wit (1994): F_c + (F_s - F_c) e^-1 at v_s",
    tolerance=1e-12,
    because="rounding; the hyperbolic tangent is 1 at a hundred creep velocities",
)
def stribeck() -> list[Number]:
    """F_c 6 N, F_s 10 N, v_s 10 mm/s, 50 N s/m: friction at 0.1 mm/s, 10 mm/s and 1 m/s of slip."""
    part = FrictionBetween(coulomb_friction=6.0, static_friction=10.0, stribeck_velocity=1e-2, viscous_friction=50.0)
    expected = {
        1e-4: (6 + 4 * math.exp(-1e-4)) * math.tanh(1.0) + 5e-3,
        1e-2: 6 + 4 / math.e + 0.5,
        1.0: 56.0,
    }
    return [
        Number(f"at {1e3 * v:g} mm/s", f, part.equations(v_a=0.2 + v, v_b=0.2)["friction"], "N")
        for v, f in expected.items()
    ]


@evidence(
    "elastic_end_stops",
    source="w = a v_i of w - ln(1 + w) = -e w - ln(1 - e w), by brentq in the form (1 + w) exp(-w - e w) = "
    "1 - e w; e < 0.01 as 0.01",
    tolerance=1e-9,
    because="rounding near e = 1, where w^3 of the terms of the equation is left",
)
def dampings() -> list[Number]:
    """Damping of a stop over that of its stiffness at its impact velocity, for five restitutions."""
    found = []
    for e in (0.0, 0.01, 0.2, 0.5, 0.9, 0.99):
        held = max(e, 0.01)

        def missing(w: float, e: float = held) -> float:
            return (1 + w) * math.exp(-(1 + e) * w) - (1 - e * w)

        expected = brentq(missing, 0.75 * (1 - held), 1.6 * (1 - held) / held, xtol=1e-15, rtol=1e-14)
        stops = ElasticEndStops(high=1.0, stiffness=1e6, restitution=e, impact_velocity=0.1)
        found.append(Number(f"e = {e:g}", expected, stops.equations(x_rod=-1e-6, v_rod=-0.1)["force"] - 1.0))
    return found


@evidence(
    "elastic_end_stops",
    "elastic_contact",
    source="Hunt & Crossley (1975): energy in and out of the contact, v - ln(1 + a v)/a = -w - ln(1 - a w)/a",
    tolerance=1e-5,
    because="relative tolerance of the run, 1e-9, on an impact of 1 ms within 0.2 s",
)
def impacts() -> list[Number]:
    """Speed after an impact, e = 0.7 at 0.1 m/s: 1 kg at 0.1, 0.02 and 0.3 m/s on a stop; two of 2 kg at 0.1 m/s.

    At 0.1 m/s it is 0.07 m/s.
    """
    found = []
    for v in (0.1, 0.02, 0.3):
        parts = {
            "block": {"type": "mass", "mass": "1 kg", "start": {"x": "1 mm", "v": f"{v} m/s"}},
            "stops": {"type": "elastic_end_stops", "high": "2 mm", "stiffness": "1e7 N/m", "restitution": "0.7"},
        }
        result = run(parts, {"b": ["block.port", "stops.rod"]}, f"{0.0015 / v} s", 1e-10)
        found.append(Number(f"from a stop, at {v:g} m/s", rebound(v, 0.7, 0.1), -float(result["block.v"][-1]), "mm/s"))
    parts = {
        "left": {"type": "mass", "mass": "2 kg", "start": {"v": "0.1 m/s"}},
        "right": {"type": "mass", "mass": "2 kg", "start": {"x": "1 mm"}},
        "touch": {"type": "elastic_contact", "stiffness": "1e7 N/m", "restitution": "0.7"},
    }
    result = run(parts, {"l": ["left.port", "touch.a"], "r": ["right.port", "touch.b"]}, "30 ms", 1e-10)
    apart = float((result["right.v"] - result["left.v"])[-1])
    return [*found, Number("of two parts, at 0.1 m/s", rebound(0.1, 0.7, 0.1), apart, "mm/s")]
