"""What messages tell to write: it works as it is printed, and nothing is offered that means something else."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

import crescentlab as cl
from crescentlab import domain
from crescentlab.circuit import shipped
from crescentlab.cli import main
from crescentlab.expressions import names_in
from crescentlab.netlist import FLUID, Netlist
from crescentlab.yaml_text import parse

OIL = parse(FLUID, "fluid").plain()
SNIPPET = re.compile(r"\{type: [^{}]*\}")


def circuit(components: dict[str, Any], nets: dict[str, list[str]], **more: Any) -> cl.Circuit:
    return cl.Circuit(Netlist.of({"crescentlab": "1", "fluid": OIL, "components": components, "nets": nets, **more}))


def told(made: cl.Circuit) -> str:
    with pytest.raises(cl.InputError) as caught:
        made.system()
    return str(caught.value)


def printed(said: str) -> dict[str, str]:
    """The component that a message prints."""
    found = SNIPPET.search(said)
    assert found, said
    plain: dict[str, str] = parse(found[0], "message").plain()
    return plain


FORCE = {"type": "force_source", "force": "5 N"}
MISSING: dict[str, tuple[dict[str, Any], dict[str, list[str]], str, str]] = {
    "volume": (
        {"pump": {"type": "flow_source", "flow": "1 L/min"}, "hole": {"type": "orifice", "area": "5 mm^2"},
         "tank": {"type": "tank"}},
        {"n": ["pump.port", "hole.a"], "t": ["hole.b", "tank.port"]}, "n", "port",
    ),
    "mass": ({"push": FORCE}, {"n": ["push.rod"]}, "n", "port"),
    "shaft": (
        {"pump": {"type": "fixed_displacement_pump", "displacement": "10 cm3/rev"}, "low": {"type": "tank"},
         "out": {"type": "tank"}},
        {"i": ["pump.inlet", "low.port"], "o": ["pump.outlet", "out.port"], "s": ["pump.shaft"]}, "s", "shaft",
    ),
    "pressure signal": (
        {"source": {"type": "signal_pressure_source"}, "plug": {"type": "plug"}},
        {"p": ["source.port", "plug.port"], "s": ["source.pressure"]}, "s", "y",
    ),
    "flow signal": (
        {"source": {"type": "signal_flow_source"}, "line": {"type": "capacity", "volume": "1 L"}},
        {"p": ["source.port", "line.port"], "s": ["source.flow"]}, "s", "y",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", MISSING)
def test_what_is_to_be_inserted_passes_as_printed(case: str) -> None:
    components, nets, net, port = MISSING[case]
    said = told(circuit(components, nets))
    part = printed(said)
    assert f"its {port} on this net" in said
    whole = circuit({**components, "new": part}, {**nets, net: [*nets[net], f"new.{port}"]})
    assert whole.system().state_names is not None


def test_what_comes_between_two_givers_passes_as_printed() -> None:
    tanks = {"one": {"type": "tank"}, "two": {"type": "tank", "pressure": "1 bar"}}
    part = printed(told(circuit(tanks, {"n": ["one.port", "two.port"]})))
    circuit({**tanks, "new": part}, {"a": ["one.port", "new.a"], "b": ["two.port", "new.b"]}).system()


def test_a_fluid_passes_as_printed() -> None:
    parts = {"pump": {"type": "flow_source", "flow": "1 L/min"}, "line": {"type": "capacity", "volume": "1 L"}}
    text = {"crescentlab": "1", "components": parts, "nets": {"n": ["pump.port", "line.port"]}}
    said = told(cl.Circuit(Netlist.of(text)))
    cl.Circuit(Netlist.of({**text, "fluid": printed(said)})).system()


@pytest.mark.parametrize("kind", [domain.HYDRAULIC, domain.TRANSLATIONAL, domain.ROTATIONAL])
def test_every_domain_names_a_whole_part(kind: domain.Domain) -> None:
    """Each giver that a domain names has all its required parameters."""
    from crescentlab.library import installed

    part = printed(kind.giver)
    cls = installed().component(part.pop("type"))
    assert {name for name, field in cls.model_fields.items() if field.is_required()} <= part.keys()
    cls.model_validate(part)


KEYS: dict[str, tuple[dict[str, str], str, str]] = {
    "speed of a pump": (
        {"type": "fixed_displacement_pump", "displacement": "10 cm3/rev", "speed": "1500 rpm"},
        "it comes in through the port shaft", "creep_speed",
    ),
    "force on a mass": (
        {"type": "mass", "mass": "1 kg", "force": "5 N"}, "it comes in through the port port", "did you mean",
    ),
    "velocity of a mass": (
        {"type": "mass", "mass": "1 kg", "velocity": "1 m/s"}, "the part itself gives it", "did you mean",
    ),
    "pressure of a valve": (
        {"type": "relief_valve", "area": "5 mm^2", "pressure": "10 bar"}, "did you mean cracking_pressure?", "opening",
    ),
    "a port": ({"type": "orifice", "area": "5 mm^2", "a": "p_line"}, "it is a port", "did you mean"),
    "a slip": ({"type": "orifice", "aera": "5 mm^2"}, "did you mean area", "port"),
    "another quantity": (
        {"type": "relief_valve", "area": "5 mm^2", "opening": "5 mm"}, "unknown key 'opening': known:",
        "did you mean opening_range",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", KEYS)
def test_a_key_is_answered_by_what_takes_it(case: str) -> None:
    part, said, never = KEYS[case]
    message = told(circuit({"part": part}, {}))
    assert said in message
    assert never not in message


# -- parameters that nobody uses -------------------------------------------------------------------


def unused(**parameters: str) -> cl.Circuit:
    parts = {
        "pump": {"type": "flow_source", "flow": "= supply_flow"}, "line": {"type": "capacity", "volume": "1 L"},
    }  # fmt: skip
    return circuit(
        parts, {"n": ["pump.port", "line.port"]}, parameters={"supply_flow": "1 L/min", **parameters},
        outputs={"over": "= n.p - zero"}, simulation={"stop": "10 ms", "stop_when": "line.p > limit"},
    )  # fmt: skip


def test_a_parameter_that_nobody_uses_is_told() -> None:
    """Used are those of components, outputs and stop rules, and what these are made of; not what only idle ones use."""
    made = unused(zero="= nothing * 1", nothing="0 bar", limit="90 bar", suply_flow="2 L/min", idle="= root", root="1")
    warnings = made.design().warnings
    assert [re.findall(r"parameter '(\w+)'", said) for said in warnings] == [["suply_flow"], ["idle"], ["root"]]
    assert warnings[0].endswith("nothing uses the parameter 'suply_flow'; did you mean supply_flow?")
    assert "write = idle where it belongs, or remove it" in warnings[1]
    assert set(warnings) <= set(made.simulate().warnings)


def test_check_and_simulate_tell_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = shipped()["orifice_bench"].read_text(encoding="utf-8")
    assert "\nparameters:\n" in text
    path = tmp_path / "bench.yaml"
    path.write_text(text.replace("\nparameters:\n", "\nparameters:\n  needless: 3 bar\n"), encoding="utf-8")
    line = 1 + path.read_text(encoding="utf-8").split("\n").index("  needless: 3 bar")
    said = f"{path}:{line}: nothing uses the parameter 'needless'"
    for command in (["check", str(path)], ["simulate", str(path), "-o", "none"]):
        assert main(command) == 0
        assert f"warning: {said}" in capsys.readouterr().out.replace("\n", "")
        assert main([*command, "--json"]) == 0
        assert any(each.startswith(said) for each in json.loads(capsys.readouterr().out)["warnings"])


@pytest.mark.parametrize("name", shipped())
def test_shipped_circuits_use_their_parameters(name: str) -> None:
    assert cl.load(name).design().warnings == ()


def test_names_in_an_expression() -> None:
    assert names_in("= max(a, b.c) * pi + 2 L/min - x[2]") == {"a", "b.c", "x"}
    assert names_in("= where(p.x > 3 bar, half, 1)") == {"p.x", "half"}
    assert names_in("no ( expression") == set()


def test_a_long_chain_of_parameters() -> None:
    """Three thousand parameters, each made of the one before: no depth of Python's own ends it."""
    chain = {f"p{k}": f"= p{k - 1} + 1 bar" for k in range(1, 3000)}
    made = unused(zero="0 bar", limit="= p2999", **dict(reversed(chain.items())), p0="1 bar")
    assert made.design().parameters[""]["limit"].value == pytest.approx(3000e5)
    assert made.design().warnings == ()
