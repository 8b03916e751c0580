"""What several commands share in reading ``--set`` and printing tables."""

from __future__ import annotations

import shutil
import textwrap
from collections.abc import Iterable, Sequence

from crescentlab.errors import InputError


def settings(texts: Sequence[str]) -> dict[str, str]:
    """``NAME=VALUE`` texts by name; raises :class:`InputError` for a slip and for a name given twice."""
    found: dict[str, str] = {}
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not (name and equals and value):
            raise InputError(f"--set {text}: write NAME=VALUE, for example --set supply='30 L/min'")
        if name in found:
            raise InputError(f"--set {name} is given twice ({found[name]!r} and {value!r}); keep one")
        found[name] = value
    return found


def table(rows: Iterable[Sequence[str]], *, right: Sequence[int] = (), indent: str = "", fold: bool = False) -> str:
    """Rows as text in aligned columns, two spaces apart.

    ``right`` lists the columns that end flush; with ``fold`` the last column is folded to the terminal.
    """
    cells = [list(row) for row in rows]
    widths = [max(len(cell) for cell in column) for column in zip(*cells, strict=True)]
    lines: list[str] = []
    for row in cells:
        shown = [
            cell.rjust(w) if k in right else cell.ljust(w) for k, (cell, w) in enumerate(zip(row, widths, strict=True))
        ]
        if fold:
            lines.append(wrapped(indent + "".join(f"{cell}  " for cell in shown[:-1]), row[-1]))
        else:
            lines.append(f"{indent}{'  '.join(shown)}".rstrip())
    return "\n".join(lines)


def wrapped(first: str, text: str) -> str:
    """``text`` after ``first``, folded to the terminal with later lines set in under it."""
    width = max(min(shutil.get_terminal_size((110, 24)).columns, 130), len(first) + 40)
    folded = textwrap.fill(
        text, width, initial_indent=first, subsequent_indent=" " * len(first), break_on_hyphens=False
    )
    return folded.replace("\N{NO-BREAK SPACE}", " ") if text else first.rstrip()


def counted(number: int, singular: str, plural: str = "") -> str:
    """``1 net``, ``2 nets``."""
    return f"{number} {singular if number == 1 else plural or singular + 's'}"
