"""Pydantic's errors as one sentence at a line: where, what is wrong, and what to write instead."""

from __future__ import annotations

import typing
from difflib import get_close_matches
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from crescentlab.component import Component, field_quantity
from crescentlab.errors import InputError, Place, UnitError, nearest
from crescentlab.units import Quantity, is_number
from crescentlab.yaml_text import Node

M = TypeVar("M", bound=BaseModel)

_SAID = {
    "greater_than": "must be above {}", "greater_than_equal": "must be at least {}", "less_than": "must be below {}",
    "less_than_equal": "must be at most {}", "literal_error": "must be {}", "too_short": "needs at least {1} item",
    "int_parsing": "must be a whole number", "int_from_float": "must be a whole number",
    "int_type": "must be a whole number", "float_parsing": "must be a number", "float_type": "must be one number",
    "bool_parsing": "must be true or false", "bool_type": "must be true or false", "string_type": "must be one text",
    "list_type": "needs a list in brackets", "dict_type": "needs keys in braces", "model_type": "needs keys in braces",
}  # fmt: skip
"""What to say of pydantic's errors, filled with the limits that they name."""

_FORMS = ("list[str]", "NetSection", "str")
"""Names of alternatives in pydantic's locations: the two forms of a net, of a start value."""

_EXAMPLES = {"type": "orifice", "y": "[line.p]", "ports": "[pump.port, line.port]"}


def validated(model: type[M], node: Node, data: Any = None, *, context: Any = None, subject: str = "") -> M:
    """``model`` from the node's text (or ``data``); the first error becomes one sentence at its line."""
    try:
        return model.model_validate(node.plain() if data is None else data, context=context)
    except ValidationError as error:
        raise explained(model, error, node, subject) from None


def explained(model: type[BaseModel], error: ValidationError, node: Node, subject: str) -> InputError:
    """The sentence for the error that matters most."""
    details = _first(error, node)
    path = _path(details["loc"], node)
    key = str(path[-1]) if path else ""
    name = "".join(f"[{step + 1}]" if isinstance(step, int) else f".{step}" for step in [subject, *path]).lstrip(".")
    place = (node.place_of(*path) if path else None) or node.place
    parent = (node.place_of(*path[:-1]) if path[:-1] else None) or node.place
    kind, said, limits = details["type"], details["msg"], details.get("ctx", {})
    section, field = _field(model, path)
    if kind == "extra_forbidden":
        where = name.removesuffix(key).removesuffix(".")
        hint = _instead(section, key, details["input"])
        return InputError(f"{where + ': ' if where else ''}unknown key {key!r}: {hint}", place)
    if kind == "missing":
        return InputError(f"{name} is missing{_advice(key, field)}", parent)
    if kind == "string_pattern_mismatch":
        return InputError(f"{key!r} is not a name; use letters, digits and _, beginning with a letter", place)
    if kind in _SAID:
        quantity = field_quantity(field) if field is not None else None
        must = _SAID[kind].format(*[_shown(v, quantity) for v in limits.values()])
        return InputError(f"{name} {must}, not {_given(details['input'], quantity)}", place)
    if "line" in limits:
        place = Place(limits["file"], limits["line"])
    said = said.removeprefix("Value error, ")
    return InputError(said if "[key]" in details["loc"] or not name else f"{name}: {said}", place)


CARRIED = {
    "rotational": ({"speed", "omega", "angle", "phi", "rpm", "shaft_speed"}, {"torque"}),
    "translational": ({"velocity", "position", "x", "v"}, {"force", "f", "load"}),
    "hydraulic": ({"pressure", "p"}, {"flow", "q"}),
}
"""Names of what comes in across a port of a domain, and through it."""
SOURCES = {
    "speed": "speed_source", "omega": "speed_source", "rpm": "speed_source", "shaft_speed": "speed_source",
    "force": "force_source", "f": "force_source", "load": "force_source", "torque": "torque_source",
    "pressure": "pressure_source", "p": "pressure_source", "flow": "flow_source", "q": "flow_source",
}  # fmt: skip


