"""A line's own text in the circuit file, with what another line needs changed and the rest as the user wrote it."""

from __future__ import annotations

from collections.abc import Mapping

from crescentlab import units
from crescentlab.component import Component, field_quantity
from crescentlab.domain import State
from crescentlab.errors import InputError, UnitError
from crescentlab.expressions import is_expression
from crescentlab.units import Quantity
from crescentlab.yaml_text import Node, parse

STARTS = {"start_pressure": units.pressure, "start_flow": units.flow}
"""Fields for the pressure at a and the flow at the start, which stand for the start values of a lump's states."""


def family_of(cls: type[Component]) -> type[Component]:
    """The class that the circuit names, of which this is a causal form."""
    return next((c for c in cls.__mro__ if issubclass(c, Component) and c.family), cls)


def rewritten(text: Node, old: type[Component], line: Component, changes: Mapping[str, str]) -> str:
    """``line`` as it is written in place of one of the class ``old`` with this text.

    The user's own text stays, but for ``changes`` and for what the new type does not know; start values of the old
    states become those of the line. A field the user left out is written where the two types' defaults differ.
    """
    cls, given = family_of(type(line)), text.value if isinstance(text.value, dict) else {}
    fields = {info.alias or name: name for name, info in cls.model_fields.items()}
    pairs: dict[str, Node] = {"type": Node(cls.type_name())}
    pairs |= {key: node for key, node in given.items() if key in fields}
    for key, name in fields.items():
        if key not in pairs and key not in STARTS and (value := _beside_default(line, name)) is not None:
            pairs[key] = Node(value)
    pairs |= {key: Node(value) for key, value in changes.items()}
    pairs |= _starts(given.get("start"), family_of(old), cls, pairs)
    return flow_text(Node(pairs))


def _beside_default(line: Component, name: str) -> str | None:
    """The text of a value that is not its type's default."""
    info, value = type(line).model_fields[name], getattr(line, name)
    if value is None or value == info.default:
        return None
    quantity = field_quantity(info)
    return str(value) if quantity is None else quantity.show(float(value), digits=6)


def _starts(
    start: Node | None, old: type[Component], cls: type[Component], pairs: Mapping[str, Node]
) -> dict[str, Node]:
    """Start values that the new type takes: of states it has, one number for all, else in its own fields."""
    if start is None or not isinstance(start.value, dict):
        return {}
    single = {name: node for name, node in start.value.items() if isinstance(node.value, str)}
    states = _states(cls)
    same = {name: node for name, node in single.items() if name in states}
    found = {"start": Node(same)} if same else {}
    for name, node in single.items():
        key = next((k for k, quantity in STARTS.items() if _states(old).get(name) is quantity), None)
        if name not in same and key in cls.model_fields and key is not None and key not in {*pairs, *found}:
            found[key] = node
    return found


def _states(cls: type[Component]) -> dict[str, Quantity | str]:
    """Quantities of the states of all causal forms."""
    return {state.name: state.quantity for form in cls.forms() for state in form.declared(State)}


def flow_text(node: Node) -> str:
    """The node in one line of YAML, quoted where it must be."""
    if isinstance(node.value, dict):
        return "{" + ", ".join(f"{key}: {flow_text(each)}" for key, each in node.value.items()) + "}"
    if isinstance(node.value, list):
        return "[" + ", ".join(map(flow_text, node.value)) + "]"
    try:
        plain = parse(f"{{x: {node.value}}}", "").plain() == {"x": node.value}
    except InputError:
        plain = False
    return node.value if plain else "'" + node.value.replace("'", "''") + "'"


def part_of(text: Node, length: float, count: int) -> str:
    """One of ``count`` equal parts of a length [m], in the unit in which the user wrote the whole."""
    whole = text.value if isinstance(text.value, str) else ""
    if is_expression(whole):
        return f"'= ({whole.strip().removeprefix('=').strip()}) / {count}'"
    unit = whole.strip().lstrip("+-.0123456789eE").strip() or "m"
    try:
        units.length.parse(f"1 {unit}")
    except UnitError:
        unit = "m"
    return units.length.show(length / count, unit)
