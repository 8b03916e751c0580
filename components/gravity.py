"""Weight."""

import math

from pydantic import Field

from crescentlab.component import Component, Equations
from crescentlab.domain import stores_energy, takes_motion
from crescentlab.maths import Expr, sin
from crescentlab.units import Acceleration, Angle, Mass

from .reservoirs import GRAVITY


class GravityForce(Component):
    r"""Weight of a mass that moves up or down, straight or along a slope.

    .. math:: F = m g \sin\alpha, \quad E = m g x \sin\alpha

    F [N] on the rod's mass, towards -x; m = `mass` [kg] that is lifted, whose inertia is that of the mass on the rod; g
    = `gravity` [m/s^2]; \alpha = `angle` [rad] by which +x rises above the horizontal: 90 deg for a cylinder that
    lifts as x grows, -90 deg for one that lowers; x [m]. Energy: E [J], 0 at x = 0; nothing is lost. Not for a
    pendulum, whose slope changes with its position. Source: Newton's law of weight; potential energy of a uniform
    field.
    """

    mass: Mass = Field(gt=0, description="mass that is lifted")
    angle: Angle = Field(
        default=math.pi / 2, ge=-math.pi / 2, le=math.pi / 2, description="rise of +x above the horizontal"
    )
    gravity: Acceleration = Field(default=GRAVITY, gt=0, description="acceleration of free fall")

    rod = takes_motion("the mass that is lifted")
    stored_energy = stores_energy("potential energy, 0 at x = 0")

    def equations(self, x_rod: Expr) -> Equations:
        weight = self.mass * self.gravity * sin(self.angle)
        return {"f_rod": weight, "stored_energy": weight * x_rod}
