"""Operating points of parts that tick: delay lines, registers, samplers; what is an unknown there, and what is not."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from building import OIL, circuit
from scipy.optimize import brentq

from crescentlab.analysis.steady import OperatingPoint, steady
from crescentlab.circuit import Circuit
from crescentlab.component import Component
from crescentlab.domain import held, observable, state
from crescentlab.maths import every, stack
from crescentlab.units import Ratio

BAR = 1e5
RHO_0, BETA, NU = 860.0, 1.4e9, 35e-6
DIAMETER, LENGTH, MEAN = 0.1, 50.0, 30 * BAR
LINE = {"type": "transmission_line", "length": "50 m", "diameter": "100 mm", "mean_pressure": "30 bar",
        "start_pressure": "40 bar"}  # fmt: skip
NODE = {"type": "capacity", "volume": "2 L", "start": {"p": "40 bar"}}
WAVES = ("b_begin", "b_end", "b_mean", "a_begin", "a_end", "a_mean")
NEWTON = 8
"""Iterations that Newton's method may take: its error is squared, from 1e-1 to 1e-16 in five, some more far off."""


def churchill(reynolds: float) -> float:
    """Darcy factor of a smooth pipe: Churchill, Chemical Engineering 84 (1977) 91-92."""
    a = (2.457 * math.log(1 / (7 / reynolds) ** 0.9)) ** 16
    b = (37530 / reynolds) ** 16
    return 8 * ((8 / reynolds) ** 12 + (a + b) ** -1.5) ** (1 / 12)


def drop(q: float) -> float:
    """Darcy-Weisbach, f l/d rho v^2/2 [Pa], at the density of the line's mean pressure."""
    rho = RHO_0 * math.exp(MEAN / BETA)
    v = RHO_0 * abs(q) / rho / (math.pi / 4 * DIAMETER**2)
    return math.copysign(churchill(v * DIAMETER / NU) * LENGTH / DIAMETER * rho * v * v / 2, q)


def draw(litres: float) -> dict[str, Any]:
    """A source that draws so many litres per second."""
    return {"type": "flow_source", "flow": f"-{litres * 60} L/min"}


def one_line(lumps: int, **values: Any) -> Circuit:
    """A line from a reservoir of 40 bar to a volume from which 20 L/s are drawn."""
    parts = {"source": {"type": "pressure_source", "pressure": "40 bar"},
             "line": {**LINE, "lumps": lumps, **values}, "node": NODE, "load": draw(20)}  # fmt: skip
    nets = {"a": ["source.port", "line.a"], "b": ["line.b", "node.port", "load.port"]}
    return circuit(components=parts, nets=nets, fluid=OIL, simulation={"stop": "2 s"})


def unknowns(lumps: int) -> int:
    """Six waves and two flows sent, flow and loss of each lump; every wave between two lumps is held twice."""
    return 6 * 2 * lumps - 6 * (lumps - 1) + 2 + 2 * lumps


def levels(point: OperatingPoint, line: str) -> dict[str, np.ndarray]:
    """Held waves of a line by name."""
    places = {name: k for k, name in enumerate(point.system.held_names)}
    return {
        w: np.array([point.snapshot.h[k] for n, k in places.items() if n.startswith(f"{line}.{w}[")]) for w in WAVES
    }


@pytest.mark.parametrize("lumps", [1, 3, 10, 20])
def test_a_delay_line_at_rest(lumps):
    """The drop of Darcy and Weisbach; as many iterations whatever the number of lumps, and each wave once.

    1e-9 of the pressures is the search's own tolerance. Nothing is left open, so nothing is taken from the start.
    """
    point = steady(one_line(lumps))
    assert 40 * BAR - point.result["b.p"][0] == pytest.approx(drop(20e-3), abs=1e-8 * 40 * BAR)
    assert (point.method, point.unknowns) == ("newton", 1 + unknowns(lumps))
    assert point.iterations <= NEWTON
    assert not any("at rest too" in said for said in point.warnings)


def test_waves_at_rest_do_not_change_within_a_tick():
    """Begin, end and mean of each cell's wave are one; 1e-9 of the waves, which are of p and Z q."""
    waves = levels(steady(one_line(5)), "line")
    for way in "ab":
        size = BAR + np.abs(waves[f"{way}_mean"])
        assert np.abs(waves[f"{way}_begin"] - waves[f"{way}_mean"]).max() < 1e-9 * size.max()
        assert np.abs(waves[f"{way}_end"] - waves[f"{way}_mean"]).max() < 1e-9 * size.max()


