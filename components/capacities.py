"""Volumes of compressible fluid: parts that give a pressure and balance the mass that enters them."""

from typing import Annotated, Any, Literal

from pydantic import Field

from crescentlab import units
from crescentlab.component import Component, Equations
from crescentlab.domain import gives_pressure, state, stores, stores_energy, takes_chamber
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr, pi
from crescentlab.tables import Curve, CurveOf
from crescentlab.units import Area, Length, Pressure, Ratio, Volume


class Capacity(Component):
    r"""Fixed volume of compressible fluid.

    .. math:: \frac{dp}{dt} = \frac{\beta(p)}{V} \frac{\rho_0}{\rho(p)} \sum q

    p [Pa] gauge; V = `volume` [m^3]; q [m^3/s] into the volume, mass flow over \rho_0; \rho [kg/m^3]; \beta [Pa].
    Stored: V \rho/\rho_0 [m^3], energy V e(p) [J]. Not for volumes that move: use `variable_capacity`. Source: Rundo &
    Corvaglia (2016), Eq. 2 without its last term.
    """

    volume: Volume = Field(gt=0, description="fluid volume")

    port = gives_pressure("the volume")
    p = state(Pressure, "pressure", start=0.0, nominal=1e5)
    content = stores()
    stored_energy = stores_energy()

    def equations(self, p: Expr, q_port: Expr, fluid: Fluid) -> Equations:
        swell = fluid.rho_0 / fluid.density(p)
        return {
            "p_port": p,
            "der_p": fluid.bulk_modulus(p) / self.volume * swell * q_port,
            "content": self.volume / swell,
            "stored_energy": self.volume * fluid.energy_density(p),
        }


class VariableCapacity(Component):
    r"""Volume of compressible fluid whose size another part shapes, for example a pump chamber.

    .. math:: \frac{dp}{dt} = \frac{\beta(p)}{V} \left( \frac{\rho_0}{\rho(p)} \sum q - \frac{dV}{dt} \right)

    p [Pa] gauge; V [m^3] > 0 and dV/dt [m^3/s] come from the chamber, which is answered by p; q [m^3/s] into the
    volume, mass flow over \rho_0; \rho [kg/m^3]; \beta [Pa]. Stored: V \rho/\rho_0 [m^3], energy V e(p) [J]. Not for
    volumes that vanish for part of a turn. Source: Rundo & Corvaglia (2016), Eq. 2, with \rho_0/\rho because q is a
    mass flow.
    """

    port = gives_pressure("the volume")
    chamber = takes_chamber("what shapes the volume")
    p = state(Pressure, "pressure", start=0.0, nominal=1e5)
    content = stores()
    stored_energy = stores_energy()

    def equations(self, p: Expr, q_port: Expr, V_chamber: Expr, dV_chamber: Expr, fluid: Fluid) -> Equations:
        swell = fluid.rho_0 / fluid.density(p)
        return {
            "p_port": p,
            "p_chamber": p,
            "der_p": fluid.bulk_modulus(p) / V_chamber * (swell * q_port - dV_chamber),
            "content": V_chamber / swell,
            "stored_energy": V_chamber * fluid.energy_density(p),
        }


class CompliantCapacity(Component):
    r"""Volume shaped by another part, with one wall that gives way under the pressure, such as a pump cover.

    .. math:: \frac{dp}{dt} = \frac{\frac{\rho_0}{\rho} \sum q - \frac{dV}{dt}}{\frac{V + V_w}{\beta} + C},
              \quad V_w = A_w\, h(p), \quad C = A_w \frac{dh}{dp}

    p [Pa] gauge; V [m^3] > 0 and dV/dt [m^3/s] come from the chamber, which is answered by p; q [m^3/s] into the
    volume, mass flow over \rho_0; A_w = `wall_area` [m^2], the mean over the largest deflection already in it; h =
    `deflection` [m] of p; \rho [kg/m^3]; \beta [Pa]. Stored: energy (V + V_w) e(p) + A_w \int p\,dh [J], and (V + V_w)
    \rho/\rho_0 [m^3], whose rate is exactly \sum q. The chamber's V is that of the rigid walls, so the oil behind the
    bulging wall, V_w, is compressed as well: without it no closed expression would be stored; V_w/V is about 0.1 % in a
    pump. Not for walls with inertia or damping. Source: Rundo & Corvaglia (2016), Eq. 2 with section 3, mass balance.
    """

    wall_area: Area = Field(ge=0, description="wall volume per deflection: area times mean over largest deflection")
    deflection: Annotated[Curve, CurveOf(units.pressure, units.length)] = Field(
        description="largest deflection of the wall over the pressure inside"
    )

    port = gives_pressure("the volume")
    chamber = takes_chamber("what shapes the volume of the rigid walls")
    p = state(Pressure, "pressure", start=0.0, nominal=1e5)
    content = stores()
    stored_energy = stores_energy()

    def equations(self, p: Expr, q_port: Expr, V_chamber: Expr, dV_chamber: Expr, fluid: Fluid) -> Equations:
        swell = fluid.rho_0 / fluid.density(p)
        volume = V_chamber + self.wall_area * self.deflection(p)
        compliance = self.wall_area * self.deflection.slope(p)
        return {
            "p_port": p,
            "p_chamber": p,
            "der_p": (swell * q_port - dV_chamber) / (volume / fluid.bulk_modulus(p) + compliance),
            "content": volume / swell,
            "stored_energy": volume * fluid.energy_density(p) + self.wall_area * self.deflection.work(p),
        }


