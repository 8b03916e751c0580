"""The run-up of the crescent pump: angle, closings and orders of a shaft whose speed rises, and the pump as a part."""

from __future__ import annotations

import functools
import math
import re

import numpy as np
import pytest
from pump_by_hand import PER_TURN, Oil, leakage, orifice, pipe_loss
from scipy.optimize import brentq

import crescentlab as cl
from crescentlab.circuit import shipped
from crescentlab.netlist import Netlist
from crescentlab.result import Result

BAR, LPM, MM = 1e5, 1e-3 / 60, 1e-3
SLOW, FAST, HOLD, RAMP = 500.0, 4000.0, 0.24, 2.0
"""Speeds [rpm], time before the ramp and of the ramp [s]."""


@functools.cache
def circuit() -> cl.Circuit:
    """The shipped circuit, assembled once."""
    return cl.load("crescent_pump_run_up")


@functools.cache
def run() -> Result:
    """As the file asks for."""
    return circuit().simulate()


@functools.cache
def steady(rpm: float) -> Result:
    """The same circuit at one speed: sixteen revolutions."""
    return circuit().simulate(f"{16 * 60 / rpm} s", {"speed": f"{rpm} rpm", "end_speed": f"{rpm} rpm"})


def turns_at(t: float) -> float:
    """Revolutions of the shaft after t [s], by hand: the speed's integral."""
    ramp, after = min(max(t - HOLD, 0.0), RAMP), max(t - HOLD - RAMP, 0.0)
    before = min(t, HOLD)
    return (SLOW * (before + ramp) + (FAST - SLOW) * ramp**2 / (2 * RAMP) + FAST * after) / 60


def when_at(turns: float) -> float:
    """Time [s] at which the shaft has turned so often."""
    return float(brentq(lambda t: turns_at(t) - turns, 0.0, HOLD + RAMP + 0.12))


def orders(result: Result, first: float, turns: int = 2) -> np.ndarray:
    """Amplitudes [Pa] of the delivery pressure over the shaft's angle, `turns` per order; Hann's window, trend taken
    off, from a revolution on."""
    n = 4096 * turns
    angle = 2 * math.pi * (first + np.arange(n) / n * turns)
    rows = np.concatenate(([True], np.diff(result["shaft.phi"]) > 0))
    p = np.interp(angle, result["shaft.phi"][rows], result["p_delivery.p"][rows])
    window = np.hanning(n)
    return np.abs(np.fft.rfft((p - np.polyval(np.polyfit(angle, p, 2), angle)) * window)) * 2 / window.sum()


def density_ratio(p: float) -> float:
    """rho(p)/rho(0) of the aerated oil by hand: 0.5 % air, n = 1.4, saturated at 1000 bar absolute."""

    def volume(gauge: float) -> float:
        P, atm, sat = gauge + 101325.0, 101325.0, 1e8
        return math.exp(-gauge / 1.4e9) + 0.005 / 0.995 * (sat - P) / (sat - atm) * (atm / P) ** (1 / 1.4)

    return volume(0.0) / volume(p)


def oil(p: float) -> Oil:
    """The oil at a pressure [Pa]."""
    return Oil(860 * 0.995 * density_ratio(p), 860 * 0.995, 35e-6)


def header() -> str:
    """The comment that opens the file, on one line."""
    lines = shipped()["crescent_pump_run_up"].read_text(encoding="utf-8").splitlines()
    comment = [line.removeprefix("#").strip() for line in lines[: lines.index("crescentlab: 1")]]
    return re.sub(r"\s+", " ", " ".join(comment))


# --- the shaft and what hangs on its angle ----------------------------------------------------------------------------


def test_revolutions():
    """Header: 2 + 75 + 8 = 85, the integral of the speed; the angle of every row, to the solver's tolerance, 1e-4 of
    a radian over 534."""
    assert "2 + 75 + 8 = 85 revolutions" in header()
    assert turns_at(HOLD + RAMP + 0.12) == pytest.approx(85, rel=1e-12)
    rows = np.linspace(0, run().time.size - 1, 2000).astype(int)
    by_hand = np.array([2 * math.pi * turns_at(t) for t in run().time[rows]])
    assert run()["shaft.phi"][rows] == pytest.approx(by_hand, abs=1e-4)


