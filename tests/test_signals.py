"""Signals against their definitions, and the quantities they carry."""

import math

import numpy as np
import pytest
from crescentlab.components.signals import (
    Constant,
    Gain,
    Product,
    Pulse,
    Ramp,
    Sine,
    Step,
    Sum,
    Table,
    TimeTable,
)

from crescentlab.maths import Event

BAR, LPM = 1e5, 1e-3 / 60


def carried(part):
    """Names of the quantities of a part's ports by port."""
    return {port.name: part.quantity(port.quantity).name for port in part.ports()}


@pytest.mark.parametrize(
    ("value", "si", "quantity"),
    [("3 bar", 3e5, "pressure"), ("30 L/min", 5e-4, "flow"), ("2", 2.0, "ratio"), ("2000 rpm", 209.4395, "speed")],
)
def test_the_unit_names_the_quantity(value, si, quantity):
    """A value's unit is enough to tell the quantity."""
    part = Constant(value=value)
    assert part.equations()["y"] == pytest.approx(si, rel=1e-6)
    assert carried(part) == {"y": quantity}


def test_output_quantity_decides_between_owners_of_a_unit():
    """1/min is a speed unless a frequency is asked for; an SI number takes the quantity named."""
    assert Constant(value="60 1/min", output_quantity="frequency").value == pytest.approx(1.0)
    assert Constant(value="60 1/min").value == pytest.approx(2 * math.pi)
    assert carried(Constant(value=3e5, output_quantity="pressure")) == {"y": "pressure"}


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"after": "5 bar", "before": "1 mm"}, "'mm' is a unit of length, not of pressure"),
        ({"after": "5 baar"}, "unknown unit 'baar'"),
        ({"after": "5 bar", "output_quantity": "presure"}, "did you mean pressure"),
    ],
)
def test_wrong_units_are_explained(given, text):
    """The message names the unit and what is accepted."""
    with pytest.raises(ValueError, match=text):
        Step(**given)


def test_step():
    """The value after holds from the instant of the step on."""
    step = Step(before="1 bar", after="5 bar", at="10 ms")
    assert [step.equations(t=t)["y"] for t in (0.0, 0.0099, 0.01, 1.0)] == [1e5, 1e5, 5e5, 5e5]


def test_ramp():
    """Linear between its corners, constant outside."""
    ramp = Ramp(before="2 bar", after="4 bar", at="1 s", duration="2 s")
    assert [ramp.equations(t=t)["y"] for t in (0.0, 1.0, 2.0, 3.0, 9.0)] == pytest.approx([2e5, 2e5, 3e5, 4e5, 4e5])


def test_sine():
    """mean + amplitude sin(2 pi f t + phase)."""
    sine = Sine(mean="5 bar", amplitude="1 bar", frequency="50 Hz", phase="90 deg")
    assert [sine.equations(t=t)["y"] for t in (0.0, 0.005, 0.01)] == pytest.approx([6e5, 5e5, 4e5])


def test_single_pulse():
    """High for its width, once; no event beside its edges."""
    pulse = Pulse(high="5 bar", at="1 s", width="1 s")
    found = [pulse.equations(t=t, begun=1.0) for t in (0.0, 1.0, 1.999, 2.0, 9.0)]
    assert [f["y"] for f in found] == [0, 5e5, 5e5, 0, 0]
    assert all(set(f) == {"y"} for f in found)


def test_repeated_pulse():
    """The begin moves on by one period each time it has passed."""
    pulse = Pulse(high=1.0, at="1 s", width="1 s", period="4 s")
    event = pulse.equations(t=4.9, begun=1.0)["again"]
    assert isinstance(event, Event)
    assert not event.condition
    assert event.then == {"begun": 5.0}
    assert pulse.equations(t=5.0, begun=1.0)["again"].condition
    assert [pulse.equations(t=t, begun=5.0)["y"] for t in (4.9, 5.0, 5.9, 6.0)] == [0, 1, 1, 0]


def test_tables_carry_the_quantities_of_their_columns():
    """Linear between points, continued beyond them: 16 um at 3 bar, 44 um at 8 bar, on to 55.2 um at 10 bar."""
    table = Table(curve={"x": ["0 bar", "3 bar", "8 bar"], "y": ["0 mm", "0.016 mm", "0.044 mm"]})
    assert carried(table) == {"u": "pressure", "y": "length"}
    found = [table.equations(u=p * BAR)["y"] for p in (1.5, 3, 5.5, 10)]
    assert found == pytest.approx([8e-6, 16e-6, 30e-6, 55.2e-6])
    course = TimeTable(curve={"x": ["0 s", "1 s", "2 s"], "y": ["0 L/min", "6 L/min", "0 L/min"]})
    assert carried(course) == {"y": "flow"}
    assert [course.equations(t=t)["y"] for t in (0.5, 1.0, 1.5)] == pytest.approx([5e-5, 1e-4, 5e-5])


def test_gain_turns_one_quantity_into_another():
    """5 bar per 1 mm."""
    gain = Gain(gain="5 bar", per="1 mm")
    assert carried(gain) == {"u": "length", "y": "pressure"}
    assert gain.equations(u=2e-3)["y"] == pytest.approx(10 * BAR)
    assert Gain(gain=-2).equations(u=3.0)["y"] == -6.0


def test_sum():
    """Offset plus weighted inputs; a difference; no inputs at all."""
    difference = Sum(weights=[1, -1], offset="1 bar")
    assert [difference.size_of(p.size) for p in difference.ports()] == [2, None]
    assert difference.equations(u=np.array([5e5, 2e5]))["y"] == 4e5
    assert Sum(weights=[]).equations(u=np.zeros(0))["y"] == 0.0


def test_product_checks_dimensions():
    """Pressure times flow is power: 100 bar and 6 L/min are 1 kW; a force it is not."""
    power = Product(first_quantity="pressure", second_quantity="flow", output_quantity="power")
    assert power.equations(u1=100 * BAR, u2=6 * LPM)["y"] == pytest.approx(1000.0)
    with pytest.raises(ValueError, match="pressure times flow is in W"):
        Product(first_quantity="pressure", second_quantity="flow", output_quantity="force")
