"""Fittings of pipes."""

from __future__ import annotations

import math

from crescentlab.components.fittings import Bend, Elbow, LocalLoss, SuddenContraction, SuddenExpansion
from crescentlab.components.flow_laws import friction_times_reynolds
from crescentlab.components.fluids import SimpleOil
from scipy.optimize import brentq

from crescentlab.component import Component
from evidence import Number, evidence

RHO, MM = 850.0, 1e-3
THIN = SimpleOil(density=RHO, kinematic_viscosity=1e-9, bulk_modulus=1e15)
"""So thin that no loss depends on the Reynolds number."""


def _loss(part: Component, diameter: float, drop: float, oil: SimpleOil = THIN) -> tuple[float, float]:
    """Loss coefficient [-] on the dynamic head, and velocity [m/s], at a drop."""
    q = part.equations(p_a=max(drop, 0.0), p_b=max(-drop, 0.0), fluid=oil)["q"]
    v = q / (math.pi / 4 * diameter * diameter)
    return abs(drop) / (RHO * v * v / 2), float(v)


@evidence(
    "sudden_expansion",
    "sudden_contraction",
    source="Borda-Carnot: rho (v1 - v2)^2/2; Idelchik, diagram 4-9: 0.5 (1 - A1/A2)^0.75",
    tolerance=1e-5,
    because="30/Re is 1e-6 here; the closed forms are exact",
)
def steps() -> list[Number]:
    """From 10 to 20 mm at 10 m/s in the narrow section: drop of the expansion, and coefficients of both, both ways."""
    expansion = SuddenExpansion(narrow_diameter=10 * MM, wide_diameter=20 * MM)
    contraction = SuddenContraction(narrow_diameter=10 * MM, wide_diameter=20 * MM)
    drop = RHO * (10.0 - 2.5) ** 2 / 2
    narrowing = 0.5 * 0.75**0.75
    return [
        Number("velocity at 0.2390625 bar", 10.0, _loss(expansion, 10 * MM, drop)[1], "m/s"),
        Number("expansion", 0.5625, _loss(expansion, 10 * MM, drop)[0]),
        Number("expansion, backwards", narrowing, _loss(expansion, 10 * MM, -drop)[0]),
        Number("contraction", narrowing, _loss(contraction, 10 * MM, drop)[0]),
        Number("contraction, backwards", 0.5625, _loss(contraction, 10 * MM, -drop)[0]),
        Number("entry from a vessel", 0.5, _loss(SuddenContraction(narrow_diameter=MM, wide_diameter=1.0), MM, 1e5)[0]),
    ]


@evidence(
    "sudden_expansion",
    "sudden_contraction",
    source="Idelchik, diagrams 4-1 and 4-10: 30/Re below Re = 10",
    tolerance=2e-3,
    because="the turbulent part adds 0.56/30 Re, a thousandth at Re = 0.1",
)
def creeping_steps() -> list[Number]:
    """Coefficient at Re = 0.1 in the narrow section of 10 mm, 100 cSt."""
    thick = SimpleOil(density=RHO, kinematic_viscosity=1e-4, bulk_modulus=1e15)
    v = 0.1 * 1e-4 / (10 * MM)
    drop = 300.0 * RHO * v * v / 2
    found = []
    for cls in (SuddenExpansion, SuddenContraction):
        part = cls(narrow_diameter=10 * MM, wide_diameter=20 * MM)
        found.append(Number(cls.type_name(), v, _loss(part, 10 * MM, drop, thick)[1], "mm/s"))
    return found


@evidence(
    "bend",
    source="Idelchik, Handbook of Hydraulic Resistance, diagram 6-1, table of B_1 (90 degrees)",
    tolerance=0.05,
    because="the table has two digits and the formula beside it is fitted to it",
)
def curvature() -> list[Number]:
    """Loss of bends by 90 degrees over the radius, without the friction along the axis."""
    found = []
    for curvature, expected in ((0.5, 1.18), (0.7, 0.51), (1.0, 0.21), (1.5, 0.17), (2.0, 0.15), (4.0, 0.11)):
        bend = Bend(diameter=10 * MM, radius=curvature * 10 * MM)
        loss, v = _loss(bend, 10 * MM, 1e5)
        reynolds = v * 10 * MM / 1e-9
        friction = friction_times_reynolds(reynolds, 0.0) / reynolds * curvature * math.pi / 2
        found.append(Number(f"R/d = {curvature:g}", expected, float(loss - friction)))
    return found


