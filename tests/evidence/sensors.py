"""Sensors, each in a run whose variables are known by hand."""

from __future__ import annotations

import math

from building import OIL, circuit

from evidence import Number, evidence

BAR, LPM = 1e5, 1e-3 / 60


@evidence(
    "pressure_sensor",
    "differential_pressure_sensor",
    "flow_sensor",
    "hydraulic_power_meter",
    "volume_counter",
    "energy_counter",
    source="boundary conditions; P = p Q with Q = q rho_0/rho(p) = q exp(-p/beta); volume and energy are q t and P t",
    tolerance=1e-9,
    because="constant rates are integrated exactly, to rounding",
)
def hydraulic() -> list[Number]:
    """6 L/min drawn for 2 s from a source at 100 bar, beside one at 20 bar."""
    result = circuit(
        components={
            "high": {"type": "pressure_source", "pressure": "100 bar"},
            "low": {"type": "pressure_source", "pressure": "20 bar"},
            "gauge": {"type": "pressure_sensor"}, "difference": {"type": "differential_pressure_sensor"},
            "flow": {"type": "flow_sensor"}, "power": {"type": "hydraulic_power_meter"},
            "volume": {"type": "volume_counter"}, "energy": {"type": "energy_counter"},
            "drawn": {"type": "flow_source", "flow": "-6 L/min"},
        },
        nets={
            "p": ["high.port", "gauge.port", "difference.a", "flow.a"], "p_low": ["low.port", "difference.b"],
            "behind": ["flow.b", "power.a"], "further": ["power.b", "volume.a"], "end": ["volume.b", "drawn.port"],
            "read": ["gauge.y"], "dp": ["difference.y"], "q": ["flow.y"], "P": ["power.y", "energy.power"],
            "V": ["volume.y"], "E": ["energy.y"],
        },
        fluid=OIL, simulation={"stop": "2 s"},
    ).simulate()  # fmt: skip
    power = 100 * BAR * 6 * LPM * math.exp(-100 / 14000)
    return [
        Number("pressure", 100 * BAR, float(result["gauge.y"][-1]), "bar"),
        Number("difference", 80 * BAR, float(result["difference.y"][-1]), "bar"),
        Number("flow", 6 * LPM, float(result["flow.y"][-1]), "L/min"),
        Number("power", power, float(result["power.y"][-1]), "kW"),
        Number("volume", 0.2e-3, float(result["volume.y"][-1]), "L"),
        Number("energy", 2 * power, float(result["energy.y"][-1]), "kJ"),
        Number("pressure behind three of them", 100 * BAR, float(result["drawn.port.p"][-1]), "bar"),
    ]


@evidence(
    "position_sensor",
    "velocity_sensor",
    "force_sensor",
    "linear_power_meter",
    source="Newton's second law, Hooke's law, P = F v, by hand",
    tolerance=1e-9,
    because="rounding of double precision",
)
def linear() -> list[Number]:
    """A spring of 1 N/mm pushed from 0 by a drive of 20 mm/s: 2 s later 40 mm, 40 N, 0.8 W."""
    result = circuit(
        components={
            "drive": {"type": "motion_source", "velocity": "20 mm/s"},
            "spring": {"type": "spring", "stiffness": "1 N/mm"},
            "x": {"type": "position_sensor"}, "v": {"type": "velocity_sensor"}, "f": {"type": "force_sensor"},
            "power": {"type": "linear_power_meter"},
        },
        nets={
            "rod": ["drive.port", "x.port", "v.port", "f.a"], "behind": ["f.b", "power.a"],
            "end": ["power.b", "spring.rod"],
            "read_x": ["x.y"], "read_v": ["v.y"], "read_f": ["f.y"], "read_p": ["power.y"],
        },
        simulation={"stop": "2 s"},
    ).simulate()  # fmt: skip
    return [
        Number("position", 0.04, float(result["x.y"][-1]), "mm"),
        Number("velocity", 0.02, float(result["v.y"][-1]), "mm/s"),
        Number("force of the drive on the spring", 40.0, float(result["f.y"][-1]), "N"),
        Number("power of the drive", 0.8, float(result["power.y"][-1]), "W"),
    ]


@evidence(
    "speed_sensor",
    "angle_sensor",
    "torque_sensor",
    "shaft_power_meter",
    source="viscous damping T = B omega, P = T omega, by hand",
    tolerance=1e-9,
    because="a constant speed is integrated exactly, to rounding",
)
def rotary() -> list[Number]:
    """A damper of 0.1 N m s/rad turned at 100 rad/s: 10 N m, 1 kW, 200 rad after 2 s."""
    result = circuit(
        components={
            "drive": {"type": "speed_source", "speed": "100 rad/s"},
            "damper": {"type": "rotary_damper", "coefficient": "0.1 N m s/rad"},
            "speed": {"type": "speed_sensor"}, "angle": {"type": "angle_sensor"}, "torque": {"type": "torque_sensor"},
            "power": {"type": "shaft_power_meter"},
        },
        nets={
            "shaft": ["drive.shaft", "speed.shaft", "angle.shaft", "torque.a"], "behind": ["torque.b", "power.a"],
            "end": ["power.b", "damper.shaft"], "read_n": ["speed.y"], "read_phi": ["angle.y"], "read_t": ["torque.y"],
            "read_p": ["power.y"],
        },
        simulation={"stop": "2 s"},
    ).simulate()  # fmt: skip
    return [
        Number("speed", 100.0, float(result["speed.y"][-1]), "rad/s"),
        Number("angle", 200.0, float(result["angle.y"][-1]), "rad"),
        Number("torque of the drive on the damper", 10.0, float(result["torque.y"][-1]), "Nm"),
        Number("power of the drive", 1000.0, float(result["power.y"][-1]), "kW"),
    ]
