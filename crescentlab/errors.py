"""Every error crescentlab raises on purpose, and what each one means.

.. code-block:: text

    CrescentlabError
    +-- InputError          the user's text is wrong            exit code 2
    |   +-- UnitError       a unit is unknown, missing or of another quantity
    |   +-- ExpressionError an expression is not arithmetic, or its dimensions clash
    |   +-- CausalityError  the nets cannot be given an order of evaluation
    |   +-- MovingError     there is no steady state: the time itself moves the circuit
    |   +-- ArgumentError   a Python function was handed what it cannot take (a TypeError too)
    +-- ComponentError      a component class breaks its contract (its author's mistake)
    |   +-- ContractError   found by crescentlab.contract (an AssertionError too)
    +-- SimulationError     the run itself failed               exit code 3
    +-- CompilerError       nothing can be compiled here; caught where there is another way

Pydantic's own error is left to those who make a component's instance by its class, as authors do in their tests.
An :class:`InputError` carries the place it speaks of, so that its text begins ``FILE:LINE: ``.
A :class:`ComponentError` found while a circuit is read is reported as the user's input too,
for the user wrote the class.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class Place:
    """Where in the user's text something stands: a file and a line counted from 1."""

    file: str
    line: int

    def __str__(self) -> str:
        return f"{self.file}:{self.line}"


class CrescentlabError(Exception):
    """Base of every error raised on purpose."""


class InputError(CrescentlabError):
    """The user's circuit, option or table is wrong; the text says what to write instead."""

    def __init__(self, message: str, place: Place | None = None) -> None:
        super().__init__(message)
        self.message = message.replace("\n", " ")
        self.place = place

    def at(self, place: Place | None) -> InputError:
        """Give the error a place, unless it already knows a more exact one."""
        if self.place is None:
            self.place = place
        return self

    def __str__(self) -> str:
        return f"{self.place}: {self.message}" if self.place else self.message


class UnitError(InputError):
    """A number's unit is missing, unknown, or belongs to another quantity."""


class ExpressionError(InputError):
    """An expression is not arithmetic, names something unknown, or mixes dimensions."""


class CausalityError(InputError):
    """The nets cannot be evaluated: no giver, two givers, or an algebraic loop."""


class MovingError(InputError):
    """The time itself keeps a circuit from coming to rest: ``why``, and what to do then."""

    def __init__(self, why: str, advice: str) -> None:
        super().__init__(f"{why}; {advice}")
        self.why = why


class ArgumentError(InputError, TypeError):
    """A Python function was handed what it cannot take."""


class ComponentError(CrescentlabError):
    """A component class breaks the contract of :class:`crescentlab.component.Component`."""


class ContractError(ComponentError, AssertionError):
    """A component breaks a rule that :mod:`crescentlab.contract` looks at."""


class SimulationError(CrescentlabError):
    """The integration cannot go on; what was computed so far is kept by the caller."""


class CompilerError(CrescentlabError):
    """Nothing can be compiled on this machine; what needs no compiler goes on."""


def nearest(name: str, known: Iterable[str], *, limit: int = 3, otherwise: str = "") -> str:
    """The sentence that offers names like the one received, or says ``otherwise``, or lists what exists."""
    names = sorted(set(known))
    within = [n for n in names if len(name) > 2 and name.lower() in re.split(r"[_\W]+", n.lower())]
    close = difflib.get_close_matches(name, names, n=limit, cutoff=0.5)
    slip = difflib.get_close_matches(name, names, n=1, cutoff=0.85)
    if offered := list(dict.fromkeys([*slip, *within, *close]))[: max(limit, min(len(within), 2 * limit))]:
        return f"did you mean {' or '.join(offered)}?"
    if otherwise or not names:
        return otherwise or "there are none"
    shown = ", ".join(names[:12])
    return f"known: {shown}{', ...' if len(names) > 12 else ''}"
