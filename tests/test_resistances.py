"""Orifices, gaps, tubes and fittings where they change: limits, signs, reversal, slopes, walls that move.

The figures they are checked against are in `tests/evidence`; that they pass what enters, in `test_components`.
"""

import math

import casadi as ca
import numpy as np
import pytest
from building import circuit
from crescentlab.components import flow_laws
from crescentlab.components.coolers import Cooler
from crescentlab.components.fittings import Bend, Elbow, LocalLoss, SuddenContraction, SuddenExpansion, bend_loss
from crescentlab.components.fluids import SimpleOil
from crescentlab.components.gaps import AnnularGap, AxialFaceGap, LaminarGap, MovingAnnularGap, RotatingAnnularGap
from crescentlab.components.orifices import LaminarTurbulentOrifice, RatedOrifice
from crescentlab.components.resistances import MeasuredResistance, PipeResistance, ShortTube
from pydantic import ValidationError

from crescentlab.symbols import Sym

BAR, LPM, MM = 1e5, 1e-3 / 60, 1e-3
RHO, NU = 850.0, 30e-6
OIL = SimpleOil(density=RHO, kinematic_viscosity=NU, bulk_modulus=1.7e9)
STIFF = SimpleOil(density=RHO, kinematic_viscosity=NU, bulk_modulus=1e15)


def passed(part, drop, oil=STIFF):
    """Flow [m^3/s] from a to b at a drop [Pa], the lower pressure being 0."""
    return part.equations(p_a=np.maximum(drop, 0.0), p_b=np.maximum(-drop, 0.0), fluid=oil)["q"]


def slope_at(part, drop, oil=STIFF):
    """dq/dp_a [m^3/(s Pa)] by the symbols that a circuit is made of."""
    p = ca.SX.sym("p")
    q = part.equations(p_a=Sym(p), p_b=0.0, fluid=oil)["q"]
    return float(ca.Function("slope", [p], [ca.jacobian(q.sx, p)])(drop))


# -- pipes in all regimes ----------------------------------------------------------------------------


@pytest.mark.parametrize("roughness", [0.0, 1e-6, 1e-4, 1e-3])
@pytest.mark.parametrize("loss", [0.0, 1.5, 500.0])
def test_pipe_resistance_inverts_the_friction_drop(roughness, loss):
    """q(dp(q)) = q from creeping flow through transition to Re = 1e8, with density and viscosity of the mean pressure.

    1e-12: four Newton steps on the logarithms end at rounding, which the law's slopes of 1 to 4 do not enlarge.
    """
    d, length = 12 * MM, 2.0
    reynolds = np.concatenate([np.logspace(-4, 8, 241), np.linspace(500, 6000, 441)])
    q = reynolds * NU * math.pi / 4 * d
    drop = flow_laws.pipe_friction_drop(q, length, d, roughness, STIFF, 0.0, loss)
    rigid = SimpleOil(density=RHO, kinematic_viscosity=NU, bulk_modulus=1e30)
    pipe = PipeResistance(length=length, diameter=d, roughness=roughness, loss_coefficient=loss)
    np.testing.assert_allclose(passed(pipe, drop, rigid), q, rtol=1e-12)
    np.testing.assert_allclose(passed(pipe, -drop, rigid), -q, rtol=1e-12)


def test_pipe_resistance_takes_the_fluid_at_the_mean_pressure():
    """Between 300 and 100 bar: the drop that `pipe_friction_drop` has at 200 bar; rounding, 1e-11 of 200 bar."""
    pipe = PipeResistance(length=1.0, diameter=4 * MM, roughness=1e-5)
    q = pipe.equations(p_a=300 * BAR, p_b=100 * BAR, fluid=OIL)["q"]
    drop = flow_laws.pipe_friction_drop(q, 1.0, 4 * MM, 1e-5, OIL, 200 * BAR)
    assert drop == pytest.approx(200 * BAR, rel=1e-11)


@pytest.mark.parametrize("reynolds", [1e-3, 100.0, 1900.0, 2299.0, 2600.0, 3500.0, 1e5])
def test_pipe_resistance_has_the_slope_of_its_inverse(reynolds):
    """dq/dp of the symbols is one over d(dp)/dq, also in transition: the Newton steps leave no kink; 1e-6."""
    d, length, loss = 10 * MM, 1.0, 0.5
    q = ca.SX.sym("q")
    at = reynolds * NU * math.pi / 4 * d
    rising = flow_laws.pipe_friction_drop(Sym(q), length, d, 0.0, STIFF, 0.0, loss)
    drop = ca.Function("drop", [q], [rising.sx, ca.jacobian(rising.sx, q)])
    value, slope = (float(x) for x in drop(at))
    pipe = PipeResistance(length=length, diameter=d, loss_coefficient=loss)
    assert slope_at(pipe, value) == pytest.approx(1 / slope, rel=1e-6)


