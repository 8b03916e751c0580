"""One contract for every component class of the library: each test runs over all of them."""

from __future__ import annotations

import inspect

import casadi as ca
import numpy as np
import pytest

from crescentlab import units
from crescentlab.component import Component, field_quantity
from crescentlab.domain import HYDRAULIC, Held, Observable, State
from crescentlab.fluid import Fluid
from crescentlab.library import installed
from crescentlab.tables import Curve
from crescentlab.trace import Trace, fluids_asked, numeric_fields, trace

LIBRARY = installed()
FORMS = {f.type_name(): f for cls in LIBRARY.components.values() for f in cls.forms()}
FLUIDS = {
    "simple_oil": {"density": 860.0, "kinematic_viscosity": 35e-6, "bulk_modulus": 1.4e9},
    "aerated_oil": {
        "density": 860.0, "kinematic_viscosity": 35e-6, "bulk_modulus": 1.4e9, "air_fraction": 0.005,
        "saturation_pressure": 1e8,
    },
}  # fmt: skip
SETTINGS: dict[str, dict[str, object]] = {
    "table": {"curve": Curve(x=(0.0, 1.0, 3.0), y=(0.0, 2.0, 1.0))},
    "time_table": {"curve": Curve(x=(0.0, 1.0, 3.0), y=(0.0, 2.0, 1.0), x_quantity="time")},
    "compliant_capacity": {
        "deflection": Curve(x=(0.0, 3e5, 8e5), y=(0.0, 16e-6, 44e-6), x_quantity="pressure", y_quantity="length")
    },
    "carry_over_chain": {"volumes": 2, "pitch": 0.5, "extension": 1.2},
    "crescent_gears": {},
    **{
        f"lax_wendroff_line_{a}_{b}": {"diameter": 12e-3, "length": 0.72, "max_pressure": 1e6}
        for a in ("takes", "gives")
        for b in ("takes", "gives")
    },
    **{
        f"{line}_line_{a}_{b}": {
            "diameter": 12e-3, "length": 0.72, "friction_terms": 2, "wall_thickness": 1e-3, "youngs_modulus": 2e11, **settings,
        }
        for line, settings in (("distributed", {"cells": 3}), ("transmission", {"lumps": 2, "mean_pressure": 3e5}))
        for a in ("takes", "gives")
        for b in ("takes", "gives")
    },
    "mass_with_stops": {"low": 0.0, "high": 4e-3},
    "pulse": {"period": 1.0, "width": 0.5},
    "axial_face_gap": {"inner_diameter": 10e-3, "outer_diameter": 20e-3},
    "ball_poppet": {"ball_diameter": 2e-3},
    "sudden_contraction": {"wide_diameter": 2e-3},
    "sudden_expansion": {"wide_diameter": 2e-3},
}
"""What a class needs beyond one nominal value per required field."""
ONE_WAY = {"check_valve", "ideal_check_valve"}
"""Restrictions that pass nothing backwards."""
UNEQUAL = {"sudden_contraction", "sudden_expansion"}
"""Restrictions that resist another way backwards."""


def fluid(name: str) -> Fluid:
    """A fluid of the library with the numbers of the crescent pump's oil."""
    return LIBRARY.fluids[name](**FLUIDS[name])


def sample(cls: type[Component]) -> Component:
    """An instance with every required field at its quantity's usual size."""
    values = dict(SETTINGS.get(cls.type_name(), {}))
    for name, field in cls.model_fields.items():
        if field.is_required() and name not in values:
            quantity = field_quantity(field)
            values[name] = quantity.nominal if quantity else 1.0
    return cls(**values)


def point(made: Trace, component: Component, seed: int) -> dict[str, np.ndarray]:
    """Random admissible states, held values and inputs, of the size their quantities usually have."""
    random = np.random.default_rng(seed)
    cls = type(component)
    quantities = {d.name: component.quantity(d.quantity) for kind in (State, Held) for d in cls.declared(kind)}
    quantities |= {name: component.quantity(q) for port in cls.ports() for name, q in port.inputs()}

    def draw(name: str, n: int | None) -> np.ndarray:
        quantity = quantities[name]
        if quantity is units.time:  # of a line's last tick, shortly before now
            return np.array([0.3 - random.uniform(0.0, 5e-5)])
        size = 4e5 if quantity is units.pressure else quantity.nominal
        low = 0.2 if name.startswith("V_") else -0.2 if quantity is units.pressure else -1.0
        return size * random.uniform(low, 1.0, 1 if n is None else n)

    found = {name: draw(name, n) for layout in (made.states, made.inputs) for name, n in layout.slots}
    for name, n in made.held.slots:
        whole = {h.name: h for h in cls.declared(Held)}[name].quantity is units.ratio
        found[name] = random.integers(-1, 2, 1 if n is None else n).astype(float) if whole else draw(name, n)
    return found


