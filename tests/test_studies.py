"""Studies that run: every point becomes a row, whatever happens to it; what is there is kept; a row repeats exactly."""

from __future__ import annotations

import csv
import io
import json
import re
import time
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from pydantic import BaseModel
from refusing import Refusal
from study_bench import FILLING, FUSE, OIL, STUDY, Here, pressure, told, write

import crescentlab.commands.study as command
from crescentlab.circuit import find
from crescentlab.cli import main
from crescentlab.studies.drawing import label
from crescentlab.studies.planning import plan_study
from crescentlab.studies.points import DONE, FAILED, LOST, SLOW, UNSETTLED
from crescentlab.studies.progress import Progress, duration
from crescentlab.studies.provenance import circuit_files
from crescentlab.studies.store import Store
from crescentlab.studies.study_file import PlotSection, RunSection, Study, StudyFile, UntilSection, VarySection
from crescentlab.studies.worker import CHANGED, Workshop, answer

FOLDER = Path(__file__).resolve().parents[1] / "studies"
STUDIES = [p for p in sorted(FOLDER.glob("*.yaml")) if "\ncrescentlab_study: 1\n" in p.read_text(encoding="utf-8")]


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> type[Here]:
    """A folder with the circuit and the study, whose points run in this process."""
    monkeypatch.chdir(tmp_path)
    write(tmp_path)
    monkeypatch.setattr(Here, "ran", [])
    monkeypatch.setattr(Here, "stop_after", None)
    monkeypatch.setattr(command, "LocalPool", Here)
    return Here


# -- rows ----------------------------------------------------------------------------------------


def test_every_point_is_a_row_with_its_outcomes(here: type[Here], capsys: pytest.CaptureFixture[str]) -> None:
    """Closed form of a closed volume: exp(p/beta) grows by q t / V."""
    found = told(capsys, "study", "s.yaml")
    assert [row["supply"] for row in found["table"]] == pytest.approx([5e-5, 1e-4, 2e-4])
    for row in found["table"]:
        assert row["status"] == "done"
        assert row["last"] == pytest.approx(pressure(row["supply"]), rel=1e-7)
        assert row["swing"] == pytest.approx(pressure(row["supply"]) - 1e5, rel=1e-7)
    assert found["units"] == {"supply": "m^3/s", "last": "Pa", "swing": "Pa"}


def test_files_carry_si_units(here: type[Here], capsys: pytest.CaptureFixture[str]) -> None:
    found = told(capsys, "study", "s.yaml")
    table = pq.read_table("s.results/table.parquet")
    assert table.schema.field("supply").metadata == {b"units": b"m^3/s"}
    assert table.column("last").to_pylist() == [row["last"] for row in found["table"]]
    with Path("s.results/table.csv").open(encoding="utf-8") as file:
        rows = list(csv.reader(file))
    assert rows[0][:4] == ["point", "supply [m^3/s]", "last [Pa]", "swing [Pa]"]
    assert [float(row[2]) for row in rows[1:]] == [row["last"] for row in found["table"]]
    manifest = json.loads(Path("s.results/manifest.json").read_text(encoding="utf-8"))
    assert set(manifest["conditions"]["circuit"]) == {"filling.yaml", "fuse.py"}
    assert "crescentlab.components.capacities" in manifest["conditions"]["library"]
    assert "crescentlab.components.carry_over" not in manifest["conditions"]["library"]
    assert manifest["conditions"]["run"] == {"analysis": "simulate", "stop": "10 ms", "rtol": 1e-8}
    assert (manifest["state"], manifest["rows"]) == ("complete", {"done": 3})


def test_words_and_expressions_vary_too(here: type[Here], capsys: pytest.CaptureFixture[str]) -> None:
    """A parameter that is an expression of another one becomes its number."""
    text = STUDY.replace("grid: {supply", "list: {volume: [= supply * 1 s, 1 L, 50 cm^3], supply")
    write(Path(), text)
    rows = told(capsys, "study", "s.yaml")["table"]
    assert [row["volume"] for row in rows] == pytest.approx([5e-5, 1e-3, 5e-5])
    assert [row["last"] for row in rows] == pytest.approx([pressure(r["supply"], r["volume"]) for r in rows], rel=1e-7)