def test_pipe_resistance_at_rest():
    """Slope at zero drop: pi d^4/(128 mu l), whatever the local loss."""
    for loss in (0.0, 10.0):
        pipe = PipeResistance(length=1.0, diameter=10 * MM, loss_coefficient=loss)
        assert slope_at(pipe, 0.0) == pytest.approx(math.pi * 1e-8 / (128 * RHO * NU), rel=1e-9)


def test_parallel_pipes():
    """A bundle passes as many times the flow of one."""
    one, many = (PipeResistance(length=1.0, diameter=4 * MM, parallel=n) for n in (1, 40))
    assert passed(many, BAR) == pytest.approx(40 * passed(one, BAR), rel=1e-14)


# -- orifices and tubes ------------------------------------------------------------------------------


def test_laminar_turbulent_orifice_between_its_limits():
    """The drop that its velocity v makes, rho/(2 Cd^2) (v^2 + nu/d Re_t v), over ten decades; 1e-7 for the oil."""
    part = LaminarTurbulentOrifice(area="1 mm2", hydraulic_diameter="1 mm")
    for drop in np.logspace(-3, 7, 25):
        v = passed(part, drop) / 1e-6
        expected = RHO / (2 * 0.611**2) * (v * v + NU / 1e-3 * (0.611 / 0.2) ** 2 * v)
        assert expected == pytest.approx(drop, rel=1e-7)


def test_laminar_turbulent_orifice_may_be_closed():
    """No area, no flow, and a finite slope."""
    shut = LaminarTurbulentOrifice(area=0.0)
    assert passed(shut, 100 * BAR) == 0.0
    assert slope_at(shut, 0.0) == 0.0


def test_both_orifices_agree_where_both_are_turbulent():
    """Same end value, 1000 bar through 2 mm: within Re_t/(2 Re) = 0.1 %."""
    drop = 1000 * BAR
    reynolds = 0.611 * math.sqrt(2 * drop / RHO) * 2e-3 / NU
    assert reynolds > 4.6e3
    torricelli = 0.611 * math.pi * 1e-6 * math.sqrt(2 * drop / RHO)
    q = passed(LaminarTurbulentOrifice(area=math.pi * 1e-6), drop)
    assert q == pytest.approx(torricelli, rel=1.01 * 9.34 / (2 * reynolds))


def test_rated_orifice_is_straight_at_rest():
    """Slope at zero drop: q_r/sqrt(p_r p_t), the tangent of the rounded root."""
    part = RatedOrifice(rated_flow="60 L/min", rated_drop="10 bar", reference_density=RHO, transition_drop="0.1 bar")
    assert slope_at(part, 0.0) == pytest.approx(1e-3 / math.sqrt(1e6 * 1e4), rel=1e-9)
    assert passed(part, 0.1 * BAR) == pytest.approx(1e-3 * 0.1 / 2**0.25, rel=1e-9)


def test_short_tube_rises_smoothly():
    """Over 16 decades of drop: rising, and d ln q/d ln p between that of an orifice and a capillary, 1/2 to 1."""
    drop = np.logspace(-6, 10, 1601)
    log_q = np.log(passed(ShortTube(diameter="1 mm", length="5 mm"), drop))
    slope = np.diff(log_q) / np.diff(np.log(drop))
    assert slope.min() > 0.5 - 1e-6
    assert slope.max() < 1 + 1e-6
    assert np.abs(np.diff(slope)).max() < 0.01  # a jump of 1.7 % within a step of 2.3 % would be 0.7


def test_short_tube_solves_its_law():
    """dp = xi rho v^2/2 with xi as `short_tube_flow` states it, over x = l/(d Re) from 1e-6 to 1e6; 1e-12."""
    rigid = SimpleOil(density=RHO, kinematic_viscosity=NU, bulk_modulus=1e30)
    d, length, x = 1 * MM, 5 * MM, np.logspace(-6, 6, 481)
    v, w = length * NU / (d * d * x), 0.000212 / (0.000212 + x * x)
    drop = (w * (1.5 + 13.74 * np.sqrt(x)) + (1 - w) * (2.28 + 64 * x)) * RHO * v * v / 2
    np.testing.assert_allclose(
        passed(ShortTube(diameter=d, length=length), drop, rigid), math.pi / 4 * d * d * v, rtol=1e-12
    )


