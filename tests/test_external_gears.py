"""The external gear pump: geometry, jumps of its volumes, chains that agree with it, and the shipped circuit."""

import functools
import math

import numpy as np
import pytest
from crescentlab.components.carry_over import CarryOverChain
from crescentlab.components.external_gears import ExternalGears
from crescentlab.components.fluids import SimpleOil
from pydantic import ValidationError
from scipy.optimize import brentq

import crescentlab as cl
from crescentlab.analysis.outcome import Outcome, Window

MM, DEG, BAR, LPM = 1e-3, math.pi / 180, 1e5, 1e-3 / 60
OIL = SimpleOil(density=860.0, kinematic_viscosity=35e-6, bulk_modulus=1.4e9)
SIZES = {
    "module": 3 * MM, "thickness": 20 * MM, "addendum": 3 * MM, "dedendum": 3.75 * MM,
    "delivery_volume": 30e-6, "suction_volume": 30e-6,
}  # fmt: skip
PITCH = 2 * math.pi / 12


def at(part, nu, **changes):
    """The equations with the running pitch begun at shaft angle 0."""
    given = {"omega_shaft": 100.0, "mesh_start": 0.0, "started": 1.0, "p_delivery": 5e6, "p_suction": 1e5}
    return part.equations(phi_shaft=nu, **given | changes)


@pytest.mark.parametrize("seal", [{}, {"seal_begins": 81 * DEG, "extension": 190 * DEG}])
def test_volumes_integrate_their_rates_and_jump_by_whole_spaces(seal):
    """Between jumps central differences of V are the rate; at a jump V changes by one tooth space, each side once a
    gear; over a pitch V_d and V_s return to where they began, and the given volumes are their means."""
    part = ExternalGears(**SIZES, **seal)
    jumps = {"V_delivery": part.opens, "V_suction": part.closes}
    grid = (np.arange(6000) + 0.5) / 6000 * PITCH
    for name, sign in (("V_delivery", 1.0), ("V_suction", -1.0)):
        volumes = np.array([at(part, nu)[name] for nu in grid])
        assert np.mean(volumes) == pytest.approx(30e-6, rel=1e-4)
        for jump in jumps[name]:
            step = at(part, jump + 1e-9)[name] - at(part, jump - 1e-9)[name]
            assert step == pytest.approx(sign * part.space_volume, rel=1e-5)
        taken_back = at(part, 0.0)[name] - at(part, PITCH - 1e-12)[name]
        assert taken_back == pytest.approx(-sign * (2 * part.space_volume - part.displaced), rel=1e-6)
        nu = 0.5 * (min(jumps[name]) + max(jumps[name]))
        rate = (at(part, nu + 1e-6)[name] - at(part, nu - 1e-6)[name]) / 2e-6
        assert rate * 100.0 == pytest.approx(at(part, nu)[f"d{name}"], rel=1e-6)


def test_gears_pass_all_power():
    """T w = -(p_d dV_d + p_s dV_s), positive while pumping; the two rates cancel."""
    part = ExternalGears(**SIZES)
    for nu in np.linspace(0.0, PITCH, 9):
        now = at(part, nu)
        assert now["dV_delivery"] == -now["dV_suction"] < 0
        power = -(5e6 * now["dV_delivery"] + 1e5 * now["dV_suction"])
        assert now["torque_shaft"] * 100.0 == pytest.approx(power, rel=1e-12)


def test_tooth_space_against_a_polygon():
    """The involute drawn point by point: area of a space between root and tip circle by quadrature of its width, 1e-6.

    The flank is radial below the base circle of 16.914 mm.
    """
    r_b, r_w = 18 * MM * math.cos(20 * DEG), 18 * MM

    def half_tooth(r: float) -> float:
        alpha = math.acos(min(r_b / r, 1.0))
        return math.pi / 24 + math.tan(20 * DEG) - 20 * DEG - (math.tan(alpha) - alpha)

    radii = np.linspace(r_w - 3.75 * MM, r_w + 3 * MM, 200001)
    widths = [2 * r * (math.pi / 12 - half_tooth(r)) for r in radii]
    expected = 20 * MM * np.trapezoid(widths, radii)
    assert ExternalGears(**SIZES).space_volume == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("phi", [0.0, 1.234, -7.7, 100.0])
def test_any_start_angle(phi):
    """The running pitch is found from the shaft's angle, and each pitch the next begins."""
    part = ExternalGears(**SIZES)
    begin = at(part, phi, started=0.0)["begins"]
    assert begin.condition
    assert 0 <= phi - begin.then["mesh_start"] < PITCH
    turns = begin.then["mesh_start"] / PITCH
    assert turns == pytest.approx(round(turns), abs=1e-9)
    follows = at(part, PITCH)["meshes"]
    assert follows.condition
    assert follows.then == {"mesh_start": PITCH}


@pytest.mark.parametrize("gear", [0, 1])
def test_chains_open_where_the_delivery_grows(gear):
    """A chain on a gear's phase loses its last volume where the delivery volume gains it."""
    part = ExternalGears(**SIZES)
    chain = CarryOverChain(
        volumes=7, volume=part.space_volume, pitch=PITCH, extension=part.extension, gap_height=0.0, gap_length=1 * MM,
        thickness=20 * MM, tip_radius=21 * MM,
    )  # fmt: skip
    name = ("driver_phase", "driven_phase")[gear]

    def exists(nu: float) -> float:
        phase = at(part, nu)[name]
        closed = phase - phase % PITCH
        now = chain.equations(
            p=np.zeros(7), q_chain=np.zeros(7), p_suction=0.0, p_delivery=0.0, omega_shaft=0.0, phase=phase,
            closed_at=closed, started=1.0, fluid=OIL,
        )  # fmt: skip
        return float(now["exists"][-1])

    opens, closes = part.opens[gear], part.closes[gear]
    assert (exists(opens - 1e-9), exists(opens + 1e-9)) == (1.0, 0.0)
    assert (exists(closes - 1e-9), exists(closes + 1e-9)) == (0.0, 1.0)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"addendum": 1.0 * MM}, "do not mesh continuously"),
        ({"dedendum": 20 * MM}, "no root circle"),
        ({"extension": 300 * DEG}, "the seal ends 370 deg"),
        ({"delivery_volume": 1e-6}, "delivery_volume must exceed"),
        ({"suction_volume": 1e-6}, "suction_volume must exceed"),
    ],
)
def test_gears_that_cannot_pump_are_refused(changes, said):
    """One sentence that names the parameter."""
    with pytest.raises(ValidationError, match=said):
        ExternalGears(**SIZES | changes)


