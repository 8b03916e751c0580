"""``crescentlab components``: the library, one line per type, or one type in full."""

from __future__ import annotations

import argparse
import inspect
import math
import types
import typing
from collections.abc import Iterable
from typing import Any

from pydantic.fields import FieldInfo

from crescentlab.commands.text import table
from crescentlab.component import Component, field_quantity, snake_case
from crescentlab.domain import SIGNAL, Held, Observable, Port, Size, State
from crescentlab.errors import InputError, nearest
from crescentlab.fluid import Fluid
from crescentlab.library import Library, installed
from crescentlab.units import DISPLAY, Quantity


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    parser.add_argument("type", metavar="TYPE", nargs="?", help="a component or fluid type")


def run(options: argparse.Namespace) -> int:
    """Run the command."""
    library = installed()
    if options.type is None:
        print("\n".join(f"{name}  {first_line(cls)}" for name, cls in listed(library).items()))
        return 0
    known: dict[str, type[Component] | type[Fluid]] = {**library.components, **library.fluids}
    if options.type not in known:
        raise InputError(f"unknown component type {options.type!r}: {nearest(options.type, listed(library))}")
    print(described(options.type, known[options.type]))
    return 0


def listed(library: Library) -> dict[str, type[Component] | type[Fluid]]:
    """Types a circuit file may name, fluids last; a family stands for its forms."""
    components = {name: cls for name, cls in sorted(library.components.items()) if not is_form(cls)}
    return {**components, **dict(sorted(library.fluids.items()))}


def is_form(cls: type[Component]) -> bool:
    """Whether the class is one causal form of a family."""
    return any(issubclass(base, Component) and base.family for base in cls.__mro__[1:])


def first_line(cls: type) -> str:
    """The first line of the class's own docstring."""
    return inspect.cleandoc(cls.__doc__ or "").partition("\n")[0]


def described(name: str, cls: type[Component] | type[Fluid]) -> str:
    """A type in full: docstring, ports, parameters, states, held values, observables, where it is defined."""
    parts = [name, inspect.cleandoc(cls.__doc__ or "")]
    if issubclass(cls, Component):
        parts.append(_section("ports", ("", "role", "domain", "size", ""), [port_row(p) for p in cls.ports()]))
    parts.append(_section("parameters", ("", "quantity or choice", "default", "range", ""), parameter_rows(cls)))
    if issubclass(cls, Component):
        for title, rows in variable_rows(cls).items():
            parts.append(_section(title, ("", "quantity", "size", ""), rows))
        if cls.family:
            parts.append(f"forms, chosen by what its ends meet: {', '.join(form.type_name() for form in cls.forms())}")
    parts.append(f"defined in {cls.__module__}.{cls.__name__}")
    return "\n\n".join(part for part in parts if part)


def variable_rows(cls: type[Component]) -> dict[str, list[tuple[str, str, str, str]]]:
    """Name, quantity, size and meaning of states, held values and observables."""
    kinds: dict[str, Any] = {"states": State, "held values": Held, "observables": Observable}
    return {
        title: [(d.name, _quantity(d.quantity), _size(d.size), d.description) for d in _declared(cls, kind)]
        for title, kind in kinds.items()
    }


