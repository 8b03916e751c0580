r"""How wrong a line's model is at the frequencies of its circuit, and the model to use instead.

A line that knows its exact law (``two_port``) is compared with what its own equations make of it, linearised about the
means of the run: both as scattering matrices,

.. math:: S = (I - Z Y)(I + Z Y)^{-1}, \qquad \varepsilon = \lVert S - S_{exact} \rVert_2

Y [m^3/(s Pa)] flows into the ends per end pressures, Z [Pa s/m^3] the magnitude of the characteristic impedance. S says
which part of the waves that enter leaves at each end: the error is the largest part of a wave that the model sends
elsewhere or later, at most 2, and resonances do not blow it up.
Source: K. Kurokawa, IEEE Trans. Microwave Theory Tech. 13 (1965) 194-202.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import casadi as ca
import numpy as np

from crescentlab import units
from crescentlab.analysis.linear.two_ports import TwoPort
from crescentlab.analysis.spectrum import spectra
from crescentlab.analysis.spectrum.dense import Dense
from crescentlab.component import Component, field_quantity
from crescentlab.domain import HYDRAULIC, State
from crescentlab.errors import CrescentlabError
from crescentlab.fluid import Fluid
from crescentlab.library import Library
from crescentlab.result import Result
from crescentlab.trace import Trace, numeric_fields, trace

Array = np.ndarray

STRONG = 0.1
"""Lines of at least this part of the strongest are the circuit's frequencies."""
MOST_FREQUENCIES = 20
"""Of each of a line's pressures and flows."""
MOST_PARTS = 64
NEWTON = 30
OPEN = 1e-6
"""Slopes below this part of the steepest leave a state open."""
INSTEAD = "distributed_line"
"""The library's line of N cells inside the ODE, where it has one."""
FRICTION_TERMS = (0, 4, 10)
"""Terms of its frequency-dependent friction that are tried, the fewest first."""


@dataclass(frozen=True)
class Ends:
    """Means of a run at a line's two ends: pressures [Pa] and flows into it [m^3/s]."""

    p_a: float
    p_b: float
    q_a: float
    q_b: float

    @property
    def p(self) -> float:
        """Mean pressure [Pa]."""
        return (self.p_a + self.p_b) / 2

    @property
    def q(self) -> float:
        """Mean flow from a to b [m^3/s]."""
        return (self.q_a - self.q_b) / 2

    def part(self, k: int, count: int) -> Ends:
        """Of the k-th of ``count`` equal parts."""
        fall = (self.p_a - self.p_b) / count
        return Ends(self.p_a - k * fall, self.p_a - (k + 1) * fall, self.q, -self.q)


@dataclass(frozen=True)
class LineError:
    """What is wrong with one line."""

    name: str
    type: str
    frequencies: Array
    """The circuit's frequencies [Hz] that pass through it."""
    errors: Array
    """Error at each; empty if the model was not judged."""
    bound: float
    note: str = ""
    """Why it was not judged, or what to write instead."""
    parts: int | None = None
    """Cells or lumps that meet the bound."""

    @property
    def worst(self) -> tuple[float, float]:
        """Largest error and its frequency [Hz]."""
        k = int(np.argmax(self.errors))
        return float(self.errors[k]), float(self.frequencies[k])

    @property
    def within(self) -> bool:
        """Whether the error is below the bound, as far as is known."""
        return not self.errors.size or self.worst[0] <= self.bound


def line_errors(result: Result, library: Library, period: float | None, bound: float) -> list[LineError]:
    """Judge every line of a run that knows its exact law; ``period`` [s] of the circuit, if it has one."""
    found: list[LineError] = []
    for name, instance in result.design.instances.items():
        part = instance.component
        if not isinstance(part, TwoPort):
            continue
        kind = type(part).type_name()
        frequencies, ends = _passing(result, name, period)
        if not frequencies.size:
            found.append(LineError(name, kind, frequencies, np.zeros(0), bound, "nothing oscillates in it"))
            continue
        fluid = result.design.fluids[result.system.plan.fluids[name][0]]
        form = _form(type(result.system.plan.components[name]), part)
        omega = 2 * np.pi * frequencies
        exact = np.asarray(part.two_port(omega, ends.p, ends.q, fluid))
        own = own_two_port(form, fluid, omega, ends)
        if own is None:
            note = "not judged: it steps by ticks, outside the ODE, or has more than two ends"
            found.append(LineError(name, kind, frequencies, np.zeros(0), bound, note))
            continue
        errors = scattering_error(own, exact)
        note, parts = "", None
        if errors.max() > bound:
            note, parts = _instead(form, library, fluid, omega, ends, exact, bound)
        found.append(LineError(name, kind, frequencies, errors, bound, note, parts))
    return found


