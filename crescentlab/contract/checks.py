"""What must hold for a component class at the points of a case, and what for the laws of a fluid."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Literal, TypeAlias, get_args

import casadi as ca
import numpy as np
from pydantic import ValidationError

from crescentlab import units
from crescentlab.component import Component
from crescentlab.contract.case import USUAL_PRESSURE, Case, Values
from crescentlab.domain import HYDRAULIC, SIGNAL, TRANSLATIONAL, Held, Observable, Port, State
from crescentlab.energy import power_ports
from crescentlab.errors import ArgumentError, ContractError
from crescentlab.fluid import Fluid
from crescentlab.trace import Layout

Backwards: TypeAlias = Literal["equal", "unequal", "nothing"]
"""What a restriction passes backwards: as much as forwards, another flow, or nothing."""

BY_DIFFERENCE = 1e-3
"""Error of a central difference over 1e-4 of the pressure, with room for a density's edges."""


def _require(kept: bool, message: str) -> None:
    if not kept:
        raise ContractError(message)


def check_fluid(fluid: Fluid) -> None:
    """The laws of a fluid belong together: beta = rho dp/drho, and dw/dp = 1/rho; raises :class:`ContractError`.

    At gauge pressures from 0.9 bar of tension to 1000 bar, each within what a central difference can tell.
    """
    laws: dict[str, Callable[[Any], Any]] = {n: getattr(fluid, n) for n in ("density", "bulk_modulus", "enthalpy")}
    for p in np.concatenate([np.linspace(-0.9e5, 1e5, 20), np.geomspace(1e5, 1e8, 30)]).tolist():
        step = 1e-4 * (fluid.atmospheric_pressure + p)
        rho, beta, _ = (float(law(p)) for law in laws.values())
        slope, _, rise = (float(law(p + step) - law(p - step)) / (2 * step) for law in laws.values())
        told = f"{type(fluid).__name__} at {p / 1e5:.4g} bar"
        viscosity = float(fluid.kinematic_viscosity(p))
        _require(rho > 0 and viscosity > 0, f"{told}: density and viscosity must be above 0")
        said = f"bulk_modulus is {beta:g} Pa, rho dp/drho of its density {rho / slope if slope else np.inf:g} Pa"
        _require(abs(beta * slope - rho) <= BY_DIFFERENCE * rho, f"{told}: {said}")
        said = f"the slope of enthalpy is {rise:g} m^3/kg, 1/density {1 / rho:g} m^3/kg"
        _require(abs(rise * rho - 1) <= BY_DIFFERENCE, f"{told}: {said}")


def check_documented(cls: type[Component]) -> None:
    """Docstring with equation, units and source; a meaning for every parameter, port, state and observable."""
    text = inspect.getdoc(cls) or ""
    family = next((inspect.getdoc(b) or "" for b in cls.__mro__ if getattr(b, "family", False)), "")
    for part, meaning in ((".. math::", "equation"), ("[", "SI unit in brackets"), ("Source:", "source")):
        said = text + family if part == ".. math::" else text
        _require(part in said, f"{cls.__name__}: its docstring has no {meaning}: {part!r} is missing")
    slip = next((c for c in "\a\b\f\r\v" if c in text), "")
    _require(not slip, f"{cls.__name__}: its docstring holds {slip!r}; begin it with r, so that a backslash stays one")
    declared = [*cls.ports(), *(d for kind in (State, Held, Observable) for d in cls.declared(kind))]
    described = {n: f.description for n, f in cls.model_fields.items()} | {d.name: d.description for d in declared}
    for name, description in described.items():
        _require(bool(description), f"{cls.__name__}: {name} has no description")


def check_floats_equal_symbols(case: Case) -> None:
    """The traced equations give what the same text gives on plain floats, at random admissible points."""
    made = case.made
    for seed in range(5):
        values = case.point(seed)
        given, expected = case.given(values), case.numbers(values)
        for layout, function, prefix in (
            (made.states, made.derivative, "der_"),
            (made.observables, made.observable, ""),
        ):
            got = np.array(function(*given)).ravel()
            for name, _ in layout.slots:
                if name != case.cls.deduced_observable() or name in expected:
                    _same(case, prefix + name, got[list(layout.indices(name))], expected[prefix + name])
        for group in made.groups:
            computed = dict(zip(group.outputs, np.array(group.function(*given)).ravel(), strict=True))
            for name, n in made.outputs.slots:
                places = [k for k in made.outputs.indices(name) if k in computed]
                first = made.outputs.offsets[name][0]
                size = 1 if n is None else n
                whole = np.broadcast_to(np.atleast_1d(np.asarray(expected[name], dtype=float)), (size,))
                _same(case, name, np.array([computed[k] for k in places]), whole[[k - first for k in places]])


