"""Hybrid semantics: relations, settling, events in rounds, ticks, restarts and the traps of root finding."""

from __future__ import annotations

import math

import numpy as np
import pytest
from building import OIL, alone, circuit, fired
from pydantic import Field

from crescentlab.circuit import find
from crescentlab.component import Component
from crescentlab.domain import gives_signal, held, observable, state, takes_signal
from crescentlab.errors import InputError, SimulationError
from crescentlab.maths import cos, event_where, every, exp, fail_when, not_, pi, sin, stack, when, where
from crescentlab.solvers.integrate import integrate
from crescentlab.solvers.options import Options
from crescentlab.units import Angle, Ratio, Time


def plain(name: str, start: float = 0.0, **more):
    """A state without unit."""
    return state(Ratio, name, start=start, nominal=1.0, **more)


def kept(name: str, start: float = 0.0, **more):
    """A held value without unit."""
    return held(Ratio, name, start=start, **more)


class Clockwork(Component):
    """x = x_0 + v t, which every solver integrates without error."""

    x = plain("position")
    v = plain("velocity", 1.0)
    n = kept("count")

    def equations(self, v):
        return {"der_x": v, "der_v": 0.0}


def rows_at(result, time):
    """Rows of one instant: before and after."""
    return np.flatnonzero(np.abs(result.time - time) < 1e-12)


# -- relations are frozen between stops ----------------------------------------------------------


class FrozenChoice(Clockwork):
    """y' = 1 once x > 0.3, else 0."""

    y = plain("integral")

    def equations(self, x, v):
        return {"der_x": v, "der_v": 0.0, "der_y": event_where(x > 0.3, 1.0, 0.0)}


def test_event_where_is_frozen_between_stops():
    """The choice changes at a stop at x = 0.3 and nowhere else, so y(1) = 0.7 to rounding, not to tolerance."""
    result = alone(FrozenChoice).simulate(1.0)
    assert result["part.y"][-1] == pytest.approx(0.7, abs=1e-12)
    t, _, _, bits = result.trajectory.steps.arrays()
    np.testing.assert_array_equal(bits[:, 0], [0.0] * (len(t) - bits[:, 0].sum().astype(int)) + [1.0] * int(bits.sum()))
    first = int(np.argmax(bits[:, 0]))
    assert t[first] == t[first - 1] == pytest.approx(0.3, abs=1e-12)
    assert result.trajectory.happenings == []


class PlainChoice(Clockwork):
    """y' = max(x - 0.3, 0) written with where: the branches meet."""

    y = plain("integral")

    def equations(self, x, v):
        return {"der_x": v, "der_v": 0.0, "der_y": where(x > 0.3, x - 0.3, 0.0)}


def test_plain_where_makes_no_event():
    """No relation, no stop, and the right integral 0.7^2/2 to a few of the solver's tolerances of 1e-6."""
    run = alone(PlainChoice)
    result = run.simulate(1.0)
    assert run.system().bits.names == ()
    assert not rows_at(result, 0.3).size
    assert result["part.y"][-1] == pytest.approx(0.245, abs=1e-5)


class EveryKind(Clockwork):
    """One relation of each kind, in the order of the names."""

    def equations(self, t, x, v, n):
        return {
            "der_x": v, "der_v": 0.0, "on_state": when(x > 2), "linear": when(2 * t - n > 4),
            "curved": when(sin(t) > 2), "on_held": when(n >= 3), "mixed": when(x + t > 9), "slanted": when(t * n > 4),
        }  # fmt: skip


def test_kinds_are_read_from_the_graph():
    """States (also with time): root-found; time alone: exact stop if linear, else scanned; held only: none of these."""
    bits = alone(EveryKind).system().bits
    kinds = list(zip(bits.on_state, bits.on_time, bits.linear, strict=True))
    assert kinds == [(1, 0, 0), (0, 1, 1), (0, 1, 0), (0, 0, 0), (1, 0, 0), (0, 1, 1)]


class Crossing(Clockwork):
    """An event on a state, written as a level."""

    level: Ratio = Field(default=0.5, description="level")

    def equations(self, x, v):
        return {"der_x": v, "der_v": 0.0, "up": when(x > self.level), "down": when(x < self.level)}


@pytest.mark.parametrize("solver", ["lsoda", "bdf", "radau", "rk45", "dop853", "rodas", "dopri", "cvode"])
@pytest.mark.parametrize("level", [0.1234567890123, 1 / 3, 0.9999999])
def test_state_roots_are_located(solver, level):
    """x = t meets the level at t = level, within 1e-12 of the span (1e-9 is asked for)."""
    result = alone(Crossing, level=level).simulate(1.0, solver=solver)
    assert fired(result, "part.up") == [pytest.approx(level, abs=1e-12)]
    assert fired(result, "part.down") == [0.0]


class Schedule(Clockwork):
    """Steps at times."""

    at: Time = Field(default=0.5, description="time of the step")

    def equations(self, t, x, v, n):
        return {"der_x": v, "der_v": event_where(t >= self.at, 3.0, 0.0), "step": when(t >= self.at, n=n + 1)}


@pytest.mark.parametrize("at", [0.1, 0.3, 1 / 3, 0.7, math.pi / 4, 1e-9, 1.0])
@pytest.mark.parametrize("solver", ["lsoda", "rk45", "rodas", "dopri", "cvode"])
def test_a_time_step_is_hit_exactly(at, solver):
    """A relation linear in t is an exact stop, to the last bit of t; v is then right within the tolerance of 1e-6."""
    result = alone(Schedule, at=f"{at!r} s").simulate(1.0, solver=solver)
    (time,) = fired(result, "part.step")
    assert abs(time - at) <= np.spacing(at)
    assert result["part.v"][-1] == pytest.approx(1 + 3 * (1 - at), abs=1e-6)


class HeldOnly(Clockwork):
    """A relation on a held value, which a tick counts up."""

    reached = held(Time, "when three were counted", start=-1.0)

    def equations(self, t, x, v, n):
        return {"der_x": v, "der_v": 0.0, "tick": every(0.1, n=n + 1), "three": when(n >= 3, reached=t)}


def test_held_relations_are_read_again_at_stops():
    """n >= 3 becomes true at the third tick, in its next round, at the same instant."""
    result = alone(HeldOnly).simulate(1.0)
    (time,) = fired(result, "part.three")
    assert time == pytest.approx(0.3, abs=1e-15)
    assert [h.names for h in result.trajectory.happenings if h.time == time] == [("part.tick", "part.three")]
    assert result["part.reached"][-1] == time


# -- settling ------------------------------------------------------------------------------------


