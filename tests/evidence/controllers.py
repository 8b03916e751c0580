"""Controllers."""

from __future__ import annotations

import math

import numpy as np
from building import circuit
from crescentlab.components.controllers import PID
from reading import rows

from evidence import Number, evidence

PLANT = {"type": "first_order_lag", "time_constant": "1 s"}
NETS = {
    "asked": ["step.y", "control.setpoint"],
    "driven": ["control.output", "plant.u"],
    "found": ["plant.y", "control.measured"],
}


@evidence(
    "pid",
    source="closed loop of PI without setpoint weight and 1/(s + 1): omega^2/(s^2 + 2 zeta omega s + omega^2) with "
    "omega^2 = K/T_i, 2 zeta omega = 1 + K; overshoot and integral of e^2, (1 + 4 zeta^2)/(4 zeta omega), K. Ogata "
    "(2010), section 5-3",
    tolerance=1e-6,
    because="relative tolerance 1e-9; after 10 s the rest of the square error is exp(-20)",
)
def closed_loop() -> list[Number]:
    """K = 1.4 and T_i = 0.35 s give omega = 2 rad/s and zeta = 0.6."""
    control = {"type": "pid", "gain": "1.4", "integral_time": "0.35 s", "setpoint_weight": "0"}
    omega, zeta = 2.0, 0.6
    peak = math.pi / (omega * math.sqrt(1 - zeta**2))
    result = circuit(
        components={
            "step": {"type": "step", "after": "1"}, "control": control, "plant": PLANT,
            "error": {"type": "expression", "formula": "(u1 - u2)**2", "inputs": ["ratio", "ratio"]},
            "total": {"type": "integrator"},
        },
        nets={
            "asked": ["step.y", "control.setpoint", "error.u1"], "driven": NETS["driven"],
            "found": ["plant.y", "control.measured", "error.u2"], "square": ["error.y", "total.u"], "ise": ["total.y"],
        },
        simulation={"stop": f"{5 * peak!r} s", "rtol": "1e-9", "output_step": f"{peak!r} s"},
    ).simulate()  # fmt: skip
    overshoot = float(rows(result, "plant.y", [peak])[0]) - 1
    return [
        Number("overshoot", math.exp(-math.pi * zeta / math.sqrt(1 - zeta**2)), overshoot),
        Number(
            "integral of the square error", (1 + 4 * zeta**2) / (4 * zeta * omega), float(result["total.y"][-1]), "s"
        ),
    ]


@evidence(
    "pid",
    source="back-calculation at rest: v - u = K e T_t/T_i; filtered derivative of a ramp: "
    "-K T_d dy/dt (1 - exp(-N t/T_d)); Astrom & Hagglund (1995), sections 3.4 and 3.5",
    tolerance=1e-6,
    because="relative tolerance 1e-9; after 20 tracking times the rest is exp(-20)",
)
def windup_and_derivative() -> list[Number]:
    """An error of 2 that no output removes, limited to 1: the integral part stops; the derivative of a ramp."""
    held = circuit(
        components={
            "step": {"type": "step", "after": "2"}, "zero": {"type": "constant", "value": "0"},
            "control": {"type": "pid", "gain": "3", "integral_time": "2 s", "tracking_time": "0.5 s", "high": "1"},
        },
        nets={"r": ["step.y", "control.setpoint"], "y": ["zero.y", "control.measured"], "u": ["control.output"]},
        simulation={"stop": "10 s", "rtol": "1e-9"},
    ).simulate()  # fmt: skip
    ramp = circuit(
        components={
            "zero": {"type": "constant", "value": "0"}, "ramp": {"type": "ramp", "after": "2", "duration": "1 s"},
            "control": {"type": "pid", "gain": "3", "derivative_time": "0.4 s", "derivative_filter": "5"},
        },
        nets={"r": ["zero.y", "control.setpoint"], "y": ["ramp.y", "control.measured"], "u": ["control.output"]},
        simulation={"stop": "0.1 s", "rtol": "1e-9"},
    ).simulate()  # fmt: skip
    derivative = -3 * 0.4 * 2 * (1 - math.exp(-5 * 0.1 / 0.4))
    return [
        Number("output", 1.0, float(held["control.output"][-1])),
        Number("output before the limit", 1 + 3 * 2 * 0.5 / 2, float(held["control.unlimited"][-1])),
        Number("of the ramp after 0.1 s", -3 * 0.2 + derivative, float(ramp["control.output"][-1])),
        Number(
            "tracking time by default",
            math.sqrt(0.2),
            PID(gain=1.0, integral_time=0.5, derivative_time=0.4).tracking,
            "s",
        ),
    ]


def recursion(samples: int, h: float) -> list[float]:
    """PID, limited, and 1/(s + 1) under a held input, by the difference equations: y at each sample."""
    K, Ti, Td, N, Tt, b, low, high = 4.0, 0.8, 0.1, 8.0, math.sqrt(0.8 * 0.1), 0.7, -1.5, 1.5
    y = y_old = integral = derivative = 0.0
    found = []
    for _ in range(samples):
        found.append(y)
        derivative = Td / (Td + N * h) * (derivative - K * N * (y - y_old))
        v = K * (b * 1.0 - y) + integral + derivative
        u = min(max(v, low), high)
        integral += K * h / Ti * (1.0 - y) + h / Tt * (u - v)
        y_old = y
        y = math.exp(-h) * y + (1 - math.exp(-h)) * u
    return found


@evidence(
    "sampled_pid",
    source="difference equations of Astrom & Hagglund (1995), section 3.6, the plant sampled exactly, in plain Python",
    tolerance=1e-7,
    because="relative tolerance 1e-10 between samples",
)
def sampled() -> list[Number]:
    """A limited PID every 50 ms around 1/(s + 1), a step of the setpoint: the plant at its samples."""
    control = {
        "type": "sampled_pid", "gain": "4", "integral_time": "0.8 s", "derivative_time": "0.1 s",
        "setpoint_weight": "0.7", "derivative_filter": "8", "low": "-1.5", "high": "1.5", "sample_time": "50 ms",
    }  # fmt: skip
    result = circuit(
        components={"step": {"type": "step", "after": "1"}, "control": control, "plant": PLANT},
        nets=NETS,
        simulation={"stop": "2 s", "rtol": "1e-10", "output_step": "50 ms"},
    ).simulate()
    expected = recursion(41, 0.05)
    found = rows(result, "plant.y", np.arange(41) * 0.05)
    return [Number(f"sample {k}", expected[k], float(found[k]), size=1.0) for k in (1, 2, 5, 10, 20, 40)]
