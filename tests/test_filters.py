"""Filters and check valves against their laws, written out, and against what makers' curves say of other oils."""

import math

import pytest
from building import circuit
from crescentlab.components.check_valves import CheckValve
from crescentlab.components.filters import Filter
from crescentlab.components.fluids import SimpleOil
from pydantic import ValidationError

BAR, LPM = 1e5, 1e-3 / 60
STIFF = SimpleOil(density=860.0, kinematic_viscosity=30e-6, bulk_modulus=1e15)
"""The oil of makers' curves: 30 cSt, 860 kg/m^3."""


def made(**changes):
    """0.02 bar/(L/min) of element and 1.5e-4 bar/(L/min)^2 of housing."""
    return Filter(**({"element": "0.02 bar/(L/min)", "housing": "1.5e-4 bar/(L/min)^2"} | changes))


def passed(part, drop, oil=STIFF):
    """Flow [L/min] at a drop [bar]."""
    return part.equations(p_a=drop * BAR, p_b=0.0, fluid=oil)["q"] / LPM


# -- filter ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("q", [0.01, 1.0, 30.0, 500.0])
def test_filter_gives_the_flow_of_its_drop(q):
    """Reference oil: 0.02 q + 1.5e-4 q^2 bar at q L/min, 0.735 bar at 30; both ways.

    1e-8 for the oil's compression, 24 bar in 1e10.
    """
    drop = 0.02 * q + 1.5e-4 * q * q
    assert passed(made(), drop) == pytest.approx(q, rel=1e-8)
    assert passed(made(), -drop) == pytest.approx(-q, rel=1e-8)


@pytest.mark.parametrize(("rho", "nu"), [(860.0, 7.5e-6), (790.0, 30e-6), (790.0, 7.5e-6), (880.0, 500e-6)])
def test_filter_with_another_oil(rho, nu):
    """ISO 3968 curves are carried over so: element with density and viscosity, housing with density; 1e-8."""
    oil = SimpleOil(density=rho, kinematic_viscosity=nu, bulk_modulus=1e15)
    drop = rho / 860 * (nu / 30e-6 * 0.02 * 28 + 1.5e-4 * 28**2)
    assert passed(made(), drop, oil) == pytest.approx(28, rel=1e-8)


def test_clogging_is_of_the_element_only():
    """Ten times the element's part at 30 L/min: 10 * 0.6 + 0.135 bar; 1e-8."""
    assert passed(made(clogging=10.0), 6.135) == pytest.approx(30, rel=1e-8)


def test_filter_without_housing_is_linear():
    """Darcy's law alone: q = drop/0.02, also next to zero drop; 1e-8."""
    part = made(housing="0 bar/(L/min)^2")
    for drop in (1e-12, 1e-3, 2.0, -2.0):
        assert passed(part, drop) == pytest.approx(drop / 0.02, rel=1e-8, abs=1e-15)


@pytest.mark.parametrize(
    "changes",
    [{"element": 0.0}, {"clogging": 0.0}, {"housing": -1.0}, {"reference_viscosity": 0.0}, {"element": "2 bar"}],
)
def test_filter_refuses_what_has_no_law(changes):
    """Resistances that would divide by zero or pump, and a pressure where a resistance belongs."""
    with pytest.raises(ValidationError):
        made(**changes)


# -- check valve -------------------------------------------------------------------------------------


def valve(**changes):
    """80 mm^2, from 1 bar on, fully open at 1.5 bar."""
    return CheckValve(**({"area": "80 mm2", "cracking_pressure": "1 bar", "opening_range": "0.5 bar"} | changes))


@pytest.mark.parametrize("drop", [-200.0, -1.0, 0.0, 0.5, 1.0])
def test_check_valve_is_shut_below_its_cracking_pressure(drop):
    """Exactly nothing, backwards too."""
    shut = valve().equations(p_a=drop * BAR, p_b=0.0, fluid=STIFF)
    assert (shut["q"], shut["lift"]) == (0, 0)


@pytest.mark.parametrize(("drop", "lift"), [(1.05, 0.1), (1.25, 0.5), (1.5, 1.0), (4.0, 1.0)])
def test_check_valve_opens_in_proportion(drop, lift):
    """q = 0.7 s A sqrt(2 dp/rho), s the share of the range; C_d(lambda) is at its end value to 1e-6."""
    found = valve().equations(p_a=(2 + drop) * BAR, p_b=2 * BAR, fluid=STIFF)
    assert found["lift"] == pytest.approx(lift, rel=1e-9)
    assert found["q"] == pytest.approx(0.7 * lift * 80e-6 * math.sqrt(2 * drop * BAR / 860), rel=1e-6)
    assert found["q_a"] == -found["q_b"] == found["q"]


def test_check_valve_that_is_small_is_laminar():
    """C_d = 0.7 tanh(2 lambda/100), lambda = d sqrt(2 dp/rho)/nu, d = 0.1 mm at half lift: 0.0358 of 0.7."""
    area = 2 * math.pi / 4 * 0.1e-3**2
    v = math.sqrt(2 * 1.25e5 / 860)
    cd = 0.7 * math.tanh(2 * 0.1e-3 * v / 30e-6 / 100)
    small = valve(area=area, parallel=3.0).equations(p_a=1.25e5, p_b=0.0, fluid=STIFF)
    assert small["q"] == pytest.approx(3 * cd * area / 2 * v, rel=1e-4)  # rounding of the diameter, (1 um/0.1 mm)^2/2


def test_filter_and_bypass_share_a_flow():
    """40 L/min through a clogged element, 20 times 0.02 bar/(L/min), beside the valve: continuity of both laws.

    At drop p [bar]: 0.4 q + 1.5e-4 q^2 = p for the element; 0.7 s A sqrt(2 p/rho) for the valve, s = (p - 1)/0.5.
    """
    element, housing, rest = "0.02 bar/(L/min)", "1.5e-4 bar/(L/min)^2", "0.5 bar"
    bench = circuit(
        components={
            "supply": {"type": "flow_source", "flow": "40 L/min"},
            "before": {"type": "capacity", "volume": "50 cm3"},
            "filter": {"type": "filter", "element": element, "housing": housing, "clogging": "20"},
            "bypass": {"type": "check_valve", "area": "80 mm2", "cracking_pressure": "1 bar", "opening_range": rest},
            "tank": {"type": "tank"},
        },
        nets={
            "p_in": ["supply.port", "before.port", "filter.a", "bypass.a"],
            "p_out": ["filter.b", "bypass.b", "tank.port"],
        },
        fluid={
            "type": "simple_oil", "density": "860 kg/m3", "kinematic_viscosity": "30 cSt", "bulk_modulus": "1e9 bar",
        },
    )  # fmt: skip
    result = bench.simulate("50 ms", solver="radau", rtol=1e-8)
    p = result["before.p"][-1] / BAR
    filtered = (-0.4 + math.sqrt(0.16 + 6e-4 * p)) / 3e-4
    bypass = 0.7 * 80e-6 * (p - 1) / 0.5 * math.sqrt(2 * p * BAR / 860) / LPM
    assert 1 < p < 1.5
    assert result["filter.q"][-1] / LPM == pytest.approx(filtered, rel=1e-6)
    assert result["bypass.q"][-1] / LPM == pytest.approx(bypass, rel=1e-5)
    assert filtered + bypass == pytest.approx(40, rel=1e-5)
