"""Rest within the tolerance, which error control does not see: implicit Euler steps, solved to the end.

The flow through an orifice is the root of its drop but for a laminar end, which in a large hole is a fraction of a
micrometre of level. Where a state's tolerance is wider than that end, what acts within it is a root, z' = -c sign(z)
sqrt|z|, and Newton's step from z ends at z - f/f' = -z: implicit methods, which take one such step or a few with an old
matrix, are thrown from side to side and can only shorten their steps. Nothing moves, and steps pile up.

Then, instead,

.. math:: x_1 = x_0 + h f(t + h, x_1)

is solved by Newton's method with halved steps, h up to the next bound. A step counts only if no state moved by more
than its tolerance, what only counts up included, for that is what came in or out. So its error is below that too, and
over many steps in which rates drift one way the errors add up to less than one tolerance more; and only if no
eigenvalue of df/dx grows, since what leaves its rest slowly, from less than a tolerance, must be able to. Where that
asks for steps not much longer than the method's own, and from time to time where all drifts, the method itself goes on.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.linalg import LinAlgError, lu_factor, lu_solve

from crescentlab.solvers.functions import Functions
from crescentlab.solvers.scipy import Path, Stepper

Array = np.ndarray

PATIENCE = 50
"""So many steps, none of them cut short by a bound, in which no state leaves its tolerance are a creep; a method
that begins anew at rest has its longest step by then or nearly."""
LARGEST = 150
"""Most states: eigenvalues of more cost more than the steps."""
LONGER = 4
"""Times the method's own mean step that a step of rest must be."""
TRIES = 4
"""Lengths of a step that are tried."""
DRIFTING = 50
"""Steps of rest shorter than the bound, after which the method itself is asked again."""
ITERATIONS, SHORTEST = 20, 1 / 64
"""Most of Newton's iterations, and the shortest part of one's step that is tried."""
SOLVED = 1e-3
"""Share of the tolerance that Newton's method leaves."""
GROWS = 1e-6
"""Growth of a mode over a step, Re(lambda) h, below which it counts as rounding of one that stays."""


class Settling(Stepper):
    """An implicit stepper that is relieved while the circuit rests within its tolerance."""

    def __init__(self, method: Stepper, functions: Functions, rtol: float, atol: Array) -> None:
        self.method, self.functions, self.name = method, functions, method.name
        self.rtol, self.atol = rtol, atol
        self.step_size: float | None = None
        self.resting = False
        self.goal = 0.0
        self.begin(0.0, np.zeros(functions.n))

    def begin(self, t: float, x: Array) -> None:
        """Nothing is known of how the states move."""
        self.last = (t, x, t, x)
        """Begin and end of the last step of rest."""
        self.near, self.since, self.stood, self.patience = x, t, 0, PATIENCE
        """Where the states stood and since when, the method's steps since then, and how many are too many."""
        self.drifted = 0

    def restart(self, t: float, x: Array, bound: float) -> None:
        self.method.restart(t, x, bound)
        self.goal, self.resting = bound, False
        self.begin(t, x)

    @property
    def t(self) -> float:
        return self.last[2] if self.resting else self.method.t

    @property
    def x(self) -> Array:
        return self.last[3] if self.resting else self.method.x

    def step(self, bound: float) -> None:
        if self.stood >= self.patience:
            self.rest(bound)
        if not self.resting:
            self.method.step(bound)
            self.watch(bound)

    def rest(self, bound: float) -> None:
        """A step of rest, if there is one; else the method goes on."""
        t, x = self.t, self.x
        shortest = LONGER * (self.method.t - self.since) / self.stood
        h, after = bound - t, None
        for _ in range(TRIES):
            if h < shortest and h < bound - t:
                break
            after = self.solved(t, x, h)
            moved = np.inf if after is None else (np.abs(after - x) / self.allowed(x)).max(initial=0.0)
            if moved <= 1:
                break
            after, h = None, h * (0.5 if after is None else 0.7 / moved)
        self.drifted += h < bound - t
        if after is not None and self.drifted < DRIFTING:
            self.last, self.resting = (t, x, bound if h == bound - t else t + h, after), True
            self.step_size = h
        elif self.resting:
            self.restart(t, x, self.goal)
        else:
            self.near, self.since, self.stood, self.patience = x, t, 0, 2 * self.patience

    def watch(self, bound: float) -> None:
        """Count the method's steps in which nothing moves; those that the bound cut short say nothing."""
        self.step_size, x, t = self.method.step_size, self.method.x, self.method.t
        if np.any(np.abs(x - self.near) > self.allowed(x)):
            self.near, self.since, self.stood = x, t, 0
        else:
            self.stood += t < bound

    def allowed(self, x: Array) -> Array:
        """Tolerance of each state."""
        return np.asarray(self.atol + self.rtol * np.abs(x))

    def solved(self, t: float, before: Array, h: float) -> Array | None:
        """The states after a step of implicit Euler, or None if it is not solved, or would hide a mode that grows."""
        end, x, identity, allowed = t + h, before, np.eye(before.size), self.allowed(before)
        g = h * self.functions.rhs(end, x)
        for _ in range(ITERATIONS):
            try:
                step = lu_solve(lu_factor(identity - h * self.matrix(end, x)), g)
            except (LinAlgError, ValueError):  # singular, or not finite
                return None
            share, size = 1.0, np.abs(g / allowed).max()
            near = np.abs(step / allowed).max() <= SOLVED
            while share >= SHORTEST:
                trial = x + share * step
                g_trial = before - trial + h * self.functions.rhs(end, trial)
                if near or np.abs(g_trial / allowed).max() <= (1 - share / 4) * size:
                    break
                share /= 2
            else:
                return None
            x, g = trial, g_trial
            if near:
                slope = self.matrix(end, x)
                return x if np.isfinite(slope).all() and np.linalg.eigvals(slope).real.max() * h <= GROWS else None
        return None

    def matrix(self, t: float, x: Array) -> Array:
        """df/dx, full."""
        s = self.functions.pattern
        full = np.zeros(s.shape)
        full[s.indices, np.repeat(np.arange(self.functions.n), np.diff(s.indptr))] = self.functions.nonzeros(t, x)
        return full

    def refresh(self, rate: Array) -> None:
        if not self.resting:
            self.method.refresh(rate)

    def rate(self) -> Array:
        return self.functions.rhs(self.t, self.x) if self.resting else self.method.rate()

    def path(self) -> Path:
        if not self.resting:
            return self.method.path()
        begin, x_0, end, x_1 = self.last
        return lambda times: x_0 + ((times - begin) / (end - begin))[:, None] * (x_1 - x_0)

    def interpolant(self) -> Callable[[float], Array]:
        if not self.resting:
            return self.method.interpolant()
        begin, x_0, end, x_1 = self.last
        return lambda t: x_0 + (t - begin) / (end - begin) * (x_1 - x_0)
