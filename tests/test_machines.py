"""Pumps, motors and the axial piston machine: quadrants, power, conservation, and the two shipped circuits."""

import functools
import math

import numpy as np
import pytest
from building import circuit
from crescentlab.components.cavitating_fluids import MineralOil, Water
from crescentlab.components.displacement_machines import (
    FixedDisplacementMotor,
    FixedDisplacementPump,
    VariableDisplacementPump,
)
from crescentlab.components.fluids import AeratedOil, SimpleOil
from crescentlab.components.valve_plates import SwashPlateBarrel, ValvePlate, VariableSwashPlateBarrel
from pydantic import ValidationError
from scipy.integrate import solve_ivp

import crescentlab as cl
from crescentlab.analysis.outcome import Outcome, Window
from crescentlab.analysis.steady import steady

BAR, LPM, RPM, DEG = 1e5, 1e-3 / 60, math.pi / 30, math.pi / 180
OIL = SimpleOil(density=860.0, kinematic_viscosity=35e-6, bulk_modulus=1.4e9)
AERATED = AeratedOil(
    density=860.0, kinematic_viscosity=35e-6, bulk_modulus=1.4e9, air_fraction=0.05, saturation_pressure=1e7
)
LOSSES = {
    "leakage_coefficient": 3e-9, "drag_coefficient": 1e5, "friction_coefficient": 0.03, "friction_torque": 2.0,
}  # fmt: skip
SIZE = 71e-6 / (2 * math.pi)
QUADRANTS = [(p, w) for p in (200 * BAR, -200 * BAR) for w in (150.0, -150.0)]


@pytest.mark.parametrize(("rise", "omega"), QUADRANTS)
@pytest.mark.parametrize("setting", [1.0, 0.3, -0.6])
def test_losses_take_power_in_every_quadrant(rise, omega, setting):
    """T w = hydraulic power + loss with loss > 0; without coefficients it is that of compressing what fills.

    Q times the integral of 1 - rho_f/rho from the pressure p_f that fills to the other: with rho = rho_0 exp(p/beta)
    Q beta (x - 1 + exp(-x)), x = (p - p_f)/beta, which is x^2/2 at small x of either sign.
    """
    given = {"p_inlet": 210 * BAR, "p_outlet": 210 * BAR + rise, "omega_shaft": omega, "setting": setting, "fluid": OIL}
    now = VariableDisplacementPump(displacement=SIZE, **LOSSES).equations(**given)
    assert now["q_inlet"] == -now["q_outlet"] == now["q"]
    assert now["torque"] * omega == pytest.approx(now["hydraulic_power"] + now["loss"], rel=1e-12)
    assert now["loss"] > 0
    ideal = VariableDisplacementPump(displacement=SIZE).equations(**given)
    x = (rise if setting * omega > 0 else -rise) / 1.4e9
    compressed = abs(setting * SIZE * omega) * 1.4e9 * (x - 1 + math.exp(-x))
    assert ideal["loss"] == pytest.approx(compressed, rel=1e-8)
    assert ideal["torque"] == pytest.approx(setting * SIZE * rise, rel=1e-12)
    assert ideal["loss"] == pytest.approx(rise**2 / 2.8e9 * abs(setting * SIZE * omega), rel=5e-3)  # dp/(2 beta)


@pytest.mark.parametrize("outlet", [0.0, 100.0, 300.0, 600.0])
def test_an_ideal_pump_draws_its_displacement(outlet):
    """20 cm^3/rev at 1500 rpm out of a tank are 30.00 L/min whatever the outlet's pressure; 95.49 N m at 300 bar.

    Volumetric and hydromechanical efficiency, by ISO 4391 with the flow at the inlet, are 1; the outlet delivers the
    same mass, less volume.
    """
    oil = MineralOil(grade="ISO VG 46", temperature="40 degC")
    now = FixedDisplacementPump(displacement=20e-6 / (2 * math.pi)).equations(
        p_inlet=0.0, p_outlet=outlet * BAR, omega_shaft=1500 * RPM, fluid=oil
    )
    assert now["q_inlet"] == pytest.approx(30 * LPM, rel=1e-12)
    assert now["torque"] == pytest.approx(95.49297 * outlet / 300, rel=1e-7)
    delivered = now["q"] * oil.rho_0 / oil.density(outlet * BAR)
    assert delivered == pytest.approx(30 * LPM * oil.density(0.0) / oil.density(outlet * BAR), rel=1e-12)
    assert (delivered < 30 * LPM) == (outlet > 0)


