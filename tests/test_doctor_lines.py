"""Lines judged by the examination of a circuit: their own two-ports and errors against closed forms, the advice."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from building import OIL, circuit
from crescentlab.components.distributed_lines import DistributedLine
from crescentlab.components.lax_wendroff import LaxWendroffLine, LaxWendroffLineTakesTakes
from crescentlab.components.pipes import (
    Pipe,
    PipeCapacitiveCapacitive,
    PipeCapacitiveInertial,
    PipeInertialCapacitive,
    PipeInertialInertial,
)
from crescentlab.components.transmission_lines import TransmissionLine
from crescentlab.components.two_ports import two_port_of
from refusing import Refusal

from crescentlab import units
from crescentlab.analysis.doctor import advice, examine
from crescentlab.analysis.doctor.line_advice import chain
from crescentlab.analysis.doctor.line_errors import line_errors
from crescentlab.analysis.doctor.line_models import Ends, own_two_port, scattering_error
from crescentlab.analysis.doctor.line_text import part_of
from crescentlab.analysis.linear import linearize
from crescentlab.analysis.steady import steady
from crescentlab.circuit import Circuit, load
from crescentlab.commands.doctor import told
from crescentlab.component import Component
from crescentlab.fluid import Fluid
from crescentlab.yaml_text import Node

BETA, RHO, NU = 1.4e9, 860.0, 35e-6
"""Bulk modulus [Pa], density [kg/m^3] and viscosity [m^2/s] of the test's oil."""

PIPE = {"length": 0.5, "diameter": 0.01, "roughness": 0.0, "loss_coefficient": 0.0}


def pulsating(pipe: dict[str, object], frequency: str = "400 Hz", end: str | None = None) -> Circuit:
    """A pulsating flow through a volume, a pipe and a throttle, with a volume ``end`` before it where one is given."""
    parts: dict[str, dict[str, object]] = {
        "wave": {"type": "sine", "mean": "20 L/min", "amplitude": "0.3 L/min", "frequency": frequency},
        "pump": {"type": "signal_flow_source"},
        "volume": {"type": "capacity", "volume": "50 cm^3", "start": {"p": "2.5 bar"}},
        "pipe": {"type": "pipe", "diameter": "10 mm", "start": {"p": "2.5 bar", "q": "20 L/min"}, **pipe},
        "hole": {"type": "throttle", "area": "20 mm^2"},
        "tank": {"type": "tank"},
    }
    nets = {
        "asked": ["wave.y", "pump.flow"],
        "p1": ["pump.port", "volume.port", "pipe.a"],
        "p2": ["pipe.b", "hole.a"],
        "p3": ["hole.b", "tank.port"],
    }
    if end is not None:
        parts["body"] = {"type": "capacity", "volume": end, "start": {"p": "2.4 bar"}}
        nets["p2"].append("body.port")
    period = "'= 1 / 400 Hz'" if frequency == "400 Hz" else "25 ms"
    return circuit(components=parts, nets=nets, fluid=OIL, simulation={"stop": "50 ms", "period": period.strip("'")})


def test_a_lumped_pipe_has_the_two_port_of_its_equations() -> None:
    """Capacity then inertia: q_a = j w C p_a + q, (j w I + R) q = p_a - p_b; C = A l/beta, I = rho l/A."""
    area = np.pi / 4 * 1e-4
    form = PipeCapacitiveInertial.model_construct(**PIPE)
    oil = pulsating({"length": "0.5 m"}).design().fluids["fluid"]
    omega = 2 * np.pi * np.array([10.0, 400.0])
    own = own_two_port(form, oil, omega, Ends(0.0, 0.0, 0.0, 0.0))
    C, inertance = area * 0.5 / BETA, RHO * 0.5 / area
    resistance = 128 * RHO * NU * 0.5 / (np.pi * 0.01**4)
    series = 1 / (1j * omega * inertance + resistance)
    exact = np.array([[1j * omega * C + series, -series], [-series, series]]).transpose(2, 0, 1)
    assert own is not None
    assert np.abs(own / exact - 1).max() < 1e-3  # friction is smoothed near rest


