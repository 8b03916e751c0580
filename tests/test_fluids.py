"""Oil laws against the numbers of the crescent pump and against their own definition of the bulk modulus."""

import math
import re
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from building import circuit
from crescentlab.components.cavitating_fluids import CavitatingOil, MineralOil, Water
from crescentlab.components.fluids import AeratedOil, SimpleOil
from crescentlab.components.oil_grades import GRADES
from crescentlab.components.viscosity_laws import walther_viscosity, wooster_coefficient
from hypothesis import given, settings
from hypothesis import strategies as st
from refusing import OIL as SIMPLE
from refusing import Refusal, edited

from crescentlab.fluid import Fluid
from crescentlab.symbols import Sym
from crescentlab.trace import numeric_fields, symbolic_copy

BAR = 1e5
P_ATM = 101325.0
OIL = {"density": "860 kg/m^3", "kinematic_viscosity": "35 cSt", "bulk_modulus": "14000 bar"}
PUMP_OIL = AeratedOil(**OIL, air_fraction="0.5 %", saturation_pressure="1000 bar")
SOON_SATURATED = AeratedOil(**OIL, air_fraction="5 %", saturation_pressure="5 bar")
CAVITATING = CavitatingOil(**OIL, vapour_pressure="10 mbar")
FOAMING = CavitatingOil(**OIL, vapour_pressure="0.1 bar", air_fraction="2 %", saturation_pressure="5 bar")
REAL = [MineralOil(grade=grade, temperature="60 degC") for grade in GRADES] + [Water(), Water(temperature="80 degC")]
ALL = [SimpleOil(**OIL), PUMP_OIL, SOON_SATURATED, CAVITATING, FOAMING, *REAL]


@pytest.mark.parametrize(("gauge", "beta"), [(3, 2460), (4, 3331), (6, 4994)])
def test_bulk_modulus_of_the_pump(gauge, beta):
    """Bulk modulus [bar] at gauge pressures [bar], 0.5 % air, 1000 bar saturation; printed to 1 bar, 2460 to 10."""
    found = PUMP_OIL.bulk_modulus(gauge * BAR) / BAR
    assert found == pytest.approx(beta, abs=5 if beta == 2460 else 0.5)


@pytest.mark.parametrize(("gauge", "beta"), [(3.6, 3000), (7.35, 6000)])
def test_bulk_modulus_of_figure_20(gauge, beta):
    """Rundo & Corvaglia (2016), Fig. 20: 3000 to 6000 bar over the pump's range, rounded to 1 %."""
    assert PUMP_OIL.bulk_modulus(gauge * BAR) / BAR == pytest.approx(beta, rel=0.01)


@pytest.mark.parametrize(("gauge", "speed"), [(0, 180), (6, 762), (9, 907)])
def test_wave_speed_of_the_pump(gauge, speed):
    """Wave speed sqrt(beta/rho) [m/s], printed to 1 m/s."""
    p = gauge * BAR
    assert math.sqrt(PUMP_OIL.bulk_modulus(p) / PUMP_OIL.density(p)) == pytest.approx(speed, abs=0.5)


def test_aerated_density_by_hand():
    """860/rho = exp(-p/14000 bar) + (0.005/0.995) x (P_atm/P)^(1/1.4) at 4 bar, x linear; rounding under 1e-8."""
    P = 4 * BAR + P_ATM
    share = (1000 * BAR - P) / (1000 * BAR - P_ATM)
    volume = math.exp(-4 / 14000) + 0.005 / 0.995 * share * (P_ATM / P) ** (1 / 1.4)
    assert PUMP_OIL.density(4 * BAR) == pytest.approx(860 / volume, rel=1e-8)


def test_air_fraction_is_gas_volume_over_total_volume():
    """At 0 bar gauge the liquid fills all but the air fraction, so rho = 0.995 rho_liquid; rounding 4e-9."""
    assert PUMP_OIL.rho_0 == pytest.approx(0.995 * 860, rel=1e-8)


