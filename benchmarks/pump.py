"""The crescent pump with all solvers, time beside error, against the limit; and where the time of the fastest goes.

    python benchmarks/pump.py [--revolutions 10] [--rounds 3] [--points 4]

The limit is the same circuit written by hand as flat C with a loop of its own (benchmarks/limit). Times are wall times
of the integration in milliseconds per revolution, from the circuit's start; runs are interleaved, the least of the
rounds counts. Errors are the largest difference of the delivery pressure on a grid of 10 us to a reference at 1e-8,
over its mean. Needs a C compiler.
"""

from __future__ import annotations

import argparse
import ctypes
import os
import tempfile
import timeit
from collections.abc import Callable
from typing import Any

import numpy as np
from limit import run as limit_run

import crescentlab as cl
from crescentlab.result import Result
from crescentlab.solvers import native
from crescentlab.solvers.compiled import _CompiledRun
from crescentlab.solvers.integrate import integrate
from crescentlab.solvers.options import Options

GRID = 1e-5
POINTS = {
    "2000 rpm, 3 bar": ("2000 rpm", "24.6 mm^2"), "4000 rpm, 6 bar": ("4000 rpm", "37.17 mm^2"),
    "2000 rpm, throttle closed": ("2000 rpm", "0 mm^2"), "4000 rpm, throttle closed": ("4000 rpm", "0 mm^2"),
}  # fmt: skip
RUNS = (
    ("rodas", 1e-3, True), ("rodas", 1e-3, False), ("dopri", 1e-4, True), ("dopri", 1e-4, False), ("auto", 1e-4, None),
    ("lsoda", 1e-4, False), ("rk45", 1e-4, False), ("dop853", 1e-4, False), ("bdf", 1e-4, False),
    ("radau", 1e-4, False), ("cvode", 1e-4, False), ("rk45", 1e-4, True),
)  # fmt: skip
"""Solver, relative tolerance, whether its functions are compiled."""


class Pump:
    """The circuit at one operating point."""

    def __init__(self, speed: str, area: str, revolutions: int) -> None:
        circuit = cl.load("crescent_pump")
        self.settings = {"speed": speed, "throttle_area": area}
        self.design = circuit.design(self.settings)
        self.system = circuit.system(self.settings)
        self.values = self.system.values(self.design)
        self.revolutions = revolutions
        self.stop = revolutions * 60 / float(speed.split()[0])

    def options(self, solver: str, rtol: float, compile: bool | None) -> Options:
        """What a run is asked for."""
        return Options(stop=self.stop, solver=solver, rtol=rtol, compile=compile, output_step=GRID)

    def run(self, solver: str, rtol: float, compile: bool | None) -> tuple[float, np.ndarray, Any]:
        """Milliseconds per revolution, delivery pressure on the grid, trajectory."""
        trajectory = integrate(self.system, self.values, self.options(solver, rtol, compile))
        assert trajectory.complete, f"{solver} {rtol}: {trajectory.error}"
        result = Result(self.system, self.values, self.design, trajectory)
        return 1e3 * trajectory.statistics.wall_s / self.revolutions, result["delivery.p"], trajectory

    def limit(self, method: str, rtol: float) -> tuple[float, np.ndarray]:
        """The same of the flat C."""
        found = limit_run(self.revolutions, rtol, method, **self.settings)
        return 1e3 * found.seconds / self.revolutions, found.delivery


def error(pressure: np.ndarray, exact: np.ndarray) -> float:
    """Largest difference over the mean."""
    n = min(pressure.size, exact.size)
    return float(np.max(np.abs(pressure[:n] - exact[:n])) / np.mean(exact))


def table(name: str, pump: Pump, rounds: int) -> None:
    """All solvers at one point, interleaved."""
    exact = pump.run("dopri", 1e-8, True)[1]
    print(f"\n{name}: limit and circuit at 1e-7 differ by {error(pump.limit('rodas', 1e-7)[1], exact):.1e}")
    limits = {("limit, rodas", 1e-3): ("rodas", 1e-3), ("limit, dopri", 1e-4): ("dopri", 1e-4)}
    best: dict[Any, float] = {}
    shown: dict[Any, tuple[Any, ...]] = {}
    for _ in range(rounds):
        for key, (method, rtol) in limits.items():
            ms, pressure = pump.limit(method, rtol)
            best[key] = min(best.get(key, ms), ms)
            shown[key] = (key[0], rtol, error(pressure, exact), "", "", "", "")
        for solver, rtol, compile in RUNS:
            ms, pressure, done = pump.run(solver, rtol, compile)
            key = (solver, rtol, compile)
            best[key] = min(best.get(key, ms), ms)
            s, n = done.statistics, pump.revolutions
            label = done.solver if solver == "auto" else f"{solver}{', compiled' if compile else ''}"
            counts = (s.steps / n, s.evaluations / n, s.jacobians / n, s.restarts / n)
            shown[key] = (label.partition(" (c")[0], rtol, error(pressure, exact), *[f"{c:.0f}" for c in counts])
    floor = best["limit, rodas", 1e-3]
    print("solver             rtol   ms/rev     error   steps  evals   Jac. restarts   ratio to limit")
    for key, row in shown.items():
        print(
            f"{row[0]:17s} {row[1]:.0e} {best[key]:8.2f} {row[2]:9.1e} {row[3]:>7s} {row[4]:>6s} {row[5]:>6s} "
            f"{row[6]:>8s}{best[key] / floor:12.2f}"
        )