@pytest.mark.parametrize(
    "form", [PipeCapacitiveCapacitive, PipeInertialInertial, PipeCapacitiveInertial, PipeInertialCapacitive]
)
def test_lumps_in_series_come_to_the_line(form: type[Component]) -> None:
    """N lumps err by (w l/a)^2/N^2 and less: at 400 Hz, and with no losses but those of the model, 64 are a line.

    The line here is the exact one with the resistance of steady flow, tanh and all (Wylie & Streeter 1993, chapter 12).
    """
    from crescentlab.components.two_ports import two_port_of

    oil = pulsating({"length": "0.5 m"}).design().fluids["fluid"]
    omega = 2 * np.pi * np.array([50.0, 400.0])
    area = np.pi / 4 * 1e-4
    series = 1j * omega * RHO / area + 128 * RHO * NU / (np.pi * 0.01**4)
    exact = two_port_of(series, 1j * omega * area / BETA, 0.5)
    ends, part = Ends(0.0, 0.0, 0.0, 0.0), form.model_construct(**PIPE)
    coarse, middle, fine = (scattering_error(chain(part, n, oil, omega, ends), exact).max() for n in (4, 16, 64))
    assert coarse > 1.5 * middle > 2 * fine
    assert fine < 0.02


def advised(note: str) -> dict[str, object]:
    """The component that the advice writes, with a start near rest."""
    match = re.fullmatch(r"write \{(.*)\}", note)
    assert match is not None, note
    written: dict[str, object] = dict(pair.split(": ") for pair in match[1].split(", "))
    return {**written, "start": {"p_node": "2.5 bar", "q_node": "20 L/min"}}


def test_a_coarse_pipe_is_told_and_the_advice_passes() -> None:
    """1 m is 0.31 of a wave of 400 Hz at 1276 m/s: one lump is wrong by more than half; what is advised is right.

    The cells are the fewest: with one less the same bound is missed.
    """
    found = examine(pulsating({"length": "1 m"}), line_error=0.1)
    (line,) = found.lines
    assert not line.within
    assert line.worst[0] > 0.5
    assert line.frequencies == pytest.approx([400.0])
    assert any(said.startswith("pipe (pipe) is ") and said.endswith(line.note) for said in advice(found))
    fine = advised(line.note)
    assert fine["type"] == "distributed_line"
    assert fine["length"] == "1 m"
    cells = int(str(fine["cells"]))
    assert cells == line.parts
    again = [examine(pulsating({**fine, "cells": str(n)}), line_error=0.1).lines[0] for n in (cells, cells - 1)]
    enough, too_few = (float(each.errors[np.isclose(each.frequencies, 400.0)][0]) for each in again)
    assert enough <= 0.1 < too_few  # the finer line also carries 1200 Hz, which the throttle makes of 400


LONG = """crescentlab: 1
title: Pulsating flow in a long line
fluid: {type: simple_oil, density: 870 kg/m^3, kinematic_viscosity: 46 cSt, bulk_modulus: 1.6 GPa}
parameters: {bore: 20 mm, supply: 30 bar}
components:
  wave: {type: sine, mean: 20 L/min, amplitude: 2 L/min, frequency: 8 Hz}
  source: {type: signal_flow_source}
  line: {LINE}
  v: {type: capacity, volume: 20 cm^3, start: {p: 23 bar}}
  hole: {type: throttle, area: 6.5 mm^2}
  tank: {type: tank}
nets:
  asked: [wave.y, source.flow]
  inlet: [source.port, line.a]
  outlet: [line.b, v.port, hole.a]
  out: [hole.b, tank.port]
simulation: {stop: 2 s, period: 125 ms}
"""
"""50 m is 0.29 of a wave of 8 Hz at 1356 m/s."""


@pytest.mark.parametrize(
    ("text", "same", "gone"),
    [
        (
            "type: distributed_line, length: 50 m, diameter: = bore, cells: 1, start_pressure: = supply, "
            "start_flow: 18.85 L/min",
            ["length: 50 m", "diameter: = bore", "start_pressure: = supply", "start_flow: 18.85 L/min"],
            ["cells: 1,"],
        ),
        (
            "type: pipe, length: 5000 cm, diameter: '= max(bore, 1 mm)', start: {p: = supply, q: 18.85 L/min}",
            ["length: 5000 cm", "diameter: '= max(bore, 1 mm)'", "start_pressure: = supply", "start_flow: 18.85 L/min"],
            ["start: {"],
        ),
    ],
)  # fmt: skip
def test_the_line_to_paste_keeps_the_users_text(text: str, same: list[str], gone: list[str], refused: Refusal) -> None:
    """What the user wrote stands in the advice as written; the file with it in place of the old line passes check."""
    refused.write({"a.yaml": LONG.replace("LINE", text)})
    (line,) = examine(load(refused.folder / "a.yaml"), line_error=0.05).lines
    match = re.fullmatch(r"write \{(.*)\}", line.note)
    assert match is not None, line.note
    assert match[1].startswith("type: distributed_line, length: ")
    assert all(f", {each}" in f", {match[1]}," for each in same)
    assert not any(each in match[1] for each in gone)
    assert match[1].count("cells: ") == 1
    assert set(re.findall(r"(\w+): ", match[1])) <= set(DistributedLine.model_fields) | {"type"}
    refused.write({"a.yaml": LONG.replace("LINE", match[1])})
    code, out, _ = refused.run("check", "a.yaml")
    assert code == 0
    assert "warning" not in out


