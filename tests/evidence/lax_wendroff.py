"""The Lax-Wendroff line: what its scheme does to waves, measured on its own two steps."""

from __future__ import annotations

from typing import Any

import numpy as np
from crescentlab.components.fluids import SimpleOil
from crescentlab.components.wave_laws import full_step, half_step, impedance, wave_speed

from evidence import Number, evidence

THIN = SimpleOil(density=870.0, kinematic_viscosity=1e-9, bulk_modulus=1.6e9)
AREA, REST = 1e-3, 0.0
SPEED = float(wave_speed(REST, THIN))
IMPEDANCE = float(impedance(REST, AREA, THIN))


def no_friction(q: Any, p: Any) -> Any:
    """A line without losses."""
    return 0.0 * q


def tick(p: np.ndarray, q: np.ndarray, courant: float, dx: float) -> tuple[np.ndarray, np.ndarray]:
    """One step of a line closed to a ring."""
    dt = courant * dx / SPEED
    ring = [np.concatenate([x[-1:], x, x[:1]]) for x in (p, q)]
    between = half_step(ring[0], ring[1], dt, dx, AREA, no_friction, THIN)
    return full_step(ring[0], ring[1], between, dt, dx, AREA, THIN)


@evidence(
    "lax_wendroff_line",
    source="Joukowsky (1898), by hand: sqrt(1.6e9/870) m/s, times 870 kg/m^3 * 1 m/s",
    tolerance=4.3e-5,
    because="11.798 is rounded to five digits, half a unit of the last is 4.2e-5",
)
def joukowsky() -> list[Number]:
    """Wave speed and pressure per velocity stopped, rigid, 870 kg/m^3, 1.6 GPa, at 0 bar."""
    return [Number("wave speed, m/s", 1356.127, SPEED), Number("Z A v, v = 1 m/s", 11.798e5, IMPEDANCE * AREA, "bar")]


@evidence(
    "lax_wendroff_line",
    source="von Neumann analysis of Lax-Wendroff: 1 - 4 nu^2 (1 - nu^2) sin^4(theta/2) (Hirsch 1990, section 8.2)",
    tolerance=2e-6,
    because="at 100 Pa the fluid is linear to 1e-7, and the waves' cubes add a few of them",
)
def amplification() -> list[Number]:
    """Energy that a wave keeps per step, on a ring of 20 nodes, over the Courant number and the phase per node."""
    found = []
    for nu in (0.3, 0.6, 0.9, 1.0):
        for turns in (1, 3, 5, 10):
            theta = 2 * np.pi * turns / 20
            energy = 0.0
            for phase in (0.0, np.pi / 2):
                p = 100.0 * np.cos(theta * np.arange(20) + phase)
                new_p, new_q = tick(p, p / IMPEDANCE, nu, 0.1)
                w = (new_p + IMPEDANCE * new_q) / 2
                energy += float(np.mean(w**2)) / 100.0**2
            expected = 1 - 4 * nu**2 * (1 - nu**2) * np.sin(theta / 2) ** 4
            found.append(Number(f"nu {nu:g}, theta {turns / 10:g} pi", expected, energy, size=1.0))
    return found


@evidence(
    "lax_wendroff_line",
    source="order of a scheme of second order on a smooth wave: log2 of the errors' ratio when cells are halved",
    tolerance=0.02,
    because="the next term of the error is a share (theta/2)^2 smaller: 2 % at 40 nodes per wave, less on finer grids",
)
def order() -> list[Number]:
    """Order of convergence: a wave of one length of the ring runs once round at Courant number 0.5."""
    errors = []
    for nodes in (40, 80, 160):
        wave = 100.0 * np.sin(2 * np.pi * np.arange(nodes) / nodes)
        p, q = wave, wave / IMPEDANCE
        for _ in range(2 * nodes):
            p, q = tick(p, q, 0.5, 1.0 / nodes)
        errors.append(float(np.sqrt(np.mean((p - wave) ** 2))))
    return [Number(f"{n} to {2 * n} nodes", 2.0, float(np.log2(errors[k] / errors[k + 1])))
            for k, n in enumerate((40, 80))]  # fmt: skip
