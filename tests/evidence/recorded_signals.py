"""Signals read from data files."""

from __future__ import annotations

from pathlib import Path

from crescentlab.components.recorded_signals import RecordedSignal

from evidence import Number, evidence

FILE = Path(__file__).resolve().parents[1] / "recorded.csv"
"""0, 6, 6 L/min at 0, 0.1, 0.2 s, a jump to 12 L/min, 9 L/min at 0.4 s; semicolons and decimal commas."""


@evidence(
    "recorded_signal",
    source="linear interpolation and sample and hold, by hand",
    tolerance=1e-14,
    because="rounding of double precision",
)
def rows() -> list[Number]:
    """Between the rows, before and behind a jump, beyond the last row; held; from 100 ms on; again and again."""
    line = RecordedSignal(file=str(FILE))
    held = RecordedSignal(file=str(FILE), interpolation="hold")
    late = RecordedSignal(file=str(FILE), offset=0.1)
    again = RecordedSignal(file=str(FILE), beyond="repeat")
    asked = [
        ("0.05 s", 3.0, line, 0.05), ("before the jump", 6.0, line, 0.15), ("behind it", 12.0, line, 0.2),
        ("0.3 s", 10.5, line, 0.3), ("1 s", 9.0, line, 1.0), ("0.05 s, held", 0.0, held, 0.05),
        ("0.3 s, held", 12.0, held, 0.3), ("0.2 s, from 0.1 s on", 10.5, late, 0.2),
        ("0.85 s, again", 3.0, again, 0.85),
    ]  # fmt: skip
    return [Number(name, value * 1e-3 / 60, part.equations(t=t)["y"], "L/min") for name, value, part, t in asked]
