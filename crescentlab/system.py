"""The global hybrid ODE of a circuit, as functions of one expression graph.

.. math:: \\dot x = f(t, x, h, b, p), \\qquad g(t, x, h, b, p) \\gtrless 0

x states, h held values, b frozen bits (one per relation), p parameters. The right-hand side, its
exact sparse Jacobian, the relations with their time derivatives, the events' conditions and the
remaps are CasADi functions; every other variable is an expression, made a function on demand.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import casadi as ca
import numpy as np

from crescentlab import units
from crescentlab.causality import Plan
from crescentlab.columns import Columns
from crescentlab.component import Component, field_quantity
from crescentlab.domain import Held, Scheduled, State
from crescentlab.elaborate import COMMAND, Design
from crescentlab.energy import keeps_books, power_ports
from crescentlab.errors import InputError, nearest
from crescentlab.prepared import LARGE, Prepared, jacobian, prepare, shared
from crescentlab.pressures import ASKED, GivenPressure, absolute_zeros, own_pressures
from crescentlab.schedule import Following
from crescentlab.symbols import column
from crescentlab.trace import numeric_fields, structure_of
from crescentlab.units import Quantity

Array = np.ndarray


@dataclass(frozen=True)
class Variable:
    """A named value of the system: its expression(s), quantity, and whether it is a vector."""

    name: str
    quantity: Quantity
    expression: Callable[[], list[ca.SX]]
    vector: bool
    listed: bool = True


@dataclass(frozen=True)
class SystemEvent:
    """An event of the whole system by its full name: ``driver.closes``."""

    name: str
    kind: str
    """``when``, ``every``, ``fail`` or ``stop``."""
    message: str = ""
    message_names: tuple[str, ...] = ()
    initial: bool = False
    """Whether it waits at the start until what it reads has been set."""


@dataclass(frozen=True)
class Bits:
    """What is known of the relations without numbers."""

    names: tuple[str, ...]
    strict: Array
    on_state: Array
    on_time: Array
    """Depends on t (and held values) but on no state."""
    linear: Array
    """Of those on time, the ones linear in t."""
    held_dependent: Array
    switches: Array
    """Chooses a value; the others serve conditions of events alone."""
    floors: Array
    """Holds a given pressure above absolute zero: sought where it turns, never throughout a step."""


@dataclass
class Values:
    """The numbers that go with a system: parameters, start values."""

    p: Array
    x0: Array
    h0: Array
    start_time: float = 0.0
    following: tuple[Following, ...] = ()
    """Held values that follow a schedule."""


@dataclass(eq=False)
class System:
    """The assembled circuit; see the module docstring. Made by :func:`assemble`."""

    plan: Plan
    output_parameters: tuple[tuple[str, str], ...]
    """Scope and name of the circuit parameters that stand at the end of p."""
    t: ca.SX
    x: ca.SX
    h: ca.SX
    b: ca.SX
    p: ca.SX
    f: ca.SX
    relations: ca.SX
    scales: ca.SX
    conditions: ca.SX
    periods: ca.SX
    clock: ca.SX
    events: tuple[SystemEvent, ...]
    state_names: list[str]
    state_quantities: list[Quantity]
    nominal: Array
    held_names: list[str]
    held_quantities: list[Quantity]
    counting_states: Array
    """Shape (n,): the states that go on for ever, of which only differences matter."""
    counting_held: Array
    """Shape (k,): such held values."""
    bits: Bits
    given: tuple[GivenPressure, ...]
    """Pressures that ports give and that are neither states nor held values."""
    _variables: Callable[[], dict[str, Variable]]
    remapping: Callable[[list[bool]], tuple[ca.SX, list[ca.SX]]]
    """Which events may fire -> symbols (1 where one fires), and the new x and h as expressions of them."""
    reading: Callable[[Sequence[int]], Array]
    """Events -> which of them reads what the component of which other one sets, shape (m, m)."""
    _contents: dict[str, tuple[Callable[[], ca.SX], Callable[[], tuple[ca.SX, ca.SX]]]]
    _energies: Callable[[], dict[str, ca.SX]]
    _passing: Callable[[], dict[str, tuple[ca.SX, ca.SX]]]
    outputs_by_part: Callable[[], list[tuple[str, ca.SX]]]
    """What each component gives at its ports, in the order in which it is evaluated."""
    _once: dict[Any, Any] = field(default_factory=dict)
    built: dict[tuple[str, str], Prepared] = field(default_factory=dict)
    """Functions that have been compiled, by name and form (see :mod:`crescentlab.solvers.promotion`)."""

    @property
    def arguments(self) -> list[ca.SX]:
        """Symbols every function of the system takes, in order."""
        return [self.t, self.x, self.h, self.b, self.p]

    @functools.cached_property
    def variables(self) -> dict[str, Variable]:
        """Every name a result knows."""
        return self._variables()

    @functools.cached_property
    def rhs(self) -> Prepared:
        """f(t, x, h, b), shape (n,)."""
        return prepare("f", self.arguments[:-1], self.p, [self.f])

    @functools.cached_property
    def jacobian_expression(self) -> ca.SX:
        """df/dx, sparse (n, n)."""
        return jacobian(self.f, self.x)

    @functools.cached_property
    def jacobian(self) -> Prepared:
        """Nonzeros of df/dx in column order."""
        return prepare("dfdx", self.arguments[:-1], self.p, [self.jacobian_expression.nz[:]], seldom=True)

    @functools.cached_property
    def linear(self) -> Prepared:
        """f, the nonzeros of df/dx in column order, and df/dt, together: they share most of their parts."""
        outputs = [self.f, self.jacobian_expression.nz[:], ca.densify(ca.jacobian(self.f, self.t))]
        return prepare("linear", self.arguments[:-1], self.p, outputs)

    @functools.cached_property
    def relation(self) -> Prepared:
        """(t, x, h, b, dx/dt) -> relations g, their time derivatives, and the magnitude of their sides."""
        return self._relations(list(range(self.relations.numel())))

    @functools.cached_property
    def relation_on_state(self) -> Prepared:
        """As :attr:`relation`, only those that depend on states: the ones to be watched at every step."""
        return self._relations(np.flatnonzero(self.bits.on_state).tolist())

    def _relations(self, rows: list[int]) -> Prepared:
        g, scales, rate_x = self.relations[rows], self.scales[rows], ca.SX.sym("v", self.x.numel())
        rate = ca.jtimes(g, self.x, rate_x) + ca.jacobian(g, self.t) if rows else ca.SX(0, 1)
        return prepare("g", [*self.arguments[:-1], rate_x], self.p, [g, rate, scales])

    @functools.cached_property
    def condition(self) -> Prepared:
        """Conditions of the events that have one, 0 or 1."""
        return prepare("cond", self.arguments[:-1], self.p, [self.conditions])

    @functools.cached_property
    def remap(self) -> Prepared:
        """(t, x, h, b, fired) -> new (x, h)."""
        return self._remapped([True] * len(self.events))

    @functools.cached_property
    def remap_ticks(self) -> Prepared:
        """:attr:`remap` when nothing but ticks fires."""
        return self._remapped([event.kind == "every" for event in self.events])

    @functools.cached_property
    def remap_events(self) -> Prepared:
        """:attr:`remap` when no tick fires."""
        return self._remapped([event.kind != "every" for event in self.events])

    def _remapped(self, may_fire: list[bool]) -> Prepared:
        fired, outputs = self.remapping(may_fire)
        return prepare("remap", [*self.arguments[:-1], fired], self.p, outputs)

    @functools.cached_property
    def events_on_states(self) -> Array:
        """Which events have a condition that a relation on states is part of, shape (events,)."""
        found = np.zeros(len(self.events), bool)
        rising = [k for k, event in enumerate(self.events) if event.kind != "every"]
        watched = np.flatnonzero(self.bits.on_state).tolist()
        if rising and watched:
            found[rising] = ca.which_depends(self.conditions, self.b[watched], 1, True)
        return found

    @functools.cached_property
    def period(self) -> ca.Function:
        """Periods of the ticks, from p alone."""
        return ca.Function("period", [self.p], [ca.densify(self.periods)])

    def once(self, key: str, make: Callable[[], Any]) -> Any:
        """What ``make`` returns the first time: things that depend on the structure alone, kept from run to run."""
        if key not in self._once:
            self._once[key] = make()
        return self._once[key]

    def find(self, name: str) -> Variable:
        """The variable called ``name``; raises :class:`InputError` offering the nearest."""
        if name in self.variables:
            return self.variables[name]
        raise InputError(f"no variable {name!r}: {nearest(name, self.variables)}")

    def series(self, names: Sequence[str], t: Array, x: Array, h: Array, b: Array, p: Array) -> Array:
        """The named variables' elements one after another at times (m,), states (m, n) and so on: (elements, m)."""
        key = ("series", *names)
        if key not in self._once:
            elements = [e for name in names for e in self.find(name).expression()]
            whole = shared(ca.densify(column(elements)), LARGE)
            self._once[key] = Columns(prepare("series", self.arguments[:-1], self.p, [whole], seldom=True))
        found: list[Array] = self._once[key]((t.reshape(1, -1), x.T, h.T, b.T), p)
        return found[0]

    def contents(self) -> dict[str, tuple[ca.SX, ca.SX, ca.SX]]:
        """Per storing component: stored volume, sum of its flows, half the sum of their magnitudes."""
        return {name: (content(), *flows()) for name, (content, flows) in self._contents.items()}

    def passing(self) -> dict[str, tuple[ca.SX, ca.SX]]:
        """Per component that must pass what enters: sum of its flows, half the sum of their magnitudes."""
        return self._passing()

    def energies(self) -> dict[str, ca.SX]:
        """Per component through which power passes, the five rows of :func:`crescentlab.energy.books`."""
        return self._energies()

    def silent(self) -> list[str]:
        """Components through which power passes and which do not say what becomes of it."""
        classes = {name: type(component) for name, component in self.plan.components.items()}
        return [name for name, cls in classes.items() if power_ports(cls) and not keeps_books(cls)]

    def values(self, design: Design) -> Values:
        """Numbers for this structure; raises if ``design`` has another structure."""
        p: list[float] = []
        fluids = design.fluids
        for fluid in fluids.values():
            p += [float(getattr(fluid, n)) for n in numeric_fields(type(fluid), fluid)]
        x0: list[Array] = []
        h0: list[Array] = []
        following: list[Following] = []
        for name, shape in self.plan.components.items():
            instance = design.instances[name]
            component = instance.component
            if type(shape) is not type(component):
                component = type(shape).model_construct(
                    **{n: getattr(component, n) for n in type(component).model_fields}
                )
            if structure_of(component) != structure_of(shape):
                raise InputError(f"{name}: this value changes the structure; assemble the circuit anew", instance.place)
            p += [float(getattr(component, n)) for n in self.plan.traces[name].parameters]
            mine = [fluids[f] for f in self.plan.fluids[name].values()]
            x0 += [
                _start(instance.start, s, component, mine, name, instance.place)
                for s in type(component).declared(State)
            ]
            for s in type(component).declared(Held):
                at = sum(a.size for a in h0)
                h0.append(_start(instance.start, s, component, mine, name, instance.place))
                if isinstance(s, Scheduled):
                    following.append(Following(slice(at, at + h0[-1].size), getattr(component, s.by)))
        p += [float(design.parameters[scope][name].value) for scope, name in self.output_parameters]
        values = Values(np.array(p), _join(x0), _join(h0), following=tuple(following))
        for each in following:
            schedule = each.schedule(values.start_time, values.start_time)
            values.h0[each.places] = schedule.rows[schedule.at(values.start_time)]
        self.check_constants(values, design)
        ticks = [event.name for event in self.events if event.kind == "every"]
        for tick, period in zip(ticks, np.array(self.period(values.p)).ravel() if ticks else (), strict=True):
            if not period > 0:
                place = design.instances[tick.rpartition(".")[0]].place
                raise InputError(f"{tick}: its period is {period:g} s; it must be above 0", place)
        return values

    def check_constants(self, values: Values, design: Design) -> None:
        """Raise :class:`InputError` if a start, or a pressure that parameters alone give, lies below absolute zero."""
        fluids = self.plan.design.fluids
        constant = [each for each in self.given if not each.moving]
        starts = [
            (names[k], fluid, start[k])
            for names, quantities, start in (
                (self.state_names, self.state_quantities, values.x0), (self.held_names, self.held_quantities, values.h0)
            )
            for k, fluid in own_pressures(self.plan, names, quantities)
        ]  # fmt: skip

        def made() -> ca.Function:
            lowest = absolute_zeros(self.plan, self.p, (*fluids, None))
            return ca.Function("constants", [self.p], [column([each.expression for each in constant]), lowest])

        pressures, lowest = (np.array(each).ravel() for each in self.once("constant pressures", made)(values.p))
        floors = dict(zip((*fluids, None), lowest.tolist(), strict=True))
        floors |= {name: -np.inf for name, fluid in fluids.items() if fluid.tension}
        for each, p in zip(constant, pressures.tolist(), strict=True):
            if p < floors[each.fluid]:
                raise self.impossible(design, each.owner, each.name, each.parameters, p, floors[each.fluid])
        for full, fluid, p in starts:
            if p < floors[fluid]:
                owner, _, name = full.rpartition(".")
                name = name.partition("[")[0]
                fields = type(self.plan.components[owner]).model_fields
                given = [
                    n for n, info in fields.items() if n.startswith("start") and field_quantity(info) is units.pressure
                ]
                raise self.impossible(
                    design, owner, f"{owner}.start.{name}", (f"start.{name}", *given), p, floors[fluid]
                )

    @staticmethod
    def impossible(
        design: Design, owner: str, name: str, fields: Sequence[str], p: float, floor: float
    ) -> InputError:  # fmt: skip
        """What is said of a pressure below absolute zero, where the first of the part's ``fields`` was written."""
        instance = design.instances[owner]
        field = next((n for n in fields if n in instance.places), None)
        name = name if field is None else f"{owner}.{field}"
        place = instance.place if field is None else instance.places[field]
        if place is COMMAND:
            name, place = f"--set {name}", None
        show = units.pressure.show
        return InputError(
            f"{name}: {show(p, 'bar')} gauge is below absolute zero ({show(floor, 'bar')}); {ASKED}", place
        )


def _start(
    given: dict[str, Array], declared: State | Held, component: Component, fluids: list[Any], name: str, place: Any
) -> Array:
    try:
        default = component.start_of(declared, fluids[0] if fluids else None)
    except Exception as error:  # the author's slip
        said = f"{name}: no start value for {declared.name} ({type(error).__name__}: {error})"
        raise InputError(f"{said}; write one, for example start: {{{declared.name}: ...}}", place) from error
    if declared.name not in given:
        return default
    value = given[declared.name]
    if value.size not in (1, default.size):
        said = f"{name}: start of {declared.name} has {value.size} values for {default.size}"
        raise InputError(f"{said}; write one for all, or one for each", place)
    return np.broadcast_to(value, default.shape)


def _join(arrays: list[Array]) -> Array:
    return np.concatenate(arrays) if arrays else np.zeros(0)
