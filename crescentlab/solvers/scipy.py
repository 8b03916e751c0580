"""SciPy's steppers behind one interface: step up to a bound, interpolate, restart.

LSODA keeps a critical time of its own (``rwork[0]``) that must move with the bound; that private
detail lives in :class:`Lsoda` and nowhere else.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy import integrate, sparse
from scipy.sparse.csgraph import reverse_cuthill_mckee

from crescentlab.errors import InputError, SimulationError
from crescentlab.solvers.functions import Functions
from crescentlab.solvers.options import TOLERANCE_SHARE

SMALL = 25
"""Up to this many states LSODA with a full matrix is quickest (benchmarks/thresholds.py)."""
BAND_SHARE = 0.5
"""A reordered matrix whose band is at most this share of n, and ...."""
BAND_LIMIT = 100
"""... at most this wide, is integrated as banded."""
WIDE = 120
"""Beyond this many states of wide band, BDF with the sparse Jacobian overtakes LSODA with a full matrix."""
CVODE_SMALL = 60
"""Up to this many states CVODE with a full matrix is about as quick as with any other ...."""
CVODE_BAND = 50
"""... and beyond it a wider band than this costs more than the sparse matrix."""

LARGEST_FULL = 3000
"""A full matrix of more rows takes over 70 MB and a second to factorise."""

MOST_STIFF = {"rk45": 2.2, "dop853": 4.0}
"""Largest h |lambda| of the explicit methods. Up to 3.3 and 6.1 they are stable, but there what is fast is damped no
more: its error stays, at some ten tolerances, and what is slow adds it up; DOP853's interpolant shows it twentyfold
between the steps. At these limits a step shrinks it to a fifth or less, and between steps a tenth of it is seen."""
DEFECT_AT = (0.25, 0.75)
"""Where in a step the interpolant is held against f."""
MOST_DEFECT = 10.0
"""Largest defect of an interpolant times the step, in tolerances: its error is some fifth of it."""
DEFECT_GRAIN = 1e-12
"""Steps shorter than this share of the time are rounding."""
UNMOVED = 1e-6
"""Share of the tolerance: states that differ by less say nothing about f."""

METHODS: dict[str, Any] = {
    "bdf": integrate.BDF, "radau": integrate.Radau, "rk45": integrate.RK45, "dop853": integrate.DOP853,
    "lsoda": integrate.LSODA,
}  # fmt: skip


Path = Callable[[np.ndarray], np.ndarray]
"""States at times, shape (times, n)."""


class Stepper:
    """One SciPy solver that can be restarted and sent past its bound."""

    def __init__(self, name: str, functions: Functions, rtol: float, atol: np.ndarray, layout: str) -> None:
        self.name, self.functions = name, functions
        share = TOLERANCE_SHARE.get(name, 1.0)
        self.rtol, self.atol = max(share * rtol, 100 * np.finfo(float).eps), share * atol
        self.order: np.ndarray | None = None
        self.place: np.ndarray | None = None
        """Where each state stands in the order that narrows the band."""
        self.solver: Any = None
        self.options: dict[str, Any] = {}
        self.rhs: Callable[[float, np.ndarray], np.ndarray] = functions.rhs
        self.step_size: float | None = None
        self.dense_output: Any = None
        self.fastest = 0.0
        """|lambda| [1/s] of what is fastest, as the last step of an explicit method saw it."""
        if name in ("bdf", "radau", "lsoda") and functions.n:
            self.options["jac"] = {"sparse": self.sparse, "dense": self.dense, "banded": self.banded}[layout]
        if layout != "sparse" and functions.n:
            pattern = functions.pattern
            self.rows: np.ndarray = np.asarray(pattern.indices)
            self.columns = np.repeat(np.arange(functions.n), np.diff(pattern.indptr))
        else:
            self.structure = functions.pattern
        if layout == "banded":
            self.set_band(functions.pattern)

    def set_band(self, pattern: sparse.csc_matrix) -> None:
        order, lower, upper = banded(pattern)
        self.order, self.lower, self.upper = order, lower, upper
        back = self.place = np.argsort(order)
        self.rows, self.columns = back[self.rows], back[self.columns]
        f = self.functions.rhs
        self.rhs = lambda t, y: f(t, y[back])[order]
        self.atol = self.atol[order]
        self.options.update(lband=lower, uband=upper)

    def inner(self, x: np.ndarray) -> np.ndarray:
        return x if self.order is None else x[self.order]

    def outer(self, y: np.ndarray) -> np.ndarray:
        if self.order is None:
            return y
        x = np.empty_like(y)
        x[self.order] = y
        return x

    def dense(self, t: float, x: np.ndarray) -> np.ndarray:
        matrix = np.zeros((self.functions.n, self.functions.n))
        matrix[self.rows, self.columns] = self.functions.nonzeros(t, x)
        return matrix

    def banded(self, t: float, y: np.ndarray) -> np.ndarray:
        packed = np.zeros((self.lower + self.upper + 1, self.functions.n))
        packed[self.rows - self.columns + self.upper, self.columns] = self.functions.nonzeros(t, self.outer(y))
        return packed

    def sparse(self, t: float, x: np.ndarray) -> sparse.csc_matrix:
        s = self.structure
        return sparse.csc_matrix((self.functions.nonzeros(t, x).copy(), s.indices, s.indptr), shape=s.shape)

    def restart(self, t: float, x: np.ndarray, bound: float) -> None:
        """Begin anew at (t, x). One-step methods keep their step size."""
        options = dict(self.options)
        if self.step_size and self.name in ("rk45", "dop853", "radau"):
            options["first_step"] = min(self.step_size, bound - t)
        self.solver = METHODS[self.name](self.rhs, t, self.inner(x), bound, rtol=self.rtol, atol=self.atol, **options)

    @property
    def t(self) -> float:
        return float(self.solver.t)

    @property
    def x(self) -> np.ndarray:
        return self.outer(self.solver.y)

    def step(self, bound: float) -> None:
        """One accepted step, not past ``bound``; raises :class:`SimulationError` if none is found."""
        solver = self.solver
        solver.t_bound = bound
        before = solver.t, solver.y, getattr(solver, "f", None)
        while True:
            solver.status = "running"
            self.set_bound(bound)
            try:
                message = solver.step()
            except (ValueError, RuntimeError) as error:  # a matrix that is not finite, or singular
                raise SimulationError(str(error)) from None
            if solver.status == "failed":
                raise SimulationError(str(message))
            self.dense_output = None
            shorter = self.shown_between() if self.name == "dop853" else 1.0
            if shorter >= 1.0:
                break
            solver.t, solver.y, solver.f = before
            solver.h_abs = shorter * solver.h_previous
        # a step cut short by the bound says nothing about the step the error would allow
        if solver.t < bound or self.step_size is None or solver.t - before[0] > self.step_size:
            self.step_size = solver.t - before[0]
        if self.name in MOST_STIFF:
            self.stay_stable()

    def interpolated(self) -> Any:
        """SciPy's interpolant of the last step, made once."""
        if self.dense_output is None:
            self.dense_output = self.solver.dense_output()
        return self.dense_output

    def shown_between(self) -> float:
        """What to shorten the last step of DOP853 by because of its interpolant, 1 if it is good enough.

        A step's error is that of its end. Steps of order 8 are so long that a corner within one, as the laminar end of
        an orifice's flow, can leave the end in order and the interpolant off by a thousand tolerances; and it is what a
        result shows, and where events are looked for. Its defect, dx/dt of the interpolant less f there, tells.
        Source: Enright, J. Comp. Appl. Math. 125 (2000) 159-170.
        """
        solver, rhs = self.solver, self.rhs
        h = solver.t - solver.t_old
        if h <= DEFECT_GRAIN * abs(solver.t):
            return 1.0
        path, scale, most = self.interpolated(), self.atol + self.rtol * np.abs(solver.y), 0.0
        for place in DEFECT_AT:
            value, slope = np.zeros_like(solver.y), np.zeros_like(solver.y)
            for k, row in enumerate(reversed(path.F)):
                value = value + row
                slope, value = (
                    (slope * place + value, value * place) if k % 2 == 0
                    else (slope * (1 - place) - value, value * (1 - place))
                )  # fmt: skip
            defect = (slope - h * rhs(solver.t_old + place * h, path.y_old + value)) / scale
            most = max(most, float(np.sqrt(np.mean(defect * defect))))
        if most <= MOST_DEFECT:
            return 1.0
        return min(max((MOST_DEFECT / most) ** (1 / 7), 0.3), 0.9) if math.isfinite(most) else 0.3

    def stay_stable(self) -> None:
        """Keep the next step of an explicit method well inside its region of stability.

        |lambda| of what is fastest among what the step disturbs is |f(x_1) - f(x_0)|/|x_1 - x_0|, in shares of the
        tolerance, with x_1 the end of the step and x_0 what the last stage takes it for (Hairer & Wanner, Solving
        Ordinary Differential Equations II, 1996, section IV.2); of two steps the smaller one, as the phase of an
        oscillation can make one much larger than its frequency.
        """
        solver, last = self.solver, self.solver.n_stages - 1
        stage = solver.y_old + solver.h_previous * (solver.K[:last].T @ solver.A[last, :last])
        scale = self.atol + self.rtol * np.abs(solver.y)
        moved, changed = (solver.y - stage) / scale, (solver.K[last + 1] - solver.K[last]) / scale
        size = float(np.linalg.norm(moved))
        rate = float(np.linalg.norm(changed)) / size if size > UNMOVED * math.sqrt(moved.size) else 0.0
        if stiff := min(rate, self.fastest):
            solver.h_abs = min(solver.h_abs, MOST_STIFF[self.name] / stiff)
        self.fastest = rate

    def refresh(self, rate: np.ndarray) -> None:
        """Take f at the end of the last step anew, after a change too small for a restart."""
        if hasattr(self.solver, "f"):  # the one-step methods begin their next step with it
            self.solver.f = self.inner(rate)

    def set_bound(self, bound: float) -> None:
        """Tell the solver's private parts about the bound."""

    def rate(self) -> np.ndarray:
        """dx/dt at the end of the last step."""
        if hasattr(self.solver, "f"):
            return self.outer(self.solver.f)
        return self.functions.f(self.t, self.x, self.functions.h, self.functions.b)[0]

    def path(self) -> Path:
        """The states within the last step, as a function to be sampled after the run."""
        dense, back = self.interpolated(), self.place
        return lambda times: dense(times).T if back is None else dense(times).T[:, back]

    def interpolant(self) -> Callable[[float], np.ndarray]:
        """x(t) within the last step."""
        dense = self.interpolated()
        return dense if self.order is None else (lambda t: self.outer(dense(t)))