def _instead(section: type[BaseModel], key: str, written: Any) -> str:
    """What to write instead of a key that does not exist: the port that takes what is meant, or the nearest key.

    A key of another quantity than the text has means something else, unless it differs by a slip of the pen alone.
    """
    fields = {info.alias or name: info for name, info in section.model_fields.items()}
    if not issubclass(section, Component):
        return nearest(key, fields)
    for port in section.ports():
        if key == port.name:
            return f"it is a port ({port.description}); join it under nets:, as component.{key}"
    fitting = [name for name, info in fields.items() if _fits(info, written) or _slip(key, name)]
    for port in section.ports():
        across, through = CARRIED.get(port.domain.name, (set(), set()))
        comes_in, goes_out = (through, across) if port.role == "gives" else (across, through)
        if key in comes_in and port.role != "undecided":
            source = f", for example a {SOURCES[key]}" if key in SOURCES else ""
            near = nearest(key, fitting, otherwise=" ") if port.domain.name == "hydraulic" else " "
            also = f"; or {near}" if near.strip() else ""
            return (
                f"it comes in through the port {port.name} ({port.description}), from what joins its net{source}{also}"
            )
        if key in goes_out and port.domain.name != "hydraulic":
            return f"the part itself gives it, at its port {port.name} ({port.description}); it is no parameter"
    return nearest(key, fitting, otherwise=f"known: {', '.join(sorted(fields)) or 'none'}")


def _slip(key: str, name: str) -> bool:
    return bool(get_close_matches(key, [name], n=1, cutoff=0.85))


def _fits(info: FieldInfo, written: Any) -> bool:
    """Whether a text may be a value of the field: of its quantity, if both have one."""
    quantity = field_quantity(info)
    if quantity is None or not isinstance(written, str) or not is_number(written):
        return True
    try:
        quantity.parse(written)
    except UnitError:
        return False
    return True


def _first(error: ValidationError, node: Node) -> Any:
    """The error to tell: a key that does not exist before one that is missing; of a net, that of the form written."""
    errors = error.errors()
    loc = next((e for e in errors if e["type"] == "extra_forbidden"), errors[0])["loc"]
    form = "NetSection" if isinstance(node.find(loc[:2]).value, dict) else "list[str]"
    alike = [e for e in errors if e["loc"][:2] == loc[:2]]
    return next((e for e in alike if form in e["loc"]), next(e for e in errors if e["loc"] == loc))


def _path(loc: tuple[Any, ...], node: Node) -> list[Any]:
    """Where in the text pydantic's location lies: its names of alternatives left out."""
    path: list[Any] = []
    for step in loc:
        here = node.find(path).value
        if step not in ("[key]", *_FORMS) or (isinstance(here, dict) and step in here):
            path.append(step)
    return path


def _field(model: type[BaseModel], path: list[Any]) -> tuple[type[BaseModel], FieldInfo | None]:
    """The model in which a path ends, and the field there (None if the last name is no field)."""
    field: FieldInfo | None = None
    for k, step in enumerate(path):
        field = next((info for n, info in model.model_fields.items() if step in (n, info.alias)), None)
        inner = _model_in(field.annotation) if field is not None else None
        if inner is not None and k < len(path) - 1:
            model = inner
    return model, field


def _model_in(annotation: Any) -> type[BaseModel] | None:
    """The pydantic model inside a field's type, if there is one."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    found = (_model_in(inner) for inner in typing.get_args(annotation))
    return next((model for model in found if model is not None), None)


def _shown(value: Any, quantity: Quantity | None) -> str:
    """A number in the first unit of its quantity."""
    if quantity is None or not isinstance(value, (int, float)):
        return f"{value:g}" if isinstance(value, float) else str(value)
    return quantity.show(value, next(iter(quantity.units))) if value else "0"


def _given(value: Any, quantity: Quantity | None) -> str:
    """What was written, for the end of a sentence."""
    if isinstance(value, (dict, list, tuple)):
        return ("keys" if isinstance(value, dict) else "a list") if value else "nothing"
    return repr(value) if isinstance(value, str) else _shown(value, quantity)


def _advice(key: str, field: FieldInfo | None) -> str:
    """What to write for a missing field."""
    quantity = field_quantity(field) if field is not None else None
    example = _EXAMPLES.get(key) or (quantity.example() if quantity is not None else "")
    if example:
        return f"; write for example {key}: {example}"
    return f" ({field.description}); write {key}: ..." if field is not None and field.description else ""
