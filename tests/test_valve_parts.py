"""Valve parts against hand calculation, and the crescent pump's relief valve against its paper."""

import math
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest
from crescentlab.components.fluids import AeratedOil, SimpleOil
from crescentlab.components.mechanics import Damper, Spring
from crescentlab.components.valve_parts import (
    LeakageLand,
    RoundHoles,
    SpoolEnd,
    SpringChamberEnd,
    SpringChamberPressure,
    circle_chord,
    circle_segment,
)
from pydantic import ValidationError
from scipy.integrate import quad
from scipy.optimize import brentq

from crescentlab.symbols import Sym

BAR, LPM = 1e5, 1e-3 / 60
OIL = SimpleOil(density=860.0, kinematic_viscosity=35e-6, bulk_modulus=1.4e9)
PUMP_OIL = AeratedOil(
    density=860.0, kinematic_viscosity=35e-6, bulk_modulus=1.4e9, air_fraction=0.005, saturation_pressure=1e8
)


# -- faces -------------------------------------------------------------------------------------------


def test_spool_end_pushes_and_swallows():
    """10 bar on 14 mm: p pi d^2/4 = 153.94 N; at 0.5 m/s it takes A v rho/rho_0 with rho/rho_0 = exp(p/beta)."""
    end = SpoolEnd(diameter=14e-3).equations(p_port=10 * BAR, v_rod=0.5, fluid=OIL)
    assert end["force"] == pytest.approx(153.938, abs=1e-3)
    assert end["f_rod"] == -end["force"]
    assert end["q_port"] == pytest.approx(math.exp(1e6 / 1.4e9) * 153.938e-6 * 0.5, rel=1e-5)
    down = SpoolEnd(diameter=14e-3, side="pushes_down").equations(p_port=10 * BAR, v_rod=0.5, fluid=OIL)
    assert (down["force"], down["q_port"]) == (-end["force"], -end["q_port"])


def test_spool_end_with_a_rod():
    """Ring of 20 and 12 mm: pi/4 (400 - 144) = 201.06 mm^2."""
    end = SpoolEnd(diameter=20e-3, rod_diameter=12e-3).equations(p_port=1 * BAR, v_rod=0.0, fluid=OIL)
    assert end["force"] == pytest.approx(20.106, abs=1e-3)


def test_rod_thicker_than_the_face_is_refused():
    """Its area would be negative; the message names both diameters."""
    with pytest.raises(ValidationError, match=r"rod_diameter \(20 mm\) must be smaller than diameter \(12 mm\)"):
        SpoolEnd(diameter=12e-3, rod_diameter=20e-3)


def test_spring_chamber_end_feels_the_signal_and_feeds_the_port():
    """0.4 bar on 14 mm pushes down with 6.158 N; a rising spool drives A v out into the port (q < 0)."""
    back = SpringChamberEnd(diameter=14e-3).equations(pressure=0.4 * BAR, p_port=0.0, v_rod=0.5, fluid=OIL)
    assert back["force"] == pytest.approx(-6.1575, abs=1e-3)
    assert back["f_rod"] == -back["force"]
    assert back["q_port"] == pytest.approx(-153.938e-6 * 0.5, rel=1e-5)


# -- holes -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("height", "area"), [(0.2, 0.16350), (0.5, 0.61418), (1.0, 1.57080), (1.5, 2.52741)])
def test_area_of_a_circle_segment(height, area):
    """Radius 1 mm; r^2 acos(1 - h/r) - (r - h) sqrt(2 r h - h^2), tables to five decimals (mm^2)."""
    got, _ = circle_segment(height * 1e-3, 2e-3, 1e-6)
    assert got * 1e6 == pytest.approx(area, abs=5e-6)


def test_area_is_the_integral_of_the_chord():
    """dA/dh = 2 sqrt(h (d - h)), integrated by quadrature (1e-10) over the middle of the hole."""
    d = 5.5e-3
    low, high = circle_segment(1e-3, d, 1e-6)[0], circle_segment(4.7e-3, d, 1e-6)[0]
    expected, _ = quad(lambda h: 2 * math.sqrt(h * (d - h)), 1e-3, 4.7e-3, epsabs=1e-18)
    assert high - low == pytest.approx(expected, rel=1e-10)


