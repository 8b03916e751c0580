"""Directional valves and their drive."""

from __future__ import annotations

import math

from building import circuit
from crescentlab.components.directional_valves import FourThreeValve, FourTwoValve, ThreeTwoValve, TwoTwoValve
from crescentlab.components.fluids import SimpleOil
from scipy.optimize import brentq

from evidence import Number, evidence

BAR, LPM = 1e5, 1e-3 / 60
RHO = 860.0
OIL = SimpleOil(density=RHO, kinematic_viscosity=30e-6, bulk_modulus=1e15)
ROUND = 1e-6
"""Rounding of the diameter [m] at 0 area, a part of 2e-7 of its flow number here."""


@evidence(
    "four_three_valve",
    source="Merritt (1967), chapter 5: q = Cd w x sqrt((p_s - sign(x) p_L)/rho) of a critical centre; p_A, p_B = "
    "(p_s +- p_L)/2",
    tolerance=1e-6,
    because="tanh(2 lambda/lambda_c) is 1 to 1e-7 here",
)
def pressure_flow() -> list[Number]:
    """Load flow of 10 mm^2 at a supply of 210 bar, strokes and load pressures of both signs."""
    valve = FourThreeValve(area=10e-6)
    found = []
    for x, load in ((1.0, 0.0), (0.5, 70.0), (0.5, -70.0), (-0.5, 70.0), (-1.0, 140.0)):
        p_a, p_b = (210 + load) / 2 * BAR, (210 - load) / 2 * BAR
        got = valve.equations(p_supply=210 * BAR, p_a=p_a, p_b=p_b, p_tank=0.0, stroke=x, fluid=OIL)
        expected = 0.7 * 10e-6 * x * math.sqrt((210 - math.copysign(1, x) * load) * BAR / RHO)
        found.append(Number(f"stroke {x:g}, load {load:g} bar: out of A", expected, -got["q_a"], "L/min"))
        found.append(Number(f"stroke {x:g}, load {load:g} bar: into B", expected, got["q_b"], "L/min"))
    return found


@evidence(
    "two_two_valve",
    "three_two_valve",
    "four_two_valve",
    "four_three_valve",
    source="linear edge with overlap u: s = (x - u)/(1 - u), and w/4/(1 - u) at x = u for the rounding w",
    tolerance=1e-6,
    because="tanh(2 lambda/lambda_c) is 1 to 1e-7 here",
)
def overlap() -> list[Number]:
    """Open share of an edge with 10 % overlap and 2 % rounding at strokes of 5, 10, 55 and 100 %, by its flow."""
    lapped = {"area": 10e-6, "overlap": 0.1, "edge_rounding": 0.02, "lambda_c": 1.0}
    full = 0.7 * 10e-6 * math.sqrt(2 * 100 * BAR / RHO)
    found = []
    for x, share in ((0.05, 0.0), (0.1, 0.005 / 0.9), (0.55, 0.5), (1.0, 1.0)):
        two = TwoTwoValve(**lapped).equations(p_a=100 * BAR, p_b=0.0, stroke=x, fluid=OIL)["q"]
        three = ThreeTwoValve(**lapped).equations(
            p_supply=100 * BAR, p_work=0.0, p_tank=0.0, stroke=(1 + x) / 2, fluid=OIL
        )["q_in"]
        ports = {"p_supply": 100 * BAR, "p_a": 0.0, "p_b": 0.0, "p_tank": 0.0, "fluid": OIL}
        four_two = FourTwoValve(**lapped).equations(stroke=(1 + x) / 2, **ports)["q_supply_a"]
        four = FourThreeValve(**lapped).equations(stroke=x, **ports)["q_supply_a"]
        for name, q in (
            ("two_two_valve", two), ("three_two_valve", three),
            ("four_two_valve", four_two), ("four_three_valve", four),
        ):  # fmt: skip
            found.append(Number(f"{name} at {x:g}", share, q / full, size=1.0))
    return found


