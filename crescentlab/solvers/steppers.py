"""The stepper of SciPy or SUNDIALS that a solver's name means."""

from __future__ import annotations

import numpy as np

from crescentlab.solvers import scipy
from crescentlab.solvers.functions import Functions
from crescentlab.solvers.settling import LARGEST, Settling

IMPLICIT = ("lsoda", "bdf", "radau", "cvode")


def stepper(name: str, functions: Functions, rtol: float, atol: np.ndarray) -> scipy.Stepper:
    """The stepper that ``--solver NAME`` means for this system."""
    if functions.n == 0:
        return scipy.Stateless("rk45", functions, rtol, atol, "dense")
    method, layout = scipy.choose(name, functions)
    if method == "cvode":
        from crescentlab.solvers.sundials import Cvode  # who does not ask for it does not wait for it

        made: scipy.Stepper = Cvode(functions, rtol, atol, layout)
    else:
        kind = scipy.Lsoda if method == "lsoda" else scipy.Stepper
        made = kind(method, functions, rtol, atol, layout)
    settles = method in IMPLICIT and functions.n <= LARGEST
    return Settling(made, functions, rtol, atol) if settles else made
