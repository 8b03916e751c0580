"""Cylinders and cushions: signs, stops, leakage, conservation, and a load that is stopped softly."""

import math

import numpy as np
import pytest
from building import circuit
from crescentlab.components.cylinders import Cushion, DoubleActingCylinder, SingleActingCylinder
from crescentlab.components.fluids import AeratedOil, SimpleOil
from pydantic import ValidationError

from crescentlab.contract import Case, check_energy
from crescentlab.errors import SimulationError

BAR, LPM = 1e5, 1e-3 / 60
OIL = SimpleOil(density=850.0, kinematic_viscosity=30e-6, bulk_modulus=1.4e9)
FLUID = {"type": "simple_oil", "density": "850 kg/m^3", "kinematic_viscosity": "30 cSt", "bulk_modulus": "1.4 GPa"}
AERATED = AeratedOil(
    density=850.0, kinematic_viscosity=30e-6, bulk_modulus=1.4e9, air_fraction=0.005, saturation_pressure=1e8
)
SIZES = {
    "piston_diameter": 0.05, "rod_diameter": 0.03, "stroke": 0.4, "cap_dead_volume": 50e-6, "rod_dead_volume": 40e-6,
}  # fmt: skip
CYLINDER = {
    "type": "double_acting_cylinder", "piston_diameter": "50 mm", "rod_diameter": "30 mm", "stroke": "400 mm",
    "cap_dead_volume": "50 cm^3", "rod_dead_volume": "40 cm^3",
}  # fmt: skip
CAP, RING = math.pi / 4 * 0.05**2, math.pi / 4 * (0.05**2 - 0.03**2)


def now(part, x=0.1, v=0.0, p=(0.0, 0.0), q=(0.0, 0.0)):
    """A double-acting cylinder's equations."""
    return part.equations(
        cap_pressure=p[0], annulus_pressure=p[1], q_cap=q[0], q_annulus=q[1], x_rod=x, v_rod=v, fluid=OIL
    )


def test_extending_rod_squeezes_the_ring_and_relieves_the_cap():
    """dp = -+ beta A v/V at zero gauge pressure and no flow."""
    got = now(DoubleActingCylinder(**SIZES), v=0.2)
    assert got["der_cap_pressure"] == pytest.approx(-1.4e9 * CAP * 0.2 / (50e-6 + CAP * 0.1), rel=1e-12)
    assert got["der_annulus_pressure"] == pytest.approx(1.4e9 * RING * 0.2 / (40e-6 + RING * 0.3), rel=1e-12)


def test_leakage_goes_from_high_to_low():
    """It leaves the cap's chamber and enters the rod's, by the same amount, and turns with the pressures."""
    part = DoubleActingCylinder(**SIZES, leakage_conductance=1e-12)
    got, back = now(part, p=(50 * BAR, 10 * BAR)), now(part, p=(10 * BAR, 50 * BAR))
    assert got["leakage"] == pytest.approx(4e-6 * math.exp(30e5 / 1.4e9))  # G dp at 30 bar, as mass over rho_0
    assert got["leakage"] == -back["leakage"]
    assert got["der_cap_pressure"] < 0 < got["der_annulus_pressure"]


@pytest.mark.parametrize(("x", "sign"), [(-1e-5, 1.0), (0.40001, -1.0), (0.2, 0.0)])
def test_stops_push_back_only_beyond_the_stroke(x, sign):
    """k times the depth of 10 um at either end, nothing between; the force on the rod's mass is f_rod reversed."""
    part = DoubleActingCylinder(**SIZES, stop_stiffness=1e8)
    got = now(part, x=x)
    assert got["stop_force"] == pytest.approx(sign * 1e3, rel=1e-9)
    assert got["f_rod"] == -got["force"] == -got["stop_force"]
    single = SingleActingCylinder(piston_diameter=0.05, stroke=0.4, dead_volume=50e-6, stop_stiffness=1e8)
    got = single.equations(pressure=0.0, q_cap=0.0, x_rod=x, v_rod=0.0, fluid=OIL)
    assert got["stop_force"] == pytest.approx(sign * 1e3, rel=1e-9)


