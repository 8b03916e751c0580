"""One revolution of the crescent pump, all solvers, against the same run over a C build of its functions.

    python benchmarks/pump.py [--rounds 3]

Prints what a run costs (wall time of the integration, evaluations, events, restarts), how far its delivery pressure
is from a tight reference, and the ratio to the same integration over compiled functions. The runs of a ratio are
interleaved, for a machine's speed drifts; quote ratios, not seconds. Needs a C compiler for the ratios only.
"""

from __future__ import annotations

import argparse
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import casadi as ca
import chains
import numpy as np

import crescentlab as cl
from crescentlab.assembly import assemble
from crescentlab.causality import plan
from crescentlab.circuit import Circuit
from crescentlab.elaborate import elaborate
from crescentlab.graph import build
from crescentlab.library import installed
from crescentlab.netlist import Netlist
from crescentlab.prepared import Prepared
from crescentlab.system import System

SOLVERS = ("lsoda", "rk45", "dop853", "bdf", "radau", "cvode")
REVOLUTION = "30 ms"
GRID = 1e-5
FUNCTIONS = ("rhs", "jacobian", "relation", "condition", "remap")


def assembly_seconds(netlist: Netlist) -> float:
    """Best of three: netlist to assembled system with right-hand side and Jacobian expressions."""
    library = installed()
    found = []
    for _ in range(3):
        begun = time.perf_counter()
        assemble(plan(build(elaborate(netlist, library)), library))
        found.append(time.perf_counter() - begun)
    return min(found)


def compiled(circuit: Circuit, folder: Path) -> Circuit | None:
    """The same circuit with its functions replaced by a bare C build; None without a compiler."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        return None
    other = cl.load("crescent_pump")
    system: System = other.system()
    generator = ca.CodeGenerator("pump.c")
    for name in FUNCTIONS:
        generator.add(getattr(system, name).function)
    generator.generate(f"{folder}/")
    library = folder / "pump.so"
    subprocess.run([compiler, "-O3", "-shared", "-fPIC", str(folder / "pump.c"), "-o", str(library), "-lm"], check=True)
    for name in FUNCTIONS:
        prepared = getattr(system, name)
        bare = ca.external(prepared.function.name(), str(library))
        vars(system)[name] = Prepared(bare, prepared.parameters)
    return other


def run(circuit: Circuit, solver: str, rtol: float) -> tuple[float, np.ndarray, object]:
    """Wall time of the integration, delivery pressure on the grid, statistics."""
    result = circuit.simulate(stop=REVOLUTION, solver=solver, rtol=rtol, output_step=GRID)
    return result.trajectory.statistics.wall_s, result["delivery.p"], result.trajectory.statistics


def seconds(command: list[str]) -> float:
    """Wall time of a process."""
    begun = time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - begun


def start_up(rounds: int) -> None:
    """Start-up of the command line beside a bare import of numpy, interleaved."""
    python = sys.executable
    commands = {
        "import numpy": [python, "-c", "import numpy"],
        "crescentlab --help": [python, "-m", "crescentlab", "--help"],
        "crescentlab check crescent_pump": [python, "-m", "crescentlab", "check", "crescent_pump"],
    }
    times: dict[str, list[float]] = {name: [] for name in commands}
    for _ in range(2 * rounds + 1):
        for name, command in commands.items():
            times[name].append(seconds(command))
    numpy = times["import numpy"]
    print("\nstart-up                           median s   ratio to import numpy")
    for name, found in times.items():
        ratio = statistics.median(a / b for a, b in zip(found, numpy, strict=True))
        print(f"{name:32s} {statistics.median(found):10.3f} {ratio:10.2f}")


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=3, help="interleaved runs of each solver")
    rounds = parser.parse_args().rounds

    pump = cl.load("crescent_pump")
    print(f"assembly of crescent_pump          {assembly_seconds(pump.netlist):.3f} s")
    print(f"assembly of 1000 orifices, volumes {assembly_seconds(chains.netlist('chain', 1000)):.3f} s")

    system = pump.system()
    print(
        f"states {system.x.numel()}, held {system.h.numel()}, relations {system.b.numel()}; instructions of f "
        f"{system.rhs.function.n_instructions()}, Jacobian nonzeros {system.jacobian_expression.nnz()}"
    )
    reference = run(pump, "dop853", 1e-10)[1]
    with tempfile.TemporaryDirectory() as folder:
        bare = compiled(pump, Path(folder))
        print(f"\none revolution ({REVOLUTION}) at 2000 rpm, 3 bar, rtol 1e-6; error of delivery.p against rtol 1e-10")
        print("solver      wall s     error   steps   f evals  events  ticks  restarts   ratio to C functions")
        for solver in SOLVERS:
            pairs = []
            for _ in range(rounds):
                mine = run(pump, solver, 1e-6)
                theirs = run(bare, solver, 1e-6)[0] if bare else float("nan")
                pairs.append((mine[0], theirs))
            count = mine[2]
            error = float(np.max(np.abs(mine[1] - reference)) / np.mean(reference))
            ratio = statistics.median(a / b for a, b in pairs)
            print(
                f"{solver:8s} {statistics.median(a for a, _ in pairs):9.3f} {error:9.1e} {count.steps:7d} "
                f"{count.evaluations:9d} "
                f"{count.events:7d} {count.ticks:6d} {count.restarts:9d} {ratio:12.2f}"
            )
    start_up(rounds)


if __name__ == "__main__":
    main()
