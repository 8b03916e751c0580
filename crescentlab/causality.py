"""Graph -> :class:`Plan`: who gives what on every net, in which order; or a conflict explained.

Exactly one port on a net gives the across variable. Families with undecided ports get the form
that leaves every net with one giver, found as a matching of nets to undecided ends. Fluids spread
from nets through components. Feedthrough per port variable gives the order of evaluation; a cycle
is an algebraic loop, told port by port.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import networkx as nx

from crescentlab.component import Component
from crescentlab.domain import CHAMBER, HYDRAULIC, SIGNAL, Port
from crescentlab.elaborate import Design, Instance
from crescentlab.energy import fluid_ports, fluids_asked, fluids_needed
from crescentlab.errors import CausalityError, ComponentError, InputError, nearest
from crescentlab.fluid import Fluid
from crescentlab.graph import Graph, Member, Net
from crescentlab.library import Library
from crescentlab.netlist import FLUID
from crescentlab.trace import Trace, structure_of, trace
from crescentlab.units import Quantity, parse_any

Variable = tuple[str, int]
"""An instance's port output: instance name, place in its trace's output layout."""


@dataclass(frozen=True)
class Source:
    """Where a port input comes from: the sum of these outputs, with this sign."""

    outputs: tuple[Variable, ...]
    sign: float


class Step(NamedTuple):
    """Evaluate one group of one instance's port outputs."""

    instance: str
    group: int


@dataclass(frozen=True)
class Plan:
    """The causal circuit: instances in their forms, traces, sources of inputs, order of evaluation."""

    design: Design
    graph: Graph
    components: dict[str, Component]
    traces: dict[str, Trace]
    fluids: dict[str, dict[str, str]]
    """Per instance, the circuit's fluid for each fluid its equations, or the power through its ports, ask for."""
    sources: dict[str, tuple[Source, ...]]
    order: tuple[tuple[Step, ...], ...]
    """Waves of steps: each needs only what the waves before it give."""
    givers: dict[str, Member | None] = field(default_factory=dict)


def plan(graph: Graph, library: Library, *, allow_open: bool = False) -> Plan:
    """Decide the causality; raises :class:`CausalityError` in the user's words."""
    components = _forms(graph)
    givers = {net.name: _giver(graph, net, components, allow_open) for net in graph.nets}
    fluids = _fluids(graph, components, library)
    traces = _traces(graph.design, components, fluids)
    sources = _sources(graph, components, traces, givers)
    order = _order(graph, traces, sources)
    return Plan(graph.design, graph, components, traces, fluids, sources, order, givers)


def _role(components: dict[str, Component], member: Member) -> str:
    """The port's role in the chosen form."""
    port = type(components[member.instance]).port_named(member.port.name)
    return port.role


# -- forms of flexible components ----------------------------------------------------------------


def _forms(graph: Graph) -> dict[str, Component]:
    components = {name: i.component for name, i in graph.design.instances.items()}
    flexible = [name for name, c in components.items() if type(c).family]
    if not flexible:
        return components
    ends: dict[tuple[str, str, int], Net] = {}
    for net in graph.nets:
        for member in net.members:
            if member.port.role == "undecided":
                ends[member.key] = net
    fixed = {net.name: any(m.port.role == "gives" for m in net.members) for net in graph.nets}
    gives = _match(ends, fixed)
    for name in flexible:
        wanted = {
            port.name: _wanted(name, port, gives) for port in type(components[name]).ports() if port.role == "undecided"
        }
        components[name] = _form(graph.design.instances[name], wanted)
    return components


def _match(ends: dict[tuple[str, str, int], Net], fixed: dict[str, bool]) -> set[tuple[str, str, int]]:
    """Undecided ends that give: one for every net without a giver of its own."""
    matching: nx.Graph[Any] = nx.Graph()
    needy = {net.name for net in ends.values() if not fixed[net.name]}
    matching.add_nodes_from(("net", n) for n in needy)
    matching.add_edges_from((("net", net.name), ("end", *key)) for key, net in ends.items() if net.name in needy)
    pairs = nx.bipartite.hopcroft_karp_matching(matching, [("net", n) for n in sorted(needy)])
    return {end[1:] for net, end in pairs.items() if net[0] == "net"}


def _wanted(name: str, port: Port, gives: set[tuple[str, str, int]]) -> str:
    return "gives" if (name, port.name, 0) in gives else "takes"


def _form(instance: Instance, wanted: dict[str, str]) -> Component:
    family = type(instance.component)
    for form in instance.forms:
        roles = {p.name: p.role for p in form.ports()}
        if all(roles[name] == role for name, role in wanted.items()):
            return form.model_construct(**{n: getattr(instance.component, n) for n in family.model_fields})
    said = ", ".join(f"{name} {role} its pressure" for name, role in wanted.items())
    raise CausalityError(
        f"{instance.name}: no form of {family.type_name()} fits (here {said}); insert a capacity at one of its ends",
        instance.place,
    )


