"""The compiled loop driven from Python: prepares what it reads, empties what it records, tells what it fails on.

Stepping, error control, roots, remaps and ticks are C (``c/*.c``); Python is called back between blocks of steps only.
"""

from __future__ import annotations

import ctypes
import time
from collections.abc import Callable
from typing import NoReturn

import numpy as np

from crescentlab import units
from crescentlab.errors import CompilerError, SimulationError
from crescentlab.prepared import Evaluator
from crescentlab.solvers import native
from crescentlab.solvers.diagnosis import Diagnosis
from crescentlab.solvers.elimination import elimination
from crescentlab.solvers.functions import Functions
from crescentlab.solvers.hybrid import ZENO_SPAN, Hybrid
from crescentlab.solvers.jumps import ROWS, Chatter
from crescentlab.solvers.limits import PressureLimits
from crescentlab.solvers.options import ANGLE_STEP, RESTART_SHARE, TOLERANCE_SHARE, Options
from crescentlab.solvers.pace import CLOCK_SWING, clock_pace
from crescentlab.solvers.promotion import Promotion
from crescentlab.solvers.records import Records, on_grid
from crescentlab.solvers.roots import waves
from crescentlab.solvers.snapshot import Snapshot
from crescentlab.solvers.storms import STORM_COUNT, STORM_STEPS, Storms
from crescentlab.solvers.trajectory import Statistics, Trajectory
from crescentlab.system import System, Values

LOOK = 0.1
"""Seconds between two signs of progress."""
FIRST_BLOCK = 500
"""Steps before Python first looks in; later about as many as take LOOK, and never more than ..."""
MOST_BLOCK = 100_000
MOST_BYTES = 2_000_000_000
"""A run whose records grow beyond this ends, and keeps them, before the machine ends it and nothing is kept."""
SAVING = 0.6
"""Share of a run that compiled functions save."""
FIELDS = {
    "rhs": "rhs", "linear": "linear", "relation": "relation", "relation_on_state": "watch", "condition": "condition",
    "remap": "remap", "remap_ticks": "remap_ticks", "remap_events": "remap_events",
}  # fmt: skip
"""Functions of the system, and the field of the loop's structure that calls each."""
OUTPUTS = {
    "rhs": ("fx",), "linear": ("lin_f", "jacobian", "lin_t"), "relation": ("g", "g_rate", "g_scale"),
    "relation_on_state": ("w", "w_rate", "w_scale"), "condition": ("conditions",),
    **dict.fromkeys(("remap", "remap_ticks", "remap_events"), ("new_x", "new_h")),
}  # fmt: skip
"""Fields of their results."""


def called(system: System, solver: str) -> list[str]:
    """Functions of the system that a run with this method calls."""
    names = [name for name in FIELDS if solver == "rodas" or name != "linear"]
    return [name for name in names if system.events or not name.startswith("remap")]


def integrate(
    system: System, values: Values, options: Options, progress: Callable[[float], None] | None = None,
    start: Snapshot | None = None,
) -> Trajectory:  # fmt: skip
    """Run the system; failures and interruptions end up in the trajectory's status, nothing is lost.

    Raises :class:`CompilerError` where the loop cannot be built.
    """
    run = _CompiledRun(system, values, options, progress)
    if start is not None:
        run.hybrid.resume(start)
    return run.run()


def possible() -> bool:
    """Whether this machine can build the loop, or has built it."""
    try:
        native.library()
        native.call_function()
    except CompilerError:
        return False
    return True


