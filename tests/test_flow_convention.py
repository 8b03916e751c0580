"""One convention of flow: q is mass flow over rho_0 in every part, and a law's volume flow is converted where it holds.

Under 350 bar the oil here is 2.5 % denser than at 0 bar gauge, and a law that forgot to convert is off by that.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from crescentlab.components import flow_laws
from crescentlab.components.check_valves import CheckValve, IdealCheckValve, PilotOperatedCheckValve
from crescentlab.components.coolers import Cooler
from crescentlab.components.cylinders import Cushion, DoubleActingCylinder
from crescentlab.components.directional_valves import FourThreeValve, FourTwoValve, ThreeTwoValve, TwoTwoValve
from crescentlab.components.filters import Filter
from crescentlab.components.fittings import Bend, Elbow, LocalLoss, SuddenContraction, SuddenExpansion
from crescentlab.components.fluids import SimpleOil
from crescentlab.components.gaps import (
    AnnularGap,
    AxialFaceGap,
    LaminarGap,
    MovingAnnularGap,
    RotatingAnnularGap,
    VariableHeightGap,
    VariableWidthGap,
)
from crescentlab.components.orifices import LaminarTurbulentOrifice, Orifice, RatedOrifice, Throttle, VariableOrifice
from crescentlab.components.poppets import BallPoppet, ConicalPoppet, FlapperNozzle
from crescentlab.components.resistances import MeasuredResistance, PipeResistance, ShortTube
from crescentlab.components.spools import AnnularPort, RectangularSlots, TriangularNotches
from crescentlab.components.valve_parts import LeakageLand, RoundHoles
from test_components import FORMS, SETTINGS

from crescentlab import units
from crescentlab.contract import Case, sample
from crescentlab.domain import HYDRAULIC
from crescentlab.energy import fluids_asked
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr

BAR, MM = 1e5, 1e-3
RHO_0, NU, BETA = 860.0, 35e-6, 1.4e9
OIL = SimpleOil(density=RHO_0, kinematic_viscosity=NU, bulk_modulus=BETA)
THIN = SimpleOil(density=RHO_0, kinematic_viscosity=1e-12, bulk_modulus=BETA)
HIGH, LOW = 350 * BAR, 345 * BAR
DENSE = RHO_0 * math.exp(347.5 * BAR / BETA)
"""rho [kg/m^3] at the mean of the two pressures."""

ORIFICE = 0.7 * 10e-6 * math.sqrt(2 * DENSE * 5 * BAR)
"""Mass flow [kg/s] through 10 mm^2 with a discharge coefficient of 0.7: C_d A sqrt(2 rho dp)."""
SLOT = 10 * MM * (0.1 * MM) ** 3 / (12 * NU * 20 * MM) * 5 * BAR
"""Mass flow [kg/s] through a gap 10 mm wide, 0.1 mm high, 20 mm long: b h^3 dp/(12 nu l)."""
ANNULUS = math.pi * 20 * MM * (10e-6) ** 3 / (12 * NU * 15 * MM) * 5 * BAR


def head(loss: float, diameter: float) -> float:
    """Mass flow [kg/s] through a bore that takes `loss` dynamic heads, without viscosity: A sqrt(2 rho dp/zeta)."""
    return math.pi / 4 * diameter**2 * math.sqrt(2 * DENSE * 5 * BAR / loss)


TURBULENT: dict[str, tuple[Any, dict[str, Any], float]] = {
    "orifice": (Orifice(area=10e-6), {}, ORIFICE),
    "throttle": (Throttle(area=10e-6), {}, ORIFICE),
    "variable_orifice": (VariableOrifice(area=20e-6), {"opening": 0.5}, ORIFICE),
    "laminar_turbulent_orifice": (LaminarTurbulentOrifice(area=10e-6, cd_turbulent=0.7), {}, ORIFICE),
    "rated_orifice": (
        RatedOrifice(rated_flow=1e-3, rated_drop=5 * BAR, transition_drop=1.0), {},
        1e-3 * math.sqrt(860 * DENSE),  # so many m^3/s of 860 kg/m^3
    ),
    "short_tube": (ShortTube(diameter=3 * MM, length=6 * MM), {}, head(1.5, 3 * MM)),
    "local_loss": (LocalLoss(diameter=8 * MM, loss_coefficient=0.5), {}, head(0.5, 8 * MM)),
    "elbow": (Elbow(diameter=8 * MM), {}, head(0.9457 / 2 + 2.047 / 4, 8 * MM)),
    "sudden_expansion": (SuddenExpansion(narrow_diameter=8 * MM, wide_diameter=16 * MM), {}, head(0.75**2, 8 * MM)),
    "sudden_contraction": (
        SuddenContraction(narrow_diameter=8 * MM, wide_diameter=16 * MM), {}, head(0.75**0.75 / 2, 8 * MM)
    ),
    "measured_resistance": (
        MeasuredResistance(laminar=1.0, turbulent=5 * BAR / 1e-6), {}, 1e-3 * math.sqrt(860 * DENSE)
    ),
    "filter": (Filter(element=1.0, housing=5 * BAR / 1e-6), {}, 1e-3 * math.sqrt(860 * DENSE)),
    "cooler": (Cooler(laminar=1.0, turbulent=5 * BAR / 1e-6), {}, 1e-3 * math.sqrt(860 * DENSE)),
    "check_valve": (CheckValve(area=10e-6, opening_range=1 * BAR), {}, ORIFICE),
    "pilot_operated_check_valve": (
        PilotOperatedCheckValve(area=10e-6, opening_range=1 * BAR), {"p_pilot": HIGH}, ORIFICE
    ),
    "two_two_valve": (TwoTwoValve(area=10e-6), {"stroke": 1.0}, ORIFICE),
    "conical_poppet": (
        ConicalPoppet(seat_diameter=math.sqrt(40 / math.pi) * MM, cd_max=0.7), {"x_rod": 5 * MM, "v_rod": 0.0}, ORIFICE
    ),
    "ball_poppet": (
        BallPoppet(seat_diameter=math.sqrt(40 / math.pi) * MM, ball_diameter=5 * MM), {"x_rod": 5 * MM, "v_rod": 0.0},
        ORIFICE,
    ),
    "flapper_nozzle": (
        FlapperNozzle(diameter=math.sqrt(40 / math.pi) * MM, cd_max=0.7), {"x_rod": 5 * MM}, ORIFICE
    ),
    "annular_port": (AnnularPort(diameter=10 / math.pi * MM), {"x_rod": 1 * MM, "v_rod": 0.0}, ORIFICE),
    "rectangular_slots": (RectangularSlots(width=5 * MM, length=2 * MM), {"x_rod": 3 * MM, "v_rod": 0.0}, ORIFICE),
    "triangular_notches": (
        TriangularNotches(angle=math.pi / 2, length=math.sqrt(10) * MM), {"x_rod": 5 * MM, "v_rod": 0.0}, ORIFICE
    ),
    "round_holes": (
        RoundHoles(diameter=math.sqrt(40 / math.pi) * MM), {"x_rod": 5 * MM, "v_rod": 0.0}, ORIFICE
    ),
}  # fmt: skip
"""Parts at a drop of 5 bar, what they need besides, and the mass flow [kg/s] that Bernoulli's law gives them."""


