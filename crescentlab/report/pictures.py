"""Pictures for pages kept under version control: the house style, and SVG files that are the same each time."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from crescentlab.errors import InputError
from crescentlab.plotting import STYLE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LARGEST = 80_000
"""Most bytes of a picture that is kept beside a text."""
DECIMALS = 2
"""Digits of an SVG coordinate after the point, in units of 1/72 inch: a hundredth cannot be seen, and digits beyond
it differ between machines."""
DETERMINISTIC: dict[Any, Any] = {"svg.hashsalt": "crescentlab", "svg.fonttype": "none", "path.simplify_threshold": 0.1}


@contextmanager
def style(**more: Any) -> Iterator[None]:
    """The style of all pictures, within a ``with``: figures are made and saved inside it."""
    import matplotlib as mpl

    settings: dict[Any, Any] = {**STYLE, **DETERMINISTIC, "legend.fontsize": 9.0}
    settings.update(more)
    with mpl.rc_context(settings):
        yield


def new_figure(width: float, height: float) -> Figure:
    """An empty figure without a window; sizes in inches. Call it within :func:`style`."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def svg_text(figure: Figure) -> str:
    """The figure as SVG: no date, equal names for equal parts, coordinates rounded. Call it within :func:`style`."""
    buffer = io.StringIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    return re.sub(r"<[^>]*>", lambda tag: _NUMBER.sub(_rounded, tag[0]), buffer.getvalue())  # texts keep their digits


def write_svg(figure: Figure, path: Path, largest: int = LARGEST) -> None:
    """Write the figure; raises :class:`InputError` if it is too large to be kept beside a text."""
    text = svg_text(figure)
    if len(text.encode()) > largest:
        raise InputError(f"{path.name}: {len(text.encode())} bytes; a picture has at most {largest}: draw fewer points")
    path.write_text(text, encoding="utf-8")


_NUMBER = re.compile(r"-?\d+\.\d{3,}")


def _rounded(number: re.Match[str]) -> str:
    text = f"{float(number[0]):.{DECIMALS}f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text
