r"""Modes of a circuit at instants of a run: eigenvalues of the exact Jacobian and the states that take part.

The Jacobian is split into the blocks of states that depend on each other (strongly connected), whose eigenvalues
together are its own: pure integrators are exact zeros, and what is far apart in time does not blur. Participation
factors p_ki = w_ki v_ki of left and right eigenvectors have no unit, and of a block they are those of the whole.
Source: I. J. Perez-Arriaga, G. C. Verghese, F. C. Schweppe, IEEE Trans. Power App. Syst. 101 (1982) 3117-3125.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.linalg import eig
from scipy.sparse.csgraph import connected_components

from crescentlab.analysis.linear.modes import Mode
from crescentlab.solvers.functions import Functions
from crescentlab.system import System, Values

Array = np.ndarray

MOST_STATES = 2000
"""Largest block whose eigenvalues are taken."""
ROUNDING = 100 * np.finfo(float).eps
"""Eigenvalues below this part of a block's norm are rounding of zero."""


@dataclass(frozen=True)
class RunModes:
    """Modes at one instant: eigenvalues s (m,) [1/s] other than zero, and who takes part in each."""

    time: float
    names: list[str]
    eigenvalues: Array
    places: list[Array]
    """States of each mode's block."""
    shares: list[Array]
    """Their shares, adding up to 1."""
    left_out: int = 0
    """States in blocks too large to be looked into."""

    @property
    def by_speed(self) -> Array:
        """Places of the modes by falling |s|, of a pair the one of positive imaginary part."""
        upper = np.flatnonzero(self.eigenvalues.imag >= 0)
        return np.asarray(upper[np.argsort(-np.abs(self.eigenvalues[upper]), kind="stable")])

    @property
    def stiffness(self) -> float:
        """Largest |s| over the smallest; 1 without modes."""
        size = np.abs(self.eigenvalues)
        return float(size.max() / size.min()) if size.size else 1.0

    @property
    def limiting(self) -> Array:
        """Places of the modes that limit the steps of an explicit method, by falling |s|; what grows does not."""
        return np.asarray([k for k in self.by_speed if self.eigenvalues[k].real <= 0], dtype=int)

    @property
    def fastest(self) -> float:
        """Largest |s| of those [1/s]; 0 without."""
        return float(np.abs(self.eigenvalues[self.limiting]).max(initial=0.0))

    def mode(self, k: int) -> Mode:
        """The mode at place k."""
        order = np.argsort(-self.shares[k], kind="stable")
        shares = {self.names[self.places[k][i]]: float(self.shares[k][i]) for i in order}
        return Mode(complex(self.eigenvalues[k]), shares)

    def of_state(self, state: int) -> Mode | None:
        """The mode in which a state takes part most; None for an integrator."""
        best, most = -1, 0.0
        for k in self.by_speed:
            share = float(self.shares[k][self.places[k] == state].sum())
            if share > most:
                best, most = int(k), share
        return self.mode(best) if best >= 0 else None


def run_modes(system: System, values: Values, t: float, x: Array, h: Array, b: Array) -> RunModes:
    """Modes where a run stands: time [s], states (n,), held values (k,), bits (r,)."""
    functions = Functions(system, values)
    functions.h, functions.b = h, b
    pattern = functions.pattern
    J = sparse.csc_matrix((functions.nonzeros(t, x).copy(), pattern.indices, pattern.indptr), shape=pattern.shape)
    J.eliminate_zeros()
    scaled = sparse.csr_matrix(sparse.diags_array(1 / system.nominal) @ J @ sparse.diags_array(system.nominal))
    eigenvalues: list[complex] = []
    places: list[Array] = []
    shares: list[Array] = []
    left_out = 0
    for block in _blocks(scaled):
        if block.size > MOST_STATES:
            left_out += block.size
            continue
        part: Array = np.asarray(scaled[block][:, block].toarray())
        found, left, right = eig(part, left=True, right=True)
        size = np.linalg.norm(part)
        for k, value in enumerate(found):
            if abs(value) > ROUNDING * size:
                taking = np.abs(left[:, k].conj() * right[:, k])
                eigenvalues.append(complex(value))
                places.append(block)
                shares.append(taking / taking.sum())
    return RunModes(t, system.state_names, np.array(eigenvalues, complex), places, shares, left_out)


def _blocks(matrix: sparse.csr_matrix) -> list[Array]:
    """States that depend on each other, block by block."""
    if not matrix.shape[0]:
        return []
    count, label = connected_components(matrix, directed=True, connection="strong")
    order = np.argsort(label, kind="stable")
    return np.split(order, np.cumsum(np.bincount(label, minlength=count))[:-1])
