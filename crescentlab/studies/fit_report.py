"""A fit run and judged: its warnings, and all of it as plain data."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from crescentlab.errors import SimulationError
from crescentlab.studies.fit_advice import Adviser
from crescentlab.studies.fit_model import CircuitModel
from crescentlab.studies.fit_problem import Parameter, Problem
from crescentlab.studies.fitting import Fitted, fit
from crescentlab.studies.identifiability import Weakness, sentence, weaknesses

UNLIKELY = 1e-3
"""A chi2 that improbable contradicts the given uncertainties."""
EQUALLY_GOOD = 1.0
"""Minima whose chi2 differ by less are equally good."""
BENT = 2.0
"""A growth of chi2 that far from that of a linear model is told."""
FLAT = 0.25
"""Where chi2 grows by less than 1 two standard errors away, others make up for the parameter."""
NOISE_SHARE = 0.1
"""Noise of the simulation beyond this part of a standard deviation is told."""


@dataclass(frozen=True)
class Fit:
    """A fit with all that is said of it."""

    problem: Problem
    fitted: Fitted
    failures: dict[int, str]
    """Rows whose run failed at the solution, and why."""
    runs: int
    warnings: list[str]
    inexact: str
    """Why derivatives are not exact; empty where they are."""

    @property
    def parameters(self) -> dict[str, float]:
        """What was found, SI, by name."""
        return {p.name: float(v) for p, v in zip(self.problem.parameters, self.fitted.theta, strict=True)}

    def __repr__(self) -> str:
        """What was found, in the units of the file."""
        values = self.parameters
        shown = ", ".join(f"{p.name} {p.quantity.show(values[p.name], p.unit)}" for p in self.problem.parameters)
        rows = self.problem.data.measured.size
        more = f", {len(self.warnings)} warnings" if self.warnings else ""
        return f"<Fit {self.problem.title!r}: {shown}; {rows} measured values, {self.runs} runs{more}>"

    @property
    def residuals(self) -> np.ndarray:
        """(measured - computed) / sigma, shape (m,); NaN where the run failed."""
        return np.asarray((self.problem.data.measured - self.fitted.computed) / self.fitted.sigma)


def run_fit(problem: Problem, *, workers: int | None = None, progress: Callable[[float], None] | None = None) -> Fit:
    """Fit, then say what the fit is worth."""
    model = CircuitModel(problem, workers=workers)
    file = problem.file
    try:
        fitted = fit(
            model, problem.data, problem.start, problem.scale, starts=problem.starts, seed=file.seed, progress=progress
        )
    except SimulationError as error:
        row, why = next(iter(model.failures.items()), (0, ""))
        raise SimulationError(f"{error}; {problem.table.places[row]}: {why}" if why else str(error)) from None
    rows = sorted({int(row) for row, _ in problem.where[~fitted.active]})
    failures = {row: model.failures.get(row, "no value") for row in rows}
    said = [*_weak(problem, model, fitted), *_doubts(problem, fitted, failures)]
    return Fit(problem, fitted, failures, model.runs, said, model.reason)


# -- warnings ------------------------------------------------------------------------------------


def _weak(problem: Problem, model: CircuitModel, fitted: Fitted) -> list[str]:
    """Parameters that the data cannot tell apart, and what would."""
    names = [p.name for p in problem.parameters]
    positive = problem.scale.positive
    adviser = Adviser(problem, model, fitted)
    weak = weaknesses(fitted.identifiability)
    said = [f"{sentence(each, names, lambda k: bool(positive[k]))}; {adviser.advice(each)}" for each in weak]
    return said + _valley(problem, fitted, [each.members for each in weak], adviser)


def _valley(problem: Problem, fitted: Fitted, known: list[tuple[int, ...]], adviser: Adviser) -> list[str]:
    """Parameters that make up for one another although the derivatives at the solution do not show it."""
    judged = fitted.linearity
    side, worst = judged.flattest, judged.worst
    growth = judged.growth[side]
    if len(problem.parameters) < 2 or not growth < FLAT:
        return []
    moved = np.abs(judged.ends[side] - problem.scale.u(fitted.theta))
    moved[worst] = -1.0
    pair = (worst, int(np.argmax(moved)))
    if any(set(pair) <= set(members) for members in known):
        return []
    there = problem.scale.of_u(judged.ends[side])
    a, b = (problem.parameters[k] for k in pair)
    values = [show(p, float(there[k]), 3) for p, k in ((a, pair[0]), (b, pair[1]))]
    told = f"with {values[0]} and {values[1]} the data fit as well (chi2 changes by {judged.rise[side]:.2g})"
    weakness = Weakness(pair, told)
    return [f"{a.name} and {b.name} can hardly be told apart: {told}; {adviser.further(weakness)}"]


def _doubts(problem: Problem, fitted: Fitted, failures: dict[int, str]) -> list[str]:
    """Bounds, wide intervals, contradictions, failures, noise."""
    said: list[str] = []
    for k, p in enumerate(problem.parameters):
        if k in fitted.at_bound:
            upper = fitted.theta[k] - p.low > p.high - fitted.theta[k]
            bound = show(p, p.high if upper else p.low)
            said.append(
                f"{p.name} is at its {'upper' if upper else 'lower'} bound, {bound}: the data ask for a value beyond; "
                "its standard error and the correlations with it are as if there were no bound"
            )
        elif math.isfinite(fitted.errors[k]) and fitted.intervals[k, 0] < p.low and fitted.intervals[k, 1] > p.high:
            said.append(f"{p.name}: its 95 % interval reaches beyond both bounds; the data say next to nothing of it")
    if not fitted.estimated and fitted.freedom > 0:
        ratio = math.sqrt(fitted.chi2 / fitted.freedom)
        if fitted.probability < UNLIKELY:
            said.append(
                f"the residuals are {ratio:.3g} times as large as the uncertainties say: the model does not describe "
                f"the data, or the uncertainties are too small; then every standard error is {ratio:.3g} times as large"
            )
        elif fitted.probability > 1 - UNLIKELY:
            said.append(
                f"the residuals are only {ratio:.3g} times as large as the uncertainties say; are they too large?"
            )
    alike = [m for m in fitted.minima[1:] if abs(m.objective - fitted.minima[0].objective) < EQUALLY_GOOD]
    if alike:
        said.append(f"{len(alike) + 1} minima fit equally well: the solution is not unique")
    growth = [g for g in fitted.linearity.growth if not math.isnan(g)]
    bent = [g for g in growth if not 1 / BENT < g < BENT]
    if bent and min(growth) >= FLAT:
        name = problem.parameters[fitted.linearity.worst].name
        said.append(
            f"with {name} two standard errors away chi2 grows by {4 * bent[0]:.2g} instead of 4: the model is far from "
            "linear there, take errors and intervals as rough"
        )
    if not fitted.finished:
        said.append("the best search did not come to its end; give it a nearer start, or narrower bounds")
    if failures:
        said.append(f"{_rows(len(failures))} could not be simulated at the solution and took no part in the fit")
    if fitted.failed_starts:
        said.append(f"too little could be simulated at {len(fitted.failed_starts)} of the starts")
    noise = _noise_in_sigmas(problem, fitted)
    if noise > NOISE_SHARE:
        said.append(
            f"the simulation's own noise is {noise:.2g} standard deviations of the data; write a smaller run.rtol"
        )
    return said


def _noise_in_sigmas(problem: Problem, fitted: Fitted) -> float:
    if not math.isfinite(fitted.noise):
        return 0.0
    sizes = np.array([problem.data.size(k) for k in range(len(problem.measured))])[problem.data.column]
    return float((fitted.noise * sizes / fitted.sigma)[fitted.active].max(initial=0.0))


def _rows(number: int) -> str:
    return f"{number} row{'' if number == 1 else 's'}"


def show(parameter: Parameter, value: float, digits: int = 5) -> str:
    """A value in the unit the user wrote the parameter in."""
    return parameter.quantity.show(value, parameter.unit, digits)


# -- plain data ----------------------------------------------------------------------------------------


def report(found: Fit) -> dict[str, Any]:
    """The fit as plain data, SI; what is not determined is infinite or NaN."""
    problem, fitted = found.problem, found.fitted
    weak = fitted.identifiability
    names = [p.name for p in problem.parameters]
    correlation = weak.correlation.tolist()
    return {
        "status": "done", "title": problem.title, "circuit": problem.circuit.netlist.name, "data": problem.table.path,
        "parameters": {p.name: _parameter(p, k, fitted) for k, p in enumerate(problem.parameters)},
        "correlation": {a: dict(zip(names, row, strict=True)) for a, row in zip(names, correlation, strict=True)},
        "condition": weak.condition, "collinearity": weak.collinearity,
        "singular_values": weak.singular_values.tolist(),
        "chi2": fitted.chi2, "degrees_of_freedom": fitted.freedom,
        "probability": None if fitted.estimated else fitted.probability,
        "minima": [
            {"parameters": dict(zip(names, m.theta.tolist(), strict=True)), "chi2": m.chi2, "objective": m.objective,
             "starts": list(m.starts)} for m in fitted.minima
        ],
        "failed_starts": list(fitted.failed_starts),
        "failed_rows": [{"line": problem.table.places[row].line, "reason": why} for row, why in found.failures.items()],
        "measured": _residuals(found),
        "derivatives": fitted.method, "derivatives_reason": found.inexact or None, "difference_step": fitted.step,
        "noise": fitted.noise,
        "linearity": list(fitted.linearity.growth),
        "evaluations": fitted.evaluations, "runs": found.runs, "warnings": found.warnings, "error": None,
    }  # fmt: skip


def _parameter(p: Parameter, k: int, fitted: Fitted) -> dict[str, Any]:
    return {
        "value": float(fitted.theta[k]), "standard_error": float(fitted.errors[k]), "unit": p.quantity.si,
        "low_95": float(fitted.intervals[k, 0]), "high_95": float(fitted.intervals[k, 1]), "start": p.start,
        "low": p.low, "high": p.high, "at_bound": k in fitted.at_bound,
        "text": show(p, float(fitted.theta[k]), 6),
    }  # fmt: skip


def _residuals(found: Fit) -> dict[str, Any]:
    """Row by row what was measured and what is computed, by column."""
    data, fitted, problem = found.problem.data, found.fitted, found.problem
    made: dict[str, Any] = {}
    for k, each in enumerate(problem.measured):
        of = data.column == k
        lines = [problem.table.places[int(row)].line for row, _ in problem.where[of]]
        made[each.name] = {
            "outcome": each.outcome.text, "unit": each.quantity.si, "lines": lines,
            "measured": data.measured[of].tolist(), "computed": fitted.computed[of].tolist(),
            "standard_deviation": fitted.sigma[of].tolist(), "estimated": bool(data.estimated[of].any()),
        }  # fmt: skip
    return made
