"""The compiled loop driven from Python: prepares what it reads, empties what it records, tells what it fails on.

Stepping, error control, roots, remaps and ticks are C (``c/*.c``); Python is called back between blocks of steps only.
"""

from __future__ import annotations

import ctypes
import itertools
import time
from collections.abc import Callable

import numpy as np

from crescentlab import units
from crescentlab.errors import CompilerError, SimulationError
from crescentlab.prepared import Evaluator
from crescentlab.solvers import native
from crescentlab.solvers.diagnosis import Diagnosis
from crescentlab.solvers.elimination import elimination
from crescentlab.solvers.functions import Functions
from crescentlab.solvers.hybrid import ZENO_SPAN, Hybrid
from crescentlab.solvers.limits import PressureLimits
from crescentlab.solvers.options import ANGLE_STEP, RESTART_SHARE, Options
from crescentlab.solvers.pace import CLOCK_SWING, clock_pace
from crescentlab.solvers.promotion import Promotion
from crescentlab.solvers.roots import waves
from crescentlab.solvers.trajectory import Happening, Polynomials, Rows, Statistics, Trajectory
from crescentlab.system import System, Values

LOOK = 0.1
"""Seconds between two signs of progress."""
BLOCK = 1000
"""Most steps between two looks of Python, which shows progress and hears an interruption."""
FIELDS = {
    "rhs": "rhs", "linear": "linear", "relation": "relation", "relation_on_state": "watch", "condition": "condition",
    "remap": "remap", "remap_ticks": "remap_ticks", "remap_events": "remap_events",
}  # fmt: skip
"""Functions of the system, and the field of the loop's structure that calls each."""
OUTPUTS = {
    "rhs": ("fx",), "linear": ("lin_f", "jacobian", "lin_t"), "relation": ("g", "g_rate", "g_scale"),
    "relation_on_state": ("w", "w_rate", "w_scale"), "condition": ("conditions",),
}  # fmt: skip
"""Fields of their outputs; remaps write new_x and new_h."""
SAVING = 0.6
"""Share of a run that compiled functions save."""
COMMON = ("rhs", "relation", "relation_on_state", "condition", "remap", "remap_ticks", "remap_events")
FUNCTIONS = {"rodas": (*COMMON, "linear"), "dopri": COMMON}
"""Functions of the system that each method calls."""


