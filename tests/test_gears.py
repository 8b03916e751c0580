"""Gear geometry of the crescent pump against the numbers of the paper and of independent constructions."""

from itertools import pairwise

import numpy as np
import pytest
from crescentlab.components import involute
from crescentlab.components.crescent_gears import CrescentGears
from pydantic import ValidationError

DEG = np.pi / 180
MM = 1e-3
PAIRS = [(12, 15), (13, 16), (14, 17)]
OMEGA = 2000 * np.pi / 30


def gears(z_1=13, **parameters):
    return CrescentGears(driver_teeth=z_1, driven_teeth=z_1 + 3, **parameters)


def at(part, nu, **more):
    """The equations with the running pitch begun at shaft angle 0."""
    given = {"omega_shaft": OMEGA, "mesh_start": 0.0, "started": 1.0}
    given |= {"p_delivery": 5e5, "p_suction": -1e4, "p_trapped": 8e5, **more}
    return part.equations(phi_shaft=nu, **given)


def pitch(part):
    return 2 * np.pi / part.driver_teeth


def jumps(part):
    c = part.chambers
    return np.array([c.mesh.duration, c.driver_opens, c.driven_opens, c.driver_closes, c.driven_closes])


def smooth_intervals(part):
    edges = np.unique(np.concatenate([[0.0], jumps(part), [pitch(part)]]))
    return [(a + 1e-12, b - 1e-12) for a, b in pairwise(edges)]


# --- tooth form ---------------------------------------------------------------------------------------------------


def test_base_radii_of_the_paper():
    """parameters.yaml: 22.04925 and 27.13754 mm, to the digits printed; angle 32 deg at 6 mm."""
    mesh = gears().chambers.mesh
    assert mesh.driver_base == pytest.approx(22.04925 * MM, abs=5e-9)
    assert mesh.driven_base == pytest.approx(27.13754 * MM, abs=5e-9)
    assert mesh.angle == pytest.approx(32 * DEG, rel=1e-12)


def test_default_radii_are_table_3():
    """Table 3 of the paper: tips 29.1 and 28.6 mm, roots 21.95 and 35.6 mm."""
    c = gears().chambers
    found = [c.mesh.driver_tip, c.mesh.driven_tip, c.driver_root, c.driven_root]
    assert found == pytest.approx([29.1 * MM, 28.6 * MM, 21.95 * MM, 35.6 * MM], rel=1e-12)


def test_thicknesses_of_the_teeth():
    """parameters.yaml: b1 2.391, b2 8.218, b4 6.24, l_ti 2.149, l_to 2.478 mm, to the digits printed."""
    angle, rho_1, rho_2 = 32 * DEG, 26 * MM * np.cos(32 * DEG), 32 * MM * np.cos(32 * DEG)
    tip, root = 29.1 * MM, 21.95 * MM
    assert involute.external_space(root, 13, rho_1, angle) == pytest.approx(2.391 * MM, abs=5e-7)
    assert involute.external_thickness(root, 13, rho_1, angle) == pytest.approx(8.218 * MM, abs=5e-7)
    assert involute.mean_thickness(root, tip, 13, rho_1, angle) == pytest.approx(6.24 * MM, abs=5e-6)
    assert involute.external_thickness(tip, 13, rho_1, angle) == pytest.approx(2.149 * MM, abs=5e-7)
    assert involute.internal_thickness(28.6 * MM, 16, rho_2, angle) == pytest.approx(2.478 * MM, abs=5e-7)


def test_reference_circle_is_shared_equally():
    """Without profile shift the tooth on the reference circle is pi m/2 thick, on both gears."""
    angle, module = 32 * DEG, 4 * MM
    for z, thickness in ((13, involute.external_thickness), (16, involute.internal_thickness)):
        base = module * z / 2 * np.cos(angle)
        assert thickness(module * z / 2, z, base, angle) == pytest.approx(np.pi * module / 2, rel=1e-12)


