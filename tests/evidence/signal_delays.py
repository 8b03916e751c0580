"""Signals sampled and delayed."""

from __future__ import annotations

import math

import numpy as np
from building import circuit
from crescentlab.components.signal_delays import PadeDelay, pade
from reading import rows
from scipy.interpolate import pade as known_pade

from evidence import Number, evidence


@evidence(
    "sample_and_hold",
    "delay",
    source="definitions: y = u(t_k) until t_{k+1}; y = u(t - tau) at the samples",
    tolerance=1e-12,
    because="rounding of double precision",
)
def at_the_samples() -> list[Number]:
    """A sine of 1 Hz sampled every 50 ms, and delayed by 200 ms in 10 samples."""
    result = circuit(
        components={
            "sine": {"type": "sine", "amplitude": "1", "frequency": "1 Hz", "phase": "30 deg"},
            "hold": {"type": "sample_and_hold", "sample_time": "50 ms"},
            "late": {"type": "delay", "delay": "200 ms", "samples": "10"},
        },
        nets={"u": ["sine.y", "hold.u", "late.u"], "held": ["hold.y"], "delayed": ["late.y"]},
        simulation={"stop": "1 s", "output_step": "10 ms"},
    ).simulate()

    def u(t: float) -> float:
        return math.sin(2 * math.pi * t + math.pi / 6)

    held = rows(result, "hold.y", [0.0, 0.04, 0.05, 0.99])
    late = rows(result, "late.y", [0.0, 0.2, 0.22, 0.64, 1.0])
    sampled = zip((0.0, 0.04, 0.05, 0.99), (0.0, 0.0, 0.05, 0.95), held, strict=True)
    delayed = zip((0.0, 0.2, 0.22, 0.64, 1.0), (0.0, 0.0, 0.02, 0.44, 0.8), late, strict=True)
    found = [Number(f"held at {1e3 * t:g} ms", u(s), float(y), size=1.0) for t, s, y in sampled]
    return found + [Number(f"delayed at {1e3 * t:g} ms", u(s), float(y), size=1.0) for t, s, y in delayed]


@evidence(
    "delay",
    source="largest error of linear interpolation, h^2/8 max |u''|, half-way between samples at the crest",
    tolerance=1e-3,
    because="the next term is (omega h)^2 (5/48), 0.04 %",
)
def between_the_samples() -> list[Number]:
    """The same sine 20 ms apart: its crest, 333 ms and 200 ms late, is cut by (2 pi/s 20 ms)^2/8."""
    result = circuit(
        components={
            "sine": {"type": "sine", "amplitude": "1", "frequency": "1 Hz", "phase": "86.4 deg"},  # crest at 10 ms
            "late": {"type": "delay", "delay": "200 ms", "samples": "10"},
        },
        nets={"u": ["sine.y", "late.u"], "delayed": ["late.y"]},
        simulation={"stop": "0.3 s", "output_step": "10 ms"},
    ).simulate()
    expected = (2 * math.pi * 0.02) ** 2 / 8
    return [Number("cut of the crest", expected, 1 - float(rows(result, "late.y", [0.21])[0]))]


@evidence(
    "pade_delay",
    source="scipy.interpolate.pade of the series of exp(-s)",
    tolerance=1e-12,
    because="rounding of double precision; scipy solves a linear system",
)
def coefficients() -> list[Number]:
    """Coefficients of order 3, from s^3 to 1, numerator and denominator."""
    p, q = known_pade([(-1) ** k / math.factorial(k) for k in range(7)], 3)
    found = []
    for name, known, own in (("numerator", p, pade(3)[0]), ("denominator", q, pade(3)[1])):
        found += [
            Number(f"{name}, s^{3 - k}", float(e / q(0)), c)
            for k, (e, c) in enumerate(zip(known.coeffs, own, strict=True))
        ]
    return found


@evidence(
    "pade_delay",
    source="leading error of the phase, (n!)^2/((2n)! (2n+1)!) x^(2n+1), of Baker & Graves-Morris (1996), section 1.2",
    tolerance=1e-2,
    because="the next term is 3 x^2/20 of the first for n = 1, 0.6 % at x = 0.2",
)
def phase() -> list[Number]:
    """Amplitude, and phase less that of a pure delay, at omega tau = 0.2, from the states' equations."""
    found = []
    x = 0.2
    for n in (1, 2, 3):
        part = PadeDelay(delay=1.0, order=n)

        def of(state: np.ndarray, u: float, part: PadeDelay = part) -> dict[str, np.ndarray]:
            return part.equations(x=state, begun=1.0, u=u)

        a = np.column_stack([of(e, 0.0)["der_x"] for e in np.eye(n)])
        c = np.array([of(e, 0.0)["y"] for e in np.eye(n)])
        rest = of(np.zeros(n), 1.0)
        h = c @ np.linalg.solve(1j * x * np.eye(n) - a, rest["der_x"]) + rest["y"]
        expected = math.factorial(n) ** 2 / (math.factorial(2 * n) * math.factorial(2 * n + 1)) * x ** (2 * n + 1)
        error = abs(float(np.angle(h * np.exp(1j * x))))
        found += [
            Number(f"amplitude, order {n}", 1.0, float(abs(h))),
            Number(f"error of phase, {n}", expected, error, "rad"),
        ]
    return found
