"""Masses, springs and friction against mechanics by hand."""

import math

import numpy as np
import pytest
from building import circuit
from crescentlab.components.mechanics import (
    Damper,
    DamperBetween,
    ElasticContact,
    ElasticEndStops,
    ForceSource,
    FrictionBetween,
    Mass,
    MassWithStops,
    MotionSource,
    SignalForceSource,
    Spring,
    SpringBetween,
)
from crescentlab.components.stick_slip import StickSlipMass, StickSlipMassWithStops
from pydantic import ValidationError
from scipy.integrate import solve_ivp
from scipy.optimize import brentq


def test_free_mass_obeys_newton():
    """2 N on 0.5 kg give 4 m/s^2, exactly; no force gives none."""
    mass = MassWithStops(mass=0.5, high=1.0)
    moving = mass.equations(x=0.2, v=0.3, at=0.0, f_port=2.0)
    assert (moving["x_port"], moving["v_port"], moving["der_x"], moving["der_v"]) == (0.2, 0.3, 0.3, 4.0)
    assert mass.equations(x=0.2, v=0.3, at=0.0, f_port=0.0)["der_v"] == 0.0
    assert not any(moving[event].condition for event in ("hits_low", "hits_high", "leaves", "starts"))


@pytest.mark.parametrize("at", [-1.0, 1.0])
def test_resting_mass_stays_until_the_force_points_away(at):
    """A rigid stop answers any push; only a force away from it, not zero force, frees the mass."""
    mass = MassWithStops(mass=0.5, low=-1.0, high=1.0)
    pressed = mass.equations(x=at, v=0.0, at=at, f_port=at * 5)
    assert pressed["der_v"] == 0.0
    assert not pressed["leaves"].condition
    assert not mass.equations(x=at, v=0.0, at=at, f_port=0.0)["leaves"].condition
    pulled = mass.equations(x=at, v=0.0, at=at, f_port=-at * 1e-9)
    assert pulled["leaves"].condition
    assert pulled["leaves"].then == {"at": 0.0}


@pytest.mark.parametrize(
    ("event", "x", "stop", "side"), [("hits_low", -1e-12, 0.0, -1.0), ("hits_high", 4e-3 + 1e-12, 4e-3, 1.0)]
)
@pytest.mark.parametrize(
    ("restitution", "speed", "rebound", "rests"),
    [(0.0, 2.0, 0.0, True), (0.5, 2.0, 1.0, False), (0.5, 1.9e-3, 0.0, True)],
)
def test_hit_on_a_stop(event, x, stop, side, restitution, speed, rebound, rests):
    """Newton's law of impact, v+ = -e v-; a rebound of less than 1 mm/s, or none, ends at rest on the stop."""
    mass = MassWithStops(mass=0.02, high=4e-3, restitution=restitution)
    hit = mass.equations(x=x, v=side * speed, at=0.0, f_port=0.0)[event]
    assert hit.condition
    assert hit.then == {"x": stop, "v": -side * rebound, "at": side if rests else 0.0}


@pytest.mark.parametrize(
    ("x", "v", "expected"),
    [
        (0.0, 0.0, (0.0, 0.0, -1.0)),
        (4e-3, 0.0, (4e-3, 0.0, 1.0)),
        (2e-3, 0.0, (2e-3, 0.0, 0.0)),
        (2e-3, -3.0, (2e-3, -3.0, 0.0)),
        (0.0, 0.5, (0.0, 0.5, 0.0)),
        (-1e-3, 0.0, (0.0, 0.0, -1.0)),
        (9e-3, 0.0, (4e-3, 0.0, 1.0)),
    ],
)
def test_start_agrees_with_the_position(x, v, expected):
    """On a stop and slow: rests there; between the stops, or fast: free; beyond a stop: moved onto it."""
    mass = MassWithStops(mass=0.02, high=4e-3)
    (at,) = [mass.start_of(held) for held in mass.declared(type(type(mass).at))]
    start = mass.equations(x=x, v=v, at=float(at[0]), f_port=0.0)["starts"]
    assert start.condition
    assert (start.then["x"], start.then["v"], start.then["at"]) == expected