def test_area_between_flanks_is_the_integral_of_the_thickness():
    """Quadrature of 2 psi r dr, with the root below and above the base circle; trapezoidal error 1e-7."""
    for z in (13, 14):
        base = involute.base_radius(z, 4 * MM, 32 * DEG)
        r = np.linspace(2 * MM * z - 4.05 * MM, 2 * MM * z + 3.1 * MM, 200_001)
        area = np.trapezoid(involute.external_thickness(r, z, base, 32 * DEG), r)
        assert involute.area_between_flanks(r[0], r[-1], z, base, 32 * DEG) == pytest.approx(area, rel=1e-7)


def test_carry_over_and_trapped_volumes():
    """notes.md: 566.75 and 528.76 mm3; trapped 42.527 mm3 when it starts, 38.552 when it ends."""
    c = gears().chambers
    assert c.driver_space == pytest.approx(566.75e-9, abs=5e-12)
    assert c.driven_space == pytest.approx(528.76e-9, abs=5e-12)
    assert c.trapped_at_start == pytest.approx(42.527e-9, abs=5e-13)
    assert c.trapped_at_end == pytest.approx(38.552e-9, abs=5e-13)


def flank(radius, z, angle=32 * DEG, module=4 * MM):
    """Half angle between two flanks at a radius, written out anew."""
    base = module * z / 2 * np.cos(angle)
    alpha = np.arccos(np.minimum(base / radius, 1.0))
    return np.pi / (2 * z) + (np.tan(angle) - angle) - (np.tan(alpha) - alpha)


def polar(radius, angle, centre=0.0):
    return np.stack([centre + radius * np.cos(angle), radius * np.sin(angle)], axis=-1) * np.ones((np.size(angle), 1))


def trapped_polygon(z_1, e, nu, n=4001):
    """Area [m^2] enclosed by the two gears' profiles from P1 to P2, by the shoelace formula."""
    z_2 = z_1 + 3
    rho_1, rho_2 = 2 * MM * z_1 * np.cos(32 * DEG), 2 * MM * z_2 * np.cos(32 * DEG)
    theta = np.arccos((rho_2 - rho_1) / e)
    tip_1, root_1 = 2 * MM * z_1 + 3.1 * MM, 2 * MM * z_1 - 4.05 * MM
    tip_2, root_2 = 2 * MM * z_2 - 3.4 * MM, 2 * MM * z_2 + 3.6 * MM
    p_1, p_2, tau = 2 * np.pi / z_1, 2 * np.pi / z_2, z_1 / z_2
    y = (np.sqrt(tip_2**2 - rho_2**2) - e * np.sin(theta)) / rho_1 + nu
    tooth = y - theta - flank(rho_1, z_1)  # centre of the driver's tooth that touches at P1
    contact = rho_1 * (np.exp(-1j * theta) * (1 + 1j * y)) + e  # seen from the driven gear's centre
    space = np.angle(contact) - flank(abs(contact), z_2)  # centre of the space that it lies in
    points_1 = np.array([np.hypot(1, roll) * rho_1 for roll in (y, y + p_1)])
    points_2 = np.array([np.hypot(1, tau * roll + (1 - tau) * np.tan(theta)) * rho_2 for roll in (y, y + p_1)])

    def side(first, last, z, centre, sign, origin=0.0):
        r = np.linspace(first, last, n)
        return polar(r, centre + sign * flank(r, z), origin)

    def arc(r, first, last, origin=0.0):
        return polar(r, np.linspace(first, last, n), origin)

    ahead = tooth + p_1
    driver = [
        side(points_1[0], root_1, z_1, tooth, 1),
        arc(root_1, tooth + flank(root_1, z_1), ahead - flank(root_1, z_1)),
        side(root_1, tip_1, z_1, ahead, -1),
        arc(tip_1, ahead - flank(tip_1, z_1), ahead + flank(tip_1, z_1)),
        side(tip_1, points_1[1], z_1, ahead, 1),
    ]
    beyond = space + p_2
    driven = [
        side(points_2[0], tip_2, z_2, space, 1, -e),
        arc(tip_2, space + flank(tip_2, z_2), beyond - flank(tip_2, z_2), -e),
        side(tip_2, root_2, z_2, beyond, -1, -e),
        arc(root_2, beyond - flank(root_2, z_2), beyond + flank(root_2, z_2), -e),
        side(root_2, points_2[1], z_2, beyond, 1, -e),
    ]
    inner, outer = np.concatenate(driver), np.concatenate(driven)
    np.testing.assert_allclose(inner[[0, -1]], outer[[0, -1]], atol=1e-12)  # both pass through P1 and P2
    x, y = np.concatenate([inner, outer[::-1]]).T
    return abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) / 2


