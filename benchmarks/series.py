"""What the series and the ledgers of a run take, by numpy and by CasADi, beside the run itself.

    python benchmarks/series.py [--rounds 5] [--circuits crescent_pump,crescent_pump_run_up]

All variables at all accepted steps, and both ledgers, each by numpy block by block and by CasADi point by point, in
interleaved rounds; their largest difference, as a share of each variable's largest value, stands beside. Quote ratios.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable
from unittest.mock import patch

import numpy as np

import crescentlab as cl
from crescentlab import columns
from crescentlab.result import Result


def everything(result: Result) -> dict[str, np.ndarray]:
    """All series of a run, found anew."""
    again = Result(result.system, result.values, result.design, result.trajectory)
    return again.columns()


def ledgers(result: Result) -> None:
    """Both ledgers of a run, found anew."""
    assert Result(result.system, result.values, result.design, result.trajectory).balance is not None


def timed(work: Callable[[Result], object], result: Result, few: float) -> float:
    """Seconds of one evaluation; CasADi evaluates below ``few`` points."""
    with patch.object(columns, "FEW", few):
        begun = time.perf_counter()
        work(result)
        return time.perf_counter() - begun


def difference(result: Result) -> float:
    """Largest difference of the series by either way."""
    with patch.object(columns, "FEW", np.inf):
        known = everything(result)
    found = everything(result)
    return max(
        float(np.nanmax(np.abs(found[n] - known[n]), initial=0) / max(np.abs(known[n]).max(), 1e-300)) for n in known
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5, help="interleaved evaluations of each")
    parser.add_argument("--circuits", default="crescent_pump,crescent_pump_run_up", help="shipped circuits or files")
    arguments = parser.parse_args()
    print("circuit               run s   rows  series: numpy  CasADi  ratio  differ   ledgers: numpy  CasADi  ratio")
    for name in arguments.circuits.split(","):
        circuit = cl.load(name)
        circuit.simulate()  # what is compiled beside a first run is there in the second
        begun = time.perf_counter()
        result = circuit.simulate()
        run = time.perf_counter() - begun
        times: dict[tuple[str, float], list[float]] = {}
        for _ in range(arguments.rounds):
            for work in (everything, ledgers):
                for few in (0.0, np.inf):
                    times.setdefault((work.__name__, few), []).append(timed(work, result, few))
        best = {key: statistics.median(found) for key, found in times.items()}
        fast, slow = best["everything", 0.0], best["everything", np.inf]
        quick, long = best["ledgers", 0.0], best["ledgers", np.inf]
        print(
            f"{name:20s} {run:6.2f} {result.time.size:6d} {fast:14.2f} {slow:7.2f} {slow / fast:6.1f} "
            f"{difference(result):7.0e} {quick:15.2f} {long:7.2f} {long / quick:6.1f}"
        )


if __name__ == "__main__":
    main()
