"""Plan -> :class:`System`: every trace called on the global symbols, in the plan's order."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from typing import Any

import casadi as ca
import numpy as np

from crescentlab.causality import Plan, Source
from crescentlab.component import Component
from crescentlab.domain import HYDRAULIC, SIGNAL, Held, Observable, State
from crescentlab.elaborate import Output
from crescentlab.errors import ExpressionError, InputError, nearest
from crescentlab.expressions import Value, evaluate
from crescentlab.prepared import shared
from crescentlab.symbols import Condition, Relation, Sym, column
from crescentlab.system import Bits, System, SystemEvent, Variable
from crescentlab.trace import Trace, numeric_fields
from crescentlab.units import Quantity

Array = np.ndarray


def assemble(plan: Plan) -> System:
    """Make the global ODE of a plan."""
    return _Assembly(plan).done()


class _Assembly:
    """Calls every trace on the global symbols, in the plan's order."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        traces = plan.traces
        self.t = ca.SX.sym("t")
        self.x, self.xs = _split("x", [tr.states.size for tr in traces.values()])
        self.h, self.hs = _split("h", [tr.held.size for tr in traces.values()])
        self.b_local, self.bs = _split("b", [len(tr.relations) for tr in traces.values()])
        fluids = plan.design.fluids
        counts = [len(numeric_fields(type(f), f)) for f in fluids.values()]
        self.p, pieces = _split("p", counts + [len(tr.parameters) for tr in traces.values()])
        fluid_pieces = dict(zip(fluids, pieces[: len(fluids)], strict=True))
        self.arguments: dict[str, tuple[ca.SX, ...]] = {}
        for name, xs, hs, bs, ps in zip(traces, self.xs, self.hs, self.bs, pieces[len(fluids) :], strict=True):
            pf = ca.vertcat(*[fluid_pieces[f] for f in plan.fluids[name]]) if plan.fluids[name] else ca.SX(0, 1)
            self.arguments[name] = (xs, hs, bs, ps, pf)
        self.outputs: dict[str, list[ca.SX]] = {name: [ca.SX(0)] * tr.outputs.size for name, tr in traces.items()}
        self.inputs: dict[str, ca.SX] = {}
        self.observed: dict[str, ca.SX] = {}
        self.known: dict[str, Variable] | None = None
        self.resolved: set[str] = set()
        self.running: list[str] = []
        self.pending: dict[str, Output] = {}
        self.used: dict[tuple[str, str], ca.SX] = {}
        """Circuit parameters that outputs refer to; they follow the components' in p."""

    def call(self, name: str, function: ca.Function, u: ca.SX) -> ca.SX:
        xs, hs, bs, ps, pf = self.arguments[name]
        return function(self.t, xs, hs, bs, u, ps, pf)

    def value(self, source: Source) -> ca.SX:
        if not source.outputs:
            return ca.SX(0)
        total = self.outputs[source.outputs[0][0]][source.outputs[0][1]]
        for name, k in source.outputs[1:]:
            total = total + self.outputs[name][k]
        return total if source.sign == 1.0 else -total

    def done(self) -> System:
        plan = self.plan
        for step in plan.order:
            trace = plan.traces[step.instance]
            group = trace.groups[step.group]
            sources = plan.sources[step.instance]
            needed = set(group.inputs)
            u = [self.value(sources[i]) if i in needed else ca.SX(0) for i in range(trace.inputs.size)]
            result = self.call(step.instance, group.function, column(u))
            mine = self.outputs[step.instance]
            for k, element in zip(group.outputs, ca.vertsplit(result), strict=True):
                mine[k] = element
        for name in plan.traces:
            self.inputs[name] = column([self.value(s) for s in plan.sources[name]])
        derivative = column(
            [self.call(n, tr.derivative, self.inputs[n]) for n, tr in plan.traces.items() if tr.states.size]
        )
        clock = column(
            [self.call(n, tr.clock, self.inputs[n]) for n, tr in plan.traces.items() if tr.clock.numel_out(0)]
        )
        relations, scales = self.relations()
        events, conditions, periods = self.events()
        if plan.design.outputs:
            self.variables()  # a wrong output is told before the run
        extra = self.stop(events, conditions, relations, scales)
        b = ca.vertcat(self.b_local, extra)
        derivative, g = ca.vertsplit(
            shared(ca.densify(column([derivative, *relations]))),
            [0, derivative.numel(), derivative.numel() + column(relations).numel()],
        )
        state_names, state_quantities = self.names(State)
        held_names, held_quantities = self.names(Held)
        return System(
            plan=plan,
            output_parameters=tuple(self.used),
            t=self.t,
            x=self.x,
            h=self.h,
            b=b,
            p=column([self.p, *self.used.values()]),
            f=derivative,
            relations=g,
            scales=column(scales),
            conditions=column(conditions),
            periods=column(periods),
            clock=clock,
            events=tuple(events),
            state_names=state_names,
            state_quantities=state_quantities,
            nominal=self.nominal(),
            held_names=held_names,
            held_quantities=held_quantities,
            bits=self.bits(g, b),
            _variables=self.variables,
            _remap=self.remap,
            _contents=self.contents(),
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
        g: list[ca.SX] = []
        scale: list[ca.SX] = []
        for name, trace in self.plan.traces.items():
            if trace.relations:
                both = self.call(name, trace.relation, self.inputs[name])
                g.append(both[:, 0])
                scale.append(both[:, 1])
        return g, scale

    def events(self) -> tuple[list[SystemEvent], list[ca.SX], list[ca.SX]]:
        events: list[SystemEvent] = []
        conditions: list[ca.SX] = []
        periods: list[ca.SX] = []
        for name, trace in self.plan.traces.items():
            if not trace.events:
                continue
            holds = self.call(name, trace.condition, self.inputs[name])
            lasts = self.call(name, trace.period, self.inputs[name])
            for event in trace.events:
                messages = tuple(f"{name}.{n}" for n in event.message_names)
                events.append(
                    SystemEvent(
                        f"{name}.{event.name}",
                        event.kind,
                        f"{name}: {event.message}" if event.message else "",
                        messages,
                    )
                )
                if event.condition is not None:
                    conditions.append(holds[event.condition])
                if event.period is not None:
                    periods.append(lasts[event.period])
        return events, conditions, periods

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

    def bits(self, g: ca.SX, b: ca.SX) -> Bits:
        n = g.numel()
        names = [f"{name}: {info.text}" for name, tr in self.plan.traces.items() for info in tr.relations]
        strict = [info.strict for tr in self.plan.traces.values() for info in tr.relations]
        extra = getattr(self, "stop_strict", [])
        names += ["stop_when"] * len(extra)
        strict += extra
        on_state = _depends(g, self.x) if n else np.zeros(0, bool)
        timed = (_depends(g, self.t) if n else np.zeros(0, bool)) & ~on_state
        curved = np.array(ca.which_depends(g, self.t, 2, True), bool) if n and timed.any() else np.zeros(n, bool)
        held = _depends(g, ca.vertcat(self.h, b)) if n else np.zeros(0, bool)
        return Bits(tuple(names), np.array(strict, bool), on_state, timed, timed & ~curved, held)

    def remap(self, may_fire: list[bool]) -> tuple[ca.SX, list[ca.SX]]:
        """Flags of fired events, and the states and held values after them; composed in the order written.

        Events that cannot fire are left out.
        """
        total = sum(len(tr.events) for tr in self.plan.traces.values()) + (1 if hasattr(self, "stop_strict") else 0)
        fired = ca.SX.sym("fired", total)
        new_x: list[ca.SX] = []
        new_h: list[ca.SX] = []
        at = 0
        for name, trace in self.plan.traces.items():
            xs, hs, bs, ps, pf = self.arguments[name]
            nx = trace.states.size
            for event in trace.events:
                if event.remap is not None and may_fire[at]:
                    after = event.remap(self.t, xs, hs, bs, self.inputs[name], ps, pf)
                    both = ca.if_else(fired[at], after, ca.vertcat(xs, hs))
                    xs, hs = ca.vertsplit(both, [0, nx, both.numel()])
                at += 1
            new_x.append(xs)
            new_h.append(hs)
        return fired, [column(new_x), column(new_h)]

    # -- variables -------------------------------------------------------------------------------

    def variables(self) -> dict[str, Variable]:
        """Every name a result knows, found once."""
        if self.known is None:
            self.known = self.find_variables()
        return self.known

    def find_variables(self) -> dict[str, Variable]:
        """States, held values, observables, port variables, nets and outputs."""
        found: dict[str, Variable] = {}
        for (name, component), xs, hs in zip(self.plan.components.items(), self.xs, self.hs, strict=True):
            trace = self.plan.traces[name]
            for variable in self.of_component(name, component, trace, xs, hs):
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

    def of_component(self, name: str, component: Component, trace: Trace, xs: ca.SX, hs: ca.SX) -> Iterator[Variable]:
        cls = type(component)
        for kind, layout, vector in ((State, trace.states, xs), (Held, trace.held, hs)):
            for declared in cls.declared(kind):
                yield _variable(
                    f"{name}.{declared.name}",
                    component.quantity(declared.quantity),
                    layout,
                    declared.name,
                    functools.partial(_itself, vector),
                )
        for declared in cls.declared(Observable):
            yield _variable(
                f"{name}.{declared.name}", component.quantity(declared.quantity), trace.observables, declared.name,
                functools.partial(self.observe, name),
            )  # fmt: skip
        for port in cls.ports():
            for layout, values, pairs in (
                (trace.outputs, functools.partial(self.output_column, name), port.outputs()),
                (trace.inputs, functools.partial(self.inputs.__getitem__, name), port.inputs()),
            ):
                for variable, quantity in pairs:
                    shown = (
                        f"{name}.{port.name}"
                        if port.domain is SIGNAL
                        else f"{name}.{port.name}.{variable.removesuffix('_' + port.name)}"
                    )
                    yield _variable(shown, component.quantity(quantity), layout, variable, values)

    def observe(self, name: str) -> ca.SX:
        if name not in self.observed:
            self.observed[name] = self.call(name, self.plan.traces[name].observable, self.inputs[name])
        return self.observed[name]

    def output_column(self, name: str) -> ca.SX:
        return column(self.outputs[name])

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
            found.append(self.outputs[giver.instance][layout.offsets[port.outputs()[k][0]][0] + giver.element])
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
                if declared.stored:
                    found[name] = (
                        functools.partial(self.content, name, declared.name),
                        functools.partial(self.flows, name),
                    )
        return found

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
                (trace.inputs, self.inputs[name]) if port.role == "gives" else (trace.outputs, self.output_column(name))
            )
            for k in layout.indices(f"q_{port.name}"):
                total, size = total + vector[k], size + ca.fabs(vector[k]) / 2
        return total, size


def _itself(vector: ca.SX) -> ca.SX:
    return vector


def _variable(name: str, quantity: Quantity, layout: Any, slot: str, vector: Callable[[], ca.SX]) -> Variable:
    indices = layout.indices(slot)

    def expression() -> list[ca.SX]:
        whole = vector()
        return [whole[k] for k in indices]

    return Variable(name, quantity, expression, layout.offsets[slot][1] is not None)


def _split(name: str, sizes: list[int]) -> tuple[ca.SX, list[ca.SX]]:
    """One symbol vector and its consecutive pieces."""
    whole = ca.SX.sym(name, sum(sizes))
    if not sizes:
        return whole, []
    return whole, ca.vertsplit(whole, [0, *np.cumsum(sizes).tolist()])


def _depends(expression: ca.SX, symbols: ca.SX) -> Array:
    """Per row of ``expression``, whether it depends on any of ``symbols``."""
    if not symbols.numel():
        return np.zeros(expression.numel(), bool)
    return np.array(ca.which_depends(expression, symbols, 1, True), bool)
