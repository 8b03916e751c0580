"""Accumulators and separators in circuits: stops at both ends, two fluids, and what the shipped circuit promises."""

from __future__ import annotations

import functools
import math
import re
from pathlib import Path

import numpy as np
import pytest
from building import OIL, circuit, fired
from crescentlab.components.accumulators import GasAccumulator, compression_work
from crescentlab.components.cavitating_fluids import MineralOil, Water
from crescentlab.components.fluids import AeratedOil, SimpleOil
from refusing import Refusal
from scipy.integrate import quad
from scipy.optimize import brentq

import crescentlab as cl
from crescentlab.contract import Case, check_energy
from crescentlab.result import Result

BAR, LPM, ATM, BETA = 1e5, 1e-3 / 60, 101325.0, 1.4e9
WATER = {"type": "simple_oil", "density": "1000 kg/m^3", "kinematic_viscosity": "1 cSt", "bulk_modulus": "22000 bar"}
STORE = {
    "type": "gas_accumulator",
    "volume": "1 L",
    "preload": "50 bar",
    "smallest_gas": "70 %",
    "start": {"p": "40 bar"},
}


def gas_volume(p: float, preload: float, n: float) -> float:
    """Volume [m^3] of 1 L of gas."""
    return 1e-3 * ((preload + ATM) / (p + ATM)) ** (1 / n)


def content(p: float, gas: float, dead: float = 10e-6) -> float:
    """Oil [m^3 at 0 bar] in an accumulator of 1 L."""
    return (dead + 1e-3 - gas) * math.exp(p / BETA)


# -- the gas accumulator -----------------------------------------------------------------------------------------------


@functools.cache
def filled_and_emptied() -> Result:
    """From below the preload to the full stop and back: 6 L/min for 4 s, and the same back from 4.5 s on."""
    parts = {
        "law": {
            "type": "time_table",
            "curve": {
                "x": ["0 s", "4 s", "4.001 s", "4.5 s", "4.501 s", "20 s"],
                "y": ["6 L/min", "6 L/min", "0 L/min", "0 L/min", "-6 L/min", "-6 L/min"],
            },
        },
        "pump": {"type": "signal_flow_source"},
        "store": STORE,
    }
    nets = {"n": ["pump.port", "store.port"], "s": ["law.y", "pump.flow"]}
    return circuit(components=parts, nets=nets, fluid=OIL, simulation={"stop": "8.501 s", "rtol": "1e-8"}).simulate()


def test_it_bottoms_at_both_ends() -> None:
    """Events when the contents at preload and at the full stop, P_0 0.7^-n, have flowed in; closed form, 1e-6."""
    result = filled_and_emptied()
    full = (50 * BAR + ATM) * 0.7**-1.4 - ATM
    at_start, at_full = content(40 * BAR, 1e-3), content(full, 0.7e-3)
    starts_empty, empties = fired(result, "store.empties")
    (fills,) = fired(result, "store.fills")
    assert starts_empty == 0
    assert fills == pytest.approx((at_full - at_start) / 1e-4, rel=1e-6)
    # drawn: the integral of the ramps is 0.5 ms of the flow each
    most = at_start + 1e-4 * 4.0005
    left = content(50 * BAR, 1e-3)
    assert empties == pytest.approx(4.5005 + (most - left) / 1e-4, rel=1e-6)


def test_beyond_the_full_stop_only_the_oil_gives_way() -> None:
    """4 s of 6 L/min: content = 0.31 L exp(p/beta) beyond the stop; the gas keeps 0.7 L and its pressure."""
    result = filled_and_emptied()
    row = int(np.argmax(result["store.p"]))
    expected = BETA * math.log((content(40 * BAR, 1e-3) + 1e-4 * 4.0005) / 0.31e-3)
    assert result["store.p"][row] == pytest.approx(expected, rel=1e-6)
    assert result["store.gas_volume"][row] == pytest.approx(0.7e-3, rel=1e-12)
    assert result["store.gas_pressure"][row] == pytest.approx((50 * BAR + ATM) * 0.7**-1.4 - ATM, rel=1e-12)
    assert result["store.bottomed"][row] == 1


