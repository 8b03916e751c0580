"""Controllers: limits, anti-windup, starts, samples; and the position servo that is shipped."""

from __future__ import annotations

import functools
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from building import circuit
from crescentlab.components.controllers import PID, SampledPID
from reading import rows

import crescentlab as cl
from crescentlab.circuit import Circuit
from crescentlab.result import Result

ROOT = Path(__file__).resolve().parents[1]
BAR, MM = 1e5, 1e-3
NONE = np.zeros(0)


def loop(control: dict[str, Any], *, after: str = "1", stop: str = "5 s", step: str = "10 ms") -> Result:
    """The controller around 1/(s + 1), a step of the setpoint."""
    return circuit(
        components={
            "step": {"type": "step", "after": after}, "control": control,
            "plant": {"type": "first_order_lag", "time_constant": "1 s"},
        },
        nets={
            "asked": ["step.y", "control.setpoint"], "driven": ["control.output", "plant.u"],
            "found": ["plant.y", "control.measured"],
        },
        simulation={"stop": stop, "rtol": "1e-9", "output_step": step},
    ).simulate()  # fmt: skip


def test_units_of_a_controller():
    """20 % of the stroke per 5 bar of error; the gain's unit names the output, the unit of `per` the inputs."""
    part = PID(gain="20 %", per="5 bar", low="-100 %", high="100 %")
    quantities = {p.name: part.quantity(p.quantity).name for p in part.ports()}
    assert quantities == {"setpoint": "pressure", "measured": "pressure", "output": "ratio"}
    found = part.equations(setpoint=15 * BAR, measured=10 * BAR, integral=NONE, filtered=NONE, begun=1.0)
    assert found["output"] == pytest.approx(0.2)
    assert part.equations(setpoint=99 * BAR, measured=0.0, integral=NONE, filtered=NONE, begun=1.0)["output"] == 1.0


@pytest.mark.parametrize("cls", [PID, SampledPID])
def test_limits_in_order(cls):
    """The message shows both in their unit."""
    more = {"sample_time": 1.0} if cls is SampledPID else {}
    with pytest.raises(ValueError, match=r"high \(1 bar\) must lie above low \(2 bar\)"):
        cls(gain="1 bar", low="2 bar", high="1 bar", **more)


def test_parts_that_are_not_asked_for_have_no_states():
    """A proportional controller would leave a steady solver with states that never move."""
    sizes = [
        [part.size_of(s.size) for s in PID.declared(type(PID.integral))]
        for part in (PID(gain=1.0), PID(gain=1.0, integral_time=1.0), PID(gain=1.0, derivative_time=1.0))
    ]
    assert sizes == [[0, 0], [None, 0], [0, None]]


@pytest.mark.parametrize("sampled", [False, True], ids=["continuous", "sampled"])
def test_a_proportional_controller_leaves_an_error(sampled):
    """1/(1 + K) of the setpoint: 20 % with K = 4."""
    control = {"type": "sampled_pid", "sample_time": "10 ms"} if sampled else {"type": "pid"}
    result = loop({**control, "gain": "4"})
    assert result["plant.y"][-1] == pytest.approx(0.8, rel=1e-6)


def overshoot(**settings: str) -> float:
    """Of a limited PI controller that a far setpoint drives into its limit for 0.7 s."""
    control = {"type": "pid", "gain": "8", "integral_time": "0.2 s", "low": "-1", "high": "1", **settings}
    return float(loop(control, after="0.5")["plant.y"].max()) / 0.5 - 1


def test_anti_windup():
    """Without it (tracking in 1000 s) the integral part that was wound up has to be unwound by an overshoot."""
    assert overshoot() < 0.1
    assert overshoot(tracking_time="1000 s") > 0.4


def test_the_output_stays_within_its_limits():
    """Exactly; what is cut off shows in `unlimited`."""
    result = loop({"type": "pid", "gain": "8", "integral_time": "0.2 s", "low": "-1", "high": "1"}, after="0.5")
    u, v = result["control.output"], result["control.unlimited"]
    assert u.max() == 1.0
    assert v.max() > 1.0
    assert np.all(np.abs(u - np.clip(v, -1, 1)) < 1e-9)


def test_the_derivative_starts_without_a_kick():
    """A measured value of 5 that stays there moves neither controller."""
    for control in ({"type": "pid"}, {"type": "sampled_pid", "sample_time": "10 ms"}):
        result = circuit(
            components={
                "five": {"type": "constant", "value": "5"},
                "control": {**control, "gain": "2", "derivative_time": "1 s"},
            },
            nets={"both": ["five.y", "control.setpoint", "control.measured"], "u": ["control.output"]},
            simulation={"stop": "0.1 s"},
        ).simulate()
        assert result["control.output"] == pytest.approx(np.zeros(result.time.size), abs=1e-12)


