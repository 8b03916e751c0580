"""Levers: rigid and without mass, they change forces and motions and pass on all power. Small angles only."""

from typing import ClassVar

from pydantic import Field

from crescentlab.component import Component, Equations
from crescentlab.domain import gives_motion, takes_motion
from crescentlab.maths import Expr
from crescentlab.units import Length, Ratio


class Lever(Component):
    r"""Lever on a fixed pivot; its end b moves as end a makes it.

    .. math:: x_b = i\, x_a, \quad v_b = i\, v_a, \quad f_a + i f_b = 0, \quad i = \mp \frac{l_b}{l_a}

    x [m], v [m/s]; f [N] on the lever; l = `arm_a`, `arm_b` [m] from the pivot to the ends; i is negative with the
    pivot between the ends, positive with both on one side (`pivot_at_end`). No power is lost:
    f_a v_a + f_b v_b = 0. End a belongs to a mass or a source of motion; end b gives the motion to what hangs on it.
    Not for large angles, nor for a mass on either side of one lever: put a spring between.
    Source: law of the lever (Archimedes).
    """

    lossless: ClassVar[bool] = True

    arm_a: Length = Field(gt=0, description="from the pivot to end a")
    arm_b: Length = Field(gt=0, description="from the pivot to end b")
    pivot_at_end: bool = Field(default=False, description="whether both ends lie on one side of the pivot")

    a = takes_motion("end moved by a mass or a source")
    b = gives_motion("end that moves what hangs on it")

    def equations(self, x_a: Expr, v_a: Expr, f_b: Expr) -> Equations:
        ratio = self.arm_b / self.arm_a * (1.0 if self.pivot_at_end else -1.0)
        return {"x_b": ratio * x_a, "v_b": ratio * v_a, "f_a": -ratio * f_b}


class FloatingLever(Component):
    r"""Lever without a pivot: its point c lies on the line between two moving ends, as in mechanical feedback.

    .. math:: x_c = (1 - s) x_a + s x_b, \quad f_a + (1 - s) f_c = 0, \quad f_b + s f_c = 0

    x [m]; f [N] on the lever; s = `share` [-], distance a to c over distance a to b, above 1 or below 0 where c lies
    outside. No power is lost. Not for large angles.
    Source: balance of forces and moments on a beam without mass.
    """

    lossless: ClassVar[bool] = True

    share: Ratio = Field(default=0.5, description="where c lies between a (0) and b (1)")

    a = takes_motion("first end")
    b = takes_motion("second end")
    c = gives_motion("the point between")

    def equations(self, x_a: Expr, x_b: Expr, v_a: Expr, v_b: Expr, f_c: Expr) -> Equations:
        rest = 1 - self.share
        return {
            "x_c": rest * x_a + self.share * x_b,
            "v_c": rest * v_a + self.share * v_b,
            "f_a": -rest * f_c,
            "f_b": -self.share * f_c,
        }
