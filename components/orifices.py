"""Sharp-edged restrictions: flow by the orifice law with a discharge coefficient that follows the flow number."""

from pydantic import Field

from crescentlab.component import Component, Equations
from crescentlab.domain import observable, takes_pressure, takes_signal
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr, maximum
from crescentlab.units import Area, Flow, Length, Ratio

from .flow_laws import DIAMETER_ROUNDING, hydraulic_diameter_of, orifice_flow


class Orifice(Component):
    r"""Sharp-edged orifice whose discharge coefficient follows the flow number.

    .. math:: q = n\, C_d A \sqrt{2|\Delta p|/\rho}\; \mathrm{sign}\,\Delta p, \quad
              C_d = C_{d,max} \tanh(2\lambda/\lambda_c), \quad \lambda = (d_h/\nu)\sqrt{2|\Delta p|/\rho}

    \Delta p = p_a - p_b [Pa]; A = `area` [m^2]; d_h [m], by default \sqrt{4A/\pi + d_r^2} with
    d_r = `diameter_rounding` [m]; \rho [kg/m^3] and \nu [m^2/s] at the mean pressure; n = `parallel` [-].
    With `count` a vector of equal orifices, each between its own pair of ports. Finite Jacobian at \Delta p = 0
    and A = 0. Not for cavitating flow. Source: Rundo & Corvaglia (2016), Eqs. 27-29.
    """

    area: Area = Field(ge=0, description="flow area; 0 is closed")
    hydraulic_diameter: Length | None = Field(default=None, gt=0, description="default: that of a round hole")
    cd_max: Ratio = Field(default=0.7, gt=0, le=1, description="largest discharge coefficient")
    lambda_c: Ratio = Field(default=100.0, gt=0, description="critical flow number")
    parallel: Ratio = Field(default=1.0, ge=0, description="number of equal orifices side by side")
    diameter_rounding: Length = Field(default=DIAMETER_ROUNDING, gt=0, description="rounding of the diameter at 0 area")
    count: int | None = Field(default=None, ge=0, description="size of the ports; none: scalar")

    a = takes_pressure("upstream", size="count")
    b = takes_pressure("downstream", size="count")
    q = observable(Flow, "flow from a to b", size="count")

    def equations(self, p_a: Expr, p_b: Expr, fluid: Fluid) -> Equations:
        d_h = self.hydraulic_diameter
        if d_h is None:
            d_h = hydraulic_diameter_of(self.area, self.diameter_rounding)
        q = self.parallel * orifice_flow(p_a, p_b, self.area, d_h, self.cd_max, self.lambda_c, fluid)
        return {"q_a": q, "q_b": -q, "q": q}


class Throttle(Orifice):
    r"""Load valve: an orifice of adjustable `area` at the end of a circuit.

    .. math:: q = n\, C_d A \sqrt{2|\Delta p|/\rho}\; \mathrm{sign}\,\Delta p

    \Delta p = p_a - p_b [Pa]; A = `area` [m^2], 0 is closed; \rho [kg/m^3]; C_d, n [-] and all else as in
    `orifice`. Not for cavitating flow. Source: Rundo & Corvaglia (2016), Eqs. 27-29 and section 5.
    """


class VariableOrifice(Component):
    r"""Orifice that a signal opens, for example while a volume exists or a valve is driven.

    .. math:: q = n\, C_d\, sA \sqrt{2|\Delta p|/\rho}\; \mathrm{sign}\,\Delta p, \quad
              C_d = C_{d,max} \tanh(2\lambda/\lambda_c), \quad \lambda = (d_h/\nu)\sqrt{2|\Delta p|/\rho}

    s = `opening` [-], share of A = `area` [m^2] that is open; below 0 counts as 0; \Delta p = p_a - p_b [Pa];
    d_h [m], by default \sqrt{4sA/\pi + d_r^2} with d_r = `diameter_rounding` [m]; \rho [kg/m^3] and
    \nu [m^2/s] at the mean pressure; n = `parallel` [-]. With `count` a vector of orifices, each with its own
    opening. Finite Jacobian at \Delta p = 0 and s = 0. Not for cavitating flow.
    Source: Rundo & Corvaglia (2016), Eqs. 27-29.
    """

    area: Area = Field(ge=0, description="flow area when fully open")
    hydraulic_diameter: Length | None = Field(default=None, gt=0, description="default: that of a round hole")
    cd_max: Ratio = Field(default=0.7, gt=0, le=1, description="largest discharge coefficient")
    lambda_c: Ratio = Field(default=100.0, gt=0, description="critical flow number")
    parallel: Ratio = Field(default=1.0, ge=0, description="number of equal orifices side by side")
    diameter_rounding: Length = Field(default=DIAMETER_ROUNDING, gt=0, description="rounding of the diameter at 0 area")
    count: int | None = Field(default=None, ge=0, description="size of the ports; none: scalar")

    a = takes_pressure("upstream", size="count")
    b = takes_pressure("downstream", size="count")
    opening = takes_signal(Ratio, "open share of the area", size="count")
    q = observable(Flow, "flow from a to b", size="count")

    def equations(self, p_a: Expr, p_b: Expr, opening: Expr, fluid: Fluid) -> Equations:
        area = self.area * maximum(opening, 0.0)
        d_h = self.hydraulic_diameter
        if d_h is None:
            d_h = hydraulic_diameter_of(area, self.diameter_rounding)
        q = self.parallel * orifice_flow(p_a, p_b, area, d_h, self.cd_max, self.lambda_c, fluid)
        return {"q_a": q, "q_b": -q, "q": q}
