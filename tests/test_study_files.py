"""Study files: what varies becomes the right points, and every mistake is one sentence at its line before any run."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import numpy as np
import pytest
from refusing import MARK, Refusal
from scipy import stats
from scipy.stats import qmc

from crescentlab.errors import InputError
from crescentlab.studies.distributions import SIGMAS, distribution, text_of
from crescentlab.studies.sampling import Point, points, unit_sample
from crescentlab.studies.study_file import Study
from crescentlab.units import QUANTITIES, Quantity
from crescentlab.yaml_text import Node

BLEED = """\
crescentlab: 1
fluid: {type: simple_oil, density: 860 kg/m^3, kinematic_viscosity: 35 cSt, bulk_modulus: 14000 bar}
parameters:
  supply: 6 L/min
  size: 3 mm^2
  holes: 1
  form: wide
components:
  pump: {type: flow_source, flow: = supply}
  line: {type: capacity, volume: 100 cm^3, start: {p: 1 bar}}
  hole: {type: orifice, area: = size, count: = holes}
  tank: {type: tank}
nets:
  p_line: [pump.port, line.port, 'hole.a[*]']
  t_line: ['hole.b[*]', tank.port]
simulation: {stop: 20 ms}
"""

STUDY = """\
crescentlab_study: 1
circuit: bleed.yaml
set: {holes: 1}
vary:
  grid: {supply: [2 L/min, 6 L/min], size: [2 mm^2, 3 mm^2, 4 mm^2]}
run: {stop: 20 ms, window: 5 ms}
measure: {pressure: mean(line.p)}
plots:
  - curves: {x: supply, y: pressure, by: size}
"""
"""Accepted as it stands; the mistakes are edits of it."""

GRID = "  grid: {supply: [2 L/min, 6 L/min], size: [2 mm^2, 3 mm^2, 4 mm^2]}"

KNOWN: dict[str, Quantity | None] = {
    "gap": QUANTITIES["length"], "speed": QUANTITIES["speed"], "share": QUANTITIES["ratio"],
    "oil": QUANTITIES["temperature"], "form": None,
}  # fmt: skip
"""Settings of a circuit that has nothing else."""


def made(tmp_path: Path, vary: str) -> list[Point]:
    """Points of a ``vary:`` section, for settings of known quantities."""
    file = tmp_path / "s.yaml"
    file.write_text(f"crescentlab_study: 1\ncircuit: bleed\nvary:\n{vary}\nmeasure: {{a: mean(b)}}\n", encoding="utf-8")
    return points(Study.read(file), KNOWN.__getitem__)


def column(found: list[Point], name: str) -> np.ndarray:
    """SI numbers of a setting over all points."""
    quantity = KNOWN[name]
    assert quantity is not None
    return np.array([quantity.parse(point.settings[name]) for point in found])


# -- points --------------------------------------------------------------------------------------


def test_a_grid_is_the_product_of_its_values(tmp_path: Path) -> None:
    found = made(tmp_path, "  grid: {form: [a, b], gap: {from: 1 mm, to: 2 mm, count: 3}, share: 50 %}")
    texts = [tuple(point.settings.values()) for point in found]
    assert texts == list(itertools.product(["a", "b"], ["1 mm", "1.5 mm", "2 mm"], ["50 %"]))


def test_ranges_are_written_by_count_by_step_and_logarithmically(tmp_path: Path) -> None:
    """A geometric sequence has equal ratios; a step of 0.1 mm leads from 0.1 to 0.3 mm in three values."""
    logarithmic = column(made(tmp_path, "  grid: {gap: {from: 1 um, to: 1 mm, count: 7, spacing: log}}"), "gap")
    assert logarithmic[1:] / logarithmic[:-1] == pytest.approx(np.full(6, math.sqrt(10)), rel=1e-11)
    stepped = made(tmp_path, "  grid: {gap: {from: 0.1 mm, to: 0.3 mm, step: 100 um}}")
    assert [point.settings["gap"] for point in stepped] == ["0.1 mm", "0.2 mm", "0.3 mm"]


def test_a_finer_range_keeps_the_points_of_the_coarser(tmp_path: Path) -> None:
    coarse, fine = (
        {p.settings["gap"] for p in made(tmp_path, f"  grid: {{gap: {{from: 0 um, to: 70 um, count: {n}}}}}")}
        for n in (8, 22)
    )
    assert len(coarse) == 8
    assert coarse < fine


def test_lists_go_together_row_by_row_and_sections_multiply(tmp_path: Path) -> None:
    found = made(tmp_path, "  list: {gap: [1 mm, 2 mm], form: [a, b]}\n  grid: {share: [0.1, 0.2, 0.3]}")
    rows = [(p.settings["gap"], p.settings["form"], p.settings["share"]) for p in found]
    assert rows == [(*pair, s) for pair in (("1 mm", "a"), ("2 mm", "b")) for s in ("0.1", "0.2", "0.3")]


def test_sobol_points_are_those_of_scipy_and_a_longer_sequence_keeps_them(tmp_path: Path) -> None:
    """Reference: scipy.stats.qmc.Sobol with Owen's scrambling of the same seed, scaled to the ranges."""
    vary = "  sobol: {{count: {}, seed: 7, parameters: {{gap: [1 mm, 3 mm], speed: [1000 rpm, 4000 rpm]}}}}"
    found = made(tmp_path, vary.format(32))
    reference = qmc.Sobol(2, scramble=True, rng=np.random.default_rng(7)).random_base2(5)
    assert column(found, "gap") == pytest.approx(1e-3 + 2e-3 * reference[:, 0], rel=1e-14)
    rpm = 2 * math.pi / 60
    assert column(found, "speed") == pytest.approx((1000 + 3000 * reference[:, 1]) * rpm, rel=1e-14)
    assert made(tmp_path, vary.format(11)) == found[:11]
    assert made(tmp_path, vary.format(100))[:32] == found


