"""Signals against their definitions, and the quantities they carry."""

import math

import numpy as np
import pytest
from building import circuit
from crescentlab.components.noise import Noise
from crescentlab.components.signal_arithmetic import DeadBand, Gain, Limiter, Product, Sum
from crescentlab.components.signal_formulas import Expression
from crescentlab.components.signal_tables import Table, TimeTable
from crescentlab.components.signals import Chirp, Constant, Pulse, Ramp, Sine, Step
from reading import rows

from crescentlab.errors import InputError
from crescentlab.maths import Event

BAR, LPM = 1e5, 1e-3 / 60
LAG = {"type": "first_order_lag", "output_quantity": "pressure", "input_quantity": "pressure", "time_constant": "1 ms"}
"""Something with a state, so that there is something to integrate."""


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


def test_chirp_is_at_rest_before_its_sweep_and_stops_at_both_ends():
    """The mean before; begin and end of the sweep stand in the result as instants of their own, f without a jump at
    the end; the run has at least 8 rows for each of its 60 turns, so none of them is stepped over.
    """
    chirp = {
        "type": "chirp",
        "mean": "5 bar",
        "amplitude": "1 bar",
        "start_frequency": "10 Hz",
        "end_frequency": "110 Hz",
    }
    result = circuit(
        components={"chirp": {**chirp, "at": "0.1 s", "duration": "1 s"}, "lag": LAG},
        nets={"u": ["chirp.y", "lag.u"], "y": ["lag.y"]},
        simulation={"stop": "1.1 s"},
    ).simulate()
    before = result.time < 0.1
    assert np.all(result["chirp.y"][before] == 5 * BAR)
    assert np.all(result["chirp.f"][before] == 0.0)
    assert 0.1 in result.time
    assert result["chirp.f"][-1] == pytest.approx(110.0)
    assert result.time.size > 8 * 60
    crossings = np.count_nonzero(np.diff(np.sign(result["chirp.y"][~before] - 5 * BAR)))
    assert abs(crossings - 120) <= 2


def test_a_logarithmic_chirp_needs_two_frequencies():
    """ln(f1/f0) = 0 would divide by zero; so the reader of the circuit says."""
    with pytest.raises(ValueError, match="two frequencies that differ"):
        Chirp(amplitude=1.0, start_frequency=10.0, end_frequency=10.0, duration=1.0, sweep="logarithmic")
    linear = Chirp(amplitude=1.0, start_frequency=10.0, end_frequency=10.0, duration=1.0)
    sine = Sine(amplitude=1.0, frequency=10.0)
    for t in (0.02, 0.73, 4.0):
        assert linear.equations(t=t)["y"] == pytest.approx(sine.equations(t=t)["y"], abs=1e-12)


def test_limiter():
    """Inside the limits the input, outside the limit; each crossing of a limit is an instant of the run."""
    limiter = Limiter(low="-1 bar", high="2 bar")
    assert carried(limiter) == {"u": "pressure", "y": "pressure"}
    assert [limiter.equations(u=u * BAR)["y"] / BAR for u in (-5, -1, 0.5, 2, 9)] == [-1, -1, 0.5, 2, 2]
    with pytest.raises(ValueError, match=r"high \(1 bar\) must lie above low \(2 bar\)"):
        Limiter(low="2 bar", high="1 bar")
    result = circuit(
        components={
            "ramp": {"type": "ramp", "before": "-2", "after": "3", "duration": "5 s"},
            "part": {"type": "limiter", "low": "-1", "high": "1"},
        },
        nets={"u": ["ramp.y", "part.u"], "y": ["part.y"]},
        simulation={"stop": "5 s"},
    ).simulate()
    for corner in (1.0, 3.0):
        assert np.min(np.abs(result.time - corner)) < 1e-8


