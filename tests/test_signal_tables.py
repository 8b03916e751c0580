"""Tables of one and two variables: files, smoothness, events."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
from building import circuit
from crescentlab.components.signal_tables import Table, TimeTable
from crescentlab.components.tables_2d import Table2d, read_csv
from reading import rows

from crescentlab.component import Component
from crescentlab.errors import InputError
from crescentlab.trace import trace

BAR, LPM, RPM = 1e5, 1e-3 / 60, np.pi / 30
GRID = {"x": [0.0, 1.0, 2.5, 3.0], "y": [-1.0, 0.5, 2.0], "z": [[0, 1, 2], [3, 1, 0], [-1, 2, 1], [0, 0, 4]]}
CURVE = {"x": [0.0, 1.0, 2.5, 3.0, 5.0], "y": [0.0, 2.0, 1.0, 1.5, -1.0]}


def test_a_spline_is_smooth_at_its_knots_and_ends():
    """Value, slope and curvature from both sides of each knot, by differences: to 1e-3 of a curvature of 10."""
    table = Table(curve=CURVE, interpolation="spline")

    def y(x: float) -> float:
        return float(table.equations(u=x)["y"])

    h = 1e-4
    for knot in CURVE["x"]:
        left = [y(knot - k * h) for k in range(4)]
        right = [y(knot + k * h) for k in range(4)]
        slopes = [(-1.5 * s[0] + 2 * s[1] - 0.5 * s[2]) / h for s in (left, right)]
        bends = [(2 * s[0] - 5 * s[1] + 4 * s[2] - s[3]) / h**2 for s in (left, right)]
        assert slopes[0] == pytest.approx(-slopes[1], abs=1e-5)
        assert bends[0] == pytest.approx(bends[1], abs=1e-2)


@pytest.mark.parametrize(
    ("table", "knots"),
    [
        (Table(curve=CURVE, interpolation="spline"), 0),
        (Table(curve=CURVE), 3),
        (Table2d(table=GRID, interpolation="spline"), 0),
        (Table2d(table=GRID), 3),
        (Table(curve={"x": [0.0, 1.0], "y": [1.0, 3.0]}, interpolation="spline"), 0),
    ],
    ids=["spline", "lines", "bicubic", "bilinear", "spline of two points"],
)
def test_on_symbols_as_on_floats(table: Component, knots: int):
    """At points within, between and beyond the knots; straight lines make an event of each inner knot, splines none."""
    made = trace(table, {})
    assert len(made.relations) == knots
    names = [name for name, _ in made.inputs.slots]
    for point in itertools.product((-1.7, 0.3, 1.0, 2.2, 2.9, 4.0, 6.0), repeat=len(names)):
        bits = np.zeros(knots)
        for _ in range(2):
            arguments = [0.0, [], [], bits, point, [], []]
            bits = (np.array(made.relation(*arguments))[:, 0] > 0).astype(float)
        computed = float(made.groups[0].function(0.0, [], [], bits, point, [], []))
        expected = table.equations(**dict(zip(names, point, strict=True)))["y"]
        assert computed == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_a_spline_over_time_in_a_run():
    """A narrow hump within a long run is not stepped over: its integral is that of the spline's pieces."""
    course = {"x": ["0 s", "4.9 s", "5 s", "5.1 s", "10 s"], "y": ["0", "0", "1", "0", "0"]}
    result = circuit(
        components={
            "hump": {"type": "time_table", "curve": course, "interpolation": "spline"},
            "integral": {"type": "integrator"},
        },
        nets={"u": ["hump.y", "integral.u"], "y": ["integral.y"]},
        simulation={"stop": "10 s", "rtol": "1e-8"},
    ).simulate()
    t = np.linspace(0, 10, 200001)
    hump = TimeTable(curve=course, interpolation="spline")
    exact = np.trapezoid([hump.equations(t=s)["y"] for s in t[::20]], t[::20])
    assert result["integral.y"][-1] == pytest.approx(exact, rel=1e-5)


# --- files ------------------------------------------------------------------------------------------------------------

MAP = """speed [rpm], pressure [bar], flow [L/min]
1000, 0, 10
1000, 100, 9
2000, 0, 20
2000, 100, 18.5
"""


def test_a_map_from_a_file(tmp_path: Path):
    """Units from the header, lines in any order; half-way between four points their mean; the quantities of ports."""
    first, *others = MAP.splitlines()
    (tmp_path / "map.csv").write_text("\n".join([first, *reversed(others)]) + "\n", encoding="utf-8")
    result = circuit(
        components={
            "n": {"type": "constant", "value": "1500 rpm"},
            "p": {"type": "ramp", "after": "100 bar", "duration": "1 s"},
            "map": {"type": "table2d", "table": "map.csv"},
        },
        nets={"speed": ["n.y", "map.u1"], "pressure": ["p.y", "map.u2"], "flow": ["map.y"]},
        simulation={"stop": "1 s", "output_step": "0.5 s"}, folder=tmp_path,
    ).simulate()  # fmt: skip
    assert rows(result, "map.y", [0.0, 0.5, 1.0]) / LPM == pytest.approx([15.0, 14.375, 13.75])
    assert [result.quantity(f"map.{port}").name for port in ("u1", "u2", "y")] == ["speed", "pressure", "flow"]


@pytest.mark.parametrize(
    ("text", "said", "line"),
    [
        ("speed [rpm], flow [L/min]\n", "must name three columns", 1),
        (MAP.replace("[bar]", "[baar]"), "column 'pressure': unknown unit 'baar'", 1),
        (MAP.replace("2000, 100, 18.5\n", ""), "no line for 2000 rpm and 100 bar", 1),
        (MAP + "2000, 100, 18\n", "stands in an earlier line already", 6),
        (MAP.replace("18.5", "18,5"), "decimals after a point", 5),
        (MAP.replace("18.5", "much"), "'much' is not a finite number", 5),
        (MAP.replace("2000, 0, 20\n2000, 100, 18.5\n", ""), "x needs at least two values", 1),
    ],
)
def test_wrong_maps_are_explained(tmp_path: Path, text: str, said: str, line: int):
    """What is wrong, and in which line."""
    (tmp_path / "map.csv").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=said) as caught:
        read_csv(tmp_path / "map.csv")
    assert caught.value.place is not None
    assert caught.value.place.line == line


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ({"x": [0, 1], "y": [0, 1], "z": [[0, 1]]}, "z needs 2 lists of 2 values"),
        ({"x": [0, 1], "y": [1, 0], "z": [[0, 1], [2, 3]]}, "y must rise, but 0 follows 1"),
        ({"x": ["0 bar", "1 mm"], "y": [0, 1], "z": [[0, 1], [2, 3]]}, "'mm' is a unit of length, not of pressure"),
        ({"x": [0, 1], "y": [0, 1], "z": [0, 1]}, "list of lists"),
        ({"x": list(range(51)), "y": list(range(50)), "z": [[0] * 50] * 51}, "a table may have 2500"),
        ({"x": [0, 1]}, "write a CSV file's name"),
        ("absent.csv", "cannot read the table absent.csv"),
    ],
)
def test_wrong_grids_are_explained(table: object, said: str):
    """What is wrong, and what to write."""
    with pytest.raises(ValueError, match=said):
        Table2d(table=table)
