"""Tables of the study files beside this one: run by the study runner, numbers in SI."""

from __future__ import annotations

import functools
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import pandas as pd

import crescentlab as cl
from crescentlab.errors import SimulationError
from crescentlab.studies import conduct
from crescentlab.studies.planning import plan_study
from crescentlab.studies.points import DONE, Job, Reply, run_point
from crescentlab.studies.pool import LocalPool, Runner, cores
from crescentlab.studies.progress import Progress
from crescentlab.studies.sampling import Point
from crescentlab.studies.store import Store
from crescentlab.studies.study_file import Study
from studies.paper.effort import Effort

HERE = Path(__file__).parent


class Here:
    """Runs points in this process: for a few of them, sooner than processes start."""

    width = 1

    def run(self, jobs: Iterable[Job]) -> Iterator[Reply]:
        """Replies in the order of the jobs."""
        for job in jobs:
            yield run_point(circuit(job.circuit), job)

    def close(self) -> None:
        """Nothing is left behind."""


@functools.cache
def circuit(path: str) -> cl.Circuit:
    """A circuit, assembled once per structure."""
    return cl.load(path)


def table(name: str, effort: Effort, few: Mapping[str, tuple[str, ...]] | int = 1) -> pd.DataFrame:
    """Rows of ``<name>.yaml``: settings and outcomes; raises :class:`SimulationError` if a point did not go well.

    The short form runs the points whose settings are among those of ``few``, as they are written in the file, or every
    ``few``-th.
    """
    planned = plan_study(Study.read(HERE / f"{name}.yaml"))
    if not effort.full:
        planned = replace(planned, points=_chosen(planned.points, few))
    with tempfile.TemporaryDirectory() as folder:
        store = Store(Path(folder))
        store.open(planned, fresh=True)
        jobs = conduct.missing(planned, store)
        runner: Callable[[], Runner] = Here if not effort.full else lambda: LocalPool(min(cores(), len(jobs)))
        conduct.conduct(planned, store, jobs, runner, Progress(len(jobs), quiet=True))
        rows = pd.DataFrame(conduct.table(planned, store))
    bad = rows[rows["status"] != DONE]
    if len(bad):
        first = bad.iloc[0]
        raise SimulationError(f"{name}: {len(bad)} of {len(rows)} points did not go well; first {first['reason']}")
    return rows


def _chosen(points: list[Point], few: Mapping[str, tuple[str, ...]] | int) -> list[Point]:
    if isinstance(few, int):
        return points[::few]
    return [p for p in points if all(p.settings[name] in texts for name, texts in few.items())]
