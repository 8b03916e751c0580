"""Wrong settings on the command line, runs that fail and keep what they have, and circuits damaged at random."""

from __future__ import annotations

import json
import random
import re
from importlib import resources
from pathlib import Path

import pytest
import xarray as xr
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from refusing import CIRCUIT, OIL, Refusal

from crescentlab.cli import main
from crescentlab.units import QUANTITIES

# -- settings ------------------------------------------------------------------------------------

SETTINGS = {
    "twice": (["supply=1 L/min", "supply=2 L/min"], "--set supply is given twice ('1 L/min' and '2 L/min'); keep one"),
    "no such parameter": (["suply=1 L/min"], "--set suply: nothing has this name: did you mean supply?"),
    "no such component": (["hol.area=1 mm^2"], "--set hol.area: nothing has this name: did you mean hole.area"),
    "no such state": (["line.start.q=1 bar"], "nothing has this name: did you mean line.start.p?"),
    "no equals sign": (["supply"], "--set supply: write NAME=VALUE, for example --set supply='30 L/min'"),
    "no value": (["supply="], "write NAME=VALUE"),
    "another unit": (
        ["supply=1 bar"],
        "--set supply: '1 bar': 'bar' is a unit of pressure, not of flow; write one of L/min",
    ),
    "no unit": (["supply=1"], "--set supply: '1': a flow needs a unit: 1 m3/s, 1000 L/s or 60000 L/min?"),
    "unknown unit": (["supply=1 mm/foo"], "unknown unit 'mm/foo' for a flow"),
    "a word": (["supply=much"], "--set supply: 'much' is not a number with a unit; write for example 1 L/min"),
    "another unit of a component": (["hole.area=1 bar"], "--set hole.area: '1 bar': 'bar' is a unit of pressure"),
    "another unit of a start": (["line.start.p=1 mm"], "--set line.start.p: '1 mm': 'mm' is a unit of length"),
    "another unit by expression": (["hole.area== supply"], "--set hole.area: the expression gives a flow [m^3/s]"),
    "out of bounds": (["hole.area=-1 mm^2"], "--set hole.area must be at least 0, not -1 mm2"),
    "no whole number": (["hole.count=2.5"], "--set hole.count must be a whole number, not '2.5'"),
    "infinite": (["supply=1e999 L/min"], "--set supply: '1e999 L/min' is not a finite number"),
    "a circle": (["supply== supply"], "--set supply: parameters depend on each other: supply -> supply"),
}


@pytest.mark.parametrize(("given_texts", "said"), SETTINGS.values(), ids=SETTINGS)
def test_settings(refused: Refusal, given_texts: list[str], said: str) -> None:
    """They stand in no file, so the message begins with the option."""
    refused.write({"c.yaml": CIRCUIT})
    told = refused.told("check", "c.yaml", *[word for text in given_texts for word in ("--set", text)])
    assert told.startswith("--set ")
    assert said in told


# -- failing runs --------------------------------------------------------------------------------

HEAD = """\
from crescentlab.component import Component
from crescentlab.domain import *
from crescentlab.maths import *
from crescentlab.units import *

class Part(Component):
    x = state(Length, "x", start=1.0)
    v = state(Velocity, "v")
    y = observable(Length, "twice x")

    def equations(self, x, v, t):
        still = {"der_x": 0.0 * x, "der_v": -v, "y": 2 * x}
        return {**still, """
PART = "crescentlab: 1\nlibrary: [./mine.py]\ncomponents: {a: {type: part}}\nsimulation: {stop: 2 s}\n"

FAILURES = {
    "not a number": ('"der_x": x * sqrt(0.5 - t)', r"a\.x is no longer a finite number", 0.5),
    "not a number at the start": ('"der_x": log(x - 2)', r"a\.x has a rate that is not a finite number at the", 0.0),
    "not a number after an event": ('"e": when(t > 0.5, x=log(x - 2))', r"a\.x is no longer a finite number", 0.5),
    "infinite": ('"der_x": 2 * x * x', r"a\.x limits it; try", 0.5),
    "a step that collapses": ('"der_x": -1 / x', r"step size collapsed to .*; a\.x limits it; try --solver", 0.5),
    "ever faster events": (
        '"der_x": v, "der_v": -9.81, "e": when(x < 0, x=0.0, v=-v / 2)',
        r"a\.e happens faster and faster",
        3 * (2 / 9.81) ** 0.5,
    ),
    "events without end": (
        '"e": when((t > 0.5) & (x < 2), x=3.0), "f": when((t > 0.5) & (x > 2), x=1.0)',
        r"events keep causing each other at one instant: a\.\w, a\.\w",
        0.5,
    ),
    "both sides push": (
        '"der_x": event_where(x > 0, -1.0, 1.0)',
        r"both sides push towards the boundary of a: x > 0",
        1.0,
    ),
    "fail_when": ('"der_x": 1.0, "e": fail_when(x > 1.5, "y is {y}; shorten it")', r"a: y is 3000 mm; shorten it", 0.5),
}