@pytest.mark.parametrize("name", TURBULENT)
def test_turbulent_mass_flow_is_that_of_the_density_there(name: str) -> None:
    """m' = C_d A sqrt(2 rho dp) of an oil almost without viscosity at 347.5 bar, which is 860 exp(347.5/14000) kg/m^3.

    3e-5 for what viscosity there is in the short tube, 1e-6 or less in the others and for roundings of edges and areas.
    """
    part, given, mass_flow = TURBULENT[name]
    q = part.equations(p_a=HIGH, p_b=LOW, **given, fluid=THIN)["q"]
    assert q * RHO_0 == pytest.approx(mass_flow, rel=3e-5 if name == "short_tube" else 2e-6)
    if "p_pilot" not in given and name not in ("check_valve", "sudden_expansion", "sudden_contraction"):
        assert part.equations(p_a=LOW, p_b=HIGH, **given, fluid=THIN)["q"] == pytest.approx(-q, rel=1e-12)


LAMINAR: dict[str, tuple[Any, dict[str, Any], float]] = {
    "laminar_gap": (LaminarGap(width=10 * MM, height=0.1 * MM, length=20 * MM), {}, SLOT),
    "variable_height_gap": (
        VariableHeightGap(width=10 * MM, height=0.0, length=20 * MM), {"change": 0.1 * MM}, SLOT
    ),
    "variable_width_gap": (VariableWidthGap(width=20 * MM, height=0.1 * MM, length=20 * MM), {"opening": 0.5}, SLOT),
    "annular_gap": (AnnularGap(diameter=20 * MM, clearance=10e-6, length=15 * MM), {}, ANNULUS),
    "axial_face_gap": (
        AxialFaceGap(inner_diameter=10 * MM, outer_diameter=20 * MM, height=10e-6), {},
        math.pi * (10e-6) ** 3 / (6 * NU * math.log(2)) * 5 * BAR,
    ),
    "moving_annular_gap": (
        MovingAnnularGap(diameter=20 * MM, clearance=10e-6, length=15 * MM), {"v_rod": 0.2},
        ANNULUS + DENSE * math.pi * 20 * MM * 10e-6 / 2 * 0.2,  # what the wall drags along, of the oil there
    ),
    "rotating_annular_gap": (
        RotatingAnnularGap(diameter=20 * MM, clearance=10e-6, length=15 * MM), {"omega_shaft": 100.0}, ANNULUS
    ),
    "leakage_land": (
        LeakageLand(diameter=20 * MM, clearance=10e-6, overlap=15 * MM), {"x_rod": 0.0, "v_rod": 0.2},
        ANNULUS + DENSE * math.pi * 20 * MM * 10e-6 / 2 * 0.2,
    ),
    "pipe_resistance": (
        PipeResistance(diameter=1 * MM, length=2.0), {}, math.pi * MM**4 / (128 * NU * 2.0) * 5 * BAR
    ),
    "bend": (
        Bend(diameter=0.1 * MM, radius=100 * MM, laminar_coefficient=0.0), {},
        math.pi * (0.1 * MM) ** 4 / (128 * NU * math.pi / 2 * 100 * MM) * 5 * BAR,
    ),
    "measured_resistance": (MeasuredResistance(laminar=1e10, reference_viscosity=NU), {}, 860 * 5 * BAR / 1e10),
    "filter": (Filter(element=1e10, reference_viscosity=NU), {}, 860 * 5 * BAR / 1e10),
    "ideal_check_valve": (IdealCheckValve(), {}, DENSE * 1e-7 * 5 * BAR),
}  # fmt: skip
"""Parts at a drop of 5 bar, what they need besides, and the mass flow [kg/s] of Poiseuille's law: no density in it."""


