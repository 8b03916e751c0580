"""The crescent pump in closed form, written out again for tests: what it displaces and what leaks, in the mean.

Numbers of circuits/crescent_pump.yaml (13 and 16 teeth, 34 deg of crescent); flows are means over a pitch, of an oil of
one density as mass flow over that at 0 bar gauge, pressures those of the volumes in the mean.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

from scipy.optimize import brentq

DEG, MM, UM = math.pi / 180, 1e-3, 1e-6
PER_TURN = 13.689e-6
"""Displacement [m^3] a revolution: Eq. 3 of Rundo & Corvaglia over a period, as test_crescent_pump integrates it."""
COVER = ((0.0, 0.0), (3e5, 16 * UM), (6e5, 32 * UM), (8e5, 44 * UM))
"""Pressure [Pa] and deflection [m] of the cover, cover_deflection.csv."""
H, AXIAL, TIP = 13 * MM, 76.5 * UM, 150 * UM
ROOT_GAP, ROOT_TOOTH, MEAN_TOOTH, FACE = 2.391 * MM, 8.218 * MM, 6.24 * MM, 0.75 * 7.15 * MM


@dataclass(frozen=True)
class Oil:
    """Density where it is and at 0 bar gauge [kg/m^3], kinematic viscosity [m^2/s]."""

    rho: float
    rho_0: float
    nu: float

    @property
    def ratio(self) -> float:
        """Flow, as mass flow over rho_0, of a volume flow of this oil [-]."""
        return self.rho / self.rho_0


def slot(width: float, height: float, length: float, oil: Oil) -> float:
    """Flow over drop [m^3/(s Pa)] of a flat slot: the mass flow b h^3/(12 nu l) dp, over rho_0."""
    return width * height**3 / (12 * oil.nu * length) / oil.rho_0


def orifice(drop: float, area: float, d_h: float, oil: Oil, cd_max: float = 0.7, lambda_c: float = 100.0) -> float:
    """Flow [m^3/s] by Eqs. 27 to 29, the mass flow C_d A sqrt(2 rho dp) over rho_0, backwards with a negative drop."""
    discharge = cd_max * math.tanh(2 * d_h * math.sqrt(2 * abs(drop) / oil.rho) / oil.nu / lambda_c)
    return math.copysign(discharge * area * math.sqrt(2 * oil.rho * abs(drop)), drop) / oil.rho_0


def deflection(p: float) -> float:
    """Of the cover [m], linear between the points and beyond the last."""
    points = list(pairwise(COVER))
    (p_0, h_0), (p_1, h_1) = next((pair for pair in points if p <= pair[1][0]), points[-1])
    return h_0 + (h_1 - h_0) * (p - p_0) / (p_1 - p_0)


def suction_pressure(rpm: float, oil: Oil) -> float:
    """Below the sump [Pa]: all that is displaced passes the inlet of 314 mm^2."""
    q = PER_TURN * rpm / 60
    return -brentq(lambda drop: orifice(drop, 314e-6, 20 * MM, oil, lambda_c=1000.0) - q, 0.0, 1e5)


def tips(p: float, p_s: float, rpm: float, oil: Oil) -> float:
    """Over the tooth tips at the crescent [m^3/s]: Eqs. 24 and 25.

    A tooth spends the extension at the crescent, so for a share of each pitch (0.228 of the driver's, 0.860 of the
    driven gear's) two gaps lie in series, otherwise one; the drag acts all the time.
    """
    total = 0.0
    for radius, length, ratio in ((29.1, 2.149, 1.0), (28.6, 2.478, 13 / 16)):
        share = 34 * 13 / 360 / ratio**2 - 1  # contacts of the driven gear: 34 (16/13)/22.5, as in the circuit
        drag = TIP * H * radius * MM * ratio * rpm * math.pi / 30 / 2 * oil.ratio
        total += slot(H, TIP, length * MM, oil) * (p - p_s) * (1 - share / 2) - drag
    return total


def axial(p: float, p_s: float, rpm: float, oil: Oil) -> float:
    """Under the cover, and over roots and faces into the chamfer [m^3/s]: Eqs. 17 to 20, 23.

    The chamfer's pressure is that at which as much enters as leaves to suction and along the collar; the trapped
    volume squeezes 3.975 mm^3 a pitch into it.
    """
    dh = deflection(p)
    cover = 5 * (slot(ROOT_GAP, dh, 3.5 * MM, oil) + slot(MEAN_TOOTH, 0.75 * dh, FACE, oil)) * p
    faces = slot(ROOT_TOOTH, AXIAL, 3 * MM, oil)
    collar = slot(math.pi * 35 * MM * (1 + 1.5 * 0.95**2), 40 * UM, 8 * MM, oil)

    def passed(drop: float) -> float:
        return 5 * (orifice(drop, AXIAL * ROOT_GAP, 2 * AXIAL, oil) + faces * drop)

    squeezed = 3.975e-9 * 13 * rpm / 60 * oil.ratio
    chamfer = brentq(lambda x: passed(p - x) + squeezed - passed(x - p_s) - collar * x, p_s, p + 1e5)
    return cover + passed(p - chamfer)


def leakage(p: float, rpm: float, oil: Oil) -> float:
    """What leaves the delivery volume through gaps [m^3/s], relief valve closed."""
    p_s = suction_pressure(rpm, oil)
    ring = slot(H, 278 * UM, 40 * MM, oil) * (p - p_s)
    return tips(p, p_s, rpm, oil) + ring + axial(p, p_s, rpm, oil)


def churchill(reynolds: float) -> float:
    """Darcy friction factor of a smooth pipe, Churchill, Chem. Eng. 84 (1977) 24, 91."""
    a = (-2.457 * math.log((7 / reynolds) ** 0.9)) ** 16
    return 8 * ((8 / reynolds) ** 12 + (a + (37530 / reynolds) ** 16) ** -1.5) ** (1 / 12)


def pipe_loss(q: float, diameter: float, length: float, coefficient: float, oil: Oil) -> float:
    """Pressure drop [Pa] of a pipe, Darcy and Weisbach."""
    v = q / oil.ratio / (math.pi / 4 * diameter**2)
    return (churchill(v * diameter / oil.nu) * length / diameter + coefficient) * oil.rho / 2 * v * v
