"""Exact line two-ports: their laws against SciPy and closed forms, and as an overlay on linear models of circuits."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from building import circuit
from crescentlab.components.fluids import SimpleOil
from crescentlab.components.lax_wendroff import LaxWendroffLine
from crescentlab.components.pipes import Pipe
from crescentlab.components.two_ports import inertia_factor, line_series, line_shunt, two_port_of
from scipy.special import ive, jv

from crescentlab.analysis.linear.frequency import Responses, frequency_response
from crescentlab.circuit import Circuit
from crescentlab.cli import main
from crescentlab.errors import InputError

OIL = SimpleOil(density=870.0, kinematic_viscosity=46e-6, bulk_modulus=1.6e9)
TEXT = {"type": "simple_oil", "density": "870 kg/m^3", "kinematic_viscosity": "46 cSt", "bulk_modulus": "1.6 GPa"}
AREA = np.pi / 4 * 0.01**2
WAVE = np.sqrt(1.6e9 / 870)


# -- the laws ------------------------------------------------------------------------------------


def test_inertia_factor_is_that_of_bessel_functions() -> None:
    """N = 1/(1 - 2 J_1/(z J_0)), z^2 = -w (Zielke 1968), by SciPy; I_0/I_2 over 11 decades, to 1e-13."""
    w = 1j * np.logspace(-2, 9, 300)
    y = np.sqrt(w)
    np.testing.assert_allclose(inertia_factor(w), ive(0, y) / ive(2, y), rtol=1e-13)
    z = np.sqrt(-w[:120])
    np.testing.assert_allclose(inertia_factor(w[:120]), 1 / (1 - 2 * jv(1, z) / (z * jv(0, z))), rtol=1e-9)
    small = 1j * np.logspace(-8, -4, 9)  # the series 8/w + 4/3 + w/36 of I_0/I_2
    np.testing.assert_allclose(inertia_factor(small), 8 / small + 4 / 3, rtol=1e-9)


def test_slow_oscillations_meet_steady_laminar_friction() -> None:
    """z -> 128 mu/(pi d^4) as omega -> 0 (Hagen-Poiseuille): 1e-6 at omega R^2/nu = 5e-7."""
    z = line_series(np.array([1e-6]), 0.01, 0.0, OIL, 0.0, 0.0)
    assert z[0].real == pytest.approx(128 * 46e-6 * 870 / (np.pi * 0.01**4), rel=1e-6)


def test_fast_waves_run_at_the_wave_speed() -> None:
    """Gamma/(j omega) -> 1/a, a = sqrt(K/rho), and Z_c -> rho a/A; friction's share falls as 1/sqrt(omega R^2/nu)."""
    omega = np.array([1e9])
    z, y = line_series(omega, 0.01, 0.0, OIL, 0.0, 0.0), line_shunt(omega, 0.01, OIL, 0.0)
    share = 1.1 / np.sqrt(omega[0] * 0.005**2 / 46e-6)
    assert np.sqrt(z * y)[0] / (1j * omega[0]) == pytest.approx(1 / WAVE, rel=share)
    assert np.sqrt(z / y)[0] == pytest.approx(870 * WAVE / AREA, rel=share)


def test_density_and_wave_speed_are_those_of_the_mean_pressure() -> None:
    """At 200 bar: Gamma/(j omega) = sqrt(rho/K), Z_c = rho_0 a/A for flows that are mass flow over rho_0."""
    omega = np.array([1e9])
    z, y = line_series(omega, 0.01, 0.0, OIL, 200e5, 0.0), line_shunt(omega, 0.01, OIL, 200e5)
    rho = 870 * np.exp(200e5 / 1.6e9)
    share = 1.1 / np.sqrt(omega[0] * 0.005**2 / 46e-6)
    a = np.sqrt(1.6e9 / rho)
    assert np.sqrt(z * y)[0] / (1j * omega[0]) == pytest.approx(1 / a, rel=share)
    assert np.sqrt(z / y)[0] == pytest.approx(870 * a / AREA, rel=share)


def test_turbulent_friction_is_linearised() -> None:
    """Blasius' law f = 0.316 Re^-1/4 gives dg/dq = 1.75 g/q; Churchill's is within 3 % of it at Re = 20 000."""
    thin = SimpleOil(density=870.0, kinematic_viscosity=1e-6, bulk_modulus=1.6e9)
    v = 2.0
    z = line_series(np.array([1e-3]), 0.01, 0.0, thin, 0.0, v * AREA)
    gradient = 0.316 * 20000**-0.25 / 0.01 * 870 * v**2 / 2
    assert z[0].real == pytest.approx(1.75 * gradient / (v * AREA), rel=0.03)
    assert z[0].imag == pytest.approx(1e-3 * 870 / AREA)