class AtStart(Clockwork):
    """The four relations, read at t0."""

    def equations(self, x, v):
        return {"der_x": v, "der_v": 0.0, "gt": when(x > 0), "ge": when(x >= 0), "lt": when(x < 0), "le": when(x <= 0)}


@pytest.mark.parametrize(
    ("x", "v", "expected"),
    [
        (5.0, 0.0, {"gt", "ge"}),  # outside the band: truth
        (-5.0, 1.0, {"lt", "le"}),
        (0.0, 1.0, {"gt", "ge"}),  # inside: the side it is heading for
        (0.0, -1.0, {"lt", "le"}),
        (0.0, 0.0, {"ge", "le"}),  # heading nowhere: truth
    ],
)
def test_settling(x, v, expected):
    """What holds at t0 fires at t0, and each relation holds by truth, or inside its band by its heading."""
    result = alone(AtStart, {"x": x, "v": v}).simulate(1e-3)
    assert {n.removeprefix("part.") for h in result.trajectory.happenings for n in h.names} == expected
    assert {h.time for h in result.trajectory.happenings} == {0.0}


class BothSides(Component):
    """x is pushed to 0 from both sides, and has no mode that rests there."""

    level = plain("the state", 1.0)

    def equations(self, level):
        return {"der_level": event_where(level > 0, -1.0, 1.0)}


def test_a_cycle_is_an_error_that_names_the_relation():
    """Sliding on a boundary needs a mode; the message says which relation, and what is missing."""
    message = "at 1 s of 2 s: both sides push towards the boundary of part: level > 0"
    with pytest.raises(SimulationError, match=message) as caught:
        alone(BothSides).simulate(2.0)
    assert caught.value.result.time[-1] == pytest.approx(1.0, abs=1e-9)


# -- when and rounds -----------------------------------------------------------------------------


class Wave(Component):
    """Counts how often a wave rises above a level; x'' = -x from (1, 0) is cos t."""

    x = plain("x", 1.0)
    v = plain("v")
    n = kept("count")

    def equations(self, x, v, n):
        return {"der_x": v, "der_v": -x, "rises": when(x > 0.5, n=n + 1)}


def test_when_fires_on_the_edge():
    """cos t > 0.5 holds at t0 and rises again at 2 pi k - pi/3: four times in 20 s, however long it holds."""
    result = alone(Wave).simulate(20.0, rtol=1e-9)
    expected = [0.0, *(2 * math.pi * k - math.pi / 3 for k in (1, 2, 3))]
    assert fired(result, "part.rises") == pytest.approx(expected, abs=1e-6)
    assert result["part.n"][-1] == 4


def test_an_event_stands_twice_in_the_result():
    """Its time has two rows, the values before and after."""
    result = alone(Schedule, at="0.25 s").simulate(1.0)
    before, after = rows_at(result, 0.25)
    assert (result["part.n"][before], result["part.n"][after]) == (0.0, 1.0)


class Swapper(Component):
    """Takes the other's value at half a second."""

    mine = kept("my value")
    other = takes_signal(Ratio, "the other's value")
    shown = gives_signal(Ratio, "my value")

    def equations(self, t, mine, other):
        return {"shown": mine, "swap": when(t >= 0.5, mine=other)}


def test_a_round_reads_the_world_just_before_it():
    """Two components that take each other's value at one instant swap them."""
    parts = {"a": {"type": "swapper", "start": {"mine": "1"}}, "b": {"type": "swapper", "start": {"mine": "2"}}}
    nets = {"a_b": ["a.shown", "b.other"], "b_a": ["b.shown", "a.other"]}
    result = circuit(Swapper, components=parts, nets=nets).simulate(1.0)
    assert [(h.time, h.names) for h in result.trajectory.happenings] == [(0.5, ("a.swap", "b.swap"))]
    assert (result["a.mine"][-1], result["b.mine"][-1]) == (2.0, 1.0)


class DoubleThenAdd(Component):
    """Two events of one instant, in this order."""

    n = kept("number", 3.0)

    def equations(self, t, n):
        return {"double": when(t >= 0.5, n=2 * n), "add": when(t >= 0.5, n=n + 1)}


class AddThenDouble(Component):
    """The same in the other order."""

    n = kept("number", 3.0)

    def equations(self, t, n):
        return {"add": when(t >= 0.5, n=n + 1), "double": when(t >= 0.5, n=2 * n)}


@pytest.mark.parametrize(("cls", "expected"), [(DoubleThenAdd, 7.0), (AddThenDouble, 8.0)])
def test_events_of_one_component_compose_in_the_order_written(cls, expected):
    """2*3 + 1 = 7, (3 + 1)*2 = 8."""
    assert alone(cls).simulate(1.0)["part.n"][-1] == expected


class Dominoes(Component):
    """Each event makes the next one's condition true."""

    first, second, third = kept("1"), kept("2"), kept("3")

    def equations(self, t, first, second):
        return {
            "three": when(second > 0.5, third=10 * second + first),
            "two": when(first > 0.5, second=first + 1, first=5.0),
            "one": when(t >= 0.5, first=1.0),
        }  # fmt: skip


def test_new_edges_fire_in_the_next_round():
    """One instant, three rounds: first = 1; second = 2 and first = 5; third = 10*2 + 5."""
    result = alone(Dominoes).simulate(1.0)
    assert [(h.time, h.names) for h in result.trajectory.happenings] == [(0.5, ("part.one", "part.two", "part.three"))]
    assert [result[f"part.{n}"][-1] for n in ("first", "second", "third")] == [5.0, 2.0, 25.0]


class PingPong(Component):
    """Two events that cause each other for ever."""

    side = kept("side", 0.5)

    def equations(self, t, side):
        return {"serve": when(t >= 0.5, side=0.0), "ping": when(side == 0, side=1.0), "pong": when(side == 1, side=0.0)}


def test_endless_rounds_are_an_error_with_names():
    """After 40 rounds the run fails, says at which time, and names the events."""
    with pytest.raises(
        SimulationError, match=r"at 0\.5 s of 1 s: events keep causing each other .*: part\.p[io]ng, part\.p[io]ng$"
    ):
        alone(PingPong).simulate(1.0)


class Counter(Component):
    """Counts to a number in as many rounds."""

    last: Ratio = Field(default=39.0, description="last number")
    n = kept("count")

    def equations(self, n):
        odd = sin(n * pi / 2) ** 2 > 0.5
        return {
            "even": when((n < self.last) & not_(odd), n=n + 1),
            "odd": when((n < self.last) & odd, n=n + 1),
        }


