"""Component: a docstring, typed parameters, ports, states, and one pure function.

.. code-block:: python

    class LaminarResistance(Component):
        '''Linear resistance q = G (p_a - p_b); p [Pa], q [m^3/s], G [m^3/(s Pa)].'''

        conductance: FlowConductance = Field(gt=0, description="flow per pressure drop")
        a = takes_pressure("upstream")
        b = takes_pressure("downstream")

        def equations(self, p_a: Expr, p_b: Expr) -> Equations:
            q = self.conductance * (p_a - p_b)
            return {"q_a": q, "q_b": -q}

The names ``equations`` asks for are bound by name and checked when the class is made. It may ask
for its port variables, states, held values, ``t`` [s], and ``fluid`` (several fluids:
``fluid_<port>``). What it returns must be declared: port variables, ``der_<state>``, observables,
and events (any other name, with ``when`` or ``every``). The same text runs on floats and symbols.

Every ``q`` is positive **into** the component that owns the port, every force and torque positive
**on** it. Wrong, and refused by the balance test: ``{"q_a": q, "q_b": q}``.
"""

from __future__ import annotations

import functools
import inspect
import re
import types
import typing
from collections.abc import Callable, Hashable, Iterable
from typing import Any, ClassVar, TypeAlias

import numpy as np
from pydantic import BaseModel, ConfigDict, Field
from pydantic.fields import FieldInfo

from crescentlab import units
from crescentlab.domain import ENERGY_ENTRIES, HYDRAULIC, Declared, Held, Observable, Port, Size, State
from crescentlab.errors import ComponentError, nearest
from crescentlab.maths import Event, Failure, Tick
from crescentlab.units import Quantity

Equations: TypeAlias = dict[str, Any]
"""Port variables, derivatives, observables and events by name."""

RESERVED = frozenset({"t", "fluid", "self"})


def structural(default: Any = ..., **constraints: Any) -> Any:
    """A pydantic ``Field`` whose value shapes the equations: it stays a number while tracing."""
    return Field(default=default, json_schema_extra={"structural": True}, **constraints)


class Component(BaseModel):
    """Base of every component; see the module docstring for how to write one."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, validate_default=True, ignored_types=(Port, State, Held, Observable, property),
        arbitrary_types_allowed=False, protected_namespaces=(),
    )  # fmt: skip

    family: ClassVar[bool] = False
    """Whether this class only names a family of causal forms (its subclasses)."""
    sampling: ClassVar[str] = ""
    """The parameter, if any, that the period of its tick is in proportion to: one that may be made a little smaller, so
    that a whole number of ticks fills a period."""

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        _check_class(cls)
        if any(port.ranged for port in cls.ports()) and not (cls.family or hasattr(cls.equations, "holds_ranges")):
            cls.equations = _holding_ranges(cls.equations)

    lossless: ClassVar[bool] = False
    """Whether all the power that enters leaves at once, as through a lever, a pair of gears or a meter."""

    # A class without states or ports of its own is still a component; its equations are required.
    equations: ClassVar[Callable[..., Equations]]

    @classmethod
    def declared(cls, kind: type[Declared]) -> list[Any]:
        """The class's ports, states, held values or observables, in the order written."""
        return list(_declared(cls, typing.cast(Hashable, kind)))

    @classmethod
    def ports(cls) -> list[Port]:
        """Ports in the order written."""
        return list(_declared(cls, Port))

    @classmethod
    def port_named(cls, name: str) -> Port:
        """The port called ``name``."""
        return next(p for p in cls.ports() if p.name == name)

    @classmethod
    def forms(cls) -> list[type[Component]]:
        """The causal forms of a family, defined in its own module or package; for a plain class, itself.

        What others derive from the family is theirs: see :meth:`crescentlab.library.Library.forms`.
        """
        if not cls.family:
            return [cls]
        return [form for sub in cls.__subclasses__() if _together(sub, cls) for form in sub.forms()]

    @property
    def unbalanced(self) -> str:
        """Why its volumes do not follow its flows, so that the ledgers of a run with it cannot close; empty if they do.

        A class whose simplification breaks the balance overrides it.
        """
        return ""

    @classmethod
    def asks_for(cls) -> list[str]:
        """Names of the arguments of ``equations``."""
        return list(_arguments(cls))

    @classmethod
    def deduced_observable(cls) -> str | None:
        """The loss or supply that ``equations`` may leave out: where nothing else is said of energy."""
        said = [o for o in _declared(cls, Observable) if o.entry in ENERGY_ENTRIES]
        return said[0].name if len(said) == 1 and said[0].deduced else None

    @classmethod
    def type_name(cls) -> str:
        """The class's name in a circuit file: ``LaxWendroffLine`` is ``lax_wendroff_line``."""
        return snake_case(cls.__name__)

    def size_of(self, size: Size | None) -> int | None:
        """Number of elements that ``size`` stands for, None for a scalar."""
        if size is None:
            return None
        try:
            value = getattr(self, size) if isinstance(size, str) else size(self) if callable(size) else size
        except Exception as error:  # the author's slip
            raise ComponentError(f"{type(self).__name__}: no size: {type(error).__name__}: {error}") from error
        if value is None:
            return None
        if int(value) != value or value < 0:
            raise ComponentError(f"{type(self).__name__}: size {value!r} is not a whole number from 0")
        return int(value)

    def remarks(self, stop: float, fluid: Any = None) -> list[str]:
        """Sentences that `check` adds about this part in a run until ``stop`` [s]; a class says what is worth one.

        ``fluid`` is the one in it, of several the first; None without one or where the circuit around names it.
        """
        return []

    def quantity(self, quantity: Quantity | str) -> Quantity:
        """A declared quantity, looked up in this component's field where it is named by one."""
        return units.quantity_named(str(getattr(self, quantity))) if isinstance(quantity, str) else quantity

    def start_of(self, declared: State | Held, fluid: Any = None) -> np.ndarray:
        """Start value of a state or held value, one element per element of its size."""
        start = declared.start
        if isinstance(start, str):
            value = getattr(self, start)
        elif callable(start):
            function: Callable[..., Any] = start
            value = function(self, fluid) if len(inspect.signature(function).parameters) == 2 else function(self)
        else:
            value = start
        n = self.size_of(declared.size)
        return np.broadcast_to(np.asarray(value, dtype=float), (1 if n is None else n,)).copy()


