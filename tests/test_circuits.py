"""Every shipped circuit runs as it is, gives the numbers its header promises, keeps its fluid, and keeps its names."""

from __future__ import annotations

import functools
import math
import re

import numpy as np
import pytest

import crescentlab as cl
from crescentlab.circuit import Circuit, shipped
from crescentlab.netlist import Netlist
from crescentlab.result import Result

BAR, LPM, MS, MM = 1e5, 1e-3 / 60, 1e-3, 1e-3
CIRCUITS = sorted(shipped())
PARTS = sorted(p for p in next(iter(shipped().values())).parent.glob("*_part.yaml"))


@functools.cache
def circuit(name: str) -> Circuit:
    """A shipped circuit, assembled once."""
    return cl.load(name)


@functools.cache
def as_shipped(name: str) -> Result:
    """The run that the file itself asks for."""
    return circuit(name).simulate()


def header(name: str) -> str:
    """The comment that opens a circuit file, on one line."""
    lines = shipped()[name].read_text(encoding="utf-8").splitlines()
    comment = [line.removeprefix("#").strip() for line in lines[: next(k for k, x in enumerate(lines) if x[:1] != "#")]]
    return re.sub(r"\s+", " ", " ".join(comment))


def promises(name: str, *texts: str) -> None:
    """The header still says what a test below checks."""
    for text in texts:
        assert text in header(name), f"{name}: the header no longer says {text!r}; change the test with it"


def test_the_shipped_circuits():
    """The names that users type."""
    assert {"crescent_pump", "relief_valve", "water_hammer"} <= set(CIRCUITS)
    assert {"delivery_line_part", "relief_valve_part"} <= {p.stem for p in PARTS}


@pytest.mark.parametrize("name", CIRCUITS)
def test_runs_as_shipped(name):
    """To its own end, without a warning, every variable finite, and the header says what to expect."""
    result = as_shipped(name)
    assert result.trajectory.complete
    assert not result.trajectory.warnings
    assert result.time[-1] == pytest.approx(circuit(name).netlist.sections.simulation.stop)
    assert "Expected" in header(name)
    for column, series in result.columns().items():
        assert np.isfinite(series).all(), column


@pytest.mark.parametrize("part", PARTS, ids=lambda p: p.stem)
def test_a_part_alone_has_a_causality(part):
    """A part is checked with its ports open."""
    Circuit(Netlist.read(part)).plan(allow_open=True)


@pytest.mark.parametrize("name", CIRCUITS)
def test_the_ledgers_close(name):
    """Fluid to 5e-6 at the circuit's own tolerance, energy to 1e-6 and in total, and nothing that is warned of.

    The pumps' volumes are a thousandth of what flows through them: their fluid reads the tolerance of its pressures.
    """
    balance = as_shipped(name).balance
    assert balance is not None
    assert max(balance.components.values(), default=0.0) < 5e-6
    assert balance.warnings == []
    energy = balance.energy
    assert energy is not None
    assert max(energy.components.values()) < 1e-6
    spent = [*energy.dissipated.values(), *energy.silent.values(), energy.stored]
    given = sum(energy.supplied.values()) + sum(energy.at_events.values())
    largest = max(map(abs, [*spent, *energy.supplied.values()]))
    assert abs(given - sum(spent)) < 1e-5 * largest


@pytest.mark.parametrize("name", ["relief_valve", "crescent_pump"])
def test_balance(name):
    """Per component and for the circuit less than 1e-6 of what passes is lost, as shipped."""
    ledger = as_shipped(name).balance
    assert ledger is not None
    assert ledger.circuit < 1e-6
    for component, error in ledger.components.items():
        assert error < 1e-6, component


def test_balance_of_a_line_alone():
    """A transmission line keeps its fluid by its own law: what enters at the ends between ticks is integrated, 1e-5."""
    ledger = as_shipped("water_hammer").balance
    assert ledger is not None
    assert ledger.circuit < 1e-5


# --- relief_valve -----------------------------------------------------------------------------------------------------