def test_start_position_is_the_low_stop():
    """Without a start value the mass rests on its low stop, wherever that is."""
    mass = MassWithStops(mass=0.02, low=1e-3, high=4e-3)
    assert mass.start_of(MassWithStops.x) == 1e-3


def test_bouncing_ball_comes_to_rest():
    """Dropped from 1 m with e = 0.6, rest below 0.01 m/s.

    By hand: rebound n has the speed e^n v_0, v_0 = sqrt(2 g h); e^11 v_0 = 16.1 mm/s is the last above 0.01 m/s,
    so it rests after t = v_0/g (1 + 2 (e + ... + e^11)). Constant acceleration, so each flight is exact.
    """
    g, height, e = 9.81, 1.0, 0.6
    mass = MassWithStops(mass=0.1, high=10.0, restitution=e, rest_speed=0.01)
    f = -ForceSource(force=-0.1 * g).equations()["f_rod"]
    x, v, at, time, rebounds = height, 0.0, 0.0, 0.0, 0
    while at == 0.0:
        a = mass.equations(x=x, v=v, at=at, f_port=f)["der_v"]
        flight = (-v - math.sqrt(v * v - 2 * a * x)) / a
        time, v = time + flight, v + a * flight
        then = mass.equations(x=-1e-300, v=v, at=at, f_port=f)["hits_low"].then
        x, v, at = then["x"], then["v"], then["at"]
        rebounds += at == 0.0
    v_0 = math.sqrt(2 * g * height)
    assert rebounds == 11
    assert time == pytest.approx(v_0 / g * (1 + 2 * (e - e**12) / (1 - e)), rel=1e-12)
    assert mass.equations(x=x, v=v, at=at, f_port=f)["der_v"] == 0.0


def test_stops_out_of_order_are_refused():
    """The message names both stops."""
    with pytest.raises(ValidationError, match=r"high \(1 mm\) must lie above low \(2 mm\)"):
        MassWithStops(mass=0.1, low=2e-3, high=1e-3)


def test_springs_damper_and_forces():
    """Hooke and Newton by hand; f is on the part, so the mass gets the opposite."""
    spring = Spring(stiffness=9000.0, preload=100.0).equations(x_rod=1e-3)
    assert (spring["f_rod"], spring["force"]) == (109.0, 109.0)
    between = SpringBetween(stiffness=1000.0, free_length=0.1).equations(x_a=0.2, x_b=0.35)
    assert between["tension"] == pytest.approx(50.0)
    assert between["f_a"] == -between["f_b"] == -between["tension"]
    assert Damper(coefficient=100.0).equations(v_rod=-0.2)["f_rod"] == -20.0
    assert ForceSource(force=3.0).equations()["f_rod"] == -3.0
    assert SignalForceSource().equations(force=3.0)["f_rod"] == -3.0
    assert MotionSource(velocity=0.1, position=1.0).equations(t=5.0) == {"x_port": 1.5, "v_port": 0.1}


FRICTION = {"mass": 1.0, "coulomb_friction": 6.0, "static_friction": 10.0}


@pytest.mark.parametrize(("f", "onward"), [(-11.0, -1.0), (-10.0, 0.0), (-7.0, 0.0), (0.0, 0.0)])
def test_sliding_mass_stops_or_slides_back(f, onward):
    """v crosses zero: it sticks while |f| <= F_s = 10 N, and turns round if the force is larger."""
    stop = StickSlipMass(**FRICTION).equations(x=0.0, v=-1e-12, direction=1.0, f_port=f)["stops"]
    assert stop.condition
    assert stop.then == {"v": 0.0, "direction": onward}


def test_sticking_mass_breaks_away():
    """It holds up to F_s = 10 N in both directions and then feels F_c = 6 N."""
    mass = StickSlipMass(**FRICTION)
    for f, event, other in (
        (10.5, "breaks_away_up", "breaks_away_down"),
        (-10.5, "breaks_away_down", "breaks_away_up"),
    ):
        held = mass.equations(x=0.0, v=0.0, direction=0.0, f_port=math.copysign(10.0, f))
        assert (held["der_v"], held["sticking"], held["friction"]) == (0.0, 1.0, -math.copysign(10.0, f))
        assert not held[event].condition
        broken = mass.equations(x=0.0, v=0.0, direction=0.0, f_port=f)
        assert broken[event].condition
        assert not broken[other].condition
        way = broken[event].then["direction"]
        slides = mass.equations(x=0.0, v=0.0, direction=way, f_port=f)
        assert (slides["der_v"], slides["friction"]) == (way * 4.5, -way * 6.0)
        assert slides["sticking"] == 0.0


