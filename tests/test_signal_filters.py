"""Lags, transfer functions, sampling and delays: how they start, what they refuse, what an input's jump becomes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from building import circuit
from crescentlab.components.signal_delays import Delay, PadeDelay
from crescentlab.components.signal_filters import TransferFunction
from reading import rows

from crescentlab.result import Result

BAR = 1e5


def behind(source: dict[str, Any], part: dict[str, Any], stop: str = "1 s", step: str = "10 ms") -> Result:
    """A run of one part behind one source."""
    return circuit(
        components={"source": source, "part": part},
        nets={"u": ["source.y", "part.u"], "y": ["part.y"]},
        simulation={"stop": stop, "rtol": "1e-9", "output_step": step},
    ).simulate()


@pytest.mark.parametrize("kind", ["first_order_lag", "second_order_lag"])
def test_a_lag_started_at_its_end_stays_there(kind):
    """`start` is in the units of the output, and at the gain's value nothing moves."""
    settings = {"time_constant": "10 ms"} if kind == "first_order_lag" else {"natural_frequency": "10 Hz"}
    lag = {"type": kind, "gain": "4 bar", "per": "2 mm", "start": {"value": "2 bar"}, **settings}
    result = behind({"type": "constant", "value": "1 mm"}, lag)
    assert np.all(result["part.y"] == 2 * BAR)
    assert result.quantity("part.y").name == "pressure"
    assert result.quantity("part.value").name == "pressure"


def test_units_of_a_transfer_function():
    """1/(1 + s T) with T = 5 ms written as a time unit, 5 bar per 1 mm: 63.2 % of 10 bar after 5 ms of 2 mm."""
    part = {"type": "transfer_function", "gain": "5 bar", "per": "1 mm", "time_unit": "5 ms"}
    result = behind({"type": "constant", "value": "2 mm"}, part, "5 ms", "1 ms")
    assert result["part.y"][-1] == pytest.approx(10 * BAR * (1 - np.exp(-1)), rel=1e-7)


def test_states_of_a_transfer_function_have_the_size_of_its_input():
    """10 Hz and 1 kHz in one filter: at rest the first state is u, the others 0, whatever the coefficients' size."""
    w1, w2 = 2 * np.pi * 10, 2 * np.pi * 1000
    denominator = [float(a) for a in np.polymul([1, 2 * w1, w1**2], [1, 2 * w2, w2**2])]
    part = TransferFunction(numerator=[denominator[-1]], denominator=denominator)
    at_rest = part.equations(x=np.array([3.0, 0.0, 0.0, 0.0]), u=3.0)
    assert at_rest["der_x"] == pytest.approx(np.zeros(4), abs=1e-9)
    assert at_rest["y"] == pytest.approx(3.0)


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"numerator": [1, 0], "denominator": [2]}, "numerator has order 1, the denominator 0"),
        ({"denominator": [0, 1]}, "first coefficient of the denominator is 0"),
        ({"denominator": []}, "at least 1 item"),
    ],
)
def test_improper_transfer_functions_are_refused(given, text):
    """With what to do instead."""
    with pytest.raises(ValueError, match=text):
        TransferFunction(**given)


STEP = {"type": "step", "before": "1 bar", "after": "3 bar", "at": "100 ms"}


def test_a_step_through_a_delay():
    """The value of before from the start on; the sample of 145 ms ago is the last of before, of 150 ms the step."""
    part = {"type": "delay", "output_quantity": "pressure", "delay": "50 ms", "samples": "10"}
    y = behind(STEP, part, "0.2 s", "2.5 ms")
    assert np.all(y["part.y"][y.time <= 0.145] == BAR)
    assert rows(y, "part.y", [0.1475, 0.15, 0.1525, 0.2]) / BAR == pytest.approx([2, 3, 3, 3], abs=1e-9)


@pytest.mark.parametrize("order", [1, 2, 3, 5])
def test_a_pade_delay_starts_at_rest(order):
    """A constant of 1 bar is 1 bar at once; after a step of the input the end value is reached."""
    part = {"type": "pade_delay", "output_quantity": "pressure", "delay": "10 ms", "order": str(order)}
    y = behind(STEP, part, "0.3 s")
    assert y["part.y"][y.time < 0.1] == pytest.approx(BAR, rel=1e-9)
    assert y["part.y"][-1] == pytest.approx(3 * BAR, rel=1e-6)