@pytest.mark.parametrize(("law", "said", "end"), FAILURES.values(), ids=FAILURES)
def test_failing_runs(refused: Refusal, law: str, said: str, end: float) -> None:
    """Exit code 3, one sentence that names state or event, and a file that says how far the run came.

    Ends by hand: 1/(2 x0) for x' = 2 x^2, x0^2/2 for x' = -1/x, t1 (1 + e)/(1 - e) = 3 t1 for bounces that halve
    the speed; the last step before a failure may fall short of it by 2 %.
    """
    refused.write({"c.yaml": PART, "mine.py": f"{HEAD}{law}}}\n"})
    code, out, err = refused.run("simulate", "c.yaml", "--quiet")
    assert (code, out, err.count("\n")) == (3, "", 1), err
    assert re.search(said, err), err
    assert re.match(r"the run ended at [-\d.e]+ s of 2 s: ", err)
    with xr.open_dataset("c.nc", engine="h5netcdf") as saved:
        assert saved.attrs["complete"] == 0
        assert saved.attrs["error"] == err.strip()
        assert float(saved.time[-1]) == pytest.approx(end, rel=0.02)


@pytest.mark.parametrize("solver", ["auto", "lsoda", "bdf", "radau", "rk45", "dop853", "rodas", "dopri"])
def test_advice_never_names_the_solver_in_use(solver: str, refused: Refusal) -> None:
    """x' = -1/x ends where x = sqrt(1 - 2 t) meets zero, whatever integrates."""
    refused.write({"c.yaml": PART, "mine.py": f'{HEAD}"der_x": -1 / x}}\n'})
    for rtol in ("1e-6", "1e-9"):
        code, _, err = refused.run("simulate", "c.yaml", "--quiet", "-o", "none", "--solver", solver, "--rtol", rtol)
        named = re.search(r"a\.x limits it; try --solver (\w+),", err)
        assert code == 3
        assert named, err
        assert named[1] in {"rodas", "radau", "lsoda"} - {solver}


SUCKED = f"""\
crescentlab: 1
{OIL}
components:
  pump: {{type: flow_source, flow: -1 L/min}}
  line: {{type: capacity, volume: 70 cm^3}}
nets: {{p_line: [pump.port, line.port]}}
simulation: {{stop: 100 ms}}
"""


@pytest.mark.parametrize("solver", ["auto", "rodas", "dopri"])
def test_a_pressure_below_absolute_zero(solver: str, refused: Refusal) -> None:
    """The run ends, unless the fluid may be under tension: then it warns, once.

    1 L/min out of 70 cm^3 of 14000 bar oil: -101325 Pa is reached after V p / (beta q) = 0.304 ms.
    """
    refused.write({"c.yaml": SUCKED, "t.yaml": SUCKED.replace("bar}", "bar, tension: true}")})
    code, _, err = refused.run("simulate", "c.yaml", "--quiet", "--solver", solver)
    assert code == 3
    assert re.search(
        r"line\.p is -[\d.]+ bar gauge at [\d.]+ s, below absolute zero \(-1\.0133 bar\); the oil would", err
    )
    with xr.open_dataset("c.nc", engine="h5netcdf") as saved:
        assert saved.attrs["complete"] == 0
        assert float(saved.time[-1]) == pytest.approx(3.04e-4, rel=0.05)
    code, out, err = refused.run("simulate", "t.yaml", "--quiet", "--json", "--solver", solver)
    assert (code, err) == (0, "")
    (warning,) = json.loads(out)["warnings"]
    assert "below absolute zero" in warning


LINE_UNDER_TENSION = f"""\
crescentlab: 1
{OIL.replace("bar}", "bar, tension: true}")}
components:
  wave: {{type: sine, mean: 20 bar, amplitude: 30 bar, frequency: 50 Hz}}
  source: {{type: signal_pressure_source}}
  line: {{type: lax_wendroff_line, length: 5 m, diameter: 8 mm, max_pressure: 90 bar, start_pressure: 20 bar}}
  end: {{type: capacity, volume: 5 cm^3, start: {{p: 20 bar}}}}
nets:
  u: [wave.y, source.pressure]
  a: [source.port, line.a]
  b: [line.b, end.port]
simulation: {{stop: 40 ms}}
"""