def test_a_point_that_fails_is_a_row_with_its_reason(here: type[Here], capsys: pytest.CaptureFixture[str]) -> None:
    """A volume of 0 is refused by the component, a flow that empties the line by its equations; the rest goes on."""
    write(Path(), STUDY.replace("supply: [3 L/min, ", "volume: [100 cm^3, 0 cm^3], supply: [3 L/min, -300 L/min, "))
    assert main(["study", "s.yaml"]) == 0
    out = capsys.readouterr().out
    assert "line.volume must be above 0" in out
    rows = told(capsys, "study", "s.yaml")["table"]
    assert [row["status"] for row in rows] == ["done", "failed", "done", "done", *["failed"] * 4]
    assert rows[1]["last"] is None
    assert "line" in rows[1]["reason"]


def test_a_study_of_which_nothing_works_fails(here: type[Here], capsys: pytest.CaptureFixture[str]) -> None:
    write(Path(), STUDY.replace("[3 L/min, 6 L/min, 12 L/min]", "[-300 L/min]"))
    assert main(["study", "s.yaml", "--quiet"]) == 3
    assert capsys.readouterr().err.startswith("no point is done; point 1: ")
    found = told(capsys, "study", "s.yaml")
    assert (found["status"], found["error"]) == ("failed", f"no point is done; point 1: {found['table'][0]['reason']}")


def test_effects_of_points_that_failed_are_dashes(here: type[Here], capsys: pytest.CaptureFixture[str]) -> None:
    write(Path(), STUDY.replace("grid: {supply: [3 L/min, 6 L/min, 12 L/min]}",
                                "one_at_a_time: {supply: -300 L/min +- 10 %}"))  # fmt: skip
    assert main(["study", "s.yaml"]) == 3
    out = capsys.readouterr().out
    assert "nan" not in out
    assert ["last [bar]", "supply", "-", "-"] in [re.split(r"  +", line.strip()) for line in out.splitlines()]


def test_a_folder_around_the_rows_must_be_there(here: type[Here], refused: Refusal) -> None:
    for more in ([], ["--dry-run"]):
        said = refused.told("study", "s.yaml", "-o", "nowhere/rows", *more)
        assert "the folder nowhere does not exist; make it first" in said
    assert not Path("nowhere").exists()


def test_an_outcome_that_is_not_finite_is_told(here: type[Here], capsys: pytest.CaptureFixture[str]) -> None:
    write(Path(), STUDY + "  share: final(line.p) / (final(line.p) - initial(line.p) - peak_to_peak(line.p))\n")
    rows = told(capsys, "study", "s.yaml")["table"]
    assert all(row["status"] == "failed" and "share" in row["reason"] for row in rows)
    assert all(row["share"] is None and row["last"] > 1e5 for row in rows)