@pytest.mark.parametrize(("z_1", "e"), [(11, 6), (12, 6), (13, 6), (14, 6), (15, 6), (13, 5.9), (13, 6.01)])
def test_trapped_volume_is_the_polygon_between_the_profiles(z_1, e):
    """The aggregation constant, taken from periodicity, is the area between the teeth; polygon error 1e-6."""
    c = gears(z_1, eccentricity=e * MM).chambers
    for nu in (0.0, 0.4 * c.mesh.duration, c.mesh.duration):
        assert c.trapped_running(nu) == pytest.approx(13 * MM * trapped_polygon(z_1, e * MM, nu), rel=1e-5)


# --- contact ------------------------------------------------------------------------------------------------------


def test_vector_rays_are_distances_of_the_contact_point():
    """Eqs. 13-16 against coordinates: the contact lies on the common tangent of the base circles."""
    mesh = gears().chambers.mesh
    theta, e = 32 * DEG, 6 * MM
    for y in (0.3, 0.5, 0.8):
        x = mesh.driver_base * (np.cos(theta) + y * np.sin(theta))
        z = mesh.driver_base * (-np.sin(theta) + y * np.cos(theta))
        assert mesh.driver_ray_squared(y) == pytest.approx(x**2 + z**2, rel=1e-12)
        assert mesh.driven_ray_squared(y) == pytest.approx((x + e) ** 2 + z**2, rel=1e-12)


def test_contact_begins_at_the_driven_tip_and_ends_at_the_drivers():
    """Eqs. 8 and 11: the rays are the tip radii there."""
    mesh = gears().chambers.mesh
    assert np.sqrt(mesh.driven_ray_squared(mesh.nu_01)) == pytest.approx(28.6 * MM, rel=1e-12)
    assert np.sqrt(mesh.driver_ray_squared(mesh.nu_02 + mesh.pitch)) == pytest.approx(29.1 * MM, rel=1e-12)


def test_trapped_volume_exists_for_part_of_the_pitch():
    """notes.md: 6.46 of 27.69 deg."""
    mesh = gears().chambers.mesh
    assert mesh.duration / DEG == pytest.approx(6.46, abs=0.005)
    assert mesh.pitch / DEG == pytest.approx(27.69, abs=0.005)


@pytest.mark.parametrize(("z_1", "ratio"), [(12, 1.25), (14, 1.22)])
def test_contact_ratios(z_1, ratio):
    """notes.md, to the digits printed."""
    assert gears(z_1).chambers.mesh.contact_ratio == pytest.approx(ratio, abs=0.005)


TABLE_4 = [(34, 1.22, 1.85), (40, 1.44, 2.18), (46, 1.65, 2.51), (52, 1.87, 2.84)]


@pytest.mark.parametrize(("degrees", "driver", "driven"), TABLE_4)
def test_contacts_at_the_crescent(degrees, driver, driven):
    """Table 4 of the paper, which cuts its digits off: 0.012 below the exact ratio at most."""
    c = gears(crescent_extension=degrees * DEG).chambers
    assert 0 <= c.driver_contacts - driver < 0.012
    assert 0 <= c.driven_contacts - driven < 0.012