def test_many_rounds_that_end_are_no_error():
    """39 rounds at one instant are allowed."""
    assert alone(Counter).simulate(1.0)["part.n"][-1] == 39


def test_two_components_at_the_same_instant():
    """Two balls dropped from one height land together: one stop, one round, both names."""
    parts = {"a": {"type": "ball"}, "b": {"type": "ball"}}
    happenings = circuit(Ball, components=parts).simulate(0.8).trajectory.happenings
    assert [h.names for h in happenings] == [("a.bounce", "b.bounce")] * len(happenings)
    assert len(happenings) == 1


# -- every ---------------------------------------------------------------------------------------


class Ticker(Clockwork):
    """Counts ticks."""

    dt: Time = Field(default=0.1, description="period")

    def equations(self, t, x, v, n):
        return {"der_x": v, "der_v": 0.0, "tick": every(self.dt, n=n + 1)}


def test_ticks_do_not_drift():
    """1000 ticks of 0.1 s: the k-th at k*0.1 within one unit in the last place; none at t0."""
    result = alone(Ticker).simulate(100.0)
    times = np.array(fired(result, "part.tick"))
    exact = np.arange(1, 1001) * 0.1
    assert np.all(np.abs(times - exact) <= np.spacing(exact))
    assert result["part.n"][-1] == 1000
    assert result.trajectory.statistics.restarts == 0


def test_ticks_count_from_the_start_of_the_run():
    """A run from 2 s ticks at 2 s + k dt; dt is a parameter that may change without a new assembly."""
    run = alone(Ticker)
    system = run.system()
    assert run.system({"part.dt": "0.25 s"}) is system
    values = system.values(run.design({"part.dt": "0.25 s"}))
    trajectory = integrate(system, values, Options(start=2.0, stop=3.1))
    assert [h.time for h in trajectory.happenings] == [2.25, 2.5, 2.75, 3.0]


class TwoTickers(Component):
    """Periods 0.2 and 0.3; they meet at 0.6, 1.2, ..."""

    n = kept("count")

    def equations(self, n):
        return {"a": every(0.2, n=n + 1), "b": every(0.3, n=10 * n)}


def test_ticks_that_meet_are_one_stop():
    """At 0.6 s both tick in one round: ((0+1)*10 + 1) + 1 = 12, then 120."""
    result = alone(TwoTickers).simulate(0.7)
    assert [h.names for h in result.trajectory.happenings][-1] == ("part.a", "part.b")
    assert len(result.trajectory.happenings) == 4
    assert result["part.n"][-1] == 120


class TimedByTime(Component):
    """A period that depends on time."""

    n = kept("count")

    def equations(self, t, n):
        return {"tick": every(0.1 + t, n=n + 1)}


class TimedByHeld(Component):
    """A period that depends on a held value."""

    n = kept("count", 1.0)

    def equations(self, n):
        return {"tick": every(0.1 * n, n=n + 1)}


@pytest.mark.parametrize("cls", [TimedByTime, TimedByHeld])
def test_a_period_depends_on_parameters_only(cls):
    """Anything else is the author's mistake, named with the event."""
    message = f"component {cls.__name__}: the period of tick must depend on parameters only"
    with pytest.raises(InputError, match=message):
        alone(cls).simulate(1.0)


def test_a_period_must_be_positive():
    """A period of 0 would never let time pass."""
    with pytest.raises(InputError, match=r"part\.tick: its period is 0 s; it must be above 0"):
        alone(Ticker, dt="0 s").simulate(1.0)


# -- restarts ------------------------------------------------------------------------------------


class SampledLine(Component):
    """A sine sampled every dt and joined by straight lines: held values jump, what x sees does not."""

    dt: Time = Field(default=2e-3, description="sampling time")
    jump: Ratio = Field(default=0.0, description="added at every tick")
    x = plain("x")
    old, new, ahead = kept("last sample"), kept("next sample"), kept("count of ticks")

    def equations(self, t, x, old, new, ahead):
        signal = old + (new - old) * (t / self.dt - ahead)
        return {
            "der_x": (signal - x) / 0.05,
            "tick": every(self.dt, old=new + self.jump, new=sin(2 * pi * (t + self.dt)) + self.jump, ahead=ahead + 1),
        }  # fmt: skip


@pytest.mark.parametrize("solver", ["lsoda", "bdf", "radau", "rk45", "dop853", "rodas", "dopri", "cvode"])
def test_ticks_whose_output_is_continuous_cost_no_restart(solver):
    """497 ticks, at most 2 restarts; x follows the sine filtered with 0.05 s within the lines' error (dt w)^2/8."""
    result = alone(SampledLine).simulate(497.5 * 2e-3, solver=solver)
    statistics = result.trajectory.statistics
    assert statistics.ticks == 497
    assert statistics.restarts <= 2
    w, tau, t = 2 * math.pi, 0.05, result.time
    filtered = (np.sin(w * t) - w * tau * np.cos(w * t) + w * tau * np.exp(-t / tau)) / (1 + (w * tau) ** 2)
    late = t > 0.01  # the first line is flat: new = old = 0 until the first tick
    np.testing.assert_allclose(result["part.x"][late], filtered[late], atol=5e-4)


def test_ticks_that_jump_f_restart():
    """The same with a jump of 0.01 at each tick restarts nearly every time: decided by numbers, not by declaration."""
    assert alone(SampledLine, jump="0.01").simulate(100.5 * 2e-3).trajectory.statistics.restarts > 90


def test_a_jump_of_a_state_restarts():
    """Each of three bounces is a restart."""
    statistics = alone(Ball).simulate(1.2).trajectory.statistics
    assert (statistics.events, statistics.restarts) == (3, 3)


class SampleAndHold(Component):
    """A zero-order hold: x' = u between ticks, u(k) = cos(k dt)."""

    dt: Time = Field(default=1e-3, description="sampling time")
    x = plain("x")
    u = kept("held input", 1.0)

    def equations(self, t, u):
        return {"der_x": u, "tick": every(self.dt, u=cos(t))}


@pytest.mark.parametrize("solver", ["lsoda", "bdf", "radau", "rk45", "dop853", "rodas", "dopri", "cvode"])
def test_small_jumps_without_a_restart_keep_the_accuracy(solver):
    """x(N dt) is the sum of dt cos(k dt); each jump dt sin(k dt) is small, their sum is not."""
    result = alone(SampleAndHold).simulate(2.0, solver=solver, rtol=1e-6)
    exact = 1e-3 * np.cos(1e-3 * np.arange(2000)).sum()
    assert result["part.x"][-1] == pytest.approx(exact, abs=2e-5)


# -- floats and == -------------------------------------------------------------------------------


