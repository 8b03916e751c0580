"""Fluids that evaporate: oils by their numbers, mineral oils by their grade, and water, at a temperature.

Liquid, vapour around the vapour pressure, and air, in one law of density and bulk modulus.
"""

from typing import Any, Literal, Self

from pydantic import Field, model_validator

from crescentlab.fluid import Fluid
from crescentlab.maths import Expr, exp, log, sqrt
from crescentlab.units import Density, KinematicViscosity, Pressure, PressureCoefficient, Ratio, Temperature

from .fluid_laws import (
    Law,
    absolute_pressure,
    evaporating,
    exponential_density,
    free_air,
    integrated_evaporating,
    integrated_exponential_liquid,
    integrated_free_air,
    integrated_secant_liquid,
    secant_density,
)
from .fluids import SimpleOil, saturated_too_early
from .oil_grades import GRADES
from .viscosity_laws import CST, barus_factor, walther_viscosity, wooster_coefficient

ZERO_CELSIUS = 273.15
COLDEST, HOTTEST = ZERO_CELSIUS - 50, ZERO_CELSIUS + 150
"""Temperatures [K] between which API MPMS 11.1 gives the density of oils: -58 to 302 degF."""
THINNEST = 2e-6
"""Viscosity [m^2/s] from which on ASTM D341 draws a straight line; thinner oils need its further terms."""
GAS_CONSTANT_OF_STEAM = 461.526
"""Specific gas constant of water [J/(kg K)]."""


class _Evaporating(Fluid):
    r"""Base of fluids that evaporate: says how liquid, vapour and air share the volume; subclasses say the liquid.

    \rho_l/\rho is the relative volume of the condensable part, :func:`evaporating`, and of the free air beside it,
    :func:`free_air`.
    """

    air_fraction: Ratio = Field(default=0.0, ge=0, lt=1, description="gas volume over total volume at the atmosphere")
    saturation_pressure: Pressure = Field(
        default=1000e5, gt=0, description="absolute pressure at which all air is dissolved"
    )
    polytropic_index: Ratio = Field(default=1.4, ge=1, description="polytropic index of the free air")
    vapour_range: Ratio = Field(
        default=0.5, gt=0, lt=1, description="half of the range in which the liquid evaporates, over vapour pressure"
    )
    minimum_pressure: Pressure = Field(default=10.0, gt=0, description="rounding of the absolute pressure near zero")
    dissolution_rounding: Ratio = Field(default=0.01, gt=0, lt=0.5, description="share of the way to saturation")

    def _liquid_density(self) -> Any:
        """rho_l [kg/m^3] of the air-free liquid at 0 bar gauge."""
        raise NotImplementedError

    def _liquid(self, p: Expr) -> Law:
        """Relative density of the liquid [-] and its derivative [1/Pa]."""
        raise NotImplementedError

    def _integrated_liquid(self, p: Expr) -> Any:
        """Integral of the liquid's relative volume from 0 bar gauge [Pa]."""
        raise NotImplementedError

    def _vapour(self) -> tuple[Any, Any]:
        """Vapour pressure [Pa, absolute] and density of the saturated vapour [kg/m^3]."""
        raise NotImplementedError

    @model_validator(mode="after")
    def _evaporates_below_the_atmosphere(self) -> Self:
        if self.saturation_pressure <= self.atmospheric_pressure:
            raise ValueError(saturated_too_early(self.saturation_pressure, self.atmospheric_pressure))
        pressure = float(self._vapour()[0])
        if not 0 < pressure * (1 + self.vapour_range) < self.atmospheric_pressure:
            raise ValueError(
                f"the fluid would be vapour at 0 bar gauge: vapour pressure ({pressure / 1e5:.4g} bar absolute) times "
                f"(1 + vapour_range) must lie below {self.atmospheric_pressure / 1e5:g} bar; lower one of them"
            )
        return self

    @property
    def cavity_pressure(self) -> Any:
        """Pressure [Pa, gauge] at which it evaporates."""
        return self._vapour()[0] - self.atmospheric_pressure

    def density(self, p: Expr) -> Expr:
        """rho(p) [kg/m^3]."""
        rho: Expr = self._liquid_density() / self._specific_volume(p)[0]
        return rho

    def bulk_modulus(self, p: Expr) -> Expr:
        """beta(p) = rho dp/drho [Pa]."""
        volume, slope = self._specific_volume(p)
        beta: Expr = -volume / slope
        return beta

    def enthalpy(self, p: Expr) -> Expr:
        """w(p) [J/kg], the integral of dp/rho from 0 bar gauge."""
        absolute, _ = absolute_pressure(p, self.atmospheric_pressure, self.minimum_pressure)
        vapour_pressure, vapour_density = self._vapour()
        condensable = integrated_evaporating(
            p, absolute, lambda at: self._liquid(at)[0], self._integrated_liquid,
            vapour_density / self._liquid_density(), vapour_pressure, self.vapour_range, self.atmospheric_pressure,
            self.minimum_pressure,
        )  # fmt: skip
        air = integrated_free_air(
            absolute, self.air_fraction, self.atmospheric_pressure, self.saturation_pressure, self.polytropic_index,
            self.dissolution_rounding, self.minimum_pressure,
        )  # fmt: skip
        w: Expr = (condensable + air) / self._liquid_density()
        return w

    def dynamic_viscosity(self, p: Expr) -> Expr:
        """mu(p) [Pa s] of the liquid: neither bubbles nor vapour thin it."""
        mu: Expr = self._liquid_density() * self._liquid(p)[0] * self.kinematic_viscosity(p)
        return mu

    def _specific_volume(self, p: Expr) -> Law:
        """rho_l/rho [-] and its derivative with respect to p [1/Pa]."""
        absolute = absolute_pressure(p, self.atmospheric_pressure, self.minimum_pressure)
        vapour_pressure, vapour_density = self._vapour()
        volume, slope = evaporating(
            self._liquid(p), absolute, vapour_density / self._liquid_density(), vapour_pressure, self.vapour_range
        )
        air, air_slope = free_air(
            absolute, self.air_fraction, self.atmospheric_pressure, self.saturation_pressure, self.polytropic_index,
            self.dissolution_rounding,
        )  # fmt: skip
        return volume + air, slope + air_slope


