"""Plan -> :class:`System`: every trace called on the global symbols, in the plan's order.

Components that share a trace are evaluated together: CasADi maps the traced function over one column per component
in a loop of its own, some thirty times faster than as many calls from Python.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import casadi as ca
import numpy as np

from crescentlab.causality import Plan
from crescentlab.component import Component
from crescentlab.domain import HYDRAULIC, SIGNAL, Held, Observable, State
from crescentlab.elaborate import Output
from crescentlab.energy import passes_fluid
from crescentlab.errors import ExpressionError, InputError, nearest
from crescentlab.expressions import Value, evaluate
from crescentlab.prepared import shared
from crescentlab.pressures import GivenPressure, absolute_zeros, given_pressures, own_pressures
from crescentlab.symbols import Condition, Relation, Sym, column
from crescentlab.system import Bits, System, SystemEvent, Variable
from crescentlab.time_alone import NAME as TIME_ALONE
from crescentlab.time_alone import TimeAlone, time_alone
from crescentlab.trace import Layout, Trace, numeric_fields
from crescentlab.units import Quantity

Array = np.ndarray

INPUTS = 4
"""Place of the port inputs among the arguments of a trace's functions."""


def assemble(plan: Plan) -> System:
    """Make the global ODE of a plan."""
    return _Assembly(plan).done()


