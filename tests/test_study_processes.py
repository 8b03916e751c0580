"""Studies in processes of their own: time limits, deaths, interruptions, exact repetition, a cluster."""

from __future__ import annotations

import csv
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from study_bench import STUDY, Here, pressure, told, write

import crescentlab.commands.study as command
from crescentlab.cli import main

HARD = STUDY.replace(
    "  grid: {supply: [3 L/min, 6 L/min, 12 L/min]}",
    "  list: {pump.flow: [3 L/min, 6 L/min, 9 L/min, 12 L/min], burns_at: [0, 0.01, 1, 0]}",
).replace(
    "run: {stop: 10 ms, rtol: 1e-8}",
    "run: {stop: '= where(burns_at == 0, 10 ms, 1e6 s)', solver: rodas, max_step: 1 ms, time_limit: 1 s}",
)
"""Four points: good; a thousand million steps in C; one that ends its process; good."""


@pytest.fixture(scope="module")
def hard(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A folder in which the hard study has run in two processes."""
    folder = tmp_path_factory.mktemp("hard")
    text = HARD.replace("burns_at == 0", "burns_at < 0.005")
    write(folder, text)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        assert main(["study", "s.yaml", "--workers", "2", "--quiet"]) == 0
        yield folder


def test_a_slow_and_a_dying_point_become_rows(hard: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = told(capsys, "study", "s.yaml")["table"]
    assert [row["status"] for row in rows] == ["done", "slow", "lost", "done"]
    assert rows[1]["reason"] == "took longer than 1 s"
    assert rows[2]["reason"].startswith("its process ended with exit code 7")
    assert rows[3]["last"] == pytest.approx(pressure(2e-4), rel=1e-5)


def test_a_row_is_repeated_to_the_last_bit(hard: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """In another process; a stored number changed in its last place is found."""
    found = told(capsys, "rerun", "s.yaml", "4", "-o", "again.csv")
    assert (found["equal"], found["different"]) == (True, [])
    assert found["now"]["last"] == found["stored"]["last"]
    with Path("again.csv").open(encoding="utf-8") as file:
        series = list(csv.DictReader(file))
    assert float(series[-1]["line.p [Pa]"]) == found["now"]["last"]
    row = {**found["stored"], "last": found["stored"]["last"] * (1 + 2**-52)}
    shutil.copytree("s.results", "bent")
    Path("bent/journal.jsonl").write_text(json.dumps(row) + "\n", encoding="utf-8")
    assert main(["rerun", "s.yaml", found["stored"]["key"][:8], "-o", "none", "--rows", "bent"]) == 3
    out, err = capsys.readouterr()
    assert "different: last" in out
    assert "does not come out the same" in err


SLOWLY = STUDY.replace("[3 L/min, 6 L/min, 12 L/min]", "{from: 1 L/min, to: 40 L/min, count: 16}").replace(
    "rtol: 1e-8", "solver: rk45, max_step: 20 us, compile: false"
)
"""Sixteen points of a tenth of a second."""


def started(folder: Path) -> subprocess.Popen[str]:
    """The slow study, running in two processes of its own, some rows done."""
    write(folder, SLOWLY)
    line = [sys.executable, "-m", "crescentlab", "study", "s.yaml", "--workers", "2"]
    running = subprocess.Popen(line, cwd=folder, stderr=subprocess.PIPE, text=True, start_new_session=True)
    journal = folder / "s.results" / "journal.jsonl"
    while not journal.is_file() or journal.read_text(encoding="utf-8").count("\n") < 3:
        assert running.poll() is None, "the study ended before it could be disturbed"
        time.sleep(0.02)
    return running


def children(pid: int) -> list[int]:
    """Processes that a process has started."""
    tasks = Path(f"/proc/{pid}/task").glob("*/children")
    return [int(child) for task in tasks for child in task.read_text(encoding="utf-8").split()]


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="looks for processes in /proc")
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGINT])
def test_a_study_that_is_killed_keeps_every_finished_row(
    tmp_path: Path, how: signal.Signals, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """And leaves no process behind."""
    running = started(tmp_path)
    workers = children(running.pid)
    assert len(workers) == 2
    os.killpg(running.pid, how) if how is signal.SIGINT else running.kill()
    said = running.communicate(timeout=30)[1]
    if how is signal.SIGINT:
        assert running.returncode == 130
        assert "the same command goes on" in said
    deadline = time.monotonic() + 10
    while any(Path(f"/proc/{pid}").is_dir() for pid in workers) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert not any(Path(f"/proc/{pid}").is_dir() for pid in workers)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(command, "LocalPool", Here)
    monkeypatch.setattr(Here, "ran", [])
    listed = told(capsys, "study", "s.yaml", "--dry-run")["points"]
    stored = {point["key"] for point in listed if point["stored"]}
    assert 3 <= len(stored) < 16
    found = told(capsys, "study", "s.yaml")
    assert found["ran"] == len(Here.ran) == 16 - len(stored)
    assert not stored & set(Here.ran)
    assert [row["status"] for row in found["table"]] == ["done"] * 16


def test_a_cluster_gives_the_same_table(hard: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Two Dask workers against processes of this machine, to the last bit; a slow and a dying point among them."""
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        there = told(capsys, "study", "s.yaml", "--scheduler", cluster.scheduler_address, "-o", "there")["table"]
    here = told(capsys, "study", "s.yaml")["table"]
    assert [row["status"] for row in there] == ["done", "slow", "lost", "done"]
    for one, other in zip(there, here, strict=True):
        assert {**one, "wall_s": 0} == {**other, "wall_s": 0}