class BouncingBall(Component):
    """A ball on a floor, with a mode that rests on it."""

    restitution: Ratio = Field(default=0.8, description="speed after over speed before")
    rest_speed: Ratio = Field(default=1e-3, description="a slower rebound ends at rest")
    x = plain("height", 1.0)
    v = plain("speed")
    resting = kept("1 on the floor")

    def equations(self, x, v, resting):
        flies, rebound = resting == 0, -self.restitution * v
        slow = rebound < self.rest_speed
        return {
            "der_x": where(flies, v, 0.0), "der_v": where(flies, -9.81, 0.0),
            "bounce": when(flies & (x < 0), x=0.0, v=where(slow, 0.0, rebound), resting=where(slow, 1.0, 0.0)),
        }  # fmt: skip


def test_events_on_floats():
    """On floats an event is its condition and its remap, readable in one line."""
    bounce = BouncingBall().equations(x=-1e-9, v=-3.0, resting=0)["bounce"]
    assert bounce.condition
    assert bounce.then == {"x": 0.0, "v": pytest.approx(2.4), "resting": 0.0}
    assert not BouncingBall().equations(x=1e-9, v=-3.0, resting=0)["bounce"].condition
    assert Ticker().equations(t=0.0, x=0.0, v=0.0, n=4.0)["tick"].then == {"n": 5.0}


class EqualWhen(Clockwork):
    """== on a state in an event."""

    def equations(self, x, v):
        return {"der_x": v, "der_v": 0.0, "meets": when(x == 0.5)}


class EqualTime(Clockwork):
    """== on time in an event, below a not."""

    def equations(self, t, x, v):
        return {"der_x": v, "der_v": 0.0, "meets": when(not_((t != 0.5) & (x > 0)))}


class EqualChoice(Clockwork):
    """== on a state in a frozen choice."""

    def equations(self, x, v):
        return {"der_x": v, "der_v": event_where(x == 0.5, 1.0, 0.0)}


class EqualWhere(Clockwork):
    """== on a state in a choice."""

    def equations(self, x, v):
        return {"der_x": v, "der_v": where(x == 0.5, 1.0, 0.0)}


@pytest.mark.parametrize("cls", [EqualWhen, EqualTime, EqualChoice, EqualWhere])
def test_equality_of_continuous_values_is_refused(cls):
    """It would never be met; the message says what to write."""
    with pytest.raises(InputError, match=f"component {cls.__name__}: == compares a continuous value"):
        alone(cls).simulate(1.0)


# -- ends of a run -------------------------------------------------------------------------------


class Limited(Clockwork):
    """Fails beyond 0.5."""

    shown = observable(Ratio, "x")

    def equations(self, x, v):
        message = "x reached {shown}; write a smaller v"
        return {"der_x": v, "der_v": 0.0, "shown": x, "too_far": fail_when(x > 0.5, message)}


def test_fail_when_ends_the_run_with_its_message():
    """At the root, with the component's name and the value, and what was computed is kept."""
    result = alone(Limited).simulate(1.0, check=False)
    assert result.trajectory.status == "failed"
    assert not result.trajectory.complete
    assert result.trajectory.error == "the run ended at 0.5 s of 1 s: part: x reached 0.5; write a smaller v"
    assert result.time[-1] == pytest.approx(0.5, abs=1e-12)
    np.testing.assert_allclose(result["part.x"], result.time, rtol=1e-12)


@pytest.mark.parametrize(
    ("condition", "time"), [("part.x > 0.5", 0.5), ("part.x >= part.v / 4", 0.25), ("part.x > 7", 1.0)]
)
def test_stop_when_stops_at_the_root(condition, time):
    """The last time is the root; the status says whether it was the condition that ended the run."""
    result = alone(Crossing, simulation={"stop_when": condition}).simulate(1.0)
    assert result.time[-1] == pytest.approx(time, abs=1e-12)
    assert result.trajectory.status == ("stopped" if time < 1 else "done")
    assert result.trajectory.complete


def test_stop_when_true_at_the_start():
    """Then the run ends where it begins."""
    result = alone(Crossing, {"x": 3.0}, simulation={"stop_when": "part.x > 2"}).simulate(1.0)
    assert (result.time[-1], result.trajectory.status) == (0.0, "stopped")


class Ball(Component):
    """A ball without a mode of rest: its bounces have no end."""

    e: Ratio = Field(default=0.5, description="restitution")
    x = plain("height", 1.0)
    v = plain("speed")

    def equations(self, x, v):
        return {"der_x": v, "der_v": -9.81, "bounce": when(x < 0, x=0.0, v=-self.e * v)}


@pytest.mark.parametrize("solver", ["auto", "bdf", "radau", "rk45", "dop853", "rodas", "dopri", "cvode"])
@pytest.mark.parametrize("e", [0.1, 0.5, 0.8])
def test_a_zeno_sequence_fails_and_names_the_event(solver, e):
    """Bounces pile up at t1 (1 + e)/(1 - e), t1 = sqrt(2/g): there the run fails, at the default rtol 0.5 % off."""
    result = alone(Ball, e=e).simulate(10.0, solver=solver, check=False)
    assert result.trajectory.status == "failed"
    assert "part.bounce happens faster and faster" in result.trajectory.error
    assert "a mode in which it rests" in result.trajectory.error
    limit = math.sqrt(2 / 9.81) * (1 + e) / (1 - e)
    assert result.time[-1] == pytest.approx(limit, rel=5e-3)
    assert result["part.x"].min() > -1e-5
    first = fired(result, "part.bounce")[:3]
    t1 = math.sqrt(2 / 9.81)
    assert first == pytest.approx([t1, t1 * (1 + 2 * e), t1 * (1 + 2 * e + 2 * e * e)], rel=2e-4)


# -- traps ---------------------------------------------------------------------------------------

PULSES = 180


class TimedPulses(Component):
    """A resting filter behind rectangular pulses of a clock: 2 % of each period."""

    x = plain("x")
    n = kept("count")

    def equations(self, t, x, n):
        pulse = event_where(cos(2 * pi * (PULSES * t - 0.5)) > math.cos(0.02 * math.pi), 1.0, 0.0)
        return {"der_x": (pulse - x) / 1e-4, "found": when(x > 0.5, n=n + 1)}


class SmoothPulses(Component):
    """A resting filter behind smooth pulses of a clock, 8 % of each period wide at half height."""

    x = plain("x")
    n = kept("count")

    def equations(self, t, x, n):
        return {
            "der_x": (exp(20 * (cos(2 * pi * (PULSES * t - 0.5)) - 1)) - x) / 1e-4,
            "found": when(x > 0.5, n=n + 1),
        }