def _passing(result: Result, name: str, period: float | None) -> tuple[Array, Ends]:
    """The strongest frequencies [Hz] at a line's ends, and the means there.

    Over the last period; without one over the second half of the run, where lines smear.
    """
    ports = ports_of(result.design.instances[name].component)
    names = [f"{name}.{port}.{v}" for v in ("p", "q") for port in ports]
    dense = Dense(result, names)
    span = (dense.stop - dense.start) / 2
    window = period if period is not None and period <= 2 * span else span
    found = spectra(result, names, window)
    hertz: set[float] = set()
    for each in found:
        strongest = each.strongest(MOST_FREQUENCIES)
        most = max((line.amplitude for line in strongest), default=0.0)
        hertz |= {line.frequency for line in strongest if line.amplitude >= STRONG * most}
    return np.array(sorted(hertz)), Ends(*(each.mean for each in found))


# -- what the model's own equations make of it ---------------------------------------------------


def scattering_error(own: Array, exact: Array) -> Array:
    """Error per frequency, shape (m,), of two-ports (m, 2, 2); see the module."""
    impedance = 1 / np.sqrt(np.abs(np.linalg.det(exact)))[:, None, None]

    def scattering(y: Array) -> Array:
        return np.asarray((np.eye(2) - impedance * y) @ np.linalg.inv(np.eye(2) + impedance * y))

    return np.asarray(np.linalg.norm(scattering(own) - scattering(exact), ord=2, axis=(1, 2)))


def ports_of(part: Component) -> tuple[str, str]:
    """Names of a line's two ends: its first two hydraulic ports."""
    first, second = [port.name for port in type(part).ports() if port.domain is HYDRAULIC][:2]
    return first, second


def _form(cls: type[Component], part: Component) -> Component:
    """The causal form of a line that the circuit chose, with the line's numbers."""
    return cls.model_construct(**{n: getattr(part, n) for n in type(part).model_fields})


def own_two_port(form: Component, fluid: Fluid, omega: Array, ends: Ends) -> Array | None:
    """Flows into the ends per end pressures [m^3/(s Pa)] by the component's own equations, shape (m, 2, 2).

    Linearised where its states rest between the means at its ends; None for a part that ticks, or has other ports.
    """
    first, second = ports_of(form)
    traced = trace(form, {"fluid": fluid})
    ours = {f"{v}_{port}" for v in ("p", "q") for port in (first, second)}
    if any(event.kind == "every" for event in traced.events) or {n for n, _ in traced.inputs.slots} - ours:
        return None
    x, u, b = (ca.SX.sym(n, k) for n, k in (("x", traced.states.size), ("u", traced.inputs.size), ("b", _bits(traced))))
    p = [float(getattr(form, n)) for n in traced.parameters]
    pf = [float(getattr(fluid, n)) for n in numeric_fields(type(fluid), fluid)] if traced.fluids else []
    given = (0.0, x, ca.DM.zeros(traced.held.size), b, u, p, pf)
    rate, relation = traced.derivative(*given), traced.relation(*given)
    y = ca.SX.zeros(traced.outputs.size)
    for group in traced.groups:
        y[list(group.outputs)] = group.function(*given)
    slopes = [ca.densify(ca.jacobian(e, v)) for e in (rate, y) for v in (x, u)]
    law = ca.Function("line", [x, u, b], [ca.densify(rate), ca.densify(relation), *slopes])
    _, _, A, B, C, D = _at_rest(form, traced, law, ends)
    respond = C @ np.linalg.solve(1j * omega[:, None, None] * np.eye(A.shape[0]) - A, B.astype(complex)) + D
    rows = {name: respond[:, k] for k, (name, _) in enumerate(traced.outputs.slots)}
    unit = np.broadcast_to(np.eye(2), (omega.size, 2, 2))
    rows |= {name: unit[:, k] for k, (name, _) in enumerate(traced.inputs.slots)}
    pressures, flows = (np.stack([rows[f"{v}_{first}"], rows[f"{v}_{second}"]], axis=1) for v in ("p", "q"))
    return np.asarray(flows @ np.linalg.inv(pressures))


def _bits(traced: Trace) -> int:
    return int(traced.relation.size1_out(0)) if traced.relations else 0


def _at_rest(form: Component, traced: Trace, law: ca.Function, ends: Ends) -> list[Array]:
    """The law where the states rest; what rest leaves open (a closed volume's pressure) stays at the mean."""
    first, second = ports_of(form)
    values = {f"p_{first}": ends.p_a, f"p_{second}": ends.p_b, f"q_{first}": ends.q_a, f"q_{second}": ends.q_b}
    u = np.array([values[name] for name, _ in traced.inputs.slots])
    x, scale = np.zeros(traced.states.size), np.ones(traced.states.size)
    for declared in type(form).declared(State):
        quantity, places = form.quantity(declared.quantity), list(traced.states.indices(declared.name))
        x[places] = ends.p if quantity is units.pressure else 0.0
        scale[places] = declared.nominal or quantity.nominal
    b = np.zeros(_bits(traced))
    for _ in range(NEWTON):
        found = [np.array(m) for m in law(x, u, b)]
        b = (found[1][:, 0] > 0).astype(float) if b.size else b
        slope, rate = found[2] * scale / scale[:, None], found[0].ravel() / scale
        step = scale * np.linalg.lstsq(slope, -rate, rcond=OPEN)[0]
        x = x + step
        if np.all(np.abs(step) <= 1e-9 * scale):
            break
    return [np.array(m) for m in law(x, u, b)]