def test_a_run_from_a_delay_line_at_rest_stays_there():
    """Within ticks too: flow into the line and pressure behind it, over two hundred ticks, within 1e-6."""
    run = one_line(5)
    point = steady(run)
    after = run.simulate("0.8 s", rtol=1e-7, solver="rodas", start=point.snapshot)
    assert after.trajectory.statistics.ticks > 190
    assert np.abs(after["line.q"] - 20e-3).max() < 1e-6 * 20e-3
    assert np.abs(after["b.p"] - point.result["b.p"][0]).max() < 1e-6 * 40 * BAR


def test_the_start_of_the_waves_does_not_decide():
    """From the middle of a hammer as from the circuit's own start."""
    run = one_line(4)
    hammer = run.simulate("0.15 s")
    near = steady(run, start=hammer)
    assert near.result["b.p"][0] == pytest.approx(steady(run).result["b.p"][0], rel=1e-9)


def test_five_lines_of_twenty_lumps():
    """A loop of four behind a fifth: the flow divides so that both ways drop as much, by Brent's method.

    The unknowns are those of five lines and four volumes, and the iterations those of one line.
    """
    parts: dict[str, Any] = {
        "source": {"type": "pressure_source", "pressure": "40 bar"},
        "near": draw(6),
        "far": draw(14),
    }
    parts |= {f"line_{k}": {**LINE, "lumps": 20} for k in range(1, 6)} | {f"node_{k}": NODE for k in range(1, 5)}
    nets = {"p_0": ["source.port", "line_1.a"], "p_1": ["line_1.b", "node_1.port", "line_2.a", "line_3.a"],
            "p_2": ["line_2.b", "node_2.port", "line_4.a"], "p_3": ["line_3.b", "node_3.port", "line_5.a", "near.port"],
            "p_4": ["line_4.b", "line_5.b", "node_4.port", "far.port"]}  # fmt: skip
    point = steady(circuit(components=parts, nets=nets, fluid=OIL, simulation={"stop": "2 s"}))
    q = brentq(lambda q: 2 * drop(q) - drop(20e-3 - q) - drop(14e-3 - q), 1e-3, 13e-3, xtol=1e-15)
    p_1 = 40 * BAR - drop(20e-3)
    by_hand = [p_1, p_1 - drop(q), p_1 - drop(20e-3 - q), p_1 - 2 * drop(q)]
    assert [point.result[f"p_{k}.p"][0] for k in range(1, 5)] == pytest.approx(by_hand, abs=1e-8 * 40 * BAR)
    assert point.result["line_2.q"][0] == pytest.approx(q, rel=1e-7)
    assert (point.method, point.unknowns) == ("newton", 4 + 5 * unknowns(20))
    assert point.iterations <= NEWTON


class Register(Component):
    """Twelve samples of a signal on their way, and what they average to."""

    x = state(Ratio, "follows the oldest sample", start=3.0)
    old = held(Ratio, "samples, the youngest first", start=0.0, size=12)
    mean = observable(Ratio, "their mean")

    def equations(self, x, old):
        last = old[-1]
        return {"der_x": 2 - x - last / 2, "mean": (old[0] + last) / 2, "tick": every(0.1, old=stack(x, old)[:-1])}


class Ring(Component):
    """Four values that go round."""

    x = state(Ratio, "follows one of them", start=0.0)
    ring = held(Ratio, "values", start=(1.0, 2.0, 3.0, 4.0), size=4)

    def equations(self, x, ring):
        return {"der_x": ring[0] - x, "tick": every(0.1, ring=stack(ring[-1], ring)[:-1])}


def test_a_register_is_what_goes_into_it():
    """2 - x - x/2 = 0: one unknown, x = 4/3, and twelve samples of it; the register starts away from rest."""
    point = steady(circuit(Register, components={"r": {"type": "register"}}, simulation={"stop": "10 s"}))
    assert point.unknowns == 1
    assert point.snapshot.x == pytest.approx([4 / 3], rel=1e-12)
    assert point.snapshot.h == pytest.approx(np.full(12, 4 / 3), rel=1e-12)
    assert point.result["r.mean"][0] == pytest.approx(4 / 3, rel=1e-12)


def test_what_goes_round_is_one_unknown_that_nothing_changes():
    """A ring at rest is level, at the value of its first place; x follows."""
    point = steady(circuit(Ring, components={"r": {"type": "ring"}}, simulation={"stop": "10 s"}))
    assert (point.unknowns, point.resting) == (2, ("r.ring[1]",))
    assert point.snapshot.h.tolist() == [1.0] * 4
    assert point.snapshot.x == pytest.approx([1.0])
