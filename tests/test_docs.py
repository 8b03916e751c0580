"""The manual stays true: its examples run and give the numbers it states, its tables and links are complete."""

from __future__ import annotations

import importlib.util
import re
import shutil
from math import expm1
from pathlib import Path

import pytest
from pydantic import BaseModel

import crescentlab as cl
from crescentlab.expressions import FUNCTIONS
from crescentlab.netlist import CircuitFile, NetSection, PlotSection, SimulationSection

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
PAGES = [*sorted(DOCS.glob("*.md")), ROOT / "CONTRIBUTING.md"]


@pytest.fixture(scope="module")
def examples(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with every example of the manual that begins `# file: NAME`, and the parts they use."""
    folder = tmp_path_factory.mktemp("examples")
    for page in DOCS.glob("*.md"):
        for name, text in re.findall(r"```\w+\n# file: (\S+)\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL):
            assert not (folder / name).exists(), f"two examples are called {name}"
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(text, encoding="utf-8")
    shutil.copy(ROOT / "circuits" / "relief_valve_part.yaml", folder)
    return folder


def test_the_check_valve_settles_where_the_page_says(examples: Path) -> None:
    """Half open at 1.25 bar by the orifice equation; 3.58 L/min is rounded by 1.4e-4."""
    result = cl.load(examples / "check_valve.yaml").simulate()
    assert result["line.p"][-1] == pytest.approx(1.25e5, rel=2e-4)
    assert result["valve.lift"][-1] == pytest.approx(0.5, rel=5e-4)


def test_the_disc_bursts_when_the_page_says(examples: Path) -> None:
    """rho V grows by rho_0 q, rho = rho_0 exp(p/beta): t = V/q (exp(p/beta) - 1); rtol of the run is 1e-6."""
    result = cl.load(examples / "burst_disc.yaml").simulate()
    burst = result.time[result["disc.burst"] > 0.5][0]
    assert burst == pytest.approx(1e-3 / 5e-5 * expm1(5e5 / 1.4e9), rel=1e-5)
    assert burst == pytest.approx(7.144e-3, abs=5e-7)


def test_the_relief_bench_runs(examples: Path) -> None:
    """30 L/min pass a valve that opens at 6.5 bar, and `stop_when` has no reason to act at once."""
    result = cl.load(examples / "relief_bench.yaml").simulate()
    assert 6.5e5 < result["line.p"][-1] <= 9.0e5 * (1 + 1e-9)
    assert result["loss"][-1] == pytest.approx(result["p_line.p"][-1] * result["valve.q"][-1])


def test_the_part_joins_a_circuit(examples: Path) -> None:
    """The subcircuit of the page, filled by a flow source: its inflow is the source's."""
    circuit = examples / "filled.yaml"
    circuit.write_text(
        "crescentlab: 1\n"
        "fluid: {type: simple_oil, density: 860 kg/m^3, kinematic_viscosity: 35 cSt, bulk_modulus: 14000 bar}\n"
        "components:\n"
        "  supply: {type: capacity, volume: 1 cm^3}\n"
        "  pump: {type: flow_source, flow: 6 L/min}\n"
        "  part: {type: ./restricted_line_part.yaml, volume: 50 cm^3}\n"
        "nets:\n"
        "  p: [pump.port, supply.port, part.inlet]\n"
        "  end: [part.outlet]\n"
        "simulation: {stop: 5 ms}\n"
    )
    result = cl.load(circuit).simulate()
    assert result["part.q"][-1] == pytest.approx(1e-4 * 50 / 51, rel=0.01)  # the rest fills the small volume


def test_the_table_of_units_is_current() -> None:
    spec = importlib.util.spec_from_file_location("make_units_table", DOCS / "make_units_table.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert (DOCS / "units.md").read_text(encoding="utf-8") == module.table(), "run python docs/make_units_table.py"


@pytest.mark.parametrize("section", [CircuitFile, SimulationSection, PlotSection, NetSection])
def test_every_key_of_a_circuit_file_is_described(section: type[BaseModel]) -> None:
    text = (DOCS / "circuit_files.md").read_text(encoding="utf-8")
    for key in section.model_fields:
        assert re.search(rf"\b{key}:", text), f"circuit_files.md says nothing of {key}:"


def test_the_solvers_and_functions_are_listed() -> None:
    text = re.sub(r"\n> ?", " ", (DOCS / "circuit_files.md").read_text(encoding="utf-8"))
    assert ", ".join(FUNCTIONS) in text
    assert ", ".join(SimulationSection.model_fields["solver"].annotation.__args__) in text  # type: ignore[union-attr]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)]+)\)", text):
        name, _, anchor = target.partition("#")
        linked = (page.parent / name) if name else page
        assert linked.is_file(), f"{page.name} links to {target}"
        if anchor:
            titles = re.findall(r"(?m)^#+ (.*)$", linked.read_text(encoding="utf-8"))
            assert anchor in [re.sub(r"[^\w -]", "", title).lower().replace(" ", "-") for title in titles]


def test_every_page_is_reached_from_the_index() -> None:
    text = (DOCS / "index.md").read_text(encoding="utf-8")
    for page in DOCS.glob("*.md"):
        assert page.name == "index.md" or f"({page.name})" in text, f"index.md does not name {page.name}"
