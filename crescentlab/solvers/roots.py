"""Finds the first root of the watched relations inside a step, on the solver's interpolant."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import casadi as ca
import numpy as np
from scipy.optimize import brentq

from crescentlab.solvers.hybrid import EPS, Hybrid
from crescentlab.system import System

_S = np.linspace(0.0, 1.0, 17)[1:-1]
_H00, _H10 = 2 * _S**3 - 3 * _S**2 + 1, _S**3 - 2 * _S**2 + _S
_H01, _H11 = -2 * _S**3 + 3 * _S**2, _S**3 - _S**2

Interpolant = Callable[[float], np.ndarray]


class RootFinder:
    """Watches the relations on states; keeps their values at the end of the last step."""

    def __init__(self, hybrid: Hybrid) -> None:
        self.hybrid = hybrid
        self.watched = hybrid.watched
        self.side = np.zeros(self.watched.size)
        """+1 where a watched bit is true, -1 where it is false."""
        self.before = np.zeros(self.watched.size)
        self.slope = np.zeros(self.watched.size)
        self.waves = np.flatnonzero(np.isin(self.watched, waves(hybrid.system)))
        """Those that may swing several times within a step, and are searched in every one."""

    def read(self, t: float, x: np.ndarray, rate: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Distances of the watched relations from turning, their rates, and roundoff."""
        g, slope, scale = self.hybrid.watch(t, x, rate)
        return self.side * g, self.side * slope, (16 * EPS) * scale

    def begin(self, t: float, x: np.ndarray, rate: np.ndarray) -> None:
        """Remember the values at the beginning of a step, after a stop."""
        if self.watched.size:
            self.side = np.where(self.hybrid.b[self.watched] > 0.5, 1.0, -1.0)
            self.before, self.slope, _ = self.read(t, x, rate)

    def first(
        self, low: float, high: float, x_high: np.ndarray, rate_high: np.ndarray, interpolant: Callable[[], Interpolant]
    ) -> float | None:
        """Earliest time in (low, high] at which a relation has left its side, or None.

        Values at ``low`` are those of the last :meth:`begin`; if there is no root, those at ``high``
        take their place.
        """
        if not self.watched.size:
            return None
        after, slope, band = self.read(high, x_high, rate_high)
        suspects = after < -band
        turning = (self.slope < 0) & (slope > 0)
        if np.count_nonzero(turning):
            turning = self.dips(turning & (self.before > band) & ~suspects, after, slope, high - low)
        if self.waves.size or np.count_nonzero(suspects) or np.count_nonzero(turning):
            path = interpolant()
            places = np.union1d(np.flatnonzero(suspects | turning), self.waves)
            plain = suspects & (self.before > band) & (self.slope < 0) & (slope < 0)
            plain[self.waves] = False
            found = []
            for k in places.tolist():
                course = self.course(k, path)
                root = course.close(low, high, low, high) if plain[k] else course.first_root(low, high)
                found += [root] if root is not None else []
            if found:
                return min(found)
        self.before, self.slope = after, slope
        return None

    def dips(self, possible: np.ndarray, after: np.ndarray, slope: np.ndarray, step: float) -> np.ndarray:
        """Of the possible relations, those whose cubic through values and slopes at both ends comes near zero."""
        result = np.zeros_like(possible)
        k = np.flatnonzero(possible)
        if k.size:
            cubic = np.outer(self.before[k], _H00) + np.outer(self.slope[k] * step, _H10)
            cubic += np.outer(after[k], _H01) + np.outer(slope[k] * step, _H11)
            result[k] = cubic.min(axis=1) <= 0.02 * (self.before[k] + np.abs(after[k]))
        return result

    def course(self, k: int, path: Interpolant) -> _Course:
        """The k-th watched relation along ``path``."""
        return _Course(self.hybrid, k, int(self.watched[k]), float(self.side[k]), path)


PERIODIC = (ca.OP_SIN, ca.OP_COS, ca.OP_TAN, ca.OP_FMOD)


def waves(system: System) -> list[int]:
    """Relations with a periodic function of the states, such as the teeth of a wheel: cos(z phi) > 0.9; no floors."""
    found: list[int] = system.once("waves", lambda: find_waves(system))
    return found


