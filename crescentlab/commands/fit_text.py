"""The summary of ``crescentlab fit``."""

from __future__ import annotations

import math

import numpy as np

from crescentlab.commands.text import counted, table
from crescentlab.studies.fit_problem import Parameter
from crescentlab.studies.fit_report import Fit, show
from crescentlab.studies.fitting import Fitted
from crescentlab.units import normalise

MOST_LINES = 8
"""Most minima or failed rows listed."""


def summary(found: Fit) -> str:
    """The fit in a few lines."""
    parts = [found.problem.title, table(_facts(found), indent="  "), _estimates(found)]
    if len(found.problem.parameters) > 1:
        parts.append(_correlations(found))
    parts.append(_columns(found))
    if len(found.fitted.minima) > 1:
        parts.append(_minima(found))
    if found.failures:
        parts.append(_failed(found))
    parts += [f"  warning: {warning}" for warning in found.warnings]
    return "\n\n".join(parts)


def _facts(found: Fit) -> list[tuple[str, str]]:
    problem, fitted = found.problem, found.fitted
    values = counted(int(fitted.active.sum()), "value")
    rows = [
        ("data", f"{problem.table.path}: {counted(problem.table.rows, 'row')}, {values}, "
                 f"{counted(len(problem.points), 'operating point' if problem.times is None else 'run')}"),
        ("search", f"{counted(problem.starts, 'start')}, {counted(len(fitted.minima), 'minimum', 'minima')}; "
                   f"{counted(fitted.evaluations, 'set')} of parameters, {counted(found.runs, 'run')}"),
        ("derivatives", _derivatives(fitted)),
        *([("", found.inexact)] if found.inexact else []),
    ]  # fmt: skip
    if fitted.freedom > 0 and not fitted.estimated:
        freedom = f"{counted(fitted.freedom, 'degree')} of freedom"
        rows.append(("chi2", f"{fitted.chi2:.4g} for {freedom}, probability {fitted.probability:.2g}"))
    return rows


def _derivatives(fitted: Fitted) -> str:
    if "differences" not in fitted.method:
        return fitted.method
    return f"{fitted.method}, steps of {100 * fitted.step:.2g} %; noise of the simulation {fitted.noise:.1g}"


def _estimates(found: Fit) -> str:
    rows: list[tuple[str, ...]] = [("", "", "value", "standard error", "95 % from", "to", "start", "low", "high")]
    for k, p in enumerate(found.problem.parameters):
        value, error = float(found.fitted.theta[k]), float(found.fitted.errors[k])
        low, high = (float(v) for v in found.fitted.intervals[k])
        spread = f"\u00b1 {error / p.quantity.factor(p.unit):.3g}" if error < p.high - p.low else "not determined"
        ends = [_plain(p, low) if low > p.low else f"< {_plain(p, p.low)}"]
        ends.append(_plain(p, high) if high < p.high else f"> {_plain(p, p.high)}")
        given = [_plain(p, v) for v in (p.start, p.low, p.high)]
        rows.append((p.name, "" if p.unit in ("", "1") else p.unit, _plain(p, value), spread, *ends, *given))
    return table(rows, right=tuple(range(2, 9)), indent="  ")


def _plain(parameter: Parameter, value: float) -> str:
    """The number alone, in the parameter's unit."""
    offset = parameter.quantity.offsets.get(normalise(parameter.unit), 0.0)
    return f"{(value - offset) / parameter.quantity.factor(parameter.unit):.4g}"


def _correlations(found: Fit) -> str:
    names = [p.name for p in found.problem.parameters]
    matrix = found.fitted.identifiability.correlation
    rows = [("correlation", *names)]
    rows += [
        (name, *[f"{v:.3f}" for v in matrix[k, : k + 1]], *[""] * (len(names) - k - 1)) for k, name in enumerate(names)
    ]
    condition = found.fitted.identifiability.condition
    return table(rows, right=tuple(range(1, len(names) + 1)), indent="  ") + (
        f"\n  condition {condition:.3g}" if math.isfinite(condition) else "\n  condition infinite"
    )


def _columns(found: Fit) -> str:
    """Each measured column: standard deviation and residuals."""
    rows = [("measured", "", "values", "standard deviation", "", "rms residual", "largest")]
    residuals = found.residuals
    data, fitted = found.problem.data, found.fitted
    for k, each in enumerate(found.problem.measured):
        of = (data.column == k) & fitted.active
        if not of.any():
            rows.append((each.name, each.outcome.text, "0", "", "", "", ""))
            continue
        unit = each.unit or each.quantity.si
        share = data.share[of][0]
        sd = f"{100 * share:.3g} %" if math.isfinite(share) else each.quantity.show(_middle(fitted.sigma[of]), unit, 3)
        kind = "from the residuals" if data.estimated[of][0] else "given"
        difference = (data.measured - fitted.computed)[of]
        rms = each.quantity.show(float(np.sqrt(np.mean(difference**2))), unit, 3)
        largest = f"{float(np.abs(residuals[of]).max()):.2g} sd"
        rows.append((each.name, each.outcome.text, str(int(of.sum())), sd, kind, rms, largest))
    return table(rows, right=(2, 3, 5, 6), indent="  ")


def _middle(values: np.ndarray) -> float:
    return float(np.median(values))


def _minima(found: Fit) -> str:
    parameters = found.problem.parameters
    best = found.fitted.minima[0].objective
    rows: list[tuple[str, ...]] = [("minima", *[p.name for p in parameters], "chi2", "-2 ln likelihood", "starts")]
    for number, each in enumerate(found.fitted.minima[:MOST_LINES], start=1):
        values = [show(p, float(v), 4) for p, v in zip(parameters, each.theta, strict=True)]
        above = "0" if number == 1 else f"+{each.objective - best:.3g}"
        rows.append((str(number), *values, f"{each.chi2:.4g}", above, str(len(each.starts))))
    return table(rows, right=tuple(range(1, len(parameters) + 4)), indent="  ")


def _failed(found: Fit) -> str:
    places = found.problem.table.places
    lines = [f"  {places[row]}: {why}" for row, why in list(found.failures.items())[:MOST_LINES]]
    more = len(found.failures) - MOST_LINES
    return "\n".join(["  failed rows", *lines, *([f"  and {more} more"] if more > 0 else [])])
