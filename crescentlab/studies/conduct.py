"""A study from its plan to its rows: what is missing is computed, as far as it comes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from crescentlab.errors import InputError
from crescentlab.studies.planning import Planned
from crescentlab.studies.points import FAILED, LOST, SLOW, Job
from crescentlab.studies.pool import Runner
from crescentlab.studies.progress import Progress
from crescentlab.studies.store import Row, Store, row_of
from crescentlab.studies.study_file import BOOKKEEPING
from crescentlab.studies.worker import CHANGED

RETRIED = (FAILED, SLOW, LOST)
"""What ``--retry`` computes again."""


def results_folder(study: Path, output: str | None) -> Path:
    """Where a study's rows lie: ``<study>.results`` in the current folder, or what ``-o`` names."""
    return Path(output) if output else Path(f"{study.stem}.results")


def missing(planned: Planned, store: Store, retry: bool = False) -> list[Job]:
    """Points without a row, or whose row is to be made again: slow ones once the time limit is longer."""
    limit = planned.study.sections.run.time_limit
    jobs: dict[str, Job] = {}
    for point, key in zip(planned.points, planned.keys, strict=True):
        row = store.rows.get(key)
        again = row is not None and row["status"] == SLOW and (limit is None or limit > (row["wall_s"] or 0.0))
        if row is None or again or (retry and row["status"] in RETRIED):
            jobs.setdefault(key, planned.job(point))
    return list(jobs.values())


def conduct(planned: Planned, store: Store, jobs: list[Job], runner: Callable[[], Runner], progress: Progress) -> None:
    """Run the jobs and keep their rows; the store is closed at the end, whichever it is.

    Raises :class:`InputError` if the circuit changes meanwhile, KeyboardInterrupt when interrupted.
    """
    state = "interrupted"
    try:
        if jobs:
            _run(planned, store, jobs, runner(), progress)
        state = "complete"
    finally:
        progress.close()
        store.close(state)


def _run(planned: Planned, store: Store, jobs: list[Job], runner: Runner, progress: Progress) -> None:
    by_key = {job.key: job for job in jobs}
    try:
        for reply in runner.run(jobs):
            if reply.status == CHANGED:
                raise InputError(reply.reason)
            store.add(row_of(reply, by_key[reply.key], planned))
            progress.row(reply.status)
    finally:
        runner.close()


def table(planned: Planned, store: Store) -> list[Row]:
    """The study's rows in the order of its points, numbered from 1; without those that are still missing."""
    return list(_table(planned, store))


def _table(planned: Planned, store: Store) -> Iterator[Row]:
    named = any(point.role for point in planned.points)
    for number, (point, key) in enumerate(zip(planned.points, planned.keys, strict=True), start=1):
        if key in store.rows:
            row = store.rows[key]
            first = {"point": number, **({"role": point.role} if named else {})}
            own = {name: row[name] for name in (*planned.quantities, *planned.measures)}
            yield {**first, **own, **{name: row[name] for name in BOOKKEEPING if name in row}}
