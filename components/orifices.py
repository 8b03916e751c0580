"""Sharp-edged restrictions: the orifice law with a discharge coefficient that follows the flow or Reynolds number."""

from pydantic import Field

from crescentlab.component import Component, Equations
from crescentlab.domain import dissipates, observable, takes_pressure, takes_signal
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr, sqrt
from crescentlab.units import Area, Density, Flow, Length, Pressure, Ratio

from .flow_laws import DIAMETER_ROUNDING, hydraulic_diameter_of, orifice_flow, referred_flow, rising_root


class Orifice(Component):
    r"""Sharp-edged orifice whose discharge coefficient follows the flow number.

    .. math:: q = n\, C_d A \sqrt{2\rho|\Delta p|}/\rho_0\; \mathrm{sign}\,\Delta p, \quad
              C_d = C_{d,max} \tanh(2\lambda/\lambda_c), \quad \lambda = (d_h/\nu)\sqrt{2|\Delta p|/\rho}

    \Delta p = p_a - p_b [Pa]; A = `area` [m^2]; d_h [m], by default \sqrt{4A/\pi + d_r^2} with d_r =
    `diameter_rounding` [m]; \rho [kg/m^3] and \nu [m^2/s] at the mean pressure, \rho_0 at 0 bar gauge; n = `parallel`
    [-]. With `count` a vector of equal orifices, each between its own pair of ports. Finite Jacobian at \Delta p = 0
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
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, fluid: Fluid) -> Equations:
        d_h = self.hydraulic_diameter
        if d_h is None:
            d_h = hydraulic_diameter_of(self.area, self.diameter_rounding)
        q = self.parallel * orifice_flow(p_a, p_b, self.area, d_h, self.cd_max, self.lambda_c, fluid)
        return {"q_a": q, "q_b": -q, "q": q}


class Throttle(Orifice):
    r"""Load valve: an orifice of adjustable `area` at the end of a circuit.

    .. math:: q = n\, C_d A \sqrt{2\rho|\Delta p|}/\rho_0\; \mathrm{sign}\,\Delta p

    \Delta p = p_a - p_b [Pa]; A = `area` [m^2], 0 is closed; \rho [kg/m^3]; C_d, n [-] and all else as in
    `orifice`. Not for cavitating flow. Source: Rundo & Corvaglia (2016), Eqs. 27-29 and section 5.
    """


class VariableOrifice(Component):
    r"""Orifice that a signal opens, for example while a volume exists or a valve is driven.

    .. math:: q = n\, C_d\, sA \sqrt{2\rho|\Delta p|}/\rho_0\; \mathrm{sign}\,\Delta p, \quad
              C_d = C_{d,max} \tanh(2\lambda/\lambda_c), \quad \lambda = (d_h/\nu)\sqrt{2|\Delta p|/\rho}

    s = `opening` [-], share of A = `area` [m^2] that is open; \Delta p = p_a - p_b [Pa]; d_h [m], by default
    \sqrt{4sA/\pi + d_r^2} with d_r = `diameter_rounding` [m]; \rho [kg/m^3] and \nu [m^2/s] at the mean pressure,
    \rho_0 at 0 bar gauge; n = `parallel` [-]. With `count` a vector of orifices, each with its own opening. Finite
    Jacobian at \Delta p = 0 and s = 0. Not for cavitating flow.
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
    opening = takes_signal(Ratio, "open share of the area", size="count", low=0, high=1)
    q = observable(Flow, "flow from a to b", size="count")
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, opening: Expr, fluid: Fluid) -> Equations:
        area = self.area * opening
        d_h = self.hydraulic_diameter
        if d_h is None:
            d_h = hydraulic_diameter_of(area, self.diameter_rounding)
        q = self.parallel * orifice_flow(p_a, p_b, area, d_h, self.cd_max, self.lambda_c, fluid)
        return {"q_a": q, "q_b": -q, "q": q}


