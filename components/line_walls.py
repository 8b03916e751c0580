"""What an elastic wall adds to the softness of the fluid in a line, for all line types. No components here."""

from typing import Any, Literal, Self

from pydantic import BaseModel, Field, model_validator

from crescentlab.fluid import Fluid
from crescentlab.maths import Expr, pi, sqrt
from crescentlab.units import Length, Pressure, Ratio


class LineWall(BaseModel):
    r"""Elastic wall of a round line: its area grows with the pressure, which slows the waves.

    .. math:: A(p) = A (1 + C p), \quad C = \frac{d}{e E}\left[\frac{2 e}{d}(1 + \mu) + \frac{c\,d}{d + e}\right],
              \qquad a = \left[\rho \left(\frac{1 + C p}{\beta} + C\right)\right]^{-1/2}

    d = `diameter`, e = `wall_thickness` [m]; E = `youngs_modulus` [Pa]; \mu = `poisson_ratio` [-]; c [-] = 1 between
    expansion joints, 1 - \mu^2 anchored throughout, 1 - \mu/2 anchored upstream only; p [Pa] gauge; a [m/s].
    Without both, the wall is rigid. Not for walls that creep or are of layers, such as hoses, other than by
    the modulus measured on them. Source: Wylie & Streeter, Fluid Transients in Systems (1993), section 3-4, thick wall;
    with expansion joints it is Lame's cylinder under inner pressure.
    """

    wall_thickness: Length | None = Field(default=None, gt=0, description="thickness of the wall; none is rigid")
    youngs_modulus: Pressure | None = Field(default=None, gt=0, description="Young's modulus of the wall")
    poisson_ratio: Ratio = Field(default=0.3, ge=0, le=0.5, description="Poisson's ratio of the wall")
    anchoring: Literal["expansion_joints", "throughout", "upstream"] = Field(
        default="expansion_joints", description="where the line is held against stretching"
    )

    @model_validator(mode="after")
    def _wall_is_whole(self) -> Self:
        if (self.wall_thickness is None) != (self.youngs_modulus is None):
            missing = "youngs_modulus" if self.youngs_modulus is None else "wall_thickness"
            raise ValueError(f"an elastic wall needs wall_thickness and youngs_modulus; {missing} is missing")
        return self

    def wall_compliance(self, diameter: Any) -> Any:
        r"""C = d ln A/dp [1/Pa]; 0 for a rigid wall."""
        e, modulus, mu = self.wall_thickness, self.youngs_modulus, self.poisson_ratio
        if e is None or modulus is None:
            return 0.0
        held = {"expansion_joints": 1.0, "throughout": 1 - mu * mu, "upstream": 1 - mu / 2}[self.anchoring]
        return diameter / (e * modulus) * (2 * e / diameter * (1 + mu) + held * diameter / (diameter + e))

    def swelling(self, p: Expr, diameter: Any) -> Any:
        """A(p)/A [-]."""
        return 1 + self.wall_compliance(diameter) * p

    def softness(self, p: Expr, diameter: Any, fluid: Fluid) -> Any:
        r"""(1 + C p)/\beta + C [1/Pa]: of fluid and wall together."""
        compliance = self.wall_compliance(diameter)
        return (1 + compliance * p) / fluid.bulk_modulus(p) + compliance

    def energy_density(self, p: Expr, diameter: Any, fluid: Fluid) -> Any:
        r"""(1 + C p) e(p) + C p^2/2 [J/m^3]: energy of fluid and wall together, over the volume of the bore at rest."""
        return self.swelling(p, diameter) * fluid.energy_density(p) + self.wall_compliance(diameter) * p * p / 2

    def wave_speed(self, p: Expr, diameter: Any, fluid: Fluid) -> Any:
        """a [m/s]."""
        return 1 / sqrt(fluid.density(p) * self.softness(p, diameter, fluid))

    def shunt(self, omega: Any, p: float, diameter: float, fluid: Fluid) -> Any:
        r"""Shunt admittance j\omega A (\rho/\rho_0) ((1 + C p)/\beta + C) [m^2/(s Pa)] per length."""
        area, at = pi / 4 * diameter * diameter, _plain(p)
        soft = float(fluid.density(at)) / float(fluid.rho_0) * float(self.softness(at, diameter, fluid))
        return 1j * omega * area * soft


def _plain(p: float) -> Any:
    """A float where a law asks for an expression: laws work on both."""
    return p
