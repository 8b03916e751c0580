"""Lines of lumps that are too coarse: told before and after a run, and not where they are fine enough."""

import json
import re

import numpy as np
import pytest
from building import circuit
from crescentlab.components.fluids import SimpleOil
from crescentlab.components.pipes import Pipe

from crescentlab.coarse_lines import _characteristics
from crescentlab.commands.check import facts

PIPE = {"type": "pipe", "length": "200 m", "diameter": "20 mm", "start": {"p": "26.5 bar", "q": "14.4 L/min"}}
CELLS = {
    "type": "distributed_line",
    "length": "200 m",
    "diameter": "20 mm",
    "start_pressure": "30 bar",
    "start_flow": "14.4 L/min",
}
OIL = {"type": "simple_oil", "density": "870 kg/m^3", "kinematic_viscosity": "46 cSt", "bulk_modulus": "1.6 GPa"}


def closure(line, duration):
    """A valve that closes at the end of a line of 200 m; a wave travels it in 147 ms, there and back in 295 ms."""
    return circuit(
        fluid=OIL,
        components={
            "reservoir": {"type": "pressure_source", "pressure": "30 bar"},
            "line": line,
            "v": {"type": "capacity", "volume": "20 cm^3", "start": {"p": "23 bar"}},
            "valve": {"type": "variable_orifice", "area": "6.5 mm^2"},
            "close": {"type": "ramp", "before": "1", "after": "0", "at": "1 s", "duration": duration},
            "tank": {"type": "tank"},
        },
        nets={
            "inlet": ["reservoir.port", "line.a"],
            "outlet": ["line.b", "v.port", "valve.a"],
            "out": ["valve.b", "tank.port"],
            "s": ["close.y", "valve.opening"],
        },
        simulation={"stop": "2 s"},
    )


def cells(count):
    return CELLS | {"cells": str(count)}


def told(made, start=None):
    result = made.simulate(check=False, start=start)
    return result, [said for said in result.trajectory.warnings if "pressures are wrong by" in said]


def remarks(made):
    return [said for said in facts(made.plan())["remarks"] if "too coarse" in said]


def test_a_lump_that_a_valve_closes_faster_than_its_wave_returns_is_told_before_and_after_the_run():
    made = closure(PIPE, "20 ms")
    _, after = told(made)
    [before] = remarks(made)
    assert "close moves valve within 20 ms" in before
    for said in (before, after[-1]):
        assert said.startswith("line: ")
        # ten cells per change: 10 * 147.4 ms / 20 ms
        assert "write type: distributed_line with cells: 74, or transmission_line" in said
    assert json.dumps(facts(made.plan()))  # as --json prints it


def test_what_it_says_to_write_is_quiet_and_right():
    """Beside a line of travelling waves: 23 bar, rho a dv = 9 bar at once, then line packing; one lump says 147 bar."""
    made = closure(cells(74), "20 ms")
    result, after = told(made)
    assert not after
    assert not remarks(made)
    delay = {"type": "transmission_line", "mean_pressure": "30 bar", "lumps": "20"}
    waves, none = told(closure({n: v for n, v in cells(74).items() if n != "cells"} | delay, "20 ms"))
    assert not none
    assert result["outlet.p"].max() == pytest.approx(waves["outlet.p"].max(), rel=0.02)
    assert 38e5 < waves["outlet.p"].max() < 43e5


def test_the_error_that_is_told_falls_with_the_cells():
    errors = []
    for count in (2, 4):
        _, [said] = told(closure(cells(count), "20 ms"))
        errors.append(float(re.search(r"wrong by some ([\d.]+) bar", said)[1]))
    assert errors[0] > errors[1] > 1


def test_a_slow_closure_is_fine_with_few_cells():
    """From rest at 30 bar: a start at one pressure along a line that has a drop is a front of its own."""
    made = closure(cells(4), "3 s")
    assert not remarks(made)
    assert not told(made, start="steady")[1]


@pytest.mark.parametrize("spoiled", [False, True])
def test_waves_of_dalembert_are_no_error(spoiled):
    """p = f(t - x/a) + g(t + x/a), Z q = f - g without friction: any line does this, whatever f and g."""
    line = Pipe(length=10.0, diameter=0.02)
    fluid = SimpleOil(density=870.0, kinematic_viscosity=1e-12, bulk_modulus=1.6e9)
    travel, impedance = (float(each) for each in line.wave(0.0, fluid))
    t = np.linspace(1, 2, 500)

    def ends(at):
        f = [1e5 * np.tanh(50 * (at - 1.5 - x)) for x in (0.0, travel)]
        g = [2e5 * np.sin(7 * (at + x)) for x in (0.0, travel)]
        return np.array([f[0] + g[0], f[1] + g[1], (f[0] - g[0]) / impedance, (g[1] - f[1]) / impedance])

    now, before = ends(t), ends(t - travel)
    if spoiled:
        now[0] += 3e4
    at_a, at_b = _characteristics(line, fluid, 0.0, impedance, now, before)
    assert np.abs(at_b).max() < 100  # the friction of this thin fluid
    assert np.abs(at_a - (3e4 if spoiled else 0)).max() < 100


@pytest.mark.parametrize(("before", "after", "rings"), [(-5, 0, True), (0, -5, False)])
def test_ringing_of_a_front_is_told_from_cavitation(before, after, rings):
    """Joukowsky: rho a dv = 12.5 bar. Stopped flow raises the pressure, and until the front is back at the closed end,
    2 l/a = 2.95 ms later, nothing is below the reservoir's 0 bar. Flow that is drawn at once lowers it by 12.5 bar.
    """
    made = circuit(
        fluid=OIL,
        components={
            "res": {"type": "pressure_source", "pressure": "0 bar"},
            "line": {
                "type": "distributed_line",
                "diameter": "10 mm",
                "length": "2 m",
                "start_flow": f"{-before} L/min",
            },
            "op": {
                "type": "step",
                "output_quantity": "flow",
                "before": f"{before} L/min",
                "after": f"{after} L/min",
                "at": "10 ms",
            },
            "v": {"type": "signal_flow_source"},
        },
        nets={"i": ["res.port", "line.a"], "o": ["line.b", "v.port"], "s": ["op.y", "v.flow"]},
        simulation={"stop": "25 ms"},
    )
    result = made.simulate(check=False)
    assert result.status == "failed"
    assert "below absolute zero" in result.trajectory.error
    assert ("ring behind a front" in result.trajectory.error) == rings
    if rings:
        assert result.time[-1] < 10e-3 + 2.95e-3
        [least] = re.findall(r"make it at least (-?[\d.]+) bar", result.trajectory.error)
        assert -0.5 < float(least) <= 0  # 0 bar less the friction of 5 L/min, 0.27 bar by Hagen and Poiseuille
