"""Flow laws, restrictions, gaps, volumes, boundaries, shafts and sensors against closed forms."""

import math

import casadi as ca
import numpy as np
import pytest
from crescentlab.components import flow_laws
from crescentlab.components.boundaries import (
    FlowSource,
    Plug,
    PressureSource,
    SignalFlowSource,
    SignalPressureSource,
    Tank,
)
from crescentlab.components.capacities import Capacity, CompliantCapacity, VariableCapacity
from crescentlab.components.fluids import AeratedOil, SimpleOil
from crescentlab.components.gaps import AnnularGap, LaminarGap, VariableHeightGap, VariableWidthGap
from crescentlab.components.orifices import Orifice, Throttle, VariableOrifice
from crescentlab.components.rotation import SignalSpeedSource, SpeedSource
from crescentlab.components.sensors import (
    AngleSensor,
    DifferentialPressureSensor,
    FlowSensor,
    PositionSensor,
    PressureSensor,
    SpeedSensor,
    VelocitySensor,
)
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from crescentlab.symbols import Sym

BAR, LPM = 1e5, 1e-3 / 60
RHO, NU = 860.0, 35e-6
STIFF = SimpleOil(density=RHO, kinematic_viscosity=NU, bulk_modulus=1e15)
OIL = SimpleOil(density=RHO, kinematic_viscosity=NU, bulk_modulus=1.4e9)
PUMP_OIL = AeratedOil(
    density=RHO, kinematic_viscosity=NU, bulk_modulus=1.4e9, air_fraction=0.005, saturation_pressure=1e8
)
COVER = {"x": ["0 bar", "3 bar", "6 bar"], "y": ["0 mm", "0.016 mm", "0.040 mm"]}

# -- orifices ----------------------------------------------------------------------------------------


def test_orifice_discharge():
    """Turbulent: q = 0.7 A sqrt(2 dp/rho), 10 mm^2 at 100 bar: 64.05 L/min; C_d is at its end value to 1e-9."""
    q = Orifice(area="10 mm2").equations(p_a=100 * BAR, p_b=0.0, fluid=STIFF)["q"]
    assert q == pytest.approx(0.7 * 10e-6 * math.sqrt(2 * 100e5 / 860), rel=1e-7)
    assert q / LPM == pytest.approx(64.05, abs=0.01)


def test_orifice_laminar_limit():
    """Small drops: q = 4 C_d,max A d_h dp/(nu lambda_c rho), from tanh(r) = r; at 1e-3 Pa to 1e-6."""
    part = Orifice(area="1 mm2", hydraulic_diameter="1 mm", lambda_c=1000)
    q = part.equations(p_a=1e-3, p_b=0.0, fluid=STIFF)["q"]
    assert q == pytest.approx(4 * 0.7 * 1e-6 * 1e-3 * 1e-3 / (NU * 1000 * RHO), rel=1e-6)


def test_orifice_follows_tanh_through_the_series_and_beyond():
    """The root-free form equals C_d A sqrt(2 dp/rho) with C_d = C_d,max tanh(2 lambda/lambda_c); oil gives 1e-8."""
    part = Orifice(area="1 mm2", hydraulic_diameter="1 mm", lambda_c=100)
    for drop in np.logspace(-4, 7, 60):
        speed = math.sqrt(2 * drop / RHO)
        expected = 0.7 * math.tanh(2 * 1e-3 * speed / NU / 100) * 1e-6 * speed
        found = part.equations(p_a=drop, p_b=0.0, fluid=STIFF)
        assert found["q"] == pytest.approx(expected, rel=1e-7)
        assert found["q_a"] == -found["q_b"] == found["q"]
        assert part.equations(p_a=0.0, p_b=drop, fluid=STIFF)["q"] == pytest.approx(-found["q"], rel=1e-12)


def test_orifice_takes_density_at_the_mean_pressure():
    """Between 8 and 2 bar the density is that at 5 bar; turbulent, so the mass flow goes with sqrt(rho).

    rho_0 is 0.995 of the liquid's 860 kg/m^3, with half a per cent of air.
    """
    q = Orifice(area="10 mm2", lambda_c=1).equations(p_a=8 * BAR, p_b=2 * BAR, fluid=PUMP_OIL)["q"]
    mass_flow = 0.7 * 10e-6 * math.sqrt(2 * 6e5 * PUMP_OIL.density(5 * BAR))
    assert q == pytest.approx(mass_flow / (0.995 * 860), rel=1e-9)


