"""Snippets that messages offer to be written: each is accepted as it is printed."""

from __future__ import annotations

import ast
import re
from functools import cache
from pathlib import Path

import pytest
import yaml

from crescentlab.circuit import Circuit
from crescentlab.library import installed
from crescentlab.netlist import Netlist

ROOT = Path(__file__).parents[1]
SNIPPET = re.compile(r"(\w+)?(?:: )?(\{type: [^{}]*\})")


@cache
def snippets() -> tuple[str, ...]:
    """``{type: ...}`` in the kernel's texts, without those that leave something to be filled in."""
    found: set[str] = set()
    for path in sorted((ROOT / "crescentlab").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                found |= {match[2] for match in SNIPPET.finditer(node.value) if "..." not in match[2]}
    return tuple(sorted(found))


@pytest.mark.parametrize("text", snippets())
def test_a_snippet_is_accepted_as_printed(text: str) -> None:
    """As a component of a circuit, or as its fluid: no parameter missing, none unknown, every unit right."""
    values = yaml.safe_load(text)
    oil = {"type": "simple_oil", "density": "860 kg/m^3", "kinematic_viscosity": "35 cSt", "bulk_modulus": "14000 bar"}
    fluid = values if values["type"] in installed().fluids else oil
    part = {"type": "tank"} if fluid is values else {k: str(v) for k, v in values.items()}
    data = {"crescentlab": "1", "fluid": fluid, "components": {"part": part}}
    assert "part" in Circuit(Netlist.of(data), library=installed()).design().instances


def test_there_are_snippets() -> None:
    """For what gives pressure, motion and speed, at least."""
    assert {"capacity", "mass", "speed_source"} <= {yaml.safe_load(text)["type"] for text in snippets()}


def test_the_mass_that_a_rod_asks_for_makes_the_circuit_complete() -> None:
    """A cylinder against a force: what the message says to insert, written as it stands, gives a circuit that runs."""
    parts = {"pump": {"type": "pressure_source", "pressure": "100 bar"}, "hole": {"type": "orifice", "area": "10 mm^2"},
             "drain": {"type": "orifice", "area": "10 mm^2"}, "load": {"type": "force_source", "force": "-1 kN"},
             "cylinder": {"type": "double_acting_cylinder", "piston_diameter": "50 mm", "stroke": "300 mm",
                          "cap_dead_volume": "50 cm^3", "rod_dead_volume": "50 cm^3"},
             "tank": {"type": "tank"}}  # fmt: skip
    nets = {"a": ["pump.port", "hole.a"], "b": ["hole.b", "cylinder.cap"], "c": ["cylinder.annulus", "drain.a"],
            "d": ["drain.b", "tank.port"], "rod": ["cylinder.rod", "load.rod"]}  # fmt: skip
    oil = {"type": "simple_oil", "density": "860 kg/m^3", "kinematic_viscosity": "35 cSt", "bulk_modulus": "14000 bar"}
    data = {"crescentlab": "1", "fluid": oil, "components": parts, "nets": nets, "simulation": {"stop": "1 ms"}}
    with pytest.raises(Exception, match="insert a mass, for example") as told:
        Circuit(Netlist.of(data), library=installed()).system()
    match = re.search(r"\{type: [^{}]*\}", str(told.value))
    assert match is not None
    parts["mass"] = yaml.safe_load(match[0])
    nets["rod"].append("mass.port")
    assert Circuit(Netlist.of(data), library=installed()).simulate().trajectory.status == "done"
