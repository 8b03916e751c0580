"""Units of the quantities: values by definition, gauge and absolute pressures, what is said of wrong ones."""

from __future__ import annotations

import math

import pytest
from refusing import STOP, Refusal, edited

from crescentlab import units
from crescentlab.errors import UnitError

INCH, FOOT, POUND, GRAVITY = 0.0254, 0.3048, 0.45359237, 9.80665
"""Exact by definition: the international yard and pound (1959), the standard acceleration of gravity."""
POUND_FORCE = POUND * GRAVITY
REVOLUTION = 2 * math.pi


@pytest.mark.parametrize(
    ("quantity", "text", "value"),
    [
        ("pressure", "3 barg", 3e5),
        ("pressure", "3 bara", 3e5 - 101325),
        ("pressure", "100 psig", 100 * POUND_FORCE / INCH**2),
        ("pressure", "14.695948775513 psia", 0.0),
        ("pressure", "2 kgf/cm2", 2 * GRAVITY * 1e4),
        ("pressure_difference", "10 mH2O", 1e4 * GRAVITY),
        ("displacement", "1.22 in3/rev", 19.992e-6 / REVOLUTION),  # 19.992 cc/rev
        ("flow", "1 in3/s", INCH**3),
        ("flow", "1 ft3/min", FOOT**3 / 60),
        ("flow", "10 GPM", 10 * 231 * INCH**3 / 60),
        ("velocity", "2 ft/s", 2 * FOOT),
        ("velocity", "2 in/s", 2 * INCH),
        ("torque", "10 lbf ft", 10 * POUND_FORCE * FOOT),
        ("torque", "10 lbf in", 10 * POUND_FORCE * INCH),
        ("inertia", "3 lb ft2", 3 * POUND * FOOT**2),
        ("inertia", "1 slug ft2", POUND_FORCE * FOOT),  # a slug is lbf s^2/ft
        ("mass", "5 lb", 5 * POUND),
        ("stiffness", "7 lbf/in", 7 * POUND_FORCE / INCH),
        ("density", "62.4 lb/ft3", 62.4 * POUND / FOOT**3),
        ("temperature", "68 degF", 293.15),
    ],
)
def test_gauge_and_us_units(quantity: str, text: str, value: float):
    """From the definitions of inch, pound and standard gravity; 1 atm = 101325 Pa; 68 degF = 20 degC."""
    tolerance = 1e-4 if quantity == "displacement" else 1e-9
    assert units.quantity_named(quantity).parse(text) == pytest.approx(value, rel=tolerance, abs=1e-6)


@pytest.mark.parametrize(
    ("quantity", "text", "said"),
    [
        ("volume", "0.001", "'0.001': a volume needs a unit: 0.001 m3, 1 L or 1000 cm3?"),
        ("pressure", "5", "a pressure needs a unit: 5e-05 bar, 0.005 kPa or 5 Pa?"),
        ("speed", "100", "a speed needs a unit: 15.9155 rev/s, 100 rad/s or 954.93 rpm?"),
        ("pressure", "3 brag", "unknown unit 'brag' for a pressure: did you mean barg or bara or bar?"),
        ("pressure", "3 PSI", "unknown unit 'PSI' for a pressure: did you mean psi?"),
        ("flow", "3 Gpm", "unknown unit 'Gpm' for a flow: did you mean gpm or GPM?"),
        ("area", "5 mm", "'mm' is a unit of length, not of area: did you mean mm2"),
        ("speed", "33 Hz", "'Hz' is a unit of frequency, not of speed; write one of rpm, rad/s"),
        ("pressure_difference", "3 bara", "'bara' is a unit of pressure, not of pressure difference: did you mean bar"),
    ],
)
def test_wrong_and_missing_units(quantity: str, text: str, said: str):
    """A number alone is taken as SI and shown in three units, so that nobody is led to a wrong one."""
    with pytest.raises(UnitError) as caught:
        units.quantity_named(quantity).parse(text)
    assert said in caught.value.message


def test_differences_have_no_zero_of_their_own():
    """A difference of absolute pressures is one of gauge ones; 9 degF are 5 K."""
    for quantity, text, said in (("pressure", "2 bara", "write 2 bar"), ("temperature", "9 degF", "write 5 K")):
        with pytest.raises(UnitError, match=said):
            units.quantity_named(quantity).check_difference(text)


def test_check_says_that_pressures_are_gauge(refused: Refusal):
    """The absolute pressure is read as a gauge one, and `check` says what it came to."""
    refused.write({"a.yaml": edited(("start: {p: 1 bar}", "start: {p: 3 bara}"), (STOP, "simulation: {stop: 1 ms}"))})
    code, out, _ = refused.run("check", "a.yaml")
    assert code == 0
    assert "3 bara is 1.98675 bar: pressures are gauge, above 1.01325 bar absolute" in " ".join(out.split())
