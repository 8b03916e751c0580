r"""Sensitivities of a run: the variational equation along its path, and the jumps at its events.

On a smooth piece the derivatives S = dx/da (n, m) of the states by m parameters a obey

.. math:: \dot S = f_x S + f_h S_h + f_p \frac{dp}{da}

with the held values' derivatives S_h = dh/da (k, m) constant; f_x, f_h, f_p are the exact derivatives of the circuit's
equations. At an event the relation g meets zero at the time tau(a), and the new values are R(t, x, h):

.. math:: \frac{d\tau}{da} = -\frac{g_x S + g_h S_h + g_p p_a}{g_t + g_x f^-}, \qquad
          S^+ = R_x (S + f^- \tau_a) + R_h S_h + R_t \tau_a + R_p p_a - f^+ \tau_a

(the saltation matrix; the held values likewise without f). A tick's time moves with its period.

Source: Hiskens & Pai, Trajectory sensitivity analysis of hybrid systems, IEEE Trans. Circuits Syst. I 47 (2000)
204-220; Leine & Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems (2004), chapter 7.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from crescentlab.analysis.reach import NotDifferentiableError
from crescentlab.analysis.sensitivity.collocation import STAGES, Radau, Steps
from crescentlab.analysis.sensitivity.replay import Stop, World, replay
from crescentlab.analysis.sensitivity.variations import Variations
from crescentlab.solvers.snapshot import Snapshot
from crescentlab.solvers.trajectory import Pieces, Trajectory
from crescentlab.system import System, Values

Array = np.ndarray

BLOCK = 4_000_000
"""Numbers of derivatives that are evaluated at once."""
FINEST = 1e-7
"""Least tolerance of the variational equation's steps, relative to the largest S so far; otherwise the run's."""
FLOOR = 1e-6
"""S below this share of what it began with, or of its parameter's relative change, is not resolved."""
STILL = 1e-9
"""Share of the run by which a stop moves, at a parameter's relative change of one, that counts as none."""
DEEPEST = 40
"""A piece is halved so often at most."""
GRAZING = 100.0
"""A relation grazes if its rate at the boundary could be lost by an error so many times the run's."""
ALIKE = 1e-6
"""Relative difference by which two causes of one stop may move it differently."""


@dataclass(frozen=True)
class Sensitivity:
    """S along a run: at its end, and with ``steps`` at every time.

    ``x`` (n, m), ``h`` (k, m) at the end of the run, at fixed time; ``knots`` (s,) the times of the stops and of the
    run's two ends, ``shifts`` (s, m) [s per unit] how far each moves; ``end_moves``: the run ends by an event.
    """

    x: Array
    h: Array
    knots: Array
    shifts: Array
    end_moves: bool
    steps: Steps | None


def trajectory_sensitivity(
    system: System, values: Values, trajectory: Trajectory, dp: Array, dx0: Array, dh0: Array, *,
    sizes: Array | None = None, start: Snapshot | None = None, rtol: float = 1e-6, keep: bool = True,
) -> Sensitivity:  # fmt: skip
    """Derivatives of a run's states and held values by m parameters.

    ``dp`` (np, m), ``dx0`` (n, m), ``dh0`` (k, m): derivatives of the system's parameters and of the values that the
    run began with (before the events at its start). ``sizes`` (m,): magnitudes of the parameters, by which rounding is
    told from effect; by default from the numbers themselves. ``start``: the snapshot it went on from; ``rtol``: its
    tolerance. Without ``keep`` only the end is kept. Raises :class:`NotDifferentiableError` where the derivatives are
    not known: a relation that only grazes its boundary, or begins on it, two causes at one instant, an event that
    cannot be followed once more.
    """
    if not trajectory.complete:
        raise NotDifferentiableError(f"the run did not come to its end: {trajectory.error}")
    with np.errstate(all="ignore"):  # what is not finite is told by name
        return _Walk(system, values, trajectory, dp, dx0, dh0, sizes, start, rtol, keep).run()


