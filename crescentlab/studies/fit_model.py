"""A circuit as the model of a fit: parameters -> computed values of every measured one.

Rows of equal settings are one run. Runs go side by side in threads on one assembled system: the compiled loop leaves
the interpreter free, and what it computes does not depend on what runs beside it.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import product

import numpy as np

from crescentlab.analysis.spectrum.dense import Dense
from crescentlab.errors import InputError, SimulationError
from crescentlab.studies.fit_problem import Point, Problem
from crescentlab.studies.points import DONE, Job, run_point, seconds
from crescentlab.studies.provenance import Source
from crescentlab.studies.study_file import RunSection
from crescentlab.units import QUANTITIES

Array = np.ndarray


def _not_exact(run: RunSection, series: bool) -> str:
    """Why runs of this kind have no exact derivatives; empty where they may have."""
    if series:
        return "the data are a series over time; exact derivatives are those of outcomes"
    if run.analysis != "simulate":
        return f"exact derivatives are those of analysis: simulate, not {run.analysis}"
    return "exact derivatives need an end of the run that is given, not until:" if run.until is not None else ""


class CircuitModel:
    """Computed values of a problem; see :class:`crescentlab.studies.fitting.Model`."""

    def __init__(self, problem: Problem, *, workers: int | None = None) -> None:
        self.problem = problem
        self.workers = workers or os.cpu_count() or 1
        self.failures: dict[int, str] = {}
        """What the latest failing run of each row said, by row."""
        self.runs = 0
        self._answers, self._places = self._values_of_points()
        self._warm = False
        run = problem.file.run
        self.reason = _not_exact(run, problem.times is not None)
        """Why derivatives are not exact; empty while they may be."""
        self._checked = False

    def _values_of_points(self) -> tuple[list[Array], list[Array]]:
        """For each point the numbers of the values that it answers, and their rows among those of the point."""
        owner = np.zeros(self.problem.table.rows, dtype=int)
        place = np.zeros(self.problem.table.rows, dtype=int)
        for k, point in enumerate(self.problem.points):
            owner[list(point.rows)], place[list(point.rows)] = k, np.arange(len(point.rows))
        rows = self.problem.where[:, 0]
        order = np.argsort(owner[rows], kind="stable")
        answers = np.split(order, np.searchsorted(owner[rows][order], np.arange(1, len(self.problem.points))))
        return answers, [place[rows[values]] for values in answers]

    def computed(self, thetas: Sequence[Array]) -> Array:
        """Values of each set of parameters, shape (sets, m); NaN where the simulation failed."""
        made = np.full((len(thetas), len(self.problem.where)), np.nan)
        work = [(s, k) for s, k in product(range(len(thetas)), range(len(self._answers))) if self._answers[k].size]
        points = self.problem.points
        found = self.run([(points[k], thetas[s]) for s, k in work])
        for (s, k), values in zip(work, found, strict=True):
            rows, columns = self.problem.where[self._answers[k]].T
            if isinstance(values, str):
                self.failures.update(dict.fromkeys(rows.tolist(), values))
            else:
                made[s, self._answers[k]] = values[self._places[k], columns]
        return made

    def run(self, work: Sequence[tuple[Point, Array]], more: Sequence[str] = ()) -> list[Array | str]:
        """Runs side by side: of each the values, shape (rows, measured columns), or why it failed.

        ``more`` are outcomes besides the measured ones, in columns after them; series have none.
        """
        self.runs += len(work)
        first: list[Array | str] = []
        if not self._warm and work:  # what is built at the first run is built once
            first, self._warm = [self.one(*work[0], more)], True
        rest = work[len(first) :]

        def run(each: tuple[Point, Array]) -> Array | str:
            return self.one(each[0], each[1], more)

        if self.workers == 1 or len(rest) < 2:
            return first + [run(each) for each in rest]
        with ThreadPoolExecutor(self.workers) as pool:
            return first + list(pool.map(run, rest))

    def settings(self, point: Point, theta: Array) -> dict[str, str]:
        """A run's settings as for ``--set``."""
        found = {p.name: p.text(float(v)) for p, v in zip(self.problem.parameters, theta, strict=True)}
        return {**point.settings, **found}

    def one(self, point: Point, theta: Array, more: Sequence[str] = ()) -> Array | str:
        """One run."""
        settings = self.settings(point, theta)
        try:
            series = self.problem.times is not None
            made = self.series(point, settings) if series else self.outcomes(point, settings, more)
        except (SimulationError, InputError) as error:  # bounds and start were accepted: it fails between them
            return str(error)
        if not np.isfinite(made).all():
            return "a value that is not finite"
        return made

    # -- exact derivatives -----------------------------------------------------------------------

    def jacobian(self, theta: Array) -> Array | None:
        """Exact derivatives by the parameters, shape (m, p); None where a run has none.

        Before they are relied on, those of the first point are compared with a difference.
        """
        if self.reason:
            return None
        made = np.full((len(self.problem.where), theta.size), np.nan)
        for point, answers in zip(self.problem.points, self._answers, strict=True):
            if not answers.size:
                continue
            slopes = self.slopes(self.settings(point, theta))
            if slopes is None:
                return None
            made[answers] = slopes[self.problem.where[answers, 1]]
        return made

    def slopes(self, settings: dict[str, str]) -> Array | None:
        """Derivatives of a run's outcomes, shape (measured columns, p); None if any is not exact."""
        from crescentlab.analysis.sensitivity import sensitivities

        problem, run = self.problem, self.problem.file.run
        try:
            design = problem.circuit.design(settings)
            stop = problem.circuit.netlist.sections.simulation.stop if run.stop is None else seconds(run.stop, design)
            begin = None if run.window is None else stop - seconds(run.window, design)
            found = sensitivities(
                problem.circuit, [each.outcome for each in problem.measured], [p.name for p in problem.parameters],
                settings, stop=stop, window=(begin, None), method="auto" if not self._checked else "exact",
                rtol=run.rtol or problem.circuit.netlist.sections.simulation.rtol, compile=run.compile,
                check=not self._checked,
            )  # fmt: skip
        except (SimulationError, InputError) as error:
            self.reason = error.message if isinstance(error, InputError) else str(error)
            return None
        self._checked = True
        if set(found.method) == {"exact"}:
            return found.derivative
        k = next(k for k, method in enumerate(found.method) if method != "exact")
        self.reason = f"{found.parameters[k].name}: {found.reason[k]}"
        return None

    # -- one run ---------------------------------------------------------------------------------

    def outcomes(self, point: Point, settings: dict[str, str], more: Sequence[str]) -> Array:
        """Outcomes of a run, the same for every row of the point."""
        problem = self.problem
        measure = {str(k): text for k, text in enumerate([*(m.outcome.text for m in problem.measured), *more])}
        job = Job(
            key="", circuit="", no_code=False, source=Source({}, {}, {}), settings=settings, varied=(),
            run=problem.file.run, measure=measure,
        )  # fmt: skip
        reply = run_point(problem.circuit, job)
        if reply.status != DONE:
            raise SimulationError(reply.reason)
        return np.tile([reply.outcomes[name] for name in measure], (len(point.rows), 1))

    def series(self, point: Point, settings: dict[str, str]) -> Array:
        """Variables at the times of the point's rows."""
        times = self.problem.times
        assert times is not None
        run = self.problem.file.run
        rows = times[list(point.rows)]
        result = self.problem.circuit.simulate(
            float(rows.max()), settings, solver=run.solver, rtol=run.rtol, max_step=run.max_step, compile=run.compile
        )
        names = [each.outcome.text for each in self.problem.measured]
        dense = Dense(result, names)
        if rows.max() > dense.stop * (1 + 1e-12):
            last, wanted = (QUANTITIES["time"].show(float(t), "ms") for t in (dense.stop, rows.max()))
            raise SimulationError(f"the run ended at {last}, before the last time of the data, {wanted}")
        found = dense.at(np.minimum(rows, dense.stop))
        return found[:, [dense.names.index(name) for name in names]]