def exact(omega: np.ndarray, length: float = 2.0, **values: Any) -> np.ndarray:
    series = line_series(omega, 0.01, 0.0, OIL, 0.0, 0.0)
    return np.asarray(two_port_of(series, line_shunt(omega, 0.01, OIL, 0.0), length, **values))


def test_two_port_is_passive_and_reciprocal() -> None:
    """Y = Y^T, and its Hermitian part is positive: a line gives no power back."""
    Y = exact(2 * np.pi * np.logspace(-1, 5, 200))
    np.testing.assert_allclose(Y, Y.transpose(0, 2, 1), rtol=1e-12)
    least = np.linalg.eigvalsh((Y + Y.conj().transpose(0, 2, 1)) / 2).min(axis=1)
    assert (least > -1e-12 * np.abs(Y).max(axis=(1, 2))).all()


def test_two_halves_make_a_whole() -> None:
    """Two lines of 1 m in series, the pressure between them eliminated, are one of 2 m."""
    omega = 2 * np.pi * np.array([10.0, 164.0, 900.0])
    half, whole = exact(omega, 1.0), exact(omega)
    middle = half[:, 1, 1] + half[:, 0, 0]
    own = half[:, 0, 0] - half[:, 0, 1] * half[:, 1, 0] / middle
    across = -half[:, 0, 1] * half[:, 0, 1] / middle
    np.testing.assert_allclose(own, whole[:, 0, 0], rtol=1e-9)
    np.testing.assert_allclose(across, whole[:, 0, 1], rtol=1e-9)


def test_a_loss_at_an_end_is_in_series() -> None:
    """With R at end a the impedance matrix of the line grows by R in its first element."""
    omega = 2 * np.pi * np.array([10.0, 164.0, 900.0])
    more = np.linalg.inv(exact(omega, resistance_a=3e9)) - np.linalg.inv(exact(omega))
    np.testing.assert_allclose(more[:, 0, 0], 3e9, rtol=1e-6)
    assert np.abs(more[:, [0, 1, 1], [1, 0, 1]]).max() < 3e3


@pytest.mark.parametrize(
    ("part", "resistance"),
    [(Pipe(length=2.0, diameter=0.01, loss_coefficient=1.5), 1.5),
     (LaxWendroffLine(length=2.0, diameter=0.01, max_pressure=1e6, loss_coefficient=1.5), 1.5)],
    ids=["pipe", "lax_wendroff_line"],
)  # fmt: skip
def test_lines_offer_their_law(part: Any, resistance: float) -> None:
    """In slow oscillation about 1 m/s a pressure drop is (128 mu l/(pi d^4) + K rho |v|/A) dq; 1e-6 at 1e-4 rad/s."""
    Y = part.two_port(np.array([1e-4]), 0.0, 1.0 * AREA, OIL)[0]
    R = 128 * 46e-6 * 870 * 2.0 / (np.pi * 0.01**4) + resistance * 870 * 1.0 / AREA
    np.testing.assert_allclose(Y.real, np.array([[1, -1], [-1, 1]]) / R, rtol=1e-6)


# -- the overlay ---------------------------------------------------------------------------------


def blocked(kind: str, pieces: int = 1, **values: str) -> Circuit:
    """2 m of 10 mm bore between a source of pressure and a plug, in one piece or several."""
    parts: dict[str, Any] = {"source": {"type": "pressure_source", "pressure": "0 bar"}, "plug": {"type": "plug"}}
    nets, before = {}, "source.port"
    more = {"max_pressure": "60 bar"} if kind == "lax_wendroff_line" else {}
    for k in range(pieces):
        parts[f"line_{k}"] = {"type": kind, "length": f"{2 / pieces} m", "diameter": "10 mm", **more, **values}
        nets[f"n_{k}"] = [before, f"line_{k}.a"]
        before = f"line_{k}.b"
    nets["end"] = [before, "plug.port"]
    return circuit(components=parts, nets=nets, fluid=TEXT, simulation={"stop": "10 us"})


def responses(parts: Circuit, hertz: np.ndarray, **wanted: Any) -> Responses:
    wanted = {"inputs": ["source.pressure"], "outputs": ["end.p"], "exact": True} | wanted
    return frequency_response(parts, at=parts.simulate().trajectory.end, omega=2 * np.pi * hertz, **wanted)


