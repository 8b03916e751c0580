"""Design -> :class:`Graph`: vector ports unrolled, every net checked, as a networkx graph.

The graph is bipartite: component nodes ``("component", name)`` and net nodes ``("net", name)``,
one edge per port element. Here every mistake is found that needs no equation: ports left open or
used twice, domains mixed, sizes or units that differ.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, field

import networkx as nx

from crescentlab.domain import CHAMBER, SIGNAL, Domain, Port
from crescentlab.elaborate import Design, DesignNet, PortRef
from crescentlab.errors import InputError, Place
from crescentlab.units import Quantity, ratio


@dataclass(frozen=True, eq=False)
class Member:
    """One element of one port: ``element`` counts from 0; scalars have element 0."""

    instance: str
    port: Port
    element: int
    vector: bool
    place: Place | None

    def __str__(self) -> str:
        return f"{self.instance}.{self.port.name}" + (f"[{self.element + 1}]" if self.vector else "")

    @property
    def key(self) -> tuple[str, str, int]:
        return self.instance, self.port.name, self.element


@dataclass
class Net:
    """A scalar net: its name (``line`` or ``chain[2]``), its members, and the net text it came from."""

    name: str
    source: DesignNet
    domain: Domain
    members: list[Member] = field(default_factory=list)


@dataclass(frozen=True)
class Graph:
    """The unrolled circuit."""

    design: Design
    nets: list[Net]

    @functools.cached_property
    def graph(self) -> nx.MultiGraph[tuple[str, str]]:
        """Components and nets as nodes, port elements as edges."""
        graph: nx.MultiGraph[tuple[str, str]] = nx.MultiGraph()
        graph.add_nodes_from((("component", name) for name in self.design.instances), bipartite=0)
        graph.add_nodes_from((("net", net.name) for net in self.nets), bipartite=1)
        graph.add_edges_from(
            (("component", m.instance), ("net", net.name), {"member": m}) for net in self.nets for m in net.members
        )
        return graph

    def quantity(self, member: Member) -> Quantity:
        """The quantity a signal port carries."""
        return self.design.instances[member.instance].component.quantity(member.port.quantity or ratio)


def build(design: Design) -> Graph:
    """Unroll vector ports and check every net; raises :class:`InputError` naming the port."""
    nets = [net for source in design.nets for net in _unrolled(design, source)]
    result = Graph(design, nets)
    _check_connections(result)
    for net in nets:
        _check_net(result, net)
    return result


def _unrolled(design: Design, source: DesignNet) -> list[Net]:
    if not source.ports:
        raise InputError(f"net {source.name} joins no port; list at least one or remove it", source.place)
    sizes = {ref: _size(design, ref) for ref in source.ports}
    vectors = {ref: n for ref, n in sizes.items() if n is not None and ref.element is None}
    _check_domains(source)
    domain = source.ports[0].port.domain
    if not vectors:
        net = Net(source.name, source, domain)
        for ref, n in sizes.items():
            net.members += _elements(ref, n)
        return [net]
    length = next(iter(vectors.values()))
    for ref, n in sizes.items():
        if n is None or ref.element is not None:
            first = next(iter(vectors))
            raise InputError(
                f"net {source.name}: {first} has {vectors[first]} elements and {ref} is a single one; "
                f'join an element, "{first}[1]", or put all on one net, "{first}[*]"',
                ref.place,
            )
        if n != length:
            raise InputError(
                f"net {source.name}: {next(iter(vectors))} has {length} elements, {ref} has {n}; "
                "join vectors of equal size",
                ref.place,
            )
    return [
        Net(
            f"{source.name}[{k + 1}]",
            source,
            domain,
            [Member(ref.instance, ref.port, k, True, ref.place) for ref in source.ports],
        )
        for k in range(length)
    ]


def _size(design: Design, ref: PortRef) -> int | None:
    component = design.instances[ref.instance].component
    n = component.size_of(ref.port.size)
    if ref.element is None:
        return n
    if n is None:
        raise InputError(
            f"{ref}: port {ref.port.name} is a single one; write {ref.instance}.{ref.port.name}", ref.place
        )
    if isinstance(ref.element, int) and not 1 <= ref.element <= n:
        raise InputError(
            f"{ref}: port {ref.port.name} has {n} element{'' if n == 1 else 's'}, counted from 1", ref.place
        )
    return n


def _elements(ref: PortRef, n: int | None) -> list[Member]:
    if n is None:
        return [Member(ref.instance, ref.port, 0, False, ref.place)]
    which = range(n) if ref.element == "*" else [int(ref.element or 1) - 1]
    return [Member(ref.instance, ref.port, k, True, ref.place) for k in which]


def _check_domains(source: DesignNet) -> None:
    first = source.ports[0]
    for ref in source.ports[1:]:
        if ref.port.domain is not first.port.domain:
            raise InputError(
                f"net {source.name}: {first} is {first.port.domain.name} and {ref} is {ref.port.domain.name}; "
                f"join ports of one domain",
                ref.place,
            )


def _check_connections(graph: Graph) -> None:
    where: dict[tuple[str, str, int], Net] = {}
    for net in graph.nets:
        for member in net.members:
            if member.key in where:
                other = where[member.key]
                again = "twice on the net" if other is net else f"on the nets {other.source.name} and"
                raise InputError(
                    f"{member} is connected {again} {net.source.name}; a port joins one net once", member.place
                )
            where[member.key] = net
    for name, instance in graph.design.instances.items():
        for port in type(instance.component).ports():
            if port.domain is SIGNAL and port.role == "gives":
                continue  # an output that nobody reads
            n = instance.component.size_of(port.size)
            for k in range(1 if n is None else n):
                if (name, port.name, k) not in where:
                    shown = f"{name}.{port.name}" + ("" if n is None else f"[{k + 1}]")
                    raise InputError(
                        f"{shown} ({port.description}) is not connected; add it to a net, or join a {_stopper(port)}",
                        instance.place,
                    )


def _stopper(port: Port) -> str:
    return {"hydraulic": "tank or plug", "signal": "constant"}.get(port.domain.name, "part that fits it")


def _check_net(graph: Graph, net: Net) -> None:
    if net.domain is CHAMBER and len(net.members) != 2:
        names = ", ".join(str(m) for m in net.members)
        raise InputError(
            f"net {net.name}: a chamber net joins exactly two ports, the part that shapes the volume and its capacity, "
            f"not {names}",
            net.source.place,
        )
    if net.domain is SIGNAL:
        first = net.members[0]
        for member in net.members[1:]:
            a, b = graph.quantity(first), graph.quantity(member)
            if a != b:
                raise InputError(
                    f"net {net.name}: {first} carries {a.title} [{a.si}] and {member} {b.title} [{b.si}]; "
                    "signals joined have one unit",
                    member.place,
                )
