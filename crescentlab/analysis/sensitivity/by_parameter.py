r"""Sensitivities of outcomes to parameters: exact where the run is smooth between its events, else by differences.

.. math:: \frac{dy}{da}, \qquad \frac{a}{y}\frac{dy}{da}

The exact way integrates the variational equation along one run (:mod:`crescentlab.analysis.sensitivity.variational`);
differences repeat the run with other values (:mod:`crescentlab.analysis.sensitivity.differences`). Which was taken, and
why, is in the result.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from crescentlab import arguments
from crescentlab.analysis.outcome import Outcome, Window
from crescentlab.analysis.reach import NotDifferentiableError, Parameter, Reach, Reaching
from crescentlab.analysis.sensitivity.differences import LOOSEST, Runs, differences
from crescentlab.analysis.sensitivity.extremes import refined
from crescentlab.analysis.sensitivity.moved import Moving
from crescentlab.analysis.sensitivity.parameters import find
from crescentlab.analysis.sensitivity.tones import STAYS, check_tones, refusal, tones
from crescentlab.analysis.sensitivity.variational import trajectory_sensitivity
from crescentlab.arguments import Number, Settings
from crescentlab.circuit import Circuit, Start, check_circuit, snapshot_of
from crescentlab.errors import InputError, nearest
from crescentlab.result import Result
from crescentlab.units import QUANTITIES, Quantity

Array = np.ndarray

METHODS = ("auto", "exact", "differences")
RTOL = 1e-7
"""Relative tolerance of the runs, unless another is asked for."""
CHECK_STEP, CHECK_RTOL = 3e-4, 1e-8
"""Relative step and tolerance of the two runs that the exact derivatives are compared with."""
AGREES = 0.02
"""They may differ by this share of the parameters' effects, and by ..."""
NOISE = 100.0
"""... this many tolerances of the outcome."""


@dataclass(frozen=True)
class Sensitivities:
    """Derivatives of outcomes (rows) by parameters (columns), SI.

    ``method`` and ``reason``, per parameter: how its column was made, and why so. ``error``: estimated errors of
    differences, and of exact derivatives NaN. ``relative``: a/y dy/da, NaN where y is zero.
    """

    outcomes: tuple[Outcome, ...]
    parameters: tuple[Parameter, ...]
    quantities: tuple[Quantity, ...]
    """Of the outcomes."""
    values: Array
    """Outcomes of the run, shape (outcomes,)."""
    derivative: Array
    error: Array
    method: tuple[str, ...]
    reason: tuple[str, ...]
    result: Result

    def __repr__(self) -> str:
        """What was differentiated by what."""
        outcomes = ", ".join(outcome.text for outcome in self.outcomes[:8])
        parameters = ", ".join(parameter.name for parameter in self.parameters[:8])
        shape = f"{len(self.outcomes)} outcomes by {len(self.parameters)} parameters"
        return f"<Sensitivities of {shape}: {outcomes}; {parameters}>"

    @property
    def relative(self) -> Array:
        """Logarithmic sensitivities: percent of the outcome per percent of the parameter."""
        sizes = np.array([parameter.value for parameter in self.parameters])
        with np.errstate(all="ignore"):
            shares = self.derivative * sizes / self.values[:, None]
        return np.where(self.values[:, None] != 0, shares, math.nan)


