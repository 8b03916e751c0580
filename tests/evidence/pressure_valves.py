"""Pressure valves."""

from __future__ import annotations

import math
from typing import Any

from building import OIL, circuit, fired
from crescentlab.components.fluids import SimpleOil
from crescentlab.components.pressure_valves import (
    CounterbalanceValve,
    ReliefValve,
    SecondOrderReliefValve,
    SequenceValve,
)
from scipy.optimize import brentq

from crescentlab.result import Result
from evidence import Number, evidence

BAR, LPM, RHO = 1e5, 1e-3 / 60, 860.0
HARD = {**OIL, "bulk_modulus": "1e9 bar"}
SOFT = {"type": "elastic_capacity", "diameter": "80 mm", "length": "1 m", "wall_thickness": "0.4 mm"}
"""5 L that give way as oil of 12 000 bar would, so that the fluid itself may be rigid."""
STIFF = SimpleOil(density=RHO, kinematic_viscosity=35e-6, bulk_modulus=1e15)


def rest(parts: dict[str, Any], nets: dict[str, list[str]], stop: str = "200 ms") -> Result:
    """A run long enough for the lags of 5 ms to be over."""
    return circuit(components=parts, nets=nets, fluid=HARD, simulation={"stop": stop}).simulate(rtol=1e-8)


def through(area: float, drop: float) -> float:
    """Cd A sqrt(2 dp/rho) [m^3/s] with Cd 0.7."""
    return 0.7 * area * math.sqrt(2 * drop / RHO)


@evidence(
    "relief_valve",
    "second_order_relief_valve",
    source="balance at rest: q = Cd A (dp - p_c)/p_r sqrt(2 dp/rho), solved for dp",
    tolerance=1e-5,
    because="tanh(2 lambda/lambda_c) is 1 to 1e-6 here; tolerance of the run",
)
def relief() -> list[Number]:
    """Pressure that 20 mm^2, cracking at 100 bar, fully open 20 bar above, regulates at 10 and 40 L/min."""
    found = []
    settings = {"area": "20 mm^2", "cracking_pressure": "100 bar", "opening_range": "20 bar"}
    for valve in (
        {"type": "relief_valve", **settings},
        {"type": "second_order_relief_valve", **settings, "natural_frequency": "100 Hz"},
    ):
        for flow in (10, 40):
            run = rest(
                {
                    "pump": {"type": "flow_source", "flow": f"{flow} L/min"}, "tank": {"type": "tank"},
                    "line": {**SOFT, "start": {"p": "100 bar"}}, "valve": valve,
                },
                {"p": ["pump.port", "line.port", "valve.a"], "t": ["valve.b", "tank.port"]},
                "1 s",
            )  # fmt: skip
            expected = brentq(
                lambda p, q=flow: through(20e-6 * (p / BAR - 100) / 20, p) - q * LPM, 100 * BAR, 120 * BAR, xtol=1e-3
            )
            found.append(Number(f"{valve['type']}, {flow} L/min", expected, float(run["line.p"][-1]), "bar"))
    return found


@evidence(
    "relief_valve",
    "second_order_relief_valve",
    source="first-order lag, (s_0 - s)/T; second-order, omega^2 (s_0 - s) - 2 zeta omega ds/dt",
    tolerance=1e-9,
    because="rounding",
)
def motion() -> list[Number]:
    """Rates at 105 bar (s_0 = 0.25) and s = 0.1: T = 4 ms; 50 Hz, zeta 0.5, moving at 20/s."""
    settings = {"area": 20e-6, "cracking_pressure": 100 * BAR, "opening_range": 20 * BAR}
    at = {"p_a": 105 * BAR, "p_b": 0.0, "fluid": STIFF}
    first = ReliefValve(**settings, time_constant=4e-3).equations(lift=0.1, at=0.0, **at)
    second = SecondOrderReliefValve(**settings, natural_frequency=50.0, damping_ratio=0.5).equations(
        position=0.1, rate=20.0, at=0.0, **at
    )
    omega = 100 * math.pi
    return [
        Number("relief_valve", 0.15 / 4e-3, first["der_lift"]),
        Number("second_order_relief_valve", omega**2 * 0.15 - omega * 20, second["der_rate"]),
    ]


