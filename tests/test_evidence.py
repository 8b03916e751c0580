"""Every figure that the pages of the components print: computed and expected agree within the stated tolerance."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest
from evidence import Case, cases

from crescentlab.commands.components import listed
from crescentlab.library import installed

ROOT = Path(__file__).resolve().parents[1]
CASES = cases()


@pytest.mark.parametrize("case", CASES, ids=[case.name for case in CASES])
def test_figures_agree_with_their_source(case: Case) -> None:
    """The source, the tolerance and the reason for it are the case's own."""
    assert case.title
    assert case.source
    assert case.because
    numbers = case.compute()
    assert numbers
    for number in numbers:
        assert number.error <= case.tolerance, f"{number.what}: {number.computed} instead of {number.expected}"


def test_every_type_has_evidence() -> None:
    """Fluids too; a family stands for its causal forms."""
    shown = {name for case in CASES for name in case.types}
    known = set(listed(installed()))
    assert not known - shown, f"no figure for {sorted(known - shown)}"
    assert not shown - known, f"figures for what the library does not have: {sorted(shown - known)}"
    for page, said in (
        ("README.md", f"each of the {len(known)} parts"),
        ("CHANGELOG.md", f"A library of {len(known)} "),
    ):
        assert said in (ROOT / page).read_text(encoding="utf-8")


def test_the_pages_of_the_components_are_those_of_this_code() -> None:
    """Written by `python docs/make_component_pages.py`."""
    spec = importlib.util.spec_from_file_location("pages", ROOT / "docs" / "make_component_pages.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    kept = {path.name: path.read_text(encoding="utf-8") for path in (ROOT / "docs" / "components").glob("*.md")}
    assert module.pages() == kept