def sensitivities(
    circuit: Circuit, outcomes: Sequence[Outcome | str], parameters: Sequence[str],
    settings: Settings | None = None, *, stop: str | float | None = None, start: Start | None = None,
    window: tuple[Number | None, Number | None] = (None, None), method: str = "auto", solver: str = "rodas",
    rtol: float | None = None, compile: bool | None = None, check: bool = True,
) -> Sensitivities:  # fmt: skip
    """Derivatives of outcomes by parameters, named as for ``--set`` and varied about ``settings``.

    ``window`` [s]: the part of the run that outcomes are taken over. ``start``: a result to go on from; its states are
    then given and do not depend on the parameters. ``method``: ``exact`` raises where ``auto`` falls back to
    ``differences``. With ``check``, exact derivatives are compared with one difference along all parameters at once
    (two runs; one by one where they depend on each other); where these do not agree ``auto`` takes differences. Raises
    :class:`InputError` for names, words, whole numbers, and an amplitude whose frequency depends on a parameter,
    :class:`SimulationError` where a run fails.
    """
    check_circuit(circuit, "sensitivity")
    outcomes = _outcomes(outcomes)
    parameters = arguments.names(parameters, "parameters", "supply")
    _check(outcomes, parameters, method)
    given = arguments.settings(settings)
    window = (_instant(window[0]), _instant(window[1]))
    design = circuit.design(given)
    system = circuit.system(given)
    found = tuple(find(system, design, name) for name in parameters)
    reaching = Reaching(circuit.design, system, design, given)
    quantities = tuple(outcome.quantity(system, system.values(design), design) for outcome in outcomes)
    tight = RTOL if rtol is None else arguments.number(rtol, "rtol", "1e-8")
    options: dict[str, Any] = {"stop": stop, "solver": solver, "rtol": tight, "compile": compile, "start": start}
    runs = Runs(circuit, outcomes, given, options, window)
    work = _Work(runs, found, reaching, tight)
    result = runs.simulate()
    shown = Window(result, *window)
    check_tones(shown, outcomes, found, reaching)
    reasons: list[str | None]
    if start is None and circuit.netlist.sections.simulation.start is not None:
        if method == "exact":
            said = "--method exact: the run begins at the operating point, which moves with the parameters"
            raise InputError(f"{said}; write --method differences")
        reasons = ["the run begins at the operating point, which moves with it"] * len(found)
    elif method == "differences":
        reasons = ["asked for"] * len(found)
    else:
        reasons = work.exact(result, snapshot_of(start, result.system) if start is not None else None)
        if check and method == "auto":
            work.compare(reasons)
        if method == "exact" and any(reasons):
            k = next(k for k, reason in enumerate(reasons) if reason)
            raise InputError(f"{found[k].name}: no exact derivative, {reasons[k]}; --method differences takes others")
    work.differences([k for k, reason in enumerate(reasons) if reason], reasons)
    values = np.array([float(outcome.value(shown).value) for outcome in outcomes])
    return Sensitivities(
        tuple(outcomes), found, quantities, values, work.derivative, work.error, tuple(work.method),
        tuple(work.reason), result,
    )  # fmt: skip


def _outcomes(given: Any) -> list[Outcome]:
    """Outcomes, or their texts."""
    if isinstance(given, Outcome):
        return [given]
    mixed = [given] if isinstance(given, str) or not isinstance(given, Sequence) else given
    for each in mixed:
        if not isinstance(each, (str, Outcome)):
            raise InputError(f"outcomes: {each!r} is no outcome; write for example 'mean(delivery.p)'")
    return [Outcome(each, each) if isinstance(each, str) else each for each in mixed]


def _instant(given: Number | None) -> float | None:
    return None if given is None else arguments.quantity(given, "window", QUANTITIES["time"])


def _check(outcomes: Sequence[Outcome], parameters: Sequence[str], method: str) -> None:
    if method not in METHODS:
        raise InputError(f"--method {method}: {nearest(method, METHODS)}")
    if not outcomes:
        raise InputError("no outcome to differentiate; write for example --outcome 'mean(delivery.p)'")
    if not parameters:
        raise InputError("no parameter to differentiate by; write for example --parameter speed")
    for k, name in enumerate(parameters):
        if name in parameters[:k]:
            raise InputError(f"--parameter {name} is given twice; keep one")


