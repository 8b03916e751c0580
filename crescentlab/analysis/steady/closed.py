"""Volumes between which fluid moves but out of which none leaves: what they hold together stays as it was.

In such a set the rates depend on each other, sum over the set of dC/dt = 0 whatever the state, so the equations of rest
do not say how much fluid there is. One of them gives way to

.. math:: \\sum_{j \\in S} C_j(y) = \\sum_{j \\in S} C_j^0

C_j [m^3] fluid stored by component j, by its own law; C_j^0 at the start. Nothing is lost, however large the steps.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from crescentlab.analysis.steady.rest import Point, Site
from crescentlab.closed_sets import ClosedSet, ClosedSets

Array = np.ndarray


class Ledger:
    """What the storing components held when they were last open, and which of them are closed."""

    def __init__(self, site: Site) -> None:
        self.site = site
        self.sets = ClosedSets(site.system, site.values.p, site.equations.places)
        self.names = self.sets.names
        self.kept = np.zeros(len(self.names))

    def contents(self, point: Point) -> Array:
        """Fluid stored by each component [m^3]."""
        return self.sets.contents(self.site.t, point.x, point.h, point.b)

    def begin(self, point: Point) -> None:
        """Take the present contents as those to keep."""
        self.kept = self.contents(point)

    def fired(self, before: Point, after: Point) -> None:
        """Events have moved fluid, or merged volumes: that is none of the rates' doing."""
        if self.names:
            self.kept = self.kept + self.contents(after) - self.contents(before)

    def closed(self, point: Point) -> list[ClosedSet]:
        """Sets that no fluid leaves or enters, their slopes by the unknowns.

        Contents of components in no closed set are taken over as those to keep once they are closed in.
        """
        own = self.site.equations.own
        found = [
            replace(each, slope=np.bincount(own, each.slope, minlength=self.site.nominal.size))
            for each in self.sets.closed(self.site.t, point.x, point.h, point.b)
        ]
        if self.names:
            shut = np.isin(np.arange(len(self.names)), [k for each in found for k in each.members])
            self.kept = np.where(shut, self.kept, self.contents(point))
        return found

    def missing(self, each: ClosedSet, point: Point) -> float:
        """Fluid [m^3] that the set should hold beyond what it holds."""
        return float((self.kept - self.contents(point))[each.members].sum())
