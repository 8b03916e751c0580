r"""One step of a linear differential equation by the three-stage Radau IIA method, and the polynomials it leaves.

.. math:: \dot S = J(t) S + F(t), \qquad K_i = J_i \Bigl(S_0 + h \sum_j a_{ij} K_j\Bigr) + F_i

Order 5, L-stable: fast modes that a step does not resolve die out instead of ringing.
Source: Hairer & Wanner, Solving Ordinary Differential Equations II (1996), section IV.5, table 5.6.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.linalg.lapack import dgesv
from scipy.sparse.linalg import splu

Array = np.ndarray

_R = np.sqrt(6.0)
STAGES = np.array([(4 - _R) / 10, (4 + _R) / 10, 1.0])
"""Where the stages lie in a step."""
_A = np.array([
    [(88 - 7 * _R) / 360, (296 - 169 * _R) / 1800, (-2 + 3 * _R) / 225],
    [(296 + 169 * _R) / 1800, (88 + 7 * _R) / 360, (-2 - 3 * _R) / 225],
    [(16 - _R) / 36, (16 + _R) / 36, 1 / 9],
])  # fmt: skip
_POWERS = np.linalg.solve(np.vander(STAGES, 3, increasing=True).T, np.eye(3)) / np.array([1.0, 2.0, 3.0])[None, :]
"""Weight of stage i and power k + 1 in the integral of the stages' polynomial from 0 to theta."""
DENSE = 60
"""More states than this are solved for by sparse elimination."""


@dataclass(frozen=True)
class Step:
    """Rates at the stages (3, n, m), and S at the end (n, m)."""

    rates: Array
    end: Array


class Radau:
    """Steps of a system of n equations whose matrix J has nonzeros at ``places``: rows, columns."""

    def __init__(self, n: int, places: tuple[Array, Array]) -> None:
        self.n, self.places = n, places
        self.identity = np.eye(3 * n) if n <= DENSE else sparse.identity(3 * n, format="csc")

    def step(self, h: float, s: Array, nonzeros: Array, drive: Array) -> Step:
        """From S = ``s`` (n, m) over ``h``, with the nonzeros of J (3, nonzeros) and F (3, n, m) at the stages."""
        n, m = s.shape
        if not n:
            return Step(np.zeros((3, 0, m)), s)
        solve = self.dense if n <= DENSE else self.sparse
        rates = solve(h, s, nonzeros, drive).reshape(3, n, m)
        return Step(rates, s + h * np.tensordot(_A[2], rates, 1))

    def dense(self, h: float, s: Array, nonzeros: Array, drive: Array) -> Array:
        """The stages' rates by elimination with a full matrix; not finite where it is singular."""
        jacobian = np.zeros((3, self.n, self.n))
        jacobian[:, self.places[0], self.places[1]] = nonzeros
        right = (jacobian @ s + drive).reshape(3 * self.n, -1)
        blocks = h * _A[:, None, :, None] * jacobian[:, :, None, :]
        _, _, found, info = dgesv(self.identity - blocks.reshape(3 * self.n, 3 * self.n), right)
        return np.asarray(found) if info == 0 else np.full_like(right, np.nan)

    def sparse(self, h: float, s: Array, nonzeros: Array, drive: Array) -> Array:
        """The same with a sparse matrix."""
        n, (rows, columns) = self.n, self.places
        right = [sparse.csr_matrix((nonzeros[i], (rows, columns)), shape=(n, n)) @ s + drive[i] for i in range(3)]
        every = [(h * _A[i, j] * nonzeros[i], rows + i * n, columns + j * n) for i in range(3) for j in range(3)]
        values, down, across = (np.concatenate(part) for part in zip(*every, strict=True))
        matrix = sparse.csc_matrix(self.identity - sparse.csc_matrix((values, (down, across)), shape=(3 * n, 3 * n)))
        return np.asarray(splu(matrix).solve(np.concatenate(right)))


class Steps:
    """All steps of a run, so that S is known at any time in any piece."""

    def __init__(self) -> None:
        self.piece: list[int] = []
        self.low: list[float] = []
        self.high: list[float] = []
        self.begin: list[Array] = []
        self.rates: list[Array] = []
        self.held: list[Array] = []
        self.world: list[int] = []
        """Which of ``held``, which lists each only once, belongs to a step."""

    def add(self, piece: int, low: float, high: float, begin: Array, step: Step, held: Array) -> None:
        """Append the step [low, high] inside a piece, with S (n, m) at its begin and S_h (k, m)."""
        if not self.held or self.held[-1] is not held:
            self.held.append(held)
        self.world.append(len(self.held) - 1)
        self.piece.append(piece)
        self.low.append(low)
        self.high.append(high)
        self.begin.append(begin)
        self.rates.append(step.rates)

    def at(self, pieces: Array, times: Array, j: int) -> tuple[Array, Array]:
        """Column j of S (times, n) and of S_h (times, k) at one time in each of the given pieces."""
        of, low, high = np.array(self.piece), np.array(self.low), np.array(self.high)
        first = np.searchsorted(of, pieces, side="left")
        last = np.searchsorted(of, pieces, side="right") - 1
        step = np.clip(np.searchsorted(low, times, side="right") - 1, first, last)
        length = high[step] - low[step]
        theta = (times - low[step]) / length
        share = theta[:, None] ** np.arange(1, 4) @ _POWERS.T * length[:, None]
        begin = np.array([each[:, j] for each in self.begin])
        rates = np.array([each[:, :, j] for each in self.rates])
        held = np.array([each[:, j] for each in self.held])
        return begin[step] + np.einsum("ts,tsn->tn", share, rates[step]), held[np.array(self.world)[step]]
