"""How a parameter of a circuit reaches the numbers of its equations and its start values, and their derivatives by it.

One name, as for ``--set``, may enter many numbers through expressions (``speed``), or shape the equations themselves
(the length of a line that is cut into cells). The numbers follow from it by the expressions of the circuit file alone,
so that differences see no noise of an integration: they are exact to rounding for polynomials up to the fourth degree.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from crescentlab.arguments import Settings
from crescentlab.component import field_quantity
from crescentlab.elaborate import Design
from crescentlab.errors import InputError
from crescentlab.system import System
from crescentlab.trace import structure_of
from crescentlab.units import QUANTITIES, Quantity

Array = np.ndarray

SMALL = 1e-2
"""A parameter that is zero is varied as if it were this share of its quantity's usual size."""
STEP = 1e-4
"""Relative step of the five-point differences of the numbers: their error is the fourth power, and rounding."""
KINK, ROUNDING = 1e-5, 1e-12
"""Relative change of a slope, and relative size of the rounding of a number, that a smooth expression does not show."""
STENCILS = {
    "central": (-2, np.array([1, -8, 0, 8, -1]) / 12),
    "forward": (0, np.array([-25, 48, -36, 16, -3]) / 12),
    "backward": (-4, np.array([3, -16, 36, -48, 25]) / 12),
}
"""First of five places, and the weights of the values there in the derivative at place 0."""


class NotDifferentiableError(Exception):
    """A derivative is not known from the equations; the text says why."""


@dataclass(frozen=True)
class Parameter:
    """A parameter by its name for ``--set``: its value [SI], quantity, and a size by which it may be varied."""

    name: str
    value: float
    quantity: Quantity
    role: str = "--parameter"
    """What messages call it."""

    @property
    def size(self) -> float:
        """Magnitude of the value; where it is zero a hundredth of what is usual of its quantity."""
        return abs(self.value) or SMALL * self.quantity.nominal

    def text(self, value: float) -> str:
        """A value [SI] as ``--set`` reads it."""
        return f"{value!r} {self.quantity.si if self.quantity.si != '1' else ''}".strip()


@dataclass(frozen=True)
class Reach:
    """Derivatives of the numbers of a system by one parameter: p (np,), x0 (n,), h0 (k,), circuit parameters."""

    p: Array
    x0: Array
    h0: Array
    circuit: dict[str, float]


class Reaching:
    """How the numbers of a system depend on a parameter, by elaborating the circuit anew with other values of it."""

    def __init__(
        self, elaborate: Callable[[Settings], Design], system: System, design: Design, settings: Settings
    ) -> None:
        """``elaborate`` makes the design of other settings; ``design`` is that of these, ``system`` its equations."""
        self.elaborate, self.system, self.design, self.settings = elaborate, system, design, dict(settings)
        self.structure = structure(design)
        self.made: dict[tuple[str, float], Design] = {}

    def varied(self, parameter: Parameter, value: float) -> Design:
        """The design with another value; raises :class:`InputError` if it may not have that."""
        if value == parameter.value:
            return self.design
        key = parameter.name, value
        if key not in self.made:
            self.made[key] = self.with_settings({parameter.name: parameter.text(value)})
        return self.made[key]

    def with_settings(self, more: Settings) -> Design:
        """The design with some settings more, or others."""
        return self.elaborate({**self.settings, **more})

    def sides(self, parameter: Parameter, step: float) -> str:
        """Where a step may go: ``central``, ``forward`` or ``backward``; raises :class:`InputError` if nowhere."""
        failures: list[InputError] = []
        for sign in (1.0, -1.0):
            try:
                self.varied(parameter, parameter.value + sign * step)
            except InputError as error:
                failures.append(error)
            else:
                if failures:
                    return "backward"
                continue
        if len(failures) == 2:
            said = failures[0].message.removeprefix("--set ")
            said = f"{parameter.role} {parameter.name} cannot be varied a little: {said}"
            raise InputError(said, failures[0].place)
        return "forward" if failures else "central"

    def shapes(self, parameter: Parameter) -> bool:
        """Whether the parameter shapes the equations."""
        step = 2 * STEP * parameter.size
        signs = {"central": (1.0, -1.0), "forward": (1.0,), "backward": (-1.0,)}[self.sides(parameter, step)]
        return any(structure(self.varied(parameter, parameter.value + s * step)) != self.structure for s in signs)

    def reach(self, parameter: Parameter) -> Reach:
        """The derivatives; raises :class:`NotDifferentiableError` where the numbers have a kink or jump."""
        step = STEP * parameter.size
        first, weights = STENCILS[self.sides(parameter, 2 * step)]
        designs = [self.varied(parameter, parameter.value + place * step) for place in range(first, first + 5)]
        values = [self.system.values(design) for design in designs]

        def derivative(rows: list[Array]) -> Array:
            found = slope(np.array(rows), weights, step)
            if found is None:
                at = parameter.quantity.show(parameter.value)
                raise NotDifferentiableError(f"at {at} an expression of {parameter.name} has a kink or jump")
            return found

        names = list(_numbers(self.design))
        circuit = derivative([np.array([_numbers(design)[n] for n in names]) for design in designs])
        return Reach(
            derivative([v.p for v in values]), derivative([v.x0 for v in values]), derivative([v.h0 for v in values]),
            dict(zip(names, circuit.tolist(), strict=True)),
        )  # fmt: skip


def slope(rows: Array, weights: Array, step: float) -> Array | None:
    """Derivative of what five rows, ``step`` apart, are values of; None where it has a kink or jump among them.

    Third and fourth differences, odd and even, vanish with h^3 and h^4 of a smooth function; one of them does not,
    wherever a kink lies.
    """
    touched = np.flatnonzero((rows != rows[2]).any(axis=0))
    found = np.zeros(rows.shape[1])
    a, b, c, d, e = rows[:, touched]
    found[touched] = weights @ rows[:, touched] / step
    bends = np.maximum(np.abs(e - 2 * d + 2 * b - a), np.abs(a - 4 * b + 6 * c - 4 * d + e)) / (3 * step)
    allowed = KINK * np.abs(found[touched]) + ROUNDING * np.max(np.abs(rows[:, touched]), axis=0) / step
    return found if np.all(bends <= allowed) else None


def structure(design: Design) -> tuple[Any, ...]:
    """What of a design shapes the equations."""
    found = tuple((n, structure_of(i.component)) for n, i in design.instances.items())
    return found + tuple(structure_of(f) for f in design.fluids.values())


def _numbers(design: Design) -> dict[str, float]:
    """The circuit's own parameters that are numbers."""
    own = design.parameters.get("", {})
    return {n: float(v.value) for n, v in own.items() if isinstance(v.value, (int, float))}


def quantity_of(model: Any, attribute: str) -> Quantity | None:
    """The quantity of a component's or fluid's number, also of one that its component decides, such as a signal's."""
    known = field_quantity(type(model).model_fields[attribute])
    if known is not None or not isinstance(getattr(model, attribute), float):
        return known
    of = "input_quantity" if attribute == "per" else "output_quantity"
    return QUANTITIES.get(str(getattr(model, of, "")))
