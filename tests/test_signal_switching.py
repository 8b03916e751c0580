"""Relay, switch, rate limiter, quantizer: starts, edges, jumps, quantities."""

import numpy as np
import pytest
from building import circuit, fired
from crescentlab.components.signal_switching import Quantizer, RateLimiter, Relay, Switch

BAR = 1e5


def run(part, u, stop="2 s", solver="lsoda", **more):
    """The part behind one source, and something with a state after it."""
    parts = {"source": u, "part": part, "after": {"type": "integrator", **more}}
    nets = {"u": ["source.y", "part.u"], "y": ["part.y", "after.u"], "z": ["after.y"]}
    return circuit(components=parts, nets=nets, simulation={"stop": stop}).simulate(solver=solver, rtol=1e-8)


def carried(part):
    """Names of the quantities of a part's ports by port."""
    return {port.name: part.quantity(port.quantity).name for port in part.ports()}


def test_units_name_the_quantities():
    """Of thresholds the input's, of values the output's."""
    relay = Relay(upper="60 bar", lower="50 bar", on_value="10 L/min", off_value="0 L/min")
    assert carried(relay) == {"u": "pressure", "y": "flow"}
    assert [relay.equations(closed=c, begun=1.0, u=0.0)["y"] for c in (0.0, 1.0)] == pytest.approx([0.0, 1e-2 / 60])
    switch = Switch(threshold="2 mm", output_quantity="pressure")
    assert carried(switch) == {"u1": "pressure", "u2": "pressure", "control": "length", "y": "pressure"}
    assert carried(RateLimiter(rising="20 bar")) == {"u": "pressure", "y": "pressure"}
    assert carried(Quantizer(step="10 um")) == {"u": "length", "y": "length"}


def test_thresholds_leave_a_hysteresis():
    """Equal ones would chatter; the message shows both."""
    with pytest.raises(ValueError, match=r"upper \(50 bar\) must lie above lower \(50 bar\)"):
        Relay(upper="50 bar", lower="50 bar")


@pytest.mark.parametrize(("u", "closed", "value"), [(0.5, 0, 0), (0.5, 1, 1), (2.0, 0, 1), (-2.0, 1, 0)])
def test_a_relay_starts_as_told_unless_its_input_says_otherwise(u, closed, value):
    """Between the thresholds as `closed` says; beyond them at once as they say."""
    relay = {"type": "relay", "upper": "1", "lower": "0", "start": {"closed": str(closed)}}
    result = run(relay, {"type": "constant", "value": str(u)}, "1 s")
    assert result["after.y"][-1] == pytest.approx(value, abs=1e-9)


def test_a_relay_waits_at_the_start_for_what_it_reads():
    """Before its first sample a sample_and_hold gives 0, below the lower threshold; its input is between them."""
    parts = {
        "level": {"type": "constant", "value": "0.5"},
        "sample": {"type": "sample_and_hold", "sample_time": "1 s"},
        "relay": {"type": "relay", "upper": "0.6", "lower": "0.4", "start": {"closed": "1"}},
    }
    nets = {"a": ["level.y", "sample.u"], "b": ["sample.y", "relay.u"], "c": ["relay.y"]}
    result = circuit(components=parts, nets=nets, simulation={"stop": "1 s"}).simulate()
    assert fired(result, "relay.switches_on") == []
    assert np.all(result["relay.y"][result.time > 0] == 1.0)


def test_a_switch_passes_the_second_at_its_threshold():
    """c > c_0 is strict."""
    switch = Switch(threshold=0.5)
    assert [switch.equations(u1=7.0, u2=3.0, control=c)["y"] for c in (0.4, 0.5, 0.6)] == [3.0, 3.0, 7.0]


def test_a_rate_limiter_starts_at_its_input():
    """No rise from 0; the fall is as fast as the rise unless told."""
    limiter = {"type": "rate_limiter", "rising": "10 bar", "time_constant": "1 ms"}
    step = {"type": "step", "before": "30 bar", "after": "20 bar", "at": "0.5 s"}
    result = run(limiter, step, output_quantity="pressure", input_quantity="pressure")
    before = (result.time > 0) & (result.time <= 0.5)
    assert result["part.y"][before] == pytest.approx(30 * BAR, rel=1e-12)
    falling = (result.time > 0.5) & (result.time < 1.4)
    assert result["part.y"][falling] == pytest.approx(30 * BAR - 10 * BAR * (result.time[falling] - 0.5), rel=1e-9)
    assert result["part.y"][-1] == pytest.approx(20 * BAR, rel=1e-9)


