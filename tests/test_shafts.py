"""Rotors, shafts, gears, cranks and levers: signs, reversal, power, and what they do in a circuit."""

import math

import numpy as np
import pytest
from building import circuit
from crescentlab.components.cranks import Crank, Eccentric, RackAndPinion, SwashPlate
from crescentlab.components.levers import FloatingLever, Lever
from crescentlab.components.shafts import ElasticShaft, FanLoad, GearRatio, RotaryDamper, RotaryFriction, TorqueSource
from pydantic import ValidationError

from crescentlab.analysis.steady import steady
from crescentlab.errors import InputError

GEARS = [GearRatio(ratio=2.5), GearRatio(ratio=0.4, sense="opposite")]
STROKES = [
    Crank(radius=0.04, rod_length=0.15, start_angle=0.3),
    Eccentric(eccentricity=0.01),
    SwashPlate(pitch_radius=0.04, swash_angle=0.3),
    RackAndPinion(radius=0.02),
]


@pytest.mark.parametrize("gears", GEARS)
def test_gears_pass_all_power(gears):
    """T_a w_a + T_b w_b = 0 on the gears, whatever the direction; angles keep the ratio."""
    now = gears.equations(phi_a=5.0, omega_a=30.0, torque_b=-7.0)
    assert now["torque_a"] * 30.0 - 7.0 * now["omega_b"] == pytest.approx(0.0, abs=1e-12)
    assert abs(now["phi_b"] / 5.0) == pytest.approx(1 / gears.ratio)
    assert now["phi_b"] / 5.0 == pytest.approx(now["omega_b"] / 30.0)
    assert (now["omega_b"] > 0) == (gears.sense == "same")


@pytest.mark.parametrize("part", STROKES, ids=lambda p: p.type_name())
def test_strokes_pass_all_power_and_keep_their_velocity(part):
    """T w + f v = 0 at any angle; v is the rate of x (central differences, 1e-8)."""
    for phi in np.linspace(-4.0, 9.0, 14):
        now = part.equations(phi_shaft=phi, omega_shaft=12.0, f_rod=-300.0)
        assert now["torque_shaft"] * 12.0 - 300.0 * now["v_rod"] == pytest.approx(0.0, abs=1e-9)
        later, earlier = (
            part.equations(phi_shaft=phi + s * 1e-5, omega_shaft=12.0, f_rod=0.0)["x_rod"] for s in (1, -1)
        )
        assert (later - earlier) / 2e-5 * 12.0 == pytest.approx(now["v_rod"], abs=1e-8)


@pytest.mark.parametrize("part", STROKES[:3], ids=lambda p: p.type_name())
def test_strokes_go_out_and_back(part):
    """x is 0 at the start angle, twice the radius half a turn on, and repeats after a turn."""
    begin = part.start_angle
    half = {"crank": 0.04, "eccentric": 0.01, "swash_plate": 0.04 * math.tan(0.3)}[part.type_name()]
    x = [
        part.equations(phi_shaft=begin + a, omega_shaft=0.0, f_rod=0.0)["x_rod"]
        for a in (0.0, math.pi, 2 * math.pi)
    ]  # fmt: skip
    assert x == pytest.approx([0.0, 2 * half, 0.0], abs=1e-12)


def test_short_connecting_rod_is_refused():
    """The crank could not turn; the message names both lengths."""
    with pytest.raises(ValidationError, match=r"rod_length \(30 mm\) must exceed radius \(40 mm\)"):
        Crank(radius=0.04, rod_length=0.03)


@pytest.mark.parametrize("at_end", [False, True])
def test_levers_pass_all_power(at_end):
    """f_a v_a + f_b v_b = 0, and with three forces the same; moments about the pivot vanish."""
    now = Lever(arm_a=0.2, arm_b=0.5, pivot_at_end=at_end).equations(x_a=1e-3, v_a=0.1, f_b=40.0)
    assert now["f_a"] * 0.1 + 40.0 * now["v_b"] == pytest.approx(0.0, abs=1e-12)
    assert (now["v_b"] > 0) == at_end
    beam = FloatingLever(share=0.3).equations(x_a=1e-3, x_b=2e-3, v_a=0.1, v_b=-0.4, f_c=40.0)
    assert beam["f_a"] * 0.1 - beam["f_b"] * 0.4 + 40.0 * beam["v_c"] == pytest.approx(0.0, abs=1e-12)
    assert beam["f_a"] + beam["f_b"] == pytest.approx(-40.0)


def test_shaft_pulls_back_and_keeps_momentum():
    """The driving end is braked, the driven end pushed by the same torque; damping always takes power."""
    shaft = ElasticShaft(stiffness=100.0, damping=3.0)
    now = shaft.equations(twist=0.02, omega_a=5.0, omega_b=2.0)
    assert (now["torque_a"], now["torque_b"]) == pytest.approx((11.0, -11.0))
    assert now["der_twist"] == 3.0
    stored = 100.0 * 0.02 * 3.0
    assert now["torque_a"] * 5.0 + now["torque_b"] * 2.0 - stored == pytest.approx(3.0 * 3.0**2)


