"""Work-precision diagram: error against wall time, all solvers, for the pump and for a stiff circuit.

    python benchmarks/precision.py [--rounds 3] [-o docs/precision.svg]

The pump turns twice at 2000 rpm and 3 bar; the stiff circuit is the row of twenty volumes of 20 cm3 behind a pulsating
source, whose orifices empty a volume in some microseconds. Each solver runs at several tolerances; times are wall times
of the integration, the least of the interleaved rounds; errors are the largest differences on a grid of 2000 points to
dopri or radau at 1e-10, in shares of the mean: of the pump's delivery and suction pressure and that before its
throttle (others jump at events, where a grid point may see either side), of the row's every pressure. Compiled means
--compile.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from chains import netlist

import crescentlab as cl
from crescentlab.circuit import Circuit
from crescentlab.solvers.integrate import integrate
from crescentlab.solvers.options import Options
from crescentlab.system import System, Values

TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
SOLVERS = (
    ("rodas", True), ("rodas", False), ("dopri", True), ("dopri", False), ("lsoda", False), ("bdf", False),
    ("radau", False), ("rk45", False), ("dop853", False), ("cvode", False),
)  # fmt: skip
COLOURS = dict(
    zip(
        ("rodas", "dopri", "lsoda", "bdf", "radau", "rk45", "dop853", "cvode"),
        plt.get_cmap("tab10").colors,
        strict=False,
    )
)
CASES = {
    "Crescent pump, two revolutions at 2000 rpm": (
        lambda: cl.load("crescent_pump"), 0.06, "dopri", ("delivery.p", "suction.p", "line.body.p"),
    ),
    "Row of twenty volumes, stiff, 20 ms": (
        lambda: Circuit(netlist("chain", 20)), 0.02, "radau", tuple(f"v{k}.p" for k in range(20)),
    ),
}  # fmt: skip
"""How it is made, its span [s], what the reference is made by, the states compared."""


def pressures(system: System, values: Values, options: Options, names: tuple[str, ...]) -> tuple[float, np.ndarray]:
    """Wall seconds, and the named states on the grid, (times, states)."""
    done = integrate(system, values, options)
    assert done.complete, done.error
    assert done.grid is not None
    return done.statistics.wall_s, done.grid.x[:, [system.state_names.index(name) for name in names]]


def measure(name: str, rounds: int) -> dict[tuple[str, bool], list[tuple[float, float]]]:
    """Pairs of seconds and error by solver, one for each tolerance."""
    make, stop, exact_by, names = CASES[name]
    circuit = make()
    system, step = circuit.system(), stop / 2000
    values = system.values(circuit.design())
    exact = pressures(system, values, Options(stop=stop, solver=exact_by, rtol=1e-10, output_step=step), names)[1]
    scale = np.mean(np.abs(exact))
    best: dict[tuple[str, bool, float], float] = {}
    errors: dict[tuple[str, bool, float], float] = {}
    for _ in range(rounds):
        for solver, compile in SOLVERS:
            for rtol in TOLERANCES:
                options = Options(stop=stop, solver=solver, rtol=rtol, compile=compile, output_step=step)
                seconds, found = pressures(system, values, options, names)
                key = (solver, compile, rtol)
                best[key] = min(best.get(key, seconds), seconds)
                errors[key] = float(np.max(np.abs(found - exact)) / scale)
    print(f"\n{name}\nsolver" + " " * 12 + "".join(f"{f'rtol {rtol:.0e}':>22s}" for rtol in TOLERANCES))
    for solver, compile in SOLVERS:
        cells = [f"{1e3 * best[solver, compile, r]:9.2f} ms {errors[solver, compile, r]:.1e}" for r in TOLERANCES]
        print(f"{solver + (', compiled' if compile else ''):18s}" + "".join(f"{cell:>22s}" for cell in cells))
    return {
        (solver, compile): [(best[solver, compile, r], errors[solver, compile, r]) for r in TOLERANCES]
        for solver, compile in SOLVERS
    }


def draw(found: dict[str, dict[tuple[str, bool], list[tuple[float, float]]]], path: Path) -> None:
    """The diagrams side by side."""
    figure, axes = plt.subplots(1, len(found), figsize=(11, 5), layout="constrained")
    for ax, (name, curves) in zip(np.atleast_1d(axes), found.items(), strict=True):
        for (solver, compile), pairs in curves.items():
            seconds, errors = zip(*pairs, strict=True)
            style = (
                "-o" if solver in ("rodas", "dopri") and compile else "--o" if solver in ("rodas", "dopri") else "-s"
            )
            label = f"{solver}, compiled" if compile else solver
            ax.loglog(seconds, errors, style, color=COLOURS[solver], label=label, markersize=4, linewidth=1.3)
        ax.set_title(name, fontsize=10)
        ax.set_xlabel("wall time [s]")
        ax.set_ylabel("largest error of the pressures, over their mean [-]")
        ax.grid(True, which="major", color="#d9d9d9", linewidth=0.6)
    np.atleast_1d(axes)[-1].legend(fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
    figure.savefig(path, metadata={"Date": None})


def main() -> None:
    """Measure and draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("-o", "--output", type=Path, help="the picture; none is drawn without it")
    options = parser.parse_args()
    found = {name: measure(name, options.rounds) for name in CASES}
    if options.output:
        draw(found, options.output)


if __name__ == "__main__":
    main()
