"""The command line: every command, exit codes, what stdout and stderr hold, files and their units."""

from __future__ import annotations

import csv
import io
import json
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
import xarray as xr

import crescentlab as cl
from crescentlab.circuit import find
from crescentlab.cli import RUN_KEYS, main
from crescentlab.commands.components import listed
from crescentlab.commands.schema import schema
from crescentlab.component import Component
from crescentlab.errors import InputError
from crescentlab.library import installed

FLUID = "{type: simple_oil, density: 860 kg/m^3, kinematic_viscosity: 35 cSt, bulk_modulus: 14000 bar}"

FILLING = f"""\
crescentlab: 1
title: Filling a line
fluid: {FLUID}
parameters:
  supply: 6 L/min
components:
  jump: {{type: step, output_quantity: flow, before: = supply, after: '= 2 * supply', at: 5 ms}}
  pump: {{type: signal_flow_source}}
  line: {{type: capacity, volume: 100 cm^3, start: {{p: 1 bar}}}}
  load: {{type: orifice, area: 3 mm^2, count: 2}}
  tank: {{type: tank}}
nets:
  wanted: [jump.y, pump.flow]
  p_line: [pump.port, line.port, 'load.a[*]']
  t_line: ['load.b[*]', tank.port]
outputs:
  power: '= p_line.p * sum(load.q)'
simulation: {{stop: 20 ms}}
"""

DRAINING = f"""\
crescentlab: 1
title: Drained below absolute zero
fluid: {FLUID}
components:
  pump: {{type: flow_source, flow: -10 L/min}}
  line: {{type: capacity, volume: 100 cm^3, start: {{p: 5 bar}}}}
nets:
  p_line: [pump.port, line.port]
simulation: {{stop: 100 ms}}
"""