def test_phases_of_the_crescent():
    """notes.md at 34 deg: driver 24.373 and 2.988 deg, driven gear 15.621 and 11.740 deg, to the digits printed."""
    c = gears().chambers
    found = np.array([c.driver_closes, c.driver_opens, c.driven_closes, c.driven_opens]) / DEG
    np.testing.assert_allclose(found, [24.373, 2.988, 15.621, 11.740], atol=5e-4)


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_opening_follows_from_the_delivery_end_of_the_crescent(share):
    """notes.md: (pi + Psi_d - g0) mod dphi, and the like for the driven gear with psi = Psi z2/z1."""
    part = gears(suction_share=share, crescent_extension=46 * DEG)
    c, tau = part.chambers, 13 / 16
    g_0 = c.mesh.nu_01 - 32 * DEG - np.pi / 26 - (np.tan(32 * DEG) - 32 * DEG)
    end, P = (1 - share) * 46 * DEG, 2 * np.pi / 16
    assert c.driver_opens == pytest.approx((np.pi + end - g_0) % (2 * np.pi / 13), abs=1e-12)
    assert c.driven_opens == pytest.approx(((np.pi + end / tau - tau * g_0 - P / 2) % P) / tau, abs=1e-12)


def test_driven_tooth_off_the_nominal_centre_distance():
    """Its space's flank passes through the contact point: seen in coordinates at 5.9 mm."""
    mesh = gears(eccentricity=5.9 * MM).chambers.mesh
    contact = mesh.driver_base * np.exp(-1j * mesh.angle) * (1 + 1j * mesh.nu_01) + 5.9 * MM
    assert mesh.driven_tooth == pytest.approx(np.angle(contact) - flank(abs(contact), 16) + np.pi / 16, rel=1e-12)


# --- rates --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "displaced"), [("dVd", 13.689), ("dVs", 13.740)])
def test_displacement(name, displaced):
    """notes.md: 13.689 cc/rev from Eq. 3, 13.740 from Eq. 4; the paper's 13.65 within 0.7 %."""
    part = gears()
    total = 0.0
    for a, b in smooth_intervals(part):
        nu = np.linspace(a, b, 301)
        total += 13 * np.trapezoid([abs(at(part, x)[name]) for x in nu], nu)
    assert total * 1e6 == pytest.approx(displaced, abs=5e-4)
    assert total * 1e6 == pytest.approx(13.65, rel=7e-3)


def test_displacement_per_radian():
    """13.689 cc/rev over 2 pi."""
    assert at(gears(), 0.1)["displacement"] == pytest.approx(13.689e-6 / (2 * np.pi), rel=5e-5)


@pytest.mark.parametrize("z_1", [12, 13, 14])
def test_signs_and_sum_of_the_rates(z_1):
    """Fig. 18: dVd < 0, dVs > 0, dVt < 0 while it exists and 0 else, sum zero."""
    part = gears(z_1)
    for nu in np.linspace(0, pitch(part) - 1e-9, 101):
        found = at(part, nu)
        assert found["dVd"] < 0 < found["dVs"]
        assert found["exists"] == (nu < part.chambers.mesh.duration)
        assert found["dVt"] < 0 if found["exists"] else found["dVt"] == 0
        assert abs(found["dVd"] + found["dVs"] + found["dVt"]) < 1e-20


def test_rates_jump_where_the_trapped_volume_begins_and_ends():
    """Fig. 18: delivery jumps where it begins and the suction does not; where it ends it is the other way round."""
    part, tiny = gears(), 1e-9
    before, after = at(part, pitch(part) - tiny), at(part, 0.0)
    assert after["dVd"] - before["dVd"] > 0.02 * abs(before["dVd"])
    assert after["dVs"] == pytest.approx(before["dVs"], rel=1e-7)
    end = part.chambers.mesh.duration
    before, after = at(part, end - tiny), at(part, end + tiny)
    assert before["dVs"] - after["dVs"] > 1e-3 * before["dVs"]
    assert after["dVd"] == pytest.approx(before["dVd"], rel=1e-7)