class ShaftPulses(Component):
    """A resting filter behind a cam on a shaft, high for 0.02 of each turn."""

    phi = state(Angle, "angle", nominal=1.0)
    x = plain("x")
    n = kept("count")

    def equations(self, phi, x, n):
        pulse = event_where(cos(phi - pi) > math.cos(0.02 * math.pi), 1.0, 0.0)
        return {"der_phi": 2 * pi * PULSES, "der_x": (pulse - x) / 1e-4, "found": when(x > 0.5, n=n + 1)}


class ShaftEvents(Component):
    """A cam on a shaft that nothing follows, high for 0.001 of each turn."""

    phi = state(Angle, "angle", nominal=1.0)
    n = kept("count")

    def equations(self, phi, n):
        return {"der_phi": 2 * pi * PULSES, "found": when(cos(phi - pi) > math.cos(0.001 * math.pi), n=n + 1)}


@pytest.mark.parametrize("cls", [TimedPulses, SmoothPulses, ShaftPulses, ShaftEvents])
@pytest.mark.parametrize("solver", ["auto", "rk45", "rodas", "dopri"])
def test_a_resting_system_misses_no_excitation(cls, solver):
    """180 pulses, 180 events, although between pulses the solver would take steps of many periods."""
    result = alone(cls).simulate(1.0, solver=solver, rtol=1e-4)
    assert result["part.n"][-1] == PULSES
    times = np.array(fired(result, "part.found"))
    np.testing.assert_allclose(times, (np.arange(PULSES) + 0.5) / PULSES, atol=0.06 / PULSES)


class LoneBump(Component):
    """A resting filter behind one smooth bump of a clock."""

    width: Time = Field(default=1e-3, description="where the bump has fallen to 1/e")
    x = plain("x")

    def equations(self, t, x):
        return {"der_x": (exp(-(((t - 0.4567) / self.width) ** 2)) - x) / 1e-4, "found": when(x > 0.5)}


@pytest.mark.parametrize("width", [1e-2, 1e-3, 3e-4])
@pytest.mark.parametrize("solver", ["auto", "bdf", "radau", "rodas", "cvode"])
def test_a_lone_bump_is_not_stepped_over(width, solver):
    """A bump as short as 0.03 % of the run wakes the filter, which rests before and after it."""
    result = alone(LoneBump, width=f"{width} s").simulate(1.0, solver=solver)
    assert len(fired(result, "part.found")) == 1
    assert result.trajectory.statistics.steps < 400


class Wheel(Component):
    """A wheel of many teeth that nothing follows: up to two teeth pass in one step of 0.3 rad, and more of x."""

    teeth: Ratio = Field(default=20.0, description="teeth")
    width: Ratio = Field(default=0.1, description="width of a tooth over half a pitch")
    phi = state(Angle, "angle", nominal=1.0)
    x = plain("turns, without the unit of an angle")
    n, m = kept("count of teeth by phi"), kept("count of teeth by x")

    def equations(self, phi, x, n, m):
        top = cos(pi * self.width)
        return {
            "der_phi": 2 * pi, "der_x": 1.0, "by_phi": when(cos(self.teeth * phi - pi) > top, n=n + 1),
            "by_x": when(cos(2 * pi * self.teeth * x - pi) > top, m=m + 1),
        }  # fmt: skip


@pytest.mark.parametrize("teeth", [5, 13, 25, 40])
@pytest.mark.parametrize("width", [0.5, 0.1, 0.01])
def test_every_tooth_of_a_wheel_is_seen(teeth, width):
    """A relation may swing faster than the states it depends on: in three turns three events a tooth."""
    result = alone(Wheel, teeth=teeth, width=width).simulate(3.0)
    expected = (np.arange(3 * teeth) + 0.5 - width / 2) / teeth
    assert fired(result, "part.by_phi") == pytest.approx(expected, abs=1e-9)
    assert fired(result, "part.by_x") == pytest.approx(expected, abs=1e-9)


class Dips(Clockwork):
    """Events that hold for a tiny part of a step, and one that never does."""

    def equations(self, x, v):
        return {
            "der_x": v, "der_v": 0.0, "wide": when((x - 0.515) ** 2 < 1e-6), "narrow": when((x - 0.715) ** 2 < 1e-14),
            "touch": when((x - 0.315) ** 2 < 0), "edge": when((x - 0.915) ** 2 < 1e-12),
        }  # fmt: skip


@pytest.mark.parametrize("solver", ["auto", "bdf", "radau", "rk45", "dop853", "rodas", "dopri", "cvode"])
def test_two_roots_inside_one_step(solver):
    """Steps of 0.02 contain both roots of each; the first is found to 1e-12, also 1e-7 apart. A touch is no event."""
    result = alone(Dips).simulate(1.0, solver=solver)
    assert result.trajectory.statistics.steps < 80
    assert fired(result, "part.wide") == [pytest.approx(0.514, abs=1e-10)]
    assert fired(result, "part.narrow") == [pytest.approx(0.715 - 1e-7, abs=1e-10)]
    assert fired(result, "part.edge") == [pytest.approx(0.915 - 1e-6, abs=1e-10)]
    assert fired(result, "part.touch") == []


class Bowl(Component):
    """x = 1 + (t - 0.51)^2 touches 1 from above."""

    x = plain("x", 1 + 0.51**2)

    def equations(self, t, x):
        return {"der_x": 2 * (t - 0.51), "below": when(x < 1)}


@pytest.mark.parametrize("solver", ["rk45", "dop853", "radau", "rodas", "dopri"])
def test_a_surface_touched_by_a_state_makes_no_event(solver):
    """With solvers that are exact for a parabola there is only roundoff, and roundoff is no crossing."""
    assert alone(Bowl).simulate(1.0, solver=solver).trajectory.happenings == []


class AtZero(Component):
    """A state that is zero for ever, as a valve on its seat is."""

    x = plain("x")
    u = plain("u", 1.0)

    def equations(self, x, u):
        return {
            "der_x": 0.0 * u, "der_u": -u, "below": when(x < 0), "above": when(x > 0), "there": when(x <= 0),
            "rides": when(x * u > 0),
        }  # fmt: skip


@pytest.mark.parametrize("solver", ["auto", "bdf", "radau", "rk45", "dop853", "rodas", "dopri", "cvode"])
def test_a_root_that_stays_at_zero(solver):
    """Only what is true at t0 fires, and no step is wasted on it."""
    result = alone(AtZero).simulate(10.0, solver=solver)
    assert [(h.time, h.names) for h in result.trajectory.happenings] == [(0.0, ("part.there",))]
    assert result.trajectory.statistics.steps < 200


