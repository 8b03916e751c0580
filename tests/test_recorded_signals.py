"""Measured data as input: dialects of data files, jumps, kinks, what is read and what is not, in every solver."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from building import OIL, circuit
from crescentlab.components.recorded_signals import RecordedSignal
from refusing import Refusal

from crescentlab.circuit import Circuit
from crescentlab.data_files import open_data, recording
from crescentlab.errors import InputError
from crescentlab.result import Result
from crescentlab.trace import trace

LPM = 1e-3 / 60
SOLVERS = ("lsoda", "bdf", "radau", "rk45", "dop853", "cvode", "rodas", "dopri")
Made = Callable[..., Circuit]


@pytest.fixture
def recorded(tmp_path: Path) -> Made:
    """A circuit of a recorded signal in units of 1 and its integral."""

    def made(text: str, stop: str = "1 s", rtol: str = "1e-8", **signal: object) -> Circuit:
        (tmp_path / "log.csv").write_text(text, encoding="utf-8")
        return circuit(
            components={"s": {"type": "recorded_signal", "file": "log.csv", **signal}, "i": {"type": "integrator"}},
            nets={"a": ["s.y", "i.u"]}, simulation={"stop": stop, "rtol": rtol}, folder=tmp_path,
        )  # fmt: skip

    return made


def integral(result: Result) -> float:
    """Of the signal over the run."""
    return float(result["i.y"][-1])


# --- files ------------------------------------------------------------------------------------------------------------

PLAIN = "time [s], y\n0, 0\n0.1, 1.5\n0.2, 2\n"
DIALECTS = {
    "commas": PLAIN,
    "semicolons and decimal commas": "time [s];y\n0;0\n0,1;1,5\n0,2;2\n",
    "semicolons and points": "time [s]; y\n0; 0\n0.1; 1.5\n0.2; 2\n",
    "tabs": PLAIN.replace(", ", "\t"),
    "tabs and decimal commas": "time [s]\ty\n0\t0\n0,1\t1,5\n0,2\t2\n",
    "comments": "# logger 7\n\n" + PLAIN.replace("0.1, 1.5", "  # a gap\n0.1, 1.5 # here, it rose"),
    "a mark of byte order": "\ufeff" + PLAIN,
    "lines of another system": PLAIN.replace("\n", "\r\n"),
    "quotes": '"time [s]","y"\n"0","0"\n"0.1","1.5"\n"0.2","2"\n',
    "separators at the ends": "time [s];y;\n0;0;\n0,1;1,5;\n0,2;2;\n",
    "other columns, of words too": "no, time [s], remark, y\n1, 0, pump on, 0\n2, 0.1, , 1.5\n3, 0.2, end, 2\n",
    "another unit of time": PLAIN.replace("time [s]", "time [ms]").replace("0.1,", "100,").replace("0.2,", "200,"),
    "another title of the times": PLAIN.replace("time [s]", "t [s]"),
}


@pytest.mark.parametrize("text", DIALECTS.values(), ids=DIALECTS)
def test_dialects(recorded: Made, text: str):
    """Trapezoids by hand, held from 0.2 s on: 0.075 + 0.175 + 0.8 x 2."""
    assert integral(recorded(text, column="y").simulate()) == pytest.approx(1.85, abs=1e-7)


@pytest.mark.parametrize(
    ("text", "line", "said"),
    [
        (PLAIN.replace("1.5", "1.5x"), 3, "'1.5x' is not a finite number, in the column 'y'"),
        (PLAIN.replace("1.5", ""), 3, "the cell in the column 'y' is empty"),
        (PLAIN.replace("1.5", "nan"), 3, "'nan' is not a finite number, in the column 'y'"),
        (PLAIN.replace("0.1, 1.5", "0,1, 1,5"), 3, "4 cells under 2 titles; write one of each, decimals after a point"),
        (PLAIN.replace("0.2, 2", "0.2"), 4, "1 cells under 2 titles"),
        (PLAIN.replace("0.2,", "0.05,"), 4, "the time falls back in the column 'time': 0.05 s follows 0.1 s"),
        ("time [s], y\n", 1, "rows of numbers follow"),
        (PLAIN.replace("[s]", "[sec]"), 1, "column 'time': unknown unit 'sec'"),
        (PLAIN.replace("[s]", "[bar]"), 1, "column 'time': 'time [bar]': 'bar' is a unit of pressure, not of time"),
        (PLAIN.replace("time [s]", "t [bar]"), 1, "log.csv has no column 'time'"),
        (PLAIN.replace("y", "time [s]"), 1, "the column 'time' stands twice"),
    ],
)
def test_what_is_wrong_is_told_by_row_and_column(recorded: Made, text: str, line: int, said: str):
    """File, line and column of the first row that cannot be used."""
    with pytest.raises(InputError) as caught:
        recorded(text).simulate()
    assert said in caught.value.message
    assert caught.value.place is not None
    assert (Path(caught.value.place.file).name, caught.value.place.line) == ("log.csv", line)


@pytest.mark.parametrize(
    ("part", "said"),
    [
        ("column: flwo", "log.csv has no column 'flwo': did you mean flow?"),
        ("column: flow, columns: [flow]", "write column: for one, or columns: for several, not both"),
        ("columns: [flow, pressure]", "column 'pressure': 'pressure [bar]': 'bar' is a unit of pressure, not of flow"),
        ("offset: 0 s", "log.csv has 2 columns besides the times; name one by column: flow, pressure"),
        ("column: flow, output_quantity: pressure", "'L/min' is a unit of flow, not of pressure"),
    ],
)
def test_wrong_columns_are_refused_by_check(refused: Refusal, part: str, said: str):
    """With the nearest title, or all of them."""
    text = "crescentlab: 1\ncomponents:\n  s: {type: recorded_signal, file: log.csv, PART}\n".replace("PART", part)
    refused.write({"c.yaml": text, "log.csv": "time [s], flow [L/min], pressure [bar]\n0, 0, 1\n0.1, 1, 2\n"})
    assert said in refused.told("check", "c.yaml")
    refused.write({"c.yaml": text.replace("log.csv", "lag.csv")})
    assert "cannot read the data lag.csv" in refused.told("check", "c.yaml")


def test_rows_that_the_run_does_not_reach_are_not_read(recorded: Made):
    """A broken row two rows beyond the end of the run is nobody's; one more row would have met it."""
    text = PLAIN + "0.3, 3\n0.4, broken\n"
    assert integral(recorded(text, stop="250 ms").simulate()) == pytest.approx(0.25 + 0.1125, abs=1e-8)
    with pytest.raises(InputError, match="'broken' is not a finite number"):
        recorded(text, stop="350 ms").simulate()


