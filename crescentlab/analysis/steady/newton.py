"""Newton's method on the equations of rest, on the exact Jacobian, with bits and events brought to rest.

.. math:: (\\tfrac{1}{\\delta} I - J)\\, \\Delta y = F(y), \\qquad \\delta = \\infty \\text{ for Newton's method}

A step is kept if the simplified correction at its end is smaller than the step's own, else it is halved (the natural
test of P. Deuflhard, Newton Methods for Nonlinear Problems (2004), section 3.3, which no scaling of the equations
changes). Unknowns whose rates vanish whatever the state (a mass on its stop) stay; closed sets of volumes keep their
fluid; of what else the equations leave open, sums of unknowns that no rate changes are kept, and then the nearest
solution is taken.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy import sparse
from scipy.linalg import lapack
from scipy.sparse.linalg import LinearOperator, onenormest, splu

from crescentlab.analysis.steady.closed import Ledger
from crescentlab.analysis.steady.rest import Point, Site
from crescentlab.closed_sets import ClosedSet, Matrix
from crescentlab.errors import SimulationError

Array = np.ndarray

SINGULAR = 1e-12
"""Smallest singular value, of a matrix with rows and columns of size one, below which it has none."""
DENSE = 150
"""Up to so many unknowns full matrices are quicker."""
LARGEST_DENSE = 3000
"""Most unknowns of a singular system, whose open directions need a full matrix."""
MOST = 80
"""Most iterations in one mode."""
SHORTEST = 1e-4
"""Shortest part of a step that is tried."""
NEAR_FLOOR = 0.1
"""Part of the way to absolute zero that a step leaves."""
MOST_MODES = 40
"""Most changes of mode by events."""


class NoRestError(Exception):
    """Newton's method does not come to rest from here."""