def test_charged_and_emptied_it_is_as_before() -> None:
    """As much out as in: 40 bar again, resting empty; 10 cm^3 feel 1e-8 of 0.4 L as 0.6 bar, so 2 bar."""
    result = filled_and_emptied()
    assert result.balance is not None
    assert result.balance.circuit < 1e-6
    assert result["store.bottomed"][-1] == -1
    drawn = 1e-4 * (8.501 - 4.5005)
    left = content(40 * BAR, 1e-3) + 1e-4 * 4.0005 - drawn
    assert result["store.p"][-1] == pytest.approx(BETA * math.log(left / 10e-6), abs=2 * BAR)


def test_the_gas_keeps_its_energy_at_its_stops() -> None:
    """None below the preload; beyond the full stop P_0 V_0 (0.7^-0.4 - 1)/0.4 less the atmosphere's work."""
    result = filled_and_emptied()
    most = (50 * BAR + ATM) * 1e-3 * (0.7**-0.4 - 1) / 0.4 - ATM * 0.3e-3
    assert result["store.energy"][[0, -1]] == pytest.approx([0.0, 0.0], abs=1e-9)
    row = int(np.argmax(result["store.p"]))
    p = float(result["store.p"][row])
    assert result["store.energy"][row] == pytest.approx(most, rel=1e-12)
    oil = 0.31e-3 * (BETA * math.expm1(p / BETA) - p)
    assert result["store.stored_energy"][row] == pytest.approx(most + oil, rel=1e-9)
    assert energy_error(result) < 1e-6


def energy_error(result: Result) -> float:
    """Largest error of a component's ledger of energy."""
    assert result.balance is not None
    assert result.balance.energy is not None
    assert not result.balance.energy.silent
    return max(result.balance.energy.components.values())


@pytest.mark.parametrize("p", [(-0.5 * BAR, 45 * BAR), (51 * BAR, 80 * BAR), (85 * BAR, 200 * BAR)])
@pytest.mark.parametrize("index", [1.0, 1.4])
def test_what_enters_is_stored(index: float, p: tuple[float, float]) -> None:
    """Empty, working and full, with oil that holds air."""
    part = GasAccumulator(volume=1e-3, preload=50 * BAR, polytropic_index=index, smallest_gas=0.7)
    oil = AeratedOil(
        density=860.0, kinematic_viscosity=35e-6, bulk_modulus=BETA, air_fraction=0.01, saturation_pressure=1e8
    )
    check_energy(Case(part, oil, {"p": p}))


@pytest.mark.parametrize("index", [1.0, 1 + 1e-9, 1 + 1e-5, 1.4])
def test_compression_work_is_smooth_at_the_isotherm(index: float) -> None:
    """Integral of v^-n from 1/r to 1 by quadrature, through n = 1."""
    expected = quad(lambda v: v**-index, 1 / 3, 1, epsabs=0, epsrel=1e-13)[0]
    assert compression_work(3.0, index) == pytest.approx(expected, rel=1e-10)


def test_finite_far_from_its_range() -> None:
    """Pressures that an integrator tries."""
    store = GasAccumulator(volume=1e-3, preload=50 * BAR)
    for p in (-1e9, -ATM, 0.0, 50 * BAR, 1e10):
        made = store.equations(
            p=p, q_port=1e-4, fluid=SimpleOil(density=860.0, kinematic_viscosity=35e-6, bulk_modulus=BETA)
        )
        assert all(np.isfinite(made[name]) for name in ("der_p", "content", "energy", "gas_pressure"))


# -- the shipped circuit -----------------------------------------------------------------------------------------------


@functools.cache
def shipped() -> Result:
    """The run that the file itself asks for."""
    return cl.load("accumulator").simulate()


def at(result: Result, name: str, time: float) -> float:
    """Value at a time between rows."""
    return float(np.interp(time, result.time, result[name]))


def charged() -> float:
    """Pressure [Pa] after 0.4 L: content by hand."""
    before = content(90 * BAR, 1e-3)
    return float(brentq(lambda p: content(p, gas_volume(p, 90 * BAR, 1.4)) - before - 0.4e-3, 90 * BAR, 400 * BAR))


