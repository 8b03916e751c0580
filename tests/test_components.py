"""One contract for every component class of the library: each test runs over all of them."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from pydantic import BeforeValidator

from crescentlab.commands.components import described, listed
from crescentlab.component import Component, field_quantity
from crescentlab.contract import (
    Backwards,
    Case,
    check_content,
    check_documented,
    check_energy,
    check_floats_equal_symbols,
    check_jacobian,
    check_reaction,
    check_restriction,
    sample,
)
from crescentlab.energy import keeps_books, power_ports
from crescentlab.fluid import Fluid
from crescentlab.library import installed
from crescentlab.tables import Curve

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
    "recorded_signal": {"file": str(Path(__file__).parent / "recorded.csv")},
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
        f"pipe_{a}_{b}": {"diameter": 12e-3, "length": 0.72}
        for a in ("inertial", "capacitive")
        for b in ("inertial", "capacitive")
    },
    **{
        f"{line}_line_{a}_{b}": {
            "diameter": 12e-3,
            "length": 0.72,
            "friction_terms": 2,
            "wall_thickness": 1e-3,
            "youngs_modulus": 2e11,
            **settings,
        }
        for line, settings in (("distributed", {"cells": 3}), ("transmission", {"lumps": 2, "mean_pressure": 3e5}))
        for a in ("takes", "gives")
        for b in ("takes", "gives")
    },
    "mass_with_stops": {"low": 0.0, "high": 4e-3},
    "stick_slip_mass_with_stops": {"high": 4e-3},
    "table2d": {"table": {"x": [0.0, 1.0, 3.0], "y": [0.0, 2.0], "z": [[0.0, 1.0], [2.0, 0.5], [1.0, 4.0]]}},
    "expression": {"formula": "u1 * sin(u2) + t / (1 s)", "inputs": ["ratio", "angle"]},
    "delay": {"samples": 3},
    "transfer_function": {"numerator": [2.0, 1.0], "denominator": [3.0, 2.0, 1.0]},
    **{key: {"integral_time": 0.3, "derivative_time": 0.1, "low": -1.0, "high": 0.5} for key in ("pid", "sampled_pid")},
    "crank": {"rod_length": 3e-3},
    "relay": {"upper": 0.5, "lower": -0.5},
    "external_gears": {"module": 1e-3, "dedendum": 1.25e-3},
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


WITHIN: dict[str, dict[str, tuple[float, float]]] = {
    "mass_with_stops": {"at": (0.0, 0.0)},
    "stick_slip_mass": {"direction": (1.0, 1.0), "v": (0.0, 1e-2)},
    "stick_slip_mass_with_stops": {"direction": (1.0, 1.0), "v": (0.0, 1e-2)},
    "stick_slip_inertia": {"direction": (1.0, 1.0), "omega": (0.0, 1.0)},
    "friction_brake": {"direction": (1.0, 1.0), "omega": (0.0, 1.0)},
    "piston_separator": {"pressure_a": (2e5, 2e5), "pressure_b": (2e5, 2e5)},
    "trapped_volume": {"exists": (1.0, 1.0)},
}
"""Where the ledger of energy holds.

