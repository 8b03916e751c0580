"""Subcircuits, tables, and components by their own laws or by a user's hand: each mistake told at its line."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

import pytest
from refusing import CIRCUIT, OIL, Refusal, edited, with_parts

# -- parts ---------------------------------------------------------------------------------------

PART = """\
crescentlab: 1
ports: {inlet: n}
parameters: {size: 1 cm^3}
components:
  cup: {type: capacity, volume: = size}
nets:
  n: [cup.port]
"""
INNER = edited(
    ("[cup.port]", "[cup.port, deeper.inlet]"), ("nets:", "  deeper: {type: ./b_part.yaml}\nnets:"), text=PART
)

PARTS = {
    "missing file": (
        "{type: ./b_part.yaml} <--",
        {},
        "the subcircuit ./b_part.yaml does not exist; it is looked for beside",
    ),
    "no ports": (
        "{type: ./a_part.yaml} <--",
        {"a_part__yaml": PART.replace("ports: {inlet: n}\n", "")},
        "has no ports; give it some",
    ),
    "port of no net": (
        "{type: ./a_part.yaml}",
        {"a_part__yaml": PART.replace("inlet: n}", "inlet: m} <--")},
        "port 'inlet' names the net 'm', which does not exist: known: n",
    ),
    "unknown parameter": (
        "{type: ./a_part.yaml, siz: 3} <--",
        {"a_part__yaml": PART},
        "part: ./a_part.yaml has no parameter 'siz': did you mean size?",
    ),
    "parameter of another unit": (
        "{type: ./a_part.yaml, size: 3 bar} <--",
        {"a_part__yaml": PART},
        "part.size: '3 bar': 'bar' is a unit of pressure",
    ),
    "expression of another unit": (
        "{type: ./a_part.yaml, size: = supply} <--",
        {"a_part__yaml": PART},
        "gives a flow [m^3/s], where a volume [m^3] belongs",
    ),
    "list for a parameter": (
        "{type: ./a_part.yaml, size: [1 cm^3]} <--",
        {"a_part__yaml": PART},
        "part.size must be one text",
    ),
    "start of a part": (
        "{type: ./a_part.yaml, start: {p: 1 bar}} <--",
        {"a_part__yaml": PART},
        "a subcircuit has no states of its own",
    ),
    "mistake inside": (
        "{type: ./a_part.yaml}",
        {"a_part__yaml": PART.replace("volume: = size}", "volum: 3} <--")},
        "part.cup: unknown key 'volum': did you mean volume?",
    ),
    "itself": ("{type: ./c.yaml} <--", {}, "subcircuits contain each other: c -> c; remove one of these"),
    "each other": (
        "{type: ./a_part.yaml}",
        {"a_part__yaml": INNER, "b_part__yaml": INNER.replace("./b_part.yaml}", "./a_part.yaml} <--")},
        "subcircuits contain each other: c -> a_part -> b_part -> a_part; remove one of these",
    ),
}


@pytest.mark.parametrize(("written", "files", "said"), PARTS.values(), ids=PARTS)
def test_parts(refused: Refusal, written: str, files: dict[str, str], said: str) -> None:
    assert said in refused(with_parts(f"part: {written}"), **files)


def test_port_of_a_part_that_it_does_not_have(refused: Refusal) -> None:
    text = with_parts("part: {type: ./a_part.yaml}").replace("hole.a]", "hole.a, part.outlet] <--")
    assert "subcircuit 'part' has no port 'outlet': did you mean inlet?" in refused(text, a_part__yaml=PART)


# -- tables --------------------------------------------------------------------------------------

WALL = with_parts("wall: {type: compliant_capacity, wall_area: 600 mm^2, deflection: t.csv}")

TABLES = {
    "not sorted": (
        "p [bar], x [mm]\n0,0\n2,2\n1,3 <--\n",
        "x must rise from point to point, but 1 bar follows 2 bar; sort the points",
    ),
    "a value missing": (
        "p [bar], x [mm]\n0,0\n1, <--\n",
        "the cell in the column 'x' is empty",
    ),
    "decimal comma": (
        "p [bar], x [mm]\n0,0\n\n1,5,2 <--\n",
        "3 cells under 2 titles; write one of each, decimals after a point",
    ),
    "a word": ("p [bar], x [mm]\n0,0\n1,two <--\n", "'two' is not a finite number"),
    "nan": ("p [bar], x [mm]\n0,0\n1,nan <--\n", "'nan' is not a finite number"),
    "semicolons": ("p [bar]; x [mm]\n0;0\n1;2;3 <--\n", "3 cells under 2 titles; write one of each"),
    "three columns": ("p [bar], x [mm], v [m/s] <--\n0,0,0\n", "the first line must name two columns with units"),
    "nothing": (" <--\n", "the first line names the columns with units"),
    "unit in the header": (
        "p [bar], x [bar] <--\n0,0\n1,2\n",
        "'bar' is a unit of pressure, not of length",
    ),
    "no unit in the header": ("p, x <--\n0,0\n1,2\n", "a pressure needs a unit"),
    "one point": ("p [bar], x [mm] <--\n0,0\n", "a curve needs at least two points"),
    "an x twice": ("p [bar], x [mm]\n0,0\n1,1\n1,2 <--\n", "1 bar follows 1 bar; leave one of them out"),
}


@pytest.mark.parametrize(("table", "said"), TABLES.values(), ids=TABLES)
def test_tables(refused: Refusal, table: str, said: str) -> None:
    """The line is that of the table; the component and its parameter are named."""
    told = refused(WALL, t__csv=table)
    assert told.startswith("wall.deflection: ")
    assert said in told


@pytest.mark.parametrize(
    ("written", "said"),
    [
        ("no.csv", "cannot read the data no.csv: No such file or directory; it is looked for beside the circuit file"),
        ("{x: [1 bar, 0 bar], y: [0 mm, 1 mm]}", "0 bar follows 1 bar; sort the points"),
        ("{x: [0 bar, 1 bar], y: [0 mm]}", "2 values of x and 1 of y; write as many of each"),
        ("{x: [0 bar, 1 bar], z: [0 mm, 1 mm]}", "write a CSV file's name, or {x: [0 bar, 1 bar], y: [0 mm, 2 mm]}"),
        ("{x: 1 bar, y: [0 mm]}", "x must be a list in brackets"),
        ("[0 bar, 1 bar]", "write a CSV file's name, or {x: "),
    ],
)
def test_tables_in_the_circuit(refused: Refusal, written: str, said: str) -> None:
    assert said in refused(WALL.replace("t.csv}", f"{written}}} <--"))


# -- laws of components, user libraries ----------------------------------------------------------


@pytest.mark.parametrize(
    ("line", "old", "new", "said"),
    [
        ("  gears:\n", "  eccentricity: 6 mm", "  eccentricity: 20 mm", "gears: "),
        (
            "  driver: {type: carry",
            "  driver: {type: carry_over_chain, volumes: = floor(crescent_extension / pitch)",
            "  driver: {type: carry_over_chain, volumes: 4",
            "driver: ",
        ),
    ],
    ids=["gears that cannot mesh", "volumes that do not fit"],
)
def test_laws_of_a_component_name_its_line(refused: Refusal, line: str, old: str, new: str, said: str) -> None:
    """What a component checks by itself is told at its name, and by it."""
    folder = Path(str(resources.files("crescentlab.circuits")))
    for path in folder.iterdir():
        if path.suffix in (".yaml", ".csv"):
            (refused.folder / path.name).write_text(path.read_text(encoding="utf-8"), encoding="utf-8")
    text = edited((old, new), text=(folder / "crescent_pump.yaml").read_text(encoding="utf-8"))
    number = text[: text.index(line)].count("\n") + 1
    refused.write({"c.yaml": text})
    assert refused.told("check", "c.yaml").startswith(f"c.yaml:{number}: {said}")


HEAD = """\
from pydantic import Field
from crescentlab.component import Component
from crescentlab.domain import *
from crescentlab.maths import *
from crescentlab.units import *
"""
LIBRARY = edited((OIL, f"{OIL}\nlibrary: [./mine.py] <--"))
USED = (
    with_parts("mine: {type: mine} <--")
    .replace("hole.a]", "hole.a, mine.port]")
    .replace(OIL, f"{OIL}\nlibrary: [./mine.py]")
)


def mine(body: str, declared: str = "", arguments: str = "p_port", name: str = "Mine") -> str:
    """The text of a user's file with one component."""
    head = f"{HEAD}class {name}(Component):\n    port = takes_pressure('x')\n    {declared}\n"
    return f"{head}    def equations(self, {arguments}):\n        {body}\n"