@pytest.mark.parametrize("event", ["pump.gears.meshes", "pump.driver.closes", "pump.driven.closes"])
def test_every_tooth_closes_its_volume(event):
    """13 volumes a revolution on either gear, 1105 in all, evenly over the angle although the speed changes.

    The angle follows from each event's time by hand; 1e-4 rad as above, a pitch is 0.483.
    """
    assert "each closes 13 volumes a revolution, 1105 in all" in header()
    times = [h.time for h in run().trajectory.happenings for name in h.names if name == event]
    angles = 2 * math.pi * np.array([turns_at(t) for t in times])
    assert len(times) == pytest.approx(1105, abs=1)
    assert np.diff(angles) == pytest.approx(2 * math.pi / 13, abs=1e-4)


def test_tips_drag_with_the_speed_of_the_shaft():
    """Eqs. 24 and 25: the tips' flow less its pressure part is -h H R tau omega/2 of both gears, at any speed.

    Both as mass flow over rho_0, of the oil at the gap's mean pressure. Read where both chains hold no closed volume,
    so that one gap of each lies between delivery and suction, rows of the whole ramp. 2e-4: lengths to four digits.
    """
    r = run()
    free = (r["pump.driver.exists"][:, 0] == 0) & (r["pump.driven.exists"][:, 0] == 0)
    rows = np.flatnonzero(free)[::50]
    p, p_s = r["p_delivery.p"][rows], r["pump.suction.p"][rows]
    denser = np.array([density_ratio(x) for x in (p + p_s) / 2])
    drag, leak = 0.0, 0.0
    for radius, length, ratio in ((29.1, 2.149, 1.0), (28.6, 2.478, 13 / 16)):
        drag = drag + denser * 150e-6 * 13 * MM * radius * MM * ratio * r["turning.omega"][rows] / 2
        leak = leak + 13 * MM * (150e-6) ** 3 * (p - p_s) / (12 * 35e-6 * 860 * 0.995 * length * MM)
    assert np.ptp(r["turning.omega"][rows]) > 300
    assert r["pump.tips.q"][rows] == pytest.approx(leak - drag, abs=2e-4 * float(np.max(drag)))


# --- orders -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("first", [10, 20, 30, 40, 50, 60, 70, 80])
def test_order_of_the_teeth(first):
    """Orders 13, 26, 39 and nothing between; 13 leads from 1000 rpm on.

    Between: 2 % of the leading one while the ripple grows over the window, 1 % once the speed is constant.
    """
    assert "13 leads from 1000 rpm on" in header()
    amplitude = orders(run(), first)
    leader = amplitude[2 * 13]
    assert np.argmax(amplitude) == 2 * 13
    order = np.arange(amplitude.size) / 2
    between = (order > 4) & (np.abs(order - 13 * np.round(order / 13)) > 1.1)
    assert amplitude[between].max() < (0.02 if first < 78 else 0.01) * leader
    for k in (2, 3):
        assert amplitude[2 * 13 * k] > 5 * amplitude[between].max()


def test_frequencies_of_the_order():
    """13 n/60: 108.3 Hz at 500 rpm to 866.7 Hz at 4000 rpm, in the time of the two constant speeds; one bin."""
    assert "108.3 Hz at 500 rpm to 866.7 Hz at 4000 rpm" in header()
    for start, stop, rpm, harmonic in ((0.12, 0.24, SLOW, 2), (2.24, 2.36, FAST, 1)):
        t = np.linspace(start, stop, 4096, endpoint=False)
        p = np.interp(t, run().time, run()["p_delivery.p"])
        peak = np.argmax(np.abs(np.fft.rfft(p - p.mean()))) / (stop - start)
        assert peak == pytest.approx(harmonic * 13 * rpm / 60, abs=1 / (stop - start))