@evidence(
    "bend",
    source="Idelchik, Handbook of Hydraulic Resistance, diagram 6-1, table of A_1",
    tolerance=0.07,
    because="the formulas in the diagram, which the library has, differ by up to 6 % from its table, at 45 degrees",
)
def turning() -> list[Number]:
    """Loss of bends with R/d = 1 over that by 90 degrees, 0.21."""
    found = []
    table = {20: 0.31, 30: 0.45, 45: 0.60, 60: 0.78, 75: 0.90, 90: 1.00, 110: 1.13, 130: 1.20, 150: 1.28, 180: 1.40}
    for degrees, expected in table.items():
        delta = math.radians(degrees)
        loss, v = _loss(Bend(diameter=10 * MM, radius=10 * MM, angle=delta), 10 * MM, 1e5)
        reynolds = v * 10 * MM / 1e-9
        friction = friction_times_reynolds(reynolds, 0.0) / reynolds * delta
        found.append(Number(f"{degrees} degrees", expected, float(loss - friction) / 0.21))
    return found


@evidence(
    "bend",
    source="Hooper (1981), elbow of R/D = 1.5: K = 800/Re + 0.2 (1 + 1 in/d); also fluids.fittings.Hooper2K",
    tolerance=0.02,
    because="Hooper's turbulent 0.3 and Idelchik's 0.17 differ by 1.6 % of the coefficient at Re = 100",
)
def slow_bend() -> list[Number]:
    """Loss of a bend by 90 degrees in a bore of 2 in, without the friction along its axis, at Re = 10, 30, 100."""
    d, nu, found = 50.8 * MM, 100e-6, []
    oil = SimpleOil(density=RHO, kinematic_viscosity=nu, bulk_modulus=1e15)
    bend = Bend(diameter=d, radius=1.5 * d)
    for reynolds in (10, 30, 100):
        v = reynolds * nu / d
        drop = brentq(lambda p, v=v: _loss(bend, d, p, oil)[1] - v, 1e-3, 1e5, rtol=1e-12)
        friction = 64 / reynolds * 1.5 * math.pi / 2
        expected = 800 / reynolds + 0.2 * (1 + 25.4 * MM / d)
        found.append(Number(f"Re = {reynolds}", expected, _loss(bend, d, drop, oil)[0] - friction))
    return found


@evidence(
    "bend",
    source="Idelchik, diagram 6-1, laminar: zeta = A_2/Re + A_1 B_1, A_2 = 1000 for R/d from 1 to 2, besides friction",
    tolerance=1e-6,
    because="solved to rounding; the oil is compressed by 1e-10",
)
def laminar_bend() -> list[Number]:
    """Drop at Re = 20 to 2000 in a bore of 10 mm, R/d = 1.5, 60 degrees, with the diagram's A_2: loss coefficient."""
    d, nu, found = 10 * MM, 30e-6, []
    oil = SimpleOil(density=RHO, kinematic_viscosity=nu, bulk_modulus=1e15)
    bend = Bend(diameter=d, radius=1.5 * d, angle=math.radians(60), laminar_coefficient=1000.0)
    for reynolds in (20, 200, 2000):
        friction = friction_times_reynolds(reynolds, 0.0) / reynolds * 1.5 * math.pi / 3
        expected = friction + 1000 / reynolds + 0.9 * math.sin(math.pi / 3) * 0.21 / math.sqrt(1.5)
        v = reynolds * nu / d
        loss, _ = _loss(bend, d, expected * RHO * v * v / 2, oil)
        found.append(Number(f"Re = {reynolds}", expected, loss))
    return found


@evidence(
    "elbow",
    source="J. Weisbach's table of elbows; his formula, rounded to 0.95 and 2.05, in Idelchik, chapter 6",
    tolerance=4e-3,
    because="the table has three decimals, 0.139 +- 0.0005 at 40 degrees",
)
def corners() -> list[Number]:
    """Loss coefficients of sharp corners."""
    table = {40: 0.139, 60: 0.364, 80: 0.740, 90: 0.984, 100: 1.260, 120: 1.861}
    return [
        Number(f"{degrees} degrees", k, _loss(Elbow(diameter=10 * MM, angle=math.radians(degrees)), 10 * MM, 1e6)[0])
        for degrees, k in table.items()
    ]


@evidence(
    "local_loss",
    source="Hooper (1981): K = 1500/Re + 4 (1 + 1/2 in); K = 6.15 at Re = 10 000, also fluids.fittings.Hooper2K",
    tolerance=1e-7,
    because="the sum by hand is exact; the fluid's density varies by 1e-9",
)
def globe_valve() -> list[Number]:
    """Standard globe valve of 2 in at Re = 10 000."""
    d, nu = 2 * 25.4 * MM, 30e-6
    oil = SimpleOil(density=RHO, kinematic_viscosity=nu, bulk_modulus=1e15)
    v = 1e4 * nu / d
    valve = LocalLoss(diameter=d, loss_coefficient=4 * (1 + 1 / 2), laminar_coefficient=1500.0)
    loss, found = _loss(valve, d, 6.15 * RHO * v * v / 2, oil)
    return [Number("loss coefficient", 6.15, loss), Number("velocity", v, found, "m/s")]