def test_a_long_file_is_read_as_far_as_it_is_needed(tmp_path: Path):
    """Of 300 000 rows, 6 MB, one block of 4 MB while the run ends within it; then the rest, where it went on."""
    path = tmp_path / "long.csv"
    rows = "\n".join(f"{k / 1000:.6f}, {k % 7:.6f}" for k in range(300_000))
    path.write_text(f"time [s], y\n{rows}\n", encoding="utf-8")
    file = open_data(path, "long.csv")
    log = recording(file, 0, [1])
    times, values = log.until(1.0)
    assert times[-1] == 1.001
    assert log.begin < 5_000_000
    assert log is recording(file, 0, [1])
    times, values = log.until(1e9)
    assert times.size == 300_000
    assert values[-1, 0] == 299_999 % 7


# --- runs -------------------------------------------------------------------------------------------------------------

JUMPS = "time [s], flow [L/min]\n0, 0\n0.1, 0\n0.2, 0\n0.2, 10\n0.3, 10\n"


@pytest.mark.parametrize("solver", SOLVERS)
def test_two_rows_of_one_time_are_a_jump(tmp_path: Path, solver: str):
    """The step of a logger: 10 L/min from 0.2 s on into a volume behind an orifice; an exact stop, one restart.

    The mean flow after the step is 10 L/min, before it nothing, to the last digit; the events are none.
    """
    (tmp_path / "dup.csv").write_text(JUMPS, encoding="utf-8")
    result = circuit(
        components={
            "asked": {"type": "recorded_signal", "file": "dup.csv"}, "pump": {"type": "signal_flow_source"},
            "line": {"type": "capacity", "volume": "1 L"}, "load": {"type": "orifice", "area": "5 mm2"},
            "tank": {"type": "tank"},
        },
        nets={"s": ["asked.y", "pump.flow"], "p1": ["pump.port", "line.port", "load.a"], "p2": ["load.b", "tank.port"]},
        fluid=OIL, simulation={"stop": "0.4 s"}, folder=tmp_path,
    ).simulate(solver=solver)  # fmt: skip
    flow, t = result["asked.y"] / LPM, result.time
    assert np.all(flow[t < 0.2] == 0.0)
    assert flow[t > 0.2] == pytest.approx(10.0, rel=1e-14)
    at = np.flatnonzero(t == 0.2)
    assert flow[at] == pytest.approx([0.0, 10.0])
    s = result.trajectory.statistics
    assert (s.events, s.ticks, s.restarts) == (0, 0, 1)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("interpolation", ["linear", "hold"])
def test_no_row_is_passed_unseen(recorded: Made, solver: str, interpolation: str):
    """A spike of one row in a long quiet log: its triangle of 1 ms, or its square, is in the integral of any solver."""
    times = np.arange(0.0, 10.0005, 0.001)
    rows = "\n".join(f"{t:.3f}, {1.0 if k == 7321 else 0.0}" for k, t in enumerate(times))
    run = recorded(f"time [s], y\n{rows}\n", stop="10 s", interpolation=interpolation).simulate(solver=solver)
    assert integral(run) == pytest.approx(1e-3, rel=1e-4)
    assert run.trajectory.statistics.steps < 2000  # rows at rest make no stops


