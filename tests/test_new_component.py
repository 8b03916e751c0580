"""`crescentlab new component`: what it writes keeps the contract and runs; what it cannot name is refused."""

from __future__ import annotations

import importlib.util
import math
from pathlib import Path

import pytest
from crescentlab.components.fluids import SimpleOil
from refusing import Refusal

import crescentlab as cl
from crescentlab.component import Component
from crescentlab.contract import check_component

OIL = SimpleOil(density=860.0, kinematic_viscosity=35e-6, bulk_modulus=1.4e9)

CIRCUIT = """\
crescentlab: 1
library: [./my_valve.py]
fluid: {type: simple_oil, density: 860 kg/m^3, kinematic_viscosity: 35 cSt, bulk_modulus: 14000 bar}
components:
  source: {type: pressure_source, pressure: 10 bar}
  valve: {type: my_valve, area: 5 mm^2}
  tank: {type: tank}
nets:
  p_source: [source.port, valve.a]
  p_tank: [valve.b, tank.port]
simulation: {stop: 1 ms}
"""


def defined(path: Path, name: str) -> type[Component]:
    """The class of a Python file."""
    spec = importlib.util.spec_from_file_location(f"written_{path.stem}", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    found = getattr(module, name)
    assert issubclass(found, Component)
    return found


@pytest.mark.parametrize(
    ("given", "file", "name"),
    [("my_valve", "my_valve", "MyValve"), ("MyValve", "my_valve", "MyValve"), ("IRCDuct2", "irc_duct2", "IRCDuct2")],
)
def test_what_is_written_keeps_the_contract(refused: Refusal, given: str, file: str, name: str) -> None:
    """As it is written, as a class with usual numbers and with those of its own test."""
    code, out, err = refused.run("new", "component", given)
    assert (code, err) == (0, "")
    assert out.splitlines()[:2] == [f"{file}.py", f"test_{file}.py"]
    cls = defined(refused.folder / f"{file}.py", name)
    assert cls.type_name() == file
    check_component(cls, OIL)
    check_component(cls(area=5e-6), OIL)
    assert f"from {file} import {name}\n" in (refused.folder / f"test_{file}.py").read_text(encoding="utf-8")


def test_a_circuit_uses_it(refused: Refusal) -> None:
    """The lines that the command prints do; 0.7 A sqrt(2 rho dp)/rho_0 at rho of 5 bar, its rounding is 1e-9 here."""
    _, out, _ = refused.run("new", "component", "my_valve")
    assert "library: [./my_valve.py]" in out
    assert "{type: my_valve, area: 5 mm^2}" in out
    refused.write({"c.yaml": CIRCUIT})
    flow = cl.load(refused.folder / "c.yaml").simulate()["valve.q"][-1]
    assert flow == pytest.approx(0.7 * 5e-6 * math.sqrt(2 * 10e5 * math.exp(5e5 / 1.4e9) / 860), rel=1e-8)


def test_the_folder_is_made(refused: Refusal) -> None:
    code, out, _ = refused.run("new", "component", "my_valve", "--folder", "parts/own")
    assert code == 0
    assert out.splitlines()[0] == str(Path("parts/own/my_valve.py"))
    assert {path.name for path in (refused.folder / "parts" / "own").iterdir()} == {"my_valve.py", "test_my_valve.py"}


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("orifice", "the type 'orifice' already exists (crescentlab components orifice); choose another name"),
        ("LaxWendroffLine", "the type 'lax_wendroff_line' already exists"),
        ("simple_oil", "the type 'simple_oil' already exists"),
        ("class", "'class' is a keyword of Python; write for example class_valve"),
        ("None", "'None' is a keyword of Python; write for example none_valve"),
        ("my-valve", "'my-valve' cannot be a component's name; write it as my_valve or MyValve"),
        ("My_valve", "cannot be a component's name"),
        ("2_way", "cannot be a component's name"),
        ("../valve", "cannot be a component's name"),
        ("", "cannot be a component's name"),
        ("valve_2", "'valve_2': its class, Valve2, would be the type 'valve2'; write valve2"),
        ("field", "'field' has a meaning of its own in a component's file; write for example my_field"),
        ("Component", "has a meaning of its own"),
        ("test_valve", "has a meaning of its own"),
        ("random", "Python already has a module 'random'; write for example my_random"),
    ],
)
def test_a_name_is_refused(refused: Refusal, name: str, told: str) -> None:
    assert told in refused.told("new", "component", name)
    assert not list(refused.folder.iterdir())


@pytest.mark.parametrize("there", ["my_valve.py", "test_my_valve.py"])
def test_no_file_is_replaced(refused: Refusal, there: str) -> None:
    refused.write({there: "mine"})
    said = refused.told("new", "component", "my_valve")
    assert said == f"{there} exists; remove it, or choose another name or --folder"
    assert [path.name for path in refused.folder.iterdir()] == [there]
    assert (refused.folder / there).read_text(encoding="utf-8") == "mine"


def test_a_folder_that_is_none(refused: Refusal) -> None:
    refused.write({"here": ""})
    assert refused.told("new", "component", "my_valve", "--folder", "here").startswith(
        "--folder here: cannot be written"
    )


def test_only_components_are_written(refused: Refusal) -> None:
    said = refused.told("new", "circuit", "my_valve")
    assert "invalid choice: 'circuit'" in said
    assert said.endswith("see crescentlab new --help")