def test_both_delays_agree_on_a_slow_signal():
    """A sine of 1 Hz 100 ms late: the buffer errs by (pi/500)^2/2, Pade's phase by 4e-7 rad at omega tau = 0.63."""
    sine = {"type": "sine", "amplitude": "1", "frequency": "1 Hz"}
    exact = {"type": "delay", "delay": "100 ms", "samples": "50"}
    smooth = {"type": "pade_delay", "delay": "100 ms"}
    late = np.arange(60, 100) / 100  # 0.5 s after the start the transient is over
    first, second = (rows(behind(sine, part), "part.y", late) for part in (exact, smooth))
    expected = np.sin(2 * np.pi * (late - 0.1))
    assert first == pytest.approx(expected, abs=(np.pi / 500) ** 2)
    assert second == pytest.approx(expected, abs=1e-6)


def test_parts_that_sample_in_one_instant_read_the_values_of_before_it():
    """A second sample and hold on the same clock is one sample late."""
    result = circuit(
        components={
            "ramp": {"type": "ramp", "after": "1", "duration": "1 s"},
            "first": {"type": "sample_and_hold", "sample_time": "100 ms"},
            "second": {"type": "sample_and_hold", "sample_time": "100 ms"},
        },
        nets={"u": ["ramp.y", "first.u"], "v": ["first.y", "second.u"], "w": ["second.y"]},
        simulation={"stop": "1 s", "output_step": "50 ms"},
    ).simulate()
    t = np.array([0.25, 0.55, 0.95])
    assert rows(result, "first.y", t) == pytest.approx([0.2, 0.5, 0.9])
    assert rows(result, "second.y", t) == pytest.approx([0.1, 0.4, 0.8])


def test_the_buffer_is_shifted_in_an_event():
    """The oldest sample leaves, the newest enters; all are the input at the start."""
    part = Delay(delay=0.3, samples=3)
    found = part.equations(t=0.3, past=np.array([1.0, 2.0, 3.0, 4.0]), sampled_at=0.25, begun=1.0, u=5.0)
    assert found["y"] == pytest.approx(1.5)
    assert found["samples_u"].dt == pytest.approx(0.1)
    assert found["samples_u"].then["past"].tolist() == [2.0, 3.0, 4.0, 5.0]
    first = part.equations(t=0.0, past=np.zeros(4), sampled_at=0.0, begun=0.0, u=5.0)["begins"]
    assert first.condition
    assert first.then["past"].tolist() == [5.0] * 4


def test_a_pade_delay_passes_all_frequencies():
    """Its numerator is its denominator at -s, so the direct path is (-1)^n."""
    for order in range(1, 11):
        through = PadeDelay(delay=1.0, order=order).equations(x=np.zeros(order), begun=1.0, u=1.0)["y"]
        assert through == pytest.approx((-1) ** order)


def test_a_run_goes_on_where_another_ended():
    """Buffers, samples and the noise's series are kept: 0 to 1 s is 0 to 0.43 s and on, between two ticks of each."""
    made = circuit(
        components={
            "noise": {"type": "noise", "standard_deviation": "1", "sample_time": "20 ms"},
            "hold": {"type": "sample_and_hold", "sample_time": "35 ms"},
            "late": {"type": "delay", "delay": "100 ms", "samples": "4"},
            "smooth": {"type": "pade_delay", "delay": "100 ms"},
            "lag": {"type": "first_order_lag", "time_constant": "50 ms"},
        },
        nets={
            "raw": ["noise.y", "hold.u", "lag.u"], "filtered": ["lag.y", "late.u", "smooth.u"],
            "held": ["hold.y"], "y1": ["late.y"], "y2": ["smooth.y"],
        },
        simulation={"stop": "1 s", "rtol": "1e-9"},
    )  # fmt: skip
    whole = made.simulate()
    parts = made.simulate("1 s", start=made.simulate("0.43 s"))
    for name in ("noise.y", "hold.y", "late.y", "smooth.y"):
        assert parts[name][-1] == pytest.approx(whole[name][-1], abs=1e-7), name
