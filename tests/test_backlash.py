"""Play between shafts: never pulls, keeps its books, loses motion on reversal."""

import numpy as np
import pytest
from building import circuit
from crescentlab.components.backlash import Backlash


def test_within_the_play_nothing_passes():
    """No torque within; beyond either flank as much, the other way."""
    play = Backlash(play=0.04, stiffness=1000.0)
    assert play.equations(twist=0.019, omega_a=5.0, omega_b=1.0)["torque"] == 0.0
    ahead = play.equations(twist=0.03, omega_a=5.0, omega_b=4.9)
    behind = play.equations(twist=-0.03, omega_a=4.9, omega_b=5.0)
    assert ahead["torque"] == -behind["torque"] > 10.0
    assert ahead["loss"] == pytest.approx(behind["loss"])


def test_flanks_never_pull():
    """However fast they part; what is stored in them is then lost."""
    play = Backlash(play=0.0, stiffness=1000.0, restitution=0.2, impact_speed=1.0)
    now = play.equations(twist=0.01, omega_a=-50.0, omega_b=0.0)
    assert now["torque"] == 0.0
    assert now["loss"] == pytest.approx(1000.0 * 0.01 * 50.0)


@pytest.mark.parametrize("solver", ["lsoda", "rodas", "dopri"])
def test_without_play_or_loss_it_is_an_elastic_shaft(solver):
    """The same twist and speeds, 1e-6 of their size for runs of 1e-8."""
    found = []
    for shaft in (
        {"type": "elastic_shaft", "stiffness": "300 N m/rad"},
        {"type": "backlash", "stiffness": "300 N m/rad", "play": "0 deg", "restitution": "1"},
    ):
        parts = {
            "one": {"type": "inertia", "inertia": "0.02 kg m2", "start": {"omega": "3 rad/s"}},
            "two": {"type": "inertia", "inertia": "0.03 kg m2"},
            "shaft": shaft,
        }
        nets = {"a": ["one.shaft", "shaft.a"], "b": ["two.shaft", "shaft.b"]}
        run = circuit(components=parts, nets=nets, simulation={"stop": "0.2 s"}).simulate(solver=solver, rtol=1e-8)
        found.append([run["shaft.twist"][-1] * 100, run["one.omega"][-1], run["two.omega"][-1]])
    assert found[0] == pytest.approx(found[1], abs=3e-6)


@pytest.mark.parametrize("solver", ["lsoda", "rodas", "dopri"])
def test_reversal_loses_the_play(solver):
    """A slow drive swings by +-0.5 rad, friction holds what it turns: that swings by 0.5 rad less half the play.

    Teeth give way by T_c/c = 0.2 mrad, on either side; the impacts carry the rotor on by less than that.
    """
    parts = {
        "turn": {"type": "sine", "amplitude": "0.5 rad/s", "frequency": "= 1 / (2 * pi * 1 s)", "phase": "90 deg",
                 "output_quantity": "speed"},
        "drive": {"type": "signal_speed_source"},
        "play": {"type": "backlash", "play": "0.2 rad", "stiffness": "5000 N m/rad"},
        "load": {"type": "stick_slip_inertia", "inertia": "1e-4 kg m2", "coulomb_friction": "1 N m",
                 "static_friction": "1 N m"},
    }  # fmt: skip
    nets = {"s": ["turn.y", "drive.speed"], "a": ["drive.shaft", "play.a"], "b": ["load.shaft", "play.b"]}
    run = circuit(components=parts, nets=nets, simulation={"stop": "13 s"}).simulate(solver=solver)
    later = run.time > 2.0
    assert np.ptp(run["load.phi"][later]) == pytest.approx(2 * 0.5 - 0.2, abs=1e-3)
    assert np.ptp(run["drive.phi"][later]) == pytest.approx(2 * 0.5, abs=1e-3)
    assert run.balance.energy.dissipated["play"] >= 0
    assert run.balance.energy.dissipated["load"] == pytest.approx(13 / (2 * np.pi) * 1.6, rel=0.1)


def test_it_keeps_its_books():
    """A rattling pair: what the rotors had is in them, in the flanks, or lost there; 1e-6 of it."""
    parts = {
        "one": {"type": "inertia", "inertia": "0.02 kg m2", "start": {"omega": "10 rad/s"}},
        "two": {"type": "inertia", "inertia": "0.03 kg m2"},
        "play": {"type": "backlash", "play": "1 deg", "stiffness": "1000 N m/rad", "restitution": "0.7"},
    }
    nets = {"a": ["one.shaft", "play.a"], "b": ["two.shaft", "play.b"]}
    run = circuit(components=parts, nets=nets, simulation={"stop": "1 s"}).simulate(rtol=1e-9)
    lost = run.balance.energy.dissipated["play"]
    left = 0.02 * run["one.omega"][-1] ** 2 / 2 + 0.03 * run["two.omega"][-1] ** 2 / 2 + run["play.stored_energy"][-1]
    assert lost > 0.3
    assert lost + left == pytest.approx(1.0, rel=1e-6)