IMPORTS = {
    "syntax": ("x = 1\ny = (\n", "the library file mine.py, line 2 does not import: SyntaxError: '(' was never closed"),
    "exception": ("x = 1\nraise RuntimeError('no\\nway')\n", "mine.py, line 2 does not import: RuntimeError: no way"),
    "module": ("import nothing_of_this_name\n", "ModuleNotFoundError: No module named 'nothing_of_this_name'"),
    "exit": ("raise SystemExit(0)\n", "does not import: SystemExit: 0"),
    "wrong name": (
        mine("return {'q_port': p_z}", arguments="p_z"),
        "component Mine: equations asks for p_z; its ports and states offer p_port",
    ),
    "no equations": (
        f"{HEAD}class Mine(Component):\n    port = takes_pressure('x')\n",
        "has no equations; write `def equations(self, ...)",
    ),
    "a parameter called start": (
        mine("return {}", "start: Length = 0.0"),
        "a parameter may not be called 'start', which has a meaning of its own",
    ),
    "one name twice": (mine("return {}", "p_port = state(Pressure, 'x')"), "are both called 'p_port'; rename one"),
    "a class that exists": (
        mine("return {}", name="Capacity"),
        "class Capacity would be the type 'capacity', which already exists; rename",
    ),
}
CONTRACT = {
    "undeclared": (
        "return {'q_port': p_port, 'z': 1}",
        "",
        "component Mine: equations returns z, which is not declared: known: q_port",
    ),
    "nothing": ("return {}", "", "equations does not return q_port"),
    "no dictionary": ("return None", "", "equations must return a dictionary, not NoneType"),
    "a word": ("return {'q_port': 'much'}", "", "q_port is 'much', not a number or an expression"),
    "a float": ("return {'q_port': float(p_port)}", "", "use crescentlab.maths instead of math or float()"),
    "an if": ("return {'q_port': 1 if p_port > 0 else 0}", "", "use where(), &, | and not_()"),
    "a vector": ("return {'q_port': stack(p_port, p_port)}", "", "q_port has shape (2,), its declaration says ()"),
    "an event of nothing": (
        "return {'q_port': p_port, 'e': when(p_port > 0, z=1)}",
        "",
        "event e sets z, which is no state or held value",
    ),
    "a period of zero": (
        "return {'q_port': p_port, 'e': every(0.0)}",
        "",
        "mine.e: its period is 0 s; it must be above 0",
    ),
    "no attribute": ("return {'q_port': self.z}", "", "AttributeError: 'Mine' object has no attribute 'z'"),
    "a size": ("return {'q_port': p_port, 'der_x': x}", "x = state(Length, 'x', size='z')", "no size: AttributeError"),
    "a start": (
        "return {'q_port': p_port, 'der_x': 0}",
        "x = state(Length, 'x', start='z')",
        "no start value for x (AttributeError",
    ),
}