class LaminarTurbulentOrifice(Component):
    r"""Sharp-edged orifice that turns from laminar to turbulent at a Reynolds number.

    .. math:: \Delta p = \frac{\rho}{2 C_d^2} \left(v|v| + \frac{\nu Re_t}{d_h} v\right), \quad
              q = \frac{\rho}{\rho_0} n A v, \quad Re_t = \left(\frac{C_d}{\delta}\right)^2

    \Delta p = p_a - p_b [Pa]; v [m/s] in the hole; A = `area` [m^2]; n = `parallel` [-]; C_d = `cd_turbulent` [-];
    \delta = `laminar_coefficient` [-], 0.157 for slits and 0.2 for round holes by Wuest; exact creeping flow through a
    hole in a thin plate has 0.163, two thirds of that flow (Sampson); d_h [m], by default \sqrt{4A/\pi + d_r^2} with
    d_r = `diameter_rounding` [m]; \rho [kg/m^3], \nu [m^2/s] at the mean pressure, \rho_0 at 0 bar gauge. Its ends are
    the laminar n A v = 2 \delta^2 d_h A \Delta p/\mu and the turbulent C_d A \sqrt{2\Delta p/\rho}; at the transition
    Reynolds number Re_t, 9.3 for \delta = 0.2, both parts of the drop are equal. Not for cavitating flow. Source: H. E.
    Merritt, Hydraulic Control Systems (1967), chapter 3, after W. Wuest, Ing.-Archiv 22 (1954) 357-367; R. A. Sampson,
    Phil. Trans. R. Soc. A 182 (1891) 449-518; joined smoothly, linear at zero drop, after W. Borutzky, B. Barnard, J.
    Thoma, Simulation Modelling Practice and Theory 10 (2002) 141-152.
    """

    area: Area = Field(ge=0, description="flow area; 0 is closed")
    hydraulic_diameter: Length | None = Field(default=None, gt=0, description="default: that of a round hole")
    cd_turbulent: Ratio = Field(default=0.611, gt=0, le=1, description="discharge coefficient in turbulent flow")
    laminar_coefficient: Ratio = Field(default=0.2, gt=0, description="discharge coefficient over root of Re, laminar")
    parallel: Ratio = Field(default=1.0, ge=0, description="number of equal orifices side by side")
    diameter_rounding: Length = Field(default=DIAMETER_ROUNDING, gt=0, description="rounding of the diameter at 0 area")

    a = takes_pressure("upstream")
    b = takes_pressure("downstream")
    q = observable(Flow, "flow from a to b")
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, fluid: Fluid) -> Equations:
        d_h = self.hydraulic_diameter
        if d_h is None:
            d_h = hydraulic_diameter_of(self.area, self.diameter_rounding)
        mean = (p_a + p_b) / 2
        rho, nu = fluid.density(mean), fluid.kinematic_viscosity(mean)
        laminar = rho * nu / (2 * self.laminar_coefficient**2 * d_h)
        turbulent = rho / (2 * self.cd_turbulent**2)
        v = rising_root(p_a - p_b, laminar, turbulent)
        q = referred_flow(self.parallel * self.area * v, mean, fluid)
        return {"q_a": q, "q_b": -q, "q": q}


class RatedOrifice(Component):
    r"""Turbulent restriction known by its flow at one drop, as makers rate valves.

    .. math:: q = \frac{\rho}{\rho_0} n\, q_r \sqrt{\frac{\rho_r}{\rho}}\;
              \frac{\Delta p/p_r}{\sqrt[4]{(\Delta p/p_r)^2 + (p_t/p_r)^2}}

    \Delta p = p_a - p_b [Pa]; q_r = `rated_flow` [m^3/s] at p_r = `rated_drop` [Pa] with an oil of \rho_r =
    `reference_density` [kg/m^3], by volume as it passes; n = `parallel` [-]; \rho [kg/m^3] at the mean pressure, \rho_0
    at 0 bar gauge; p_t = `transition_drop` [Pa], below which the root turns into a straight line: a relative change of
    (p_t/\Delta p)^2/4 above it. Not for small flows of thick oil,
    where viscosity counts: `orifice` or `measured_resistance`.
    Source: orifice equation; rounded as in Simscape's hydraulic orifices, MathWorks documentation.
    """

    rated_flow: Flow = Field(gt=0, description="flow at the rated drop")
    rated_drop: Pressure = Field(gt=0, description="drop at the rated flow")
    reference_density: Density = Field(default=860.0, gt=0, description="density of the oil of the rating")
    transition_drop: Pressure = Field(default=1e3, gt=0, description="drop below which the flow is laminar")
    parallel: Ratio = Field(default=1.0, ge=0, description="number of equal restrictions side by side")

    a = takes_pressure("upstream")
    b = takes_pressure("downstream")
    q = observable(Flow, "flow from a to b")
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, fluid: Fluid) -> Equations:
        drop, transition = (p_a - p_b) / self.rated_drop, self.transition_drop / self.rated_drop
        root, mean = sqrt(sqrt(drop * drop + transition * transition)), (p_a + p_b) / 2
        lighter = sqrt(self.reference_density / fluid.density(mean))
        q = referred_flow(self.parallel * self.rated_flow * lighter * drop / root, mean, fluid)
        return {"q_a": q, "q_b": -q, "q": q}