def test_dead_band():
    """Nothing within the band, what exceeds it beyond, antisymmetric."""
    band = DeadBand(half_width="5 %")
    assert [band.equations(u=u)["y"] for u in (-0.2, -0.05, 0.0, 0.05, 0.2)] == pytest.approx([-0.15, 0, 0, 0, 0.15])


# --- noise ------------------------------------------------------------------------------------------------------------


def noisy(seed: int, distribution: str = "normal", stop: str = "50 ms") -> np.ndarray:
    """The samples of a run, one row of each."""
    result = circuit(
        components={
            "noise": {"type": "noise", "mean": "2 bar", "standard_deviation": "1 bar", "sample_time": "1 ms",
                      "seed": str(seed), "distribution": distribution},
            "lag": LAG,
        },
        nets={"u": ["noise.y", "lag.u"], "y": ["lag.y"]},
        simulation={"stop": stop, "output_step": "0.5 ms"},
    ).simulate()  # fmt: skip
    return rows(result, "noise.y", np.arange(0.5e-3, float(stop.split()[0]) * 1e-3, 1e-3))


@pytest.mark.parametrize("distribution", ["normal", "uniform"])
def test_noise_is_the_same_on_floats_and_in_a_run(distribution):
    """Sample by sample to the last digits of sqrt, log, cos; the first from the start on, one more each tick."""
    part = Noise(mean="2 bar", standard_deviation="1 bar", sample_time="1 ms", seed=7, distribution=distribution)
    values = {held.name: float(part.start_of(held)[0]) for held in (Noise.s1, Noise.s2)}
    expected = []
    for _ in range(50):
        made = part.equations(**values)
        expected.append(made["y"])
        values = made["samples"].then
    np.testing.assert_allclose(noisy(7, distribution), expected, rtol=1e-13)
    np.testing.assert_array_equal(noisy(7, distribution), noisy(7, distribution))


def test_neighbouring_seeds_have_nothing_in_common():
    """The correlation of two series of 50 has a standard error of 1/sqrt(50); 4 of them."""
    first, second = noisy(1) - 2 * BAR, noisy(2) - 2 * BAR
    assert abs(np.mean(first * second)) / BAR**2 < 4 / math.sqrt(50)
    assert not np.any(first == second)


def test_another_seed_needs_no_new_circuit():
    """The seed only sets held values, so a study over seeds assembles once."""
    own = circuit(
        components={"noise": {"type": "noise", "standard_deviation": "1", "sample_time": "1 ms"}},
        nets={"u": ["noise.y"]},
        simulation={"stop": "3 ms"},
    )
    first, second = (own.simulate(parameters={"noise.seed": seed}) for seed in ("1", "2"))
    assert first.system is second.system
    assert first["noise.y"][-1] != second["noise.y"][-1]


@pytest.mark.parametrize(("seed", "text"), [(1.5, "whole number, not 1.5"), (-1, "greater than or equal to 0")])
def test_seeds_are_whole_numbers(seed, text):
    """Others are refused."""
    with pytest.raises(ValueError, match=text):
        Noise(standard_deviation=1.0, sample_time=1.0, seed=seed)


def test_uniform_noise_stays_within_its_bounds():
    """Mean +- sqrt(3) standard deviations; 1000 samples reach to 1 % of both (0.995^1000 = 0.7 % do not)."""
    z = (noisy(3, "uniform", "1000 ms") / BAR - 2) / math.sqrt(3)
    assert np.all(np.abs(z) < 1)
    assert z.max() > 0.99
    assert z.min() < -0.99


# --- formulas ---------------------------------------------------------------------------------------------------------


