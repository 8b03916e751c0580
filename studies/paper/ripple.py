"""Pressure ripple: Figs. 20 to 23, and mean against instantaneous volumes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from crescentlab.analysis.spectrum import Spectrum, spectra
from crescentlab.plotting import COLOURS
from crescentlab.report.comparison import GIVEN, Comparison, Unit, true_that, within
from crescentlab.report.page import Page
from crescentlab.report.pictures import new_figure
from studies.paper.effort import Effort
from studies.paper.runs import BAR, GRID, Run, area_for, on_a_grid, pump

POINTS = {2000: 3.0, 4000: 6.0}
"""Operating points of Figs. 21 and 22: mean pressure [bar] by speed [rpm]."""
FIGURES = {2000: "Fig. 21", 4000: "Fig. 22"}
REVOLUTIONS = 4
PRINTED_MODULUS = {3.6: 3000.0, 7.35: 6000.0}
"""Fig. 20 and 6.3: 3000 to 6000 bar in the range of the pump; the pressures follow from the fluid's printed data."""
MEANS = ("delivery.p", "throttle.q", "tips.q", "axial.q")


@dataclass(frozen=True)
class Point:
    """The ripple at one operating point."""

    pressure: np.ndarray
    spectrum: Spectrum
    means: dict[str, float]

    @property
    def swing(self) -> float:
        """Peak to peak [Pa]."""
        return float(np.ptp(self.pressure))

    def line(self, harmonic: int) -> float:
        """Amplitude [Pa] of a harmonic of the tooth frequency."""
        return float(self.spectrum.amplitude[13 * REVOLUTIONS * harmonic - 1])


@dataclass(frozen=True)
class Data:
    """Points by speed, with instantaneous and with mean volumes; the bulk modulus over pressure."""

    exact: dict[int, Point]
    simple: dict[int, Point]
    modulus: tuple[np.ndarray, np.ndarray]
    printed_modulus: dict[float, float]


def compute(effort: Effort) -> Data:
    """Settle at the two points of the figures and record four revolutions."""
    chosen = effort.of(tuple(POINTS), (2000,))
    exact, simple = {}, {}
    for rpm in chosen:
        area = area_for(rpm, POINTS[rpm])
        exact[rpm] = _point(rpm, on_a_grid(rpm, area, REVOLUTIONS))
        if effort.full:  # another structure, to be compiled
            simple[rpm] = _point(rpm, on_a_grid(rpm, area, REVOLUTIONS, {"volumes": "mean"}))
    (oil,) = pump().design().fluids.values()
    gauge = np.linspace(0, 10, 201)
    return Data(
        exact,
        simple,
        (gauge, np.array([float(oil.bulk_modulus(p * BAR)) for p in gauge])),
        {p: float(oil.bulk_modulus(p * BAR)) for p in PRINTED_MODULUS},
    )


def _point(rpm: int, run: Run) -> Point:
    (found,) = spectra(run.result, ["delivery.p"], 60 / rpm, periods=REVOLUTIONS, highest=5 * 13 * rpm / 60)
    return Point(run.last("delivery.p")[:-1], found, {name: run.mean(name) for name in MEANS})


def verdicts(data: Data) -> list[Comparison]:
    """Figs. 20 to 23 and what sections 6.1 and 6.3 say of them."""
    rows = [
        within(
            f"bulk modulus at {p:g} bar",
            "Fig. 20, 6.3",
            beta * BAR,
            data.printed_modulus[p],
            0.01,
            Unit("pressure", "bar", 4),
            "pressure not printed, reckoned from the fluid's data",
            relative=True,
        ).resting_on(GIVEN)
        for p, beta in PRINTED_MODULUS.items()
    ]
    for rpm, point in data.exact.items():
        rows += [_thirteen(rpm, point), _frequencies(rpm, point), _nothing_else(rpm, point)]
    if len(data.exact) > 1:
        rows.append(_small_at_low_speed(data))
    return rows + [row for rpm in data.simple for row in _mean_volumes(rpm, data)]