@pytest.mark.parametrize("omega", [150.0, -150.0])
@pytest.mark.parametrize("setting", [1.0, -0.4])
def test_a_machine_takes_in_its_displacement_where_it_fills(setting, omega):
    """By volume, at the pressure of the port that setting and speed make it fill from, pump or motor; both ways."""
    p_inlet, p_outlet = 300 * BAR, 20 * BAR
    q = (
        VariableDisplacementPump(displacement=SIZE)
        .equations(p_inlet=p_inlet, p_outlet=p_outlet, omega_shaft=omega, setting=setting, fluid=OIL)["q"]
    )  # fmt: skip
    fills = p_inlet if setting * omega > 0 else p_outlet
    assert q * 860.0 / OIL.density(fills) == pytest.approx(setting * SIZE * omega, rel=1e-12)


FLUIDS = [OIL, AERATED, MineralOil(grade="ISO VG 32"), Water()]


@pytest.mark.parametrize("fluid", FLUIDS, ids=lambda fluid: type(fluid).__name__)
def test_no_machine_makes_power(fluid):
    """The loss of an ideal one is never negative: any pressures from -0.9 to 600 bar, speeds and settings of any sign.

    1e-12 of the power for rounding, and what the enthalpy of aerated oil is known to, 1e-9 of it.
    """
    random = np.random.default_rng(1)
    part = VariableDisplacementPump(displacement=SIZE)
    for _ in range(300):
        p_inlet, p_outlet = random.choice([600 * BAR, 5 * BAR]) * random.random(2) - 0.9 * BAR
        now = part.equations(
            p_inlet=p_inlet, p_outlet=p_outlet, omega_shaft=random.uniform(-300, 300),
            setting=random.uniform(-1, 1), fluid=fluid,
        )  # fmt: skip
        assert now["loss"] >= -1e-9 * abs(now["hydraulic_power"])


def test_slip_keeps_the_mean_density_and_the_flow_is_continuous_at_rest():
    """C_s D/mu dp at the mean pressure, where nu = 35 cSt: C_s D dp/(nu rho_0) as mass over rho_0, at any speed."""
    part = VariableDisplacementPump(displacement=SIZE, leakage_coefficient=3e-9)
    given = {"p_inlet": 10 * BAR, "p_outlet": 310 * BAR, "setting": 1.0, "fluid": OIL}
    slip = -3e-9 * SIZE * 300 * BAR / (35e-6 * 860.0)
    for omega, within in ((0.0, 1e-18), (1e-6, 1e-10), (-1e-6, 1e-10)):
        assert part.equations(omega_shaft=omega, **given)["q"] == pytest.approx(slip, rel=1e-12, abs=within)


def test_over_centre_without_an_event():
    """A pump swivels from 1 to -1 between 20 and 200 bar: nothing fires, and the ledger of energy closes."""
    parts = {
        "drive": {"type": "speed_source", "speed": "1500 rpm"},
        "swivel": {"type": "ramp", "before": "1", "after": "-1", "duration": "0.1 s"},
        "pump": {"type": "variable_displacement_pump", "displacement": "71 cm^3/rev"},
        "low": {"type": "pressure_source", "pressure": "20 bar"},
        "high": {"type": "pressure_source", "pressure": "200 bar"},
    }  # fmt: skip
    nets = {
        "shaft": ["drive.shaft", "pump.shaft"], "set": ["swivel.y", "pump.setting"], "l": ["low.port", "pump.inlet"],
        "h": ["high.port", "pump.outlet"],
    }  # fmt: skip
    fluid = {"type": "simple_oil", "density": "860 kg/m^3", "kinematic_viscosity": "35 cSt", "bulk_modulus": "1.4 GPa"}
    run = circuit(components=parts, nets=nets, fluid=fluid, simulation={"stop": "0.1 s"}).simulate()
    assert not [name for happening in run.trajectory.happenings for name in happening.names if "pump" in name]
    assert run["pump.loss"].min() >= 0
    assert run["pump.q"][0] == pytest.approx(71e-6 * 25 * math.exp(20e5 / 1.4e9), rel=1e-9)
    assert run["pump.q"][-1] == pytest.approx(-71e-6 * 25 * math.exp(200e5 / 1.4e9), rel=1e-9)
    assert run.balance.energy.circuit < 1e-9


