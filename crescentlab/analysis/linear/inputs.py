"""Inputs of a linear model: parameters of the circuit, and flows or forces brought into a net by a probe.

A probe is a component of one port and one parameter, zero at the operating point, added to the design before it is
assembled: it takes what the net gives, so it changes neither the causality nor a single equation.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from crescentlab import units
from crescentlab.analysis.reach import NotDifferentiableError, Parameter, Reaching, quantity_of
from crescentlab.arguments import Settings
from crescentlab.circuit import Circuit
from crescentlab.component import Component, Equations
from crescentlab.domain import HYDRAULIC, ROTATIONAL, TRANSLATIONAL, takes_motion, takes_pressure, takes_rotation
from crescentlab.elaborate import Design, DesignNet, Instance, PortRef
from crescentlab.errors import InputError, nearest
from crescentlab.maths import stack
from crescentlab.system import System
from crescentlab.trace import numeric_fields
from crescentlab.units import Flow, Force, Quantity, Torque

Array = np.ndarray

SHAPES = "shapes the equations and has no derivative"
ROUNDING = 1e-11
"""A number that changes by this part of itself as a circuit parameter changes by its size is only rounded anew."""


class _Probe(Component):
    """A through variable brought into one element of a net."""

    family = True

    elements: int | None = None
    element: int = 0

    def into(self, value: Any) -> Any:
        """What the port gives: the value out of the probe, at one element of a vector net."""
        if self.elements is None:
            return -value
        return stack(*[-value if k == self.element else 0.0 for k in range(self.elements)])


class FlowProbe(_Probe):
    """Flow brought into a hydraulic net: q_port = -q [m^3/s], zero at the operating point."""

    family = False

    through: Flow = 0.0
    port = takes_pressure("the net", size="elements")

    def equations(self) -> Equations:
        """The flow out of the probe."""
        return {"q_port": self.into(self.through)}


class ForceProbe(_Probe):
    """Force brought onto a mass: f_port = -f [N], zero at the operating point."""

    family = False

    through: Force = 0.0
    port = takes_motion("the net", size="elements")

    def equations(self) -> Equations:
        """The reaction on the probe."""
        return {"f_port": self.into(self.through)}


class TorqueProbe(_Probe):
    """Torque brought onto a shaft: torque_port = -torque [N m], zero at the operating point."""

    family = False

    through: Torque = 0.0
    port = takes_rotation("the net", size="elements")

    def equations(self) -> Equations:
        """The reaction on the probe."""
        return {"torque_port": self.into(self.through)}


PROBES: dict[str, tuple[type[_Probe], str, Quantity]] = {
    HYDRAULIC.name: (FlowProbe, "q", units.flow),
    TRANSLATIONAL.name: (ForceProbe, "f", units.force),
    ROTATIONAL.name: (TorqueProbe, "torque", units.torque),
}
"""By domain: the probe, its through variable, and that variable's quantity."""


@dataclass(frozen=True)
class Input:
    """One input: its name, quantity, and how much each of the system's parameters changes with it."""

    name: str
    quantity: Quantity
    probe: str = ""
    """The probe's instance, or nothing: then the input is a parameter."""
    direction: tuple[tuple[int, float], ...] = ()
    """Places in p and dp/du there."""


@dataclass(frozen=True)
class _Net:
    """A net as inputs name it."""

    net: DesignNet
    element: int | None


def net_named(design: Design, text: str) -> _Net | None:
    """The net called ``p_line``, ``p_line.q``, ``valve.p_in`` or ``chain[2]``; None if there is none."""
    match = re.fullmatch(r"(.*?)(?:\[(\d+)\])?(?:\.(q|f|torque))?(?:\[(\d+)\])?", text)
    assert match is not None
    name, element, through = match[1], match[2] or match[4], match[3]
    for net in design.nets:
        if name in (net.name, *net.aliases):
            known = PROBES.get(net.ports[0].port.domain.name)
            if through is not None and (known is None or known[1] != through):
                return None
            return _Net(net, None if element is None else int(element))
    return None


def size_of_net(design: Design, net: DesignNet) -> int | None:
    """Number of elements of a vector net; None for a single net."""
    for ref in net.ports:
        n = design.instances[ref.instance].component.size_of(ref.port.size)
        if n is not None and ref.element is None:
            return n
    return None


