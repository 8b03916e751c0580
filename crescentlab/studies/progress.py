"""How far a study is, and how long it will still take: a bar on a terminal, now and then a line elsewhere."""

from __future__ import annotations

import sys
import time
from collections import Counter
from typing import Any

from crescentlab.studies.points import DONE

EVERY = 30.0
"""Seconds between lines where there is no terminal."""


class Progress:
    """Counts rows as they come."""

    def __init__(self, total: int, quiet: bool) -> None:
        self.total, self.quiet = total, quiet
        self.statuses: Counter[str] = Counter()
        self.begun = self.said = time.monotonic()
        self.bar: Any = None
        if not quiet and total and sys.stderr.isatty():
            from tqdm import tqdm

            form = "{percentage:3.0f} %|{bar}| {n}/{total} {elapsed} < {remaining}{postfix}"
            self.bar = tqdm(total=total, bar_format=form, leave=False, file=sys.stderr)

    def row(self, status: str) -> None:
        """One more row."""
        self.statuses[status] += 1
        if self.bar is not None:
            self.bar.set_postfix_str(self.troubles(), refresh=False)
            self.bar.update()
        elif not self.quiet and time.monotonic() - self.said >= EVERY:
            self.said = time.monotonic()
            print(self.line(), file=sys.stderr)

    def troubles(self) -> str:
        """What did not go well: ``2 failed, 1 slow``."""
        return ", ".join(f"{count} {status}" for status, count in sorted(self.statuses.items()) if status != DONE)

    def line(self) -> str:
        """Points done, troubles, remaining time."""
        done = self.statuses.total()
        left = self.elapsed / done * (self.total - done)
        parts = [f"{done} of {self.total} points", self.troubles(), f"{duration(left)} left"]
        return ", ".join(part for part in parts if part)

    @property
    def elapsed(self) -> float:
        """Seconds since the beginning."""
        return time.monotonic() - self.begun

    def close(self) -> None:
        """Take the bar away."""
        if self.bar is not None:
            self.bar.close()


def duration(seconds: float) -> str:
    """``1 h 5 min``, ``3 min 20 s``, ``12 s``."""
    whole = round(seconds)
    hours, minutes, rest = whole // 3600, whole % 3600 // 60, whole % 60
    if hours:
        return f"{hours} h {minutes} min"
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"
