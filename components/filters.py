"""Filters: what housing and element take from the pressure. Bypass valves are check valves beside them."""

from pydantic import Field

from crescentlab.component import Component, Equations
from crescentlab.domain import dissipates, observable, takes_pressure
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr
from crescentlab.units import Density, Flow, FlowResistance, KinematicViscosity, QuadraticResistance, Ratio

from .flow_laws import referred_flow, rising_root


class Filter(Component):
    r"""Filter whose element takes a pressure in proportion to viscosity and flow, its housing with the flow squared.

    .. math:: p_a - p_b = z\, R\, \frac{\rho\nu}{\rho_r \nu_r}\, Q + K \frac{\rho}{\rho_r}\, Q |Q|, \quad
              q = \frac{\rho}{\rho_0} Q

    p [Pa] gauge; Q [m^3/s] volume flow from a to b; R = `element` [Pa s/m^3], K = `housing` [Pa s^2/m^6], both as
    measured with an oil of \rho_r = `reference_density` [kg/m^3] and \nu_r = `reference_viscosity` [m^2/s], those of
    the makers' curves; \rho, \nu at the mean pressure, \rho_0 at 0 bar gauge; z = `clogging` [-], resistance of the
    element over that when it is clean. Solved for the flow, Q = 2 \Delta p/(r + sqrt(r^2 + 4 k|\Delta p|)) with r, k
    the two factors above. Not for dirt that gathers, nor for an element that bursts; the fluid inside belongs to the
    volumes beside it.
    Source: linear law of Darcy and quadratic loss, Forchheimer (1901), as makers state filters measured by ISO 3968:
    the element's drop goes with density, viscosity and flow, the housing's with density.
    """

    element: FlowResistance = Field(gt=0, description="drop over flow of the clean element, with the reference oil")
    housing: QuadraticResistance = Field(
        default=0.0, ge=0, description="drop over flow squared of the housing, with the reference oil"
    )
    clogging: Ratio = Field(default=1.0, gt=0, description="resistance of the element over that when it is clean")
    reference_density: Density = Field(default=860.0, gt=0, description="density of the oil of the makers' curves")
    reference_viscosity: KinematicViscosity = Field(default=30e-6, gt=0, description="its kinematic viscosity")

    a = takes_pressure("dirty side")
    b = takes_pressure("clean side")
    q = observable(Flow, "flow from a to b")
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, fluid: Fluid) -> Equations:
        mean = (p_a + p_b) / 2
        heavier = fluid.density(mean) / self.reference_density
        linear = self.clogging * self.element * heavier * fluid.kinematic_viscosity(mean) / self.reference_viscosity
        quadratic = self.housing * heavier
        q = referred_flow(rising_root(p_a - p_b, linear, quadratic), mean, fluid)
        return {"q_a": q, "q_b": -q, "q": q}