def _same(case: Case, name: str, symbols: np.ndarray, floats: Any) -> None:
    wanted = np.atleast_1d(np.asarray(floats, dtype=float))
    finite = bool(np.isfinite(wanted).all())
    _require(finite, f"{case.name}: {name} is {wanted} on floats; narrow it by within=")
    kept = np.allclose(symbols, wanted, rtol=1e-9, atol=1e-300)
    _require(kept, f"{case.name}: {name} is {symbols} on symbols and {wanted} on floats; use crescentlab.maths")


def check_jacobian(case: Case) -> None:
    """No derivative is infinite or not a number, with any parameter at a bound that it may have.

    At random points, with everything at zero (at zero drop), and with everything at either end.
    """
    made, symbols = case.made, case.symbols()
    rows = [f"der_{name}" for name in named(made.states)]
    rows += [outputs for group in made.groups for outputs in (named(made.outputs)[k] for k in group.outputs)]
    columns = named(made.states) + named(made.inputs)
    values_of = ca.vertcat(made.derivative(*symbols), *[g.function(*symbols) for g in made.groups])
    jacobian = ca.Function("j", symbols, [ca.jacobian(values_of, ca.vertcat(symbols[1], symbols[4]))])
    rest = case.at_rest(case.point(3))
    points = [*(case.point(seed) for seed in range(3)), rest, case.end("low"), case.end("high")]
    for one, values in [*((case, v) for v in points), *((bound, v) for bound in _at_bounds(case) for v in points[2:])]:
        found = np.array(jacobian(*one.given(values)))
        for i, j in np.argwhere(~np.isfinite(found)):
            told = ", ".join(f"{name} = {np.squeeze(value)}" for name, value in values.items())
            where = "" if one is case else f" for {one.component!r}"
            said = f"{case.name}: d {rows[i]} / d {columns[j]} is {found[i, j]} at {told}{where}"
            raise ContractError(f"{said}; round it there, inside the branch if it is in one: both are differentiated")


def _at_bounds(case: Case) -> Iterator[Case]:
    """The component with one parameter at a time at a bound that it may have, as far as the others allow it."""
    given = {name: getattr(case.component, name) for name in case.cls.model_fields}
    for name in case.made.parameters:
        for constraint in case.cls.model_fields[name].metadata:
            bound = getattr(constraint, "ge", getattr(constraint, "le", None))
            if bound is None:
                continue
            try:
                one = case.cls(**{**given, name: float(bound)})
            except ValidationError:
                continue
            yield Case(one, case.fluid, case.within)


def named(layout: Layout) -> list[str]:
    """One name per element of a layout's vector."""
    return [name if n is None else f"{name}[{k + 1}]" for name, n in layout.slots for k in range(1 if n is None else n)]


def check_content(case: Case) -> None:
    """d(content)/dt along the equations equals the sum of the hydraulic flows: what enters is stored.

    Parts whose content changes by held values only (a line between ticks) keep it through their states.
    """
    made, symbols = case.made, case.symbols()
    content = made.observable(*symbols)[list(made.observables.indices(case.stored[0]))]
    function = ca.Function("rate", symbols, [_rate(case, symbols, content)])
    for values in _switched(case):
        found, expected = float(function(*case.given(values))), case.numbers(values)
        flows = [
            float(np.sum(values[f"q_{p.name}"] if p.role == "gives" else expected[f"q_{p.name}"]))
            for p in case.cls.ports() if p.domain is HYDRAULIC and p.role != "reads"
        ]  # fmt: skip
        kept = abs(found - sum(flows)) <= 1e-9 * (sum(abs(f) for f in flows) + 1e-12)
        _require(kept, f"{case.name}: {case.stored[0]} grows by {found:g} m^3/s, but {sum(flows):g} m^3/s flow in")


def _rate(case: Case, symbols: list[ca.SX], value: ca.SX) -> ca.SX:
    """d(value)/dt along the equations; a chamber's volume and a position or angle go with rates of their own."""
    made, u = case.made, symbols[4]
    rate = ca.jtimes(value, symbols[1], made.derivative(*symbols))
    for name, _ in made.inputs.slots:
        variable, _, port = name.partition("_")
        rates = {"V": "dV", "x": "v", "phi": "omega"}.get(variable)
        if rates is not None and f"{rates}_{port}" in made.inputs.offsets:
            here, there = list(made.inputs.indices(name)), list(made.inputs.indices(f"{rates}_{port}"))
            rate += ca.mtimes(ca.jacobian(value, u[here]), u[there])
    return rate


