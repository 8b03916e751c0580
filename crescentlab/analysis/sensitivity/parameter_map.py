"""What a parameter of a circuit reaches: the numbers of its equations and its start values, and their derivatives.

One name, as for ``--set``, may enter many numbers through expressions (``speed``), or shape the equations themselves
(the length of a line that is cut into cells), or be no real number at all (a count, a word).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from crescentlab.analysis.sensitivity.replay import NotDifferentiableError
from crescentlab.circuit import Circuit
from crescentlab.component import field_quantity
from crescentlab.domain import Held, State
from crescentlab.elaborate import Design
from crescentlab.errors import InputError, nearest
from crescentlab.expressions import Value
from crescentlab.system import System, Values
from crescentlab.trace import structure_of
from crescentlab.units import QUANTITIES, Quantity

Array = np.ndarray

SMALL = 1e-2
"""A parameter that is zero is varied as if it were this share of its quantity's usual size."""
STEP = 1e-4
"""Relative step of the five-point differences of the numbers: their error is the fourth power, and rounding."""
KINK = 1e-5
"""Relative difference of two steps' derivatives that a smooth expression does not show."""
_CENTRAL = {-2.0: 1 / 12, -1.0: -8 / 12, 1.0: 8 / 12, 2.0: -1 / 12}
_FORWARD = {0.0: -25 / 12, 1.0: 4.0, 2.0: -3.0, 3.0: 4 / 3, 4.0: -1 / 4}
_BACKWARD = {-place: -weight for place, weight in _FORWARD.items()}


@dataclass(frozen=True)
class Parameter:
    """A parameter by its name for ``--set``: its value [SI], quantity, and a size by which it may be varied."""

    name: str
    value: float
    quantity: Quantity

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


def find(system: System, design: Design, name: str) -> Parameter:
    """The parameter of this name; raises :class:`InputError` for unknown names, words and whole numbers."""
    owner, _, last = name.rpartition(".")
    scope = f"{owner}." if owner else ""
    if last in design.parameters.get(scope, {}):
        return _checked(name, design.parameters[scope][last].value, design.parameters[scope][last].quantity)
    if owner.endswith(".start") and (component := owner.removesuffix(".start")) in design.instances:
        return _start(system, design, component, last, name)
    models: dict[str, Any] = {**design.fluids, **{n: i.component for n, i in design.instances.items()}}
    if owner in models:
        model = models[owner]
        fields = {info.alias or n: (n, info) for n, info in type(model).model_fields.items()}
        if last not in fields:
            raise InputError(f"--parameter {name}: {owner} has no parameter {last!r}: {nearest(last, fields)}")
        attribute, info = fields[last]
        return _checked(name, getattr(model, attribute), field_quantity(info) or _own_quantity(model, attribute))
    known = [s + n for s, values in design.parameters.items() for n in values]
    raise InputError(f"--parameter {name}: nothing has this name: {nearest(name, [*known, *models])}")


def _checked(name: str, value: Any, quantity: Quantity | None) -> Parameter:
    if isinstance(value, str):
        raise InputError(f"--parameter {name} is the word {value!r}; only a number has a derivative")
    if isinstance(value, bool) or (isinstance(value, int) and quantity is None):
        raise InputError(f"--parameter {name} is the whole number {value}; compare runs with --set {name}=... instead")
    if value is None:
        raise InputError(f"--parameter {name} is not given in the circuit; give it a value with --set {name}=...")
    if not isinstance(value, (int, float)) or quantity is None:
        raise InputError(f"--parameter {name} is no single number; name one that is")
    return Parameter(name, float(value), quantity)


def _own_quantity(model: Any, attribute: str) -> Quantity | None:
    """The quantity of a number that its component decides itself, such as a signal's."""
    if not isinstance(getattr(model, attribute), float):
        return None
    of = "input_quantity" if attribute == "per" else "output_quantity"
    return QUANTITIES.get(str(getattr(model, of, "")))


def _start(system: System, design: Design, component: str, state: str, name: str) -> Parameter:
    instance = design.instances[component]
    forms = type(instance.component).forms()
    stateful = {s.name: s for form in forms for s in form.declared(State) + form.declared(Held)}
    if state not in stateful:
        raise InputError(f"--parameter {name}: {component} has no state {state!r}: {nearest(state, stateful)}")
    values = system.values(design)
    for names, start in ((system.state_names, values.x0), (system.held_names, values.h0)):
        if f"{component}.{state}" in names:
            value = float(start[names.index(f"{component}.{state}")])
            return Parameter(name, value, instance.component.quantity(stateful[state].quantity))
    raise InputError(f"--parameter {name} is no single number; name one that is")


