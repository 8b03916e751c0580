"""The parameters by which outcomes are differentiated, by their names for ``--set``; no words, no whole numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from crescentlab.analysis.reach import Parameter, quantity_of
from crescentlab.domain import Held, State
from crescentlab.elaborate import Design
from crescentlab.errors import InputError, nearest
from crescentlab.expressions import Value
from crescentlab.system import System
from crescentlab.units import Quantity


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
        fields = {info.alias or n: n for n, info in type(model).model_fields.items()}
        if last not in fields:
            raise InputError(f"--parameter {name}: {owner} has no parameter {last!r}: {nearest(last, fields)}")
        return _checked(name, getattr(model, fields[last]), quantity_of(model, fields[last]))
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


def _start(system: System, design: Design, component: str, state: str, name: str) -> Parameter:
    instance = design.instances[component]
    stateful = {s.name: s for form in instance.forms for s in form.declared(State) + form.declared(Held)}
    if state not in stateful:
        raise InputError(f"--parameter {name}: {component} has no state {state!r}: {nearest(state, stateful)}")
    values = system.values(design)
    for names, start in ((system.state_names, values.x0), (system.held_names, values.h0)):
        if f"{component}.{state}" in names:
            value = float(start[names.index(f"{component}.{state}")])
            return Parameter(name, value, instance.component.quantity(stateful[state].quantity))
    raise InputError(f"--parameter {name} is no single number; name one that is")


def shifted(design: Design, circuit: Mapping[str, float], amount: float) -> Design:
    """The design whose circuit parameters have moved by ``amount`` along their derivatives; for outcomes alone."""
    own = design.parameters.get("", {})
    moved = {
        n: Value(float(v.value) + amount * circuit[n], v.quantity, v.written) if n in circuit else v
        for n, v in own.items()
    }
    return replace(design, parameters={**design.parameters, "": moved})