# -- what to write instead -----------------------------------------------------------------------


def _instead(
    form: Component, library: Library, fluid: Fluid, omega: Array, ends: Ends, exact: Array, bound: float
) -> tuple[str, int | None]:
    """What to write for a line that is too coarse, and how many cells or lumps it takes."""
    for terms in FRICTION_TERMS:
        make = _cells_of(form, library, terms)
        if make is None:
            continue

        def cells(n: int, make: Callable[[int], Component] = make) -> Array | None:
            return own_two_port(make(n), fluid, omega, ends)

        if count := _fewest(cells, 1, exact, bound):
            return f"write {_written(make(count))}", count
    count = _fewest(lambda n: chain(form, n, fluid, omega, ends), 2, exact, bound)
    if count is None:
        return f"not even {MOST_PARTS} parts meet it: what is missing is no inertia or capacity, but losses", None
    each = units.length.show(float(getattr(form, "length", 0.0)) / count, "mm")
    return f"write {count} lines of type {_family(type(form)).type_name()} in series, each {each} long", count


def _written(line: Component) -> str:
    """A line as it is written in a circuit; what has its default is left out, and what only begins the run."""
    said = [f"type: {_family(type(line)).type_name()}"]
    for name, field in type(line).model_fields.items():
        value, quantity = getattr(line, name), field_quantity(field)
        if value is None or value == field.default or name.startswith("start_"):
            continue
        shown = value if quantity is None else quantity.show(float(value), next(iter(quantity.units)))
        said.append(f"{name}: {shown}")
    return f"{{{', '.join(said)}}}"


def _fewest(model: Callable[[int], Array | None], first: int, exact: Array, bound: float) -> int | None:
    """The fewest parts, ``first`` or more, that meet the bound."""

    def meets(count: int) -> bool:
        own = model(count)
        return own is not None and float(scattering_error(own, exact).max()) <= bound

    high = first
    while not meets(high):
        high *= 2
        if high > MOST_PARTS:
            return None
    return next((n for n in range(max(first, high // 2 + 1), high) if meets(n)), high)


def _cells_of(form: Component, library: Library, terms: int) -> Callable[[int], Component] | None:
    """Makes the library's distributed line of n cells in place of a line, its ends as the line's; None without one."""
    cls = library.components.get(INSTEAD)
    if cls is None:
        return None
    roles = {p.name: p.role for p in type(form).ports()}
    forms = [f for f in cls.forms() if {p.name: p.role for p in f.ports()} == roles]
    if not forms or "cells" not in cls.model_fields:
        return None
    given = {n: getattr(form, n) for n in cls.model_fields if n in type(form).model_fields}
    if terms:
        if "friction_terms" not in cls.model_fields:
            return None
        given["friction_terms"] = terms

    def make(cells: int) -> Component:
        return forms[0].model_validate({**given, "cells": cells})

    try:
        make(2)
    except (ValueError, CrescentlabError):
        return None
    return make


def chain(form: Component, count: int, fluid: Fluid, omega: Array, ends: Ends) -> Array | None:
    """Two-port (m, 2, 2) of ``count`` equal parts in series, in the causal forms that then fit each other."""
    total: Array | None = None
    for k, cls in enumerate(_forms_in_series(form, count)):
        values = {n: getattr(form, n) for n in cls.model_fields if n in type(form).model_fields}
        values["length"] /= count
        if "loss_coefficient" in values:
            values["loss_coefficient"] /= count
        own = own_two_port(cls.model_construct(**values), fluid, omega, ends.part(k, count))
        if own is None:
            return None
        matrix = _chain_matrix(own)
        total = matrix if total is None else total @ matrix
    assert total is not None
    return _admittance(total)


def _forms_in_series(form: Component, count: int) -> Iterator[type[Component]]:
    """Forms whose neighbours fit: where one takes the pressure the next gives it."""
    ends = ports_of(form)
    family = {tuple(str(p.role) for p in f.ports() if p.name in ends): f for f in _family(type(form)).forms()}
    a, b = (str(p.role) for p in type(form).ports() if p.name in ends)
    inner = {("takes", "takes"): ("gives", "takes"), ("gives", "gives"): ("takes", "gives")}.get((a, b), (a, b))
    for k in range(count):
        yield family[(a, b) if k == 0 else inner]


def _family(cls: type[Component]) -> type[Component]:
    """The class that the circuit names, of which this is a causal form."""
    return next((c for c in cls.__mro__ if issubclass(c, Component) and c.family), cls)


def _chain_matrix(y: Array) -> Array:
    """(p_a, q_a) from (p_b, -q_b), shape (m, 2, 2)."""
    y11, y12, y21, y22 = y[:, 0, 0], y[:, 0, 1], y[:, 1, 0], y[:, 1, 1]
    rows = [[-y22 / y21, -1 / y21], [y12 - y11 * y22 / y21, -y11 / y21]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _admittance(matrix: Array) -> Array:
    a, b, c, d = matrix[:, 0, 0], matrix[:, 0, 1], matrix[:, 1, 0], matrix[:, 1, 1]
    rows = [[d / b, c - a * d / b], [-1 / b, a / b]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