def test_windows_are_run_until_an_outcome_has_settled(here: type[Here], capsys: pytest.CaptureFixture[str]) -> None:
    """From p(0) = 0 the mean of a closed volume grows without end; into an orifice it settles where q = supply."""
    circuit = FILLING.replace("  fuse: {type: fuse, burns_at: = burns_at}", "  hole: {type: orifice, area: 3 mm^2}\n"
                              "  tank: {type: tank}").replace("[pump.port, line.port]", "[pump.port, line.port, hole.a]"
                              "\n  t_line: [hole.b, tank.port]").replace("library: [./fuse.py]\n", "")  # fmt: skip
    run = "run: {until: {settled: line.p, within: 0.01 %, every: 10 ms, at_most: 50}, rtol: 1e-8}"
    text = STUDY.replace("run: {stop: 10 ms, rtol: 1e-8}", run) + "  through: mean(hole.q)\n"
    Path("filling.yaml").write_text(circuit, encoding="utf-8")
    Path("s.yaml").write_text(text, encoding="utf-8")
    rows = told(capsys, "study", "s.yaml")["table"]
    assert [row["status"] for row in rows] == ["done"] * 3
    for row in rows:
        assert row["through"] == pytest.approx(row["supply"], rel=1e-4)
        assert 0.02 <= row["final_time"] < 0.5
        assert row["final_time"] / 0.01 == pytest.approx(round(row["final_time"] / 0.01))
    write(Path(), STUDY.replace("run: {stop: 10 ms, rtol: 1e-8}", run.replace("50}", "3}")))
    Path("filling.yaml").write_text(FILLING, encoding="utf-8")
    rows = told(capsys, "study", "s.yaml", "--fresh")["table"]
    assert {row["status"] for row in rows} == {"unsettled"}
    assert "after 3 windows line.p still changed by" in rows[0]["reason"]


def test_two_windows_alike_on_both_sides_of_an_extremum_are_not_settled(
    here: type[Here], capsys: pytest.CaptureFixture[str]
) -> None:
    """A sine of 12.5 Hz in windows of 10 ms: the second and third lie mirrored about its maximum at 20 ms."""
    circuit = """\
crescentlab: 1
parameters: {offset: 2 bar}
components: {wave: {type: sine, mean: = offset, amplitude: 1 bar, frequency: 12.5 Hz}}
simulation: {rtol: 1e-8}
"""
    study = """\
crescentlab_study: 1
circuit: wave.yaml
vary: {list: {offset: [2 bar]}}
run: {until: {settled: wave.y, within: 0.1 %, every: 10 ms, at_most: 6}}
measure: {mean: mean(wave.y)}
"""
    Path("wave.yaml").write_text(circuit, encoding="utf-8")
    Path("s.yaml").write_text(study, encoding="utf-8")
    (row,) = told(capsys, "study", "s.yaml")["table"]
    assert row["status"] == "unsettled"
    assert row["final_time"] == pytest.approx(0.06)


def test_steady_and_periodic_points_are_measured(here: type[Here], capsys: pytest.CaptureFixture[str]) -> None:
    """At rest what flows in flows out; a sine of amplitude 1 L/min into an ideal line has that line and its mean."""
    circuit = f"""\
crescentlab: 1
fluid: {OIL}
parameters: {{supply: 6 L/min, rate: 50 Hz}}
components:
  wanted: {{type: sine, output_quantity: flow, mean: = supply, amplitude: 1 L/min, frequency: = rate}}
  pump: {{type: signal_flow_source}}
  line: {{type: capacity, volume: 100 cm^3, start: {{p: 1 bar}}}}
  hole: {{type: orifice, area: 3 mm^2}}
  tank: {{type: tank}}
nets:
  wanted_flow: [wanted.y, pump.flow]
  p_line: [pump.port, line.port, hole.a]
  t_line: [hole.b, tank.port]
simulation: {{stop: 10 ms}}
"""
    Path("wave.yaml").write_text(circuit, encoding="utf-8")
    study = """\
crescentlab_study: 1
circuit: wave.yaml
vary: {grid: {supply: [3 L/min, 6 L/min]}}
run: {analysis: periodic, period: = 1 / rate, rtol: 1e-6, compile: false}
measure: {out: mean(hole.q), line: 'amplitude(wanted.y, rate)'}
"""
    Path("wave_study.yaml").write_text(study, encoding="utf-8")
    for row in told(capsys, "study", "wave_study.yaml")["table"]:
        assert row["status"] == "done", row["reason"]
        assert row["out"] == pytest.approx(row["supply"], rel=1e-4)
        assert row["line"] == pytest.approx(1e-3 / 60, rel=1e-4)
    still = study.replace("run: {analysis: periodic, period: = 1 / rate, rtol: 1e-6, compile: false}",
                          "set: {wanted.amplitude: 0 L/min}\nrun: {analysis: steady}")  # fmt: skip
    Path("still.yaml").write_text(still, encoding="utf-8")
    for row in told(capsys, "study", "still.yaml")["table"]:
        assert row["status"] == "done", row["reason"]
        assert row["out"] == pytest.approx(row["supply"], rel=1e-8)
        assert row["line"] == pytest.approx(0.0, abs=1e-15 * row["supply"])


