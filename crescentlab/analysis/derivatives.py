"""Exact derivatives of a system's equations at one point: of f, of variables, of the ticks' remap.

All come out of the one expression graph; nothing is differenced.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np

from crescentlab.errors import InputError, SimulationError
from crescentlab.prepared import jacobian
from crescentlab.system import System
from crescentlab.units import Quantity

Array = np.ndarray


@dataclass(frozen=True)
class Point:
    """Where derivatives are taken: time, states (n,), held values (k,), bits (r,), parameters."""

    t: float
    x: Array
    h: Array
    b: Array
    p: Array

    @property
    def arguments(self) -> tuple[Any, ...]:
        """As the system's functions take them."""
        return self.t, self.x, self.h, self.b, self.p

    def moved(self, **changes: Any) -> Point:
        """The same with some of it replaced."""
        return replace(self, **changes)


@dataclass(frozen=True)
class Local:
    """Values and derivatives at a point: f (n,), y (m,), and the matrices of f and y by x, h and the parameters."""

    f: Array
    y: Array
    f_x: Array
    f_h: Array
    f_p: Array
    f_t: Array
    y_x: Array
    y_h: Array
    y_p: Array


@dataclass(frozen=True)
class Output:
    """A variable of the system, or one element of a vector."""

    name: str
    quantity: Quantity
    base: str
    element: int


def output_named(system: System, name: str) -> Output:
    """The output called ``line.p`` or ``chain.p[2]``; raises :class:`InputError` for a vector without an element."""
    match = re.fullmatch(r"(.*)\[(\d+)\]", name)
    base, element = (match[1], int(match[2])) if match else (name, None)
    variable = system.find(base)
    size = len(variable.expression())
    if variable.vector and (element is None or not 1 <= element <= size):
        raise InputError(f"output {name}: {base} has {size} elements; name one, for example {base}[1]")
    if not variable.vector and element is not None:
        raise InputError(f"output {name}: {base} is a single value; write {base}")
    return Output(name, variable.quantity, base, (element or 1) - 1)


class Derivatives:
    """Functions of the derivatives by the parameters at ``places``, and of the named outputs."""

    def __init__(self, system: System, places: Sequence[int], outputs: Sequence[Output]) -> None:
        self.system, self.outputs = system, tuple(outputs)
        self.places = list(places)
        names = tuple((o.base, o.element) for o in outputs)
        key = f"derivatives {self.places} {names}"
        self.function, self.pattern = system.once(key, self._make)

    def _make(self) -> tuple[ca.Function, Array]:
        s = self.system
        p = s.p[self.places] if self.places else ca.SX(0, 1)
        y = ca.vertcat(*[s.find(o.base).expression()[o.element] for o in self.outputs]) if self.outputs else ca.SX(0, 1)
        f_x = s.jacobian_expression
        f_t = ca.densify(ca.jacobian(s.f, s.t))
        by = [ca.jacobian(y, s.x), ca.jacobian(y, s.h), ca.jacobian(y, p)]
        parts = [ca.densify(s.f), ca.densify(y), f_x, jacobian(s.f, s.h), ca.jacobian(s.f, p), f_t, *by]
        rows = np.zeros(s.x.numel(), bool)
        rows[np.array(f_x.sparsity().row(), dtype=int)] = True
        return ca.Function("derivatives", s.arguments, parts), rows

    def at(self, point: Point) -> Local:
        """Evaluate; raises :class:`SimulationError` naming what is not finite."""
        parts = [np.array(v) for v in self.function(*point.arguments)]
        f, y, f_x, f_h, f_p, f_t, y_x, y_h, y_p = parts
        made = Local(f[:, 0], y[:, 0], f_x, f_h, f_p, f_t[:, 0], y_x, y_h, y_p)
        self._check(made)
        return made

    def _check(self, local: Local) -> None:
        s = self.system
        names = [o.name for o in self.outputs]
        rows = {"f": [f"d{n}/dt" for n in s.state_names], "y": names}
        for kind, columns in (("x", s.state_names), ("h", s.held_names), ("p", [f"p{k}" for k in self.places])):
            for what, titles in rows.items():
                bad = np.argwhere(~np.isfinite(getattr(local, f"{what}_{kind}")))
                if bad.size:
                    shown = columns[bad[0, 1]] if kind != "p" else "a parameter"
                    raise SimulationError(
                        f"the derivative of {titles[bad[0, 0]]} by {shown} is not a finite number at this operating "
                        "point; linearise beside it, or regularise the law there"
                    )

    # -- ticks ------------------------------------------------------------------------------------

    def remap(self, point: Point) -> tuple[Array, Array, Array]:
        """What the ticks make of (x, h) at a point: (n + k,), its derivatives by (x, h) and by the parameters."""
        function = self.system.once(f"remap derivatives {self.places}", self._make_remap)
        value, by_z, by_p = (np.array(v) for v in function(*point.arguments))
        if not (np.isfinite(by_z).all() and np.isfinite(by_p).all()):
            raise SimulationError("the derivative of a tick is not a finite number at this operating point")
        return value[:, 0], by_z, by_p

    def _make_remap(self) -> ca.Function:
        s = self.system
        fired = ca.DM([1.0 if event.kind == "every" else 0.0 for event in s.events])
        prepared = s.remap_ticks
        x, h = prepared.function(s.t, s.x, s.h, s.b, fired, prepared.parameters(s.p))
        z, after = ca.vertcat(s.x, s.h), ca.densify(ca.vertcat(x, h))
        p = s.p[self.places] if self.places else ca.SX(0, 1)
        return ca.Function("remap", s.arguments, [after, ca.jacobian(after, z), ca.jacobian(after, p)])
