"""The doors for Python: public names, numbers in SI, results read back, one error tree, what ``repr`` says."""

from __future__ import annotations

import ast
import inspect
import re
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import crescentlab as cl
from crescentlab.netlist import Netlist
from crescentlab.result import Result

ROOT = Path(__file__).resolve().parents[1]
OIL = {
    "type": "simple_oil",
    "density": "860 kg/m^3",
    "kinematic_viscosity": "35 cSt",
    "bulk_modulus": "14000 bar",
}
TENSE = {**OIL, "tension": "true"}
"""Oil that goes on below absolute zero: starts from rest swing far."""


@pytest.fixture(scope="module")
def valve() -> cl.Circuit:
    return cl.load("relief_valve")


@pytest.fixture(scope="module")
def run(valve: cl.Circuit) -> Result:
    return valve.simulate()


# -- public names ----------------------------------------------------------------------------------


def test_every_public_name_is_there_sorted_and_documented() -> None:
    assert sorted(cl.__all__) == dir(cl) == list(cl.__all__)
    for name in set(cl.__all__) - {"__version__"}:
        assert inspect.getdoc(getattr(cl, name)), f"cl.{name} has no docstring"


def test_every_question_of_the_readme_is_a_function_under_its_name() -> None:
    questions = re.findall(r"^\| \[`(\w+)`\]", (ROOT / "README.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert questions == ["steady", "periodic", "linearize", "spectrum", "doctor", "sensitivity", "study", "fit"]
    for name in questions:
        assert callable(getattr(cl, name))
        assert name in cl.__all__


@pytest.mark.parametrize(("old", "new"), [("spectra", "spectrum"), ("sensitivities", "sensitivity")])
def test_former_names_stay_with_a_warning(old: str, new: str) -> None:
    with pytest.warns(DeprecationWarning, match=f"crescentlab.{old} is now crescentlab.{new}"):
        assert getattr(cl, old) is getattr(cl, new)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert callable(getattr(cl, new))


def test_what_is_raised_on_purpose_is_of_one_tree() -> None:
    """Exceptions that the kernel defines stand in errors.py; those of control flow never leave their package."""
    inside = {"TooManyStepsError", "_GoneError", "NoRestError", "NotDifferentiableError"}
    for path in (ROOT / "crescentlab").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            bases = [ast.unparse(base) for base in node.bases] if isinstance(node, ast.ClassDef) else []
            if any(base.endswith(("Error", "Exception")) for base in bases) and path.name != "errors.py":
                assert isinstance(node, ast.ClassDef)
                assert node.name in inside, f"{path.name}: {node.name} belongs into errors.py"
    for name in cl.__all__:
        if name.endswith("Error"):
            assert issubclass(getattr(cl, name), cl.CrescentlabError)


# -- numbers are SI --------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", [float, np.float64, np.float32, lambda x: np.array(x)])
def test_numbers_are_si(valve: cl.Circuit, kind: Callable[[float], Any]) -> None:
    """7 bar and 7e5, 24 L/min and 4e-4 m^3/s: the same numbers. np.float32 keeps seven digits."""
    as_text = valve.system({"valve.cracking_pressure": "7 bar", "supply": "24 L/min", "line.start.p": "2 bar"})
    given = {"valve.cracking_pressure": kind(7e5), "supply": kind(4e-4), "line.start.p": kind(2e5)}
    texts = {"valve.cracking_pressure": "7 bar", "supply": "24 L/min", "line.start.p": "2 bar"}
    numbers, wanted = (as_text.values(valve.design(each)) for each in (given, texts))
    assert numbers.p == pytest.approx(wanted.p, rel=1e-7)
    assert numbers.x0 == pytest.approx(wanted.x0, rel=1e-7)


def test_numbers_serve_every_analysis(valve: cl.Circuit) -> None:
    given, text = {"supply": 4e-4}, {"supply": "24 L/min"}
    assert cl.steady(valve, given).result["line.p"] == cl.steady(valve, text).result["line.p"]
    models = [cl.linearize(valve, each, inputs=["supply"], outputs=["line.p"]) for each in (given, text)]
    assert (models[0].A == models[1].A).all()
    found = [cl.sensitivity(valve, "mean(line.p)", "supply", each, stop=0.02) for each in (given, text)]
    assert (found[0].derivative == found[1].derivative).all()
    assert cl.doctor(valve, given, stop=0.01).span == pytest.approx(0.01)


def test_a_number_takes_the_unit_that_a_signal_was_written_in() -> None:
    """`constant` reads its quantity off its unit: 7e5 for `value: 5 bar` is a pressure too."""
    parts = {
        "set": {"type": "constant", "value": "5 bar"},
        "source": {"type": "signal_pressure_source"},
        "plug": {"type": "plug"},
    }
    nets = {"s": ["set.y", "source.pressure"], "p": ["source.port", "plug.port"]}
    circuit = cl.Circuit(Netlist.of({"crescentlab": "1", "fluid": OIL, "components": parts, "nets": nets}))
    assert circuit.simulate(0.01, {"set.value": 7e5})["p.p"][-1] == 7e5


def test_a_number_for_a_parameter_that_is_computed_has_its_quantity() -> None:
    parts = {
        "pump": {"type": "flow_source", "flow": "= flow"},
        "line": {"type": "capacity", "volume": "1 L"},
    }
    text = {
        "crescentlab": "1", "fluid": OIL, "parameters": {"base": "3 L/min", "flow": "= 2 * base"},
        "components": parts, "nets": {"p": ["pump.port", "line.port"]},
    }  # fmt: skip
    design = cl.Circuit(Netlist.of(text)).design({"flow": 1e-4})
    assert design.parameters[""]["flow"].value == 1e-4
    assert design.parameters[""]["flow"].quantity.name == "flow"


WRONG: dict[str, Callable[[cl.Circuit, Result], Any]] = {
    "load": lambda c, r: cl.load(5),  # type: ignore[arg-type]
    "circuit": lambda c, r: cl.Circuit("relief_valve"),  # type: ignore[arg-type]
    "read": lambda c, r: cl.read(None),  # type: ignore[arg-type]
    "read nothing": lambda c, r: cl.read("nowhere.nc"),
    "parameters": lambda c, r: c.simulate(parameters=["supply"]),  # type: ignore[arg-type]
    "name": lambda c, r: c.simulate(parameters={1: 2.0}),  # type: ignore[dict-item]
    "nothing": lambda c, r: c.simulate(parameters={"supply": None}),  # type: ignore[dict-item]
    "not finite": lambda c, r: c.simulate(parameters={"supply": float("nan")}),
    "true": lambda c, r: c.simulate(parameters={"line.volume": True}),
    "out of bounds": lambda c, r: c.simulate(parameters={"line.volume": -1.0}),
    "unknown": lambda c, r: c.simulate(parameters={"suply": 1e-4}),
    "stop": lambda c, r: c.simulate(stop=[1]),  # type: ignore[arg-type]
    "stop in bar": lambda c, r: c.simulate(stop="5 bar"),
    "rtol": lambda c, r: c.simulate(rtol="fine"),  # type: ignore[arg-type]
    "solver": lambda c, r: c.simulate(solver=5),  # type: ignore[arg-type]
    "output_step": lambda c, r: c.simulate(output_step={}),  # type: ignore[arg-type]
    "max_step": lambda c, r: c.simulate(max_step=()),  # type: ignore[arg-type]
    "start": lambda c, r: c.simulate(start=5),  # type: ignore[arg-type]
    "period": lambda c, r: c.period(c.design(), []),  # type: ignore[arg-type]
    "variable": lambda c, r: r["line.q2"],
    "number": lambda c, r: r[5],  # type: ignore[index]
    "mean": lambda c, r: r.mean("line.p", start=[]),  # type: ignore[arg-type]
    "record": lambda c, r: r.to_dataframe([5]),  # type: ignore[list-item]
    "events": lambda c, r: r.to_dataframe(events="before"),
    "write": lambda c, r: r.write(5),  # type: ignore[arg-type]
    "write xls": lambda c, r: r.write("run.xls"),
    "plot number": lambda c, r: r.plot(5),  # type: ignore[arg-type]
    "plot list of numbers": lambda c, r: r.plot([5]),  # type: ignore[arg-type]
    "plot title": lambda c, r: r.plot("line.p", title=5),  # type: ignore[arg-type]
    "plot path": lambda c, r: r.plot("line.p", path=5),  # type: ignore[arg-type]
    "plot unknown": lambda c, r: r.plot("line.q2"),
    "steady": lambda c, r: cl.steady("relief_valve"),  # type: ignore[arg-type]
    "steady at": lambda c, r: cl.steady(c, at=[]),  # type: ignore[arg-type]
    "steady tolerance": lambda c, r: cl.steady(c, tolerance="x"),  # type: ignore[arg-type]
    "periodic": lambda c, r: cl.periodic(5),  # type: ignore[arg-type]
    "periodic most": lambda c, r: cl.periodic(c, period=0.01, most="x"),  # type: ignore[arg-type]
    "linearize": lambda c, r: cl.linearize(None),  # type: ignore[arg-type]
    "linearize inputs": lambda c, r: cl.linearize(c, inputs=5),  # type: ignore[arg-type]
    "linearize at": lambda c, r: cl.linearize(c, at=5),  # type: ignore[arg-type]
    "spectrum": lambda c, r: cl.spectrum(c, ["line.p"], 0.01),  # type: ignore[arg-type]
    "spectrum period": lambda c, r: cl.spectrum(r, ["line.p"], "x"),
    "doctor": lambda c, r: cl.doctor(5),  # type: ignore[arg-type]
    "doctor line_error": lambda c, r: cl.doctor(c, line_error=[]),  # type: ignore[arg-type]
    "sensitivity": lambda c, r: cl.sensitivity(5, "mean(line.p)", "supply"),  # type: ignore[arg-type]
    "sensitivity outcome": lambda c, r: cl.sensitivity(c, 5, "supply"),  # type: ignore[arg-type]
    "sensitivity parameter": lambda c, r: cl.sensitivity(c, "mean(line.p)", 5),  # type: ignore[arg-type]
    "study": lambda c, r: cl.study(5),  # type: ignore[arg-type]
    "study nothing": lambda c, r: cl.study("nowhere.yaml"),
    "fit": lambda c, r: cl.fit(5),  # type: ignore[arg-type]
    "fit nothing": lambda c, r: cl.fit("nowhere.yaml"),
}


@pytest.mark.parametrize("wrong", WRONG)
def test_what_cannot_be_taken_is_answered_by_a_sentence(valve: cl.Circuit, run: Result, wrong: str) -> None:
    """Neither pydantic's error nor Python's own: one sentence of ours."""
    with pytest.raises(cl.InputError) as caught:
        WRONG[wrong](valve, run)
    said = str(caught.value)
    assert "\n" not in said
    assert "pydantic" not in said
    assert len(said) > 20


# -- results ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".nc", ".parquet", ".csv"])
def test_a_file_gives_what_the_run_gave(run: Result, tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"run{suffix}"
    run.write(path)
    back = cl.read(path)
    assert isinstance(back, cl.Result)
    assert back.names == run.names
    assert (back.time == run.time).all()
    for name in run.names:
        assert (back[name] == run[name]).all()
        assert back.quantity(name).si == run.quantity(name).si
    assert back.mean("line.p", start="10 ms") == run.mean("line.p", start=0.01)
    assert back.to_dataframe(["line.*"]).equals(run.to_dataframe(["line.*"]))
    assert "line.p" in back
    assert "line.nothing" not in back
    assert back.plot("line.p") is not None
    with pytest.raises(cl.InputError, match="not the ledgers of its run; simulate the circuit again"):
        _ = back.balance
    with pytest.raises(cl.InputError, match="a file holds rows of variables"):
        cl.Window(back)
    back.write(tmp_path / f"again{suffix}")
    assert (cl.read(tmp_path / f"again{suffix}")["line.p"] == run["line.p"]).all()


@pytest.mark.parametrize("suffix", [".nc", ".parquet"])
def test_a_run_goes_on_from_a_result_that_was_read(valve: cl.Circuit, run: Result, tmp_path: Path, suffix: str) -> None:
    run.write(tmp_path / f"run{suffix}")
    on, from_file = (valve.simulate("60 ms", start=each) for each in (run, cl.read(tmp_path / f"run{suffix}")))
    assert (on["line.p"] == from_file["line.p"]).all()
    assert cl.read(tmp_path / f"run{suffix}").status == "done"


def test_vectors_are_whole_where_the_file_holds_all_their_elements(tmp_path: Path) -> None:
    parts = {
        "pump": {"type": "flow_source", "flow": "3 L/min"},
        "line": {"type": "distributed_line", "length": "1 m", "diameter": "10 mm", "cells": "4"},
        "can": {"type": "capacity", "volume": "1 L"},
        "hole": {"type": "orifice", "area": "10 mm^2"},
        "tank": {"type": "tank"},
    }
    nets = {"a": ["pump.port", "line.a"], "b": ["line.b", "can.port", "hole.a"], "t": ["hole.b", "tank.port"]}
    text = {"crescentlab": "1", "fluid": TENSE, "components": parts, "nets": nets}
    run = cl.Circuit(Netlist.of(text)).simulate(0.01)
    run.write(tmp_path / "whole.nc")
    run.write(tmp_path / "part.nc", ["line.p_node[2]"])
    whole, part = cl.read(tmp_path / "whole.nc"), cl.read(tmp_path / "part.nc")
    assert (whole["line.p_node"] == run["line.p_node"]).all()
    assert whole["line.p_node"].ndim == 2
    assert part.names == ["line.p_node[2]"]
    assert (part["line.p_node[2]"] == run["line.p_node[2]"]).all()
    with pytest.raises(cl.InputError, match=r"no variable 'line.p_node' was recorded"):
        _ = part["line.p_node"]


def test_a_table_has_one_row_an_instant(tmp_path: Path) -> None:
    """A table's index is unique: the row after an event. Files and ``events="both"`` keep the row before as well."""
    parts = {
        "push": {"type": "force_source", "force": "5 N"},
        "body": {"type": "mass_with_stops", "mass": "1 kg", "high": "2 mm"},
    }
    nets = {"n": ["push.rod", "body.port"]}
    run = cl.Circuit(Netlist.of({"crescentlab": "1", "components": parts, "nets": nets})).simulate(0.1)
    assert (np.diff(run.time) == 0).any(), "the circuit has an event"
    table, both = run.to_dataframe(), run.to_dataframe(events="both")
    assert table.index.is_unique
    assert len(both) == run.time.size > len(table)
    for time in both.index[both.index.duplicated()]:
        assert table["body.v"].loc[time] == both["body.v"].loc[time].iloc[-1]
    assert run.to_xarray().sizes["time"] == len(table)
    assert run.to_xarray(events="both").sizes["time"] == len(both)
    run.write(tmp_path / "run.csv")
    assert cl.read(tmp_path / "run.csv").time.size == len(both)


def test_representations_fit_a_screen_and_say_something(valve: cl.Circuit, run: Result) -> None:
    pump = cl.load("crescent_pump")
    shown = {
        repr(valve): "Relief valve on a constant flow",
        repr(pump): "27 components",
        repr(run): "done, 0 s to 0.05 s",
        repr(pump.simulate("1 ms")): "p_delivery.p",
        repr(cl.steady(valve)): "p_line.p 7.9772 bar",
        repr(cl.linearize(valve, inputs=["supply"], outputs=["line.p"])): "3 states",
        repr(cl.spectrum(run, ["line.p"], 0.01)[0]): "mean 7.9772e+05 Pa",
        repr(cl.doctor(valve)): "0.05 s",
        repr(cl.sensitivity(valve, "mean(line.p)", "supply")): "mean(line.p)",
    }
    for text, said in shown.items():
        assert said in text
        assert len(text) <= 600, "five lines of a screen"


# -- starts ----------------------------------------------------------------------------------------

NODES = {
    "pump": {"type": "flow_source", "flow": "10 L/min"},
    "near": {"type": "capacity", "volume": "50 cm^3", "start": {"p": "9 bar"}},
    "pipe": {"type": "pipe", "length": "4 m", "diameter": "8 mm"},
    "far": {"type": "capacity", "volume": "50 cm^3"},
    "line": {"type": "distributed_line", "length": "1 m", "diameter": "10 mm", "cells": "4"},
    "end": {"type": "capacity", "volume": "50 cm^3"},
    "hole": {"type": "orifice", "area": "10 mm^2"},
    "tank": {"type": "tank"},
}
JOINS = {
    "n1": ["pump.port", "near.port", "pipe.a"], "n2": ["pipe.b", "far.port", "line.a"],
    "n3": ["line.b", "end.port", "hole.a"], "n4": ["hole.b", "tank.port"],
}  # fmt: skip


def nodes(**simulation: str) -> cl.Circuit:
    return cl.Circuit(
        Netlist.of(
            {"crescentlab": "1", "fluid": TENSE, "parameters": {"p_0": "3 bar"}, "components": NODES, "nets": JOINS,
             "simulation": {"stop": "1 s", **simulation}, "outputs": {"over": "= n1.p - p_0"}}
        )
    )  # fmt: skip


def test_one_start_pressure_serves_every_part_that_states_none() -> None:
    """A part's own wins; lines begin at it through their parameter, every node of them."""
    circuit = nodes(start_pressure="= p_0")
    run = circuit.simulate("10 ms")
    starts = {name: np.unique(run[name][0]).tolist() for name in ("near.p", "far.p", "end.p", "line.p_node")}
    assert starts == {"near.p": [9e5], "far.p": [3e5], "end.p": [3e5], "line.p_node": [3e5]}
    own = circuit.simulate("10 ms", {"line.start_pressure": 4e5, "far.start.p": 5e5, "p_0": 2e5})
    assert [float(np.ravel(own[n][0])[0]) for n in ("line.p_node", "far.p", "end.p")] == [4e5, 5e5, 2e5]
    begun = circuit.simulate("20 ms", start=own)
    assert (begun["far.p"][0], begun["end.p"][0]) == (own["far.p"][-1], own["end.p"][-1])


def test_a_run_begins_at_rest_in_one_go() -> None:
    """At the operating point nothing moves, and it is the same as steady's; a start that is given wins."""
    circuit = nodes(start="steady")
    run, point = circuit.simulate(), cl.steady(circuit)
    assert run["n1.p"] == pytest.approx(np.full(run.time.size, point.result["n1.p"][0]), rel=1e-6)
    given = circuit.simulate("20 ms", start=nodes().simulate("10 ms"))
    assert given.time[0] == 0.01
    assert nodes().simulate("10 ms", start="steady")["n1.p"][0] == run["n1.p"][0]


def test_a_derivative_sees_that_the_start_moves() -> None:
    """At rest the drop of an orifice goes with the square of the flow: q/p dp/dq = 2 of what the orifice drops.

    A start that stood still would give 0 at once; the pressure before the orifice is its drop, the fluid's compression
    and the discharge coefficient's slope change it by less than 2 %.
    """
    circuit = nodes(start="steady")
    found = cl.sensitivity(circuit, "initial(n3.p)", "pump.flow", stop="1 ms")
    assert found.relative[0, 0] == pytest.approx(2, rel=0.02)
    assert found.method[0].startswith("central differences")
    with pytest.raises(cl.InputError, match="the run begins at the operating point, which moves"):
        cl.sensitivity(circuit, "initial(n3.p)", "pump.flow", stop="1 ms", method="exact")


def cold() -> cl.Circuit:
    """Thin feeds begin at 0 bar beside a node of 60 bar: their fluid runs the node empty."""
    parts = {
        "pump": {"type": "flow_source", "flow": "3 L/min"},
        "node": {"type": "capacity", "volume": "2 cm^3", "start": {"p": "60 bar"}},
        "feed": {"type": "pipe", "length": "1 m", "diameter": "8 mm"},
        "hole": {"type": "orifice", "area": "3 mm^2"},
        "tank": {"type": "tank"},
    }
    nets = {"n1": ["pump.port", "node.port", "feed.a"], "n2": ["feed.b", "hole.a"], "n3": ["hole.b", "tank.port"]}
    return cl.Circuit(
        Netlist.of({"crescentlab": "1", "fluid": OIL, "components": parts, "nets": nets, "simulation": {"stop": "5 s"}})
    )


def test_a_run_that_dies_of_its_start_says_so() -> None:
    circuit = cold()
    with pytest.raises(cl.SimulationError) as caught:
        circuit.simulate()
    said = str(caught.value)
    assert "it died of its start, where pressures contradict each other" in said
    assert "feed.p 0 bar, node.p 60 bar" in said
    assert "simulation: {start: steady}" in said
    assert "crescentlab steady circuit and then --start circuit_steady.nc" in said
    assert circuit.simulate(start="steady").status == "done"


# -- what others derive --------------------------------------------------------------------------


OWN_FORM = '''
from typing import ClassVar
from crescentlab.components.pipes import Pipe
from crescentlab.domain import gives_pressure, state
from crescentlab.units import Pressure

class OddPipe(Pipe):
    """Odd."""
    family: ClassVar[bool] = False
    a = gives_pressure("a")
    b = gives_pressure("b")
    odd = state(Pressure, "odd", start=0.0)

    def equations(self, odd, q_a, q_b):
        return {"p_a": odd, "p_b": odd, "der_odd": 1e9 * (q_a + q_b)}
'''


def test_a_subclass_in_one_circuit_changes_no_other(tmp_path: Path) -> None:
    from crescentlab.components.pipes import Pipe

    before = Pipe.forms()
    (tmp_path / "own.py").write_text(OWN_FORM, encoding="utf-8")
    text = {"crescentlab": "1", "fluid": OIL, "components": NODES, "nets": JOINS}
    own = cl.Circuit(Netlist.of({**text, "library": ["./own.py"]}, folder=tmp_path))
    other = cl.Circuit(Netlist.of(text))
    assert "OddPipe" in [form.__name__ for form in own.design().instances["pipe"].forms]
    assert other.design().instances["pipe"].forms == tuple(before) == tuple(Pipe.forms())
    assert type(own.plan().components["pipe"]) is type(other.plan().components["pipe"]), "its own forms come first"
    odd = {**NODES, "pipe": {**NODES["pipe"], "start": {"odd": "1 bar"}}}
    refused = cl.Circuit(Netlist.of({**text, "components": odd}))
    with pytest.raises(cl.InputError, match="no state 'odd' to start"):
        refused.design()


WORD = '''
from pydantic import Field
from crescentlab.component import Component, Equations
from crescentlab.domain import takes_pressure

class Reader(Component):
    """Reads."""
    volumes: str = Field(default="mean", description="a word")
    a = takes_pressure("a")

    def equations(self, p_a):
        return {"q_a": 0.0 * p_a}
'''


def test_the_ledger_is_not_switched_off_by_a_word(tmp_path: Path) -> None:
    (tmp_path / "word.py").write_text(WORD, encoding="utf-8")
    parts = {**NODES, "reader": {"type": "reader"}}
    nets = {**JOINS, "n1": [*JOINS["n1"], "reader.a"]}
    text = {"crescentlab": "1", "library": ["./word.py"], "fluid": TENSE, "components": parts, "nets": nets}
    run = cl.Circuit(Netlist.of(text, folder=tmp_path)).simulate(0.01)
    assert run.balance is not None
    mean = cl.load("crescent_pump").simulate("1 ms", {"volumes": "mean"})
    assert mean.balance is None
    assert mean.unbalanced == {"gears": "volumes: mean keeps its volumes as they are while they displace fluid"}


def test_the_page_on_python_works_as_it_is_printed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    page = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    world: dict[str, Any] = {}
    for block in re.findall(r"```python\n(.*?)```", page, re.DOTALL):
        exec(compile(block, "docs/python.md", "exec"), world)
    assert (world["again"]["line.p"] == world["result"]["line.p"]).all()
    for name in re.findall(r"^\| `cl\.(\w+)\(", page, re.MULTILINE):
        assert name in cl.__all__