def density_ratio(p: float) -> float:
    """rho(p)/rho(0) of the aerated oil by hand: 0.5 % air, n = 1.4, saturated at 1000 bar absolute."""

    def volume(gauge: float) -> float:
        P, atm, sat = gauge + 101325.0, 101325.0, 1e8
        return math.exp(-gauge / 1.4e9) + 0.005 / 0.995 * (sat - P) / (sat - atm) * (atm / P) ** (1 / 1.4)

    return volume(0.0) / volume(p)


def test_relief_valve_opens():
    """6.5 bar at 0.319 ms: 70 cm^3 take up what 30 L/min bring, q t = V (rho(6.5 bar) - rho(1 bar))/rho_0."""
    promises("relief_valve", "reaches 6.5 bar at 0.319 ms")
    result = as_shipped("relief_valve")
    by_hand = 70e-6 * (density_ratio(6.5 * BAR) - density_ratio(1 * BAR)) / (30 * LPM)
    assert by_hand == pytest.approx(0.319 * MS, abs=0.0005 * MS)
    (opens,) = [h.time for h in result.trajectory.happenings if "valve.spool.leaves" in h.names]
    assert opens == pytest.approx(by_hand, rel=1e-4)
    assert result["line.p"][np.flatnonzero(result.time == opens)] == pytest.approx(6.5 * BAR, rel=1e-5)
    assert np.all(result["valve.x"][result.time < opens] == 0)


def test_relief_valve_overshoots():
    """Header: peak 26.7 bar at 0.78 ms, lift at most 1.47 mm; to the digits printed, 5 us for the steps of the run."""
    promises("relief_valve", "peak 26.7 bar at 0.78 ms", "lift at most 1.47 mm")
    result = as_shipped("relief_valve")
    k = np.argmax(result["line.p"])
    assert result["line.p"][k] == pytest.approx(26.7 * BAR, abs=0.05 * BAR)
    assert result.time[k] == pytest.approx(0.78 * MS, abs=0.01 * MS)
    assert result["valve.x"].max() == pytest.approx(1.47 * MM, abs=0.005 * MM)


def test_relief_valve_regulates():
    """Header: from 10 ms on 7.98 bar at 1.216 mm with 0.414 bar in the chamber, and the balance of forces there."""
    promises("relief_valve", "7.98 bar at 1.216 mm", "0.414 bar", "122.8 = 100.1 + 10.9 + 5.4 + 6.4 N")
    result = as_shipped("relief_valve")
    late = result.time >= 10 * MS
    assert result["line.p"][late] == pytest.approx(7.98 * BAR, abs=0.005 * BAR)
    assert result["valve.x"][late] == pytest.approx(1.216 * MM, abs=0.0005 * MM)
    assert result["valve.p_chamber.value"][late] == pytest.approx(0.414 * BAR, abs=0.0005 * BAR)
    area, p = math.pi / 4 * (14 * MM) ** 2, result["line.p"][-1]
    rho_0 = 860 * (1 - 0.005)
    jet = 0.82 * rho_0 * 30 * LPM * math.sqrt(2 * p / (rho_0 * density_ratio(p / 2))) * math.cos(math.radians(69))
    forces = [6.5 * BAR * area, 9000 * result["valve.x"][-1], jet, result["valve.p_chamber.value"][-1] * area]
    assert forces == pytest.approx([100.1, 10.9, 5.4, 6.4], abs=0.05)
    assert sum(forces) == pytest.approx(p * area, rel=1e-3)
    assert p * area == pytest.approx(122.8, abs=0.06)


@pytest.mark.parametrize(("flow", "bar"), [(2, 6.65), (48, 9.02), (54, 9.42)])
def test_relief_valve_at_other_flows(flow, bar):
    """Header: regulated pressures, to the digits printed."""
    promises("relief_valve", f"{bar} bar at {flow} L/min")
    result = circuit("relief_valve").simulate(parameters={"supply": f"{flow} L/min"})
    assert result["line.p"][-1] == pytest.approx(bar * BAR, abs=0.006 * BAR)
    assert result["valve.q"][-1] == pytest.approx(flow * LPM, rel=1e-4)