def test_rates_by_hand():
    """Eqs. 3-5 written out at nu_d = 3 deg (trapped volume) and 15 deg (none)."""
    H, tau, theta = 13 * MM, 13 / 16, 32 * DEG
    rho_1, rho_2 = 26 * MM * np.cos(theta), 32 * MM * np.cos(theta)
    nu_01 = (np.sqrt(28.6e-3**2 - rho_2**2) - rho_2 * (1 - tau) * np.tan(theta)) / rho_1
    nu_02 = np.sqrt(29.1e-3**2 - rho_1**2) / rho_1 - 2 * np.pi / 13

    def rays(y):
        return rho_1**2 * (1 + y**2), rho_2**2 * (1 + (tau * y + (1 - tau) * np.tan(theta)) ** 2)

    for nu, trapped in ((3 * DEG, True), (15 * DEG, False)):
        nu_s = nu + nu_01 - nu_02 + (2 * np.pi / 13 if trapped else 0)
        (i_1, o_1), (i_2, o_2) = rays(nu + nu_01), rays(nu_s + nu_02)
        found = at(gears(), nu)
        assert found["dVd"] == pytest.approx(H / 2 * (i_1 - 29.1e-3**2 + tau * (28.6e-3**2 - o_1)), rel=1e-12)
        assert found["dVs"] == pytest.approx(H / 2 * (29.1e-3**2 - i_2 + tau * (o_2 - 28.6e-3**2)), rel=1e-12)
        assert found["dVt"] == pytest.approx(H / 2 * (i_2 - i_1 + tau * (o_1 - o_2)), rel=1e-9, abs=1e-20)
        assert found["dV_delivery"] == pytest.approx(found["dVd"] * OMEGA)
        assert found["dV_suction"] == pytest.approx(found["dVs"] * OMEGA)
        assert found["dV_trapped"] == pytest.approx(found["dVt"] * OMEGA)


def test_torque_is_the_shafts_on_the_gears():
    """The shaft's power equals what the gears do to the chambers, and is positive while pumping."""
    for nu in (0.05, 0.3):
        found = at(gears(), nu)
        power = -(5e5 * found["dV_delivery"] - 1e4 * found["dV_suction"] + 8e5 * found["dV_trapped"])
        assert found["torque_shaft"] * OMEGA == pytest.approx(power, rel=1e-12)
        assert found["torque"] == found["torque_shaft"] > 0


def test_mean_torque_is_pressure_times_displacement():
    """At 5 bar against 0 with the trapped volume at delivery pressure: 5 bar x 13.74 cc/rev = 1.093 N m."""
    part = gears()
    nu = (np.arange(2000) + 0.5) / 2000 * pitch(part)
    torque = [at(part, x, p_delivery=5e5, p_suction=0.0, p_trapped=5e5)["torque"] for x in nu]
    assert np.mean(torque) == pytest.approx(5e5 * 13.7405e-6 / (2 * np.pi), rel=1e-4)


# --- volumes ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("z_1", [12, 13, 14])
@pytest.mark.parametrize("degrees", [34, 52])
def test_volumes_integrate_the_rates_between_jumps(z_1, degrees):
    """Simpson quadrature of the rates, exact for their squares in the angle: differences are rounding."""
    part = gears(z_1, crescent_extension=degrees * DEG)
    for a, b in smooth_intervals(part):
        first, middle, last = (at(part, x) for x in (a, (a + b) / 2, b))
        for name, rate in (("V_delivery", "dVd"), ("V_suction", "dVs"), ("V_trapped", "dVt")):
            integral = (b - a) / 6 * (first[rate] + 4 * middle[rate] + last[rate])
            assert last[name] - first[name] == pytest.approx(integral, abs=1e-18)


