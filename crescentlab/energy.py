"""Power through the ports of a component, and what its equations say of energy.

.. math:: P = \\rho_0 q\\, w(p), \\quad f v, \\quad T \\omega, \\quad \\pm p\\, \\frac{dV}{dt}

P [W] into the component, at a hydraulic, translational, rotational and chamber port; w [J/kg] = ``fluid.enthalpy``;
what shapes a chamber takes p dV/dt out of the fluid. On a net they sum to zero, as flows, forces and torques do.
Without a fluid a density is not known: P = p q, as of a fluid that cannot be compressed.

Source: H. M. Paynter, Analysis and Design of Engineering Systems (1961); for w, L. D. Landau, E. M. Lifshitz, Fluid
Mechanics, section 5, with one density at each pressure.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import Any

import casadi as ca

from crescentlab.component import Component, fluid_names
from crescentlab.domain import CHAMBER, ENERGY_ENTRIES, HYDRAULIC, ROTATIONAL, SIGNAL, TRANSLATIONAL, Observable, Port
from crescentlab.fluid import Fluid
from crescentlab.symbols import Sym, column


@functools.cache
def power_ports(cls: type[Component]) -> tuple[Port, ...]:
    """Ports through which power passes."""
    return tuple(p for p in cls.ports() if p.domain is not SIGNAL and p.role != "reads")


@functools.cache
def keeps_books(cls: type[Component]) -> bool:
    """Whether the class says what becomes of the power that enters."""
    return cls.lossless or any(o.entry in ENERGY_ENTRIES for o in cls.declared(Observable))


@functools.cache
def passes_fluid(cls: type[Component]) -> bool:
    """Whether what enters its hydraulic ports must leave by them: it keeps none, displaces none, is no boundary."""
    ports, entries = power_ports(cls), {o.entry for o in cls.declared(Observable)}
    moves = any(p.domain in (TRANSLATIONAL, CHAMBER) for p in ports)
    return sum(p.domain is HYDRAULIC for p in ports) > 1 and not moves and not entries & {"content", "supply"}


@functools.cache
def fluids_asked(cls: type[Component]) -> tuple[str, ...]:
    """The fluid arguments of a class's equations, in order."""
    asked = set(cls.asks_for())
    return tuple(n for n in fluid_names(cls) if n in asked)


@functools.cache
def fluids_needed(cls: type[Component]) -> tuple[str, ...]:
    """The fluid arguments of a class's equations, and those that only the power through its ports asks for."""
    asked = fluids_asked(cls)
    more = [fluid_argument(cls, p) for p in power_ports(cls) if p.domain is HYDRAULIC]
    return (*asked, *dict.fromkeys(name for name in more if name not in asked))


def fluid_ports(cls: type[Component], fluid: str) -> list[str]:
    """Hydraulic ports whose net decides the fluid argument ``fluid``."""
    hydraulic = [p.name for p in cls.ports() if p.domain is HYDRAULIC]
    return hydraulic if fluid == "fluid" else [fluid.removeprefix("fluid_")]


def fluid_argument(cls: type[Component], port: Port) -> str:
    """The fluid argument that a port's fluid has, whether equations ask for it or not."""
    own, asked = f"fluid_{port.name}", fluids_asked(cls)
    return "fluid" if "fluid" in asked and own not in asked else own


def powers(cls: type[Component], values: Mapping[str, Any], fluids: Mapping[str, Fluid]) -> ca.SX:
    """Power [W] into the component at every element of its ports, a column; ``values`` are the ports' variables."""
    return column([_power(port, values, fluids.get(fluid_argument(cls, port))).sx for port in power_ports(cls)])


def _power(port: Port, values: Mapping[str, Any], fluid: Fluid | None) -> Sym:
    def value(variable: str) -> Sym:
        return Sym.of(values[f"{variable}_{port.name}"])

    if port.domain is HYDRAULIC:
        p, q = value("p"), value("q")
        return p * q if fluid is None else fluid.rho_0 * q * fluid.enthalpy(p)
    if port.domain is CHAMBER:
        power = value("p") * value("dV")
        return power if port.role == "gives" else -power
    return value("torque") * value("omega") if port.domain is ROTATIONAL else value("f") * value("v")


def deduced(cls: type[Component], entering: ca.SX) -> dict[str, Any]:
    """What equations may leave out: the loss or the supply that takes up all the power that enters."""
    name = cls.deduced_observable()
    if name is None:
        return {}
    entry = next(o.entry for o in cls.declared(Observable) if o.name == name)
    return {name: Sym(ca.sum1(entering) if entry == "dissipation" else -ca.sum1(entering))}


def books(cls: type[Component], values: Mapping[str, Any], entering: ca.SX) -> ca.SX:
    """Energy stored [J], dissipation, supply, power that enters [W] and half the sum of its magnitudes; five rows.

    No rows for a class through which no power passes.
    """
    if not entering.numel():
        return ca.SX(0, 1)
    entries = [
        sum((Sym.of(values[o.name]).sx for o in cls.declared(Observable) if o.entry == entry), start=ca.SX(0))
        for entry in ENERGY_ENTRIES
    ]
    return column([*entries, ca.sum1(entering), ca.sum1(ca.fabs(entering)) / 2])