def test_setting_is_held_within_its_range():
    """Beyond 1 and -1 the machine does not grow."""
    given = {"p_inlet": 0.0, "p_outlet": 1e7, "omega_shaft": 100.0, "fluid": OIL}
    part = VariableDisplacementPump(displacement=SIZE)
    for setting, held in ((1.7, 1.0), (-3.0, -1.0)):
        assert part.equations(**given, setting=setting)["q"] == part.equations(**given, setting=held)["q"]


def test_fixed_and_fully_set_machines_are_one():
    """The same law for pump and motor, fixed and at full setting."""
    given = {"p_inlet": 150 * BAR, "p_outlet": 5 * BAR, "omega_shaft": 100.0, "fluid": OIL}
    motor = FixedDisplacementMotor(displacement=SIZE, **LOSSES).equations(**given)
    assert motor == FixedDisplacementPump(displacement=SIZE, **LOSSES).equations(**given)
    assert motor == VariableDisplacementPump(displacement=SIZE, **LOSSES).equations(**given, setting=1.0)


def test_friction_stops_a_motor_that_is_driven_too_weakly():
    """Between rest and motion the friction turns with the speed and is zero at rest."""
    part = FixedDisplacementMotor(displacement=SIZE, **LOSSES)
    still = part.equations(p_inlet=0.0, p_outlet=0.0, omega_shaft=0.0, fluid=OIL)
    assert still["torque"] == 0
    slow = part.equations(p_inlet=0.0, p_outlet=0.0, omega_shaft=0.1, fluid=OIL)
    drag = 1e5 * 860 * 35e-6 * SIZE * 0.1
    assert slow["torque"] == pytest.approx(2.0 * math.tanh(0.1) + drag, rel=1e-12)


# -- the barrel and its plate ------------------------------------------------------------------------------------------

BARREL = {"piston_diameter": 17e-3, "pitch_radius": 36.5e-3, "dead_volume": 3e-6}
PLATE = {"pitch_radius": 36.5e-3, "kidney_width": 9e-3, "kidney_angle": 28 * DEG}


def test_barrel_passes_all_power():
    """T w = -sum p dV/dt; volumes are the integral of their rates (central differences); their sum never changes."""
    part = SwashPlateBarrel(swash_angle=17 * DEG, **BARREL)
    p = np.linspace(1e5, 2e7, 9)
    for phi in (0.0, 0.7, 25.0):
        now = part.equations(phi_shaft=phi, omega_shaft=150.0, p_chambers=p)
        assert now["torque_shaft"] * 150.0 == pytest.approx(-np.sum(p * now["dV_chambers"]), rel=1e-12)
        later, earlier = (
            part.equations(phi_shaft=phi + s * 1e-5, omega_shaft=0.0, p_chambers=p)["V_chambers"] for s in (1, -1)
        )
        np.testing.assert_allclose((later - earlier) / 2e-5 * 150.0, now["dV_chambers"], atol=1e-11)
        assert np.sum(now["dV_chambers"]) == pytest.approx(0.0, abs=1e-15)
        assert np.all(now["V_chambers"] >= 3e-6)