class Reaching:
    """How the numbers of a system depend on a parameter, by elaborating the circuit anew with other values of it."""

    def __init__(self, circuit: Circuit, system: System, design: Design, settings: Mapping[str, str]) -> None:
        self.circuit, self.system, self.design, self.settings = circuit, system, design, dict(settings)
        self.structure = structure(design)
        self.made: dict[tuple[str, float], Design] = {}

    def varied(self, parameter: Parameter, value: float) -> Design:
        """The design with another value; raises :class:`InputError` if it may not have that."""
        key = parameter.name, value
        if key not in self.made:
            self.made[key] = self.circuit.design({**self.settings, parameter.name: parameter.text(value)})
        return self.made[key]

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
            raise InputError(f"--parameter {parameter.name} cannot be varied a little: {said}", failures[0].place)
        return "forward" if failures else "central"

    def shapes(self, parameter: Parameter) -> bool:
        """Whether the parameter shapes the equations."""
        step = 2 * STEP * parameter.size
        signs = {"central": (1.0, -1.0), "forward": (1.0,), "backward": (-1.0,)}[self.sides(parameter, step)]
        return any(structure(self.varied(parameter, parameter.value + s * step)) != self.structure for s in signs)

    def reach(self, parameter: Parameter) -> Reach:
        """The derivatives; raises :class:`NotDifferentiableError` where the numbers have a kink or jump."""
        step = STEP * parameter.size
        weights = {"central": _CENTRAL, "forward": _FORWARD, "backward": _BACKWARD}[self.sides(parameter, 2 * step)]
        at: dict[float, tuple[Values, dict[str, float]]] = {}

        def read(place: float) -> tuple[Values, dict[str, float]]:
            if place not in at:
                design = self.varied(parameter, parameter.value + place * step)
                at[place] = self.system.values(design), _numbers(design)
            return at[place]

        def slope(take: Callable[[tuple[Values, dict[str, float]]], Array]) -> Array:
            taken = {place: take(read(place)) for place in weights}
            every = np.array([taken[place] for place in weights])
            untouched = (every == every[0]).all(axis=0)
            fine = np.where(untouched, 0.0, np.array(list(weights.values())) @ every / step)
            first, last = min(weights), max(weights)
            rough = (taken[last] - taken[first]) / ((last - first) * step)
            rounding = 1e-12 * np.max(np.abs(every), axis=0, initial=0.0) / step
            allowed = KINK * np.abs(fine) + rounding
            if weights is not _CENTRAL:
                allowed = allowed + 10 * STEP * np.abs(fine)
            if np.any(np.abs(fine - rough) > allowed):
                at_value = parameter.quantity.show(parameter.value)
                raise NotDifferentiableError(f"at {at_value} an expression of {parameter.name} has a kink or jump")
            return fine

        names = list(_numbers(self.design))
        circuit = slope(lambda found: np.array([found[1][n] for n in names]))
        return Reach(
            slope(lambda found: found[0].p), slope(lambda found: found[0].x0), slope(lambda found: found[0].h0),
            dict(zip(names, circuit.tolist(), strict=True)),
        )  # fmt: skip


def structure(design: Design) -> tuple[Any, ...]:
    """What of a design shapes the equations."""
    found = tuple((n, structure_of(i.component)) for n, i in design.instances.items())
    return found + tuple(structure_of(f) for f in design.fluids.values())


def _numbers(design: Design) -> dict[str, float]:
    """The circuit's own parameters that are numbers."""
    own = design.parameters.get("", {})
    return {n: float(v.value) for n, v in own.items() if isinstance(v.value, (int, float))}


def shifted(design: Design, circuit: Mapping[str, float], amount: float) -> Design:
    """The design whose circuit parameters have moved by ``amount`` along their derivatives; for outcomes alone."""
    own = design.parameters.get("", {})
    moved = {
        n: Value(float(v.value) + amount * circuit[n], v.quantity, v.written) if n in circuit else v
        for n, v in own.items()
    }
    return replace(design, parameters={**design.parameters, "": moved})
