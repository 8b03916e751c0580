"""Modes of a linear model: eigenvalues, frequencies, damping, and the states that take part."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eig

from crescentlab.analysis.linear.model import LinearModel

Array = np.ndarray

AT_ONCE = 1e-3
"""With ticks: what falls to less than this within one is no mode but the memory of that tick."""
ZERO = 1e-10
"""Eigenvalues below this part of the largest are rounding of zero."""


@dataclass(frozen=True)
class Mode:
    """One eigenvalue s [1/s], of a pair the one of positive imaginary part, and each state's share in it."""

    eigenvalue: complex
    participation: dict[str, float]
    """Shares that add up to 1, largest first: |w_k v_k| of left and right eigenvectors."""

    @property
    def parts(self) -> dict[str, float]:
        """The shares with those of a vector's elements added up under the vector's name, largest first."""
        found: dict[str, float] = {}
        for name, share in self.participation.items():
            whole = name.partition("[")[0]
            found[whole] = found.get(whole, 0.0) + share
        return dict(sorted(found.items(), key=lambda item: -item[1]))

    @property
    def natural_frequency(self) -> float:
        """|s| [rad/s]."""
        return abs(self.eigenvalue)

    @property
    def damped_frequency(self) -> float:
        """|Im s| [rad/s]."""
        return abs(self.eigenvalue.imag)

    @property
    def damping_ratio(self) -> float:
        """-Re s/|s|, 1 for what does not oscillate; NaN for s = 0."""
        return -self.eigenvalue.real / abs(self.eigenvalue) if self.eigenvalue else float("nan")

    @property
    def time_constant(self) -> float:
        """-1/Re s [s]; infinite if undamped, negative if it grows."""
        return -1 / self.eigenvalue.real if self.eigenvalue.real else float("inf")

    @property
    def stable(self) -> bool:
        """Whether it dies out."""
        return self.eigenvalue.real < 0


def modes(model: LinearModel) -> list[Mode]:
    """All modes by rising |s|; states that stand still here are left out.

    Eigenvalues and participation factors p_ki = |w_ki v_ki| (P. Kundur, Power System Stability and Control (1994),
    section 12.2.4), scaled to add up to 1 over the states, which makes them free of units. With ticks,
    s = ln(z)/T of the map from tick to tick; what dies within one tick has no s and is left out.
    """
    moving = [k for k, name in enumerate(model.states) if name not in set(model.still)]
    if not moving:
        return []
    scale = model.scale[moving]
    A = model.A[np.ix_(moving, moving)] * scale / scale[:, None]
    values, left, right = eig(A, left=True, right=True)
    names = [model.states[k] for k in moving]
    largest = float(np.abs(values).max())
    found: list[Mode] = []
    for k, value in enumerate(values):
        if value.imag < 0:
            continue
        s = _continuous(complex(value), model.period, largest)
        if s is not None:
            found.append(Mode(s, _shares(np.abs(left[:, k].conj() * right[:, k]), names)))
    return sorted(found, key=lambda m: (abs(m.eigenvalue), m.eigenvalue.real))


def _continuous(value: complex, period: float | None, largest: float) -> complex | None:
    """s [1/s] of an eigenvalue, rounding of zero taken off; None if it dies within a tick."""
    if period is None:
        return 0j if abs(value) <= ZERO * largest else value
    if abs(value) < AT_ONCE:
        return None
    s = complex(np.log(value) / period)
    return 0j if abs(s) * period <= ZERO else s


def _shares(sizes: Array, names: list[str]) -> dict[str, float]:
    total = float(sizes.sum()) or 1.0
    order = np.argsort(-sizes, kind="stable")
    return {names[k]: float(sizes[k] / total) for k in order}
