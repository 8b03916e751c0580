r"""Amplitude spectra over whole periods: Fourier integrals of the dense output, without leakage or aliasing.

.. math:: y(t) = \bar y + \sum_k A_k \cos(2\pi f_k t + \varphi_k), \qquad
          A_k e^{j\varphi_k} = \frac{2}{N T} \int_{t_e - N T}^{t_e} y(t)\, e^{-2\pi j f_k t}\, dt, \qquad
          f_k = \frac{k}{N T}

T [s] the period, N of them end at t_e [s]; A_k peak value, f_k [Hz], t the time of the run. The integrals are taken on
Gauss nodes of smooth pieces (:mod:`crescentlab.analysis.spectrum.dense`), so that jumps are exact and no line is
mistaken for another. Parseval: the lines hold :math:`\sum A_k^2/2` of the mean square of y about its mean.
Source: Fourier series; Bracewell, The Fourier Transform and Its Applications (2000).
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from crescentlab import arguments
from crescentlab.analysis.spectrum.dense import SWING, Dense, Nodes, harmonics
from crescentlab.arguments import Number
from crescentlab.errors import InputError
from crescentlab.recorded import Recorded
from crescentlab.result import Result
from crescentlab.units import QUANTITIES, Quantity, quantity_of_si

Array = np.ndarray

HARMONICS = 50
"""Harmonics of the period in a spectrum that is not told how far to go."""
EVEN = 1e-6
"""Part of a step by which rows of a file may miss their even grid, and periods the rows."""
MOST_DIGITS = 1e-9
"""Ripple below this share of the largest value is rounding."""

time, frequency = QUANTITIES["time"], QUANTITIES["frequency"]


@dataclass(frozen=True)
class Line:
    """One line: frequency [Hz], order (None without a shaft speed), peak value (SI), phase [rad]."""

    frequency: float
    order: float | None
    amplitude: float
    phase: float


@dataclass(frozen=True)
class Spectrum:
    """The lines of one variable over ``periods`` periods that end at ``stop``."""

    name: str
    quantity: Quantity
    start: float
    stop: float
    period: float
    periods: int
    frequency: Array
    """f_k [Hz], k = 1, 2, ..."""
    lines: Array
    """A_k exp(j phi_k), SI."""
    mean: float
    rms: float
    """Of the ripple: root of the mean square about the mean."""
    change: float | None
    """rms of y(t) - y(t - T) over the last period, over that of the ripple; None if one is not known or rounding."""
    error: float
    """Bound of what integration may have left out of a line (SI)."""

    def __repr__(self) -> str:
        """Of what, and its strongest lines."""
        si = self.quantity.si
        lines = ", ".join(f"{line.amplitude:.4g} at {line.frequency:.6g} Hz" for line in self.strongest(4))
        return (
            f"<Spectrum {self.name!r}: mean {self.mean:.5g} {si}, ripple {self.rms:.4g} rms, lines {lines or 'none'}>"
        )

    @property
    def amplitude(self) -> Array:
        """Peak values A_k (SI)."""
        return np.asarray(np.abs(self.lines))

    @property
    def share(self) -> float:
        """Part of the ripple's mean square that the lines hold; 1 for no ripple."""
        return float((self.amplitude**2).sum() / 2 / self.rms**2) if self.rms > 0 else 1.0

    def strongest(self, count: int, shaft: float | None = None) -> list[Line]:
        """The strongest lines above rounding, by frequency; ``shaft`` [rad/s] gives them orders."""
        floor = MOST_DIGITS * max(abs(self.mean), self.rms)
        order = np.argsort(-self.amplitude, kind="stable")[:count]
        return [self.line(int(k), shaft) for k in sorted(order) if self.amplitude[k] > floor]

    def line(self, k: int, shaft: float | None = None) -> Line:
        """The line at ``frequency[k]``."""
        f = float(self.frequency[k])
        order = None if shaft is None else f * 2 * np.pi / shaft
        return Line(f, order, float(abs(self.lines[k])), float(np.angle(self.lines[k])))


