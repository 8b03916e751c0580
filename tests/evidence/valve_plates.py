"""Axial piston machines."""

from __future__ import annotations

import functools
import math

import numpy as np
from building import circuit
from crescentlab.components.fluids import SimpleOil
from crescentlab.components.valve_plates import (
    SwashPlateBarrel,
    ValvePlate,
    VariableSwashPlateBarrel,
)

import crescentlab as cl
from crescentlab.analysis.outcome import Outcome, Window
from crescentlab.result import Result
from evidence import Number, evidence

BAR = 1e5
OIL = SimpleOil(density=860.0, kinematic_viscosity=35e-6, bulk_modulus=1.4e9)
SIZES = {"piston_diameter": 17e-3, "pitch_radius": 36.5e-3, "dead_volume": 3e-6}
HALF = math.pi / 4 * 17e-3**2 * 36.5e-3 * math.tan(math.radians(17))
"""A R tan(beta) [m^3]."""


@evidence(
    "swash_plate_barrel",
    source="Ivantysyn & Ivantysynova (2001): delta = pi/(2z) tan(pi/(4z)) for odd z, pi/z tan(pi/(2z)) for even z: "
    "14.0, 4.98, 7.81, 2.53, 1.53 and 1.02 %",
    tolerance=3e-3,
    because="the printed figures have three digits",
)
def unevenness() -> list[Number]:
    """(q_max - q_min)/q_mean of the sum over the pistons that deliver, sampled over a turn."""
    printed = {3: 0.140, 5: 0.0498, 8: 0.0781, 7: 0.0253, 9: 0.0153, 11: 0.0102}
    found = []
    for z, expected in printed.items():
        part = SwashPlateBarrel(pistons=z, swash_angle=math.radians(17), **SIZES)
        flows = [
            part.equations(phi_shaft=phi, omega_shaft=1.0, p_chambers=np.zeros(z))["kinematic_flow"]
            for phi in np.linspace(0, 2 * math.pi, 24 * z * 10 + 1)
        ]
        found.append(Number(f"{z} pistons", expected, float(np.ptp(flows) / np.mean(flows))))
    return found


@evidence(
    "swash_plate_barrel",
    "variable_swash_plate_barrel",
    source="displacement z A 2 R tan(beta); the shaft's work over a turn is that of the pressures, integral of p dV",
    tolerance=1e-9,
    because="rounding; the trapezoidal rule is exact for sums of a few harmonics",
)
def displacement() -> list[Number]:
    """Nine pistons of 17 mm on 36.5 mm at 17 deg: displacement, largest volume, mean torque with p ~ sin(alpha)."""
    barrel = SwashPlateBarrel(swash_angle=math.radians(17), **SIZES)
    variable = VariableSwashPlateBarrel(largest_swash_angle=math.radians(17), **SIZES)
    angles, torques = np.linspace(0, 2 * math.pi, 360, endpoint=False), []
    for phi in angles:
        p = 1e6 * np.sin(phi - 2 * math.pi / 9 * np.arange(9))
        torques.append(barrel.equations(phi_shaft=phi, omega_shaft=1.0, p_chambers=p)["torque"])
    at_zero = barrel.equations(phi_shaft=0.0, omega_shaft=1.0, p_chambers=np.zeros(9))
    half = variable.equations(phi_shaft=0.0, omega_shaft=1.0, p_chambers=np.zeros(9), setting=0.5, share=0.5)
    return [
        Number("displacement", 9 * 2 * HALF / (2 * math.pi), at_zero["displacement"], "cc/rev"),
        Number("displacement at setting 0.5", 9 * HALF / (2 * math.pi), half["displacement"], "cc/rev"),
        Number("volume at the outer dead centre", 3e-6 + 2 * HALF, at_zero["V_chambers"][0], "cm3"),
        Number("the same at setting 0.5", 3e-6 + 1.5 * HALF, half["V_chambers"][0], "cm3"),
        Number("mean torque, z A R tan(beta) p/2", 4.5 * HALF * 1e6, float(np.mean(torques)), "N m"),
    ]