@pytest.mark.parametrize("fluid", [PUMP_OIL, SOON_SATURATED, SimpleOil(**OIL)])
def test_bulk_modulus_is_rho_dp_over_drho(fluid):
    """beta equals rho/(d rho/dp) of the density's exact derivative, from far below zero to above saturation."""
    p = ca.SX.sym("p")
    slope = ca.Function("slope", [p], [ca.jacobian(fluid.density(Sym(p)).sx, p)])
    for gauge in [-5, -1.5, -1.01325, -1.0132, -1, -0.5, 0, 1, 3.95, 3.97, 3.98675, 5, 100, 990, 995, 1000, 2000]:
        beta = fluid.density(gauge * BAR) / float(slope(gauge * BAR))
        assert fluid.bulk_modulus(gauge * BAR) == pytest.approx(beta, rel=1e-9)


@pytest.mark.parametrize("fluid", [PUMP_OIL, SOON_SATURATED])
def test_density_rises_with_pressure_and_bulk_modulus_is_positive(fluid):
    """Also below absolute zero, where integrators try states."""
    wide, near, high = np.linspace(-20, 20, 40001), np.linspace(-1.1, -0.9, 20001), np.linspace(20, 1500, 10001)
    p = np.unique(np.round(np.concatenate([wide, near, high]), 6)) * BAR
    rho, beta = fluid.density(p), fluid.bulk_modulus(p)
    assert np.all(np.isfinite(beta))
    assert np.all(beta > 0)
    assert np.all(rho > 0)
    assert np.all(np.diff(rho) > 0)


@pytest.mark.parametrize("gauge", [-1e6, -1e3, -1.01325, -1.0, 0.0, 998.98675, 1e5])
def test_derivatives_are_finite(gauge):
    """Jacobians of density and bulk modulus at trial states, at zero absolute pressure and at saturation."""
    p = ca.SX.sym("p")
    laws = ca.vertcat(PUMP_OIL.density(Sym(p)).sx, PUMP_OIL.bulk_modulus(Sym(p)).sx)
    values = ca.Function("laws", [p], [laws, ca.jacobian(laws, p)])(gauge * BAR)
    assert all(np.all(np.isfinite(np.array(v))) for v in values)


def test_pure_liquid_above_saturation():
    """From the saturation pressure on (5 bar absolute) the law is that of the air-free oil, exactly."""
    for gauge in [3.98675, 4.5, 50]:
        assert SOON_SATURATED.density(gauge * BAR) == pytest.approx(SimpleOil(**OIL).density(gauge * BAR), rel=1e-14)
        assert SOON_SATURATED.bulk_modulus(gauge * BAR) == pytest.approx(14000 * BAR, rel=1e-12)


def test_bulk_modulus_is_continuous_at_saturation():
    """beta climbs to the liquid's within the rounding: at steps of 0.1 Pa by at most 1 %; bare it jumps by 98 %."""
    beta = SOON_SATURATED.bulk_modulus(np.linspace(3.9, 4.0, 100001) * BAR)
    assert beta[-1] / beta[0] > 50
    assert np.max(np.abs(np.diff(beta))) < 0.01 * 14000 * BAR


def test_minimum_pressure_does_not_touch_working_pressures():
    """Rounding 100 Pa against 1 Pa at 0 bar gauge: (100/101325)^2 = 1e-6 of the gas share, 2e-6 on beta."""
    sharp = AeratedOil(**OIL, air_fraction="0.5 %", saturation_pressure="1000 bar", minimum_pressure="1 Pa")
    assert PUMP_OIL.bulk_modulus(0.0) == pytest.approx(sharp.bulk_modulus(0.0), rel=3e-6)


def test_simple_oil():
    """rho = 860 exp(p/beta): 860.614 at 10 bar and 14 000 bar; beta and nu are constant; mu = rho nu."""
    oil = SimpleOil(**OIL)
    assert oil.density(10 * BAR) == pytest.approx(860.6145, abs=1e-4)
    assert oil.bulk_modulus(10 * BAR) == 14000 * BAR
    assert oil.dynamic_viscosity(10 * BAR) == pytest.approx(860.6145 * 35e-6, rel=1e-6)
    assert oil.rho_0 == 860.0


