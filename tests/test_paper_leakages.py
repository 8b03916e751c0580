"""Equations 17 to 23 and 26 to 29 of Rundo & Corvaglia, Energies 2016, 9, 876, one by one, by the library's parts.

Each expected number is the paper's formula worked out with the pump's dimensions (SI, gauge), mu = 860 * 35e-6 =
0.0301 Pa s. The parts take density and viscosity from the fluid; an oil of 860 kg/m^3 that does not compress
makes them the paper's constants, so the tolerance is rounding, 1e-6, unless said otherwise.
"""

import math

import numpy as np
import pytest
from crescentlab.components.fluids import AeratedOil, SimpleOil
from crescentlab.components.gaps import AnnularGap, LaminarGap, VariableHeightGap, VariableWidthGap
from crescentlab.components.orifices import Orifice, VariableOrifice

from crescentlab.tables import Curve

BAR, LPM = 1e5, 1e-3 / 60
MU, RHO, NU = 0.0301, 860.0, 35e-6
OIL = SimpleOil(density=RHO, kinematic_viscosity=NU, bulk_modulus=1e15)
PUMP_OIL = AeratedOil(
    density=RHO, kinematic_viscosity=NU, bulk_modulus=1.4e9, air_fraction=0.005, saturation_pressure=1e8
)
COVER = Curve(x=(0.0, 3e5, 6e5, 8e5, 12e5), y=(0.0, 16e-6, 32e-6, 44e-6, 68e-6))
CHAMFER_TO = 1 * BAR
"""Pressure p' of the annular volume chosen for these checks."""

GAP_1A = VariableHeightGap(width="2.391 mm", height="0 mm", length="3.5 mm", parallel=5)
GAP_1B = VariableHeightGap(width="6.24 mm", height="0 mm", length="5.3625 mm", change_factor=0.75, parallel=5)
GAP_2A = Orifice(area=76.5e-6 * 2.391e-3, hydraulic_diameter=2 * 76.5e-6, cd_max=0.7, lambda_c=100, parallel=5)
GAP_2B = LaminarGap(width="8.218 mm", height="76.5 um", length="3 mm", parallel=5)
GAP_7 = AnnularGap(diameter="35 mm", clearance="40 um", length="8 mm", eccentricity=0.95)
GAP_9 = LaminarGap(width="13 mm", height="278 um", length="40 mm")
VALVE_HOLES = Orifice(area="15.5 mm2", cd_max=0.74, lambda_c=50)


def cd_of(drop: float, d_h: float, cd_max: float, lambda_c: float) -> float:
    """Eqs. 28 and 29 for 860 kg/m^3 and 35 cSt."""
    return cd_max * math.tanh(2 * d_h / NU * math.sqrt(2 * drop / RHO) / lambda_c)


def test_equation_17_cover_side_at_the_tooth_roots():
    """n_t b_1 (h_a1 + dh)^3 p_d/(12 mu l_1), n_t = 5, h_a1 = 0, dh(5 bar) = 26.667 um: 0.0053797 L/min."""
    q = GAP_1A.equations(p_a=5 * BAR, p_b=0.0, change=COVER(5 * BAR), fluid=OIL)["q"]
    assert q == pytest.approx(5 * 2.391e-3 * (0.0 + 26.6666667e-6) ** 3 * 5e5 / (12 * MU * 3.5e-3), rel=1e-6)
    assert q / LPM == pytest.approx(0.0053797, rel=1e-4)


def test_equation_18_cover_side_at_the_tooth_faces():
    """n_t b_4 (h_a1 + 0.75 dh)^3 p_d/(12 mu l_4), 0.75 dh(5 bar) = 20 um: 0.0038659 L/min."""
    q = GAP_1B.equations(p_a=5 * BAR, p_b=0.0, change=COVER(5 * BAR), fluid=OIL)["q"]
    assert q == pytest.approx(5 * 6.24e-3 * (0.0 + 20e-6) ** 3 * 5e5 / (12 * MU * 5.3625e-3), rel=1e-6)
    assert q / LPM == pytest.approx(0.0038659, rel=1e-4)