def test_chord_is_the_slope_of_the_area():
    """0 outside the hole, d in its middle; its integral is the area, but for a share of w/(5 d) in the rounded ends."""
    d, w = 5.5e-3, 1e-5
    for height in (-1e-3, 0.0, d, 9e-3):
        assert circle_chord(height, d, w) == pytest.approx(0.0, abs=1e-18)
    assert circle_chord(d / 2, d, w) == pytest.approx(d, rel=1e-12)
    for height in (0.5 * w, w, 1e-3, d - 0.5 * w):
        found, _ = quad(lambda h: circle_chord(h, d, w), 0.0, height, points=[w, d - w][: 1 + (height > d - w)])
        area, _ = circle_segment(height, d, w)
        assert found == pytest.approx(area, rel=0.21 * w / d)


def test_closed_and_fully_open_holes():
    """Exactly nothing up to the edge; from the far edge on the full circle and d_h = d (the edge's rounding: 1e-6)."""
    d = 5.5e-3
    for height in (-1e-3, -1e-12, 0.0):
        assert circle_segment(height, d, 1e-6) == (0.0, 0.0)
    for height in (d, 9e-3):
        area, hydraulic = circle_segment(height, d, 1e-6)
        assert area == pytest.approx(math.pi / 4 * d * d, rel=1e-12)
        assert hydraulic == pytest.approx(d, rel=2e-6)
    half, hydraulic = circle_segment(d / 2, d, 1e-6)
    assert half == pytest.approx(math.pi / 8 * d * d, rel=1e-12)
    assert hydraulic == pytest.approx(4 * half / (d * (1 + math.pi / 2)), rel=1e-12)


def test_rounded_edge_is_monotonic_and_local():
    """Within the rounding (1 um) the area rises without a step and joins the exact law, 4/3 sqrt(d) h^1.5 there."""
    d, w = 5.5e-3, 1e-6
    heights = np.linspace(0.0, 3 * w, 301)
    areas, _ = circle_segment(heights, d, w)
    assert np.all(np.diff(areas) > 0)
    np.testing.assert_allclose(areas[100:], 4 / 3 * math.sqrt(d) * heights[100:] ** 1.5, rtol=2e-4)
    slope = np.diff(areas) / np.diff(heights)
    assert np.max(np.abs(np.diff(slope))) < 0.03 * slope[-1]
    mirrored = math.pi / 4 * d * d - circle_segment(d - heights, d, w)[0]
    np.testing.assert_allclose(mirrored, areas, atol=1e-19)


def holes(**changes):
    """The pump valve's holes."""
    given = {"number": 4, "diameter": 5.5e-3, "cd_max": 0.74, "lambda_c": 50.0, "jet_coefficient": 0.82}
    return RoundHoles(**(given | changes))


def still(part, p_a, p_b, x, fluid=OIL):
    """Holes on a spool that does not move."""
    return part.equations(p_a=p_a, p_b=p_b, x_rod=x, v_rod=0.0, fluid=fluid)


@pytest.mark.parametrize(
    ("lift", "p_a", "p_b"), [(1.25e-3, 8 * BAR, 0.0), (0.35e-3, 6 * BAR, 1 * BAR), (2e-3, 9 * BAR, 0.2 * BAR)]
)
def test_flow_through_holes_is_the_orifice_law(lift, p_a, p_b):
    """Eqs. 27-29 written out with the segment's 4A/perimeter and rho = 860 kg/m^3 (0.1 % for its pressure)."""
    r, n = 2.75e-3, 4
    alpha = math.acos(1 - lift / r)
    segment = r * r * (alpha - math.sin(alpha) * math.cos(alpha))
    d_h = 4 * segment / (2 * r * alpha + 2 * r * math.sin(alpha))
    v = math.sqrt(2 * (p_a - p_b) / 860)
    q = n * segment * 0.74 * math.tanh(2 * d_h * v / 35e-6 / 50) * v
    got = still(holes(), p_a, p_b, lift)
    assert got["q"] == pytest.approx(q, rel=1e-3)
    assert got["q"] == got["q_a"] == -got["q_b"] == got["flow"]
    assert got["area"] == pytest.approx(n * segment, rel=1e-12)
    back = still(holes(), p_b, p_a, lift)
    assert back["q"] == -got["q"]
    assert back["jet_force"] == got["jet_force"] > 0


def test_overlap_delays_the_opening():
    """Holes that start to open at 0.3 mm pass at 1.3 mm what others pass at 1 mm."""
    late = holes(overlap=0.3e-3)
    assert still(late, 5 * BAR, 0.0, 0.3e-3)["q"] == 0.0
    assert still(late, 5 * BAR, 0.0, 1.3e-3)["q"] == pytest.approx(still(holes(), 5 * BAR, 0.0, 1e-3)["q"], rel=1e-12)


