"""Resistances with a length, and those known by a measured curve. They hold no fluid and no inertia of their own."""

from pydantic import Field

from crescentlab.component import Component, Equations
from crescentlab.domain import dissipates, observable, takes_pressure
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr
from crescentlab.units import Density, Flow, FlowResistance, KinematicViscosity, Length, QuadraticResistance, Ratio

from .flow_laws import pipe_friction_flow, referred_flow, rising_root, short_tube_flow


class PipeResistance(Component):
    r"""Friction of a straight pipe in all regimes of flow, without its inertia and volume.

    .. math:: p_a - p_b = \left(f \frac{l}{d} + K\right) \frac{\rho v |v|}{2}, \quad
              v = \frac{4 \rho_0 q}{n \pi d^2 \rho}, \quad
              f = 8\left[\left(\frac{8}{Re}\right)^{12} + \frac{1}{(A+B)^{3/2}}\right]^{1/12}

    p [Pa] gauge; l = `length`, d = `diameter` [m]; K = `loss_coefficient` [-]; n = `parallel` [-] equal pipes side by
    side; q [m^3/s] mass flow over \rho_0; \rho [kg/m^3], \nu [m^2/s] at the mean pressure; f [-] Darcy factor of
    Churchill, A and B functions of Re = |v| d/\nu and of `roughness`/d: 64/Re when laminar, within a few per cent of
    Colebrook-White when turbulent, one smooth rising curve between. Solved for q to rounding. Not for pipes whose
    inertia or compressibility matters (`pipe`) or for waves.
    Source: Darcy-Weisbach with S. W. Churchill, Chem. Eng. 84 (1977) 24, 91-92.
    """

    length: Length = Field(gt=0, description="length")
    diameter: Length = Field(gt=0, description="inner diameter")
    roughness: Length = Field(default=0.0, ge=0, description="height of the wall's roughness; 0 is smooth")
    loss_coefficient: Ratio = Field(default=0.0, ge=0, description="entry, exit and fittings, on the dynamic head")
    parallel: Ratio = Field(default=1.0, ge=0, description="number of equal pipes side by side")

    a = takes_pressure("first end")
    b = takes_pressure("second end")
    q = observable(Flow, "flow from a to b")
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, fluid: Fluid) -> Equations:
        one = pipe_friction_flow(p_a, p_b, self.length, self.diameter, self.roughness, fluid, self.loss_coefficient)
        q = self.parallel * one
        return {"q_a": q, "q_b": -q, "q": q}


class ShortTube(Component):
    r"""Short tube with a sharp entry: an orifice at high, developing laminar flow at low Reynolds numbers.

    .. math:: q = n C_d \frac{\pi d^2}{4} \sqrt{2\rho|\Delta p|}/\rho_0\, \mathrm{sign}\,\Delta p, \quad
              C_d = \left(1.5 + 13.74 \sqrt{x}\right)^{-1/2} \ (x < \tfrac{1}{50}), \quad
              C_d = \left(2.28 + 64 x\right)^{-1/2} \ (x > \tfrac{1}{50}), \quad x = \frac{l}{d\, Re}

    \Delta p = p_a - p_b [Pa]; d = `diameter`, l = `length` [m]; Re = |v| d/\nu [-]; n = `parallel` [-] tubes side by
    side; \rho [kg/m^3], \nu [m^2/s] at the mean pressure, \rho_0 at 0 bar gauge. The two formulas, 1.7 % apart where
    they meet, are joined smoothly by the weight of Shah (1978), within 1.5 % of the one that holds. Drilled restrictors
    of one to some ten diameters; not for turbulent flow in long tubes (`pipe_resistance`), sharp edges (`orifice`) or
    cavitating flow.
    Source: H. E. Merritt, Hydraulic Control Systems (1967), chapter 3, after Shapiro, Siegel & Kline (1954); M. G.
    Rabie, Fluid Power Engineering (2009), Eqs. 2.40 and 2.41; R. K. Shah, J. Fluids Eng. 100 (1978) 177-179.
    """

    diameter: Length = Field(gt=0, description="inner diameter")
    length: Length = Field(gt=0, description="length")
    parallel: Ratio = Field(default=1.0, ge=0, description="number of equal tubes side by side")

    a = takes_pressure("upstream")
    b = takes_pressure("downstream")
    q = observable(Flow, "flow from a to b")
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, fluid: Fluid) -> Equations:
        q = self.parallel * short_tube_flow(p_a, p_b, self.diameter, self.length, fluid)
        return {"q_a": q, "q_b": -q, "q": q}


class MeasuredResistance(Component):
    r"""Resistance known by its measured curve: a laminar part and a turbulent part, carried over to other oils.

    .. math:: p_a - p_b = R\, \frac{\rho\nu}{\rho_r \nu_r}\, Q + K \frac{\rho}{\rho_r}\, Q |Q|, \quad
              q = \frac{\rho}{\rho_0} Q

    p [Pa] gauge; Q [m^3/s] volume flow from a to b; R = `laminar` [Pa s/m^3], K = `turbulent` [Pa s^2/m^6], as measured
    with an oil of \rho_r = `reference_density` [kg/m^3] and \nu_r = `reference_viscosity` [m^2/s]; \rho, \nu at the
    mean pressure, \rho_0 at 0 bar gauge. Solved for the flow, Q = 2 \Delta p/(r + sqrt(r^2 + 4 k|\Delta p|)) with r, k
    the two factors above. From two points of a maker's curve, (q_1, p_1) and (q_2, p_2): K = (p_2/q_2 - p_1/q_1)/(q_2 -
    q_1), R = p_1/q_1 - K q_1. Not for curves of another shape. Source: Poiseuille's law and Bernoulli's quadratic loss
    in series (Forchheimer, 1901).
    """

    laminar: FlowResistance = Field(gt=0, description="drop over flow at small flows, with the reference oil")
    turbulent: QuadraticResistance = Field(default=0.0, ge=0, description="further drop over flow squared, likewise")
    reference_density: Density = Field(default=860.0, gt=0, description="density of the oil of the measured curve")
    reference_viscosity: KinematicViscosity = Field(default=30e-6, gt=0, description="its kinematic viscosity")

    a = takes_pressure("first end")
    b = takes_pressure("second end")
    q = observable(Flow, "flow from a to b")
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, fluid: Fluid) -> Equations:
        mean = (p_a + p_b) / 2
        heavier = fluid.density(mean) / self.reference_density
        thicker = heavier * fluid.kinematic_viscosity(mean) / self.reference_viscosity
        volume_flow = rising_root(p_a - p_b, thicker * self.laminar, heavier * self.turbulent)
        q = referred_flow(volume_flow, mean, fluid)
        return {"q_a": q, "q_b": -q, "q": q}