class Flat(Component):
    """x = (0.51 - t)^3 + 1 crosses 1 with no speed at all."""

    x = plain("x", 1 + 0.51**3)

    def equations(self, t, x):
        return {"der_x": -3 * (0.51 - t) ** 2, "below": when(x < 1)}


@pytest.mark.parametrize("solver", ["rk45", "dop853", "radau", "rodas", "dopri"])
def test_a_flat_root_is_found_in_time(solver):
    """1e-15 of roundoff is (1e-5)^3, so the root is known to 1e-5; the search must not crawl in steps of 1e-13."""
    result = alone(Flat).simulate(1.0, solver=solver, rtol=1e-8)
    assert fired(result, "part.below") == [pytest.approx(0.51, abs=5e-4)]
    assert result.trajectory.statistics.wall_s < 2


class CurvedTime(Component):
    """Relations that curve in time."""

    n = kept("count")

    def equations(self, t, n):
        return {
            "near": when((t - 0.5) ** 2 < 1e-8), "touch": when((t - 0.25) ** 2 < 0), "sine": when(sin(t) > 0.5),
            "waves": when(sin(20 * pi * t) > 0.5, n=n + 1), "gone": when(not_(exp(t) < 2)),
            "always": when(exp(-t) > 0.1),
        }  # fmt: skip


def test_curved_time_roots_neither_hang_nor_are_missed():
    """(t - 0.5)^2 < 1e-8 from 0.4999; sin t > 0.5 from pi/6; ten waves; e^t >= 2 from ln 2; a touch is no event."""
    result = alone(CurvedTime).simulate(1.0)
    assert fired(result, "part.near") == [pytest.approx(0.4999, abs=1e-11)]
    assert fired(result, "part.sine") == [pytest.approx(math.pi / 6, abs=1e-12)]
    assert fired(result, "part.gone") == [pytest.approx(math.log(2), abs=1e-12)]
    assert fired(result, "part.always") == [0.0]
    assert fired(result, "part.touch") == []
    assert fired(result, "part.waves") == pytest.approx((np.arange(10) + 1 / 12) / 10, abs=1e-12)


class CurvedByBit(Component):
    """A curved relation on time that another relation replaces at t = 1."""

    def equations(self, t):
        return {"up": when(event_where(t > 1, sin(3 * t), cos(5 * t)) > 0.5)}


class CurvedByHeld(Component):
    """A level that each crossing raises."""

    n = kept("count")

    def equations(self, t, n):
        return {"up": when(exp(t) > 1.001 * (1 + n / 200), n=n + 1)}


def test_curved_time_roots_are_not_stale():
    """cos 5t > 0.5 at t0; its next rise at pi/3 gives way to that of sin 3t at 13 pi/18. Held levels move roots too."""
    assert fired(alone(CurvedByBit).simulate(3.0), "part.up") == pytest.approx([0.0, 13 * math.pi / 18], abs=1e-11)
    result = alone(CurvedByHeld).simulate(0.5)
    expected = [math.log(1.001 * (1 + n / 200)) for n in range(130)]
    assert fired(result, "part.up") == pytest.approx([t for t in expected if t <= 0.5], abs=1e-11)
    assert result.trajectory.statistics.wall_s < 5


class Hold(Component):
    """A curved clock that nothing follows."""

    x = plain("x")

    def equations(self, t):
        return {"der_x": (t - 0.5) ** 2}


def test_a_clock_value_that_turns_once_costs_no_steps():
    """(t - 0.5)^2 turns once, at a sample of the look-ahead; that is no fast swing."""
    assert alone(Hold).simulate(1.0).trajectory.statistics.steps < 200


class Neighbours(Clockwork):
    """Time events nearer to each other than the clock can tell, and a little further."""

    def equations(self, t, x, v, n):
        return {
            "der_x": v, "der_v": n, "a": when(t >= 0.3, n=n + 1), "b": when(t >= 0.3 + 1e-15, n=n + 1),
            "c": when(t >= 0.3 + 1e-12, n=n + 1),
        }  # fmt: skip


@pytest.mark.parametrize("solver", ["auto", "bdf", "radau", "rk45", "dop853", "rodas", "dopri", "cvode"])
def test_events_a_rounding_error_apart(solver):
    """All three happen, in order, and v(1) = 1 + 3*0.7."""
    result = alone(Neighbours).simulate(1.0, solver=solver)
    assert [n for h in result.trajectory.happenings for n in h.names] == ["part.a", "part.b", "part.c"]
    assert result["part.v"][-1] == pytest.approx(3.1, rel=1e-6)


class JustBefore(Clockwork):
    """An event on a state that changes nothing, shortly before a step in time, both within one step of the solver."""

    lead: Time = Field(default=1e-4, description="time between the two")

    def equations(self, t, x, v, n):
        return {
            "der_x": v, "der_v": event_where(t >= 0.5, 1.0, 0.0), "passes": when(x > 0.5 - self.lead),
            "step": when(t >= 0.5, n=n + 1), "curved": when(sin(t) > math.sin(0.75)),
        }  # fmt: skip


@pytest.mark.parametrize("solver", ["auto", "bdf", "radau", "rk45", "dop853", "rodas", "dopri", "cvode"])
@pytest.mark.parametrize("lead", [1e-2, 1e-4, 1e-8, 1e-12, 0.0])
def test_a_stop_is_not_lost_behind_an_event_in_the_same_step(solver, lead):
    """The stop at the end of a step is kept when an event inside that step needs no restart."""
    result = alone(JustBefore, lead=f"{lead} s").simulate(1.0, solver=solver)
    assert fired(result, "part.passes") == [pytest.approx(0.5 - lead, abs=1e-11)]
    assert fired(result, "part.step") == [0.5]
    assert fired(result, "part.curved") == [pytest.approx(0.75, abs=1e-12)]
    assert result["part.v"][-1] == pytest.approx(1.5, abs=1e-6)


def test_the_output_grid_shows_the_value_after_an_event():
    """With an output step the row at an event's time is the one after it, and no row is doubled."""
    result = alone(Schedule, at="0.5 s").simulate(1.0, output_step=0.125)
    np.testing.assert_allclose(result.time, np.arange(9) / 8, atol=1e-15)
    np.testing.assert_array_equal(result["part.n"], [0, 0, 0, 0, 1, 1, 1, 1, 1])


# -- known answers -------------------------------------------------------------------------------


