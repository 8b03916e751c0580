"""Spectra over whole periods and waterfalls over shaft revolutions, against Fourier series in closed form."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from building import OIL, alone, circuit

import crescentlab as cl
from crescentlab.analysis.spectrum import Series, spectra, spectra_of_rows
from crescentlab.analysis.spectrum.dense import Dense
from crescentlab.analysis.spectrum.waterfall import waterfalls
from crescentlab.cli import main
from crescentlab.component import Component, Equations
from crescentlab.domain import gives_signal, observable, reads_rotation, state
from crescentlab.errors import InputError
from crescentlab.maths import Expr, cos, exp, fabs, pi, sin, sqrt, when
from crescentlab.result import Result
from crescentlab.units import Pressure, Ratio

PERIOD = 0.01
ROUNDING = 1e-9
"""Promised accuracy of lines relative to the largest."""


class TwoSines(Component):
    """3 bar + 0.5 bar sin(2 pi 100 Hz t + 30 deg) + 0.1 bar sin(2 pi 1300 Hz t), and an unused integrator."""

    y = observable(Pressure, "two sines")
    z = state(Ratio, "unused")

    def equations(self, t: Expr) -> Equations:
        first = 5e4 * cos(2 * pi * 100 * t + pi / 6 - pi / 2)
        return {"y": 3e5 + first + 1e4 * cos(2 * pi * 1300 * t - pi / 2), "der_z": 0.0}


class Edge(Component):
    """sqrt(20 ms - t): no number from there on; and |sin|, whose bends lie anywhere in a step."""

    y = observable(Ratio, "square root")
    bent = observable(Ratio, "magnitude of a sine of 100 Hz")
    z = state(Ratio, "unused")

    def equations(self, t: Expr) -> Equations:
        return {"y": sqrt(0.02 - t), "bent": fabs(sin(2 * pi * 100 * t + 0.1)), "der_z": 0.0}


class Sawtooth(Component):
    """z rises by 100 a second and falls by 1 whenever it reaches 1: a sawtooth of 10 ms."""

    z = state(Ratio, "sawtooth", start=0.0)

    def equations(self, z: Expr) -> Equations:
        return {"der_z": 100.0, "falls": when(z >= 1.0, z=z - 1.0)}


class Fading(Component):
    """A sine that dies out: cos(2 pi 100 Hz t) exp(-t/tau), tau = 20 ms."""

    y = observable(Ratio, "fading sine")
    z = state(Ratio, "unused")

    def equations(self, t: Expr) -> Equations:
        return {"y": cos(2 * pi * 100 * t) * exp(-t / 0.02), "der_z": 0.0}


class Comb(Component):
    """A signal of orders 13 and 26 of its shaft."""

    shaft = reads_rotation("the shaft")
    y = gives_signal(Pressure, "the signal")

    def equations(self, phi_shaft: Expr) -> Equations:
        return {"y": 3e5 + 2e4 * cos(13 * phi_shaft + 0.3) + 5e3 * cos(26 * phi_shaft)}


def sines(stop: str = "40 ms") -> Result:
    return alone(TwoSines, simulation={"stop": stop}).simulate(solver="rk45")


def run_up() -> Result:
    """500 to 4000 rpm in 1 s."""
    parts = {
        "drive": {"type": "ramp", "before": "500 rpm", "after": "4000 rpm", "duration": "1 s"},
        "shaft": {"type": "signal_speed_source"},
        "comb": {"type": "comb"},
    }
    nets = {"asked": ["drive.y", "shaft.speed"], "turning": ["shaft.shaft", "comb.shaft"], "out": ["comb.y"]}
    return circuit(Comb, components=parts, nets=nets, simulation={"stop": "1 s"}).simulate(solver="rk45")


# -- whole periods -------------------------------------------------------------------------------


@pytest.mark.parametrize("periods", [1, 3])
def test_sines_are_their_lines_and_nothing_else(periods: int) -> None:
    """Definition of a Fourier line; the window ends at 40 ms, so that phases must count from time zero."""
    (found,) = spectra(sines(), ["part.y"], PERIOD, periods=periods)
    exact = np.zeros(found.frequency.size, complex)
    exact[periods - 1] = 5e4 * np.exp(1j * (np.pi / 6 - np.pi / 2))
    exact[13 * periods - 1] = 1e4 * np.exp(-1j * np.pi / 2)
    assert np.abs(found.lines - exact).max() < ROUNDING * 5e4
    assert found.mean == pytest.approx(3e5, rel=1e-12)
    assert [round(line.frequency, 6) for line in found.strongest(10)] == [100.0, 1300.0]
    assert found.error < 1e-8 * 5e4


def test_phases_do_not_depend_on_the_window() -> None:
    """A window of whole periods shifted by a third of one has the same lines, for t is the time of the run."""
    whole, shifted = (spectra(sines(stop), ["part.y"], PERIOD)[0] for stop in ("40 ms", "43.333333333333 ms"))
    assert np.abs(whole.lines - shifted.lines).max() < ROUNDING * 5e4


def test_a_square_wave_has_odd_lines_of_4_over_pi_n() -> None:
    """Amplitudes 4/(pi n) of a square wave of +-1, exact across its jumps (Bracewell, The Fourier Transform, 2000)."""
    parts = {"p": {"type": "pulse", "low": "-1", "high": "1", "width": "5 ms", "period": "10 ms"}}
    result = circuit(components=parts, nets={"y": ["p.y"]}, simulation={"stop": "40 ms"}).simulate(solver="rk45")
    (found,) = spectra(result, ["p.y"], PERIOD, highest=10_000)
    n = np.arange(1, 101)
    exact = np.where(n % 2 == 1, 4 / (np.pi * n), 0.0)
    assert np.abs(found.amplitude - exact).max() < ROUNDING
    left_out = 1 - (exact**2).sum() / 2  # Parseval: the mean square of +-1 is 1
    assert found.rms == pytest.approx(1.0, rel=1e-9)
    assert found.share == pytest.approx(1 - left_out, rel=1e-9)


@pytest.mark.parametrize("solver", ["rk45", "rodas"])
def test_a_sawtooth_of_a_state_has_lines_of_1_over_pi_n(solver: str) -> None:
    """1/(pi n) of a sawtooth of height 1; events are located to 1e-13 of the run, so lines to 1e-9."""
    result = alone(Sawtooth, simulation={"stop": "55 ms"}).simulate(solver=solver)
    (found,) = spectra(result, ["part.z"], PERIOD, periods=2)
    n = np.arange(1, found.frequency.size + 1) / 2
    exact = np.where(n % 1 == 0, 1 / (np.pi * n), 0.0)
    assert np.abs(found.amplitude - exact).max() < ROUNDING
    assert found.mean == pytest.approx(0.5, abs=1e-9)


def test_a_fading_sine_says_how_far_from_periodic_it_is() -> None:
    """|y(t) - y(t - T)|/|y(t)| = e^{T/tau} - 1 everywhere, so of the rms as well (its mean is 1e-3 of its ripple)."""
    result = alone(Fading, simulation={"stop": "40 ms"}).simulate(solver="rk45")
    (found,) = spectra(result, ["part.y"], PERIOD)
    assert found.change == pytest.approx(np.expm1(0.5) * np.hypot(1, found.mean / found.rms), rel=1e-9)
    (steady,) = spectra(sines(), ["part.y"], PERIOD)
    assert steady.change is not None
    assert steady.change < 1e-9
    assert spectra(sines("10 ms"), ["part.y"], PERIOD)[0].change is None


def test_bends_inside_a_piece_are_found() -> None:
    """|sin| = 2/pi - 4/pi sum cos(2 n w t)/(4 n^2 - 1): no event marks its bends; pieces are split until they show."""
    result = alone(Edge, simulation={"stop": "15 ms"}).simulate(solver="rk45")
    (found,) = spectra(result, ["part.bent"], PERIOD)
    n = np.arange(1, found.frequency.size // 2 + 1)
    assert found.amplitude[1::2] == pytest.approx(4 / np.pi / (4 * n**2 - 1), abs=ROUNDING)
    assert found.amplitude[::2].max() < ROUNDING
    assert found.mean == pytest.approx(2 / np.pi, abs=ROUNDING)


def test_what_is_no_number_is_refused() -> None:
    result = alone(Edge, simulation={"stop": "30 ms"}).simulate(solver="rk45")
    with pytest.raises(InputError, match=r"part\.y is not a finite number at 0\.02"):
        spectra(result, ["part.y"], PERIOD)


def test_dense_values_are_those_of_the_result() -> None:
    """At the steps themselves; a vector's elements by their names."""
    result = cl.load("relief_valve").simulate(solver="rodas")
    dense = Dense(result, ["line.p", "valve.q"])
    t = result.trajectory.steps.t
    inner = np.flatnonzero(np.diff(t) > 0)[:-1] + 1
    assert dense.at(t[inner])[:, 0] == pytest.approx(result["line.p"][inner], rel=1e-9)
    with pytest.raises(InputError, match=r"did you mean line\.p"):
        Dense(result, ["line.pp"])


