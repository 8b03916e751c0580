"""What Python callers hand over: a number is SI, text carries its unit, and anything else is answered by a sentence."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from numbers import Integral, Real
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from crescentlab.errors import ArgumentError, InputError, UnitError, nearest
from crescentlab.units import QUANTITIES, Quantity

Setting: TypeAlias = "str | float | bool | Iterable[float]"
"""A value by name: text as for ``--set``, a number in SI, true or false; of a vector's start several numbers."""
Settings: TypeAlias = "Mapping[str, Setting]"
Number: TypeAlias = "str | float"
"""Text with a unit, or a number in SI."""


def settings(given: Any) -> dict[str, Any]:
    """Settings as text, plain numbers and tuples of them; raises :class:`InputError` for anything else."""
    if given is None:
        return {}
    if not isinstance(given, Mapping):
        raise ArgumentError(f"parameters: {_shown(given)} is no dictionary; write for example {{'supply': '30 L/min'}}")
    return {_name(name): _setting(name, value) for name, value in given.items()}


def _name(name: Any) -> str:
    if not isinstance(name, str):
        raise ArgumentError(f"parameters: {_shown(name)} is no name; write for example 'valve.cracking_pressure'")
    return name


def _setting(name: str, value: Any) -> Any:
    if isinstance(value, str):
        return str(value)
    plain = value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value
    if isinstance(plain, (list, tuple)):
        return tuple(_setting(name, each) for each in plain)
    if isinstance(plain, bool):
        return plain
    if not isinstance(plain, Real):
        said = f"{_shown(value)} is neither a number in SI nor text such as '30 L/min'"
        raise ArgumentError(f"parameters: {name}: {said}")
    if not math.isfinite(plain):
        raise InputError(f"parameters: {name}: {float(plain)} is not a finite number")
    return int(plain) if isinstance(plain, Integral) else float(plain)


def quantity(value: Any, name: str, of: Quantity, *, least: float = -math.inf, above: float = -math.inf) -> float:
    """A finite number of a quantity, from ``least`` on and beyond ``above``; raises :class:`InputError`."""
    example = of.example()
    if isinstance(value, str):
        try:
            number = of.parse(value)
        except UnitError as error:
            raise InputError(f"{name}: {error.message}") from None
    else:
        number = _real(value, name, f"{of.titled} is a number in {of.si}, or text such as {example!r}")
    if not math.isfinite(number):
        raise InputError(f"{name}: {number} is no {of.title}; write for example {example!r}")
    if not (number > above and number >= least):
        bound = f"above {above:g}" if above > -math.inf else f"at least {least:g}"
        raise InputError(f"{name}: {value} must be {bound}")
    return number


def seconds(value: Any, name: str) -> float:
    """A time above 0 [s]; raises :class:`InputError`."""
    return quantity(value, name, QUANTITIES["time"], above=0.0)


def number(value: Any, name: str, example: str) -> float:
    """A plain number; raises :class:`InputError`."""
    return _real(value, name, f"write a number, for example {example}")


def whole(value: Any, name: str, least: int, example: int) -> int:
    """A whole number from ``least`` on; raises :class:`InputError`."""
    found = _real(value, name, f"write a whole number, for example {example}")
    if found != math.floor(found) or found < least:
        raise InputError(f"{name} {value}: write a whole number from {least} on, for example {example}")
    return int(found)


def _real(value: Any, name: str, advice: str) -> float:
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value.item()
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, Real):
        raise ArgumentError(f"{name}: {_shown(value)} is no number; {advice}")
    return float(value)


def path(value: Any, name: str) -> Path:
    """A file's path; raises :class:`InputError`."""
    if not isinstance(value, (str, Path)) or not str(value).strip():
        raise ArgumentError(f"{name}: {_shown(value)} is no path; write the file's name as text")
    return Path(value)


def names(value: Any, name: str, example: str = "line.p") -> list[str]:
    """Names, given as one text or several; raises :class:`InputError`."""
    given = [value] if isinstance(value, str) else value
    several = list(given) if isinstance(given, Iterable) and not isinstance(given, bytes) else [given]
    for each in several:
        if not isinstance(each, str):
            raise ArgumentError(f"{name}: {_shown(each)} is no name; write for example '{example}'")
    return [str(each) for each in several]


def choice(value: Any, name: str, among: Iterable[str]) -> str:
    """One of several words; raises :class:`InputError` offering the nearest."""
    known = list(among)
    if not isinstance(value, str) or value not in known:
        close = nearest(value, known, otherwise="none is called that") if isinstance(value, str) else "write one"
        raise InputError(f"{name} {_shown(value)}: {close} ({', '.join(known)})")
    return value


def instance(value: Any, kind: type, name: str, advice: str) -> None:
    """Refuse what is no ``kind``; raises :class:`InputError`."""
    if not isinstance(value, kind):
        raise ArgumentError(f"{name}: {_shown(value)} is no {kind.__name__}; {advice}")


def _shown(value: Any) -> str:
    """What was handed over, cut short."""
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else f"{type(value).__name__} {text[:40]} ..."
