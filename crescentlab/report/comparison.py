"""What a source says, what a circuit gives, and whether the two agree: rows of a table of verdicts."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

from crescentlab.units import QUANTITIES

FOLLOWS, GIVEN, CHOSEN = "follows", "given", "chosen"
"""What an agreement rests on. ``given``: the source's number is an input, so that the row shows only that it is used;
``chosen``: an assumed number was chosen so that the statement holds; ``follows``: neither."""


@dataclass(frozen=True)
class Comparison:
    """One statement of a source, held against numbers. Numbers are texts with their units by now.

    ``says``: what the source says; ``found``: what the circuit gives; ``margin``: the tolerance and whence;
    ``holds``: whether the two agree within it. ``differs_because`` marks a disagreement that is known and explained:
    such a row is expected not to hold, and one that does hold is as wrong as a broken statement. ``basis`` says what an
    agreement is worth: whether the number was given to the circuit, met by a choice, or follows.
    """

    statement: str
    source: str
    says: str
    found: str
    margin: str
    holds: bool
    differs_because: str | None = None
    basis: str = FOLLOWS

    @property
    def verdict(self) -> str:
        """The verdict in a word or two."""
        if self.differs_because is None:
            return "agrees" if self.holds else "**FALSE**"
        return "**FALSE: no longer differs**" if self.holds else "differs"

    @property
    def as_expected(self) -> bool:
        """Whether a report may stand: the statement holds, or is known not to."""
        return self.holds == (self.differs_because is None)

    def differing(self, reason: str) -> Comparison:
        """The same row as a known disagreement, with its reason."""
        return replace(self, differs_because=reason)

    def resting_on(self, basis: str) -> Comparison:
        """The same row with what it rests on."""
        return replace(self, basis=basis)


@dataclass(frozen=True)
class Unit:
    """How numbers of a quantity are shown: ``Unit("pressure", "bar", 3).show(3e5)`` is ``3 bar``."""

    quantity: str
    unit: str
    digits: int = 4
    difference: str = ""
    """Unit of differences if another word is usual: two shares in % differ by points."""

    def show(self, value: float) -> str:
        """An SI number as text."""
        if not math.isfinite(value):
            return "not a number"
        return QUANTITIES[self.quantity].show(value, self.unit, self.digits)

    def apart(self, value: float) -> str:
        """A difference of two SI numbers as text."""
        return self.show(value).replace(self.unit, self.difference or self.unit)

    def each(self, values: Iterable[float]) -> str:
        """Several SI numbers as text, the unit once."""
        shown = [self.show(v).removesuffix(self.unit).rstrip() for v in values]
        return f"{', '.join(shown)} {self.unit}"


def within(
    statement: str, source: str, expected: float, found: float, tolerance: float, unit: Unit, origin: str,
    *, relative: bool = False, about: bool = False,
) -> Comparison:  # fmt: skip
    """A printed number: agrees if ``|found - expected| <= tolerance`` (SI; ``relative``: a share of ``expected``).

    ``origin`` says where the tolerance comes from; ``about`` marks a number that the source calls approximate.
    """
    allowed = tolerance * abs(expected) if relative else tolerance
    margin = f"{100 * tolerance:.3g} %" if relative else unit.apart(tolerance)
    return Comparison(
        statement, source, ("about " if about else "") + unit.show(expected), unit.show(found),
        f"± {margin}: {origin}", bool(abs(found - expected) <= allowed),
    )  # fmt: skip


def all_within(
    statement: str, source: str, expected: Iterable[float], found: Iterable[float], tolerance: float, unit: Unit,
    origin: str,
) -> Comparison:  # fmt: skip
    """Several printed numbers of one kind: agrees if each does."""
    wanted, have = list(expected), list(found)
    holds = len(wanted) == len(have) and all(abs(a - b) <= tolerance for a, b in zip(wanted, have, strict=True))
    return Comparison(
        statement, source, unit.each(wanted), unit.each(have), f"± {unit.apart(tolerance)}: {origin}", holds
    )


def true_that(statement: str, source: str, says: str, found: str, holds: bool, origin: str) -> Comparison:
    """A statement in words; ``holds`` is computed from numbers, ``found`` shows them, ``origin`` says what is asked."""
    return Comparison(statement, source, says, found, origin, bool(holds))


def unexpected(rows: Iterable[Comparison]) -> list[Comparison]:
    """The rows for which a report must fail."""
    return [row for row in rows if not row.as_expected]