@evidence(
    "second_order_relief_valve",
    source="s = s_t + (s_0 - s_t) e^(-zeta w t) (cos w_d t + zeta w/w_d sin w_d t), a force beyond the stops included",
    tolerance=1e-6,
    because="relative tolerance of the run, 1e-9; the seat is found to 1e-9 of the span",
)
def closing() -> list[Number]:
    """Half open at 110 bar (100 + 20 bar, 50 Hz, zeta 0.7), the inlet falls to 0 bar at 100 ms: time to the seat."""
    parts = {
        "step": {"type": "step", "before": "110 bar", "after": "0 bar", "at": "100 ms"},
        "inlet": {"type": "signal_pressure_source"}, "tank": {"type": "tank"},
        "valve": {"type": "second_order_relief_valve", "area": "20 mm^2", "cracking_pressure": "100 bar",
                  "opening_range": "20 bar", "natural_frequency": "50 Hz", "start": {"position": "0.5"}},
    }  # fmt: skip
    nets = {"u": ["step.y", "inlet.pressure"], "p": ["inlet.port", "valve.a"], "t": ["valve.b", "tank.port"]}
    run = circuit(components=parts, nets=nets, fluid=OIL, simulation={"stop": "110 ms"}).simulate(rtol=1e-9)
    zeta, w, target = 0.7, 100 * math.pi, -100 / 20
    w_d = w * math.sqrt(1 - zeta**2)

    def lift(t: float) -> float:
        return target + (0.5 - target) * math.exp(-zeta * w * t) * (
            math.cos(w_d * t) + zeta * w / w_d * math.sin(w_d * t)
        )

    return [Number("time to the seat", brentq(lift, 0, 5e-3, xtol=1e-15), fired(run, "valve.hits_low")[0] - 0.1, "ms")]


@evidence(
    "relief_valve",
    source="T ds/dt = s_0 - s up to the seat, s_0 = (dp - p_c)/p_r whatever it is: t = T ln((s - s_0)/(-s_0))",
    tolerance=1e-6,
    because="relative tolerance of the run, 1e-9; the seat is found to 1e-9 of the span",
)
def seated() -> list[Number]:
    """Half open at 110 bar (100 + 20 bar, T = 5 ms), the inlet falls to 0, 50 and 99 bar: time to the seat."""
    found = []
    for left in (0, 50, 99):
        parts = {
            "inlet": {"type": "pressure_source", "pressure": f"{left} bar"}, "tank": {"type": "tank"},
            "valve": {"type": "relief_valve", "area": "20 mm^2", "cracking_pressure": "100 bar",
                      "opening_range": "20 bar", "start": {"lift": "0.5"}},
        }  # fmt: skip
        nets = {"p": ["inlet.port", "valve.a"], "t": ["valve.b", "tank.port"]}
        run = circuit(components=parts, nets=nets, fluid=OIL, simulation={"stop": "20 ms"}).simulate(rtol=1e-9)
        target = (left - 100) / 20
        expected = 5e-3 * math.log((0.5 - target) / -target)
        found.append(Number(f"to {left} bar", expected, fired(run, "valve.hits_low")[0], "ms"))
    return found


@evidence(
    "reducing_valve",
    "reducing_relieving_valve",
    source="two orifices in series, the first open by (p_c - p)/p_r: A_1^2 s^2 (p_s - p) = A_2^2 p, solved for p",
    tolerance=1e-5,
    because="tanh(2 lambda/lambda_c) is 1 to 1e-6 here; tolerance of the run",
)
def reduced() -> list[Number]:
    """Reduced pressure set to 50 bar (range 10 bar, 20 mm^2), 200 bar before, orifices of 1 and 5 mm^2 behind."""
    found = []
    for kind, inlet, outlet, tank in (
        ("reducing_valve", "a", "b", "drain"), ("reducing_relieving_valve", "supply", "outlet", "tank"),
    ):  # fmt: skip
        for area in (1, 5):
            valve = {"type": kind, "area": "20 mm^2", "set_pressure": "50 bar", "closing_range": "10 bar"}
            run = rest(
                {
                    "supply": {"type": "pressure_source", "pressure": "200 bar"}, "tank": {"type": "tank"},
                    "line": SOFT,
                    "valve": valve, "user": {"type": "orifice", "area": f"{area} mm^2"},
                },
                {
                    "s": ["supply.port", f"valve.{inlet}"], "p": [f"valve.{outlet}", "line.port", "user.a"],
                    "t": ["user.b", "tank.port", f"valve.{tank}"],
                },
                "1 s",
            )  # fmt: skip
            expected = brentq(
                lambda p, a=area: 20 * (50 - p) / 10 * math.sqrt(200 - p) - a * math.sqrt(p), 40, 50, xtol=1e-9
            )
            found.append(Number(f"{kind}, {area} mm^2", expected * BAR, float(run["line.p"][-1]), "bar"))
    return found