def _section(title: str, heads: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    """A titled table without the columns that say nothing."""
    rows = list(rows)
    if not rows:
        return ""
    kept = [k for k in range(len(heads)) if any(row[k] for row in rows)]
    shown = [tuple(row[k] for k in kept) for row in [heads, *rows]]
    return f"{title}\n{table(shown, indent='  ', fold=True)}"


def _declared(cls: type[Component], kind: type[State] | type[Held] | type[Observable]) -> list[Any]:
    """What the class declares; a family also shows what its forms share under one name."""
    found = {declared.name: declared for form in [cls, *cls.forms()] for declared in form.declared(kind)}
    return list(found.values())


def port_row(port: Port) -> tuple[str, str, str, str, str]:
    carried = f"signal, {_quantity(port.quantity or 'ratio')}" if port.domain is SIGNAL else port.domain.name
    carried += f", {limits}" if (limits := signal_range(port)) else ""
    return port.name, port.role, carried, _size(port.size), port.description


def signal_range(port: Port) -> str:
    """``0 to 1``, ``from 0 on``: what the signal is held within; empty where it has no range."""
    if port.low is None:
        return "" if port.high is None else f"up to {port.high:g}"
    return f"from {port.low:g} on" if port.high is None else f"{port.low:g} to {port.high:g}"


def _quantity(quantity: Quantity | str) -> str:
    """``pressure [bar]``; a name that is a field's stands for what that field names."""
    if isinstance(quantity, str):
        return "ratio" if quantity == "ratio" else f"as {quantity} says"
    return f"{quantity.title} [{engineers_unit(quantity)}]" if engineers_unit(quantity) else quantity.title


def engineers_unit(quantity: Quantity) -> str:
    """The unit a quantity is shown in unless a circuit says otherwise."""
    return DISPLAY.get(quantity.name) or next(iter(quantity.units))


def _size(size: Size | None) -> str:
    return "" if size is None else "from parameters" if callable(size) else str(size)


# -- parameters ----------------------------------------------------------------------------------


def parameter_rows(cls: type[Component] | type[Fluid]) -> list[tuple[str, ...]]:
    own = (
        [n for n in cls.model_fields if n not in Fluid.model_fields]
        if issubclass(cls, Fluid)
        else list(cls.model_fields)
    )
    names = own + [n for n in cls.model_fields if n not in own]
    fields = [(name, cls.model_fields[name]) for name in names]
    return [(f.alias or n, kind(f), default(f), bounds(f), f.description or "") for n, f in fields]


def kind(field: FieldInfo) -> str:
    """What a parameter is: a quantity with its unit, a choice of words, a whole number, a curve."""
    quantity = field_quantity(field)
    if quantity is not None:
        return ("list of " if "list" in str(field.annotation) or "tuple" in str(field.annotation) else "") + _quantity(
            quantity
        )
    return " or ".join(_words(field.annotation))


def _words(annotation: Any) -> list[str]:
    """The kinds of values an annotation without a quantity accepts, in words."""
    origin, arguments = typing.get_origin(annotation), typing.get_args(annotation)
    if origin is typing.Literal:
        return [str(a) for a in arguments]
    if origin is typing.Annotated:
        return _words(arguments[0])
    if origin in (typing.Union, types.UnionType):
        return [word for a in arguments if a is not type(None) for word in _words(a)]
    if origin in (list, tuple):
        return [f"list of {' or '.join(_words(arguments[0]))}"]
    name = getattr(annotation, "__name__", str(annotation))
    return [
        {"int": "whole number", "float": "number", "str": "word", "bool": "true or false"}.get(
            name, snake_case(name).replace("_", " ")
        )
    ]


def default(field: FieldInfo) -> str:
    """The default in an engineer's unit; ``required`` without one, nothing if it may be left out."""
    if field.is_required():
        return "required"
    value, quantity = field.get_default(call_default_factory=True), field_quantity(field)
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    return shown(float(value), quantity) if quantity is not None and isinstance(value, (int, float)) else str(value)


def shown(value: float, quantity: Quantity) -> str:
    """A number with the unit in which it reads best."""
    usual = engineers_unit(quantity)
    scaled = {unit: abs(value - quantity.offsets.get(unit, 0.0)) / factor for unit, factor in quantity.units.items()}
    fits = [usual, *quantity.units] if math.isfinite(value) and value else [usual]
    return quantity.show(value, next((u for u in fits if 0.1 <= scaled.get(u, 0.0) < 1e4), usual))


def bounds(field: FieldInfo) -> str:
    """``> 0, <= 1``, numbers with their units."""
    quantity, found = field_quantity(field), []
    for sign, name in ((">", "gt"), (">=", "ge"), ("<", "lt"), ("<=", "le")):
        limit = next((getattr(m, name) for m in field.metadata if getattr(m, name, None) is not None), None)
        if limit is not None:
            found.append(
                f"{sign} {shown(float(limit), quantity) if quantity is not None and limit else format(limit, 'g')}"
            )
    return ", ".join(found)
