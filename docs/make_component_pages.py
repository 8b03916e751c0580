"""Writes the pages of the components: python docs/make_component_pages.py

For each type of the library: its equations and source as the class states them, ports and parameters, and the figures
it was checked against, expected beside computed (`tests/evidence`).
"""

from __future__ import annotations

import inspect
import re
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from crescentlab.commands import components as described
from crescentlab.component import Component
from crescentlab.fluid import Fluid
from crescentlab.library import installed

HERE = Path(__file__).parent
PAGES = HERE / "components"
sys.path.insert(0, str(HERE.parent / "tests"))

from evidence import Case, cases  # noqa: E402  after the path

WRITTEN = (
    "Written by `docs/make_component_pages.py` from the classes and from `tests/evidence`; a test keeps them together."
)


def family(cls: type[Component] | type[Fluid]) -> str:
    """The page a class stands on: its module's name."""
    return cls.__module__.rpartition(".")[2]


def pages() -> dict[str, str]:
    """Every page by its file's name."""
    known = described.listed(installed())
    families: dict[str, dict[str, type[Component] | type[Fluid]]] = {}
    for name in sorted(known):
        families.setdefault(family(known[name]), {})[name] = known[name]
    found = {"index.md": index(families)}
    for name, classes in sorted(families.items()):
        found[f"{name}.md"] = page(name, classes)
    return found


def index(families: dict[str, dict[str, type[Component] | type[Fluid]]]) -> str:
    """All types, family by family."""
    total = sum(len(classes) for classes in families.values())
    lines = [f"# Components\n\n{total} types. {WRITTEN}\n"]
    for name, classes in sorted(families.items()):
        rows = [(f"[{t}]({name}.md#{t})", described.first_line(cls)) for t, cls in classes.items()]
        lines.append(f"## {title(name)}\n\n{markdown(('type', ''), rows)}")
    return "\n".join(lines)


def title(name: str) -> str:
    """``spool_valves`` as a heading."""
    return name.replace("_", " ").capitalize()


def page(name: str, classes: dict[str, type[Component] | type[Fluid]]) -> str:
    """One family."""
    parts = [f"# {title(name)}\n\n{WRITTEN}\n"]
    for kind, cls in classes.items():
        parts.append(f"## {kind}\n\n{text(cls)}\n")
        if issubclass(cls, Component) and (ports := [described.port_row(p) for p in cls.ports()]):
            parts.append(markdown(("port", "role", "carries", "size", ""), ports))
        if parameters := described.parameter_rows(cls):
            parts.append(markdown(("parameter", "quantity or choice", "default", "range", ""), parameters))
        if issubclass(cls, Component):
            for title_, rows in described.variable_rows(cls).items():
                if rows:
                    parts.append(markdown((title_.removesuffix("s"), "quantity", "size", ""), rows))
        for case in cases():
            if kind in case.types:
                parts.append(figures(case))
    return "\n".join(parts)


def text(cls: type) -> str:
    """A docstring as Markdown: display equations between $$, symbols such as \\rho between $."""
    body = inspect.cleandoc(cls.__doc__ or "")
    body = re.sub(r"(?m)^\.\. math:: (.*(?:\n[ ]+\S.*)*)", lambda m: f"$$\n{_joined(m[1])}\n$$", body)
    body = re.sub(r":\w+:`[~.]*([\w.]+)`", r"`\1`", body)
    outside = re.split(r"(\$\$.*?\$\$)", body, flags=re.DOTALL)
    index = r"(?:[_^](?:\{[^{}]*\}|\w))*"
    command, letter = rf"\\[A-Za-z]+(?:\{{[^{{}}]*\}})*{index}", rf"[A-Za-z](?![A-Za-z']){index}"
    symbol = rf"(?<![\w$\\])((?:[A-Za-z]_)?{command}(?: ?(?:{command}|{letter}))*)"
    return "".join(p if p.startswith("$$") else re.sub(symbol, r"$\1$", p) for p in outside)


def _joined(math: str) -> str:
    return "\n".join(line.strip() for line in math.splitlines())


def figures(case: Case) -> str:
    """Expected beside computed."""
    rows = [(n.what, n.shown(n.expected), n.shown(n.computed), f"{case.tolerance:.2g}") for n in case.compute()]
    head = f"*{case.title}* Source: {case.source}. Tolerance: {case.because}.\n\n"
    return head + markdown(("checked", "expected", "computed", "tolerance"), rows)


def markdown(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table without the columns that say nothing."""
    rows = [list(row) for row in rows]
    kept = [k for k in range(len(heads)) if any(row[k] for row in rows)]
    lines = [
        [heads[k] for k in kept],
        ["---"] * len(kept),
        *[[row[k].replace("|", "\\|") for k in kept] for row in rows],
    ]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def main() -> None:
    """Write all pages, and remove those of families that are gone."""
    PAGES.mkdir(exist_ok=True)
    made = pages()
    for old in PAGES.glob("*.md"):
        if old.name not in made:
            old.unlink()
    for name, content in made.items():
        (PAGES / name).write_text(content, encoding="utf-8")
    print(f"wrote {len(made)} pages to {PAGES.relative_to(HERE.parent)}")


if __name__ == "__main__":
    main()
