"""How fast values that depend on time alone move: no step may pass over their excitation."""

from __future__ import annotations

import casadi as ca
import numpy as np

from crescentlab.system import System, Values

CLOCK_POINTS = 4097
CLOCK_SWING = 0.5
"""In one step no value that depends on time alone swings by more than this share of its range."""


def clock_pace(system: System, values: Values, start: float, stop: float) -> tuple[np.ndarray, np.ndarray] | None:
    """Times, and how far values on time alone have swung until then, in shares of their range; None without any."""
    if not system.clock.numel():
        return None
    clock = system.once("clock", lambda: ca.Function("clock", system.arguments, [system.clock]))
    times = np.linspace(start, stop, CLOCK_POINTS)
    with np.errstate(all="ignore"):
        swing = np.array(clock(times.reshape(1, -1), values.x0, values.h0, np.zeros(system.b.numel()), values.p))
        shares = np.abs(np.diff(swing, axis=1)) / np.ptp(swing, axis=1, keepdims=True)
    shares = shares[np.isfinite(shares).all(axis=1)]
    return (times, np.concatenate(([0.0], np.cumsum(shares.max(axis=0))))) if shares.size else None
