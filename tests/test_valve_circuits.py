"""Circuits that show valves, against hand calculation: cylinder on a valve, flow controls, counterbalanced load."""

from __future__ import annotations

import functools
import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import brentq

import crescentlab as cl
from crescentlab.result import Result

BAR, MM, LPM = 1e5, 1e-3, 1e-3 / 60


def at(result: Result, name: str, time: float) -> float:
    """Value at a time between rows."""
    return float(np.interp(time, result.time, result[name]))


def through(area: float, drop: float) -> float:
    """Cd A sqrt(2 dp/rho) with Cd 0.7 and 860 kg/m^3."""
    return 0.7 * area * math.sqrt(2 * drop / 860)


@functools.cache
def as_shipped(name: str) -> Result:
    """The run that a circuit's file asks for."""
    return cl.load(name).simulate()


@pytest.mark.parametrize("name", ["valve_cylinder", "flow_control", "bypass_flow_control", "counterbalanced_load"])
def test_balance(name: str) -> None:
    """As shipped less than 1e-6 of what passes is lost."""
    ledger = as_shipped(name).balance
    assert ledger is not None
    assert ledger.circuit < 1e-6
    assert max(ledger.components.values()) < 1e-6


def test_cylinder_moves_at_the_speed_of_the_valve() -> None:
    """valve_cylinder: q = Cd s A_v sqrt((p_s - p_L)/rho), and p_s +- p_L over 2; 1 % and 0.5 bar for the density."""
    run = as_shipped("valve_cylinder")
    area = math.pi / 4 * (50**2 - 28**2) * 1e-6
    full = 5 * LPM / math.sqrt(2 * 5 * BAR / 860)  # Cd A_v from the rated flow
    share = (0.5 - 0.02) / 0.98
    v = brentq(lambda v: share * full * math.sqrt((140 * BAR - (4e3 + 500 * v) / area) / 860) - area * v, 0.01, 1.0)
    assert v == pytest.approx(0.1004, abs=5e-5)
    load = (4e3 + 500 * v) / area
    assert load == pytest.approx(30.05 * BAR, abs=0.005 * BAR)
    assert at(run, "load.v", 0.44) == pytest.approx(v, rel=1e-2)
    assert at(run, "oil_a.p", 0.44) == pytest.approx((140 * BAR + load) / 2, abs=0.5 * BAR)
    assert at(run, "oil_b.p", 0.44) == pytest.approx((140 * BAR - load) / 2, abs=0.5 * BAR)


def test_cylinder_swings_at_its_natural_frequency() -> None:
    """valve_cylinder: sqrt(4 beta A^2/(V_t m)) (Merritt, chapter 6); 0.1 % for the stop 0.3 mm off the middle."""
    run = as_shipped("valve_cylinder")
    area = math.pi / 4 * (50**2 - 28**2) * 1e-6
    volume = 0.5 * area + 1e-4
    omega = math.sqrt(4 * 1.4e9 * area**2 / (volume * 400))
    assert omega / (2 * math.pi) == pytest.approx(28.85, abs=0.005)
    late = run.time > 0.5
    t, v = run.time[late], run["load.v"][late]
    k = np.flatnonzero((v[:-1] < 0) & (v[1:] >= 0))
    crossings = t[k] - v[k] * (t[k + 1] - t[k]) / (v[k + 1] - v[k])
    assert 2 * math.pi / np.diff(crossings).mean() == pytest.approx(omega, rel=1e-3)
    peaks = np.array([v[a:b].max() for a, b in pairwise(k)])
    ratio = np.log(peaks[0] / peaks[-1]) / (2 * math.pi * (len(peaks) - 1))
    assert ratio == pytest.approx(500 / (2 * 400 * omega), rel=0.02)  # 2 % for peaks between steps


def metered(load: float, force: float) -> float:
    """Flow [m^3/s] of the flow control valves at a load [bar] where the flow force counts `force` times."""
    area, gap = math.pi / 4 * 144e-6, math.pi * 12 * MM

    def missing(x: float) -> float:
        drop = (200 - load) * BAR / (1 + (10.4e-6 / (gap * (MM - x))) ** 2)
        q, over = through(10.4e-6, drop), (200 - load) * BAR - drop
        jet = force * 860 * q * math.sqrt(2 * over / 860) * math.cos(math.radians(69))
        return 8 * BAR * area + 22.6e3 * x - jet - drop * area

    x = brentq(missing, 0.0, MM * (1 - 1e-9)) if missing(0.0) < 0 else 0.0
    return through(10.4e-6, (200 - load) * BAR / (1 + (10.4e-6 / (gap * (MM - x))) ** 2))