def test_volumes_jump_by_what_joins_and_leaves():
    """notes.md: 566.75 and 528.76 mm3 join delivery and leave suction, 42.527 leaves delivery, 38.552 joins suction."""
    part, tiny = gears(), 1e-10
    c = part.chambers

    def jump(name, nu):
        before = at(part, (nu if nu else pitch(part)) - tiny)[name]
        return (at(part, nu + tiny)[name] - before) * 1e9

    expected = [
        ("V_delivery", c.driver_opens, 566.75), ("V_delivery", c.driven_opens, 528.76), ("V_delivery", 0.0, -42.527),
        ("V_delivery", c.mesh.duration, 0), ("V_delivery", c.driver_closes, 0), ("V_delivery", c.driven_closes, 0),
        ("V_suction", c.driver_closes, -566.75), ("V_suction", c.driven_closes, -528.76), ("V_suction", 0.0, 0),
        ("V_suction", c.mesh.duration, 38.552), ("V_suction", c.driver_opens, 0), ("V_suction", c.driven_opens, 0),
    ]  # fmt: skip
    for name, nu, size in expected:
        assert jump(name, nu) == pytest.approx(size, abs=5e-3)


@pytest.mark.parametrize("z_1", [12, 13, 14])
@pytest.mark.parametrize("degrees", [34, 40, 46, 52])
def test_volumes_with_the_carried_ones_fill_the_pump(z_1, degrees):
    """The sum over all chambers never changes; which carried volumes exist is told by contacts on the crescent."""
    part = gears(z_1, crescent_extension=degrees * DEG, suction_share=0.4)
    c, P = part.chambers, pitch(part)
    sums = []
    for nu in np.linspace(0, P, 150, endpoint=False):
        found = at(part, nu)
        carried = 0.0
        for space, closes, extension in (
            (c.driver_space, c.driver_closes, c.driver_extension),
            (c.driven_space, c.driven_closes, c.driven_extension),
        ):
            since = (nu - closes) % P
            contacts = np.sum(since + P * np.arange(6) < extension)
            carried += (contacts - 1) * space
        trapped = found["V_trapped"] if found["exists"] else 0.0
        sums.append(found["V_delivery"] + found["V_suction"] + trapped + carried)
    assert np.ptp(sums) < 1e-18


@pytest.mark.parametrize("z_1", [12, 13, 14])
def test_given_means_are_the_means(z_1):
    """Means over a pitch by the trapezoidal rule between the jumps."""
    part = gears(z_1)
    for name, mean in (("V_delivery", 20e-6), ("V_suction", 45e-6)):
        area = 0.0
        for a, b in smooth_intervals(part):
            nu = np.linspace(a, b, 301)
            area += np.trapezoid([at(part, x)[name] for x in nu], nu)
        assert area / pitch(part) == pytest.approx(mean, rel=1e-8)


def test_mean_volumes_keep_the_rates():
    """Section 6.1: the mean volume in the denominator of Eq. 2; the rates stay."""
    for nu in (0.05, 0.3):
        instant, mean = at(gears(), nu), at(gears(volumes="mean"), nu)
        assert (mean["V_delivery"], mean["V_suction"]) == (20e-6, 45e-6)
        assert 38.552e-9 < mean["V_trapped"] < 42.527e-9
        assert mean["dVd"] == instant["dVd"]


def test_trapped_volume_is_positive_while_it_does_not_exist():
    """A branch that is not used is still divided by."""
    assert at(gears(), 0.3)["V_trapped"] == pytest.approx(42.527e-9, abs=5e-13)


# --- events and phases --------------------------------------------------------------------------------------------