class _CompiledRun:
    def __init__(
        self, system: System, values: Values, options: Options, progress: Callable[[float], None] | None
    ) -> None:
        self.system, self.values, self.options, self.progress = system, values, options, progress
        self.library = native.library()
        self.warnings: list[str] = []
        self.promotion = Promotion(system, called(system, options.solver), options.compile, SAVING)
        self.warnings += [notice] if (notice := self.promotion.before()) else []
        self.hybrid = Hybrid(system, values, options.start, options.stop)
        self.atol = options.rtol * system.nominal
        self.limits = PressureLimits(system, values.p)
        self.diagnosis = Diagnosis(Functions(system, values), self.limits, options.rtol, self.atol, options.solver)
        self.storms = Storms(system)
        self.chatter = Chatter(system, values.p)
        self.chatter_at = FIRST_BLOCK
        self.chattering: str | None = None
        self.run_ = native.Run()
        self.set_sizes()
        self.set_functions()
        self.set_relations_and_events()
        self.set_schedules()
        self.set_task()
        self.set_scratch()
        self.records = Records(self.run_, options.solver)

    # -- what the loop reads ---------------------------------------------------------------------

    def set_sizes(self) -> None:
        r, system = self.run_, self.system
        hybrid = self.hybrid
        angles = [k for k, q in enumerate(system.state_quantities) if q is units.angle]
        r.n, r.n_held, r.n_bits = self.values.x0.size, self.values.h0.size, system.b.numel()
        r.n_events, r.n_conditions, r.n_ticks = len(system.events), len(hybrid.rising), len(hybrid.ticking)
        r.n_watched, r.n_linear, r.n_angles = hybrid.watched.size, hybrid.linear.size, len(angles)
        r.give(angles=_whole(angles))

    def set_functions(self) -> None:
        """Bind every function to the same input arrays."""
        r, system, p = self.run_, self.system, self.values.p
        t, x, h, b = np.zeros(1), _room(r.n), _room(r.n_held), _room(r.n_bits)
        v, flags = _room(r.n), _room(r.n_events)
        r.give(t_in=t, x_in=x, h=h, b=b, v_in=v, flags=flags)
        h[: r.n_held] = self.values.h0
        r.trigger = native.call_function()
        self.evaluators: dict[str, list[Evaluator]] = {}
        new = [_room(r.n), _room(r.n_held)]
        for name in called(system, self.options.solver):
            remaps = name.startswith("remap")
            more = [flags] if remaps else [v] if name.startswith("relation") else []
            evaluator = Evaluator(self.promotion.take(name), p, [t, x, h, b, *more], new if remaps else None)
            self.evaluators[name] = [evaluator]
            r.give(**dict(zip(OUTPUTS[name], evaluator.outputs, strict=True)))
        self.set_addresses()

    def set_addresses(self) -> None:
        """Tell the loop where its functions are."""
        for name, (evaluator,) in self.evaluators.items():
            setattr(self.run_, FIELDS[name], native.address_of(evaluator.buffer))

    def set_relations_and_events(self) -> None:
        r, hybrid, system = self.run_, self.hybrid, self.system
        kinds = [native.KINDS[event.kind.upper()] for event in system.events]
        r.give(
            strict=_whole(system.bits.strict), watched=_whole(hybrid.watched),
            switches=_whole(system.bits.switches[hybrid.watched]), wave=_whole(np.isin(hybrid.watched, waves(system))),
            time_linear=_whole(hybrid.linear),
            rising=_whole(hybrid.rising), ticking=_whole(hybrid.ticking), kind=_whole(kinds),
            holds=_whole(np.zeros(r.n_conditions)), period=_real(hybrid.periods), ticked=_whole(np.zeros(r.n_ticks)),
            origin=_real(hybrid.origin),
            due=_whole(np.zeros(r.n_ticks)), first_step=_room(r.n_events),
            recent=_room(r.n_events * native.LIMITS["ZENO_COUNT"]), fired=_whole(np.zeros(r.n_events)),
        )  # fmt: skip
        r.curved = hybrid.curved.size
        r.curved_held = int(hybrid.anew)
        r.curved_next = self.options.start
        r.give(storm_last=self.storms.last, storm_row=self.storms.row)
        r.storm_steps, r.storm_count = STORM_STEPS, STORM_COUNT
        r.zeno_span = ZENO_SPAN * self.options.span
        r.last_event = -1

    def set_schedules(self) -> None:
        """What follows a schedule: all rows one below the other."""
        r, following = self.run_, self.hybrid.following
        schedules = [schedule for _, schedule in following]
        sizes = np.array([schedule.times.size for schedule in schedules], dtype=int)
        first = np.cumsum(sizes) - sizes
        at = [schedule.at(self.options.start, self.hybrid.time_tolerance) for schedule in schedules]
        r.n_schedules, r.schedule_width = len(schedules), max((s.rows.shape[1] for s in schedules), default=0)
        rows = [np.pad(s.rows, ((0, 0), (0, r.schedule_width - s.rows.shape[1]))) for s in schedules]
        r.give(
            schedule_times=_real(np.concatenate([np.zeros(0), *(s.times for s in schedules)])),
            schedule_rows=_real(np.concatenate([np.zeros((0, r.schedule_width)), *rows])),
            schedule_at=_whole(first + np.array(at, dtype=int)), schedule_last=_whole(first + sizes - 1),
            schedule_place=_whole([places.start for places, _ in following]),
            schedule_size=_whole([places.stop - places.start for places, _ in following]),
        )  # fmt: skip

    def enter(self) -> None:
        """Compute the start as for every solver, and let the loop go on from there."""
        r, kept, hybrid = self.run_, self.run_.kept, self.hybrid
        x = self.values.x0
        self.diagnosis.check_finite(r.t, x, self.diagnosis.functions.rhs(r.t, x), "at the start")
        x, names = hybrid.enter(r.t, x)
        kept["x"][: r.n], kept["h"][: r.n_held], kept["b"][: r.n_bits] = x, hybrid.h, hybrid.b
        kept["holds"][: r.n_conditions], r.finished = hybrid.holds, hybrid.finished
        kept["origin"][: r.n_ticks], kept["ticked"][: r.n_ticks] = hybrid.origin, hybrid.ticked
        places = {event.name: k for k, event in enumerate(self.system.events)}
        kept["log_t"][: len(names)], kept["log_event"][: len(names)] = r.t, [places[name] for name in names]
        r.events = r.logs = len(names)

    def end(self) -> Snapshot:
        """Where the run stands."""
        r, kept = self.run_, self.run_.kept
        held = {name: kept[name][:size].copy() for name, size in (("h", r.n_held), ("b", r.n_bits))}
        clocks = {name: kept[name][: r.n_ticks].copy() for name in ("origin", "ticked", "period")}
        return Snapshot(r.t, self.x, **held, holds=kept["holds"][: r.n_conditions].copy(), **clocks)

    def set_task(self) -> None:
        r, o = self.run_, self.options
        r.method = native.METHODS[o.solver]
        share = TOLERANCE_SHARE.get(o.solver, 1.0)
        r.start, r.stop, r.rtol, r.step_cap = o.start, o.stop, share * o.rtol, o.step_cap
        r.angle_step, r.clock_swing, r.restart_share = ANGLE_STEP, CLOCK_SWING, RESTART_SHARE / share
        r.tolerance = self.hybrid.time_tolerance
        r.t = o.start
        pace = clock_pace(self.system, self.values, o.start, o.stop)
        if pace is not None:
            r.n_pace = pace[0].size
            r.give(pace_t=_real(pace[0]), pace_s=_real(pace[1]))
        floor, held_floor = self.limits.states.ending, self.limits.held.ending
        r.give(atol=_real(share * self.atol), floor=_real(floor), held_floor=_real(held_floor))

    def set_scratch(self) -> None:
        r, n = self.run_, self.run_.n
        stages, degree = native.SHAPES[self.options.solver]
        x = _room(n)
        x[:n] = self.values.x0
        r.give(x=x, rate=_room(n), x_new=_room(n), rate_new=_room(n), work=_room(n), lu_work=_room(n), inverse=_room(n))
        r.give(coef=_room((degree + 1) * n), stages=_room(stages * n), limited=_whole(np.zeros(n)))
        for name in ("side", "before", "slope", "slope_last", "after", "slope_new", "band"):
            r.give(**{name: _room(r.n_watched)})
        r.give(
            want=_room(r.n_bits),
            fastest=_room(r.n_bits),
            seen=np.zeros(native.LIMITS["MAX_SETTLING"] * r.n_bits + 1, np.uint8),
        )
        if self.options.solver == "rodas" and n:
            found = self.system.once("elimination", lambda: elimination(self.diagnosis.functions.pattern))
            r.give(
                row=_whole(found.row), column=_whole(found.column), diagonal=_whole(found.diagonal),
                place=_whole(found.place), order=_whole(found.order), lu=_room(found.column.size),
            )  # fmt: skip
            r.nonzeros = found.place.size

    # -- the run ---------------------------------------------------------------------------------

    def run(self) -> Trajectory:
        begun = self.begun = self.shown_at = time.perf_counter()
        status, error = "done", ""
        try:
            with np.errstate(all="ignore"):
                self.enter()
            status = self.advance()
        except SimulationError as problem:
            t = self.run_.t
            status, error = "failed", f"the run ended at {t:.6g} s of {self.options.stop:.6g} s: {problem}"
        except KeyboardInterrupt:
            status, error = "interrupted", f"interrupted at {self.run_.t:.6g} s; what was computed is kept"
        self.drain()
        self.promotion.end()
        wall = time.perf_counter() - begun
        r = self.run_
        statistics = Statistics(
            steps=r.steps, evaluations=r.evaluations, jacobians=r.jacobians, events=r.events, ticks=r.ticks,
            restarts=r.restarts, rejected=r.rejected, factorisations=r.factorisations, wall_s=wall,
            limited=r.kept["limited"][: r.n].copy(),
        )  # fmt: skip
        values, names = self.values, [event.name for event in self.system.events]
        at_start = (self.options.start, values.x0, values.h0, np.zeros(r.n_bits))
        steps, pieces = self.records.rows(at_start), self.records.pieces()
        step = self.options.output_step
        functions = "compiled" if self.promotion.compiled else "interpreted"
        return Trajectory(
            steps=steps, grid=on_grid(self.options.start, step, r.tolerance, steps, pieces) if step else None,
            happenings=self.records.happenings(names), statistics=statistics, pieces=pieces,
            solver=f"{self.options.solver} (compiled loop, {functions} functions)",
            status=status, error=error, end=None if status == "failed" else self.end(), warnings=self.warnings,
        )  # fmt: skip

    def advance(self) -> str:
        """Call the loop until it is done; the status. Raises what it failed on."""
        r, block = self.run_, FIRST_BLOCK
        while True:
            called = time.perf_counter()
            code = native.NAMES[self.library.advance(ctypes.byref(r), block)]
            pause = max(time.perf_counter() - called, 1e-6)
            block = max(1, min(2 * block, MOST_BLOCK, round(block * LOOK / pause)))
            self.hybrid.h, self.hybrid.b = r.kept["h"][: r.n_held].copy(), r.kept["b"][: r.n_bits].copy()
            self.drain()
            self.warnings += self.storms.look(r.t)
            if code in ("DONE", "STOPPED"):
                return code.lower()
            if code == "NEEDS_ROOT":
                self.find_root()
            elif code != "PAUSED":
                self.fail(code)
            elif self.chattering:
                raise SimulationError(self.chattering)
            elif self.records.size > MOST_BYTES:
                self.fail_full()
            self.report()

    def find_root(self) -> None:
        """The next root of the relations that curve in time."""
        r = self.run_
        if r.curved_held:
            self.hybrid.scanned = None
            self.hybrid.origin, self.hybrid.ticked = r.kept["origin"][: r.n_ticks], r.kept["ticked"][: r.n_ticks]
        r.curved_next = self.hybrid.next_curved_root(r.t, self.x)
        r.rescan = 0
        self.library.find_goal(ctypes.byref(r))

    def report(self) -> None:
        if (now := time.perf_counter()) - self.shown_at < LOOK:
            return
        self.shown_at = now
        share = (self.run_.t - self.options.start) / self.options.span
        if self.progress is not None:
            self.progress(share)
        if self.promotion.look(now - self.begun, share, self.evaluators):
            self.set_addresses()

    @property
    def x(self) -> np.ndarray:
        """States where the loop stands."""
        return self.run_.kept["x"][: self.run_.n].copy()

    def drain(self) -> None:
        """Take what was recorded, and look whether a choice chatters."""
        block = self.records.drain()
        if block is None:
            return
        if self.run_.steps >= self.chatter_at:
            self.chatter_at *= 2
            left = self.options.stop - self.run_.t
            self.chattering = self.chattering or self.chatter.look(*self.records.last(ROWS), left)

    # -- failures --------------------------------------------------------------------------------

    def fail(self, code: str) -> None:
        """Raise in the circuit's words what the loop came back with."""
        r, t, x = self.run_, self.run_.t, self.x
        hybrid, bits = self.hybrid, self.system.bits
        if code == "FAILED":
            hybrid.raise_failures(t, x, [r.culprit])
        if code == "UNSETTLED":
            hybrid.raise_unsettled(bits.names[r.culprit])
        if code == "RESTLESS":
            raise SimulationError("the relations do not settle")
        if code == "ENDLESS":
            hybrid.raise_endless(self.last_events(6))
        if code == "ZENO":
            times = r.kept["recent"].reshape(r.n_events, -1)[r.culprit]
            hybrid.raise_zeno(self.system.events[r.culprit].name, t - float(times.min()))
        self.diagnosis.functions.h, self.diagnosis.functions.b = hybrid.h, hybrid.b
        if code == "NOT_FINITE":
            when = "after an event" if r.events + r.ticks else ""
            self.diagnosis.check_finite(t, x, x, when)
            self.diagnosis.check_held(t, hybrid.h, self.last_events(1))
            self.diagnosis.check_finite(t, x, self.diagnosis.functions.rhs(t, x), "" if r.steps else "at the start")
        if code == "IMPOSSIBLE":
            self.keep_possible()
        if code == "IMPOSSIBLE_HELD":
            self.limits.check(t, x, hybrid.h)
        self.diagnosis.check_finite(t, x, self.diagnosis.functions.rhs(t, x))
        reason = self.chatter.look(*self.records.last(ROWS)) or self.diagnosis.blame(t, x)
        raise SimulationError(f"no step is small enough; {reason}")

    def fail_full(self) -> NoReturn:
        """End a run whose records have grown too large."""
        limited = self.run_.kept["limited"][: self.run_.n]
        most = f", most of them limited by {self.system.state_names[int(np.argmax(limited))]}," if limited.any() else ""
        advice = "take an implicit solver (--solver rodas)" if self.options.solver == "dopri" else "take a larger rtol"
        raise SimulationError(
            f"its {self.run_.steps} steps{most} fill {self.records.size / 1e9:.1f} GB; "
            f"{advice}, or simulate a shorter time"
        )

    def last_events(self, count: int) -> list[str]:
        """Names of the last events, each once."""
        return list(dict.fromkeys(self.system.events[k].name for k in self.records.events()[-count:]))

    def keep_possible(self) -> None:
        """End the run at the last instant of its last step at which all pressures were possible, and say why."""
        steps = self.records.pieces()
        last = np.array([steps.low.size - 1])
        low, high = float(steps.low[-1]), float(steps.high[-1])
        failure: SimulationError | None = None
        a, b = low, high
        for _ in range(60):
            middle = (a + b) / 2
            try:
                self.limits.check(middle, steps.at(last, np.array([middle]))[0], self.hybrid.h)
                a = middle
            except SimulationError:
                b = middle
        try:
            self.limits.check(high, self.x, self.hybrid.h)
        except SimulationError as problem:
            failure = problem
        self.run_.t = a
        self.records.shorten(a, steps.at(last, np.array([a]))[0])
        assert failure is not None
        raise failure


def _room(size: int) -> np.ndarray:
    """Zeros, at least one, so that they have an address."""
    return np.zeros(max(int(size), 1))


def _real(values: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(values, dtype=float) if np.size(values) else np.zeros(1)


def _whole(values: object) -> np.ndarray:
    array = np.asarray(values).astype(np.int64)
    return np.ascontiguousarray(array) if array.size else np.zeros(1, np.int64)
