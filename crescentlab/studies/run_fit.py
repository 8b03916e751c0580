"""A fit from its file to its judgement, for Python."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from crescentlab import arguments
from crescentlab.arguments import Settings
from crescentlab.studies.fit_problem import read_problem
from crescentlab.studies.fit_report import Fit, run_fit


def fit(
    path: str | Path, parameters: Settings | None = None, *, starts: int | None = None, workers: int | None = None,
    no_code: bool = False, progress: Callable[[float], None] | None = None,
) -> Fit:  # fmt: skip
    """Fit parameters of a circuit to measured data, as a fit file says.

    ``parameters`` replace those of the file's ``set:``, ``starts`` its number of searches; ``workers`` runs go side by
    side. Raises :class:`InputError` with file and line for whatever cannot be used, :class:`SimulationError` if every
    search fails.
    """
    problem = read_problem(
        arguments.path(path, "fit"), arguments.settings(parameters),
        starts=None if starts is None else arguments.whole(starts, "starts", 1, 5), no_code=no_code,
    )  # fmt: skip
    return run_fit(
        problem, workers=None if workers is None else arguments.whole(workers, "workers", 1, 4), progress=progress
    )
