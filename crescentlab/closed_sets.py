"""Volumes between which fluid moves but out of which none leaves, read off the ledgers of a system.

In such a set, S, the flows that states do not change sum to

.. math:: Q = \\sum_{j \\in S} q_j, \\qquad \\frac{\\partial Q}{\\partial y} = 0

C_j [m^3] fluid stored by component j, q_j [m^3/s] the sum of the flows into it, y the unknowns. With Q = 0 the fluid
inside stays as it was; with Q \\ne 0 a source feeds what has no way out, and no pressure there ends that.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from crescentlab.prepared import Evaluator, jacobian, prepare
from crescentlab.system import System
from crescentlab.units import QUANTITIES, Quantity

Array = np.ndarray
Matrix = Any
"""A sparse matrix of SciPy, its columns compressed."""

SMALL = 1e-13
"""Share of the largest term below which a sum of flows counts as rounding."""
NAMED = 3
"""Most components that are named."""


@dataclass(frozen=True)
class ClosedSet:
    """Storing components ``members`` that fluid cannot leave, and d(their content)/dy."""

    members: Array
    slope: Array
    net: float
    """Flow into the set [m^3/s]: 0, or a source feeds what has no way out."""


class ClosedSets:
    """The closed sets of a circuit at the points it is asked about."""

    def __init__(self, system: System, p: Array, places: Array) -> None:
        """The unknowns y have these ``places`` among states and held values, one after the other."""
        self.names = list(system.contents())
        if not self.names:
            return
        make = functools.partial(_flows, system, places)
        stored, flows, function = system.once(f"closed sets {places.tolist()}", make)
        self._stored, self._flows = empty_matrix(stored), empty_matrix(flows)
        self._evaluator = Evaluator(function, p)
        self._sets: dict[bytes, list[Array]] = {}

    def _at(self, t: float, x: Array, h: Array, b: Array) -> list[Array]:
        return self._evaluator(t, x, h, b)

    def contents(self, t: float, x: Array, h: Array, b: Array) -> Array:
        """Fluid stored by each component [m^3]."""
        return self._at(t, x, h, b)[0].copy() if self.names else np.zeros(0)

    def closed(self, t: float, x: Array, h: Array, b: Array, *, fed: bool = False) -> list[ClosedSet]:
        """Sets that no fluid leaves or enters; with ``fed`` those that a constant flow enters."""
        if not self.names:
            return []
        _, net, size, self._stored.data[:], self._flows.data[:] = (array.copy() for array in self._at(t, x, h, b))
        found = []
        for members in self._connected():
            inside = np.isin(np.arange(len(self.names)), members)
            slope, largest = column_sums(self._flows, inside), column_sums(abs(self._flows), inside)
            if (np.abs(slope) > SMALL * largest).any():
                continue
            total = float(net[members].sum())
            if (abs(total) > SMALL * size[members].sum()) == fed:
                found.append(ClosedSet(members, column_sums(self._stored, inside), total))
        return found

    def _connected(self) -> list[Array]:
        """Components joined by unknowns in which one stores fluid and both have flows."""
        key = (self._flows.data != 0).tobytes() + (self._stored.data != 0).tobytes()
        if key not in self._sets:
            touches: Matrix = sparse.csr_array(abs(self._flows).sign())
            owned = np.asarray(abs(self._stored).sum(axis=0)).ravel() > 0
            links = touches[:, np.flatnonzero(owned)]
            _, labels = connected_components(links @ links.T, directed=False)
            self._sets[key] = [np.flatnonzero(labels == k) for k in range(labels.max() + 1)]
        return self._sets[key]

    def without_way_out(
        self, t: float, x: Array, h: Array, b: Array, unit: Callable[[Quantity], str] = lambda _: "L/min"
    ) -> list[str]:
        """A clause on each set that is fed; ``unit(quantity)`` gives the unit of the flow."""
        flow, clauses = QUANTITIES["flow"], []
        for each in self.closed(t, x, h, b, fed=True):
            inside = some([self.names[k] for k in each.members])
            shown = flow.show(abs(each.net), unit(flow), 3)
            way = f"into {inside} has no way out" if each.net > 0 else f"out of {inside} comes from nowhere"
            clauses.append(f"the flow of {shown} {way}")
        return clauses


def closed_sets(system: System, p: Array) -> ClosedSets:
    """Those of a run: states and held values are the unknowns, but for what only counts."""
    moving = np.concatenate([~system.counting_states, ~system.counting_held])
    return ClosedSets(system, p, np.flatnonzero(moving))


def _flows(system: System, places: Array) -> tuple[ca.Sparsity, ca.Sparsity, object]:
    """Sparsities of dC/dy and dq/dy, and the function giving C, q, the sizes of q and the nonzeros of both."""
    contents = system.contents()
    columns = [ca.densify(ca.vertcat(*(c[k] for c in contents.values()))) for k in range(3)]
    y = ca.vertcat(system.x, system.h)[places.tolist()] if places.size else ca.SX(0, 1)
    stored, flows = jacobian(columns[0], y), jacobian(columns[1], y)
    outputs = [*columns, nonzeros(stored), nonzeros(flows)]
    return stored.sparsity(), flows.sparsity(), prepare("ledger", system.arguments[:-1], system.p, outputs)


def nonzeros(matrix: ca.SX) -> ca.SX:
    """Nonzeros in column order, one below the other."""
    return ca.reshape(matrix.nz[:], matrix.nnz(), 1)


def empty_matrix(pattern: ca.Sparsity) -> Matrix:
    """A matrix of this sparsity, whose data are set later."""
    rows, start = np.array(pattern.row(), dtype=np.int32), np.array(pattern.colind(), dtype=np.int32)
    return sparse.csc_matrix((np.zeros(rows.size), rows, start), shape=pattern.shape)


def column_sums(matrix: Matrix, rows: Array) -> Array:
    """Sums over these rows, a mask, of each column."""
    return np.asarray(rows.astype(float) @ matrix).ravel()


def some(names: Sequence[str]) -> str:
    """The first few of the names."""
    more = len(names) - NAMED
    return ", ".join(names[:NAMED]) + (f" and {more} more" if more > 0 else "")