def test_stops_never_pull():
    """Leaving a stop faster than its damping allows, the force ends at zero."""
    part = DoubleActingCylinder(**SIZES)
    assert now(part, x=-1e-4, v=5.0)["stop_force"] == 0
    assert now(part, x=0.4001, v=-5.0)["stop_force"] == 0


@pytest.mark.parametrize("fluid", [OIL, AERATED], ids=["simple", "aerated"])
@pytest.mark.parametrize("x", [(-2e-4, 0.0), (0.01, 0.39), (0.4, 0.4002)])
def test_what_enters_is_stored_or_lost(x, fluid):
    """In both stops, also as the piston leaves faster than their damping allows, and between; with all that it has."""
    law = {"viscous_friction": 300.0, "stop_stiffness": 1e8, "restitution": 0.5, "impact_velocity": 0.1}
    double = DoubleActingCylinder(**SIZES, **law, cap_rod_diameter=0.02, leakage_conductance=1e-12)
    single = SingleActingCylinder(
        piston_diameter=0.05, stroke=0.4, dead_volume=50e-6, preload=500.0, spring_stiffness=2e3, **law
    )
    for part in (double, single):
        check_energy(Case(part, fluid, {"x_rod": x, "v_rod": (-1.0, 1.0)}))
        check_energy(Case(part, fluid, {"x_rod": x, "v_rod": (-0.05, 0.05)}))


def test_stop_gives_back_what_it_does_not_lose():
    """Driven into its low stop by 0.1 mm and out again at 0.05 m/s: lost k d^2/2 a v in, as much out, a = 14.3275 s/m,
    root of w - ln(1 + w) = -w/2 - ln(1 - w/2), w = a 0.1 m/s."""
    parts = {
        "cylinder": {"type": "single_acting_cylinder", "piston_diameter": "40 mm", "stroke": "100 mm",
                     "dead_volume": "20 cm^3"},
        "hand": {"type": "motion_source", "velocity": "-50 mm/s"},
        "vent": {"type": "atmospheric_vent"},
        "way": {"type": "orifice", "area": "1 m^2"},
    }  # fmt: skip
    nets = {"p": ["cylinder.cap", "way.a"], "r": ["hand.port", "cylinder.rod"], "v": ["way.b", "vent.port"]}
    lost = 1e8 * 1e-4**2 / 2 * 14.3275052 * 0.05
    for velocity, start, held in (("-50 mm/s", "0 mm", 1.0), ("50 mm/s", "-0.1 mm", -1.0)):
        changed = {"hand.velocity": velocity, "hand.position": start}
        run = circuit(components=parts, nets=nets, fluid=FLUID, simulation={"stop": "2 ms"}).simulate(
            parameters=changed, rtol=1e-9
        )
        energy = run.balance.energy
        assert energy.dissipated["cylinder"] == pytest.approx(lost, rel=1e-6)
        assert energy.stored == pytest.approx(held * 0.5, rel=1e-4)  # the oil holds next to nothing
        assert max(energy.components.values()) < 1e-8


def test_rod_through_both_ends_is_symmetric():
    """Equal rods: turned round, the force turns round."""
    sizes = SIZES | {"cap_rod_diameter": 0.03, "rod_dead_volume": 50e-6}
    there = now(DoubleActingCylinder(**sizes), x=0.1, p=(7e6, 2e6))
    back = now(DoubleActingCylinder(**sizes), x=0.3, p=(2e6, 7e6))
    assert there["force"] == pytest.approx(-back["force"])
    assert there["content"] == pytest.approx(back["content"])


def test_thick_rod_is_refused():
    """The ring would have no area; the message names the rod that is meant."""
    with pytest.raises(ValidationError, match=r"cap_rod_diameter \(60 mm\) must be smaller than piston_diameter"):
        DoubleActingCylinder(**SIZES, cap_rod_diameter=0.06)


