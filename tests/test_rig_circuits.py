"""The crescent pump's test rig, by hand: what turns the shaft, what the meters show, where power and oil go."""

from __future__ import annotations

import functools
import math
import re

import numpy as np
import pytest
from pump_by_hand import PER_TURN, Oil, leakage, orifice, pipe_loss, suction_pressure
from scipy.integrate import trapezoid
from scipy.optimize import brentq
from scipy.signal import find_peaks

import crescentlab as cl
from crescentlab.circuit import shipped
from crescentlab.result import Result

BAR, LPM, MM = 1e5, 1e-3 / 60, 1e-3
PER_RADIAN = 12e-6 / (2 * math.pi)
"""Displacement of the motor [m^3/rad]."""


@functools.cache
def circuit() -> cl.Circuit:
    """The shipped circuit, assembled once."""
    return cl.load("test_rig")


@functools.cache
def run(asked: int = 2000, area: int = 26) -> Result:
    """As the file asks for, at a speed [rpm] asked for and an area of the throttle [mm^2]."""
    return circuit().simulate(parameters={"speed": f"{asked} rpm", "throttle_area": f"{area} mm^2"})


def mean(name: str, asked: int = 2000, area: int = 26) -> float:
    """Over the last 150 ms, in SI."""
    return run(asked, area).mean(name, 0.15, 0.3)


def in_rpm(omega: float) -> float:
    """A speed [rad/s] in rpm."""
    return omega * 30 / math.pi


def header() -> str:
    """The comment that opens the file, on one line."""
    lines = shipped()["test_rig"].read_text(encoding="utf-8").splitlines()
    comment = [line.removeprefix("#").strip() for line in lines[: lines.index("crescentlab: 1")]]
    return re.sub(r"\s+", " ", " ".join(comment))


# --- by hand ----------------------------------------------------------------------------------------------------------


def density_ratio(p: float) -> float:
    """rho(p)/rho(0) of the aerated oil by hand: 0.5 % air, n = 1.4, saturated at 1000 bar absolute."""

    def volume(gauge: float) -> float:
        P, atm, sat = gauge + 101325.0, 101325.0, 1e8
        return math.exp(-gauge / 1.4e9) + 0.005 / 0.995 * (sat - P) / (sat - atm) * (atm / P) ** (1 / 1.4)

    return volume(0.0) / volume(p)


def oil(p: float) -> Oil:
    """The oil at a pressure [Pa]."""
    return Oil(860 * 0.995 * density_ratio(p), 860 * 0.995, 35e-6)


def cooler_drop(q: float) -> float:
    """Of the cooler [Pa]: its measured curve, carried over from 860 kg/m^3 and 30 cSt."""
    heavier, flow = oil(0.0).rho / 860, q / LPM
    return BAR * heavier * (0.006 * 35 / 30 * flow + 1.5e-4 * flow**2)


def motor_speed(asked: float, drop: float, filling: float = 0.0) -> float:
    """Speed [rpm] of the motor at a drop [Pa] where `filling` [m^3/s] of its oil stays in the hose.

    It fills at the drop, and slips C_s D drop/(nu rho_0), both as mass over rho_0: of D omega_asked less the filling.
    """
    slip = 2e-9 * drop / (860 * 46e-6)
    return (asked - in_rpm(filling / PER_RADIAN) - in_rpm(slip)) / math.exp(drop / 1.4e9)


def by_hand(rpm: float, area: float = 26e-6) -> dict[str, float]:
    """Means at which throttle and return line take what the pump delivers."""

    def state(p_throttle: float) -> dict[str, float]:
        def through(back: float) -> float:
            return orifice(p_throttle - back, area, math.sqrt(4 * area / math.pi), oil((p_throttle + back) / 2))

        back = brentq(lambda p: cooler_drop(through(p)) - p, 0.0, p_throttle)
        q = through(back)
        seat = p_throttle + pipe_loss(q, 12 * MM, 720 * MM, 0.5, oil(p_throttle))
        p = seat + pipe_loss(q, 11 * MM, 130 * MM, 1.5, oil(seat))
        leaks = leakage(p, rpm, oil(p / 2))
        return {
            "flow_meter.y": q, "p_return.p": back, "p_throttle.p": p_throttle, "p_delivery.p": p,
            "pump.leakage.q": leaks, "surplus": PER_TURN * rpm / 60 * density_ratio(p) - leaks - q,
        }  # fmt: skip

    return state(brentq(lambda p: state(p)["surplus"], 0.01 * BAR, 6 * BAR))