def test_saturation_below_the_atmosphere_is_refused():
    """A saturation pressure meant as gauge is caught."""
    with pytest.raises(ValueError, match="absolute and must exceed the atmospheric pressure"):
        AeratedOil(**OIL, air_fraction="0.5 %", saturation_pressure="0.5 bar")


def test_vectors():
    """A vector of pressures gives a vector of each law."""
    p = np.array([0.0, 4.0, 6.0]) * BAR
    for fluid in (PUMP_OIL, SimpleOil(**OIL)):
        for law in (fluid.density, fluid.bulk_modulus, fluid.kinematic_viscosity):
            assert np.shape(law(p)) == (3,)


# -- every fluid -------------------------------------------------------------------------------------------------------

PRESSURES = st.one_of(st.floats(-1.2e5, 1e5), st.floats(-5e3, 5e3).map(lambda p: p - P_ATM), st.floats(0, 3e8))
"""Gauge: about the atmosphere, within 50 mbar of absolute zero on both sides, and working pressures."""


def slope_of(fluid: Fluid) -> ca.Function:
    """Density and its exact derivative."""
    p = ca.SX.sym("p")
    rho = fluid.density(Sym(p)).sx
    return ca.Function("slope", [p], [rho, ca.jacobian(rho, p)])


SLOPES = {id(fluid): slope_of(fluid) for fluid in ALL}


@pytest.mark.parametrize("fluid", ALL, ids=lambda f: type(f).__name__)
@given(p=PRESSURES)
@settings(deadline=None)
def test_bulk_modulus_follows_from_the_density(fluid, p):
    """beta = rho dp/drho by the density's exact derivative at random pressures; density positive, rising, finite."""
    rho, slope = (float(v) for v in SLOPES[id(fluid)](p))
    assert fluid.density(p) == pytest.approx(rho, rel=1e-12)
    assert rho > 0
    assert slope > 0
    assert fluid.bulk_modulus(p) == pytest.approx(rho / slope, rel=1e-9)
    assert 0 < fluid.kinematic_viscosity(p) < math.inf


@pytest.mark.parametrize("fluid", ALL, ids=lambda f: type(f).__name__)
def test_laws_on_symbols(fluid):
    """With its parameters symbolic a fluid gives the numbers of the plain one, and finite derivatives everywhere."""
    names = numeric_fields(type(fluid), fluid)
    p, parameters = ca.SX.sym("p"), ca.SX.sym("f", len(names))
    made = symbolic_copy(fluid, names, {n: Sym(parameters[k]) for k, n in enumerate(names)})
    laws = ca.vertcat(*[law(Sym(p)).sx for law in (made.density, made.bulk_modulus, made.kinematic_viscosity)])
    function = ca.Function("laws", [p, parameters], [laws, ca.jacobian(laws, ca.vertcat(p, parameters))])
    numbers = np.array([float(getattr(fluid, n)) for n in names])
    for gauge in (-1e9, -2 * BAR, -P_ATM, -1.003 * BAR, -0.9 * BAR, 0.0, 5 * BAR, 300 * BAR, 1e9):
        values, derivatives = function(gauge, numbers)
        plain = [fluid.density(gauge), fluid.bulk_modulus(gauge), fluid.kinematic_viscosity(gauge)]
        if abs(gauge) < 1e9:
            np.testing.assert_allclose(np.array(values).ravel(), plain, rtol=1e-9)
        assert np.all(np.isfinite(np.array(derivatives))), gauge


# -- vapour ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("absolute", "share"), [(1500.0, 0.0), (1000.0, 0.5), (400.0, 1.0)])
def test_share_of_vapour(absolute, share):
    """None from P_v (1 + s) on, half at P_v, all below P_v (1 - s), there 0.02 kg/m^3 P/P_v; rounding (10 Pa/P)^2."""
    liquid = 860 * math.exp((absolute - P_ATM) / 1.4e9)
    rho = (1 - share) * liquid + share * 0.02 * absolute / 1000
    assert CAVITATING.density(absolute - P_ATM) == pytest.approx(rho, rel=1e-3)