def test_the_pump_has_its_lines_where_equation_32_says() -> None:
    """f = n z_1/60 and its multiples: 433.3, 866.7, 1300 Hz at 2000 rpm (Rundo & Corvaglia 2016, Eq. 32, Fig. 21)."""
    pump = cl.load("crescent_pump")
    result = pump.simulate("63 ms", solver="rodas", rtol=1e-4)
    (found,) = spectra(result, ["delivery.p"], 0.03, highest=2000)  # a revolution: lines at every shaft order
    strongest = found.strongest(3, shaft=2000 * np.pi / 30)
    assert [line.order for line in strongest[:2]] == pytest.approx([13, 26], rel=1e-9)
    bins = found.frequency[1] - found.frequency[0]
    assert bins == pytest.approx(100 / 3)
    for f in (433.3, 866.7, 1300.0):
        near = np.abs(found.frequency - f) < 4 * bins
        assert abs(found.frequency[near][np.argmax(found.amplitude[near])] - f) <= bins
    assert pump.period(pump.design()) == pytest.approx(1 / 433.3333, rel=1e-6)


# -- files ---------------------------------------------------------------------------------------


def rows(n: int = 256, periods: int = 3) -> Series:
    """0.5 bar sin(2 pi 100 Hz t) + 0.1 bar cos(2 pi 300 Hz t) on an even grid, its end included."""
    t = np.arange(n * periods + 1) * PERIOD / n
    y = 3e5 + 5e4 * np.sin(2 * np.pi * 100 * t) + 1e4 * np.cos(2 * np.pi * 300 * t)
    return Series("run.csv", t, {"p": y}, {"p": "Pa"})