@pytest.mark.parametrize("share", [1.0, 0.0, -0.8])
def test_variable_barrel_keeps_volume_and_rate_together(share):
    """dV/dt with the plate moving and the shaft turning, by differences in time; over centre the flow turns round."""
    part, dt = VariableSwashPlateBarrel(largest_swash_angle=17 * DEG, **BARREL), 1e-8
    given = {"omega_shaft": 150.0, "p_chambers": np.zeros(9), "setting": 0.5}
    now = part.equations(phi_shaft=0.4, share=share, **given)
    later, earlier = (
        part.equations(phi_shaft=0.4 + s * dt * 150.0, share=share + s * dt * now["der_share"], **given)["V_chambers"]
        for s in (1, -1)
    )
    np.testing.assert_allclose((later - earlier) / (2 * dt), now["dV_chambers"], atol=1e-9)
    assert np.all(now["V_chambers"] > 0)
    assert now["der_share"] == pytest.approx((0.5 - share) / 20e-3)
    still = VariableSwashPlateBarrel(largest_swash_angle=17 * DEG, **BARREL).equations(
        phi_shaft=0.4, share=share, **given | {"setting": share}
    )
    fixed = SwashPlateBarrel(swash_angle=17 * DEG, **BARREL).equations(
        phi_shaft=0.4, omega_shaft=150.0, p_chambers=np.zeros(9)
    )
    np.testing.assert_allclose(still["dV_chambers"], share * fixed["dV_chambers"], atol=1e-18)


def test_plate_joins_each_chamber_to_one_port():
    """With the default angles no chamber meets both, at any angle, also after many turns; at the centres none."""
    plate = ValvePlate(**PLATE)
    for phi in np.linspace(-30.0, 200.0, 457):
        now = plate.equations(p_chambers=np.zeros(9), p_suction=0.0, p_delivery=0.0, phi_shaft=phi, fluid=OIL)
        assert np.all((now["delivery_areas"] == 0) | (now["suction_areas"] == 0))
        alpha = (phi - 2 * math.pi / 9 * np.arange(9)) % (2 * math.pi)
        clear = np.minimum(np.abs(np.sin(alpha)), 1) > 1e-9
        assert np.all((now["delivery_areas"] > 0)[clear] == (alpha < math.pi)[clear])


def test_plate_keeps_what_passes():
    """What leaves the chambers enters the ports; equal pressures, no flow; a groove opens ahead of its port."""
    plate = ValvePlate(**PLATE, groove_area=2e-6, groove_angle=8 * DEG, delivery_opens=5 * DEG)
    p = np.linspace(0.0, 2e7, 9)
    now = plate.equations(p_chambers=p, p_suction=2e5, p_delivery=1.5e7, phi_shaft=0.3, fluid=OIL)
    assert np.sum(now["q_chambers"]) + now["q_suction"] + now["q_delivery"] == pytest.approx(0.0, abs=1e-12)
    assert now["q"] == -now["q_delivery"]
    level = plate.equations(p_chambers=np.full(9, 1e6), p_suction=1e6, p_delivery=1e6, phi_shaft=0.3, fluid=OIL)
    assert np.all(level["q_chambers"] == 0)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"delivery_closes": 20 * DEG}, "delivery_closes must lie more than kidney_angle"),
        ({"suction_closes": 540 * DEG}, "suction_closes must lie more than kidney_angle"),
        ({"groove_area": 1e-3}, "groove_area exceeds the area of a kidney"),
    ],
)
def test_plates_that_cannot_be_made_are_refused(given, said):
    """One sentence that names the parameter."""
    with pytest.raises(ValidationError, match=said):
        ValvePlate(**PLATE | given)


# -- axial_piston_pump -------------------------------------------------------------------------------------------------

HALF = math.pi / 4 * 17e-3**2 * 36.5e-3 * math.tan(17 * DEG)


@functools.cache
def second_turn(load: str, pistons: int = 9, bulk: str = "14000 bar", rtol: float = 1e-6) -> Window:
    """The shipped pump's second turn."""
    given = {"load": load, "pistons": str(pistons), "fluid.bulk_modulus": bulk}
    return Window(cl.load("axial_piston_pump").simulate(parameters=given, rtol=rtol), 40e-3, 80e-3)


def value(window: Window, text: str) -> float:
    """An outcome of a window."""
    return Outcome("it", text).value(window).value


