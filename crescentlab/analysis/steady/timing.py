r"""What still changes with the time where all states rest: :math:`\partial y/\partial t \ne 0`, y [SI] of a signal."""

from __future__ import annotations

import functools

import casadi as ca
import numpy as np

from crescentlab.analysis.steady.rest import Point, Site
from crescentlab.analysis.steady.unrest import ROUNDING, timed
from crescentlab.closed_sets import NAMED, some
from crescentlab.system import System

Array = np.ndarray

SOON = 1e-6
"""Share of the circuit's usual run after which it is looked again, so that no extremum hides a change."""


def changing(site: Site, point: Point) -> str | None:
    """A warning naming the variables of signals that change with the time at the point, in its present mode."""
    sources = timed(site)
    if not sources:
        return None
    names, function = site.system.once(f"timing {sources}", functools.partial(_slopes, site.system, sources))
    moving = np.zeros(len(names), dtype=bool)
    for ahead in (0.0, SOON * site.span):
        y, slope = function(site.t + ahead, point.x, point.h, point.b, site.values.p)
        size = np.abs(y.full().ravel()) + _nominal(site.system, names)
        moving |= np.abs(slope.full().ravel()) * site.span > ROUNDING * size
    if not moving.any():
        return None
    changed = [name for name, moves in zip(names, moving, strict=True) if moves]
    through = [n for n in sources if any(each.startswith(f"{n}.") for each in changed)]
    shown = ", ".join(through[:NAMED]) + (f" and {len(through) - NAMED} more" if len(through) > NAMED else "")
    return (
        f"the time itself (through {shown}) changes {some(changed)}, and what follows; these are the values of the "
        f"instant {site.t:g} s, as if the time stood still (--at T for another)"
    )


def _slopes(system: System, sources: list[str]) -> tuple[list[str], ca.Function]:
    """Variables of these components, one name per element, and (t, x, h, b, p) -> y, dy/dt at fixed states."""
    owners = tuple(f"{name}." for name in sources)
    found = [(name, e) for name, v in system.variables.items() if name.startswith(owners) for e in v.expression()]
    y = ca.vertcat(*[e for _, e in found]) if found else ca.SX(0, 1)
    slope = ca.jacobian(y, system.t)
    return [name for name, _ in found], ca.Function("timing", system.arguments, [ca.densify(y), ca.densify(slope)])


def _nominal(system: System, names: list[str]) -> Array:
    return np.array([system.variables[name].quantity.nominal for name in names])
