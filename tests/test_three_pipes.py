"""A branch of three pipes against Hagen and Poiseuille, and against what a wave does where impedances change."""

from __future__ import annotations

import functools
import math
import re

import numpy as np
import pytest

import crescentlab as cl
from crescentlab.analysis.steady import steady
from crescentlab.circuit import shipped
from crescentlab.result import Result

BAR, LPM, MM = 1e5, 1e-3 / 60, 1e-3
RHO, NU, BETA = 860.0, 35e-6, 1.4e9
A = math.sqrt(BETA / RHO)
"""Wave speed [m/s]."""
LENGTHS, DIAMETERS = (4.0, 3.0, 5.0), (12 * MM, 10 * MM, 12 * MM)


@functools.cache
def circuit() -> cl.Circuit:
    """The shipped circuit, assembled once."""
    return cl.load("three_pipes")


@functools.cache
def run(diameter_1: str = "12 mm") -> Result:
    """As the file asks for."""
    return circuit().simulate(parameters={"diameter_1": diameter_1})


def at(name: str, t: float, diameter_1: str = "12 mm") -> float:
    """A variable at a time [s]."""
    result = run(diameter_1)
    return float(np.interp(t, result.time, result[name]))


def areas(diameter_1: float = 12 * MM) -> list[float]:
    """Bores [m^2]."""
    return [math.pi / 4 * d**2 for d in (diameter_1, *DIAMETERS[1:])]


def resistance(pipe: int) -> float:
    """128 mu l/(pi d^4) [Pa s/m^3]."""
    return 128 * RHO * NU * LENGTHS[pipe - 1] / (math.pi * DIAMETERS[pipe - 1] ** 4)


SHARE = resistance(3) / (resistance(2) + resistance(3))
"""Of pipe 2, by hand."""
PASSED = 2 * areas()[0] / sum(areas())
"""Wave passed on over wave arriving, by hand: 2 Y_1/(Y_1 + Y_2 + Y_3) with Y = A/(rho a)."""
LOST = math.exp(-16 * NU * LENGTHS[0] / (A * DIAMETERS[0] ** 2))
"""What laminar friction leaves of a wave after 4 m: the front of the telegraph equation, exp(-R l/(2 Z))."""
WAVE = RHO * A / areas()[0] * LPM
"""Joukowsky's rise for 1 L/min [Pa]."""
OPENS, RISE = 5e-3, 0.5e-3
"""Start and duration of the pump's ramp [s]."""


def header() -> str:
    """The comment that opens the file, on one line."""
    lines = shipped()["three_pipes"].read_text(encoding="utf-8").splitlines()
    comment = [line.removeprefix("#").strip() for line in lines[: lines.index("crescentlab: 1")]]
    return re.sub(r"\s+", " ", " ".join(comment))


# --- steady -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("when", "flow"), [(None, 6.0), ("1 s", 7.0)], ids=["before", "after"])
def test_flow_divides_by_friction(when, flow):
    """Hagen and Poiseuille in each pipe, continuity at the branch; 1e-4: oil of 3 bar is 2e-4 denser than at 0."""
    point = steady(circuit(), at=when).result
    parts = [flow, SHARE * flow, (1 - SHARE) * flow]
    for pipe, part in enumerate(parts, start=1):
        assert point[f"pipe_{pipe}.q"][0] == pytest.approx(part * LPM, rel=1e-4)
    along = [point["p_pump.p"][0] - point["p_junction.p"][0], *[point["p_junction.p"][0] - 3 * BAR] * 2]
    for pipe, (drop, part) in enumerate(zip(along, parts, strict=True), start=1):
        assert drop == pytest.approx(resistance(pipe) * part * LPM, rel=3e-4)


def test_the_run_starts_at_rest():
    """The file's own start is the steady state: until the pump changes, nothing moves by more than 1e-4 of it."""
    r = run()
    before = r.time < OPENS
    expected = {"p_pump.p": at("p_pump.p", 0.0), "pipe_2.q": SHARE * 6 * LPM, "pipe_3.q": (1 - SHARE) * 6 * LPM}
    for name, value in expected.items():
        assert r[name][before] == pytest.approx(value, rel=1e-4)


# --- the wave ---------------------------------------------------------------------------------------------------------


def crossing(name: str, level: float, first: float) -> float:
    """When a variable first passes a level after a time [s]."""
    r = run()
    late = r.time >= first
    return float(r.time[late][np.argmax(r[name][late] > level)])


def test_it_starts_with_joukowsky():
    """rho a/A dq at the end of the ramp; friction adds R/(2 Z) a per second, 0.3 % in 0.5 ms."""
    assert at("p_pump.p", OPENS + RISE) - at("p_pump.p", OPENS) == pytest.approx(WAVE, rel=0.005)


