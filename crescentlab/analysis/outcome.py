"""Outcomes: numbers that a run is summed up in, written as expressions: ``mean(tips.q) / mean(leakage.q)``.

Variables are series over a window of time; the functions below make numbers of them. Means and integrals are taken on
the Gauss nodes of the solver's own dense output, piece by piece between events, so they are as exact as the run and
owe nothing to an output grid.
"""

from __future__ import annotations

import re
import zlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from crescentlab.elaborate import Design
from crescentlab.errors import ExpressionError, InputError, Place, nearest
from crescentlab.expressions import Function, Value, evaluate
from crescentlab.result import Result
from crescentlab.solvers.trajectory import GAUSS_NODES, GAUSS_WEIGHTS
from crescentlab.system import System, Values
from crescentlab.units import QUANTITIES, Quantity, quantity_with

Array = np.ndarray

SAMPLES = np.array([0.0, *GAUSS_NODES, 1.0])
SHARES = np.array([0.0, *GAUSS_WEIGHTS, 0.0])
"""Where each piece is sampled, and with what weight: the ends count for extremes only."""
LEAST_PIECES = 512
"""No piece is longer than this part of the window: lines up to 100 periods in it are integrated to 1e-4."""
SCALES = (1.0, 1e3, 1e-3, -1.0)
"""Sizes of made-up series, in nominal values."""
WHOLE = 1e-3
"""Part of a period by which a window may miss whole periods: it leaks as much, relative to the other lines."""


class Window:
    """Part of a run: times (m,), weights (m,) [s] that add up to its length, and any variable at those times."""

    def __init__(self, result: Result, start: float | None = None, stop: float | None = None) -> None:
        """From ``start`` to ``stop`` [s], by default the whole run; raises :class:`InputError` outside the run."""
        trajectory = result.trajectory
        pieces = trajectory.pieces
        low, high = np.asarray(pieces.low), np.asarray(pieces.high)
        first, last = (float(low[0]), float(high[-1])) if low.size else (0.0, 0.0)
        self.start = first if start is None else start
        self.stop = last if stop is None else stop
        self.system, self.design, self.p = result.system, result.design, result.values.p
        slack = 1e-9 * (last - first)
        if self.start < first - slack or self.stop > last + slack or not self.stop > self.start:
            span = f"from {first:g} s to {last:g} s"
            raise InputError(f"a window from {self.start:g} s to {self.stop:g} s is not inside the run, {span}")
        inside = np.flatnonzero((high > self.start) & (low < self.stop))
        begin, end = np.maximum(low[inside], self.start), np.minimum(high[inside], self.stop)
        cuts = np.maximum(np.ceil((end - begin) / self.length * LEAST_PIECES), 1).astype(int)
        share = np.concatenate([np.arange(n) for n in cuts]) if cuts.size else np.zeros(0)
        part = np.repeat((end - begin) / cuts, cuts)
        begin = np.repeat(begin, cuts) + share * part
        end = begin + part
        self.pieces = np.repeat(np.repeat(inside, cuts), SAMPLES.size)
        self.t = (begin[:, None] + SAMPLES * (end - begin)[:, None]).ravel()
        self.weights = (SHARES * (end - begin)[:, None]).ravel()
        self.x = pieces.at(self.pieces, self.t)
        self.h, self.b = np.asarray(pieces.h)[self.pieces], np.asarray(pieces.b)[self.pieces]
        self.series: dict[str, Array] = {}
        """Variables evaluated so far."""

    @property
    def length(self) -> float:
        """Length [s]."""
        return self.stop - self.start

    def __getitem__(self, name: str) -> Array:
        """Series of a variable: shape (m,), for a vector (m, n)."""
        self.load([name])
        return self.series[name]

    def load(self, names: Iterable[str]) -> None:
        """Evaluate several variables at once, faster than one by one."""
        missing = [name for name in dict.fromkeys(names) if name not in self.series]
        if not missing:
            return
        variables = [self.system.find(name) for name in missing]
        sizes = np.cumsum([len(variable.expression()) for variable in variables])[:-1]
        rows = self.system.series(missing, self.t, self.x, self.h, self.b, self.p)
        for name, variable, part in zip(missing, variables, np.split(rows, sizes), strict=True):
            self.series[name] = part.T if variable.vector else part.ravel()

    def whole_periods(self, frequency: float) -> None:
        """Raise :class:`ExpressionError` unless the window holds whole periods of ``frequency`` [Hz]."""
        count = frequency * self.length
        if round(count) < 1 or abs(count - round(count)) > WHOLE * max(1.0, count):
            raise ExpressionError(
                f"the window of {QUANTITIES['time'].show(self.length, 'ms')} holds {count:.4g} periods of "
                f"{frequency:.6g} Hz, where whole ones are needed; a speed is written as it is, without 2 pi"
            )


class _MadeUp(Window):
    """Every variable rises from its scale to twice that: no difference and no mean is zero by chance."""

    def __init__(self, system: System, values: Values, design: Design, scale: float) -> None:
        self.system, self.design, self.p, self.scale = system, design, values.p, scale
        self.start, self.stop = 0.0, 1.0
        self.t, self.weights = np.array([0.0, 1.0]), np.full(2, 0.5)

    def __getitem__(self, name: str) -> Array:
        """Series of a variable: shape (2,), for a vector (2, n)."""
        variable = self.system.find(name)
        own = 1.0 + zlib.crc32(name.encode()) % 1000 / 1000
        series = self.scale * variable.quantity.nominal * own * np.array([1.0, 2.0])
        return np.tile(series[:, None], (1, len(variable.expression()))) if variable.vector else series

    def whole_periods(self, frequency: float) -> None:
        """Nothing is known of periods before a run."""


