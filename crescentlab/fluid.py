"""What every fluid offers to equations; the laws themselves live in the component library."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from crescentlab.maths import Expr
from crescentlab.units import Pressure

P_ATM = 101325.0
"""Standard atmosphere [Pa]: gauge pressure + P_ATM is absolute pressure."""


class Fluid(BaseModel):
    """Laws of one fluid at its circuit temperature. Pressures are gauge [Pa].

    A subclass writes :meth:`density` and :meth:`bulk_modulus` so that beta = rho d(rho)^-1 dp holds
    for its own density law, and :meth:`kinematic_viscosity`; all of them are pure functions that
    work on floats and symbols alike.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, validate_default=True)

    tension: bool = Field(
        default=False, description="true: pressures below absolute zero warn instead of ending the run"
    )
    atmospheric_pressure: Pressure = Field(default=P_ATM, gt=0, description="absolute pressure at 0 bar gauge")

    def density(self, p: Expr) -> Expr:
        """rho(p) [kg/m^3]."""
        raise NotImplementedError

    def bulk_modulus(self, p: Expr) -> Expr:
        """beta(p) = rho dp/drho [Pa]."""
        raise NotImplementedError

    def kinematic_viscosity(self, p: Expr) -> Expr:
        """nu(p) [m^2/s]."""
        raise NotImplementedError

    def dynamic_viscosity(self, p: Expr) -> Expr:
        """mu(p) = rho nu [Pa s]."""
        return self.density(p) * self.kinematic_viscosity(p)

    @property
    def rho_0(self) -> Any:
        """Density at 0 bar gauge [kg/m^3]: flows are mass flow over rho_0."""
        zero: Any = 0.0
        return self.density(zero)