@pytest.mark.parametrize("p", [(0.0, 0.0), (5e5, 5e5), (5e5, 0.0), (-101325.0, -101325.0)])
@pytest.mark.parametrize("area", [0.0, 1e-6, -1e-9])
def test_orifice_jacobian_is_finite(p, area):
    """At zero drop, zero and slightly negative area, and at absolute zero pressure."""
    u = ca.SX.sym("u", 3)
    q = flow_laws.orifice_flow(Sym(u[0]), Sym(u[1]), Sym(u[2]), None, 0.7, 100.0, PUMP_OIL)
    jacobian = ca.Function("jacobian", [u], [ca.jacobian(q.sx, u)])([*p, area])
    assert np.all(np.isfinite(np.array(jacobian)))


def test_variable_orifice_opens_with_its_signal():
    """Half open is an orifice of half the area; closed at 0 and below; a vector opens one by one."""
    whole = VariableOrifice(area="4 mm2")
    half = Orifice(area="2 mm2").equations(p_a=3 * BAR, p_b=1 * BAR, fluid=PUMP_OIL)["q"]
    assert whole.equations(p_a=3 * BAR, p_b=1 * BAR, opening=0.5, fluid=PUMP_OIL)["q"] == pytest.approx(half, rel=1e-12)
    for closed in (0.0, -0.1):
        assert whole.equations(p_a=3 * BAR, p_b=1 * BAR, opening=closed, fluid=PUMP_OIL)["q"] == 0.0
    row = VariableOrifice(area="4 mm2", count=3)
    q = row.equations(p_a=3e5 * np.ones(3), p_b=1e5 * np.ones(3), opening=np.array([0, 0.5, 1]), fluid=PUMP_OIL)["q"]
    assert q[:2] == pytest.approx([0.0, half], rel=1e-12)


@pytest.mark.parametrize("part", [Orifice(area="1 mm2", count=4), LaminarGap(width=1, height=1, length=1, count=4)])
def test_count_makes_vectors(part):
    """With a count each port is a vector; without, a scalar."""
    assert [part.size_of(port.size) for port in part.ports()] == [4, 4]
    assert type(part).model_construct(count=None).size_of(part.ports()[0].size) is None
    assert part.equations(p_a=np.arange(4.0), p_b=np.zeros(4), fluid=STIFF)["q"].shape == (4,)


def test_throttle_is_an_orifice_and_may_be_closed():
    """Same law; area 0 lets nothing pass."""
    p = {"p_a": 5 * BAR, "p_b": 0.0, "fluid": PUMP_OIL}
    assert Throttle(area="3 mm2").equations(**p)["q"] == Orifice(area="3 mm2").equations(**p)["q"]
    assert Throttle(area="0 mm2").equations(**p)["q"] == 0.0


def test_parallel_multiplies_flow():
    """Five equal parts side by side pass five times the flow."""
    p = {"p_a": 5 * BAR, "p_b": 0.0, "fluid": PUMP_OIL}
    for cls, size in [
        (Orifice, {"area": 1e-6}),
        (LaminarGap, {"width": 1e-2, "height": 1e-4, "length": 1e-2}),
        (AnnularGap, {"diameter": 1e-2, "clearance": 1e-4, "length": 1e-2}),
    ]:
        one, five = (cls(**size, parallel=n).equations(**p)["q"] for n in (1, 5))
        assert five == pytest.approx(5 * one, rel=1e-14)


# -- gaps --------------------------------------------------------------------------------------------


def test_laminar_gap():
    """b h^3 dp/(12 mu l): 10 mm, 0.1 mm, 20 mm, 10 bar, 30.1 mPa s: 0.0830565 L/min."""
    q = LaminarGap(width="10 mm", height="0.1 mm", length="20 mm").equations(p_a=10 * BAR, p_b=0.0, fluid=STIFF)["q"]
    assert q == pytest.approx(0.01 * 1e-12 * 1e6 / (12 * 0.0301 * 0.02), rel=1e-8)
    assert q / LPM == pytest.approx(0.0830565, rel=1e-5)


def test_variable_height_gap_closes():
    """Height plus factor times change: 20 um + 0.5 * 60 um is 50 um; below zero it is closed."""
    gap = VariableHeightGap(width="10 mm", height="20 um", length="20 mm", change_factor=0.5)
    p = {"p_a": 10 * BAR, "p_b": 0.0, "fluid": STIFF}
    q = gap.equations(change=60e-6, **p)["q"]
    assert q == pytest.approx(0.01 * 50e-6**3 * 1e6 / (12 * 0.0301 * 0.02), rel=1e-8)
    assert gap.equations(change=-60e-6, **p)["q"] == 0.0