# -- givers --------------------------------------------------------------------------------------


def _giver(graph: Graph, net: Net, components: dict[str, Component], allow_open: bool) -> Member | None:
    givers = [m for m in net.members if _role(components, m) == "gives"]
    if len(givers) == 1:
        return givers[0]
    word = {"hydraulic": "pressure", "translational": "motion", "rotational": "rotation"}.get(
        net.domain.name, net.domain.name
    )
    if len(givers) > 1:
        names = " and ".join(str(m) for m in givers)
        advice = (
            "insert a restriction between them, for example {type: orifice, area: 10 mm^2}, with a net for each of its "
            "ports a and b"
            if net.domain is HYDRAULIC
            else "keep one of them"
        )
        raise CausalityError(f"net {net.name}: {names} both give the {word}; {advice}", net.source.place)
    if allow_open and net.source.open:
        return None
    names = " and ".join(str(m) for m in net.members)
    meet = (
        f"{names} meet without a volume: insert"
        if net.domain is HYDRAULIC
        else f"nothing gives the {word} of {names}: insert"
    )
    source = f"{net.domain.giver}{_constant(graph.quantity(net.members[0]))}" if net.domain is SIGNAL else None
    raise CausalityError(f"net {net.name}: {meet} {source or net.domain.giver}", net.source.place)


def _constant(quantity: Quantity) -> str:
    """A source of a signal of this quantity, as it is written."""
    value = quantity.example()
    named = "" if parse_any(value)[1] is quantity else f"output_quantity: {quantity.name}, "
    return f", for example {{type: constant, {named}value: {value}}}, its y on this net"


# -- fluids --------------------------------------------------------------------------------------


def _fluids(graph: Graph, components: dict[str, Component], library: Library) -> dict[str, dict[str, str]]:
    """The fluid of every fluid argument, spread over nets from those that name one."""
    design = graph.design
    of_net = _fluid_of_nets(graph, components)
    if len(design.fluids) == 1:
        return {
            name: dict.fromkeys(fluids_needed(type(c)), next(iter(design.fluids))) for name, c in components.items()
        }
    nets_of: dict[tuple[str, str], list[str]] = {}
    for net in graph.nets:
        for m in net.members:
            nets_of.setdefault((m.instance, m.port.name), []).append(net.name)
    result: dict[str, dict[str, str]] = {}
    for name, component in components.items():
        chosen: dict[str, str] = {}
        for argument in fluids_needed(type(component)):
            found = [
                of_net[n]
                for p in fluid_ports(type(component), argument)
                for n in nets_of.get((name, p), [])
                if n in of_net
            ]
            if found:
                chosen[argument] = found[0]
            elif argument in fluids_asked(type(component)):
                if not design.fluids:
                    raise InputError(
                        f"the circuit names no fluid; write for example fluid: {FLUID}",
                        design.instances[name].place,
                    )
                raise InputError(
                    f"{name}: its nets name no fluid; give one of them a fluid, "
                    f"for example {{fluid: {next(iter(design.fluids))}, ports: [...]}}",
                    design.instances[name].place,
                )
        result[name] = chosen
    return result


def _fluid_of_nets(graph: Graph, components: dict[str, Component]) -> dict[str, str]:
    fluids = graph.design.fluids
    hydraulic = [net for net in graph.nets if net.domain is HYDRAULIC]
    if len(fluids) == 1:
        only = next(iter(fluids))
        for net in hydraulic:
            if net.source.fluid not in (None, only):
                raise InputError(
                    f"net {net.name}: unknown fluid {net.source.fluid!r}: {nearest(str(net.source.fluid), fluids)}",
                    net.source.place,
                )
        return {net.name: only for net in hydraulic}
    together: dict[tuple[str, str], list[Net]] = {}
    for net in hydraulic:
        for member in net.members:
            cls = type(components[member.instance])
            asked = fluids_asked(cls)
            scope = (
                member.port.name
                if f"fluid_{member.port.name}" in asked
                else "fluid"
                if asked
                else f"none {member.port.name}"
            )
            together.setdefault((member.instance, scope), []).append(net)
    reach: dict[str, list[tuple[str, str]]] = {}
    for key, nets in together.items():
        for net in nets:
            reach.setdefault(net.name, []).append(key)
    of_net: dict[str, str] = {}
    for net in hydraulic:
        if net.source.fluid is None:
            continue
        if net.source.fluid not in fluids:
            raise InputError(
                f"net {net.name}: unknown fluid {net.source.fluid!r}: {nearest(str(net.source.fluid), fluids)}",
                net.source.place,
            )
        queue = deque([net])
        while queue:
            here = queue.popleft()
            if here.name in of_net:
                if of_net[here.name] != net.source.fluid:
                    raise InputError(
                        f"net {here.name}: the fluids {of_net[here.name]} and {net.source.fluid} meet here; "
                        "put a separator between them",
                        here.source.place,
                    )
                continue
            of_net[here.name] = net.source.fluid
            queue.extend(other for key in reach.get(here.name, []) for other in together[key])
    return of_net