@evidence(
    "two_two_valve",
    "three_two_valve",
    "four_two_valve",
    source="a closed edge passes nothing; s = w/(1 - u) where the rounding of the corner ends, at x = u + w, u = w",
    tolerance=1e-6,
    because="tanh(2 lambda/lambda_c) is 1 to 1e-7 here; closed is 0 to the last digit",
)
def at_the_ends() -> list[Number]:
    """Flows by default laps (w = 0.1 %) where an edge is meant to be shut, 350 bar over it, and 2 w from there."""
    full = 0.7 * 10e-6 * math.sqrt(2 * 350 * BAR / RHO)
    lapped = {"area": 10e-6, "lambda_c": 1.0}
    two, ports = TwoTwoValve(**lapped), {"p_a": 350 * BAR, "p_b": 0.0, "fluid": OIL}
    found = [
        Number("2/2 at 0", 0.0, two.equations(stroke=0.0, **ports)["q"] / full, size=1e-12),
        Number("2/2 at 2 w", 1e-3 / 0.999, two.equations(stroke=2e-3, **ports)["q"] / full),
    ]
    three, low = ThreeTwoValve(**lapped), {"p_supply": 350 * BAR, "p_work": 0.0, "p_tank": 0.0, "fluid": OIL}
    found.append(Number("3/2 at 0: P to A", 0.0, three.equations(stroke=0.0, **low)["q_in"] / full, size=1e-12))
    high = {**low, "p_work": 350 * BAR}
    found.append(Number("3/2 at 1: A to T", 0.0, three.equations(stroke=1.0, **high)["q_out"] / full, size=1e-12))
    four, still = FourTwoValve(**lapped), {"p_a": 0.0, "p_b": 350 * BAR, "p_tank": 0.0, "fluid": OIL}
    for x, shut in ((0.0, ("supply_a", "b_tank")), (1.0, ("a_tank",))):
        got = four.equations(p_supply=350 * BAR, stroke=x, **still)
        for edge in shut:
            name = f"4/2 at {x:g}: {edge.replace('_', ' to ')}"
            found.append(Number(name, 0.0, got[f"q_{edge}"] / full, size=1e-12))
    return found


@evidence(
    "four_two_valve",
    source="each edge q = Cd A sqrt(2 dp/rho): P to B, A to T at stroke 0, P to A, B to T at 1",
    tolerance=1e-6,
    because="tanh(2 lambda/lambda_c) is 1 to 1e-7 here",
)
def two_positions() -> list[Number]:
    """Flows of 10 mm^2 with 200, 120, 80 and 0 bar at P, A, B, T."""
    valve, found = FourTwoValve(area=10e-6), []
    at = {"p_supply": 200 * BAR, "p_a": 120 * BAR, "p_b": 80 * BAR, "p_tank": 0.0, "fluid": OIL}
    for x, drops in ((0.0, {"supply": 120, "a": 120}), (1.0, {"supply": 80, "b": 80})):
        got = valve.equations(stroke=x, **at)
        for port, drop in drops.items():
            expected = 0.7 * 10e-6 * math.sqrt(2 * drop * BAR / RHO)
            found.append(Number(f"stroke {x:g}: into {port}", expected, got[f"q_{port}"], "L/min"))
    return found


CENTRES = {
    "closed": {"overlap": 0.05},
    "open": {"overlap": -0.1},
    "float": {"overlap": 0.05, "tank_overlap": -0.1},
    "tandem": {"overlap": 0.05, "tandem_area": 10e-6},
}
"""Settings of the four usual centres."""


