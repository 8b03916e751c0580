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
from refusing import Refusal
from scipy.interpolate import CubicSpline

from crescentlab import units
from crescentlab.component import Component
from crescentlab.domain import gives_signal, takes_signal
from crescentlab.errors import InputError
from crescentlab.maths import Expr, event_where
from crescentlab.result import Result
from crescentlab.tables import Curve
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
        (Table(curve=CURVE), 2),
        (Table2d(table=GRID, interpolation="spline"), 0),
        (Table2d(table=GRID), 3),
        (Table(curve={"x": [0.0, 1.0], "y": [1.0, 3.0]}, interpolation="spline"), 0),
    ],
    ids=["spline", "lines", "bicubic", "bilinear", "spline of two points"],
)
def test_on_symbols_as_on_floats(table: Component, knots: int):
    """At points within, between and beyond the knots; straight lines find their piece by halving, with an
    event at each inner knot (3 of them: 2 relations), splines make none."""
    made = trace(table, {})
    assert len(made.relations) == knots
    names = [name for name, _ in made.inputs.slots]
    for point in itertools.product((-1.7, 0.3, 1.0, 2.2, 2.9, 4.0, 6.0), repeat=len(names)):
        bits = np.zeros(knots)
        for _ in range(3):
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


# --- beyond the ends --------------------------------------------------------------------------------------------------

STEPS = {"x": ["0 s", "1 s", "1 s", "2 s"], "y": ["0", "1", "0.5", "0.5"]}
"""A ramp to 1, at 1 s a jump to 0.5, which stays."""
SOLVERS = ("lsoda", "bdf", "radau", "rk45", "dop853", "cvode", "rodas", "dopri")


def run_through(table: dict[str, object], solver: str = "auto", stop: str = "7 s", **more: object) -> Result:
    """A table over time and its integral."""
    return circuit(
        components={"c": {"type": "time_table", **table}, "i": {"type": "integrator"}},
        nets={"u": ["c.y", "i.u"], "y": ["i.y"]}, simulation={"stop": stop, "rtol": "1e-8", **more},
    ).simulate(solver=solver)  # fmt: skip


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize(
    ("beyond", "integral"),
    [("hold", 0.5 + 0.5 + 5 * 0.5), ("slope", 0.5 + 0.5 + 5 * 0.5), ("repeat", 3 * (0.5 + 0.5) + 0.5)],
)
def test_a_table_over_time_beyond_its_end(solver: str, beyond: str, integral: float):
    """Integral over 7 s by hand: half a unit on the ramp, half behind the jump; held, or three periods and a ramp.

    Jumps are exact stops, so only roundoff and the tolerance of 1e-8 per stop remain (5 times as much with methods that
    carry their past over them).
    """
    result = run_through({"curve": STEPS, "beyond": beyond}, solver)
    assert result["i.y"][-1] == pytest.approx(integral, abs=5e-7)
    jumps = 7 if beyond == "repeat" else 1  # the last at 7 s, the end
    assert result.trajectory.statistics.restarts == jumps - (beyond == "repeat")
    assert result.trajectory.statistics.events == 0


def test_the_slope_goes_on_only_if_asked_for():
    """From 0 to 1 within 1 s; at 3 s it is still 1, or, with the slope, 3 (the case of an opening beyond its range)."""
    course = {"x": ["0 s", "1 s"], "y": ["0", "1"]}
    assert run_through({"curve": course}, stop="3 s")["c.y"][-1] == pytest.approx(1.0, abs=1e-14)
    slope = run_through({"curve": course, "beyond": "slope"}, stop="3 s")
    assert slope["c.y"][-1] == pytest.approx(3.0, abs=1e-14)
    late = {"x": ["1 s", "2 s"], "y": ["5", "6"]}
    assert run_through({"curve": late}, stop="3 s")["c.y"][0] == 5.0


