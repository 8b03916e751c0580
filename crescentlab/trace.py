"""Component -> :class:`Trace`: its equations as CasADi functions, made once per class and structure.

Parameters stay symbolic. Port outputs are grouped by the port inputs they depend on, read off the
traced graph's sparsity, so that the order of evaluation is decided per port variable and no false
algebraic loop arises.
"""

from __future__ import annotations

import functools
import string
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from pydantic import BaseModel

from crescentlab.component import Component, check_returned, structural_fields
from crescentlab.domain import Held, Observable, State
from crescentlab.energy import books, deduced, powers
from crescentlab.errors import ComponentError
from crescentlab.fluid import Fluid
from crescentlab.maths import TRACER, Event, Failure, Tick
from crescentlab.symbols import EQUALITIES, Condition, Equality, Relation, Sym, as_condition, column
from crescentlab.units import Quantity

Slot = tuple[str, int | None]
"""A declared name and its number of elements (None: scalar)."""


@dataclass(frozen=True)
class Layout:
    """Names that share one flat vector, in order."""

    slots: tuple[Slot, ...]

    @functools.cached_property
    def offsets(self) -> dict[str, tuple[int, int | None]]:
        """Offset and size by name."""
        found: dict[str, tuple[int, int | None]] = {}
        at = 0
        for name, n in self.slots:
            found[name] = (at, n)
            at += 1 if n is None else n
        return found

    @functools.cached_property
    def size(self) -> int:
        """Length of the flat vector."""
        return sum(1 if n is None else n for _, n in self.slots)

    def indices(self, name: str) -> range:
        """Places of a name's elements."""
        at, n = self.offsets[name]
        return range(at, at + (1 if n is None else n))

    def places(self, names: Iterable[str], within: Sequence[int] | None = None) -> list[int]:
        """Places of several names' elements, name by name; ``within`` picks the same few of each."""
        if within is None:
            return [k for name in names for k in self.indices(name)]
        return [self.offsets[name][0] + k for name in names for k in within]

    def cut(self, vector: ca.SX) -> dict[str, Sym]:
        """The vector's parts as symbols by name."""
        return {
            name: Sym(vector[at]) if n is None else Sym(vector[at : at + n] if n else ca.SX(0, 1), (n,))
            for name, (at, n) in self.offsets.items()
        }


@dataclass(frozen=True)
class Group:
    """Port outputs that depend on the same port inputs, and the function that gives them."""

    outputs: tuple[int, ...]
    inputs: tuple[int, ...]
    function: ca.Function


@dataclass(frozen=True)
class EventInfo:
    """One ``when``, ``every`` or ``fail_when``: where its condition or period and remap are."""

    name: str
    kind: str
    condition: int | None = None
    period: int | None = None
    remap: ca.Function | None = None
    message: str = ""
    message_names: tuple[str, ...] = ()
    initial: bool = False
    """Whether it waits at the start until what it reads has been set."""


@dataclass(frozen=True)
class RelationInfo:
    """What is known of a frozen bit without numbers."""

    text: str
    strict: bool
    switches: bool
    """Chooses a value (``event_where``); otherwise it serves conditions of events alone."""


@dataclass(frozen=True)
class Trace:
    """A component class in one structure, as functions of (t, x, h, b, u, p, pf).

    x states, h held values, b bits, u port inputs, p parameters, pf the fluids' parameters.
    """

    cls: type[Component]
    states: Layout
    held: Layout
    inputs: Layout
    outputs: Layout
    observables: Layout
    parameters: tuple[str, ...]
    fluids: tuple[str, ...]
    groups: tuple[Group, ...]
    derivative: ca.Function
    observable: ca.Function
    relations: tuple[RelationInfo, ...]
    relation: ca.Function
    """Two columns: the sides' difference (positive: true) and the sum of their magnitudes."""
    events: tuple[EventInfo, ...]
    condition: ca.Function
    period: ca.Function
    books: ca.Function
    """Five rows of the ledger of energy, or none; see :func:`crescentlab.energy.books`."""


