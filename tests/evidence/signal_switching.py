"""Relay, switch, rate limiter, quantizer."""

from __future__ import annotations

import math
from typing import Any

from building import circuit, fired

from crescentlab.analysis.outcome import Outcome, Window
from evidence import Number, evidence

SINE = {"type": "sine", "amplitude": "1", "frequency": "1 Hz"}


@evidence(
    "relay",
    source="first-order lag between two levels: T ln((K - low)/(K - high)) up, T ln(high/low) down; K. J. Astrom, "
    "T. Hagglund, PID Controllers (2nd ed. 1995), on-off control",
    tolerance=1e-6,
    because="relative tolerance of the run, 1e-9; events are found to 1e-9 of the span",
)
def two_levels() -> list[Number]:
    """Lag of 2 s towards 100 bar while the pump is on, which goes off above 60 bar and on below 50 bar."""
    parts = {
        "line": {"type": "first_order_lag", "gain": "100 bar", "time_constant": "2 s"},
        "pump": {"type": "relay", "upper": "60 bar", "lower": "50 bar", "on_value": "0", "off_value": "1"},
    }
    nets = {"u": ["pump.y", "line.u"], "y": ["line.y", "pump.u"]}
    result = circuit(components=parts, nets=nets, simulation={"stop": "4 s"}).simulate(rtol=1e-9)
    full, low = fired(result, "pump.switches_on"), fired(result, "pump.switches_off")
    return [
        Number("first rise", 2 * math.log(100 / 40), full[0], "s"),
        Number("fall", 2 * math.log(60 / 50), low[0] - full[0], "s"),
        Number("rise", 2 * math.log(50 / 40), full[1] - low[0], "s"),
    ]


@evidence(
    "relay",
    "quantizer",
    source="describing functions: relay 4/pi at the angle -asin h; steps of s, 4 s/pi sum sqrt(1 - ((k - 1/2) s)^2); "
    "A. Gelb, W. E. Vander Velde, Multiple-Input Describing Functions (1968), appendix B",
    tolerance=1e-8,
    because="events are found to 1e-9 of the span; Gauss nodes between them",
)
def describing_functions() -> list[Number]:
    """Fundamental of a sine of amplitude 1 behind a relay of +-1 with thresholds +-0.5, and behind steps of 0.3."""
    parts: dict[str, Any] = {
        "sine": SINE,
        "relay": {"type": "relay", "upper": "0.5", "lower": "-0.5", "off_value": "-1"},
        "steps": {"type": "quantizer", "step": "0.3"},
        "counts": {"type": "integrator"},
    }
    nets = {"u": ["sine.y", "relay.u", "steps.u"], "r": ["relay.y"], "q": ["steps.y", "counts.u"], "i": ["counts.y"]}
    result = circuit(components=parts, nets=nets, simulation={"stop": "2 s"}).simulate(rtol=1e-9)
    window = Window(result, start=1.0, stop=2.0)
    relay, steps = (Outcome("it", f"amplitude({name}.y, 1 Hz)").value(window).value for name in ("relay", "steps"))
    expected = 1.2 / math.pi * sum(math.sqrt(1 - ((k - 0.5) * 0.3) ** 2) for k in (1, 2, 3))
    late = fired(result, "relay.switches_on")[1] - 1.0
    return [
        Number("relay", 4 / math.pi, relay),
        Number("its angle, asin h", math.asin(0.5), 2 * math.pi * late, "deg"),
        Number("steps", expected, steps),
    ]


