"""How a run is to be integrated, and the limits all solvers share."""

from __future__ import annotations

from dataclasses import dataclass

ANGLE_STEP = 0.3
"""A step turns no angle further than this [rad], so that what depends on it is not stepped over."""
LEAST_STEPS = 50
"""No step is longer than this part of the run."""
RESTART_SHARE = 1e-3
"""A change of f that moves no state by more than this share of its tolerance over a step needs no restart; a sampled
part makes thousands of such changes, and their sum must stay within the tolerance."""
TIGHT = 1e-7
"""Smaller relative tolerances are left to methods of higher order than that of rodas."""


TOLERANCE_SHARE = {"lsoda": 0.2, "bdf": 0.02, "cvode": 0.2, "rk45": 0.2, "dopri": 0.2}
"""What part of the tolerance a method works to; others to all of it. An error control holds the error of a step. Where
little is damped, as in a line, the errors of all steps add up, and they do so by method: at one tolerance those of BDF
to some ten times those of rodas and LSODA, since they have one sign, a damping; those of the explicit methods of order
5, which take the fewest steps, to three times. With these shares errors in random circuits are of one size
(tests/test_random_circuits.py)."""


@dataclass(frozen=True)
class Options:
    """How to integrate; times in seconds."""

    stop: float
    start: float = 0.0
    rtol: float = 1e-6
    solver: str = "auto"
    max_step: float | None = None
    output_step: float | None = None
    compile: bool | None = None
    """Whether functions are compiled; None: when it pays."""

    @property
    def span(self) -> float:
        """Length of the run [s]."""
        return self.stop - self.start

    @property
    def step_cap(self) -> float:
        """Longest step [s]."""
        return min(self.max_step or float("inf"), self.span / LEAST_STEPS)