def test_differential_speeds_and_stop():
    """20 L/min into the cap: v = q/A1, A2/A1 of it leaves the ring; at the stop the pressure reaches the relief's.

    The mass rests on the stop, pressed on with p A: 100 bar and 1e8 N/m are 0.196 mm. Steady speed to 0.1 %: the
    oil's compression at a few bar.
    """
    parts = {
        "pump": {"type": "flow_source", "flow": "20 L/min"},
        "relief": {"type": "laminar_gap", "width": "100 mm", "height": "0.1 mm", "length": "10 mm"},
        "cylinder": CYLINDER | {"start": {"cap_pressure": "5 bar"}},
        "load": {"type": "mass", "mass": "50 kg", "start": {"x": "300 mm", "v": "165 mm/s"}},
        "friction": {"type": "damper", "coefficient": "5000 N s/m"},
        "back": {"type": "orifice", "area": "30 mm^2"},
        "tank": {"type": "tank"},
        "top": {"type": "pressure_source", "pressure": "0 bar"},
    }
    nets = {
        "cap": ["pump.port", "cylinder.cap", "relief.a"],
        "ring": ["cylinder.annulus", "back.a"],
        "rod": ["load.port", "cylinder.rod", "friction.rod"],
        "t": ["back.b", "tank.port"],
        "t2": ["relief.b", "top.port"],
    }
    run = circuit(components=parts, nets=nets, fluid=FLUID, simulation={"stop": "900 ms"}).simulate(rtol=1e-8)
    steady = np.searchsorted(run.time, 0.4)
    v, leak = run["load.v"][steady], run["relief.q"][steady]
    assert v == pytest.approx((20 * LPM - leak) / CAP, rel=1e-3)
    assert run["back.q"][steady] == pytest.approx(RING * v, rel=1e-3)
    assert run["load.x"][-1] == pytest.approx(0.4 + run["cylinder.cap_pressure"][-1] * CAP / 1e8, rel=1e-6)
    assert run["load.v"][-1] == pytest.approx(0.0, abs=1e-6)
    assert run.balance.circuit < 1e-6
    assert max(run.balance.energy.components.values()) < 1e-6


def test_spring_returns_the_single_acting_cylinder():
    """With its port open the piston comes back to its low stop and rests there under the preload, F_0/k_stop deep."""
    parts = {
        "cylinder": {"type": "single_acting_cylinder", "piston_diameter": "40 mm", "stroke": "100 mm",
                     "dead_volume": "20 cm^3", "preload": "500 N", "spring_stiffness": "2 N/mm",
                     "viscous_friction": "2000 N s/m"},
        "load": {"type": "mass", "mass": "5 kg", "start": {"x": "80 mm"}},
        "way": {"type": "orifice", "area": "20 mm^2"},
        "tank": {"type": "tank"},
    }  # fmt: skip
    nets = {
        "p": ["cylinder.cap", "way.a"], "t": ["way.b", "tank.port"], "r": ["load.port", "cylinder.rod"],
    }  # fmt: skip
    run = circuit(components=parts, nets=nets, fluid=FLUID, simulation={"stop": "2 s"}).simulate(rtol=1e-8)
    assert run["load.x"][-1] == pytest.approx(-500 / (1e8 + 2e3), rel=1e-3)
    assert np.all(run["load.v"][run["load.x"] > 1e-4] <= 0)
    assert run.balance.circuit < 1e-6
    assert max(run.balance.energy.components.values()) < 1e-6


def test_piston_through_its_stop_ends_the_run():
    """A stop too soft for its load uses up the dead volume; the run says what to change."""
    parts = {
        "cylinder": CYLINDER | {"stop_stiffness": "10 N/mm", "cap_dead_volume": "5 cm^3"},
        "load": {"type": "mass", "mass": "500 kg", "start": {"x": "5 mm", "v": "-2 m/s"}},
        "a": {"type": "orifice", "area": "500 mm^2"},
        "b": {"type": "orifice", "area": "500 mm^2"},
        "tank": {"type": "tank", "pressure": "5 bar"},
    }
    nets = {
        "p": ["cylinder.cap", "a.a"], "s": ["cylinder.annulus", "b.a"], "t": ["a.b", "b.b", "tank.port"],
        "r": ["load.port", "cylinder.rod"],
    }  # fmt: skip
    made = circuit(components=parts, nets=nets, fluid=FLUID, simulation={"stop": "1 s"})
    with pytest.raises(SimulationError, match="raise stop_stiffness or dead volumes"):
        made.simulate()