def test_ripple_tends_to_the_closed_form_as_the_oil_stiffens():
    """Zero leakage: pi/(2z) tan(pi/(4z)) for nine pistons.

    The plate's orifices must bring each chamber from the port's pressure less a drop to that plus a drop (2 x 5 kPa);
    what that compresses falls with the bulk modulus: 4 % of the ripple, then 0.6 %.
    """
    closed = math.pi / 18 * math.tan(math.pi / 36)
    for bulk, share in (("14000 bar", 0.05), ("1400000 bar", 0.01)):
        window = second_turn("2 bar", bulk=bulk)
        found = value(window, "peak_to_peak(plate.q) / mean(plate.q)")
        assert found == pytest.approx(closed, rel=share)
    exact = value(window, "peak_to_peak(barrel.kinematic_flow) / mean(barrel.kinematic_flow)")
    assert exact == pytest.approx(closed, rel=1e-3)


def test_header_of_the_axial_piston_pump():
    """Numbers of the header, to the digits printed; the closed forms beside them."""
    high, low, even = second_turn("200 bar"), second_turn("2 bar"), second_turn("2 bar", 8)
    assert value(high, "mean(plate.q)") == pytest.approx(67.82 * LPM, abs=0.005 * LPM)
    full = (3e-6 + 2 * HALF) * math.exp(2 * BAR / 1.4e9) - 3e-6 * math.exp(200 * BAR / 1.4e9)
    assert 9 * 25 * full == pytest.approx(67.82 * LPM, abs=0.005 * LPM)
    assert pytest.approx(45.59e-6, abs=5e-9) == 9 * 2 * HALF
    assert value(low, "mean(barrel.kinematic_flow)") == pytest.approx(68.39 * LPM, abs=0.005 * LPM)
    assert value(high, "mean(barrel.torque)") == pytest.approx(143.7, abs=0.05)
    assert 9 * HALF / math.pi * 198 * BAR == pytest.approx(143.7, abs=0.05)
    assert value(high, "minimum(plate.q)") == pytest.approx(25 * LPM, abs=0.5 * LPM)
    assert value(high, "maximum(plate.q)") == pytest.approx(70 * LPM, abs=0.5 * LPM)
    assert value(low, "peak_to_peak(plate.q) / mean(plate.q)") == pytest.approx(0.0159, abs=5e-5)
    assert value(low, "amplitude(plate.q, 18 * speed) / mean(plate.q)") == pytest.approx(0.00619, abs=2e-5)
    assert value(even, "peak_to_peak(plate.q) / mean(plate.q)") == pytest.approx(0.0781, rel=0.01)


def test_axial_piston_pump_keeps_its_oil():
    """As shipped: less than 1e-6 of what passes is lost."""
    assert cl.load("axial_piston_pump").simulate().balance.circuit < 1e-6


def test_axial_piston_machine_motors():
    """High pressure at the port that is entered on the way out of the bores: the shaft is driven.

    Mean torque -D dp within 1 %: at each change-over the oil in a chamber is compressed or relieved without work.
    """
    made = cl.load("axial_piston_pump")
    given = {"load": "2 bar", "boost": "200 bar"}
    window = Window(made.simulate(parameters=given, rtol=1e-6), 40e-3, 80e-3)
    assert value(window, "mean(barrel.torque)") == pytest.approx(-9 * HALF / math.pi * 198 * BAR, rel=0.01)


# -- hydrostatic_transmission ------------------------------------------------------------------------------------------

PUMP, MOTOR, MU = 71e-6 / (2 * math.pi), 56e-6 / (2 * math.pi), 860 * 35e-6
STIFFNESS = 1.4e9 / 1e-3
SLIP = 3e-9 * (PUMP + MOTOR) / MU


@functools.cache
def transmission(rtol: float = 1e-6) -> cl.Result:
    """As shipped."""
    return cl.load("hydrostatic_transmission").simulate(rtol=rtol)


BOOST = 20 * BAR
HIGH = BOOST + 100 / MOTOR


def denser(p: float) -> float:
    """rho/rho_0."""
    return math.exp(p / 1.4e9)


def speed(setting: float, slip: float = SLIP) -> float:
    """Speed of the motor [rad/s] at rest of the pressures.

    The pump fills at the boost's density, the motor at that of the high side, and slip takes C dp as mass over rho_0.
    """
    return (denser(BOOST) * setting * PUMP * 1500 * RPM - slip * (HIGH - BOOST)) / (denser(HIGH) * MOTOR)