@pytest.mark.parametrize("solver", ["auto", "rodas", "dopri", "lsoda"])
def test_nodes_of_a_line_may_be_under_tension_too(solver: str, refused: Refusal) -> None:
    """Pressures that a line holds between its ticks are treated as states are: warned of, once."""
    refused.write({"c.yaml": LINE_UNDER_TENSION})
    code, out, err = refused.run("simulate", "c.yaml", "--quiet", "--json", "--solver", solver)
    assert (code, err) == (0, "")
    (warning,) = json.loads(out)["warnings"]
    assert "below absolute zero" in warning


def test_a_circuit_without_states_runs(refused: Refusal) -> None:
    """Nothing to integrate: two rows, and an algebraic flow of 0.7 A sqrt(2 dp / rho) through the orifice."""
    text = SUCKED.replace("line: {type: capacity, volume: 70 cm^3}", "line: {type: tank}")
    refused.write({"c.yaml": text})
    code, _, err = refused.run("simulate", "c.yaml", "--quiet")
    assert (code, err) == (0, "")
    with xr.open_dataset("c.nc", engine="h5netcdf") as saved:
        assert saved.attrs["complete"] == 1
        assert float(saved.time[-1]) == pytest.approx(0.1)
        assert float(saved["pump.port.q"][-1]) == pytest.approx(1e-3 / 60)


# -- damaged circuits ----------------------------------------------------------------------------

UNITS = sorted({unit for quantity in QUANTITIES.values() for unit in quantity.units if unit})


def damaged(text: str, seed: int) -> str:
    """The text after one to three small accidents."""
    chance = random.Random(seed)
    lines = text.splitlines()
    for _ in range(chance.randint(1, 3)):
        at = chance.randrange(len(lines))
        line = lines[at]
        words = line.split(" ")
        what = chance.randrange(9)
        if what == 0:
            del lines[at]
        elif what == 1:
            lines.insert(chance.randrange(len(lines)), line)
        elif what == 2 and len(words) > 1:
            a, b = chance.randrange(len(words)), chance.randrange(len(words))
            words[a], words[b] = words[b], words[a]
            lines[at] = " ".join(words)
        elif what == 3:
            lines[at] = re.sub(r"(?<=\d )[\w/^]+", lambda _: chance.choice(UNITS), line, count=1)
        elif what == 4:
            lines[at] = line.replace(":", "", 1)
        elif what == 5 and line:
            cut = chance.randrange(len(line))
            lines[at] = line[:cut] + line[cut + 1 :]
        elif what == 6:
            cut = chance.randrange(len(line) + 1)
            lines[at] = line[:cut] + chance.choice("{}[]:,'\"#&*!|>%@`=- \t0x9") + line[cut:]
        elif what == 7:
            lines[at] = re.sub(
                r"\d+", lambda _: chance.choice(["0", "-1", "1e9", "1e-9", "nan", "999999"]), line, count=1
            )
        else:
            lines[at] = line.replace(chance.choice(words), chance.choice(text.split()), 1)
    return "\n".join(lines) + "\n"


@pytest.fixture(scope="module")
def shipped(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the shipped circuits, their parts and tables."""
    folder = tmp_path_factory.mktemp("shipped")
    for path in Path(str(resources.files("crescentlab.circuits"))).iterdir():
        if path.suffix in (".yaml", ".csv"):
            (folder / path.name).write_text(path.read_text(encoding="utf-8"), encoding="utf-8")
    return folder


@pytest.mark.parametrize(("name", "examples"), [("relief_valve", 120), ("crescent_pump", 40)])
def test_damaged_circuits_never_end_in_a_traceback(
    shipped: Path, capsys: pytest.CaptureFixture[str], name: str, examples: int
) -> None:
    """Whatever happens to its text, a circuit is accepted, or refused in one sentence that begins with a line of it."""
    text = (shipped / f"{name}.yaml").read_text(encoding="utf-8")
    path = shipped / f"damaged_{name}.yaml"

    @settings(
        max_examples=examples, derandomize=True, deadline=None, database=None, suppress_health_check=list(HealthCheck)
    )
    @given(st.integers(0, 2**32))
    def check(seed: int) -> None:
        path.write_text(damaged(text, seed), encoding="utf-8")
        capsys.readouterr()
        code = main(["check", str(path)])
        _, err = capsys.readouterr()
        assert (code, err.count("\n")) in ((0, 0), (2, 1)), f"{seed}: {err}"
        assert code == 0 or re.match(rf"{re.escape(str(shipped))}/\w+\.\w+:[1-9]\d*: ", err), f"{seed}: {err}"

    check()
