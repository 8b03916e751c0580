"""Pseudo-transient continuation: implicit Euler steps, ever longer, until Newton's method takes over.

.. math:: (\\tfrac{1}{\\delta} I - J)\\, \\Delta y = F(y), \\qquad y^+ = y + \\Delta y

\\delta [s] the step in pseudo-time, chosen so that no unknown moves by more than a share of its size. It follows the
circuit's own way from the start roughly, events included, at a frozen time, and passes where Newton's method stalls.
Source: C. T. Kelley and D. E. Keyes, Convergence Analysis of Pseudo-Transient Continuation, SIAM J. Numer. Anal. 35
(1998) 508-523.
"""

from __future__ import annotations

import numpy as np

from crescentlab.analysis.steady.closed import Ledger
from crescentlab.analysis.steady.newton import Found, Linear, Newton, NoRestError, largest
from crescentlab.analysis.steady.rest import Point, Site
from crescentlab.errors import SimulationError

WANTED = 0.3
"""Change of an unknown in a step, in its own size, that is aimed at."""
ALLOWED = 1.0
"""Change beyond which a step is taken again, shorter."""
GROWTH, DECAY = 5.0, 0.2
"""Bounds of the change of the step from one to the next."""
FAR = 0.1
"""Share of the bounds of the unknowns beyond which one has run away."""
MOST = 600
"""Most steps."""
PATIENCE = 25
"""Steps after which Newton's method is tried again, if the rates have not fallen to a tenth before."""


class PseudoTransient:
    """Continuation at one site."""

    def __init__(self, site: Site, ledger: Ledger, newton: Newton) -> None:
        self.site, self.ledger, self.newton = site, ledger, newton
        self.steps = 0
        self.last: Point | None = None
        """Where it stands."""

    def solve(self, point: Point) -> Found:
        """A point at rest that the circuit comes to from here; raises :class:`NoRestError`."""
        self.last = point
        speed = self.speed(point)
        delta = WANTED / speed if speed > 0 else self.site.span
        tried, waited, shortest = speed, 0, 1e-9 * delta
        while self.steps < MOST:
            self.steps += 1
            after, size, fired = self.step(point, delta)
            if after is None:
                delta *= DECAY
                if delta < shortest:
                    raise NoRestError("the continuation finds no step")
                continue
            if (name := self.site.ran_away(after, FAR)) is not None:
                raise NoRestError(f"{name} runs away")
            point = self.last = after
            speed = self.speed(point)
            delta *= float(np.clip(WANTED / max(size, 1e-300), DECAY, GROWTH))
            if fired and speed > 0:
                delta = min(delta, WANTED / speed)
            waited += 1
            if not fired and (speed <= 0.1 * tried or waited >= PATIENCE):
                tried, waited = speed, 0
                try:
                    return self.newton.solve(point)
                except NoRestError:
                    continue
        raise NoRestError(f"the continuation does not end within {MOST} steps")

    def speed(self, point: Point) -> float:
        """Largest rate of change of an unknown in its own size [1/s]."""
        F, _ = self.site.rates(point)
        return largest(F / self.site.scale(self.site.unknowns(point)))

    def step(self, point: Point, delta: float) -> tuple[Point | None, float, bool]:
        """One step: where it ends (None: too long), how far it went, whether events fired at its end."""
        try:
            linear = Linear(self.site, point, self.ledger, 1 / delta)
            step, _ = linear.correction(point, linear.F)
            size = largest(step)
            trial = self.site.moved(point, linear.y + step * linear.columns)
            if not size <= ALLOWED or not self.site.possible(trial):
                return None, size, False
            settled = self.site.settled(trial)
            after, names = self.site.fired(settled)
        except (SimulationError, NoRestError):
            return None, np.inf, False
        if not self.site.possible(after):
            return None, size, False
        if names:
            self.ledger.fired(settled, after)
        return after, size, bool(names)