def test_transmission_ratio():
    """Steady: load/D_m above the boost; exp(-dp/beta) D_p/D_m of the pump's speed, less slip."""
    made = cl.load("hydrostatic_transmission")
    point = steady(made, at="2 s").result
    assert point["line.p"][-1] == pytest.approx(HIGH, rel=1e-6)
    assert point["rotor.omega"][-1] == pytest.approx(speed(0.6), rel=1e-8)
    assert speed(0.5) / RPM == pytest.approx(919.3, abs=0.05)
    assert speed(0.6) / RPM == pytest.approx(1108.0, abs=0.05)
    free = steady(made, {"leakage": "0"}, at="2 s").result
    assert free["rotor.omega"][-1] == pytest.approx(0.992018 * 0.6 * 71 / 56 * 1500 * RPM, rel=1e-6)
    assert free["rotor.omega"][-1] == pytest.approx(speed(0.6, slip=0.0), rel=1e-8)
    assert free["efficiency"][-1] == pytest.approx(denser(BOOST - HIGH), rel=1e-8)


def test_transmission_swings_as_in_merritt():
    """Pump controlled motor of Merritt (1967), chapter 6: peak of the step.

    w = sqrt(beta D_m^2/(V J)), zeta = C'/(2 D_m) sqrt(beta J/V), C' = C rho_0/rho + D_m omega/beta: as the pressure
    rises by dp, the motor takes in more mass by dp/beta, beside what slips.

    0.5 %: bulk modulus and density over 250 bar, and a damping coefficient that holds to first order.
    """
    w = math.sqrt(STIFFNESS * MOTOR**2 / 0.5)
    zeta = (SLIP / denser(HIGH) + MOTOR * speed(0.6) / 1.4e9) / (2 * MOTOR) * math.sqrt(STIFFNESS * 0.5)
    assert w / (2 * math.pi) == pytest.approx(2.374, abs=5e-4)
    assert zeta == pytest.approx(0.128, abs=5e-4)
    run = transmission()
    k = int(np.argmax(run["rotor.omega"]))
    root = math.sqrt(1 - zeta * zeta)
    assert run.time[k] - 0.1 == pytest.approx(math.pi / (w * root), rel=5e-3)
    peak = speed(0.6) + (speed(0.6) - speed(0.5)) * math.exp(-math.pi * zeta / root)
    assert run["rotor.omega"][k] == pytest.approx(peak, rel=5e-3)


def test_transmission_against_its_two_equations():
    """V rho/beta dp/dt = rho_l Q_p - rho D_m omega - rho_0 C dp, J domega/dt = D_m dp - load, by SciPy; 1e-6."""

    def rates(_: float, now: np.ndarray) -> list[float]:
        p, omega = now
        flow = denser(BOOST) * 0.6 * PUMP * 1500 * RPM - denser(p) * MOTOR * omega - SLIP * (p - BOOST)
        return [STIFFNESS / denser(p) * flow, (MOTOR * (p - BOOST) - 100) / 0.5]

    run = cl.load("hydrostatic_transmission").simulate("1 s", rtol=1e-8)
    after = run.time >= 0.1
    start = [HIGH, speed(0.5)]
    found = solve_ivp(rates, (0.1, 1.0), start, method="DOP853", rtol=1e-10, atol=[1e-2, 1e-9], dense_output=True)
    pressure, omega = found.sol(run.time[after])
    assert np.max(np.abs(run["line.p"][after] - pressure)) < 1e-6 * 270 * BAR
    assert np.max(np.abs(run["rotor.omega"][after] - omega)) < 1e-6 * 130


def test_header_of_the_transmission():
    """To the digits printed."""
    run = transmission()
    k = int(np.argmax(run["rotor.omega"]))
    assert run["rotor.omega"][k] / RPM == pytest.approx(1234, abs=0.5)
    assert run.time[k] - 0.1 == pytest.approx(0.212, abs=1e-3)
    assert run["line.p"].max() == pytest.approx(270 * BAR, abs=1 * BAR)
    before = run.time < 0.1
    assert run["rotor.omega"][before] / RPM == pytest.approx(919.3, abs=0.05)
    assert run["line.p"][before] == pytest.approx(132.2 * BAR, abs=0.05 * BAR)
    assert run["efficiency"][-1] == pytest.approx(0.971, abs=1e-3)
    assert run.balance.circuit < 1e-6


