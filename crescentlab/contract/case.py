"""A component with a fluid, traced, and the random admissible points at which a contract looks at it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal, TypeAlias

import casadi as ca
import numpy as np

from crescentlab import units
from crescentlab.component import Component, field_quantity
from crescentlab.domain import HYDRAULIC, ROTATIONAL, TRANSLATIONAL, Held, Observable, State
from crescentlab.energy import fluids_needed, keeps_books, power_ports
from crescentlab.errors import ArgumentError
from crescentlab.fluid import Fluid
from crescentlab.trace import Layout, Trace, numeric_fields, trace

Values: TypeAlias = dict[str, np.ndarray]
"""States, held values and port inputs by name, one element per element of their size."""

NOW = 0.3
"""Time [s] of every point."""
USUAL_PRESSURE = 4e5
"""Largest pressure [Pa] of a point."""


def sample(cls: type[Component], settings: Mapping[str, Any] | None = None) -> Component:
    """An instance with every required parameter at its quantity's usual size, but for those of ``settings``."""
    values = dict(settings or {})
    for name, declared in cls.model_fields.items():
        if declared.is_required() and name not in values:
            quantity = field_quantity(declared)
            values[name] = quantity.nominal if quantity else 1.0
    return cls(**values)


@dataclass(frozen=True)
class Case:
    """One component with one fluid, traced; and the points at which it is looked at."""

    component: Component
    fluid: Fluid | None
    within: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        known = [name for layout in (self.made.states, self.made.held, self.made.inputs) for name, _ in layout.slots]
        unknown = set(self.within) - set(known)
        if unknown:
            raise ArgumentError(f"{self.name}: within names {min(unknown)}; its equations know {', '.join(known)}")

    @property
    def cls(self) -> type[Component]:
        """The component's class."""
        return type(self.component)

    @property
    def name(self) -> str:
        """The class's name, for messages."""
        return self.cls.__name__

    @cached_property
    def made(self) -> Trace:
        """The equations on symbols."""
        needed = fluids_needed(self.cls)
        return trace(self.component, dict.fromkeys(needed, self.fluid) if self.fluid is not None else {})

    @property
    def stored(self) -> list[str]:
        """Names of the observables that say how much fluid the component stores."""
        return [o.name for o in self.cls.declared(Observable) if o.entry == "content"]

    @property
    def keeps_books(self) -> bool:
        """Whether it says what becomes of the power that enters through its ports."""
        return keeps_books(self.cls) and bool(power_ports(self.cls))

    @property
    def between_bodies(self) -> bool:
        """Whether it is a part between two bodies and nothing else: it takes two motions, or two rotations."""
        ports = power_ports(self.cls)
        same = len(ports) == 2 and ports[0].domain is ports[1].domain and ports[0].domain in (TRANSLATIONAL, ROTATIONAL)
        return same and all(p.role == "takes" for p in ports)

    @property
    def restricts(self) -> bool:
        """Whether it is a restriction between two nets: two pressures taken, no state, nothing that moves."""
        hydraulic = [p for p in self.cls.ports() if p.domain is HYDRAULIC]
        moves = any(p.domain.name in ("translational", "rotational") for p in self.cls.ports())
        takers = [p.role for p in hydraulic] == ["takes", "takes"]
        return takers and not moves and not self.cls.declared(State)

    @cached_property
    def quantities(self) -> dict[str, units.Quantity]:
        """Quantities of states, held values and port inputs by name."""
        declared = [(d.name, d.quantity) for kind in (State, Held) for d in self.cls.declared(kind)]
        inputs = [pair for port in self.cls.ports() for pair in port.inputs()]
        return {name: self.component.quantity(quantity) for name, quantity in [*declared, *inputs]}

    # -- points ------------------------------------------------------------------------------------

    def point(self, seed: int) -> Values:
        """Random admissible states, held values and inputs."""
        random = np.random.default_rng(seed)
        found = {
            name: self._drawn(name, n, random)
            for layout in (self.made.states, self.made.inputs)
            for name, n in layout.slots
        }
        for name, n in self.made.held.slots:
            mode = self.quantities[name] is units.ratio and name not in self.within
            whole = random.integers(-1, 2, 1 if n is None else n).astype(float) if mode else None
            found[name] = self._drawn(name, n, random) if whole is None else whole
        return found

    def end(self, which: Literal["low", "high"]) -> Values:
        """Every state and input at one end of what is drawn, held values at zero or as near as ``within`` allows."""
        found = self.at_rest(self.point(0))
        for layout in (self.made.states, self.made.inputs):
            for name, n in layout.slots:
                low, high = self._range(name)
                found[name] = np.full(1 if n is None else n, low if which == "low" else high)
        return found

    def _range(self, name: str) -> tuple[float, float]:
        """What a state, held value or input is drawn from."""
        quantity = self.quantities[name]
        if name in self.within:
            return self.within[name]
        if quantity is units.time:  # of a line's last tick, shortly before now
            return NOW - 5e-5, NOW
        usual = USUAL_PRESSURE if quantity is units.pressure else quantity.nominal
        low = 0.2 if name.startswith("V_") else -0.2 if quantity is units.pressure else -1.0
        return low * usual, usual

    def _drawn(self, name: str, n: int | None, random: np.random.Generator) -> np.ndarray:
        return random.uniform(*self._range(name), 1 if n is None else n)

    def at_rest(self, values: Values) -> Values:
        """The point with everything at zero, or as near as ``within`` allows; volumes as they are."""
        return {
            name: value if name.startswith("V_") else np.clip(np.zeros_like(value), *self.within.get(name, (0.0, 0.0)))
            for name, value in values.items()
        }

    # -- values at a point -------------------------------------------------------------------------

    def arguments(self, values: Values, bits: np.ndarray) -> list[np.ndarray]:
        """Arguments of the trace's functions."""
        made, fluid = self.made, self.fluid
        p = np.array([getattr(self.component, n) for n in made.parameters])
        pf = [getattr(fluid, n) for _ in made.fluids for n in numeric_fields(type(fluid), fluid)]  # type: ignore[arg-type]
        states, held, inputs = (flat(layout, values) for layout in (made.states, made.held, made.inputs))
        return [np.array(NOW), states, held, bits, inputs, p, np.array(pf)]

    def given(self, values: Values) -> list[np.ndarray]:
        """Arguments whose bits say the truth at the point, as plain floats would decide."""
        bits = np.zeros(len(self.made.relations))
        strict = np.array([r.strict for r in self.made.relations], dtype=bool)
        for _ in range(len(bits) + 1):
            g = np.array(self.made.relation(*self.arguments(values, bits)))
            bits = ((g[:, 0] > 0) | ((g[:, 0] == 0) & ~strict)).astype(float) if len(bits) else bits
        return self.arguments(values, bits)

    def numbers(self, values: Values) -> dict[str, Any]:
        """What equations return on floats at the point."""
        known: dict[str, Any] = {"t": NOW, **dict.fromkeys(self.made.fluids, self.fluid)}
        for layout in (self.made.states, self.made.held, self.made.inputs):
            known |= {name: float(values[name][0]) if n is None else values[name] for name, n in layout.slots}
        with np.errstate(all="ignore"):
            return self.component.equations(**{n: known[n] for n in self.cls.asks_for()})

    def symbols(self) -> list[ca.SX]:
        """Symbols for the arguments of the trace's functions."""
        function = self.made.derivative
        return [ca.SX.sym(f"a{k}", function.size1_in(k)) for k in range(function.n_in())]


def flat(layout: Layout, values: Values) -> np.ndarray:
    """The vector of a layout."""
    parts = [values[name] for name, _ in layout.slots]
    return np.concatenate(parts) if parts else np.zeros(0)
