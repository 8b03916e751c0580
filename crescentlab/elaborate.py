"""Netlist + library -> :class:`Design`: every component an instance with SI numbers, subcircuits flat.

Expressions are evaluated here, so that a change of a parameter gives new numbers for the same
structure. Names of what lies inside a subcircuit begin with the subcircuit's: ``valve.spool``.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic.fields import FieldInfo

from crescentlab.arguments import Settings
from crescentlab.component import Component, field_quantity, is_structural
from crescentlab.domain import HYDRAULIC, Held, Observable, Port, Scheduled, State
from crescentlab.errors import ComponentError, ExpressionError, InputError, Place, UnitError, nearest
from crescentlab.explain import validated
from crescentlab.expressions import Value, evaluate, is_expression, names_in, number_of
from crescentlab.fluid import Fluid
from crescentlab.library import Library
from crescentlab.netlist import FLUID, Netlist, NetSection, net_ports
from crescentlab.units import QUANTITIES, Quantity, is_number, parse_any
from crescentlab.unused import unused_parameters
from crescentlab.yaml_text import Node

MAX_SUBCIRCUIT_DEPTH = 20
COMMAND = Place("--set", 0)
START_PRESSURE = "start_pressure"
"""Parameter of parts whose states are computed from it, such as lines."""


@dataclass(frozen=True)
class Instance:
    """One component of the flat circuit: validated, with start values the user gave (SI)."""

    name: str
    component: Component
    place: Place | None
    start: dict[str, np.ndarray] = field(default_factory=dict)
    forms: tuple[type[Component], ...] = ()
    """Of a family, the causal forms that the library of its file has; of another class, itself."""
    places: dict[str, Place | None] = field(default_factory=dict)
    """Where each of its parameters was written, and each start value, as ``start.p``."""
    written: Node = field(default_factory=lambda: Node({}))
    """Its own text in the file."""


@dataclass(frozen=True, eq=False)
class PortRef:
    """A port of an instance, one element of it (from 1), or all its elements on one net (``"*"``)."""

    instance: str
    port: Port
    element: int | str | None
    place: Place | None

    def __str__(self) -> str:
        return f"{self.instance}.{self.port.name}" + (f"[{self.element}]" if self.element is not None else "")


@dataclass
class DesignNet:
    """Ports joined together; ``aliases`` are its names inside subcircuits."""

    name: str
    place: Place | None
    ports: list[PortRef] = field(default_factory=list)
    fluid: str | None = None
    aliases: list[str] = field(default_factory=list)
    open: bool = False


@dataclass(frozen=True)
class Output:
    """A named expression over variables, seen from the scope (``valve.``) it was written in."""

    name: str
    text: str
    scope: str
    place: Place | None


@dataclass(frozen=True)
class Design:
    """The flat circuit with numbers: what the graph is made of."""

    netlist: Netlist
    instances: dict[str, Instance]
    nets: list[DesignNet]
    fluids: dict[str, Fluid]
    outputs: list[Output]
    parameters: dict[str, dict[str, Value]]
    """Parameter values per scope ('' is the circuit's own)."""
    warnings: tuple[str, ...] = ()
    """What the text has that will not do what its writer may think."""


def elaborate(netlist: Netlist, library: Library, settings: Settings | None = None, *, no_code: bool = False) -> Design:
    """Flatten ``netlist``; ``settings`` are ``--set`` texts, or numbers in SI, by dotted name.

    Raises :class:`InputError` with file and line for whatever in the files, or ``--set`` for whatever
    in the settings, cannot be used.
    """
    work = _Elaboration(no_code)
    overrides = _Overrides(dict(settings or {}))
    library = work.with_user_files(netlist, library)
    fluids = work.fluids(netlist, library, overrides)
    work.start_pressure = _start_pressure(netlist, overrides)
    work.scope(netlist, library, "", {}, overrides, (netlist.folder / netlist.name,))
    overrides.check_used()
    warnings = [said for each in (netlist, *work.parts.values()) for said in unused_parameters(each)]
    warnings += [f"{name}: {said}" for name, fluid in fluids.items() for said in fluid.remarks()]
    return Design(netlist, work.instances, work.joined_nets(), fluids, work.outputs, work.parameters, tuple(warnings))


class _Overrides:
    """Texts and numbers given by ``--set`` or from Python; each must be used by something."""

    def __init__(self, values: dict[str, Any]) -> None:
        self.values = values
        self.used: set[str] = set()
        self.known: set[str] = set()

    def take(self, name: str) -> Any:
        self.known.add(name)
        if name in self.values:
            self.used.add(name)
            return self.values[name]
        return None

    def check_used(self) -> None:
        for name in self.values:
            if name not in self.used:
                raise InputError(f"--set {name}: nothing has this name: {nearest(name, self.known)}")


class _Elaboration:
    """Collects the flat circuit while walking subcircuits."""

    def __init__(self, no_code: bool) -> None:
        self.no_code = no_code
        self.instances: dict[str, Instance] = {}
        self.nets: dict[str, DesignNet] = {}
        self.joins: list[tuple[str, str]] = []  # outer net, inner net
        self.outputs: list[Output] = []
        self.parameters: dict[str, dict[str, Value]] = {}
        self.parts: dict[str, Netlist] = {}
        self.made: dict[Any, Any] = {}
        self.start_pressure: float | None = None
        """Of parts that state none of their own [Pa]."""

    def with_user_files(self, netlist: Netlist, library: Library) -> Library:
        for k, text in enumerate(netlist.sections.library):
            place = netlist.place("library", k)
            if self.no_code:
                raise InputError(f"{text} would run Python code, which --no-code refuses", place)
            library = library.extended(netlist.folder / text, place)
        return library

    # -- numbers ---------------------------------------------------------------------------------

    def fluids(self, netlist: Netlist, library: Library, overrides: _Overrides) -> dict[str, Fluid]:
        values = _parameter_values(netlist, {}, overrides, "")
        made: dict[str, Fluid] = {}
        sections = netlist.sections
        given = sections.fluids or ({"fluid": sections.fluid} if sections.fluid is not None else {})
        for name in given:
            path = ("fluids", name) if sections.fluids else ("fluid",)
            node = replace(netlist.node.find(path), place=netlist.place(*path))
            assert isinstance(node.value, dict)
            if "type" not in node.value:
                raise InputError(f"the fluid needs a type, for example fluid: {FLUID}", node.place)
            cls = library.fluid(str(node.value["type"].value), node.place_of("type"))
            made[name] = self.instance(cls, node, _scope_lookup(values, netlist), overrides, name, netlist.folder)
        return made

    def scope(
        self,
        netlist: Netlist,
        library: Library,
        prefix: str,
        passed: Mapping[str, Value],
        overrides: _Overrides,
        chain: tuple[Path, ...],
    ) -> None:
        """Add one circuit's components, nets and outputs under ``prefix`` ('' or 'valve.')."""
        sections = netlist.sections
        values = _parameter_values(netlist, passed, overrides, prefix)
        self.parameters[prefix] = values
        inner_ports: dict[str, dict[str, str]] = {}
        for name, section in sections.components.items():
            node = replace(netlist.node.find(("components", name)), place=netlist.place("components", name))
            full = prefix + name
            if section.type.endswith((".yaml", ".yml")):
                inner_ports[name] = self.subcircuit(
                    netlist, section.type, node, full, values, library, overrides, chain
                )
            else:
                self.component(netlist, library, section.type, node, full, values, overrides)
        for name, net in sections.nets.items():
            self.net(netlist, prefix, name, net, inner_ports)
        for name in sections.outputs:
            place = netlist.place("outputs", name)
            if not is_expression(sections.outputs[name]):
                raise InputError(
                    f"output {name!r} must be an expression, for example {name}: '= line.p * valve.q'", place
                )
            self.outputs.append(Output(prefix + name, sections.outputs[name], prefix, place))

    def component(
        self,
        netlist: Netlist,
        library: Library,
        kind: str,
        node: Node,
        full: str,
        values: dict[str, Value],
        overrides: _Overrides,
    ) -> None:
        cls = library.component(kind, node.place_of("type"))
        lookup = _scope_lookup(values, netlist)
        instance = self.instance(cls, node, lookup, overrides, full, netlist.folder, self.start_fields(cls))
        try:
            for declared in [*cls.ports(), *cls.declared(State), *cls.declared(Held), *cls.declared(Observable)]:
                instance.size_of(declared.size)
        except ComponentError as error:
            raise InputError(f"{full}: {error}", node.place) from None
        forms = library.forms(cls)
        begins = [s for form in forms for s in form.declared(State) + form.declared(Held)]
        stateful = {s.name: s for s in begins if not isinstance(s, Scheduled)}
        start: dict[str, np.ndarray] = {}
        given = node.value["start"].value if isinstance(node.value, dict) and "start" in node.value else {}
        assert isinstance(given, dict)  # as the netlist checked
        for name in given:
            if name not in stateful:
                raise InputError(
                    f"{full}: no state {name!r} to start: {nearest(name, stateful)}", node.place_of("start", name)
                )
        for name, declared in stateful.items():
            setting = overrides.take(f"{full}.start.{name}")
            source = Node(setting, COMMAND) if isinstance(setting, str) else given.get(name)
            subject = f"{'--set ' if setting is not None else ''}{full}.start.{name}"
            if setting is not None and not isinstance(setting, str):
                start[name] = _si(setting, subject)
            elif source is not None:
                quantity = instance.quantity(declared.quantity)
                items = source.value if isinstance(source.value, list) else [source]
                start[name] = np.array([_number(str(i.value), quantity, lookup, subject, i.place) for i in items])
            elif self.start_pressure is not None and _takes_start_pressure(cls, instance, declared):
                start[name] = np.array([self.start_pressure])
        assert isinstance(node.value, dict)
        places = {name: child.place for name, child in node.value.items()}
        places |= {f"start.{name}": child.place for name, child in given.items()}
        written = [*cls.model_fields, *(f"start.{name}" for name in stateful)]
        places |= {name: COMMAND for name in written if f"{full}.{name}" in overrides.used}
        self.instances[full] = Instance(full, instance, node.place, start, tuple(forms), places, node)

    def start_fields(self, cls: type[Component]) -> dict[str, float]:
        """The parameters of a class that the circuit's start pressure serves where they are not given."""
        if self.start_pressure is None:
            return {}
        named = {s.start for form in cls.forms() for s in form.declared(State) if s.quantity is QUANTITIES["pressure"]}
        return {n: self.start_pressure for n in cls.model_fields if n == START_PRESSURE or n in named}

    def instance(
        self, cls: type[Any], node: Node, lookup: Any, overrides: _Overrides, full: str, folder: Path,
        otherwise: Mapping[str, float] | None = None,
    ) -> Any:  # fmt: skip
        """Validate a component or fluid; expressions become numbers first, ``--set`` texts replace.

        Of parameters that nobody gives, those in ``otherwise`` have these values.

        Those of equal values are one object: a large circuit has few kinds of parts.
        """
        assert isinstance(node.value, dict)
        data: dict[str, Any] = {}
        kept = {"type", "start"} if issubclass(cls, Component) else {"type"}
        given = {name: child for name, child in node.value.items() if name not in kept}
        from_command: set[str] = set()
        fields = {info.alias or name: info for name, info in cls.model_fields.items()}
        numbers: dict[str, Any] = {}
        for name, info in fields.items():
            setting = overrides.take(f"{full}.{name}")
            if setting is not None:
                from_command.add(name)
                if not isinstance(setting, str):
                    numbers[name] = _written(setting, info, given.get(name), lookup, f"--set {full}.{name}")
                given[name] = Node(str(setting), COMMAND)
        for name, child in given.items():
            found = fields.get(name)
            where = f"--set {full}.{name}" if name in from_command else f"{full}.{name}"
            data[name] = numbers.get(name)
            if data[name] is None:
                data[name] = _plain(child, found, lookup, where) if found is not None else child.plain()
        data = {**(otherwise or {}), **data}
        key = cls, folder, repr(data)
        if key in self.made:
            return self.made[key]
        try:
            made = validated(cls, node, data, context={"folder": str(folder)}, subject=full)
        except InputError as error:
            if any(re.match(rf"{re.escape(f'{full}.{name}')}\b", error.message) for name in from_command):
                raise type(error)(f"--set {error.message}") from None
            raise
        self.made[key] = made
        return made

    def subcircuit(
        self, netlist: Netlist, file: str, node: Node, full: str, values: dict[str, Value], library: Library,
        overrides: _Overrides,         chain: tuple[Path, ...],
    ) -> dict[str, str]:  # fmt: skip
        """Elaborate a subcircuit file; return which inner net each of its ports is."""
        place = node.place_of("type")
        path = netlist.folder / file
        key = path.resolve().with_suffix("")
        if key in [c.resolve() for c in chain]:
            names = " -> ".join([c.name for c in (*chain, key)])
            raise InputError(f"subcircuits contain each other: {names}; remove one of these", place)
        if len(chain) > MAX_SUBCIRCUIT_DEPTH:
            raise InputError(f"subcircuits nested deeper than {MAX_SUBCIRCUIT_DEPTH}", place)
        if not path.is_file():
            raise InputError(
                f"the subcircuit {file} does not exist; it is looked for beside the file that names it", place
            )
        if str(key) not in self.parts:
            self.parts[str(key)] = Netlist.read(path)
        part = self.parts[str(key)]
        if not part.sections.ports:
            raise InputError(f"{file} has no ports; give it some, for example ports: {{inlet: p_line}}", place)
        assert isinstance(node.value, dict)
        lookup = _scope_lookup(values, netlist)
        passed: dict[str, Value] = {}
        for name, child in node.value.items():
            if name == "type":
                continue
            if name == "start":
                raise InputError(
                    f"{full}: a subcircuit has no states of its own; start its components in {file}, "
                    "by parameters of it",
                    node.place_of(name),
                )
            if name not in part.sections.parameters:
                raise InputError(
                    f"{full}: {file} has no parameter {name!r}: {nearest(name, part.sections.parameters)}",
                    node.place_of(name),
                )
            if not isinstance(child.value, str):
                raise InputError(f"{full}.{name} must be one text, not a list or keys", node.place_of(name))
            kind = _kind(part.sections.parameters[name])
            passed[name] = _value(child.value, lookup, f"{full}.{name}", child.place, kind)
        self.scope(part, self.with_user_files(part, library), full + ".", passed, overrides, (*chain, key))
        for port, net in part.sections.ports.items():
            if net not in part.sections.nets:
                raise InputError(
                    f"port {port!r} names the net {net!r}, which does not exist: {nearest(net, part.sections.nets)}",
                    part.place("ports", port),
                )
        return {port: f"{full}.{net}" for port, net in part.sections.ports.items()}

    # -- nets ------------------------------------------------------------------------------------

    def net(
        self,
        netlist: Netlist,
        prefix: str,
        name: str,
        section: list[str] | NetSection,
        inner_ports: dict[str, dict[str, str]],
    ) -> None:
        base = ("nets", name, "ports") if isinstance(section, NetSection) else ("nets", name)
        net = DesignNet(prefix + name, netlist.place("nets", name))
        net.open = prefix == "" and name in netlist.sections.ports.values()
        if isinstance(section, NetSection):
            net.fluid = section.fluid
        self.nets[net.name] = net
        for k, text in enumerate(net_ports(section)):
            place = netlist.place(*base, k) or net.place
            match = re.fullmatch(r"([\w.]+)\.(\w+)(?:\[(\d+|\*)\])?", text.strip())
            if not match:
                raise InputError(
                    f"net {name}: {text!r} is not a port; write component.port, component.port[2] or component.port[*]",
                    place,
                )
            owner, port_name, index = match[1], match[2], match[3]
            if owner in inner_ports:
                ports = inner_ports[owner]
                if port_name not in ports:
                    raise InputError(
                        f"net {name}: subcircuit {owner!r} has no port {port_name!r}: {nearest(port_name, ports)}",
                        place,
                    )
                self.joins.append((net.name, ports[port_name]))
                continue
            instance = self.instances.get(prefix + owner)
            if instance is None or owner not in netlist.sections.components:
                raise InputError(
                    f"net {name}: no component {owner!r}: {nearest(owner, netlist.sections.components)}", place
                )
            known = {p.name: p for p in type(instance.component).ports()}
            if port_name not in known:
                raise InputError(f"net {name}: {owner!r} has no port {port_name!r}: {nearest(port_name, known)}", place)
            element = index if index in (None, "*") else int(index)
            net.ports.append(PortRef(instance.name, known[port_name], element, place))

    def joined_nets(self) -> list[DesignNet]:
        """Nets with those of subcircuits merged into the outermost net they meet."""
        parent = {name: name for name in self.nets}
        rank = {name: (name.count("."), k) for k, name in enumerate(self.nets)}

        def root(name: str) -> str:
            while parent[name] != name:
                parent[name] = parent[parent[name]]
                name = parent[name]
            return name

        for outer, inner in self.joins:
            a, b = root(outer), root(inner)
            if a != b:
                keep, drop = sorted((a, b), key=rank.__getitem__)
                parent[drop] = keep
        for name, net in self.nets.items():
            kept = self.nets[root(name)]
            if kept is not net:
                kept.ports += net.ports
                kept.aliases.append(name)
                kept.fluid = kept.fluid or net.fluid
                kept.open = kept.open or net.open
        return [net for name, net in self.nets.items() if root(name) == name]


def _start_pressure(netlist: Netlist, overrides: _Overrides) -> float | None:
    """The start pressure of parts that state none of their own [Pa], if the circuit names one."""
    text, place = netlist.sections.simulation.start_pressure, netlist.place("simulation", "start_pressure")
    if text is None:
        return None
    values = _parameter_values(netlist, {}, overrides, "")
    return _number(text, QUANTITIES["pressure"], _scope_lookup(values, netlist), "simulation.start_pressure", place)


def _takes_start_pressure(cls: type[Component], instance: Component, declared: State | Held) -> bool:
    """Whether a state begins at the circuit's start pressure: a pressure of fluid whose start is a plain number.

    One that begins at a parameter or is computed follows from these (:meth:`_Elaboration.start_fields`).
    """
    return (
        isinstance(declared, State)
        and isinstance(declared.start, (int, float))
        and instance.quantity(declared.quantity) is QUANTITIES["pressure"]
        and any(port.domain is HYDRAULIC for port in cls.ports())
    )


def _kind(default: str) -> Quantity | None:
    """The quantity that a parameter's default shows; None for words, expressions, and what cannot be read."""
    if is_expression(default) or not is_number(default):
        return None
    try:
        return parse_any(default)[1]
    except UnitError:
        return None


def _parameter_values(
    netlist: Netlist, passed: Mapping[str, Value], overrides: _Overrides, prefix: str
) -> dict[str, Value]:
    """Values of a scope's parameters, in any order of writing; a circle is an error."""
    texts = netlist.sections.parameters
    values: dict[str, Value] = {}
    running: list[str] = []

    def find(name: str) -> Value:
        if name not in texts:
            raise ExpressionError(f"unknown name {name!r}: {nearest(name, texts)}")
        if name not in values:
            if name in running:
                raise ExpressionError(f"parameters depend on each other: {' -> '.join([*running, name])}")
            running.append(name)
            place = netlist.place("parameters", name)
            setting = overrides.take(prefix + name)
            if isinstance(setting, str):
                values[name] = _value(setting, find, f"--set {prefix}{name}", COMMAND, _kind(texts[name]))
            elif setting is not None:
                own = _value(texts[name], find, name, place)
                values[name] = _si_value(setting, own, f"--set {prefix}{name}")
            elif name in passed:
                values[name] = passed[name]
            else:
                values[name] = _value(texts[name], find, name, place)
            running.pop()
        return values[name]

    for name in texts:
        todo = [name]
        while todo:  # what a long chain rests on comes first, so that its length does not matter
            given = overrides.values.get(prefix + todo[-1], texts[todo[-1]])
            asked = names_in(given) if isinstance(given, str) and is_expression(given) else set()
            waiting = [each for each in sorted(asked) if each in texts and each not in values]
            if not waiting or todo[-1] in values or todo[-1] in passed:
                find(todo.pop())
            elif waiting[0] not in todo:
                todo.append(waiting[0])
            else:  # a circle, which is told from its first name on
                find(todo[0])
    return values


def _scope_lookup(values: Mapping[str, Value], netlist: Netlist) -> Any:
    def find(name: str) -> Value:
        if name not in values:
            raise ExpressionError(f"unknown name {name!r}: {nearest(name, values)}")
        return values[name]

    return find


def _value(text: str, lookup: Any, subject: str, place: Place | None, kind: Quantity | None = None) -> Value:
    """A parameter's text as a value: expression, number with unit, or word; of ``kind`` if that is known."""
    try:
        if is_expression(text):
            value = evaluate(text, lookup)
            return value if kind is None else Value(number_of(value, kind), kind)
        if kind is not None:
            return Value(kind.parse(text), kind, written=True)
        if is_number(text):
            number, quantity = parse_any(text)
            return Value(number, quantity, written=True)
        return Value(text)
    except InputError as error:
        raise _described(error, subject, place) from None


def _si(setting: Any, subject: str) -> np.ndarray:
    """Start values handed over as numbers."""
    array = np.atleast_1d(np.asarray(setting))
    if array.ndim != 1 or array.dtype.kind not in "if":
        raise InputError(f"{subject}: write one number in SI, or a list of them")
    return array.astype(float)


def _si_value(setting: Any, own: Value, subject: str) -> Value:
    """A circuit parameter handed over as a number: of the quantity that its own value has."""
    if isinstance(own.value, str) and not isinstance(setting, bool):
        raise InputError(f"{subject}: {setting} is a number, where a word such as {own.value!r} belongs")
    if isinstance(setting, (tuple, bool)):
        raise InputError(f"{subject}: write one number in SI, or text with a unit")
    return Value(float(setting), own.quantity, own.written)


def _written(setting: Any, info: FieldInfo, own: Node | None, lookup: Any, subject: str) -> Any:
    """A component's parameter handed over as a number, as pydantic takes it."""
    if field_quantity(info) is not None:
        if isinstance(setting, bool):
            raise InputError(f"{subject}: {setting} is no number; write one in SI, or text with a unit")
        return setting
    if is_structural(info) or own is None or not isinstance(own.value, str) or isinstance(setting, (tuple, bool)):
        return list(setting) if isinstance(setting, tuple) else setting
    # the component reads the quantity off the unit that the circuit wrote
    text = _plain(own, info, lookup, subject)
    unit = parse_any(text)[1].si if isinstance(text, str) and is_number(text) else ""
    return f"{float(setting)!r} {unit if unit != '1' else ''}".strip()


def _described(error: InputError, subject: str, place: Place | None) -> InputError:
    if error.place is not None:
        return error
    message = f"{subject}: {error.message}" if not error.message.startswith(subject) else error.message
    return type(error)(message, None if place is COMMAND else place)


def _number(text: str, quantity: Any, lookup: Any, subject: str, place: Place | None) -> float:
    try:
        if is_expression(text):
            value = evaluate(text, lookup)
            return number_of(value, quantity)
        return float(quantity.parse(text))
    except InputError as error:
        raise _described(error, subject, place) from None


def _plain(node: Node, info: Any, lookup: Any, subject: str) -> Any:
    """A field's node as pydantic takes it: expressions evaluated and checked for dimension."""
    if isinstance(node.value, list):
        return [_plain(child, info, lookup, subject) for child in node.value]
    if isinstance(node.value, dict):
        return node.plain()
    text = node.value
    if not is_expression(text):
        return _whole(text, info)
    try:
        value = evaluate(text, lookup)
        quantity = field_quantity(info)
        if isinstance(value.value, str):
            return value.value
        if quantity is None and not is_structural(info):
            # a number whose quantity the component itself decides: its reader wants the unit
            return f"{float(value.value)!r} {value.quantity.si if value.quantity.name != 'ratio' else ''}".strip()
        if quantity is None:
            number = number_of(value, QUANTITIES["ratio"])
            return int(number) if number.is_integer() else number
        return number_of(value, quantity)
    except InputError as error:
        raise _described(error, subject, node.place) from None


def _whole(text: str, info: Any) -> Any:
    """Whole numbers and true/false reach pydantic as such; everything else stays text."""
    if is_structural(info) and field_quantity(info) is None:
        if text in ("true", "false"):
            return text == "true"
        if text in ("null", "none", "~"):
            return None
    return text