@pytest.mark.parametrize("x", [-1e-3, 0.0, 1e-9, 1e-6, 1.25e-3, 5.5e-3 - 1e-6, 5.5e-3, 8e-3])
@pytest.mark.parametrize("p_a", [-0.5 * BAR, 0.0, 8 * BAR])
def test_jacobian_is_finite_at_every_edge(x, p_a):
    """Closed, opening, full, and zero pressure drop: no slope of flow, force or area is infinite."""
    names = ("p_a", "p_b", "x_rod", "v_rod")
    symbols = {name: ca.SX.sym(name) for name in names}
    out = holes(damping_length=20e-3).equations(
        **{name: Sym(symbol) for name, symbol in symbols.items()}, fluid=PUMP_OIL
    )
    values = ca.vertcat(*[Sym.of(out[key]).sx for key in ("q", "f_rod", "area")])
    arguments = ca.vertcat(*symbols.values())
    jacobian = ca.Function("jacobian", [arguments], [ca.jacobian(values, arguments)])
    assert np.all(np.isfinite(np.array(jacobian([p_a, 0.0, x, 0.5]))))


# -- land --------------------------------------------------------------------------------------------


def test_leakage_and_drag_of_a_land():
    """d = 14 mm, c = 10 um, l = 6 - 2 mm, 100 bar: q = pi d c^3 dp/(12 mu l) = 0.304 cm^3/s, mu = 30.1 mPa s.

    Drag pi d mu l v/c = 0.5297 N per m/s less the shear of the pressure gradient pi d c dp/2 = 2.199 N;
    the wall drags pi d c v/2 = 0.2199 cm^3/s per m/s. rho within 0.4 % of 860 at 50 bar.
    """
    land = LeakageLand(diameter=14e-3, clearance=10e-6, overlap=6e-3)
    still = land.equations(p_a=100 * BAR, p_b=0.0, x_rod=2e-3, v_rod=0.0, fluid=OIL)
    assert still["length"] == pytest.approx(4e-3)
    assert still["q"] == pytest.approx(0.3044e-6, rel=5e-3)
    assert still["f_rod"] == pytest.approx(-2.1991, rel=1e-4)
    moving = land.equations(p_a=0.0, p_b=0.0, x_rod=2e-3, v_rod=1.0, fluid=OIL)
    assert moving["q"] == pytest.approx(0.2199e-6, rel=1e-3)
    assert moving["f_rod"] == pytest.approx(0.52953, rel=1e-4)
    eccentric = land.model_copy(update={"eccentricity": 1.0}).equations(
        p_a=100 * BAR, p_b=0.0, x_rod=2e-3, v_rod=0.0, fluid=OIL
    )
    assert eccentric["q"] == pytest.approx(2.5 * still["q"], rel=1e-12)


@pytest.mark.parametrize(
    ("opens", "x", "length"), [("up", 6e-3, 1e-4), ("down", 2e-3, 8e-3), ("never", 2e-3, 6e-3), ("down", -7e-3, 1e-4)]
)
def test_overlap_of_a_land(opens, x, length):
    """The gap shortens where the land opens, grows the other way, and stops at its shortest."""
    land = LeakageLand(diameter=14e-3, clearance=10e-6, overlap=6e-3, opens=opens)
    assert land.equations(p_a=0.0, p_b=0.0, x_rod=x, v_rod=0.0, fluid=OIL)["length"] == pytest.approx(length)


# -- the crescent pump's relief valve ----------------------------------------------------------------

AREA = math.pi / 4 * 14e-3**2
NOSE, BACK = SpoolEnd(diameter=14e-3), SpringChamberEnd(diameter=14e-3)
SPRING, DAMPER = Spring(stiffness=9000.0, preload=6.5 * BAR * AREA), Damper(coefficient=100.0)
CHAMBER = SpringChamberPressure(linear=1.8e7, quadratic=1.296e11)


def valve(p, x):
    """Flow, spring chamber pressure, jet force and net force on the still spool; outlet at 0 bar."""
    jet = still(holes(), p, 0.0, x, PUMP_OIL)
    chamber = CHAMBER.equations(flow=jet["flow"])["pressure"]
    on_parts = (
        jet["f_rod"],
        NOSE.equations(p_port=p, v_rod=0.0, fluid=PUMP_OIL)["f_rod"],
        BACK.equations(pressure=chamber, p_port=0.0, v_rod=0.0, fluid=PUMP_OIL)["f_rod"],
        SPRING.equations(x_rod=x)["f_rod"],
        DAMPER.equations(v_rod=0.0)["f_rod"],
    )
    return SimpleNamespace(q=jet["q"], chamber=chamber, jet=jet["jet_force"], force=-sum(on_parts))