@pytest.mark.parametrize(("v", "direction"), [(0.0, 0.0), (0.1, 1.0), (-0.1, -1.0)])
def test_friction_starts_with_the_velocity(v, direction):
    """The first event reads the direction off the start velocity."""
    start = StickSlipMass(**FRICTION).equations(x=0.0, v=v, direction=2.0, f_port=0.0)["starts"]
    assert start.condition
    assert start.then == {"direction": direction}


def test_static_friction_below_coulomb_is_refused():
    """A mass would chatter between the two."""
    with pytest.raises(ValidationError, match="must be at least coulomb_friction"):
        StickSlipMass(mass=1.0, coulomb_friction=2.0, static_friction=1.0)


SPOOL = StickSlipMassWithStops(**FRICTION, high=4e-3, restitution=0.5)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_stop_holds_what_friction_does_not(side):
    """Pressed with 15 N: friction bears 10 N, the stop 5 N; pulled away it lets go beyond 10 N, not before."""
    there = {"x": 0.0 if side < 0 else 4e-3, "v": 0.0, "direction": 0.0, "at": side}
    pressed = SPOOL.equations(**there, f_port=15 * side)
    assert (pressed["der_v"], pressed["friction"], pressed["stop_force"]) == (0.0, -10 * side, -5 * side)
    away = "breaks_away_up" if side < 0 else "breaks_away_down"
    towards = "breaks_away_down" if side < 0 else "breaks_away_up"
    assert not pressed[away].condition
    assert not pressed[towards].condition
    assert not SPOOL.equations(**there, f_port=-10 * side)[away].condition
    pulled = SPOOL.equations(**there, f_port=-10.1 * side)[away]
    assert pulled.condition
    assert pulled.then == {"direction": -side, "at": 0.0}


@pytest.mark.parametrize(("speed", "rebound"), [(2.0, 1.0), (1.9e-3, 0.0)])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_sliding_mass_strikes_a_stop(side, speed, rebound):
    """e = 0.5: it slides back with half its speed, or rests if that is less than 1 mm/s."""
    x = -1e-12 if side < 0 else 4e-3 + 1e-12
    hit = SPOOL.equations(x=x, v=side * speed, direction=side, at=0.0, f_port=0.0)
    event = hit["hits_low" if side < 0 else "hits_high"]
    assert event.condition
    assert event.then["v"] == -side * rebound
    assert (event.then["direction"], event.then["at"]) == ((-side, 0.0) if rebound else (0.0, side))


@pytest.mark.parametrize(
    ("x", "v", "then"),
    [
        (0.0, 0.0, (0.0, 0.0, 0.0, -1.0)),
        (0.0, -1.0, (0.0, -1.0, -1.0, 0.0)),
        (5e-3, 1e-3, (4e-3, 0.0, 0.0, 1.0)),
        (0.0, 1.0, (0.0, 1.0, 1.0, 0.0)),
        (5e-3, 0.0, (4e-3, 0.0, 0.0, 1.0)),
        (2e-3, -1.0, (2e-3, -1.0, -1.0, 0.0)),
        (2e-3, 0.0, (2e-3, 0.0, 0.0, 0.0)),
    ],
)
def test_a_mass_between_stops_starts_where_it_may(x, v, then):
    """Beyond a stop it starts on it, and rests there if it is no faster than 1 mm/s; otherwise it strikes, or flies."""
    start = SPOOL.equations(x=x, v=v, direction=2.0, at=0.0, f_port=0.0)["starts"]
    assert start.condition
    assert tuple(start.then[name] for name in ("x", "v", "direction", "at")) == then


