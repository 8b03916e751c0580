"""Where one matrix layout begins to pay: the figures behind ``--solver auto``.

    python benchmarks/thresholds.py [--sizes 20,50,100,200,400] [--rounds 3]

Integrates chains (narrow after reordering) and square grids (wide) of volumes and orifices, excited by a sine of flow,
with LSODA full, LSODA banded and BDF sparse in turn, and prints times as ratios to the fastest of each row.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Iterator

from crescentlab.circuit import Circuit
from crescentlab.netlist import Netlist
from crescentlab.solvers import scipy as steppers
from crescentlab.solvers.integrate import integrate
from crescentlab.solvers.options import Options

LAYOUTS = {"lsoda full": ("lsoda", "dense"), "lsoda banded": ("lsoda", "banded"), "bdf sparse": ("bdf", "sparse")}


def edges(kind: str, n: int) -> Iterator[tuple[int, int]]:
    """Pairs of volumes that an orifice joins."""
    if kind == "chain":
        yield from ((k, k + 1) for k in range(n - 1))
        return
    side = round(n**0.5)
    for k in range(side * side):
        if k % side < side - 1:
            yield k, k + 1
        if k < side * (side - 1):
            yield k, k + side


def circuit(kind: str, n: int) -> Circuit:
    """n volumes joined by orifices; a pulsating source at the first, a tank behind the last."""
    n = n if kind == "chain" else round(n**0.5) ** 2
    components: dict[str, object] = {
        "tank": {"type": "tank"}, "out": {"type": "orifice", "area": "5 mm^2"},
        "source": {"type": "signal_flow_source"},
        "sine": {"type": "sine", "mean": "10 L/min", "amplitude": "5 L/min", "frequency": "200 Hz"},
    }  # fmt: skip
    nets = {f"n{k}": [f"v{k}.port"] for k in range(n)}
    for k in range(n):
        components[f"v{k}"] = {"type": "capacity", "volume": "20 cm^3", "start": {"p": "5 bar"}}
    for j, (a, b) in enumerate(edges(kind, n)):
        components[f"o{j}"] = {"type": "orifice", "area": "20 mm^2"}
        nets[f"n{a}"].append(f"o{j}.a")
        nets[f"n{b}"].append(f"o{j}.b")
    nets["n0"].append("source.port")
    nets[f"n{n - 1}"].append("out.a")
    nets |= {"flow": ["sine.y", "source.flow"], "drain": ["out.b", "tank.port"]}
    fluid = {"type": "simple_oil", "density": "860 kg/m^3", "kinematic_viscosity": "35 cSt", "bulk_modulus": "1.4 GPa"}
    return Circuit(Netlist.of({"crescentlab": 1, "fluid": fluid, "components": components, "nets": nets}, kind))


def seconds(made: Circuit, layout: tuple[str, str]) -> float:
    """Wall time of 50 ms at rtol 1e-6 with a forced layout."""
    chosen = steppers.choose
    steppers.choose = lambda name, functions: layout
    try:
        begun = time.perf_counter()
        design = made.design()
        system = made.system()
        trajectory = integrate(system, system.values(design), Options(stop=0.05))
        assert trajectory.complete, trajectory.error
        return time.perf_counter() - begun
    finally:
        steppers.choose = chosen


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", default="20,50,100,200,400")
    parser.add_argument("--rounds", type=int, default=3)
    arguments = parser.parse_args()
    print("circuit   states   band   " + "   ".join(LAYOUTS) + "   (ratio to the fastest; seconds of the fastest)")
    for kind in ("chain", "grid"):
        for size in (int(s) for s in arguments.sizes.split(",")):
            made = circuit(kind, size)
            system = made.system()
            pattern = steppers.Functions(system, system.values(made.design())).pattern
            _, lower, upper = steppers.banded(pattern)
            times: dict[str, list[float]] = {name: [] for name in LAYOUTS}
            for _ in range(arguments.rounds):
                for name, layout in LAYOUTS.items():
                    times[name].append(seconds(made, layout))
            medians = {name: statistics.median(found) for name, found in times.items()}
            best = min(medians.values())
            row = "   ".join(f"{m / best:>{len(name)}.2f}" for name, m in medians.items())
            print(f"{kind:8s} {system.x.numel():6d} {lower + upper + 1:6d}   {row}   {best:.3f}")


if __name__ == "__main__":
    main()