def test_expression_in_a_circuit():
    """Inputs of their own quantities; power of pressure and flow over a ramp."""
    result = circuit(
        components={
            "p": {"type": "constant", "value": "100 bar"}, "q": {"type": "ramp", "after": "6 L/min", "duration": "1 s"},
            "power": {"type": "expression", "formula": "min(u1 * u2, 800 W) + 1 W * t / (1 s)",
                      "inputs": ["pressure", "flow"], "output_quantity": "power"},
        },
        nets={"u1": ["p.y", "power.u1"], "u2": ["q.y", "power.u2"], "y": ["power.y"]},
        simulation={"stop": "1 s", "output_step": "0.1 s"},
    ).simulate()  # fmt: skip
    assert rows(result, "power.y", [0.0, 0.5, 1.0]) == pytest.approx([0.0, 500.5, 801.0])
    assert result.quantity("power.y").name == "power"


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"formula": "u1 + 1 bar"}, "cannot add a pure number and a pressure"),
        ({"formula": "u1 * u2"}, "'u2' is no input: did you mean u1"),
        ({"formula": "u1", "inputs": ["pressure"]}, "gives a value in Pa, output_quantity ratio is in 1"),
        ({"formula": "u1 > 2"}, "gives no number"),
        ({"formula": "u1 +"}, "is not an expression"),
        ({"formula": "__import__('os')"}, "unknown function '__import__'"),
        ({"formula": "u1", "inputs": ["presure"]}, "did you mean pressure"),
    ],
)
def test_wrong_formulas_are_explained(given, text):
    """When the circuit is read, not when it runs."""
    with pytest.raises(ValueError, match=text):
        Expression(**given)


@pytest.mark.parametrize(
    ("times", "mean"),
    [
        ({"at": "-250 ms", "period": "100 ms", "width": "40 ms"}, 1.4),
        ({"at": "-1 s", "period": "10 ms", "width": "4 ms"}, 1.4),
        ({"at": "-70 ms", "width": "100 ms"}, 1.03),
    ],
)
def test_a_pulse_that_began_before_the_start_goes_on(times, mean):
    """Mean over one second of 1 outside and 2 within the pulses, by hand."""
    run = circuit(
        components={"p": {"type": "pulse", "high": "2", "low": "1", **times}}, nets={"y": ["p.y"]},
        simulation={"stop": "1 s"},
    ).simulate()  # fmt: skip
    assert run.mean("p.y") == pytest.approx(mean, rel=1e-12)


def test_what_samples_at_an_edge_sees_the_pulse():
    """y = y_1 from t_k on: samples at the edges themselves catch every pulse, and a pulse of a whole period stays."""
    parts = {
        "half": {"type": "pulse", "high": "2", "low": "1", "period": "20 ms", "width": "10 ms"},
        "whole": {"type": "pulse", "high": "2", "low": "1", "period": "10 ms", "width": "10 ms"},
        "one": {"type": "sample_and_hold", "sample_time": "10 ms"},
        "other": {"type": "sample_and_hold", "sample_time": "10 ms"},
    }
    nets = {"a": ["half.y", "one.u"], "b": ["one.y"], "c": ["whole.y", "other.u"], "d": ["other.y"]}
    simulation = {"stop": "1 s", "stop_when": "whole.y < 1.5"}
    run = circuit(components=parts, nets=nets, simulation=simulation).simulate()
    assert run.time[-1] == 1.0
    assert run.mean("one.y") == pytest.approx(1.5, rel=1e-9)
    assert run["other.y"].min() == 2.0


def test_differences_of_temperature_are_in_kelvin():
    """5 degC as an amplitude would be 278 K; a mean of 40 degC is a temperature."""
    sine = {"type": "sine", "mean": "40 degC", "frequency": "1 Hz"}
    with pytest.raises(InputError, match="'5 degC': this is a difference of two temperatures; write 5 K"):
        circuit(components={"s": {**sine, "amplitude": "5 degC"}}, nets={"y": ["s.y"]}).simulate(stop="1 s")
    run = circuit(components={"s": {**sine, "amplitude": "5 K"}}, nets={"y": ["s.y"]}).simulate(stop="1 s")
    assert run["s.y"].max() == pytest.approx(318.15, abs=0.1)