@pytest.mark.parametrize("solver", ["lsoda", "radau", "rodas", "dopri"])
def test_a_noisy_log_against_its_own_sum(recorded: Made, solver: str):
    """500 rows of noise at uneven times: the integral is the sum of trapezoids or rectangles, within the tolerance."""
    rng = np.random.default_rng(3)
    t, y = np.cumsum(rng.uniform(0.5e-3, 3e-3, 500)), rng.standard_normal(500)
    t -= t[0]
    text = "time [s]\ty\n" + "\n".join(f"{a!r}\t{b!r}" for a, b in zip(t.tolist(), y.tolist(), strict=True))
    for interpolation, exact in (("linear", np.trapezoid(y, t)), ("hold", np.sum(y[:-1] * np.diff(t)))):
        run = recorded(text, stop=f"{float(t[-1])!r} s", interpolation=interpolation).simulate(solver=solver)
        assert integral(run) == pytest.approx(exact, abs=1e-6)
        assert run["s.y"][np.searchsorted(run.time, t[200], side="right") - 1] == pytest.approx(y[200], abs=1e-12)


@pytest.mark.parametrize(
    ("settings", "exact"),
    [
        ({}, 0.25 + 2 * 0.8),
        ({"beyond": "slope"}, 0.25 + 0.8 * 2 + 5 * 0.8**2 / 2),
        ({"beyond": "repeat"}, 5 * 0.25),
        ({"offset": "100 ms"}, 0.175 + 0.9 * 2),
        ({"offset": "-100 ms"}, 0.25 + 0.7 * 2),
        ({"offset": "-100 ms", "beyond": "repeat"}, 5 * 0.25),
        ({"interpolation": "hold", "beyond": "repeat"}, 5 * 0.15),
        ({"interpolation": "hold", "beyond": "slope"}, 0.15 + 0.8 * 2),
    ],
)
@pytest.mark.parametrize("solver", ["lsoda", "rodas"])
def test_beyond_the_rows_and_from_a_later_one(recorded: Made, settings: dict[str, str], exact: float, solver: str):
    """0, 1.5, 2 at 0, 0.1, 0.2 s over a run of 1 s, by hand: trapezoids 0.075 and 0.175, last slope 5/s."""
    assert integral(recorded(PLAIN, **settings).simulate(solver=solver)) == pytest.approx(exact, abs=1e-6)


def test_several_columns_are_a_vector(tmp_path: Path):
    """Two flows of one file by name, in their order; the quantity is that of their units."""
    text = "t [s]; a [L/min]; p [bar]; b [m3/s]\n0; 1; 5; 0\n1; 3; 5; 0,001\n"
    (tmp_path / "log.csv").write_text(text, encoding="utf-8")
    components = {"s": {"type": "recorded_signal", "file": "log.csv", "columns": ["b", "a"]}}
    result = circuit(components=components, simulation={"stop": "1 s"}, folder=tmp_path).simulate()
    assert result["s.y"][-1] == pytest.approx([1e-3, 3 * LPM])
    assert result.quantity("s.y").name == "flow"


def test_a_run_that_goes_on_and_a_steady_point_read_the_row_of_their_time(recorded: Made):
    """From a snapshot in the middle of a row; and at rest, the first row."""
    made = recorded("time [s], y\n0, 1\n0.4, 1\n0.4, 3\n1, 3\n", stop="300 ms")
    half = made.simulate()
    for solver in ("lsoda", "rodas"):
        whole = made.simulate(stop="1 s", start=half, solver=solver)
        assert integral(whole) == pytest.approx(0.4 + 1.8, abs=1e-8)


def test_no_row_is_part_of_the_equations(tmp_path: Path):
    """The equations of 100 000 rows are those of two."""
    sizes = []
    for rows in (2, 100_000):
        path = tmp_path / f"{rows}.csv"
        path.write_text("time [s], y\n" + "".join(f"{k}, {k % 5}\n" for k in range(rows)), encoding="utf-8")
        made = trace(RecordedSignal(file=str(path)), {})
        sizes.append((made.groups[0].function.n_instructions(), len(made.relations), made.held.size))
    assert sizes[0] == sizes[1] == (sizes[0][0], 0, 3)


def test_auto_hands_a_long_log_over(recorded: Made):
    """Every row is a step: 30 000 of them are begun by SciPy and done by the compiled loop, with the same integral."""
    y = np.random.default_rng(1).standard_normal(30_001)
    text = "time [s], y\n" + "\n".join(f"{k * 1e-3:.3f}, {v:.9f}" for k, v in enumerate(y))
    result = recorded(text, stop="30 s", rtol="1e-6").simulate()
    assert result.trajectory.solver.startswith("auto: rodas")
    exact = np.sum(np.round(y, 9)[1:] + np.round(y, 9)[:-1]) / 2 * 1e-3
    assert integral(result) == pytest.approx(exact, abs=1e-6)
    assert result.trajectory.statistics.steps < 30_500