A mass or rotor that rests does not move, and slides the way it goes; a piston between two fluids that is free has one
pressure on both sides; a volume that does not exist does not grow.
"""


def looked_at(name: str, liquid: str, within: dict[str, tuple[float, float]] | None = None) -> Case:
    """A component of the class with a fluid, and the points at which it is looked at."""
    return Case(sample(FORMS[name], SETTINGS.get(name)), fluid(liquid), within or {})


CASES = {(name, liquid): looked_at(name, liquid) for name in sorted(FORMS) for liquid in sorted(FLUIDS)}


def where(applies: Callable[[Case], bool]) -> pytest.MarkDecorator:
    """Every class with every fluid to which something applies."""
    found = [pytest.param(*key, id="-".join(key)) for key, case in CASES.items() if applies(case)]
    return pytest.mark.parametrize(("name", "liquid"), found)


@pytest.mark.parametrize("name", sorted(FORMS))
def test_documented(name: str) -> None:
    check_documented(FORMS[name])


@where(lambda case: True)
def test_floats_equal_symbols(name: str, liquid: str) -> None:
    check_floats_equal_symbols(CASES[name, liquid])


@where(lambda case: True)
def test_jacobian_is_finite(name: str, liquid: str) -> None:
    check_jacobian(CASES[name, liquid])


@where(lambda case: bool(case.stored))
def test_content_rate_is_the_sum_of_flows(name: str, liquid: str) -> None:
    check_content(CASES[name, liquid])


@where(lambda case: case.keeps_books)
def test_what_enters_is_stored_or_lost(name: str, liquid: str) -> None:
    check_energy(looked_at(name, liquid, WITHIN.get(name)))


@where(lambda case: case.between_bodies)
def test_reaction_is_equal_and_opposite(name: str, liquid: str) -> None:
    check_reaction(CASES[name, liquid])


@where(lambda case: case.restricts)
def test_two_ports_pass_what_enters(name: str, liquid: str) -> None:
    backwards: Backwards = "nothing" if name in ONE_WAY else "unequal" if name in UNEQUAL else "equal"
    check_restriction(CASES[name, liquid], backwards)


SILENT = ("lax_wendroff_line", "transmission_line")
"""Families that keep no books of energy: what their schemes lose has no closed expression."""


def test_power_is_accounted_for() -> None:
    """Every type through which power passes says what becomes of it, but for those that cannot."""
    silent = {name for name, form in FORMS.items() if power_ports(form) and not keeps_books(form)}
    assert silent == {name for name in FORMS if name.startswith(SILENT)}
    assert [name for name, form in FORMS.items() if keeps_books(form) and not power_ports(form)] == []


TYPES = listed(LIBRARY)
OF_ANY_SIGN = {
    "at", "change_factor", "clearance", "damping_length", "delivery_closes", "delivery_opens", "denominator", "end",
    "flow", "force", "free_length", "gap", "high", "jet_coefficient", "low", "mean_pressure", "numerator", "overlap",
    "phase", "position", "preload", "pressure", "seat_position", "share", "speed", "start_angle", "start_flow",
    "start_phase", "start_pressure", "suction_closes", "suction_opens", "surface_pressure", "torque", "velocity",
    "weights", "offset",
}  # fmt: skip
"""Positions, angles, gauge pressures, imposed values and starts, which may be anything."""


@pytest.mark.parametrize("name", listed(LIBRARY))
def test_parameters_have_unit_bound_and_meaning(name: str) -> None:
    """A number has a quantity, which brings its units, and a bound, unless it may be anything; all have a meaning.

    The values of signals are read with the units of the signal's quantity, which is a parameter itself.
    """
    for field, declared in TYPES[name].model_fields.items():
        assert declared.description, f"{field} has no description"
        quantity = field_quantity(declared)
        read = [m for m in declared.metadata if isinstance(m, BeforeValidator)]
        assert quantity is not None or declared.annotation is not float or read, f"{field} has no quantity"
        if quantity is not None and field not in OF_ANY_SIGN:
            assert any(hasattr(m, kind) for m in declared.metadata for kind in ("gt", "ge", "lt", "le")), field


@pytest.mark.parametrize("name", listed(LIBRARY))
def test_its_description_is_whole(name: str) -> None:
    """`crescentlab components TYPE` shows every parameter and port by its name."""
    cls = TYPES[name]
    shown = [declared.alias or field for field, declared in cls.model_fields.items()]
    ports = [p.name for p in cls.ports()] if issubclass(cls, Component) else []
    words = set(re.findall(r"\w+", described(name, cls).partition(inspect.cleandoc(cls.__doc__ or ""))[2]))
    assert {*shown, *ports} <= words
