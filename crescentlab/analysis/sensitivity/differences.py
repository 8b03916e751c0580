"""Derivatives of outcomes by finite differences: runs with other values of a parameter, several at once."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np

from crescentlab.analysis.outcome import Outcome, Window
from crescentlab.analysis.reach import Parameter, Reaching
from crescentlab.analysis.sensitivity.extremes import refined
from crescentlab.arguments import Settings
from crescentlab.circuit import Circuit
from crescentlab.errors import InputError, SimulationError
from crescentlab.result import Result

Array = np.ndarray

LOOSEST = 1e-9
"""Differences run at least as tight: the noise of a run is divided by the step."""
COMPILED_LOOP = ("rodas", "dopri")
"""Solvers that let other threads run."""


@dataclass(frozen=True)
class Runs:
    """How the runs of a sensitivity are made: everything but the parameters."""

    circuit: Circuit
    outcomes: Sequence[Outcome]
    settings: Settings
    options: Mapping[str, Any]
    """Arguments of :meth:`Circuit.simulate`: stop, solver, rtol, compile, start."""
    window: tuple[float | None, float | None]

    def simulate(self, more: Mapping[str, str] | None = None) -> Result:
        """One run; ``more`` are texts of parameters."""
        try:
            return self.circuit.simulate(parameters={**self.settings, **(more or {})}, **self.options)
        except SimulationError as error:
            raise SimulationError(f"with {_said(more)}: {error}" if more else str(error)) from None

    def values(self, result: Result) -> Array:
        """The outcomes of a run, extremes where they are and not at the nearest node: noise there would be divided."""
        window = refined(result, Window(result, *self.window), self.outcomes)
        return np.array([float(outcome.value(window).value) for outcome in self.outcomes])

    def all(self, several: Iterable[Mapping[str, str]], parallel: bool) -> list[Array]:
        """Outcomes of several runs, in order; ``parallel``: they may run side by side."""

        def work(more: Mapping[str, str]) -> Array:
            result = self.simulate(more)
            try:
                return self.values(result)
            except InputError as error:
                raise InputError(f"with {_said(more)}: {error.message}", error.place) from None

        if not parallel:
            return [work(more) for more in several]
        with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
            return list(pool.map(work, several))


def _said(more: Mapping[str, str]) -> str:
    return ", ".join(f"{name} = {text}" for name, text in more.items())


def differences(
    runs: Runs, parameters: Sequence[Parameter], reaching: Reaching, rtol: float
) -> tuple[Array, Array, list[str]]:
    """Derivatives (outcomes, parameters), their estimated errors, and per parameter how they were made.

    Central differences with the steps h and h/2 and Richardson's extrapolation, h = rtol^(1/3) of the parameter, where
    truncation (h^4) and the runs' noise (rtol / h) are both small; one-sided, of second order, where the parameter may
    not have values on one side. The estimated error is what the extrapolation changed, and the noise.
    """
    share = rtol ** (1 / 3)
    at: list[tuple[str, float, str]] = []
    jobs: list[dict[str, str]] = [{}]
    shaping = False
    for parameter in parameters:
        step = share * parameter.size
        side = reaching.sides(parameter, step)
        shaping = shaping or reaching.shapes(parameter)
        at.append((side, step, parameter.name))
        places = (1.0, 0.5, -0.5, -1.0) if side == "central" else (1.0, 0.5, 0.25)
        sign = -1.0 if side == "backward" else 1.0
        jobs += [{parameter.name: parameter.text(parameter.value + sign * place * step)} for place in places]
    first = runs.simulate(jobs[0])
    parallel = not shaping and any(name in first.trajectory.solver for name in COMPILED_LOOP)
    found = [runs.values(first), *runs.all(jobs[1:], parallel)]
    base, rest = found[0], iter(found[1:])
    columns, errors, said = [], [], []
    for (side, step, _), parameter in zip(at, parameters, strict=True):
        if side == "central":
            up, half_up, half_down, down = (next(rest) for _ in range(4))
            rough, fine = (up - down) / (2 * step), (half_up - half_down) / step
            best = fine + (fine - rough) / 3
        else:
            sign = -1.0 if side == "backward" else 1.0
            whole, half, quarter = (next(rest) for _ in range(3))
            rough = sign * (-3 * base + 4 * half - whole) / step
            fine = sign * (-3 * base + 4 * quarter - half) / (step / 2)
            best = fine + (fine - rough) / 3
        columns.append(best)
        errors.append(np.abs(best - fine) + rtol * np.abs(base) / step)
        shown = parameter.quantity.show(step, digits=3)
        said.append(f"{side} differences, step {shown}")
    return np.array(columns).T, np.array(errors).T, said
