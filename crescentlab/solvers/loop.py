"""The event loop: one for all steppers. System + numbers -> :class:`Trajectory`."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

import numpy as np

from crescentlab import units
from crescentlab.errors import SimulationError
from crescentlab.prepared import Evaluator
from crescentlab.solvers.diagnosis import Diagnosis
from crescentlab.solvers.functions import Functions
from crescentlab.solvers.hybrid import Hybrid
from crescentlab.solvers.jumps import ROWS, Chatter
from crescentlab.solvers.limits import PressureLimits
from crescentlab.solvers.options import ANGLE_STEP, RESTART_SHARE, Options
from crescentlab.solvers.pace import CLOCK_SWING, clock_pace
from crescentlab.solvers.promotion import Promotion
from crescentlab.solvers.roots import RootFinder
from crescentlab.solvers.scipy import Stepper
from crescentlab.solvers.snapshot import Snapshot
from crescentlab.solvers.steppers import stepper
from crescentlab.solvers.storms import Storms
from crescentlab.solvers.trajectory import Happening, Paths, Recording, Statistics, Trajectory
from crescentlab.system import System, Values

SMALLEST_STEP = 1e-14
"""Steps below this share of the span, many in a row, are a collapse."""
COLLAPSE_COUNT = 500
MANY_STEPS = 20_000
"""So many steps of SciPy's take longer than building the compiled loop and what it then needs."""
MANY_RESTARTS = 200
"""So many restarts at the lowest order add up: 2000 take 3e-4 off an oscillation's energy at an rtol of 1e-6."""
MEMORY = ("lsoda", "bdf", "cvode")
"""Methods that lose their order as they begin anew."""
FIRST_COUNT = 1000
"""After so many steps, and every time they have doubled, those ahead are counted."""
LOOK = 0.1
"""Seconds between two signs of progress."""
SAVING = 0.3
"""Share of a run that compiled functions save."""


def functions_of(solver: str) -> list[str]:
    """Functions of the system that a run with this solver calls often."""
    explicit = solver in ("rk45", "dop853")
    names = ["rhs", "jacobian", "relation", "relation_on_state", "condition", "remap_ticks", "remap_events"]
    return [name for name in names if not (explicit and name == "jacobian")]


class TooManyStepsError(Exception):
    """The run would take so many steps that the compiled loop should do it."""


def integrate(
    system: System, values: Values, options: Options, progress: Callable[[float], None] | None = None,
    start: Snapshot | None = None, give_up: Callable[[], bool] | None = None,
) -> Trajectory:  # fmt: skip
    """Run the system; failures and interruptions end up in the trajectory's status, nothing is lost.

    With ``give_up``, raises :class:`TooManyStepsError` if more than ``MANY_STEPS`` lie ahead, or the run will have more
    than ``MANY_RESTARTS``, and it says yes.
    """
    run = _Run(system, values, options, progress)
    run.give_up = give_up
    if start is not None:
        run.hybrid.resume(start)
    return run.run()


