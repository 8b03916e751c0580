"""How much of the page is computed: all of it, or few points of each kind for a test."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

T = TypeVar("T")


@dataclass(frozen=True)
class Effort:
    """Numbers of points. The short form has every part of the page, each coarse."""

    full: bool = True

    def of(self, whole: T, part: T) -> T:
        """``whole`` for the page, ``part`` for the short form."""
        return whole if self.full else part


FULL, SHORT = Effort(True), Effort(False)