# --- the drive --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("asked", "area"), [(1000, 26), (2000, 26), (3000, 26), (2000, 20)])
def test_the_speed_is_what_flow_and_slip_make_of_it(asked, area):
    """Continuity of the motor where it fills: slip and compression take some 0.6 rpm in 1000, known to 1 %.

    What the hose takes meanwhile is V/beta times its rise of pressure: the rotor swings against it.
    """
    r = run(asked, area)
    rise = r["p_drive.p"][-1] - r["p_drive.p"][r.time <= 0.15][-1]
    expected = motor_speed(asked, mean("p_drive.p", asked, area), 150e-6 / 1.4e9 * rise / 0.15)
    assert in_rpm(mean("shaft.omega", asked, area)) == pytest.approx(expected, abs=0.01 * (asked - expected))


def test_the_rotor_swings_on_the_hose():
    """sqrt(beta D^2/(V J)) of motor, hose of 150 cm^3, rotor of 25 kg cm^2; 2 %: neither damping nor pump is in it."""
    assert "= 18.6 Hz" in header()
    by_formula = math.sqrt(1.4e9 * PER_RADIAN**2 / (150e-6 * 25e-4)) / (2 * math.pi)
    assert by_formula == pytest.approx(18.6, abs=0.05)
    r = run()
    peaks, _ = find_peaks(r["shaft.omega"], prominence=0.1)  # the teeth's ripple is 0.01 rad/s
    t = r.time[peaks]
    assert (len(t) - 1) / (t[-1] - t[0]) == pytest.approx(by_formula, rel=0.02)


def test_the_motor_turns_what_the_meter_shows():
    """Mean torques balance: D dp = friction + torque at the meter; 1 %, the rotor still swings a little."""
    assert PER_RADIAN * mean("p_drive.p") == pytest.approx(0.6 + mean("torque_meter.y"), rel=0.01)


def test_torque_of_the_pump():
    """V/(2 pi) dp for what reaches delivery, and the work of squeezing the trapped volume, read from its own pressure.

    Squeezed are 3.975 mm^3 a pitch, 13 times a revolution. 1 % of the torque: the delivery's ripple, in phase with dV.
    """
    r = run()
    late = r.time > 0.15
    angle = r["shaft.phi"][late][-1] - r["shaft.phi"][late][0]
    squeezed = np.where(r["pump.trapped.exists"] > 0.5, -r["pump.gears.trapped.dV"], 0.0)
    volume = trapezoid(squeezed[late], r.time[late])
    assert volume == pytest.approx(3.975e-9 * 13 * angle / (2 * math.pi), rel=0.02)  # to a pitch in 65
    above = r["pump.trapped.p"] - r["p_delivery.p"]
    work = trapezoid((squeezed * above)[late], r.time[late])
    rise = mean("p_delivery.p") - suction_pressure(in_rpm(mean("shaft.omega")), oil(0.0)) - mean("p_sump.p")
    expected = PER_TURN / (2 * math.pi) * rise + work / angle
    assert mean("torque_meter.y") == pytest.approx(expected, rel=0.01)
    assert work / angle > 0.01 * expected