def test_a_latin_hypercube_has_one_point_in_every_layer(tmp_path: Path) -> None:
    """The definition: each of the n equal layers of each range holds exactly one of the n points."""
    vary = "  latin_hypercube: {count: 50, seed: 2, parameters: {gap: [1 mm, 3 mm], share: [0, 1]}}"
    found = made(tmp_path, vary)
    for values in ((column(found, "gap") - 1e-3) / 2e-3, column(found, "share")):
        assert sorted(np.floor(values * 50).astype(int)) == list(range(50))
    assert made(tmp_path, vary) == found


def test_random_points_are_functions_of_seed_and_index_alone() -> None:
    first, more = unit_sample("monte_carlo", 20, 3, 5), unit_sample("monte_carlo", 40, 3, 5)
    assert (more[:20] == first).all()
    assert not np.isin(unit_sample("monte_carlo", 20, 3, 6), first).any()


@pytest.mark.parametrize(
    ("text", "reference"),
    [
        ("{normal: 150 um, sd: 10 um}", stats.norm(150e-6, 10e-6)),
        ("{normal: 150 um, sd: 10 um, low: 140 um}", stats.truncnorm(-1, np.inf, 150e-6, 10e-6)),
        ("[130 um, 170 um]", stats.uniform(130e-6, 40e-6)),
        ("{uniform: [130 um, 170 um]}", stats.uniform(130e-6, 40e-6)),
        ("{log_uniform: [1 um, 1 mm]}", stats.loguniform(1e-6, 1e-3)),
        ("{triangular: [0 mm, 1 mm, 4 mm]}", stats.triang(0.25, 0, 4e-3)),
        ("150 um +- 20 um", stats.truncnorm(-SIGMAS, SIGMAS, 150e-6, 20e-6 / SIGMAS)),
        ("150 um ± 20 %", stats.truncnorm(-SIGMAS, SIGMAS, 150e-6, 10e-6)),
        ("{nominal: 150 um, tolerance: 30 um}", stats.truncnorm(-SIGMAS, SIGMAS, 150e-6, 10e-6)),
    ],
)  # fmt: skip
def test_samples_follow_the_distribution_that_is_written(tmp_path: Path, text: str, reference: object) -> None:
    """Kolmogorov and Smirnov: the largest difference of the distribution functions of 2000 points passes at 1 %."""
    found = made(tmp_path, f"  monte_carlo: {{count: 2000, seed: 11, parameters: {{gap: {text}}}}}")
    assert stats.kstest(column(found, "gap"), reference.cdf).pvalue > 0.01  # type: ignore[attr-defined]