def test_short_tube_at_rest_is_a_capillary():
    """Slope at zero drop: pi d^4/(128 mu l)."""
    tube = ShortTube(diameter="1 mm", length="5 mm")
    assert slope_at(tube, 0.0) == pytest.approx(math.pi * 1e-12 / (128 * RHO * NU * 5e-3), rel=1e-9)


# -- measured resistances ----------------------------------------------------------------------------


def test_two_points_of_a_curve_make_a_measured_resistance():
    """K = (p2/q2 - p1/q1)/(q2 - q1), R = p1/q1 - K q1, as the docstring says: both points come back."""
    (q_1, p_1), (q_2, p_2) = (20 * LPM, 0.3 * BAR), (60 * LPM, 1.5 * BAR)
    k = (p_2 / q_2 - p_1 / q_1) / (q_2 - q_1)
    settings = {"laminar": p_1 / q_1 - k * q_1, "turbulent": k, "reference_density": RHO, "reference_viscosity": NU}
    for cls in (MeasuredResistance, Cooler):
        assert passed(cls(**settings), p_1) == pytest.approx(q_1, rel=1e-8)
        assert passed(cls(**settings), -p_2) == pytest.approx(-q_2, rel=1e-8)


# -- gaps whose walls move ---------------------------------------------------------------------------


def test_a_closed_face_gap_carries_the_pressures():
    """Height 0: no leakage, but the same lift: between equal pressures p the ring's area times p."""
    gap = AxialFaceGap(inner_diameter="10 mm", outer_diameter="20 mm", height=0.0)
    found = gap.equations(p_a=50 * BAR, p_b=50 * BAR, fluid=STIFF)
    assert found["q"] == 0.0
    assert found["lift"] == pytest.approx(50 * BAR * math.pi / 4 * (0.02**2 - 0.01**2), rel=1e-12)


def test_a_sector_of_a_face_gap():
    """60 degrees leak and lift a sixth."""
    settings = {"inner_diameter": "10 mm", "outer_diameter": "20 mm", "height": "20 um"}
    whole, sector = AxialFaceGap(**settings), AxialFaceGap(**settings, angle="60 deg")
    p = {"p_a": 80 * BAR, "p_b": 10 * BAR, "fluid": STIFF}
    for name in ("q", "lift"):
        assert sector.equations(**p)[name] == pytest.approx(whole.equations(**p)[name] / 6, rel=1e-12)


def test_a_thin_ring_is_a_slot():
    """Width l = r2 - r1 far below r: a flat gap pi d wide; the logarithm's next term is (l/d)^2/3 = 3e-7."""
    ring = AxialFaceGap(inner_diameter="19.98 mm", outer_diameter="20.02 mm", height="10 um")
    slot = LaminarGap(width=math.pi * 20 * MM, height="10 um", length="0.02 mm")
    assert passed(ring, BAR) == pytest.approx(passed(slot, BAR), rel=1e-6)


def test_moving_gap_at_rest_is_an_annulus():
    """Without velocity: the leakage of `annular_gap`, and the pressure's pull on the wall, -pi d c dp/2."""
    settings = {"diameter": "20 mm", "clearance": "15 um", "length": "30 mm", "eccentricity": 0.7}
    found = MovingAnnularGap(**settings).equations(p_a=100 * BAR, p_b=0.0, v_rod=0.0, fluid=STIFF)
    assert found["q"] == pytest.approx(passed(AnnularGap(**settings), 100 * BAR), rel=1e-14)
    assert found["f_rod"] == pytest.approx(-math.pi * 0.02 * 15e-6 / 2 * 100 * BAR, rel=1e-12)


def test_walls_that_move_turn_work_into_heat():
    """loss = q dp + F v is never negative and vanishes at rest, whatever pressures and velocities."""
    random = np.random.default_rng(5)
    sliding = MovingAnnularGap(diameter="20 mm", clearance="15 um", length="30 mm", eccentricity=0.5)
    turning = RotatingAnnularGap(diameter="20 mm", clearance="15 um", length="30 mm", eccentricity=0.5)
    for p_a, p_b, v in random.uniform(-1, 1, (50, 3)):
        p = {"p_a": 100 * BAR * p_a, "p_b": 100 * BAR * p_b, "fluid": STIFF}
        assert sliding.equations(v_rod=v, **p)["loss"] > 0
        assert turning.equations(omega_shaft=300 * v, **p)["loss"] > 0
    assert sliding.equations(p_a=0.0, p_b=0.0, v_rod=0.0, fluid=STIFF)["loss"] == 0