@pytest.mark.parametrize("name", LAMINAR)
def test_laminar_mass_flow_goes_with_the_kinematic_viscosity(name: str) -> None:
    """m' = b h^3 dp/(12 nu l), pi d^4 dp/(128 nu l); 2e-5 for the bend's A_1 B_1 of 0.0066 at Re = 0.2."""
    part, given, mass_flow = LAMINAR[name]
    q = part.equations(p_a=HIGH, p_b=LOW, **given, fluid=OIL)["q"]
    assert q * RHO_0 == pytest.approx(mass_flow, rel=2e-5)


def test_edges_of_directional_valves_and_cushions() -> None:
    """Every edge of theirs is an orifice: m' = C_d A sqrt(2 rho dp)."""
    ports = {"p_supply": HIGH, "p_tank": LOW, "fluid": THIN}
    three = ThreeTwoValve(area=10e-6).equations(**ports, p_work=LOW, stroke=1.0)
    four = FourTwoValve(area=10e-6).equations(**ports, p_a=LOW, p_b=HIGH, stroke=1.0)
    proportional = FourThreeValve(area=10e-6).equations(**ports, p_a=HIGH, p_b=LOW, stroke=-1.0)
    cushion = Cushion(area=10e-6, remaining_area=1e-6, length=MM)
    flows = [
        three["q_in"], four["q_supply_a"], four["q_b_tank"], proportional["q_supply_b"], proportional["q_a_tank"],
        cushion.equations(p_chamber=HIGH, p_port=LOW, x_rod=5 * MM, fluid=THIN)["q"],
    ]  # fmt: skip
    assert np.array(flows) * RHO_0 == pytest.approx([ORIFICE] * 6, rel=1e-6)


def test_leakage_past_a_piston() -> None:
    """G dp of the oil at the mean of both chambers."""
    part = DoubleActingCylinder(
        piston_diameter=50 * MM, stroke=0.4, cap_dead_volume=1e-4, rod_dead_volume=1e-4, leakage_conductance=1e-12
    )
    found = part.equations(
        cap_pressure=HIGH, annulus_pressure=LOW, q_cap=0.0, q_annulus=0.0, x_rod=0.1, v_rod=0.0, fluid=OIL
    )
    assert found["leakage"] * RHO_0 == pytest.approx(DENSE * 1e-12 * 5 * BAR, rel=1e-12)


@pytest.mark.parametrize("part", [AnnularPort(diameter=5 * MM), RoundHoles(diameter=4 * MM)])
def test_a_jet_pushes_with_its_mass_flow_times_its_velocity(part: Any) -> None:
    """F = m' v cos 69 deg, v = sqrt(2 dp/rho) at 347.5 bar: 2 C_d A dp cos 69 deg at any density; 1e-6 for C_d."""
    found = part.equations(p_a=HIGH, p_b=LOW, x_rod=1 * MM, v_rod=0.0, fluid=THIN)
    force = RHO_0 * found["q"] * math.sqrt(2 * 5 * BAR / DENSE) * math.cos(math.radians(69))
    assert found["jet_force"] == pytest.approx(force, rel=1e-8)
    assert found["jet_force"] == pytest.approx(2 * 0.7 * found["area"] * 5 * BAR * math.cos(math.radians(69)), rel=1e-6)


