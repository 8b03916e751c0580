"""A page of Markdown put together from headings, paragraphs, tables, pictures and verdicts."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from crescentlab.report.comparison import Comparison


class Page:
    """Collects a page; ``text`` gives it."""

    def __init__(self, title: str) -> None:
        self._parts = [f"# {title}"]
        self.comparisons: list[Comparison] = []

    @property
    def text(self) -> str:
        """The page as Markdown."""
        return "\n\n".join(self._parts) + "\n"

    def section(self, title: str, level: int = 2) -> None:
        """Begin a section."""
        self._parts.append(f"{'#' * level} {title}")

    def say(self, paragraph: str) -> None:
        """A paragraph; line breaks within it are only of the source."""
        self._parts.append(" ".join(paragraph.split()))

    def code(self, text: str, language: str = "sh") -> None:
        """A block of code, as it is."""
        self._parts.append(f"```{language}\n{text.rstrip()}\n```")

    def items(self, texts: Iterable[str]) -> None:
        """A list."""
        self._parts.append("\n".join(f"- {' '.join(text.split())}" for text in texts))

    def append(self, other: Page) -> None:
        """What another page says below its title, and its verdicts."""
        self._parts += other._parts[1:]
        self.comparisons += other.comparisons

    def picture(self, path: str, words: str) -> None:
        """A picture by its path relative to the page, and below it what it shows."""
        words = " ".join(words.split())
        first = re.split(r"[:;]|(?<!Fig)(?<!Figs)\. ", words)[0].rstrip(".")
        self._parts.append(f"![{first}]({path})")
        self._parts.append(f"*{words}*")

    def table(self, titles: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
        """A table of texts."""
        self._parts.append(markdown_table(titles, rows))

    def verdicts(self, rows: Sequence[Comparison], expected: str = "the paper says") -> None:
        """A table of verdicts; the page remembers them. ``expected`` titles the column of what is held true."""
        if not rows:
            return
        self.comparisons += rows
        self._parts.append(verdict_table(rows, expected))

    def write(self, path: Path) -> None:
        """Write the page."""
        path.write_text(self.text, encoding="utf-8")


def verdict_table(rows: Iterable[Comparison], expected: str) -> str:
    """Rows: statement, where it stands, the source's word, ours, tolerance and origin, what it rests on, verdict."""
    titles = ["statement", "where", expected, "this says", "tolerance, and whence", "basis", "verdict"]
    return markdown_table(
        titles, [[r.statement, r.source, r.says, r.found, r.margin, r.basis, r.verdict] for r in rows]
    )


def markdown_table(titles: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table; bars inside cells are escaped. Raises ValueError for a row of another length."""
    lines = [list(titles), ["---"] * len(titles)]
    for row in rows:
        if len(row) != len(titles):
            raise ValueError(f"a row of {len(row)} cells in a table of {len(titles)} columns: {row}")
        lines.append([" ".join(cell.split()).replace("|", "\\|") for cell in row])
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