class CavitatingOil(_Evaporating, SimpleOil):
    r"""Oil with vapour below its vapour pressure, and with air if it holds any.

    .. math:: \frac{\rho_l}{\rho(p)} = \left[(1 - \theta) e^{p/\beta_l} + \theta \frac{\rho_v P}{\rho_l P_v}\right]^{-1}
                + \frac{\alpha}{1-\alpha}\, x(P) \left(\frac{P_{atm}}{P}\right)^{1/n}, \quad
              \theta = \tfrac12 \left(1 - \sin \frac{\pi (P - P_v)}{2 s P_v}\right), \quad
              \beta = \rho\,\frac{dp}{d\rho}

    p [Pa] gauge, P = p + P_atm [Pa] absolute; \rho_l = `density` [kg/m^3], \beta_l = `bulk_modulus` [Pa] of the liquid;
    P_v = `vapour_pressure` [Pa], absolute; \rho_v = `vapour_density` [kg/m^3]; \theta [-] share of the volume that
    vapour takes, 0 above P_v (1 + s) and 1 below P_v (1 - s), s = `vapour_range` [-]; the free air as in `aerated_oil`;
    \nu = `kinematic_viscosity` [m^2/s] of the liquid, constant. Liquid and vapour are in equilibrium, at one pressure
    in nature and within the range s here, so that a volume drawn empty and filled again holds the same mass at the same
    pressure; \rho rises with p everywhere and vanishes at absolute zero. The smaller s P_v, the tighter the tolerance
    of a run must be while oil evaporates. Not for the growth and collapse of bubbles, nor for erosion. Source: Delannoy
    & Kueny, ASME FED 98 (1990) 153-158; air: Rundo & Corvaglia (2016), section 6.3.
    """

    vapour_pressure: Pressure = Field(gt=0, description="absolute pressure at which the liquid evaporates")
    vapour_density: Density = Field(default=0.02, gt=0, description="density of the vapour at the vapour pressure")

    def _liquid_density(self) -> Any:
        return self.liquid_density

    def _liquid(self, p: Expr) -> Law:
        return exponential_density(p, self.liquid_modulus)

    def _integrated_liquid(self, p: Expr) -> Any:
        return integrated_exponential_liquid(p, self.liquid_modulus)

    def _vapour(self) -> tuple[Any, Any]:
        return self.vapour_pressure, self.vapour_density