@pytest.mark.parametrize("solver", ["auto", "rk45", "rodas", "dopri"])
def test_bouncing_ball(solver):
    """Dropped from h: t_1 = sqrt(2h/g), then flights of 2 e^n v_1/g, each with e^2 of the energy, until it rests.

    It rests with the first rebound e^n v_1 below the rest speed. Closed form of the law of impact;
    tolerance: rtol 1e-9 of the solver, over 20 restarts.
    """
    e, h, g, rest = 0.8, 1.0, 9.81, 0.05
    result = alone(BouncingBall, restitution=e, rest_speed=rest).simulate(6.0, solver=solver, rtol=1e-9)
    t1, v1 = math.sqrt(2 * h / g), math.sqrt(2 * g * h)
    bounces = math.ceil(math.log(rest / v1) / math.log(e))
    expected = t1 + np.concatenate(([0.0], np.cumsum([2 * e**n * v1 / g for n in range(1, bounces)])))
    times = fired(result, "part.bounce")
    assert len(times) == bounces
    assert times == pytest.approx(expected, rel=1e-7)
    energy = g * result["part.x"] + result["part.v"] ** 2 / 2
    for n, time in enumerate(times[:-1], start=1):
        _, after = rows_at(result, time)
        assert energy[after] == pytest.approx(g * h * e ** (2 * n), rel=1e-6, abs=1e-7)
    assert (result["part.x"][-1], result["part.v"][-1], result["part.resting"][-1]) == (0.0, 0.0, 1.0)


def test_mass_with_stops_bounces_and_rests():
    """The library's mass under a force of -m g is the same ball; the last bounce leaves it on its low stop."""
    e, m, g, rest = 0.5, 0.2, 9.81, 0.01
    mass = {"type": "mass_with_stops", "mass": f"{m} kg", "low": "0 mm", "high": "2 m", "restitution": e,
            "rest_speed": f"{rest} m/s", "start": {"x": "1 m"}}  # fmt: skip
    weight = {"type": "force_source", "force": f"{-m * g} N"}
    run = circuit(components={"mass": mass, "weight": weight}, nets={"rod": ["mass.port", "weight.rod"]})
    result = run.simulate(3.0, rtol=1e-9)
    t1, v1 = math.sqrt(2 / g), math.sqrt(2 * g)
    bounces = math.ceil(math.log(rest / v1) / math.log(e))
    expected = t1 + np.concatenate(([0.0], np.cumsum([2 * e**n * v1 / g for n in range(1, bounces)])))
    assert fired(result, "mass.hits_low") == pytest.approx(expected, rel=1e-7)
    assert (result["mass.x"][-1], result["mass.v"][-1], result["mass.at"][-1]) == (0.0, 0.0, -1.0)
    assert fired(result, "mass.leaves") == []


@pytest.mark.parametrize("solver", ["auto", "dop853", "rodas", "dopri"])
def test_stick_slip(solver):
    r"""Mass dragged by a spring whose far end moves at V, against dry friction F_c while sliding, F_s while sticking.

    It sticks until k V t = F_s. With the stretch u, sliding is u = F_c/k + A cos wt + (V/w) sin wt, w = sqrt(k/m),
    A = (F_s - F_c)/k from u = F_s/k, u' = V. Its speed V - u' is zero again at t_slip = 2 (pi - atan(A w/V))/w,
    where u = F_c/k - A, so that it sticks for t_stick = 2 A/V. (Derived here; the textbook result for constant
    kinetic friction.) Tolerance: rtol 1e-9 accumulated over the periods.
    """
    m, k, V, coulomb, static = 0.5, 200.0, 0.1, 1.0, 3.0
    w, A = math.sqrt(k / m), (static - coulomb) / k
    slip, stick = 2 * (math.pi - math.atan(A * w / V)) / w, 2 * A / V
    friction = {"coulomb_friction": f"{coulomb} N", "static_friction": f"{static} N"}
    parts = {
        "mass": {"type": "stick_slip_mass", "mass": f"{m} kg", **friction},
        "spring": {"type": "spring_between", "stiffness": f"{k} N/m"},
        "belt": {"type": "motion_source", "velocity": f"{V} m/s"},
    }
    nets = {"rod": ["mass.port", "spring.a"], "end": ["belt.port", "spring.b"]}
    result = circuit(components=parts, nets=nets).simulate(2.0, solver=solver, rtol=1e-9)
    away, stops = fired(result, "mass.breaks_away_up"), fired(result, "mass.stops")
    count = int((2.0 - static / (k * V)) / (slip + stick)) + 1
    expected = static / (k * V) + (slip + stick) * np.arange(count)
    assert away == pytest.approx(expected, rel=1e-6)
    assert stops == pytest.approx(expected[: len(stops)] + slip, rel=1e-6)
    assert len(stops) in (count, count - 1)
    sticking = result["mass.sticking"] > 0.5
    np.testing.assert_array_equal(result["mass.v"][sticking][1:], 0.0)


def valve_on(source, **nets_of):
    """The shipped relief valve on a source of pressure."""
    folder = find("relief_valve").parent
    valve = {"type": "./relief_valve_part.yaml", "cracking_pressure": "6.5 bar"}
    nets = {"p_in": ["source.port", "valve.inlet"], "p_out": ["valve.outlet", "tank.port"], **nets_of}
    return circuit(components={**source, "valve": valve, "tank": {"type": "tank"}}, nets=nets, fluid=OIL, folder=folder)


def test_a_valve_on_its_seat_makes_no_events():
    """0.1 bar below its cracking pressure nothing happens after the look at the start, and it does not move at all."""
    result = valve_on({"source": {"type": "pressure_source", "pressure": "6.4 bar"}}).simulate("50 ms")
    assert [(h.time, h.names) for h in result.trajectory.happenings] == [(0.0, ("valve.spool.starts",))]
    assert not result["valve.x"].any()
    assert result.trajectory.statistics.steps < 100


def test_a_valve_opens_at_its_cracking_pressure():
    """A ramp of 100 bar/s passes 6.5 bar, where it equals the spring's preload on the spool's face, at 15 ms."""
    ramp = {"type": "ramp", "before": "5 bar", "after": "7 bar", "at": "0 ms", "duration": "20 ms"}
    source = {"ramp": ramp, "source": {"type": "signal_pressure_source"}}
    result = valve_on(source, wanted=["ramp.y", "source.pressure"]).simulate("20 ms")
    assert fired(result, "valve.spool.leaves") == [pytest.approx(15e-3, abs=1e-9)]
    assert result["valve.x"][-1] > 0


