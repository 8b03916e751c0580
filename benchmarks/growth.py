"""How the cost of a circuit grows with its size: a chain of N orifices and volumes behind a pulsating source.

    python benchmarks/growth.py [--sizes 10,100,1000,10000] [--rounds 3] [--stop 0.02]

Prints, each from fresh processes, the seconds to read the YAML file, the seconds to assemble it (netlist to a system
ready to be integrated: f, its Jacobian, relations, numbers), the memory of both, and what the integration costs per
simulated second, with the exponents of growth from 100 on. Of several rounds, taken in turn, the quickest counts.
Memory is the peak of the process above what Python and all imports take.
"""

from __future__ import annotations

import argparse
import json
import math
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import yaml
from chains import circuit_file

from crescentlab.assembly import assemble
from crescentlab.causality import plan
from crescentlab.elaborate import elaborate
from crescentlab.graph import build
from crescentlab.library import installed
from crescentlab.netlist import Netlist
from crescentlab.solvers.integrate import integrate
from crescentlab.solvers.options import Options

COLUMNS = {
    "reading": "YAML s", "assembly": "assembly s", "assembled": "memory MB", "per_second": "s per s",
    "evaluations": "f evals", "jacobians": "jacobians", "steps": "steps", "run": "with run MB",
    "rodas": "rodas s/s", "rodas_steps": "its steps",
}  # fmt: skip
"""What is measured, and its title."""
FIRST = 100
"""Smallest size that the exponents are fitted to: below it, the cost of tracing each class once rules."""


def peak() -> float:
    """Most memory that this process has held [MB]."""
    status = Path("/proc/self/status")
    if status.exists():  # Linux counts in getrusage what the parent held when it forked
        line = next(line for line in status.read_text().splitlines() if line.startswith("VmHWM"))
        return int(line.split()[1]) / 2**10
    used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return used / 2**20 if sys.platform == "darwin" else used / 2**10


def measure(path: Path, stop: float) -> dict[str, float]:
    """One size, in this process."""
    imports, begun = peak(), time.perf_counter()
    netlist = Netlist.read(path)
    read = time.perf_counter()
    library = installed()  # found once, whatever the size
    ready = time.perf_counter()
    design = elaborate(netlist, library)
    system = assemble(plan(build(design), library))
    for made in ("rhs", "jacobian", "relation", "relation_on_state", "condition"):
        getattr(system, made)
    values = system.values(design)
    assembled = time.perf_counter()
    memory = peak()
    trajectory = integrate(system, values, Options(stop=stop))
    assert trajectory.complete, trajectory.error
    count = trajectory.statistics
    used = peak()
    other = integrate(system, values, Options(stop=stop, solver="rodas", compile=False))
    assert other.complete, other.error
    return {
        "reading": read - begun, "assembly": assembled - ready, "assembled": memory - imports,
        "per_second": count.wall_s / stop, "evaluations": count.evaluations, "jacobians": count.jacobians,
        "steps": count.steps, "run": used - imports, "rodas": other.statistics.wall_s / stop,
        "rodas_steps": other.statistics.steps, "nonzeros": system.jacobian_expression.nnz(),
        "instructions": system.rhs.function.n_instructions(), "imports": imports,
    }  # fmt: skip


def fresh(path: Path, stop: float) -> dict[str, float]:
    """The same in a process of its own."""
    command = [sys.executable, __file__, "--one", str(path), "--stop", str(stop)]
    found: dict[str, float] = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    return found


def exponent(sizes: list[int], costs: list[float]) -> float:
    """Slope of log cost over log size, by least squares."""
    x, y = [math.log(n) for n in sizes], [math.log(c) for c in costs]
    middle_x, middle_y = sum(x) / len(x), sum(y) / len(y)
    rise = sum((a - middle_x) * (b - middle_y) for a, b in zip(x, y, strict=True))
    return rise / sum((a - middle_x) ** 2 for a in x)


def table(rows: dict[int, dict[str, float]]) -> None:
    """Print costs by size, and how they grow."""
    print("     N   " + "  ".join(f"{title:>11s}" for title in COLUMNS.values()))
    for n, row in rows.items():
        shown = [f"{row[key]:11.3f}" if row[key] < 100 else f"{row[key]:11.0f}" for key in COLUMNS]
        print(f"{n:6d}   " + "  ".join(shown))
    for first in (FIRST, 10 * FIRST):
        sizes = [n for n in rows if n >= first]
        if len(sizes) > 1:
            slopes = [exponent(sizes, [rows[n][key] for n in sizes]) for key in COLUMNS]
            print(f"exponent, N from {first}\n         " + "  ".join(f"{slope:11.2f}" for slope in slopes))


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", default="10,100,1000,10000")
    parser.add_argument("--rounds", type=int, default=3, help="fresh processes per size, sizes in turn")
    parser.add_argument("--stop", type=float, default=0.02, help="simulated span [s]; 20 ms are some 600 steps")
    parser.add_argument("--one", type=Path, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one:
        print(json.dumps(measure(arguments.one, arguments.stop)))
        return
    sizes = [int(size) for size in arguments.sizes.split(",")]
    rounds: list[dict[int, dict[str, float]]] = []
    with tempfile.TemporaryDirectory() as folder:
        for n in sizes:
            dumper = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
            text = yaml.dump(circuit_file("chain", n), Dumper=dumper, sort_keys=False, default_flow_style=None)
            Path(folder, f"chain{n}.yaml").write_text(text, encoding="utf-8")
        for _ in range(arguments.rounds):
            rounds.append({n: fresh(Path(folder, f"chain{n}.yaml"), arguments.stop) for n in sizes})
    rows = {n: {key: min(found[n][key] for found in rounds) for key in rounds[0][n]} for n in sizes}
    last = rows[sizes[-1]]
    print(f"libyaml {'present' if yaml.__with_libyaml__ else 'absent'}; Python and imports {last['imports']:.0f} MB")
    print(f"per volume and orifice: instructions of f {last['instructions'] / sizes[-1]:.1f},", end=" ")
    print(f"nonzeros of the Jacobian {last['nonzeros'] / sizes[-1]:.1f}; {arguments.stop:g} s simulated\n")
    table(rows)


if __name__ == "__main__":
    main()