class _DataSheet(Fluid):
    """Base of oils: what their data sheets say."""

    grade: Literal["ISO VG 32", "ISO VG 46", "ISO VG 68", "SAE 15W-40", "ATF"] | None = Field(
        default=None, description="gives density_15, viscosity_1 and viscosity_2 unless they are written"
    )
    temperature: Temperature = Field(default=ZERO_CELSIUS + 40, gt=0, description="temperature of the oil")
    density_15: Density = Field(gt=0, description="density of the air-free oil at 15 degC; the grade's unless written")
    temperature_1: Temperature = Field(default=ZERO_CELSIUS + 40, gt=0, description="where viscosity_1 was measured")
    viscosity_1: KinematicViscosity = Field(
        gt=CST, description="kinematic viscosity at temperature_1; the grade's unless written"
    )
    temperature_2: Temperature = Field(default=ZERO_CELSIUS + 100, gt=0, description="where viscosity_2 was measured")
    viscosity_2: KinematicViscosity = Field(
        gt=CST, description="kinematic viscosity at temperature_2; the grade's unless written"
    )
    pressure_viscosity: PressureCoefficient | None = Field(
        default=None, ge=0, description="pressure-viscosity coefficient; by default from the viscosity"
    )
    liquid_modulus: Pressure | None = Field(
        default=None,
        alias="bulk_modulus",
        gt=0,
        description="isentropic bulk modulus at 0 bar gauge; by default Hayward's",
    )
    bulk_modulus_rise: Ratio = Field(default=5.6, ge=1, description="rise of the secant bulk modulus with the pressure")

    @model_validator(mode="before")
    @classmethod
    def _of_its_grade(cls, data: Any) -> Any:
        """What the grade says and the user does not."""
        if not isinstance(data, dict) or data.get("grade") not in GRADES:
            return data
        grade = GRADES[data["grade"]]
        found = {"density_15": grade.density_15}
        points = ("temperature_1", "viscosity_1", "temperature_2", "viscosity_2")
        if not any(name in data for name in points):
            found |= {"viscosity_1": grade.viscosity_40, "viscosity_2": grade.viscosity_100}
        return {**found, **data}

    @model_validator(mode="after")
    def _thins_with_heat(self) -> Self:
        if (self.temperature_2 - self.temperature_1) * (self.viscosity_1 - self.viscosity_2) <= 0:
            raise ValueError(
                "the oil must be thinner at the hotter of temperature_1 and temperature_2; "
                "give viscosity_1 and viscosity_2 at two temperatures"
            )
        return self

    def _viscosity_at(self, temperature: Any) -> Any:
        """nu_0 [m^2/s]."""
        return walther_viscosity(
            temperature, self.temperature_1, self.viscosity_1, self.temperature_2, self.viscosity_2
        )