def regulated(flow):
    """Pressure and lift at which the valve passes `flow` in equilibrium."""

    def lift(p):
        return brentq(lambda x: valve(p, x).force, 0.0, 4e-3, xtol=1e-13)

    p = brentq(lambda p: valve(p, lift(p)).q - flow, 6.5 * BAR + 1, 15 * BAR)
    return p, lift(p)


def balance_by_hand(flow):
    """The same equilibrium from the paper's Eqs. 27, 30, 31 with C_d = 0.74, rho = 860 kg/m^3 in the jet throughout.

    The flow is that of the oil at 0 bar gauge, with half a per cent of air: 855.7 kg/m^3.
    """

    def lift(p):
        chamber = 1.8e7 * flow + 1.296e11 * flow**2
        jet = 0.82 * 855.7 * flow * math.sqrt(2 * p / 860) * math.cos(math.radians(69))
        return ((p - chamber - 6.5 * BAR) * AREA - jet) / 9000

    def passed(p):
        alpha = math.acos(1 - min(max(lift(p), 0.0), 5.5e-3) / 2.75e-3)
        area = 4 * 2.75e-3**2 * (alpha - math.sin(2 * alpha) / 2)
        return 0.74 * area * math.sqrt(2 * p * 860) / 855.7

    p = brentq(lambda p: passed(p) - flow, 6.5 * BAR, 15 * BAR)
    return p, lift(p)


def test_valve_is_closed_below_its_cracking_pressure():
    """6.5 bar: the spool stays on its seat (section 6.2, Fig. 19) and the holes pass nothing."""
    for p in (0.0, 3 * BAR, 6.49 * BAR):
        assert valve(p, 0.0).force < 0
        assert valve(p, 0.0).q == 0.0
    assert valve(6.5 * BAR, 0.0).force == pytest.approx(0.0, abs=1e-9)
    assert valve(6.51 * BAR, 0.0).force > 0


def test_equilibrium_at_30_litres_per_minute():
    """About 1.25 mm of lift (within 5 %); 7.98 bar by the hand balance, to the 0.1 % of the density's change."""
    p, x = regulated(30 * LPM)
    assert x == pytest.approx(1.25e-3, rel=0.05)
    assert p == pytest.approx(7.98 * BAR, rel=1e-3)
    assert (p, x) == pytest.approx(balance_by_hand(30 * LPM), rel=1e-3)


@pytest.mark.parametrize("flow", [2, 10, 23, 48, 54])
def test_characteristic_follows_the_balance_of_forces(flow):
    """Regulated pressure within 0.1 % and lift within 1 % of the hand balance (small lifts: C_d just under 0.74)."""
    p, x = regulated(flow * LPM)
    p_hand, x_hand = balance_by_hand(flow * LPM)
    assert p == pytest.approx(p_hand, rel=1e-3)
    assert x == pytest.approx(x_hand, rel=1e-2)


def test_regulated_pressure_of_the_full_pump_flow():
    """9 bar +- 0.5 with the throttle closed at 4000 rpm, some 54 L/min (Fig. 19)."""
    p, x = regulated(54 * LPM)
    assert p == pytest.approx(9 * BAR, abs=0.5 * BAR)
    assert x < 4e-3


@pytest.mark.parametrize("flow", [0.5, 2, 10, 23, 36, 49])
def test_flow_force_against_equation_31(flow):
    """0.82 m' v cos 69 deg with the mass flow m' = rho_0 q, v = sqrt(2 p/rho), 0 to 49 L/min (Fig. 13).

    rho_0 = 855.7 kg/m^3, that of 860 kg/m^3 with half a per cent of air; rho in v within 0.2 %.
    """
    p, x = regulated(flow * LPM)
    expected = 0.82 * 855.7 * flow * LPM * math.sqrt(2 * p / 860) * math.cos(math.radians(69))
    assert valve(p, x).jet == pytest.approx(expected, rel=2e-3)
    assert valve(p, 0.0).jet == 0.0


@pytest.mark.parametrize(("flow", "bar"), [(30, 0.414), (48, 0.9734), (0, 0.0), (-20, 0.0)])
def test_spring_chamber_pressure(flow, bar):
    """Second-order polynomial of the flow (Fig. 14): about 0.4 bar at 30, 1 bar at 49 L/min; none backwards."""
    assert CHAMBER.equations(flow=flow * LPM)["pressure"] == pytest.approx(bar * BAR, abs=10)