def test_samples():
    """The first at the start; between samples the output is held; each sample's instant is a row before and after."""
    result = loop({"type": "sampled_pid", "gain": "4", "sample_time": "0.2 s"}, stop="1 s", step="50 ms")
    y = rows(result, "plant.y", np.arange(0, 1.05, 0.05))
    u = rows(result, "control.output", np.arange(0, 1.05, 0.05))
    assert u[:4] == pytest.approx(4.0)
    for k in range(4, 20):
        assert u[k] == pytest.approx(4 * (1 - y[k - k % 4]), rel=1e-7)


def test_sampling_fast_is_continuous_control():
    """1 ms of sampling is half a millisecond of delay: y' of at most 1.4/s moves 7e-4, and twice that in the loop."""
    settings = {"gain": "1.4", "integral_time": "0.35 s", "low": "-5", "high": "5"}
    smooth = loop({"type": "pid", **settings}, stop="2 s")
    sampled = loop({"type": "sampled_pid", "sample_time": "1 ms", **settings}, stop="2 s")
    t = np.arange(0, 2.01, 0.1)
    assert rows(sampled, "plant.y", t) == pytest.approx(rows(smooth, "plant.y", t), abs=1.4e-3)


# --- the manual -------------------------------------------------------------------------------------------------------


def test_the_pressure_that_the_manual_holds(tmp_path: Path):
    """docs/signals.md: 100 bar at an opening of 31 % by the orifice equation, whose oil is 0.4 % denser at 50 bar.

    Of the noise of 0.5 bar a lag of 5 ms leaves sqrt(h/(2 T)) = 0.16 bar, and a loop slower than that less.
    """
    page = (ROOT / "docs" / "signals.md").read_text(encoding="utf-8")
    (text,) = re.findall(r"```yaml\n# file: held_pressure.yaml\n(.*?)```", page, re.DOTALL)
    (tmp_path / "held_pressure.yaml").write_text(text, encoding="utf-8")
    result = cl.load(tmp_path / "held_pressure.yaml").simulate()
    late = result.time > 0.7
    opening = 20e-3 / 60 / (0.7 * 10e-6 * math.sqrt(2 * 100 * BAR / 860))
    assert opening == pytest.approx(0.31, abs=0.005)
    assert np.mean(result["line.p"][late]) == pytest.approx(100 * BAR, abs=0.16 * BAR)
    assert np.std(result["line.p"][late]) < 0.16 * BAR
    assert np.mean(result["control.output"][late]) == pytest.approx(opening, rel=5e-3)


# --- position_servo ---------------------------------------------------------------------------------------------------

AREA = math.pi / 4 * ((50 * MM) ** 2 - (28 * MM) ** 2)


@functools.cache
def servo() -> Circuit:
    """The shipped circuit, assembled once."""
    return cl.load("position_servo")


def test_position_servo_while_moving():
    """Header: 4.9 mm behind at 100 mm/s; 1 % for the oil's density, which the formula by hand takes as constant."""
    result = servo().simulate()
    late = (result.time > 0.8) & (result.time < 1.1)
    load = (4000 + 2000 * 0.1) / AREA
    assert load == pytest.approx(31.2 * BAR, abs=0.05 * BAR)
    full = 5e-3 / 60 * math.sqrt((140 * BAR - load) / (2 * 5 * BAR))
    stroke = AREA * 0.1 / full
    assert stroke == pytest.approx(0.490, abs=0.0005)
    assert full / AREA / (10 * MM) == pytest.approx(20.4, abs=0.05)  # velocity gain
    assert result["load.v"][late] == pytest.approx(0.1, rel=1e-4)
    assert result["error"][late] == pytest.approx(10 * MM * stroke, rel=1e-2)
    assert result["valve.stroke"][late] == pytest.approx(stroke, rel=1e-2)


def test_position_servo_at_rest():
    """Header: at the end within 1 um; long after it just the stroke at which the rounded edges hold the load."""
    result = servo().simulate()
    assert abs(result["error"][-1]) < 1e-6
    load = 4000 / AREA
    fourth = ((140 * BAR + load) / (140 * BAR - load)) ** 0.25
    x = (fourth - 1) / (fourth + 1)
    assert x == pytest.approx(0.054, abs=0.0005)
    longer = servo().simulate("3 s")
    # 5 %: by hand all edges have one discharge coefficient, but with d_h = 30 um the flow number is 100, tanh(2) = 0.96
    assert longer["control.output"][-1] == pytest.approx(1e-3 * x, rel=5e-2)


def test_position_servo_with_an_integral_part():
    """Header: no error while moving, and an overshoot after it: the integral part holds the stroke it moved with."""
    result = servo().simulate(parameters={"control.integral_time": "100 ms"})
    late = (result.time > 1.0) & (result.time < 1.1)
    assert np.abs(result["error"][late]).max() < 0.01 * MM
    assert result["load.x"].max() > 51 * MM