@evidence(
    "reducing_relieving_valve",
    source="orifice open by (p - p_c - p_u)/p_r: q = Cd A s sqrt(2 p/rho), solved for p",
    tolerance=1e-5,
    because="tanh(2 lambda/lambda_c) is 1 to 1e-6 here; tolerance of the run",
)
def relieving() -> list[Number]:
    """Outlet set to 50 bar (range 10 bar, dead band 3 bar, 20 mm^2) into which 20 L/min are driven."""
    run = rest(
        {
            "supply": {"type": "pressure_source", "pressure": "200 bar"}, "tank": {"type": "tank"},
            "line": SOFT,
            "valve": {"type": "reducing_relieving_valve", "area": "20 mm^2", "set_pressure": "50 bar",
                      "closing_range": "10 bar", "dead_band": "3 bar"},
            "back": {"type": "flow_source", "flow": "20 L/min"},
        },
        {
            "s": ["supply.port", "valve.supply"], "p": ["valve.outlet", "line.port", "back.port"],
            "t": ["tank.port", "valve.tank"],
        },
        "1 s",
    )  # fmt: skip
    expected = brentq(lambda p: through(20e-6 * (p / BAR - 53) / 10, p) - 20 * LPM, 53 * BAR, 63 * BAR, xtol=1e-3)
    return [Number("outlet", expected, float(run["line.p"][-1]), "bar")]


@evidence(
    "sequence_valve",
    source="balance at rest with the spring drained: q = Cd A (p_a - p_d - p_c)/p_r sqrt(2 (p_a - p_b)/rho), for p_a",
    tolerance=1e-5,
    because="tanh(2 lambda/lambda_c) is 1 to 1e-6 here; tolerance of the run",
)
def in_sequence() -> list[Number]:
    """Inlet pressure at 20 L/min, 20 mm^2, set to 100 bar (range 20 bar), outlet at 0 to 90 bar, drain at 0, 5 bar."""
    found = []
    for outlet, drained in ((0, 0), (60, 0), (90, 0), (60, 5)):
        run = rest(
            {
                "pump": {"type": "flow_source", "flow": "20 L/min"}, "line": {**SOFT, "start": {"p": "105 bar"}},
                "valve": {"type": "sequence_valve", "area": "20 mm^2", "set_pressure": "100 bar",
                          "opening_range": "20 bar"},
                "next": {"type": "pressure_source", "pressure": f"{outlet} bar"},
                "drain": {"type": "pressure_source", "pressure": f"{drained} bar"},
            },
            {
                "p": ["pump.port", "line.port", "valve.a", "valve.pilot"], "n": ["valve.b", "next.port"],
                "d": ["drain.port", "valve.drain"],
            },
            "1 s",
        )  # fmt: skip
        opens = (100 + drained) * BAR
        expected = brentq(
            lambda p, o=opens, b=outlet * BAR: through(20e-6 * (p - o) / (20 * BAR), p - b) - 20 * LPM,
            opens, opens + 20 * BAR, xtol=1e-3,
        )  # fmt: skip
        name = f"outlet {outlet} bar, drain {drained} bar"
        found.append(Number(name, expected, float(run["line.p"][-1]), "bar"))
    return found


@evidence(
    "sequence_valve",
    source="balance of forces: it begins to open at p_x = p_c + p_d, whatever inlet and outlet",
    tolerance=1e-6,
    because="root of the equations, located to 1e-9",
)
def piloted() -> list[Number]:
    """Pilot pressure at which a valve set to 70 bar begins to open, drained at 0 and 3 bar, any inlet and outlet."""
    valve = SequenceValve(area=20e-6, set_pressure=70 * BAR, opening_range=20 * BAR)
    found = []
    for inlet, outlet, drained in ((0, 0, 0), (200, 0, 0), (200, 150, 0), (200, 150, 3)):

        def rate(pilot: float, at: tuple[int, ...] = (inlet, outlet, drained)) -> float:
            p_a, p_b, p_drain = (p * BAR for p in at)
            got = valve.equations(p_a=p_a, p_b=p_b, p_pilot=pilot, p_drain=p_drain, lift=0.0, at=0.0, fluid=STIFF)
            return float(got["der_lift"])

        opens = brentq(rate, 0.0, 90 * BAR, rtol=1e-9)
        name = f"inlet {inlet} bar, outlet {outlet} bar, drain {drained} bar"
        found.append(Number(name, (70 + drained) * BAR, opens, "bar"))
    return found


