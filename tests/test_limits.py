"""Limits of pressures: absolute zero of those that ports give, the highest for which a fluid's law is meant, and what
is said of both, by every solver alike."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from textwrap import dedent

import numpy as np
import pytest
from refusing import Refusal

import crescentlab as cl
from crescentlab.commands.simulate import finite
from crescentlab.errors import InputError, SimulationError
from crescentlab.library import installed

SOLVERS = ["auto", "lsoda", "bdf", "radau", "rk45", "dop853", "cvode", "rodas", "dopri"]
OIL = "fluid: {type: simple_oil, density: 860 kg/m^3, kinematic_viscosity: 35 cSt, bulk_modulus: 14000 bar}"
ZERO = -101325.0 * (1 + 1e-9)
"""Absolute zero as gauge pressure [Pa], with the room that is left for rounding."""

CONSTANT = f"""\
crescentlab: 1
{OIL}
parameters: {{low: 0 bar}}
components:
  source:
    type: pressure_source
    pressure: -5 bar
  hole: {{type: orifice, area: 5 mm^2}}
  tank: {{type: tank, pressure: = low}}
nets:
  p_line: [source.port, hole.a]
  t_line: [hole.b, tank.port]
simulation: {{stop: 10 ms}}
"""
DRIVEN = f"""\
crescentlab: 1
{OIL}
components:
  wish: SIGNAL
  source: {{type: signal_pressure_source}}
  hole: {{type: orifice, area: 5 mm^2}}
  line: {{type: capacity, volume: 1 L}}
nets:
  p_line: [source.port, hole.a]
  t_line: [hole.b, line.port]
  s: [wish.y, source.pressure]
simulation: {{stop: 10 ms}}
"""
SIGNALS = {
    "sine": (
        "{type: sine, output_quantity: pressure, mean: 3 bar, amplitude: 5 bar, frequency: 100 Hz}",
        (math.pi + math.asin((3e5 - ZERO) / 5e5)) / (200 * math.pi),
        "-1.0133",
    ),
    "ramp": (
        "{type: ramp, output_quantity: pressure, before: 1 bar, after: -9 bar, duration: 10 ms}",
        (1e5 - ZERO) / 1e8,
        "-1.0133",
    ),
    "step": ("{type: step, output_quantity: pressure, before: 0 bar, after: -5 bar, at: 4 ms}", 4e-3, "-5"),
}
"""Signals, when they pass absolute zero by hand, and the pressure then in bar."""


def test_a_constant_pressure_below_absolute_zero_is_refused_with_its_line(refused: Refusal) -> None:
    """Exit code 2 with the line that wrote it; the option where --set did."""
    refused.write({"c.yaml": CONSTANT})
    said = r"-5 bar gauge is below absolute zero \(-1\.0133 bar\); no fluid has such a pressure"
    for command in ("check", "simulate", "steady"):
        code, _, err = refused.run(command, "c.yaml")
        assert (code, err.count("\n")) == (2, 1)
        assert re.match(rf"c\.yaml:7: source\.pressure: {said}", err), err
    code, _, err = refused.run("simulate", "c.yaml", "--set", "source.pressure=-2 bar")
    assert code == 2
    assert err.startswith("--set source.pressure: -2 bar gauge is below absolute zero"), err
    code, _, err = refused.run("simulate", "c.yaml", "--set", "source.pressure=0 bar", "--set", "low=-1.1 bar")
    assert (code, err[:25]) == (2, "c.yaml:9: tank.pressure: "), err
    for pressure in ("-1 bar", "-101325 Pa"):  # absolute zero itself is a pressure
        assert (
            refused.run("simulate", "c.yaml", "--quiet", "-o", "none", "--set", f"source.pressure={pressure}")[0] == 0
        )


def circuit(folder: Path, text: str) -> cl.Circuit:
    """The circuit of a text."""
    file = folder / "c.yaml"
    file.write_text(dedent(text), encoding="utf-8")
    return cl.load(file)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize(("signal", "end", "shown"), SIGNALS.values(), ids=SIGNALS)
def test_a_driven_pressure_ends_the_run_where_it_passes_absolute_zero(tmp_path, solver, signal, end, shown):
    """Exact instants by hand: 3 bar + 5 bar sin(w t) = -p_atm, and so on; what was computed until then is kept."""
    with pytest.raises(SimulationError, match=rf"source\.port\.p is {re.escape(shown)} bar gauge, below abs") as failed:
        circuit(tmp_path, DRIVEN.replace("SIGNAL", signal)).simulate(solver=solver)
    result = failed.value.result
    assert result.time[-1] == pytest.approx(end, rel=1e-9)
    assert np.all(np.isfinite(result["line.p"]))
    assert result["source.port.p"][0] > 0 or signal.startswith("{type: step")


def test_a_start_below_absolute_zero_is_refused_with_its_line(refused: Refusal) -> None:
    """Where it was written: a start value, a parameter that gives one, an option; a fluid under tension may."""
    part = "{type: PART, volume: 1 L,\n         start: {p: -5 bar}}"
    line = "{type: distributed_line, cells: 2, length: 2 m, diameter: 10 mm,\n         start_pressure: -5 bar}"
    text = f"""\