@evidence(
    "four_three_valve",
    source="shares in the middle: u/(1 + u) of the area for an underlap u, all of the tandem area from P to T",
    tolerance=1e-6,
    because="tanh(2 lambda/lambda_c) is 1 to 1e-7 here",
)
def centres() -> list[Number]:
    """Flows of 10 mm^2 in the middle, 200, 120, 80 and 0 bar at P, A, B, T: centres closed, open, float, tandem."""
    drops = {"supply_a": 80, "supply_b": 120, "a_tank": 120, "b_tank": 80, "supply_tank": 200}
    underlapped = 0.1 / 1.1
    shares = {
        "closed": {}, "open": dict.fromkeys(("supply_a", "supply_b", "a_tank", "b_tank"), underlapped),
        "float": dict.fromkeys(("a_tank", "b_tank"), underlapped), "tandem": {"supply_tank": 1.0},
    }  # fmt: skip
    found = []
    for centre, settings in CENTRES.items():
        valve = FourThreeValve(area=10e-6, lambda_c=1.0, **settings)
        got = valve.equations(
            p_supply=200 * BAR, p_a=120 * BAR, p_b=80 * BAR, p_tank=0.0, stroke=0.0, fluid=OIL
        )  # fmt: skip
        for edge, drop in drops.items():
            full = 0.7 * 10e-6 * math.sqrt(2 * drop * BAR / RHO)
            expected = shares[centre].get(edge, 0.0) * full
            name = f"{centre}: {edge.replace('_', ' to ')}"
            found.append(Number(name, expected, got[f"q_{edge}"], "L/min", size=full))
    return found


@evidence(
    "four_three_valve",
    source="linear edge that closes at c = 20 %: (c - |x|)/c, in the middle 1; pressure drop rho/2 (q/(Cd A s))^2",
    tolerance=1e-6,
    because="tanh(2 lambda/lambda_c) is 1 to 1e-7 here; the corner in the middle is rounded to 1e-9 of the stroke",
)
def unloaded() -> list[Number]:
    """Drop from P to T of a pump of 40 L/min, tandem centre of 20 mm^2, at strokes of 0, 5, -10, 15 %, and at 25 %."""
    settings = {"area": 10e-6, "overlap": 0.2, "tandem_area": 20e-6, "tandem_stroke": 0.2}
    valve = FourThreeValve(**settings, lambda_c=1.0, edge_rounding=1e-9)
    still = {"p_a": 0.0, "p_b": 0.0, "p_tank": 0.0, "fluid": OIL}
    found = []
    for x, share in ((0.0, 1.0), (0.05, 0.75), (-0.1, 0.5), (0.15, 0.25)):
        expected = RHO / 2 * (40 * LPM / (0.7 * 20e-6 * share)) ** 2
        p = brentq(
            lambda p, x=x: valve.equations(p_supply=p, stroke=x, **still)["q_supply_tank"] - 40 * LPM,
            0.0, 300 * BAR, xtol=1e-3,
        )  # fmt: skip
        found.append(Number(f"stroke {x:g}", expected, p, "bar"))
    shut = valve.equations(p_supply=200 * BAR, stroke=0.25, **still)["q_supply_tank"]
    return [*found, Number("stroke 0.25: flow", 0.0, shut, "L/min")]


@evidence(
    "spool_drive",
    source="step response of a second-order lag: 1 - exp(-zeta w t) (cos(w_d t) + zeta w/w_d sin(w_d t))",
    tolerance=1e-5,
    because="relative tolerance of the run",
)
def step_response() -> list[Number]:
    """Stroke after a step of the command to 50 %, 50 Hz, damping ratio 0.5, at 5, 10, 20 ms."""
    parts = {
        "asked": {"type": "step", "after": "0.5"},
        "drive": {"type": "spool_drive", "natural_frequency": "50 Hz", "damping_ratio": "0.5"},
    }
    made = circuit(components=parts, nets={"u": ["asked.y", "drive.command"]}, simulation={"stop": "20 ms"})
    run = made.simulate(rtol=1e-8, output_step="1 ms")
    omega, zeta = 100 * math.pi, 0.5
    damped = omega * math.sqrt(1 - zeta**2)
    found = []
    for t in (5e-3, 10e-3, 20e-3):
        swing = math.cos(damped * t) + zeta * omega / damped * math.sin(damped * t)
        (k,) = [k for k, at in enumerate(run.time) if abs(at - t) < 1e-9]
        expected = 0.5 * (1 - math.exp(-zeta * omega * t) * swing)
        found.append(Number(f"stroke at {t * 1e3:g} ms", expected, float(run["drive.position"][k])))
    return found
