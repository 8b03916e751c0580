"""What an integration leaves behind: times, states, held values, bits, and what happened when."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np


@dataclass
class Statistics:
    """Counts of one run."""

    steps: int = 0
    evaluations: int = 0
    jacobians: int = 0
    events: int = 0
    ticks: int = 0
    restarts: int = 0
    wall_s: float = 0.0


@dataclass(frozen=True)
class Happening:
    """Events and ticks of one instant."""

    time: float
    names: tuple[str, ...]


@dataclass
class Recording:
    """Rows of (t, x, h, b), grown during a run."""

    t: list[float] = field(default_factory=list)
    x: list[np.ndarray] = field(default_factory=list)
    h: list[np.ndarray] = field(default_factory=list)
    b: list[np.ndarray] = field(default_factory=list)
    jumps: list[int] = field(default_factory=list)
    """Rows that repeat the time of the row before: the values after an event."""

    def add(self, t: float, x: np.ndarray, h: np.ndarray, b: np.ndarray, *, jump: bool = False) -> None:
        """Append a row; the arrays must not be changed afterwards."""
        if jump:
            self.jumps.append(len(self.t))
        self.t.append(t)
        self.x.append(x)
        self.h.append(h)
        self.b.append(b)

    def arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Times (m,), states (m, n), held values (m, k), bits (m, r)."""
        return np.array(self.t), np.array(self.x), np.array(self.h), np.array(self.b)


GAUSS_NODES = (np.array([-np.sqrt(0.6), 0.0, np.sqrt(0.6)]) + 1) / 2
GAUSS_WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18
"""Three-point Gauss-Legendre rule on [0, 1]: integrals over steps are exact to their order."""


@dataclass
class Pieces:
    """The smooth pieces of a run with the solver's own interpolants, for integrals over time."""

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

    def at_nodes(self) -> np.ndarray:
        """States at the Gauss nodes of every piece, shape (pieces, 3, n)."""
        return np.array(
            [
                path(low + GAUSS_NODES * (high - low))
                for path, low, high in zip(self.path, self.low, self.high, strict=True)
            ]
        )


@dataclass
class Trajectory:
    """A run, finished or not: the accepted steps, the output grid if one was asked for, the events."""

    steps: Recording
    grid: Recording | None
    happenings: list[Happening]
    statistics: Statistics
    solver: str
    pieces: Pieces = field(default_factory=Pieces)
    status: str = "done"
    """``done``, ``stopped`` (by stop_when), ``failed`` or ``interrupted``."""
    error: str = ""
    warnings: list[str] = field(default_factory=list)

    @property
    def shown(self) -> Recording:
        """The rows a result is made of."""
        return self.grid if self.grid is not None else self.steps

    @property
    def complete(self) -> bool:
        """Whether the run came to its own end."""
        return self.status in ("done", "stopped")
