"""How long the command line takes to come up, against a bare import of numpy.

    python benchmarks/start_up.py [--rounds 7] [--circuits relief_valve,crescent_pump]

``--help``, ``check`` and ``simulate -o none`` of the smallest shipped circuit (fewest states) and of the largest (most
components), each in a process of its own. Cold is the first run of an installation: none of crescentlab's modules is
compiled to bytecode yet, and no cache of crescentlab's exists. Warm is every later one. Bytecode of the packages below
crescentlab is always there, for pip writes it; the pages of all files are in the system's memory. Rounds are
interleaved: quote ratios, not seconds.
"""

from __future__ import annotations

import argparse
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import crescentlab as cl

BARE = "import numpy"


def commands(circuits: list[str]) -> dict[str, list[str]]:
    """What is timed, by name; ``BARE`` first."""
    found = {BARE: ["-c", BARE], "--help": ["-m", "crescentlab", "--help"]}
    for name in circuits:
        found[f"check {name}"] = ["-m", "crescentlab", "check", name]
        found[f"simulate {name}"] = ["-m", "crescentlab", "simulate", name, "-o", "none", "--quiet"]
    return found


def forget(bytecode: Path) -> None:
    """Remove the bytecode of crescentlab's own modules from a folder of bytecode."""
    own = Path(cl.__file__).resolve().parent
    for folder in (own, own.parent / "components", own.parent / "circuits"):
        shutil.rmtree(bytecode / folder.relative_to(folder.anchor), ignore_errors=True)


def seconds(arguments: list[str], environment: dict[str, str], folder: str) -> float:
    """Wall time of one process."""
    begun = time.perf_counter()
    subprocess.run(
        [sys.executable, *arguments], check=True, env=environment, cwd=folder,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    return time.perf_counter() - begun


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=7, help="interleaved runs of each command, cold and warm")
    parser.add_argument("--circuits", default="relief_valve,crescent_pump", help="shipped circuits or files")
    arguments = parser.parse_args()
    timed = commands([Path(c).resolve().as_posix() if Path(c).is_file() else c for c in arguments.circuits.split(",")])
    cold: dict[str, list[float]] = {name: [] for name in timed}
    warm: dict[str, list[float]] = {name: [] for name in timed}
    with tempfile.TemporaryDirectory() as temporary:
        bytecode, caches, work = (Path(temporary) / name for name in ("bytecode", "caches", "work"))
        work.mkdir()
        environment = {
            **os.environ, "PYTHONPYCACHEPREFIX": str(bytecode), "CRESCENTLAB_CACHE": str(caches),
        }  # fmt: skip
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        for command in timed.values():  # bytecode of everything, and the files' pages in memory
            seconds(command, environment, str(work))
        for _ in range(arguments.rounds):
            for name, command in timed.items():
                forget(bytecode)
                shutil.rmtree(caches, ignore_errors=True)
                cold[name].append(seconds(command, environment, str(work)))
                warm[name].append(seconds(command, environment, str(work)))
    print(
        f"{'crescentlab ...':28s} {'cold s':>8s} {'ratio':>7s} {'warm s':>8s} {'ratio':>7s}   (ratio to {BARE}, warm)"
    )
    for name in timed:
        columns = [
            (statistics.median(f[name]), statistics.median(a / b for a, b in zip(f[name], warm[BARE], strict=True)))
            for f in (cold, warm)
        ]
        print(f"{name:28s} " + " ".join(f"{s:8.3f} {ratio:7.2f}" for s, ratio in columns))


if __name__ == "__main__":
    main()