def test_vapour_does_not_touch_working_pressures():
    """Above the range of evaporation the law is that of the oil without it, exactly."""
    for gauge in (-0.98, 0.0, 300.0):
        assert CAVITATING.density(gauge * BAR) == pytest.approx(SimpleOil(**OIL).density(gauge * BAR), rel=1e-14)
        assert CAVITATING.bulk_modulus(gauge * BAR) == pytest.approx(1.4e9, rel=1e-12)


VOLUME = {
    "law": {"type": "sine", "amplitude": "-6 L/min", "frequency": "5 Hz"},
    "pump": {"type": "signal_flow_source"},
    "volume": {"type": "capacity", "volume": "100 cm^3", "start": {"p": "5 bar"}},
}
CYCLE = {"n": ["pump.port", "volume.port"], "s": ["law.y", "pump.flow"]}


@pytest.mark.parametrize(
    "fluid",
    [
        {"type": "cavitating_oil", **OIL, "vapour_pressure": "10 mbar"},
        {"type": "mineral_oil", "grade": "ISO VG 46"},
        {"type": "water", "temperature": "60 degC", "air_fraction": "1 %"},
    ],
    ids=lambda f: f["type"],
)
@pytest.mark.parametrize("solver", ["auto", "radau"])
def test_mass_is_kept_through_cavitation(fluid, solver):
    """6.4 of 100 cm^3 drawn off 5 bar and given back, three times: the ledger to 1e-6, and 5 bar again to 2 %.

    2 % of 5 bar are 7e-6 of the volume, what 1e-9 of an absolute tolerance of 1 bar is where 1000 Pa evaporate it all.
    """
    made = circuit(components=VOLUME, nets=CYCLE, fluid=fluid, simulation={"stop": "600 ms", "rtol": "1e-9"})
    result = made.simulate(solver=solver)
    assert not result.trajectory.warnings
    assert -P_ATM < result["volume.p"].min() < -0.7 * BAR
    left = result["volume.content"].min() / result["volume.content"][0]
    assert left == pytest.approx(1 - 0.0637, abs=1e-3)  # 6.37 cm^3 of 100 at 0 bar; compression 4e-4, more with air
    assert result.balance.circuit < 1e-6
    for time in (0.2, 0.4, 0.6):
        assert np.interp(time, result.time, result["volume.p"]) == pytest.approx(5 * BAR, rel=0.02)


def test_a_volume_drawn_half_empty():
    """Half of the volume vapour: the pressure stays in the range of evaporation, at P_v where it is just a half."""
    parts = {**VOLUME, "pump": {"type": "flow_source", "flow": "-6 L/min"}}
    del parts["law"]
    fluid = {"type": "cavitating_oil", **OIL, "vapour_pressure": "10 mbar"}
    nets = {"n": ["pump.port", "volume.port"]}
    half = 100e-6 * (math.exp(5 * BAR / 1.4e9) - 0.5 * math.exp(-1e5 / 1.4e9)) / 1e-4
    made = circuit(components=parts, nets=nets, fluid=fluid, simulation={"stop": f"{half} s", "rtol": "1e-9"})
    result = made.simulate()
    assert result["volume.p"][-1] + P_ATM == pytest.approx(1000.0, abs=0.5)
    assert result.balance.circuit < 1e-6


# -- real fluids -------------------------------------------------------------------------------------------------------