def test_charge_of_the_shipped_circuit() -> None:
    """Header: 182.8 bar, 0.6053 L of gas, 5.3 cm^3 of compression, 5021 J with 40 J of the atmosphere."""
    p, result = charged(), shipped()
    gas = gas_volume(p, 90 * BAR, 1.4)
    assert (p, gas, gas - 0.6e-3) == pytest.approx((182.8 * BAR, 0.6053e-3, 5.3e-6), rel=1e-2)
    assert p == pytest.approx(182.8 * BAR, abs=0.05 * BAR)
    assert at(result, "accumulator.p", 2.5) == pytest.approx(p, rel=1e-5)
    assert at(result, "accumulator.gas_volume", 2.5) == pytest.approx(gas, rel=1e-5)
    work = ((p + ATM) * gas - (90 * BAR + ATM) * 1e-3) / 0.4
    assert ATM * (1e-3 - gas) == pytest.approx(40, abs=0.5)
    assert work - 40.0 == pytest.approx(5021, abs=1)
    assert at(result, "accumulator.energy", 2.5) == pytest.approx(work - ATM * (1e-3 - gas), rel=1e-5)


def test_discharge_of_the_shipped_circuit() -> None:
    """Header: 26.06 L/min at first, empty after 1.122 s: integral of dS/q over the pressure; then within 1 ms."""
    p, result = charged(), shipped()

    def flow(p: float) -> float:
        return 0.7 * 3e-6 * math.sqrt(2 * p * 860 * math.exp(p / 2 / BETA)) / 860

    def softness(p: float) -> float:
        gas = gas_volume(p, 90 * BAR, 1.4)
        return math.exp(p / BETA) * ((10e-6 + 1e-3 - gas) / BETA + gas / 1.4 / (p + ATM))

    emptying = quad(lambda p: softness(p) / flow(p), 90 * BAR, p)[0]
    assert flow(p) == pytest.approx(26.06 * LPM, abs=0.005 * LPM)
    assert emptying == pytest.approx(1.122, abs=5e-4)
    assert at(result, "valve.q", 3.0001) == pytest.approx(flow(p), rel=1e-3)
    (empties,) = fired(result, "accumulator.empties")
    assert empties - 3 == pytest.approx(emptying, rel=1e-4)
    assert at(result, "accumulator.p", empties + 1e-3) < 0.1 * BAR
    assert result.balance is not None
    assert result.balance.circuit < 1e-6


def test_the_shipped_accumulator_gives_back_what_it_took() -> None:
    """Pump's work = what is stored after the charge = heat in the valve after the discharge; to 1e-9 with radau."""
    result = cl.load("accumulator").simulate(solver="radau", rtol=1e-9)
    assert energy_error(result) < 1e-9
    assert result.balance is not None
    energy = result.balance.energy
    assert energy is not None
    stored = result["accumulator.stored_energy"]
    charged = at(result, "accumulator.stored_energy", 2.5) - stored[0]
    assert sum(energy.supplied.values()) == pytest.approx(charged, rel=1e-9)
    assert energy.dissipated["valve"] == pytest.approx(charged + stored[0] - stored[-1], rel=1e-9)


# -- elastic walls -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("ends", ["closed", "expansion_joints", "anchored"])
def test_a_tube_that_gives_way(ends: str) -> None:
    """A plastic tube filled at 6 L/min: content V_0 (1 + c p) exp(p/beta), c of the thick wall by hand; mass kept."""
    parts = {
        "pump": {"type": "flow_source", "flow": "6 L/min"},
        "tube": {
            "type": "elastic_capacity", "diameter": "20 mm", "length": "1 m", "wall_thickness": "4 mm", "ends": ends,
            "youngs_modulus": "3 GPa", "poissons_ratio": "0.4",
        },
    }  # fmt: skip
    nets = {"n": ["pump.port", "tube.port"]}
    result = circuit(components=parts, nets=nets, fluid=OIL, simulation={"stop": "50 ms", "rtol": "1e-9"}).simulate()
    b = 400 / (28**2 - 400)
    hoop, radial = 1 + 2 * b, -1.0
    axial = {"closed": b, "expansion_joints": 0.0, "anchored": 0.4 * (hoop + radial)}[ends]
    strains = 2 * (hoop - 0.4 * (radial + axial))
    strains += axial - 0.4 * (hoop + radial) if ends == "closed" else 0.0  # joints slide, anchors hold
    volume = math.pi / 4 * 0.02**2
    expected = brentq(
        lambda p: volume * ((1 + strains / 3e9 * p) * math.exp(p / BETA) - 1) - 1e-4 * 0.05, 0.0, 1e9, rtol=1e-13
    )
    assert result["tube.p"][-1] == pytest.approx(expected, rel=1e-7)
    assert result.balance is not None
    assert result.balance.circuit < 1e-6


