"""Levers."""

from __future__ import annotations

import math

from crescentlab.components.levers import FloatingLever, Lever

from evidence import Number, evidence

from .mechanics import run


@evidence(
    "lever",
    source="law of the lever: a mass seen through it is i^2 m, a spring i^2 k; free swing at sqrt(i^2 k/m)",
    tolerance=1e-6,
    because="relative tolerance of the run, 1e-9",
)
def lever() -> list[Number]:
    """Arms of 100 and 300 mm: motion and force, and 1 kg at the short arm on 100 N/m at the long one after 0.1 s."""
    part = Lever(arm_a=0.1, arm_b=0.3)
    now = part.equations(x_a=1e-3, v_a=0.2, f_b=-5.0)
    one_sided = Lever(arm_a=0.1, arm_b=0.3, pivot_at_end=True).equations(x_a=1e-3, v_a=0.2, f_b=-5.0)
    parts = {
        "block": {"type": "mass", "mass": "1 kg", "start": {"x": "10 mm"}},
        "lever": {"type": "lever", "arm_a": "100 mm", "arm_b": "300 mm"},
        "spring": {"type": "spring", "stiffness": "100 N/m"},
    }
    result = run(parts, {"a": ["block.port", "lever.a"], "b": ["lever.b", "spring.rod"]}, "100 ms")
    return [
        Number("travel of b, pivot between", -3e-3, now["x_b"], "mm"),
        Number("force on the lever at a, pivot between", -15.0, now["f_a"], "N"),
        Number("travel of b, pivot at the end", 3e-3, one_sided["x_b"], "mm"),
        Number("force on the lever at a, pivot at the end", 15.0, one_sided["f_a"], "N"),
        Number("position of the mass", 10e-3 * math.cos(30 * 0.1), float(result["block.x"][-1]), "mm"),
    ]


@evidence(
    "floating_lever",
    source="balance of forces and of moments about c",
    tolerance=1e-12,
    because="rounding",
)
def floating_lever() -> list[Number]:
    """Point c at a quarter of the way from a to b; 8 N on it, 4 mm of a and 8 mm of b."""
    now = FloatingLever(share=0.25).equations(x_a=4e-3, x_b=8e-3, v_a=0.1, v_b=-0.3, f_c=8.0)
    return [
        Number("travel of c", 5e-3, now["x_c"], "mm"),
        Number("velocity of c", 0.0, now["v_c"], "m/s", size=0.1),
        Number("force on the lever at a", -6.0, now["f_a"], "N"),
        Number("force on the lever at b", -2.0, now["f_b"], "N"),
    ]
