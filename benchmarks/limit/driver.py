"""Builds the hand-written pump with the machine's compiler and runs it at an operating point."""

from __future__ import annotations

import ctypes
import functools
import shutil
import subprocess
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import crescentlab as cl

from .parameters import header, round_diameter

FOLDER = Path(__file__).parent
FLAGS = ("-O3", "-march=native", "-fno-math-errno", "-fno-trapping-math", "-fno-signed-zeros", "-freciprocal-math")
"""Nothing that changes a sum's order: the exponential rounds by adding a large number and taking it off again."""
PLAIN = tuple(flag for flag in FLAGS if flag != "-march=native")
"""The same for any machine of this kind: vectors of two numbers instead of eight."""
GRID = 1e-5
"""Output step [s] of the delivery pressure."""
TOLERANCES = {"rodas": 1e-3, "dopri": 1e-4}
"""The tolerance at which each method is timed."""
COUNTS = ("steps", "rejected", "redone", "f", "J", "lu", "solves", "clocks", "events", "stops", "ticks", "roots")
COSTS = ("f", "f+J", "clock of rodas", "clock of dopri", "lu", "solve", "tick")
FAILURES = {-1: "the step collapsed", -2: "the line's Courant number exceeds 1"}
Array = np.ndarray


@dataclass(frozen=True)
class Outcome:
    """One run: wall and processor seconds, output times, delivery pressure [Pa], what was counted."""

    seconds: float
    processor: float
    times: Array
    delivery: Array
    counts: dict[str, int]


class Build:
    """The compiled pump, for every operating point of the circuit."""

    def __init__(self, flags: tuple[str, ...] = FLAGS) -> None:
        compiler = shutil.which("cc") or shutil.which("gcc")
        if compiler is None:
            raise FileNotFoundError("the limit needs a C compiler: install cc or gcc")
        self.circuit = cl.load("crescent_pump")
        with tempfile.TemporaryDirectory() as folder:
            library = Path(folder) / "limit.so"
            (Path(folder) / "parameters.h").write_text(header(self.circuit.design()))
            command = [
                compiler,
                "-std=gnu11",
                *flags,
                "-Wall",
                "-Wno-psabi",
                "-Wno-unused",
                "-shared",
                "-fPIC",
                f"-I{folder}",
            ]
            subprocess.run([*command, str(FOLDER / "outside.c"), "-o", str(library), "-lm"], check=True)
            self.library = ctypes.CDLL(str(library))
        self.library.limit_run.restype = ctypes.c_double

    def point(self, speed: str, throttle_area: str | None) -> tuple[Array, Any, Any]:
        """Operating point for C, the system and its start values."""
        parameters = {"speed": speed} | ({} if throttle_area is None else {"throttle_area": throttle_area})
        design = self.circuit.design(parameters)
        system = self.circuit.system(parameters)
        throttle, omega = design.instances["throttle"].component, design.instances["shaft"].component.speed
        point = [omega, throttle.area, round_diameter(throttle), throttle.cd_max, throttle.lambda_c]
        return np.array(point), system, system.values(design)

    def run(
        self, revolutions: float, rtol: float, method: str, speed: str, throttle_area: str | None, grid: float = GRID
    ) -> Outcome:
        """Integrate from the circuit's start; ``grid`` 0 leaves the output out."""
        point, system, values = self.point(speed, throttle_area)
        stop = revolutions * 2 * np.pi / point[0]
        rows = int(stop / grid + 1 + 1e-6) if grid else 0
        delivery, counts = np.zeros(max(rows, 1)), (ctypes.c_long * len(COUNTS))()
        first = system.held_names.index("line.pipe.p_node[1]")
        p, q = np.split(values.h0[first : first + 22], 2)
        begun = time.thread_time()
        seconds = self.library.limit_run(
            *map(pointer, (point, values.x0, p, q, rtol * system.nominal)), ctypes.c_double(rtol),
            ctypes.c_int(method == "rodas"), ctypes.c_double(stop), ctypes.c_double(grid), pointer(delivery),
            ctypes.c_long(rows), counts,
        )  # fmt: skip
        processor = time.thread_time() - begun
        if seconds < 0:
            raise ArithmeticError(FAILURES[int(seconds)])
        return Outcome(
            seconds, processor, np.arange(rows) * grid, delivery[:rows], dict(zip(COUNTS, counts, strict=True))
        )

    def costs(self) -> dict[str, float]:
        """Nanoseconds of each part, where the last run ended."""
        found = np.zeros(len(COSTS) + 1)
        self.library.limit_costs(pointer(found))
        return dict(zip(COSTS, found.tolist(), strict=False))

    def fixed(self, method: str, steps: int, span: float) -> Array:
        """The state after equal steps from where the last run ended."""
        x = np.zeros(16)
        self.library.limit_fixed(
            ctypes.c_int(method == "rodas"), ctypes.c_int(steps), ctypes.c_double(span), pointer(x)
        )
        return x


def pointer(array: Array) -> Any:
    """The array's numbers, for C; they must lie one after another."""
    assert array.dtype == np.float64
    assert array.flags.c_contiguous
    return array.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


@functools.cache
def build(flags: tuple[str, ...] = FLAGS) -> Build:
    """The compiled pump, built once."""
    return Build(flags)


def run(
    revolutions: float = 10, rtol: float | None = None, method: str = "rodas", speed: str = "2000 rpm",
    throttle_area: str | None = None, grid: float = GRID,
) -> Outcome:  # fmt: skip
    """Run the limit: seconds, times, delivery pressure and counts; rtol defaults to the one timed."""
    return build().run(revolutions, TOLERANCES[method] if rtol is None else rtol, method, speed, throttle_area, grid)
