"""What the compiled loop records: arrays it fills, emptied between blocks of steps, joined when the run is over."""

from __future__ import annotations

import itertools

import numpy as np

from crescentlab.solvers import native
from crescentlab.solvers.trajectory import Happening, Polynomials, Rows

MOST_ROWS = 2000
BYTES = 8_000_000
"""About how much is recorded before it is emptied."""

Array = np.ndarray


class Records:
    """Rows, pieces, the held values and bits ("worlds") they refer to, and events, block by block."""

    def __init__(self, run: native.Run, method: str) -> None:
        self.run = run
        size = native.SHAPES[method][1] + 1
        width = 8 * ((size + 1) * run.n + 2 * (run.n_held + run.n_bits) + 8)
        rows = max(16, min(MOST_ROWS, BYTES // width))
        logs = 2 * native.LIMITS["MAX_ROUNDS"] * (run.n_events + 1) + rows
        self.arrays = {
            "row_t": np.zeros(rows), "row_x": np.zeros((rows, run.n)), "row_jump": np.zeros(rows, np.int64),
            "row_world": np.zeros(rows, np.int64), "piece_low": np.zeros(rows), "piece_high": np.zeros(rows),
            "piece_coef": np.zeros((rows, size, run.n)), "piece_world": np.zeros(rows, np.int64),
            "world_h": np.zeros((2 * rows, run.n_held)), "world_b": np.zeros((2 * rows, run.n_bits)),
            "log_t": np.zeros(logs), "log_event": np.zeros(logs, np.int64),
        }  # fmt: skip
        run.rows_max, run.logs_max = rows, logs
        run.give(**self.arrays)
        self.blocks: list[dict[str, Array]] = []
        self.size = 0
        """Bytes taken so far."""

    def drain(self) -> dict[str, Array] | None:
        """Take what was recorded since the last time; the loop goes on with empty records."""
        run = self.run
        if not run.rows and not run.logs:
            return None
        counts = {"row": run.rows, "piece": run.pieces, "world": run.worlds, "log": run.logs}
        block = {name: array[: counts[name.partition("_")[0]]].copy() for name, array in self.arrays.items()}
        block["piece_length"] = block["piece_high"] - block["piece_low"]
        self.blocks.append(block)
        self.size += sum(array.nbytes for array in block.values())
        run.rows = run.pieces = run.worlds = run.logs = 0
        return block

    def shorten(self, t: float, x: Array) -> None:
        """Let the last step end at t, in state x."""
        block = self.blocks[-1]
        block["piece_high"][-1] = block["row_t"][-1] = t
        block["row_x"][-1] = x

    def last(self, count: int) -> tuple[Array, Array, Array, Array]:
        """Times, states, held values and bits of the last rows, as many as the last block has of them."""
        block = self.blocks[-1]
        worlds = block["row_world"][-count:]
        return block["row_t"][-count:], block["row_x"][-count:], block["world_h"][worlds], block["world_b"][worlds]

    def joined(self, name: str) -> Array:
        """One array of all blocks."""
        return np.concatenate([block[name] for block in self.blocks])

    def of_world(self, of: str, kind: str) -> Array:
        """Held values or bits of rows or pieces."""
        return np.concatenate([block[kind][block[of]] for block in self.blocks])

    def events(self) -> list[int]:
        """Events by number, in the order they fired."""
        return self.joined("log_event").tolist() if self.blocks else []

    def rows(self, at_start: tuple[float, Array, Array, Array]) -> Rows:
        """Accepted steps and events; without any the given start: time, states, held values, bits."""
        if not self.blocks:
            t, x, h, b = at_start
            return Rows(np.array([t]), x[None], h[None], b[None], np.zeros(0, int))
        return Rows(
            self.joined("row_t"), self.joined("row_x"), self.of_world("row_world", "world_h"),
            self.of_world("row_world", "world_b"), np.flatnonzero(self.joined("row_jump")),
        )  # fmt: skip

    def pieces(self) -> Polynomials:
        """The polynomials of the accepted steps."""
        if not self.blocks:
            run, none = self.run, np.zeros(0)
            empty = (np.zeros((0, 1, run.n)), np.zeros((0, run.n_held)), np.zeros((0, run.n_bits)))
            return Polynomials(none, none, none, *empty)
        return Polynomials(
            self.joined("piece_low"), self.joined("piece_high"), self.joined("piece_length"),
            self.joined("piece_coef"), self.of_world("piece_world", "world_h"), self.of_world("piece_world", "world_b"),
        )  # fmt: skip

    def happenings(self, names: list[str]) -> list[Happening]:
        """Events and ticks by instant; ``names`` are those of the system's events."""
        if not self.blocks:
            return []
        pairs = zip(self.joined("log_t").tolist(), self.joined("log_event").tolist(), strict=True)
        return [
            Happening(t, tuple(names[k] for _, k in group))
            for t, group in itertools.groupby(pairs, key=lambda pair: pair[0])
        ]


def on_grid(start: float, step: float, tolerance: float, steps: Rows, pieces: Polynomials) -> Rows:
    """The uniform output grid, the end of the run its last row; at an event the values after it."""
    end = float(steps.t[-1])
    times = start + step * np.arange(np.floor((end - start) / step * (1 + 1e-12)) + 1)
    times = times[times < end - tolerance] if pieces.low.size else times[:0]
    inside = np.clip(np.searchsorted(pieces.low, times + tolerance, side="right") - 1, 0, None)
    return Rows(
        np.append(times, end), np.vstack([pieces.at(inside, times), steps.x[-1:]]),
        np.vstack([pieces.h[inside], steps.h[-1:]]), np.vstack([pieces.b[inside], steps.b[-1:]]), np.zeros(0, int),
    )  # fmt: skip
