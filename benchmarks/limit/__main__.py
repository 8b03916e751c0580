"""What a revolution costs at best: ``python benchmarks/limit [--rounds 15] [--plain]``.

Compares the flat equations with the circuit, term by term and as delivery pressures over ten revolutions, and prints
milliseconds per revolution (mean of the first ten from the circuit's start), counts, error and the share of each part
at four operating points: the median of the wall times, and the least processor time, which other work on the machine
disturbs less. ``--plain`` builds for any machine instead of this one.
"""

from __future__ import annotations

import argparse
import statistics
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from limit.driver import FLAGS, PLAIN, TOLERANCES, Build, Outcome
from limit.equal import difference, order, terms

POINTS = (
    ("2000 rpm, 3 bar", "2000 rpm", None),
    ("4000 rpm, 6 bar", "4000 rpm", "37.17 mm^2"),
    ("2000 rpm, closed", "2000 rpm", "0 mm^2"),
    ("4000 rpm, closed", "4000 rpm", "0 mm^2"),
)
"""Title, speed, throttle area. 37.17 mm^2 was found by halving 25 ... 50 mm^2 until the mean delivery pressure of the
tenth revolution was 6.000 bar."""
REVOLUTIONS = 10
TIGHT = 1e-7


def reference(build: Build, speed: str, area: str | None) -> np.ndarray:
    """Delivery pressure of the circuit itself at a tight tolerance."""
    seconds = REVOLUTIONS * 2 * np.pi / build.point(speed, area)[0][0]
    parameters = {"speed": speed} | ({} if area is None else {"throttle_area": area})
    result = build.circuit.simulate(stop=seconds, solver="dop853", rtol=1e-9, output_step=1e-5, parameters=parameters)
    return np.asarray(result["delivery.p"])


def shares(build: Build, method: str, outcome: Outcome) -> str:
    """Share of each part in the run's time."""
    cost, count, ns = build.costs(), outcome.counts, 1e9 * outcome.processor
    stages = count["clocks"] - count["stops"] - count["ticks"] - count["roots"]
    parts = {
        "f": count["f"] * cost["f"], "f and J": count["J"] * cost["f+J"],
        "volumes, waves": stages * cost[f"clock of {method}"] + (count["clocks"] - stages) * cost["clock of rodas"],
        "LU": count["lu"] * cost["lu"] + count["solves"] * cost["solve"], "ticks": count["ticks"] * cost["tick"],
    }  # fmt: skip
    parts["stages, control, events"] = ns - sum(parts.values())
    return ", ".join(f"{name} {100 * part / ns:.0f} %" for name, part in parts.items() if part)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=15, help="runs of each")
    parser.add_argument("--plain", action="store_true", help="build for any machine, not for this one")
    options = parser.parse_args()
    build = Build(PLAIN if options.plain else FLAGS)

    found = terms(build, "2000 rpm", None)
    print("against the circuit's functions: " + ", ".join(f"{name} {value:.0e}" for name, value in found.items()))
    print("operating point    method   rtol   ms/rev    cpu     error   steps  rejected  redone  events  ticks  roots")
    for title, speed, area in POINTS:
        exact = reference(build, speed, area)
        for method, rtol in TOLERANCES.items():
            tight = build.run(REVOLUTIONS, TIGHT, method, speed, area)
            far = difference(tight.delivery, exact)
            if not far < 1e-4:
                raise AssertionError(f"{title}, {method}: {far:.1e} from the circuit's delivery pressure")
            runs = [build.run(REVOLUTIONS, rtol, method, speed, area) for _ in range(options.rounds)]
            times = [1e3 * outcome.seconds / REVOLUTIONS for outcome in runs]
            last = min(runs, key=lambda outcome: outcome.processor)
            cpu = 1e3 * last.processor / REVOLUTIONS
            count = {name: n / REVOLUTIONS for name, n in last.counts.items()}
            print(
                f"{title:17s}  {method}  {rtol:.0e} {statistics.median(times):8.2f} {cpu:6.2f} "
                f"{difference(last.delivery, exact):9.1e} {count['steps']:7.0f} {count['rejected']:9.0f} "
                f"{count['redone']:7.0f} {count['events']:7.0f} {count['ticks']:6.0f} {count['roots']:6.0f}"
            )
            print(
                f"    at rtol {TIGHT:.0e}: {far:.1e}; order {order(build, method):.2f}; {shares(build, method, last)}"
            )
    print("nanoseconds: " + ", ".join(f"{name} {value:.0f}" for name, value in build.costs().items()))


if __name__ == "__main__":
    main()