@evidence(
    "piston_chambers",
    "variable_swash_plate_barrel",
    source="p = beta ln(V_start/V) in a closed chamber of oil with rho = rho_0 exp(p/beta)",
    tolerance=1e-6,
    because="relative tolerance of the run, 1e-9",
)
def closed_chambers() -> list[Number]:
    """Three closed bores from 400 bar: the plate is put up from 0, with a lag of 1 ms, while the barrel turns."""
    result = closed_bores()
    half = math.pi / 4 * 0.01**2 * 0.02 * math.tan(math.radians(17))
    share, phi = 1 - math.exp(-20.0), 0.4 * math.pi
    found = []
    for k in range(3):
        growth = half * share * math.cos(phi - 2 * math.pi / 3 * k)
        p = 400 * BAR - 1.4e9 * math.log1p(growth / (20e-6 + half))
        found.append(Number(f"pressure of bore {k + 1}", p, float(result["oil.p"][-1, k]), "bar"))
    return found


@functools.cache
def closed_bores() -> Result:
    """The run of both cases of closed bores."""
    parts = {
        "drive": {"type": "speed_source", "speed": "600 rpm"},
        "up": {"type": "constant", "value": "1"},
        "barrel": {"type": "variable_swash_plate_barrel", "pistons": "3", "piston_diameter": "10 mm",
                   "pitch_radius": "20 mm", "largest_swash_angle": "17 deg", "dead_volume": "20 cm^3", "lag": "1 ms"},
        "oil": {"type": "piston_chambers", "pistons": "3", "start_pressure": "400 bar"},
        "closed": {"type": "laminar_gap", "count": "3", "width": "1 mm", "height": "0 mm", "length": "1 mm"},
        "tank": {"type": "tank"},
    }  # fmt: skip
    nets = {
        "s": ["drive.shaft", "barrel.shaft"], "u": ["up.y", "barrel.setting"], "c": ["barrel.chambers", "oil.chambers"],
        "p": ["oil.port", "closed.a"], "t": ["closed.b[*]", "tank.port"],
    }  # fmt: skip
    fluid = {"type": "simple_oil", "density": "860 kg/m^3", "kinematic_viscosity": "35 cSt", "bulk_modulus": "1.4 GPa"}
    return circuit(components=parts, nets=nets, fluid=fluid, simulation={"stop": "20 ms"}).simulate(rtol=1e-9)


@evidence(
    "valve_plate",
    source="overlap of sectors of an annulus: R w times the angle they share; a groove that widens in proportion",
    tolerance=1e-9,
    because="rounding",
)
def areas() -> list[Number]:
    """Kidneys 9 mm wide over 28 deg on 36.5 mm, groove of 2 mm^2 over 8 deg: area to delivery."""
    degree = math.pi / 180
    plate = ValvePlate(
        pistons=1, pitch_radius=36.5e-3, kidney_width=9e-3, kidney_angle=28 * degree, groove_angle=8 * degree,
        groove_area=2e-6, delivery_opens=5 * degree,
    )  # fmt: skip
    per_degree = 36.5e-3 * 9e-3 * degree
    expected = {
        -4: 0.0, 1: 1e-6, 5: 2e-6, 15: 10 * per_degree, 90: 28 * per_degree, 170: 10 * per_degree, 181: 0.0, 270: 0.0,
    }  # fmt: skip
    found = []
    for angle, area in expected.items():
        now = plate.equations(
            p_chambers=np.zeros(1), p_suction=0.0, p_delivery=0.0, phi_shaft=angle * degree + 4 * math.pi, fluid=OIL
        )
        found.append(Number(f"at {angle} deg", area, float(now["delivery_areas"][0]), "mm2", size=1e-6))
    return found