@pytest.fixture(autouse=True)
def _in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every test runs in a folder of its own that holds the two circuits."""
    monkeypatch.chdir(tmp_path)
    Path("filling.yaml").write_text(FILLING, encoding="utf-8")
    Path("draining.yaml").write_text(DRAINING, encoding="utf-8")


def run(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    """Exit code, stdout, stderr of a command run in this process."""
    code = main(arguments)
    out, err = capsys.readouterr()
    return code, out, err


def refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """The one line on stderr of a command that must exit with 2 and print nothing else."""
    code, out, err = run(capsys, *arguments)
    assert code == 2
    assert out == ""
    assert err.count("\n") == 1, "one sentence, no traceback"
    return err.strip()


def command(*arguments: str, **options: Any) -> subprocess.CompletedProcess[str]:
    """A command run as its own process."""
    return subprocess.run(
        [sys.executable, "-m", "crescentlab.cli", *arguments], capture_output=True, text=True, check=False, **options
    )


# -- simulate: what is printed -------------------------------------------------------------------


def test_the_summary_shows_the_run_and_its_variables_in_display_units(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = run(capsys, "simulate", "filling.yaml")
    assert (code, err) == (0, "")
    assert out.startswith("Filling a line\n")
    assert "20 ms" in out
    rows = {line.split()[0]: line.split()[1:] for line in out.splitlines() if line.split()}
    result = cl.load("filling.yaml").simulate()
    p = result["p_line.p"] / 1e5
    assert rows["p_line.p"] == ["bar", *[f"{v:.5g}" for v in (p[-1], result.mean("p_line.p") / 1e5, p.min(), p.max())]]
    assert rows["power"][0] == "W"
    assert "filling.nc" in out


def test_display_units_rule_the_summary(capsys: pytest.CaptureFixture[str]) -> None:
    Path("filling.yaml").write_text(FILLING + "display: {pressure: kPa, time: s}\n", encoding="utf-8")
    _, out, _ = run(capsys, "simulate", "filling.yaml", "-o", "none")
    assert "kPa" in out
    assert "0.02 s" in out


def test_json_holds_every_key(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = run(capsys, "simulate", "filling.yaml", "--json")
    found = json.loads(out)
    assert code == 0
    assert list(found) == list(RUN_KEYS)
    assert (found["status"], found["error"], found["file"], found["warnings"]) == ("done", None, "filling.nc", [])
    assert found["final_time"] == pytest.approx(0.02)
    assert found["states"] == 1
    assert found["steps"] > 0
    assert found["balance"]["circuit"] < 1e-4
    assert list(found["balance"]["components"]) == ["line"]


def test_quiet_prints_nothing_but_json_and_errors(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(capsys, "simulate", "filling.yaml", "--quiet") == (0, "", "")
    _, out, err = run(capsys, "simulate", "filling.yaml", "--quiet", "--json")
    assert json.loads(out)["status"] == "done"
    assert err == ""
    code, out, err = run(capsys, "simulate", "draining.yaml", "--quiet")
    assert (code, out) == (3, "")
    assert "absolute zero" in err


class _Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize(("options", "shown"), [((), True), (("--quiet",), False)])
def test_progress_is_a_bar_on_a_terminal_only(
    options: tuple[str, ...], shown: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    terminal = _Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    assert main(["simulate", "filling.yaml", "-o", "none", *options]) == 0
    assert ("%" in terminal.getvalue()) is shown


# -- simulate: files -----------------------------------------------------------------------------


def test_without_o_the_result_goes_to_the_circuits_name_and_is_replaced(capsys: pytest.CaptureFixture[str]) -> None:
    Path("filling.nc").write_text("old", encoding="utf-8")
    run(capsys, "simulate", "filling.yaml", "--quiet")
    with xr.open_dataset("filling.nc", engine="h5netcdf") as data:
        assert data.attrs["complete"] == 1
        assert data["line.p"].dims == ("time",)
    assert sorted(p.name for p in Path().iterdir()) == ["draining.yaml", "filling.nc", "filling.yaml"]


def test_o_none_writes_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = run(capsys, "simulate", "filling.yaml", "-o", "none", "--json")
    assert code == 0
    assert json.loads(out)["file"] is None
    assert sorted(p.suffix for p in Path().iterdir()) == [".yaml", ".yaml"]


def test_the_three_formats_hold_the_same_numbers_in_si(capsys: pytest.CaptureFixture[str]) -> None:
    """Files are written and read without loss, so equality is exact."""
    for name in ("r.nc", "r.csv", "r.parquet"):
        run(capsys, "simulate", "filling.yaml", "--quiet", "-o", name)
    expected = cl.load("filling.yaml").simulate()
    with Path("r.csv").open(newline="", encoding="utf-8") as file:
        titles, *rows = csv.reader(file)
    numbers = np.array(rows, dtype=float)
    assert titles[0] == "time [s]"
    assert {"line.p [Pa]", "load.q[2] [m^3/s]", "power [W]"} <= set(titles)
    assert len(titles) == len(expected.columns()) + 1
    table = pq.read_table("r.parquet")
    with xr.open_dataset("r.nc", engine="h5netcdf") as data:
        for k, title in enumerate(titles[1:], start=1):
            name, unit = title[:-1].split(" [")
            np.testing.assert_array_equal(numbers[:, k], expected[name])
            np.testing.assert_array_equal(data[name], expected[name])
            np.testing.assert_array_equal(table[name], expected[name])
            assert data[name].attrs["units"] == unit
            assert table.schema.field(name).metadata[b"units"] == unit.encode()
        np.testing.assert_array_equal(data["time"], expected.time)
    np.testing.assert_array_equal(numbers[:, 0], expected.time)
    np.testing.assert_array_equal(table["time"], expected.time)


@pytest.mark.parametrize(
    ("globs", "names"),
    [
        (["load.q[2]"], ["load.q[2]"]),
        (["load.q"], ["load.q[1]", "load.q[2]"]),
        (["load.q*"], ["load.q[1]", "load.q[2]"]),
        (["?_line.p"], ["p_line.p", "t_line.p"]),
        (["power", "line.p", "power"], ["power", "line.p"]),
    ],
)
def test_record_narrows_with_star_and_question_mark_only(
    globs: list[str], names: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    options = [text for glob in globs for text in ("--record", glob)]
    run(capsys, "simulate", "filling.yaml", "--quiet", "-o", "r.csv", *options)
    titles = Path("r.csv").read_text(encoding="utf-8").splitlines()[0].split(",")
    assert [t.rpartition(" [")[0] for t in titles] == ["time", *names]


def test_the_time_of_an_event_stands_twice_before_and_after() -> None:
    result = cl.load("filling.yaml").simulate()
    rows = np.flatnonzero(result.time == 5e-3)
    assert len(rows) == 2
    np.testing.assert_allclose(result["wanted.value"][rows], [1e-4, 2e-4])
    assert np.all(np.diff(result.time) >= 0)


def test_an_output_step_gives_a_uniform_grid_with_the_value_after(capsys: pytest.CaptureFixture[str]) -> None:
    run(
        capsys,
        "simulate",
        "filling.yaml",
        "--quiet",
        "-o",
        "r.csv",
        "--output-step",
        "2.5 ms",
        "--record",
        "wanted.value",
    )
    rows = np.loadtxt("r.csv", delimiter=",", skiprows=1)
    np.testing.assert_allclose(rows[:, 0], np.arange(9) * 2.5e-3, atol=1e-12)
    np.testing.assert_allclose(rows[:, 1], [1e-4] * 2 + [2e-4] * 7)


def test_stop_set_and_rtol_reach_the_run(capsys: pytest.CaptureFixture[str]) -> None:
    """Without load the line fills at beta q/V: 14000 bar * 12 L/min / 1000 cm^3 = 280 bar/s, over 2 ms from 1 bar.

    beta is the liquid's and rho_0/rho = 1 - 1e-4, hence 1e-3.
    """
    settings = [
        "--set",
        "supply=12 L/min",
        "--set",
        "line.volume = 1 L",
        "--set",
        "load.area=0 mm^2",
        "--set",
        "line.start.p=1 bar",
    ]
    run(
        capsys,
        "simulate",
        "filling.yaml",
        "--quiet",
        "-o",
        "r.csv",
        "--stop",
        "2 ms",
        "--rtol",
        "1e-9",
        *settings,
        "--record",
        "line.p",
    )
    rows = np.loadtxt("r.csv", delimiter=",", skiprows=1)
    assert rows[-1, 0] == pytest.approx(2e-3)
    assert rows[-1, 1] - 1e5 == pytest.approx(14000e5 * 2e-4 / 1e-3 * 2e-3, rel=1e-3)


def test_stop_when_ends_the_run_before_its_time(capsys: pytest.CaptureFixture[str]) -> None:
    Path("filling.yaml").write_text(
        FILLING.replace("{stop: 20 ms}", "{stop: 20 ms, stop_when: line.p > 2 bar}"), encoding="utf-8"
    )
    code, out, _ = run(capsys, "simulate", "filling.yaml", "--json")
    found = json.loads(out)
    assert (code, found["status"]) == (0, "stopped")
    assert found["final_time"] < 0.02


@pytest.mark.parametrize("solver", ["auto", "lsoda", "bdf", "radau", "rk45", "dop853", "cvode", "rodas", "dopri"])
def test_every_solver_has_a_name(solver: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(capsys, "simulate", "filling.yaml", "--quiet", "-o", "none", "--solver", solver)[0] == 0


@pytest.mark.parametrize(("flag", "said"), [("--compile", "compiled"), ("--no-compile", "interpreted")])
def test_the_summary_says_which_loop_and_which_functions_ran(
    flag: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    code, out, _ = run(capsys, "simulate", "filling.yaml", "-o", "none", "--solver", "rodas", flag)
    assert code == 0
    assert f"rodas (compiled loop, {said} functions): " in out


@pytest.mark.parametrize(("text", "said"), [("true", "compiled"), ("false", "interpreted")])
def test_the_circuit_file_may_ask_for_compiled_equations(
    text: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    file = Path("compiled.yaml")
    file.write_text(Path("filling.yaml").read_text().replace("simulation: {", f"simulation: {{compile: {text}, ", 1))
    code, out, _ = run(capsys, "simulate", str(file), "-o", "none", "--solver", "dopri")
    assert code == 0
    assert f"dopri (compiled loop, {said} functions): " in out


def test_compile_is_true_or_false(capsys: pytest.CaptureFixture[str]) -> None:
    Path("odd.yaml").write_text(
        Path("filling.yaml").read_text().replace("simulation: {", "simulation: {compile: fast, ")
    )
    code, _, err = run(capsys, "simulate", "odd.yaml", "-o", "none")
    assert code == 2
    assert "compile" in err
    assert "true or false" in err


# -- simulate: failures --------------------------------------------------------------------------


def test_a_failed_run_is_saved_and_exits_with_3(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = run(capsys, "simulate", "draining.yaml", "--json")
    found = json.loads(out)
    assert code == 3
    assert list(found) == list(RUN_KEYS)
    assert found["status"] == "failed"
    assert found["error"] in err
    assert "line.p" in found["error"]
    assert "absolute zero" in found["error"]
    with xr.open_dataset("draining.nc", engine="h5netcdf") as data:
        assert data.attrs["complete"] == 0
        assert data.attrs["status"] == "failed"
        assert data["line.p"].size > 0
    assert "Traceback" not in err


def test_an_interrupted_run_is_saved_and_exits_with_130(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    @contextmanager
    def interrupting(quiet: bool) -> Iterator[Any]:
        def stop(share: float) -> None:
            raise KeyboardInterrupt

        yield stop

    monkeypatch.setattr("crescentlab.commands.simulate.progress_bar", interrupting)
    code, out, err = run(capsys, "simulate", "filling.yaml", "--json")
    assert code == 130
    assert json.loads(out)["status"] == "interrupted"
    assert "interrupted" in err
    with xr.open_dataset("filling.nc", engine="h5netcdf") as data:
        assert data.attrs["complete"] == 0


def test_a_bug_of_ours_exits_with_1_and_a_traceback(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*arguments: Any) -> None:
        raise ZeroDivisionError("oops")

    monkeypatch.setattr("crescentlab.commands.simulate.report", broken)
    code, out, err = run(capsys, "simulate", "filling.yaml", "--json")
    assert code == 1
    assert "Traceback" in err
    assert json.loads(out)["status"] == "bug"


@pytest.mark.parametrize(
    ("old", "new", "line", "said"),
    [
        ("type: capacity", "type: capacty", 9, "did you mean capacity"),
        ("volume: 100 cm^3", "volume: 100", 9, "unit"),
        ("line.port", "lin.port", 14, "no component 'lin': did you mean line"),
        ("type: capacity, volume: 100 cm^3, start: {p: 1 bar}", "type: plug", 14, "meet without a volume"),
        ("line.port, ", "", 9, "line.port (the volume) is not connected"),
        ("supply: 6 L/min", "supply: 6 L/min\n  supply: 5 L/min", 6, "twice"),
        ("p_line.p *", "p_lin.p *", 17, "did you mean p_line.p"),
        ("stop: 20 ms", "stop: 20 ms, slover: bdf", 18, "solver"),
    ],
)  # fmt: skip
def test_input_errors_name_file_and_line(
    old: str, new: str, line: int, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("slip.yaml").write_text(FILLING.replace(old, new), encoding="utf-8")
    message = refused(capsys, "simulate", "slip.yaml")
    assert message.startswith(f"slip.yaml:{line}: ")
    assert said in message
    assert not Path("slip.nc").exists()
    code, out, err = run(capsys, "simulate", "slip.yaml", "--json")
    assert code == 2
    assert json.loads(out)["error"] == err.strip() == message
    assert set(json.loads(out)) == set(RUN_KEYS)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--stop", "5"], "a time needs a unit: 5 s"),
        (["--stop", "0 ms"], "above 0"),
        (["--stop", "5", "ms"], "quote text that has blanks"),
        (["--solver", "lsodaa"], "did you mean lsoda"),
        (["--rtol", "small"], "'small' is not a number"),
        (["--rtol", "2"], "between 0 and 1"),
        (["--output-step", "1 ns"], "rows"),
        (["--output-step", "1 bar"], "unit of pressure"),
        (["--recrod", "x"], "did you mean --record"),
        (["--record", "lin.p"], "did you mean line.p"),
        (["-o", "r.txt"], ".nc, .csv, .parquet"),
        (["-o", "missing/r.nc"], "the folder missing does not exist"),
        (["--set", "supply"], "NAME=VALUE"),
        (["--set", "suply=1 L/min"], "did you mean supply"),
        (["--set", "supply=1 bar"], "--set supply: '1 bar': 'bar' is a unit of pressure"),
        (["--set", "supply=1 L/min", "--set", "supply=2 L/min"], "--set supply is given twice"),
        (["--set", "line.volume=-1 cm^3"], "--set line.volume must be above 0, not -1 cm3"),
        (["--set", "fluid.densty=1 kg/m^3"], "did you mean fluid.density"),
    ],
)
def test_slips_in_options_are_one_sentence_before_the_run(
    arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert said in refused(capsys, "simulate", "filling.yaml", *arguments)
    assert not Path("filling.nc").exists()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([], "name a command: simulate"),
        (["simulat", "x"], "unknown command 'simulat': did you mean simulate"),
        (["simulate"], "CIRCUIT"),
        (["simulate", "relief_valv"], "did you mean relief_valve"),
        (["simulate", "missing.yaml"], "no such file"),
        (["check", "filling.yaml", "--jsno"], "did you mean --json"),
        (["components", "capcity"], "did you mean capacity"),
        (["circuits", "relief"], "did you mean relief_valve"),
        (["circuits", "--copy", "x"], "name the circuit"),
        (["graph", "filling.yaml"], "--output"),
        (["graph", "filling.yaml", "-o", "g.jpg"], ".svg, .png, .pdf"),
        (["results", "missing.nc"], "no such file"),
        (["results", "filling.yaml"], "not a result file"),
    ],
)
def test_wrong_commands_are_one_sentence(arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert said in refused(capsys, *arguments)


def test_no_code_refuses_circuits_that_bring_python(capsys: pytest.CaptureFixture[str]) -> None:
    Path("mine.py").write_text("raise SystemExit('this ran')\n", encoding="utf-8")
    Path("own.yaml").write_text(FILLING + "library: [./mine.py]\n", encoding="utf-8")
    for arguments in (
        ["--no-code", "simulate", "own.yaml"],
        ["check", "own.yaml", "--no-code"],
        ["graph", "own.yaml", "-o", "g.svg", "--no-code"],
    ):
        message = refused(capsys, *arguments)
        assert message.startswith("own.yaml:19: ")
        assert "--no-code" in message


# -- check ---------------------------------------------------------------------------------------


def test_check_tells_who_gives_what(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = run(capsys, "check", "filling.yaml")
    assert code == 0
    net = next(line for line in out.splitlines() if line.split()[:1] == ["p_line"])
    assert net.split()[1:3] == ["hydraulic", "line.port"]
    assert "load.a[1..2]" in net
    assert "1: line.p" in out
    assert "simple_oil" in out


def test_check_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    found = json.loads(run(capsys, "check", "filling.yaml", "--json")[1])
    nets = {net["name"]: net for net in found["nets"]}
    assert nets["p_line"]["given_by"] == "line.port"
    assert nets["p_line"]["taken_by"] == ["pump.port", "load.a[1]", "load.a[2]"]
    assert found["states"] == ["line.p"]
    assert found["components"]["load"] == "orifice"
    assert found["fluids"] == {"fluid": "simple_oil"}


def test_check_shows_the_chosen_forms_and_a_part_alone(capsys: pytest.CaptureFixture[str]) -> None:
    Path("pipe_part.yaml").write_text(
        "crescentlab: 1\ntitle: A pipe\nports: {inlet: p_in, outlet: p_out}\ncomponents:\n"
        "  pipe: {type: pipe, length: 1 m, diameter: 10 mm}\n  end: {type: capacity, volume: 10 cm^3}\n"
        "  gap: {type: orifice, area: 1 mm^2}\nnets:\n  p_in: [gap.a]\n  p_mid: [gap.b, pipe.a]\n"
        "  p_out: [pipe.b, end.port]\n",
        encoding="utf-8",
    )
    code, out, _ = run(capsys, "check", "pipe_part.yaml")
    assert code == 0
    assert "pipe is pipe_capacitive_inertial: a gives, b takes" in out
    assert "open: inlet" in out
    found = json.loads(run(capsys, "check", "pipe_part.yaml", "--json")[1])
    assert found["nets"][0] | {"given_by": None, "open": ["inlet"]} == found["nets"][0]


def test_check_condenses_a_large_circuit(capsys: pytest.CaptureFixture[str]) -> None:
    n = 80
    parts = [f"  o{k}: {{type: orifice, area: 5 mm^2}}\n  v{k}: {{type: capacity, volume: 1 cm^3}}" for k in range(n)]
    nets = [f"  n{k}: [o{k}.b, v{k}.port{f', o{k + 1}.a' if k + 1 < n else ''}]" for k in range(n)]
    lines = [
        "crescentlab: 1",
        f"fluid: {FLUID}",
        "components:",
        "  s: {type: tank}",
        *parts,
        "nets:",
        "  p: [s.port, o0.a]",
        *nets,
    ]
    Path("ladder.yaml").write_text("\n".join(lines), encoding="utf-8")
    _, out, _ = run(capsys, "check", "ladder.yaml")
    assert "80 capacity, 80 orifice, tank" in out
    assert "79 nets, as n0" in out
    assert len(out.splitlines()) < 20


# -- components, circuits, graph, schema ---------------------------------------------------------


def test_components_lists_one_line_per_type_and_hides_forms(capsys: pytest.CaptureFixture[str]) -> None:
    _, out, _ = run(capsys, "components")
    lines = dict(line.split("  ", 1) for line in out.splitlines())
    assert lines["orifice"].startswith("Sharp-edged orifice")
    assert {"pipe", "simple_oil", "tank"} <= set(lines)
    assert not [name for name in lines if name.startswith(("pipe_inertial", "pipe_capacitive"))]
    for name in [*lines, "pipe_inertial_capacitive"]:
        assert main(["components", name]) == 0
        assert "defined in" in capsys.readouterr().out


def test_a_component_in_full(capsys: pytest.CaptureFixture[str]) -> None:
    _, out, _ = run(capsys, "components", "orifice")
    text = " ".join(out.split())
    for said in (
        "Source:",
        ".. math::",
        "a takes hydraulic",
        "area area [mm2] required >= 0",
        "cd_max ratio 0.7 > 0, <= 1",
        "q flow [L/min]",
    ):
        assert said in text
    assert "p pressure [bar]" in " ".join(run(capsys, "components", "capacity")[1].split())


def test_circuits_lists_and_copies_with_parts_and_tables(capsys: pytest.CaptureFixture[str]) -> None:
    _, out, _ = run(capsys, "circuits")
    assert "relief_valve  Relief valve on a constant flow" in out.splitlines()
    assert "_part" not in out
    assert run(capsys, "circuits", "relief_valve", "--copy", "copy/here")[0] == 0
    assert {p.name for p in Path("copy/here").iterdir()} == {"relief_valve.yaml", "relief_valve_part.yaml"}
    assert run(capsys, "circuits", "relief_valve", "--copy", "copy/here")[0] == 0, "the same files again change nothing"
    assert run(capsys, "check", "copy/here/relief_valve.yaml")[0] == 0
    Path("copy/here/relief_valve_part.yaml").write_text("mine", encoding="utf-8")
    assert "exists and differs" in refused(capsys, "circuits", "relief_valve", "--copy", "copy/here")


def test_circuits_copies_tables_of_parts_too(capsys: pytest.CaptureFixture[str]) -> None:
    run(capsys, "circuits", "crescent_pump", "--copy", "pump")
    names = {p.name for p in Path("pump").iterdir()}
    assert {"crescent_pump.yaml", "relief_valve_part.yaml", "delivery_line_part.yaml", "cover_deflection.csv"} <= names


@pytest.mark.parametrize("suffix", ["svg", "png", "pdf"])
def test_graph_draws_every_component_and_net(suffix: str, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = run(capsys, "graph", "filling.yaml", "-o", f"g.{suffix}")
    assert (code, out) == (0, f"g.{suffix}\n")
    drawn = Path(f"g.{suffix}").read_bytes()
    assert drawn.startswith({"svg": b"<?xml", "png": b"\x89PNG", "pdf": b"%PDF"}[suffix])
    if suffix == "svg":
        for name in (
            "jump",
            "pump",
            "line",
            "load",
            "tank",
            "orifice",
            "p_line",
            "wanted",
            "Filling a line",
            "hydraulic",
        ):
            assert f">{name}<".encode() in drawn
        run(capsys, "graph", "filling.yaml", "-o", "again.svg")
        assert Path("again.svg").read_bytes() == drawn, "the same circuit gives the same drawing"


def test_the_schema_lists_every_type_with_its_parameters() -> None:
    made = schema(installed())
    section = made["$defs"]["ComponentSection"]
    types = {branch["if"]["properties"]["type"]["const"]: branch["then"] for branch in section["allOf"]}
    assert set(types["orifice"]["properties"]) >= {"type", "start", "area", "cd_max", "hydraulic_diameter"}
    assert types["orifice"]["required"] == ["type", "area"]
    assert types["capacity"]["properties"]["start"]["properties"].keys() == {"p"}
    assert "pipe_inertial_inertial" not in types
    for name, cls in listed(installed()).items():
        if name in types:
            fields = {declared.alias or field for field, declared in cls.model_fields.items()}
            assert fields | {"type", "start"} == set(types[name]["properties"])
    assert set(types) == {name for name, cls in listed(installed()).items() if issubclass(cls, Component)}
    fluids = made["$defs"]["FluidSection"]["allOf"]
    assert "kinematic_viscosity" in next(
        b["then"]["properties"] for b in fluids if b["if"]["properties"]["type"]["const"] == "simple_oil"
    )
    assert set(made["properties"]) >= {"crescentlab", "components", "nets", "simulation", "plots"}


def test_the_schema_command_prints_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert json.loads(run(capsys, "schema")[1])["title"] == "crescentlab circuit"


# -- results -------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", ["nc", "csv", "parquet"])
def test_results_shows_a_file_and_prints_series(suffix: str, capsys: pytest.CaptureFixture[str]) -> None:
    run(capsys, "simulate", "filling.yaml", "--quiet", "-o", f"r.{suffix}")
    code, out, _ = run(capsys, "results", f"r.{suffix}")
    expected = cl.load("filling.yaml").simulate()
    assert code == 0
    assert f"{expected.time.size} rows, 0 s to 0.02 s" in out
    row = next(line.split() for line in out.splitlines() if line.split()[:1] == ["line.p"])
    assert row == ["line.p", "Pa", f"{expected['line.p'].min():.6g}", f"{expected['line.p'].max():.6g}"]
    _, out, _ = run(capsys, "results", f"r.{suffix}", "line.p", "load.q[2]")
    titles, *rows = csv.reader(io.StringIO(out))
    assert titles == ["time [s]", "line.p [Pa]", "load.q[2] [m^3/s]"]
    np.testing.assert_array_equal(
        np.array(rows, dtype=float).T, [expected.time, expected["line.p"], expected["load.q[2]"]]
    )
    assert run(capsys, "results", f"r.{suffix}", "l?ad.q?2]")[1].splitlines()[0].endswith("load.q[2] [m^3/s]")
    assert "did you mean line.p" in refused(capsys, "results", f"r.{suffix}", "lin.p")


def test_a_file_of_something_else_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("x.nc", "x.csv", "x.parquet"):
        Path(name).write_text("nothing\n", encoding="utf-8")
        assert "not a result file" in refused(capsys, "results", name)


# -- the process ---------------------------------------------------------------------------------


def test_the_installed_command_and_the_version() -> None:
    script = shutil.which("crescentlab", path=str(Path(sys.executable).parent))
    if script is None:
        pytest.skip("crescentlab is not installed as a command")
    shown = subprocess.run([script, "--version"], capture_output=True, text=True, check=True)
    assert shown.stdout == f"crescentlab {cl.__version__}\n"


def test_exit_codes_and_streams_of_the_process() -> None:
    done = command("simulate", "filling.yaml", "-o", "none", "-v")
    assert (done.returncode, done.stdout.splitlines()[0]) == (0, "Filling a line")
    assert "assembled" in done.stderr, "-v logs to stderr"
    wrong = command("simulate", "missing.yaml")
    assert (wrong.returncode, wrong.stdout) == (2, "")
    assert wrong.stderr.startswith("missing.yaml: no such file")
    assert command("simulate", "draining.yaml").returncode == 3
    assert command("--help").returncode == 0


def test_a_reader_that_has_seen_enough_is_no_error() -> None:
    process = subprocess.Popen(
        [sys.executable, "-m", "crescentlab.cli", "components"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert process.stderr is not None
    process.stdout.close()
    assert process.stderr.read() == ""
    process.stderr.close()
    assert process.wait() == 0


def test_a_negative_value_is_a_value(capsys: pytest.CaptureFixture[str]) -> None:
    """-5% after an option is told as what it is, not as a missing argument."""
    assert main(["doctor", "three_pipes", "--line-error", "-5%"]) == 2
    assert "--line-error -5%: an error lies between 0 and 200 %" in capsys.readouterr().err
    assert main(["simulate", "relief_valve", "--set", "supply=-3 L/min", "--stop", "-.5ms", "-o", "none"]) == 2
    assert "stop: -.5ms must be above 0" in capsys.readouterr().err


def test_the_summary_is_of_the_run_not_of_its_output_grid(capsys: pytest.CaptureFixture[str]) -> None:
    """Mean, least and largest value of a pressure are those of the steps, however coarse the rows that are written."""
    fine = run(capsys, "simulate", "relief_valve", "-o", "none")[1]
    coarse = run(capsys, "simulate", "relief_valve", "-o", "none", "--output-step", "10 ms")[1]

    def figures(said: str) -> list[str]:
        return next(line for line in said.splitlines() if "p_line.p" in line).split()

    assert figures(coarse) == figures(fine)
    result = cl.load("relief_valve").simulate(output_step="10 ms")
    assert result.time.size == 6
    assert result.mean("line.p") == cl.load("relief_valve").simulate().mean("line.p")
    assert main(["simulate", "relief_valve", "-o", "none", "--output-step", "1 s"]) == 2
    assert "output_step 1 s is longer than the run, 0.05 s" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("command", "told"),
    [
        (["components", "pump"], "did you mean fixed_displacement_pump or variable_displacement_pump"),
        (["components", "cylinder"], "did you mean double_acting_cylinder or single_acting_cylinder"),
        (["simulate", "."], ".: this is a folder; name a circuit file in it, or one of: accumulator"),
        (
            ["simulate", "relief_valve", "--solver", "ode45"],
            "(auto, lsoda, bdf, radau, rk45, ",
        ),
    ],
)
def test_a_newcomer_is_told_what_there_is(command: list[str], told: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(command) == 2
    assert told in capsys.readouterr().err


def test_numbers_without_unit_may_be_numbers() -> None:
    """From Python a ratio is a number; text without its unit is refused."""
    supply = cl.load("relief_valve").simulate(parameters={"valve.jet_coefficient": 0})
    assert supply["valve.holes.jet_force"].max() == 0
    with pytest.raises(InputError, match="needs a unit"):
        cl.load("relief_valve").simulate(parameters={"supply": "30.0"})


def test_a_decimal_comma_is_seen(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = (Path(find("relief_valve"))).read_text(encoding="utf-8").replace("volume: 70 cm^3", "volume: 70,5 cm^3")
    (tmp_path / "c.yaml").write_text(text, encoding="utf-8")
    assert main(["check", str(tmp_path / "c.yaml")]) == 2
    assert "decimals follow a point: volume: 70.5 cm^3" in capsys.readouterr().err
