"""Parameters of a circuit file that nothing in it uses: mostly slips of the pen, of which runs and ``check`` warn."""

from __future__ import annotations

from collections.abc import Iterator

from crescentlab.errors import nearest
from crescentlab.expressions import is_expression, names_in
from crescentlab.netlist import Netlist
from crescentlab.yaml_text import Node

EVALUATED = ("outputs", "simulation")
"""Sections whose texts are expressions without a leading ``=`` as well."""
MOST = 10
"""Most parameters of a file that are told by name."""
READ = ("components", "fluid", "fluids", "nets", *EVALUATED)
"""Sections that may use parameters; parameters may use each other."""


def unused_parameters(netlist: Netlist) -> list[str]:
    """A warning for each parameter that reaches no component, fluid, output, stop rule or subcircuit."""
    texts = netlist.sections.parameters
    if not texts:
        return []
    assert isinstance(netlist.node.value, dict)
    used = {
        name
        for section in READ
        if section in netlist.node.value
        for text in _texts(netlist.node.value[section])
        if is_expression(text) or section in EVALUATED
        for name in names_in(text)
    }
    todo = [name for name in used if name in texts]
    while todo:
        text = texts[todo.pop()]
        more = names_in(text) if is_expression(text) else set()
        todo += [each for each in more - used if each in texts]
        used |= more
    known, idle = [name for name in texts if name in used], [name for name in texts if name not in used]
    warnings = [_warning(netlist, name, known) for name in idle[:MOST]]
    if len(idle) > MOST:
        warnings.append(f"{netlist.name}: nothing uses {len(idle) - MOST} more parameters")
    return warnings


def _warning(netlist: Netlist, name: str, used: list[str]) -> str:
    place = netlist.place("parameters", name)
    where = f"{place}: " if place is not None else ""
    advice = nearest(name, used, otherwise=f"write = {name} where it belongs, or remove it")
    return f"{where}nothing uses the parameter {name!r}; {advice}"


def _texts(node: Node) -> Iterator[str]:
    if isinstance(node.value, str):
        yield node.value
        return
    for child in node.value.values() if isinstance(node.value, dict) else node.value:
        yield from _texts(child)
