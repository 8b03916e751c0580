"""System -> Trajectory: one event loop over the steppers of SciPy and SUNDIALS; the stepper that a name means."""

from __future__ import annotations

import numpy as np

from crescentlab.solvers import scipy


def stepper(name: str, functions: scipy.Functions, rtol: float, atol: np.ndarray) -> scipy.Stepper:
    """The stepper that ``--solver NAME`` means for this system."""
    if functions.n == 0:
        return scipy.Stateless("rk45", functions, rtol, atol, "dense")
    method, layout = scipy.choose(name, functions)
    if method == "cvode":
        from crescentlab.solvers.sundials import Cvode  # who does not ask for it does not wait for it

        return Cvode(functions, rtol, atol, layout)
    kind = scipy.Lsoda if method == "lsoda" else scipy.Stepper
    return kind(method, functions, rtol, atol, layout)