@functools.cache
def last_turn(gap: str) -> Window:
    """The shipped pump's second turn."""
    return Window(cl.load("external_gear_pump").simulate(parameters={"tip_gap": gap}), 40e-3, 80e-3)


def value(window: Window, text: str) -> float:
    """An outcome of a window."""
    return Outcome("it", text).value(window).value


def test_header_of_the_external_gear_pump():
    """Numbers of the header, to the digits printed."""
    run = last_turn("40 um")
    assert value(run, "mean(gears.displacement)") * 2 * math.pi == pytest.approx(13.88e-6, abs=5e-9)
    uneven = value(run, "peak_to_peak(gears.dVd) / mean(gears.dVd)")
    assert abs(uneven) == pytest.approx(0.1775, abs=1e-4)
    assert value(run, "mean(delivery.p)") == pytest.approx(145.5 * BAR, abs=0.05 * BAR)
    assert value(run, "minimum(delivery.p)") == pytest.approx(139 * BAR, abs=0.5 * BAR)
    assert value(run, "maximum(delivery.p)") == pytest.approx(151 * BAR, abs=0.5 * BAR)
    assert value(run, "mean(throttle.q)") == pytest.approx(20.5 * LPM, abs=0.05 * LPM)
    assert value(run, "mean(volumetric_efficiency)") == pytest.approx(0.986, abs=5e-4)
    assert value(run, "mean(gears.torque)") == pytest.approx(32.2, abs=0.05)
    assert value(run, "mean(leakage)") == pytest.approx(0.52 * LPM, abs=0.005 * LPM)


def test_pressure_at_which_the_throttle_takes_what_the_gears_bring():
    """Cd A sqrt(2 rho p)/rho_0, rho at p/2, is rho(p)/rho_0 D w less the tips' net flow; 1e-3 for the ripple."""
    run = last_turn("40 um")
    brought = 13.88e-6 * 25

    def surplus(p):
        taken = 0.7 * 2.65e-6 * math.sqrt(2 * p * 860 * math.exp(p / 2.8e9)) / 860
        return math.exp(p / 1.4e9) * brought - value(run, "mean(leakage)") - taken

    assert value(run, "mean(delivery.p)") == pytest.approx(brentq(surplus, 100 * BAR, 200 * BAR), rel=1e-3)


def test_flow_is_displaced_less_what_leaks():
    """Mean over a turn: rho(p_d) D w less the tips' net flow, 0.1 % for the ripple's square in the density."""
    for gap in ("40 um", "0 um"):
        run = last_turn(gap)
        rho = math.exp(value(run, "mean(delivery.p)") / 1.4e9)
        displaced = rho * value(run, "mean(gears.displacement)") * 50 * math.pi
        expected = displaced - value(run, "mean(leakage)")
        assert value(run, "mean(throttle.q)") == pytest.approx(expected, rel=1e-3)


def test_six_or_seven_spaces_are_carried():
    """220 deg over a pitch of 30 deg: seven for 10 deg of each pitch, while the housing seals eight tips, six for the
    other 20 deg. 2e-3: a whole number of pitches, each edge found to 1e-9 of the run and in two rows of one time."""
    run = cl.load("external_gear_pump").simulate("10 ms")
    exists = run["driver.exists"]
    number = exists.sum(axis=1)
    assert set(number) == {6.0, 7.0}
    assert np.all(exists[:, :6] == 1)
    shown = np.trapezoid(number - 6, run.time) / np.ptp(run.time)
    assert shown == pytest.approx(1 / 3, abs=2e-3)


def test_spaces_come_up_to_pressure_step_by_step():
    """Means of the six spaces that always exist rise by nearly equal steps, each about an eighth of the whole; the
    drag that helps them and the oil they take up make the later ones larger. Closed, they keep the suction's pressure.
    """
    run = last_turn("40 um")
    steps = [value(run, f"mean(driver.p[{k}])") for k in range(1, 7)]
    rise = np.diff([value(run, "mean(suction.p)"), *steps]) / value(run, "mean(delivery.p)")
    assert rise == pytest.approx(1 / 8, rel=0.3)
    closed = last_turn("0 um")
    assert value(closed, "maximum(driver.p[7])") < 0
    assert value(closed, "mean(leakage)") == 0


def test_ripple_repeats_once_a_pitch():
    """300 Hz at 1500 rpm; the gears' half pitch apart leaves nothing at half that and at once a turn."""
    run = last_turn("40 um")
    swing = value(run, "amplitude(delivery.p, teeth * speed)")
    assert swing > 2 * BAR
    for text in ("speed", "teeth / 2 * speed"):
        assert value(run, f"amplitude(delivery.p, {text})") < 0.01 * swing


def test_external_gear_pump_keeps_its_oil():
    """Less than 1e-6 of what passes is lost between the events; mergers are booked apart."""
    assert cl.load("external_gear_pump").simulate().balance.circuit < 1e-6
