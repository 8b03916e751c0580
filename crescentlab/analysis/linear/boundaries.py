"""Relations on whose boundary an operating point lies: there a linear model holds on one side only."""

from __future__ import annotations

import casadi as ca
import numpy as np

from crescentlab.analysis.derivatives import Derivatives, Local, Point

Array = np.ndarray

NEAR = 1e-6
"""A relation is on its boundary if states moved by this part of their usual size reach it."""


def one_sided(derivatives: Derivatives, point: Point) -> list[str]:
    """One warning for each relation on its boundary whose other side has other derivatives, or fires an event."""
    system = derivatives.system
    if not system.b.numel():
        return []
    near = _near(derivatives, point)
    if not near.size:
        return []
    here, condition = derivatives.at(point), _conditions(derivatives, point)
    said: list[str] = []
    for k in near:
        b = point.b.copy()
        b[k] = 1.0 - b[k]
        other = point.moved(b=b)
        fires = np.flatnonzero(_conditions(derivatives, other) & ~condition)
        name = system.bits.names[k]
        if _differs(derivatives, here, other):
            said.append(f"one-sided: this point lies on the boundary of {name}; the model holds where that is "
                        f"{'true' if point.b[k] else 'false'}")  # fmt: skip
        elif fires.size:
            events = [e.name for e in system.events if e.kind != "every"]
            said.append(f"one-sided: {events[fires[0]]} is about to happen, on the boundary of {name}")
    return said


def _near(derivatives: Derivatives, point: Point) -> Array:
    """Relations that a small motion of the states reaches."""
    system = derivatives.system

    def make() -> ca.Function:
        g = system.relations
        return ca.Function(
            "near", system.arguments, [ca.densify(g), ca.densify(system.scales), ca.jacobian(g, system.x)]
        )

    g, scale, slope = (np.array(v) for v in system.once("near", make)(*point.arguments))
    sizes = np.maximum(np.abs(point.x), system.nominal)
    reach = NEAR * (np.abs(slope) @ sizes) + 1e-12 * scale[:, 0]
    return np.flatnonzero(np.abs(g[:, 0]) <= reach)


def _conditions(derivatives: Derivatives, point: Point) -> Array:
    system = derivatives.system
    prepared = system.condition
    q = prepared.parameters(point.p)
    return np.array(prepared.function(point.t, point.x, point.h, point.b, q)).ravel() > 0.5


def _differs(derivatives: Derivatives, here: Local, other: Point) -> bool:
    """Whether the equations beyond the boundary have other values or slopes, rounding aside."""
    there = derivatives.at(other)
    for name in ("f", "y", "f_x", "f_p", "y_x", "y_p"):
        a, b = getattr(here, name), getattr(there, name)
        if not np.allclose(a, b, rtol=1e-9, atol=1e-12 * float(np.abs(a).max(initial=0.0))):
            return True
    return False