crescentlab: 1
{OIL}
components:
  pump: {{type: flow_source, flow: 1 L/min}}
  line: {part.replace("PART", "capacity")}
nets: {{p: [pump.port, line.port]}}
simulation: {{stop: 1 ms}}
"""
    said = "-5 bar gauge is below absolute zero"
    refused.write({"c.yaml": text, "t.yaml": text.replace("bar}", "bar, tension: true}", 1)})
    assert refused.told("simulate", "c.yaml").startswith(f"c.yaml:6: line.start.p: {said}")
    set_to = refused.told("check", "c.yaml", "--set", "line.start.p=-2 bar")
    assert set_to.startswith("--set line.start.p: -2 bar gauge is below absolute zero")
    assert refused.run("check", "t.yaml")[0] == 0
    refused.write(
        {
            "c.yaml": text.replace(part.replace("PART", "capacity"), line)
            .replace("line.port", "line.a")
            .replace("nets:", "  tank: {type: tank}\nnets:")
            .replace("}\nsim", ", t: [line.b, tank.port]}\nsim")
        }
    )
    assert refused.told("check", "c.yaml").startswith(f"c.yaml:6: line.start_pressure: {said}")


@pytest.mark.parametrize("solver", ["lsoda", "rodas"])
def test_a_given_pressure_under_tension_warns_once(tmp_path, solver):
    """As states do: from the first step below -101325 Pa on; the run goes on to its end."""
    text = DRIVEN.replace("SIGNAL", SIGNALS["sine"][0]).replace("14000 bar}", "14000 bar, tension: true}")
    trajectory = circuit(tmp_path, text).simulate(solver=solver).trajectory
    assert trajectory.complete
    [warning] = trajectory.warnings
    found = re.match(r"source\.port\.p is -(\S+) bar gauge at (\S+) s, below absolute zero \(-1\.0133 bar\)$", warning)
    assert found, warning
    assert float(found[1]) > 1.0133
    assert float(found[2]) == pytest.approx(SIGNALS["sine"][1], abs=10e-3 / 50)  # no step is longer than a 50th


@pytest.mark.parametrize("solver", ["lsoda", "rodas"])
def test_the_end_of_a_lax_wendroff_line(tmp_path, solver):
    """Water at 1 m/s from 3 bar, stopped at 10 ms: rho a v = 14.8 bar comes back negative after 2 L/a.

    2 L/a = 134.9 ms at 1482.4 m/s (Marczak); the grid smears the front over a few of its 181 us. Between ticks the
    pressure of the end is no held value, and depends on the time and on what ticks.
    """
    text = """\
        crescentlab: 1
        fluid: {type: water, temperature: 20 degC}
        components:
          res: {type: pressure_source, pressure: 3 bar}
          line: {type: lax_wendroff_line, max_pressure: 40 bar, length: 100 m, diameter: 50 mm, start_pressure: 3 bar,
                 start_flow: 117.81 L/min}
          close: {type: step, output_quantity: flow, before: -117.81 L/min, after: 0 L/min, at: 10 ms}
          valve: {type: signal_flow_source}
        nets: {pr: [res.port, line.a], pv: [line.b, valve.port], s: [close.y, valve.flow]}
        simulation: {stop: 0.5 s}
        """
    made = circuit(tmp_path, text)
    run = made.simulate(solver=solver, check=False)
    assert "below absolute zero" in run.trajectory.error
    assert run.time[-1] == pytest.approx(0.010 + 200 / 1482.4, abs=10 * 181e-6)
    assert not made.system().bits.on_time[made.system().bits.floors].any()  # no scan ahead at every tick


class TestAtmosphere:
    """Absolute zero is that of the run's own fluid, not of the first one that the circuit was loaded with."""

    def test_states(self, tmp_path):
        """1 L/min out of 70 cm^3 of 14000 bar oil reaches -p_a after V p_a/(beta q) = 0.304 ms per atmosphere."""
        text = f"""\
            crescentlab: 1
            {OIL}
            components:
              pump: {{type: flow_source, flow: -1 L/min}}
              line: {{type: capacity, volume: 70 cm^3}}
            nets: {{p_line: [pump.port, line.port]}}
            simulation: {{stop: 100 ms}}
            """
        made = circuit(tmp_path, text)
        for bar in (1.01325, 2.0, 0.5):
            setting = {"fluid.atmospheric_pressure": f"{bar} bar"}
            for solver in ("lsoda", "rodas"):
                run = made.simulate(parameters=setting, solver=solver, check=False)
                assert run.trajectory.status == "failed"
                exact = 70e-6 * bar * 1e5 / (14000e5 * (1e-3 / 60))
                assert run.time[-1] == pytest.approx(exact, rel=1e-3)  # the oil's own expansion: p/beta = 1e-4

    def test_given(self, tmp_path):
        """The ramp of 1000 bar/s from 1 bar on."""
        made = circuit(tmp_path, DRIVEN.replace("SIGNAL", SIGNALS["ramp"][0]))
        for bar in (1.01325, 2.0, 0.5):
            run = made.simulate(parameters={"fluid.atmospheric_pressure": f"{bar} bar"}, check=False)
            assert run.time[-1] == pytest.approx((1 + bar) * 1e-3, rel=1e-8)