def test_equation_19_housing_side_at_the_tooth_roots():
    """C_d n_t h_a2 b_1 sqrt(2 (p_d - p')/rho), C_d = 0.69327 of Eqs. 28-29 at 4 bar (d_h = 2 h_a2): 1.16028 L/min."""
    q = GAP_2A.equations(p_a=5 * BAR, p_b=CHAMFER_TO, fluid=OIL)["q"]
    cd = cd_of(4e5, 2 * 76.5e-6, 0.7, 100)
    assert cd == pytest.approx(0.69327, abs=1e-5)
    assert q == pytest.approx(cd * 5 * 76.5e-6 * 2.391e-3 * math.sqrt(2 * 4e5 / RHO), rel=1e-6)
    assert q / LPM == pytest.approx(1.16028, rel=1e-5)


def test_equation_20_housing_side_at_the_tooth_faces():
    """n_t b_2 h_a2^3 (p_d - p')/(12 mu l_3): 0.407439 L/min."""
    q = GAP_2B.equations(p_a=5 * BAR, p_b=CHAMFER_TO, fluid=OIL)["q"]
    assert q == pytest.approx(5 * 8.218e-3 * 76.5e-6**3 / (12 * MU * 3e-3) * 4e5, rel=1e-6)
    assert q / LPM == pytest.approx(0.407439, rel=1e-5)


@pytest.mark.parametrize("exists", [1.0, 0.0])
def test_equation_21_trapped_volume_housing_side(exists):
    """C_d h_a2 b_1 sqrt(2 (p_t - p')/rho) for one tooth while the volume exists, else nothing: 0.232055 L/min."""
    gap = VariableOrifice(area=76.5e-6 * 2.391e-3, hydraulic_diameter=2 * 76.5e-6, cd_max=0.7, lambda_c=100)
    q = gap.equations(p_a=5 * BAR, p_b=CHAMFER_TO, opening=exists, fluid=OIL)["q"]
    cd = cd_of(4e5, 2 * 76.5e-6, 0.7, 100)
    assert q == pytest.approx(exists * cd * 76.5e-6 * 2.391e-3 * math.sqrt(2 * 4e5 / RHO), rel=1e-6)
    assert q / LPM == pytest.approx(exists * 0.232055, rel=1e-5)


@pytest.mark.parametrize("exists", [1.0, 0.0])
def test_equation_22_trapped_volume_cover_side(exists):
    """b_1 h_a1^3 p_t/(12 mu l_1) while it exists; with h_a1 = 30 um for a flow to compare: 0.00153196 L/min."""
    gap = VariableWidthGap(width="2.391 mm", height="30 um", length="3.5 mm")
    q = gap.equations(p_a=5 * BAR, p_b=0.0, opening=exists, fluid=OIL)["q"]
    assert q == pytest.approx(exists * 2.391e-3 * 30e-6**3 / (12 * MU * 3.5e-3) * 5e5, rel=1e-6)
    assert q / LPM == pytest.approx(exists * 0.00153196, rel=1e-5)


def test_equation_22_is_closed_at_zero_clearance():
    """The paper's h_a1 = 0 (gear pushed against the cover) lets nothing pass."""
    gap = VariableWidthGap(width="2.391 mm", height="0 mm", length="3.5 mm")
    assert gap.equations(p_a=5 * BAR, p_b=0.0, opening=1.0, fluid=OIL)["q"] == 0.0


def test_equations_21_and_22_for_carry_over_volumes():
    """Gaps 5 and 6: one orifice and one slot per volume, each with its own pressure, closed where none exists."""
    p, exists = np.array([5.0, 3.0, 2.0]) * BAR, np.array([1.0, 1.0, 0.0])
    gap_5 = VariableOrifice(
        area=76.5e-6 * 2.391e-3, hydraulic_diameter=2 * 76.5e-6, cd_max=0.7, lambda_c=100, count=3
    )  # fmt: skip
    gap_6 = VariableWidthGap(width="2.391 mm", height="30 um", length="3.5 mm", count=3)
    q_5 = gap_5.equations(p_a=p, p_b=CHAMFER_TO * np.ones(3), opening=exists, fluid=OIL)["q"]
    q_6 = gap_6.equations(p_a=p, p_b=np.zeros(3), opening=exists, fluid=OIL)["q"]
    for k, (drop, on) in enumerate([(4e5, 1), (2e5, 1), (1e5, 0)]):
        cd = cd_of(drop, 2 * 76.5e-6, 0.7, 100)
        assert q_5[k] == pytest.approx(on * cd * 76.5e-6 * 2.391e-3 * math.sqrt(2 * drop / RHO), rel=1e-6)
        assert q_6[k] == pytest.approx(on * 2.391e-3 * 30e-6**3 / (12 * MU * 3.5e-3) * p[k], rel=1e-6)