class _Run:
    def __init__(
        self, system: System, values: Values, options: Options, progress: Callable[[float], None] | None
    ) -> None:
        self.system, self.values, self.options, self.progress = system, values, options, progress
        self.promotion = Promotion(system, functions_of(options.solver), options.compile, SAVING)
        self.warnings = [notice] if (notice := self.promotion.before()) else []
        self.functions = Functions(system, values, self.promotion.take)
        self.hybrid = Hybrid(system, values, options.start, options.stop, self.promotion.take)
        self.roots = RootFinder(self.hybrid)
        self.atol = options.rtol * system.nominal
        self.limits = PressureLimits(system, values.p)
        self.diagnosis = Diagnosis(self.functions, self.limits, options.rtol, self.atol, options.solver)
        self.stepper: Stepper = stepper(options.solver, self.functions, options.rtol, self.atol)
        self.statistics = Statistics()
        self.steps = Recording()
        self.grid = Recording() if options.output_step else None
        self.grid_count = 0
        self.pieces = Paths()
        self.happenings: list[Happening] = []
        self.ticks = {event.name for event in system.events if event.kind == "every"}
        self.angles = [k for k, q in enumerate(system.state_quantities) if q is units.angle]
        self.storms = Storms(system)
        self.chatter = Chatter(system, values.p)
        self.chatter_at = FIRST_COUNT
        self.rate = np.zeros(self.functions.n)
        """dx/dt at the end of the last step."""
        self.step_cap = options.step_cap
        self.pace = clock_pace(system, values, options.start, options.stop)
        self.tiny = 0
        self.shown_at = 0.0
        self.give_up: Callable[[], bool] | None = None
        self.count_at = FIRST_COUNT

    # -- the run ---------------------------------------------------------------------------------

    def run(self) -> Trajectory:
        begun = self.begun = time.perf_counter()
        status, error, end = "done", "", None
        try:
            with np.errstate(all="ignore"):  # what is not finite is told by name, not by a warning
                self.loop()
            status = "stopped" if self.hybrid.finished else status
            end = Snapshot(self.now(), self.steps.x[-1], **self.hybrid.standing)
        except SimulationError as problem:
            status, error = "failed", self.told(str(problem))
        except KeyboardInterrupt:
            status, error = "interrupted", f"interrupted at {self.now():.6g} s; what was computed is kept"
        self.promotion.end()
        s = self.statistics
        s.wall_s = time.perf_counter() - begun
        s.evaluations, s.jacobians = self.functions.evaluations, self.functions.jacobians
        if not self.steps.t:
            self.steps.add(self.options.start, self.values.x0, self.values.h0, np.zeros(self.system.b.numel()))
        if self.grid is not None and not self.grid.t:
            self.grid.add(self.steps.t[0], self.steps.x[0], self.steps.h[0], self.steps.b[0])
        layout = "" if not self.functions.n else f" ({self.stepper.name})"
        if s.restarts > MANY_RESTARTS and self.stepper.name.startswith(MEMORY):
            self.warnings.append(
                f"{self.stepper.name} began anew {s.restarts} times, each time at its lowest order, and the errors "
                "there add up beyond the tolerance: --solver rodas or radau holds it"
            )
        return Trajectory(
            steps=self.steps.done(), grid=self.grid.done() if self.grid else None, happenings=self.happenings,
            statistics=s, solver=self.options.solver + layout, pieces=self.pieces, status=status, error=error,
            end=end, warnings=self.warnings,
        )  # fmt: skip

    def now(self) -> float:
        return self.steps.t[-1] if self.steps.t else self.options.start

    def told(self, problem: str) -> str:
        return f"the run ended at {self.now():.6g} s of {self.options.stop:.6g} s: {problem}"

    def loop(self) -> None:
        o, hybrid = self.options, self.hybrid
        t, x = o.start, self.values.x0.copy()
        self.diagnosis.check_finite(t, x, self.functions.rhs(t, x), "at the start")
        x, names = hybrid.enter(t, x)
        self.sync()
        self.booked(t, names)
        self.record(t, x)
        x = self.started(t, x)
        while t < o.stop and not hybrid.finished:
            goal = min(o.stop, hybrid.next_tick(), hybrid.next_time_root(t, x))
            t, x = self.to_goal(t, x, goal)
            self.report(t)
        if self.grid is not None:
            self.finish_grid(t, x)

    def started(self, t: float, x: np.ndarray) -> np.ndarray:
        """Restart the stepper at (t, x)."""
        rate = self.functions.rhs(t, x)
        self.diagnosis.check_finite(t, x, rate)
        self.stepper.restart(t, x, self.options.stop)
        self.roots.begin(t, x, rate)
        self.rate = rate
        return x

    def sync(self) -> None:
        """Let f see the present held values and bits."""
        self.functions.h, self.functions.b = self.hybrid.h, self.hybrid.b

    def to_goal(self, t: float, x: np.ndarray, goal: float) -> tuple[float, np.ndarray]:
        """Step until the goal or an event in between; handle it; return where we are then."""
        while True:
            bound = min(goal, t + self.cap(t))
            if goal - bound < 1e-9 * (goal - t):
                bound = goal
            self.step(bound)
            low, high, x_high = t, self.stepper.t, self.stepper.x
            self.rate = self.stepper.rate()
            self.check_step(low, high, x_high)
            event = self.roots.first(low, high, x_high, self.rate, self.stepper.interpolant)
            self.check_pressures(low, high if event is None else event, x_high)
            self.fill(low, high if event is None else event)
            if event is not None:
                return self.inside(event, high, x_high, goal)
            if high >= goal - self.hybrid.time_tolerance:
                return self.at_goal(goal, x_high)
            self.record(high, x_high)
            t = high
            self.report(t)

    def cap(self, t: float) -> float:
        """Longest step from here."""
        cap = self.step_cap
        if self.angles and (fastest := max(abs(self.rate[k]) for k in self.angles)) > 0:
            cap = min(cap, ANGLE_STEP / fastest)
        if self.pace is not None:
            times, swung = self.pace
            ahead = float(np.interp(np.interp(t, times, swung) + CLOCK_SWING, swung, times)) - t
            cap = min(cap, ahead) if ahead > 0 else cap
        return cap

    def step(self, bound: float) -> None:
        try:
            self.stepper.step(bound)
        except SimulationError as problem:
            t, x = self.stepper.t, self.stepper.x
            self.diagnosis.check_finite(t, x, self.functions.rhs(t, x))
            raise SimulationError(f"no step is small enough ({problem}); {self.blame(t, x)}") from None
        self.statistics.steps += 1

    def inside(self, t: float, high: float, x_high: np.ndarray, goal: float) -> tuple[float, np.ndarray]:
        """An event inside the last step, at t <= high."""
        path = self.stepper.interpolant()
        x = np.array(path(t)) if t < high else x_high
        x_after, kept = self.handle(t, x, [])
        if kept and t < high:
            kept = self.goes_on(high, x_high)
            if kept and not self.hybrid.finished:
                self.roots.begin(t, x_after, self.functions.rhs(t, x_after))
                event = self.roots.first(t, high, x_high, self.stepper.rate(), self.stepper.interpolant)
                self.fill(t, high if event is None else event)
                if event is not None:
                    return self.inside(event, high, x_high, goal)
                return self.reached(high, x_high, goal)
        if not kept and not self.hybrid.finished and t < self.options.stop:
            self.statistics.restarts += 1
            self.started(t, x_after)
        return t, x_after

    def reached(self, high: float, x_high: np.ndarray, goal: float) -> tuple[float, np.ndarray]:
        """The end of a step with nothing left inside it; what waits at the goal is done if it is the goal."""
        if high >= goal - self.hybrid.time_tolerance:
            return self.at_goal(goal, x_high)
        self.record(high, x_high)
        return high, x_high

    def at_goal(self, t: float, x: np.ndarray) -> tuple[float, np.ndarray]:
        """The goal of the last step: ticks, time events, or the end."""
        due = self.hybrid.due(t)
        x_after, kept = self.handle(t, x, due)
        if not kept and not self.hybrid.finished and t < self.options.stop:
            self.statistics.restarts += 1
            self.started(t, x_after)
        else:
            self.roots.begin(t, x_after, self.stepper.rate())
        return t, x_after

    def handle(self, t: float, x: np.ndarray, due: list[int]) -> tuple[np.ndarray, bool]:
        """Settle and fire at t; record before and after; say whether the stepper may go on as it is."""
        hybrid = self.hybrid
        h, b = hybrid.h, hybrid.b
        self.old_h, self.old_b = h, b
        self.record(t, x)
        x_after, names = hybrid.stop(t, x, due)
        switched = np.flatnonzero(hybrid.b != b)
        changed = x_after is not x or hybrid.h is not h or switched.size > 0
        self.storms.turned(len(self.system.events) + switched, self.statistics.steps)
        self.sync()
        self.booked(t, names)
        if not changed:
            return x, True
        jumped = x_after is not x and not np.array_equal(x_after, x)
        self.diagnosis.check_finite(t, x_after, x_after, "after an event")
        self.diagnosis.check_held(t, hybrid.h, names)
        self.record(t, x_after, jump=True)
        return x_after, not jumped and self.goes_on(t, x_after)

    def goes_on(self, t: float, x: np.ndarray) -> bool:
        """Whether f with the new bits and held values is the old f but for a share of the tolerance."""
        if not self.functions.n:
            return True
        new = self.functions.rhs(t, x)
        old = self.functions.f(t, x, self.old_h, self.old_b)[0]
        allowed = RESTART_SHARE * (self.atol + self.options.rtol * np.abs(x))
        if np.any(np.abs(new - old) * (self.stepper.step_size or 0.0) > allowed):
            return False
        if t == self.stepper.t:
            self.stepper.refresh(new)
        return True

    # -- books -----------------------------------------------------------------------------------

    def booked(self, t: float, names: list[str]) -> None:
        self.storms.turned([self.storms.places[n] for n in names], self.statistics.steps)
        self.warnings += self.storms.look(t)
        if not names:
            return
        events = [n for n in names if n not in self.ticks]
        self.statistics.ticks += len(names) - len(events)
        self.statistics.events += len(events)
        self.happenings.append(Happening(t, tuple(names)))
        self.hybrid.note(t, events)

    def record(self, t: float, x: np.ndarray, *, jump: bool = False) -> None:
        if not jump and self.steps.t and self.steps.t[-1] == t and np.array_equal(self.steps.x[-1], x):
            return
        self.steps.add(t, x, self.hybrid.h, self.hybrid.b, jump=jump)

    def fill(self, low: float, high: float) -> None:
        """Keep what lies inside the smooth piece [low, high]: Gauss nodes, and output points in [low, high)."""
        if high > low:
            self.pieces.add(low, high, self.stepper.path(), self.hybrid.h, self.hybrid.b)
        if self.grid is None:
            return
        assert self.options.output_step is not None
        path = None
        while (
            t := self.options.start + self.grid_count * self.options.output_step
        ) < high - self.hybrid.time_tolerance:
            if t >= low - self.hybrid.time_tolerance:
                path = path or self.stepper.interpolant()
                inside = min(max(t, low), high)
                x = self.steps.x[-1] if inside - low <= self.hybrid.time_tolerance else np.array(path(inside))
                self.grid.add(t, x, self.hybrid.h, self.hybrid.b)
            self.grid_count += 1

    def finish_grid(self, t: float, x: np.ndarray) -> None:
        assert self.grid is not None
        if not self.grid.t or t > self.grid.t[-1] + self.hybrid.time_tolerance:
            self.grid.add(t, x, self.hybrid.h, self.hybrid.b)

    def report(self, t: float) -> None:
        self.check_chatter()
        if self.give_up is not None and self.statistics.steps >= self.count_at:
            self.count_at *= 2
            done = (t - self.options.start) / self.options.span
            long = self.statistics.steps * (1 - done) > MANY_STEPS * done
            if (long or self.statistics.restarts > MANY_RESTARTS * done) and self.give_up():
                self.promotion.end()
                raise TooManyStepsError
        if (now := time.perf_counter()) - self.shown_at < LOOK:
            return
        self.shown_at = now
        share = (t - self.options.start) / self.options.span
        if self.progress is not None:
            self.progress(share)
        self.promotion.look(now - self.begun, share, self.evaluators())

    def evaluators(self) -> dict[str, list[Evaluator]]:
        """What calls the system's functions, by their names."""
        found = {"rhs": [self.functions.f, self.hybrid.f]}
        found |= {name: [evaluator] for name, evaluator in self.hybrid.evaluators().items()}
        if self.functions.uses_jacobian:
            found["jacobian"] = [self.functions.jacobian]
        return found

    # -- checks ----------------------------------------------------------------------------------

    def check_step(self, low: float, high: float, x: np.ndarray) -> None:
        if not math.isfinite(x @ x):
            self.diagnosis.check_finite(high, x, x)
        if high - low < SMALLEST_STEP * self.options.span:
            self.tiny += 1
            if self.tiny > COLLAPSE_COUNT:
                raise SimulationError(f"the step size collapsed to {high - low:.2g} s; {self.blame(high, x)}")
        else:
            self.tiny = 0

    def blame(self, t: float, x: np.ndarray) -> str:
        """What keeps steps from being long enough."""
        return self.chatter.look(*self.last_rows) or self.diagnosis.blame(t, x)

    @property
    def last_rows(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Times, states, held values, bits of the last steps."""
        s = self.steps
        return np.array(s.t[-ROWS:]), np.array(s.x[-ROWS:]), np.array(s.h[-ROWS:]), np.array(s.b[-ROWS:])

    def check_chatter(self) -> None:
        """Look, each time the steps have doubled, whether a choice without an event chatters."""
        if self.statistics.steps >= self.chatter_at:
            self.chatter_at *= 2
            if chatter := self.chatter.look(*self.last_rows, self.options.stop - self.now()):
                raise SimulationError(chatter)

    def check_pressures(self, low: float, end: float, x_high: np.ndarray) -> None:
        """Refuse impossible pressures at the end of a step, or at the event that ends it sooner."""
        x = x_high if end >= self.stepper.t else np.array(self.stepper.interpolant()(end))
        try:
            self.limits.check(end, x, self.hybrid.h)
        except SimulationError:
            self.keep_possible(low, end)
            raise

    def keep_possible(self, low: float, high: float) -> None:
        """Record the last instant of a step at which all pressures were possible."""
        path = self.stepper.interpolant()
        a, b = low, high
        for _ in range(60):
            middle = (a + b) / 2
            try:
                self.limits.check(middle, np.array(path(middle)), self.hybrid.h)
                a = middle
            except SimulationError:
                b = middle
        self.fill(low, a)
        self.record(a, np.array(path(a)))
