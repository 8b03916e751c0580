"""Evidence: the numbers that components are checked against, each with its source and its tolerance.

One module for each module of the library. A case computes with the library and stands beside what a closed form, a book
or a standard says; `tests/test_evidence.py` holds the two together, `docs/make_component_pages.py` prints them.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from crescentlab.units import parse_any


@dataclass(frozen=True)
class Number:
    """One figure, expected and computed, both in SI."""

    what: str
    expected: float
    computed: float
    unit: str = ""
    """In which the page shows both; empty for a pure number."""
    size: float = 0.0
    """Errors are relative to this where the expected value is smaller: a zero of a wave of 5 bar is 5 bar small."""

    @property
    def error(self) -> float:
        """Relative error."""
        scale = max(abs(self.expected), self.size)
        return abs(self.computed - self.expected) / scale if scale else abs(self.computed)

    def shown(self, value: float) -> str:
        """A value in the page's unit."""
        factor = parse_any(f"1 {self.unit}")[0] if self.unit else 1.0
        return f"{value / factor:.6g}" + (f" {self.unit}" if self.unit else "")


@dataclass(frozen=True)
class Case:
    """Figures of some component types from one source."""

    types: tuple[str, ...]
    title: str
    source: str
    tolerance: float
    because: str
    """Where the tolerance comes from: the numerics or the source."""
    compute: Callable[[], Sequence[Number]]
    module: str

    @property
    def name(self) -> str:
        """As tests call it."""
        return f"{self.module.rpartition('.')[2]}.{self.compute.__name__}"


CASES: list[Case] = []
"""Filled by :func:`evidence` as the modules are imported."""

Compute = Callable[[], Sequence[Number]]


def evidence(*types: str, source: str, tolerance: float, because: str) -> Callable[[Compute], Compute]:
    """Register a function that computes figures; its docstring is their title."""

    def register(compute: Compute) -> Compute:
        title = (compute.__doc__ or "").strip()
        CASES.append(Case(types, title, source, tolerance, because, compute, compute.__module__))
        return compute

    return register


def cases() -> list[Case]:
    """Every case, in the order of modules and lines."""
    for module in pkgutil.iter_modules(__path__):
        importlib.import_module(f"{__name__}.{module.name}")
    return CASES