def test_it_arrives_in_time():
    """Half of the rise is at the branch l/a after the middle of the ramp; a tick is 50 us."""
    level = at("p_junction.p", OPENS) + PASSED * LOST * WAVE / 2
    assert crossing("p_junction.p", level, OPENS) == pytest.approx(OPENS + RISE / 2 + LENGTHS[0] / A, abs=50e-6)


def test_it_is_passed_on_by_areas():
    """2 Y_1/(Y_1 + Y_2 + Y_3) of what arrives; 0.5 % for the rounded front, and what follows it by friction."""
    behind = OPENS + RISE + LENGTHS[0] / A + 0.4e-3
    rise = at("p_junction.p", behind) - at("p_junction.p", OPENS)
    assert rise == pytest.approx(PASSED * LOST * WAVE, rel=0.005)
    taken = [at(f"pipe_{pipe}.q", behind) - at(f"pipe_{pipe}.q", OPENS) for pipe in (2, 3)]
    for pipe, flow in zip((2, 3), taken, strict=True):
        assert flow == pytest.approx(rise * areas()[pipe - 1] / (RHO * A), rel=0.005)
    assert taken[0] / taken[1] == pytest.approx(areas()[1] / areas()[2], rel=0.005)
    assert taken[0] / sum(taken) < SHARE - 0.03  # friction would divide it another way


def reflected(diameter_1: str = "12 mm") -> float:
    """Change of the pump's pressure [Pa] by what comes back, over the straight line on which it went before."""
    back = OPENS + 2 * LENGTHS[0] / A
    t = np.linspace(OPENS + 1e-3, back - 0.2e-3, 50)
    p = [at("p_pump.p", x, diameter_1) for x in t]
    behind = back + RISE + 0.8e-3
    return at("p_pump.p", behind, diameter_1) - float(np.polyval(np.polyfit(t, p, 1), behind))


def test_the_rest_comes_back():
    """(Y_1 - Y_2 - Y_3)/(Y_1 + Y_2 + Y_3) of what arrived returns, and the pump doubles it; 1 % as the front rings."""
    assert reflected() == pytest.approx(2 * (PASSED - 1) * LOST**2 * WAVE, rel=0.01)


def test_a_branch_of_equal_area_reflects_nothing():
    """A_1 = A_2 + A_3; the junction's 2 cm^3 let 1 % of the front back, for microseconds only."""
    assert "--set diameter_1='15.6205 mm'" in header()
    diameter_1 = math.sqrt(DIAMETERS[1] ** 2 + DIAMETERS[2] ** 2)
    assert diameter_1 == pytest.approx(15.6205 * MM, rel=1e-6)
    arrived = RHO * A / areas(diameter_1)[0] * LPM
    assert abs(reflected("15.6205 mm")) < 0.01 * arrived
    assert abs(reflected()) > 0.4 * WAVE


def test_what_enters_the_branch_leaves_it():
    """Continuity at every row to what the junction's 2 cm^3 take up, and in the ledger of the whole run."""
    r = run()
    stays = r["pipe_1.b.q"] + r["pipe_2.a.q"] + r["pipe_3.a.q"] + r["junction.port.q"]
    assert np.abs(stays).max() < 1e-9 * LPM
    assert np.abs(r["junction.port.q"][r.time < OPENS]).max() < 1e-4 * LPM
    ledger = r.balance
    assert ledger is not None
    assert ledger.circuit < 1e-5


def test_header():
    """The numbers that the file promises, to their digits."""
    told = header()
    for text, value, digit in (
        ("= 1275.9 m/s", A, 0.1), ("0.446 of the flow", SHARE, 1e-3), ("0.554 pipe 3", 1 - SHARE, 1e-3),
        ("0.164 bar along these", resistance(2) * SHARE * 6 * LPM / BAR, 1e-3),
        ("0.237 bar along pipe 1", resistance(1) * 6 * LPM / BAR, 1e-3), ("= 1.617 bar at", WAVE / BAR, 1e-3),
        ("= 3.14 ms", LENGTHS[0] / A * 1e3, 0.01), ("1.2 % that friction", (1 - LOST) * 100, 0.1),
        ("= 0.742: the", PASSED, 1e-3), ("1.186 bar", PASSED * LOST * WAVE / BAR, 1e-3),
        ("0.41 and 0.59", areas()[1] / sum(areas()[1:]), 0.01), ("= -0.258", PASSED - 1, 1e-3),
        ("= 6.27 ms", 2 * LENGTHS[0] / A * 1e3, 0.01), ("x 0.976 =", LOST**2, 1e-3),
        ("= 0.813 bar", 2 * (1 - PASSED) * LOST**2 * WAVE / BAR, 1e-3),
    ):  # fmt: skip
        assert text in told
        printed = float(re.search(r"-?\d+\.\d+", text)[0])
        assert value == pytest.approx(printed, abs=digit / 2 * 1.001)