def find_waves(system: System) -> list[int]:
    """The same, found by walking through the instructions of the relations."""
    walk = ca.Function("walk", system.arguments, [system.relations])
    depends: dict[int, int] = {}  # by register: 0 on no state, 1 on states, 2 periodically
    found: list[int] = []
    for k in range(walk.n_instructions()):
        op, ins, outs = walk.instruction_id(k), walk.instruction_input(k), walk.instruction_output(k)
        if op == ca.OP_INPUT:
            depends[outs[0]] = int(ins[0] == 1)
        elif op == ca.OP_OUTPUT:
            if depends[ins[0]] == 2 and not system.bits.floors[outs[1]]:
                found.append(outs[1])
        else:
            most = max((depends[i] for i in ins), default=0)
            depends[outs[0]] = 2 if most and op in PERIODIC else most
    return found


class _Course:
    """One relation along the interpolant of a step: its distance from turning, negative once it should."""

    def __init__(self, hybrid: Hybrid, row: int, place: int, side: float, path: Interpolant) -> None:
        """``row`` counts among the watched relations, ``place`` among all."""
        self.hybrid, self.row, self.place, self.side, self.path = hybrid, row, place, side, path
        self.tolerance = hybrid.time_tolerance
        self.nothing = np.zeros(hybrid.system.x.numel())

    def value(self, t: float) -> float:
        """The distance, plus roundoff."""
        g, _, scale = self.hybrid.watch(t, self.path(t), self.nothing)
        return float(self.side * g[self.row] + 16 * EPS * scale[self.row])

    def both(self, t: float) -> tuple[float, float]:
        """The distance, plus roundoff, and its rate."""
        x, k = self.path(t), self.row
        g, rate, scale = self.hybrid.watch(t, x, self.hybrid.f(t, x, self.hybrid.h, self.hybrid.b)[0])
        return float(self.side * g[k] + 16 * EPS * scale[k]), float(self.side * rate[k])

    def slope(self, t: float) -> float:
        """Its rate."""
        return self.both(t)[1]

    def turned(self, t: float, *, heading: bool) -> bool:
        """Whether settling at ``t`` would turn the relation; with ``heading``, only if it moves that way."""
        sides, rate = self.hybrid.sides(t, self.path(t))
        return bool(sides[self.place] != (self.side > 0)) and not (heading and self.side * rate[self.place] > 0)

    def first_root(self, low: float, high: float) -> float | None:
        """When it first turns in (low, high], as closely as the clock allows; at ``low`` it has been settled."""
        times = np.concatenate(([low], low + _S * (high - low), [high])).tolist()
        values, slopes = zip(*[self.both(t) for t in times], strict=True)
        for j, (start, end) in enumerate(pairwise(times)):
            if values[j + 1] < 0:
                return self.close(start, end, low, high)
            if slopes[j] < 0 < slopes[j + 1]:
                bottom = float(brentq(self.slope, start, end, xtol=self.tolerance, rtol=4 * EPS))
                if self.value(bottom) < 0:
                    return self.close(start, bottom, low, high)
        return None

    def close(self, low: float, high: float, start: float, end: float) -> float | None:
        """The root between ``low``, where it is on its side or just leaving it, and ``high``, where it is not.

        Where the interpolant crosses although the equations head back, or is on the wrong side from the very start
        of the step, the swing was too small for the solver: then it turns once it is also heading that way (a ball
        lands falling, not rising).
        """
        at_low = self.value(low)
        while at_low <= 0 and high - low > self.tolerance:  # brentq wants two signs, and would stop at a zero
            middle = (low + high) / 2
            at_middle = self.value(middle)
            if at_middle < 0:
                high = middle
            else:
                low, at_low = middle, at_middle
        root = high
        if high - low > self.tolerance and self.value(high) < 0:  # rounding may have put it on its side again
            root = float(brentq(self.value, low, high, xtol=self.tolerance, rtol=4 * EPS))
        nudge = self.tolerance
        if self.turned(root, heading=root - start <= 2 * nudge):
            return root
        while root < end:
            root, nudge = min(end, root + nudge), 2 * nudge
            if self.turned(root, heading=True):
                return root
        return None