def flat(layout: object, values: dict[str, np.ndarray]) -> np.ndarray:
    parts = [values[name] for name, _ in layout.slots]  # type: ignore[attr-defined]
    return np.concatenate(parts) if parts else np.zeros(0)


def arguments(
    made: Trace, component: Component, oil: Fluid, values: dict[str, np.ndarray], bits: np.ndarray
) -> list[np.ndarray]:
    """Arguments of a trace's functions."""
    p = np.array([getattr(component, n) for n in made.parameters])
    pf = np.array([getattr(oil, n) for _ in made.fluids for n in numeric_fields(type(oil), oil)])
    return [np.array(0.3), flat(made.states, values), flat(made.held, values), bits, flat(made.inputs, values), p, pf]


def settled_bits(made: Trace, component: Component, oil: Fluid, values: dict[str, np.ndarray]) -> np.ndarray:
    """Bits that say the truth at the point, as plain floats would decide."""
    bits = np.zeros(len(made.relations))
    strict = np.array([r.strict for r in made.relations], dtype=bool)
    for _ in range(len(bits) + 1):
        g = np.array(made.relation(*arguments(made, component, oil, values, bits)))
        bits = ((g[:, 0] > 0) | ((g[:, 0] == 0) & ~strict)).astype(float) if len(bits) else bits
    return bits


def numbers(component: Component, made: Trace, oil: Fluid, values: dict[str, np.ndarray]) -> dict[str, object]:
    """What equations return on floats at the point."""
    known: dict[str, object] = {"t": 0.3, **dict.fromkeys(made.fluids, oil)}
    for layout in (made.states, made.held, made.inputs):
        known |= {name: float(values[name][0]) if n is None else values[name] for name, n in layout.slots}
    with np.errstate(all="ignore"):
        return component.equations(**{n: known[n] for n in type(component).asks_for()})


@pytest.fixture(params=sorted(FORMS))
def cls(request: pytest.FixtureRequest) -> type[Component]:
    return FORMS[request.param]


@pytest.fixture(params=sorted(FLUIDS))
def oil(request: pytest.FixtureRequest) -> Fluid:
    return fluid(request.param)


def traced(component: Component, oil: Fluid) -> Trace:
    return trace(component, dict.fromkeys(fluids_asked(type(component)), oil))


def test_documented(cls: type[Component]) -> None:
    """Docstring with equation, unit and source; a meaning for every parameter, port, state and observable."""
    text = inspect.getdoc(cls) or ""
    family = next((inspect.getdoc(b) or "" for b in cls.__mro__ if getattr(b, "family", False)), "")
    assert ".. math::" in text + family
    assert "[" in text
    assert "Source:" in text
    assert "\f" not in text  # a docstring that should be raw
    for name, field in cls.model_fields.items():
        assert field.description, name
    for declared in (*cls.ports(), *cls.declared(State), *cls.declared(Held), *cls.declared(Observable)):
        assert declared.description, declared.name


def test_floats_equal_symbols(cls: type[Component], oil: Fluid) -> None:
    """The traced equations give what the same text gives on plain floats, at random admissible points."""
    component = sample(cls)
    made = traced(component, oil)
    for seed in range(5):
        values = point(made, component, seed)
        bits = settled_bits(made, component, oil, values)
        given = arguments(made, component, oil, values, bits)
        expected = numbers(component, made, oil, values)
        for layout, function, prefix in (
            (made.states, made.derivative, "der_"),
            (made.observables, made.observable, ""),
        ):
            got = np.array(function(*given)).ravel()
            for name, _ in layout.slots:
                want = np.atleast_1d(np.asarray(expected[prefix + name], dtype=float))
                np.testing.assert_allclose(got[list(layout.indices(name))], want, rtol=1e-9, atol=1e-300, err_msg=name)
        for group in made.groups:
            got = np.array(group.function(*given)).ravel()
            want = np.concatenate(
                [
                    np.broadcast_to(np.atleast_1d(np.asarray(expected[n], float)), (1 if k is None else k,))
                    for n, k in made.outputs.slots
                ]
            )
            np.testing.assert_allclose(got, want[list(group.outputs)], rtol=1e-9, atol=1e-300)