# --- water_hammer -----------------------------------------------------------------------------------------------------

WAVE = math.sqrt(1.6e9 / 870)


def at(result: Result, name: str, time: float) -> float:
    """Value at a time between rows."""
    return float(np.interp(time, result.time, result[name]))


def test_water_hammer_jump():
    """Joukowsky: dp = rho a dv = 870 * 1356.1 * 1 = 11.798 bar; 0.5 % for density and wave speed at 20 to 32 bar."""
    promises("water_hammer", "1356.1 m/s", "11.798 bar per m/s", "from 19.93 to 31.72 bar")
    assert pytest.approx(1356.1, abs=0.05) == WAVE
    assert pytest.approx(11.798 * BAR, abs=0.0005 * BAR) == 870 * WAVE
    result = as_shipped("water_hammer")
    before, after = at(result, "p_valve.p", 4.99 * MS), at(result, "p_valve.p", 5.05 * MS)
    assert before == pytest.approx(19.93 * BAR, abs=0.005 * BAR)
    assert after == pytest.approx(31.72 * BAR, abs=0.01 * BAR)
    assert after - before == pytest.approx(870 * WAVE, rel=5e-3)


def test_water_hammer_friction():
    """Header: steady friction takes 0.07 bar, laminar: 64/Re L/d rho v^2/2 with Re = 2000 is 0.0696 bar."""
    promises("water_hammer", "steady friction takes 0.07 bar")
    by_hand = 64 / 2000 * 10 / 0.02 * 870 / 2
    assert by_hand == pytest.approx(0.0696 * BAR, rel=1e-3)
    assert 20 * BAR - at(as_shipped("water_hammer"), "p_valve.p", 4.9 * MS) == pytest.approx(by_hand, rel=0.01)


def test_water_hammer_period():
    """Header: 4 L/a = 29.5 ms, crossings of the reservoir's pressure every 14.7 ms; 0.5 % for the density.

    The line has 20 ticks per delay, and a front takes one: a crossing is known to a tick, the mean of many to less.
    """
    promises("water_hammer", "4 L/a = 29.5 ms", "2 L/a = 14.7 ms", "trough of 8.3 bar")
    result = as_shipped("water_hammer")
    p, t = result["p_valve.p"], result.time
    crossings = t[np.flatnonzero(np.diff(np.sign(p - 20 * BAR)))]
    assert crossings[0] == pytest.approx(5 * MS, abs=0.01 * MS)
    tick = 10 / WAVE / 20
    assert np.diff(crossings) == pytest.approx(2 * 10 / WAVE, abs=tick)
    assert np.diff(crossings[1:]).mean() == pytest.approx(2 * 10 / WAVE, rel=6e-3)
    assert at(result, "p_valve.p", 27 * MS) == pytest.approx(8.3 * BAR, abs=0.1 * BAR)


def test_water_hammer_later():
    """Header: no peak beyond Joukowsky's 11.80 bar from the reservoir's, and laminar damping of the plateaus.

    Linear waves with resistance R = 32 nu/d^2 [1/s] per mass fall by exp(-R t/2) = exp(-16 nu t/d^2): Wylie & Streeter
    (1993), chapter 12; 0.5 % of the jump for the density and the wave speed at 20 bar.
    """
    promises("water_hammer", "no peak above 20 + 11.80 bar, none below 20 - 11.80 bar", "31.4 bar 95 ms after")
    result, jump = as_shipped("water_hammer"), 870 * WAVE
    p = result["p_valve.p"]
    assert p.max() < 20 * BAR + 1.005 * jump
    assert p.min() > 20 * BAR - 1.005 * jump
    by_hand = 20 * BAR + jump * math.exp(-16 * 10e-6 * 95 * MS / 0.02**2)
    assert by_hand == pytest.approx(31.36 * BAR, abs=0.005 * BAR)
    assert at(result, "p_valve.p", 100 * MS) == pytest.approx(by_hand, abs=5e-3 * jump)


# --- crescent_pump ----------------------------------------------------------------------------------------------------


