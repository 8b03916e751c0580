"""Laws of oils: density, bulk modulus and viscosity as functions of the gauge pressure. No circuit elements here.

A law and its parameter may not share a Python name, so the parameters `density`, `kinematic_viscosity` and
`bulk_modulus` of a circuit file are aliases of the fields `liquid_density`, `viscosity` and `liquid_modulus`.
"""

from typing import Self

from pydantic import Field, model_validator

from crescentlab.fluid import Fluid
from crescentlab.maths import Expr, exp
from crescentlab.units import Density, KinematicViscosity, Pressure, Ratio

from .fluid_laws import (
    Law,
    absolute_pressure,
    exponential_liquid,
    free_air,
    integrated_exponential_liquid,
    integrated_free_air,
)


def saturated_too_early(saturation_pressure: float, atmospheric_pressure: float) -> str:
    """What is wrong with a saturation pressure [Pa] that was meant as a gauge pressure."""
    return (
        f"saturation_pressure ({saturation_pressure / 1e5:g} bar) is absolute and must exceed the "
        f"atmospheric pressure ({atmospheric_pressure / 1e5:g} bar); without free air use simple_oil"
    )


class SimpleOil(Fluid):
    r"""Air-free oil of constant bulk modulus and viscosity.

    .. math:: \rho = \rho_0 e^{p/\beta}

    p [Pa] gauge; \rho_0 = `density` [kg/m^3]; \beta = `bulk_modulus` [Pa], which is exactly \rho\,dp/d\rho of
    this law; \nu = `kinematic_viscosity` [m^2/s]. Not for oil with air bubbles, which below some ten bar is much
    softer. Source: the definition of the bulk modulus, beta = rho dp/drho, integrated.
    """

    liquid_density: Density = Field(alias="density", gt=0, description="density at 0 bar gauge")
    viscosity: KinematicViscosity = Field(alias="kinematic_viscosity", gt=0, description="kinematic viscosity")
    liquid_modulus: Pressure = Field(alias="bulk_modulus", gt=0, description="bulk modulus")

    def density(self, p: Expr) -> Expr:
        """rho(p) [kg/m^3]."""
        rho: Expr = self.liquid_density * exp(p / self.liquid_modulus)
        return rho

    def bulk_modulus(self, p: Expr) -> Expr:
        """beta(p) = rho dp/drho [Pa]."""
        return self.liquid_modulus + 0.0 * p

    def kinematic_viscosity(self, p: Expr) -> Expr:
        """nu(p) [m^2/s]."""
        return self.viscosity + 0.0 * p

    def enthalpy(self, p: Expr) -> Expr:
        """w(p) [J/kg], the integral of dp/rho from 0 bar gauge."""
        w: Expr = integrated_exponential_liquid(p, self.liquid_modulus) / self.liquid_density
        return w


class AeratedOil(Fluid):
    r"""Oil with free and dissolved air in equilibrium (Henry's law, instantaneous dissolution).

    .. math:: \frac{\rho_l}{\rho(p)} = e^{-p/\beta_l}
                + \frac{\alpha}{1-\alpha}\, x(P) \left(\frac{P_{atm}}{P}\right)^{1/n},
              \quad x = \frac{P_{sat} - P}{P_{sat} - P_{atm}},
              \quad \beta = \rho\,\frac{dp}{d\rho}

    p [Pa] gauge, P = p + P_atm [Pa] absolute; \rho_l = `density` [kg/m^3] of the air-free liquid at 0 bar gauge,
    so \rho(0) = (1 - \alpha)\rho_l; \beta_l = `bulk_modulus` [Pa] of the liquid; \alpha = `air_fraction` [-], gas
    volume over total volume at atmospheric pressure; x [-] share of the air that is free, relative to P_atm;
    n = `polytropic_index` [-]; \nu = `kinematic_viscosity` [m^2/s], constant. The mass of the air is neglected.

    Rounded where the bare law has an edge, \beta staying exactly \rho\,dp/d\rho of the rounded law:
    P is replaced by (P + sqrt(P^2 + 4 P_min^2))/2 > 0, so that every pressure an integrator tries is finite and
    \rho rises with p (relative change (P_min/P)^2); over the last `dissolution_rounding` of the way from P_atm to
    P_sat, x turns into a cubic that meets zero with zero slope. From P_sat on the oil is the pure liquid.

    Not for slow air release, foam or vapour (`cavitating_oil`). Source: Rundo & Corvaglia (2016), section 6.3 and Fig.
    20, from Henry's law and the polytropic law p v^n = const. for the free air.
    """

    liquid_density: Density = Field(alias="density", gt=0, description="density of the air-free liquid at 0 bar gauge")
    viscosity: KinematicViscosity = Field(alias="kinematic_viscosity", gt=0, description="kinematic viscosity")
    liquid_modulus: Pressure = Field(alias="bulk_modulus", gt=0, description="bulk modulus of the air-free liquid")
    air_fraction: Ratio = Field(ge=0, lt=1, description="gas volume over total volume at atmospheric pressure")
    saturation_pressure: Pressure = Field(gt=0, description="absolute pressure at which all air is dissolved")
    polytropic_index: Ratio = Field(default=1.4, ge=1, description="polytropic index of the free air")
    minimum_pressure: Pressure = Field(default=100.0, gt=0, description="rounding of the absolute pressure near zero")
    dissolution_rounding: Ratio = Field(default=0.01, gt=0, lt=0.5, description="share of the way to saturation")

    @model_validator(mode="after")
    def _saturates_above_atmosphere(self) -> Self:
        if self.saturation_pressure <= self.atmospheric_pressure:
            raise ValueError(saturated_too_early(self.saturation_pressure, self.atmospheric_pressure))
        return self

    def density(self, p: Expr) -> Expr:
        """rho(p) [kg/m^3]."""
        rho: Expr = self.liquid_density / self._specific_volume(p)[0]
        return rho

    def bulk_modulus(self, p: Expr) -> Expr:
        """beta(p) = rho dp/drho [Pa]."""
        volume, slope = self._specific_volume(p)
        beta: Expr = -volume / slope
        return beta

    def kinematic_viscosity(self, p: Expr) -> Expr:
        """nu(p) [m^2/s]."""
        return self.viscosity + 0.0 * p

    def enthalpy(self, p: Expr) -> Expr:
        """w(p) [J/kg], the integral of dp/rho from 0 bar gauge."""
        absolute, _ = absolute_pressure(p, self.atmospheric_pressure, self.minimum_pressure)
        air = integrated_free_air(
            absolute, self.air_fraction, self.atmospheric_pressure, self.saturation_pressure, self.polytropic_index,
            self.dissolution_rounding, self.minimum_pressure,
        )  # fmt: skip
        w: Expr = (integrated_exponential_liquid(p, self.liquid_modulus) + air) / self.liquid_density
        return w

    def _specific_volume(self, p: Expr) -> Law:
        """rho_l/rho [-] and its derivative with respect to p [1/Pa]."""
        volume, slope = exponential_liquid(p, self.liquid_modulus)
        air, air_slope = free_air(
            absolute_pressure(p, self.atmospheric_pressure, self.minimum_pressure), self.air_fraction,
            self.atmospheric_pressure, self.saturation_pressure, self.polytropic_index, self.dissolution_rounding,
        )  # fmt: skip
        return volume + air, slope + air_slope