def test_jacobian_is_finite(cls: type[Component], oil: Fluid) -> None:
    """No derivative is infinite or not a number: at random points, at rest, and with everything at zero drop."""
    component = sample(cls)
    made = traced(component, oil)
    symbols = [ca.SX.sym(f"a{k}", made.derivative.size1_in(k)) for k in range(made.derivative.n_in())]
    values_of = [made.derivative(*symbols), *[g.function(*symbols) for g in made.groups]]
    columns = ca.vertcat(symbols[1], symbols[4])
    jacobian = ca.Function("j", symbols, [ca.jacobian(ca.vertcat(*values_of), columns)])
    for seed in range(4):
        values = point(made, component, seed)
        if seed == 3:
            values = {n: v if n.startswith("V_") else np.zeros_like(v) for n, v in values.items()}
        bits = settled_bits(made, component, oil, values)
        assert np.isfinite(np.array(jacobian(*arguments(made, component, oil, values, bits)))).all(), values


def test_content_rate_is_the_sum_of_flows(cls: type[Component], oil: Fluid) -> None:
    """d(content)/dt along the equations equals the sum of the hydraulic flows: what enters is stored.

    The rate of the chamber's volume enters with its own dV; parts whose content changes by held values only (a
    line between ticks) keep it through their states.
    """
    component = sample(cls)
    stored = [o.name for o in cls.declared(Observable) if o.stored]
    if not stored:
        pytest.skip("stores no fluid")
    made = traced(component, oil)
    symbols = [ca.SX.sym(f"a{k}", made.derivative.size1_in(k)) for k in range(made.derivative.n_in())]
    content = made.observable(*symbols)[list(made.observables.indices(stored[0]))]
    rate = ca.jtimes(content, symbols[1], made.derivative(*symbols))
    for name, _ in made.inputs.slots:
        if name.startswith("V_"):
            k = made.inputs.offsets[name][0]
            rate += ca.jacobian(content, symbols[4][k]) * symbols[4][made.inputs.offsets[name.replace("V_", "dV_")][0]]
    function = ca.Function("rate", symbols, [rate])
    for seed in range(5):
        values = point(made, component, seed)
        if "exists" in values:
            values["exists"][:] = float(seed % 2)
        bits = settled_bits(made, component, oil, values)
        given = arguments(made, component, oil, values, bits)
        expected = numbers(component, made, oil, values)
        flows = [
            np.sum(values[f"q_{p.name}"] if p.role == "gives" else expected[f"q_{p.name}"])
            for p in cls.ports() if p.domain is HYDRAULIC and p.role != "reads"
        ]  # fmt: skip
        scale = sum(abs(f) for f in flows) + 1e-12
        assert float(function(*given)) == pytest.approx(sum(flows), abs=1e-9 * scale)


def test_two_ports_pass_what_enters(cls: type[Component], oil: Fluid) -> None:
    """A restriction keeps nothing: q_a + q_b = 0; with its pressures exchanged the flow turns round, or stops."""
    takers = [p for p in cls.ports() if p.domain is HYDRAULIC and p.role == "takes"]
    moving = any(p.domain.name in ("translational", "rotational") for p in cls.ports())
    if len(takers) != 2 or moving or cls.declared(State) or len([p for p in cls.ports() if p.domain is HYDRAULIC]) != 2:
        pytest.skip("not a restriction between two nets")
    component = sample(cls)
    made = traced(component, oil)
    for seed in range(3):
        values = point(made, component, seed)
        there = numbers(component, made, oil, values)
        values["p_a"], values["p_b"] = values["p_b"], values["p_a"]
        back = numbers(component, made, oil, values)
        assert there["q_a"] == pytest.approx(-there["q_b"], rel=1e-12)
        if cls.type_name() in ONE_WAY:
            assert min(there["q_a"], back["q_a"]) == 0
        elif cls.type_name() in UNEQUAL:
            assert there["q_a"] * back["q_a"] < 0
            assert abs(there["q_a"] + back["q_a"]) > 1e-3 * abs(back["q_a"])
        else:
            assert back["q_a"] == pytest.approx(-there["q_a"], rel=1e-9)
