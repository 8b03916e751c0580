"""Volumes of compressible fluid: parts that give a pressure and balance the mass that enters them."""

from typing import Annotated

from pydantic import Field

from crescentlab import units
from crescentlab.component import Component, Equations
from crescentlab.domain import gives_pressure, state, stores, takes_chamber
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr
from crescentlab.tables import Curve, CurveOf
from crescentlab.units import Area, Pressure, Volume


class Capacity(Component):
    r"""Fixed volume of compressible fluid.

    .. math:: \frac{dp}{dt} = \frac{\beta(p)}{V} \frac{\rho_0}{\rho(p)} \sum q

    p [Pa] gauge; V = `volume` [m^3]; q [m^3/s] into the volume, mass flow over \rho_0; \rho [kg/m^3];
    \beta [Pa]. Stored: V \rho/\rho_0 [m^3]. Not for volumes that move: use `variable_capacity`.
    Source: Rundo & Corvaglia (2016), Eq. 2 without its last term.
    """

    volume: Volume = Field(gt=0, description="fluid volume")

    port = gives_pressure("the volume")
    p = state(Pressure, "pressure", start=0.0, nominal=1e5)
    content = stores()

    def equations(self, p: Expr, q_port: Expr, fluid: Fluid) -> Equations:
        swell = fluid.rho_0 / fluid.density(p)
        return {
            "p_port": p,
            "der_p": fluid.bulk_modulus(p) / self.volume * swell * q_port,
            "content": self.volume / swell,
        }


class VariableCapacity(Component):
    r"""Volume of compressible fluid whose size another part shapes, for example a pump chamber.

    .. math:: \frac{dp}{dt} = \frac{\beta(p)}{V} \left( \frac{\rho_0}{\rho(p)} \sum q - \frac{dV}{dt} \right)

    p [Pa] gauge; V [m^3] > 0 and dV/dt [m^3/s] come from the chamber, which is answered by p; q [m^3/s] into the
    volume, mass flow over \rho_0; \rho [kg/m^3]; \beta [Pa]. Stored: V \rho/\rho_0 [m^3]. Not for volumes that
    vanish for part of a turn. Source: Rundo & Corvaglia (2016), Eq. 2, with \rho_0/\rho because q is a mass flow.
    """

    port = gives_pressure("the volume")
    chamber = takes_chamber("what shapes the volume")
    p = state(Pressure, "pressure", start=0.0, nominal=1e5)
    content = stores()

    def equations(self, p: Expr, q_port: Expr, V_chamber: Expr, dV_chamber: Expr, fluid: Fluid) -> Equations:
        swell = fluid.rho_0 / fluid.density(p)
        return {
            "p_port": p,
            "p_chamber": p,
            "der_p": fluid.bulk_modulus(p) / V_chamber * (swell * q_port - dV_chamber),
            "content": V_chamber / swell,
        }


class CompliantCapacity(Component):
    r"""Volume shaped by another part, with one wall that gives way under the pressure, such as a pump cover.

    .. math:: \frac{dp}{dt} = \frac{\frac{\rho_0}{\rho} \sum q - \frac{dV}{dt}}{\frac{V + V_w}{\beta} + C},
              \quad V_w = A_w\, h(p), \quad C = A_w \frac{dh}{dp}

    p [Pa] gauge; V [m^3] > 0 and dV/dt [m^3/s] come from the chamber, which is answered by p; q [m^3/s] into the
    volume, mass flow over \rho_0; A_w = `wall_area` [m^2], the mean over the largest deflection already in it;
    h = `deflection` [m] of p; \rho [kg/m^3]; \beta [Pa]. Stored: (V + V_w) \rho/\rho_0 [m^3], whose rate is
    exactly \sum q. The chamber's V is that of the rigid walls, so the oil behind the bulging wall, V_w, is
    compressed as well: without it no closed expression would be stored; V_w/V is about 0.1 % in a pump.
    Not for walls with inertia or damping. Source: Rundo & Corvaglia (2016), Eq. 2 with section 3, mass balance.
    """

    wall_area: Area = Field(ge=0, description="wall volume per deflection: area times mean over largest deflection")
    deflection: Annotated[Curve, CurveOf(units.pressure, units.length)] = Field(
        description="largest deflection of the wall over the pressure inside"
    )

    port = gives_pressure("the volume")
    chamber = takes_chamber("what shapes the volume of the rigid walls")
    p = state(Pressure, "pressure", start=0.0, nominal=1e5)
    content = stores()

    def equations(self, p: Expr, q_port: Expr, V_chamber: Expr, dV_chamber: Expr, fluid: Fluid) -> Equations:
        swell = fluid.rho_0 / fluid.density(p)
        volume = V_chamber + self.wall_area * self.deflection(p)
        compliance = self.wall_area * self.deflection.slope(p)
        return {
            "p_port": p,
            "p_chamber": p,
            "der_p": (swell * q_port - dV_chamber) / (volume / fluid.bulk_modulus(p) + compliance),
            "content": volume / swell,
        }