def _together(one: type, other: type) -> bool:
    """Whether two classes are of one module, or of modules of one package."""
    home, away = one.__module__, other.__module__
    package = home.rpartition(".")[0]
    return home == away or (bool(package) and package == away.rpartition(".")[0])


def _holding_ranges(equations: Callable[..., Equations]) -> Callable[..., Equations]:
    """The same equations; the signals they are given are held within the ranges that the ports declare."""
    signature = inspect.signature(equations)

    @functools.wraps(equations)
    def held(self: Component, *args: Any, **kwargs: Any) -> Equations:
        given = signature.bind(self, *args, **kwargs)
        for port in self.ports():
            if port.ranged and port.name in given.arguments:
                given.arguments[port.name] = port.within(given.arguments[port.name])
        return equations(*given.args, **given.kwargs)

    held.holds_ranges = True  # type: ignore[attr-defined]
    return held


@functools.cache
def _declared(cls: type[Component], kind: Any) -> tuple[Any, ...]:
    found: dict[str, Any] = {}
    for base in reversed(cls.__mro__):
        for name, value in vars(base).items():
            if isinstance(value, Declared):
                found[name] = value
    return tuple(value for value in found.values() if isinstance(value, kind))


@functools.cache
def _arguments(cls: type[Component]) -> tuple[str, ...]:
    return tuple(p for p in inspect.signature(cls.equations).parameters if p != "self")


@functools.cache
def structural_fields(model: type[BaseModel]) -> frozenset[str]:
    """Names of the fields of a component or fluid class that shape its equations."""
    return frozenset(name for name, field in model.model_fields.items() if is_structural(field))


def snake_case(name: str) -> str:
    """``IRCPipe`` -> ``irc_pipe``."""
    text = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name)
    return text.lower()


def is_structural(field: FieldInfo) -> bool:
    """Whether a field's value shapes the equations: whole numbers, choices, lists, marked floats."""
    extra = field.json_schema_extra
    if isinstance(extra, dict) and extra.get("structural"):
        return True
    annotation = field.annotation
    if typing.get_origin(annotation) in (typing.Union, types.UnionType):
        inner = [a for a in typing.get_args(annotation) if a is not type(None)]
        return not all(_is_float(a) for a in inner)
    return not _is_float(annotation)


def _is_float(annotation: Any) -> bool:
    if typing.get_origin(annotation) is typing.Annotated:
        annotation = typing.get_args(annotation)[0]
    return annotation is float