class MineralOil(_Evaporating, _DataSheet):
    r"""Oil of a grade at a temperature, with air and vapour; or of any oil by its data sheet.

    .. math:: \log\log(\nu_0 + 0.7) = A - B \log T, \quad \mu = \mu_0 e^{\alpha p}, \quad
              \rho_l = \rho_{15}\, e^{-a \Delta T (1 + 0.8 a \Delta T)}, \quad a = 0.6278/\rho_{15}, \quad
              K_0 = (1.57 + 0.15 \log \nu_{20})\, 10^{0.0024 (20 - t)} \cdot 10^9

    T = `temperature` [K], t the same in degC, constant in a run; \nu_0, \mu_0 [m^2/s, Pa s] at 0 bar gauge, \nu and the
    logarithms in cSt; A, B from `viscosity_1` at `temperature_1` and `viscosity_2` at `temperature_2`; \alpha =
    `pressure_viscosity` [1/Pa], by default (0.6 + 0.965 log \mu_0) 10^{-8}, \mu_0 in mPa s; \rho_{15} = `density_15`
    [kg/m^3], \Delta T = t - 15; K_0 = `bulk_modulus` [Pa], isentropic, at 0 bar gauge, of the air-free oil, whose
    secant modulus rises by `bulk_modulus_rise` p. A `grade` gives the points and \rho_{15} that are not written: ISO VG
    32, 46, 68, SAE 15W-40, ATF. Air as in `aerated_oil`, vapour as in `cavitating_oil`, `vapour_pressure` being an
    effective one: that of oil itself is below 1 Pa, that of its light ends and water unknown. Not for heat: a change of
    temperature within a run. Source: ASTM D341; Barus, Wooster in Stachowiak & Batchelor, Engineering Tribology,
    chapter 2; API MPMS 11.1 (lubricating oils); A. T. J. Hayward, How to estimate the bulk modulus of hydraulic
    fluids, Hydraulic Pneumatic Power 16 (1970) 28-40, within 5 % up to 800 bar, which is `highest_pressure`; ISO 3448,
    SAE J300 and makers' data sheets for the grades.
    """

    highest_pressure: Pressure = Field(
        default=800e5, gt=0, description="gauge pressure up to which its law is meant; beyond, a run warns"
    )
    air_fraction: Ratio = Field(default=5e-3, ge=0, lt=1, description="gas volume over total volume at the atmosphere")
    vapour_pressure: Pressure = Field(default=1e3, gt=0, description="absolute pressure at which the oil evaporates")
    vapour_density: Density = Field(default=0.02, gt=0, description="density of the vapour at the vapour pressure")

    def remarks(self) -> list[str]:
        """Temperatures beyond the tables of the density, and viscosities below the chart's straight line."""
        celsius, viscosity = self.temperature - ZERO_CELSIUS, float(self._viscosity_at(self.temperature))
        if not COLDEST <= self.temperature <= HOTTEST:
            low, high = COLDEST - ZERO_CELSIUS, HOTTEST - ZERO_CELSIUS
            return [
                f"its temperature is {celsius:.4g} degC; the law of its density is meant for {low:g} to {high:g} degC"
            ]
        if viscosity < THINNEST:
            return [
                f"its viscosity is {viscosity / CST:.3g} cSt at {celsius:.4g} degC; the straight line of the viscosity "
                f"chart is meant from {THINNEST / CST:g} cSt on"
            ]
        return []

    def kinematic_viscosity(self, p: Expr) -> Expr:
        """nu(p) [m^2/s] of the liquid: mu_0 exp(alpha p)/rho_l(p)."""
        viscosity = self._viscosity_at(self.temperature)
        coefficient = self.pressure_viscosity
        if coefficient is None:
            coefficient = wooster_coefficient(viscosity * self._liquid_density())
        nu: Expr = viscosity * barus_factor(p, coefficient) / self._liquid(p)[0]
        return nu

    def _liquid_density(self) -> Any:
        expansion = 0.6278 / self.density_15 * (self.temperature - (ZERO_CELSIUS + 15))
        return self.density_15 * exp(-expansion * (1 + 0.8 * expansion))

    def _liquid(self, p: Expr) -> Law:
        return secant_density(p, self._modulus(), self.bulk_modulus_rise)

    def _integrated_liquid(self, p: Expr) -> Any:
        return integrated_secant_liquid(p, self._modulus(), self.bulk_modulus_rise)

    def _modulus(self) -> Any:
        """K_0 [Pa]."""
        if self.liquid_modulus is not None:
            return self.liquid_modulus
        thickness = log(self._viscosity_at(ZERO_CELSIUS + 20) / CST) / log(10.0)
        return 1e9 * (1.57 + 0.15 * thickness) * 10.0 ** (0.0024 * (ZERO_CELSIUS + 20 - self.temperature))

    def _vapour(self) -> tuple[Any, Any]:
        return self.vapour_pressure, self.vapour_density