def spectra(
    result: Result, names: str | Sequence[str], period: Number, *, periods: int | None = None,
    start: Number | None = None, highest: Number | None = None,
) -> list[Spectrum]:  # fmt: skip
    """Spectra of variables over whole periods [s] that end with the run; of a result that was read, from its even rows.

    ``periods`` of them, or as many as fit after ``start`` [s], or the last one. Lines go up to ``highest`` [Hz], by
    default 50 harmonics. Raises :class:`InputError` if the run is too short, or for names that do not exist.
    """
    arguments.instance(result, Result, "spectrum", "write circuit.simulate() or crescentlab.read(path) first")
    names, period = arguments.names(names, "names"), arguments.seconds(period, "period")
    periods = None if periods is None else arguments.whole(periods, "periods", 1, 1)
    start = None if start is None else arguments.quantity(start, "start", time)
    highest = None if highest is None else arguments.quantity(highest, "highest", frequency, above=0.0)
    if isinstance(result, Recorded):
        columns = [column for name in names for column in result.elements(name)]
        series = Series(str(result.path), result.time, {n: result[n] for n in columns}, result.units)
        return spectra_of_rows(series, columns, period, periods=periods, start=start, highest=highest)
    dense = Dense(result, names)
    stop, count = dense.stop, whole_periods(dense.start, dense.stop, period, periods, start)
    begin = _begin(dense, stop, count * period)
    top = HARMONICS / period if highest is None else highest
    lines = _lines_below(top, count * period)
    nodes = dense.nodes(np.unique([begin, max(begin, stop - period), stop]), SWING / (np.pi * top))
    mean = nodes.mean(nodes.y)
    ripple = nodes.y - mean
    square = nodes.mean(ripple**2)
    found = fourier(nodes, ripple, lines)
    change = _change(dense, nodes, period, square)
    return [
        Spectrum(
            name, result.quantity(name), begin, stop, period, count, np.arange(1, lines + 1) / (count * period),
            found[:, k], float(mean[k]), float(np.sqrt(square[k])), change[k], 2 * float(nodes.error[k]),
        )
        for k, name in enumerate(dense.names)
    ]  # fmt: skip


def whole_periods(first: float, stop: float, period: float, periods: int | None, start: float | None) -> int:
    """How many periods are taken; raises :class:`InputError` if the run does not hold them."""
    slack = 1e-9 * period
    if start is not None:
        if not start < stop:
            ends = f"the run ends at {time.show(stop, 'ms')} already"
            raise InputError(f"--from {time.show(start, 'ms')}: {ends}; simulate longer (--stop), or begin earlier")
        fit = int(np.floor((stop - max(start, first) + slack) / period))
        if fit < (periods or 1):
            raise InputError(
                f"from {time.show(start, 'ms')} to the end of the run at {time.show(stop, 'ms')} there are {fit} "
                f"periods of {time.show(period, 'ms')}; simulate longer (--stop), or begin earlier (--from)"
            )
        return periods or fit
    count = 1 if periods is None else periods
    if count < 1:
        raise InputError(f"--periods {count}: at least one period is needed")
    if count * period > stop - first + slack:
        raise InputError(
            f"the run of {time.show(stop - first, 'ms')} does not hold {count} x {time.show(period, 'ms')}; "
            f"simulate longer, for example --stop '{time.show(first + (count + 1) * period, 'ms', 4)}'"
        )
    return count


def _begin(dense: Dense, stop: float, length: float) -> float:
    """Where the window begins; the run's own begin where that is meant."""
    begin = stop - length
    return dense.start if abs(begin - dense.start) <= 1e-9 * length else begin


def _lines_below(top: float, length: float) -> int:
    lines = int(np.floor(top * length * (1 + 1e-9)))
    if lines < 1:
        raise InputError(
            f"there is no line up to {frequency.show(top, 'Hz')}; the first is at {frequency.show(1 / length, 'Hz')}"
        )
    return lines


def fourier(nodes: Nodes, y: Array, count: int) -> Array:
    """Lines 2/L times the integral of y exp(-2j pi k t/L) over the nodes' length L, k = 1 ... count; y is (s, 8, v)."""
    t, weights = nodes.t.ravel(), nodes.weights.ravel()
    length, begin = float(weights.sum()), float(nodes.low[0])
    weighted = weights[:, None] * y.reshape(t.size, -1)
    found = harmonics(2 * np.pi / length * (t - begin), weighted, count)[1:]
    turned = np.exp(-2j * np.pi * np.arange(1, count + 1) * (begin / length))  # phases count from time zero
    return np.asarray(2 / length * turned[:, None] * found)