@pytest.mark.parametrize(
    ("load", "printed"),
    [(50, (17.3, 20.9, 19.2)), (100, (14.1, 20.9, 19.5)), (150, (10.0, 20.8, 19.8)), (195, (3.2, 14.4, 14.4))],
)
def test_flow_control_against_the_balance_of_forces(load: int, printed: tuple[float, ...]) -> None:
    """flow_control: by hand without compressibility; 1 % for the density at up to 200 bar and for the rising load."""
    run = as_shipped("flow_control")
    by_hand = (through(10.4e-6 * math.sqrt(9 / 200), (200 - load) * BAR), metered(load, 0.0), metered(load, 1.0))
    for name, q, figure in zip(("orifice.q", "metering.q", "valve.q"), by_hand, printed, strict=True):
        assert q / LPM == pytest.approx(figure, abs=0.051)
        assert at(run, name, load / 100) == pytest.approx(q, rel=1e-2)


def test_flow_control_within_the_spring_range() -> None:
    """flow_control: between Cd A sqrt(2 p/rho) of 8 and 10 bar while there is more to spare; 0.6 % for the density."""
    run = as_shipped("flow_control")
    held = (run.time > 0.05) & (run["p_load.p"] < 188 * BAR)
    q = run["metering.q"][held]
    assert q.min() > through(10.4e-6, 8 * BAR)
    assert q.max() < 1.006 * through(10.4e-6, 10 * BAR)


PUMP = 40 * LPM
"""Flow of each pump of bypass_flow_control."""


def two_way(load: float) -> tuple[float, float]:
    """Flow to the load and pressure of the pump, before a two-way flow control and beside a relief valve."""

    def passed(p: float) -> float:
        spare = p - load
        within = brentq(
            lambda d: 37.7 * (10 * BAR - d) / (2 * BAR) * math.sqrt(max(spare - d, 0.0)) - 10.4 * math.sqrt(d),
            8 * BAR, 10 * BAR,
        )  # fmt: skip
        return through(10.4e-6, within)

    p = brentq(lambda p: passed(p) + through(2e-5 * (p - 200 * BAR) / (10 * BAR), p) - PUMP, 200 * BAR, 210 * BAR)
    return passed(p), p


def three_way(load: float) -> tuple[float, float]:
    """The same before an orifice with a bypass compensator."""

    def missing(drop: float) -> float:
        return through(10.4e-6, drop) + through(37.7e-6 * (drop - 8 * BAR) / (2 * BAR), load + drop) - PUMP

    drop = brentq(missing, 8 * BAR, 10 * BAR)
    return through(10.4e-6, drop), load + drop


def three_way_of_parts(load: float) -> tuple[float, float]:
    """The same before the valve built of parts: balance of forces on its spool."""
    area, width = math.pi / 4 * 144e-6, math.pi * 12 * MM

    def missing(drop: float) -> float:
        surplus, v = PUMP - through(10.4e-6, drop), math.sqrt(2 * (load + drop) / 860)
        spring = 8 * BAR * area + 22.6e3 * surplus / (0.7 * width * v)
        return drop * area - spring - 860 * surplus * v * math.cos(math.radians(69))

    drop = brentq(missing, 8 * BAR, 20 * BAR)
    return through(10.4e-6, drop), load + drop


@pytest.mark.parametrize(
    ("load", "flows", "pressures"),
    [
        (50, (20.9, 19.1, 20.3), (201, 58.2, 59.3)), (100, (20.9, 19.0, 20.6), (201, 108, 110)),
        (150, (20.8, 19.0, 20.9), (201, 158, 160)), (180, (20.5, 19.0, 21.0), (201, 188, 190)),
    ],
)  # fmt: skip
def test_bypass_flow_control_by_hand(
    load: int, flows: tuple[float, ...], pressures: tuple[float, ...]
) -> None:  # fmt: skip
    """bypass_flow_control: by hand without compressibility; 1 % of the flow and 0.2 bar for the density."""
    run = as_shipped("bypass_flow_control")
    controls = (
        (two_way, "metering_two.q", "line_two.p"), (three_way, "metering_three.q", "line_three.p"),
        (three_way_of_parts, "valve.q", "line_parts.p"),
    )  # fmt: skip
    for (by_hand, flow, pressure), printed_q, printed_p in zip(controls, flows, pressures, strict=True):
        q, p = by_hand(load * BAR)
        assert q / LPM == pytest.approx(printed_q, abs=0.051)
        assert p / BAR == pytest.approx(printed_p, abs=0.051 if printed_p < 100 else 0.51)
        assert at(run, flow, load / 100) == pytest.approx(q, rel=1e-2)
        assert at(run, pressure, load / 100) == pytest.approx(p, abs=0.2 * BAR)