class Shift(Component):
    """Volumes that a belt carries past: once per pitch each takes the content of the one before."""

    size: int = Field(default=4, ge=0, description="number of volumes")
    p = state(Ratio, "contents", start=0.0, nominal=1.0, size="size")
    travelled = plain("way")
    shifted = kept("way at the last shift")

    def equations(self, t, p, travelled, shifted):
        return {
            "der_p": 0.0 * p, "der_travelled": 1.0,
            "shift": when(travelled - shifted >= 1, p=stack(t, p)[:-1], shifted=shifted + 1),
        }  # fmt: skip


@pytest.mark.parametrize("size", [0, 1, 4])
def test_a_remap_moves_a_chain_along_by_one(size):
    """After k shifts volume j holds what entered at shift k + 1 - j: the time k + 1 - j; also with none or one."""
    result = alone(Shift, size=size).simulate(7.5, rtol=1e-9)
    times = fired(result, "part.shift")
    assert times == pytest.approx(np.arange(1, 8), abs=1e-9)
    np.testing.assert_allclose(result["part.p"][-1], [7.0, 6.0, 5.0, 4.0][:size], atol=1e-9)
    held_values = result["part.shifted"]
    np.testing.assert_array_equal(held_values[-1], 7.0)


def test_carry_over_chain_shifts():
    """A chain without leakage carries the suction's pressure: after each pitch it has moved up by one volume."""
    pitch, speed = 30.0, 100.0
    chain = {"type": "carry_over_chain", "volumes": 3, "volume": "1 cm^3", "pitch": f"{pitch} deg",
             "extension": "100 deg", "gap_height": "0 mm", "gap_length": "1 mm", "thickness": "10 mm",
             "tip_radius": "20 mm", "start": {"p": ["3 bar", "2 bar", "1 bar"]}}  # fmt: skip
    parts = {
        "chain": chain, "drive": {"type": "speed_source", "speed": f"{speed} rad/s"}, "angle": {"type": "angle_sensor"},
        "suction": {"type": "tank", "pressure": "0.5 bar"}, "delivery": {"type": "tank", "pressure": "5 bar"},
    }  # fmt: skip
    nets = {
        "s": ["suction.port", "chain.suction"], "d": ["delivery.port", "chain.delivery"], "c": ["chain.chain"],
        "shaft": ["drive.shaft", "angle.shaft", "chain.shaft"], "phase": ["angle.y", "chain.phase"],
    }  # fmt: skip
    step = math.radians(pitch) / speed
    result = circuit(components=parts, nets=nets, fluid=OIL).simulate(2.5 * step, rtol=1e-8)
    assert fired(result, "chain.closes") == pytest.approx([step, 2 * step], abs=1e-11)
    (before, after), bar = rows_at(result, fired(result, "chain.closes")[0]), 1e5
    np.testing.assert_allclose(result["chain.p"][before][:2], [3 * bar, 2 * bar], rtol=1e-9)
    np.testing.assert_allclose(result["chain.p"][after][:2], [0.5 * bar, 3 * bar], rtol=1e-9)
    np.testing.assert_allclose(result["chain.p"][-1], [0.5 * bar, 0.5 * bar, 3 * bar], rtol=1e-9)


class Plant(Component):
    """First-order lag."""

    tau: Time = Field(default=0.5, description="time constant")
    u = takes_signal(Ratio, "input")
    y = gives_signal(Ratio, "output")
    x = plain("output")

    def equations(self, x, u):
        return {"y": x, "der_x": (u - x) / self.tau}


class SampledPI(Component):
    """u_k = Kp e_k + I_k, I_k = I_(k-1) + Ki dt e_k, held between samples."""

    dt: Time = Field(default=0.05, description="sampling time")
    kp: Ratio = Field(default=2.0, description="proportional gain")
    ki: Ratio = Field(default=6.0, description="integral gain per second")
    y = takes_signal(Ratio, "measured")
    u = gives_signal(Ratio, "output")
    output, integral = kept("held output"), kept("integral")

    def equations(self, y, output, integral):
        error = 1.0 - y
        total = integral + self.ki * self.dt * error
        return {"u": output, "sample": every(self.dt, integral=total, output=self.kp * error + total)}


@pytest.mark.parametrize("solver", ["auto", "radau", "rk45", "rodas", "dopri"])
def test_sampled_controller_against_its_z_transform(solver):
    """The loop sampled: x_(k+1) = a x_k + (1 - a) u_k, a = exp(-dt/tau), exact for a held input; 100 samples."""
    parts = {"plant": {"type": "plant"}, "control": {"type": "sampled_pi"}}
    nets = {"y": ["plant.y", "control.y"], "u": ["control.u", "plant.u"]}
    result = circuit(Plant, SampledPI, components=parts, nets=nets).simulate(5.01, solver=solver, rtol=1e-9)
    dt, a, x, integral, u = 0.05, math.exp(-0.05 / 0.5), 0.0, 0.0, 0.0
    for k, time in enumerate(fired(result, "control.sample"), start=1):
        assert time == pytest.approx(k * dt, rel=1e-15)
        x = a * x + (1 - a) * u
        integral += 6.0 * dt * (1 - x)
        u = 2.0 * (1 - x) + integral
        _, after = rows_at(result, time)
        assert result["plant.x"][after] == pytest.approx(x, abs=1e-6)
        assert result["control.output"][after] == pytest.approx(u, abs=1e-5)
    assert k == 100


class Spoiled(Component):
    """A held value that an event makes infinite."""

    x = plain("x")
    n = kept("value")

    def equations(self, x, n):
        return {"der_x": 1.0 + 0.0 * n, "spoils": when(x > 0.5, n=1 / (x - x))}


class Explosion(Component):
    """Growth beyond all numbers."""

    calm = plain("bystander")
    x = plain("what grows", 1.0)

    def equations(self, x):
        return {"der_calm": 1.0, "der_x": 2000 * x}


def test_a_held_value_that_is_no_number_ends_the_run():
    """Never silently: the message names the value and the event."""
    result = alone(Spoiled).simulate(1.0, check=False)
    assert result.trajectory.status == "failed"
    assert "part.n was set to what is not a finite number by part.spoils" in result.trajectory.error
    assert result.time[-1] == pytest.approx(0.5, abs=1e-9)


@pytest.mark.parametrize("solver", ["lsoda", "bdf", "rk45", "rodas", "dopri", "cvode"])
def test_growth_beyond_all_numbers_names_the_state(solver):
    """exp(2000 t) leaves the floating-point numbers at 0.35 s; no warning, the state is named, the run is kept."""
    result = alone(Explosion).simulate(1.0, solver=solver, rtol=1e-4, check=False)
    assert result.trajectory.status == "failed"
    assert "part.x" in result.trajectory.error
    assert 0.1 < result.time[-1] < 0.36
