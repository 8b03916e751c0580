"""Runs that come to rest within their tolerance, where the root of an orifice's law throws implicit methods about."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from building import OIL, circuit

from crescentlab.circuit import Circuit
from crescentlab.component import Component
from crescentlab.domain import state, takes_pressure
from crescentlab.maths import exp
from crescentlab.solvers.functions import Functions
from crescentlab.solvers.settling import Settling
from crescentlab.solvers.steppers import stepper
from crescentlab.units import Ratio

WATER = {"type": "water", "temperature": "20 degC"}
METHODS = ["auto", "lsoda", "bdf", "radau", "cvode"]
FEW = 500
"""Steps that a run to rest may take; a run of LSODA's on the law's own, laminar end takes a hundred."""
END = (2 * 3 + 0.8 * 1.5) / 2.8
"""Level [m] at which two tanks of 2 and 0.8 m^2 with levels of 3 and 1.5 m are equal."""


def tank(area: float, level: float, inlets: int = 0) -> dict[str, Any]:
    """An open tank."""
    return {"type": "reservoir", "area": f"{area} m2", "height": "6 m", "start_level": f"{level} m", "inlets": inlets}


HOLE = {"type": "orifice", "area": "78.539816 cm2", "cd_max": "0.7"}


def two_tanks(levels: tuple[float, float], *classes: type[Component], **feed: Any) -> Circuit:
    """Two tanks joined by a hole of 10 cm, which is laminar below a drop of some 50 nm of level."""
    parts = {"big": tank(2, levels[0], inlets=bool(feed)), "small": tank(0.8, levels[1]), "hole": HOLE, **feed}
    nets = {"p_big": ["big.outlet", "hole.a"], "p_small": ["small.outlet", "hole.b"]}
    nets |= {"fill": [f"{name}.port" for name in feed] + ["big.inlet[1]"]} if feed else {}
    return circuit(*classes, components=parts, nets=nets, fluid=WATER, simulation={"stop": "200 s"})


@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-8])
@pytest.mark.parametrize("solver", METHODS)
def test_two_tanks_at_equal_level(solver, rtol):
    """Both at the mean level; the difference falls as Torricelli has it, 2 A B/(A + B)/(C_d a sqrt(2 g)) (root - root).

    The difference at 20 s, far from the law's laminar end, to 20 tolerances of 3 m, and 1e-5 m for the density, which
    is the fluid's at up to 0.3 bar.
    """
    run = two_tanks((3.0, 1.5)).simulate("200 s", solver=solver, rtol=rtol, output_step="20 s")
    assert run.trajectory.statistics.steps < FEW
    assert run.trajectory.solver.startswith(solver)
    ends = [run["big.h"][-1], run["small.h"][-1]]
    assert ends == pytest.approx([END, END], abs=2 * rtol * END)
    fall = 0.7 * 78.539816e-4 * math.sqrt(2 * 9.80665) * (1 / 2 + 1 / 0.8)
    apart = (math.sqrt(1.5) - fall * 20 / 2) ** 2
    assert run["big.h"][1] - run["small.h"][1] == pytest.approx(apart, abs=1e-5 + 20 * rtol * 3)


@pytest.mark.parametrize("solver", METHODS)
@pytest.mark.parametrize(
    ("area", "volumes", "fluid"),
    [("100 mm^2", ("5 L", "2 L"), OIL), ("10 cm^2", ("1 m3", "0.1 m3"), WATER), ("50 cm^2", ("2 L", "1 m3"), WATER)],
)
def test_volumes_that_have_levelled_out(solver, area, volumes, fluid):
    """Capacities joined by a hole: 1 000 s after some ms of flow take no more steps than the flow; fluid is kept."""
    parts = {"a": {"type": "capacity", "volume": volumes[0], "start": {"p": "50 bar"}},
             "b": {"type": "capacity", "volume": volumes[1]}, "hole": {"type": "orifice", "area": area}}  # fmt: skip
    run = circuit(components=parts, nets={"p": ["a.port", "hole.a"], "r": ["b.port", "hole.b"]}, fluid=fluid)
    done = run.simulate("1000 s", solver=solver, rtol=1e-4)
    assert done.trajectory.statistics.steps < FEW
    assert done["a.p"][-1] == pytest.approx(done["b.p"][-1], rel=2e-4)
    stored = [done[f"{name}.content"] for name in "ab"]
    assert stored[0][-1] + stored[1][-1] == pytest.approx(stored[0][0] + stored[1][0], rel=1e-5)


@pytest.mark.parametrize("flow", ["0.1 L/min", "0.5 L/min", "2 L/min"])
@pytest.mark.parametrize("rtol", [1e-4, 1e-6])
def test_tanks_that_rise_together(flow, rtol):
    """q t/(A + B): a flow so small that the drop over the hole lies within the tolerance, and all drifts."""
    run = two_tanks((2.0, 2.0), feed={"type": "flow_source", "flow": flow}).simulate("200 s", rtol=rtol)
    assert run.trajectory.statistics.steps < FEW
    litres = float(flow.split()[0]) / 60e3 * 200
    level = (2 * run["big.h"][-1] + 0.8 * run["small.h"][-1]) / 2.8
    assert level == pytest.approx(2 + litres / 2.8, abs=2 * rtol * 2)


class Gush(Component):
    r"""Flow of a bell's shape over time.

    .. math:: q = q_0 e^{-((t - t_0)/T)^2}
    """

    port = takes_pressure("where it goes")

    def equations(self, p_port, t):
        return {"q_port": -1e-3 * exp(-(((t - 150) / 10) ** 2))}


@pytest.mark.parametrize("solver", METHODS)
def test_what_moves_again_is_followed(solver):
    """A smooth flow after 100 s of rest, without any event: q_0 T sqrt(pi)/2 (1 + erf((t - t_0)/T)) have come in."""
    rtol = 1e-6
    done = two_tanks((3.0, 1.5), Gush, feed={"type": "gush"}).simulate("200 s", solver=solver, rtol=rtol)
    assert done.trajectory.statistics.steps < 2 * FEW
    level = (2 * done["big.h"] + 0.8 * done["small.h"]) / 2.8
    came = 1e-3 * 10 * math.sqrt(math.pi) / 2 * (1 + np.vectorize(math.erf)((done.time - 150) / 10))
    assert np.abs(level - END - came / 2.8).max() < 20 * rtol * 3


class Grows(Component):
    """dx/dt = rate x (1 - x^2): leaves 0 if the rate is positive, stays if it is negative."""

    rate: Ratio
    x = state(Ratio, "what grows", start=1e-9)

    def equations(self, x):
        return {"der_x": self.rate * x * (1 - x * x)}


@pytest.mark.parametrize(("rate", "rests"), [(-1.0, True), (1.0, False)])
def test_what_leaves_its_rest_is_not_held_there(rate, rests):
    """1e-9, a thousandth of the tolerance: a long implicit step would end nearer to 0, e^(10) is what it must grow."""
    run = circuit(Grows, components={"g": {"type": "grows", "rate": rate}}, simulation={"stop": "100 s"})
    design = run.design()
    system = run.assembled(design)
    values = system.values(design)
    method = stepper("lsoda", Functions(system, values), 1e-6, np.full(1, 1e-6))
    assert isinstance(method, Settling)
    after = method.solved(0.0, values.x0, 10.0)
    assert (after is not None) == rests
    assert after is None or after == pytest.approx([1e-9 / 11], rel=1e-6)
