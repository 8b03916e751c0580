"""Where the power of the shipped pumps goes: shaft power is what leaves as hydraulic power and what is lost."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
import pytest
from crescentlab.components.fluids import AeratedOil, SimpleOil

import crescentlab as cl
from crescentlab.analysis.outcome import Window
from crescentlab.analysis.periodic import periodic
from crescentlab.balance import EnergyBalance
from crescentlab.result import Result

BAR, BETA = 1e5, 1.4e9
AERATED = AeratedOil(
    density=860.0, kinematic_viscosity=35e-6, bulk_modulus=BETA, air_fraction=0.005, saturation_pressure=1e8
)
OIL = SimpleOil(density=860.0, kinematic_viscosity=35e-6, bulk_modulus=BETA)


@dataclass(frozen=True)
class Period:
    """One period of a periodic steady state."""

    result: Result
    window: Window
    energy: EnergyBalance

    def integral(self, series: np.ndarray) -> float:
        """Integral over the period of a series on the window's nodes."""
        return float(self.window.weights @ series)

    def lost(self, *without: str) -> float:
        """Energy [J] dissipated but in components whose names begin with one of ``without``."""
        return sum(v for k, v in self.energy.dissipated.items() if not k.startswith(without or ("-",)))


@functools.cache
def period_of(name: str) -> Period:
    """The shipped circuit's steady period, closed to 1e-8."""
    found = periodic(cl.load(name), tolerance=1e-8, rtol=1e-8)
    assert found.converged
    balance = found.result.balance
    assert balance is not None
    assert balance.energy is not None
    return Period(found.result, Window(found.result), balance.energy)


PUMPS = ("crescent_pump", "external_gear_pump", "axial_piston_pump")


@pytest.mark.parametrize("name", PUMPS)
def test_the_ledger_closes(name: str) -> None:
    """Every component's, and the circuit's, as share of the shaft's work in the period.

    Relative tolerance 1e-8; the areas of the axial pump's plate have kinks within steps, which cost the integrals 1e-6.
    """
    energy = period_of(name).energy
    most = 2e-6 if name == "axial_piston_pump" else 1e-8
    assert max(energy.components.values()) < most
    assert energy.circuit < most
    assert abs(energy.stored) < 1e-8 * sum(energy.supplied.values())  # it is periodic


def test_budget_of_the_crescent_pump() -> None:
    """Shaft and the tips' drag = line + leakages + inlet, and what volumes that merge bring; Gauss nodes, 1e-6.

    The tips drag 150 um x 13 mm x R omega/2 from suction to delivery each, against about 3 bar: 2.3 % of the shaft's
    power, which the paper's torque, that of the pressures on the gears, does not hold.
    """
    now = period_of("crescent_pump")
    w = now.window
    shaft = now.integral(w["gears.torque"]) * 2000 * math.pi / 30
    drag = now.integral(w["driver.supply"] + w["driven.supply"])
    p = w["delivery.p"]
    out = now.integral(AERATED.rho_0 * w["line.duct.a.q"] * AERATED.enthalpy(p))
    lost, merged = now.lost("line.", "throttle"), sum(now.energy.at_events.values())
    assert shaft + drag == pytest.approx(sum(now.energy.supplied.values()), rel=1e-9)
    assert shaft + drag + merged == pytest.approx(out + lost, rel=1e-6)
    seconds = float(w.weights.sum())
    dragged = 150e-6 * 13e-3 * (29.1e-3 + 13 / 16 * 28.6e-3) * 2000 * math.pi / 30 / 2
    assert drag / seconds == pytest.approx(dragged * now.integral(p) / seconds, rel=0.02)  # suction is not quite at 0
    assert 0 < merged < 1e-3 * shaft
    assert 0.85 < out / shaft < 1


def test_budget_of_the_external_gear_pump() -> None:
    """Shaft and drag = throttle + leakages + inlet, with w = beta (1 - exp(-p/beta))/rho_0; Gauss nodes, 1e-6."""
    now = period_of("external_gear_pump")
    w = now.window
    shaft = now.integral(w["gears.torque"]) * 1500 * math.pi / 30
    drag = now.integral(w["driver.supply"] + w["driven.supply"])
    out = now.integral(-w["throttle.q"] * BETA * np.expm1(-w["delivery.p"] / BETA))
    lost, merged = now.lost("throttle"), sum(now.energy.at_events.values())
    assert shaft + drag + merged == pytest.approx(out + lost, rel=1e-6)
    assert out == pytest.approx(now.energy.dissipated["throttle"], rel=1e-6)


def test_what_volumes_that_merge_gain_and_lose() -> None:
    """A space that opens jumps to the delivery's pressure, V (e(p_d) - e(p)); teeth take oil back to suction.

    They take 2 V less what a pitch displaces, and what this was compressed by is lost: (2 V - V_p) (e(p_d) - e(p_s)).
    """
    now = period_of("external_gear_pump")
    result, gained = now.result, 0.0
    space, displaced = float(result["gears.space"][0]), float(result["gears.displacement"][0]) * 2 * math.pi / 12

    def held(name: str, row: int) -> float:
        return float(OIL.energy_density(result[name][row]))

    for gear in ("driver", "driven"):
        (opens,) = np.flatnonzero(np.diff(result[f"{gear}.exists"][:, -1]) < 0)
        gained += space * (held("delivery.p", opens) - held(f"{gear}.p[7]", opens))
    (meshes,) = np.flatnonzero(np.diff(result["gears.mesh_start"]) > 0)
    gained -= (2 * space - displaced) * (held("delivery.p", meshes) - held("suction.p", meshes))
    assert sum(now.energy.at_events.values()) == pytest.approx(gained, rel=1e-9)


def test_budget_of_the_axial_piston_pump() -> None:
    """Shaft = rho_0 (w(200 bar) - w(2 bar)) times the flow + what the valve plate throttles; nothing else loses.

    The plate's areas have kinks within steps, which cost the integrals 2e-6 here.
    """
    now = period_of("axial_piston_pump")
    w = now.window
    shaft = now.integral(w["barrel.torque"]) * 1500 * math.pi / 30
    rise = -BETA * (math.expm1(-200 * BAR / BETA) - math.expm1(-2 * BAR / BETA))
    lost = now.energy.dissipated["plate"]
    assert {k for k, v in now.energy.dissipated.items() if v} == {"plate"}
    assert now.integral(w["plate.q"]) == pytest.approx(now.integral(w["plate.q_suction_port"]), rel=1e-5)
    assert shaft == pytest.approx(rise * now.integral(w["plate.q"]) + lost, rel=1e-5)
    assert lost > 0.01 * shaft