@pytest.mark.parametrize(
    ("kind", "pieces"), [("lax_wendroff_line", 1), ("pipe", 1), ("pipe", 3)], ids=["waves", "lump", "three lumps"]
)
def test_resonance_of_a_blocked_line(kind: str, pieces: int) -> None:
    """2 m, 10 mm, 46 cSt, 870 kg/m^3, 1.6 GPa: 1/cosh(Gamma l) peaks at 164.54 Hz (20.71) and 499.92 Hz (12.18).

    D'Souza & Oldenburger (1964), evaluated with SciPy's Bessel functions; whatever line the model has, lumped or with
    waves and ticks, in one piece or three. 1e-9: the conditioning of what is solved.
    """
    hertz = np.array([164.0, 164.54, 165.0, 499.5, 499.92, 500.4])
    found = responses(blocked(kind, pieces), hertz).transfers[0]
    assert found.exact is not None
    gain = np.abs(found.exact)
    assert gain[[1, 4]] == pytest.approx([20.71, 12.18], abs=5e-3)
    assert (gain[[1, 1, 4, 4]] > gain[[0, 2, 3, 5]]).all()
    w = 1j * 2 * np.pi * hertz * 0.005**2 / 46e-6
    y = np.sqrt(w)
    gamma = 2j * np.pi * hertz / WAVE * np.sqrt(ive(0, y) / ive(2, y)) * 2.0
    np.testing.assert_allclose(found.exact, 1 / np.cosh(gamma), rtol=1e-9)


def test_the_lax_wendroff_line_has_steady_friction() -> None:
    """With steady laminar friction instead the same line would peak at 169.5 Hz with gain 92, and so does the model.

    z = j omega rho/A + 32 mu/(A d^2): 1/cosh peaks at 92.08. 0.2 %: dispersion on 33 cells.
    """
    found = responses(blocked("lax_wendroff_line"), np.linspace(168, 171, 301)).transfers[0]
    gain = np.abs(found.value)
    assert np.linspace(168, 171, 301)[gain.argmax()] == pytest.approx(169.5, abs=0.06)
    assert gain.max() == pytest.approx(92.08, rel=2e-3)


def test_the_model_meets_the_exact_steady_friction_line_as_cells_grow() -> None:
    """Error of p_b/p_a against 1/cosh with steady laminar friction at 100 to 600 Hz falls as cells squared.

    Away from the peaks; order 1.8 or more (Lax-Wendroff is of second order).
    """
    hertz = np.array([100.0, 250.0, 400.0, 600.0])
    s = 2j * np.pi * hertz
    z, y = s * 870 / AREA + 32 * 46e-6 * 870 / (AREA * 0.01**2), s * AREA / 1.6e9
    exactly = 1 / np.cosh(2.0 * np.sqrt(z * y))
    errors = []
    for cells in (10, 20, 40):
        parts = blocked("lax_wendroff_line", internal_nodes=str(cells - 1))
        errors.append(np.abs(responses(parts, hertz, exact=False).transfers[0].value / exactly - 1).max())
    assert np.log2(np.array(errors[:-1]) / errors[1:]).min() > 1.8, errors


def test_waves_without_friction_resonate_at_a_quarter_wave() -> None:
    """a/(4 l) = 169.52 Hz with a = sqrt(K/rho) = 1356.13 m/s, with 1e-6 cSt: the largest gain is there."""
    parts = circuit(
        components={"source": {"type": "pressure_source", "pressure": "0 bar"}, "plug": {"type": "plug"},
                    "line": {"type": "pipe", "length": "2 m", "diameter": "10 mm"}},
        nets={"n_0": ["source.port", "line.a"], "end": ["line.b", "plug.port"]},
        fluid=TEXT | {"kinematic_viscosity": "1e-6 cSt"}, simulation={"stop": "10 us"},
    )  # fmt: skip
    hertz = np.linspace(169.0, 170.0, 1001)
    found = responses(parts, hertz).transfers[0]
    assert found.exact is not None
    assert hertz[np.abs(found.exact).argmax()] == pytest.approx(1356.127 / 8, abs=2e-3)


