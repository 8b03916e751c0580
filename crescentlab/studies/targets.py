"""What a setting of a circuit is: the quantity of a parameter, a component's field, or a start value."""

from __future__ import annotations

from crescentlab.component import field_quantity, is_structural
from crescentlab.domain import Held, State
from crescentlab.elaborate import Design
from crescentlab.errors import InputError, nearest
from crescentlab.units import QUANTITIES, Quantity


def quantity_of_setting(design: Design, name: str) -> Quantity | None:
    """Quantity of what ``--set NAME`` sets; None for words. Raises :class:`InputError` offering the nearest name."""
    settings = _settings(design, name)
    if name not in settings:
        raise InputError(f"nothing has the name {name}: {nearest(name, settings)}")
    return settings[name]


def _settings(design: Design, name: str) -> dict[str, Quantity | None]:
    """Every setting of the circuit by name; of components only those that ``name`` may mean."""
    found: dict[str, Quantity | None] = {}
    for prefix, values in design.parameters.items():
        found.update({prefix + n: None if isinstance(v.value, str) else v.quantity for n, v in values.items()})
    if name in found:
        return found
    owners = {n: i.component for n, i in design.instances.items()} | dict(design.fluids)
    for owner, part in owners.items():
        for field, info in type(part).model_fields.items():
            value, quantity = getattr(part, field), field_quantity(info)
            if quantity is None and is_structural(info) and isinstance(value, int) and not isinstance(value, bool):
                quantity = QUANTITIES["ratio"]
            found[f"{owner}.{info.alias or field}"] = quantity
    for full, instance in design.instances.items():
        part = instance.component
        for declared in [s for form in instance.forms for kind in (State, Held) for s in form.declared(kind)]:
            found[f"{full}.start.{declared.name}"] = part.quantity(declared.quantity)
    return found


def value_of_setting(design: Design, name: str) -> float | str:
    """What a setting came to in this design: an SI number, or a word; a vector of start values gives its first."""
    prefix, dot, last = name.rpartition(".")
    if last in design.parameters.get(prefix + dot, {}):
        value = design.parameters[prefix + dot][last].value
        return value if isinstance(value, str) else float(value)
    if prefix.endswith(".start"):
        return float(design.instances[prefix.removesuffix(".start")].start[last].flat[0])
    part = design.fluids[prefix] if prefix in design.fluids else design.instances[prefix].component
    field = next(n for n, info in type(part).model_fields.items() if (info.alias or n) == last)
    return float(getattr(part, field))
