"""Shuttle valves, and the check valves that a pilot opens or that have no resistance."""

from __future__ import annotations

import math

from building import OIL, circuit, fired
from crescentlab.components.check_valves import IdealCheckValve, PilotOperatedCheckValve
from crescentlab.components.fluids import SimpleOil
from crescentlab.components.shuttle_valves import ShuttleValve

from evidence import Number, evidence

BAR, RHO = 1e5, 860.0
STIFF = SimpleOil(density=RHO, kinematic_viscosity=35e-6, bulk_modulus=1e15)


@evidence(
    "shuttle_valve",
    source="Torricelli's law with Cd 0.7, from the inlet on whose side the ball is not",
    tolerance=1e-6,
    because="tanh(2 lambda/lambda_c) is 1 to 1e-7 here",
)
def passes() -> list[Number]:
    """10 mm^2, 30 bar at a, 80 bar at b, 20 bar at the outlet, the ball on either seat."""
    valve, at = ShuttleValve(area=10e-6), {"p_a": 30 * BAR, "p_b": 80 * BAR, "p_outlet": 20 * BAR, "fluid": STIFF}
    found = []
    for side, drop in ((1.0, 10.0), (-1.0, 60.0)):
        got = valve.equations(at=side, **at)
        expected = 0.7 * 10e-6 * math.sqrt(2 * drop * BAR / RHO)
        found.append(Number(f"from {'a' if side > 0 else 'b'}", expected, got["q"], "L/min"))
        found.append(Number("from the other", 0.0, got["q_b"] if side > 0 else got["q_a"], "L/min"))
    return found


@evidence(
    "shuttle_valve",
    source="the ball moves where p_b = p_a + p_w",
    tolerance=1e-8,
    because="events are located to 1e-9 of the span",
)
def switches() -> list[Number]:
    """40 bar at a; b rises from 0 to 100 bar in 1 s, and p_w = 0.5 bar: the instant at which the ball moves."""
    parts = {
        "one": {"type": "pressure_source", "pressure": "40 bar"},
        "rise": {"type": "ramp", "after": "100 bar", "output_quantity": "pressure", "duration": "1 s"},
        "two": {"type": "signal_pressure_source"},
        "valve": {"type": "shuttle_valve", "area": "10 mm^2", "switching_pressure": "0.5 bar"},
        "user": {"type": "capacity", "volume": "1 L"},
    }
    nets = {
        "u": ["rise.y", "two.pressure"], "a": ["one.port", "valve.a"], "b": ["two.port", "valve.b"],
        "o": ["valve.outlet", "user.port"],
    }  # fmt: skip
    run = circuit(components=parts, nets=nets, fluid=OIL, simulation={"stop": "1 s"}).simulate()
    (instant,) = fired(run, "valve.to_b")
    return [Number("instant", 0.405, instant, "s")]


@evidence(
    "ideal_check_valve",
    source="G dp forwards, nothing backwards; by hand",
    tolerance=1e-9,
    because="rounding",
)
def ideal() -> list[Number]:
    """60 L/min at 0.1 bar, none at -100 bar."""
    valve = IdealCheckValve()
    forwards, backwards = (valve.equations(p_a=p * BAR, p_b=0.0, fluid=STIFF)["q"] for p in (0.1, -100.0))
    return [Number("forwards", 1e-3, forwards, "L/min"), Number("backwards", 0.0, backwards, "L/min")]


@evidence(
    "pilot_operated_check_valve",
    source="balance of forces: opens backwards where p_x = p_a + (p_b - p_a + p_c)/R; Torricelli's law with Cd 0.7",
    tolerance=1e-6,
    because="tanh(2 lambda/lambda_c) is 1 to 1e-7 here",
)
def piloted() -> list[Number]:
    """A load of 90 bar against 6 bar, ratio 3, cracking at 3 bar: opens at p_x = 35 bar; fully open 1 bar above."""
    valve = PilotOperatedCheckValve(area=10e-6, cracking_pressure=3 * BAR, opening_range=3 * BAR)
    at = {"p_a": 6 * BAR, "p_b": 90 * BAR, "fluid": STIFF}
    found = []
    for pilot, lift in ((0.0, 0.0), (35.0, 0.0), (35.5, 0.5), (40.0, 1.0)):
        expected = -0.7 * lift * 10e-6 * math.sqrt(2 * 84 * BAR / RHO)
        got = valve.equations(p_pilot=pilot * BAR, **at)["q"]
        found.append(Number(f"flow at p_x = {pilot:g} bar", expected, got, "L/min", size=1e-6))
    forwards = valve.equations(p_a=20 * BAR, p_b=10 * BAR, p_pilot=20 * BAR, fluid=STIFF)["q"]
    return [*found, Number("forwards at 10 bar", 0.7 * 10e-6 * math.sqrt(2 * 10 * BAR / RHO), forwards, "L/min")]