@evidence(
    "quantizer",
    source="B. Widrow, I. Kollar, Quantization Noise (2008), chapter 1: s^2/12, of an error spread evenly over a step",
    tolerance=1e-8,
    because="events are found to 1e-9 of the span",
)
def noise_of_steps() -> list[Number]:
    """A ramp over 10 whole steps of 10: mean square of the error, and the instant of its fourth edge."""
    parts = {
        "ramp": {"type": "ramp", "after": "100", "duration": "1 s"},
        "steps": {"type": "quantizer", "step": "10"},
        "error": {"type": "sum", "weights": ["1", "-1"]},
        "square": {"type": "product"},
        "sum": {"type": "integrator"},
    }
    nets = {
        "u": ["ramp.y", "steps.u", "error.u[1]"], "y": ["steps.y", "error.u[2]"],
        "e": ["error.y", "square.u1", "square.u2"], "s": ["square.y", "sum.u"], "z": ["sum.y"],
    }  # fmt: skip
    result = circuit(components=parts, nets=nets, simulation={"stop": "1 s"}).simulate(rtol=1e-9)
    return [
        Number("mean square", 10**2 / 12, float(result["sum.y"][-1])),
        Number("fourth edge", 0.35, fired(result, "steps.steps_up")[3], "s"),
    ]


@evidence(
    "switch",
    source="rectified sine: mean 2/pi; half of it alone 1/pi",
    tolerance=1e-7,
    because="relative tolerance of the run, 1e-9; events are found to 1e-9 of the span",
)
def rectifier() -> list[Number]:
    """Of a sine and its opposite that which is positive; of a sine and nothing the same."""
    parts = {
        "sine": SINE,
        "opposite": {"type": "gain", "gain": "-1"},
        "zero": {"type": "constant", "value": "0"},
        "full": {"type": "switch", "threshold": "0"},
        "half": {"type": "switch", "threshold": "0"},
        "one": {"type": "integrator"},
        "other": {"type": "integrator"},
    }
    nets = {
        "u": ["sine.y", "opposite.u", "full.u1", "full.control", "half.u1", "half.control"],
        "o": ["opposite.y", "full.u2"], "z": ["zero.y", "half.u2"],
        "f": ["full.y", "one.u"], "h": ["half.y", "other.u"], "y": ["one.y"], "w": ["other.y"],
    }  # fmt: skip
    result = circuit(components=parts, nets=nets, simulation={"stop": "3 s"}).simulate(rtol=1e-9)
    return [
        Number("full wave", 3 * 2 / math.pi, float(result["one.y"][-1])),
        Number("half wave", 3 / math.pi, float(result["other.y"][-1])),
    ]


@evidence(
    "rate_limiter",
    source="y' = R until u - y = R T, then a first-order lag: y = h - R T exp(-(t - t1)/T), t1 = h/R - T; behind a "
    "ramp of the slope s < R, y = s (t - T + T exp(-t/T))",
    tolerance=1e-7,
    because="relative tolerance of the run, 1e-9",
)
def limited_rate() -> list[Number]:
    """Step of 50 bar, 20 bar up and 40 bar down in 1 s, T = 0.1 s: at 1 s, 2.5 s and after the fall; a slow ramp."""
    limiter = {"type": "rate_limiter", "rising": "20 bar", "falling": "40 bar", "time_constant": "100 ms"}
    parts: dict[str, Any] = {
        "pulse": {"type": "pulse", "high": "50 bar", "width": "4 s", "at": "1 s"},
        "ramp": {"type": "ramp", "after": "60 bar", "duration": "6 s"},
        "fast": limiter,
        "slow": limiter,
    }
    nets = {"u": ["pulse.y", "fast.u"], "y": ["fast.y"], "s": ["ramp.y", "slow.u"], "z": ["slow.y"]}
    simulation = {"stop": "6 s", "output_step": "0.5 s"}
    result = circuit(components=parts, nets=nets, simulation=simulation).simulate(rtol=1e-9)

    def at(name: str, t: float) -> float:
        return float(result[name][result.time <= t + 1e-9][-1])

    top = 50e5 - 2e5 * math.exp(-10 * (3.5 - 1 - 2.4))
    return [
        Number("on the rise", 20e5, at("fast.y", 2.0), "bar"),
        Number("at its end", top, at("fast.y", 3.5), "bar"),
        Number("on the fall", 50e5 - 2e5 * math.exp(-10 * 1.6) - 40e5, at("fast.y", 6.0), "bar"),
        Number("behind a ramp of 10 bar/s", 10e5 * (6 - 0.1), at("slow.y", 6.0), "bar"),
    ]