@pytest.mark.parametrize(
    ("whole", "part"),
    [("200 m", "40 m"), ("1 in", "0.2 in"), ("= 2 * bore", "'= (2 * bore) / 5'"), ("1e3 mm", "200 mm")],
)
def test_lines_in_series_are_as_long_as_the_user_counts(whole: str, part: str) -> None:
    """A fifth of the length, in the unit of the whole or as its formula."""
    length = 0.0 if whole.startswith("=") else units.length.parse(whole)
    assert part_of(Node(whole), length, 5) == part


def test_a_short_pipe_is_let_pass() -> None:
    """A hundredth of a wave: one lump is right to some (w l/a)^2/6 and to the losses that depend on frequency."""
    found = examine(pulsating({"length": "31.25 mm"}), line_error=0.1)
    assert found.lines[0].within
    assert not any("is allowed" in said for said in advice(found))


def test_where_friction_is_missing_its_terms_are_advised() -> None:
    """At 400 Hz laminar friction is sqrt(w R^2/(8 nu))/4 = 3.7 times Poiseuille's (Zielke 1968): no cells have that."""
    found = examine(pulsating({"length": "1 m"}), line_error=0.02)
    fine = advised(found.lines[0].note)
    assert int(str(fine["friction_terms"])) > 0
    assert examine(pulsating(fine), line_error=0.02).lines[0].within


def test_nothing_is_said_of_a_line_in_which_nothing_moves() -> None:
    parts = {
        "volume": {"type": "capacity", "volume": "50 cm^3"},
        "pipe": {"type": "pipe", "diameter": "10 mm", "length": "1 m"},
        "end": {"type": "plug"},
    }
    nets = {"p1": ["volume.port", "pipe.a"], "p2": ["pipe.b", "end.port"]}
    still = circuit(components=parts, nets=nets, fluid=OIL, simulation={"stop": "10 ms"})
    (line,) = line_errors(still.simulate(solver="rodas"), still.library, None, 0.05)
    assert line.within
    assert line.note == "nothing oscillates in it"


# -- lines that tick -----------------------------------------------------------------------------

THIN = {**OIL, "kinematic_viscosity": "0.001 cSt"}
PRESSURE = 20e5


def ticking(cls: type[Component], cells: int, length: float = 1.0, **more: object) -> Component:
    """A Lax-Wendroff or transmission line of 10 mm."""
    given = {n: f.default for n, f in cls.model_fields.items()} | {"length": length, "diameter": 0.01}
    if issubclass(cls, LaxWendroffLine):
        return cls.model_construct(**given | {"internal_nodes": cells - 1, "max_pressure": PRESSURE} | more)
    return cls.model_construct(**given | {"lumps": cells, "mean_pressure": PRESSURE} | more)


@pytest.mark.parametrize("lax_wendroff", LaxWendroffLine.forms())
def test_a_lax_wendroff_line_comes_to_the_exact_one_with_second_order(lax_wendroff: type[Component]) -> None:
    """Twice the cells, a quarter of the error, against the exact waves with the resistance of steady laminar flow.

    Coarse cells of 1/14 of a wave have other orders besides, so the last two of 20, 40 and 80 are the strictest.
    """
    own = [ticking_two_port(ticking(lax_wendroff, n)) for n in (20, 40, 80)]
    coarse, middle, fine = (scattering_error(each, steady_waves()) for each in own)
    assert np.log2(coarse / middle) == pytest.approx(2, abs=0.3)
    assert np.log2(middle / fine) == pytest.approx(2, abs=0.1)
    assert fine.max() < 1e-3


@pytest.mark.parametrize("transmission", TransmissionLine.forms())
def test_a_transmission_line_comes_to_the_exact_one_with_second_order(transmission: type[Component]) -> None:
    """The delay is exact, lumped friction is the trapezoidal rule of it spread, of second order in their distance."""
    own = [ticking_two_port(ticking(transmission, n)) for n in (5, 10, 20)]
    coarse, middle, fine = (scattering_error(each, steady_waves()) for each in own)
    assert np.log2(coarse / middle) == pytest.approx(2, abs=0.1)
    assert np.log2(middle / fine) == pytest.approx(2, abs=0.1)
    assert coarse.max() < 1e-3