def test_second_harmonic_leads_at_the_start():
    """Header: soft oil puts the resonance of delivery volume and duct near order 26 at 500 rpm, 216.7 Hz.

    L = rho l/A of the duct; C of 13.8 cm^3 with the cover and half the duct, in series with 70 cm^3 and the other half;
    beta = rho dp/drho of the oil there. One lump, and the pipe beyond is left out: 15 %.
    """
    r = run()
    p = r.mean("p_delivery.p", 0.12, 0.24)
    beta = density_ratio(p) / ((density_ratio(p + 10) - density_ratio(p - 10)) / 20)
    bore = math.pi / 4 * (11 * MM) ** 2
    inertance, half = oil(p).rho * 0.130 / bore, bore * 0.065
    near, far = (13.8e-6 + half) / beta + 600e-6 * 16e-6 / 3e5, (70e-6 + half) / beta
    resonance = 1 / (2 * math.pi * math.sqrt(inertance * near * far / (near + far)))
    assert resonance == pytest.approx(2 * 13 * 500 / 60, rel=0.15)
    amplitude = orders(r, 1, turns=1)
    assert np.argmax(amplitude[5:]) + 5 == 26
    assert amplitude[26] > amplitude[13]


@pytest.mark.parametrize("rpm", [2000.0, 3000.0, 4000.0])
def test_ripple_is_that_of_constant_speed(rpm):
    """The ramp is slow: 50 rpm a revolution at 2000 rpm, so that order 13 is as at that speed held, within 3 %."""
    t = HOLD + RAMP * (rpm - SLOW) / (FAST - SLOW)
    found = orders(run(), turns_at(t) - 1)[26] if rpm < FAST else orders(run(), 82)[26]
    assert found == pytest.approx(orders(steady(rpm), 13)[26], rel=0.03)


# --- means ------------------------------------------------------------------------------------------------------------


def by_hand(rpm: float) -> dict[str, float]:
    """Mean flow and pressures at which the throttle and the line take what the pump delivers."""

    def state(p_throttle: float) -> dict[str, float]:
        q = orifice(p_throttle, 38e-6, math.sqrt(4 * 38e-6 / math.pi), oil(p_throttle / 2))
        seat = p_throttle + pipe_loss(q, 12 * MM, 720 * MM, 0.5, oil(p_throttle))
        p = seat + pipe_loss(q, 11 * MM, 130 * MM, 1.5, oil(seat))
        leaks = leakage(p, rpm, oil(p / 2))
        surplus = PER_TURN * rpm / 60 * density_ratio(p) - leaks - q
        return {"throttle.q": q, "p_throttle.p": p_throttle, "p_delivery.p": p, "leakage": leaks, "surplus": surplus}

    return state(brentq(lambda p: state(p)["surplus"], 0.01 * BAR, 6 * BAR))


def test_means_of_the_header():
    """Displacement x speed less the closed forms of all gaps, 1 %; and the digits of the header, of run and by hand."""
    for text in ("6.9 L/min at 500 rpm, 51.5 L/min at 4000 rpm", "are displaced and 3.5 leak; 5.8 bar at the pump",
                 "4.5 bar before the throttle"):  # fmt: skip
        assert text in header()
    slow, fast = by_hand(SLOW), by_hand(FAST)
    names = ("throttle.q", "p_throttle.p", "p_delivery.p")
    found = [{name: run().mean(name, *span) for name in names} for span in ((0.12, 0.24), (2.24, 2.36))]
    for name in names:
        assert found[1][name] == pytest.approx(fast[name], rel=0.01)
    assert found[0]["throttle.q"] == pytest.approx(slow["throttle.q"], rel=0.01)
    for now in (found[1], fast):
        assert now["throttle.q"] == pytest.approx(51.5 * LPM, abs=0.1 * LPM)
        assert now["p_delivery.p"] == pytest.approx(5.8 * BAR, abs=0.06 * BAR)
        assert now["p_throttle.p"] == pytest.approx(4.5 * BAR, abs=0.06 * BAR)
    for now in (found[0], slow):
        assert now["throttle.q"] == pytest.approx(6.9 * LPM, abs=0.06 * LPM)
    assert run().mean("pump.leakage.q", 2.24, 2.36) == pytest.approx(3.5 * LPM, abs=0.05 * LPM)
    assert fast["leakage"] == pytest.approx(3.5 * LPM, rel=0.03)


