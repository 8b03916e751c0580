"""The assembled pump against its own equations written by hand, flat, in C (benchmarks/limit): nothing is shared but
the circuit's numbers."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

import crescentlab as cl
from crescentlab import compiler

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
limit = pytest.importorskip("limit")

pytestmark = pytest.mark.skipif(not compiler.command(), reason="needs a C compiler")


@pytest.mark.parametrize(("speed", "area"), [("2000 rpm", "24.6 mm^2"), ("4000 rpm", "0 mm^2")])
@pytest.mark.parametrize("method", ["rodas", "dopri"])
def test_one_revolution_by_hand(method, speed, area):
    """Delivery pressure of both over one revolution, all events included: 1e-6 of its mean where both keep 1e-7."""
    settings = {"speed": speed, "throttle_area": area}
    by_hand = limit.run(1, 1e-7, method, **settings)
    stop = 60 / float(speed.split()[0])
    result = cl.load("crescent_pump").simulate(
        stop=stop, solver=method, rtol=1e-7, output_step=limit.driver.GRID, parameters=settings
    )
    n = min(by_hand.delivery.size, result.time.size)
    assert n > stop / limit.driver.GRID - 2
    difference = np.max(np.abs(result["delivery.p"][:n] - by_hand.delivery[:n]))
    assert difference < 1e-6 * np.mean(by_hand.delivery)
