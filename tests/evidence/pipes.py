"""Lumped pipes: friction of steady flow over all regimes, and the frequencies of one and two lumps."""

from __future__ import annotations

from math import expm1, log10, pi, sqrt

import numpy as np
from crescentlab.components.fluids import SimpleOil
from crescentlab.components.pipes import PipeCapacitiveCapacitive, PipeInertialCapacitive, PipeInertialInertial
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from evidence import Number, evidence

LENGTH, DIAMETER = 0.72, 0.012
AREA = pi / 4 * DIAMETER**2
STIFF = SimpleOil(density=860.0, kinematic_viscosity=35e-6, bulk_modulus=1e15)


def darcy_factor(reynolds: float, roughness: float) -> float:
    """f of the pipe's equations: the drop that keeps the flow steady, over (l/d) rho v^2/2."""
    pipe = PipeInertialCapacitive(length=LENGTH, diameter=DIAMETER, roughness=roughness * DIAMETER)
    v = reynolds * 35e-6 / DIAMETER
    rate = float(pipe.equations(p_a=0.0, q_b=-v * AREA, p=0.0, q=v * AREA, fluid=STIFF)["der_q"])  # type: ignore[arg-type]
    drop = -rate * 860.0 * LENGTH / AREA
    return drop / (LENGTH / DIAMETER * 860.0 * v * v / 2)


def colebrook(reynolds: float, roughness: float) -> float:
    """f of 1/sqrt(f) = -2 log10(roughness/3.7 + 2.51/(Re sqrt(f)))."""

    def residual(root: float) -> float:
        return root + 2 * log10(roughness / 3.7 + 2.51 * root / reynolds)

    return float(1 / brentq(residual, 1.0, 30.0) ** 2)


@evidence(
    "pipe",
    "distributed_line",
    "transmission_line",
    "lax_wendroff_line",
    source="Hagen-Poiseuille, f = 64/Re",
    tolerance=1e-4,
    because="Churchill's single curve leaves 64/Re by (f_turbulent/f_laminar)^12/12, 1e-5 at Re 1000",
)
def laminar_friction() -> list[Number]:
    """Darcy factor of laminar flow, the law that all lines share."""
    return [Number(f"f at Re {re:g}", 64 / re, darcy_factor(re, 0.0)) for re in (1.0, 100.0, 1000.0)]


@evidence(
    "pipe",
    "distributed_line",
    "transmission_line",
    "lax_wendroff_line",
    source="Colebrook (1939), solved by SciPy",
    tolerance=1e-2,
    because="Swamee & Jain, J. Hydraul. Div. ASCE 102 (1976) 657-664, whose formula the turbulent part of Churchill's "
    "is, state 1 % from Re 5000 to 1e8",
)
def turbulent_friction() -> list[Number]:
    """Darcy factor of turbulent flow, smooth and rough, the law that all lines share."""
    points = [(1e4, 0.0), (1e5, 0.0), (1e6, 0.0), (1e4, 1e-3), (1e5, 1e-3), (1e6, 1e-2)]
    return [Number(f"f at Re {re:g}, roughness {k:g} d", colebrook(re, k), darcy_factor(re, k)) for re, k in points]


@evidence(
    "pipe",
    source="one inertia and one capacity: omega = a/l; halves of either at both ends: 2 a/l; a = sqrt(beta/rho)",
    tolerance=1e-5,
    because="closed forms; the viscosity left is 1e-12 m^2/s",
)
def lumped_frequencies() -> list[Number]:
    """Frequency of the pipe's lumps, 0.72 m, 1.4 GPa, 860 kg/m^3, both ends at rest."""
    thin = SimpleOil(density=860.0, kinematic_viscosity=1e-12, bulk_modulus=1.4e9)
    one = sqrt(1.4e9 / 860.0) / LENGTH / (2 * pi)
    found = []
    for form, name, times in (
        (PipeInertialCapacitive, "one inertia, one capacity", 1.0),
        (PipeInertialInertial, "T", 2.0),
        (PipeCapacitiveCapacitive, "pi", 2.0),
    ):
        pipe = form(length=LENGTH, diameter=DIAMETER)
        extra = {PipeInertialInertial: "surplus", PipeCapacitiveCapacitive: "drop"}.get(form)
        names = ["p", "q"] + ([extra] if extra else [])
        size = [1e3, 1e-9, 1e-9 if extra == "surplus" else 1e3][: len(names)]
        ends = {port.inputs()[0][0]: 0.0 for port in pipe.ports()}
        columns = []
        for k, step in enumerate(size):
            x = {n: step * (i == k) for i, n in enumerate(names)}
            rates = pipe.equations(**x, **ends, fluid=thin)
            columns.append([float(rates[f"der_{n}"]) / step for n in names])
        fastest = float(np.max(np.abs(np.linalg.eigvals(np.array(columns).T).imag))) / (2 * pi)
        found.append(Number(name, times * one, fastest, "Hz"))
    return found


