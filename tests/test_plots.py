"""Pictures of results: axes, units, windows, and the files that --plot writes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import crescentlab as cl
from crescentlab.cli import main
from crescentlab.plotting import plot_series, write_plots

CIRCUIT = """\
crescentlab: 1
title: Filling a line
fluid: {type: simple_oil, density: 860 kg/m^3, kinematic_viscosity: 35 cSt, bulk_modulus: 14000 bar}
components:
  pump: {type: flow_source, flow: 6 L/min}
  line: {type: capacity, volume: 100 cm^3}
  load: {type: orifice, area: 3 mm^2, count: 2}
  tank: {type: tank}
nets:
  p_line: [pump.port, line.port, 'load.a[*]']
  t_line: ['load.b[*]', tank.port]
simulation: {stop: 20 ms}
display: {pressure: kPa}
"""

PLOTS = """\
plots:
  - {y: line.p, title: Pressure, start: 5 ms, stop: 10 ms}
  - {y: [line.p, load.q, t_line.p]}
  - {y: ['load.q[2]'], x: line.p}
"""


def circuit(folder: Path, text: str = CIRCUIT) -> Any:
    """The circuit, read from a file."""
    path = folder / "filling.yaml"
    path.write_text(text, encoding="utf-8")
    return cl.load(path)


def test_one_variable_over_time_in_display_units(tmp_path: Path) -> None:
    result = circuit(tmp_path).simulate()
    figure = plot_series(result, ["line.p"], title="Filling")
    (axes,) = figure.axes
    line: Any = axes.lines[0]
    assert axes.get_ylabel() == "line.p, pressure [kPa]"
    assert axes.get_xlabel() == "time [ms]"
    assert figure.get_suptitle() == "Filling"
    np.testing.assert_allclose(line.get_xdata(), result.time * 1e3)
    np.testing.assert_allclose(line.get_ydata(), result["line.p"] / 1e3)


def test_each_quantity_has_its_own_axes_and_vectors_show_their_elements(tmp_path: Path) -> None:
    figure = plot_series(circuit(tmp_path).simulate(), ["line.p", "load.q", "t_line.p"])
    pressure, flow = figure.axes
    assert [line.get_label() for line in pressure.lines] == ["line.p", "t_line.p"]
    assert [line.get_label() for line in flow.lines] == ["load.q[1]", "load.q[2]"]
    assert pressure.get_ylabel() == "pressure [kPa]"
    assert flow.get_ylabel() == "flow [L/min]"
    assert flow.get_xlabel() == "time [ms]"
    assert pressure.get_xlabel() == ""


def test_result_plot_saves_and_uses_no_window(tmp_path: Path) -> None:
    result = circuit(tmp_path).simulate()
    figure = result.plot("line.p", path=tmp_path / "p.png")
    assert (tmp_path / "p.png").read_bytes().startswith(b"\x89PNG")
    assert type(figure.canvas).__name__ in ("FigureCanvasBase", "FigureCanvasAgg")
    assert len(result.plot().axes[0].lines) == 2, "without names, the net pressures"


def test_the_plots_of_a_circuit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[Any] = []
    monkeypatch.setattr("crescentlab.plotting.save_figure", lambda figure, path: drawn.append(figure))
    result = circuit(tmp_path, CIRCUIT + PLOTS).simulate()
    paths = write_plots(result, tmp_path / "filling")
    assert [path.name for path in paths] == ["filling-1.png", "filling-2.png", "filling-3.png"]
    window = drawn[0].axes[0].lines[0].get_xdata()
    assert window.min() >= 5.0
    assert window.max() <= 10.0
    assert len(drawn[1].axes) == 2
    (over_pressure,) = drawn[2].axes
    assert over_pressure.get_xlabel() == "line.p, pressure [kPa]"
    assert over_pressure.get_ylabel() == "load.q[2], flow [L/min]"
    np.testing.assert_allclose(over_pressure.lines[0].get_xdata(), result["line.p"] / 1e3)


def test_plot_writes_png_files_beside_the_result(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    circuit(tmp_path, CIRCUIT + PLOTS)
    assert main(["simulate", "filling.yaml", "--plot", "-o", "run.v2.nc"]) == 0
    assert "run.v2-3.png" in capsys.readouterr().out
    assert {p.name for p in tmp_path.glob("*.png")} == {"run.v2-1.png", "run.v2-2.png", "run.v2-3.png"}
    circuit(tmp_path)
    assert main(["simulate", "filling.yaml", "--plot", "--quiet", "-o", "none"]) == 0
    assert (tmp_path / "filling-1.png").read_bytes().startswith(b"\x89PNG")
    assert not (tmp_path / "filling-2.png").exists(), "without plots: the net pressures in one picture"


@pytest.mark.parametrize(
    ("wrong", "line", "said"),
    [
        ("  - {y: [line.p]}\n  - {y: [line.p, lin.p]}\n", 16, "did you mean line.p"),
        ("  - {y: line.p, x: tim}\n", 15, "no variable 'tim'"),
    ],
)
def test_a_plot_of_nothing_is_refused_before_the_run(
    wrong: str,
    line: int,
    said: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    circuit(tmp_path, CIRCUIT + "plots:\n" + wrong)
    assert main(["simulate", "filling.yaml", "--plot"]) == 2
    message = capsys.readouterr().err
    assert message.startswith(f"filling.yaml:{line}: plots: ")
    assert said in message
    assert not (tmp_path / "filling.nc").exists()


def test_a_failed_run_is_plotted_as_far_as_it_came(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    circuit(tmp_path, CIRCUIT.replace("6 L/min", "-60 L/min") + "plots:\n  - {y: line.p, start: 15 ms}\n")
    assert main(["simulate", "filling.yaml", "--plot", "--quiet"]) == 3
    assert (tmp_path / "filling-1.png").exists()
