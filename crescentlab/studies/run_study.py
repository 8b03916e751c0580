"""A study from its file to its table, for the command and for Python."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from crescentlab import arguments
from crescentlab.errors import InputError
from crescentlab.studies import conduct, tables
from crescentlab.studies.planning import Planned, plan_study
from crescentlab.studies.points import DONE, Job
from crescentlab.studies.pool import LocalPool, Runner, cores
from crescentlab.studies.progress import Progress
from crescentlab.studies.store import Row, Store
from crescentlab.studies.study_file import Study

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True)
class StudyTable:
    """The rows of a study in the order of its points, numbers in SI; ``table["pressure"]`` is one column."""

    planned: Planned
    rows: list[Row]
    """By column name; what there is not is None."""
    ran: int
    """Points that ran now; the others were there."""
    folder: Path
    """Where rows, tables and pictures lie."""
    files: list[Path]

    def __getitem__(self, name: str) -> np.ndarray:
        """A column, shape (rows,): numbers with NaN where there is none, or words."""
        known = list(self.rows[0]) if self.rows else [*self.planned.quantities, *self.planned.measures]
        arguments.choice(name, "column", known)
        values = [row[name] for row in self.rows]
        if any(isinstance(value, str) for value in values):
            return np.array(values, dtype=object)
        return np.array([np.nan if value is None else value for value in values], dtype=float)

    def to_dataframe(self) -> pandas.DataFrame:
        """All rows, indexed by the number of the point from 1."""
        import pandas as pd

        return pd.DataFrame(self.rows).set_index("point")

    def __repr__(self) -> str:
        """How many points became what, and the columns."""
        statuses = Counter(row["status"] for row in self.rows)
        said = ", ".join(f"{number} {status}" for status, number in statuses.items())
        columns = ", ".join([*self.planned.quantities, *self.planned.measures][:12])
        return f"<StudyTable {self.planned.study.name!r}: {len(self.rows)} points: {said}; {columns}; in {self.folder}>"


def study(
    path: str | Path, *, folder: str | Path | None = None, workers: int | None = None, scheduler: str | None = None,
    fresh: bool = False, retry: bool = False, no_code: bool = False, quiet: bool = True,
) -> StudyTable:  # fmt: skip
    """Run the points of a study file that have no row yet, in parallel; write and return its table.

    Rows lie in ``folder``, by default ``<study>.results`` here, so that a second call computes nothing anew.
    ``workers`` processes of this machine run them, or the Dask cluster at ``scheduler``. ``fresh`` discards the rows
    there are, ``retry`` runs failed, slow and lost points again; without ``quiet`` progress is told on stderr. A point
    that fails is a row with its reason; a wrong study raises :class:`InputError` with file and line.
    """
    planned, store = opened(arguments.path(path, "study"), folder, no_code=no_code)
    run_on = runner(None if workers is None else arguments.whole(workers, "workers", 1, 4), scheduler)
    store.open(planned, fresh=fresh)
    jobs = conduct.missing(planned, store, retry)
    return finish(planned, store, jobs, run_on, Progress(len(jobs), quiet))


def opened(path: Path, folder: str | Path | None, *, no_code: bool = False) -> tuple[Planned, Store]:
    """The plan of a study file, and where its rows are kept; the folder around it must be there."""
    read = Study.read(path)
    planned = plan_study(read, no_code=no_code)
    at = conduct.results_folder(read.path, None if folder is None else str(arguments.path(folder, "folder")))
    if not at.parent.is_dir():
        raise InputError(f"-o {at}: the folder {at.parent} does not exist; make it first")
    return planned, Store(at)


def runner(
    workers: int | None, scheduler: str | None, pool: Callable[[int], Runner] = LocalPool
) -> Callable[[int], Runner]:
    """What makes the processes that run so many points: a ``pool`` of this machine, or a cluster."""
    if workers and scheduler:
        raise InputError("--workers is for this machine, --scheduler for a cluster; give one of them")

    def made(jobs: int) -> Runner:
        if scheduler:
            from crescentlab.studies.dask_runner import DaskPool

            return DaskPool(scheduler)
        return pool(min(workers or cores(), jobs))

    return made


def finish(
    planned: Planned, store: Store, jobs: list[Job], run_on: Callable[[int], Runner], progress: Progress
) -> StudyTable:
    """Run the jobs, and write the tables and pictures of all rows that there are then."""
    from crescentlab.studies.pictures import write_pictures

    conduct.conduct(planned, store, jobs, lambda: run_on(len(jobs)), progress)
    rows = conduct.table(planned, store)
    files = [*tables.write_table(store.folder, planned, rows), *write_pictures(planned, rows, store.folder)]
    return StudyTable(planned, rows, len(jobs), store.folder, files)


def any_good(rows: list[dict[str, Any]]) -> bool:
    """Whether any point is done."""
    return any(row["status"] == DONE for row in rows)
