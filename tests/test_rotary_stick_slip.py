"""Rotors that stick: held exactly, reversal, brakes applied and released."""

import numpy as np
import pytest
from building import circuit, fired
from crescentlab.components.rotary_stick_slip import FrictionBrake

SOLVERS = ["lsoda", "rodas", "dopri"]
BRAKE = {"type": "friction_brake", "inertia": "2 kg m2", "coulomb_friction": "10 N m", "static_friction": "12 N m"}


def braked(application, torque, solver="lsoda", stop="10 s", **start):
    """A brake under a constant torque, applied as a signal says."""
    parts = {
        "rotor": {**BRAKE, "start": start},
        "load": {"type": "torque_source", "torque": torque},
        "pedal": application,
    }
    nets = {"a": ["rotor.shaft", "load.shaft"], "p": ["pedal.y", "rotor.application"]}
    return circuit(components=parts, nets=nets, simulation={"stop": stop}).simulate(solver=solver, rtol=1e-8)


def test_static_friction_is_the_larger():
    """As the circuit's reader says."""
    with pytest.raises(ValueError, match=r"static_friction \(5 N m\) must be at least coulomb_friction \(6 N m\)"):
        FrictionBrake(inertia=1.0, coulomb_friction=6.0, static_friction=5.0)


@pytest.mark.parametrize("torque", ["11.9 N m", "-11.9 N m"])
def test_it_holds_without_creeping(torque):
    """Not by one bit of its angle, just below its static friction; friction balances the load."""
    run = braked({"type": "constant", "value": "1"}, torque)
    assert np.all(run["rotor.phi"] == 0.0)
    assert np.all(run["rotor.sticking"][run.time > 0] == 1.0)
    assert run["rotor.friction"][-1] == -float(torque.split()[0])


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("sign", [1, -1])
def test_it_stops_and_turns_back_under_a_load_that_it_cannot_hold(solver, sign):
    """20 N m against a rotor at 30 rad/s: down by 15 rad/s^2 to rest at 2 s, at once back by 5 rad/s^2."""
    run = braked({"type": "constant", "value": "1"}, f"{-20 * sign} N m", solver, "4 s", omega=f"{30 * sign} rad/s")
    assert fired(run, "rotor.stops") == pytest.approx([2.0], abs=1e-7)
    assert run["rotor.omega"][-1] == pytest.approx(-10.0 * sign, rel=1e-6)
    assert run["rotor.phi"][-1] == pytest.approx(sign * (30.0 - 10.0), rel=1e-6)


def test_pressed_harder_it_brakes_harder():
    """The friction grows with the application, beyond 1 too."""
    run = braked({"type": "constant", "value": "3"}, "0 N m", stop="1 s", omega="100 rad/s")
    assert run["rotor.omega"][-1] == pytest.approx(100 - 15.0, rel=1e-7)


@pytest.mark.parametrize("value", ["0", "-1"])
def test_released_it_is_an_inertia(value):
    """No friction at 0 and none below: 4 N m turn it by 2 rad/s^2, through rest."""
    run = braked({"type": "constant", "value": value}, "4 N m", stop="2 s", omega="-1 rad/s")
    assert run["rotor.omega"][-1] == pytest.approx(3.0, rel=1e-7)
    assert run.balance.energy.dissipated.get("rotor", 0.0) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("solver", SOLVERS)
def test_applied_and_released_again_and_again(solver):
    """4 N m and a brake on for half of every second: 1 rad/s more by 0.5 s, gone by 3 rad/s^2 at 5/6 s, then held."""
    run = braked({"type": "pulse", "high": "1", "width": "0.5 s", "period": "1 s", "at": "0.5 s"}, "4 N m", solver)
    assert fired(run, "rotor.stops") == pytest.approx([k + 0.5 + 1 / 3 for k in range(10)], abs=1e-7)
    assert fired(run, "rotor.breaks_away_up") == pytest.approx(list(range(11)), abs=1e-7)
    assert run["rotor.phi"][-1] == pytest.approx(10 * (0.25 + 1 / 6), rel=1e-6)
    energy = run.balance.energy
    assert energy.supplied["load"] == pytest.approx(4 * 10 * (0.25 + 1 / 6), rel=1e-6)
    assert energy.dissipated["rotor"] == pytest.approx(10 * 10 / 6, rel=1e-6)