def test_a_grade_in_a_circuit():
    """What a user writes; a new temperature needs no new equations, a new grade does nothing else either."""
    parts = {
        "pump": {"type": "pressure_source", "pressure": "10 bar"}, "tank": {"type": "tank"},
        "gap": {"type": "laminar_gap", "width": "10 mm", "height": "20 um", "length": "20 mm"},
    }  # fmt: skip
    nets = {"a": ["pump.port", "gap.a"], "b": ["gap.b", "tank.port"]}
    fluid = {"type": "mineral_oil", "grade": "ISO VG 46", "temperature": "40 degC", "air_fraction": "0 %"}
    made = circuit(components=parts, nets=nets, fluid=fluid, simulation={"stop": "1 s"})
    cold, hot = (made.simulate(parameters={"fluid.temperature": f"{t} degC"})["gap.q"][-1] for t in (40, 100))
    thin, thick = (MineralOil(grade="ISO VG 46", temperature=f"{t} degC", air_fraction=0.0) for t in (100, 40))
    cold_oil, hot_oil = (o.kinematic_viscosity(5 * BAR) * o.rho_0 for o in (thick, thin))  # q = b h3 dp/(12 nu l rho_0)
    assert hot / cold == pytest.approx(cold_oil / hot_oil, rel=1e-9)
    assert hot / cold == pytest.approx(46 / 6.7 * 1.05, rel=0.01)  # 5 % of density in 60 K
    other = made.simulate(parameters={"fluid.grade": "ISO VG 68"})["gap.q"][-1]
    assert cold / other == pytest.approx(68 * 886 / (46 * 879), rel=0.01)


def test_own_values_win_over_the_grade():
    """A data sheet's viscosities replace the grade's, density and the rest stay."""
    own = MineralOil(grade="ISO VG 46", viscosity_1="44 cSt", viscosity_2="6.5 cSt")
    assert own.kinematic_viscosity(0.0) == pytest.approx(44e-6, rel=1e-12)
    assert own.density_15 == 879.0
    assert MineralOil(grade="ISO VG 46", density_15="870 kg/m^3").kinematic_viscosity(0.0) == pytest.approx(46e-6)


