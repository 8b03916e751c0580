"""Volumes between which fluid moves but out of which none leaves: what they hold together stays as it was.

In such a set the rates depend on each other, sum over the set of dC/dt = 0 whatever the state, so the equations of rest
do not say how much fluid there is. One of them gives way to

.. math:: \\sum_{j \\in S} C_j(y) = \\sum_{j \\in S} C_j^0

C_j [m^3] fluid stored by component j, by its own law; C_j^0 at the start. Nothing is lost, however large the steps.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import casadi as ca
import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from crescentlab.analysis.steady.rest import Matrix, Point, Site, nonzeros, unknowns
from crescentlab.prepared import Evaluator, jacobian, prepare
from crescentlab.system import System

Array = np.ndarray
SMALL = 1e-13
"""Share of the largest term below which a sum of flows counts as rounding."""


@dataclass(frozen=True)
class ClosedSet:
    """Storing components ``members`` that fluid cannot leave, and d(their content)/dy."""

    members: Array
    slope: Array
    net: float
    """Flow into the set [m^3/s]: 0, or a source feeds what has no way out."""


def _ledger(system: System, states: Array, held: Array) -> tuple[ca.Sparsity, ca.Sparsity, object]:
    """Sparsities of dC/dy and dq/dy, and the function giving C, q, the sizes of q and the nonzeros of both."""
    contents = system.contents()
    columns = [ca.densify(ca.vertcat(*(c[k] for c in contents.values()))) for k in range(3)]
    y = unknowns(system, states, held)
    stored, flows = jacobian(columns[0], y), jacobian(columns[1], y)
    outputs = [*columns, nonzeros(stored), nonzeros(flows)]
    return stored.sparsity(), flows.sparsity(), prepare("ledger", system.arguments[:-1], system.p, outputs)


class Ledger:
    """What the storing components held when they were last open, and which of them are closed."""

    def __init__(self, site: Site) -> None:
        self.site = site
        self.names = list(site.system.contents())
        if not self.names:
            return
        make = functools.partial(_ledger, site.system, site.equations.states, site.equations.held)
        stored, flows, function = site.system.once("closed sets", make)
        self._stored, self._flows = site.slopes(stored), site.slopes(flows)
        self._evaluator = Evaluator(function, site.values.p)
        self.kept = np.zeros(len(self.names))
        self._sets: dict[bytes, list[Array]] = {}

    def _at(self, point: Point) -> list[Array]:
        return self._evaluator(self.site.t, point.x, point.h, point.b)

    def contents(self, point: Point) -> Array:
        """Fluid stored by each component [m^3]."""
        return self._at(point)[0].copy() if self.names else np.zeros(0)

    def begin(self, point: Point) -> None:
        """Take the present contents as those to keep."""
        self.kept = self.contents(point)

    def fired(self, before: Point, after: Point) -> None:
        """Events have moved fluid, or merged volumes: that is none of the rates' doing."""
        if self.names:
            self.kept = self.kept + self.contents(after) - self.contents(before)

    def closed(self, point: Point, *, fed: bool = False) -> list[ClosedSet]:
        """Sets that no fluid leaves or enters; with ``fed`` those that a constant flow enters.

        Contents of components in no closed set are taken over as those to keep once they are closed in.
        """
        if not self.names:
            return []
        contents, net, size, stored, flows = (array.copy() for array in self._at(point))
        self._stored.data[:], self._flows.data[:] = stored, flows
        found = []
        for members in self._connected():
            inside = np.isin(np.arange(len(self.names)), members)
            slope, largest = columns(self._flows, inside), columns(abs(self._flows), inside)
            if (np.abs(slope) > SMALL * largest).any():
                continue
            total = float(net[members].sum())
            if (abs(total) > SMALL * size[members].sum()) == fed:
                found.append(ClosedSet(members, columns(self._stored, inside), total))
        if not fed:
            shut = np.isin(np.arange(len(self.names)), [k for each in found for k in each.members])
            self.kept = np.where(shut, self.kept, contents)
        return found

    def missing(self, each: ClosedSet, point: Point) -> float:
        """Fluid [m^3] that the set should hold beyond what it holds."""
        return float((self.kept - self.contents(point))[each.members].sum())

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


def columns(matrix: Matrix, rows: Array) -> Array:
    """Sums over these rows, a mask, of each column."""
    return np.asarray(rows.astype(float) @ matrix).ravel()