@evidence(
    "counterbalance_valve",
    source="balance of forces: p_a + R p_x = p_c + (1 + R) p_b, without the last term where it is vented",
    tolerance=1e-6,
    because="root of the equations, located to 1e-9",
)
def counterbalance() -> list[Number]:
    """Pilot pressure at which a load of 47 bar begins to go down: set to 70 bar, ratio 3, against 0 and 5 bar."""
    found = []
    for vented, back in ((False, 0.0), (False, 5.0), (True, 5.0)):
        valve = CounterbalanceValve(
            area=20e-6, set_pressure=70 * BAR, opening_range=30 * BAR, pilot_ratio=3.0, vented=vented
        )

        def rate(pilot: float, valve: CounterbalanceValve = valve, back: float = back) -> float:
            at = {"p_a": 47 * BAR, "p_b": back * BAR, "lift": 0.0, "at": 0.0, "fluid": STIFF}
            return float(valve.equations(p_pilot=pilot, **at)["der_lift"])

        expected = (70 - 47 + (0.0 if vented else 4 * back)) / 3
        name = f"{'vented' if vented else 'not vented'}, {back:g} bar behind"
        found.append(Number(name, expected * BAR, brentq(rate, 0.0, 30 * BAR, rtol=1e-9), "bar"))
    return found


@evidence(
    "pressure_compensator",
    source="two orifices in series, the first open by (p_c + p_r - d)/p_r: A_1^2 s^2 (p_s - p_l - d) = A_2^2 d, solved "
    "for the drop d over the metering edge; beyond the spring's range d = (p_s - p_l) A_1^2/(A_1^2 + A_2^2)",
    tolerance=1e-5,
    because="tanh(2 lambda/lambda_c) is 1 to 1e-6 here; tolerance of the run",
)
def compensated() -> list[Number]:
    """Flow from 200 bar to loads of 0, 100, 195 bar: 10.4 mm^2 behind a compensator of 37.7 mm^2, 8 and 2 bar."""
    found = []
    for load in (0, 100, 195):
        run = rest(
            {
                "supply": {"type": "pressure_source", "pressure": "200 bar"},
                "load": {"type": "pressure_source", "pressure": f"{load} bar"},
                "line": {**SOFT, "diameter": "2 mm", "start": {"p": f"{load + 5} bar"}},
                "valve": {"type": "pressure_compensator", "area": "37.7 mm^2", "control_pressure": "8 bar",
                          "closing_range": "2 bar", "start": {"lift": "0.1"}},
                "edge": {"type": "orifice", "area": "10.4 mm^2"},
            },
            {
                "s": ["supply.port", "valve.a"], "m": ["valve.b", "line.port", "edge.a"],
                "l": ["edge.b", "load.port", "valve.load"],
            },
        )  # fmt: skip
        drop = (200 - load) * 37.7**2 / (37.7**2 + 10.4**2)
        if drop > 8:
            drop = brentq(
                lambda d, p=load: 37.7 * (10 - d) / 2 * math.sqrt(200 - p - d) - 10.4 * math.sqrt(d), 8, 10, xtol=1e-9
            )
        found.append(Number(f"load {load} bar", through(10.4e-6, drop * BAR), float(run["edge.q"][-1]), "L/min"))
    return found


@evidence(
    "bypass_compensator",
    source="flows add up to the pump's, the bypass open by (d - p_c)/p_r: A_2 sqrt(d) + A_1 s sqrt(p_l + d) = "
    "q/(Cd sqrt(2/rho)), solved for the drop d over the metering edge",
    tolerance=1e-5,
    because="tanh(2 lambda/lambda_c) is 1 to 1e-6 here; tolerance of the run",
)
def bypassed() -> list[Number]:
    """A pump of 40 L/min, 10.4 mm^2 to loads of 0, 100, 200 bar, a bypass of 37.7 mm^2 set to 8 and 2 bar."""
    found = []
    for load in (0, 100, 200):
        run = rest(
            {
                "pump": {"type": "flow_source", "flow": "40 L/min"}, "tank": {"type": "tank"},
                "load": {"type": "pressure_source", "pressure": f"{load} bar"},
                "line": {**SOFT, "start": {"p": f"{load + 8} bar"}},
                "valve": {"type": "bypass_compensator", "area": "37.7 mm^2", "control_pressure": "8 bar",
                          "opening_range": "2 bar"},
                "edge": {"type": "orifice", "area": "10.4 mm^2"},
            },
            {
                "p": ["pump.port", "line.port", "valve.a", "edge.a"], "l": ["edge.b", "load.port", "valve.load"],
                "t": ["valve.b", "tank.port"],
            },
            "1 s",
        )  # fmt: skip
        drop = brentq(
            lambda d, p=load * BAR: through(10.4e-6, d)
            + through(37.7e-6 * (d - 8 * BAR) / (2 * BAR), p + d)
            - 40 * LPM,
            8 * BAR, 10 * BAR, xtol=1e-3,
        )  # fmt: skip
        found.append(Number(f"load {load} bar: flow to it", through(10.4e-6, drop), float(run["edge.q"][-1]), "L/min"))
        found.append(Number(f"load {load} bar: pump", load * BAR + drop, float(run["line.p"][-1]), "bar"))
    return found
