"""Carry-over volumes along the crescent."""

from __future__ import annotations

import math

import numpy as np
from crescentlab.components.carry_over import CarryOverChain
from crescentlab.components.crescent_gears import CrescentGears
from crescentlab.components.fluids import SimpleOil

from evidence import Number, evidence

BAR, DEGREE = 1e5, math.pi / 180
OIL = SimpleOil(density=860.0, kinematic_viscosity=35e-6, bulk_modulus=1e12)


@evidence(
    "carry_over_chain",
    source="Rundo & Corvaglia (2016), Eqs. 24 and 2, by hand: plane Poiseuille flow less the drag h H R omega/2",
    tolerance=2e-6,
    because="the expected values are rounded to seven digits; the oil yields by 1e-6",
)
def tip_flows() -> list[Number]:
    """Driver of the paper at 2000 rpm, gaps of 150 um, 5 bar at delivery and 2 bar in the volume."""
    part = CarryOverChain(
        volumes=1, volume=566.75e-9, pitch=2 * math.pi / 13, extension=34 * DEGREE, gap_height=150e-6,
        gap_length=2.149e-3, thickness=13e-3, tip_radius=29.1e-3,
    )  # fmt: skip
    now = part.equations(
        p=np.array([2 * BAR]), q_chain=np.zeros(1), p_suction=0.0, p_delivery=5 * BAR, omega_shaft=2000 * math.pi / 30,
        phase=DEGREE, closed_at=0.0, started=1.0, fluid=OIL,
    )  # fmt: skip
    gap, drag = 5.652401e-11, 5.942323e-6
    return [
        Number("flow over the tip at suction", 2 * BAR * gap - drag, now["q_gaps"][0], "L/min"),
        Number("flow over the tip at delivery", 3 * BAR * gap - drag, now["q_gaps"][1], "L/min"),
        Number("rate of pressure", 1e12 / 566.75e-9 * BAR * gap, now["der_p"][0], "bar/ms"),
    ]


@evidence(
    "carry_over_chain",
    source="Rundo & Corvaglia (2016), Table 4: mean contacts of the driver with the crescent, 1.22, 1.44, 1.65, 1.87",
    tolerance=8e-3,
    because="the table cuts its digits off",
)
def contacts() -> list[Number]:
    """Mean number of tips of the driver that seal, with a crescent of 34, 40, 46 and 52 deg."""
    found = []
    for degrees, expected in ((34, 1.22), (40, 1.44), (46, 1.65), (52, 1.87)):
        chambers = CrescentGears(crescent_extension=degrees * DEGREE).chambers
        part = CarryOverChain(
            volumes=1, volume=566.75e-9, pitch=chambers.mesh.pitch, extension=chambers.driver_extension,
            gap_height=0.0, gap_length=2e-3, thickness=13e-3, tip_radius=29.1e-3,
        )  # fmt: skip
        sealed = [
            1 + float(part.equations(
                p=np.zeros(1), q_chain=np.zeros(1), p_suction=0.0, p_delivery=0.0, omega_shaft=0.0, phase=phase,
                closed_at=0.0, started=1.0, fluid=OIL,
            )["exists"][0])
            for phase in (np.arange(500) + 0.5) / 500 * part.pitch
        ]  # fmt: skip
        found.append(Number(f"{degrees} deg", expected, float(np.mean(sealed))))
    return found


@evidence(
    "carry_over_chain",
    source="power of a flow through a drop, dp q: plane Poiseuille flow loses it, the drag h H R omega/2 of the moving "
    "tip brings it (Rundo & Corvaglia (2016), Eq. 24)",
    tolerance=2e-6,
    because="the expected values are rounded to seven digits; the oil yields by 1e-6",
)
def powers() -> list[Number]:
    """The same driver: lost by leakage over both tips, brought by their drag, and energy of the volume at 200 bar."""
    part = CarryOverChain(
        volumes=1, volume=566.75e-9, pitch=2 * math.pi / 13, extension=34 * DEGREE, gap_height=150e-6,
        gap_length=2.149e-3, thickness=13e-3, tip_radius=29.1e-3,
    )  # fmt: skip
    given = {"q_chain": np.zeros(1), "p_suction": 0.0, "p_delivery": 5 * BAR, "omega_shaft": 2000 * math.pi / 30}
    given |= {"phase": DEGREE, "closed_at": 0.0, "started": 1.0}
    now = part.equations(p=np.array([2 * BAR]), fluid=OIL, **given)
    soft = SimpleOil(density=860.0, kinematic_viscosity=35e-6, bulk_modulus=1.4e9)
    full = part.equations(p=np.array([200 * BAR]), fluid=soft, **given)
    gap, drag = 5.652401e-11, 5.942323e-6
    held = 566.75e-9 * (1.4e9 * math.expm1(200 * BAR / 1.4e9) - 200 * BAR)
    return [
        Number("lost, (2^2 + 3^2) bar^2 H h^3/(12 mu l)", 13 * BAR**2 * gap, now["loss"], "W"),
        Number("brought by the drag, 5 bar h H R omega/2", 5 * BAR * drag, now["supply"], "W"),
        Number("energy at 200 bar", held, full["stored_energy"], "mJ"),
    ]