# -- traces --------------------------------------------------------------------------------------


def _traces(design: Design, components: dict[str, Component], fluids: dict[str, dict[str, str]]) -> dict[str, Trace]:
    cache: dict[Any, Trace] = {}
    result: dict[str, Trace] = {}
    for name, component in components.items():
        mine: dict[str, Fluid] = {argument: design.fluids[fluid] for argument, fluid in fluids[name].items()}
        key = (structure_of(component), tuple((argument, structure_of(f)) for argument, f in mine.items()))
        if key not in cache:
            try:
                cache[key] = trace(component, mine)
            except ComponentError as error:
                raise InputError(str(error), design.instances[name].place) from error
        result[name] = cache[key]
    return result


# -- order ---------------------------------------------------------------------------------------


def _sources(
    graph: Graph, components: dict[str, Component], traces: dict[str, Trace], givers: dict[str, Member | None]
) -> dict[str, tuple[Source, ...]]:
    """Where each port input of each instance comes from."""
    nothing = Source((), 1.0)
    found: dict[str, list[Source]] = {name: [nothing] * tr.inputs.size for name, tr in traces.items()}

    def output(member: Member, name: str) -> Variable:
        return member.instance, traces[member.instance].outputs.offsets[name][0] + member.element

    for net in graph.nets:
        giver = givers[net.name]
        takers = [m for m in net.members if _role(components, m) == "takes"]
        for member in net.members:
            port = type(components[member.instance]).port_named(member.port.name)
            layout = traces[member.instance].inputs
            for (name, _), k in zip(port.inputs(), range(9), strict=False):
                if member is giver:
                    sign = 1.0 if net.domain is CHAMBER else -1.0
                    outputs = tuple(
                        output(m, type(components[m.instance]).port_named(m.port.name).outputs()[k][0]) for m in takers
                    )
                    source = Source(outputs, sign)
                elif giver is None:
                    source = nothing
                else:
                    source = Source(
                        (output(giver, type(components[giver.instance]).port_named(giver.port.name).outputs()[k][0]),),
                        1.0,
                    )
                found[member.instance][layout.offsets[name][0] + member.element] = source
    return {name: tuple(sources) for name, sources in found.items()}


def _order(
    graph: Graph, traces: dict[str, Trace], sources: dict[str, tuple[Source, ...]]
) -> tuple[tuple[Step, ...], ...]:
    group_of: dict[Variable, Step] = {}
    for name, tr in traces.items():
        for g, group in enumerate(tr.groups):
            step = Step(name, g)
            for k in group.outputs:
                group_of[name, k] = step
    after: dict[Step, set[Step]] = {}
    for name, tr in traces.items():
        for g, group in enumerate(tr.groups):
            after[Step(name, g)] = {group_of[v] for i in group.inputs for v in sources[name][i].outputs}
    waiting = {step: len(need) for step, need in after.items()}
    followers: dict[Step, list[Step]] = {}
    for step, need in after.items():
        for before in need:
            followers.setdefault(before, []).append(step)
    waves: list[tuple[Step, ...]] = []
    ready = [step for step, n in waiting.items() if n == 0]
    while ready:
        waves.append(tuple(ready))
        freed = [follower for step in ready for follower in followers.get(step, ())]
        ready = []
        for follower in freed:
            waiting[follower] -= 1
            if waiting[follower] == 0:
                ready.append(follower)
    if any(waiting.values()):
        raise _loop(graph, traces, {s: after[s] for s, n in waiting.items() if n > 0})
    return tuple(waves)


def _loop(graph: Graph, traces: dict[str, Trace], after: dict[Step, set[Step]]) -> CausalityError:
    """The algebraic loop among the steps that never became ready, named port by port."""
    rank = {step: k for k, step in enumerate(after)}
    edges = [(rank[before], rank[step]) for step, need in after.items() for before in need if before in rank]
    found = [edge[0] for edge in nx.find_cycle(nx.DiGraph(sorted(edges)))]
    first = found.index(min(found))
    steps = list(after)
    cycle = [steps[k] for k in found[first:] + found[:first]]
    names: list[str] = []
    for step in cycle:
        layout = traces[step.instance].outputs
        k = traces[step.instance].groups[step.group].outputs[0]
        names.append(next(f"{step.instance}.{n}" for n, _ in layout.slots if k in layout.indices(n)))
    place = graph.design.instances[cycle[0].instance].place
    instances = {step.instance for step in cycle}
    domains = {m.port.domain for net in graph.nets for m in net.members if m.instance in instances}
    advice = (
        "insert a capacity or a mass on the way"
        if domains - {SIGNAL}
        else "insert a part with a state (a first-order filter) on the way"
    )
    return CausalityError(
        f"algebraic loop: {' -> '.join([*names, names[0]])} depend on each other at the same instant; {advice}", place
    )