@pytest.mark.parametrize("solver", ["lsoda", "rodas", "dopri"])
def test_a_rate_limiter_never_exceeds_its_rates(solver):
    """Behind a sine four times as steep as it may fall; between any two rows, with 1e-6 for the solver."""
    limiter = {"type": "rate_limiter", "rising": "3", "falling": "1.5", "time_constant": "20 ms"}
    result = run(limiter, {"type": "sine", "amplitude": "1", "frequency": "1 Hz"}, "3 s", solver)
    y, t = result["part.y"], result.time
    assert np.all(np.diff(y) <= 3 * np.diff(t) + 1e-6)
    assert np.all(np.diff(y) >= -1.5 * np.diff(t) - 1e-6)
    assert np.ptp(y) > 0.5


@pytest.mark.parametrize("solver", ["lsoda", "rodas", "dopri"])
def test_steps_are_nearest_to_their_input(solver):
    """Within half a step at every row, both ways across 0, and each edge passed is one event."""
    result = run({"type": "quantizer", "step": "0.3"}, {"type": "sine", "amplitude": "1", "frequency": "1 Hz"}, "2 s",
                 solver)  # fmt: skip
    seen = result.time > 0
    assert np.all(np.abs(result["part.y"] - result["source.y"])[seen] <= 0.15 + 1e-8)
    assert set(np.round(result["part.level"]).astype(int)) == {-3, -2, -1, 0, 1, 2, 3}
    assert len(fired(result, "part.steps_up")) == len(fired(result, "part.steps_down")) == 12


@pytest.mark.parametrize(("after", "level"), [("3.4", 3), ("-3.4", -3), ("0.49", 0), ("-0.6", -1)])
def test_a_jump_over_several_steps_is_one_event(after, level):
    """At once to the nearest."""
    result = run({"type": "quantizer", "step": "1"}, {"type": "step", "after": after, "at": "1 s"})
    assert result["part.y"][-1] == level
    assert len(fired(result, "part.steps_up") + fired(result, "part.steps_down")) == abs(np.sign(level))


def test_steps_start_at_their_input():
    """A start at 7.6 steps is 8, without the way up to it."""
    result = run({"type": "quantizer", "step": "1 bar"}, {"type": "constant", "value": "7.6 bar"},
                 output_quantity="pressure", input_quantity="pressure")  # fmt: skip
    assert result["after.y"][-1] == pytest.approx(2 * 8 * BAR, rel=1e-9)
    assert fired(result, "part.begins") == [0.0]
    assert fired(result, "part.steps_up") == []


def test_a_converter_of_limits_clock_and_steps():
    """8 bit over 0 to 10 V, here without unit, every 10 ms: each sample is a multiple of 10/256 within half of it."""
    parts = {
        "source": {"type": "sine", "mean": "5", "amplitude": "4", "frequency": "1 Hz"},
        "range": {"type": "limiter", "low": "0", "high": "10"},
        "clock": {"type": "sample_and_hold", "sample_time": "10 ms"},
        "part": {"type": "quantizer", "step": "= 10 / 256"},
    }
    nets = {"a": ["source.y", "range.u"], "b": ["range.y", "clock.u"], "c": ["clock.y", "part.u"], "d": ["part.y"]}
    result = circuit(components=parts, nets=nets, simulation={"stop": "1 s"}).simulate()
    later = result.time > 0
    assert np.all(np.abs(result["part.y"] - result["clock.y"])[later] <= 5 / 256 * (1 + 1e-12))
    assert len(set(result["part.level"])) > 40


@pytest.mark.parametrize("solver", ["lsoda", "rodas", "dopri"])
@pytest.mark.parametrize("excess", [0.0, 1e-12, 1e-9, 1e-8, 1e-6, 1e-3])
def test_a_wave_that_hardly_reaches_an_edge_comes_back(solver, excess):
    """A sine of half a step, or little more: the steps err by no more than half a step, and their integral is small."""
    parts = {
        "wave": {"type": "sine", "amplitude": repr(0.5 * (1 + excess)), "frequency": "1 Hz"},
        "steps": {"type": "quantizer", "step": "1"},
        "sum": {"type": "integrator"},
    }
    nets = {"u": ["wave.y", "steps.u"], "y": ["steps.y", "sum.u"], "i": ["sum.y"]}
    run = circuit(components=parts, nets=nets, simulation={"stop": "1 s"}).simulate(solver=solver)
    assert np.abs(run["steps.y"] - run["wave.y"]).max() <= 0.5 * (1 + excess) + 1e-6
    assert abs(run["sum.y"][-1]) < 0.05
