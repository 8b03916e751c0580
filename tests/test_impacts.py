"""Rebounds: every part with a restitution gives it back at its impact speed; the damping that does it."""

from __future__ import annotations

import math
from typing import Any

import casadi as ca
import numpy as np
import pytest
from building import OIL, circuit
from crescentlab.components.mechanics import impact_damping
from scipy.optimize import brentq

from crescentlab.symbols import Sym

HIT = {"m": {"type": "mass", "mass": "1 kg", "start": {"x": "1 mm", "v": "-0.1 m/s"}}}
OPEN = {"vent": {"type": "atmospheric_vent"}, "way": {"type": "orifice", "area": "1 cm^2"}}
BORE = {"piston_diameter": "2 mm", "stroke": "1 m"}
SPACE = "20 cm^3"
PARTS: dict[str, tuple[dict[str, Any], dict[str, list[str]], str, str, float]] = {
    "elastic_end_stops": (
        {**HIT, "part": {"high": "1 m", "stiffness": "1e6 N/m"}}, {"r": ["m.port", "part.rod"]}, "m.v", "", 0.1,
    ),
    "elastic_contact": (
        {**HIT, "wall": {"type": "motion_source"}, "part": {"stiffness": "1e6 N/m"}},
        {"r": ["m.port", "part.b"], "w": ["wall.port", "part.a"]}, "m.v", "", 0.1,
    ),
    "single_acting_cylinder": (
        {**HIT, **OPEN, "part": {**BORE, "dead_volume": SPACE}},
        {"r": ["m.port", "part.rod"], "p": ["part.cap", "way.a"], "v": ["way.b", "vent.port"]}, "m.v", "", 0.1,
    ),
    "double_acting_cylinder": (
        {**HIT, **OPEN, "back": OPEN["way"], "part": {**BORE, "rod_diameter": "1 mm", "cap_dead_volume": SPACE,
                                                         "rod_dead_volume": SPACE}},
        {"r": ["m.port", "part.rod"], "p": ["part.cap", "way.a"], "q": ["part.annulus", "back.a"],
         "v": ["way.b", "vent.port", "back.b"]}, "m.v", "", 0.1,
    ),
    "backlash": (
        {"one": {"type": "inertia", "inertia": "0.02 kg m2", "start": {"omega": "2 rad/s"}},
         "two": {"type": "inertia", "inertia": "0.03 kg m2"},
         "part": {"play": "0.04 rad", "stiffness": "12000 N m/rad", "impact_speed": "2 rad/s"}},
        {"a": ["one.shaft", "part.a"], "b": ["two.shaft", "part.b"]}, "two.omega", "one.omega", 2.0,
    ),
}  # fmt: skip
"""Parts, nets, the speed of what rebounds, less that of what it hit, and the impact speed."""


@pytest.mark.parametrize("solver", ["lsoda", "rodas"])
@pytest.mark.parametrize("restitution", [0.9, 0.5, 0.0])
@pytest.mark.parametrize("kind", PARTS)
def test_rebound_at_the_impact_speed(kind: str, restitution: float, solver: str) -> None:
    """e of the speed comes back, 1 % where nothing is asked for; it comes at the impact speed that the part states.

    1e-5 of the impact speed: the tolerance of the run, 1e-8, over some hundred steps; a piston of 2 mm moves next to
    no oil.
    """
    parts, nets, one, other, v = PARTS[kind]
    parts = {**parts, "part": {"type": kind, "restitution": f"{restitution}", **parts["part"]}}
    run = circuit(components=parts, nets=nets, fluid=OIL, simulation={"stop": "20 ms"}).simulate(
        solver=solver, rtol=1e-8
    )
    after = run[one][-1] - (run[other][-1] if other else 0.0)
    assert after == pytest.approx(max(restitution, 0.01) * v, abs=1e-5 * v)


def equation(w: float, e: float) -> float:
    """Energy in and out, w - ln(1 + w) = -e w - ln(1 - e w), each side to the power of e; both vanish at w = 0 too."""
    return (1 + w) * math.exp(-(1 + e) * w) - (1 - e * w)


@pytest.mark.parametrize("e", [0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95])
def test_damping_solves_its_equation(e: float) -> None:
    """SciPy's brentq, on floats and on symbols; w^3 of the terms are left of the equation: 1e-11 at w = 0.08."""
    expected = brentq(equation, 0.75 * (1 - e), 1.6 * (1 - e) / e, args=(e,), xtol=1e-15, rtol=1e-15)
    assert impact_damping(e) == pytest.approx(expected, rel=1e-11)
    symbol = ca.SX.sym("e")
    of = ca.Function("of", [symbol], [impact_damping(Sym(symbol)).sx])
    assert float(of(e)) == pytest.approx(impact_damping(e), rel=1e-14)


def test_damping_near_full_restitution() -> None:
    """w = 3 d/2 (1 + d + ...) with d = 1 - e, by expanding the equation; 0 and a slope of -3/2 at e = 1 itself."""
    assert impact_damping(1.0) == 0.0
    for d in (1e-3, 1e-6, 1e-9, 1e-12):
        assert impact_damping(1 - d) == pytest.approx(1.5 * (1 - (1 - d)) * (1 + d), rel=2 * d * d + 1e-14)


def test_damping_has_finite_slopes() -> None:
    """By the equation: dw/de = -F_e/F_w, F_e = w - w/(1 - e w), F_w = 1 - 1/(1 + w) + e - e/(1 - e w); at 1 it is -3/2,
    below 0.01, where it is held, 0."""
    symbol = ca.SX.sym("e")
    w = impact_damping(Sym(symbol)).sx
    slope = ca.Function("slope", [symbol], [ca.gradient(w, symbol)])
    curvature = ca.Function("curvature", [symbol], [ca.gradient(ca.gradient(w, symbol), symbol)])
    for e in (0.02, 0.1, 0.3, 0.5, 0.8, 0.9):
        w_e = impact_damping(e)
        expected = -(w_e - w_e / (1 - e * w_e)) / (1 - 1 / (1 + w_e) + e - e / (1 - e * w_e))
        assert float(slope(e)) == pytest.approx(expected, rel=1e-8)
    assert float(slope(1.0)) == pytest.approx(-1.5, rel=1e-12)
    assert float(slope(0.0)) == 0.0
    for e in np.linspace(0.0, 1.0, 101):
        assert np.isfinite(float(slope(e)))
        assert np.isfinite(float(curvature(e)))