# -- the range of a law --------------------------------------------------------------------------

BENCH = f"""\
crescentlab: 1
{OIL}
components:
  pump: {{type: flow_source, flow: 40 L/min}}
  line: {{type: capacity, volume: 1 L, start: {{p: 100 bar}}}}
nets: {{p: [pump.port, line.port]}}
simulation: {{stop: 200 ms}}
"""
SHUT = """\
crescentlab: 1
fluid: {type: mineral_oil, grade: ISO VG 46, temperature: 40 degC}
components:
  drive: {type: speed_source, speed: 1450 rpm}
  pump: {type: fixed_displacement_pump, displacement: 20 cc/rev}
  line: {type: capacity, volume: 1 L}
  cmd: {type: pulse, low: 1, high: 0, at: 1 s, width: 60 s}
  valve: {type: two_two_valve, area: 50 mm2}
  tank: {type: tank}
nets:
  w: [drive.shaft, pump.shaft]
  p1: [pump.outlet, line.port, valve.a]
  s: [cmd.y, valve.stroke]
  pt: [pump.inlet, valve.b, tank.port]
simulation: {stop: 70 s}
"""


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_run_that_leaves_its_fluids_range_warns_and_goes_on(tmp_path, solver):
    """Time of the crossing by hand: V rho/rho_0 = V e^(p/beta) grows by q, so t = V (e^(p/b) - e^(p_0/b))/q."""
    for highest, given in ((1000.0, {}), (300.0, {"fluid.highest_pressure": "300 bar"})):
        run = circuit(tmp_path, BENCH).simulate(parameters=given, solver=solver)
        assert run.trajectory.complete
        [warning] = run.trajectory.warnings
        said = (
            rf"line\.p passes {highest:g} bar gauge, up to which the law of simple_oil is meant, at (\S+) s and "
            rf"reaches (\S+) bar; the flow of 40 L/min into line has no way out: give it one"
        )
        assert (found := re.match(said, warning)), warning
        exact = 1e-3 * (math.exp(highest / 14000) - math.exp(100 / 14000)) / (40e-3 / 60)
        assert float(found[1]) == pytest.approx(exact, rel=2e-3)  # between two steps, on a line
        assert float(found[2]) == pytest.approx(run["line.p"].max() / 1e5, rel=1e-4)
    assert not circuit(tmp_path, BENCH).simulate(parameters={"fluid.highest_pressure": "5000 bar"}).trajectory.warnings