class Inputs:
    """Resolves the names of inputs: first probes into the design, then places in the assembled system's p."""

    def __init__(self, circuit: Circuit, settings: Settings, design: Design) -> None:
        self.circuit, self.settings, self.design = circuit, dict(settings), design
        self.found: dict[str, Input] = {}

    def probe(self, names: Sequence[str]) -> Design:
        """The design with a probe at every net that an input names."""
        for name in dict.fromkeys(names):
            target = net_named(self.design, name)
            if target is None:
                continue
            if name in self._parameters():
                raise InputError(
                    f"input {name}: both a net and a parameter have this name; write "
                    f"{name}.{self._known(target)[1]} for the net, or rename the parameter"
                )
            self._add(name, target)
        return self.design

    def _known(self, target: _Net) -> tuple[type[_Probe], str, Quantity]:
        domain = target.net.ports[0].port.domain
        if domain.name not in PROBES:
            raise InputError(
                f"input {target.net.name}: this is a {domain.name} net, into which nothing can be brought; "
                "name a parameter of the part that gives it, or a hydraulic or mechanical net"
            )
        return PROBES[domain.name]

    def _add(self, name: str, target: _Net) -> None:
        cls, _, quantity = self._known(target)
        n = size_of_net(self.design, target.net)
        if n is not None and (target.element is None or not 1 <= target.element <= n):
            raise InputError(
                f"input {name}: the net {target.net.name} has {n} elements; name one, for example {target.net.name}[1]"
            )
        if n is None and target.element is not None:
            raise InputError(f"input {name}: the net {target.net.name} is a single one; write {target.net.name}")
        element = (target.element or 1) - 1
        instance = f"probe of {target.net.name}[{element + 1}]"
        if instance not in self.design.instances:
            part = cls(elements=n, element=element)
            ref = PortRef(instance, cls.port_named("port"), None, None)
            nets = [
                replace(net, ports=[*net.ports, ref]) if net.name == target.net.name else net
                for net in self.design.nets
            ]
            instances = {**self.design.instances, instance: Instance(instance, part, None, forms=(type(part),))}
            self.design = replace(self.design, instances=instances, nets=nets)
        self.found[name] = Input(name, quantity, instance)

    def _parameters(self) -> list[str]:
        """Names of the circuit's own parameters, those inside subcircuits with the subcircuit's name."""
        return [scope + name for scope, values in self.design.parameters.items() for name in values]

    # -- places in p ------------------------------------------------------------------------------

    def place(self, names: Sequence[str], system: System) -> tuple[Input, ...]:
        """The inputs with their places in the system's p; raises :class:`InputError` for a name that is none."""
        known = parameter_places(system, self.design)
        return tuple(self._placed(name, known, system) for name in names)

    def _placed(self, name: str, known: dict[str, tuple[int, Quantity]], system: System) -> Input:
        if name in self.found:
            found = self.found[name]
            return replace(found, direction=((known[f"{found.probe}.through"][0], 1.0),))
        if name in known:
            return Input(name, known[name][1], "", ((known[name][0], 1.0),))
        if name in self._parameters():
            return self._through_the_design(name, system)
        self._refuse_structure(name)
        nets = [n.name for n in self.design.nets if n.ports[0].port.domain.name in PROBES]
        raise InputError(f"input {name}: no parameter or net has this name: {nearest(name, self._names(known, nets))}")

    def _names(self, known: dict[str, tuple[int, Quantity]], nets: list[str]) -> list[str]:
        return [n for n in [*known, *nets, *self._parameters()] if not n.startswith("probe of ")]

    def _refuse_structure(self, name: str) -> None:
        """Say why a field that exists is no input."""
        owner, _, field = name.rpartition(".")
        part: Any = self.design.fluids.get(owner)
        if part is None and owner in self.design.instances:
            part = self.design.instances[owner].component
        fields = {info.alias or n: n for n, info in type(part).model_fields.items()} if part is not None else {}
        if field in fields:
            raise _refused(name, "is not given" if getattr(part, fields[field]) is None else SHAPES)

    def _through_the_design(self, name: str, system: System) -> Input:
        """A circuit parameter: how the components' parameters change with it."""
        scope, _, own = name.rpartition(".")
        value = self.design.parameters[f"{scope}." if scope else ""][own]
        if isinstance(value.value, str):
            raise InputError(f"input {name}: it is the word {value.value!r}; an input is a number")
        parameter = Parameter(name, float(value.value), value.quantity, "input")
        reaching = Reaching(self._with_probes, system, self.design, self.settings)
        if reaching.shapes(parameter):
            raise _refused(name, SHAPES)
        try:
            slope = reaching.reach(parameter).p
        except NotDifferentiableError:
            said = f"input {name}: at this value an expression of it has a kink or jumps; move it a little"
            raise InputError(said) from None
        places = np.flatnonzero(np.abs(slope) * parameter.size > ROUNDING * np.abs(system.values(self.design).p))
        if not places.size:
            raise InputError(f"input {name}: no number inside the equations depends on it; it changes nothing here")
        return Input(name, value.quantity, "", tuple((int(k), float(slope[k])) for k in places))

    def _with_probes(self, settings: Settings) -> Design:
        """The design of other settings with the same probes."""
        design = self.circuit.design(settings)
        probes = {n: i for n, i in self.design.instances.items() if isinstance(i.component, _Probe)}
        return replace(design, instances={**design.instances, **probes})


def _refused(name: str, why: str) -> InputError:
    return InputError(f"input {name}: this parameter {why}; name a number that acts inside the equations")


def parameter_places(system: System, design: Design) -> dict[str, tuple[int, Quantity]]:
    """Place in p and quantity of every numeric parameter, by the name that a circuit file gives it."""
    found: dict[str, tuple[int, Quantity]] = {}
    at = 0

    def add(owner: str, model: Any, names: Sequence[str]) -> None:
        nonlocal at
        for name in names:
            alias = type(model).model_fields[name].alias or name
            found[f"{owner}.{alias}"] = (at, quantity_of(model, name) or units.ratio)
            at += 1

    for owner, fluid in design.fluids.items():
        add(owner, fluid, numeric_fields(type(fluid), fluid))
    for owner, trace in system.plan.traces.items():
        add(owner, design.instances[owner].component, trace.parameters)
    return found