def test_variable_width_gap():
    """A quarter of the width passes a quarter of the flow."""
    gap = VariableWidthGap(width="10 mm", height="20 um", length="20 mm")
    p = {"p_a": 10 * BAR, "p_b": 0.0, "fluid": STIFF}
    assert gap.equations(opening=0.25, **p)["q"] == pytest.approx(gap.equations(opening=1.0, **p)["q"] / 4, rel=1e-14)


@pytest.mark.parametrize(("eccentricity", "more"), [(0.0, 1.0), (0.5, 1.375), (1.0, 2.5)])
def test_annular_gap(eccentricity, more):
    """pi d c^3 dp/(12 mu l) concentric, radial clearance; 2.5 times as much when the shaft touches."""
    gap = AnnularGap(diameter="20 mm", clearance="10 um", length="15 mm", eccentricity=eccentricity)
    q = gap.equations(p_a=100 * BAR, p_b=0.0, fluid=STIFF)["q"]
    assert q == pytest.approx(more * math.pi * 0.02 * 1e-15 * 1e7 / (12 * 0.0301 * 0.015), rel=1e-7)


def test_drag_flow():
    """Second term of Eq. 24: h H R omega/2 at 2000 rpm for 0.15 mm, 13 mm, 29.1 mm: 0.35654 L/min.

    As mass flow over rho_0 it is 1 + 200/14000 times that, to second order, between 150 and 250 bar.
    """
    omega = 2000 * 2 * math.pi / 60
    q = flow_laws.drag_flow(0.0, 0.0, 29.1e-3 * omega, 13e-3, 0.15e-3, OIL)
    assert q / LPM == pytest.approx(0.35654, abs=1e-5)
    carried = flow_laws.drag_flow(150 * BAR, 250 * BAR, 29.1e-3 * omega, 13e-3, 0.15e-3, OIL)
    assert carried / q == pytest.approx(1 + 200 / 14000, abs=(200 / 14000) ** 2)


# -- friction in pipes -------------------------------------------------------------------------------


@pytest.mark.parametrize("re", [1e-6, 1.0, 100.0, 1000.0])
def test_laminar_friction_factor(re):
    """Hagen-Poiseuille, f Re = 64; Churchill's blending is within 1e-6 of it below Re = 1000."""
    assert flow_laws.friction_times_reynolds(re, 0.0) == pytest.approx(64.0, rel=1e-6)


@pytest.mark.parametrize("re", [1e4, 1e5, 1e6, 1e7])
@pytest.mark.parametrize("roughness", [0.0, 1e-4, 1e-3, 1e-2])
def test_turbulent_friction_factor(re, roughness):
    """Colebrook-White; Churchill (1977) is known to stay within a few percent of it, here 4 %."""

    def colebrook(f: float) -> float:
        return 1 / math.sqrt(f) + 2 * math.log10(roughness / 3.7 + 2.51 / (re * math.sqrt(f)))

    f = brentq(colebrook, 1e-3, 1.0)
    assert flow_laws.friction_times_reynolds(re, roughness) / re == pytest.approx(f, rel=0.04)


def test_friction_is_churchill_as_printed():
    """f = 8 [(8/Re)^12 + (A + B)^-1.5]^(1/12) written out, laminar to turbulent, to rounding."""
    for re in [10.0, 500.0, 2000.0, 2500.0, 4000.0, 1e5]:
        a = (2.457 * math.log(1 / ((7 / re) ** 0.9 + 0.27 * 1e-3))) ** 16
        b = (37530 / re) ** 16
        f = 8 * ((8 / re) ** 12 + 1 / (a + b) ** 1.5) ** (1 / 12)
        assert flow_laws.friction_times_reynolds(re, 1e-3) / re == pytest.approx(f, rel=1e-12)


def test_pipe_friction_drop_rises_with_flow_and_is_odd():
    """Through zero, transition and up to absurd trial flows: finite, odd, rising."""
    q = np.concatenate([np.linspace(0, 1e-3, 2001), np.logspace(-2.9, 3, 100)])
    drop = flow_laws.pipe_friction_drop(q, 1.0, 12e-3, 0.0, PUMP_OIL, 5 * BAR, 0.5)
    assert drop[0] == 0.0
    assert np.all(np.isfinite(drop))
    assert np.all(np.diff(drop) > 0)
    back = flow_laws.pipe_friction_drop(-q, 1.0, 12e-3, 0.0, PUMP_OIL, 5 * BAR, 0.5)
    assert back == pytest.approx(-drop, rel=1e-14)