def test_stick_slip_oscillator():
    """A mass pulled by a spring whose end moves at V, against the closed form.

    With a = (F_s - F_c)/k and w = sqrt(k/m), the slip obeys v = V (1 - cos wt) + a w sin wt, so it lasts
    2 (pi - atan(a w/V))/w and ends with the spring force 2 F_c - F_s; the stick lasts 2 a/V.
    Source: solution of m x'' = k (V t - x) - F_c, e.g. Thomsen, Vibrations and Stability. Tolerance: solve_ivp's.
    """
    k, drive = 400.0, MotionSource(velocity=0.05)
    mass, spring = StickSlipMass(**FRICTION), SpringBetween(stiffness=k)

    def equations(t, x, v, direction):
        f = -spring.equations(x_a=x, x_b=drive.equations(t=t)["x_port"])["f_a"]
        return mass.equations(x=x, v=v, direction=direction, f_port=f), f

    def slide(t, y):
        now, _ = equations(t, *y, 1.0)
        return [now["der_x"], now["der_v"]]

    def turns(t, y):
        return y[1] if t > t_break + 1e-3 else 1.0

    turns.terminal, turns.direction = True, -1
    t_break = 10.0 / k / 0.05
    _, f = equations(t_break, 0.0, 0.0, 0.0)
    assert f == pytest.approx(10.0)
    slip = solve_ivp(slide, [t_break, t_break + 2], [0.0, 0.0], events=turns, rtol=1e-10, atol=1e-13)
    w, a = math.sqrt(k / 1.0), 4.0 / k
    assert slip.t[-1] - t_break == pytest.approx(2 * (math.pi - math.atan(a * w / 0.05)) / w, rel=1e-8)
    moment = slip.t - t_break
    np.testing.assert_allclose(slip.y[1], 0.05 * (1 - np.cos(w * moment)) + a * w * np.sin(w * moment), atol=1e-9)
    stopped, f = equations(slip.t[-1], slip.y[0, -1], -1e-15, 1.0)
    assert f == pytest.approx(2 * 6.0 - 10.0, rel=1e-6)
    assert stopped["stops"].condition
    assert stopped["stops"].then["direction"] == 0.0
    t_next = slip.t[-1] + 2 * a / 0.05
    for early, breaks in ((1e-6, False), (-1e-6, True)):
        now, _ = equations(t_next - early, slip.y[0, -1], 0.0, 0.0)
        assert now["breaks_away_up"].condition == breaks


def test_mass_obeys_newton_everywhere():
    """2 N on 0.5 kg give 4 m/s^2, 0.3 m/s hold 0.0225 J, and nothing else happens."""
    got = Mass(mass=0.5).equations(x=-7.0, v=0.3, f_port=2.0)
    assert got == {"x_port": -7.0, "v_port": 0.3, "der_x": 0.3, "der_v": 4.0, "kinetic_energy": 0.0225}


@pytest.mark.parametrize(
    "part",
    [
        DamperBetween(coefficient=50.0),
        FrictionBetween(coulomb_friction=6.0, static_friction=10.0, viscous_friction=20.0),
    ],
    ids=lambda p: p.type_name(),
)
def test_dampers_between_parts_only_take_power(part):
    """f_a = -f_b; the force turns with the slip, depends on nothing else, takes power, and vanishes without slip."""
    for slip in (1e-5, 1e-3, 0.4):
        there, back = part.equations(v_a=1.0 + slip, v_b=1.0), part.equations(v_a=1.0 - slip, v_b=1.0)
        assert there["f_a"] == -there["f_b"] == pytest.approx(-back["f_a"], rel=1e-9)
        assert there["f_a"] * (1.0 + slip) + there["f_b"] * 1.0 > 0
    assert part.equations(v_a=1.0, v_b=1.0)["f_a"] == 0


def test_friction_creeps_below_its_creep_velocity():
    """Under 5 N, less than static friction: the slip at which they balance is v_t atanh(0.5) to first order."""
    part = FrictionBetween(coulomb_friction=10.0, static_friction=10.0, creep_velocity=1e-4)
    assert part.equations(v_a=1e-4 * math.atanh(0.5), v_b=0.0)["friction"] == pytest.approx(5.0, rel=1e-12)


