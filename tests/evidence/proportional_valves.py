"""Valves that a signal sets, and valves that share a flow out."""

from __future__ import annotations

from typing import Any

from crescentlab.components.fluids import SimpleOil
from crescentlab.components.proportional_valves import FlowDivider, PriorityValve
from scipy.optimize import brentq

from evidence import Number, evidence
from evidence.pressure_valves import BAR, LPM, RHO, SOFT, rest, through

THIN = SimpleOil(density=RHO, kinematic_viscosity=1e-9, bulk_modulus=1e15)
"""So thin that every edge is turbulent."""


@evidence(
    "proportional_relief_valve",
    source="balance at rest: q = Cd A (dp - p_c)/p_r sqrt(2 dp/rho), solved for dp; p_c is the signal",
    tolerance=1e-5,
    because="tanh(2 lambda/lambda_c) is 1 to 1e-6 here; tolerance of the run",
)
def signal_sets_it() -> list[Number]:
    """Pressure that 20 mm^2, range 20 bar, regulates at 30 L/min, set to 40, 150 and -10 bar: the last counts as 0."""
    found = []
    for setting in (40, 150, -10):
        run = rest(
            {
                "pump": {"type": "flow_source", "flow": "30 L/min"}, "tank": {"type": "tank"},
                "line": {**SOFT, "start": {"p": f"{max(setting, 10)} bar"}},
                "set": {"type": "constant", "value": f"{setting} bar"},
                "valve": {"type": "proportional_relief_valve", "area": "20 mm^2", "opening_range": "20 bar"},
            },
            {
                "p": ["pump.port", "line.port", "valve.a"], "t": ["valve.b", "tank.port"],
                "u": ["set.y", "valve.setting"],
            },
            "1 s",
        )  # fmt: skip
        opens = max(setting, 0) * BAR
        expected = brentq(
            lambda p, o=opens: through(20e-6 * (p - o) / (20 * BAR), p) - 30 * LPM, opens, opens + 20 * BAR, xtol=1e-3
        )
        found.append(Number(f"set to {setting} bar", expected, float(run["line.p"][-1]), "bar"))
    return found


def divided(share: float, e: float, p_r: float, flow: float, loads: tuple[float, float]) -> tuple[float, float]:
    """Flow to a [m^3/s] and stroke [-] of a divider of 15 mm^2 at rest, the edges in series written out.

    Drops over the metering edges differ by x p_r and let the whole flow through; both ways from the inlet's pressure,
    d (1 + 1/n^2) + load, agree.
    """
    area_a, area_b = 15e-6 * share, 15e-6 * (1 - share)

    def drops(x: float) -> tuple[float, float]:
        low = max(0.0, x * p_r)
        d_a = brentq(
            lambda d: through(area_a, d) + through(area_b, max(d - x * p_r, 0.0)) - flow,
            low,
            1e9,
            xtol=1e-7,
            rtol=1e-14,
        )
        return d_a, max(d_a - x * p_r, 0.0)

    def gap(x: float) -> float:
        d_a, d_b = drops(x)
        n_a, n_b = e * (1 - x), e * (1 + x)
        return d_a * (1 + n_a**-2) + loads[0] - d_b * (1 + n_b**-2) - loads[1]

    x = brentq(gap, -1 + 1e-6, 1 - 1e-6, xtol=1e-13)
    return through(area_a, drops(x)[0]), x


@evidence(
    "flow_divider",
    source="two pairs of edges in series from one inlet: d_a - d_b = x p_r, d_k (1 + 1/n_k^2) + p_k the same for both, "
    "flows Cd A_k sqrt(2 d_k/rho) that add up to the pump's; solved for x",
    tolerance=1e-5,
    because="tanh(2 lambda/lambda_c) is 1 to 1e-6 here; tolerance of the run",
)
def shared_out() -> list[Number]:
    """Flow to a of 40 L/min by 15 mm^2, spring range 0.5 bar, outlets at 0, 100, 200 bar, shares of 50 and 30 %."""
    found = []
    for share, load_a, load_b in ((0.5, 50, 50), (0.5, 0, 100), (0.5, 200, 0), (0.3, 50, 50), (0.3, 100, 0)):
        run = rest(divider(share, load_a, load_b), DIVIDED, "1 s")
        expected, x = divided(share, 2.0, 0.5 * BAR, 40 * LPM, (load_a * BAR, load_b * BAR))
        name = f"share {share:g}, loads {load_a} and {load_b} bar"
        found.append(Number(f"{name}: to a", expected, -float(run["valve.a.q"][-1]), "L/min"))
        found.append(Number(f"{name}: stroke", x, float(run["valve.stroke"][-1]), size=1.0))
    return found


def divider(share: float, load_a: float, load_b: float, **settings: str) -> dict[str, Any]:
    """A pump of 40 L/min, a divider, and two loads [bar]."""
    return {
        "pump": {"type": "flow_source", "flow": "40 L/min"},
        "line": {**SOFT, "start": {"p": f"{max(load_a, load_b) + 10} bar"}},
        "valve": {"type": "flow_divider", "area": "15 mm^2", "share": str(share), "centring_range": "0.5 bar",
                  **settings},
        "first": {"type": "pressure_source", "pressure": f"{load_a} bar"},
        "second": {"type": "pressure_source", "pressure": f"{load_b} bar"},
    }  # fmt: skip