# -- two fluids --------------------------------------------------------------------------------------------------------


def separated(stop: str, **more: str) -> Result:
    """6 L/min of oil push water through an orifice until the piston meets its stop."""
    parts = {
        "pump": {"type": "flow_source", "flow": "6 L/min"},
        "piston": {"type": "piston_separator", "volume": "20 cm^3"},
        "hole": {"type": "orifice", "area": "2 mm^2"},
        "tank": {"type": "tank"},
    }
    nets = {
        "oil_side": {"fluid": "oil", "ports": ["pump.port", "piston.a"]},
        "water_side": {"fluid": "water", "ports": ["piston.b", "hole.a"]},
        "out": ["hole.b", "tank.port"],
    }
    made = circuit(
        components=parts,
        nets=nets,
        fluids={"oil": OIL, "water": WATER},
        simulation={"stop": stop, "rtol": "1e-8", **more},
    )
    return made.simulate()


def test_separator_between_two_fluids() -> None:
    """Steady flow: 6 L/min of water leave, drop rho_w/2 (q/(Cd A))^2; the densities vary by 1e-3."""
    result = separated("50 ms")
    assert result["hole.q"][-1] == pytest.approx(6 * LPM, rel=1e-3)
    drop = 1000 / 2 * (1e-4 / (0.7 * 2e-6)) ** 2
    assert result["piston.pressure_b"][-1] == pytest.approx(drop, rel=2e-3)
    assert result["piston.pressure_a"][-1] == result["piston.pressure_b"][-1]
    assert result["piston.V_a"][-1] + result["piston.V_b"][-1] == pytest.approx(40e-6, rel=1e-12)


def test_the_example_of_the_manual(tmp_path: Path) -> None:
    """docs/fluids.md: 25.2 bar after 50 ms, (m'/(Cd A))^2/(2 rho_w), for the 5.96 L/min that 6 L/min of oil are."""
    page = (Path(__file__).parents[1] / "docs" / "fluids.md").read_text(encoding="utf-8")
    (text,) = re.findall(r"```yaml\n# file: two_fluids.yaml\n(.*?)```", page, re.DOTALL)
    (tmp_path / "two_fluids.yaml").write_text(text, encoding="utf-8")
    assert "at 25.2 bar: 6 L/min of oil at 0 bar gauge are 5.96 L/min there" in page
    oil = MineralOil(grade="ISO VG 46", temperature="50 degC")
    flow = 6 * LPM * oil.rho_0 / oil.density(25.2 * BAR)
    assert flow == pytest.approx(5.96 * LPM, abs=0.005 * LPM)
    water = Water()
    mass_flow = flow * water.density(25.2 * BAR)  # of the water that this volume drives out
    drop = (mass_flow / (0.7 * 2e-6)) ** 2 / (2 * water.density(12.6 * BAR))
    assert drop == pytest.approx(25.2 * BAR, abs=0.05 * BAR)
    result = cl.load(tmp_path / "two_fluids.yaml").simulate()
    assert result["water_side.p"][-1] == pytest.approx(drop, rel=1e-4)