def test_position_servo_settles():
    """Header: 22.9/s, while the error falls from 3 to 0.5 mm; 3 % for terms of third order, (K T)^2 with K T = 0.1."""
    result = servo().simulate()
    gain = 5e-3 / 60 * math.sqrt((140 * BAR - 4000 / AREA) / (2 * 5 * BAR)) / AREA / (10 * MM)
    lag = 1.4 / (2 * math.pi * 60) + 1e-3
    root = (1 - math.sqrt(1 - 4 * gain * lag)) / (2 * lag)
    assert root == pytest.approx(22.9, abs=0.15)
    falling = (result.time > 1.1) & (result["error"] < 3 * MM) & (result["error"] > 0.5 * MM)
    rate = -np.polyfit(result.time[falling], np.log(result["error"][falling]), 1)[0]
    assert rate == pytest.approx(root, rel=3e-2)


def test_what_reads_a_sample_starts_from_it():
    """50 bar through a sampler: a delay, its approximation, another sampler and a filter begin with 50 bar, not 0."""
    pressure = {"output_quantity": "pressure"}
    parts = {
        "source": {"type": "constant", "value": "50 bar"},
        "sampler": {"type": "sample_and_hold", "sample_time": "10 ms", **pressure},
        "second": {"type": "sample_and_hold", "sample_time": "7 ms", **pressure},
        "delay": {"type": "delay", "delay": "40 ms", "samples": "8", **pressure},
        "pade": {"type": "pade_delay", "delay": "40 ms", **pressure},
        "pid": {"type": "pid", "gain": "2", "per": "1 bar", "derivative_time": "0.1 s", "input_quantity": "pressure"},
        "sampled": {"type": "sampled_pid", "gain": "2", "per": "1 bar", "derivative_time": "0.1 s",
                    "sample_time": "10 ms", "input_quantity": "pressure"},
    }  # fmt: skip
    nets = {
        "u": ["source.y", "sampler.u", "pid.setpoint", "sampled.setpoint"],
        "s": ["sampler.y", "second.u", "delay.u", "pade.u", "pid.measured", "sampled.measured"],
        "a": ["second.y"], "b": ["delay.y"], "c": ["pade.y"], "d": ["pid.output"], "e": ["sampled.output"],
    }  # fmt: skip
    run = circuit(components=parts, nets=nets, simulation={"stop": "100 ms"}).simulate()
    for name in ("second.y", "delay.y", "pade.y"):
        np.testing.assert_allclose(run[name], 50e5, rtol=1e-9)
    for name in ("pid.output", "sampled.output"):
        np.testing.assert_allclose(run[name], 0.0, atol=1e-9)


def test_what_reads_a_mass_starts_after_it_is_on_its_stop():
    """A mass started 20 mm out, beyond its stop at 9 mm: what is sampled at once is 9 mm."""
    parts = {
        "mass": {"type": "mass_with_stops", "mass": "1 kg", "high": "9 mm", "start": {"x": "20 mm"}},
        "sensor": {"type": "position_sensor"},
        "sampler": {"type": "sample_and_hold", "sample_time": "1 s", "output_quantity": "length"},
    }
    nets = {"m": ["mass.port", "sensor.port"], "x": ["sensor.y", "sampler.u"], "s": ["sampler.y"]}
    run = circuit(components=parts, nets=nets, simulation={"stop": "10 ms"}).simulate()
    assert run["sampler.y"][-1] == pytest.approx(9e-3)


@pytest.mark.parametrize("ring", [2, 3])
def test_what_reads_a_ring_of_samplers_starts_after_it(ring):
    """s_0 samples 3 + s_n/2 and each the one before: these begin together, and what reads them after them."""
    parts = {
        "three": {"type": "constant", "value": "3"},
        "add": {"type": "sum", "weights": "[1, 0.5]"},
        **{f"s{k}": {"type": "sample_and_hold", "sample_time": "1 s"} for k in range(ring)},
        "tail": {"type": "sample_and_hold", "sample_time": "1 s"},
        "relay": {"type": "relay", "upper": "5", "lower": "1", "start": {"closed": "1"}},
    }
    parts["add"]["weights"] = ["1", "0.5"]
    nets = {
        "c": ["three.y", "add.u[1]"], "a": ["add.y", "s0.u"],
        **{f"r{k}": [f"s{k}.y", f"s{k + 1}.u"] for k in range(ring - 1)},
        "back": [f"s{ring - 1}.y", "add.u[2]"], "t": ["tail.y"], "y": ["relay.y"],
    }  # fmt: skip
    nets["r0"] = ["s0.y", "s1.u", "tail.u", "relay.u"]
    run = circuit(components=parts, nets=nets, simulation={"stop": "10 ms"}).simulate()
    assert run["s0.y"][-1] == run["tail.y"][-1] == 3.0
    assert run["relay.y"][-1] == 1.0