def test_flow_follows_the_speed():
    """Two revolutions in eight places of the ramp: throttle flow = displaced volume x density less leakages; 0.2 %.

    The line fills as its pressure rises, which takes next to nothing: 180 cm^3 by 0.4 % in 2 s.
    """
    for first in (5, 10, 20, 30, 40, 50, 60, 70):
        span = (when_at(first), when_at(first + 2))
        displaced = 2 * PER_TURN / (span[1] - span[0]) * density_ratio(run().mean("p_delivery.p", *span))
        q = run().mean("throttle.q", *span) + run().mean("pump.leakage.q", *span)
        assert q == pytest.approx(displaced, rel=2e-3)


def test_nothing_else_happens():
    """The valve stays shut, the line's waves stay behind its time step, and the fluid is kept within 1e-5 (held
    speed)."""
    assert "relief valve stays closed" in header()
    assert np.all(run()["pump.relief.q"] == 0)
    assert run()["line.pipe.courant"].max() < 0.9
    assert run()["p_delivery.p"].max() < 6.5 * BAR
    ledger = steady(FAST).balance
    assert ledger is not None
    assert ledger.circuit < 1e-5


# --- the pump as a part -----------------------------------------------------------------------------------------------

RIG = {"shaft", "line", "throttle", "sump"}
"""Components of crescent_pump.yaml that are not the pump."""
START = {"start_pressure", "start_lift"}
"""Parameters that crescent_pump.yaml works out and the part is given."""


def files() -> tuple[Netlist, Netlist]:
    """crescent_pump.yaml and crescent_pump_part.yaml."""
    whole = shipped()["crescent_pump"]
    return Netlist.read(whole), Netlist.read(whole.parent / "crescent_pump_part.yaml")


def test_the_part_is_the_pump_of_the_test_rig():
    """Components, parameters and outputs of the part are word for word those of crescent_pump.yaml without the rig."""
    whole, part = (netlist.sections for netlist in files())
    assert dict(part.components) == {name: c for name, c in whole.components.items() if name not in RIG}
    operation = {"speed", "throttle_area", "pump_flow", "open_flow", "start_flow"}
    assert set(part.parameters) == set(whole.parameters) - operation
    assert {n: v for n, v in part.parameters.items() if n not in START} == {
        n: v for n, v in whole.parameters.items() if n not in operation | START
    }
    shared = set(part.outputs) & set(whole.outputs)
    assert {"tips.q", "axial.q", "radial.q", "leakage.q"} <= shared
    assert all(part.outputs[name] == whole.outputs[name] for name in shared)


def test_the_part_has_the_nets_of_the_test_rig():
    """Every net of the part joins what it joins there, without the rig's ports."""
    whole, part = (netlist.sections for netlist in files())
    kept = {name: [p for p in ports if p.split(".")[0] not in RIG] for name, ports in whole.nets.items()}
    assert {name: list(ports) for name, ports in part.nets.items()} == {n: p for n, p in kept.items() if p}


def test_the_part_runs_as_the_test_rig():
    """At 2000 rpm held the run-up circuit gives what crescent_pump gives from an equal start: a hundred tolerances."""
    start = {"start_pressure": "1.3 bar", "start_flow": "26 L/min", "throttle_area": "38 mm^2", "speed": "2000 rpm"}
    options = {"solver": "rk45", "rtol": 1e-6, "output_step": "50 us"}
    part = circuit().simulate("6 ms", start | {"end_speed": "2000 rpm"}, **options, compile=False)
    whole = cl.load("crescent_pump").simulate("6 ms", start | {"start_lift": "0 mm"}, **options, compile=False)
    for a, b in (("p_delivery.p", "p_delivery.p"), ("pump.p_suction.p", "p_suction.p"), ("throttle.q", "throttle.q")):
        assert part.time == pytest.approx(whole.time, abs=1e-12)
        assert part[a] == pytest.approx(whole[b], abs=1e-4 * float(np.abs(whole[b]).max()))