def test_separator_stops() -> None:
    """10 cm^3 of way at 6 L/min: at 0.1 s, later by the oil's compression; then each side for itself, mass kept."""
    result = separated("150 ms", stop_when="piston.pressure_a > 200 bar")
    (stops,) = fired(result, "piston.stops_at_b")
    p = float(result["piston.pressure_a"][np.flatnonzero(result.time == stops)[0]])
    assert stops == pytest.approx(0.1 + (30e-6 * math.exp(p / BETA) - 30e-6) / 1e-4, rel=1e-6)
    assert result["piston.V_a"][-1] == pytest.approx(30e-6, rel=1e-12)
    assert result["piston.pressure_a"][-1] == pytest.approx(200 * BAR, rel=1e-9)
    later = (30e-6 * math.exp(200 * BAR / BETA) - 30e-6 * math.exp(p / BETA)) / 1e-4
    assert result.time[-1] - stops == pytest.approx(later, rel=1e-5)
    assert result["piston.pressure_b"][-1] < 1.0
    assert result.balance is not None
    assert result.balance.circuit < 1e-6
    assert energy_error(result) < 1e-6


def test_separator_leaves_its_stop() -> None:
    """Driven to and fro by 4 cm^3 from a place 2 cm^3 before its stop: rests there, leaves, does not chatter."""
    parts = {
        "law": {"type": "sine", "amplitude": "6 L/min", "frequency": "8 Hz"},
        "pump": {"type": "signal_flow_source"},
        "piston": {"type": "piston_separator", "volume": "20 cm^3", "share_a": "90 %", "start_pressure": "50 bar"},
        "store": {"type": "gas_accumulator", "volume": "0.1 L", "preload": "30 bar", "start": {"p": "50 bar"}},
    }
    nets = {
        "s": ["law.y", "pump.flow"], "a": {"fluid": "oil", "ports": ["pump.port", "piston.a"]},
        "b": {"fluid": "water", "ports": ["piston.b", "hole.a"]}, "c": ["hole.b", "store.port"],
    }  # fmt: skip
    parts["hole"] = {"type": "orifice", "area": "20 mm^2"}
    result = circuit(
        components=parts, nets=nets, fluids={"oil": OIL, "water": WATER}, simulation={"stop": "250 ms", "rtol": "1e-8"}
    ).simulate()
    assert len(fired(result, "piston.stops_at_b")) == 2
    assert len(fired(result, "piston.leaves")) == 2
    resting = result["piston.at"] == 1
    assert result["piston.V_a"][resting] == pytest.approx(30e-6, rel=1e-12)
    assert result["piston.pressure_a"].max() > 300 * BAR
    free = result["piston.at"] == 0
    assert np.abs(result["piston.pressure_a"] - result["piston.pressure_b"])[free].max() < 100.0
    assert result.balance is not None
    assert result.balance.circuit < 1e-6
    assert energy_error(result) < 1e-6


TWO_FLUIDS = """\
crescentlab: 1
fluids:
  oil: {type: mineral_oil, grade: ISO VG 46}
  water: {type: water}
components:
  pump: {type: flow_source, flow: 6 L/min}
  piston: {type: piston_separator, volume: 20 cm^3}
  hole: {type: orifice, area: 2 mm^2}
  tank: {type: tank}
nets:
  oil_side: {fluid: oil, ports: [pump.port, piston.a]}
  water_side: {fluid: water, ports: [piston.b, hole.a]}
  out: [hole.b, tank.port]
simulation: {stop: 10 ms}
"""


def test_two_fluids_may_not_meet(refused: Refusal) -> None:
    """Side b is joined to a net of oil: the net is named, and a separator advised."""
    out = "  out: {fluid: oil, ports: [hole.b, tank.port]} <--"
    said = refused(TWO_FLUIDS.replace("  out: [hole.b, tank.port]", out))
    assert said == "net out: the fluids water and oil meet here; put a separator between them"


def test_a_side_without_a_fluid(refused: Refusal) -> None:
    """A separator does not pass a fluid on, so its other side must name one."""
    text = TWO_FLUIDS.replace("{fluid: water, ports: [piston.b, hole.a]}", "[piston.b, hole.a]")
    said = refused(text.replace("volume: 20 cm^3}", "volume: 20 cm^3} <--"))
    assert said.startswith("piston: its nets name no fluid; give one of them a fluid")
