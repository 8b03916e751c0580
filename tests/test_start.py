"""A run that begins where another ended goes on as if that had never ended: clocks, bits and edges included."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import crescentlab as cl
from crescentlab.cli import main
from crescentlab.series_files import read_series

BENCH = """
crescentlab: 1
fluid: {type: simple_oil, density: 860 kg/m^3, kinematic_viscosity: 35 cSt, bulk_modulus: 14000 bar}
parameters: {supply: 30 L/min}
components:
  source: {type: flow_source, flow: = supply}
  line: {type: capacity, volume: 70 cm^3, start: {p: 1 bar}}
  throttle: {type: throttle, area: 20 mm^2}
  tank: {type: tank}
nets:
  p_line: [source.port, line.port, throttle.a]
  p_tank: [throttle.b, tank.port]
simulation: {stop: 2 ms}
"""


@pytest.mark.parametrize("solver", ["rodas", "dopri", "lsoda", "bdf"])
def test_a_resumed_pump_runs_on_as_if_it_had_never_stopped(solver: str) -> None:
    """Between two ticks and two events: equal counts, clocks that did not move, states equal within the tolerance."""
    circuit = cl.load("crescent_pump")
    whole = circuit.simulate(stop="6 ms", solver=solver, rtol=1e-6)
    first = circuit.simulate(stop="3.123 ms", solver=solver, rtol=1e-6)
    second = circuit.simulate(stop="6 ms", solver=solver, rtol=1e-6, start=first)
    a, b = whole.trajectory.end, second.trajectory.end
    assert a is not None
    assert b is not None
    assert second.time[0] == first.time[-1]
    assert np.array_equal(a.ticked, b.ticked)
    assert np.array_equal(a.b, b.b)
    assert np.array_equal(a.holds, b.holds)
    events = [r.trajectory.statistics.events for r in (whole, first, second)]
    assert events[0] == events[1] + events[2]
    nominal = circuit.system().nominal
    assert np.max(np.abs(a.x - b.x) / (nominal + np.abs(a.x))) < 2e-5


@pytest.mark.parametrize("suffix", [".nc", ".parquet"])
def test_a_file_holds_its_end_to_the_last_bit(tmp_path: Path, suffix: str) -> None:
    """States read back from a file are the very numbers, also where ``--record`` left them out."""
    circuit = cl.load("crescent_pump")
    first = circuit.simulate(stop="1 ms", solver="rodas", rtol=1e-4)
    file = tmp_path / f"first{suffix}"
    first.write(file, ["delivery.p"])
    of_file = circuit.simulate(stop="2 ms", solver="rodas", rtol=1e-4, start=file)
    of_result = circuit.simulate(stop="2 ms", solver="rodas", rtol=1e-4, start=first)
    assert np.array_equal(of_file["delivery.p"], of_result["delivery.p"])


def test_an_event_that_has_fired_does_not_fire_again_on_resuming(tmp_path: Path) -> None:
    """A bouncing mass at rest on its stop stays there: its edges are kept."""
    circuit = cl.load("relief_valve")
    first = circuit.simulate(stop="50 ms")
    second = circuit.simulate(stop="60 ms", start=first)
    assert second.trajectory.statistics.events == 0


def test_start_from_the_command_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """``--start FILE`` goes on to ``--stop``, with other values if they are set."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bench.yaml").write_text(BENCH, encoding="utf-8")
    assert main(["simulate", "bench.yaml", "--quiet"]) == 0
    arguments = ["--start", "bench.nc", "--stop", "60 ms", "--set", "supply=15 L/min", "-o", "on.nc", "--json"]
    assert main(["simulate", "bench.yaml", *arguments]) == 0
    assert json.loads(capsys.readouterr().out)["status"] == "done"
    before, after = read_series(Path("bench.nc")), read_series(Path("on.nc"))
    assert after[0][0] == before[0][-1]
    assert after[1]["line.p"][0] == before[1]["line.p"][-1]
    assert after[1]["throttle.q"][-1] == pytest.approx(15e-3 / 60, rel=1e-5)


def refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """What a refused command says."""
    assert main(list(arguments)) == 2
    return capsys.readouterr().err


def test_what_cannot_be_gone_on_from_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A table, another circuit's run, an end before the start, no file: one sentence each."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bench.yaml").write_text(BENCH, encoding="utf-8")
    for target in ("bench.nc", "bench.csv"):
        assert main(["simulate", "bench.yaml", "--quiet", "-o", target]) == 0
    said = refused(capsys, "simulate", "bench.yaml", "--start", "bench.csv", "--stop", "9 ms")
    assert "a .csv file does not say where its run ended" in said
    assert "write an end time beyond it" in refused(capsys, "simulate", "bench.yaml", "--start", "bench.nc")
    said = refused(capsys, "simulate", "relief_valve", "--start", "bench.nc", "--stop", "9 ms")
    assert "its run had no" in said
    assert "no such file" in refused(capsys, "simulate", "bench.yaml", "--start", "none.nc", "--stop", "9 ms")