def test_equation_23_driving_collar():
    """pi R_i (1 + 1.5 eps^2) h_ri^3 p'/(6 mu l_2), eps = 0.95, h_ri radial: 0.0343931 L/min at 1 bar."""
    q = GAP_7.equations(p_a=CHAMFER_TO, p_b=0.0, fluid=OIL)["q"]
    assert q == pytest.approx(math.pi * 17.5e-3 * (1 + 1.5 * 0.95**2) * 40e-6**3 / (6 * MU * 8e-3) * 1e5, rel=1e-6)
    assert q / LPM == pytest.approx(0.0343931, rel=1e-5)


def test_equation_26_outer_gear_and_casing():
    """H h_re^3 p_d/(12 mu l_5): 0.579951 L/min at 5 bar."""
    q = GAP_9.equations(p_a=5 * BAR, p_b=0.0, fluid=OIL)["q"]
    assert q == pytest.approx(13e-3 * 278e-6**3 * 5e5 / (12 * MU * 40e-3), rel=1e-6)
    assert q / LPM == pytest.approx(0.579951, rel=1e-5)


@pytest.mark.parametrize(
    ("flow_number", "cd"), [(5, 0.146059), (12.5, 0.341966), (25, 0.563580), (50, 0.713380), (200, 0.74)]
)
def test_equations_27_to_29_discharge_coefficient(flow_number, cd):
    """C_d = 0.74 tanh(2 lambda/50) (Fig. 12), recovered as Q/(A sqrt(2 p/rho)); 1e-6 for the diameter's rounding."""
    d_h = math.sqrt(4 * 15.5e-6 / math.pi)
    drop = RHO / 2 * (flow_number * NU / d_h) ** 2
    q = VALVE_HOLES.equations(p_a=drop, p_b=0.0, fluid=OIL)["q"]
    assert q / (15.5e-6 * math.sqrt(2 * drop / RHO)) == pytest.approx(0.74 * math.tanh(2 * flow_number / 50), rel=1e-6)
    assert q / (15.5e-6 * math.sqrt(2 * drop / RHO)) == pytest.approx(cd, abs=2e-6)


def test_equation_27_turbulent_flow_through_the_valve():
    """0.74 * 15.5 mm^2 * sqrt(2 * 8 bar/860) = 29.684 L/min, the valve's 30 L/min near 8 bar."""
    q = VALVE_HOLES.equations(p_a=8 * BAR, p_b=0.0, fluid=OIL)["q"]
    assert q / LPM == pytest.approx(29.684, abs=1e-3)


def test_density_of_the_pump_oil_changes_leakages_little():
    """With aerated oil density and viscosity at the mean pressure differ from 860 by 0.5 % air: within 0.6 %."""
    constant, aerated = (
        [
            GAP_1A.equations(p_a=5 * BAR, p_b=0.0, change=COVER(5 * BAR), fluid=fluid)["q"],
            GAP_2A.equations(p_a=5 * BAR, p_b=CHAMFER_TO, fluid=fluid)["q"],
            GAP_2B.equations(p_a=5 * BAR, p_b=CHAMFER_TO, fluid=fluid)["q"],
            GAP_7.equations(p_a=CHAMFER_TO, p_b=0.0, fluid=fluid)["q"],
            GAP_9.equations(p_a=5 * BAR, p_b=0.0, fluid=fluid)["q"],
        ]
        for fluid in (OIL, PUMP_OIL)
    )
    assert aerated == pytest.approx(constant, rel=6e-3)