# -- what is kept --------------------------------------------------------------------------------


def test_an_interrupted_study_goes_on_where_it_was(here: type[Here], capsys: pytest.CaptureFixture[str]) -> None:
    here.stop_after = 2
    assert main(["study", "s.yaml", "--quiet"]) == 130
    assert "2 points kept in s.results" in capsys.readouterr().err
    assert json.loads(Path("s.results/manifest.json").read_text(encoding="utf-8"))["state"] == "interrupted"
    here.stop_after = None
    assert told(capsys, "study", "s.yaml")["ran"] == 1
    assert len(here.ran) == len(set(here.ran)) == 3
    assert told(capsys, "study", "s.yaml")["ran"] == 0


def test_points_kept_before_count_as_kept_and_only_rows_stay(
    here: type[Here], capsys: pytest.CaptureFixture[str]
) -> None:
    """Interrupted after one point, then after one more: two are kept; no empty journal and no lock stay."""
    for stop_after in (1, 2):
        here.stop_after = stop_after
        assert main(["study", "s.yaml", "--quiet"]) == 130
        assert f"{stop_after} point{'s' * (stop_after > 1)} kept in s.results" in capsys.readouterr().err
        assert {p.name for p in Path("s.results").iterdir()} == {
            "manifest.json", *(f"part-{k:05d}.parquet" for k in range(1, stop_after + 1))
        }  # fmt: skip