def test_a_normal_distribution_has_its_quantiles() -> None:
    """Exact: the quantile at Phi(z) is mean + z sd."""
    z = np.array([-2.0, -1.0, 0.0, 1.0, 2.0])
    node = Node.of({"normal": "20 degC", "sd": "3 K"})
    texts = distribution(node, QUANTITIES["temperature"], "oil").texts(stats.norm.cdf(z))
    assert [QUANTITIES["temperature"].parse(t) for t in texts] == pytest.approx(293.15 + 3 * z, rel=1e-13)


def test_choices_come_as_often_as_their_weights_say(tmp_path: Path) -> None:
    """4000 draws: the share of a word of probability 3/4 lies within 3 standard deviations, 0.0205."""
    vary = "  monte_carlo: {count: 4000, seed: 1, parameters: {form: {choice: [wide, narrow], weights: [3, 1]}}}"
    words = [point.settings["form"] for point in made(tmp_path, vary)]
    assert words.count("wide") / 4000 == pytest.approx(0.75, abs=3 * math.sqrt(0.75 * 0.25 / 4000))
    assert set(words) == {"wide", "narrow"}


def test_corners_are_all_ends_and_the_nominal_point(tmp_path: Path) -> None:
    found = made(tmp_path, "  corners: {gap: 150 um +- 20 um, share: [0.1, 0.2, 0.4], speed: 1000 rpm +- 10 %}")
    assert len(found) == 1 + 2**3
    assert len({tuple(point.settings.values()) for point in found}) == 9
    assert found[0].role == "nominal"
    assert column(found, "share").tolist() == [0.2, *[0.1, 0.1, 0.4, 0.4] * 2]
    assert set(column(found, "gap").round(9)) == {130e-6, 150e-6, 170e-6}
    assert column(found, "speed")[1:3] == pytest.approx(np.array([900, 1100]) * math.pi / 30)


def test_one_at_a_time_moves_one_setting_in_each_point(tmp_path: Path) -> None:
    found = made(tmp_path, "  one_at_a_time: {gap: 150 um +- 20 um, share: [0.1, 0.3]}")
    assert [p.role for p in found] == ["nominal", "gap low", "gap high", "share low", "share high"]
    assert column(found, "share") == pytest.approx([0.2, 0.2, 0.2, 0.1, 0.3])
    assert column(found, "gap") == pytest.approx(np.array([150, 130, 170, 150, 150]) * 1e-6)


@pytest.mark.parametrize("quantity", QUANTITIES.values(), ids=lambda q: q.name)
def test_a_number_as_text_is_read_back_to_the_last_bit(quantity: Quantity) -> None:
    for value in (0.1, math.pi * 1e-7, -3.0, 1e22 / 3, 0.0):
        assert quantity.parse(text_of(value, quantity)) == value


# -- mistakes ------------------------------------------------------------------------------------


def vary(section: str) -> str:
    """The study with another ``vary:`` section, its line marked."""
    return STUDY.replace(GRID, f"  {section}{MARK}").replace("  - curves: {x: supply, y: pressure, by: size}", "  []")


