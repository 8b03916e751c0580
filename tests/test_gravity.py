"""Weight: signs, slopes, potential energy."""

import pytest
from building import circuit
from crescentlab.components.gravity import GravityForce

from crescentlab.analysis.steady import steady


@pytest.mark.parametrize(("angle", "share"), [("90 deg", 1), ("0 deg", 0), ("-90 deg", -1), ("30 deg", 0.5)])
def test_a_weight_pulls_down(angle, share):
    """Towards -x where +x rises; energy grows as x rises."""
    now = GravityForce(mass="10 kg", angle=angle).equations(x_rod=2.0)
    assert now["f_rod"] == pytest.approx(98.0665 * share)
    assert now["stored_energy"] == pytest.approx(2 * 98.0665 * share)


def test_slopes_beyond_the_vertical_are_refused():
    """They are those of -x."""
    with pytest.raises(ValueError, match="less than or equal to"):
        GravityForce(mass="10 kg", angle="100 deg")


def test_a_load_rests_on_its_spring():
    """m g = k x."""
    parts = {
        "load": {"type": "mass", "mass": "10 kg"},
        "weight": {"type": "gravity_force", "mass": "10 kg"},
        "spring": {"type": "spring", "stiffness": "10 N/mm"},
    }
    rest = steady(circuit(components=parts, nets={"b": ["load.port", "weight.rod", "spring.rod"]}))
    assert rest.result["load.x"][0] == pytest.approx(-98.0665 / 10e3)


def test_falling_keeps_the_energy():
    """What the weight gives the mass has: the ledger's sum of 1e-7 of it, and nothing is supplied or lost."""
    parts = {"load": {"type": "mass", "mass": "2 kg"}, "weight": {"type": "gravity_force", "mass": "2 kg"}}
    nets = {"b": ["load.port", "weight.rod"]}
    run = circuit(components=parts, nets=nets, simulation={"stop": "1 s"}).simulate(rtol=1e-9)
    assert run["load.kinetic_energy"][-1] == pytest.approx(9.80665**2, rel=1e-7)
    assert run["load.kinetic_energy"][-1] + run["weight.stored_energy"][-1] == pytest.approx(0.0, abs=1e-5)
    energy = run.balance.energy
    assert not any(energy.supplied.values())
    assert not any(energy.dissipated.values())
    assert abs(energy.stored) < 1e-5
