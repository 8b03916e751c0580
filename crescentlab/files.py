"""Files to write: refused before the work where they cannot be written, replaced only when they are complete."""

from __future__ import annotations

import csv
import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from crescentlab.errors import InputError


def check_writable(path: Path, suffixes: Sequence[str], otherwise: str) -> None:
    """Refuse what ``-o`` names where it cannot be written; ``otherwise`` is said of a suffix that is none of these."""
    if path.suffix not in suffixes:
        raise InputError(f"-o {path}: {otherwise}")
    if not path.parent.is_dir():
        raise InputError(f"-o {path}: the folder {path.parent} does not exist; make it first")
    if path.is_dir() or not os.access(path if path.exists() else path.parent, os.W_OK):
        raise InputError(f"-o {path}: it cannot be written; choose another place")


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A file beside ``path`` to write to, which replaces it at the end; raises :class:`InputError` where it cannot."""
    part = path.with_name(f".{path.stem}-{os.getpid()}{path.suffix}")
    try:
        yield part
        os.replace(part, path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({os.strerror(error.errno) if error.errno else error})") from None
    finally:
        part.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write or replace a file."""
    with replacing(path) as part:
        part.write_text(text, encoding="utf-8")


def write_rows(path: Path, rows: Iterable[Sequence[Any]]) -> None:
    """Write or replace a CSV file; numbers keep all their digits, None leaves its cell empty."""
    with replacing(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows(rows)