def test_pipe_friction_drop_by_hand():
    """10 L/min in 12 mm: Re = 505, laminar: 128 mu l q/(pi d^4) + K rho v^2/2 = 9857.1 + 466.9 Pa for l = 1 m."""
    drop = flow_laws.pipe_friction_drop(10 * LPM, 1.0, 12e-3, 0.0, STIFF, 0.0, 0.5)
    laminar = 128 * 0.0301 * 1.0 * 10 * LPM / (math.pi * 12e-3**4)
    v = 10 * LPM / (math.pi / 4 * 12e-3**2)
    assert drop == pytest.approx(laminar + 0.5 * RHO * v * v / 2, rel=1e-6)
    assert drop == pytest.approx(9857.1 + 466.9, abs=0.1)


def test_pipe_friction_jacobian_is_finite_at_rest():
    """Slope at zero flow is the laminar 128 mu l/(pi d^4)."""
    q = ca.SX.sym("q")
    drop = flow_laws.pipe_friction_drop(Sym(q), 1.0, 12e-3, 1e-5, STIFF, 0.0, 1.5)
    slope = float(ca.Function("slope", [q], [ca.jacobian(drop.sx, q)])(0.0))
    assert slope == pytest.approx(128 * 0.0301 / (math.pi * 12e-3**4), rel=1e-9)


# -- volumes -----------------------------------------------------------------------------------------


def test_capacity_pressure_rate():
    """dp/dt = beta q/V at 0 bar: 30 L/min into 70 cm^3 of 14 000 bar oil: 100 bar/ms."""
    found = Capacity(volume="70 cm3").equations(p=0.0, q_port=30 * LPM, fluid=OIL)
    assert found["der_p"] == pytest.approx(1.4e9 * 5e-4 / 70e-6, rel=1e-12)
    assert found["p_port"] == 0.0
    assert found["content"] == pytest.approx(70e-6, rel=1e-12)


@pytest.mark.parametrize("p", [-0.9 * BAR, 0.0, 2.0 * BAR, 5.0 * BAR, 40 * BAR])
@pytest.mark.parametrize(
    "volume", [Capacity(volume="20 cm3"), VariableCapacity(), CompliantCapacity(wall_area="6 cm2", deflection=COVER)]
)
def test_content_takes_up_exactly_what_flows_in(volume, p):
    """d(content)/dt = sum q, by central differences of the content; 1e-5 for the differences."""
    V, dV, q = 20e-6, 0.0 if isinstance(volume, Capacity) else -3e-4, 2e-4

    def evaluate(p: float, V: float) -> dict[str, float]:
        chamber = {} if isinstance(volume, Capacity) else {"V_chamber": V, "dV_chamber": dV}
        return volume.equations(p=p, q_port=q, fluid=PUMP_OIL, **chamber)

    dp = evaluate(p, V)["der_p"]
    h = 1.0 / abs(dp)  # the time in which the pressure moves by 1 Pa
    after, before = (evaluate(p + sign * h * dp, V + sign * h * dV)["content"] for sign in (1, -1))
    assert (after - before) / (2 * h) == pytest.approx(q, rel=1e-5)


def test_variable_capacity_at_rest_when_flow_makes_room():
    """q = rho/rho_0 dV/dt, the mass displaced by a shrinking volume, keeps the pressure."""
    dV = -3e-4
    q = PUMP_OIL.density(5 * BAR) / PUMP_OIL.rho_0 * dV
    found = VariableCapacity().equations(p=5 * BAR, q_port=q, V_chamber=2e-5, dV_chamber=dV, fluid=PUMP_OIL)
    assert abs(found["der_p"]) < 1e-3
    assert found["p_chamber"] == found["p_port"] == 5 * BAR


def test_compliant_capacity_by_hand():
    """(q - dV)/(V/beta + A h') with the pump's cover between 0 and 3 bar, h' = 16 um/3 bar; wall volume 5.3 mm^3."""
    part = CompliantCapacity(wall_area="6 cm2", deflection=COVER)
    found = part.equations(p=1 * BAR, q_port=1e-4, V_chamber=2e-5, dV_chamber=-2e-4, fluid=STIFF)
    assert found["der_p"] == pytest.approx(3e-4 / ((2e-5 + 3.2e-9) / 1e15 + 6e-4 * 16e-6 / 3e5), rel=1e-9)
    assert found["content"] == pytest.approx(2e-5 + 6e-4 * 16e-6 / 3, rel=1e-9)