def numeric_fields(model: type[BaseModel], values: Any) -> tuple[str, ...]:
    """Fields that stay symbolic: floats that are given and not structural."""
    structural = structural_fields(model)
    return tuple(n for n in model.model_fields if n not in structural and getattr(values, n) is not None)


def structure_of(model: Any) -> tuple[Any, ...]:
    """What of a component or fluid shapes its equations."""
    cls: type[BaseModel] = type(model)
    structural = structural_fields(cls)
    return cls, tuple(
        (n, _hashable(value) if n in structural else None)
        for n in cls.model_fields
        if (value := getattr(model, n)) is None or n in structural
    )


def _hashable(value: Any) -> Any:
    return tuple(_hashable(v) for v in value) if isinstance(value, list) else value


def symbolic_copy(model: Any, names: Iterable[str], symbols: dict[str, Sym]) -> Any:
    """The model with the named fields replaced by symbols, validators left out."""
    values = {n: getattr(model, n) for n in type(model).model_fields}
    values.update({n: symbols[n] for n in names})
    return type(model).model_construct(**values)


class _Bits:
    """Collects relations while the equations run."""

    def __init__(self) -> None:
        self.symbols: list[ca.SX] = []
        self.relations: list[Relation] = []
        self.halvings: dict[tuple[int, bytes], tuple[ca.SX, list[ca.SX]]] = {}
        self.alike: dict[Any, list[tuple[ca.SX, ca.SX]]] = {}
        """Differences of the sides, and their bits, of relations whose operator, shape and outermost terms agree."""

    def bit(self, relation: Relation) -> ca.SX:
        difference = (relation.lhs - relation.rhs).sx
        ends = [_outline(difference[k]) for k in {0, difference.numel() - 1}]
        known = self.alike.setdefault((relation.operator, relation.shape, *ends), [])
        for same, symbol in known:
            if ca.is_equal(same, difference, 8):
                return symbol
        symbol = ca.SX.sym(f"b{len(self.symbols)}", relation.shape[0] if relation.shape else 1)
        self.symbols.append(symbol)
        self.relations.append(relation)
        known.append((difference, symbol))
        return symbol


def _outline(term: ca.SX, depth: int = 3) -> Any:
    """Operations, symbols and constants of a term down to a depth: what differs here is not equal."""
    if term.is_leaf():
        return float(term) if term.is_constant() else term.element_hash()
    return (term.op(), *(_outline(term.dep(k), depth - 1) for k in range(term.n_dep()) if depth))


def trace(component: Component, fluids: dict[str, Fluid]) -> Trace:
    """Trace ``component``'s class in its structure; raises :class:`ComponentError` naming class and line.

    ``fluids`` are those of :func:`crescentlab.energy.fluids_needed`, by argument.
    """
    return _Tracing(component, fluids).done()


