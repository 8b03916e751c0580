"""Sensors and meters: they disturb nothing, count both ways, and add up to what is stored."""

from __future__ import annotations

import numpy as np
import pytest
from building import OIL, circuit
from crescentlab.components.fluids import SimpleOil
from crescentlab.components.meters import HydraulicPowerMeter, LinearPowerMeter, ShaftPowerMeter, VolumeCounter
from crescentlab.components.sensors import ForceSensor, TorqueSensor

from crescentlab.errors import InputError
from crescentlab.result import Result

BAR, LPM = 1e5, 1e-3 / 60
STIFF = SimpleOil(density=860.0, kinematic_viscosity=35e-6, bulk_modulus=1e15)

SWING = {
    "mass": {
        "type": "mass_with_stops",
        "mass": "2 kg",
        "low": "-1 m",
        "high": "1 m",
        "start": {"x": "10 mm", "at": "0"},
    },
    "spring": {"type": "spring", "stiffness": "5 N/mm"},
}


def swing(*between: str) -> Result:
    """A mass on a spring, with sensors in series between the two, and the energy that passes the last."""
    chain = dict(zip(("first", "second"), between, strict=False))
    ports = ["mass.port", *[port for name in chain for port in (f"{name}.a", f"{name}.b")], "spring.rod"]
    nets = {f"n{k}": ports[2 * k : 2 * k + 2] for k in range(len(ports) // 2)}
    nets |= {f"read_{name}": [f"{name}.y"] for name in chain}
    parts = {**SWING, **{name: {"type": kind} for name, kind in chain.items()}}
    if between and between[-1].endswith("power_meter"):
        last = list(chain)[-1]
        parts["energy"] = {"type": "energy_counter"}
        nets |= {f"read_{last}": [f"{last}.y", "energy.power"], "joules": ["energy.y"]}
    simulation = {"stop": "0.5 s", "rtol": "1e-9", "output_step": "10 ms"}
    return circuit(components=parts, nets=nets, simulation=simulation).simulate()


def test_sensors_in_series_disturb_nothing():
    """The same states at every row with two sensors, with one, and without."""
    free, one, two = swing(), swing("force_sensor"), swing("force_sensor", "linear_power_meter")
    for other in (one, two):
        at = np.isin(free.time, other.time)
        assert np.count_nonzero(at) > 50
        found = other["mass.x"][np.isin(other.time, free.time)]
        assert found == pytest.approx(free["mass.x"][at], abs=1e-9)


def test_energy_is_what_the_spring_gives_back():
    """The integral of force times velocity from the mass into the spring is the change of k x^2/2."""
    result = swing("force_sensor", "linear_power_meter")
    x = result["mass.x"]
    assert np.ptp(x) > 0.019
    assert result["energy.y"] == pytest.approx(5000 / 2 * (x**2 - 0.01**2), abs=1e-7)
    assert result["first.y"] == pytest.approx(5000 * x, abs=1e-6)


@pytest.mark.parametrize("sign", [1, -1])
def test_directions(sign):
    """From a to b is positive, and turns round with the motion, the torque or the flow."""
    force = ForceSensor().equations(x_a=0.1, v_a=0.2, f_b=-3.0 * sign)
    assert (force["y"], force["f_a"], force["x_b"], force["v_b"]) == (3.0 * sign, 3.0 * sign, 0.1, 0.2)
    torque = TorqueSensor().equations(phi_a=0.1, omega_a=5.0, torque_b=-3.0 * sign)
    assert (torque["y"], torque["torque_a"], torque["phi_b"], torque["omega_b"]) == (3.0 * sign, 3.0 * sign, 0.1, 5.0)
    assert LinearPowerMeter().equations(x_a=0.0, v_a=2.0, f_b=-3.0 * sign)["y"] == 6.0 * sign
    assert ShaftPowerMeter().equations(phi_a=0.0, omega_a=2.0, torque_b=-3.0 * sign)["y"] == 6.0 * sign
    power = HydraulicPowerMeter().equations(p_a=100 * BAR, q_b=-6 * LPM * sign, fluid=STIFF)
    assert power["y"] == pytest.approx(1000.0 * sign)
    assert power["q_a"] == 6 * LPM * sign
    assert VolumeCounter().equations(p_a=1e5, q_b=-6 * LPM * sign, volume=0.0)["der_volume"] == 6 * LPM * sign


def test_the_volume_that_passed_is_what_the_capacity_stored():
    """Counted before a capacity that is filled through an orifice: its content less that at the start."""
    result = circuit(
        components={
            "source": {"type": "pressure_source", "pressure": "200 bar"}, "hole": {"type": "orifice", "area": "1 mm^2"},
            "counter": {"type": "volume_counter"}, "volume": {"type": "capacity", "volume": "1 L"},
        },
        nets={
            "high": ["source.port", "hole.a"], "before": ["counter.b", "hole.b"], "low": ["volume.port", "counter.a"],
            "passed": ["counter.y"],
        },
        fluid=OIL, simulation={"stop": "0.2 s", "rtol": "1e-9"},
    ).simulate()  # fmt: skip
    stored = result["volume.content"] - result["volume.content"][0]
    assert stored[-1] > 5e-6
    assert -result["counter.y"] == pytest.approx(stored, abs=1e-12)  # from b to a, so it counts backwards


def test_counters_need_not_rest():
    """A periodic or steady run does not wait for a volume or an energy to repeat itself."""
    made = circuit(
        components={
            "source": {"type": "pressure_source", "pressure": "10 bar"}, "counter": {"type": "volume_counter"},
            "power": {"type": "hydraulic_power_meter"}, "energy": {"type": "energy_counter"},
            "hole": {"type": "orifice", "area": "1 mm^2"}, "tank": {"type": "tank"},
        },
        nets={
            "p": ["source.port", "counter.a"], "behind": ["counter.b", "power.a"], "end": ["power.b", "hole.a"],
            "low": ["hole.b", "tank.port"], "watts": ["power.y", "energy.power"],
        },
        fluid=OIL, simulation={"stop": "1 s"},
    )  # fmt: skip
    system = made.simulate().system
    assert system.counting_states.tolist() == [True, True]


def test_a_force_sensor_between_two_masses_is_refused():
    """Both masses give their motion, so nothing is left for the force; the message names the net."""
    with pytest.raises(InputError, match="net behind"):
        circuit(
            components={
                "one": {"type": "mass_with_stops", "mass": "1 kg", "high": "1 m"},
                "two": {"type": "mass_with_stops", "mass": "1 kg", "high": "1 m"},
                "force": {"type": "force_sensor"},
            },
            nets={"front": ["one.port", "force.a"], "behind": ["force.b", "two.port"], "f": ["force.y"]},
            simulation={"stop": "1 s"},
        ).simulate()
