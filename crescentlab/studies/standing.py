"""A window without a run behind it: an operating point, where nothing changes."""

from __future__ import annotations

import numpy as np

from crescentlab.analysis.outcome import Window
from crescentlab.result import Result
from crescentlab.solvers.snapshot import Snapshot


class Still(Window):
    """A window in which nothing changes: one second at an operating point, at two instants."""

    def __init__(self, result: Result, at: Snapshot) -> None:
        self.system, self.design, self.p = result.system, result.design, result.values.p
        self.start, self.stop = at.t, at.t + 1.0
        self.now = self.t = np.full(2, at.t)
        self.weights = np.full(2, 0.5)
        self.x, self.h, self.b = np.tile(at.x, (2, 1)), np.tile(at.h, (2, 1)), np.tile(at.b, (2, 1))
        self.series = {}

    def __getitem__(self, name: str) -> np.ndarray:
        """Series of a variable, at the time at which the point stands."""
        shown, self.t = self.t, self.now
        try:
            return super().__getitem__(name)
        finally:
            self.t = shown

    def whole_periods(self, frequency: float) -> None:
        """Any frequency fits: put half a period between the instants, so that the line of a constant is 0."""
        self.t = self.start + np.array([0.0, 0.5 / frequency])