MISTAKES = {
    "a key that there is not": (
        STUDY.replace("measure:", "mesure:") .replace("mean(line.p)}", f"mean(line.p)}}{MARK}"),
        "unknown key 'mesure': did you mean measure?"),
    "a circuit that there is not": (
        STUDY.replace("circuit: bleed.yaml", f"circuit: relief_vale{MARK}"), "did you mean relief_valve"),
    "a setting that there is not": (
        vary("grid: {suply: [2 L/min]}"), "nothing has the name suply: did you mean supply"),
    "a fixed setting that there is not": (
        STUDY.replace("set: {holes: 1}", f"set: {{hole: 1}}{MARK}"), "hole: nothing has this name: did you mean holes"),
    "a fixed setting that does not fit": (
        STUDY.replace("set: {holes: 1}", f"set: {{holes: 1 mm}}{MARK}"), "'mm' is a unit of length, not of ratio"),
    "a unit that is missing": (vary("grid: {supply: [2, 3 L/min]}"), "supply: '2': a flow needs a unit"),
    "a unit of something else": (vary("grid: {supply: [2 bar]}"), "'bar' is a unit of pressure"),
    "a range without its end": (vary("grid: {supply: {from: 1 L/min, count: 3}}"), "supply.to is missing"),
    "a range with both count and step": (
        vary("grid: {supply: {from: 1 L/min, to: 2 L/min, count: 3, step: 1 L/min}}"), "write either count or step"),
    "a range of no count": (vary("grid: {supply: {from: 1 L/min, to: 2 L/min, count: 1}}"), "whole number from 2 on"),
    "a step that does not lead there": (
        vary("grid: {supply: {from: 1 L/min, to: 2 L/min, step: 0.3 L/min}}"), "supply.step does not lead"),
    "a misspelt key of a range": (
        vary("grid: {supply: {from: 1 L/min, to: 2 L/min, cuont: 3}}"), "unknown key 'cuont': did you mean count"),
    "a logarithm from zero": (
        vary("grid: {supply: {from: 0 L/min, to: 2 L/min, count: 3, spacing: log}}"), "from and to above 0"),
    "a value twice": (vary("grid: {supply: [2 L/min, 2 L/min]}"), "'2 L/min' stands twice"),
    "nothing": (STUDY.replace(f"vary:\n{GRID}", f"vary: {{}}{MARK}"), "nothing varies"),
    "a range of words": (vary("sobol: {count: 4, parameters: {form: [1, 2]}}"), "form is a word, which has no range"),
    "lists of different lengths": (
        vary("list: {supply: [1 L/min, 2 L/min], size: [1 mm^2]}"), "supply has 2, size has 1"),
    "a setting that is also fixed": (vary("grid: {holes: [1, 2]}"), "holes stands in set too"),
    "a distribution that there is not": (
        vary("monte_carlo: {count: 4, parameters: {supply: {norml: 6 L/min, sd: 1 L/min}}}"), "did you mean normal"),
    "a normal distribution without its width": (
        vary("monte_carlo: {count: 4, parameters: {supply: {normal: 6 L/min}}}"), "supply.sd is missing"),
    "ends in the wrong order": (
        vary("monte_carlo: {count: 4, parameters: {supply: [6 L/min, 2 L/min]}}"), "first number must lie below"),
    "a count that is none": (vary("sobol: {count: many, parameters: {supply: [1 L/min, 2 L/min]}}"), "whole number"),
    "a tolerance that is none": (vary("corners: {supply: 6 L/min}"), "not a value with its tolerance"),
    "a tolerance of nothing": (vary("corners: {supply: 6 L/min +- 0 %}"), "a tolerance of 0 varies nothing"),
    "a variable that there is not": (
        STUDY.replace("mean(line.p)}", f"mean(lin.p)}}{MARK}"), "no variable or parameter 'lin.p'"),
    "an outcome that is a series": (STUDY.replace("mean(line.p)}", f"line.p}}{MARK}"), "is a series over time"),
    "an outcome that adds bars and metres": (
        STUDY.replace("mean(line.p)}", f"mean(line.p) + 1 mm}}{MARK}"), "cannot add"),
    "an outcome called as a column of every table": (
        STUDY.replace("{pressure: mean", "{status: mean").replace("mean(line.p)}", f"mean(line.p)}}{MARK}"),
        "a column 'status' of its own"),
    "an outcome called as what varies": (
        STUDY.replace("{pressure: mean", "{supply: mean").replace("mean(line.p)}", f"mean(line.p)}}{MARK}"),
        "'supply' is what varies"),
    "a time without a unit": (STUDY.replace("stop: 20 ms, window: 5 ms}", f"stop: 20}}{MARK}"), "a time needs a unit"),
    "an expression for a time that is none": (
        STUDY.replace("stop: 20 ms, window: 5 ms}", f"stop: = supply}}{MARK}"), "the expression gives a flow"),
    "a window longer than the run": (
        STUDY.replace("window: 5 ms}", f"window: 100 ms}}{MARK}"),
        "run.window: 100 ms is longer than the run with stop: 20 ms"),
    "a window longer than the circuit's own run": (
        STUDY.replace("stop: 20 ms, window: 5 ms}", f"window: = 2 * size / (1 m^2/s) * 1e5}}{MARK}"),
        "longer than the run of 0.02 s, the circuit's own stop"),
    "a bracket left open": (
        STUDY.replace("{pressure: mean(line.p)}", f"{{pressure: 'mean(line.p'}}{MARK}"), "a bracket is left open"),
    "a solver that there is not": (STUDY.replace("window: 5 ms}", f"solver: rods}}{MARK}"), "did you mean rodas"),
    "a period of a simulation": (
        STUDY.replace("window: 5 ms}", f"period: 5 ms}}{MARK}"), "belongs to analysis: periodic"),
    "a stop rule in the wrong unit": (
        STUDY.replace("stop: 20 ms, window: 5 ms}", f"until: {{settled: line.p, within: 1 mm, every: 5 ms}}}}{MARK}"),
        "run.until.within: '1 mm': 'mm' is a unit of length"),
    "a stop rule beside an end": (
        STUDY.replace("window: 5 ms}", f"until: {{settled: line.p, every: 5 ms}}}}{MARK}"), "until brings its own end"),
    "a column that there is not": (
        STUDY.replace("y: pressure, by: size}", f"y: presure, by: size}}{MARK}"), "did you mean pressure"),
    "a tornado of a grid": (
        STUDY.replace("curves: {x: supply, y: pressure, by: size}", f"tornado: pressure{MARK}"), "one_at_a_time"),
    "two pictures in one": (
        STUDY.replace("curves: {x: supply, y: pressure, by: size}", f"{{tornado: pressure, scatter: [a, b]}}{MARK}"),
        "a picture is one of"),
    "text where keys belong": (STUDY.replace("set: {holes: 1}", f"set: holes{MARK}"), "set needs keys"),
}  # fmt: skip


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_told_at_its_line_before_any_run(refused: Refusal, mistake: str) -> None:
    text, said = MISTAKES[mistake]
    refused.write({"bleed.yaml": BLEED})
    assert said in refused(text, command="study")
    assert not Path("c.results").exists()