MISTAKES = {
    "unknown grade": (
        "grade: ISO VG 47",
        "fluid.grade must be 'ISO VG 32', 'ISO VG 46', 'ISO VG 68', 'SAE 15W-40' or 'ATF', not 'ISO VG 47'",
    ),
    "half a line": ("grade: ISO VG 46, viscosity_1: 44 cSt", "fluid.viscosity_2 is missing"),
    "neither grade nor values": ("temperature: 40 degC", "fluid.density_15 is missing"),
    "thicker when hot": (
        "grade: ISO VG 46, viscosity_1: 6 cSt, viscosity_2: 46 cSt",
        "the oil must be thinner at the hotter of temperature_1 and temperature_2",
    ),
    "boiling": ("grade: ISO VG 46, vapour_pressure: 0.9 bar", "the fluid would be vapour at 0 bar gauge"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_mistakes_in_a_mineral_oil(refused: Refusal, mistake: str):
    """Told at the fluid's line, with what to write."""
    fluid, expected = MISTAKES[mistake]
    said = refused(edited((SIMPLE, f"fluid: {{type: mineral_oil, {fluid}}} <--")))
    assert expected in said


def test_boiling_water_is_refused():
    """At 95 degC the range of evaporation would reach the atmosphere; a narrower one is accepted."""
    with pytest.raises(ValueError, match="the fluid would be vapour at 0 bar gauge"):
        Water(temperature="95 degC")
    assert Water(temperature="95 degC", vapour_range="0.1").rho_0 == pytest.approx(961.9, abs=0.1)


@pytest.mark.parametrize("fluid", REAL, ids=lambda f: type(f).__name__)
def test_hot_fluids_are_thinner_and_lighter(fluid):
    """Every 10 K, from 20 degC on: less viscosity, less density; oils become softer."""
    made = [fluid.model_copy(update={"temperature": 273.15 + t}) for t in range(20, 90, 10)]
    assert np.all(np.diff([f.kinematic_viscosity(0.0) for f in made]) < 0)
    assert np.all(np.diff([f._liquid_density() for f in made]) < 0)
    if isinstance(fluid, MineralOil):
        assert np.all(np.diff([f.bulk_modulus(300 * BAR) for f in made]) < 0)


def test_walther_goes_through_its_points():
    """Exactly at both points, in either order, and between them in between."""
    for points in [(313.15, 46e-6, 373.15, 6.7e-6), (373.15, 6.7e-6, 313.15, 46e-6)]:
        assert walther_viscosity(313.15, *points) == pytest.approx(46e-6, rel=1e-12)
        assert walther_viscosity(373.15, *points) == pytest.approx(6.7e-6, rel=1e-12)
        assert 6.7e-6 < walther_viscosity(340.0, *points) < 46e-6


@pytest.mark.parametrize(("mu", "alpha"), [(10e-3, 1.565e-8), (100e-3, 2.53e-8)])
def test_wooster(mu, alpha):
    """(0.6 + 0.965 log10 mu) 1e-8: 10 mPa s 1.565e-8, 100 mPa s 2.53e-8 1/Pa."""
    assert wooster_coefficient(mu) == pytest.approx(alpha, rel=1e-12)


def test_a_liquids_viscosity_ignores_bubbles():
    """Barus acts on the dynamic viscosity of the liquid: exp(alpha p) without air, the same nu with it."""
    oil = MineralOil(grade="ISO VG 32", air_fraction=0.0, pressure_viscosity="20 1/GPa")
    assert oil.dynamic_viscosity(5e7) / oil.dynamic_viscosity(0.0) == pytest.approx(math.exp(1.0), rel=1e-12)
    airy = MineralOil(grade="ISO VG 32", air_fraction=0.05, pressure_viscosity="20 1/GPa")
    assert airy.kinematic_viscosity(2e5) == pytest.approx(oil.kinematic_viscosity(2e5), rel=1e-12)


# -- the manual --------------------------------------------------------------------------------------------------------


def rows_of_the_manual() -> list[list[str]]:
    """The table of docs/fluids.md, cell by cell."""
    page = (Path(__file__).parents[1] / "docs" / "fluids.md").read_text(encoding="utf-8")
    lines = re.findall(r"^\| (.+? \| \d+ °C .+) \|$", page, re.MULTILINE)
    return [[cell.strip() for cell in line.split("|")] for line in lines]


@pytest.mark.parametrize("row", rows_of_the_manual(), ids=lambda row: f"{row[0]} {row[1]}")
def test_the_table_of_the_manual(row):
    """To the digits printed."""
    name, at, *numbers = row
    temperature = f"{at.split()[0]} degC"
    fluid = Water(temperature=temperature) if name == "water" else MineralOil(grade=name, temperature=temperature)
    found = [
        f"{fluid._liquid_density():.1f}", f"{fluid.kinematic_viscosity(0.0) * 1e6:.3g}",
        f"{fluid.kinematic_viscosity(2e7) * 1e6:.3g}", f"{fluid.bulk_modulus(5e5) / BAR:.0f}",
        f"{fluid.bulk_modulus(2e7) / BAR:.0f}",
    ]  # fmt: skip
    assert found == numbers


def test_the_manual_lists_every_grade():
    """At three temperatures each, and water."""
    assert {row[0] for row in rows_of_the_manual()} == {*GRADES, "water"}
    assert len(rows_of_the_manual()) == 3 * (len(GRADES) + 1)


@pytest.mark.parametrize("air", ["0 %", "10 %"])
def test_bubbles_do_not_thin_the_oil(air):
    """mu(p) is the liquid's, mu_0 e^{alpha p}, however much air there is: that of ISO VG 46 at 40 degC by hand."""
    oil = MineralOil(grade="ISO VG 46", air_fraction=air, pressure_viscosity="2e-8 1/Pa")
    liquid = MineralOil(grade="ISO VG 46", air_fraction="0 %").density(0.0)
    for p in (-0.5 * BAR, 0.0, 300 * BAR):
        assert oil.dynamic_viscosity(p) == pytest.approx(46e-6 * liquid * math.exp(2e-8 * p), rel=1e-9)