def test_a_pressure_that_is_given_has_a_range_too(tmp_path):
    """A ramp of 1000 bar/s from 1 bar on passes 1000 bar after 999 ms; the line follows."""
    signal = SIGNALS["ramp"][0].replace("-9 bar", "1201 bar").replace("10 ms", "1.2 s")
    [warning] = circuit(tmp_path, DRIVEN.replace("SIGNAL", signal)).simulate(1.2).trajectory.warnings
    assert re.match(r"source\.port\.p passes 1000 bar gauge, .*, at 0\.999 s and reaches 1201 bar \(1 more", warning)


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_flow_without_a_way_out_is_named_instead_of_a_solver(refused: Refusal, solver: str) -> None:
    """A pump before a shut valve: dp/dt = beta q/V, some 400 bar within the 100 ms after 1 s, and on beyond any law."""
    refused.write({"c.yaml": SHUT})
    code, out, err = refused.run("simulate", "c.yaml", "-o", "none", "--solver", solver)
    assert code == 3
    assert re.search(r"line\.p passes 800 bar gauge, up to which the law of mineral_oil is meant, at 1\.0\d+ s", out)
    assert re.search(r"into line\s+has no way out: give it one, for example a relief_valve", err), err
    assert "--solver" not in err
    assert not re.search(r"\b(nan|inf)\b", out + err), out + err


def test_no_ledger_holds_what_is_no_number(refused: Refusal) -> None:
    """The viscosity of the oil overflows on the way: null in JSON, words in text, None in Python."""
    refused.write({"c.yaml": SHUT})
    code, out, _ = refused.run("simulate", "c.yaml", "-o", "none", "--json", "--solver", "rodas")
    assert code == 3
    report = json.loads(out, parse_constant=lambda word: pytest.fail(f"{word} in JSON"))
    energy = report["balance"]["energy"]
    assert energy["circuit"] is None
    assert energy["dissipated"]["pump"] is None
    assert energy["dissipated"]["valve"] > 0
    assert any("the ledger of energy is not determined: " in warning for warning in report["warnings"])
    _, out, _ = refused.run("simulate", "c.yaml", "-o", "none", "--solver", "rodas")
    assert re.search(r"heat .* valve; not determined: pump", out)
    assert re.search(r"of the power not determined: .*pump", out)
    books = cl.load(refused.folder / "c.yaml").simulate(solver="rodas", check=False).balance.as_json()
    assert finite(books) == books


def test_settings_above_the_range_warn_at_check(refused: Refusal) -> None:
    """A relief valve that opens beyond the oil's law, and nothing for one below, nor for drops and moduli."""
    relief = "{type: relief_valve, cracking_pressure: 1500 bar, opening_range: 2000 bar, area: 20 mm^2}"
    text = BENCH.replace("nets: {p: [pump.port, line.port]}", (
        f"  valve: {relief}\n  tank: {{type: tank}}\n"
        "nets: {p: [pump.port, line.port, valve.a], t: [valve.b, tank.port]}"
    ))  # fmt: skip
    refused.write({"c.yaml": text})
    code, out, _ = refused.run("check", "c.yaml", "--json")
    assert code == 0
    [warning] = json.loads(out)["warnings"]
    assert warning.startswith(
        "valve.cracking_pressure is 1500 bar, above 1000 bar, up to which the law of simple_oil is meant"
    )
    assert "  warning: valve.cracking_pressure is 1500 bar" in refused.run("check", "c.yaml")[1]
    for setting in ("valve.cracking_pressure=150 bar", "fluid.highest_pressure=2000 bar"):
        assert json.loads(refused.run("check", "c.yaml", "--json", "--set", setting)[1])["warnings"] == []