def test_elastic_stops_push_only_inwards():
    """k times the depth at rest, more while closing, less while opening, never pulling; nothing within the stroke.

    a v_i of e = 0.5 is 1.4328, root of the energies in and out.
    """
    a = brentq(lambda w: w - math.log1p(w) + 0.5 * w + math.log1p(-0.5 * w), 0.5, 1.999) / 0.1
    stops = ElasticEndStops(high=0.01, stiffness=1e6, restitution=0.5, impact_velocity=0.1)
    assert stops.equations(x_rod=0.005, v_rod=3.0)["force"] == 0
    for x, inwards in ((-1e-4, 1.0), (0.0101, -1.0)):
        still, closing, opening, fast = (
            stops.equations(x_rod=x, v_rod=-inwards * v)["force"] * inwards for v in (0.0, 0.05, -0.05, -9.0)
        )
        assert still == pytest.approx(100.0, rel=1e-9)
        assert closing == pytest.approx(100.0 * (1 + a * 0.05), rel=1e-9)
        assert opening == pytest.approx(100.0 * (1 - a * 0.05), rel=1e-9)
        assert fast == 0
    with pytest.raises(ValidationError, match=r"high \(1 mm\) must lie above low \(2 mm\)"):
        ElasticEndStops(low=2e-3, high=1e-3)


def test_contact_keeps_momentum_and_lets_go():
    """Both parts feel the same force; apart by the clearance there is none."""
    contact = ElasticContact(clearance=0.02, stiffness=1e6, restitution=1.0)
    touching = contact.equations(x_a=0.0, x_b=0.019, v_a=0.0, v_b=0.0)
    assert touching["f_a"] == -touching["f_b"] == pytest.approx(1000.0)
    assert contact.equations(x_a=0.0, x_b=0.021, v_a=1.0, v_b=0.0)["force"] == 0


@pytest.mark.parametrize("solver", ["lsoda", "bdf", "rodas"])
def test_a_mass_in_even_motion_between_its_stops_is_left_alone(solver):
    """At v = F/b the sum of forces is rounding about 0: no relation may watch it. x = v t - v m/b (1 - e^{-bt/m})."""
    mass = {"type": "mass_with_stops", "mass": "2 kg", "low": "-1 m", "high": "1 m", "start": {"x": "0 m"}}
    pushed = circuit(
        components={
            "mass": mass, "push": {"type": "force_source", "force": "50 N"},
            "damper": {"type": "damper", "coefficient": "400 N s/m"},
        },
        nets={"rod": ["mass.port", "push.rod", "damper.rod"]},
    )  # fmt: skip
    run = pushed.simulate("1 s", solver=solver, rtol=1e-8)
    v, lag = 50 / 400, 2 / 400
    assert run["mass.x"][-1] == pytest.approx(v * 1.0 - v * lag, rel=1e-6)
    assert run.trajectory.statistics.events == 1  # its start


@pytest.mark.parametrize("solver", ["lsoda", "rodas"])
@pytest.mark.parametrize("kind", ["stick_slip_mass", "stick_slip_mass_with_stops"])
def test_equal_frictions_break_away_under_an_elastic_drive(kind, solver):
    """With F_s = F_c the force at break-away equals the friction to rounding, which must not stop the mass at once."""
    stops = {"low": "-1 m", "high": "1 m"} if kind.endswith("stops") else {}
    rubbing = {"mass": "0.1 g", "coulomb_friction": "0.1 N", "static_friction": "0.1 N", "start": {"x": "0 m"}}
    parts = {
        "drive": {"type": "mass", "mass": "1 kg", "start": {"v": "0.5 m/s"}},
        "back": {"type": "spring", "stiffness": "3 N/m"},
        "spring": {"type": "spring_between", "stiffness": "5000 N/m"},
        "mass": {"type": kind, **rubbing, **stops},
    }
    nets = {"d": ["drive.port", "back.rod", "spring.a"], "m": ["spring.b", "mass.port"]}
    run = circuit(components=parts, nets=nets, simulation={"stop": "13 s"}).simulate(solver=solver)
    assert run.trajectory.status == "done"
    assert abs(run["mass.x"][-1] - run["drive.x"][-1]) < 1.01 * 0.1 / 5000
