"""The same circuit with other tooth numbers and crescents: displacement in closed form, closings per revolution."""

from __future__ import annotations

import functools
import math

import pytest

import crescentlab as cl
from crescentlab.result import Result

MM, DEG = 1e-3, math.pi / 180
RPM, TURNS = 3000, 2
TEETH = [(12, 15), (13, 16), (14, 17)]
CRESCENTS = [34, 40, 46, 52]


@functools.cache
def circuit() -> cl.Circuit:
    """The shipped circuit."""
    return cl.load("crescent_pump")


@functools.cache
def run(z_1: int, z_2: int, extension: int) -> Result:
    """Two revolutions from the start the circuit works out itself; the throttle suits each displacement."""
    given = {"speed": f"{RPM} rpm", "driver_teeth": str(z_1), "driven_teeth": str(z_2), "throttle_area": "40 mm^2"}
    given["crescent_extension"] = f"{extension} deg"
    return circuit().simulate(f"{TURNS * 60 / RPM} s", given, solver="rk45", rtol=1e-4, compile=False)


def displacement(z_1: int, z_2: int) -> float:
    """Volume displaced to delivery per revolution [m^3]: Eq. 3 of Rundo & Corvaglia integrated over a pitch, z_1 times.

    With u = nu_d + nu_01 the rays are rho_i^2 = rho_1^2 (1 + u^2), rho_o^2 = rho_2^2 (1 + (tau u + (1 - tau) tan
    theta)^2), whose integrals are polynomials of third degree.
    """
    m, theta_0, e, H = 4 * MM, 32 * DEG, 6 * MM, 13 * MM
    R_t1, R_t2 = m * z_1 / 2 + 3.1 * MM, m * z_2 / 2 - 3.4 * MM
    rho_1, rho_2 = m * z_1 / 2 * math.cos(theta_0), m * z_2 / 2 * math.cos(theta_0)
    tau = z_1 / z_2
    offset = (1 - tau) * math.tan(math.acos((rho_2 - rho_1) / e))
    nu_01 = (math.sqrt(R_t2**2 - rho_2**2) - rho_2 * offset) / rho_1  # Eqs. 7 and 8

    def primitive(u: float) -> float:
        driver = rho_1**2 * (u + u**3 / 3) - R_t1**2 * u
        driven = R_t2**2 * u - rho_2**2 * (u + (tau * u + offset) ** 3 / (3 * tau))
        return H / 2 * (driver + tau * driven)

    return -z_1 * (primitive(nu_01 + 2 * math.pi / z_1) - primitive(nu_01))


def test_closed_form_of_table_3():
    """13 and 16 teeth: 13.65 cc/rev printed, 0.7 % for the rounding of the radii."""
    assert displacement(13, 16) == pytest.approx(13.65e-6, rel=7e-3)


@pytest.mark.parametrize("extension", CRESCENTS)
@pytest.mark.parametrize(("z_1", "z_2"), TEETH)
def test_displacement(z_1, z_2, extension):
    """Closed form: 1e-6 as the gears state it, 1e-3 as the rates of the run sum up; whatever the crescent."""
    result = run(z_1, z_2, extension)
    assert result["gears.displacement"][-1] * 2 * math.pi == pytest.approx(displacement(z_1, z_2), rel=1e-6)
    assert -result.mean("gears.dVd") * 2 * math.pi == pytest.approx(displacement(z_1, z_2), rel=1e-3)


@pytest.mark.parametrize("extension", CRESCENTS)
@pytest.mark.parametrize(("z_1", "z_2"), TEETH)
@pytest.mark.parametrize("event", ["gears.meshes", "driver.closes", "driven.closes", "trapped.appears"])
def test_events_per_revolution(event, z_1, z_2, extension):
    """As many of each as the driver has teeth; the driven gear's z_2 pass in z_2/z_1 revolutions. At most one at an end
    of the run belongs to either side."""
    found = sum(event in h.names for h in run(z_1, z_2, extension).trajectory.happenings)
    assert found == pytest.approx(TURNS * z_1, abs=1)


@pytest.mark.parametrize("extension", CRESCENTS)
@pytest.mark.parametrize(("z_1", "z_2"), TEETH)
def test_number_of_closed_volumes(z_1, z_2, extension):
    """Whole part of contacts, extension over pitch; the driven gear's extension is wider by z_2/z_1."""
    result = run(z_1, z_2, extension)
    for name, contacts in (("driver", extension * z_1 / 360), ("driven", extension * z_2 / z_1 * z_2 / 360)):
        assert result[f"{name}.p"].size == int(contacts) * result.time.size