def test_the_study_that_the_mistakes_are_made_in_is_accepted(refused: Refusal) -> None:
    refused.write({"bleed.yaml": BLEED, "s.yaml": STUDY})
    code, out, err = refused.run("study", "s.yaml", "--dry-run")
    assert (code, err) == (0, "")
    assert [line.split() for line in out.splitlines()][:3] == [
        ["point", "supply", "[L/min]", "size", "[mm2]"],
        ["1", "2", "2"],
        ["2", "2", "3"],
    ]
    assert len(out.splitlines()) == 7
    assert not Path("s.results").exists()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "the file is empty; a study begins with crescentlab_study: 1"),
        ("crescentlab: 1\ncomponents: {}\n", "begins with `crescentlab_study: 1`"),
        ("- a\n", "begins with `crescentlab_study: 1`"),
    ],
)
def test_what_is_no_study_is_refused(refused: Refusal, text: str, said: str) -> None:
    refused.write({"s.yaml": text})
    assert said in refused.told("study", "s.yaml")


def test_a_study_that_is_not_there_is_refused(refused: Refusal) -> None:
    assert "no such file" in refused.told("study", "nowhere.yaml")


def test_numbers_of_an_unknown_setting_are_refused_by_name() -> None:
    with pytest.raises(InputError, match="gap must be one number"):
        distribution(Node.of([["1 mm"], "2 mm"]), QUANTITIES["length"], "gap")