def _where(rpm: int) -> str:
    return f"{rpm} rpm, {POINTS[rpm]:g} bar"


def _thirteen(rpm: int, point: Point) -> Comparison:
    swing, pitch = point.pressure - point.pressure.mean(), GRID // 13
    power = float(swing @ swing)
    whole, half = (float(swing @ np.roll(swing, k)) / power for k in (pitch, pitch // 2))
    return true_that(
        f"periods in a revolution, {_where(rpm)}",
        FIGURES[rpm],
        "13 angular pitches",
        f"turned by a pitch the wave repeats (correlation {whole:.3f}), by half of one not ({half:.2f})",
        whole > 0.99 and half < 0.5,
        "correlation above 0.99, and below 0.5",
    )


def _frequencies(rpm: int, point: Point) -> Comparison:
    f, bin_width = 13 * rpm / 60, point.spectrum.frequency[0]
    frequency, amplitude = point.spectrum.frequency, point.spectrum.amplitude
    peaks = []
    for k in (1, 2, 3):
        near = np.abs(frequency - k * f) < f / 2
        peaks.append(float(frequency[near][np.argmax(amplitude[near])]))
    leads = abs(frequency[np.argmax(amplitude)] - f) <= bin_width
    close = all(abs(peak - k * f) <= bin_width for k, peak in enumerate(peaks, 1))
    says = (
        "433.3, 866.7, 1300 Hz; the first dominant" if rpm == 2000 else f"Eq. 32 at {rpm} rpm: {f:.1f} Hz and multiples"
    )
    found = f"{', '.join(f'{peak:.1f}' for peak in peaks)} Hz; the {'first' if leads else 'first not'} largest"
    return true_that(
        f"peaks of the spectrum, {_where(rpm)}",
        "Fig. 23, Eq. 32",
        says,
        found,
        bool(close and leads),
        f"one bin, {bin_width:.2f} Hz",
    )


def _nothing_else(rpm: int, point: Point) -> Comparison:
    every = 13 * REVOLUTIONS
    share = float((point.spectrum.amplitude[every - 1 :: every] ** 2).sum() / (point.spectrum.amplitude**2).sum())
    return true_that(
        f"other frequencies, {_where(rpm)}",
        "6.3",
        "measured, but not reproduced by the model",
        f"{100 * (1 - share):.1g} % of the ripple's power is between the harmonics",
        share > 0.99,
        "below 1 %",
    )


def _small_at_low_speed(data: Data) -> Comparison:
    low, high = data.exact[2000].swing, data.exact[4000].swing
    return true_that(
        "size of the oscillations",
        "6.3",
        "quite small at low speed; no number printed",
        f"peak to peak {low / BAR:.2f} bar at 2000 rpm, {high / BAR:.2f} bar at 4000 rpm",
        low < high / 1.5,
        "a third smaller at least",
    )


def _mean_volumes(rpm: int, data: Data) -> list[Comparison]:
    exact, simple = data.exact[rpm], data.simple[rpm]
    changes = [simple.means[name] / exact.means[name] - 1 for name in MEANS]
    changes += [simple.swing / exact.swing - 1, simple.line(1) / exact.line(1) - 1]
    return [
        true_that(
            f"mean in place of instantaneous volumes, {_where(rpm)}",
            "6.1",
            "the same result",
            f"means, peak to peak and first harmonic within {100 * max(map(abs, changes)):.2g} %",
            max(map(abs, changes)) < 0.01,
            "1 %, the width of a line in the figures",
        )
    ]


def pictures(data: Data) -> dict[str, Figure]:
    """Figs. 20, 23, and 21 with 22."""
    return {"figure_20": _draw_modulus(data), "figures_21_22": _draw_waves(data), "figure_23": _draw_spectrum(data)}


def _draw_modulus(data: Data) -> Figure:
    figure = new_figure(6.5, 3.4)
    axes = figure.subplots()
    axes.plot(data.modulus[0], data.modulus[1] / BAR, color=COLOURS[0])
    axes.plot(list(PRINTED_MODULUS), list(PRINTED_MODULUS.values()), "o", color=COLOURS[1], label="3000 and 6000 bar")
    axes.set(xlabel="pressure [bar, gauge]", ylabel="bulk modulus [bar]", xlim=(0, 10), ylim=(0, 8000))
    axes.legend(loc="upper left")
    return figure


def _draw_waves(data: Data) -> Figure:
    figure = new_figure(9.0, 5.2)
    stack = figure.subplots(len(data.exact), 1, sharex=True, squeeze=False)[:, 0]
    angle = np.arange(GRID) * 360 / GRID
    for axes, rpm in zip(stack, data.exact, strict=True):
        for points, line, label in ((data.exact, "-", "instantaneous volumes"), (data.simple, ":", "mean volumes")):
            point = points.get(rpm, data.exact[rpm])
            wave = point.pressure[:GRID] / point.pressure.mean()
            axes.plot(angle, wave, line, color=COLOURS[0 if line == "-" else 1], linewidth=1.2, label=label)
        axes.set(ylabel="p / mean p [-]", xlim=(0, 360))
        axes.set_title(f"{FIGURES[rpm]}: {_where(rpm)}", loc="left")
        axes.set_xticks(range(0, 361, 45))
    stack[0].legend(loc="lower left", bbox_to_anchor=(0.55, 1.0), ncols=2, borderpad=0.1)
    stack[-1].set_xlabel("shaft angle [deg]")
    return figure


def _draw_spectrum(data: Data) -> Figure:
    figure = new_figure(8.0, 3.4)
    axes = figure.subplots()
    found = data.exact[2000].spectrum
    shown = found.frequency <= 2000
    axes.vlines(found.frequency[shown], 0, found.amplitude[shown] / BAR * 1e3, color=COLOURS[0], linewidth=1.6)
    for k in (1, 2, 3):
        f, size = k * 13 * 2000 / 60, data.exact[2000].line(k) / BAR * 1e3
        axes.annotate(
            f"{f:.1f} Hz\n{size:.3g} mbar",
            (f, size),
            xytext=(5, -2),
            textcoords="offset points",
            verticalalignment="top" if k == 1 else "bottom",
        )
    axes.set(xlabel="frequency [Hz]", ylabel="amplitude [mbar]", xlim=(0, 2000), ylim=(0, None))
    return figure


def tell(page: Page, data: Data) -> None:
    """The section of the page."""
    page.section("Pressure ripple")
    page.picture(
        "paper/figure_20.svg",
        """Fig. 20 of the paper: bulk modulus of the oil with 0.5 % of air that is dissolved at 1000 bar, over
        the pressure.""",
    )
    page.picture(
        "paper/figures_21_22.svg",
        """Figs. 21 and 22 of the paper: delivery pressure over a revolution, divided by its mean. The measured
        curves are not printed as numbers.""",
    )
    page.picture(
        "paper/figure_23.svg",
        """Fig. 23 of the paper: spectrum of the delivery pressure at 2000 rpm and 3 bar over four revolutions,
        bins of 8.33 Hz.""",
    )
    ways = "; ".join(
        f"{_where(rpm)}: {p.swing / BAR:.2f} bar peak to peak, harmonics of {_harmonics(p)} mbar"
        for rpm, p in data.exact.items()
    )
    page.say(f"""Frequencies follow from the number of teeth and prove little. The amplitudes are the model's
        word: {ways}. The test suite holds the first harmonic against small oscillations of the delivery line in
        the frequency domain (distributed lines, volumes, throttle), within 10 %. The paper prints no amplitude,
        and chose the air content to fit them; what is open in them is shown below.""")
    page.verdicts(verdicts(data))


def _harmonics(point: Point) -> str:
    return ", ".join(f"{point.line(k) / BAR * 1e3:.3g}" for k in (1, 2, 3))