class Water(_Evaporating):
    r"""Water at a temperature from 0 to 95 degC, with its vapour, and with air if it holds any.

    .. math:: \mu = 10^{-6} \sum_k a_k (T/300)^{b_k}, \quad K_0 = \rho_l c^2, \quad
              \ln \frac{P_v}{P_c} = \frac{T_c}{T} \sum_k c_k \tau^{d_k}, \quad \tau = 1 - T/T_c

    T = `temperature` [K], constant in a run; \mu [Pa s] at 0 bar gauge, and \nu = \mu/\rho_l at all pressures (at 20
    degC 3 % too much at 500 bar); \rho_l [kg/m^3] at 0 bar gauge; c [m/s] speed of sound; K_0 [Pa] isentropic bulk
    modulus at 0 bar gauge, whose secant value rises by `bulk_modulus_rise` p; P_v [Pa] vapour pressure, absolute;
    vapour as in `cavitating_oil` with the density of a perfect gas, air as in `aerated_oil`. Not for steam, ice, nor
    salt water. Source: \mu: IAPWS SR6-08 (2011); \rho_l: G. S. Kell, J. Chem. Eng. Data 20 (1975) 97-105; c: W.
    Marczak, J. Acoust. Soc. Am. 102 (1997) 2776-2779; P_v: W. Wagner, A. Pruss, J. Phys. Chem. Ref. Data 31 (2002)
    387-535, Eq. 2.5; rise of the modulus: the speed of sound of IAPWS-95 at 20 degC up to 1000 bar,
    which is `highest_pressure`.
    """

    temperature: Temperature = Field(
        default=ZERO_CELSIUS + 20, ge=ZERO_CELSIUS, le=ZERO_CELSIUS + 95, description="temperature of the water"
    )
    bulk_modulus_rise: Ratio = Field(
        default=3.45, ge=1, description="rise of the secant bulk modulus with the pressure"
    )

    def kinematic_viscosity(self, p: Expr) -> Expr:
        """nu(p) [m^2/s]."""
        reduced = self.temperature / 300.0
        terms = ((280.68, -1.9), (511.45, -7.7), (61.131, -19.6), (0.45903, -40.0))
        nu: Expr = 1e-6 * sum(a * reduced**b for a, b in terms) / self._liquid_density() + 0.0 * p
        return nu

    def _liquid_density(self) -> Any:
        t = self.temperature - ZERO_CELSIUS
        above = (999.83952, 16.945176, -7.9870401e-3, -46.170461e-6, 105.56302e-9, -280.54253e-12)
        return _polynomial(above, t) / (1 + 16.879850e-3 * t)

    def _liquid(self, p: Expr) -> Law:
        return secant_density(p, self._modulus(), self.bulk_modulus_rise)

    def _integrated_liquid(self, p: Expr) -> Any:
        return integrated_secant_liquid(p, self._modulus(), self.bulk_modulus_rise)

    def _modulus(self) -> Any:
        """K_0 [Pa]."""
        t = self.temperature - ZERO_CELSIUS
        sound = _polynomial((1402.385, 5.038813, -5.799136e-2, 3.287156e-4, -1.398845e-6, 2.787860e-9), t)
        return self._liquid_density() * sound * sound

    def _vapour(self) -> tuple[Any, Any]:
        critical_temperature, critical_pressure = 647.096, 22.064e6
        tau = 1 - self.temperature / critical_temperature
        root = sqrt(tau)
        terms = (
            -7.85951783 * tau + 1.84408259 * tau * root - 11.7866497 * tau**3 + 22.6807411 * tau**3 * root
            - 15.9618719 * tau**4 + 1.80122502 * tau**7 * root
        )  # fmt: skip
        pressure = critical_pressure * exp(critical_temperature / self.temperature * terms)
        return pressure, pressure / (GAS_CONSTANT_OF_STEAM * self.temperature)


def _polynomial(coefficients: tuple[float, ...], x: Any) -> Any:
    """Coefficients from the constant on."""
    value: Any = 0.0
    for coefficient in reversed(coefficients):
        value = value * x + coefficient
    return value