def _switched(case: Case) -> Iterator[Values]:
    """Points at which signals without a unit, which may switch something, are 0 or 1."""
    switches = [p.name for p in case.cls.ports() if p.domain is SIGNAL and case.quantities.get(p.name) is units.ratio]
    for seed in range(5):
        values = case.point(seed)
        yield values | {name: np.full_like(values[name], float(seed % 2)) for name in set(switches) - set(case.within)}


ROUNDING = 1e-7
"""Share of the power passing that the ledger of energy may err by at a point."""


def check_energy(case: Case) -> None:
    """What enters is stored, supplied from outside or lost: dE/dt = sum P + P_s - P_d; and losses are not negative.

    Where a piston's volume is converted to mass at one density, without a store for what the fluid is compressed by, as
    much as p/beta of the power may seem to come from nowhere. Losses of parts that store a
    fluid's energy may have either sign: a line books there what its momentum leaves out, v/a of the motion's power.
    """
    made, symbols = case.made, case.symbols()
    energy, loss, supply, entering, size = ca.vertsplit(made.books(*symbols))
    function = ca.Function("e", symbols, [ca.vertcat(_rate(case, symbols, energy), loss, supply, entering, size)])
    domains = {p.domain for p in power_ports(case.cls)}
    converts, in_fluid = TRANSLATIONAL in domains, HYDRAULIC in domains and bool(case.stored)
    zero: Any = 0.0
    compressed = USUAL_PRESSURE / case.fluid.bulk_modulus(zero) if converts and case.fluid is not None else 0.0
    for values in _switched(case):
        rate, lost, supplied, into, passing = np.array(function(*case.given(values))).ravel()
        told = f"{case.name}: {into:g} W enter and {supplied:g} W are supplied"
        kept = abs(rate - (into + supplied - lost)) <= ROUNDING * passing + 1e-12
        _require(bool(kept), f"{told}, but {rate:g} W are stored and {lost:g} W lost")
        kept = in_fluid or lost >= -(ROUNDING + compressed) * passing - 1e-12
        _require(bool(kept), f"{told}, and {lost:g} W lost: heat does no work")


def check_reaction(case: Case) -> None:
    """A part between two bodies pushes them apart with equal and opposite forces or torques."""
    first, second = (f"{p.domain.through[0][0]}_{p.name}" for p in power_ports(case.cls))
    for values in _switched(case):
        returned = case.numbers(values)
        here, there = (np.atleast_1d(np.asarray(returned[name], dtype=float)) for name in (first, second))
        told = f"{case.name}: {first} is {here}, {second} {there}; their sum must be 0"
        _require(bool(np.all(abs(here + there) <= 1e-12 * abs(here))), told)


def check_restriction(case: Case, backwards: Backwards = "equal") -> None:
    """A restriction keeps nothing: q_a + q_b = 0; with its pressures exchanged it passes what ``backwards`` says."""
    if backwards not in get_args(Backwards):
        raise ArgumentError(f"backwards={backwards!r}: write one of {', '.join(map(repr, get_args(Backwards)))}")
    a, b = (p for p in case.cls.ports() if p.domain is HYDRAULIC)
    for seed in range(3):
        values = case.point(seed)
        there, out = _flows(case, values, (a, b))
        values[f"p_{a.name}"], values[f"p_{b.name}"] = values[f"p_{b.name}"], values[f"p_{a.name}"]
        back, _ = _flows(case, values, (a, b))
        told = f"{case.name}: q_{a.name} is {there} m^3/s"
        _require(_near(there, -out, 1e-12), f"{told}, q_{b.name} {out}; their sum must be 0")
        told = f"{told}, with the pressures exchanged {back}"
        if backwards == "nothing":
            kept = bool(np.all(np.minimum(there, back) == 0))
            _require(kept, f"{told}; nothing may pass backwards, forwards it is positive")
        elif backwards == "unequal":
            kept = bool(np.all(there * back < 0) and np.all(abs(there + back) > 1e-3 * abs(back)))
            _require(kept, f"{told}; the signs must differ, and the sizes by more than 0.1 %")
        else:
            advice = "if that is meant, check with backwards='unequal' or 'nothing'"
            _require(_near(back, -there, 1e-9), f"{told}; it must be the opposite; {advice}")


def _flows(case: Case, values: Values, ports: Sequence[Port]) -> list[np.ndarray]:
    returned = case.numbers(values)
    return [np.atleast_1d(np.asarray(returned[f"q_{p.name}"], dtype=float)) for p in ports]


def _near(found: np.ndarray, wanted: np.ndarray, share: float) -> bool:
    """Equal to a share of the size wanted, or to 1e-12 m^3/s, below anything that counts as flow."""
    return bool(np.all(abs(found - wanted) <= np.maximum(share * abs(wanted), 1e-12)))