@dataclass
class Linear:
    """The linearised equations at a point: what (I/delta - J) dy = F gives."""

    site: Site
    point: Point
    ledger: Ledger
    inverse_delta: float = 0.0
    F: Array = field(init=False)
    slope: Matrix = field(init=False)
    active: Array = field(init=False)
    """Places of the unknowns that can move, shape (m,)."""
    closed: list[ClosedSet] = field(init=False)
    singular: bool = False

    def __post_init__(self) -> None:
        self.point = self.site.levelled(self.point)
        self.F, self.slope = self.site.rates(self.point)
        if not (np.isfinite(self.F).all() and np.isfinite(self.slope.data).all()):
            raise NoRestError("its rates are not finite numbers")
        self.y = self.site.unknowns(self.point)
        self.columns = self.site.scale(self.y)
        self.active = moving(self.F, self.slope)
        movable = np.zeros(self.y.size, dtype=bool)
        movable[self.active] = True
        self.closed = [c for c in self.ledger.closed(self.point) if (c.slope[movable] != 0).any()]
        self._matrix()

    @property
    def constant(self) -> Array:
        """Places of the rates that no unknown changes, yet are not 0."""
        return np.flatnonzero((sums(self.slope) == 0) & (self.F != 0))

    def _matrix(self) -> None:
        """The matrix, columns times the unknowns' sizes, rows over their largest entry; full while it is small."""
        a, columns = self.active, self.columns[self.active]
        self.replaced: list[int] = []
        rows = [each.slope[a] * columns for each in self.closed]
        for row in rows:
            free = np.abs(row)
            free[self.replaced] = 0.0
            self.replaced.append(int(np.argmax(free)))
        if a.size <= DENSE:
            full = (np.diag(np.full(a.size, self.inverse_delta)) - self.slope.toarray()[np.ix_(a, a)]) * columns
            full[self.replaced] = rows if rows else np.zeros((0, a.size))
            self.rows = _or_one(np.abs(full).max(axis=1, initial=0.0))
            self.A: Array | Matrix = full / self.rows[:, None]
        else:
            thin = sparse.diags_array(np.full(a.size, self.inverse_delta)) - self.slope[a][:, a]
            thin = sparse.lil_array(thin @ sparse.diags_array(columns))
            for place, row in zip(self.replaced, rows, strict=True):
                thin[[place], :] = row.reshape(1, -1)
            self.rows = _or_one(abs(sparse.csr_array(thin)).max(axis=1).toarray().ravel())
            self.A = sparse.csc_array(sparse.diags_array(1 / self.rows) @ thin)
        self.solve = solver(self.A)
        self.singular = self.solve is None and a.size > 0

    @functools.cached_property
    def dense(self) -> Array:
        """The matrix in full; raises :class:`NoRestError` if it is too large."""
        if self.active.size > LARGEST_DENSE:
            raise NoRestError("its equations depend on each other")
        return np.asarray(self.A if isinstance(self.A, np.ndarray) else self.A.toarray())

    def right(self, point: Point, F: Array) -> Array:
        """Right-hand side at a point, rows scaled as those of the matrix."""
        right = F[self.active].copy()
        for place, each in zip(self.replaced, self.closed, strict=True):
            right[place] = self.ledger.missing(each, point)
        return np.asarray(right / self.rows)

    def correction(self, point: Point, F: Array) -> tuple[Array, float]:
        """Correction of the unknowns in their own sizes, and what of F no correction removes."""
        right = self.right(point, F)
        if not right.size:
            return np.zeros(self.y.size), 0.0
        full = np.zeros(self.y.size)
        if self.solve is not None:
            full[self.active] = self.solve(right)
            return full, 0.0
        full[self.active] = self.inverse @ right
        return full, float(np.abs(self.dense @ full[self.active] - right).max())

    @functools.cached_property
    def decomposed(self) -> tuple[Array, Array, Array]:
        """Singular values, and the directions of rows and of columns that belong to those that are 0."""
        left, values, right = np.linalg.svd(self.dense)
        zero = values <= SINGULAR * values[0]
        return values, left[:, zero], right[zero].T

    @functools.cached_property
    def inverse(self) -> Array:
        """Of the matrix with its invariants below it: the nearest solution that keeps them; shape (m, m)."""
        kept = self.invariants()
        return np.asarray(np.linalg.pinv(np.vstack([self.dense, kept]), rcond=SINGULAR)[:, : len(self.dense)])

    def invariants(self) -> Array:
        """Sums of the unknowns, in their own sizes, that no rate changes: w J = 0; shape (k, m)."""
        rows = (self.decomposed[1].T / self.rows) * self.columns[self.active]
        return np.asarray(rows / np.abs(rows).max(axis=1, initial=0.0, keepdims=True))

    def open_directions(self) -> Array:
        """Directions of the active unknowns, in their own sizes, along which nothing changes; shape (m, k)."""
        if not self.singular or self.active.size > LARGEST_DENSE:
            return np.zeros((self.active.size, 0))
        return self.decomposed[2]


def moving(F: Array, slope: Matrix) -> Array:
    """Places of the unknowns left after taking out, again and again, those whose rates are 0 whatever the others do."""
    active = np.ones(F.size, dtype=bool)
    while True:
        still = active & (F == 0) & (sums(slope, active) == 0)
        if not still.any():
            return np.flatnonzero(active)
        active &= ~still


def sums(slope: Matrix, columns: Array | None = None) -> Array:
    """Per row, the sum of the magnitudes in these columns, a mask."""
    sizes = np.abs(slope.data)
    if columns is not None:
        sizes = sizes * np.repeat(columns, np.diff(slope.indptr))
    return np.bincount(slope.indices, sizes, minlength=slope.shape[0])


