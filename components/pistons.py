"""Pistons that shape a chamber: motion on one side, the volume of a `variable_capacity` on the other."""

from typing import ClassVar, Literal

from pydantic import Field

from crescentlab.component import Component, Equations
from crescentlab.domain import gives_chamber, observable, takes_motion
from crescentlab.maths import Expr, fail_when, maximum, pi
from crescentlab.units import Length, Volume

SMALLEST_SHARE = 1e-3
"""Share of the dead volume that a used-up chamber keeps, so that what divides by it stays finite."""


class PistonChamber(Component):
    r"""Piston that shapes a chamber with a pressure of its own; join the chamber to a `variable_capacity`.

    .. math:: V = V_0 \pm A x, \quad \dot V = \pm A v, \quad F = \pm p A, \quad A = \tfrac{\pi}{4} (d^2 - d_r^2)

    V [m^3] volume of the chamber; V_0 = `dead_volume` [m^3] at x = 0; x [m], v [m/s] of the rod; p [Pa, gauge] of
    the chamber; F [N] on the rod, + where the pressure `pushes_up`, towards increasing x (the net's force on the
    piston is -F); d, d_r [m] diameters of piston and rod. The run ends when the stroke uses the chamber up. No
    power is lost or stored. Not for the leakage past the piston: join a gap between the nets.
    Source: geometry; H. E. Merritt, Hydraulic Control Systems (1967), chapter 6.
    """

    lossless: ClassVar[bool] = True

    diameter: Length = Field(gt=0, description="diameter of the piston")
    rod_diameter: Length = Field(default=0.0, ge=0, description="diameter of a rod on the side of the chamber")
    dead_volume: Volume = Field(gt=0, description="volume of the chamber at x = 0")
    side: Literal["pushes_up", "pushes_down"] = Field(
        default="pushes_up", description="direction in which the pressure moves the rod"
    )

    rod = takes_motion("the piston")
    chamber = gives_chamber("what the piston shapes")
    left = observable(Volume, "volume of the chamber, negative once it would be used up")

    def equations(self, x_rod: Expr, v_rod: Expr, p_chamber: Expr) -> Equations:
        sign = 1.0 if self.side == "pushes_up" else -1.0
        area = pi / 4 * (self.diameter * self.diameter - self.rod_diameter * self.rod_diameter)
        volume = self.dead_volume + sign * area * x_rod
        return {
            "f_rod": -sign * area * p_chamber,
            "V_chamber": maximum(volume, SMALLEST_SHARE * self.dead_volume),
            "dV_chamber": sign * area * v_rod,
            "left": volume,
            "used_up": fail_when(
                volume < SMALLEST_SHARE * self.dead_volume,
                "the stroke has used up the chamber; raise dead_volume or stop the piston earlier",
            ),
        }