def test_rows_of_a_file_give_the_same_lines() -> None:
    """The discrete Fourier transform of whole periods is exact for lines below half the sampling frequency."""
    for periods in (1, 2):
        (found,) = spectra_of_rows(rows(), ["p"], PERIOD, periods=periods)
        exact = np.zeros(found.frequency.size, complex)
        exact[periods - 1], exact[3 * periods - 1] = -5e4j, 1e4
        assert np.abs(found.lines - exact).max() < ROUNDING * 5e4
        assert found.error < ROUNDING * 5e4
        assert found.quantity.name == "pressure"
        assert (found.start, found.stop) == pytest.approx(((3 - periods) * PERIOD, 3 * PERIOD), rel=1e-12)
        assert found.change == pytest.approx(0, abs=1e-9)


def test_rows_without_their_last_end_begin_with_the_file() -> None:
    """Three periods whose end is not among the rows: the window is the whole file, 0 to 30 ms."""
    whole = rows()
    part = Series(whole.source, whole.t[:-1], {"p": whole.values["p"][:-1]}, whole.units)
    (found,) = spectra_of_rows(part, ["p"], PERIOD, periods=3)
    assert (found.start, found.stop) == pytest.approx((0, 3 * PERIOD), abs=1e-12)
    assert abs(found.lines[2] + 5e4j) < ROUNDING * 5e4


def test_rows_too_coarse_say_that_they_alias() -> None:
    """Every second of 4 rows a period sees 100 Hz and 300 Hz as one: the lines differ by an amplitude."""
    (found,) = spectra_of_rows(rows(8), ["p"], PERIOD)
    assert found.error == pytest.approx(1e4, rel=1e-6)  # with every second row, 4 a period, 300 Hz folds onto 100 Hz


