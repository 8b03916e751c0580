"""CVODE of SUNDIALS as a stepper: BDF of orders 1 to 5 with Newton's method and the exact Jacobian.

scikit-sundae binds it and passes the bound of every step on as CVODE's stop time, so that a run goes on past a bound
without being initialised anew. Asked for a time inside its last step CVODE answers from its history array without
stepping; that gives the interpolant.

Source: Hindmarsh et al. (2005), SUNDIALS, ACM Trans. Math. Softw. 31, 363-396; the steps are those of Brown, Byrne
and Hindmarsh (1989), VODE, SIAM J. Sci. Stat. Comput. 10, 1038-1051.
"""

from __future__ import annotations

import os
import sys
import threading
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

from crescentlab.errors import SimulationError
from crescentlab.solvers.functions import Functions
from crescentlab.solvers.scipy import Path, Stepper

os.environ.setdefault("SUNLOGGER_WARNING_FILENAME", os.devnull)  # else CVODE's warnings go to stdout
_THREADS = os.environ.get("OMP_NUM_THREADS")
os.environ["OMP_NUM_THREADS"] = "1"  # read while the library loads: idle threads of its sparse solver cost tenfold
try:
    from sksundae.cvode import CVODE
finally:
    if _THREADS is None:
        del os.environ["OMP_NUM_THREADS"]
    else:
        os.environ["OMP_NUM_THREADS"] = _THREADS

DEGREE = 5
"""Highest order of the method, hence degree of the interpolant."""
PLACES = (np.cos(np.pi * np.arange(1, DEGREE + 1) / DEGREE) - 1) / 2
"""Where the interpolant is read, in lengths of the step from its end: Chebyshev points, the last is -1."""
POWERS = np.arange(1, DEGREE + 1)
TO_COEFFICIENTS = np.linalg.inv(PLACES[:, None] ** POWERS)
"""From differences to the end of the step at PLACES to coefficients of their powers."""
SHORT = 1e6 * np.finfo(float).eps
"""A step shorter than this share of the time is not read inside: times there would be mostly rounding."""
GROWTH = 10.1
"""CVODE makes a step at most ten times as long as the last one, but for the second after a start."""
GRAIN = 4 * np.finfo(float).eps
"""CVODE begins no step shorter than about this share of the time."""