@pytest.mark.parametrize(
    ("temperature", "said"),
    [
        ("170 degC", r"fluid: its temperature is 170 degC; the law of its density is meant for -50 to 150 degC$"),
        ("-60 degC", r"fluid: its temperature is -60 degC; "),
        ("130 degC", r"fluid: its viscosity is 1\.72 cSt at 130 degC; the straight line .* is meant from 2 cSt on$"),
        ("40 degC", None),
    ],
)
def test_an_oil_beyond_its_temperatures_warns(refused: Refusal, temperature: str, said: str | None) -> None:
    """A thin oil of 10 and 2.6 cSt at 40 and 100 degC has 1.72 cSt at 130 degC by the straight line of ASTM D341."""
    oil = f"density_15: 850 kg/m^3, viscosity_1: 10 cSt, viscosity_2: 2.6 cSt, temperature: {temperature}"
    text = BENCH.replace(OIL, f"fluid: {{type: mineral_oil, {oil}}}")
    refused.write({"c.yaml": text.replace("200 ms", "1 ms")})
    for command in (["check"], ["simulate", "-o", "none"]):
        code, out, _ = refused.run(command[0], "c.yaml", "--json", *command[1:])
        warnings = json.loads(out)["warnings"]
        assert code == 0
        assert (warnings == []) if said is None else any(re.match(said, warning) for warning in warnings), warnings


def test_a_separator_that_starts_beyond_its_stops_is_refused_by_name(tmp_path):
    """Its sides would have negative volumes."""
    text = f"""\
        crescentlab: 1
        {OIL}
        components:
          pump: {{type: flow_source, flow: 1 L/min}}
          piston: {{type: piston_separator, volume: 1 L, start: {{V_a: START}}}}
          hole: {{type: orifice, area: 5 mm^2}}
          tank: {{type: tank}}
        nets: {{p: [pump.port, piston.a], q: [piston.b, hole.a], t: [hole.b, tank.port]}}
        simulation: {{stop: 10 ms}}
        """
    for solver in ("lsoda", "rodas"):
        for start in ("-2 L", "1.1 L"):
            with pytest.raises(SimulationError, match="piston: a side has used up its dead volume"):
                circuit(tmp_path, text.replace("START", start)).simulate(solver=solver)
        assert circuit(tmp_path, text.replace("START", "0.5 L")).simulate(solver=solver).trajectory.complete


def test_steady_refuses_what_is_driven_below_absolute_zero(tmp_path):
    """The time stands still after the step to -5 bar."""
    with pytest.raises((SimulationError, InputError), match=r"source\.port\.p is -5 bar gauge, below absolute zero"):
        cl.steady(circuit(tmp_path, DRIVEN.replace("SIGNAL", SIGNALS["step"][0].replace("4 ms", "0 ms"))))


def test_the_figures_of_the_page_on_fluids():
    """Against Hayward's law, written out, a constant modulus of the same size at 0 bar, as docs/fluids.md prints it."""
    oil = installed().fluids["mineral_oil"](grade="ISO VG 46", temperature=313.15, air_fraction=0.0)
    stiff = float(oil.bulk_modulus(0.0))
    for bar, low, high in ((300, 0.16, 0.001), (500, 0.24, 0.004), (1000, 0.41, 0.014)):
        p, m = bar * 1e5, 5.6
        modulus = (stiff + m * p) * (stiff + (m - 1) * p) / stiff
        density = (stiff + m * p) / (stiff + (m - 1) * p)
        assert oil.bulk_modulus(p) == pytest.approx(modulus, rel=1e-9)
        assert 1 - stiff / modulus == pytest.approx(low, abs=0.005)
        assert math.exp(p / stiff) / density - 1 == pytest.approx(high, abs=0.0005)


def test_each_fluid_knows_its_range():
    """The sources' ranges; the base class's own for a fluid that says nothing."""
    highest = {name: cls.model_fields["highest_pressure"].default / 1e5 for name, cls in installed().fluids.items()}
    assert highest == {
        "simple_oil": 1000.0, "aerated_oil": 1000.0, "cavitating_oil": 1000.0, "mineral_oil": 800.0, "water": 1000.0
    }  # fmt: skip
