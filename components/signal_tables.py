"""Tabulated signals: functions of time and of another signal, straight lines or splines between points."""

from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, model_validator

from crescentlab import units
from crescentlab.component import Component, Equations
from crescentlab.domain import gives_signal, held, scheduled, takes_signal
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr, event_where, fmod, initially, stack, when, where
from crescentlab.schedule import Schedule
from crescentlab.tables import Curve, CurveOf

from .interpolation import Beyond, Interpolation, Pieces, on_piece, pieces


class TimeTable(Component):
    r"""Signal tabulated over time, piecewise linear or a spline, held beyond its ends unless told otherwise.

    .. math:: y = y_k + (y_{k+1} - y_k) \frac{t - t_k}{t_{k+1} - t_k}

    t [s]; y in the SI unit of the table's second column. Two points of one time are a jump. Each knot is an exact stop;
    a `spline` is the natural cubic one, y'' = 0 at both ends, and smooth. `beyond` its ends the signal holds the first
    and last value, goes on with the slopes there, or repeats with the period t_n - t_1; a spline that repeats and
    ends where it begins is smooth there too. Not for files of many columns: use `recorded_signal`.
    Source: linear interpolation; Press et al., Numerical Recipes (3rd ed. 2007), section 3.3.
    """

    curve: Annotated[Curve, CurveOf(units.time, None, jumps=True)] = Field(description="value over time")
    interpolation: Interpolation = Field(default="linear", description="straight lines, or a natural cubic spline")
    beyond: Beyond = Field(default="hold", description="beyond both ends: hold the value, its slope, or repeat")

    y = gives_signal("output_quantity", "the value")
    piece = scheduled("present piece: its begin and coefficients", by="schedule", size="piece_size")

    @model_validator(mode="after")
    def _a_spline_does_not_jump(self) -> Self:
        if self.interpolation == "spline" and not (np.diff(self.curve.x) > 0).all():
            raise ValueError(
                "two points of one time are a jump, which a spline cannot make; write interpolation: linear"
            )
        return self

    @property
    def output_quantity(self) -> str:
        """The quantity of the second column."""
        return self.curve.y_quantity

    @property
    def degree(self) -> int:
        """Of the polynomials between the points."""
        return 1 if self.interpolation == "linear" else 3

    @property
    def piece_size(self) -> int:
        """Begin and coefficients."""
        return self.degree + 2

    def schedule(self, start: float, stop: float) -> Schedule:
        """The pieces, from when on each of them holds."""
        x, y = self.curve.x, np.array(self.curve.y)
        return pieces(x, y, self.interpolation, self.beyond, (start, stop)).schedule()

    def remarks(self, stop: float, fluid: Fluid | None = None) -> list[str]:
        """What `check` says of a run until ``stop`` [s]."""
        return extended("the table", self.curve.x, self.beyond, stop)

    def equations(self, t: Expr, piece: Any = None) -> Equations:
        if piece is None:  # a number's own piece
            schedule = self.schedule(float(t), float(t))
            piece = schedule.rows[schedule.at(float(t))]
        return {"y": on_piece(t, piece, 0, self.degree)}


def extended(what: str, times: Any, beyond: Beyond, stop: float) -> list[str]:
    """What is said of a table over time that goes on with the slopes at its ends during a run until ``stop`` [s]."""
    said = []
    if beyond == "slope" and times[0] > 0:
        said.append(f"{what} begins at {times[0]:g} s: before, the signal has the slope of its first piece")
    if beyond == "slope" and times[-1] < stop:
        said.append(
            f"{what} ends at {times[-1]:g} s, the run at {stop:g} s: it goes on with the slope of its last piece"
        )
    return [f"{each} (beyond: slope); write beyond: hold to keep the value" for each in said]


class Table(Component):
    r"""Tabulated function of a signal, piecewise linear or a spline, continued with the end slopes by default.

    .. math:: y = y_k + (y_{k+1} - y_k) \frac{u - u_k}{u_{k+1} - u_k}

    u [any], y [any], in the SI units of the table's first and second column. Each knot of straight lines is an event; a
    `spline` is the natural cubic one, y'' = 0 at both ends, and smooth; it may overshoot between points. `beyond` its
    ends the table goes on with the slopes there, holds the first and last value, or repeats with the period
    P = u_n - u_1: a held number of turns n, y = f(u - n P), moves on by an event; a spline that repeats and ends where
    it begins is smooth there too. Not for functions of time: use `time_table`.
    Source: linear interpolation; Press et al., Numerical Recipes (3rd ed. 2007), section 3.3.
    """

    curve: Annotated[Curve, CurveOf()] = Field(description="output over input")
    interpolation: Interpolation = Field(default="linear", description="straight lines, or a natural cubic spline")
    beyond: Beyond = Field(default="slope", description="beyond both ends: go on with the slope, hold, or repeat")

    u = takes_signal("input_quantity", "input")
    y = gives_signal("output_quantity", "the tabulated value")
    turns = held(units.ratio, "periods passed, where the table repeats", size="counters", counts=True)
    begun = held(units.ratio, "1 once the turns at the start are known", size="counters")

    @property
    def input_quantity(self) -> str:
        """The quantity of the first column."""
        return self.curve.x_quantity

    @property
    def output_quantity(self) -> str:
        """The quantity of the second column."""
        return self.curve.y_quantity

    @property
    def counters(self) -> int:
        """Whether there are periods to count."""
        return int(self.beyond == "repeat")

    def _pieces(self, beyond: Beyond) -> Pieces:
        x = self.curve.x
        return pieces(x, np.array(self.curve.y), self.interpolation, beyond, (x[0], x[0]))

    def equations(self, u: Expr, turns: Any = None, begun: Any = None) -> Equations:
        first, last = self.curve.x[0], self.curve.x[-1]
        lines = self.interpolation == "linear"
        if self.beyond == "repeat":
            period = last - first
            passed = u - first - fmod(u - first, period)
            whole = where(u < first, passed - period, passed) / period
            if turns is None or begun is None:  # a number's own turns
                turns, begun = np.array([whole]), np.ones(1)
            here = u - turns[0] * period
            return {
                "y": self._pieces("repeat")(here, flag_knots=lines),
                "begins": initially(begun[0] == 0, turns=stack(whole), begun=stack(1.0)),
                "next_period": when((begun[0] > 0) & (here > last), turns=turns + 1),
                "period_before": when((begun[0] > 0) & (here < first), turns=turns - 1),
            }
        if self.beyond == "hold":
            u = event_where(u > last, last, event_where(u > first, u, first))
        return {"y": self.curve(u) if lines else self._pieces("slope")(u, flag_knots=False)}