def test_rows_that_fit_no_period_are_refused() -> None:
    uneven = Series("run.csv", np.array([0.0, 1e-3, 3e-3, 4e-3]), {"p": np.zeros(4)}, {"p": "Pa"})
    with pytest.raises(InputError, match=r"not an even grid; name the circuit .* --output-step"):
        spectra_of_rows(uneven, ["p"], PERIOD)
    with pytest.raises(InputError, match=r"not a whole number of them; simulate with --output-step '0.027343"):
        spectra_of_rows(rows(), ["p"], 0.007)
    with pytest.raises(InputError, match=r"does not hold 9 x 10 ms; simulate longer"):
        spectra_of_rows(rows(), ["p"], PERIOD, periods=9)


# -- waterfalls ----------------------------------------------------------------------------------


@pytest.mark.parametrize(("window", "revolutions"), [("hann", 4), ("hann", 2), ("whole", 1)])
def test_orders_of_a_run_up_are_exact(window: str, revolutions: int) -> None:
    """A signal of orders 13 and 26 has these lines alone at every speed; Hann's window spreads them by 2/R orders."""
    (found,) = waterfalls(run_up(), ["comb.y"], "shaft.shaft.omega", window=window, revolutions=revolutions, highest=40)
    for order, amplitude, phase in ((13, 2e4, 0.3), (26, 5e3, 0.0)):
        line = found.lines[:, found.orders == order][:, 0]
        assert np.abs(line - amplitude * np.exp(1j * phase)).max() < ROUNDING * 2e4
    far = (np.abs(found.orders - 13) > 1.9 / revolutions) & (np.abs(found.orders - 26) > 1.9 / revolutions)
    assert found.amplitude[:, far].max() < ROUNDING * 2e4
    assert np.abs(found.mean - 3e5).max() < ROUNDING * 3e5
    assert [found.orders[k] for k in found.strongest(2)] == [13, 26]


def test_windows_of_a_run_up_are_whole_revolutions() -> None:
    """omega = w0 + a t turns by 2 pi k at t = (sqrt(w0^2 + 4 pi k a) - w0)/a; 37.5 revolutions in 1 s."""
    (found,) = waterfalls(run_up(), ["comb.y"], "shaft.shaft.omega", revolutions=4, highest=20)
    low, high = 500 * np.pi / 30, 4000 * np.pi / 30
    rate = high - low
    edges = (np.sqrt(low**2 + 4 * np.pi * np.arange(38) * rate) - low) / rate
    assert found.time == pytest.approx((edges[:-4] + edges[4:]) / 2, rel=1e-9)
    assert found.speed == pytest.approx(8 * np.pi / (edges[4:] - edges[:-4]), rel=1e-9)
    assert found.frequency[-1, found.orders == 13] == pytest.approx(13 * found.speed[-1] / (2 * np.pi))


def test_waterfalls_refuse_what_turns_no_revolution() -> None:
    result = run_up()
    with pytest.raises(InputError, match=r"needs the variable of a shaft's speed"):
        waterfalls(result, ["comb.y"], "comb.y")
    with pytest.raises(InputError, match=r"makes 37.5 revolutions .* fewer than the 40"):
        waterfalls(result, ["comb.y"], "shaft.shaft.omega", revolutions=40)
    with pytest.raises(InputError, match="a Hann window needs at least 2"):
        waterfalls(result, ["comb.y"], "shaft.shaft.omega", revolutions=1)
    with pytest.raises(InputError, match="write one of hann, whole"):
        waterfalls(result, ["comb.y"], "shaft.shaft.omega", window="flat")


# -- the command ---------------------------------------------------------------------------------

BENCH = f"""\
crescentlab: 1
title: Pulsating flow through a throttle
fluid: {{{", ".join(f"{k}: {v}" for k, v in OIL.items())}}}
parameters: {{ripple: 100 Hz, turning: 1500 rpm}}
components:
  wave: {{type: sine, mean: 20 L/min, amplitude: 1 L/min, frequency: = ripple}}
  pump: {{type: signal_flow_source}}
  line: {{type: capacity, volume: 50 cm^3, start: {{p: 2.6 bar}}}}
  shaft: {{type: speed_source, speed: = turning}}
  eye: {{type: speed_sensor}}
  hole: {{type: throttle, area: 20 mm^2}}
  tank: {{type: tank}}
nets:
  asked: [wave.y, pump.flow]
  p: [pump.port, line.port, hole.a]
  t: [hole.b, tank.port]
  turn: [shaft.shaft, eye.shaft]
  seen: [eye.y]
simulation: {{stop: 60 ms, period: = 1 / ripple}}
"""


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bench.yaml").write_text(BENCH, encoding="utf-8")
    return tmp_path