class _Assembly:
    """Global vectors of symbols and values; which part of them belongs to a component says a :class:`Layout`."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.alike = _alike(plan.traces)
        self.first = {name: first for first, names in self.alike.items() for name in names}
        self.states = self.layout(lambda tr: tr.states.size)
        self.held = self.layout(lambda tr: tr.held.size)
        self.bits_of = self.layout(lambda tr: len(tr.relations))
        self.input_of = self.layout(lambda tr: tr.inputs.size)
        self.output_of = self.layout(lambda tr: tr.outputs.size)
        fluids = [(name, len(numeric_fields(type(f), f))) for name, f in plan.design.fluids.items()]
        self.fluids = Layout(tuple(fluids))
        self.parameters = self.layout(lambda tr: len(tr.parameters))
        self.t = ca.SX.sym("t")
        self.x = ca.SX.sym("x", self.states.size)
        self.h = ca.SX.sym("h", self.held.size)
        self.b = ca.SX.sym("b", self.bits_of.size)
        self.p = ca.SX.sym("p", self.fluids.size + self.parameters.size)
        self.own_p = self.p[self.fluids.size :]
        self.inputs = ca.SX.zeros(self.input_of.size)
        self.outputs = ca.SX.zeros(self.output_of.size)
        sources = [source for name in plan.traces for source in plan.sources[name]]
        self.origins = [[self.output_of.offsets[name][0] + k for name, k in source.outputs] for source in sources]
        """Places of the port outputs whose sum is a port input."""
        self.negative = [source.sign < 0 for source in sources]
        self.observed: dict[str, ca.SX] = {}
        self.known: dict[str, Variable] | None = None
        self.resolved: set[str] = set()
        self.running: list[str] = []
        self.pending: dict[str, Output] = {}
        self.used: dict[tuple[str, str], ca.SX] = {}
        """Circuit parameters that outputs refer to; they follow the components' in p."""

    def layout(self, size: Callable[[Trace], int]) -> Layout:
        """How the components share a global vector, in the plan's order."""
        sizes = {first: size(self.plan.traces[first]) for first in self.alike}
        return Layout(tuple((name, sizes[self.first[name]]) for name in self.plan.traces))

    def call(
        self, function: ca.Function, names: Sequence[str], x: ca.SX | None = None, h: ca.SX | None = None
    ) -> ca.SX:
        """A function of the trace that these components share: its results side by side, some columns for each."""
        fluids = [fluid for name in names for fluid in self.plan.fluids[name].values()]
        parts = (
            (self.x if x is None else x, self.states.places(names)),
            (self.h if h is None else h, self.held.places(names)),
            (self.b, self.bits_of.places(names)),
            (self.inputs, self.input_of.places(names)),
            (self.own_p, self.parameters.places(names)),
            (self.p, self.fluids.places(fluids)),
        )
        n = len(names)
        columns = [ca.reshape(vector.nz[places], len(places) // n, n) for vector, places in parts]
        return function.map(n)(self.t, *columns)

    def every(self, function_of: Callable[[Trace], ca.Function]) -> ca.SX:
        """The results of one function of every component, one component after another."""
        layout = self.layout(lambda trace: function_of(trace).numel_out(0))
        result = ca.SX.zeros(layout.size)
        for first, names in self.alike.items():
            function = function_of(self.plan.traces[first])
            if function.numel_out(0):
                result.nz[layout.places(names)] = ca.vec(self.call(function, names))
        return result

    def connect(self, inputs: list[int]) -> None:
        """Give the port inputs at these places their values, the outputs that they come from being known."""
        total = ca.SX.zeros(len(inputs))
        rows = list(range(len(inputs)))
        term = 0
        while rows := [row for row in rows if len(self.origins[inputs[row]]) > term]:
            terms = self.outputs.nz[[self.origins[inputs[row]][term] for row in rows]]
            total.nz[rows] = total.nz[rows] + terms if term else terms
            term += 1
        if negative := [row for row, place in enumerate(inputs) if self.negative[place]]:
            total.nz[negative] = -total.nz[negative]
        self.inputs.nz[inputs] = total

    def flow(self) -> None:
        """Evaluate all port outputs and inputs, wave by wave."""
        traces = self.plan.traces
        for wave in self.plan.order:
            together: dict[tuple[str, int], list[str]] = {}
            for step in wave:
                together.setdefault((self.first[step.instance], step.group), []).append(step.instance)
            for (first, number), names in together.items():
                group = traces[first].groups[number]
                self.connect(self.input_of.places(names, group.inputs))
                results = self.call(group.function, names)
                self.outputs.nz[self.output_of.places(names, group.outputs)] = ca.vec(results)
        self.connect(list(range(self.input_of.size)))

    def done(self) -> System:
        self.flow()
        derivative = self.every(lambda trace: trace.derivative)
        relations, scales = self.relations()
        events, conditions, periods = self.events()
        derivative, timed = self.stops(derivative, relations, conditions)
        if self.plan.design.outputs:
            self.variables()  # a wrong output is told before the run
        extra = self.stop(events, conditions, relations, scales)
        state_names, state_quantities = self.names(State)
        held_names, held_quantities = self.names(Held)
        given = self.given(
            own_pressures(self.plan, state_names, state_quantities),
            own_pressures(self.plan, held_names, held_quantities),
        )
        floors = self.floors(given, events, conditions, relations, scales)
        relations += timed.relations
        scales += timed.scales
        b = ca.vertcat(self.b, extra, floors, *timed.bits)
        together = shared(ca.densify(column([derivative, *relations])))
        f, g = ca.vertsplit(together, [0, derivative.numel(), together.numel()])
        return System(
            plan=self.plan,
            output_parameters=tuple(self.used),
            t=self.t,
            x=self.x,
            h=self.h,
            b=b,
            p=column([self.p, *self.used.values()]),
            f=f,
            relations=g,
            scales=column(scales),
            conditions=column(conditions),
            periods=periods,
            clock=timed.clock,
            events=tuple(events),
            state_names=state_names,
            state_quantities=state_quantities,
            nominal=self.nominal(),
            held_names=held_names,
            held_quantities=held_quantities,
            counting_states=self.counting(State),
            counting_held=self.counting(Held),
            bits=self.bits(g, b, floors.numel(), timed),
            given=given,
            _variables=self.variables,
            remapping=self.remap,
            reading=self.reading,
            _contents=self.contents(),
            _energies=self.energies,
            outputs_by_part=self.outputs_by_part,
            _passing=lambda: {n: self.flows(n) for n, c in self.plan.components.items() if passes_fluid(type(c))},
        )

    def names(self, kind: type[State] | type[Held]) -> tuple[list[str], list[Quantity]]:
        names: list[str] = []
        quantities: list[Quantity] = []
        for name, component in self.plan.components.items():
            for declared in type(component).declared(kind):
                n = component.size_of(declared.size)
                names += (
                    [f"{name}.{declared.name}"] if n is None else [f"{name}.{declared.name}[{k + 1}]" for k in range(n)]
                )
                quantities += [component.quantity(declared.quantity)] * (1 if n is None else n)
        return names, quantities

    def counting(self, kind: type[State] | type[Held]) -> Array:
        found: list[bool] = []
        for component in self.plan.components.values():
            for declared in type(component).declared(kind):
                n = component.size_of(declared.size)
                found += [declared.counts] * (1 if n is None else n)
        return np.array(found, dtype=bool)

    def nominal(self) -> Array:
        found: list[float] = []
        for component in self.plan.components.values():
            for declared in type(component).declared(State):
                n = component.size_of(declared.size)
                usual = component.quantity(declared.quantity).nominal
                found += [declared.nominal if declared.nominal is not None else usual] * (1 if n is None else n)
        return np.array(found)

    # -- events ----------------------------------------------------------------------------------

    def relations(self) -> tuple[list[ca.SX], list[ca.SX]]:
        both = self.every(lambda trace: trace.relation)  # of each component all differences, then all magnitudes
        halves = self.layout(lambda trace: 2 * len(trace.relations))
        first = [k for name, trace in self.plan.traces.items() for k in halves.indices(name)[: len(trace.relations)]]
        second = [k for name, trace in self.plan.traces.items() for k in halves.indices(name)[len(trace.relations) :]]
        return [both.nz[first]], [both.nz[second]]

    def events(self) -> tuple[list[SystemEvent], list[ca.SX], ca.SX]:
        events = [
            SystemEvent(
                f"{name}.{event.name}",
                event.kind,
                f"{name}: {event.message}" if event.message else "",
                tuple(f"{name}.{n}" for n in event.message_names),
                event.initial,
            )
            for name, trace in self.plan.traces.items()
            for event in trace.events
        ]
        conditions = self.every(lambda trace: trace.condition)
        return events, [conditions], self.every(lambda trace: trace.period)

    def stop(
        self, events: list[SystemEvent], conditions: list[ca.SX], relations: list[ca.SX], scales: list[ca.SX]
    ) -> ca.SX:
        """Append the relations of ``stop_when``; return their bits."""
        netlist = self.plan.design.netlist
        text = netlist.sections.simulation.stop_when
        if text is None:
            return ca.SX(0, 1)
        place = netlist.place("simulation", "stop_when")
        found: list[tuple[Relation, ca.SX]] = []

        def bit(relation: Relation) -> ca.SX:
            found.append((relation, ca.SX.sym(f"stop{len(found)}")))
            return found[-1][1]

        try:
            value = evaluate(text, self.lookup(self.variables(), ""))
            if not isinstance(value.value, Condition):
                raise ExpressionError(
                    f"{text!r} is no condition on the circuit's variables; write for example line.p > 9 bar"
                )
        except InputError as error:
            raise error.at(place) from None
        conditions.append(value.value.lower(bit))
        events.append(SystemEvent("stop_when", "stop", text))
        for relation, _ in found:
            sides = (relation.lhs, relation.rhs) if relation.operator[0] == ">" else (relation.rhs, relation.lhs)
            relations.append((sides[0] - sides[1]).sx)
            scales.append((abs(relation.lhs) + abs(relation.rhs)).sx)
        self.stop_strict = ["=" not in r.operator for r, _ in found]
        return column([symbol for _, symbol in found])

    def stops(self, derivative: ca.SX, relations: list[ca.SX], conditions: list[ca.SX]) -> tuple[ca.SX, TimeAlone]:
        """Put bits in place of the conditions on time in all that has been assembled; the derivative with them."""
        parts = [self.outputs, self.inputs, derivative, *relations, *conditions]
        ends = np.cumsum([0, *(part.numel() for part in parts)]).tolist()
        timed = time_alone(ca.densify(column(parts)), self.t, self.x, ca.vertcat(self.h, self.b), ends[3])
        if timed.bits:
            places = itertools.pairwise(ends)
            self.outputs, self.inputs, derivative, *rest = (timed.expression[low:high] for low, high in places)
            relations[:], conditions[:] = rest[: len(relations)], rest[len(relations) :]
        return derivative, timed

    def given(self, *own: list[tuple[int, str]]) -> tuple[GivenPressure, ...]:
        """Pressures that ports give and that are none of the ``own`` ones of states and held values."""
        nets = [net for net in self.plan.graph.nets if net.domain is HYDRAULIC]
        pressures = [p for net in nets for p in self.across([self.plan.givers[net.name]], 0)]
        symbols = [vector[k] for vector, found in zip((self.x, self.h), own, strict=True) for k, _ in found]
        names = [n for fluid in self.plan.design.fluids.values() for n in numeric_fields(type(fluid), fluid)]
        names += [name for trace in self.plan.traces.values() for name in trace.parameters]
        return given_pressures(self.plan, pressures, column(symbols), self.p, names)

    def floors(
        self, given: Sequence[GivenPressure], events: list[SystemEvent], conditions: list[ca.SX],
        relations: list[ca.SX], scales: list[ca.SX],
    ) -> ca.SX:  # fmt: skip
        """Append what ends the run where a given pressure passes absolute zero; return the bits of its relations."""
        fluids = self.plan.design.fluids
        kept = [each for each in given if each.moving and not (each.fluid and fluids[each.fluid].tension)]
        if not kept:
            return ca.SX(0, 1)
        pressures = column([each.expression for each in kept])
        lowest = absolute_zeros(self.plan, self.p, [each.fluid for each in kept])
        bits = ca.SX.sym("floor", len(kept))
        relations.append(pressures - lowest)
        scales.append(ca.fabs(pressures) - lowest)
        conditions.append(1 - bits)
        events += [
            SystemEvent(f"{each.owner}.absolute_zero_{k + 1}", "fail", each.failure, (each.variable,))
            for k, each in enumerate(kept)
        ]
        return bits

    def bits(self, g: ca.SX, b: ca.SX, floors: int, on_time: TimeAlone) -> Bits:
        n = g.numel()
        names = [f"{name}: {info.text}" for name, tr in self.plan.traces.items() for info in tr.relations]
        strict = [info.strict for tr in self.plan.traces.values() for info in tr.relations]
        extra = getattr(self, "stop_strict", [])
        names += ["stop_when"] * len(extra)
        names += [f"absolute zero {k + 1}" for k in range(floors)]
        names += [TIME_ALONE] * len(on_time.bits)
        strict += extra + [False] * floors + on_time.strict
        switches = [info.switches for tr in self.plan.traces.values() for info in tr.relations]
        first = len(switches) + len(extra)
        switches += [False] * (len(extra) + floors + len(on_time.bits))
        on_state = _depends(g, self.x) if n else np.zeros(0, bool)
        timed = (_depends(g, self.t) if n else np.zeros(0, bool)) & ~on_state
        curved = np.array(ca.which_depends(g, self.t, 2, True), bool) if n and timed.any() else np.zeros(n, bool)
        curved[n - len(on_time.bits) :] = ~np.array(on_time.straight, bool)
        held = _depends(g, ca.vertcat(self.h, b)) if n else np.zeros(0, bool)
        floor = np.isin(np.arange(n), range(first, first + floors))
        stepwise = floor & timed & curved & held  # sought in every step; a scan ahead would be due at every tick
        on_state, timed, curved = on_state | stepwise, timed & ~stepwise, curved & ~stepwise
        return Bits(
            tuple(names), np.array(strict, bool), on_state, timed, timed & ~curved, held, np.array(switches, bool),
            floor,
        )  # fmt: skip

    def remap(self, may_fire: list[bool]) -> tuple[ca.SX, list[ca.SX]]:
        """Flags of fired events, and the states and held values after them; composed in the order written.

        Events that cannot fire are left out.
        """
        flags = self.layout(lambda trace: len(trace.events))
        fired = ca.SX.sym("fired", len(may_fire))
        x, h = ca.SX(self.x), ca.SX(self.h)
        for first, names in self.alike.items():
            trace = self.plan.traces[first]
            own_x, own_h = self.states.places(names), self.held.places(names)
            for k, event in enumerate(trace.events):
                at = flags.places(names, [k])
                if event.remap is None or not own_x + own_h or not may_fire[at[0]]:
                    continue
                after = self.call(event.remap, names, x, h)
                now = ca.vertcat(*(ca.reshape(v.nz[own], -1, len(names)) for v, own in ((x, own_x), (h, own_h))))
                flag = ca.repmat(ca.reshape(fired.nz[at], 1, -1), now.shape[0], 1)
                new_x, new_h = ca.vertsplit(ca.if_else(flag, after, now), [0, trace.states.size, now.shape[0]])
                x.nz[own_x], h.nz[own_h] = ca.vec(new_x), ca.vec(new_h)
        return fired, [x, h]

    def reading(self, events: Sequence[int]) -> Array:
        """Which initial event of these reads through its ports what the component of which other one sets; (m, m)."""
        owners = [(name, event) for name, trace in self.plan.traces.items() for event in trace.events]
        chosen = [owners[k] for k in events if k < len(owners)]
        sets: dict[int, list[int]] = {}
        for j, (name, _) in enumerate(chosen):
            own_x, own_h = self.states.indices(name), self.held.indices(name)
            for place in [*own_x, *(self.x.numel() + k for k in own_h)]:
                sets.setdefault(place, []).append(j)
        found = np.zeros((len(events), len(events)), bool)
        known = ca.vertcat(self.x, self.h)
        for i, (name, event) in enumerate(chosen):
            if event.remap is None or not event.initial:
                continue
            asked = sorted(set(event.remap.jac_sparsity(0, INPUTS).get_triplet()[1]))
            own = self.input_of.indices(name)
            inputs = self.inputs.nz[[own[k] for k in asked]]
            for place in set(ca.jacobian_sparsity(inputs, known).get_triplet()[1]) if asked else ():
                found[i, [j for j in sets.get(place, []) if chosen[j][0] != name]] = True
        return found

    # -- variables -------------------------------------------------------------------------------

    def variables(self) -> dict[str, Variable]:
        """Every name a result knows, found once."""
        if self.known is None:
            self.known = self.find_variables()
        return self.known

    def find_variables(self) -> dict[str, Variable]:
        """States, held values, observables, port variables, nets and outputs."""
        found: dict[str, Variable] = {}
        for name, component in self.plan.components.items():
            for variable in self.of_component(name, component, self.plan.traces[name]):
                found[variable.name] = variable
        for variable in self.of_nets():
            found.setdefault(variable.name, variable)
        self.pending = {output.name: output for output in self.plan.design.outputs}
        for output in self.plan.design.outputs:
            if output.name in found and output.name not in self.resolved:
                raise InputError(
                    f"output {output.name!r} has the name of an existing variable; rename it", output.place
                )
            self.resolve(output, found)
        return found

    def of_component(self, name: str, component: Component, trace: Trace) -> Iterator[Variable]:
        cls = type(component)
        for kind, layout, vector, whole in (
            (State, trace.states, self.x, self.states), (Held, trace.held, self.h, self.held)
        ):  # fmt: skip
            for declared in cls.declared(kind):
                yield _variable(
                    f"{name}.{declared.name}",
                    component.quantity(declared.quantity),
                    layout,
                    declared.name,
                    functools.partial(_part, vector, whole, name),
                )
        for declared in cls.declared(Observable):
            yield _variable(
                f"{name}.{declared.name}", component.quantity(declared.quantity), trace.observables, declared.name,
                functools.partial(self.observe, name),
            )  # fmt: skip
        for port in cls.ports():
            for layout, values, pairs in (
                (trace.outputs, functools.partial(_part, self.outputs, self.output_of, name), port.outputs()),
                (trace.inputs, functools.partial(_part, self.inputs, self.input_of, name), port.inputs()),
            ):
                for variable, quantity in pairs:
                    shown = (
                        f"{name}.{port.name}"
                        if port.domain is SIGNAL
                        else f"{name}.{port.name}.{variable.removesuffix('_' + port.name)}"
                    )
                    yield _variable(shown, component.quantity(quantity), layout, variable, values)

    def observe(self, name: str) -> ca.SX:
        """A component's observables, found together with those of all components alike."""
        if name not in self.observed:
            names = self.alike[self.first[name]]
            results = self.call(self.plan.traces[name].observable, names)
            self.observed.update(zip(names, ca.horzsplit(results), strict=True))
        return self.observed[name]

    def of_nets(self) -> Iterator[Variable]:
        """Across variables by net name and by the net's names inside subcircuits."""
        groups: dict[str, list[Any]] = {}
        for net in self.plan.graph.nets:
            groups.setdefault(net.source.name, []).append(net)
        for name, nets in groups.items():
            source = nets[0].source
            pairs = [("value", None)] if nets[0].domain is SIGNAL else list(nets[0].domain.across)
            for k, (variable, quantity) in enumerate(pairs):
                givers = [g for net in nets if (g := self.plan.givers.get(net.name)) is not None]
                if len(givers) < len(nets):
                    continue
                expressions = functools.partial(self.across, givers, k)
                shown = quantity if quantity is not None else self.plan.graph.quantity(givers[0])
                vector = nets[0].name != source.name
                for alias in [name, *source.aliases]:
                    yield Variable(f"{alias}.{variable}", shown, expressions, vector, listed=alias == name)

    def across(self, givers: list[Any], k: int) -> list[ca.SX]:
        found: list[ca.SX] = []
        for giver in givers:
            port = type(self.plan.components[giver.instance]).port_named(giver.port.name)
            layout = self.plan.traces[giver.instance].outputs
            place = layout.offsets[port.outputs()[k][0]][0] + giver.element
            found.append(self.outputs[self.output_of.offsets[giver.instance][0] + place])
        return found

    def lookup(self, variables: dict[str, Variable], scope: str) -> Callable[[str], Value]:
        """Names in expressions: parameters of the scope, then variables seen from it."""
        parameters = self.plan.design.parameters.get(scope, {})

        def find(name: str) -> Value:
            if name in parameters:
                return self.parameter(scope, name, parameters[name])
            if scope + name in self.pending:
                self.resolve(self.pending[scope + name], variables)
            variable = variables.get(scope + name)
            if variable is None:
                known = [v.removeprefix(scope) for v in variables if v.startswith(scope)]
                raise ExpressionError(f"unknown name {name!r}: {nearest(name, [*known, *parameters])}")
            parts = variable.expression()
            return Value(Sym(column(parts), (len(parts),)) if variable.vector else Sym(parts[0]), variable.quantity)

        return find

    def parameter(self, scope: str, name: str, value: Value) -> Value:
        """A circuit parameter inside an output: a symbol, so that a changed value needs no new assembly."""
        if isinstance(value.value, str):
            return value
        if (scope, name) not in self.used:
            self.used[scope, name] = ca.SX.sym(f"{scope}{name}")
        return Value(Sym(self.used[scope, name]), value.quantity)

    def resolve(self, output: Output, variables: dict[str, Variable]) -> None:
        """Make an output's variable, after those of the outputs it uses."""
        if output.name in self.resolved:
            return
        if output.name in self.running:
            raise ExpressionError(f"output {output.name!r} depends on itself", output.place)
        self.running.append(output.name)
        try:
            made = evaluate(output.text, self.lookup(variables, output.scope))
            if isinstance(made.value, str):
                raise ExpressionError(f"this is the word {made.value!r}; an output is a number")
        except InputError as error:
            if error.place is None:
                error.message = f"output {output.name!r}: {error.message}"
            raise error.at(output.place) from None
        self.running.pop()
        self.resolved.add(output.name)
        symbol = Sym.of(made.value)
        elements = ca.vertsplit(symbol.sx) if symbol.shape != (0,) else []
        variables[output.name] = Variable(output.name, made.quantity, lambda: elements, symbol.shape != ())

    def contents(self) -> dict[str, tuple[Callable[[], ca.SX], Callable[[], tuple[ca.SX, ca.SX]]]]:
        """Per storing component: its stored volume, and its flows."""
        found: dict[str, tuple[Callable[[], ca.SX], Callable[[], tuple[ca.SX, ca.SX]]]] = {}
        for name, component in self.plan.components.items():
            for declared in type(component).declared(Observable):
                if declared.entry == "content":
                    found[name] = (
                        functools.partial(self.content, name, declared.name),
                        functools.partial(self.flows, name),
                    )
        return found

    def outputs_by_part(self) -> list[tuple[str, ca.SX]]:
        """What each step of the plan's order gives, by component."""
        steps = [step for wave in self.plan.order for step in wave]
        groups = [(step.instance, self.plan.traces[step.instance].groups[step.group]) for step in steps]
        return [(name, self.outputs.nz[self.output_of.places([name], group.outputs)]) for name, group in groups]

    def energies(self) -> dict[str, ca.SX]:
        """Per component through which power passes, its five rows of the ledger."""
        rows = self.every(lambda trace: trace.books)
        layout = self.layout(lambda trace: trace.books.numel_out(0))
        return {name: _part(rows, layout, name) for name, size in layout.slots if size}

    def content(self, name: str, observable: str) -> ca.SX:
        layout = self.plan.traces[name].observables
        return ca.sum1(self.observe(name)[list(layout.indices(observable))])

    def flows(self, name: str) -> tuple[ca.SX, ca.SX]:
        component, trace = self.plan.components[name], self.plan.traces[name]
        total, size = ca.SX(0), ca.SX(0)
        for port in type(component).ports():
            if port.domain is not HYDRAULIC or port.role == "reads":
                continue
            layout, vector = (
                (trace.inputs, _part(self.inputs, self.input_of, name))
                if port.role == "gives"
                else (trace.outputs, _part(self.outputs, self.output_of, name))
            )
            for k in layout.indices(f"q_{port.name}"):
                total, size = total + vector[k], size + ca.fabs(vector[k]) / 2
        return total, size


def _alike(traces: dict[str, Trace]) -> dict[str, list[str]]:
    """Names of the components that share a trace, by the first of them."""
    found: dict[int, list[str]] = {}
    for name, trace in traces.items():
        found.setdefault(id(trace), []).append(name)
    return {names[0]: names for names in found.values()}


def _part(vector: ca.SX, layout: Layout, name: str) -> ca.SX:
    """One component's elements of a global vector."""
    at, n = layout.offsets[name]
    return vector[at : at + (n or 0)]


def _variable(name: str, quantity: Quantity, layout: Any, slot: str, vector: Callable[[], ca.SX]) -> Variable:
    indices = layout.indices(slot)

    def expression() -> list[ca.SX]:
        whole = vector()
        return [whole[k] for k in indices]

    return Variable(name, quantity, expression, layout.offsets[slot][1] is not None)


def _depends(expression: ca.SX, symbols: ca.SX) -> Array:
    """Per row of ``expression``, whether it depends on any of ``symbols``."""
    if not symbols.numel():
        return np.zeros(expression.numel(), bool)
    return np.array(ca.which_depends(expression, symbols, 1, True), bool)