class _Tracing:
    def __init__(self, component: Component, fluids: dict[str, Fluid]) -> None:
        self.cls = cls = type(component)
        self.component = component

        def layout(pairs: Iterable[tuple[str, Any]]) -> Layout:
            return Layout(tuple((name, component.size_of(size)) for name, size in pairs))

        self.states = layout((s.name, s.size) for s in cls.declared(State))
        self.held = layout((s.name, s.size) for s in cls.declared(Held))
        self.inputs = layout((name, port.size) for port in cls.ports() for name, _ in port.inputs())
        self.outputs = layout((name, port.size) for port in cls.ports() for name, _ in port.outputs())
        self.observables = layout((o.name, o.size) for o in cls.declared(Observable))
        self.parameters = numeric_fields(cls, component)
        self.fluid_names = tuple(fluids)
        self.t = ca.SX.sym("t")
        self.x, self.h, self.u = (_symbols(lay.slots) for lay in (self.states, self.held, self.inputs))
        self.p = _symbols([(n, None) for n in self.parameters])
        fluid_fields = [numeric_fields(type(fluids[n]), fluids[n]) for n in self.fluid_names]
        self.pf = _symbols(
            [(f"{n}.{f}", None) for n, fs in zip(self.fluid_names, fluid_fields, strict=True) for f in fs]
        )
        self.known: dict[str, Any] = {
            **self.states.cut(self.x),
            **self.held.cut(self.h),
            **self.inputs.cut(self.u),
            "t": Sym(self.t),
        }
        at = 0
        for name, fields in zip(self.fluid_names, fluid_fields, strict=True):
            symbols = {f: Sym(self.pf[at + k]) for k, f in enumerate(fields)}
            self.known[name] = symbolic_copy(fluids[name], fields, symbols)
            at += len(fields)
        symbols = {n: Sym(self.p[k]) for k, n in enumerate(self.parameters)}
        self.symbolic = symbolic_copy(component, self.parameters, symbols)

    def fail(self, message: str) -> ComponentError:
        return ComponentError(f"component {self.cls.__name__}: {message}")

    def run(self) -> tuple[dict[str, Any], _Bits]:
        bits = _Bits()
        token = TRACER.set(bits)
        met: list[Equality] = []
        equalities = EQUALITIES.set(met)
        try:
            returned = self.symbolic.equations(**{n: self.known[n] for n in self.cls.asks_for()})
            check_returned(self.cls, returned)
            self.switching = len(bits.relations)  # those that follow come from conditions
            self.conditions = [
                self.lowered(e.condition, bits) if isinstance(e, (Event, Failure)) else ca.SX(0)
                for e in returned.values()
            ]
        except ComponentError:
            raise
        except Exception as error:  # the author's slip, told in the author's words
            said = " ".join(str(error).split())
            raise self.fail(f"its equations do not work on symbols: {type(error).__name__}: {said}") from error
        finally:
            TRACER.reset(token)
            EQUALITIES.reset(equalities)
        for equality in met:
            if any(ca.which_depends(equality.lhs.sx - equality.rhs.sx, ca.vertcat(self.x, self.t), 1, True)):
                raise self.fail("== compares a continuous value, which never meets exactly; use <, <=, > or >=")
        return returned, bits

    def lowered(self, condition: Any, bits: _Bits) -> ca.SX:
        made = as_condition(condition)
        if made.shape != ():
            raise self.fail("an event's condition must be a scalar; combine a vector's elements first")
        return made.lower(bits.bit)

    def done(self) -> Trace:
        returned, bits = self.run()
        b = ca.vertcat(*bits.symbols) if bits.symbols else ca.SX(0, 1)
        arguments = [self.t, self.x, self.h, b, self.u, self.p, self.pf]
        y = self.column(returned, self.outputs)
        entering = powers(self.cls, {**self.known, **returned}, {n: self.known[n] for n in self.fluid_names})
        shown = {**deduced(self.cls, entering), **returned}
        function = functools.partial(self.function, arguments)
        relations = [Sym.of(r.lhs - r.rhs if r.operator[0] == ">" else r.rhs - r.lhs).sx for r in bits.relations]
        scales = [Sym.of(abs(r.lhs) + abs(r.rhs)).sx for r in bits.relations]
        infos = [
            RelationInfo(_text(r), "=" not in r.operator, k < self.switching)
            for k, r in enumerate(bits.relations)
            for _ in range(r.shape[0] if r.shape else 1)
        ]
        events, conditions, periods = self.events(returned, function)
        derivative = self.column(
            {k.removeprefix("der_"): v for k, v in returned.items() if k.startswith("der_")}, self.states
        )
        observable = self.column(shown, self.observables)
        return Trace(
            self.cls, self.states, self.held, self.inputs, self.outputs, self.observables, self.parameters,
            self.fluid_names,
            tuple(self.groups(y, function)), function("der", derivative), function("obs", ca.cse(observable)),
            tuple(infos),
            function("rel", ca.horzcat(column(relations), column(scales))), tuple(events),
            function("cond", column(conditions)),
            function("period", column(periods)),
            function("books", ca.cse(books(self.cls, shown, entering))),
        )  # fmt: skip

    @staticmethod
    def function(arguments: list[ca.SX], name: str, value: ca.SX) -> ca.Function:
        return ca.Function(name, arguments, [ca.densify(value)])

    def column(self, returned: dict[str, Any], layout: Layout) -> ca.SX:
        """The named values as one column, each of its declared size."""
        parts_: list[ca.SX] = []
        for name, n in layout.slots:
            try:
                value = Sym.of(returned[name])
            except (TypeError, ValueError):
                raise self.fail(f"{name} is {returned[name]!r}, not a number or an expression") from None
            if value.shape == () and n is not None:
                value = value + Sym.of(np.zeros(n))
            if value.shape != (() if n is None else (n,)):
                raise self.fail(f"{name} has shape {value.shape}, its declaration says {() if n is None else (n,)}")
            parts_.append(value.sx)
        return column(parts_)

    def groups(self, y: ca.SX, function: Any) -> Iterable[Group]:
        """Port outputs grouped by the port inputs in their sparsity."""
        if y.numel() == 0:
            return
        pattern = ca.jacobian_sparsity(y, self.u) if self.u.numel() else ca.Sparsity(y.numel(), 0)
        rows, columns = pattern.get_triplet()
        needs: dict[int, list[int]] = {k: [] for k in range(y.numel())}
        for row, place in zip(rows, columns, strict=True):
            needs[row].append(place)
        by_need: dict[tuple[int, ...], list[int]] = {}
        for k, need in needs.items():
            by_need.setdefault(tuple(sorted(need)), []).append(k)
        for inputs, members in by_need.items():
            yield Group(tuple(members), inputs, function("port", ca.vertcat(*[y[k] for k in members])))

    def events(self, returned: dict[str, Any], function: Any) -> tuple[list[EventInfo], list[ca.SX], list[ca.SX]]:
        infos: list[EventInfo] = []
        conditions: list[ca.SX] = []
        periods: list[ca.SX] = []
        for (name, value), condition in zip(returned.items(), self.conditions, strict=True):
            if isinstance(value, Failure):
                names = tuple(n for _, n, _, _ in string.Formatter().parse(value.message) if n is not None)
                unknown = [n for n in names if n not in self.observables.offsets]
                if unknown:
                    raise self.fail(f"the message of {name} shows {{{unknown[0]}}}, which is no observable")
                infos.append(
                    EventInfo(name, "fail", condition=len(conditions), message=value.message, message_names=names)
                )
                conditions.append(condition)
            elif isinstance(value, Event):
                remap = function("remap", self.remap(value.then))
                infos.append(EventInfo(name, "when", condition=len(conditions), remap=remap, initial=value.initial))
                conditions.append(condition)
            elif isinstance(value, Tick):
                period = Sym.of(value.dt).sx
                if any(ca.which_depends(period, ca.vertcat(self.t, self.x, self.h, self.u), 1, True)):
                    raise self.fail(f"the period of {name} must depend on parameters only")
                infos.append(
                    EventInfo(name, "every", period=len(periods), remap=function("remap", self.remap(value.then)))
                )
                periods.append(period)
        return infos, conditions, periods

    def remap(self, then: dict[str, Any]) -> ca.SX:
        """New states and held values, those not named unchanged."""
        values: dict[str, Any] = {**self.states.cut(self.x), **self.held.cut(self.h), **then}
        for name, value in then.items():
            if isinstance(value, Condition):
                values[name] = Sym(value.lower(), value.shape)
        return ca.vertcat(self.column(values, self.states), self.column(values, self.held))


def _symbols(slots: Iterable[Slot]) -> ca.SX:
    """One symbol per element, called as in the component's text so that messages can quote relations."""
    names = [[name] if size is None else [f"{name}[{k + 1}]" for k in range(size)] for name, size in slots]
    return column([ca.SX.sym(n) for each in names for n in each])


def _text(relation: Relation) -> str:
    text = f"{relation.lhs.sx} {relation.operator} {relation.rhs.sx}"
    return text if len(text) < 80 else f"a relation {relation.operator}"


def quantities(component: Component, kind: type[State] | type[Held] | type[Observable]) -> dict[str, Quantity]:
    """Quantities of declared values by name."""
    return {d.name: component.quantity(d.quantity) for d in type(component).declared(kind)}