@pytest.mark.parametrize(
    "part",
    [
        RotaryDamper(coefficient=0.2),
        RotaryFriction(coulomb_friction=2.0, static_friction=3.0),
        FanLoad(rated_torque=5.0, rated_speed=100.0),
    ],
    ids=lambda p: p.type_name(),
)
def test_loads_resist_both_ways(part):
    """The torque is odd in the speed, takes power, and vanishes at rest."""
    for w in (1e-3, 0.5, 80.0):
        there, back = (part.equations(omega_shaft=s * w)["torque_shaft"] for s in (1, -1))
        assert there == -back
        assert there > 0
    assert part.equations(omega_shaft=0.0)["torque_shaft"] == 0


def test_torque_source_drives():
    """The reaction on the source is the opposite of what turns the rotor."""
    assert TorqueSource(torque=5.0).equations(omega_shaft=2.0) == {"torque_shaft": -5.0, "power": 10.0}


DRIVE_LINE = {
    "motor": {"type": "torque_source", "torque": "20 N m"},
    "one": {"type": "inertia", "inertia": "0.02 kg m2"},
    "gears": {"type": "gear_ratio", "ratio": "3"},
    "shaft": {"type": "elastic_shaft", "stiffness": "1000 N m/rad", "damping": "1 N m s/rad"},
    "two": {"type": "inertia", "inertia": "0.05 kg m2"},
    "fan": {"type": "fan_load", "rated_torque": "60 N m", "rated_speed": "100 rad/s"},
}
NETS = {
    "fast": ["one.shaft", "motor.shaft", "gears.a"],
    "geared": ["gears.b", "shaft.a"],
    "slow": ["two.shaft", "shaft.b", "fan.shaft"],
}


def test_turning_drive_line_has_a_steady_state():
    """The angles count up, so a steady run finds the speed at which 20 N m times 3 meet the fan: 100 rad/s.

    The shaft then carries 60 N m: 60 mrad of twist; tolerance of Newton's method.
    """
    point = steady(circuit(components=DRIVE_LINE, nets=NETS, simulation={"stop": "1 s"})).result
    assert point["two.omega"][-1] == pytest.approx(100.0, rel=1e-8)
    assert point["one.omega"][-1] == pytest.approx(300.0, rel=1e-8)
    assert point["shaft.twist"][-1] == pytest.approx(0.06, rel=1e-8)


def test_drive_line_balances_its_energy():
    """Work of the source less the fan's and the damping's is what inertias and shaft hold; integrals to 1e-6."""
    made = circuit(components=DRIVE_LINE, nets=NETS, simulation={"stop": "200 ms"})
    run = made.simulate(rtol=1e-10, output_step="20 us")
    slip = run["one.omega"] / 3 - run["two.omega"]
    net_power = run["motor.power"] - run["fan.power"] - 1.0 * slip**2
    work = np.trapezoid(net_power, run.time)
    held = run["one.kinetic_energy"] + run["two.kinetic_energy"] + run["shaft.stored_energy"]
    assert held[-1] - held[0] == pytest.approx(work, rel=1e-5)
    assert held[-1] > 10.0


def test_positioned_rotor_rests_where_the_spring_holds_it():
    """A swivelling rotor's angle is solved for: 5 N m on 200 N m/rad with 1 N m of preload is 20 mrad."""
    parts = {
        "plate": {"type": "swivelling_inertia", "inertia": "0.1 kg m2"},
        "spring": {"type": "torsion_spring", "stiffness": "200 N m/rad", "preload": "1 N m"},
        "push": {"type": "torque_source", "torque": "5 N m"},
    }
    nets = {"a": ["plate.shaft", "spring.shaft", "push.shaft"]}
    point = steady(circuit(components=parts, nets=nets, simulation={"stop": "1 s"})).result
    assert point["plate.phi"][-1] == pytest.approx(0.02, rel=1e-8)


def test_two_inertias_on_one_shaft_are_refused():
    """Each would give the speed; the error says so."""
    parts = {
        "one": {"type": "inertia", "inertia": "1 kg m2"},
        "two": {"type": "inertia", "inertia": "1 kg m2"},
    }
    made = circuit(components=parts, nets={"a": ["one.shaft", "two.shaft"]}, simulation={"stop": "1 s"})
    with pytest.raises(InputError, match=r"one\.shaft.*two\.shaft|two\.shaft.*one\.shaft"):
        made.simulate()


def test_crank_drives_a_piston_against_a_spring():
    """One turn at constant speed: no net work on an ideal spring; the largest torque by the closed form."""
    parts = {
        "motor": {"type": "speed_source", "speed": "600 rpm"},
        "crank": {"type": "crank", "radius": "20 mm", "rod_length": "80 mm"},
        "spring": {"type": "spring", "stiffness": "1 N/mm"},
    }
    nets = {"s": ["motor.shaft", "crank.shaft"], "r": ["crank.rod", "spring.rod"]}
    run = circuit(components=parts, nets=nets, simulation={"stop": "100 ms"}).simulate(output_step="20 us")
    x = run["r.x"]
    assert x.max() == pytest.approx(0.04, rel=1e-6)
    assert run["spring.force"] == pytest.approx(1000 * x)
    work = np.trapezoid(run["motor.power"], run.time)
    assert work == pytest.approx(0.0, abs=1e-6 * 1000 * 0.04**2 / 2)