class Lsoda(Stepper):
    """LSODA's critical time follows the bound, so a continued run never overshoots it."""

    def restart(self, t: float, x: np.ndarray, bound: float) -> None:
        super().restart(t, x, bound)
        self.work = self.solver._lsoda_solver._integrator.rwork

    def set_bound(self, bound: float) -> None:
        self.work[0] = bound

    def rate(self) -> np.ndarray:
        # second column of the Nordsieck array: h dx/dt, known without a call of f
        work, n = self.work, self.functions.n
        return self.outer(work[20 + n : 20 + 2 * n] / work[11])

    def path(self) -> Path:
        # a copy of the Nordsieck array costs a tenth of a dense_output object
        integrator, n = self.solver._lsoda_solver._integrator, self.functions.n
        work, order = integrator.rwork, int(integrator.iwork[13])
        scale = (work[11] / work[10]) ** order if integrator.iwork[14] < order else 1.0
        return _Nordsieck(self.solver.t, work[11], work[20 : 20 + (order + 1) * n].copy(), n, scale, self.place)


class _Nordsieck:
    """x(t) = sum over k of y_k ((t - t_n)/h)^k, the polynomial of one LSODA step."""

    __slots__ = ("back", "h", "history", "n", "scale", "t")

    def __init__(self, t: float, h: float, history: np.ndarray, n: int, scale: float, back: np.ndarray | None) -> None:
        self.t, self.h, self.history, self.n, self.scale, self.back = t, h, history, n, scale, back

    def __call__(self, times: np.ndarray) -> np.ndarray:
        rows = self.history.reshape(-1, self.n)
        powers = ((times - self.t) / self.h)[:, None] ** np.arange(len(rows))
        powers[:, -1] *= self.scale  # the last row is scaled for the next step where the order falls
        states: np.ndarray = powers @ rows
        return states if self.back is None else states[:, self.back]