def test_a_lock_taken_away_in_between_is_taken_anew(
    here: type[Here], refused: Refusal, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another process that ends removes the file between opening and locking: a lock on the old file binds nobody."""
    import fcntl

    locked, times = fcntl.flock, []

    def slowly(file: io.TextIOWrapper, how: int) -> None:
        if not times:
            Path("s.results/lock").unlink()
        times.append(how)
        locked(file, how)

    monkeypatch.setattr(fcntl, "flock", slowly)
    store = Store(Path("s.results"))
    store.open(plan_study(Study.read(Path("s.yaml"))))
    monkeypatch.undo()
    monkeypatch.chdir(refused.folder)
    assert len(times) == 2
    assert "another process is running this study" in refused.told("study", "s.yaml", "--quiet")
    store.close("complete")
    assert not Path("s.results/lock").exists()


def test_added_points_are_the_only_ones_that_run(here: type[Here], capsys: pytest.CaptureFixture[str]) -> None:
    """Also if a value is written in another unit: 3 L/min is 0.05 L/s."""
    before = told(capsys, "study", "s.yaml")["table"]
    write(Path(), STUDY.replace("[3 L/min, 6 L/min, 12 L/min]", "[1 L/min, 0.05 L/s, 6 L/min, 9 L/min, 12 L/min]"))
    after = told(capsys, "study", "s.yaml")
    assert (after["ran"], len(after["table"])) == (2, 5)
    kept = [row for row in after["table"] if row["point"] in (2, 3, 5)]
    assert [row["last"] for row in kept] == [row["last"] for row in before]


def test_a_longer_sequence_runs_its_new_points(here: type[Here], capsys: pytest.CaptureFixture[str]) -> None:
    for kind in ("sobol", "monte_carlo"):
        for count, new in ((4, 4), (6, 2)):
            section = f"{kind}: {{count: {count}, parameters: {{supply: [3 L/min, 12 L/min]}}}}"
            text = STUDY.replace("grid: {supply: [3 L/min, 6 L/min, 12 L/min]}", section)
            write(Path(), text + "plots: [{distribution: last}]\n")
            assert told(capsys, "study", "s.yaml", "-o", kind)["ran"] == new


@pytest.mark.parametrize(
    ("file", "old", "new", "said"),
    [
        ("filling.yaml", "volume: 100 cm^3", "volume: 101 cm^3", "circuit: filling.yaml"),
        ("fuse.py", "+ 0.0", "+ 0.5", "circuit: fuse.py"),
        ("s.yaml", "rtol: 1e-8", "rtol: 1e-7", "run: rtol"),
        ("s.yaml", "final(line.p)", "initial(line.p)", "measure: last"),
        ("s.yaml", "vary:", "set: {volume: 90 cm^3}\nvary:", "set: volume"),
    ],
)
def test_rows_of_another_circuit_are_not_mixed_in(
    here: type[Here], capsys: pytest.CaptureFixture[str], file: str, old: str, new: str, said: str
) -> None:
    told(capsys, "study", "s.yaml")
    path = Path(file)
    path.write_text(path.read_text(encoding="utf-8").replace(old, new, 1), encoding="utf-8")
    assert main(["study", "s.yaml"]) == 2
    assert f"rest on something else ({said})" in capsys.readouterr().err
    assert main(["rerun", "s.yaml", "1"]) == 2
    assert "none can be repeated" in capsys.readouterr().err
    assert told(capsys, "study", "s.yaml", "--fresh")["ran"] == 3


def test_rows_made_before_the_kernel_changed_are_pointed_out(
    here: type[Here], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    main(["study", "s.yaml"])
    assert "crescentlab itself changed" not in capsys.readouterr().err
    monkeypatch.setattr("crescentlab.studies.provenance.kernel", lambda: "another")
    main(["study", "s.yaml"])
    assert "some rows were made before crescentlab itself changed" in capsys.readouterr().err
    assert len(json.loads(Path("s.results/manifest.json").read_text(encoding="utf-8"))["kernels"]) == 2


def test_a_journal_cut_off_in_the_middle_loses_that_line_alone(
    here: type[Here], capsys: pytest.CaptureFixture[str]
) -> None:
    here.stop_after = 2
    main(["study", "s.yaml", "--quiet"])
    part = next(Path("s.results").glob("part-*.parquet"))
    lines = [json.dumps(row) for row in pq.read_table(part).to_pylist()]
    part.unlink()
    (Path("s.results") / "journal.jsonl").write_text(f"{lines[0]}\n{lines[1][:50]}", encoding="utf-8")
    here.stop_after = None
    assert told(capsys, "study", "s.yaml")["ran"] == 2


def test_rows_go_into_parts_as_the_journal_grows(
    here: type[Here], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("crescentlab.studies.store.PART_ROWS", 2)
    first = told(capsys, "study", "s.yaml")["table"]
    parts = sorted(Path("s.results").glob("part-*.parquet"))
    assert [pq.read_table(part).num_rows for part in parts] == [2, 1]
    assert pq.read_table(parts[0]).schema.field("last").metadata == {b"units": b"Pa"}
    assert not Path("s.results/journal.jsonl").exists()
    assert told(capsys, "study", "s.yaml")["table"] == first


def test_a_study_may_go_over_to_varying_something_else(here: type[Here], capsys: pytest.CaptureFixture[str]) -> None:
    """Rows of what varied before stay, whatever their columns; the table has the study's own points only."""
    write(Path(), STUDY.replace("supply: [", "'line.start.p': [1 bar, = 2 * 1 bar], supply: ["))
    here.stop_after = 4
    main(["study", "s.yaml", "--quiet"])
    rows = [row for part in Path("s.results").glob("part-*.parquet") for row in pq.read_table(part).to_pylist()]
    rows = [{**row, "form": "a word that varied once"} for row in rows]
    Path("s.results/journal.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows), encoding="utf-8")
    here.stop_after = None
    write(Path(), STUDY)
    found = told(capsys, "study", "s.yaml")
    assert (found["ran"], len(found["table"])) == (3, 3)
    write(Path(), STUDY.replace("supply: [", "'line.start.p': [1 bar, = 2 * 1 bar], supply: ["))
    rows = told(capsys, "study", "s.yaml")["table"]
    assert [row["line.start.p"] for row in rows] == [1e5] * 3 + [2e5] * 3


def test_a_process_refuses_a_circuit_that_has_changed(here: type[Here], capsys: pytest.CaptureFixture[str]) -> None:
    """A worker that is started later, or elsewhere, must not compute something else than the others."""
    planned = plan_study(Study.read(Path("s.yaml")))
    job = planned.job(planned.points[0])
    Path("fuse.py").write_text(FUSE + "\n", encoding="utf-8")
    reply = answer(Workshop(), job, io.BytesIO())
    assert reply.status == CHANGED
    assert "filling.yaml is not what it was when the study began (circuit: fuse.py)" in reply.reason


def test_every_file_that_a_circuit_names_is_hashed() -> None:
    assert set(circuit_files(find("crescent_pump"))) == {
        "crescent_pump.yaml", "delivery_line_part.yaml", "relief_valve_part.yaml", "cover_deflection.csv",
    }  # fmt: skip


def test_two_processes_do_not_write_to_one_folder(here: type[Here], capsys: pytest.CaptureFixture[str]) -> None:
    import fcntl

    told(capsys, "study", "s.yaml")
    with Path("s.results/lock").open("a") as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        assert main(["study", "s.yaml"]) == 2
    assert "another process is running this study" in capsys.readouterr().err


def test_a_failed_point_runs_again_when_asked(here: type[Here], capsys: pytest.CaptureFixture[str]) -> None:
    write(Path(), STUDY.replace("[3 L/min, ", "[3 L/min, -300 L/min, "))
    assert told(capsys, "study", "s.yaml")["ran"] == 4
    assert told(capsys, "study", "s.yaml")["ran"] == 0
    assert told(capsys, "study", "s.yaml", "--retry")["ran"] == 1


def test_a_row_that_is_not_there_is_refused(here: type[Here], refused: Refusal) -> None:
    assert "no rows of a study" in refused.told("rerun", "s.yaml", "1")
    refused.run("study", "s.yaml", "--quiet")
    assert "write a number from 1 to 3" in refused.told("rerun", "s.yaml", "4")


def test_a_scheduler_that_does_not_answer_is_told(here: type[Here], refused: Refusal,
                                                  monkeypatch: pytest.MonkeyPatch) -> None:  # fmt: skip
    pytest.importorskip("distributed")
    monkeypatch.setattr("crescentlab.studies.dask_runner.PATIENCE", "0.2 s")
    assert "no scheduler answers" in refused.told("study", "s.yaml", "--scheduler", "tcp://127.0.0.1:9", "--quiet")


# -- what is shown -------------------------------------------------------------------------------


def test_samples_and_tolerances_are_summed_up(here: type[Here], capsys: pytest.CaptureFixture[str]) -> None:
    """To first order the pressure rises by beta q t / V: a tenth of the flow is a tenth of the rise."""
    write(Path(), STUDY.replace("grid: {supply: [3 L/min, 6 L/min, 12 L/min]}",
                                "one_at_a_time: {supply: 6 L/min +- 10 %, volume: 100 cm^3 +- 5 %}"))  # fmt: skip
    assert main(["study", "s.yaml"]) == 0
    out = capsys.readouterr().out
    lines = [line.split() for line in out.splitlines() if line.strip().startswith("swing [bar]")]
    nominal = pressure(1e-4) - 1e5
    expected = {
        "supply": [(pressure(1e-4 * f) - 1e5 - nominal) / 1e5 for f in (0.9, 1.1)],
        "volume": [(pressure(1e-4, 1e-4 * f) - 1e5 - nominal) / 1e5 for f in (0.95, 1.05)],
    }
    assert [line[2] for line in lines] == ["supply", "volume"]
    for line in lines:
        assert [float(line[3]), float(line[4])] == pytest.approx(expected[line[2]], rel=1e-3)
    assert {p.name for p in Path("s.results").glob("picture*")} == {"picture-1-tornado.png", "picture-1-tornado.svg"}
    write(Path(), STUDY.replace("grid: {supply: [3 L/min, 6 L/min, 12 L/min]}",
                                "monte_carlo: {count: 10, parameters: {supply: 6 L/min +- 10 %}}"))  # fmt: skip
    assert main(["study", "s.yaml", "-o", "mc"]) == 0
    assert "mean" in capsys.readouterr().out
    assert {p.stem for p in Path("mc").glob("picture*")} == {"picture-1-distribution", "picture-2-scatter"}


def test_pictures_show_what_was_asked(here: type[Here], capsys: pytest.CaptureFixture[str]) -> None:
    text = STUDY.replace("grid: {", "grid: {volume: [50 cm^3, 100 cm^3], ")
    text += "plots:\n  - {curves: {x: supply, y: [last, swing], by: volume}, title: Rise}\n  - distribution: last\n"
    write(Path(), text)
    assert main(["study", "s.yaml", "--quiet"]) == 0
    drawn = Path("s.results/picture-1-curves.svg").read_text(encoding="utf-8")
    assert all(f">{said}<" in drawn for said in ("Rise", "supply [L/min]", "last [bar]", "swing [bar]", "50 cm3"))
    assert Path("s.results/picture-2-distribution.png").stat().st_size > 5000
    assert label("gap", "mm^2") == label("gap", "mm2") == "gap [mm²]"


def test_progress_tells_the_remaining_time(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    progress = Progress(10, quiet=False)
    for status in ("done", "failed", "done", "slow"):
        now[0] += 15.0
        progress.row(status)
    progress.close()
    assert capsys.readouterr().err.splitlines() == [
        "2 of 10 points, 1 failed, 2 min 0 s left",
        "4 of 10 points, 1 failed, 1 slow, 1 min 30 s left",
    ]
    assert duration(3900.4) == "1 h 5 min"


# -- the manual ---------------------------------------------------------------------------------------

PAGE = (Path(__file__).resolve().parents[1] / "docs" / "studies.md").read_text(encoding="utf-8")


def test_the_study_of_the_manual_has_the_points_it_states(refused: Refusal) -> None:
    name, text = re.findall(r"```yaml\n# file: (\S+)\n(.*?)```", PAGE, re.DOTALL)[0]
    refused.write({name: text})
    out = refused.run("study", name, "--dry-run")[1]
    assert out.splitlines()[14].split() == ["14", "6.5", "30"]


@pytest.mark.parametrize("section", [StudyFile, VarySection, RunSection, UntilSection, PlotSection])
def test_every_key_of_a_study_file_is_described(section: type[BaseModel]) -> None:
    for name, field in section.model_fields.items():
        assert re.search(rf"\b{field.alias or name}:", PAGE), f"studies.md says nothing of {field.alias or name}:"


@pytest.mark.parametrize("status", [DONE, UNSETTLED, FAILED, SLOW, LOST])
def test_every_status_is_described(status: str) -> None:
    assert f"| `{status}` |" in PAGE


# -- shipped studies -----------------------------------------------------------------------------


@pytest.mark.parametrize("study", STUDIES, ids=lambda path: path.stem)
def test_a_shipped_study_is_ready_to_run(study: Path, refused: Refusal) -> None:
    code, out, err = refused.run("study", str(study), "--dry-run")
    assert (code, err) == (0, "")
    assert len(out.splitlines()) > 2


def test_the_relief_valve_study_gives_the_pressures_it_states(
    here: type[Here], capsys: pytest.CaptureFixture[str]
) -> None:
    """The equilibria that `circuits/relief_valve.yaml` states, by the balance of forces: 7.98, 9.02, 9.42 bar."""
    text = next(path for path in STUDIES if path.stem == "relief_valve").read_text(encoding="utf-8")
    short = text.replace("[5.5 bar, 6.5 bar, 7.5 bar]", "6.5 bar").replace(
        "{from: 6 L/min, to: 54 L/min, step: 6 L/min}", "[30 L/min, 48 L/min, 54 L/min]"
    )
    Path("s.yaml").write_text(short, encoding="utf-8")
    rows = told(capsys, "study", "s.yaml")["table"]
    assert [round(row["pressure"] / 1e5, 2) for row in rows] == [7.98, 9.02, 9.42]


ORDERS = ["-1 mm2, 0 mm2, 3 mm2, 4 mm2", "4 mm2, 3 mm2, 0 mm2, -1 mm2", "0 mm2, 4 mm2, -1 mm2, 3 mm2"]
SWEPT = """crescentlab: 1
fluid: {type: simple_oil, density: 860 kg/m^3, kinematic_viscosity: 30 cSt, bulk_modulus: 14000 bar}
parameters: {a: 5 mm2, n: 2}
components:
  pump: {type: flow_source, flow: 10 L/min}
  line: {type: capacity, volume: 1 L}
  load: {type: orifice, area: = a}
  tank: {type: tank}
nets:
  p1: [pump.port, line.port, load.a]
  p2: [load.b, tank.port]
simulation: {stop: 1 s}
"""


@pytest.mark.parametrize("order", ORDERS)
def test_rows_are_the_same_in_any_order(order: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """An area below 0 is refused and one of 0 has no way out: rows, wherever they stand.

    The other two from q = C_d A sqrt(2 dp / rho), with C_d at its largest for flow numbers in the thousands: the
    pressures are as the inverse squares of the areas, 16/9, but for the density at the mean pressure (below 1 %).
    """
    (tmp_path / "swept.yaml").write_text(SWEPT, encoding="utf-8")
    (tmp_path / "s.yaml").write_text(
        f"crescentlab_study: 1\ncircuit: swept.yaml\nvary: {{list: {{a: [{order}]}}}}\n"
        "run: {analysis: steady}\nmeasure: {p: final(line.p)}\n",
        encoding="utf-8",
    )
    assert main(["study", str(tmp_path / "s.yaml"), "-o", str(tmp_path / "rows"), "--json"]) == 0
    rows = {row["a"]: row for row in json.loads(capsys.readouterr().out)["table"]}
    assert [rows[a]["status"] for a in (-1e-6, 0.0, 3e-6, 4e-6)] == ["failed", "failed", "done", "done"]
    assert rows[-1e-6]["reason"] == "swept.yaml:7: load.area must be at least 0, not -1 mm2"
    assert "has no way out" in rows[0.0]["reason"]
    assert rows[3e-6]["p"] / rows[4e-6]["p"] == pytest.approx(16 / 9, rel=0.01)


def test_a_time_that_one_point_makes_impossible_is_its_row(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A window of 0 s and one beyond the run at the first points; a name that there is not is refused at once."""
    (tmp_path / "swept.yaml").write_text(SWEPT, encoding="utf-8")
    text = (
        "crescentlab_study: 1\ncircuit: swept.yaml\nvary: {list: {n: [0, 1000, 1]}}\n"
        "run: {stop: 0.1 s, window: = n * 10 ms}\nmeasure: {p: mean(line.p)}\n"
    )
    (tmp_path / "s.yaml").write_text(text, encoding="utf-8")
    assert main(["study", str(tmp_path / "s.yaml"), "-o", str(tmp_path / "rows"), "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["table"]
    assert [row["status"] for row in rows] == ["failed", "failed", "done"]
    assert "0 s, where a time above 0 is needed" in rows[0]["reason"]
    assert "is longer than the run" in rows[1]["reason"]
    (tmp_path / "s.yaml").write_text(text.replace("= n *", "= m *"), encoding="utf-8")
    assert main(["study", str(tmp_path / "s.yaml"), "-o", str(tmp_path / "rows")]) == 2
    assert "no parameter 'm'" in capsys.readouterr().err
