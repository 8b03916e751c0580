"""What an integration leaves behind: times, states, held values, bits, and what happened when."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from crescentlab.solvers.snapshot import Snapshot


@dataclass
class Statistics:
    """Counts of one run."""

    steps: int = 0
    evaluations: int = 0
    jacobians: int = 0
    events: int = 0
    ticks: int = 0
    restarts: int = 0
    rejected: int = 0
    factorisations: int = 0
    wall_s: float = 0.0
    limited: np.ndarray | None = None
    """Per state, the tried steps in which its scaled error was the largest, shape (n,); the compiled loop's alone."""


@dataclass(frozen=True)
class Happening:
    """Events and ticks of one instant."""

    time: float
    names: tuple[str, ...]


@dataclass(frozen=True)
class Rows:
    """Rows of a run: times (m,), states (m, n), held values (m, k), bits (m, r)."""

    t: np.ndarray
    x: np.ndarray
    h: np.ndarray
    b: np.ndarray
    jumps: np.ndarray
    """Places of rows that repeat the time of the row before: the values after an event."""

    def arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Times, states, held values, bits."""
        return self.t, self.x, self.h, self.b


@dataclass
class Recording:
    """Rows of (t, x, h, b), grown during a run."""

    t: list[float] = field(default_factory=list)
    x: list[np.ndarray] = field(default_factory=list)
    h: list[np.ndarray] = field(default_factory=list)
    b: list[np.ndarray] = field(default_factory=list)
    jumps: list[int] = field(default_factory=list)

    def add(self, t: float, x: np.ndarray, h: np.ndarray, b: np.ndarray, *, jump: bool = False) -> None:
        """Append a row; the arrays must not be changed afterwards."""
        if jump:
            self.jumps.append(len(self.t))
        self.t.append(t)
        self.x.append(x)
        self.h.append(h)
        self.b.append(b)

    def done(self) -> Rows:
        """The rows as arrays."""
        return Rows(
            np.array(self.t), np.array(self.x), np.array(self.h), np.array(self.b), np.array(self.jumps, dtype=int)
        )


GAUSS_NODES = (np.array([-np.sqrt(0.6), 0.0, np.sqrt(0.6)]) + 1) / 2
GAUSS_WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18
"""Three-point Gauss-Legendre rule on [0, 1]: integrals over steps are exact to their order."""


class Pieces(Protocol):
    """The smooth pieces of a run, for integrals over time."""

    @property
    def low(self) -> Sequence[float] | np.ndarray:
        """Begin of each piece, shape (pieces,)."""

    @property
    def high(self) -> Sequence[float] | np.ndarray:
        """End of each piece, shape (pieces,)."""

    @property
    def h(self) -> Sequence[np.ndarray] | np.ndarray:
        """Held values in each piece, shape (pieces, k)."""

    @property
    def b(self) -> Sequence[np.ndarray] | np.ndarray:
        """Bits in each piece, shape (pieces, r)."""

    def at(self, pieces: np.ndarray, times: np.ndarray) -> np.ndarray:
        """States at one time in each of the given pieces, shape (times, n)."""

    def at_nodes(self) -> np.ndarray:
        """States at the Gauss nodes of every piece, shape (pieces, 3, n)."""


@dataclass
class Paths:
    """Pieces as the solver's own interpolants."""

    low: list[float] = field(default_factory=list)
    high: list[float] = field(default_factory=list)
    path: list[Callable[[np.ndarray], np.ndarray]] = field(default_factory=list)
    h: list[np.ndarray] = field(default_factory=list)
    b: list[np.ndarray] = field(default_factory=list)

    def add(
        self, low: float, high: float, path: Callable[[np.ndarray], np.ndarray], h: np.ndarray, b: np.ndarray
    ) -> None:
        """Append the piece [low, high]; ``path(times)`` gives states, shape (times, n)."""
        self.low.append(low)
        self.high.append(high)
        self.path.append(path)
        self.h.append(h)
        self.b.append(b)

    def at(self, pieces: np.ndarray, times: np.ndarray) -> np.ndarray:
        """States at one time in each of the given pieces, shape (times, n)."""
        cuts = np.flatnonzero(np.diff(pieces)) + 1  # times of one piece at once
        groups = zip(np.split(pieces, cuts), np.split(times, cuts), strict=True)
        return np.concatenate([self.path[int(group[0])](t) for group, t in groups])

    def at_nodes(self) -> np.ndarray:
        """States at the Gauss nodes of every piece, shape (pieces, 3, n)."""
        return np.array(
            [
                path(low + GAUSS_NODES * (high - low))
                for path, low, high in zip(self.path, self.low, self.high, strict=True)
            ]
        )


@dataclass(frozen=True)
class Polynomials:
    """Pieces as polynomials: x = sum over k of coefficients[k] ((t - low)/length)^k."""

    low: np.ndarray
    high: np.ndarray
    length: np.ndarray
    coefficients: np.ndarray
    """Shape (pieces, degree + 1, n)."""
    h: np.ndarray
    b: np.ndarray

    def at(self, pieces: np.ndarray, times: np.ndarray) -> np.ndarray:
        """States at one time in each of the given pieces, shape (times, n)."""
        theta = ((times - self.low[pieces]) / self.length[pieces])[:, None]
        x = np.zeros((pieces.size, self.coefficients.shape[2]))
        for k in reversed(range(self.coefficients.shape[1])):
            x = x * theta + self.coefficients[pieces, k]
        return x

    def at_nodes(self) -> np.ndarray:
        """States at the Gauss nodes of every piece, shape (pieces, 3, n)."""
        every = np.arange(self.low.size)
        return np.stack([self.at(every, self.low + node * (self.high - self.low)) for node in GAUSS_NODES], axis=1)


@dataclass
class Trajectory:
    """A run, finished or not: the accepted steps, the output grid if one was asked for, the events."""

    steps: Rows
    grid: Rows | None
    happenings: list[Happening]
    statistics: Statistics
    solver: str
    pieces: Pieces = field(default_factory=Paths)
    status: str = "done"
    """``done``, ``stopped`` (by stop_when), ``failed`` or ``interrupted``."""
    error: str = ""
    end: Snapshot | None = None
    """Where the run stands; None if it failed."""
    warnings: list[str] = field(default_factory=list)

    @property
    def shown(self) -> Rows:
        """The rows a result is made of."""
        return self.grid if self.grid is not None else self.steps

    @property
    def complete(self) -> bool:
        """Whether the run came to its own end."""
        return self.status in ("done", "stopped")
