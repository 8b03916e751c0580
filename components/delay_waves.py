"""Waves in cells of one tick each, kept by their ends and their mean, so that nothing of what passes is lost.

A wave entered a cell of a line during one tick and leaves it during the next. Of the wave w [Pa] in between the value
at its begin and end and the mean over the tick are kept; between them it is the parabola of those three. No components.
"""

from dataclasses import dataclass
from typing import Any

from crescentlab.maths import fabs, stack, where

STEEPER = 3
"""A front is told from a crest by its bend: so many times that of the cell before."""


@dataclass(frozen=True)
class Waves:
    """Waves running one way, one element per cell, or those of one cell."""

    begin: Any
    """when the tick began [Pa]"""
    end: Any
    """when it ended [Pa]"""
    mean: Any
    """mean over the tick [Pa]"""

    def __getitem__(self, index: Any) -> "Waves":
        return Waves(self.begin[index], self.end[index], self.mean[index])

    def shifted(self, begin: Any, end: Any, mean: Any) -> "Waves":
        """All values plus the given ones."""
        return Waves(self.begin + begin, self.end + end, self.mean + mean)

    def at(self, share: Any) -> Any:
        r"""Wave [Pa] at a share \xi [-] of the tick.

        .. math:: w(\xi) = w_0 + \xi \left[w_1 - w_0 + 6 (\bar w - \tfrac12 (w_0 + w_1))(1 - \xi)\right]

        Exact for parabolas, of third order in the tick; its mean is \bar w. Source: Colella & Woodward, J. Comput.
        Phys. 54 (1984) 174-201, Eq. 1.5.
        """
        return self.begin + share * (self.end - self.begin + 6 * self.bend * (1 - share))

    @property
    def bend(self) -> Any:
        """Mean less the mean of the ends [Pa]."""
        return self.mean - (self.begin + self.end) / 2


def joined(*parts: Waves) -> Waves:
    """Waves of several cells, one after another."""
    return Waves(stack(*[w.begin for w in parts]), stack(*[w.end for w in parts]), stack(*[w.mean for w in parts]))


def without_overshoot(wave: Waves, before: Waves) -> Waves:
    r"""The wave of one cell, its begin or end moved where a front passed within the tick and the parabola would swing.

    A parabola of mean \bar w stays between its ends while |bend| <= |w_1 - w_0|/6. A bend beyond that, and three times
    that of the cell before, is a front: then the wave is the straight line of the same mean that keeps the end nearer
    to the mean. A smooth crest bends as the cell before and stays as it is. Source: the monotone parabola of
    Colella & Woodward (1984), Eq. 1.10, kept off crests.
    """
    bend, rise = wave.bend, wave.end - wave.begin
    front = (fabs(bend) > fabs(rise) / 6) & (fabs(bend) > STEEPER * fabs(before.bend))
    late = bend * rise < 0
    begin = where(late, wave.begin, 2 * wave.mean - wave.end)
    end = where(late, 2 * wave.mean - wave.begin, wave.end)
    return Waves(where(front, begin, wave.begin), where(front, end, wave.end), wave.mean)