def monodromy(
    system: System, values: Values, trajectory: Trajectory, *, start: Snapshot | None = None, rtol: float = 1e-6
) -> tuple[list[str], Array]:
    """Names of the states and held values that do not only count, and d(end of the run)/d(its start), shape (z, z).

    Over a period this is the monodromy matrix. Its eigenvalues are the multipliers of the periodic motion, all within
    the unit circle if it attracts. Raises as :func:`trajectory_sensitivity`.
    """
    n = values.x0.size
    chosen = np.flatnonzero(~np.concatenate([system.counting_states, system.counting_held]))
    every = np.eye(n + values.h0.size)[:, chosen]
    nothing = np.zeros((values.p.size, chosen.size))
    end = trajectory_sensitivity(
        system, values, trajectory, nothing, every[:n], every[n:], start=start, rtol=rtol, keep=False
    )
    names = [*system.state_names, *system.held_names]
    return [names[k] for k in chosen], np.vstack([end.x, end.h])[chosen]


def relative(change: Array, sizes: Array) -> Array:
    """Largest change (j, m) relative to the sizes (j,), those of nothing left out; shape (m,)."""
    known = sizes > 0
    shares: Array = np.max(np.abs(change)[known] / sizes[known, None], axis=0, initial=0.0)
    return shares