@evidence(
    "pipe",
    source="1/2 m v^2, m = rho A l, v = rho_0 q/(rho A), rho = rho_0 e^(p/beta); compression of m from 0 bar against "
    "the atmosphere, A l (beta (e^(p/beta) - 1) - p)",
    tolerance=1e-9,
    because="closed forms; the compression is a difference of numbers 1e2 times as large",
)
def stored_energy() -> list[Number]:
    """Energy in the pipe, 860 kg/m^3, 1.4 GPa, at 300 bar and 60 L/min."""
    oil = SimpleOil(density=860.0, kinematic_viscosity=35e-6, bulk_modulus=1.4e9)
    p, q, volume = 300e5, 1e-3, AREA * LENGTH
    mass = 860.0 * (expm1(p / 1.4e9) + 1) * volume
    v = 860.0 * q / (mass / LENGTH)

    def stored(flow: float) -> float:
        pipe = PipeInertialCapacitive(length=LENGTH, diameter=DIAMETER)
        return float(pipe.equations(p_a=p, q_b=-flow, p=p, q=flow, fluid=oil)["stored_energy"])  # type: ignore[arg-type]

    compressed = volume * (1.4e9 * expm1(p / 1.4e9) - p)
    return [
        Number("compression", compressed, stored(0.0), "J"),
        Number("motion", mass * v * v / 2, stored(q) - stored(0.0), "J"),
    ]


@evidence(
    "pipe",
    source="Hagen-Poiseuille, by hand: 10 L/min times 7097.1 Pa",
    tolerance=1e-5,
    because="7097.1 is rounded to five digits, half a unit of the last is 7e-6",
)
def heat_of_steady_flow() -> list[Number]:
    """Power that laminar flow of 10 L/min turns into heat, 35 cSt, 860 kg/m^3."""
    q, drop = 10e-3 / 60, 7097.1
    pipe = PipeInertialCapacitive(length=LENGTH, diameter=DIAMETER)
    found = pipe.equations(p_a=drop, q_b=-q, p=0.0, q=q, fluid=STIFF)  # type: ignore[arg-type]
    return [Number("heat", 1.18285, float(found["loss"]), "W")]


@evidence(
    "pipe",
    source="Joukowsky (1898): 1/2 rho A l v^2 becomes A l p^2/(2 beta), so p = rho a v, a = sqrt(beta/rho)",
    tolerance=1e-3,
    because="of the order of v/a = 8e-4, the convective term and the change of density by the wave itself",
)
def energy_of_a_flow_stopped() -> list[Number]:
    """A flow of 1 m/s from a vessel at 0 bar stopped at the far end: what it becomes in one lump."""
    thin = SimpleOil(density=860.0, kinematic_viscosity=1e-12, bulk_modulus=1.4e9)
    pipe = PipeInertialCapacitive(length=LENGTH, diameter=DIAMETER)

    def found(x: np.ndarray) -> dict[str, float]:
        return pipe.equations(p_a=0.0, q_b=0.0, p=float(x[0]), q=float(x[1]), fluid=thin)  # type: ignore[arg-type,return-value]

    def stops(t: float, x: np.ndarray) -> float:
        return float(x[1])

    stops.terminal = True  # type: ignore[attr-defined]
    run = solve_ivp(
        lambda t, x: [found(x)["der_p"], found(x)["der_q"]], (0, 1e-2), [0.0, AREA], rtol=1e-9, atol=1e-14,
        events=stops,
    )  # fmt: skip
    motion = 860.0 * AREA * LENGTH / 2
    return [
        Number("in motion", motion, found(run.y[:, 0])["stored_energy"], "J"),
        Number("in compression when it has stopped", motion, found(run.y[:, -1])["stored_energy"], "J"),
        Number("pressure", 860.0 * sqrt(1.4e9 / 860.0), float(run.y[0, -1]), "bar"),
    ]