def test_mass_stopped_by_the_oil_around_it():
    """v = v_0 exp(-t/tau), tau = m c/(pi d mu l): 0.2 kg, 20 mm, 20 um, 30 mm, 25.5 mPa s: 83.2 ms.

    The flow dragged along is pi d c v/2. 1e-5 for rtol 1e-8 of the run and the density between the tanks.
    """
    tau = 0.2 * 20e-6 / (math.pi * 0.02 * RHO * NU * 0.03)
    bench = circuit(
        components={
            "piston": {
                "type": "mass_with_stops",
                "mass": "200 g",
                "low": "-1 m",
                "high": "1 m",
                "start": {"v": "1 m/s"},
            },
            "gap": {"type": "moving_annular_gap", "diameter": "20 mm", "clearance": "20 um", "length": "30 mm"},
            "left": {"type": "tank"},
            "right": {"type": "tank"},
        },
        nets={
            "rod": ["piston.port", "gap.rod"],
            "p_left": ["gap.a", "left.port"],
            "p_right": ["gap.b", "right.port"],
        },
        fluid={
            "type": "simple_oil",
            "density": "850 kg/m3",
            "kinematic_viscosity": "30 cSt",
            "bulk_modulus": "1.7 GPa",
        },
    )
    result = bench.simulate("100 ms", rtol=1e-8)
    v = np.exp(-result.time / tau)
    np.testing.assert_allclose(result["piston.v"], v, atol=1e-5)
    np.testing.assert_allclose(result["gap.q"], math.pi * 0.02 * 20e-6 / 2 * v, atol=1e-5 * 6.3e-7)


# -- fittings ----------------------------------------------------------------------------------------


def test_expansion_and_contraction_swap_roles():
    """An expansion passed backwards is the contraction of the same sections, and the other way round."""
    sections = {"narrow_diameter": "6 mm", "wide_diameter": "10 mm"}
    expansion, contraction = SuddenExpansion(**sections), SuddenContraction(**sections)
    for drop in np.logspace(-3, 6, 19):
        assert passed(expansion, -drop) == pytest.approx(-passed(contraction, drop), rel=1e-14)
        assert passed(contraction, -drop) == pytest.approx(-passed(expansion, drop), rel=1e-14)


def test_steps_are_smooth_where_the_flow_turns():
    """At rest both ways have the laminar slope 2 d A/(K_1 rho nu), though their coefficients differ."""
    part = SuddenExpansion(narrow_diameter="6 mm", wide_diameter="10 mm")
    laminar = 2 * 6e-3 * math.pi / 4 * 36e-6 / (30 * RHO * NU)
    for drop in (-1e-9, 0.0, 1e-9):
        assert slope_at(part, drop) == pytest.approx(laminar, rel=1e-6)


def test_local_loss_of_two_ways():
    """zeta = 1 forwards, 4 backwards: half the flow once both are turbulent; default: the same both ways.

    1e-3 for K_1/Re at 100 bar, 500 over 1.5e6.
    """
    thin = SimpleOil(density=RHO, kinematic_viscosity=1e-6, bulk_modulus=1e15)
    two = LocalLoss(diameter="10 mm", loss_coefficient=1.0, loss_coefficient_back=4.0)
    assert passed(two, -100 * BAR, thin) == pytest.approx(-passed(two, 100 * BAR, thin) / 2, rel=1e-3)
    same = LocalLoss(diameter="10 mm", loss_coefficient=1.0)
    assert passed(same, -100 * BAR, thin) == -passed(same, 100 * BAR, thin)


def test_a_loss_of_nothing_is_laminar():
    """zeta = 0: v = 2 dp d/(K_1 rho nu) at every drop."""
    part = LocalLoss(diameter="10 mm", loss_coefficient=0.0, laminar_coefficient=100.0)
    for drop in (1e-6, 1.0, BAR):
        expected = math.pi / 4 * 1e-4 * 2 * drop * 0.01 / (100 * RHO * NU)
        assert passed(part, drop) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("laminar", [0.0, 800.0, 1e5])