class _Walk:
    def __init__(
        self, system: System, values: Values, trajectory: Trajectory, dp: Array, dx0: Array, dh0: Array,
        sizes: Array | None, start: Snapshot | None, rtol: float, keep: bool,
    ) -> None:  # fmt: skip
        self.system, self.trajectory, self.rtol = system, trajectory, rtol
        self.tolerance = max(rtol, FINEST)
        self.pieces: Pieces = trajectory.pieces
        self.low, self.high = np.asarray(self.pieces.low), np.asarray(self.pieces.high)
        self.held, self.bits = np.asarray(self.pieces.h), np.asarray(self.pieces.b)
        self.variations = Variations(system, values, dp)
        self.s, self.sh = dx0.astype(float).copy(), dh0.astype(float).copy()
        self.stops = replay(system, values, trajectory, start)
        self.weight = 1 / (system.nominal + np.max(np.abs(trajectory.steps.x), axis=0, initial=0.0))[:, None]
        held = np.max(np.abs(trajectory.steps.h), axis=0, initial=0.0)
        shares = (relative(dp, np.abs(values.p)), relative(dh0, held), self.measure(self.s))
        share: Array = np.max(shares, axis=0) if sizes is None else 1 / sizes
        self.share = share
        self.size = FLOOR * share
        self.still = STILL * (trajectory.steps.t[-1] - trajectory.steps.t[0]) * share
        """Stops that move by less do not move (m,) [s per unit]."""
        self.radau = Radau(values.x0.size, self.variations.places)
        self.steps = Steps() if keep else None
        self.knots: list[float] = []
        self.shifts: list[Array] = []

    def measure(self, s: Array) -> Array:
        """Largest scaled derivative by each parameter, shape (m,)."""
        scaled: Array = np.max(np.abs(s) * self.weight, axis=0, initial=0.0)
        return scaled

    def run(self) -> Sensitivity:
        first, *later = self.stops
        self.check_start(first)
        self.jump(first, np.zeros(self.s.shape[1]))
        slack = 1e-12 * (self.trajectory.steps.t[-1] - self.trajectory.steps.t[0])
        waiting = iter([*later, None])
        stop = next(waiting)
        for piece, stages in self.stages():
            while stop is not None and stop.time <= self.low[piece] + slack:
                self.at(stop, piece)
                stop = next(waiting)
            self.cross(piece, stages)
        last = np.zeros(self.s.shape[1])
        while stop is not None:
            last = self.at(stop, self.low.size)
            stop = next(waiting)
        end = float(self.trajectory.steps.t[-1])
        moves = self.trajectory.status == "stopped"
        if not self.knots or self.knots[-1] < end - slack:
            self.knots.append(end)
            self.shifts.append(np.zeros_like(last))
        return Sensitivity(self.s, self.sh, np.array(self.knots), np.array(self.shifts), moves, self.steps)

    # -- smooth pieces ---------------------------------------------------------------------------

    def stages(self) -> Iterator[tuple[int, tuple[Array, Array, Array]]]:
        """Every piece with the derivatives at the stages of its whole and of its two halves, many pieces at once."""
        at = np.concatenate([STAGES, STAGES / 2, (1 + STAGES) / 2])
        block = max(1, BLOCK // (at.size * self.variations.numbers))
        for begin in range(0, self.low.size, block):
            pieces = np.arange(begin, min(begin + block, self.low.size))
            times = self.low[pieces, None] + at * (self.high - self.low)[pieces, None]
            found = self.along(np.repeat(pieces, at.size), times.ravel())
            for k, piece in enumerate(pieces):
                rows = slice(k * at.size, (k + 1) * at.size)
                yield int(piece), (found[0][rows], found[1][rows], found[2][rows])

    def along(self, pieces: Array, times: Array) -> tuple[Array, Array, Array]:
        """Nonzeros of f_x, f_h and f_p p_a at one time in each of the given pieces."""
        x = self.pieces.at(pieces, times)
        return self.variations.along(times, x, self.held[pieces], self.bits[pieces])

    def cross(self, piece: int, stages: tuple[Array, Array, Array]) -> None:
        """Take S over a piece, halved where one step over it and two over its halves differ."""
        low, high = float(self.low[piece]), float(self.high[piece])
        self.halve(piece, low, high, stages, 0)
        if not np.isfinite(self.s).all():
            raise NotDifferentiableError(f"the derivatives of the equations are not finite at {high:.6g} s")

    def halve(self, piece: int, low: float, high: float, stages: tuple[Array, Array, Array], depth: int) -> None:
        jacobian, of_held, forcing = stages
        drive = forcing + of_held @ self.sh[self.variations.used] if of_held.shape[2] else forcing
        step, count = high - low, STAGES.size
        parts = [slice(k * count, (k + 1) * count) for k in range(3)]
        whole = self.radau.step(step, self.s, jacobian[parts[0]], drive[parts[0]])
        first = self.radau.step(step / 2, self.s, jacobian[parts[1]], drive[parts[1]])
        second = self.radau.step(step / 2, first.end, jacobian[parts[2]], drive[parts[2]])
        size = np.maximum(self.size, self.measure(second.end))
        error = self.measure(second.end - whole.end)
        middle = (low + high) / 2
        if depth < DEEPEST and low < middle < high and np.any(error > self.tolerance * size):
            for begin, end in ((low, middle), (middle, high)):
                at = np.concatenate([STAGES, STAGES / 2, (1 + STAGES) / 2])
                times = begin + at * (end - begin)
                self.halve(piece, begin, end, self.along(np.full(at.size, piece), times), depth + 1)
            return
        if self.steps is not None:
            self.steps.add(piece, low, middle, self.s, first, self.sh)
            self.steps.add(piece, middle, high, first.end, second, self.sh)
        self.s, self.size = second.end, size

    # -- stops -----------------------------------------------------------------------------------

    def at(self, stop: Stop, piece: int) -> Array:
        """Take S over a stop before the given piece; how far the stop moves, shape (m,)."""
        causes = [self.variations.tick(position, count) for position, count in stop.ticks]
        names = [f"tick {self.system.events[self.variations.ticking[k]].name}" for k, _ in stop.ticks]
        if stop.triggers:
            causes += self.crossings(stop, piece)
            names += [self.system.bits.names[k] for k in stop.triggers]
        for name, cause in zip(names[1:], causes[1:], strict=True):
            if np.any(np.abs(cause - causes[0]) > ALIKE * (np.abs(cause) + np.abs(causes[0])) + self.still):
                raise NotDifferentiableError(
                    f"at {stop.time:.6g} s two things happen at once that move apart: {names[0]} and {name}"
                )
        moves = np.where(np.abs(causes[0]) > self.still, causes[0], 0.0)
        self.jump(stop, moves)
        return moves

    def crossings(self, stop: Stop, piece: int) -> list[Array]:
        """d tau/da of each relation that met its boundary."""
        before, rows = stop.before, list(stop.triggers)
        rate_x = self.variations.f(stop.time, before)
        rate = self.variations.relations(stop.time, before, 1.0, rate_x[:, None], np.zeros((self.sh.shape[0], 1)), 0.0)
        moves = self.variations.relations(stop.time, before, 0.0, self.s, self.sh, 1.0)
        speed = rate[rows, 0]
        self.check_grazing(stop, rows, speed, piece)
        return list(-moves[rows] / speed[:, None])

    def check_grazing(self, stop: Stop, rows: list[int], speed: Array, piece: int) -> None:
        """Raise where a relation's rate at its boundary is lost in the error of the run: v^2 = 2 a (error of g)."""
        before = np.flatnonzero(self.high[:piece] > self.low[:piece])
        scale = self.variations.scales(stop.time, stop.before)[rows]
        bend = np.zeros_like(speed)
        if before.size:
            last = int(before[-1])
            t = np.array([self.low[last]])
            x = self.pieces.at(np.array([last]), t)[0]
            then = World(x, self.held[last], self.bits[last])
            rate_x = self.variations.f(float(t[0]), then)
            old = self.variations.relations(
                float(t[0]), then, 1.0, rate_x[:, None], np.zeros((self.sh.shape[0], 1)), 0.0
            )  # fmt: skip
            bend = np.abs(speed - old[rows, 0]) / (self.high[last] - self.low[last])
        lost = ~(speed**2 > GRAZING * bend * self.rtol * scale) | (speed == 0)
        if lost.any():
            name = self.system.bits.names[rows[int(np.flatnonzero(lost)[0])]]
            raise NotDifferentiableError(f"at {stop.time:.6g} s {name} only grazes its boundary")

    def check_start(self, stop: Stop) -> None:
        """Raise if a relation begins on its boundary and a parameter moves it off: each side has its own derivative."""
        before = stop.before
        g = self.variations.value(stop.time, before)
        scale = self.variations.scales(stop.time, before)
        moves = self.variations.relations(stop.time, before, 0.0, self.s, self.sh, 1.0)
        moved = np.abs(moves) > ALIKE * scale[:, None] * self.share
        on = (np.abs(g) <= 16 * np.finfo(float).eps * scale) & moved.any(axis=1)
        for k in np.flatnonzero(on):
            turned = before.b.copy()
            turned[k] = 1 - turned[k]
            if self.variations.differ(stop.time, before, World(before.x, before.h, turned)):
                name = self.system.bits.names[k]
                raise NotDifferentiableError(f"{name} begins on its boundary, where each side has its own derivative")

    def jump(self, stop: Stop, shift: Array) -> None:
        """S after a stop that moves by ``shift`` (m,)."""
        variations, t = self.variations, stop.time
        changed = stop.rounds or not np.array_equal(stop.before.b, stop.after.b)
        if changed:
            s = self.s + np.outer(variations.f(t, stop.before), shift)
            sh = self.sh
            for each in stop.rounds:
                s, sh = variations.remap(t, each, shift, s, sh)
            self.s, self.sh = s - np.outer(variations.f(t, stop.after), shift), sh
        if not (np.isfinite(self.s).all() and np.isfinite(self.sh).all()):
            raise NotDifferentiableError(f"the derivatives of what the stop at {t:.6g} s sets are not finite")
        self.size = np.maximum(self.size, self.measure(self.s))
        self.knots.append(t)
        self.shifts.append(shift)