def solver(A: Array | Matrix) -> Callable[[Array], Array] | None:
    """What solves A z = r, or None if the matrix, whose rows and columns are of size one, is singular to rounding."""
    if not A.shape[0]:
        return None
    if isinstance(A, np.ndarray):
        factors, pivots, _ = lapack.dgetrf(A)
        share, _ = lapack.dgecon(factors, np.abs(A).sum(axis=0).max())
        return (lambda right: np.asarray(lapack.dgetrs(factors, pivots, right)[0])) if share > SINGULAR else None
    try:
        lu = splu(A)
    except RuntimeError:  # exactly singular
        return None
    transposed: Any = functools.partial(lu.solve, trans="T")
    inverse: Any = LinearOperator(A.shape, matvec=lu.solve, rmatvec=transposed, dtype=np.float64)
    grown = onenormest(inverse) * abs(A).sum(axis=0).max()
    return lu.solve if np.isfinite(grown) and grown * SINGULAR < 1 else None


def _or_one(sizes: Array) -> Array:
    return np.where(sizes > 0, sizes, 1.0)


@dataclass
class Found:
    """A point at rest."""

    point: Point
    linear: Linear
    residual: float
    """Largest correction that Newton's method would still make, in the unknown's own size."""
    iterations: int


class Newton:
    """Newton's method at one site."""

    def __init__(self, site: Site, ledger: Ledger, tolerance: float) -> None:
        self.site, self.ledger, self.tolerance = site, ledger, tolerance
        self.iterations = 0

    def solve(self, point: Point) -> Found:
        """A point at rest from here on, events included; raises :class:`NoRestError`."""
        for _ in range(MOST_MODES):
            found = self.in_mode(point)
            try:
                after, names = self.site.fired(found.point)
            except SimulationError as problem:
                raise NoRestError(str(problem)) from None
            if not names and np.array_equal(after.b, found.point.b):
                return found
            self.ledger.fired(found.point, after)
            point = after
        raise NoRestError("events keep changing its mode")

    def in_mode(self, point: Point) -> Found:
        """A point at rest of the present held values."""
        for _ in range(MOST):
            self.iterations += 1
            linear = Linear(self.site, point, self.ledger)
            if linear.constant.size:
                raise NoRestError("rates that no state changes")
            step, left = linear.correction(point, linear.F)
            size = largest(step)
            if size <= self.tolerance and left <= self.tolerance:
                return self.polished(Found(linear.point, linear, max(size, left), self.iterations), step)
            point = self.shortened(linear, step, size)
        raise NoRestError(f"no convergence within {MOST} iterations")

    def polished(self, found: Found, step: Array) -> Found:
        """One more step, if it brings the solution nearer: rounding is all that should remain."""
        try:
            trial = self.site.settled(self.site.moved(found.point, found.linear.y + step * found.linear.columns))
            linear = Linear(self.site, trial, self.ledger)
            size, left = (largest(np.atleast_1d(v)) for v in linear.correction(trial, linear.F))
        except (SimulationError, NoRestError):
            return found
        better = max(size, left) < found.residual and self.site.possible(trial)
        return Found(trial, linear, max(size, left), found.iterations) if better else found

    def shortened(self, linear: Linear, step: Array, size: float) -> Point:
        """The end of the longest part of a step that brings the solution nearer."""
        share = within(self.site, linear.y, step * linear.columns)
        while share > SHORTEST:
            trial = self.site.moved(linear.point, linear.y + share * step * linear.columns)
            if self.site.possible(trial):
                try:
                    trial = self.site.settled(trial)
                    F, _ = self.site.rates(trial)
                    after = largest(linear.correction(trial, F)[0]) if np.isfinite(F).all() else np.inf
                except SimulationError:
                    after = np.inf
                if after <= (1 - share / 4) * size or after <= self.tolerance:
                    return trial
            share /= 2
        raise NoRestError("no step brings it nearer")


def within(site: Site, y: Array, change: Array) -> float:
    """Part of a step, at most 1, that leaves every pressure a share of its way to absolute zero."""
    room = (1 - NEAR_FLOOR) * (y - site.floors)
    with np.errstate(divide="ignore", invalid="ignore"):
        parts = np.where((change < 0) & np.isfinite(room), room / -change, np.inf)
    return float(min(1.0, parts.min(initial=np.inf)))


def largest(values: Array) -> float:
    """Largest magnitude, 0 of nothing."""
    return float(np.abs(values).max(initial=0.0))