@dataclass(frozen=True)
class Outcome:
    """A named number of a run, as the user wrote it."""

    name: str
    text: str
    place: Place | None = None

    def variables(self, system: System) -> list[str]:
        """Names of variables that stand in its text."""
        return [name for name in re.findall(r"[A-Za-z_][\w.]*", self.text) if name in system.variables]

    def value(self, window: Window) -> Value:
        """The number, SI, with its quantity; raises :class:`InputError` for text that gives none."""
        try:
            found = evaluate(self.text, lookup(window), functions(window))
        except InputError as error:
            raise InputError(f"{self.name}: {error.message}", self.place) from None
        if isinstance(found.value, (bool, np.bool_, str)):
            raise InputError(f"{self.name}: {self.text} gives no number", self.place)
        if np.ndim(found.value):
            said = f"{self.name}: {self.text} is a series over time"
            raise InputError(f"{said}; make a number of it, for example mean({self.text})", self.place)
        return Value(float(found.value), found.quantity)

    def quantity(self, system: System, values: Values, design: Design) -> Quantity:
        """What it will be a number of; raises :class:`InputError` for wrong names, units or functions.

        Found on made-up series of several sizes: an outcome may be the root of a difference, or a share of one.
        """
        failed: InputError | None = None
        for scale in SCALES:
            try:
                with np.errstate(all="ignore"):
                    return self.value(_MadeUp(system, values, design, scale)).quantity
            except InputError as error:
                failed = failed or error
        assert failed is not None
        raise failed


def lookup(window: Window) -> Callable[[str], Value]:
    """Finds variables, as series over the window, and the circuit's parameters."""

    def find(name: str) -> Value:
        if name in window.system.variables:
            return Value(window[name], window.system.variables[name].quantity)
        parameters = window.design.parameters.get("", {})
        if name in parameters:
            return parameters[name]
        raise ExpressionError(
            f"no variable or parameter {name!r}: {nearest(name, [*window.system.variables, *parameters])}"
        )

    return find


# -- functions of series -------------------------------------------------------------------------


def functions(window: Window) -> dict[str, Function]:
    """Functions that make a number of a series over the window.

    mean, rms, integral [times s], minimum, maximum, peak_to_peak, initial, final, and amplitude(x, f): the peak value
    of the line at f of the Fourier series over the window; f is a frequency [Hz] or a speed, and the window must hold
    whole periods of it. sum adds the elements of a vector.
    """
    time = QUANTITIES["time"]

    def of_series(name: str, reduce: Callable[[Array], Any], per_time: int = 0) -> Function:
        def apply(arguments: list[Value]) -> Value:
            if len(arguments) != 1:
                raise ExpressionError(f"{name} takes one argument")
            value = np.asarray(arguments[0].value, dtype=float)
            series = value if value.ndim else np.full(window.t.size, float(value))
            quantity = arguments[0].quantity
            if per_time:
                a, b = quantity.dims, time.dims
                quantity = quantity_with((a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3]))
            reduced = reduce(series)
            return Value(float(reduced) if np.ndim(reduced) == 0 else reduced, quantity)

        return apply

    def total(series: Array) -> Any:
        return window.weights @ series

    def amplitude(arguments: list[Value]) -> Value:
        if len(arguments) != 2:
            raise ExpressionError("amplitude takes two arguments: amplitude(delivery.p, 433.3 Hz)")
        series, frequency = np.asarray(arguments[0].value, dtype=float), frequency_of(arguments[1])
        window.whole_periods(frequency)
        turning = np.exp(-2j * np.pi * frequency * (window.t - window.start))
        line = 2 / window.length * ((window.weights * turning) @ np.broadcast_to(series.T, window.t.shape))
        return Value(float(abs(line)), arguments[0].quantity)

    return {
        "mean": of_series("mean", lambda y: total(y) / window.length),
        "rms": of_series("rms", lambda y: np.sqrt(total(y**2) / window.length)),
        "integral": of_series("integral", total, per_time=1),
        "minimum": of_series("minimum", lambda y: y.min(axis=0)),
        "maximum": of_series("maximum", lambda y: y.max(axis=0)),
        "peak_to_peak": of_series("peak_to_peak", lambda y: y.max(axis=0) - y.min(axis=0)),
        "initial": of_series("initial", lambda y: y[0]),
        "final": of_series("final", lambda y: y[-1]),
        "amplitude": amplitude,
        "sum": of_series("sum", lambda y: y.sum(axis=-1) if y.ndim > 1 else y),
    }


def frequency_of(value: Value) -> float:
    """Frequency [Hz] of a frequency or of a speed [rad/s]; raises :class:`ExpressionError` for anything else."""
    if value.dims != QUANTITIES["frequency"].dims or np.ndim(value.value):
        raise ExpressionError("a frequency is needed: 433.3 Hz, or a speed such as driver_teeth * speed")
    return float(value.value) if value.quantity is QUANTITIES["frequency"] else float(value.value) / (2 * np.pi)
