"""What a revolution of the pump costs, in counts that depend on no machine: a regression is seen without a clock.

The bounds leave a tenth above what was measured when each was last improved, or given a smaller share of the tolerance:
they guard, they verify nothing.
"""

from __future__ import annotations

import pytest
from test_solvers import chain

import crescentlab as cl
from crescentlab.solvers.elimination import elimination
from crescentlab.solvers.functions import Functions

COUNTS = {
    ("rodas", 1e-3): {"steps": 760, "evaluations": 4600, "factorisations": 840, "rejected": 20},
    ("dopri", 1e-4): {"steps": 1600, "evaluations": 12300, "factorisations": 0, "rejected": 280},
    ("rk45", 1e-4): {"steps": 1530, "evaluations": 11700, "factorisations": 0},
    ("lsoda", 1e-4): {"steps": 5400, "evaluations": 11800},
}  # fmt: skip


@pytest.fixture(scope="module")
def pump():
    """Assembled once."""
    return cl.load("crescent_pump")


@pytest.mark.parametrize(("solver", "rtol"), COUNTS)
def test_a_revolution_at_2000_rpm(pump, solver, rtol):
    """13 pitches, each with meshing, two chains that close and a trapped volume that comes and goes; ticks of the line.

    The start and 57 events, 436 ticks (30 ms over 0.9 dx/a at 10 bar); no tick restarts a method.
    """
    statistics = pump.simulate(stop="30 ms", solver=solver, rtol=rtol).trajectory.statistics
    assert (statistics.events, statistics.ticks) == (57, 436)
    assert statistics.restarts <= statistics.events + 20  # a stop of the relief valve may restart twice
    for name, most in COUNTS[solver, rtol].items():
        assert getattr(statistics, name) <= 1.1 * most, name


def test_a_line_of_many_volumes_brings_no_dense_matrix():
    """Four entries a state in the factors of 400 volumes in a row, so that ten times as many cost ten times as much."""
    run, _ = chain(400)
    system = run.system()
    functions = Functions(system, system.values(run.design()))
    assert functions.pattern.nnz <= 3 * 400
    assert elimination(functions.pattern).column.size <= 4 * 400
