"""The regenerated paper: the short form of its page, and that a verdict which turns false fails the command.

The short form computes a few points of each kind and draws every picture; the numbers themselves are compared with the
paper by the page's own verdicts, whose tolerances stand beside them.
"""

from __future__ import annotations

import re
import sys
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))  # `studies` is a folder of scripts, not installed

from crescentlab.errors import InputError  # noqa: E402
from crescentlab.report import comparison, pictures  # noqa: E402
from crescentlab.report.page import Page, markdown_table  # noqa: E402
from studies.paper import geometry, make_page, ripple  # noqa: E402
from studies.paper.effort import SHORT  # noqa: E402

BAR = comparison.Unit("pressure", "bar", 3)


# --- the parts of a report ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("found", "holds"), [(8.5e5, True), (9.5e5, True), (8.49e5, False), (float("nan"), False)])
def test_a_printed_number_agrees_within_its_tolerance(found, holds):
    """9 bar +- 0.5 bar, ends included; what is not a number never agrees."""
    row = comparison.within("regulated", "Fig. 19", 9e5, found, 0.5e5, BAR, "whole bar", about=True)
    assert row.holds is holds
    assert row.verdict == ("agrees" if holds else "**FALSE**")
    assert row.says == "about 9 bar"
    assert row.margin == "± 0.5 bar: whole bar"
    assert comparison.unexpected([row]) == ([] if holds else [row])


def test_a_relative_tolerance_is_a_share_of_what_is_printed():
    """0.7 % of 10 bar are 0.07 bar."""
    rows = [comparison.within("p", "", 10e5, p, 0.007, BAR, "", relative=True) for p in (10.06e5, 10.08e5)]
    assert [row.holds for row in rows] == [True, False]


def test_several_numbers_agree_only_together_and_all_of_them():
    rows = [comparison.all_within("p", "", [1e5, 2e5], p, 0.1e5, BAR, "") for p in ([1e5, 2.05e5], [1e5, 2.2e5], [1e5])]
    assert [row.holds for row in rows] == [True, False, False]


def test_a_known_difference_must_go_on_to_differ():
    """A disagreement that vanishes makes the page's explanation wrong, so it fails the command as well."""
    apart = comparison.true_that("eccentricity", "2.2", "0.95", "0.85", False, "").differing("no clearance is printed")
    alike = comparison.true_that("eccentricity", "2.2", "0.95", "0.95", True, "").differing("no clearance is printed")
    assert apart.verdict == "differs"
    assert comparison.unexpected([apart, alike]) == [alike]


def test_tables_keep_their_columns():
    assert markdown_table(["a", "b"], [["x | y", "two\nlines"]]).splitlines()[-1] == "| x \\| y | two lines |"
    with pytest.raises(ValueError, match="1 cells in a table of 2"):
        markdown_table(["a", "b"], [["x"]])


def test_a_page_remembers_its_verdicts():
    page = Page("title")
    page.verdicts([])
    page.verdicts([comparison.true_that("a", "b", "c", "d", True, "e").resting_on(comparison.GIVEN)])
    assert len(page.comparisons) == 1
    assert page.text.splitlines()[-1] == "| a | b | c | d | e | given | agrees |"


def test_pictures_are_the_same_each_time_and_not_too_large(tmp_path):
    def drawn() -> Any:
        figure = pictures.new_figure(4, 3)
        axes = figure.subplots()
        axes.plot([0, 1, 2], [1 / 3, 2 / 3, 1])
        axes.set_title("1.075")
        return figure

    with pictures.style():
        texts = [pictures.svg_text(drawn()) for _ in range(2)]
        with pytest.raises(InputError, match="draw fewer points"):
            pictures.write_svg(drawn(), tmp_path / "large.svg", largest=1000)
    assert texts[0] == texts[1]
    assert "<dc:date>" not in texts[0]
    assert "1.075</text>" in texts[0]  # what is written keeps its digits, coordinates are rounded
    assert not re.search(r"\d\.\d{3}", "".join(re.findall(r"<[^>]*>", texts[0].partition("</metadata>")[2])))
    assert not (tmp_path / "large.svg").exists()


# --- the page -------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def data() -> dict[Any, Any]:
    """The short form of every part, computed once."""
    return make_page.computed(SHORT)


@pytest.fixture(scope="module")
def folder(data, tmp_path_factory) -> Path:
    """The short form written; every verdict is as it should be."""
    target = tmp_path_factory.mktemp("page")
    assert make_page.write(data, target) == 0
    return target


def test_every_verdict_of_the_short_form_is_true(folder):
    text = (folder / "paper.md").read_text(encoding="utf-8")
    assert "FALSE" not in text
    assert text.count("| agrees |") >= 40
    assert text.count("| differs |") == 2
    assert not re.search(r"\bnan\b|not a number", text)


def test_its_pictures_are_there_and_small(folder):
    text = (folder / "paper.md").read_text(encoding="utf-8")
    named = re.findall(r"\]\((paper/\S+\.svg)\)", text)
    assert sorted(named) == sorted(f"paper/{path.name}" for path in (folder / "paper").iterdir())
    assert len(named) >= 12
    for name in named:
        assert (folder / name).stat().st_size <= pictures.LARGEST
        assert ET.parse(folder / name).getroot().tag.endswith("svg")


@pytest.mark.parametrize(
    ("part", "name", "wrong", "statement"),
    [
        (geometry, "DISPLACEMENT", geometry.DISPLACEMENT * 1.02, "displacement of the gears"),
        (ripple, "PRINTED_MODULUS", {3.6: 2000.0}, "bulk modulus at 3.6 bar"),
    ],
)
def test_a_false_verdict_fails_the_command_and_shows(data, tmp_path, monkeypatch, capsys, part, name, wrong, statement):
    monkeypatch.setattr(part, name, wrong)
    assert make_page.write(data, tmp_path, pictures=False) == 1
    (line,) = [x for x in (tmp_path / "paper.md").read_text(encoding="utf-8").splitlines() if "**FALSE**" in x]
    assert line.startswith(f"| {statement} |")
    assert statement in capsys.readouterr().err


def test_the_manual_has_the_whole_page(folder):
    """docs/paper.md has the sections and pictures of what `make paper` writes now, and no false verdict."""
    kept, made = ((place / "paper.md").read_text(encoding="utf-8") for place in (ROOT / "docs", folder))
    for pattern in (r"(?m)^#+ .*$", r"\]\((paper/\S+\.svg)\)"):
        assert re.findall(pattern, kept) == re.findall(pattern, made), "run make paper"
    assert "FALSE" not in kept
    assert kept.count("| agrees |") > made.count("| agrees |")
    for name in re.findall(r"\]\((paper/\S+\.svg)\)", kept):
        assert (ROOT / "docs" / name).stat().st_size <= pictures.LARGEST
