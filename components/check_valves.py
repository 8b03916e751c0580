"""Check valves without moving parts of their own: the opening follows the pressures at once."""

from pydantic import Field

from crescentlab.component import Component, Equations
from crescentlab.domain import dissipates, observable, reads_pressure, takes_pressure
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr, maximum, minimum
from crescentlab.units import Area, Flow, FlowConductance, Length, Pressure, Ratio

from .flow_laws import DIAMETER_ROUNDING, hydraulic_diameter_of, orifice_flow, referred_flow
from .valve_laws import Metering, clipped


class CheckValve(Component):
    r"""Check valve without mass: closed below its cracking pressure, then open in proportion to what exceeds it.

    .. math:: q = n\, C_d\, s A \sqrt{2\rho\,\Delta p}/\rho_0, \quad
              s = \min(\max((\Delta p - p_c)/p_r, 0), 1), \quad C_d = C_{d,max} \tanh(2\lambda/\lambda_c)

    \Delta p = p_a - p_b [Pa]; A = `area` [m^2]; p_c = `cracking_pressure`, p_r = `opening_range` [Pa]; s = `lift` [-];
    \lambda = (d_h/\nu) sqrt(2\Delta p/\rho) [-] with d_h = \sqrt{4sA/\pi + d_r^2}, d_r = `diameter_rounding` [m]; \rho
    [kg/m^3] and \nu [m^2/s] at the mean pressure, \rho_0 at 0 bar gauge; n = `parallel` [-] equal valves side by side.
    It passes nothing from b to a. Stands for a filter's bypass valve or a nozzle that a spring keeps shut as well. Not
    for the motion of the poppet, flow forces, or leakage over the seat.
    Source: Rundo & Corvaglia (2016), Eqs. 27-29, with the lift of a poppet without mass on a linear spring.
    """

    area: Area = Field(ge=0, description="flow area when fully open")
    cracking_pressure: Pressure = Field(default=0.2e5, ge=0, description="drop at which the poppet leaves its seat")
    opening_range: Pressure = Field(gt=0, description="further drop until it is fully open")
    cd_max: Ratio = Field(default=0.7, gt=0, le=1, description="largest discharge coefficient")
    lambda_c: Ratio = Field(default=100.0, gt=0, description="critical flow number")
    parallel: Ratio = Field(default=1.0, ge=0, description="number of equal valves side by side")
    diameter_rounding: Length = Field(default=DIAMETER_ROUNDING, gt=0, description="rounding of the diameter at 0 area")

    a = takes_pressure("inlet")
    b = takes_pressure("outlet")
    q = observable(Flow, "flow from a to b")
    lift = observable(Ratio, "share of the full opening")
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, fluid: Fluid) -> Equations:
        lift = minimum(maximum((p_a - p_b - self.cracking_pressure) / self.opening_range, 0.0), 1.0)
        area = lift * self.area
        d_h = hydraulic_diameter_of(area, self.diameter_rounding)
        q = self.parallel * orifice_flow(p_a, p_b, area, d_h, self.cd_max, self.lambda_c, fluid)
        return {"q_a": q, "q_b": -q, "q": q, "lift": lift}


class IdealCheckValve(Component):
    r"""Ideal check valve: almost no resistance forwards, nothing backwards.

    .. math:: q = \frac{\rho}{\rho_0} G\, \max(p_a - p_b, 0)

    p [Pa] gauge; G = `conductance` [m^3/(s Pa)], volume flow over drop, large: the drop that it costs is nearly q/G;
    \rho [kg/m^3] at the mean pressure, \rho_0 at 0 bar gauge. Not where the drop or the
    opening of the valve matters (`check_valve`). Source: definition of a one-way resistance.
    """

    conductance: FlowConductance = Field(
        default=1e-7, gt=0, description="flow over drop, forwards; 60 L/min at 0.1 bar"
    )

    a = takes_pressure("inlet")
    b = takes_pressure("outlet")
    q = observable(Flow, "flow from a to b")
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, fluid: Fluid) -> Equations:
        q = referred_flow(self.conductance * maximum(p_a - p_b, 0.0), (p_a + p_b) / 2, fluid)
        return {"q_a": q, "q_b": -q, "q": q}


class PilotOperatedCheckValve(Metering, Component):
    r"""Check valve that a pilot pressure can open backwards; without mass.

    .. math:: q = C_d\, s A \sqrt{2\rho|\Delta p|}/\rho_0\, \mathrm{sign}\,\Delta p, \quad
              s = \min(\max((\Delta p + R (p_x - p_a) - p_c)/p_r, 0), 1)

    \Delta p = p_a - p_b [Pa]; p_x [Pa] of the pilot; R = `pilot_ratio` [-], area of the pilot piston over that of the
    seat; p_c = `cracking_pressure`, p_r = `opening_range` [Pa]; A = `area` [m^2]; s = `lift` [-]; C_d [-] follows the
    flow number as in `check_valve`; \rho [kg/m^3] at the mean pressure, \rho_0 at 0 bar gauge. Against a load p_b it
    opens backwards from p_x = p_a + (p_b - p_a + p_c)/R on. The pilot port takes no fluid; its piston's other side is
    under p_a. Not for a decompression poppet, the motion of poppet and piston, nor leakage.
    Source: balance of forces on poppet and pilot piston; ISO 1219-1, pilot-operated non-return valve.
    """

    cracking_pressure: Pressure = Field(default=0.2e5, ge=0, description="drop at which the poppet leaves its seat")
    opening_range: Pressure = Field(gt=0, description="further drop until it is fully open")
    pilot_ratio: Ratio = Field(default=3.0, gt=0, description="area of the pilot piston over that of the seat")

    a = takes_pressure("inlet")
    b = takes_pressure("outlet, where the load is held")
    pilot = reads_pressure("pilot port X")
    q = observable(Flow, "flow from a to b")
    lift = observable(Ratio, "share of the full opening")
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, p_pilot: Expr, fluid: Fluid) -> Equations:
        opens = p_a - p_b + self.pilot_ratio * (p_pilot - p_a)
        lift = clipped((opens - self.cracking_pressure) / self.opening_range)
        q = self.metered(p_a, p_b, lift, fluid)
        return {"q_a": q, "q_b": -q, "q": q, "lift": lift}