class _Work:
    """The columns of one result, each made by one method."""

    def __init__(self, runs: Runs, parameters: Sequence[Parameter], reaching: Reaching, rtol: float) -> None:
        self.runs, self.parameters, self.reaching, self.rtol = runs, parameters, reaching, rtol
        shape = (len(runs.outcomes), len(parameters))
        self.derivative, self.error = np.zeros(shape), np.full(shape, math.nan)
        self.reaches: dict[int, Reach] = {}
        self.method = [""] * len(parameters)
        self.reason = [""] * len(parameters)

    # -- exact -----------------------------------------------------------------------------------

    def exact(self, result: Result, start: Any) -> list[str | None]:
        """Fill the columns that have an exact derivative; per parameter why it has none."""
        reasons: list[str | None] = [None] * len(self.parameters)
        reaches = self.reaches
        for k, parameter in enumerate(self.parameters):
            if self.reaching.shapes(parameter):
                reasons[k] = "it shapes the equations, which are made anew for each of its values"
                continue
            try:
                reaches[k] = self.reaching.reach(parameter)
            except NotDifferentiableError as error:
                reasons[k] = str(error)
        for k, reason in self.columns(result, start, reaches).items():
            reasons[k] = reason
        return reasons

    def columns(self, result: Result, start: Any, reaches: dict[int, Reach]) -> dict[int, str]:
        """The exact columns, all at once, and one by one if that is not possible; why those that failed did."""
        if not reaches:
            return {}
        try:
            made = self.along(result, start, reaches)
        except NotDifferentiableError as error:
            if len(reaches) == 1:
                return dict.fromkeys(reaches, str(error))
            alone = [self.columns(result, start, {k: reach}) for k, reach in reaches.items()]
            return {k: reason for each in alone for k, reason in each.items()}
        count = result.trajectory.statistics
        said = f"the run is smooth but for its events ({count.events}) and ticks ({count.ticks}), which are crossed"
        for k, column in made.items():
            self.derivative[:, k] = column
            self.method[k], self.reason[k] = "exact", said
        return {}

    def along(self, result: Result, start: Any, reaches: dict[int, Reach]) -> dict[int, list[float]]:
        values, fixed = result.values, start is not None
        dp, dx0, dh0 = (np.array([getattr(r, name) for r in reaches.values()]).T for name in ("p", "x0", "h0"))
        if fixed:
            dx0, dh0 = np.zeros_like(dx0), np.zeros_like(dh0)
        sizes = np.array([self.parameters[k].size for k in reaches])
        found = trajectory_sensitivity(
            result.system, values, result.trajectory, dp, dx0, dh0, sizes=sizes, start=start, rtol=self.rtol
        )
        window = refined(result, Window(result, *self.runs.window), self.runs.outcomes)
        moving = Moving(result, window, found)
        for outcome in self.runs.outcomes:
            outcome.value(window)  # now it knows what variables they need
        for outcome in self.runs.outcomes:
            present = tones(window, outcome, window.design) if "amplitude" in outcome.text else []
            for j, (k, reach) in enumerate(reaches.items() if present else ()):
                if moving.periods(outcome, reach, j, self.parameters[k].size) > STAYS:
                    raise refusal(outcome, self.parameters[k], window, present[0])
        return {
            k: moving.derivatives(self.runs.outcomes, reach, j, self.parameters[k].size)
            for j, (k, reach) in enumerate(reaches.items())
        }  # fmt: skip

    def compare(self, reasons: list[str | None]) -> None:
        """Compare the exact columns with differences along their parameters, as many at once as possible."""
        exact = [k for k, reason in enumerate(reasons) if not reason]
        sides = {k: self.reaching.sides(p, CHECK_STEP * p.size) for k in exact for p in [self.parameters[k]]}
        runs = self.tight(CHECK_RTOL)
        for side, (high, low) in {"central": (1.0, -1.0), "forward": (1.0, 0.0), "backward": (0.0, -1.0)}.items():
            among = [k for k in exact if sides[k] == side]
            for places in [among] if self.adds_up(among, high, low) else [[k] for k in among]:
                if places:
                    up, down = runs.all([self.moved(places, high), self.moved(places, low)], parallel=False)
                    steps = [(high - low) * CHECK_STEP * self.parameters[k].size for k in places]
                    self.agree(places, up, down, self.derivative[:, places] * steps, reasons)

    def adds_up(self, places: list[int], high: float, low: float) -> bool:
        """Whether the parameters move the system's numbers together as each of them alone.

        They do not where one is an expression of another, which loses its effect once a value is given.
        """
        try:
            up, down = (self.numbers(self.moved(places, sign)) for sign in (high, low))
        except InputError:
            return False
        steps = [(high - low) * CHECK_STEP * self.parameters[k].size for k in places]
        reaches = [self.reaches[k] for k in places]
        each = [np.concatenate([r.p, r.x0, r.h0]) * h for h, r in zip(steps, reaches, strict=True)]
        size = np.abs(each).sum(axis=0)
        return bool(np.all(np.abs(up - down - np.sum(each, axis=0)) <= AGREES * size + 1e-12 * np.abs(up)))

    def numbers(self, more: Mapping[str, str]) -> Array:
        """The system's parameters and start values with other texts."""
        values = self.reaching.system.values(self.reaching.with_settings(more))
        return np.concatenate([values.p, values.x0, values.h0])

    def moved(self, places: list[int], sign: float) -> dict[str, str]:
        """Texts of parameters moved a little."""
        chosen = [self.parameters[k] for k in places]
        return {p.name: p.text(p.value + sign * CHECK_STEP * p.size) for p in chosen}

    def agree(self, places: list[int], up: Array, down: Array, effects: Array, reasons: list[str | None]) -> None:
        """Say how well a difference agrees with the parameters' effects (outcomes, places), or that it does not."""
        along = "it" if len(places) == 1 else f"{len(places)} parameters"
        seen, expected, size = up - down, effects.sum(axis=1), np.abs(effects).sum(axis=1)
        allowed = AGREES * size + NOISE * min(self.rtol, CHECK_RTOL) * (np.abs(up) + np.abs(down))
        for row, name in enumerate(outcome.name for outcome in self.runs.outcomes):
            if not abs(seen[row] - expected[row]) <= allowed[row]:
                said = f"a difference of {name} along {along} gives {seen[row]:.6g}"
                for k in places:
                    reasons[k] = f"{said}, the exact derivatives {expected[row]:.6g}"
        apart = float(np.max(np.abs(seen - expected)[size > 0] / size[size > 0], initial=0.0))
        for k in places:
            self.reason[k] += f"; a difference along {along} agrees to {apart:.1g}"

    def tight(self, rtol: float) -> Runs:
        """The same runs, at least as tight as ``rtol``."""
        return replace(self.runs, options={**self.runs.options, "rtol": min(self.rtol, rtol)})

    # -- differences -----------------------------------------------------------------------------

    def differences(self, places: list[int], reasons: list[str | None]) -> None:
        """Fill the columns at these places."""
        if not places:
            return
        chosen = [self.parameters[k] for k in places]
        derivative, error, said = differences(self.tight(LOOSEST), chosen, self.reaching, min(self.rtol, LOOSEST))
        for column, k in enumerate(places):
            self.derivative[:, k], self.error[:, k] = derivative[:, column], error[:, column]
            self.method[k], self.reason[k] = said[column], str(reasons[k])


def in_units(value: float, outcome: Quantity, parameter: Quantity, units: tuple[str, str]) -> float:
    """A derivative [SI] in the display units of outcome and parameter."""
    return value / _factor(outcome, units[0]) * _factor(parameter, units[1])


def _factor(quantity: Quantity, unit: str) -> float:
    return quantity.factor(unit) if quantity.name in QUANTITIES else 1.0
