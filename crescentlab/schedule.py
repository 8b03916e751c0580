"""A schedule: what a held vector is to be from given instants on, such as the pieces of a table over time.

It is data, not part of the expression graph: a table of a million rows costs the graph the few values of the present
row. Each instant is an exact stop at which the row changes before anything else happens, as bits on time alone do.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Schedule:
    """``rows[k]`` holds from ``times[k]`` [s] on; ``times`` rise, the first is minus infinity.

    ``times`` (m,); ``rows`` (m, size of the held vector).
    """

    times: np.ndarray
    rows: np.ndarray

    def at(self, t: float, tolerance: float = 0.0) -> int:
        """Number of the row that holds at ``t``; an instant within the tolerance counts as reached."""
        return int(np.searchsorted(self.times, t + tolerance, side="right")) - 1

    def after(self, t: float, tolerance: float = 0.0) -> float:
        """The next instant after ``t``, or infinity."""
        k = self.at(t, tolerance) + 1
        return float(self.times[k]) if k < self.times.size else np.inf


@dataclass(frozen=True)
class Following:
    """The held values of a system that follow a schedule: their places, and the schedule from one time to another."""

    places: slice
    schedule: Callable[[float, float], Schedule]
