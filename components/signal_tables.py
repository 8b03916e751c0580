"""Tabulated signals: functions of time and of another signal, straight lines or splines between points."""

from typing import Annotated, Any, Literal

from pydantic import Field

from crescentlab import units
from crescentlab.component import Component, Equations
from crescentlab.domain import gives_signal, takes_signal
from crescentlab.maths import Expr
from crescentlab.tables import Curve, CurveOf

from .interpolation import spline

Interpolation = Literal["linear", "spline"]
"""Straight lines between the points, or a natural cubic spline through them."""


class TimeTable(Component):
    r"""Signal tabulated over time, piecewise linear or a spline, continued with the end slopes.

    .. math:: y = y_k + (y_{k+1} - y_k) \frac{t - t_k}{t_{k+1} - t_k}

    t [s]; y in the SI unit of the table's second column. Each knot of straight lines is an exact stop; a `spline` is
    the natural cubic one, y'' = 0 at both ends, and smooth. Not for jumps: use `step`.
    Source: linear interpolation; Press et al., Numerical Recipes (3rd ed. 2007), section 3.3.
    """

    curve: Annotated[Curve, CurveOf(units.time, None)] = Field(description="value over time")
    interpolation: Interpolation = Field(default="linear", description="straight lines, or a natural cubic spline")

    y = gives_signal("output_quantity", "the value")

    @property
    def output_quantity(self) -> str:
        """The quantity of the second column."""
        return self.curve.y_quantity

    def equations(self, t: Expr) -> Equations:
        return {"y": interpolated(self.curve, self.interpolation, t)}


class Table(Component):
    r"""Tabulated function of a signal, piecewise linear or a spline, continued with the end slopes.

    .. math:: y = y_k + (y_{k+1} - y_k) \frac{u - u_k}{u_{k+1} - u_k}

    u [any], y [any], in the SI units of the table's first and second column. Each knot of straight lines is an event; a
    `spline` is the natural cubic one, y'' = 0 at both ends, and smooth; it may overshoot between points. Not for
    functions of time: use `time_table`.
    Source: linear interpolation; Press et al., Numerical Recipes (3rd ed. 2007), section 3.3.
    """

    curve: Annotated[Curve, CurveOf()] = Field(description="output over input")
    interpolation: Interpolation = Field(default="linear", description="straight lines, or a natural cubic spline")

    u = takes_signal("input_quantity", "input")
    y = gives_signal("output_quantity", "the tabulated value")

    @property
    def input_quantity(self) -> str:
        """The quantity of the first column."""
        return self.curve.x_quantity

    @property
    def output_quantity(self) -> str:
        """The quantity of the second column."""
        return self.curve.y_quantity

    def equations(self, u: Expr) -> Equations:
        return {"y": interpolated(self.curve, self.interpolation, u)}


def interpolated(curve: Curve, interpolation: Interpolation, x: Any) -> Any:
    """The curve at x."""
    return spline(x, curve.x, curve.y) if interpolation == "spline" else curve(x)