class Cvode(Stepper):
    """CVODE with a dense, banded or sparse matrix."""

    def __init__(self, functions: Functions, rtol: float, atol: np.ndarray, layout: str) -> None:
        super().__init__("cvode", functions, rtol, atol, layout)
        n = functions.n
        options: dict[str, Any] = {"jacfn": self.fill, "linsolver": "band" if layout == "banded" else layout}
        if layout == "sparse":
            options["sparsity"] = self.structure
            self.spots = np.arange(self.structure.nnz)
        else:
            self.spots = self.rows * n + self.columns
        if layout == "banded":
            options |= {"lband": self.lower, "uband": self.upper}
        with warnings.catch_warnings():  # it tells that the pattern serves no differences beside an exact Jacobian
            warnings.simplefilter("ignore")
            self.cvode = CVODE(self.put_rhs, method="BDF", rtol=self.rtol, atol=self.atol, **options)
        self.at, self.y = 0.0, np.zeros(n)
        self.far = 0.0
        """The end of the run: what the first step is chosen for."""
        self.h = 0.0
        self.count = 0
        """Steps since the start."""
        self.reach = np.inf
        """The next step is no longer than this."""
        self.coefficients = np.zeros((DEGREE, n))
        self.slope: np.ndarray | None = None
        self.nonzeros = functions.nonzeros
        if layout == "sparse":
            self.prime()

    def prime(self) -> None:
        """Take a step of y' = 0: SuperLU_MT crashes when it is freed before it has factorised anything."""
        rhs, nonzeros, n = self.rhs, self.nonzeros, self.functions.n
        self.rhs, self.nonzeros = (lambda t, y: np.zeros(n)), (lambda t, x: np.zeros(self.spots.size))
        self.cvode.init_step(0.0, np.zeros(n))
        self.cvode.step(1.0, "onestep")
        self.rhs, self.nonzeros = rhs, nonzeros

    def put_rhs(self, t: float, y: np.ndarray, der: np.ndarray) -> None:
        """f(t, y) into ``der``."""
        der[:] = self.rhs(t, y)

    def fill(self, t: float, y: np.ndarray, der: np.ndarray, matrix: np.ndarray) -> None:
        """The nonzeros of the Jacobian into ``matrix``: full, also where it is banded, or the nonzeros themselves."""
        matrix.reshape(-1)[self.spots] = self.nonzeros(t, self.outer(y))

    def restart(self, t: float, x: np.ndarray, bound: float) -> None:
        self.far = bound
        self.begin(t, self.inner(x))

    def begin(self, t: float, y: np.ndarray) -> None:
        self.at, self.y, self.count, self.reach = t, y, 0, np.inf
        self.cvode.init_step(t, y)

    @property
    def t(self) -> float:
        return self.at

    @property
    def x(self) -> np.ndarray:
        return self.outer(self.y)

    def step(self, bound: float) -> None:
        low, y_low = self.at, self.y
        beyond = False
        if not self.count and bound - low <= GRAIN * abs(bound):
            self.begin(bound, y_low + (bound - low) * self.rhs(low, y_low))
        else:
            beyond = self.go(bound)
        size = self.at - low
        self.read(size, y_low)
        if beyond:
            self.begin(self.at, self.y)
        elif self.slope is not None:
            self.cvode.step(self.at, "normal", self.at)  # back to the end, where the next step begins
        if self.at < bound or self.step_size is None or size > self.step_size:
            self.step_size = size

    def go(self, bound: float) -> bool:
        """One step of CVODE; whether it went beyond the bound after all, where it must begin anew.

        A stop time also cuts the step after the one it is set for, so it is set only if this one may come so far: else
        a bound that moves along would have every other step cut.
        """
        stop = bound if self.at + self.reach >= bound else None
        with _SILENCE:
            result = self.cvode.step(max(bound, self.far), "onestep", stop)
        if not result.success:
            raise SimulationError(result.message.rstrip("."))
        low, self.at, self.y, self.count = self.at, float(result.t), result.y, self.count + 1
        if self.at > bound:
            self.at, self.y = bound, self.cvode.step(bound, "normal").y
            return True
        size = self.at - low
        grown = GROWTH * size if self.count > 1 else np.inf
        if stop is not None and self.at < stop:
            self.reach = min(grown, 1.01 * (stop - self.at))
        else:  # a stop that lay within rounding is met without a step, which says nothing of the next
            self.reach = grown if size > SHORT * (abs(self.at) + self.h) else max(self.reach, grown)
        return False

    def read(self, size: float, y_low: np.ndarray) -> None:
        """Copy the interpolant out; a very short step is a straight line."""
        short = size <= SHORT * (abs(self.at) + self.h)
        self.h = size
        change = np.empty((DEGREE, self.y.size))
        change[-1] = y_low - self.y
        if short or not self.count:
            self.coefficients = np.zeros_like(change)
            self.coefficients[0] = -change[-1]
            self.slope = None
            return
        for k, place in enumerate(PLACES[:-1].tolist()):
            change[k] = self.cvode.step(self.at + place * size, "normal").y
        change[:-1] -= self.y
        self.coefficients = TO_COEFFICIENTS @ change
        self.slope = self.coefficients[0] / size

    def refresh(self, rate: np.ndarray) -> None:
        """CVODE keeps no f that a next step would begin with."""

    def rate(self) -> np.ndarray:
        if self.slope is not None:
            return self.outer(self.slope)
        return self.functions.f(self.t, self.x, self.functions.h, self.functions.b)[0]

    def path(self) -> Path:
        return _Polynomial(self.at, self.h, self.y, self.coefficients, self.place)

    def interpolant(self) -> Callable[[float], np.ndarray]:
        path = self.path()
        return lambda t: path(np.array([t]))[0]


class _Polynomial:
    """y(t) = y_n + sum over k of c_k ((t - t_n)/h)^k, the interpolant of one step."""

    __slots__ = ("back", "coefficients", "end", "h", "t")

    def __init__(self, t: float, h: float, end: np.ndarray, coefficients: np.ndarray, back: np.ndarray | None) -> None:
        self.t, self.h, self.end, self.coefficients, self.back = t, h, end, coefficients, back

    def __call__(self, times: np.ndarray) -> np.ndarray:
        states: np.ndarray = self.end + (((times - self.t) / self.h)[:, None] ** POWERS) @ self.coefficients
        return states if self.back is None else states[:, self.back]


class _Silence:
    """Keeps CVODE's own messages off stdout, where the binding prints them; a failure is told as an error.

    Other threads print as before, and wait with steps of their own.
    """

    def __init__(self) -> None:
        self.lock = threading.RLock()
        self.owner: int | None = None
        self.stdout: Any = None

    def __enter__(self) -> None:
        self.lock.acquire()
        self.owner, self.stdout = threading.get_ident(), sys.stdout
        sys.stdout = self

    def __exit__(self, *_: object) -> None:
        sys.stdout = self.stdout
        self.lock.release()

    def write(self, text: str) -> int:
        """Drop what this thread prints, pass on what others print."""
        return len(text) if threading.get_ident() == self.owner else self.stdout.write(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.stdout, name)


_SILENCE = _Silence()