class ElasticCapacity(Component):
    r"""Volume in a round tube or vessel whose elastic wall gives way under the pressure.

    .. math:: \frac{dp}{dt} = \frac{\rho_0}{\rho} \frac{\sum q}{V/\beta + V_0 c}, \quad V = V_0 (1 + c p), \quad
              c = \frac{2 (1 + \nu_w) + k B}{E}, \quad B = \frac{d^2}{(d + 2 e)^2 - d^2}

    p [Pa] gauge; V_0 = \pi/4 d^2 l [m^3]; d = `diameter` (inner), l = `length`, e = `wall_thickness` [m]; E =
    `youngs_modulus` [Pa], \nu_w = `poissons_ratio` [-] of the wall; k = 5 - 4 \nu_w for `ends` closed (a vessel, free
    to grow longer), 4 with expansion joints, 4 (1 - \nu_w^2) anchored (no axial strain); q [m^3/s] into the volume,
    mass flow over \rho_0; \rho [kg/m^3]; \beta [Pa]. c is exact for walls of any thickness; for a thin wall it is k
    d/(4 e E), so that the effective bulk modulus is \beta/(1 + k \beta d/(4 e E)). Stored: V \rho/\rho_0 [m^3], energy
    V e(p) + V_0 c p^2/2 [J]. Not for hoses, whose walls are neither linear nor without loss. Source: G. Lame (1852); S.
    Timoshenko, Strength of Materials II, thick-walled cylinders; E. B. Wylie, V. L. Streeter, Fluid Transients in
    Systems (1993), thin walls.
    """

    diameter: Length = Field(gt=0, description="inner diameter")
    length: Length = Field(gt=0, description="length")
    wall_thickness: Length = Field(gt=0, description="thickness of the wall")
    youngs_modulus: Pressure = Field(default=210e9, gt=0, description="Young's modulus of the wall")
    poissons_ratio: Ratio = Field(default=0.3, ge=0, le=0.5, description="Poisson's ratio of the wall")
    ends: Literal["closed", "expansion_joints", "anchored"] = Field(
        default="closed",
        description="what the ends of the cylinder do: bear its axial force, slide, or hold it in place",
    )

    port = gives_pressure("the volume")
    p = state(Pressure, "pressure", start=0.0, nominal=1e5)
    content = stores()
    stored_energy = stores_energy()

    def equations(self, p: Expr, q_port: Expr, fluid: Fluid) -> Equations:
        volume = pi / 4 * self.diameter * self.diameter * self.length
        compliance = volume * self._wall()
        swell = fluid.rho_0 / fluid.density(p)
        grown = volume + compliance * p
        return {
            "p_port": p,
            "der_p": swell * q_port / (grown / fluid.bulk_modulus(p) + compliance),
            "content": grown / swell,
            "stored_energy": grown * fluid.energy_density(p) + compliance * p * p / 2,
        }

    def _wall(self) -> Any:
        """c [1/Pa], growth of the volume per pressure."""
        nu, inner, outer = self.poissons_ratio, self.diameter, self.diameter + 2 * self.wall_thickness
        axial = {"closed": 5 - 4 * nu, "expansion_joints": 4.0, "anchored": 4 * (1 - nu * nu)}[self.ends]
        return (2 * (1 + nu) + axial * inner * inner / (outer * outer - inner * inner)) / self.youngs_modulus