WAVES = 2 * np.pi * np.array([50.0, 200.0, 400.0, 800.0])


def ticking_two_port(form: Component, omega: np.ndarray = WAVES, fluid: dict[str, str] = OIL) -> np.ndarray:
    """Its own two-port at rest at 20 bar."""
    own = own_two_port(form, oil_of(fluid), omega, Ends(PRESSURE, PRESSURE, 0.0, 0.0))
    assert own is not None
    return own


def oil_of(data: dict[str, str]) -> Fluid:
    """The fluid of these data."""
    closed = {"v": {"type": "capacity", "volume": "1 cm^3"}, "end": {"type": "plug"}}
    return circuit(components=closed, nets={"n": ["v.port", "end.port"]}, fluid=data).design().fluids["fluid"]


def steady_waves() -> np.ndarray:
    """Exact two-port of 1 m with Poiseuille's resistance 128 mu/(pi d^4): Wylie & Streeter (1993), chapter 12.

    At 20 bar: rho = rho_0 exp(p/beta); mu = rho nu, and q is mass flow over rho_0.
    """
    area = np.pi / 4 * 1e-4
    series = 1j * WAVES * RHO / area + 128 * RHO * NU / (np.pi * 0.01**4)
    density = float(oil_of(OIL).density(PRESSURE))  # type: ignore[arg-type]
    return np.asarray(two_port_of(series, 1j * WAVES * area * density / (RHO * BETA), 1.0))


@pytest.mark.parametrize("courant", [0.5, 0.9])
def test_a_coarse_lax_wendroff_line_is_as_slow_as_its_scheme(courant: float) -> None:
    r"""Waves of 8 cells per length, against the closed-form dispersion of the scheme.

    .. math:: g = 1 - \tfrac12 \nu (\kappa - 1/\kappa) + \tfrac12 \nu^2 (\kappa - 2 + 1/\kappa), \quad
              g = e^{j\omega\Delta t}

    kappa is what a wave that runs to b keeps per cell. One line over another that is 20 cells shorter shows kappa^20,
    the ends cancel but for waves that run the line three times. Source: Hirsch, Numerical Computation of Internal and
    External Flows, vol. 2 (1990), section 17.2.
    """
    oil, cell, cells = oil_of(THIN), 0.02, 20
    speed = np.sqrt(BETA / float(oil.density(PRESSURE)))  # type: ignore[arg-type]
    omega = np.array([2 * np.pi * speed / (8 * cell)])
    g = np.exp(1j * omega[0] * courant * cell / speed)
    roots = np.roots([(courant**2 - courant) / 2, 1 - courant**2 - g, (courant**2 + courant) / 2])
    exact = np.exp(-1j * omega[0] * cell / speed)
    kappa = roots[np.argmin(np.abs(roots - exact))]

    def through(n: int) -> complex:
        form = ticking(LaxWendroffLineTakesTakes, n, n * cell, courant_number=courant)
        impedance = RHO * speed / (np.pi / 4 * 1e-4)
        y = impedance * ticking_two_port(form, omega, THIN)[0]
        return complex(((np.eye(2) - y) @ np.linalg.inv(np.eye(2) + y))[1, 0])

    assert through(2 * cells) / through(cells) == pytest.approx(kappa**cells, rel=2e-3)
    assert abs(kappa**cells - exact**cells) > 0.2


@pytest.mark.parametrize("family", [LaxWendroffLine, TransmissionLine, Pipe])
def test_a_line_without_rest_is_not_judged(family: type[Component]) -> None:
    """Means that are no numbers have no rest, and no two-port."""
    nothing = Ends(float("nan"), 1e5, 0.0, 0.0)
    for form in family.forms():
        given = ticking(form, 4) if family is not Pipe else form.model_construct(**PIPE)
        assert own_two_port(given, oil_of(OIL), WAVES, nothing) is None


def lined(line: dict[str, object], frequency: str = "400 Hz") -> Circuit:
    """The circuit of :func:`pulsating` with another line of 1 m in place of its pipe."""
    return pulsating({"length": "1 m", "start": {}, **line}, frequency, end="5 cm^3")


