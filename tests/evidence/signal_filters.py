"""Signals with memory in continuous time."""

from __future__ import annotations

import math

import numpy as np
from building import circuit
from reading import rows
from scipy.signal import TransferFunction as Known
from scipy.signal import lsim

from evidence import Number, evidence

RUN = {"stop": "2 s", "rtol": "1e-9", "output_step": "10 ms"}
SOLVER = "relative tolerance 1e-9 of each of some hundred steps"


@evidence(
    "first_order_lag",
    "integrator",
    source="y = 1 - exp(-t/T) after a step, y = 10 mm t^2/2 of a ramp; K. Ogata (2010), section 5-2",
    tolerance=1e-6,
    because=SOLVER,
)
def first_order() -> list[Number]:
    """A lag of 0.5 s after a step of 1 bar to 4 bar; an integral of 10 mm per bar and second over a ramp of 1 bar/s."""
    result = circuit(
        components={
            "step": {"type": "step", "after": "1 bar"},
            "lag": {"type": "first_order_lag", "gain": "4 bar", "per": "1 bar", "time_constant": "0.5 s"},
            "ramp": {"type": "ramp", "after": "2 bar", "duration": "2 s"},
            "integrator": {"type": "integrator", "rate": "10 mm", "per": "1 bar"},
        },
        nets={"u": ["step.y", "lag.u"], "y": ["lag.y"], "r": ["ramp.y", "integrator.u"], "x": ["integrator.y"]},
        simulation=RUN,
    ).simulate()
    t = np.array([0.25, 0.5, 1.0, 2.0])
    found = [
        Number(f"lag after {1e3 * s:g} ms", 4e5 * (1 - math.exp(-s / 0.5)), float(y), "bar")
        for s, y in zip(t, rows(result, "lag.y", t), strict=True)
    ]
    return [*found, Number("integral after 2 s", 0.02, float(result["integrator.y"][-1]), "mm")]


@evidence(
    "second_order_lag",
    source="overshoot exp(-pi zeta/sqrt(1 - zeta^2)) at pi/(omega sqrt(1 - zeta^2)); K. Ogata (2010), section 5-3",
    tolerance=1e-6,
    because=SOLVER,
)
def overshoot() -> list[Number]:
    """1 Hz after a step of 1: the first peak with damping ratios 0.2 and 0.5."""
    found = []
    for zeta in (0.2, 0.5):
        peak = 0.5 / math.sqrt(1 - zeta**2)
        lag = {"type": "second_order_lag", "natural_frequency": "1 Hz", "damping_ratio": str(zeta)}
        result = circuit(
            components={"step": {"type": "step", "after": "1"}, "lag": lag},
            nets={"u": ["step.y", "lag.u"], "y": ["lag.y"]},
            simulation={**RUN, "stop": f"{peak!r} s"},
        ).simulate()
        expected = math.exp(-math.pi * zeta / math.sqrt(1 - zeta**2))
        found.append(Number(f"overshoot, {zeta}", expected, float(result["lag.y"][-1]) - 1))
        found.append(Number(f"rate at the peak, {zeta}", 0.0, float(result["lag.rate"][-1]), size=1.0))
    return found


@evidence(
    "transfer_function",
    source="scipy.signal.lsim of the same coefficients over a ramp that stops",
    tolerance=1e-6,
    because=SOLVER,
)
def any_order() -> list[Number]:
    """(2 s^2 + s + 3)/(s^3 + 2 s^2 + 5 s + 4), and with s counted in 1/ms; (s + 2)/(s^2 + s), which integrates."""
    found = []
    cases = (
        ("third order", [2, 1, 3], [1, 2, 5, 4], 1.0),
        ("in 1/ms", [2, 1, 3], [1, 2, 5, 4], 1e-3),
        ("integrating", [1, 2], [1, 1, 0], 1.0),
        ("without states", [3], [2], 1.0),
    )
    for name, numerator, denominator, unit in cases:
        part = {
            "type": "transfer_function", "numerator": [str(b) for b in numerator],
            "denominator": [str(a) for a in denominator], "time_unit": f"{unit} s",
        }  # fmt: skip
        ramp = {"type": "ramp", "after": "1", "duration": f"{unit} s"}
        simulation = {"stop": f"{4 * unit} s", "rtol": "1e-9", "output_step": f"{unit / 10} s"}
        nets = {"u": ["ramp.y", "part.u"], "y": ["part.y"]}
        result = circuit(components={"ramp": ramp, "part": part}, nets=nets, simulation=simulation).simulate()
        s = np.linspace(0, 4, 401)  # lsim is exact for a piecewise linear input
        _, y, _ = lsim(Known(numerator, denominator), np.minimum(s, 1.0), s)
        for at in (1.0, 4.0):
            computed = float(rows(result, "part.y", [at * unit])[0])
            found.append(Number(f"{name}, {at:g}", float(np.atleast_1d(y)[round(100 * at)]), computed))
    return found