@pytest.mark.parametrize(("code", "said"), IMPORTS.values(), ids=IMPORTS)
def test_libraries_that_do_not_import(refused: Refusal, code: str, said: str) -> None:
    assert said in refused(LIBRARY, mine__py=code)


@pytest.mark.parametrize(("body", "declared", "said"), CONTRACT.values(), ids=CONTRACT)
def test_components_that_break_the_contract(refused: Refusal, body: str, declared: str, said: str) -> None:
    assert said in refused(USED, mine__py=mine(body, declared))


def test_library_files(refused: Refusal) -> None:
    """A missing file, one that is no Python, and one that is not wanted; a mended one is read anew."""
    assert "mine.py does not exist; it is looked for beside" in refused(LIBRARY)
    assert "its name must end in .py" in refused(LIBRARY.replace("mine.py", "mine.txt"), mine__txt="")
    assert "./mine.py would run Python code, which --no-code refuses" in refused(LIBRARY, "--no-code", mine__py="x = 1")
    assert "does not import" in refused(LIBRARY, mine__py="x = ")
    refused.write({"c.yaml": CIRCUIT.replace(OIL, f"{OIL}\nlibrary: [./mine.py]"), "mine.py": "x = 'mended'"})
    assert refused.run("check", "c.yaml")[0] == 0
