"""Lumped pipes: friction of steady flow over all regimes, and the frequencies of one and two lumps."""

from __future__ import annotations

from math import log10, pi, sqrt

import numpy as np
from crescentlab.components.fluids import SimpleOil
from crescentlab.components.pipes import PipeCapacitiveCapacitive, PipeInertialCapacitive, PipeInertialInertial
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
