"""``crescentlab schema``: a JSON schema of circuit files, so that editors complete keys and mark slips."""

from __future__ import annotations

import argparse
import json
from typing import Any

from pydantic.fields import FieldInfo

from crescentlab.commands.components import bounds, default, first_line, kind, listed, signal_range
from crescentlab.component import Component, field_quantity
from crescentlab.domain import Held, State
from crescentlab.fluid import Fluid
from crescentlab.library import Library, installed
from crescentlab.netlist import CircuitFile

SCALAR = ["string", "number", "boolean"]
"""Types an editor's YAML reader may see where the file means text: 4, 1e-6 and off among them."""


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    del parser  # nothing


def run(options: argparse.Namespace) -> int:
    """Run the command."""
    print(json.dumps(schema(installed()), indent=2, ensure_ascii=False))
    return 0


def schema(library: Library) -> dict[str, Any]:
    """The schema: circuit sections from the netlist's model, components by their type."""
    made: dict[str, Any] = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **_loosened(CircuitFile.model_json_schema()),
    }
    made["title"] = "crescentlab circuit"
    made["properties"]["crescentlab"] = {"enum": [1, "1"], "description": "format version"}
    definitions = made["$defs"]
    definitions["ComponentSection"] = _section(
        "type", library.components, "a component type, or the file of a subcircuit", library
    )
    definitions["FluidSection"] = _section("type", library.fluids, "a fluid type", library)
    fluid = {"$ref": "#/$defs/FluidSection"}
    made["properties"]["fluid"] = {**fluid, "description": "the one fluid"}
    made["properties"]["fluids"] = {
        "type": "object",
        "additionalProperties": fluid,
        "description": "several fluids by name; nets choose",
    }
    known = {
        "anyOf": [{"enum": [name for name in listed(library) if name in library.components]}, {"pattern": r"\.ya?ml$"}]
    }
    made["if"] = {"not": {"required": ["library"]}}  # without components of the user's own, every type is known
    made["then"] = {"properties": {"components": {"additionalProperties": {"properties": {"type": known}}}}}
    return made


def _loosened(node: Any) -> Any:
    """Wherever pydantic expects text or a number, an editor may see either."""
    if isinstance(node, list):
        return [_loosened(each) for each in node]
    if not isinstance(node, dict):
        return node
    made = {key: _loosened(value) for key, value in node.items()}
    if made.get("type") in ("string", "number") and "enum" not in made and "const" not in made:
        made["type"] = SCALAR
    return made


def _section(key: str, classes: dict[str, Any], description: str, library: Library) -> dict[str, Any]:
    """A section whose ``type`` decides its other keys; a type that is not known here (the user's own) takes any."""
    known = {name: classes[name] for name in listed(library) if name in classes}
    choices = [{"const": name, "description": first_line(cls)} for name, cls in known.items()]
    return {
        "type": "object",
        "required": [key],
        "properties": {key: {"description": description, "anyOf": [*choices, {"type": "string"}]}},
        "allOf": [
            {"if": {"properties": {key: {"const": name}}, "required": [key]}, "then": _type(name, cls)}
            for name, cls in known.items()
        ],
    }


def _type(name: str, cls: type[Component] | type[Fluid]) -> dict[str, Any]:
    """The keys of one type."""
    properties: dict[str, Any] = {"type": {"const": name}}
    if issubclass(cls, Component):
        ranges = [f"{port.name} {limits}" for port in cls.ports() if (limits := signal_range(port))]
        if ranges:
            properties["type"]["description"] = f"signals are held within: {', '.join(ranges)}"
        states = {d.name: d.description for form in cls.forms() for k in (State, Held) for d in form.declared(k)}
        properties["start"] = {
            "type": "object", "additionalProperties": False,
            "properties": {state: {"type": [*SCALAR, "array"], "description": text} for state, text in states.items()},
        }  # fmt: skip
    required = ["type"]
    for field_name, field in cls.model_fields.items():
        written = field.alias or field_name
        properties[written] = _parameter(field)
        if field.is_required():
            required.append(written)
    return {"properties": properties, "required": required, "additionalProperties": False}


def _parameter(field: FieldInfo) -> dict[str, Any]:
    """One parameter: its kind, range and default in words; expressions are text, so any scalar is allowed."""
    said = [field.description or "", kind(field), bounds(field)]
    made: dict[str, Any] = {
        "description": "; ".join(text for text in said if text),
        "type": [*SCALAR, "array", "object"],
    }
    quantity = field_quantity(field)
    if quantity is not None:
        made["examples"] = [quantity.example()]
    if not field.is_required() and default(field):
        made["default"] = default(field)
    return made