def test_power_goes_where_it_can():
    """Shaft power is torque times speed; the throttle's heat is its drop times its volume flow, 70 % as header says."""
    assert mean("shaft.power") == pytest.approx(mean("torque_meter.y") * mean("shaft.omega"), rel=1e-4)
    by_drop = (mean("p_throttle.p") - mean("p_return.p")) * mean("flow_meter.y")
    by_drop /= density_ratio((mean("p_throttle.p") + mean("p_return.p")) / 2)
    assert mean("throttle.heat") == pytest.approx(by_drop, rel=2e-3)  # p and q swing together by 2 %
    assert mean("throttle.heat") < mean("p_delivery.p") * mean("flow_meter.y") < mean("shaft.power")


def test_the_reservoir_feeds_the_pump():
    """rho g h of 250 mm, aerated oil at 0 bar; what is drawn returns, so the level moves by less than 0.1 mm."""
    r = run()
    assert mean("p_sump.p") == pytest.approx(oil(0.0).rho * 9.80665 * 0.25, rel=1e-3)
    assert np.ptp(r["reservoir.level"]) < 1e-4
    ledger = r.balance
    assert ledger is not None
    assert ledger.circuit < 1e-6


# --- means ------------------------------------------------------------------------------------------------------------

MEANS = ["flow_meter.y", "p_return.p", "p_throttle.p", "p_delivery.p"]


@pytest.mark.parametrize("asked", [1000, 2000, 3000])
@pytest.mark.parametrize("name", MEANS)
def test_follows_from_continuity(asked, name):
    """Displacement less gaps through line, throttle and cooler, by hand: 1 % as for the pump's other circuits."""
    expected = by_hand(in_rpm(mean("shaft.omega", asked)))
    assert mean(name, asked) == pytest.approx(expected[name], rel=0.01)


def test_header():
    """The numbers that the file promises, to their digits."""
    told = header()
    for text in (
        "speed 1999 rpm: of 24.00 L/min the motor turns 23.98", "at 6.66 bar take 0.02", "torque 0.672 N m",
        "= 0.65 N m", "pump 3.0 bar and 25.5 L/min", "27.4 L/min x 1.003", "1.9 leak", "2.6 bar reach the throttle",
        "return 0.27 bar", "power 141 W", "99 W into heat", "at 250 mm, 5 L", "0.02 bar on the pump's inlet",
    ):  # fmt: skip
        assert text in told
    rpm = in_rpm(mean("shaft.omega"))
    expected = by_hand(rpm)
    assert rpm == pytest.approx(1999, abs=0.5)
    assert motor_speed(2000, 6.66 * BAR) == pytest.approx(1999, abs=0.5)
    assert 12e-6 * rpm / 60 == pytest.approx(23.98 * LPM, abs=0.005 * LPM)
    assert (0.6 + mean("torque_meter.y")) / PER_RADIAN == pytest.approx(6.66 * BAR, abs=0.005 * BAR)
    assert mean("p_drive.p") == pytest.approx(6.66 * BAR, abs=0.05 * BAR)  # still rises to it
    assert mean("torque_meter.y") == pytest.approx(0.672, abs=5e-4)
    assert PER_TURN / (2 * math.pi) * mean("p_delivery.p") == pytest.approx(0.65, abs=5e-3)
    assert PER_TURN * rpm / 60 == pytest.approx(27.4 * LPM, abs=0.05 * LPM)
    assert density_ratio(3 * BAR) == pytest.approx(1.003, abs=5e-4)
    for found in (expected, {name: mean(name) for name in [*MEANS, "pump.leakage.q"]}):
        assert found["p_delivery.p"] == pytest.approx(3.0 * BAR, abs=0.05 * BAR)
        assert found["flow_meter.y"] == pytest.approx(25.5 * LPM, abs=0.1 * LPM)
        assert found["pump.leakage.q"] == pytest.approx(1.9 * LPM, abs=0.1 * LPM)
        assert found["p_throttle.p"] == pytest.approx(2.6 * BAR, abs=0.05 * BAR)
        assert found["p_return.p"] == pytest.approx(0.27 * BAR, abs=0.006 * BAR)
    assert mean("shaft.power") == pytest.approx(141, abs=0.5)
    assert mean("throttle.heat") == pytest.approx(99, abs=0.5)
    assert np.all(run()["pump.relief.q"] == 0)
