"""Write docs/paper.md: the paper's tables and figures regenerated, with a verdict on every statement.

Run ``make paper``. The exit code is 1 if a verdict is not as it should be; the page is written all the same and shows
which.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

from crescentlab.report.comparison import CHOSEN, FOLLOWS, GIVEN, Comparison, unexpected
from crescentlab.report.page import Page
from crescentlab.report.pictures import style, write_svg
from studies.paper import (
    characteristic,
    geometry,
    impedance,
    leakage,
    limits,
    lubrication,
    ripple,
    run_up,
    sensitivity,
    tolerances,
    valve,
)
from studies.paper.effort import FULL, SHORT, Effort

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAPER: tuple[ModuleType, ...] = (geometry, valve, characteristic, leakage, ripple, sensitivity, tolerances)
BEYOND: tuple[ModuleType, ...] = (impedance, run_up, lubrication)


def main(arguments: Sequence[str] | None = None) -> int:
    """Compute everything, write page and pictures; 0 if every verdict is as it should be."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--short", action="store_true", help="few points of each kind, for a test")
    parser.add_argument("--output", metavar="FOLDER", type=Path, default=DOCS, help="where the page goes, default docs")
    options = parser.parse_args(arguments)
    return write(computed(SHORT if options.short else FULL), options.output)


def computed(effort: Effort) -> dict[ModuleType, Any]:
    """The data of every part."""
    return {part: _computed(part, effort) for part in (*PAPER, *BEYOND, limits)}


def write(data: dict[ModuleType, Any], folder: Path, pictures: bool = True) -> int:
    """Write page and pictures to ``folder``, say what is wrong; the exit code."""
    page = told(data)
    if pictures:
        draw(data, folder / "paper")
    page.write(folder / "paper.md")
    wrong = unexpected([*page.comparisons, *differences(data)])
    print(f"{folder / 'paper.md'}: {len(page.comparisons)} verdicts, {len(wrong)} not as they should be")
    for row in wrong:
        print(f"  {row.statement} ({row.source}): {row.says}; this says {row.found}: {row.verdict}", file=sys.stderr)
    return 1 if wrong else 0


def _computed(part: ModuleType, effort: Effort) -> Any:
    wall, used = time.perf_counter(), time.process_time()
    found = part.compute(effort)
    wall, used, name = time.perf_counter() - wall, time.process_time() - used, part.__name__.rpartition(".")[2]
    print(f"{name:15s} {wall:5.1f} s, {used:5.1f} s of this process", file=sys.stderr, flush=True)
    return found


def draw(data: dict[ModuleType, Any], folder: Path) -> None:
    """Write the pictures."""
    folder.mkdir(parents=True, exist_ok=True)
    with style():
        for part in (*PAPER, *BEYOND):
            for name, figure in part.pictures(data[part]).items():
                write_svg(figure, folder / f"{name}.svg")


def differences(data: dict[ModuleType, Any]) -> list[Comparison]:
    """Known disagreements of all parts."""
    return [row for part in PAPER if hasattr(part, "differences") for row in part.differences(data[part])]


def told(data: dict[ModuleType, Any]) -> Page:
    """The page."""
    page = Page("The paper, regenerated")
    body = Page("")
    for part in PAPER:
        part.tell(body, data[part])
    body.section("Beyond the paper")
    for part in BEYOND:
        part.tell(body, data[part])
    _introduce(page, body.comparisons, differences(data))
    page.append(body)
    page.section("Where this and the paper differ")
    rows = differences(data)
    page.table(
        ["statement", "where", "the paper says", "this says", "verdict", "why"],
        [[r.statement, r.source, r.says, r.found, r.verdict, r.differs_because or ""] for r in rows],
    )
    limits.tell(page, data[limits])
    return page


def _introduce(page: Page, rows: list[Comparison], differing: list[Comparison]) -> None:
    agreeing = sum(row.as_expected for row in rows)
    page.say("""M. Rundo, A. Corvaglia, *Lumped Parameters Model of a Crescent Pump*, Energies 2016, 9, 876: the
        statements of it that can be checked, held against the shipped circuit `crescent_pump`.""")
    kinds = {basis: sum(row.as_expected and row.basis == basis for row in rows) for basis in (GIVEN, CHOSEN, FOLLOWS)}
    page.say(f"""**{agreeing} of {len(rows)} statements agree.** {len(differing)} known differences are listed at
        the end with their reasons, and what the model cannot do after them. Of the agreements {kinds[GIVEN]} are
        *given*: the paper's number or law is an input, and the row shows that it is used. {kinds[CHOSEN]} are
        *chosen*: a number that the paper does not print was assumed so that the statement holds. {kinds[FOLLOWS]}
        *follow* from the rest.""")
    page.code(
        "make paper      # computes everything anew, writes this page and its pictures; fails if a verdict turns false"
    )
    page.say("""Text, tables and pictures of this page are made by the scripts and study files in `studies/paper`;
        nothing is edited by hand. Every verdict is computed from the numbers beside it. Tolerances were set
        before: by the digits printed, or, for 'about' and 'roughly', by what this reproduction was required to
        meet; each row says which. The paper's figures are not available as numbers and nothing was read off them:
        where only a figure has a curve, what the text says of it is compared.""")
    page.say("""The circuit file says of every number whether it is printed in the paper, derived, or assumed.
        What was chosen so that a statement holds shows that a consistent pump exists, not that it is the one that
        was measured.""")
    page.say("Each table that a picture is drawn from can be had by itself, for example that of Fig. 19:")
    page.code("crescentlab study studies/paper/figure_19.yaml")


if __name__ == "__main__":
    sys.exit(main())