def test_check_tells_where_the_slope_extends(refused: Refusal):
    """The run is three times as long as the table, which begins late."""
    text = "crescentlab: 1\ncomponents:\n  c: {type: time_table, curve: {x: [0.5 s, 1 s], y: [0, 1]}, beyond: slope}\n"
    refused.write({"a.yaml": text + "simulation: {stop: 3 s}\n"})
    code, out, _ = refused.run("check", "a.yaml")
    said = " ".join(out.split())
    assert code == 0
    assert "c: the table begins at 0.5 s: before, the signal has the slope of its first piece" in said
    assert "c: the table ends at 1 s, the run at 3 s: it goes on with the slope of its last piece" in said
    refused.write({"a.yaml": text.replace("slope", "hold") + "simulation: {stop: 3 s}\n"})
    assert "remark" not in refused.run("check", "a.yaml")[1]


def test_ten_thousand_periods_lose_no_time():
    """The instant of the last jump is that of the first plus a whole number of periods, to the last digit."""
    times = {"x": ["0 s", "0.1 s", "0.1 s", "0.3 s"], "y": ["0", "0", "1", "1"]}
    schedule = TimeTable(curve=times, beyond="repeat").schedule(0.0, 3000.0)
    jumps = schedule.times[1:][schedule.rows[1:, 1] == 1.0]
    count = np.arange(jumps.size) + np.round((jumps[0] - 0.1) / 0.3)
    assert count[-1] >= 9999
    assert jumps == pytest.approx(0.1 + 0.3 * count, rel=1e-15)


def test_a_spline_that_repeats_is_that_of_scipy():
    """scipy's periodic spline through the same points, over three periods; without equal ends, its natural one."""
    x, y = np.array([0.0, 0.4, 1.0, 1.7, 2.0]), np.array([1.0, 3.0, -1.0, 0.5, 1.0])
    seconds = [f"{s} s" for s in x]
    closed = TimeTable(curve={"x": seconds, "y": list(y)}, interpolation="spline", beyond="repeat")
    known = CubicSpline(x, y, bc_type="periodic")
    for t in np.linspace(-2.0, 4.0, 61):
        assert closed.equations(t=t)["y"] == pytest.approx(float(known(t)), abs=1e-12)
    two = TimeTable(curve={"x": seconds[:3], "y": [1.0, 3.0, 1.0]}, interpolation="spline", beyond="repeat")
    known = CubicSpline(x[:3], [1.0, 3.0, 1.0], bc_type="periodic")
    assert two.equations(t=0.7)["y"] == pytest.approx(float(known(0.7)), abs=1e-12)
    held = TimeTable(curve={"x": seconds, "y": [1.0, 3.0, -1.0, 0.5, 2.0]}, interpolation="spline")
    assert [held.equations(t=t)["y"] for t in (-1.0, 5.0)] == [1.0, 2.0]


@pytest.mark.parametrize("solver", ["lsoda", "rodas", "dopri"])
@pytest.mark.parametrize("interpolation", ["linear", "spline"])
def test_a_characteristic_that_repeats(solver: str, interpolation: str):
    """A cam of lift over angle, turned forwards and back through five periods: u = 10 sin t, against y(u mod 2).

    An explicit method steps over the spline's knots, where only its third derivative jumps, and loses a few digits.
    """
    x, y = [0.0, 0.5, 1.5, 2.0], [0.0, 1.0, 0.4, 0.0]
    cam = {"type": "table", "curve": {"x": x, "y": y}, "interpolation": interpolation, "beyond": "repeat"}
    result = circuit(
        components={
            "u": {"type": "sine", "amplitude": "10", "frequency": f"{1 / (2 * np.pi)!r} Hz", "mean": "0.3"},
            "cam": cam, "i": {"type": "integrator"},
        },
        nets={"a": ["u.y", "cam.u"], "b": ["cam.y", "i.u"]}, simulation={"stop": "8 s", "rtol": "1e-8"},
    ).simulate(solver=solver)  # fmt: skip
    known = CubicSpline(x, y, bc_type="periodic") if interpolation == "spline" else lambda s: np.interp(s, x, y)
    t = result.time
    assert result["cam.y"] == pytest.approx(known(np.mod(0.3 + 10 * np.sin(t), 2.0)), abs=1e-7)
    fine = np.linspace(0, 8, 800_001)
    exact = np.trapezoid(known(np.mod(0.3 + 10 * np.sin(fine), 2.0)), fine)
    assert result["i.y"][-1] == pytest.approx(exact, abs=2e-5 if solver == "dopri" else 2e-6)
    assert result["cam.turns"].min() == -5
    assert result["cam.turns"].max() == 5