@evidence(
    "valve_plate",
    "swash_plate_barrel",
    "piston_chambers",
    source="Fourier series of the sum of rectified sines of nine pistons: 2/((2z)^2 - 1) of the mean, 18 times a turn; "
    "mean z n (rho(p_s) V_max - rho(p_d) V_0)/rho_0",
    tolerance=3e-3,
    because="the drop over the plate's orifices compresses the oil at each change-over: 0.13 % of the harmonic",
)
def ripple() -> list[Number]:
    """The shipped nine-piston pump without leakage, load and boost 2 bar; and its mean flow at 200 bar."""
    pump = cl.load("axial_piston_pump")
    low = Window(pump.simulate(parameters={"load": "2 bar"}, rtol=1e-6), 40e-3, 80e-3)
    high = Window(pump.simulate(rtol=1e-5), 40e-3, 80e-3)
    ratio = Outcome("ripple", "amplitude(plate.q, 2 * pistons * speed) / mean(plate.q)").value(low).value
    full = (3e-6 + 2 * HALF) * math.exp(2 * BAR / 1.4e9)
    mean = 9 * 25 * (full - 3e-6 * math.exp(200 * BAR / 1.4e9))
    return [
        Number("18th harmonic over the mean", 2 / (18**2 - 1), ratio),
        Number("mean flow at 200 bar", mean, Outcome("mean", "mean(plate.q)").value(high).value, "L/min"),
    ]


def compressed(p: float) -> float:
    """Energy [J/m^3] of oil with rho = rho_0 exp(p/beta): e = rho w - p = beta (exp(p/beta) - 1) - p."""
    return 1.4e9 * math.expm1(p / 1.4e9) - p


@evidence(
    "piston_chambers",
    "variable_swash_plate_barrel",
    source="first law: shaft and actuator give what the oil stores, the sum of V (beta (exp(p/beta) - 1) - p), p = "
    "p_0 - beta ln(V/V_start)",
    tolerance=1e-6,
    because="relative tolerance of the run, 1e-9",
)
def work_of_the_actuator() -> list[Number]:
    """Three closed bores at 400 bar, the plate put up from 0 with a lag of 1 ms at 600 rpm: their work in 20 ms."""
    run = closed_bores()
    assert run.balance is not None
    assert run.balance.energy is not None
    half = math.pi / 4 * 0.01**2 * 0.02 * math.tan(math.radians(17))
    stored = -3 * (20e-6 + half) * compressed(400 * BAR)
    for k in range(3):
        volume = 20e-6 + half + half * (1 - math.exp(-20.0)) * math.cos(0.4 * math.pi - 2 * math.pi / 3 * k)
        stored += volume * compressed(400 * BAR - 1.4e9 * math.log(volume / (20e-6 + half)))
    return [Number("work", stored, sum(run.balance.energy.supplied.values()), "mJ")]


@evidence(
    "valve_plate",
    "piston_chambers",
    "swash_plate_barrel",
    source="first law for a chamber of constant volume joined to a constant pressure: lost, rho_0 w(p) times what "
    "flows in less the rise of V (beta (exp(p/beta) - 1) - p); V (dp)^2/(2 beta) to first order",
    tolerance=1e-3,
    because="the piston moves on while its chamber fills, in proportion to the speed: 0.08 % at 150 rpm",
)
def lost_at_the_dead_centres() -> list[Number]:
    """The shipped pump at 15 rpm: lost as full chambers go from 2 to 200 bar, and dead volumes back."""
    run = cl.load("axial_piston_pump").simulate("8 s", {"speed": "15 rpm"}, rtol=1e-6)
    turn = Outcome("loss", "mean(plate.loss)").value(Window(run, 4.0, 8.0)).value * 4.0

    def lost(volume: float, before: float, after: float) -> float:
        came = volume * (math.exp(after / 1.4e9) - math.exp(before / 1.4e9))
        return -1.4e9 * math.expm1(-after / 1.4e9) * came - volume * (compressed(after) - compressed(before))

    full, dead = 3e-6 + 2 * HALF, 3e-6
    both = lost(full, 2 * BAR, 200 * BAR) + lost(dead, 200 * BAR, 2 * BAR)
    return [Number("lost per turn", 9 * both, turn, "J")]