@pytest.mark.parametrize("profile", ["linear", "constant_deceleration"])
@pytest.mark.parametrize("towards", ["low", "high"])
def test_cushion_narrows_towards_its_end(profile, towards):
    """Fully open ahead of its length, the remaining area at the end and beyond, monotonic between."""
    part = Cushion(area=40e-6, remaining_area=1e-6, length=0.02, end=0.1, towards=towards, profile=profile)
    sign = 1 if towards == "low" else -1
    areas = [
        part.equations(p_chamber=1e6, p_port=0.0, x_rod=0.1 + sign * z * 0.02, fluid=OIL)["open_area"]
        for z in (-1.0, 0.0, 0.1, 0.5, 1.0, 5.0)
    ]
    assert areas[0] == areas[1] == pytest.approx(1e-6)
    assert areas[4] == areas[5] == pytest.approx(40e-6)
    assert np.all(np.diff(areas[1:5]) > 0)
    out = part.equations(p_chamber=1e6, p_port=0.0, x_rod=0.1, fluid=OIL)
    back = part.equations(p_chamber=0.0, p_port=1e6, x_rod=0.1, fluid=OIL)
    assert out["q"] == -back["q"] == -out["q_port"]


def test_cushion_wider_at_its_end_is_refused():
    """It would not slow the piston down."""
    with pytest.raises(ValidationError, match=r"remaining_area \(50 mm\^2\) must not exceed area \(40 mm\^2\)"):
        Cushion(area=40e-6, remaining_area=50e-6, length=0.02)


def test_cushion_slows_a_mass_at_constant_deceleration():
    """Designed for it: v^2 = v_0^2 z, so m v_0^2/(2 L) = dp A with dp = rho/2 (A v_0/(Cd A_0))^2.

    200 kg at 0.5 m/s, L = 20 mm, 50 mm piston: 1250 N, 6.37 bar, A_0 = 36.2 mm^2. Between 0.9 and 0.2 of the length the
    velocity follows its law within 2 %: the remaining area, 1 %, and the oil as a spring.
    """
    m, v_0, length = 200.0, 0.5, 0.02
    drop = m * v_0**2 / (2 * length) / CAP
    area = CAP * v_0 / (0.7 * math.sqrt(2 * drop / 850.0))
    parts = {
        "cylinder": {"type": "single_acting_cylinder", "piston_diameter": "50 mm", "stroke": "100 mm",
                     "dead_volume": "5 cm^3", "start": {"pressure": f"{drop} Pa"}},
        "load": {"type": "mass", "mass": f"{m} kg", "start": {"x": f"{length} m", "v": f"{-v_0} m/s"}},
        "cushion": {"type": "cushion", "area": f"{area} m2", "remaining_area": f"{area / 100} m2",
                    "length": f"{length} m", "profile": "constant_deceleration", "lambda_c": "10"},
        "tank": {"type": "tank"},
    }  # fmt: skip
    nets = {
        "p": ["cylinder.cap", "cushion.chamber"], "t": ["cushion.port", "tank.port"],
        "r": ["load.port", "cylinder.rod", "cushion.rod"],
    }  # fmt: skip
    run = circuit(components=parts, nets=nets, fluid=FLUID, simulation={"stop": "70 ms"}).simulate(rtol=1e-8)
    z = run["load.x"] / length
    within = (z < 0.9) & (z > 0.2)
    assert within.sum() > 20
    np.testing.assert_allclose(-run["load.v"][within], v_0 * np.sqrt(z[within]), rtol=0.02)