DIVIDED = {
    "p": ["pump.port", "line.port", "valve.inlet"],
    "a": ["valve.a", "first.port"],
    "b": ["valve.b", "second.port"],
}


@evidence(
    "flow_divider",
    source="Merritt (1967), chapter 3: edges A and n A in series pass Cd A sqrt(2 dp/rho/(1 + 1/n^2))",
    tolerance=1e-6,
    because="tanh(2 lambda/lambda_c) is 1 at this viscosity; the oil is compressed by 4e-8",
)
def edges_in_series() -> list[Number]:
    """Flow to a at strokes of 0, 0.5, -1 and 1 from 100 to 20 bar: 10 mm^2, n = 2 (1 - x); and its metered drop."""
    valve, found = FlowDivider(area=20e-6, centring_range=1 * BAR), []
    for x, n in ((0.0, 2.0), (0.5, 1.0), (-1.0, 4.0), (1.0, 0.0)):
        got = valve.equations(p_inlet=100 * BAR, p_a=20 * BAR, p_b=0.0, stroke=x, at=0.0, fluid=THIN)
        share = n * n / (1 + n * n)
        found.append(Number(f"stroke {x:g}: flow", through(10e-6, share * 80 * BAR), -got["q_a"], "L/min", size=1e-3))
        found.append(Number(f"stroke {x:g}: metered drop", share * 80 * BAR, got["drop_a"], "bar", size=1e5))
    return found


@evidence(
    "priority_valve",
    source="flows add up to the pump's: Cd (1 - s) A sqrt(2 (p - p_CF)/rho) that of the orifice A_2 at a drop of "
    "p_CF - p_LS = p_c + s p_r, Cd s A sqrt(2 (p - p_EF)/rho) the rest; solved for s",
    tolerance=1e-5,
    because="tanh(2 lambda/lambda_c) is 1 to 1e-6 here; tolerance of the run",
)
def priority() -> list[Number]:
    """60 L/min, 50 mm^2, 7 and 2 bar, 10 mm^2 to the load, loads of priority and surplus 0 and 100 bar either way."""
    found = []
    for load, surplus in ((100, 0), (0, 100), (50, 50)):
        run = rest(
            {
                "pump": {"type": "flow_source", "flow": "60 L/min"},
                "line": {**SOFT, "start": {"p": f"{max(load, surplus) + 10} bar"}},
                "valve": {"type": "priority_valve", "area": "50 mm^2", "control_pressure": "7 bar",
                          "control_range": "2 bar"},
                "outlet": {**SOFT, "diameter": "10 mm", "start": {"p": f"{load + 7} bar"}},
                "edge": {"type": "orifice", "area": "10 mm^2"},
                "steering": {"type": "pressure_source", "pressure": f"{load} bar"},
                "others": {"type": "pressure_source", "pressure": f"{surplus} bar"},
            },
            {
                "p": ["pump.port", "line.port", "valve.inlet"], "c": ["valve.priority", "outlet.port", "edge.a"],
                "l": ["edge.b", "steering.port", "valve.load"], "e": ["valve.surplus", "others.port"],
            },
            "1 s",
        )  # fmt: skip

        def missing(s: float, load: float = load * BAR, surplus: float = surplus * BAR) -> float:
            d = (7 + 2 * s) * BAR
            inlet = load + d + d * (10 / (50 * (1 - s))) ** 2
            left = 60 * LPM - through(10e-6, d)
            return inlet - surplus - RHO / 2 * (left / (0.7 * 50e-6 * s)) ** 2

        s = brentq(missing, 1e-3, 1 - 1e-9, xtol=1e-14)
        name = f"load {load} bar, surplus {surplus} bar"
        flow = through(10e-6, (7 + 2 * s) * BAR)
        found.append(Number(f"{name}: priority", flow, float(run["edge.q"][-1]), "L/min"))
        found.append(Number(f"{name}: lift", s, float(run["valve.lift"][-1])))
    return found


@evidence(
    "priority_valve",
    source="balance of forces: s_0 = (p_CF - p_LS - p_c)/p_r, beyond 0 and 1 the force on a stop",
    tolerance=1e-9,
    because="rounding",
)
def spool() -> list[Number]:
    """Where 6, 8, 9 and 20 bar between priority outlet and load lead the spool, set to 7 bar and 2 bar further."""
    valve = PriorityValve(area=50e-6, control_pressure=7 * BAR, control_range=2 * BAR, time_constant=1.0)
    at = {"p_inlet": 150 * BAR, "p_surplus": 3 * BAR, "p_load": 60 * BAR, "lift": 0.0, "at": 0.0, "fluid": THIN}
    return [
        Number(f"{drop} bar", share, float(valve.equations(p_priority=(60 + drop) * BAR, **at)["der_lift"]))
        for drop, share in ((6, -0.5), (8, 0.5), (9, 1.0), (20, 6.5))
    ]
