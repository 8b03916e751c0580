"""Finds the first root of the watched relations inside a step, on the solver's interpolant."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq

from crescentlab.solvers.hybrid import EPS, Hybrid

_S = np.linspace(0.0, 1.0, 17)[1:-1]
_H00, _H10 = 2 * _S**3 - 3 * _S**2 + 1, _S**3 - 2 * _S**2 + _S
_H01, _H11 = -2 * _S**3 + 3 * _S**2, _S**3 - _S**2

Interpolant = Callable[[float], np.ndarray]


class RootFinder:
    """Watches the relations on states; keeps their values at the end of the last step."""

    def __init__(self, hybrid: Hybrid) -> None:
        self.hybrid = hybrid
        self.watched = hybrid.watched
        self.every = self.watched.size == hybrid.n
        self.side = np.zeros(self.watched.size)
        """+1 where a watched bit is true, -1 where it is false."""
        self.before = np.zeros(self.watched.size)
        self.slope = np.zeros(self.watched.size)

    def read(self, t: float, x: np.ndarray, rate: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Distances of the watched relations from turning, their rates, and roundoff."""
        g, slope, scale = self.hybrid.relation(t, x, rate)
        if self.every:
            return self.side * g, self.side * slope, (16 * EPS) * scale
        w = self.watched
        return self.side * g[w], self.side * slope[w], 16 * EPS * scale[w]

    def begin(self, t: float, x: np.ndarray, rate: np.ndarray) -> None:
        """Remember the values at the beginning of a step, after a stop."""
        if self.watched.size:
            self.side = np.where(self.hybrid.b[self.watched] > 0.5, 1.0, -1.0)
            self.before, self.slope, _ = self.read(t, x, rate)

    def first(
        self, low: float, high: float, x_high: np.ndarray, rate_high: np.ndarray, interpolant: Callable[[], Interpolant]
    ) -> float | None:
        """Earliest time in (low, high] at which a relation has left its side, or None.

        Values at ``low`` are those of the last :meth:`begin`; if there is no root, those at ``high``
        take their place.
        """
        if not self.watched.size:
            return None
        after, slope, band = self.read(high, x_high, rate_high)
        suspects = after < -band
        turning = (self.slope < 0) & (slope > 0)
        if turning.any():
            turning = self.dips(turning & (self.before > band) & ~suspects, after, slope, high - low)
        if suspects.any() or turning.any():
            path = interpolant()
            places = np.flatnonzero(suspects | turning)
            found = [r for k in places if (r := self.locate(int(k), low, high, self.side[k], path)) is not None]
            if found:
                return min(found)
        self.before, self.slope = after, slope
        return None

    def dips(self, possible: np.ndarray, after: np.ndarray, slope: np.ndarray, step: float) -> np.ndarray:
        """Of the possible relations, those whose cubic through values and slopes at both ends comes near zero."""
        result = np.zeros_like(possible)
        k = np.flatnonzero(possible)
        if k.size:
            cubic = np.outer(self.before[k], _H00) + np.outer(self.slope[k] * step, _H10)
            cubic += np.outer(after[k], _H01) + np.outer(slope[k] * step, _H11)
            result[k] = cubic.min(axis=1) <= 0.02 * (self.before[k] + np.abs(after[k]))
        return result

    def locate(self, k: int, low: float, high: float, side: float, path: Interpolant) -> float | None:
        """The first time relation k is on the other side, as closely as the clock allows."""
        place = self.watched[k]
        zeros = np.zeros(self.hybrid.system.x.numel())

        def value(t: float) -> float:
            g, _, scale = self.hybrid.relation(t, path(t), zeros)
            return float(side * g[place] + 16 * EPS * scale[place])

        times = np.concatenate(([low], low + _S * (high - low), [high]))
        values = np.array([value(t) for t in times])
        wrong = np.flatnonzero(values[1:] < 0)  # at low its bit has been settled
        if wrong.size:
            return self.close(place, side, path, value, times[wrong[0]], times[wrong[0] + 1], low)
        return self.shallow(place, side, path, value, times, values)

    def shallow(
        self, place: int, side: float, path: Interpolant, value: Callable[[float], float], times: np.ndarray, values: np.ndarray
    ) -> float | None:
        """A dip between samples: go to its bottom."""
        j = int(np.argmin(values))
        low, high = float(times[max(j - 1, 0)]), float(times[min(j + 1, times.size - 1)])

        def slope(t: float) -> float:
            return float(side * self.hybrid.relation(t, path(t))[1][place])

        if not slope(low) < 0 < slope(high):
            return None
        bottom = float(brentq(slope, low, high, xtol=self.hybrid.time_tolerance, rtol=4 * EPS))
        return self.close(place, side, path, value, low, bottom, float(times[0])) if value(bottom) < 0 else None

    def close(
        self, place: int, side: float, path: Interpolant, value: Callable[[float], float], low: float, high: float, start: float
    ) -> float | None:
        """The root between ``low``, where the relation is on its side or just leaving it, and ``high``, where it is not.

        Wrong from the very start of the step is a swing too small for the solver's tolerance: then it turns once it
        is also heading that way (a ball lands falling, not rising).
        """
        tolerance, end = self.hybrid.time_tolerance, high
        at_low = value(low)
        while at_low <= 0 and high - low > tolerance:  # brentq needs a sign, and would stop at an exact zero
            middle = (low + high) / 2
            at_middle = value(middle)
            if at_middle < 0:
                high = middle
            else:
                low, at_low = middle, at_middle
        root = high if high - low <= tolerance else float(brentq(value, low, high, xtol=tolerance, rtol=4 * EPS))
        from_start = root - start <= 2 * tolerance
        nudge = tolerance
        while not self.turned(place, side, root, path, heading=from_start):
            if root >= end:
                return None
            root, nudge = min(end, root + nudge), 2 * nudge
        return root

    def turned(self, place: int, side: float, t: float, path: Interpolant, *, heading: bool) -> bool:
        """Whether settling at ``t`` would turn the relation; with ``heading``, only if it moves that way."""
        sides, rate = self.hybrid.sides(t, path(t))
        return bool(sides[place] != (side > 0)) and not (heading and side * rate[place] > 0)