def said(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> tuple[int, str, str]:
    code = main(arguments)
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def test_the_command_prints_lines_in_display_units(bench: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = said(
        ["spectrum", "bench.yaml", "wave.y", "line.p", "--orders", "turning", "-o", "l.csv", "--plot"], capsys
    )
    assert code == 0
    assert "1 period of 10 ms (100 Hz)" in out
    assert "100 Hz      4    1 L/min  -90.0 deg" in " ".join(out.split("\n"))
    assert "mean 20 L/min" in out
    assert (bench / "l.png").stat().st_size > 10_000
    with (bench / "l.csv").open(newline="") as file:
        titles, mean, first, *more = csv.reader(file)
    assert titles[:3] == ["frequency [Hz]", "order", "wave.y [m^3/s]"]
    assert float(mean[2]) == pytest.approx(20e-3 / 60)
    assert [float(v) for v in first[:3]] == pytest.approx([100, 4, 1e-3 / 60])
    assert titles[3] == "wave.y phase [deg]"
    assert float(first[3]) == pytest.approx(-90)  # a sine is a cosine a quarter of a turn late
    assert len(more) == 49


def test_the_command_prints_json_in_si(bench: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["spectrum", "bench.yaml", "wave.y", "--orders", "eye.y", "--periods", "2", "--json", "--quiet"]
    code, out, _ = said([*arguments, "--set", "ripple=200 Hz", "-o", "l.json"], capsys)
    found = json.loads(out)
    assert code == 0
    assert found["period"] == pytest.approx(0.005)
    assert found["shaft_speed"] == pytest.approx(1500 * np.pi / 30)
    (line,) = found["variables"]["wave.y"]["lines"]
    assert line["frequency"] == pytest.approx(200)
    assert line["order"] == pytest.approx(8)
    assert line["amplitude"] == pytest.approx(1e-3 / 60, rel=1e-9)
    assert json.loads((bench / "l.json").read_text())["variables"]["wave.y"]["lines"][0] == line


def test_the_periodic_state_has_the_lines_of_a_long_run(bench: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The throttle and its volume forget their start in some ms, so that both windows are the periodic state."""
    tight = ["--rtol", "1e-8", "--solver", "rodas", "--json"]
    _, out, _ = said(["spectrum", "bench.yaml", "line.p", "--periodic", *tight], capsys)
    _, long, _ = said(["spectrum", "bench.yaml", "line.p", "--stop", "500 ms", *tight], capsys)
    first, second = (json.loads(text)["variables"]["line.p"]["lines"][0] for text in (out, long))
    assert first["amplitude"] == pytest.approx(second["amplitude"], rel=1e-6)
    assert first["frequency"] == pytest.approx(100)


def test_a_result_file_serves_where_its_grid_fits(bench: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", "bench.yaml", "-o", "even.nc", "--output-step", "0.05 ms", "--quiet"]) == 0
    assert main(["simulate", "bench.yaml", "-o", "steps.csv", "--quiet"]) == 0
    code, out, _ = said(
        ["spectrum", "even.nc", "wave.y", "--frequency", "100 Hz", "--orders", "eye.y", "--json"], capsys
    )
    assert code == 0
    (line,) = json.loads(out)["variables"]["wave.y"]["lines"]
    assert line["amplitude"] == pytest.approx(1e-3 / 60, rel=1e-9)
    assert line["order"] == pytest.approx(4)
    code, _, error = said(["spectrum", "steps.csv", "wave.y", "--frequency", "100 Hz"], capsys)
    assert code == 2
    assert "its rows are steps of the solver, not an even grid" in error


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["wave.x"], "no variable matches: did you mean wave.y"),
        (["wave.y", "--period", "10"], "a time needs a unit"),
        (["wave.y", "--period", "10 ms", "--frequency", "100 Hz"], "say the same; write one of them"),
        (["wave.y", "--frequency", "0 Hz"], "must be above 0"),
        (["wave.y", "--periods", "7"], "does not hold 7 x 10 ms; simulate longer, for example --stop '80 ms'"),
        (["wave.y", "--periods", "0"], "periods 0: write a whole number from 1 on"),
        (["wave.y", "--from", "55 ms"], "there are 0 periods of 10 ms; simulate longer (--stop), or begin earlier"),
        (["wave.y", "--from", "500 ms"], "--from 500 ms: the run ends at 60 ms already; simulate longer"),
        (["wave.y", "--highest", "0"], "--highest 0: a frequency has a number and a unit; write for example 5 kHz"),
        (["wave.y", "--highest", "0 Hz"], "--highest 0 Hz must be above 0; write for example 5 kHz"),
        (["wave.y", "--highest", "50 Hz"], "there is no line up to 50 Hz; the first is at 100 Hz"),
        (["wave.y", "--orders", "turnin"], "no shaft speed of this name: did you mean turning"),
        (["wave.y", "--orders", "0 rpm"], "the shaft stands still"),
        (["wave.y", "--waterfall"], "needs the variable of the shaft's speed"),
        (["wave.y", "--waterfall", "--orders", "turning"], "a waterfall needs a variable"),
        (["wave.y", "--periodic", "--stop", "1 s"], "--periodic gives exactly one period"),
        (["wave.y", "-o", "lines.nc"], "lines are written as .csv or .json"),
        (["wave.y", "-o", "nowhere/lines.csv"], "the folder nowhere does not exist"),
        (["wave.y", "--lines", "0"], "print at least one"),
        (["wave.y", "--revolutions", "3"], "--revolutions belongs to a waterfall"),
        (["wave.y", "--highest-order", "30"], "--highest-order belongs to a waterfall"),
        (["wave.y", "--waterfall", "--orders", "eye.y", "--revolutions", "0"], "--revolutions 0: a Hann window needs"),
        (["wave.y", "--waterfall", "--orders", "eye.y", "--highest-order", "0"], "write a number from 1 to 10000"),
        (["wave.y", "--waterfall", "--orders", "eye.y", "--highest", "1 kHz"], "write --highest-order"),
    ],
)
def test_wrong_options_are_told_in_one_sentence(
    bench: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], told: str
) -> None:
    code, _, error = said(["spectrum", "bench.yaml", *arguments], capsys)
    assert code == 2
    assert told in error
    assert error.count("\n") == 1


def test_a_circuit_without_a_period_says_what_to_write(bench: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (bench / "bench.yaml").write_text(BENCH.replace(", period: = 1 / ripple", ""), encoding="utf-8")
    code, _, error = said(["spectrum", "bench.yaml", "wave.y"], capsys)
    assert code == 2
    assert "write --period '30 ms'" in error


def test_the_command_draws_a_waterfall(bench: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The flow of 100 Hz is of order 100 Hz 2 pi/omega, from 12 at 500 rpm down to 3 at 2000 rpm."""
    ramp = "{type: ramp, before: 500 rpm, after: 2000 rpm, duration: 500 ms}"
    text = BENCH.replace("{type: speed_source, speed: = turning}", "{type: signal_speed_source}")
    text = text.replace("  eye:", f"  drive: {ramp}\n  eye:").replace(
        "  turn:", "  ask: [drive.y, shaft.speed]\n  turn:"
    )
    (bench / "bench.yaml").write_text(text.replace("stop: 60 ms", "stop: 500 ms"), encoding="utf-8")
    code, out, _ = said(
        ["spectrum", "bench.yaml", "wave.y", "--orders", "eye.y", "--waterfall", "--revolutions", "2",
         "--highest-order", "20", "--plot", "-o", "w.csv"],
        capsys,
    )  # fmt: skip
    assert code == 0
    assert "windows of 2 revolutions from" in out
    assert (bench / "w.png").stat().st_size > 10_000
    with (bench / "w.csv").open(newline="") as file:
        titles, *table = csv.reader(file)
    assert titles[:3] == ["time [s]", "speed [rad/s]", "wave.y order 0.5 [m^3/s]"]
    for row in table:
        numbers = np.array(row, float)
        order = 0.5 * (1 + np.argmax(numbers[2:]))
        assert order == pytest.approx(100 * 2 * np.pi / numbers[1], abs=1.0)  # two orders a bin, speed not constant