def test_motor_runs_up_against_its_slip():
    """A fixed pump into a fixed motor with free rotor: the speed tends to D_p/D_m of the pump's, and never beyond 2."""
    parts = {
        "engine": {"type": "speed_source", "speed": "1000 rpm"},
        "pump": {"type": "fixed_displacement_pump", "displacement": "20 cc/rev", "leakage_coefficient": "2e-8"},
        "line": {"type": "capacity", "volume": "0.5 L", "start": {"p": "200 bar"}},
        "motor": {"type": "fixed_displacement_motor", "displacement": "40 cc/rev", "leakage_coefficient": "2e-8"},
        "rotor": {"type": "inertia", "inertia": "0.02 kg m2"},
        "tank": {"type": "tank", "pressure": "200 bar"},
    }
    nets = {
        "d": ["engine.shaft", "pump.shaft"], "h": ["pump.outlet", "line.port", "motor.inlet"],
        "l": ["motor.outlet", "pump.inlet", "tank.port"], "o": ["rotor.shaft", "motor.shaft"],
    }  # fmt: skip
    fluid = {"type": "simple_oil", "density": "860 kg/m^3", "kinematic_viscosity": "35 cSt", "bulk_modulus": "1.4 GPa"}
    run = circuit(components=parts, nets=nets, fluid=fluid, simulation={"stop": "3 s"}).simulate(rtol=1e-8)
    assert run["rotor.omega"][-1] == pytest.approx(500 * RPM, rel=1e-4)
    assert run["rotor.omega"].max() < 1000 * RPM


def test_one_piston_on_an_eccentric():
    """Eccentric, piston, chamber and two check valves make a pump: A 2 e a turn, half a turn each way.

    16 mm and e = 5 mm at 1200 rpm: 40.2 cm^3/s at 20 bar, less 0.4 % for the compressed chamber of 2.5 cm^3 with valve
    cracking and drop; asked for within 1 %.
    """
    parts = {
        "motor": {"type": "speed_source", "speed": "1200 rpm"},
        "eccentric": {"type": "eccentric", "eccentricity": "5 mm"},
        "piston": {"type": "piston_chamber", "diameter": "16 mm", "dead_volume": "2.5 cm^3", "side": "pushes_down"},
        "chamber": {"type": "variable_capacity"},
        "inlet": {
            "type": "check_valve",
            "area": "50 mm^2",
            "cracking_pressure": "0.05 bar",
            "opening_range": "0.2 bar",
        },
        "outlet": {
            "type": "check_valve",
            "area": "50 mm^2",
            "cracking_pressure": "0.05 bar",
            "opening_range": "0.2 bar",
        },
        "tank": {"type": "tank"},
        "load": {"type": "pressure_source", "pressure": "20 bar"},
    }
    nets = {
        "s": ["motor.shaft", "eccentric.shaft"], "r": ["eccentric.rod", "piston.rod"],
        "c": ["piston.chamber", "chamber.chamber"], "p": ["chamber.port", "inlet.b", "outlet.a"],
        "t": ["tank.port", "inlet.a"], "l": ["outlet.b", "load.port"],
    }  # fmt: skip
    fluid = {"type": "simple_oil", "density": "860 kg/m^3", "kinematic_viscosity": "35 cSt", "bulk_modulus": "1.4 GPa"}
    run = circuit(components=parts, nets=nets, fluid=fluid, simulation={"stop": "150 ms"}).simulate(rtol=1e-7)
    window = Window(run, 50e-3, 150e-3)
    stroke = math.pi / 4 * 0.016**2 * 0.01
    assert value(window, "mean(outlet.q)") == pytest.approx(stroke * 20, rel=0.01)
    assert value(window, "mean(motor.power)") == pytest.approx(20 * BAR * stroke * 20, rel=0.02)
    assert run.balance.circuit < 1e-6
