"""Settled runs of the shipped circuits: the operating points that the figures and tables are made of."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

import crescentlab as cl
from crescentlab.analysis.outcome import Outcome, Window
from crescentlab.result import Result

BAR, LPM, MM, DEG, CC = 1e5, 1e-3 / 60, 1e-3, math.pi / 180, 1e-6
SOLVER, RTOL = "rodas", 1e-4
GRID = 13 * 64
"""Rows per revolution for spectra: a multiple of 13."""


@functools.cache
def pump() -> cl.Circuit:
    """The crescent pump, assembled once per structure."""
    return cl.load("crescent_pump")


@dataclass(frozen=True)
class Run:
    """A pitch or more of a settled run."""

    result: Result
    start: float
    stop: float

    @functools.cached_property
    def window(self) -> Window:
        """The window on the nodes of the solver's own dense output."""
        return Window(self.result, self.start, self.stop)

    def mean(self, name: str) -> float:
        """Mean over it, in SI."""
        return self.number(f"mean({name})")

    def number(self, text: str) -> float:
        """An outcome of it, in SI: ``peak_to_peak(delivery.p)``."""
        return Outcome(text, text).value(self.window).value

    def last(self, name: str) -> np.ndarray:
        """Values in it at the rows of the run: the solver's own times, or its grid."""
        return self.result[name][self._rows]

    @property
    def times(self) -> np.ndarray:
        """Times of :meth:`last`, from its beginning [s]."""
        return self.result.time[self._rows] - self.start

    @property
    def _rows(self) -> np.ndarray:
        slack = 1e-9 * self.stop
        return (self.result.time >= self.start - slack) & (self.result.time <= self.stop + slack)


def settled(rpm: float, area: float, given: Mapping[str, str] | None = None) -> Run:
    """The pump at ``rpm`` with a throttle of ``area`` [m^2] in its periodic steady state: one pitch of it."""
    parameters = settings(rpm, area, given)
    found = cl.periodic(pump(), parameters, solver=SOLVER, rtol=RTOL, compile=True)
    if not found.converged:
        raise RuntimeError(f"{found.message}, with {parameters}")
    return Run(found.result, float(found.result.time[0]), float(found.result.time[-1]))


def settings(rpm: float, area: float, given: Mapping[str, str] | None = None) -> dict[str, str]:
    """The circuit's parameters for a speed and a throttle area [m^2], and others as they are."""
    return {"speed": f"{rpm:.12g} rpm", "throttle_area": f"{area * 1e6:.12g} mm^2", **(given or {})}


def simulate(stop: float, parameters: Mapping[str, str], **more: Any) -> Result:
    """The pump to the time ``stop`` [s]."""
    return pump().simulate(stop, parameters, solver=SOLVER, rtol=RTOL, compile=True, **more)


def on_a_grid(rpm: float, area: float, turns: int, given: Mapping[str, str] | None = None) -> Run:
    """``turns`` revolutions of the periodic steady state, :data:`GRID` rows each."""
    before, turn = settled(rpm, area, given), 60 / rpm
    stop = before.stop + turns * turn
    result = simulate(stop, settings(rpm, area, given), start=before.result, output_step=turn / GRID)
    return Run(result, before.stop, stop)


def revolution(rpm: float, area: float, given: Mapping[str, str] | None = None) -> Run:
    """A revolution of the periodic steady state, at the solver's own times."""
    before = settled(rpm, area, given)
    stop = before.stop + 60 / rpm
    return Run(simulate(stop, settings(rpm, area, given), start=before.result), before.stop, stop)


def at_pressure(rpm: float, bar: float, given: Mapping[str, str] | None = None, tolerance: float = 1e-3) -> Run:
    """The pump with its throttle set so that the mean delivery pressure is ``bar``."""
    return settled(rpm, area_for(rpm, bar, given, tolerance), given)


def area_for(rpm: float, bar: float, given: Mapping[str, str] | None = None, tolerance: float = 1e-3) -> float:
    """Area [m^2] of the throttle at which the mean delivery pressure is ``bar``, by secants of ln p over ln A."""
    return _area_for(rpm, bar, tuple(sorted((given or {}).items())), tolerance)


@functools.cache
def _area_for(rpm: float, bar: float, given: tuple[tuple[str, str], ...], tolerance: float) -> float:
    area = 24.6e-6 * (rpm / 2000) * math.sqrt(3 / bar)
    slope = -1.5  # of ln p over ln A: -2 for a constant flow, less with leakage
    points: list[tuple[float, float]] = []
    for _ in range(12):
        p = settled(rpm, area, dict(given)).mean("delivery.p") / BAR
        if abs(p / bar - 1) < tolerance:
            return area
        points.append((math.log(area), math.log(p)))
        if len(points) > 1:
            (a, b), (c, d) = points[-2:]
            slope = (d - b) / (c - a)
        area *= math.exp((math.log(bar) - math.log(p)) / slope)
    raise RuntimeError(f"no throttle area found for {bar:g} bar at {rpm:g} rpm with {dict(given)}")
