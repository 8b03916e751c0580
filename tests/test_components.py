"""One contract for every component class of the library: each test runs over all of them."""

from __future__ import annotations

import pytest

from crescentlab.component import Component
from crescentlab.contract import (
    Backwards,
    Case,
    check_content,
    check_documented,
    check_floats_equal_symbols,
    check_jacobian,
    check_restriction,
    sample,
)
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
    "table2d": {"table": {"x": [0.0, 1.0, 3.0], "y": [0.0, 2.0], "z": [[0.0, 1.0], [2.0, 0.5], [1.0, 4.0]]}},
    "expression": {"formula": "u1 * sin(u2) + t / (1 s)", "inputs": ["ratio", "angle"]},
    "delay": {"samples": 3},
    "transfer_function": {"numerator": [2.0, 1.0], "denominator": [3.0, 2.0, 1.0]},
    **{key: {"integral_time": 0.3, "derivative_time": 0.1, "low": -1.0, "high": 0.5} for key in ("pid", "sampled_pid")},
    "crank": {"rod_length": 3e-3},
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


@pytest.fixture(params=sorted(FORMS))
def cls(request: pytest.FixtureRequest) -> type[Component]:
    return FORMS[request.param]


@pytest.fixture(params=sorted(FLUIDS))
def case(cls: type[Component], request: pytest.FixtureRequest) -> Case:
    """A component of the class with a fluid, and the points at which it is looked at."""
    return Case(sample(cls, SETTINGS.get(cls.type_name())), fluid(request.param))


def test_documented(cls: type[Component]) -> None:
    check_documented(cls)


def test_floats_equal_symbols(case: Case) -> None:
    check_floats_equal_symbols(case)


def test_jacobian_is_finite(case: Case) -> None:
    check_jacobian(case)


def test_content_rate_is_the_sum_of_flows(case: Case) -> None:
    if not case.stored:
        pytest.skip("stores no fluid")
    check_content(case)


def test_two_ports_pass_what_enters(case: Case) -> None:
    if not case.restricts:
        pytest.skip("not a restriction between two nets")
    name = case.cls.type_name()
    backwards: Backwards = "nothing" if name in ONE_WAY else "unequal" if name in UNEQUAL else "equal"
    check_restriction(case, backwards)
