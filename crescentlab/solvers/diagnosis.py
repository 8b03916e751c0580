"""Says in the circuit's words what a run failed on."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from crescentlab.errors import SimulationError
from crescentlab.solvers.functions import Functions
from crescentlab.solvers.limits import PressureLimits
from crescentlab.solvers.options import TIGHT

IMPLICIT = ("rodas", "radau", "lsoda")
"""Implicit methods, the first to try first; where the tolerance is tight, rodas comes last."""


def other_solver(solver: str, rtol: float) -> str:
    """An implicit method other than ``solver``, fit for the tolerance."""
    order = IMPLICIT if rtol >= TIGHT else (*IMPLICIT[1:], IMPLICIT[0])
    return next(name for name in order if name != solver)


class Diagnosis:
    """Names the state behind what is not finite, or behind steps that grow too short."""

    def __init__(
        self, functions: Functions, limits: PressureLimits, rtol: float, atol: np.ndarray, solver: str
    ) -> None:
        self.functions, self.limits = functions, limits
        self.rtol, self.atol, self.solver = rtol, atol, solver
        self.system = functions.system

    def check_finite(self, t: float, x: np.ndarray, values: np.ndarray, when: str = "") -> None:
        """Raise if ``values`` (x itself, or its rates) are not all finite numbers."""
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            name = self.system.state_names[int(bad[0])]
            what = "is no longer a finite number" if values is x else "has a rate that is not a finite number"
            advice = f"look at the parameters of {name.rpartition('.')[0]} and at the start values"
            raise SimulationError(
                f"{name} {what} {when + ' ' if when else ''}(t = {t:.6g} s); {self.beyond(t, x) or advice}"
            )

    def check_held(self, t: float, h: np.ndarray, names: list[str]) -> None:
        """Raise if the events ``names`` left a held value that is not a finite number."""
        wrong = np.flatnonzero(~np.isfinite(h))
        if wrong.size:
            name = self.system.held_names[int(wrong[0])]
            raise SimulationError(
                f"{name} was set to what is not a finite number by {', '.join(names)} (t = {t:.6g} s)"
            )

    def beyond(self, t: float, x: np.ndarray) -> str | None:
        """A pressure for which its fluid's law is not meant, and the way out that is missing; or None."""
        return self.limits.beyond(t, x, self.functions.h, self.functions.b)

    def blame(self, t: float, x: np.ndarray) -> str:
        """What keeps steps from being long enough.

        A pressure that has left its fluid's law behind; else the state whose rate changes fastest against its
        tolerance, and what may help: never the solver in use.
        """
        if beyond := self.beyond(t, x):
            return beyond
        f = self.functions.rhs(t, x)
        pattern = self.functions.pattern
        matrix = sparse.csc_matrix(
            (self.functions.nonzeros(t, x), pattern.indices, pattern.indptr), shape=pattern.shape
        )
        change = np.abs(matrix @ f) / (self.atol + self.rtol * np.abs(x))
        if not np.isfinite(change).all():  # it has grown beyond all bounds: the largest state is to blame
            change = np.abs(x) / self.system.nominal
        name = self.system.state_names[int(np.argmax(change))]
        other = other_solver(self.solver, self.rtol)
        return f"{name} limits it; try --solver {other}, a larger volume or mass there, or smoother signals"