class Stateless(Stepper):
    """A circuit without states: every step reaches the bound."""

    def restart(self, t: float, x: np.ndarray, bound: float) -> None:
        self.at, self.state = t, x

    @property
    def t(self) -> float:
        return self.at

    @property
    def x(self) -> np.ndarray:
        return self.state

    def step(self, bound: float) -> None:
        self.step_size = bound - self.at
        self.at = bound

    def path(self) -> Path:
        state = self.state
        return lambda times: np.tile(state, (times.size, 1))

    def interpolant(self) -> Callable[[float], np.ndarray]:
        return lambda _: self.state


def banded(pattern: sparse.csc_matrix) -> tuple[np.ndarray, int, int]:
    """Order of states that narrows the band (reverse Cuthill-McKee), and its lower and upper width."""
    order = np.asarray(reverse_cuthill_mckee(sparse.csr_matrix(pattern + pattern.T), symmetric_mode=True))
    place = np.argsort(order)
    coo = pattern.tocoo()
    distance = place[coo.row] - place[coo.col]
    return order, int(max(distance.max(initial=0), 0)), int(max(-distance.min(initial=0), 0))


def choose(name: str, functions: Functions) -> tuple[str, str]:
    """Method and matrix layout for ``name``; ``auto`` decides by size and by the band after reordering."""
    n = functions.n
    if name in ("rk45", "dop853"):
        return name, "dense"
    if name in ("bdf", "radau"):
        return name, "sparse" if n > WIDE else "dense"
    if n <= (CVODE_SMALL if name == "cvode" else SMALL):
        return "cvode" if name == "cvode" else "lsoda", "dense"
    _, lower, upper = banded(functions.pattern)
    width = lower + upper + 1
    if name == "cvode":
        return name, "banded" if width <= BAND_SHARE * n and width <= CVODE_BAND else "sparse"
    if width <= BAND_SHARE * n and width <= BAND_LIMIT:
        return "lsoda", "banded"
    if name == "lsoda" and n > LARGEST_FULL:
        said = f"solver lsoda needs a full matrix of {n} x {n} here, whose band is {width} wide; write bdf or cvode"
        raise InputError(said)
    return ("bdf", "sparse") if name == "auto" and n > WIDE else ("lsoda", "dense")