def test_a_new_pitch_begins_after_each_pitch():
    """The held angle advances by 2 pi/13, so that everything is periodic."""
    part = gears()
    event = at(part, pitch(part) + 1e-9)["meshes"]
    assert event.condition
    assert not at(part, pitch(part) - 1e-9)["meshes"].condition
    assert event.then["mesh_start"] == pytest.approx(2 * np.pi / 13, rel=1e-14)
    later = at(part, 2 * np.pi / 13 + 0.1, mesh_start=event.then["mesh_start"])
    assert later["V_delivery"] == pytest.approx(at(part, 0.1)["V_delivery"], rel=1e-12)


@pytest.mark.parametrize("phi", [0.0, 0.2, 17.3, -4.0])
@pytest.mark.parametrize("start", [0.0, 0.25, 2.0, -0.1])
def test_any_start_angle(phi, start):
    """The running pitch is found from the shaft's angle: nu_d = start_phase at shaft angle 0, modulo a pitch."""
    part = gears(start_phase=start)
    event = at(part, phi, started=0.0)["begins"]
    assert event.condition
    assert event.then["started"] == 1.0
    nu = phi - event.then["mesh_start"]
    assert 0 <= nu < pitch(part)
    assert np.exp(13j * (phi + start)) == pytest.approx(np.exp(13j * nu), abs=1e-12)
    assert not at(part, phi, mesh_start=event.then["mesh_start"])["begins"].condition


def test_held_start_value_fits_a_shaft_at_zero():
    """Before the first event the angle is right already, for the shaft that starts at 0."""
    part = gears(start_phase=10 * DEG)
    start = next(h.start for h in part.declared(type(CrescentGears.mesh_start)) if h.name == "mesh_start")
    assert start(part) == pytest.approx(-10 * DEG)


@pytest.mark.parametrize("z_1", [12, 13, 14])
@pytest.mark.parametrize("start", [0.0, 0.1, 0.3])
def test_phases_pass_whole_pitches_when_a_volume_closes(z_1, start):
    """They are within the first pitch at shaft angle 0 and run with the shaft."""
    part = gears(z_1, start_phase=start)
    c = part.chambers
    for name, closes in (("driver_phase", c.driver_closes), ("driven_phase", c.driven_closes)):
        assert 0 <= at(part, 0.0)[name] < pitch(part)
        phi = closes - start
        phase = at(part, phi)[name] / pitch(part)
        assert phase == pytest.approx(round(phase), abs=1e-12)
        assert at(part, phi + 5.0)[name] - at(part, phi)[name] == pytest.approx(5.0, rel=1e-14)


# --- inputs that cannot be ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("parameters", "reason"),
    [
        ({"driven_teeth": 13}, "more teeth than the driver"),
        ({"eccentricity": 5e-3}, "eccentricity is below the difference"),
        ({"driver_root_radius": 30e-3}, "driver's tip lies within"),
        ({"driven_tip_radius": 27e-3}, "driven gear's tip does not lie between"),
        ({"driver_tip_radius": 31e-3}, "come to a point"),
        ({"driver_tip_radius": 28e-3, "driven_tip_radius": 30e-3}, "do not mesh continuously .contact ratio 0.718"),
        ({"eccentricity": "6.3 mm"}, "teeth overlap"),
        ({"module": "2 mm"}, "with driver_teeth 13, driven_teeth 16"),
        ({"driver_teeth": 12, "driven_teeth": 16}, "driver_teeth 12, driven_teeth 16, pressure_angle 32 deg"),
        ({"delivery_volume_mean": "0.3 cm^3"}, "delivery_volume_mean must exceed"),
        ({"suction_volume_mean": "0.3 cm^3"}, "suction_volume_mean must exceed"),
    ],
)  # fmt: skip
def test_geometry_that_cannot_pump_is_an_input_error(parameters, reason):
    """notes.md: geometry without continuous meshing is an input error that names the parameters."""
    with pytest.raises(ValidationError, match=reason):
        CrescentGears(**parameters)
