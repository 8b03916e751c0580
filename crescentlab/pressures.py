"""The pressures of a circuit and their fluids: of states and held values, and what ports give besides."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import casadi as ca

from crescentlab import units
from crescentlab.causality import Plan
from crescentlab.component import field_quantity, snake_case
from crescentlab.domain import HYDRAULIC, Observable
from crescentlab.energy import fluid_argument, fluids_asked
from crescentlab.fluid import P_ATM
from crescentlab.symbols import column
from crescentlab.trace import numeric_fields
from crescentlab.units import Quantity

ROUNDING = 1e-9
"""Share of the atmospheric pressure by which a pressure may lie below absolute zero."""
SETTING = re.compile(r"(^|_)(pressure|preload)$")
"""Names of parameters that set a pressure, unlike drops, ranges and moduli."""
CAVITATES = (
    "the oil would cavitate: feed this part better, take a model that shows cavities in a fluid that evaporates (a "
    "capacity; of lines a distributed_line, or a transmission_line at its ends), or write tension: true in the fluid "
    "to go on"
)
"""What to do about a pressure below absolute zero."""
ASKED = (
    "no fluid has such a pressure, and 0 bar gauge is the atmosphere: ask for more, or write tension: true in the fluid"
)
"""The same where the pressure comes from outside the circuit."""


@dataclass(frozen=True)
class GivenPressure:
    """A pressure that a hydraulic port gives and that is neither a state nor a held value of a part with a fluid."""

    owner: str
    variable: str
    """Of the whole port: ``line.b.p``."""
    element: int | None
    """Which of a vector, from 0; None for a scalar."""
    fluid: str | None
    """The circuit's name of it; None where the circuit has no fluid."""
    expression: ca.SX
    moving: bool
    """Whether it changes during a run; a constant follows from parameters alone."""
    parameters: tuple[str, ...]
    """Names of the parameters that it depends on: of components, and of fluids."""
    outside: bool
    """Whether it comes from outside the circuit."""

    @property
    def name(self) -> str:
        """As messages call it: ``line.b.p``, ``line.b.p[2]``."""
        return self.variable + ("" if self.element is None else f"[{self.element + 1}]")

    @property
    def failure(self) -> str:
        """What a run says that ends with it at absolute zero; its value is to be filled in."""
        value = "{p}" if self.element is None else f"{{p[{self.element}]}}"
        return f"{self.name} is {value} gauge, below absolute zero; {ASKED if self.outside else CAVITATES}"


def own_pressures(plan: Plan, names: Sequence[str], quantities: Iterable[Quantity]) -> list[tuple[int, str]]:
    """Places, and fluids by the circuit's name, of states or held values that are pressures of a fluid."""
    found = []
    for k, (name, quantity) in enumerate(zip(names, quantities, strict=True)):
        if quantity is not units.pressure:
            continue
        owner = name.rpartition(".")[0]
        cls = type(plan.components[owner])
        asked = fluids_asked(cls)
        if asked and any(port.domain is HYDRAULIC for port in cls.ports()):
            found.append((k, plan.fluids[owner][asked[0]]))
    return found


def given_pressures(
    plan: Plan, pressures: Sequence[ca.SX], own: ca.SX, p: ca.SX, names: Sequence[str]
) -> tuple[GivenPressure, ...]:
    """What ports give on the hydraulic nets, ``pressures`` in the plan's order, beside the symbols ``own``.

    What depends on the parameters ``p``, called ``names``, alone is constant in a run.
    """
    nets = [net for net in plan.graph.nets if net.domain is HYDRAULIC]
    known = {symbol.element_hash() for symbol in ca.vertsplit(own)} if own.numel() else set()
    called = dict(zip([symbol.element_hash() for symbol in ca.vertsplit(p)], names, strict=True)) if names else {}
    found = []
    for net, pressure in zip(nets, pressures, strict=True):
        giver = plan.givers[net.name]
        if giver is None or pressure.element_hash() in known:
            continue
        free = [symbol.element_hash() for symbol in ca.symvar(pressure)]
        cls = type(plan.components[giver.instance])
        fluid = fluid_argument(cls, giver.port)
        found.append(
            GivenPressure(
                giver.instance, f"{giver.instance}.{giver.port.name}.p", giver.element if giver.vector else None,
                plan.fluids[giver.instance].get(fluid), pressure, any(each not in called for each in free),
                tuple(called[each] for each in free if each in called),
                any(each.entry == "supply" for each in cls.declared(Observable)),
            )
        )  # fmt: skip
    return tuple(found)


def fluid_number(plan: Plan, p: ca.SX, fluid: str | None, name: str) -> ca.SX:
    """A number of a fluid as an expression of the parameters ``p``, which begin with those of the fluids."""
    if fluid is None:
        return ca.SX({"atmospheric_pressure": P_ATM}.get(name, ca.inf))
    at = 0
    for each, law in plan.design.fluids.items():
        names = numeric_fields(type(law), law)
        if each == fluid:
            return p[at + names.index(name)]
        at += len(names)
    raise KeyError(fluid)


def absolute_zeros(plan: Plan, p: ca.SX, fluids: Iterable[str | None]) -> ca.SX:
    """Gauge pressures below which there is nothing, one for each of the fluids, with room for rounding."""
    return -(1 + ROUNDING) * column([fluid_number(plan, p, fluid, "atmospheric_pressure") for fluid in fluids])


def settings_too_high(plan: Plan) -> list[str]:
    """Settings of parts above the pressure up to which the law of a fluid in them is meant, in words."""
    warnings = []
    for name, component in plan.components.items():
        fluids = [plan.design.fluids[fluid] for fluid in plan.fluids[name].values()]
        if not fluids:
            continue
        law = max(fluids, key=lambda fluid: fluid.highest_pressure)
        for field, info in type(component).model_fields.items():
            value = getattr(component, field)
            if value is None or field_quantity(info) is not units.pressure or not SETTING.search(field):
                continue
            if value > law.highest_pressure:
                kind = snake_case(type(law).__name__)
                set_to, highest = (units.pressure.show(p, "bar") for p in (value, law.highest_pressure))
                warnings.append(
                    f"{name}.{field} is {set_to}, above {highest}, up to which the "
                    f"law of {kind} is meant; lower it, or write highest_pressure in the fluid if its law holds there"
                )
    return warnings