def build_times(pump: Pump) -> None:
    """What a compiler takes, from an empty cache; what it makes serves the rest of the benchmark."""
    os.environ["CRESCENTLAB_CACHE"] = tempfile.mkdtemp()
    begun = timeit.default_timer()
    native.library()
    loop = timeit.default_timer()
    integrate(pump.system, pump.values, Options(stop=1e-5, solver="rodas", compile=True))
    print(f"compiling: the loop {loop - begun:.1f} s, the equations {timeit.default_timer() - loop:.1f} s")


def shares(pump: Pump) -> None:
    """Where the time of compiled rodas goes: each call timed alone, times how often it is made."""
    options = pump.options("rodas", 1e-3, True)
    totals = [_CompiledRun(pump.system, pump.values, options, None).run().statistics.wall_s for _ in range(5)]
    run = _CompiledRun(pump.system, pump.values, options, None)
    s = run.run().statistics
    whole, n = 1e6 * min(totals), pump.revolutions

    def micro(call: Callable[[], object]) -> float:
        return 1e6 * min(timeit.repeat(call, number=1000, repeat=9)) / 1000

    stops = s.events + s.ticks
    calls = {
        "f": ("rhs", s.evaluations), "f, df/dx, df/dt": ("linear", s.jacobians), "ticks": ("remap_ticks", s.ticks),
        "events": ("remap_events", s.events), "relations at stops": ("relation", 2 * s.events + s.ticks),
        "relations at steps": ("relation_on_state", s.steps), "conditions": ("condition", 2 * stops),
    }  # fmt: skip
    costs = {label: count * micro(run.evaluators[name][0].trigger) for label, (name, count) in calls.items()}
    library, given = run.library, run.run_
    idle = micro(library.size_of_run)
    vector = np.zeros(given.n)
    pointer, structure = ctypes.c_void_p(vector.ctypes.data), ctypes.byref(given)
    factorise = micro(lambda: library.factorise(structure, ctypes.c_double(1e5))) - idle
    solve = micro(lambda: library.solve(structure, pointer)) - idle
    costs["linear algebra"] = s.factorisations * (factorise + 6 * solve)
    begun = timeit.default_timer()
    run.records.joined("row_x"), run.records.pieces()
    costs["Python: records to arrays"] = 1e6 * (timeit.default_timer() - begun)
    costs["rest: stages, control, roots, records"] = whole - sum(costs.values())
    print(f"\nwhere the time of compiled rodas goes, {whole / n / 1e3:.2f} ms per revolution")
    for label, cost in costs.items():
        print(f"{label:38s} {cost / n / 1e3:6.2f} ms {100 * cost / whole:5.1f} %")


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--revolutions", type=int, default=10)
    parser.add_argument("--rounds", type=int, default=3, help="interleaved runs of each solver")
    parser.add_argument("--first", type=int, default=1, help="number of the first operating point")
    parser.add_argument("--points", type=int, default=len(POINTS), help="so many operating points")
    options = parser.parse_args()
    chosen = list(POINTS.items())[options.first - 1 :][: options.points]
    pumps = {name: Pump(*settings, options.revolutions) for name, settings in chosen}
    system = next(iter(pumps.values())).system
    print(
        f"states {system.x.numel()}, held {system.h.numel()}, relations {system.b.numel()}; instructions of f "
        f"{system.rhs.function.n_instructions()}, Jacobian nonzeros {system.jacobian_expression.nnz()}"
    )
    build_times(next(iter(pumps.values())))
    for name, pump in pumps.items():
        table(name, pump, options.rounds)
    shares(next(iter(pumps.values())))


if __name__ == "__main__":
    main()