def test_crescent_pump_as_shipped():
    """Header: 3.0 bar, 25.5 L/min and 13 periods of ripple per revolution at 2000 rpm.

    25.5 is what is displaced, 13.689 cc/rev of oil at 3 bar, less the leakages.
    """
    promises("crescent_pump", "3.0 bar, 25.5 L/min", "13 periods per revolution (433.3 Hz)")
    result = as_shipped("crescent_pump")
    p, q = result.mean("delivery.p", 30 * MS, 60 * MS), result.mean("throttle.q", 30 * MS, 60 * MS)
    assert p == pytest.approx(3.0 * BAR, abs=0.05 * BAR)
    assert q == pytest.approx(25.5 * LPM, abs=0.05 * LPM)
    displaced = 13.689e-6 * 2000 / 60 * density_ratio(p)
    assert q == pytest.approx(displaced - result.mean("leakage.q", 30 * MS, 60 * MS), rel=1e-3)
    grid = 30 * MS + np.arange(13 * 100) / 1300 * 30 * MS
    swing = np.interp(grid, result.time, result["delivery.p"])
    assert np.argmax(np.abs(np.fft.rfft(swing - swing.mean()))) == 13


def test_crescent_pump_with_the_throttle_closed():
    """Header: about 9 bar at 4000 rpm."""
    promises("crescent_pump", "--set speed='4000 rpm' --set throttle_area='0 mm^2'", "holds about 9 bar")
    given = {"speed": "4000 rpm", "throttle_area": "0 mm^2"}
    result = circuit("crescent_pump").simulate("60 ms", given, solver="rk45", rtol=1e-5)
    assert result.mean("delivery.p", 45 * MS, 60 * MS) == pytest.approx(9 * BAR, abs=0.5 * BAR)


@pytest.mark.parametrize("rpm", [500, 1000, 2000, 3000, 4000])
@pytest.mark.parametrize("area", [0, 10, 24.6, 60])
def test_crescent_pump_starts_at_any_operating_point(rpm, area):
    """Over the paper's speeds the start follows from speed and throttle, so no shock outruns the line's time step."""
    given = {"speed": f"{rpm} rpm", "throttle_area": f"{area} mm^2"}
    result = circuit("crescent_pump").simulate("10 ms", given, solver="rk45", rtol=1e-4)
    assert result.trajectory.complete
    assert result["delivery.p"].max() < 12 * BAR


NAMES = [
    "delivery.p", "suction.p", "trapped.p", "annular.p", "p_throttle.p", "throttle.q", "relief.q", "relief.x",
    "tips.q", "axial.q", "radial.q", "leakage.q", "gears.dVd", "gears.dVs", "gears.dVt", "gears.torque",
    "gears.displacement", "pump.volumetric_efficiency", "pump.power", "shaft.phi", "cover_deflection.value",
    "driver.p", "driven.p", "line.filter.p",
]  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_names_of_variables(name):
    """Studies and plots rely on these."""
    result = as_shipped("crescent_pump")
    assert name in result.names
    assert result[name].shape[0] == result.time.size


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("speed", "3000 rpm"),
        ("throttle_area", "20 mm^2"),
        ("crescent_extension", "40 deg"),
        ("driver_teeth", "13"),
        ("driven_teeth", "16"),
        ("volumes", "mean"),
        ("start_pressure", "3 bar"),
    ],
)
def test_names_of_parameters(name, value):
    """What `--set` is documented with."""
    assert name in circuit("crescent_pump").netlist.sections.parameters
    circuit("crescent_pump").design({name: value})


def test_outputs_use_the_parameters_of_their_own_run():
    """A second run at another speed on the assembled circuit: `speed` in an output is that run's."""
    own = Circuit(Netlist.read(shipped()["crescent_pump"]))
    for rpm in (2000, 4000):
        given = {"speed": f"{rpm} rpm", "throttle_area": "40 mm^2"}
        result = own.simulate("1 ms", given, solver="rk45", rtol=1e-4)
        expected = result["gears.torque"] * rpm * math.pi / 30
        assert result["pump.power"] == pytest.approx(expected, rel=1e-9)