def integrate(
    system: System, values: Values, options: Options, progress: Callable[[float], None] | None = None
) -> Trajectory:
    """Run the system; failures and interruptions end up in the trajectory's status, nothing is lost.

    Raises :class:`CompilerError` where the loop cannot be built.
    """
    return _CompiledRun(system, values, options, progress).run()


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
        self.promotion = Promotion(system, FUNCTIONS[options.solver], options.compile, SAVING)
        self.warnings += [notice] if (notice := self.promotion.before()) else []
        self.hybrid = Hybrid(system, values, options.start, options.stop)
        self.atol = options.rtol * system.nominal
        self.diagnosis = Diagnosis(Functions(system, values), options.rtol, self.atol)
        self.limits = PressureLimits(system)
        self.tension: str | None = None
        self.blocks: list[dict[str, np.ndarray]] = []
        self.run_ = native.Run()
        self.set_sizes()
        self.set_functions()
        self.set_relations_and_events()
        self.set_task()
        self.set_scratch()
        self.set_records()

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
        r.give(new_x=new[0], new_h=new[1])
        self.fields = dict(FIELDS)
        if self.options.solver != "rodas":
            self.fields.pop("linear")
        if not system.events:
            self.fields = {name: field for name, field in self.fields.items() if not name.startswith("remap")}
        more = {
            "relation": [v],
            "relation_on_state": [v],
            "remap": [flags],
            "remap_ticks": [flags],
            "remap_events": [flags],
        }
        for name in self.fields:
            outputs = new if name.startswith("remap") else None
            evaluator = Evaluator(self.promotion.take(name), p, [t, x, h, b, *more.get(name, [])], outputs)
            self.evaluators[name] = [evaluator]
            r.give(**dict(zip(OUTPUTS.get(name, ()), evaluator.outputs, strict=False)))
        self.set_addresses()

    def set_addresses(self) -> None:
        """Tell the loop where its functions are."""
        for name, field in self.fields.items():
            setattr(self.run_, field, native.address_of(self.evaluators[name][0].buffer))

    def set_relations_and_events(self) -> None:
        r, hybrid, system = self.run_, self.hybrid, self.system
        kinds = [native.KINDS[event.kind.upper()] for event in system.events]
        r.give(
            strict=_whole(system.bits.strict), watched=_whole(hybrid.watched),
            wave=_whole(np.isin(hybrid.watched, waves(system))), time_linear=_whole(hybrid.linear),
            rising=_whole(hybrid.rising), ticking=_whole(hybrid.ticking), kind=_whole(kinds),
            holds=_whole(np.zeros(r.n_conditions)), period=_real(hybrid.periods), ticked=_whole(np.zeros(r.n_ticks)),
            due=_whole(np.zeros(r.n_ticks)), first_step=_room(r.n_events),
            recent=_room(r.n_events * native.LIMITS["ZENO_COUNT"]), fired=_whole(np.zeros(r.n_events)),
        )  # fmt: skip
        r.curved = hybrid.curved.size
        r.curved_held = int(bool(r.curved) and bool(system.bits.held_dependent[hybrid.curved].any()))
        r.curved_next = self.options.start
        r.zeno_span = ZENO_SPAN * self.options.span
        r.last_event = -1

    def set_task(self) -> None:
        r, o = self.run_, self.options
        r.method = native.METHODS[o.solver]
        r.start, r.stop, r.rtol, r.step_cap = o.start, o.stop, o.rtol, o.step_cap
        r.angle_step, r.clock_swing, r.restart_share = ANGLE_STEP, CLOCK_SWING, RESTART_SHARE
        r.tolerance = self.hybrid.time_tolerance
        r.t = o.start
        pace = clock_pace(self.system, self.values, o.start, o.stop)
        if pace is not None:
            r.n_pace = pace[0].size
            r.give(pace_t=_real(pace[0]), pace_s=_real(pace[1]))
        _, floor, _, tension = self.limits.states
        floor = floor.copy()
        floor[self.limits.states[0][np.array(tension, bool)]] = -np.inf  # warned of, not ended
        r.give(atol=_real(self.atol), floor=_real(floor), held_floor=_real(self.limits.held[1]))

    def set_scratch(self) -> None:
        r, n = self.run_, self.run_.n
        stages, degree = native.SHAPES[self.options.solver]
        x = _room(n)
        x[:n] = self.values.x0
        r.give(x=x, rate=_room(n), x_new=_room(n), rate_new=_room(n), work=_room(n), lu_work=_room(n), inverse=_room(n))
        r.give(coef=_room((degree + 1) * n), stages=_room(stages * n))
        for name in ("side", "before", "slope", "slope_last", "after", "slope_new", "band"):
            r.give(**{name: _room(r.n_watched)})
        r.give(want=_room(r.n_bits), seen=np.zeros(native.LIMITS["MAX_SETTLING"] * r.n_bits + 1, np.uint8))
        if self.options.solver == "rodas" and n:
            found = elimination(self.diagnosis.functions.pattern)
            r.give(
                row=_whole(found.row), column=_whole(found.column), diagonal=_whole(found.diagonal),
                place=_whole(found.place), order=_whole(found.order), lu=_room(found.column.size),
            )  # fmt: skip
            r.nonzeros = found.place.size

    def set_records(self) -> None:
        r = self.run_
        size = native.SHAPES[self.options.solver][1] + 1
        width = 8 * ((size + 1) * r.n + 2 * (r.n_held + r.n_bits) + 8)
        rows = self.rows_max = max(16, min(2 * BLOCK, native.ROWS_BYTES // width))
        logs = 2 * native.LIMITS["MAX_ROUNDS"] * (r.n_events + 1) + rows
        self.records = {
            "row_t": np.zeros(rows), "row_x": np.zeros((rows, r.n)), "row_jump": np.zeros(rows, np.int64),
            "row_world": np.zeros(rows, np.int64), "piece_low": np.zeros(rows), "piece_high": np.zeros(rows),
            "piece_coef": np.zeros((rows, size, r.n)), "piece_world": np.zeros(rows, np.int64),
            "world_h": np.zeros((2 * rows, r.n_held)), "world_b": np.zeros((2 * rows, r.n_bits)),
            "log_t": np.zeros(logs), "log_event": np.zeros(logs, np.int64),
        }  # fmt: skip
        r.rows_max, r.logs_max = rows, logs
        r.give(**self.records)

    # -- the run ---------------------------------------------------------------------------------

    def run(self) -> Trajectory:
        begun = self.begun = self.shown_at = time.perf_counter()
        status, error = "done", ""
        try:
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
        )  # fmt: skip
        steps, pieces = self.rows(), self.pieces()
        functions = "compiled" if self.promotion.compiled else "interpreted"
        return Trajectory(
            steps=steps, grid=self.grid(steps, pieces) if self.options.output_step else None,
            happenings=self.happenings(), statistics=statistics, pieces=pieces,
            solver=f"{self.options.solver} (compiled loop, {functions} functions)",
            status=status, error=error, warnings=self.warnings,
        )  # fmt: skip

    def advance(self) -> str:
        """Call the loop until it is done; the status. Raises what it failed on."""
        r = self.run_
        while True:
            code = native.NAMES[self.library.advance(ctypes.byref(r), BLOCK)]
            self.hybrid.h, self.hybrid.b = r.kept["h"][: r.n_held].copy(), r.kept["b"][: r.n_bits].copy()
            self.drain()
            if code in ("DONE", "STOPPED"):
                return code.lower()
            if code == "NEEDS_ROOT":
                self.find_root()
            elif code != "PAUSED":
                self.fail(code)
            self.report()

    def find_root(self) -> None:
        """The next root of the relations that curve in time."""
        r = self.run_
        if r.curved_held:
            self.hybrid.scanned = None
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
            when = "after an event" if self.blocks and r.events + r.ticks else ""
            self.diagnosis.check_finite(t, x, x, when)
            self.diagnosis.check_held(t, hybrid.h, self.last_events(1))
            self.diagnosis.check_finite(t, x, self.diagnosis.functions.rhs(t, x), "" if r.steps else "at the start")
        if code == "IMPOSSIBLE":
            self.keep_possible()
        if code == "IMPOSSIBLE_HELD":
            self.limits.check(t, x, hybrid.h)
        self.diagnosis.check_finite(t, x, self.diagnosis.functions.rhs(t, x))
        raise SimulationError(f"no step is small enough; {self.diagnosis.blame(t, x)}")

    def last_events(self, count: int) -> list[str]:
        """Names of the last events, each once."""
        fired = np.concatenate([block["log_event"] for block in self.blocks])[-count:]
        return list(dict.fromkeys(self.system.events[k].name for k in fired.tolist()))

    def keep_possible(self) -> None:
        """End the run at the last instant of its last step at which all pressures were possible, and say why."""
        block, steps = self.blocks[-1], self.pieces()
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
        block["piece_high"][-1] = block["row_t"][-1] = self.run_.t = a
        block["row_x"][-1] = steps.at(last, np.array([a]))[0]
        assert failure is not None
        raise failure

    # -- what the loop recorded ------------------------------------------------------------------

    def drain(self) -> None:
        """Take what was recorded; the loop begins anew with empty records."""
        r = self.run_
        counts = {"row": r.rows, "piece": r.pieces, "world": r.worlds, "log": r.logs}
        if not r.rows and not r.logs:
            return
        block = {name: array[: counts[name.partition("_")[0]]].copy() for name, array in self.records.items()}
        low, high = block["piece_low"], block["piece_high"]
        block["piece_length"] = high - low
        self.blocks.append(block)
        r.rows = r.pieces = r.worlds = r.logs = 0
        if not self.tension and any(self.limits.states[3]):
            self.warn(block)

    def warn(self, block: dict[str, np.ndarray]) -> None:
        """The first pressure under tension where the fluid allows it."""
        below = np.flatnonzero((block["row_x"] < self.limits.states[1]).any(axis=1))
        if below.size:
            k = int(below[0])
            warning = self.limits.look(float(block["row_t"][k]), block["row_x"][k], *self.limits.states)
            self.tension = warning
            self.warnings += [warning] if warning else []

    def joined(self, name: str) -> np.ndarray:
        return np.concatenate([block[name] for block in self.blocks])

    def of_world(self, of: str, kind: str) -> np.ndarray:
        return np.concatenate([block[kind][block[of]] for block in self.blocks])

    def rows(self) -> Rows:
        """Accepted steps and events."""
        if not self.blocks:
            v = self.values
            return Rows(
                np.array([self.options.start]), v.x0[None], v.h0[None], np.zeros((1, self.run_.n_bits)), _whole([])[:0]
            )
        return Rows(
            self.joined("row_t"), self.joined("row_x"), self.of_world("row_world", "world_h"),
            self.of_world("row_world", "world_b"), np.flatnonzero(self.joined("row_jump")),
        )  # fmt: skip

    def pieces(self) -> Polynomials:
        """The polynomials of the accepted steps."""
        if not self.blocks:
            r, none = self.run_, np.zeros(0)
            return Polynomials(
                none, none, none, np.zeros((0, 1, r.n)), np.zeros((0, r.n_held)), np.zeros((0, r.n_bits))
            )
        return Polynomials(
            self.joined("piece_low"), self.joined("piece_high"), self.joined("piece_length"),
            self.joined("piece_coef"), self.of_world("piece_world", "world_h"), self.of_world("piece_world", "world_b"),
        )  # fmt: skip

    def happenings(self) -> list[Happening]:
        """Events and ticks by instant."""
        if not self.blocks:
            return []
        names = [event.name for event in self.system.events]
        pairs = zip(self.joined("log_t").tolist(), self.joined("log_event").tolist(), strict=True)
        return [
            Happening(t, tuple(names[k] for _, k in group)) for t, group in itertools.groupby(pairs, key=lambda p: p[0])
        ]

    def grid(self, steps: Rows, pieces: Polynomials) -> Rows:
        """The uniform output grid, the end of the run its last row; at an event the values after it."""
        o, end = self.options, float(steps.t[-1])
        assert o.output_step is not None
        times = o.start + o.output_step * np.arange(np.floor((end - o.start) / o.output_step * (1 + 1e-12)) + 1)
        times = times[times < end - self.hybrid.time_tolerance]
        if not pieces.low.size:
            times = times[:0]
        inside = np.clip(np.searchsorted(pieces.low, times + self.hybrid.time_tolerance, side="right") - 1, 0, None)
        last = -1
        return Rows(
            np.append(times, end), np.vstack([pieces.at(inside, times), steps.x[last:]]),
            np.vstack([pieces.h[inside], steps.h[last:]]), np.vstack([pieces.b[inside], steps.b[last:]]),
            np.zeros(0, int),
        )  # fmt: skip


def _room(size: int) -> np.ndarray:
    """Zeros, at least one, so that they have an address."""
    return np.zeros(max(int(size), 1))


def _real(values: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(values, dtype=float) if np.size(values) else np.zeros(1)


def _whole(values: object) -> np.ndarray:
    array = np.asarray(values).astype(np.int64)
    return np.ascontiguousarray(array) if array.size else np.zeros(1, np.int64)
