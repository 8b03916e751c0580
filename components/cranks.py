"""Parts between a rotating shaft and a motion along a line: cranks, eccentrics, swash plates, racks. All ideal."""

from typing import Any, ClassVar, Self

from pydantic import Field, model_validator

from crescentlab.component import Component, Equations
from crescentlab.domain import gives_motion, takes_rotation
from crescentlab.maths import Expr, cos, pi, sin, sqrt, tan
from crescentlab.units import Angle, Length


def _driven(omega: Any, x: Any, slope: Any, force: Any) -> Equations:
    """Motion of a rod that follows the shaft with dx/dphi = `slope`, and the torque that the rod's force asks for."""
    return {"x_rod": x, "v_rod": slope * omega, "torque_shaft": -slope * force}


class Crank(Component):
    r"""Slider crank: a shaft moves a piston through a crank and a connecting rod.

    .. math:: x = r (1 - \cos\alpha) + l (1 - c), \quad c = \sqrt{1 - (r/l)^2 \sin^2\alpha}, \quad
              \alpha = \varphi - \varphi_0

    .. math:: v = \omega \frac{dx}{d\alpha}, \quad T + f \frac{dx}{d\alpha} = 0, \quad
              \frac{dx}{d\alpha} = r \sin\alpha \left(1 + \frac{r \cos\alpha}{l\, c}\right)

    x [m] from 0 where crank and rod are in line and the piston is farthest from the shaft, to 2 r; \varphi [rad],
    \omega [rad/s] of the shaft; f, T [N, N m] on the crank; r = `radius`, l = `rod_length` [m]; \varphi_0 =
    `start_angle` [rad] of the shaft where x = 0. No power is lost. Not for the masses of rod and piston, nor for an
    offset cylinder. Source: geometry; Dubbel, Taschenbuch fuer den Maschinenbau, section P 1 (crank mechanism).
    """

    lossless: ClassVar[bool] = True

    radius: Length = Field(gt=0, description="radius of the crank")
    rod_length: Length = Field(gt=0, description="length of the connecting rod, more than the radius")
    start_angle: Angle = Field(default=0.0, description="angle of the shaft where x = 0")

    shaft = takes_rotation("the crankshaft")
    rod = gives_motion("the piston")

    @model_validator(mode="after")
    def _rod_is_longer(self) -> Self:
        if self.rod_length <= self.radius:
            raise ValueError(
                f"rod_length ({self.rod_length * 1e3:g} mm) must exceed radius ({self.radius * 1e3:g} mm), "
                "or the crank cannot turn"
            )
        return self

    def equations(self, phi_shaft: Expr, omega_shaft: Expr, f_rod: Expr) -> Equations:
        angle, slender = phi_shaft - self.start_angle, self.radius / self.rod_length
        sine, cosine = sin(angle), cos(angle)
        tilt = sqrt(1 - slender * slender * sine * sine)
        x = self.radius * (1 - cosine) + self.rod_length * (1 - tilt)
        slope = self.radius * sine * (1 + slender * cosine / tilt)
        return _driven(omega_shaft, x, slope, f_rod)


class Eccentric(Component):
    r"""Eccentric, scotch yoke or round cam: a purely harmonic stroke, as in radial piston machines.

    .. math:: x = e (1 - \cos\alpha), \quad v = \omega e \sin\alpha, \quad T + f e \sin\alpha = 0, \quad
              \alpha = \varphi - \varphi_0

    x [m] from 0 to 2 e; \varphi [rad], \omega [rad/s] of the shaft; f, T [N, N m] on the eccentric; e =
    `eccentricity` [m]; \varphi_0 = `start_angle` [rad] of the shaft where x = 0. No power is lost; it pulls as well as
    it pushes. Not for a finite connecting rod (`crank`). Source: geometry; J. Ivantysyn, M. Ivantysynova,
    Hydrostatic Pumps and Motors (2001), radial piston machines.
    """

    lossless: ClassVar[bool] = True

    eccentricity: Length = Field(gt=0, description="half the stroke")
    start_angle: Angle = Field(default=0.0, description="angle of the shaft where x = 0")

    shaft = takes_rotation("the shaft")
    rod = gives_motion("the piston")

    def equations(self, phi_shaft: Expr, omega_shaft: Expr, f_rod: Expr) -> Equations:
        angle = phi_shaft - self.start_angle
        slope = self.eccentricity * sin(angle)
        return _driven(omega_shaft, self.eccentricity * (1 - cos(angle)), slope, f_rod)


class SwashPlate(Component):
    r"""Swash plate: the inclined plane that strokes one piston of a rotating barrel.

    .. math:: x = R \tan\beta\, (1 - \cos\alpha), \quad v = \omega R \tan\beta \sin\alpha, \quad
              T + f R \tan\beta \sin\alpha = 0, \quad \alpha = \varphi - \varphi_0

    x [m] of the piston into its bore, 0 at its outer dead centre, 2 R tan\beta at the inner one; \varphi [rad], \omega
    [rad/s] of the barrel; f, T [N, N m] on the plate and barrel; R = `pitch_radius` [m]; \beta = `swash_angle` [rad];
    \varphi_0 = `start_angle` [rad] of the barrel where x = 0. No power is lost. For all pistons at once with their
    chambers: `swash_plate_barrel`. Not for bent-axis machines. Source: J. Ivantysyn, M. Ivantysynova, Hydrostatic
    Pumps and Motors (2001), kinematics of swash plate machines.
    """

    lossless: ClassVar[bool] = True

    pitch_radius: Length = Field(gt=0, description="radius of the circle on which the pistons lie")
    swash_angle: Angle = Field(gt=0, lt=pi / 2, description="inclination of the plate")
    start_angle: Angle = Field(default=0.0, description="angle of the barrel where x = 0")

    shaft = takes_rotation("the barrel")
    rod = gives_motion("the piston")

    def equations(self, phi_shaft: Expr, omega_shaft: Expr, f_rod: Expr) -> Equations:
        angle, half_stroke = phi_shaft - self.start_angle, self.pitch_radius * tan(self.swash_angle)
        return _driven(omega_shaft, half_stroke * (1 - cos(angle)), half_stroke * sin(angle), f_rod)


class RackAndPinion(Component):
    r"""Pinion on a rack, a winch or a belt pulley: a shaft moves a part along a line in proportion.

    .. math:: x = R \varphi, \quad v = R \omega, \quad T + R f = 0

    x [m] of the rack, 0 at the angle 0; \varphi [rad], \omega [rad/s] of the shaft; f, T [N, N m] on the pinion; R =
    `radius` [m], for a screw of lead h it is h/(2 \pi). No power is lost. Not for play. Source: rolling.
    """

    lossless: ClassVar[bool] = True

    radius: Length = Field(gt=0, description="radius of the pinion's pitch circle")

    shaft = takes_rotation("the pinion")
    rod = gives_motion("the rack")

    def equations(self, phi_shaft: Expr, omega_shaft: Expr, f_rod: Expr) -> Equations:
        return _driven(omega_shaft, self.radius * phi_shaft, self.radius, f_rod)