def test_a_flapper_is_pushed_by_what_leaves_the_nozzle() -> None:
    """A_N dp (1 + 16 C_d^2 h^2/d^2) of Merritt, chapter 5, under 350 bar as under 5; C_d to 1e-9."""
    found = FlapperNozzle(diameter=2 * MM).equations(p_a=HIGH, p_b=LOW, x_rod=0.2 * MM, fluid=THIN)
    force = math.pi * MM**2 * 5 * BAR * (1 + 16 * 0.64**2 * 0.2**2 / 2**2)
    assert found["force"] == pytest.approx(force, rel=1e-8)


def test_a_volume_flow_is_referred_to_zero_gauge_pressure() -> None:
    """1 L/min at 140 bar are exp(0.01) L/min at 0 bar gauge of an oil of 14000 bar."""
    assert flow_laws.referred_flow(1.0, 140 * BAR, OIL) == pytest.approx(math.exp(0.01), rel=1e-12)


# -- the whole library -------------------------------------------------------------------------------------------------

EVERYWHERE = 2000 * BAR
"""Where the library is looked at: rho/rho_0 of 1.154."""


class Dense(Fluid):
    """The oil as it is at EVERYWHERE, at whatever pressure: rho_0 is its density there."""

    def density(self, p: Expr) -> Expr:
        return RHO_0 * math.exp(EVERYWHERE / BETA) + 0.0 * p

    def bulk_modulus(self, p: Expr) -> Expr:
        return BETA + 0.0 * p

    def kinematic_viscosity(self, p: Expr) -> Expr:
        return NU + 0.0 * p

    def enthalpy(self, p: Expr) -> Expr:
        return p / self.density(p)


TAKES = sorted(
    name for name, form in FORMS.items() if any(p.domain is HYDRAULIC and p.role == "takes" for p in form.ports())
)
"""Types whose equations give a flow."""
NO_LAW = {
    "energy_counter", "flow_sensor", "flow_source", "plug", "signal_flow_source", "volume_counter",
}  # fmt: skip
"""Types that pass on, impose or count a flow which is mass flow over rho_0 to begin with."""


def asks_for_a_fluid(name: str) -> bool:
    return bool(fluids_asked(FORMS[name]))


def test_what_has_a_law_of_flow_asks_for_the_fluid() -> None:
    """A flow out of pressures without a density would be the same number under 0 and 350 bar."""
    assert {name for name in TAKES if not asks_for_a_fluid(name)} <= NO_LAW


def seen(case: Case, flows: float) -> dict[str, Any]:
    """What the equations return at a random point about EVERYWHERE, all flows that are given times `flows`."""
    values = case.point(1)
    for name in values:
        values[name] = values[name] * (flows if case.quantities[name] is units.flow else 1.0)
    return case.numbers(values)


@pytest.mark.parametrize("name", [name for name in TAKES if asks_for_a_fluid(name)])
def test_flows_are_masses_over_rho_0(name: str) -> None:
    """Where all pressures are near 2000 bar, a part passes in mass what it passes of an oil of that density throughout.

    Flows are then rho/rho_0 = exp(1/7) times those, forces and torques the same. The pressures are within 1 bar, so
    densities within 1.5e-4.
    """
    settings = dict(SETTINGS.get(name, {}))
    if "line" in name or name.startswith("pipe_"):
        settings["loss_coefficient"] = 2e6  # so large that it counts beside the wave's impedance
    if "mean_pressure" in settings:
        settings["mean_pressure"] = EVERYWHERE
    part = sample(FORMS[name], settings)
    kind = Case(part, OIL)
    within = {
        variable: (EVERYWHERE - BAR, EVERYWHERE)
        for variable, quantity in kind.quantities.items()
        if quantity is units.pressure
    }
    ratio = math.exp(EVERYWHERE / BETA)
    found = seen(Case(part, OIL, within), ratio)
    dense = seen(Case(part, Dense(), within), 1.0)
    for key in (k for k in found if k.startswith(("q_", "f_", "torque_", "p_", "der_q"))):
        factor = ratio if key.startswith(("q_", "der_q")) else 1.0
        expected = np.asarray(dense[key], dtype=float) * factor
        size = float(np.max(np.abs(expected), initial=0.0))
        np.testing.assert_allclose(
            np.asarray(found[key], dtype=float), expected, rtol=3e-4, atol=3e-4 * size, err_msg=key
        )