def test_flows_and_impedances_are_those_of_the_exact_line() -> None:
    """Into the blocked line's first end flows tanh(Gamma l)/Z_c per pressure; at the plug it meets Z_c tanh(Gamma l).

    The flow of the source is minus that into the line.
    """
    hertz = np.array([50.0, 164.0, 300.0])
    found = responses(
        blocked("pipe", 2), hertz, outputs=["line_0.a.q", "source.port.q", "end.p"], impedances=["end", "line_1.b"]
    )  # fmt: skip
    omega = 2 * np.pi * hertz
    z, y = line_series(omega, 0.01, 0.0, OIL, 0.0, 0.0), line_shunt(omega, 0.01, OIL, 0.0)
    into = np.tanh(2.0 * np.sqrt(z * y)) / np.sqrt(z / y)
    flow, source, _, net, port = (t.exact for t in found.transfers)
    np.testing.assert_allclose(flow, into, rtol=1e-9)
    np.testing.assert_allclose(source, -into, rtol=1e-9)
    for each in (net, port):
        np.testing.assert_allclose(each, np.sqrt(z / y) * np.tanh(2.0 * np.sqrt(z * y)), rtol=1e-9)


def test_between_volumes_and_an_orifice() -> None:
    """In a whole circuit the overlay is the same for two models of the line: waves with ticks, and one lump.

    A volume, 1 m of line with 5 L/min, a volume and an orifice. 1e-8: tolerance of the points of rest.
    """
    found = []
    for kind in ("lax_wendroff_line", "pipe"):
        more = {"max_pressure": "60 bar", "start_pressure": "40 bar"} if kind == "lax_wendroff_line" else {}
        parts = circuit(
            components={
                "pump": {"type": "flow_source", "flow": "5 L/min"},
                "first": {"type": "capacity", "volume": "20 cm^3", "start": {"p": "40 bar"}},
                "line": {"type": kind, "length": "1 m", "diameter": "10 mm", **more},
                "last": {"type": "capacity", "volume": "5 cm^3", "start": {"p": "40 bar"}},
                "load": {"type": "orifice", "area": "1 mm^2"}, "tank": {"type": "tank"},
            },
            nets={"inlet": ["pump.port", "first.port", "line.a"], "outlet": ["line.b", "last.port", "load.a"],
                  "back": ["load.b", "tank.port"]},
            fluid=TEXT, simulation={"stop": "0.5 s"},
        )  # fmt: skip
        omega = 2 * np.pi * np.array([1.0, 120.0, 2000.0])
        transfers = frequency_response(
            parts, inputs=["pump.flow", "load.area"], outputs=["inlet.p", "load.q"], omega=omega, exact=True
        ).transfers  # fmt: skip
        found.append(np.array([t.exact for t in transfers]))
    np.testing.assert_allclose(found[0], found[1], rtol=1e-8)


@pytest.mark.parametrize(
    ("wanted", "said"),
    [
        ({"outputs": ["line_0.q"]}, "output line_0.q is inside line_0, .* name line_0.a.q"),
        ({"inputs": ["line_0.diameter"]}, "input line_0.diameter acts inside line_0"),
        ({"inputs": ["fluid.bulk_modulus"], "outputs": ["end.p"]}, "does not act on end.p|acts inside line_0"),
        ({"inputs": [], "outputs": [], "impedances": ["line_0.a"]}, "a source holds the pressure of n_0"),
    ],
)
def test_what_an_exact_line_does_not_know(wanted: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        responses(blocked("pipe"), np.array([10.0]), **wanted)


def test_the_command_draws_the_overlay(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """`--exact-lines` in summary, CSV and picture; the grid is refined until the peak is seen."""
    monkeypatch.chdir(tmp_path)
    Path("blocked.yaml").write_text(BLOCKED, encoding="utf-8")
    options = ["--input", "source.pressure", "--output", "end.p", "--frequencies", "100 Hz:250 Hz", "--points", "100"]
    assert main(["linearize", "blocked.yaml", *options, "--exact-lines", "-o", "b.csv", "--plot"]) == 0
    text = capsys.readouterr().out
    assert "end.p / source.pressure, exact lines" in text
    assert (tmp_path / "b-bode.png").stat().st_size > 10_000
    with open("b.csv", newline="", encoding="utf-8") as file:
        titles, *rows = list(csv.reader(file))
    assert titles[3] == "end.p / source.pressure exact magnitude [1]"
    table = np.array(rows, dtype=float)
    assert table[:, 3].max() == pytest.approx(20.71, rel=1e-3)
    assert table[table[:, 3].argmax(), 0] == pytest.approx(164.54, abs=0.1)


BLOCKED = """\
crescentlab: 1
fluid: {type: simple_oil, density: 870 kg/m^3, kinematic_viscosity: 46 cSt, bulk_modulus: 1.6 GPa}
components:
  source: {type: pressure_source, pressure: 0 bar}
  line: {type: lax_wendroff_line, diameter: 10 mm, length: 2 m, max_pressure: 60 bar}
  plug: {type: plug}
nets:
  start: [source.port, line.a]
  end: [line.b, plug.port]
"""
