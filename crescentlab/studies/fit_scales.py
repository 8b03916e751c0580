"""The scales of a fit: of its parameters, between bounds, and of its data, by their uncertainty."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

Array = np.ndarray

LEAST_SIGMA = 1e-9
"""Smallest standard deviation estimated, as a share of the column's largest value."""
LEAST_SHARE = 1e-3
"""A relative uncertainty is a share of at least this part of the column's largest value: zero is not known exactly."""


@dataclass(frozen=True)
class Scale:
    """The bounds of the parameters, shapes (p,), and their two scales z and u."""

    low: Array
    high: Array

    @property
    def positive(self) -> Array:
        """Whether z is the logarithm, shape (p,)."""
        return self.low > 0

    def z(self, theta: Array) -> Array:
        """z of parameters."""
        return np.asarray(np.where(self.positive, np.log(np.where(self.positive, theta, 1.0)), theta))

    def theta(self, z: Array) -> Array:
        """Parameters of z, inside the bounds."""
        made = np.where(self.positive, np.exp(np.where(self.positive, z, 0.0)), z)
        return np.asarray(np.clip(made, self.low, self.high))

    @property
    def span(self) -> Array:
        """Distance of the bounds in z."""
        return np.asarray(self.z(self.high) - self.z(self.low))

    def u(self, theta: Array) -> Array:
        """u of parameters, between 0 and 1."""
        return np.asarray((self.z(theta) - self.z(self.low)) / self.span)

    def of_u(self, u: Array) -> Array:
        """Parameters of u."""
        return self.theta(self.z(self.low) + np.asarray(u) * self.span)

    @property
    def unit(self) -> Array:
        """What a difference step of 1 is in z: 1 of a logarithm, otherwise the distance of the bounds."""
        return np.where(self.positive, 1.0, self.span)


@dataclass(frozen=True)
class Data:
    """Measured values (m,), the column each belongs to (m,), and what is known of their standard deviations."""

    measured: Array
    column: Array
    columns: tuple[str, ...]
    share: Array
    """Standard deviation as a share of the computed value, NaN if not given so, shape (m,)."""
    absolute: Array
    """Standard deviation, NaN if not given so, shape (m,); with neither it is estimated per column."""

    @property
    def estimated(self) -> Array:
        """Whether the standard deviation comes from the residuals, shape (m,)."""
        return np.asarray(np.isnan(self.share) & np.isnan(self.absolute))

    @property
    def reweighted(self) -> bool:
        """Whether any standard deviation depends on what is computed."""
        return bool(np.isnan(self.absolute).any())

    def size(self, k: int) -> float:
        """Largest measured magnitude of a column, 1 if all are zero."""
        return float(np.abs(self.measured[self.column == k]).max(initial=0.0)) or 1.0

    def first_sigma(self) -> Array:
        """Standard deviations before anything is computed: shares of the measured values, sizes of columns."""
        sizes = np.array([self.size(k) for k in range(len(self.columns))])[self.column]
        return np.where(self.estimated, sizes, self._given(self.measured))

    def sigma(self, computed: Array, active: Array, free: int) -> Array:
        """Standard deviations at a solution with ``free`` fitted parameters, shape (m,)."""
        made = self._given(np.where(np.isfinite(computed), computed, self.measured))
        n = int(active.sum())
        for k in range(len(self.columns)):
            of = (self.column == k) & self.estimated
            used = of & active
            if used.any():
                freedom = max(used.sum() * (1 - free / n), 0.5)
                spread = float(np.sqrt(np.sum((computed - self.measured)[used] ** 2) / freedom))
                made[of] = max(spread, LEAST_SIGMA * self.size(k))
            else:
                made[of] = self.size(k)
        return made

    def _given(self, values: Array) -> Array:
        """Given standard deviations; a share of a value near zero is a share of a thousandth of the column's size."""
        floor = LEAST_SHARE * np.array([self.size(k) for k in range(len(self.columns))])[self.column]
        of_share = self.share * np.maximum(np.abs(values), floor)
        return np.where(np.isnan(self.absolute), of_share, self.absolute)
