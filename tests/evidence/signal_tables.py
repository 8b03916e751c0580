"""Tables of one variable."""

from __future__ import annotations

import numpy as np
from crescentlab.components.signal_tables import Table, TimeTable
from scipy.interpolate import CubicSpline

from evidence import Number, evidence

X, Y = (0.0, 1.0, 2.5, 3.0, 5.0), (0.0, 2.0, 1.0, 1.5, -1.0)


@evidence(
    "table",
    "time_table",
    source="linear interpolation, by hand",
    tolerance=1e-14,
    because="rounding of double precision",
)
def straight_lines() -> list[Number]:
    """0, 16, 44 um at 0, 3, 8 bar: between the points and beyond; 0, 6, 0 L/min at 0, 1, 2 s."""
    table = Table(curve={"x": ["0 bar", "3 bar", "8 bar"], "y": ["0 um", "16 um", "44 um"]})
    course = TimeTable(curve={"x": ["0 s", "1 s", "2 s"], "y": ["0 L/min", "6 L/min", "0 L/min"]})
    found = [
        Number(f"{bar:g} bar", um * 1e-6, table.equations(u=bar * 1e5)["y"], "um")
        for bar, um in ((1.5, 8.0), (5.5, 30.0), (10.0, 55.2))
    ]
    return [*found, Number("1.5 s", 3e-3 / 60, course.equations(t=1.5)["y"], "L/min")]


@evidence(
    "table",
    "time_table",
    source="scipy.interpolate.CubicSpline with natural ends, continued with the slope there",
    tolerance=1e-13,
    because="rounding of double precision; values of size 1",
)
def splines() -> list[Number]:
    """A natural cubic spline through five points, between and beyond them."""
    table = Table(curve={"x": list(X), "y": list(Y)}, interpolation="spline")
    course = TimeTable(curve={"x": [f"{x} s" for x in X], "y": list(Y)}, interpolation="spline")
    known = CubicSpline(X, Y, bc_type="natural")
    found = [
        Number(f"at {x:g}", float(known(x)), table.equations(u=x)["y"], size=1.0) for x in (0.3, 1.0, 1.9, 2.7, 4.1)
    ]
    beyond = (-1.0, Y[0] - known(0.0, 1)), (7.0, Y[-1] + 2 * known(5.0, 1))
    found += [Number(f"at {x:g}", float(y), table.equations(u=x)["y"], size=1.0) for x, y in beyond]
    t = np.linspace(0, 5, 41)
    error = float(np.max(np.abs([course.equations(t=x)["y"] - known(x) for x in t])))
    return [*found, Number("over time, largest of 41 differences", 0.0, error, size=1.0)]