def test_wall_volume_hardly_changes_the_rate():
    """Counting the oil behind the wall as compressed, against (q rho_0/rho - dV)/(V/beta + C): 0.1 % at 6 bar."""
    part = CompliantCapacity(wall_area="6 cm2", deflection=COVER)
    found = part.equations(p=5.9 * BAR, q_port=1e-4, V_chamber=2e-5, dV_chamber=0.0, fluid=PUMP_OIL)["der_p"]
    swell = PUMP_OIL.rho_0 / PUMP_OIL.density(5.9 * BAR)
    bare = swell * 1e-4 / (2e-5 / PUMP_OIL.bulk_modulus(5.9 * BAR) + 6e-4 * 24e-6 / 3e5)
    assert found == pytest.approx(bare, rel=1e-3)
    assert found != bare


def test_volume_empties_through_a_gap():
    """RC decay: p = p_0 exp(-t/tau), tau = V/(beta G), G = b h^3/(12 mu l); oil compressing by 7e-6 at 0.1 bar."""
    volume, gap = Capacity(volume="50 cm3"), LaminarGap(width="10 mm", height="0.1 mm", length="20 mm")

    def rate(t: float, x: np.ndarray) -> list[float]:
        q = gap.equations(p_a=x[0], p_b=0.0, fluid=OIL)["q_a"]
        return [volume.equations(p=x[0], q_port=-q, fluid=OIL)["der_p"]]

    tau = 50e-6 / (1.4e9 * 0.01 * 1e-12 / (12 * 0.0301 * 0.02))
    run = solve_ivp(rate, (0, 2 * tau), [1e4], rtol=1e-9, atol=1e-6)
    assert run.y[0, -1] == pytest.approx(1e4 * math.exp(-2), rel=2e-5)


# -- boundaries and shafts ---------------------------------------------------------------------------


def test_boundaries():
    """Sources give what they hold; a flow source's flow is positive out of it."""
    assert Tank().equations()["p_port"] == 0.0
    assert Tank(pressure="0.5 bar").equations()["p_port"] == 0.5 * BAR
    assert PressureSource(pressure="7 bar").equations()["p_port"] == 7 * BAR
    assert SignalPressureSource().equations(pressure=3 * BAR)["p_port"] == 3 * BAR
    assert FlowSource(flow="6 L/min").equations()["q_port"] == pytest.approx(-1e-4)
    assert SignalFlowSource().equations(flow=2e-4)["q_port"] == -2e-4
    assert Plug().equations()["q_port"] == 0.0


def test_speed_sources():
    """2000 rpm is 209.44 rad/s; against -5 N m of load the source gives 1047.2 W."""
    source = SpeedSource(speed="2000 rpm", start_angle="90 deg")
    found = source.equations(phi=0.3, torque_shaft=-5.0)
    assert found["omega_shaft"] == found["der_phi"] == pytest.approx(209.4395, abs=1e-4)
    assert found["phi_shaft"] == 0.3
    assert found["torque"] == 5.0
    assert found["power"] == pytest.approx(1047.198, abs=1e-3)
    [phi] = SpeedSource.declared(type(SpeedSource.phi))
    assert source.start_of(phi) == pytest.approx([math.pi / 2])
    driven = SignalSpeedSource().equations(phi=0.3, speed=209.4395, torque_shaft=-5.0)
    assert driven == pytest.approx(found, rel=1e-6)


# -- sensors -----------------------------------------------------------------------------------------


def test_sensors():
    """Each hands on what it reads; the flow sensor passes pressure one way and flow the other."""
    assert PressureSensor().equations(p_port=3e5) == {"y": 3e5}
    assert DifferentialPressureSensor().equations(p_a=3e5, p_b=1e5) == {"y": 2e5}
    assert SpeedSensor().equations(omega_shaft=20.0) == {"y": 20.0}
    assert AngleSensor().equations(phi_shaft=7.0) == {"y": 7.0}
    assert PositionSensor().equations(x_port=1e-3) == {"y": 1e-3}
    assert VelocitySensor().equations(v_port=0.2) == {"y": 0.2}
    assert FlowSensor().equations(p_a=3e5, q_b=-1e-4) == {"p_b": 3e5, "q_a": 1e-4, "y": 1e-4}
