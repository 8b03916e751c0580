"""``crescentlab check``: the causality of every net, states, held values, events, in a few lines."""

from __future__ import annotations

import argparse
import json
from collections import Counter
from collections.abc import Iterable, Iterator
from itertools import groupby
from typing import Any

from crescentlab.causality import Plan
from crescentlab.circuit import load
from crescentlab.commands import arguments as shared
from crescentlab.commands.text import counted, settings, table, wrapped
from crescentlab.fluid import Fluid
from crescentlab.graph import Member, Net
from crescentlab.pressures import settings_too_high
from crescentlab.units import gauge_of
from crescentlab.yaml_text import Node

MAX_NETS = 60
"""With more lines than this, nets of one kind are counted instead of listed."""
MAX_NAMES = 20
"""With more names than this, they are counted by component type."""
BLANK = "\N{NO-BREAK SPACE}"


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    shared.circuit(parser)
    shared.json(parser)


def run(options: argparse.Namespace) -> int:
    """Run the command."""
    circuit = load(options.circuit, no_code=options.no_code)
    values = settings(options.set)
    is_part = bool(circuit.netlist.sections.ports)
    plan = circuit.plan(values, allow_open=True) if is_part else circuit.system(values).plan
    found = facts(plan)
    print(json.dumps(found, indent=2) if options.json else told(plan, found))
    return 0


def facts(plan: Plan) -> dict[str, Any]:
    """What ``--json`` prints."""
    netlist = plan.design.netlist
    events = [
        {"name": f"{name}.{event.name}", "kind": event.kind} for name, tr in plan.traces.items() for event in tr.events
    ]
    if netlist.sections.simulation.stop_when:
        events.append({"name": "stop_when", "kind": "stop"})
    flexible = {name for name, i in plan.design.instances.items() if type(i.component).family}
    return {
        "title": netlist.sections.title or netlist.name, "circuit": netlist.name, "status": "done", "error": None,
        "components": {name: type(i.component).type_name() for name, i in plan.design.instances.items()},
        "fluids": _fluids(plan),
        "nets": [_net(plan, net) for net in plan.graph.nets],
        "states": _names(plan, "states"), "held": _names(plan, "held"),
        "relations": sum(len(tr.relations) for tr in plan.traces.values()),
        "events": events,
        "remarks": [
            f"{name}: {said}"
            for name, component in plan.components.items()
            for said in component.remarks(netlist.sections.simulation.stop, _fluid_of(plan, name))
        ] + [f"{said}: pressures are gauge, above 1.01325 bar absolute" for said in _absolute(netlist.node)],
        "warnings": [*plan.design.warnings, *settings_too_high(plan)],
        "forms": {name: type(c).type_name() for name, c in plan.components.items() if name in flexible},
    }  # fmt: skip


def _fluid_of(plan: Plan, name: str) -> Fluid | None:
    """The fluid in a component; of several the first, None where there is none or the circuit around names it."""
    return next((plan.design.fluids.get(fluid) for fluid in plan.fluids[name].values()), None)


def _absolute(node: Node) -> list[str]:
    """Absolute pressures that the file gives, and what they are as gauge ones; each once."""
    if isinstance(node.value, str):
        return gauge_of(node.value)
    inner = node.value if isinstance(node.value, list) else node.value.values()
    return list(dict.fromkeys(said for each in inner for said in _absolute(each)))


def _fluids(plan: Plan) -> dict[str, str]:
    """Types of the fluids that the file names; none for a part, whose fluid the circuit around it names."""
    sections = plan.design.netlist.sections
    written = sections.fluids or ({"fluid": sections.fluid} if sections.fluid else {})
    return {name: section["type"] for name, section in written.items()}


def _net(plan: Plan, net: Net) -> dict[str, Any]:
    giver = plan.givers[net.name]
    others = [m for m in net.members if m is not giver]
    reading = [m for m in others if _role(plan, m) == "reads"]
    ports = plan.design.netlist.sections.ports
    return {
        "name": net.name, "domain": net.domain.name, "given_by": str(giver) if giver else None,
        "taken_by": [str(m) for m in others if m not in reading], "read_by": [str(m) for m in reading],
        "open": [port for port, name in ports.items() if name == net.source.name],
    }  # fmt: skip


def _role(plan: Plan, member: Member) -> str:
    ports = {p.name: p.role for p in type(plan.components[member.instance]).ports()}
    return ports[member.port.name]


def _names(plan: Plan, kind: str) -> list[str]:
    """Names of states or held values, element by element."""
    names: list[str] = []
    for owner, trace in plan.traces.items():
        for name, n in getattr(trace, kind).slots:
            names += [f"{owner}.{name}"] if n is None else [f"{owner}.{name}[{k + 1}]" for k in range(n)]
    return names


# -- in words ------------------------------------------------------------------------------------