def _change(dense: Dense, nodes: Nodes, period: float, square: Array) -> list[float | None]:
    """rms of the change over the last two periods, over the ripple's."""
    stop = float(nodes.high[-1])
    if stop - 2 * period < dense.start - 1e-9 * period:
        return [None] * square.size
    last = nodes.after(stop - period * (1 + 1e-9))
    # two nodes at one place of both periods: neither jumps nor what lies between nodes can be missed by much
    earlier = dense.at((last.t - period).ravel()).reshape(last.y.shape)
    moved = np.sqrt(last.mean((last.y - earlier) ** 2))
    size = np.abs(nodes.y).max(axis=(0, 1))
    return [
        float(m / np.sqrt(s)) if np.sqrt(s) > MOST_DIGITS * top else None
        for m, s, top in zip(moved, square, size, strict=True)
    ]


# -- rows of a file ------------------------------------------------------------------------------


@dataclass(frozen=True)
class Series:
    """Series of a result file: times (m,), values by name (SI), SI units by name."""

    source: str
    t: Array
    values: dict[str, Array]
    units: dict[str, str]

    @functools.cached_property
    def step(self) -> float:
        """Step of the even grid [s]; raises :class:`InputError` where the rows are not even."""
        steps = np.diff(self.t[:-1]) if self.t.size > 2 else np.diff(self.t)
        if not steps.size or not steps.min() > 0 or np.ptp(steps) > EVEN * steps.mean():
            raise InputError(
                f"{self.source}: its rows are steps of the solver, not an even grid; name the circuit instead of the "
                "file, or write the file by crescentlab simulate --output-step with a whole part of the period"
            )
        return float((self.t[-2] - self.t[0]) / (self.t.size - 2)) if self.t.size > 2 else float(steps[0])

    @property
    def even(self) -> int:
        """Rows that are on the grid: all, or all but the end of the run."""
        return self.t.size if abs(self.t[-1] - self.t[-2] - self.step) <= EVEN * self.step else self.t.size - 1


def spectra_of_rows(
    series: Series, names: Sequence[str], period: float, *, periods: int | None = None, start: float | None = None,
    highest: float | None = None,
) -> list[Spectrum]:  # fmt: skip
    """As :func:`spectra` from an even grid of rows, by the discrete Fourier transform.

    ``error`` is the largest difference to the lines of every second row: what aliasing would double to. Raises
    :class:`InputError` unless the rows are even and whole periods fit them.
    """
    step, rows = series.step, series.even
    t = series.t[:rows]
    count = whole_periods(float(t[0] - step), float(t[-1]), period, periods, start)
    length = count * period / step
    m = round(length)
    if m < 4 or abs(length - m) > EVEN * m:
        part = 2 ** int(np.ceil(np.log2(max(64.0, period / step))))
        raise InputError(
            f"{series.source}: {count} x {time.show(period, 'ms', 7)} are {length:.7g} rows of "
            f"{time.show(step, 'ms', 7)}, not a whole number of them; simulate with "
            f"--output-step '{time.show(period / part, 'ms', 15)}', or name the circuit instead of the file"
        )
    top = HARMONICS / period if highest is None else highest
    lines = min(_lines_below(top, count * period), (m - 1) // 2)
    frequencies = np.arange(1, lines + 1) / (count * period)
    turning = np.exp(-2j * np.pi * frequencies * float(t[-m]))
    begin = max(float(t[0]), float(t[-1]) - count * period)  # m rows: one end of the window has none
    found = []
    for name in names:
        y = series.values[name][:rows]
        window = y[-m:]
        mean, rms = float(window.mean()), float(window.std())
        transform = 2 / m * np.fft.rfft(window - mean)[1 : lines + 1] * turning
        change, aliased = _change_of_rows(y, m // count, rms), _aliased(window, transform, turning)
        quantity = quantity_of_si(series.units.get(name, ""))
        window_facts = (name, quantity, begin, begin + count * period, period, count)
        found.append(Spectrum(*window_facts, frequencies, transform, mean, rms, change, aliased))
    return found


def _change_of_rows(y: Array, m: int, rms: float) -> float | None:
    if y.size < 2 * m or not rms > MOST_DIGITS * np.abs(y).max():
        return None
    return float(np.sqrt(((y[-m:] - y[-2 * m : -m]) ** 2).mean()) / rms)


def _aliased(window: Array, lines: Array, turning: Array) -> float:
    """Largest difference of the lines to those of every second row."""
    half = window[::2] if window.size % 2 == 0 else None
    if half is None:
        return float("nan")
    coarse = 2 / half.size * np.fft.rfft(half - half.mean())[1:]
    some = min(lines.size, (half.size - 1) // 2)
    return float(np.abs(coarse[:some] * turning[:some] - lines[:some]).max()) if some else float("nan")
