"""f and its Jacobian of one run, as the steppers call them."""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np
from scipy import sparse

from crescentlab.prepared import Evaluator, Prepared
from crescentlab.system import System, Values


class Functions:
    """f and its Jacobian of one run, with the current held values and bits."""

    def __init__(self, system: System, values: Values, take: Callable[[str], Prepared] | None = None) -> None:
        """``take`` gives the functions their form; without it they are interpreted."""
        self.take = take or functools.partial(getattr, system)
        self.n = values.x0.size
        self.f = Evaluator(self.take("rhs"), values.p)
        self.system, self.values = system, values
        self.h = values.h0
        self.b = np.zeros(system.b.numel())
        self.evaluations = 0
        self.jacobians = 0

    def rhs(self, t: float, x: np.ndarray) -> np.ndarray:
        """f(t, x), shape (n,)."""
        self.evaluations += 1
        return self.f(t, x, self.h, self.b)[0].copy()

    @functools.cached_property
    def pattern(self) -> sparse.csc_matrix:
        """Sparsity of the Jacobian."""
        pattern = self.system.jacobian_expression.sparsity()
        rows, start = np.array(pattern.row()), np.array(pattern.colind())
        return sparse.csc_matrix((np.ones(rows.size), rows, start), shape=(self.n, self.n))

    @functools.cached_property
    def jacobian(self) -> Evaluator:
        """Nonzeros of the Jacobian in column order."""
        return Evaluator(self.take("jacobian"), self.values.p)

    @property
    def uses_jacobian(self) -> bool:
        """Whether anybody has asked for the Jacobian."""
        return "jacobian" in vars(self)

    def nonzeros(self, t: float, x: np.ndarray) -> np.ndarray:
        """Nonzeros of the Jacobian in column order; overwritten by the next call."""
        self.jacobians += 1
        return self.jacobian(t, x, self.h, self.b)[0]
