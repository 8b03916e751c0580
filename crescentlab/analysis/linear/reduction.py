"""What a linear model leaves out: constants, copies of states, counters that nothing reads; and what stands still."""

from __future__ import annotations

import numpy as np

from crescentlab.analysis.tick_map import TickMap

Array = np.ndarray

UNREAD = 1e-9
"""Scaled entries below this are the rounding of counters that cancel."""


class Reduction:
    """Leaves out of z what is constant, what repeats a state, and counters that nothing reads."""

    def __init__(self, made: TickMap, C: Array, counting: Array, n: int) -> None:
        self.M, self.powers, self.C = made.matrix.copy(), made.powers, C.copy()
        self.made, self.counting, self.n = made, counting, n
        self.kept = np.ones(len(self.M), bool)

    @property
    def keep(self) -> Array:
        """Places of z that remain."""
        return np.flatnonzero(self.kept)

    def drive(self) -> Array:
        """All that inputs bring into z, shape (z, columns)."""
        return np.hstack([self.powers.reshape(len(self.M), -1), self.made.direct])

    def reduce(self) -> None:
        """Do it: first constants, then repetitions, then counters."""
        self._constants()
        self._samples()
        self._constants()
        self._counters()

    def _constants(self) -> None:
        """Held values that no tick moves, or that a tick sets to a constant."""
        driven = np.abs(self.drive()).any(axis=1)
        while True:
            rows = np.abs(self.M) * self.kept
            others = rows.sum(axis=1) - np.diag(rows)
            own = np.diag(self.M)
            fixed = self.kept & ~driven & (others == 0) & ((own == 0) | (own == 1))
            fixed[: self.n] = False
            if not fixed.any():
                return
            self.kept &= ~fixed

    def _samples(self) -> None:
        """A held value that each tick sets to a state equals it just after the tick: it becomes that state."""
        plain, direct, scale = self.made.by_remap, self.made.direct, self.made.scale
        for i in np.flatnonzero(self.kept[self.n :]) + self.n:
            (sources,) = np.nonzero(plain[i])
            if len(sources) != 1 or sources[0] >= self.n or plain[i, sources[0]] != 1 or direct[i].any():
                continue
            j = int(sources[0])
            if np.count_nonzero(plain[j]) == 1 and plain[j, j] == 1 and not direct[j].any():
                share = scale[j] / scale[i]
                for matrix in (self.M, self.C):
                    total = np.abs(matrix[:, j]) + np.abs(matrix[:, i] * share)
                    matrix[:, j] += matrix[:, i] * share
                    matrix[np.abs(matrix[:, j]) < UNREAD * total, j] = 0.0
                self.kept[i] = False

    def _counters(self) -> None:
        gone = self.counting & self.kept
        while True:
            readers = self.kept & ~gone
            read = (np.abs(self.M[readers]) > UNREAD).any(axis=0) | (np.abs(self.C) > UNREAD).any(axis=0)
            if not (gone & read).any():
                self.kept &= ~gone
                return
            gone = gone & ~read


def still_states(A: Array, B: Array, own: Array, pattern: Array, kept: Array) -> Array:
    """States whose rows are empty here (but for ``own`` on the diagonal) while their equations have entries."""
    still: Array = np.zeros(len(A), bool)
    rest = A - np.diag(own)
    while True:
        moved = (np.abs(rest) * ~still > 0).any(axis=1) | (np.abs(B) > 0).any(axis=1)
        now = kept & pattern & ~moved
        if np.array_equal(now, still):
            return still
        still = now