def told(plan: Plan, found: dict[str, Any]) -> str:
    """The facts as text."""
    kinds = Counter(e["kind"] for e in found["events"])
    words = {"when": "event", "every": "tick", "fail": "limit", "stop": "stop condition"}
    events = [counted(kinds[kind], word) for kind, word in words.items() if kinds[kind]] or ["no events"]
    fluids = ", ".join(sorted(set(found["fluids"].values()))) or (
        "named by the circuit around it" if plan.design.netlist.sections.ports else "none"
    )
    lines = [
        found["title"],
        "",
        wrapped("  components  ", _components(found["components"])),
        f"  fluid       {fluids}",
        wrapped("  states      ", _counted_names(found["states"], found["components"])),
        wrapped("  held        ", _counted_names(found["held"], found["components"])),
        f"  events      {', '.join(events)}, from {counted(found['relations'], 'relation')}",
    ]
    lines += [f"  form        {name} is {form}: {_ends(plan, name)}" for name, form in found["forms"].items()]
    lines += [wrapped("  remark      ", said) for said in found["remarks"]]
    rows = list(_rows(plan, found["nets"]))
    parts = ["\n".join(lines), table([("net", "domain", "given by", "taken by"), *rows], indent="  ", fold=True)]
    return "\n\n".join([*parts, *(f"  warning: {said}" for said in found["warnings"])])


def _components(types: dict[str, str]) -> str:
    counts = Counter(types.values())
    return f"{len(types)}: {', '.join(_times(name, n) for name, n in sorted(counts.items()))}" if types else "0"


def _times(name: str, n: int) -> str:
    return name if n == 1 else f"{n}{BLANK}{name}"


def _counted_names(names: list[str], types: dict[str, str]) -> str:
    """The names, or how many of each component type if they are many."""
    if not names:
        return "0"
    shown = _counted_elements(names)
    if len(shown) <= MAX_NAMES:
        return f"{len(names)}: {', '.join(shown)}"
    kinds = Counter(f"{types[owner]}.{name.partition('[')[0]}" for owner, _, name in (n.rpartition(".") for n in names))
    return f"{len(names)}: " + ", ".join(_times(name, n) for name, n in kinds.items())


def _ends(plan: Plan, name: str) -> str:
    return ", ".join(f"{p.name} {p.role}" for p in type(plan.components[name]).ports())


def _rows(plan: Plan, nets: list[dict[str, Any]]) -> Iterator[tuple[str, str, str, str]]:
    """A line per net; a vector's nets are one line, and with very many nets those of one kind are too."""
    merged = [_merged(plan, list(group)) for _, group in groupby(plan.graph.nets, key=lambda net: net.source.name)]
    if len(merged) <= MAX_NETS:
        yield from merged
        return
    alike: dict[tuple[Any, ...], list[str]] = {}
    types = {name: type(c).type_name() for name, c in plan.components.items()}
    for name, domain, giver, takers in merged:
        kind = (domain, _typed([giver], types), _typed(takers.split(", "), types))
        alike.setdefault(kind, []).append(name)
    for (domain, giver, takers), names in alike.items():
        yield (names[0] if len(names) == 1 else f"{len(names)} nets, as {names[0]}", domain, giver, takers)


def _typed(ports: Iterable[str], types: dict[str, str]) -> str:
    """Ports by component type, equal ones counted: ``2 orifice.b``."""
    counts: Counter[str] = Counter()
    for port in ports:
        owner, _, rest = port.rpartition(".")
        counts[f"{types[owner]}.{rest}" if owner in types else port] += 1
    return ", ".join(_times(port, n) for port, n in sorted(counts.items()))


def _merged(plan: Plan, nets: list[Net]) -> tuple[str, str, str, str]:
    """One line for the nets of one name."""
    first, found = nets[0], _net(plan, nets[0])
    if len(nets) > 1:
        span = f"[1..{len(nets)}]"
        found = {k: _spanned(v, span) for k, v in found.items()}
    given = found["given_by"] or f"open: {', '.join(found['open'])}"
    taken = [*found["taken_by"], *[f"{m} (reads)" for m in found["read_by"]]]
    return (
        first.source.name + ("" if len(nets) == 1 else span),
        first.domain.name,
        given,
        ", ".join(_counted_elements(taken)) or "nothing",
    )


def _spanned(value: Any, span: str) -> Any:
    if isinstance(value, list):
        return [_spanned(each, span) for each in value]
    return value.replace("[1]", span) if isinstance(value, str) else value


def _counted_elements(members: list[str]) -> list[str]:
    """``gap.b[1], gap.b[2], gap.b[3]`` in a row as ``gap.b[1..3]``."""
    shown: list[str] = []
    for base, group in groupby(members, key=lambda m: m.partition("[")[0] if m.endswith("]") else m):
        each = list(group)
        shown.append(
            each[0] if len(each) == 1 else f"{base}[{each[0].rpartition('[')[2][:-1]}..{each[-1].rpartition('[')[2]}"
        )
    return shown