def test_a_characteristic_that_holds():
    """Beyond both ends the first and last value, on floats and in a run."""
    for interpolation in ("linear", "spline"):
        table = Table(curve=CURVE, interpolation=interpolation, beyond="hold")
        assert [table.equations(u=u)["y"] for u in (-3.0, 0.0, 5.0, 9.0)] == pytest.approx([0.0, 0.0, -1.0, -1.0])
        assert len(trace(table, {}).relations) == (2 if interpolation == "spline" else 4)
    repeating = Table(curve=CURVE, beyond="repeat")
    assert repeating.equations(u=-4.0)["y"] == pytest.approx(2.0)
    assert repeating.equations(u=12.5)["y"] == pytest.approx(1.0)


# --- many points ------------------------------------------------------------------------------------------------------


def instructions(points: int) -> tuple[int, int, int]:
    """Relations of a table of so many points, instructions of its value and of its relations."""
    x = np.linspace(0.0, 1.0, points)
    made = trace(Table(curve=Curve(x=tuple(x), y=tuple(np.sin(7 * x)))), {})
    return len(made.relations), made.groups[0].function.n_instructions(), made.relation.n_instructions()


def test_the_cost_of_a_table_grows_with_its_points():
    """ceil(log2(n - 1)) relations, some 12 instructions a point for its value and 5 for its relations."""
    for points, bits in ((5, 2), (100, 7), (800, 10), (2000, 11), (20_000, 15)):
        relations, value, relation = instructions(points)
        assert relations == bits
        assert value <= 13 * points
        assert relation <= 5 * points


def test_a_table_of_many_points_in_a_run():
    """3000 points of sin u on 0..3, u = 3 sin^2: the interpolation errs by at most h^2/8, every knot is a kink."""
    x = np.linspace(0.0, 3.0, 3000)
    result = circuit(
        components={
            "u": {"type": "sine", "amplitude": "1.5", "mean": "1.5", "frequency": "0.05 Hz"},
            "f": {"type": "table", "curve": {"x": x.tolist(), "y": np.sin(x).tolist()}},
        },
        nets={"a": ["u.y", "f.u"]}, simulation={"stop": "5 s"},
    ).simulate()  # fmt: skip
    u = 1.5 + 1.5 * np.sin(2 * np.pi * 0.05 * result.time)
    assert result["f.y"] == pytest.approx(np.sin(u), abs=(x[1] - x[0]) ** 2 / 8)


def test_equal_relations_of_a_component_are_one():
    """Value, slope and work of one curve, and a comparison written twice, share their relations."""

    class Twice(Component):
        """Three readings of one curve. Units: none. Source: a test."""

        u = takes_signal(units.ratio, "input")
        y = gives_signal(units.ratio, "output")

        def equations(self, u: Expr) -> dict[str, object]:
            """Value, slope, work, and 200 comparisons of which 100 are equal to the other 100."""
            curve = Curve(x=(0.0, 1.0, 2.0, 3.0, 4.0), y=(0.0, 1.0, 3.0, 4.0, 8.0))
            more = sum(event_where(u > k % 100, 1.0, 0.0) for k in range(200))
            return {"y": curve(u) + curve.slope(u) + curve.work(u) + more}

    assert len(trace(Twice(), {}).relations) == 2 + 100


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
        (MAP.replace("18.5", "18,5"), "4 cells under 3 titles; write one of each, decimals after a point", 5),
        (MAP.replace("18.5", ""), "the cell in the column 'flow' is empty", 5),
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
        ("absent.csv", "cannot read the data absent.csv"),
    ],
)
def test_wrong_grids_are_explained(table: object, said: str):
    """What is wrong, and what to write."""
    with pytest.raises(ValueError, match=said):
        Table2d(table=table)