def field_quantity(field: FieldInfo) -> Quantity | None:
    """The quantity of a field, through ``Optional`` and lists; None for words and whole numbers."""
    for extra in field.metadata:
        if isinstance(extra, Quantity):
            return extra
    return _find_quantity(field.annotation)


def _find_quantity(annotation: Any) -> Quantity | None:
    for extra in getattr(annotation, "__metadata__", ()):
        if isinstance(extra, Quantity):
            return extra
    for inner in typing.get_args(annotation):
        found = _find_quantity(inner)
        if found is not None:
            return found
    return None


def available(cls: type[Component]) -> list[str]:
    """Names that ``equations`` of ``cls`` may ask for besides ``t`` and its fluids."""
    names = [name for port in cls.ports() for name, _ in port.inputs()]
    names += [s.name for s in cls.declared(State)] + [h.name for h in cls.declared(Held)]
    return names


def fluid_names(cls: type[Component]) -> list[str]:
    """Fluids the component may ask for: ``fluid``, or ``fluid_<port>`` per hydraulic port."""
    return ["fluid"] + [f"fluid_{p.name}" for p in cls.ports() if p.domain is HYDRAULIC]


def returns(cls: type[Component]) -> set[str]:
    """Names ``equations`` must return; whatever else it returns is an event."""
    must = {name for port in cls.ports() for name, _ in port.outputs()}
    must |= {f"der_{s.name}" for s in cls.declared(State)}
    must |= {o.name for o in cls.declared(Observable)}
    return must


def _check_class(cls: type[Component]) -> None:
    where = f"component {cls.__name__}"
    ports = cls.ports()
    taken: dict[str, str] = {name: f"parameter {name}" for name in cls.model_fields}
    for name in (RESERVED | {"type", "start"}) & set(cls.model_fields):
        raise ComponentError(f"{where}: a parameter may not be called {name!r}, which has a meaning of its own")
    for port in ports:
        if port.role == "undecided" and not cls.family:
            raise ComponentError(
                f"{where}: port {port.name} is undecided; only a class with `family = True` may leave it so"
            )
        names = [port.name] + [n for k in ("across", "through") for n, _ in port.variables(k) if n != port.name]
        _claim(taken, names, f"port {port.name}", where)
    for kind, title in ((State, "state"), (Held, "held value"), (Observable, "observable")):
        for item in cls.declared(kind):
            _claim(taken, [item.name], f"{title} {item.name}", where)
    if cls.family:
        return
    if "equations" not in {name for base in cls.__mro__ for name in vars(base)}:
        raise ComponentError(f"{where}: has no equations; write `def equations(self, ...) -> Equations:`")
    offered = available(cls)
    for name in cls.asks_for():
        if name in ("t", *offered, *fluid_names(cls)):
            continue
        raise ComponentError(
            f"{where}: equations asks for {name}; its ports and states offer {', '.join(offered) or 'nothing'} "
            f"(besides t and fluid)"
        )


def _claim(taken: dict[str, str], names: Iterable[str], owner: str, where: str) -> None:
    for name in names:
        if name in RESERVED or hasattr(Component, name):
            raise ComponentError(f"{where}: {owner} may not be called {name!r}, which equations use for something else")
        if name in taken:
            raise ComponentError(f"{where}: {owner} and {taken[name]} are both called {name!r}; rename one")
        taken[name] = owner


def check_returned(cls: type[Component], returned: Any) -> None:
    """Raise :class:`ComponentError` unless ``equations`` returned just what the class declares."""
    where = f"component {cls.__name__}"
    if not isinstance(returned, dict):
        raise ComponentError(f"{where}: equations must return a dictionary, not {type(returned).__name__}")
    must = returns(cls)
    missing = must - returned.keys() - {cls.deduced_observable()}
    if missing:
        raise ComponentError(f"{where}: equations does not return {', '.join(sorted(missing))}")
    for name, value in returned.items():
        if isinstance(value, Failure):
            continue
        if isinstance(value, (Event, Tick)):
            allowed = {s.name for s in [*cls.declared(State), *cls.declared(Held)]}
            unknown = set(value.then) - allowed
            if unknown:
                raise ComponentError(
                    f"{where}: event {name} sets {', '.join(sorted(unknown))}, which is no state or held value: "
                    f"{nearest(min(unknown), allowed)}"
                )
            if name in must:
                raise ComponentError(f"{where}: {name} is declared as a value but returned as an event")
        elif name not in must:
            raise ComponentError(f"{where}: equations returns {name}, which is not declared: {nearest(name, must)}")
