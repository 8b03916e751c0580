"""Signals computed by a formula."""

from __future__ import annotations

import math

import numpy as np
from crescentlab.components.signal_formulas import Expression

from evidence import Number, evidence

NONE = np.zeros(0)
OTHERS = dict.fromkeys(("u3", "u4", "u5", "u6"), NONE)


@evidence(
    "expression",
    source="orifice equation and time dependence, by hand",
    tolerance=1e-14,
    because="rounding of double precision",
)
def formulas() -> list[Number]:
    """0.7 A sqrt(2 dp/rho) of 10 mm^2 at 100 bar and 850 kg/m^3; 5 bar + 2 bar cos(2 pi 50 Hz t) at 5 ms."""
    orifice = Expression(
        formula="0.7 * u2 * sqrt(2 * u1 / (850 kg/m^3))", inputs=["pressure", "area"], output_quantity="flow"
    )
    swing = Expression(formula="5 bar + 2 bar * cos(2 * pi * 50 Hz * t)", inputs=[], output_quantity="pressure")
    q = orifice.equations(u1=1e7, u2=1e-5, **OTHERS, t=0.0)["y"]
    p = swing.equations(u1=NONE, u2=NONE, **OTHERS, t=5e-3)["y"]
    return [
        Number("flow", 0.7 * 1e-5 * math.sqrt(2e7 / 850), q, "L/min"),
        Number("pressure", 5e5, p, "bar"),
    ]