def test_the_two_port_of_the_line_alone_is_that_inside_a_circuit() -> None:
    """Flows of the line per its ends' pressures in the linear model of a whole circuit, whose ends are no pure sines
    between ticks: what is off falls with omega T, here 0.03 at 50 Hz and less at 10 Hz.
    """
    whole = lined(LAX | {"internal_nodes": "9"})
    at = steady(whole, {"wave.amplitude": "0 L/min"})
    names = ["pipe.a.p", "pipe.b.p", "pipe.a.q", "pipe.b.q"]
    model = linearize(whole, {"wave.amplitude": "0 L/min"}, at=at, inputs=["p1.q", "p2.q"], outputs=names)
    omega = 2 * np.pi * np.array([10.0, 50.0])
    H = model.response(omega)
    inside = H[:, 2:] @ np.linalg.inv(H[:, :2])
    p_a, p_b, q_a, q_b = (float(at.result[n][-1]) for n in names)
    form = type(model.system.plan.components["pipe"]).model_construct(**dict(model.design.instances["pipe"].component))
    own = own_two_port(form, model.design.fluids["fluid"], omega, Ends(p_a, p_b, q_a, q_b))
    assert own is not None
    assert scattering_error(own, inside).max() < 1e-4


LAX: dict[str, object] = {"type": "lax_wendroff_line", "max_pressure": "10 bar", "start_pressure": "2.5 bar",
                          "start_flow": "20 L/min"}  # fmt: skip
DELAY: dict[str, object] = {"type": "transmission_line", "mean_pressure": "2.5 bar", "start_pressure": "2.5 bar",
                            "start_flow": "20 L/min"}  # fmt: skip


@pytest.mark.parametrize(
    ("line", "bound", "written"),
    [
        (LAX | {"internal_nodes": "1"}, 0.1, ["internal_nodes"]),
        (DELAY | {"friction_terms": "10", "lumps": "1"}, 0.01, ["lumps"]),
        (DELAY | {"lumps": "10"}, 0.02, ["lumps", "friction_terms"]),
    ],
)
def test_a_coarse_line_that_ticks_is_told_and_the_advice_passes(
    line: dict[str, object], bound: float, written: list[str]
) -> None:
    """1 m is 0.31 of a wave of 400 Hz. What is advised passes, one part less does not."""
    (found,) = examine(lined(line), line_error=bound).lines
    assert not found.within
    assert found.note.startswith("write ")
    fine = dict(pair.split(": ") for pair in found.note.removeprefix("write ").split(", "))
    assert list(fine) == written
    parts = int(fine[written[0]])
    assert parts == found.parts
    again = [
        examine(lined(line | fine | {written[0]: str(n)}), line_error=bound).lines[0] for n in (parts, parts - 1) if n
    ]
    errors = [float(each.errors[np.isclose(each.frequencies, 400.0)][0]) for each in again]
    assert errors[0] <= bound
    assert all(bound < error for error in errors[1:])


def test_where_a_lax_wendroff_line_has_no_friction_a_distributed_line_is_advised() -> None:
    """At 400 Hz laminar friction is 3.7 times Poiseuille's (Zielke 1968), which no number of nodes brings."""
    (found,) = examine(lined(LAX | {"internal_nodes": "9"}), line_error=0.02).lines
    fine = advised(found.note)
    assert fine["type"] == "distributed_line"
    assert int(str(fine["friction_terms"])) > 0
    again = examine(lined(fine), line_error=0.02).lines[0]
    assert float(again.errors[np.isclose(again.frequencies, 400.0)][0]) <= 0.02


def test_frequencies_above_a_quarter_of_the_tick_rate_are_left_out() -> None:
    """Two cells of 0.5 m tick at 0.9 0.5 m/1276 m/s = 0.35 ms, 2.8 kHz: 400 Hz is judged, 1 kHz is not."""
    coarse = LAX | {"internal_nodes": "1"}
    (low,) = examine(lined(coarse), line_error=1.9).lines
    assert np.isclose(low.frequencies, 400.0).any()
    (high,) = examine(lined(coarse, frequency="1 kHz"), line_error=1.9).lines
    assert any(np.isclose(each, 1000.0) for each in high.left_out)
    assert not np.any(high.frequencies > 710)


def test_the_command_says_which_frequencies_of_a_line_that_ticks_are_left_out() -> None:
    """The test's oscillation is a judged one of 400 Hz; that the line has others is made up."""
    found = examine(lined(LAX | {"internal_nodes": "3"}))
    assert "left out" not in told(found)
    assert "not judged above" not in told(found)
    more = replace(found, lines=tuple(replace(line, left_out=(1000.0, 2e3, 3e3, 4e3)) for line in found.lines))
    assert "400 Hz; not judged above a quarter of its tick rate: 1 kHz, 2 kHz, 3 kHz, ..." in told(more)