def test_what_flow_controls_cost() -> None:
    """bypass_flow_control at 50 bar: 13.4 kW before the two-way, 3.9 kW before the three-way flow control."""
    run = as_shipped("bypass_flow_control")
    assert at(run, "power_two", 0.5) == pytest.approx(13.4e3, abs=50)
    assert at(run, "power_three", 0.5) == pytest.approx(3.9e3, abs=50)


def test_three_way_flow_control_under_its_flow() -> None:
    """A pump that gives less than is metered: either bypass stays shut; 1 % for what the rising load compresses."""
    run = cl.load("bypass_flow_control").simulate("200 ms", {"pump_flow": "15 L/min"})
    for name in ("metering_three.q", "valve.q"):
        assert at(run, name, 0.2) == pytest.approx(15 * LPM, rel=1e-2)
    assert at(run, "bypass.q", 0.2) == pytest.approx(0.0, abs=1e-12)
    assert at(run, "valve.q_bypass", 0.2) == 0.0


def test_counterbalanced_load() -> None:
    """counterbalanced_load: held, lowered, lifted as by hand; 0.5 % for the density, 2 % for the swing of the lift."""
    run = as_shipped("counterbalanced_load")
    weight, bore = 1500 * 9.80665, math.pi / 4 * 63e-3**2
    ring, q = bore - math.pi / 4 * 36e-3**2, 20 * LPM
    edge = 30 * LPM / math.sqrt(2 * 2 * BAR / 860)  # Cd A of the proportional valve
    assert at(run, "under.p", 0.4) == pytest.approx(weight / bore, rel=1e-3)
    held = brentq(lambda p: through(60e-6 * (p / BAR - 120) / 20, p) - q, 120 * BAR, 130 * BAR)
    assert at(run, "line.p", 0.4) == pytest.approx(held, rel=5e-3)
    assert held == pytest.approx(120.9 * BAR, abs=0.05 * BAR)

    v = q / ring
    back = 430 * (v * bore / edge) ** 2

    def state(pilot: float) -> tuple[float, float]:
        p = (weight + pilot * ring - 5e3 * v) / bore
        return p, (p + 1.5 * pilot - 2.5 * back - 70 * BAR) / (100 * BAR)

    def missing(pilot: float) -> float:
        p, share = state(pilot)
        return through(share * 20e-6, p - back) - v * bore

    pilot = brentq(missing, 20 * BAR, 60 * BAR)
    p, share = state(pilot)
    assert (v, share) == pytest.approx((0.1588, 0.296), abs=5e-4)
    assert (pilot, p) == pytest.approx((27.6 * BAR, 63.2 * BAR), abs=0.06 * BAR)
    assert at(run, "load.v", 1.9) == pytest.approx(-v, rel=5e-3)
    assert at(run, "under.p", 1.9) == pytest.approx(p, rel=5e-3)
    assert at(run, "above.p", 1.9) == pytest.approx(pilot, rel=5e-3)
    assert at(run, "counterbalance.counterbalance.lift", 1.9) == pytest.approx(share, rel=1e-2)

    rising = (at(run, "load.x", 4.0) - at(run, "load.x", 3.5)) / 0.5
    assert rising == pytest.approx(q / bore, rel=2e-2)
    assert run.mean("under.p", 3.5, 4.0) == pytest.approx((weight + 5e3 * q / bore) / bore, rel=2e-2)


def test_counterbalanced_load_judders_with_a_large_pilot_ratio() -> None:
    """counterbalanced_load: at 3 the speed swings by more than half to the end of the lowering; at 1.5 it settles."""
    run, calm = (
        cl.load("counterbalanced_load").simulate("2 s", {"pilot_ratio": "3"}),
        as_shipped("counterbalanced_load"),
    )
    for start, stop in ((1.2, 1.6), (1.6, 2.0)):
        assert np.ptp(run["load.v"][(run.time > start) & (run.time < stop)]) > 0.5 * 0.1588
        assert np.ptp(calm["load.v"][(calm.time > start) & (calm.time < stop)]) < 0.01 * 0.1588