@pytest.mark.parametrize(("radius", "roughness"), [(5 * MM, 0.0), (15 * MM, 1e-5), (400 * MM, 1e-3)])
def test_bend_is_friction_curvature_and_a_laminar_part(laminar, radius, roughness):
    """The drop of R delta of pipe with the loss of the curvature and K_1/Re on it, from creeping flow to Re = 1e8.

    1e-12: solved to rounding, as the pipe.
    """
    d, nu = 10 * MM, NU
    rigid = SimpleOil(density=RHO, kinematic_viscosity=nu, bulk_modulus=1e30)
    settings = {"angle": math.pi / 3, "roughness": roughness, "laminar_coefficient": laminar}
    bend = Bend(diameter=d, radius=radius, **settings)
    loss = bend_loss(radius / d, math.pi / 3)
    reynolds = np.concatenate([np.logspace(-4, 8, 241), np.linspace(500, 6000, 441)])
    v = reynolds * nu / d
    q = v * math.pi / 4 * d * d
    drop = flow_laws.pipe_friction_drop(q, radius * math.pi / 3, d, roughness, rigid, 0.0, loss)
    drop = drop + laminar / reynolds * RHO * v * v / 2
    np.testing.assert_allclose(passed(bend, drop, rigid), q, rtol=1e-12)
    np.testing.assert_allclose(passed(bend, -drop, rigid), -q, rtol=1e-12)


def test_bend_at_rest():
    """Slope at zero drop: dp = (64 R delta/d + K_1) rho nu v/(2 d)."""
    part = Bend(diameter=10 * MM, radius=15 * MM)
    expected = math.pi / 4 * 1e-4 * 2 * 0.01 / ((64 * 1.5 * math.pi / 2 + 800) * RHO * NU)
    assert slope_at(part, 0.0) == pytest.approx(expected, rel=1e-9)


def test_loss_of_a_bend_by_its_formula():
    """0.9 sin 60 deg 0.21/sqrt(1.5)."""
    expected = 0.9 * math.sin(math.pi / 3) * 0.21 / math.sqrt(1.5)
    assert bend_loss(1.5, math.pi / 3) == pytest.approx(expected, rel=1e-12)


def test_bend_loss_has_no_jumps():
    """In angle and curvature: steps of a thousandth change the loss by little, and it falls with the radius."""
    angles = bend_loss(1.0, np.linspace(0, math.pi, 1001))
    assert np.all(np.diff(angles) > 0)
    assert np.diff(angles).max() < 0.9 * 0.21 * math.pi / 1000 * 1.01  # the slope of the sine at 0
    curvatures = bend_loss(np.linspace(0.5, 5, 4501), math.pi / 2)
    assert np.all(np.diff(curvatures) < 0)
    assert bend_loss(1 - 1e-12, 1.0) == pytest.approx(bend_loss(1.0, 1.0), rel=1e-11)


@pytest.mark.parametrize(
    ("cls", "settings", "message"),
    [
        (Bend, {"diameter": "10 mm", "radius": "4 mm"}, "a sharp corner is an elbow"),
        (Bend, {"diameter": "10 mm", "radius": "20 mm", "angle": "190 deg"}, "less than or equal"),
        (Elbow, {"diameter": "10 mm", "angle": "0 deg"}, "greater than"),
        (SuddenExpansion, {"narrow_diameter": "10 mm", "wide_diameter": "10 mm"}, "must be larger than"),
        (SuddenContraction, {"narrow_diameter": "12 mm", "wide_diameter": "10 mm"}, "narrow_diameter \\(12 mm\\)"),
        (AxialFaceGap, {"inner_diameter": "2 mm", "outer_diameter": "1 mm", "height": "1 um"}, "must be larger than"),
        (
            MovingAnnularGap,
            {"diameter": "1 mm", "clearance": "1 um", "length": "1 mm", "eccentricity": 1.0},
            "less than",
        ),
        (RotatingAnnularGap, {"diameter": "1 mm", "clearance": "0 um", "length": "1 mm"}, "greater than"),
        (LocalLoss, {"diameter": "1 mm", "loss_coefficient": 1.0, "laminar_coefficient": 0.0}, "greater than"),
        (MeasuredResistance, {"laminar": "1 bar"}, "flow resistance"),
    ],
)
def test_refuses_what_has_no_law(cls, settings, message):
    """Shapes that cannot be, and values that would divide by zero."""
    with pytest.raises(ValidationError, match=message):
        cls(**settings)
