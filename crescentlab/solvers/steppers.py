"""The stepper of SciPy or SUNDIALS that a solver's name means."""

from __future__ import annotations

import numpy as np

from crescentlab.solvers import scipy
from crescentlab.solvers.functions import Functions


def stepper(name: str, functions: Functions, rtol: float, atol: np.ndarray) -> scipy.Stepper:
    """The stepper that ``--solver NAME`` means for this system."""
    if functions.n == 0:
        return scipy.Stateless("rk45", functions, rtol, atol, "dense")
    method, layout = scipy.choose(name, functions)
    if method == "cvode":
        from crescentlab.solvers.sundials import Cvode  # who does not ask for it does not wait for it

        return Cvode(functions, rtol, atol, layout)
    kind = scipy.Lsoda if method == "lsoda" else scipy.Stepper
    return kind(method, functions, rtol, atol, layout)
