"""What every fluid offers to equations; the laws themselves live in the component library."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from crescentlab.errors import ComponentError
from crescentlab.maths import Expr, asinh, cosh, gauss_legendre, sinh
from crescentlab.units import Pressure

P_ATM = 101325.0
"""Standard atmosphere [Pa]: gauge pressure + P_ATM is absolute pressure."""
HIGHEST_PRESSURE = 1000e5
"""Highest gauge pressure [Pa] of a law that says nothing else: docs/fluids.md, its range."""


class Fluid(BaseModel):
    """Laws of one fluid at its circuit temperature. Pressures are gauge [Pa].

    A subclass writes :meth:`density` and :meth:`bulk_modulus` so that beta = rho d(rho)^-1 dp holds
    for its own density law, and :meth:`kinematic_viscosity`; all of them are pure functions that
    work on floats and symbols alike. A density with edges needs an :meth:`enthalpy` of its own too.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, validate_default=True)

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        inherited = next(base for base in cls.__mro__ if "enthalpy" in vars(base))
        if "density" in vars(cls) and inherited not in (cls, Fluid):
            raise ComponentError(
                f"fluid {cls.__name__}: has a density of its own and the enthalpy of {inherited.__name__}, so that "
                "energy would not be kept; write enthalpy too, or `enthalpy = Fluid.enthalpy` for a smooth density"
            )

    tension: bool = Field(
        default=False, description="true: pressures below absolute zero warn instead of ending the run"
    )
    atmospheric_pressure: Pressure = Field(default=P_ATM, gt=0, description="absolute pressure at 0 bar gauge")
    highest_pressure: Pressure = Field(
        default=HIGHEST_PRESSURE, gt=0, description="gauge pressure up to which its law is meant; beyond, a run warns"
    )

    def remarks(self) -> list[str]:
        """Sentences on numbers for which its laws are not meant; `check` and runs warn of them."""
        return []

    def density(self, p: Expr) -> Expr:
        """rho(p) [kg/m^3]."""
        raise NotImplementedError

    def bulk_modulus(self, p: Expr) -> Expr:
        """beta(p) = rho dp/drho [Pa]."""
        raise NotImplementedError

    def kinematic_viscosity(self, p: Expr) -> Expr:
        """nu(p) [m^2/s]."""
        raise NotImplementedError

    @property
    def cavity_pressure(self) -> Any:
        """Pressure [Pa, gauge] at which it evaporates; None for a fluid without vapour."""
        return None

    def dynamic_viscosity(self, p: Expr) -> Expr:
        """mu(p) = rho nu [Pa s]."""
        return self.density(p) * self.kinematic_viscosity(p)

    def enthalpy(self, p: Expr) -> Expr:
        r"""Specific enthalpy of barotropic flow over that at 0 bar gauge [J/kg].

        .. math:: w(p) = \int_0^p \frac{dp'}{\rho(p')}

        p [Pa] gauge, \rho [kg/m^3] = :meth:`density`. A mass flow \dot m carries the power \dot m\,w(p). Here by 24
        Gauss-Legendre nodes over asinh(p/P_ATM), P_ATM = `atmospheric_pressure` [Pa]: to 1e-9 up to 1000 bar where the
        density is a smooth function of p, be it a liquid's or a gas's. Not for one with edges, nor near or below
        absolute zero where it has a pole or a rounding there: such a fluid overrides this with its own integral.
        Source: Landau & Lifshitz, Fluid Mechanics, 2nd ed., sections 2 (dw = dp/rho at constant entropy) and 6.
        """
        scale = self.atmospheric_pressure
        w: Expr = gauss_legendre(lambda u: scale * cosh(u) / self.density(scale * sinh(u)), 0.0, asinh(p / scale))
        return w

    def energy_density(self, p: Expr) -> Expr:
        r"""Energy that a volume of fluid stores by its pressure, over that volume [J/m^3]; 0 at 0 bar gauge.

        .. math:: e(p) = \rho w - p, \quad \frac{de}{dp} = w \frac{d\rho}{dp}

        p [Pa] gauge, \rho [kg/m^3] = :meth:`density`, w [J/kg] = :meth:`enthalpy`. In a volume V [m^3] with the mass
        m = \rho V [kg] it is E = e V [J], and dE = w dm - p dV exactly: what the fluid brings in less the work done
        against the atmosphere. Never negative, p^2/(2 \beta) at small p, but for rounding: 1e-15 |p|, and 1e-10 Pa with
        air. Source: Landau & Lifshitz, Fluid Mechanics, 2nd ed., section 6: internal energy per mass is w - p/\rho.
        """
        return self.density(p) * self.enthalpy(p) - p

    @property
    def rho_0(self) -> Any:
        """Density at 0 bar gauge [kg/m^3]: flows are mass flow over rho_0."""
        zero: Any = 0.0
        return self.density(zero)
